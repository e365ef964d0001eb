"""A pipe in place of a file in a folder of results is refused or not waited for: nobody writes into
it.
"""

import os
import shutil
from pathlib import Path

import pytest

from suave_des import run_mission
from suave_des.campaign.campaign import run_campaign
from tests.helpers.command import command_here, ends_within

STORE = "campaign.sqlite"
OF_CAMPAIGN = (
    "runs.csv",
    "manifest.json",
    "knowledge_states.jsonl",
    STORE,
    f"{STORE}-wal",
    f"{STORE}-journal",
)
OF_MISSION = ("mission.json", "events.csv", "trajectory.csv", "knowledge.jsonl")
CAMPAIGN = (
    ("compare", "out"),
    ("figure", "out", "--out", "x.png"),
    ("report", "out"),
    ("replay", "out"),
    ("campaign", "--resume", "out", "--runs", "2"),
    ("kb", "try", "rule.swrl", "--on", "out"),
)
MISSION = (
    ("figure", "out", "--out", "x.png"),
    ("replay", "out"),
    ("kb", "try", "rule.swrl", "--on", "out"),
)


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("folders")
    run_campaign("seams2023", ["metacontrol"], 1, 1, out=folder / "campaign", record_knowledge=True)
    run_mission("seams2023", "metacontrol", out=folder / "mission")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "names", "commands"),
    [("campaign", OF_CAMPAIGN, CAMPAIGN), ("mission", OF_MISSION, MISSION)],
)
def test_no_command_waits_for_it(kind, names, commands, folders, tmp_path):
    (tmp_path / "rule.swrl").write_text('Late: c_status(?c, "FALSE") -> c_status(?c, "FALSE")\n')
    for name in names:
        out = tmp_path / "out"
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(folders / kind, out)
        (out / name).unlink(missing_ok=True)
        os.mkfifo(out / name)
        for command in commands:
            with ends_within(30):
                done = command_here(*command, cwd=tmp_path)
            assert done.returncode in (0, 2), (name, command, done.stderr)
            assert done.returncode == 0 or done.stderr.count("\n") == 1, (
                name,
                command,
                done.stderr,
            )


@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("runs.csv", ("compare", ".")),
        ("manifest.json", ("report", ".", "--paths", "0")),
        ("runs.csv", ("validate", "--runs-file", "runs.csv")),
        ("suave/bt_suave.csv", ("compare", "suave")),
        ("suave/other.csv", ("compare", "suave")),
        ("suave/other.csv", ("validate", "--data", "suave/other.csv")),
    ],
)
def test_a_pipe_is_refused(name, command, tmp_path):
    run_campaign("release15", ["none", "bt"], 1, 1, out=tmp_path / "out", suave_format=True)
    (tmp_path / "out" / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / "out" / name)
    with ends_within(60):
        done = command_here(*command, cwd=tmp_path / "out")
    assert done.returncode == 2
    assert "is not a regular file" in done.stderr
