"""The command `suave-des kb`: its commands.

What reads ontologies or starts Java is imported when a command runs, so that help appears at once.
"""

from __future__ import annotations

from typing import ClassVar

import typer

from suave_des.cli.kb import ask, diff, rules, tests
from suave_des.cli.options import CommandsUnderHeadings, Headings


class _Commands(CommandsUnderHeadings):
    headings: ClassVar[Headings] = {
        "Ask": (ask.infer, ask.explain, ask.why_not, ask.policy, ask.query),
        "Check, test and compare": (rules.check, tests.test, rules.try_, diff.diff),
        "Rules and OWL files": (
            *(rules.rules, rules.add_rule, rules.remove_rule),
            *(rules.enable_rule, rules.disable_rule),
        ),
    }


app = typer.Typer(
    name="kb",
    cls=_Commands,
    add_completion=False,
    rich_markup_mode=None,
    help="Inspect the knowledge base, edit its rules, and show what they do.",
)


@app.callback(invoke_without_command=True)
def _help(context: typer.Context) -> None:
    if context.invoked_subcommand is None:
        print(context.get_help())
