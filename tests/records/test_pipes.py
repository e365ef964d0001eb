"""A pipe in place of a result file is refused, and never waited for (tests/attacks tries all files and commands)."""

import os
from pathlib import Path

import pytest

from suave_des.campaign.campaign import run_campaign
from tests.helpers.command import command_here, ends_within


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
def test_a_pipe_is_refused(name: str, command: tuple[str, ...], tmp_path: Path) -> None:
    run_campaign("release15", ["none", "bt"], 1, 1, out=tmp_path / "out", suave_format=True)
    (tmp_path / "out" / name).unlink(missing_ok=True)
    os.mkfifo(tmp_path / "out" / name)
    with ends_within(60):
        done = command_here(*command, cwd=tmp_path / "out")
    assert done.returncode == 2
    assert "is not a regular file" in done.stderr
