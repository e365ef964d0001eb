"""Options and output that the commands of the knowledge workbench share."""

from __future__ import annotations

import json
from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from suave_des.knowledge.state import KnowledgeState


class Format(StrEnum):
    """How to print."""

    TEXT = "text"
    JSON = "json"


Formats = Annotated[Format, typer.Option("--format", help="Text to read, or JSON.")]
ScenarioOption = Annotated[
    str,
    typer.Option(
        "--scenario",
        metavar="SCENARIO",
        help="Scenario whose ontologies, values, measured attributes and revision count.",
    ),
]
TimeLimitS = Annotated[
    float, typer.Option("--time-limit", metavar="S", min=0.01, help="Seconds that the reasoner may take for a state.")
]
StateFile = Annotated[
    Path | None,
    typer.Option("--state", metavar="FILE", help="YAML: objectives, groundings, components, measurements."),
]
Measured = Annotated[
    list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Measured value of a quality attribute.")
]
Components = Annotated[
    list[str] | None, typer.Option("--component", metavar="NAME=STATUS", help="Reported c_status of a component.")
]
Groundings = Annotated[
    list[str] | None, typer.Option("--ground", metavar="FUNCTION=DESIGN", help="Function design now in use.")
]
Objectives = Annotated[
    list[str] | None,
    typer.Option(
        "--objective",
        metavar="FUNCTION[=STATUS]",
        help="Objective that the mission has; without any: those of the groundings, else those of the search task.",
    ),
]


def print_json(content: Any) -> None:
    """Print JSON that people read too."""
    print(json.dumps(content, indent=2, ensure_ascii=False))


def state_lines(state: KnowledgeState) -> Iterator[str]:
    """A state, a line for each of its parts."""
    for objective in state.objectives:
        status = f"  {objective.status}" if objective.status else ""
        yield f"objective   {objective.function}{status}"
    for function, design in state.groundings:
        yield f"grounding   {function} = {design}"
    for component, status in state.components:
        yield f"component   {component} = {status}"
    for name, value in state.measurements:
        yield f"measured    {name} = {value}"
