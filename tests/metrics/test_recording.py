"""The record of a mission: its trajectory's points are made as they are read."""

from itertools import islice

import pytest

from suave_des import Mission, Simulator, load_scenario
from suave_des.metrics.recording import TRAJECTORY_PERIOD_ROWS
from suave_des.vehicle.vehicle import STEP_S
from tests.helpers.command import python


@pytest.fixture(scope="module")
def mission() -> Mission:
    mission = Mission("seams2023", "none", run=3, record=True)
    mission.result()
    return mission


def test_points_are_the_poses_of_the_mission(mission):
    trajectory, way_m = mission.result().trajectory, mission.way_m()
    assert len(trajectory) == (len(way_m) - 1) // TRAJECTORY_PERIOD_ROWS + 1
    for number in (0, 7, len(trajectory) - 1):
        point = trajectory[number]
        assert point.t_s == pytest.approx(number * TRAJECTORY_PERIOD_ROWS * STEP_S)
        there_m = way_m[number * TRAJECTORY_PERIOD_ROWS].tolist()
        assert [point.x_m, point.y_m, point.z_m] == there_m
        assert point.visibility_m is None or point.visibility_m > 0.0


def test_there_is_no_visibility_before_the_first_measurement(mission):
    assert mission.result().trajectory[0].visibility_m is None


def test_visibility_is_that_of_the_last_measurement(mission):
    measured = mission._surroundings.visibility
    trajectory = mission.result().trajectory
    assert all(point.visibility_m == measured.value(point.t_s) for point in trajectory)


def test_it_is_a_sequence(mission):
    trajectory = mission.result().trajectory
    assert trajectory[-1] == list(trajectory)[-1]
    assert trajectory[2:6:2] == (trajectory[2], trajectory[4])
    assert list(islice(trajectory, 3)) == [trajectory[0], trajectory[1], trajectory[2]]
    with pytest.raises(IndexError):
        trajectory[len(trajectory)]


def test_trajectories_are_equal_if_their_points_are():
    one, same, other = (
        Mission("seams2023", "none", run=run, record=True).result().trajectory for run in (1, 1, 2)
    )
    assert one == same != other


def test_a_later_mission_of_the_same_simulator_leaves_it_as_it_was():
    simulator = Simulator(load_scenario("seams2023"))
    first = simulator.run("none", 1, 1, record=True).trajectory
    before = list(first)
    simulator.run("random", 2, 1, record=True)
    simulator.run("random", 3, 1)
    assert list(first) == before


DAY = """
from pathlib import Path
from suave_des import Mission, Simulator, load_scenario, with_values

far = [(9000.0, 5000.0, -20.0), (9100.0, 5000.0, -20.0)]
day = with_values(
    load_scenario("seams2023"), {"mission.time_limit_s": 86400.0, "pipeline.vertices_m": far}
)
result = Mission(Simulator(day), "none", record=True).result()
most = Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0]
print(sum(1 for point in result.trajectory), most)
"""


@pytest.mark.slow
def test_a_mission_of_a_day_takes_some_three_hundred_megabytes():
    done = python("-c", DAY)
    points, memory_kb = map(int, done.stdout.split())
    assert points == 432_001
    assert memory_kb < 340_000
