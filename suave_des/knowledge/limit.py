"""A limit to the time that a reasoner may take, so that a rule that explodes ends in a message."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Callable
from typing import Final, Generic, TypeVar

from suave_des.errors import KnowledgeError
from suave_des.knowledge.state import KnowledgeState

#: What a reasoner may take for one state, where nothing else is said.
TIME_LIMIT_S: Final = 60.0
#: What a reasoner does at first, for the message.
LOADING: Final = "loading the ontologies"
_Result = TypeVar("_Result")
_abandoned: Final[list[str]] = []


def times_abandoned() -> int:
    """How often work was given up on in this process: it may still run, and then the process cannot end as usual."""
    return len(_abandoned)


class _Job(Generic[_Result]):
    """Work with its outcome, once it has one."""

    def __init__(self, work: Callable[[], _Result]) -> None:
        self._work = work
        self._done = threading.Event()
        self._result: list[_Result] = []
        self._error: BaseException | None = None

    def do(self) -> None:
        try:
            self._result.append(self._work())
        except BaseException as error:  # travels to the thread that waits
            self._error = error
        self._done.set()

    def wait(self, limit_s: float) -> bool:
        return self._done.wait(limit_s)

    def result(self) -> _Result:
        if self._error is not None:
            raise self._error
        return self._result[0]


class TimeLimit:
    """Does work in one thread of its own, and gives up waiting for it after a time.

    Java code cannot be stopped from outside. So the thread is left to itself then; it ends with the process.

    Args:
        seconds: the limit of each piece of work.
        option: of the command line, which allows more.
    """

    def __init__(self, seconds: float = TIME_LIMIT_S, option: str | None = None) -> None:
        self.seconds = seconds
        self._option = option
        self._jobs: queue.SimpleQueue[_Job[object]] | None = None
        self._process = 0
        self._stuck: str | None = None

    def run(self, work: Callable[[], _Result], doing: str) -> _Result:
        """Do a piece of work and give its result.

        Args:
            work: what to do.
            doing: what it is, for the message: "reasoning on the state ...".

        Raises:
            KnowledgeError: it took longer, or an earlier one still has not ended.
        """
        if self._stuck is not None:
            raise KnowledgeError(f"the reasoner is still {self._stuck}", remedy="start anew, with other rules")
        if self._jobs is None or self._process != os.getpid():  # a process that was forked has none of the threads
            self._jobs, self._process = queue.SimpleQueue(), os.getpid()
            threading.Thread(target=_do_all, args=(self._jobs,), daemon=True, name="reasoner").start()
        job = _Job(work)
        self._jobs.put(job)  # type: ignore[arg-type]
        try:
            in_time = job.wait(self.seconds)
        except BaseException:  # Ctrl-C: the thread may be in Java, which crashes if the process ends as usual
            _abandoned.append(doing)
            raise
        if not in_time:
            self._stuck = doing
            _abandoned.append(doing)
            raise self.exceeded(doing)
        return job.result()

    def exceeded(self, doing: str) -> KnowledgeError:
        """The error for work that took too long."""
        more = f", or allow more with {self._option}" if self._option else ""
        return KnowledgeError(
            f"{doing}: not done after {self.seconds:g} s",
            remedy=f"look for a rule that matches too many combinations{more}",
        )


def _do_all(jobs: queue.SimpleQueue[_Job[object]]) -> None:
    while True:
        jobs.get().do()


def reasoning_on(state: KnowledgeState) -> str:
    """What a reasoner does with a state, for the message."""
    return f"reasoning on the state {in_words(state)}"


def in_words(state: KnowledgeState) -> str:
    """A state in one line."""
    objectives = [
        f"{each.function} asked for" + (f" ({each.status})" if each.status else "") for each in state.objectives
    ]
    parts = [
        *objectives,
        *(f"{function} = {design}" for function, design in state.groundings),
        *(f"{component} = {status}" for component, status in state.components),
        *(f"{name} = {value}" for name, value in state.measurements),
    ]
    return ", ".join(parts) or "with nothing in it"
