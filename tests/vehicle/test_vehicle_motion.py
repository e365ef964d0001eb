"""The vehicle in the water: where it gets to, in which time, and what lost thrusters and currents
do to it.
"""

import math

import numpy as np
import pytest

from suave_des.vehicle.model import Autopilot, Pose
from suave_des.vehicle.vehicle import STEP_S, Vehicle, row_at
from tests.helpers.stand_ins import BLUEROV2, NET_BUOYANCY_N, nu, set_nu

DIRECTIONS = pytest.mark.parametrize("direction_deg", [0, 45, 90, 180, 270])
PLACE_M = (0.0, 0.0, -18.0)


def time_to_go_s(vehicle: Vehicle, direction_deg: float, distance_m: float = 0.9) -> float:
    """Time until the vehicle is within 0.4 m in x and y of a set-point; infinite if it never is."""
    angle = math.radians(direction_deg)
    x, y = distance_m * math.cos(angle), distance_m * math.sin(angle)
    vehicle.command(0.0, x, y, -18.0)
    vehicle.fly_to_row(vehicle.last_row)
    near = (np.abs(vehicle.track[:, 0] - x) <= 0.4) & (np.abs(vehicle.track[:, 1] - y) <= 0.4)
    return float(np.argmax(near)) * STEP_S if near.any() else math.inf


def test_vehicle_comes_to_rest_at_its_set_point(make_vehicle):
    vehicle = make_vehicle()
    vehicle.command(0.0, 3.0, -2.0, -16.5)
    assert vehicle.position(60.0) == pytest.approx((3.0, -2.0, -16.5), abs=0.01)
    assert nu(vehicle, 60.0) == pytest.approx((0.0,) * 6, abs=1e-3)


def test_without_a_command_the_vehicle_stays(make_vehicle):
    assert make_vehicle().position(100.0) == pytest.approx(PLACE_M, abs=0.01)


def test_altitude_error_is_where_the_vehicle_settles_above_its_set_point(make_vehicle):
    vehicle = make_vehicle(altitude_error_m=0.5)
    vehicle.command(0.0, 0.0, 0.0, -18.0)
    assert vehicle.position(60.0)[2] == pytest.approx(-17.5, abs=0.01)


# Lost thrusters


@DIRECTIONS
@pytest.mark.parametrize("lost", [1, 2, 3, 4])
def test_one_lost_horizontal_thruster_barely_slows_it(make_vehicle, lost, direction_deg):
    healthy_s = time_to_go_s(make_vehicle(), direction_deg)
    assert healthy_s <= time_to_go_s(make_vehicle(lost=(lost,)), direction_deg) < 1.3 * healthy_s


ON_ONE_SIDE = pytest.mark.parametrize("lost", [(1, 3), (2, 4)], ids=["right side", "left side"])


@ON_ONE_SIDE
def test_two_lost_on_one_side_slow_it_ahead(make_vehicle, lost):
    assert time_to_go_s(make_vehicle(lost=lost), 0) > 1.2 * time_to_go_s(make_vehicle(), 0)


@ON_ONE_SIDE
def test_two_lost_on_one_side_turn_it(make_vehicle, lost):
    vehicle = make_vehicle(lost=lost)
    time_to_go_s(vehicle, 0)
    assert max(abs(vehicle.pose(0.1 * n).yaw_rad) for n in range(100)) > 0.2


def test_without_vertical_thrusters_depth_is_not_controlled(make_vehicle):
    vehicle = make_vehicle(lost=(5, 6))
    vehicle.command(0.0, 0.0, 0.0, -19.0)
    assert vehicle.position(60.0)[2] > -18.0


def test_a_recovered_thruster_works_again(make_vehicle):
    vehicle = make_vehicle(lost=(5, 6))
    vehicle.set_thruster(1.0, 5, "works")
    vehicle.set_thruster(1.0, 6, "works")
    vehicle.command(1.0, 0.0, 0.0, -19.0)
    assert vehicle.position(60.0)[2] == pytest.approx(-19.0, abs=0.01)


def test_a_frozen_thruster_keeps_the_thrust_that_it_had(make_vehicle):
    vehicle = make_vehicle(lost=(1, 2, 4, 5, 6))
    vehicle.command(0.0, 10.0, 0.0, -18.0)
    vehicle.set_thruster(2.0, 3, "frozen")
    vehicle.set_thruster(2.0, 3, "frozen")
    vehicle.command(3.0, -10.0, 0.0, -18.0)  # which thruster 3 can do nothing about
    assert math.hypot(*nu(vehicle, 40.0)[:2]) > 0.1
    vehicle.set_thruster(40.0, 3, "dead")
    assert math.hypot(*nu(vehicle, 41.0)[:2]) > 0.01 > math.hypot(*nu(vehicle, 140.0)[:2])


def test_a_loss_is_not_felt_before_its_time(make_vehicle):
    healthy, failed = make_vehicle(), make_vehicle()
    for vehicle in (healthy, failed):
        vehicle.command(0.0, 10.0, 3.0, -17.0)
    failed.set_thruster(10.0, 1, "dead")
    rows = row_at(10.0)
    healthy.fly_to_row(rows + 20)
    failed.fly_to_row(rows + 20)
    assert np.array_equal(healthy.track[: rows + 1], failed.track[: rows + 1])
    assert not np.array_equal(healthy.track[rows + 20], failed.track[rows + 20])


# Without any thrust

ALL = (1, 2, 3, 4, 5, 6)


def test_the_current_carries_it(make_vehicle):
    vehicle = make_vehicle(lost=ALL, current_m_per_s=(0.3, -0.1, 0.0))
    start, end = vehicle.position(100.0), vehicle.position(110.0)
    assert [end[i] - start[i] for i in (0, 1)] == pytest.approx([3.0, -1.0], abs=0.1)


# Sea bed and surface


@pytest.mark.parametrize(
    ("z_m", "limit_m"), [(-25.0, -20.0), (3.0, 0.0)], ids=["sea bed", "surface"]
)
def test_vehicle_stays_in_the_water(make_vehicle, z_m, limit_m):
    vehicle = make_vehicle(z_limits_m=(-20.0, 0.0))
    vehicle.command(0.0, 0.0, 0.0, z_m)
    assert vehicle.position(100.0)[2] == limit_m


# Numerics


@pytest.mark.parametrize(
    "nu", [(0, 0, 0, 80, 0, 0), (0, 0, 0, 0, -80, 60), (30, -30, 30, 50, 50, 50)]
)
def test_a_wild_spin_dies_out(make_vehicle, nu):
    vehicle = make_vehicle()
    set_nu(vehicle, nu)
    assert vehicle.position(120.0) == pytest.approx(PLACE_M, abs=0.05)


def test_turning_about_two_axes_turns_it_about_the_third(make_vehicle):
    vehicle, omega = make_vehicle(lost=ALL), np.array([3.0, -4.0, 2.0])
    set_nu(vehicle, (0.0, 0.0, 0.0, *omega))
    inertia, drag = np.array(BLUEROV2.inertia_kg_m2), np.array(BLUEROV2.quadratic_drag[3:])
    # Euler's equations: I omega' = -omega x (I omega) - drag, the drag taken at the end of the
    # step.
    turned = omega - STEP_S * np.cross(omega, inertia * omega) / inertia
    expected = turned / (1.0 + STEP_S * drag * np.abs(omega) / inertia)
    assert nu(vehicle, STEP_S)[3:] == pytest.approx(expected)


def test_moving_while_turning_feels_the_coriolis_force(make_vehicle):
    vehicle, v, omega = (
        make_vehicle(lost=ALL),
        np.array([0.3, 0.2, -0.1]),
        np.array([0.5, -0.4, 1.0]),
    )
    set_nu(vehicle, (*v, *omega))
    mass, drag = BLUEROV2.mass_kg, np.array(BLUEROV2.quadratic_drag[:3])
    net_buoyancy = np.array([0.0, 0.0, NET_BUOYANCY_N])
    pushed = v + STEP_S * (net_buoyancy / mass - np.cross(omega, v))
    assert nu(vehicle, STEP_S)[:3] == pytest.approx(
        pushed / (1.0 + STEP_S * drag * np.abs(v) / mass)
    )


def test_slower_simulated_world_shows_the_same_motion_later(make_vehicle):
    real_time, half_speed = make_vehicle(), make_vehicle(time_scale=0.5)
    for vehicle in (real_time, half_speed):
        vehicle.command(0.0, 5.0, 3.0, -16.0)
    assert half_speed.position(20.0) == pytest.approx(real_time.position(10.0), abs=0.02)


def test_nothing_is_read_beyond_the_missions_end(make_vehicle):
    with pytest.raises(ValueError, match="ends at"):
        make_vehicle(duration_s=10.0).position(20.0)


# The BlueROV2's constants, by numbers worked out by hand from the exemplar's description of it
# (kas-lab/suave): not read from the vehicle file, so that a slip there, or in the model, shows.

FULL_THRUST = Autopilot(10.0, 100.0, 100.0, 0.15)
"""Demands more than the thrusters give."""


@pytest.mark.parametrize(
    ("way", "component", "speed_m_per_s"),
    [
        # Four thrusters of 50 N at 45 degrees give 141.42 N: sqrt(141.42 / 33.732).
        ((1e4, 0.0, -18.0), 0, 2.0475),
        ((-1e4, 0.0, -18.0), 0, -2.0475),
        # Two vertical ones give 100 N, buoyancy 998 * 0.01004029 * 9.80665 = 98.265 N, less the
        # weight 98.067 N.
        ((0.0, 0.0, 1e4), 2, 1.1698),  # sqrt(100.198 / 73.225)
        ((0.0, 0.0, -1e4), 2, -1.1675),  # sqrt(99.802 / 73.225)
    ],
)
def test_its_greatest_speeds_are_where_drag_balances_thrust(way, component, speed_m_per_s):
    vehicle = Vehicle(BLUEROV2, FULL_THRUST, Pose(*PLACE_M, 0.0, 0.0, 0.0), 60.0)
    vehicle.command(0.0, *way)
    assert nu(vehicle, 50.0)[component] == pytest.approx(speed_m_per_s, rel=0.003)


@pytest.mark.parametrize(
    ("component", "after_s", "speed"),
    [
        (0, 1.0, 1.0 / (1.0 + 33.732 / 10.0)),
        (1, 1.0, 1.0 / (1.0 + 54.16 / 10.0)),
        (5, 1.0, 1.0 / (1.0 + 3.992 / 0.269)),  # the yaw rate, in rad/s
    ],
    ids=["surge", "sway", "yaw"],
)
def test_without_thrust_it_slows_down_by_drag(make_vehicle, component, after_s, speed):
    vehicle = make_vehicle(lost=ALL)
    # v' = -(c / m) v |v| gives v = 1 / (1 + c t / m).
    set_nu(vehicle, [float(place == component) for place in range(6)])
    assert nu(vehicle, after_s)[component] == pytest.approx(speed, rel=0.01)


@pytest.mark.parametrize(
    ("tilt", "period_s"),
    # The righting moment 98.265 N * 0.049 m = 4.815 N m swings it like a pendulum: 2 pi sqrt(I /
    # 4.815).
    [((0.01, 0.0), 0.9009), ((0.0, 0.01), 1.2081)],
    ids=["roll: I 0.099 kg m^2", "pitch: I 0.178 kg m^2"],
)
def test_tilted_it_swings_with_the_period_of_its_inertia(make_vehicle, tilt, period_s):
    vehicle = make_vehicle(Pose(*PLACE_M, *tilt, 0.0), lost=ALL)
    times_s = np.arange(0.0, 12.0, STEP_S)
    poses = [vehicle.pose(t_s) for t_s in times_s.tolist()]
    angles = np.array([pose.roll_rad if tilt[0] else pose.pitch_rad for pose in poses])
    downward = np.flatnonzero((angles[:-1] > 0.0) & (angles[1:] <= 0.0))
    crossings_s = times_s[downward] + STEP_S * angles[downward] / (
        angles[downward] - angles[downward + 1]
    )
    assert np.diff(crossings_s).mean() == pytest.approx(period_s, rel=0.02)
