"""suave-des kb diff: what a change of ontologies or rules does, to axioms, decisions and missions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from suave_des.cli.console import counted, errors, output, plain_table, print_trimmed, progress
from suave_des.cli.kb.options import AsFormat, Format, MaxFailed, ReasonerOptions, print_json
from suave_des.cli.options import Quiet, Seed, Workers, grouped_options
from suave_des.estimates import interval_text

if TYPE_CHECKING:
    from suave_des.workbench.difference import MissionDifference, PolicyDifference

_MOST_RUNS = 10
"""Numbers of missions that are listed; all of them are in the JSON form."""


@dataclass(frozen=True)
class MissionOptions:
    """Options of the missions that are run with both."""

    missions: Annotated[
        int | None,
        typer.Option("--missions", min=1, metavar="N", help="Run N missions with each, and compare them in pairs."),
    ] = None
    seed: Seed = 1
    workers: Workers = 1
    quiet: Quiet = False


@grouped_options
def diff(
    knowledge: ReasonerOptions,
    options: MissionOptions,
    one: Annotated[
        Path,
        typer.Argument(metavar="A", help="An ontology, or a .swrl file of rules to add to the ontologies."),
    ],
    other: Annotated[Path, typer.Argument(metavar="B", help="The same.")],
    max_failed: MaxFailed = 2,
    form: AsFormat = Format.TEXT,
) -> None:
    """Show what differs between two ontologies, or two sets of rules: axioms, decisions, and missions.

    --ontology, --rules and --disable-rule apply to both; an ontology given as A or B replaces the
    scenario's. Decisions are compared in every state; missions with the same number use common random numbers.
    """
    from suave_des.workbench.difference import compare_axioms

    benches = knowledge.with_file(one).bench(), knowledge.with_file(other).bench()
    axioms = compare_axioms(benches[0].base, benches[1].base)
    with counted("states", errors()) as on_count:
        difference = benches[0].diff(benches[1], max_failed, on_count)
    missions = None if options.missions is None else _missions(knowledge, (one, other), options)
    if form is Format.JSON:
        print_json({"axioms": axioms, **_decisions(difference), "missions": missions})
        return
    print(*axioms.lines(), *difference.lines(), sep="\n")
    if missions is not None:
        print()
        print_trimmed(output(), _table(difference, missions))
        print(*_mission_lines(missions), sep="\n")


def _missions(knowledge: ReasonerOptions, files: tuple[Path, Path], options: MissionOptions) -> MissionDifference:
    from suave_des.workbench.difference import MissionsToCompare, compare_missions

    assert options.missions is not None
    which = MissionsToCompare(knowledge.scenario, options.missions, options.seed, options.workers)
    one, other = (knowledge.with_file(file).replacements for file in files)
    with progress("missions with A, then with B", quiet=options.quiet) as on_progress:
        return compare_missions(which, one, other, on_progress)


def _table(difference: PolicyDifference, missions: MissionDifference) -> Table:
    """Decisions and missions in one table."""
    from suave_des.workbench.difference import METRICS

    headings = ("", "A", "B", "B - A", "95% interval", "different")
    table = plain_table(headings, right=headings[1:])
    states = f"{difference.states} of {difference.compared} states"
    table.add_row("decisions", "", "", "", "", states)
    table.add_row("missions", "", "", "", "", f"{len(missions.changed)} of {missions.missions}")
    for each in missions.metrics:
        interval = interval_text(each.interval, "+.2f")
        values = f"{each.one:.2f}", f"{each.other:.2f}", f"{each.difference:+.2f}"
        table.add_row(METRICS[each.metric], *values, interval, f"{each.changed} of {missions.missions}")
    return table


def _mission_lines(missions: MissionDifference) -> Iterator[str]:
    if not missions.changed:
        yield "no mission differs"
        return
    numbers = ", ".join(map(str, missions.changed[:_MOST_RUNS]))
    more = len(missions.changed) - _MOST_RUNS
    yield f"runs that differ: {numbers}" + (f" and {more} more" if more > 0 else "")
    yield "largest changes"
    yield from missions.lines()


def _decisions(difference: PolicyDifference) -> dict[str, Any]:
    return {
        "compared": difference.compared,
        "states": difference.states,
        "other_statuses_only": difference.states_reported,
        "only_a": difference.only_one,
        "only_b": difference.only_other,
        "computing_rules": difference.computing,
        "cells": [
            {
                "regions": pair.one.ranges,
                "state": pair.one.state,
                "states": pair.one.reports.combinations,
                "a": {name: pair.one.outcome(name) for name in pair.one.asked},
                "b": {name: pair.other.outcome(name) for name in pair.one.asked},
                "marks_a": pair.one.marks,
                "marks_b": pair.other.marks,
            }
            for pair in difference.differing
        ],
    }
