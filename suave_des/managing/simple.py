"""Managers without knowledge: the paper's none and random, and a fixed mode (SEAMS 2023 paper, section on managers).

Source: nodes task_bridge and task_bridge_random of kas-lab/suave, of 4 February 2023 and of 1.5.0.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import cache
from typing import TYPE_CHECKING, ClassVar

from suave_des.domain import GENERATE_SEARCH_PATH, MAINTAIN_MOTION, UNGROUND_MODE, Task
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.managing.base import ManagingSubsystem, System
from suave_des.monitor.diagnostics import Diagnostic, Kind
from suave_des.scenario.modes import grounding_modes

if TYPE_CHECKING:
    from suave_des.scenario.loader import LoadedScenario


class NoManager(ManagingSubsystem):
    """none: each function gets its fixed default mode when its task begins; it never adapts."""

    def task_requested(self, task: Task) -> None:
        """Set the default modes of the task's functions."""
        for function in task.functions:
            mode = self.system.scenario.default_mode(function)
            if mode is not None:
                self.system.change_mode(function, mode)


class FixedMode(NoManager):
    """fixed:MODE: functions that have this mode get it, others their default mode; it never adapts."""

    mode: ClassVar[str]

    @classmethod
    def check(cls, loaded: LoadedScenario) -> None:
        """Check that some function has the mode."""
        known = sorted({mode for function in loaded.modes.functions for mode in loaded.modes.modes(function)})
        if cls.mode not in known:
            remedy = did_you_mean(cls.mode, grounding_modes(known), f"modes in {loaded.modes_path.name}")
            raise InputError(f"manager fixed:{cls.mode}: no function has a mode {shown(cls.mode)}", remedy=remedy)

    def task_requested(self, task: Task) -> None:
        """Set the modes of the task's functions."""
        fixed = [each for each in task.functions if self.mode in self.system.modes.available_modes(each)]
        for function in fixed:
            self.system.change_mode(function, self.mode)
        super().task_requested(Task(task.name, tuple(each for each in task.functions if each not in fixed)))


@cache
def fixed_mode(mode: str) -> type[ManagingSubsystem]:
    """Make the class of the manager `fixed:MODE`."""
    return type("FixedMode", (FixedMode,), {"mode": mode, "__doc__": FixedMode.__doc__})


class RandomManager(ManagingSubsystem):
    """random: every period, each function of the task gets one of its modes, with equal probability.

    maintain_motion is left alone; fd_unground and __DEFAULT__ are modes like others. Revision 2023 picks only on its
    timer, and sets the search to fd_unground as soon as the pipeline is detected; revision 1.5 picks at each task
    request too.
    """

    subscribes_to: ClassVar[Collection[Kind]] = (Kind.DETECTION,)

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self._revision = system.scenario.revision.random
        self.period_s: float = system.scenario.managers.random.adaptation_period_s
        self.starts_s = system.first_tick_s("random_manager", self.period_s)
        self._stream = system.stream("random_manager/picks")
        self._functions: tuple[str, ...] = ()

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
            self._functions = tuple(name for name in self._functions if name != GENERATE_SEARCH_PATH)
            self.system.change_mode(GENERATE_SEARCH_PATH, UNGROUND_MODE)

    def adapt(self) -> None:
        """Pick a mode for each function."""
        for function in self._functions:
            self.system.change_mode(function, self._stream.choice(self.system.modes.available_modes(function)))
