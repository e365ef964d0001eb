"""Mean reaction time, the metric of revision 1.5 (source: node mission_metrics of kas-lab/suave
1.5.0).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from operator import attrgetter
from typing import NamedTuple

import simpy

from suave_des.domain import GENERATE_RECHARGE_PATH, MAINTAIN_MOTION
from suave_des.monitor.diagnostics import FAILED, Diagnostic
from suave_des.monitor.measurements import Measurements
from suave_des.scenario.models import ReactionMetric
from suave_des.scenario.modes import Mode

_LATER_S = 1e-4
"""From a time to the times after it, with all rounding errors."""


class _Failure(NamedTuple):
    """A thruster failure is reported."""

    t_s: float


class _Fitting(NamedTuple):
    """From this visibility message on another altitude fits, or none does."""

    t_s: float
    altitude_m: float | None


class _BatteryLevel(NamedTuple):
    """A message of the battery's level."""

    t_s: float
    is_low: bool


class _Effect(NamedTuple):
    """A mode has taken effect."""

    t_s: float
    function: str
    mode: Mode


_Entry = _Failure | _Fitting | _BatteryLevel | _Effect


@dataclass(eq=False)
class ReactionMeter:
    """Times from an event that asks for an adaptation to the adaptation's effect.

    Three kinds of event: a thruster failure is reported, until maintain_motion is active; the
    measured visibility does not fit the search altitude, until the fitting altitude is set; the
    battery is low, until the recharge path is active. An event that is never answered does not
    count, nor does a failure that is reported while maintain_motion is active: it asks for nothing
    that has not been done (as in the real runs of 2025, docs/background/fidelity.md).

    During the mission reports and effects are only noted; what was measured is read from its tables
    at the end.
    """

    env: simpy.Environment
    settings: ReactionMetric
    visibility: Measurements
    initial_altitude_m: float
    battery: Measurements | None = None
    _entries: list[_Entry] = field(default_factory=list, init=False)

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Note a component's status."""
        if diagnostic.value == FAILED:
            self._entries.append(_Failure(self.env.now))

    def mode_effect(self, function: str, mode: Mode) -> None:
        """Note that a mode has taken effect."""
        self._entries.append(_Effect(self.env.now, function, mode))

    def reactions_s(self) -> list[float]:
        """The reactions completed by now, in the order of their completion."""
        open_events = _OpenEvents(self.visibility.next_message_s, self.initial_altitude_m)
        entries = [*self._fitting_altitudes(), *self._low_battery(), *self._entries]
        for entry in sorted(entries, key=attrgetter("t_s")):
            open_events.take(entry)
        return open_events.completed_s

    def mean_s(self) -> float | None:
        """Mean of the completed reactions; None if there was none."""
        reactions_s = self.reactions_s()
        return sum(reactions_s) / len(reactions_s) if reactions_s else None

    def _fitting_altitudes(self) -> list[_Entry]:
        """The messages from which on another altitude fits than before."""
        thresholds_m = self.settings.visibility_thresholds_m
        altitudes_m = self.settings.expected_altitudes_m
        crossings_s, regions = self.visibility.crossings(thresholds_m[::-1])
        fitting_m = [None, *(altitude_m for altitude_m in altitudes_m[::-1] for _ in range(2))]
        # later ones are not answered
        passed = bisect_right(crossings_s, self._entries[-1].t_s) if self._entries else 0
        return [_Fitting(crossings_s[n], fitting_m[regions[n]]) for n in range(passed)]

    def _low_battery(self) -> Iterator[_Entry]:
        """The messages of a low battery, and each after these that says that it is not."""
        if self.battery is not None:
            was_low = False
            count = self.battery.count_until(self.env.now)
            for t_s, level in zip(self.battery.times_s[:count], self.battery.values, strict=False):
                low = level < self.settings.battery_limit
                if low or was_low:
                    yield _BatteryLevel(t_s, low)
                was_low = low


class _OpenEvents:
    """The events that wait for their adaptation, and the reactions to those that were answered.

    The altitude is compared at every visibility message of the whole mission, except while the
    battery is low: then an open mismatch is dropped. It ends when the expected altitude is set, not
    when the visibility comes back.
    """

    def __init__(self, next_message_s: Callable[[float], float], altitude_m: float) -> None:
        self._next_message_s = next_message_s
        self._altitude_m = altitude_m
        self._expected_m: float | None = None
        self._battery_low = False
        self._recovering = False  # whether maintain_motion is active
        self._since_s: dict[str, float] = {}  # when each kind of event began that is open
        self.completed_s: list[float] = []

    def take(self, entry: _Entry) -> None:
        """Take an entry; they come in order of time."""
        match entry:
            case _Effect():
                self._mode_effect(*entry)
            case _Fitting():
                self._expected_m = entry.altitude_m
                self._compare_at(entry.t_s)
            case _BatteryLevel():
                self._battery(*entry)
            case _Failure():
                if not self._recovering:
                    self._since_s.setdefault("failure", entry.t_s)

    def _battery(self, t_s: float, low: bool) -> None:
        if low:
            self._since_s.setdefault("low battery", t_s)
            # one that is open is dropped; if it lasts, it begins anew afterwards
            self._since_s.pop("mismatch", None)
        elif self._battery_low:
            self._battery_low = False
            self._compare_at(self._next_message_s(t_s))
        self._battery_low = low

    def _mode_effect(self, t_s: float, function: str, mode: Mode) -> None:
        if function == MAINTAIN_MOTION:
            self._recovering = mode.active
        if not mode.active:
            return
        if function == MAINTAIN_MOTION:
            self._answer("failure", t_s)
        elif function == GENERATE_RECHARGE_PATH:
            self._answer("low battery", t_s)
        altitude = mode.parameters.get("spiral_altitude")
        if altitude is not None:
            self._altitude_m = float(altitude)
            if self._altitude_m == self._expected_m and "mismatch" in self._since_s:
                self._answer("mismatch", t_s)
            else:
                # The next message finds the mismatch, if there is one, though its value may not be
                # new; one at this very time came before.
                self._compare_at(self._next_message_s(t_s + _LATER_S))

    def _answer(self, kind: str, t_s: float) -> None:
        since_s = self._since_s.pop(kind, math.inf)
        if since_s < t_s or (since_s == t_s and kind != "mismatch"):
            self.completed_s.append(t_s - since_s)

    def _compare_at(self, message_s: float) -> None:
        if not self._battery_low:
            if self._expected_m not in (None, self._altitude_m):
                self._since_s.setdefault("mismatch", message_s)
            elif self._since_s.get("mismatch", -math.inf) >= message_s:
                del self._since_s["mismatch"]
