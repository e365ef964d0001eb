"""Measurements of monitors: a signal's messages as a table for the whole mission, and the battery's level so far.

Looking up a value reads the table; a monitor publishes the value only if somebody subscribes (see `monitors`).
"""

import math
from abc import ABC, abstractmethod
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar

import numpy as np

from suave_des.clock import tick_at_or_after
from suave_des.compiling import Array, IntArray
from suave_des.domain import BATTERY_LEVEL
from suave_des.world.signals import Signal

Thresholds = tuple[float, ...]
"""Numbers, ascending, that divide the values into regions: 0 lies below the first threshold, 1 is the threshold itself,
2 lies between it and the next, and so on; -1 stands for no value.
"""
Crossings = tuple[list[float], list[int]]
"""The times at which a measured value enters a different region, and the regions' numbers."""


def region_of(value: float, thresholds: Thresholds) -> int:
    """Find the number of a value's region."""
    return bisect_left(thresholds, value) + bisect_right(thresholds, value)


class Measured(ABC):
    """A monitor's measurements of a quality attribute.

    Attributes:
        is_tabulated: whether the values are known for the whole mission; if so, they may be looked up at future times.
        times_s: when the values were published.
        values: the values that were published, and those that will be if they are tabulated.
    """

    is_tabulated: ClassVar[bool]
    times_s: Sequence[float]
    values: Sequence[float]

    @abstractmethod
    def count_until(self, t_s: float) -> int:
        """Count the values published by mission time t."""

    def value(self, t_s: float, since_s: float = 0.0) -> float | None:
        """Look up the value last published by mission time t; None if there is none, or it is older than `since_s`."""
        published = self.count_until(t_s)
        return self.values[published - 1] if published and self.times_s[published - 1] >= since_s else None

    def region(self, t_s: float, thresholds: Thresholds) -> int:
        """Find the region of the value last published by mission time t."""
        value = self.value(t_s)
        return -1 if value is None else region_of(value, thresholds)

    @abstractmethod
    def next_crossing_s(self, t_s: float, thresholds: Thresholds) -> float:
        """Find the first time after mission time t at which the region changes, or may change if that is not known."""


@dataclass(frozen=True, slots=True)
class Measurements(Measured):
    """What a signal's monitor measures in a run: the times at which the published value changes, and the values.

    A monitor that repeats an unchanged value reports nothing new: only values that differ from the one before are kept.
    """

    is_tabulated: ClassVar[bool] = True
    key: str
    times_s: tuple[float, ...]
    values: tuple[float, ...]
    phase_s: float
    period_s: float
    arrays: tuple[Array, Array] = field(repr=False, compare=False)
    """Times and values as arrays, for vectorised computations."""
    _crossings: dict[Thresholds, Crossings] = field(default_factory=dict, repr=False, compare=False)

    def count_until(self, t_s: float) -> int:
        """Count the values published by mission time t."""
        return bisect_right(self.times_s, t_s)

    def crossings(self, thresholds: Thresholds) -> Crossings:
        """Find the measurements whose region differs from the previous one's, including the first measurement."""
        crossings = self._crossings.get(thresholds)
        if crossings is None:
            indices, regions = _crossing_indices(self.arrays[1].tobytes(), thresholds)
            crossings = self._crossings[thresholds] = [self.times_s[index] for index in indices], regions
        return crossings

    def region(self, t_s: float, thresholds: Thresholds) -> int:
        """Find the region of the value last published by mission time t."""
        times_s, regions = self.crossings(thresholds)
        passed = bisect_right(times_s, t_s)
        return regions[passed - 1] if passed else -1

    def next_crossing_s(self, t_s: float, thresholds: Thresholds) -> float:
        """Find the time of the first value after mission time t that enters a different region, or inf."""
        times_s, _ = self.crossings(thresholds)
        passed = bisect_right(times_s, t_s)
        return times_s[passed] if passed < len(times_s) else math.inf

    def next_message_s(self, t_s: float) -> float:
        """Find the time of the first message, changed or not, at or after t."""
        return tick_at_or_after(t_s, self.phase_s, self.period_s)


@dataclass(frozen=True, slots=True)
class MonitorTiming:
    """The times at which a monitor measures.

    Attributes:
        period_s: time from message to message.
        phase_s: time of the first message.
        time_step_s: the signal is read at mission time rounded down to multiples of this; 0: at mission time.
    """

    period_s: float
    phase_s: float
    time_step_s: float = 0.0


def measure(
    key: str,
    signal: Signal,
    duration_s: float,
    timing: MonitorTiming,
    noise: Callable[[], float] | None = None,
    is_lost: Callable[[float], bool] | None = None,
) -> Measurements:
    """Measure a signal over a mission.

    Args:
        key: name of the quality attribute.
        signal: what is measured.
        duration_s: of the mission.
        timing: when it is measured.
        noise: draws the error of one measurement.
        is_lost: whether the message at a mission time is not published.
    """
    period_s, phase_s = timing.period_s, timing.phase_s
    messages = max(0, math.floor((duration_s - phase_s) / period_s)) + 1
    times: Array = phase_s + period_s * np.arange(messages, dtype=np.float64)
    read_s = times
    if (step_s := timing.time_step_s) > 0.0:
        # A time within a millionth of a step below a multiple counts as it: timers add up rounding errors.
        read_s = np.floor(times / step_s + 1e-6) * step_s
    values, changes = _sampled(signal, read_s.tobytes())
    if noise is not None:
        values = values + np.array([noise() for _ in range(len(times))])
    if is_lost is not None:
        kept = [not is_lost(t_s) for t_s in times.tolist()]
        times, values = times[kept], values[kept]
    if noise is not None or is_lost is not None:
        changes = _changes(values)
    indices, changed, numbers = changes
    times = times[indices]
    return Measurements(key, tuple(times.tolist()), numbers, phase_s, period_s, (times, changed))


def _changes(values: Array) -> tuple[IntArray, Array, tuple[float, ...]]:
    """Find the values that differ from the previous one, including the first: indices, values, and these as numbers."""
    indices = np.flatnonzero(np.diff(values, prepend=np.nan))
    return indices, values[indices], tuple(values[indices].tolist())


# Cached by the arrays' bytes (float64): without noise, a signal that is read in time steps is the same in each run.


@lru_cache(maxsize=16)
def _sampled(signal: Signal, times_s: bytes) -> tuple[Array, tuple[IntArray, Array, tuple[float, ...]]]:
    """Read a signal at some times; return the values, and their changes."""
    times = np.frombuffer(times_s)
    first, _, different_s = _changes(times)
    values = np.repeat([signal(t_s) for t_s in different_s], np.diff(first, append=len(times)))
    return values, _changes(values)


@lru_cache(maxsize=64)
def _crossing_indices(values: bytes, thresholds: Thresholds) -> tuple[list[int], list[int]]:
    """Find the values whose region differs from the previous one's: indices, and the regions' numbers."""
    measured = np.frombuffer(values)
    regions = np.searchsorted(thresholds, measured) + np.searchsorted(thresholds, measured, side="right")
    indices = np.flatnonzero(np.diff(regions, prepend=-1))
    return indices.tolist(), regions[indices].tolist()


@dataclass(eq=False)
class BatteryLevel(Measured):
    """The battery's level, which falls linearly from 1 and is reset to 1 at the recharge station.

    It is computed on demand, from where the vehicle was at each message.

    Attributes:
        is_at_station: whether the vehicle is at the station at a mission time.
        discharge_time_s: time from full to empty.
        timing: when it is measured.
        noise: draws the error of one measurement; none if measurements are exact.
        is_lost: whether the message at a mission time is not published; none: all are.
        times_s, values: of what was published so far.
        recharges: number of visits to the station so far.
    """

    key: ClassVar[str] = BATTERY_LEVEL
    is_tabulated: ClassVar[bool] = False
    is_at_station: Callable[[float], bool]
    discharge_time_s: float
    timing: MonitorTiming
    noise: Callable[[], float] | None = None
    is_lost: Callable[[float], bool] | None = None
    times_s: list[float] = field(default_factory=list, init=False)
    values: list[float] = field(default_factory=list, init=False)
    recharges: int = field(default=0, init=False)
    _full_at_s: float = field(default=0.0, init=False)
    _was_at_station: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self._next_s = self.timing.phase_s

    def count_until(self, t_s: float) -> int:
        """Count the values published by mission time t, which must not lie in the future."""
        while self._next_s <= t_s:
            if at_station := self.is_at_station(self._next_s):
                self._full_at_s = self._next_s
                self.recharges += not self._was_at_station
            self._was_at_station = at_station
            error = 0.0 if self.noise is None else self.noise()
            if self.is_lost is None or not self.is_lost(self._next_s):
                self.times_s.append(self._next_s)
                self.values.append(self._level(self._next_s) + error)
            self._next_s += self.timing.period_s
        return bisect_right(self.times_s, t_s)

    def level(self, t_s: float) -> float:
        """Compute the true level at mission time t, which is now."""
        self.count_until(t_s)
        return self._level(t_s)

    def _level(self, t_s: float) -> float:
        return max(0.0, 1.0 - (t_s - self._full_at_s) / self.discharge_time_s)

    def next_crossing_s(self, t_s: float, thresholds: Thresholds) -> float:
        """Find the earliest time after t, which is now, at which the level can be in a different region.

        The level falls, or is back at 1 at once. In the region that 1 is in, only falling leads to another one; waiting
        until then saves a fifth of the CPU time of a mission of bt_extended.
        """
        region = self.region(t_s, thresholds)
        if self.noise is not None or region != region_of(1.0, thresholds):
            return self._next_s
        threshold = max([each for each in thresholds if each <= 1.0], default=-math.inf)
        falls_s = (1.0 - threshold) * self.discharge_time_s
        return max(self._next_s, self._full_at_s + falls_s - self.timing.period_s)
