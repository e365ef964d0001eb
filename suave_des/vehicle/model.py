"""Constants of a vehicle and its autopilot, its pose, and how its thrusters make a generalised
force.

Body frame: x forward, y left, z up, origin at the centre of mass. Generalised force tau = (X, Y, Z,
K, M, N) in N and N m, generalised velocity nu = (u, v, w, p, q, r) in m/s and rad/s (Fossen,
Handbook of Marine Craft Hydrodynamics and Motion Control, section 2.1; the axes here follow the
exemplar, z up, and so do the signs).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import asin, atan2, cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from suave_des.compiling import Array
from suave_des.vehicle.kernel import VehicleRecord

_SAME_EVERYWHERE = 12
"""Decimals of what LAPACK computes that are the same on all processors."""

GRAVITY_M_PER_S2 = 9.80665


class Pose(NamedTuple):
    """eta in the world frame: position in m, attitude as Euler angles in rad (order z, y, x;
    Handbook, 2.2.1).
    """

    x_m: float
    y_m: float
    z_m: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float


def quaternion(
    roll_rad: float, pitch_rad: float, yaw_rad: float
) -> tuple[float, float, float, float]:
    """Convert Euler angles to a unit quaternion (w, x, y, z) (Handbook, 2.2.3)."""
    cr, cp, cy = cos(roll_rad / 2), cos(pitch_rad / 2), cos(yaw_rad / 2)
    sr, sp, sy = sin(roll_rad / 2), sin(pitch_rad / 2), sin(yaw_rad / 2)
    w, x = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    return w, x, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy


def euler_angles(attitude: Sequence[float]) -> tuple[float, float, float]:
    """Convert a unit quaternion (w, x, y, z) to roll, pitch and yaw in rad (Handbook, 2.2.3)."""
    w, x, y, z = attitude
    roll = atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw


@dataclass(frozen=True, slots=True)
class Thruster:
    """One thruster: its position, and the direction of its force at positive command (a unit
    vector).
    """

    position_m: tuple[float, float, float]
    direction: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class VehicleModel:
    """A rigid body with thrusters in water; compared by identity, which makes cached results quick
    to look up.

    Attributes:
        inertia_kg_m2: principal moments (Ixx, Iyy, Izz).
        centre_of_buoyancy_m: height above the centre of mass at which buoyancy acts.
        quadratic_drag: coefficients of -c |nu| nu for the six components of nu, N s^2/m^2 and N m
            s^2.
        thrust_limit_n: largest thrust of each thruster, in both directions.
    """

    mass_kg: float
    inertia_kg_m2: tuple[float, float, float]
    displaced_volume_m3: float
    water_density_kg_per_m3: float
    centre_of_buoyancy_m: float
    quadratic_drag: tuple[float, float, float, float, float, float]
    thrust_limit_n: float
    thrusters: tuple[Thruster, ...]

    @cached_property
    def wrenches(self) -> Array:
        """B in tau = B u, shape (6, number of thrusters); column i: thruster i's wrench at 1 N
        (Handbook, 12.3).
        """
        wrenches = [
            (*each.direction, *np.cross(each.position_m, each.direction)) for each in self.thrusters
        ]
        return _read_only(np.array(wrenches).T)

    @cached_property
    def allocation(self) -> Array:
        """B's pseudo-inverse, shape (number of thrusters, 6), by which the autopilot spreads a
        demanded wrench.

        It allocates as if every thruster worked; a wrench that no thruster can make (pitch, on a
        BlueROV2) gets none.
        """
        # The last digits depend on the processor, for which LAPACK has code of its own.
        found = np.linalg.pinv(self.wrenches, rcond=1e-9)
        return _read_only(found.round(_SAME_EVERYWHERE) + 0.0)  # + 0.0: no minus before a zero


class Autopilot(NamedTuple):
    """The guided controller of ArduSub: legs from set-point to set-point, and loops that follow the
    target on them.

    A new set-point is the end of a leg; a target moves along it, from rest to rest with a limited
    jerk. Position errors to the target demand a velocity, velocity errors a force (ArduPilot,
    AC_WPNav, SCurve and AC_PosControl). Its limits of a leg's speed and acceleration are left out:
    only legs of more than 30 m, or 2 m up or down, would reach them.

    Attributes:
        position_gain_per_s: horizontal velocity demanded for each metre of position error;
            ArduSub's default is 1.0.
        jerk_m_per_s3: of a leg. ArduSub's default is 1.0 with gradual changes of jerk; a constant
            0.5 takes about as long on legs of 0.3 m.
        velocity_gain_per_s: horizontal acceleration demanded for each m/s of velocity error.
        velocity_integral_gain_per_s2: horizontal acceleration demanded for each metre of integrated
            velocity error.
        heading_frequency_rad_per_s: natural frequency of heading control, critically damped.
        heading_integral_gain_per_s3: angular acceleration demanded for each rad s of integrated
            heading error.
        vertical_position_gain_per_s: as the horizontal one; ArduSub's default is 3.0.
        vertical_velocity_gain_per_s, vertical_velocity_integral_gain_per_s2: as the horizontal
        ones.
        roll_frequency_rad_per_s: natural frequency of roll control; missions are not sensitive to
            it.
    """

    position_gain_per_s: float = 1.0
    jerk_m_per_s3: float = 0.5
    velocity_gain_per_s: float = 4.0
    velocity_integral_gain_per_s2: float = 1.2
    heading_frequency_rad_per_s: float = 4.5
    heading_integral_gain_per_s3: float = 0.0
    vertical_position_gain_per_s: float = 3.0
    vertical_velocity_gain_per_s: float = 4.0
    vertical_velocity_integral_gain_per_s2: float = 1.0
    roll_frequency_rad_per_s: float = 3.0


@lru_cache(maxsize=64)
def vehicle_record(
    model: VehicleModel, autopilot: Autopilot, z_limits_m: tuple[float, float]
) -> VehicleRecord:
    """Make the record of a healthy vehicle at rest in water at rest; to be copied."""
    record = VehicleRecord()
    _describe_body(record, model)
    _describe_autopilot(record, autopilot)
    # The integral is limited to the force that the four horizontal thrusters together give along
    # one axis.
    record.integral_limit_m_per_s2 = 4.0 * model.thrust_limit_n * sqrt(0.5) / model.mass_kg
    record.floor_z_m, record.ceiling_z_m = z_limits_m
    return record


def _describe_body(record: VehicleRecord, model: VehicleModel) -> None:
    record.mass_kg = model.mass_kg
    record.inertia_x_kg_m2, record.inertia_y_kg_m2, record.inertia_z_kg_m2 = model.inertia_kg_m2
    buoyancy_n = model.water_density_kg_per_m3 * model.displaced_volume_m3 * GRAVITY_M_PER_S2
    record.net_buoyancy_n = buoyancy_n - model.mass_kg * GRAVITY_M_PER_S2
    record.righting_n_m = buoyancy_n * model.centre_of_buoyancy_m
    inertia = (model.mass_kg,) * 3 + model.inertia_kg_m2
    record.drag[:] = np.divide(model.quadratic_drag, inertia).tolist()
    np.asarray(record.allocation)[:] = model.allocation.T
    np.asarray(record.wrenches)[:] = model.wrenches.T
    limits_n = [model.thrust_limit_n] * len(model.thrusters)
    record.least_n[:], record.greatest_n[:] = [-limit_n for limit_n in limits_n], limits_n


def _describe_autopilot(record: VehicleRecord, autopilot: Autopilot) -> None:
    record.position_gain_per_s = autopilot.position_gain_per_s
    record.position_gain_z_per_s = autopilot.vertical_position_gain_per_s
    record.jerk_m_per_s3 = autopilot.jerk_m_per_s3
    record.velocity_gain_per_s = autopilot.velocity_gain_per_s
    record.velocity_gain_z_per_s = autopilot.vertical_velocity_gain_per_s
    record.velocity_integral_gain_per_s2 = autopilot.velocity_integral_gain_per_s2
    record.velocity_integral_gain_z_per_s2 = autopilot.vertical_velocity_integral_gain_per_s2
    roll, heading = autopilot.roll_frequency_rad_per_s, autopilot.heading_frequency_rad_per_s
    record.roll_gain_per_s2, record.roll_rate_gain_per_s = roll * roll, 2.0 * roll
    record.heading_gain_per_s2, record.heading_rate_gain_per_s = heading * heading, 2.0 * heading
    record.heading_integral_gain_per_s3 = autopilot.heading_integral_gain_per_s3
    record.heading_integral_limit_rad_per_s2 = 4.0 * heading * heading
    record.half_heading_cos = 1.0  # the vehicle is to look east


def _read_only(values: ArrayLike) -> Array:
    matrix: Array = np.asfortranarray(values, dtype=np.float64)
    matrix.flags.writeable = False
    return matrix
