"""Pipeline detection: looks ahead along the vehicle's track for the moment of the first sight."""

import math
from dataclasses import dataclass

import simpy

from suave_des.clock import Alarm
from suave_des.compiling import Array
from suave_des.managed.node import Log
from suave_des.vehicle.vehicle import STEP_S, Point, Vehicle
from suave_des.world.pipeline import first_detection

_MIN_ROWS_AHEAD = 60
"""Minimum look-ahead after a change of control, doubled while there is no other; or as far as
guidance has computed.
"""
_AFTER_CONTROL_S = 0.6 * STEP_S
"""Delay past the last checked row before more are checked: a control change that rounds to that row
comes first.
"""


@dataclass(eq=False)
class PipelineDetector:
    """Watches from t = 0 until a point of the pipeline is seen for the first time.

    The exemplar checks at each pose message. Here each row of the vehicle's track is checked, ahead
    of time under the present control, and again when control changes; so the moment does not depend
    on when the position is read.

    Attributes:
        visibility: measured water visibility: the times, s, at which the value changes, and the
            values, m.
        points: points as the detection places them, shape (n, 3), m.
        bounds_m: the least and the greatest coordinates of the points.
        view_tangent: tangent of half the camera's field of view.
        detected: the event of the first sight; its value is the index of the point seen.
        first_point: index of the point seen, once detected.
        detected_s: mission time of the first sight; inf before.
    """

    env: simpy.Environment
    vehicle: Vehicle
    visibility: tuple[Array, Array]
    points: Array
    bounds_m: tuple[Point, Point]
    view_tangent: float
    log: Log
    first_point: int | None = None
    detected_s: float = math.inf
    _row: int = 0  # of the alarm
    _rows_ahead: int = _MIN_ROWS_AHEAD
    _seen: int = -1

    def __post_init__(self) -> None:
        self.detected: simpy.Event = self.env.event()
        self._alarm = Alarm(self.env, self._ring)
        self.vehicle.track_listeners.append(self._track_changed)
        self._look_ahead(0)

    def _track_changed(self, row: int) -> None:
        self._rows_ahead = _MIN_ROWS_AHEAD
        self._look_ahead(row)

    def _look_ahead(self, row: int) -> None:
        """Check the rows from one on; set the alarm to the first sight, or to the last row that was
        checked.
        """
        last = min(max(row + self._rows_ahead, self.vehicle.computed_row), self.vehicle.last_row)
        if row >= last:
            self._alarm.cancel()
            return
        self.vehicle.look_ahead(last)
        seen = self.points, self.bounds_m, self.view_tangent
        seen_row, self._seen = first_detection(
            self.vehicle.track, (row, last), STEP_S, self.visibility, *seen
        )
        if self._seen < 0:
            self._row = last
            self._alarm.set(last * STEP_S + _AFTER_CONTROL_S)
        else:
            self._alarm.set(seen_row * STEP_S, exactly=True)

    def _ring(self) -> None:
        if self._seen < 0:
            self._rows_ahead *= 2
            self._look_ahead(self._row)
            return
        self.vehicle.track_listeners.remove(self._track_changed)
        self.first_point = self._seen
        self.detected_s = float(self.env.now)
        self.log("detection", "pipeline_detected", f"point {self.first_point}")
        self.detected.succeed(self.first_point)
