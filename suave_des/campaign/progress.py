"""How far a campaign is: what is done of it, and what is known of each manager so far."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from suave_des.campaign.early_stop import SEARCH_TIME, Standing, Stop, UntilCi
from suave_des.campaign.outcomes import Finished
from suave_des.campaign.plan import Group


@dataclass(frozen=True, slots=True)
class GroupProgress:
    """How far one manager is, at one point of a sweep.

    Attributes:
        point: number of the sweep's point, from 0; 0 without a sweep.
        manager: its name.
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        runs: missions that are to be done.
        is_over: whether it was stopped because its interval is narrow.
        mean: of the metric over the first runs, up to the first that is missing; none if there is none.
        half_width: half the width of its 95% interval; none for fewer than two missions.
    """

    point: int
    manager: str
    done: int
    failed: int
    runs: int
    is_over: bool
    mean: float | None
    half_width: float | None


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a campaign is, in missions.

    Attributes:
        done: missions that are done, failed ones among them.
        failed: missions that failed.
        total: missions that are to be done; it becomes less when a manager is stopped early.
        before: of those done, how many were done when the campaign was resumed.
        metric: column of runs.csv of which groups() gives the mean.
        groups: what is known of each manager at each point, at the time it is called; costs a few microseconds each.
    """

    done: int
    failed: int
    total: int
    before: int = 0
    metric: str = SEARCH_TIME
    groups: Callable[[], tuple[GroupProgress, ...]] = field(default=tuple, repr=False, compare=False)


OnProgress = Callable[[Progress], None]


class Watch:
    """Follows the outcomes of a campaign, and tells which managers need no more runs.

    Args:
        groups: all of them, in the order in which they run.
        managers: names, in the campaign's order.
        runs: planned for each group.
        until: when a group is over before that, if at all.
    """

    def __init__(self, groups: Iterable[Group], managers: Sequence[str], runs: int, until: UntilCi | None) -> None:
        self.until = until
        self._metric = SEARCH_TIME if until is None else until.metric
        half_width = None if until is None else until.half_width
        self._managers = managers
        self._standings = {group: Standing(runs, self._metric, half_width) for group in groups}
        self.done = self.failed = self._before = 0
        self.total = runs * len(self._standings)

    def take(self, finished: Iterable[Finished]) -> None:
        """Count outcomes."""
        for key, outcome in finished:
            standing = self._standings[key.point, key.manager]
            self.done -= standing.done
            self.failed -= standing.failed
            self.total -= standing.last_run
            standing.take(key.run, outcome)
            self.done += standing.done
            self.failed += standing.failed
            self.total += standing.last_run

    def take_earlier(self, finished: Iterable[Finished]) -> None:
        """Count outcomes that were there before."""
        self.take(finished)
        self._before = self.done

    def is_over(self, group: Group) -> bool:
        """Whether a group needs no more runs."""
        return self._standings[group].is_over

    def progress(self) -> Progress:
        """How far the campaign is."""
        return Progress(self.done, self.failed, self.total, self._before, self._metric, self._groups)

    def _groups(self) -> tuple[GroupProgress, ...]:
        return tuple(
            GroupProgress(
                point=point,
                manager=self._managers[manager],
                done=standing.done,
                failed=standing.failed,
                runs=standing.last_run,
                is_over=standing.is_over,
                mean=standing.values.mean if standing.values.n else None,
                half_width=standing.values.half_width,
            )
            for (point, manager), standing in self._standings.items()
        )

    def stops(self) -> tuple[Stop, ...]:
        """Where each group ends; nothing if all runs are wanted."""
        if self.until is None:
            return ()
        return tuple(
            Stop(
                group,
                standing.last_run,
                standing.is_over,
                standing.done == standing.last_run,
                standing.values.n,
                standing.values.mean if standing.values.n else None,
                standing.values.half_width,
            )
            for group, standing in self._standings.items()
        )

    def counted(self, outcomes: Iterable[Finished]) -> Iterator[Finished]:
        """Of outcomes in any order, those of runs that count."""
        return (finished for finished in outcomes if finished[0].run <= self._last_run(finished[0][:2]))

    def _last_run(self, group: Group) -> int:
        return self._standings[group].last_run
