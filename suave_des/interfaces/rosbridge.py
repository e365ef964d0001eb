"""A mission as SUAVE's topics and services, over the rosbridge protocol (version 2: JSON over a web
socket), so that managers written for SUAVE connect without ROS.

All is done in one thread: an asyncio loop advances the mission as wall time passes, publishes, and
answers what clients have sent. Topics, services, types and rates: docs/guides/ros-managers.md.
"""

from __future__ import annotations

import asyncio
import json
import logging
import math
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field
from functools import partial
from http import HTTPStatus
from typing import Self

from scipy.spatial.transform import Rotation
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from suave_des.campaign.missions import Campaign, Finished, MissionRunner, Remark
from suave_des.clock import call_at, tick_at_or_after
from suave_des.domain import DEFAULT_MODE, Task
from suave_des.errors import InputError, did_you_mean, shown, unknown
from suave_des.files import Json, json_value
from suave_des.interfaces.client import CANCEL_TASK, REQUEST_TASK, ClientManager
from suave_des.interfaces.serve import (
    ADVANCE,
    BODY_LIMIT_BYTES,
    LATENCY,
    RefusedError,
    Senders,
    Session,
    check_factor,
    object_of,
    seconds,
    usable,
)
from suave_des.metrics.result import MissionResult
from suave_des.monitor.diagnostics import Diagnostic, Kind
from suave_des.monitor.measurements import Measurements
from suave_des.records.store import MissionKey
from suave_des.scenario.modes import Mode
from suave_des.simulation.simulator import Simulator

DIAGNOSTICS = "/diagnostics"
CLOCK = "/clock"
POSE = "/mavros/local_position/pose"
DETECTED = "/pipeline/detected"
INSPECTED = "/pipeline/distance_inspected"
TOPICS = {
    DIAGNOSTICS: "diagnostic_msgs/DiagnosticArray",
    CLOCK: "rosgraph_msgs/Clock",
    POSE: "geometry_msgs/PoseStamped",
    DETECTED: "std_msgs/Bool",
    INSPECTED: "std_msgs/Float32",
}
"""What the mission publishes: topics with their types."""
ADVANCE_SERVICE = "/suave_des/advance"
_CLOCK_S, _POSE_S, _SECOND_S = 0.1, 0.25, 1.0
"""Mission time between messages."""
_LATER_S = 1e-6
_SETTLE_S = 0.5
_TICK_S = 0.005
_LONGEST_S = 0.05
"""Wall time that may pass by itself at once; in more, this process was stopped or busy."""
_FLUSH_S = 1.0
_LEVELS = ("info", "warning", "error", "none")
_MOST_CLIENTS = 32
_MOST_NAMES = 100
"""Subscriptions, topics and services of one client, each."""
_BACKLOG = 500
"""While so many messages wait for a slow client, it gets none that are published, nor answers."""
_LOCK_STEP_BACKLOG = 100_000
"""The same, of what is published: what one advance publishes is to arrive whole."""
_LONGEST_QUEUE = 1000
_LONGEST_NAME = 200
_IN_REAL_TIME = "missions in real time do not repeat: wall time decides when a client acts"
_logger = logging.getLogger("suave_des.rosbridge")
_logger.setLevel(logging.CRITICAL)  # a handshake that fails is the client's affair


@dataclass
class _Subscription:
    """A client's subscription to a topic: several, told apart by their ids, count as one.

    Attributes:
        wishes: by id, the least time between messages in s, and how many may wait for it.
        sent_s: when the last message was sent.
    """

    wishes: dict[str, tuple[float, int]] = field(default_factory=dict)
    sent_s: float = -math.inf
    waiting: deque[str] = field(default_factory=deque)

    def put(self, text: str) -> None:
        """Add a message, which may have to wait, or be dropped."""
        length = min(_LONGEST_QUEUE, max(length for _, length in self.wishes.values()))
        may_be_sent = not self.waiting and self._is_free()
        if length or may_be_sent:
            self.waiting.append(text)
            while len(self.waiting) > max(1, length):
                self.waiting.popleft()

    def take(self) -> Iterator[str]:
        """Yield the messages that may be sent now."""
        while self.waiting and self._is_free():
            self.sent_s = time.monotonic()
            yield self.waiting.popleft()

    def _is_free(self) -> bool:
        return time.monotonic() - self.sent_s >= min(each for each, _ in self.wishes.values())


@dataclass(eq=False)
class _Client:
    """A connected client.

    Attributes:
        subscriptions: by topic, as the client calls it.
        topics: that it publishes, with their types.
        services: that it offers, by their whole name as it calls them.
        level: of status messages, none or not.
        out: what is sent to it.
        most_waiting: of what is published.
    """

    connection: ServerConnection
    most_waiting: int
    subscriptions: dict[str, _Subscription] = field(default_factory=dict)
    topics: dict[str, str] = field(default_factory=dict)
    services: dict[str, str] = field(default_factory=dict)
    level: str = "error"
    out: asyncio.Queue[str] = field(default_factory=asyncio.Queue)

    def send(self, op: str, **content: object) -> None:
        """Send a message."""
        self.out.put_nowait(json.dumps({"op": op, **content}))

    def refuse(self, problem: str, message: Json) -> None:
        """Send a status message about one of the client's."""
        if self.level != "none":
            self.send("status", level="error", msg=problem, **_id_of(message))

    def flush(self) -> None:
        """Send what subscriptions hold, unless too much is waiting."""
        for subscription in self.subscriptions.values():
            for text in subscription.take():
                if self.out.qsize() < self.most_waiting:
                    self.out.put_nowait(text)

    async def write(self) -> None:
        """Send what waits, for ever."""
        with suppress(ConnectionClosed):
            while True:
                await self.connection.send(await self.out.get())


@dataclass
class _Timer:
    """Publishes something at its times."""

    next_s: Callable[[float], float]
    publish: Callable[[], None]
    due_s: float = 0.0


class Bridge:
    """Serves missions until it is left: at 127.0.0.1 only to this machine, at port 0 on any that is
    free. A context.

    Args:
        real_time_factor: seconds of mission time per second; 0: time advances only when a client
            calls /suave_des/advance.
        host_names: as of serve.Server.

    Attributes:
        port: the port.

    Raises:
        InputError: the address cannot be used.
    """

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = 9090,
        host_names: Sequence[str] = (),
        real_time_factor: float = 1.0,
    ) -> None:
        check_factor(real_time_factor)
        self._host = host
        self.port = port
        self._factor = real_time_factor
        self._senders = Senders((host, *host_names))
        self._runner = asyncio.Runner()
        self._clients: list[_Client] = []
        self._calls = 0
        self._ops: dict[str, Callable[[_Client, Json], None]] = {
            "advertise": self._advertise,
            "unadvertise": lambda client, message: _drop(client.topics, message, "topic"),
            "publish": self._relay,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "advertise_service": self._advertise_service,
            "unadvertise_service": lambda client, message: _drop(
                client.services, message, "service"
            ),
            "service_response": lambda client, message: None,  # of a task: the mission goes on
            "set_level": self._set_level,
        }

    def __enter__(self) -> Self:
        """Accept clients."""
        with usable(self._host, self.port):
            self._runner.run(self._open())
        ClientManager.bridges.add(self)
        return self

    def __exit__(self, *_: object) -> None:
        """Send what is left to send, and close all connections."""
        ClientManager.bridges.discard(self)
        self._runner.run(self._close())
        self._runner.close()

    def outcomes(
        self, campaign: Campaign, missions: Iterable[MissionKey], total: int
    ) -> Iterator[list[Finished]]:
        """Fly missions one after the other; an Executor."""
        for key, outcome in MissionRunner(campaign, self.fly).each(missions):
            yield [(key, outcome)]
            if self._factor:
                yield [(key, Remark(campaign.spec.managers[key.manager], _IN_REAL_TIME))]

    def fly(
        self, simulator: Simulator, manager: str, run: int, seed: int, record: bool
    ) -> MissionResult:
        """Fly a mission with whoever is connected."""
        self._session = Session(simulator, run, seed, self._factor, manager, record)
        self._mission = mission = self._session.mission
        assert isinstance(mission.manager, ClientManager)
        mission.manager.call = self._call
        self._joined_s = time.monotonic()
        self._in_force = dict.fromkeys(mission.modes, DEFAULT_MODE)
        self._is_detected = False
        mission.mode_manager.listeners.append(self._mode_effect)
        mission.bus.subscribe(self._component_status, (Kind.COMPONENT_STATUS,))
        mission.bus.subscribe(self._detection, (Kind.DETECTION,))
        self._timers = list(self._timers_of())
        with closing(mission):
            self._runner.run(self._go())
            return mission.result()

    # Clients.

    async def _open(self) -> None:
        self._inbox = asyncio.Queue[tuple[_Client, str | bytes]](_MOST_CLIENTS)
        self._server = await serve(
            self._handle,
            self._host,
            self.port,
            process_request=self._admit,
            close_timeout=_FLUSH_S,
            compression=None,
            max_size=BODY_LIMIT_BYTES,
            logger=_logger,
        )
        self.port = next(iter(self._server.sockets)).getsockname()[1]

    async def _close(self) -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(_FLUSH_S):
                while any(client.out.qsize() for client in self._clients):
                    await asyncio.sleep(_TICK_S)
        self._server.close()
        await self._server.wait_closed()

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        headers = request.headers
        address = connection.local_address[0]
        try:
            self._senders.check(headers.get("Host", ""), headers.get("Origin"), address)
            if len(self._clients) >= _MOST_CLIENTS:
                problem = f"{_MOST_CLIENTS} clients are connected"
                raise RefusedError(HTTPStatus.SERVICE_UNAVAILABLE, problem)
        except RefusedError as error:
            self._senders.report(error.args[1])
            return connection.respond(*error.args)
        return None

    async def _handle(self, connection: ServerConnection) -> None:
        client = _Client(connection, _BACKLOG if self._factor else _LOCK_STEP_BACKLOG)
        self._clients.append(client)
        writer = asyncio.create_task(client.write())
        with suppress(ConnectionClosed):
            async for text in connection:
                await self._inbox.put((client, text))
                while client.out.qsize() >= _BACKLOG and not writer.done():
                    await asyncio.sleep(_TICK_S)
        self._clients.remove(client)
        writer.cancel()

    # The mission.

    async def _go(self) -> None:
        while not self._mission.is_over:
            received = None
            with suppress(TimeoutError):
                async with asyncio.timeout(_TICK_S):
                    received = await self._inbox.get()
            if self._has_begun():
                self._catch_up()
            else:
                self._session.hold()
            if received is not None:
                self._answer(*received)
            for client in self._clients:
                client.flush()

    def _has_begun(self) -> bool:
        """Whether mission time passes: from some time after a client takes part, which may have
        more to set up.
        """
        now_s = time.monotonic()
        if not any(client.subscriptions or client.services for client in self._clients):
            self._joined_s = now_s
        settled = self._factor > 0.0 and now_s - self._joined_s >= _SETTLE_S
        return settled or self._mission.now_s > 0.0

    def _catch_up(self) -> None:
        """Advance as wall time has passed."""
        longest_s = max(_LATER_S, _LONGEST_S * self._factor)
        self._advance(min(self._session.due_s(), self._mission.now_s + longest_s))

    def _advance(self, until_s: float) -> None:
        """Advance mission time, and publish what is due until then."""
        mission = self._mission
        while not mission.is_over:
            due_s = min(timer.due_s for timer in self._timers)
            mission.advance(max(mission.now_s, min(due_s, until_s)))
            if due_s > until_s:
                return
            for timer in self._timers:
                if timer.due_s <= due_s and not mission.is_over:
                    timer.publish()
                    timer.due_s = timer.next_s(due_s + _LATER_S)

    def _timers_of(self) -> Iterator[_Timer]:
        mission = self._mission
        for measured in mission.manager.system.measurements.values():
            publish = partial(self._publish_measured, measured)
            yield _Timer(measured.next_message_s, publish, measured.next_message_s(0.0))
        for topic, period_s, message in (
            (CLOCK, _CLOCK_S, lambda: {"clock": _stamp(mission.now_s)}),
            (POSE, _POSE_S, self._pose),
            (DETECTED, _SECOND_S, lambda: {"data": self._is_detected}),
            (INSPECTED, _SECOND_S, lambda: {"data": mission.distance_inspected_m}),
        ):
            next_s = partial(tick_at_or_after, phase_s=0.0, period_s=period_s)
            yield _Timer(next_s, partial(self._publish, topic, message))

    def _publish(self, topic: str, message: Callable[[], object]) -> None:
        """Publish a message, which is made only if somebody subscribes to the topic."""
        body = ""
        for client in self._clients:
            for name, subscription in client.subscriptions.items():
                if _whole(name) == topic:
                    body = body or json.dumps(message())
                    subscription.put(
                        f'{{"op": "publish", "topic": {json.dumps(name)}, "msg": {body}}}'
                    )
            client.flush()

    def _publish_measured(self, measured: Measurements) -> None:
        value = measured.value(self._mission.now_s)
        if value is not None:
            self._publish_status(str(Kind.QA_STATUS), measured.key, value)

    def _publish_status(self, message: str, key: str, value: object) -> None:
        """Publish a diagnostic as the exemplar's monitors fill it."""
        values = [{"key": key, "value": str(value)}]
        status = {"level": 0, "name": "", "message": message, "hardware_id": "", "values": values}
        self._publish(
            DIAGNOSTICS, lambda: {"header": _header(self._mission.now_s), "status": [status]}
        )

    def _component_status(self, diagnostic: Diagnostic) -> None:
        self._publish_status(str(diagnostic.kind), diagnostic.key, diagnostic.value)

    def _detection(self, diagnostic: Diagnostic) -> None:
        self._is_detected = True
        self._publish(DETECTED, lambda: {"data": True})

    def _mode_effect(self, function: str, mode: Mode) -> None:
        self._in_force[function] = mode.name

    def _pose(self) -> Json:
        x_m, y_m, z_m, *attitude_rad = self._mission.pose
        turned = Rotation.from_euler("xyz", attitude_rad).as_quat().tolist()
        position = {"x": x_m, "y": y_m, "z": z_m}
        pose = {"position": position, "orientation": dict(zip("xyzw", turned, strict=True))}
        return {"header": _header(self._mission.now_s, "map"), "pose": pose}

    def _call(self, service: str, task: Task) -> bool:
        """Call a service that clients may offer; return whether one does."""
        for client in reversed(self._clients):
            if name := client.services.get(service):
                self._calls += 1
                called = f"call_service:{name}:{self._calls}"
                client.send("call_service", id=called, service=name, args={"task_name": task.name})
                return True
        return False

    # What clients send.

    def _answer(self, client: _Client, text: str | bytes) -> None:
        try:
            message = json_value(text)
        except ValueError:
            client.refuse(f"not JSON: {shown(text[:60])}", {})
            return
        op = message.get("op") if isinstance(message, dict) else None
        if not isinstance(op, str) or op not in self._ops:
            known = ", ".join(self._ops)
            client.refuse(f"unknown operation {shown(op)}; known: {known}", {})
            return
        try:
            self._ops[op](client, message)
        except InputError as error:
            client.refuse(f"{op}: {error}", message)

    def _advertise(self, client: _Client, message: Json) -> None:
        topic = _whole(_text(message, "topic"))
        _check_is_clients(topic)
        _check_room(client.topics, topic)
        client.topics[topic] = _kind(_text(message, "type"))

    def _relay(self, client: _Client, message: Json) -> None:
        topic = _whole(_text(message, "topic"))
        _check_is_clients(topic)
        self._publish(topic, lambda: message.get("msg", {}))

    def _subscribe(self, client: _Client, message: Json) -> None:
        name = _text(message, "topic")
        given = _kind(_text(message, "type", ""))
        topic = _whole(name)
        topics = {key: kind for each in self._clients for key, kind in each.topics.items()} | TOPICS
        if not given and topic not in topics:
            remedy = f"{did_you_mean(topic, topics)}; or give its type"
            raise InputError(f"nobody publishes {shown(topic)}", remedy=remedy)
        if given and given != topics.get(topic, given):
            raise InputError(f"{topic} is of type {topics[topic]}, not {given}")
        if _text(message, "compression", "none") != "none":
            raise InputError("there is no compression here", remedy="leave it out")
        _check_room(client.subscriptions, name)
        wanted_by = _text(message, "id", "")
        subscription = client.subscriptions.get(name) or _Subscription()
        _check_room(subscription.wishes, wanted_by)
        subscription.wishes[wanted_by] = (
            _number(message, "throttle_rate") / 1e3,
            int(_number(message, "queue_length")),
        )
        client.subscriptions[name] = subscription

    def _unsubscribe(self, client: _Client, message: Json) -> None:
        name = _text(message, "topic")
        if name in client.subscriptions:
            wishes = client.subscriptions[name].wishes
            wishes.pop(_text(message, "id", ""), None)
            if "id" not in message or not wishes:
                del client.subscriptions[name]

    def _call_service(self, client: _Client, message: Json) -> None:
        service = _text(message, "service")
        values: Json | str
        try:
            values = self._served(_whole(service), message.get("args") or {})
        except InputError as error:
            values = str(error)
        answer = {"service": service, "values": values, "result": isinstance(values, dict)}
        client.send("service_response", **answer, **_id_of(message))

    def _served(self, service: str, given: object) -> Json:
        if service == ADVANCE_SERVICE:
            step_s = seconds(_arguments(given, (ADVANCE,)).get(ADVANCE))
            self._advance(self._mission.now_s + max(step_s, _LATER_S))
            return self._session.time()
        kinds = "change_mode", "get_mode", "get_available_modes"
        known = [f"/{each}/{kind}" for each in self._mission.modes for kind in kinds]
        if service not in known:
            raise unknown(f"there is no service {shown(service)}", service, known)
        function, _, name = service[1:].rpartition("/")
        if name == "change_mode":
            return self._change_mode(function, _arguments(given, ("mode_name", LATENCY)))
        if name == "get_mode":
            requested = self._mission.current_mode(function) or ""
            return {"current_mode": self._in_force[function], "target_mode": requested}
        return {"available_modes": self._mission.modes[function]}

    def _change_mode(self, function: str, wanted: Json) -> Json:
        mode = _text(wanted, "mode_name")
        latency_s = seconds(wanted.get(LATENCY, 0.0))
        mission = self._mission
        request = partial(self._session.change_modes, {function: mode}, latency_s)
        if latency_s > 0.0:
            call_at(mission.env, mission.now_s + latency_s, request)
        else:
            request()
        return {"success": mode in mission.modes[function]}

    def _advertise_service(self, client: _Client, message: Json) -> None:
        name = _text(message, "service")
        service = _whole(name)
        if service not in (REQUEST_TASK, CANCEL_TASK):
            remedy = f"offer {REQUEST_TASK} and {CANCEL_TASK}"
            raise InputError(f"nobody here would call {shown(service)}", remedy=remedy)
        client.services[service] = name

    def _set_level(self, client: _Client, message: Json) -> None:
        level = _text(message, "level")
        if level not in _LEVELS:
            raise unknown(f"there is no level {shown(level)}", level, _LEVELS)
        client.level = level


def _whole(name: str) -> str:
    """Return the whole name of a topic or service: nodes may leave the first slash out."""
    return f"/{name.removeprefix('/')}"


def _kind(name: str) -> str:
    """Return a type as ROS 1 writes it: ROS 2 has pkg/msg/Type."""
    return name.replace("/msg/", "/")


def _stamp(time_s: float) -> Json:
    whole_s = math.floor(time_s + _LATER_S)
    return {"sec": whole_s, "nanosec": max(0, round((time_s - whole_s) * 1e9))}


def _header(time_s: float, frame: str = "") -> Json:
    return {"stamp": _stamp(time_s), "frame_id": frame}


def _id_of(message: Json) -> Json:
    return {"id": message["id"]} if "id" in message else {}


def _text(message: Json, key: str, default: str | None = None) -> str:
    value = message.get(key, default)
    if not isinstance(value, str) or len(value) > _LONGEST_NAME or not value.isprintable():
        raise InputError(f"{key} is {shown(value)}", remedy="give a short text")
    return value


def _number(message: Json, key: str) -> float:
    value = message.get(key, 0)
    if type(value) not in (int, float) or not 0 <= value <= 1e6:
        raise InputError(f"{key} is {shown(value)}", remedy="give a number from 0 to 1,000,000")
    return float(value)


def _arguments(given: object, names: Sequence[str]) -> Json:
    """Return the arguments of a call by name; rosbridge takes them in order, too."""
    return object_of(
        dict(zip(names, given, strict=False)) if isinstance(given, list) else given, names
    )


def _check_is_clients(topic: str) -> None:
    if topic in TOPICS:
        raise InputError(f"{topic} is published by the mission", remedy="give another topic")


def _check_room(names: Collection[str], name: str) -> None:
    if name not in names and len(names) >= _MOST_NAMES:
        raise InputError(f"this client has {_MOST_NAMES} of them", remedy="give one up first")


def _drop(names: dict[str, str], message: Json, key: str) -> None:
    names.pop(_whole(_text(message, key)), None)
