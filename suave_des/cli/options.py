"""Arguments and options that several commands share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

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


_arguments: list[str] = []


def remember_command_line(arguments: Sequence[str]) -> None:
    """Keep the arguments that the command was called with."""
    _arguments[:] = arguments


def command_line() -> list[str]:
    """The command line as it goes into a manifest: without where the program is installed."""
    return ["suave-des", *_arguments]
