"""Small additions to SimPy's clock: ticks of a periodic timer, events at a given mission time, and callbacks."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import Any

import simpy

Process = Generator[simpy.Event, None, None]


def tick_at_or_after(t_s: float, phase_s: float, period_s: float) -> float:
    """First tick of a timer (phase, phase + period, ...) that is not before t; a rounding error counts as on time."""
    return phase_s + max(0, math.ceil((t_s - phase_s) / period_s - 1e-9)) * period_s


def until(env: simpy.Environment, t_s: float) -> simpy.Timeout:
    """An event at mission time t, or now if t has passed."""
    delay_s = t_s - env.now
    return simpy.Timeout(env, delay_s if delay_s > 0.0 else 0.0)


def call_at(env: simpy.Environment, t_s: float, callback: Callable[[simpy.Event], None]) -> simpy.Event:
    """Have `callback` called with the returned event at mission time t, or as the next thing now if t has passed."""
    event = until(env, t_s)
    callbacks: Any = event.callbacks  # a list, until the event is processed
    callbacks.append(callback)
    return event


def call_next(env: simpy.Environment, callback: Callable[[simpy.Event], None]) -> simpy.Event:
    """Have `callback` called with the returned event now, before any other event, as SimPy does with interrupts."""
    event = simpy.Event(env)
    event.callbacks = [callback]
    event._ok, event._value = True, None
    env.schedule(event, simpy.events.URGENT)
    return event
