"""Arguments and options that several commands share."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

if TYPE_CHECKING:
    from suave_des.scenario.loader import Replacements

Scenario = Annotated[str, typer.Argument(metavar="SCENARIO", help="A scenario file, or the name of a shipped one.")]
Ontologies = Annotated[
    list[Path] | None,
    typer.Option(
        "--ontology", metavar="FILE", help="Ontology in place of the scenario's; repeat it for several files."
    ),
]
Modes = Annotated[
    Path | None, typer.Option("--modes", metavar="FILE", help="System Modes file in place of the scenario's.")
]
Reasoner = Annotated[
    str | None, typer.Option("--reasoner", metavar="NAME", help="remembered, pellet, or owlready2 (slow).")
]
RuleFiles = Annotated[
    list[Path] | None,
    typer.Option("--rules", metavar="FILE", help="Rules as text besides the ontologies; repeat it for several files."),
]
DisabledRules = Annotated[
    list[str] | None,
    typer.Option("--disable-rule", metavar="NAME", help="Switch a rule off for this time; repeat it for several."),
]
Seed = Annotated[int, typer.Option("--seed", help="Seed of everything that is random.")]
Workers = Annotated[
    int, typer.Option("--workers", help="Processes that run missions; any number gives the same bytes.")
]
TimeOut = Annotated[
    float | None,
    typer.Option(
        "--time-out",
        metavar="SECONDS",
        help="Real time that a mission may take.",
        show_default="120; with the reasoner owlready2 1800",
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", help="Show no progress.")]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace results of the same kind that are in the output folder already.")
]


@dataclass(frozen=True)
class KnowledgeFiles:
    """Options that replace or add to a scenario's ontologies and rules."""

    ontology: Ontologies = None
    rules: RuleFiles = None
    disable_rule: DisabledRules = None

    @property
    def replacements(self) -> Replacements:
        """What is given, as the loader takes it."""
        return {"ontologies": self.ontology or (), "rules": self.rules or (), "disabled_rules": self.disable_rule or ()}


@dataclass(frozen=True)
class Files(KnowledgeFiles):
    """Options that replace or add to a scenario's files and settings."""

    modes: Modes = None
    reasoner: Reasoner = None

    @property
    def replacements(self) -> Replacements:
        """What is given, as the loader takes it."""
        return super().replacements | {"modes_file": self.modes, "reasoner": self.reasoner}

    @property
    def given(self) -> dict[str, object]:
        """The options that are given, by name."""
        values = {f"--{each.name.replace('_', '-')}": getattr(self, each.name) for each in fields(self)}
        return {option: value for option, value in values.items() if value}


def grouped_options(command: Callable[..., None]) -> Callable[..., None]:
    """Turn each parameter of a command that is a dataclass into options, one for each field.

    Example:
        @grouped_options
        def show(scenario: Scenario, *, files: Files) -> None:
            loaded = load_scenario(scenario, **files.replacements)
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    parameters = [
        each.replace(annotation=hints[each.name], kind=inspect.Parameter.KEYWORD_ONLY)
        for each in inspect.signature(command).parameters.values()
        if each.name not in groups
    ]
    for group in groups.values():
        annotations = get_type_hints(group, include_extras=True)
        parameters += [
            inspect.Parameter(
                each.name, inspect.Parameter.KEYWORD_ONLY, default=each.default, annotation=annotations[each.name]
            )
            for each in fields(group)
        ]

    @functools.wraps(command)
    def with_groups(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{each.name: given.pop(each.name) for each in fields(group)})
        command(**given)

    vars(with_groups)["__signature__"] = inspect.Signature(parameters)
    with_groups.__annotations__ = {each.name: each.annotation for each in parameters}
    return with_groups


_arguments: list[str] = []


def remember_command_line(arguments: Sequence[str]) -> None:
    """Keep the arguments that the command was called with."""
    _arguments[:] = arguments


def command_line() -> list[str]:
    """The command line as it goes into a manifest: without where the program is installed."""
    return ["suave-des", *_arguments]
