"""Mean reaction time, the metric of revision 1.5's metrics node (facts: kas-lab/suave, revision 1.5)."""

from __future__ import annotations

import simpy

from suave_des.managed.coordinator import MAINTAIN_MOTION
from suave_des.managed.recharge import RECHARGE
from suave_des.managed.search import INITIAL_ALTITUDE_M
from suave_des.monitor.diagnostics import FAILED, Diagnostic, Kind
from suave_des.monitor.monitors import Measurements
from suave_des.scenario.models import ReactionMetric
from suave_des.scenario.modes import Mode


class ReactionMeter:
    """Times from an event that asks for an adaptation to the adaptation's effect.

    Three kinds of event: a thruster failure is reported, until maintain_motion is active; the measured visibility does
    not fit the search altitude, until the fitting altitude is set; the battery is low, until the recharge path is
    active. An event that is never answered does not count.

    The altitude is compared at every visibility message of the whole mission, except while the battery is low. A
    mismatch ends only when the expected altitude is set, not when the visibility comes back.

    Args:
        env: the mission's clock.
        settings: thresholds and altitudes.
        visibility: says when the next visibility message comes, changed or not.
    """

    def __init__(self, env: simpy.Environment, settings: ReactionMetric, visibility: Measurements) -> None:
        self._env = env
        self._settings = settings
        self._visibility = visibility
        self._altitude_m = INITIAL_ALTITUDE_M
        self._expected_m: float | None = None
        self._battery_low = False
        self._failure_since_s: float | None = None
        self._mismatch_since_s: float | None = None
        self._low_battery_since_s: float | None = None
        self.reactions_s: list[float] = []

    @property
    def mean_s(self) -> float | None:
        """Mean of the completed reactions; none if there was none."""
        return sum(self.reactions_s) / len(self.reactions_s) if self.reactions_s else None

    def diagnostic(self, diagnostic: Diagnostic) -> None:
        """Take a diagnostic from the bus."""
        if diagnostic.kind == Kind.COMPONENT_STATUS:
            if diagnostic.value == FAILED and self._failure_since_s is None:
                self._failure_since_s = self._env.now
        elif diagnostic.key == "battery_level":
            self._battery(low=float(diagnostic.value) < self._settings.battery_limit)
        elif diagnostic.key == "water_visibility":
            self._expected_m = self._fitting_altitude_m(float(diagnostic.value))
            self._compare_at(self._env.now)

    def _battery(self, *, low: bool) -> None:
        if low and self._low_battery_since_s is None:
            self._low_battery_since_s = self._env.now
        if low and self._mismatch_since_s is not None and self._mismatch_since_s > self._env.now:
            self._mismatch_since_s = None  # the message that would have shown it comes too late
        if self._battery_low and not low:
            self._battery_low = False
            self._compare_at(self._visibility.next_message_s(self._env.now))
        self._battery_low = low

    def mode_effect(self, function: str, mode: Mode) -> None:
        """Take note that a mode has taken effect."""
        if not mode.active:
            return
        if function == MAINTAIN_MOTION and self._failure_since_s is not None:
            self._complete(self._failure_since_s)
            self._failure_since_s = None
        elif function == RECHARGE and self._low_battery_since_s is not None:
            self._complete(self._low_battery_since_s)
            self._low_battery_since_s = None
        altitude = mode.parameters.get("spiral_altitude")
        if altitude is not None:
            self._altitude_m = float(altitude)
            if self._mismatch_since_s is not None and self._altitude_m == self._expected_m:
                if self._mismatch_since_s < self._env.now:
                    self._complete(self._mismatch_since_s)
                self._mismatch_since_s = None
            else:
                # The next message finds the mismatch, if there is one, though its value may not be new.
                self._compare_at(self._visibility.next_message_s(self._env.now))

    def _compare_at(self, message_s: float) -> None:
        if self._battery_low or self._expected_m is None:
            return
        fits = self._altitude_m == self._expected_m
        if self._mismatch_since_s is None and not fits:
            self._mismatch_since_s = message_s
        elif fits and self._mismatch_since_s is not None and self._mismatch_since_s >= message_s:
            self._mismatch_since_s = None

    def _complete(self, since_s: float) -> None:
        self.reactions_s.append(self._env.now - since_s)

    def _fitting_altitude_m(self, visibility_m: float) -> float | None:
        pairs = zip(self._settings.visibility_thresholds_m, self._settings.expected_altitudes_m, strict=True)
        return next((altitude for threshold, altitude in pairs if visibility_m >= threshold), None)
