"""suave-des kb check: what is wrong with a knowledge base, before anything runs."""

from __future__ import annotations

from decimal import Decimal
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.kb_options import ScenarioOption, TimeLimitS, print_json
from suave_des.cli.options import DisabledRules, Modes, Ontologies, RuleFiles

if TYPE_CHECKING:
    from collections.abc import Sequence

    from suave_des.workbench.findings import Finding

FOUND = 1
"""Exit status when something was found that --fail-on names."""


class Output(StrEnum):
    """How to print findings."""

    TEXT = "text"
    JSON = "json"
    MARKDOWN = "markdown"


class FailOn(StrEnum):
    """The least level that counts as failure."""

    ERROR = "error"
    WARN = "warn"


def check(
    ontology: Ontologies = None,
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    scenario: ScenarioOption = "seams2023",
    modes: Modes = None,
    shapes: Annotated[
        list[Path] | None,
        typer.Option("--shapes", metavar="FILE", help="SHACL shapes in Turtle, besides the shipped ones."),
    ] = None,
    fail_on: Annotated[FailOn, typer.Option("--fail-on", help="The least level that makes the exit status 1.")] = (
        FailOn.ERROR
    ),
    time_limit: TimeLimitS = 60.0,
    form: Annotated[Output, typer.Option("--format", help="How to print.")] = Output.TEXT,
) -> None:
    """Check ontologies and rules: names, arguments, variables, model, shapes, contradictions.

    Exit status: 0 nothing to complain of; 1 findings; 2 something cannot be read.
    """
    from suave_des.domain import MISSION_FUNCTIONS
    from suave_des.scenario.loader import load_scenario
    from suave_des.workbench.check import Subject
    from suave_des.workbench.check import check as find
    from suave_des.workbench.findings import Level, fails

    loaded = load_scenario(
        scenario, ontologies=ontology or (), modes_file=modes, rules=rules or (), disabled_rules=disable_rule or ()
    )
    findings = find(
        Subject(
            ontologies=loaded.ontologies,
            rules=loaded.rules,
            disabled_rules=loaded.scenario.knowledge.disabled_rules,
            values={name: Decimal(repr(value)) for name, value in loaded.scenario.knowledge.values.items()},
            shapes=shapes or (),
            modes={name: loaded.modes.modes(name) for name in loaded.modes.functions},
            needed=MISSION_FUNCTIONS,
            time_limit_s=time_limit,
        )
    )
    _print(findings, form)
    if fails(findings, Level(fail_on.upper())):
        raise typer.Exit(FOUND)


def _print(findings: Sequence[Finding], form: Output) -> None:
    from dataclasses import asdict

    from suave_des.workbench.findings import summary

    if form is Output.JSON:
        print_json([asdict(finding) for finding in findings])
        return
    if form is Output.MARKDOWN:
        print("| level | where | what | remedy |\n| --- | --- | --- | --- |")
        for finding in findings:
            cells = (finding.level, finding.where, finding.message, finding.remedy or "")
            print(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
        print()
    else:
        for finding in findings:
            print(finding)
    print(summary(findings))
