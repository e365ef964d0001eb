"""Follow pipeline: points, polls, and the distance it publishes."""

import math
from itertools import pairwise
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
import simpy

from suave_des.managed.follow import FollowPipeline, InspectionPath
from suave_des.vehicle.model import Autopilot, Pose
from suave_des.vehicle.vehicle import Vehicle
from tests.helpers.stand_ins import (
    ACTIVE,
    BLUEROV2,
    INACTIVE,
    MovingVehicle,
    PlacedVehicle,
    revision,
    sender,
)

BOTH = pytest.mark.parametrize("name", ["2023", "1.5"])
LINE = [(-0.5 * n, 0.0) for n in range(45)]  # more than are queued at a time
SPEED = 0.25


def follow_of(
    env: simpy.Environment, name: str, vehicle: PlacedVehicle, path=LINE
) -> FollowPipeline:
    """A follow function whose path is a line; without one, the pipeline is not detected."""
    points = np.insert(np.array(path or LINE), 2, -18.75, axis=1)
    lengths_m = (0.0, *(math.dist(a, b) for a, b in pairwise(points.tolist())))
    detector = SimpleNamespace(first_point=None if path is None else 0)
    return FollowPipeline(
        env,
        sender(env, vehicle),
        revision(name).follow,
        InspectionPath(points, lengths_m),
        detector,
    )


def along_the_line() -> MovingVehicle:
    """At 0.25 m/s along the line's points, 2 s from each to the next."""
    return MovingVehicle(lambda t_s: (-SPEED * t_s, 0.0, -18.75))


@pytest.fixture
def env() -> simpy.Environment:
    return simpy.Environment()


def test_path_goes_there_and_back_along_all_points():
    path = InspectionPath.there_and_back(np.array(LINE), 1.25)
    assert path.points_m[:, :2].tolist() == [list(point) for point in (*LINE, *reversed(LINE))]
    assert set(path.points_m[:, 2]) == {-18.75} and path.lengths_m[41:46] == (
        0.5,
        0.5,
        0.5,
        0.5,
        0.0,
    )


@BOTH
def test_points_are_visited_in_order_and_those_already_reached_at_once(env, name):
    vehicle = PlacedVehicle(obeys=True)
    follow = follow_of(env, name, vehicle)
    follow.apply(ACTIVE)
    env.run(until=0.01)
    assert follow.finished.triggered
    assert [(x, y) for x, y, _ in vehicle.commanded] == LINE


@BOTH
def test_distance_is_the_sum_of_the_steps_between_reached_points(env, name):
    corner = [(0.0, 0.0), (0.5, 0.0), (0.5, 1.5), (0.0, 1.5)]
    follow = follow_of(env, name, PlacedVehicle(obeys=True), corner)
    follow.apply(ACTIVE)
    env.run(until=1.0)
    assert follow.distance_m == pytest.approx(2.5)


@pytest.mark.parametrize(("name", "box_m"), [("2023", 0.4), ("1.5", 0.5)])
@pytest.mark.parametrize(
    ("axis", "offset_m", "reached"),
    [
        (0, -0.01, True),
        (0, 0.01, False),
        (1, -0.01, True),
        (1, 0.01, False),
        (2, 3.0, True),
    ],  # depth does not matter
)
def test_box_within_which_a_point_is_reached(env, name, box_m, offset_m, reached, axis):
    place = [0.0, 0.0, -18.75]
    place[axis] += box_m + offset_m
    vehicle = PlacedVehicle(tuple(place))
    follow_of(env, name, vehicle, [(0.0, 0.0), (9.0, 9.0)]).apply(ACTIVE)
    env.run(until=0.1)
    assert (len(vehicle.commanded) == 2) is reached


# The box of a point 2.125 m along is entered after 6.9 s in 2023, after 6.5 s in 1.5; polls follow
# at 7 and at 8 s.
@pytest.mark.parametrize(("name", "seen_s"), [("2023", 1.5 + 7.0), ("1.5", 1.5 + 8.0)])
def test_polls_lie_on_a_grid_that_begins_with_the_activation(env, name, seen_s):
    vehicle = MovingVehicle(lambda t_s: (-SPEED * (t_s - 1.5), 0.0, -18.75))
    follow = follow_of(env, name, vehicle, [(-2.125, 0.0), (-99.0, 0.0)])
    env.run(until=1.5)
    follow.apply(ACTIVE)
    env.run(until=15.0)
    assert next(t_s for t_s, (x, _, _) in vehicle.commands if x == -99.0) == pytest.approx(seen_s)


@pytest.mark.parametrize(("name", "again_s"), [("2023", 2.0), ("1.5", 20.0)])
def test_a_point_not_reached_is_sent_again_after_10_polls_1_25_m_above_the_bed(env, name, again_s):
    vehicle = PlacedVehicle((50.0, 50.0, -18.75))
    follow_of(env, name, vehicle).apply(ACTIVE)
    env.run(until=3 * again_s - 0.1)
    assert vehicle.commands == [(pytest.approx(n * again_s), (0.0, 0.0, -18.75)) for n in range(3)]


def test_revision_2025_sends_a_point_again_at_each_poll_after_the_tenth(env):
    vehicle = PlacedVehicle((50.0, 50.0, -18.75))
    follow_of(env, "2025", vehicle).apply(ACTIVE)
    env.run(until=27.0)
    assert vehicle.times_s == [0.0, 22.0, 24.0, 26.0]


# Deactivation and activation. The vehicle's box for -2.0 m (fifth point) is reached before 8 s in
# both revisions.


def switched_off(
    env: simpy.Environment, name: str, at_s: float = 8.5
) -> tuple[FollowPipeline, MovingVehicle]:
    vehicle = along_the_line()
    follow = follow_of(env, name, vehicle)
    follow.apply(ACTIVE)
    env.run(until=at_s)
    follow.apply(INACTIVE)
    env.run(until=at_s + 1.0)
    return follow, vehicle


def last_reached(vehicle: MovingVehicle) -> float:
    return vehicle.commanded[-2][0]  # the last one sent was not reached any more


@pytest.mark.parametrize(("name", "adds"), [("2023", True), ("1.5", False)])
def test_revision_2023_alone_adds_the_way_from_the_last_point_when_switched_off(env, name, adds):
    follow, vehicle = switched_off(env, name)
    way_m = abs(-SPEED * 8.5 - last_reached(vehicle))
    assert follow.distance_m == pytest.approx(-last_reached(vehicle) + adds * way_m)


@BOTH
def test_switched_on_again_it_publishes_nothing_until_there_is_a_new_distance(env, name):
    follow, vehicle = switched_off(env, name)
    before_m = follow.distance_m
    vehicle._way = lambda _: (90.0, 90.0, -18.75)
    follow.apply(ACTIVE)
    env.run(until=30.0)
    assert follow.distance_m == before_m > 0.0


@BOTH
def test_switched_on_again_the_distance_counts_from_zero(env, name):
    follow, vehicle = switched_off(env, name)
    first_new = len(vehicle.commanded)
    vehicle.obeys = True
    here = [vehicle.position(env.now)]
    vehicle._way = lambda _: here[-1]
    command = vehicle.command

    def obey(t_s: float, x_m: float, y_m: float, z_m: float) -> None:
        command(t_s, x_m, y_m, z_m)
        here.append((x_m, y_m, z_m))

    vehicle.command = obey
    follow.apply(ACTIVE)
    env.run(until=30.0)
    new = [place[:2] for place in vehicle.commanded[first_new:]]
    assert follow.distance_m == pytest.approx(math.dist(new[0], new[-1]))


@pytest.mark.parametrize(("name", "starts_again"), [("2023", True), ("1.5", False)])
def test_switched_on_again_revision_2023_starts_the_path_and_15_goes_on_with_the_point_not_reached(
    env, name, starts_again
):
    follow, vehicle = switched_off(env, name)
    pending, sent = vehicle.commanded[-1], len(vehicle.commanded)
    follow.apply(ACTIVE)
    env.run(until=env.now + 0.1)
    assert vehicle.commanded[sent] == ((0.0, *pending[1:]) if starts_again else pending)


@BOTH
def test_without_a_detection_there_is_nothing_to_follow(env, name):
    vehicle = PlacedVehicle()
    follow_of(env, name, vehicle, None).apply(ACTIVE)
    env.run(until=60.0)
    assert vehicle.commanded == []


# When several things happen at one time


@BOTH
def test_a_poll_due_when_it_is_switched_off_was_due_before(env, name):
    period_s = revision(name).follow.poll_period_s
    vehicle = MovingVehicle(lambda t_s: (-1.1 if t_s >= 3 * period_s else 0.0, 0.0, -18.75))
    follow = follow_of(env, name, vehicle, [(0.0, 0.0), (-1.1, 0.0), (-9.0, 0.0)])
    switch = env.timeout(3 * period_s)  # scheduled before any poll
    switch.callbacks.append(lambda _: follow.apply(INACTIVE))
    follow.apply(ACTIVE)
    env.run(until=4 * period_s)
    assert follow.distance_m == pytest.approx(1.1)


@BOTH
def test_the_distance_can_be_asked_for_at_any_time(env, name):
    follow, asked = follow_of(env, name, along_the_line()), follow_of(env, name, along_the_line())
    follow.apply(ACTIVE)
    asked.apply(ACTIVE)
    published_m = []
    for t_s in range(1, 30):
        env.run(until=t_s + 0.3)
        published_m.append(asked.distance_m)
    assert published_m == sorted(published_m)
    assert len(set(published_m)) > 10
    assert follow.distance_m == published_m[-1]


def real_end(name: str, changed_s: float | None) -> tuple[float, float, list[float]]:
    """When a real vehicle has followed the line, the distance, and the times at which the node
    means to act.

    A thruster fails at one time, and works again at once.
    """
    env = simpy.Environment()
    vehicle = Vehicle(BLUEROV2, Autopilot(), Pose(1.0, 0.3, -18.75, 0.0, 0.0, 0.0), 120.0)
    follow = follow_of(env, name, vehicle)
    follow._alarm.set = alarm = mock.Mock(wraps=follow._alarm.set)
    if changed_s is not None:
        for state in ("dead", "works"):
            env.timeout(changed_s).callbacks.append(
                lambda _, state=state: vehicle.set_thruster(env.now, 1, state)
            )
    follow.apply(ACTIVE)
    env.run(until=follow.finished)
    return env.now, follow.distance_m, [call.args[0] for call in alarm.call_args_list]


@BOTH
def test_control_that_changes_at_the_poll_that_ends_the_queue_changes_nothing_else(name):
    end_s, distance_m, acting_s = real_end(name, None)
    assert acting_s and all(real_end(name, at_s)[:2] == (end_s, distance_m) for at_s in acting_s)
