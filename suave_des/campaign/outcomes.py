"""What a mission of a campaign leaves behind: a row of runs.csv, or a failure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from operator import attrgetter
from typing import NamedTuple

from suave_des.campaign.knowledge_lines import mission_line
from suave_des.campaign.output import rounded
from suave_des.campaign.plan import Chunk, MissionKey
from suave_des.campaign.sweep import cell_of
from suave_des.campaign.time_limit import Limit, TimeOut, time_limits
from suave_des.campaign.variation import Variation
from suave_des.errors import MissionError
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import Mission
from suave_des.simulation.result import MissionMetrics, MissionResult
from suave_des.simulation.simulator import Simulator

COLUMNS = tuple(field.name for field in fields(MissionMetrics))
"""Columns of runs.csv that every campaign has."""

Cell = str | int | float | bool | None
Row = tuple[Cell, ...]

_cells: Callable[[MissionMetrics], Row] = attrgetter(*COLUMNS)


def row_of(metrics: MissionMetrics) -> Row:
    """The cells of runs.csv, numbers rounded as they stand there: what is derived from a row follows from the file."""
    return tuple(rounded(cell) if isinstance(cell, float) else cell for cell in _cells(metrics))


class Failure(NamedTuple):
    """A mission that has no row.

    Attributes:
        manager: name of the managing subsystem.
        run: number of the run.
        time_s: mission time at which it happened; none if that is not known.
        cause: what the manager raised, or what else ended the mission.
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
        """In one line, with all that is known."""
        if self.time_s is None:
            return f"manager {self.manager}, run {self.run}: {self.cause}"
        return str(MissionError(self.manager, self.run, self.time_s, self.cause))


Outcome = Row | Failure
Finished = tuple[MissionKey, Outcome]


@dataclass(frozen=True)
class Job:
    """All that a worker needs besides the numbers of the missions; it travels by value.

    Attributes:
        loaded: the scenario with its files.
        variation: what differs between missions besides manager and run.
        managers: names, in the campaign's order.
        seed: the campaign's.
        time_out_s: time that a mission may take.
        record_knowledge: whether each row is followed by a cell with the mission's line of the knowledge file.
    """

    loaded: LoadedScenario
    variation: Variation
    managers: tuple[str, ...]
    seed: int
    time_out_s: float
    record_knowledge: bool = False

    def failed(self, key: MissionKey, cause: str) -> Finished:
        """The outcome of a mission that was ended from outside."""
        return key, Failure(self.managers[key.manager], key.run, None, cause, lasting=False, point=key.point)


class MissionRunner:
    """Runs chunks of missions of one job in this process.

    Args:
        job: the scenario and what else decides a mission.
    """

    def __init__(self, job: Job) -> None:
        self._job = job
        self._drawn = tuple(job.variation.drawn)
        self._warm_up()
        self._go_to(0)

    def run(self, chunk: Chunk) -> list[Finished]:
        """The outcome of each mission, in order.

        Raises:
            InputError: the scenario, a manager or the knowledge base cannot be used at all.
        """
        return list(self.each(chunk))

    def each(self, missions: Iterator[MissionKey] | Chunk) -> Iterator[Finished]:
        """The same mission by mission."""
        with time_limits() as limit:
            for key in missions:
                yield key, self._outcome(key, limit)

    def _outcome(self, key: MissionKey, limit: Limit) -> Outcome:
        if key.point != self._point:
            self._go_to(key.point)
        manager = self._job.managers[key.manager]
        try:
            with limit(self._job.time_out_s):
                result = self._simulator.run(manager, key.run, self._job.seed, record=self._job.record_knowledge)
        except MissionError as error:
            return Failure(error.manager, error.run, error.time_s, error.cause, point=key.point)
        except TimeOut:
            return self._job.failed(key, time_out_cause(self._job.time_out_s))[1]
        row = (*row_of(result.metrics), *self._swept, *(result.drawn[path] for path in self._drawn))
        return (*row, self._knowledge(key, result)) if self._job.record_knowledge else row

    def _knowledge(self, key: MissionKey, result: MissionResult) -> str:
        if not result.knowledge:
            return ""
        variation = self._job.variation
        values = variation.sweep.values(key.point)
        swept = {variation.paths[name]: value for name, value in values.items()}
        return mission_line(self._job.managers[key.manager], key.point, key.run, result.knowledge, swept)

    def _warm_up(self) -> None:
        """Load or compile what missions run, before the first one's time counts: a mission of a second does."""
        short = self._job.loaded.scenario.model_copy(update={"mission": Mission(time_limit_s=1.0)})
        Simulator(replace(self._job.loaded, scenario=short)).run("none", 1, 0)

    def _go_to(self, point: int) -> None:
        """Have the simulator of a point; one is kept, as missions come point by point."""
        variation = self._job.variation
        self._point, self._simulator = point, variation.simulator(self._job.loaded, point)
        self._swept = tuple(map(cell_of, variation.sweep.values(point).values()))


def time_out_cause(time_out_s: float) -> str:
    """What is said of a mission that took too long."""
    return f"not done after {time_out_s:g} s (time-out)"
