"""The workers of a Dask cluster as an executor: this side of it. What runs on the workers is in dask_worker.py.

Everything goes by value, and as plain bytes and numbers: the scheduler needs Dask alone. Workers need suave-des of this
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
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any

from suave_des.campaign.dask_worker import Order, Report, needs
from suave_des.campaign.executors import WorkerError
from suave_des.campaign.mission_process import Trouble
from suave_des.campaign.outcomes import Finished, Job, time_out_cause
from suave_des.campaign.parcel import pack
from suave_des.campaign.plan import Chunk, MissionKey
from suave_des.errors import InputError
from suave_des.knowledge.inference_cache import InferenceCache

ANSWER_TIMEOUT_S = 10.0
"""Time for a scheduler to answer at all."""
_CHECK_TIMEOUT_S = 120.0
"""Time for workers to import suave-des, perhaps from a slow shared disk."""
_STOP_TIMEOUT_S = 5.0
_LOOK_PERIOD_S = 2.0
"""Time between looks at how many workers there are."""
_TELL_AFTER_S = 10.0
"""Time without any worker after which the user is told."""
_AHEAD = 3
"""Chunks for each thread of a worker: one under way and some to go on with, wherever the scheduler puts them."""
_FEWEST_THREADS = 2
"""Assumed while there are none, so that a cluster that grows when there is work to do does so."""
_CHUNK_S = 1.0
"""Work in a chunk; no more, as chunks under way are lost when a campaign is stopped."""
_CHUNK_COST_S = 0.01
"""Of the scheduler's and this process's time: with many threads chunks are larger, so that these keep up."""
_FIRST_CHUNK, _LARGEST_CHUNK = 10, 10_000
_SHARES = 4
"""Chunks that each thread gets of what is left, at least, so that all end together."""
_ADDRESS = re.compile(r"(?:tcp|tls)://(?:\[[0-9A-Fa-f:.%]+\]|[^\s/:@\[\]]+):(\d{1,5})/?")
_NOISY = ("distributed", "dask", "tornado", "asyncio", "bokeh")

_logger = logging.getLogger("suave_des")


def check_address(scheduler: str) -> None:
    """See that a text can be a scheduler's address.

    Raises:
        InputError: it cannot.
    """
    found = _ADDRESS.fullmatch(scheduler)
    if found is None or not 0 < int(found[1]) < 65536:
        raise InputError(
            f"scheduler: {scheduler!r} is no address of a Dask scheduler",
            remedy="give tcp://HOST:PORT, as `dask scheduler` prints it",
        )


@contextmanager
def connected(scheduler: str) -> Iterator[DaskCluster]:
    """The cluster of a scheduler, until it is no longer needed.

    Args:
        scheduler: its address, such as tcp://127.0.0.1:8786.

    Raises:
        InputError: there is no such scheduler, or a worker cannot do what this machine would.
    """
    check_address(scheduler)
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            f"a scheduler needs Dask, which is not installed ({error})", remedy="pip install 'suave-des[dask]'"
        ) from None
    with _quiet(distributed):
        client = _client(distributed, scheduler)
        try:
            _check_versions(client, distributed)
            _check_workers(client)
            yield DaskCluster(client, scheduler)
        finally:
            client.close(timeout=_STOP_TIMEOUT_S)


def _client(distributed: Any, scheduler: str) -> Any:
    # Asked first in our own way, as a Client waits for ever for one who takes the connection and says nothing.
    kind = _in_time(lambda: asyncio.run(_kind(distributed, scheduler)), ANSWER_TIMEOUT_S + 1.0)
    if kind not in (None, "Scheduler"):
        raise InputError(f"scheduler: {scheduler} is a Dask {kind.lower()}", remedy="give its scheduler's address")
    try:
        if kind is not None:
            return distributed.Client(scheduler, timeout=ANSWER_TIMEOUT_S, set_as_default=False)
    except OSError:  # it ended in between
        pass
    raise InputError(
        f"scheduler: {scheduler} does not answer as a Dask scheduler within {ANSWER_TIMEOUT_S:g} s",
        remedy="see that `dask scheduler` runs there, and that its port can be reached from here",
    )


async def _kind(distributed: Any, address: str) -> str:
    """What kind of part of a cluster is at an address."""

    async def ask() -> str:
        settings = distributed.Security().get_connection_args("client")
        comm = await distributed.comm.connect(address, **settings)
        try:
            await comm.write({"op": "identity", "reply": True})
            return str((await comm.read())["type"])
        finally:
            comm.abort()

    return await asyncio.wait_for(ask(), ANSWER_TIMEOUT_S)


@contextmanager
def _quiet(distributed: Any) -> Iterator[None]:
    """Keep what Dask logs and warns of off the terminal: what matters is told in our own words."""

    def drop(record: logging.LogRecord) -> bool:
        return False

    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] in _NOISY]
    places: list[Any] = [logging.getLogger(name) for name in names]
    places += [handler for logger in places for handler in logger.handlers]
    for place in places:
        place.addFilter(drop)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", distributed.versions.VersionMismatchWarning)
            warnings.filterwarnings("ignore", message="Sending large graph")
            yield
    finally:
        for place in places:
            place.removeFilter(drop)


def _check_versions(client: Any, distributed: Any) -> None:
    """See that Python and Dask are the same everywhere, which what is sent depends on."""
    found = client.get_versions()
    here = found["client"]["packages"]
    for where, there in [("the scheduler", found["scheduler"]), *_named(found["workers"])]:
        for name in ("distributed",) if where == "the scheduler" else ("python", "distributed"):
            if there is not None and there["packages"][name] != here[name]:
                raise _misfit(where, {name: here[name]}, {name: there["packages"][name]})


def _named(workers: Mapping[str, Any]) -> list[tuple[str, Any]]:
    return [(f"worker {address}", workers[address]) for address in sorted(workers)]


def _check_workers(client: Any) -> None:
    found = _in_time(lambda: client.run(_remote_needs(), on_error="return"), _CHECK_TIMEOUT_S)
    if found is None:
        raise InputError(
            f"scheduler: some of its workers do not answer within {_CHECK_TIMEOUT_S:g} s",
            remedy="restart them, or end them",
        )
    for where, there in _named(found):
        if isinstance(there, BaseException):
            raise _unfit(where, there)
        if there != needs():
            raise _misfit(where, needs(), there)


def _unfit(where: str, error: BaseException) -> InputError:
    return InputError(
        f"{where} cannot run missions: {type(error).__name__}: {error}",
        remedy=f"install suave-des {needs()['suave-des']} on all workers",
    )


def _misfit(where: str, here: Mapping[str, str], there: Mapping[str, str]) -> InputError:
    name = next(name for name in here if there.get(name) != here[name])
    return InputError(
        f"{name} is {there.get(name, 'not there')} on {where}, and {here[name]} here, which could change results",
        remedy="install the same on all machines",
    )


def _in_time(call: Callable[[], Any], timeout_s: float) -> Any:
    """What a call returns, or none if it takes too long or fails."""
    result: list[Any] = []

    def work() -> None:
        with suppress(Exception):
            result.append(call())

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(timeout_s)
    return result[0] if result else None


# Functions that run on the workers. Each is made inside another, as pickle then takes it along by value: a function of
# a module would go by the module's name, and the scheduler, which need not have suave-des, would fail to look it up.


def _remote_same() -> Callable[[bytes], bytes]:
    def suave_des_parcel(content: bytes) -> bytes:
        return content

    return suave_des_parcel


def _remote_run() -> Callable[..., tuple[str, Any]]:
    def suave_des_missions(order: bytes, chunk: bytes) -> tuple[str, Any]:
        import pickle

        from distributed import get_worker

        worker = get_worker()
        try:
            from suave_des.campaign.dask_worker import Order, run
        except ImportError as error:
            return worker.address, error
        return worker.address, run(Order(*pickle.loads(order)), pickle.loads(chunk), worker.local_directory)

    return suave_des_missions


def _remote_needs() -> Callable[[], dict[str, str]]:
    def suave_des_needs() -> dict[str, str]:
        from suave_des.campaign.dask_worker import needs

        return needs()

    return suave_des_needs


def _remote_forget() -> Callable[[str], None]:
    def suave_des_forget(token: str) -> None:
        from suave_des.campaign.dask_worker import forget

        forget(token)

    return suave_des_forget


class DaskCluster:
    """Runs chunks of missions on whatever workers the cluster has at the time.

    A worker that dies loses nothing: Dask gives its chunks to others. Where workers die again and again with a chunk,
    Dask suspects all chunks that they had; then the missions of these are run alone, one after the other, and one with
    which workers die even so has failed.

    Args:
        client: connected to the scheduler.
        scheduler: its address, for messages.
    """

    def __init__(self, client: Any, scheduler: str) -> None:
        self._client, self._scheduler = client, scheduler

    def outcomes(self, job: Job, missions: Iterable[MissionKey], total: int) -> Iterator[list[Finished]]:
        """Outcomes chunk by chunk; see Executor."""
        flow = _Flow(self._client, self._scheduler, job, iter(missions), total)
        try:
            yield from flow.outcomes()
        finally:
            flow.stop()


class _Flow:
    """A campaign on its way through the cluster: a few chunks for each thread at any time."""

    def __init__(self, client: Any, scheduler: str, job: Job, missions: Iterator[MissionKey], total: int) -> None:
        self._client, self._scheduler, self._job, self._missions = client, scheduler, job, missions
        self._left = total
        self._token = uuid.uuid4().hex
        self._suspects: deque[MissionKey] = deque()
        self._suspect: Any = None
        self._under_way: dict[Any, Chunk] = {}
        self._ended: SimpleQueue[Any] = SimpleQueue()
        self._number = 0
        self._mission_s: float | None = None
        self._threads, self._looked_s = 0, -_LOOK_PERIOD_S
        self._alone_since_s: float | None = None
        self._run = _remote_run()
        order = tuple(Order(self._token, needs(), pickle.dumps(pack(job)), job.time_out_s))
        # As the result of a task, it can be made again wherever a worker died that had it, and is sent to each once.
        self._order = client.submit(_remote_same(), pickle.dumps(order), key=f"suave_des_parcel-{self._token}")

    def outcomes(self) -> Iterator[list[Finished]]:
        self._hand_out()
        while self._under_way:
            for future in self._wait():
                chunk = self._under_way.pop(future)
                finished = list(self._received(future, chunk))
                self._hand_out()
                if finished:
                    yield finished

    def stop(self) -> None:
        """Have the cluster forget the campaign, which may be over or not."""
        if self._client.status == "running":
            futures = [*self._under_way, self._order]
            _in_time(lambda: self._client.cancel(futures, force=True), _STOP_TIMEOUT_S)
            _in_time(lambda: self._client.run(_remote_forget(), self._token, on_error="ignore"), _STOP_TIMEOUT_S)

    # Chunks.

    def _hand_out(self) -> None:
        self._look()
        while len(self._under_way) < _AHEAD * max(self._threads, _FEWEST_THREADS):
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
        future = self._client.submit(self._run, self._order, pickle.dumps(tuple(map(tuple, chunk))), key=key)
        self._under_way[future] = chunk
        future.add_done_callback(self._ended.put)
        return future

    def _size(self) -> int:
        fair = self._left // (_SHARES * max(self._threads, 1))
        chunk_s = max(_CHUNK_S, _CHUNK_COST_S * self._threads)
        enough = _FIRST_CHUNK if self._mission_s is None else int(chunk_s / max(self._mission_s, 1e-6))
        return max(1, min(fair, enough, _LARGEST_CHUNK))

    def _wait(self) -> list[Any]:
        """Futures that are over; none after a while, so that new workers and a lost scheduler are noticed."""
        over = []
        with suppress(Empty):
            over.append(self._ended.get(timeout=_LOOK_PERIOD_S))
            while True:
                over.append(self._ended.get_nowait())
        if not over:
            self._hand_out()
        return over

    def _look(self) -> None:
        """See how many threads there are, from time to time."""
        if self._client.status != "running":
            raise self._lost()
        if time.monotonic() < self._looked_s + _LOOK_PERIOD_S:
            return
        try:
            self._threads = sum(self._client.nthreads().values())
        except OSError:
            raise self._lost() from None
        self._looked_s = time.monotonic()
        if self._threads:
            self._alone_since_s = None
        elif self._alone_since_s is None:
            self._alone_since_s = self._looked_s
        elif self._looked_s > self._alone_since_s + _TELL_AFTER_S:
            _logger.warning("suave-des: %s has no workers; waiting for some (Ctrl-C stops)", self._scheduler)
            self._alone_since_s = math.inf  # told

    def _lost(self) -> WorkerError:
        return WorkerError(f"the connection to the scheduler {self._scheduler} is lost")

    # Results.

    def _received(self, future: Any, chunk: Chunk) -> Iterator[Finished]:
        from distributed import KilledWorker

        was_alone = future is self._suspect
        if was_alone:
            self._suspect = None
        try:
            worker, result = future.result()
        except KilledWorker as error:
            if was_alone:
                self._left -= 1
                times = error.allowed_failures + 1
                cause = f"the cluster's worker died with it, {times} times (killed, or out of memory?)"
                yield self._job.failed(chunk[0], cause)
            else:
                self._suspects.extend(chunk)
            return
        except Exception as error:
            if future.cancelled() or self._client.status != "running":
                raise self._lost() from None
            raise WorkerError(f"a task cannot be run on the cluster: {type(error).__name__}: {error}") from error
        if isinstance(result, Report):
            yield from self._reported(result)
        elif isinstance(result, Trouble):
            raise _trouble(f"worker {worker}", result)
        elif isinstance(result, BaseException):
            raise _unfit(f"worker {worker}", result)
        else:
            raise _misfit(f"worker {worker}", needs(), result)

    def _reported(self, report: Report) -> Iterator[Finished]:
        for learned in report.learned:
            for digest, entries in learned.items():
                InferenceCache(digest).take_over(entries)
        self._left -= report.missions
        if report.missions:
            each_s = report.seconds / report.missions
            self._mission_s = each_s if self._mission_s is None else 0.5 * (self._mission_s + each_s)
        for part in report.parts:
            yield from pickle.loads(part)
        for key, cause in report.lost:
            yield self._job.failed(MissionKey(*key), cause or time_out_cause(self._job.time_out_s))


def _trouble(where: str, trouble: Trouble) -> Exception:
    """What a worker could not do, as the error that it is here."""
    if trouble.error is None:
        return RuntimeError(f"on {where}:\n{trouble.traceback}")
    error = pickle.loads(trouble.error)
    if isinstance(error, InputError) and error.file is None:
        return type(error)(f"{where}: {error.problem}", place=error.place, remedy=error.remedy)
    if isinstance(error, WorkerError):
        return WorkerError(f"{where}: {error}")
    assert isinstance(error, Exception)
    return error
