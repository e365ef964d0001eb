"""Ctrl-C and a plain kill: both end a command in good order, as one exception."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from suave_des.interrupts import INTERRUPTS

_AGAIN_S = 0.05
_received: list[int] = []


class Stopped(KeyboardInterrupt):
    """This process was told to stop.

    A class of its own for Ctrl-C too: Python ends as if Ctrl-C had never been caught when a plain KeyboardInterrupt
    met certain imports.
    """


@contextmanager
def told_by_exceptions() -> Iterator[None]:
    """Signals that ask to stop raise Stopped in here, except those that this process was started to ignore."""
    _received.clear()
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    taken = [number for number in INTERRUPTS if signal.getsignal(number) is not signal.SIG_IGN]
    before = [signal.signal(number, _stop) for number in taken]
    try:
        with _lost_ones_again():
            yield
    finally:
        for number, handler in zip(taken, before, strict=True):
            signal.signal(number, handler)


@contextmanager
def _lost_ones_again() -> Iterator[None]:
    """Signals come again when what they raised was lost.

    Nobody hears an exception in a __del__, or in Python code that compiled code has called, as numba's does.
    """
    timers: list[threading.Timer] = []
    tell = sys.unraisablehook

    def again(lost: Any) -> None:
        if not isinstance(lost.exc_value, Stopped):
            tell(lost)
            return
        timers.append(threading.Timer(_AGAIN_S, os.kill, (os.getpid(), _received[0])))
        timers[-1].daemon = True
        timers[-1].start()

    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = tell
        for timer in timers:
            timer.cancel()
            timer.join()


def _stop(number: int, frame: FrameType | None) -> None:
    _received.append(number)
    raise Stopped


def exit_status() -> int:
    """The status that tells by which signal a command was stopped, as shells have it."""
    return 128 + (_received[0] if _received else signal.SIGINT)
