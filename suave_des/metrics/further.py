"""Further metrics of a mission, for scenarios that ask for them, and the degree to which
requirements are satisfied.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import simpy
from numpy.typing import NDArray

from suave_des.compiling import Array, compiled
from suave_des.domain import BATTERY_LEVEL, SEA_BED_Z_M, WATER_VISIBILITY
from suave_des.metrics.result import MissionMetrics
from suave_des.monitor.measurements import BatteryMeasurements, Measurements
from suave_des.monitor.thrusters import Thrusters
from suave_des.scenario.models import FURTHER_METRICS, Requirement, Scenario
from suave_des.scenario.modes import Mode
from suave_des.vehicle.vehicle import STEP_S, row_at

MetricValue = float | int | None
CELL_M = 0.1
_ROW_STEP = 4
"""Only every fourth row of the track is used: the area is at most 1% smaller, in a quarter of the
time.
"""
_MAX_CELLS = 4_000_000
"""At most 4 MB: 40,000 m2 in cells of 0.1 m."""


@dataclass(eq=False)
class FurtherMetrics:
    """Notes during the mission what further metrics are computed from, and computes them.

    Attributes:
        measurements: what monitors have measured, by quality attribute.
        adaptations_undone: changes of a function's mode that were soon taken back: indecision.
        reasoning_time_s: mission time that the reasoner took in cycles that changed a function
            design.
        surfacing_time_s: from the leak to the surface; None while the vehicle has not surfaced.
    """

    env: simpy.Environment
    scenario: Scenario
    thrusters: Thrusters
    measurements: Mapping[str, Measurements]
    adaptations_undone: int = 0
    reasoning_time_s: float = 0.0
    surfacing_time_s: float | None = None
    # of each function: when, and from which mode
    _changes: dict[str, tuple[float, str]] = field(default_factory=dict)
    _in_force: dict[str, str] = field(default_factory=dict)
    _in_force_since_s: float = 0.0
    _configurations: set[frozenset[tuple[str, str]]] = field(default_factory=set)

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

    def columns(self, metrics: MissionMetrics) -> dict[str, MetricValue]:
        """Compute the further metrics and the satisfaction of requirements as of now, by column."""
        scenario = self.scenario
        asked = (*scenario.metrics, *(str(each.metric) for each in scenario.requirements.values()))
        found = {metric: self.value(metric) for metric in asked if metric in FURTHER_METRICS}
        for name, requirement in scenario.requirements.items():
            found[f"requirement_{name}"] = self._satisfaction(requirement, metrics, found)
        return {name: found[name] for name in scenario.further_columns}

    def value(self, metric: str) -> MetricValue:
        """Compute a further metric as of now."""
        now_s = float(self.env.now)
        match metric:
            case "configurations":
                self._count_configuration()
                return len(self._configurations)
            case "operational_thrusters":
                return self._operational_thrusters(now_s)
            case "area_covered_m2":
                return self._area_covered_m2(now_s)
            case "battery_level" | "recharges":
                battery = self.measurements[BATTERY_LEVEL]
                assert isinstance(battery, BatteryMeasurements)
                return battery.level(now_s) if metric == "battery_level" else battery.recharges
        noted: MetricValue = getattr(self, metric)
        return noted

    def _operational_thrusters(self, now_s: float) -> float:
        """Compute the mean over mission time of the number of thrusters that work."""
        all_thrusters = len(self.thrusters.vehicle.model.thrusters)
        if now_s <= 0.0:
            return float(all_thrusters)
        steps = [(0.0, all_thrusters), *self.thrusters.working, (now_s, 0)]
        return (
            sum((later_s - since_s) * count for (since_s, count), (later_s, _) in pairwise(steps))
            / now_s
        )

    def _area_covered_m2(self, now_s: float) -> float:
        vehicle = self.thrusters.vehicle
        visibility = self.measurements[WATER_VISIBILITY]
        visibility_m = measured_at_rows(visibility.times_s, visibility.values, len(vehicle.track))
        tangent = self.scenario.vehicle.camera.tangent
        return covered_area_m2(vehicle.track, row_at(now_s), visibility_m, SEA_BED_Z_M, tangent)

    def _satisfaction(
        self, requirement: Requirement, metrics: MissionMetrics, further: Mapping[str, MetricValue]
    ) -> float | None:
        """Compute the degree to which a requirement is satisfied as of now, from 0 to 1; None if
        there is no value.
        """
        if requirement.attribute is not None:
            return self._satisfaction_over_time(
                requirement, self.measurements[requirement.attribute]
            )
        metric = str(requirement.metric)
        value = further[metric] if metric in further else getattr(metrics, metric)
        return None if value is None else requirement.satisfaction(float(value))

    def _satisfaction_over_time(
        self, requirement: Requirement, measured: Measurements
    ) -> float | None:
        now_s = float(self.env.now)
        count = measured.count_until(now_s)
        times_s = measured.times_s[:count]
        values = measured.values[:count]
        if not count or now_s <= times_s[0]:
            return None
        ends_s = (*times_s[1:], now_s)
        shares = zip(times_s, ends_s, values, strict=True)
        total_s = sum(
            (end_s - since_s) * requirement.satisfaction(value) for since_s, end_s, value in shares
        )
        return float(total_s / (now_s - times_s[0]))


def measured_at_rows(times_s: Sequence[float], values: Sequence[float], rows: int) -> Array:
    """Find the value measured last at each row of a track, shape (rows,); nan before the first."""
    # rounded as Vehicle does
    since_rows = np.minimum(np.rint(np.array(times_s) / STEP_S), rows).astype(np.int64)
    return np.repeat(np.append(np.nan, values), np.diff(since_rows, prepend=0, append=rows))


def covered_area_m2(
    track: Array, last_row: int, visibility_m: Array, sea_bed_z_m: float, view_tangent: float
) -> float:
    """Measure the area of the sea bed that the camera, looking straight down, has seen at least
    once.

    A place is seen when it is in view, and the camera's height above it is at most the water
    visibility. Areas are counted in squares of 0.1 m, larger ones for very long tracks.

    Args:
        track: positions x, y, z in the first three columns, shape (rows, at least 3), m.
        last_row: the last row that counts.
        visibility_m: measured water visibility at each row, shape (rows,); nan while there is no
            measurement.
        view_tangent: tangent of half the camera's field of view.
    """
    x_m, y_m, z_m = track[: last_row + 1 : _ROW_STEP, :3].T
    height_m = z_m - sea_bed_z_m
    is_seen = height_m <= visibility_m[: last_row + 1 : _ROW_STEP]
    if not is_seen.any():
        return 0.0
    x_m = x_m[is_seen]
    y_m = y_m[is_seen]
    half_m = height_m[is_seen] * view_tangent
    low_x_m = float((x_m - half_m).min())
    low_y_m = float((y_m - half_m).min())
    size_x_m = float((x_m + half_m).max()) - low_x_m
    size_y_m = float((y_m + half_m).max()) - low_y_m
    cell_m = max(CELL_M, math.sqrt(size_x_m * size_y_m / _MAX_CELLS))
    grid = np.zeros((int(size_x_m / cell_m) + 2, int(size_y_m / cell_m) + 2), dtype=np.uint8)
    return _mark(x_m, y_m, half_m, (low_x_m, low_y_m), cell_m, grid) * cell_m * cell_m


@compiled
def _mark(
    x_m: Array,
    y_m: Array,
    half_m: Array,
    low_m: tuple[float, float],
    cell_m: float,
    grid: NDArray[np.uint8],
) -> int:
    """Mark the cells whose centre is in view from each place; return how many there are.

    From one place to the next most of the view stays the same: these cells are passed over.
    """
    low_x_m, low_y_m = low_m
    count = 0
    from_x = to_x = from_y = to_y = 0  # cells in view
    for place in range(half_m.shape[0]):
        before_x = from_x, to_x
        before_y = from_y, to_y
        from_x = max(math.ceil((x_m[place] - half_m[place] - low_x_m) / cell_m - 0.5), 0)
        last_x = math.floor((x_m[place] + half_m[place] - low_x_m) / cell_m - 0.5)
        to_x = min(last_x + 1, grid.shape[0])
        from_y = max(math.ceil((y_m[place] - half_m[place] - low_y_m) / cell_m - 0.5), 0)
        last_y = math.floor((y_m[place] + half_m[place] - low_y_m) / cell_m - 0.5)
        to_y = min(last_y + 1, grid.shape[1])
        for i in range(from_x, to_x):
            was_in_view = before_x[0] <= i < before_x[1]
            j = from_y
            while j < to_y:
                if was_in_view and before_y[0] <= j < before_y[1]:
                    j = before_y[1]
                    continue
                if grid[i, j] == 0:
                    grid[i, j] = 1
                    count += 1
                j += 1
    return count
