"""Statistics of comparisons, from SciPy and statsmodels, in the form in which tables use them.

A sample is a float array of shape (n,) without missing values. Intervals are 95% intervals. What
draws takes a generator, and is repeatable with its seed.
"""

from __future__ import annotations

import math
import warnings
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from importlib import import_module
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from suave_des.errors import InputError
from suave_des.estimates import CONFIDENCE, STUDENT, Estimate, mean_of, t_quantile

Sample = NDArray[np.float64]

SIGNIFICANCE = 0.05
WELCH, NEWCOMBE, BONETT_PRICE = "Welch's t", "Newcombe", "Bonett and Price"
WILCOXON, MANN_WHITNEY = "Wilcoxon signed-rank", "Mann-Whitney"
MCNEMAR, FISHER = "McNemar, exact", "Fisher, exact"
PERMUTATION = "permutation"
RANK_BISERIAL, A12 = "rank-biserial", "A12"
RESAMPLES = 9_999
PERMUTATIONS, SUBSAMPLES = 999, 2_000
MOST_EXACT = 50
"""Pairs that differ up to which p of signed ranks is exact, as in scipy.stats.wilcoxon without
ties.
"""
_MOST_RUNS = 10_000_000
_NORMAL = 1.959963984
"""Half the width of the 95% interval of the normal distribution, rounded down."""
_ROUNDING = 1e-9
"""A share left of one half is often a little more after rounding."""
_ALTERNATIVES: tuple[Literal["two-sided", "less", "greater"], ...] = (
    "two-sided",
    "less",
    "greater",
)


def library(module: str = "") -> Any:
    """Import statsmodels, or a module of it.

    Raises:
        InputError: it is not installed; the error names the extra that has it.
    """
    try:
        return import_module(f"statsmodels{module}")
    except ImportError:
        problem = "comparisons need statsmodels, which is not installed"
        raise InputError(problem, remedy="pip install 'suave-des[compare]'") from None


@contextmanager
def _quiet() -> Iterator[None]:
    """Leave out warnings about samples without spread, whose intervals are nan."""
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


# Means


def mean_interval(sample: Sample) -> Estimate:
    """Estimate the mean of a sample of one value or more, with its interval by Student's t.

    Where the values are all equal there is no interval, because nothing is known of their spread.
    """
    found = mean_of(sample.tolist())
    return found if np.ptp(sample) > 0.0 else Estimate(found.value, method=found.method)


def difference_interval(first: Sample, second: Sample) -> Estimate:
    """Estimate the difference of two independent samples' means, first - second, with its interval
    by Welch (1947).
    """
    from scipy.stats import ttest_ind

    difference = math.fsum(first) / len(first) - math.fsum(second) / len(second)
    if min(len(first), len(second)) < 2 or np.ptp(first) == np.ptp(second) == 0.0:
        return Estimate(difference)
    with _quiet():
        welch = ttest_ind(first, second, equal_var=False).confidence_interval(CONFIDENCE)
    return _with_interval(difference, welch.low, welch.high, WELCH)


def means_test(first: Sample, second: Sample, *, is_paired: bool) -> tuple[str, float]:
    """Return the test of a difference of means and its two-sided p: of pairs Student's t, else
    Welch's.

    Where nothing has a spread, and so no t, it is the permutation test: p is the share of signs, or
    of ways to divide the values, that give a difference as great. It is nan where a sample has too
    few values to know its spread.
    """
    from scipy.stats import ttest_ind

    if is_paired:
        difference = first - second
        if np.ptp(difference) > 0.0:
            return STUDENT, _paired_t_p(difference)
        return PERMUTATION, 0.5 ** (len(difference) - 1) if difference[0] else 1.0
    if np.ptp(first) == np.ptp(second) == 0.0:
        ways = math.comb(len(first) + len(second), len(first))
        return PERMUTATION, min(1.0, 2.0 / ways) if first[0] != second[0] else 1.0
    with _quiet():
        return WELCH, float(ttest_ind(first, second, equal_var=False).pvalue)


def _paired_t_p(difference: Sample) -> float:
    """Return p as scipy.stats.ttest_rel does to the last digit, whose checks take ten times as long
    as the test: a second in four of a comparison of thirty managers.
    """
    from scipy.special import stdtr

    n = len(difference)
    mean = difference.mean()
    variance = np.mean((difference - mean) ** 2) * (n / (n - 1))
    return float(2.0 * stdtr(n - 1, -abs(mean / np.sqrt(variance / n))))


def _midranks(sample: Sample) -> Sample:
    """Return ranks from 1 on, of ties their mean, as scipy.stats.rankdata does with many checks."""
    _, places, counts = np.unique(sample, return_inverse=True, return_counts=True)
    ranks: Sample = (np.cumsum(counts) - (counts - 1) / 2.0)[places]
    return ranks


def with_finite_ranks(first: Sample, second: Sample) -> tuple[Sample, Sample]:
    """Return samples of the same ranks, with infinite values just above the greatest finite one."""
    pooled = np.concatenate([first, second])
    above = float(pooled[np.isfinite(pooled)].max(initial=0.0)) + 1.0
    return np.minimum(first, above), np.minimum(second, above)


def shares_of_comparisons(first: Sample, second: Sample, *, is_paired: bool) -> tuple[float, float]:
    """Return in which share of pairs, or of comparisons of each value with each, the first is
    greater, and in which it is less.
    """
    if is_paired:
        apart = differences_of_pairs(first, second)
        return float(np.mean(apart > 0.0)), float(np.mean(apart < 0.0))
    ordered = np.sort(second)
    comparisons = len(first) * len(second)
    greater = int(np.searchsorted(ordered, first, side="left").sum())
    not_less = int(np.searchsorted(ordered, first, side="right").sum())
    return greater / comparisons, (comparisons - not_less) / comparisons


def _with_interval(value: float, low: float, high: float, method: str) -> Estimate:
    """Return an estimate, without an interval if an end of it is not finite."""
    is_known = math.isfinite(low) and math.isfinite(high)
    return (
        Estimate(value, float(low), float(high), method)
        if is_known
        else Estimate(value, method=method)
    )


def ratio_interval(published: Sample, simulated: Sample, rng: np.random.Generator) -> Estimate:
    """Estimate simulated / published standard deviation, with its percentile bootstrap interval.

    Both samples are resampled independently and with replacement (Efron and Tibshirani 1993,
    chapters 13 and 16). There is no value where the published values have no spread to divide by,
    and no interval where those of a resample do.
    """
    from scipy.stats import bootstrap

    if min(len(published), len(simulated)) < 2:
        return Estimate()
    spread = float(_std(published, 0))
    ratio = float(_std(simulated, 0)) / spread if spread else math.nan
    with _quiet():
        found = bootstrap(
            (published, simulated),
            lambda x, y, axis: _std(y, axis) / _std(x, axis),
            n_resamples=RESAMPLES,
            batch=500,  # so that memory stays small
            vectorized=True,
            confidence_level=CONFIDENCE,
            method="percentile",
            rng=rng,
        )
    if not np.isfinite(found.bootstrap_distribution).all():
        return Estimate(ratio)
    return _with_interval(
        ratio, found.confidence_interval.low, found.confidence_interval.high, "percentile bootstrap"
    )


def _std(sample: Sample, axis: int) -> Sample:
    # Means of equal values are rounded; their spread must be zero all the same.
    return np.where(np.ptp(sample, axis=axis) > 0.0, sample.std(axis=axis, ddof=1), 0.0)


# Shares


def share_difference(first: tuple[int, int], second: tuple[int, int]) -> Estimate:
    """Estimate the difference of two independent shares (count, n), with its interval by Newcombe
    (1998).
    """
    proportion = library(".stats.proportion")
    low, high = proportion.confint_proportions_2indep(
        *first, *second, method="newcomb", compare="diff", alpha=1.0 - CONFIDENCE
    )
    return _with_interval(first[0] / first[1] - second[0] / second[1], low, high, NEWCOMBE)


def wilson(count: float, n: int) -> Estimate:
    """Estimate a share by Wilson (1927), as share_of does; what is counted may count in part."""
    proportion = library(".stats.proportion")
    low, high = proportion.proportion_confint(count, n, alpha=1.0 - CONFIDENCE, method="wilson")
    return Estimate(count / n, float(low), float(high), "Wilson")


def paired_share_difference(
    first: NDArray[np.bool_] | Sample, second: NDArray[np.bool_] | Sample
) -> Estimate:
    """Estimate the difference of two shares of the same runs, with its interval by Bonett and Price
    (2012).

    It is Wald's with a run more of each kind in which the two differ, so that there is one if no
    run differs, too.
    """
    from scipy.special import ndtri

    n = len(first)
    change = first.astype(float) - second.astype(float)
    extended = np.append(change, (1.0, -1.0))
    middle = float(extended.mean())
    half = float(ndtri((1.0 + CONFIDENCE) / 2.0) * extended.std()) / math.sqrt(n + 2)
    return Estimate(math.fsum(change) / n, middle - half, middle + half, BONETT_PRICE).cut(
        -1.0, 1.0
    )


def search_times(
    times_s: Sample, found: NDArray[np.bool_], horizon_s: float
) -> tuple[Estimate, Estimate]:
    """Estimate times until the pipeline is found, missions without it being censored (Kaplan and
    Meier 1958).

    Args:
        times_s: when it was found, or, where `found` is false, the mission ended without.
        horizon_s: to which the restricted mean reaches: the shortest time limit of all that is
            compared.

    Returns:
        The mean of the time until found or `horizon_s`, whichever is less; and the time by which
        half of the missions have found it, infinite if less than half do.
    """
    with _quiet():
        fitted = library(".duration.survfunc").SurvfuncRight(times_s, found)
        half = 0.5 - _ROUNDING
        median_s = float(np.nanmin([fitted.quantile(half), math.inf]))  # nan: less than half
        # nan: no step is in it
        ends_s = fitted.quantile_ci(half, 1.0 - CONFIDENCE, method="cloglog")
    is_before = fitted.surv_times < horizon_s
    steps_s = np.diff([0.0, *fitted.surv_times[is_before], horizon_s])
    # not @: its last digit depends on the processor
    restricted = Estimate(math.fsum(steps_s * np.append(1.0, fitted.surv_prob[is_before])))
    low, high = (median_s if math.isnan(end_s) else float(end_s) for end_s in ends_s)
    if not (~found & (times_s < horizon_s)).any():
        # None is censored before the horizon, so the restricted mean is that of a sample.
        restricted = replace(mean_interval(np.minimum(times_s, horizon_s)), value=restricted.value)
    return restricted, Estimate(median_s, low, high, "Kaplan-Meier")


# Tests

Test = dict[str, Any]
"""Columns of a comparison: test, p (two-sided), p_less (one-sided: that the first is not less than
the second), p_greater, effect_name, and effect with the ends of its interval; None for what a test
does not have."""

_PS_OF_EQUAL = (1.0, 1.0, 1.0)


def _test(name: str, ps: Sequence[float], effect: Estimate) -> Test:
    """Return the columns of a test, from the p of each of _ALTERNATIVES."""
    named = dict(zip(("p", "p_less", "p_greater"), map(float, ps), strict=True))
    return {"test": name, **named, "effect_name": effect.method, **effect.columns("effect")}


def signed_rank_test(first: Sample, second: Sample) -> Test:
    """Test paired samples by Wilcoxon's signed ranks.

    Pairs without a difference do not count; ties have midranks. Up to MOST_EXACT pairs p is exact,
    with ties, too; of more it is scipy.stats.wilcoxon's normal approximation. The effect is the
    matched-pairs rank-biserial correlation (Kerby 2014): 1 if the first is greater in all pairs, -1
    if it is less in all.
    """
    from scipy.stats import wilcoxon

    difference = differences_of_pairs(first, second)
    difference = difference[difference != 0.0]
    if not len(difference):
        return _test(WILCOXON, _PS_OF_EQUAL, Estimate(0.0, method=RANK_BISERIAL))
    ranks = _midranks(np.abs(difference))
    effect = 2.0 * float(ranks[difference > 0.0].sum()) / float(ranks.sum()) - 1.0
    if len(difference) <= MOST_EXACT:
        ps = _exact_ps(ranks, difference > 0.0)
    else:
        found = (
            wilcoxon(difference, alternative=each, method="asymptotic") for each in _ALTERNATIVES
        )
        ps = [float(each.pvalue) for each in found]
    return _test(WILCOXON, ps, Estimate(effect, method=RANK_BISERIAL))


def differences_of_pairs(first: Sample, second: Sample) -> Sample:
    """Return the differences of pairs in units of the greatest value.

    Means that are equal but for rounding errors have a difference of 0, and differences that are
    equal but for these are ties. Infinite values differ by more than all others from finite ones,
    and not from each other.
    """
    pooled = np.abs([first, second])
    scale = max(float(pooled[np.isfinite(pooled)].max(initial=0.0)), math.ulp(0.0))
    with _quiet():
        difference = np.nan_to_num((first - second) / scale, nan=0.0, posinf=3.0, neginf=-3.0)
    return np.round(difference, 9)


def _exact_ps(ranks: Sample, is_positive: NDArray[np.bool_]) -> list[float]:
    """Return p of each of _ALTERNATIVES from the exact distribution of the sum of positive ranks.

    Each sign is as likely as the other, so that the distribution is the convolution of those of
    single ranks. Midranks are multiples of a half, and therefore doubled.
    """
    doubled = np.round(2.0 * ranks).astype(int)
    ways = np.zeros(int(doubled.sum()) + 1)  # integers up to 2**50, which floats have exactly
    ways[0] = 1.0
    for rank in doubled:
        ways[rank:] = ways[rank:] + ways[: len(ways) - rank]
    share = ways / ways.sum()
    seen = int(doubled[is_positive].sum())
    less = float(share[: seen + 1].sum())
    greater = float(share[seen:].sum())
    return [min(1.0, 2.0 * min(less, greater)), min(1.0, less), min(1.0, greater)]


def mann_whitney(
    first: Sample, second: Sample, method: Literal["auto", "asymptotic"] = "auto"
) -> Test:
    """Test independent samples by Mann and Whitney, as scipy.stats.mannwhitneyu does with that
    method.

    The effect is A12 (Vargha and Delaney 2000): the probability that a value of the first is
    greater than one of the second, ties counted half.
    """
    from scipy.stats import mannwhitneyu

    if np.ptp(np.concatenate([first, second])) == 0.0:
        return _test(MANN_WHITNEY, _PS_OF_EQUAL, Estimate(0.5, method=A12))
    found = [mannwhitneyu(first, second, alternative=each, method=method) for each in _ALTERNATIVES]
    effect = Estimate(float(found[0].statistic) / (len(first) * len(second)), method=A12)
    return _test(MANN_WHITNEY, [each.pvalue for each in found], effect)


def rank_sum_test(first: Sample, second: Sample) -> Test:
    """Return the test of mann_whitney with the interval of its effect, by Brunner and Munzel
    (2000).
    """
    found = mann_whitney(first, second)
    with _quiet():
        ranks = library(".stats.nonparametric").rank_compare_2indep(first, second)
        low, high = ranks.conf_int(alpha=1.0 - CONFIDENCE)
    # none of one value, or without overlap
    effect = _with_interval(found["effect"], low, high, A12).cut(0.0, 1.0)
    return found | effect.columns("effect")


def shares_test(first: tuple[int, int], second: tuple[int, int]) -> Test:
    """Test two independent shares (count, n) by Fisher's exact test."""
    from scipy.stats import fisher_exact

    table = [[count, n - count] for count, n in (first, second)]
    return _test(
        FISHER, [fisher_exact(table, alternative=each).pvalue for each in _ALTERNATIVES], Estimate()
    )


def paired_shares_test(first: NDArray[np.bool_], second: NDArray[np.bool_]) -> Test:
    """Test two shares of the same runs by McNemar's exact test, which counts the runs in which the
    two differ.
    """
    p = _mcnemar_p(int(np.sum(first & ~second)), int(np.sum(second & ~first)))
    return {"test": MCNEMAR, "p": p, "effect_name": "", "effect": None}


@lru_cache(maxsize=1000)
def _mcnemar_p(first_alone: int, second_alone: int) -> float:
    tables = library(".stats.contingency_tables")
    found = tables.mcnemar([[0, first_alone], [second_alone, 0]], exact=True)
    return min(1.0, float(found.pvalue))


def holm(ps: Sequence[float]) -> list[float]:
    """Adjust p-values for all tests together (Holm 1979)."""
    if not ps:
        return []
    adjusted = library(".stats.multitest").multipletests(ps, method="holm")[1]
    return [float(p) for p in adjusted]


def runs_for(spread: float, half_width: float) -> int | None:
    """Return how many runs make half the 95% interval of a mean that narrow; None for more than ten
    million.

    Args:
        spread: standard deviation of a run's value; of a difference of two means, the root of the
            sum of squares.
        half_width: wanted, above 0.
    """

    def suffices(runs: int) -> bool:
        return t_quantile(runs - 1) * (spread / math.sqrt(runs)) <= half_width

    # The normal distribution needs fewer, by about two, and by less than twenty of any number.
    least = (_NORMAL * spread / half_width) ** 2
    if least > _MOST_RUNS:
        return None
    near = range(max(2, int(least)), int(least) + 20)
    found = near[bisect_left(near, True, key=suffices)]
    return found if found <= _MOST_RUNS else None


# Distributions, and conclusions from small samples: what a validation asks


def anderson_darling(
    first: Sample, second: Sample, rng: np.random.Generator, permutations: int = PERMUTATIONS
) -> tuple[float, float]:
    """Return statistic and p of the two-sample Anderson-Darling test (Scholz and Stephens 1987,
    equation 7).

    Ties have midranks. The statistic is normalised; p is that of a permutation test, which ties do
    not disturb. Both are nan for a sample of one.
    """
    from scipy.stats import PermutationMethod, anderson_ksamp

    if min(len(first), len(second)) < 2:
        return math.nan, math.nan
    if np.ptp(np.concatenate([first, second])) == 0.0:  # all values equal: no test, and no evidence
        return 0.0, 1.0
    method = PermutationMethod(n_resamples=permutations, rng=rng)
    found = anderson_ksamp([first, second], variant="midrank", method=method)
    return float(found.statistic), float(found.pvalue)


def sign_of(p_less: float, p_greater: float) -> int:
    """Return what one-sided tests show: 1: the first is greater; -1: it is less; 0: neither is
    shown.
    """
    return int(p_greater < SIGNIFICANCE) - int(p_less < SIGNIFICANCE)


def agreement(
    sign: int,
    samples: Sequence[Sample],
    sizes: Sequence[int],
    rng: np.random.Generator,
    subsamples: int = SUBSAMPLES,
) -> float:
    """Return the share of random subsamples of two samples that lead to a conclusion, a sign as of
    sign_of.

    They are drawn without replacement, and tested by one-sided Mann-Whitney tests by the normal
    approximation, with ties corrected. The share is nan if a sample is too small to draw from.
    """
    from scipy.stats import mannwhitneyu

    if any(len(sample) < size for sample, size in zip(samples, sizes, strict=True)):
        return math.nan
    drawn = [
        np.array([rng.choice(sample, size, replace=False) for _ in range(subsamples)])
        for sample, size in zip(samples, sizes, strict=True)
    ]
    # all values equal: p is nan, and no evidence
    with np.errstate(divide="ignore", invalid="ignore"):
        less, greater = (
            mannwhitneyu(*drawn, axis=-1, alternative=each, method="asymptotic").pvalue
            < SIGNIFICANCE
            for each in _ALTERNATIVES[1:]
        )
    return float(np.mean(greater.astype(int) - less.astype(int) == sign))


def least_and_greatest(values: Sample, runs: Sample) -> list[tuple[float, int]]:
    """Return the least and the greatest of values, each with its run."""
    places = int(values.argmin()), int(values.argmax())
    return [(float(values[place]), int(runs[place])) for place in places]
