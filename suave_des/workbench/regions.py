"""Regions of measured values: between any two numbers of the knowledge base everything is decided alike.

A rule that only compares numbers cannot tell two values apart that compare alike with every number there is. So one
value of each region stands for all of it; equality with a number is a region of its own.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Final

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import Lit, value_of
from suave_des.knowledge.rules.syntax import Atom, Named, Rule, Variable
from suave_des.knowledge.state import exact
from suave_des.knowledge.vocabulary import OWL, RDFS, SWRLB, TOMASYS

_COMPARISONS: Final = frozenset(
    SWRLB + name for name in ("equal", "notEqual", "lessThan", "lessThanOrEqual", "greaterThan", "greaterThanOrEqual")
)
_IS_QA_TYPE: Final = TOMASYS + "isQAtype"
_HAS_VALUE: Final = TOMASYS + "hasValue"
_OF_VALUES: Final = frozenset({_IS_QA_TYPE, _HAS_VALUE})


@dataclass(frozen=True, slots=True)
class Region:
    """A range of measured values, or no measurement.

    Attributes:
        low, high: its ends; None: it has none there.
        low_closed, high_closed: whether the end belongs to it.
        is_missing: whether there is no measurement.
    """

    low: Decimal | None = None
    high: Decimal | None = None
    low_closed: bool = False
    high_closed: bool = False
    is_missing: bool = False

    def __str__(self) -> str:
        """In words: "not measured", "1.25", "< 1.25", ">= 1.25", "1.25 <= . < 2.25"."""
        if self.is_missing:
            return "not measured"
        if self.low is not None and self.low == self.high:
            return str(self.low)
        below = "" if self.high is None else f"{'<=' if self.high_closed else '<'} {self.high}"
        if self.low is None:
            return below or "any"
        if self.high is None:
            return f"{'>=' if self.low_closed else '>'} {self.low}"
        return f"{self.low} {'<=' if self.low_closed else '<'} . {below}"

    def value(self, step: int = 0, steps: int = 1) -> Decimal | None:
        """A value in it; in an open range the `step`-th of `steps` rising ones."""
        if self.is_missing:
            return None
        if self.low is not None and self.low == self.high:
            return self.low
        low = self.low if self.low is not None else (self.high or Decimal(0)) - 1
        high = self.high if self.high is not None else low + 1
        return exact(low + (high - low) * (step + 1) / Decimal(2 ** steps.bit_length()))

    def holds(self, value: Decimal | None) -> bool:
        """Whether a measured value is in it."""
        if value is None or self.is_missing:
            return self.is_missing and value is None
        above = self.low is None or value > self.low or (self.low_closed and value == self.low)
        return above and (self.high is None or value < self.high or (self.high_closed and value == self.high))

    def with_next(self, other: Region) -> Region:
        """The range of this one and the one that follows it."""
        return Region(self.low, other.high, self.low_closed, other.high_closed)


MISSING: Final = Region(is_missing=True)


def numbers_in(base: Ontology) -> tuple[Decimal, ...]:
    """Every number that the ontologies or an enabled rule have, rising."""
    literals = [triple[2] for triple in base.content.triples if isinstance(triple[2], Lit)]
    literals += [
        term
        for rule in base.content.enabled_rules
        for atom in rule.atoms
        for term in atom.arguments
        if isinstance(term, Lit)
    ]
    found = {value_of(literal, base.names) for literal in literals}
    return tuple(sorted({exact(number) for number in found if isinstance(number, Decimal) and number.is_finite()}))


def regions_between(numbers: Sequence[Decimal]) -> tuple[Region, ...]:
    """No measurement, then each open range and each number, rising."""
    ends: list[Decimal | None] = [None, *numbers, None]
    found = [MISSING]
    for low, high in itertools.pairwise(ends):
        found.append(Region(low, high))
        if high is not None:
            found.append(Region(high, high, True, True))
    return tuple(found)


def values_in(regions: Sequence[Region]) -> Iterator[tuple[Decimal | None, ...]]:
    """Values for several attributes, one in each given region, for every order that the values can have.

    Attributes in different regions are ordered by these; those that share an open range can be in any order, and
    equal.
    """
    places: dict[Region, list[int]] = {}
    for place, region in enumerate(regions):
        places.setdefault(region, []).append(place)
    shared = [
        (region, group)
        for region, group in places.items()
        if len(group) > 1 and not region.is_missing and (region.low is None or region.low != region.high)
    ]
    plain: list[Decimal | None] = [region.value() for region in regions]
    for ranks in itertools.product(*(list(_weak_orders(len(group))) for _, group in shared)):
        values = list(plain)
        for (region, group), order in zip(shared, ranks, strict=True):
            for place, rank in zip(group, order, strict=True):
                values[place] = region.value(rank, len(group))
        yield tuple(values)


def _weak_orders(size: int) -> Iterator[tuple[int, ...]]:
    """All ways to rank things, ties allowed: ranks from 0 without gaps."""
    for ranks in itertools.product(range(size), repeat=size):
        if set(ranks) == set(range(max(ranks) + 1)):
            yield ranks


def rules_that_compute(base: Ontology) -> tuple[str, ...]:
    """Names of enabled rules that do more with numbers than compare them: for these regions prove nothing."""
    return tuple(sorted({rule.name for rule in base.content.enabled_rules if _computes(rule)}))


def _computes(rule: Rule) -> bool:
    if any(atom.kind == "builtin" and atom.predicate not in _COMPARISONS for atom in rule.body):
        return True
    if any(atom.kind == "range" for atom in rule.body):
        return True
    return any(atom.kind == "data" and isinstance(atom.arguments[-1], Variable) for atom in rule.head)


def matters(base: Ontology, attribute: str) -> bool:
    """Whether a measured value of a quality attribute can make any difference.

    It cannot when no design expects one and no rule can match the individual that carries it: what is known of that
    is its class, isQAtype and hasValue. Where the schema has more to say (class expressions, properties related to
    these), it counts as one that can.
    """
    iri = base.model.attributes[attribute]
    measured = base.model.measurements[attribute]
    expressions = any(f"<{OWL}{kind}>" in line for kind in ("Class", "Restriction") for line in base.content.structure)
    if measured.own or expressions or any(attribute in kinds for kinds in base.model.estimated.values()):
        return True
    if any(triple[2] == iri and triple[1] == _IS_QA_TYPE for triple in base.content.triples):
        return True
    related = ("subPropertyOf", "inverseOf", "equivalentProperty")
    if any(
        predicate.endswith(related) and (subject in _OF_VALUES or value in _OF_VALUES)
        for subject, predicate, value in base.content.triples
    ):
        return True
    classes = _classes(base)
    return any(_can_match(rule, iri, measured.iri, classes) for rule in base.content.enabled_rules)


def _classes(base: Ontology) -> frozenset[str]:
    """All classes that a measured value's individual is in: QAvalue, what its properties' domains say, and above."""
    found = {TOMASYS + "QAvalue", OWL + "Thing"}
    while True:
        more = {
            value
            for subject, predicate, value in base.content.triples
            if isinstance(value, str)
            and (
                (predicate == RDFS + "domain" and subject in _OF_VALUES)
                or (predicate in (RDFS + "subClassOf", OWL + "equivalentClass") and subject in found)
            )
        }
        if more <= found:
            return frozenset(found)
        found |= more


def _can_match(rule: Rule, attribute: str, measured: str, classes: frozenset[str]) -> bool:
    """Whether a variable of a rule, or a name in it, can stand for the measured value's individual."""
    terms = {term for atom in rule.atoms for term in atom.arguments}
    if Named(measured) in terms or any(atom.kind in ("same", "different") for atom in rule.atoms):
        return True
    subjects = {atom.arguments[0] for atom in rule.body if atom.kind in ("class", "object", "data")}
    return any(
        all(_could_hold(atom, term, attribute, classes) for atom in rule.body if term in atom.arguments)
        for term in subjects
        if isinstance(term, Variable)
    )


def _could_hold(atom: Atom, term: Variable, attribute: str, classes: frozenset[str]) -> bool:
    """Whether an atom about a variable can hold of an individual of which only class, type and value are known."""
    if atom.arguments[0] != term:
        return False
    if atom.predicate == _IS_QA_TYPE:
        return isinstance(atom.arguments[-1], Variable) or atom.arguments[-1] == Named(attribute)
    return atom.predicate in classes if atom.kind == "class" else atom.predicate == _HAS_VALUE
