"""Worker processes that have imported everything before they start, for tests that are not about how workers start.

A campaign spawns its workers, as a fork of a process with a Java machine or with threads may hang; each then takes a
second of CPU time to import what missions need. Here they are forked from a process of the tests that has imported
that once, and has neither. Everything else is the campaign's own.
"""

from __future__ import annotations

import os
import threading
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
    from suave_des.campaign.executors import local

    monkeypatch.setattr(local, "SpawnProcess", _Forked)
