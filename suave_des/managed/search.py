"""Generate search path: a spiral around the start, at the altitude that the mode sets (facts: kas-lab/suave)."""

from __future__ import annotations

import math

import simpy

from suave_des.clock import Process, tick_at_or_after, until
from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.scenario.modes import Mode
from suave_des.scenario.revision import SpiralRevision
from suave_des.vehicle.vehicle import Vehicle
from suave_des.world.pipeline import SEA_BED_Z_M, VIEW_TANGENT

TICK_PERIOD_S = 1.0
ANGLE_STEP_RAD = 0.1
REACHED_BOX_M = 0.4
TICKS_BEFORE_RESENDING = 10
INITIAL_ALTITUDE_M = 2.0
"""The node's altitude parameter before any mode is set."""


class GenerateSearchPath(FunctionNode):
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
        super().__init__(env)
        self._vehicle = vehicle
        self._sender = sender
        self._revision = revision
        self._phase_s = phase_s
        self._ready_s = ready_s
        self._centre_m = origin_m
        self._process: simpy.Process | None = None
        self.altitude_m = INITIAL_ALTITUDE_M
        self._lowered_m = 0.0
        self._restart()

    def configure(self, mode: Mode) -> None:
        """Take over the mode's spiral_altitude; the spiral itself goes on."""
        altitude = mode.parameters.get("spiral_altitude")
        if altitude is not None:
            self.altitude_m = float(altitude)

    def activated(self) -> None:
        """Start ticking; revision 1.5 begins a new spiral here."""
        if self._revision.restarts_on_activation:
            self._restart()
        if self._revision.workaround_cleared_on_activation:
            self._lowered_m = 0.0
        if self._revision.centre == "activation":
            self._centre_m = self._vehicle.position(self.env.now)[:2]
        self._process = self.env.process(self._tick_while_active())

    def deactivated(self) -> None:
        """Stop ticking."""
        if self._process is not None:
            self._process.interrupt()
            self._process = None

    def _restart(self) -> None:
        self._count = 0
        self._radius_m = 0.0
        self._last_altitude_m: float | None = None
        self._set_point: tuple[float, float, float] | None = None
        self._waited_ticks = 0

    def _tick_while_active(self) -> Process:
        try:
            yield until(self.env, tick_at_or_after(max(self.env.now, self._ready_s), self._phase_s, TICK_PERIOD_S))
            while True:
                self._tick()
                yield self.env.timeout(TICK_PERIOD_S)
        except simpy.Interrupt:
            return

    def _tick(self) -> None:
        if self.altitude_m != self._last_altitude_m:
            self._count += 1
            self._last_altitude_m = self.altitude_m
        near_xy, near_z = self._near_set_point()
        if near_xy and near_z:
            self._issue_next()
            return
        self._waited_ticks += 1
        if self._waited_ticks > TICKS_BEFORE_RESENDING:
            self._waited_ticks = 0
            if near_xy:
                # The autopilot stops short in z: ask for less altitude than is wanted.
                self._lowered_m += self._revision.workaround_step_m
            self._send()

    def _near_set_point(self) -> tuple[bool, bool]:
        if self._set_point is None:
            return True, True
        x, y, z = self._vehicle.position(self.env.now)
        near_xy = abs(x - self._set_point[0]) <= REACHED_BOX_M and abs(y - self._set_point[1]) <= REACHED_BOX_M
        return near_xy, abs(z - self._set_point[2]) <= REACHED_BOX_M

    def _issue_next(self) -> None:
        angle = ANGLE_STEP_RAD * self._count
        if self._count > 0:
            turn_width = 2.0 * self.altitude_m * VIEW_TANGENT
            self._radius_m += turn_width * ANGLE_STEP_RAD / (2.0 * math.pi)
        self._set_point = (
            self._centre_m[0] + self._radius_m * math.cos(angle),
            self._centre_m[1] + self._radius_m * math.sin(angle),
            SEA_BED_Z_M + self.altitude_m,
        )
        self._count += 1
        self._waited_ticks = 0
        self._send()

    def _send(self) -> None:
        # A set-point sent again has the present altitude, though "reached" is judged against the one it was made with.
        if self._set_point is not None:
            x, y, _ = self._set_point
            self._sender.send(x, y, SEA_BED_Z_M + self.altitude_m - self._lowered_m)
