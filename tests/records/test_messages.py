"""What readers of results say of what is wrong: file, place, problem, and what to do.

Other tests of `records` ask for the type of an error and for its place alone.
"""

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pandas
import pytest

from suave_des.errors import SuaveDesError
from suave_des.files import write_beside
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
    scenario_line,
)
from suave_des.knowledge.state import KnowledgeState
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
from suave_des.scenario.loader import load_scenario

#: Does something wrong in a folder, and reads it.
Wrong = Callable[[Path], object]


def told(wrong: Wrong, folder: Path) -> str:
    """The message, without the folder."""
    with pytest.raises(SuaveDesError) as caught:
        wrong(folder)
    return str(caught.value).replace(f"{folder}/", "").replace(str(folder), "FOLDER")


def then_read(change: Callable[[Path], object]) -> Wrong:
    def wrong(folder: Path) -> None:
        change(folder)
        read_mission(folder)

    return wrong


# The folder of a mission.


def in_table(name: str, change: Callable[[list[list[str]]], list[list[str]]]) -> Wrong:
    """Reads a mission with a table that was changed, and listed in mission.json."""

    def wrong(folder: Path) -> None:
        rows = [line.split(",") for line in (folder / name).read_text().splitlines()]
        text = "\n".join(",".join(row) for row in change(rows)) + "\n"
        write_beside(folder, {name: text})
        read_mission(folder)

    return wrong


def with_cell(line: int, column: str, text: str) -> Wrong:
    def change(rows: list[list[str]]) -> list[list[str]]:
        rows[line - 1][rows[0].index(column)] = text
        return rows

    return in_table(TRAJECTORY_FILE, change)


def mission_with(change: Callable[[dict], object]) -> Wrong:
    """Reads a mission whose mission.json was changed."""

    def wrong(folder: Path) -> None:
        content = json.loads((folder / MISSION_FILE).read_text())
        change(content)
        (folder / MISSION_FILE).write_text(json.dumps(content))
        read_mission(folder)

    return wrong


def mission_is(content: object) -> Wrong:
    return then_read(lambda folder: (folder / MISSION_FILE).write_text(json.dumps(content)))


def without(name: str) -> Wrong:
    return then_read(lambda folder: (folder / name).unlink())


def changed_afterwards(folder: Path) -> None:
    with (folder / KNOWLEDGE_FILE).open("a") as file:
        file.write("{}\n")
    read_mission(folder)


OF_A_MISSION: dict[str, tuple[Wrong, str]] = {
    "a word for a number": (with_cell(3, "x_m", "soon"), ""),
    "an infinite number": (with_cell(3, "t_s", "inf"), ""),
    "no place": (with_cell(3, "z_m", ""), ""),
    "a time before the last": (with_cell(3, "t_s", "100.0"), ""),
    "no rows": (in_table(EVENTS_FILE, lambda rows: rows[:1]), ""),
    "no column": (in_table(TRAJECTORY_FILE, lambda rows: [["x", *rows[0][2:]], *rows[1:]]), ""),
    "no table": (without(TRAJECTORY_FILE), ""),
    "no mission": (without(MISSION_FILE), ""),
    "no metric": (mission_with(lambda content: content["metrics"].pop("search_time_s")), ""),
    "a list": (mission_is([]), ""),
    "nothing": (mission_is({}), ""),
    "metrics that are none": (mission_is({"metrics": 1, "scenario": 2}), ""),
    "a scenario of another version": (
        mission_with(lambda content: content["scenario"].update(tide=1)),
        "",
    ),
    "changed afterwards": (changed_afterwards, ""),
}


@pytest.mark.parametrize(("wrong", "message"), OF_A_MISSION.values(), ids=OF_A_MISSION)
def test_what_is_wrong_in_the_folder_of_a_mission(folder, wrong, message):
    assert told(wrong, folder) == message


# States of knowledge.

STATE = KnowledgeRecord(1.0, KnowledgeState.of([], {}, {}, {}))


def half_a_line(folder: Path) -> None:
    (folder / KNOWLEDGE_FILE).write_text(knowledge_text([STATE]) + "{\n")
    read_knowledge(folder / KNOWLEDGE_FILE)


def no_such_state(folder: Path) -> None:
    line = json.loads(mission_line("metacontrol", 0, 1, [STATE]))
    line["cycles"][0][1] = 7
    head = scenario_line(load_scenario("seams2023").scenario)
    (folder / "states.jsonl").write_text(head + json.dumps(line) + "\n")
    list(read_missions(folder / "states.jsonl"))


# Results of campaigns.

OWN = "manager,search_time_s,distance_inspected_m"
FRAME = pandas.DataFrame(
    {"manager": ["none"], "search_time_s": [100], "distance_inspected_m": [2.0]}
)


def runs(text: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / RUNS_FILE).write_text(text)
        return folder / RUNS_FILE

    return write


ONE = runs(f"{OWN}\nnone,1,2\n")
TWO_SCENARIOS = runs(f"scenario,{OWN}\nsea,none,1,2\nlake,none,1,2\n")
TWICE = runs(f"scenario,{OWN},run,seed\nsea,none,100,2,1,1\nsea,none,90,2,1,1\n")


def unfinished(folder: Path) -> None:
    with closing(Store(folder / STORE_FILE)) as store:
        store.begin({})
    missions_in(folder)


# The store.

KEY = MissionKey(0, 0, 1)
CELLS = {"str": "sea", "int": 1, "float": 87.5, "bool": True}
ROW = tuple(CELLS[kind] for kind in COLUMN_TYPES.values())


def stored(read: Callable[[Store], object], row: tuple = ROW) -> Wrong:
    """Reads from a store with an outcome."""

    def wrong(folder: Path) -> None:
        with closing(Store(folder / STORE_FILE)) as store:
            store.begin({"identity": "one"})
            store.append([(KEY, row)])
            store.commit()
            read(store)

    return wrong


def outcomes(store: Store, problem: str = "") -> None:
    list(store.outcomes(lambda outcome: problem))


def after(statement: str, read: Callable[[Store], object]) -> Wrong:
    """Reads from a store that another program has changed."""

    def wrong(folder: Path) -> None:
        stored(lambda store: None)(folder)
        with closing(sqlite3.connect(folder / STORE_FILE)) as database, database:
            database.execute(statement)
        with closing(Store(folder / STORE_FILE)) as store:
            read(store)

    return wrong


def no_store(folder: Path) -> None:
    (folder / STORE_FILE).write_text("my notes " * 100)
    Store(folder / STORE_FILE)


def removed_meanwhile(folder: Path) -> None:
    with closing(Store(folder / STORE_FILE)) as store:
        store.begin({})
        (folder / STORE_FILE).unlink()
        store.commit()


def linked(folder: Path) -> None:
    (folder / "elsewhere").mkdir()
    (folder / SUAVE_FOLDER).symlink_to(folder / "elsewhere")
    with closing(Store(folder / STORE_FILE)) as store:
        tidy(store, is_new=True)


def manifest(text: str) -> Wrong:
    def wrong(folder: Path) -> None:
        (folder / MANIFEST_FILE).write_text(text)
        read_manifest(folder)

    return wrong


def of_another_campaign(folder: Path) -> None:
    stored(lambda store: None)(folder)
    manifest('{"campaign_sha256": "two"}')(folder)


OF_A_CAMPAIGN: dict[str, tuple[Wrong, str]] = {
    "half a line of knowledge": (half_a_line, ""),
    "a state that a table lacks": (no_such_state, ""),
    "a manager that is not there": (lambda folder: read_runs(ONE(folder)).choose(["bt"]), ""),
    "a column that is not there": (lambda folder: read_runs(ONE(folder), ["speed"]), ""),
    "two scenarios": (lambda folder: read_runs(TWO_SCENARIOS(folder)).check_simulated(), ""),
    "a folder twice": (lambda folder: missions_in([ONE(folder).parent, folder]), ""),
    "no results": (lambda folder: missions_in([]), ""),
    "an empty folder": (missions_in, ""),
    "a campaign without results": (unfinished, ""),
    "a mission twice": (lambda folder: missions_in(TWICE(folder)), ""),
    "a column that a frame lacks": (lambda folder: missions_of(FRAME[["manager"]]), ""),
    "a frame without rows": (lambda folder: missions_of(FRAME.iloc[:0]), ""),
    "a word in a frame": (lambda folder: missions_of(FRAME.assign(search_time_s="soon")), ""),
    "an outcome of another campaign": (
        stored(lambda store: outcomes(store, "it has run 2")),
        "",
    ),
    "a row of another form": (stored(outcomes, ROW[:3]), ""),
    "what was never noted": (stored(lambda store: store.about("request")), ""),
    "a store in use": (stored(lambda store: Store(store.path)), ""),
    "another outcome": (after("UPDATE outcomes SET content = '[1]'", outcomes), ""),
    "another note": (
        after("UPDATE about SET value = '\"two\"'", lambda store: store.about("identity")),
        "",
    ),
    "a store of another version": (after("PRAGMA user_version = 2", outcomes), ""),
    "no store": (no_store, ""),
    "a store removed meanwhile": (removed_meanwhile, ""),
    "a link": (linked, ""),
    "a manifest without a number": (
        manifest('{"missions": {"failed": 0, "left_out": 0}}'),
        "",
    ),
    "a manifest of another campaign": (of_another_campaign, ""),
}


@pytest.mark.parametrize(("wrong", "message"), OF_A_CAMPAIGN.values(), ids=OF_A_CAMPAIGN)
def test_what_is_wrong_in_results_of_a_campaign(tmp_path, wrong, message):
    assert told(wrong, tmp_path) == message
