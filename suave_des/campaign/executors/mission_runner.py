"""Runs the missions of a campaign in any process, each within its time limit."""

from __future__ import annotations

import ctypes
import math
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from types import FrameType

from suave_des.campaign.knowledge_records import mission_line
from suave_des.campaign.missions import (
    Finished,
    JobSpec,
    MissionFailure,
    MissionKey,
    MissionOutcome,
    Remark,
    further_of,
    row_of,
)
from suave_des.campaign.variation import cell_of, short_mission
from suave_des.errors import MissionError, did_you_mean, shown
from suave_des.interrupts import alarm, handled
from suave_des.metrics.result import MissionResult
from suave_des.registry import is_built_in
from suave_des.scenario.modes import ModeTable
from suave_des.simulation.simulator import Simulator

NOT_REPEATABLE = (
    "a mission that was run again in the same process gave another row: the class keeps state from one mission"
    " to the next, or has its own source of randomness, so results depend on the number of workers."
    " To learn, use `suave-des train`; for random numbers, system.stream"
)
_REPEAT_S = 1.0
"""A mission that swallowed the interruption is interrupted again after this time."""
_POLL_S = 0.1


class MissionRunner:
    """Runs missions of one job in this process.

    Args:
        job: the scenario and everything else that determines a mission.
        exit_after_s: in a thread other than the main one, end the process when a mission is this much over its time
            and cannot be interrupted; None: wait for it.
    """

    def __init__(self, job: JobSpec, exit_after_s: float | None = None) -> None:
        self._job = job
        self._exit_after_s = exit_after_s
        self._drawn = tuple(job.variation.drawn)
        # Load or compile what missions run, before the first one's time counts: a mission of a second does.
        short_mission(job.loaded)
        self._is_own = [not is_built_in(name) for name in job.managers]
        self._first: dict[int, tuple[MissionKey, MissionOutcome]] = {}
        self._number: dict[int, int] = {}
        self._go_to(0)

    def each(self, missions: Iterable[MissionKey]) -> Iterator[Finished]:
        """Yield the outcome of each mission, in order.

        Raises:
            InputError: the scenario, a manager or the knowledge base cannot be used at all.
        """
        with _time_limits(self._exit_after_s) as limit:
            for key in missions:
                outcome, remarks = self._outcome(key, limit)
                yield key, outcome
                if (
                    self._is_own[key.manager]
                    and not isinstance(outcome, MissionFailure)
                    and self._differs(key, outcome, limit)
                ):
                    yield key, Remark(self._job.managers[key.manager], NOT_REPEATABLE)
                for remark in remarks:
                    yield key, remark

    def _differs(self, key: MissionKey, outcome: MissionOutcome, limit: _Limit) -> bool:
        """Whether a manager's first mission in this process gives another outcome when it is run again.

        The first mission is repeated after the 2nd, 4th, 16th, 64th and so on: state kept by a class is noticed, and
        little time is lost.
        """
        first, number = self._first.setdefault(key.manager, (key, outcome)), self._number.get(key.manager, 0) + 1
        self._number[key.manager] = number
        if number != 2 and (number < 4 or number & (number - 1) or number.bit_length() % 2 == 0):
            return False
        again, _ = self._outcome(first[0], limit)
        return again != first[1] and not (isinstance(again, MissionFailure) and not again.lasting)

    def _outcome(self, key: MissionKey, limit: _Limit) -> tuple[MissionOutcome, list[Remark]]:
        """Run a mission; return its outcome, and what its manager's author should know."""
        job = self._job
        manager = job.managers[key.manager]
        if key.point != self._point:
            self._go_to(key.point)
        member = job.variation.member(key.run)
        simulator = self._simulator(member)
        try:
            with limit(job.time_out_s):
                result = simulator.run(manager, key.run, job.seed, record=job.record_knowledge)
        except MissionError as error:
            return MissionFailure(error.manager, error.run, error.time_s, error.cause, point=key.point), []
        except MissionTimeOut:
            return job.timed_out(key)[1], []
        drawn = (result.drawn[path] for path in self._drawn)
        members = () if member is None else (member,)
        known = (self._knowledge(key, result),) if job.record_knowledge else ()
        row = (*row_of(result.metrics), *self._swept, *drawn, *members, *further_of(result), *known)
        modes = simulator.loaded.modes
        remarks = [Remark(manager, _refusal(modes, *request), n) for request, n in result.refused.items()]
        return row, [*remarks, *(Remark(manager, text, 0) for text in result.remarks)]

    def _knowledge(self, key: MissionKey, result: MissionResult) -> str:
        if not result.knowledge:
            return ""
        variation = self._job.variation
        values = variation.sweep.values(key.point)
        swept = {variation.paths[name]: value for name, value in values.items()}
        return mission_line(self._job.managers[key.manager], key.point, key.run, result.knowledge, swept)

    def _go_to(self, point: int) -> None:
        """Discard the simulators of the previous point: missions come point by point."""
        self._point = point
        self._simulators: dict[int | None, Simulator] = {}
        self._swept = tuple(map(cell_of, self._job.variation.sweep.values(point).values()))

    def _simulator(self, member: int | None) -> Simulator:
        """Return the simulator of the current point, with a member of the ensemble."""
        if member not in self._simulators:
            variation = self._job.variation
            loaded = variation.scenario(self._job.loaded, self._point, member)
            self._simulators[member] = Simulator(loaded, dict.fromkeys(variation.drawn, variation.runs_per_draw))
        return self._simulators[member]


# Time limits, so that a manager that never returns costs its own mission only.


def _refusal(modes: ModeTable, function: object, mode: object) -> str:
    """Say why the mode manager refused a mode."""
    if function not in modes.functions:
        return f"the modes file has no function {shown(function)} ({did_you_mean(function, modes.functions)})"
    known = modes.modes(str(function))
    if mode in known:
        return f"{function} has no node here (name its class under functions: in the scenario)"
    return f"{function} has no mode {shown(mode)} ({did_you_mean(mode, known)})"


class MissionTimeOut(BaseException):
    """A mission took too long; not an Exception, so that a manager that catches those does not catch this."""


_Limit = Callable[[float], AbstractContextManager[None]]
"""Makes the context in which MissionTimeOut is raised after some seconds."""


@contextmanager
def _time_limits(exit_after_s: float | None) -> Iterator[_Limit]:
    """Limit times in this thread: by the alarm signal in the main one, by a watching thread in others."""
    if threading.current_thread() is not threading.main_thread():
        with _Watchdog(exit_after_s) as watchdog:
            yield watchdog.limit
        return
    with handled([signal.SIGALRM], _raise):
        yield partial(alarm, repeat_s=_REPEAT_S)


def _raise(number: int, frame: FrameType | None) -> None:
    raise MissionTimeOut


class _Watchdog:
    """A thread that interrupts the one that made it. Code that blocks outside Python is interrupted when it returns."""

    def __init__(self, exit_after_s: float | None) -> None:
        self._exit_after_s = math.inf if exit_after_s is None else exit_after_s
        self._target = ctypes.c_ulong(threading.get_ident())
        self._deadline_s = self._next_s = math.inf
        self._lock, self._over = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> _Watchdog:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    @contextmanager
    def limit(self, seconds: float) -> Iterator[None]:
        self._deadline_s = self._next_s = time.monotonic() + seconds
        try:
            yield
        finally:
            with self._lock:
                self._deadline_s = self._next_s = math.inf

    def _watch(self) -> None:
        while not self._over.wait(_POLL_S):
            with self._lock:
                now = time.monotonic()
                if now > self._next_s:
                    self._next_s = now + _REPEAT_S
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(self._target, ctypes.py_object(MissionTimeOut))
                if now > self._deadline_s + self._exit_after_s:
                    os._exit(signal.SIGALRM)
