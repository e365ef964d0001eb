"""What a campaign gave, and the files that tell of it; made from its store, so that few rows are in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from suave_des.campaign.early_stop import FEWEST_RUNS, Stop, parse_until_ci
from suave_des.campaign.frames import pieces, typed_frame
from suave_des.campaign.knowledge_lines import CAMPAIGN_KNOWLEDGE_FILE, scenario_line
from suave_des.campaign.outcomes import COLUMNS, Failure, Finished, Row
from suave_des.campaign.output import csv_pieces, csv_text, json_text, rounded, write_files
from suave_des.campaign.plan import Group
from suave_des.campaign.provenance import provenance
from suave_des.campaign.request import Request
from suave_des.campaign.suave_format import SUAVE_FILE, suave_pieces
from suave_des.campaign.summary import SUMMARY_COLUMNS, Tally
from suave_des.campaign.sweep import cell_of
from suave_des.campaign.variation import Variation
from suave_des.scenario.loader import LoadedScenario

if TYPE_CHECKING:
    import pandas

RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE = "runs.csv", "summary.csv", "manifest.json"
FILES = (RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE, SUAVE_FILE, CAMPAIGN_KNOWLEDGE_FILE)


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
        until_ci: METRIC:HALF_WIDTH at which managers were to be stopped; none: never.
        planned: number of missions that were to be run; those of a manager that was stopped early up to there.
        done: number of missions that have a row.
        stops: where each manager ends, if managers were to be stopped early; otherwise nothing.
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
        width = len(self.columns)
        return (outcome[:width] for _, outcome in self.outcomes() if not isinstance(outcome, Failure))

    def knowledge_lines(self) -> Iterator[str]:
        """The lines of the knowledge file of a campaign that kept knowledge states; none of managers without any."""
        yield scenario_line(self.loaded.scenario)
        for _, outcome in self.outcomes():
            if not isinstance(outcome, Failure) and (line := outcome[len(self.columns)]):
                yield str(line)

    @property
    def rows(self) -> tuple[Row, ...]:
        """All of stream(), in memory."""
        return tuple(self.stream())

    def frame(self) -> pandas.DataFrame:
        """The rows as a data frame with the columns of runs.csv, typed as typed_frame has it."""
        return self._frame(self.stream())

    def frames(self, size: int) -> Iterator[pandas.DataFrame]:
        """The same in pieces of so many rows, read as they are asked for."""
        return map(self._frame, pieces(self.stream(), size))

    def _frame(self, rows: Iterable[Row]) -> pandas.DataFrame:
        return typed_frame(rows, self.columns, self.loaded.scenario.name, self.managers, self.seed)

    def told(self) -> dict[str, Any]:
        """How many missions were run, where managers were stopped, and what failed, as in manifest.json."""
        return {
            "missions": {
                "planned": self.planned,
                "done": self.done,
                "failed": len(self.failures),
                "left_out": self.planned - self.done - len(self.failures),
            },
            "until_ci": _told_stops(self),
            "failures": [_told(failure, self.variation) for failure in self.failures],
        }

    def summary_told(self) -> list[dict[str, Any]]:
        """The rows of summary.csv by its columns."""
        return [dict(zip(self.summary_columns, row, strict=True)) for row in self.summary]

    @property
    def summary_columns(self) -> tuple[str, ...]:
        """Columns of summary.csv."""
        return (*SUMMARY_COLUMNS, *self.variation.sweep.parameters)

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
    *,
    planned: int,
    stops: tuple[Stop, ...],
) -> CampaignResult:
    """Count the outcomes of a campaign's missions."""
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
        until_ci=request.until_ci,
        planned=planned,
        done=done,
        stops=stops,
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
        SUMMARY_FILE: csv_text(result.summary_columns, result.summary),
        MANIFEST_FILE: json_text(_manifest(result, request, inputs)),
    }
    if request.suave_format:
        scenario = result.loaded.scenario
        files[SUAVE_FILE] = suave_pieces(scenario.revision.name, _numbered(result), scenario.mission.time_limit_s)
    if request.record_knowledge:
        files[CAMPAIGN_KNOWLEDGE_FILE] = result.knowledge_lines()
    write_files(result.folder, files, stale=FILES)


def _manifest(result: CampaignResult, request: Request, inputs: Mapping[str, str]) -> dict[str, Any]:
    return {
        "scenario": result.loaded.scenario.name,
        "managers": result.managers,
        "runs": result.runs,
        "seed": result.seed,
        **_varied(result, request),
        **result.told(),
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
                **result.variation.sweep.values(stop.group[0]),
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
