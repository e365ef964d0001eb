"""Follow pipeline: visits the points of the path to inspect, in order, and adds up the way (facts: kas-lab/suave)."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence

import numpy as np
import simpy

from suave_des.clock import Process
from suave_des.managed.node import SetPointSender
from suave_des.managed.travel import TravellingNode
from suave_des.scenario.revision import FollowRevision
from suave_des.vehicle.vehicle import Vehicle, Watch
from suave_des.world.pipeline import SEA_BED_Z_M

ALTITUDE_M = 1.25
Z_M = SEA_BED_Z_M + ALTITUDE_M
POLLS_BEFORE_RESENDING = 10
POINTS_AHEAD = 8
"""Points whose set-points are sent at a time: enough to pay, few enough that little is lost when control changes."""

Path = Sequence[tuple[float, float]]


class FollowPipeline(TravellingNode):
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
        super().__init__(env, vehicle, sender)
        self._revision = revision
        self._path = path
        self._watch: Watch | None = None
        self._poll = self._sent_at = 0
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
        if self._process is None or not self._process.is_alive:
            return
        self._stop(self._watch, self._poll)
        if self._revision.adds_remaining_way and self._last_point is not None:
            x, y, _ = self._vehicle.position(self.env.now)
            self._travelled_m += math.dist(self._last_point, (x, y))
            self.distance_m = self._travelled_m

    def _follow(self, path: Path) -> Process:
        rules = self._revision
        self._watch = watch = Watch(
            self.env.now, rules.poll_period_s, rules.acceptance_m, math.inf, 0, POLLS_BEFORE_RESENDING
        )
        self._poll = self._sent_at = 0
        try:
            while self._next < len(path):
                self._sender.send(*path[self._next], Z_M)
                self._sent_at = first = self._poll
                while not (yield from self._go_on(path, watch, first)):
                    first = max(first, self._poll + 1, watch.first_tick_from(self.env.now))
        except simpy.Interrupt:
            return
        self.finished.succeed()

    def _go_on(self, path: Path, watch: Watch, first: int) -> Generator[simpy.Event, None, bool]:
        """Go on from point to point, until there is one to send: the next one, or again one that ten polls did not see.

        Polls lie on a grid that began with the activation. Instead of stopping at each, the points' set-points are sent
        ahead, and the node wakes when one is reached.

        Args:
            path: the points.
            watch: the polls.
            first: first poll to look at.

        Returns:
            False if the vehicle's control changes before that.
        """
        places = np.array([(x_m, y_m, Z_M) for x_m, y_m in path[self._next : self._next + POINTS_AHEAD]])
        reached_at, act_at = self._sender.send_ahead(
            places, Z_M, watch, first=first, last=self._sent_at + POLLS_BEFORE_RESENDING
        )
        for poll in reached_at:
            if poll > self._poll and not (yield from self._sleep(watch, poll)):
                return False
            self._poll = self._sent_at = poll
            self._arrive(path[self._next])
        if act_at > self._poll and not (yield from self._sleep(watch, act_at)):
            return False
        self._poll = act_at
        return True

    def _arrive(self, point: tuple[float, float]) -> None:
        self._next += 1
        if self._last_point is not None:
            self._travelled_m += math.dist(self._last_point, point)
            self.distance_m = self._travelled_m
        self._last_point = point
