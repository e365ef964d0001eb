"""Functions that fly the vehicle along way-points, one after the other, without an event for each.

The exemplar's functions check at every tick of a timer whether their way-point is reached; then
they send the next one. Nothing else changes at most ticks, so a function looks ahead, until control
may change: it queues the next way-points, knows the tick at which each will be reached, and sets an
alarm for the tick at which it has to act. When control or the way-points change earlier, it counts
what has been reached by then, and looks ahead again from the next tick on.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from suave_des.clock import Alarm
from suave_des.compiling import Array
from suave_des.managed.node import FunctionNode, SetPointSender
from suave_des.vehicle.vehicle import ArrivalCheck, Course, Sends

QUEUED_WAYPOINTS: Final = 60
"""Number of way-points queued in addition to the current one; with 30 or 80, some missions take 3%
less, some more.
"""


class Due(Enum):
    """What is done with the current way-point at the next tick at which the function acts."""

    SEND = "it is sent, as it is a new one"
    RESEND = "it is sent again, as it was not reached in time"
    NOTHING = "nothing: it looks ahead anew, or resumes the last way-point"


_NEVER: Final = 10**9  # a tick after every mission's end


@dataclass(eq=False)
class WaypointFunction(FunctionNode):
    """Base of functions that generate way-points, each sent when the one before is reached.

    It ticks from `start_at` until `stop`, or until no way-point is left. Between two ticks at which
    it acts, the vehicle flies through the way-points that were queued.
    """

    sender: SetPointSender
    other: WaypointFunction | None = field(
        default=None, init=False
    )  # that may fly the vehicle at the same time
    _check: ArrivalCheck | None = field(
        default=None, init=False
    )  # None before the first tick and after the last
    _due: Due = field(default=Due.SEND, init=False)
    _act_at: int = field(default=0, init=False)  # the next tick at which it acts
    _sends: Sends = field(default_factory=list, init=False)  # what is queued, and what is due
    _counted: int = field(
        default=0, init=False
    )  # how many way-points of the last look ahead have been reached
    _resend_at: int = field(
        default=0, init=False
    )  # tick that sends the current way-point again if it is not reached
    _changed_from: int = field(
        default=0, init=False
    )  # first tick after a change of way-points, or _NEVER

    def __post_init__(self) -> None:
        self._alarm = Alarm(self.env, self._act)
        self.sender.vehicle.control_listeners.append(self._control_changed)

    # What a function says of its way-points.

    def arrival_check(self, start_s: float) -> ArrivalCheck:
        """Return when and where a way-point counts as reached, with tick 0 at a mission time."""
        raise NotImplementedError

    def waypoints(self, count: int) -> Array:
        """Return at most `count` way-points from the current one on, shape (n, >= 3); the first
        columns are x, y, z.

        None is left when the last one has been reached.
        """
        raise NotImplementedError

    def set_point_z_m(self) -> float:
        """Return the z to send, which may differ from the way-point's."""
        raise NotImplementedError

    def ticked(self) -> None:
        """React to the first tick, and to the first after a change of way-points; others may be
        reported, too.
        """

    def reached(self, count: int) -> None:
        """Advance by `count` way-points, which have been reached, starting with the current one."""

    def not_reached(self) -> None:
        """React to a way-point that was not reached in time, and will be sent again."""

    def completed(self) -> None:
        """React to the end of the way-points."""

    # How they are flown.

    def start_at(self, t_s: float, *, resumes: bool = False) -> None:
        """Start ticking at mission time t, and send the current way-point, unless the last one sent
        is resumed.
        """
        self._due, self._sends = Due.NOTHING if resumes else Due.SEND, []
        self._act_at = self._changed_from = 0
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
            self._resend_at -= (
                check.last_tick_until(self.env.now) + 1
            )  # on resumption the first tick is 0 again
            self.sender.vehicle.cancel_waypoints(self.env.now)

    def catch_up(self) -> None:
        """Count the way-points that have been reached by now; what is due at this very time comes
        first.
        """
        if self._check is not None:
            tick = self._check.last_tick_until(self.env.now)
            if self._act_at <= tick:
                self._act()
            self._count_arrivals(tick)

    def waypoints_changed(self) -> None:
        """Look ahead again after the way-points change (call `catch_up` before they do)."""
        if self._check is not None:
            self._changed_from = self._check.last_tick_until(self.env.now) + 1
            self.sender.vehicle.cancel_waypoints(self.env.now)

    def _control_changed(self) -> None:
        """Look ahead again, from the next tick on, after a change of control that was not
        queued.
        """
        self.catch_up()
        if (check := self._check) is not None:
            tick, self._due = check.last_tick_until(self.env.now), Due.NOTHING
            self._look_ahead(check, tick, tick + 1)

    def _act(self) -> None:
        """Do what is due at this tick, and look ahead to the next tick at which something is."""
        check = self._check = self._check or self.arrival_check(self.env.now)
        tick = self._act_at
        while self._check is not None and self._act_at == tick:
            self._count_arrivals(tick)
            if self._due is Due.SEND:
                self._resend_at = tick + check.resend_ticks
            elif self._due is Due.RESEND:
                self.not_reached()
                self._resend_at = tick + check.resend_again_ticks
            self._look_ahead(
                check, tick, tick + check.first_check_ticks * (self._due is not Due.NOTHING)
            )

    def _look_ahead(self, check: ArrivalCheck, tick: int, first: int) -> None:
        """Queue way-points, the current one included if it is due, and see when something has to be
        done next.

        The other function, if it ticks too, is looked ahead for at the same time, unless it acts at
        this very time.
        """
        waypoints, vehicle, now_s = (
            self.waypoints(1 + QUEUED_WAYPOINTS),
            self.sender.vehicle,
            self.env.now,
        )
        if len(waypoints) == 0:
            self._check = None
            self._alarm.cancel()
            self.completed()
            vehicle.cancel_waypoints(now_s)
            return
        flying, further = [self], []
        until_s = min(
            [
                vehicle.duration_s,
                *[t_s for t_s in vehicle.expected_changes_s.values() if t_s > now_s],
            ]
        )
        send = self._due is not Due.NOTHING and not self.sender.is_lost()
        if (other := self.other) is not None and (others := other._check) is not None:
            past = others.last_tick_until(now_s)
            if other._act_at <= past:
                until_s = now_s
            else:
                other.catch_up()
                flying.append(other)
                further.append(
                    other._course(others, other.waypoints(1 + QUEUED_WAYPOINTS), past + 1, _NEVER)
                )
        until = max(tick, check.last_tick_until(until_s))
        course = self._course(check, waypoints, first, until)
        sends, is_due = vehicle.queue_waypoints(now_s, [course, *further], until_s, send=send)
        for place, each in enumerate(flying):
            each._sends = [sent for sent in sends if sent[1] == place] if further else sends
            each._counted, each._due, each._act_at = 0, Due.NOTHING, _NEVER
            each._alarm.cancel()
        if is_due:
            acts = flying[sends[-1][1]]
            last, *before = reversed(acts._sends[-2:])
            acts._due = Due.SEND if last[2] > (before[0][2] if before else 0) else Due.RESEND
            acts._set_alarm(course.check if acts is self else further[0].check, last[0])
        else:
            self._set_alarm(check, until + 1)

    def _course(self, check: ArrivalCheck, waypoints: Array, first: int, until: int) -> Course:
        ticks = first, self._resend_at, until
        return self.sender.course(waypoints, self.set_point_z_m(), check, ticks, QUEUED_WAYPOINTS)

    def _count_arrivals(self, tick: int) -> None:
        if tick >= self._changed_from:
            self._changed_from = _NEVER
            self.ticked()
        if past := bisect_right(self._sends, [tick + 1]):
            _, _, reached, self._resend_at = self._sends[past - 1]
            del self._sends[:past]
            is_left = (
                self._due is not Due.NOTHING and not self._sends
            )  # the last one, which the function sends
            self.sender.queued_were_sent(past - is_left)
            if reached > self._counted:
                self.reached(reached - self._counted)
                self._counted = reached

    def _set_alarm(self, check: ArrivalCheck, tick: int) -> None:
        self._act_at = tick
        self._alarm.set(check.time_s(tick))
