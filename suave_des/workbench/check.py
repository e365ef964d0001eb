"""Check a knowledge base: rules, names, model, shapes, and what Pellet says of it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import islice
from pathlib import Path
from typing import Final

from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.content import Content, merge, with_rules
from suave_des.knowledge.limit import TIME_LIMIT_S, TimeLimit
from suave_des.knowledge.model import Model, build_model, check_values, expectations
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import OntologyFile, collect
from suave_des.knowledge.rdf import Triple
from suave_des.knowledge.reasoners import make_reasoner
from suave_des.knowledge.regions import regions_of
from suave_des.knowledge.rules.checks import check_rule
from suave_des.knowledge.rules.files import RulesFile
from suave_des.knowledge.rules.names import Vocabulary, rule_from_text
from suave_des.knowledge.rules.syntax import Atom, Named, Rule
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.knowledge.vocabulary import LANGUAGE_NAMESPACES, PERFORMANCE, RDF_TYPE, TOMASYS, local_name, nearest
from suave_des.resources import shipped_folder
from suave_des.workbench.findings import Finding, Level, fails, finding_of, in_order, shown_path
from suave_des.workbench.reachable import atom_text, dead_rules, unmeasured
from suave_des.workbench.regions import matters, numbers_in, regions_between
from suave_des.workbench.shapes import check_shapes
from suave_des.workbench.undefined import undefined_names

#: Modes that are no function design: the one that a cancelled task sets, and the one that a file starts with.
_NO_DESIGNS: Final = {"fd_unground", "__DEFAULT__"}
#: States that Pellet is asked about; `kb policy` goes through all.
MAX_STATES: Final = 300
_ADD_MODE: Final = "add a mode of this name to the System Modes file, or remove the design"


@dataclass(frozen=True)
class Subject:
    """What is checked.

    Attributes:
        ontologies: files; without any, the shipped suave.owl.
        rules: files of rules as text.
        disabled_rules: names of rules to switch off.
        values: replaces the hasValue of named QAvalue individuals.
        shapes: files of SHACL shapes, besides the shipped ones.
        modes: names of the modes by function; None leaves out what is checked against them.
        needed: functions that the mission cannot do without.
        time_limit_s: for Pellet.
    """

    ontologies: Sequence[Path] = ()
    rules: Sequence[Path] = ()
    disabled_rules: Collection[str] = ()
    values: Mapping[str, Decimal] = field(default_factory=dict)
    shapes: Sequence[Path] = ()
    modes: Mapping[str, Collection[str]] | None = None
    needed: Collection[str] = ()
    time_limit_s: float = TIME_LIMIT_S


def check(subject: Subject) -> tuple[Finding, ...]:
    """All that is to be said of a knowledge base, the worst first.

    Pellet is asked at the end, and only if nothing before was an ERROR.

    Raises:
        InputError: something given cannot be read at all.
    """
    given = list(subject.ontologies) or [shipped_folder("ontology") / "suave.owl"]
    sources = collect(given)
    files = [RulesFile.read(path) for path in subject.rules]
    findings: list[Finding] = []

    def attempt(work: Callable[[], object]) -> None:
        try:
            work()
        except KnowledgeError as error:
            findings.append(finding_of(error))

    content = merge(sources, subject.values)
    attempt(lambda: check_values(content, sources))
    values_are_right = not findings
    built: list[tuple[Model, Content]] = []
    attempt(lambda: built.append(build_model(content, sources)))
    model = built[0][0] if built else None
    vocabulary = Vocabulary.of(content.triples, [] if model is None else [each.iri for each in model.individuals()])
    findings += _undefined(content, model, vocabulary, sources)
    groups = []
    for file in files:
        findings += [finding_of(error) for error in file.parsed.errors]
        rules: list[Rule] = []
        for parsed in file.parsed.rules:
            try:
                rules.append(rule_from_text(parsed, vocabulary, file.path))
            except KnowledgeError as error:
                findings.append(replace(finding_of(error), rule=parsed.name))
        groups.append(rules)
    whole = with_rules(content, groups, subject.disabled_rules)
    lines = {source.path: source for source in sources}
    findings += _replaced(content.rules, groups)
    findings += _of_rules(whole, vocabulary, lines)
    if model is not None:
        findings += _dead(whole, model, {path.resolve() for path in (*given, *subject.rules)}, lines)
        findings += _of_model(whole, model, sources, subject)
        if values_are_right:
            findings += _without_performance(whole, model, sources)
    findings += check_shapes(sources, subject.shapes)
    if not fails(findings, Level.ERROR):
        attempt(lambda: findings.extend(_of_reasoner(subject)))
    return in_order(replace(one, file=shown_path(one.file) if one.file else None) for one in findings)


def _of_rules(content: Content, vocabulary: Vocabulary, sources: Mapping[Path, OntologyFile]) -> Iterator[Finding]:
    names = Counter(rule.name for rule in content.rules)
    for rule in content.rules:
        if names[rule.name] > 1:
            yield _at(rule, sources, Level.WARN, f"{names[rule.name]} rules have this name", remedy="rename one")
        for problem in check_rule(rule, vocabulary):
            level = Level.ERROR if problem.is_fatal else Level.WARN
            message = problem.message
            if not rule.enabled:
                level, message = Level.INFO, f"switched off; {message}"
            found = _at(rule, sources, level, message, problem.remedy)
            if problem.place is not None:
                line = problem.place.line if rule.place else found.line
                found = replace(found, line=line, column=problem.place.column)
            yield found


def _replaced(rules: Sequence[Rule], groups: Sequence[Sequence[Rule]]) -> Iterator[Finding]:
    """Rules as text that take the place of others of their name, and say something else."""
    before = {rule.name: rule for rule in rules}
    for group in groups:
        for rule in group:
            old = before.get(rule.name)
            if old is not None and (old.text, old.enabled) != (rule.text, rule.enabled):
                message = f"takes the place of the rule of this name in {shown_path(old.file)}"
                yield _at(rule, {}, Level.INFO, message)
        before |= {rule.name: rule for rule in group}


def _dead(
    content: Content, model: Model, given: Collection[Path], sources: Mapping[Path, OntologyFile]
) -> Iterator[Finding]:
    """Rules that cannot fire; of imported ontologies, which have rules for many models, that is no surprise."""
    dead: list[tuple[Rule, Atom, str, str | None]] = [
        (rule, atom, f"{atom_text(atom)} holds in no state", None)
        for rule, atom in dead_rules(content.triples, content, model)
    ]
    known = {id(rule) for rule, *_ in dead}
    for rule, atom, attribute in unmeasured(content.triples, content, model):
        if id(rule) not in known:
            message = f"no function design has an estimate of {attribute}, so no grounding has a value of it"
            dead.append((rule, atom, message, f"add a hasQAestimation of type {attribute} to a design"))
    for rule, atom, message, remedy in dead:
        level = Level.WARN if rule.file.resolve() in given else Level.INFO
        found = _at(rule, sources, level, f"can never fire: {message}", remedy)
        place = atom.place()
        if place is not None:
            found = replace(found, column=place.column, line=place.line if rule.place else found.line)
        yield found


def _at(
    rule: Rule, sources: Mapping[Path, OntologyFile], level: Level, message: str, remedy: str | None = None
) -> Finding:
    """A finding on a rule, with the line where the rule begins."""
    line = _line_of_rule(rule.name, sources.get(rule.file))
    if rule.place is not None:
        line = int(rule.place.removeprefix("line "))
    return Finding(level, message, str(rule.file), line, rule.name, remedy=remedy)


def _line_of_rule(name: str, source: OntologyFile | None) -> int | None:
    if source is None:
        return None
    text = source.content.decode("utf-8", "replace")
    found = re.search(rf"label[^<>]*>\s*{re.escape(name)}\s*<", text)
    if found is not None:
        return text.count("\n", 0, found.start()) + 1
    place = source.line_of(name)
    return int(place.removeprefix("line ")) if place else None


def _about(
    sources: Sequence[OntologyFile], level: Level, name: str, message: str, remedy: str | None = None
) -> Finding:
    """A finding on an individual, with the file and line where it is described."""
    for source in sources:
        place = source.line_of(name)
        if place is not None:
            return Finding(level, message, str(source.path), int(place.removeprefix("line ")), remedy=remedy)
    return Finding(level, message, str(sources[0].path), remedy=remedy)


def _undefined(
    content: Content, model: Model | None, vocabulary: Vocabulary, sources: Sequence[OntologyFile]
) -> Iterator[Finding]:
    """Names that are not defined; those of others' vocabularies may be defined elsewhere."""
    for found in undefined_names(content, model, vocabulary):
        level = Level.ERROR if found.is_ours else Level.WARN
        yield _about(sources, level, local_name(found.subject), found.message, found.remedy)


def _without_performance(content: Content, model: Model, sources: Sequence[OntologyFile]) -> Iterator[Finding]:
    expected = expectations(content, model)
    for name in sorted(model.designs):
        if local_name(PERFORMANCE) not in expected.get(name, {}):
            remedy = "add a hasQAestimation of type performance"
            message = f"function design {name} has no performance, and counts 0.001"
            yield _about(sources, Level.WARN, name, message, remedy)


def _of_model(content: Content, model: Model, sources: Sequence[OntologyFile], subject: Subject) -> Iterator[Finding]:
    def about(level: Level, name: str, message: str, remedy: str | None = None) -> Finding:
        return _about(sources, level, name, message, remedy)

    designs: dict[str, list[str]] = {name: [] for name in model.functions}
    functions = {iri: name for name, iri in model.functions.items()}
    names = {iri: name for name, iri in model.designs.items()}
    for design, predicate, function in content.triples:
        if predicate == TOMASYS + "solvesF" and design in names and function in functions:
            designs[functions[str(function)]].append(names[design])
    for name in sorted({*model.functions, *subject.needed}):
        needed = name in subject.needed
        if name not in model.functions:
            yield about(Level.ERROR, name, f"there is no function {name}, which the mission needs")
        elif not designs[name]:
            level = Level.ERROR if needed else Level.WARN
            remedy = f"add an individual of FunctionDesign with solvesF {name}"
            yield about(level, name, f"function {name} has no function design", remedy)
        if subject.modes is not None:
            modes = subject.modes.get(name, ())
            level = Level.ERROR if needed else Level.WARN
            spare = set(modes) - set(designs.get(name, ())) - _NO_DESIGNS
            for design in sorted(set(designs.get(name, ())) - set(modes)):
                remedy = nearest(design, spare) or _ADD_MODE
                yield about(level, design, f"function design {design} has no mode of its name for {name}", remedy)
            for mode in sorted(spare):
                yield about(Level.WARN, name, f"mode {mode} of {name} has no function design, so it is never chosen")
    for name in _unused(content, model):
        yield about(Level.INFO, name, f"nothing refers to {name}")


def _unused(content: Content, model: Model) -> list[str]:
    """Individuals that no fact and no rule mentions, and that are nothing by themselves."""
    mentioned = {value for _, predicate, value in content.triples if predicate != RDF_TYPE and isinstance(value, str)}
    mentioned |= {
        term.iri for rule in content.rules for atom in rule.atoms for term in atom.arguments if isinstance(term, Named)
    }
    active = {*model.designs.values(), *(s for s, p, _ in _facts(content) if s in model.components.values())}
    states = {each.iri for group in (model.objectives, model.groundings, model.measurements) for each in group.values()}
    individuals = {
        subject
        for subject, predicate, value in content.triples
        if predicate == RDF_TYPE and isinstance(value, str) and not value.startswith(LANGUAGE_NAMESPACES)
    }
    return sorted(local_name(iri) for iri in individuals - mentioned - active - states if not iri.startswith(TOMASYS))


def _facts(content: Content) -> Iterator[Triple]:
    return (triple for triple in content.triples if not triple[1].startswith(LANGUAGE_NAMESPACES))


def _of_reasoner(subject: Subject) -> Iterator[Finding]:
    """What comes to light when the knowledge base is used: contradictions, rules that Pellet drops."""
    base = Ontology.load(
        subject.ontologies, values=subject.values, rules=subject.rules, disabled_rules=subject.disabled_rules
    )
    for reason in regions_of(base).reasons:
        yield Finding(
            Level.INFO, f"inferences are remembered for equal measured values only, and so more slowly: {reason}"
        )
    limit = TimeLimit(subject.time_limit_s, "--time-limit")
    try:
        pellet = make_reasoner("pellet", base, limit)
        for state in islice(_plain_states(base), MAX_STATES):
            pellet.infer(state)
    except InputError as error:
        yield finding_of(error)


def _plain_states(base: Ontology) -> Iterator[KnowledgeState]:
    """Each design in use, with one attribute measured in each region that makes a difference; with none at first."""
    attributes = [name for name in base.quality_attributes if matters(base, name)]
    regions = regions_between(numbers_in(base))
    measured: list[tuple[str, Decimal]] = [
        (name, value) for name in attributes for region in regions if (value := region.value()) is not None
    ]
    for measurements in ({}, *({name: value} for name, value in measured)):
        for function in base.functions:
            for design in base.designs(function):
                yield KnowledgeState.of(
                    [ObjectiveState(function)],
                    groundings={function: design},
                    measurements=measurements,
                )
