"""The behaviour tree managers of revision 1.5 (facts: kas-lab/suave, revision 1.5).

A tree is walked from its root at every tick: a sequence of what must be in order first. Written out, this is a table of
conditions and modes; each tick asks for the modes of the first condition that holds for each function.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf

from suave_des.managed.task import FOLLOW, MAINTAIN_MOTION, RECHARGE, SEARCH, Task
from suave_des.managing.base import Bounds, ManagedSystem, ManagingSubsystem
from suave_des.monitor.diagnostics import FAILED, Diagnostic, Kind
from suave_des.scenario.modes import UNGROUND_MODE


class BehaviourTree(ManagingSubsystem):
    """bt: recover a failed thruster; search as high as the visibility allows; follow once the pipeline is detected."""

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self._settings = system.scenario.managers.bt
        self.period_s = self._settings.tick_period_s
        self.starts_s = system.stream("bt/phase").uniform(0.0, self.period_s)
        self._functions = system.lasting_functions
        self._failed: set[str] = set()
        self._measured: dict[str, float] = {}

    def task_requested(self, task: Task) -> None:
        """From now on the tree acts on the task's functions, too."""
        self._functions += task.functions

    def task_cancelled(self, task: Task) -> None:
        """The task's functions are set to fd_unground, and left alone."""
        self._functions = tuple(name for name in self._functions if name not in task.functions)
        super().task_cancelled(task)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Remember failed thrusters and measured values."""
        if diagnostic.kind == Kind.QA_STATUS:
            self._measured[diagnostic.key] = float(diagnostic.value)
        elif diagnostic.value == FAILED:
            self._failed.add(diagnostic.key)
        else:
            self._failed.discard(diagnostic.key)

    def adapt(self) -> None:
        """One tick of the tree."""
        for function, mode in self._wanted():
            self.system.change_mode(function, mode)

    def rests_while(self) -> Bounds | None:
        """While the visibility asks for the same search mode."""
        return {"water_visibility": _around(self._visibility_m(), self._settings.visibility_thresholds_m)}

    def _visibility_m(self) -> float:
        # A visibility that was not measured yet counts as good.
        return self._measured.get("water_visibility", inf)

    def _wanted(self) -> Iterator[tuple[str, str]]:
        if MAINTAIN_MOTION in self._functions:
            yield MAINTAIN_MOTION, "fd_recover_thrusters" if self._failed else "fd_all_thrusters"
        if SEARCH in self._functions:
            yield SEARCH, self._search_mode()
        if FOLLOW in self._functions:
            yield FOLLOW, self.system.scenario.default_modes.get(FOLLOW, "fd_follow_pipeline")

    def _search_mode(self) -> str:
        # Below the lowest threshold the lowest altitude is left.
        visibility_m = self._visibility_m()
        pairs = zip(self._settings.visibility_thresholds_m, self._settings.search_modes, strict=True)
        return next((mode for threshold, mode in pairs if visibility_m >= threshold), self._settings.search_modes[-1])


class ExtendedBehaviourTree(BehaviourTree):
    """bt_extended: the same, but with a low battery the vehicle goes to recharge first, and then goes on."""

    def rests_while(self) -> Bounds | None:
        """The same, and while the battery is as low, or as full, as to the tree it is now."""
        return {
            **(super().rests_while() or {}),
            "battery_level": _around(self._battery_level(), [self._settings.battery_limit]),
        }

    def _wanted(self) -> Iterator[tuple[str, str]]:
        if self.system.scenario.battery is None:  # then there is no station to go to
            yield from super()._wanted()
            return
        # Once on its way the vehicle goes on until the level has risen: the station refills the battery at once.
        recharging = self._battery_level() < self._settings.battery_limit
        for function, mode in super()._wanted():
            yield function, UNGROUND_MODE if recharging and function != MAINTAIN_MOTION else mode
        yield RECHARGE, "normal" if recharging else UNGROUND_MODE

    def _battery_level(self) -> float:
        return self._measured.get("battery_level", 1.0)


def _around(value: float, thresholds: Iterable[float]) -> tuple[float, float]:
    """The thresholds next to a value: whatever lies between them is at least, and less than, the same ones."""
    return (
        max([threshold for threshold in thresholds if threshold <= value], default=-inf),
        min([threshold for threshold in thresholds if threshold > value], default=inf),
    )
