"""suave-des kb diff: what two ontologies or sets of rules decide differently."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from suave_des.cli.kb_options import Format, Formats, ScenarioOption, TimeLimitS, print_json
from suave_des.cli.kb_policy import MaxFailed
from suave_des.cli.options import DisabledRules, Ontologies, Reasoner, RuleFiles

if TYPE_CHECKING:
    from suave_des.workbench.difference import CellPair, PolicyDifference

_RULES_ENDING = ".swrl"


def diff(
    one: Annotated[
        Path,
        typer.Argument(metavar="A", help="An ontology, or a .swrl file of rules besides the other ontologies."),
    ],
    other: Annotated[Path, typer.Argument(metavar="B", help="The same.")],
    ontology: Ontologies = None,
    scenario: ScenarioOption = "seams2023",
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    reasoner: Reasoner = None,
    max_failed: MaxFailed = 2,
    time_limit: TimeLimitS = 60.0,
    form: Formats = Format.TEXT,
) -> None:
    """Tell in which states two ontologies, or two sets of rules, decide differently.

    --ontology, --rules and --disable-rule count for both; an ontology given as A or B takes the place of the
    scenario's.
    """
    from suave_des.workbench import KnowledgeBase

    def bench(file: Path) -> KnowledgeBase:
        is_rules = file.suffix == _RULES_ENDING
        return KnowledgeBase.load(
            [*(ontology or ()), *([] if is_rules else [file])],
            scenario=scenario,
            reasoner=reasoner,
            rules=[*(rules or ()), *([file] if is_rules else [])],
            disabled_rules=disable_rule or (),
            time_limit_s=time_limit,
        )

    difference = bench(one).diff(bench(other), max_failed)
    if form is Format.JSON:
        print_json(_as_json(difference))
        return
    for line in _lines(difference):
        print(line)


def _lines(difference: PolicyDifference) -> Iterator[str]:
    yield f"{difference.states} of {difference.compared} states are decided differently"
    if difference.reported:
        more = sum(pair.one.reports.combinations for pair in difference.reported)
        yield f"{more} more have other statuses, but the same decisions"
    if difference.computing:
        yield f"no proof, as regions are samples for rules that compute: {', '.join(difference.computing)}"
    for which, designs in (("A", difference.only_one), ("B", difference.only_other)):
        if designs:
            yield f"only {which} has {', '.join(designs)}"
    for key, pairs in _grouped(difference).items():
        function, now, before, after = key
        yield f"{function}, now {now}: A {before}, B {after}"
        for line in _where(pairs):
            yield f"  {line}"


def _grouped(difference: PolicyDifference) -> dict[tuple[str, str, str, str], list[CellPair]]:
    """Pairs by what differs, in the order of the policy."""
    from suave_des.workbench.policy_table import outcome_in_words

    found: dict[tuple[str, str, str, str], list[CellPair]] = {}
    for pair in difference.differing:
        for function in pair.functions or pair.one.asked:
            now = pair.one.state.grounded(function) or "ungrounded"
            outcomes = [outcome_in_words(cell, function) for cell in (pair.one, pair.other)]
            found.setdefault((function, now, outcomes[0], outcomes[1]), []).append(pair)
    return found


def _where(pairs: list[CellPair]) -> Iterator[str]:
    """The measured values, and what components report in each; neighbouring regions are one."""
    from suave_des.knowledge.limit import in_words

    by_regions: dict[tuple[Any, ...], int] = {}
    for pair in pairs:
        by_regions[pair.one.regions] = by_regions.get(pair.one.regions, 0) + pair.one.reports.combinations
    runs: list[tuple[Any, int]] = []
    for regions, states in by_regions.items():
        if len(regions) == 1 and runs and not regions[0].is_missing and runs[-1][0].high == regions[0].low is not None:
            runs[-1] = runs[-1][0].with_next(regions[0]), runs[-1][1] + states
        elif len(regions) == 1:
            runs.append((regions[0], states))
        else:
            runs.append(("; ".join(map(str, regions)), states))
    for region, states in runs:
        yield f"{region}: {states} states"
    yield f"for instance {in_words(pairs[0].one.state)}"


def _as_json(difference: PolicyDifference) -> dict[str, Any]:
    from suave_des.workbench.states import state_dict

    return {
        "compared": difference.compared,
        "states": difference.states,
        "other_statuses_only": sum(pair.one.reports.combinations for pair in difference.reported),
        "only_a": list(difference.only_one),
        "only_b": list(difference.only_other),
        "computing_rules": list(difference.computing),
        "cells": [
            {
                "regions": [str(region) for region in pair.one.regions],
                "state": state_dict(pair.one.state),
                "states": pair.one.reports.combinations,
                "a": {name: pair.one.outcome(name) for name in pair.one.asked},
                "b": {name: pair.other.outcome(name) for name in pair.one.asked},
                "marks_a": list(pair.one.marks),
                "marks_b": list(pair.other.marks),
            }
            for pair in difference.differing
        ],
    }
