"""Generate search path: the spiral's set-points, tick by tick."""

import math

import pytest

from suave_des.managed.search import GenerateSearchPath
from tests.helpers.stand_ins import (
    INACTIVE,
    START,
    VIEW_TANGENT,
    PlacedVehicle,
    revision,
    spiral_at,
)

ORIGIN = (-17.0, 2.3)
PHASE_S = 0.25
TURN_WIDTH_PER_M = 2.0 * math.tan(math.radians(30.0))
BOTH = pytest.mark.parametrize("name", ["2023", "1.5"])


class Search:
    """A search node with its vehicle and clock; its ticks come at 0.25, 1.25, 2.25, ... s."""

    def __init__(self, name: str, vehicle: PlacedVehicle) -> None:
        self.env, self.vehicle = vehicle.env, vehicle
        self.node = GenerateSearchPath(
            self.env,
            vehicle.sender,
            vehicle.flight.state.search,
            revision(name).spiral,
            ORIGIN,
            VIEW_TANGENT,
            PHASE_S,
        )

    def ticks(self, count: int) -> None:
        """Let a number of ticks pass."""
        self.vehicle.run(self.env.now + count)

    @property
    def last(self) -> tuple[float, float, float]:
        return self.vehicle.commanded[-1]

    def spiral(self, centre: tuple[float, float]) -> list[tuple[float, float]]:
        """Radius and angle of each set-point."""
        offsets = [(x - centre[0], y - centre[1]) for x, y, _ in self.vehicle.commanded]
        return [(math.hypot(dx, dy), math.atan2(dy, dx) % (2 * math.pi)) for dx, dy in offsets]


def searching(name: str, altitude_m: float = 1.0, **vehicle: object) -> Search:
    search = Search(name, PlacedVehicle(**vehicle))
    search.node.apply(spiral_at(altitude_m))
    return search


def point(n_radius: float, n_angle: int, altitude_m: float = 1.0) -> tuple[float, float]:
    """The spiral's radius after so many widths of a turn's share, and the angle of step n."""
    width = TURN_WIDTH_PER_M * altitude_m
    return pytest.approx((n_radius * width * 0.1 / (2 * math.pi), 0.1 * n_angle))


@pytest.mark.parametrize(("name", "centre"), [("2023", ORIGIN), ("1.5", START[:2])])
def test_first_set_point_is_that_of_step_1_around_the_revisions_centre(name, centre):
    search = searching(name)
    search.ticks(1)
    assert search.spiral(centre) == [point(1, 1)]


def starting_after_4_5_s(name: str) -> Search:
    """A search that was activated at 20 s, of which 24.25 s are over."""
    search = Search(name, PlacedVehicle(obeys=True))
    search.node.start_latency_s = 4.5
    search.ticks(20)
    search.node.apply(spiral_at(1.0))
    search.ticks(5)
    return search


@BOTH
def test_the_first_set_point_comes_some_time_after_the_first_activation(name):
    search = starting_after_4_5_s(name)
    before = len(search.vehicle.commanded)
    search.ticks(1)
    assert (before, len(search.vehicle.commanded)) == (0, 1)


@BOTH
def test_after_a_later_activation_it_comes_at_once(name):
    search = starting_after_4_5_s(name)
    search.ticks(1)
    search.node.apply(INACTIVE)
    search.ticks(10)
    search.node.apply(spiral_at(1.0))
    search.ticks(1)
    assert len(search.vehicle.commanded) == 2


@BOTH
@pytest.mark.parametrize("altitude_m", [1.0, 2.0, 3.0])
def test_set_points_are_at_the_modes_altitude_above_the_bed(name, altitude_m):
    search = searching(name, altitude_m)
    search.ticks(1)
    assert search.last[2] == -20.0 + altitude_m


@pytest.mark.parametrize("altitude_m", [1.0, 3.0])
def test_a_reached_set_point_gives_the_next_one_each_tick_in_the_nodes_phase(altitude_m):
    search = searching("2023", altitude_m, obeys=True)
    search.ticks(40)
    assert search.spiral(ORIGIN) == [point(n, n, altitude_m) for n in range(1, 41)]
    assert search.vehicle.times_s == [0.25 + n for n in range(40)]


@pytest.mark.parametrize("before_m", [(), (3.0,), (3.0, 1.0)])  # which no tick sees
def test_a_change_of_altitude_skips_one_angle_step_but_no_radius(before_m):
    search = searching("2023", obeys=True)
    search.ticks(3)
    for altitude_m in (*before_m, 2.0):
        search.node.apply(spiral_at(altitude_m))
    search.ticks(1)
    # at 2 m a step widens the spiral twice as much
    assert search.spiral(ORIGIN)[-1] == point(3 + 2, 5)


@BOTH
@pytest.mark.parametrize(
    ("error_m", "goes_on"),
    [
        ((0.39, 0.39, 0.39), True),
        ((0.41, 0.0, 0.0), False),
        ((0.0, -0.41, 0.0), False),
        ((0.0, 0.0, 0.41), False),
    ],
    ids=["in the box", "x", "y", "z"],
)
def test_reached_means_within_0_4_m_along_each_axis(name, error_m, goes_on):
    search = searching(name)
    search.ticks(1)
    x, y, z = search.last
    search.vehicle.put((x + error_m[0], y + error_m[1], z + error_m[2]))
    search.ticks(1)
    assert (len(search.vehicle.commanded) == 2) is goes_on


@BOTH
def test_a_set_point_not_reached_is_sent_again_every_11_ticks(name):
    search = searching(name)
    search.ticks(1)
    search.vehicle.put((0.0, 0.0, -19.0))
    search.ticks(30)
    assert search.vehicle.commands[1:] == [(12.25, search.last), (23.25, search.last)]


@pytest.mark.parametrize(("name", "step_m"), [("2023", 0.5), ("1.5", 0.25)])
def test_when_only_z_is_missed_each_resending_asks_for_less_altitude(name, step_m):
    search = searching(name, rise_m=0.5, obeys=True)
    search.vehicle.rise_m = 5.0  # whatever is commanded, z is not reached
    search.ticks(35)
    assert [z for _, _, z in search.vehicle.commanded] == pytest.approx(
        [-19.0 - step_m * times for times in range(4)]
    )


def stopping_short() -> Search:
    """A vehicle that stops half a metre above each set-point."""
    search = searching("2023", obeys=True, rise_m=0.5)
    search.ticks(20)
    return search


def test_the_work_around_frees_a_vehicle_that_stops_half_a_metre_short():
    assert stopping_short().vehicle.times_s[:3] == [0.25, 12.25, 13.25]


def test_its_offset_stays():
    assert {z_m for _, _, z_m in stopping_short().vehicle.commanded[1:]} == {-19.5}


@pytest.mark.parametrize(("name", "z_m"), [("2023", -19.5), ("1.5", -19.0)])
def test_offset_after_a_new_activation(name, z_m):
    search = searching(name, obeys=True, rise_m=0.5 if name == "2023" else 0.45)
    search.ticks(13)
    search.node.apply(INACTIVE)
    search.vehicle.put((*search.last[:2], -19.0))
    search.node.apply(spiral_at(1.0))
    search.ticks(1)
    assert search.last[2] == pytest.approx(z_m)


def locked_up() -> Search:
    """One whose altitude was changed while it stood."""
    search = searching("2023", 3.0, obeys=True, rise_m=0.5)
    search.ticks(5)
    search.node.apply(spiral_at(1.0))
    search.ticks(50)
    return search


def test_an_altitude_change_in_a_stall_locks_the_spiral_up():
    assert len({place[:2] for place in locked_up().vehicle.commanded}) == 1


def test_the_offset_goes_on_falling_then():
    z_m = [z_m for _, _, z_m in locked_up().vehicle.commanded[1:]]
    assert z_m == [-19.5, -20.0, -20.5, -21.0]


@BOTH
def test_inactive_it_sends_nothing(name):
    search = searching(name, obeys=True)
    search.ticks(3)
    search.node.apply(INACTIVE)
    search.ticks(30)
    assert len(search.vehicle.commanded) == 3


@pytest.mark.parametrize(
    ("name", "origin", "reached"), [("2023", ORIGIN, 8), ("1.5", (-10.0, 1.0), 1)]
)
def test_where_a_spiral_begins_when_activated_again_is_the_revisions(name, origin, reached):
    search = searching(name, obeys=True)
    search.ticks(7)
    search.node.apply(INACTIVE)
    search.ticks(5)
    if origin != ORIGIN:
        search.vehicle.put((*origin, -19.0))
    search.node.apply(spiral_at(1.0))
    search.ticks(1)
    assert search.spiral(origin)[-1] == point(reached, reached)
