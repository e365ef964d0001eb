"""Statistics of two samples, a published one and a simulated one: pure functions over arrays.

A sample is a float array of shape (n,). Everything that draws takes a generator and is repeatable with its seed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Sample = NDArray[np.float64]
Interval = tuple[float, float]

CONFIDENCE = 0.95
SIGNIFICANCE = 0.05
RESAMPLES = 9_999
PERMUTATIONS = 4_999
SUBSAMPLES = 2_000
_CHUNK_VALUES = 2_000_000
"""Values drawn at a time, so that memory does not grow with the samples."""


@dataclass(frozen=True, slots=True)
class Resampled:
    """Bootstrap intervals; none where they cannot be had: a sample of one value says nothing about spread."""

    difference_interval: Interval | None
    ratio_interval: Interval | None


def bootstrap(published: Sample, simulated: Sample, rng: np.random.Generator, resamples: int = RESAMPLES) -> Resampled:
    """95% percentile bootstrap intervals of simulated less published mean, and of simulated by published std.

    Both samples are resampled, independently and with replacement (Efron and Tibshirani 1993, chapters 13 and 16).
    """
    if len(published) < 2 or len(simulated) < 2:
        return Resampled(None, None)
    published_mean, published_std = _resampled(published, rng, resamples)
    simulated_mean, simulated_std = _resampled(simulated, rng, resamples)
    # Of a few values, some resamples are all the same one, and their spread is no divisor.
    ratio = simulated_std / published_std if published_std.all() else None
    return Resampled(_middle(simulated_mean - published_mean), None if ratio is None else _middle(ratio))


def _resampled(sample: Sample, rng: np.random.Generator, resamples: int) -> tuple[Sample, Sample]:
    means, stds = [], []
    for count in _chunks(resamples, len(sample)):
        drawn = sample[rng.integers(len(sample), size=(count, len(sample)))]
        means.append(drawn.mean(axis=1))
        # Means of equal values are rounded; their spread must be nought all the same.
        stds.append(np.where(np.ptp(drawn, axis=1) > 0.0, drawn.std(axis=1, ddof=1), 0.0))
    return np.concatenate(means), np.concatenate(stds)


def _middle(values: Sample) -> Interval:
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(values, (tail, 1.0 - tail))
    return float(low), float(high)


def _chunks(total: int, values_each: int) -> Iterator[int]:
    size = max(1, _CHUNK_VALUES // max(1, values_each))
    for start in range(0, total, size):
        yield min(size, total - start)


@dataclass(frozen=True, slots=True)
class KolmogorovSmirnov:
    """Greatest distance between two empirical distribution functions, and the p of one at least as great."""

    distance: float
    p: float


def kolmogorov_smirnov(published: Sample, simulated: Sample) -> KolmogorovSmirnov:
    """Two-sample, two-sided Kolmogorov-Smirnov test (scipy.stats.ks_2samp); with ties its p is on the high side."""
    from scipy.stats import ks_2samp

    found = ks_2samp(published, simulated)
    return KolmogorovSmirnov(float(found.statistic), float(found.pvalue))


@dataclass(frozen=True, slots=True)
class AndersonDarling:
    """The k-sample Anderson-Darling statistic of two samples, and its permutation p."""

    statistic: float
    p: float


def anderson_darling(
    published: Sample, simulated: Sample, rng: np.random.Generator, permutations: int = PERMUTATIONS
) -> AndersonDarling:
    """Anderson-Darling test of two samples, with midranks for ties (Scholz and Stephens 1987, equation 7).

    The p is that of a permutation test, which ties do not disturb: the share of ways to deal the pooled values out, the
    observed one among them, whose statistic is at least as great. Dealing out is drawing, for each distinct value, how
    many of it go to the smaller sample, which is what makes thousands of permutations cheap.
    """
    small, large = sorted((published, simulated), key=len)
    values, multiplicity = np.unique(np.concatenate([small, large]), return_counts=True)
    if len(values) == 1:
        return AndersonDarling(0.0, 1.0)
    observed = float(_anderson_darling_statistics(_counts(small, values), multiplicity)[0])
    at_least = 0
    for count in _chunks(permutations, len(values)):
        dealt = rng.multivariate_hypergeometric(multiplicity, len(small), size=count, method="count")
        statistics = _anderson_darling_statistics(dealt, multiplicity)
        # Equal statistics that were summed in another order differ in their last digits.
        at_least += int(np.count_nonzero(statistics >= observed * (1.0 - 1e-9)))
    return AndersonDarling(observed, (at_least + 1) / (permutations + 1))


def _counts(sample: Sample, values: Sample) -> NDArray[np.int64]:
    """How often each distinct value comes in the sample, shape (1, number of values)."""
    return np.bincount(np.searchsorted(values, sample), minlength=len(values))[np.newaxis, :]


def _anderson_darling_statistics(counts: NDArray[np.int64], multiplicity: NDArray[np.int64]) -> Sample:
    """Statistic for each row of counts of the first sample; both terms of its sum over two samples are alike."""
    total, first = int(multiplicity.sum()), int(counts[0].sum())
    below_pooled = multiplicity.cumsum() - multiplicity / 2.0
    below_first = counts.cumsum(axis=1) - counts / 2.0
    weight = below_pooled * (total - below_pooled) - total * multiplicity / 4.0
    terms = multiplicity / total * (total * below_first - first * below_pooled) ** 2 / weight
    factor = (total - 1) / total * (1.0 / first + 1.0 / (total - first))
    statistics: Sample = factor * terms.sum(axis=1)
    return statistics


def superiority(first: Sample, second: Sample, *, lower_is_better: bool) -> float:
    """Probability that a mission of the first is better than one of the second, ties counted half.

    Vargha and Delaney's A (2000), the Mann-Whitney U by the product of the sizes.
    """
    order = np.sort(second)
    less = np.searchsorted(order, first, side="left").sum()
    not_greater = np.searchsorted(order, first, side="right").sum()
    greater_share = float((less + not_greater) / 2.0 / (len(first) * len(second)))
    return 1.0 - greater_share if lower_is_better else greater_share


@dataclass(frozen=True, slots=True)
class Conclusion:
    """What one-sided Mann-Whitney tests, one in each direction, say of two samples.

    Attributes:
        first_better_p: p of the test that the first is better.
        second_better_p: p of the test that the second is better.
    """

    first_better_p: float
    second_better_p: float

    @property
    def sign(self) -> int:
        """1: the first is better; -1: the second; 0: neither is shown to be."""
        return int(self.first_better_p < SIGNIFICANCE) - int(self.second_better_p < SIGNIFICANCE)


def conclude(first: Sample, second: Sample, *, lower_is_better: bool) -> Conclusion:
    """One-sided Mann-Whitney tests of two samples (scipy.stats.mannwhitneyu, normal approximation, ties corrected)."""
    first_p, second_p = _mann_whitney(first[np.newaxis, :], second[np.newaxis, :], lower_is_better=lower_is_better)
    return Conclusion(float(first_p[0]), float(second_p[0]))


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
        sign: the conclusion, see Conclusion.sign.
        samples: all values of the first and of the second.
        sizes: of the subsamples, which are drawn without replacement.
        rng: to draw them with.
        lower_is_better: of the metric.
        subsamples: how many.

    Returns:
        The share; none if there are fewer values than a subsample needs.
    """
    first, second = samples
    if len(first) < sizes[0] or len(second) < sizes[1]:
        return None
    firsts = np.array([rng.choice(first, sizes[0], replace=False) for _ in range(subsamples)])
    seconds = np.array([rng.choice(second, sizes[1], replace=False) for _ in range(subsamples)])
    first_p, second_p = _mann_whitney(firsts, seconds, lower_is_better=lower_is_better)
    signs = (first_p < SIGNIFICANCE).astype(int) - (second_p < SIGNIFICANCE).astype(int)
    return float(np.mean(signs == sign))


def _mann_whitney(firsts: Sample, seconds: Sample, *, lower_is_better: bool) -> tuple[Sample, Sample]:
    """For each row of two arrays (k, n) and (k, m): p that the first is better, p that the second is."""
    from scipy.stats import mannwhitneyu

    def p(alternative: str) -> Any:
        with np.errstate(divide="ignore", invalid="ignore"):  # all values equal: no test, and no evidence
            found = mannwhitneyu(firsts, seconds, axis=1, alternative=alternative, method="asymptotic").pvalue
        return np.nan_to_num(np.asarray(found), nan=1.0)

    less, greater = p("less"), p("greater")
    return (less, greater) if lower_is_better else (greater, less)


def share_interval(count: int, n: int) -> Interval | None:
    """95% interval of a share by Clopper and Pearson (1934); none for no trials."""
    from scipy.special import betaincinv

    if n == 0:
        return None
    tail = (1.0 - CONFIDENCE) / 2.0
    low = 0.0 if count == 0 else float(betaincinv(count, n - count + 1, tail))
    high = 1.0 if count == n else float(betaincinv(count + 1, n - count, 1.0 - tail))
    return low, high
