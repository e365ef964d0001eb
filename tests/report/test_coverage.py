"""The intervals of `compare` hold the true value about as often as they say, also for few and skewed values."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from suave_des.report.statistics import difference_interval, mean_interval

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


@pytest.mark.slow
@pytest.mark.parametrize(("n", "least"), [(20, 0.91), (100, 0.93)])
def test_how_often_over_a_thousand_repetitions(n: int, least: float) -> None:
    means, differences = coverage_of_means(n, 1_000), coverage_of_differences(n, n, 1_000)
    print(f"{n} missions: {means:.3f} of the means, {differences:.3f} of the differences")
    assert least <= means <= 0.97
    assert least <= differences <= 0.97
