"""Progress of a campaign: missions done, each manager's mean so far, and when a manager needs no more runs.

Whether to stop early is decided in the order of the runs, so always at the same run.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from suave_des.campaign.missions import COLUMNS, Finished, MissionFailure, MissionGroup, MissionOutcome
from suave_des.campaign.stopping import FEWEST_PAIRS, FEWEST_RUNS, SEARCH_TIME, UntilCi
from suave_des.estimates import GroupedMean, RunningMean

PAIR_STEP = 10
"""Runs after which a difference is looked at."""
GROUPS_SHOWN = 8
"""Of a sweep with more groups, those that are shown are the ones under way and those that were done last."""


@dataclass(frozen=True, slots=True)
class GroupProgress:
    """Progress of one manager at one point of a sweep.

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
        """Whether all missions are done."""
        return self.done == self.runs


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a campaign, in missions.

    Attributes:
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        total: missions that are to be done; it decreases when a manager is stopped early.
        before: number of those that were done when the campaign was resumed.
        metric: column of runs.csv of which groups() gives the mean.
        groups: returns the progress of each manager at each point, at most GROUPS_SHOWN, at the time of the call.
    """

    done: int
    failed: int
    total: int
    before: int = 0
    metric: str = SEARCH_TIME
    groups: Callable[[], tuple[GroupProgress, ...]] = field(default=tuple, repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class PairProgress:
    """Precision of the difference of two managers at one point of a sweep.

    Attributes:
        point: number of the sweep's point, from 0.
        n: runs in which both have a value, up to the first that is missing.
        difference: mean of first - second; None if there are none.
        half_width: half the width of its 95% interval; None for fewer than two runs.
        is_narrow: whether the managers were stopped because of it.
    """

    point: int
    n: int
    difference: float | None
    half_width: float | None
    is_narrow: bool


OnProgress = Callable[[Progress], None]


def running_mean(runs_sharing_draw: int) -> RunningMean:
    """Return a mean of runs, of which so many in a row share a draw."""
    return RunningMean() if runs_sharing_draw == 1 else GroupedMean()


class PairTracker:
    """Tracks the difference of two managers in the order of the runs, until it is known precisely enough.

    It checks only after every PAIR_STEP runs: checking after each run would stop too often when the spread happens to
    be small.

    Args:
        half_width: wanted.
        runs_sharing_draw: consecutive runs that share a draw.

    Attributes:
        last_run: the run after which no more are needed; None until that is known.
        differences: mean of first - second, in the runs in which both have a value.
    """

    def __init__(self, half_width: float, runs_sharing_draw: int = 1) -> None:
        self._half_width, self._runs_sharing_draw = half_width, runs_sharing_draw
        self._waiting: tuple[dict[int, object], dict[int, object]] = ({}, {})
        self._next = 1
        self.last_run: int | None = None
        self.differences = running_mean(runs_sharing_draw)

    def add(self, side: int, run: int, value: object) -> None:
        """Take the value of a manager in a run; anything but a number is a run without one.

        Args:
            side: 0 for the first manager, 1 for the second.
            run: its number.
            value: of the metric.
        """
        if self.last_run is not None or run < self._next:
            return
        first, second = self._waiting
        self._waiting[side][run] = value
        while self._next in first and self._next in second:
            x, y = first.pop(self._next), second.pop(self._next)
            draw = (self._next - 1) // self._runs_sharing_draw
            self._next += 1
            if isinstance(x, float | int) and isinstance(y, float | int):
                self.differences.add(x - y, draw)
            if (self._next - 1) % PAIR_STEP == 0 and self.differences.is_narrow(self._half_width, FEWEST_PAIRS):
                self.last_run = self._next - 1
                return

    def progress(self, point: int) -> PairProgress:
        """Return the precision of the difference."""
        known = self.differences
        is_narrow = self.last_run is not None
        return PairProgress(point, known.n, known.mean if known.n else None, known.half_width, is_narrow)


class GroupTracker:
    """Counts the missions of one group (a manager at a point), whose outcomes come in any order.

    Args:
        runs: planned.
        metric: column whose mean is followed.
        half_width: the group is over as soon as the interval's half-width is below this; None: after all runs.
        can_end_earlier: whether ended_at may be called, for which all values are kept.
        runs_sharing_draw: consecutive runs that share a draw.
    """

    def __init__(
        self,
        runs: int,
        metric: str,
        half_width: float | None,
        *,
        can_end_earlier: bool = False,
        runs_sharing_draw: int = 1,
    ) -> None:
        self._values: dict[int, object] | None = {} if can_end_earlier else None
        self._metric, self._index = metric, COLUMNS.index(metric)
        self._half_width = half_width
        self._next = 1
        self._waiting: dict[int, object] = {}
        self.done = self.failed = 0
        self.runs = runs
        self.is_narrow = False
        self._runs_sharing_draw = runs_sharing_draw
        self.values = running_mean(runs_sharing_draw)

    def add(self, run: int, outcome: MissionOutcome) -> None:
        """Count an outcome, unless its run is counted already or lies beyond the last one."""
        self._add(run, outcome if isinstance(outcome, MissionFailure) else outcome[self._index])

    def _add(self, run: int, found: object) -> None:
        """Count a value of the metric, or a failure."""
        if run > self.runs or run < self._next or run in self._waiting:
            return
        self.done += 1
        self.failed += isinstance(found, MissionFailure)
        self._waiting[run] = found
        if self._values is not None:
            self._values[run] = found
        while self._next in self._waiting:
            value = self._waiting.pop(self._next)
            self._next += 1
            if not isinstance(value, float | int):
                continue
            self.values.add(value, (self._next - 2) // self._runs_sharing_draw)
            if self.values.is_narrow(self._half_width, FEWEST_RUNS):
                # The run before the next one is the last; what is known of later ones does not count.
                self.is_narrow = True
                self.runs = self.done = self._next - 1
                self.failed -= sum(isinstance(outcome, MissionFailure) for outcome in self._waiting.values())
                self._waiting.clear()

    def ended_at(self, run: int) -> GroupTracker:
        """Return a tracker that has the runs up to one that may be over already, and no others."""
        assert self._values is not None
        ended = GroupTracker(run, self._metric, None, runs_sharing_draw=self._runs_sharing_draw)
        for number, found in self._values.items():
            ended._add(number, found)
        ended.is_narrow = True
        return ended

    def progress(self, point: int, manager: str) -> GroupProgress:
        """Return the group's progress."""
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
        runs_sharing_draw: consecutive runs that share a draw: the draws are independent, the runs are not.
    """

    def __init__(
        self, points: int, managers: Sequence[str], runs: int, until: UntilCi | None, runs_sharing_draw: int = 1
    ) -> None:
        self._managers, self._runs, self._until, self._runs_sharing_draw = managers, runs, until, runs_sharing_draw
        self._groups_in_all = points * len(managers)
        self._under_way: dict[MissionGroup, GroupTracker] = {}
        self._complete: dict[MissionGroup, GroupProgress] = {}
        self._latest_complete: deque[tuple[MissionGroup, GroupProgress]] = deque(maxlen=GROUPS_SHOWN)
        self.done = self.failed = self._before = 0
        self.total = runs * self._groups_in_all
        self._pairs: dict[int, PairTracker] = {}
        self._sides: dict[int, int] = {}
        if until is not None and until.pair is not None:
            self._sides = {managers.index(name): side for side, name in enumerate(until.pair)}

    def add(self, finished: Iterable[Finished]) -> None:
        """Count outcomes, each once; they may come in any order."""
        for key, outcome in finished:
            group = (key.point, key.manager)
            tracker = self._under_way.get(group)
            if tracker is None:
                if group in self._complete:
                    continue
                tracker = self._under_way[group] = self._new()
            self._count(tracker, -1)
            tracker.add(key.run, outcome)
            self._count(tracker)
            if self._sides:
                self._follow_pair(key.point, key.manager, key.run, outcome)
            elif tracker.done == tracker.runs:
                del self._under_way[group]
                complete = self._progress_of(group, tracker)
                self._latest_complete.append((group, complete))
                if self._until is not None:
                    self._complete[group] = complete

    def _follow_pair(self, point: int, manager: int, run: int, outcome: MissionOutcome) -> None:
        """Add an outcome to the difference of its point; end all managers there when it is precise enough."""
        assert self._until is not None
        if manager not in self._sides:
            return
        pair = self._pairs.setdefault(point, PairTracker(self._until.half_width, self._runs_sharing_draw))
        if pair.last_run is not None:
            return
        value = None if isinstance(outcome, MissionFailure) else outcome[COLUMNS.index(self._until.metric)]
        pair.add(self._sides[manager], run, value)
        if pair.last_run is None:
            return
        for group in ((point, number) for number in range(len(self._managers))):
            tracker = self._under_way.get(group) or self._new()
            self._count(tracker, -1)
            self._under_way[group] = tracker.ended_at(pair.last_run)
            self._count(self._under_way[group])

    def _count(self, tracker: GroupTracker, sign: int = 1) -> None:
        """Add a group's counts to those of the campaign; with -1, subtract them."""
        self.done += sign * tracker.done
        self.failed += sign * tracker.failed
        self.total += sign * tracker.runs

    @property
    def needs_pairs(self) -> bool:
        """Whether the difference of two managers is tracked."""
        return bool(self._sides)

    def pairs(self) -> tuple[PairProgress, ...]:
        """Return the precision of the difference at each point begun so far; empty unless a difference is tracked."""
        return tuple(pair.progress(point) for point, pair in sorted(self._pairs.items()))

    def add_earlier(self, finished: Iterable[Finished]) -> None:
        """Count the outcomes that existed when the campaign was resumed."""
        self.add(finished)
        self._before = self.done

    def _new(self) -> GroupTracker:
        half_width = None if self._until is None or self._sides else self._until.half_width
        return GroupTracker(
            self._runs,
            self._metric,
            half_width,
            can_end_earlier=bool(self._sides),
            runs_sharing_draw=self._runs_sharing_draw,
        )

    @property
    def _metric(self) -> str:
        return SEARCH_TIME if self._until is None else self._until.metric

    def _progress_of(self, group: MissionGroup, tracker: GroupTracker) -> GroupProgress:
        return tracker.progress(group[0], self._managers[group[1]])

    def is_over(self, group: MissionGroup, run: int) -> bool:
        """Return whether a group needs neither this run nor later ones, because an interval is narrow."""
        if group in self._complete:
            return run > self._complete[group].runs
        pair = self._pairs.get(group[0])
        return pair is not None and pair.last_run is not None and run > pair.last_run

    def progress(self) -> Progress:
        """Return the campaign's progress."""
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
            if not self.is_over((key.point, key.manager), key.run):
                yield key, outcome
