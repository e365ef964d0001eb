"""The vehicle that a scenario describes."""

from functools import lru_cache

from suave_des.scenario.vehicle import VehicleDescription
from suave_des.vehicle.model import Thruster, VehicleModel


@lru_cache(maxsize=64)
def vehicle_model(description: VehicleDescription) -> VehicleModel:
    """The constants of a vehicle; equal descriptions give the same object, by which its matrices are cached."""
    return VehicleModel(
        mass_kg=description.mass_kg,
        inertia_kg_m2=description.inertia_kg_m2,
        displaced_volume_m3=description.displaced_volume_m3,
        water_density_kg_per_m3=description.water_density_kg_per_m3,
        centre_of_buoyancy_m=description.centre_of_buoyancy_m,
        quadratic_drag=description.quadratic_drag,
        thrust_limit_n=description.thrust_limit_n,
        thrusters=tuple(Thruster(each.position_m, each.direction) for each in description.thrusters),
    )
