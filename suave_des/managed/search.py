"""Generate search path: a spiral around the start, at the altitude that the mode sets (facts: kas-lab/suave)."""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np
import simpy

from suave_des.clock import tick_at_or_after
from suave_des.compiling import compiled
from suave_des.managed.node import SetPointSender
from suave_des.managed.travel import TravellingNode
from suave_des.scenario.modes import Mode
from suave_des.scenario.revision import SpiralRevision
from suave_des.vehicle.model import Array
from suave_des.vehicle.vehicle import Vehicle, Watch
from suave_des.world.pipeline import SEA_BED_Z_M, VIEW_TANGENT

TICK_PERIOD_S = 1.0
ANGLE_STEP_RAD = 0.1
REACHED_BOX_M = 0.4
TICKS_BEFORE_RESENDING = 10
INITIAL_ALTITUDE_M = 2.0
"""The node's altitude parameter before any mode is set."""


@compiled
def spiral(count: int, radius_m: float, altitude_m: float, centre_m: tuple[float, float], places: Array) -> None:
    """Set-points of the spiral.

    Args:
        count: the spiral's counter before the first of them.
        radius_m: its radius before the first of them.
        altitude_m: altitude above the sea bed; a turn widens the spiral by what the camera sees from there.
        centre_m: x and y of its centre.
        places: shape (n, 4); x, y, z and the spiral's radius are written into it, in m.
    """
    for n in range(places.shape[0]):
        if count > 0:
            turn_width = 2.0 * altitude_m * VIEW_TANGENT
            radius_m += turn_width * ANGLE_STEP_RAD / (2.0 * math.pi)
        angle = ANGLE_STEP_RAD * count
        places[n, 0] = centre_m[0] + radius_m * math.cos(angle)
        places[n, 1] = centre_m[1] + radius_m * math.sin(angle)
        places[n, 2] = SEA_BED_Z_M + altitude_m
        places[n, 3] = radius_m
        count += 1


class GenerateSearchPath(TravellingNode):
    """The search function; once a second while active it looks whether its set-point is reached, and sends the next.

    Args:
        env: the mission's clock.
        vehicle: whose position is looked at.
        sender: the way to the autopilot.
        revision: how the exemplar's revision behaves.
        origin_m: origin of the local frame in x and y, where revision 2023 centres the spiral.
        phase_s: mission time of a tick of the node's timer.
        ready_s: mission time before which the node does not tick, whatever its mode.
    """

    def __init__(
        self,
        env: simpy.Environment,
        vehicle: Vehicle,
        sender: SetPointSender,
        revision: SpiralRevision,
        origin_m: tuple[float, float],
        phase_s: float,
        ready_s: float = 0.0,
    ) -> None:
        super().__init__(env, vehicle, sender)
        self._revision = revision
        self._phase_s = phase_s
        self._ready_s = ready_s
        self._centre_m = origin_m
        self.altitude_m = INITIAL_ALTITUDE_M
        self._lowered_m = 0.0
        self._ticked = self._wake = 0
        self._restart()

    def configure(self, mode: Mode) -> None:
        """Take over the mode's spiral_altitude; the spiral itself goes on."""
        altitude = mode.parameters.get("spiral_altitude")
        if altitude is not None and altitude != self.altitude_m:
            self._catch_up()
            self.altitude_m = float(altitude)
            if self._watch is not None:
                self._vehicle.drop_ahead(self.env.now, self._watch, self._ticked)
                self._control_changed(0)

    def activated(self) -> None:
        """Start ticking; revision 1.5 begins a new spiral here."""
        if self._revision.restarts_on_activation:
            self._restart()
        if self._revision.workaround_cleared_on_activation:
            self._lowered_m = 0.0
        if self._revision.centre == "activation":
            self._centre_m = self._vehicle.position(self.env.now)[:2]
        first_s = tick_at_or_after(max(self.env.now, self._ready_s), self._phase_s, TICK_PERIOD_S)
        self._rest_until(first_s)

    def deactivated(self) -> None:
        """Stop ticking."""
        self._catch_up()
        self._stop(self._ticked)

    def _restart(self) -> None:
        self._count = 0
        self._radius_m = 0.0
        self._last_altitude_m: float | None = None
        self._places: Array | None = None
        self._reached_at: list[int] = []
        self._waited_ticks = 0

    def wake(self) -> None:
        """Do what there is to do at this tick, and foresee those that follow."""
        if self._watch is None:
            self._ticked = self._wake = 0
            self._watch = Watch(
                self.env.now, TICK_PERIOD_S, REACHED_BOX_M, REACHED_BOX_M, 1, TICKS_BEFORE_RESENDING + 1
            )
        elif self._all_reached():
            self.foresee_anew()
            return
        else:
            self._catch_up()
            self._ticked = self._wake
        self._foresee(self._watch, begin=self._tick())

    def foresee_anew(self) -> None:
        """Take in the ticks until now, and foresee those that follow."""
        if self._watch is not None:
            self._catch_up()
            self._foresee(self._watch)

    def _foresee(self, watch: Watch, *, begin: bool = False) -> None:
        """Send the set-points of coming ticks ahead, as far as the tick at which there is more to do; rest until then.

        Args:
            watch: the ticks.
            begin: whether to send the present one, too.
        """
        first = self._ticked + 1
        if self._places is None or self.altitude_m != self._last_altitude_m:
            self._wake = first
        else:
            present = self._places[0]
            self._places = np.empty((1 + self._ahead, 4))
            self._places[0] = present
            spiral(self._count, self._radius_m, self.altitude_m, self._centre_m, self._places[1:])
            last = self._ticked + TICKS_BEFORE_RESENDING + 1 - self._waited_ticks
            self._reached_at, self._wake = self._sender.send_ahead(
                self._places, self._commanded_z_m(), watch, first=first, last=last, begin=begin
            )
        self._rest_until(watch.time_s(self._wake))

    def _all_reached(self) -> bool:
        """Whether set-points were sent ahead and all reached: then those after them are sent at the same tick."""
        return self._places is not None and len(self._reached_at) == len(self._places) > 1

    def _catch_up(self) -> None:
        """Take in what the ticks until now have done, without the one at which there is more to do."""
        if self._watch is None:
            return
        tick = min(self._watch.last_tick_until(self.env.now), self._wake - 1)
        reached = bisect_right(self._reached_at, tick)
        if reached and self._places is not None:
            self._count += reached
            self._places = self._places[reached:]
            self._radius_m = self._places.item(0, 3)
            self._ticked, self._waited_ticks = self._reached_at[reached - 1], 0
        self._reached_at = []
        self._waited_ticks += tick - self._ticked
        self._ticked = tick

    def _tick(self) -> bool:
        """Work out the present set-point; whether it is to be sent."""
        if self.altitude_m != self._last_altitude_m:
            self._count += 1
            self._last_altitude_m = self.altitude_m
        near_xy, near_z = self._near_set_point()
        if near_xy and near_z:
            self._make_next()
            return True
        self._waited_ticks += 1
        if self._waited_ticks <= TICKS_BEFORE_RESENDING:
            return False
        self._waited_ticks = 0
        if near_xy:
            # The autopilot stops short in z: ask for less altitude than is wanted.
            self._lowered_m += self._revision.workaround_step_m
        return True

    def _near_set_point(self) -> tuple[bool, bool]:
        if self._places is None:
            return True, True
        x, y, z = self._vehicle.position(self.env.now)
        x_set, y_set, z_set, _ = self._places[0].tolist()
        near_xy = abs(x - x_set) <= REACHED_BOX_M and abs(y - y_set) <= REACHED_BOX_M
        return near_xy, abs(z - z_set) <= REACHED_BOX_M

    def _make_next(self) -> None:
        self._places = np.empty((1, 4))
        spiral(self._count, self._radius_m, self.altitude_m, self._centre_m, self._places)
        self._radius_m = self._places.item(0, 3)
        self._count += 1
        self._waited_ticks = 0

    def _commanded_z_m(self) -> float:
        # A set-point sent again has the present altitude, though "reached" is judged against the one it was made with.
        return SEA_BED_Z_M + self.altitude_m - self._lowered_m
