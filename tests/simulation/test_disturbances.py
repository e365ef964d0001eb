"""What goes wrong besides murky water and thrusters that recover: leaks, currents, sensors, thrusters lost for good."""

import math

import pytest

from suave_des.errors import InputError
from suave_des.metrics.result import MissionResult
from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator

LEAK = "base: extended.yaml\nleak: {time_s: 170}\nmetrics: [surfacing_time_s]\n"


@pytest.fixture
def fly(tmp_path):
    def run(text: str, manager: str = "none", *, record: bool = True) -> MissionResult:
        (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
        return Simulator(load_scenario(tmp_path / "mine.yaml")).run(manager, run=3, seed=1, record=record)

    return run


def details(result: MissionResult, event: str) -> list[str]:
    return [each.detail for each in result.events if each.event == event]


@pytest.mark.parametrize("manager", ["none", "metacontrol", "bt", "bt_extended"])
def test_a_leak_makes_every_manager_surface_and_ends_the_mission_there(fly, manager: str) -> None:
    result = fly(LEAK, manager)
    assert "hull LEAK" in details(result, "component_status")
    assert details(result, "task_requested")[-1] == "surface"
    assert details(result, "mission_ended") == ["the vehicle has surfaced"]
    assert result.trajectory[-1].z_m == pytest.approx(0.0, abs=0.11)
    assert 170.0 + result.further["surfacing_time_s"] == pytest.approx(result.metrics.mission_duration_s, abs=0.2)


def test_at_a_leak_the_task_is_given_up_at_once_and_so_is_the_way_to_the_station(fly) -> None:
    result = fly(LEAK, "metacontrol")
    given_up = [each for each in result.events if each.event == "task_cancelled"]
    assert given_up[0].t_s == 170.0
    after = {point.mode for point in result.trajectory if point.t_s > 175.0}
    assert after == {"fd_surface"}


def test_a_leak_after_the_missions_end_does_nothing(fly) -> None:
    result = fly(LEAK.replace("170", "500"))
    assert result.further["surfacing_time_s"] is None
    assert details(result, "mission_ended") == ["time limit"]


def test_a_current_that_varies_moves_a_vehicle_without_thrust_as_the_water_moves(fly) -> None:
    """With all thrusters lost, the vehicle drifts on: over a whole period the mean current, within it up and down."""
    lost = ", ".join(f'"({thruster},failure,0)"' for thruster in range(1, 7))
    wave = "{mean_m_per_s: 0.05, amplitude_m_per_s: 0.2, period_s: 100, direction_rad: 0.0}"
    result = fly(
        "base: release15.yaml\nrevision: {thruster_failures: {failure_mode: dead, effective_from_s: 0.0}}\n"
        "mission: {time_limit_s: 215}\n"
        f"thruster_events: [{lost}]\ncurrent: {{wave: {wave}}}\n"
    )
    x_m = {round(point.t_s): point.x_m for point in result.trajectory}
    assert x_m[210] - x_m[110] == pytest.approx(0.05 * 100, abs=0.5)
    half = 0.05 * 50 + 0.2 * 100 / math.pi  # the integral over the half in which the sine is positive
    assert x_m[150] - x_m[100] == pytest.approx(half, rel=0.15)


def test_a_wave_without_amplitude_is_a_constant_current(fly) -> None:
    constant = fly("base: seams2023.yaml\nname: mine\ncurrent: {y_m_per_s: 0.1}\n")
    still = "{mean_m_per_s: 0.1, direction_rad: 1.5707963267948966}"
    wave = fly(f"base: seams2023.yaml\nname: mine\ncurrent: {{wave: {still}}}\n")
    assert wave.trajectory[-1].y_m == pytest.approx(constant.trajectory[-1].y_m, abs=0.05)
    assert wave.metrics.search_time_s == constant.metrics.search_time_s


@pytest.mark.parametrize(("manager", "mode"), [("metacontrol", "fd_recover_thrusters"), ("bt", "fd_recover_thrusters")])
def test_a_thruster_that_cannot_be_recovered_stays_lost_and_is_not_reported(fly, manager: str, mode: str) -> None:
    event = "{thruster: 1, event: failure, time_s: 35, recoverable: false}"
    result = fly(f"base: release15.yaml\nthruster_events: [{event}]\nmetrics: [operational_thrusters]\n", manager)
    reports = details(result, "component_status")
    assert f"f_maintain_motion = {mode}" in details(result, "mode_set")
    assert "c_thruster_2 RECOVERED" in reports
    assert "c_thruster_1 RECOVERED" not in reports
    duration_s = result.metrics.mission_duration_s
    assert result.further["operational_thrusters"] == pytest.approx(6 - (duration_s - 35.5) / duration_s, abs=0.01)


def test_a_thruster_can_fail_for_good_after_it_was_recovered_once(fly) -> None:
    events = (
        "[{thruster: 1, event: failure, time_s: 35}, {thruster: 1, event: failure, time_s: 100, recoverable: false}]"
    )
    reports = details(fly(f"base: release15.yaml\nthruster_events: {events}\n", "metacontrol"), "component_status")
    assert reports.count("c_thruster_1 FALSE") == 2
    assert reports.count("c_thruster_1 RECOVERED") == 1


def test_whether_a_thruster_can_be_recovered_is_up_to_its_last_failure(fly) -> None:
    events = (
        "[{thruster: 1, event: failure, time_s: 35, recoverable: false}, {thruster: 1, event: recovery, time_s: 60},"
        " {thruster: 1, event: failure, time_s: 100}]"
    )
    reports = details(fly(f"base: release15.yaml\nthruster_events: {events}\n", "bt"), "component_status")
    assert reports.count("c_thruster_1 FALSE") == 2
    assert reports.count("c_thruster_1 RECOVERED") == 2  # by the scenario, and by maintain_motion


def test_in_an_outage_the_last_measurement_stays(fly) -> None:
    signal = "{outages_s: [[50, 120]]}"
    points = fly(f"base: release15.yaml\nsignals: {{water_visibility: {signal}}}\n").trajectory
    during = {point.visibility_m for point in points if 51.0 < point.t_s < 119.0}
    assert len(during) == 1


def test_messages_are_lost_with_the_given_probability(fly) -> None:
    steps = {}
    for share in (0.0, 0.5, 1.0):
        signal = f"{{dropout_probability: {share}}}"
        points = fly(f"base: release15.yaml\nsignals: {{water_visibility: {signal}}}\n").trajectory
        steps[share] = len({point.visibility_m for point in points} - {None})
    assert steps[1.0] == 0
    assert 0.35 < steps[0.5] / steps[0.0] < 0.75  # equal values come more than once


def test_a_failed_thruster_whose_report_is_lost_is_not_recovered(fly) -> None:
    result = fly("base: release15.yaml\nthruster_monitor: {outages_s: [[0, 60]]}\n", "metacontrol")
    assert details(result, "component_status") == []


@pytest.mark.parametrize("manager", ["metacontrol", "bt_extended"])
def test_battery_noise_is_measured_and_does_not_discharge_the_battery(fly, manager: str) -> None:
    noise = "{noise: {distribution: uniform, minimum: -0.3, maximum: 0.0}}"
    result = fly(f"base: extended.yaml\nbattery: {noise}\n", manager)
    set_off_s = next(
        each.t_s
        for each in result.events
        if each.event == "mode_set" and each.detail.endswith(("generate_recharge_path = fd_recharge", "path = normal"))
    )
    assert 85.0 < set_off_s < 140.0  # a level of 0.25 is measured from 90 s on


def test_losing_messages_leaves_campaigns_the_same_for_every_reader(fly) -> None:
    """Whether a mission is recorded, with each message published, or not: the same messages are lost."""
    text = (
        "base: extended.yaml\nname: mine\nsignals: {water_visibility: {dropout_probability: 0.3}}\n"
        "battery: {dropout_probability: 0.3}\n"
    )
    recorded = fly(text, "metacontrol")
    assert fly(text, "metacontrol", record=False).metrics == recorded.metrics


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("leak: {time_s: 100}", "no function 'f_surface'"),
        ("leak: {time_s: -1}", "-1 is out of range"),
        ("metrics: [surfacing_time_s]", "surfacing_time_s needs a leak"),
        ("current: {wave: {period_s: 0}}", "0 should be"),
        ("current: {wave: {amplitude_m_per_s: 50}}", "50 is out of range"),
        ("signals: {water_visibility: {dropout_probability: 2}}", "2 should be"),
        ("signals: {water_visibility: {outages_s: [[20, 10]]}}", "the outage [20, 10] ends before it begins"),
        ("signals: {water_visibility: {outages_s: [20, 10]}}", "20 should be a list"),
        ("thruster_monitor: {dropout: 1}", "unknown key"),
        ("thruster_events: [{thruster: 1, event: failure, time_s: 1, recoverable: 3}]", "3 should be a boolean"),
    ],
)
def test_what_cannot_be_is_refused(fly, line: str, problem: str) -> None:
    with pytest.raises(InputError) as caught:
        fly(f"base: seams2023.yaml\n{line}\n")
    assert problem in caught.value.problem
