"""Components that ontologies and rules treat alike, so that only their number matters."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import comb
from typing import Final

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import Lit, Triple
from suave_des.knowledge.rules.syntax import Named
from suave_des.knowledge.vocabulary import TOMASYS, XSD

_C_STATUS: Final = TOMASYS + "c_status"
#: What the exemplar's thruster monitor reports.
_REPORTED: Final = ("FALSE", "RECOVERED")


@dataclass(frozen=True, slots=True)
class Reports:
    """What components report: one such combination stands for all that differ by exchanging alike components.

    Attributes:
        components: (component, c_status), the first ones of each group of alike components.
        combinations: how many combinations it stands for.
    """

    components: tuple[tuple[str, str], ...]
    combinations: int


def alike(base: Ontology) -> tuple[tuple[str, ...], ...]:
    """Groups of components that can be exchanged: doing so maps ontologies and rules onto themselves."""
    groups: list[list[str]] = []
    for name in base.components:
        group = next((each for each in groups if _exchangeable(base, each[0], name)), None)
        if group is None:
            groups.append([name])
        else:
            group.append(name)
    return tuple(map(tuple, groups))


def _exchangeable(base: Ontology, one: str, other: str) -> bool:
    model, content = base.model, base.content
    a, b = model.components[one], model.components[other]
    if any(iri in line for iri in (f"<{a}>", f"<{b}>") for line in content.structure):
        return False
    if any(Named(iri) in atom.arguments for iri in (a, b) for rule in content.enabled_rules for atom in rule.atoms):
        return False
    swap = {a: b, b: a}

    def swapped(triple: Triple) -> Triple:
        subject, predicate, value = triple
        return swap.get(subject, subject), predicate, value if isinstance(value, Lit) else swap.get(value, value)

    own = {
        triple
        for triple in (*content.triples, *model.initial.get(one, ()), *model.initial.get(other, ()))
        if triple[0] in swap or triple[2] in swap
    }
    return {swapped(triple) for triple in own} == own


def statuses(base: Ontology) -> tuple[str, ...]:
    """Values of c_status to look at: what monitors report, and what enabled rules ask for."""
    asked = {
        term.text
        for rule in base.content.enabled_rules
        for atom in rule.body
        if atom.predicate == _C_STATUS
        for term in atom.arguments
        if isinstance(term, Lit) and term.datatype == XSD + "string"
    }
    return tuple(sorted(asked.union(_REPORTED)))


def reports(groups: Sequence[Sequence[str]], words: Sequence[str], most: int) -> Iterator[Reports]:
    """All that components can report, up to exchanging alike ones, with at most so many that report at all."""
    counts = [list(_counts(len(words), min(most, len(group)))) for group in groups]
    for chosen in itertools.product(*counts):
        if sum(map(sum, chosen)) > most:
            continue
        components: list[tuple[str, str]] = []
        combinations = 1
        for group, numbers in zip(groups, chosen, strict=True):
            left = list(group)
            for word, number in zip(words, numbers, strict=True):
                combinations *= comb(len(left), number)
                components += [(left.pop(0), word) for _ in range(number)]
        yield Reports(tuple(components), combinations)


def _counts(kinds: int, most: int) -> Iterator[tuple[int, ...]]:
    """How many components may report each word: fewest first."""
    found = [numbers for numbers in itertools.product(range(most + 1), repeat=kinds) if sum(numbers) <= most]
    yield from sorted(found, key=lambda numbers: (sum(numbers), [-number for number in numbers]))
