"""Where a managing subsystem lives in a mission: what it raises is its mission's failure, and nobody else's."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import simpy

from suave_des.clock import Process, until
from suave_des.errors import InputError, MissionError, SuaveDesError
from suave_des.managed.task import Task
from suave_des.managing.base import Bounds, ManagedSystem, ManagingSubsystem
from suave_des.managing.registry import manager_class
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus, Kind

RAISED = (Exception, SystemExit)
"""What a manager may raise: one that calls sys.exit must not end a campaign, or a mission as if all were well."""


class ManagerHost:
    """Makes a manager and calls its hooks.

    Args:
        name: the manager's name, or module:Class.
        run: number of the run, for errors.
        system: the manager's view of the managed subsystem.
        bus: whose diagnostics the manager hears.
        may_rest: whether calls of `adapt` that would do nothing may be left out.

    Raises:
        MissionError: the manager raised; here, or in any hook later.
        InputError: there is no such manager, or it cannot work with the mission's input.
    """

    def __init__(self, name: str, run: int, system: ManagedSystem, bus: DiagnosticsBus, *, may_rest: bool) -> None:
        self._name = name
        self._run = run
        self._env = system.env
        self._modes = system.modes
        self._measurements = system.measurements
        self._rests = False
        kind = manager_class(name)
        try:
            self.manager = kind(system)
        except InputError:
            raise  # such as an ontology that cannot be used: it concerns every mission
        except RAISED as error:
            raise self.mission_error(error) from error
        own = vars(kind) if may_rest else {}
        self._rests_while = self.manager.rests_while if "rests_while" in own else None
        self._rests_after = self.manager.rests_after if "rests_after" in own else None
        if kind.diagnostic is not ManagingSubsystem.diagnostic:
            bus.subscribe(self._diagnostic, kind.hears)
        period_s = self.manager.period_s
        if period_s is not None:
            if not period_s > 0.0:
                raise self.mission_error(ValueError(f"period_s is {period_s}; it must be above 0, or None"))
            self._adapting = self._env.process(self._adapt_periodically(period_s))

    def request(self, task: Task) -> None:
        """A task begins."""
        self._tell(self.manager.task_requested, task)

    def cancel(self, task: Task) -> None:
        """A task is over."""
        self._modes.task_over(task.functions)
        self._tell(self.manager.task_cancelled, task)

    def _diagnostic(self, diagnostic: Diagnostic) -> None:
        if diagnostic.kind == Kind.QA_STATUS:
            self._guarded(self.manager.diagnostic, diagnostic)  # a rest has bounds of the values to wake up for
        else:
            self._tell(self.manager.diagnostic, diagnostic)

    def mission_error(self, error: BaseException) -> SuaveDesError:
        """What a manager raised, as the error that ends its mission."""
        if isinstance(error, MissionError):
            return error
        cause = str(error) if isinstance(error, SuaveDesError) else f"{type(error).__name__}: {error}"
        return MissionError(self._name, self._run, float(self._env.now), cause)

    def _adapt_periodically(self, period_s: float) -> Process:
        env = self._env
        yield until(env, self.manager.starts_s)
        due_s = env.now
        while True:
            adaptation = self._guarded(self.manager.adapt)
            rests = self._rests_while
            if adaptation is not None:
                yield from self._guarded_steps(adaptation)
                rests = self._rests_after
            while due_s <= env.now:
                due_s += period_s
            bounds = None if rests is None else self._guarded(rests)
            tick_s = due_s if bounds is None else self._after_rest_s(due_s, period_s, bounds)
            self._rests = tick_s > due_s
            told = False
            try:
                yield until(env, tick_s)
            except simpy.Interrupt:
                told = True
            if told:
                tick_s = _step_at_or_after(env.now, due_s, period_s)
                yield until(env, tick_s)
            due_s = tick_s
            self._rests = False

    def _after_rest_s(self, due_s: float, period_s: float, bounds: Bounds) -> float:
        """The first time from `due_s` on, in steps of the period, that a measured value is out of its bounds."""
        now_s = self._env.now
        # The clock comes to a time by a delay, which is rounded where the time is more than twice the present one. Then
        # a mission that leaves nothing out, which comes to each tick from the one before, could be there earlier.
        if due_s > 2.0 * now_s:
            return due_s
        leaves_s = math.inf
        for attribute, measured in self._measurements.items():
            if attribute in bounds:
                leaves_s = min(leaves_s, measured.leaves_at_s(now_s, *bounds[attribute]))
        if leaves_s == math.inf:
            return leaves_s
        tick_s = _step_at_or_after(leaves_s, due_s, period_s)
        if now_s + (tick_s - now_s) != tick_s:
            tick_s = _step_at_or_after(2.0 * now_s - period_s, due_s, period_s)
        return tick_s

    def _tell(self, hook: Callable[[Any], None], news: Any) -> None:
        self._guarded(hook, news)
        if self._rests:
            self._rests = False
            self._adapting.interrupt()

    def _guarded_steps(self, adaptation: Process) -> Process:
        value = None
        try:
            while True:
                event = adaptation.send(value)
                if not isinstance(event, simpy.Event):
                    raise TypeError(f"adapt yielded {event!r}; it may yield events, such as system.env.timeout(1.0)")
                value = yield event
        except StopIteration:
            return
        except RAISED as error:
            raise self.mission_error(error) from error

    def _guarded(self, hook: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return hook(*arguments)
        except RAISED as error:
            raise self.mission_error(error) from error


def _step_at_or_after(t_s: float, first_s: float, step_s: float) -> float:
    """The first time not before t of those that go from one to the next in steps, rounding errors included."""
    while first_s < t_s:
        first_s += step_s
    return first_s
