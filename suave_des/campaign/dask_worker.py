"""What runs in a worker of a Dask cluster: it hands chunks of missions to processes of its own, and looks after them.

It imports little, so that it can say clearly what a worker lacks, and takes everything from its arguments.
"""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import platform
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from multiprocessing import Pipe
from pathlib import Path
from typing import NamedTuple

import suave_des
from suave_des.campaign.mission_process import FLUSH_S, Done, Message, Part, Ready, Trouble
from suave_des.campaign.provenance import versions

_ATTEMPTS = 3
"""How often a mission may cost a process its life, and how often in a row a process may end as it starts."""
_START_S = 300.0
"""Time for starting Python, from a slow shared disk perhaps."""
_MARGIN_S = 60.0
"""Added to the time that a mission may take before its process is ended from outside: Java may have to start."""
_START = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from suave_des.campaign import mission_process as it"

Key = tuple[int, int, int]
"""A MissionKey, as plain numbers."""


@dataclass
class Report:
    """What became of a chunk.

    Attributes:
        parts: outcomes, pickled some at a time.
        lost: missions that ended their processes, with the cause; without one if they did not end in time.
        learned: what reasoners' memories got besides, by their digests.
        missions: how many there were.
        seconds: time that it took, starting a process apart.
    """

    parts: list[bytes] = field(default_factory=list)
    lost: list[tuple[Key, str | None]] = field(default_factory=list)
    learned: list[dict[str, bytes]] = field(default_factory=list)
    missions: int = 0
    seconds: float = 0.0


@lru_cache(maxsize=1)
def needs() -> dict[str, str]:
    """What decides results besides a job, by name: the same on each machine that works on a campaign."""
    return {**versions(), "suave-des code": _code(), "machine": platform.machine()}


def _code() -> str:
    total = hashlib.sha256()
    folder = Path(suave_des.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        total.update(f"{path.relative_to(folder)}\n".encode() + path.read_bytes())
    return total.hexdigest()[:12]


class Order(NamedTuple):
    """What the chunks of one campaign have in common; it travels as a plain tuple, which any version can read.

    Attributes:
        token: the campaign's.
        needs: of the machine that the campaign was started on.
        parcel: a Parcel, pickled.
        time_out_s: time that a mission may take.
    """

    token: str
    needs: dict[str, str]
    parcel: bytes
    time_out_s: float


_lock = threading.Lock()
_crews: dict[str, _Crew] = {}
_over: set[str] = set()


def run(order: Order, chunk: Sequence[Key], folder: str) -> Report | Trouble | dict[str, str]:
    """Run missions.

    Args:
        order: what the campaign's chunks have in common.
        chunk: the missions.
        folder: where temporary files may be.

    Returns:
        What became of them; or why none can be run; or what this machine has, if that is not what is needed.
    """
    if order.needs != needs():
        return needs()
    with _lock:
        if order.token in _over:
            return Report()
        for other in _crews.values():
            other.tidy()
        crew = _crews.setdefault(order.token, _Crew(order, folder))
    return crew.run(chunk)


def forget(token: str) -> None:
    """End the processes of a campaign, at once."""
    with _lock:
        _over.add(token)
        crew = _crews.pop(token, None)
    if crew is not None:
        crew.end()


class _EndedError(Exception):
    """A process ended, or was ended because it did not answer."""

    def __init__(self, status: int | None, *, overdue: bool) -> None:
        super().__init__(status)
        self.status, self.overdue = status, overdue


class _Crew:
    """The processes of one campaign on this worker: as many as there are threads that ask for one."""

    def __init__(self, order: Order, folder: str) -> None:
        self._order, self._folder = order, folder
        self._lock = threading.Lock()
        self._idle: list[_Process] = []
        self._busy: list[_Process] = []
        self._is_over = False

    def run(self, chunk: Sequence[Key]) -> Report | Trouble:
        report = Report(missions=len(chunk))
        done, attempts, starts, singly = 0, 0, 0, len(chunk) == 1
        while done < len(chunk) and not self._is_over:
            before = done
            process = self._take()
            try:
                for message in process.outcomes(chunk[done:], singly=singly):
                    if isinstance(message, Part):
                        report.parts.append(message.outcomes)
                        done += message.missions
                    elif isinstance(message, Done):
                        report.learned.append(message.learned)
                    else:
                        self._drop(process)
                        return message
                report.seconds += time.monotonic() - process.began_s
            except _EndedError as end:
                self._drop(process)
                if not process.is_ready:
                    starts += 1
                    if starts == _ATTEMPTS and not self._is_over:
                        raise RuntimeError(f"processes end as they start, with status {end.status}") from end
                elif not singly:
                    singly = True  # to see which mission it was
                else:
                    attempts = attempts + 1 if done == before else 1
                    if end.overdue or attempts == _ATTEMPTS:
                        report.lost.append((chunk[done], None if end.overdue else _cause(end.status)))
                        done, attempts = done + 1, 0
            else:
                self._give_back(process)
        return report

    def tidy(self) -> None:
        """Remove what is left of processes that ended because nothing was asked of them."""
        with self._lock:
            ended = [process for process in self._idle if process.has_ended()]
            self._idle = [process for process in self._idle if process not in ended]
        for process in ended:
            process.end()

    def end(self) -> None:
        """End all processes; threads that wait for one notice."""
        with self._lock:
            self._is_over = True
            for process in self._busy:
                process.kill()
            idle, self._idle = self._idle, []
        for process in idle:
            process.end()

    def _take(self) -> _Process:
        self.tidy()
        with self._lock:
            process = self._idle.pop() if self._idle else _Process(self._order, self._folder)
            self._busy.append(process)
            if self._is_over:
                process.kill()
        return process

    def _give_back(self, process: _Process) -> None:
        with self._lock:
            self._busy.remove(process)
            if not self._is_over:
                self._idle.append(process)
                return
        process.end()

    def _drop(self, process: _Process) -> None:
        with self._lock:
            self._busy.remove(process)
        process.end()


def _cause(status: int | None) -> str:
    return f"its worker process ended with status {status}, {_ATTEMPTS} times (killed, or out of memory?)"


class _Process:
    """A mission_process with a folder of its own."""

    def __init__(self, order: Order, folder: str) -> None:
        self._order = order
        self._folder = tempfile.mkdtemp(prefix="suave-des-", dir=folder)
        self._connection, theirs = Pipe()
        path = [entry or str(Path.cwd()) for entry in sys.path]
        # No multiprocessing: workers of Dask are daemons, and those may not have children in its sense.
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"{_START}; it.main()", json.dumps(path), str(theirs.fileno())],
            cwd=self._folder,
            env={**os.environ, "SUAVE_DES_CACHE_DIR": str(Path(self._folder) / "cache")},
            stdin=subprocess.DEVNULL,
            pass_fds=[theirs.fileno()],
            start_new_session=True,
        )
        theirs.close()
        self.is_ready = False
        self.began_s = 0.0

    def outcomes(self, chunk: Sequence[Key], *, singly: bool) -> Iterator[Part | Done | Trouble]:
        """What it says of a chunk, up to Done or Trouble.

        Raises:
            _EndedError: it ended, or does not answer.
        """
        if not self.is_ready:
            self._send(self._order.parcel)
            message = self._receive(_START_S)
            if not isinstance(message, Ready):
                assert isinstance(message, Trouble)
                yield message
                return
            self.is_ready = True
        self.began_s = time.monotonic()
        self._send(pickle.dumps((tuple(chunk), singly)))
        while True:
            message = self._receive(FLUSH_S + self._order.time_out_s + _MARGIN_S)
            assert not isinstance(message, Ready)
            yield message
            if not isinstance(message, Part):
                return

    def _send(self, content: bytes) -> None:
        try:
            self._connection.send_bytes(content)
        except OSError:
            raise self._ended() from None

    def _receive(self, patience_s: float) -> Message:
        try:
            if not self._connection.poll(patience_s):
                self.kill()
                raise self._ended(overdue=True)
            message: Message = self._connection.recv()
        except (EOFError, OSError):
            raise self._ended() from None
        return message

    def _ended(self, *, overdue: bool = False) -> _EndedError:
        self.kill()
        return _EndedError(self._process.wait(), overdue=overdue)

    def has_ended(self) -> bool:
        return self._process.poll() is not None

    def kill(self) -> None:
        self._process.kill()

    def end(self) -> None:
        """End it, and remove its folder."""
        self._connection.close()
        self._process.kill()
        self._process.wait()
        shutil.rmtree(self._folder, ignore_errors=True)
