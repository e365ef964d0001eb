"""The paper's two managers without knowledge: none and random (SEAMS 2023 paper; kas-lab/suave)."""

from collections.abc import Collection
from typing import ClassVar

from suave_des.domain import GENERATE_SEARCH_PATH, MAINTAIN_MOTION, UNGROUND_MODE, Task
from suave_des.managing.base import ManagedSystem, ManagingSubsystem
from suave_des.monitor.diagnostics import Diagnostic, Kind


class NoManager(ManagingSubsystem):
    """none: each function gets its fixed default mode when its task begins; it never adapts."""

    def task_requested(self, task: Task) -> None:
        """Set the default modes of the task's functions."""
        for function in task.functions:
            mode = self.system.scenario.default_mode(function)
            if mode is not None:
                self.system.change_mode(function, mode)


class RandomManager(ManagingSubsystem):
    """random: every period, each function of the task gets one of its modes, with equal probability.

    maintain_motion is left alone; fd_unground and __DEFAULT__ are modes like others. Revision 2023 picks only on its
    timer, and sets the search to fd_unground as soon as the pipeline is detected; revision 1.5 picks at each task
    request too.
    """

    subscribes_to: ClassVar[Collection[Kind]] = (Kind.DETECTION,)

    def __init__(self, system: ManagedSystem) -> None:
        super().__init__(system)
        self.period_s = system.scenario.managers.random.adaptation_period_s
        self._stream = system.stream("random_manager/picks")
        # Timers of nodes have been running since launch: the phase at t = 0 differs from run to run.
        self.starts_s = system.stream("random_manager/phase").uniform(0.0, self.period_s)
        self._functions: tuple[str, ...] = ()

    def task_requested(self, task: Task) -> None:
        """Remember the task's functions."""
        self._functions = tuple(name for name in task.functions if name != MAINTAIN_MOTION)
        if self.system.scenario.revision.random.on_task_request:
            self.adapt()

    def task_cancelled(self, task: Task) -> None:
        """Forget the task's functions, and set them to fd_unground."""
        self._functions = ()
        super().task_cancelled(task)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """End the search when the pipeline is detected."""
        if (
            self.system.scenario.revision.random.ungrounds_search_at_detection
            and GENERATE_SEARCH_PATH in self._functions
        ):
            self._functions = tuple(name for name in self._functions if name != GENERATE_SEARCH_PATH)
            self.system.change_mode(GENERATE_SEARCH_PATH, UNGROUND_MODE)

    def adapt(self) -> None:
        """Pick a mode for each function."""
        for function in self._functions:
            self.system.change_mode(function, self._stream.choice(self.system.modes.available_modes(function)))
