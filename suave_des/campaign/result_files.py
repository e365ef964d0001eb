"""Writes the result files of a campaign."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from suave_des.campaign.ensemble import ENSEMBLE_COLUMNS, ENSEMBLE_FILE
from suave_des.campaign.knowledge_records import CAMPAIGN_KNOWLEDGE_FILE
from suave_des.campaign.missions import COLUMNS, Failure, Row
from suave_des.campaign.output import csv_pieces, csv_text, json_text, make_output_folder, write_files
from suave_des.campaign.parquet_format import PARQUET_FILE, parquet_bytes
from suave_des.campaign.provenance import provenance
from suave_des.campaign.results import CampaignResult
from suave_des.campaign.suave_format import SUAVE_FOLDER, suave_file, suave_pieces

RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE = "runs.csv", "summary.csv", "manifest.json"
FILES = (RUNS_FILE, SUMMARY_FILE, MANIFEST_FILE, ENSEMBLE_FILE, PARQUET_FILE, CAMPAIGN_KNOWLEDGE_FILE)


def write_results(result: CampaignResult, inputs: Mapping[str, str], identity: str) -> None:
    """Write a campaign's files into its folder, in place of those of an earlier use.

    Args:
        result: what the campaign gave.
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
                "managers": result.managers,
                "runs": result.runs,
                "seed": result.seed,
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
        files[PARQUET_FILE] = parquet_bytes(result.frame())
    if spec.record_knowledge:
        files[CAMPAIGN_KNOWLEDGE_FILE] = result.knowledge_lines()
    write_files(result.folder, files, stale=FILES)
    _write_suave_files(result, result.folder / SUAVE_FOLDER)


def _write_suave_files(result: CampaignResult, folder: Path) -> None:
    """Write the exemplar's own files, one for each manager; those of an earlier campaign go."""
    if not result.spec.suave_format and not folder.is_dir():
        return
    revision, limit_s = result.loaded.scenario.revision.name, result.loaded.scenario.mission.time_limit_s
    stale = [path.name for path in folder.glob("*.csv")]
    files: dict[str, str | bytes | Iterable[str]] = {}
    if result.spec.suave_format:
        make_output_folder(folder)
        for number, manager in enumerate(result.managers):
            name = suave_file(revision, manager)
            if name in files:  # of another manager whose name differs in signs that names of files may not have
                name = name.replace(".csv", f"_{number + 1}.csv")
            files[name] = suave_pieces(revision, _numbered(result, number), limit_s)
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
        if key.manager == manager and not isinstance(outcome, Failure):
            yield (key.point * len(result.managers) + key.manager) * result.runs + key.run, outcome
