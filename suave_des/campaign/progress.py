"""How far a campaign is: what is done, each manager's mean so far, and when a manager needs no more runs.

Whether to stop early is decided in the order of the runs, so always at the same run.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches

from suave_des.campaign.missions import COLUMNS, Failure, Finished, Group, Outcome
from suave_des.errors import InputError
from suave_des.estimates import RunningMean
from suave_des.metrics.result import MissionMetrics

FEWEST_RUNS = 20
"""Missions with a value that a manager has at least: the interval of fewer is not reliable (estimates.py)."""
RUNS_LIMIT_DEFAULT = 10_000
"""Runs at most, when a limit to the interval is given and no number of runs."""
SEARCH_TIME = "search_time_s"
GROUPS_SHOWN = 8
"""Of a sweep with more groups, those that are shown are the ones under way and those that were done last."""

METRICS = tuple(
    field.name
    for field in fields(MissionMetrics)
    if field.name not in ("run", "seed") and str(field.type).removesuffix(" | None") in ("float", "int")
)
"""Columns of runs.csv that have a mean."""


@dataclass(frozen=True, slots=True)
class UntilCi:
    """Missions are run until the 95% interval of a metric's mean is narrow.

    Attributes:
        metric: column of runs.csv.
        half_width: half the interval's width is to be below this, in the metric's unit.
    """

    metric: str
    half_width: float


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
        raise _wrong(text, f"{number!r} is not a half-width", "give a number above 0, in the metric's unit")
    return UntilCi(name, half_width)


def _wrong(text: str, what: str, remedy: str) -> InputError:
    return InputError(f"{text!r}: {what}", place="until_ci", remedy=remedy)


@dataclass(frozen=True, slots=True)
class GroupProgress:
    """How far one manager is, at one point of a sweep.

    Attributes:
        point: number of the sweep's point, from 0; 0 without a sweep.
        manager: its name.
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        runs: missions that are to be done: those planned, or those up to the run after which it was stopped.
        is_narrow: whether it was stopped because its interval is narrow.
        n: missions with a value among the first runs, up to the first that is missing.
        mean: of the metric over these; None if there are none.
        half_width: half the width of its 95% interval; None for fewer than two missions.
    """

    point: int
    manager: str
    done: int
    failed: int
    runs: int
    is_narrow: bool
    n: int
    mean: float | None
    half_width: float | None

    @property
    def is_complete(self) -> bool:
        """Whether no more missions are to come."""
        return self.done == self.runs


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is, in missions.

    Attributes:
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        total: missions that are to be done; it decreases when a manager is stopped early.
        before: of those done, how many were done when the campaign was resumed.
        metric: column of runs.csv of which groups() gives the mean.
        groups: returns the progress of each manager at each point, at most GROUPS_SHOWN, at the time of the call.
    """

    done: int
    failed: int
    total: int
    before: int = 0
    metric: str = SEARCH_TIME
    groups: Callable[[], tuple[GroupProgress, ...]] = field(default=tuple, repr=False, compare=False)


OnProgress = Callable[[Progress], None]


class GroupTracker:
    """Counts the missions of one group (a manager at a point), whose outcomes come in any order.

    Args:
        runs: planned.
        metric: column whose mean is followed.
        half_width: the group is over as soon as the interval's half-width is below this; None: after all runs.
    """

    __slots__ = ("_half_width", "_index", "_next", "_waiting", "done", "failed", "is_narrow", "runs", "values")

    def __init__(self, runs: int, metric: str, half_width: float | None) -> None:
        self._index = COLUMNS.index(metric)
        self._half_width = half_width
        self._next = 1
        self._waiting: dict[int, object] = {}
        self.done = self.failed = 0
        self.runs = runs
        self.is_narrow = False
        self.values = RunningMean()

    def add(self, run: int, outcome: Outcome) -> None:
        """Count an outcome, unless its run is counted already or lies beyond the last one."""
        if run > self.runs or run < self._next or run in self._waiting:
            return
        self.done += 1
        self.failed += isinstance(outcome, Failure)
        self._waiting[run] = outcome if isinstance(outcome, Failure) else outcome[self._index]
        while self._next in self._waiting:
            value = self._waiting.pop(self._next)
            self._next += 1
            if isinstance(value, float | int) and self._is_narrow_with(value):
                # The run before the next one is the last; what is known of later ones does not count.
                self.is_narrow = True
                self.runs = self.done = self._next - 1
                self.failed -= sum(isinstance(outcome, Failure) for outcome in self._waiting.values())
                self._waiting.clear()

    def _is_narrow_with(self, value: float) -> bool:
        self.values.add(value)
        if self._half_width is None or self.values.n < FEWEST_RUNS:
            return False
        half_width = self.values.half_width
        return half_width is not None and half_width < self._half_width

    def progress(self, point: int, manager: str) -> GroupProgress:
        """Return how far the group is."""
        known = self.values
        mean = known.mean if known.n else None
        return GroupProgress(
            point, manager, self.done, self.failed, self.runs, self.is_narrow, known.n, mean, known.half_width
        )


class ProgressTracker:
    """Counts the outcomes of a campaign, and knows which managers need no more runs.

    Of groups that are done, it keeps where they end only if that is not always the last run.

    Args:
        points: number of points of the sweep.
        managers: names, in the campaign's order.
        runs: planned for each group.
        until: when a group is over before that, if at all.
    """

    def __init__(self, points: int, managers: Sequence[str], runs: int, until: UntilCi | None) -> None:
        self._managers, self._runs, self._until = managers, runs, until
        self._groups_in_all = points * len(managers)
        self._under_way: dict[Group, GroupTracker] = {}
        self._complete: dict[Group, GroupProgress] = {}
        self._latest_complete: deque[tuple[Group, GroupProgress]] = deque(maxlen=GROUPS_SHOWN)
        self.done = self.failed = self._before = 0
        self.total = runs * self._groups_in_all

    def add(self, finished: Iterable[Finished]) -> None:
        """Count outcomes, each once; they may come in any order."""
        for key, outcome in finished:
            group = (key.point, key.manager)
            tracker = self._under_way.get(group)
            if tracker is None:
                if group in self._complete:
                    continue
                tracker = self._under_way[group] = self._new()
            done, failed, runs = tracker.done, tracker.failed, tracker.runs
            tracker.add(key.run, outcome)
            self.done += tracker.done - done
            self.failed += tracker.failed - failed
            self.total += tracker.runs - runs
            if tracker.done == tracker.runs:
                del self._under_way[group]
                complete = self._progress_of(group, tracker)
                self._latest_complete.append((group, complete))
                if self._until is not None:
                    self._complete[group] = complete

    def add_earlier(self, finished: Iterable[Finished]) -> None:
        """Count outcomes that were there when the campaign was resumed."""
        self.add(finished)
        self._before = self.done

    def _new(self) -> GroupTracker:
        return GroupTracker(self._runs, self._metric, None if self._until is None else self._until.half_width)

    @property
    def _metric(self) -> str:
        return SEARCH_TIME if self._until is None else self._until.metric

    def _progress_of(self, group: Group, tracker: GroupTracker) -> GroupProgress:
        return tracker.progress(group[0], self._managers[group[1]])

    def is_over(self, group: Group) -> bool:
        """Return whether a group needs no more runs, because its interval is narrow."""
        return group in self._complete

    def progress(self) -> Progress:
        """Return how far the campaign is."""
        return Progress(self.done, self.failed, self.total, self._before, self._metric, self._groups)

    def _groups(self) -> tuple[GroupProgress, ...]:
        known = dict(self._latest_complete)
        known |= {group: self._progress_of(group, tracker) for group, tracker in self._under_way.items()}
        if self._groups_in_all <= GROUPS_SHOWN:
            groups = (divmod(index, len(self._managers)) for index in range(self._groups_in_all))
            known = {group: self._progress_of(group, self._new()) for group in groups} | known
        return tuple(known[group] for group in sorted(known)[-GROUPS_SHOWN:])

    def stops(self) -> tuple[GroupProgress, ...]:
        """Return where each group that was begun ends, in order; empty if all runs are wanted of each."""
        if self._until is None:
            return ()
        under_way = {group: self._progress_of(group, tracker) for group, tracker in self._under_way.items()}
        return tuple(progress for _, progress in sorted((self._complete | under_way).items()))

    def counted(self, outcomes: Iterable[Finished]) -> Iterator[Finished]:
        """Yield those outcomes of a campaign whose runs count."""
        for key, outcome in outcomes:
            stop = self._complete.get((key.point, key.manager))
            if stop is None or key.run <= stop.runs:
                yield key, outcome
