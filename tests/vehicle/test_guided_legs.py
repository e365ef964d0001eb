"""Legs of the guided controller, and when changes of control act: from their own time on, to the
last bit.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.vehicle.model import Autopilot, Pose, euler_angles, quaternion
from suave_des.vehicle.vehicle import STEP_S, Vehicle, row_at
from tests.helpers.stand_ins import BLUEROV2, nu

START = Pose(0.0, 0.0, -18.0, 0.0, 0.0, 0.0)
STIFF = Autopilot(
    jerk_m_per_s3=1.0,
    position_gain_per_s=3.0,
    velocity_gain_per_s=10.0,
    velocity_integral_gain_per_s2=0.0,
)
TO_HALF_A_METRE = (0.5, 0.0, -18.0)


def leg_start(vehicle: Vehicle, t_s: float) -> tuple[float, float, float]:
    vehicle.position(t_s)
    state = vehicle.state
    return state.leg_start_x_m, state.leg_start_y_m, state.leg_start_z_m


@pytest.mark.parametrize(("distance_m", "time_s"), [(0.1, 1.474), (0.3, 2.125), (0.5, 2.520)])
def test_a_leg_from_rest_to_rest_takes_four_times_the_cube_root_of_distance_over_two_jerks(
    distance_m, time_s
):
    """At its half time the target is half-way; a stiff vehicle is close behind it, and at the end
    stands at the end.
    """
    vehicle = Vehicle(BLUEROV2, STIFF, START, 30.0)
    vehicle.command(0.0, distance_m, 0.0, -18.0)
    assert vehicle.position(time_s / 2)[0] == pytest.approx(distance_m / 2, rel=0.2)
    assert vehicle.position(time_s + 1.0)[0] == pytest.approx(distance_m, rel=0.06)
    assert 4.0 * vehicle.state.leg_quarter_s == pytest.approx(time_s, abs=1e-3)


@pytest.fixture(scope="module")
def speed_m_per_s() -> np.ndarray:
    """Of the target, at each row of a leg of four parts."""
    vehicle = Vehicle(BLUEROV2, STIFF, START, 30.0)
    vehicle.command(0.0, *TO_HALF_A_METRE)
    vehicle.fly_to_row(row_at(5.0))
    way_m = vehicle.track[: row_at(5.0), 0]
    return np.diff(way_m) / STEP_S


def test_the_target_never_accelerates_by_more_than_1_2_m_per_s2(speed_m_per_s):
    assert np.abs(np.diff(speed_m_per_s)).max() < 0.06


def test_the_target_is_fastest_in_the_middle_of_its_leg(speed_m_per_s):
    assert 1.0 < np.argmax(speed_m_per_s) * STEP_S < 1.8
    assert speed_m_per_s.max() == pytest.approx(0.4, rel=0.15)  # j q^2, with q = 0.63 s


def test_an_interrupted_leg_starts_anew_from_the_stopping_point():
    vehicle = Vehicle(BLUEROV2, Autopilot(), START, 30.0)
    vehicle.command(0.0, 3.0, 0.0, -18.0)
    x_m, y_m, z_m = vehicle.position(2.0)
    u_m_per_s = nu(vehicle, 2.0)[0]
    vehicle.command(2.0, 3.0, 1.0, -18.0)
    # the position gain is 1 / s
    assert leg_start(vehicle, 2.1) == pytest.approx((x_m + u_m_per_s, y_m, z_m), abs=1e-3)


def test_an_interrupted_leg_loses_the_integral():
    vehicle = Vehicle(BLUEROV2, Autopilot(), START, 30.0, current_m_per_s=(-0.3, 0.0, 0.0))
    vehicle.command(0.0, 3.0, 0.0, -18.0)
    vehicle.position(2.0)
    assert vehicle.state.integral_x_m_per_s2 > 0.1
    vehicle.command(2.0, 3.0, 1.0, -18.0)
    vehicle.position(2.0 + STEP_S)
    assert abs(vehicle.state.integral_x_m_per_s2) < 0.05


def test_sending_the_set_point_of_a_completed_leg_again_changes_nothing_of_its_motion():
    once, again = (Vehicle(BLUEROV2, Autopilot(), START, 30.0) for _ in range(2))
    for vehicle in (once, again):
        vehicle.command(0.0, *TO_HALF_A_METRE)
    again.command(8.0, *TO_HALF_A_METRE)
    assert again.position(20.0) == pytest.approx(once.position(20.0), abs=1e-6)


def test_a_new_leg_is_the_same_in_whatever_pieces_the_track_is_filled():
    at_once, in_pieces = (Vehicle(BLUEROV2, Autopilot(), START, 20.0) for _ in range(2))
    for vehicle in (at_once, in_pieces):
        vehicle.command(0.0, *TO_HALF_A_METRE)
    for n in range(10):
        in_pieces.position(0.1 * n)
    for vehicle in (at_once, in_pieces):
        vehicle.command(1.0, 0.6, 0.2, -17.0)
    for n in range(10, 151):
        in_pieces.position(0.1 * n)
    at_once.fly_to_row(row_at(15.0))
    assert np.array_equal(at_once.track[: row_at(15.0)], in_pieces.track[: row_at(15.0)])


def test_control_of_what_is_already_flown_is_refused():
    vehicle = Vehicle(BLUEROV2, Autopilot(), START, 20.0)
    vehicle.position(5.0)
    with pytest.raises(ValueError, match="flown up to 5 s"):
        vehicle.command(4.9, *TO_HALF_A_METRE)
    with pytest.raises(ValueError, match="flown up to 5 s"):
        vehicle.set_thruster(4.9, 1, "dead")


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
    vehicle.fly_to_row(vehicle.last_row)
    return vehicle.track


@given(st.lists(commands | faults, max_size=8), st.lists(times, max_size=20))
def test_reading_at_any_times_changes_no_bit(make_vehicle, plan, readings):
    unread = carry_out(make_vehicle(duration_s=DURATION_S), plan, [])
    assert np.array_equal(unread, carry_out(make_vehicle(duration_s=DURATION_S), plan, readings))


@given(st.integers(0, 10_000), st.floats(-0.49, 0.49))
def test_a_time_belongs_to_the_nearest_row(row, offset):
    assert row_at((row + offset) * STEP_S) == row


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_euler_angles_come_back_from_the_quaternion(roll, pitch, yaw):
    assert euler_angles(quaternion(roll, pitch, yaw)) == pytest.approx((roll, pitch, yaw), abs=1e-6)
