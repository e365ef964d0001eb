"""The behaviour tree managers of revision 1.5 (facts: kas-lab/suave, revision 1.5).

A tree is ticked from its root: a sequence of checks, the most important first. Written out, this is a table of
conditions and modes; each tick requests, for each function, the mode of the first condition that holds.
"""

from collections.abc import Collection, Iterator
from typing import ClassVar

from suave_des.domain import (
    FOLLOW_PIPELINE,
    GENERATE_RECHARGE_PATH,
    GENERATE_SEARCH_PATH,
    MAINTAIN_MOTION,
    SURFACE,
    SURFACE_MODE,
    Task,
)
from suave_des.managing.base import ManagedSystem, ManagingSubsystem, Thresholds
from suave_des.monitor.diagnostics import FAILED, Diagnostic, Kind
from suave_des.scenario.modes import UNGROUND_MODE


class BehaviourTree(ManagingSubsystem):
    """bt: recover a failed thruster; search as high as the visibility allows; follow once the pipeline is detected."""

    subscribes_to: ClassVar[Collection[Kind]] = (Kind.COMPONENT_STATUS,)

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self._settings = system.scenario.managers.bt
        self.period_s = self._settings.tick_period_s
        self.starts_s = system.stream("bt/phase").uniform(0.0, self.period_s)
        self._functions = system.lasting_functions
        self._failed: set[str] = set()

    def task_requested(self, task: Task) -> None:
        """From now on the tree controls the task's functions, too."""
        self._functions += task.functions

    def task_cancelled(self, task: Task) -> None:
        """Set the task's functions to fd_unground, and leave them alone."""
        self._functions = tuple(name for name in self._functions if name not in task.functions)
        super().task_cancelled(task)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Remember failed thrusters."""
        if diagnostic.value == FAILED:
            self._failed.add(diagnostic.key)
        else:
            self._failed.discard(diagnostic.key)

    def adapt(self) -> None:
        """Tick the tree."""
        for function, mode in self._wanted():
            self.system.change_mode(function, mode)

    @property
    def depends_on(self) -> Thresholds:
        """The thresholds between the search modes."""
        return {"water_visibility": tuple(sorted(self._settings.visibility_thresholds_m))}

    def _wanted(self) -> Iterator[tuple[str, str]]:
        if MAINTAIN_MOTION in self._functions:
            yield MAINTAIN_MOTION, "fd_recover_thrusters" if self._failed else "fd_all_thrusters"
        if GENERATE_SEARCH_PATH in self._functions:
            yield GENERATE_SEARCH_PATH, self._search_mode()
        if SURFACE in self._functions:
            yield SURFACE, SURFACE_MODE
        if FOLLOW_PIPELINE in self._functions:
            yield FOLLOW_PIPELINE, self.system.scenario.default_modes.get(FOLLOW_PIPELINE, "fd_follow_pipeline")

    def _search_mode(self) -> str:
        # A visibility that was not measured yet counts as good; below the lowest threshold the lowest altitude is left.
        visibility_m = self.system.measured("water_visibility")
        thresholds_m, modes = self._settings.visibility_thresholds_m, self._settings.search_modes
        pairs = zip(thresholds_m, modes, strict=True)
        return next((mode for least_m, mode in pairs if visibility_m is None or visibility_m >= least_m), modes[-1])


class ExtendedBehaviourTree(BehaviourTree):
    """bt_extended: the same, but with a low battery the vehicle goes to recharge first."""

    @property
    def depends_on(self) -> Thresholds:
        """The same, and whether the battery is low."""
        return {**super().depends_on, "battery_level": (self._settings.battery_limit,)}

    def _wanted(self) -> Iterator[tuple[str, str]]:
        if self.system.scenario.battery is None:  # then there is no station to go to
            yield from super()._wanted()
            return
        # Once on its way the vehicle goes on until the level has risen: the station refills the battery at once.
        level = self.system.measured("battery_level")
        recharging = level is not None and level < self._settings.battery_limit and SURFACE not in self._functions
        for function, mode in super()._wanted():
            yield function, UNGROUND_MODE if recharging and function != MAINTAIN_MOTION else mode
        yield GENERATE_RECHARGE_PATH, "normal" if recharging else UNGROUND_MODE
