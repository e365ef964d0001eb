"""The managers none and random."""

from collections import Counter

import pytest

from suave_des.scenario.loader import load_scenario
from suave_des.simulation.simulator import Simulator
from tests.helpers.managers_at_work import FOLLOW, MODES, MOTION, SEARCH, AtWork

BOTH = pytest.mark.parametrize("revision", ["2023", "1.5"])


@BOTH
@pytest.mark.parametrize(
    ("task", "asked"),
    [("search_pipeline", (SEARCH, "fd_spiral_low")), ("inspect_pipeline", (FOLLOW, "fd_follow_pipeline"))],
)
def test_none_sets_the_default_mode_at_a_tasks_request(revision: str, task: str, asked: tuple[str, str]) -> None:
    at_work = AtWork("none", revision)
    assert at_work.request(task) == [asked] and at_work.manager.period_s is None


@BOTH
@pytest.mark.parametrize("name", ["none", "random"])
def test_a_cancelled_tasks_functions_are_set_to_fd_unground(name: str, revision: str) -> None:
    at_work = AtWork(name, revision)
    at_work.request("search_pipeline")
    functions = at_work.task("search_pipeline").functions
    assert at_work.cancel("search_pipeline") == [(function, "fd_unground") for function in functions]


@pytest.mark.parametrize(("revision", "period_s"), [("2023", 15.0), ("1.5", 30.0)])
def test_random_picks_every_period_with_another_phase_in_each_run(revision: str, period_s: float) -> None:
    managers = [AtWork("random", revision, seed=seed).manager for seed in range(300)]
    starts = [each.starts_s for each in managers]
    assert {each.period_s for each in managers} == {period_s}
    assert min(starts) < period_s / 15 and period_s * 14 / 15 < max(starts) < period_s


@pytest.mark.parametrize(("revision", "picks"), [("2023", 0), ("1.5", 1)])
def test_whether_random_picks_at_a_tasks_request(revision: str, picks: int) -> None:
    assert len(AtWork("random", revision).request("search_pipeline")) == picks


@BOTH
@pytest.mark.parametrize(("task", "function"), [("search_pipeline", SEARCH), ("inspect_pipeline", FOLLOW)])
def test_random_picks_among_all_modes_with_equal_chance(revision: str, task: str, function: str) -> None:
    at_work = AtWork("random", revision)
    at_work.request(task)
    picks = Counter(pick for _ in range(6000) for pick in at_work.adapt())
    share = 6000 / len(MODES.modes(function))
    assert picks == {(function, mode): pytest.approx(share, rel=0.1) for mode in MODES.modes(function)}


@BOTH
def test_random_leaves_maintain_motion_alone(revision: str) -> None:
    at_work = AtWork("random", revision)
    at_work.request("search_pipeline")
    assert all(function != MOTION for _ in range(100) for function, _ in at_work.adapt())


@BOTH
def test_random_does_nothing_between_tasks(revision: str) -> None:
    at_work = AtWork("random", revision)
    at_work.request("search_pipeline")
    at_work.cancel("search_pipeline")
    assert at_work.adapt() == []


def test_random_draws_from_the_runs_stream() -> None:
    def picks(seed: int) -> list[tuple[str, str]]:
        at_work = AtWork("random", "2023", seed=seed)
        at_work.request("search_pipeline")
        return [pick for _ in range(30) for pick in at_work.adapt()]

    assert picks(1) == picks(1) != picks(2)


@pytest.mark.parametrize(("revision", "asked"), [("2023", [(SEARCH, "fd_unground")]), ("1.5", [])])
def test_randoms_search_ends_at_the_detection_in_2023(revision: str, asked: list[tuple[str, str]]) -> None:
    at_work = AtWork("random", revision)
    at_work.request("search_pipeline")
    assert at_work.detected() == asked
    assert {function for function, _ in at_work.adapt()} == ({SEARCH} if revision == "1.5" else set())
    assert AtWork("random", revision).detected() == []  # while it has no search


def test_in_a_mission_of_2023_randoms_search_is_ungrounded_before_the_coordinators_poll() -> None:
    simulator = Simulator(load_scenario("seams2023"))
    events = next(
        result.events
        for run in range(1, 20)
        if (result := simulator.run("random", run, seed=1, record=True)).metrics.pipeline_found
    )
    detected_s = next(each.t_s for each in events if each.event == "pipeline_detected")
    done_s = next(each.t_s for each in events if each.event == "task_done")
    requests = [each for each in events if each.event == "mode_requested" and each.t_s >= detected_s]
    assert (requests[0].t_s, requests[0].detail) == (detected_s, f"{SEARCH} -> fd_unground")
    assert detected_s < done_s <= detected_s + 1.0
