"""Ctrl-C and kill: raised as one exception that ends a command in good order, and deferred where it
must not.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType

INTERRUPTS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_REPEAT_S = 0.05
_received: list[int] = []
_blocks: list[int] = []  # of signals_raised that have not ended: at most one
_SignalHandler = Callable[[int, FrameType | None], object]


class Stopped(KeyboardInterrupt):
    """A signal asked this process to stop.

    A class of its own for Ctrl-C, too: Python ends as if Ctrl-C had never been caught when a plain
    KeyboardInterrupt was raised during certain imports.
    """


@contextmanager
def signals_raised() -> Iterator[None]:
    """Raise Stopped in the block on signals that ask to stop, unless this process was started to
    ignore them.
    """
    _received.clear()
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    with handled(not_ignored(), _stop), _repeated_if_lost(), _not_printed_by_extensions():
        _blocks.append(1)
        try:
            yield
        finally:
            _blocks.pop()


def not_ignored() -> list[int]:
    """Return the signals that ask to stop, without those that this process was started to
    ignore.
    """
    return [number for number in INTERRUPTS if signal.getsignal(number) is not signal.SIG_IGN]


@contextmanager
def handled(numbers: Iterable[int], handler: _SignalHandler) -> Iterator[None]:
    """Have a function called on signals in the block, which must be in the main thread."""
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


@contextmanager
def _repeated_if_lost() -> Iterator[None]:
    """Send a signal again when the exception that it raised was lost.

    Exceptions are ignored in a __del__, and in Python code that compiled code has called, as
    numba's does. Of a process that was stopped nothing is reported: objects that the signal left
    half made fail in their __del__ while it ends.
    """
    timers: list[threading.Timer] = []
    report = sys.unraisablehook

    def again(lost: sys.UnraisableHookArgs) -> None:
        if not isinstance(lost.exc_value, Stopped):
            if not _received:
                report(lost)
            return
        timers.append(threading.Timer(_REPEAT_S, os.kill, (os.getpid(), _received[0])))
        timers[-1].daemon = True
        timers[-1].start()

    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = (lambda lost: None) if _received else report
        for timer in timers:
            timer.cancel()
            timer.join()


@contextmanager
def _not_printed_by_extensions() -> Iterator[None]:
    """Keep an extension that is imported from printing the exception of a signal.

    NumPy's import_array, which most extensions in C call as they are imported, prints whatever
    stops it, and raises an ImportError in its place.
    """
    report = sys.excepthook

    def printed(
        kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        if not issubclass(kind, Stopped):
            report(kind, error, trace)

    sys.excepthook = printed
    try:
        yield
    finally:
        sys.excepthook = report


def _stop(number: int, frame: FrameType | None) -> None:
    _received.append(number)
    raise Stopped


@contextmanager
def ends_at_once(limit_s: float, message: str) -> Iterator[None]:
    """End the process at once when the block takes longer than a time, or when a signal asks to
    stop.

    For a block that nothing is lost with, and that swallows exceptions or spends long in compiled
    code: evaluation of regular expressions lets signals through, but not other threads. When the
    time is over, the message is printed, and the exit status is 2.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end_late(number: int, frame: FrameType | None) -> None:
        os.write(2, f"suave-des: {message}\n".encode())
        os._exit(2)

    with (
        handled([signal.SIGALRM], end_late),
        handled(not_ignored(), end_interrupted),
        alarm(limit_s),
    ):
        yield


@contextmanager
def alarm(seconds: float, repeat_s: float = 0.0) -> Iterator[None]:
    """Send this process SIGALRM when the block takes longer than a time, and again at intervals,
    unless these are 0.
    """
    signal.setitimer(signal.ITIMER_REAL, seconds, repeat_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def end_interrupted(number: int, frame: FrameType | None) -> None:
    """End the process on a signal, without giving anything else the time to fail."""
    os.write(2, b"suave-des: interrupted\n")
    os._exit(128 + number)


def was_interrupted() -> bool:
    """Return whether a signal has asked this process to stop since signals_raised began."""
    return bool(_received)


def is_stopping() -> bool:
    """Return whether a signal has asked to stop in a block of signals_raised that has not ended."""
    return bool(_received and _blocks)


def exit_status() -> int:
    """Return the exit status of a command that a signal stopped, as shells have it."""
    return 128 + (_received[0] if _received else signal.SIGINT)


@contextmanager
def signals_deferred() -> Iterator[None]:
    """Defer Ctrl-C and kill to the end of the block, if Python handles them at all.

    Blocking them would not do: the system delivers them to any thread that does not block them,
    those of numpy among them, and Python then interrupts the main thread all the same. Processes
    started meanwhile do not inherit this.
    """
    if threading.current_thread() is not threading.main_thread():  # others are not interrupted
        yield
        return
    came: list[int] = []
    heard = [number for number in INTERRUPTS if callable(signal.getsignal(number))]
    try:
        with handled(heard, lambda number, frame: came.append(number)):
            yield
    finally:
        if came:
            signal.raise_signal(came[0])
