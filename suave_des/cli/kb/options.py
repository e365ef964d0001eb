"""Share options among the `kb` commands, and print states and results as JSON or as text."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from suave_des.cli.options import KnowledgeFiles, Reasoner, key_and_value
from suave_des.resources import DEFAULT_SCENARIO

if TYPE_CHECKING:
    from suave_des.knowledge.state import KnowledgeState
    from suave_des.scenario.loader import LoadedScenario
    from suave_des.workbench import KnowledgeBase
    from suave_des.workbench.state_input import StateBuilder


class Format(StrEnum):
    """Output format."""

    TEXT = "text"
    JSON = "json"


AsFormat = Annotated[Format, typer.Option("--format", help="Output format: text or JSON.")]
TimeLimitS = Annotated[
    float,
    typer.Option("--time-limit", metavar="S", min=0.01, help="Time limit of the reasoner for a state, in seconds."),
]
MaxFailed = Annotated[
    int,
    typer.Option(
        "--max-failed", min=0, metavar="N", help="Include states with up to N components failed or recovered."
    ),
]
ScenarioOption = Annotated[
    str,
    typer.Option(
        "--scenario",
        metavar="SCENARIO",
        help="Scenario that provides ontologies, values, measured attributes and revision.",
    ),
]


@dataclasses.dataclass(frozen=True)
class KnowledgeOptions(KnowledgeFiles):
    """Options that name a scenario, ontologies and rules."""

    scenario: ScenarioOption = DEFAULT_SCENARIO

    def loaded(self) -> LoadedScenario:
        """Load the scenario, with the ontologies, rules and values that are given."""
        from suave_des.scenario.loader import load_scenario

        return load_scenario(self.scenario, **self.replacements)


@dataclasses.dataclass(frozen=True)
class ReasonerOptions(KnowledgeOptions):
    """Options that name ontologies, rules and a reasoner to ask."""

    reasoner: Reasoner = None
    time_limit: TimeLimitS = 60.0

    def bench(self) -> KnowledgeBase:
        """Load the knowledge base and start the reasoner."""
        from suave_des.workbench import KnowledgeBase

        return KnowledgeBase.load(
            self.ontology or (),
            scenario=self.scenario,
            reasoner=self.reasoner,
            rules=self.rules or (),
            disabled_rules=self.disable_rule or (),
            values=self.values,
            time_limit_s=self.time_limit,
        )

    def with_file(self, file: Path) -> ReasonerOptions:
        """Add an ontology, or a .swrl file of rules."""
        if file.suffix == ".swrl":
            return dataclasses.replace(self, rules=[*(self.rules or ()), file])
        return dataclasses.replace(self, ontology=[*(self.ontology or ()), file])


@dataclasses.dataclass(frozen=True)
class MeasuredValueOptions(KnowledgeFiles):
    """Options of which one is for values of the scenario and for measured values of a state."""

    set: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Measured value of a quality attribute; if NAME has a dot, scenario value. Repeat it for several.",
        ),
    ] = None

    @property
    def measured(self) -> list[str]:
        """The words that give measured values."""
        return [word for word in self.set or () if "." not in word.partition("=")[0]]

    @property
    def values(self) -> dict[str, Any]:
        """New values of the scenario, by key path."""
        return dict(key_and_value(word, "--set") for word in self.set or () if word not in self.measured)


@dataclasses.dataclass(frozen=True)
class KnowledgeAndStateOptions(MeasuredValueOptions, KnowledgeOptions):
    """Options that name a scenario, ontologies and rules, and measured values of a state."""


@dataclasses.dataclass(frozen=True)
class ReasonerAndStateOptions(MeasuredValueOptions, ReasonerOptions):
    """Options that name ontologies, rules and a reasoner to ask about a state, and its measured values."""


@dataclasses.dataclass(frozen=True)
class ReplayOptions(KnowledgeFiles):
    """Options that replace or add to the knowledge base of recorded missions."""

    scenario: Annotated[
        str | None,
        typer.Option("--scenario", metavar="SCENARIO", help="Scenario to use instead of the recorded one."),
    ] = None
    reasoner: Reasoner = None
    time_limit: TimeLimitS = 60.0


@dataclasses.dataclass(frozen=True)
class StateOptions:
    """Options that describe a state, besides its measured values: see `MeasuredValueOptions`."""

    state: Annotated[
        Path | None,
        typer.Option("--state", metavar="FILE", help="YAML: objectives, groundings, components, measurements."),
    ] = None
    component: Annotated[
        list[str] | None, typer.Option("--component", metavar="NAME=STATUS", help="Reported c_status of a component.")
    ] = None
    ground: Annotated[
        list[str] | None, typer.Option("--ground", metavar="FUNCTION=DESIGN", help="Function design in use.")
    ] = None
    objective: Annotated[
        list[str] | None,
        typer.Option(
            "--objective",
            metavar="FUNCTION[=STATUS]",
            help="Objective of the mission; by default those of the groundings, or else those of the search task.",
        ),
    ] = None

    @property
    def is_given(self) -> bool:
        """Whether any of the options is given."""
        return any((self.state, self.component, self.ground, self.objective))

    def build(self, bench: KnowledgeBase, measured: Sequence[str]) -> KnowledgeState:
        """Build the state; measured values, as NAME=VALUE, and the other options replace what the file says."""
        from suave_des.workbench.state_input import StateBuilder

        builder = StateBuilder(bench.base, bench.settings)
        self.add_to(builder, measured)
        return builder.state()

    def add_to(self, builder: StateBuilder, measured: Sequence[str]) -> None:
        """Add all parts to a state."""
        if self.state is not None:
            builder.add_file(self.state)
        builder.add_words("measurements", "--set", measured)
        builder.add_words("components", "--component", self.component or ())
        builder.add_words("groundings", "--ground", self.ground or ())
        builder.add_words("objectives", "--objective", self.objective or ())


def print_json(content: object) -> None:
    """Print JSON that people read too: dataclasses as objects, states as in state files, facts and numbers as text."""
    print(json.dumps(_plain(content), indent=2, ensure_ascii=False))


def _plain(value: Any) -> Any:
    from suave_des.knowledge.state import Fact, KnowledgeState
    from suave_des.workbench.ranges import ValueRange
    from suave_des.workbench.state_input import state_dict

    if isinstance(value, KnowledgeState):
        return state_dict(value)
    if isinstance(value, Fact | ValueRange | Path | Decimal):
        return str(value)
    if dataclasses.is_dataclass(value):
        value = {each.name: getattr(value, each.name) for each in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        bindings = {name: str(each) for name, each in value.get("bindings", ())}
        return {key: bindings if key == "bindings" else _plain(each) for key, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value


def state_lines(state: KnowledgeState) -> Iterator[str]:
    """A state, one line for each part."""
    for objective in state.objectives:
        status = f"  {objective.status}" if objective.status else ""
        yield f"objective   {objective.function}{status}"
    for function, design in state.groundings:
        yield f"grounding   {function} = {design}"
    for component, status in state.components:
        yield f"component   {component} = {status}"
    for name, value in state.measurements:
        yield f"measured    {name} = {value}"
