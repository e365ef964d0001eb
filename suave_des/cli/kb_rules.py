"""suave-des kb rules: list rules as text. kb add-rule, remove-rule, enable-rule, disable-rule: edit OWL files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.kb_options import Format, Formats, ScenarioOption, print_json
from suave_des.cli.options import DisabledRules, Ontologies, RuleFiles

if TYPE_CHECKING:
    from suave_des.knowledge.ontology import Ontology

OwlFile = Annotated[Path, typer.Argument(metavar="FILE", help="An OWL file; FILE.bak keeps what it was before.")]
RuleName = Annotated[str, typer.Argument(metavar="NAME", help="Name of a rule of the file.")]


def rules(
    ontology: Ontologies = None,
    rules: RuleFiles = None,
    disable_rule: DisabledRules = None,
    scenario: ScenarioOption = "seams2023",
    form: Formats = Format.TEXT,
) -> None:
    """List all rules as text that --rules reads back."""
    from suave_des.scenario.loader import load_scenario
    from suave_des.simulation.knowledge import open_base

    loaded = load_scenario(scenario, ontologies=ontology or (), rules=rules or (), disabled_rules=disable_rule or ())
    base = open_base(loaded)
    if form is Format.JSON:
        print_json(
            [
                {"name": rule.name, "enabled": rule.enabled, "file": str(rule.file), "text": rule.text}
                for rule in base.rules
            ]
        )
    else:
        print(rules_text(base), end="")


def rules_text(base: Ontology) -> str:
    """All rules of a knowledge base as one text, by file."""
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
                    said = "# This rule has an atom without a name, which rules as text cannot have:\n"
                    text = said + "".join(f"# {line}\n" for line in text.splitlines())
                blocks.append(text)
    return "\n".join(blocks) or "# no rules\n"


def add_rule(
    file: OwlFile,
    rule: Annotated[str, typer.Argument(metavar="RULE", help='The rule: "name: body -> head".')],
) -> None:
    """Add a rule to an OWL file, and leave the rest of it as it is."""
    from suave_des.workbench.rule_editor import add_rule as add

    added = add(file, rule)
    print(f"rule {added.name} is in {file} now; {file}.bak is as it was")


def remove_rule(file: OwlFile, name: RuleName) -> None:
    """Remove a rule from an OWL file, and leave the rest of it as it is."""
    from suave_des.workbench.rule_editor import remove_rule as remove

    remove(file, name)
    print(f"rule {name} is not in {file} any more; {file}.bak is as it was")


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
        print(f"rule {name} is {word} in {file} now; {file}.bak is as it was")
    else:
        print(f"rule {name} is {word} in {file} already")
