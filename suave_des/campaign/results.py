"""The result of a campaign, summarised from its store, so that few rows are in memory, and its
files.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from suave_des.campaign.ensembles import ENSEMBLE_COLUMNS, differences
from suave_des.campaign.missions import Campaign
from suave_des.campaign.variation import Variation, cell_of
from suave_des.estimates import known, mean_of, std_of
from suave_des.files import FileContent, csv_pieces, csv_text
from suave_des.records import store
from suave_des.records.metrics import COLUMN_TYPES, COLUMNS, FOUND, PAPER_METRICS, Row
from suave_des.records.mission_folder import CAMPAIGN_KNOWLEDGE_FILE, scenario_line
from suave_des.records.store import MissionFailure, MissionKey, MissionOutcome
from suave_des.registry import is_client
from suave_des.tables import TableRow

if TYPE_CHECKING:
    import pandas

_FIGURES = ("mean", "std", "median", "ci95_low", "ci95_high")
SUMMARY_COLUMNS = (
    *("manager", "n", "found_share"),
    *(f"{metric}_{figure}" for metric in PAPER_METRICS for figure in _FIGURES),
)
"""Columns of summary.csv, before those of swept parameters."""
_TYPES = {"float": "float64", "int": "int64", "bool": "bool"}
"""Types of columns of metrics; a missing float is nan."""
_FOUND, _PLACES = COLUMNS.index(FOUND), {metric: COLUMNS.index(metric) for metric in PAPER_METRICS}


@dataclass(frozen=True)
class CampaignResult:
    """The result of a campaign.

    Attributes:
        done: number of missions that have a row.
        failures: missions that have no row because they failed, in the order of the missions.
        summary: rows of summary.csv, by column: for each manager, at each point that was reached.
        outcomes: reads the outcomes of all missions, in order.
        remarks: what users should know about managers: whose missions cannot be repeated, or that
            request modes that there are not.
    """

    campaign: Campaign
    done: int
    failures: tuple[MissionFailure, ...]
    summary: tuple[TableRow, ...]
    outcomes: Callable[[], Iterator[MissionOutcome]]
    remarks: tuple[str, ...]

    @property
    def folder(self) -> Path | None:
        """The folder of the files; None if there are none."""
        return self.campaign.spec.out

    @property
    def labels(self) -> dict[str, str]:
        """What tables and figures show instead of the names of managers, as the campaign file has
        it.
        """
        file = self.campaign.file
        return {} if file is None else file.settings.labels

    @property
    def columns(self) -> tuple[str, ...]:
        """Columns of runs.csv."""
        return self.campaign.columns

    def _kept(self) -> Iterator[tuple[MissionKey, Row]]:
        for key, outcome in self.outcomes():
            if not isinstance(outcome, MissionFailure):
                yield key, outcome

    def stream(self) -> Iterator[Row]:
        """Yield the rows of runs.csv one by one, in its order and with its columns, read as they
        are requested.
        """
        width = len(self.columns)
        return (row[:width] for _, row in self._kept())

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows of stream(), in memory."""
        return tuple(self.stream())

    def frame(self) -> pandas.DataFrame:
        """Return the rows as a data frame with the columns of runs.csv.

        Its types, which suave_des.run_campaign lists, do not depend on the rows, but for a
        parameter that a sweep varies: it has the type that pandas finds for it.
        """
        import pandas

        types: dict[str, Any] = {
            name: _TYPES[kind] for name, kind in COLUMN_TYPES.items() if kind in _TYPES
        }
        types["scenario"] = pandas.CategoricalDtype([self.campaign.loaded.scenario.name])
        types["manager"] = pandas.CategoricalDtype(list(self.campaign.spec.managers))
        return pandas.DataFrame.from_records(self.rows, columns=list(self.columns)).astype(types)

    def differences(self) -> list[TableRow]:
        """Return how managers differ, over the members of the ensemble, as in ensemble.csv; empty
        without one.
        """
        varied = self.campaign.variation
        if varied.ensemble is None:
            return []
        found = differences(varied, self._kept(), self.campaign.spec.managers, _PLACES)
        return [{**each, **_swept(varied, each.pop("point"))} for each in found]

    def report(self) -> dict[str, object]:
        """Return how many missions were run, and what failed, as in manifest.json."""
        return {
            "missions": {
                "planned": self.campaign.planned,
                "done": self.done,
                "failed": len(self.failures),
                "left_out": self.campaign.planned - self.done - len(self.failures),
            },
            **({"remarks": list(self.remarks)} if self.remarks else {}),
            "failures": [
                {
                    "manager": each.manager,
                    "run": each.run,
                    **self.campaign.variation.sweep.values(each.point),
                    "time_s": each.time_s,
                    "cause": each.cause,
                }
                for each in self.failures
            ],
        }

    def kept(self) -> str:
        """Say how many missions are done, and where they are."""
        kept = f"{self.done} of {self.campaign.planned} missions {'is' if self.done == 1 else 'are'} done"
        if self.folder is None:
            return kept
        kept = f"{kept}, and kept in {self.folder}"
        if any(is_client(name) for name in self.campaign.spec.managers):
            return kept  # no campaign of its own could fly the rest
        return f"{kept}; suave-des campaign --resume {self.folder} runs the rest"

    def write(self, kept: store.Store, provenance: Mapping[str, object]) -> None:
        """Write the campaign's files, with its provenance in the manifest, into the folder of its
        store, replacing earlier ones.

        Raises:
            InputError: as of store.write_campaign.
        """
        spec = self.campaign.spec
        sweep = self.campaign.variation.sweep
        about: dict[str, object] = {"scenario": self.campaign.loaded.scenario.name}
        about |= spec.model_dump(mode="json", include={"managers", "runs", "seed"})
        if labels := self.labels:
            about["labels"] = labels
        columns = (*SUMMARY_COLUMNS, *sweep.parameters)
        files: dict[str, FileContent] = {
            store.RUNS_FILE: csv_pieces(self.columns, self.stream()),
            store.SUMMARY_FILE: csv_text(columns, [(*row.values(),) for row in self.summary]),
        }
        if self.campaign.variation.ensemble is not None:
            columns = (*ENSEMBLE_COLUMNS, *sweep.parameters)
            rows = map(itemgetter(*columns), self.differences())
            files[store.ENSEMBLE_FILE] = csv_text(columns, rows)
        if spec.record_knowledge:
            files[CAMPAIGN_KNOWLEDGE_FILE] = self._knowledge_lines()
        about |= {**self._varied(), **self.report(), **provenance}
        store.write_campaign(
            kept, about, files, dict(self._suave_files()) if spec.suave_format else {}
        )

    def _varied(self) -> dict[str, object]:
        """Return what varies, for the manifest."""
        variation = self.campaign.variation
        ensemble = self.campaign.variation.ensemble
        if not variation.columns:
            return {}
        return {
            "sweep": variation.sweep.plain(),
            "points": variation.sweep.points,
            "perturbations": dict(self.campaign.spec.perturbations),
            "runs_per_draw": self.campaign.spec.runs_per_draw,
            **(
                {"ensemble": ensemble.name, "ensemble_members": len(ensemble.members)}
                if ensemble
                else {}
            ),
        }

    def _knowledge_lines(self) -> Iterator[str]:
        """Yield the lines of knowledge_states.jsonl; none of managers that do not reason."""
        yield scenario_line(self.campaign.loaded.scenario)
        for _, row in self._kept():
            if line := row[len(self.columns)]:
                yield str(line)

    def _suave_files(self) -> Iterator[tuple[str, FileContent]]:
        """Yield name and content of the exemplar's own files, one for each manager, named as its
        runner does.
        """
        # with pandas, which takes a while
        from suave_des.records.runs import (
            exemplar_names,
            suave_pieces,
        )

        scenario = self.campaign.loaded.scenario
        runs = self.campaign.spec.runs
        managers = self.campaign.spec.managers
        revision = scenario.revision.name
        limit_s = scenario.mission.time_limit_s
        files = exemplar_names(managers, revision, has_battery=scenario.battery is not None)
        for number, (file, name) in enumerate(files):
            # Each mission has its number in the campaign, from 1, whether or not all have a row.
            rows = (
                (number * runs + key.run, row) for key, row in self._kept() if key.manager == number
            )
            yield f"{file}.csv", suave_pieces(revision, name, COLUMNS, list(rows), limit_s)


def gather(
    campaign: Campaign, outcomes: Callable[[], Iterator[MissionOutcome]], remarks: Iterable[str]
) -> CampaignResult:
    """Summarise the outcomes of a campaign's missions, with remarks about managers for users."""
    spec = campaign.spec
    variation = campaign.variation
    failures: list[MissionFailure] = []
    found: dict[tuple[int, ...], Row] = {}

    def kept(group: Iterable[MissionOutcome]) -> Iterator[tuple[int, Row]]:
        for key, outcome in group:
            if isinstance(outcome, MissionFailure):
                failures.append(outcome)
            else:
                yield key.run, outcome

    for place, group in groupby(outcomes(), key=lambda outcome: outcome[0][:2]):
        found[place] = _figures(kept(group), variation.runs_sharing_draw)
    none = _figures((), 1)
    points = max((point for point, _ in found), default=0) + 1
    summary = tuple(
        dict(zip(SUMMARY_COLUMNS, (name, *found.get((point, number), none)), strict=True))
        | _swept(variation, point)
        for point in range(points)
        for number, name in enumerate(spec.managers)
    )
    done = sum(int(figures[0] or 0) for figures in found.values())
    return CampaignResult(campaign, done, tuple(failures), summary, outcomes, tuple(remarks))


def _swept(variation: Variation, point: int) -> dict[str, object]:
    return {name: cell_of(value) for name, value in variation.sweep.values(point).items()}


def _figures(rows: Iterable[tuple[int, Any]], runs_sharing_draw: int) -> Row:
    """Return the cells of summary.csv after the first; a figure that needs more missions than there
    are is None.

    Only the metrics are kept. Where runs share draws, the draws are what is independent.
    """
    number = found = 0
    values = [array("d") for _ in PAPER_METRICS]
    draws = array("q")
    for run, row in rows:
        number += 1
        found += bool(row[_FOUND])
        draws.append((run - 1) // runs_sharing_draw)
        for own, place in zip(values, _PLACES.values(), strict=True):
            own.append(row[place])
    figures: list[float | None] = []
    for own in values:
        mean = mean_of(own, None if runs_sharing_draw == 1 else draws)
        middle = median(own) if own else None
        figures += (
            known(mean.value),
            known(std_of(own).value),
            middle,
            known(mean.low),
            known(mean.high),
        )
    return (number, found / number if number else None, *figures)
