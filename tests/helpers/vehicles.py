"""The shipped vehicle, for tests that need one without a scenario."""

from suave_des.scenario.loader import load_scenario
from suave_des.simulation.prepared import vehicle_model

VEHICLE = load_scenario("seams2023").scenario.vehicle
BLUEROV2 = vehicle_model(VEHICLE)
VIEW_TANGENT = VEHICLE.camera.tangent
