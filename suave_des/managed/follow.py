"""Follow pipeline: visits the points of the path to inspect, in order, and adds up the way (facts: kas-lab/suave)."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence

import simpy

from suave_des.clock import Process, until
from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.scenario.revision import FollowRevision
from suave_des.vehicle.vehicle import Vehicle
from suave_des.world.pipeline import SEA_BED_Z_M

ALTITUDE_M = 1.25
POLLS_BEFORE_RESENDING = 10

_CONTROL_CHANGE = "control change"

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
        self._asleep = False
        vehicle.control_listeners.append(self._control_changed)

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
        started_s = self.env.now
        poll = 0
        try:
            while self._next < len(path):
                point = path[self._next]
                self._send(point)
                poll = yield from self._reached_at(point, started_s, poll)
                self._arrive(point)
        except simpy.Interrupt:
            return
        self.finished.succeed()

    def _reached_at(self, point: tuple[float, float], started_s: float, poll: int) -> Generator[simpy.Event, None, int]:
        """Wait for the poll that finds the point reached, sending it again whenever ten polls did not.

        Polls lie on a grid that began with the activation. Instead of stopping at each, the vehicle is asked where it
        will be at the coming ones; should its control change meanwhile, it is asked anew.

        Args:
            point: where to go.
            started_s: time of poll 0.
            poll: number of the present poll.

        Returns:
            The number of the poll.
        """
        x_m, y_m = point
        period_s = self._revision.poll_period_s
        first, last = poll, poll + POLLS_BEFORE_RESENDING
        while True:
            reached = self._vehicle.first_tick_in_box(
                x_m, y_m, self._revision.acceptance_m, began_s=started_s, period_s=period_s, first=first, last=last
            )
            if reached == poll:
                return poll
            wake = last if reached is None else reached
            self._asleep = True
            try:
                yield until(self.env, started_s + wake * period_s)
            except simpy.Interrupt as interrupt:
                if interrupt.cause is not _CONTROL_CHANGE:
                    raise
                first = max(first, poll + 1, _polls_until(self.env.now, started_s, period_s))
                continue
            finally:
                self._asleep = False
            if reached is not None:
                return reached
            self._send(point)
            first, last = last + 1, last + POLLS_BEFORE_RESENDING

    def _control_changed(self, row: int) -> None:
        if self._asleep and self._process is not None:
            self._asleep = False  # one waking is enough
            self._process.interrupt(_CONTROL_CHANGE)

    def _send(self, point: tuple[float, float]) -> None:
        self._sender.send(point[0], point[1], SEA_BED_Z_M + ALTITUDE_M)

    def _arrive(self, point: tuple[float, float]) -> None:
        self._next += 1
        if self._last_point is not None:
            self._travelled_m += math.dist(self._last_point, point)
            self.distance_m = self._travelled_m
        self._last_point = point


def _polls_until(t_s: float, started_s: float, period_s: float) -> int:
    """Number of the first poll that is not before t; a rounding error counts as on time."""
    return math.ceil((t_s - started_s) / period_s - 1e-9)
