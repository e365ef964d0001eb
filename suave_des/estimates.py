"""What a sample says about its population: mean, spread, median, and 95% intervals."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

CONFIDENCE = 0.95
_LARGE_FREEDOM = 300
"""Degrees of freedom from which an expansion alone gives Student's t well enough."""
_NEWTON_STEPS = 4
"""As many as one degree of freedom needs, for which the expansion is least good."""

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A sample's figures; those that need more values than there are, are none.

    Attributes:
        n: number of values.
        mean: none for an empty sample.
        std: sample standard deviation (n - 1), none for fewer than two values.
        median: none for an empty sample.
        mean_interval: 95% interval of the mean by Student's t, none for fewer than two values.
    """

    n: int
    mean: float | None = None
    std: float | None = None
    median: float | None = None
    mean_interval: Interval | None = None

    @property
    def std_interval(self) -> Interval | None:
        """95% interval of the standard deviation by chi-square, none for fewer than two values.

        It supposes values that are normally distributed, and is a rough guide where they are not.
        """
        if self.std is None:
            return None
        from scipy.special import chdtri  # scipy.stats would take a second to import

        tail = (1.0 - CONFIDENCE) / 2.0
        freedom = self.n - 1
        low, high = (self.std * math.sqrt(freedom / float(chdtri(freedom, share))) for share in (tail, 1.0 - tail))
        return low, high


def estimate(values: Sequence[float]) -> Estimate:
    """Figures of a sample.

    The interval of the mean holds well for samples of twenty and more.
    """
    n = len(values)
    if n == 0:
        return Estimate(0)
    mean = math.fsum(values) / n  # summed exactly: the order of the values makes no difference
    median = statistics.median(values)
    if n == 1:
        return Estimate(1, mean, median=median)
    std = math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (n - 1))
    half = t_quantile(n - 1) * std / math.sqrt(n)
    return Estimate(n, mean, std, median, (mean - half, mean + half))


@lru_cache(maxsize=1024)
def t_quantile(freedom: int) -> float:
    """Half the width of the 95% interval of Student's t with that many degrees of freedom, to a relative 1e-12.

    Reckoned here, as to import scipy.special for it would take longer than the missions of a short campaign. Formulas
    of Abramowitz and Stegun, Handbook of Mathematical Functions, chapter 26.7.
    """
    z = statistics.NormalDist().inv_cdf((1.0 + CONFIDENCE) / 2.0)
    terms = (  # of 26.7.5, an expansion in 1 / freedom
        z,
        (z**3 + z) / 4.0,
        (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0,
        (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0,
        (79.0 * z**9 + 776.0 * z**7 + 1482.0 * z**5 - 1920.0 * z**3 - 945.0 * z) / 92160.0,
    )
    t = sum(term / math.pow(freedom, power) for power, term in enumerate(terms))
    if freedom >= _LARGE_FREEDOM:
        return t
    # Newton's steps from there. None goes too far: t is less than what is looked for, and the share inside is concave.
    scale = math.gamma((freedom + 1) / 2.0) / (math.gamma(freedom / 2.0) * math.sqrt(freedom * math.pi))
    for _ in range(_NEWTON_STEPS):
        density = 2.0 * scale * math.pow(1.0 + t * t / freedom, -(freedom + 1) / 2.0)
        t += (CONFIDENCE - _share_inside(t, freedom)) / density
    return t


def _share_inside(t: float, freedom: int) -> float:
    """Probability that a value of Student's t is between -t and t (26.7.3 and 26.7.4)."""
    cosine2 = freedom / (freedom + t * t)
    is_odd = freedom % 2
    term, total = math.sqrt(cosine2) if is_odd else 1.0, 0.0
    for factor in range(1 + is_odd, freedom, 2):
        total += term
        term *= cosine2 * factor / (factor + 1)
    inside = t / math.sqrt(freedom + t * t) * total
    return 2.0 / math.pi * (math.atan(t / math.sqrt(freedom)) + inside) if is_odd else inside


class Running:
    """Mean of values that come one by one, and its interval, by Welford's sums: nothing but these is kept."""

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
        """Half the width of the 95% interval of the mean by Student's t, none for fewer than two values."""
        if self.n < 2:
            return None
        return t_quantile(self.n - 1) * math.sqrt(self._squares / (self.n - 1) / self.n)
