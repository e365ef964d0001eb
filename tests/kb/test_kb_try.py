"""kb try, and the record of knowledge states that it works on."""

import itertools
import json
from pathlib import Path

import pytest

from suave_des import run_mission
from suave_des.errors import InputError
from suave_des.kb.replay import CONTRADICTS, DECIDES, FIRES, MissionReplay, summary, try_rules
from suave_des.records.mission_folder import (
    CAMPAIGN_KNOWLEDGE_FILE,
    KNOWLEDGE_FILE,
    knowledge_text,
    mission_line,
    read_knowledge,
    read_missions,
    scenario_line,
)
from suave_des.scenario.models import Scenario

SEARCH = "f_generate_search_path"
NEAR = (
    "near: FunctionGrounding(?fg) ^ hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ "
    'lessThan(?v, 2.5) -> fg_status(?fg, "IN_ERROR_NFR")'
)


@pytest.fixture(scope="module")
def mission(tmp_path_factory):
    scenario = tmp_path_factory.mktemp("scenario") / "short.yaml"
    scenario.write_text("base: seams2023.yaml\nmission: {time_limit_s: 60}\n")
    folder = tmp_path_factory.mktemp("missions") / "one"
    return folder, run_mission(scenario, "metacontrol", 1, 1, folder)


def test_a_mission_keeps_every_state_that_differs_from_the_one_before(mission):
    folder, result = mission
    records = read_knowledge(folder / KNOWLEDGE_FILE)
    assert [record.state for record in records] == [record.state for record in result.knowledge]
    assert knowledge_text(records) == (folder / KNOWLEDGE_FILE).read_text()
    assert all(one.state != other.state for one, other in itertools.pairwise(records))
    assert [record.t_s for record in records] == sorted(record.t_s for record in records)


def test_a_rule_fires_exactly_where_its_body_holds(mission):
    folder, result = mission
    (trial,) = try_rules(folder, NEAR)
    expected = [
        record.t_s
        for record in result.knowledge
        if record.state.grounded(SEARCH) is not None
        and dict(record.state.measurements)["water_visibility"] < 2.5
    ]
    assert expected
    assert trial.times(FIRES) == pytest.approx(expected, abs=1e-6)
    assert "?q = obs_water_visibility" in next(
        text for _, kind, text in trial.found if kind == FIRES
    )
    assert trial.states == len(result.knowledge)


def test_doing_without_a_rule_undoes_the_decisions_that_it_called_for(mission):
    folder, result = mission
    (trial,) = try_rules(folder, disabled="QAWaterVisibility")
    lost = [text for _, kind, text in trial.found if kind == DECIDES]
    adapted = [
        event
        for event in result.events
        if event.event == "adaptation" and "IN_ERROR_NFR" in event.detail
    ]
    assert len(lost) == len(adapted) > 0
    assert all(each.startswith(f"{SEARCH}: no change instead of fd_") for each in lost)


CLASH = NEAR.replace("near:", "clash:").replace("IN_ERROR_NFR", "IN_ERROR_FR").replace("2.5", "4")


@pytest.fixture(scope="module")
def problems(mission) -> list[str]:
    """What is told of the states of the mission in which a rule would contradict others."""
    (trial,) = try_rules(mission[0], CLASH)
    return [text for _, kind, text in trial.found if kind == CONTRADICTS]


def test_rules_that_would_contradict_each_other_are_named(problems):
    assert problems
    for text in problems:
        assert "by the rules QAWaterVisibility (" in text and ", clash (" in text


def test_the_command_counts_the_states_that_would_contradict_themselves(mission, problems, command):
    status, text, _ = command("try", CLASH, "--on", mission[0])
    assert status == 0
    assert f"states that would contradict themselves: {len(problems)}" in text


def test_a_folder_of_missions_is_tried_one_by_one(mission, command):
    folder, _ = mission
    status, printed, _ = command("try", NEAR, "--on", folder.parent)
    assert status == 0
    assert printed.startswith(f"{folder}: fires in ")


@pytest.fixture(scope="module")
def campaign(mission, tmp_path_factory):
    """Two points of a sweep, each the mission: at the second the design that sees furthest is
    expected to see less.
    """
    folder, result = mission
    scenario = Scenario.model_validate(
        json.loads((folder / "mission.json").read_text())["scenario"]
    )
    lines = [
        scenario_line(scenario),
        mission_line("metacontrol", 0, 1, result.knowledge),
        mission_line(
            "metacontrol",
            1,
            1,
            result.knowledge,
            {"knowledge.values": {"qa_water_visibility_high": 1.3}},
        ),
    ]
    campaign = tmp_path_factory.mktemp("campaign")
    (campaign / CAMPAIGN_KNOWLEDGE_FILE).write_text("".join(lines))
    return campaign


def test_a_campaign_keeps_the_same_states_in_less_room(mission, campaign):
    folder, result = mission
    path = campaign / CAMPAIGN_KNOWLEDGE_FILE
    first, second = read_missions(path)
    assert (
        knowledge_text(first.records)
        == knowledge_text(second.records)
        == knowledge_text(result.knowledge)
    )
    assert (first.manager, first.point, first.run, second.point) == ("metacontrol", 0, 1, 1)
    assert len(path.read_text().splitlines()[1]) < len((folder / KNOWLEDGE_FILE).read_text()) / 2


def test_a_campaign_is_tried_mission_by_mission_each_with_what_was_swept(
    mission, campaign, command
):
    alone = next(try_rules(mission[0], disabled="QAWaterVisibility"))
    first, second = try_rules(campaign, disabled="QAWaterVisibility")
    assert (first.mission, second.mission) == ("metacontrol, run 1", "metacontrol, run 1, point 1")
    assert first.found == alone.found
    assert second.found != first.found
    status, text, _ = command("try", "--disable", "QAWaterVisibility", "--on", campaign)
    assert status == 0
    assert "metacontrol, run 1: fires in" in text
    assert text.splitlines()[-1].startswith("2 missions: fires in ")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("", "line 1: is damaged"),
        ("{}\n{", "line 1: is damaged"),
        ('{"scenario": 1}\n{"swept": {}}', "line 1: is damaged"),
    ],
)
def test_a_damaged_record_of_a_campaign_is_reported(tmp_path, command, line, said):
    (tmp_path / CAMPAIGN_KNOWLEDGE_FILE).write_text(line + "\n")
    status, _, error = command("try", NEAR, "--on", tmp_path)
    assert (status, error.count("\n")) == (2, 1)
    assert f"knowledge_states.jsonl: {said}" in error


@pytest.mark.parametrize(
    ("line", "has_mission", "said"),
    [
        (None, False, r"has no knowledge\.jsonl or knowledge_states\.jsonl.*--record-knowledge"),
        ('{"t_s": 1}', False, r"mission\.json: no such file"),
        ('{"t_s": 1}', True, r"knowledge\.jsonl: line 1: is damaged"),
    ],
    ids=["an empty folder", "no mission", "a damaged record"],
)
def test_what_is_no_record_of_a_mission_is_reported(mission, tmp_path, line, has_mission, said):
    if line is not None:
        (tmp_path / KNOWLEDGE_FILE).write_text(f"{line}\n")
    if has_mission:
        (tmp_path / "mission.json").write_bytes((mission[0] / "mission.json").read_bytes())
    with pytest.raises(InputError, match=said):
        list(try_rules(tmp_path, NEAR))


def test_missions_are_counted_once_however_often_something_happens_in_them():
    decides = tuple((t_s, DECIDES, "f: a instead of b") for t_s in (1.0, 2.0, 3.0))
    missions = [
        MissionReplay(Path("flown"), "one", 9, decides),
        MissionReplay(Path("flown"), "two", 9, ()),
    ]
    (last,) = (line for line in summary(missions) if "missions:" in line)
    assert "different decisions in 1 (3 decisions)" in last


def test_of_several_missions_those_in_which_something_happens_are_told():
    missions = [
        MissionReplay(Path("flown"), "one", 9, ((1.0, FIRES, "Role(x)"),)),
        MissionReplay(Path("flown"), "two", 9, ()),
    ]
    found = [line for line in summary(missions) if line.startswith("flown: ")]
    assert found == ["flown: one: fires in 1 of 9 recorded states"]
