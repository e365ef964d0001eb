"""Distributions: draws stay within what the scenario states, and use only their own stream."""

import random

from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from suave_des.scenario.quantities import Distribution, draw, stated, support

ADAPTER: TypeAdapter[Distribution] = TypeAdapter(Distribution)
NUMBERS = st.floats(-1e6, 1e6)


def test_a_number_is_its_own_value_and_draws_nothing():
    stream = random.Random(1)
    before = stream.getstate()
    assert draw(ADAPTER.validate_python(3), stream) == 3
    assert stream.getstate() == before


@given(
    raw=st.fixed_dictionaries(
        {"distribution": st.just("normal"), "mean": NUMBERS, "std": st.floats(0, 1e3)},
        optional={"minimum": NUMBERS, "maximum": NUMBERS},
    )
    | st.fixed_dictionaries({"distribution": st.just("uniform"), "minimum": NUMBERS, "maximum": NUMBERS})
    | st.fixed_dictionaries(
        {"distribution": st.just("exponential"), "mean": st.floats(0, 1e3)}, optional={"minimum": NUMBERS}
    )
    | st.fixed_dictionaries({"distribution": st.just("choice"), "values": st.lists(NUMBERS, min_size=1)}),
    seed=st.integers(0, 2**32),
)
def test_draws_repeat_and_stay_within_the_bounds(raw, seed):
    try:
        distribution = ADAPTER.validate_python(raw)
    except ValidationError as error:
        # What is refused has its bounds the wrong way round or far from the mean.
        assert {detail["type"] for detail in error.errors()} == {"wrong"}
        return
    first, second = random.Random(seed), random.Random(seed)
    for _ in range(20):
        value = draw(distribution, first)
        assert value == draw(distribution, second)
        assert support(distribution)[0] <= value <= support(distribution)[1]
        assert value <= raw.get("maximum", float("inf"))
        if raw["distribution"] == "choice":
            assert value in stated(distribution)


def test_a_narrow_interval_far_out_is_refused_rather_than_searched_for_ever():
    for bounds in ({"minimum": 5, "maximum": 6}, {"minimum": 0, "maximum": 0}):
        raw = {"distribution": "normal", "mean": 0, "std": 1, **bounds}
        try:
            ADAPTER.validate_python(raw)
        except ValidationError:
            continue
        raise AssertionError(f"{raw} was accepted")
