"""Generate recharge path: the way to the recharge station."""

import simpy

from suave_des.managed.destinations import GenerateRechargePath
from tests.helpers.stand_ins import ACTIVE, INACTIVE, PlacedVehicle, sender


def recharging() -> tuple[simpy.Environment, PlacedVehicle, GenerateRechargePath]:
    env, vehicle = simpy.Environment(), PlacedVehicle()
    node = GenerateRechargePath(env, sender(env, vehicle), (-3.0, -2.0, -18.75), 10.0)
    node.apply(ACTIVE)
    return env, vehicle, node


def test_active_it_sends_the_vehicle_to_the_station() -> None:
    env, vehicle, _ = recharging()
    env.run(until=1.0)
    assert vehicle.commanded == [(-3.0, -2.0, -18.75)]


def test_inactive_it_leaves_the_autopilot_to_others() -> None:
    env, vehicle, node = recharging()
    env.run(until=1.0)
    node.apply(INACTIVE)
    env.run(until=100.0)
    assert len(vehicle.commanded) == 1
