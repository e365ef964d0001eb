"""Checks of a knowledge base that need no reasoner.

A check is a function that yields findings. It is in CHECKS, at the end. Which rules cannot fire is
an upper bound of what can hold in any state. `kb check` adds the shapes of the model (SHACL), and
what Pellet says.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property
from itertools import chain, filterfalse, takewhile
from pathlib import Path
from typing import NamedTuple

from suave_des.domain import DEFAULT_MODE, GENERATE_SEARCH_PATH, UNGROUND_MODE, WATER_VISIBILITY
from suave_des.errors import Finding, KnowledgeError, Level, nearest, relative_path, similar
from suave_des.knowledge import rdf
from suave_des.knowledge.ontology import OPERATORS, Content, Model, Ontology, wrong_values
from suave_des.knowledge.ontology_file import place_of
from suave_des.knowledge.pellet import TIME_LIMIT_S
from suave_des.knowledge.rdf import (
    BOOLEAN,
    C_STATUS,
    FUNCTIONAL,
    HAS_QA_VALUE,
    HAS_VALUE,
    IS_QA_TYPE,
    NUMERIC,
    O_STATUS,
    OWL,
    PERFORMANCE,
    QA_OPERATOR,
    RDF_TYPE,
    RDFS,
    STRING,
    SUBPROPERTY,
    TOMASYS,
    Lit,
    Triple,
    local_name,
)
from suave_des.knowledge.resolver import Sources, as_written, is_metamodel
from suave_des.knowledge.rules import (
    COMPARISONS,
    NOT_THE_SAME,
    Atom,
    AtomKind,
    Named,
    Place,
    Rule,
    RuleError,
    Term,
    Variable,
    write_atom,
    write_term,
)
from suave_des.knowledge.rules.files import (
    NOUNS,
    WITHOUT_NAME,
    RulesFile,
    about_rule,
    looked_up,
    rule_problems,
    variable_uses,
)
from suave_des.resources import shipped_folder, shown_name

Findings = Iterator[Finding]


@dataclass(frozen=True)
class Subject:
    """What to check.

    Attributes:
        ontologies: files; without any, the shipped suave.owl.
        rules: files of rules as text.
        disabled_rules: names of rules to disable.
        values: replaces the hasValue of named QAvalue individuals.
        modes: names of the modes by function; None skips the checks against them.
        needed: functions that the mission cannot do without.
        operators: qa_comparison_operator that the revision assumes of quality attribute types that
            have none, by name.
        revision: the scenario's, for messages.
        reported: the statuses that the simulation reports, by component; None: that is not checked.
        measured: the quality attributes that the scenario measures; None: that is not checked.
        reaction_thresholds_m: visibilities by which the mean reaction time is judged; None: that is
            not checked.
        time_limit_s: for Pellet.
    """

    ontologies: Sequence[Path] = ()
    rules: Sequence[Path] = ()
    disabled_rules: Collection[str] = ()
    values: Mapping[str, Decimal] = field(default_factory=dict)
    modes: Mapping[str, Collection[str]] | None = None
    needed: Collection[str] = ()
    operators: Mapping[str, str] = field(default_factory=dict)
    revision: str = ""
    reported: Mapping[str, Collection[str]] | None = None
    measured: Collection[str] | None = None
    reaction_thresholds_m: Collection[float] | None = None
    time_limit_s: float = TIME_LIMIT_S


@dataclass(frozen=True, eq=False)
class Material:
    """What checks look at: the subject, and its ontologies and rules with the operators that the
    revision assumes.
    """

    subject: Subject
    base: Ontology

    @cached_property
    def content(self) -> Content:
        """All that the files state, that which only holds in states, too."""
        return replace(
            self.base.content,
            triples=tuple(dict.fromkeys((*self.base.content.triples, *self.base.stated))),
        )

    @cached_property
    def terms(self) -> frozenset[str]:
        """All IRIs that the ontologies have but as subjects."""
        both = (*self.content.triples, *self.content.structure)
        return frozenset(str(term) for _, *rest in both for term in rest)

    @property
    def rules(self) -> tuple[Rule, ...]:
        """The enabled rules."""
        return self.content.enabled_rules

    @cached_property
    def dead(self) -> list[tuple[Rule, Atom]]:
        """The enabled rules that fire in no state, each with an atom of its body that can never
        hold.

        An atom cannot hold if no ontology asserts its class or property, no state adds it and no
        rule that can fire concludes it. Individuals and values are not distinguished. So every rule
        that is returned is dead, but not every dead rule is returned.
        """
        content = self.content
        held = self._held_without_rules()
        steps = _schema_steps(content.triples)
        possible = rdf.reached(held, steps)
        not_followed = {*chain.from_iterable(content.structure)}  # expressions, property chains

        def allows(atom: Atom) -> bool:
            if atom.kind not in NOUNS or atom.expression:
                return True
            return atom.predicate in possible or atom.predicate in not_followed

        def can_fire(rule: Rule) -> bool:
            return all(map(allows, rule.body))

        waiting = list(content.enabled_rules)
        while firing := list(filter(can_fire, waiting)):
            waiting = [rule for rule in waiting if rule not in firing]
            held.update(atom.predicate for rule in firing for atom in rule.head)
            possible = rdf.reached(held, steps)
        return [(rule, next(filterfalse(allows, rule.body))) for rule in waiting]

    def _held_without_rules(self) -> set[str]:
        """The classes and properties of what the ontologies or a state may assert."""
        model = self.base.model
        held = {OWL + "Thing"} | rdf.terms(
            TOMASYS,
            "Objective FunctionGrounding typeF typeFD solvesO o_always_improve c_status o_status",
        )
        held.update(name for _, name in rdf.memberships(self.content.triples))
        held.update(name for _, name, _ in self.content.triples)
        if model.attributes:
            held |= {TOMASYS + "QAvalue", IS_QA_TYPE, HAS_VALUE}
        if any(model.estimated.values()):
            held.add(HAS_QA_VALUE)
        return held

    @cached_property
    def for_other_models(self) -> list[Rule]:
        """The rules of TOMASys and mros, which have rules for any model, that need what this model
        does not have.
        """
        known = self.base.vocabulary.kinds
        return [
            rule
            for rule, _ in self.dead
            if self.is_of_metamodel(rule)
            and all(each.kind == "builtin" or each.predicate in known for each in rule.atoms)
        ]

    def is_of_metamodel(self, rule: Rule) -> bool:
        """Whether a rule is one of TOMASys or mros."""
        return any(
            source.path == rule.file and is_metamodel(source) for source in self.base.sources
        )

    def is_own(self, rule: Rule) -> bool:
        """Whether a rule is in a file that the user gave, and not one of TOMASys."""
        ontologies = self.subject.ontologies or [self.base.sources[0].path]
        given = {path.resolve() for path in (*ontologies, *self.subject.rules)}
        return rule.file.resolve() in given and not self.is_of_metamodel(rule)

    def measures(self, attribute: str) -> bool:
        """Whether missions measure a quality attribute, or that is not checked."""
        return self.subject.measured is None or attribute in self.subject.measured

    def about(self, level: Level, name: str, message: str, remedy: str | None = None) -> Finding:
        """Make a finding about the thing of a name."""
        file, line = place_of(name, self.base.sources)
        return Finding(level, message, str(file), line, remedy=remedy)

    def suspicious(
        self, rule: Rule, place: Place | None, message: str, remedy: str | None
    ) -> Finding:
        """Make a finding about a rule; of one in an imported ontology it is a note."""
        level = Level.WARN if self.is_own(rule) else Level.NOTE
        return about_rule(rule, message, place, remedy, level)

    def wrong_atom(self, rule: Rule, atom: Atom, problem: str, remedy: str | None) -> Finding:
        """Make a finding about an atom of a rule, whose text it begins with."""
        return self.suspicious(rule, atom.place(), f"{write_atom(atom)} {problem}", remedy)


def _schema_steps(triples: Iterable[Triple]) -> list[tuple[str, str]]:
    """Each class or property with those to which its members or values lead."""
    leads = rdf.terms(RDFS, "subClassOf domain range")
    both_ways = rdf.terms(OWL, "equivalentClass equivalentProperty inverseOf")
    return [
        *rdf.links(triples, *leads),
        *rdf.both_ways(rdf.links(triples, *both_ways, SUBPROPERTY)),
    ]


def static_findings(subject: Subject, sources: Sources) -> list[Finding]:
    """Find what needs no reasoner, which takes some 10 ms, in files that may have errors.

    The sources are the subject's ontologies and their imports.

    Raises:
        InputError: a file of rules cannot be read at all; the scenario names a value or a rule that
            is not there.
    """
    files = [RulesFile.read(path) for path in subject.rules]
    try:
        base = Ontology.merged(sources, subject.values, subject.operators)
    except KnowledgeError as error:
        return [Finding.of(error)]
    findings = list[Finding]()
    groups = []
    for file in files:
        findings += map(Finding.of, file.errors)
        if not file.parsed and not file.errors:
            findings.append(
                Finding(Level.NOTE, "there is no rule in this file", file=str(file.path))
            )
        groups.append(group := list[Rule]())
        for rule in file.parsed:
            try:
                group.append(looked_up(rule, base.vocabulary))
            except RuleError as error:
                findings.append(replace(Finding.of(error), rule=rule.name))
    base = base.with_files(files, groups, subject.disabled_rules)
    base.check_names(subject.values, subject.disabled_rules)
    return [*findings, *findings_in(base, subject)]


def findings_in(base: Ontology, subject: Subject) -> list[Finding]:
    """Find what needs no reasoner in a knowledge base that has been opened from a subject."""
    material = Material(subject, base)
    return [finding for check in CHECKS for finding in check(material)]


# The files.


def imports(material: Material) -> Findings:
    """Note which files supply what the user's files import, in one line for each of these."""
    shipped = shipped_folder("ontology")
    by_file: dict[Path, list[str]] = defaultdict(list)
    for supply in material.base.supplies:
        if supply.importing.parent != shipped:
            said = f"{as_written(supply.iri)} is {shown_name(supply.file)} ({supply.reason})"
            by_file[supply.importing].append(said)
    for file, said_of_file in by_file.items():
        yield Finding(Level.NOTE, f"imports: {'; '.join(said_of_file)}", str(file))


# The model, and what missions have to do with it.

_ABOUT_CLASSES = rdf.terms(RDFS, "subClassOf domain range") | rdf.terms(
    OWL, "equivalentClass disjointWith"
)
_PROPERTIES = ("object property", "data property", "annotation property")


def values(material: Material) -> Findings:
    """Find the values that no state can be compared with, or that contradict one another."""
    for subject, problem, remedy in wrong_values(material.base.stated):
        name = local_name(subject)
        yield material.about(Level.ERROR, name, f"{name}: {problem}", remedy)


def undefined_names(material: Material) -> Findings:
    """Find the classes, properties and individuals that are used and defined nowhere: most are
    misspelt.

    Only those of the ontologies' own namespaces: names of other vocabularies may be defined
    elsewhere.
    """
    names = _Described(material)
    for triple in material.content.triples:
        used = names.undefined_in(triple)
        if used is None or rdf.namespace(used.iri) not in names.namespaces:
            continue
        subject, predicate, _ = triple
        name = local_name(subject)
        problem = f"{name}: {used.words} {local_name(used.iri)} is not defined"
        otherwise = "declare it, or correct the name"
        if predicate == IS_QA_TYPE and used.kinds == ("individual",):
            otherwise = "declare a QualityAttributeType of this name"
        remedy = names.nearest(used, subject) or otherwise
        yield material.about(Level.ERROR, name, problem, remedy)


class _Used(NamedTuple):
    """A name that is used: in words what for, its IRI, and the kinds of names that it may be."""

    words: str
    iri: str
    kinds: tuple[str, ...]


class _Described:
    """The names that the ontologies describe."""

    def __init__(self, material: Material) -> None:
        model = material.base.model
        self._in_states = model.in_states
        self._kinds = material.base.vocabulary.kinds
        self._described = {subject for subject, _, _ in material.content.triples} | self._in_states
        self._assumed = [(model.attributes[name], QA_OPERATOR) for name in material.base.assumed]
        self.namespaces = {rdf.namespace(iri) for iri in self._described}

    def undefined_in(self, triple: Triple) -> _Used | None:
        """The name in a triple that is not defined, its property before its value; None: none."""
        subject, predicate, value = triple
        if predicate == RDF_TYPE or predicate in _ABOUT_CLASSES:
            return self._undefined_class(predicate, value)
        if not rdf.is_thing(predicate) or (subject, predicate) in self._assumed:
            return None
        if predicate not in self._described:
            return _Used("property", predicate, _PROPERTIES)
        leads_to_things = "object property" in self._kinds.get(predicate, ())
        if leads_to_things and rdf.is_thing(value) and value not in self._described:
            return _Used(local_name(predicate), value, ("individual",))
        return None

    def _undefined_class(self, predicate: str, value: str | Lit) -> _Used | None:
        wanted = {"class", "datatype"} if predicate == RDFS + "range" else {"class"}
        if not rdf.is_thing(value) or wanted & self._kinds.get(value, frozenset()):
            return None
        words = "class" if predicate == RDF_TYPE else local_name(predicate)
        return _Used(words, value, ("class",))

    def nearest(self, used: _Used, subject: str) -> str | None:
        """Ask whether another name was meant: of the same last part, else the most similar one."""
        known = [
            iri
            for iri in self._described - self._in_states - {subject}
            if not self._kinds.get(iri, frozenset()).isdisjoint(used.kinds)
        ]
        same = sorted(iri for iri in known if local_name(iri) == local_name(used.iri))
        if same:
            return f"did you mean {' or '.join(same)}?"
        return nearest(local_name(used.iri), map(local_name, known))


def functions_without_design(material: Material) -> Findings:
    """Find the functions that have no design, or that the mission needs and that are not there."""
    needed = material.subject.needed
    for name, problem, remedy in material.base.unsolved({*material.base.functions, *needed}):
        level = Level.ERROR if name in needed else Level.WARN
        yield material.about(level, name, problem, remedy)


def designs_and_modes(material: Material) -> Findings:
    """Find the function designs that no mode has the name of, and the modes that metacontrol never
    chooses.
    """
    known = material.subject.modes
    if known is None:
        return
    otherwise = "add a mode of this name to the System Modes file, or remove the design"
    for function in sorted(material.base.functions):
        designs = {*material.base.designs(function)}
        modes = {*known.get(function, ())} - {UNGROUND_MODE, DEFAULT_MODE}
        for design in sorted(designs - modes):
            problem = f"function design {design} has no mode of the same name for {function}"
            yield material.about(
                Level.ERROR, design, problem, nearest(design, modes - designs) or otherwise
            )
        if spare := ", ".join(sorted(modes - designs)):
            problem = f"modes of {function} without function design, which metacontrol never chooses: {spare}"
            yield material.about(Level.NOTE, function, problem)


def attributes_that_do_not_fit(material: Material) -> Findings:
    """Find quality attributes that missions measure and ontologies lack, or compare with
    nothing.
    """
    model = material.base.model
    measured = material.subject.measured or ()
    for name in sorted({*measured} - model.attributes.keys()):
        problem = (
            f"missions measure {name}, but no ontology has a quality attribute type of this name"
        )
        remedy = nearest(name, model.attributes) or "declare a QualityAttributeType of this name"
        yield material.about(Level.WARN, name, problem, remedy)
    if not rules_of_2023(material.base):
        for name in without_operator(material.base, measured):
            expecting = (design for design, names in model.estimated.items() if name in names)
            problem = (
                f"{name} has no qa_comparison_operator, so what is measured never rules out a "
                f"design: {', '.join(sorted(expecting))}"
            )
            remedy = f"give it one of {' '.join(OPERATORS)}, usually <"
            yield material.about(Level.WARN, name, problem, remedy)


def values_that_are_not_used(material: Material) -> Findings:
    """Find values that ontologies give of measurements, in whose place missions have others."""
    valued = rdf.subjects(material.content.triples, HAS_VALUE)
    for name, iri in material.base.model.measurements.items():
        if iri in valued and not material.measures(name):
            problem = f"hasValue of {local_name(iri)} is not used: {name} has the value that missions measure"
            yield material.about(Level.WARN, local_name(iri), problem, "measure it in the scenario")


def attributes_declared_twice(material: Material) -> Findings:
    """Find the quality attribute types that several files declare: what each of them says of one
    holds.
    """
    for name, iri in material.base.model.attributes.items():
        declared = iri, RDF_TYPE, TOMASYS + "QualityAttributeType"
        files = [each for each in material.base.sources if declared in each.about(iri)]
        for each in files[:-1]:
            problem = f"declares the quality attribute type {name}, and so does {relative_path(files[-1].path)}"
            place = (str(each.path), each.line_of(name))
            yield Finding(Level.WARN, problem, *place, remedy="declare it in one of them")


def unknown_to_missions(material: Material) -> Findings:
    """Note the components whose status nothing reports, and the attributes that designs expect and
    nothing measures.
    """
    content = material.content
    subject = material.subject
    asserted = rdf.subjects(content.triples, C_STATUS)
    if subject.reported is not None and C_STATUS not in content.concluded:
        for name, iri in sorted(material.base.model.components.items()):
            if name not in subject.reported and iri not in asserted:
                nothing = f"nothing in the simulation reports the status of component {name}"
                remedy = f"reported are {', '.join(subject.reported)}"
                yield material.about(
                    Level.NOTE, name, f"{nothing}, so it has none in missions", remedy
                )
    for name in sorted(_expected(material.base.model)):
        if not material.measures(name):
            nothing = "so what designs expect of it is compared with nothing"
            yield material.about(Level.NOTE, name, f"missions do not measure {name}, {nothing}")


def without_operator(base: Ontology, measured: Collection[str]) -> list[str]:
    """Return the quality attributes that missions measure and designs expect, and that cannot be
    compared.
    """
    compared = rdf.subjects(base.content.triples, QA_OPERATOR)
    known = base.model.attributes
    return sorted(
        name for name in _expected(base.model).intersection(measured) if known[name] not in compared
    )


def _expected(model: Model) -> frozenset[str]:
    """The quality attributes of which designs expect a value, without the performance."""
    return frozenset().union(*model.estimated.values()) - {local_name(PERFORMANCE)}


def thresholds_without_reaction(material: Material) -> Findings:
    """Find the search designs whose expected visibility the metric of reactions does not know."""
    known = material.subject.reaction_thresholds_m
    if known is None:
        return
    for design in material.base.designs(GENERATE_SEARCH_PATH):
        expected_m = material.base.expected(design).get(WATER_VISIBILITY)
        if expected_m is not None and float(expected_m) not in known:
            problem = f"{design} expects {expected_m} m of visibility, which is not a threshold of mean_reaction_time_s"
            remedy = "set reaction_metric.visibility_thresholds_m and expected_altitudes_m"
            yield material.about(Level.WARN, design, problem, remedy)


def assumed_operators(material: Material) -> Findings:
    """Note which comparison operators are assumed."""
    return (
        material.about(Level.NOTE, name, words) for name, words in material.base.assumptions.items()
    )


def rules_of_2023(base: Ontology) -> list[tuple[Rule, Atom]]:
    """Find the enabled rules that conclude the status UPDATABLE, as the exemplar's ontologies of
    2023 do.
    """
    updatable = Lit("UPDATABLE", STRING)
    return [
        (rule, atom)
        for rule in base.content.enabled_rules
        for atom in rule.head
        if atom.predicate == O_STATUS and updatable in atom.arguments
    ]


def check_revision(base: Ontology, measured: Collection[str], revision: str) -> None:
    """Check that ontologies of the exemplar's revision 2023 are used with that revision.

    With a later one no design is ever ruled out, as its code assumes no operator, so that
    objectives stay in error; the first thruster that recovers then contradicts that.

    Args:
        base: the ontologies with the operators that the revision assumes, and rules.
        measured: the quality attributes that the scenario measures.
        revision: the scenario's, for the message.

    Raises:
        KnowledgeError: with the file and line of the rule.
    """
    missing = without_operator(base, measured)
    for rule, atom in rules_of_2023(base) if missing else ():
        problem = f"these are ontologies of revision 2023, and the scenario's revision is {revision}: rule {rule.name} "
        problem += f"concludes {write_atom(atom)}, and {missing[0]} has no qa_comparison_operator"
        remedy = f'write revision: "2023" in the scenario, or use ontologies of revision {revision}'
        raise KnowledgeError(
            problem, file=rule.file, place=f"line {rule.line}" if rule.line else None, remedy=remedy
        )


def another_revision(material: Material) -> Findings:
    """Find ontologies of revision 2023 in a scenario of another one."""
    try:
        check_revision(material.base, material.subject.measured or (), material.subject.revision)
    except KnowledgeError as error:
        yield Finding.of(error)


# Rules that Pellet would ignore, or that never fire.


def mistakes_that_pellet_ignores(material: Material) -> Findings:
    """Find what Pellet would drop or ignore without a word."""
    for rule in material.rules:
        if rule not in material.for_other_models:
            for place, message, remedy, is_fatal in rule_problems(rule, material.base.vocabulary):
                if is_fatal:
                    yield about_rule(rule, message, place, remedy)
                else:
                    yield material.suspicious(rule, place, message, remedy)


_TEXTS = {STRING, BOOLEAN}


def never_comparable(material: Material) -> Findings:
    """Find comparisons of a number with a text or a truth value, which hold for no values."""
    ranges = material.base.vocabulary.ranges
    for rule in material.rules:
        datatypes: dict[Term, frozenset[str]] = {
            atom.arguments[1]: ranges.get(atom.predicate, frozenset())
            for atom in rule.body
            if atom.kind == "data" and len(atom.arguments) == 2
        }
        for atom in rule.body:
            for place in _compared_texts(atom, datatypes):
                term = atom.arguments[place]
                problem = f"{write_term(term)} is no number, and never compares with one"
                remedy = "write numbers without quotes" if isinstance(term, Lit) else None
                yield material.suspicious(rule, atom.place(place), problem, remedy)


def _compared_texts(atom: Atom, datatypes: Mapping[Term, frozenset[str]]) -> Iterator[int]:
    """The place of a text or truth value that an atom compares with a number, if it does."""
    if COMPARISONS.get(atom.predicate, "!=") == "!=" or len(atom.arguments) != 2:
        return
    kinds = [_datatypes_of(term, datatypes) for term in atom.arguments]
    for place, (kind, other) in enumerate(zip(kinds, reversed(kinds), strict=True)):
        if kind and other and kind <= _TEXTS and other <= NUMERIC:
            yield place


def _datatypes_of(term: Term, known: Mapping[Term, frozenset[str]]) -> frozenset[str]:
    """The datatypes that the value of a term can have; none where nothing is known."""
    return frozenset({term.datatype}) if isinstance(term, Lit) else known.get(term, frozenset())


def literals_of_expressions(material: Material) -> Findings:
    """Find literals in class expressions and data ranges that are none of their datatype."""
    for source in material.base.sources:
        for subject, _, value in source.triples:
            if rdf.is_node(subject) and isinstance(value, Lit) and not rdf.is_well_formed(value):
                problem = f"a class expression has {value.text!r}, which is not an xsd:{local_name(value.datatype)}"
                yield Finding(Level.ERROR, problem, str(source.path))


def undeclared_terms(material: Material) -> Findings:
    """Find what rules use and no ontology declares, which a reasoner takes all the same."""
    vocabulary = material.base.vocabulary
    for rule in material.rules:
        for name in rule.undeclared:
            problem = (
                f"?{name} is not declared as a variable; in a value's place Pellet takes it for one"
            )
            yield material.suspicious(rule, None, problem, "declare it: a swrl:Variable")
        for number, atom in enumerate(rule.atoms):
            is_taken = number >= len(rule.body) or atom.predicate in vocabulary.used
            is_undeclared = atom.predicate not in vocabulary.kinds and not atom.expression
            if is_taken and is_undeclared and atom.kind in NOUNS:
                noun = NOUNS[atom.kind]
                words = f"{noun} {local_name(atom.predicate)} is not defined"
                guess = vocabulary.guess(atom.predicate, (noun,))
                remedy = guess or f"declare it as {noun} in the ontology"
                yield material.suspicious(
                    rule, atom.place(), f"{words}: it is taken as the rule uses it", remedy
                )


def shared_names(material: Material) -> Findings:
    """Find rules of one name, other than those of TOMASys and mros, and those that replace another
    one.
    """
    rules = material.content.rules
    names = Counter(rule.name for rule in rules)
    own = {
        rule.name
        for rule in rules
        if not material.is_of_metamodel(rule) and not rule.name.endswith(WITHOUT_NAME)
    }
    for rule in rules:
        if names[rule.name] > 1 and rule.name in own:
            problem = f"{names[rule.name]} rules have this name"
            yield material.suspicious(rule, None, problem, "rename one")
    for old, new in material.content.replaced:
        if (old.text, old.enabled) != (new.text, new.enabled):
            problem = f"replaces the rule of this name in {relative_path(old.file)}"
            yield about_rule(
                new, problem, None, "give it a different name, unless this is intended", Level.WARN
            )


def for_other_models(material: Material) -> Findings:
    """Note the rules of TOMASys and mros that need what this model does not have, a file in one
    line.
    """
    by_file: dict[Path, list[str]] = defaultdict(list)
    for rule in material.for_other_models:
        by_file[rule.file].append(rule.name)
    for file, names in by_file.items():
        message = f"rules for other models, which never fire in this one: {', '.join(names)}"
        yield Finding(Level.NOTE, message, str(file))


def unmeasured_rules(material: Material) -> Iterator[tuple[Rule, Atom, str, str | None]]:
    """Find the enabled rules that need a value of a quality attribute of which nothing has one.

    A grounding has the measured values (hasQAvalue) of those attributes that its function design
    has an estimate of. Other values are in the ontologies, or measured.

    Yields:
        each rule with the atom that names the attribute, what is wrong, and what would be right.
    """
    content = material.content
    if IS_QA_TYPE in content.concluded:
        return
    of_groundings = _without_value_in_groundings(material)
    stated = rdf.values(content.triples, IS_QA_TYPE)
    for rule in content.enabled_rules:
        held = {atom.arguments[-1] for atom in rule.body if atom.predicate == HAS_QA_VALUE}
        for atom, attribute in attributes_asked(rule):
            name = local_name(attribute)
            if atom.arguments[0] in held:
                if name in of_groundings:
                    yield rule, atom, *of_groundings[name]
            elif not material.measures(name) and attribute not in stated:
                problem = f"missions do not measure {name}, and no ontology has a value of it"
                yield rule, atom, problem, None


def _without_value_in_groundings(material: Material) -> dict[str, tuple[str, str | None]]:
    """The quality attributes of which no grounding ever has a value, each with the reason, and what
    would be right.
    """
    content, model = material.content, material.base.model
    if HAS_QA_VALUE in content.concluded | {name for _, name, _ in content.triples}:
        return {}
    estimated = frozenset().union(*model.estimated.values())
    found: dict[str, tuple[str, str | None]] = {}
    for name in model.attributes:
        so = f"{name}, so no grounding has a value of it"
        if name not in estimated:
            remedy = f"add a hasQAestimation of type {name} to a design"
            found[name] = (f"no function design has an estimate of {so}", remedy)
        elif not material.measures(name):
            found[name] = (f"missions do not measure {so}", None)
    return found


def attributes_asked(rule: Rule) -> Iterator[tuple[Atom, str]]:
    """The atoms of a rule that name the quality attribute of a value, with its IRI."""
    for atom in rule.body:
        if atom.predicate == IS_QA_TYPE and len(atom.arguments) == 2:
            attribute = atom.arguments[1]
            if isinstance(attribute, Named):
                yield atom, attribute.iri


def never_fires(material: Material) -> Findings:
    """Find rules with an atom that can hold in no state, or that need a value that nothing has."""
    told = list(material.for_other_models)
    dead = [
        (rule, atom, f"{write_atom(atom)} holds in no state", None) for rule, atom in material.dead
    ]
    for rule, atom, problem, remedy in (*dead, *unmeasured_rules(material)):
        if rule not in told:
            told.append(rule)
            yield material.suspicious(rule, atom.place(), f"can never fire: {problem}", remedy)


#: Axioms by which individuals are different: declared so, or members of disjoint classes or
# properties.
_MAKE_DIFFERENT = re.compile(OWL + "(different|AllD|disjoint|propertyDisjoint|complement)")


def equal_individuals(material: Material) -> Findings:
    """Find rules that ask for different individuals (differentFrom), where nothing makes any
    different.

    Values of functional properties can, so such a rule is suspicious, not dead.
    """
    heads = {atom.kind for atom in material.content.conclusions}
    if not any(map(_MAKE_DIFFERENT.match, material.terms)) and "different" not in heads:
        needs = "needs individuals that are declared different; different names are not enough"
        remedy = "add owl:AllDifferent to the ontology (Protégé: Different Individuals)"
        yield from _asking_for(material, "different", needs, remedy)


def _asking_for(
    material: Material, kind: AtomKind, problem: str, remedy: str | None = None
) -> Findings:
    """Find atoms of a kind in the bodies of rules."""
    for rule in material.rules:
        for atom in rule.body:
            if atom.kind == kind:
                yield material.wrong_atom(rule, atom, problem, remedy)


def identities_of_names(material: Material) -> Findings:
    """Find rules that ask about identity with nothing but names, as knowledge.rules says."""
    remedy = "add an atom about these individuals, such as their class"
    for rule in material.rules:
        for atom in rule.identities_of_names:
            yield material.wrong_atom(rule, atom, NOT_THE_SAME, remedy)


#: Axioms by which individuals that have different names can be the same.
_MAKE_SAME = re.compile(OWL + "(sameAs|InverseFunctional|.*ardinality|oneOf|hasKey|hasValue)")


def same_individuals(material: Material) -> Findings:
    """Find rules that ask for the same individuals (sameAs), where nothing makes any the same."""
    if not _can_be_the_same(material):
        problem = "holds of an individual and itself only: nothing says that two names mean one"
        yield from _asking_for(material, "same", problem)


def _can_be_the_same(material: Material) -> bool:
    """Whether axioms or rules can make two individuals one."""
    if any(map(_MAKE_SAME.match, material.terms)):
        return True
    kinds = material.base.vocabulary.kinds
    every = (*material.content.triples, *material.content.structure)
    functional = rdf.members(every, [FUNCTIONAL])
    if any(rdf.is_node(name) or "object property" in kinds.get(name, ()) for name in functional):
        return True
    return any(atom.kind == "same" for atom in material.content.conclusions)


# Rules that cannot mean what their author wanted.


def misspelt_variables(material: Material) -> Findings:
    """Find variables that occur once, and whose name is nearly that of another."""
    for rule in material.rules:
        places: dict[str, list[Place | None]] = defaultdict(list)
        values: dict[str, set[bool]] = defaultdict(set)
        for atom, number, name in variable_uses(rule.atoms):
            values[name].add(atom.takes_value(number))
            places[name].append(atom.place(number))
        for name, (place, *more) in places.items():
            alike = {each: places[each] for each in places if values[each] & values[name]}
            meant = None if more else _meant(name, alike)
            if meant is not None:
                problem = f"?{name} occurs only here, and is another variable than ?{meant}"
                yield material.suspicious(rule, place, problem, f"did you mean ?{meant}?")


def _meant(name: str, alike: Mapping[str, Sequence[Place | None]]) -> str | None:
    """The variable, of some with their places, whose name one is probably a misspelling of: one
    that occurs more often, else one that occurs before.
    """
    often = (each for each, places in alike.items() if len(places) > 1)
    return _near(name, often) or _near(name, takewhile(name.__ne__, alike))


def _near(name: str, names: Iterable[str]) -> str | None:
    """The first of some names that one is probably a misspelling of."""
    return next((each for each in names if are_near(name, each)), None)


def are_near(one: str, other: str) -> bool:
    """Whether one name is probably a misspelling of the other: in its capitals, or in letters
    inside it.

    Names that differ in a digit, in their first letter or in their last one are often meant:
    ?speed1 and ?speed2, ?xpos and ?ypos, ?design and ?design_b.
    """
    if one.casefold() == other.casefold():
        return one != other
    has_same_ends = one[0] == other[0] and (one[-1] == other[-1] or sorted(one) == sorted(other))
    is_word = (one + other).isalpha() and (one + other).islower() and min(len(one), len(other)) > 2
    return has_same_ends and is_word and similar(one, [other], cutoff=0.8) is not None


def two_values(material: Material) -> Findings:
    """Find what a rule asks, or concludes, to have two values of a property that has one."""
    functional = rdf.members(material.content.triples, [FUNCTIONAL])
    for rule in material.rules:
        asked: dict[tuple[str, Term], Term] = {}
        for atom in rule.body:
            if atom.predicate in functional and len(atom.arguments) == 2:
                subject, value = atom.arguments
                before = asked.setdefault((atom.predicate, subject), value)
                is_known = not isinstance(before, Variable) and not isinstance(value, Variable)
                if is_known and not _same(before, value):
                    name = local_name(atom.predicate)
                    problem = f"{write_atom(atom)}: nothing has two values of {name}, so the rule never fires"
                    yield material.suspicious(
                        rule, atom.place(), problem, "write a rule for each value"
                    )
        yield from _changed_values(material, rule, asked)


def _changed_values(
    material: Material, rule: Rule, asked: Mapping[tuple[str, Term], Term]
) -> Findings:
    """Find the conclusions of a rule that give another value to what its body asks for."""
    comparing = [atom for atom in rule.body if COMPARISONS.get(atom.predicate) == "="]
    equated = {term for atom in comparing for term in atom.arguments}
    for atom in rule.head:
        before = asked.get((atom.predicate, atom.arguments[0]))
        if atom.kind != "data" or before is None or before in equated:
            continue
        if not _same(before, atom.arguments[-1]):
            problem = f"contradicts {local_name(atom.predicate)} in the body, which holds as well"
            yield material.wrong_atom(rule, atom, problem, "rules add facts, and change none")


def _same(one: Term, other: Term) -> bool:
    """Whether two terms are the same variable, individual or value."""
    if isinstance(one, Lit) and isinstance(other, Lit):
        return rdf.canonical(one) == rdf.canonical(other)
    return one == other


_FD_REALISABILITY = TOMASYS + "fd_realisability"


def no_effect(material: Material) -> Findings:
    """Find rules that conclude that a design is realisable, which no decision asks."""
    if any(atom.predicate == _FD_REALISABILITY for rule in material.rules for atom in rule.body):
        return
    problem = (
        "fd_realisability true has no effect: a design counts as realisable unless it is false"
    )
    remedy = "write the opposite condition, and conclude false"
    for rule in material.rules:
        for atom in rule.head:
            term = atom.arguments[-1] if atom.predicate == _FD_REALISABILITY else None
            if isinstance(term, Lit) and term.text in ("true", "1"):
                yield material.suspicious(rule, atom.place(), problem, remedy)


def misspelt_statuses(material: Material) -> Findings:
    """Find the user's rules that ask for a component's status that is nearly one that the
    simulation reports.

    Statuses that an ontology asserts, or a rule concludes, are known as well.
    """
    reported = {*chain.from_iterable((material.subject.reported or {}).values())}
    by_capitals = {each.upper(): each for each in sorted(reported)}
    known = reported | _other_statuses(material)
    for rule in filter(material.is_own, material.rules):
        for atom, status in _statuses_asked(rule):
            if isinstance(status, Lit) and status.datatype == STRING:
                meant = similar(status.text.upper(), by_capitals)
                if status.text not in known and meant is not None:
                    problem = f'nothing in the simulation reports c_status "{status.text}"'
                    remedy = f'did you mean "{by_capitals[meant]}"?'
                    yield material.suspicious(rule, atom.place(1), problem, remedy)


def _other_statuses(material: Material) -> set[str]:
    """The statuses of components that an ontology asserts or a rule concludes."""
    found: list[Term | str] = [o for _, p, o in material.content.triples if p == C_STATUS]
    heads = material.content.conclusions
    found += [atom.arguments[-1] for atom in heads if atom.predicate == C_STATUS]
    return {value.text for value in found if isinstance(value, Lit)}


def _statuses_asked(rule: Rule) -> Iterator[tuple[Atom, Term]]:
    """What the body of a rule asks as the status of a component, in a comparison, too."""
    asking = [atom for atom in rule.body if atom.predicate == C_STATUS]
    yield from ((atom, atom.arguments[-1]) for atom in asking)
    statuses = {atom.arguments[-1] for atom in asking if isinstance(atom.arguments[-1], Variable)}
    for atom in rule.body:
        is_equation = COMPARISONS.get(atom.predicate) in ("=", "!=")
        if is_equation and not statuses.isdisjoint(atom.arguments):
            yield from ((atom, term) for term in atom.arguments)


CHECKS: tuple[Callable[[Material], Iterable[Finding]], ...] = (
    values,
    undefined_names,
    functions_without_design,
    designs_and_modes,
    attributes_that_do_not_fit,
    values_that_are_not_used,
    attributes_declared_twice,
    unknown_to_missions,
    thresholds_without_reaction,
    assumed_operators,
    another_revision,
    mistakes_that_pellet_ignores,
    undeclared_terms,
    never_comparable,
    literals_of_expressions,
    shared_names,
    for_other_models,
    never_fires,
    equal_individuals,
    identities_of_names,
    same_individuals,
    misspelt_variables,
    two_values,
    no_effect,
    misspelt_statuses,
    imports,
)
