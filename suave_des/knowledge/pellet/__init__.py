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
from concurrent.futures import Future, wait
from contextlib import suppress
from typing import Any, TypeVar

from suave_des.errors import KnowledgeError, PassingError
from suave_des.knowledge.state import KnowledgeState

#: What a reasoner may take for one state by default, in s.
TIME_LIMIT_S = 60.0
#: The longest limit; longer times are more than some systems can count.
LONGEST_LIMIT_S = 1e6
#: What a reasoner does at first, for the message.
LOADING = "loading the ontologies"
_Result = TypeVar("_Result")
#: How long the end of the process waits for reasoners to leave Java, in s.
_LEAVE_JAVA_S = 0.5
#: Work may wait this many times its limit, where the machine is busy with other work.
_PATIENCE = 10
#: So many times its limit the next work waits for what was abandoned.
_AGAIN = 3
_abandoned: list[str] = []
_stuck: set[Future[object]] = set()


def times_abandoned() -> int:
    """Count the abandoned jobs of this process: one may still be running, and then the process
    cannot end as usual.
    """
    return len(_abandoned)


def is_stuck() -> bool:
    """Return whether a reasoner of this process works on what was waited for in vain."""
    return bool(_stuck)


class ReasonerTimeoutError(KnowledgeError, PassingError):
    """A reasoner that takes too long, or still works on what took too long before."""


class TimeLimit:
    """Runs work in a separate thread, and stops waiting for it after a time limit.

    What counts is the CPU time of this process: on a busy machine, or while the process is stopped
    (Ctrl-Z), the clock on the wall goes on, and Java does not. It is that of the whole process,
    because Java collects garbage in a thread of its own, which takes two thirds of the time of a
    rule that never ends; and as work may wait for that of another limit, which never ends.

    Java code cannot be stopped from outside: the thread continues until the work is done, or the
    process ends. The next work waits for that, for a while; then any is refused until it is done.

    Args:
        seconds: the limit of each piece of work.
        option: of the command line, which allows more.
    """

    def __init__(self, seconds: float = TIME_LIMIT_S, option: str | None = None) -> None:
        if not 0.0 < seconds <= LONGEST_LIMIT_S:
            problem = f"{option or 'time limit'}: {seconds:g} is out of range"
            raise KnowledgeError(
                problem, remedy=f"give seconds above 0, at most {LONGEST_LIMIT_S:g}"
            )
        self.seconds = seconds
        self._or_more = f", or allow more with {option}" if option else ""
        self._thread: _ReasonerThread | None = None
        self._process = 0
        self._abandoned: tuple[Future[Any], str] | None = None

    def run(self, work: Callable[[], _Result], doing: str) -> _Result:
        """Do a piece of work and return its result; what it is doing is for the message: "reasoning
        on the state ...".

        Raises:
            ReasonerTimeoutError: it took longer, or an earlier one still has not ended.
        """
        # a process that was forked has none of the threads
        if self._thread is None or self._process != os.getpid():
            self._thread = _ReasonerThread()
            self._process = os.getpid()
            self._thread.start()
            self._abandoned = None
        self._wait_for_abandoned()
        future: Future[_Result] = Future()
        self._thread.submit(future, work)
        try:
            self._wait(future, doing, self.seconds)
        except BaseException:
            # After Ctrl-C, too: Java crashes if the process ends as usual meanwhile.
            if not future.done():
                self._abandoned = future, doing
                if not _abandoned:
                    # comes before the end of Java, which was registered earlier
                    atexit.register(_end_all)
                _abandoned.append(doing)
            raise
        return future.result()

    def _wait_for_abandoned(self) -> None:
        """Wait for earlier work, if it was abandoned; but only once."""
        if self._abandoned is None:
            return
        future, doing = self._abandoned
        if future not in _stuck:
            with suppress(ReasonerTimeoutError):
                self._wait(future, doing, _AGAIN * self.seconds)
        if not future.done():
            _stuck.add(future)
            future.add_done_callback(_stuck.discard)
            remedy = "try again in another process, or with different rules"
            raise ReasonerTimeoutError(f"the reasoner is still {doing}", remedy=remedy)
        self._abandoned = None

    def _wait(self, future: Future[_Result], doing: str, limit_s: float) -> None:
        """Wait until work is done; a ReasonerTimeoutError after the limit.

        Each wait counts as long as it was to be, however long the process was stopped in it.
        """
        began_s = time.process_time()
        used_s = waited_s = 0.0
        while True:
            wait_s = max(limit_s - used_s, 0.01 * limit_s)
            if wait((future,), wait_s).done:
                return
            waited_s += wait_s
            used_s = time.process_time() - began_s
            if used_s >= limit_s:
                raise self.exceeded(doing)
            if waited_s >= _PATIENCE * limit_s:
                raise self.was_starved(doing, waited_s)

    def exceeded(self, doing: str) -> ReasonerTimeoutError:
        """Make the error for work that took too long."""
        remedy = "look for a rule that matches too many combinations, or computes ever new values from its own"
        problem = f"{doing}: not done after {self.seconds:g} s of CPU time"
        return ReasonerTimeoutError(problem, remedy=remedy + self._or_more)

    def was_starved(self, doing: str, waited_s: float) -> ReasonerTimeoutError:
        """Make the error for work to which the machine gave too little time."""
        problem = f"{doing}: not done after {waited_s:g} s, most of which the machine was busy with other work"
        remedy = f"try again when it is less busy{self._or_more}"
        return ReasonerTimeoutError(problem, remedy=remedy)


class _ReasonerThread(threading.Thread):
    """Does one job after another; None ends it."""

    def __init__(self) -> None:
        super().__init__(name="reasoner", daemon=True)
        self.jobs: queue.SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = (
            queue.SimpleQueue()
        )
        self._is_over = False

    def submit(self, future: Future[Any], work: Callable[[], Any]) -> None:
        """Have work done, whose result comes with the future; SystemExit if the thread is over."""
        self.jobs.put((future, work))
        if self._is_over:
            self._refuse()

    def run(self) -> None:
        while (job := self.jobs.get()) is not None:
            future, work = job
            try:
                future.set_result(work())
            except BaseException as error:  # raised again by the thread that waits
                if not future.done():  # it is, where SystemExit comes just then
                    future.set_exception(error)
            del job, future, work  # or the last result would be kept until the next piece of work
        self._is_over = True
        self._refuse()

    def _refuse(self) -> None:
        """End the wait for work that is never done."""
        with suppress(queue.Empty):
            while True:
                job = self.jobs.get_nowait()
                if job is not None:
                    job[0].set_exception(SystemExit())


def _end_all() -> None:
    """End the threads of all reasoners, except one in a long call of Java.

    A thread that comes back from Java while Java ends is stopped there for ever, holding the
    interpreter's lock: the process would never end.
    """
    threads = [thread for thread in threading.enumerate() if isinstance(thread, _ReasonerThread)]
    for thread in threads:
        thread.jobs.put(None)
    # one that is just starting finds None first
    running = [thread for thread in threads if thread.is_alive()]
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
