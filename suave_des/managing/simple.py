"""Managers without an ontology: the paper's none and random (SEAMS 2023 paper, section on
managers), a fixed mode, plain thresholds and perfect knowledge.

Source of none and random: nodes task_bridge and task_bridge_random of kas-lab/suave, of 4 February
2023 and of 1.5.0.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import cache
from typing import TYPE_CHECKING, ClassVar

from suave_des.clock import until
from suave_des.domain import (
    GENERATE_SEARCH_PATH,
    MAINTAIN_MOTION,
    UNGROUND_MODE,
    WATER_VISIBILITY,
    Task,
)
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.managing.base import AdaptationProcess, Dependencies, ManagingSubsystem, System
from suave_des.monitor.diagnostics import FAILED, Diagnostic, Kind
from suave_des.scenario.modes import grounding_modes

if TYPE_CHECKING:
    from suave_des.scenario.loader import LoadedScenario
    from suave_des.scenario.models import Scenario

_LOOK_PERIOD_S = 0.05
"""The vehicle's time step: a mode requested between two steps takes effect no earlier."""


def _default_modes(scenario: Scenario, functions: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield each of these functions that has a default mode, with that mode."""
    for function in functions:
        mode = scenario.default_mode(function)
        if mode is not None:
            yield function, mode


class NoManager(ManagingSubsystem):
    """none: each function gets its fixed default mode when its task begins, or the mission if the
    whole of it needs the function; it never adapts.

    Example:
        class Recovers(NoManager):
            subscribes_to = (Kind.COMPONENT_STATUS,)

            def diagnostic(self, diagnostic):
                if diagnostic.value == FAILED:
                    self.system.change_mode("f_maintain_motion", "fd_recover_thrusters")
    """

    def mission_started(self) -> None:
        """Set the modes of the functions that the whole mission needs."""
        self.set_modes(self.system.functions)

    def task_requested(self, task: Task) -> None:
        """Set the modes of the task's functions."""
        self.set_modes(task.functions)

    def set_modes(self, functions: Sequence[str]) -> None:
        """Set the default modes of some functions."""
        for function, mode in _default_modes(self.system.scenario, functions):
            self.system.change_mode(function, mode)


class FixedMode(NoManager):
    """fixed:MODE: functions that have this mode get it, others their default mode; it never
    adapts.
    """

    mode: ClassVar[str]

    @classmethod
    def check(cls, loaded: LoadedScenario) -> None:
        """Check that some function has the mode."""
        known = sorted(
            {mode for function in loaded.modes.functions for mode in loaded.modes.modes(function)}
        )
        if cls.mode not in known:
            remedy = did_you_mean(
                cls.mode, grounding_modes(known), f"modes in {loaded.modes_path.name}"
            )
            raise InputError(
                f"manager fixed:{cls.mode}: no function has a mode {shown(cls.mode)}", remedy=remedy
            )

    def set_modes(self, functions: Sequence[str]) -> None:
        """Set the mode of the functions that have it, and the default modes of the others."""
        fixed = [each for each in functions if self.mode in self.system.modes.available_modes(each)]
        for function in fixed:
            self.system.change_mode(function, self.mode)
        super().set_modes([each for each in functions if each not in fixed])


@cache
def fixed_mode(mode: str) -> type[ManagingSubsystem]:
    """Make the class of the manager `fixed:MODE`."""
    return type("FixedMode", (FixedMode,), {"mode": mode, "__doc__": FixedMode.__doc__})


class RandomManager(ManagingSubsystem):
    """random: every period, each function of the task gets one of its modes, with equal
    probability.

    maintain_motion is left alone; fd_unground and __DEFAULT__ are modes like others. Revision 2023
    picks only on its timer, and sets the search to fd_unground as soon as the pipeline is detected;
    revision 1.5 picks at each task request too. Other functions that the whole mission needs get
    their default mode at the start.
    """

    subscribes_to: ClassVar[Collection[Kind]] = (Kind.DETECTION,)

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self._revision = system.scenario.revision.random
        self.period_s: float = system.scenario.managers.random.adaptation_period_s
        self.starts_s = system.first_tick_s("random_manager", self.period_s)
        self._stream = system.stream("random_manager/picks")
        self._functions: tuple[str, ...] = ()

    def mission_started(self) -> None:
        """Set the default modes of the functions that the whole mission needs."""
        needed = [name for name in self.system.functions if name != MAINTAIN_MOTION]
        for function, mode in _default_modes(self.system.scenario, needed):
            self.system.change_mode(function, mode)

    def task_requested(self, task: Task) -> None:
        """Remember the task's functions."""
        self._functions = tuple(name for name in task.functions if name != MAINTAIN_MOTION)
        if self._revision.on_task_request:
            self.adapt()

    def task_cancelled(self, task: Task) -> None:
        """Forget the task's functions, and set them to fd_unground."""
        self._functions = ()
        super().task_cancelled(task)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """End the search when the pipeline is detected."""
        if self._revision.ungrounds_search_at_detection and GENERATE_SEARCH_PATH in self._functions:
            self._functions = tuple(
                name for name in self._functions if name != GENERATE_SEARCH_PATH
            )
            self.system.change_mode(GENERATE_SEARCH_PATH, UNGROUND_MODE)

    def adapt(self) -> None:
        """Pick a mode for each function."""
        for function in self._functions:
            self.system.change_mode(
                function, self._stream.choice(self.system.modes.available_modes(function))
            )


class RemembersFailures(ManagingSubsystem):
    """Base of managers that remember which thrusters have failed: `failed`, those that were last
    reported as such.
    """

    subscribes_to: ClassVar[Collection[Kind]] = (Kind.COMPONENT_STATUS,)

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.failed: set[str] = set()

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Remember a thruster that has failed, until it is reported as recovered."""
        if diagnostic.value == FAILED:
            self.failed.add(diagnostic.key)
        else:
            self.failed.discard(diagnostic.key)


class Threshold(RemembersFailures):
    """threshold: metacontrol's decisions as plain conditions; the difference is the cost of the
    ontology.

    It adapts at metacontrol's times (`managers.metacontrol.reasoning_period_s`, from the same first
    cycle on in each run), takes no time to reason, and searches by the thresholds of `managers.bt`.

    Attributes:
        thresholds_m: least visibility for each of the search modes; the first one that is reached
            decides.
        search_modes: a mode for each threshold; the last one is also for a visibility below all.

    Example:
        >>> class Bold(Threshold):
        ...     def __init__(self, system):
        ...         super().__init__(system)
        ...         self.thresholds_m = (3.0, 2.0, 1.0)
    """

    def __init__(self, system: System) -> None:
        super().__init__(system)
        period_s = system.scenario.managers.metacontrol.reasoning_period_s
        self.period_s: float | None = period_s
        self.starts_s = system.first_tick_s("metacontrol", period_s)
        self.thresholds_m = system.scenario.managers.bt.visibility_thresholds_m
        self.search_modes = system.scenario.managers.bt.search_modes

    @property
    def depends_on(self) -> Dependencies:
        """The thresholds between the search modes."""
        return {WATER_VISIBILITY: tuple(sorted(self.thresholds_m))}

    def adapt(self) -> None:
        """Request the modes that fit."""
        for function, mode in self.wanted(self.system.measured(WATER_VISIBILITY)):
            self.system.change_mode(function, mode)

    def wanted(self, visibility_m: float | None) -> Iterator[tuple[str, str]]:
        """Choose the mode that fits, for each function; a visibility that is not known yet counts
        as good. Functions that do not depend on it get their default mode, if they have one.
        """
        for function in self.system.functions:
            if function == MAINTAIN_MOTION:
                yield function, "fd_recover_thrusters" if self.failed else "fd_all_thrusters"
            elif function == GENERATE_SEARCH_PATH:
                pairs = zip(self.thresholds_m, self.search_modes, strict=True)
                fitting = (
                    mode
                    for least_m, mode in pairs
                    if visibility_m is None or visibility_m >= least_m
                )
                yield function, next(fitting, self.search_modes[-1])
            else:
                yield from _default_modes(self.system.scenario, (function,))


class Oracle(Threshold):
    """oracle: the same decisions from the true visibility, at once and without latency.

    The difference to a manager of the same thresholds is the cost of measuring, deciding and
    changing modes.
    """

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.period_s = None
        self._visibility_m = system.measurements[
            WATER_VISIBILITY
        ].signal  # which no real manager could know

    def mission_started(self) -> None:
        """Set the default modes of the functions that the whole mission needs, and start watching
        the true visibility; maintain_motion waits for the first task.
        """
        needed = [name for name in self.system.functions if name != MAINTAIN_MOTION]
        for function, mode in _default_modes(self.system.scenario, needed):
            self.system.modes.change_mode(function, mode, latency_s=0.0)
        self.system.env.process(self._watch())

    def task_requested(self, task: Task) -> None:
        """Request the modes of the task's functions at once."""
        self.adapt()

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Update a thruster's status, and adapt at once."""
        super().diagnostic(diagnostic)
        self.adapt()

    def adapt(self) -> None:
        """Request the modes that fit the true visibility, with effect at once."""
        for function, mode in self.wanted(self._visibility_m(self.system.now_s)):
            self.system.modes.change_mode(function, mode, latency_s=0.0)

    def _watch(self) -> AdaptationProcess:
        """Adapt whenever the true visibility crosses a threshold."""
        scenario, reached = self.system.scenario, self._thresholds_reached(0.0)
        longest_s = (
            scenario.mission.time_limit_s + scenario.revision.coordinator.limit_check_period_s
        )
        for look in range(1, int(longest_s / _LOOK_PERIOD_S) + 1):
            before, reached = reached, self._thresholds_reached(look * _LOOK_PERIOD_S)
            if reached != before:
                yield until(self.system.env, look * _LOOK_PERIOD_S)
                self.adapt()

    def _thresholds_reached(self, t_s: float) -> int:
        visibility_m = self._visibility_m(t_s)
        return sum(visibility_m >= least_m for least_m in self.thresholds_m)
