"""The guided autopilot's settings, and the parameter vector of the compiled motion that follows from them."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from suave_des.compiling import Array
from suave_des.vehicle.model import VehicleModel


class Autopilot(NamedTuple):
    """The guided controller: ArduSub's cascade of position, velocity and attitude loops, in its simplest form.

    Attributes:
        position_gain_per_s: velocity demanded for each metre of position error.
        horizontal_speed_limit_m_per_s: limit of the demanded horizontal velocity.
        vertical_speed_limit_m_per_s: limit of the demanded vertical velocity.
        velocity_time_constant_s: how fast the velocity follows its demand; the integral gain makes the loop critically
            damped for a body without drag.
        altitude_error_m: steady error: the autopilot holds its altitude set-point plus this.
        altitude_deadband_m: the autopilot stops this far short of its altitude set-point.
        attitude_frequency_rad_per_s: natural frequency of roll and heading control, as of a BlueROV2's angle
            controller; missions are not sensitive to it.
    """

    position_gain_per_s: float
    horizontal_speed_limit_m_per_s: float
    vertical_speed_limit_m_per_s: float
    velocity_time_constant_s: float
    altitude_error_m: float = 0.0
    altitude_deadband_m: float = 0.0
    attitude_frequency_rad_per_s: float = 3.0


def kernel_parameters(
    model: VehicleModel, autopilot: Autopilot, current_m_per_s: Iterable[float], z_limits_m: Iterable[float]
) -> Array:
    """Constants of vehicle, autopilot and water, in the order of the places that `kernel` names, shape (29,)."""
    rate, omega = 1.0 / autopilot.velocity_time_constant_s, autopilot.attitude_frequency_rad_per_s
    # An integral may ask for as much as the four horizontal thrusters together give along one axis, and no more.
    integral_limit = 4.0 * model.thrust_limit_n * math.sqrt(0.5) / model.mass_kg
    forces = model.buoyancy_n - model.weight_n, model.buoyancy_n * model.centre_of_buoyancy_m, *model.quadratic_drag
    limits = model.thrust_limit_n, *autopilot[:3], autopilot.altitude_deadband_m
    velocity = rate, rate * rate / 4.0, integral_limit
    attitude = omega * omega, 2.0 * omega, omega**3 / 8.0, 4.0 * omega * omega
    body = model.mass_kg, *model.inertia_kg_m2, *forces
    return np.array((*body, *limits, *velocity, *attitude, *current_m_per_s, *z_limits_m))
