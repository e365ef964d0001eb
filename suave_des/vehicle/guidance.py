"""Guidance: flies a function's way-points one after the other, without an event for each.

The exemplar's functions check at every tick of a timer whether their way-point is reached; then they send the next one.
Nothing else changes at most ticks, so guidance looks ahead: it queues the next way-points, knows the tick at which each
will be reached, and sets a timer for the tick at which the function has to act. When the vehicle's control changes
earlier, it counts the ticks until then, and plans again from there.
"""

from __future__ import annotations

import math
import random
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, Protocol

from suave_des.compiling import Array
from suave_des.vehicle.vehicle import ArrivalCheck, Vehicle

QUEUED_WAYPOINTS: Final = 20
"""Number of way-points queued in addition to the current one; with 10, missions take 7% more CPU time."""


class OneShotTimer(Protocol):
    """What guidance needs of the mission's clock: a call at a mission time; setting it again replaces the call."""

    @property
    def now_s(self) -> float:
        """Mission time."""

    def set(self, t_s: float) -> None:
        """Make the call at mission time t."""

    def set_now(self) -> None:
        """Make the call when the current event is over, before any other event."""

    def cancel(self) -> None:
        """Drop the pending call."""


class WaypointSource(Protocol):
    """The interface that guidance needs of a function that generates way-points."""

    def tick(self) -> None:
        """React to a timer tick, before guidance does. Does nothing by default."""
        return

    def waypoints(self, count: int) -> Array:
        """Return at most `count` way-points from the current one on, shape (n, >= 3); the first columns are x, y, z.

        None is left when the last one has been reached.
        """

    def completed(self) -> None:
        """React to the end of the way-points. Does nothing by default."""
        return

    def set_point_z_m(self) -> float:
        """Return the z to send, which may differ from the way-point's."""

    def reached(self, count: int) -> None:
        """Advance by `count` way-points, which have been reached, starting with the current one."""

    def not_reached(self) -> None:
        """React to a way-point that was not reached in time, and will be sent again. Does nothing by default."""
        return


@dataclass(eq=False)
class SetPointSender:
    """A node's connection to the autopilot.

    Attributes:
        vehicle: the vehicle whose autopilot receives the set-points.
        now_s: returns the mission time.
        frame_error_m: steady error of the node's frame in x, y and z: the position reached minus the one commanded.
        loss_probability: probability that a message is lost.
        stream: random stream that decides which messages are lost; not needed if none can be.
    """

    vehicle: Vehicle
    now_s: Callable[[], float]
    frame_error_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    loss_probability: float = 0.0
    stream: random.Random | None = None
    _before_loss: int = field(default=0, init=False)  # messages that arrive before the next one that is lost

    def __post_init__(self) -> None:
        self._before_loss = self._draw()

    def send(self, x_m: float, y_m: float, z_m: float) -> None:
        """Send a set-point in the world frame; there is no acknowledgement.

        Raises:
            ValueError: a coordinate is not a finite number.
        """
        if not (math.isfinite(x_m) and math.isfinite(y_m) and math.isfinite(z_m)):
            raise ValueError(f"the set-point ({x_m}, {y_m}, {z_m}) is not finite")
        if not self._is_lost():
            x_error_m, y_error_m, z_error_m = self.frame_error_m
            self.vehicle.command(self.now_s(), x_m + x_error_m, y_m + y_error_m, z_m + z_error_m)

    def queue(
        self, waypoints: Array, z_m: float, check: ArrivalCheck, *, first: int, last: int, send: bool
    ) -> tuple[list[int], int]:
        """Send and queue set-points (see `Vehicle.queue_waypoints`), up to the first whose message will be lost."""
        if self.stream is not None and self.loss_probability > 0.0:
            send = send and not self._is_lost()
            waypoints = waypoints[: 1 + self._before_loss]
        sent_as_m = *self.frame_error_m[:2], z_m + self.frame_error_m[2]
        now_s = self.now_s()
        return self.vehicle.queue_waypoints(now_s, waypoints, sent_as_m, check, first=first, last=last, send=send)

    def queued_were_sent(self, count: int) -> None:
        """Count set-points that were sent from the queue."""
        self._before_loss -= count

    def _is_lost(self) -> bool:
        is_lost = self.stream is not None and self.loss_probability > 0.0 and self._before_loss == 0
        self._before_loss = self._draw() if is_lost else self._before_loss - 1
        return is_lost

    def _draw(self) -> int:
        """Draw the number of messages that arrive before one is lost, from the geometric distribution, by inversion."""
        if self.stream is None or self.loss_probability == 0.0:
            return 0
        return int(math.log(1.0 - self.stream.random()) / math.log(1.0 - self.loss_probability))


@dataclass(eq=False)
class Guidance:
    """Flies the way-points of one function.

    Attributes:
        sender: the connection to the autopilot.
        source: the function.
        make_timer: makes a timer that calls a function.
        make_check: makes the arrival check whose tick 0 is at a mission time.
    """

    sender: SetPointSender
    source: WaypointSource
    make_timer: Callable[[Callable[[], None]], OneShotTimer]
    make_check: Callable[[float], ArrivalCheck]
    _check: ArrivalCheck | None = None  # none before the first tick and after the last
    _sent: int = -1  # tick at which the present way-point was sent last
    _arrivals: list[int] = field(default_factory=list)  # ticks that will find the planned way-points reached
    _act_at: int = 0  # tick that the timer is set to
    _is_planned: bool = False  # until that tick
    _is_due: bool = False  # whether a way-point is to be sent then
    _is_acting: bool = False  # whether a change of control is guidance's own
    _is_repeated: bool = False  # whether the present way-point was sent again

    def __post_init__(self) -> None:
        self._timer = self.make_timer(self._act)
        self._replanning = self.make_timer(self._replan)
        self.sender.vehicle.control_listeners.append(self._control_changed)

    def start_at(self, t_s: float, *, resumes: bool = False) -> None:
        """Start ticking at mission time t, and send the current way-point, unless the last one sent is resumed."""
        self._is_due, self._is_repeated = not resumes, self._is_repeated and resumes
        self._arrivals, self._act_at, self._is_planned = [], 0, False
        if t_s > self._timer.now_s:
            self._timer.set(t_s)
        else:
            self._act()

    def stop(self) -> None:
        """Stop ticking, and cancel the queued way-points."""
        self._timer.cancel()
        self._replanning.cancel()
        self.catch_up()
        check, self._check = self._check, None
        if check is not None:
            self.sender.vehicle.cancel_waypoints(self._timer.now_s, check)
            self._sent -= self._last_tick(check) + 1  # on resumption the first tick is 0 again

    def catch_up(self) -> None:
        """Report to the function which way-points have been reached by now."""
        if self._check is not None:
            self._count_arrivals(self._last_tick(self._check))

    def waypoints_changed(self) -> None:
        """Plan again at the next tick after the function's way-points change (call `catch_up` before they do)."""
        check = self._check
        if check is not None and self._act_at > (tick := self._last_tick(check)):
            self._is_acting = True
            self.sender.vehicle.cancel_waypoints(self._timer.now_s, check)
            self._is_acting = False
            self._replanning.cancel()
            self._arrivals, self._is_planned, self._is_due = [], False, False
            self._set_timer(check, tick + 1)

    def _act(self) -> None:
        """Do what is due at this tick, and plan until the next tick with something to do."""
        check = self._check = self._check or self.make_check(self._timer.now_s)
        tick = self._act_at
        self._count_arrivals(tick)
        self.source.tick()
        while self._check is not None and self._act_at == tick:
            if self._is_planned and not self._is_due:
                self.source.not_reached()
                self._is_due = self._is_repeated = True
            if self._is_due:
                self._sent = tick
            self._plan(check, tick, first=tick + check.first_check_ticks if self._is_due else tick)

    def _plan(self, check: ArrivalCheck, tick: int, first: int) -> None:
        """Send the current way-point if it is due, and look ahead from a tick on."""
        waypoints = self.source.waypoints(1 + QUEUED_WAYPOINTS)
        if len(waypoints) == 0:
            self._check = None
            self.source.completed()
            return
        last = self._sent + (check.resend_again_ticks if self._is_repeated else check.resend_ticks)
        z_m = self.source.set_point_z_m()
        self._is_acting = True
        self._arrivals, act_at = self.sender.queue(waypoints, z_m, check, first=first, last=last, send=self._is_due)
        self._is_acting = False
        self._is_planned = True
        self._is_due = self._arrivals[-1:] == [act_at]
        if act_at > tick:
            self._set_timer(check, act_at)
        else:
            self._act_at = tick
            self._count_arrivals(tick)

    def _control_changed(self, row: int) -> None:
        if self._check is not None and self._is_planned and not self._is_acting:
            self._replanning.set_now()  # whatever else changes control in this event has done so by then

    def _replan(self) -> None:
        check = self._check
        if check is not None and self._act_at > (tick := self._last_tick(check)):
            self._count_arrivals(tick)
            self._is_due = False
            self._plan(check, tick, first=tick + 1)

    def _count_arrivals(self, tick: int) -> None:
        reached = bisect_right(self._arrivals, tick)
        if reached:
            self._sent = self._arrivals[reached - 1]
            del self._arrivals[:reached]
            is_sent_separately = self._is_due and not self._arrivals  # the set-point after the last one planned
            self.sender.queued_were_sent(reached - is_sent_separately)
            self._is_repeated = False
            self.source.reached(reached)

    def _last_tick(self, check: ArrivalCheck) -> int:
        return check.last_tick_until(self._timer.now_s)

    def _set_timer(self, check: ArrivalCheck, tick: int) -> None:
        self._act_at = tick
        self._timer.set(check.time_s(tick))
