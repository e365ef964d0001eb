"""Where a managing subsystem lives in a mission: what it raises is its mission's failure, and nobody else's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import simpy

from suave_des.clock import Process, until
from suave_des.errors import InputError, MissionError, SuaveDesError
from suave_des.managed.coordinator import Task
from suave_des.managing.base import ManagedSystem, ManagingSubsystem
from suave_des.managing.registry import manager_class
from suave_des.monitor.diagnostics import DiagnosticsBus

RAISED = (Exception, SystemExit)
"""What a manager may raise: one that calls sys.exit must not end a campaign, or a mission as if all were well."""


class ManagerHost:
    """Makes a manager and calls its hooks.

    Args:
        name: the manager's name, or module:Class.
        run: number of the run, for errors.
        system: the manager's view of the managed subsystem.
        bus: whose diagnostics the manager hears.

    Raises:
        MissionError: the manager raised; here, or in any hook later.
        InputError: there is no such manager, or it cannot work with the mission's input.
    """

    def __init__(self, name: str, run: int, system: ManagedSystem, bus: DiagnosticsBus) -> None:
        self._name = name
        self._run = run
        self._env = system.env
        self._modes = system.modes
        kind = manager_class(name)
        try:
            self.manager = kind(system)
        except InputError:
            raise  # such as an ontology that cannot be used: it concerns every mission
        except RAISED as error:
            raise self.mission_error(error) from error
        if kind.diagnostic is not ManagingSubsystem.diagnostic:
            bus.subscribe(lambda diagnostic: self._guarded(self.manager.diagnostic, diagnostic), kind.hears)
        period_s = self.manager.period_s
        if period_s is not None:
            if not period_s > 0.0:
                raise self.mission_error(ValueError(f"period_s is {period_s}; it must be above 0, or None"))
            self._env.process(self._adapt_periodically(period_s))

    def request(self, task: Task) -> None:
        """A task begins."""
        self._guarded(self.manager.task_requested, task)

    def cancel(self, task: Task) -> None:
        """A task is over."""
        self._modes.task_over(task.functions)
        self._guarded(self.manager.task_cancelled, task)

    def mission_error(self, error: BaseException) -> SuaveDesError:
        """What a manager raised, as the error that ends its mission."""
        if isinstance(error, MissionError):
            return error
        cause = str(error) if isinstance(error, SuaveDesError) else f"{type(error).__name__}: {error}"
        return MissionError(self._name, self._run, float(self._env.now), cause)

    def _adapt_periodically(self, period_s: float) -> Process:
        yield until(self._env, self.manager.starts_s)
        due_s = self._env.now
        while True:
            adaptation = self._guarded(self.manager.adapt)
            if adaptation is not None:
                yield from self._guarded_steps(adaptation)
            while due_s <= self._env.now:
                due_s += period_s
            yield until(self._env, due_s)

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
