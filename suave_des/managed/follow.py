"""Follow pipeline: visits the points of the path to inspect, in order, and adds up the way (facts: kas-lab/suave)."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import simpy

from suave_des.managed.node import SetPointSender
from suave_des.managed.travel import TravellingNode
from suave_des.scenario.revision import FollowRevision
from suave_des.vehicle.model import Array
from suave_des.vehicle.vehicle import Vehicle, Watch
from suave_des.world.pipeline import SEA_BED_Z_M

ALTITUDE_M = 1.25
Z_M = SEA_BED_Z_M + ALTITUDE_M
POLLS_BEFORE_RESENDING = 10


class Way(NamedTuple):
    """A path to inspect.

    Attributes:
        places_m: where the vehicle is to be above its points: x, y, z, shape (points, 3).
        lengths_m: from the point before to each, in x and y; nothing for the first.
    """

    places_m: Array
    lengths_m: tuple[float, ...]

    @classmethod
    def along(cls, points_m: Array) -> Way:
        """The way along points: x and y in the first two columns, shape (points, at least 2)."""
        places = np.full((len(points_m), 3), Z_M)
        places[:, :2] = points_m[:, :2]
        return cls(places, (0.0, *(math.dist(a, b) for a, b in pairwise(places[:, :2].tolist()))))

    def from_point(self, first: int) -> Way:
        """The rest of the way from a point on."""
        return Way(self.places_m[first:], self.lengths_m[first:])


_NO_WAY = Way(np.empty((0, 3)), ())


class FollowPipeline(TravellingNode):
    """The follow function.

    Attributes:
        finished: the event that the last point of the path is reached.

    Args:
        env: the mission's clock.
        vehicle: whose position is looked at.
        sender: the way to the autopilot.
        revision: how the exemplar's revision behaves.
        path: gives the path to inspect; none while the pipeline is not detected.
    """

    def __init__(
        self,
        env: simpy.Environment,
        vehicle: Vehicle,
        sender: SetPointSender,
        revision: FollowRevision,
        path: Callable[[], Way | None],
    ) -> None:
        super().__init__(env, vehicle, sender)
        self._revision = revision
        self._path = path
        self._way = _NO_WAY
        self._reached_at: list[int] = []
        self._poll = self._wake = self._sent_at = 0
        self._next = 0
        self._has_arrived = False
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
        self._has_arrived = False
        if self._revision.restarts_on_activation:
            self._next = 0
        path = self._path()
        if path is None or self.finished.triggered:
            return
        self._way = path
        # Polls lie on a grid that begins with the activation.
        self._watch = Watch(
            self.env.now,
            self._revision.poll_period_s,
            self._revision.acceptance_m,
            math.inf,
            0,
            POLLS_BEFORE_RESENDING,
        )
        self._poll = self._wake = 0
        self._go_on()

    def deactivated(self) -> None:
        """Stop; revision 2023 adds the way from the last point to here, if it was on its way from one."""
        if self._watch is None:
            return
        self._catch_up()
        self._stop(self._poll)
        if self._revision.adds_remaining_way and self._has_arrived:
            x, y, _ = self._vehicle.position(self.env.now)
            self._travelled_m += math.dist(self._way.places_m[self._next - 1, :2].tolist(), (x, y))
            self._published_m = self._travelled_m

    def wake(self) -> None:
        """There is a point to send at this poll: the next one, or again one that ten polls did not see."""
        self._catch_up()
        self._poll = self._wake
        self._go_on()

    def foresee_anew(self) -> None:
        """Take in the polls until now, and foresee those that follow."""
        self._catch_up()
        if self._watch is not None and self._poll < self._wake:
            self._foresee(max(self._poll + 1, self._watch.first_tick_from(self.env.now)), begin=False)
        self._go_on()

    def _go_on(self) -> None:
        """Send a point, unless one is under way, and rest until the next one is to be sent; or reach the end."""
        while self._poll == self._wake and self._next < len(self._way.lengths_m):
            self._sent_at = self._poll
            self._foresee(self._poll, begin=True)
        if self._watch is None:
            return
        if self._poll < self._wake:
            self._rest_until(self._watch.time_s(self._wake))
        else:
            self._watch = None
            self.finished.succeed()

    def _foresee(self, first: int, *, begin: bool) -> None:
        """Send points ahead, and take in those that are reached by now.

        Args:
            first: first poll to look at.
            begin: whether the next point is to be sent now.
        """
        if self._watch is None:
            return
        self._reached_at, self._wake = self._sender.send_ahead(
            self._way.places_m[self._next : self._next + 1 + self._ahead],
            Z_M,
            self._watch,
            first=first,
            last=self._sent_at + POLLS_BEFORE_RESENDING,
            begin=begin,
        )
        if self._wake <= self._poll:
            self._catch_up()
            self._poll = self._wake

    def _catch_up(self) -> None:
        """Take in the points that polls until now have found reached."""
        if self._reached_at and self._watch is not None:
            poll = min(self._watch.last_tick_until(self.env.now), self._wake)
            reached = bisect_right(self._reached_at, poll)
            if reached:
                self._arrive(reached)
                self._poll = self._sent_at = self._reached_at[reached - 1]
                self._reached_at = self._reached_at[reached:]

    def _arrive(self, points: int) -> None:
        lengths_m = self._way.lengths_m[self._next + (not self._has_arrived) : self._next + points]
        self._next += points
        self._has_arrived = True
        for length_m in lengths_m:
            self._travelled_m += length_m
            self._published_m = self._travelled_m
