"""Leaks, currents, sensors, thrusters lost for good; and constants of the exemplar that users may
vary.
"""

import math
from functools import cache
from itertools import pairwise

import pytest

from suave_des.domain import SEA_BED_Z_M
from suave_des.errors import InputError
from suave_des.metrics.result import MissionResult
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator

LEAK = "base: extended.yaml\nleak: {time_s: 170}\nmetrics: [surfacing_time_s]\n"


@pytest.fixture
def fly(tmp_path):
    def run(text: str, manager: str = "none", *, record: bool = True) -> MissionResult:
        (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
        return Simulator(load_scenario(tmp_path / "mine.yaml")).run(
            manager, run=3, seed=1, record=record
        )

    return run


def details(result: MissionResult, event: str) -> list[str]:
    return [each.detail for each in result.events if each.event == event]


EVERY_MANAGER = pytest.mark.parametrize(
    "manager",
    ["none", "fixed:fd_spiral_high", "threshold", "oracle", "metacontrol", "bt", "bt_extended"],
)


@pytest.fixture(scope="module")
def leaking():
    """Flies a mission with a leak once for each manager."""
    loaded = load_scenario("extended")
    values = {"leak": {"time_s": 170.0}, "metrics": ["surfacing_time_s"]}
    simulator = Simulator(with_values(loaded, values))
    return cache(lambda manager: simulator.run(manager, run=3, seed=1, record=True))


@EVERY_MANAGER
def test_a_leak_is_published(leaking, manager):
    assert "hull LEAK" in details(leaking(manager), "component_status")


@EVERY_MANAGER
def test_a_leak_makes_every_manager_surface(leaking, manager):
    result = leaking(manager)
    assert details(result, "task_requested")[-1] == "surface"
    assert result.trajectory[-1].z_m == pytest.approx(0.0, abs=0.11)


@EVERY_MANAGER
def test_the_mission_ends_when_the_vehicle_has_surfaced(leaking, manager):
    assert details(leaking(manager), "mission_ended") == ["the vehicle has surfaced"]


@EVERY_MANAGER
def test_surfacing_takes_the_time_from_the_leak_to_the_end(leaking, manager):
    result = leaking(manager)
    assert result.further["surfacing_time_s"] == pytest.approx(
        result.metrics.mission_duration_s - 170.0, abs=0.2
    )


def test_a_current_that_varies_moves_a_vehicle_without_thrust_as_the_water_moves(fly):
    """With all thrusters lost, the vehicle drifts on: over a whole period the mean current, within
    it up and down.
    """
    lost = ", ".join(f'"({thruster},failure,0)"' for thruster in range(1, 7))
    wave = "{mean_m_per_s: 0.05, amplitude_m_per_s: 0.2, period_s: 100, direction_rad: 0.0}"
    result = fly(
        "base: release15.yaml\nrevision: {thruster_failures: {failure_mode: dead, effective_from_s: 0.0}}\n"
        "mission: {time_limit_s: 215}\n"
        f"thruster_events: [{lost}]\ncurrent: {{wave: {wave}}}\n"
    )
    x_m = {round(point.t_s): point.x_m for point in result.trajectory}
    assert x_m[210] - x_m[110] == pytest.approx(0.05 * 100, abs=0.5)
    # the integral over the half in which the sine is positive
    half = 0.05 * 50 + 0.2 * 100 / math.pi
    assert x_m[150] - x_m[100] == pytest.approx(half, rel=0.15)


RECOVERING = pytest.mark.parametrize("manager", ["metacontrol", "bt"])


@pytest.fixture(scope="module")
def with_one_lost():
    """Flies a mission whose thruster 1 is lost for good from 35.5 s on, once for each manager."""
    lost = {"thruster": 1, "event": "failure", "time_s": 35.0, "recoverable": False}
    values = {"thruster_events": [lost], "metrics": ["operational_thrusters"]}
    simulator = Simulator(with_values(load_scenario("release15"), values))
    return cache(lambda manager: simulator.run(manager, run=3, seed=1, record=True))


@RECOVERING
def test_all_thrusters_but_one_that_is_lost_for_good_are_reported_as_recovered(
    with_one_lost, manager
):
    reports = details(with_one_lost(manager), "component_status")
    recovered = {report for report in reports if report.endswith("RECOVERED")}
    assert recovered == {f"c_thruster_{number} RECOVERED" for number in range(2, 7)}


@RECOVERING
def test_a_thruster_that_cannot_be_recovered_stays_lost(with_one_lost, manager):
    result = with_one_lost(manager)
    duration_s = result.metrics.mission_duration_s
    assert result.further["operational_thrusters"] == pytest.approx(
        6 - (duration_s - 35.5) / duration_s, abs=0.01
    )


def test_whether_a_thruster_can_be_recovered_is_up_to_its_last_failure(fly):
    events = (
        "[{thruster: 1, event: failure, time_s: 35, recoverable: false}, {thruster: 1, event: recovery, time_s: 60},"
        " {thruster: 1, event: failure, time_s: 100}]"
    )
    reports = details(
        fly(f"base: release15.yaml\nthruster_events: {events}\n", "bt"), "component_status"
    )
    assert reports.count("c_thruster_1 FALSE") == 2
    assert reports.count("c_thruster_1 RECOVERED") == 2  # by the scenario, and by maintain_motion


def test_in_an_outage_the_last_measurement_stays(fly):
    signal = "{outages_s: [[50, 120]]}"
    points = fly(f"base: release15.yaml\nsignals: {{water_visibility: {signal}}}\n").trajectory
    assert len({point.visibility_m for point in points if 51.0 < point.t_s < 119.0}) == 1


def test_messages_are_lost_with_the_given_probability(fly):
    steps = {}
    for share in (0.0, 0.5, 1.0):
        signal = f"{{dropout_probability: {share}}}"
        points = fly(f"base: release15.yaml\nsignals: {{water_visibility: {signal}}}\n").trajectory
        steps[share] = len({point.visibility_m for point in points} - {None})
    assert steps[1.0] == 0
    assert 0.35 < steps[0.5] / steps[0.0] < 0.75  # equal values come more than once


def test_a_failed_thruster_whose_report_is_lost_is_not_recovered(fly):
    result = fly("base: release15.yaml\nthruster_monitor: {outages_s: [[0, 60]]}\n", "metacontrol")
    assert details(result, "component_status") == []


def test_losing_messages_leaves_campaigns_the_same_for_every_reader(fly):
    """Whether a mission is recorded, with each message published, or not: the same messages are
    lost.
    """
    text = (
        "base: extended.yaml\nname: mine\nsignals: {water_visibility: {dropout_probability: 0.3}}\n"
        "battery: {dropout_probability: 0.3}\n"
    )
    assert fly(text, "metacontrol", record=False).metrics == fly(text, "metacontrol").metrics


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("leak: {time_s: 100}", "no function 'f_surface'"),
        ("leak: {time_s: -1}", "-1 is out of range"),
        ("metrics: [surfacing_time_s]", "surfacing_time_s needs a leak"),
        ("current: {wave: {period_s: 0}}", "0 should be"),
        ("current: {wave: {amplitude_m_per_s: 50}}", "50 is out of range"),
        ("signals: {water_visibility: {dropout_probability: 2}}", "2 should be"),
        (
            "signals: {water_visibility: {outages_s: [[20, 10]]}}",
            "the outage [20, 10] ends before it begins",
        ),
        ("signals: {water_visibility: {outages_s: [20, 10]}}", "20 should be a list"),
        ("thruster_monitor: {dropout: 1}", "unknown key"),
        (
            "thruster_events: [{thruster: 1, event: failure, time_s: 1, recoverable: 3}]",
            "3 should be a boolean",
        ),
    ],
)
def test_what_cannot_be_is_refused(fly, line, problem):
    with pytest.raises(InputError) as caught:
        fly(f"base: seams2023.yaml\n{line}\n")
    assert problem in caught.value.problem


def flown(manager: str, **values: object) -> MissionResult:
    """One mission of seams2023 with other values, by key path with __ for a dot."""
    still = {
        "calibration.altitude_error_m": 0.0,
        **{path.replace("__", "."): each for path, each in values.items()},
    }
    return Simulator(with_values(load_scenario("seams2023"), still)).run(
        manager, run=1, seed=1, record=True
    )


@pytest.mark.parametrize("delay_s", [3.0, 20.0])
def test_a_recovery_takes_as_long_as_the_revision_says(delay_s):
    events = flown("metacontrol", revision__recovery__delay_s=delay_s).events
    began_s = next(
        event.t_s for event in events if event.detail == "f_maintain_motion = fd_recover_thrusters"
    )
    first_s = next(event.t_s for event in events if event.detail == "c_thruster_1 RECOVERED")
    assert first_s - began_s == pytest.approx(delay_s)


@pytest.mark.parametrize("altitude_m", [0.75, 2.5])
def test_the_pipeline_is_followed_at_the_revisions_altitude(altitude_m):
    last = flown("none", revision__follow__altitude_m=altitude_m).trajectory[-1]
    assert last.mode == "fd_follow_pipeline"
    assert last.z_m - SEA_BED_Z_M == pytest.approx(altitude_m, abs=0.1)


def test_weak_thrusters_limit_the_speed():
    """Full ahead, four horizontal thrusters of F at 45 degrees hold a speed of sqrt(4 F sqrt(1/2) /
    c).
    """
    weak = flown("none", vehicle__thrust_limit_n=0.2)
    strong = flown("none")
    fastest = [
        max(abs(b.x_m - a.x_m) / (b.t_s - a.t_s) for a, b in pairwise(way))
        for way in (weak.trajectory, strong.trajectory)
    ]
    assert fastest[0] <= (4 * 0.2 * 0.5**0.5 / 33.732) ** 0.5 + 0.01 < 0.2 < fastest[1]
