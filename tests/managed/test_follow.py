"""Follow pipeline: points, polls, and the distance it publishes."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from suave_des.managed.follow import FollowPipeline, there_and_back
from suave_des.vehicle.vehicle import row_at
from tests.helpers.stand_ins import ACTIVE, INACTIVE, PlacedVehicle, revision

BOTH = pytest.mark.parametrize("name", ["2023", "1.5"])
LINE = [(-0.5 * n, 0.0) for n in range(45)]
SPEED = 0.25
NEVER_MIND = (50.0, 50.0, -18.75)


class Following:
    """A follow function whose path is a line, with its vehicle; without a line, the pipeline is not
    detected.
    """

    def __init__(self, name: str, place=NEVER_MIND, line=LINE, **vehicle: object) -> None:
        points = np.array(line or LINE)
        lengths_m = [0.0, *map(math.dist, points.tolist(), points[1:].tolist())]
        path = np.column_stack((points, lengths_m))
        self.vehicle = PlacedVehicle(place, path=path, **vehicle)
        self.env = self.vehicle.env
        detector = SimpleNamespace(first_point=None if line is None else 0)
        state = self.vehicle.flight.state.follow
        arguments = self.vehicle.sender, state, revision(name).follow, path, detector
        self.node = FollowPipeline(self.env, *arguments)
        self.vehicle.flight.begin(detector, None, self.node)

    def run(self, until_s: float) -> None:
        self.vehicle.run(until_s)


def along_the_line(t_s: float) -> tuple[float, float, float]:
    """At 0.25 m/s along the line's points, 2 s from each to the next."""
    return -SPEED * t_s, 0.0, -18.75


def test_path_returns_along_all_points():
    path = there_and_back(np.array(LINE))
    assert path[:, :2].tolist() == [list(point) for point in (*LINE, *reversed(LINE))]


def test_its_way_back_is_higher_but_for_the_last_points():
    z_m = there_and_back(np.array(LINE))[:, 2]
    assert z_m[[0, 41, 42, 43, 44, 45]].tolist() == [0.0, 0.5, 0.5, 0.5, 0.5, 0.0]


@BOTH
def test_points_are_visited_in_order(name):
    line = [(-0.6 * n, 0.0) for n in range(45)]
    following = Following(name, line=line, obeys=True)
    following.node.apply(ACTIVE)
    following.run(199.0)
    assert following.node.finished.triggered
    assert [(x, y) for x, y, _ in following.vehicle.commanded] == line


@BOTH
def test_points_that_are_already_reached_are_passed_at_one_poll(name):
    near = [(0.05 * n, 0.0) for n in range(5)]
    following = Following(name, (0.1, 0.0, -18.75), near)
    following.node.apply(ACTIVE)
    following.run(0.05)
    assert following.node.finished.triggered
    assert following.vehicle.times_s == [0.0] * 5
    assert following.node.distance_m == pytest.approx(0.2)


@BOTH
def test_distance_is_the_sum_of_the_steps_between_reached_points(name):
    corner = [(0.0, 0.0), (0.5, 0.0), (0.5, 1.5), (0.0, 1.5)]
    following = Following(name, (0.0, 0.0, -18.75), corner, obeys=True)
    following.node.apply(ACTIVE)
    following.run(10.0)
    assert following.node.distance_m == pytest.approx(2.5)


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
def test_box_within_which_a_point_is_reached(name, box_m, offset_m, reached, axis):
    place = [0.0, 0.0, -18.75]
    place[axis] += box_m + offset_m
    following = Following(name, tuple(place), [(0.0, 0.0), (9.0, 9.0)])
    following.node.apply(ACTIVE)
    following.run(0.1)
    assert (len(following.vehicle.commanded) == 2) is reached


# The box of a point 2.125 m along is entered after 6.9 s in 2023, after 6.5 s in 1.5; polls follow
# at 7 and at 8 s.
@pytest.mark.parametrize(("name", "seen_s"), [("2023", 1.5 + 7.0), ("1.5", 1.5 + 8.0)])
def test_polls_lie_on_a_grid_that_begins_with_the_activation(name, seen_s):
    line = [(-2.125, 0.0), (-99.0, 0.0)]
    following = Following(name, lambda t_s: along_the_line(t_s - 1.5), line)
    following.run(1.5)
    following.node.apply(ACTIVE)
    following.run(15.0)
    commands = following.vehicle.commands
    assert next(t_s for t_s, (x, _, _) in commands if x == -99.0) == pytest.approx(seen_s)


@pytest.mark.parametrize(("name", "again_s"), [("2023", 2.0), ("1.5", 20.0)])
def test_a_point_not_reached_is_sent_again_after_10_polls_1_25_m_above_the_bed(name, again_s):
    following = Following(name)
    following.node.apply(ACTIVE)
    following.run(3 * again_s - 0.1)
    sent = [(pytest.approx(n * again_s), (0.0, 0.0, -18.75)) for n in range(3)]
    assert following.vehicle.commands == sent


def test_revision_2025_sends_a_point_again_at_each_poll_after_the_tenth():
    following = Following("2025")
    following.node.apply(ACTIVE)
    following.run(27.0)
    assert following.vehicle.times_s == [0.0, 22.0, 24.0, 26.0]


# Deactivation and activation. The vehicle's box for -2.0 m (fifth point) is reached before 8 s in
# both revisions.


def switched_off(name: str, at_s: float = 8.5) -> Following:
    following = Following(name, along_the_line)
    following.node.apply(ACTIVE)
    following.run(at_s)
    following.node.apply(INACTIVE)
    following.run(at_s + 1.0)
    return following


def last_reached(following: Following) -> float:
    return following.vehicle.commanded[-2][0]  # the last one sent was not reached any more


@pytest.mark.parametrize(("name", "adds"), [("2023", True), ("1.5", False)])
def test_revision_2023_alone_adds_the_way_from_the_last_point_when_switched_off(name, adds):
    following = switched_off(name)
    way_m = abs(-SPEED * 8.5 - last_reached(following))
    assert following.node.distance_m == pytest.approx(-last_reached(following) + adds * way_m)


@BOTH
def test_switched_on_again_it_publishes_nothing_until_there_is_a_new_distance(name):
    following = switched_off(name)
    before_m = following.node.distance_m
    following.vehicle.put(NEVER_MIND)
    following.node.apply(ACTIVE)
    following.run(30.0)
    assert following.node.distance_m == before_m > 0.0


@pytest.mark.parametrize(("name", "goes_on_s", "from_m"), [("2023", 0.0, 0.0), ("1.5", 9.5, -3.0)])
def test_switched_on_again_the_distance_counts_from_zero(name, goes_on_s, from_m):
    following = switched_off(name)
    following.vehicle.put(lambda t_s: along_the_line(t_s - 9.5 + goes_on_s))
    following.node.apply(ACTIVE)
    following.run(30.0)
    assert following.node.distance_m == pytest.approx(from_m - last_reached(following))


@pytest.mark.parametrize(("name", "starts_again"), [("2023", True), ("1.5", False)])
def test_where_a_path_begins_when_switched_on_again_is_the_revisions(name, starts_again):
    following = switched_off(name)
    commanded = following.vehicle.commanded
    following.node.apply(ACTIVE)
    following.run(following.env.now + 0.1)
    again = (0.0, *commanded[-1][1:]) if starts_again else commanded[-1]
    assert following.vehicle.commanded[len(commanded)] == again


@BOTH
def test_without_a_detection_there_is_nothing_to_follow(name):
    following = Following(name, line=None)
    following.node.apply(ACTIVE)
    following.run(60.0)
    assert following.vehicle.commanded == []


@BOTH
def test_a_poll_due_when_it_is_switched_off_was_due_before(name):
    period_s = revision(name).follow.poll_period_s
    line = [(0.0, 0.0), (-1.1, 0.0), (-9.0, 0.0)]
    poll = row_at(3 * period_s)
    following = Following(
        name, lambda t_s: (-1.1 if row_at(t_s) >= poll else 0.0, 0.0, -18.75), line
    )
    switch = following.env.timeout(3 * period_s)
    switch.callbacks.append(lambda _: following.node.apply(INACTIVE))
    following.node.apply(ACTIVE)
    following.run(4 * period_s)
    assert following.node.distance_m == pytest.approx(1.1)
