"""What is said of records that cannot be used: a row for each, with what is given and what is said
of it.
"""

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path

import pandas
import pytest

from suave_des import load_scenario
from suave_des.errors import InputError
from suave_des.files import write_beside
from suave_des.knowledge.state import KnowledgeState
from suave_des.metrics.result import KnowledgeRecord
from suave_des.records.metrics import COLUMN_TYPES
from suave_des.records.mission_folder import (
    EVENTS_FILE,
    KNOWLEDGE_FILE,
    MISSION_FILE,
    TRAJECTORY_FILE,
    knowledge_text,
    mission_line,
    read_knowledge,
    read_mission,
    read_missions,
    read_states,
    scenario_line,
)
from suave_des.records.missions import missions_in, missions_of
from suave_des.records.runs import read_runs
from suave_des.records.store import (
    MANIFEST_FILE,
    RUNS_FILE,
    STORE_FILE,
    SUAVE_FOLDER,
    MissionKey,
    Store,
    read_manifest,
    tidy,
)
from tests.helpers.mission_folders import write_cell

Given = Callable[[Path], object]
"""Makes something in a folder, and reads it."""
OWN = "manager,search_time_s,distance_inspected_m"
CELLS = {"str": "sea", "int": 1, "float": 87.5, "bool": True}
ROW = tuple(CELLS[kind] for kind in COLUMN_TYPES.values())
FRAME = pandas.DataFrame(
    {"manager": ["none"], "search_time_s": [100], "distance_inspected_m": [2.0]}
)


# The folder of a mission, which is there whole.


def cell(line: int, column: str, text: str) -> Given:
    """Another text in a cell of the trajectory."""

    def given(folder: Path) -> object:
        write_cell(folder / TRAJECTORY_FILE, line, column, text)
        return read_mission(folder)

    return given


def header_alone(name: str, folder: Path) -> object:
    write_beside(folder, {name: (folder / name).read_text().splitlines()[0] + "\n"})
    return read_mission(folder)


def without_file(name: str, folder: Path) -> object:
    (folder / name).unlink()
    return read_mission(folder)


def without_column(folder: Path) -> object:
    text = (folder / TRAJECTORY_FILE).read_text()
    write_beside(folder, {TRAJECTORY_FILE: text.replace("x_m", "x", 1)})
    return read_mission(folder)


def mission(content: object) -> Given:
    """Another content of mission.json."""

    def given(folder: Path) -> object:
        (folder / MISSION_FILE).write_text(json.dumps(content))
        return read_mission(folder)

    return given


def without_metric(name: str, folder: Path) -> object:
    content = json.loads((folder / MISSION_FILE).read_text())
    del content["metrics"][name]
    return mission(content)(folder)


def with_unknown_setting(folder: Path) -> object:
    content = json.loads((folder / MISSION_FILE).read_text())
    content["scenario"]["tide"] = 1
    return mission(content)(folder)


def changed_since(read: Given, folder: Path) -> object:
    path = folder / KNOWLEDGE_FILE
    path.write_text(path.read_text() + path.read_text().splitlines()[-1] + "\n")
    return read(folder)


NO_NUMBER = [
    (cell(3, column, text), f"line 3: {column}: expected a finite number, got '{text}'")
    for column in ("t_s", "x_m")
    for text in ("soon", "inf", "nan", "")
]
MISSION_FOLDERS = [
    *NO_NUMBER,
    (cell(3, "y_m", ""), "line 3: y_m: expected a finite number, got ''"),
    (cell(3, "z_m", ""), "line 3: z_m: expected a finite number, got ''"),
    (cell(3, "t_s", "100.0"), "line 4: t_s: 0.4 s is before the time of the row above"),
    *[
        (partial(header_alone, name), f"{name}: is empty")
        for name in (EVENTS_FILE, TRAJECTORY_FILE)
    ],
    *[(partial(without_file, name), name) for name in (MISSION_FILE, EVENTS_FILE, TRAJECTORY_FILE)],
    (without_column, "x_m is missing"),
    *[
        (partial(without_metric, name), f"metrics.{name}: is missing")
        for name in ("scenario", "manager", "search_time_s")
    ],
    (mission([]), f"{MISSION_FILE}: [] should be a mapping"),
    (mission({}), f"{MISSION_FILE}: metrics: is missing"),
    (mission({"metrics": 1, "scenario": 2}), f"{MISSION_FILE}: metrics: 1 should be a mapping"),
    (with_unknown_setting, "scenario.tide: unknown key"),
    (with_unknown_setting, "run the mission again"),
    *[
        (partial(changed_since, read), f"{KNOWLEDGE_FILE}: is not as {MISSION_FILE} beside it")
        for read in (read_mission, read_states)
    ],
]


@pytest.mark.parametrize(("given", "said"), MISSION_FOLDERS)
def test_a_folder_of_a_mission(folder, given, said):
    with pytest.raises(InputError) as caught:
        given(folder)
    assert said in str(caught.value)


# Anything else, in a folder that is empty.

STATE = KnowledgeState.of([], groundings={}, components={}, measurements={})


def states_with_a_cut_line(folder: Path) -> object:
    path = folder / KNOWLEDGE_FILE
    path.write_text(knowledge_text([KnowledgeRecord(1.0, STATE)]) + "{\n")
    return read_knowledge(path)


def states_without_one_of_a_cycle(folder: Path) -> object:
    line = json.loads(mission_line("metacontrol", 0, 1, [KnowledgeRecord(1.0, STATE)]))
    line["cycles"][0][1] = 7
    head = scenario_line(load_scenario("seams2023").scenario)
    (folder / "states.jsonl").write_text(head + json.dumps(line) + "\n")
    return list(read_missions(folder / "states.jsonl"))


def store_with_row(row: tuple[object, ...], folder: Path) -> object:
    with closing(Store(folder / STORE_FILE)) as store:
        store.begin({"identity": "one"})
        store.append([(MissionKey(0, 0, 1), row)])
        return list(store.outcomes(lambda outcome: ""))


def store_without_note(folder: Path) -> object:
    with closing(Store(folder / STORE_FILE)) as store:
        store.begin({"identity": "one"})
        return store.about("request")


def store_in_use(folder: Path) -> object:
    with closing(Store(folder / STORE_FILE)) as store:
        store.begin({})
        return Store(folder / STORE_FILE)


def changed(statement: str) -> Given:
    """A store with an outcome that another program has changed."""

    def given(folder: Path) -> object:
        store_with_row(ROW, folder)
        with closing(sqlite3.connect(folder / STORE_FILE)) as db, db:
            db.execute(statement)
        with closing(Store(folder / STORE_FILE)) as store:
            return store.about("identity"), list(store.outcomes(lambda outcome: ""))

    return given


def no_store(folder: Path) -> object:
    (folder / STORE_FILE).write_text("my notes " * 100)
    return Store(folder / STORE_FILE)


def link_in_place_of_the_exemplars_folder(folder: Path) -> object:
    (folder / "elsewhere").mkdir()
    (folder / SUAVE_FOLDER).symlink_to(folder / "elsewhere")
    with closing(Store(folder / STORE_FILE)) as store:
        return tidy(store, is_new=True)


def manifest(content: str, folder: Path) -> object:
    store_with_row(ROW, folder)
    (folder / MANIFEST_FILE).write_text(content)
    return read_manifest(folder)


WITHOUT_NUMBER_OF_MISSIONS = partial(manifest, '{"missions": {"failed": 0, "left_out": 0}}')


def given_twice(folder: Path) -> object:
    (folder / "one").mkdir()
    return missions_in([folder / "one", folder / "one" / ".." / "one"])


def without_result_files(folder: Path) -> object:
    with closing(Store(folder / STORE_FILE)) as store:
        store.begin({})
    return missions_in(folder)


def mission_twice(folder: Path) -> object:
    rows = "none,100,2,1,1\nnone,90,2,1,1\n"
    (folder / RUNS_FILE).write_text(f"{OWN},run,seed\n{rows}")
    return missions_in(folder)


def runs(content: str) -> Given:
    """A file of missions."""

    def given(folder: Path) -> object:
        (folder / RUNS_FILE).write_text(content, encoding="utf-8")
        return read_runs(folder / RUNS_FILE)

    return given


def without_further_column(folder: Path) -> object:
    (folder / RUNS_FILE).write_text(f"{OWN},period\nnone,120,3,40\n")
    return read_runs(folder / RUNS_FILE, ["speed"])


TO_1E12 = "expected a finite number, at most 1e+12, got "
OTHERS = [
    (states_with_a_cut_line, "line 2: is damaged: "),
    (states_with_a_cut_line, " (run the mission again)"),
    (states_without_one_of_a_cycle, "line 2: is damaged: "),
    (states_without_one_of_a_cycle, " (run the campaign again)"),
    # stores
    (partial(store_with_row, ROW[:3]), "is damaged"),
    (partial(store_with_row, ("sea", "none", "one", *ROW[3:])), "is damaged"),
    (store_without_note, "is damaged: its request is missing"),
    (store_in_use, "another campaign is running in the output folder"),
    (
        changed("UPDATE outcomes SET content = '[1]'"),
        "the outcome of run 1 is not what was written",
    ),
    (changed("UPDATE outcomes SET run = 2"), "the outcome of run 2 is not what was written"),
    (changed("UPDATE outcomes SET kind = 1"), "the outcome of run 1 is not what was written"),
    (changed("UPDATE about SET value = '\"two\"'"), "its identity is not what was written"),
    (changed("PRAGMA user_version = 2"), "store of version 2, and this suave-des has version 3"),
    (no_store, "is damaged"),
    (link_in_place_of_the_exemplars_folder, "is a link"),
    (WITHOUT_NUMBER_OF_MISSIONS, "missions.planned: is missing"),
    (WITHOUT_NUMBER_OF_MISSIONS, "campaign --resume"),
    (
        partial(manifest, '{"campaign_sha256": "two"}'),
        "runs.csv and campaign.sqlite are of different",
    ),
    # several sources
    (given_twice, "is given twice"),
    (lambda folder: missions_in([]), "no results are given"),
    (missions_in, "has no result files"),
    (without_result_files, "ended before its result files"),
    (without_result_files, "campaign --resume"),
    (mission_twice, "run 1 of none with seed 1 is there twice"),
    # data frames
    *[
        (
            lambda folder, column=column: missions_of(FRAME.drop(columns=column)),
            f"has no column '{column}'",
        )
        for column in FRAME
    ],
    (lambda folder: missions_of(FRAME.iloc[:0]), "has no missions"),
    (
        lambda folder: missions_of(FRAME.assign(search_time_s="soon")),
        "something that is no number",
    ),
    # files of missions
    (without_further_column, "line 1: has no column 'speed'"),
    (
        lambda folder: runs(f"{OWN}\nnone,1,2\n")(folder).choose(["none", "bt"]),
        "no mission of manager 'bt'",
    ),
    (
        lambda folder: runs(f"scenario,{OWN}\nsea,none,1,2\nlake,none,1,2\n")(
            folder
        ).check_simulated(),
        "line 3: has missions of several scenarios: sea and lake",
    ),
    (
        runs(f"{OWN},pipeline_found\nnone,100,2,perhaps\n"),
        "line 2: pipeline_found: expected True or False",
    ),
]


@pytest.mark.parametrize(("given", "said"), OTHERS)
def test_anything_else(tmp_path, given, said):
    with pytest.raises(InputError) as caught:
        given(tmp_path)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("content", "line", "problem"),
    [
        ("", 1, "has no column 'manager'"),
        (f"{OWN},manager\nnone,1,2,none\n", 1, "has column 'manager' twice"),
        (OWN.replace(",", ";") + "\nnone;1;2\n", 1, "has no column 'manager'"),
        (f"{OWN}\n", 1, "has no mission"),
        (
            f"{OWN}\nnone,120,3\nnone,soon,3\n",
            3,
            "search_time_s: expected a finite number, at most 1e+12, got 'soon'",
        ),
        (
            f"{OWN}\nnone,120,\n",
            2,
            "inspected_m: expected a finite number, at least 0 and at most 1e+12, got ''",
        ),
        (
            f"{OWN}\nnone,120,3\nnone,1_2,3\n",
            3,
            "search_time_s: expected a finite number, at most 1e+12, got '1_2'",
        ),
        (
            f"{OWN}\nnone,١٢,3\n",
            2,
            "search_time_s: expected a finite number, at most 1e+12, got '١٢'",
        ),
        (
            f"{OWN}\nnone,2e12,3\n",
            2,
            "search_time_s: expected a finite number, at most 1e+12, got '2e12'",
        ),
        (f"{OWN}\nnone,-1,3\n", 2, "search_time_s: expected a finite number, at least 0, got '-1'"),
        (f"{OWN},adaptations\nnone,1,3,1e400\n", 2, "adaptations: expected a whole number"),
        (f"{OWN}\nnone,120\n", 2, "has 2 values, but the header has 3"),
        (f"{OWN}\n ,120,3\n", 2, "manager: expected a manager's name"),
        (f'{OWN}\n"none,120,3\n', 2, "is not valid CSV"),
    ],
)
def test_a_file_of_missions(write, content, line, problem):
    path = write("runs.csv", content)
    with pytest.raises(InputError) as caught:
        read_runs(path)
    assert caught.value.file == str(path)
    assert caught.value.place == f"line {line}"
    assert problem in caught.value.problem
    assert caught.value.remedy
