"""Generate recharge path (revision 1.5): goes to the recharge station (facts: kas-lab/suave)."""

from __future__ import annotations

import simpy

from suave_des.clock import Process
from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.world.pipeline import SEA_BED_Z_M

ALTITUDE_M = 1.25
RESEND_PERIOD_S = 10.0


class GenerateRechargePath(FunctionNode):
    """The recharge function: while active, the station is the set-point.

    Args:
        env: the mission's clock.
        sender: the way to the autopilot.
        station_m: the station's place in x and y.
    """

    def __init__(self, env: simpy.Environment, sender: SetPointSender, station_m: tuple[float, float]) -> None:
        super().__init__(env)
        self._sender = sender
        self._station_m = station_m
        self._process: simpy.Process | None = None

    def activated(self) -> None:
        """Set off for the station."""
        self._process = self.env.process(self._go())

    def deactivated(self) -> None:
        """Leave the autopilot to other functions."""
        if self._process is not None:
            self._process.interrupt()
            self._process = None

    def _go(self) -> Process:
        try:
            while True:
                self._sender.send(*self._station_m, SEA_BED_Z_M + ALTITUDE_M)
                yield self.env.timeout(RESEND_PERIOD_S)
        except simpy.Interrupt:
            return
