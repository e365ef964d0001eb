"""The shipped vehicle, for tests that need one without a scenario."""

from suave_des.scenario.loader import load_scenario
from suave_des.simulation.prepared import vehicle_model
from suave_des.vehicle import kernel
from suave_des.vehicle.model import GRAVITY_M_PER_S2
from suave_des.vehicle.vehicle import Vehicle, row_at

VEHICLE = load_scenario("seams2023").scenario.vehicle
BLUEROV2 = vehicle_model(VEHICLE)
DISPLACED_KG = BLUEROV2.water_density_kg_per_m3 * BLUEROV2.displaced_volume_m3
NET_BUOYANCY_N = (DISPLACED_KG - BLUEROV2.mass_kg) * GRAVITY_M_PER_S2
VIEW_TANGENT = VEHICLE.camera.tangent


def nu(vehicle: Vehicle, t_s: float) -> tuple[float, ...]:
    """The velocity nu at time t: body frame, six components in m/s and rad/s."""
    vehicle.position(t_s)
    return tuple(vehicle.track[row_at(t_s), kernel.VELOCITY].tolist())
