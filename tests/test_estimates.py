"""The figures of a sample are those that scipy gives."""

from __future__ import annotations

import pytest
from scipy import stats

from suave_des.estimates import estimate, t_quantile

FREEDOMS = (*range(1, 40), 99, 170, 171, 298, 299, 300, 301, 1000, 9_999, 1_000_000)


@pytest.mark.parametrize("freedom", FREEDOMS)
def test_quantile_of_students_t_is_that_of_scipy(freedom: int) -> None:
    assert t_quantile(freedom) == pytest.approx(float(stats.t.ppf(0.975, freedom)), rel=1e-12)


def test_intervals_are_those_of_scipy() -> None:
    sample = [3.5, 1.25, 9.0, 4.0, 4.5, 6.0]
    found = estimate(sample)
    mean, error = float(stats.tmean(sample)), float(stats.sem(sample))
    assert found.mean_interval == pytest.approx(stats.t.interval(0.95, 5, loc=mean, scale=error))
    assert found.std is not None
    low, high = (5.0 * found.std**2 / float(stats.chi2.ppf(share, 5)) for share in (0.975, 0.025))
    assert found.std_interval == pytest.approx((low**0.5, high**0.5))


def test_an_interval_needs_two_values() -> None:
    assert (estimate([1.0]).mean_interval, estimate([1.0]).std_interval) == (None, None)
    assert (estimate([]).mean_interval, estimate([]).std_interval) == (None, None)
