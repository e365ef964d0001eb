"""Ctrl-C and a plain kill: both end a command in good order, as one exception."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_NUMBERS = (signal.SIGINT, signal.SIGTERM)
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
    taken = [number for number in _NUMBERS if signal.getsignal(number) is not signal.SIG_IGN]
    before = [signal.signal(number, _stop) for number in taken]
    try:
        yield
    finally:
        for number, handler in zip(taken, before, strict=True):
            signal.signal(number, handler)


def _stop(number: int, frame: FrameType | None) -> None:
    _received.append(number)
    raise Stopped


def exit_status() -> int:
    """The status that tells by which signal a command was stopped, as shells have it."""
    return 128 + (_received[0] if _received else signal.SIGINT)
