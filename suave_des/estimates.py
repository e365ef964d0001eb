"""Estimates: values with their 95% intervals, of means, spreads and shares."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

CONFIDENCE = 0.95
STUDENT, CHI_SQUARE = "Student's t", "chi-square"
_OF_SHARES = {"wilson": "Wilson", "exact": "Clopper and Pearson"}
_NAN = math.nan

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value that is estimated from data, with its 95% interval; nan where the data give none.

        mean_of([101.0, 98.0, 104.0]).text(".1f")  # "93.5 to 108.5"

    Attributes:
        value: the estimate.
        low: lower end of the interval; likewise high. An end that is never reached is infinite.
        method: how the interval is found.
    """

    value: float = _NAN
    low: float = _NAN
    high: float = _NAN
    method: str = ""

    @property
    def has_interval(self) -> bool:
        """Whether there is an interval."""
        return not math.isnan(self.low)

    @property
    def interval(self) -> Interval | None:
        """Both ends of the interval; None without one."""
        return (self.low, self.high) if self.has_interval else None

    def contains(self, value: float) -> bool:
        """Return whether the interval contains a value; False without an interval."""
        return self.low <= value <= self.high

    def __neg__(self) -> Estimate:
        """Return the estimate of the value with the other sign."""
        return replace(self, value=-self.value, low=-self.high, high=-self.low)

    def text(self, style: str, scale: float = 1.0) -> str:
        """Write the interval, with its ends in a number format and multiplied by a scale; empty if
        there is none.
        """
        return (
            f"{scale * self.low:{style}} to {scale * self.high:{style}}"
            if self.has_interval
            else ""
        )

    def cut(self, lowest: float, highest: float) -> Estimate:
        """Cut the interval off at the limits of what is estimated, such as those of a share."""
        return (
            replace(self, low=max(self.low, lowest), high=min(self.high, highest))
            if self.has_interval
            else self
        )

    def columns(self, name: str) -> dict[str, float | None]:
        """Return the three columns of a file that have the value and the ends of its interval, by
        their names.
        """
        values = (self.value, self.low, self.high)
        return dict(zip((name, *interval_names(name)), map(known, values), strict=True))


def interval_names(name: str) -> tuple[str, str]:
    """Return the names of the columns that have the ends of the interval of a value in result
    files.
    """
    return f"{name}_ci95_low", f"{name}_ci95_high"


def known(value: float | None) -> float | None:
    """Return a number as a file has it: None where it is not finite."""
    return value if value is not None and math.isfinite(value) else None


def percent(share: float) -> str:
    """Write a share in whole per cent: "100%" of all only, and "0%" of none only; empty for nan."""
    if math.isnan(share):
        return ""
    text = f"{share:.0%}"
    if share < 1.0 and text == "100%":
        return ">99%"
    return "<1%" if share > 0.0 and text == "0%" else text


def mean_of(values: Sequence[float], groups: Sequence[int] | None = None) -> Estimate:
    """Estimate the mean of a sample, with its interval by Student's t, of two values or more.

    The interval holds well for samples of twenty and more.

    Example:
        print(mean_of([151.2, 89.0, 300.0]).text(".1f"))

    Args:
        values: the sample; their order makes no difference, as they are summed exactly.
        groups: the number of each value's group, if values of a group are alike; groups are then
            what is independent.
    """
    n = len(values)
    if n == 0:
        return Estimate(method=STUDENT)
    mean = math.fsum(values) / n
    half = t_quantile(n - 1) * _std(values, mean) / math.sqrt(n) if n > 1 else _NAN
    if groups is not None:
        over = _half_width_over(groups, values, mean)
        half = max(half, over) if over == over else over
    return Estimate(mean, mean - half, mean + half, STUDENT)


def _half_width_over(groups: Sequence[int], values: Sequence[float], mean: float) -> float:
    """Return half the width of the 95% interval of a mean over groups of values; nan for fewer than
    two.

    It is that of a mean over clusters (Cochran, Sampling Techniques, 1977, chapter 9A) with
    Student's t. A few groups may have equal means by chance, so `mean_of` never takes it to be
    narrower than that of independent values.
    """
    totals = dict.fromkeys(groups, 0.0)
    for value, group in zip(values, groups, strict=True):
        totals[group] += value - mean
    count = len(totals)
    if count < 2:
        return _NAN
    squares = math.fsum(total * total for total in totals.values()) * count / (count - 1)
    return t_quantile(count - 1) * math.sqrt(squares) / len(values)


def std_of(values: Sequence[float]) -> Estimate:
    """Estimate the standard deviation (n - 1) of a sample of two values or more.

    Its interval by chi-square assumes values that are normally distributed, and is a rough guide
    where they are not.
    """
    from scipy.special import chdtri  # scipy.stats would take a second to import

    n = len(values)
    if n < 2:
        return Estimate(method=CHI_SQUARE)
    std = _std(values, math.fsum(values) / n)
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = (
        std * math.sqrt((n - 1) / float(chdtri(n - 1, share))) for share in (tail, 1.0 - tail)
    )
    return Estimate(std, low, high, CHI_SQUARE)


def _std(values: Sequence[float], mean: float) -> float:
    return math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (len(values) - 1))


def share_of(count: int, n: int, method: Literal["wilson", "exact"] = "wilson") -> Estimate:
    """Estimate a share, with its interval by Wilson (1927), or by Clopper and Pearson (1934)."""
    from scipy.stats import binomtest

    if n == 0:
        return Estimate(method=_OF_SHARES[method])
    low, high = binomtest(count, n).proportion_ci(CONFIDENCE, method=method)
    return Estimate(count / n, float(low), float(high), _OF_SHARES[method])


def t_quantile(freedom: int, confidence: float = CONFIDENCE) -> float:
    """Return half the width of the interval of Student's t with that many degrees of freedom."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, (1.0 + confidence) / 2.0))
