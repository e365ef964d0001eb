"""Commands under headings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import chain
from typing import Any, ClassVar

import typer
from typer.core import TyperGroup

Command = Callable[..., None] | typer.Typer
Headings = Mapping[str, tuple[Command, ...]]
"""Headings of a help page, and the commands under each, named as their functions."""


class CommandsUnderHeadings(TyperGroup):
    """A command with others below it, which its help shows under headings, with the whole first line of their help."""

    headings: ClassVar[Headings] = {}

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands."""
        for heading, commands in self.headings.items():
            names = [_name(each) for each in commands]
            with formatter.section(heading):
                formatter.write_dl([(name, self.commands[name].get_short_help_str(200)) for name in names])


def add_commands(app: typer.Typer, headings: Headings) -> None:
    """Add the commands to an application."""
    for command in chain.from_iterable(headings.values()):
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=_name(command))
        else:
            app.command(_name(command))(command)


def _name(command: Command) -> str:
    return str(command.info.name) if isinstance(command, typer.Typer) else command.__name__.strip("_").replace("_", "-")
