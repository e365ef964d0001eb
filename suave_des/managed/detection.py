"""Pipeline detection: looks ahead along the vehicle's way for the moment of the first sight."""

import math
from dataclasses import dataclass

import numpy as np
import simpy

from suave_des.clock import Alarm
from suave_des.compiling import Array
from suave_des.managed.node import Log
from suave_des.vehicle.vehicle import STEP_S, Vehicle
from suave_des.world.pipeline import first_detection

_FEWEST_ROWS = 22
_MARGIN_ROWS = 2
"""How far to look at least, and beyond what guidance has looked at: where that ends, the set-point mostly changes."""


def measured_at_rows(times_s: Array, values: Array, at_rows: Array) -> None:
    """Write the value measured last at each row of a track into `at_rows`, shape (rows,); nan before the first."""
    if len(times_s) == 0:  # nothing is ever published
        at_rows[:] = np.nan
        return
    first = np.minimum(np.rint(times_s / STEP_S).astype(np.int64), len(at_rows))  # rounded as Vehicle does
    at_rows[: first[0]] = np.nan
    at_rows[first[0] : first[-1]] = np.repeat(values[:-1], first[1:] - first[:-1])
    at_rows[first[-1] :] = values[-1]


@dataclass(eq=False)
class PipelineDetector:
    """Watches from t = 0 until a point of the pipeline is seen for the first time.

    The exemplar checks at each pose message. Here each row of the vehicle's track is checked, ahead of time under the
    present control, and again when control changes; so the moment does not depend on when the position is read.

    Attributes:
        visibility_m: measured water visibility at each row of the vehicle's track.
        points: points as the detection places them, shape (n, 3), m.
        view_tangent: tangent of half the camera's field of view.
        detected: the event of the first sight.
        first_point: index of the point seen, once detected.
        detected_s: mission time of the first sight; inf before.
    """

    env: simpy.Environment
    vehicle: Vehicle
    visibility_m: Array
    points: Array
    view_tangent: float
    log: Log
    first_point: int | None = None
    detected_s: float = math.inf
    _row: int = 0  # of the alarm
    _seen: int = -1

    def __post_init__(self) -> None:
        self.detected: simpy.Event = self.env.event()
        self._alarm = Alarm(self.env, self._arrive)
        self.vehicle.control_listeners.append(self._look_ahead)
        self._look_ahead(0)

    def _look_ahead(self, row: int) -> None:
        """Check the rows from one on; return at the first sight, or where no later row has been checked."""
        last = min(max(row + _FEWEST_ROWS, self.vehicle.computed_row + _MARGIN_ROWS), self.vehicle.last_row)
        if row >= last:
            self._alarm.cancel()
            return
        self.vehicle.look_ahead(last)
        seen_row, self._seen = first_detection(
            self.vehicle.track, row, last, self.visibility_m, self.points, self.view_tangent
        )
        self._row = last if self._seen < 0 else seen_row
        self._alarm.set(self._row * STEP_S)

    def _arrive(self) -> None:
        if self._seen < 0:
            self._look_ahead(self._row)
            return
        self.vehicle.control_listeners.remove(self._look_ahead)
        self.first_point = self._seen
        self.detected_s = self._alarm.now_s
        self.log("detection", "pipeline_detected", f"point {self.first_point}")
        self.detected.succeed()
