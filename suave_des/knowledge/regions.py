"""Regions of measured values that the rules cannot tell apart.

Where rules only compare numbers, what they infer depends only on the order of the measured values relative to one
another and to the numbers in the knowledge base. These numbers are thresholds: each is a region of its own, and so is
each gap between two. Numbers are compared exactly, as decimals.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from math import inf
from typing import Any, Final

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import HAS_VALUE, OWL, RDF_TYPE, RDFS, XSD, Lit, local_name, reached
from suave_des.knowledge.rules.syntax import COMPARISONS, EXPRESSION
from suave_des.knowledge.state import MAX_EXPONENT, KnowledgeState

#: Objectives, groundings, components and measurements of a state, the last as regions or as exact values.
Key = tuple[Any, ...]
_SAME_VALUES: Final = (RDFS + "subPropertyOf", OWL + "equivalentProperty")
_BINARY: Final = frozenset((XSD + "float", XSD + "double"))
#: Datatypes of which a number is or is not by its size alone, or in which there is no number.
_SIZELESS: Final = frozenset(XSD + name for name in ("decimal", "string", "boolean", "anyURI", "dateTime", "date"))
_SIZES: Final = frozenset(XSD + name for name in ("minInclusive", "minExclusive", "maxInclusive", "maxExclusive"))
_LITERAL: Final = re.compile(r'"((?:[^"\\]|\\.)*)"(?:\^\^<([^>]*)>)?')
_XSD_TERM: Final = re.compile(rf"(?<!\^)<({re.escape(XSD)}[^>]*)>")
_NUMBER: Final = re.compile(r"\s*[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]{1,3})?\s*")


@dataclass(frozen=True)
class Regions:
    """The regions of measured values in a knowledge base.

    Attributes:
        thresholds: every number in the knowledge base, ascending.
        reasons: why the rules may distinguish values of one region, so that only equal values are equivalent; empty
            where they cannot.
    """

    thresholds: tuple[Decimal, ...]
    reasons: tuple[str, ...]

    @property
    def is_sound(self) -> bool:
        """Whether the rules cannot distinguish values of one region."""
        return not self.reasons

    def region(self, value: Decimal) -> int:
        """Number of a value's region: odd for a threshold itself, even for the gap before the next one."""
        return bisect_left(self.thresholds, value) + bisect_right(self.thresholds, value)

    def around(self, value: float) -> tuple[float, float]:
        """Return bounds of a value: all numbers between them are in its region; equal bounds: only an equal number is.

        Floats keep the order of the decimals that they denote, though not always their difference.
        """
        floats = self._bounds
        place = bisect_left(floats, value, 1)
        if self.reasons or floats[place] == value:
            return value, value
        return floats[place - 1], floats[place]

    @cached_property
    def thresholds_as_floats(self) -> tuple[float, ...]:
        """The thresholds, as measured values are: floats."""
        return tuple(map(float, self.thresholds))

    @cached_property
    def _bounds(self) -> tuple[float, ...]:
        return -inf, *self.thresholds_as_floats, inf

    def key(self, state: KnowledgeState) -> Key:
        """Return what the rules can distinguish of a state: states with equal keys entail the same."""
        measured: tuple[object, ...] = state.measurements
        if not self.reasons:
            where = [(name, self.region(value)) for name, value in state.measurements]
            is_shared = len(where) > 1 and len({number for _, number in where}) < len(where)
            measured = _ranked(state, where) if is_shared else tuple(where)
        return state.objectives, state.groundings, state.components, measured


def _ranked(state: KnowledgeState, where: list[tuple[str, int]]) -> tuple[tuple[str, int | tuple[int, int]], ...]:
    """Regions, with the rank of each value among those in the same gap; equal values have the same rank."""
    in_gap: dict[int, set[Decimal]] = {}
    for (_, value), (_, number) in zip(state.measurements, where, strict=True):
        in_gap.setdefault(number, set()).add(value)
    return tuple(
        (name, number if number % 2 else (number, sorted(in_gap[number]).index(value)))
        for (name, value), (_, number) in zip(state.measurements, where, strict=True)
    )


def regions_of(ontology: Ontology) -> Regions:
    """Find the regions of an ontology, and reasons why its rules may distinguish values within them."""
    carriers = _carriers(ontology)
    reasons = [*_of_rules(ontology, carriers), *_of_ontologies(ontology, carriers)]
    return Regions(tuple(sorted(set(_numbers(ontology)))), tuple(dict.fromkeys(reasons)))


def _carriers(ontology: Ontology) -> frozenset[str]:
    """Properties that can have a measured value: hasValue, and properties that it implies."""
    pairs = [(s, o) for s, p, o in ontology.content.triples if p in _SAME_VALUES and isinstance(o, str)]
    return frozenset(reached([HAS_VALUE], [*pairs, *((o, s) for s, o in pairs)]))


def _of_rules(ontology: Ontology, carriers: frozenset[str]) -> Iterator[str]:
    for rule in ontology.content.enabled_rules:
        for atom in rule.atoms:
            if atom.kind == "builtin" and atom.predicate not in COMPARISONS:
                yield f"rule {rule.name} computes with {local_name(atom.predicate)}"
            if atom.kind == "range" or atom.predicate == EXPRESSION:
                yield f"rule {rule.name} asks for a datatype or a class expression"
            if any(isinstance(term, Lit) and term.datatype in _BINARY for term in atom.arguments):
                yield f"rule {rule.name} has a binary number, which is compared inexactly"
        measured = {name for name, predicate in rule.read_values() if predicate in carriers}
        for name in sorted(measured.intersection(name for atom in rule.head for name in atom.variables())):
            yield f"rule {rule.name} copies the value ?{name} to its head"


def _of_ontologies(ontology: Ontology, carriers: frozenset[str]) -> Iterator[str]:
    for name in sorted(carriers - {HAS_VALUE}):
        yield f"{local_name(name)} has the values of hasValue"
    for subject, predicate, value in ontology.content.triples:
        if isinstance(value, Lit) and value.datatype in _BINARY:
            yield f"{local_name(subject)} has a binary number, which is compared inexactly"
        if predicate == RDFS + "range" and subject in carriers and value != XSD + "decimal":
            yield f"{local_name(subject)} has a range other than decimal"
        if predicate == RDF_TYPE and value == RDFS + "Datatype":
            yield f"the ontology defines a datatype, {local_name(subject)}"
    for line in ontology.content.structure:
        for term in _XSD_TERM.findall(line):
            if term not in _SIZELESS | _SIZES:
                yield f"a class expression speaks of {local_name(term)}"
        if any(datatype in _BINARY for _, datatype in _LITERAL.findall(line)):
            yield "a class expression has a binary number, which is compared inexactly"


def _numbers(ontology: Ontology) -> Iterator[Decimal]:
    """Every number in the knowledge base, whatever its datatype, and texts that look like one."""
    triples = (*ontology.content.triples, *ontology.model.triples())
    yield from _in_texts(value.text for _, _, value in triples if isinstance(value, Lit))
    for line in ontology.content.structure:
        yield from _in_texts(text for text, _ in _LITERAL.findall(line))
    for rule in ontology.content.enabled_rules:
        for atom in rule.atoms:
            yield from _in_texts(term.text for term in atom.arguments if isinstance(term, Lit))


def _in_texts(texts: Iterator[str]) -> Iterator[Decimal]:
    for text in texts:
        if _NUMBER.fullmatch(text):
            value = Decimal(text.strip())
            if abs(value.adjusted()) <= MAX_EXPONENT:
                yield value
