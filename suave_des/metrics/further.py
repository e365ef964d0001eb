"""Further metrics of a mission, for scenarios that ask for them, and the degree to which requirements are satisfied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import simpy

from suave_des.clock import Process
from suave_des.compiling import Array
from suave_des.domain import SEA_BED_Z_M
from suave_des.metrics.result import MissionMetrics
from suave_des.monitor.measurements import BatteryLevel, Measured
from suave_des.scenario.models import FURTHER_METRICS, Requirement, Scenario
from suave_des.scenario.modes import Mode
from suave_des.vehicle.vehicle import STEP_S, Vehicle, row_at
from suave_des.world.coverage import covered_area_m2

MetricValue = float | int | None


@dataclass(eq=False)
class FurtherMetrics:
    """Notes during the mission what further metrics are computed from, and computes them.

    Attributes:
        env: the mission's clock.
        scenario: says which are asked for.
        vehicle: has the track.
        measured: what monitors have measured, by quality attribute.
        battery: its level; none if there is no battery.
        adaptations_undone: changes of a function's mode that were soon taken back: indecision.
        reasoning_time_s: mission time that the reasoner took in cycles that changed a function design.
        surfacing_time_s: from the leak to the surface; none while the vehicle has not surfaced.
    """

    env: simpy.Environment
    scenario: Scenario
    vehicle: Vehicle
    measured: Mapping[str, Measured]
    battery: BatteryLevel | None
    adaptations_undone: int = 0
    reasoning_time_s: float = 0.0
    surfacing_time_s: float | None = None
    _changes: dict[str, tuple[float, str]] = field(default_factory=dict)  # of each function: when, and from which mode
    _in_force: dict[str, str] = field(default_factory=dict)
    _in_force_since_s: float = 0.0
    _configurations: set[frozenset[tuple[str, str]]] = field(default_factory=set)
    _working: list[tuple[float, int]] = field(default_factory=list)

    def adapted(self, function: str, before: str, after: str) -> None:
        """Count a mode change of a function in use."""
        undone_within_s = self.scenario.reaction_metric.undone_within_s
        changed_s, from_mode = self._changes.get(function, (-undone_within_s, ""))
        is_undone = after == from_mode and self.env.now - changed_s <= undone_within_s
        self.adaptations_undone += is_undone
        # What is taken back is over: changing a third time does not undo the undoing.
        self._changes[function] = (self.env.now, "" if is_undone else before)

    def mode_effect(self, function: str, mode: Mode) -> None:
        """Note a mode that takes effect."""
        self._count_configuration()
        self._in_force[function] = mode.name

    def _count_configuration(self) -> None:
        """Count the configuration in force, unless it was only passed through."""
        if self._in_force and self.env.now > self._in_force_since_s:
            self._configurations.add(frozenset(self._in_force.items()))
        self._in_force_since_s = self.env.now

    def reasoning_took(self, duration_s: float) -> None:
        """Note the time that the reasoner took in a cycle that changed something."""
        self.reasoning_time_s += duration_s

    def watch_surfacing(self, surfaced: simpy.Event, leak_s: float) -> Process:
        """Note the moment at which the vehicle has surfaced after a leak."""
        yield surfaced
        self.surfacing_time_s = float(self.env.now) - leak_s

    def thrusters_changed(self) -> None:
        """Note a change of the thrusters that work."""
        self._working.append((self.env.now, self.vehicle.working_thrusters))

    def columns(self, metrics: MissionMetrics) -> dict[str, MetricValue]:
        """The further metrics and the satisfaction of requirements as of now, by column."""
        scenario, now_s = self.scenario, float(self.env.now)
        asked = (*scenario.metrics, *(str(each.metric) for each in scenario.requirements.values()))
        found = {metric: self.value(metric) for metric in asked if metric in FURTHER_METRICS}
        degrees = satisfaction_degrees(scenario.requirements, metrics, found, self.measured, now_s)
        columns = {**found, **{f"requirement_{name}": degree for name, degree in degrees.items()}}
        return {name: columns[name] for name in scenario.further_columns}

    def value(self, metric: str) -> MetricValue:
        """A further metric as of now."""
        now_s = float(self.env.now)
        match metric:
            case "adaptations_undone":
                return self.adaptations_undone
            case "configurations":
                self._count_configuration()
                return len(self._configurations)
            case "reasoning_time_s":
                return self.reasoning_time_s
            case "operational_thrusters":
                return self._operational_thrusters()
            case "area_covered_m2":
                self.vehicle.position(now_s)  # fills the track until now
                track, tangent = self.vehicle.track, self.scenario.vehicle.camera.tangent
                visibility = self.measured["water_visibility"]
                visibility_m = measured_at_rows(visibility.times_s, visibility.values, len(track))
                return covered_area_m2(track, row_at(now_s), visibility_m, SEA_BED_Z_M, tangent)
            case "surfacing_time_s":
                return self.surfacing_time_s
        assert self.battery is not None
        level = self.battery.level(now_s)
        return self.battery.recharges if metric == "recharges" else level

    def _operational_thrusters(self) -> float:
        """Mean over mission time of the number of thrusters that work."""
        all_thrusters = len(self.vehicle.model.thrusters)
        if self.env.now <= 0.0:
            return float(all_thrusters)
        steps = [(0.0, all_thrusters), *self._working, (self.env.now, 0)]
        return sum((later - since) * count for (since, count), (later, _) in pairwise(steps)) / self.env.now


def measured_at_rows(times_s: Sequence[float], values: Sequence[float], rows: int) -> Array:
    """The value measured last at each row of a track, shape (rows,); nan before the first."""
    since_rows = np.minimum(np.rint(np.array(times_s) / STEP_S), rows).astype(np.int64)  # rounded as Vehicle does
    return np.repeat(np.append(np.nan, values), np.diff(since_rows, prepend=0, append=rows))


def satisfaction_degrees(
    requirements: Mapping[str, Requirement],
    metrics: MissionMetrics,
    further: Mapping[str, MetricValue],
    measured: Mapping[str, Measured],
    now_s: float,
) -> dict[str, float | None]:
    """Compute the degree to which each requirement is satisfied as of now, from 0 to 1; None if there is no value."""
    found: dict[str, float | None] = {}
    for name, requirement in requirements.items():
        if requirement.attribute is not None:
            found[name] = _over_time(requirement, measured[requirement.attribute], now_s)
            continue
        metric = str(requirement.metric)
        value = further[metric] if metric in further else getattr(metrics, metric)
        found[name] = None if value is None else requirement.satisfaction(float(value))
    return found


def _over_time(requirement: Requirement, measured: Measured, now_s: float) -> float | None:
    count = measured.count_until(now_s)
    times_s, values = measured.times_s[:count], measured.values[:count]
    if not count or now_s <= times_s[0]:
        return None
    ends_s = (*times_s[1:], now_s)
    shares = zip(times_s, ends_s, values, strict=True)
    total_s = sum((end_s - since_s) * requirement.satisfaction(value) for since_s, end_s, value in shares)
    return float(total_s / (now_s - times_s[0]))
