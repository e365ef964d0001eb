"""Arguments and options that several commands share."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from suave_des.scenario.loader import Replacements as Replacements
else:
    Replacements = dict  # the loader is not imported for --help

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
Quiet = Annotated[bool, typer.Option("--quiet", help="Show no progress.")]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace results of the same kind that are in the output folder already.")
]


def replaces_files(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options --ontology, --rules, --disable-rule, --modes and --reasoner to a command.

    The command has a keyword parameter `replacements`, which gets what they give:

        @replaces_files
        def show(scenario: Scenario, *, replacements: Replacements) -> None:
            loaded = load_scenario(scenario, **replacements)
    """
    options: dict[str, Any] = {
        "ontology": Ontologies,
        "rules": RuleFiles,
        "disable_rule": DisabledRules,
        "modes": Modes,
        "reasoner": Reasoner,
    }

    @functools.wraps(command)
    def with_options(**given: Any) -> None:
        ontology, rules, disable_rule, modes, reasoner = (given.pop(name) for name in options)
        replacements = Replacements(
            ontologies=ontology or (),
            rules=rules or (),
            disabled_rules=disable_rule or (),
            modes_file=modes,
            reasoner=reasoner,
        )
        command(**given, replacements=replacements)

    own = inspect.signature(command, eval_str=True)
    parameters = [each for each in own.parameters.values() if each.name != "replacements"]
    parameters += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=option)
        for name, option in options.items()
    ]
    vars(with_options)["__signature__"] = own.replace(parameters=parameters)
    with_options.__annotations__ = {each.name: each.annotation for each in parameters}
    return with_options


_arguments: list[str] = []


def remember_command_line(arguments: Sequence[str]) -> None:
    """Keep the arguments that the command was called with."""
    _arguments[:] = arguments


def command_line() -> list[str]:
    """The command line as it goes into a manifest: without where the program is installed."""
    return ["suave-des", *_arguments]
