"""Generate recharge path: the way to the recharge station."""

import simpy

from suave_des.managed.destinations import GenerateRechargePath
from suave_des.monitor.measurements import BatteryMeasurements, Timing
from suave_des.scenario.physical import Battery
from tests.helpers.stand_ins import ACTIVE, INACTIVE, PlacedVehicle, sender


def recharging() -> tuple[simpy.Environment, PlacedVehicle, GenerateRechargePath]:
    env, vehicle = simpy.Environment(), PlacedVehicle()
    level = BatteryMeasurements(200.0, Timing(1.0, 0.5))
    node = GenerateRechargePath(env, sender(env, vehicle), Battery(), level, phase_s=0.5)
    node.apply(ACTIVE)
    return env, vehicle, node


def test_active_it_sends_the_vehicle_to_the_station() -> None:
    env, vehicle, _ = recharging()
    env.run(until=11.0)
    assert vehicle.commands == [(t_s, (-3.0, -2.0, -18.75)) for t_s in (0.5, 5.5, 10.5)]


def test_docking_is_checked_when_the_station_is_sent() -> None:
    env, vehicle, node = recharging()
    env.run(until=151.0)
    vehicle.place = (-3.4, -1.6, -18.75)
    env.run(until=155.4)
    assert node.level.recharges == 0
    env.run(until=156.0)
    assert (node.level.recharges, node.level.level(155.5), node.level.times_s[-1]) == (1, 1.0, 155.5)


def test_inactive_it_leaves_the_autopilot_to_others() -> None:
    env, vehicle, node = recharging()
    env.run(until=1.0)
    node.apply(INACTIVE)
    env.run(until=100.0)
    assert len(vehicle.commanded) == 1
