"""Distributions: draws stay within what the scenario states, and use only their own stream."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from scipy.stats import expon, norm, uniform

from suave_des.errors import InputError
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.scenario.models import CurrentDistribution, Distribution, draw, mean, support
from suave_des.simulation.simulator import Simulator

ADAPTER: TypeAdapter[Distribution] = TypeAdapter(Distribution)
SCENARIO = load_scenario("seams2023")
NUMBERS = st.floats(-1e6, 1e6)


DISTRIBUTIONS = (
    st.fixed_dictionaries(
        {"distribution": st.just("normal"), "mean": NUMBERS, "std": st.floats(0, 1e3)},
        optional={"minimum": NUMBERS, "maximum": NUMBERS},
    )
    | st.fixed_dictionaries(
        {"distribution": st.just("uniform"), "minimum": NUMBERS, "maximum": NUMBERS}
    )
    | st.fixed_dictionaries(
        {"distribution": st.just("exponential"), "mean": st.floats(0, 1e3)},
        optional={"minimum": NUMBERS},
    )
    | st.fixed_dictionaries(
        {"distribution": st.just("choice"), "values": st.lists(NUMBERS, min_size=1)}
    )
)


@given(raw=DISTRIBUTIONS, seed=st.integers(0, 2**32))
def test_draws_stay_within_the_bounds(raw, seed):
    try:
        distribution = ADAPTER.validate_python(raw)
    except ValidationError as error:
        # What is refused has its bounds the wrong way round or far from the mean.
        assert {detail["type"] for detail in error.errors()} == {"wrong"}
        return
    chance = random.Random(seed)
    for _ in range(20):
        value = draw(distribution, chance)
        assert support(distribution)[0] <= value <= support(distribution)[1]
        assert value <= raw.get("maximum", float("inf"))
        if raw["distribution"] == "choice":
            assert value in raw["values"]


@pytest.mark.parametrize(
    "raw",
    [
        {"distribution": "normal", "mean": 1.0, "std": 2.0, "minimum": 0.0},
        {"distribution": "uniform", "minimum": 1.0, "maximum": 2.0},
        {"distribution": "exponential", "mean": 3.0},
        {"distribution": "choice", "values": [1.0, 2.0, 3.0]},
    ],
    ids=lambda raw: raw["distribution"],
)
def test_draws_repeat(raw):
    distribution, first, second = ADAPTER.validate_python(raw), random.Random(1), random.Random(1)
    assert [draw(distribution, first) for _ in range(20)] == [
        draw(distribution, second) for _ in range(20)
    ]


def test_a_narrow_interval_far_out_is_refused_rather_than_searched_for_ever():
    for bounds in ({"minimum": 5, "maximum": 6}, {"minimum": 0, "maximum": 0}):
        raw = {"distribution": "normal", "mean": 0, "std": 1, **bounds}
        try:
            ADAPTER.validate_python(raw)
        except ValidationError:
            continue
        raise AssertionError(f"{raw} was accepted")


def drawn_in_run(run: int, values: dict) -> dict[str, float]:
    return Simulator(with_values(SCENARIO, values)).run("none", run, seed=5).drawn


def two_failures(run: int, **more: str) -> tuple[float, float]:
    """Draw their times: of the first from 30 to 50 s, of the second 25 s later."""
    times = [
        {"distribution": "uniform", "minimum": 30 + by, "maximum": 50 + by, **more}
        for by in (0, 25)
    ]
    events = [
        {"thruster": number, "event": "failure", "time_s": time}
        for number, time in enumerate(times, 1)
    ]
    drawn = drawn_in_run(run, {"thruster_events": events})
    return drawn["thruster_events.0.time_s"], drawn["thruster_events.1.time_s"]


@pytest.mark.parametrize("run", range(1, 6))
def test_keys_of_a_shared_draw_are_shifted_alike(run):
    first, second = two_failures(run, shared="all_events")
    assert second - first == pytest.approx(25, abs=1e-9)
    assert 30 <= first <= 50


@pytest.mark.parametrize("run", range(1, 6))
def test_keys_of_draws_of_their_own_are_shifted_otherwise(run):
    first, second = two_failures(run)
    assert abs(second - first - 25) > 1e-3


def test_an_event_that_is_drawn_before_the_start_is_at_the_start():
    times = []
    for run in range(1, 9):
        time = {"distribution": "uniform", "minimum": -50, "maximum": 50}
        values = {"thruster_events": [{"thruster": 1, "event": "failure", "time_s": time}]}
        times.append(drawn_in_run(run, values)["thruster_events.0.time_s"])
    assert min(times) == 0 and max(times) > 0
    with pytest.raises(InputError, match="only values below 0 can be drawn"):
        drawn_in_run(
            1,
            {"thruster_events.0.time_s": {"distribution": "uniform", "minimum": -9, "maximum": -1}},
        )


@pytest.mark.parametrize("value", [-10.0, 10.0])
def test_a_value_may_be_either_end_of_what_is_allowed(value):
    adapter: TypeAdapter[CurrentDistribution] = TypeAdapter(CurrentDistribution)
    choice = {"distribution": "choice", "values": [value]}
    assert adapter.validate_python(value) == value
    assert adapter.validate_python(choice).values == (value,)
    with pytest.raises(ValidationError, match="out of range"):
        adapter.validate_python(1.001 * value)


@pytest.mark.parametrize(
    ("raw", "expected"),
    [
        ({"distribution": "exponential", "mean": 2.0, "minimum": 3.0}, expon(3.0, 2.0)),
        ({"distribution": "uniform", "minimum": -1.0, "maximum": 4.0}, uniform(-1.0, 5.0)),
        ({"distribution": "normal", "mean": 1.5, "std": 2.0}, norm(1.5, 2.0)),
    ],
)
def test_the_mean_is_that_of_scipy(raw, expected):
    assert mean(ADAPTER.validate_python(raw)) == pytest.approx(expected.mean(), rel=1e-12)
