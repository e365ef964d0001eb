"""A mission that its caller advances: the same as any other, whatever the steps."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des import InputError, Mission
from suave_des.simulation.simulator import Simulator

SEARCH = "f_generate_search_path"


@given(steps_s=st.lists(st.floats(0.0, 40.0), min_size=1, max_size=30))
@settings(max_examples=30)
def test_how_a_mission_is_cut_into_steps_changes_nothing(simulator, steps_s):
    mission = Mission(simulator, "metacontrol", run=2, seed=1)
    for step_s in steps_s:
        mission.advance(mission.now_s + step_s)
    assert mission.result().metrics == simulator.run("metacontrol", 2, 1).metrics


def test_a_requested_mode_takes_effect_after_the_latency():
    mission = Mission("seams2023", run=1, record=True)
    mission.advance(10.0)
    mission.change_mode(SEARCH, "fd_spiral_high")
    assert mission.current_mode(SEARCH) == "fd_spiral_high"
    mission.advance(20.0)
    times_s = [
        each.t_s for each in mission.result().events if each.detail == f"{SEARCH} = fd_spiral_high"
    ]
    assert times_s == [pytest.approx(10.5, abs=0.5)]


def test_it_shows_what_a_manager_would_see(simulator):
    mission = Mission(simulator, run=1)
    assert (
        mission.measured("water_visibility") is None
        and mission.measured("water_visibility", 0.0) == 0.0
    )
    mission.advance(60.0)
    assert mission.searches and SEARCH in mission.functions
    assert mission.components == {"c_thruster_1": "FALSE"}
    assert 0.0 < mission.measured("water_visibility") < 4.0
    assert -20.0 < mission.pose.z_m < 0.0
    assert mission.distance_inspected_m == 0.0


def test_it_stops_at_its_end(simulator):
    mission = Mission(simulator, run=1)
    mission.advance(1e6)
    assert (
        mission.is_over and mission.now_s == simulator.run("none", 1, 1).metrics.mission_duration_s
    )
    assert mission.task is None


@pytest.mark.parametrize("until", [-1.0, 4.0, float("nan")])
def test_it_does_not_go_back(simulator, until):
    mission = Mission(simulator)
    mission.advance(5.0)
    with pytest.raises(InputError, match="cannot go to"):
        mission.advance(until)


def close_after(simulator: Simulator, t_s: float | None) -> Mission:
    """A mission that is closed at a time; None: when it has its result."""
    mission = Mission(simulator)
    if t_s is None:
        mission.result()
    else:
        mission.advance(t_s)
    mission.close()
    return mission


@pytest.mark.parametrize(
    "use",
    [
        lambda mission: mission.advance(9.0),
        lambda mission: mission.result(),
        lambda mission: mission.change_mode(SEARCH, "fd_spiral_high"),
        lambda mission: mission.pose,
        lambda mission: mission.way_m(),
    ],
    ids=["advance", "result", "change_mode", "pose", "way_m"],
)
def test_what_a_closed_mission_cannot_do_says_that_it_is_closed(simulator, use):
    with pytest.raises(InputError, match="the mission is closed"):
        use(close_after(simulator, 5.0))


def test_what_does_not_need_the_vehicles_way_can_be_read_after_closing(simulator):
    still, closed = Mission(simulator), close_after(simulator, 50.0)
    still.advance(50.0)
    assert closed.metrics() == still.metrics()
    assert (closed.now_s, closed.task, closed.modes) == (50.0, still.task, still.modes)
    assert closed.current_mode(SEARCH) == still.current_mode(SEARCH)


def test_a_result_can_be_read_after_closing(simulator):
    assert close_after(simulator, None).result() == Mission(simulator).result()


def test_the_memory_of_a_closed_mission_is_that_of_the_next_one_only(simulator):
    first = close_after(simulator, 5.0)
    first.close()
    second, third = Mission(simulator), Mission(simulator)
    assert second._vehicle.track is first._vehicle.track
    assert third._vehicle.track is not second._vehicle.track
