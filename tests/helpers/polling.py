"""The plain version of whatever looks ahead: everything is polled, nothing is left out. Missions must be the same.

- Guidance reads the vehicle's position at each tick, and sends one set-point at a time.
- The detector looks at each row of the vehicle's track when its time has come.
- Managers are called at each of their times.
- Metacontrol analyzes and plans in each cycle, and executes each plan.
- Monitors publish each measured value, and managers read what was published.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Final
from unittest import mock

import numpy as np
import simpy
from numpy.typing import NDArray

from suave_des.clock import Alarm, Process, until
from suave_des.knowledge.deliberation import Conclusion
from suave_des.managed.mode_manager import ModeManager
from suave_des.managed.node import Log
from suave_des.managing.base import ManagedSystem, ManagingSubsystem
from suave_des.managing.metacontrol import Metacontrol
from suave_des.metrics.result import MissionMetrics
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.measurements import Measured, Thresholds
from suave_des.scenario.modes import Mode
from suave_des.simulation import mission
from suave_des.simulation.host import ManagerHost
from suave_des.simulation.simulator import Simulator
from suave_des.vehicle.guidance import SetPointSender, WaypointSource
from suave_des.vehicle.vehicle import STEP_S, ArrivalCheck, Vehicle, row_at
from suave_des.world.pipeline import first_point_in_view


class PollingGuidance:
    """Guidance without looking ahead: see `suave_des.vehicle.guidance.Guidance` for what it does."""

    def __init__(
        self,
        sender: SetPointSender,
        source: WaypointSource,
        make_timer: Callable[[Callable[[], None]], Alarm],
        check: Callable[[float], ArrivalCheck],
    ) -> None:
        self._sender = sender
        self._source = source
        self._timer = make_timer(self._tick)
        self._make_check = check
        self._check: ArrivalCheck | None = None
        self._next_tick = 0
        self._sent = 0
        self._is_due = True
        self._is_repeated = False

    def start_at(self, t_s: float, *, resumes: bool = False) -> None:
        self._is_due = not resumes
        self._is_repeated = self._is_repeated and resumes
        self._next_tick = 0
        if t_s <= self._timer.now_s:
            self._tick()
        else:
            self._timer.set(t_s)

    def stop(self) -> None:
        self.catch_up()
        self._timer.cancel()
        if self._check is not None:
            self._check = None
            self._sent -= self._next_tick

    def catch_up(self) -> None:
        """A tick that is due at this very time comes first."""
        while self._check is not None and self._next_tick <= self._check.last_tick_until(self._timer.now_s):
            self._tick()

    def waypoints_changed(self) -> None:
        """The next tick asks for the way-point anyway."""

    def _tick(self) -> None:
        if self._check is None:
            self._check = self._make_check(self._timer.now_s)
        check, source, tick = self._check, self._source, self._next_tick
        source.tick()
        while True:
            if not len(source.waypoints(1)):
                self._check = None
                source.completed()
                return
            if self._is_due:
                self._sender.send(*source.waypoints(1)[0, :2].tolist(), source.set_point_z_m())
                self._sent, self._is_due = tick, False
            if tick < self._sent + check.first_check_ticks:
                break
            if self._is_near(check, tick):
                source.reached(1)
                self._is_repeated = False
            elif tick >= self._sent + (check.resend_again_ticks if self._is_repeated else check.resend_ticks):
                source.not_reached()
                self._is_repeated = True
            else:
                break
            self._is_due = True
        self._next_tick = tick + 1
        self._timer.set(check.time_s(self._next_tick))

    def _is_near(self, check: ArrivalCheck, tick: int) -> bool:
        position = self._sender.vehicle.position(check.time_s(tick))
        waypoint = self._source.waypoints(1)[0]
        x_m, y_m, z_m = (abs(a - b) for a, b in zip(position, waypoint[:3].tolist(), strict=True))
        return max(x_m, y_m) <= check.half_width_m and z_m <= check.half_height_m


class PollingDetector:
    """Looks at each row of the track at its time: see `suave_des.managed.detection.PipelineDetector`."""

    def __init__(
        self,
        env: simpy.Environment,
        vehicle: Vehicle,
        visibility: tuple[NDArray[np.float64], NDArray[np.float64]],
        points: NDArray[np.float64],
        view_tangent: float,
        log: Log,
    ) -> None:
        self._log = log
        self.detected = env.event()
        self.first_point: int | None = None
        self.detected_s: float | None = None
        env.process(
            self._look(env, vehicle, visibility, partial(first_point_in_view, points=points, view_tangent=view_tangent))
        )

    def _look(
        self,
        env: simpy.Environment,
        vehicle: Vehicle,
        visibility: tuple[NDArray[np.float64], NDArray[np.float64]],
        in_view: Callable[[float, float, float, float], int],
    ) -> Process:
        measured = {row_at(t_s): value for t_s, value in zip(*visibility, strict=True)}
        visibility_m = math.nan
        for row in range(vehicle.last_row + 1):
            yield until(env, row * STEP_S)
            visibility_m = measured.get(row, visibility_m)
            seen = in_view(*vehicle.position(env.now), visibility_m)
            if seen >= 0:
                self.first_point, self.detected_s = seen, float(env.now)
                self._log("detection", "pipeline_detected", f"point {seen}")
                self.detected.succeed(seen)
                return


class Published(Measured):
    """What was published of a quality attribute: see `suave_des.monitor.measurements.Measured`."""

    is_tabulated = False

    def __init__(self, key: str) -> None:
        self.key = key
        self.times_s: list[float] = []
        self.values: list[float] = []

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        if diagnostic.key == self.key:
            self.times_s.append(diagnostic.time_s)
            self.values.append(float(diagnostic.value))

    def count_until(self, t_s: float) -> int:
        return bisect_right(self.times_s, t_s)

    def region(self, t_s: float, thresholds: Thresholds) -> int:
        raise AssertionError("managers that are called at each of their times need no regions")

    def next_crossing_s(self, t_s: float, thresholds: Thresholds) -> float:
        raise AssertionError("what will be published is not known")


class PlainMission(mission.MissionRun):
    """A mission whose managers read what monitors have published."""

    def _make_host(self) -> ManagerHost:
        measured = self._measured
        self._measured = {name: self._published(name) for name in measured}
        try:
            return super()._make_host()
        finally:
            self._measured = measured

    def _published(self, key: str) -> Published:
        published = Published(key)
        self.bus.subscribe(published.diagnostic, (Kind.QA_STATUS,))
        return published


def time_triggered(
    name: str,
    manager_type: type[ManagingSubsystem],
    run: int,
    system: ManagedSystem,
    bus: DiagnosticsBus,
    skips_idle_calls: bool,
) -> ManagerHost:
    """A host that calls its manager at each of its times."""
    return ManagerHost(name, manager_type, run, system, bus, skips_idle_calls=False)


def analyze_and_plan_anew(self: Metacontrol) -> Conclusion:
    """Go through analyze and plan, without looking up the result for an equal state."""
    inference = self.analyze()
    return Conclusion(inference, self.plan(inference))


def never(*_: object) -> bool:
    """No plan changes nothing."""
    return False


PARTS: Final = {
    "guidance": {
        "suave_des.managed.search.Guidance": PollingGuidance,
        "suave_des.managed.follow.Guidance": PollingGuidance,
    },
    "detector": {"suave_des.simulation.mission.PipelineDetector": PollingDetector},
    "loop": {
        "suave_des.managing.metacontrol.Metacontrol._analyze_and_plan": analyze_and_plan_anew,
        "suave_des.managing.metacontrol.Metacontrol._changes_nothing": never,
    },
    "calls": {"suave_des.simulation.mission.ManagerHost": time_triggered},
    "monitors": {"suave_des.simulation.simulator.MissionRun": PlainMission},  # needs "calls"
}


@contextmanager
def polled(*parts: str) -> Iterator[None]:
    """Some parts of the missions that are run meanwhile poll, see `PARTS`; all of them if none is named."""
    with ExitStack() as stack:
        for part in parts or PARTS:
            for name, plain in PARTS[part].items():
                stack.enter_context(mock.patch(name, plain))
        yield


Effect = tuple[float, str]


def unrecorded(simulator: Simulator, manager: str, run: int) -> tuple[MissionMetrics, list[Effect]]:
    """Metrics of a mission that is not recorded, and the modes that took effect with their times."""
    effects: list[Effect] = []
    take_effect = ModeManager._take_effect

    def noted(self: ModeManager, function: str, mode: Mode) -> None:
        effects.append((self.env.now, f"{function} = {mode.name}"))
        take_effect(self, function, mode)

    with mock.patch.object(ModeManager, "_take_effect", noted):
        return simulator.run(manager, run, 1).metrics, effects
