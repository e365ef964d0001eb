"""A limit on the time that a mission may take, so that a manager that never returns costs its own mission only."""

from __future__ import annotations

import ctypes
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType

_AGAIN_S = 1.0
"""A mission that swallowed the interruption is interrupted again after this time."""


class TimeOut(BaseException):
    """A mission took too long; no Exception, so that a manager that catches those does not catch this."""


Limit = Callable[[float], AbstractContextManager[None]]
"""Makes the context in which TimeOut is raised after some seconds."""


@contextmanager
def time_limits() -> Iterator[Limit]:
    """The way to limit time in this thread: by the alarm signal in the main one, by a timer thread in others."""
    if threading.current_thread() is not threading.main_thread():
        yield _by_thread
        return
    before = signal.signal(signal.SIGALRM, _raise)
    try:
        yield _by_alarm
    finally:
        signal.signal(signal.SIGALRM, before)


def _raise(number: int, frame: FrameType | None) -> None:
    raise TimeOut


@contextmanager
def _by_alarm(seconds: float) -> Iterator[None]:
    signal.setitimer(signal.ITIMER_REAL, seconds, _AGAIN_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


@contextmanager
def _by_thread(seconds: float) -> Iterator[None]:
    thread = ctypes.c_ulong(threading.get_ident())
    over = threading.Event()

    def watch() -> None:
        wait_s = seconds
        while not over.wait(wait_s):
            ctypes.pythonapi.PyThreadState_SetAsyncExc(thread, ctypes.py_object(TimeOut))
            wait_s = _AGAIN_S

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        watcher.join()
