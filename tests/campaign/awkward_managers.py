"""Managers that misbehave; given to campaigns as awkward_managers:CLASS."""

from __future__ import annotations

import os
import signal
import sys

from suave_des.managed.coordinator import Task
from suave_des.managing.base import ManagedSystem, ManagingSubsystem
from suave_des.managing.simple import NoManager


class _InRun(NoManager):
    """Knows which run it is in, by the run's sea: tests give the start positions at which to misbehave."""

    def __init__(self, system: ManagedSystem) -> None:
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


class InterruptsInSome(_InRun):
    """Does what Ctrl-C does to the process that runs the campaign, in about one of ten runs."""

    def adapt(self) -> None:
        if self.draw < 0.1:
            own = os.environ.get("AWKWARD_TARGET", "self") == "self"
            os.kill(os.getpid() if own else os.getppid(), signal.SIGINT)


class DiesInSome(_InRun):
    """Ends its process as the system does when memory is short, in about one of ten runs."""

    def adapt(self) -> None:
        if self.draw < 0.1:
            os.kill(os.getpid(), signal.SIGKILL)


class TellsItsProcess(NoManager):
    """Raises with the number of its process."""

    def task_requested(self, task: Task) -> None:
        raise RuntimeError(f"process {os.getpid()}")
