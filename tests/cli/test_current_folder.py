"""What lies in the current folder is run only where a manager or a function of the user's is named
that is there.
"""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.command import command_here, python

MINE = "from suave_des import NoManager\n\n\nclass Mine(NoManager):\n    pass\n"
SHADOWS = ("cffi", "coverage", "cython", "numexpr", "pyarrow", "berkeleydb", "bottleneck")
"""Names of libraries that ours use if they are installed, and of numba's own."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return with_marks(tmp_path)


def with_marks(folder: Path) -> Path:
    """Fill a folder with files of which each that is run leaves a mark."""
    for name in SHADOWS:
        (folder / f"{name}.py").write_text(f"open('ran-{name}', 'w')\nraise ValueError\n")
    (folder / "stranger.py").write_text(f"open('ran-stranger', 'w')\n{MINE}")
    metadata = folder / "stranger-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Name: stranger\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text(
        "[suave_des.managers]\nstranger = stranger:Mine\n[numba_extensions]\ninit = stranger:Mine\n"
    )
    (folder / ".numba_config.yaml").write_text("cache_locator_classes: stranger.Mine\n")
    return folder


def marks(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("ran-*"))


OF_NONE = "campaign seams2023 --managers none --runs 1 --out out --quiet"
EACH = (
    "import sys\n"
    "from suave_des.entry import main\n"
    "for words in sys.argv[1:]:\n"
    "    sys.argv[1:] = words.split()\n"
    "    try:\n"
    "        main()\n"
    "    except SystemExit as ended:\n"
    "        assert not ended.code, words\n"
)
"""Runs several commands, which imports what they share once."""


def assert_runs_nothing_of(folder: Path, *command: str) -> None:
    done = python(*command, cwd=folder)
    assert (done.returncode, done.stderr, marks(folder)) == (0, "", [])


def test_nothing_of_it_is_run_where_nobody_names_it(folder):
    of_none = OF_NONE, "replay out", "compare out"
    others = "run seams2023 --manager metacontrol", "replay --scenario seams2023"
    assert_runs_nothing_of(folder, "-P", "-c", EACH, *of_none, *others)


def test_nothing_of_it_is_run_by_python_m_which_has_it_on_the_path(folder):
    assert_runs_nothing_of(folder, "-m", "suave_des", *OF_NONE.split())


def test_folders_named_like_libraries_are_not_taken_for_them(tmp_path):
    for name in ("coverage", "cffi"):
        (tmp_path / name).mkdir()
    done = python("-P", "-m", "suave_des", *OF_NONE.split(), cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_an_empty_part_of_the_path_is_not_this_folder(folder):
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


@pytest.fixture(scope="module", params=["1", pytest.param("2", marks=pytest.mark.slow)])
def named(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[subprocess.CompletedProcess[str], Path]:
    """A campaign with it, and the folder."""
    folder = with_marks(tmp_path_factory.mktemp("named"))
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
    asked = ["campaign", "seams2023", "--managers", "none,mine:Mine", "--runs", "2", "--quiet"]
    asked += ["--workers", request.param, "--out", "out"]
    return python("-P", "-m", "suave_des", *asked, cwd=folder), folder


class TestManagerThatIsNamed:
    def test_is_found_with_what_it_imports(self, named):
        ended, folder = named
        assert (ended.returncode, ended.stderr) == (0, "")
        assert {"ran-hook", "ran-mine"} <= set(marks(folder))

    def test_has_nothing_else_run(self, named):
        _, folder = named
        assert set(marks(folder)) <= {"ran-hook", "ran-mine"}

    def test_decides_with_what_it_imports_late_whether_the_campaign_can_be_resumed(self, named):
        _, folder = named
        resume = ("-P", "-m", "suave_des", "campaign", "--resume", "out")
        assert python(*resume, cwd=folder).returncode == 0
        (folder / "late.py").write_text("changed = True\n")
        changed = python(*resume, cwd=folder)
        assert changed.returncode == 2 and "late.py" in changed.stderr


def test_a_manager_named_like_a_module_of_python_is_told_which_file_was_imported(tmp_path):
    (tmp_path / "test.py").write_text(MINE)
    done = command_here("run", "seams2023", "--manager", "test:Mine", cwd=tmp_path)
    assert done.returncode == 2
    assert "not test.py in this folder (rename your file" in done.stderr


CAMPAIGN = "campaign: 1\nscenario: seams2023\nruns: 1\nmanagers: ['mine:Mine', 'exec:false']\n"
SCENARIO = "base: seams2023\nfunctions: {f_generate_search_path: {node: 'mine:Node'}}\n"


@pytest.fixture
def told_nothing_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("suave_des.user_code._told", set())


@pytest.mark.usefixtures("told_nothing_yet")
@pytest.mark.parametrize(
    ("text", "command", "told"),
    [
        (CAMPAIGN, ("campaign", "own.yaml", "--out", "out"),
         ["the command 'false'", "the code of mine:Mine (mine.py)"]),
        (SCENARIO, ("run", "own.yaml", "--manager", "none"), ["the code of mine:Node (mine.py)"]),
    ],
    ids=["campaign", "scenario"],
)  # fmt: skip
def test_code_that_a_file_names_is_told_before_it_is_run(tmp_path, caplog, text, command, told):
    (tmp_path / "mine.py").write_text(f"raise ValueError('mine is run')\n{MINE}")
    (tmp_path / "own.yaml").write_text(text)
    done = command_here(*command, cwd=tmp_path)
    assert caplog.messages == [f"note: own.yaml has {each} run" for each in told]
    assert "mine is run" in done.stderr


def test_code_that_the_user_names_is_run_without_a_word(tmp_path, caplog):
    (tmp_path / "mine.py").write_text(MINE)
    done = command_here("run", "seams2023", "--manager", "mine:Mine", cwd=tmp_path)
    assert (done.returncode, done.stderr, caplog.messages) == (0, "", [])
