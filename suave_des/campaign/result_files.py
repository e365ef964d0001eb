"""Writes the result files of a campaign: those of suave-des, and those that the exemplar's scripts read."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from datetime import datetime, timedelta
from operator import itemgetter
from pathlib import Path
from typing import Any

from suave_des.campaign.ensemble import ENSEMBLE_COLUMNS, ENSEMBLE_FILE
from suave_des.campaign.inputs import provenance
from suave_des.campaign.knowledge_records import CAMPAIGN_KNOWLEDGE_FILE
from suave_des.campaign.missions import COLUMNS, MissionFailure, Row
from suave_des.campaign.results import CampaignResult
from suave_des.files import csv_pieces, csv_text, json_text, make_output_folder, write_files

RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE, PARQUET_FILE = "runs.csv", "summary.csv", "manifest.json", "runs.parquet"
FILES = (RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE, ENSEMBLE_FILE, PARQUET_FILE, CAMPAIGN_KNOWLEDGE_FILE)
SUAVE_FOLDER = "suave"


def write_results(result: CampaignResult, inputs: Mapping[str, str], identity: str) -> None:
    """Write a campaign's files into its folder, replacing those of an earlier campaign.

    Args:
        result: the campaign's result.
        inputs: SHA-256 of each input file, by its name as shown to the user.
        identity: of the campaign, as its store has it.

    Raises:
        InputError: they cannot be written; nothing half-written stays.
    """
    assert result.folder is not None
    spec, scenario = result.spec, result.loaded.scenario
    files: dict[str, str | bytes | Iterable[str]] = {
        RUNS_FILE: csv_pieces(result.columns, map(_exact, result.stream())),
        SUMMARY_FILE: csv_text(result.summary_columns, result.summary),
        MANIFEST_FILE: json_text(
            {
                "scenario": scenario.name,
                "managers": spec.managers,
                "runs": spec.runs,
                "seed": spec.seed,
                **_varied(result),
                **result.report(),
                **provenance(result.loaded, inputs, spec.command),
                "campaign_sha256": identity,
            }
        ),
    }
    if result.variation.ensemble is not None:
        files[ENSEMBLE_FILE] = csv_text(
            (*ENSEMBLE_COLUMNS, *result.variation.sweep.parameters), map(result.difference_row, result.differences())
        )
    if spec.parquet:
        files[PARQUET_FILE] = result.frame().to_parquet(engine="pyarrow", index=False)
    if spec.record_knowledge:
        files[CAMPAIGN_KNOWLEDGE_FILE] = result.knowledge_lines()
    write_files(result.folder, files, stale=FILES)
    _write_suave_files(result, result.folder / SUAVE_FOLDER)


def _write_suave_files(result: CampaignResult, folder: Path) -> None:
    """Write the exemplar's own files (kas-lab/suave, revisions 2023 and 1.5); those of an earlier campaign go.

    There is a file for each manager, named as the missions in it, in a folder that has nothing else in it: scripts that
    take all files of a folder, or compare one file with the others, find what they expect.
    """
    if not result.spec.suave_format and not folder.is_dir():
        return
    revision, limit_s = result.loaded.scenario.revision.name, result.loaded.scenario.mission.time_limit_s
    stale = [path.name for path in folder.glob("*.csv")]
    files: dict[str, str | bytes | Iterable[str]] = {}
    if result.spec.suave_format:
        make_output_folder(folder)
        for number, manager in enumerate(result.spec.managers):
            name = f"{'time_constrained' if revision == '2023' else 'suave'}_{_OUTSIDE_NAME.sub('_', manager)}"
            if f"{name}.csv" in files:  # another manager's, which differs in signs that file names may not have
                name += f"_{number + 1}"
            files[f"{name}.csv"] = suave_pieces(revision, _numbered(result, number), limit_s)
    write_files(folder, files, stale=stale)
    if not files:
        with suppress(OSError):  # something else is in it
            folder.rmdir()


def _exact(row: Row) -> Row:
    """Return a row with all digits of what varies, so that it can be given again; metrics are rounded."""
    varied = (repr(value) if isinstance(value, float) else value for value in row[len(COLUMNS) :])
    return (*row[: len(COLUMNS)], *varied)


def _varied(result: CampaignResult) -> dict[str, Any]:
    ensemble = result.variation.ensemble
    if not result.variation.columns:
        return {}
    return {
        "sweep": result.variation.sweep.plain(),
        "points": result.variation.sweep.points,
        "perturbations": dict(result.spec.perturbations),
        "runs_per_draw": result.spec.runs_per_draw,
        **({"ensemble": ensemble.name, "ensemble_members": len(ensemble.members)} if ensemble else {}),
    }


def _numbered(result: CampaignResult, manager: int) -> Iterator[tuple[int, Row]]:
    """Yield a manager's rows with the number of their mission in the campaign, from 1, whether or not all have one."""
    for key, outcome in result.outcomes():
        if key.manager == manager and not isinstance(outcome, MissionFailure):
            yield (key.point * len(result.spec.managers) + key.manager) * result.spec.runs + key.run, outcome


_OUTSIDE_NAME = re.compile(r"[^A-Za-z0-9_.-]+")
_FIRST_STAMP = datetime(2000, 1, 1)
"""The exemplar stamps each row with the time of day. Ours must be the same each time: a second for each mission."""
# strftime's %b depends on the user's language; the exemplar's files are in English.
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")

_Mission = Mapping[str, Any]
"""A row of runs.csv by column, and with it time_limit_s, stamp, month and position."""


def _whole(seconds: float) -> float:
    """Whole seconds without a point, as the exemplar has them."""
    return int(seconds) if seconds == int(seconds) else seconds


_Layout = Mapping[str, Callable[[_Mission], object]]

_LAYOUT_2023: _Layout = {
    "mission_name": lambda mission: f"time constrained {mission['manager']}",
    "datetime": lambda mission: f"{mission['month']}-{mission['stamp']:%d-%Y-%H-%M-%S}",
    "initial pos (x,y)": itemgetter("position"),
    "time budget (s)": lambda mission: _whole(mission["time_limit_s"]),
    # The program wrote -1 when the pipeline was not found; the published table has the limit instead.
    "time search (s)": lambda mission: _whole(mission["search_time_s"]) if mission["pipeline_found"] else -1,
    "distance inspected (m)": itemgetter("distance_inspected_m"),
}
_LAYOUT_1_5: _Layout = {
    "mission name": lambda mission: f"suave {mission['manager']}",
    "datetime": lambda mission: f"{mission['stamp']:%d}-{mission['month']}-{mission['stamp']:%Y-%H-%M-%S}",
    "initial pos (x,y)": itemgetter("position"),
    "mission duration (s)": lambda mission: int(mission["mission_duration_s"]),
    "pipeline found": itemgetter("pipeline_found"),
    # The program writes the mission's duration when the pipeline was not found.
    "time searching pipeline (s)": lambda mission: (
        _whole(mission["search_time_s"]) if mission["pipeline_found"] else int(mission["mission_duration_s"])
    ),
    "distance inspected (m)": itemgetter("distance_inspected_m"),
    # The exemplar writes 0.0 when no reaction was completed.
    "mean reaction time (s)": lambda mission: mission["mean_reaction_time_s"] or 0.0,
}


def suave_pieces(revision: str, rows: Iterable[tuple[int, Row]], time_limit_s: float) -> Iterator[str]:
    """Yield the content of a file of the exemplar's, piece by piece.

    Seconds and metres are as in runs.csv, but for durations, which are whole seconds, and for the search time when the
    pipeline was not found.

    Args:
        revision: the scenario's; all but 2023 have the current layout, that of 1.5.
        rows: rows of runs.csv, each with the number of its mission in the campaign, from 1.
        time_limit_s: of the missions.
    """
    layout = _LAYOUT_2023 if revision == "2023" else _LAYOUT_1_5

    def cells(number: int, row: Row) -> list[object]:
        stamp = _FIRST_STAMP + timedelta(seconds=number)
        mission: dict[str, Any] = dict(zip(COLUMNS, row, strict=False))  # drawn and swept parameters follow
        mission |= {"time_limit_s": time_limit_s, "stamp": stamp, "month": _MONTHS[stamp.month - 1]}
        mission["position"] = str((round(mission["initial_x_m"], 2), round(mission["initial_y_m"], 2)))
        return [make(mission) for make in layout.values()]

    return csv_pieces(tuple(layout), (cells(number, row) for number, row in rows))
