"""suave-des kb: the knowledge workbench. Each command is in a module of its own, suave_des/cli/kb_*.py.

Those modules import typer and the shared options only; what reads ontologies or starts Java is imported when a
command runs, so that help appears at once.
"""

from __future__ import annotations

import typer

from suave_des.cli import kb_explain, kb_infer

app = typer.Typer(
    name="kb",
    add_completion=False,
    rich_markup_mode=None,
    help="Look at the knowledge base, edit its rules, and ask what they do.",
)


@app.callback(invoke_without_command=True)
def _help(context: typer.Context) -> None:
    if context.invoked_subcommand is None:
        print(context.get_help())


app.command("infer")(kb_infer.infer)
app.command("explain")(kb_explain.explain)
