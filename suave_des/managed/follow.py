"""Follow pipeline: visits the points of the path to inspect, in order, and adds up the way (facts: kas-lab/suave)."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Generator

import numpy as np
import simpy

from suave_des.clock import Process
from suave_des.managed.node import SetPointSender
from suave_des.managed.travel import TravellingNode
from suave_des.scenario.revision import FollowRevision
from suave_des.vehicle.model import Array
from suave_des.vehicle.vehicle import Vehicle, Watch
from suave_des.world.pipeline import SEA_BED_Z_M

ALTITUDE_M = 1.25
Z_M = SEA_BED_Z_M + ALTITUDE_M
POLLS_BEFORE_RESENDING = 10
POINTS_AHEAD = 16
"""Points whose set-points are sent at a time: enough to pay, few enough that little is lost when control changes."""


class FollowPipeline(TravellingNode):
    """The follow function.

    Attributes:
        finished: the event that the last point of the path is reached.

    Args:
        env: the mission's clock.
        vehicle: whose position is looked at.
        sender: the way to the autopilot.
        revision: how the exemplar's revision behaves.
        path: gives the path to inspect, x and y of its points, shape (points, 2); none while the pipeline is not
            detected.
    """

    def __init__(
        self,
        env: simpy.Environment,
        vehicle: Vehicle,
        sender: SetPointSender,
        revision: FollowRevision,
        path: Callable[[], Array | None],
    ) -> None:
        super().__init__(env, vehicle, sender)
        self._revision = revision
        self._path = path
        self._way: Array = np.empty((0, 2))
        self._watch: Watch | None = None
        self._reached_at: list[int] = []
        self._poll = self._wake = self._sent_at = 0
        self._next = 0
        self._last_point: list[float] | None = None
        self._travelled_m = 0.0
        self._published_m = 0.0
        self.finished = env.event()

    @property
    def distance_m(self) -> float:
        """Distance inspected, as it was published last."""
        self._catch_up()
        return self._published_m

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
        if self._process is None or not self._process.is_alive:
            return
        self._catch_up()
        self._stop(self._watch, self._poll)
        self._watch = None
        if self._revision.adds_remaining_way and self._last_point is not None:
            x, y, _ = self._vehicle.position(self.env.now)
            self._travelled_m += math.dist(self._last_point, (x, y))
            self._published_m = self._travelled_m

    def _follow(self, path: Array) -> Process:
        """Go from point to point.

        Polls lie on a grid that began with the activation. Instead of stopping at each, or at each point, the points'
        set-points are sent ahead, and the node wakes when there is one to send: the next one, or again one that ten
        polls did not see.
        """
        rules = self._revision
        self._way = path
        self._watch = watch = Watch(
            self.env.now, rules.poll_period_s, rules.acceptance_m, math.inf, 0, POLLS_BEFORE_RESENDING
        )
        self._poll = self._wake = self._sent_at = 0
        places = np.empty((len(path), 3))
        places[:, :2], places[:, 2] = path, Z_M
        try:
            while self._next < len(path):
                self._sent_at = first = self._poll
                begin = True
                while not (yield from self._go_on(places, watch, first, begin=begin)):
                    first = max(first, self._poll + 1, watch.first_tick_from(self.env.now))
                    begin = False
        except simpy.Interrupt:
            return
        self._watch = None
        self.finished.succeed()

    def _go_on(self, places: Array, watch: Watch, first: int, *, begin: bool) -> Generator[simpy.Event, None, bool]:
        """Go on until there is a point to send; False if control changes before that.

        Args:
            places: where the points' set-points are, shape (points, 3).
            watch: the polls.
            first: first poll to look at.
            begin: whether the next point is to be sent now.
        """
        self._reached_at, self._wake = self._sender.send_ahead(
            places[self._next : self._next + POINTS_AHEAD],
            Z_M,
            watch,
            first=first,
            last=self._sent_at + POLLS_BEFORE_RESENDING,
            begin=begin,
        )
        is_time = self._wake <= self._poll or (yield from self._sleep(watch, self._wake))
        self._catch_up()
        if is_time:
            self._poll = self._wake
        return self._poll == self._wake  # also if control changes at the very poll that finds the last point reached

    def _catch_up(self) -> None:
        """Take in the points that polls until now have found reached."""
        if self._reached_at and self._watch is not None:
            poll = min(self._watch.last_tick_until(self.env.now), self._wake)
            reached = bisect_right(self._reached_at, poll)
            for point in self._way[self._next : self._next + reached].tolist():
                self._arrive(point)
            if reached:
                self._poll = self._sent_at = self._reached_at[reached - 1]
                self._reached_at = self._reached_at[reached:]

    def _arrive(self, point: list[float]) -> None:
        self._next += 1
        if self._last_point is not None:
            self._travelled_m += math.dist(self._last_point, point)
            self._published_m = self._travelled_m
        self._last_point = point
