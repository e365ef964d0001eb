"""The mission over HTTP, as UPISAS expects it of an exemplar: monitor, execute, adaptation options
and their schemas.

The standard library's server does: one machine, one client at a time, small bodies; a framework
would be one more dependency for ten paths.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from math import inf
from typing import Any
from urllib.parse import urlsplit

from suave_des.domain import THRUSTER_NAMES
from suave_des.errors import InputError, SuaveDesError, did_you_mean, shown
from suave_des.files import Json, json_value
from suave_des.scenario.modes import grounding_modes
from suave_des.simulation.mission import Mission
from suave_des.simulation.simulator import Simulator

BODY_LIMIT_BYTES = 100_000
_READ_TIMEOUT_S = 10.0
_LENGTH_DIGITS = 20
_MOST_REPORTS = 20
_LOCAL = ("localhost", "127.0.0.1", "::1")
_JSON = "application/json"
ADVANCE, LATENCY = "advance_s", "latency_s"
_LONGEST_S = 1e6
_FIRST_S = 1e-9
"""The mission time at which a client first sees it: the first task is requested at t = 0."""
REQUESTS = {
    "GET /": "this list",
    "GET /monitor": "what the mission's state is; null: not measured yet",
    "GET /monitor_schema": "JSON schema of the answer of /monitor, with what each name means",
    "PUT /execute": "lets latency_s pass, requests modes by function, then advances by advance_s;"
    " null: as it is",
    "GET /execute_schema": "JSON schema of the body of /execute",
    "GET /adaptation_options": "the modes of each function",
    "GET /adaptation_options_schema": "JSON schema of the answer of /adaptation_options",
    "POST /advance": "advances mission time by advance_s; answers as /monitor",
    "POST /start": "begins another mission: run, seed; answers as /monitor",
    "GET /metrics": "a row of runs.csv",
}
"""What a session answers; bodies are JSON."""
_MEANINGS = {
    "time_s": "mission time",
    "is_over": "whether the mission has ended",
    "task": "the current task; empty: none",
    "distance_inspected_m": "length of pipeline that was inspected",
    "x_m": "position, east",
    "y_m": "position, north",
    "z_m": "position, up",
    "roll_rad": "attitude",
    "pitch_rad": "attitude",
    "yaw_rad": "attitude; 0 is east, positive to the north",
}
"""Of the names in /monitor that every scenario has."""


class Session:
    """One mission at a time, which clients see and change, over HTTP or rosbridge.

    Mission time advances when a client requests it, or as wall time passes.

    Args:
        run, seed: of the first mission.
        real_time_factor: seconds of mission time per second; 0: time advances only when a client
            requests it.
        manager: name of the manager that stands for the client; None: the caller.
        record: as of Mission.

    Attributes:
        mission: the current one.
    """

    mission: Mission

    def __init__(
        self,
        simulator: Simulator,
        run: int = 1,
        seed: int = 1,
        real_time_factor: float = 0.0,
        manager: str | None = None,
        record: bool = False,
    ) -> None:
        check_factor(real_time_factor)
        self._simulator = simulator
        self._factor = real_time_factor
        self._run = run
        self._seed = seed
        self._manager = manager
        self._record = record
        self._thought_s = 0.0
        self._lock = threading.Lock()
        self._answers: dict[str, Callable[[object], Json]] = {
            "GET /": lambda _: dict(REQUESTS),
            "GET /monitor": lambda _: self._monitor(),
            "PUT /execute": self._execute,
            "GET /adaptation_options": lambda _: self._options(),
            "GET /monitor_schema": lambda _: self._monitor_schema(),
            "GET /execute_schema": lambda _: self._execute_schema(),
            "GET /adaptation_options_schema": lambda _: self._options_schema(),
            "POST /advance": self._advance,
            "POST /start": self._start,
            "GET /metrics": lambda _: self._metrics(),
        }
        self._begin(run, seed)

    def hold(self) -> None:
        """Let wall time that has passed until now not count."""
        self._seen_s = time.monotonic()  # up to when time has passed by itself

    def due_s(self) -> float:
        """Return the mission time that wall time demands: what has passed since it was asked last
        or held, times the factor, from now on.
        """
        before_s = self._seen_s
        self.hold()
        return max(_FIRST_S, self.mission.now_s) + (self._seen_s - before_s) * self._factor

    def change_modes(self, modes: Mapping[str, str], thought_s: float) -> None:
        """Request modes by function, and count the mission time that it took to decide so."""
        manager = self.mission.manager
        requests = manager.system.modes.requests
        for function, mode in modes.items():
            manager.system.change_mode(function, mode)
        if manager.system.modes.requests > requests:
            manager.reasoning_time_s += thought_s

    def answer(self, method: str, path: str, content: object) -> Json:
        """Answer a request.

        Raises:
            LookupError: there is no such path.
            InputError: the content is invalid.
        """
        with self._lock:  # several clients are served one after the other
            before_s = self.mission.now_s
            self.mission.advance(self.due_s())
            self._thought_s = self.mission.now_s - before_s
            if (serve := self._answers.get(f"{method} {path}")) is None:
                raise LookupError(path)
            return serve(content)

    def methods(self, path: str) -> list[str]:
        """List the methods that a path answers."""
        end = f" {path}"
        return [each.removesuffix(end) for each in self._answers if each.endswith(end)]

    def _begin(self, run: int, seed: int) -> None:
        self.mission = Mission(
            self._simulator, self._manager, run=run, seed=seed, record=self._record
        )
        self.hold()

    def _monitor(self) -> Json:
        mission = self.mission
        found: Json = {
            **self.time(),
            "task": mission.task.name if mission.task else "",
            "distance_inspected_m": mission.distance_inspected_m,
        }
        found |= {name: mission.measured(name) for name in mission.manager.system.measurements}
        found |= {name: mission.components.get(name, "") for name in THRUSTER_NAMES}
        found |= {name: mission.current_mode(name) or "" for name in self._options()}
        pose = mission.pose
        return found | dict(zip(pose._fields, pose, strict=True))

    def _options(self) -> Json:
        return {
            function: list(grounding_modes(modes)) for function, modes in self.mission.modes.items()
        }

    def _execute(self, content: object) -> Json:
        mission = self.mission
        wanted = object_of(content, (*mission.modes, ADVANCE, LATENCY))
        # UPISAS sends every key of the schema: null leaves things as they are, like a key that is
        # not there.
        wanted = {key: value for key, value in wanted.items() if value is not None}
        step_s, latency_s = (seconds(wanted.pop(key, 0.0)) for key in (ADVANCE, LATENCY))
        for function, mode in wanted.items():
            mission.check_mode(function, mode)
        mission.advance(mission.now_s + latency_s)
        if not mission.is_over:
            self.change_modes(wanted, self._thought_s + latency_s)
            mission.advance(mission.now_s + step_s)
        return self.time()

    def time(self) -> Json:
        """Say what mission time it is."""
        return {"time_s": round(self.mission.now_s, 6), "is_over": self.mission.is_over}

    def _advance(self, content: object) -> Json:
        wanted = object_of(content, (ADVANCE,))
        self.mission.advance(self.mission.now_s + seconds(wanted.get(ADVANCE)))
        return self._monitor()

    def _start(self, content: object) -> Json:
        wanted = object_of(content, ("run", "seed"))
        self._begin(wanted.get("run", self._run), wanted.get("seed", self._seed))
        self.mission.advance(self.due_s())
        return self._monitor()

    def _metrics(self) -> Json:
        further = self.mission.result().further if self.mission.is_over else {}
        return {**asdict(self.mission.metrics()), **further}

    def _monitor_schema(self) -> Json:
        number = {"type": "number"}
        text = {"type": "string"}
        kinds: Json = {name: number | {"description": said} for name, said in _MEANINGS.items()}
        kinds["is_over"]["type"] = "boolean"
        kinds["task"]["type"] = "string"
        measured = {"type": ["number", "null"], "description": "measured; null: not yet"}
        status = text | {"description": "status of the thruster; empty: none was published"}
        mode = text | {"description": "mode of the function, requested last; empty: none"}
        kinds |= dict.fromkeys(self.mission.manager.system.measurements, measured)
        kinds |= dict.fromkeys(THRUSTER_NAMES, status) | dict.fromkeys(self._options(), mode)
        return _schema({name: kinds[name] for name in self._monitor()}, required=True)

    def _execute_schema(self) -> Json:
        modes = {function: {"enum": [*each, None]} for function, each in self.mission.modes.items()}
        time_s = {"type": ["number", "null"], "minimum": 0}
        return _schema({**modes, ADVANCE: time_s, LATENCY: time_s}, required=False)

    def _options_schema(self) -> Json:
        modes = {"type": "array", "items": {"type": "string"}}
        return _schema(dict.fromkeys(self._options(), modes), required=True)


def _schema(properties: Json, *, required: bool) -> Json:
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "type": "object",
        "properties": properties,
        "required": list(properties) if required else [],
        "additionalProperties": False,
    }


def check_factor(factor: float) -> None:
    """Check seconds of mission time per second.

    Raises:
        InputError: it is no such number.
    """
    if not 0.0 <= factor < inf:
        raise InputError(
            f"real-time factor: {factor:g} is out of range", remedy="0, or a number above"
        )


def object_of(content: object, known: Sequence[str]) -> Json:
    """Return a copy of an object, which may have no other keys than the known ones."""
    if not isinstance(content, dict):
        problem = f"expected an object, got {shown(content)}"
        raise InputError(problem, remedy=f"its keys may be {', '.join(known)}")
    if unknown := [key for key in content if key not in known]:
        raise InputError(f"unknown key {shown(unknown[0])}", remedy=did_you_mean(unknown[0], known))
    return dict(content)


def seconds(value: Any) -> float:
    """Return a time that a client gave, as a number."""
    # true is an int, too, and nan in no range
    if type(value) not in (int, float) or not 0 <= value <= _LONGEST_S:
        raise InputError(
            f"{shown(value)} is not a time in seconds", remedy=f"a number from 0 to {_LONGEST_S:g}"
        )
    return float(value)


class RefusedError(Exception):
    """A request that does not reach the session: its status, and why."""


class Senders:
    """Who may use a server: requests that a web page on another site may have a browser send are
    refused. A page can neither choose the address in Host, nor hide the one in Origin.

    Args:
        names: by which clients may call this machine, besides its address.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._names = {*_LOCAL, *map(str.lower, names)}
        self._reported = set[str]()

    def check(self, host: str, origin: str | None, address: str) -> None:
        """Check the headers of a request, and the address of this machine that it has reached.

        Raises:
            RefusedError: it may come from somebody else's page.
        """
        is_known = False
        with suppress(ValueError):
            is_known = urlsplit(f"//{host}").hostname in {*self._names, address}
        if not is_known:
            problem = f"Host {shown(host)} is not this server's address (--host-name accepts it)"
            raise RefusedError(HTTPStatus.MISDIRECTED_REQUEST, problem)
        if origin is not None and origin != f"http://{host}":
            raise RefusedError(
                HTTPStatus.FORBIDDEN, f"pages of {shown(origin)} may not use this server"
            )

    def report(self, refusal: str) -> None:
        """Print why a request was refused, once for each reason, and for few of them."""
        if refusal not in self._reported and len(self._reported) < _MOST_REPORTS:
            self._reported.add(refusal)
            print(f"a request was refused: {refusal}", file=sys.stderr, flush=True)


class _Handler(BaseHTTPRequestHandler):
    """Reads requests and writes answers; the session interprets them.

    Nor can a web page on another site send JSON without asking this server first; see Senders.
    """

    server: Server
    protocol_version = "HTTP/1.1"
    timeout = _READ_TIMEOUT_S

    def log_message(self, format: str, *arguments: object) -> None:
        """Write no log line for each request."""

    def do_GET(self) -> None:
        """Answer a request by any of the methods."""
        method = self.command
        path = self.path.partition("?")[0].rstrip("/") or "/"
        allowed = self.server.session.methods(path)
        try:
            sender = self.headers.get("Host", ""), self.headers.get("Origin")
            self.server.senders.check(*sender, self.connection.getsockname()[0])
            if method not in allowed:
                raise LookupError(path)
            content = self._content() if method != "GET" else None
            status = HTTPStatus.OK
            answer = self.server.session.answer(method, path, content)
        except RefusedError as error:
            self.close_connection = True  # a body would not be read
            status, problem = error.args
            answer = {"error": problem}
            self.server.senders.report(problem)
        except LookupError:
            known = f": it answers {' and '.join(allowed)}" if allowed else ""
            status = HTTPStatus.METHOD_NOT_ALLOWED if allowed else HTTPStatus.NOT_FOUND
            answer = {"error": f"there is no {method} {path}{known}"}
        except SuaveDesError as error:
            status = HTTPStatus.BAD_REQUEST
            answer = {"error": str(error)}
        self._answer(status, answer, allowed)

    do_PUT = do_POST = do_GET  # noqa: N815 - names that http.server looks for
    do_DELETE = do_PATCH = do_HEAD = do_OPTIONS = do_GET  # noqa: N815

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Answer what http.server itself refuses, such as a method of no name, in JSON, too."""
        self.close_connection = True
        is_method = code == HTTPStatus.NOT_IMPLEMENTED
        status = HTTPStatus.METHOD_NOT_ALLOWED if is_method else HTTPStatus(code)
        self._answer(status, {"error": message or status.phrase})

    def _answer(self, status: HTTPStatus, answer: Json, allowed: Sequence[str] = ()) -> None:
        body = json.dumps(answer).encode()
        self.send_response(status)
        if status == HTTPStatus.METHOD_NOT_ALLOWED:
            self.send_header("Allow", ", ".join(allowed))
        self.send_header("Content-Type", _JSON)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def _content(self) -> object:
        length = self.headers.get("Content-Length", "0")
        kind = self.headers.get_content_type()
        if not (length.isascii() and length.isdigit()) or self.headers.get("Transfer-Encoding"):
            raise RefusedError(
                HTTPStatus.BAD_REQUEST, "the body's length is not given (send a Content-Length)"
            )
        if len(length) > _LENGTH_DIGITS or int(length) > BODY_LIMIT_BYTES:
            problem = f"the body has more than {BODY_LIMIT_BYTES:,} bytes"
            raise RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, problem)
        if kind != _JSON:
            raise RefusedError(
                HTTPStatus.UNSUPPORTED_MEDIA_TYPE,
                f"the body is {kind} (send Content-Type: {_JSON})",
            )
        body = self.rfile.read(int(length))
        try:
            return json_value(body or b"{}")
        except ValueError:
            raise InputError(
                f"the body is not JSON: {shown(body[:60].decode(errors='replace'))}"
            ) from None


@contextmanager
def usable(host: str, port: int) -> Iterator[None]:
    """Say so, in an InputError, if an address cannot be used."""
    try:
        yield
    except (OSError, OverflowError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(
            f"{host}:{port} cannot be used: {why}", remedy="give another --host or --port"
        ) from None


class Server(ThreadingHTTPServer):
    """Serves a session until it is shut down: at 127.0.0.1 only to this machine, at port 0 on any
    that is free.

    Args:
        host_names: further names by which clients may call this machine, such as a container's.

    Raises:
        InputError: the address cannot be used.
    """

    daemon_threads = True

    def __init__(
        self,
        session: Session,
        host: str = "127.0.0.1",
        port: int = 3000,
        host_names: Sequence[str] = (),
    ) -> None:
        self.session = session
        self.senders = Senders((host, *host_names))
        with usable(host, port):
            super().__init__((host, port), _Handler)

    def handle_error(self, request: Any, client_address: object) -> None:
        """Let clients leave in the middle of a request or an answer; report anything else."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)
