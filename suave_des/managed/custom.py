"""User-defined functions: nodes for functions that the exemplar does not have."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from traceback import walk_tb
from typing import Any

import simpy

from suave_des.managed.node import FunctionNode
from suave_des.monitor.diagnostics import DiagnosticsBus
from suave_des.scenario.modes import Mode
from suave_des.vehicle.guidance import SetPointSender
from suave_des.vehicle.vehicle import Point


@dataclass(frozen=True)
class FunctionContext:
    """What a user-defined function can see and do.

    Attributes:
        name: of the function.
        env: the mission's clock.
        settings: the scenario's entry for this function, under `functions:`.
        sender: the function's connection to the autopilot.
        bus: where diagnostics are published, and can be subscribed to.
        stream: makes a named random stream of this run.
        log: adds an event and its detail to the mission's record.
    """

    name: str
    env: simpy.Environment
    settings: Mapping[str, Any]
    sender: SetPointSender
    bus: DiagnosticsBus
    stream: Callable[[str], random.Random]
    log: Callable[[str, str], None]

    def position(self) -> Point:
        """Read the vehicle's position now: x, y, z in m, world frame."""
        return self.sender.vehicle.position(self.env.now)


class CustomFunction(FunctionNode):
    """Base of user-defined functions: override what happens on activation, deactivation and a change of parameters.

    The hooks are called at the mission time at which a mode takes effect. They must not block; what takes mission time
    is a process: `self.env.process(...)`.

    Attributes:
        context: what can be seen and done.

    Example:
        >>> class Lights(CustomFunction):
        ...     def configure(self, mode):
        ...         self.power_w = mode.parameters["power_w"]
        ...
        ...     def activated(self):
        ...         self.context.log("lights_on", f"{self.power_w:g} W")
    """

    def __init__(self, context: FunctionContext) -> None:
        super().__init__(context.env)
        self.context = context

    def configure(self, mode: Mode) -> None:
        """Apply the mode's parameters, `mode.parameters`; also called before an activation."""

    def activated(self) -> None:
        """Start the function's activity."""

    def deactivated(self) -> None:
        """End the function's activity."""


def function_that_raised(error: BaseException | None) -> CustomFunction | None:
    """Find the user-defined function, if any, in whose methods an exception was raised, by its traceback."""
    while error is not None:
        for frame, _ in walk_tb(error.__traceback__):
            if isinstance(owner := frame.f_locals.get("self"), CustomFunction):
                return owner
        error = error.__cause__  # SimPy raises a copy of what a process has raised
    return None
