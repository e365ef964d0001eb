"""Constants of a vehicle, and how its thrusters make a generalised force.

Body frame: x forward, y left, z up, origin at the centre of mass. Generalised force tau = (X, Y, Z, K, M, N) in N and N
m, generalised velocity nu = (u, v, w, p, q, r) in m/s and rad/s (Fossen, Handbook of Marine Craft Hydrodynamics and
Motion Control, section 2.1; the axes here follow the exemplar, z up, and so do the signs).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from suave_des.compiling import Array

GRAVITY_M_PER_S2 = 9.80665


@dataclass(frozen=True, slots=True)
class Thruster:
    """One thruster: its position, and the direction of its force at positive command (a unit vector)."""

    position_m: tuple[float, float, float]
    direction: tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class VehicleModel:
    """A rigid body with thrusters in water; compared by identity, which makes cached results quick to look up.

    Attributes:
        inertia_kg_m2: principal moments (Ixx, Iyy, Izz).
        centre_of_buoyancy_m: height above the centre of mass at which buoyancy acts.
        quadratic_drag: coefficients of -c |nu| nu for the six components of nu, N s^2/m^2 and N m s^2.
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

    @property
    def buoyancy_n(self) -> float:
        """Buoyancy of the submerged body."""
        return self.water_density_kg_per_m3 * self.displaced_volume_m3 * GRAVITY_M_PER_S2

    @property
    def weight_n(self) -> float:
        """Weight of the body."""
        return self.mass_kg * GRAVITY_M_PER_S2


@cache
def allocation_matrix(model: VehicleModel) -> Array:
    """Compute B in tau = B u, shape (6, number of thrusters); column i: thruster i's wrench at 1 N (Handbook, 12.3)."""
    wrenches = [(*each.direction, *np.cross(each.position_m, each.direction)) for each in model.thrusters]
    return _read_only(np.array(wrenches).T)


@cache
def autopilot_allocation(model: VehicleModel) -> Array:
    """Compute B's pseudo-inverse, shape (number of thrusters, 6), by which an autopilot spreads a demanded wrench.

    The autopilot allocates as if every thruster worked; a wrench that no thruster can make (pitch, on a BlueROV2) gets
    none.
    """
    return _read_only(np.linalg.pinv(allocation_matrix(model), rcond=1e-9))


def _read_only(values: ArrayLike) -> Array:
    matrix: Array = np.ascontiguousarray(values)
    matrix.flags.writeable = False
    return matrix
