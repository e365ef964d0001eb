"""Whatever stands in place of a file or number: one line that says where and what, status 2,
nothing half-written.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

LONG = "y" * 5000
RUN = ("run", "seams2023", "--manager", "none")
CAMPAIGN = ("campaign", "seams2023", "--managers", "none", "--workers", "1", "--runs", "1")
HUGE = "9" * 30

Command = Callable[..., Any]


@pytest.fixture(autouse=True)
def _awkward_files(tmp_path: Path) -> None:
    contents = {
        "latin.txt": b"base: seams2023.yaml\ndescription: caf\xe9\n",
        "empty.txt": b"",
        "nul.txt": b"\0\0\0",
        "tab.txt": b"base: seams2023.yaml\n\tmission: 3\n",
        "tag.txt": b'base: !!python/object/apply:os.system ["touch pwned"]\n',
        "file": b"",
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / "folder").mkdir()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "runs.csv").write_text("mine")
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "dangling").symlink_to("nowhere")
    os.mkfifo(tmp_path / "pipe")


def assert_refused(
    command: Command, tmp_path: Path, arguments: tuple[str, ...], *words: str
) -> None:
    before = sorted(path.name for path in tmp_path.rglob("*"))
    status, out, error = command(*arguments)
    assert (status, out) == (2, "")
    assert error.startswith("suave-des: ")
    assert error.count("\n") == 1
    assert len(error) < 700
    for word in words:
        assert word in error
    assert sorted(path.name for path in tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("latin.txt", ("latin.txt: line 2: is not UTF-8 text", "save it as UTF-8")),
        ("empty.txt", ("empty.txt: line 1: is empty",)),
        ("nul.txt", ("nul.txt: line 1: holds ",)),
        ("tab.txt", ("tab.txt: line 2: is not valid YAML", "spaces, not tabs")),
        ("tag.txt", ("tag.txt: line 1, base: the tag", "is not allowed")),
        ("folder", ("folder: is a folder",)),
        ("loop", ("loop: ",)),
        ("dangling", ("dangling: no such file",)),
        ("pipe", ("pipe: is not a regular file",)),
        ("/dev/zero", ("/dev/zero: is not a regular file",)),
        (LONG, ("y...: no such file",)),
        ("", ("is a folder",)),
    ],
)
def test_in_place_of_a_scenario(command, tmp_path, name, words):
    assert_refused(command, tmp_path, ("run", name, "--manager", "none", "--out", "out"), *words)
    assert_refused(command, tmp_path, ("campaign", name, *CAMPAIGN[2:], "--out", "out"), *words)


@pytest.mark.parametrize(
    "name", ["latin.txt", "empty.txt", "nul.txt", "folder", "pipe", "loop", LONG]
)
@pytest.mark.parametrize(
    "arguments",
    [
        (*RUN, "--out", "out", "--modes"),
        (*RUN, "--out", "out", "--ontology"),
        ("run", "seams2023", "--out", "out", "--rules"),
        ("reproduce", "--runs", "1", "--workers", "1", "--ontology"),
        ("validate", "--runs", "1", "--out", "out", "--targets"),
        ("validate", "--data"),
        ("validate", "--runs-file"),
        ("kb", "infer", "--at"),
        ("kb", "rules", "--ontology"),
    ],
    ids=" ".join,
)
def test_in_place_of_another_file(command, tmp_path, arguments, name):
    if "--rules" in arguments and name == "empty.txt":
        pytest.skip("a file without rules is one")
    assert_refused(command, tmp_path, (*arguments, name), name[:100])


@pytest.mark.parametrize(
    "arguments",
    # Where a command would show progress after some seconds, --quiet leaves the error alone in any
    # time.
    [
        RUN,
        (*CAMPAIGN, "--quiet"),
        ("reproduce", "--runs=1", "--quiet"),
        ("validate", "--runs=1", "--quiet"),
    ],
    ids=" ".join,
)
@pytest.mark.parametrize(
    ("out", "words"),
    [
        ("no/such/parent", "there is no folder no/such to make it in"),
        ("file", "is not a folder"),
        ("file/out", "there is no folder file"),
        ("dangling", "is not a folder"),
        ("loop", "loop: "),
        ("/proc/out", "cannot be written"),
        (LONG, "y...: the output folder cannot be written"),
        ("", "not empty"),
        ("mine", "runs.csv"),
    ],
)
def test_in_place_of_an_output_folder(command, tmp_path, arguments, out, words):
    assert_refused(command, tmp_path, (*arguments, "--out", out), words)


def test_an_output_folder_that_may_not_be_written(command, tmp_path, monkeypatch):
    # A superuser may write everywhere.
    monkeypatch.setattr(os, "access", lambda path, mode: not mode & os.W_OK)
    words = "folder: the output folder cannot be written"
    for arguments in (RUN, CAMPAIGN):
        assert_refused(command, tmp_path, (*arguments, "--out", "folder"), words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((*RUN, "--seed", "-1"), "seed: -1 is out of range (give 0 to 9223372036854775807)"),
        ((*RUN, "--run", HUGE), "run: "),
        ((*RUN, "--manager", ":"), "manager ':'"),
        ((*RUN, "--manager", "no.such.module:Class"), "no.such.module:Class"),
        ((*RUN, "--manager", "rondom"), "did you mean random?"),
        ((*RUN, "--manager", "os:path"), "os"),
        ((*RUN, "--reasoner", "hermit"), "hermit"),
        ((*RUN, "--mangager", "none"), "--mangager"),
        ((*CAMPAIGN, "--runs", HUGE, "--out", "out"), "runs: "),
        ((*CAMPAIGN, "--runs", "0", "--out", "out"), "runs: 0 "),
        ((*CAMPAIGN, "--runs", "1e2", "--out", "out"), "--runs"),
        ((*CAMPAIGN, "--workers", "0", "--out", "out"), "workers: 0 "),
        ((*CAMPAIGN, "--time-out", "nan", "--out", "out"), "time_out_s: .nan "),
        ((*CAMPAIGN, "--managers", "", "--out", "out"), "managers: "),
        ((*CAMPAIGN, "--managers", "none,none", "--out", "out"), "twice"),
        ((*CAMPAIGN, "--format", "excel", "--out", "out"), "--format"),
        ((*CAMPAIGN,), "--out DIR is missing"),
        (("campaign", "--out", "out"), "SCENARIO is missing"),
        ((*CAMPAIGN, "--managers", "none", "bt", "--out", "o"), "names have commas between them"),
        (("campaign", "--resume", "out", "--seed", "0"), "--seed cannot be used with --resume"),
        (("campaign", "seams2023", "--resume", "out"), "SCENARIO cannot be used with --resume"),
        (("campain",), "Did you mean 'campaign'?"),
        (("figure", "nothing", "--out", "map.png"), "nothing: no such file"),
        (("campaign", "--resume", "folder"), "there is no campaign in it"),
        (("campaign", "--resume", "file"), "there is no campaign in it"),
        (("schema", "extra"), "extra"),
        (
            (
                "kb",
                "test",
                "--coverage",
                "--write",
                "new.yaml",
                "--set",
                "knowledge.reasoner=pellet",
            ),
            "name it with --scenario",
        ),
        (("kb", "check", "--rules", "pipe"), "is not a regular file"),
        (("kb", "check", "--ontology", "pipe"), "is not a regular file"),
        (("figure", "file", "--out", "m.png"), "file: line 1: has no column 'manager'"),
    ],
)
def test_in_place_of_a_number_or_a_name(command, tmp_path, arguments, words):
    assert_refused(command, tmp_path, arguments, words)


@pytest.mark.parametrize(
    "text",
    [
        b"base: seams2023.yaml\r\nmission:\r\n  time_limit_s: 10\r\n",
        b"\xef\xbb\xbfbase: seams2023.yaml\nmission: {time_limit_s: 10}\n",
        b"base: seams2023.yaml\nmission: {time_limit_s: 1e1}\n",
        b"base: seams2023.yaml\nmission: {time_limit_s: 1E1}\n",
    ],
    ids=["line ends of Windows", "byte order mark", "scientific", "scientific in capitals"],
)
def test_a_scenario_may_be_written_as_editors_do(command, tmp_path, text):
    (tmp_path / "fine.yaml").write_bytes(text)
    status, out, error = command("run", "fine.yaml", "--manager", "none")
    assert (status, error) == (0, "")
    assert "mission duration    10." in out


class TestFigure:
    @pytest.fixture
    def results(self, command: Command, tmp_path: Path) -> Path:
        assert command(*RUN, "--out", "mission")[0] == 0
        assert command(*CAMPAIGN, "--out", "campaign")[0] == 0
        return tmp_path

    def test_damaged_files_are_named_with_line(self, command, results):
        mission, runs = results / "mission", results / "campaign" / "runs.csv"
        damages: list[tuple[Path, Callable[[str], str], str]] = [
            (mission / "trajectory.csv", lambda text: "", "trajectory.csv: t_s is missing"),
            (
                mission / "trajectory.csv",
                lambda text: text.replace("\n0.2,", "\ninf,"),
                "line 3: t_s: expected a",
            ),
            (
                mission / "events.csv",
                lambda text: text.replace("\n0.0,", "\nsoon,", 1),
                "line 2: t_s: expected a",
            ),
            (mission / "mission.json", lambda text: "{", "mission.json: is not JSON"),
            (
                mission / "mission.json",
                lambda text: '{"metrics": {}, "scenario": {}}',
                "mission.json: metrics.scenario: is missing",
            ),
            (
                mission / "mission.json",
                lambda text: text.replace('"seed"', '"sed"', 1),
                "metrics.seed: is missing",
            ),
            (runs, lambda text: "", "runs.csv: line 1: has no column"),
            (runs, lambda text: text.splitlines()[0] + "\n", "has no missions"),
            (
                runs,
                lambda text: text.replace("True", "maybe"),
                "line 2: pipeline_found: expected True or",
            ),
            (
                runs,
                lambda text: text.replace(",none,", ",,"),
                "line 2: manager: expected a manager's name, got ''",
            ),
        ]
        for path, damage, words in damages:
            whole = path.read_text()
            path.write_text(damage(whole))
            assert_refused(command, results, ("figure", path.parent.name, "--out", "m.png"), words)
            path.write_text(whole)

    @pytest.mark.parametrize(
        "out", ["no/where.png", "file/m.png", "/proc/m.png", f"{LONG[:300]}.png", "folder.png"]
    )
    def test_a_picture_that_cannot_be_written(self, command, results, out):
        (results / "folder.png").mkdir()
        assert_refused(
            command, results, ("figure", "campaign", "--out", out), "cannot be written: "
        )
