"""Hosts a managing subsystem in a mission: calls its hooks; what it raises fails its mission, and nothing else."""

from collections.abc import Callable, Generator
from math import inf
from typing import Any, TypeVar

import simpy

from suave_des.clock import Process, until
from suave_des.domain import Task
from suave_des.errors import InputError, MissionError, SuaveDesError
from suave_des.managing.base import AdaptationProcess, ManagedSystem, ManagingSubsystem
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus
from suave_des.registry import manager_class

RAISED = (Exception, SystemExit)
"""What a manager may raise: one that calls sys.exit must not end a campaign, or a mission as if all were well."""

_T = TypeVar("_T")


class ManagerHost:
    """Makes a manager and calls its hooks.

    An event-triggered manager (see `ManagingSubsystem`) is not called at each of its times: a call that would find
    what an earlier one found, and changed nothing then, is left out.

    Args:
        name: the manager's name, or module:Class.
        run: number of the run, for errors.
        system: the manager's view of the managed subsystem.
        bus: where the diagnostics come from that the manager subscribes to.
        skips_idle_calls: whether calls are left out at all.

    Raises:
        MissionError: the manager raised; here, or in any hook later.
        InputError: there is no such manager, or it cannot work with the mission's input.
    """

    def __init__(
        self, name: str, run: int, system: ManagedSystem, bus: DiagnosticsBus, *, skips_idle_calls: bool
    ) -> None:
        self._name, self._run = name, run
        self._env = system.env
        self._modes = system.modes
        self._is_waiting = False  # for an event
        self._idle_regions: set[tuple[int, ...]] = set()  # of measured values, where a call has changed nothing so far
        kind = manager_class(name)
        try:
            self.manager = kind(system)
            own = "depends_on" in vars(kind)  # a derived class may depend on more
            thresholds = self.manager.depends_on if own and skips_idle_calls else None
        except InputError:
            raise  # such as an ontology that cannot be used: it concerns every mission
        except RAISED as error:
            raise self.mission_error(error) from error
        self._is_event_triggered = thresholds is not None
        edges = thresholds or {}
        self._depends_on = [(each, edges[name]) for name, each in system.measurements.items() if name in edges]
        if kind.diagnostic is not ManagingSubsystem.diagnostic:
            bus.subscribe(self._diagnostic, kind.subscribes_to)
        period_s = self.manager.period_s
        if period_s is not None:
            if not period_s > 0.0:
                raise self.mission_error(ValueError(f"period_s is {period_s}; it must be above 0, or None"))
            self._process = self._env.process(self._adapt_periodically(period_s))

    def request(self, task: Task) -> None:
        """Tell the manager of a task that begins."""
        self._guarded(self.manager.task_requested, task)
        self.state_changed()

    def cancel(self, task: Task) -> None:
        """Tell the manager of a task that is over."""
        self._modes.task_over(task.functions)
        self._guarded(self.manager.task_cancelled, task)
        self.state_changed()

    def state_changed(self) -> None:
        """Have a manager that waits for an event called at the next of its times."""
        self._idle_regions.clear()
        if self._is_waiting:
            self._is_waiting = False
            self._process.interrupt()

    def mission_error(self, error: BaseException) -> SuaveDesError:
        """What a manager raised, as the error that ends its mission."""
        if isinstance(error, MissionError):
            return error
        cause = str(error) if isinstance(error, SuaveDesError) else f"{type(error).__name__}: {error}"
        return MissionError(self._name, self._run, float(self._env.now), cause)

    def _diagnostic(self, diagnostic: Diagnostic) -> None:
        self._guarded(self.manager.diagnostic, diagnostic)
        self.state_changed()

    def _adapt_periodically(self, period_s: float) -> Process:
        env = self._env
        yield until(env, self.manager.starts_s)
        due_s = env.now
        while True:
            requests = self._modes.requests
            adaptation = self._guarded(self.manager.adapt)
            if adaptation is not None:
                yield from self._guarded_steps(adaptation)
            if adaptation is not None or self._modes.requests > requests:
                self._idle_regions.clear()
            while due_s <= env.now:
                due_s += period_s
            if adaptation is None and self._is_event_triggered and period_s <= env.now:
                due_s = yield from self._wait_for_event(due_s, period_s)
            else:
                yield until(env, due_s)

    def _wait_for_event(self, due_s: float, period_s: float) -> Generator[simpy.Event, Any, float]:
        """Wait until the first time of `adapt`, from `due_s` on, at which a call may change something; return it."""
        env = self._env
        self._is_waiting = True
        try:
            while True:
                self._idle_regions.add(self._regions())
                crossings_s = [each.next_crossing_s(env.now, edges) for each, edges in self._depends_on]
                event_s = min(crossings_s, default=inf)
                if event_s == inf:
                    yield env.event()  # until interrupted
                tick_s = _tick_at_or_after(event_s, due_s, period_s)
                if tick_s > 2.0 * env.now:
                    yield until(env, 0.75 * tick_s)  # from there on the delay is exact
                yield until(env, tick_s)
                if self._regions() not in self._idle_regions:
                    self._is_waiting = False
                    return tick_s
                due_s = tick_s + period_s
        except simpy.Interrupt:
            tick_s = _tick_at_or_after(env.now, due_s, period_s)
            yield until(env, tick_s)
            return tick_s

    def _regions(self) -> tuple[int, ...]:
        return tuple([measured.region(self._env.now, edges) for measured, edges in self._depends_on])

    def _guarded_steps(self, adaptation: AdaptationProcess) -> Process:
        value = None
        while True:
            try:
                event = adaptation.send(value)
                if not isinstance(event, simpy.Event):
                    raise TypeError(f"adapt yielded {event!r}; it may yield events, such as system.env.timeout(1.0)")
                value = yield event
            except StopIteration:
                return
            except RAISED as error:
                raise self.mission_error(error) from error

    def _guarded(self, hook: Callable[..., _T], *arguments: Any) -> _T:
        try:
            return hook(*arguments)
        except RAISED as error:
            raise self.mission_error(error) from error


def _tick_at_or_after(t_s: float, due_s: float, period_s: float) -> float:
    """First of the times that go on from `due_s` by additions, rounding errors included, that is not before t."""
    while due_s < t_s:
        due_s += period_s
    return due_s
