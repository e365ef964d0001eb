"""The guided autopilot's settings, and the parameter vector of the compiled motion that follows from them."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from suave_des.compiling import Array
from suave_des.vehicle.model import VehicleModel


class Autopilot(NamedTuple):
    """The guided controller of ArduSub: legs from set-point to set-point, and loops that follow the target on them.

    A new set-point is the end of a leg; a target moves along it, from rest to rest with a limited jerk. Position errors
    to the target demand a velocity, velocity errors a force (ArduPilot, AC_WPNav, SCurve and AC_PosControl). Its limits
    of a leg's speed and acceleration are left out: only legs of more than 30 m, or 2 m up or down, would reach them.

    Attributes:
        position_gain_per_s: horizontal velocity demanded for each metre of position error; ArduSub's default is 1.0.
        jerk_m_per_s3: of a leg. ArduSub's default is 1.0 with gradual changes of jerk; a constant 0.5 takes about as
            long on legs of 0.3 m.
        velocity_gain_per_s: horizontal acceleration demanded for each m/s of velocity error.
        velocity_integral_gain_per_s2: horizontal acceleration demanded for each metre of integrated velocity error.
        heading_frequency_rad_per_s: natural frequency of heading control, critically damped.
        heading_integral_gain_per_s3: angular acceleration demanded for each rad s of integrated heading error.
        vertical_position_gain_per_s: as the horizontal one; ArduSub's default is 3.0.
        vertical_velocity_gain_per_s, vertical_velocity_integral_gain_per_s2: as the horizontal ones.
        roll_frequency_rad_per_s: natural frequency of roll control; missions are not sensitive to it.
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
def kernel_parameters(model: VehicleModel, autopilot: Autopilot, z_limits_m: tuple[float, float]) -> Array:
    """Put the constants of vehicle and autopilot into the places that `kernel` names, in water at rest."""
    ap = autopilot
    # The integral is limited to the force that the four horizontal thrusters together give along one axis.
    integral_limit = 4.0 * model.thrust_limit_n * math.sqrt(0.5) / model.mass_kg
    forces = model.buoyancy_n - model.weight_n, model.buoyancy_n * model.centre_of_buoyancy_m, *model.quadratic_drag
    legs = model.thrust_limit_n, ap.position_gain_per_s, ap.vertical_position_gain_per_s, ap.jerk_m_per_s3
    horizontal = ap.velocity_gain_per_s, ap.velocity_integral_gain_per_s2
    vertical = ap.vertical_velocity_gain_per_s, ap.vertical_velocity_integral_gain_per_s2
    roll, heading = ap.roll_frequency_rad_per_s, ap.heading_frequency_rad_per_s
    attitude = roll * roll, 2.0 * roll, heading * heading, 2.0 * heading
    turning = ap.heading_integral_gain_per_s3, 4.0 * heading * heading
    body = model.mass_kg, *model.inertia_kg_m2, *forces
    loops = *horizontal, *vertical, integral_limit, *attitude, *turning
    parameters = np.array((*body, *legs, *loops, *[0.0] * 3, *z_limits_m, *[0.0] * 4))
    parameters.flags.writeable = False
    return parameters
