"""The folder of a mission is read as it was written, and what is wrong in it is named with its
place.
"""

import json
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest

from suave_des import Mission, load_scenario
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.metrics.result import KnowledgeRecord
from suave_des.records import mission_folder
from suave_des.records.mission_folder import (
    EVENTS_FILE,
    KNOWLEDGE_FILE,
    TRAJECTORY_FILE,
    knowledge_text,
    mission_files,
    mission_line,
    provenance,
    read_knowledge,
    read_mission,
    read_missions,
    record_of,
    scenario_line,
)
from tests.helpers.mission_folders import write_cell, write_listed

OBJECTIVE = ObjectiveState("f_generate_search_path", "UNGROUNDED", True)
FULL = {
    "objectives": [OBJECTIVE],
    "groundings": {"f_maintain_motion": "fd_all_thrusters"},
    "components": {"c_thruster_1": "FALSE"},
    "measurements": {"water_visibility": "2.50"},
}
"""Parts of a state of knowledge."""


def state(**parts: object) -> KnowledgeState:
    """A state that has these parts in place of those of FULL."""
    return KnowledgeState.of(**{**FULL, **parts})


def test_metrics_are_read_as_they_were(folder, result, loaded):
    assert read_mission(folder).metrics == record_of(result, loaded).metrics


def test_the_scenario_is_read_as_it_was(folder, loaded):
    assert read_mission(folder).settings == loaded.scenario


def test_events_are_read_as_they_were(folder, result):
    read = read_mission(folder).events
    assert read["event"].to_list() == [event.event for event in result.events]


def test_the_trajectory_is_read_as_it_was(folder, result):
    read = read_mission(folder).trajectory
    assert read["x_m"].to_list() == pytest.approx(
        [each.x_m for each in result.trajectory], abs=1e-6
    )


def test_states_of_knowledge_are_read_exactly_as_they_were(folder, result):
    read = read_mission(folder).knowledge
    assert [each.state for each in read] == [each.state for each in result.knowledge]


def test_the_altitudes_of_search_modes_are_read_as_they_were(folder, loaded):
    assert read_mission(folder).search_altitudes_m == loaded.modes.search_altitudes_m


def test_further_inputs_join_those_of_the_scenario(folder, loaded):
    assert read_mission(folder).inputs == {**loaded.inputs, "own.py": "abc"}


def test_a_mission_without_knowledge_has_no_file_of_it(result, loaded):
    assert KNOWLEDGE_FILE in mission_files(result, loaded, {}, ())
    bare = Mission("seams2023", "none", record=True).result()
    assert KNOWLEDGE_FILE not in mission_files(bare, loaded, {}, ())


def test_the_end_is_the_time_of_the_last_point(folder, result):
    assert read_mission(folder).end_s == result.trajectory[-1].t_s


def test_where_it_comes_from_has_no_time_of_day(loaded):
    assert provenance(loaded, {}, ("run",)) == provenance(loaded, {}, ("run",))


# What is missing or odd.


def test_an_empty_cell_is_a_missing_value(folder):
    write_cell(folder / TRAJECTORY_FILE, 3, "roll_rad", "")
    assert read_mission(folder).trajectory["roll_rad"].isna().to_list()[:3] == [False, True, False]


def test_a_detail_that_is_the_word_none_is_no_missing_value(folder):
    write_cell(folder / EVENTS_FILE, 2, "detail", "none")
    assert read_mission(folder).events["detail"].iloc[0] == "none"


def test_angles_that_are_missing_are_zero(folder):
    path = folder / TRAJECTORY_FILE
    write_listed(path, path.read_text().replace("roll_rad", "roll", 1))
    assert set(read_mission(folder).trajectory["roll_rad"]) == {0.0}


# Knowledge states.


def read_again(records: list[KnowledgeRecord], folder: Path) -> tuple[KnowledgeRecord, ...]:
    """Write states as a campaign does, and read them."""
    path = folder / "states.jsonl"
    head = scenario_line(load_scenario("seams2023").scenario)
    path.write_text(head + mission_line("metacontrol", 0, 1, records), encoding="utf-8")
    (mission,) = read_missions(path)
    return mission.records


@pytest.mark.parametrize(
    "other",
    [
        {"objectives": []},
        {"objectives": [ObjectiveState("f_generate_search_path", "UNGROUNDED", False)]},
        {"groundings": {"f_maintain_motion": "fd_recover_thrusters"}},
        {"components": {"c_thruster_1": "RECOVERED"}},
        {"measurements": {"battery_level": "2.50"}},
    ],
)
def test_states_that_differ_in_one_part_stay_different(tmp_path, other):
    records = [KnowledgeRecord(1.0, state()), KnowledgeRecord(2.0, state(**other))]
    assert read_again(records, tmp_path) == tuple(records)


SINCE = replace(state(), measured_since=(("water_visibility", Decimal("1.20")),))


@pytest.mark.parametrize("states", [[SINCE], [state(), SINCE], [SINCE, state()]])
def test_values_with_which_designs_were_chosen_stay_in_a_campaigns_states(tmp_path, states):
    records = [KnowledgeRecord(float(t_s), each) for t_s, each in enumerate(states)]
    assert read_again(records, tmp_path) == tuple(records)


def test_values_with_which_designs_were_chosen_stay_in_a_missions_states(tmp_path):
    records = (KnowledgeRecord(1.0, state()), KnowledgeRecord(2.0, SINCE))
    path = tmp_path / KNOWLEDGE_FILE
    path.write_text(knowledge_text(records), encoding="utf-8")
    assert read_knowledge(path) == records


def test_states_that_differ_in_measured_values_only_are_in_the_table_once():
    records = [
        KnowledgeRecord(float(value), state(measurements={"water_visibility": value}))
        for value in (1, 2)
    ]
    assert len(json.loads(mission_line("metacontrol", 0, 1, records))["states"]) == 1


def test_their_values_are_those_of_their_cycles(tmp_path):
    values = (Decimal("1.10"), Decimal("0.000001"))
    records = [
        KnowledgeRecord(t_s, state(measurements={"water_visibility": value}))
        for t_s, value in enumerate(values)
    ]
    found = [dict(each.state.measurements) for each in read_again(records, tmp_path)]
    assert [each["water_visibility"] for each in found] == list(values)


def test_the_scenario_has_what_is_swept_as_at_the_missions_point(tmp_path):
    path = tmp_path / "states.jsonl"
    scenario = load_scenario("seams2023").scenario
    lines = [
        mission_line("metacontrol", point, 1, [], {"signals.water_visibility.period_s": period_s})
        for point, period_s in enumerate((40.0, 120.0))
    ]
    path.write_text(scenario_line(scenario) + "".join(lines))
    periods = [each.scenario.signals["water_visibility"].period_s for each in read_missions(path)]
    assert periods == [40.0, 120.0]


def test_versions_name_every_library_that_decides():
    assert {"suave-des", "python", *mission_folder.LIBRARIES} == set(mission_folder.versions())
