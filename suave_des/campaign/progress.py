"""How far a campaign is: what is done of it, and what is known of each manager so far."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from suave_des.campaign.early_stop import SEARCH_TIME, Standing, Stop, UntilCi
from suave_des.campaign.outcomes import Finished
from suave_des.campaign.plan import Group

GROUPS_TOLD = 8
"""Of a sweep with more groups, those that are told are the ones under way and those that were done last."""


@dataclass(frozen=True, slots=True)
class GroupProgress:
    """How far one manager is, at one point of a sweep.

    Attributes:
        point: number of the sweep's point, from 0; 0 without a sweep.
        manager: its name.
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        runs: missions that are to be done.
        is_narrow: whether it was stopped because its interval is narrow.
        mean: of the metric over the first runs, up to the first that is missing; none if there is none.
        half_width: half the width of its 95% interval; none for fewer than two missions.
    """

    point: int
    manager: str
    done: int
    failed: int
    runs: int
    is_narrow: bool
    mean: float | None
    half_width: float | None


def _no_groups() -> tuple[GroupProgress, ...]:
    return ()


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is, in missions.

    Attributes:
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        total: missions that are to be done; it becomes less when a manager is stopped early.
        before: of those done, how many were done when the campaign was resumed.
        metric: column of runs.csv of which groups() gives the mean.
        groups: tells of each manager at each point, at most GROUPS_TOLD, as it is when it is called.
    """

    done: int
    failed: int
    total: int
    before: int = 0
    metric: str = SEARCH_TIME
    groups: Callable[[], tuple[GroupProgress, ...]] = field(default=_no_groups, repr=False, compare=False)


OnProgress = Callable[[Progress], None]


class Watch:
    """Follows the outcomes of a campaign, and tells which managers need no more runs.

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
        self._under_way: dict[Group, Standing] = {}
        self._stops: dict[Group, Stop] = {}
        self._done_last: deque[tuple[Group, Standing]] = deque(maxlen=GROUPS_TOLD)
        self.done = self.failed = self._before = 0
        self.total = runs * self._groups_in_all

    @property
    def _metric(self) -> str:
        return SEARCH_TIME if self._until is None else self._until.metric

    def take(self, finished: Iterable[Finished]) -> None:
        """Count outcomes, each once; they may come in any order."""
        for key, outcome in finished:
            group = (key.point, key.manager)
            standing = self._under_way.get(group)
            if standing is None:
                if group in self._stops:
                    continue
                standing = self._under_way[group] = self._new()
            done, failed, last_run = standing.done, standing.failed, standing.last_run
            standing.take(key.run, outcome)
            self.done += standing.done - done
            self.failed += standing.failed - failed
            self.total += standing.last_run - last_run
            if standing.is_over:
                del self._under_way[group]
                self._done_last.append((group, standing))
                if self._until is not None:
                    self._stops[group] = standing.stop(group)

    def _new(self) -> Standing:
        return Standing(self._runs, self._metric, None if self._until is None else self._until.half_width)

    def take_earlier(self, finished: Iterable[Finished]) -> None:
        """Count outcomes that were there before."""
        self.take(finished)
        self._before = self.done

    def is_over(self, group: Group) -> bool:
        """Whether a group needs no more runs, because its interval is narrow."""
        return group in self._stops

    def progress(self) -> Progress:
        """How far the campaign is."""
        return Progress(self.done, self.failed, self.total, self._before, self._metric, self._groups)

    def _groups(self) -> tuple[GroupProgress, ...]:
        known = {**dict(self._done_last), **self._under_way}
        if self._groups_in_all <= GROUPS_TOLD:
            managers = len(self._managers)
            known = {divmod(place, managers): self._new() for place in range(self._groups_in_all)} | known
        return tuple(self._told(group, known[group]) for group in sorted(known)[-GROUPS_TOLD:])

    def _told(self, group: Group, standing: Standing) -> GroupProgress:
        stop = standing.stop(group)
        return GroupProgress(
            point=group[0],
            manager=self._managers[group[1]],
            done=standing.done,
            failed=standing.failed,
            runs=stop.last_run,
            is_narrow=stop.reached,
            mean=stop.mean,
            half_width=stop.half_width,
        )

    def stops(self) -> tuple[Stop, ...]:
        """Where each group that was begun ends, in order; nothing if all runs are wanted of each."""
        if self._until is None:
            return ()
        under_way = {group: standing.stop(group) for group, standing in self._under_way.items()}
        return tuple(stop for _, stop in sorted((self._stops | under_way).items()))

    def counted(self, outcomes: Iterable[Finished]) -> Iterator[Finished]:
        """Of the outcomes of a campaign, those of runs that count."""
        for key, outcome in outcomes:
            stop = self._stops.get((key.point, key.manager))
            if stop is None or key.run <= stop.last_run:
                yield key, outcome
