"""Worker processes that run chunks of missions, and are replaced when they end."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import wait

from suave_des.campaign import machine_code
from suave_des.campaign.executors import WorkerError, chunk_size
from suave_des.campaign.outcomes import Finished, Job, time_out_cause
from suave_des.campaign.plan import MissionKey, chunked
from suave_des.campaign.worker import Crash, StartWorker, Task, Worker, end, interrupts_held, workers_started

_AHEAD = 2
"""Chunks at a worker at any time: one under way, one waiting, so that it is never idle."""
_ATTEMPTS = 3
"""How often a mission may cost a worker its life."""
_IN_A_ROW = 8
"""Workers that may end one after the other without an outcome in between."""
_COMPILE_TIMEOUT_S = 300.0
_START_AND_STOP_S = 60.0
"""Added to the time that a chunk's missions may take: starting Python and Java, and what a worker says by itself."""


class ProcessPool:
    """Runs chunks of missions in worker processes.

    Workers are spawned, never forked: a forked child would hang on the Java machine of its parent. One that ends
    before its work is done (killed, out of memory, a Java machine that crashed) is replaced, and its missions are run
    again one by one. A mission during which that happens _ATTEMPTS times has failed; so has one that its own time-out
    does not end.
    """

    def __init__(self, workers: list[Worker], start: StartWorker) -> None:
        self._workers, self._start = workers, start
        self.is_done = False

    def outcomes(self, job: Job, missions: Iterable[MissionKey], total: int) -> Iterator[list[Finished]]:
        """Outcomes chunk by chunk; see Executor."""
        if not machine_code.is_stored():
            self._compile(job)
        for worker in self._workers:
            worker.begin(job)
        size = chunk_size(total, len(self._workers))
        tasks = (Task(chunk) for chunk in chunked(missions, size))
        yield from _Crew(self._workers, self._start, job, tasks).outcomes()
        self.is_done = True

    def _compile(self, job: Job) -> None:
        """Have a process compile, and end: each worker would do it else, and be larger by what the compiler takes."""
        compiling: Worker | None = None
        try:
            with interrupts_held():
                compiling = self._start()
            compiling.begin(job)
            compiling.dismiss()
            compiling.process.join(_COMPILE_TIMEOUT_S)  # should it fail, workers will tell
        finally:
            if compiling is not None:
                compiling.process.kill()
                compiling.wait()


@contextmanager
def process_pool(managers: Sequence[str], workers: int, ready: Sequence[Worker] = ()) -> Iterator[ProcessPool]:
    """A pool whose workers start now: what they import, they import while this process prepares their work.

    They are stopped at the end; at once, if not all outcomes were asked for.

    Args:
        managers: that missions are run of.
        workers: number of processes.
        ready: workers that were started before, without the script; they count among these.
    """
    start = StartWorker(needs_script=any(name.startswith("__main__:") for name in managers))
    usable = [] if start.needs_script else list(ready[:workers])
    end(ready[len(usable) :])
    with workers_started(workers - len(usable), start) as started:
        crew = usable + started
        pool = ProcessPool(crew, start)
        try:
            yield pool
            if pool.is_done:
                for worker in crew:
                    worker.dismiss()
                for worker in crew:
                    worker.wait()
        finally:
            end(crew)


class _Crew:
    def __init__(self, workers: list[Worker], start: StartWorker, job: Job, tasks: Iterator[Task]) -> None:
        self._workers, self._start = workers, start
        self._job = job
        self._tasks = tasks
        self._again: deque[Task] = deque()
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

    def _receive(self, worker: Worker) -> Iterator[list[Finished]]:
        try:
            message: list[Finished] | Crash = worker.connection.recv()
        except (EOFError, OSError):
            yield from self._replace(worker)
            return
        if isinstance(message, Crash):
            raise message.error or RuntimeError(f"in a worker process:\n{message.traceback}")
        worker.tasks.popleft()
        worker.since_s = time.monotonic()
        self._in_a_row = 0
        self._hand_out()
        yield message

    # Workers that end, or do not answer.

    def _allowed_s(self, worker: Worker) -> float:
        return self._job.time_out_s * len(worker.tasks[0].chunk) + _START_AND_STOP_S

    def _patience_s(self, busy: list[Worker]) -> float:
        now = time.monotonic()
        return max(0.0, min(worker.since_s + self._allowed_s(worker) - now for worker in busy))

    def _end_overdue(self, busy: list[Worker]) -> None:
        now = time.monotonic()
        for worker in busy:
            if not worker.overdue and now >= worker.since_s + self._allowed_s(worker):
                worker.overdue = True
                worker.process.kill()  # its connection then says so, as with any that is killed

    def _replace(self, worker: Worker) -> Iterator[list[Finished]]:
        """Put a new worker in the place of one that ended; of its chunks, the first was under way."""
        status = worker.wait()
        self._in_a_row += 1
        if self._in_a_row >= _IN_A_ROW:
            raise WorkerError(
                f"{_IN_A_ROW} worker processes in a row ended before a mission was done, the last with status {status}"
                f" (killed, or out of memory?){self._start.hint()}"
            )
        suspect, *others = worker.tasks
        yield from self._try_again(suspect, status, overdue=worker.overdue)
        self._again.extend(others)
        with interrupts_held():
            self._workers[self._workers.index(worker)] = fresh = self._start()
        fresh.begin(self._job)
        self._hand_out()

    def _try_again(self, task: Task, status: int | None, *, overdue: bool) -> Iterator[list[Finished]]:
        attempts = task.attempts + 1
        if len(task.chunk) > 1:
            self._again.extend(Task((key,), attempts) for key in task.chunk)
        elif overdue:
            yield [self._job.failed(task.chunk[0], time_out_cause(self._job.time_out_s))]
        elif attempts < _ATTEMPTS:
            self._again.append(Task(task.chunk, attempts))
        else:
            cause = f"its worker process ended with status {status}, {attempts} times (killed, or out of memory?)"
            yield [self._job.failed(task.chunk[0], cause)]
