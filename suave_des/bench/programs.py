"""Run programs in processes of their own, and measure from outside how long they take and how much memory."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import suave_des
from suave_des.errors import SuaveDesError
from suave_des.interrupts import signals_deferred

_PROC = Path("/proc")
_SAMPLE_S = 0.1
_END_S = 10.0
_WORKER = b"spawn_main"
"""Stands on the command line of Python's worker processes."""


class MeasurementError(SuaveDesError):
    """A program that was to be measured failed."""


@dataclass(frozen=True)
class FinishedProgram:
    """A program that has ended.

    Attributes:
        wall_s: from its start to its end.
        cpu_s: that it and its workers used.
        out: what it printed.
        parent_mb: greatest resident memory of its first process; none where the system does not report it.
        worker_mb: the same of the worker process that had most; none also where there was no worker.
    """

    wall_s: float
    cpu_s: float
    out: str
    parent_mb: float | None
    worker_mb: float | None


def run(arguments: Sequence[str], folder: Path, environment: Mapping[str, str]) -> FinishedProgram:
    """Run `python -m ARGUMENTS` to its end.

    Args:
        arguments: module and arguments.
        folder: to run in, and for temporary files.
        environment: variables besides those of this process.

    Raises:
        MeasurementError: it failed.
        KeyboardInterrupt: Ctrl-C; the program and its workers have ended then.
    """
    package = str(Path(suave_des.__file__).resolve().parents[1])
    path = os.pathsep.join(filter(None, [package, os.environ.get("PYTHONPATH")]))
    log = folder / "stderr.txt"
    with log.open("w") as errors:
        begun, cpu_before_s = time.perf_counter(), _cpu_s()
        process: subprocess.Popen[str] | None = None
        try:
            with signals_deferred():  # or it would be orphaned in the middle of its start
                process = subprocess.Popen(
                    [sys.executable, "-m", *arguments],
                    cwd=folder,
                    env={**os.environ, "PYTHONPATH": path, "TMPDIR": str(folder), **environment},
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=errors,
                    text=True,
                    process_group=0,  # Ctrl-C reaches this process alone, which passes it on once
                )
            with _memory_peaks(process.pid) as peaks_mb:
                out, _ = process.communicate()
                wall_s = time.perf_counter() - begun
        finally:
            if process is not None:
                _end(process)
    if process.returncode:
        message = " ".join(log.read_text(errors="replace").split())[-400:]
        raise MeasurementError(f"{' '.join(arguments)} ended with status {process.returncode}: {message}")
    parent_mb = peaks_mb.pop(process.pid, None)
    return FinishedProgram(wall_s, _cpu_s() - cpu_before_s, out, parent_mb, max(peaks_mb.values(), default=None))


def _cpu_s() -> float:
    """CPU time of all programs that were started here and have ended, and of those that they started."""
    times = os.times()
    return times.children_user + times.children_system


def _end(process: subprocess.Popen[str]) -> None:
    """Interrupt a process that still runs, as Ctrl-C does, so that it ends its workers."""
    with signals_deferred():
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.communicate(timeout=_END_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()


@contextmanager
def _memory_peaks(pid: int) -> Iterator[dict[int, float]]:
    """Collect the greatest resident memory of a process and of its workers, in MB by process number."""
    peaks_mb: dict[int, float] = {}
    stop = threading.Event()

    def watch() -> None:
        while not stop.wait(_SAMPLE_S):
            for each in (pid, *_workers(pid)):
                with suppress(OSError, IndexError):  # it has ended, or there is no /proc
                    _, _, peak = (_PROC / str(each) / "status").read_text().partition("VmHWM:")
                    peaks_mb[each] = int(peak.split()[0]) / 1024

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield peaks_mb
    finally:
        stop.set()
        thread.join()


def _workers(pid: int) -> Iterator[int]:
    for task in _PROC.glob(f"{pid}/task/*/children"):
        with suppress(OSError):
            for child in task.read_text().split():
                with suppress(OSError):
                    if _WORKER in (_PROC / child / "cmdline").read_bytes():
                        yield int(child)
