"""suave-des kb try: what a rule would have done in recorded missions."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from suave_des.cli.kb_options import Format, Formats, TimeLimitS, print_json
from suave_des.cli.options import DisabledRules, Ontologies, Reasoner, RuleFiles

if TYPE_CHECKING:
    from suave_des.workbench.trial import Firing, MissionTrial, Moment


def try_rule(
    on: Annotated[
        Path,
        typer.Option(
            "--on",
            metavar="DIR",
            help="Output folder of run, or of a campaign that recorded its knowledge, or a folder that has such in it.",
        ),
    ],
    rule: Annotated[str | None, typer.Argument(metavar="RULE", help='As "name: body -> head".')] = None,
    disable: Annotated[str | None, typer.Option("--disable", metavar="NAME", help="Try to do without a rule.")] = None,
    ontology: Ontologies = None,
    scenario: Annotated[
        str | None,
        typer.Option("--scenario", metavar="SCENARIO", help="In place of the scenario that was recorded."),
    ] = None,
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    reasoner: Reasoner = None,
    time_limit: TimeLimitS = 60.0,
    form: Formats = Format.TEXT,
) -> None:
    """Tell when a rule would have fired in recorded missions, and which decisions would have been others.

    Nothing is run again: each recorded state is reasoned about with and without the rule. What another decision would
    have led to, only a new run tells.
    """
    from suave_des.workbench.trial import Change
    from suave_des.workbench.trial import try_rule as tried

    change = Change(rule, disable, ontology or (), scenario, rules or (), disable_rule or (), reasoner, time_limit)
    found = list(tried(on, change))
    if form is Format.JSON:
        print_json([_as_json(mission) for mission in found])
        return
    for mission in found:
        if mission.moments or len(found) == 1:
            for line in _lines(mission):
                print(line)
    if len(found) > 1:
        print(_total(found))


def _total(missions: list[MissionTrial]) -> str:
    firing = sum(any(moment.firings for moment in mission.moments) for mission in missions)
    others = [sum(len(moment.otherwise) for moment in mission.moments) for mission in missions]
    clashes = sum(any(moment.problem for moment in mission.moments) for mission in missions)
    return (
        f"{len(missions)} missions: fires in {firing}, other decisions in {sum(map(bool, others))} ({sum(others)} of "
        f"them), contradictions in {clashes}"
    )


def _lines(mission: MissionTrial) -> Iterator[str]:
    firing = [moment for moment in mission.moments if moment.firings]
    which = f": {mission.mission}" if mission.mission else ""
    yield f"{mission.folder}{which}: fires in {len(firing)} of {mission.cycles} recorded states"
    for key, moments in _grouped(firing).items():
        yield f"  {_times(moments)}: {key}"
    yield f"  decisions that would have been others: {sum(len(moment.otherwise) for moment in mission.moments)}"
    others: dict[str, list[Moment]] = {}
    for moment in mission.moments:
        for each in moment.otherwise:
            then, recorded = each.then or "no change", each.recorded or "no change"
            others.setdefault(f"{each.function}: {then} instead of {recorded}", []).append(moment)
    for key, moments in others.items():
        yield f"    {_times(moments)}: {key}"
    problems = [moment for moment in mission.moments if moment.problem]
    if problems:
        yield f"  states that would contradict themselves: {len(problems)} ({_times(problems)})"
        yield f"    {problems[0].problem}"


def _grouped(moments: list[Moment]) -> dict[str, list[Moment]]:
    """Moments by what is concluded with which things; numbers, which are others each time, are left out."""
    found: dict[str, list[Moment]] = {}
    for moment in moments:
        for firing in moment.firings:
            found.setdefault(_words(firing), []).append(moment)
    return found


def _words(firing: Firing) -> str:
    bound = ", ".join(f"?{name} = {value}" for name, value in firing.bindings if not isinstance(value, Decimal))
    known = "" if firing.is_new else " (known without it)"
    return f"{', '.join(map(str, firing.facts))}{known} with {bound or 'nothing bound'}"


def _times(moments: list[Moment]) -> str:
    first, last = moments[0].t_s, moments[-1].t_s
    if first == last:
        return f"{first:.2f} s"
    return f"{first:.2f} s to {last:.2f} s, {len(moments)} states"


def _as_json(mission: MissionTrial) -> dict[str, Any]:
    from suave_des.workbench.states import state_dict

    return {
        "folder": str(mission.folder),
        "mission": mission.mission,
        "states": mission.cycles,
        "moments": [
            {
                "t_s": moment.t_s,
                "state": state_dict(moment.state),
                "firings": [
                    {
                        "facts": list(map(str, firing.facts)),
                        "bindings": {name: str(value) for name, value in firing.bindings},
                        "is_new": firing.is_new,
                    }
                    for firing in moment.firings
                ],
                "decisions": [
                    {"function": each.function, "recorded": each.recorded, "then": each.then}
                    for each in moment.otherwise
                ],
                "contradiction": moment.problem,
            }
            for moment in mission.moments
        ],
    }
