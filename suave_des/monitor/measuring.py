"""How a monitor measures a signal: the whole mission's messages at once, ahead of time."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from suave_des.compiling import compiled
from suave_des.monitor.measurements import Measurements
from suave_des.world.signals import Signal


def measure(
    key: str,
    signal: Signal,
    duration_s: float,
    *,
    period_s: float,
    phase_s: float,
    time_step_s: float = 0.0,
    noise: Callable[[], float] | None = None,
) -> Measurements:
    """Measure a signal over a mission.

    Args:
        key: the quality attribute.
        signal: the signal.
        duration_s: how long to measure.
        period_s: publishing period.
        phase_s: time of the first message.
        time_step_s: the signal is looked at at mission time cut to multiples of this; 0: at mission time.
        noise: draws the error of one measurement; none if measurements are exact.
    """
    times = np.empty(max(0, math.floor((duration_s - phase_s) / period_s)) + 1)
    looks = np.empty(len(times))
    message_times(phase_s, period_s, time_step_s, times, looks)
    values, news = _looked_up(signal, looks.tobytes())
    if noise is not None:
        news = _news(values + np.array([noise() for _ in range(len(times))]))
    times = times[news.places]
    return Measurements(key, tuple(times.tolist()), news.values, phase_s, period_s, (times, news.array))


@compiled
def message_times(
    phase_s: float, period_s: float, time_step_s: float, times_s: NDArray[np.float64], looks_s: NDArray[np.float64]
) -> None:
    """Times of messages, and the times at which the signal is looked at for them; see `measure`.

    Args:
        phase_s: time of the first message.
        period_s: time from message to message.
        time_step_s: what the times of looking are cut to multiples of; 0: they are not.
        times_s: shape (messages,); written into.
        looks_s: likewise.
    """
    for message in range(len(times_s)):
        time_s = phase_s + message * period_s
        times_s[message] = looks_s[message] = time_s
        if time_step_s > 0.0:
            # A time within a millionth of a step below a multiple counts as it: timers add up rounding errors.
            looks_s[message] = math.floor(time_s / time_step_s + 1e-6) * time_step_s


class _News(NamedTuple):
    """Those of a sequence of values that differ from the one before, and their places in it; the first one does."""

    places: NDArray[np.int64]
    values: tuple[float, ...]
    array: NDArray[np.float64]


def _news(values: NDArray[np.float64]) -> _News:
    places = _changes(values)
    array = values[places]
    array.flags.writeable = False
    return _News(places, tuple(array.tolist()), array)


@lru_cache(maxsize=16)
def _looked_up(signal: Signal, times_s: bytes) -> tuple[NDArray[np.float64], _News]:
    """Values of a signal at times (float64), and what is new among them.

    If time is cut and the signal is not drawn, they are the same in most runs.
    """
    times = np.frombuffer(times_s)
    first = _changes(times)
    values = np.repeat([signal(t_s) for t_s in times[first].tolist()], np.diff(first, append=len(times)))
    values.flags.writeable = False
    return values, _news(values)


def _changes(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """Places of the values that differ from the one before; the first one does."""
    return np.flatnonzero(np.concatenate(([True], values[1:] != values[:-1])))
