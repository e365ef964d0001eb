"""Executors on this machine: this process, or worker processes that are replaced when they die."""

from __future__ import annotations

import errno
import os
import pickle
import signal
import sys
import time
import traceback
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from itertools import islice, repeat
from math import inf
from multiprocessing import Pipe, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from types import ModuleType
from typing import Any, Self

from suave_des.campaign.missions import Campaign, Chunk, Finished, MissionRunner, WorkerError
from suave_des.errors import SuaveDesError
from suave_des.interrupts import INTERRUPTS, signals_deferred
from suave_des.records.store import MissionKey
from suave_des.registry import is_built_in

_LARGEST_CHUNK = 10
"""Missions: few, as chunks under way are lost when a campaign is stopped, and workers are to end
together.
"""
_AHEAD = 2
"""Chunks at a worker at any time: one under way, one waiting, so that it is never idle."""
_ATTEMPTS = 3
"""How many times a worker may die with a mission before the mission has failed."""
_IN_A_ROW = 8
"""Workers that may end one after the other without an outcome in between."""
_MARGIN_S = 60.0
"""Added to the time that a chunk's missions may take, such as for starting Java, before its worker
is killed.
"""
_START_S = 300.0
"""Time to start: Python, perhaps from a slow shared disk, and the compiler."""
_STOP_TIMEOUT_S = 5.0
_SAFE_PATH, _MAIN = "PYTHONSAFEPATH", "__main__:"
_Task = tuple[Chunk, int]
"""Missions to run, and how many times a worker has died with them."""


def in_process(
    campaign: Campaign, missions: Iterable[MissionKey], total: int
) -> Iterator[list[Finished]]:
    """Run missions one after the other in this process; an Executor."""
    return ([each] for each in MissionRunner(campaign).each(missions))


class LocalWorkers:
    """Runs chunks of missions in worker processes; an Executor, and a context at whose end they are
    stopped.

    Workers are spawned, never forked: a forked child would hang on its parent's Java virtual
    machine. One that dies before its work is done (killed, out of memory, a crash of Java) is
    replaced, and the missions that it was running are run again one by one. A mission during which
    that happens _ATTEMPTS times has failed; so has one that its own time-out does not end.

    Each worker has a pipe of its own. A ProcessPoolExecutor has one for all, and waits for ever
    when a worker is killed while it writes into it; it does not say either which chunk a worker
    had.
    """

    def __init__(self, managers: Sequence[str], workers: int) -> None:
        self._may_be_killed = all(map(is_built_in, managers))
        self._size, self._workers, self._is_done, self._in_a_row = (
            workers,
            list[_Worker](),
            False,
            0,
        )
        self._again = deque[_Task]()

    def __enter__(self) -> Self:
        """Start the workers, which import what they need before there is work for them."""
        with ExitStack() as stack:
            stack.push(self.__exit__)
            for _ in range(self._size):
                self._start()
            stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop the workers: at once, unless a user's manager may have files to close."""
        for worker in self._workers:
            if self._may_be_killed or not self._is_done:
                worker.process.kill()
            worker.connection.close()
        for worker in self._workers:
            worker.join()

    def outcomes(
        self, campaign: Campaign, missions: Iterable[MissionKey], total: int
    ) -> Iterator[list[Finished]]:
        """Yield outcomes chunk by chunk; see Executor."""
        size = max(1, min(_LARGEST_CHUNK, total // (self._size * 10)))
        remaining, content = iter(missions), packed(campaign)
        tasks = zip(iter(lambda: tuple(islice(remaining, size)), ()), repeat(0))
        for worker in self._workers:
            worker.send(content)
        while busy := [worker for worker in self._workers if worker.due_s < inf]:
            wait_s = min(worker.due_s for worker in busy) - time.monotonic()
            ready = wait([worker.connection for worker in busy], max(0.0, wait_s))
            for worker in busy:
                if worker.connection not in ready:
                    if time.monotonic() >= worker.due_s:
                        worker.is_overdue = True
                        worker.process.kill()  # its pipe then ends
                    continue
                try:
                    found = worker.connection.recv()
                except (EOFError, OSError):  # also in the middle of a message
                    yield from self._ended(worker, campaign)
                    self._start().send(content)
                    continue
                if isinstance(found, BaseException):
                    raise found
                if found is not None:
                    worker.tasks.popleft()
                    self._in_a_row = 0
                room = range(_AHEAD - len(worker.tasks))
                for task in filter(
                    None,
                    (self._again.popleft() if self._again else next(tasks, None) for _ in room),
                ):
                    worker.tasks.append(task)
                    worker.send(task[0])
                limit_s = (
                    campaign.spec.time_out_s * len(worker.tasks[0][0]) + _MARGIN_S
                    if worker.tasks
                    else inf
                )
                worker.due_s = time.monotonic() + limit_s
                if found is not None:
                    yield found
        self._is_done = True

    def _start(self) -> _Worker:
        """Start a worker and note it, before an interruption can come in between."""
        try:
            with _quietly():
                here, there = Pipe()
                process = SpawnProcess(target=work, args=(there,))
                process.start()
                there.close()
                self._workers.append(worker := _Worker(process, here, time.monotonic() + _START_S))
            return worker
        except OSError as error:  # the system's limit of processes, files or memory
            problem = f"a worker process cannot be started: {error.strerror}"
            raise WorkerError(
                f"{problem} (raise the limit, see ulimit -a, or give --workers 1)"
            ) from None

    def _ended(self, worker: _Worker, campaign: Campaign) -> Iterator[list[Finished]]:
        """Have what a worker was running when it ended run again, one by one; or yield that it has
        failed.
        """
        worker.process.kill()
        worker.connection.close()
        status = worker.join()
        self._workers.remove(worker)
        self._in_a_row += 1
        if self._in_a_row >= _IN_A_ROW:
            what = f"{_IN_A_ROW} worker processes in a row ended before a mission was done"
            raise WorkerError(f"{what}, the last with status {status} (killed, or out of memory?)")
        (suspects, died), *others = worker.tasks or [((), 0)]
        attempts = died + 1
        self._again.extend(others)
        if len(suspects) == 1 and worker.is_overdue:
            yield [campaign.failed(suspects[0], campaign.too_long)]
        elif len(suspects) == 1 and attempts >= _ATTEMPTS:
            cause = f"its worker process ended with status {status}, {attempts} times (killed, or out of memory?)"
            yield [campaign.failed(suspects[0], cause)]
        else:
            self._again.extend(((key,), attempts) for key in suspects)


@dataclass
class _Worker:
    """One worker process, with this end of its pipe, which ends when the process does, and its
    tasks, oldest first.

    `due_s` is when it has to be done with the oldest, infinite if it has nothing to do; once that
    is over, it is killed as overdue.
    """

    process: SpawnProcess
    connection: Connection[Any, Any]
    due_s: float
    tasks: deque[_Task] = field(default_factory=deque)
    is_overdue: bool = False

    def send(self, message: object) -> None:
        """Send a message; a process that has ended is noticed when its pipe is read."""
        with suppress(OSError):
            self.connection.send(message)

    def join(self) -> int | None:
        """Wait for the process to end, and return its exit status; it is killed if that takes
        long.
        """
        self.process.join(_STOP_TIMEOUT_S)
        self.process.kill()
        self.process.join()
        return self.process.exitcode


@contextmanager
def _quietly() -> Iterator[None]:
    """Let a process start that leaves Ctrl-C and kill to this one, and imports neither its script
    nor its files.

    It inherits that the signals are blocked. A file such as signal.py in the current folder would
    be taken for Python's own module of that name while Python starts.
    """
    was_safe, main = os.environ.get(_SAFE_PATH), sys.modules["__main__"]
    os.environ[_SAFE_PATH] = "1"
    resource_tracker.ensure_running()  # or the first start does it, which lets the signals through again
    with signals_deferred():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            if was_safe is None:
                del os.environ[_SAFE_PATH]


def packed(campaign: Campaign) -> bytes:
    """Pack a campaign, and the classes of it that the main program defines, which no other process
    can import.
    """
    own = [name.removeprefix(_MAIN) for name in campaign.code() if name.startswith(_MAIN)]
    if not own:
        return pickle.dumps(({}, campaign))
    import cloudpickle  # takes a class by its content where it cannot be imported

    content: bytes = cloudpickle.dumps(
        ({name: getattr(sys.modules["__main__"], name) for name in own}, campaign)
    )
    return content


def unpacked(content: bytes) -> Campaign:
    """Unpack a campaign, and define the classes that came with it where missions look for them."""
    definitions, campaign = pickle.loads(content)
    for name, each in definitions.items():
        setattr(sys.modules["__main__"], name, each)
    assert isinstance(campaign, Campaign)
    return campaign


# What runs in a worker process.


def finished(runner: MissionRunner, chunk: Chunk) -> list[Finished]:
    """Run missions; without memory for them this process ends as if killed for it: a new one begins
    with little.
    """
    try:
        return list(runner.each(chunk))
    except MemoryError:
        os._exit(errno.ENOMEM)


def work(connection: Connection[Any, Any]) -> None:
    """Receive a campaign, then chunks of its missions, and send back their outcomes, until the
    other end is closed.
    """
    import suave_des.simulation.simulator  # noqa: F401 - all that missions need, before the campaign arrives

    with suppress(
        EOFError, BrokenPipeError, ConnectionResetError
    ):  # the campaign is over, or its process has ended
        runner = None
        while True:
            message = connection.recv()
            answer: object = None
            try:
                if runner is None:
                    runner = MissionRunner(unpacked(message))
                else:
                    answer = finished(runner, message)
            except SuaveDesError as error:
                answer = error
            except Exception:
                answer = RuntimeError(traceback.format_exc())
            connection.send(answer)
