"""Thruster allocation: what the thrusters make together, and how the autopilot spreads a demand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.vehicle.vehicle import STEP_S, Vehicle
from tests.helpers.processors import printed_on_each
from tests.helpers.stand_ins import BLUEROV2, NET_BUOYANCY_N, nu, set_nu

ALLOCATIONS = """
from dataclasses import replace
from suave_des.vehicle.model import Thruster
from tests.helpers.stand_ins import BLUEROV2

print(BLUEROV2.allocation.tolist())
slanted = [Thruster(each.position_m, (0.6, 0.0, 0.8)) for each in BLUEROV2.thrusters[:2]]
print(replace(BLUEROV2, thrusters=(*slanted, *BLUEROV2.thrusters[2:])).allocation.tolist())
"""
B = BLUEROV2.wrenches
S = np.sqrt(0.5)
SURGE, SWAY, HEAVE, ROLL, PITCH, YAW = range(6)


@pytest.mark.parametrize(
    ("thruster", "wrench"),
    [
        # Moments worked out by hand, r x F: yaw = x Fy - y Fx for the horizontal ones, roll = y Fz
        # for the vertical.
        (1, (-S, -S, 0.0, 0.0, 0.0, -0.232 * S)),
        (2, (-S, S, 0.0, 0.0, 0.0, 0.232 * S)),
        (3, (S, -S, 0.0, 0.0, 0.0, 0.242 * S)),
        (4, (S, S, 0.0, 0.0, 0.0, -0.242 * S)),
        (5, (0.0, 0.0, -1.0, 0.109, 0.0, 0.0)),
        (6, (0.0, 0.0, -1.0, -0.109, 0.0, 0.0)),
    ],
)
def test_wrench_of_each_thruster(thruster, wrench):
    assert B[:, thruster - 1] == pytest.approx(np.array(wrench))


demands = st.tuples(*[st.floats(-20.0, 20.0)] * 6)


@given(demands)
def test_healthy_thrusters_give_any_demand_but_pitch(demand):
    demanded = np.array(demand)
    given_wrench = B @ (BLUEROV2.allocation @ demanded)
    demanded[PITCH] = 0.0
    assert given_wrench == pytest.approx(demanded, abs=1e-9)


def first_wrench(vehicle: Vehicle) -> np.ndarray:
    """What pushed the vehicle in its first step from rest: M nu' (no drag at rest)."""
    inertia = np.array([BLUEROV2.mass_kg] * 3 + list(BLUEROV2.inertia_kg_m2))
    return inertia * nu(vehicle, STEP_S) / STEP_S


@pytest.mark.parametrize("lost", [1, 2, 3, 4, 5, 6])
def test_autopilot_commands_a_lost_thruster_as_if_it_worked(make_vehicle, lost):
    healthy, failed = make_vehicle(), make_vehicle(lost=(lost,))
    for vehicle in (healthy, failed):
        vehicle.command(0.0, 0.3, -0.2, -17.8)
    net_buoyancy = np.array([0, 0, NET_BUOYANCY_N, 0, 0, 0])
    commanded = BLUEROV2.allocation @ (first_wrench(healthy) - net_buoyancy)
    commanded[lost - 1] = 0.0
    assert first_wrench(failed) == pytest.approx(B @ commanded + net_buoyancy, abs=1e-9)


def test_thrust_is_limited(make_vehicle):
    vehicle = make_vehicle()
    set_nu(vehicle, (-40.0, 0, 0, 0, 0, 0))  # the velocity loop asks for far more than there is
    vehicle.command(0.0, 10.0, 0.0, -18.0)
    drag_alone = -40.0 / (1.0 + STEP_S * BLUEROV2.quadratic_drag[SURGE] * 40.0 / BLUEROV2.mass_kg)
    push = 4.0 * S * BLUEROV2.thrust_limit_n / BLUEROV2.mass_kg * STEP_S
    with_push = (-40.0 + push) / (
        1.0 + STEP_S * BLUEROV2.quadratic_drag[SURGE] * 40.0 / BLUEROV2.mass_kg
    )
    assert drag_alone < nu(vehicle, STEP_S)[SURGE] == pytest.approx(with_push)


def test_it_is_the_same_on_all_processors():
    assert len(set(printed_on_each(ALLOCATIONS))) == 1
