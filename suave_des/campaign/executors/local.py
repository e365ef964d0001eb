"""Executors on this machine: this process, or worker processes that are replaced when they die."""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import cache
from itertools import islice
from multiprocessing import resource_tracker
from multiprocessing.context import SpawnContext, SpawnProcess
from multiprocessing.process import BaseProcess
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Self

from suave_des.campaign.missions import Chunk, Finished, JobSpec, MissionKey, WorkerError
from suave_des.campaign.user_modules import define_in_main, main_classes
from suave_des.imports import main_hidden
from suave_des.interrupts import INTERRUPTS, signals_deferred
from suave_des.registry import is_built_in

if TYPE_CHECKING:
    from suave_des.campaign.executors.mission_runner import MissionRunner

_LARGEST_CHUNK = 10
"""Missions: few, as chunks under way are lost when a campaign is stopped, and workers are to end together."""
_AHEAD = 2
"""Chunks at a worker at any time: one under way, one waiting, so that it is never idle."""
_ATTEMPTS = 3
"""How many times a worker may die with a mission before the mission has failed."""
_IN_A_ROW = 8
"""Workers that may end one after the other without an outcome in between."""
_START_S = 300.0
"""Time for starting Python, perhaps from a slow shared disk, and for compiling."""
_MARGIN_S = 60.0
"""Added to the time that a chunk's missions may take, such as for starting Java, before its worker is killed."""
_STOP_TIMEOUT_S = 5.0
_SAFE_PATH = "PYTHONSAFEPATH"
_RUNS_THE_SCRIPT = 10
"""Exit status of a worker in which the script began its campaign anew."""
_NAME = "suave-des worker"


class InProcess:
    """Runs missions one after the other in this process; an Executor."""

    def outcomes(self, job: JobSpec, missions: Iterable[MissionKey], total: int) -> Iterator[list[Finished]]:
        """Yield outcomes mission by mission; see Executor."""
        from suave_des.campaign.executors.mission_runner import (
            MissionRunner,  # with it comes the compiler, which takes a while
        )

        for finished in MissionRunner(job).each(missions):
            yield [finished]


class LocalWorkers:
    """Runs chunks of missions in worker processes; an Executor, and a context at whose end they are stopped.

    Workers are spawned, never forked: a forked child would hang on its parent's Java virtual machine. One that dies
    before its work is done (killed, out of memory, a crash of Java) is replaced, and its missions are run
    again one by one. A mission during which that happens _ATTEMPTS times has failed; so has one that its own time-out
    does not end.

    Each worker is a ProcessPoolExecutor of one process: when a process ends, all that its pool was given is broken,
    and no other pool is.

    Args:
        managers: whose missions are run.
        workers: number of processes; they start at once, and import what they need.
    """

    def __init__(self, managers: Sequence[str], workers: int) -> None:
        self._definitions = main_classes(managers)
        in_main = any(name.startswith("__main__:") for name in managers)
        self._needs_script = in_main and self._definitions is None
        self._may_be_killed = all(map(is_built_in, managers))
        self._size = workers
        self._workers: list[_Worker] = []
        self._is_done = False
        self._in_a_row = 0
        self._again: deque[_Task] = deque()
        self._ended: SimpleQueue[Future[list[Finished]] | None] = SimpleQueue()

    def __enter__(self) -> Self:
        """Start the workers."""
        try:
            for _ in range(self._size):
                self._start_worker(len(self._workers))
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the workers: at once, unless a user's manager may have files to close."""
        for worker in self._workers:
            worker.stop(wait=self._is_done and not self._may_be_killed)
        for worker in self._workers:
            worker.join()

    def outcomes(self, job: JobSpec, missions: Iterable[MissionKey], total: int) -> Iterator[list[Finished]]:
        """Yield outcomes chunk by chunk; see Executor."""
        self._job = job
        size = max(1, min(_LARGEST_CHUNK, total // (self._size * 10)))
        remaining = iter(missions)
        self._tasks = map(_Task, iter(lambda: tuple(islice(remaining, size)), ()))
        for worker in self._workers:
            self._prepare(worker)
        self._hand_out()
        while busy := [worker for worker in self._workers if worker.tasks]:
            future = self._next_ended(busy)
            owners = [worker for worker in busy if future in worker.tasks]
            if future is None or not owners:  # of a worker that was replaced
                continue
            (worker,) = owners
            error = future.exception()
            if isinstance(error, BrokenProcessPool):
                yield from self._replace(worker)
                continue
            if error is not None:
                raise error
            del worker.tasks[future]
            worker.since_s = time.monotonic()
            self._in_a_row = 0
            self._hand_out()
            yield future.result()
        self._is_done = True

    def _start_worker(self, place: int) -> _Worker:
        """Start a worker and note it at its place, before an interruption can come in between."""
        try:
            with _interrupts_held():
                self._workers[place : place + 1] = [worker := _Worker(needs_script=self._needs_script)]
            return worker
        except OSError as error:  # the system's limit of processes, files or memory
            problem = f"a worker process cannot be started: {error.strerror}"
            raise WorkerError(f"{problem} (raise the limit, see ulimit -a, or give --workers 1)") from None

    def _prepare(self, worker: _Worker) -> None:
        """Send a worker the part that all missions share; after that, its chunk is due earlier."""
        worker.prepare(self._job, self._definitions, lambda: self._ended.put(None))

    def _hand_out(self) -> None:
        """Give every worker its share while there are missions to run."""
        for share in range(1, _AHEAD + 1):
            for worker in self._workers:
                if len(worker.tasks) < share:
                    task = self._again.popleft() if self._again else next(self._tasks, None)
                    if task is None:
                        return
                    worker.give(task).add_done_callback(self._ended.put)

    def _next_ended(self, busy: Sequence[_Worker]) -> Future[list[Finished]] | None:
        """Wait for a chunk to end, and kill workers that do not answer."""
        due_s = min(worker.due_s(self._job.time_out_s) for worker in busy)
        with suppress(Empty):
            return self._ended.get(timeout=max(0.0, due_s - time.monotonic()))
        for worker in busy:
            if time.monotonic() >= worker.due_s(self._job.time_out_s):
                if worker.is_overdue:
                    raise WorkerError(f"worker process {worker.process.pid} was killed, but has not ended")
                worker.is_overdue, worker.since_s = True, time.monotonic()
                worker.process.kill()
        return None

    def _replace(self, worker: _Worker) -> Iterator[list[Finished]]:
        """Replace a worker that died; the first of its chunks was running."""
        worker.stop(wait=False)
        status = worker.join()
        if self._needs_script and status == _RUNS_THE_SCRIPT:
            raise WorkerError(f"the campaign would start again in each worker process{_SCRIPT_HINT}")
        self._in_a_row += 1
        if self._in_a_row >= _IN_A_ROW:
            raise WorkerError(
                f"{_IN_A_ROW} worker processes in a row ended before a mission was done, the last with status {status}"
                f" (killed, or out of memory?){_SCRIPT_HINT if self._needs_script else ''}"
            )
        suspect, *others = worker.tasks.values()
        attempts = suspect.attempts + 1
        if len(suspect.chunk) > 1:
            self._again.extend(_Task((key,), attempts) for key in suspect.chunk)
        elif worker.is_overdue:
            yield [self._job.timed_out(suspect.chunk[0])]
        elif attempts < _ATTEMPTS:
            self._again.append(_Task(suspect.chunk, attempts))
        else:
            cause = f"its worker process ended with status {status}, {attempts} times (killed, or out of memory?)"
            yield [self._job.failed(suspect.chunk[0], cause)]
        self._again.extend(others)
        fresh = self._start_worker(self._workers.index(worker))
        self._prepare(fresh)
        self._hand_out()


_SCRIPT_HINT = (
    "; as a manager is defined in the script itself, each worker runs that too: put the manager into a module"
    ' of its own, or the campaign under `if __name__ == "__main__":`'
)


@dataclass(frozen=True)
class _Task:
    """Missions to run, and how many times a worker has died with them."""

    chunk: Chunk
    attempts: int = 0


class _Worker:
    """One worker process, and its chunks, oldest first."""

    def __init__(self, *, needs_script: bool) -> None:
        self.tasks: dict[Future[list[Finished]], _Task] = {}
        self.since_s, self._start_s = 0.0, _START_S
        self.is_overdue = False
        context = _Context()
        self._pool = ProcessPoolExecutor(1, context, initializer=_end_with_parent)
        with nullcontext() if needs_script else main_hidden():
            self._pool.submit(_import)
        self.process = context.process
        context.close_writer()

    def prepare(self, job: JobSpec, definitions: bytes | None, when_ready: Callable[[], None]) -> None:
        """Send it the part that all its missions share; call this first."""

        def is_ready(_: object) -> None:
            self.since_s, self._start_s = time.monotonic(), 0.0
            when_ready()

        with suppress(BrokenProcessPool):  # it has ended, as the first chunk will show
            if definitions is not None:
                self._pool.submit(define_in_main, definitions)
            self._pool.submit(_prepare, job).add_done_callback(is_ready)

    def give(self, task: _Task) -> Future[list[Finished]]:
        """Give it a chunk of missions, to be run after the earlier ones."""
        if not self.tasks:
            self.since_s = time.monotonic()
        try:
            future = self._pool.submit(_run, task.chunk)
        except BrokenProcessPool as error:
            future = Future()
            future.set_exception(error)
        self.tasks[future] = task
        return future

    def due_s(self, time_out_s: float) -> float:
        """Return the time by which its oldest chunk must be done."""
        if self.is_overdue:  # it is killed, which its pool will notice
            return self.since_s + _MARGIN_S
        return self.since_s + self._start_s + time_out_s * len(next(iter(self.tasks.values())).chunk) + _MARGIN_S

    def stop(self, *, wait: bool) -> None:
        """Stop the process: at once, or when it has finished its chunks."""
        if wait:
            self._pool.shutdown(wait=False, cancel_futures=True)
        else:
            self.process.kill()

    def join(self) -> int | None:
        """Wait for the process to end, and return its exit status; it is killed if that takes long."""
        self.process.join(_STOP_TIMEOUT_S)
        if self.process.is_alive():
            self.process.kill()
        while self.process.exitcode is None:  # the pool's own thread may just be reading it
            time.sleep(0.001)
        # The thread of a killed pool ends here: while Python exits, it would print a traceback.
        self._pool.shutdown(cancel_futures=True)
        return self.process.exitcode


class _Context(SpawnContext):
    """Starts the process of a pool by spawning, and knows it and the queue of its results."""

    process: BaseProcess
    _results: Any

    def SimpleQueue(self) -> Any:  # noqa: N802
        self._results = super().SimpleQueue()
        return self._results

    def close_writer(self) -> None:
        """Let only the worker write results: if it dies in the middle of one, the pool reads an end of file.

        As long as this process could write, too, the pool would wait for the other half.
        """
        self._results._writer.close()

    def Process(self, *arguments: Any, **named: Any) -> BaseProcess:  # type: ignore[override]  # noqa: N802
        self.process = SpawnProcess(*arguments, **(named | {"name": _NAME}))
        return self.process


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Block Ctrl-C and kill while a worker starts: it inherits this, so that they reach only this process."""
    with _without_current_folder():
        resource_tracker.ensure_running()  # or the first worker's start starts it, which lets them through again
        with signals_deferred():
            before = signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)
            try:
                yield
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _without_current_folder() -> Iterator[None]:
    """Prevent processes that start meanwhile from importing anything from the current folder while Python starts.

    A file such as signal.py or types.py there would be taken for Python's own module of that name.
    """
    if _SAFE_PATH in os.environ:
        yield
        return
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        del os.environ[_SAFE_PATH]


# What runs in a worker process.


def end_worker_of_script(managers: Sequence[str], workers: int) -> None:
    """End this process if it is a worker that imports the script, and the script's campaign cannot be run in it."""
    is_starting = multiprocessing.current_process().name == _NAME and multiprocessing.parent_process() is None
    if is_starting and (workers > 1 or any(name.startswith("__main__:") for name in managers)):
        os._exit(_RUNS_THE_SCRIPT)


_jobs: list[JobSpec] = []


def _end_with_parent() -> None:
    """End this process when the one that started it has ended, whatever a mission does."""

    def wait() -> None:
        parent = multiprocessing.parent_process()
        assert parent is not None
        parent.join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def _import() -> None:
    """Import everything that missions need, including the compiler, before the job arrives."""
    import suave_des.campaign.executors.mission_runner  # noqa: F401


def _prepare(job: JobSpec) -> None:
    _jobs.append(job)
    _runner()


@cache
def _runner() -> MissionRunner:
    from suave_des.campaign.executors.mission_runner import MissionRunner

    return MissionRunner(_jobs[-1])


def _run(chunk: Chunk) -> list[Finished]:
    try:
        return list(_runner().each(chunk))
    except MemoryError:
        os._exit(errno.ENOMEM)  # as if it had been killed for it: a new worker begins with little
