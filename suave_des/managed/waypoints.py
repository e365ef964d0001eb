"""Functions that fly the vehicle along way-points, one after the other, without an event for each.

The exemplar's functions check at every tick of a timer whether their way-point is reached; then they send the next one.
Nothing else changes at most ticks, so a function looks ahead: it queues the next way-points, knows the tick at which
each will be reached, and sets an alarm for the tick at which it has to act. When control or the way-points change
earlier, it counts what has been reached by then, and looks ahead again at the next tick.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from suave_des.clock import Alarm
from suave_des.compiling import Array
from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.vehicle.vehicle import STEP_S, ArrivalCheck, Sends

QUEUED_WAYPOINTS: Final = 20
"""Number of way-points queued in addition to the current one; with 10, missions take 7% more CPU time."""


class Due(Enum):
    """What is done with the current way-point at the next tick at which the function acts."""

    SEND = "it is sent, as it is a new one"
    RESEND = "it is sent again, as it was not reached in time"
    LOOK = "nothing is sent, but looked ahead: the way-points have changed, or the last one is resumed"
    LOOK_ON = "nothing is sent, but looked ahead from the next tick on"


_SENDS: Final = (Due.SEND, Due.RESEND)


@dataclass(eq=False)
class WaypointFunction(FunctionNode):
    """Base of functions that generate way-points, each sent when the one before is reached.

    It ticks from `start_at` until `stop`, or until no way-point is left. Between two ticks at which it acts, the
    vehicle flies through the way-points that were queued.
    """

    sender: SetPointSender
    other: WaypointFunction | None = field(default=None, init=False)  # that may fly the vehicle at the same time
    _check: ArrivalCheck | None = field(default=None, init=False)  # None before the first tick and after the last
    _due: Due = field(default=Due.SEND, init=False)
    _act_at: int = field(default=0, init=False)  # the next tick at which it acts
    _sends: Sends = field(default_factory=list, init=False)  # what is queued, and what is due
    _counted: int = field(default=0, init=False)  # how many way-points of the last look ahead have been reached
    _resend_at: int = field(default=0, init=False)  # tick that sends the current way-point again if it is not reached

    def __post_init__(self) -> None:
        self._alarm = Alarm(self.env, self._act)
        self.sender.vehicle.control_listeners.append(self._control_changed)

    # What a function says of its way-points.

    def arrival_check(self, start_s: float) -> ArrivalCheck:
        """Return when and where a way-point counts as reached, with tick 0 at a mission time."""
        raise NotImplementedError

    def waypoints(self, count: int) -> Array:
        """Return at most `count` way-points from the current one on, shape (n, >= 3); the first columns are x, y, z.

        None is left when the last one has been reached.
        """
        raise NotImplementedError

    def set_point_z_m(self) -> float:
        """Return the z to send, which may differ from the way-point's."""
        raise NotImplementedError

    def reached(self, count: int) -> None:
        """Advance by `count` way-points, which have been reached, starting with the current one."""

    def not_reached(self) -> None:
        """React to a way-point that was not reached in time, and will be sent again."""

    def completed(self) -> None:
        """React to the end of the way-points."""

    # How they are flown.

    def start_at(self, t_s: float, *, resumes: bool = False) -> None:
        """Start ticking at mission time t, and send the current way-point, unless the last one sent is resumed."""
        self._due, self._sends, self._act_at = Due.LOOK if resumes else Due.SEND, [], 0
        if t_s > self.env.now:
            self._alarm.set(t_s)
        else:
            self._act()

    def stop(self) -> None:
        """Stop ticking, and cancel the queued way-points."""
        self.catch_up()
        self._alarm.cancel()
        check, self._check = self._check, None
        if check is not None:
            self.sender.vehicle.cancel_waypoints(self.env.now, check)
            self._resend_at -= check.last_tick_until(self.env.now) + 1  # on resumption the first tick is 0 again

    def catch_up(self) -> None:
        """Count the way-points that have been reached by now."""
        if self._check is not None:
            self._count_arrivals(self._check.last_tick_until(self.env.now))

    def waypoints_changed(self) -> None:
        """Look ahead again at the next tick after the way-points change (call `catch_up` before they do)."""
        check = self._check
        if check is not None and self._act_at > (tick := check.last_tick_until(self.env.now)):
            self.sender.vehicle.cancel_waypoints(self.env.now, check)
            self._sends, self._due = [], Due.LOOK
            self._set_alarm(check, tick + 1)

    def _control_changed(self, row: int, sent_with: ArrivalCheck | None) -> None:
        """Look ahead again after somebody else changes control, which has cancelled queued way-points."""
        check = self._check
        if check is None or check is sent_with or self._due is Due.LOOK:
            return
        self.catch_up()
        tick = check.last_tick_until(self.env.now)
        if sent_with is None:
            self.waypoints_changed()
        elif self._act_at > tick:
            self._due = Due.LOOK_ON
            self._look_ahead(check, tick, most=0)  # the other one is not done yet

    def _act(self) -> None:
        """Do what is due at this tick, and look ahead to the next tick at which something is."""
        check = self._check = self._check or self.arrival_check(self.env.now)
        tick = self._act_at
        self._count_arrivals(tick)
        while self._check is not None and self._act_at == tick:
            if self._due is Due.SEND:
                self._resend_at = tick + check.resend_ticks
            elif self._due is Due.RESEND:
                self.not_reached()
                self._resend_at = tick + check.resend_again_ticks
            self._look_ahead(check, tick)

    def _look_ahead(self, check: ArrivalCheck, tick: int, most: int = QUEUED_WAYPOINTS) -> None:
        """Queue the way-points, the current one included if it is due, and see when they will be reached."""
        waypoints = self.waypoints(1 + most)
        if len(waypoints) == 0:
            self._check = None
            self.completed()
            return
        send, until = self._due in _SENDS, self._undisturbed_until(check)
        first = tick + (check.first_check_ticks if send else self._due is Due.LOOK_ON)
        ticks, z_m = (first, self._resend_at, until), self.set_point_z_m()
        self._sends, is_due = self.sender.queue(waypoints, z_m, check, ticks, most=most, send=send)
        self._counted, self._due, act_at = 0, Due.LOOK_ON, until
        if is_due:
            *before, (act_at, reached, _) = self._sends
            self._due = Due.SEND if reached > (before[-1][1] if before else 0) else Due.RESEND
        if act_at > tick:
            self._set_alarm(check, act_at)
        else:
            self._act_at = tick
            self._count_arrivals(tick)

    def _undisturbed_until(self, check: ArrivalCheck) -> int:
        """Find the tick up to which it is worth looking ahead: then the other function sends a set-point of its own."""
        other = self.other
        if other is None or other._check is None:
            return 10**9  # a tick after every mission's end
        other.catch_up()
        until_s = max(self.env.now, other._check.time_s(other._resend_at))
        if self._due not in _SENDS:  # else the track changes from now on
            until_s = max(until_s, self.sender.vehicle.computed_row * STEP_S)
        return check.last_tick_until(until_s) + 1

    def _count_arrivals(self, tick: int) -> None:
        if past := bisect_right(self._sends, [tick + 1]):
            _, reached, self._resend_at = self._sends[past - 1]
            del self._sends[:past]
            is_sent_separately = self._due in _SENDS and not self._sends  # the last one is left to the function
            self.sender.queued_were_sent(past - is_sent_separately)
            if reached > self._counted:
                self.reached(reached - self._counted)
                self._counted = reached

    def _set_alarm(self, check: ArrivalCheck, tick: int) -> None:
        self._act_at = tick
        self._alarm.set(check.time_s(tick))
