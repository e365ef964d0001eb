"""What a campaign gave, and the files that tell of it; made from its store, so that few rows are in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from suave_des.campaign.early_stop import FEWEST_RUNS, Stop, parse_until_ci
from suave_des.campaign.outcomes import Failure, Finished, Row
from suave_des.campaign.output import csv_pieces, csv_text, json_text, rounded, write_files
from suave_des.campaign.plan import Group
from suave_des.campaign.provenance import provenance
from suave_des.campaign.request import Request
from suave_des.campaign.suave_format import SUAVE_FILE, suave_pieces
from suave_des.campaign.summary import SUMMARY_COLUMNS, Tally
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
        columns: of runs.csv.
        until_ci: METRIC:HALF_WIDTH at which managers were to be stopped; none: never.
        planned: number of missions that were to be run; those of a manager that was stopped early up to there.
        done: number of missions that have a row.
        stops: where each manager ends, if managers were to be stopped early; otherwise nothing.
        failures: missions that have no row because they failed, in the order of the missions.
        summary: rows of summary.csv.
        folder: where the files are; none if there are none.
        outcomes: reads the outcomes of all missions, in order.
    """

    loaded: LoadedScenario
    managers: tuple[str, ...]
    runs: int
    seed: int
    columns: tuple[str, ...]
    until_ci: str | None
    planned: int
    done: int
    stops: tuple[Stop, ...]
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
    columns: tuple[str, ...],
    folder: Path | None,
    outcomes: Callable[[], Iterator[Finished]],
    *,
    planned: int,
    stops: tuple[Stop, ...],
) -> CampaignResult:
    """Count the outcomes of a campaign's missions."""
    tallies: dict[Group, Tally] = {(0, manager): Tally() for manager in range(len(request.managers))}
    failures = []
    done = 0
    for key, outcome in outcomes():
        if isinstance(outcome, Failure):
            failures.append(outcome)
        else:
            done += 1
            tallies[key.point, key.manager].add(outcome)
    return CampaignResult(
        loaded=loaded,
        managers=request.managers,
        runs=request.runs,
        seed=request.seed,
        columns=columns,
        until_ci=request.until_ci,
        planned=planned,
        done=done,
        stops=stops,
        failures=tuple(failures),
        summary=tuple((request.managers[manager], *tally.figures()) for (_, manager), tally in tallies.items()),
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
        RUNS_FILE: csv_pieces(result.columns, result.stream()),
        SUMMARY_FILE: csv_text(SUMMARY_COLUMNS, result.summary),
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
        "missions": {
            "planned": result.planned,
            "done": result.done,
            "failed": len(result.failures),
            "left_out": result.planned - result.done - len(result.failures),
        },
        "until_ci": _told_stops(result),
        "failures": [_told(failure) for failure in result.failures],
        **provenance(result.loaded, inputs, request.command),
    }


def _told(failure: Failure) -> dict[str, Any]:
    return {"manager": failure.manager, "run": failure.run, "time_s": failure.time_s, "cause": failure.cause}


def _told_stops(result: CampaignResult) -> dict[str, Any] | None:
    if result.until_ci is None:
        return None
    until = parse_until_ci(result.until_ci)
    return {
        "metric": until.metric,
        "half_width": until.half_width,
        "fewest_runs": FEWEST_RUNS,
        "managers": [
            {
                "manager": result.managers[stop.group[1]],
                "last_run": stop.last_run,
                "why": _why(stop),
                "n": stop.n,
                "mean": None if stop.mean is None else rounded(stop.mean),
                "half_width": None if stop.half_width is None else rounded(stop.half_width),
            }
            for stop in result.stops
        ],
    }


def _why(stop: Stop) -> str:
    if stop.reached:
        return "the interval is narrow"
    return "all runs are done" if stop.is_complete else "interrupted"


def _numbered(result: CampaignResult) -> Iterator[tuple[int, Row]]:
    """Rows with the number of their mission in the campaign, from 1, whether or not those before have a row."""
    for key, outcome in result.outcomes():
        if not isinstance(outcome, Failure):
            yield (key.point * len(result.managers) + key.manager) * result.runs + key.run, outcome
