"""suave-des kb diff: what a change of ontologies or rules does, to axioms, decisions and missions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.console import progress
from suave_des.cli.kb.options import MaxFailed, ReasonerOptions, counting_states, shown
from suave_des.cli.options import Modes, Quiet, Seed, Workers

if TYPE_CHECKING:
    from suave_des.kb.difference import MissionDifference


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
        print(shown(missions.table(difference)))
        print(*missions.lines(), sep="\n")


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
