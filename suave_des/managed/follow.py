"""Follow pipeline: visits the points of the path to inspect, in order, and adds up the way (facts: kas-lab/suave)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import simpy

from suave_des.clock import Process, tick_at_or_after, until
from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.scenario.revision import FollowRevision
from suave_des.vehicle.vehicle import Vehicle
from suave_des.world.pipeline import SEA_BED_Z_M

ALTITUDE_M = 1.25
POLLS_BEFORE_RESENDING = 10

Path = Sequence[tuple[float, float]]


class FollowPipeline(FunctionNode):
    """The follow function.

    Attributes:
        distance_m: distance inspected, as it was published last.
        finished: the event that the last point of the path is reached.

    Args:
        env: the mission's clock.
        vehicle: whose position is looked at.
        sender: the way to the autopilot.
        revision: how the exemplar's revision behaves.
        path: gives the path to inspect, none while the pipeline is not detected.
    """

    def __init__(
        self,
        env: simpy.Environment,
        vehicle: Vehicle,
        sender: SetPointSender,
        revision: FollowRevision,
        path: Callable[[], Path | None],
    ) -> None:
        super().__init__(env)
        self._vehicle = vehicle
        self._sender = sender
        self._revision = revision
        self._path = path
        self._process: simpy.Process | None = None
        self._next = 0
        self._last_point: tuple[float, float] | None = None
        self._travelled_m = 0.0
        self.distance_m = 0.0
        self.finished = env.event()

    def activated(self) -> None:
        """Set off; the distance counts from zero again, though the published value stays until there is a new one."""
        self._travelled_m = 0.0
        self._last_point = None
        if self._revision.restarts_on_activation:
            self._next = 0
        path = self._path()
        if path is not None and not self.finished.triggered:
            self._process = self.env.process(self._follow(path))

    def deactivated(self) -> None:
        """Stop; revision 2023 adds the way from the last point to here, if it was on its way from one."""
        process, self._process = self._process, None
        if process is None or not process.is_alive:
            return
        process.interrupt()
        if self._revision.adds_remaining_way and self._last_point is not None:
            x, y, _ = self._vehicle.position(self.env.now)
            self._travelled_m += math.dist(self._last_point, (x, y))
            self.distance_m = self._travelled_m

    def _follow(self, path: Path) -> Process:
        started_s, period_s = self.env.now, self._revision.poll_period_s
        try:
            while self._next < len(path):
                point = path[self._next]
                self._send(point)
                polls = 0
                while not self._reached(point):
                    if polls == POLLS_BEFORE_RESENDING:
                        self._send(point)
                        polls = 0
                    # The next poll is strictly later than now: polls lie on a grid that began with the activation.
                    next_poll_s = tick_at_or_after(self.env.now + period_s / 2, started_s, period_s)
                    yield until(self.env, next_poll_s)
                    polls += 1
                self._arrive(point)
        except simpy.Interrupt:
            return
        self.finished.succeed()

    def _send(self, point: tuple[float, float]) -> None:
        self._sender.send(point[0], point[1], SEA_BED_Z_M + ALTITUDE_M)

    def _reached(self, point: tuple[float, float]) -> bool:
        x, y, _ = self._vehicle.position(self.env.now)
        box = self._revision.acceptance_m
        return abs(x - point[0]) <= box and abs(y - point[1]) <= box

    def _arrive(self, point: tuple[float, float]) -> None:
        self._next += 1
        if self._last_point is not None:
            self._travelled_m += math.dist(self._last_point, point)
            self.distance_m = self._travelled_m
        self._last_point = point
