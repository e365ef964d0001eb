"""suave-des run: one mission, told as a timeline."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

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
    command_line,
)


def run(
    scenario: Scenario,
    manager: Annotated[
        str, typer.Option("--manager", metavar="NAME", help="Managing subsystem by name, or your own as module:Class.")
    ] = "metacontrol",
    seed: Seed = 1,
    run_number: Annotated[
        int, typer.Option("--run", metavar="K", help="Run of a campaign with this seed: the same mission again.")
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DIR", help="Folder for mission.json, events.csv, trajectory.csv, knowledge.jsonl."
        ),
    ] = None,
    overwrite: Overwrite = False,
    ontology: Ontologies = None,
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    modes: Modes = None,
    reasoner: Reasoner = None,
) -> None:
    """Run one mission and tell what happens in it."""
    from suave_des.campaign.single import run_mission
    from suave_des.cli.console import errors, output
    from suave_des.cli.status import mission_status
    from suave_des.cli.timeline import print_timeline

    with mission_status(scenario, errors()) as show:
        result = run_mission(
            scenario,
            manager,
            run_number,
            seed,
            out,
            ontologies=ontology or (),
            modes_file=modes,
            reasoner=reasoner,
            rules=rules or (),
            disabled_rules=disable_rule or (),
            overwrite=overwrite,
            command=command_line(),
            on_time=show,
        )
    console = output()
    print_timeline(console, result)
    if out is not None:
        console.print(f"\nmission.json, events.csv and trajectory.csv are in {out}", soft_wrap=True)
