"""suave-des campaign: many missions, and their result files."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import (
    DisabledRules,
    Modes,
    Ontologies,
    Overwrite,
    Reasoner,
    RuleFiles,
    Scenario,
    Seed,
    Workers,
    command_line,
)

if TYPE_CHECKING:
    from suave_des.campaign.campaign import CampaignResult


_FAILURES_TOLD = 20


class Format(StrEnum):
    """Result files to write besides our own."""

    SUAVE = "suave"


def campaign(
    scenario: Scenario,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for runs.csv, summary.csv and manifest.json.")
    ],
    managers: Annotated[
        str, typer.Option("--managers", metavar="NAME,...", help="Managing subsystems: names, or module:Class.")
    ] = "none,random,metacontrol",
    runs: Annotated[int, typer.Option("--runs", help="Missions for each manager.")] = 20,
    workers: Workers = 2,
    seed: Seed = 1,
    also: Annotated[
        Format | None, typer.Option("--format", help="Write the exemplar's own suave_results.csv besides.")
    ] = None,
    overwrite: Overwrite = False,
    ontology: Ontologies = None,
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    modes: Modes = None,
    reasoner: Reasoner = None,
) -> None:
    """Run many missions and write their results."""
    from suave_des.campaign.campaign import run_campaign
    from suave_des.cli.console import output, progress_bar
    from suave_des.cli.tables import print_summary

    with progress_bar(scenario) as show:
        result = run_campaign(
            scenario,
            [name.strip() for name in managers.split(",") if name.strip()],
            runs,
            seed,
            workers,
            out,
            ontologies=ontology or (),
            modes_file=modes,
            reasoner=reasoner,
            rules=rules or (),
            disabled_rules=disable_rule or (),
            suave_format=also is Format.SUAVE,
            overwrite=overwrite,
            command=command_line(),
            on_progress=show,
        )
    console = output()
    print_summary(console, result)
    console.print(f"{len(result.rows)} missions are in {out}/runs.csv", soft_wrap=True)
    exit_telling_failures(result)


def exit_telling_failures(result: CampaignResult) -> None:
    """List the missions that have no row, and exit with status 3 if there are any."""
    from suave_des.cli.console import errors

    if not result.failures:
        return
    console = errors()
    for failure in result.failures[:_FAILURES_TOLD]:
        line = " ".join(str(failure).split())
        console.print(f"suave-des: failed: {line}", soft_wrap=True, markup=False)
    more = len(result.failures) - _FAILURES_TOLD
    if more > 0:
        where = "" if result.folder is None else f", all of them in {result.folder}/manifest.json"
        console.print(f"suave-des: failed: {more} more{where}", soft_wrap=True, markup=False)
    console.print(f"suave-des: {len(result.failures)} of {result.planned} missions failed; the others are kept")
    raise typer.Exit(3)
