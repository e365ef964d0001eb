"""The base of every function of the managed subsystem: a node with a life cycle."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field

import simpy

from suave_des.clock import Process
from suave_des.scenario.modes import Mode

Log = Callable[[str, str, str], None]
"""Called with source, event and detail of something to record."""


@dataclass(eq=False)
class FunctionNode:
    """A function's life-cycle node: active or inactive, according to its current mode.

    Subclasses say what happens on activation, on deactivation and on a change of parameters while active; each hook is
    called at the mission time at which the mode takes effect.
    """

    env: simpy.Environment
    active: bool = field(default=False, init=False)

    def apply(self, mode: Mode) -> None:
        """Change to a mode."""
        if mode.active:
            self.configure(mode)
        if mode.active != self.active:
            self.active = mode.active
            if mode.active:
                self.activated()
            else:
                self.deactivated()

    def configure(self, mode: Mode) -> None:
        """Apply the mode's parameters; also called before an activation."""

    def activated(self) -> None:
        """Start the function's activity."""

    def deactivated(self) -> None:
        """End the function's activity."""


@dataclass(eq=False)
class ProcessNode(FunctionNode):
    """A function whose activity is a process, from each activation to the deactivation."""

    _process: simpy.Process | None = field(default=None, init=False)

    def activity(self) -> Process:
        """Do what the function does while it is active; a deactivation interrupts it."""
        raise NotImplementedError

    def activated(self) -> None:
        """Start the activity."""
        self._process = self.env.process(self._until_interrupted())

    def deactivated(self) -> None:
        """Interrupt the activity; the autopilot keeps the last set-point until another function sends one."""
        if self._process is not None and self._process.is_alive:
            self._process.interrupt()

    def _until_interrupted(self) -> Process:
        with suppress(simpy.Interrupt):
            yield from self.activity()
