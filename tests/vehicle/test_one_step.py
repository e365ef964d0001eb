"""One step of the vehicle against the same equations in vectors and matrices, with SciPy's rotations.

Source: Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2.2, 3.3, 4.1 and 12.3.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from suave_des.compiling import shared
from suave_des.vehicle.kernel import VehicleRecord, advance, along_leg, begin_leg
from suave_des.vehicle.model import Autopilot, vehicle_record
from tests.helpers.stand_ins import BLUEROV2

STEP_S = 0.05
AUTOPILOT = Autopilot(heading_integral_gain_per_s3=0.7)
SEEDS = range(40)


def vector(vehicle: VehicleRecord, names: str) -> np.ndarray:
    return np.array([getattr(vehicle, name) for name in names.split()])


def put(vehicle: VehicleRecord, names: str, values: np.ndarray) -> None:
    for name, value in zip(names.split(), values, strict=True):
        setattr(vehicle, name, float(value))


POSITION = "x_m y_m z_m"
ATTITUDE = "qw qx qy qz"
VELOCITY = "u_m_per_s v_m_per_s w_m_per_s"
RATES = "p_rad_per_s q_rad_per_s r_rad_per_s"
INTEGRALS = "integral_x_m_per_s2 integral_y_m_per_s2 integral_z_m_per_s2"
LEG_START = "leg_start_x_m leg_start_y_m leg_start_z_m"
LEG_END = "leg_end_x_m leg_end_y_m leg_end_z_m"
ALONG = "leg_along_x leg_along_y leg_along_z"
SET_POINT = "set_point_x_m set_point_y_m set_point_z_m"
CURRENT = "current_x_m_per_s current_y_m_per_s current_z_m_per_s"


def in_any_state(seed: int, floor_m: float = -np.inf, ceiling_m: float = np.inf):
    """A tumbling vehicle in a current, on a leg, some thrusters limited; as an array of records, the
    first of which it is.
    """
    rng = np.random.default_rng(seed)
    records = (VehicleRecord * 2)(vehicle_record(BLUEROV2, AUTOPILOT, (floor_m, ceiling_m)))
    vehicle = records[0]
    attitude = rng.normal(size=4)
    along = rng.normal(size=3)
    vehicle.step_s = STEP_S
    put(vehicle, POSITION, rng.uniform(-5.0, 5.0, 3))
    put(vehicle, ATTITUDE, attitude / np.linalg.norm(attitude))
    put(vehicle, VELOCITY, rng.normal(0.0, 0.6, 3))
    put(vehicle, RATES, rng.normal(0.0, 0.5, 3))
    put(vehicle, INTEGRALS, rng.normal(0.0, 0.2, 3))
    put(vehicle, LEG_START, vector(vehicle, POSITION) + rng.normal(0.0, 0.3, 3))
    put(vehicle, ALONG, along / np.linalg.norm(along))
    put(vehicle, CURRENT, rng.normal(0.0, 0.3, 3))
    vehicle.heading_integral_rad_per_s2 = rng.normal(0.0, 0.3)
    vehicle.leg_length_m = length_m = rng.uniform(1.0, 8.0)
    vehicle.leg_quarter_s = quarter_s = (length_m / (2.0 * vehicle.jerk_m_per_s3)) ** (1.0 / 3.0)
    vehicle.leg_top_speed_m_per_s = vehicle.jerk_m_per_s3 * quarter_s**2
    vehicle.leg_time_s = rng.uniform(0.0, 4.0 * quarter_s)
    least_n = np.array(vehicle.least_n[:]) * rng.choice([0.0, 0.2, 1.0], 6)
    vehicle.least_n[:], vehicle.greatest_n[:] = least_n.tolist(), (-least_n).tolist()
    return records


def rotation(vehicle: VehicleRecord) -> Rotation:
    """Body to world."""
    w, x, y, z = vector(vehicle, ATTITUDE)
    return Rotation.from_quat([x, y, z, w])


def wanted_wrench(vehicle: VehicleRecord, to_world: Rotation) -> np.ndarray:
    """What the autopilot wants, and its integrals afterwards."""
    time_s = vehicle.leg_time_s + STEP_S
    leg = vehicle.leg_length_m, vehicle.leg_quarter_s, vehicle.jerk_m_per_s3
    distance_m, speed_m_per_s = along_leg(time_s, *leg, vehicle.leg_top_speed_m_per_s)
    along = vector(vehicle, ALONG)
    off_m = vector(vehicle, LEG_START) + distance_m * along - vector(vehicle, POSITION)
    flat, up = vehicle.position_gain_per_s, vehicle.position_gain_z_per_s
    slower = np.array([flat, flat, up]) * off_m + along * speed_m_per_s
    slower -= to_world.apply(vector(vehicle, VELOCITY))
    flat, up = vehicle.velocity_integral_gain_per_s2, vehicle.velocity_integral_gain_z_per_s2
    limit = vehicle.integral_limit_m_per_s2
    integrals = vector(vehicle, INTEGRALS) + STEP_S * np.array([flat, flat, up]) * slower
    integrals = np.clip(integrals, -limit, limit)
    flat, up = vehicle.velocity_gain_per_s, vehicle.velocity_gain_z_per_s
    force_n = vehicle.mass_kg * (np.array([flat, flat, up]) * slower + integrals)

    heading = Rotation.from_quat([0.0, 0.0, vehicle.half_heading_sin, vehicle.half_heading_cos])
    left = (to_world.inv() * heading).as_quat(canonical=True)[:3] * 2.0
    limit = vehicle.heading_integral_limit_rad_per_s2
    gain = vehicle.heading_integral_gain_per_s3
    turned = np.clip(vehicle.heading_integral_rad_per_s2 + STEP_S * gain * left[2], -limit, limit)
    roll = vehicle.roll_gain_per_s2 * left[0] - vehicle.roll_rate_gain_per_s * vehicle.p_rad_per_s
    yaw = vehicle.heading_gain_per_s2 * left[2] + turned
    yaw -= vehicle.heading_rate_gain_per_s * vehicle.r_rad_per_s
    moment_n_m = [vehicle.inertia_x_kg_m2 * roll, 0.0, vehicle.inertia_z_kg_m2 * yaw]
    return np.array([*to_world.inv().apply(force_n), *moment_n_m])


def after_a_step(vehicle: VehicleRecord) -> dict[str, np.ndarray]:
    """Position, velocity, rates and attitude after a step, by the equations of motion."""
    to_world = rotation(vehicle)
    thrust_n = np.array(vehicle.allocation).T @ wanted_wrench(vehicle, to_world)
    thrust_n = np.clip(thrust_n, vehicle.least_n[:], vehicle.greatest_n[:])
    wrench = thrust_n @ np.array(vehicle.wrenches)
    up = to_world.inv().apply([0.0, 0.0, 1.0])
    wrench[:3] += vehicle.net_buoyancy_n * up
    wrench[3:] += vehicle.righting_n_m * np.cross([0.0, 0.0, 1.0], up)

    velocity, rates = vector(vehicle, VELOCITY), vector(vehicle, RATES)
    inertia = vector(vehicle, "inertia_x_kg_m2 inertia_y_kg_m2 inertia_z_kg_m2")
    faster = wrench[:3] / vehicle.mass_kg - np.cross(rates, velocity)
    spun = (wrench[3:] - np.cross(rates, inertia * rates)) / inertia
    drag = np.array(vehicle.drag)
    water = to_world.inv().apply(vector(vehicle, CURRENT))
    through = velocity - water
    velocity = water + (through + STEP_S * faster) / (1.0 + STEP_S * drag[:3] * abs(through))
    rates = (rates + STEP_S * spun) / (1.0 + STEP_S * drag[3:] * abs(rates))

    w, x, y, z = vector(vehicle, ATTITUDE)
    p, q, r = rates
    turned = np.array([w, x, y, z]) + 0.5 * STEP_S * np.array(
        [
            -x * p - y * q - z * r,
            w * p + y * r - z * q,
            w * q + z * p - x * r,
            w * r + x * q - y * p,
        ]
    )
    return {
        POSITION: vector(vehicle, POSITION) + STEP_S * to_world.apply(velocity),
        VELOCITY: velocity,
        RATES: rates,
        ATTITUDE: turned / np.linalg.norm(turned),
    }


def step(records) -> VehicleRecord:
    advance(shared(records), np.empty((2, 7)), 1)
    return records[0]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_step_follows_the_equations_of_motion(seed):
    records = in_any_state(seed)
    expected = after_a_step(records[0])
    vehicle = step(records)
    for names, values in expected.items():
        np.testing.assert_allclose(vector(vehicle, names), values, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("seed", SEEDS[:10])
@pytest.mark.parametrize("stopped_by", ["sea bed", "surface"])
def test_sea_bed_and_surface_take_the_velocity_through_them(seed, stopped_by):
    z_m = in_any_state(seed)[0].z_m
    limits_m = (z_m + 1.0, np.inf) if stopped_by == "sea bed" else (-np.inf, z_m - 1.0)
    records = in_any_state(seed, *limits_m)
    to_world = rotation(records[0])
    free = to_world.apply(after_a_step(records[0])[VELOCITY])
    vehicle = step(records)
    expected = to_world.inv().apply([free[0], free[1], 0.0])
    assert vehicle.z_m == limits_m[0 if stopped_by == "sea bed" else 1]
    np.testing.assert_allclose(vector(vehicle, VELOCITY), expected, rtol=0.0, atol=1e-6)
    pushes_away = vehicle.integral_z_m_per_s2
    assert pushes_away >= 0.0 if stopped_by == "sea bed" else pushes_away <= 0.0


@pytest.mark.parametrize("seed", SEEDS[:10])
def test_an_interrupted_leg_starts_where_the_vehicle_would_stop(seed):
    records = in_any_state(seed)
    vehicle = records[0]
    gains = vector(vehicle, "position_gain_per_s position_gain_per_s position_gain_z_per_s")
    stop_m = vector(vehicle, POSITION) + rotation(vehicle).apply(vector(vehicle, VELOCITY)) / gains
    begin_leg(shared(records)[0])
    np.testing.assert_allclose(vector(records[0], LEG_START), stop_m, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("off_m", "is_complete"), [(1.9, True), (2.1, False), (-1.9, True)])
def test_a_leg_that_is_over_is_complete_within_two_metres_of_its_end(axis, off_m, is_complete):
    records = in_any_state(1)
    vehicle = records[0]
    vehicle.leg_time_s = 4.0 * vehicle.leg_quarter_s
    end_m = vector(vehicle, POSITION)
    end_m[axis] += off_m
    put(vehicle, LEG_END, end_m)
    begin_leg(shared(records)[0])
    assert np.array_equal(vector(records[0], LEG_START), end_m) == is_complete


def test_a_new_leg_leads_to_the_set_point_in_the_time_of_its_length():
    records = in_any_state(2)
    vehicle = records[0]
    put(vehicle, SET_POINT, np.array([4.0, -3.0, -2.0]))
    begin_leg(shared(records)[0])
    vehicle = records[0]
    way_m = vector(vehicle, SET_POINT) - vector(vehicle, LEG_START)
    length_m = np.linalg.norm(way_m)
    assert vehicle.leg_length_m == pytest.approx(length_m)
    np.testing.assert_allclose(vector(vehicle, ALONG), way_m / length_m, atol=1e-12)
    assert 4.0 * vehicle.leg_quarter_s == pytest.approx(
        4.0 * (length_m / (2.0 * vehicle.jerk_m_per_s3)) ** (1.0 / 3.0)
    )
