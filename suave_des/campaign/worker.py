"""One worker process: how it is started, what it is given, what it sends, and how it is ended.

Little is imported here: workers start before the process that asks for them has imported what it needs itself.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import time
import traceback
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import TYPE_CHECKING

from suave_des.errors import SuaveDesError
from suave_des.imports import gc_paused, main_hidden
from suave_des.interrupts import INTERRUPTS, signals_deferred

if TYPE_CHECKING:
    from suave_des.campaign.outcomes import Job
    from suave_des.campaign.plan import Chunk

STOP_TIMEOUT_S = 5.0
_OUT_OF_MEMORY = 12
"""Exit status of a worker that could not get the memory it asked for (the system's number of that error)."""


@dataclass(frozen=True)
class Crash:
    """What a worker sends instead of outcomes when it cannot go on."""

    error: SuaveDesError | None
    traceback: str


@dataclass
class Task:
    """Missions to run, and how often that has cost a worker its life."""

    chunk: Chunk
    attempts: int = 0


@dataclass(eq=False)
class Worker:
    """A worker process and what it was given, oldest first."""

    connection: Connection
    process: BaseProcess
    tasks: deque[Task] = field(default_factory=deque)
    since_s: float = 0.0
    overdue: bool = False

    def begin(self, job: Job) -> None:
        """Give it what all its missions have in common; the first thing to do."""
        with suppress(BrokenPipeError, ConnectionResetError):  # it is gone, which receiving from it tells
            self.connection.send(job)

    def give(self, task: Task) -> None:
        """Give it a chunk of missions to run when those before are done."""
        if not self.tasks:
            self.since_s = time.monotonic()
        self.tasks.append(task)
        with suppress(BrokenPipeError, ConnectionResetError):  # it is gone, which receiving from it tells
            self.connection.send(task.chunk)

    def dismiss(self) -> None:
        """Have it end when all that it was given is done."""
        with suppress(BrokenPipeError, ConnectionResetError):  # it has ended already
            self.connection.send(None)

    def wait(self) -> int | None:
        """Its exit status, as it has ended or is about to; it is killed if that takes long."""
        self.connection.close()
        self.process.join(STOP_TIMEOUT_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        return self.process.exitcode


@dataclass(frozen=True)
class StartWorker:
    """How workers are started.

    Attributes:
        needs_script: whether they import the script that asked for them, as a manager is defined in it.
    """

    needs_script: bool

    def __call__(self) -> Worker:
        """A new worker; to be called with interrupts held, and kept before they are let through, for it to be ended."""
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process: BaseProcess = context.Process(target=_work, args=(theirs,), daemon=True)
        with nullcontext() if self.needs_script else main_hidden():
            process.start()
        theirs.close()
        return Worker(ours, process)

    def hint(self) -> str:
        """What may be wrong when workers cannot start."""
        if not self.needs_script:
            return ""
        return (
            "; as a manager is defined in the script itself, each worker runs that too: put the manager into a module"
            ' of its own, or the campaign under `if __name__ == "__main__":`'
        )


@contextmanager
def interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C and kill back while a worker starts: it inherits that, so that they reach this process alone."""
    resource_tracker.ensure_running()  # or the first worker's start starts it, which lets them through again
    with signals_deferred():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def workers_started(number: int, start: StartWorker) -> Iterator[list[Worker]]:
    """New workers, which are killed at the end if they have not ended by then."""
    started: list[Worker] = []
    try:
        for _ in range(number):
            with interrupts_held():
                started.append(start())
        yield started
    finally:
        end(started)


def end(workers: Sequence[Worker]) -> None:
    """End workers at once; those that have ended stay as they are."""
    for worker in workers:
        worker.process.kill()
    for worker in workers:
        worker.wait()


def _work(connection: Connection) -> None:
    """Life of a worker process: a job and chunks in, outcomes out, until there are no more or the parent is gone."""
    try:
        with gc_paused():
            from suave_des.campaign.missions import MissionRunner  # with it comes the compiler, before the job is there
            from suave_des.managing.registry import is_built_in

            job: Job | None = connection.recv()
            if job is None:
                return
            runner = MissionRunner(job)
        gc.freeze()  # or the first look for garbage afterwards goes through all of that
        has_only_ours = all(map(is_built_in, job.managers))
        while (chunk := connection.recv()) is not None:
            connection.send(runner.run(chunk))
        if has_only_ours:
            os._exit(0)  # to take down piece by piece what was loaded lasts half a second; others may have files open
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return
    except MemoryError:
        os._exit(_OUT_OF_MEMORY)  # as if it had been killed for it: a new worker begins with little
    except Exception as error:
        connection.send(Crash(error if isinstance(error, SuaveDesError) else None, traceback.format_exc()))
