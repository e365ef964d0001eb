"""Hosts a managing subsystem in a mission: calls its hooks; an exception fails only its mission."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, TypeVar

import simpy

from suave_des.clock import Alarm, Process, summed_tick
from suave_des.domain import Task
from suave_des.errors import InputError, SuaveDesError, did_you_mean, shown
from suave_des.managing.base import AdaptationProcess, ManagingSubsystem, System
from suave_des.metrics.result import MissionMetrics
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus
from suave_des.monitor.measurements import Measurements, Thresholds
from suave_des.registry import dependencies_of, measured_somewhere, names_in, times_of

RAISED = (Exception, SystemExit)
"""Exceptions of a manager: sys.exit must neither end a campaign, nor end a mission without an
error.
"""

_T = TypeVar("_T")
_MAY_RETURN = "it may return None, or yield events, such as system.env.timeout(1.0)"
_MAX_YIELDS_AT_ONE_TIME = 10_000
"""How often `adapt` may yield while mission time stands still."""


@dataclass(eq=False)
class ManagerHost:
    """Makes a manager and calls its hooks.

    An event-triggered manager (see `ManagingSubsystem`) is not called at each of its times: a call
    in a state in which an earlier one changed nothing is left out.

    Attributes:
        bus: where the diagnostics come from that the manager subscribes to.
        error_of: makes the error that ends the mission from one that the manager raised.
        learned, training: see `ManagingSubsystem.recall`.

    Raises:
        MissionError: the manager raised; here, or in any hook later.
        InputError: the manager cannot work with the mission's input.
    """

    manager_type: type[ManagingSubsystem]
    system: System
    bus: DiagnosticsBus
    error_of: Callable[[BaseException], SuaveDesError]
    learned: Mapping[str, Any]
    training: bool
    manager: ManagingSubsystem = field(init=False)
    _is_waiting: bool = field(default=False, init=False)  # for a change
    _due_s: float = field(
        default=inf, init=False
    )  # next time of `adapt`; while it waits, the earliest
    _idle_regions: set[tuple[int, ...]] = field(
        default_factory=set, init=False
    )  # in which calls change nothing
    _depends_on: list[tuple[Measurements, Thresholds]] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        self.system.state_changed = self.state_changed
        kind, measurements = self.manager_type, self.system.measurements
        try:
            self.manager = kind(self.system)
            if not hasattr(self.manager, "system"):
                raise TypeError(
                    f"{kind.__name__}.__init__ does not begin with super().__init__(system)"
                )
            self.manager.recall(self.learned, self.training)
            times = times_of(self.manager)
            declared = dependencies_of(self.manager)
        except InputError:
            raise  # such as an unusable ontology, which concerns every mission
        except RAISED as error:
            raise self.error_of(error) from error
        is_event_triggered = (
            declared is not None and not self.system.recorded
        )  # a recorded mission makes every call
        if declared is not None and is_event_triggered:
            self._depends_on = [
                (measurements[name], declared[name]) for name in measurements if name in declared
            ]
        if kind.diagnostic is not ManagingSubsystem.diagnostic:
            self.bus.subscribe(self._diagnostic, self.manager.subscribes_to)
        if times is not None:
            (self._period_s, self._due_s), self._is_event_triggered = times, is_event_triggered
            self._alarm = Alarm(self.system.env, self._adapt)
            self._alarm.set(self._due_s)

    def start(self) -> None:
        """Tell the manager that the mission begins."""
        self._guarded(self.manager.mission_started)

    def end(self, metrics: MissionMetrics) -> None:
        """Tell the manager how the mission ended."""
        self._guarded(self.manager.mission_ended, metrics)

    def remarks(self) -> Iterator[str]:
        """Yield probable mistakes of the manager's author that are no errors, as the mission has
        shown them.
        """
        author = next(base for base in self.manager_type.__mro__ if "adapt" in vars(base))
        is_own = not author.__module__.startswith("suave_des.")
        if is_own and self.manager.period_s is None and "adapt" not in names_in(author):
            yield "adapt is never called: period_s is None (set it in the class, such as period_s = 2.0)"
        known = measured_somewhere(self.system)
        for name in sorted(self.system.unmeasured.difference(known), key=str):
            yield f"measured({shown(name)}) is always None: nothing measures it ({did_you_mean(name, known)})"

    def request(self, task: Task) -> None:
        """Pass a task that begins to the manager."""
        self._guarded(self.manager.task_requested, task)
        self.state_changed()

    def cancel(self, task: Task) -> None:
        """Pass a task that is over to the manager."""
        self.system.modes.end_task(task.functions)
        self._guarded(self.manager.task_cancelled, task)
        self.state_changed()

    def state_changed(self) -> None:
        """Make the next periodic call of a manager that waits for a change."""
        self._idle_regions.clear()
        if self._is_waiting:
            self._is_waiting = False
            self._alarm.set(summed_tick(self.system.env.now, self._due_s, self._period_s))

    def _diagnostic(self, diagnostic: Diagnostic) -> None:
        self._guarded(self.manager.diagnostic, diagnostic)
        self.state_changed()

    def _adapt(self) -> None:
        """Call `adapt`, at one of its times."""
        self._is_waiting, requests = False, self.system.modes.requests
        adaptation = self._guarded(self.manager.adapt)
        if adaptation is None:
            self._go_on(
                changed=self.system.modes.requests > requests, waits=self._is_event_triggered
            )
        elif isinstance(adaptation, Generator):
            self.system.env.process(self._guarded_process(adaptation))
        else:
            raise self.error_of(TypeError(f"adapt returned {adaptation!r}; {_MAY_RETURN}"))

    def _go_on(self, *, changed: bool, waits: bool) -> None:
        """Set the alarm to the next time of `adapt`, or, if it waits, to the next one that may
        change something.
        """
        now_s, period_s = self.system.env.now, self._period_s
        while self._due_s <= now_s:
            self._due_s += period_s
        if changed:
            self._idle_regions.clear()
        if not waits or now_s < period_s:
            self._alarm.set(self._due_s)
            return
        self._is_waiting, next_due_s = True, self._due_s
        regions, event_s = self._regions_until(now_s)
        self._idle_regions.add(regions)
        while regions in self._idle_regions:
            if event_s == inf:
                return
            tick_s = summed_tick(event_s, next_due_s, period_s)
            next_due_s = tick_s + period_s
            regions, event_s = self._regions_until(tick_s)
        self._alarm.set(tick_s, exactly=True)

    def _regions_until(self, t_s: float) -> tuple[tuple[int, ...], float]:
        """Find the regions of measured values at mission time t, and until when they stay the
        same.
        """
        found = [each.region_until(t_s, thresholds) for each, thresholds in self._depends_on] or [
            (0, inf)
        ]
        regions, untils_s = zip(*found, strict=True)
        return regions, min(untils_s)

    def _guarded_process(self, adaptation: AdaptationProcess) -> Process:
        resume: Callable[[Any], object] = adaptation.send
        outcome, yields, since_s = None, 0, (began_s := self.system.env.now)
        while True:
            yields, since_s = (
                (yields + 1, since_s)
                if self.system.env.now == since_s
                else (0, self.system.env.now)
            )
            try:
                if yields > _MAX_YIELDS_AT_ONE_TIME:
                    raise RuntimeError(
                        f"adapt yielded {_MAX_YIELDS_AT_ONE_TIME} events, and no mission time passed"
                    )
                event = resume(outcome)
                if not isinstance(event, simpy.Event):
                    raise TypeError(
                        f"adapt yielded {event!r}; it may yield events, such as system.env.timeout(1.0)"
                    )
            except StopIteration as end:
                in_time = (
                    self.system.env.now - began_s < self._period_s
                )  # no call was due meanwhile
                self._go_on(
                    changed=True, waits=in_time and self._is_event_triggered and end.value is True
                )
                return
            except RAISED as error:
                raise self.error_of(error) from error
            try:
                outcome, resume = (yield event), adaptation.send
            except Exception as error:  # the event has failed, which `adapt` may handle
                outcome, resume = error, adaptation.throw

    def _guarded(self, hook: Callable[..., _T], *arguments: Any) -> _T:
        try:
            return hook(*arguments)
        except RAISED as error:
            raise self.error_of(error) from error
