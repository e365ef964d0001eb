"""Managers to compare others with: fixed modes, thresholds, and perfect knowledge."""

import pytest

from suave_des import InputError, load_scenario, run_campaign, run_mission
from suave_des.registry import is_built_in, manager_class
from suave_des.scenario.quantities import support
from tests.helpers.managers_at_work import AtWork

SEARCH = "f_generate_search_path"


def requests(manager: str, scenario: str = "seams2023", run: int = 1) -> list[tuple[float, str]]:
    events = run_mission(scenario, manager, run, 1).events
    return [(each.t_s, each.detail) for each in events if each.event == "mode_requested"]


def test_fixed_sets_its_mode_and_never_adapts() -> None:
    found = requests("fixed:fd_spiral_medium")
    assert found[0] == (0.0, "f_generate_search_path -> fd_spiral_medium")
    assert [detail for _, detail in found if "unground" not in detail][1:] == [
        "f_follow_pipeline -> fd_follow_pipeline"
    ]


def test_fixed_low_is_none() -> None:
    fixed, none = (run_mission("seams2023", name, 2, 1).metrics for name in ("fixed:fd_spiral_low", "none"))
    assert fixed.search_time_s == none.search_time_s and fixed.distance_inspected_m == none.distance_inspected_m


def test_a_mode_that_no_function_has_is_refused_before_any_mission() -> None:
    with pytest.raises(InputError, match="did you mean 'fd_spiral_high'"):
        run_campaign("seams2023", ["fixed:fd_spiral_hihg"], runs=1)


def test_fixed_without_a_mode_is_refused() -> None:
    with pytest.raises(InputError, match="write fixed:MODE"):
        manager_class("fixed:")


def test_they_need_no_trust_as_they_are_the_projects_own() -> None:
    assert all(map(is_built_in, ("fixed:fd_spiral_low", "threshold", "oracle"))) and not is_built_in("mine:Manager")


@pytest.mark.parametrize("scenario", ["seams2023", "release15", "planta_exp1"])
def test_threshold_adapts_at_metacontrols_times(scenario: str) -> None:
    threshold_s, metacontrol_s = (
        next(t_s for t_s, detail in requests(manager, scenario) if detail.startswith(f"{SEARCH} -> fd_spiral"))
        for manager in ("threshold", "metacontrol")
    )
    shortest_s, longest_s = support(load_scenario(scenario).scenario.latencies.inference_s)
    assert shortest_s - 1e-9 <= metacontrol_s - threshold_s <= longest_s + 1e-9


@pytest.mark.parametrize(("visibility_m", "mode"), [(3.25, "fd_spiral_high"), (3.2499, "fd_spiral_medium")])
def test_a_threshold_itself_is_enough(visibility_m: float, mode: str) -> None:
    at_work = AtWork("threshold")
    at_work.request("search_pipeline")
    at_work.measured("water_visibility", visibility_m)
    assert (SEARCH, mode) in at_work.adapt()


def test_oracle_changes_modes_at_the_moment_of_the_true_crossing() -> None:
    events = run_mission("seams2023", "oracle", 1, 1).events
    high_s = [each.t_s for each in events if each.detail == "f_generate_search_path = fd_spiral_high"]
    crossed_s = [each.t_s for each in events if each.event == "visibility_crossing" and "rises to 3.25" in each.detail]
    assert high_s[0] == 0.0 and crossed_s[0] - 2.0 < high_s[1] <= crossed_s[0]


def test_oracle_sees_that_a_threshold_itself_is_reached() -> None:
    step = {"kind": "step", "time_s": 20.0, "before": 3.0, "after": 3.25}
    events = run_mission("seams2023", "oracle", 1, 1, values={"signals.water_visibility": step}).events
    (high_s,) = [each.t_s for each in events if each.detail == "f_generate_search_path = fd_spiral_high"]
    assert high_s == pytest.approx(20.0)


def test_oracle_takes_no_time_to_recover_a_thruster() -> None:
    events = run_mission("seams2023", "oracle", 1, 1).events
    failed_s = next(each.t_s for each in events if each.event == "component_status")
    recovering_s = next(each.t_s for each in events if each.detail == "f_maintain_motion = fd_recover_thrusters")
    assert recovering_s == failed_s


def test_perfect_knowledge_is_no_disadvantage() -> None:
    frame = run_campaign("seams2023", ["threshold", "oracle"], runs=60)
    means = frame.groupby("manager", observed=True)["search_time_s"].mean()
    assert means["oracle"] < means["threshold"] + 10.0  # adapting sooner is not always better


@pytest.mark.parametrize("manager", ["threshold", "oracle", "fixed:fd_spiral_high"])
@pytest.mark.parametrize("scenario", ["release15"])
def test_they_work_in_other_revisions(manager: str, scenario: str) -> None:
    frame = run_campaign(scenario, [manager], runs=3)
    assert len(frame) == 3
