"""The models of result files: what may stand in them, and the place of what may not."""

import json
from pathlib import Path

import pytest
from pydantic import ValidationError

from suave_des.errors import InputError
from suave_des.records.contents import (
    FAILURE,
    Cycle,
    Manifest,
    Metrics,
    MissionCounts,
    MissionLine,
    RecordedSweep,
    StateOfTable,
    checked,
    read,
    row_of,
)

MISSION = {
    "scenario": "seams2023",
    "manager": "none",
    "run": 1,
    "seed": 2,
    "initial_x_m": -17.0,
    "initial_y_m": 2.0,
    "mission_duration_s": 300.0,
    "pipeline_found": True,
    "search_time_s": 100.0,
    "distance_inspected_m": 12.5,
    "mean_reaction_time_s": None,
    "adaptations": 3,
    "detection_time_s": 99.5,
    "detection_x_m": 1.0,
    "detection_y_m": 2.0,
}
COUNTS = {"planned": 4, "failed": 1, "left_out": 0}
STATE = {"objectives": [], "groundings": {}, "components": {}}


# Rows of a campaign.


def test_a_row_has_the_metrics_of_every_mission():
    cells = list(MISSION.values())
    assert row_of(cells) == tuple(cells)


def test_a_whole_number_is_a_number_too():
    row = row_of(list({**MISSION, "search_time_s": 100}.values()))
    assert row[list(MISSION).index("search_time_s")] == 100.0


@pytest.mark.parametrize("further", ["low", True, 3, 0.5, None])
def test_a_further_cell_may_be_of_any_type(further):
    assert row_of([*MISSION.values(), further])[-1] is further


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("run", "1"),
        ("run", 1.5),
        ("pipeline_found", 1),
        ("search_time_s", None),
        ("search_time_s", float("nan")),
        ("search_time_s", 1.1e12),
        ("adaptations", 2 * 10**12),
    ],
)
def test_a_cell_of_another_type_is_refused(column, value):
    with pytest.raises(ValidationError):
        row_of(list({**MISSION, column: value}.values()))


def test_a_row_with_too_few_cells_is_refused():
    with pytest.raises(ValidationError):
        row_of(list(MISSION.values())[:-1])


@pytest.mark.parametrize("further", [[1.0], float("inf"), -1.1e12])
def test_a_further_cell_that_is_no_ordinary_value_is_refused(further):
    with pytest.raises(ValidationError):
        row_of([*MISSION.values(), further])


@pytest.mark.parametrize("time_s", [12.5, None])
def test_a_failed_mission_has_a_time_or_none(time_s):
    failed = ("none", 1, time_s, "ValueError: no", False, 0)
    assert FAILURE.validate_python(failed) == failed


# mission.json.


@pytest.mark.parametrize("absent", ["initial_x_m", "adaptations", "mean_reaction_time_s"])
def test_metrics_of_earlier_versions_lack_some(absent):
    metrics = {name: value for name, value in MISSION.items() if name != absent}
    assert getattr(Metrics.model_validate(metrics), absent) is None


@pytest.mark.parametrize("needed", ["scenario", "run", "search_time_s", "detection_y_m"])
def test_but_not_these(needed):
    metrics = {name: value for name, value in MISSION.items() if name != needed}
    with pytest.raises(ValidationError):
        Metrics.model_validate(metrics)


def test_further_metrics_are_kept():
    metrics = Metrics.model_validate({**MISSION, "covered_area_m2": 70.0})
    assert metrics.model_extra == {"covered_area_m2": 70.0}


# Knowledge.


def test_measured_values_stay_as_exact_as_they_were_written():
    cycle = Cycle.model_validate({**STATE, "t_s": 1.0, "measurements": {"depth": "0.10"}})
    assert cycle.measurements["depth"] == "0.10"


def test_an_objective_is_a_list_in_json():
    state = StateOfTable.model_validate(
        {**STATE, "objectives": [["f_search", None, True]], "measured": []}
    )
    assert state.objectives == [("f_search", None, True)]


def line(*cycle: object) -> dict[str, object]:
    """A mission with one state, in which one thing was measured, and one cycle."""
    states = [{**STATE, "measured": ["water_visibility"]}]
    about = {"manager": "none", "point": 0, "run": 1, "swept": {}}
    return {**about, "states": states, "cycles": [list(cycle)]}


def test_a_cycle_is_a_row_of_three():
    assert MissionLine.model_validate(line(1.5, 0, "2.50")).cycles == [[1.5, 0, "2.50"]]


@pytest.mark.parametrize(
    "cycle",
    [
        ("1.5", 0, "2.50"),
        (1.5, 1, "2.50"),
        (1.5, -1, "2.50"),
        (1.5, "0", "2.50"),
        (1.5, 0),
        (1.5, 0, "2.50", "1.00"),
        (1.5, 0, 2.5),
    ],
    ids=[
        "a time that is text",
        "a state that is not there",
        "one before the first",
        "one that is text",
        "too few values",
        "too many",
        "one that is a number",
    ],
)
def test_a_cycle_that_does_not_fit_its_state_is_refused(cycle):
    with pytest.raises(ValidationError):
        MissionLine.model_validate(line(*cycle))


# manifest.json.


def test_a_sweep_varies_what_is_combined_before_what_is_varied_together():
    sweep = RecordedSweep(zip={"b": [1], "c": [2]}, grid={"a": [3]})
    assert sweep.names == ("a", "b", "c")


@pytest.mark.parametrize(
    "content",
    [
        {"runs_per_draw": 0},
        {"missions": {**COUNTS, "failed": -1}},
        {"missions": {**COUNTS, "failed": "1"}},
        {"labels": {"none": 1}},
    ],
)
def test_what_no_campaign_writes_is_refused(content):
    with pytest.raises(ValidationError):
        Manifest.model_validate(content)


def test_keys_that_are_not_known_are_left_out():
    assert Manifest.model_validate({"written_by": "a later version"}) == Manifest()


# Reading.

FILE = Path("manifest.json")


def test_what_is_right_is_read_as_it_was_written(tmp_path):
    (tmp_path / FILE).write_text(json.dumps({"missions": COUNTS}))
    assert read(Manifest, tmp_path / FILE, "") == Manifest(missions=MissionCounts(**COUNTS))


def wrong(content: object) -> InputError:
    with pytest.raises(InputError) as caught:
        checked(Manifest, content, FILE, "run it again")
    return caught.value


def test_what_is_wrong_is_told_with_its_file():
    assert wrong({"runs_per_draw": 0}).file == str(FILE)


@pytest.mark.parametrize(
    ("content", "place"),
    [
        ({"runs_per_draw": 0}, "runs_per_draw"),
        ({"missions": {"planned": 4, "failed": 1}}, "missions.left_out"),
        ([], None),
    ],
    ids=["a key", "a key within one", "the whole file"],
)
def test_what_is_wrong_is_told_with_its_place(content, place):
    assert wrong(content).place == place


def test_what_is_wrong_is_told_with_what_the_reader_can_do():
    assert wrong({"runs_per_draw": 0}).remedy == "run it again"
