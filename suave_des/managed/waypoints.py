"""What functions that fly the vehicle along way-points have in common: a timer, and a connection to
the autopilot.

At each tick of its timer such a function looks whether its way-point is reached, as the exemplar's
nodes do; its module has the compiled function that does that. No event is needed for it: see
`flight`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

from suave_des.clock import MissionEnvironment
from suave_des.compiling import Record, compiled, record
from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.vehicle.kernel import VehicleRecord


class Does(IntEnum):
    """What a function does at a tick."""

    NOTHING = 0
    SENDS = 1  # its way-point
    FINISHES = 2  # at its last way-point


@record
class Timer(Record):
    """A function's timer, and its connection to the autopilot."""

    is_active: bool
    start_s: float  # mission time of tick 0
    period_s: float
    tick: int  # the next one
    is_due: bool  # whether the way-point is sent at the next tick in any case
    waited: int  # ticks since it was sent, as the node counts them
    frame_x_m: float  # where the vehicle goes minus where it is sent
    frame_y_m: float
    frame_z_m: float
    altitude_error_m: float
    messages_before_loss: float  # that arrive before one is lost


@compiled
def next_tick_s(timer: Timer) -> float:
    """Return the mission time of the next tick; inf if there is none."""
    if not timer.is_active:
        return math.inf
    return timer.start_s + timer.tick * timer.period_s


@compiled
def send(timer: Timer, vehicle: VehicleRecord, x_m: float, y_m: float, z_m: float) -> bool:
    """Give the autopilot a set-point, in the function's frame; return whether it arrives."""
    if timer.messages_before_loss == 0.0:
        return False
    timer.messages_before_loss -= 1.0
    vehicle.set_point_x_m = x_m + timer.frame_x_m
    vehicle.set_point_y_m = y_m + timer.frame_y_m
    vehicle.set_point_z_m = z_m + timer.frame_z_m + timer.altitude_error_m
    vehicle.set_point_number += 1
    return True


@dataclass(eq=False)
class WaypointFunction(FunctionNode):
    """Base of functions that generate way-points, each sent when the one before is reached.

    Attributes:
        env: the clock, which has the vehicle flown, with the function's ticks.
        sender: the connection to the autopilot; `timer` has a copy for the flight.
    """

    env: MissionEnvironment
    sender: SetPointSender

    def connect(self, timer: Timer, period_s: float) -> None:
        """Set up the timer."""
        self.timer, sender = timer, self.sender
        timer.period_s = period_s
        timer.frame_x_m, timer.frame_y_m, timer.frame_z_m = sender.frame_error_m
        timer.altitude_error_m = sender.vehicle.altitude_error_m
        timer.messages_before_loss = sender.messages_before_loss

    def start_at(self, t_s: float, *, resumes: bool = False) -> None:
        """Start ticking at mission time t, and send the current way-point, unless the last one sent
        is resumed.
        """
        timer, now_s = self.timer, self.env.now
        timer.is_active, timer.is_due, timer.tick = True, not resumes, 0
        timer.start_s = now_s + (t_s - now_s) if t_s > now_s else now_s
        self.env.fly_to(now_s)  # a tick that is due now comes at once

    def stop(self) -> None:
        """Stop ticking; a tick at this very time came before."""
        self.timer.is_active = False

    def message_lost(self) -> None:
        """Draw when the next message is lost."""
        self.timer.messages_before_loss = self.sender.draw_messages_before_loss()
