"""Pellet: in this process, and in stock owlready2; the time limit, so that a rule that never ends
gives an error.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Final, TypeVar

from suave_des.errors import KnowledgeError
from suave_des.knowledge.state import KnowledgeState

#: What a reasoner may take for one state by default, in s.
TIME_LIMIT_S: Final = 60.0
#: The longest limit; longer times are more than some systems can count.
LONGEST_S: Final = 1e6
#: What a reasoner does at first, for the message.
LOADING: Final = "loading the ontologies"
_Result = TypeVar("_Result")
#: How long the end of the process waits for reasoners to leave Java, in s.
_LEAVE_JAVA_S: Final = 0.5
_abandoned: Final[list[str]] = []


def times_abandoned() -> int:
    """Count the abandoned jobs of this process: one may still be running, and then the process
    cannot end as usual.
    """
    return len(_abandoned)


class ReasonerTimeoutError(KnowledgeError):
    """A reasoner that takes too long, or still works on what took too long before."""


class TimeLimit:
    """Runs work in a separate thread, and stops waiting for it after a time limit.

    Java code cannot be stopped from outside: the thread continues until the process ends.

    Args:
        seconds: the limit of each piece of work.
        option: of the command line, which allows more.
    """

    def __init__(self, seconds: float = TIME_LIMIT_S, option: str | None = None) -> None:
        if not 0.0 < seconds <= LONGEST_S:
            problem = f"{option or 'time limit'}: {seconds:g} is out of range"
            raise KnowledgeError(problem, remedy=f"give seconds above 0, at most {LONGEST_S:g}")
        self.seconds = seconds
        self._option = option
        self._thread: _ReasonerThread | None = None
        self._process = 0
        self._stuck: str | None = None

    def run(self, work: Callable[[], _Result], doing: str) -> _Result:
        """Do a piece of work and return its result; what it is doing is for the message: "reasoning
        on the state ...".

        Raises:
            ReasonerTimeoutError: it took longer, or an earlier one still has not ended.
        """
        if self._stuck is not None:
            remedy = "restart the program with different rules"
            raise ReasonerTimeoutError(f"the reasoner is still {self._stuck}", remedy=remedy)
        if (
            self._thread is None or self._process != os.getpid()
        ):  # a process that was forked has none of the threads
            self._thread, self._process = _ReasonerThread(), os.getpid()
            self._thread.start()
        future: Future[_Result] = Future()
        self._thread.jobs.put((future, work))
        try:
            return future.result(self.seconds)
        except BaseException as error:
            if future.done():
                raise
            if not _abandoned:
                atexit.register(
                    _end_all
                )  # comes before the end of Java, which was registered earlier
            _abandoned.append(doing)
            if not isinstance(
                error, TimeoutError
            ):  # Ctrl-C: Java crashes if the process ends as usual meanwhile
                raise
            self._stuck = doing
            raise self.exceeded(doing) from None

    def exceeded(self, doing: str) -> ReasonerTimeoutError:
        """Make the error for work that took too long."""
        remedy = "look for a rule that matches too many combinations, or computes ever new values from its own"
        remedy += f", or allow more with {self._option}" if self._option else ""
        return ReasonerTimeoutError(f"{doing}: not done after {self.seconds:g} s", remedy=remedy)


class _ReasonerThread(threading.Thread):
    """Does one job after another; None ends it."""

    def __init__(self) -> None:
        super().__init__(name="reasoner", daemon=True)
        self.jobs: queue.SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = (
            queue.SimpleQueue()
        )

    def run(self) -> None:
        while (job := self.jobs.get()) is not None:
            future, work = job
            try:
                future.set_result(work())
            except BaseException as error:  # raised again by the thread that waits
                if not future.done():  # it is, where SystemExit comes just then
                    future.set_exception(error)
            del job, future, work  # or the last result would be kept until the next piece of work


def _end_all() -> None:
    """End the threads of all reasoners, except one in a long call of Java.

    A thread that comes back from Java while Java ends is stopped there for ever, holding the
    interpreter's lock: the process would never end.
    """
    threads = [thread for thread in threading.enumerate() if isinstance(thread, _ReasonerThread)]
    for thread in threads:
        thread.jobs.put(None)
    running = [
        thread for thread in threads if thread.is_alive()
    ]  # one that is just starting finds None first
    for thread in running:
        ctypes.pythonapi.PyThreadState_SetAsyncExc(
            ctypes.c_ulong(thread.ident or 0), ctypes.py_object(SystemExit)
        )
    deadline = time.monotonic() + _LEAVE_JAVA_S
    for thread in running:
        thread.join(max(0.0, deadline - time.monotonic()))


def reasoning_on(state: KnowledgeState) -> str:
    """Describe a reasoner's work on a state, for the message."""
    return f"reasoning on the state {state}"
