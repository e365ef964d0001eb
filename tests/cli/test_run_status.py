"""A mission that takes long says how far it is on a terminal, and nothing elsewhere."""

import io
import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

import suave_des
from suave_des.campaign.single import run_recorded
from suave_des.cli.console import mission_status
from tests.helpers.command import command_here

SLOW = """
import os, time
from suave_des.managing.simple import NoManager

class Slow(NoManager):
    def task_requested(self, task):
        super().task_requested(task)
        self.system.env.process(self.think())

    def think(self):
        for _ in range(3):
            yield self.system.env.timeout(50.0)
            time.sleep(float(os.environ["THINKS_S"]))
"""


def test_mission_time_is_told_second_by_second_and_changes_nothing() -> None:
    told: list[tuple[float, float]] = []
    _, watched = run_recorded("seams2023", "random", 1, 1, on_time=lambda t_s, limit_s: told.append((t_s, limit_s)))
    assert told[:2] == [(0.0, 300.0), (1.0, 300.0)]
    assert len(told) == 301
    assert watched == run_recorded("seams2023", "random", 1, 1)[1]


def test_on_a_terminal_the_line_has_the_mission_time_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    file = io.StringIO()
    with mission_status("seams2023", Console(file=file, force_terminal=True, width=80)) as show:
        assert show is not None
        show(120.0, 300.0)
    assert "seams2023: mission time 120 of 300 s" in file.getvalue()


def test_elsewhere_there_is_nothing_to_tell() -> None:
    file = io.StringIO()
    with mission_status("seams2023", Console(file=file)) as show:
        assert show is None
    assert file.getvalue() == ""


def test_the_command_tells_it_on_its_error_stream_only_if_that_is_a_terminal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "slow.py").write_text(SLOW)
    arguments = ("run", "seams2023", "--manager", "slow:Slow")
    monkeypatch.setenv("THINKS_S", "0.4")
    plain = command_here(*arguments, cwd=tmp_path)
    assert (plain.returncode, plain.stderr) == (0, "")
    ours, theirs = pty.openpty()
    environment = {
        **os.environ,
        "PYTHONPATH": str(Path(suave_des.__file__).parents[1]),
        "TERM": "xterm",
        "THINKS_S": "1.0",
    }
    command = [sys.executable, "-m", "suave_des", *arguments]
    ended = subprocess.run(
        command,
        cwd=tmp_path,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=theirs,
        text=True,
        timeout=120,
        check=True,
    )
    os.close(theirs)
    said = b""
    try:
        while part := os.read(ours, 4096):
            said += part
    except OSError:  # the other side is closed
        pass
    os.close(ours)
    # The manager sleeps after 50, 100 and 150 s; what else happens at that time comes before or after.
    assert re.search(rb"mission time (49|50|99|100|149|150) of 300 s", said)
    assert ended.stdout == plain.stdout
