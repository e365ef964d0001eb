"""Files of results that are damaged or forged anywhere: every command that reads them ends in one
line, or reads what is whole.
"""

import json
import math
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from suave_des.api import run_mission
from suave_des.campaign.campaign import run_campaign
from suave_des.errors import SuaveDesError
from suave_des.files import LISTED
from suave_des.kb.states import recorded_missions
from suave_des.pages.page import data_text
from suave_des.pages.replay import mission_on_page
from suave_des.records.mission_folder import read_mission
from suave_des.records.missions import read_missions
from suave_des.records.store import read_manifest
from suave_des.results.compare import compare_groups
from suave_des.results.groups import grouped
from suave_des.results.mission import adaptations, draw_map

ODD: st.SearchStrategy[Any] = st.one_of(
    st.sampled_from([None, True, 0, -1, 2**70, 10**30, 1e300, math.nan, math.inf]),
    st.sampled_from(["", "x", "\ud800", "\0", "1e400", [], {}, [[]], {"a": 1}, [1, "x"]]),
    st.text(max_size=3),
    st.floats(),
    st.integers(),
)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    run_mission("seams2023", "metacontrol", seed=8, out=folder / "mission")
    run_campaign(
        "seams2023", ["none", "metacontrol"], 2, 1, out=folder / "campaign", record_knowledge=True
    )
    return folder


def places(content: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the key paths of all values in plain data, of lists only the first two entries'."""
    entries = []
    if isinstance(content, dict):
        entries = list(content.items())
    elif isinstance(content, list):
        entries = list(enumerate(content))[:2]
    return [path, *(each for key, value in entries for each in places(value, (*path, key)))]


def with_value(content: Any, path: tuple[Any, ...], value: Any) -> Any:
    if not path:
        return value
    changed = json.loads(json.dumps(content))
    here = changed
    for key in path[:-1]:
        here = here[key]
    here[path[-1]] = value
    return changed


def read_as_commands_do(folder: Path, name: str) -> None:
    """Read the mission, or the campaign, that has a file, as the commands do that show them."""
    part = name.partition("/")[0]
    reads_whole = {"mission": _read_mission, "campaign": _read_campaign}[part]
    for reads in (reads_whole, _read_states):
        try:
            reads(folder / part)
        except SuaveDesError as error:
            assert len(str(error).splitlines()) == 1


def _read_mission(folder: Path) -> None:
    mission = read_mission(folder)
    adaptations(mission)
    draw_map(mission)
    data_text(mission_on_page(mission))


def _read_states(folder: Path) -> None:
    for _, mission in recorded_missions(folder):
        assert all(isinstance(record.t_s, float) for record in mission.records)


def _read_campaign(folder: Path) -> None:
    read_manifest(folder)
    compare_groups(grouped(read_missions([folder])))


JSON_FILES = (
    *("mission/mission.json", "mission/knowledge.jsonl"),
    *("campaign/manifest.json", "campaign/knowledge_states.jsonl"),
)


@pytest.mark.parametrize("name", JSON_FILES)
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_value_of_a_json_file_that_is_another(results, tmp_path, name, data):
    folder = tmp_path / "copy"
    shutil.copytree(results, folder, dirs_exist_ok=True)
    file = folder / name
    lines = [file.read_text()] if name.endswith(".json") else file.read_text().splitlines()
    number = data.draw(st.integers(0, len(lines) - 1))
    content = json.loads(lines[number])
    if isinstance(content, dict):
        content.pop(LISTED, None)
    place = data.draw(st.sampled_from(places(content)))
    lines[number] = json.dumps(with_value(content, place, data.draw(ODD)))
    file.write_text("\n".join(lines) + "\n")
    if "knowledge.jsonl" in name:
        forget_hashes(folder)
    read_as_commands_do(folder, name)


@pytest.mark.parametrize(
    "name", ["mission/events.csv", "mission/trajectory.csv", "campaign/runs.csv"]
)
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_cell_of_a_table_that_is_another(results, tmp_path, name, data):
    folder = tmp_path / "copy"
    shutil.copytree(results, folder, dirs_exist_ok=True)
    file = folder / name
    lines = file.read_text().splitlines()
    number = data.draw(st.integers(0, len(lines) - 1))
    cells = lines[number].split(",")
    at = data.draw(st.integers(0, len(cells) - 1))
    cells[at] = str(data.draw(ODD)).replace(",", ";")
    lines[number] = ",".join(cells)
    file.write_bytes(("\n".join(lines) + "\n").encode(errors="surrogatepass"))
    forget_hashes(folder)
    read_as_commands_do(folder, name)


def forget_hashes(folder: Path) -> None:
    """Forge the list of files, too: without it only whole files are read."""
    file = folder / "mission" / "mission.json"
    content = json.loads(file.read_text())
    content.pop(LISTED, None)
    file.write_text(json.dumps(content))


@pytest.mark.parametrize("name", [*JSON_FILES, "mission/trajectory.csv", "campaign/runs.csv"])
@pytest.mark.parametrize(
    "content",
    [b"", b"\xff\xfe", b"[" * 100_000, b"Infinity", b"1e400", b'"\\ud800"', b"9" * 5000, b"\0"],
    ids=["empty", "bytes", "brackets", "inf", "large", "surrogate", "digits", "nul"],
)
def test_a_file_of_something_else(results, tmp_path, name, content):
    folder = tmp_path / "copy"
    shutil.copytree(results, folder)
    (folder / name).write_bytes(content)
    read_as_commands_do(folder, name)


def test_a_half_of_a_surrogate_pair_is_no_manager(results, tmp_path):
    """Fonts and files have none: it would end in an error of matplotlib's."""
    folder = tmp_path / "copy"
    shutil.copytree(results / "mission", folder)
    file = folder / "mission.json"
    content = json.loads(file.read_text())
    content["metrics"]["manager"] = "\ud800x"
    file.write_text(json.dumps(content))
    with pytest.raises(SuaveDesError, match=r"mission\.json: metrics\.manager: "):
        read_mission(folder)
