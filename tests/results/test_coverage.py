"""The intervals of `compare` hold the true value about as often as they say, also for few and skewed values."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from suave_des.results.statistics import difference_interval, mean_interval, paired_share_difference

MEAN_S = 0.9 * (0.6 * 90.0 + 0.4 * 180.0) + 0.1 * 300.0


def search_times(chance: np.random.Generator, n: int, delay_s: float = 0.0) -> NDArray[np.float64]:
    """Draw times with the shape of a campaign's: found early or late, and one in ten lost at the limit."""
    times_s = np.where(chance.random(n) < 0.6, chance.normal(90.0, 20.0, n), chance.normal(180.0, 25.0, n))
    return np.where(chance.random(n) < 0.1, 300.0, times_s) + delay_s


def coverage_of_means(n: int, repetitions: int) -> float:
    chance = np.random.default_rng(1)
    covered = 0
    for _ in range(repetitions):
        low, high = mean_interval(search_times(chance, n)).interval or (np.nan, np.nan)
        covered += bool(low <= MEAN_S <= high)
    return covered / repetitions


def coverage_of_differences(n: int, m: int, repetitions: int) -> float:
    chance = np.random.default_rng(2)
    covered = 0
    for _ in range(repetitions):
        found = difference_interval(search_times(chance, n, 12.0), search_times(chance, m))
        low, high = found.interval or (np.nan, np.nan)
        covered += bool(low <= 12.0 <= high)
    return covered / repetitions


def test_intervals_of_a_mean_and_of_a_difference_cover_the_truth() -> None:
    # Of 80 intervals of exactly 95%, 69 or more cover in all but one of a thousand draws.
    assert coverage_of_means(40, 80) >= 69 / 80
    assert coverage_of_differences(40, 60, 80) >= 69 / 80


def test_intervals_cover_the_truth_where_most_runs_differ_little_and_a_few_by_far() -> None:
    chance = np.random.default_rng(3)
    covered = 0
    for _ in range(200):
        differences = chance.normal(5.0, 2.0, 60) + np.where(chance.random(60) < 0.05, 80.0, 0.0)
        differences -= np.where(chance.random(60) < 0.05, 80.0, 0.0)
        low, high = mean_interval(differences).interval or (np.nan, np.nan)
        covered += bool(low <= 5.0 <= high)
    assert covered / 200 >= 0.91  # a bootstrap's covers in 84%


@pytest.mark.parametrize(
    ("both", "only_first", "only_second"), [(0.93, 0.03, 0.01), (0.7, 0.15, 0.05), (1.0, 0.0, 0.0)]
)
def test_intervals_of_shares_in_pairs_cover_the_truth_and_are_shares(
    both: float, only_first: float, only_second: float
) -> None:
    chance = np.random.default_rng(4)
    covered = 0
    for n in (2, 5, 20, 100) * 50:
        kinds = chance.choice(4, n, p=[both, only_first, only_second, 1.0 - both - only_first - only_second])
        found = paired_share_difference(kinds <= 1, (kinds == 0) | (kinds == 2))
        low, high = found.interval or (np.nan, np.nan)
        assert -1.0 <= low < high <= 1.0
        covered += bool(low <= only_first - only_second <= high)
    assert covered / 200 >= 0.92
