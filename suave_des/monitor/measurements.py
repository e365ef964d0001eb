"""What monitors measure, as tables: it can be looked up without anybody waiting for its publication."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol

from suave_des.clock import tick_at_or_after

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Measured(Protocol):
    """What a monitor measures of a quality attribute."""

    @property
    def key(self) -> str:
        """Name of the quality attribute."""

    @property
    def times_s(self) -> Sequence[float]:
        """Times of the published values that are known by now."""

    @property
    def values(self) -> Sequence[float]:
        """The published values that are known by now."""

    def published(self, t_s: float) -> int:
        """How many values are published until mission time t, which must not lie in the future."""

    def leaves_at_s(self, t_s: float, *bounds: float) -> float:
        """Time of the first value after t that is, or may be, between no pair of bounds; inf: there is none."""


@dataclass(frozen=True, slots=True)
class Measurements:
    """What a signal's monitor measures in a run: the times at which the published value changes, and the values.

    A monitor that repeats an unchanged value tells nobody anything new, so only values that differ from the one before
    are kept; they keep the times that the monitor's period gives them.
    """

    key: str
    times_s: tuple[float, ...]
    values: tuple[float, ...]
    phase_s: float
    period_s: float
    arrays: tuple[NDArray[np.float64], NDArray[np.float64]] = field(repr=False, compare=False)
    """Times and values once more, for whoever looks at all of them at once."""

    def published(self, t_s: float) -> int:
        """How many values are published until mission time t."""
        return bisect_right(self.times_s, t_s)

    def leaves_at_s(self, t_s: float, *bounds: float) -> float:
        """Time of the first value after mission time t that is between no pair of bounds; inf: there is none.

        Args:
            t_s: mission time.
            bounds: pairs in ascending order.
        """
        outside = _outside(self.arrays[1].tobytes(), bounds)
        first = bisect_left(outside, self.published(t_s))
        return self.times_s[outside[first]] if first < len(outside) else math.inf

    def next_message_s(self, t_s: float) -> float:
        """Time of the first message, changed or not, at or after t."""
        return tick_at_or_after(t_s, self.phase_s, self.period_s)


@lru_cache(maxsize=64)
def _outside(values: bytes, bounds: tuple[float, ...]) -> list[int]:
    """Places of the values (float64) that are between no pair of bounds.

    Without noise they are the same in most runs.
    """
    if len(bounds) % 2:
        raise ValueError(f"bounds come in pairs, and {bounds} is not that")
    import numpy as np  # a process that only hands out missions does without

    measured, edges = np.frombuffer(values), np.array(bounds)
    passed = np.searchsorted(edges, measured)
    outside = passed % 2 == 0
    outside[~outside] = edges[passed[~outside]] == measured[~outside]
    return np.flatnonzero(outside).tolist()


class BatteryLevel:
    """The battery's level, which falls linearly from 1 and is back at 1 at once at the recharge station.

    It is worked out when somebody wants to know it, from where the vehicle was at each message.

    Args:
        is_at_station: whether the vehicle is at the station at a mission time.
        discharge_time_s: time from full to empty.
        period_s: publishing period.
        phase_s: time of the first message.
    """

    key = "battery_level"

    def __init__(
        self, is_at_station: Callable[[float], bool], *, discharge_time_s: float, period_s: float, phase_s: float
    ) -> None:
        self._is_at_station = is_at_station
        self._discharge_time_s = discharge_time_s
        self.phase_s = phase_s
        self.period_s = period_s
        self._next_s = phase_s
        self._full_at_s = 0.0
        self.times_s: list[float] = []
        self.values: list[float] = []

    def published(self, t_s: float) -> int:
        """How many values are published until mission time t, which must not lie in the future."""
        while self._next_s <= t_s:
            if self._is_at_station(self._next_s):
                self._full_at_s = self._next_s
            self.times_s.append(self._next_s)
            self.values.append(max(0.0, 1.0 - (self._next_s - self._full_at_s) / self._discharge_time_s))
            self._next_s += self.period_s
        return bisect_right(self.times_s, t_s)

    def leaves_at_s(self, t_s: float, *bounds: float) -> float:
        """Time of the first value after t, which is now: what it will be depends on where the vehicle goes."""
        self.published(t_s)
        return self._next_s
