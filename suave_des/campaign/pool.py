"""Worker processes that run chunks of missions, and are replaced when they end."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
import traceback
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from suave_des.campaign import machine_code
from suave_des.campaign.executors import WorkerError, chunk_size
from suave_des.campaign.outcomes import Finished, Job, time_out_cause
from suave_des.campaign.plan import Chunk, MissionKey, chunked
from suave_des.errors import SuaveDesError
from suave_des.imports import main_hidden
from suave_des.interrupts import INTERRUPTS, interrupts_later

_AHEAD = 2
"""Chunks at a worker at any time: one under way, one waiting, so that it is never idle."""
_ATTEMPTS = 3
"""How often a mission may cost a worker its life."""
_IN_A_ROW = 8
"""Workers that may end one after the other without an outcome in between."""
_STOP_TIMEOUT_S = 5.0
_OUT_OF_MEMORY = 12
"""Exit status of a worker that could not get the memory it asked for (the system's number of that error)."""
_COMPILE_TIMEOUT_S = 300.0
_START_AND_STOP_S = 60.0
"""Added to the time that a chunk's missions may take: starting Python and Java, and what a worker says by itself."""


@dataclass(frozen=True)
class _Crash:
    """What a worker sends instead of outcomes when it cannot go on."""

    error: SuaveDesError | None
    traceback: str


@dataclass
class _Task:
    chunk: Chunk
    attempts: int = 0


@dataclass(eq=False)
class _Worker:
    """A worker process and what it was given, oldest first."""

    connection: Connection
    process: BaseProcess
    tasks: deque[_Task] = field(default_factory=deque)
    since_s: float = 0.0
    overdue: bool = False

    def begin(self, job: Job) -> None:
        with suppress(BrokenPipeError, ConnectionResetError):  # it is gone, which receiving from it tells
            self.connection.send(job)

    def give(self, task: _Task) -> None:
        if not self.tasks:
            self.since_s = time.monotonic()
        self.tasks.append(task)
        with suppress(BrokenPipeError, ConnectionResetError):  # it is gone, which receiving from it tells
            self.connection.send(task.chunk)

    def end(self) -> None:
        """End it at once, if it has not ended by itself."""
        self.connection.close()
        self.process.kill()
        _end(self.process)


class ProcessPool:
    """Runs chunks of missions in worker processes.

    Workers are spawned, never forked: a forked child would hang on the Java machine of its parent. One that ends
    before its work is done (killed, out of memory, a Java machine that crashed) is replaced, and its missions are run
    again one by one. A mission during which that happens _ATTEMPTS times has failed; so has one that its own time-out
    does not end.
    """

    def __init__(self, workers: list[_Worker], start: _Start) -> None:
        self._workers, self._start = workers, start
        self.is_done = False

    def outcomes(self, job: Job, missions: Iterable[MissionKey], total: int) -> Iterator[list[Finished]]:
        """Outcomes chunk by chunk; see Executor."""
        if not machine_code.is_stored():
            self._compile(job)
        for worker in self._workers:
            worker.begin(job)
        size = chunk_size(total, len(self._workers))
        tasks = (_Task(chunk) for chunk in chunked(missions, size))
        yield from _Crew(self._workers, self._start, job, tasks).outcomes()
        self.is_done = True

    def _compile(self, job: Job) -> None:
        """Have a process compile, and end: each worker would do it else, and be larger by what the compiler takes."""
        compiling: _Worker | None = None
        try:
            with _interrupts_held():
                compiling = self._start()
            compiling.begin(job)
            with suppress(BrokenPipeError, ConnectionResetError):  # it is gone: workers will see to it
                compiling.connection.send(None)
            compiling.process.join(_COMPILE_TIMEOUT_S)
        finally:
            if compiling is not None:
                compiling.end()


@contextmanager
def process_pool(managers: Sequence[str], workers: int) -> Iterator[ProcessPool]:
    """A pool whose workers start now: what they import, they import while this process prepares their work.

    They are stopped at the end; at once, if not all outcomes were asked for.

    Args:
        managers: that missions are run of.
        workers: number of processes.
    """
    start = _Start(needs_script=any(name.startswith("__main__:") for name in managers))
    started: list[_Worker] = []
    try:
        for _ in range(workers):
            with _interrupts_held():
                started.append(start())
        pool = ProcessPool(started, start)
        yield pool
        if pool.is_done:
            for worker in started:
                with suppress(BrokenPipeError, ConnectionResetError):  # its work is done: no matter if it is gone
                    worker.connection.send(None)
            for worker in started:
                worker.process.join(_STOP_TIMEOUT_S)
    finally:
        for worker in started:
            worker.connection.close()
            worker.process.kill()
        for worker in started:
            _end(worker.process)


class _Crew:
    def __init__(self, workers: list[_Worker], start: _Start, job: Job, tasks: Iterator[_Task]) -> None:
        self._workers, self._start = workers, start
        self._job = job
        self._tasks = tasks
        self._again: deque[_Task] = deque()
        self._in_a_row = 0

    def outcomes(self) -> Iterator[list[Finished]]:
        self._hand_out()
        while any(worker.tasks for worker in self._workers):
            busy = [worker for worker in self._workers if worker.tasks]
            ready = wait([worker.connection for worker in busy], timeout=self._patience_s(busy))
            self._end_overdue(busy)
            for worker in busy:
                if worker.connection in ready:
                    yield from self._receive(worker)

    def _hand_out(self) -> None:
        """Give every worker its share, as long as there is something to do."""
        for share in range(1, _AHEAD + 1):
            for worker in self._workers:
                if len(worker.tasks) < share:
                    task = self._again.popleft() if self._again else next(self._tasks, None)
                    if task is None:
                        return
                    worker.give(task)

    def _receive(self, worker: _Worker) -> Iterator[list[Finished]]:
        try:
            message: list[Finished] | _Crash = worker.connection.recv()
        except (EOFError, OSError):
            yield from self._replace(worker)
            return
        if isinstance(message, _Crash):
            raise message.error or RuntimeError(f"in a worker process:\n{message.traceback}")
        worker.tasks.popleft()
        worker.since_s = time.monotonic()
        self._in_a_row = 0
        self._hand_out()
        yield message

    # Workers that end, or do not answer.

    def _allowed_s(self, worker: _Worker) -> float:
        return self._job.time_out_s * len(worker.tasks[0].chunk) + _START_AND_STOP_S

    def _patience_s(self, busy: list[_Worker]) -> float:
        now = time.monotonic()
        return max(0.0, min(worker.since_s + self._allowed_s(worker) - now for worker in busy))

    def _end_overdue(self, busy: list[_Worker]) -> None:
        now = time.monotonic()
        for worker in busy:
            if not worker.overdue and now >= worker.since_s + self._allowed_s(worker):
                worker.overdue = True
                worker.process.kill()  # its connection then says so, as with any that is killed

    def _replace(self, worker: _Worker) -> Iterator[list[Finished]]:
        """Put a new worker in the place of one that ended; of its chunks, the first was under way."""
        worker.connection.close()
        _end(worker.process)
        self._in_a_row += 1
        status = worker.process.exitcode
        if self._in_a_row >= _IN_A_ROW:
            raise WorkerError(
                f"{_IN_A_ROW} worker processes in a row ended before a mission was done, the last with status {status}"
                f" (killed, or out of memory?){self._start.hint()}"
            )
        suspect, *others = worker.tasks
        yield from self._try_again(suspect, status, overdue=worker.overdue)
        self._again.extend(others)
        with _interrupts_held():
            self._workers[self._workers.index(worker)] = fresh = self._start()
        fresh.begin(self._job)
        self._hand_out()

    def _try_again(self, task: _Task, status: int | None, *, overdue: bool) -> Iterator[list[Finished]]:
        attempts = task.attempts + 1
        if len(task.chunk) > 1:
            self._again.extend(_Task((key,), attempts) for key in task.chunk)
        elif overdue:
            yield [self._job.failed(task.chunk[0], time_out_cause(self._job.time_out_s))]
        elif attempts < _ATTEMPTS:
            self._again.append(_Task(task.chunk, attempts))
        else:
            cause = f"its worker process ended with status {status}, {attempts} times (killed, or out of memory?)"
            yield [self._job.failed(task.chunk[0], cause)]


@dataclass(frozen=True)
class _Start:
    """How workers are started.

    Attributes:
        needs_script: whether they import the script that asked for them, as a manager is defined in it.
    """

    needs_script: bool

    def __call__(self) -> _Worker:
        """A new worker; to be called with interrupts held, and kept before they are let through, for it to be ended."""
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process: BaseProcess = context.Process(target=_work, args=(theirs,), daemon=True)
        with nullcontext() if self.needs_script else main_hidden():
            process.start()
        theirs.close()
        return _Worker(ours, process)

    def hint(self) -> str:
        """What may be wrong when workers cannot start."""
        if not self.needs_script:
            return ""
        return (
            "; as a manager is defined in the script itself, each worker runs that too: put the manager into a module"
            ' of its own, or the campaign under `if __name__ == "__main__":`'
        )


def _end(process: BaseProcess) -> None:
    process.join(_STOP_TIMEOUT_S)
    if process.is_alive():
        process.kill()
        process.join()


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C and kill back while a worker starts: it inherits that, so that they reach this process alone."""
    resource_tracker.ensure_running()  # or the first worker's start starts it, which lets them through again
    with interrupts_later():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work(connection: Connection) -> None:
    """Life of a worker process: a job and chunks in, outcomes out, until there are no more or the parent is gone."""
    from suave_des.campaign.missions import MissionRunner  # with it comes the compiler, before the job is there

    try:
        job: Job | None = connection.recv()
        if job is None:
            return
        runner = MissionRunner(job)
        while (chunk := connection.recv()) is not None:
            connection.send(runner.run(chunk))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return
    except MemoryError:
        os._exit(_OUT_OF_MEMORY)  # as if it had been killed for it: a new worker begins with little
    except Exception as error:
        connection.send(_Crash(error if isinstance(error, SuaveDesError) else None, traceback.format_exc()))
