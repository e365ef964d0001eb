"""Follow pipeline: visits the points of the path in order, and adds up the distance.

Source: node f_follow_pipeline of kas-lab/suave, of 4 February 2023 and of 1.5.0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import reduce
from itertools import pairwise
from operator import add
from typing import NamedTuple, Self

import numpy as np
import simpy

from suave_des.compiling import Array
from suave_des.domain import SEA_BED_Z_M
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.waypoints import WaypointFunction
from suave_des.scenario.models import FollowRevision
from suave_des.vehicle.vehicle import ArrivalCheck


class InspectionPath(NamedTuple):
    """A path to inspect.

    Attributes:
        points_m: positions to visit above the pipeline: x, y, z, shape (points, 3).
        lengths_m: distance in x and y from the previous point to each; 0 for the first.
    """

    points_m: Array
    lengths_m: tuple[float, ...]

    @classmethod
    def there_and_back(cls, points_m: Array, altitude_m: float) -> Self:
        """Make the path above all points, shape (n, at least 2), and back: 2 n points.

        From its element i on it is the path to follow when point i is seen first: on to the far
        end, then back along all.
        """
        x_y_m = np.concatenate((points_m[:, :2], points_m[::-1, :2]))
        lengths_m = (math.dist(a, b) for a, b in pairwise(x_y_m.tolist()))
        return cls(np.insert(x_y_m, 2, SEA_BED_Z_M + altitude_m, axis=1), (0.0, *lengths_m))


@dataclass(eq=False)
class FollowPipeline(WaypointFunction):
    """The follow function: its way-points are the points of the path, each sent when the previous
    one is reached.

    Attributes:
        path: from the start of the pipeline to its end, and back.
        detector: says from which of its points on the path is to be followed.
        finished: triggered when the last point of the path is reached.
    """

    revision: FollowRevision
    path: InspectionPath
    detector: PipelineDetector
    _next: int = field(default=0, init=False)  # point of the path
    _has_arrived: bool = field(default=False, init=False)
    _travelled_m: float = field(default=0.0, init=False)
    _published_m: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.finished: simpy.Event = self.env.event()

    @property
    def distance_m(self) -> float:
        """Last published distance inspected."""
        self.catch_up()
        return self._published_m

    def activated(self) -> None:
        """Start; the distance restarts at zero, although the published value stays until there is a
        new one.

        If the revision lets the distance accumulate, only the piece that was interrupted is lost.
        """
        if not self.revision.keeps_distance_on_activation:
            self._travelled_m = 0.0
        self._has_arrived = False
        first = self.detector.first_point
        if first is not None and not self.finished.triggered:
            self._next = first if self.revision.restarts_on_activation else max(first, self._next)
            self.start_at(self.env.now)

    def deactivated(self) -> None:
        """Stop; revision 2023 adds the distance from the last point reached, if any, to the current
        position.
        """
        if self.finished.triggered:
            return
        self.stop()
        if self.revision.counts_interrupted_piece and self._has_arrived:
            x_m, y_m, _ = self.sender.vehicle.position(self.env.now)
            self._travelled_m += math.dist(
                self.path.points_m[self._next - 1, :2].tolist(), (x_m, y_m)
            )
            self._published_m = self._travelled_m

    def arrival_check(self, start_s: float) -> ArrivalCheck:
        """Check at each poll, in x and y alone."""
        period_s, width_m = self.revision.poll_period_s, self.revision.acceptance_m
        # Otherwise the poll counter restarts with each resend; here it stays above the limit, so
        # every later poll resends.
        polls = self.revision.polls_before_resending
        waits = (polls + 1, 1) if self.revision.resends_at_each_poll else (polls, polls)
        return ArrivalCheck(start_s, period_s, width_m, math.inf, 0, *waits)

    def waypoints(self, count: int) -> Array:
        """Return the current point and those after it; none if the end is reached."""
        return self.path.points_m[self._next : self._next + count]

    def completed(self) -> None:
        """Report that the end of the path is reached."""
        self.finished.succeed()

    def set_point_z_m(self) -> float:
        """Return the z at which the pipeline is followed."""
        return SEA_BED_Z_M + self.revision.altitude_m

    def reached(self, count: int) -> None:
        """Add to the distance, starting at the first point, and publish it at each point after
        that.
        """
        lengths_m = self.path.lengths_m[self._next + (not self._has_arrived) : self._next + count]
        self._next += count
        self._has_arrived = True
        if lengths_m:
            self._published_m = self._travelled_m = reduce(add, lengths_m, self._travelled_m)
