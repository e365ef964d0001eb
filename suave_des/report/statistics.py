"""Statistics of a comparison, from SciPy, statsmodels and lifelines, in the form in which tables use them.

A sample is a float array of shape (n,) without missing values. Intervals are 95% intervals.
"""

from __future__ import annotations

import math
import warnings
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from suave_des.errors import InputError
from suave_des.estimates import CONFIDENCE, Interval, estimate, t_quantile

Sample = NDArray[np.float64]
Statistic = Callable[..., NDArray[np.float64]]

EXTRA = "compare"
"""The extra that installs statsmodels and lifelines."""
SIGNIFICANCE = 0.05
STUDENT, WELCH, BCA = "Student's t", "Welch's t", "BCa bootstrap"
WILSON, NEWCOMBE, BONETT_PRICE = "Wilson", "Newcombe", "Bonett and Price"
RESAMPLES = 9_999
_LARGEST_BOOTSTRAP = 5_000
"""Of more values the bootstrap's interval is that of t, and would take minutes."""
_BATCH_VALUES = 1_000_000
"""Resampled values in memory at a time."""
_SEED = 20230209  # so that equal samples give equal intervals
_MOST_RUNS = 10_000_000
_ROUNDING = 1e-9
"""A share left of one half is often a little more after rounding."""


def library(module: str) -> Any:
    """Import a module of statsmodels or lifelines.

    Raises:
        InputError: it is not installed; the error names the extra that has it.
    """
    try:
        return import_module(module)
    except ImportError:
        problem = f"comparisons need {module.split('.')[0]}, which is not installed"
        raise InputError(problem, remedy=f"pip install 'suave-des[{EXTRA}]'") from None


@dataclass(frozen=True, slots=True)
class Estimated:
    """A value with its 95% interval, and how that was found; no interval where the data give none."""

    value: float
    interval: Interval | None = None
    method: str = ""


def mean_interval(sample: Sample, *, bootstrap: bool = False) -> Estimated:
    """Estimate the mean of a sample of one value or more, with its interval by Student's t, or else by BCa bootstrap.

    Differences of runs in pairs have heavy tails: most are small, a few are not, and a small sample has none of these.
    A bootstrap, which knows nothing but the sample, is too narrow then. Where the values are all equal there is no
    interval, because nothing is known of their spread.
    """
    found = estimate(sample.tolist())
    assert found.mean is not None
    if bootstrap and len(sample) <= _LARGEST_BOOTSTRAP:
        return Estimated(found.mean, _bca(lambda x, axis: x.mean(axis=axis), sample), BCA)
    return Estimated(found.mean, found.mean_interval if np.ptp(sample) > 0.0 else None, STUDENT)


def cut(found: Estimated, lowest: float, highest: float) -> Estimated:
    """Cut an interval off at the limits of what is estimated, such as a share averaged over runs."""
    if found.interval is None:
        return found
    low, high = found.interval
    return replace(found, interval=(max(lowest, low), min(highest, high)))


def difference_interval(first: Sample, second: Sample, *, bootstrap: bool = False) -> Estimated:
    """Estimate the difference of two independent samples' means, first - second.

    Its interval is that of Welch (1947), or else by BCa bootstrap; see mean_interval.
    """
    from scipy.stats import ttest_ind

    difference = math.fsum(first) / len(first) - math.fsum(second) / len(second)
    if bootstrap and max(len(first), len(second)) <= _LARGEST_BOOTSTRAP:
        interval = _bca(lambda x, y, axis: x.mean(axis=axis) - y.mean(axis=axis), first, second)
        return Estimated(difference, interval, BCA)
    if min(len(first), len(second)) < 2 or np.ptp(first) == np.ptp(second) == 0.0:
        return Estimated(difference)
    with _quiet():  # of a sample without spread
        welch = ttest_ind(first, second, equal_var=False).confidence_interval(CONFIDENCE)
    return Estimated(difference, _finite(welch.low, welch.high), WELCH)


def _bca(statistic: Statistic, *samples: Sample) -> Interval | None:
    """Return the bias-corrected and accelerated bootstrap interval (Efron 1987); none of samples without spread."""
    if all(np.ptp(sample) == 0.0 for sample in samples):
        return None
    batch = max(1, _BATCH_VALUES // max(map(len, samples)))
    return bootstrap_interval(statistic, samples, np.random.default_rng(_SEED), batch, method="BCa")


def bootstrap_interval(
    statistic: Statistic,
    samples: Sequence[Sample],
    rng: np.random.Generator,
    batch: int | None = None,
    *,
    method: Literal["percentile", "BCa"] = "percentile",
) -> Interval | None:
    """Return the bootstrap interval of a statistic of one sample or of several independent ones.

    Args:
        statistic: takes arrays of shape (k, n) and an axis.
        samples: are resampled with replacement.
        rng: to resample with.
        batch: resamples at a time, so that memory stays small.
        method: as of scipy.stats.bootstrap.

    Returns:
        The interval; none for samples of one value, or where it or a resample's statistic is not finite.
    """
    from scipy.stats import DegenerateDataWarning, bootstrap

    if min(map(len, samples)) < 2:
        return None
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", DegenerateDataWarning)  # gives nan, which is no interval
        found = bootstrap(
            samples,
            statistic,
            n_resamples=RESAMPLES,
            batch=batch,
            vectorized=True,
            confidence_level=CONFIDENCE,
            method=method,
            rng=rng,
        )
    if not np.isfinite(found.bootstrap_distribution).all():
        return None
    return _finite(found.confidence_interval.low, found.confidence_interval.high)


def _finite(low: float, high: float) -> Interval | None:
    return (float(low), float(high)) if math.isfinite(low) and math.isfinite(high) else None


def share_estimate(count: int, n: int) -> Estimated:
    """Estimate a share of one trial or more, with its interval by Wilson (1927)."""
    return Estimated(count / n, share_interval(count, n, "wilson"), WILSON)


def share_interval(count: int, n: int, method: Literal["wilson", "exact"]) -> Interval:
    """Return the interval of a share of one trial or more, by Wilson (1927), or by Clopper and Pearson (1934)."""
    from scipy.stats import binomtest

    low, high = binomtest(count, n).proportion_ci(CONFIDENCE, method=method)
    return float(low), float(high)


def share_difference(first: tuple[int, int], second: tuple[int, int]) -> Estimated:
    """Estimate the difference of two independent shares (count, n), with its interval by Newcombe (1998)."""
    proportion = library("statsmodels.stats.proportion")
    low, high = proportion.confint_proportions_2indep(
        *first, *second, method="newcomb", compare="diff", alpha=1.0 - CONFIDENCE
    )
    return Estimated(first[0] / first[1] - second[0] / second[1], _finite(low, high), NEWCOMBE)


def paired_share_difference(first: NDArray[np.bool_], second: NDArray[np.bool_]) -> Estimated:
    """Estimate the difference of two shares of the same runs, with its interval by Bonett and Price (2012).

    It is Wald's with a run more of each kind in which the two differ, so that there is one if no run differs, too.
    """
    from scipy.special import ndtri

    n = len(first)
    change = first.astype(float) - second.astype(float)
    extended = np.append(change, (1.0, -1.0))
    middle, half = float(extended.mean()), float(ndtri((1.0 + CONFIDENCE) / 2.0) * extended.std()) / math.sqrt(n + 2)
    return Estimated(math.fsum(change) / n, (max(-1.0, middle - half), min(1.0, middle + half)), BONETT_PRICE)


@dataclass(frozen=True, slots=True)
class SearchTimes:
    """Times until the pipeline is found, where missions that did not find it are censored (Kaplan and Meier 1958).

    Attributes:
        horizon_s: to which the restricted mean reaches: the shortest time limit of all that is compared.
        restricted_mean_s: mean of the time until found or `horizon_s`, whichever is less, with its interval.
        median_s: time by which half of the missions have found it; None if less than half do.
        median_interval_s: of that; an end is None if it is not reached.
    """

    horizon_s: float
    restricted_mean_s: Estimated
    median_s: float | None
    median_interval_s: tuple[float | None, float | None]


def search_times(times_s: Sample, found: NDArray[np.bool_], horizon_s: float) -> SearchTimes:
    """Estimate times until the pipeline is found.

    Args:
        times_s: when it was found, or the mission ended without.
        found: whether it was found.
        horizon_s: for the restricted mean.
    """
    fitted = library("lifelines").KaplanMeierFitter(alpha=1.0 - CONFIDENCE)
    utilities = library("lifelines.utils")
    with _quiet():
        fitted.fit(times_s, found)
        restricted_s = float(utilities.restricted_mean_survival_time(fitted, t=horizon_s))
        half = 0.5 + _ROUNDING
        median_s = utilities.qth_survival_time(half, fitted)
        ends = utilities.qth_survival_times(half, fitted.confidence_interval_).to_numpy().ravel()
    restricted = Estimated(restricted_s)
    if not (~found & (times_s < horizon_s)).any():
        # None is censored before the horizon, so the restricted mean is that of a sample.
        restricted = replace(mean_interval(np.minimum(times_s, horizon_s)), value=restricted_s)
    low, high = sorted(map(_reached, ends), key=lambda end: math.inf if end is None else end)
    return SearchTimes(horizon_s, restricted, _reached(median_s), (low, high))


def _reached(time_s: float) -> float | None:
    return float(time_s) if math.isfinite(time_s) else None


@contextmanager
def _quiet() -> Iterator[None]:
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@dataclass(frozen=True, slots=True)
class Tested:
    """A test of two samples, and the effect that belongs to it.

    Attributes:
        name: of the test.
        p: two-sided.
        p_less: one-sided: that the first is not less than the second; likewise p_greater.
        effect: its size; None where the test has none.
        effect_interval: of that, if there is one.
        effect_name: what it is.
    """

    name: str
    p: float
    p_less: float | None = None
    p_greater: float | None = None
    effect: float | None = None
    effect_interval: Interval | None = None
    effect_name: str = ""


WILCOXON, MANN_WHITNEY = "Wilcoxon signed-rank", "Mann-Whitney"
MCNEMAR, FISHER = "McNemar, exact", "Fisher, exact"
_ALTERNATIVES: tuple[Literal["two-sided", "less", "greater"], ...] = ("two-sided", "less", "greater")


def _ps(found: Sequence[Any]) -> tuple[float, float, float]:
    """Return the p-values of a test with each of _ALTERNATIVES."""
    p, p_less, p_greater = (float(each.pvalue) for each in found)
    return p, p_less, p_greater


def signed_rank_test(first: Sample, second: Sample) -> Tested:
    """Test paired samples by Wilcoxon's signed ranks, as scipy.stats.wilcoxon does by default.

    The effect is the matched-pairs rank-biserial correlation (Kerby 2014): 1 if the first is greater in all pairs, -1
    if it is less in all. Pairs without a difference do not count.
    """
    from scipy.stats import wilcoxon

    differing = int(np.count_nonzero(first != second))
    if differing == 0:
        return Tested(WILCOXON, 1.0, 1.0, 1.0, 0.0, None, "rank-biserial")
    with _quiet():
        found = [wilcoxon(first, second, alternative=each) for each in _ALTERNATIVES]
    effect = 4.0 * float(found[-1].statistic) / (differing * (differing + 1)) - 1.0
    return Tested(WILCOXON, *_ps(found), effect, None, "rank-biserial")


def rank_sum_test(first: Sample, second: Sample) -> Tested:
    """Test independent samples by Mann and Whitney, as scipy.stats.mannwhitneyu does by default.

    The effect is A12 (Vargha and Delaney 2000): the probability that a value of the first is greater than one of the
    second, ties counted half; its interval is that of Brunner and Munzel (2000).
    """
    from scipy.stats import mannwhitneyu

    if np.ptp(np.concatenate([first, second])) == 0.0:
        return Tested(MANN_WHITNEY, 1.0, 1.0, 1.0, 0.5, None, "A12")
    found = [mannwhitneyu(first, second, alternative=each) for each in _ALTERNATIVES]
    effect = float(found[0].statistic) / (len(first) * len(second))
    interval: Interval | None = None
    if min(len(first), len(second)) > 1:
        with _quiet():
            ranks = library("statsmodels.stats.nonparametric").rank_compare_2indep(first, second)
            low, high = ranks.conf_int(alpha=1.0 - CONFIDENCE)
        if _finite(low, high):  # samples that do not overlap give none
            interval = max(0.0, float(low)), min(1.0, float(high))
    return Tested(MANN_WHITNEY, *_ps(found), effect, interval, "A12")


def shares_test(first: tuple[int, int], second: tuple[int, int]) -> Tested:
    """Test two independent shares (count, n) by Fisher's exact test."""
    from scipy.stats import fisher_exact

    table = [[count, n - count] for count, n in (first, second)]
    return Tested(FISHER, *_ps([fisher_exact(table, alternative=each) for each in _ALTERNATIVES]))


def paired_shares_test(first: NDArray[np.bool_], second: NDArray[np.bool_]) -> Tested:
    """Test two shares of the same runs by McNemar's exact test, which counts the runs in which the two differ."""
    both = [[int(np.sum((first == row) & (second == column))) for column in (True, False)] for row in (True, False)]
    found = library("statsmodels.stats.contingency_tables").mcnemar(both, exact=True)
    return Tested(MCNEMAR, min(1.0, float(found.pvalue)))


def holm(ps: Sequence[float]) -> list[float]:
    """Adjust p-values for all tests together (Holm 1979)."""
    if not ps:
        return []
    adjusted = library("statsmodels.stats.multitest").multipletests(ps, method="holm")[1]
    return [float(p) for p in adjusted]


def runs_for(spread: float, half_width: float) -> int | None:
    """Return how many runs make half the 95% interval of a mean that narrow.

    Args:
        spread: standard deviation of a run's value; of a difference of two means, the root of the sum of squares.
        half_width: wanted, above 0.

    Returns:
        The least number, 2 or more; None for more than ten million.
    """

    def suffices(runs: int) -> bool:
        return t_quantile(runs - 1) * spread / math.sqrt(runs) <= half_width

    least = bisect_left(range(_MOST_RUNS + 1), True, lo=2, key=suffices)
    return least if least <= _MOST_RUNS else None
