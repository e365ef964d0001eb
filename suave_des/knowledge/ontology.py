"""An ontology with its imports and rules: merged and checked, ready to be reasoned with and planned
on.

Its model has the functions, designs, components and quality attributes, and the triples of a state
in its terms.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import operator
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, TypeGuard

from suave_des.errors import KnowledgeError, nearest
from suave_des.knowledge import rdf
from suave_des.knowledge.ontology_file import (
    OntologyFile,
    enumerated_texts,
    place_of,
)
from suave_des.knowledge.rdf import (
    BOOLEAN,
    C_STATUS,
    DECIMAL,
    DECISION_PROPERTIES,
    EXACT,
    FIRST,
    FUNCTIONAL,
    HAS_QA_VALUE,
    HAS_VALUE,
    IS_QA_TYPE,
    MROS,
    O_STATUS,
    OWL,
    QA_OPERATOR,
    RDF_TYPE,
    RDFS,
    REST,
    STRING,
    SUBCLASS,
    SUBPROPERTY,
    SWRL,
    SWRLA,
    TOMASYS,
    Lit,
    Triple,
    local_name,
)
from suave_des.knowledge.resolver import Sources, Supply, collect
from suave_des.knowledge.rules import Atom, Rule, Variable
from suave_des.knowledge.rules.files import (
    RulesFile,
    Vocabulary,
    check_property_use,
    rules_of,
    triples_of,
)
from suave_des.knowledge.state import (
    Fact,
    KnowledgeState,
    Value,
    grounding_name,
    measurement_name,
    objective_name,
)

# The content of files, in the form that reasoners are given: N-Triples, which, unlike RDF/XML, all
# libraries in use write and read without loss.

_DECLARED = rdf.terms(OWL, "ObjectProperty DatatypeProperty Class")
#: What only an object property can be: it is one, whether or not it is declared as one.
_OF_OBJECT_PROPERTIES = rdf.terms(
    OWL,
    "InverseFunctionalProperty TransitiveProperty SymmetricProperty AsymmetricProperty "
    "ReflexiveProperty IrreflexiveProperty",
)
_PROPERTIES = _OF_OBJECT_PROPERTIES | rdf.terms(
    OWL, "ObjectProperty DatatypeProperty FunctionalProperty"
)
_TRANSITIVE = OWL + "TransitiveProperty"
_CHAIN = OWL + "propertyChainAxiom"
#: That of the first draft of OWL 2, which is about a property without a name.
_CHAIN_OF_DRAFT = OWL + "propertyChain"
#: Begins the IRIs given to rules, by which Pellet's warnings and explanations name them.
RULE_IRI = "urn:suave-des:rule:"
#: Annotations, which mean nothing for inference.
_ANNOTATIONS = rdf.terms(RDFS, "label comment seeAlso isDefinedBy") | {
    OWL + "versionInfo",
    SWRLA + "isRuleEnabled",
}


class Terms(NamedTuple):
    """The terms to read after an inference: properties for their values, classes for their members;
    sorted IRIs.
    """

    properties: tuple[str, ...]
    classes: tuple[str, ...]


@dataclass(frozen=True)
class Content:
    """The content of all ontology files.

    Attributes:
        triples: about named things and with named things or literals as values, without those of
            rules.
        structure: all others, with blank nodes in them (class expressions).
        rules: the rules of all files, disabled ones included.
        replaced: rules that those of the same name in a later file of rules have replaced, each
            with its replacement.
    """

    triples: tuple[Triple, ...]
    structure: tuple[Triple, ...]
    rules: tuple[Rule, ...]
    replaced: tuple[tuple[Rule, Rule], ...] = ()

    @property
    def enabled_rules(self) -> tuple[Rule, ...]:
        """The enabled rules."""
        return tuple(rule for rule in self.rules if rule.enabled)

    @property
    def conclusions(self) -> list[Atom]:
        """The atoms that the enabled rules conclude."""
        return [atom for rule in self.enabled_rules for atom in rule.head]

    @property
    def concluded(self) -> frozenset[str]:
        """The properties and classes that an enabled rule can assert."""
        return frozenset(name for name, _ in _concluded(self.enabled_rules))

    @cached_property
    def given_back(self) -> tuple[str, ...]:
        """The properties whose entailed values must be asserted before rules see all of them.

        Pellet matches rules with the values that it holds, and not with those that follow from two
        others: of a transitive property, or by a chain of properties. For a rule that asks for such
        a property it tries every choice of individuals: it may lose inferences, and may never end,
        depending on the order of its axioms.
        """
        asked = {a.predicate for r in self.enabled_rules for a in r.body if a.kind == "object"}
        if any(p == _CHAIN_OF_DRAFT or o == _TRANSITIVE for _, p, o in self.structure):
            return tuple(sorted(asked))  # joined without a name: it may be any of them
        both = (*self.triples, *self.structure)
        joined = {s for s, p, o in both if o == _TRANSITIVE or p == _CHAIN}
        return tuple(sorted(asked & rdf.reached(joined, self._related_properties())))

    def joined_by_rules(self) -> Content:
        """The same with rules in place of axioms that join values, from which Pellet concludes all
        that holds of named individuals, and at once.
        """
        rules: list[Rule] = []
        kept: list[Triple] = []
        for triple in self.structure:
            subject, predicate, value = triple
            links = self._items(value) if predicate == _CHAIN else []
            if links and not any(map(rdf.is_node, links)):
                rules.append(_joining_rule(links, subject))
            else:
                kept.append(triple)
        triples: list[Triple] = []
        for subject, predicate, value in self.triples:
            if value == _TRANSITIVE:
                rules.append(_joining_rule([subject, subject], subject))
                triples.append((subject, predicate, OWL + "ObjectProperty"))
            else:
                triples.append((subject, predicate, value))
        return replace(
            self,
            triples=tuple(triples),
            structure=tuple(kept),
            rules=(*self.rules, *rules),
        )

    def _items(self, node: str | Lit) -> list[str]:
        """The items of a list in the structure; one that leads back into itself ends there."""
        values: dict[tuple[str | Lit, str], str | Lit] = {(s, p): o for s, p, o in self.structure}
        found: list[str] = []
        while (node, FIRST) in values and len(found) < len(values):
            found.append(str(values[node, FIRST]))
            node = values.get((node, REST), "")
        return found

    def _related_properties(self) -> list[tuple[str, str]]:
        """Each property with those to which its values lead: super-properties and inverses."""
        alike = rdf.links(self.triples, *rdf.terms(OWL, "inverseOf equivalentProperty"))
        return [*rdf.links(self.triples, SUBPROPERTY), *rdf.both_ways(alike)]

    def decision_terms(self) -> Terms:
        """Terms on which decisions depend, and terms that rules assert, with super-properties and
        inverses.
        """
        heads = sorted(_concluded(self.enabled_rules))
        wanted = {*DECISION_PROPERTIES, *(name for name, kind in heads if kind != "Class")}
        return Terms(
            _named(rdf.reached(wanted, self._related_properties())),
            tuple(name for name, kind in heads if kind == "Class"),
        )

    def all_terms(self) -> Terms:
        """Every property and class, for some axiom can conclude any of them, and those that rules
        ask for.
        """
        decisions = self.decision_terms()
        asked = [atom for rule in self.enabled_rules for atom in rule.body if not atom.expression]
        properties = {
            *decisions.properties,
            *rdf.members(self.triples, _PROPERTIES),
            *(name for _, name, _ in filter(rdf.is_fact, self.triples)),
            *(atom.predicate for atom in asked if atom.kind in ("object", "data")),
        }
        classes = {
            *decisions.classes,
            *rdf.members(self.triples, (OWL + "Class", RDFS + "Class")),
            *(name for _, name in rdf.memberships(self.triples)),
            *(atom.predicate for atom in asked if atom.kind == "class"),
        }
        annotations = rdf.members(self.triples, [OWL + "AnnotationProperty"])
        # What has no name is an atom that SWRL does not know.
        return Terms(_named(properties - annotations - {""}), _named(classes - {""}))

    def n_triples(self, rules: Sequence[Rule] | None = None) -> str:
        """Write all of it for a reasoner, with the enabled rules or those given."""
        chosen = self.enabled_rules if rules is None else rules
        triples = [*self.triples, *self.structure, *_declarations(self.triples, chosen)]
        for rule in chosen:
            triples += _rule_triples(rule, self.rules.index(rule))
        return "".join(map(rdf.n_triple, triples))


def _joining_rule(links: Sequence[str], whole: str) -> Rule:
    """The rule that says what a chain of properties does, for named individuals."""
    places = [Variable(f"v{number}") for number in range(len(links) + 1)]
    body = tuple(
        Atom("object", name, pair)
        for name, pair in zip(links, itertools.pairwise(places), strict=True)
    )
    return Rule(f"chain to {whole}", body, (Atom("object", whole, (places[0], places[-1])),))


def _named(iris: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(filter(rdf.is_thing, iris)))


def merge(sources: Sequence[OntologyFile], values: Mapping[str, Decimal]) -> Content:
    """Merge the triples and rules of files, with the values of named QAvalue individuals
    replaced.
    """
    triples = dict[Triple, None]()
    structure: list[Triple] = []
    rules: dict[tuple[str, str], Rule] = {}  # of two that say the same in several files, the first
    for source in sorted(sources, key=lambda source: source.content):
        for rule in rules_of(source):
            rules.setdefault((rule.name, rule.text), rule)
        for subject, predicate, value in _meaningful(source):
            if rdf.is_node(subject) or rdf.is_node(value):
                structure.append((subject, predicate, value))
                continue
            if predicate == HAS_VALUE and local_name(subject) in values:
                value = Lit(format(values[local_name(subject)], "f"), DECIMAL)
            triples[subject, predicate, value] = None
            if predicate == RDF_TYPE and value in _OF_OBJECT_PROPERTIES:
                triples[subject, RDF_TYPE, OWL + "ObjectProperty"] = None
    return Content(tuple(sorted(triples, key=str)), tuple(structure), _in_order(rules.values()))


def _meaningful(source: OntologyFile) -> Iterator[Triple]:
    """The triples of a file without those of rules, annotations, and those about the ontology
    itself, such as imports and versions.
    """
    ontologies = rdf.members(source.triples, [OWL + "Ontology"])
    of_rules = {triple for rule in rules_of(source) for triple in rule.triples}
    for triple in source.triples:
        subject, predicate, value = triple
        is_left_out = predicate in _ANNOTATIONS or subject in ontologies or triple in of_rules
        # Protégé declares the built-ins, about which Pellet logs a warning.
        if not is_left_out and value != SWRL + "Builtin":
            yield triple


def _in_order(rules: Iterable[Rule]) -> tuple[Rule, ...]:
    return tuple(sorted(rules, key=lambda rule: (rule.name, rule.text, str(rule.file))))


def _declarations(triples: Iterable[Triple], rules: Sequence[Rule]) -> list[Triple]:
    """Declare properties and classes that occur only in the head of a rule.

    Pellet accepts an undeclared term, but stock owlready2 drops what is inferred of it; declared,
    both agree.
    """
    declared = rdf.members(triples, _DECLARED)
    return [
        (name, RDF_TYPE, OWL + kind)
        for name, kind in sorted(_concluded(rules))
        if name not in declared
    ]


def _concluded(rules: Iterable[Rule]) -> set[tuple[str, str]]:
    """(IRI, kind in OWL) of each property and class that rules assert."""
    kinds = {"object": "ObjectProperty", "data": "DatatypeProperty", "class": "Class"}
    heads = (atom for rule in rules for atom in rule.head if atom.predicate and not atom.expression)
    return {(atom.predicate, kinds[atom.kind]) for atom in heads if atom.kind in kinds}


def _rule_triples(rule: Rule, number: int) -> Iterator[Triple]:
    """A rule's triples, with an IRI for the rule and numbered blank nodes."""
    triples = [triple for triple in triples_of(rule) if triple[1] not in _ANNOTATIONS]
    own: dict[str | Lit, str] = {triples[0][0]: f"{RULE_IRI}{number}"}
    return rdf.numbered_nodes(triples, f"_:r{number}n", own)


# The model.

#: Comparison operators that a quality attribute type may have.
OPERATORS: Mapping[str, Callable[[Decimal, Decimal], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_SOLVES_F = TOMASYS + "solvesF"
_TYPE_F = TOMASYS + "typeF"
_TYPE_FD = TOMASYS + "typeFD"
#: What a state asserts of an objective, a grounding or a measurement, in place of what an ontology
# asserts of it.
_STATE_PROPERTIES = rdf.terms(
    TOMASYS,
    "typeF typeFD solvesO o_status o_always_improve hasQAvalue isQAtype hasValue fg_status "
    "o_updatable",
)


Iris = Mapping[str, str]
"""IRIs by name."""


@dataclass(frozen=True)
class Model:
    """The named things of an ontology that states are made of.

    Attributes:
        functions, designs, components, attributes: IRI by name.
        objectives: the objective that a function may get, by the function's name.
        groundings: the grounding that a function design may get, by the design's name.
        measurements: the measured value that a quality attribute type may get, by the type's name.
        own: what the ontologies assert of objectives (for example hasNFR), groundings, measurements
            and the status of components, by IRI: it holds in states that have them.
        estimated: by the design's name, the quality attribute types of which it has an expected
            value, sorted, each with the smallest one; None where that is no number.
    """

    functions: Iris
    designs: Iris
    components: Iris
    attributes: Iris
    objectives: Iris
    groundings: Iris
    measurements: Iris
    own: Mapping[str, tuple[Triple, ...]]
    estimated: Mapping[str, Mapping[str, Decimal | None]]

    @cached_property
    def in_states(self) -> frozenset[str]:
        """The IRIs of all objectives, groundings and measurements that states may have."""
        return frozenset(
            (*self.objectives.values(), *self.groundings.values(), *self.measurements.values())
        )

    def triples(self, state: KnowledgeState) -> Iterator[Triple]:
        """What a state asserts of its objectives, groundings, components and measurements."""
        yield from self._triples_of_loop(state)
        reported = dict(state.components)
        for name, iri in self.components.items():
            if name in reported:
                yield iri, C_STATUS, Lit(reported[name], STRING)
            else:
                yield from self.own[iri]
        for name, value in state.measurements:
            if name in self.attributes:
                iri = self.measurements[name]
                yield from ((iri, RDF_TYPE, TOMASYS + "QAvalue"), *self.own[iri])
                yield iri, IS_QA_TYPE, self.attributes[name]
                yield iri, HAS_VALUE, Lit(format(value, "f"), DECIMAL)

    def _triples_of_loop(self, state: KnowledgeState) -> Iterator[Triple]:
        """What a state asserts of its objectives and groundings."""
        for objective in state.objectives:
            iri = self.objectives[objective.function]
            yield from ((iri, RDF_TYPE, TOMASYS + "Objective"), *self.own[iri])
            yield iri, _TYPE_F, self.functions[objective.function]
            if objective.status is not None:
                yield iri, O_STATUS, Lit(objective.status, STRING)
            if objective.always_improve:
                yield iri, TOMASYS + "o_always_improve", Lit("true", BOOLEAN)
        required = {objective.function for objective in state.objectives}
        for function, design in state.groundings:
            iri = self.groundings[design]
            yield from ((iri, RDF_TYPE, TOMASYS + "FunctionGrounding"), *self.own[iri])
            yield iri, _TYPE_FD, self.designs[design]
            if function in required:
                yield iri, TOMASYS + "solvesO", self.objectives[function]
            for name, _ in state.measurements:
                if name in self.estimated[design]:
                    yield iri, HAS_QA_VALUE, self.measurements[name]


def build_model(content: Content, sources: Sequence[OntologyFile]) -> tuple[Model, Content]:
    """Find the model, and return the content without the triples that only states assert.

    Objectives, groundings and measurements that the ontologies describe already (an objective's
    hasNFR, a grounding's requiresO) are taken out, and come with the states that have them.

    Raises:
        KnowledgeError: two functions, designs, components or quality attribute types share a name.
    """
    triples = content.triples
    used = {
        "Function": rdf.values(triples, _SOLVES_F),
        "FunctionDesign": rdf.subjects(triples, _SOLVES_F),
        "Component": rdf.subjects(triples, MROS + "requiredBy") | rdf.subjects(triples, C_STATUS),
        "QualityAttributeType": rdf.values(triples, IS_QA_TYPE),
    }
    functions, designs, components, attributes = (
        _by_name(_members(triples, kind) | iris, kind, sources) for kind, iris in used.items()
    )
    objectives = _in_states(triples, functions, "Objective", objective_name, _TYPE_F)
    groundings = _in_states(triples, designs, "FunctionGrounding", grounding_name, _TYPE_FD)
    measurements = _in_states(triples, attributes, "QAvalue", measurement_name)
    in_states = [*objectives.values(), *groundings.values(), *measurements.values()]
    if len(set(in_states)) < len(in_states):
        raise KnowledgeError(
            "two functions, function designs or quality attribute types differ in their prefix only",
            file=sources[0].path,
            remedy="rename one, for example f_search and search",
        )
    own, kept = _separated(triples, in_states, components.values())
    model = Model(
        functions=functions,
        designs=designs,
        components=components,
        attributes=attributes,
        objectives=objectives,
        groundings=groundings,
        measurements=measurements,
        own=own,
        estimated=_estimated(triples, designs),
    )
    return model, replace(content, triples=kept)


_IN_WORDS = {
    "Function": "functions",
    "FunctionDesign": "function designs",
    "Component": "components",
    "QualityAttributeType": "quality attribute types",
}


def _by_name(iris: Iterable[str], kind: str, sources: Sequence[OntologyFile]) -> dict[str, str]:
    """Return IRIs by name; two of one kind must not share one, as states are written with names."""
    found: dict[str, str] = {}
    for iri in sorted(iris):
        other = found.setdefault(local_name(iri), iri)
        if other != iri:
            problem = f"two {_IN_WORDS[kind]} have this name: {other} and {iri}"
            raise _wrong_in(iri, sources, problem, "rename one of them")
    return dict(sorted(found.items()))


def _in_states(
    triples: Sequence[Triple],
    things: Iris,
    class_name: str,
    rename: Callable[[str], str],
    leading: str = "",
) -> dict[str, str]:
    """Return the individual that states have for each of some things, by the thing's name.

    It is the one that an ontology describes: by its property, else by its usual name, unless that
    is the name of something else. Otherwise it is a new one.

    Args:
        class_name: the individuals' class in TOMASys.
        rename: makes the usual name of one from that of what it is for.
        leading: the property that leads from one to what it is for; none where other individuals
            have that property, too.
    """
    described = {subject for subject, _, _ in triples}
    named = {local_name(iri): iri for iri in sorted(described, reverse=True)}
    # what has no class but those of OWL, such as owl:NamedIndividual, may be one
    others = {individual for individual, _ in rdf.memberships(triples)}
    others -= _members(triples, class_name)
    linked = list(rdf.links(triples, leading))
    found: dict[str, str] = {}
    for name, iri in things.items():
        usual = rename(name)
        leads = [one for one, value in linked if value == iri]
        if leads:
            found[name] = min(leads, key=lambda each: (local_name(each) != usual, each))
        elif usual in named and named[usual] not in others:
            found[name] = named[usual]
        else:
            new = rdf.namespace(iri) + usual
            while new in others:
                new += "_"
            found[name] = new
    return found


def _separated(
    triples: Iterable[Triple], in_states: Iterable[str], components: Iterable[str]
) -> tuple[dict[str, tuple[Triple, ...]], tuple[Triple, ...]]:
    """Separate what holds only in states: return it by individual or component, and the rest."""
    individuals = set(in_states)
    own: dict[str, list[Triple]] = {iri: [] for iri in (*in_states, *components)}
    kept: list[Triple] = []
    for triple in triples:
        subject, predicate, value = triple
        holder = next((str(term) for term in (subject, value) if term in individuals), None)
        if predicate == C_STATUS:
            own[subject].append(triple)
        elif holder is None:
            kept.append(triple)
        elif predicate not in _STATE_PROPERTIES and rdf.is_fact(triple):
            own[holder].append(triple)
    return {iri: tuple(found) for iri, found in own.items()}, tuple(kept)


def _estimated(triples: Sequence[Triple], designs: Iris) -> dict[str, dict[str, Decimal | None]]:
    """Return the smallest expected value of each quality attribute, by the design's name."""
    numbers = {
        subject: Decimal(value.text.strip())
        for subject, predicate, value in triples
        if predicate == HAS_VALUE and _is_decimal(value)
    }
    types = {subject: local_name(kind) for subject, kind in rdf.links(triples, IS_QA_TYPE)}
    found: dict[str, dict[str, Decimal | None]] = {name: {} for name in designs}
    for design, value in rdf.links(triples, TOMASYS + "hasQAestimation"):
        name = local_name(design)
        if value in types and designs.get(name) == design:
            given = (found[name].get(types[value]), numbers.get(value))
            known = (each for each in given if each is not None)
            found[name][types[value]] = min(known, default=None)
    return {name: dict(sorted(values.items())) for name, values in found.items()}


def _members(triples: Iterable[Triple], name: str) -> set[str]:
    """Individuals of a class of TOMASys or of its subclasses."""
    below = ((above, kind) for kind, above in rdf.links(triples, SUBCLASS))
    return rdf.members(triples, rdf.reached([TOMASYS + name], below))


def wrong_values(triples: Sequence[Triple]) -> Iterator[tuple[str, str, str]]:
    """Find numbers that are no decimals, unknown operators, and functional properties with several
    values.

    A reasoner would not explain the first two. Of two values that an ontology asserts for one
    functional data property Pellet silently keeps the one that it read last.

    Yields:
        the IRI of the individual, what is wrong, and what would be right.
    """
    functional = rdf.members(triples, [FUNCTIONAL])
    names = rdf.Names(triples)
    seen: dict[tuple[str, str], Value] = {}
    for subject, predicate, value in triples:
        shown, datatype = value if isinstance(value, Lit) else (value, "")
        if predicate == HAS_VALUE and not _is_decimal(value):
            but = "" if datatype in (*EXACT, "") else f" but an xsd:{local_name(datatype)}"
            yield subject, f"hasValue {shown!r} is not an xsd:decimal{but}", "a number such as 2.25"
        if predicate == QA_OPERATOR and shown not in OPERATORS:
            problem = f"qa_comparison_operator {shown!r} is unknown"
            yield subject, problem, f"one of {' '.join(OPERATORS)}"
        if predicate in functional and isinstance(value, Lit):
            yield from _second_value(subject, predicate, rdf.value_of(value, names), seen)


def _second_value(
    subject: str, predicate: str, value: Value, seen: dict[tuple[str, str], Value]
) -> Iterator[tuple[str, str, str]]:
    """Say so if a value of a functional property is another one than that which was seen before."""
    before = seen.setdefault((subject, predicate), value)
    if before != value:
        values = f"the values {before} and {value}"
        problem = f"contradiction: the functional property {local_name(predicate)} has {values}"
        yield subject, problem, "keep one of them"


def _is_decimal(value: str | Lit) -> TypeGuard[Lit]:
    return isinstance(value, Lit) and value.datatype in EXACT and rdf.is_well_formed(value)


def _wrong_in(
    subject: str, sources: Sequence[OntologyFile], problem: str, remedy: str
) -> KnowledgeError:
    """Return an error on an individual, with the file and line where it is described."""
    name = local_name(subject)
    file, line = place_of(name, sources)
    return KnowledgeError(
        f"{name}: {problem}", file=file, place=f"line {line}" if line else None, remedy=remedy
    )


@dataclass(frozen=True, eq=False)
class Ontology:
    """Ontology files and files of rules, merged and checked. It is immutable: only a KnowledgeState
    changes.

        ontology = Ontology.load(["suave.owl"], rules=["mine.swrl"])
        ontology.designs("f_maintain_motion")  # ('fd_all_thrusters', 'fd_recover_thrusters')
        ontology.expected("fd_all_thrusters")  # {'performance': Decimal('1.0')}

    Attributes:
        files: the ontology files in use, imports included, sorted by path, and the files of rules
            as text.
        content_hash: SHA-256 of all their content, of the overridden values and of the names of
            disabled rules, whatever the order of ontologies.
        content: all triples and rules for a reasoner.
        names: short names of IRIs, for facts.
        model: the functions, designs, components and quality attributes.
        vocabulary: the names that rules may use.
        sources: the ontology files with their graphs.
        stated: all triples of the files, those that only states assert among them.
        assumed: the comparison operators that were added to the ontologies, by quality attribute
            type.
        supplies: which file supplies each import.
    """

    files: tuple[Path, ...]
    content_hash: str
    content: Content = field(repr=False)
    names: rdf.Names = field(repr=False)
    model: Model = field(repr=False)
    vocabulary: Vocabulary = field(repr=False)
    sources: tuple[OntologyFile, ...] = field(repr=False)
    stated: tuple[Triple, ...] = field(repr=False)
    assumed: Mapping[str, str]
    supplies: tuple[Supply, ...]

    @classmethod
    def load(
        cls,
        ontologies: Sequence[Path | str] = (),
        *,
        values: Mapping[str, Decimal] | None = None,
        rules: Sequence[Path | str] = (),
        disabled_rules: Collection[str] = (),
        operators: Mapping[str, str] | None = None,
    ) -> Ontology:
        """Read ontologies, in any order, and their imports; without any, the shipped suave.owl.

        Args:
            ontologies: files in RDF/XML.
            values: replaces the hasValue of a named QAvalue individual, such as
                qa_water_visibility_low.
            rules: files of rules as text; each rule replaces earlier rules of the same name.
            disabled_rules: names of rules to disable.
            operators: qa_comparison_operator of quality attribute types that have none, by name.

        Raises:
            KnowledgeError: a file or an import cannot be used, a value names no QAvalue, or there
                is no such rule to disable.
            RuleError: a rule as text cannot be read or used.
        """
        sources = collect([Path(path) for path in ontologies])
        files = [RulesFile.read(Path(path)) for path in rules]
        base = cls.merged(sources, values or {}, operators or {})
        groups = [file.rules(base.vocabulary) for file in files]
        base = base.with_files(files, groups, disabled_rules)
        base.check_names(values or {}, disabled_rules)
        for subject, problem, remedy in wrong_values(base.stated):
            raise _wrong_in(subject, sources.files, problem, remedy)
        check_property_use(base.content.enabled_rules, base.vocabulary)
        return base

    @classmethod
    def merged(
        cls,
        sources: Sources,
        values: Mapping[str, Decimal],
        operators: Mapping[str, str],
    ) -> Ontology:
        """Merge ontologies that have been read with their imports, as `load` does; nothing else is
        checked.

        Raises:
            KnowledgeError: two functions, designs, components or quality attribute types share a
                name.
        """
        contents = sorted(hashlib.sha256(source.content).hexdigest() for source in sources.files)
        merged = merge(sources.files, values)
        model, content = build_model(merged, sources.files)
        present = rdf.subjects(content.triples, QA_OPERATOR)
        without = {name: iri for name, iri in model.attributes.items() if iri not in present}
        assumed = {name: sign for name, sign in sorted(operators.items()) if name in without}
        more = [(without[name], QA_OPERATOR, Lit(sign, STRING)) for name, sign in assumed.items()]
        content = replace(content, triples=tuple(sorted((*content.triples, *more), key=str)))
        numbers = {name: format(value.normalize(), "f") for name, value in values.items()}
        texts = enumerated_texts(sources.files)
        known = Vocabulary.of(merged.triples, merged.structure, model.in_states, texts)
        return cls(
            files=tuple(sorted(source.path for source in sources.files)),
            content_hash=_digest(contents, numbers, assumed),
            content=content,
            names=rdf.Names(merged.triples),
            model=model,
            vocabulary=known.with_rules(content.enabled_rules),
            sources=sources.files,
            stated=merged.triples,
            assumed=assumed,
            supplies=sources.supplies,
        )

    def with_files(
        self,
        files: Sequence[RulesFile],
        rules: Sequence[Sequence[Rule]],
        disabled_rules: Collection[str],
    ) -> Ontology:
        """Add files of rules as text, and disable rules.

        A file's rules replace all rules of the same names that were read before, of ontologies or
        of files: so a rule can be tried in another wording, or disabled by its mark.

        Args:
            files: in the order in which they are given.
            rules: those rules of each file that can be used.
        """
        found = [*self.rules]
        replaced = list[tuple[Rule, Rule]]()
        for group in rules:
            new = {rule.name: rule for rule in group}
            replaced += [(rule, new[rule.name]) for rule in found if rule.name in new]
            found = [*(rule for rule in found if rule.name not in new), *group]
        found = [_as_enabled(rule, disabled_rules) for rule in found]
        texts = [file.text for file in files]
        return replace(
            self,
            files=(*self.files, *(file.path for file in files)),
            content_hash=_digest(self.content_hash, texts, sorted(set(disabled_rules))),
            content=replace(self.content, rules=_in_order(found), replaced=tuple(replaced)),
            vocabulary=self.vocabulary.with_rules(found),
        )

    def check_names(self, values: Iterable[str], disabled_rules: Iterable[str]) -> None:
        """Check the names that a scenario gives: of values to replace, and of rules to disable.

        Raises:
            KnowledgeError: a value names no individual with a hasValue, or there is no such rule.
        """
        valued = set(map(local_name, rdf.subjects(self.stated, HAS_VALUE)))
        named = {rule.name for rule in self.rules}
        for key, names, known, problem in (
            ("values", values, valued, "the ontology has no individual {} with a hasValue"),
            ("disabled_rules", disabled_rules, named, "there is no rule {} to switch off"),
        ):
            for name in sorted(set(names).difference(known)):
                remedy = nearest(name, known) or f"known: {', '.join(sorted(known)) or 'none'}"
                raise KnowledgeError(problem.format(name), place=f"{key}.{name}", remedy=remedy)

    def with_rules(self, rules: Iterable[Rule]) -> Ontology:
        """Return the same ontology with different rules, enabled or not."""
        return replace(self, content=replace(self.content, rules=tuple(rules)))

    def with_facts(self, facts: Iterable[Triple]) -> Ontology:
        """Return the same ontology with further facts about individuals."""
        return replace(self, content=replace(self.content, triples=(*self.content.triples, *facts)))

    @property
    def assumptions(self) -> dict[str, str]:
        """What was added to the ontologies, in words, by quality attribute type."""
        found = "{} has no qa_comparison_operator in the ontologies: {} is assumed, as in the revision's code"
        return {name: found.format(name, sign) for name, sign in self.assumed.items()}

    @property
    def rules(self) -> tuple[Rule, ...]:
        """The SWRL rules, disabled ones included."""
        return self.content.rules

    @cached_property
    def facts(self) -> frozenset[Fact]:
        """The facts that the ontologies assert about individuals."""
        return frozenset(rdf.facts_of(self.content.triples, self.names))

    @property
    def functions(self) -> tuple[str, ...]:
        """Names of the functions."""
        return tuple(self.model.functions)

    def designs(self, function: str) -> tuple[str, ...]:
        """Function designs that solve a function, sorted by name; none for an unknown function."""
        return self._designs.get(function, ())

    @cached_property
    def objectives(self) -> Mapping[str, str]:
        """Name of the objective that states have for a function, by the function's name."""
        return {name: self.names.short(iri) for name, iri in self.model.objectives.items()}

    @cached_property
    def groundings(self) -> Mapping[str, str]:
        """Name of the grounding that states have of a design, by the design's name."""
        return {name: self.names.short(iri) for name, iri in self.model.groundings.items()}

    @cached_property
    def _designs(self) -> Mapping[str, tuple[str, ...]]:
        found: dict[str, tuple[str, ...]] = {}
        solving = ((str(f.value), f.subject) for f in self.facts if f.property == "solvesF")
        for function, design in sorted(solving):
            if function in self.model.functions and design in self.model.designs:
                found[function] = (*found.get(function, ()), design)
        return found

    def expected(self, design: str) -> Mapping[str, Decimal]:
        """Expected value of each quality attribute of a function design, its performance among
        them; of several, the smallest."""
        known = self.model.estimated.get(design, {})
        return {name: value for name, value in known.items() if value is not None}

    def assertions(self, state: KnowledgeState) -> tuple[Triple, ...]:
        """Return the triples that assert a state, for every reasoner in the same order.

        A component or a quality attribute that the ontology does not have can match no rule, and is
        left out: monitors may report more than an ontology describes.

        Raises:
            KnowledgeError: a function or a function design is not in the ontology.
        """
        functions = {each.function for each in state.objectives}
        functions.update(name for name, _ in state.groundings)
        designs = {design for _, design in state.groundings}
        model = self.model
        for what, names, known in (
            ("function", functions, model.functions),
            ("function design", designs, model.designs),
        ):
            for name in sorted(names - known.keys()):
                remedy = f"known: {', '.join(sorted(known)) or 'none'}"
                raise KnowledgeError(f"the knowledge base has no {what} {name}", remedy=remedy)
        triples = tuple(model.triples(state))
        absent = model.in_states.difference(subject for subject, _, _ in triples)
        return tuple(triple for triple in triples if triple[2] not in absent)

    def asserted(self, state: KnowledgeState, facts: Sequence[Triple] = ()) -> frozenset[Fact]:
        """The facts of the ontologies and of a state, and further ones."""
        return self.facts.union(rdf.facts_of((*self.assertions(state), *facts), self.names))

    def unsolved(self, functions: Iterable[str]) -> Iterator[tuple[str, str, str]]:
        """Yield those functions that are not there or have no design: name, what is wrong, what
        would be right.
        """
        for name in sorted(functions):
            if name not in self.model.functions:
                remedy = f"functions in the ontology: {', '.join(self.functions) or 'none'}"
                if other := self._other_namespace:
                    remedy += f"; it uses terms of {other}, but those of TOMASys are in {TOMASYS}"
                yield name, f"there is no function {name}, which the mission needs", remedy
            elif not self.designs(name):
                remedy = f"add an individual of FunctionDesign with solvesF {name}"
                yield name, f"function {name} has no function design", remedy

    @property
    def _other_namespace(self) -> str | None:
        """The namespace in which solvesF is used, if that is not TOMASys' own."""
        for _, predicate, _ in self.stated:
            if local_name(predicate) == "solvesF" and predicate != _SOLVES_F:
                return rdf.namespace(predicate)
        return None

    def check(self, functions: Collection[str]) -> None:
        """Check that the mission's functions have function designs.

        Raises:
            KnowledgeError: there is no such function, or no function design for it.
        """
        for _, problem, remedy in self.unsolved(functions):
            raise KnowledgeError(problem, file=", ".join(map(str, self.files)), remedy=remedy)


def _as_enabled(rule: Rule, disabled_rules: Collection[str]) -> Rule:
    return replace(rule, enabled=False) if rule.name in disabled_rules else rule


def _digest(*parts: object) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
