"""What in ontologies and rules a decision can depend on.

Quality attributes are independent of one another where every comparison in a rule is between values
of one of them: then a measured value counts by its place among the numbers of its own attribute,
and not at all for functions whose designs expect no value of it. Where the schema or a rule has
more to say, every value counts, as it is.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator
from decimal import Decimal
from itertools import chain, combinations

from suave_des.errors import KnowledgeError
from suave_des.knowledge.checks import attributes_asked
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import (
    FUNCTIONAL,
    HAS_QA_VALUE,
    HAS_VALUE,
    IS_QA_TYPE,
    OWL,
    RDF_TYPE,
    RDFS,
    SUBCLASS,
    TOMASYS,
    Lit,
    Triple,
    links,
    members,
    reached,
    subjects,
    terms,
)
from suave_des.knowledge.reasoner import Regions, regions_of
from suave_des.knowledge.rules import (
    COMPARISONS,
    FACT_KINDS,
    SAME,
    Atom,
    Named,
    Rule,
    Term,
    Variable,
)
from suave_des.knowledge.state import exact

_CARRIED = frozenset({IS_QA_TYPE, HAS_VALUE})
_OF_VALUES = _CARRIED | {HAS_QA_VALUE, TOMASYS + "hasQAestimation"}
#: What a schema may say of these properties without relating values of one attribute to those of
# another.
_HARMLESS = {(RDF_TYPE, kind) for kind in terms(OWL, "ObjectProperty DatatypeProperty")} | {
    (name, None) for name in terms(RDFS, "domain range")
}
_FUNCTIONAL = frozenset((name, RDF_TYPE, FUNCTIONAL) for name in _CARRIED)


def has_effect(base: Ontology, attribute: str, function: str | None = None) -> bool:
    """Whether a measured value of a quality attribute can have any effect, on decisions for one
    function or for any.

    It has none if none of its designs expects one, and no rule can match the individual that
    carries it: what is known of that is its class, isQAtype and hasValue. Where the schema has more
    to say (class expressions, properties related to these), the attribute counts as one with an
    effect.
    """
    model = base.model
    iri = model.attributes[attribute]
    designs: Iterable[str] = model.estimated
    if function is not None:
        designs = base.designs(function)
    elif subjects(base.content.triples, IS_QA_TYPE, iri):  # the ontologies have a value
        return True
    if any(attribute in model.estimated[name] for name in designs):
        return True
    measured = model.measurements[attribute]
    if model.own[measured] or has_expressions(base) or _is_carrying_related(base):
        return True
    classes = _classes_of_measured(base)
    return any(_can_match(rule, iri, measured, classes) for rule in base.content.enabled_rules)


def _is_carrying_related(base: Ontology) -> bool:
    """Whether the schema relates isQAtype or hasValue to other properties."""
    related = ("subPropertyOf", "inverseOf", "equivalentProperty")
    return any(
        name.endswith(related) and not _CARRIED.isdisjoint((subject, value))
        for subject, name, value in base.content.triples
    )


def _classes_of_measured(base: Ontology) -> set[str]:
    """The classes of what carries a measured value: QAvalue, what the domains of its properties
    say, and all above.
    """
    triples = base.content.triples
    domains = {kind for name, kind in links(triples, RDFS + "domain") if name in _CARRIED}
    above = links(triples, SUBCLASS, OWL + "equivalentClass")
    return reached({TOMASYS + "QAvalue", OWL + "Thing", *domains}, above)


def has_expressions(base: Ontology) -> bool:
    """Whether the ontologies have class expressions."""
    return bool(members(base.content.structure, terms(OWL, "Class Restriction")))


def _can_match(rule: Rule, attribute: str, measured: str, classes: set[str]) -> bool:
    """Whether a variable of a rule, or a name in it, can stand for the individual of a measured
    value.
    """
    if Named(measured) in _terms_of(rule) or rule.speaks_of_identity:
        return True
    asked = {atom.arguments[0] for atom in rule.body if atom.kind in FACT_KINDS}
    return any(_can_be(term, rule, attribute, classes) for term in asked)


def _can_be(term: Term, rule: Rule, attribute: str, classes: set[str]) -> bool:
    asking = [atom for atom in rule.body if term in atom.arguments]
    return isinstance(term, Variable) and all(
        atom.arguments[0] == term and _could_hold(atom, attribute, classes) for atom in asking
    )


def _terms_of(*rules: Rule) -> set[Term]:
    return {term for rule in rules for atom in rule.atoms for term in atom.arguments}


def _could_hold(atom: Atom, attribute: str, classes: set[str]) -> bool:
    """Whether an atom can hold of what carries a measured value."""
    if atom.kind == "class":
        return atom.predicate in classes
    if atom.predicate == IS_QA_TYPE:
        return isinstance(atom.arguments[-1], Variable) or atom.arguments[-1] == Named(attribute)
    return atom.predicate == HAS_VALUE


def interchangeable_components(base: Ontology) -> tuple[tuple[str, ...], ...]:
    """Group the components that can be exchanged: doing so maps ontologies and rules onto
    themselves.
    """
    groups = defaultdict[str, list[str]](list)
    for name in base.model.components:
        first = next((each for each in groups if _exchangeable(base, each, name)), name)
        groups[first].append(name)
    return tuple(map(tuple, groups.values()))


def _exchangeable(base: Ontology, one: str, other: str) -> bool:
    known_as = base.model.components
    swap: dict[str | Lit, str] = {known_as[one]: known_as[other], known_as[other]: known_as[one]}
    content = base.content
    if not _terms_of(*content.enabled_rules).isdisjoint(map(Named, swap.values())):
        return False
    if not swap.keys().isdisjoint(chain.from_iterable(content.structure)):
        return False
    known = chain(content.triples, *(base.model.own[iri] for iri in swap.values()))
    own = {triple for triple in known if triple[0] in swap or triple[2] in swap}
    return own == {
        (swap.get(subject, subject), name, swap.get(value, value)) for subject, name, value in own
    }


#: One side of a comparison: IRIs of quality attributes whose values it can be, and numbers; _ANY:
# of any attribute.
_Side = frozenset[str | Decimal]
_ANY = ""


def regions_by_attribute(base: Ontology, attributes: tuple[str, ...]) -> dict[str, Regions] | None:
    """The regions of each attribute's values, where rules compare them with numbers of that
    attribute only.
    """
    known = base.model.attributes
    if not known.keys() >= {*attributes} or not regions_of(base).is_sound or not _is_plain(base):
        return None
    measured = set(map(known.__getitem__, attributes))
    numbers = {iri: set(_values(base, iri)) for iri in measured}
    for one, other in chain.from_iterable(map(_compared, base.content.enabled_rules)):
        concerned = _concerned(one, other, measured)
        if concerned is None:
            return None
        for attribute in concerned:
            numbers[attribute].update(*(_numbers_of(base, each) for each in one | other))
    return {name: Regions(tuple(sorted(numbers[known[name]])), ()) for name in attributes}


def _concerned(one: _Side, other: _Side, measured: set[str]) -> Collection[str] | None:
    """The attributes whose values a comparison can be about; None if it relates those of several
    to one another.
    """
    if _ANY in one | other:
        return measured if any(map(_is_of_numbers, (one, other))) else None
    found = [name for name in measured if name in one | other]
    return found if len(found) < 2 else None


def _is_of_numbers(side: _Side) -> bool:
    return all(isinstance(each, Decimal) for each in side)


def _numbers_of(base: Ontology, one: str | Decimal) -> set[Decimal]:
    """A number, or the numbers that the ontologies give of a quality attribute."""
    return {one} if isinstance(one, Decimal) else _values(base, one)


def _values(base: Ontology, attribute: str) -> set[Decimal]:
    """The numbers that the ontologies give of a quality attribute."""
    triples = base.content.triples
    typed = subjects(triples, IS_QA_TYPE, attribute)
    values = (o for s, p, o in triples if p == HAS_VALUE and s in typed)
    return {Decimal(value.text.strip()) for value in values if isinstance(value, Lit)}


def _compared(rule: Rule) -> Iterator[tuple[_Side, _Side]]:
    """Both sides of each comparison of values in a rule; a variable that is read twice compares
    what it reads.
    """
    types = {atom.arguments[0]: attribute for atom, attribute in attributes_asked(rule)}
    read = defaultdict[Term, list[_Side]](list)
    for atom in rule.body:
        if atom.kind == "data":
            here = types.get(atom.arguments[0], _ANY) if atom.predicate == HAS_VALUE else _ANY
            read[atom.arguments[1]].append(frozenset({here}))
    for term, sides in read.items():
        yield from combinations([*sides, *_number(term)], 2)
    for atom in rule.body:
        if atom.predicate in COMPARISONS:
            sides = [_Side().union(*read.get(term, ()), *_number(term)) for term in atom.arguments]
            yield from combinations(sides, 2)


def _number(term: Term) -> list[_Side]:
    """A literal as a side of a comparison; none where it is no number, as it never equals one."""
    try:
        return [frozenset({exact(term.text.strip())})] if isinstance(term, Lit) else []
    except KnowledgeError:
        return []


def _is_plain(base: Ontology) -> bool:
    """Whether nothing but rules that compare can relate a value to others: no axiom, and no rule
    that asserts one.
    """
    of_measured = (base.model.own[each] for each in base.model.measurements.values())
    return not (
        has_expressions(base)
        or any(of_measured)
        or any(_says_more(triple) for triple in base.content.triples)
        or _has_equal_individuals(base)
    )


def _says_more(triple: Triple) -> bool:
    """Whether a triple says more of the properties of values than what they are used for."""
    subject, name, value = triple
    if _OF_VALUES.isdisjoint((subject, value)) or triple in _FUNCTIONAL:
        return False
    return (name, None) not in _HARMLESS and (name, value) not in _HARMLESS


def _has_equal_individuals(base: Ontology) -> bool:
    """Whether two individuals may be the same, or a rule may say so or give one a value."""
    triples = base.content.triples
    inverse = members(triples, [OWL + "InverseFunctionalProperty"])
    if inverse or subjects(triples, SAME):
        return True
    functional = members(triples, [FUNCTIONAL])
    own = Counter((s, p) for s, p, o in triples if p in functional and isinstance(o, str))
    if max(own.values(), default=0) > 1:
        return True
    return any(_equates(rule, functional) for rule in base.content.enabled_rules)


def _equates(rule: Rule, functional: Collection[str]) -> bool:
    """Whether a rule speaks of identity, concludes a value, or what may make individuals equal."""
    if rule.speaks_of_identity:
        return True
    concluded = {atom.predicate for atom in rule.head}
    of_individuals = {atom.predicate for atom in rule.head if atom.kind == "object"}
    return not (concluded.isdisjoint(_OF_VALUES) and of_individuals.isdisjoint(functional))
