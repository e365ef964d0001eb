"""What a mission of a campaign leaves behind: a row of runs.csv, or a failure."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from operator import attrgetter
from typing import NamedTuple

from suave_des.campaign.output import rounded
from suave_des.campaign.plan import Chunk, RunSpec
from suave_des.errors import MissionError
from suave_des.scenario.loader import LoadedScenario
from suave_des.simulation.result import MissionMetrics
from suave_des.simulation.simulator import Simulator

COLUMNS = tuple(field.name for field in fields(MissionMetrics))
"""Columns of runs.csv."""

Cell = str | int | float | bool | None
Row = tuple[Cell, ...]

_cells: Callable[[MissionMetrics], Row] = attrgetter(*COLUMNS)


def row_of(metrics: MissionMetrics) -> Row:
    """The cells of runs.csv, numbers rounded as they stand there: what is derived from a row follows from the file."""
    return tuple(rounded(cell) if isinstance(cell, float) else cell for cell in _cells(metrics))


class Failure(NamedTuple):
    """A mission that has no row, because its manager raised.

    Attributes:
        manager: name of the managing subsystem.
        run: number of the run.
        time_s: mission time at which it happened.
        cause: what it raised.
    """

    manager: str
    run: int
    time_s: float
    cause: str

    def __str__(self) -> str:
        """In one line, with all that is known."""
        return str(MissionError(self.manager, self.run, self.time_s, self.cause))


Outcome = Row | Failure


class MissionRunner:
    """Runs chunks of missions of one scenario in this process.

    Args:
        loaded: the scenario with its files.
    """

    def __init__(self, loaded: LoadedScenario) -> None:
        self._simulator = Simulator(loaded)

    def run(self, chunk: Chunk) -> list[Outcome]:
        """The outcome of each mission, in order.

        Raises:
            InputError: the scenario, a manager or the knowledge base cannot be used at all.
        """
        return [self._outcome(spec) for spec in chunk]

    def _outcome(self, spec: RunSpec) -> Outcome:
        try:
            result = self._simulator.run(spec.manager, spec.run, spec.seed)
        except MissionError as error:
            return Failure(error.manager, error.run, error.time_s, error.cause)
        return row_of(result.metrics)
