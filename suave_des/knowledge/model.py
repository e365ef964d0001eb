"""The functions, designs, components and quality attributes of an ontology, and the triples of a state in its terms."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Final

from suave_des.errors import KnowledgeError
from suave_des.knowledge.content import Content
from suave_des.knowledge.ontology_file import OntologyFile, place_of
from suave_des.knowledge.rdf import (
    C_STATUS,
    EXACT,
    HAS_QA_VALUE,
    HAS_VALUE,
    IS_QA_TYPE,
    MROS,
    O_STATUS,
    OWL,
    QA_OPERATOR,
    RDF_TYPE,
    RDFS,
    TOMASYS,
    XSD,
    Lit,
    Names,
    Triple,
    is_fact,
    local_name,
    namespace,
    number_in,
    reached,
    value_of,
)
from suave_des.knowledge.state import KnowledgeState, Value, grounding_name, measurement_name, objective_name

#: Comparison operators that a quality attribute type may have.
OPERATORS: Final[Mapping[str, Callable[[Decimal, Decimal], bool]]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_HAS_QA_ESTIMATION: Final = TOMASYS + "hasQAestimation"
_ALWAYS: Final = TOMASYS + "o_always_improve"
_SOLVES_F: Final = TOMASYS + "solvesF"
_SOLVES_O: Final = TOMASYS + "solvesO"
_TYPE_F: Final = TOMASYS + "typeF"
_TYPE_FD: Final = TOMASYS + "typeFD"
#: What a state asserts of an objective, a grounding or a measurement, in place of what an ontology asserts of it.
_STATE_PROPERTIES: Final = frozenset(
    {_TYPE_F, _TYPE_FD, _SOLVES_O, O_STATUS, _ALWAYS, HAS_QA_VALUE, IS_QA_TYPE, HAS_VALUE}
    | {TOMASYS + "fg_status", TOMASYS + "o_updatable"}
)


@dataclass(frozen=True)
class Individual:
    """An individual that exists only in some states, with what the ontologies assert of it (for example hasNFR)."""

    iri: str
    own: tuple[Triple, ...] = ()


@dataclass(frozen=True)
class Model:
    """The named things of an ontology that states are made of.

    Attributes:
        functions, designs, components, attributes: IRI by name.
        objectives: the objective that a function may get, by the function's name.
        groundings: the grounding that a function design may get, by the design's name.
        measurements: the measured value that a quality attribute type may get, by the type's name.
        estimated: the quality attribute types of which a design has an expected value, by the design's name.
        initial: what the ontologies assert of a component's status, by the component's name.
    """

    functions: Mapping[str, str]
    designs: Mapping[str, str]
    components: Mapping[str, str]
    attributes: Mapping[str, str]
    objectives: Mapping[str, Individual]
    groundings: Mapping[str, Individual]
    measurements: Mapping[str, Individual]
    estimated: Mapping[str, frozenset[str]]
    initial: Mapping[str, tuple[Triple, ...]]

    def individuals(self) -> Iterator[Individual]:
        """All objectives, groundings and measurements that states may have."""
        for group in (self.objectives, self.groundings, self.measurements):
            yield from group.values()

    def triples(self) -> Iterator[Triple]:
        """Assertions of the ontologies that only apply in states: about these individuals, and components' statuses."""
        for individual in self.individuals():
            yield from individual.own
        for initial in self.initial.values():
            yield from initial

    def assertions(self, state: KnowledgeState) -> tuple[Triple, ...]:
        """Return the triples that assert a state, for every reasoner in the same order.

        A component or a quality attribute that the ontology does not have can match no rule, and is left out:
        monitors may report more than an ontology describes.

        Raises:
            KnowledgeError: a function or a function design is not in the ontology.
        """
        for objective in state.objectives:
            _known(objective.function, self.functions, "function")
        for function, design in state.groundings:
            _known(function, self.functions, "function")
            _known(design, self.designs, "function design")
        present = {self.objectives[objective.function].iri for objective in state.objectives}
        present |= {self.groundings[design].iri for _, design in state.groundings}
        present |= {self.measurements[name].iri for name, _ in state.measurements if name in self.attributes}
        absent = {individual.iri for individual in self.individuals()} - present
        return tuple(triple for triple in self._triples(state) if triple[2] not in absent)

    def _triples(self, state: KnowledgeState) -> Iterator[Triple]:
        for objective in state.objectives:
            individual = self.objectives[objective.function]
            yield individual.iri, RDF_TYPE, TOMASYS + "Objective"
            yield from individual.own
            yield individual.iri, _TYPE_F, self.functions[objective.function]
            if objective.status is not None:
                yield individual.iri, O_STATUS, Lit(objective.status, XSD + "string")
            if objective.always_improve:
                yield individual.iri, _ALWAYS, Lit("true", XSD + "boolean")
        yield from self._groundings(state)
        reported = dict(state.components)
        for name, iri in self.components.items():
            if name in reported:
                yield iri, C_STATUS, Lit(reported[name], XSD + "string")
            else:
                yield from self.initial.get(name, ())
        for name, value in state.measurements:
            if name in self.attributes:
                individual = self.measurements[name]
                yield individual.iri, RDF_TYPE, TOMASYS + "QAvalue"
                yield from individual.own
                yield individual.iri, IS_QA_TYPE, self.attributes[name]
                yield individual.iri, HAS_VALUE, Lit(format(value, "f"), XSD + "decimal")

    def _groundings(self, state: KnowledgeState) -> Iterator[Triple]:
        required = {objective.function for objective in state.objectives}
        for function, design in state.groundings:
            individual = self.groundings[design]
            yield individual.iri, RDF_TYPE, TOMASYS + "FunctionGrounding"
            yield from individual.own
            yield individual.iri, _TYPE_FD, self.designs[design]
            if function in required:
                yield individual.iri, _SOLVES_O, self.objectives[function].iri
            for name, _ in state.measurements:
                if name in self.estimated[design]:
                    yield individual.iri, HAS_QA_VALUE, self.measurements[name].iri


def _known(name: str, names: Mapping[str, str], what: str) -> None:
    if name not in names:
        raise KnowledgeError(
            f"the knowledge base has no {what} {name}", remedy=f"known: {', '.join(sorted(names)) or 'none'}"
        )


def build_model(content: Content, sources: Sequence[OntologyFile]) -> tuple[Model, Content]:
    """Find the model, and return the content without the triples that only states assert.

    Objectives, groundings and measurements that the ontologies describe already (an objective's hasNFR, a
    grounding's requiresO) are taken out, and come with the states that have them.

    Raises:
        KnowledgeError: two functions, designs, components or quality attribute types share a name.
    """
    triples = content.triples

    def subjects(predicate: str) -> set[str]:
        return {s for s, p, _ in triples if p == predicate}

    def objects(predicate: str) -> set[str]:
        return {o for _, p, o in triples if p == predicate and isinstance(o, str)}

    def by_name(iris: Iterable[str], what: str) -> dict[str, str]:
        """IRI by name; two of one kind must not share a name, since states are written with names."""
        found: dict[str, str] = {}
        for iri in sorted(iris):
            other = found.setdefault(local_name(iri), iri)
            if other != iri:
                raise wrong_in(iri, sources, f"two {what} have this name: {other} and {iri}", "rename one of them")
        return dict(sorted(found.items()))

    functions = by_name(_members(triples, "Function") | objects(_SOLVES_F), "functions")
    designs = by_name(_members(triples, "FunctionDesign") | subjects(_SOLVES_F), "function designs")
    parts = _members(triples, "Component") | subjects(MROS + "requiredBy") | subjects(C_STATUS)
    components = by_name(parts, "components")
    attributes = by_name(_members(triples, "QualityAttributeType") | objects(IS_QA_TYPE), "quality attribute types")
    existing = {local_name(iri): iri for iri in sorted({triple[0] for triple in triples}, reverse=True)}
    groups = [
        {name: existing.get(rename(name), namespace(iri) + rename(name)) for name, iri in things.items()}
        for things, rename in (
            (functions, objective_name),
            (designs, grounding_name),
            (attributes, measurement_name),
        )
    ]
    in_states = {iri for group in groups for iri in group.values()}
    if len(in_states) < sum(map(len, groups)):
        raise KnowledgeError(
            "two functions, function designs or quality attribute types differ in their prefix only",
            file=sources[0].path,
            remedy="rename one, for example f_search and search",
        )
    own: dict[str, list[Triple]] = {iri: [] for iri in in_states}
    for triple in triples:
        subject, predicate, value = triple
        holder = subject if subject in in_states else value
        if isinstance(holder, str) and holder in own and predicate not in _STATE_PROPERTIES and is_fact(triple):
            own[holder].append(triple)
    objectives, groundings, measurements = (
        {name: Individual(iri, tuple(own[iri])) for name, iri in group.items()} for group in groups
    )
    estimated: dict[str, set[str]] = {name: set() for name in designs}
    for design, attribute, _ in estimations(triples, designs, attributes):
        estimated[design].add(attribute)
    model = Model(
        functions=functions,
        designs=designs,
        components=components,
        attributes=attributes,
        objectives=objectives,
        groundings=groundings,
        measurements=measurements,
        estimated={name: frozenset(found) for name, found in estimated.items()},
        initial={
            name: tuple(triple for triple in triples if triple[:2] == (iri, C_STATUS))
            for name, iri in components.items()
        },
    )
    kept = tuple(t for t in triples if t[0] not in in_states and t[2] not in in_states and t[1] != C_STATUS)
    return model, replace(content, triples=kept)


def assumption(name: str, sign: str) -> str:
    """Describe which comparison operator is assumed for a quality attribute type."""
    return f"{name} has no qa_comparison_operator in the ontologies: {sign} is assumed, as in the revision's code"


def with_operators(content: Content, model: Model, operators: Mapping[str, str]) -> tuple[Content, dict[str, str]]:
    """Add the comparison operators of quality attribute types that have none; return those that were added, by name."""
    present = {subject for subject, predicate, _ in content.triples if predicate == QA_OPERATOR}
    added = {
        name: sign
        for name, sign in sorted(operators.items())
        if name in model.attributes and model.attributes[name] not in present
    }
    if not added:
        return content, {}
    more = [(model.attributes[name], QA_OPERATOR, Lit(sign, XSD + "string")) for name, sign in added.items()]
    return replace(content, triples=tuple(sorted((*content.triples, *more), key=str))), added


def _members(triples: Iterable[Triple], name: str) -> set[str]:
    """Individuals of a class of TOMASys or of its subclasses."""
    below = ((str(o), s) for s, p, o in triples if p == RDFS + "subClassOf")
    classes = reached([TOMASYS + name], below)
    return {s for s, p, o in triples if p == RDF_TYPE and o in classes}


def estimations(
    triples: Iterable[Triple], designs: Mapping[str, str], attributes: Mapping[str, str]
) -> Iterator[tuple[str, str, str]]:
    """(design, quality attribute type, IRI of the QAvalue individual) of each hasQAestimation."""
    design_names = {iri: name for name, iri in designs.items()}
    attribute_names = {iri: name for name, iri in attributes.items()}
    types = {s: attribute_names[o] for s, p, o in triples if p == IS_QA_TYPE and isinstance(o, str)}
    for subject, predicate, value in triples:
        if predicate == _HAS_QA_ESTIMATION and subject in design_names and value in types:
            yield design_names[subject], types[str(value)], str(value)


def expectations(content: Content, model: Model) -> dict[str, dict[str, Decimal]]:
    """Expected value by design and quality attribute type; the smallest where a design has several."""
    numbers = {
        subject: Decimal(value.text.strip())
        for subject, predicate, value in content.triples
        if predicate == HAS_VALUE and isinstance(value, Lit)
    }
    found: dict[str, dict[str, Decimal]] = {name: {} for name in model.designs}
    for design, attribute, individual in estimations(content.triples, model.designs, model.attributes):
        if individual in numbers:
            value = numbers[individual]
            found[design][attribute] = min(value, found[design].get(attribute, value))
    return {name: dict(sorted(expected.items())) for name, expected in found.items()}


def wrong_values(triples: Iterable[Triple]) -> Iterator[tuple[str, str, str]]:
    """Find numbers that are no decimals, unknown operators, and functional properties with several values.

    A reasoner would not explain the first two. Of two values that an ontology asserts for one functional data
    property Pellet silently keeps the one that it read last.

    Yields:
        the IRI of the individual, what is wrong, and what would be right.
    """
    triples = tuple(triples)
    functional = {s for s, p, o in triples if p == RDF_TYPE and o == OWL + "FunctionalProperty"}
    names = Names(triples)
    seen: dict[tuple[str, str], Value] = {}
    for subject, predicate, value in triples:
        shown, datatype = value if isinstance(value, Lit) else (value, "")
        if predicate == HAS_VALUE and (number_in(value) is None or datatype not in EXACT):
            but = f" but an xsd:{local_name(datatype)}" if datatype not in (*EXACT, "") else ""
            yield subject, f"hasValue {shown!r} is not an xsd:decimal{but}", "a number such as 2.25"
        if predicate == QA_OPERATOR and shown not in OPERATORS:
            yield subject, f"qa_comparison_operator {shown!r} is unknown", f"one of {' '.join(OPERATORS)}"
        if predicate in functional and isinstance(value, Lit):
            one = value_of(value, names)
            other = seen.setdefault((subject, predicate), one)
            if one != other:
                values = f"the values {other} and {one}"
                problem = f"contradiction: the functional property {local_name(predicate)} has {values}"
                yield subject, problem, "keep one of them"


def wrong_in(subject: str, sources: Sequence[OntologyFile], problem: str, remedy: str) -> KnowledgeError:
    """Return an error on an individual, with the file and line where it is described."""
    name = local_name(subject)
    file, line = place_of(name, sources)
    return KnowledgeError(f"{name}: {problem}", file=file, place=f"line {line}" if line else None, remedy=remedy)
