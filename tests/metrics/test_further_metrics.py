"""Further metrics: indecision, configurations, reasoning, area, thrusters; and partially satisfied
requirements.
"""

import itertools
import math

import numpy as np
import pytest
import simpy
from hypothesis import example, given
from hypothesis import strategies as st

from suave_des.errors import InputError
from suave_des.metrics.further import CELL_M, FurtherMetrics, covered_area_m2, measured_at_rows
from suave_des.monitor.thrusters import Thrusters
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import (
    FURTHER_METRICS,
    Requirement,
    ThrusterEvent,
    ThrusterFailureRevision,
)
from suave_des.scenario.modes import Mode
from suave_des.simulation.simulator import Simulator
from suave_des.vehicle.model import Autopilot, Pose
from suave_des.vehicle.vehicle import Vehicle, row_at
from tests.helpers.stand_ins import BLUEROV2, silent

TANGENT = math.tan(math.radians(30.0))


class Watched:
    """A vehicle at rest and what is noted of its mission, at times that the test sets."""

    def __init__(self) -> None:
        self.env = simpy.Environment()
        scenario = load_scenario("extended").scenario
        scenario = scenario.model_copy(
            update={"metrics": FURTHER_METRICS, "requirements": {}, "battery": None}
        )
        vehicle = Vehicle(BLUEROV2, Autopilot(), Pose(0.0, 0.0, -18.0, 0.0, 0.0, 0.0), 60.0)
        self.thrusters = Thrusters(self.env, vehicle, ThrusterFailureRevision(), silent)
        self.noted = FurtherMetrics(self.env, scenario, self.thrusters, {})

    def at(self, t_s: float) -> FurtherMetrics:
        if t_s > self.env.now:
            self.env.run(until=t_s)
        return self.noted

    def thruster(self, t_s: float, event: str) -> None:
        self.at(t_s)
        self.thrusters.apply(ThrusterEvent(thruster=2, event=event, time_s=t_s))


@pytest.mark.parametrize(
    ("changes", "undone"),
    [
        ([(0.0, "a", "b"), (4.0, "b", "a")], 1),
        ([(0.0, "a", "b"), (4.5, "b", "a")], 0),
        ([(0.0, "a", "b"), (2.0, "b", "c")], 0),
        ([(0.0, "a", "b"), (2.0, "b", "a"), (4.0, "a", "b")], 1),
        ([(0.0, "a", "b"), (2.0, "b", "a"), (4.0, "a", "b"), (6.0, "b", "a")], 2),
    ],
)
def test_a_change_taken_back_in_time_is_undone(changes, undone):
    watched = Watched()
    for t_s, before, after in changes:
        watched.at(t_s + 1.0).adapted("f", before, after)
    assert watched.noted.value("adaptations_undone") == undone


@pytest.mark.parametrize(
    ("effects", "configurations"),
    [
        ([(1.0, "f", "a"), (2.0, "g", "x"), (3.0, "f", "b")], [{"a"}, {"a", "x"}, {"b", "x"}]),
        (
            [(1.0, "f", "a"), (2.0, "g", "x"), (3.0, "f", "b"), (4.0, "f", "a")],
            [{"a"}, {"a", "x"}, {"b", "x"}],
        ),
        (
            [(1.0, "f", "a"), (2.0, "g", "x"), (3.0, "f", "b"), (3.0, "g", "y")],
            [{"a"}, {"a", "x"}, {"b", "y"}],
        ),
    ],
    ids=["each", "but once", "not what is passed through at one time"],
)
def test_configurations_are_counted(effects, configurations):
    watched = Watched()
    for t_s, function, mode in effects:
        watched.at(t_s).mode_effect(function, Mode(mode, True, {}))
    assert watched.at(7.0).value("configurations") == len(configurations)


def test_operational_thrusters_are_a_mean_over_time():
    watched = Watched()
    watched.thruster(10.0, "failure")
    watched.thruster(30.0, "recovery")
    assert watched.at(40.0).value("operational_thrusters") == pytest.approx(
        (10 * 6 + 20 * 5 + 10 * 6) / 40
    )


def track_of(*places: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    rows = np.repeat(np.array(places), 4, axis=0)  # each fourth row counts
    return rows, np.full(len(rows), 3.0)


def test_a_camera_at_rest_has_seen_one_square():
    track, visibility_m = track_of((0.0, 0.0, -18.0))
    side_m = 2 * 2.0 * TANGENT
    assert covered_area_m2(track, 3, visibility_m, -20.0, TANGENT) == pytest.approx(
        side_m**2, rel=0.1
    )


@given(
    st.lists(
        st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.0, 4.0)),
        min_size=1,
        max_size=12,
    )
)
@example([(0.0, 0.0, 1.0), (0.05, 0.0, 1.0), (0.0, 0.0, 1.0)])  # one view in the other, and back
@example([(0.0, 0.0, 1.0), (0.0, 0.0, 3.0), (0.3, 0.2, 2.0)])
@example([(-3.0, 0.0, 1.0), (3.0, 0.0, 1.0)])  # far apart
def test_the_area_is_that_of_all_cells_whose_centre_was_in_view(places):
    track, visibility_m = track_of(*((x, y, height - 20.0) for x, y, height in places))
    seen = [place for place in places if (place[2] - 20.0) + 20.0 <= 3.0]
    cells = set[tuple[int, int]]()
    if seen:
        x_m, y_m, height_m = np.array(seen).T
        half_m = ((height_m - 20.0) + 20.0) * TANGENT
        low = (x_m - half_m).min(), (y_m - half_m).min()
        for x, y, half in zip(x_m, y_m, half_m, strict=True):
            ranges = [
                range(
                    max(0, math.ceil((middle - half - least) / CELL_M - 0.5)),
                    math.floor((middle + half - least) / CELL_M - 0.5) + 1,
                )
                for middle, least in zip((x, y), low, strict=True)
            ]
            cells.update(itertools.product(*ranges))
    area_m2 = covered_area_m2(track, len(track) - 1, visibility_m, -20.0, TANGENT)
    assert area_m2 == pytest.approx(len(cells) * CELL_M**2)


@pytest.mark.parametrize("visibility_m", [1.9, math.nan])
def test_in_murky_water_nothing_is_seen(visibility_m):
    track, _ = track_of((0.0, 0.0, -18.0))
    assert covered_area_m2(track, 3, np.full(4, visibility_m), -20.0, TANGENT) == 0.0


def test_visibility_counts_as_it_was_measured_last():
    rows = measured_at_rows((0.2, 1.2, 2.2), (3.0, 2.0, 1.0), row_at(3.0))
    assert [rows[row_at(t_s)] for t_s in (0.2, 1.15, 1.2, 2.9)] == [3.0, 3.0, 2.0, 1.0]


@pytest.mark.parametrize("times_s", [(0.2,), ()], ids=["before the first measurement", "without"])
def test_there_is_no_visibility_before_it_is_measured(times_s):
    assert np.isnan(measured_at_rows(times_s, (3.0,) * len(times_s), 10)[:4]).all()


def test_what_is_measured_after_the_end_does_not_count():
    rows = measured_at_rows((0.0, 1.0, 99.0), (3.0, 2.0, 1.0), 40)
    assert rows.tolist() == [3.0] * 20 + [2.0] * 20


REQUIRED = st.builds(
    Requirement,
    metric=st.just("search_time_s"),
    relation=st.sampled_from(["at_least", "at_most", "close_to"]),
    value=st.floats(-9, 9),
    tolerance=st.floats(0, 9),
)


@given(REQUIRED, st.floats(-99, 99))
def test_satisfaction_is_a_degree(requirement, measured):
    assert 0.0 <= requirement.satisfaction(measured) <= 1.0


@given(REQUIRED)
def test_satisfaction_is_full_where_the_value_is_as_required(requirement):
    assert requirement.satisfaction(requirement.value) == 1.0


@pytest.mark.parametrize(
    ("relation", "measured", "degree"),
    [
        ("at_most", 130.0, 0.75),
        ("at_most", 160.0, 0.0),
        ("at_least", 90.0, 0.75),
        ("close_to", 140.0, 0.5),
    ],
)
def test_satisfaction_falls_in_a_line_over_the_tolerance(relation, measured, degree):
    value = {"at_most": 120.0, "at_least": 100.0, "close_to": 120.0}[relation]
    requirement = Requirement(
        metric="search_time_s", relation=relation, value=value, tolerance=40.0
    )
    assert requirement.satisfaction(measured) == pytest.approx(degree)


@pytest.mark.parametrize(
    ("relation", "measured", "tolerance", "degree"),
    [
        ("at_most", 130.0, 40.0, 0.7788008),  # exp(-1/4)
        ("at_most", 160.0, 40.0, 0.3678794),  # exp(-1)
        ("at_least", 60.0, 40.0, 0.2231302),  # exp(-3/2)
        ("close_to", 120.0, 40.0, 1.0),
        ("close_to", 121.0, 0.0, 0.0),
    ],
)
def test_satisfaction_may_fall_exponentially(relation, measured, tolerance, degree):
    requirement = Requirement(
        metric="search_time_s",
        relation=relation,
        value=120.0,
        tolerance=tolerance,
        decay="exponential",
    )
    assert requirement.satisfaction(measured) == pytest.approx(degree, abs=1e-7)


@pytest.fixture
def mission(tmp_path):
    def fly(text: str, manager: str = "none", run: int = 3):
        (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
        return Simulator(load_scenario(tmp_path / "mine.yaml")).run(manager, run=run, seed=1)

    return fly


def test_a_requirement_on_a_measured_value_is_a_mean_over_time(mission):
    text = (
        "base: release15.yaml\n"
        "signals: {water_visibility: {kind: step, before: 3.0, after: 1.0, time_s: 100}}\n"
        "requirements: {see: {attribute: water_visibility, relation: at_least, value: 2.0, tolerance: 2.0}}\n"
    )
    assert mission(text).further["requirement_see"] == pytest.approx(
        (100 * 1.0 + 200 * 0.5) / 300, abs=0.01
    )


def test_time_before_the_first_measurement_does_not_count(mission):
    signal = "{kind: constant, value: 3.0, publishing_period_s: 50}"
    required = "{attribute: water_visibility, relation: at_least, value: 2.0}"
    text = f"base: release15.yaml\nsignals: {{water_visibility: {signal}}}\nrequirements: {{see: {required}}}\n"
    assert mission(text).further["requirement_see"] == pytest.approx(1.0)


REASONING = "base: release15.yaml\nlatencies: {inference_s: 0.5}\nmetrics: [reasoning_time_s]\n"


def test_reasoning_takes_the_scenarios_time_in_each_cycle_that_adapts(mission):
    taken_s = mission(REASONING, "metacontrol").further["reasoning_time_s"]
    assert taken_s % 0.5 == 0.0 < taken_s


def test_who_does_not_reason_takes_no_time_for_it(mission):
    assert mission(REASONING, "none").further["reasoning_time_s"] == 0.0


def test_all_of_them_leave_the_mission_as_it_is(mission):
    metrics = ", ".join(name for name in FURTHER_METRICS if name != "surfacing_time_s")
    plain = mission("base: extended.yaml\nname: mine\nmetrics: []\n", "metacontrol")
    observed = mission(f"base: extended.yaml\nname: mine\nmetrics: [{metrics}]\n", "metacontrol")
    assert observed.metrics == plain.metrics
    assert set(observed.further) >= set(metrics.split(", "))


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("metrics: [area]", "'area' is not allowed"),
        ("metrics: [configurations, configurations]", "configurations is given twice"),
        ("metrics: [battery_level]", "battery_level needs a battery"),
        ("requirements: {a: {relation: at_least, value: 1}}", "is about no value, or about two"),
        (
            "requirements: {a: {metric: adaptations, relation: above, value: 1}}",
            "'above' is not allowed",
        ),
        (
            "requirements: {a: {attribute: water_current, relation: at_most, value: 1}}",
            "nothing measures water_current",
        ),
        (
            "requirements: {a: {metric: adaptations, relation: at_most, value: 1, tolerance: -1}}",
            "-1 should be greater than or equal to 0",
        ),
    ],
)
def test_what_cannot_be_evaluated_is_refused(mission, line, problem):
    with pytest.raises(InputError) as caught:
        mission(f"base: seams2023.yaml\n{line}\n")
    assert problem in caught.value.problem
    assert "line 2" in str(caught.value.place)
