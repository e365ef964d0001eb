"""Surface: goes straight up, as required after a leak."""

from dataclasses import dataclass

import simpy

from suave_des.clock import Process
from suave_des.domain import SURFACE_Z_M
from suave_des.managed.node import ProcessNode
from suave_des.vehicle.guidance import SetPointSender

ABOVE_M = 3.0
"""Height of the set-point above the surface: an autopilot that stops short of it still surfaces."""
SURFACED_M = 0.1
CHECKS_A_SECOND = 2
RESEND_CHECKS = 20


@dataclass(eq=False)
class Surface(ProcessNode):
    """The surface function: while active, the set-point is above the place of activation, sent again every 10 s.

    Attributes:
        surfaced: triggered when the vehicle is at the surface, which is checked twice a second.
    """

    sender: SetPointSender

    def __post_init__(self) -> None:
        self.surfaced: simpy.Event = self.env.event()

    def activity(self) -> Process:
        """Ascend until the vehicle is at the surface."""
        x_m, y_m, _ = self.sender.vehicle.position(self.env.now)
        while True:
            self.sender.send(x_m, y_m, SURFACE_Z_M + ABOVE_M)
            for _ in range(RESEND_CHECKS):
                if self.sender.vehicle.position(self.env.now)[2] >= SURFACE_Z_M - SURFACED_M:
                    self.surfaced.succeed()
                    return
                yield self.env.timeout(1.0 / CHECKS_A_SECOND)
