"""Checks of a knowledge base that need no reasoner; `kb check` adds those that do."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from suave_des.errors import KnowledgeError
from suave_des.findings import Finding, Level, relative_path
from suave_des.knowledge.checks.model import check_revision
from suave_des.knowledge.checks.registry import Material, Scope, Subject, run_checks
from suave_des.knowledge.checks.rules import findings_on_rule
from suave_des.knowledge.content import merge, with_rules
from suave_des.knowledge.model import build_model, with_operators
from suave_des.knowledge.ontology_file import OntologyFile, enumerated_texts
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.rules.checks import Vocabulary, about_rule
from suave_des.knowledge.rules.files import RulesFile

__all__ = ["Subject", "findings_on_rule", "static_findings"]


def static_findings(subject: Subject, sources: Sequence[OntologyFile]) -> list[Finding]:
    """Find what needs no reasoner, which takes some 10 ms.

    Args:
        subject: what to check.
        sources: its ontologies and their imports.

    Raises:
        InputError: a file of rules cannot be read at all.
    """
    content = merge(sources, subject.values)
    findings: list[Finding] = []
    try:
        model, _ = build_model(content, sources)
    except KnowledgeError as error:
        return [*findings, Finding.of(error)]
    vocabulary = Vocabulary.of(content.triples, [each.iri for each in model.individuals()], enumerated_texts(sources))
    groups = []
    for path in subject.rules:
        file, group = RulesFile.read(path), list[Rule]()
        findings += map(Finding.of, file.parsed.errors)
        for name, rule in file.looked_up(vocabulary):
            if isinstance(rule, Rule):
                group.append(rule)
            else:
                findings.append(replace(Finding.of(rule), rule=name))
        if not file.parsed.rules and not file.parsed.errors:
            findings.append(Finding(Level.INFO, "there is no rule in this file", file=str(path)))
        groups.append(group)
    findings += _replacing(content.rules, groups)
    whole, assumed = with_operators(with_rules(content, groups, subject.disabled_rules), model, subject.operators)
    material = Material(subject, sources, whole, model, vocabulary, assumed)
    try:
        check_revision(material, subject.measured or (), subject.revision)
    except KnowledgeError as error:
        findings.append(Finding.of(error))
    return [*findings, *run_checks(material, *Scope)]


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
