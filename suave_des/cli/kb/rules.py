"""suave-des kb check, rules, add-rule, remove-rule, enable-rule, disable-rule, try: the rules of a knowledge base."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.kb.options import AsFormat, Format, KnowledgeOptions, ReplayOptions, TimeLimitS, print_json
from suave_des.cli.options import Modes, grouped_options
from suave_des.errors import number_of
from suave_des.resources import shipped_folder

if TYPE_CHECKING:
    from suave_des.knowledge.ontology import Ontology

FOUND = 1
"""Exit status of `check` when there are findings that --fail-on names."""
OwlFile = Annotated[Path, typer.Argument(metavar="FILE", help="An OWL file; the previous version is kept as FILE.bak.")]
RuleName = Annotated[str, typer.Argument(metavar="NAME", help="Name of a rule of the file.")]


class FindingsFormat(StrEnum):
    """How to print findings."""

    TEXT = "text"
    JSON = "json"
    MARKDOWN = "markdown"


class FailOn(StrEnum):
    """The least level that counts as failure."""

    ERROR = "error"
    WARN = "warn"


@grouped_options
def check(
    sources: KnowledgeOptions,
    modes: Modes = None,
    shapes: Annotated[
        list[Path] | None,
        typer.Option("--shapes", metavar="FILE", help="Additional SHACL shapes, in Turtle."),
    ] = None,
    fail_on: Annotated[FailOn, typer.Option("--fail-on", help="Lowest level that makes the exit status 1.")] = (
        FailOn.ERROR
    ),
    time_limit: TimeLimitS = 60.0,
    verbose: Annotated[bool, typer.Option("--verbose", help="Show all notes on the shipped ontologies, too.")] = False,
    form: Annotated[FindingsFormat, typer.Option("--format", help="Output format.")] = FindingsFormat.TEXT,
) -> None:
    """Check ontologies and rules: names, arguments, variables, model, shapes, contradictions.

    Exit status: 0 no findings at the level of --fail-on or above; 1 such findings; 2 something cannot be read.
    """
    from suave_des.knowledge.checks.findings import Level, folded, has_level, summary
    from suave_des.scenario.loader import load_scenario
    from suave_des.scenario_knowledge import subject_of
    from suave_des.workbench.check import check as run_checks

    loaded = load_scenario(sources.scenario, **(sources.replacements | {"modes_file": modes}))
    findings = run_checks(replace(subject_of(loaded), shapes=shapes or (), time_limit_s=time_limit))
    shown = findings if verbose else folded(findings, shipped_folder("ontology"))
    if form is FindingsFormat.JSON:
        print_json(findings)
    elif form is FindingsFormat.MARKDOWN:
        print("| level | where | what | remedy |\n| --- | --- | --- | --- |")
        for finding in shown:
            cells = (finding.level, finding.where, finding.message, finding.remedy or "")
            print(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
        print(f"\n{summary(findings)}")
    else:
        print(*shown, summary(findings), sep="\n")
    if has_level(findings, Level(fail_on.upper())):
        raise typer.Exit(FOUND)


@grouped_options
def rules(sources: KnowledgeOptions, form: AsFormat = Format.TEXT) -> None:
    """List all rules as text, in the format that --rules reads."""
    from suave_des.scenario_knowledge import open_base

    base = open_base(sources.loaded())
    if form is Format.JSON:
        print_json([{"name": r.name, "enabled": r.enabled, "file": r.file, "text": r.text} for r in base.rules])
    else:
        print(rules_text(base), end="")


def rules_text(base: Ontology) -> str:
    """Write all rules of a knowledge base as one text, file by file."""
    from suave_des.knowledge.rules.syntax import EXPRESSION
    from suave_des.knowledge.rules.writer import naming, write_rule

    named = naming(lambda iri: not base.vocabulary.means_itself(iri))
    blocks = []
    for file in dict.fromkeys(rule.file for rule in sorted(base.rules, key=lambda rule: base.files.index(rule.file))):
        blocks.append(f"# {file}\n")
        for rule in base.rules:
            if rule.file == file:
                text = write_rule(rule.name, rule.body, rule.head, named, enabled=rule.enabled)
                if any(atom.predicate in ("", EXPRESSION) for atom in rule.atoms):
                    lines = "".join(f"# {line}\n" for line in text.splitlines())
                    text = f"# This rule has an atom without a name, which rules as text cannot have:\n{lines}"
                blocks.append(text)
    return "\n".join(blocks) or "# no rules\n"


def add_rule(
    file: OwlFile,
    rule: Annotated[str, typer.Argument(metavar="RULE", help='The rule: "name: body -> head".')],
) -> None:
    """Add a rule to an OWL file, and leave everything else in it as it is."""
    from suave_des.workbench.rule_editor import add_rule as add

    added = add(file, rule)
    print(f"rule {added.name} is in {file} now; {file}.bak is the previous version")


def remove_rule(file: OwlFile, name: RuleName) -> None:
    """Remove a rule from an OWL file, and leave everything else in it as it is."""
    from suave_des.workbench.rule_editor import remove_rule as remove

    remove(file, name)
    print(f"rule {name} is not in {file} any more; {file}.bak is the previous version")


def enable_rule(file: OwlFile, name: RuleName) -> None:
    """Switch a rule of an OWL file on (swrla:isRuleEnabled)."""
    _switch(file, name, enabled=True)


def disable_rule(file: OwlFile, name: RuleName) -> None:
    """Switch a rule of an OWL file off (swrla:isRuleEnabled), for every reasoner."""
    _switch(file, name, enabled=False)


def _switch(file: Path, name: str, *, enabled: bool) -> None:
    from suave_des.workbench.rule_editor import set_enabled

    word = "enabled" if enabled else "disabled"
    if set_enabled(file, name, enabled=enabled):
        print(f"rule {name} is {word} in {file} now; {file}.bak is the previous version")
    else:
        print(f"rule {name} is {word} in {file} already")


@grouped_options
def try_(
    knowledge: ReplayOptions,
    on: Annotated[
        Path,
        typer.Option(
            "--on",
            metavar="DIR",
            help="Output folder of run, or of a campaign that recorded its knowledge, or a folder of such folders.",
        ),
    ],
    rule: Annotated[str | None, typer.Argument(metavar="RULE", help='Rule to try: "name: body -> head".')] = None,
    disable: Annotated[
        str | None, typer.Option("--disable", metavar="NAME", help="Evaluate without this rule.")
    ] = None,
    form: AsFormat = Format.TEXT,
) -> None:
    """Show when a rule would have fired in recorded missions, and which decisions would have been different.

    No mission is run again: the reasoner evaluates each recorded state with and without the rule. Only a new run shows
    the consequences of a different decision.
    """
    from suave_des.workbench.replay import RuleChange
    from suave_des.workbench.replay import try_rule as replayed

    change = RuleChange(
        rule,
        disable,
        knowledge.ontology or (),
        knowledge.scenario,
        knowledge.rules or (),
        knowledge.disable_rule or (),
        knowledge.reasoner,
        knowledge.time_limit,
        knowledge.values,
    )
    missions = list(replayed(on, change))
    if form is Format.JSON:
        print_json(missions)
        return
    for mission in missions:
        if mission.cycles or len(missions) == 1:
            print(*mission.lines(), sep="\n")
    if len(missions) > 1:
        cycles = [mission.cycles for mission in missions]
        firing = sum(any(each.firings for each in one) for one in cycles)
        changed = [sum(len(each.decisions) for each in one) for one in cycles]
        contradictions = sum(any(each.contradiction for each in one) for one in cycles)
        print(
            f"{len(missions)} missions: fires in {firing}, different decisions in {sum(map(bool, changed))} "
            f"({number_of(sum(changed), 'decision')}), contradictions in {contradictions}"
        )
