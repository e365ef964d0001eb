"""The managing subsystem: a base class with a few hooks, and what it sees of the managed subsystem.

The built-in managers use nothing that one of your own cannot. Give yours on the command line as
`package.module:Class`, or register it by name as an entry point of the group `suave_des.managers`.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Collection, Generator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import simpy

from suave_des.domain import UNGROUND_MODE, Task
from suave_des.errors import InputError
from suave_des.events import Said
from suave_des.monitor.diagnostics import EXEMPLAR_KINDS, Diagnostic, Kind
from suave_des.scenario.models import Scenario

if TYPE_CHECKING:  # or looking a manager up would load the vehicle and the compiler
    from suave_des.draws import Draws
    from suave_des.knowledge.reasoner import Reasoner
    from suave_des.knowledge.state import KnowledgeState
    from suave_des.managed.coordinator import MissionCoordinator
    from suave_des.managed.mode_manager import ModeManager
    from suave_des.metrics.recording import Recorder
    from suave_des.metrics.result import MissionMetrics
    from suave_des.monitor.measurements import Measurements
    from suave_des.scenario.loader import LoadedScenario
    from suave_des.vehicle.model import Pose
    from suave_des.vehicle.vehicle import Vehicle

AdaptationProcess = Generator[simpy.Event, Any, Any]
Dependencies = Mapping[str, tuple[float, ...]]
"""By quality attribute: the numbers, ascending, that its measured value is compared with."""


@dataclass(eq=False)
class System:
    """What a manager sees of the managed subsystem, and what it can do there: request modes.

    Attributes:
        env: the mission's clock; `env.timeout(s)` is an event to wait for.
        modes: the mode manager: `available_modes(function)`, and `current_mode(function)`, which
            was requested last.
        measurements: the monitors' measurements, by quality attribute; see `measured`.
        scenario: the mission's scenario.
        settings: the scenario's entry for this manager, under `managers:`.
        recorded: whether the mission is recorded; if not, work that only serves the log can be
            skipped.
        state_changed: call this when something that `adapt` depends on has changed outside a hook.

    Example:
        >>> def adapt(self):
        ...     if (self.system.measured("water_visibility") or 0.0) >= 3.25:
        ...         self.system.change_mode("f_generate_search_path", "fd_spiral_high")
    """

    env: simpy.Environment
    modes: ModeManager
    measurements: Mapping[str, Measurements]
    scenario: Scenario
    settings: Mapping[str, Any]
    recorded: bool
    _manager: str
    _coordinator: MissionCoordinator
    _vehicle: Vehicle
    _draws: Draws
    _recorder: Recorder
    _files: Mapping[str, Path]
    _open_knowledge: Callable[[], Reasoner]
    state_changed: Callable[[], None] = field(default=lambda: None, init=False)
    # names that nothing measures, for a remark
    unmeasured: set[str] = field(default_factory=set, init=False)

    @property
    def now_s(self) -> float:
        """Mission time."""
        return float(self.env.now)

    @property
    def task(self) -> Task | None:
        """The current task, if there is one."""
        return self._coordinator.task

    @property
    def functions(self) -> tuple[str, ...]:
        """The functions that are needed now: those of the whole mission, and those of the task."""
        return self._coordinator.functions

    def measured(self, attribute: str, since_s: float = 0.0) -> float | None:
        """Look up the last published value of a quality attribute, such as water_visibility, not
        before `since_s`.

        None if there is none; a repetition of the value before is not a publication.
        """
        measurements = self.measurements.get(attribute)
        if measurements is None:
            self.unmeasured.add(attribute)
            return None
        return measurements.value(self.env.now, since_s)

    def pose(self) -> Pose:
        """Read the vehicle's pose."""
        return self._vehicle.pose(self.env.now)

    def distance_inspected_m(self) -> float:
        """Return the last published distance inspected."""
        return self._coordinator.distance_inspected_m

    def change_mode(self, function: str, mode: str) -> bool:
        """Request a mode of a function, which takes effect after the scenario's latency.

        Returns:
            Whether the modes file has such a mode, and the function accepts it.
        """
        return self.modes.change_mode(function, mode)

    def log(self, event: str, detail: str) -> None:
        """Add an event and its detail to the mission's record."""
        self._recorder.log(self._manager, Said(event, detail))

    def log_state(self, state: KnowledgeState, began_s: float | None = None) -> None:
        """Add a knowledge state that is reasoned about to the mission's record, in place of what was
        added at the time at which the reasoning began; None: now.
        """
        self._recorder.log_state(state, began_s)

    def stream(self, name: str) -> random.Random:
        """Make a named random stream of this run, the same for every manager."""
        return self._draws.stream(f"manager/{name}")

    def first_tick_s(self, timer: str, period_s: float) -> float:
        """Draw when a periodic timer of the manager first ticks in this run.

        Nodes start at arbitrary times; a timer that the scenario's revision has in step with others
        ticks with them. Metacontrol's may be given.
        """
        given = self.scenario.managers.metacontrol.first_cycle_s
        if timer == "metacontrol" and given is not None:
            return given
        in_step = timer in self.scenario.revision.timers_in_step
        return period_s if in_step else self.stream(f"{timer}/phase").uniform(0.0, period_s)

    def knowledge(self) -> Reasoner:
        """Return the knowledge base with its reasoner, opened on the first call."""
        return self._open_knowledge()

    def file(self, name: str) -> Path:
        """Find an input file on this machine by its name, as `ManagingSubsystem.input_files` gave
        it.

        Raises:
            InputError: it was not given there.
        """
        if name not in self._files:
            remedy = "have the class method input_files return it, so that it is hashed, compared and sent to workers"
            raise InputError(f"file {name!r} is not declared", remedy=remedy)
        return self._files[name]


class ManagingSubsystem:
    """Base of all managers. Override the hooks that you need; each is called at the mission time of
    its event.

    A hook must not block: to let mission time pass, `adapt` may be a generator that yields events
    of `system.env`.

    Attributes:
        system: what the manager sees and can do.
        period_s: time between calls of `adapt`; None: never called.
        starts_s: mission time of the first call of `adapt`.
        reads_for_s: for how long after its beginning a call of `adapt` may still read measured
            values, of an event-triggered manager. It may differ from state to state: after a call
            it says for how long another one that began then would read them. With a period or
            more it is called at each of its times.
        reasoning_time_s: mission time that reasoning took before adaptations; a further metric.
        needs_knowledge: whether missions need the knowledge base, so that it is checked before the
            first one, and a reasoner runs beside the simulator, which slows it down
            (`calibration.reasoning_slowdown`).
        subscribes_to: kinds of diagnostics that `diagnostic` is called with. A manager that reads
            `system.measured` when it adapts need not subscribe to measured values; publishing each
            of them takes time. Pose and distance come once a second, to those who name their kinds.

    A manager that adapts every `period_s` is time-triggered. One whose `adapt` depends only on what
    its hooks were called with, and on how measured values compare with fixed thresholds, may be
    event-triggered, and declares it by `depends_on`. It is not called at all of its times: after a
    call of `adapt` that returned None, or a generator that returned True (another call right then
    would change nothing), the next one is at the first of its times after a hook was called, or
    such that a measured value has crossed a threshold before the call has read it. The mission is
    the same, with two exceptions: an event at the very time of a call may come before it; and
    something may happen during a call that changes nothing but takes time.

    Example:
        >>> class HighInClearWater(ManagingSubsystem):
        ...     depends_on = {"water_visibility": (3.25,)}
        ...     period_s = 2.0
        ...
        ...     def adapt(self):
        ...         is_clear = (self.system.measured("water_visibility") or 0.0) >= 3.25
        ...         mode = "fd_spiral_high" if is_clear else "fd_spiral_low"
        ...         self.system.change_mode("f_generate_search_path", mode)
    """

    needs_knowledge: ClassVar[bool] = False
    subscribes_to: ClassVar[Collection[Kind]] = EXEMPLAR_KINDS
    period_s: float | None = None
    starts_s: float = 0.0
    reads_for_s: float = 0.0
    reasoning_time_s: float = 0.0

    @classmethod
    def input_files(cls, settings: Mapping[str, Any]) -> Collection[str]:
        """Name the files that the manager reads, with its settings; it finds them by
        `system.file(name)`.

        They are hashed into manifest.json, compared when a campaign is resumed, and sent to the
        workers of a cluster.
        """
        return (str(settings["learned"]),) if "learned" in settings else ()

    @classmethod
    def check(cls, loaded: LoadedScenario) -> None:
        """Check that the manager can work with a scenario; called before the first mission.

        Raises:
            InputError: it cannot.
        """

    def __init__(self, system: System) -> None:
        self.system = system

    @property
    def depends_on(self) -> Dependencies | None:
        """The measured values that `adapt` depends on, with their thresholds; None: it may depend
        on anything.

        Only the class that defines it is asked: one derived from it may depend on more.
        """
        return None

    def recall(self, learned: Mapping[str, Any], training: bool) -> None:
        """Called before t = 0 with the training result.

        Args:
            learned: in `suave-des train` a dict that is kept from mission to mission; otherwise the
                content of the file that the setting `learned` names, which cannot be changed, empty
                without one.
            training: whether the mission is one of `suave-des train`.
        """

    def mission_started(self) -> None:
        """Called at t = 0, before anything else."""

    def mission_ended(self, metrics: MissionMetrics) -> None:
        """Called after everything else, with the metrics; requests have no effect."""

    def task_requested(self, task: Task) -> None:
        """Called when a task begins that needs its functions."""

    def task_cancelled(self, task: Task) -> None:
        """Called when a task ends; by default sets its functions to fd_unground."""
        for function in task.functions:
            self.system.change_mode(function, UNGROUND_MODE)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Called for each diagnostic of a subscribed kind: a component's status, or a changed
        measured value.
        """

    def adapt(self) -> AdaptationProcess | None:
        """Adapt, once every `period_s`; a call that would come while an earlier one still runs is
        skipped.
        """
        return None
