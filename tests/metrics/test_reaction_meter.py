"""Reaction times of revision 1.5, against timelines worked out by hand.

Visibility messages come at 0.2, 1.2, 2.2, ... s; the altitude parameter is 2 m before any mode is
set.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import simpy

from suave_des.metrics.reactions import ReactionMeter
from suave_des.monitor.diagnostics import Diagnostic, Kind
from suave_des.monitor.measurements import Measurements, Timing
from suave_des.scenario.models import ReactionMetric
from tests.helpers.stand_ins import ACTIVE, INACTIVE, spiral_at

SEARCH, MOTION, RECHARGE = "f_generate_search_path", "f_maintain_motion", "generate_recharge_path"


@dataclass(frozen=True)
class Entry:
    """Something that is measured or reported, or a mode's effect, at a time."""

    t_s: float
    visibility_m: float | None = None
    level: float | None = None
    note: Callable[[ReactionMeter], None] | None = None


def sees(t_s: float, visibility_m: float) -> Entry:
    return Entry(t_s, visibility_m=visibility_m)


def has(t_s: float, level: float) -> Entry:
    return Entry(t_s, level=level)


def reports(t_s: float, status: str, number: int = 1) -> Entry:
    report = Diagnostic(t_s, Kind.COMPONENT_STATUS, f"c_thruster_{number}", status)
    return Entry(t_s, note=lambda meter: meter.diagnostic(report))


def flies(t_s: float, altitude_m: float) -> Entry:
    return Entry(t_s, note=lambda meter: meter.mode_effect(SEARCH, spiral_at(altitude_m)))


def begins(t_s: float, function: str) -> Entry:
    return Entry(t_s, note=lambda meter: meter.mode_effect(function, ACTIVE))


def ends(t_s: float, function: str) -> Entry:
    return Entry(t_s, note=lambda meter: meter.mode_effect(function, INACTIVE))


def meter_after(*entries: Entry) -> ReactionMeter:
    """The meter after all entries, in their order."""
    env = simpy.Environment()
    visibility = [
        (each.t_s, each.visibility_m) for each in entries if each.visibility_m is not None
    ]
    levels = [(each.t_s, each.level) for each in entries if each.level is not None]
    battery = _measurements("battery_level", levels, 0.5) if levels else None
    meter = ReactionMeter(
        env, ReactionMetric(), _measurements("water_visibility", visibility, 0.2), 2.0, battery
    )
    for each in entries:
        if each.note is not None:
            if each.t_s > env.now:
                env.run(until=each.t_s)
            each.note(meter)
    env.run(until=1000.0)
    return meter


def _measurements(key: str, rows: list[tuple[float, float]], phase_s: float) -> Measurements:
    times_s, values = [t_s for t_s, _ in rows], [value for _, value in rows]
    arrays = np.array(times_s), np.array(values)
    return Measurements(key, lambda t_s: 0.0, Timing(1.0, phase_s), times_s, values, arrays)


def test_mean_is_over_all_kinds_of_reaction_if_there_are_some():
    assert meter_after().mean_s() is None
    meter = meter_after(
        sees(0.2, 3.75), flies(1.2, 3.0), reports(35.0, "FALSE"), begins(38.0, MOTION)
    )
    assert meter.mean_s() == pytest.approx((1.0 + 3.0) / 2)


CLEAR = (sees(0.2, 3.75), flies(0.7, 3.0))
"""A visibility under which 3 m is set soon: after 0.5 s."""
THRUSTERS = {
    "reported until maintain_motion is active": (
        [reports(35.0, "FALSE"), begins(37.5, MOTION)],
        [2.5],
    ),
    "a second failure before the answer counts with the first": (
        [reports(35.0, "FALSE"), reports(36.0, "FALSE", 2), begins(37.5, MOTION)],
        [2.5],
    ),
    "a second failure after the answer is another reaction": (
        [
            *(reports(35.0, "FALSE"), begins(37.5, MOTION), ends(50.0, MOTION)),
            *(reports(60.0, "FALSE", 2), begins(61.0, MOTION)),
        ],
        [2.5, 1.0],
    ),
    # As in the fifth condition of the runs of 2025: the task changes before the thrusters are
    # recovered.
    "a failure while maintain_motion is active asks for nothing more": (
        [
            *(reports(112.0, "FALSE"), begins(113.0, MOTION), reports(113.01, "FALSE", 3)),
            *(ends(119.7, MOTION), begins(120.5, MOTION)),
        ],
        [1.0],
    ),
    "once maintain_motion is inactive a failure is an event again": (
        [begins(10.0, MOTION), ends(20.0, MOTION), reports(30.0, "FALSE"), begins(34.0, MOTION)],
        [4.0],
    ),
    "an answer at the time of the failure": ([reports(35.0, "FALSE"), begins(35.0, MOTION)], [0.0]),
    "never answered": ([reports(35.0, "FALSE"), ends(40.0, MOTION)], []),
    "a recovery": ([reports(35.0, "RECOVERED"), begins(40.0, MOTION)], []),
}
ALTITUDE = {
    "the first message is a mismatch already": (CLEAR, [0.5]),
    "no mismatch if set at the time of the message": ([sees(0.2, 3.75), flies(0.2, 3.0)], []),
    "no mismatch if two metres fit": ([sees(0.2, 2.5), flies(0.7, 2.0)], []),
    "until the fitting altitude is set": (
        [*CLEAR, sees(12.2, 3.2), flies(14.0, 1.0), flies(15.0, 2.0)],
        [0.5, 2.8],
    ),
    "it does not clear when the visibility comes back": (
        [*CLEAR, sees(12.2, 3.2), sees(68.2, 3.3), sees(92.2, 3.2), flies(93.2, 2.0)],
        [0.5, 81.0],
    ),
    "nor when it changes further": (
        [*CLEAR, sees(12.2, 3.2), sees(24.2, 2.2), flies(25.2, 1.0)],
        [0.5, 13.0],
    ),
    # As under the manager none: 1 m is set once, while 3 m would fit.
    "never answered": ([sees(0.2, 3.75), flies(0.5, 1.0), sees(40.2, 1.3), sees(60.2, 3.3)], []),
    "one that does not fit is noticed at the next message, at 11.2 s, though its value is not new": (
        [*CLEAR, flies(10.5, 1.0), flies(13.2, 3.0)],
        [0.5, 2.0],
    ),
    "no mismatch if put right before the next message": (
        [*CLEAR, flies(10.5, 1.0), flies(11.0, 3.0)],
        [0.5],
    ),
    "the next message is not one at the very time": (
        [*CLEAR, flies(11.2, 1.0), flies(13.2, 3.0)],
        [0.5, 1.0],
    ),
    "nor one that asks for none": (
        [*CLEAR, flies(11.9, 1.0), sees(12.2, 1), sees(42.2, 3.6), flies(52.2, 3)],
        [0.5, 10],
    ),
    "nor if the next message finds it fitting": (
        [*CLEAR, flies(11.5, 2.0), sees(12.2, 3.2), flies(13.0, 2.0)],
        [0.5],
    ),
    "below all thresholds none is asked for": (
        [sees(0.2, 1.0), flies(1.2, 1.0), flies(2.2, 2.0)],
        [],
    ),
    "while following too": (
        [
            *CLEAR,
            ends(10.0, SEARCH),
            begins(10.0, "f_follow_pipeline"),
            sees(12.2, 3.2),
            flies(50.2, 2.0),
        ],
        [0.5, 38.0],
    ),
}
BATTERY = {
    "low until the recharge path is active": (
        [has(149.5, 0.2525), has(150.5, 0.2475), has(151.5, 0.2425), begins(152.0, RECHARGE)],
        [1.5],
    ),
    "a quarter is not low": ([has(150.0, 0.25), begins(152.0, RECHARGE)], []),
    "altitude is not checked meanwhile": (
        [*CLEAR, has(150.5, 0.2), sees(155.2, 2.5), has(160.5, 1.0), flies(160.8, 2.0)],
        [0.5],
    ),
    "it is checked again at the first message after recharging, at 161.2 s, whose value is not new": (
        [*CLEAR, has(150.5, 0.2), sees(155.2, 2.5), has(160.5, 1.0), flies(162.2, 2.0)],
        [0.5, 1.0],
    ),
    "an open mismatch is dropped and begins anew afterwards, from 193.2 s": (
        [*CLEAR, sees(141.2, 2.5), has(150.5, 0.2), has(192.5, 1.0), flies(202.2, 2.0)],
        [0.5, 9.0],
    ),
    "one that was dropped is not answered meanwhile": (
        [*CLEAR, sees(141.2, 2.5), has(150.5, 0.2), flies(155.0, 2.0), has(192.5, 1.0)],
        [0.5],
    ),
    "a message that would have shown a mismatch comes too late": (
        [*CLEAR, flies(150.3, 1.0), has(150.5, 0.2), flies(153.2, 3.0)],
        [0.5],
    ),
}


@pytest.mark.parametrize(
    ("entries", "reactions"),
    [
        pytest.param(*case, id=f"{kind}: {name}")
        for kind, cases in (("thrusters", THRUSTERS), ("altitude", ALTITUDE), ("battery", BATTERY))
        for name, case in cases.items()
    ],
)
def test_reactions(entries, reactions):
    assert meter_after(*entries).reactions_s() == pytest.approx(reactions, abs=1e-9)


@pytest.mark.parametrize(
    ("visibility_m", "altitude_m"),
    [(3.25, 3.0), (3.24, 2.0), (2.25, 2.0), (2.24, 1.0), (1.25, 1.0)],
)
def test_altitude_that_fits_a_visibility(visibility_m, altitude_m):
    meter = meter_after(flies(0.1, 9.0), sees(0.2, visibility_m), flies(0.7, altitude_m))
    assert meter.reactions_s() == pytest.approx([0.5])
