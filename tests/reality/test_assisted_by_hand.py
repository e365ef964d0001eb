"""Intervals, limits and units of assisted estimates, by hand."""

import math

import numpy as np
import pandas
import pytest
from scipy import stats

from suave_des.reality.assisted import (
    UNLIKE,
    AssistedComparison,
    assisted_mean,
    compare_assisted,
)
from suave_des.records.missions import missions_in


def test_an_estimated_weight_takes_a_degree_of_freedom():
    # PPI++, arXiv:2311.01453: var(real - weight same) / n + weight**2 var(population) / draws, and
    # what the assisted interval allows for conditions unlike these.
    real = np.array([52.0, 118, 83, 61, 97, 130, 75, 88, 143, 69, 110, 92])
    same = real + np.array([3.0, 3, -3, -4, 4, -3, 4, 5, -7, -3, 3, 7])
    many = np.linspace(50.0, 140.0, 20)
    found, weight = assisted_mean(real, same, many)
    of_population = np.var(many, ddof=1)
    unseen = max(np.var(real - weight * same, ddof=1), (1.0 - weight) ** 2 * of_population) / 12
    variance = unseen + weight**2 * (of_population / 20 + UNLIKE**2 * of_population)
    half = stats.t.ppf(0.9875, 10) * math.sqrt(variance)
    assert 0.0 < weight < 1.0
    assert found.high - found.low == pytest.approx(2.0 * half)


def found_in(
    shares: dict[str, list[int]], missions: int, seed: int, shift: int
) -> pandas.DataFrame:
    """Missions of managers under conditions, of which so many found the pipeline in each."""
    rows = [
        (manager, float(condition), run, run <= count)
        for manager, counts in shares.items()
        for condition, count in enumerate(counts)
        for run in range(1, missions + 1)
    ]
    frame = pandas.DataFrame(rows, columns=["manager", "start.y_m", "run", "pipeline_found"])
    times_s = (100.0 + frame["start.y_m"]).where(frame["pipeline_found"], 300.0 + shift)
    return frame.assign(scenario="s", seed=seed, search_time_s=times_s, distance_inspected_m=1.0)


def drawn(shares: dict[str, list[int]], last_y_m: float) -> pandas.DataFrame:
    """A population of ten draws, with starts from 0 to that of the last condition."""
    frame = found_in(shares, 1, 3, 0)
    number = frame["start.y_m"]
    return frame.assign(**{"run": number.astype(int) + 1, "start.y_m": number * last_y_m / 9.0})


def assisted(metric: str, shift: int = 0) -> AssistedComparison:
    """Real missions of a, which always finds the pipeline, and of b, which does in some conditions;
    their limit is written with a shift of so many seconds."""
    shares = {"a": [4, 4, 4, 4], "b": [0, 4, 1, 3]}
    real = found_in(shares, 4, 1, shift).drop(columns=["run", "seed"])
    same = found_in({"a": [3, 4, 4, 4], "b": [1, 3, 1, 3]}, 4, 2, 0)
    many = drawn({"a": [1] * 9 + [0], "b": [1, 0] * 5}, 3.0)
    simulated = [missions_in(same), missions_in(many)]
    return compare_assisted(missions_in(real), simulated, metrics=[metric])


def test_a_difference_of_shares_is_in_percentage_points_with_its_interval():
    estimates = assisted("pipeline_found")
    (sentence,) = (each for each in estimates.estimates["conclusion"] if "a - b" in each)
    assert "percentage points (95% interval -" in sentence and "% from" not in sentence
    (row,) = (
        row
        for section in estimates.sections()
        for row in section.tables[0].rows
        if row[0] == "a - b"
    )
    assert row[2].endswith(" points") and row[3].endswith(" points")


@pytest.mark.parametrize("shift", [0, 1])
def test_missions_that_are_lost_count_with_the_shorter_of_two_limits(shift):
    found = assisted("search_time_s", shift).estimates.set_index(["group", "other"])
    in_conditions = [300.0, 101.0, (102.0 + 3 * 300.0) / 4, (3 * 103.0 + 300.0) / 4]
    assert found.loc[("b", ""), "alone"] == pytest.approx(np.mean(in_conditions))


def test_real_missions_that_ended_early_count_with_the_limit():
    real = found_in({"a": [4, 0, 2]}, 4, 1, 0).drop(columns=["run", "seed"])
    real.loc[4, "search_time_s"] = 20.0  # the battery was empty
    same = found_in({"a": [4, 1, 2]}, 4, 2, 0)
    many = drawn({"a": [1] * 9 + [0]}, 2.0)
    simulated = [missions_in(same), missions_in(many)]
    found = compare_assisted(missions_in(real), simulated).estimates.set_index(["metric", "group"])
    in_conditions = [100.0, 300.0, (102.0 + 300.0) / 2]
    assert found.loc[("search_time_s", "a"), "alone"] == pytest.approx(np.mean(in_conditions))
