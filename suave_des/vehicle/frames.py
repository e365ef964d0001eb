"""Pose and attitude: Euler angles and unit quaternions (Fossen, Handbook of Marine Craft Hydrodynamics, 2.2)."""

from math import asin, atan2, cos, sin
from typing import NamedTuple

from suave_des.compiling import Array


class Pose(NamedTuple):
    """eta in the world frame: position in m, attitude as Euler angles in rad (order z, y, x; Handbook, 2.2.1)."""

    x_m: float
    y_m: float
    z_m: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float


def quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> tuple[float, float, float, float]:
    """Convert Euler angles to a unit quaternion (w, x, y, z) (Handbook, 2.2.3)."""
    cr, cp, cy = cos(roll_rad / 2), cos(pitch_rad / 2), cos(yaw_rad / 2)
    sr, sp, sy = sin(roll_rad / 2), sin(pitch_rad / 2), sin(yaw_rad / 2)
    w, x = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    return w, x, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy


def euler_angles(attitude: Array) -> tuple[float, float, float]:
    """Convert a unit quaternion (w, x, y, z), shape (4,), to roll, pitch and yaw in rad (Handbook, 2.2.3)."""
    w, x, y, z = attitude.tolist()
    roll = atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw
