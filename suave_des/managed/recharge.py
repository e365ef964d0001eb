"""Generate recharge path (revision 1.5): goes to the recharge station (facts: kas-lab/suave)."""

from dataclasses import dataclass

from suave_des.clock import Process
from suave_des.managed.node import ProcessNode
from suave_des.vehicle.guidance import SetPointSender


@dataclass(eq=False)
class GenerateRechargePath(ProcessNode):
    """The recharge function: while active, the station is the set-point, sent again once a period.

    Attributes:
        station_m: x, y and z of the recharge station.
    """

    sender: SetPointSender
    station_m: tuple[float, float, float]
    resend_period_s: float

    def activity(self) -> Process:
        """Go to the station."""
        while True:
            self.sender.send(*self.station_m)
            yield self.env.timeout(self.resend_period_s)
