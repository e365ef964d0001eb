"""The states that a policy tells apart: ranges of measured values, and reports of interchangeable components.

Only the number of components with a status counts where ontologies and rules treat components alike.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from math import comb
from typing import Final

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import C_STATUS, HAS_VALUE, IS_QA_TYPE, OWL, RDFS, TOMASYS, Lit, Triple, reached
from suave_des.knowledge.rules.syntax import COMPARISONS, Atom, Named, Rule, Variable, texts_of
from suave_des.monitor.diagnostics import FAILED, RECOVERED
from suave_des.workbench.ranges import numbers_in
from suave_des.workbench.state_input import ManagingSettings

_OF_VALUES: Final = frozenset({IS_QA_TYPE, HAS_VALUE})


def rules_that_compute(base: Ontology) -> tuple[str, ...]:
    """Names of enabled rules that do more with numbers than compare them: for these, ranges prove nothing."""
    return tuple(sorted({rule.name for rule in base.content.enabled_rules if _computes(rule)}))


def _computes(rule: Rule) -> bool:
    return any(
        atom.kind == "range" or (atom.kind == "builtin" and atom.predicate not in COMPARISONS) for atom in rule.body
    ) or any(atom.kind == "data" and isinstance(atom.arguments[-1], Variable) for atom in rule.head)


def has_effect(base: Ontology, attribute: str) -> bool:
    """Whether a measured value of a quality attribute can have any effect.

    It has none if no design expects one, and no rule can match the individual that carries it: what is known of that
    is its class, isQAtype and hasValue. Where the schema has more to say (class expressions, properties related to
    these), the attribute counts as one with an effect.
    """
    iri = base.model.attributes[attribute]
    measured = base.model.measurements[attribute]
    triples = base.content.triples
    expressions = any(f"<{OWL}{kind}>" in line for kind in ("Class", "Restriction") for line in base.content.structure)
    if measured.own or expressions or any(attribute in kinds for kinds in base.model.estimated.values()):
        return True
    related = ("subPropertyOf", "inverseOf", "equivalentProperty")
    if any(
        (predicate == IS_QA_TYPE and value == iri)
        or (predicate.endswith(related) and (subject in _OF_VALUES or value in _OF_VALUES))
        for subject, predicate, value in triples
    ):
        return True
    # The classes of the individual: QAvalue, what the domains of its properties say, and all above.
    domains = {str(o) for s, p, o in triples if p == RDFS + "domain" and s in _OF_VALUES}
    above = ((s, str(o)) for s, p, o in triples if p in (RDFS + "subClassOf", OWL + "equivalentClass"))
    classes = reached({TOMASYS + "QAvalue", OWL + "Thing", *domains}, above)
    return any(_can_match(rule, iri, measured.iri, classes) for rule in base.content.enabled_rules)


def _can_match(rule: Rule, attribute: str, measured: str, classes: set[str]) -> bool:
    """Whether a variable of a rule, or a name in it, can stand for the individual of a measured value."""

    def could_hold(atom: Atom, term: Variable) -> bool:
        if atom.arguments[0] != term:
            return False
        if atom.predicate == IS_QA_TYPE:
            return isinstance(atom.arguments[-1], Variable) or atom.arguments[-1] == Named(attribute)
        return atom.predicate in classes if atom.kind == "class" else atom.predicate == HAS_VALUE

    terms = {term for atom in rule.atoms for term in atom.arguments}
    if Named(measured) in terms or any(atom.kind in ("same", "different") for atom in rule.atoms):
        return True
    subjects = {atom.arguments[0] for atom in rule.body if atom.kind in ("class", "object", "data")}
    return any(
        all(could_hold(atom, term) for atom in rule.body if term in atom.arguments)
        for term in subjects
        if isinstance(term, Variable)
    )


def interchangeable_components(base: Ontology) -> tuple[tuple[str, ...], ...]:
    """Group the components that can be exchanged: doing so maps ontologies and rules onto themselves."""
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
    if any(f"<{iri}>" in line for iri in (a, b) for line in content.structure):
        return False
    if any(Named(iri) in atom.arguments for iri in (a, b) for rule in content.enabled_rules for atom in rule.atoms):
        return False
    swap: dict[str | Lit, str] = {a: b, b: a}

    def swapped(triple: Triple) -> Triple:
        subject, predicate, value = triple
        return swap.get(subject, subject), predicate, swap.get(value, value)

    own = {
        triple
        for triple in (*content.triples, *model.initial.get(one, ()), *model.initial.get(other, ()))
        if triple[0] in swap or triple[2] in swap
    }
    return {swapped(triple) for triple in own} == own


def component_statuses(base: Ontology) -> tuple[str, ...]:
    """Values of c_status to look at: what the thruster monitor reports, and what enabled rules ask for."""
    asked = texts_of((atom for rule in base.content.enabled_rules for atom in rule.body), C_STATUS)
    return tuple(sorted({*asked, FAILED, RECOVERED}))


@dataclass(frozen=True, slots=True)
class ComponentReports:
    """What components report; stands for all reports that differ by an exchange of interchangeable components.

    Attributes:
        components: (component, c_status), the first ones of each group of interchangeable components.
        combinations: how many combinations it stands for.
    """

    components: tuple[tuple[str, str], ...]
    combinations: int


def component_reports(
    groups: Sequence[Sequence[str]], statuses: Sequence[str], most: int
) -> Iterator[ComponentReports]:
    """All that components can report, up to an exchange of interchangeable ones, fewest reports first.

    Args:
        groups: of interchangeable components.
        statuses: that a component can report.
        most: at most so many components report at all.
    """
    counts = [list(_counts(len(statuses), min(most, len(group)))) for group in groups]
    for chosen in itertools.product(*counts):
        if sum(map(sum, chosen)) > most:
            continue
        components: list[tuple[str, str]] = []
        combinations = 1
        for group, numbers in zip(groups, chosen, strict=True):
            left = list(group)
            for status, number in zip(statuses, numbers, strict=True):
                combinations *= comb(len(left), number)
                components += [(left.pop(0), status) for _ in range(number)]
        yield ComponentReports(tuple(components), combinations)


def _counts(kinds: int, most: int) -> list[tuple[int, ...]]:
    """How many components report each status."""
    found = [numbers for numbers in itertools.product(range(most + 1), repeat=kinds) if sum(numbers) <= most]
    return sorted(found, key=lambda numbers: (sum(numbers), [-number for number in numbers]))


@dataclass(frozen=True)
class PolicySpace:
    """What a policy tells apart.

    Attributes:
        attributes: quality attributes whose measured values have an effect.
        numbers: ends of the ranges, ascending.
        alike: groups of interchangeable components.
        statuses: that components can report.
        functions: that have a design, if only in one of two knowledge bases; without one there is nothing to ask for.
    """

    attributes: tuple[str, ...]
    numbers: tuple[Decimal, ...]
    alike: tuple[tuple[str, ...], ...]
    statuses: tuple[str, ...]
    functions: tuple[str, ...] = ()

    @classmethod
    def of(cls, base: Ontology, settings: ManagingSettings) -> PolicySpace:
        """What can have an effect in these ontologies."""
        attributes = tuple(name for name in measured_attributes(base, settings) if has_effect(base, name))
        functions = tuple(name for name in base.functions if base.designs(name))
        return cls(attributes, numbers_in(base), interchangeable_components(base), component_statuses(base), functions)

    def common(self, other: PolicySpace) -> PolicySpace:
        """What has an effect in either; components are alike only if they are so in both that have them."""
        groups: dict[tuple[int, int], list[str]] = {}
        for number, group in enumerate(self.alike):
            for name in group:
                there = next((place for place, each in enumerate(other.alike) if name in each), -1)
                groups.setdefault((number, there), []).append(name)
        known = {name for group in self.alike for name in group}
        only_there = (tuple(name for name in group if name not in known) for group in other.alike)
        return PolicySpace(
            tuple(sorted({*self.attributes, *other.attributes})),
            tuple(sorted({*self.numbers, *other.numbers})),
            (*map(tuple, groups.values()), *filter(None, only_there)),
            tuple(sorted({*self.statuses, *other.statuses})),
            tuple(sorted({*self.functions, *other.functions})),
        )


def measured_attributes(base: Ontology, settings: ManagingSettings) -> list[str]:
    """Quality attributes of the ontologies that the scenario measures."""
    return [name for name in settings.measured if name in base.quality_attributes]
