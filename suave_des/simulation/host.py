"""Hosts a managing subsystem in a mission: calls its hooks; an exception fails only its mission."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from math import inf, isnan
from typing import Any, SupportsFloat, TypeVar

import simpy

from suave_des.clock import Process, exactly_at, until
from suave_des.domain import WATER_VISIBILITY, Task
from suave_des.errors import InputError, MissionError, SuaveDesError, shown
from suave_des.managing.base import AdaptationProcess, Dependencies, ManagedSystem, ManagingSubsystem
from suave_des.metrics.result import MissionMetrics
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus
from suave_des.registry import is_built_in
from suave_des.simulation.remarks import remarks_at_end, remarks_at_start

RAISED = (Exception, SystemExit)
"""Exceptions of a manager: sys.exit must neither end a campaign, nor end a mission without an error."""

_T = TypeVar("_T")
_MAY_RETURN = "it may return None, or yield events, such as system.env.timeout(1.0)"
_MAX_YIELDS_AT_ONE_TIME = 10_000
"""How often `adapt` may yield while mission time stands still."""


@dataclass(eq=False)
class ManagerHost:
    """Makes a manager and calls its hooks.

    An event-triggered manager (see `ManagingSubsystem`) is not called at each of its times: a call in a state in which
    an earlier one changed nothing is left out.

    Attributes:
        name: the manager's name, or module:Class.
        manager_type: its class.
        run: number of the run, for errors.
        system: the manager's view of the managed subsystem.
        bus: where the diagnostics come from that the manager subscribes to.
        skips_idle_calls: whether calls are skipped at all.

    Raises:
        MissionError: the manager raised; here, or in any hook later.
        InputError: the manager cannot work with the mission's input.
    """

    name: str
    manager_type: type[ManagingSubsystem]
    run: int
    system: ManagedSystem
    bus: DiagnosticsBus
    skips_idle_calls: bool
    manager: ManagingSubsystem = field(init=False)
    remarks: tuple[str, ...] = ()  # for its author
    _is_waiting: bool = False  # for an event
    _idle_regions: set[tuple[int, ...]] = field(default_factory=set)  # in which calls change nothing

    def __post_init__(self) -> None:
        manager_type = self.manager_type
        try:
            self.manager = manager_type(self.system)
            if not hasattr(self.manager, "system"):
                raise TypeError(f"{manager_type.__name__}.__init__ does not begin with super().__init__(system)")
            declared = self._declared() if "depends_on" in vars(manager_type) else None  # a derived class may add to it
        except InputError:
            raise  # such as an unusable ontology, which concerns every mission
        except RAISED as error:
            raise self.mission_error(error) from error
        if not is_built_in(self.name):
            self.remarks = remarks_at_start(self.manager, declared or ())
        self._is_event_triggered = declared is not None and self.skips_idle_calls
        thresholds = (declared or {}) if self._is_event_triggered else {}
        measured = self.system.measurements
        self._depends_on = [(measured[name], thresholds[name]) for name in measured if name in thresholds]
        self._is_tabulated = all(each.is_tabulated for each, _ in self._depends_on)
        if manager_type.diagnostic is not ManagingSubsystem.diagnostic:
            self.bus.subscribe(self._diagnostic, self.manager.subscribes_to)
        period_s = self.manager.period_s
        if period_s is not None:
            if not (isinstance(period_s, SupportsFloat) and period_s > 0.0):
                raise self.mission_error(ValueError(f"period_s is {period_s!r}; it must be a number above 0, or None"))
            if not isinstance(starts_s := self.manager.starts_s, SupportsFloat) or isnan(starts_s):
                raise self.mission_error(ValueError(f"starts_s is {starts_s!r}; it must be a number"))
            self._process = self.system.env.process(self._adapt_periodically(period_s))

    def _declared(self) -> Dependencies | None:
        """Read the manager's `depends_on`, for skipping calls, or to check it for its author."""
        if not self.skips_idle_calls and is_built_in(self.name):
            return None
        declared = self.manager.depends_on
        if declared is None:
            return None
        try:
            return {name: tuple(sorted(map(float, each))) for name, each in declared.items()}
        except (AttributeError, TypeError, ValueError):
            problem = (
                f"depends_on is {shown(declared)}; it must be like {{'{WATER_VISIBILITY}': (2.25, 3.25)}}, or None"
            )
            raise ValueError(problem) from None

    def start(self) -> None:
        """Tell the manager that the mission begins."""
        self._guarded(self.manager.mission_started)

    def end(self, metrics: MissionMetrics) -> None:
        """Tell the manager how the mission ended."""
        self._guarded(self.manager.mission_ended, metrics)
        if not is_built_in(self.name):
            self.remarks += remarks_at_end(self.system)

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
        """Wake a manager that waits for an event: its next periodic call is made."""
        self._idle_regions.clear()
        if self._is_waiting:
            self._is_waiting = False
            self._process.interrupt()

    def mission_error(self, error: BaseException) -> SuaveDesError:
        """Convert a manager's exception into the error that ends its mission."""
        if isinstance(error, MissionError):
            return error
        cause = str(error) if isinstance(error, SuaveDesError) else f"{type(error).__name__}: {error}"
        return MissionError(self.name, self.run, self.system.now_s, cause)

    def _diagnostic(self, diagnostic: Diagnostic) -> None:
        self._guarded(self.manager.diagnostic, diagnostic)
        self.state_changed()

    def _adapt_periodically(self, period_s: float) -> Process:
        env, modes = self.system.env, self.system.modes
        yield until(env, self.manager.starts_s)
        due_s = env.now
        while True:
            requests = modes.requests
            adaptation = self._guarded(self.manager.adapt)
            if adaptation is not None:
                if not isinstance(adaptation, Generator):
                    raise self.mission_error(TypeError(f"adapt returned {adaptation!r}; {_MAY_RETURN}"))
                yield from self._guarded_process(adaptation)
            if adaptation is not None or modes.requests > requests:
                self._idle_regions.clear()
            while due_s <= env.now:
                due_s += period_s
            if adaptation is None and self._is_event_triggered and period_s <= env.now:
                due_s = yield from self._wait_for_event(due_s, period_s)
            else:
                yield until(env, due_s)

    def _wait_for_event(self, due_s: float, period_s: float) -> Generator[simpy.Event, Any, float]:
        """Wait until the first time of `adapt`, from `due_s` on, at which a call may change something; return it."""
        env = self.system.env
        self._idle_regions.add(self._regions(env.now))
        self._is_waiting = True
        try:
            while True:
                tick_s = self._next_event_s(due_s, period_s)
                if tick_s == inf:
                    yield env.event()  # until interrupted
                yield exactly_at(env, tick_s)
                if self._regions(tick_s) not in self._idle_regions:
                    self._is_waiting = False
                    return tick_s
                due_s = tick_s + period_s
        except simpy.Interrupt:
            tick_s = _tick_at_or_after(env.now, due_s, period_s)
            yield until(env, tick_s)
            return tick_s

    def _next_event_s(self, due_s: float, period_s: float) -> float:
        """Find the first time of `adapt` at which measured values lie, or may lie, outside all idle regions."""
        tick_s = self.system.env.now
        while True:
            event_s = min(
                [each.next_crossing_s(tick_s, thresholds) for each, thresholds in self._depends_on], default=inf
            )
            if event_s == inf:
                return inf
            tick_s = _tick_at_or_after(event_s, due_s, period_s)
            if not self._is_tabulated or self._regions(tick_s) not in self._idle_regions:
                return tick_s
            due_s = tick_s + period_s

    def _regions(self, t_s: float) -> tuple[int, ...]:
        return tuple([each.region(t_s, thresholds) for each, thresholds in self._depends_on])

    def _guarded_process(self, adaptation: AdaptationProcess) -> Process:
        resume: Callable[[Any], object] = adaptation.send
        outcome, yields, since_s = None, 0, self.system.env.now
        while True:
            yields, since_s = (yields + 1, since_s) if self.system.env.now == since_s else (0, self.system.env.now)
            try:
                if yields > _MAX_YIELDS_AT_ONE_TIME:
                    raise RuntimeError(f"adapt yielded {_MAX_YIELDS_AT_ONE_TIME} events, and no mission time passed")
                event = resume(outcome)
                if not isinstance(event, simpy.Event):
                    raise TypeError(f"adapt yielded {event!r}; it may yield events, such as system.env.timeout(1.0)")
            except StopIteration:
                return
            except RAISED as error:
                raise self.mission_error(error) from error
            try:
                outcome, resume = (yield event), adaptation.send
            except Exception as error:  # the event has failed, which `adapt` may handle
                outcome, resume = error, adaptation.throw

    def _guarded(self, hook: Callable[..., _T], *arguments: Any) -> _T:
        try:
            return hook(*arguments)
        except RAISED as error:
            raise self.mission_error(error) from error


def _tick_at_or_after(t_s: float, due_s: float, period_s: float) -> float:
    """Find the first of due_s, due_s + period_s, ... (summed, rounding included) that is not before t."""
    while due_s < t_s:
        due_s += period_s
    return due_s
