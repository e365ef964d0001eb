"""Follow pipeline: visits the points of the path in order, and adds up the distance.

Source: node f_follow_pipeline of kas-lab/suave, of 4 February 2023 and of 1.5.0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import simpy

from suave_des.clock import exactly_at
from suave_des.compiling import Array, Record, compiled, record
from suave_des.domain import SEA_BED_Z_M
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.waypoints import Does, Timer, WaypointFunction, send
from suave_des.scenario.models import FollowRevision
from suave_des.vehicle.kernel import VehicleRecord


def there_and_back(points_m: Array) -> Array:
    """Make the path above all points, shape (n, at least 2), and back.

    From its row i on it is the path to follow when point i is seen first: on to the far end, then
    back along all.

    Returns:
        x and y of the points to visit, and the distance from the previous point to each, 0 for the
        first; shape (2 n, 3), m.
    """
    x_y_m = np.concatenate((points_m[:, :2], points_m[::-1, :2]))
    lengths_m = [0.0, *(math.dist(a, b) for a, b in pairwise(x_y_m.tolist()))]
    return np.column_stack((x_y_m, lengths_m))


@record
class Follow(Record):
    """The follow function's numbers."""

    timer: Timer
    z_m: float  # of the set-points
    acceptance_m: float  # a point is reached when dx and dy are at most this
    polls_before_resending: int
    resends_at_each_poll: bool  # from then on
    next_point: int  # of the path, to be reached
    has_arrived: bool  # at a point since its activation
    travelled_m: float
    published_m: float


@compiled
def tick(follow: Follow, track: Array, row: int, path: Array) -> int:
    """Look whether the next point is reached, or has to be sent again; return what the node does.

    A point that has been sent is looked for at the same poll: several may be reached at once. So
    the timer goes on only where the next point is not reached.
    """
    timer: Timer = follow.timer
    to, acceptance_m = follow.next_point, follow.acceptance_m
    if timer.is_due:
        timer.is_due = False
        timer.waited = 0
    elif (
        abs(track[row, 0] - path[to, 0]) <= acceptance_m
        and abs(track[row, 1] - path[to, 1]) <= acceptance_m
    ):
        if follow.has_arrived:  # the distance starts at the first point
            follow.travelled_m += path[to, 2]
            follow.published_m = follow.travelled_m
        follow.has_arrived = True
        follow.next_point += 1
        timer.waited = 0
        if follow.next_point == path.shape[0]:
            timer.is_active = False
            return Does.FINISHES.value
    elif timer.waited < follow.polls_before_resending:
        timer.waited += 1
        timer.tick += 1
        return Does.NOTHING.value
    else:
        timer.tick += 1
        if not follow.resends_at_each_poll:
            timer.waited = 1
    return Does.SENDS.value


@compiled
def send_point(follow: Follow, vehicle: VehicleRecord, path: Array) -> bool:
    """Send the next point."""
    to = follow.next_point
    return send(follow.timer, vehicle, path[to, 0], path[to, 1], follow.z_m)


@dataclass(eq=False)
class FollowPipeline(WaypointFunction):
    """The follow function: its way-points are the points of a path, each sent when the previous one
    is reached.

    Attributes:
        state: its numbers, which the flight changes at each poll.
        path: see `there_and_back`.
        detector: says from which of its points on the path is to be followed.
        finished: triggered when the last point of the path is reached.
    """

    state: Follow
    revision: FollowRevision
    path: Array
    detector: PipelineDetector

    def __post_init__(self) -> None:
        self.finished: simpy.Event = self.env.event()
        state, revision = self.state, self.revision
        self.connect(state.timer, revision.poll_period_s)
        state.z_m = SEA_BED_Z_M + revision.altitude_m
        state.acceptance_m = revision.acceptance_m
        state.resends_at_each_poll = revision.resends_at_each_poll
        # A node that then sends at each poll counts one poll more before the first time.
        polls = revision.polls_before_resending
        state.polls_before_resending = polls + 1 if revision.resends_at_each_poll else polls

    @property
    def distance_m(self) -> float:
        """Last published distance inspected."""
        return float(self.state.published_m)

    def activated(self) -> None:
        """Start; the distance restarts at zero, although the published value stays until there is a
        new one.

        If the revision lets the distance accumulate, only the piece that was interrupted is lost.
        """
        state, revision = self.state, self.revision
        if not revision.keeps_distance_on_activation:
            state.travelled_m = 0.0
        state.has_arrived = False
        first = self.detector.first_point
        if first is not None and not self.finished.triggered:
            if revision.restarts_on_activation or state.next_point < first:
                state.next_point = first
            self.start_at(self.env.now)

    def deactivated(self) -> None:
        """Stop; revision 2023 adds the distance from the last point reached, if any, to the current
        position.
        """
        if self.finished.triggered:
            return
        self.stop()
        state = self.state
        if self.revision.counts_interrupted_piece and state.has_arrived:
            x_m, y_m, _ = self.sender.vehicle.position(self.env.now)
            last_m = self.path[state.next_point - 1, :2].tolist()
            state.travelled_m += math.dist(last_m, (x_m, y_m))
            state.published_m = state.travelled_m

    def reaches_end(self, t_s: float) -> None:
        """Report at mission time t that the end of the path is reached."""
        end = exactly_at(self.env, t_s)
        end.callbacks.append(self.finished.trigger)
