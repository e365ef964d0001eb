"""Where missions run: in this process, or in worker processes.

An executor takes chunks of missions and gives their outcomes, in whatever order they finish. Everything that a worker
needs travels to it by value.
"""

from __future__ import annotations

import multiprocessing
import signal
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Protocol

from suave_des.campaign.outcomes import MissionRunner, Outcome
from suave_des.campaign.plan import Chunk, RunSpec, chunked
from suave_des.errors import SuaveDesError
from suave_des.scenario.loader import LoadedScenario

Finished = tuple[int, list[Outcome]]
"""Number of a chunk, counted from 0, and the outcomes of its missions."""

_AHEAD = 2
"""Chunks at a worker at any time: one under way, one waiting, so that it is never idle."""
_LARGEST_CHUNK = 10
_STOP_TIMEOUT_S = 5.0


class Executor(Protocol):
    """Runs missions somewhere."""

    def outcomes(self, loaded: LoadedScenario, missions: Iterable[RunSpec], total: int) -> Iterator[Finished]:
        """Outcomes by chunk, in the order in which they finish; chunk numbers follow the order of the missions.

        Args:
            loaded: the scenario with its files.
            missions: to run.
            total: how many there are.
        """
        ...


def make_executor(workers: int) -> Executor:
    """The executor for a number of workers: with one, missions run in this process."""
    return InProcess() if workers == 1 else ProcessPool(workers)


class InProcess:
    """Runs missions one after the other in this process."""

    def outcomes(self, loaded: LoadedScenario, missions: Iterable[RunSpec], total: int) -> Iterator[Finished]:
        """Outcomes mission by mission; see Executor."""
        runner = MissionRunner(loaded)
        for number, spec in enumerate(missions):
            yield number, runner.run((spec,))


class WorkerError(SuaveDesError):
    """A worker process ended before its work was done."""


@dataclass(frozen=True)
class _Crash:
    """What a worker sends instead of outcomes when it cannot go on."""

    error: SuaveDesError | None
    traceback: str


class ProcessPool:
    """Runs chunks of missions in worker processes.

    Workers are spawned, never forked: a forked child would hang on the Java machine of its parent.

    Args:
        workers: number of processes.
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers

    def outcomes(self, loaded: LoadedScenario, missions: Iterable[RunSpec], total: int) -> Iterator[Finished]:
        """Outcomes chunk by chunk; see Executor.

        Raises:
            InputError: the scenario, a manager or the knowledge base cannot be used at all.
            WorkerError: a worker was killed, or ran out of memory.
        """
        size = chunk_size(total, self._workers)
        chunks = enumerate(chunked(missions, size))
        with _crew(loaded, min(self._workers, -(-total // size))) as crew:
            waiting = dict.fromkeys(crew, 0)
            for _ in range(_AHEAD):
                for connection in crew:
                    waiting[connection] += _hand_out(chunks, connection)
            while any(waiting.values()):
                ready = wait([connection for connection, chunks_there in waiting.items() if chunks_there])
                for connection in [each for each in crew if each in ready]:
                    finished = _received(connection, crew[connection])
                    waiting[connection] += _hand_out(chunks, connection) - 1
                    yield finished


def chunk_size(total: int, workers: int) -> int:
    """Missions to a chunk: small, as chunks under way are lost when a campaign is stopped, and workers end together."""
    return max(1, min(_LARGEST_CHUNK, total // (workers * 10)))


@contextmanager
def _crew(loaded: LoadedScenario, workers: int) -> Iterator[dict[Connection, BaseProcess]]:
    """Worker processes by the connection to each; stopped at the end, at once if it comes by an exception."""
    context = multiprocessing.get_context("spawn")
    crew: dict[Connection, BaseProcess] = {}
    try:
        with _interrupts_held():
            for _ in range(workers):
                ours, theirs = context.Pipe()
                process: BaseProcess = context.Process(target=_work, args=(theirs, loaded), daemon=True)
                process.start()
                theirs.close()
                crew[ours] = process
        yield crew
        for connection in crew:
            with suppress(BrokenPipeError):  # its work is done: no matter if it is gone already
                connection.send(None)
        for process in crew.values():
            process.join(_STOP_TIMEOUT_S)
    finally:
        for connection, process in crew.items():
            connection.close()
            process.terminate()
        for process in crew.values():
            process.join(_STOP_TIMEOUT_S)
            if process.is_alive():
                process.kill()
                process.join()


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C back while workers start: they inherit it, so that Ctrl-C reaches this process alone."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _hand_out(chunks: Iterator[tuple[int, Chunk]], connection: Connection) -> int:
    """Send the next chunk, if there is one; the number of chunks sent."""
    chunk = next(chunks, None)
    if chunk is None:
        return 0
    with suppress(BrokenPipeError):  # the worker is gone, which receiving from it tells, with the reason
        connection.send(chunk)
    return 1


def _received(connection: Connection, process: BaseProcess) -> Finished:
    try:
        message: Finished | _Crash = connection.recv()
    except (EOFError, ConnectionResetError):
        process.join(_STOP_TIMEOUT_S)
        raise WorkerError(
            f"a worker process ended with status {process.exitcode} before its missions were done"
            " (killed, or out of memory?)"
        ) from None
    if isinstance(message, _Crash):
        raise message.error or RuntimeError(f"in a worker process:\n{message.traceback}")
    return message


def _work(connection: Connection, loaded: LoadedScenario) -> None:
    """Life of a worker process: chunks in, outcomes out, until there are no more or the parent is gone."""
    try:
        runner = MissionRunner(loaded)
        while (message := connection.recv()) is not None:
            number, chunk = message
            connection.send((number, runner.run(chunk)))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return
    except Exception as error:
        connection.send(_Crash(error if isinstance(error, SuaveDesError) else None, traceback.format_exc()))
