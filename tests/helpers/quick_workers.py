"""Processes that have imported everything before they start, for tests that are not about how
processes start.

A campaign spawns its workers, as a fork of a process with a Java machine or with threads may hang;
each then takes a second of CPU time to import what missions need. Here they are forked from a
process of the tests that has imported that once, and has neither. Everything else is the campaign's
own. So may a command be, whose workers are spawned.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Sequence
from multiprocessing import forkserver, popen_forkserver
from multiprocessing.connection import wait
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

import pytest


class _Popen(popen_forkserver.Popen):
    """Reads the exit status once, also when the pool and the campaign both wait for it."""

    def __init__(self, process: ForkServerProcess) -> None:
        self._lock = threading.Lock()
        super().__init__(process)

    def poll(self, flag: int = os.WNOHANG) -> int | None:
        if wait([self.sentinel], timeout=None if flag == 0 else 0.0):
            with self._lock:
                return super().poll(flag)
        return self.returncode


class _Forked(ForkServerProcess):
    """A process with the environment of the one that asks for it, as a spawned one has."""

    _Popen = _Popen

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._environment = dict(os.environ)

    def run(self) -> None:
        os.environ.clear()
        os.environ.update(self._environment)
        super().run()


@pytest.fixture(scope="session")
def _warm_process() -> None:
    """Start the process that others are forked from; it ends with this one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parents[2]), prepend=os.pathsep)
        forkserver.set_forkserver_preload(["tests.helpers.warm_worker"])
        forkserver.ensure_running()


@pytest.fixture
def quick_workers(_warm_process: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have campaigns of this process fork their workers."""
    from suave_des.campaign import workers

    monkeypatch.setattr(workers, "SpawnProcess", _Forked)


class ForkedCampaign:
    """The command `suave-des campaign` in a forked process, with what chaos uses of a Popen.

    Args:
        arguments: of the command.
        cwd: its current folder; what it says on stderr is kept beside it.
    """

    def __init__(self, arguments: Sequence[str], cwd: Path) -> None:
        self._err = cwd.with_name(f"{cwd.name}-stderr.txt")
        command = ["suave-des", "campaign", "--quiet", *arguments]
        self._process = _Forked(target=_run_command, args=(command, str(cwd), str(self._err)))
        self._process.start()
        assert self._process.pid is not None
        self.pid: int = self._process.pid

    @property
    def returncode(self) -> int | None:
        """Exit status; minus the signal's number if that ended it; None while it runs."""
        return self._process.exitcode

    def poll(self) -> int | None:
        """Exit status, or None while it runs."""
        return self.returncode

    def send_signal(self, number: signal.Signals) -> None:
        """Send a signal, if it still runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """Wait for its end; nothing, and what it said on stderr."""
        self._process.join(timeout)
        assert self.poll() is not None, "it still runs"
        return "", self._err.read_text(encoding="utf-8") if self._err.exists() else ""


def _run_command(command: list[str], folder: str, err: str) -> None:
    from suave_des.entry import main

    os.chdir(folder)
    for number, path in enumerate((os.devnull, os.devnull, err)):
        opened = os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(opened, number)
        os.close(opened)
    sys.argv[:] = command
    main()


@pytest.fixture
def quick_campaigns(_warm_process: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have chaos fork the campaigns that it starts."""
    from benchmarks import chaos

    monkeypatch.setattr(chaos, "start", ForkedCampaign)
