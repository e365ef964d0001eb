"""Reading never changes the trajectory, and a change of control acts from its own time on: to the last bit."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.vehicle.model import euler_angles, quaternion
from suave_des.vehicle.vehicle import STEP_S, Vehicle, row_at

DURATION_S = 40.0
times = st.floats(0.0, DURATION_S)
places = st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-19, -15))
commands = st.tuples(times, places)
faults = st.tuples(times, st.integers(1, 6), st.sampled_from(["works", "frozen", "dead"]))


def carry_out(vehicle: Vehicle, plan: list[tuple], readings: list[float]) -> np.ndarray:
    """Commands and faults at their times, in between readings; the whole track."""
    actions = [(entry[0], 0, place, entry) for place, entry in enumerate(plan)]
    actions += [(t_s, 1, place, None) for place, t_s in enumerate(readings)]
    for t_s, _, _, entry in sorted(actions, key=lambda action: action[:3]):
        if entry is None:
            vehicle.pose(t_s)
        elif len(entry) == 2:
            vehicle.command(t_s, *entry[1])
        else:
            vehicle.set_thruster(*entry)
    vehicle.look_ahead(vehicle.last_row)
    return vehicle.track


@given(st.lists(commands | faults, max_size=8), st.lists(times, max_size=20))
def test_reading_at_any_times_changes_no_bit(make_vehicle, plan: list, readings: list[float]) -> None:
    unread = carry_out(make_vehicle(duration_s=DURATION_S), plan, [])
    read = carry_out(make_vehicle(duration_s=DURATION_S), plan, readings)
    assert np.array_equal(unread, read)


@given(st.lists(commands | faults, max_size=5), st.integers(0, 800))
def test_looking_ahead_does_not_bind_the_future(make_vehicle, plan: list, ahead: int) -> None:
    foresighted = make_vehicle(duration_s=DURATION_S)
    foresighted.control_listeners.append(lambda row, _: foresighted.look_ahead(min(row + ahead, foresighted.last_row)))
    assert np.array_equal(carry_out(make_vehicle(duration_s=DURATION_S), plan, []), carry_out(foresighted, plan, []))


def test_a_thruster_that_is_as_it_was_is_no_change_of_control(make_vehicle) -> None:
    vehicle, rows = make_vehicle(), []
    vehicle.control_listeners.append(lambda row, _: rows.append(row))
    vehicle.set_thruster(1.0, 2, "works")
    vehicle.set_thruster(2.0, 2, "frozen")
    vehicle.set_thruster(3.0, 2, "frozen")
    assert rows == [row_at(2.0)]


def test_listeners_get_the_row_of_a_change_of_control(make_vehicle) -> None:
    vehicle, rows = make_vehicle(), []
    vehicle.control_listeners.append(lambda row, _: rows.append(row))
    vehicle.command(3.0, 1.0, 0.0, -18.0)
    vehicle.set_thruster(4.5, 2, "dead")
    assert rows == [row_at(3.0), row_at(4.5)]


@given(st.integers(0, 10_000), st.floats(-0.49, 0.49))
def test_a_time_belongs_to_the_nearest_row(row: int, offset: float) -> None:
    assert row_at((row + offset) * STEP_S) == row


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_euler_angles_come_back_from_the_quaternion(roll: float, pitch: float, yaw: float) -> None:
    assert euler_angles(np.array(quaternion(roll, pitch, yaw))) == pytest.approx((roll, pitch, yaw), abs=1e-6)


def test_quarter_turn_of_yaw_points_north() -> None:
    assert quaternion(0.0, 0.0, math.pi / 2) == pytest.approx((math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
