"""Compare samples by scipy's intervals and tests, in the form in which a validation uses them.

A sample is a float array of shape (n,). What draws takes a generator, and is repeatable with its seed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from suave_des.estimates import Interval
from suave_des.report.statistics import SIGNIFICANCE, Sample, bootstrap_interval

PERMUTATIONS = 999
SUBSAMPLES = 2_000
_BATCH = 500
"""Resamples at a time, so that memory stays small."""


class SampleTest(NamedTuple):
    """A two-sample test.

    Attributes:
        statistic: of the test.
        p: probability of a statistic at least as great if both samples come from one distribution.
    """

    statistic: float
    p: float


def ratio_interval(published: Sample, simulated: Sample, rng: np.random.Generator) -> Interval | None:
    """95% percentile bootstrap interval of simulated / published standard deviation.

    Both samples are resampled independently and with replacement (Efron and Tibshirani 1993, chapters 13 and 16). None
    for a sample of one value, or where a resample of the published values has no spread to divide by.
    """
    return bootstrap_interval(
        lambda x, y, axis: _std(y, axis) / _std(x, axis), (published, simulated), rng, batch=_BATCH
    )


def _std(sample: Sample, axis: int) -> Sample:
    # Means of equal values are rounded; their spread must be zero all the same.
    return np.where(np.ptp(sample, axis=axis) > 0.0, sample.std(axis=axis, ddof=1), 0.0)


def kolmogorov_smirnov(published: Sample, simulated: Sample) -> SampleTest:
    """Two-sample, two-sided Kolmogorov-Smirnov test; with ties its p is too high."""
    from scipy.stats import ks_2samp

    found = ks_2samp(published, simulated)
    return SampleTest(float(found.statistic), float(found.pvalue))


def anderson_darling(
    published: Sample, simulated: Sample, rng: np.random.Generator, permutations: int = PERMUTATIONS
) -> SampleTest | None:
    """Two-sample Anderson-Darling test with midranks for ties (Scholz and Stephens 1987, equation 7).

    The statistic is normalised; p is that of a permutation test, which ties do not disturb. None for a sample of one.
    """
    from scipy.stats import PermutationMethod, anderson_ksamp

    if len(published) < 2 or len(simulated) < 2:
        return None
    if np.ptp(np.concatenate([published, simulated])) == 0.0:  # all values equal: no test, and no evidence
        return SampleTest(0.0, 1.0)
    method = PermutationMethod(n_resamples=permutations, rng=rng)
    found = anderson_ksamp([published, simulated], variant="midrank", method=method)
    return SampleTest(float(found.statistic), float(found.pvalue))


def superiority(first: Sample, second: Sample, *, lower_is_better: bool) -> float:
    """Probability that a mission of the first is better than one of the second, ties counted half.

    Vargha and Delaney's A (2000): the Mann-Whitney U / the product of the sizes.
    """
    from scipy.stats import mannwhitneyu

    greater = float(mannwhitneyu(first, second, method="asymptotic").statistic) / (len(first) * len(second))
    return 1.0 - greater if lower_is_better else greater


@dataclass(frozen=True, slots=True)
class OneSidedTests:
    """One-sided Mann-Whitney tests of two samples, one in each direction."""

    first_better_p: float
    second_better_p: float

    @property
    def sign(self) -> int:
        """1: the first is better; -1: the second; 0: neither is shown to be."""
        return int(self.first_better_p < SIGNIFICANCE) - int(self.second_better_p < SIGNIFICANCE)


def conclude(first: Sample, second: Sample, *, lower_is_better: bool) -> OneSidedTests:
    """Test two samples both ways (scipy.stats.mannwhitneyu, normal approximation, ties corrected)."""
    return OneSidedTests(*map(float, _mann_whitney(first, second, lower_is_better=lower_is_better)))


def agreement(
    sign: int,
    samples: tuple[Sample, Sample],
    sizes: tuple[int, int],
    rng: np.random.Generator,
    *,
    lower_is_better: bool,
    subsamples: int = SUBSAMPLES,
) -> float | None:
    """Share of random subsamples of two samples that lead to a given conclusion.

    Args:
        sign: the conclusion, see OneSidedTests.sign.
        samples: all values of the first and of the second.
        sizes: of the subsamples, which are drawn without replacement.
        rng: to draw them with.
        lower_is_better: of the metric.
        subsamples: how many.

    Returns:
        The share; none if there are fewer values than a subsample needs.
    """
    if any(len(sample) < size for sample, size in zip(samples, sizes, strict=True)):
        return None
    drawn = (
        np.array([rng.choice(sample, size, replace=False) for _ in range(subsamples)])
        for sample, size in zip(samples, sizes, strict=True)
    )
    tests = map(OneSidedTests, *_mann_whitney(*drawn, lower_is_better=lower_is_better))
    return float(np.mean([each.sign == sign for each in tests]))


def _mann_whitney(firsts: Sample, seconds: Sample, *, lower_is_better: bool) -> tuple[Sample, Sample]:
    """For each row of two arrays (..., n) and (..., m): p that the first is better, p that the second is."""
    from scipy.stats import mannwhitneyu

    def p(alternative: str) -> Sample:
        with np.errstate(divide="ignore", invalid="ignore"):  # all values equal: no test, and no evidence
            found = mannwhitneyu(firsts, seconds, axis=-1, alternative=alternative, method="asymptotic").pvalue
        values: Sample = np.nan_to_num(np.asarray(found), nan=1.0)
        return values

    less, greater = p("less"), p("greater")
    return (less, greater) if lower_is_better else (greater, less)
