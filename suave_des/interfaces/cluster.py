"""The workers of a Dask cluster as an executor.

Everything that a campaign needs is sent by value; all machines need suave-des and its libraries in
the same versions. A worker is one process that runs one mission after the other (`dask worker
--nworkers N --nthreads 1`).
"""

from __future__ import annotations

import faulthandler
import importlib
import logging
import os
import pickle
import sys
import tempfile
import threading
import uuid
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from distributed import Client, KilledWorker, get_worker

from suave_des.campaign.identity import code_versions
from suave_des.campaign.missions import (
    Campaign,
    Chunk,
    Executor,
    Finished,
    MissionRunner,
    WorkerError,
)
from suave_des.campaign.workers import finished, packed, unpacked
from suave_des.errors import InputError, SuaveDesError
from suave_des.records.store import MissionKey
from suave_des.registry import custom_functions, declared_files, manager_class
from suave_des.user_code import MAIN, user_modules

ANSWER_TIMEOUT_S, _LOOK_S = 10.0, 1.0
"""Time for a scheduler to answer at all; and after which to look whether it is still there."""
_AHEAD = 3
"""Chunks for each worker: one under way and some to go on with."""
_LARGEST_CHUNK, _SHARES = 50, 10
"""Missions in a chunk, which is lost when a campaign is stopped; and chunks that each worker gets
at least.
"""
_EXIT_AFTER_S = 30.0
"""Missions that are so much over their time, in code that cannot be interrupted, end their
worker.
"""


@contextmanager
def connected(scheduler: str) -> Iterator[Executor]:
    """Connect to the cluster of a scheduler, such as tcp://127.0.0.1:8786, until it is no longer
    needed.

    Raises:
        InputError: there is no such scheduler.
    """
    with ExitStack() as stack:
        for name in list(logging.root.manager.loggerDict):
            logger = logging.getLogger(name)
            if name.startswith(("distributed", "tornado", "asyncio")) and not logger.disabled:
                logger.disabled = True  # relevant problems are reported as errors of suave-des
                stack.callback(setattr, logger, "disabled", False)
        try:
            client = stack.enter_context(
                Client(scheduler, timeout=ANSWER_TIMEOUT_S, set_as_default=False)
            )
        except Exception as error:
            problem = f"scheduler: {scheduler} does not answer as a Dask scheduler: {error}"
            raise InputError(
                problem, remedy="check that `dask scheduler` is running there"
            ) from None
        yield partial(_outcomes, client, scheduler)


def _outcomes(
    client: Any, scheduler: str, campaign: Campaign, missions: Iterable[MissionKey], total: int
) -> Iterator[list[Finished]]:
    """Run chunks of missions on whatever workers the cluster has at the time; yield outcomes chunk
    by chunk.

    A worker that dies loses nothing: Dask gives its chunks to others. The missions of chunks with
    which workers die again and again are run alone, one after the other, and one with which they
    die even so has failed.
    """
    token = uuid.uuid4().hex
    under_way = dict[Any, Chunk]()
    suspects = list[MissionKey]()
    # As the result of a task, it can be made again wherever a worker died that had it, and is sent
    # to each once.
    parcel = client.submit(bytes, pack(campaign), key=f"suave_des_parcel-{token}")
    submit = partial(client.submit, run, token, parcel, pure=False)
    try:
        yield from _results(client, submit, missions, total, under_way, suspects)
        for key in suspects:
            yield _alone(submit, campaign, key)
    except SuaveDesError:
        raise
    except Exception as error:
        futures = (parcel, *under_way)
        if client.status != "running" or any(future.cancelled() for future in futures):
            raise WorkerError(f"the connection to the scheduler {scheduler} is lost") from None
        problem = f"a task cannot be run on the cluster: {type(error).__name__}: {error}"
        raise WorkerError(problem) from error
    finally:
        # have the cluster forget the campaign, which may be over or not
        if client.status == "running":
            with suppress(Exception):
                client.cancel([*under_way, parcel], force=True)
                client.run(forget, token, on_error="ignore")


def _results(
    client: Any,
    submit: Callable[[Chunk], Any],
    missions: Iterable[MissionKey],
    total: int,
    under_way: dict[Any, Chunk],
    suspects: list[MissionKey],
) -> Iterator[list[Finished]]:
    """Yield the outcomes of chunks; those with which workers die are added to the suspects."""
    remaining = iter(missions)
    ended = SimpleQueue[Any]()
    while client.status == "running":
        # one that grows with its work begins with none
        workers = max(2, len(client.scheduler_info()["workers"]))
        size = max(1, min(total // (_SHARES * workers), _LARGEST_CHUNK))
        while len(under_way) < _AHEAD * workers and (chunk := tuple(islice(remaining, size))):
            under_way[future := submit(chunk)] = chunk
            future.add_done_callback(ended.put)
        if not under_way:
            return
        with suppress(Empty):  # of one that is lost, Dask need not tell
            future = ended.get(timeout=_LOOK_S)
            chunk = under_way.pop(future)
            try:
                yield future.result()
            except KilledWorker:
                suspects.extend(chunk)
    raise ConnectionError


def _alone(submit: Callable[[Chunk], Any], campaign: Campaign, key: MissionKey) -> list[Finished]:
    """Run a mission in a chunk of its own."""
    try:
        found: list[Finished] = submit((key,)).result()
        return found
    except KilledWorker as error:
        times = f"{error.allowed_failures + 1} times (killed, out of memory, or stuck?)"
        return [campaign.failed(key, f"the cluster's worker died while running it, {times}")]


def pack(campaign: Campaign) -> bytes:
    """Pack a campaign with the versions and the content of every file that it needs."""
    from suave_des.knowledge.resolver import collect

    managers = {name: manager_class(name) for name in campaign.spec.managers}
    loaded = replace(campaign.loaded, manager_files=declared_files(campaign.scenarios(), managers))
    with suppress(InputError):  # reported by the managers that reason with it, if there are any
        loaded = replace(
            loaded,
            ontologies=tuple(sorted(source.path for source in collect(loaded.ontologies).files)),
        )
    functions = [kind for each in campaign.scenarios() for kind in custom_functions(each).values()]
    modules = user_modules(campaign.spec.managers, functions).items()
    # its classes are sent by value
    sources = {place: path.read_bytes() for place, path in modules if place != MAIN}
    files = {
        path: path.read_bytes()
        for path in (*loaded.ontologies, *loaded.rules, *loaded.manager_files.values())
    }
    return pickle.dumps((code_versions(), packed(replace(campaign, loaded=loaded)), files, sources))


# What runs on a worker: missions of one campaign at a time, prepared anew for another one.

_current: dict[str, tuple[MissionRunner, ExitStack]] = {}
"""What runs missions of a campaign, and what removes its files and modules, by its token."""
_lock = threading.Lock()
"""Missions run one at a time, however many threads a worker has: they need the process for
themselves.
"""


def run(token: str, parcel: bytes, chunk: Chunk) -> list[Finished]:
    """Run missions of a campaign, for which its token stands, in this process, and return their
    outcomes.

    `parcel` is what pack returned on the machine that it was started on. Missions in code that
    cannot be interrupted end the process, like those that have no memory.

    Raises:
        InputError: the campaign cannot be run here.
    """
    with _lock, Path(os.devnull).open("w") as nowhere:
        if token not in _current:
            forget(*_current)
            _current[token] = _prepared(parcel)
        runner, _ = _current[token]
        limit_s = len(chunk) * runner.campaign.spec.time_out_s + _EXIT_AFTER_S
        faulthandler.dump_traceback_later(limit_s, exit=True, file=nowhere)
        try:
            return finished(runner, chunk)
        finally:
            faulthandler.cancel_dump_traceback_later()


def _prepared(parcel: bytes) -> tuple[MissionRunner, ExitStack]:
    """Write what was packed into a folder; return what runs the missions, and what removes the
    folder again.
    """
    versions, content, files, sources = pickle.loads(parcel)
    worker = get_worker()
    for name, value in sorted(versions.items() - code_versions().items()):
        problem = f"{name} is {code_versions().get(name, 'missing')} on worker {worker.address}, and {value} here"
        raise InputError(
            f"{problem}, which could change results", remedy="install the same version everywhere"
        )
    with ExitStack() as stack:
        folder = Path(
            stack.enter_context(
                tempfile.TemporaryDirectory(prefix="suave-des-", dir=worker.local_directory)
            )
        )

        def written(place: str, text: bytes) -> Path:
            (path := folder / place).parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
            return path

        for place, text in sources.items():
            written(f"modules/{place}", text)
            module = place.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
            sys.modules.pop(module, None)
            stack.callback(sys.modules.pop, module, None)
        importlib.invalidate_caches()
        sys.path.insert(0, str(folder / "modules"))
        stack.callback(sys.path.remove, str(folder / "modules"))
        # Each file is in a folder of its own: it keeps its name, which counts, and is beside no
        # other.
        here = {
            path: written(f"{n:06}/{path.name}", text)
            for n, (path, text) in enumerate(files.items())
        }
        campaign = unpacked(content)
        loaded = replace(
            campaign.loaded,
            ontologies=tuple(here[path] for path in campaign.loaded.ontologies),
            rules=tuple(here[path] for path in campaign.loaded.rules),
            manager_files={
                name: here[path] for name, path in campaign.loaded.manager_files.items()
            },
        )
        return MissionRunner(replace(campaign, loaded=loaded)), stack.pop_all()


def forget(*tokens: str) -> None:
    """Remove what was prepared for campaigns."""
    for token in _current.keys() & tokens:
        _current.pop(token)[1].close()
