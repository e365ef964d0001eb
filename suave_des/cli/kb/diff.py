"""suave-des kb diff: what a change of ontologies or rules does, to axioms, decisions and missions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.console import progress
from suave_des.cli.kb.options import MaxFailed, ReasonerOptions, counting_states, shown
from suave_des.cli.options import Modes, Quiet, Seed, Workers
from suave_des.estimates import interval_text
from suave_des.records.metrics import Metric, metric_of
from suave_des.tables import Table

if TYPE_CHECKING:
    from suave_des.kb.difference import MissionDifference, PairedDifference, PolicyDifference

_MOST_RUNS = 10
"""Numbers of missions that are listed."""


@dataclass(frozen=True)
class MissionOptions:
    """Options of the missions that are run with both."""

    missions: Annotated[
        int | None,
        typer.Option("--missions", min=1, metavar="N", help="Run N missions with each, and compare them in pairs."),
    ] = None
    modes: Modes = None
    seed: Seed = 1
    workers: Workers = 1
    quiet: Quiet = False


def diff(
    options: ReasonerOptions,
    mission_options: MissionOptions,
    one: Annotated[
        Path,
        typer.Argument(metavar="A", help="An ontology, or a .swrl file of rules to add to the ontologies."),
    ],
    other: Annotated[Path, typer.Argument(metavar="B", help="The same.")],
    max_failed: MaxFailed = 2,
) -> None:
    """Show what differs between two ontologies, or two sets of rules: axioms, decisions, and missions.

    --ontology, --rules and --disable-rule apply to both; an ontology given as A or B replaces the
    scenario's. Decisions are compared in every state; missions with the same number use common random numbers.
    """
    from suave_des.kb.difference import compare_axioms

    both = [options.with_file(file) for file in (one, other)]
    before, after = (each.knowledge() for each in both)
    axioms = compare_axioms(before.base, after.base)
    with counting_states(before) as on_count:
        difference = before.diff(after, max_failed, on_count)
    missions = None if mission_options.missions is None else _missions(both, mission_options)
    if axioms.removed or axioms.added:
        print(f"axioms and rules: {len(axioms.removed)} removed, {len(axioms.added)} added")
        print(*(f"  - {text}" for text in axioms.removed), *(f"  + {text}" for text in axioms.added), sep="\n")
    print(*difference.lines(), sep="\n")
    if missions is not None:
        print()
        print(shown(_table(difference, missions)))
        print(*_mission_lines(both, mission_options, missions), sep="\n")


def _missions(both: list[ReasonerOptions], options: MissionOptions) -> MissionDifference:
    from suave_des.kb.difference import compare_missions

    assert options.missions is not None
    replaced = [each.replacements | {"modes_file": options.modes} for each in both]
    with progress("missions with A, then with B", quiet=options.quiet) as on_progress:
        return compare_missions(
            both[0].scenario,
            options.missions,
            *replaced,
            seed=options.seed,
            workers=options.workers,
            on_progress=on_progress,
        )


def _table(difference: PolicyDifference, missions: MissionDifference) -> Table:
    """Decisions and missions in one table."""
    rows = [
        ("decisions", "", "", "", "", f"{difference.states} of {difference.compared} states"),
        ("missions", "", "", "", "", f"{len(missions.changed)} of {missions.missions}"),
    ]
    for each in missions.metrics:
        found, changed = each.difference, f"{each.changed} of {missions.missions}"
        values = f"{each.one:.2f}", f"{each.other:.2f}", f"{found.value:+.2f}", interval_text(found.interval, "+.2f")
        rows.append((_metric(each).brief, *values, changed))
    return Table(("", "A", "B", "B - A", "95% interval", "different"), rows)


def _metric(each: PairedDifference) -> Metric:
    return metric_of(each.metric) or Metric(each.metric, each.metric.replace("_", " "))


def _mission_lines(both: list[ReasonerOptions], options: MissionOptions, missions: MissionDifference) -> Iterator[str]:
    from suave_des.kb.difference import METRICS, firing_states
    from suave_des.knowledge.pellet import TimeLimit

    if not missions.changed:
        replaced = [each.replacements | {"modes_file": options.modes} for each in both]
        limit = TimeLimit(both[0].time_limit, "--time-limit")
        firing, states = firing_states(both[0].scenario, missions.missions, *replaced, seed=options.seed, limit=limit)
        yield f"no mission differs; rules that only A or B has fire in {firing} of their {states} states"
        return
    numbers = ", ".join(map(str, missions.changed[:_MOST_RUNS]))
    more = len(missions.changed) - _MOST_RUNS
    yield f"runs that differ: {numbers}" + (f" and {more} more" if more > 0 else "")
    yield "largest changes"
    for each in missions.metrics:
        metric = _metric(each)
        for run, before, after in each.extremes if each.metric in METRICS else ():
            yield f"  run {run}: {metric.title} {before:.1f} {metric.unit} -> {after:.1f} {metric.unit}"
