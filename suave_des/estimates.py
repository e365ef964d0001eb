"""Estimates: values with their 95% intervals, of means, spreads and shares."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

CONFIDENCE = 0.95
STUDENT, CHI_SQUARE = "Student's t", "chi-square"
WILSON, CLOPPER_PEARSON = "Wilson", "Clopper and Pearson"
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
        """Write the interval, with its ends in a number format and multiplied by a scale; empty if there is none."""
        return f"{scale * self.low:{style}} to {scale * self.high:{style}}" if self.has_interval else ""

    def cut(self, lowest: float, highest: float) -> Estimate:
        """Cut the interval off at the limits of what is estimated, such as those of a share."""
        return replace(self, low=max(self.low, lowest), high=min(self.high, highest)) if self.has_interval else self

    def columns(self, name: str) -> dict[str, float | None]:
        """Return the three columns of a file that have the value and the ends of its interval, by their names."""
        values = (self.value, self.low, self.high)
        return dict(zip((name, *interval_names(name)), map(known, values), strict=True))


def interval_names(name: str) -> tuple[str, str]:
    """Return the names of the columns that have the ends of the interval of a value in result files."""
    return f"{name}_ci95_low", f"{name}_ci95_high"


def known(value: float | None) -> float | None:
    """Return a number as a file has it: None where it is not finite."""
    return value if value is not None and math.isfinite(value) else None


def interval_text(interval: Interval | None, style: str) -> str:
    """Write an interval for a table, with its ends in a number format; empty for None."""
    return "" if interval is None else f"{interval[0]:{style}} to {interval[1]:{style}}"


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

    Args:
        values: the sample; their order makes no difference, as they are summed exactly.
        groups: the number of each value's group, group by group, if values of a group are alike; see GroupedMean.
    """
    n = len(values)
    if n == 0:
        return Estimate(method=STUDENT)
    mean = math.fsum(values) / n
    if groups is not None:
        found = GroupedMean(zip(values, groups, strict=True))
        mean, half = found.mean, found.half_width
    else:
        half = t_quantile(n - 1) * _std(values, mean) / math.sqrt(n) if n > 1 else _NAN
    return Estimate(mean, mean - half, mean + half, STUDENT)


def std_of(values: Sequence[float]) -> Estimate:
    """Estimate the standard deviation (n - 1) of a sample of two values or more.

    Its interval by chi-square assumes values that are normally distributed, and is a rough guide where they are not.
    """
    from scipy.special import chdtri  # scipy.stats would take a second to import

    n = len(values)
    if n < 2:
        return Estimate(method=CHI_SQUARE)
    std, tail = _std(values, math.fsum(values) / n), (1.0 - CONFIDENCE) / 2.0
    low, high = (std * math.sqrt((n - 1) / float(chdtri(n - 1, share))) for share in (tail, 1.0 - tail))
    return Estimate(std, low, high, CHI_SQUARE)


def _std(values: Sequence[float], mean: float) -> float:
    return math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (len(values) - 1))


def share_of(count: int, n: int, method: Literal["wilson", "exact"] = "wilson") -> Estimate:
    """Estimate a share, with its interval by Wilson (1927), or by Clopper and Pearson (1934)."""
    from scipy.stats import binomtest

    name = WILSON if method == "wilson" else CLOPPER_PEARSON
    if n == 0:
        return Estimate(method=name)
    low, high = binomtest(count, n).proportion_ci(CONFIDENCE, method=method)
    return Estimate(count / n, float(low), float(high), name)


def t_quantile(freedom: int) -> float:
    """Return half the width of the 95% interval of Student's t with that many degrees of freedom."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, (1.0 + CONFIDENCE) / 2.0))


class GroupedMean:
    """Mean of values that come group by group, and its 95% interval: groups are independent, values are not.

    The interval is that of a mean over clusters (Cochran, Sampling Techniques, 1977, chapter 9A) with Student's t, of
    as many degrees of freedom as there are groups but one; of groups of one size, that of the groups' means; of groups
    of one value, that of a sample. It is never narrower than if all values were independent: a few groups may have
    equal means by chance. Sums are Welford's (Technometrics 4, 1962).

    Args:
        values: the first ones, each with the number of its group.
    """

    __slots__ = ("_closed", "_first", "_last", "_open", "_squares", "groups", "mean", "n")

    def __init__(self, values: Iterable[tuple[float, int]] = ()) -> None:
        self.n = self.groups = self._last = 0
        self.mean = self._squares = self._first = 0.0
        self._open = self._closed = (0.0, 0.0, 0.0)
        for value, group in values:
            self.add(value, group)

    def add(self, value: float, group: int) -> None:
        """Count a value of a group."""
        self.n += 1
        off = value - self.mean
        self.mean += off / self.n
        self._squares += off * (value - self.mean)
        if self.groups == 0:
            self._first = value  # sums are of differences from it, which are rounded less
        if self.groups == 0 or group != self._last:
            self._closed, self._open = self._sums(), (0.0, 0.0, 0.0)
            self.groups, self._last = self.groups + 1, group
        total, size, _ = self._open
        self._open = (total + value - self._first, size + 1.0, 0.0)

    def _sums(self) -> tuple[float, float, float]:
        """Return the sums over the groups of total², total * size and size²."""
        (a, b, c), (total, size, _) = self._closed, self._open
        return a + total * total, b + total * size, c + size * size

    @property
    def half_width(self) -> float:
        """Half the width of the 95% interval of the mean; nan for fewer than two groups."""
        if self.groups < 2:
            return _NAN
        off, (a, b, c) = self.mean - self._first, self._sums()
        squares = max(0.0, a - 2.0 * off * b + off * off * c) * self.groups / (self.groups - 1)
        of_groups = t_quantile(self.groups - 1) * math.sqrt(squares) / self.n
        of_values = t_quantile(self.n - 1) * math.sqrt(self._squares / (self.n - 1) / self.n)
        return max(of_groups, of_values)
