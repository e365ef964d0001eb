"""A vehicle in mission time: commanded and disturbed at events, read at any time, integrated only as far as needed."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from suave_des.vehicle import kernel
from suave_des.vehicle.model import Array, VehicleModel, allocation_matrix, autopilot_allocation

STEP_S = 0.05


class Pose(NamedTuple):
    """eta in the world frame: position in m, attitude as Euler angles in rad (rotation order z, y, x; Handbook,
    2.2.1).
    """

    x_m: float
    y_m: float
    z_m: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float


class Autopilot(NamedTuple):
    """The guided controller: ArduSub's cascade of position, velocity and attitude loops, in its simplest form.

    The attitude loop's gains are those of a double integrator with the natural frequency of a BlueROV2's angle
    controller (a few rad/s); what follows from them is not sensitive to the exact value.

    Attributes:
        position_gain_per_s: velocity demanded for each metre of position error.
        horizontal_speed_limit_m_per_s: limit of the demanded horizontal velocity.
        vertical_speed_limit_m_per_s: limit of the demanded vertical velocity.
        velocity_time_constant_s: how fast the velocity follows its demand; the integral gain makes the loop critically
            damped for a body without drag.
        altitude_error_m: steady error: the autopilot holds its altitude set-point plus this.
        altitude_deadband_m: the autopilot stops this far short of its altitude set-point.
        attitude_frequency_rad_per_s: natural frequency of roll and heading control.
    """

    position_gain_per_s: float
    horizontal_speed_limit_m_per_s: float
    vertical_speed_limit_m_per_s: float
    velocity_time_constant_s: float
    altitude_error_m: float = 0.0
    altitude_deadband_m: float = 0.0
    attitude_frequency_rad_per_s: float = 3.0


def _parameters(
    model: VehicleModel,
    autopilot: Autopilot,
    current_m_per_s: tuple[float, float, float],
    z_limits_m: tuple[float, float],
) -> Array:
    values = [0.0] * kernel.PARAMETERS
    values[kernel.MASS] = model.mass_kg
    values[kernel.IXX], values[kernel.IYY], values[kernel.IZZ] = model.inertia_kg_m2
    values[kernel.NET_BUOYANCY] = model.buoyancy_n - model.weight_n
    values[kernel.RIGHTING] = model.buoyancy_n * model.centre_of_buoyancy_m
    values[kernel.DRAG : kernel.DRAG + 6] = model.quadratic_drag
    values[kernel.THRUST_LIMIT] = model.thrust_limit_n
    values[kernel.POSITION_GAIN] = autopilot.position_gain_per_s
    values[kernel.SPEED_LIMIT_XY] = autopilot.horizontal_speed_limit_m_per_s
    values[kernel.SPEED_LIMIT_Z] = autopilot.vertical_speed_limit_m_per_s
    values[kernel.ALTITUDE_DEADBAND] = autopilot.altitude_deadband_m
    rate = 1.0 / autopilot.velocity_time_constant_s
    values[kernel.VELOCITY_GAIN] = rate
    values[kernel.VELOCITY_INTEGRAL_GAIN] = rate * rate / 4.0
    # An integral may ask for as much as the four horizontal thrusters together give along one axis, and no more.
    values[kernel.INTEGRAL_LIMIT] = 4.0 * model.thrust_limit_n * math.sqrt(0.5) / model.mass_kg
    omega = autopilot.attitude_frequency_rad_per_s
    values[kernel.ATTITUDE_GAIN] = omega * omega
    values[kernel.RATE_GAIN] = 2.0 * omega
    values[kernel.HEADING_INTEGRAL_GAIN] = omega**3 / 8.0
    values[kernel.HEADING_INTEGRAL_LIMIT] = 4.0 * omega * omega
    values[kernel.CURRENT : kernel.CURRENT + 3] = current_m_per_s
    inertia = (model.mass_kg, model.mass_kg, model.mass_kg, *model.inertia_kg_m2)
    values[kernel.INVERSE_MASS : kernel.INVERSE_MASS + 4] = [1.0 / each for each in inertia[2:]]
    values[kernel.DRAG_RATE : kernel.DRAG_RATE + 6] = [
        drag / each for drag, each in zip(model.quadratic_drag, inertia, strict=True)
    ]
    values[kernel.FLOOR], values[kernel.CEILING] = z_limits_m
    return np.array(values)


@dataclass(frozen=True, slots=True)
class Watch:
    """When it is looked whether the vehicle has reached a place, and what counts as reached.

    Attributes:
        began_s: time of tick 0.
        period_s: time between ticks.
        half_width_m: greatest difference in x and in y.
        half_height_m: greatest difference in z.
        fewest_ticks: from the tick that finds a place reached to the first look at the next one.
        most_ticks: from there to the last look at it.
    """

    began_s: float
    period_s: float
    half_width_m: float
    half_height_m: float
    fewest_ticks: int
    most_ticks: int

    def time_s(self, tick: int) -> float:
        """Time of a tick."""
        return self.began_s + tick * self.period_s

    def last_tick_until(self, t_s: float) -> int:
        """Number of the last tick until time t; one at t counts, as it was due before what else happens then."""
        tick = math.floor((t_s - self.began_s) / self.period_s + 1e-9)
        return tick if self.time_s(tick) <= t_s else tick - 1

    def first_tick_from(self, t_s: float) -> int:
        """Number of the first tick that is not before time t; a rounding error counts as on time."""
        return math.ceil((t_s - self.began_s) / self.period_s - 1e-9)


class _Course(NamedTuple):
    """Set-points given ahead.

    Attributes:
        watch: their ticks.
        given_at: ticks at which the set-points of places 1, 2, ... are given.
        before: set-point until then, shape (5,).
        places_m: the places, x, y, z in the first three columns.
        sent_as_m: what is added to x and y, and z in place of theirs.
    """

    watch: Watch
    given_at: list[int]
    before: Array
    places_m: Array
    sent_as_m: tuple[float, float, float]

    def is_under_way(self, t_s: float) -> bool:
        """Whether there is a set-point to come at time t."""
        return self.given_at[-1] > self.watch.last_tick_until(t_s)

    def set_point(self, tick: int) -> Array:
        """The set-point in force after a tick, shape (5,)."""
        place = bisect_right(self.given_at, tick)
        if place > 0:
            x_m, y_m, z_m = self.sent_as_m
            set_point, at = self.before, self.places_m
            set_point[0], set_point[1], set_point[2] = at.item(place, 0) + x_m, at.item(place, 1) + y_m, z_m
        return self.before


class Vehicle:
    """The vehicle of one mission.

    The track is a table of states on a grid of `STEP_S` seconds of mission time. A reading at time t is the state at
    the grid point nearest to t; a change of control at time t acts from that grid point on. Rows are filled when they
    are first needed; a change of control drops the rows after it. So reading, however often, never changes the
    trajectory, and asking what lies ahead under the present control costs nothing but the integration.

    Args:
        model: constants of body and thrusters.
        autopilot: the guided controller.
        start: pose at t = 0, at rest; the autopilot's first set-point is this place with heading 0.
        duration_s: length of the mission; nothing can be read beyond it.
        current_m_per_s: velocity of the water, world frame.
        time_scale: simulated seconds that pass in a second of mission time (the simulator's real-time factor).
        z_limits_m: sea bed and surface, which stop the vehicle.
        memory: where to keep the track, instead of memory of its own; see `track_rows`.
    """

    def __init__(
        self,
        model: VehicleModel,
        autopilot: Autopilot,
        start: Pose,
        duration_s: float,
        *,
        current_m_per_s: tuple[float, float, float] = (0.0, 0.0, 0.0),
        time_scale: float = 1.0,
        z_limits_m: tuple[float, float] = (-math.inf, math.inf),
        memory: Array | None = None,
    ) -> None:
        self._B = allocation_matrix(model)
        self._allocation = autopilot_allocation(model)
        self._health = np.array([1.0] * len(model.thrusters))
        self._effectiveness = self._B.copy()
        self._parameters = _parameters(model, autopilot, current_m_per_s, z_limits_m)
        self._altitude_error_m = autopilot.altitude_error_m
        self._step_s = STEP_S * time_scale
        rows = track_rows(duration_s)
        self.last_row = rows - 1
        self.track: Array = np.empty((rows, kernel.ROW)) if memory is None else memory
        at_rest = [0.0] * kernel.ROW
        at_rest[kernel.POSITION] = start.x_m, start.y_m, start.z_m
        at_rest[kernel.ATTITUDE] = quaternion(start.roll_rad, start.pitch_rad, start.yaw_rad)
        self.track[0] = at_rest
        self.computed_row = 0
        self._set_point = np.array([start.x_m, start.y_m, start.z_m, 1.0, 0.0])  # heading 0, see kernel.advance
        self._course: _Course | None = None
        self.control_listeners: list[Callable[[int], None]] = []
        """Each is called with the row from which on the future is another one."""

    def command(self, t_s: float, x_m: float, y_m: float, z_m: float) -> None:
        """Give the autopilot a new position set-point; it replaces the one before."""
        row = row_at(t_s)
        self._change_control(row, t_s)
        self._set_point[:3] = x_m, y_m, z_m + self._altitude_error_m
        self._tell(row)

    def set_thruster_health(self, t_s: float, thruster: int, health: float) -> None:
        """Set what share of its thrust thruster 1 .. n gives: 1 works, 0 is lost. The autopilot does not learn of
        it.
        """
        if self._health[thruster - 1] == health:
            return
        row = row_at(t_s)
        self._change_control(row, t_s)
        self._health[thruster - 1] = health
        self._effectiveness[:] = self._B * self._health
        self._tell(row)

    def thruster_health(self, thruster: int) -> float:
        """Share of its thrust that thruster 1 .. n gives."""
        return float(self._health[thruster - 1])

    def position(self, t_s: float) -> tuple[float, float, float]:
        """Position x, y, z in m at time t."""
        row = row_at(t_s)
        if row > self.computed_row:
            self.look_ahead(row)
        track = self.track
        return track.item(row, 0), track.item(row, 1), track.item(row, 2)

    def pose(self, t_s: float) -> Pose:
        """Pose eta at time t."""
        row = row_at(t_s)
        self.look_ahead(row)
        x_m, y_m, z_m = self.track[row, kernel.POSITION].tolist()
        return Pose(x_m, y_m, z_m, *euler_angles(self.track[row, kernel.ATTITUDE]))

    def nu(self, t_s: float) -> tuple[float, ...]:
        """Velocity nu in the body frame at time t, six components in m/s and rad/s."""
        row = row_at(t_s)
        self.look_ahead(row)
        return tuple(self.track[row, kernel.VELOCITY].tolist())

    def look_ahead(self, row: int) -> None:
        """Fill the track up to a row as it will be if control does not change.

        Raises:
            ValueError: the row lies beyond the mission's end.
        """
        if row > self.computed_row:
            if row > self.last_row:  # compiled code would write past the track
                raise ValueError(f"the vehicle's track ends at {self.last_row * STEP_S:g} s, before {row * STEP_S:g} s")
            kernel.advance(
                self.track,
                self.computed_row,
                row,
                self._step_s,
                self._set_point,
                self._parameters,
                self._allocation,
                self._effectiveness,
            )
            self.computed_row = row

    def give_ahead(
        self,
        t_s: float,
        places_m: Array,
        sent_as_m: tuple[float, float, float],
        watch: Watch,
        *,
        first: int,
        last: int,
        begin: bool = False,
    ) -> tuple[list[int], int]:
        """Give set-points ahead: each place that is found reached at a tick will be followed by the next one.

        A change of control drops the set-points that are still to come then. While there are some already, nothing is
        given, and only the first place is looked at.

        Args:
            t_s: mission time.
            places_m: where the vehicle is to come, one after the other: x, y, z in the first three columns, shape
                (n, at least 3). What comes after the last is for the caller to command.
            sent_as_m: what is added to a place's x and y in its set-point, and the set-points' z.
            watch: the ticks, and when a place is reached.
            first: first tick to look at.
            last: last tick to look at for the first place; ticks after the mission's end do not count.
            begin: whether to command the first place's set-point now; else it is commanded already.

        Returns:
            The tick at which each place will be found reached, as far as it will if control does not change; and the
            tick at which the caller has to see to it again: the last place is reached then, or one not in time.
        """
        row = row_at(t_s)
        x_m, y_m, z_m = sent_as_m
        sent_as_m = x_m, y_m, z_m = x_m, y_m, z_m + self._altitude_error_m
        if begin:
            self._change_control(row, t_s)
            set_point = self._set_point
            set_point[0], set_point[1], set_point[2] = places_m.item(0, 0) + x_m, places_m.item(0, 1) + y_m, z_m
        elif self._course is not None:
            if self._course.is_under_way(t_s):
                places_m = places_m[:1]
            else:
                self._course = None
        before = self._set_point.copy()
        places = len(places_m)
        ticks = np.empty(places, dtype=np.int64)
        reached, self.computed_row = kernel.follow_places(
            self.track,
            self.computed_row,
            self._step_s,
            self._set_point,
            self._parameters,
            self._allocation,
            self._effectiveness,
            places_m,
            sent_as_m,
            (watch.half_width_m, watch.half_height_m),
            (watch.began_s, watch.period_s, STEP_S),
            (first, last, watch.fewest_ticks, watch.most_ticks),
            ticks,
        )
        found: list[int] = ticks[:reached].tolist()
        is_new = reached > 0 and places > 1
        if is_new:
            self._course = _Course(watch, found[: places - 1], before, places_m, sent_as_m)
        if is_new or begin:
            self._tell(row)
        if reached == places:
            return found, found[-1]
        return found, found[-1] + watch.most_ticks if found else last

    def drop_ahead(self, t_s: float, watch: Watch, tick: int) -> None:
        """At time t, drop what was given ahead with a watch for ticks after `tick`; nothing, if it is dropped already.

        Args:
            t_s: mission time.
            watch: the one that was passed to `give_ahead`.
            tick: its last tick until now.
        """
        if self._course is not None and self._course.watch is watch:
            row = row_at(t_s)
            self._cut(row, self._course.set_point(tick))
            self._tell(row)

    def _change_control(self, row: int, t_s: float) -> None:
        course = self._course
        self._cut(row, self._set_point if course is None else course.set_point(course.watch.last_tick_until(t_s)))

    def _cut(self, row: int, set_point: Array) -> None:
        """Fill the track up to a row, and no further; from there on there is one set-point."""
        self.look_ahead(row)
        self.computed_row = row
        self._set_point = set_point
        self._course = None

    def _tell(self, row: int) -> None:
        for listener in self.control_listeners:
            listener(row)


def track_rows(duration_s: float) -> int:
    """Rows of the track of a mission; each has `kernel.ROW` columns."""
    return row_at(duration_s) + 2


def row_at(t_s: float) -> int:
    """Row of the track nearest to a mission time: the one rounding rule that reading and commanding share."""
    return round(t_s / STEP_S)


def quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> tuple[float, float, float, float]:
    """Unit quaternion (w, x, y, z) of Euler angles (Handbook, 2.2.3)."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def euler_angles(attitude: Array) -> tuple[float, float, float]:
    """Roll, pitch and yaw in rad of a unit quaternion (w, x, y, z), shape (4,) (Handbook, 2.2.3)."""
    w, x, y, z = (float(part) for part in attitude)
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw
