"""Executors on this machine: this process, or worker processes that are replaced when they die."""

from __future__ import annotations

import errno
import os
import pickle
import signal
import sys
import time
import traceback
from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from math import inf
from multiprocessing import Pipe, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from types import ModuleType
from typing import Any, NamedTuple, Self

from suave_des.campaign.missions import (
    Campaign,
    Chunk,
    Finished,
    MissionRunner,
    Remark,
    WorkerError,
    reasoner_is_stuck,
)
from suave_des.errors import SuaveDesError
from suave_des.interrupts import INTERRUPTS, signals_deferred
from suave_des.records.store import MissionFailure, MissionKey
from suave_des.registry import is_built_in

_CHUNK_S = 0.1
"""About how long the missions of a chunk take: those under way are lost when a campaign is stopped,
and smaller chunks cost more of this process's time.
"""
_FIRST_CHUNK, _LARGEST_CHUNK = 10, 30
"""Missions: before it is known how long they take; and at most, as a worker that hangs has the time
limit of all of them.
"""
_SHARES = 10
"""Chunks, at least, into which what is left is divided for each worker: so they end together."""
_AHEAD = 2
"""Chunks at a worker at any time: one under way, one waiting, so that it is never idle."""
_ATTEMPTS = 3
"""How many times a worker may die with a mission before the mission has failed."""
_IN_A_ROW = 8
"""Workers that may end one after the other without an outcome in between."""
_STUCK_IN_A_ROW = 3
"""Missions of a manager, one after the other, after which a stuck reasoner is no reason for a new
worker.
"""
_LOOK_S = 5.0
"""Longest wait for workers: one that took twice as long was one in which this process was
stopped.
"""
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
    """Run missions one after the other in this process; an Executor.

    A reasoner that does not come back cannot be stopped: the rest then runs in a worker process.
    """
    remaining = iter(missions)
    for each in MissionRunner(campaign).each(remaining, until_stuck=True):
        yield [each]
    if reasoner_is_stuck():
        with LocalWorkers(campaign.spec.managers, 1) as workers:
            yield from workers.outcomes(campaign, remaining, total)


class LocalWorkers:
    """Runs chunks of missions in worker processes; an Executor, and a context at whose end they are
    stopped.

    Workers are spawned, never forked: a forked child would hang on its parent's Java virtual
    machine. One that dies before its work is done (killed, out of memory, a crash of Java) is
    replaced, and the missions that it was running are run again one by one. A mission during which
    that happens _ATTEMPTS times has failed; so has one that its own time-out does not end. One
    whose reasoner does not come back is replaced, too, as Java cannot be stopped from outside.

    Each worker has a pipe of its own. A ProcessPoolExecutor has one for all, and waits for ever
    when a worker is killed while it writes into it; it does not say either which chunk a worker
    had.
    """

    def __init__(self, managers: Sequence[str], workers: int) -> None:
        self._may_be_killed = all(map(is_built_in, managers))
        self._size = workers
        self._workers: list[_Worker] = []
        self._is_done = False
        self._ended_in_a_row = 0
        self._stuck_in_a_row = Counter[int]()  # by manager
        self._again = deque[_Task]()
        # Missions that no worker has been given yet; the caller knows about how many.
        self._left = 0
        # How long a mission of each manager seems to take, by the manager's number.
        self._mission_s = defaultdict[int, float](lambda: _CHUNK_S / _FIRST_CHUNK)

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
        self._left = total
        remaining = iter(missions)
        content = packed(campaign)
        for worker in self._workers:
            worker.send(content)
        while busy := [worker for worker in self._workers if worker.due_s < inf]:
            for worker in _ready(busy):
                answer = worker.receive()
                if answer is None:
                    yield from self._lost(worker, campaign)
                    self._start().send(content)
                    continue
                if answer.is_of_chunk:
                    chunk, _ = worker.tasks.popleft()
                    self._note_time(chunk, answer.took_s)
                    self._ended_in_a_row = 0
                if answer.left:
                    self._again.append((answer.left, 0))
                if self._is_to_be_replaced(answer):
                    self._again.extend(worker.tasks)
                    self._remove(worker)
                    self._start().send(content)
                else:
                    self._give_tasks(worker, remaining, campaign.spec.time_out_s)
                if answer.is_of_chunk:
                    yield answer.outcomes
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

    def _give_tasks(
        self, worker: _Worker, missions: Iterator[MissionKey], time_out_s: float
    ) -> None:
        """Give a worker tasks until it has _AHEAD, while there are any; and time for the first."""
        while len(worker.tasks) < _AHEAD:
            if self._again:
                task = self._again.popleft()
            elif chunk := self._next_chunk(missions):
                task = (chunk, 0)
            else:
                break
            worker.tasks.append(task)
            worker.send(task[0])
        if worker.tasks:
            limit_s = time_out_s * len(worker.tasks[0][0]) + _MARGIN_S
            worker.due_s = time.monotonic() + limit_s
        else:
            worker.due_s = inf

    def _next_chunk(self, missions: Iterator[MissionKey]) -> Chunk:
        """Take the next chunk of missions; empty if there are none."""
        most = max(1, min(_LARGEST_CHUNK, self._left // (self._size * _SHARES)))
        chunk: list[MissionKey] = []
        seems_s = 0.0
        while len(chunk) < most and seems_s < _CHUNK_S:
            key = next(missions, None)
            if key is None:
                break
            chunk.append(key)
            seems_s += self._mission_s[key.manager]
        self._left -= len(chunk)
        return tuple(chunk)

    def _note_time(self, chunk: Chunk, took_s: float) -> None:
        """Note how long a chunk took. Its managers' missions seem quicker by half at most: a few
        that are say little about the next ones.
        """
        seemed_s = sum(self._mission_s[key.manager] for key in chunk)
        for manager in {key.manager for key in chunk}:
            self._mission_s[manager] *= max(0.5, took_s / seemed_s)

    def _is_to_be_replaced(self, answer: Answer) -> bool:
        """Whether the reasoner of a worker does not come back, and another worker may do better.

        None does where all missions of a manager lead to that, which are then given up as others
        that take too long.
        """
        for key, outcome in answer.outcomes:
            if not isinstance(outcome, MissionFailure | Remark):
                self._stuck_in_a_row[key.manager] = 0
        if not answer.is_stuck or not answer.outcomes:
            return False
        key, _ = answer.outcomes[-1]
        self._stuck_in_a_row[key.manager] += 1
        return self._stuck_in_a_row[key.manager] < _STUCK_IN_A_ROW

    def _remove(self, worker: _Worker) -> int | None:
        """End a worker, and return its exit status."""
        worker.process.kill()
        worker.connection.close()
        self._workers.remove(worker)
        return worker.join()

    def _lost(self, worker: _Worker, campaign: Campaign) -> Iterator[list[Finished]]:
        """Have what a worker was running when it ended run again, one by one; or yield that it has
        failed.
        """
        status = self._remove(worker)
        self._ended_in_a_row += 1
        if self._ended_in_a_row >= _IN_A_ROW:
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

    def receive(self) -> Answer | None:
        """Receive an answer, None of a process that has ended; an error of the campaign is raised
        here.
        """
        try:
            found = self.connection.recv()
        except (EOFError, OSError):  # also in the middle of a message
            return None
        if isinstance(found, BaseException):
            raise found
        assert isinstance(found, Answer)
        return found

    def join(self) -> int | None:
        """Wait for the process to end, and return its exit status; it is killed if that takes
        long.
        """
        self.process.join(_STOP_TIMEOUT_S)
        self.process.kill()
        self.process.join()
        return self.process.exitcode


def _ready(busy: Sequence[_Worker]) -> list[_Worker]:
    """Wait until some workers have answered or ended, and return them; kill those that are overdue.

    Time in which this process was stopped (Ctrl-Z), as its workers mostly were, does not count.
    """
    began_s = time.monotonic()
    wait_s = max(0.0, min(_LOOK_S, min(worker.due_s for worker in busy) - began_s))
    ready = wait([worker.connection for worker in busy], wait_s)
    stopped_s = time.monotonic() - began_s - wait_s
    for worker in busy:
        if stopped_s > _LOOK_S:
            worker.due_s += stopped_s
        if worker.connection not in ready and time.monotonic() >= worker.due_s:
            worker.is_overdue = True
            worker.process.kill()  # its pipe then ends
    return [worker for worker in busy if worker.connection in ready]


@contextmanager
def _quietly() -> Iterator[None]:
    """Let a process start that leaves Ctrl-C and kill to this one, and imports neither its script
    nor its files.

    It inherits that the signals are blocked. A file such as signal.py in the current folder would
    be taken for Python's own module of that name while Python starts.
    """
    was_safe = os.environ.get(_SAFE_PATH)
    main = sys.modules["__main__"]
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


def finished(
    runner: MissionRunner, missions: Iterable[MissionKey], *, until_stuck: bool = False
) -> list[Finished]:
    """Run missions as MissionRunner.each; without memory for them this process ends as if killed
    for it: a new one begins with little.
    """
    try:
        return list(runner.each(missions, until_stuck=until_stuck))
    except MemoryError:
        os._exit(errno.ENOMEM)


class Answer(NamedTuple):
    """What a worker answers.

    Attributes:
        outcomes: of a chunk's missions.
        left: those that it has not run, because its reasoner does not come back.
        is_stuck: whether that is so.
        is_of_chunk: whether it is about a chunk, and not the first answer, which says that it is
            ready.
        took_s: how long the chunk's missions took.
    """

    outcomes: list[Finished]
    left: Chunk = ()
    is_stuck: bool = False
    is_of_chunk: bool = True
    took_s: float = 0.0


def work(connection: Connection[Any, Any]) -> None:
    """Receive a campaign, then chunks of its missions, and send back their outcomes, until the
    other end is closed.
    """
    import suave_des.simulation.simulator  # noqa: F401 - all that missions need, before the campaign arrives

    ends = suppress(EOFError, BrokenPipeError, ConnectionResetError)
    with ends:  # the campaign is over, or its process has ended
        runner = None
        while True:
            message = connection.recv()
            answer: Answer | Exception
            try:
                if runner is None:
                    runner = MissionRunner(unpacked(message))
                    answer = Answer([], is_of_chunk=False)
                else:
                    left = iter(message)
                    began_s = time.monotonic()
                    outcomes = finished(runner, left, until_stuck=True)
                    took_s = time.monotonic() - began_s
                    answer = Answer(outcomes, tuple(left), reasoner_is_stuck(), took_s=took_s)
            except SuaveDesError as error:
                answer = error
            except Exception:
                answer = RuntimeError(traceback.format_exc())
            connection.send(answer)
