"""What a managing subsystem is: one class with a few hooks, and what it can see and do.

The built-in managers use nothing that one of your own cannot. Give yours on the command line as `package.module:Class`,
or register it by name as an entry point of the group `suave_des.managers`.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Collection, Generator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import simpy

from suave_des.managed.task import Task
from suave_des.monitor.diagnostics import Diagnostic, Kind
from suave_des.monitor.measurements import Measured
from suave_des.scenario.models import Scenario
from suave_des.scenario.modes import UNGROUND_MODE

if TYPE_CHECKING:  # or looking a manager up would load the vehicle and the compiler
    from suave_des.managed.mode_manager import ModeManager

AdaptationProcess = Generator[simpy.Event, None, None]
Bounds = Mapping[str, tuple[float, ...]]
"""By quality attribute: a value that a measured one must be above, and one that it must be below; or several such pairs
in ascending order, of which it must be between any."""


@dataclass(frozen=True)
class ManagedSystem:
    """A manager's view of the managed subsystem: what it can read, and the only thing it can do: request modes.

    Attributes:
        env: the mission's clock; `env.timeout(s)` is an event to wait for.
        scenario: the mission's scenario.
        settings: what the scenario says under managers: for this manager's name.
        modes: the mode manager.
        lasting_functions: functions that are needed all the time and belong to no task.
        stream: makes a named random stream of this run, the same for every manager.
        log: takes an event and its detail for the mission's record.
        recorded: whether the record is kept; if not, a manager may leave out what it does for the record alone.
        knowledge: gives the knowledge base with its reasoner (a Deliberation), opened on the first call.
        reasoned: takes each KnowledgeState that is reasoned about, for the mission's record.
        measurements: what monitors have measured, by quality attribute; see `measured`.
    """

    env: simpy.Environment
    scenario: Scenario
    settings: Mapping[str, Any]
    modes: ModeManager
    lasting_functions: tuple[str, ...]
    stream: Callable[[str], random.Random]
    log: Callable[[str, str], None]
    knowledge: Callable[[], Any]
    reasoned: Callable[[Any], None] = lambda state: None
    measurements: Mapping[str, Measured] = field(default_factory=dict)
    recorded: bool = True

    @property
    def now_s(self) -> float:
        """Mission time."""
        return float(self.env.now)

    def measured(self, attribute: str, since_s: float = 0.0) -> float | None:
        """Value of a quality attribute that was published last, none if there is none.

        A repetition of the value before is not a publication.

        Args:
            attribute: name of the quality attribute, such as water_visibility.
            since_s: publications before this mission time do not count.
        """
        measurements = self.measurements.get(attribute)
        if measurements is None or not (published := measurements.published(self.env.now)):
            return None
        return measurements.values[published - 1] if measurements.times_s[published - 1] >= since_s else None

    def change_mode(self, function: str, mode: str) -> bool:
        """Request a mode of a function; the effect comes later. False if there is no such mode."""
        return self.modes.change_mode(function, mode)


class ManagingSubsystem:
    """Base of all managers. Override the hooks you need; each is called at the mission time at which the thing happens.

    A hook must not block: to let mission time pass, `adapt` may be a generator that yields events of `system.env`.

    Attributes:
        system: what can be seen and done.
        period_s: time between calls of `adapt`; none: never called.
        starts_s: mission time of the first call of `adapt`.
        needs_knowledge: whether missions need the knowledge base, so that it is checked before the first one.
        hears: kinds of diagnostics that `diagnostic` is called with. Telling of every measured value takes time: a
            manager that looks at `system.measured` when it adapts does without.
    """

    needs_knowledge: ClassVar[bool] = False
    hears: ClassVar[Collection[Kind]] = tuple(Kind)

    def __init__(self, system: ManagedSystem) -> None:
        self.system = system
        self.period_s: float | None = None
        self.starts_s = 0.0

    def task_requested(self, task: Task) -> None:
        """A task begins, and needs its functions."""

    def task_cancelled(self, task: Task) -> None:
        """A task is over: by default its functions are set to fd_unground at once."""
        for function in task.functions:
            self.system.change_mode(function, UNGROUND_MODE)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """A monitor has published: a component's status, or a measured value that differs from the one before."""

    def adapt(self) -> AdaptationProcess | None:
        """Called every `period_s`; a call that would come while an earlier one still runs is left out."""
        return None

    def rests_while(self) -> Bounds | None:
        """Between which measured values calls of `adapt` would do nothing, until the manager is told something.

        Asked after each `adapt` that returned None. The calls are then left out until a value is published that is not
        between its bounds (of several pairs, any), or the manager is told of a task or a component's status; `adapt`
        comes again at the first of its times from then on. An attribute without bounds may have any value.

        A record is to show what every call does: a mission that is recorded leaves none out. What holds for a class
        need not hold for one derived from it, which is asked only if it has this method of its own.

        Returns:
            Bounds, or None: `adapt` is to be called after the next period.
        """
        return None

    def rests_after(self) -> Bounds | None:
        """The same, asked at the end of each `adapt` that took time; and likewise only of a class's own method.

        It is about the values that are measured by then. A call that does nothing may take time, too, but must be over
        before the next one, or that would be left out.
        """
        return None
