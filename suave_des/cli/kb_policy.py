"""suave-des kb policy: the whole decision table."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from suave_des.cli.kb_options import Format, Formats, ScenarioOption, TimeLimitS, print_json
from suave_des.cli.options import DisabledRules, Ontologies, Reasoner, RuleFiles
from suave_des.errors import InputError

if TYPE_CHECKING:
    from suave_des.workbench.policy import Policy
    from suave_des.workbench.policy_table import FunctionTable

MaxFailed = Annotated[
    int, typer.Option("--max-failed", min=0, metavar="N", help="At most so many components have failed or recovered.")
]
_TOLD = 5
_WIDE = 300


def policy(
    ontology: Ontologies = None,
    scenario: ScenarioOption = "seams2023",
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    reasoner: Reasoner = None,
    max_failed: MaxFailed = 2,
    csv: Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write every cell of the table.")] = None,
    png: Annotated[
        Path | None, typer.Option("--png", metavar="FILE", help="Draw it, over one or two measured values.")
    ] = None,
    time_limit: TimeLimitS = 60.0,
    form: Formats = Format.TEXT,
) -> None:
    """Tabulate what is decided in every state.

    Measured values count by region: between any two numbers of the knowledge base, and on each of them.
    """
    from suave_des.campaign.output import csv_text, write_files
    from suave_des.workbench import KnowledgeBase
    from suave_des.workbench.policy_table import columns_of, function_table, rows_of

    if csv is not None and csv.is_dir():
        raise InputError("is a folder", file=csv, remedy="name a file, such as policy.csv")
    bench = KnowledgeBase.load(
        ontology or (),
        scenario=scenario,
        reasoner=reasoner,
        rules=rules or (),
        disabled_rules=disable_rule or (),
        time_limit_s=time_limit,
    )
    found = bench.policy(max_failed)
    if png is not None:
        from suave_des.workbench.policy_figure import draw_policy

        draw_policy(found, png)
    if csv is not None:
        write_files(csv.parent, {csv.name: csv_text(columns_of(found), rows_of(found))})
    tables = [function_table(found, name) for name in found.functions]
    if form is Format.JSON:
        print_json(_as_json(found, tables))
        return
    for table in tables:
        _print_table(table)
    for line in _summary(found):
        print(line)


def _print_table(table: FunctionTable) -> None:
    from suave_des.cli.console import output, plain_table, print_table

    shown = plain_table()
    others = [name for name, _ in table.rows[0].groundings if name != table.function]
    shown.add_column("now", overflow="fold")
    for name in others:
        shown.add_column(name, overflow="fold")
    with_components = any(row.components for row in table.rows)
    if with_components:
        shown.add_column("components", overflow="fold")
    for name in table.attributes[:-1]:
        shown.add_column(name, overflow="fold")
    # The last attribute goes across, the others down.
    across = list(dict.fromkeys(column[-1:] for column in table.columns))
    for last in across:
        shown.add_column(str(last[0]) if last else "then", overflow="fold")
    for row in table.rows:
        own = dict(row.groundings)
        components = [row.components] if with_components else []
        outcomes = dict(zip(table.columns, row.outcomes, strict=True))
        for down in dict.fromkeys(column[:-1] for column in table.columns):
            shown.add_row(
                own.get(table.function, "any"),
                *(own[name] for name in others),
                *components,
                *map(str, down),
                *(outcomes[(*down, *last)] for last in across),
            )
    what = f", by measured {', '.join(table.attributes)}" if table.attributes else ""
    console = output()
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = _WIDE  # names stay whole where nobody's window ends
    print_table(console, f"{table.function}{what}", shown)
    print()


def _summary(found: Policy) -> Iterator[str]:
    from suave_des.knowledge.limit import in_words
    from suave_des.workbench.policy import FLIP_FLOP, INCONSISTENT, NONE_LEFT

    most = found.max_failed
    yield f"{found.states} states, reasoned in {len(found.cells)} kinds, with at most {most} components reporting"
    for group in found.alike:
        if len(group) > 1:
            yield f"alike, so that only their number counts: {', '.join(group)}"
    for name in found.without_effect:
        yield f"without any effect: measured {name}"
    if found.computing:
        yield f"no proof, as regions are samples for rules that compute: {', '.join(found.computing)}"
    for mark in (INCONSISTENT, NONE_LEFT, FLIP_FLOP):
        cells = found.marked(mark)
        yield f"{mark}: {sum(cell.reports.combinations for cell in cells)} states"
        if mark != NONE_LEFT:
            for cell in cells[:_TOLD]:
                yield f"  {in_words(cell.state)}" + (f": {cell.problem}" if cell.problem else "")
            if len(cells) > _TOLD:
                yield f"  and {len(cells) - _TOLD} kinds more: see --csv"


def _as_json(found: Policy, tables: list[FunctionTable]) -> dict[str, Any]:
    return {
        "states": found.states,
        "kinds": len(found.cells),
        "attributes": list(found.attributes),
        "without_effect": list(found.without_effect),
        "alike": [list(group) for group in found.alike],
        "computing_rules": list(found.computing),
        "marked": {
            mark: sum(cell.reports.combinations for cell in found.marked(mark))
            for mark in ("inconsistent", "none left", "flip-flop")
        },
        "tables": [
            {
                "function": table.function,
                "attributes": list(table.attributes),
                "columns": [[str(region) for region in column] for column in table.columns],
                "rows": [
                    {
                        "components": row.components,
                        "groundings": dict(row.groundings),
                        "outcomes": list(row.outcomes),
                    }
                    for row in table.rows
                ],
            }
            for table in tables
        ],
    }
