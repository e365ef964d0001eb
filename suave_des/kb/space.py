"""The states that a policy tells apart, and what of a state its decision can depend on.

States are ranges of measured values, reports of components and groundings. Only the number of components with a status
counts where ontologies and rules treat components alike. Quality attributes are independent of one another where every
comparison in a rule is between values of one of them: then a measured value counts by its place among the numbers of
its own attribute, and not at all for functions whose designs expect no value of it. Where the schema or a rule has more
to say, every value counts, as it is.

A rule that only compares numbers cannot tell two values apart that compare alike with every number in the knowledge
base. So one value stands for each range between two numbers; equality with a number is a range of its own.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from math import comb
from typing import Final

from suave_des.errors import InputError, KnowledgeError, shown
from suave_des.kb.states import ManagingSettings
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import (
    C_STATUS,
    HAS_QA_VALUE,
    HAS_VALUE,
    IS_QA_TYPE,
    OWL,
    RDF_TYPE,
    RDFS,
    TOMASYS,
    Lit,
    Triple,
    reached,
)
from suave_des.knowledge.reasoner import Regions, regions_of
from suave_des.knowledge.rules import COMPARISONS, SAME, Atom, Named, Rule, Term, Variable, texts_of
from suave_des.knowledge.state import exact
from suave_des.monitor.diagnostics import FAILED, RECOVERED

_NUMBER: Final = r"([+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))"
_REGION: Final = re.compile(rf"(?:{_NUMBER}\s*(<=?)\s*)?\.(?:\s*(<=?)\s*{_NUMBER})?")
_ABOVE: Final = re.compile(rf">(=?)\s*{_NUMBER}")
_MISSING: Final = "not measured"


@dataclass(frozen=True, slots=True)
class ValueRange:
    """A range of measured values, or no measurement.

    Attributes:
        low, high: its ends; None: it has none there.
        low_closed, high_closed: whether the end belongs to it.
        is_missing: whether there is no measurement.

    Example:
        >>> str(ValueRange(Decimal("1.25"), Decimal("2.25"), low_closed=True))
        '1.25 <= . < 2.25'
    """

    low: Decimal | None = None
    high: Decimal | None = None
    low_closed: bool = False
    high_closed: bool = False
    is_missing: bool = False

    def __str__(self) -> str:
        """In words: "not measured", "1.25", "< 1.25", ">= 1.25", "1.25 <= . < 2.25"."""
        if self.is_missing:
            return _MISSING
        if self.is_number:
            return str(self.low)
        below = "" if self.high is None else f"{'<=' if self.high_closed else '<'} {self.high}"
        if self.low is None:
            return below or "any"
        if self.high is None:
            return f"{'>=' if self.low_closed else '>'} {self.low}"
        return f"{self.low} {'<=' if self.low_closed else '<'} . {below}"

    @property
    def is_number(self) -> bool:
        """Whether it is one number."""
        return self.low is not None and self.low == self.high

    def value(self, step: int = 0, steps: int = 1) -> Decimal | None:
        """A value in it, above 0 if there is one; in an open range the `step`-th of `steps` ascending ones."""
        if self.is_missing or self.is_number:
            return self.low
        low = self.low
        if low is None:
            low = Decimal(0) if self.high is None or self.high > 0 else self.high - 1
        high = self.high if self.high is not None else low + 1
        return exact(low + (high - low) * (step + 1) / Decimal(2 ** steps.bit_length()))

    def holds(self, part: ValueRange) -> bool:
        """Whether all of a range between two neighbouring numbers is in it."""
        if part.is_missing or self.is_missing:
            return part.is_missing and self.is_missing
        value = part.value()
        assert value is not None
        above = self.low is None or value > self.low or (self.low_closed and value == self.low)
        return above and (self.high is None or value < self.high or (self.high_closed and value == self.high))

    def joined(self, following: ValueRange) -> ValueRange:
        """The range of this one and the one that follows it."""
        return ValueRange(self.low, following.high, self.low_closed, following.high_closed)


def numbers_in(base: Ontology) -> tuple[Decimal, ...]:
    """Every number in the ontologies and enabled rules, ascending."""
    return tuple(map(exact, regions_of(base).thresholds))


def ranges_between(numbers: Sequence[Decimal]) -> tuple[ValueRange, ...]:
    """No measurement, then each open range and each number, ascending."""
    ends: list[Decimal | None] = [None, *numbers, None]
    found = [ValueRange(is_missing=True)]
    for low, high in itertools.pairwise(ends):
        found.append(ValueRange(low, high))
        if high is not None:
            found.append(ValueRange(high, high, True, True))
    return tuple(found)


def values_in(ranges: Sequence[ValueRange]) -> Iterator[tuple[Decimal | None, ...]]:
    """Values of several attributes, one in each given range, for every order that the values can have.

    Values in different ranges are ordered by these; those in the same open range can be in any order, and equal.
    """
    places: dict[ValueRange, list[int]] = {}
    for place, one in enumerate(ranges):
        if not one.is_missing and not one.is_number:
            places.setdefault(one, []).append(place)
    shared = [(one, group) for one, group in places.items() if len(group) > 1]
    for ranks in itertools.product(*(_weak_orders(len(group)) for _, group in shared)):
        values = [one.value() for one in ranges]
        for (one, group), order in zip(shared, ranks, strict=True):
            for place, rank in zip(group, order, strict=True):
                values[place] = one.value(rank, len(group))
        yield tuple(values)


def _weak_orders(size: int) -> Iterator[tuple[int, ...]]:
    """All ways to rank things, ties allowed: ranks from 0 without gaps."""
    ranks = itertools.product(range(size), repeat=size)
    return (each for each in ranks if set(each) == set(range(max(each) + 1)))


def parse_region(text: str) -> ValueRange | None:
    """Read a region as `kb policy` writes it; None for what is none, such as a number.

    Example:
        >>> str(parse_region("1.25 <= . < 2.25"))
        '1.25 <= . < 2.25'

    Raises:
        InputError: there is no number in it.
    """
    text = text.strip()
    if text == _MISSING:
        return ValueRange(is_missing=True)
    if not {"<", ">"} & {*text}:
        return None
    found = _REGION.fullmatch(_ABOVE.sub(r"\2 <\1 .", f". {text}" if text.startswith("<") else text))
    if found is None:
        remedy = 'such as "< 1.25", ">= 3.25", "1.25 <= . < 2.25" or "not measured"'
        raise InputError(f"{shown(text)} is not a region", remedy=remedy)
    low, high = (exact(number) if number else None for number in (found[1], found[4]))
    region = ValueRange(low, high, found[2] == "<=", found[3] == "<=")
    if low is not None and high is not None and (low > high or (low == high and not region.holds(region))):
        raise InputError(f"no number is in the region {shown(text)}", remedy="write the smaller number first")
    return region


def measurements_in(
    base: Ontology, regions: Mapping[str, ValueRange]
) -> Iterator[tuple[dict[str, Decimal | None], str]]:
    """Measured values, one for each kind that rules that only compare can tell apart, with words for them.

    Args:
        base: the ontologies, whose numbers divide the regions.
        regions: by quality attribute type.
    """
    ends = {end for region in regions.values() for end in (region.low, region.high) if end is not None}
    between = ranges_between(sorted({*numbers_in(base), *ends}))
    names = tuple(regions)
    for ranges in itertools.product(*([each for each in between if regions[name].holds(each)] for name in names)):
        words = ", ".join(f"{name} {each}" for name, each in zip(names, ranges, strict=True))
        for values in values_in(ranges):
            yield dict(zip(names, values, strict=True)), words


#: One side of a comparison: IRIs of quality attributes whose values it can be, and numbers.
_Side = frozenset[str | Decimal]
_ANY: Final = ""
_CARRIED: Final = frozenset({IS_QA_TYPE, HAS_VALUE})
_OF_VALUES: Final = _CARRIED | {HAS_QA_VALUE, TOMASYS + "hasQAestimation"}
#: What a schema may say of these properties without relating values of one attribute to those of another.
_HARMLESS: Final = frozenset(
    {
        *((RDF_TYPE, OWL + kind) for kind in ("ObjectProperty", "DatatypeProperty")),
        (RDFS + "domain", None),
        (RDFS + "range", None),
    }
)
_FUNCTIONAL: Final = frozenset((name, RDF_TYPE, OWL + "FunctionalProperty") for name in _CARRIED)


def rules_that_compute(base: Ontology) -> tuple[str, ...]:
    """Names of enabled rules that do more with numbers than compare them: for these, ranges prove nothing."""
    return tuple(sorted({rule.name for rule in base.content.enabled_rules if _computes(rule)}))


def _computes(rule: Rule) -> bool:
    return any(
        atom.kind == "range" or (atom.kind == "builtin" and atom.predicate not in COMPARISONS) for atom in rule.body
    ) or any(atom.kind == "data" and isinstance(atom.arguments[-1], Variable) for atom in rule.head)


def has_effect(base: Ontology, attribute: str, functions: Iterable[str] | None = None) -> bool:
    """Whether a measured value of a quality attribute can have any effect, on decisions for some functions or for any.

    It has none if none of their designs expects one, and no rule can match the individual that carries it: what is
    known of that is its class, isQAtype and hasValue. Where the schema has more to say (class expressions, properties
    related to these), the attribute counts as one with an effect.
    """
    iri = base.model.attributes[attribute]
    measured = base.model.measurements[attribute]
    triples = base.content.triples
    designs = base.model.estimated if functions is None else itertools.chain(*map(base.designs, functions))
    if measured.own or has_expressions(base) or any(attribute in base.model.estimated[name] for name in designs):
        return True
    related = ("subPropertyOf", "inverseOf", "equivalentProperty")
    if any(
        (predicate == IS_QA_TYPE and value == iri and functions is None)
        or (predicate.endswith(related) and (subject in _CARRIED or value in _CARRIED))
        for subject, predicate, value in triples
    ):
        return True
    # The classes of the individual: QAvalue, what the domains of its properties say, and all above.
    domains = {str(o) for s, p, o in triples if p == RDFS + "domain" and s in _CARRIED}
    above = ((s, str(o)) for s, p, o in triples if p in (RDFS + "subClassOf", OWL + "equivalentClass"))
    classes = reached({TOMASYS + "QAvalue", OWL + "Thing", *domains}, above)
    return any(_can_match(rule, iri, measured.iri, classes) for rule in base.content.enabled_rules)


def has_expressions(base: Ontology) -> bool:
    """Whether the ontologies have class expressions."""
    return any(f"<{OWL}{kind}>" in line for kind in ("Class", "Restriction") for line in base.content.structure)


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

    known = (*content.triples, *model.initial.get(one, ()), *model.initial.get(other, ()))
    own = {triple for triple in known if triple[0] in swap or triple[2] in swap}
    return set(map(swapped, own)) == own


def component_statuses(base: Ontology) -> tuple[str, ...]:
    """Values of c_status to look at: what the thruster monitor reports, and what enabled rules ask for."""
    asked = texts_of((atom for rule in base.content.enabled_rules for atom in rule.body), C_STATUS)
    return tuple(sorted({*asked, FAILED, RECOVERED}))


@dataclass(frozen=True, slots=True)
class ComponentReports:
    """What components report; stands for all reports that differ by an exchange of interchangeable components.

    Attributes:
        components: (component, c_status), the first ones of each group of interchangeable components, by name.
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
        yield ComponentReports(tuple(sorted(components)), combinations)


def _counts(kinds: int, most: int) -> list[tuple[int, ...]]:
    """How many components report each status."""
    found = [numbers for numbers in itertools.product(range(most + 1), repeat=kinds) if sum(numbers) <= most]
    return sorted(found, key=lambda numbers: (sum(numbers), [-number for number in numbers]))


@dataclass(frozen=True)
class PolicySpace:
    """What a policy tells apart.

    Attributes:
        attributes: quality attributes whose measured values have an effect, by name.
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
    """Quality attributes of the ontologies that the scenario measures, by name."""
    return sorted(name for name in settings.measured if name in base.quality_attributes)


@dataclass(frozen=True)
class Dependence:
    """What decisions can depend on.

    Attributes:
        attributes: by function, the quality attributes whose measured values can matter for its decision.
        regions: by attribute, the places that a measured value can have; None where any two values may be told apart.
    """

    attributes: Mapping[str, frozenset[str]]
    regions: Mapping[str, Regions] | None

    @classmethod
    def of(cls, base: Ontology, space: PolicySpace) -> Dependence:
        """Find out from ontologies and rules, for the attributes of a space."""
        return cls(
            {
                function: frozenset(name for name in space.attributes if has_effect(base, name, [function]))
                for function in {*base.functions, *space.functions}
            },
            _regions(base, space.attributes),
        )

    def places(self, measured: Iterable[tuple[str, Decimal]]) -> dict[str, Hashable]:
        """By attribute, what of a measured value a decision can depend on."""
        return {name: value if self.regions is None else self.regions[name].region(value) for name, value in measured}


def _regions(base: Ontology, attributes: tuple[str, ...]) -> dict[str, Regions] | None:
    """The regions of each attribute's values, where rules compare them with numbers of that attribute only."""
    known = base.model.attributes
    if not known.keys() >= {*attributes} or not regions_of(base).is_sound or not _is_plain(base):
        return None
    measured = {known[name] for name in attributes}
    numbers = {iri: set(_values(base, iri)) for iri in measured}
    for rule in base.content.enabled_rules:
        for one, other in _compared(rule):
            concerned = measured & (one | other)
            if _ANY in one | other:
                if not (_are_numbers(one) or _are_numbers(other)):
                    return None
                concerned = measured
            elif len(concerned) > 1:
                return None
            for attribute in concerned:
                for each in one | other:
                    numbers[attribute] |= {each} if isinstance(each, Decimal) else _values(base, each)
    return {name: Regions(tuple(sorted(numbers[known[name]])), ()) for name in attributes}


def _values(base: Ontology, attribute: str) -> set[Decimal]:
    """The numbers that the ontologies give of a quality attribute."""
    triples = base.content.triples
    typed = {subject for subject, predicate, value in triples if predicate == IS_QA_TYPE and value == attribute}
    values = (value for subject, predicate, value in triples if predicate == HAS_VALUE and subject in typed)
    return {Decimal(value.text.strip()) for value in values if isinstance(value, Lit)}


def _are_numbers(side: _Side) -> bool:
    return all(isinstance(each, Decimal) for each in side)


def _compared(rule: Rule) -> Iterator[tuple[_Side, _Side]]:
    """Both sides of each comparison of values in a rule; a variable that is read twice compares what it reads."""
    types = {
        atom.arguments[0]: atom.arguments[1].iri
        for atom in rule.body
        if atom.predicate == IS_QA_TYPE and isinstance(atom.arguments[1], Named)
    }
    read: dict[Term, list[_Side]] = {}
    for atom in rule.body:
        if atom.kind == "data":
            here = types.get(atom.arguments[0], _ANY) if atom.predicate == HAS_VALUE else _ANY
            read.setdefault(atom.arguments[1], []).append(frozenset({here}))
    for term, sides in read.items():
        yield from itertools.combinations([*sides, *_number(term)], 2)
    for atom in rule.body:
        if atom.predicate in COMPARISONS:
            sides = [frozenset[str | Decimal]().union(*read.get(term, ()), *_number(term)) for term in atom.arguments]
            yield from itertools.combinations(sides, 2)


def _number(term: Term) -> list[_Side]:
    """A literal as a side of a comparison; none where it is no number, as it never equals one."""
    try:
        return [frozenset({exact(term.text.strip())})] if isinstance(term, Lit) else []
    except KnowledgeError:
        return []


def _is_plain(base: Ontology) -> bool:
    """Whether nothing but rules that compare can relate a value to others: no axiom, and no rule that asserts one."""
    triples = base.content.triples
    schema = {(s, p, o) for s, p, o in triples if s in _OF_VALUES or o in _OF_VALUES} - _FUNCTIONAL
    functional = {s for s, p, o in triples if p == RDF_TYPE and o == OWL + "FunctionalProperty"}
    own = [(s, p) for s, p, o in triples if p in functional and isinstance(o, str)]
    atoms = [atom for rule in base.content.enabled_rules for atom in rule.atoms]
    heads = [atom for rule in base.content.enabled_rules for atom in rule.head]
    return not (
        any((p, None) not in _HARMLESS and (p, o) not in _HARMLESS for _, p, o in schema)
        or any(p == SAME or o == OWL + "InverseFunctionalProperty" for _, p, o in triples)
        or len({*own}) < len(own)
        or has_expressions(base)
        or any(measurement.own for measurement in base.model.measurements.values())
        or any(atom.kind in ("same", "different") for atom in atoms)
        or any(
            atom.predicate in _OF_VALUES or (atom.kind == "object" and atom.predicate in functional) for atom in heads
        )
    )
