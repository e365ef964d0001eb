"""The recorder: which of what is measured and set it keeps, and as what."""

import numpy as np
import pytest
import simpy

from suave_des.events import Said
from suave_des.metrics.recording import Recorder, Trajectory, _Series
from suave_des.metrics.result import Event
from suave_des.monitor.diagnostics import HULL, LEAK, Diagnostic, Kind
from suave_des.scenario.models import ReactionMetric
from tests.helpers.stand_ins import ACTIVE, INACTIVE, spiral_at

METRIC = ReactionMetric(
    visibility_thresholds_m=(3.0, 2.0), expected_altitudes_m=(2.0, 1.0), battery_limit=0.25
)
SEARCH, MOTION = "f_generate_search_path", "f_maintain_motion"


@pytest.fixture
def recorder() -> Recorder:
    return Recorder(simpy.Environment(7.0), True, METRIC)


def measured(recorder: Recorder, key: str, *values: float) -> list[tuple[str, str]]:
    """Names and details of the events after these values were measured."""
    for value in values:
        recorder.diagnostic(Diagnostic(7.0, Kind.QA_STATUS, key, value))
    return [(event.event, event.detail) for event in recorder.events]


def test_an_event_has_the_mission_time(recorder):
    recorder.log("m", Said("thinks", "long"))
    assert recorder.events == [Event(7.0, "m", "thinks", "long")]


def test_one_that_is_not_enabled_keeps_nothing(recorder):
    recorder.enabled = False
    recorder.log("m", Said("thinks", "long"))
    assert recorder.events == []


@pytest.mark.parametrize(
    ("values", "last"),
    [
        ([2.5], ("first_measurement", "2.50 m")),
        ([2.5, 3.0], ("visibility_crossing", "rises to 3 m (3.00 m)")),
        ([2.5, 1.99], ("visibility_crossing", "falls below 2 m (1.99 m)")),
        ([1.0, 3.5], ("visibility_crossing", "rises to 3 m (3.50 m)")),
        ([3.5, 1.0], ("visibility_crossing", "falls below 2 m (1.00 m)")),
    ],
    ids=["first", "on the upper limit", "below the lower", "up over both", "down over both"],
)
def test_of_the_visibility_what_crosses_a_limit_is_kept_after_the_first_value(
    recorder, values, last
):
    assert measured(recorder, "water_visibility", *values)[-1] == last


def test_a_value_between_the_same_limits_is_not_kept(recorder):
    assert len(measured(recorder, "water_visibility", 2.0, 2.5, 2.99)) == 1


def test_the_battery_s_level_crosses_its_limit(recorder):
    events = measured(recorder, "battery_level", 0.5, 0.2)
    assert events[-1] == ("battery_crossing", "falls below 0.25 (0.20)")


def test_visibility_does_not_count_as_the_battery_s_level(recorder):
    measured(recorder, "water_visibility", 2.5)
    assert measured(recorder, "battery_level", 0.2)[-1] == ("first_measurement", "0.20")


def test_what_the_metric_does_not_use_is_not_kept(recorder):
    assert measured(recorder, "noise_level", 1.0) == []


@pytest.mark.parametrize(
    ("component", "status", "monitor"),
    [("c_thruster_1", "FALSE", "thruster_monitor"), (HULL, LEAK, "leak_monitor")],
)
def test_a_component_s_report_is_of_its_monitor(recorder, component, status, monitor):
    recorder.diagnostic(Diagnostic(7.0, Kind.COMPONENT_STATUS, component, status))
    assert recorder.events == [Event(7.0, monitor, "component_status", f"{component} {status}")]


# States of knowledge.


@pytest.mark.parametrize(
    ("states", "kept"), [("aab", "ab"), ("aba", "aba")], ids=["repeated", "again later"]
)
def test_a_state_is_kept_if_it_differs_from_the_one_before(recorder, states, kept):
    for state in states:
        recorder.log_state(state)
    assert "".join(record.state for record in recorder.knowledge) == kept


# The mode of a trajectory.

LOW = spiral_at(1.0)


@pytest.mark.parametrize(
    ("effects", "last"),
    [
        ([(SEARCH, LOW)], "at_1"),
        ([(SEARCH, INACTIVE)], "fd_unground"),
        ([(SEARCH, LOW), (SEARCH, INACTIVE)], "fd_unground"),
        ([(SEARCH, LOW), ("f_follow_pipeline", INACTIVE)], "at_1"),
        ([(SEARCH, LOW), ("f_follow_pipeline", ACTIVE)], "active"),
        ([(SEARCH, LOW), (MOTION, ACTIVE)], "at_1"),
    ],
    ids=[
        "the first",
        "the first although it does not move it",
        "of the function that moves it",
        "the end of one that does not",
        "another that moves it from now on",
        "of one that never does",
    ],
)
def test_the_mode_is_that_of_the_function_that_moves_the_vehicle(recorder, effects, last):
    for function, mode in effects:
        recorder.mode_effect(function, mode)
    assert recorder._modes[-1][1] == last


# Points.

POSES = np.array(
    [[x_m, 0.0, -5.0, 1.0, 0.0, 0.0, 0.0] for x_m in (0.0, 1.0, 2.0)]  # level, as a quaternion
)


@pytest.fixture
def trajectory() -> Trajectory:
    """Three points, 0.2 s apart."""
    return Trajectory(
        POSES,
        modes=_Series((0.0, 0.2), ("", "fd_spiral_low")),
        visibility=_Series((0.3,), (2.5,)),
        further={"battery_level": _Series((0.0, 0.4), (1.0, 0.9))},
    )


@pytest.mark.parametrize(
    ("column", "values"),
    [
        ("t_s", [0.0, 0.2, 0.4]),
        ("x_m", [0.0, 1.0, 2.0]),
        ("yaw_rad", [0.0, 0.0, 0.0]),
        ("mode", ["", "fd_spiral_low", "fd_spiral_low"]),
        ("visibility_m", [None, None, 2.5]),
        ("further", [{"battery_level": level} for level in (1.0, 1.0, 0.9)]),
    ],
)
def test_a_point_has_what_holds_at_its_time(trajectory, column, values):
    assert [getattr(point, column) for point in trajectory] == values
