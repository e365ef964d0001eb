"""Generate search path: a spiral around the start, at the altitude that the mode sets.

Source: node f_generate_search_path of kas-lab/suave, of 4 February 2023 and of 1.5.0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from suave_des.clock import tick_at_or_after
from suave_des.compiling import Array, compiled
from suave_des.domain import SEA_BED_Z_M
from suave_des.managed.waypoints import WaypointFunction
from suave_des.scenario.models import SpiralRevision
from suave_des.scenario.modes import Mode
from suave_des.vehicle.vehicle import ArrivalCheck


@compiled
def spiral(
    step: int,
    radius_m: float,
    altitude_m: float,
    form: tuple[float, float],
    centre_m: tuple[float, float],
    waypoints: Array,
) -> None:
    """Generate way-points of the spiral.

    Args:
        step, radius_m: step counter and radius before the first of them.
        altitude_m: altitude above the sea bed; a turn widens the spiral by what the camera sees
            from there.
        form: angle from one way-point to the next, rad, and the tangent of half the camera's field
            of view.
        centre_m: x and y of its centre.
        waypoints: shape (n, 4); x, y, z and the spiral's radius are written into it, in m.
    """
    angle_step, view_tangent = form
    for n in range(waypoints.shape[0]):
        if step > 0:
            turn_width = 2.0 * altitude_m * view_tangent
            radius_m += turn_width * angle_step / (2.0 * math.pi)
        angle = angle_step * step
        waypoints[n, 0] = centre_m[0] + radius_m * math.cos(angle)
        waypoints[n, 1] = centre_m[1] + radius_m * math.sin(angle)
        waypoints[n, 2], waypoints[n, 3] = SEA_BED_Z_M + altitude_m, radius_m
        step += 1


@dataclass(eq=False)
class GenerateSearchPath(WaypointFunction):
    """The search function: generates the way-points of a spiral, each sent when the previous one is
    reached.

    Attributes:
        centre_m: x and y of the spiral's centre; in revision 2023 the local frame's origin.
        view_tangent: tangent of half the camera's field of view.
        phase_s: mission time of a tick of the node's timer.
        start_latency_s: from the first activation to the first tick.
        altitude_m: the node's altitude parameter.
    """

    revision: SpiralRevision
    centre_m: tuple[float, float]
    view_tangent: float
    phase_s: float
    start_latency_s: float = 0.0
    altitude_m: float = field(init=False)
    _below_m: float = field(default=0.0, init=False)  # how far below the altitude the set-point is
    _ready_s: float | None = field(
        default=None, init=False
    )  # earliest mission time of the first tick

    def __post_init__(self) -> None:
        super().__post_init__()
        self.altitude_m = self.revision.initial_altitude_m
        self._restart()

    def _restart(self) -> None:
        self._step = 0
        self._last_altitude_m: float | None = None  # at the last tick
        self._ahead: Array | None = (
            None  # the current way-point and some that follow it; None before the first
        )

    def configure(self, mode: Mode) -> None:
        """Apply the mode's spiral_altitude; the spiral itself continues."""
        altitude = mode.parameters.get("spiral_altitude")
        if altitude is not None and altitude != self.altitude_m:
            self.catch_up()
            self.altitude_m = float(altitude)
            self._keep_current()
            self.waypoints_changed()

    def activated(self) -> None:
        """Start ticking; revision 1.5 begins a new spiral here."""
        if self.revision.restarts_on_activation:
            self._restart()
        if self.revision.workaround_cleared_on_activation:
            self._below_m = 0.0
        is_first = self._ahead is None
        if self.revision.centre == "activation" or (
            self.revision.centre == "first_activation" and is_first
        ):
            self.centre_m = self.sender.vehicle.position(self.env.now)[:2]
            self._keep_current()
        if self._ready_s is None:
            self._ready_s = self.env.now + self.start_latency_s
        first_s = tick_at_or_after(
            max(self.env.now, self._ready_s), self.phase_s, self.revision.tick_period_s
        )
        self.start_at(first_s, resumes=not (is_first or self.revision.resends_on_activation))

    def deactivated(self) -> None:
        """Stop ticking."""
        self.stop()

    def _keep_current(self) -> None:
        """Have the way-points after the current one generated anew."""
        self._ahead = None if self._ahead is None else self._ahead[:1]

    def ticked(self) -> None:
        """At another altitude than at the tick before, the spiral is a step on."""
        if self.altitude_m != self._last_altitude_m:
            self._step += 1
            self._last_altitude_m = self.altitude_m

    def waypoints(self, count: int) -> Array:
        """Return the current way-point and those that follow it."""
        if self._ahead is not None and len(self._ahead) > count:
            return self._ahead[:count]
        waypoints = np.empty((count + 1, 4))  # the last one is current when all others are reached
        step = self._step + (self.altitude_m != self._last_altitude_m)
        form = self.revision.angle_step_rad, self.view_tangent
        if self._ahead is None:
            spiral(step, 0.0, self.altitude_m, form, self.centre_m, waypoints)
            self._step += 1
        else:
            waypoints[0] = self._ahead[0]
            spiral(step, waypoints.item(0, 3), self.altitude_m, form, self.centre_m, waypoints[1:])
        self._ahead = waypoints
        return waypoints[:count]

    def set_point_z_m(self) -> float:
        """Return the z of the altitude, lowered by the work-around; arrival is checked at the
        way-point's own z.
        """
        return SEA_BED_Z_M + self.altitude_m - self._below_m

    def reached(self, count: int) -> None:
        """Advance to the next way-point."""
        assert self._ahead is not None  # it was one of the way-points
        self._ahead = self._ahead[count:]
        self._step += count

    def not_reached(self) -> None:
        """Command a lower altitude if only z is not reached.

        This is the exemplar's work-around for an autopilot that stops short of its altitude
        set-point.
        """
        x_m, y_m, _ = self.sender.vehicle.position(self.env.now)
        waypoint = self.waypoints(1)
        if (
            max(abs(x_m - waypoint.item(0, 0)), abs(y_m - waypoint.item(0, 1)))
            <= self.revision.acceptance_m
        ):
            self._below_m += self.revision.workaround_step_m

    def arrival_check(self, start_s: float) -> ArrivalCheck:
        """Check at each tick, from the one after the way-point's on."""
        # The exemplar resends when its wait counter exceeds 10. Sending resets the counter; a
        # resend also counts in the same tick, hence one tick less.
        node = self.revision
        first, again = node.ticks_before_resending + 2, node.ticks_before_resending + 1
        return ArrivalCheck(
            start_s, node.tick_period_s, node.acceptance_m, node.acceptance_m, 1, first, again
        )
