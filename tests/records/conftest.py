from collections.abc import Callable
from pathlib import Path

import pytest

from suave_des import Mission, load_scenario
from suave_des.files import write_files
from suave_des.metrics.result import MissionResult
from suave_des.records.mission_folder import mission_files
from suave_des.scenario.loader import LoadedScenario


@pytest.fixture(scope="session")
def loaded() -> LoadedScenario:
    return load_scenario("seams2023")


@pytest.fixture(scope="session")
def result() -> MissionResult:
    """A mission of metacontrol that was recorded."""
    return Mission("seams2023", "metacontrol", run=1, seed=8, record=True).result()


@pytest.fixture
def folder(result: MissionResult, loaded: LoadedScenario, tmp_path: Path) -> Path:
    """The folder of that mission."""
    write_files(tmp_path, mission_files(result, loaded, {"own.py": "abc"}, ("run",)))
    return tmp_path


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str, str], Path]:
    """Writes a file in a fresh folder."""

    def write_file(name: str, content: str) -> Path:
        (tmp_path / name).write_text(content, encoding="utf-8")
        return tmp_path / name

    return write_file
