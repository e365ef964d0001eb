"""Checks of a knowledge base that need no reasoner; `kb check` adds those that do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from suave_des.errors import KnowledgeError
from suave_des.findings import Finding, Level, relative_path
from suave_des.knowledge.checks.model import check_revision
from suave_des.knowledge.checks.registry import Material, Scope, Subject, run_checks
from suave_des.knowledge.checks.rules import findings_on_rule
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rules import Rule, RuleError
from suave_des.knowledge.rules.checks import Vocabulary, about_rule
from suave_des.knowledge.rules.files import RulesFile, rules_of

__all__ = ["Subject", "findings_on_rule", "static_findings"]


def static_findings(subject: Subject, sources: Sequence[OntologyFile]) -> list[Finding]:
    """Find what needs no reasoner, which takes some 10 ms.

    Args:
        subject: what to check.
        sources: its ontologies and their imports.

    Raises:
        InputError: a file of rules cannot be read at all; the scenario names a value or a rule that is not there.
    """
    findings, groups = list[Finding](), list[Sequence[Rule]]()

    def usable(file: RulesFile, vocabulary: Vocabulary) -> Sequence[Rule]:
        found = list(file.looked_up(vocabulary))
        findings.extend(map(Finding.of, file.parsed.errors))
        findings.extend(replace(Finding.of(rule), rule=name) for name, rule in found if isinstance(rule, RuleError))
        if not found and not file.parsed.errors:
            findings.append(Finding(Level.INFO, "there is no rule in this file", file=str(file.path)))
        groups.append([rule for _, rule in found if isinstance(rule, Rule)])
        return groups[-1]

    files = [RulesFile.read(path) for path in subject.rules]
    try:
        base = Ontology.merged(sources, files, usable, subject.values, subject.disabled_rules, subject.operators)
    except KnowledgeError as error:
        if error.file is None:  # about a name that the scenario gives, and no file
            raise
        return [*findings, Finding.of(error)]
    findings += _replacing([rule for source in sources for rule in rules_of(source)], groups)
    try:
        check_revision(base, subject.measured or (), subject.revision)
    except KnowledgeError as error:
        findings.append(Finding.of(error))
    return [*findings, *run_checks(Material(subject, base), *Scope)]


def _replacing(rules: Sequence[Rule], groups: Sequence[Sequence[Rule]]) -> Iterator[Finding]:
    """Find the rules as text that replace a different rule of the same name."""
    before = {rule.name: rule for rule in rules}
    for group in groups:
        for rule in group:
            old = before.get(rule.name)
            if old is not None and (old.text, old.enabled) != (rule.text, rule.enabled):
                message = f"replaces the rule of this name in {relative_path(old.file)}"
                remedy = "give it a different name, unless this is intended"
                yield about_rule(rule, message, remedy=remedy, level=Level.WARN)
        before |= {rule.name: rule for rule in group}
