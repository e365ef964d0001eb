"""The managers none and random, and those to compare others with: fixed modes, thresholds, perfect
knowledge.
"""

from collections import Counter

import pytest

from suave_des import run_mission
from suave_des.registry import is_built_in
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import support
from suave_des.simulation.simulator import Simulator
from tests.helpers.managers_at_work import FOLLOW, MODES, SEARCH, AtWork

BOTH = pytest.mark.parametrize("revision", ["2023", "1.5"])


@BOTH
@pytest.mark.parametrize(
    ("task", "asked"),
    [
        ("search_pipeline", (SEARCH, "fd_spiral_low")),
        ("inspect_pipeline", (FOLLOW, "fd_follow_pipeline")),
    ],
)
def test_none_sets_the_default_mode_at_a_tasks_request(revision, task, asked):
    at_work = AtWork("none", revision)
    assert at_work.request(task) == [asked] and at_work.manager.period_s is None


@BOTH
@pytest.mark.parametrize("name", ["none", "random"])
def test_a_cancelled_tasks_functions_are_set_to_fd_unground(name, revision):
    at_work = AtWork(name, revision)
    at_work.request("search_pipeline")
    functions = at_work.task("search_pipeline").functions
    assert at_work.cancel("search_pipeline") == [
        (function, "fd_unground") for function in functions
    ]


@pytest.mark.parametrize(("revision", "period_s"), [("2023", 15.0), ("1.5", 30.0)])
def test_random_picks_every_period_with_another_phase_in_each_run(revision, period_s):
    managers = [AtWork("random", revision, seed=seed).manager for seed in range(300)]
    starts = [each.starts_s for each in managers]
    assert {each.period_s for each in managers} == {period_s}
    assert min(starts) < period_s / 15 and period_s * 14 / 15 < max(starts) < period_s


@pytest.mark.parametrize(("revision", "picks"), [("2023", 0), ("1.5", 1)])
def test_whether_random_picks_at_a_tasks_request(revision, picks):
    assert len(AtWork("random", revision).request("search_pipeline")) == picks


@BOTH
@pytest.mark.parametrize(
    ("task", "function"), [("search_pipeline", SEARCH), ("inspect_pipeline", FOLLOW)]
)
def test_random_picks_among_all_modes_with_equal_chance(revision, task, function):
    at_work = AtWork("random", revision)
    at_work.request(task)
    picks = Counter(pick for _ in range(6000) for pick in at_work.adapt())
    share = 6000 / len(MODES.modes(function))
    assert picks == {
        (function, mode): pytest.approx(share, rel=0.1) for mode in MODES.modes(function)
    }


@BOTH
def test_random_leaves_maintain_motion_alone(revision):
    at_work = AtWork("random", revision)
    at_work.request("search_pipeline")
    assert {function for _ in range(100) for function, _ in at_work.adapt()} == {SEARCH}


@BOTH
def test_random_does_nothing_between_tasks(revision):
    at_work = AtWork("random", revision)
    at_work.request("search_pipeline")
    at_work.cancel("search_pipeline")
    assert at_work.adapt() == []


def test_random_draws_from_the_runs_stream():
    def picks(seed: int) -> list[tuple[str, str]]:
        at_work = AtWork("random", "2023", seed=seed)
        at_work.request("search_pipeline")
        return [pick for _ in range(30) for pick in at_work.adapt()]

    assert picks(1) == picks(1) != picks(2)


@pytest.mark.parametrize(("revision", "asked"), [("2023", [(SEARCH, "fd_unground")]), ("1.5", [])])
def test_randoms_search_ends_at_the_detection_in_2023(revision, asked):
    at_work = AtWork("random", revision)
    at_work.request("search_pipeline")
    assert at_work.detected() == asked
    assert {function for function, _ in at_work.adapt()} == (
        {SEARCH} if revision == "1.5" else set()
    )
    assert AtWork("random", revision).detected() == []  # while it has no search


def test_in_a_mission_of_2023_randoms_search_is_ungrounded_before_the_coordinators_poll():
    simulator = Simulator(load_scenario("seams2023"))
    events = next(
        result.events
        for run in range(1, 20)
        if (result := simulator.run("random", run, seed=1, record=True)).metrics.pipeline_found
    )
    detected_s = next(each.t_s for each in events if each.event == "pipeline_detected")
    done_s = next(each.t_s for each in events if each.event == "task_done")
    requests = [
        each for each in events if each.event == "mode_requested" and each.t_s >= detected_s
    ]
    assert (requests[0].t_s, requests[0].detail) == (detected_s, f"{SEARCH} -> fd_unground")
    assert detected_s < done_s <= detected_s + 1.0


def requests(manager: str, scenario: str = "seams2023", run: int = 1) -> list[tuple[float, str]]:
    events = run_mission(scenario, manager, run, 1).events
    return [(each.t_s, each.detail) for each in events if each.event == "mode_requested"]


@pytest.fixture(scope="module")
def with_a_fixed_mode() -> list[tuple[float, str]]:
    return requests("fixed:fd_spiral_medium")


def test_fixed_sets_its_mode_at_the_start(with_a_fixed_mode):
    assert with_a_fixed_mode[0] == (0.0, "f_generate_search_path -> fd_spiral_medium")


def test_fixed_never_adapts(with_a_fixed_mode):
    later = [detail for _, detail in with_a_fixed_mode if "unground" not in detail][1:]
    assert later == ["f_follow_pipeline -> fd_follow_pipeline"]


def test_they_need_no_trust_as_they_are_the_projects_own():
    assert all(
        map(is_built_in, ("fixed:fd_spiral_low", "threshold", "oracle"))
    ) and not is_built_in("mine:Manager")


@pytest.mark.parametrize("scenario", ["seams2023", "release15", "planta_exp1"])
def test_threshold_adapts_at_metacontrols_times(scenario):
    threshold_s, metacontrol_s = (
        next(
            t_s
            for t_s, detail in requests(manager, scenario)
            if detail.startswith(f"{SEARCH} -> fd_spiral")
        )
        for manager in ("threshold", "metacontrol")
    )
    shortest_s, longest_s = support(load_scenario(scenario).scenario.latencies.inference_s)
    assert shortest_s - 1e-9 <= metacontrol_s - threshold_s <= longest_s + 1e-9


@pytest.mark.parametrize(
    ("visibility_m", "mode"), [(3.25, "fd_spiral_high"), (3.2499, "fd_spiral_medium")]
)
def test_a_threshold_itself_is_enough(visibility_m, mode):
    at_work = AtWork("threshold")
    at_work.request("search_pipeline")
    at_work.measured("water_visibility", visibility_m)
    assert (SEARCH, mode) in at_work.adapt()


def test_oracle_changes_modes_at_the_moment_of_the_true_crossing():
    events = run_mission("seams2023", "oracle", 1, 1).events
    high_s = [
        each.t_s for each in events if each.detail == "f_generate_search_path = fd_spiral_high"
    ]
    crossed_s = [
        each.t_s
        for each in events
        if each.event == "visibility_crossing" and "rises to 3.25" in each.detail
    ]
    assert high_s[0] == 0.0 and crossed_s[0] - 2.0 < high_s[1] <= crossed_s[0]


def test_oracle_sees_that_a_threshold_itself_is_reached():
    step = {"kind": "step", "time_s": 20.0, "before": 3.0, "after": 3.25}
    events = run_mission(
        "seams2023", "oracle", 1, 1, values={"signals.water_visibility": step}
    ).events
    (high_s,) = [
        each.t_s for each in events if each.detail == "f_generate_search_path = fd_spiral_high"
    ]
    assert high_s == pytest.approx(20.0)


@pytest.mark.parametrize("step_s", [39.8, 40.4])
def test_oracle_watches_until_the_mission_ends(step_s):
    """Its time limit is looked at twice a second: in this run at 40.44 s."""
    values = {
        "mission.time_limit_s": 40.0,
        "start.y_m": 300.0,  # where no pipeline is
        "signals.water_visibility": {"kind": "step", "time_s": step_s, "before": 3, "after": 1},
    }
    events = run_mission("seams2023", "oracle", 3, 1, values=values).events
    assert next(each.t_s for each in events if each.event == "mission_ended") > 40.43
    (low_s,) = [each.t_s for each in events if each.detail == f"{SEARCH} = fd_spiral_low"]
    assert low_s == pytest.approx(step_s)


def test_oracle_takes_no_time_to_recover_a_thruster():
    events = run_mission("seams2023", "oracle", 1, 1).events
    failed_s = next(each.t_s for each in events if each.event == "component_status")
    recovering_s = next(
        each.t_s for each in events if each.detail == "f_maintain_motion = fd_recover_thrusters"
    )
    assert recovering_s == failed_s
