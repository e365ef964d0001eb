"""When a manager needs no more runs: its mean is known well enough. Decided in run order, so always at the same run."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from difflib import get_close_matches

from suave_des.campaign.outcomes import COLUMNS, Failure, Outcome
from suave_des.campaign.plan import Group
from suave_des.errors import InputError
from suave_des.estimates import Running
from suave_des.simulation.result import MissionMetrics

FEWEST_RUNS = 20
"""Missions with a value that a manager has at least: the interval of fewer is not to be relied on (estimates.py)."""
RUNS_LIMIT_DEFAULT = 10_000
"""Runs at most, when a limit to the interval is given and no number of runs."""
SEARCH_TIME = "search_time_s"

_NO_MEASURES = ("run", "seed")
METRICS = tuple(
    field.name
    for field in fields(MissionMetrics)
    if field.name not in _NO_MEASURES and str(field.type).removesuffix(" | None") in ("float", "int")
)
"""Columns of runs.csv that a mean can be asked of."""


@dataclass(frozen=True, slots=True)
class UntilCi:
    """Missions are run until the 95% interval of a metric's mean is narrow.

    Attributes:
        metric: column of runs.csv.
        half_width: half the interval's width is to be below this, in the metric's unit.
    """

    metric: str
    half_width: float

    def __str__(self) -> str:
        """As given."""
        return f"{self.metric}:{self.half_width:g}"


def parse_until_ci(text: str) -> UntilCi:
    """Read METRIC:HALF_WIDTH, for instance search_time_s:5.

    Raises:
        InputError: it has no such form, there is no such metric, or the number is not above 0.
    """
    name, colon, number = (part.strip() for part in text.partition(":"))
    if not colon:
        raise _wrong(text, "there is no colon in it", f"give METRIC:HALF_WIDTH, for instance {SEARCH_TIME}:5")
    if name not in METRICS:
        near = get_close_matches(name, METRICS, n=1)
        meant = f"did you mean {near[0]}? " if near else ""
        raise _wrong(text, f"runs.csv has no metric {name!r}", f"{meant}there are {', '.join(METRICS)}")
    try:
        half_width = float(number)
    except ValueError:
        half_width = math.nan
    if not 0.0 < half_width < math.inf:
        raise _wrong(text, f"{number!r} is no half-width", "give a number above 0, in the metric's unit")
    return UntilCi(name, half_width)


def _wrong(text: str, what: str, remedy: str) -> InputError:
    return InputError(f"{text!r}: {what}", place="until_ci", remedy=remedy)


@dataclass(frozen=True, slots=True)
class Stop:
    """Where a manager's missions end.

    Attributes:
        group: sweep's point, and place of the manager.
        last_run: the last that counts; the last planned if the interval did not become narrow.
        reached: whether the interval became narrow.
        is_complete: whether all missions up to the last run are done.
        n: missions with a value among those up to the last run.
        mean: of the metric over these; none if there are none.
        half_width: of its interval; none if there are fewer than two.
    """

    group: Group
    last_run: int
    reached: bool
    is_complete: bool
    n: int
    mean: float | None
    half_width: float | None


class Standing:
    """How far the missions of one group (a manager at a point) are.

    Outcomes come in any order. The mean is that of all runs up to the first that is still missing.

    Args:
        runs: planned.
        metric: column whose mean is followed.
        half_width: the group is over as soon as the interval's half-width is below this; none: after all runs.
    """

    __slots__ = ("_half_width", "_next", "_place", "_waiting", "done", "failed", "is_narrow", "last_run", "values")

    def __init__(self, runs: int, metric: str, half_width: float | None) -> None:
        self._place = COLUMNS.index(metric)
        self._half_width = half_width
        self._next = 1
        self._waiting: dict[int, object] = {}
        self.done = self.failed = 0
        self.last_run = runs
        self.is_narrow = False
        self.values = Running()

    @property
    def is_over(self) -> bool:
        """Whether no more missions are to come."""
        return self.done == self.last_run

    def take(self, run: int, outcome: Outcome) -> None:
        """Count an outcome; one of a run that is counted already, or that does not count any more, changes nothing."""
        if run > self.last_run or run < self._next or run in self._waiting:
            return
        self.done += 1
        self.failed += isinstance(outcome, Failure)
        self._waiting[run] = outcome if isinstance(outcome, Failure) else outcome[self._place]
        while self._next in self._waiting:
            value = self._waiting.pop(self._next)
            self._next += 1
            if self._is_narrow_with(value):
                self._end()
                return

    def _is_narrow_with(self, value: object) -> bool:
        if not isinstance(value, float | int):  # a failed mission, or one in which nothing was measured
            return False
        self.values.add(value)
        if self._half_width is None or self.values.n < FEWEST_RUNS:
            return False
        half_width = self.values.half_width
        return half_width is not None and half_width < self._half_width

    def stop(self, group: Group) -> Stop:
        """Where the group ends, as far as is known."""
        known = self.values
        mean = known.mean if known.n else None
        return Stop(group, self.last_run, self.is_narrow, self.is_over, known.n, mean, known.half_width)

    def _end(self) -> None:
        """The run before the next one is the last; what is known of later ones does not count."""
        self.is_narrow = True
        self.last_run = self._next - 1
        self.failed -= sum(isinstance(outcome, Failure) for outcome in self._waiting.values())
        self.done = self.last_run
        self._waiting.clear()
