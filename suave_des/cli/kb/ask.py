"""suave-des kb infer, explain, why-not, policy, query: what follows in a state, why, and what is
decided.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from suave_des.cli.console import counted, errors
from suave_des.cli.kb.options import (
    At,
    KnowledgeOptions,
    MaxFailed,
    ReasonerOptions,
    TimeLimitS,
    shown,
    state_at,
)
from suave_des.cli.options import argument, flag, option
from suave_des.errors import InputError
from suave_des.files import csv_text, write_file
from suave_des.interrupts import ends_at_once
from suave_des.tables import Table

if TYPE_CHECKING:
    from suave_des.knowledge.ontology import Ontology
    from suave_des.knowledge.state import Fact, KnowledgeState, Reasoning, Value


TableFormat = Literal["text", "csv", "json"]


def infer(options: ReasonerOptions, at: At = None) -> None:
    """Show what the reasoner infers in a state, and what Metacontrol would do."""
    knowledge = options.knowledge()
    state = state_at(at, knowledge.base, knowledge.settings)
    _tell_of_identities(knowledge.base)
    lines = _inference_lines(knowledge.infer(state), knowledge.identities(state))
    print(*lines, sep="\n")


def _tell_of_identities(base: Ontology, names: Collection[str] = ()) -> None:
    """Say of which rules, by default of all, the inferences may not be the same each time."""
    from suave_des.knowledge.rules import NOT_THE_SAME, write_atom

    for rule in base.content.enabled_rules:
        if not names or rule.name in names:
            for atom in rule.identities_of_names:
                errors().print(f"suave-des: rule {rule.name}: {write_atom(atom)} {NOT_THE_SAME}")


def _inference_lines(reasoning: Reasoning, identities: Iterable[Fact]) -> Iterator[str]:
    yield "state"
    yield from _state_lines(reasoning.inference.state)
    yield "inferred"
    facts = sorted(map(str, (*reasoning.inference.facts, *identities)))
    yield from (f"  {fact}" for fact in facts or ["nothing"])
    yield "plan"
    grounded = reasoning.inference.state.grounded
    if not reasoning.plan.decisions:
        yield "  nothing to adapt"
    for decision in reasoning.plan.decisions:
        design = decision.design or "no design left"
        if decision.design and decision.design == grounded(decision.function):
            design = f"{design} stays"
        yield f"  {decision.function}: {design}  ({decision.reason})"
        for rejection in decision.rejected:
            yield f"    not {rejection.design}: {rejection.reason}"


def _state_lines(state: KnowledgeState) -> Iterator[str]:
    from suave_des.knowledge.state import value_text

    for objective in state.objectives:
        status = f"  {objective.status}" if objective.status else ""
        yield f"  objective   {objective.function}{status}"
    parts: dict[str, Iterable[tuple[str, Value]]] = {
        "grounding": state.groundings,
        "component": state.components,
        "measured": state.measurements,
        "planned by": state.measured_since or (),
    }
    for kind, pairs in parts.items():
        yield from (f"  {kind:<10}  {name} = {value_text(value)}" for name, value in pairs)


def explain(
    options: ReasonerOptions,
    question: Annotated[
        str,
        argument(
            'A fact (written as a rule atom), "why DESIGN?" or "why not DESIGN?"; by default all that follows.',
            "QUESTION",
        ),
    ] = "",
    at: At = None,
) -> None:
    """Explain why a fact follows, or why a design is chosen or not."""
    knowledge = options.knowledge()
    _tell_of_identities(knowledge.base)
    state = state_at(at, knowledge.base, knowledge.settings)
    print(knowledge.explain(state, question))


def policy(
    options: ReasonerOptions,
    max_failed: MaxFailed = 2,
    csv: Annotated[Path | None, option("Write all rows of the table.", "FILE")] = None,
    png: Annotated[Path | None, option("Draw the tables.", "FILE")] = None,
) -> None:
    """Tabulate the decision in every state.

    Measured values are divided into ranges: at and between the numbers that the knowledge base
    mentions.
    """
    from suave_des.kb.policy import function_table

    if csv is not None and csv.is_dir():
        raise InputError("is a folder", file=csv, remedy="name a file, such as policy.csv")
    knowledge = options.knowledge()
    with counted("states", errors()) as on_count:
        found = knowledge.policy(max_failed, on_count)
    if png is not None:
        from suave_des.kb.policy_figure import draw_policy

        draw_policy(found, png)
    if csv is not None:
        write_file(csv, found.csv())
    for name in found.functions:
        print(shown(function_table(found, name)[0]))
    print(*found.lines(), sep="\n")


def query(
    options: ReasonerOptions,
    text: Annotated[
        str,
        argument("SPARQL; the prefixes suave, tomasys, mros and owl are known.", "QUERY"),
    ],
    at: At = None,
    inferred: Annotated[bool, flag("--inferred", "Include what Pellet infers.")] = False,
    form: Annotated[TableFormat, option("Output format.", None, "--format")] = "text",
) -> None:
    """Query the knowledge base in SPARQL.

    Without --at only the ontologies are queried.
    """
    knowledge = options.knowledge()
    state = state_at(at, knowledge.base, knowledge.settings) if at else None
    late = f"answering the query: not done after {options.time_limit:g} s (allow more with --time-limit)"
    with ends_at_once(options.time_limit, late):
        found = knowledge.query(text, state, inferred=inferred)
    for name in found.unknown:
        errors().print(f"suave-des: the knowledge base does not have {name}")
    if form == "json":
        rows_by_name = [dict(zip(found.columns, row, strict=True)) for row in found.rows]
        print(json.dumps(rows_by_name, indent=2, ensure_ascii=False))
    elif form == "csv":
        print(csv_text(found.columns, found.rows), end="")
    else:
        rows = [[cell or "" for cell in row] for row in found.rows]
        print(shown(Table(found.columns, rows, align="l" * len(found.columns))))
        if not rows:
            print("no rows")


def why_not(
    options: KnowledgeOptions,
    names: Annotated[
        list[str] | None,
        argument("Rules; by default all that do not fire.", "RULE"),
    ] = None,
    at: At = None,
    facts: Annotated[
        list[str] | None,
        option('Additional fact, such as "Binding(b1)".', "FACT", "--fact"),
    ] = None,
    time_limit: TimeLimitS = 60.0,
) -> None:
    """Show why a rule does not fire: the first atom that fails.

    The exit status is 0 even if a rule fires.
    """
    from suave_des.kb.explain import RuleQuestions
    from suave_des.kb.states import FactReader, ManagingSettings
    from suave_des.knowledge.pellet import TimeLimit
    from suave_des.scenario_knowledge import open_base

    loaded = options.loaded()
    base = open_base(loaded)
    reader = FactReader(base)
    facts = facts or []
    reader.declare(facts)
    questions = RuleQuestions(base.with_facts(map(reader.triple, facts)))
    state = state_at(at, questions.base, ManagingSettings.of(loaded.scenario))
    names = names or []
    _tell_of_identities(questions.base, names)
    limit = TimeLimit(time_limit, "--time-limit")
    told = []
    for name in names or sorted({rule.name for rule in questions.base.rules}):
        task = f"finding out why {name} does not fire"
        answer = limit.run(partial(questions.why_not, name, state), task)
        if names or not answer.fires:
            told.append(str(answer))
    print("\n".join(told) or "all rules fire")
