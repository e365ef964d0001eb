"""When a manager's `adapt` is called, and how a call goes on that takes mission time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf

import simpy

from suave_des.clock import Alarm, summed_tick
from suave_des.errors import SuaveDesError
from suave_des.managing.base import AdaptationProcess
from suave_des.monitor.measurements import Measurements, Thresholds

RAISED = (Exception, SystemExit)
"""Exceptions of a manager: sys.exit must neither end a campaign, nor end a mission without an
error.
"""
_MAX_YIELDS_AT_ONE_TIME = 10_000
"""How often `adapt` may yield while mission time stands still."""
_ROUNDING_S = 1e-9

_DependsOn = Sequence[tuple[Measurements, Thresholds]]
"""Measurements, with the thresholds between which their regions lie."""
_Regions = tuple[int, ...]
"""The region in which each measured value is."""


class CallTimes:
    """Calls a manager at its times, once a period; none while a call is under way.

    Args:
        call: the call.
        times: the manager's period and its first time, s.
    """

    def __init__(
        self, env: simpy.Environment, call: Callable[[], None], times: tuple[float, float]
    ) -> None:
        self._env = env
        self.period_s, first_s = times
        self._next_s = first_s  # the first of its times after the last call
        self._alarm = Alarm(env, call)
        self._alarm.set(first_s)

    def go_on(self, changed: bool, may_sleep: bool) -> None:
        """Plan the next call when one is over.

        Args:
            changed: whether the call has changed anything; this, and the next, make a difference
                to event-triggered managers only.
            may_sleep: whether another one right now would change nothing.
        """
        self._pass(self._env.now)
        self._alarm.set(self._next_s)

    def _pass(self, t_s: float) -> None:
        """Let the next time be the first one after t."""
        while self._next_s <= t_s:
            self._next_s += self.period_s

    def wake(self) -> None:
        """Note that the manager's state has changed, which changes none of its times."""

    def close(self) -> None:
        """Call no more."""
        self._alarm.cancel()
        del self._alarm


class EventTriggeredTimes(CallTimes):
    """Calls an event-triggered manager only at those of its times at which something may be
    different.

    After a call that changed nothing, the manager sleeps. It wakes when its state changes, and at
    the first of its times at which the measured values are in regions (between which thresholds
    each of them is) in which it has not been called since the last change, or in which they will
    not stay until the call has read them.

    Its calls come after all else of their time: a call that was planned long before finds what one
    finds that was planned a period before.

    Args:
        depends_on: the measurements that the manager depends on, with its thresholds; None: no
            call is left out in this mission.
        reads_for_s: returns for how long a call that began now would read values.
    """

    def __init__(
        self,
        env: simpy.Environment,
        call: Callable[[], None],
        times: tuple[float, float],
        depends_on: _DependsOn | None,
        reads_for_s: Callable[[], float],
    ) -> None:
        super().__init__(env, self._ring, times)
        self._call = call
        self._depends_on = depends_on
        self._reads_for_s = reads_for_s
        self._sleeps = False
        # Regions in which a call has changed nothing, and for how long one in them reads values.
        self._idle: dict[_Regions, float] = {}

    def _ring(self) -> None:
        self._sleeps = False
        self._call()

    def wake(self) -> None:
        """Note that the manager's state has changed; if it sleeps, it is called at its next time."""
        self._idle.clear()
        if self._sleeps:
            self._sleeps = False
            self._alarm.set(summed_tick(self._env.now, self._next_s, self.period_s), last=True)

    def go_on(self, changed: bool, may_sleep: bool) -> None:
        """Plan the next call when one is over."""
        now_s = self._env.now
        self._pass(now_s)
        if changed:
            self._idle.clear()
        reads_for_s = self._reads_for_s()
        # In the first period now + (t - now) may miss the next time t by rounding, and by another
        # amount if the call is set anew when the manager wakes. Later t is at most 2 now, so that
        # nothing is lost.
        is_exact = now_s >= self.period_s
        # A call that takes a period or more is followed by another one later than others are.
        is_short = reads_for_s < self.period_s - _ROUNDING_S
        depends_on = self._depends_on
        if depends_on is not None and may_sleep and is_exact and is_short:
            regions, until_s = _regions_at(depends_on, now_s)
            self._idle[regions] = reads_for_s
            if self._is_foreseen(depends_on):
                self._sleeps = True
                call_s = self._next_needed_s(depends_on, regions, until_s)
                if call_s < inf:
                    self._alarm.set(call_s, exactly=True, last=True)
                return
        self._alarm.set(self._next_s, last=True)

    def _is_foreseen(self, depends_on: _DependsOn) -> bool:
        """Whether the tables have all that a left-out call would read: either nothing can be
        recharged, or no call reads values after its beginning.
        """
        reads_later = any(self._idle.values())
        return not reads_later or not any(each.may_change for each, _ in depends_on)

    def _next_needed_s(self, depends_on: _DependsOn, regions: _Regions, until_s: float) -> float:
        """Find the first of the manager's times at which a call may change something; inf: there is
        none.

        Args:
            regions: those of now, in which a call changes nothing.
            until_s: until when the values stay in them.
        """
        earliest_s = self._next_s
        while until_s < inf:
            # An earlier call would have read all that it reads before the values leave them.
            read_from_s = until_s - self._idle[regions] - _ROUNDING_S
            call_s = summed_tick(read_from_s, earliest_s, self.period_s)
            regions, until_s = _regions_at(depends_on, call_s)
            reads_for_s = self._idle.get(regions)
            if reads_for_s is None or until_s <= call_s + reads_for_s:
                return call_s
            earliest_s = call_s + self.period_s
        return inf

    def close(self) -> None:
        """Call no more."""
        super().close()
        self._sleeps = False
        del self._call, self._reads_for_s


def _regions_at(depends_on: _DependsOn, t_s: float) -> tuple[_Regions, float]:
    """Find the regions of measured values at mission time t, and until when they stay the same."""
    regions, until_s = [], inf
    for measured, thresholds in depends_on:
        region, ends_s = measured.region_until(t_s, thresholds)
        regions.append(region)
        until_s = min(until_s, ends_s)
    return tuple(regions), until_s


class AdaptationCall:
    """A call of `adapt` that takes mission time: it goes on at each event that it yields.

    A SimPy process would do the same with two events more.

    Args:
        steps: what `adapt` returned.
        over: called with its result.
        error_of: makes the error that ends the mission from one that `adapt` raised.
    """

    def __init__(
        self,
        env: simpy.Environment,
        steps: AdaptationProcess,
        over: Callable[[object], None],
        error_of: Callable[[BaseException], SuaveDesError],
    ) -> None:
        self._env, self._steps, self._over, self._error_of = env, steps, over, error_of
        self._yields, self._since_s = 0, env.now

    def resume(self, event: simpy.Event | None = None) -> None:
        """Go on after an event has happened, or begin."""
        while event is None or event.callbacks is None:  # it need not be waited for
            try:
                event = self._next(event)
            except StopIteration as end:
                self._over(end.value)
                return
            except RAISED as error:
                raise self._error_of(error) from error
        event.callbacks.append(self.resume)

    def _next(self, event: simpy.Event | None) -> simpy.Event:
        if self._env.now > self._since_s:
            self._yields, self._since_s = 0, self._env.now
        self._yields += 1
        if self._yields > _MAX_YIELDS_AT_ONE_TIME:
            raise RuntimeError(
                f"adapt yielded {_MAX_YIELDS_AT_ONE_TIME} events, and no mission time passed"
            )
        if event is None:
            found = next(self._steps)
        elif event.ok:
            found = self._steps.send(event.value)
        else:  # which `adapt` may handle
            event.defused = True
            assert isinstance(event.value, BaseException)
            found = self._steps.throw(event.value)
        if not isinstance(found, simpy.Event):
            raise TypeError(
                f"adapt yielded {found!r}; it may yield events, such as system.env.timeout(1.0)"
            )
        return found
