"""Rules of text files that no knowledge base can be loaded with, each with the reason."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from suave_des.knowledge.content import with_rules
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rules.checks import check_rule, first_error
from suave_des.knowledge.rules.files import RulesFile
from suave_des.knowledge.rules.names import rule_from_text
from suave_des.knowledge.rules.syntax import ParsedRule, Rule, RuleError
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario_knowledge import open_base


@dataclass(frozen=True)
class UnusableRule:
    """A rule that cannot be used.

    Attributes:
        name: its name.
        reason: what is wrong with it, where, and what would be right.
    """

    name: str
    reason: str


def sort_rules(base: Ontology, files: Iterable[Path]) -> tuple[list[Rule], list[UnusableRule]]:
    """Sort the rules of text files into those that can be used and those that cannot.

    Args:
        base: the ontologies, without these files.
        files: of rules as text.

    Raises:
        InputError: a file cannot be read at all, or has a rule whose text cannot be parsed.
    """
    usable: list[Rule] = []
    unusable: list[UnusableRule] = []
    for path in files:
        file = RulesFile.read(path)
        if file.parsed.errors:
            raise file.parsed.errors[0]
        for parsed in file.parsed.rules:
            try:
                rule = rule_from_text(parsed, base.vocabulary, path)
                error = first_error(rule, check_rule(rule, base.vocabulary)) if rule.enabled else None
            except RuleError as found:
                error = found
            if error is None:
                usable.append(rule)
            else:
                unusable.append(UnusableRule(parsed.name, _reason(error, parsed)))
    return usable, unusable


def _reason(error: RuleError, parsed: ParsedRule) -> str:
    problem = error.problem.removeprefix(f"rule {parsed.name}: ")
    where = f" ({error.place})" if error.place else ""
    return f"{problem}{where}" + (f"; {error.remedy}" if error.remedy else "")


def open_without_unusable(loaded: LoadedScenario) -> tuple[Ontology, list[UnusableRule]]:
    """Open the knowledge base of a scenario with those of its rules as text that can be used, and list the others.

    Raises:
        InputError: something else cannot be read.
    """
    scenario, rules = loaded.scenario, loaded.rules
    names = scenario.knowledge.disabled_rules
    knowledge = scenario.knowledge.model_copy(update={"disabled_rules": []})
    base = open_base(replace(loaded, scenario=scenario.model_copy(update={"knowledge": knowledge}), rules=()))
    usable, unusable = sort_rules(base, rules)
    broken = {each.name for each in unusable}
    content = with_rules(base.content, [usable], [name for name in names if name not in broken])
    return base.with_rules(content.rules), unusable
