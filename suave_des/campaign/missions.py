"""The missions of a campaign: their keys, the job that they share, and their outcomes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, fields
from itertools import product
from operator import attrgetter
from typing import NamedTuple, Protocol

from suave_des.campaign.variation import Variation
from suave_des.errors import MissionError, SuaveDesError
from suave_des.files import rounded
from suave_des.metrics.result import MissionMetrics, MissionResult
from suave_des.scenario.loader import LoadedScenario


class MissionKey(NamedTuple):
    """The key of a mission in a campaign; missions and their rows are in the order of their keys.

    Attributes:
        point: number of the sweep's point, from 0; 0 without a sweep.
        manager: index among the campaign's managers, from 0.
        run: number of the run, from 1; runs with the same number use common random numbers under all managers and at
            all points.
    """

    point: int
    manager: int
    run: int


Chunk = tuple[MissionKey, ...]
MissionGroup = tuple[int, int]
"""Point and manager: the missions that differ in the run only."""


def plan(
    points: int,
    managers: int,
    runs: int,
    settled: Callable[[MissionGroup], Collection[int]],
    is_over: Callable[[MissionGroup, int], bool],
    *,
    run_by_run: bool,
) -> Iterator[MissionKey]:
    """Yield the missions that have yet to be run, in order.

    Args:
        points: number of points of the sweep.
        managers: number of managers.
        runs: for each manager at each point.
        settled: returns the runs of a group that need not be run; called once for each group, when its turn comes.
        is_over: returns whether a group needs neither a run nor later ones; called before each.
        run_by_run: whether a run is planned under all managers before the next one, so that their difference is known.
    """
    together = [range(managers)] if run_by_run else [range(manager, manager + 1) for manager in range(managers)]
    for point, group in product(range(points), together):
        known = {manager: settled((point, manager)) for manager in group}
        for run in range(1, runs + 1):
            left = [manager for manager in group if not is_over((point, manager), run)]
            if not left:
                break
            yield from (MissionKey(point, manager, run) for manager in left if run not in known[manager])


COLUMN_TYPES = {field.name: str(field.type).removesuffix(" | None") for field in fields(MissionMetrics)}
"""Columns of runs.csv that every campaign has, and the names of their types."""
COLUMNS = tuple(COLUMN_TYPES)

Cell = str | int | float | bool | None
Row = tuple[Cell, ...]

_cells: Callable[[MissionMetrics], Row] = attrgetter(*COLUMNS)


def row_of(metrics: MissionMetrics) -> Row:
    """Return the cells of runs.csv, rounded as in the file, from which all statistics are computed."""
    return tuple(map(rounded, _cells(metrics)))


def further_of(result: MissionResult) -> Row:
    """Return the cells of the columns that the scenario asks for, rounded likewise."""
    return tuple(map(rounded, result.further.values()))


class MissionFailure(NamedTuple):
    """A mission that has no row.

    Attributes:
        manager: name of the managing subsystem.
        run: number of the run.
        time_s: mission time at which it happened; None if that is not known.
        cause: the manager's exception, or another reason why the mission ended.
        lasting: whether the mission itself failed; a time-out or a worker that was killed may not happen again, so a
            resumed campaign runs such a mission once more.
        point: of the sweep, from 0.
    """

    manager: str
    run: int
    time_s: float | None
    cause: str
    lasting: bool = True
    point: int = 0

    def __str__(self) -> str:
        """Return all that is known, in one line."""
        if self.time_s is None:
            return f"manager {self.manager}, run {self.run}: {self.cause}"
        return str(MissionError(self.manager, self.run, self.time_s, self.cause))


class Remark(NamedTuple):
    """A remark about a manager for users; it is delivered among the outcomes.

    Attributes:
        manager: name of the managing subsystem.
        text: what.
        times: number of occurrences; 0 if irrelevant.
    """

    manager: str
    text: str
    times: int = 1

    def __str__(self) -> str:
        """Return it in one line."""
        return f"manager {self.manager}: {self.text}{f' ({self.times} times)' if self.times > 1 else ''}"


MissionOutcome = Row | MissionFailure | Remark
Finished = tuple[MissionKey, MissionOutcome]


@dataclass(frozen=True)
class JobSpec:
    """Everything that a worker needs apart from the missions' keys; it is sent by value.

    Attributes:
        loaded: the scenario with its files.
        variation: differences between missions apart from manager and run.
        managers: names, in the campaign's order.
        seed: the campaign's.
        time_out_s: wall-clock time that a mission may take.
        record_knowledge: whether each row is followed by a cell with the mission's line of knowledge_states.jsonl.
    """

    loaded: LoadedScenario
    variation: Variation
    managers: tuple[str, ...]
    seed: int
    time_out_s: float
    record_knowledge: bool = False

    def failed(self, key: MissionKey, cause: str) -> Finished:
        """Return the outcome of a mission whose process was ended."""
        return key, MissionFailure(self.managers[key.manager], key.run, None, cause, lasting=False, point=key.point)

    def timed_out(self, key: MissionKey) -> Finished:
        """Return the outcome of a mission that took too long."""
        return self.failed(key, f"not done after {self.time_out_s:g} s (time-out)")


class Executor(Protocol):
    """Runs missions somewhere: in this process, in worker processes, or on a cluster."""

    def outcomes(self, job: JobSpec, missions: Iterable[MissionKey], total: int) -> Iterator[list[Finished]]:
        """Yield the outcomes of all missions, some at a time, in the order in which they finish.

        Args:
            job: what the missions have in common.
            missions: to run; each is requested only when a worker has room for it.
            total: about how many there are.

        Raises:
            InputError: the scenario, a manager or the knowledge base cannot be used at all.
            WorkerError: workers end before their work is done, again and again.
        """
        ...


class WorkerError(SuaveDesError):
    """Missions cannot be run, because the processes that should run them die."""
