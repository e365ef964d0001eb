"""What every function of the managed subsystem is: a node with a life cycle, and a way to the autopilot."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass

import simpy

from suave_des.scenario.modes import Mode
from suave_des.vehicle.model import Array
from suave_des.vehicle.vehicle import Vehicle, Watch

Log = Callable[[str, str, str], None]
"""Called with source, event and detail of something worth telling."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Steady error of a node's frame: where the vehicle ends up in the simulator, less where the node sent it."""

    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 0.0


class SetPointSender:
    """A node's way to the autopilot.

    Args:
        env: the mission's clock.
        vehicle: whose autopilot gets the set-points.
        frame: the node's frame error.
        loss_probability: chance that a message is lost on its way.
        stream: decides which; not needed if none can be.
    """

    def __init__(
        self,
        env: simpy.Environment,
        vehicle: Vehicle,
        frame: Frame,
        loss_probability: float,
        stream: random.Random | None = None,
    ) -> None:
        self._env = env
        self._vehicle = vehicle
        self._frame = frame
        self._loss_probability = loss_probability
        self._stream = stream

    def send(self, x_m: float, y_m: float, z_m: float) -> None:
        """Send a set-point, world frame; whether it arrived nobody is told."""
        if self._is_lost():
            return
        self._vehicle.command(self._env.now, x_m + self._frame.x_m, y_m + self._frame.y_m, z_m + self._frame.z_m)

    def send_ahead(
        self, places_m: Array, z_m: float, watch: Watch, *, first: int, last: int, begin: bool
    ) -> tuple[list[int], int]:
        """Send set-points of which each follows the one before when that is found reached; see `Vehicle.give_ahead`.

        Where messages can be lost, nothing is sent before its time.

        Args:
            places_m: the places, world frame: x, y, z in the first three columns, shape (n, at least 3).
            z_m: the set-points' z.
            watch: the node's ticks, and when a place is reached.
            first: first tick to look at.
            last: last tick to look at for the first place.
            begin: whether to send the first one now; else it was sent already.

        Returns:
            The ticks at which places are reached, and the tick at which the node has to act again.
        """
        if self._stream is not None and self._loss_probability > 0.0:
            places_m = places_m[:1]
            begin = begin and not self._is_lost()
        frame = self._frame
        return self._vehicle.give_ahead(
            self._env.now, places_m, (frame.x_m, frame.y_m, z_m + frame.z_m), watch, first=first, last=last, begin=begin
        )

    def _is_lost(self) -> bool:
        return self._stream is not None and self._stream.random() < self._loss_probability


class FunctionNode:
    """A function's life-cycle node: active or inactive, as the mode that was set last says.

    Subclasses say what happens on activation, on deactivation and on a change of parameters while active; each hook is
    called at the mission time at which the mode takes effect.
    """

    def __init__(self, env: simpy.Environment) -> None:
        self.env = env
        self.active = False

    def apply(self, mode: Mode) -> None:
        """Go over to a mode."""
        if mode.active:
            self.configure(mode)
        if mode.active and not self.active:
            self.active = True
            self.activated()
        elif self.active and not mode.active:
            self.active = False
            self.deactivated()

    def configure(self, mode: Mode) -> None:
        """Take the mode's parameters; called before the activation that the mode brings, too."""

    def activated(self) -> None:
        """The node has become active."""

    def deactivated(self) -> None:
        """The node has become inactive."""
