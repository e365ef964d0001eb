"""Find the functions, designs, components and quality attributes in the triples of the ontologies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from decimal import Decimal, InvalidOperation
from typing import Final

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.situation import STATE_PROPERTIES, Individual, Lit, Model, Triple
from suave_des.knowledge.state import Fact, Value
from suave_des.knowledge.triples import Content
from suave_des.knowledge.vocabulary import (
    DECISION_PROPERTIES,
    LANGUAGE_NAMESPACES,
    MROS,
    OWL,
    RDF_TYPE,
    RDFS,
    SWRL,
    TOMASYS,
    XSD,
    grounding_name,
    local_name,
    measurement_name,
    namespace,
    objective_name,
)

_SUBCLASS: Final = RDFS + "subClassOf"
_HAS_VALUE: Final = TOMASYS + "hasValue"
_C_STATUS: Final = TOMASYS + "c_status"
_WHOLE: Final = (
    *("integer", "int", "long", "short", "byte"),
    *("nonNegativeInteger", "positiveInteger", "nonPositiveInteger", "negativeInteger"),
    *("unsignedInt", "unsignedLong", "unsignedShort", "unsignedByte"),
)
#: Datatypes of exact numbers.
EXACT: Final = frozenset(XSD + name for name in ("decimal", *_WHOLE))
_NUMERIC: Final = EXACT | {XSD + "float", XSD + "double"}


def value_of(value: str | Lit, names: Names) -> Value:
    """The value of a fact: a short name, a number, a truth value or text."""
    if isinstance(value, str):
        return names.short(value)
    if value.datatype == XSD + "boolean":
        return value.text.strip() in ("true", "1")
    if value.datatype in _NUMERIC:
        try:
            return Decimal(value.text.strip())
        except InvalidOperation:
            return value.text
    return value.text


class Names:
    """Short names of IRIs: the last part, or the whole IRI where two would share it."""

    def __init__(self, content: Content) -> None:
        things = {
            term
            for triple in content.triples
            for term in (triple[0], triple[2])
            if isinstance(term, str) and not term.startswith(LANGUAGE_NAMESPACES) and triple[2] != SWRL + "Variable"
        }
        shared = Counter(map(local_name, things))
        self._long = {iri for iri in things if shared[local_name(iri)] > 1 and not iri.startswith((TOMASYS, MROS))}

    def short(self, iri: str) -> str:
        """The name of an IRI in facts."""
        return iri if iri in self._long else local_name(iri)


def _is_fact(triple: Triple) -> bool:
    """Whether a triple says something of an individual, and not in terms of the languages themselves."""
    term = triple[2] if triple[1] == RDF_TYPE else triple[1]
    return isinstance(term, str) and not term.startswith(LANGUAGE_NAMESPACES)


def facts_of(triples: Iterable[Triple], names: Names) -> Iterator[Fact]:
    """What triples assert of individuals: property values, not the terms of the languages themselves."""
    for triple in triples:
        if _is_fact(triple):
            subject, predicate, value = triple
            name = "type" if predicate == RDF_TYPE else names.short(predicate)
            yield Fact(names.short(subject), name, value_of(value, names))


def wrong_in(subject: str, sources: Sequence[OntologyFile], problem: str, remedy: str) -> KnowledgeError:
    """An error on an individual, with the file and line where it is described."""
    name = local_name(subject)
    for source in sources:
        place = source.line_of(name)
        if place is not None:
            return KnowledgeError(f"{name}: {problem}", file=source.path, place=place, remedy=remedy)
    return KnowledgeError(f"{name}: {problem}", file=sources[0].path, remedy=remedy)


class _Individuals:
    """Lookups over the triples: individuals by class, by property, by name."""

    def __init__(self, content: Content, sources: Sequence[OntologyFile]) -> None:
        self.sources = sources
        self.triples = content.triples
        self.children: dict[str, set[str]] = {}
        self.subjects = {triple[0] for triple in self.triples}
        for subject, predicate, value in self.triples:
            if predicate == _SUBCLASS and isinstance(value, str):
                self.children.setdefault(value, set()).add(subject)

    def by_name(self, iris: Iterable[str], what: str) -> dict[str, str]:
        """IRI by name, sorted; two of one kind must not share a name, since states are written with names."""
        found: dict[str, str] = {}
        for iri in sorted(set(iris)):
            other = found.setdefault(local_name(iri), iri)
            if other != iri:
                raise wrong_in(iri, self.sources, f"two {what} have this name: {other} and {iri}", "rename one of them")
        return dict(sorted(found.items()))

    def of_class(self, name: str) -> set[str]:
        wanted, waiting = {TOMASYS + name}, [TOMASYS + name]
        while waiting:
            for child in self.children.get(waiting.pop(), set()) - wanted:
                wanted.add(child)
                waiting.append(child)
        return {subject for subject, predicate, value in self.triples if predicate == RDF_TYPE and value in wanted}

    def with_property(self, iri: str) -> set[str]:
        return {subject for subject, predicate, _ in self.triples if predicate == iri}

    def values_of(self, iri: str) -> set[str]:
        return {value for _, predicate, value in self.triples if predicate == iri and isinstance(value, str)}


def build_model(content: Content, names: Names, sources: Sequence[OntologyFile]) -> tuple[Model, Content]:
    """The model, and the content without what belongs to states only.

    Objectives, groundings and measurements that the ontologies describe already (an objective's hasNFR, a
    grounding's requiresO) are taken out, and come with the states that have them.

    Raises:
        KnowledgeError: two functions, designs, components or quality attribute types share a name.
    """
    find = _Individuals(content, sources)
    functions = find.by_name(find.of_class("Function") | find.values_of(TOMASYS + "solvesF"), "functions")
    designs = find.by_name(
        find.of_class("FunctionDesign") | find.with_property(TOMASYS + "solvesF"), "function designs"
    )
    components = find.by_name(
        find.of_class("Component") | find.with_property(MROS + "requiredBy") | find.with_property(_C_STATUS),
        "components",
    )
    attributes = find.by_name(
        find.of_class("QualityAttributeType") | find.values_of(TOMASYS + "isQAtype"), "quality attribute types"
    )
    existing = {local_name(iri): iri for iri in sorted(find.subjects, reverse=True)}

    def iri_in_states(iri: str, name: str) -> str:
        return existing.get(name, namespace(iri) + name)

    objectives = {name: iri_in_states(iri, objective_name(name)) for name, iri in functions.items()}
    groundings = {name: iri_in_states(iri, grounding_name(name)) for name, iri in designs.items()}
    measurements = {name: iri_in_states(iri, measurement_name(name)) for name, iri in attributes.items()}
    in_states = {*objectives.values(), *groundings.values(), *measurements.values()}
    if len(in_states) < len(objectives) + len(groundings) + len(measurements):
        raise KnowledgeError(
            "two functions, function designs or quality attribute types differ in their prefix only",
            file=sources[0].path,
            remedy="rename one, for example f_search and search",
        )
    model = Model(
        functions=functions,
        designs=designs,
        components=components,
        attributes=attributes,
        objectives=_with_own(objectives, content, in_states),
        groundings=_with_own(groundings, content, in_states),
        measurements=_with_own(measurements, content, in_states),
        estimated=_estimated(content, designs, attributes),
        initial={
            name: tuple(t for t in content.triples if t[0] == iri and t[1] == _C_STATUS)
            for name, iri in components.items()
        },
    )
    kept = tuple(
        triple
        for triple in content.triples
        if triple[0] not in in_states and triple[2] not in in_states and triple[1] != _C_STATUS
    )
    return model, replace(content, triples=kept)


def _with_own(iris: dict[str, str], content: Content, in_states: set[str]) -> dict[str, Individual]:
    """Individuals of states with what the ontologies say of them, or of other things with reference to them."""
    own: dict[str, list[Triple]] = {}
    for triple in content.triples:
        subject, predicate, value = triple
        holder = subject if subject in in_states else value
        if holder in in_states and isinstance(holder, str) and predicate not in STATE_PROPERTIES and _is_fact(triple):
            own.setdefault(holder, []).append(triple)
    return {name: Individual(iri, tuple(own.get(iri, ()))) for name, iri in iris.items()}


def _estimated(content: Content, designs: dict[str, str], attributes: dict[str, str]) -> dict[str, frozenset[str]]:
    estimations = _pairs(content, TOMASYS + "hasQAestimation")
    types = dict(_pairs(content, TOMASYS + "isQAtype"))
    attribute_names = {iri: name for name, iri in attributes.items()}
    found: dict[str, set[str]] = {name: set() for name in designs}
    names = {iri: name for name, iri in designs.items()}
    for design, value in estimations:
        if design in names and value in types:
            found[names[design]].add(attribute_names[types[value]])
    return {name: frozenset(kinds) for name, kinds in found.items()}


def _pairs(content: Content, predicate: str) -> list[tuple[str, str]]:
    return [(s, o) for s, p, o in content.triples if p == predicate and isinstance(o, str)]


def expectations(content: Content, model: Model) -> dict[str, dict[str, Decimal]]:
    """Expected value by design and quality attribute type; the smallest where a design has several."""
    types = dict(_pairs(content, TOMASYS + "isQAtype"))
    numbers = {
        subject: Decimal(value.text.strip())
        for subject, predicate, value in content.triples
        if predicate == _HAS_VALUE and isinstance(value, Lit)
    }
    attribute_names = {iri: name for name, iri in model.attributes.items()}
    design_names = {iri: name for name, iri in model.designs.items()}
    found: dict[str, dict[str, Decimal]] = {name: {} for name in model.designs}
    for design, value in _pairs(content, TOMASYS + "hasQAestimation"):
        if design in design_names and value in types and value in numbers:
            expected = found[design_names[design]]
            kind = attribute_names[types[value]]
            expected[kind] = min(numbers[value], expected.get(kind, numbers[value]))
    return {name: dict(sorted(expected.items())) for name, expected in found.items()}


def properties_to_read(content: Content) -> tuple[str, ...]:
    """Properties whose values are read after inference.

    Those that a rule can assert, with their super-properties and inverses, and all that decisions rest on.
    """
    wanted = set(content.head_properties()) | set(DECISION_PROPERTIES)
    edges = (RDFS + "subPropertyOf", OWL + "inverseOf", OWL + "equivalentProperty")
    while True:
        more = set()
        for subject, predicate, value in content.triples:
            if predicate in edges and isinstance(value, str):
                if subject in wanted:
                    more.add(value)
                if value in wanted and predicate != edges[0]:
                    more.add(subject)
        if more <= wanted:
            return tuple(sorted(name for name in wanted if not name.startswith(LANGUAGE_NAMESPACES)))
        wanted |= more
