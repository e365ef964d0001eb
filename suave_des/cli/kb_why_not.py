"""suave-des kb why-not: why rules do not fire, each in one line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.kb_options import AsFormat, Format, SourcesInState, StateParts, TimeLimitS, print_json
from suave_des.cli.options import grouped_options

if TYPE_CHECKING:
    from suave_des.workbench.state_input import StateBuilder


@dataclass(frozen=True)
class StateAnywhere(StateParts):
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
    sources: SourcesInState,
    parts: StateAnywhere,
    names: Annotated[
        list[str] | None, typer.Argument(metavar="RULE", help="Names of rules; left out: all that do not fire.")
    ] = None,
    facts: Annotated[
        list[str] | None,
        typer.Option("--fact", metavar="FACT", help='Additional fact to assert, such as "Binding(b1)".'),
    ] = None,
    time_limit: TimeLimitS = 60.0,
    form: AsFormat = Format.TEXT,
) -> None:
    """Say why a rule does not fire: the first atom that fails, what was found and what is needed.

    Exit status: 0 also if a rule fires.
    """
    from suave_des.knowledge.limit import TimeLimit
    from suave_des.knowledge.rules.syntax import RuleError
    from suave_des.scenario_knowledge import open_base
    from suave_des.workbench.fact_reader import FactReader
    from suave_des.workbench.state_input import ManagingSettings, StateBuilder
    from suave_des.workbench.why_not import RuleQuestions, UnusableRule, open_without_unusable

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
    answers = [limit.run(partial(questions.why_not, name, state), f"looking for what {name} lacks") for name in named]
    shown = [answer for answer in answers if names or not answer.fires]
    if form is Format.JSON:
        print_json(shown)
        return
    for answer in shown:
        print(answer)
    if not shown:
        print("all rules fire")
