"""What a campaign gave, and the files that tell of it; made from its store, so that few rows are in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from suave_des.campaign.outcomes import COLUMNS, Failure, Finished, Row
from suave_des.campaign.output import csv_pieces, csv_text, json_text, write_files
from suave_des.campaign.plan import Group
from suave_des.campaign.provenance import provenance
from suave_des.campaign.request import Request
from suave_des.campaign.suave_format import SUAVE_FILE, suave_pieces
from suave_des.campaign.summary import SUMMARY_COLUMNS, Tally
from suave_des.campaign.sweep import cell_of
from suave_des.campaign.variation import Variation
from suave_des.scenario.loader import LoadedScenario
from suave_des.simulation.result import MissionMetrics

if TYPE_CHECKING:
    import pandas

RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE = "runs.csv", "summary.csv", "manifest.json"
FILES = (RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE, SUAVE_FILE)


@dataclass(frozen=True)
class CampaignResult:
    """What a campaign gave.

    Attributes:
        loaded: the scenario.
        managers: in the order given.
        runs: planned for each manager.
        seed: the campaign's.
        variation: what differs between missions besides manager and run.
        columns: of runs.csv.
        planned: number of missions that were to be run.
        done: number of missions that have a row.
        failures: missions that have no row because they failed, in the order of the missions.
        summary: rows of summary.csv: for each manager, at each point that was reached.
        folder: where the files are; none if there are none.
        outcomes: reads the outcomes of all missions, in order.
    """

    loaded: LoadedScenario
    managers: tuple[str, ...]
    runs: int
    seed: int
    variation: Variation
    columns: tuple[str, ...]
    planned: int
    done: int
    failures: tuple[Failure, ...]
    summary: tuple[Row, ...]
    folder: Path | None
    outcomes: Callable[[], Iterator[Finished]]

    def stream(self) -> Iterator[Row]:
        """Rows of runs.csv one by one, in its order and with its columns, read as they are asked for."""
        return (outcome for _, outcome in self.outcomes() if not isinstance(outcome, Failure))

    @property
    def rows(self) -> tuple[Row, ...]:
        """All of stream(), in memory."""
        return tuple(self.stream())

    def frame(self) -> pandas.DataFrame:
        """The rows as a data frame with the columns of runs.csv; what is empty there is nan here."""
        import pandas

        # Without a value in any row, a column would not be known to hold numbers.
        kinds = {field.name: "float64" for field in fields(MissionMetrics) if "float" in str(field.type)}
        return pandas.DataFrame.from_records(self.rows, columns=list(self.columns)).astype(kinds)

    def kept(self) -> str:
        """How many missions are done, and where they are."""
        kept = f"{self.done} of {self.planned} missions are done"
        if self.folder is None:
            return kept
        return f"{kept}, and kept in {self.folder}; suave-des campaign --resume {self.folder} does the rest"


def gather(
    request: Request,
    loaded: LoadedScenario,
    variation: Variation,
    folder: Path | None,
    outcomes: Callable[[], Iterator[Finished]],
) -> CampaignResult:
    """Count what is in a store."""
    failures: list[Failure] = []
    summary: list[Row] = []
    done = reached = 0
    tally = Tally()

    def conclude(group: Group) -> None:
        """Sum up the groups before this one that are not summed up yet; the tally is of the first of them."""
        nonlocal tally
        while (next_group := divmod(len(summary), len(request.managers))) < group:
            point, manager = next_group
            swept = map(cell_of, variation.sweep.values(point).values())
            summary.append((request.managers[manager], *tally.figures(), *swept))
            tally = Tally()

    for key, outcome in outcomes():
        conclude((key.point, key.manager))
        reached = key.point
        if isinstance(outcome, Failure):
            failures.append(outcome)
        else:
            done += 1
            tally.add(outcome)
    conclude((reached + 1, 0))
    return CampaignResult(
        loaded=loaded,
        managers=request.managers,
        runs=request.runs,
        seed=request.seed,
        variation=variation,
        columns=(*COLUMNS, *variation.columns),
        planned=variation.sweep.points * len(request.managers) * request.runs,
        done=done,
        failures=tuple(failures),
        summary=tuple(summary),
        folder=folder,
        outcomes=outcomes,
    )


def write_results(result: CampaignResult, request: Request, inputs: Mapping[str, str]) -> None:
    """Write a campaign's files into its folder, in place of those of an earlier use.

    Raises:
        InputError: they cannot be written; nothing half-written stays.
    """
    assert result.folder is not None
    files: dict[str, str | bytes | Iterable[str]] = {
        RUNS_FILE: csv_pieces(result.columns, map(_exact, result.stream())),
        SUMMARY_FILE: csv_text((*SUMMARY_COLUMNS, *result.variation.sweep.parameters), result.summary),
        MANIFEST_FILE: json_text(_manifest(result, request, inputs)),
    }
    if request.suave_format:
        scenario = result.loaded.scenario
        files[SUAVE_FILE] = suave_pieces(scenario.revision.name, _numbered(result), scenario.mission.time_limit_s)
    write_files(result.folder, files, stale=FILES)


def _manifest(result: CampaignResult, request: Request, inputs: Mapping[str, str]) -> dict[str, Any]:
    return {
        "scenario": result.loaded.scenario.name,
        "managers": result.managers,
        "runs": result.runs,
        "seed": result.seed,
        **_varied(result, request),
        "missions": {
            "planned": result.planned,
            "done": result.done,
            "failed": len(result.failures),
            "left_out": result.planned - result.done - len(result.failures),
        },
        "failures": [_told(failure, result.variation) for failure in result.failures],
        **provenance(result.loaded, inputs, request.command),
    }


def _exact(row: Row) -> Row:
    """A row with what varies in full, so that it can be given again; figures are rounded."""
    varied = (repr(value) if isinstance(value, float) else value for value in row[len(COLUMNS) :])
    return (*row[: len(COLUMNS)], *varied)


def _varied(result: CampaignResult, request: Request) -> dict[str, Any]:
    variation = result.variation
    if not variation.columns:
        return {}
    return {
        "sweep": variation.sweep.plain(),
        "points": variation.sweep.points,
        "perturbations": dict(request.perturbations),
        "runs_per_draw": request.runs_per_draw,
    }


def _told(failure: Failure, variation: Variation) -> dict[str, Any]:
    where = {"manager": failure.manager, "run": failure.run, **variation.sweep.values(failure.point)}
    return {**where, "time_s": failure.time_s, "cause": failure.cause}


def _numbered(result: CampaignResult) -> Iterator[tuple[int, Row]]:
    """Rows with the number of their mission in the campaign, from 1, whether or not those before have a row."""
    for key, outcome in result.outcomes():
        if not isinstance(outcome, Failure):
            yield (key.point * len(result.managers) + key.manager) * result.runs + key.run, outcome
