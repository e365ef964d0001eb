"""Whole missions: repeatable, common random numbers for every manager, and the facts of the
exemplar end to end.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.managed.follow import there_and_back
from suave_des.managing.bt import BehaviourTree
from suave_des.metrics.result import MissionResult, TrajectoryPoint
from suave_des.simulation.mission import Mission

NO_ERRORS = {"calibration": {"altitude_error_m": 0.0, "reasoning_slowdown": 0.0}}
MANAGERS = ("none", "random", "bt", "bt_extended")
SCENARIOS = pytest.mark.parametrize("scenario", ["seams2023", "release15"])
manager_names = st.sampled_from(MANAGERS)
scenario_names = st.sampled_from(["seams2023", "release15"])


def events(result: MissionResult, event: str, detail: str = "") -> list[float]:
    return [
        each.t_s for each in result.events if each.event == event and each.detail.startswith(detail)
    ]


# Repeatable


@settings(max_examples=15)
@given(scenario_names, manager_names, st.integers(1, 1000), st.integers(0, 2**32))
def test_the_same_mission_twice_is_identical(simulator, scenario, manager, run, seed):
    first = simulator(scenario).run(manager, run, seed, record=True)
    assert simulator(scenario).run(manager, run, seed, record=True) == first


def test_missions_of_one_simulator_do_not_disturb_one_another(simulator):
    one = simulator()
    alone = [one.run("metacontrol", run, 1, record=True) for run in (1, 2)]
    first = Mission(one, "metacontrol", run=1, seed=1, record=True)
    first.advance(150.0)
    meanwhile = one.run("metacontrol", 2, 1, record=True)
    assert [first.result(), meanwhile] == alone
    first.close()
    first.close()
    both = [Mission(one, "metacontrol", run=run, seed=1, record=True) for run in (1, 2)]
    both[0].advance(150.0)
    assert [each.result() for each in reversed(both)] == alone[::-1]


@settings(max_examples=15)
@given(scenario_names, manager_names, st.integers(1, 1000))
def test_recording_does_not_change_the_metrics(simulator, scenario, manager, run):
    recorded = simulator(scenario).run(manager, run, 5, record=True)
    assert simulator(scenario).run(manager, run, 5).metrics == recorded.metrics


@settings(max_examples=10)
@given(scenario_names, st.integers(1, 1000))
def test_every_manager_meets_the_same_sea(simulator, scenario, run):
    drawn = [simulator(scenario).run(manager, run, 5).drawn for manager in MANAGERS]
    assert all(other == drawn[0] for other in drawn)


NOISY = {
    "signals": {"water_visibility": {"noise": {"distribution": "normal", "mean": 0.0, "std": 0.1}}}
}


def test_every_manager_is_told_the_same_measurements(simulator):
    def measured(manager: str) -> list[tuple[float, float | None]]:
        trajectory = simulator(**NOISY).run(manager, 1, 1, record=True).trajectory
        return [(point.t_s, point.visibility_m) for point in trajectory][:1000]

    assert measured("none") == measured("bt")


@settings(max_examples=5)
@given(manager_names, st.integers(1, 1000))
def test_another_noise_source_changes_nothing_else(simulator, manager, run):
    noise = {"distribution": "uniform", "minimum": 0.0, "maximum": 1.0}
    salinity = {"signals": {"salinity": {"kind": "constant", "value": 35.0, "noise": noise}}}
    assert (
        simulator(**salinity).run(manager, run, 5).metrics
        == simulator().run(manager, run, 5).metrics
    )


# Metrics


IN_TURBID_WATER = {"signals": {"water_visibility": {"minimum": 0.1, "maximum": 0.2}}}


@SCENARIOS
def test_a_pipeline_not_found_is_searched_until_the_limit(simulator, scenario):
    metrics = simulator(scenario, **IN_TURBID_WATER).run("none", 1, 1).metrics
    assert (metrics.pipeline_found, metrics.search_time_s) == (False, 300.0)


@SCENARIOS
def test_a_pipeline_not_found_is_not_inspected(simulator, scenario):
    result = simulator(scenario, **IN_TURBID_WATER).run("none", 1, 1)
    assert result.metrics.distance_inspected_m == 0.0


@SCENARIOS
@pytest.mark.parametrize("manager", ["none", "bt"])
def test_distance_of_an_undisturbed_inspection_is_the_way_along_some_of_the_path(
    simulator, scenario, manager
):
    metrics = simulator(scenario, **NO_ERRORS).run(manager, 1, 1).metrics
    points = simulator(scenario).points
    first = int(np.argmin(np.abs(points[:, 0] - metrics.detection_x_m)))
    path = there_and_back(points)[first:, :2].tolist()
    ways_m = np.cumsum([math.dist(here, there) for here, there in pairwise(path)])
    assert np.min(np.abs(ways_m - metrics.distance_inspected_m)) < 1e-9


def test_none_neither_adapts_nor_reacts_nor_recovers_a_thruster(simulator):
    assert simulator().run("none", 1, 1).metrics.adaptations == 0
    results = [simulator("release15").run("none", run, 1).metrics for run in range(1, 6)]
    assert [metrics.mean_reaction_time_s for metrics in results] == [None] * 5
    result = simulator().run("none", 1, 1, record=True)
    assert events(result, "component_status", "c_thruster_1 RECOVERED") == []


# What the scenario says


def test_mode_latency_is_drawn_anew_each_time(simulator):
    latency = {"distribution": "uniform", "minimum": 0.2, "maximum": 2.0}
    result = simulator(latencies={"mode_change_s": latency}).run("bt", 1, 1, record=True)
    asked = events(result, "mode_requested", "f_generate_search_path -> fd_spiral")
    done = events(result, "mode_set", "f_generate_search_path = fd_spiral")
    delays = [there - here for here, there in zip(asked, done, strict=True)]
    assert len(set(delays)) == len(delays) > 1 and all(0.2 <= delay <= 2.0 for delay in delays)


def test_a_failure_too_early_to_take_effect_is_published_all_the_same(simulator):
    def way(effective_from_s: float):
        failures = {"effective_from_s": effective_from_s}
        changes = {**NO_ERRORS, "revision": {"thruster_failures": failures}}
        return simulator(**changes, mission={"time_limit_s": 80.0}).run("none", 1, 1, record=True)

    whole = simulator(**NO_ERRORS, thruster_events=[], mission={"time_limit_s": 80.0}).run(
        "none", 1, 1, record=True
    )
    without_effect, failed = way(100.0), way(0.0)
    assert events(without_effect, "component_status", "c_thruster_1 FALSE")
    assert events(without_effect, "failure_without_effect") and not events(
        failed, "failure_without_effect"
    )
    assert (
        without_effect.trajectory[-1].x_m == whole.trajectory[-1].x_m != failed.trajectory[-1].x_m
    )


def test_the_same_failures_are_lost_for_every_manager(simulator):
    changes = {"thruster_failures": {"effective_from_s": 0.0, "loss_probability": 0.5}}
    made = simulator(mission={"time_limit_s": 60.0}, revision=changes)

    def lost(manager: str) -> list[bool]:
        missions = (made.run(manager, run, 1, record=True) for run in range(1, 31))
        return [bool(events(each, "failure_without_effect")) for each in missions]

    of_none = lost("none")
    assert 5 < sum(of_none) < 25
    assert of_none == lost("bt")


def test_a_failure_takes_effect_from_the_very_time_on(simulator):
    def without_effect(effective_from_s: float) -> list:
        failures = {"effective_from_s": effective_from_s}
        made = simulator(mission={"time_limit_s": 80.0}, revision={"thruster_failures": failures})
        mission = made.run("none", 1, 1, record=True)
        return events(mission, "failure_without_effect")

    (failed_s,) = without_effect(100.0)
    assert without_effect(failed_s) == []
    assert without_effect(math.nextafter(failed_s, math.inf)) == [failed_s]


def test_an_event_or_else_the_revision_says_how_a_thruster_fails(simulator):
    def way(in_revision: str, **event: str) -> list[tuple[float, float]]:
        failing = [{"thruster": 1, "event": "failure", "time_s": 30.0, **event}]
        changes = {**NO_ERRORS, "revision": {"thruster_failures": {"failure_mode": in_revision}}}
        made = simulator(**changes, thruster_events=failing, mission={"time_limit_s": 80.0})
        return [(each.x_m, each.y_m) for each in made.run("none", 1, 1, record=True).trajectory]

    assert (
        way("frozen")
        == way("dead", failure_mode="frozen")
        != way("dead")
        == way("frozen", failure_mode="dead")
    )


def test_a_nodes_frame_error_shifts_where_the_vehicle_goes(simulator):
    def altitude(offset_m: float) -> float:
        changes = {**NO_ERRORS, "revision": {"set_points": {"node_frame_offset_z_m": offset_m}}}
        return (
            simulator(**changes, mission={"time_limit_s": 40.0})
            .run("none", 1, 1, record=True)
            .trajectory[-1]
            .z_m
        )

    assert altitude(0.3) - altitude(0.0) == pytest.approx(0.3, abs=0.02)


class ReasoningTree(BehaviourTree):
    """Does what bt does, with a reasoner beside it."""

    needs_knowledge = True


@pytest.mark.parametrize(
    ("inference_s", "share"), [(0.5, 0.25), (1.0, 0.5), (5.0, 1.0), ((0.5, 1.5), 0.5)]
)
def test_the_reasoner_slows_the_world_down_in_proportion_to_its_share_of_the_time(
    simulator, inference_s, share
):
    if isinstance(inference_s, tuple):
        inference_s = {
            "distribution": "uniform",
            "minimum": inference_s[0],
            "maximum": inference_s[1],
        }

    def flown(kind: type[BehaviourTree], **calibration: float) -> list[TrajectoryPoint]:
        latencies = {"inference_s": inference_s}  # in metacontrol's period of 2 s
        made = simulator(calibration={"altitude_error_m": 0.0, **calibration}, latencies=latencies)
        return Mission(made, kind, record=True).result().trajectory

    slower = flown(ReasoningTree, reasoning_slowdown=0.4)
    assert slower == flown(BehaviourTree, real_time_factor_loss=0.4 * share)
    assert (
        flown(BehaviourTree, reasoning_slowdown=0.4)
        == flown(BehaviourTree, reasoning_slowdown=0.0)
        != slower
    )


@pytest.mark.parametrize("scenario", ["release15", "seams2023"])
def test_whether_a_recovery_outlasts_the_search_is_the_revisions(simulator, scenario):
    def mission(failure_s: float) -> MissionResult:
        faults = [{"thruster": 1, "event": "failure", "time_s": failure_s}]
        return simulator(scenario, **NO_ERRORS, thruster_events=faults).run("bt", 1, 1, record=True)

    detected_s = mission(299.0).metrics.detection_time_s
    result = mission(detected_s - 6.0)
    failed_s = events(result, "component_status", "c_thruster_1 FALSE")[0]
    recovered_s = events(result, "component_status", "c_thruster_1 RECOVERED")[0]
    if scenario == "seams2023":
        assert recovered_s == pytest.approx(failed_s + 10.5, abs=0.11)
    else:
        assert recovered_s > events(result, "task_requested", "inspect_pipeline")[0] + 10.0
