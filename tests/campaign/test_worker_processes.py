"""How worker processes come to be: without the script that asked for them, and without compiling anew."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import suave_des
from benchmarks import chaos
from suave_des.campaign import machine_code
from suave_des.campaign.campaign import run_campaign
from suave_des.campaign.worker import StartWorker, workers_started
from suave_des.errors import InputError

GUARD = 'if __name__ == "__main__":\n    '
CALL = "print(run_campaign({scenario!r}, {managers}, runs=12, seed=1, workers={workers}).to_csv(index=False))\n"
MINE = "from suave_des.managing.simple import RandomManager\nclass Mine(RandomManager):\n    pass\n"


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "short.yaml"
    path.write_text(chaos.SHORT)
    return path


def run_script(text: str, folder: Path) -> subprocess.CompletedProcess[str]:
    (folder / "script.py").write_text("from suave_des import run_campaign\n" + text)
    path = os.pathsep.join([str(Path(suave_des.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, "script.py"],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        check=False,
    )


def call(scenario: Path, managers: list[str], workers: int) -> str:
    return CALL.format(scenario=str(scenario), managers=managers, workers=workers)


def test_a_script_needs_no_guard(scenario: Path, tmp_path: Path) -> None:
    shared = run_script(call(scenario, ["random", "none"], 2), tmp_path)
    assert (shared.returncode, shared.stderr) == (0, "")
    assert shared.stdout.count("\n") == 1 + 24 + 1
    assert run_script(call(scenario, ["random", "none"], 1), tmp_path).stdout == shared.stdout


def test_a_manager_that_the_script_defines_needs_one(scenario: Path, tmp_path: Path) -> None:
    managers = ["__main__:Mine"]
    alone = run_script(MINE + call(scenario, managers, 1), tmp_path)
    shared = run_script(MINE + GUARD + call(scenario, managers, 2), tmp_path)
    assert (shared.returncode, shared.stderr) == (0, "")
    assert alone.stdout == shared.stdout
    without = run_script(MINE + call(scenario, managers, 2), tmp_path)
    assert without.returncode == 1
    last = without.stderr.splitlines()[-1]
    assert "worker processes in a row ended before a mission was done" in last
    assert 'into a module of its own, or the campaign under `if __name__ == "__main__":`' in last


def test_the_process_that_calls_does_not_load_the_compiler(
    scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path / "cache"))  # nothing is known to be compiled
    look = "import sys\nprint('numba' in sys.modules)\n"
    for workers, loaded in ((2, "False"), (1, "True")):
        done = run_script(call(scenario, ["random", "bt"], workers) + look, tmp_path)
        assert done.stdout.splitlines()[-1] == loaded, done.stderr


def test_what_is_compiled_is_what_decides_the_note_of_it() -> None:
    package = Path(suave_des.__file__).parent
    with_loops = [path for path in package.rglob("*.py") if "\n@compiled\n" in path.read_text()]
    assert sorted(path.relative_to(package).as_posix() for path in with_loops) == sorted(machine_code.COMPILED_MODULES)


def test_machine_code_is_noted_once_it_is_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path))
    assert not machine_code.is_stored()
    machine_code.note_stored()
    assert machine_code.is_stored()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "elsewhere"))
    assert not machine_code.is_stored()


def test_where_nothing_can_be_kept_missions_run_all_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path / "file"))
    machine_code.note_stored()
    assert not machine_code.is_stored()


def test_a_cache_folder_that_may_not_be_entered_is_as_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUAVE_DES_CACHE_DIR", str(tmp_path))

    def refused(path: Path) -> bool:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "exists", refused)
    machine_code.note_stored()
    assert not machine_code.is_stored()


def test_workers_started_ahead_are_used_and_those_too_many_ended(scenario: Path) -> None:
    with workers_started(3, StartWorker(needs_script=False)) as ready:
        processes = [worker.process for worker in ready]
        assert all(process.is_alive() for process in processes)
        result = run_campaign(scenario, ["none"], 4, seed=1, workers=2, ready=ready)
        assert result.done == 4
        assert [process.exitcode for process in processes] == [0, 0, -9]


def test_workers_started_ahead_end_when_the_input_is_bad(scenario: Path) -> None:
    with pytest.raises(InputError, match="runs"), workers_started(2, StartWorker(needs_script=False)) as ready:
        processes = [worker.process for worker in ready]
        run_campaign(scenario, ["none"], 0, seed=1, workers=2, ready=ready)
    assert [process.exitcode for process in processes] == [-9, -9]


WRITER = """
import os
from suave_des.managing.simple import NoManager
FILE = open(f"written_{os.getpid()}.txt", "w")
class Writer(NoManager):
    def __init__(self, system):
        super().__init__(system)
        print("a mission", file=FILE)
"""


def test_what_a_manager_has_written_is_there_when_workers_have_ended(scenario: Path, tmp_path: Path) -> None:
    (tmp_path / "writer.py").write_text(WRITER)
    done = run_script(call(scenario, ["writer:Writer"], 2), tmp_path)
    assert done.returncode == 0, done.stderr
    assert sum(path.read_text().count("a mission") for path in tmp_path.glob("written_*.txt")) == 12
