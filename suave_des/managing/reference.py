"""Managers to compare others with: plain thresholds without an ontology, and perfect knowledge."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import count
from typing import ClassVar

from suave_des.domain import FOLLOW_PIPELINE, GENERATE_SEARCH_PATH, MAINTAIN_MOTION, WATER_VISIBILITY, Task
from suave_des.managing.base import AdaptationProcess, Dependencies, ManagingSubsystem, System
from suave_des.monitor.diagnostics import FAILED, Diagnostic, Kind

_LOOK_PERIOD_S = 0.05
"""The vehicle's time step: a mode requested between two steps takes effect no earlier."""


class Threshold(ManagingSubsystem):
    """threshold: metacontrol's decisions as plain conditions; the difference is the cost of the ontology.

    It adapts at metacontrol's times (`managers.metacontrol.reasoning_period_s`, from the same first cycle on in each
    run), takes no time to reason, and searches by the thresholds of `managers.bt`.

    Attributes:
        thresholds_m: least visibility for each of the search modes; the first one that is reached decides.
        search_modes: a mode for each threshold; the last one is also for a visibility below all.
        failed: thrusters that were reported as failed.

    Example:
        >>> class Bold(Threshold):
        ...     def __init__(self, system):
        ...         super().__init__(system)
        ...         self.thresholds_m = (3.0, 2.0, 1.0)
    """

    subscribes_to: ClassVar[Collection[Kind]] = (Kind.COMPONENT_STATUS,)

    def __init__(self, system: System) -> None:
        super().__init__(system)
        period_s = system.scenario.managers.metacontrol.reasoning_period_s
        self.period_s: float | None = period_s
        self.starts_s = system.first_tick_s("metacontrol", period_s)
        self.thresholds_m = system.scenario.managers.bt.visibility_thresholds_m
        self.search_modes = system.scenario.managers.bt.search_modes
        self.failed: set[str] = set()

    @property
    def depends_on(self) -> Dependencies:
        """The thresholds between the search modes."""
        return {WATER_VISIBILITY: tuple(sorted(self.thresholds_m))}

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Remember failed thrusters."""
        if diagnostic.value == FAILED:
            self.failed.add(diagnostic.key)
        else:
            self.failed.discard(diagnostic.key)

    def adapt(self) -> None:
        """Request the modes that fit."""
        for function, mode in self.wanted(self.system.measured(WATER_VISIBILITY)):
            self.system.change_mode(function, mode)

    def wanted(self, visibility_m: float | None) -> Iterator[tuple[str, str]]:
        """Choose the mode that fits, for each function; a visibility that is not known yet counts as good."""
        for function in self.system.functions:
            if function == MAINTAIN_MOTION:
                yield function, "fd_recover_thrusters" if self.failed else "fd_all_thrusters"
            elif function == GENERATE_SEARCH_PATH:
                pairs = zip(self.thresholds_m, self.search_modes, strict=True)
                fitting = (mode for least_m, mode in pairs if visibility_m is None or visibility_m >= least_m)
                yield function, next(fitting, self.search_modes[-1])
            elif function == FOLLOW_PIPELINE:
                yield function, self.system.scenario.default_modes[FOLLOW_PIPELINE]


class Oracle(Threshold):
    """oracle: the same decisions from the true visibility, at once and without latency.

    The difference to a manager of the same thresholds is the cost of measuring, deciding and changing modes.
    """

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.period_s = None
        self._visibility_m = system.measurements[WATER_VISIBILITY].signal  # which no real manager could know

    def mission_started(self) -> None:
        """Start watching the true visibility."""
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
        env = self.system.env
        reached = self._thresholds_reached(0.0)
        for step in count(1):
            t_s = step * _LOOK_PERIOD_S
            if (now_reached := self._thresholds_reached(t_s)) != reached:
                reached = now_reached
                yield env.timeout(t_s - env.now)
                self.adapt()
            elif step % 1000 == 0:  # or the search for the next crossing would go on beyond the mission's end
                yield env.timeout(t_s - env.now)

    def _thresholds_reached(self, t_s: float) -> int:
        visibility_m = self._visibility_m(t_s)
        return sum(visibility_m >= least_m for least_m in self.thresholds_m)
