"""Generate search path: a spiral around the start, at the altitude that the mode sets.

Source: node f_generate_search_path of kas-lab/suave, of 4 February 2023 and of 1.5.0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from suave_des.clock import tick_at_or_after
from suave_des.compiling import Array, Record, compiled, record
from suave_des.domain import SEA_BED_Z_M
from suave_des.managed.waypoints import Does, Timer, WaypointFunction, send
from suave_des.scenario.models import SpiralRevision
from suave_des.scenario.modes import Mode
from suave_des.vehicle.kernel import VehicleRecord


@record
class Search(Record):
    """The search function's numbers."""

    timer: Timer
    altitude_m: float  # above the sea bed, the node's parameter
    last_altitude_m: float  # at the tick before; nan: there was none
    below_m: float  # how far the set-point is below that altitude
    centre_x_m: float  # of the spiral
    centre_y_m: float
    angle_step_rad: float  # from one way-point to the next
    view_tangent: float  # of half the camera's field of view
    acceptance_m: float  # a way-point is reached when dx, dy and dz are at most this
    ticks_before_resending: int
    workaround_step_m: float  # by which the set-point is lowered when only z is not reached
    has_begun: bool  # whether there is a way-point
    step: int  # of the next way-point
    radius_m: float  # of the spiral at the current one
    x_m: float  # the current way-point
    y_m: float
    z_m: float


@compiled
def go_on(search: Search) -> None:
    """Generate the next way-point; a turn widens the spiral by what the camera sees."""
    turn_width_m = 2.0 * search.altitude_m * search.view_tangent
    search.radius_m += turn_width_m * search.angle_step_rad / (2.0 * math.pi)
    angle_rad = search.angle_step_rad * search.step
    search.x_m = search.centre_x_m + search.radius_m * math.cos(angle_rad)
    search.y_m = search.centre_y_m + search.radius_m * math.sin(angle_rad)
    search.z_m = SEA_BED_Z_M + search.altitude_m
    search.step += 1
    search.has_begun = True


@compiled
def tick(search: Search, track: Array, row: int) -> int:
    """Look whether the way-point is reached, or has to be sent again; return what the node does."""
    timer: Timer = search.timer
    timer.tick += 1
    if search.altitude_m != search.last_altitude_m:  # the exemplar's node counts a step then
        search.step += 1
        search.last_altitude_m = search.altitude_m
    is_above = (
        abs(track[row, 0] - search.x_m) <= search.acceptance_m
        and abs(track[row, 1] - search.y_m) <= search.acceptance_m
    )
    if timer.is_due:
        timer.is_due = False
        timer.waited = 0
        if not search.has_begun:
            go_on(search)
    elif is_above and abs(track[row, 2] - search.z_m) <= search.acceptance_m:
        timer.waited = 0
        go_on(search)
    elif timer.waited <= search.ticks_before_resending:
        timer.waited += 1
        return Does.NOTHING.value
    else:
        timer.waited = 1  # the exemplar's node counts this tick, too
        if is_above:  # its work-around for an autopilot that stops short of its altitude set-point
            search.below_m += search.workaround_step_m
    return Does.SENDS.value


@compiled
def send_waypoint(search: Search, vehicle: VehicleRecord) -> bool:
    """Send the way-point, at the present altitude; it is reached at its own z."""
    z_m = SEA_BED_Z_M + search.altitude_m - search.below_m
    return send(search.timer, vehicle, search.x_m, search.y_m, z_m)


@dataclass(eq=False)
class GenerateSearchPath(WaypointFunction):
    """The search function: generates the way-points of a spiral, each sent when the previous one is
    reached.

    Attributes:
        state: its numbers, which the flight changes at each tick.
        centre_m: x and y of the spiral's centre; in revision 2023 the local frame's origin.
        view_tangent: tangent of half the camera's field of view.
        phase_s: mission time of a tick of the node's timer.
        start_latency_s: from the first activation to the first tick.
    """

    state: Search
    revision: SpiralRevision
    centre_m: tuple[float, float]
    view_tangent: float
    phase_s: float
    start_latency_s: float = 0.0
    # earliest mission time of the first tick
    _ready_s: float | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        state, revision = self.state, self.revision
        self.connect(state.timer, revision.tick_period_s)
        state.altitude_m = revision.initial_altitude_m
        state.centre_x_m, state.centre_y_m = self.centre_m
        state.angle_step_rad, state.view_tangent = revision.angle_step_rad, self.view_tangent
        state.acceptance_m = revision.acceptance_m
        state.ticks_before_resending = revision.ticks_before_resending
        state.workaround_step_m = revision.workaround_step_m
        self._restart()

    def _restart(self) -> None:
        state = self.state
        state.has_begun, state.step, state.radius_m = False, 0, 0.0
        state.last_altitude_m = math.nan

    def configure(self, mode: Mode) -> None:
        """Apply the mode's spiral_altitude; the spiral itself continues."""
        altitude = mode.parameters.get("spiral_altitude")
        if altitude is not None:
            self.state.altitude_m = float(altitude)

    def activated(self) -> None:
        """Start ticking; revision 1.5 begins a new spiral here."""
        state, revision = self.state, self.revision
        if revision.restarts_on_activation:
            self._restart()
        if revision.workaround_cleared_on_activation:
            state.below_m = 0.0
        is_first = not state.has_begun
        if revision.centre == "activation" or (revision.centre == "first_activation" and is_first):
            state.centre_x_m, state.centre_y_m, _ = self.sender.vehicle.position(self.env.now)
        if self._ready_s is None:
            self._ready_s = self.env.now + self.start_latency_s
        first_s = tick_at_or_after(
            max(self.env.now, self._ready_s), self.phase_s, revision.tick_period_s
        )
        self.start_at(first_s, resumes=not (is_first or revision.resends_on_activation))

    def deactivated(self) -> None:
        """Stop ticking."""
        self.stop()
