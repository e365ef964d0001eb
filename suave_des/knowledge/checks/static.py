"""Check a knowledge base without a reasoner: rules, names, model, and what missions have to do with it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from suave_des.errors import KnowledgeError
from suave_des.knowledge.checks.findings import Finding, Level, finding_about, finding_from
from suave_des.knowledge.checks.individuals import classes_instead_of_individuals, confused_individuals, misspelt_facts
from suave_des.knowledge.checks.kinds import Kinds, misused_properties
from suave_des.knowledge.checks.missions import mismatched_attributes, unreported_components
from suave_des.knowledge.checks.model import (
    check_designs,
    designs_without_performance,
    undefined_names,
    unused_individuals,
)
from suave_des.knowledge.checks.rules import (
    comparisons_out_of_range,
    misspelt_statuses,
    replacing_rules,
    rule_problems,
    rules_from_text,
    rules_that_cannot_fire,
)
from suave_des.knowledge.content import merge, with_rules
from suave_des.knowledge.model import Model, assumption, build_model, check_values, with_operators
from suave_des.knowledge.ontology_file import OntologyFile, enumerated_texts
from suave_des.knowledge.pellet.limit import TIME_LIMIT_S
from suave_des.knowledge.rules.files import RulesFile
from suave_des.knowledge.rules.names import Vocabulary
from suave_des.resources import shipped_folder


@dataclass(frozen=True)
class Subject:
    """What to check.

    Attributes:
        ontologies: files; without any, the shipped suave.owl.
        rules: files of rules as text.
        disabled_rules: names of rules to disable.
        values: replaces the hasValue of named QAvalue individuals.
        shapes: files of SHACL shapes, in addition to the shipped ones.
        modes: names of the modes by function; None skips the checks against them.
        effects: what modes do, by function and mode: one that does the same as one with a function design needs none.
        needed: functions that the mission cannot do without.
        operators: qa_comparison_operator that the revision assumes of quality attribute types that have none, by name.
        reported: the statuses that the simulation reports, by component; None: that is not checked.
        measured: the quality attributes that the scenario measures; None: that is not checked.
        ranges: the smallest and the greatest value of measured attributes, where they are known.
        time_limit_s: for Pellet.
    """

    ontologies: Sequence[Path] = ()
    rules: Sequence[Path] = ()
    disabled_rules: Collection[str] = ()
    values: Mapping[str, Decimal] = field(default_factory=dict)
    shapes: Sequence[Path] = ()
    modes: Mapping[str, Collection[str]] | None = None
    effects: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    needed: Collection[str] = ()
    operators: Mapping[str, str] = field(default_factory=dict)
    reported: Mapping[str, Collection[str]] | None = None
    measured: Collection[str] | None = None
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    time_limit_s: float = TIME_LIMIT_S

    @property
    def given(self) -> list[Path]:
        """The ontologies, or the shipped one."""
        return list(self.ontologies) or [shipped_folder("ontology") / "suave.owl"]


class StaticFindings(NamedTuple):
    """What is found without a reasoner.

    Attributes:
        findings: in the order of the checks.
        assumed: comparison operators that were assumed, by the IRI of the quality attribute type.
    """

    findings: list[Finding]
    assumed: Mapping[str, str]


def static_findings(subject: Subject, sources: Sequence[OntologyFile]) -> StaticFindings:
    """Find what needs no reasoner, which takes some 10 ms.

    Args:
        subject: what to check.
        sources: its ontologies and their imports.

    Raises:
        InputError: a file of rules cannot be read at all.
    """
    files = [RulesFile.read(path) for path in subject.rules]
    findings: list[Finding] = []

    def attempt(work: Callable[[], object]) -> None:
        try:
            work()
        except KnowledgeError as error:
            findings.append(finding_from(error))

    content = merge(sources, subject.values)
    attempt(lambda: check_values(content, sources))
    values_are_right = not findings
    built: list[Model] = []
    attempt(lambda: built.append(build_model(content, sources)[0]))
    model = built[0] if built else None
    assumed: Mapping[str, str] = {} if model is None else with_operators(content, model, subject.operators)[1]
    individuals = [] if model is None else [each.iri for each in model.individuals()]
    vocabulary = Vocabulary.of(content.triples, individuals, enumerated_texts(sources))
    findings += undefined_names(content, model, vocabulary, sources)
    groups = [rules_from_text(file, vocabulary, findings) for file in files]
    for file in files:
        if not file.parsed.rules and not file.parsed.errors:
            findings.append(Finding(Level.INFO, "there is no rule in this file", file=str(file.path)))
    whole = with_rules(content, groups, subject.disabled_rules)
    by_path = {source.path: source for source in sources}
    findings += replacing_rules(content.rules, groups)
    findings += rule_problems(whole, vocabulary, by_path)
    if model is not None:
        own = {path.resolve() for path in (*subject.given, *subject.rules)}
        findings += rules_that_cannot_fire(whole, model, own, by_path, subject.measured)
        findings += misused_properties(whole, Kinds(whole, model), sources)
        findings += check_designs(whole, model, sources, subject.modes, subject.needed, subject.effects)
        findings += unused_individuals(whole, model, sources)
        findings += confused_individuals(whole, model, sources, subject.measured)
        modes = {*chain.from_iterable((subject.modes or {}).values())}
        findings += classes_instead_of_individuals(whole, model, sources, modes)
        if subject.reported is not None:
            findings += unreported_components(whole, model, sources, subject.reported)
            statuses = {*chain.from_iterable(subject.reported.values())}
            findings += misspelt_facts(whole, model, sources, statuses)
            findings += misspelt_statuses(whole, subject.reported, own, by_path)
        if subject.measured is not None:
            findings += mismatched_attributes(whole, model, sources, subject.measured)
        findings += comparisons_out_of_range(whole, subject.ranges, own, by_path)
        for name, sign in assumed.items():
            findings.append(finding_about(name, sources, Level.INFO, assumption(name, sign)))
        if values_are_right:
            findings += designs_without_performance(whole, model, sources)
    known = {} if model is None else {model.attributes[name]: sign for name, sign in assumed.items()}
    return StaticFindings(findings, known)
