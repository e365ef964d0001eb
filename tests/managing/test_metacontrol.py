"""Metacontrol by what it does in mission time, with the shipped knowledge base and with others."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from suave_des.errors import InputError, MissionError
from suave_des.metrics.result import MissionResult
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator
from tests.helpers.exemplar_files import write_exemplar_files
from tests.helpers.owl_text import individual

MOTION, SEARCH, FOLLOW = "f_maintain_motion", "f_generate_search_path", "f_follow_pipeline"
REASONED_AT_ONCE = {"latencies.inference_s": 0.0, "latencies.mode_change_s": 0.0}


def visibility(value: float) -> dict[str, Any]:
    return {"signals.water_visibility": {"kind": "constant", "value": value}}


def steps(before: float, after: float, time_s: float) -> dict[str, Any]:
    return {
        "signals.water_visibility": {
            "kind": "step",
            "time_s": time_s,
            "before": before,
            "after": after,
        }
    }


def mission(
    values: Mapping[str, Any],
    *,
    name: str = "seams2023",
    run: int = 1,
    limit_s: float = 60.0,
    **given: Any,
) -> MissionResult:
    loaded = load_scenario(name, **given)
    return Simulator(with_values(loaded, {"mission.time_limit_s": limit_s, **values})).run(
        "metacontrol", run, 1, record=True
    )


def modes(result: MissionResult, function: str) -> list[tuple[float, str]]:
    """Modes asked for, with the times."""
    asked = [
        (event.t_s, event.detail.split(" -> "))
        for event in result.events
        if event.event == "mode_requested"
    ]
    return [(t_s, mode) for t_s, (name, mode) in asked if name == function]


def told(result: MissionResult, event: str) -> list[str]:
    return [each.detail for each in result.events if each.event == event]


BOTH = pytest.mark.parametrize("name", ["seams2023", "release15"])


@BOTH
@pytest.mark.parametrize(
    ("value", "design"),
    [
        (1.0, None),
        (1.25, "fd_spiral_low"),
        (2.24, "fd_spiral_low"),
        (2.25, "fd_spiral_medium"),
        (3.24, "fd_spiral_medium"),
        (3.25, "fd_spiral_high"),
    ],
)
def test_the_search_is_as_high_as_the_measured_visibility_allows(name, value, design):
    found = mission(visibility(value), name=name, limit_s=10.0)
    # at the limit the task is cancelled
    chosen = [mode for t_s, mode in modes(found, SEARCH) if t_s < 10.0]
    assert chosen[-1:] == ([design] if design else [])
    if design is None:
        assert "no function design is left" in told(found, "no_design_left")[0]


@pytest.fixture(scope="module", params=["seams2023", "release15"])
def recovery(request: pytest.FixtureRequest) -> tuple[float, list[tuple[float, str]]]:
    """Period of the cycles, and the modes asked for around a failure at 35 s."""
    found = mission({**visibility(1.5), **REASONED_AT_ONCE}, name=request.param)
    return {"seams2023": 2.0, "release15": 1.5}[request.param], modes(found, MOTION)[:3]


def test_all_thrusters_are_used_again_after_a_recovery(recovery):
    _, asked = recovery
    used = ["fd_all_thrusters", "fd_recover_thrusters", "fd_all_thrusters"]
    assert [mode for _, mode in asked] == used


def test_a_lost_thruster_is_recovered_by_the_next_cycle(recovery):
    period_s, (_, (recover_s, _), _) = recovery
    assert 35.0 <= recover_s <= 36.0 + period_s


def test_a_recovery_ends_within_a_cycle_of_its_time(recovery):
    period_s, (_, (recover_s, _), (back_s, _)) = recovery
    assert recover_s + 10.0 <= back_s <= recover_s + 11.5 + period_s


def test_a_recovery_is_reasoned_about_once():
    found = mission(visibility(1.5))
    assert told(found, "inferred").count("objective of f_maintain_motion is updatable") == 1
    assert [mode for _, mode in modes(found, MOTION)] == [
        "fd_all_thrusters",
        "fd_recover_thrusters",
        "fd_all_thrusters",
    ]


@pytest.mark.parametrize("latency_s", [0.0, 0.7])
def test_a_plan_comes_as_much_later_as_the_inference_takes(latency_s):
    """A failure is reported at once; reasoning begins at a tick of 2 s, and ends later."""
    at_once = mission({**visibility(3.5), "latencies.inference_s": 0.0})
    later = mission({**visibility(3.5), "latencies.inference_s": latency_s})
    assert "fd_recover_thrusters" in [mode for _, mode in modes(later, MOTION)]
    for (then_s, mode), (later_s, same) in zip(
        modes(at_once, MOTION), modes(later, MOTION), strict=True
    ):
        assert mode == same
        assert later_s == pytest.approx(then_s + latency_s)


FIRST_CYCLE_S = {"managers.metacontrol.first_cycle_s": 1.5, "latencies.inference_s": 1.0}


@pytest.mark.parametrize(
    ("after_m", "mode", "step_s", "asked_s"),
    [
        (1.5, "fd_spiral_low", 19.2, 20.5),  # before the cycle from 19.5 to 20.5 s
        (1.5, "fd_spiral_low", 20.0, 20.5),  # in the middle of it
        (1.5, "fd_spiral_low", 20.9, 22.5),  # after it
        (2.5, "fd_spiral_medium", 20.0, 20.5),
    ],
)
def test_a_design_is_chosen_by_the_values_measured_when_the_inference_is_over(
    after_m, mode, step_s, asked_s
):
    """The search is always adapted in revision 2023 while the visibility exceeds what is expected."""
    changed = mission({**steps(3.5, after_m, step_s), **FIRST_CYCLE_S})
    assert modes(changed, SEARCH)[1] == (pytest.approx(asked_s), mode)


def test_whether_to_adapt_is_inferred_from_the_values_at_the_beginning_of_the_cycle():
    """At 2.25 m nothing exceeds what fd_spiral_medium expects: that the value falls at 20 s is not
    inferred before the next cycle, at 21.5 s.
    """
    changed = mission({**steps(2.25, 1.5, 20.0), **FIRST_CYCLE_S})
    assert modes(changed, SEARCH)[1] == (pytest.approx(22.5), "fd_spiral_low")


@pytest.mark.parametrize("executes", [True, False])
def test_a_plan_under_way_is_executed_though_its_objective_is_removed(executes):
    """In revision 2023 the search then goes on while the pipeline is followed."""
    values = {
        **visibility(3.5),
        "revision.metacontrol.executes_plans_of_removed_objectives": executes,
    }
    goes_on = set()
    for run in range(1, 9):
        found = mission(values, run=run, limit_s=150.0)
        # 1 s after it began; the next one begins a second later
        cycle_ends_s = modes(found, MOTION)[0][0]
        removed_s = next(t_s for t_s, mode in modes(found, SEARCH) if mode == "fd_unground")
        again = [(t_s, mode) for t_s, mode in modes(found, SEARCH) if removed_s < t_s < 149.0]
        under_way_s = (removed_s - cycle_ends_s) % 2.0 - 1.0
        asked = (pytest.approx(removed_s + 1.0 - under_way_s), "fd_spiral_high")
        assert again == ([asked] if executes and under_way_s >= 0.0 else [])
        goes_on.add(bool(again))
    assert goes_on == ({True, False} if executes else {False})


def test_revision_15_waits_for_the_first_measurement():
    late = {
        "signals.water_visibility": {"kind": "constant", "value": 1.5, "publishing_period_s": 30.0}
    }
    first_message_s = next(
        event.t_s
        for event in mission(late, name="release15").events
        if event.event == "first_measurement"
    )
    assert first_message_s > 2.0
    assert modes(mission(late, name="release15"), SEARCH)[0][0] >= first_message_s
    # Revision 2023 filters nothing out before it.
    assert modes(mission(late), SEARCH)[0] == (pytest.approx(1.5, abs=1.5), "fd_spiral_high")


def found_pipeline(name: str) -> tuple[MissionResult, float]:
    """A mission in which the pipeline is found, and when its inspection is requested."""
    missions = (mission({}, name=name, limit_s=300.0, run=run) for run in range(1, 9))
    found = next(each for each in missions if each.metrics.pipeline_found)
    requested_s = next(event.t_s for event in found.events if event.detail == "inspect_pipeline")
    return found, requested_s


@pytest.fixture(scope="module")
def found_in_2023() -> tuple[MissionResult, float, float]:
    """Also with the time at which the search ends."""
    found, requested_s = found_pipeline("seams2023")
    ended_s = next(t_s for t_s, mode in modes(found, SEARCH) if mode == "fd_unground")
    return found, requested_s, ended_s


def test_in_2023_the_search_ends_at_a_tick_of_the_bridge(found_in_2023):
    _, requested_s, ended_s = found_in_2023
    assert requested_s < ended_s <= requested_s + 2.0


def test_in_2023_following_waits_for_a_cycle(found_in_2023):
    found, _, ended_s = found_in_2023
    assert ended_s + 1.0 <= modes(found, FOLLOW)[0][0] <= ended_s + 3.0


def test_in_2023_maintain_motion_goes_on_between_the_tasks(found_in_2023):
    found, _, _ = found_in_2023
    assert "fd_unground" not in [mode for _, mode in modes(found, MOTION)]


@pytest.fixture(scope="module")
def found_in_15() -> tuple[MissionResult, float]:
    return found_pipeline("release15")


@pytest.mark.parametrize("function", [SEARCH, MOTION])
def test_in_15_a_task_ends_at_once_with_all_its_functions(found_in_15, function):
    found, requested_s = found_in_15
    assert (requested_s, "fd_unground") in modes(found, function)


def test_in_15_the_next_task_is_reasoned_about_at_once(found_in_15):
    found, requested_s = found_in_15
    assert 1.0 <= modes(found, FOLLOW)[0][0] - requested_s <= 2.5


NEW_DESIGN = "".join(
    individual(name, kind, *statements)
    for name, kind, *statements in (
        (
            *("fd_spiral_very_high", "FunctionDesign", ("solvesF", f":{SEARCH}")),
            *(("hasQAestimation", ":qa_sight"), ("hasQAestimation", ":qa_speed")),
        ),
        ("qa_sight", "QAvalue", ("isQAtype", ":water_visibility"), ("hasValue", "4.25")),
        ("qa_speed", "QAvalue", ("isQAtype", ":mros:performance"), ("hasValue", "1.5")),
    )
)


def modes_with_a_fourth_altitude(folder: Path) -> Path:
    text = (shipped_folder("scenarios") / "suave_modes.yaml").read_text()
    system = "        f_generate_search_path_node: active.fd_spiral_high\n"
    node = "          spiral_altitude: 3.0\n"
    assert system in text and node in text
    text = text.replace(
        system, system + "      fd_spiral_very_high:\n" + system.replace("_high", "_very_high")
    )
    text = text.replace(
        node,
        node
        + "      fd_spiral_very_high:\n        ros__parameters:\n"
        + node.replace("3.0", "4.0"),
    )
    copy = folder / "modes.yaml"
    copy.write_text(text)
    return copy


def test_a_fourth_search_altitude_needs_no_python(suave_copy, tmp_path):
    given = {
        "ontologies": [suave_copy(NEW_DESIGN)],
        "modes_file": modes_with_a_fourth_altitude(tmp_path),
    }
    found = mission(steps(4.5, 3.5, 12.0), **given)  # before anything is found from up there
    assert [mode for _, mode in modes(found, SEARCH)][:2] == [
        "fd_spiral_very_high",
        "fd_spiral_high",
    ]
    highest_m = max(point.z_m for point in mission(visibility(4.5), **given).trajectory)
    assert highest_m > max(point.z_m for point in mission(visibility(4.5)).trajectory) + 0.7


def test_a_design_without_a_mode_is_bad_input(suave_copy):
    with pytest.raises(InputError, match=r"suave_modes.yaml.*fd_spiral_very_high"):
        mission({}, ontologies=[suave_copy(NEW_DESIGN)])


@pytest.fixture(scope="module")
def contradiction(tmp_path_factory: pytest.TempPathFactory) -> MissionError:
    """Rules clash in the cycle that finds the water too murky for the present design, not before."""
    rules = tmp_path_factory.mktemp("rules") / "clash.swrl"
    rules.write_text(
        'everything_is_in_error: FunctionGrounding(?g) -> fg_status(?g, "IN_ERROR_FR")\n'
    )
    with pytest.raises(MissionError) as raised:
        mission({**steps(3.5, 1.5, 21.0), **FIRST_CYCLE_S}, rules=[rules])
    return raised.value


def test_rules_that_contradict_one_another_end_the_mission_where_they_do(contradiction):
    assert contradiction.manager == "metacontrol"
    assert contradiction.time_s == pytest.approx(21.5)


@pytest.mark.parametrize("rule", ["everything_is_in_error", "QAWaterVisibility"])
def test_each_rule_that_contradicts_another_is_named(contradiction, rule):
    assert rule in contradiction.cause


@pytest.mark.parametrize("oldest", [False, True])
def test_the_exemplars_three_files_give_the_same_missions(tmp_path, oldest):
    files = write_exemplar_files(shipped_folder("ontology"), tmp_path, oldest=oldest)
    theirs = Simulator(load_scenario("seams2023", ontologies=list(files.values())))
    ours = Simulator(load_scenario("seams2023"))
    for run in range(1, 9):
        assert theirs.run("metacontrol", run, 1).metrics == ours.run("metacontrol", run, 1).metrics


@BOTH
def test_that_no_design_is_left_is_told_once_until_there_is_one_again(name, tmp_path):
    """The measured value changes at every cycle, and with it the reasons in the event."""
    levels = ["0,1.00", "6,1.05", "10,1.10", "20,1.5", "30,1.10", "36,1.15", "44,1.20", "50,1.6"]
    (tmp_path / "murk.csv").write_text("t_s,value\n" + "\n".join(levels) + "\n")
    scenario = tmp_path / "murky.yaml"
    scenario.write_text(
        f"base: {name}\nmission: {{time_limit_s: 60}}\n"
        "signals: {water_visibility: {kind: table, file: murk.csv}}\nthruster_events: []\n"
    )
    found = Simulator(load_scenario(scenario)).run("metacontrol", 1, 1, record=True)
    lines = [(each.t_s, each.detail) for each in found.events if each.event == "no_design_left"]
    assert [t_s < 20.0 for t_s, _ in lines] == [True, False]
    assert 30.0 <= lines[1][0] < 36.0
    assert "water_visibility 1.00 measured < 1.25 expected" in lines[0][1]


SLOW = {"latencies.inference_s": 5.0, "calibration.altitude_error_m": 0.0, "thruster_events": []}


def detection_s(result: MissionResult) -> float:
    return next(each.t_s for each in result.events if each.event == "pipeline_detected")


def test_a_decision_on_a_task_that_is_over_meanwhile_is_not_carried_out():
    detected_s = detection_s(mission({**SLOW, **visibility(2.4)}, name="release15", limit_s=250.0))
    # The water clears 2 s before the pipeline comes into view: a higher search is decided on, and
    # is over.
    after = mission(
        {**SLOW, **steps(2.4, 3.3, detected_s - 2.0)}, name="release15", limit_s=detected_s + 10.0
    )
    assert detection_s(after) == detected_s
    assert [mode for t_s, mode in modes(after, SEARCH) if t_s > detected_s - 2.0] == ["fd_unground"]


def test_a_decision_on_the_task_before_is_not_carried_out_for_the_next():
    detected_s = detection_s(mission({**SLOW, **visibility(2.4)}, name="release15", limit_s=250.0))
    # A thruster fails 3 s before: its recovery is decided on for the search's objective. That of
    # the inspection is new, so it has to be reasoned about, which takes 5 s from then on.
    failure = [{"thruster": 1, "event": "failure", "time_s": detected_s - 3.0}]
    values = {**SLOW, **visibility(2.4), "thruster_events": failure}
    after = mission(values, name="release15", limit_s=detected_s + 20.0)
    found_s = detection_s(after)
    (over_s, over), (next_s, _) = [
        (t_s, mode) for t_s, mode in modes(after, MOTION) if t_s >= found_s
    ][:2]
    assert over == "fd_unground"
    assert next_s >= over_s + 5.0
