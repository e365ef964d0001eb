"""The mission over HTTP, as UPISAS expects it of an exemplar: monitor, execute, adaptation options and their schemas.

The standard library's server does: one machine, one client at a time, small bodies; a framework would be one more
dependency for ten paths.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from math import inf
from typing import Any, Final

from suave_des.domain import THRUSTER_NAMES
from suave_des.errors import InputError, SuaveDesError, shown
from suave_des.interfaces.mission import Mission
from suave_des.scenario.modes import grounding_modes
from suave_des.simulation.simulator import Simulator

BODY_LIMIT_BYTES: Final = 100_000
_READ_TIMEOUT_S: Final = 10.0
_ADVANCE: Final = "advance_s"
_LONGEST_S: Final = 1e6
Json = dict[str, Any]


class Session:
    """One mission at a time, as JSON.

    Args:
        simulator: of the scenario.
        run, seed: of the first mission.
        real_time_factor: seconds of mission time per second; 0: time advances only when a client requests it.
    """

    def __init__(self, simulator: Simulator, run: int = 1, seed: int = 1, real_time_factor: float = 0.0) -> None:
        if not 0.0 <= real_time_factor < inf:
            raise InputError(f"real-time factor: {real_time_factor:g} is out of range", remedy="0, or a number above")
        self._simulator, self._factor = simulator, real_time_factor
        self._run, self._seed = run, seed
        self._lock = threading.Lock()
        self._begin(run, seed)

    def answer(self, method: str, path: str, content: Any) -> Json:
        """Answer a request.

        Raises:
            LookupError: there is no such path.
            InputError: the content is invalid.
        """
        with self._lock:  # several clients are served one after the other
            self._catch_up()
            if (serve := self._paths.get((method, path))) is None:
                raise LookupError(path)
            return serve(content)

    @property
    def _paths(self) -> Mapping[tuple[str, str], Callable[[Any], Json]]:
        return {
            ("GET", "/monitor"): lambda _: self._monitor(),
            ("PUT", "/execute"): self._execute,
            ("GET", "/adaptation_options"): lambda _: self._options(),
            ("GET", "/monitor_schema"): lambda _: self._monitor_schema(),
            ("GET", "/execute_schema"): lambda _: self._execute_schema(),
            ("GET", "/adaptation_options_schema"): lambda _: self._options_schema(),
            ("POST", "/advance"): self._advance,
            ("POST", "/start"): self._start,
            ("GET", "/metrics"): lambda _: asdict(self._mission.metrics()),
        }

    def _begin(self, run: int, seed: int) -> None:
        self._mission = Mission(self._simulator, run=run, seed=seed)
        self._mission.advance(1e-9)  # the first task is requested at t = 0
        self._began_s = time.monotonic()

    def _catch_up(self) -> None:
        if self._factor > 0.0 and not self._mission.is_over:
            now_s = (time.monotonic() - self._began_s) * self._factor
            self._mission.advance(max(now_s, self._mission.now_s))

    def _monitor(self) -> Json:
        mission = self._mission
        found: Json = {
            "time_s": round(mission.now_s, 6),
            "is_over": mission.is_over,
            "task": mission.task.name if mission.task else "",
            "distance_inspected_m": mission.distance_inspected_m,
        }
        found |= {name: mission.measured(name) for name in mission.attributes}
        found |= {name: mission.components.get(name, "") for name in THRUSTER_NAMES}
        found |= {name: mission.current_mode(name) or "" for name in self._options()}
        pose = mission.pose
        return found | dict(zip(pose._fields, pose, strict=True))

    def _options(self) -> Json:
        return {function: list(grounding_modes(modes)) for function, modes in self._mission.modes.items()}

    def _execute(self, content: Any) -> Json:
        wanted = _object(content)
        step_s = _seconds(wanted.pop(_ADVANCE, 0.0))
        for function, mode in wanted.items():
            self._mission.check_mode(function, mode)
        if not self._mission.is_over:
            for function, mode in wanted.items():
                self._mission.change_mode(function, mode)
            self._mission.advance(self._mission.now_s + step_s)
        return {"time_s": round(self._mission.now_s, 6), "is_over": self._mission.is_over}

    def _advance(self, content: Any) -> Json:
        wanted = _object(content, (_ADVANCE, "until_s"))
        if len(wanted) != 1:
            raise InputError("says nothing, or too much", remedy=f"give {_ADVANCE} or until_s")
        now_s = self._mission.now_s
        to_s = now_s + _seconds(wanted[_ADVANCE]) if _ADVANCE in wanted else _seconds(wanted["until_s"])
        self._mission.advance(to_s)
        return self._monitor()

    def _start(self, content: Any) -> Json:
        wanted = _object(content, ("run", "seed"))
        self._begin(wanted.get("run", self._run), wanted.get("seed", self._seed))
        return self._monitor()

    def _monitor_schema(self) -> Json:
        number, text, either = {"type": "number"}, {"type": "string"}, {"type": ["number", "null"]}
        kinds: Json = {"is_over": {"type": "boolean"}, "task": text}
        kinds |= dict.fromkeys(self._mission.attributes, either)
        kinds |= dict.fromkeys((*THRUSTER_NAMES, *self._options()), text)
        return _schema({name: kinds.get(name, number) for name in self._monitor()}, required=True)

    def _execute_schema(self) -> Json:
        modes = {function: {"type": "string", "enum": list(each)} for function, each in self._mission.modes.items()}
        return _schema({**modes, _ADVANCE: {"type": "number", "minimum": 0}}, required=False)

    def _options_schema(self) -> Json:
        return _schema(
            {name: {"type": "array", "items": {"type": "string"}} for name in self._options()}, required=True
        )


def _schema(properties: Json, *, required: bool) -> Json:
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "type": "object",
        "properties": properties,
        "required": list(properties) if required else [],
        "additionalProperties": False,
    }


def _object(content: Any, known: Sequence[str] = ()) -> Json:
    """Return a copy of an object; where its keys are known beforehand, it may have no others."""
    if not isinstance(content, dict):
        raise InputError(f"expected an object, got {shown(content)}", remedy='such as {"advance_s": 2.0}')
    if known and (unknown := [key for key in content if key not in known]):
        raise InputError(f"unknown key {shown(unknown[0])}", remedy=f"give {' or '.join(known)}")
    return dict(content)


def _seconds(value: Any) -> float:
    if type(value) not in (int, float) or not 0 <= value <= _LONGEST_S:  # true is an int, too, and nan in no range
        raise InputError(f"{shown(value)} is not a time in seconds", remedy=f"a number from 0 to {_LONGEST_S:g}")
    return float(value)


class _Handler(BaseHTTPRequestHandler):
    """Reads requests and writes answers; the session interprets them."""

    server: Server
    protocol_version = "HTTP/1.1"
    timeout = _READ_TIMEOUT_S

    def log_message(self, format: str, *arguments: Any) -> None:
        """Write no log line for each request."""

    def do_GET(self) -> None:
        """Answer a request by any of the methods."""
        method, path = self.command, self.path.partition("?")[0].rstrip("/") or "/"
        try:
            content = self._content() if method != "GET" else None
            status, answer = HTTPStatus.OK, self.server.session.answer(method, path, content)
        except LookupError:
            status, answer = HTTPStatus.NOT_FOUND, {"error": f"there is no {method} {path}"}
        except OverflowError as error:
            self.close_connection = True  # the rest of the body is not read
            status, answer = HTTPStatus.REQUEST_ENTITY_TOO_LARGE, {"error": str(error)}
        except SuaveDesError as error:
            status, answer = HTTPStatus.BAD_REQUEST, {"error": str(error)}
        body = json.dumps(answer).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    do_PUT = do_POST = do_GET  # noqa: N815 - names that http.server looks for

    def _content(self) -> Any:
        length = self.headers.get("Content-Length", "0")
        if not (length.isascii() and length.isdigit()) or self.headers.get("Transfer-Encoding"):
            self.close_connection = True
            raise InputError("the body's length is not given", remedy="send a Content-Length")
        if int(length[:20]) > BODY_LIMIT_BYTES:
            raise OverflowError(f"the body has more than {BODY_LIMIT_BYTES:,} bytes")
        body = self.rfile.read(int(length))
        try:
            return json.loads(body or b"{}")
        except (ValueError, RecursionError):
            raise InputError(f"the body is not JSON: {shown(body[:60].decode(errors='replace'))}") from None


class Server(ThreadingHTTPServer):
    """Serves a session at an address until it is shut down.

    Args:
        session: answers the requests.
        host: address to listen on; 127.0.0.1 is reachable only from this machine.
        port: 0: any that is free.

    Raises:
        InputError: the address cannot be used.
    """

    daemon_threads = True

    def __init__(self, session: Session, host: str = "127.0.0.1", port: int = 3000) -> None:
        self.session = session
        try:
            super().__init__((host, port), _Handler)
        except (OSError, OverflowError) as error:
            why = getattr(error, "strerror", None) or error
            raise InputError(f"{host}:{port} cannot be used: {why}", remedy="give another --host or --port") from None
