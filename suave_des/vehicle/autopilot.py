"""The guided autopilot's settings, and the parameter vector of the compiled motion that follows from them."""

import math
from typing import NamedTuple

import numpy as np

from suave_des.vehicle import kernel
from suave_des.vehicle.model import Array, VehicleModel


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
            controller; what follows is not sensitive to it.
    """

    position_gain_per_s: float
    horizontal_speed_limit_m_per_s: float
    vertical_speed_limit_m_per_s: float
    velocity_time_constant_s: float
    altitude_error_m: float = 0.0
    altitude_deadband_m: float = 0.0
    attitude_frequency_rad_per_s: float = 3.0


def kernel_parameters(
    model: VehicleModel,
    autopilot: Autopilot,
    current_m_per_s: tuple[float, float, float],
    z_limits_m: tuple[float, float],
) -> Array:
    """Constants of vehicle, autopilot and water, in the places that `kernel` names, shape (kernel.PARAMETERS,)."""
    inertia = (model.mass_kg, model.mass_kg, model.mass_kg, *model.inertia_kg_m2)
    rate = 1.0 / autopilot.velocity_time_constant_s
    omega = autopilot.attitude_frequency_rad_per_s
    values = [0.0] * kernel.PARAMETERS
    values[kernel.MASS : kernel.MASS + 4] = inertia[2:]
    values[kernel.NET_BUOYANCY] = model.buoyancy_n - model.weight_n
    values[kernel.RIGHTING] = model.buoyancy_n * model.centre_of_buoyancy_m
    values[kernel.DRAG : kernel.DRAG + 6] = model.quadratic_drag
    values[kernel.THRUST_LIMIT] = model.thrust_limit_n
    values[kernel.POSITION_GAIN : kernel.POSITION_GAIN + 3] = autopilot[:3]
    values[kernel.ALTITUDE_DEADBAND] = autopilot.altitude_deadband_m
    values[kernel.VELOCITY_GAIN : kernel.VELOCITY_GAIN + 2] = rate, rate * rate / 4.0
    # An integral may ask for as much as the four horizontal thrusters together give along one axis, and no more.
    values[kernel.INTEGRAL_LIMIT] = 4.0 * model.thrust_limit_n * math.sqrt(0.5) / model.mass_kg
    values[kernel.ATTITUDE_GAIN : kernel.ATTITUDE_GAIN + 2] = omega * omega, 2.0 * omega
    values[kernel.HEADING_INTEGRAL_GAIN] = omega**3 / 8.0
    values[kernel.HEADING_INTEGRAL_LIMIT] = 4.0 * omega * omega
    values[kernel.CURRENT : kernel.CURRENT + 3] = current_m_per_s
    values[kernel.INVERSE_MASS : kernel.INVERSE_MASS + 4] = [1.0 / each for each in inertia[2:]]
    values[kernel.DRAG_RATE : kernel.DRAG_RATE + 6] = [
        drag / each for drag, each in zip(model.quadratic_drag, inertia, strict=True)
    ]
    values[kernel.FLOOR], values[kernel.CEILING] = z_limits_m
    return np.array(values)
