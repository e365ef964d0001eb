"""Functions that send the vehicle to one place: the recharge station (revision 1.5), and the
surface after a leak.

Source of the first: node recharge_battery of kas-lab/suave 1.5.0; the exemplar has no leak.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import simpy

from suave_des.clock import Process, tick_at_or_after, until
from suave_des.domain import SEA_BED_Z_M, SURFACE_Z_M
from suave_des.managed.node import ProcessNode, SetPointSender
from suave_des.monitor.measurements import BatteryMeasurements
from suave_des.scenario.models import Battery

ABOVE_M = 3.0
"""Height of the set-point above the surface: an autopilot that stops short of it still surfaces."""
SURFACED_M = 0.1
CHECKS_A_SECOND, RESEND_CHECKS = 2, 20


@dataclass(eq=False)
class GenerateRechargePath(ProcessNode):
    """The recharge function: at each tick while active a docked vehicle is recharged, and the
    station is sent.

    Attributes:
        station, level: where the station is, and how often docking is checked; the battery's level.
    """

    sender: SetPointSender
    station: Battery
    level: BatteryMeasurements
    phase_s: float

    def activity(self) -> Process:
        """Go to the station, and recharge there."""
        station, z_m = self.station, SEA_BED_Z_M + self.station.approach_altitude_m
        yield until(
            self.env, tick_at_or_after(self.env.now, self.phase_s, station.docking_check_period_s)
        )
        while True:
            x_m, y_m, _ = self.sender.vehicle.position(self.env.now)
            if (
                max(abs(x_m - station.station_x_m), abs(y_m - station.station_y_m))
                <= station.station_radius_m
            ):
                self.level.recharge(self.env.now)
            self.sender.send(station.station_x_m, station.station_y_m, z_m)
            yield self.env.timeout(station.docking_check_period_s)


@dataclass(eq=False)
class Surface(ProcessNode):
    """The surface function: while active, the set-point is above the place of activation, sent
    again every 10 s.

    Attributes:
        surfaced: triggered when the vehicle is at the surface, which is checked twice a second.
        surfaced_s: mission time of that; None before.
    """

    sender: SetPointSender
    surfaced_s: float | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self.surfaced: simpy.Event = self.env.event()

    def activity(self) -> Process:
        """Ascend until the vehicle is at the surface."""
        x_m, y_m, _ = self.sender.vehicle.position(self.env.now)
        while True:
            self.sender.send(x_m, y_m, SURFACE_Z_M + ABOVE_M)
            for _ in range(RESEND_CHECKS):
                if self.sender.vehicle.position(self.env.now)[2] >= SURFACE_Z_M - SURFACED_M:
                    self.surfaced_s = float(self.env.now)
                    self.surfaced.succeed()
                    return
                yield self.env.timeout(1.0 / CHECKS_A_SECOND)
