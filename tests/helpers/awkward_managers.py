"""Managers that misbehave; given to campaigns as tests.helpers.awkward_managers:CLASS."""

from __future__ import annotations

import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path

from suave_des.domain import Task
from suave_des.managing.base import Dependencies, ManagingSubsystem, System
from suave_des.managing.simple import NoManager


class _InRun(NoManager):
    """Knows which run it is in, by the run's sea: tests give the start positions at which to
    misbehave.
    """

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.draw = system.stream("awkward").random()
        self.period_s = 50.0
        self.starts_s = 50.0


class RaisesInHalf(_InRun):
    """Raises in about half of the runs, at 50 s."""

    def adapt(self) -> None:
        if self.draw < 0.5:
            raise ValueError("I do not know what to do")


class Quits(NoManager):
    """Calls sys.exit, as a script would."""

    def task_requested(self, task: Task) -> None:
        sys.exit("no more")


class RaisesAlways(ManagingSubsystem):
    """Raises as soon as there is something to do."""

    def task_requested(self, task: Task) -> None:
        raise LookupError(task.name)


class DiesInSome(_InRun):
    """Ends its process as the system does when memory is short, in about one of ten runs."""

    def adapt(self) -> None:
        if self.draw < 0.1:
            os.kill(os.getpid(), signal.SIGKILL)


class DiesAlways(NoManager):
    """Ends its process in each mission."""

    def task_requested(self, task: Task) -> None:
        os.kill(os.getpid(), signal.SIGKILL)


class HangsInSome(_InRun):
    """Never comes back in about one of ten runs, whatever Exception it meets."""

    def adapt(self) -> None:
        while self.draw < 0.1:
            with suppress(Exception):
                time.sleep(0.2)


class HangsOnce(_InRun):
    """Does not come back in about one of ten runs, the first time it is tried."""

    def adapt(self) -> None:
        mark = Path(os.environ["AWKWARD_MARKS"]) / f"{self.draw}"
        if self.draw < 0.1 and not mark.exists():
            mark.touch()
            time.sleep(60.0)


class TellsItsProcess(NoManager):
    """Raises with the number of its process."""

    def task_requested(self, task: Task) -> None:
        raise RuntimeError(f"process {os.getpid()}")


class BlocksInSome(_InRun):
    """Does not even hear the alarm of its time-out, in about one of ten runs."""

    def adapt(self) -> None:
        if self.draw < 0.1:
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
            time.sleep(60.0)


class Declares(NoManager):
    """Declares the file that its settings name."""

    @classmethod
    def input_files(cls, settings):
        return [settings["table"]]


class DeclaresToo(Declares):
    """The same, of another name."""


class Remembers(NoManager):
    """Searches higher the more missions its class has seen."""

    missions = 0

    def task_requested(self, task: Task) -> None:
        super().task_requested(task)
        if "f_generate_search_path" in task.functions:
            Remembers.missions += 1
            if Remembers.missions > 1:
                self.system.change_mode("f_generate_search_path", "fd_spiral_high")


class Misspells(NoManager):
    """Requests a mode that there is not."""

    def mission_started(self) -> None:
        self.system.change_mode("f_generate_search_path", "fd_spiral_hihg")


class ReadsNothing(NoManager):
    """Reads a quality attribute whose name it misspells."""

    def mission_started(self) -> None:
        self.system.measured("visibility")


class ReadsNothingAtTimes(ReadsNothing):
    """Does so in runs that it draws."""

    def mission_started(self) -> None:
        if self.system.stream("misspells").random() < 0.5:
            super().mission_started()


class SavesCharge(NoManager):
    """Serves scenarios with a battery, and others."""

    @property
    def depends_on(self) -> Dependencies:
        return {"water_visibility": (3.25,), "battery_level": (0.25,)}
