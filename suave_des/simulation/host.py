"""Hosts a managing subsystem in a mission: calls its hooks; an exception fails only its mission."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from types import GeneratorType
from typing import Any, TypeVar

from suave_des.domain import Task
from suave_des.errors import InputError, SuaveDesError, did_you_mean, shown
from suave_des.hooks import (
    dependencies_of,
    measured_somewhere,
    names_in,
    reading_time_of,
    times_of,
)
from suave_des.managing.base import ManagingSubsystem, System
from suave_des.metrics.result import MissionMetrics
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus
from suave_des.simulation.calls import RAISED, AdaptationCall, CallTimes, EventTriggeredTimes

_T = TypeVar("_T")
_MAY_RETURN = "it may return None, or yield events, such as system.env.timeout(1.0)"


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
    _times: CallTimes | None = field(default=None, init=False)  # None: `adapt` is never called

    def __post_init__(self) -> None:
        self.system.state_changed = self.state_changed
        kind = self.manager_type
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
        if kind.diagnostic is not ManagingSubsystem.diagnostic:
            self.bus.subscribe(self._diagnostic, self.manager.subscribes_to)
        if times is None:
            return
        env = self.system.env
        if declared is None:
            self._times = CallTimes(env, self._adapt, times)
            return
        depends_on = None
        if not self.system.recorded:  # a recorded mission makes every call
            measurements = self.system.measurements
            depends_on = [
                (measurements[name], declared[name]) for name in measurements if name in declared
            ]
        reads_for_s = partial(reading_time_of, self.manager)
        self._times = EventTriggeredTimes(env, self._adapt, times, depends_on, reads_for_s)

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
        known = sorted(measured_somewhere(self.system))
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
        """Note that something has changed that `adapt` depends on."""
        if self._times is not None:
            self._times.wake()

    def close(self) -> None:
        """Call the manager no more."""
        self.system.state_changed = _nothing
        if self._times is not None:
            self._times.close()

    def _diagnostic(self, diagnostic: Diagnostic) -> None:
        self._guarded(self.manager.diagnostic, diagnostic)
        self.state_changed()

    def _adapt(self) -> None:
        """Call `adapt`, at one of its times."""
        times, modes = self._times, self.system.modes
        assert times is not None  # only times cause calls
        requests = modes.requests
        refusals = modes.refusals
        adaptation = self._guarded(self.manager.adapt)
        if adaptation is None:
            # A call that was refused something would ask again.
            times.go_on(modes.requests > requests, modes.refusals == refusals)
        elif isinstance(adaptation, GeneratorType | Generator):  # the former is asked for quickly
            over = partial(self._adapted, times, self.system.env.now)
            AdaptationCall(self.system.env, adaptation, over, self.error_of).resume()
        else:
            raise self.error_of(TypeError(f"adapt returned {adaptation!r}; {_MAY_RETURN}"))

    def _adapted(self, times: CallTimes, began_s: float, result: object) -> None:
        """Go on after a call of `adapt` that has taken mission time."""
        in_time = self.system.env.now - began_s < times.period_s  # no call was due meanwhile
        times.go_on(True, in_time and result is True)

    def _guarded(self, hook: Callable[..., _T], *arguments: Any) -> _T:
        try:
            return hook(*arguments)
        except RAISED as error:
            raise self.error_of(error) from error


def _nothing() -> None:
    """Stand in for what is no longer called."""
