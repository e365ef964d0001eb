"""Generate recharge path (revision 1.5): goes to the recharge station (facts: kas-lab/suave)."""

from dataclasses import dataclass, field

import simpy

from suave_des.clock import Process
from suave_des.managed.node import FunctionNode
from suave_des.vehicle.guidance import SetPointSender


@dataclass(eq=False)
class GenerateRechargePath(FunctionNode):
    """The recharge function: while active, the station is the set-point, sent again once a period.

    Attributes:
        station_m: x, y and z of the recharge station.
    """

    sender: SetPointSender
    station_m: tuple[float, float, float]
    resend_period_s: float
    _process: simpy.Process | None = field(default=None, init=False)

    def activated(self) -> None:
        """Start for the station."""
        self._process = self.env.process(self._go_to_station())

    def deactivated(self) -> None:
        """Leave the autopilot to other functions."""
        if self._process is not None:
            self._process.interrupt()

    def _go_to_station(self) -> Process:
        try:
            while True:
                self.sender.send(*self.station_m)
                yield self.env.timeout(self.resend_period_s)
        except simpy.Interrupt:
            return
