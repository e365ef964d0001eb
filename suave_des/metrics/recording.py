"""The record of one mission: its events as a timeline, and its trajectory."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar, overload

import simpy

from suave_des.compiling import Array
from suave_des.domain import BATTERY_LEVEL, MOVING_FUNCTIONS, WATER_VISIBILITY
from suave_des.events import (
    BatteryCrossing,
    ComponentStatus,
    Said,
    VisibilityCrossing,
    texts_of,
)
from suave_des.metrics.result import Event, KnowledgeRecord, TrajectoryPoint
from suave_des.monitor.diagnostics import HULL, Diagnostic, Kind
from suave_des.monitor.measurements import Measurements
from suave_des.scenario.models import ReactionMetric
from suave_des.scenario.modes import Mode
from suave_des.vehicle.model import euler_angles
from suave_des.vehicle.vehicle import STEP_S, Vehicle

if TYPE_CHECKING:
    from suave_des.knowledge.state import KnowledgeState

TRAJECTORY_PERIOD_ROWS = 4
_T = TypeVar("_T")


@dataclass(eq=False)
class Recorder:
    """Records what happens, if it is enabled; missions of a campaign are not recorded.

    Of quality attributes it keeps the crossings of the metric's values.
    """

    env: simpy.Environment
    enabled: bool
    metric: ReactionMetric
    events: list[Event] = field(default_factory=list)
    knowledge: list[KnowledgeRecord] = field(default_factory=list)
    # how many limits the last measured value has reached
    _reached: dict[str, int] = field(default_factory=dict)
    _moving: str | None = None  # the function that the last of these modes is one of
    _modes: list[tuple[float, str]] = field(default_factory=lambda: [(0.0, "")])

    def log(self, source: str, happening: NamedTuple) -> None:
        """Keep an event."""
        if self.enabled:
            self.events.append(Event(float(self.env.now), source, *texts_of(happening)))

    def log_state(self, state: KnowledgeState, began_s: float | None = None) -> None:
        """Keep a state that is reasoned about, if it differs from the one before: of now, or in
        place of the one of an earlier time.
        """
        if not self.enabled:
            return
        if began_s is not None and self.knowledge and self.knowledge[-1].t_s == began_s:
            self.knowledge.pop()
        if not self.knowledge or self.knowledge[-1].state != state:
            t_s = float(self.env.now) if began_s is None else began_s
            self.knowledge.append(KnowledgeRecord(t_s, state))

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Keep a component's report, or the first value and the crossings of a measured quality
        attribute.
        """
        key = diagnostic.key
        value = diagnostic.value
        if diagnostic.kind == Kind.COMPONENT_STATUS:
            monitor = "leak_monitor" if key == HULL else "thruster_monitor"
            self.log(monitor, ComponentStatus(key, str(value)))
        elif not isinstance(value, float):
            return
        elif key == WATER_VISIBILITY:
            limits_m = sorted(self.metric.visibility_thresholds_m)
            self._measured("visibility_monitor", VisibilityCrossing, value, limits_m, " m")
        elif key == BATTERY_LEVEL:
            limits = [self.metric.battery_limit]
            self._measured("battery_monitor", BatteryCrossing, value, limits, "")

    def _measured(
        self,
        monitor: str,
        crossing: type[VisibilityCrossing | BatteryCrossing],
        value: float,
        limits: Sequence[float],
        unit: str,
    ) -> None:
        """Keep the first value of a quality attribute, and when it reaches or leaves a limit."""
        measured = f"{value:.2f}{unit}"
        before = self._reached.get(monitor)
        reached = bisect_right(limits, value)
        if before is None:
            self.log(monitor, Said("first_measurement", measured))
        elif reached > before:
            self.log(monitor, crossing(f"rises to {limits[reached - 1]:g}{unit}", measured))
        elif reached < before:
            self.log(monitor, crossing(f"falls below {limits[reached]:g}{unit}", measured))
        self._reached[monitor] = reached

    def mode_effect(self, function: str, mode: Mode) -> None:
        """Keep the mode of the function that moves the vehicle, for the trajectory."""
        if function in MOVING_FUNCTIONS and (mode.active or self._moving in (function, None)):
            self._moving = function
            self._modes.append((float(self.env.now), mode.name))

    def trajectory(
        self, vehicle: Vehicle, visibility: Measurements, battery: Measurements | None
    ) -> Sequence[TrajectoryPoint]:
        """Return the vehicle's path so far: at each point the mode in force, the visibility, and
        the battery's level.
        """
        if not self.enabled:
            return ()
        rows = int(self.env.now / STEP_S) + 1
        return Trajectory(
            poses=vehicle.track[:rows:TRAJECTORY_PERIOD_ROWS],
            modes=_Series(*zip(*self._modes, strict=True)),
            visibility=_published(visibility),
            further={} if battery is None else {battery.key: _published(battery)},
        )


@dataclass(frozen=True)
class _Series(Generic[_T]):
    """Values, and the mission times from which each of them holds, ascending."""

    times_s: tuple[float, ...]
    values: tuple[_T, ...]

    def at(self, t_s: float) -> _T | None:
        """Return the value that holds at mission time t; None if there is none yet."""
        count = bisect_right(self.times_s, t_s)
        return self.values[count - 1] if count else None


def _published(measured: Measurements) -> _Series[float]:
    return _Series(tuple(measured.times_s), tuple(measured.values))


@dataclass(frozen=True, eq=False)
class Trajectory(Sequence[TrajectoryPoint]):
    """The points of a mission's trajectory, made as they are read: of a day's mission they would
    take 200 MB.

    Attributes:
        poses: position and attitude at each point, as in the vehicle's track.
        modes: the modes that moved the vehicle, by their names; empty before the first.
        further: what was measured besides the visibility, by its column.
    """

    poses: Array
    modes: _Series[str]
    visibility: _Series[float]
    further: Mapping[str, _Series[float]]

    def __len__(self) -> int:
        """Count the points."""
        return len(self.poses)

    @overload
    def __getitem__(self, index: int) -> TrajectoryPoint: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[TrajectoryPoint, ...]: ...

    def __getitem__(self, index: int | slice) -> TrajectoryPoint | tuple[TrajectoryPoint, ...]:
        """Make a point, or those of a slice."""
        numbers = range(len(self))[index]
        if isinstance(numbers, range):
            return tuple(map(self._point, numbers))
        return self._point(numbers)

    def __eq__(self, other: object) -> bool:
        """Compare the points."""
        return isinstance(other, Trajectory) and tuple(self) == tuple(other)

    __hash__ = None  # type: ignore[assignment]  # as of other containers that compare

    def _point(self, number: int) -> TrajectoryPoint:
        t_s = round(number * TRAJECTORY_PERIOD_ROWS * STEP_S, 6)
        x_m, y_m, z_m, *attitude = self.poses[number].tolist()
        return TrajectoryPoint(
            t_s,
            x_m,
            y_m,
            z_m,
            *euler_angles(attitude),
            mode=self.modes.at(t_s) or "",
            visibility_m=self.visibility.at(t_s),
            further={name: each.at(t_s) for name, each in self.further.items()},
        )
