"""Pipeline detection in mission time: looks ahead along the vehicle's way and tells the moment of the first sight."""

from __future__ import annotations

import numpy as np
import simpy
from numpy.typing import NDArray

from suave_des.clock import call_at
from suave_des.compiling import compiled
from suave_des.vehicle.vehicle import STEP_S, Vehicle
from suave_des.world.pipeline import first_detection

_LOOK_AHEAD_ROWS = 22
_MARGIN_ROWS = 2
"""How far to look beyond what others have foreseen: where that ends, the way mostly becomes another one."""
_FARTHEST_LOOK_AHEAD_ROWS = 200


@compiled
def measured_at_rows(times_s: NDArray[np.float64], values: NDArray[np.float64], at_rows: NDArray[np.float64]) -> None:
    """Last measured value at each row of a track; nan before the first measurement.

    Args:
        times_s: times of the measurements, increasing.
        values: what was measured.
        at_rows: shape (rows,); written into.
    """
    row, value = 0, np.nan
    for message in range(len(times_s)):
        first = min(int(np.rint(times_s[message] / STEP_S)), len(at_rows))  # rounded as Vehicle does
        at_rows[row:first] = value
        row, value = first, values[message]
    at_rows[row:] = value


class PipelineDetector:
    """Watches from t = 0 until a point of the pipeline is seen for the first time.

    The sight is found on the vehicle's own grid, by looking ahead under the present control; when control changes, what
    was foreseen is dropped and looked at anew. So the moment does not depend on who reads the vehicle's position, or
    when.

    Attributes:
        detected: the event of the first sight.
        first_point: index of the point seen, once detected.
        detected_s: mission time of the first sight, once detected.

    Args:
        env: the mission's clock.
        vehicle: whose camera looks.
        visibility_m: measured water visibility at each row of the vehicle's track.
        points: points as the detection places them, shape (n, 3), m.
    """

    def __init__(
        self,
        env: simpy.Environment,
        vehicle: Vehicle,
        visibility_m: NDArray[np.float64],
        points: NDArray[np.float64],
    ) -> None:
        self._env = env
        self._vehicle = vehicle
        self._visibility_m = visibility_m
        self._points = points
        self._looked = self._rows = 0
        self._seen: int | None = None
        self._alarm: simpy.Event | None = None
        self._alarm_row = 0
        self.detected = env.event()
        self.first_point: int | None = None
        self.detected_s: float | None = None
        vehicle.control_listeners.append(self._look_anew)
        self._look_anew(0)

    def _look_anew(self, row: int) -> None:
        self._look_ahead(row, max(_LOOK_AHEAD_ROWS, self._vehicle.computed_row + _MARGIN_ROWS - row))

    def _look_ahead(self, row: int, rows: int) -> None:
        """Look along the way from a row on; be there at the first sight, or else not after what was looked at ends."""
        self._looked, self._rows, self._seen = min(row + rows, self._vehicle.last_row), rows, None
        if row >= self._looked:
            return
        self._vehicle.look_ahead(self._looked)
        seen_row, point = first_detection(self._vehicle.track, row, self._looked, self._visibility_m, self._points)
        if point >= 0:
            self._looked, self._seen = seen_row, point
        elif self._alarm is not None and self._alarm_row <= self._looked:
            return  # soon enough
        self._set_alarm()

    def _set_alarm(self) -> None:
        self._alarm, self._alarm_row = call_at(self._env, self._looked * STEP_S, self._arrive), self._looked

    def _arrive(self, event: simpy.Event) -> None:
        if event is not self._alarm:
            return
        self._alarm = None
        if self._alarm_row < self._looked:
            self._set_alarm()
        elif self._seen is None:
            self._look_ahead(self._looked, min(2 * self._rows, _FARTHEST_LOOK_AHEAD_ROWS))
        else:
            self._vehicle.control_listeners.remove(self._look_anew)
            self.first_point = self._seen
            self.detected_s = float(self._env.now)
            self.detected.succeed()
