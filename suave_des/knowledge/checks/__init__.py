"""Checks of a knowledge base that need no reasoner; `kb check` adds those that do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from suave_des.errors import KnowledgeError
from suave_des.findings import Finding, Level, relative_path
from suave_des.knowledge.checks.model import check_revision
from suave_des.knowledge.checks.registry import Material, Subject, run_checks
from suave_des.knowledge.checks.rules import findings_on_rule
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rules import Rule, RuleError
from suave_des.knowledge.rules.checks import Vocabulary, about_rule
from suave_des.knowledge.rules.files import RulesFile

__all__ = ["Subject", "findings_in", "findings_on_rule", "static_findings"]


def static_findings(subject: Subject, sources: Sequence[OntologyFile]) -> list[Finding]:
    """Find what needs no reasoner, which takes some 10 ms, in files that may have errors.

    Args:
        subject: what to check.
        sources: its ontologies and their imports.

    Raises:
        InputError: a file of rules cannot be read at all; the scenario names a value or a rule that is not there.
    """
    findings = list[Finding]()

    def usable(file: RulesFile, vocabulary: Vocabulary) -> Sequence[Rule]:
        found = list(file.looked_up(vocabulary))
        findings.extend(map(Finding.of, file.parsed.errors))
        findings.extend(replace(Finding.of(rule), rule=name) for name, rule in found if isinstance(rule, RuleError))
        if not found and not file.parsed.errors:
            findings.append(Finding(Level.INFO, "there is no rule in this file", file=str(file.path)))
        return [rule for _, rule in found if isinstance(rule, Rule)]

    files = [RulesFile.read(path) for path in subject.rules]
    try:
        base = Ontology.merged(sources, files, usable, subject.values, subject.disabled_rules, subject.operators)
    except KnowledgeError as error:
        if error.file is None:  # about a name that the scenario gives, and no file
            raise
        return [*findings, Finding.of(error)]
    return [*findings, *findings_in(base, subject)]


def findings_in(base: Ontology, subject: Subject) -> list[Finding]:
    """Find what needs no reasoner in a knowledge base that has been opened.

    Args:
        base: the ontologies and rules, with the operators that the revision assumes.
        subject: what it was opened from, and what missions have to do with it.
    """
    remedy = "give it a different name, unless this is intended"
    findings = [
        about_rule(new, f"replaces the rule of this name in {relative_path(old.file)}", None, remedy, Level.WARN)
        for old, new in base.content.replaced
        if (old.text, old.enabled) != (new.text, new.enabled)
    ]
    try:
        check_revision(base, subject.measured or (), subject.revision)
    except KnowledgeError as error:
        findings.append(Finding.of(error))
    return [*findings, *run_checks(Material(subject, base))]
