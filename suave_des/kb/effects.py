"""What in ontologies and rules a decision can depend on.

Quality attributes are independent of one another where every comparison in a rule is between values
of one of them: then a measured value counts by its place among the numbers of its own attribute,
and not at all for functions whose designs expect no value of it. Where the schema or a rule has
more to say, every value counts, as it is.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from decimal import Decimal
from typing import Final

from suave_des.errors import KnowledgeError
from suave_des.knowledge import rdf
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import Lit, Triple
from suave_des.knowledge.reasoner import Regions, regions_of
from suave_des.knowledge.rules import (
    COMPARISONS,
    FACT_KINDS,
    IDENTITIES,
    SAME,
    Atom,
    Named,
    Rule,
    Term,
    Variable,
)
from suave_des.knowledge.state import exact

_CARRIED: Final = frozenset({rdf.IS_QA_TYPE, rdf.HAS_VALUE})
_OF_VALUES: Final = _CARRIED | {rdf.HAS_QA_VALUE, rdf.TOMASYS + "hasQAestimation"}
#: What a schema may say of these properties without relating values of one attribute to those of
# another.
_HARMLESS: Final = {
    (rdf.RDF_TYPE, kind) for kind in rdf.terms(rdf.OWL, "ObjectProperty DatatypeProperty")
} | {(name, None) for name in rdf.terms(rdf.RDFS, "domain range")}
_FUNCTIONAL: Final = frozenset(
    (name, rdf.RDF_TYPE, rdf.OWL + "FunctionalProperty") for name in _CARRIED
)


def has_effect(base: Ontology, attribute: str, functions: Iterable[str] | None = None) -> bool:
    """Whether a measured value of a quality attribute can have any effect, on decisions for some
    functions or for any.

    It has none if none of their designs expects one, and no rule can match the individual that
    carries it: what is known of that is its class, isQAtype and hasValue. Where the schema has more
    to say (class expressions, properties related to these), the attribute counts as one with an
    effect.
    """
    if functions is None:
        designs = set(base.model.estimated)
    else:
        designs = {design for function in functions for design in base.designs(function)}
    if any(attribute in base.model.estimated[name] for name in designs):
        return True
    if functions is None and _is_stated(base, attribute):
        return True
    measured = base.model.measurements[attribute]
    if base.model.own[measured] or has_expressions(base) or _is_carrying_related(base):
        return True
    iri = base.model.attributes[attribute]
    classes = _classes_of_measured(base)
    return any(_can_match(rule, iri, measured, classes) for rule in base.content.enabled_rules)


def _is_stated(base: Ontology, attribute: str) -> bool:
    """Whether the ontologies themselves have a value of a quality attribute."""
    wanted = (rdf.IS_QA_TYPE, base.model.attributes[attribute])
    return any((name, value) == wanted for _, name, value in base.content.triples)


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
    domains = {str(o) for s, p, o in triples if p == rdf.RDFS + "domain" and s in _CARRIED}
    leading = (rdf.RDFS + "subClassOf", rdf.OWL + "equivalentClass")
    above = ((s, str(o)) for s, p, o in triples if p in leading)
    return rdf.reached({rdf.TOMASYS + "QAvalue", rdf.OWL + "Thing", *domains}, above)


def has_expressions(base: Ontology) -> bool:
    """Whether the ontologies have class expressions."""
    kinds = (f"<{rdf.OWL}Class>", f"<{rdf.OWL}Restriction>")
    return any(kind in line for line in base.content.structure for kind in kinds)


def _can_match(rule: Rule, attribute: str, measured: str, classes: set[str]) -> bool:
    """Whether a variable of a rule, or a name in it, can stand for the individual of a measured
    value.
    """

    terms = {term for atom in rule.atoms for term in atom.arguments}
    if Named(measured) in terms or any(atom.predicate in IDENTITIES for atom in rule.atoms):
        return True
    for term in {atom.arguments[0] for atom in rule.body if atom.kind in FACT_KINDS}:
        asking = [atom for atom in rule.body if term in atom.arguments]
        if isinstance(term, Variable) and all(
            atom.arguments[0] == term and _could_hold(atom, attribute, classes) for atom in asking
        ):
            return True
    return False


def _could_hold(atom: Atom, attribute: str, classes: set[str]) -> bool:
    """Whether an atom can hold of what carries a measured value."""
    if atom.kind == "class":
        return atom.predicate in classes
    if atom.predicate == rdf.IS_QA_TYPE:
        return isinstance(atom.arguments[-1], Variable) or atom.arguments[-1] == Named(attribute)
    return atom.predicate == rdf.HAS_VALUE


def interchangeable_components(base: Ontology) -> tuple[tuple[str, ...], ...]:
    """Group the components that can be exchanged: doing so maps ontologies and rules onto
    themselves.
    """
    groups: dict[str, list[str]] = {}
    for name in base.model.components:
        first = next((each for each in groups if _exchangeable(base, each, name)), name)
        groups.setdefault(first, []).append(name)
    return tuple(map(tuple, groups.values()))


def _exchangeable(base: Ontology, one: str, other: str) -> bool:
    swap: dict[str | Lit, str] = {
        base.model.components[one]: base.model.components[other],
        base.model.components[other]: base.model.components[one],
    }
    atoms = [atom for rule in base.content.enabled_rules for atom in rule.atoms]
    terms = {term for atom in atoms for term in atom.arguments}
    if not terms.isdisjoint(map(Named, swap.values())):
        return False
    if any(f"<{iri}>" in line for line in base.content.structure for iri in swap):
        return False
    known = itertools.chain(base.content.triples, *(base.model.own[iri] for iri in swap.values()))
    own = {triple for triple in known if triple[0] in swap or triple[2] in swap}
    return own == {
        (swap.get(subject, subject), name, swap.get(value, value)) for subject, name, value in own
    }


#: One side of a comparison: IRIs of quality attributes whose values it can be, and numbers; _ANY:
# of any attribute.
_Side = frozenset[str | Decimal]
_ANY: Final = ""


def regions_by_attribute(base: Ontology, attributes: tuple[str, ...]) -> dict[str, Regions] | None:
    """The regions of each attribute's values, where rules compare them with numbers of that
    attribute only.
    """
    known = base.model.attributes
    if not known.keys() >= {*attributes} or not regions_of(base).is_sound or not _is_plain(base):
        return None
    measured = {known[name] for name in attributes}
    numbers = {iri: set(_values(base, iri)) for iri in measured}
    for rule in base.content.enabled_rules:
        for one, other in _compared(rule):
            both = one | other
            concerned = measured & both
            if _ANY in both:
                if not (_is_of_numbers(one) or _is_of_numbers(other)):
                    return None
                concerned = measured
            elif len(concerned) > 1:
                return None
            for attribute in concerned:
                numbers[attribute].update(*(_numbers_of(base, each) for each in both))
    return {name: Regions(tuple(sorted(numbers[known[name]])), ()) for name in attributes}


def _is_of_numbers(side: _Side) -> bool:
    return all(isinstance(each, Decimal) for each in side)


def _numbers_of(base: Ontology, one: str | Decimal) -> set[Decimal]:
    """A number, or the numbers that the ontologies give of a quality attribute."""
    return {one} if isinstance(one, Decimal) else _values(base, one)


def _values(base: Ontology, attribute: str) -> set[Decimal]:
    """The numbers that the ontologies give of a quality attribute."""
    triples = base.content.triples
    typed = {s for s, p, o in triples if (p, o) == (rdf.IS_QA_TYPE, attribute)}
    values = (o for s, p, o in triples if p == rdf.HAS_VALUE and s in typed)
    return {Decimal(value.text.strip()) for value in values if isinstance(value, Lit)}


def _compared(rule: Rule) -> Iterator[tuple[_Side, _Side]]:
    """Both sides of each comparison of values in a rule; a variable that is read twice compares
    what it reads.
    """
    types = {
        atom.arguments[0]: atom.arguments[1].iri
        for atom in rule.body
        if atom.predicate == rdf.IS_QA_TYPE and isinstance(atom.arguments[1], Named)
    }
    read: dict[Term, list[_Side]] = {}
    for atom in rule.body:
        if atom.kind == "data":
            here = types.get(atom.arguments[0], _ANY) if atom.predicate == rdf.HAS_VALUE else _ANY
            read.setdefault(atom.arguments[1], []).append(frozenset({here}))
    for term, sides in read.items():
        yield from itertools.combinations([*sides, *_number(term)], 2)
    for atom in rule.body:
        if atom.predicate in COMPARISONS:
            sides = [
                frozenset[str | Decimal]().union(*read.get(term, ()), *_number(term))
                for term in atom.arguments
            ]
            yield from itertools.combinations(sides, 2)


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
    if any(p == SAME or o == rdf.OWL + "InverseFunctionalProperty" for _, p, o in triples):
        return True
    kind = (rdf.RDF_TYPE, rdf.OWL + "FunctionalProperty")
    functional = {s for s, p, o in triples if (p, o) == kind}
    own = Counter((s, p) for s, p, o in triples if p in functional and isinstance(o, str))
    if own and max(own.values()) > 1:
        return True
    return any(_equates(rule, functional) for rule in base.content.enabled_rules)


def _equates(rule: Rule, functional: Collection[str]) -> bool:
    """Whether a rule speaks of identity, concludes a value, or what may make individuals equal."""
    if any(atom.predicate in IDENTITIES for atom in rule.atoms):
        return True
    concluded = {atom.predicate for atom in rule.head}
    links = {atom.predicate for atom in rule.head if atom.kind == "object"}
    return not (concluded.isdisjoint(_OF_VALUES) and links.isdisjoint(functional))
