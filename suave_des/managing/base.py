"""The managing subsystem: a base class with a few hooks, and its view of the managed subsystem.

The built-in managers use nothing that one of your own cannot. Give yours on the command line as `package.module:Class`,
or register it by name as an entry point of the group `suave_des.managers`.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Collection, Generator, Hashable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, Protocol

import simpy

from suave_des.domain import UNGROUND_MODE, Task
from suave_des.errors import InputError
from suave_des.monitor.diagnostics import EXEMPLAR_KINDS, Diagnostic, Kind
from suave_des.scenario.models import Scenario

if TYPE_CHECKING:  # or looking a manager up would load the vehicle and the compiler
    from suave_des.knowledge.state import Inference, KnowledgeState, Plan
    from suave_des.managed.mode_manager import ModeManager
    from suave_des.metrics.result import MissionMetrics
    from suave_des.monitor.measurements import Measured
    from suave_des.scenario.loader import LoadedScenario
    from suave_des.vehicle.frames import Pose

AdaptationProcess = Generator[simpy.Event, Any, None]
Dependencies = Mapping[str, tuple[float, ...]]
"""By quality attribute: the numbers, ascending, that its measured value is compared with."""


def _unknown(*_: object) -> NoReturn:
    raise NotImplementedError("this system was made without a vehicle")


class Knowledge(Protocol):
    """What managers use of the knowledge base and its reasoner: the K of MAPE-K."""

    @property
    def thresholds(self) -> tuple[float, ...] | None:
        """The numbers with which rules compare measured values; None if rules may do more than compare."""

    @property
    def expected_attributes(self) -> frozenset[str]:
        """The quality attributes of which some function design expects a value."""

    def distinguished(self, measured: Collection[float]) -> Hashable:
        """Return what the rules can distinguish in measured values: if it is equal, so are the conclusions."""

    def analyze(self, state: KnowledgeState) -> Inference:
        """Infer what the rules say about a state."""

    def plan(self, inference: Inference, *, improve_exceeded: bool = False) -> Plan:
        """Choose function designs for the objectives to adapt."""


@dataclass(frozen=True)
class ManagedSystem:
    """A manager's view of the managed subsystem: what it can read, and its only action, requesting modes.

    Attributes:
        env: the mission's clock; `env.timeout(s)` is an event to wait for.
        scenario: the mission's scenario.
        settings: the scenario's entry for this manager, under `managers:`.
        modes: the mode manager.
        lasting_functions: functions that are needed throughout the mission and belong to no task.
        stream: makes a named random stream of this run, the same for every manager.
        log: adds an event and its detail to the mission's record.
        knowledge: returns the knowledge base with its reasoner, opened on the first call.
        record_state: adds a knowledge state that is reasoned about to the mission's record.
        state_changed: call this when something that `adapt` depends on has changed outside a hook.
        record_reasoning_time: adds the mission time, s, that reasoning took before an adaptation; a further metric.
        measurements: the monitors' measurements, by quality attribute; see `measured`.
        recorded: whether the mission is recorded.
        pose: returns the vehicle's current pose.
        distance_inspected_m: returns the last published distance inspected.
        true_signal: returns the true value over mission time (s) of a quality attribute with a signal, for references
            such as `oracle`: no real manager could know it.
        files: paths of the manager's input files on this machine, by their names as given; see `file`.
        learned: the training result. In `suave-des train` a dict that is kept from mission to mission; otherwise
            the content of the file that the setting `learned` names, which cannot be changed, empty without one.
        training: whether the mission is one of `suave-des train`.
        unmeasured: names that `measured` was called with, and that nothing measures.
    """

    env: simpy.Environment
    scenario: Scenario
    settings: Mapping[str, Any]
    modes: ModeManager
    lasting_functions: tuple[str, ...]
    stream: Callable[[str], random.Random]
    log: Callable[[str, str], None]
    knowledge: Callable[[], Knowledge]
    record_state: Callable[[KnowledgeState], None] = lambda state: None
    state_changed: Callable[[], None] = lambda: None
    record_reasoning_time: Callable[[float], None] = lambda duration_s: None
    measurements: Mapping[str, Measured] = field(default_factory=dict)
    recorded: bool = True
    pose: Callable[[], Pose] = _unknown
    distance_inspected_m: Callable[[], float] = _unknown
    true_signal: Callable[[str], Callable[[float], float]] = _unknown
    files: Mapping[str, Path] = field(default_factory=dict)
    learned: Mapping[str, Any] = field(default_factory=dict)
    training: bool = False
    unmeasured: set[str] = field(default_factory=set)

    @property
    def now_s(self) -> float:
        """Mission time."""
        return float(self.env.now)

    def measured(self, attribute: str, since_s: float = 0.0) -> float | None:
        """Look up the last published value of a quality attribute, such as water_visibility, not before `since_s`.

        None if there is none; a repetition of the value before is not a publication.
        """
        measurements = self.measurements.get(attribute)
        if measurements is None:
            self.unmeasured.add(attribute)
            return None
        return measurements.value(self.env.now, since_s)

    def first_cycle_s(self) -> float:
        """Find when metacontrol's first cycle is due: in step with other timers, or with a phase drawn for the run."""
        period_s = self.scenario.managers.metacontrol.reasoning_period_s
        in_step = "metacontrol" in self.scenario.revision.timers_in_step
        return period_s if in_step else self.stream("metacontrol/phase").uniform(0.0, period_s)

    def change_mode(self, function: str, mode: str, latency_s: float | None = None) -> bool:
        """Request a mode of a function, which takes effect later. Return False if there is no such mode.

        Args:
            function, mode: names, as in the modes file.
            latency_s: time until it takes effect, for references such as `oracle`; None: the scenario's latency.
        """
        return self.modes.change_mode(function, mode, latency_s)

    def file(self, name: str) -> Path:
        """Find an input file of the manager's on this machine.

        Args:
            name: as `ManagingSubsystem.input_files` gave it.

        Raises:
            InputError: it was not given there.
        """
        if name not in self.files:
            remedy = "have the class method input_files return it, so that it is hashed, compared and sent to workers"
            raise InputError(f"file {name!r} is not declared", remedy=remedy)
        return self.files[name]


class ManagingSubsystem:
    """Base of all managers. Override the hooks that you need; each is called at the mission time of its event.

    A hook must not block: to let mission time pass, `adapt` may be a generator that yields events of `system.env`.

    Attributes:
        system: the manager's view of the managed subsystem.
        period_s: time between calls of `adapt`; None: never called.
        starts_s: mission time of the first call of `adapt`.
        needs_knowledge: whether missions need the knowledge base, so that it is checked before the first one, and a
            reasoner runs beside the simulator, which slows it down (`calibration.reasoning_slowdown`).
        subscribes_to: kinds of diagnostics that `diagnostic` is called with. A manager that reads `system.measured`
            when it adapts need not subscribe to measured values; publishing each of them takes time. Pose and distance
            come once a second, to those who name their kinds.

    A manager that adapts every `period_s` is time-triggered. One whose `adapt` depends only on what its hooks were
    called with, and on how measured values compare with fixed thresholds, is event-triggered, and declares it by
    `depends_on`. After a call of `adapt` that returned None, the next call is at the first of its times after a hook
    was called, or a measured value has crossed a threshold: fewer calls, the same mission (but for an event at the very
    time of a call, which may come before it).

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

    @classmethod
    def input_files(cls, settings: Mapping[str, Any]) -> Collection[str]:
        """Name the files that the manager reads, with its settings; it finds them by `system.file(name)`.

        They are hashed into manifest.json, compared when a campaign is resumed, and sent to the workers of a cluster.
        """
        return (str(settings["learned"]),) if "learned" in settings else ()

    @classmethod
    def check(cls, loaded: LoadedScenario) -> None:
        """Check that the manager can work with a scenario; called before the first mission.

        Raises:
            InputError: it cannot.
        """

    def __init__(self, system: ManagedSystem) -> None:
        self.system = system

    @property
    def depends_on(self) -> Dependencies | None:
        """The measured values that `adapt` depends on, with their thresholds; None: it may depend on anything.

        Only the class that defines it is asked: one derived from it may depend on more.
        """
        return None

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
        """Called for each diagnostic of a subscribed kind: a component's status, or a changed measured value."""

    def adapt(self) -> AdaptationProcess | None:
        """Adapt, once every `period_s`; a call that would come while an earlier one still runs is skipped."""
        return None


class FunctionsManager(ManagingSubsystem):
    """Base of managers that adapt the functions which the mission needs at the time.

    Attributes:
        functions: those that are needed throughout the mission, and those of the task.
    """

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self.functions = system.lasting_functions

    def task_requested(self, task: Task) -> None:
        """Start adapting the task's functions."""
        self.functions += task.functions

    def task_cancelled(self, task: Task) -> None:
        """Set the task's functions to fd_unground, and stop adapting them."""
        self.functions = tuple(name for name in self.functions if name not in task.functions)
        super().task_cancelled(task)
