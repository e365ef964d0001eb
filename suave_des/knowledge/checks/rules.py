"""Check the rules of a knowledge base together: where they come from, and what they can match."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

from suave_des.knowledge.checks.findings import Finding, Level, finding_from, relative_path
from suave_des.knowledge.checks.kinds import Kinds, mixed_terms
from suave_des.knowledge.checks.missions import did_you_mean_text, unreported_statuses
from suave_des.knowledge.checks.model import (
    dead_rules,
    no_value,
    rules_without_values,
    undeclared_differences,
    unmeasured_rules,
)
from suave_des.knowledge.checks.slips import slips
from suave_des.knowledge.checks.thresholds import decided_comparisons
from suave_des.knowledge.content import Content
from suave_des.knowledge.model import Model
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rules.checks import check_rule
from suave_des.knowledge.rules.files import RulesFile
from suave_des.knowledge.rules.names import Vocabulary
from suave_des.knowledge.rules.syntax import Place, Rule
from suave_des.knowledge.rules.writer import write_atom


def rules_from_text(file: RulesFile, vocabulary: Vocabulary, findings: list[Finding]) -> list[Rule]:
    """The rules of a file whose names are all known; the others, and syntax errors, become findings."""
    findings += map(finding_from, file.parsed.errors)
    rules = []
    for name, rule in file.looked_up(vocabulary):
        if isinstance(rule, Rule):
            rules.append(rule)
        else:
            findings.append(replace(finding_from(rule), rule=name))
    return rules


def rule_problems(content: Content, vocabulary: Vocabulary, sources: Mapping[Path, OntologyFile]) -> Iterator[Finding]:
    """Find what is wrong with each rule by itself, and rules that share a name."""
    names = Counter(rule.name for rule in content.rules)
    for rule in content.rules:
        if names[rule.name] > 1:
            yield _about(rule, sources, Level.WARN, f"{names[rule.name]} rules have this name", "rename one")
        for problem in check_rule(rule, vocabulary):
            if rule.enabled:
                level, message = Level.ERROR if problem.is_fatal else Level.WARN, problem.message
            else:
                level, message = Level.INFO, f"switched off; {problem.message}"
            yield _about(rule, sources, level, message, problem.remedy, problem.place)


def replacing_rules(rules: Sequence[Rule], groups: Sequence[Sequence[Rule]]) -> Iterator[Finding]:
    """Find the rules as text that replace a different rule of the same name."""
    before = {rule.name: rule for rule in rules}
    for group in groups:
        for rule in group:
            old = before.get(rule.name)
            if old is not None and (old.text, old.enabled) != (rule.text, rule.enabled):
                message = f"replaces the rule of this name in {relative_path(old.file)}"
                yield _about(rule, {}, Level.WARN, message, "give it a different name, unless this is intended")
        before |= {rule.name: rule for rule in group}


def rules_that_cannot_fire(
    content: Content,
    model: Model,
    given: Collection[Path],
    sources: Mapping[Path, OntologyFile],
    measured: Collection[str] | None,
) -> Iterator[Finding]:
    """Find the rules that cannot, or hardly can, do what they should.

    These are notes for imported ontologies, which have rules for many models.

    Args:
        content: the ontologies and rules.
        model: what is in them.
        given: files of the user's.
        sources: the ontologies by their paths.
        measured: quality attributes that missions measure; None: any.
    """

    def level_in(rule: Rule) -> Level:
        return Level.WARN if rule.file.resolve() in given else Level.INFO

    dead = [(rule, atom, f"{write_atom(atom)} holds in no state", "") for rule, atom in dead_rules(content, model)]
    known = {id(rule) for rule, *_ in dead}
    for rule, atom, attribute in unmeasured_rules(content, model, measured):
        if id(rule) not in known:
            dead.append((rule, atom, *no_value(attribute, model)))
    known = {id(rule) for rule, *_ in dead}
    for rule, atom, attribute in rules_without_values(content, measured) if measured is not None else ():
        if id(rule) not in known:
            dead.append((rule, atom, f"missions do not measure {attribute}, and no ontology has a value of it", ""))
    kinds = Kinds(content, model)
    found = [(rule, atom, f"can never fire: {message}", remedy) for rule, atom, message, remedy in dead]
    found += mixed_terms(content, kinds)
    for rule, atom in undeclared_differences(content):
        message = f"{write_atom(atom)} needs individuals that are declared different; different names are not enough"
        found.append((rule, atom, message, "add owl:AllDifferent to the ontology (Protégé: Different Individuals)"))
    for rule, atom, message, remedy in found:
        yield _about(rule, sources, level_in(rule), message, remedy or None, atom.place())
    for slip in slips(content, kinds):
        yield _about(slip.rule, sources, level_in(slip.rule), slip.message, slip.remedy, slip.place)


def misspelt_statuses(
    content: Content,
    reported: Mapping[str, Collection[str]],
    given: Collection[Path],
    sources: Mapping[Path, OntologyFile],
) -> Iterator[Finding]:
    """Find the rules that ask for a component's status that nothing reports: a warning where it is misspelt."""
    known = sorted({*chain.from_iterable(reported.values())})
    for rule, atom, status in unreported_statuses(content, known):
        if rule.file.resolve() in given:
            meant = did_you_mean_text(status, known)
            level, remedy = Level.WARN, f'did you mean "{meant}"?'
            if meant is None:
                texts = ", ".join(f'"{each}"' for each in known)
                level, remedy = Level.INFO, f"reported are {texts}; a function of your own can report others"
            message = f'nothing in the simulation reports c_status "{status}"'
            yield _about(rule, sources, level, message, remedy, atom.place(1))


def comparisons_out_of_range(
    content: Content,
    ranges: Mapping[str, tuple[float, float]],
    given: Collection[Path],
    sources: Mapping[Path, OntologyFile],
) -> Iterator[Finding]:
    """Find the rules of the user's that compare a measured value with a number beyond all that missions measure."""
    for rule, atom, attribute, outcome in decided_comparisons(content, ranges):
        if rule.file.resolve() in given:
            low, high = ranges[attribute]
            reached = f"{attribute} is between {low:g} and {high:g}"
            message = f"{write_atom(atom)} {outcome} holds in this scenario: {reached}"
            yield _about(rule, sources, Level.WARN, message, "check the number and its unit", atom.place())


def findings_on_rule(
    name: str, base: Ontology, reported: Mapping[str, Collection[str]], measured: Collection[str]
) -> Iterator[Finding]:
    """Find what is wrong with the rules of a name in a knowledge base.

    Args:
        name: of the rules.
        base: the knowledge base that has them.
        reported: the statuses that the simulation reports, by component.
        measured: the quality attributes that the scenario measures.
    """
    content = replace(base.content, triples=(*base.content.triples, *base.model.triples()))
    sources = {source.path: source for source in base.sources}
    given = {rule.file.resolve() for rule in base.rules if rule.name == name}
    found = chain(
        rule_problems(content, base.vocabulary, sources),
        rules_that_cannot_fire(content, base.model, given, sources, measured),
        misspelt_statuses(content, reported, given, sources),
    )
    return (each for each in found if each.rule == name)


def _about(
    rule: Rule,
    sources: Mapping[Path, OntologyFile],
    level: Level,
    message: str,
    remedy: str | None = None,
    at: Place | None = None,
) -> Finding:
    """Make a finding about a rule, with the line where it begins, or where an atom of it is."""
    if rule.place is None:
        line = sources[rule.file].line_of_rule(rule.name) if rule.file in sources else None
    else:
        line = int(rule.place.removeprefix("line ")) if at is None else at.line
    return Finding(level, message, str(rule.file), line, rule.name, at.column if at else None, remedy)
