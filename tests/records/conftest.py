"""What the tests of `records` share: the folder of a recorded mission, and changes of its files."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from suave_des import Mission, load_scenario
from suave_des.files import write_beside, write_files
from suave_des.metrics.result import MissionResult
from suave_des.records.mission_folder import mission_files
from suave_des.scenario.loader import LoadedScenario


@pytest.fixture(scope="session")
def loaded() -> LoadedScenario:
    return load_scenario("seams2023")


@pytest.fixture(scope="session")
def recorded() -> MissionResult:
    """A mission of metacontrol that was recorded."""
    return Mission("seams2023", "metacontrol", run=1, seed=8, record=True).result()


@pytest.fixture(scope="session")
def _written(recorded, loaded, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("mission")
    write_files(folder, mission_files(recorded, loaded, {"own.py": "abc"}, ("run",)))
    return folder


@pytest.fixture
def folder(_written: Path, tmp_path: Path) -> Path:
    """A folder with the mission's files, which the test may change."""
    return shutil.copytree(_written, tmp_path, dirs_exist_ok=True)


@pytest.fixture(scope="session")
def rewrite() -> Callable[[Path, str], None]:
    """Writes a file of a mission's folder and lists it in mission.json, as a mission would have."""
    return lambda path, text: write_beside(path.parent, {path.name: text})


@pytest.fixture(scope="session")
def replace_cell(rewrite) -> Callable[[Path, int, str, str], None]:
    """Writes a CSV file of such a folder with another text in a cell."""

    def replace(path: Path, line: int, column: str, text: str) -> None:
        lines = path.read_text().splitlines()
        cells = lines[line - 1].split(",")
        cells[lines[0].split(",").index(column)] = text
        lines[line - 1] = ",".join(cells)
        rewrite(path, "\n".join(lines) + "\n")

    return replace
