"""Check a knowledge base before anything runs: rules, names, model, shapes, and what Pellet reports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from difflib import get_close_matches
from itertools import chain, islice
from pathlib import Path
from typing import Final

from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.content import Content, merge, with_rules
from suave_des.knowledge.model import Model, assumption, build_model, check_values, with_operators
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import OntologyFile, collect, enumerated_texts
from suave_des.knowledge.pellet.limit import TIME_LIMIT_S, ReasonerTimeoutError, TimeLimit
from suave_des.knowledge.reasoners import make_reasoner
from suave_des.knowledge.regions import regions_of
from suave_des.knowledge.rules.checks import check_rule
from suave_des.knowledge.rules.files import RulesFile
from suave_des.knowledge.rules.names import Vocabulary
from suave_des.knowledge.rules.syntax import Place, Rule
from suave_des.knowledge.rules.writer import write_atom
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.resources import shipped_folder
from suave_des.workbench.findings import Finding, Level, finding_about, finding_from, has_level, ordered, relative_path
from suave_des.workbench.kind_checks import Kinds, misused_properties, mixed_terms
from suave_des.workbench.mission_checks import mismatched_attributes, unreported_components, unreported_statuses
from suave_des.workbench.model_checks import (
    check_designs,
    check_shapes,
    dead_rules,
    designs_without_performance,
    no_estimate,
    undeclared_differences,
    undefined_names,
    unmeasured_rules,
    unused_individuals,
)
from suave_des.workbench.policy.space import component_statuses, has_effect, interchangeable_components
from suave_des.workbench.ranges import numbers_in, ranges_between

#: States that Pellet is asked about; `kb policy` goes through all.
MAX_STATES: Final = 300


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
    time_limit_s: float = TIME_LIMIT_S


def check(subject: Subject) -> tuple[Finding, ...]:
    """Check a knowledge base.

    Pellet is asked at the end, even after an ERROR, unless it prevents the knowledge base from being loaded.

    Returns:
        all findings, the worst first.

    Raises:
        InputError: a file cannot be read at all.
    """
    given = list(subject.ontologies) or [shipped_folder("ontology") / "suave.owl"]
    sources = collect(given)
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
    groups = [_rules_from_text(file, vocabulary, findings) for file in files]
    for file in files:
        if not file.parsed.rules and not file.parsed.errors:
            findings.append(Finding(Level.INFO, "there is no rule in this file", file=str(file.path)))
    whole = with_rules(content, groups, subject.disabled_rules)
    by_path = {source.path: source for source in sources}
    findings += _replacing_rules(content.rules, groups)
    findings += _check_rules(whole, vocabulary, by_path)
    if model is not None:
        own = {path.resolve() for path in (*given, *subject.rules)}
        findings += _dead_rules(whole, model, own, by_path)
        findings += misused_properties(whole, Kinds(whole, model), sources)
        findings += check_designs(whole, model, sources, subject.modes, subject.needed, subject.effects)
        findings += unused_individuals(whole, model, sources)
        if subject.reported is not None:
            findings += unreported_components(whole, model, sources, subject.reported)
            findings += _unreported_statuses(whole, subject.reported, own, by_path)
        if subject.measured is not None:
            findings += mismatched_attributes(whole, model, sources, subject.measured)
        for name, sign in assumed.items():
            findings.append(finding_about(name, sources, Level.INFO, assumption(name, sign)))
        if values_are_right:
            findings += designs_without_performance(whole, model, sources)
    known = {} if model is None else {model.attributes[name]: sign for name, sign in assumed.items()}
    findings += check_shapes(sources, subject.shapes, known)
    findings += _ask_pellet(subject, findings)
    return ordered(replace(one, file=relative_path(one.file) if one.file else None) for one in findings)


def _rules_from_text(file: RulesFile, vocabulary: Vocabulary, findings: list[Finding]) -> list[Rule]:
    """The rules of a file whose names are all known; the others, and syntax errors, become findings."""
    findings += map(finding_from, file.parsed.errors)
    rules = []
    for name, rule in file.looked_up(vocabulary):
        if isinstance(rule, Rule):
            rules.append(rule)
        else:
            findings.append(replace(finding_from(rule), rule=name))
    return rules


def _check_rules(content: Content, vocabulary: Vocabulary, sources: Mapping[Path, OntologyFile]) -> Iterator[Finding]:
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


def _replacing_rules(rules: Sequence[Rule], groups: Sequence[Sequence[Rule]]) -> Iterator[Finding]:
    """Find the rules as text that replace a different rule of the same name."""
    before = {rule.name: rule for rule in rules}
    for group in groups:
        for rule in group:
            old = before.get(rule.name)
            if old is not None and (old.text, old.enabled) != (rule.text, rule.enabled):
                message = f"replaces the rule of this name in {relative_path(old.file)}"
                yield _about(rule, {}, Level.WARN, message, "give it a different name, unless this is intended")
        before |= {rule.name: rule for rule in group}


def _dead_rules(
    content: Content, model: Model, given: Collection[Path], sources: Mapping[Path, OntologyFile]
) -> Iterator[Finding]:
    """Find the rules that cannot, or hardly can, fire: notes for imported ontologies, with rules for many models."""
    dead = [(rule, atom, f"{write_atom(atom)} holds in no state", "") for rule, atom in dead_rules(content, model)]
    known = {id(rule) for rule, *_ in dead}
    for rule, atom, attribute in unmeasured_rules(content, model):
        if id(rule) not in known:
            dead.append((rule, atom, *no_estimate(attribute)))
    found = [(rule, atom, f"can never fire: {message}", remedy) for rule, atom, message, remedy in dead]
    found += mixed_terms(content, Kinds(content, model))
    for rule, atom in undeclared_differences(content):
        message = f"{write_atom(atom)} needs individuals that are declared different; different names are not enough"
        found.append((rule, atom, message, "add owl:AllDifferent to the ontology (Protégé: Different Individuals)"))
    for rule, atom, message, remedy in found:
        level = Level.WARN if rule.file.resolve() in given else Level.INFO
        yield _about(rule, sources, level, message, remedy or None, atom.place())


def _unreported_statuses(
    content: Content,
    reported: Mapping[str, Collection[str]],
    given: Collection[Path],
    sources: Mapping[Path, OntologyFile],
) -> Iterator[Finding]:
    """Find the rules that ask for a component's status that nothing reports: a warning where it is misspelt."""
    known = sorted({*chain.from_iterable(reported.values())})
    for rule, atom, status in unreported_statuses(content, known):
        if rule.file.resolve() in given:
            meant = next((each for each in known if each.casefold() == status.casefold()), None)
            meant = meant or next(iter(get_close_matches(status, known)), None)
            level, remedy = Level.WARN, f'did you mean "{meant}"?'
            if meant is None:
                texts = ", ".join(f'"{each}"' for each in known)
                level, remedy = Level.INFO, f"reported are {texts}; a function of your own can report others"
            message = f'nothing in the simulation reports c_status "{status}"'
            yield _about(rule, sources, level, message, remedy, atom.place(1))


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


def _ask_pellet(subject: Subject, before: Sequence[Finding]) -> Iterator[Finding]:
    """Use the knowledge base: this brings up contradictions, and rules that Pellet drops."""
    is_wrong = has_level(before, Level.ERROR)
    try:
        base = Ontology.load(
            subject.ontologies,
            values=subject.values,
            rules=subject.rules,
            disabled_rules=subject.disabled_rules,
            operators=subject.operators,
        )
    except KnowledgeError as error:
        message = "contradictions were not checked with Pellet: first correct the errors that prevent loading"
        yield Finding(Level.INFO, message) if is_wrong else finding_from(error)
        return
    for reason in regions_of(base).reasons:
        yield Finding(Level.INFO, f"inferences are cached for equal measured values only, which is slower: {reason}")
    try:
        # What is in its cache has been asked with this very knowledge base, without a contradiction or a dropped rule.
        pellet = make_reasoner("cached", base, TimeLimit(subject.time_limit_s, "--time-limit"))
        states = tuple(islice(simple_states(base, subject.measured), MAX_STATES)) or (KnowledgeState(),)
        try:
            for state in combined(states):
                pellet.infer(state)
        except ReasonerTimeoutError:
            raise
        except KnowledgeError:
            for state in states:  # the first that contradicts itself is the easiest to understand
                pellet.infer(state)
            raise  # only a combination does
    except InputError as error:
        found = finding_from(error)
        if found.rule not in {one.rule for one in before if one.rule and one.level is Level.ERROR}:
            yield found
        else:
            message = (
                f"contradictions were not checked with Pellet: it does not use rule {found.rule} until it is corrected"
            )
            yield Finding(Level.INFO, message)


def combined(states: Sequence[KnowledgeState]) -> tuple[KnowledgeState, ...]:
    """Combine states that do not exclude one another: 45 instead of 186 for the shipped ontologies.

    A contradiction occurs in every state that contains it: Pellet's reasoning is monotonic.
    """
    joined: list[tuple[dict[str, str], dict[str, str], dict[str, Decimal]]] = []
    for state in states:
        groundings, components, measurements = dict(state.groundings), dict(state.components), dict(state.measurements)
        for designs, reports, values in joined:
            if _agree(designs, groundings) and _agree(reports, components) and _agree(values, measurements):
                designs.update(groundings)
                reports.update(components)
                values.update(measurements)
                break
        else:
            joined.append((groundings, components, measurements))
    return tuple(
        KnowledgeState.of(map(ObjectiveState, designs), groundings=designs, components=reports, measurements=values)
        for designs, reports, values in joined
    )


def _agree(one: Mapping[str, object], other: Mapping[str, object]) -> bool:
    return all(one.get(name, value) == value for name, value in other.items())


def simple_states(base: Ontology, measured: Collection[str] | None = None) -> Iterator[KnowledgeState]:
    """Each design in use, alone, with a report of a component, and with a value in each range of each attribute.

    Only attributes that have an effect and, if those are given, are measured count, and one component of those that
    are treated alike.
    """
    ranges = ranges_between(numbers_in(base))
    reports = [{group[0]: status} for group in interchangeable_components(base) for status in component_statuses(base)]
    measurements = [
        {name: value}
        for name in base.quality_attributes
        if has_effect(base, name) and (measured is None or name in measured)
        for one in ranges
        if (value := one.value()) is not None
    ]
    for reported, values in (({}, {}), *((each, {}) for each in reports), *(({}, each) for each in measurements)):
        for function in base.functions:
            for design in base.designs(function):
                yield KnowledgeState.of(
                    [ObjectiveState(function)],
                    groundings={function: design},
                    components=reported,
                    measurements=values,
                )
