"""The result of a campaign, summarised from its store, so that few rows are in memory."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from suave_des.campaign.ensemble import MemberDifferences, differences
from suave_des.campaign.knowledge_records import scenario_line
from suave_des.campaign.missions import COLUMN_TYPES, COLUMNS, Finished, MissionFailure, MissionGroup, Row
from suave_des.campaign.progress import GroupProgress, PairProgress, ProgressTracker
from suave_des.campaign.spec import CampaignSpec
from suave_des.campaign.stopping import FEWEST_PAIRS, FEWEST_RUNS, UntilCi
from suave_des.campaign.variation import Variation, cell_of
from suave_des.estimates import estimate, interval_in_groups, percent
from suave_des.files import rounded
from suave_des.scenario.loader import LoadedScenario

if TYPE_CHECKING:
    import pandas

METRICS = ("search_time_s", "distance_inspected_m")
"""Metrics that are summarised: those of the paper's table."""
METRIC_TITLES = dict(zip(METRICS, ("search time, s", "distance, m"), strict=True))
"""Their headings in tables."""
_FIGURES = ("mean", "std", "median", "ci95_low", "ci95_high")
SUMMARY_COLUMNS = (
    "manager",
    "n",
    "found_share",
    *(f"{metric}_{figure}" for metric in METRICS for figure in _FIGURES),
)
"""Columns of summary.csv."""


@dataclass(frozen=True)
class CampaignResult:
    """The result of a campaign.

    Attributes:
        spec: the specification.
        loaded: the scenario.
        variation: differences between missions apart from manager and run.
        planned: number of missions that were to be run; those of a manager that was stopped early up to there.
        done: number of missions that have a row.
        stops: where each manager ends, if managers were to be stopped early; otherwise empty.
        pairs: how well a difference is known at each point, if managers were to be stopped by it; otherwise empty.
        failures: missions that have no row because they failed, in the order of the missions.
        summary: rows of summary.csv: for each manager, at each point that was reached.
        outcomes: reads the outcomes of all missions, in order.
        remarks: what users should know about managers: whose missions cannot be repeated, or that request modes that
            there are not.
    """

    spec: CampaignSpec
    loaded: LoadedScenario
    variation: Variation
    planned: int
    done: int
    stops: tuple[GroupProgress, ...]
    failures: tuple[MissionFailure, ...]
    summary: tuple[Row, ...]
    outcomes: Callable[[], Iterator[Finished]]
    remarks: tuple[str, ...]
    pairs: tuple[PairProgress, ...]

    def __repr__(self) -> str:
        """Return the summary as a table, and where the files are."""
        headings = ("manager", "n", "found", *(f"{METRIC_TITLES[metric]}: mean, 95% interval" for metric in METRICS))
        rows = [_shown_summary(record) for record in self.summary_records()]
        widths = [max(map(len, column)) for column in zip(headings, *rows, strict=True)]
        table = ["  ".join(map(str.ljust, cells, widths)).rstrip() for cells in (headings, *rows)]
        where = "" if self.folder is None else f", files in {self.folder}"
        title = f"{self.loaded.scenario.name}, seed {self.spec.seed}: {self.done} of {self.planned} missions{where}"
        return "\n".join([title, *table])

    @property
    def folder(self) -> Path | None:
        """The folder of the files; None if there are none."""
        return self.spec.out

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of runs.csv."""
        return (*COLUMNS, *self.variation.columns, *self.loaded.scenario.further_columns)

    @property
    def summary_columns(self) -> tuple[str, ...]:
        """Columns of summary.csv."""
        return (*SUMMARY_COLUMNS, *self.variation.sweep.parameters)

    def stream(self) -> Iterator[Row]:
        """Yield the rows of runs.csv one by one, in its order and with its columns, read as they are requested."""
        width = len(self.columns)
        return (outcome[:width] for _, outcome in self.outcomes() if not isinstance(outcome, MissionFailure))

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows of stream(), in memory."""
        return tuple(self.stream())

    def frame(self) -> pandas.DataFrame:
        """Return the rows as a data frame with the columns of runs.csv.

        Its types do not depend on the rows. Columns scenario and manager are categories, the managers in the campaign's
        order; run, seed and adaptations int64; pipeline_found bool; other metrics float64. A parameter that a sweep
        varies has the type that pandas finds for it.
        """
        return self._frame(self.stream())

    def frames(self, size: int) -> Iterator[pandas.DataFrame]:
        """Yield the same in chunks of `size` rows, read as they are requested."""
        rows = self.stream()
        while piece := tuple(islice(rows, size)):
            yield self._frame(piece)

    def _frame(self, rows: Iterable[Row]) -> pandas.DataFrame:
        import pandas

        types: dict[str, Any] = {name: _TYPES[kind] for name, kind in COLUMN_TYPES.items() if kind in _TYPES}
        types["scenario"] = pandas.CategoricalDtype([self.loaded.scenario.name])
        types["manager"] = pandas.CategoricalDtype(list(self.spec.managers))
        return pandas.DataFrame.from_records(list(rows), columns=list(self.columns)).astype(types)

    def knowledge_lines(self) -> Iterator[str]:
        """Yield the lines of knowledge_states.jsonl; none of managers that do not reason."""
        yield scenario_line(self.loaded.scenario)
        for _, outcome in self.outcomes():
            if not isinstance(outcome, MissionFailure) and (line := outcome[len(self.columns)]):
                yield str(line)

    def differences(self) -> tuple[MemberDifferences, ...]:
        """Return how managers differ, over the members of the ensemble; empty without one."""
        if self.variation.ensemble is None:
            return ()
        kept = ((key, outcome) for key, outcome in self.outcomes() if not isinstance(outcome, MissionFailure))
        metrics = {metric: COLUMNS.index(metric) for metric in METRICS}
        return tuple(differences(kept, self.spec.managers, metrics, self.variation.ensemble))

    def report(self) -> dict[str, Any]:
        """Return how many missions were run, where managers were stopped, and what failed, as in manifest.json."""
        return {
            "missions": {
                "planned": self.planned,
                "done": self.done,
                "failed": len(self.failures),
                "left_out": self.planned - self.done - len(self.failures),
            },
            "until_ci": _until_ci(self),
            **({"remarks": list(self.remarks)} if self.remarks else {}),
            "failures": [
                {
                    "manager": failure.manager,
                    "run": failure.run,
                    **self.variation.sweep.values(failure.point),
                    "time_s": failure.time_s,
                    "cause": failure.cause,
                }
                for failure in self.failures
            ],
        }

    def summary_records(self) -> list[dict[str, Any]]:
        """Return the rows of summary.csv by its columns."""
        return [dict(zip(self.summary_columns, row, strict=True)) for row in self.summary]

    def difference_row(self, found: MemberDifferences) -> Row:
        """Return the row of ensemble.csv of a difference."""
        low, high = found.interval or (None, None)
        low_of_sets, high_of_sets = found.range or (None, None)
        swept = map(cell_of, self.variation.sweep.values(found.point).values())
        return (
            *(found.first, found.second, found.metric, found.n, found.mean, low, high),
            *(len(found.member_means), found.above, found.below, low_of_sets, high_of_sets),
            *swept,
        )

    def kept(self) -> str:
        """Say how many missions are done, and where they are."""
        kept = f"{self.done} of {self.planned} missions {'is' if self.done == 1 else 'are'} done"
        if self.folder is None:
            return kept
        return f"{kept}, and kept in {self.folder}; suave-des campaign --resume {self.folder} runs the rest"


def _shown_summary(record: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a row of summary.csv as text; the point of a sweep stands with the manager."""
    swept = "".join(f", {name} {value}" for name, value in record.items() if name not in SUMMARY_COLUMNS)
    cells = [f"{record['manager']}{swept}", str(record["n"])]
    cells.append("" if record["found_share"] is None else percent(record["found_share"]))
    for metric in METRICS:
        mean, low, high = (record[f"{metric}_{figure}"] for figure in ("mean", "ci95_low", "ci95_high"))
        interval = "" if low is None else f" ({low:.1f} to {high:.1f})"
        cells.append("" if mean is None else f"{mean:.2f}{interval}")
    return tuple(cells)


_TYPES = {"float": "float64", "int": "int64", "bool": "bool"}
"""Types of columns of metrics; a missing float is nan."""


def gather(
    spec: CampaignSpec,
    loaded: LoadedScenario,
    variation: Variation,
    outcomes: Callable[[], Iterator[Finished]],
    tracker: ProgressTracker,
    remarks: Iterable[str],
) -> CampaignResult:
    """Summarise the outcomes of a campaign's missions.

    Args:
        spec: the specification.
        loaded: the scenario.
        variation: differences between missions apart from manager and run.
        outcomes: reads the outcomes that were kept.
        tracker: knows which of them count.
        remarks: remarks about managers for users.
    """
    failures: list[MissionFailure] = []
    summary: list[Row] = []
    done = reached = 0
    tally = _Tally(variation.runs_sharing_draw)

    def summarise_before(group: MissionGroup) -> None:
        """Add the groups before this one that are not summarised yet; the tally is of the first of them."""
        nonlocal tally
        while (next_group := divmod(len(summary), len(spec.managers))) < group:
            point, manager = next_group
            swept = map(cell_of, variation.sweep.values(point).values())
            summary.append((spec.managers[manager], *tally.figures(), *swept))
            tally = _Tally(variation.runs_sharing_draw)

    for key, outcome in tracker.counted(outcomes()):
        summarise_before((key.point, key.manager))
        reached = key.point
        if isinstance(outcome, MissionFailure):
            failures.append(outcome)
        else:
            done += 1
            tally.add(key.run, outcome)
    summarise_before((reached + 1, 0))
    return CampaignResult(
        spec,
        loaded,
        variation,
        planned=tracker.total,
        done=done,
        stops=tracker.stops(),
        failures=tuple(failures),
        summary=tuple(summary),
        outcomes=lambda: tracker.counted(outcomes()),
        remarks=tuple(remarks),
        pairs=tracker.pairs(),
    )


class _Tally:
    """The figures of one manager's missions, collected row by row; of each metric only the numbers are kept."""

    _FOUND = COLUMNS.index("pipeline_found")
    _INDICES = tuple(COLUMNS.index(metric) for metric in METRICS)

    def __init__(self, runs_sharing_draw: int) -> None:
        self._runs_sharing_draw = runs_sharing_draw
        self._rows = self._found = 0
        self._values = tuple(array("d") for _ in METRICS)
        self._draws = tuple(array("q") for _ in METRICS)

    def add(self, run: int, row: Row) -> None:
        self._rows += 1
        self._found += bool(row[self._FOUND])
        for values, draws, index in zip(self._values, self._draws, self._INDICES, strict=True):
            if (value := row[index]) is not None:
                values.append(float(value))
                if self._runs_sharing_draw > 1:
                    draws.append((run - 1) // self._runs_sharing_draw)

    def figures(self) -> Row:
        """Return the cells of summary.csv after the first; a figure that needs more missions than there are is None."""
        share = self._found / self._rows if self._rows else None
        figures = (_figures(*each) for each in zip(self._values, self._draws, strict=True))
        return (self._rows, share, *(figure for own in figures for figure in own))


def _figures(values: Sequence[float], draws: Sequence[int]) -> Row:
    """Return the figures of a metric; where runs share draws, the draws are what is independent."""
    found = estimate(values)
    interval = interval_in_groups(values, draws) if draws else found.mean_interval
    return (found.mean, found.std, found.median, *(interval or (None, None)))


def _until_ci(result: CampaignResult) -> dict[str, Any] | None:
    if (until := result.spec.until) is None:
        return None
    return {
        "metric": until.metric,
        "half_width": until.half_width,
        "fewest_runs": FEWEST_RUNS if until.pair is None else FEWEST_PAIRS,
        **_pairs(result, until),
        "managers": [
            {
                "manager": stop.manager,
                **result.variation.sweep.values(stop.point),
                "last_run": stop.runs,
                "why": _why(stop),
                "n": stop.n,
                "mean": rounded(stop.mean),
                "half_width": rounded(stop.half_width),
            }
            for stop in result.stops
        ],
    }


def _pairs(result: CampaignResult, until: UntilCi) -> dict[str, Any]:
    """Return the difference at each point; nothing unless managers were to be stopped by one."""
    if until.pair is None:
        return {}
    differences = [
        {
            **result.variation.sweep.values(pair.point),
            "n": pair.n,
            "difference": rounded(pair.difference),
            "half_width": rounded(pair.half_width),
            "is_narrow": pair.is_narrow,
        }
        for pair in result.pairs
    ]
    return {"pair": list(until.pair), "differences": differences}


def _why(stop: GroupProgress) -> str:
    if stop.is_narrow:
        return "the interval is narrow"
    return "all runs are done" if stop.is_complete else "interrupted"
