"""suave-des kb infer, explain, why-not, policy, query: what follows in a state, why, and what is decided."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from suave_des.cli.console import counted, errors, fits, output, plain_table, print_table, print_trimmed
from suave_des.cli.kb.options import (
    AsFormat,
    Format,
    KnowledgeAndStateOptions,
    MaxFailed,
    ReasonerAndStateOptions,
    ReasonerOptions,
    StateOptions,
    TimeLimitS,
    print_json,
    state_lines,
)
from suave_des.cli.options import grouped_options
from suave_des.errors import InputError, number_of
from suave_des.files import csv_text, write_files
from suave_des.interrupts import ends_at_once

if TYPE_CHECKING:
    from suave_des.workbench.policy.cases import Policy
    from suave_des.workbench.policy.table import FunctionTable
    from suave_des.workbench.state_input import StateBuilder

_EXAMPLES = 5
_WIDE = 300


@grouped_options
def infer(knowledge: ReasonerAndStateOptions, parts: StateOptions, form: AsFormat = Format.TEXT) -> None:
    """Show what the reasoner infers in a state, and what Metacontrol would do."""
    bench = knowledge.bench()
    conclusion = bench.infer(parts.build(bench, knowledge.measured))
    inferred, decisions = sorted(map(str, conclusion.inference.facts)), conclusion.plan.decisions
    state = conclusion.inference.state
    if form is Format.JSON:
        plan = [
            {
                "function": decision.function,
                "design": decision.design,
                "reason": decision.reason,
                "rejected": {rejection.design: rejection.reason for rejection in decision.rejected},
            }
            for decision in decisions
        ]
        print_json({"state": state, "inferred": inferred, "plan": plan})
        return
    print("state")
    for line in state_lines(state):
        print(f"  {line}")
    print("inferred")
    for fact in inferred or ["nothing"]:
        print(f"  {fact}")
    print("plan" if decisions else "plan\n  nothing to adapt")
    for decision in decisions:
        print(f"  {decision.function}: {decision.design or 'no design left'}  ({decision.reason})")
        for rejection in decision.rejected:
            print(f"    not {rejection.design}: {rejection.reason}")


@grouped_options
def explain(
    knowledge: ReasonerAndStateOptions,
    parts: StateOptions,
    question: Annotated[
        str,
        typer.Argument(
            metavar="QUESTION",
            help='A fact (written as a rule atom), "why DESIGN?" or "why not DESIGN?"; by default all that follows.',
        ),
    ] = "",
    form: AsFormat = Format.TEXT,
) -> None:
    """Explain why a fact follows in a state, why a design is chosen or not, or why the state contradicts itself."""
    bench = knowledge.bench()
    explanation = bench.explain(parts.build(bench, knowledge.measured), question)
    if form is Format.JSON:
        print_json(explanation)
    else:
        print(explanation)


@grouped_options
def policy(
    knowledge: ReasonerOptions,
    max_failed: MaxFailed = 2,
    csv: Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write all rows of the table.")] = None,
    png: Annotated[
        Path | None, typer.Option("--png", metavar="FILE", help="Draw it over one or two measured values.")
    ] = None,
    form: AsFormat = Format.TEXT,
) -> None:
    """Tabulate the decision in every state.

    Measured values are divided into ranges: at and between the numbers that the knowledge base mentions.
    """
    from suave_des.workbench.policy.table import columns_of, function_table, rows_of

    if csv is not None and csv.is_dir():
        raise InputError("is a folder", file=csv, remedy="name a file, such as policy.csv")
    with counted("states", errors()) as on_count:
        found = knowledge.bench().policy(max_failed, on_count)
    if png is not None:
        from suave_des.workbench.policy.figure import draw_policy

        draw_policy(found, png)
    if csv is not None:
        write_files(csv.parent, {csv.name: csv_text(columns_of(found), rows_of(found))})
    tables = [function_table(found, name) for name in found.functions]
    if form is Format.JSON:
        summary = {
            "states": found.states,
            "kinds": len(found.cases),
            "attributes": found.attributes,
            "without_effect": found.without_effect,
            "alike": found.alike,
            "computing_rules": found.computing,
            "marked": found.marks,
            "tables": tables,
        }
        print_json(summary)
        return
    for table in tables:
        _print_function_table(table)
    print(*_policy_summary(found), sep="\n")


def _print_function_table(table: FunctionTable) -> None:
    what = f", by measured {', '.join(table.attributes)}" if table.attributes else ""
    console = output()
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console.width = _WIDE  # names stay whole where there is no window
    shown = _function_table(table, breaks_names=False)
    if not fits(console, shown):
        shown = _function_table(table, breaks_names=True)
    print_table(console, f"{table.function}{what}", shown)
    print()


def _function_table(table: FunctionTable, *, breaks_names: bool) -> Table:
    """A function's decisions as a table.

    Args:
        table: the decisions.
        breaks_names: whether names of designs go over two lines, broken before their last word.
    """
    others = [name for name in table.rows[0].groundings if name != table.function]
    with_components = any(row.components for row in table.rows)
    # The last attribute goes across, the others down.
    across = list(dict.fromkeys(column[-1:] for column in table.columns))
    headings = ["now", *others, *(["components"] if with_components else []), *table.attributes[:-1]]
    shown = plain_table([*headings, *(str(last[0]) if last else "then" for last in across)], overflow="fold")

    def name(text: str) -> str:
        return "\n_".join(text.rsplit("_", 1)) if breaks_names else text

    for row in table.rows:
        components = [row.components] if with_components else []
        outcomes = dict(zip(table.columns, row.outcomes, strict=True))
        for down in dict.fromkeys(column[:-1] for column in table.columns):
            shown.add_row(
                name(row.groundings.get(table.function, "any")),
                *(name(row.groundings[other]) for other in others),
                *components,
                *map(str, down),
                *(name(outcomes[(*down, *last)]) for last in across),
            )
    return shown


def _policy_summary(found: Policy) -> Iterator[str]:
    from suave_des.knowledge.deliberation import NONE_LEFT
    from suave_des.workbench.policy.cases import no_proof

    kinds, most = len(found.cases), found.max_failed
    counts = f"{number_of(found.states, 'state')} in {kinds} equivalence class{'' if kinds == 1 else 'es'}"
    yield f"{counts}, with at most {number_of(most, 'component')} reporting"
    for group in found.alike:
        if len(group) > 1:
            yield f"interchangeable (only their number matters): {', '.join(group)}"
    for name in found.without_effect:
        yield f"without any effect: measured {name}"
    if found.computing:
        yield no_proof(found.computing)
    for mark, states in found.marks.items():
        yield f"{mark}: {number_of(states, 'state')}"
        cases = () if mark == NONE_LEFT else found.marked(mark)
        for case in cases[:_EXAMPLES]:
            yield f"  {case.state}" + (f": {case.problem}" if case.problem else "")
        if len(cases) > _EXAMPLES:
            yield f"  and {len(cases) - _EXAMPLES} more kinds: see --csv"


class TableFormat(StrEnum):
    """How to print a table."""

    TEXT = "text"
    CSV = "csv"
    JSON = "json"


@grouped_options
def query(
    knowledge: ReasonerAndStateOptions,
    parts: StateOptions,
    text: Annotated[
        str, typer.Argument(metavar="QUERY", help="SPARQL; the prefixes suave, tomasys, mros and owl are known.")
    ],
    inferred: Annotated[bool, typer.Option("--inferred", help="Include what Pellet infers.")] = False,
    form: Annotated[TableFormat, typer.Option("--format", help="Output format.")] = TableFormat.TEXT,
) -> None:
    """Query the knowledge base in SPARQL.

    Without any option that gives a state, only the ontologies are queried.
    """
    bench = knowledge.bench()
    state = parts.build(bench, knowledge.measured) if parts.is_given or knowledge.measured else None
    late = f"answering the query: not done after {knowledge.time_limit:g} s (allow more with --time-limit)"
    with ends_at_once(knowledge.time_limit, late):
        found = bench.query(text, state, inferred=inferred)
    for name in found.unknown:
        errors().print(f"suave-des: the knowledge base does not have {name}")
    if form is TableFormat.JSON:
        print_json([dict(zip(found.columns, row, strict=True)) for row in found.rows])
    elif form is TableFormat.CSV:
        print(csv_text(found.columns, found.rows), end="")
    else:
        table = plain_table(found.columns, overflow="fold")
        for row in found.rows:
            table.add_row(*(cell or "" for cell in row))
        print_trimmed(output(), table)
        if not found.rows:
            print("no rows")


@dataclass(frozen=True)
class AnyStateOptions(StateOptions):
    """Options that describe a state, or say where it is recorded."""

    at: Annotated[
        list[str] | None,
        typer.Option(
            "--at",
            metavar="WHAT",
            help="Part of the state: NAME=VALUE of a quality attribute, component or function; a YAML file; "
            "or FOLDER@SECONDS of a recorded mission.",
        ),
    ] = None

    def add_to(self, builder: StateBuilder, measured: Sequence[str]) -> None:
        """Add all parts; those of --at come first, and the other options replace what they say."""
        builder.add_at(self.at or ())
        super().add_to(builder, measured)


@grouped_options
def why_not(
    sources: KnowledgeAndStateOptions,
    parts: AnyStateOptions,
    names: Annotated[
        list[str] | None, typer.Argument(metavar="RULE", help="Names of rules; by default all that do not fire.")
    ] = None,
    facts: Annotated[
        list[str] | None,
        typer.Option("--fact", metavar="FACT", help='Additional fact to assert, such as "Binding(b1)".'),
    ] = None,
    time_limit: TimeLimitS = 60.0,
    form: AsFormat = Format.TEXT,
) -> None:
    """Show why a rule does not fire: the first atom that fails, the value found and the value needed.

    The exit status is 0 even if a rule fires.
    """
    from suave_des.knowledge.pellet.limit import TimeLimit
    from suave_des.knowledge.rules.syntax import RuleError
    from suave_des.scenario_knowledge import open_base
    from suave_des.workbench.fact_reader import FactReader
    from suave_des.workbench.reasons.why_not import RuleQuestions, UnusableRule, open_without_unusable
    from suave_des.workbench.state_input import ManagingSettings, StateBuilder

    loaded = sources.loaded()
    try:
        base, unusable = open_base(loaded), list[UnusableRule]()
    except RuleError:
        base, unusable = open_without_unusable(loaded)
    reader = FactReader(base)
    reader.declare(facts or ())
    base = base.with_facts(reader.triple(fact) for fact in facts or ())
    builder = StateBuilder(base, ManagingSettings.of(loaded.scenario))
    parts.add_to(builder, sources.measured)
    state = builder.state()
    questions = RuleQuestions(base, tuple(unusable))
    named = names or sorted({*(rule.name for rule in base.rules), *(each.name for each in unusable)})
    limit = TimeLimit(time_limit, "--time-limit")
    answers = [
        limit.run(partial(questions.why_not, name, state), f"finding out why {name} does not fire") for name in named
    ]
    shown = [answer for answer in answers if names or not answer.fires]
    if form is Format.JSON:
        print_json(shown)
        return
    for answer in shown:
        print(answer)
    if not shown:
        print("all rules fire")
