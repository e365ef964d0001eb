"""A process of its own that runs missions for a worker of a cluster, beside the worker's.

A cluster's worker outlives campaigns and runs its tasks in threads. A process for each thread makes them independent:
a manager that ends its process or never returns costs a mission and not the worker, another campaign's modules are not
in the way, each has a Java of its own, and threads do not wait for one another.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import time
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from suave_des.campaign.missions import MissionRunner
    from suave_des.campaign.parcel import Unpacked

FLUSH_S = 0.2
"""Finished missions are told of after this time at the latest, once another is finished."""
OUT_OF_MEMORY = 12
"""Exit status when memory was asked for in vain (the system's number of that error)."""
_IDLE_S = 120.0
"""A process that is asked for nothing ends after this time: its campaign may have been killed."""


class Ready(NamedTuple):
    """The job is unpacked, and missions can be asked for."""


class Part(NamedTuple):
    """Some missions of a chunk are finished: how many, and their outcomes, pickled."""

    missions: int
    outcomes: bytes


class Done(NamedTuple):
    """A chunk is finished; what the reasoner's memories got besides, by their digests."""

    learned: dict[str, bytes]


class Trouble(NamedTuple):
    """No mission of this job can be run: an error for the user, pickled, or the traceback of another."""

    error: bytes | None
    traceback: str


Message = Ready | Part | Done | Trouble


def main() -> None:
    """Life of the process: a parcel, then chunks in, outcomes out, until the worker is gone or asks for no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    connection = Connection(int(sys.argv[2]))
    requests: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_receive, args=(connection, requests), daemon=True).start()
    try:
        _serve(connection, requests)
    except (BrokenPipeError, ConnectionResetError):
        return
    except MemoryError:
        os._exit(OUT_OF_MEMORY)


def _receive(connection: Connection, requests: SimpleQueue[bytes]) -> None:
    """Take in what is asked for, and end the process with the worker's, at once and whatever a mission does."""
    try:
        while True:
            requests.put(connection.recv_bytes())
    except (EOFError, OSError):
        os._exit(0)


def _serve(connection: Connection, requests: SimpleQueue[bytes]) -> None:
    from suave_des.errors import SuaveDesError

    unpacked: Unpacked | None = None
    try:
        unpacked, runner = _opened(requests.get())
        connection.send(Ready())
        from suave_des.knowledge.inference_cache import new_cache_entries

        sizes: dict[str, int] = {}
        new_cache_entries(sizes)
        while True:
            try:
                chunk, singly = pickle.loads(requests.get(timeout=_IDLE_S))
            except Empty:
                return
            _run(connection, runner, unpacked, chunk, 0.0 if singly else FLUSH_S)
            connection.send(Done(new_cache_entries(sizes)))
    except SuaveDesError as error:
        known = error if unpacked is None else unpacked.error_as_known(error)
        connection.send(Trouble(pickle.dumps(known), ""))
    except (BrokenPipeError, ConnectionResetError, MemoryError):
        raise
    except Exception:
        connection.send(Trouble(None, traceback.format_exc()))


def _opened(content: bytes) -> tuple[Unpacked, MissionRunner]:
    from suave_des.campaign.executors import WorkerError
    from suave_des.campaign.missions import MissionRunner
    from suave_des.campaign.parcel import MODULES_FOLDER, unpack
    from suave_des.campaign.request import manager_code
    from suave_des.errors import InputError

    parcel = pickle.loads(content)
    try:
        unpacked = unpack(parcel, Path.cwd())
    except OSError as error:
        raise WorkerError(f"its temporary folder {Path.cwd()} cannot be written: {error.strerror}") from error
    sys.path.insert(0, str(Path.cwd() / MODULES_FOLDER))
    for name, code in parcel.manager_code.items():
        if manager_code(name) != code:
            raise InputError(f"manager {name!r} has other code there than here", remedy="install the same version")
    return unpacked, MissionRunner(unpacked.job)


def _run(connection: Connection, runner: MissionRunner, unpacked: Unpacked, chunk: Any, every_s: float) -> None:
    from suave_des.campaign.plan import MissionKey

    waiting = []
    told_s = time.monotonic()
    for finished in runner.each(iter([MissionKey(*key) for key in chunk])):
        waiting.append(finished)
        if len(waiting) and time.monotonic() - told_s >= every_s:
            connection.send(Part(len(waiting), pickle.dumps(unpacked.as_known(waiting))))
            waiting, told_s = [], time.monotonic()
    if waiting:
        connection.send(Part(len(waiting), pickle.dumps(unpacked.as_known(waiting))))
