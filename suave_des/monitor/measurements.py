"""What monitors measure of quality attributes, as tables of a whole mission.

Managers look values up here; a monitor publishes them on the diagnostics bus only if somebody
subscribes to them.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
import simpy

from suave_des.clock import Process, exactly_at, tick_at_or_after
from suave_des.compiling import Array, IntArray
from suave_des.domain import BATTERY_LEVEL
from suave_des.draws import Draws
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus, Kind
from suave_des.scenario.models import Monitor, Scenario
from suave_des.world.signals import Signal

_DELIVERY_S = 0.01
"""Delay from a timer's tick to the arrival of its message; a simultaneous tick of another timer
misses it.
"""
_ROUNDING = 1e-6
"""A time that is this share of a step below a multiple of it counts as the multiple: timers add up
rounding errors.
"""

Thresholds = tuple[float, ...]
"""Numbers, ascending, that measured values are compared with."""
Loss = Callable[[float], bool]
"""Says whether a monitor's message at a mission time is lost."""


class Timing(NamedTuple):
    """The times at which a monitor measures: `phase_s`, and then once a period."""

    period_s: float
    phase_s: float

    @classmethod
    def of(cls, scenario: Scenario, draws: Draws, monitor: str, period_s: float) -> Timing:
        """Find the times of a run: in step with the other timers, or with a random phase."""
        in_step = "monitors" in scenario.revision.timers_in_step
        return cls(period_s, period_s + _DELIVERY_S if in_step else draws.phase(monitor, period_s))

    def count(self, duration_s: float) -> int:
        """Count the measurements in a mission."""
        return max(0, math.floor((duration_s - self.phase_s) / self.period_s)) + 1


def message_loss(key: str, monitor: Monitor, draws: Draws) -> Loss | None:
    """Make the function that says which of a monitor's messages are lost; None if none can be."""
    if not monitor.loses_messages:
        return None
    stream, share, outages_s = (
        draws.stream(f"{key}.dropout"),
        monitor.dropout_probability,
        monitor.outages_s,
    )

    def is_lost(t_s: float) -> bool:
        by_chance = stream.random() < share
        return by_chance or any(since_s <= t_s <= to_s for since_s, to_s in outages_s)

    return is_lost


@dataclass(eq=False)
class Measurements:
    """What a monitor measures of a quality attribute: a table of the values that it publishes over
    the whole mission.

    A monitor that repeats an unchanged value of a signal reports nothing new: only those that
    differ are in the table.

    Attributes:
        signal: the true value over mission time.
        times_s: when the values are published, ascending.
        values: these values.
        arrays: both as arrays, for vectorised computations.
        sent_s: when messages are published, changed or not, and inf, if some are lost; None: none
            is.
    """

    key: str
    signal: Signal
    timing: Timing
    times_s: list[float] = field(repr=False)
    values: list[float] = field(repr=False)
    arrays: tuple[Array, Array] = field(repr=False)
    sent_s: Array | None = field(default=None, repr=False)
    _crossings: dict[Thresholds, tuple[list[float], list[int]]] = field(
        default_factory=dict, repr=False, init=False
    )

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
    ) -> Measurements:
        """Measure a signal over a mission.

        Args:
            key, signal, duration_s, timing: what is measured in a mission of that time, and when.
            time_step_s: the signal is read at mission time rounded down to multiples of this; 0: at
                mission time.
            noise: draws the error of one measurement; None: there is none.
            is_lost: says which messages are not published; None: all are.
        """
        times: Array = timing.phase_s + timing.period_s * np.arange(
            timing.count(duration_s), dtype=np.float64
        )
        read_s = (
            np.floor(times / time_step_s + _ROUNDING) * time_step_s if time_step_s > 0.0 else times
        )
        values, changes, numbers = _sampled(signal, read_s.tobytes())
        if noise is not None or is_lost is not None:
            times, values = _published(times, values, noise, is_lost)
            changes = _changes(values)
            numbers = values[changes].tolist()
        sent_s, times = None if is_lost is None else np.append(times, math.inf), times[changes]
        return Measurements(
            key, signal, timing, times.tolist(), numbers, (times, values[changes]), sent_s
        )

    @property
    def may_change(self) -> bool:
        """Whether something may be published that is not yet in the table."""
        return False

    def count_until(self, t_s: float) -> int:
        """Count the values published by mission time t."""
        return bisect_right(self.times_s, t_s)

    def value(self, t_s: float, since_s: float = 0.0) -> float | None:
        """Look up the value last published by mission time t; None if there is none, or it is older
        than `since_s`.
        """
        published = self.count_until(t_s)
        return (
            self.values[published - 1]
            if published and self.times_s[published - 1] >= since_s
            else None
        )

    def crossings(self, thresholds: Thresholds) -> tuple[list[float], list[int]]:
        """Find when a value in another region is published, and its region: even between
        thresholds, odd on one.
        """
        crossings = self._crossings.get(thresholds)
        if crossings is None:
            indices, regions = _crossings(self.arrays[1].tobytes(), thresholds)
            crossings = self._crossings[thresholds] = (
                [self.times_s[index] for index in indices],
                regions,
            )
        return crossings

    def region_until(self, t_s: float, thresholds: Thresholds) -> tuple[int, float]:
        """Find the region of the value last published by mission time t, or -1, and when another
        one begins, or inf.
        """
        crossings_s, regions = self.crossings(thresholds)
        passed = bisect_right(crossings_s, t_s)
        until_s = crossings_s[passed] if passed < len(crossings_s) else math.inf
        return regions[passed - 1] if passed else -1, until_s

    def next_message_s(self, t_s: float) -> float:
        """Find the time of the first message, changed or not, at or after t; inf if there is
        none.
        """
        if self.sent_s is None:
            return tick_at_or_after(t_s, self.timing.phase_s, self.timing.period_s)
        return self.sent_s.item(np.searchsorted(self.sent_s, t_s - _ROUNDING))

    def publish(self, env: simpy.Environment, bus: DiagnosticsBus) -> Process:
        """Publish the values at their times, from now on."""
        t_s = env.now
        if t_s == 0.0:
            t_s = -math.inf  # the value of the mission's start is still to be published
        while (published := self.count_until(t_s)) < len(self.times_s):
            t_s = self.times_s[published]
            yield exactly_at(env, t_s)
            self.publish_now(env, bus)

    def publish_now(self, env: simpy.Environment, bus: DiagnosticsBus) -> None:
        """Publish the value of this very time, if there is one."""
        value = self.value(env.now, since_s=env.now)
        if value is not None:
            bus.publish(Diagnostic(env.now, Kind.QA_STATUS, self.key, value))


class BatteryMeasurements(Measurements):
    """The battery's level, which falls linearly from 1. Recharging makes what follows in the table
    another.

    The exemplar's battery monitor counts: at each of its ticks it takes away what a period uses.

    Args:
        discharge_time_s: time from full to empty.
        timing, duration_s, noise, is_lost: as of `Measurements.of`.

    Attributes:
        recharges: how often it was recharged so far.
        may_be_recharged: says whether the function that recharges it is active, or will be.
        listeners: each is called when it has been recharged.
    """

    def __init__(
        self,
        discharge_time_s: float,
        timing: Timing,
        duration_s: float,
        noise: Callable[[], float] | None = None,
        is_lost: Loss | None = None,
    ) -> None:
        super().__init__(BATTERY_LEVEL, self.level, timing, [], [], (np.empty(0), np.empty(0)))
        self._discharge_time_s, self._disturbances = discharge_time_s, (noise, is_lost)
        self._full_at_s, self.recharges = 0.0, 0
        self.may_be_recharged: Callable[[], bool] = bool
        self.listeners: list[Callable[[], None]] = []
        periods_s = np.full(timing.count(duration_s) - 1, timing.period_s)
        self._ticks_s: Array = np.add.accumulate(np.append(timing.phase_s, periods_s))
        self._used = timing.period_s / discharge_time_s
        self._measure(self._ticks_s, 1.0 - self._used)

    @property
    def may_change(self) -> bool:
        """Whether it may be recharged."""
        return self.may_be_recharged()

    def level(self, t_s: float) -> float:
        """Compute the true level at mission time t, if it is not recharged until then."""
        return max(0.0, 1.0 - (t_s - self._full_at_s) / self._discharge_time_s)

    def recharge(self, t_s: float) -> None:
        """Fill the battery now, and publish its level."""
        self._full_at_s = t_s
        self.recharges += 1
        later = np.searchsorted(self._ticks_s, t_s, side="right")
        self._measure(np.append(t_s, self._ticks_s[later:]), 1.0)
        for listener in self.listeners:
            listener()

    def close(self) -> None:
        """Tell and ask nobody any more."""
        self.listeners.clear()
        self.may_be_recharged = bool

    def publish(self, env: simpy.Environment, bus: DiagnosticsBus) -> Process:
        """Publish the levels at their times, and that of a recharged battery at once."""
        self.listeners.append(partial(self.publish_now, env, bus))
        return super().publish(env, bus)

    def _measure(self, times: Array, level: float) -> None:
        """Measure at some times, from the first of which on the table is made anew with a level."""
        known = self.count_until(times[0])
        # One subtraction after the other, with its rounding errors: they decide at a threshold.
        counted = np.subtract.accumulate(np.append(level, np.full(len(times) - 1, self._used)))
        levels = np.maximum(0.0, counted)
        times, levels = _published(times, levels, *self._disturbances)
        self.times_s[known:], self.values[known:] = times.tolist(), levels.tolist()
        self.arrays = (
            np.append(self.arrays[0][:known], times),
            np.append(self.arrays[1][:known], levels),
        )
        self._crossings.clear()


def _published(
    times: Array, values: Array, noise: Callable[[], float] | None, is_lost: Loss | None
) -> tuple[Array, Array]:
    """Add errors to measured values, and leave out those whose message is lost."""
    if noise is not None:
        values = values + np.array([noise() for _ in values])
    if is_lost is not None:
        kept = [not is_lost(t_s) for t_s in times.tolist()]
        times, values = times[kept], values[kept]
    return times, values


def _changes(values: Array) -> IntArray:
    """Find the indices of values that differ from the one before, the first included."""
    return np.flatnonzero(np.diff(values, prepend=np.nan))


# Cached by the arrays' bytes (float64): without noise, a signal that is read in time steps is the
# same in each run.


@lru_cache(maxsize=16)
def _sampled(signal: Signal, times_s: bytes) -> tuple[Array, IntArray, list[float]]:
    """Read a signal at some times; return the values, the indices of those that differ, and the
    latter as numbers.
    """
    times = np.frombuffer(times_s)
    first = _changes(times)
    values = np.repeat(
        [signal(t_s) for t_s in times[first].tolist()], np.diff(first, append=len(times))
    )
    changes = _changes(values)
    return values, changes, values[changes].tolist()


@lru_cache(maxsize=64)
def _crossings(values: bytes, thresholds: Thresholds) -> tuple[list[int], list[int]]:
    """Find the indices of values whose region differs from that of the one before, the first
    included; and regions.
    """
    measured = np.frombuffer(values)
    regions = np.searchsorted(thresholds, measured) + np.searchsorted(
        thresholds, measured, side="right"
    )
    indices = np.flatnonzero(np.diff(regions, prepend=-1))
    return indices.tolist(), regions[indices].tolist()
