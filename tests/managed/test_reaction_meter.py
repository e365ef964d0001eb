"""Reaction times of revision 1.5, against timelines worked out by hand.

Visibility messages come at 0.2, 1.2, 2.2, ... s; the altitude parameter is 2 m before any mode is set.
"""

from collections.abc import Callable

import numpy as np
import pytest
import simpy

from suave_des.metrics.reactions import ReactionMeter
from suave_des.monitor.diagnostics import Diagnostic, Kind
from suave_des.monitor.measurements import SignalMeasurements, Timing
from suave_des.scenario.models import ReactionMetric
from tests.helpers.stand_ins import ACTIVE, INACTIVE, spiral_at

SEARCH, MOTION, RECHARGE = "f_generate_search_path", "f_maintain_motion", "generate_recharge_path"


class Timeline:
    """Entries in order of time, each something measured or reported, or the effect of a mode."""

    def __init__(self) -> None:
        self._env = simpy.Environment()
        self._visibility: list[tuple[float, float]] = []
        self._battery: list[tuple[float, float]] = []
        self._noted: list[tuple[float, Callable[[ReactionMeter], None]]] = []

    def visibility(self, t_s: float, value: float) -> "Timeline":
        self._visibility.append((t_s, value))
        return self

    def battery(self, t_s: float, level: float) -> "Timeline":
        self._battery.append((t_s, level))
        return self

    def thruster(self, t_s: float, status: str, number: int = 1) -> "Timeline":
        report = Diagnostic(t_s, Kind.COMPONENT_STATUS, f"c_thruster_{number}", status)
        self._noted.append((t_s, lambda meter: meter.diagnostic(report)))
        return self

    def altitude(self, t_s: float, altitude_m: float) -> "Timeline":
        self._noted.append((t_s, lambda meter: meter.mode_effect(SEARCH, spiral_at(altitude_m))))
        return self

    def mode(self, t_s: float, function: str, *, active: bool = True) -> "Timeline":
        self._noted.append((t_s, lambda meter: meter.mode_effect(function, ACTIVE if active else INACTIVE)))
        return self

    @property
    def meter(self) -> ReactionMeter:
        """The meter after all entries."""
        visibility = _measurements("water_visibility", self._visibility, 0.2)
        battery = _measurements("battery_level", self._battery, 0.5) if self._battery else None
        meter = ReactionMeter(self._env, ReactionMetric(), visibility, 2.0, battery)
        for t_s, note in self._noted:
            if t_s > self._env.now:
                self._env.run(until=t_s)
            note(meter)
        self._env.run(until=1000.0)
        return meter

    @property
    def reactions(self) -> list[float]:
        return [pytest.approx(reaction, abs=1e-9) for reaction in self.meter.reactions_s()]


def _measurements(key: str, rows: list[tuple[float, float]], phase_s: float) -> SignalMeasurements:
    times_s, values = [t_s for t_s, _ in rows], [value for _, value in rows]
    arrays = np.array(times_s), np.array(values)
    return SignalMeasurements(key, lambda t_s: 0.0, Timing(1.0, phase_s), times_s, values, arrays)


def test_without_reactions_there_is_no_mean() -> None:
    assert Timeline().meter.mean_s() is None


def test_mean_is_over_all_kinds_of_reaction() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(1.2, 3.0).thruster(35.0, "FALSE").mode(38.0, MOTION)
    assert timeline.meter.mean_s() == pytest.approx((1.0 + 3.0) / 2)


# Thrusters


def test_failure_reported_until_maintain_motion_is_active() -> None:
    assert Timeline().thruster(35.0, "FALSE").mode(37.5, MOTION).reactions == [2.5]


def test_a_second_failure_before_the_answer_counts_with_the_first() -> None:
    timeline = Timeline().thruster(35.0, "FALSE").thruster(36.0, "FALSE", 2).mode(37.5, MOTION)
    assert timeline.reactions == [2.5]


def test_a_second_failure_after_the_answer_is_another_reaction() -> None:
    timeline = Timeline().thruster(35.0, "FALSE").mode(37.5, MOTION).mode(50.0, MOTION, active=False)
    assert timeline.thruster(60.0, "FALSE", 2).mode(61.0, MOTION).reactions == [2.5, 1.0]


def test_a_failure_while_maintain_motion_is_active_asks_for_nothing_more() -> None:
    # As in the fifth condition of the runs of 2025: the task changes before the thrusters are recovered.
    timeline = Timeline().thruster(112.0, "FALSE").mode(113.0, MOTION).thruster(113.01, "FALSE", 3)
    assert timeline.mode(119.7, MOTION, active=False).mode(120.5, MOTION).reactions == [1.0]


def test_once_maintain_motion_is_inactive_a_failure_is_an_event_again() -> None:
    timeline = Timeline().mode(10.0, MOTION).mode(20.0, MOTION, active=False).thruster(30.0, "FALSE").mode(34.0, MOTION)
    assert timeline.reactions == [4.0]


def test_an_answer_at_the_time_of_the_failure_is_a_reaction_of_no_time() -> None:
    assert Timeline().thruster(35.0, "FALSE").mode(35.0, MOTION).reactions == [0.0]


def test_a_failure_never_answered_does_not_count() -> None:
    assert Timeline().thruster(35.0, "FALSE").mode(40.0, MOTION, active=False).reactions == []


def test_a_recovery_asks_for_no_reaction() -> None:
    assert Timeline().thruster(35.0, "RECOVERED").mode(40.0, MOTION).reactions == []


# Altitude


def test_the_first_message_is_a_mismatch_already() -> None:
    assert Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0).reactions == [0.5]


def test_an_altitude_set_at_the_time_of_the_message_was_no_mismatch() -> None:
    assert Timeline().visibility(0.2, 3.75).altitude(0.2, 3.0).reactions == []


def test_unless_two_metres_fit() -> None:
    assert Timeline().visibility(0.2, 2.5).altitude(0.7, 2.0).reactions == []


@pytest.mark.parametrize(
    ("visibility_m", "altitude_m"), [(3.25, 3.0), (3.24, 2.0), (2.25, 2.0), (2.24, 1.0), (1.25, 1.0)]
)
def test_altitude_that_fits_a_visibility(visibility_m: float, altitude_m: float) -> None:
    timeline = Timeline().altitude(0.1, 9.0).visibility(0.2, visibility_m).altitude(0.7, altitude_m)
    assert timeline.reactions == [0.5]


def test_mismatch_lasts_until_the_fitting_altitude_is_set() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0)
    timeline.visibility(12.2, 3.2).altitude(14.0, 1.0).altitude(15.0, 2.0)
    assert timeline.reactions == [0.5, 2.8]


def test_mismatch_does_not_clear_when_the_visibility_comes_back() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0)
    timeline.visibility(12.2, 3.2).visibility(68.2, 3.3).visibility(92.2, 3.2).altitude(93.2, 2.0)
    assert timeline.reactions == [0.5, 81.0]


def test_nor_when_it_changes_further() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0)
    timeline.visibility(12.2, 3.2).visibility(24.2, 2.2).altitude(25.2, 1.0)
    assert timeline.reactions == [0.5, 13.0]


def test_a_mismatch_never_answered_does_not_count() -> None:
    # As under the manager none: 1 m is set once, while 3 m would fit.
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.5, 1.0).visibility(40.2, 1.3).visibility(60.2, 3.3)
    assert timeline.reactions == []


def test_setting_an_altitude_that_does_not_fit_is_noticed_at_the_next_message_though_its_value_is_not_new() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0)
    timeline.altitude(10.5, 1.0).altitude(13.2, 3.0)
    assert timeline.reactions == [0.5, 2.0]  # from the message at 11.2 s


def test_an_altitude_put_right_before_the_next_message_was_no_mismatch() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0)
    timeline.altitude(10.5, 1.0).altitude(11.0, 3.0)
    assert timeline.reactions == [0.5]


def test_nor_one_that_the_next_message_finds_fitting() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0)
    timeline.altitude(11.5, 2.0).visibility(12.2, 3.2).altitude(13.0, 2.0)
    assert timeline.reactions == [0.5]


def test_below_all_thresholds_no_altitude_fits_and_none_is_asked_for() -> None:
    timeline = Timeline().visibility(0.2, 1.0).altitude(1.2, 1.0).altitude(2.2, 2.0)
    assert timeline.reactions == []


def test_altitude_is_checked_while_following_too() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0)
    timeline.mode(10.0, SEARCH, active=False).mode(10.0, "f_follow_pipeline")
    timeline.visibility(12.2, 3.2).altitude(50.2, 2.0)
    assert timeline.reactions == [0.5, 38.0]


# Battery


def test_low_battery_until_the_recharge_path_is_active() -> None:
    timeline = Timeline().battery(149.5, 0.2525).battery(150.5, 0.2475).battery(151.5, 0.2425).mode(152.0, RECHARGE)
    assert timeline.reactions == [1.5]


def test_a_quarter_is_not_low() -> None:
    assert Timeline().battery(150.0, 0.25).mode(152.0, RECHARGE).reactions == []


def test_altitude_is_not_checked_while_the_battery_is_low() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0).battery(150.5, 0.2)
    timeline.visibility(155.2, 2.5).battery(160.5, 1.0).altitude(160.8, 2.0)
    assert timeline.reactions == [0.5]


def test_altitude_is_checked_again_at_the_first_message_after_recharging() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0).battery(150.5, 0.2)
    timeline.visibility(155.2, 2.5).battery(160.5, 1.0).altitude(162.2, 2.0)
    assert timeline.reactions == [0.5, 1.0]  # from the message at 161.2 s, whose value is not new


def test_an_open_mismatch_is_dropped_by_a_low_battery_and_begins_anew_afterwards() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0).visibility(141.2, 2.5).battery(150.5, 0.2)
    timeline.battery(192.5, 1.0).altitude(202.2, 2.0)
    assert timeline.reactions == [0.5, 9.0]  # from 193.2 s, and not the 61 s from 141.2 s


def test_a_mismatch_that_a_low_battery_dropped_is_not_answered_meanwhile() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0).visibility(141.2, 2.5).battery(150.5, 0.2)
    assert timeline.altitude(155.0, 2.0).battery(192.5, 1.0).reactions == [0.5]


def test_a_message_that_would_have_shown_a_mismatch_comes_too_late_for_a_low_battery() -> None:
    timeline = Timeline().visibility(0.2, 3.75).altitude(0.7, 3.0)
    timeline.altitude(150.3, 1.0).battery(150.5, 0.2).altitude(153.2, 3.0)
    assert timeline.reactions == [0.5]
