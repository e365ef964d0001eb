"""A vehicle in mission time: it is commanded and disturbed, and flown.

In a mission `managed.flight` flies it to each event. One that stands alone is flown up to the time
that is read.
"""

import ctypes
import math
from dataclasses import KW_ONLY, InitVar, dataclass, field
from typing import Literal

import numpy as np

from suave_des.compiling import Array, shared
from suave_des.vehicle import kernel
from suave_des.vehicle.kernel import VehicleRecord
from suave_des.vehicle.model import (
    Autopilot,
    Pose,
    VehicleModel,
    euler_angles,
    quaternion,
    vehicle_record,
)

STEP_S = 0.05
Point = tuple[float, float, float]
ThrusterState = Literal["works", "frozen", "dead"]
"""A frozen thruster keeps the thrust of the step in which it fails; a dead one gives none."""


_TwoRecords = VehicleRecord * 2


@dataclass(eq=False)
class Vehicle:
    """The vehicle of one mission.

    The track is a table of poses on a grid of `STEP_S` seconds of mission time. A reading at time t
    is the pose at the grid point nearest to t; a change of control at time t acts from that grid
    point on. A row that is flown is final: reading, however often, never changes the trajectory.

    Example:
        >>> vehicle = Vehicle(model, Autopilot(), Pose(0.0, 0.0, -18.0, 0.0, 0.0, 0.0), 60.0)
        >>> vehicle.command(0.0, 3.0, 0.0, -18.0)
        >>> vehicle.position(60.0)
        (3.0, 0.0, -18.0)

    Attributes:
        model: constants of body and thrusters.
        autopilot: the guided controller.
        start: pose at t = 0, at rest; the autopilot's first set-point is this place with heading 0.
        duration_s: length of the mission; nothing can be read beyond it.
        altitude_error_m: how far above its set-point the autopilot holds the vehicle (seen in the
            real runs).
        current_m_per_s: velocity of the water, world frame.
        current_wave: amplitude of a part that varies as a sine, east and north, m/s; and the sine's
            angle per row of the track and at row 0, rad.
        time_scale: simulated seconds that pass in a second of mission time (the simulator's
            real-time factor).
        z_limits_m: sea bed and surface, which stop the vehicle.
        memory: where to keep the track, instead of memory of its own; see `track_rows`.
        state: its numbers as of the last row that is flown; `records` as compiled functions get it,
            with room for a copy.
        thrusters: the state of each.
    """

    model: VehicleModel
    autopilot: Autopilot
    start: Pose
    duration_s: float
    _: KW_ONLY
    altitude_error_m: float = 0.0
    current_m_per_s: Point = (0.0, 0.0, 0.0)
    current_wave: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    time_scale: float = 1.0
    z_limits_m: tuple[float, float] = (-math.inf, math.inf)
    memory: InitVar[Array | None] = None
    thrusters: list[ThrusterState] = field(init=False)

    def __post_init__(self, memory: Array | None) -> None:
        start, rows = self.start, track_rows(self.duration_s)
        self.last_row = rows - 1
        self.track: Array = np.empty((rows, kernel.TRACK_COLUMNS)) if memory is None else memory
        self.thrusters = ["works"] * len(self.model.thrusters)
        both = _TwoRecords()
        self.records, self.state = shared(both), both[0]
        constants = vehicle_record(self.model, self.autopilot, self.z_limits_m)
        ctypes.memmove(both, ctypes.byref(constants), ctypes.sizeof(constants))
        state: VehicleRecord = self.state
        state.step_s = STEP_S * self.time_scale
        x_m_per_s, y_m_per_s, z_m_per_s = self.current_m_per_s
        state.current_x_m_per_s, state.current_y_m_per_s = x_m_per_s, y_m_per_s
        state.current_z_m_per_s = z_m_per_s
        state.wave_x_m_per_s, state.wave_y_m_per_s = self.current_wave[:2]
        state.wave_rate_rad, state.wave_phase_rad = self.current_wave[2:]
        state.x_m = state.leg_start_x_m = state.leg_end_x_m = state.set_point_x_m = start.x_m
        state.y_m = state.leg_start_y_m = state.leg_end_y_m = state.set_point_y_m = start.y_m
        state.z_m = state.leg_start_z_m = state.leg_end_z_m = state.set_point_z_m = start.z_m
        attitude = quaternion(*start[3:])
        state.qw, state.qx, state.qy, state.qz = attitude
        self.track[0] = *start[:3], *attitude

    def command(self, t_s: float, x_m: float, y_m: float, z_m: float) -> None:
        """Give the autopilot a new position set-point, which replaces the previous one.

        Raises:
            ValueError: the vehicle is already flown beyond that time.
        """
        self._fly_to_control(t_s)
        state = self.state
        state.set_point_x_m, state.set_point_y_m = x_m, y_m
        state.set_point_z_m = z_m + self.altitude_error_m
        state.set_point_number += 1

    def set_thruster(self, t_s: float, thruster: int, state: ThrusterState) -> None:
        """Let one of thrusters 1 .. n fail, or work again. The autopilot is not informed.

        Raises:
            ValueError: the vehicle is already flown beyond that time.
        """
        if self.thrusters[thruster - 1] == state:
            return
        self._fly_to_control(t_s)
        limit_n = self.model.thrust_limit_n if state == "works" else 0.0
        thrust_n = self._next_thrust_n(thruster) if state == "frozen" else 0.0
        self.thrusters[thruster - 1] = state
        self.state.least_n[thruster - 1] = thrust_n - limit_n
        self.state.greatest_n[thruster - 1] = thrust_n + limit_n

    def _fly_to_control(self, t_s: float) -> None:
        row = row_at(t_s)
        self.fly_to_row(row)
        if row < self.state.row:
            flown_s = self.state.row * STEP_S
            raise ValueError(f"control cannot change at {t_s:g} s: it is flown up to {flown_s:g} s")

    def _next_thrust_n(self, thruster: int) -> float:
        """Find what a thruster gives in the next step, or gave in the mission's last one.

        A copy flies that step; the row that it fills is flown anew by the vehicle itself.
        """
        copy = _TwoRecords()
        copy[0] = self.state  # numpy needs 30 times as long for it
        row = self.state.row
        if row < self.last_row:
            kernel.advance(shared(copy), self.track, row + 1)
        next_state: VehicleRecord = copy[0]
        return float(next_state.thrust_n[thruster - 1])

    def position(self, t_s: float) -> Point:
        """Read the position at time t: x, y, z in m."""
        x_m, y_m, z_m, *_ = self._flown_row(t_s)
        return x_m, y_m, z_m

    def pose(self, t_s: float) -> Pose:
        """Read the pose eta at time t."""
        x_m, y_m, z_m, *attitude = self._flown_row(t_s)
        return Pose(x_m, y_m, z_m, *euler_angles(attitude))

    def _flown_row(self, t_s: float) -> list[float]:
        row = row_at(t_s)
        self.fly_to_row(row)
        pose: list[float] = self.track[row].tolist()
        return pose

    def fly_to_row(self, row: int) -> None:
        """Fly up to a row of the track under the present control, unless it is already flown.

        Raises:
            ValueError: the row lies beyond the mission's end.
        """
        if row <= self.state.row:
            return
        if row > self.last_row:  # compiled code would write past the track
            raise ValueError(
                f"the vehicle's track ends at {self.last_row * STEP_S:g} s, before {row * STEP_S:g} s"
            )
        kernel.advance(self.records, self.track, row)


def track_rows(duration_s: float) -> int:
    """Count the rows of a mission's track; each has `kernel.TRACK_COLUMNS` columns."""
    return row_at(duration_s) + 2


def row_at(t_s: float) -> int:
    """Find the row of the track nearest to a mission time; ties go to the even row, as in every
    such conversion.
    """
    return round(t_s / STEP_S)
