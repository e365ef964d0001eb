"""Maintain motion, which recovers the thrusters; and generate recharge path: the way to the
recharge station.
"""

from types import SimpleNamespace

import pytest
import simpy

from suave_des.managed.destinations import GenerateRechargePath
from suave_des.managed.motion import MaintainMotion
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.measurements import BatteryMeasurements, Timing
from suave_des.scenario.models import Battery
from tests.helpers.stand_ins import ACTIVE, INACTIVE, PlacedVehicle, revision

BOTH = pytest.mark.parametrize("name", ["2023", "1.5"])


class Motion:
    """The node with what it restores and publishes."""

    def __init__(self, name: str) -> None:
        self.env = simpy.Environment()
        bus = DiagnosticsBus()
        self.published: list[Diagnostic] = []
        self.restored: list[tuple[float, int]] = []
        bus.subscribe(self.published.append)
        thrusters = SimpleNamespace(recover=self.recover)
        self.node = MaintainMotion(self.env, bus, revision(name).recovery, thrusters, lambda: 10.0)

    def recover(self, thruster: int) -> bool:
        self.restored.append((self.env.now, thruster))
        return True


@BOTH
def test_thrusters_are_restored_one_by_one_four_a_second_after_10_s(name):
    motion = Motion(name)
    motion.node.apply(ACTIVE)
    motion.env.run()
    assert motion.restored == [(10.0 + 0.25 * n, n + 1) for n in range(6)]


@BOTH
def test_each_is_published_when_it_is_restored(name):
    motion = Motion(name)
    motion.node.apply(ACTIVE)
    motion.env.run()
    assert motion.published == [
        Diagnostic(t_s, Kind.COMPONENT_STATUS, f"c_thruster_{number}", "RECOVERED")
        for t_s, number in motion.restored
    ]


@BOTH
def test_inactive_modes_recover_nothing(name):
    motion = Motion(name)
    motion.node.apply(INACTIVE)
    motion.env.run()
    assert motion.restored == []


def interrupted(name: str, at_s: float) -> Motion:
    motion = Motion(name)
    motion.node.apply(ACTIVE)
    motion.env.run(until=at_s)
    motion.node.apply(INACTIVE)
    return motion


@pytest.mark.parametrize(
    ("name", "at_s", "restored"),
    [("2023", 3.0, 6), ("2023", 10.3, 6), ("1.5", 3.0, 0), ("1.5", 10.3, 2)],
)
def test_whether_recovery_outlasts_its_deactivation_is_the_revisions(name, at_s, restored):
    motion = interrupted(name, at_s)
    motion.env.run()
    assert len(motion.restored) == restored


def test_recovery_begins_anew_after_an_abort():
    motion = interrupted("1.5", 3.0)
    motion.node.apply(ACTIVE)
    motion.env.run()
    assert motion.restored[0] == (13.0, 1) and len(motion.restored) == 6


def test_activation_during_a_recovery_that_goes_on_starts_no_second_one():
    motion = interrupted("2023", 3.0)
    motion.node.apply(ACTIVE)
    motion.env.run()
    assert [t_s for t_s, _ in motion.restored] == [10.0 + 0.25 * n for n in range(6)]


@BOTH
def test_a_second_recovery_can_follow_the_first(name):
    motion = Motion(name)
    motion.node.apply(ACTIVE)
    motion.env.run(until=20.0)
    motion.node.apply(INACTIVE)
    motion.node.apply(ACTIVE)
    motion.env.run()
    assert [t_s for t_s, thruster in motion.restored if thruster == 1] == [10.0, 30.0]


def recharging() -> tuple[PlacedVehicle, GenerateRechargePath]:
    vehicle = PlacedVehicle()
    level = BatteryMeasurements(200.0, Timing(1.0, 0.5), 1000.0)
    node = GenerateRechargePath(vehicle.env, vehicle.sender, Battery(), level, phase_s=0.5)
    node.apply(ACTIVE)
    return vehicle, node


def test_active_it_sends_the_vehicle_to_the_station():
    vehicle, _ = recharging()
    vehicle.run(11.0)
    assert vehicle.commanded == [(-3.0, -2.0, -18.75)] * 3
    assert vehicle.times_s == pytest.approx([0.5, 5.5, 10.5], abs=0.051)


def test_docking_is_checked_when_the_station_is_sent():
    vehicle, node = recharging()
    vehicle.run(151.0)
    vehicle.put((-3.4, -1.6, -18.75))
    vehicle.run(155.4)
    assert node.level.recharges == 0
    vehicle.run(156.0)
    assert (node.level.recharges, node.level.level(155.5), node.level.value(155.5)) == (1, 1.0, 1.0)


def test_inactive_it_leaves_the_autopilot_to_others():
    vehicle, node = recharging()
    vehicle.run(1.0)
    node.apply(INACTIVE)
    vehicle.run(100.0)
    assert len(vehicle.commanded) == 1
