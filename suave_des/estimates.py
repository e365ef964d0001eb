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

    def add(self, value: float) -> None:
        """Count a value."""
        self.n += 1
        off = value - self.mean
        self.mean += off / self.n
        self._squares += off * (value - self.mean)

    @property
    def half_width(self) -> float | None:
        """Half the width of the 95% interval of the mean by Student's t, None for fewer than two values."""
        if self.n < 2:
            return None
        return t_quantile(self.n - 1) * math.sqrt(self._squares / (self.n - 1) / self.n)

    def is_narrow(self, wanted: float | None, fewest: int) -> bool:
        """Return whether the half-width is below one that is wanted, and there are enough values to tell."""
        if wanted is None or self.n < fewest:
            return False
        half_width = self.half_width
        return half_width is not None and half_width < wanted
