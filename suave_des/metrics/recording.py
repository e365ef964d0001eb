"""The record of one mission: its events as a timeline, and its trajectory."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import simpy

from suave_des.domain import BATTERY_LEVEL, MOVING_FUNCTIONS, WATER_VISIBILITY
from suave_des.metrics.result import Event, KnowledgeRecord, TrajectoryPoint
from suave_des.monitor.diagnostics import HULL, Diagnostic, Kind
from suave_des.monitor.measurements import Measurements
from suave_des.scenario.models import ReactionMetric
from suave_des.scenario.modes import Mode
from suave_des.vehicle.vehicle import STEP_S, Vehicle

if TYPE_CHECKING:
    from suave_des.knowledge.state import KnowledgeState

TRAJECTORY_PERIOD_ROWS = 4


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

    def log(self, source: str, event: str, detail: str) -> None:
        """Keep an event."""
        if self.enabled:
            self.events.append(Event(float(self.env.now), source, event, detail))

    def log_state(self, state: KnowledgeState) -> None:
        """Keep a state that is reasoned about, if it differs from the one before."""
        if self.enabled and (not self.knowledge or self.knowledge[-1].state != state):
            self.knowledge.append(KnowledgeRecord(float(self.env.now), state))

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Keep a component's report, or the first value and the crossings of a measured quality
        attribute.
        """
        key = diagnostic.key
        value = diagnostic.value
        if diagnostic.kind == Kind.COMPONENT_STATUS:
            monitor = "leak_monitor" if key == HULL else "thruster_monitor"
            self.log(monitor, "component_status", f"{key} {value}")
        elif not isinstance(value, float):
            return
        elif key == WATER_VISIBILITY:
            limits_m = sorted(self.metric.visibility_thresholds_m)
            self._measured(key, value, limits_m, "visibility", " m")
        elif key == BATTERY_LEVEL:
            self._measured(key, value, [self.metric.battery_limit], "battery", "")

    def _measured(
        self, key: str, value: float, limits: Sequence[float], word: str, unit: str
    ) -> None:
        """Keep the first value of a quality attribute, and when it reaches or leaves a limit."""
        monitor = f"{word}_monitor"
        measured = f"{value:.2f}{unit}"
        before = self._reached.get(key)
        reached = bisect_right(limits, value)
        if before is None:
            self.log(monitor, "first_measurement", measured)
        elif reached > before:
            text = f"rises to {limits[reached - 1]:g}{unit} ({measured})"
            self.log(monitor, f"{word}_crossing", text)
        elif reached < before:
            text = f"falls below {limits[reached]:g}{unit} ({measured})"
            self.log(monitor, f"{word}_crossing", text)
        self._reached[key] = reached

    def mode_effect(self, function: str, mode: Mode) -> None:
        """Keep the mode of the function that moves the vehicle, for the trajectory."""
        if function in MOVING_FUNCTIONS and (mode.active or self._moving in (function, None)):
            self._moving = function
            self._modes.append((float(self.env.now), mode.name))

    def trajectory(
        self, vehicle: Vehicle, visibility: Measurements, battery: Measurements | None
    ) -> tuple[TrajectoryPoint, ...]:
        """The vehicle's path so far: at each point the mode in force, the visibility, and the
        battery's level.
        """
        if not self.enabled:
            return ()
        points = []
        mode_times = [t_s for t_s, _ in self._modes]
        for row in range(0, int(self.env.now / STEP_S) + 1, TRAJECTORY_PERIOD_ROWS):
            t_s = round(row * STEP_S, 6)
            mode = self._modes[bisect_right(mode_times, t_s) - 1][1]
            further = {} if battery is None else {battery.key: battery.value(t_s)}
            points.append(
                TrajectoryPoint(t_s, *vehicle.pose(t_s), mode, visibility.value(t_s), further)
            )
        return tuple(points)
