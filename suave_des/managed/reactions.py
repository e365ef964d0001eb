"""Mean reaction time, the metric of revision 1.5's metrics node (facts: kas-lab/suave, revision 1.5)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from operator import itemgetter
from typing import Any

import numpy as np
import simpy

from suave_des.managed.search import INITIAL_ALTITUDE_M
from suave_des.managed.task import MAINTAIN_MOTION, RECHARGE
from suave_des.monitor.diagnostics import FAILED, Diagnostic
from suave_des.monitor.measurements import Measured, Measurements
from suave_des.scenario.models import ReactionMetric
from suave_des.scenario.modes import Mode


class ReactionMeter:
    """Times from an event that asks for an adaptation to the adaptation's effect.

    Three kinds of event: a thruster failure is reported, until maintain_motion is active; the measured visibility does
    not fit the search altitude, until the fitting altitude is set; the battery is low, until the recharge path is
    active. An event that is never answered does not count.

    During the mission it only takes notes; what was measured meanwhile is read from its tables in the end.

    Args:
        env: the mission's clock.
        settings: thresholds and altitudes.
        visibility: the measured visibility.
        battery: the battery's level; none without a battery.
    """

    def __init__(
        self,
        env: simpy.Environment,
        settings: ReactionMetric,
        visibility: Measurements,
        battery: Measured | None = None,
    ) -> None:
        self._env = env
        self._settings = settings
        self._visibility = visibility
        self._battery = battery
        self._noted: list[_Happening] = []

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Take note of a component's status."""
        if diagnostic.value == FAILED:
            self._noted.append((self._env.now, _Open.failure, None))

    def mode_effect(self, function: str, mode: Mode) -> None:
        """Take note that a mode has taken effect."""
        if mode.active:
            self._noted.append((self._env.now, _Open.mode_effect, (function, mode)))

    def reactions_s(self) -> list[float]:
        """The reactions completed by now, in the order of their completion."""
        reactions = _Open(self._visibility.next_message_s)
        happenings = [*self._fitting_altitudes(), *self._low_battery(), *self._noted]
        happenings.sort(key=itemgetter(0))
        for t_s, what, value in happenings:
            what(reactions, t_s, value)
        return reactions.completed_s

    def mean_s(self) -> float | None:
        """Mean of the completed reactions; none if there was none."""
        reactions_s = self.reactions_s()
        return sum(reactions_s) / len(reactions_s) if reactions_s else None

    def _fitting_altitudes(self) -> Iterator[_Happening]:
        """The messages from which on another altitude fits than before."""
        altitudes_m = (None, *self._settings.expected_altitudes_m[::-1])
        times_s = self._visibility.times_s
        published = self._visibility.published(self._env.now)
        for message, band in _bands(self._visibility.arrays[1].tobytes(), self._settings.visibility_thresholds_m):
            if message >= published:
                break
            yield times_s[message], _Open.expect, altitudes_m[band]

    def _low_battery(self) -> Iterator[_Happening]:
        if self._battery is not None:
            for message in range(self._battery.published(self._env.now)):
                low = self._battery.values[message] < self._settings.battery_limit
                yield self._battery.times_s[message], _Open.battery, low


@lru_cache(maxsize=64)
def _bands(values: bytes, falling: tuple[float, ...]) -> list[tuple[int, int]]:
    """Places of the values (float64) that lie between other thresholds than the one before, and how many are below.

    Without noise they are the same in most runs.
    """
    bands = np.searchsorted(falling[::-1], np.frombuffer(values), side="right").tolist()
    return [(place, band) for place, band in enumerate(bands) if place == 0 or band != bands[place - 1]]


class _Open:
    """Events that wait for their adaptation, and the times of those that were answered.

    The altitude is compared at every visibility message of the whole mission, except while the battery is low. A
    mismatch ends only when the expected altitude is set, not when the visibility comes back.

    Args:
        next_message_s: says when the next visibility message comes, changed or not.
    """

    def __init__(self, next_message_s: Callable[[float], float]) -> None:
        self._next_message_s = next_message_s
        self._altitude_m = INITIAL_ALTITUDE_M
        self._expected_m: float | None = None
        self._battery_low = False
        self._failure_since_s: float | None = None
        self._mismatch_since_s: float | None = None
        self._low_battery_since_s: float | None = None
        self.completed_s: list[float] = []

    def failure(self, t_s: float, _: None) -> None:
        """A thruster failure is reported."""
        if self._failure_since_s is None:
            self._failure_since_s = t_s

    def expect(self, t_s: float, altitude_m: float | None) -> None:
        """From this visibility message on another altitude fits; none: no altitude does."""
        self._expected_m = altitude_m
        self._compare_at(t_s)

    def battery(self, t_s: float, low: bool) -> None:
        """A message of the battery's level."""
        if low and self._low_battery_since_s is None:
            self._low_battery_since_s = t_s
        if low and self._mismatch_since_s is not None and self._mismatch_since_s > t_s:
            self._mismatch_since_s = None  # the message that would have shown it comes too late
        if self._battery_low and not low:
            self._battery_low = False
            self._compare_at(self._next_message_s(t_s))
        self._battery_low = low

    def mode_effect(self, t_s: float, effect: tuple[str, Mode]) -> None:
        """An active mode has taken effect."""
        function, mode = effect
        if function == MAINTAIN_MOTION and self._failure_since_s is not None:
            self.completed_s.append(t_s - self._failure_since_s)
            self._failure_since_s = None
        elif function == RECHARGE and self._low_battery_since_s is not None:
            self.completed_s.append(t_s - self._low_battery_since_s)
            self._low_battery_since_s = None
        altitude = mode.parameters.get("spiral_altitude")
        if altitude is not None:
            self._altitude_m = float(altitude)
            if self._mismatch_since_s is not None and self._altitude_m == self._expected_m:
                if self._mismatch_since_s < t_s:
                    self.completed_s.append(t_s - self._mismatch_since_s)
                self._mismatch_since_s = None
            else:
                # The next message finds the mismatch, if there is one, though its value may not be new.
                self._compare_at(self._next_message_s(t_s))

    def _compare_at(self, message_s: float) -> None:
        if self._battery_low or self._expected_m is None:
            return
        fits = self._altitude_m == self._expected_m
        if self._mismatch_since_s is None and not fits:
            self._mismatch_since_s = message_s
        elif fits and self._mismatch_since_s is not None and self._mismatch_since_s >= message_s:
            self._mismatch_since_s = None


_Happening = tuple[float, Callable[[_Open, float, Any], None], Any]
"""Time, what happens to the open events, and a value."""
