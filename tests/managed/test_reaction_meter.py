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


def seen(t_s: float, value: float) -> Timeline:
    """A visibility that is measured first, under which 3 m is set soon if it fits: after 0.5 s."""
    timeline = Timeline().visibility(t_s, value)
    return timeline.altitude(0.7, 3.0) if value >= 3.25 else timeline


THRUSTERS = {
    "reported until maintain_motion is active": (Timeline().thruster(35.0, "FALSE").mode(37.5, MOTION), [2.5]),
    "a second failure before the answer counts with the first": (
        Timeline().thruster(35.0, "FALSE").thruster(36.0, "FALSE", 2).mode(37.5, MOTION),
        [2.5],
    ),
    "a second failure after the answer is another reaction": (
        Timeline()
        .thruster(35.0, "FALSE")
        .mode(37.5, MOTION)
        .mode(50.0, MOTION, active=False)
        .thruster(60.0, "FALSE", 2)
        .mode(61.0, MOTION),
        [2.5, 1.0],
    ),
    # As in the fifth condition of the runs of 2025: the task changes before the thrusters are recovered.
    "a failure while maintain_motion is active asks for nothing more": (
        Timeline()
        .thruster(112.0, "FALSE")
        .mode(113.0, MOTION)
        .thruster(113.01, "FALSE", 3)
        .mode(119.7, MOTION, active=False)
        .mode(120.5, MOTION),
        [1.0],
    ),
    "once maintain_motion is inactive a failure is an event again": (
        Timeline().mode(10.0, MOTION).mode(20.0, MOTION, active=False).thruster(30.0, "FALSE").mode(34.0, MOTION),
        [4.0],
    ),
    "an answer at the time of the failure": (Timeline().thruster(35.0, "FALSE").mode(35.0, MOTION), [0.0]),
    "never answered": (Timeline().thruster(35.0, "FALSE").mode(40.0, MOTION, active=False), []),
    "a recovery": (Timeline().thruster(35.0, "RECOVERED").mode(40.0, MOTION), []),
}
ALTITUDE = {
    "the first message is a mismatch already": (seen(0.2, 3.75), [0.5]),
    "no mismatch if set at the time of the message": (Timeline().visibility(0.2, 3.75).altitude(0.2, 3.0), []),
    "no mismatch if two metres fit": (seen(0.2, 2.5).altitude(0.7, 2.0), []),
    "until the fitting altitude is set": (
        seen(0.2, 3.75).visibility(12.2, 3.2).altitude(14.0, 1.0).altitude(15.0, 2.0),
        [0.5, 2.8],
    ),
    "it does not clear when the visibility comes back": (
        seen(0.2, 3.75).visibility(12.2, 3.2).visibility(68.2, 3.3).visibility(92.2, 3.2).altitude(93.2, 2.0),
        [0.5, 81.0],
    ),
    "nor when it changes further": (
        seen(0.2, 3.75).visibility(12.2, 3.2).visibility(24.2, 2.2).altitude(25.2, 1.0),
        [0.5, 13.0],
    ),
    # As under the manager none: 1 m is set once, while 3 m would fit.
    "never answered": (
        Timeline().visibility(0.2, 3.75).altitude(0.5, 1.0).visibility(40.2, 1.3).visibility(60.2, 3.3),
        [],
    ),
    "one that does not fit is noticed at the next message, at 11.2 s, though its value is not new": (
        seen(0.2, 3.75).altitude(10.5, 1.0).altitude(13.2, 3.0),
        [0.5, 2.0],
    ),
    "no mismatch if put right before the next message": (
        seen(0.2, 3.75).altitude(10.5, 1.0).altitude(11.0, 3.0),
        [0.5],
    ),
    "nor if the next message finds it fitting": (
        seen(0.2, 3.75).altitude(11.5, 2.0).visibility(12.2, 3.2).altitude(13.0, 2.0),
        [0.5],
    ),
    "below all thresholds none is asked for": (seen(0.2, 1.0).altitude(1.2, 1.0).altitude(2.2, 2.0), []),
    "while following too": (
        seen(0.2, 3.75)
        .mode(10.0, SEARCH, active=False)
        .mode(10.0, "f_follow_pipeline")
        .visibility(12.2, 3.2)
        .altitude(50.2, 2.0),
        [0.5, 38.0],
    ),
}
BATTERY = {
    "low until the recharge path is active": (
        Timeline().battery(149.5, 0.2525).battery(150.5, 0.2475).battery(151.5, 0.2425).mode(152.0, RECHARGE),
        [1.5],
    ),
    "a quarter is not low": (Timeline().battery(150.0, 0.25).mode(152.0, RECHARGE), []),
    "altitude is not checked meanwhile": (
        seen(0.2, 3.75).battery(150.5, 0.2).visibility(155.2, 2.5).battery(160.5, 1.0).altitude(160.8, 2.0),
        [0.5],
    ),
    "it is checked again at the first message after recharging, at 161.2 s, whose value is not new": (
        seen(0.2, 3.75).battery(150.5, 0.2).visibility(155.2, 2.5).battery(160.5, 1.0).altitude(162.2, 2.0),
        [0.5, 1.0],
    ),
    "an open mismatch is dropped and begins anew afterwards, from 193.2 s": (
        seen(0.2, 3.75).visibility(141.2, 2.5).battery(150.5, 0.2).battery(192.5, 1.0).altitude(202.2, 2.0),
        [0.5, 9.0],
    ),
    "one that was dropped is not answered meanwhile": (
        seen(0.2, 3.75).visibility(141.2, 2.5).battery(150.5, 0.2).altitude(155.0, 2.0).battery(192.5, 1.0),
        [0.5],
    ),
    "a message that would have shown a mismatch comes too late": (
        seen(0.2, 3.75).altitude(150.3, 1.0).battery(150.5, 0.2).altitude(153.2, 3.0),
        [0.5],
    ),
}


@pytest.mark.parametrize(
    ("timeline", "reactions"),
    [
        pytest.param(*case, id=f"{kind}: {name}")
        for kind, cases in (("thrusters", THRUSTERS), ("altitude", ALTITUDE), ("battery", BATTERY))
        for name, case in cases.items()
    ],
)
def test_reactions(timeline: Timeline, reactions: list[float]) -> None:
    assert timeline.reactions == reactions


@pytest.mark.parametrize(
    ("visibility_m", "altitude_m"), [(3.25, 3.0), (3.24, 2.0), (2.25, 2.0), (2.24, 1.0), (1.25, 1.0)]
)
def test_altitude_that_fits_a_visibility(visibility_m: float, altitude_m: float) -> None:
    timeline = Timeline().altitude(0.1, 9.0).visibility(0.2, visibility_m).altitude(0.7, altitude_m)
    assert timeline.reactions == [0.5]
