"""Signals: quantities over mission time that do not depend on the vehicle, such as the water
visibility.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from functools import lru_cache

Signal = Callable[[float], float]
"""Value at a mission time in s. Equal descriptions, except of a table, give the same function:
values can be cached.
"""


@lru_cache(maxsize=64)
def sinusoid(period_s: float, minimum: float, maximum: float, shift_s: float = 0.0) -> Signal:
    """Make a sinusoid, the exemplar's water visibility.

    a cos(2 pi (t + shift) / period) + a + minimum, with the amplitude a = (maximum - minimum) / 2.
    """
    amplitude = (maximum - minimum) / 2.0
    return lambda t_s: (
        amplitude * math.cos(2.0 * math.pi * (t_s + shift_s) / period_s) + amplitude + minimum
    )


@lru_cache(maxsize=64)
def constant(value: float) -> Signal:
    """Make a constant signal."""
    return lambda t_s: value


@lru_cache(maxsize=64)
def step(time_s: float, before: float, after: float) -> Signal:
    """Make a step: `before` until time_s, `after` from then on."""
    return lambda t_s: after if t_s >= time_s else before


def table(times_s: Sequence[float], values: Sequence[float], *, linear: bool = False) -> Signal:
    """Make a signal from values at given times, ascending.

    Between two times it has the earlier value, or is interpolated linearly; outside, it has the
    nearest value.
    """

    def value(t_s: float) -> float:
        after = bisect_right(times_s, t_s)
        if after == 0:
            return values[0]
        if not linear or after == len(times_s):
            return values[after - 1]
        t0, t1 = times_s[after - 1], times_s[after]
        share = (t_s - t0) / (t1 - t0)
        return values[after - 1] + share * (values[after] - values[after - 1])

    return value
