"""Whatever stands in place of a file or number: one line that says where and what, status 2, nothing half-written."""

from __future__ import annotations

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


def _ten_times(alias: int, name: int) -> bytes:
    return b"%c: &%c [%s]\n" % (name, name, b",".join([b"*%c" % alias] * 10))


@pytest.fixture(autouse=True)
def _awkward_files(tmp_path: Path) -> None:
    contents = {
        "latin.txt": b"base: seams2023.yaml\ndescription: caf\xe9\n",
        "utf16.txt": "base: seams2023.yaml\n".encode("utf-16"),
        "empty.txt": b"",
        "nul.txt": b"\0\0\0",
        "list.txt": b"- a\n- b\n",
        "tab.txt": b"base: seams2023.yaml\n\tmission: 3\n",
        "underscore.txt": b"base: seams2023.yaml\nmission: {time_limit_s: 1_000}\n",
        "twice.txt": b"base: seams2023.yaml\r\nmission:\r\n  time_limit_s: 1e2\r\n  time_limit_s: 3\r\n",
        "big.txt": b"#" * 2_000_000,
        "bomb.txt": b"a: &a [x,x,x,x,x,x,x,x,x,x]\n" + b"".join(map(_ten_times, b"abcd", b"bcde")),
        "tag.txt": b'base: !!python/object/apply:os.system ["touch pwned"]\n',
        "file": b"",
    }
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "dangling").symlink_to("nowhere")
    os.mkfifo(tmp_path / "pipe")


def assert_refused(command: Command, tmp_path: Path, arguments: tuple[str, ...], *words: str) -> None:
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
        ("utf16.txt", ("utf16.txt: line 1: is not UTF-8 text",)),
        ("empty.txt", ("empty.txt: line 1: is empty",)),
        ("nul.txt", ("nul.txt: line 1: holds ",)),
        ("list.txt", ("list.txt: line 1: is not a mapping",)),
        ("tab.txt", ("tab.txt: line 2: is not valid YAML", "spaces, not tabs")),
        ("underscore.txt", ("underscore.txt: line 2, mission.time_limit_s: '1_000' should be a number",)),
        ("twice.txt", ("twice.txt: line 4, mission.time_limit_s: the key", "first in line 3")),
        ("big.txt", ("big.txt: is larger than 1,000,000 bytes",)),
        ("bomb.txt", ("bomb.txt: line 5, e: expands to more than 100,000 values",)),
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
def test_in_place_of_a_scenario(command: Command, tmp_path: Path, name: str, words: tuple[str, ...]) -> None:
    assert_refused(command, tmp_path, ("run", name, "--manager", "none", "--out", "out"), *words)
    assert_refused(command, tmp_path, ("campaign", name, *CAMPAIGN[2:], "--out", "out"), *words)


@pytest.mark.parametrize("name", ["latin.txt", "empty.txt", "nul.txt", "folder", "pipe", "loop", LONG])
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
def test_in_place_of_another_file(command: Command, tmp_path: Path, arguments: tuple[str, ...], name: str) -> None:
    if "--rules" in arguments and name == "empty.txt":
        pytest.skip("a file without rules is one")
    assert_refused(command, tmp_path, (*arguments, name), name[:100])


@pytest.mark.parametrize(
    "arguments",
    # Where a command would show progress after some seconds, --quiet leaves the error alone in any time.
    [RUN, (*CAMPAIGN, "--quiet"), ("reproduce", "--runs=1", "--quiet"), ("validate", "--runs=1", "--quiet")],
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
    ],
)
def test_in_place_of_an_output_folder(
    command: Command, tmp_path: Path, arguments: tuple[str, ...], out: str, words: str
) -> None:
    assert_refused(command, tmp_path, (*arguments, "--out", out), words)


def test_an_output_folder_that_may_not_be_written(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A superuser may write everywhere.
    monkeypatch.setattr(os, "access", lambda path, mode: not mode & os.W_OK)
    words = "folder: the output folder cannot be written"
    for arguments in (RUN, CAMPAIGN):
        assert_refused(command, tmp_path, (*arguments, "--out", "folder"), words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((*RUN, "--seed", "-1"), "seed: -1 is out of range (give 0 to 9223372036854775807)"),
        ((*RUN, "--seed", HUGE), "is out of range"),
        ((*RUN, "--run", HUGE), "run: "),
        ((*RUN, "--run", "-3"), "run: -3 is out of range (give 1 to 1000000)"),
        ((*CAMPAIGN, "--seed", "-1", "--out", "out"), "seed: -1 "),
        ((*CAMPAIGN, "--runs", HUGE, "--out", "out"), "runs: "),
        ((*CAMPAIGN, "--runs", "1e2", "--out", "out"), "--runs"),
        ((*CAMPAIGN, "--time-out", "nan", "--out", "out"), "time_out_s: .nan "),
        ((*RUN, "--manager", ":"), "manager ':'"),
        ((*RUN, "--manager", "no.such.module:Class"), "no.such.module:Class"),
        (("campaign", "--resume", "folder"), "there is no campaign in it"),
        (("campaign", "--resume", "file"), "there is no campaign in it"),
        (("schema", "extra"), "extra"),
        (("figure", "file", "--out", "m.png"), "file: line 1: has no column 'manager'"),
    ],
)
def test_in_place_of_a_number_or_a_name(
    command: Command, tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    assert_refused(command, tmp_path, arguments, words)


@pytest.mark.parametrize(
    "text",
    [
        b"base: seams2023.yaml\r\nmission:\r\n  time_limit_s: 1e1\r\n",
        b"\xef\xbb\xbfbase: seams2023.yaml\nmission: {time_limit_s: 1E1}\n",
    ],
)
def test_windows_line_ends_a_byte_order_mark_and_scientific_notation_are_fine(
    command: Command, tmp_path: Path, text: bytes
) -> None:
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

    def test_damaged_files_are_named_with_line(self, command: Command, results: Path) -> None:
        mission, runs = results / "mission", results / "campaign" / "runs.csv"
        damages: list[tuple[Path, Callable[[str], str], str]] = [
            (mission / "trajectory.csv", lambda text: "", "trajectory.csv: cannot be read"),
            (
                mission / "trajectory.csv",
                lambda text: text.replace("\n0.2,", "\nsoon,"),
                "line 3: t_s: expected a finite number, got 'soon'",
            ),
            (
                mission / "trajectory.csv",
                lambda text: text.replace("\n0.2,", "\ninf,"),
                "line 3: t_s: expected a finite number, got 'inf'",
            ),
            (
                mission / "events.csv",
                lambda text: text.replace("\n0.0,", "\nsoon,", 1),
                "line 2: t_s: expected a finite number, got 'soon'",
            ),
            (mission / "mission.json", lambda text: "{", "mission.json: is not JSON"),
            (
                mission / "mission.json",
                lambda text: '{"metrics": {}, "scenario": {}}',
                "mission.json: is not the record",
            ),
            (mission / "mission.json", lambda text: text.replace('"seed"', '"sed"', 1), "seed is missing"),
            (runs, lambda text: "", "runs.csv: line 1: has no column"),
            (runs, lambda text: text.splitlines()[0] + "\n", "has no missions"),
            (runs, lambda text: text.replace("True", "maybe"), "line 2: pipeline_found: expected True or"),
            (runs, lambda text: text.replace(",none,", ",,"), "line 2: manager: expected a manager's name, got ''"),
        ]
        for path, damage, words in damages:
            whole = path.read_text()
            path.write_text(damage(whole))
            assert_refused(command, results, ("figure", path.parent.name, "--out", "m.png"), words)
            path.write_text(whole)

    @pytest.mark.parametrize("out", ["no/where.png", "file/m.png", "/proc/m.png", f"{LONG[:300]}.png", "folder.png"])
    def test_a_picture_that_cannot_be_written(self, command: Command, results: Path, out: str) -> None:
        (results / "folder.png").mkdir()
        assert_refused(command, results, ("figure", "campaign", "--out", out), "cannot be written: ")

    @pytest.mark.parametrize("out", ["m", "m.xyz", ""])
    def test_a_name_that_is_no_pictures(self, command: Command, results: Path, out: str) -> None:
        assert_refused(command, results, ("figure", "campaign", "--out", out), "expected a picture")
