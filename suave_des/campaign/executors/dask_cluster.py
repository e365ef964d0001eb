"""The workers of a Dask cluster as an executor: this side of it. What runs on the workers is in dask_worker.py.

Everything is sent by value, as plain bytes and numbers: the scheduler needs only Dask. Workers need suave-des of this
very version.
"""

from __future__ import annotations

import asyncio
import logging
import math
import pickle
import re
import threading
import time
import uuid
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any

from suave_des.campaign.executors.dask_worker import misfit, needs, pack
from suave_des.campaign.missions import Chunk, Finished, JobSpec, MissionKey, WorkerError
from suave_des.errors import InputError, SuaveDesError

ANSWER_TIMEOUT_S = 10.0
"""Time for a scheduler to answer at all."""
_CHECK_TIMEOUT_S = 120.0
"""Time for workers to import suave-des, perhaps from a slow shared disk."""
_STOP_TIMEOUT_S = 5.0
_POLL_PERIOD_S = 2.0
"""Time between looks at how many workers there are."""
_WARN_AFTER_S = 10.0
"""Time without any worker after which the user is warned."""
_AHEAD = 3
"""Chunks for each worker: one under way and some to go on with, wherever the scheduler puts them."""
_FEWEST_WORKERS = 2
"""Assumed while there are none, so that a cluster that grows when there is work to do does so."""
_CHUNK_S = 1.0
"""Work in a chunk; no more, as chunks under way are lost when a campaign is stopped."""
_FIRST_CHUNK, _LARGEST_CHUNK = 10, 10_000
_SHARES = 4
"""Chunks that each worker gets of what is left, at least, so that all end together."""
_ADDRESS = re.compile(r"(?:tcp|tls)://(?:\[[0-9A-Fa-f:.%]+\]|[^\s/:@\[\]]+):(\d{1,5})/?")
_NOISY = ("distributed", "dask", "tornado", "asyncio", "bokeh")

_logger = logging.getLogger("suave_des")


def check_scheduler(scheduler: str, workers: int) -> None:
    """Check that a text can be a scheduler's address, and that no local workers are requested as well.

    Raises:
        InputError: it cannot, or there are.
    """
    if workers != 1:
        raise InputError(
            f"workers: {workers} cannot be used with a scheduler, whose own workers run the missions",
            remedy="omit it; `dask worker --nworkers N` sets how many missions run there at a time",
        )
    found = _ADDRESS.fullmatch(scheduler)
    if found is None or not 0 < int(found[1]) < 65536:
        raise InputError(
            f"scheduler: {scheduler!r} is not an address of a Dask scheduler",
            remedy="give tcp://HOST:PORT, as `dask scheduler` prints it",
        )


@contextmanager
def connected(scheduler: str) -> Iterator[DaskCluster]:
    """Connect to the cluster of a scheduler, until it is no longer needed.

    Args:
        scheduler: its address, such as tcp://127.0.0.1:8786.

    Raises:
        InputError: there is no such scheduler, or a worker cannot do what this machine would.
    """
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            f"a scheduler needs Dask, which is not installed ({error})", remedy="pip install 'suave-des[dask]'"
        ) from None
    with _quiet(distributed):
        client = _client(distributed, scheduler)
        try:
            _check_workers(client)
            yield DaskCluster(client, scheduler)
        finally:
            client.close(timeout=_STOP_TIMEOUT_S)


def _client(distributed: Any, scheduler: str) -> Any:
    async def kind() -> str:
        async with distributed.rpc(scheduler) as there:
            return str((await there.identity())["type"])

    # Asked first, and with a limit of our own: a Client waits for ever for one who accepts and does not answer.
    found = _in_time(lambda: asyncio.run(asyncio.wait_for(kind(), ANSWER_TIMEOUT_S)), ANSWER_TIMEOUT_S + 1.0)
    if found not in (None, "Scheduler"):
        raise InputError(f"scheduler: {scheduler} is a Dask {found.lower()}", remedy="give its scheduler's address")
    with suppress(OSError):  # it ended in between
        if found is not None:
            return distributed.Client(scheduler, timeout=ANSWER_TIMEOUT_S, set_as_default=False)
    raise InputError(
        f"scheduler: {scheduler} does not answer as a Dask scheduler within {ANSWER_TIMEOUT_S:g} s",
        remedy="check that `dask scheduler` is running there, and that its port can be reached from here",
    )


@contextmanager
def _quiet(distributed: Any) -> Iterator[None]:
    """Keep Dask's logs and warnings off the terminal: relevant problems are reported as errors of suave-des."""

    def drop(record: logging.LogRecord) -> bool:
        return False

    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in _NOISY]
    filtered: list[Any] = [logging.getLogger(name) for name in names]
    filtered += [handler for logger in filtered for handler in logger.handlers]
    for each in filtered:
        each.addFilter(drop)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", distributed.versions.VersionMismatchWarning)
            warnings.filterwarnings("ignore", message="Sending large graph")
            yield
    finally:
        for each in filtered:
            each.removeFilter(drop)


def _check_workers(client: Any) -> None:
    """Check that workers have all that decides results, and first of all the Python that what is sent depends on."""
    found = client.get_versions()
    here = found["client"]["packages"]
    for address, there in sorted(found["workers"].items()):
        for name in ("python", "distributed"):
            if there["packages"][name] != here[name]:
                raise misfit(f"worker {address}", {name: here[name]}, {name: there["packages"][name]})
    answers = _in_time(lambda: client.run(_remote(), "needs", on_error="return"), _CHECK_TIMEOUT_S)
    if answers is None:
        raise InputError(
            f"scheduler: some of its workers do not answer within {_CHECK_TIMEOUT_S:g} s",
            remedy="restart or stop them",
        )
    for address, there in sorted(answers.items()):
        if isinstance(there, BaseException):
            raise InputError(
                f"worker {address} cannot run missions: {type(there).__name__}: {there}",
                remedy=f"install suave-des {needs()['suave-des']} on all workers",
            )
        if there != needs():
            raise misfit(f"worker {address}", needs(), there)


def _in_time(call: Callable[[], Any], timeout_s: float) -> Any:
    """Return what a call returns, or None if it takes too long or fails."""
    result: list[Any] = []

    def work() -> None:
        with suppress(Exception):
            result.append(call())

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(timeout_s)
    return result[0] if result else None


def _remote() -> Callable[..., Any]:
    """Return a function that calls one of dask_worker.py on a worker.

    It is made inside another, as pickle then takes it along by value: a function of a module would go by the module's
    name, and the scheduler, which need not have suave-des, would fail to look it up.
    """

    def suave_des(name: str, *arguments: Any) -> Any:
        from suave_des.campaign.executors import dask_worker

        return getattr(dask_worker, name)(*arguments)

    return suave_des


class DaskCluster:
    """Runs chunks of missions on whatever workers the cluster has at the time; an Executor.

    A worker is one process that runs one mission after the other (`dask worker --nworkers N --nthreads 1`). One that
    dies loses nothing: Dask gives its chunks to others. Where workers die again and again with a chunk, Dask suspects
    all chunks that they had; then the missions of these are run alone, one after the other, and one with which workers
    die even so has failed.

    Args:
        client: connected to the scheduler.
        scheduler: its address, for messages.
    """

    def __init__(self, client: Any, scheduler: str) -> None:
        self._client, self._scheduler = client, scheduler
        self._token = uuid.uuid4().hex
        self._suspects: deque[MissionKey] = deque()
        self._suspect: Any = None
        self._under_way: dict[Any, Chunk] = {}
        self._ended: SimpleQueue[Any] = SimpleQueue()
        self._number = 0
        self._mission_s: float | None = None
        self._workers, self._polled_s = 0, -_POLL_PERIOD_S
        self._alone_since_s: float | None = None
        self._remote = _remote()

    def outcomes(self, job: JobSpec, missions: Iterable[MissionKey], total: int) -> Iterator[list[Finished]]:
        """Yield outcomes chunk by chunk; see Executor."""
        self._job, self._missions, self._left = job, iter(missions), total
        # As the result of a task, it can be made again wherever a worker died that had it, and is sent to each once.
        key = f"suave_des_parcel-{self._token}"
        self._parcel = self._client.submit(bytes, pickle.dumps(pack(job)), key=key)
        try:
            self._hand_out()
            while self._under_way:
                for future in self._wait():
                    chunk = self._under_way.pop(future)
                    finished = self._received(future, chunk)
                    self._hand_out()
                    if finished:
                        yield finished
        finally:
            self._stop()

    def _stop(self) -> None:
        """Have the cluster forget the campaign, which may be over or not."""
        if self._client.status == "running":
            futures = [*self._under_way, self._parcel]
            _in_time(lambda: self._client.cancel(futures, force=True), _STOP_TIMEOUT_S)
            _in_time(lambda: self._client.run(self._remote, "forget", self._token, on_error="ignore"), _STOP_TIMEOUT_S)

    # Chunks.

    def _hand_out(self) -> None:
        self._poll()
        while len(self._under_way) < _AHEAD * max(self._workers, _FEWEST_WORKERS):
            if self._suspects and self._suspect is None:
                self._suspect = self._submit((self._suspects.popleft(),))
                continue
            chunk = tuple(islice(self._missions, self._size()))
            if not chunk:
                return
            self._submit(chunk)

    def _submit(self, chunk: Chunk) -> Any:
        self._number += 1
        key = f"suave_des_missions-{self._token}-{self._number}"
        keys = pickle.dumps(tuple(map(tuple, chunk)))
        future = self._client.submit(self._remote, "run", self._token, needs(), self._parcel, keys, key=key)
        self._under_way[future] = chunk
        future.add_done_callback(self._ended.put)
        return future

    def _size(self) -> int:
        fair = self._left // (_SHARES * max(self._workers, 1))
        enough = _FIRST_CHUNK if self._mission_s is None else int(_CHUNK_S / max(self._mission_s, 1e-6))
        return max(1, min(fair, enough, _LARGEST_CHUNK))

    def _wait(self) -> list[Any]:
        """Return futures that have ended, possibly none, so that new workers and a lost scheduler are noticed."""
        ended = []
        with suppress(Empty):
            ended.append(self._ended.get(timeout=_POLL_PERIOD_S))
            while True:
                ended.append(self._ended.get_nowait())
        if not ended:
            self._hand_out()
        return ended

    def _poll(self) -> None:
        """Check how many workers there are, from time to time."""
        if self._client.status != "running":
            raise self._lost()
        if time.monotonic() < self._polled_s + _POLL_PERIOD_S:
            return
        try:
            self._workers = len(self._client.nthreads())
        except OSError:
            raise self._lost() from None
        self._polled_s = time.monotonic()
        if self._workers:
            self._alone_since_s = None
        elif self._alone_since_s is None:
            self._alone_since_s = self._polled_s
        elif self._polled_s > self._alone_since_s + _WARN_AFTER_S:
            _logger.warning("suave-des: %s has no workers; waiting for some (Ctrl-C stops)", self._scheduler)
            self._alone_since_s = math.inf  # warned

    def _lost(self) -> WorkerError:
        return WorkerError(f"the connection to the scheduler {self._scheduler} is lost")

    # Results.

    def _received(self, future: Any, chunk: Chunk) -> list[Finished]:
        from distributed import KilledWorker

        was_alone = future is self._suspect
        if was_alone:
            self._suspect = None
        try:
            seconds, finished = pickle.loads(future.result())
        except KilledWorker as error:
            if not was_alone:
                self._suspects.extend(chunk)
                return []
            self._left -= 1
            times = error.allowed_failures + 1
            cause = f"the cluster's worker died while running it, {times} times (killed, out of memory, or stuck?)"
            return [self._job.failed(chunk[0], cause)]
        except SuaveDesError:
            raise
        except Exception as error:
            if future.cancelled() or self._client.status != "running":
                raise self._lost() from None
            raise WorkerError(f"a task cannot be run on the cluster: {type(error).__name__}: {error}") from error
        self._left -= len(chunk)
        each_s = seconds / len(chunk)
        self._mission_s = each_s if self._mission_s is None else 0.5 * (self._mission_s + each_s)
        return list(finished)
