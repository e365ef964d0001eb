"""Constants of the exemplar that users may vary: data of the revision and of the vehicle, and felt in missions."""

from itertools import pairwise

import pytest

from suave_des.domain import SEA_BED_Z_M
from suave_des.metrics.result import MissionResult
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator


def flown(manager: str, **values: object) -> MissionResult:
    """One mission of seams2023 with other values, by key path with __ for a dot."""
    still = {"calibration.altitude_error_m": 0.0, **{path.replace("__", "."): each for path, each in values.items()}}
    return Simulator(with_values(load_scenario("seams2023"), still)).run(manager, run=1, seed=1, record=True)


@pytest.mark.parametrize("delay_s", [3.0, 20.0])
def test_a_recovery_takes_as_long_as_the_revision_says(delay_s: float) -> None:
    events = flown("metacontrol", revision__recovery__delay_s=delay_s).events
    began_s = next(event.t_s for event in events if event.detail == "f_maintain_motion = fd_recover_thrusters")
    first_s = next(event.t_s for event in events if event.detail == "c_thruster_1 RECOVERED")
    assert first_s - began_s == pytest.approx(delay_s)


@pytest.mark.parametrize("altitude_m", [0.75, 2.5])
def test_the_pipeline_is_followed_at_the_revisions_altitude(altitude_m: float) -> None:
    last = flown("none", revision__follow__altitude_m=altitude_m).trajectory[-1]
    assert last.mode == "fd_follow_pipeline"
    assert last.z_m - SEA_BED_Z_M == pytest.approx(altitude_m, abs=0.1)


def test_a_camera_that_sees_more_finds_the_pipeline_earlier() -> None:
    found_s = [flown("none", vehicle__camera__field_of_view_deg=deg).metrics.detection_time_s for deg in (60.0, 100.0)]
    assert found_s[1] < found_s[0] - 20.0


def test_weak_thrusters_limit_the_speed() -> None:
    """Full ahead, four horizontal thrusters of F at 45 degrees hold a speed of sqrt(4 F sqrt(1/2) / c)."""
    weak = flown("none", vehicle__thrust_limit_n=0.2)
    strong = flown("none")
    fastest = [
        max(abs(b.x_m - a.x_m) / (b.t_s - a.t_s) for a, b in pairwise(way))
        for way in (weak.trajectory, strong.trajectory)
    ]
    assert fastest[0] <= (4 * 0.2 * 0.5**0.5 / 33.732) ** 0.5 + 0.01 < 0.2 < fastest[1]


def test_a_larger_box_around_the_points_of_the_spiral_ends_the_search_sooner() -> None:
    boxes_m = (0.2, 0.8)
    steps = [flown("none", revision__spiral__acceptance_m=box_m).metrics.detection_time_s for box_m in boxes_m]
    assert steps[0] is None or steps[1] < steps[0]
