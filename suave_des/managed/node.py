"""Functions of the managed subsystem: nodes with a life cycle; and the base of functions that the
exemplar lacks.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import simpy

from suave_des.clock import Process
from suave_des.monitor.diagnostics import DiagnosticsBus
from suave_des.scenario.modes import Mode
from suave_des.vehicle.vehicle import Point, Vehicle


@dataclass(eq=False)
class FunctionNode:
    """A function's life-cycle node: active or inactive, according to its current mode.

    Subclasses say what happens on activation, on deactivation and on a change of parameters while
    active; each hook is called at the mission time at which the mode takes effect.
    """

    env: simpy.Environment
    active: bool = field(default=False, init=False)

    def accepts(self, mode: Mode) -> bool:
        """Say whether a request for a mode is accepted; where it is not, nothing changes."""
        return True

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
        """Apply the mode's parameters, `mode.parameters`; also called before an activation."""

    def activated(self) -> None:
        """Start the function's activity."""

    def deactivated(self) -> None:
        """End the function's activity."""


@dataclass(eq=False)
class ProcessNode(FunctionNode):
    """A function whose activity is a process, from each activation to the deactivation.

    Example:
        class Beacon(CustomFunction, ProcessNode):
            def activity(self):
                while True:
                    self.context.log("beacon", f"at {self.context.position()[2]:.1f} m")
                    yield self.env.timeout(10.0)
    """

    _process: simpy.Process | None = field(default=None, init=False)

    def activity(self) -> Process:
        """Do what the function does while it is active; a deactivation interrupts it."""
        raise NotImplementedError

    def activated(self) -> None:
        """Start the activity."""
        self._process = self.env.process(self._until_interrupted())

    def deactivated(self) -> None:
        """Interrupt the activity; the autopilot keeps the last set-point until another function
        sends one.
        """
        if self._process is not None and self._process.is_alive:
            self._process.interrupt()

    def _until_interrupted(self) -> Process:
        with suppress(simpy.Interrupt):
            yield from self.activity()


@dataclass(eq=False)
class SetPointSender:
    """A node's connection to the autopilot. The functions that fly along way-points send theirs
    while the vehicle is flown: `waypoints.send`.

    Attributes:
        vehicle: the vehicle whose autopilot receives the set-points.
        frame_error_m: where the vehicle goes minus where the node sends it, in x, y and z: its
            frame is a bit off.
        loss_probability: probability that a message is lost.
        stream: random stream that decides which messages are lost; not needed if none can be.
    """

    vehicle: Vehicle
    env: simpy.Environment
    frame_error_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    loss_probability: float = 0.0
    stream: random.Random | None = None
    messages_before_loss: float = field(init=False)  # that arrive before the next one is lost

    def __post_init__(self) -> None:
        self.messages_before_loss = self.draw_messages_before_loss()

    def send(self, x_m: float, y_m: float, z_m: float) -> None:
        """Send a set-point in the world frame; there is no acknowledgement.

        Raises:
            ValueError: a coordinate is not a finite number.
        """
        if not (math.isfinite(x_m) and math.isfinite(y_m) and math.isfinite(z_m)):
            raise ValueError(f"the set-point ({x_m}, {y_m}, {z_m}) is not finite")
        if self.messages_before_loss == 0:
            self.messages_before_loss = self.draw_messages_before_loss()
        else:
            self.messages_before_loss -= 1
            x_error_m, y_error_m, z_error_m = self.frame_error_m
            self.vehicle.command(self.env.now, x_m + x_error_m, y_m + y_error_m, z_m + z_error_m)

    def draw_messages_before_loss(self) -> float:
        """Draw the number of messages that arrive before one is lost, from the geometric
        distribution, by inversion.
        """
        if self.stream is None or self.loss_probability == 0.0:
            return math.inf
        return math.floor(
            math.log(1.0 - self.stream.random()) / math.log(1.0 - self.loss_probability)
        )


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

    Example:
        class Beacon(CustomFunction):
            def __init__(self, context: FunctionContext) -> None:
                super().__init__(context)
                self.first_s = context.stream("first").uniform(0.0, 10.0)
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
    """Base of user-defined functions: override what happens on activation, deactivation and a
    change of parameters.

    The hooks are called at the mission time at which a mode takes effect. They must not block; what
    takes mission time is a process: `self.env.process(...)`.

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
