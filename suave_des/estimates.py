"""Estimates from a sample: mean, spread, median, and 95% intervals."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

CONFIDENCE = 0.95

Interval = tuple[float, float]


def interval_columns(name: str, interval: Interval | None) -> dict[str, float | None]:
    """Return the two columns of a table that have the ends of a figure's 95% interval, by their names."""
    low, high = interval or (None, None)
    return {f"{name}_ci95_low": low, f"{name}_ci95_high": high}


def interval_text(interval: Interval | None, style: str) -> str:
    """Return an interval for a table, with its ends in a number format; empty for None."""
    return "" if interval is None else f"{interval[0]:{style}} to {interval[1]:{style}}"


def percent(share: float) -> str:
    """Write a share in whole per cent: "100%" of all only, and "0%" of none only."""
    text = f"{share:.0%}"
    if share < 1.0 and text == "100%":
        return ">99%"
    return "<1%" if share > 0.0 and text == "0%" else text


@dataclass(frozen=True, slots=True)
class Estimate:
    """Estimates from a sample; None where it has too few values.

    Attributes:
        n: number of values.
        mean: None for an empty sample.
        std: sample standard deviation (n - 1), None for fewer than two values.
        median: None for an empty sample.
        mean_interval: 95% interval of the mean by Student's t, None for fewer than two values.
        std_interval: 95% interval of the standard deviation by chi-square, None for fewer than two values.
    """

    n: int
    mean: float | None = None
    std: float | None = None
    median: float | None = None
    mean_interval: Interval | None = None
    std_interval: Interval | None = None


def estimate(values: Sequence[float]) -> Estimate:
    """Return the estimates from a sample.

    The interval of the mean holds well for samples of twenty and more; that of the standard deviation assumes values
    that are normally distributed, and is a rough guide where they are not.
    """
    from scipy.special import chdtri  # scipy.stats would take a second to import

    n = len(values)
    if n == 0:
        return Estimate(0)
    mean = math.fsum(values) / n  # summed exactly: the order of the values makes no difference
    median = statistics.median(values)
    if n == 1:
        return Estimate(1, mean, median=median)
    std = math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (n - 1))
    tail = (1.0 - CONFIDENCE) / 2.0
    half = t_quantile(n - 1) * std / math.sqrt(n)
    low, high = (std * math.sqrt((n - 1) / float(chdtri(n - 1, share))) for share in (tail, 1.0 - tail))
    return Estimate(n, mean, std, median, (mean - half, mean + half), (low, high))


def interval_in_groups(values: Sequence[float], groups: Sequence[int]) -> Interval | None:
    """Return the 95% interval of the mean of values of which those of a group are alike; None for one group.

    Args:
        values: group by group.
        groups: number of each value's group.
    """
    found = GroupedMean()
    for value, group in zip(values, groups, strict=True):
        found.add(value, group)
    half = found.half_width
    return None if half is None else (found.mean - half, found.mean + half)


def t_quantile(freedom: int) -> float:
    """Return half the width of the 95% interval of Student's t with that many degrees of freedom."""
    from scipy.special import stdtrit

    return float(stdtrit(freedom, (1.0 + CONFIDENCE) / 2.0))


class RunningMean:
    """Mean of values that come one by one, and its 95% interval, by Welford's sums (Technometrics 4, 1962)."""

    __slots__ = ("_squares", "mean", "n")

    def __init__(self) -> None:
        self.n = 0
        self.mean = self._squares = 0.0

    def add(self, value: float, group: int = 0) -> None:
        """Count a value; a GroupedMean takes the number of its group, too."""
        self.n += 1
        off = value - self.mean
        self.mean += off / self.n
        self._squares += off * (value - self.mean)

    @property
    def independent(self) -> int:
        """Number of independent values."""
        return self.n

    @property
    def half_width(self) -> float | None:
        """Half the width of the 95% interval of the mean by Student's t, None for fewer than two values."""
        if self.n < 2:
            return None
        return t_quantile(self.n - 1) * math.sqrt(self._squares / (self.n - 1) / self.n)

    def is_narrow(self, wanted: float | None, fewest: int) -> bool:
        """Return whether the half-width is below one that is wanted, and there are enough values to tell."""
        if wanted is None or self.independent < fewest:
            return False
        half_width = self.half_width
        return half_width is not None and half_width < wanted


class GroupedMean(RunningMean):
    """Mean of values that come group by group, and its 95% interval: groups are independent, values are not.

    It is that of a mean over clusters (Cochran, Sampling Techniques, 1977, chapter 9A) with Student's t, of as many
    degrees of freedom as there are groups but one; of groups of one size, that of the groups' means. It is never
    narrower than if all values were independent: a few groups may have equal means by chance.
    """

    __slots__ = ("_closed", "_first", "_groups", "_last", "_open")

    def __init__(self) -> None:
        super().__init__()
        self._groups, self._last, self._first = 0, 0, 0.0
        self._open = self._closed = (0.0, 0.0, 0.0)

    def add(self, value: float, group: int = 0) -> None:
        """Count a value of a group."""
        super().add(value)
        if self._groups == 0:
            self._first = value  # sums are of differences from it, which are rounded less
        if self._groups == 0 or group != self._last:
            self._closed, self._open = self._sums(), (0.0, 0.0, 0.0)
            self._groups, self._last = self._groups + 1, group
        total, size, _ = self._open
        self._open = (total + value - self._first, size + 1.0, 0.0)

    def _sums(self) -> tuple[float, float, float]:
        """Return the sums over the groups of total², total * size and size²."""
        (a, b, c), (total, size, _) = self._closed, self._open
        return a + total * total, b + total * size, c + size * size

    @property
    def independent(self) -> int:
        """Number of groups."""
        return self._groups

    @property
    def half_width(self) -> float | None:
        """Half the width of the 95% interval of the mean, None for fewer than two groups."""
        if self._groups < 2:
            return None
        off, (a, b, c) = self.mean - self._first, self._sums()
        squares = max(0.0, a - 2.0 * off * b + off * off * c) * self._groups / (self._groups - 1)
        of_groups = t_quantile(self._groups - 1) * math.sqrt(squares) / self.n
        return max(of_groups, super().half_width or 0.0)
