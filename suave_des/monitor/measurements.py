"""What monitors measure of quality attributes: a signal's whole mission as a table, the battery's level so far.

Managers look values up here; a monitor publishes them on the diagnostics bus only if somebody subscribes to them.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np
import simpy

from suave_des.clock import Process, tick_at_or_after, until
from suave_des.compiling import Array, IntArray
from suave_des.domain import BATTERY_LEVEL
from suave_des.draws import Draws
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus, Kind
from suave_des.scenario.models import Scenario
from suave_des.scenario.physical import Monitor
from suave_des.world.signals import Signal

_DELIVERY_S = 0.01
"""Delay from a timer's tick to the arrival of its message; a simultaneous tick of another timer misses it."""
_ROUNDING = 1e-6
"""A time that is this share of a step below a multiple of it counts as the multiple: timers add up rounding errors."""

Thresholds = tuple[float, ...]
"""Numbers, ascending, that measured values are compared with."""
Loss = Callable[[float], bool]
"""Says whether a monitor's message at a mission time is lost."""


def region_of(value: float, thresholds: Thresholds) -> int:
    """Number the region of a value: two values are in one region if no comparison with a threshold tells them apart.

    A threshold is a region of its own, as a rule may say `<` or `<=`. Use the numbers only to see whether they differ.
    """
    return bisect_left(thresholds, value) + bisect_right(thresholds, value)


class Timing(NamedTuple):
    """The times at which a monitor measures: `phase_s`, and then once a period."""

    period_s: float
    phase_s: float

    @classmethod
    def of(cls, scenario: Scenario, draws: Draws, monitor: str, period_s: float) -> Timing:
        """Find the times of a run: in step with the other timers, or with a random phase."""
        in_step = "monitors" in scenario.revision.timers_in_step
        return cls(period_s, period_s + _DELIVERY_S if in_step else draws.phase(monitor, period_s))


def message_loss(key: str, monitor: Monitor, draws: Draws) -> Loss | None:
    """Make the function that says which of a monitor's messages are lost; None if none can be."""
    if not monitor.loses_messages:
        return None
    stream, share, outages_s = draws.stream(f"{key}.dropout"), monitor.dropout_probability, monitor.outages_s

    def is_lost(t_s: float) -> bool:
        by_chance = stream.random() < share
        return by_chance or any(since_s <= t_s <= to_s for since_s, to_s in outages_s)

    return is_lost


class Measurements(ABC):
    """A monitor's measurements of a quality attribute.

    Attributes:
        key: name of the quality attribute.
        signal: its true value over mission time, where it is a signal.
        are_known: whether all values of the mission are known from the start; if so, they may be looked up for times
            to come.
        times_s: when values were published that differ from the one before.
        values: these values.
    """

    key: str
    signal: Signal
    are_known: ClassVar[bool]
    times_s: Sequence[float]
    values: Sequence[float]

    def count_until(self, t_s: float) -> int:
        """Count the values published by mission time t."""
        return bisect_right(self.times_s, t_s)

    def value(self, t_s: float, since_s: float = 0.0) -> float | None:
        """Look up the value last published by mission time t; None if there is none, or it is older than `since_s`."""
        published = self.count_until(t_s)
        return self.values[published - 1] if published and self.times_s[published - 1] >= since_s else None

    def region(self, t_s: float, thresholds: Thresholds) -> int:
        """Number the region of the value last published by mission time t; -1 if there is none."""
        value = self.value(t_s)
        return -1 if value is None else region_of(value, thresholds)

    @abstractmethod
    def next_crossing_s(self, t_s: float, thresholds: Thresholds) -> float:
        """Find the first time after mission time t at which the region changes, or may change if that is not known."""

    @abstractmethod
    def publish(self, env: simpy.Environment, bus: DiagnosticsBus) -> Process:
        """Publish the values at their times."""


@dataclass(frozen=True, slots=True, eq=False)
class SignalMeasurements(Measurements):
    """What a signal's monitor measures over a whole mission.

    A monitor that repeats an unchanged value reports nothing new: only values that differ from the one before are kept.

    Attributes:
        signal: what is measured.
        timing: when it is measured.
        arrays: times and values as arrays, for vectorised computations.
    """

    are_known: ClassVar[bool] = True
    key: str
    signal: Signal
    timing: Timing
    times_s: list[float]
    values: list[float]
    arrays: tuple[Array, Array] = field(repr=False)
    _crossings: dict[Thresholds, list[float]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(
        cls,
        key: str,
        signal: Signal,
        duration_s: float,
        timing: Timing,
        time_step_s: float = 0.0,
        noise: Callable[[], float] | None = None,
        is_lost: Loss | None = None,
    ) -> SignalMeasurements:
        """Measure a signal over a mission.

        Args:
            key: name of the quality attribute.
            signal: what is measured.
            duration_s: of the mission.
            timing: when it is measured.
            time_step_s: the signal is read at mission time rounded down to multiples of this; 0: at mission time.
            noise: draws the error of one measurement; None: there is none.
            is_lost: says which messages are not published; None: all are.
        """
        messages = max(0, math.floor((duration_s - timing.phase_s) / timing.period_s)) + 1
        times: Array = timing.phase_s + timing.period_s * np.arange(messages, dtype=np.float64)
        read_s = np.floor(times / time_step_s + _ROUNDING) * time_step_s if time_step_s > 0.0 else times
        values, changes, numbers = _sampled(signal, read_s.tobytes())
        if noise is not None:
            values = values + np.array([noise() for _ in range(messages)])
        if is_lost is not None:
            kept = [not is_lost(t_s) for t_s in times.tolist()]
            times, values = times[kept], values[kept]
        if noise is not None or is_lost is not None:
            changes = _changes(values)
            numbers = values[changes].tolist()
        times = times[changes]
        return cls(key, signal, timing, times.tolist(), numbers, (times, values[changes]))

    def crossings_s(self, thresholds: Thresholds) -> list[float]:
        """Find the times at which a value in another region is published, that of the first value included."""
        crossings_s = self._crossings.get(thresholds)
        if crossings_s is None:
            indices = _crossings(self.arrays[1].tobytes(), thresholds)
            crossings_s = self._crossings[thresholds] = [self.times_s[index] for index in indices]
        return crossings_s

    def next_crossing_s(self, t_s: float, thresholds: Thresholds) -> float:
        """Find the time of the first value after mission time t that is in another region, or inf."""
        crossings_s = self.crossings_s(thresholds)
        passed = bisect_right(crossings_s, t_s)
        return crossings_s[passed] if passed < len(crossings_s) else math.inf

    def next_message_s(self, t_s: float) -> float:
        """Find the time of the first message, changed or not, at or after t."""
        return tick_at_or_after(t_s, self.timing.phase_s, self.timing.period_s)

    def publish(self, env: simpy.Environment, bus: DiagnosticsBus) -> Process:
        """Publish the values at their times."""
        for t_s, value in zip(self.times_s, self.values, strict=True):
            yield until(env, t_s)
            bus.publish(Diagnostic(env.now, Kind.QA_STATUS, self.key, value))


def _changes(values: Array) -> IntArray:
    """Find the indices of values that differ from the one before, the first included."""
    return np.flatnonzero(np.diff(values, prepend=np.nan))


# Cached by the arrays' bytes (float64): without noise, a signal that is read in time steps is the same in each run.


@lru_cache(maxsize=16)
def _sampled(signal: Signal, times_s: bytes) -> tuple[Array, IntArray, list[float]]:
    """Read a signal at some times; return the values, the indices of those that differ, and the latter as numbers."""
    times = np.frombuffer(times_s)
    first = _changes(times)
    values = np.repeat([signal(t_s) for t_s in times[first].tolist()], np.diff(first, append=len(times)))
    changes = _changes(values)
    return values, changes, values[changes].tolist()


@lru_cache(maxsize=64)
def _crossings(values: bytes, thresholds: Thresholds) -> list[int]:
    """Find the indices of values whose region differs from that of the one before, the first included."""
    measured = np.frombuffer(values)
    regions = np.searchsorted(thresholds, measured) + np.searchsorted(thresholds, measured, side="right")
    indices: list[int] = np.flatnonzero(np.diff(regions, prepend=-1)).tolist()
    return indices


@dataclass(eq=False)
class BatteryMeasurements(Measurements):
    """The battery's level, which falls linearly from 1 until it is recharged; computed on demand.

    Attributes:
        discharge_time_s: time from full to empty.
        timing: when it is measured.
        noise: draws the error of one measurement; None: there is none.
        is_lost: says which messages are not published; None: all are.
        recharges: how often it was recharged so far.
        listeners: each is called when it has been recharged.
    """

    are_known: ClassVar[bool] = False
    discharge_time_s: float
    timing: Timing
    noise: Callable[[], float] | None = None
    is_lost: Loss | None = None
    key: str = field(default=BATTERY_LEVEL, init=False)
    times_s: list[float] = field(default_factory=list, init=False)
    values: list[float] = field(default_factory=list, init=False)
    recharges: int = field(default=0, init=False)
    listeners: list[Callable[[], None]] = field(default_factory=list, init=False)
    _full_at_s: float = field(default=0.0, init=False)

    def __post_init__(self) -> None:
        self._next_s = self.timing.phase_s

    def count_until(self, t_s: float) -> int:
        """Count the values published by mission time t, which must not lie in the future."""
        while self._next_s <= t_s:
            self._measure(self._next_s)
            self._next_s += self.timing.period_s
        return super().count_until(t_s)

    def recharge(self, t_s: float) -> None:
        """Fill the battery now, and publish its level."""
        self.count_until(t_s)
        self._full_at_s = t_s
        self.recharges += 1
        self._measure(t_s)
        for listener in self.listeners:
            listener()

    def _measure(self, t_s: float) -> None:
        error = 0.0 if self.noise is None else self.noise()
        if self.is_lost is None or not self.is_lost(t_s):
            self.times_s.append(t_s)
            self.values.append(self._level(t_s) + error)

    def level(self, t_s: float) -> float:
        """Compute the true level at mission time t, which is now."""
        self.count_until(t_s)
        return self._level(t_s)

    def _level(self, t_s: float) -> float:
        return max(0.0, 1.0 - (t_s - self._full_at_s) / self.discharge_time_s)

    def next_crossing_s(self, t_s: float, thresholds: Thresholds) -> float:
        """Find the earliest time after t, which is now, at which the level can be in a different region.

        In the region that 1 is in, only falling leads to another one; waiting until then saves a fifth of the CPU time
        of a mission of bt_extended.
        """
        region = self.region(t_s, thresholds)
        if self.noise is not None or region != region_of(1.0, thresholds):
            return self._next_s
        threshold = max([each for each in thresholds if each <= 1.0], default=-math.inf)
        falls_s = (1.0 - threshold) * self.discharge_time_s
        return max(self._next_s, self._full_at_s + falls_s - self.timing.period_s)

    def publish(self, env: simpy.Environment, bus: DiagnosticsBus) -> Process:
        """Publish the level once a period, and when it has been recharged, unless the message is lost."""
        published_before = 0

        def report() -> None:
            nonlocal published_before
            published = self.count_until(env.now)
            if published > published_before:
                bus.publish(Diagnostic(env.now, Kind.QA_STATUS, self.key, self.values[published - 1]))
            published_before = published

        self.listeners.append(report)
        yield until(env, self.timing.phase_s)
        while True:
            report()
            yield env.timeout(self.timing.period_s)
