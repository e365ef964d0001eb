"""suave-des kb: the knowledge workbench. Each command is in a module of its own, suave_des/cli/kb_*.py.

Those modules import typer and the shared options only; what reads ontologies or starts Java is imported when a
command runs, so that help appears at once.
"""

from __future__ import annotations

import typer

from suave_des.cli import kb_check, kb_diff, kb_explain, kb_infer, kb_policy, kb_query, kb_rules, kb_try

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
app.command("policy")(kb_policy.policy)
app.command("diff")(kb_diff.diff)
app.command("query")(kb_query.query)
app.command("try")(kb_try.try_rule)
app.command("check")(kb_check.check)
app.command("rules")(kb_rules.rules)
app.command("add-rule")(kb_rules.add_rule)
app.command("remove-rule")(kb_rules.remove_rule)
app.command("enable-rule")(kb_rules.enable_rule)
app.command("disable-rule")(kb_rules.disable_rule)
