"""What a mission of a campaign leaves behind: a row of runs.csv, or a failure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import NamedTuple

from suave_des.campaign.output import rounded
from suave_des.campaign.plan import MissionKey
from suave_des.campaign.variation import Variation
from suave_des.errors import MissionError
from suave_des.scenario.loader import LoadedScenario
from suave_des.simulation.result import MissionMetrics

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


def time_out_cause(time_out_s: float) -> str:
    """What is said of a mission that took too long."""
    return f"not done after {time_out_s:g} s (time-out)"
