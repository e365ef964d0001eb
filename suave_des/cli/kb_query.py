"""suave-des kb query: SPARQL over asserted or inferred facts."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from suave_des.cli.kb_options import (
    Components,
    Groundings,
    Measured,
    Objectives,
    ScenarioOption,
    StateFile,
    TimeLimitS,
    print_json,
)
from suave_des.cli.options import DisabledRules, Ontologies, Reasoner, RuleFiles


class TableFormat(StrEnum):
    """How to print a table."""

    TEXT = "text"
    CSV = "csv"
    JSON = "json"


def query(
    text: Annotated[
        str, typer.Argument(metavar="QUERY", help="SPARQL; the prefixes suave, tomasys, mros and owl are known.")
    ],
    ontology: Ontologies = None,
    scenario: ScenarioOption = "seams2023",
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    reasoner: Reasoner = None,
    inferred: Annotated[bool, typer.Option("--inferred", help="Ask what Pellet infers too.")] = False,
    state: StateFile = None,
    measured: Measured = None,
    component: Components = None,
    ground: Groundings = None,
    objective: Objectives = None,
    time_limit: TimeLimitS = 60.0,
    form: Annotated[TableFormat, typer.Option("--format", help="A table to read, CSV or JSON.")] = TableFormat.TEXT,
) -> None:
    """Ask the knowledge base in SPARQL.

    Without any option that gives a state, the ontologies alone are asked.
    """
    from suave_des.campaign.output import csv_text
    from suave_des.cli.console import output, plain_table, print_trimmed
    from suave_des.workbench import KnowledgeBase
    from suave_des.workbench.states import state_from

    bench = KnowledgeBase.load(
        ontology or (),
        scenario=scenario,
        reasoner=reasoner,
        rules=rules or (),
        disabled_rules=disable_rule or (),
        time_limit_s=time_limit,
    )
    known = None
    if state or measured or component or ground or objective:
        known = state_from(
            bench.base,
            bench.loop,
            state,
            measured=measured or (),
            components=component or (),
            groundings=ground or (),
            objectives=objective or (),
        )
    found = bench.query(text, known, inferred=inferred)
    if form is TableFormat.JSON:
        print_json([dict(zip(found.columns, row, strict=True)) for row in found.rows])
    elif form is TableFormat.CSV:
        print(csv_text(found.columns, found.rows), end="")
    else:
        table = plain_table()
        for column in found.columns:
            table.add_column(column, overflow="fold")
        for row in found.rows:
            table.add_row(*(cell or "" for cell in row))
        print_trimmed(output(), table)
        if not found.rows:
            print("no rows")
