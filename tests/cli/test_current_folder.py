"""What lies in the current folder is run only where a manager or a function of the user's is named
that is there.
"""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.command import python

MINE = "from suave_des import NoManager\n\n\nclass Mine(NoManager):\n    pass\n"
SHADOWS = ("cffi", "coverage", "cython", "numexpr", "pyarrow", "berkeleydb", "bottleneck")
"""Names of libraries that ours use if they are installed, and of numba's own."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder in which each file that is run leaves a mark."""
    for name in SHADOWS:
        (tmp_path / f"{name}.py").write_text(f"open('ran-{name}', 'w')\nraise ValueError\n")
    (tmp_path / "stranger.py").write_text(f"open('ran-stranger', 'w')\n{MINE}")
    metadata = tmp_path / "stranger-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Name: stranger\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text(
        "[suave_des.managers]\nstranger = stranger:Mine\n[numba_extensions]\ninit = stranger:Mine\n"
    )
    (tmp_path / ".numba_config.yaml").write_text("cache_locator_classes: stranger.Mine\n")
    return tmp_path


def marks(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("ran-*"))


OF_NONE = "campaign seams2023 --managers none --runs 1 --out out --quiet"


def assert_runs_nothing_of(folder: Path, *command: str) -> None:
    done = python(*command, cwd=folder)
    assert (done.returncode, done.stderr, marks(folder)) == (0, "", [])


def test_nothing_of_it_is_run_where_nobody_names_it(folder):
    commands = OF_NONE, "run seams2023 --manager metacontrol", "replay out", "compare out"
    for command in commands:
        assert_runs_nothing_of(folder, "-P", "-m", "suave_des", *command.split())


def test_nothing_of_it_is_run_by_python_m_which_has_it_on_the_path(folder):
    assert_runs_nothing_of(folder, "-m", "suave_des", *OF_NONE.split())


@pytest.mark.parametrize("name", ["coverage", "cffi"])
def test_a_folder_named_like_a_library_is_not_taken_for_it(tmp_path, name):
    (tmp_path / name).mkdir()
    command = ["campaign", "seams2023", "--managers", "none", "--runs", "1", "--out", "out"]
    done = python("-P", "-m", "suave_des", *command, "--quiet", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_an_empty_part_of_the_path_is_not_this_folder(folder):
    done = python("-P", "-m", "suave_des", "replay", "--scenario", "seams2023", cwd=folder)
    assert (done.returncode, marks(folder)) == (0, [])
    checkout = Path(__file__).parents[2]
    command = "import sys; from suave_des.entry import main; sys.argv[1:] = ['--version']; main()"
    shown = "import atexit, sys; atexit.register(lambda: print(sys.path)); "
    done = subprocess.run(
        [sys.executable, "-P", "-c", shown + command],
        env={"PYTHONPATH": f":{checkout}"},
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    assert repr(str(folder)) not in done.stdout and repr(str(checkout)) in done.stdout


@pytest.mark.parametrize("workers", ["1", pytest.param("2", marks=pytest.mark.slow)])
def test_a_manager_that_is_named_is_found_with_what_it_imports_and_libraries_are_not(
    folder, workers
):
    (folder / "mine.py").write_text(
        "import importlib\n\nfrom helping import Helping\n\nextra = importlib.import_module('extra')\n"
        "open('ran-mine', 'w')\n\n\nclass Mine(Helping):\n"
        "    def mission_started(self):\n        import late\n\n        open('ran-hook', 'w')\n"
    )
    (folder / "helping").mkdir()
    (folder / "helping" / "__init__.py").write_text(
        f"import beside_helping\n{MINE}Helping = Mine\n"
    )
    for name in ("extra", "late", "beside_helping"):
        (folder / f"{name}.py").write_text("")
    command = ["campaign", "seams2023", "--managers", "none,mine:Mine", "--runs", "2", "--quiet"]
    done = python(
        "-P", "-m", "suave_des", *command, "--workers", workers, "--out", "out", cwd=folder
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert marks(folder) == ["ran-hook", "ran-mine"]
    decides = python("-P", "-m", "suave_des", "campaign", "--resume", "out", cwd=folder)
    assert decides.returncode == 0
    (folder / "late.py").write_text("changed = True\n")
    changed = python("-P", "-m", "suave_des", "campaign", "--resume", "out", cwd=folder)
    assert changed.returncode == 2 and "late.py" in changed.stderr


def test_a_manager_named_like_a_module_of_python_is_told_which_file_was_imported(tmp_path):
    (tmp_path / "test.py").write_text(MINE)
    done = python(
        "-P", "-m", "suave_des", "run", "seams2023", "--manager", "test:Mine", cwd=tmp_path
    )
    assert done.returncode == 2
    assert "not test.py in this folder (rename your file" in done.stderr


CAMPAIGN = "campaign: 1\nscenario: seams2023\nruns: 1\nmanagers: ['mine:Mine', 'exec:false']\n"
FUNCTION = "base: seams2023\nfunctions: {f_generate_search_path: {node: 'mine:Node'}}\n"


def test_code_that_a_file_names_is_told_before_it_is_run(tmp_path):
    (tmp_path / "mine.py").write_text(f"raise ValueError('mine is run')\n{MINE}")
    (tmp_path / "c.yaml").write_text(CAMPAIGN)
    (tmp_path / "s.yaml").write_text(FUNCTION)
    done = python("-P", "-m", "suave_des", "campaign", "c.yaml", "--out", "out", cwd=tmp_path)
    first, second, last = done.stderr.splitlines()
    assert first == "note: c.yaml has the command 'false' run"
    assert second == "note: c.yaml has the code of mine:Mine (mine.py) run"
    assert "mine is run" in last
    done = python("-P", "-m", "suave_des", "run", "s.yaml", "--manager", "none", cwd=tmp_path)
    first, last = done.stderr.splitlines()
    assert first == "note: s.yaml has the code of mine:Node (mine.py) run"
    assert "mine is run" in last


def test_code_that_the_user_names_is_run_without_a_word(tmp_path):
    (tmp_path / "mine.py").write_text(MINE)
    done = python(
        "-P", "-m", "suave_des", "run", "seams2023", "--manager", "mine:Mine", cwd=tmp_path
    )
    assert (done.returncode, done.stderr) == (0, "")
