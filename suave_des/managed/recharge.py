"""Generate recharge path (revision 1.5): goes to the recharge station (facts: kas-lab/suave)."""

from dataclasses import dataclass, field

import simpy

from suave_des.clock import Process
from suave_des.domain import SEA_BED_Z_M
from suave_des.managed.node import FunctionNode
from suave_des.vehicle.guidance import SetPointSender

ALTITUDE_M = 1.25
RESEND_PERIOD_S = 10.0


@dataclass(eq=False)
class GenerateRechargePath(FunctionNode):
    """The recharge function: while active, the station, at x and y in m, is the set-point."""

    sender: SetPointSender
    station_m: tuple[float, float]
    _going: simpy.Process | None = field(default=None, init=False)

    def activated(self) -> None:
        """Set off for the station."""
        self._going = self.env.process(self._go())

    def deactivated(self) -> None:
        """Leave the autopilot to other functions."""
        if self._going is not None:
            self._going.interrupt()

    def _go(self) -> Process:
        try:
            while True:
                self.sender.send(*self.station_m, SEA_BED_Z_M + ALTITUDE_M)
                yield self.env.timeout(RESEND_PERIOD_S)
        except simpy.Interrupt:
            return
