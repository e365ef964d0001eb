"""Additions to SimPy: an environment that flies the vehicle from event to event, ticks of a periodic
timer, events at a mission time, calls at one, alarms.

Activities are SimPy processes. A call that is often put off is an alarm. This module alone uses
SimPy's private fields.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from heapq import heappush
from typing import Any

import simpy
from simpy.core import StopSimulation

Process = Generator[simpy.Event, Any, None]


_process_next = simpy.Environment.step
_NEVER_S = math.inf


class MissionEnvironment(simpy.Environment):
    """A SimPy environment that has the vehicle flown to each event before the event is processed.

    So whatever happens at an event finds the vehicle where it is then. Control changes only at
    events: what is flown is final.

    Attributes:
        fly_to: flies to a mission time; it may add events up to then.
    """

    def __init__(self) -> None:
        super().__init__(0.0)
        self.fly_to: Callable[[float], None] = _stay

    def step(self) -> None:
        """Fly to the next event, and process it, or one that the flight has brought about."""
        queue = self._queue
        if queue:
            next_s = queue[0][0]
            if self._now < next_s < _NEVER_S:
                self.fly_to(next_s)
        _process_next(self)

    def schedule(
        self,
        event: simpy.Event,
        priority: simpy.events.EventPriority = simpy.events.NORMAL,
        delay: float = 0,
    ) -> None:
        """Schedule an event.

        Raises:
            ValueError: the delay is not a number, which would spoil the order of all other events.
        """
        if delay != delay:
            raise ValueError(f"the delay of an event is {delay}")
        heappush(self._queue, (self._now + delay, priority, next(self._eid), event))

    def advance(self, t_s: float) -> None:
        """Process all events before mission time t, and go there; stop at the event of the
        mission's end.
        """
        queue = self._queue
        try:
            while True:
                while queue and queue[0][0] < t_s:
                    self.step()
                self.fly_to(t_s)  # which may add an event before then
                if not queue or queue[0][0] >= t_s:
                    break
        except StopSimulation:
            return
        self._now = t_s


def tick_at_or_after(t_s: float, phase_s: float, period_s: float) -> float:
    """First tick of a timer (phase, phase + period, ...) that is not before t; a rounding error
    counts as on time.
    """
    return phase_s + max(0, math.ceil((t_s - phase_s) / period_s - 1e-9)) * period_s


def summed_tick(t_s: float, due_s: float, period_s: float) -> float:
    """First of due, due + period, ... that is not before t, with the rounding errors of a sum."""
    while due_s < t_s:
        due_s += period_s
    return due_s


_LAST = simpy.events.EventPriority(2)
"""Priority of what comes after all else of its time; SimPy's are 0 and 1."""


def exactly_at(
    env: simpy.Environment, t_s: float, priority: simpy.events.EventPriority = simpy.events.NORMAL
) -> simpy.Event:
    """An event at mission time t itself; a delay added to the current time may miss it by
    rounding.

    Raises:
        ValueError: that is not a number, which would spoil the order of all other events.
    """
    event = simpy.Event(env)
    event._ok = True
    event._value = None
    _put(env, event, t_s, priority)
    return event


def _put(
    env: simpy.Environment,
    event: simpy.Event,
    t_s: float,
    priority: simpy.events.EventPriority,
) -> None:
    if t_s != t_s:
        raise ValueError(f"the time of an event is {t_s}")
    heappush(env._queue, (t_s, priority, next(env._eid), event))


def until(env: simpy.Environment, t_s: float) -> simpy.Event:
    """An event at mission time t, or now if t has passed: as `env.timeout` makes it, twice as fast."""
    return exactly_at(env, _reached(env, t_s))


def _reached(env: simpy.Environment, t_s: float) -> float:
    """Return when `env.timeout` would reach mission time t, which is now if t has passed."""
    now_s = env._now
    delay_s = t_s - now_s
    return now_s if delay_s <= 0.0 else now_s + delay_s


def call_at(env: simpy.Environment, t_s: float, callback: Callable[[], Any]) -> None:
    """Call a function at mission time t, or as the next thing now if t has passed."""
    until(env, t_s).callbacks.append(lambda _: callback())


def call_next(env: simpy.Environment, callback: Callable[[], None]) -> None:
    """Call a function when the current event is over and before any other, as SimPy does with
    interrupts.
    """
    event = simpy.Event(env)
    event.callbacks.append(lambda _: callback())
    event._ok = True
    event._value = None
    env.schedule(event, simpy.events.URGENT)


def abandon(process: simpy.Process) -> None:
    """End a process where it waits, so that it lets go of all that it refers to."""
    process._generator.close()


def stop_at(event: simpy.Event) -> None:
    """End the simulation at an event, whether it runs by `advance` or by itself."""
    event.callbacks.append(StopSimulation.callback)


def drop_events(env: MissionEnvironment) -> None:
    """Drop all that is still to happen, and fly no more."""
    env._queue.clear()
    env.fly_to = _stay


def _stay(t_s: float) -> None:
    """Fly nowhere."""


class Alarm:
    """Calls a function at a mission time; setting it again replaces the pending call.

    Example:
        >>> alarm = Alarm(env, lambda: print(env.now))
        >>> alarm.set(4.0)
        >>> alarm.set(6.0)
        >>> env.run()
        6.0
    """

    def __init__(self, env: simpy.Environment, callback: Callable[[], None]) -> None:
        self._env = env
        self._callback = callback
        self._pending: simpy.Event | None = None
        # An event that has happened is used again: to make another one each time would take a
        # quarter longer from setting the alarm to the end of its call.
        self._over: simpy.Event | None = None

    def set(self, t_s: float, *, exactly: bool = False, last: bool = False) -> None:
        """Call the function at mission time t, or as the next thing now if t has passed.

        Args:
            t_s: the time.
            exactly: see `exactly_at`.
            last: whether the call comes after all else that happens at that time, whenever it was
                planned.

        Raises:
            ValueError: the time is not a number.
        """
        due_s = t_s if exactly else _reached(self._env, t_s)
        priority = _LAST if last else simpy.events.NORMAL
        event = self._over
        if event is None:
            event = exactly_at(self._env, due_s, priority)
        else:
            event.callbacks = []
            self._over = None
            _put(self._env, event, due_s, priority)
        event.callbacks.append(self._ring)
        self._pending = event

    def cancel(self) -> None:
        """Drop the pending call."""
        self._pending = None

    def _ring(self, event: simpy.Event) -> None:
        self._over = event
        if event is self._pending:
            self._pending = None
            self._callback()
