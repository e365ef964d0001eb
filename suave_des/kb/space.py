"""Situations in which a knowledge base decides: all kinds that a policy tells apart, and what is
decided in one.

States are places of measured values, reports of components and groundings. Only the number of
components with a status counts where ontologies and rules treat components alike. Quality
attributes are independent of one another where every comparison in a rule is between values of one
of them: then a measured value counts by its place among the numbers of its own attribute, and not
at all for functions whose designs expect no value of it. Where the schema or a rule has more to
say, every value counts, as it is.

A rule that only compares numbers cannot tell two values apart that compare alike with every number
in the knowledge base. So one value stands for each range between two numbers; equality with a
number is a range of its own.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from math import factorial, perm, prod
from typing import Any, Final

from suave_des.errors import InputError, KnowledgeError, shown
from suave_des.kb.states import LASTING, ManagingSettings
from suave_des.knowledge import rdf
from suave_des.knowledge.ontology import OPERATORS, Ontology
from suave_des.knowledge.rdf import Lit, Triple
from suave_des.knowledge.reasoner import Regions, regions_of
from suave_des.knowledge.rules import (
    COMPARISONS,
    SAME,
    Atom,
    Named,
    Rule,
    Term,
    Variable,
    mirrored,
    texts_of,
)
from suave_des.knowledge.state import NO_GROUNDING, STAYS, Fact, KnowledgeState, Reasoning, exact
from suave_des.monitor.diagnostics import FAILED, RECOVERED

INCONSISTENT: Final = "inconsistent"


@dataclass(frozen=True)
class Situation:
    """A situation in which a knowledge base decides.

    Attributes:
        facts: assertions in addition to those of the state.
        ranges: words for the region that the state stands for; empty for a single state.
    """

    state: KnowledgeState
    facts: tuple[Triple, ...] = ()
    ranges: str = ""


@dataclass(frozen=True)
class Outcome:
    """What follows and is decided in a situation.

    Attributes:
        reasoning: what is inferred and planned; None where the situation contradicts itself.
        contradiction: what contradicts what.
    """

    reasoning: Reasoning | None
    contradiction: str = ""

    @property
    def inferred(self) -> frozenset[Fact]:
        """What was inferred; nothing where the situation contradicts itself."""
        return frozenset() if self.reasoning is None else self.reasoning.inference.facts

    @property
    def known(self) -> frozenset[Fact]:
        """What was asserted or inferred; nothing where the situation contradicts itself."""
        return (
            self.inferred
            if self.reasoning is None
            else self.inferred | self.reasoning.inference.asserted
        )

    @property
    def changes(self) -> dict[str, str]:
        """New design of each function whose grounding changes, or "none left"."""
        return {} if self.reasoning is None else self.reasoning.changes

    @cached_property
    def statuses(self) -> tuple[str, ...]:
        """What is inferred of objectives and groundings, in words, sorted."""
        return () if self.reasoning is None else tuple(sorted(self.reasoning.inference.statuses))

    def choice(self, function: str) -> str:
        """What happens to a function's grounding: a design, "stays", "none left" or
        "inconsistent".
        """
        return INCONSISTENT if self.reasoning is None else self.changes.get(function, STAYS)


Decide = Callable[[Situation], Outcome]
OnCount = Callable[[int, int], object]


def differing_decisions(one: Outcome, other: Outcome) -> Iterator[tuple[str, str, str]]:
    """Function, and what happens to its grounding in one outcome and in another, where that
    differs.
    """
    for name in sorted({*one.changes, *other.changes}):
        if one.choice(name) != other.choice(name):
            yield name, one.choice(name), other.choice(name)


def difference(one: Outcome, other: Outcome) -> str:
    """Tell the first difference in what follows and is decided, in words about the second; empty:
    none.
    """
    if (one.reasoning is None) != (other.reasoning is None):
        return (
            "it contradicts itself"
            if other.reasoning is None
            else "it no longer contradicts itself"
        )
    for name, before, after in differing_decisions(one, other):
        return f"{name}: {after}, not {before}"
    for missing in sorted(map(str, one.inferred - other.inferred)):
        return f"{missing} does not follow"
    for more in sorted(map(str, other.inferred - one.inferred)):
        return f"{more} follows"
    return (
        "" if one.statuses == other.statuses else f"statuses: {'; '.join(other.statuses) or 'none'}"
    )


def compare(
    one: Decide, other: Decide, situations: Iterable[Situation]
) -> Iterator[tuple[Situation, Outcome, Outcome]]:
    """Find the situations in which two knowledge bases conclude or decide differently, with both
    outcomes.
    """
    for situation in situations:
        before, after = one(situation), other(situation)
        if before is not after and difference(before, after):
            yield situation, before, after


#: Beyond this many kinds of states a policy is refused: at a millisecond and a half each it would
# take ten minutes.
LARGEST: Final = 400_000
_SIGN: Final = re.compile("([<>]=?)")
_MISSING: Final = "not measured"


@dataclass(frozen=True)
class Scale:
    """The places that a measured value can have among numbers: 0 is no measurement, then ranges and
    numbers take turns.

    >>> Scale((Decimal("1.25"), Decimal("2.25"))).text(2, 3)  # the numbers are ascending
    '1.25 <= . < 2.25'
    """

    numbers: tuple[Decimal, ...]

    def __len__(self) -> int:
        return 2 * len(self.numbers) + 2

    def place(self, value: Decimal | None) -> int:
        """The place of a measured value; None: it is not measured."""
        return 0 if value is None else Regions(self.numbers, ()).region(value) + 1

    def low(self, place: int) -> Decimal | None:
        """The lower end of a place; None: it has none."""
        return self.numbers[place // 2 - 1] if place > 1 else None

    def _high(self, place: int) -> Decimal | None:
        return self.numbers[(place - 1) // 2] if 0 < place < len(self) - 1 else None

    def text(self, first: int, last: int | None = None) -> str:
        """Neighbouring places in words: "not measured", "1.25", "< 1.25", ">= 1.25", "1.25 <= . <
        2.25".
        """
        last = first if last is None else last
        if first == 0:
            return _MISSING if last == 0 else f"{_MISSING} or {self.text(1, last)}"
        low, high = self.low(first), self._high(last)
        if low is not None and low == high:
            return str(low)
        below = "" if high is None else f"{'<' if last % 2 else '<='} {high}"
        if low is None:
            return below or "any"
        return (
            f"{low} {'<' if first % 2 else '<='} . {below}"
            if below
            else f"{'>' if first % 2 else '>='} {low}"
        )

    def value(self, place: int, rank: int = 0, ranks: int = 1) -> Decimal | None:
        """A value there, above 0 if there is one; in a range the `rank`-th of `ranks` ascending
        ones.
        """
        low, high = self.low(place), self._high(place)
        if place % 2 == 0:
            return low
        if low is None:
            low = Decimal(0) if high is None or high > 0 else high - 1
        high = low + 1 if high is None else high
        return exact(low + (high - low) * (rank + 1) / Decimal(2 ** ranks.bit_length()))

    def values(self, places: Sequence[int]) -> Iterator[tuple[Decimal | None, ...]]:
        """Values of several attributes at given places, for every order that the values can have.

        Values at different places are ordered by these; those in the same range can be in any
        order, and equal.
        """
        groups = [
            [n for n, each in enumerate(places) if each == place]
            for place in dict.fromkeys(places)
            if place % 2
        ]
        for ranks in itertools.product(*(_weak_orders(len(group)) for group in groups)):
            values = list(map(self.value, places))
            for group, order in zip(groups, ranks, strict=True):
                for number, rank in zip(group, order, strict=True):
                    values[number] = self.value(places[number], rank, len(group))
            yield tuple(values)


def _weak_orders(size: int) -> Iterator[tuple[int, ...]]:
    """All ways to rank things, ties allowed: ranks from 0 without gaps."""
    ranks = itertools.product(range(size), repeat=size)
    return (each for each in ranks if set(each) == set(range(max(each) + 1)))


#: Measured values that a test is about: all that compare as given with numbers; empty: no
# measurement.
Region = tuple[tuple[str, Decimal], ...]


def is_in(region: Region, value: Decimal | None) -> bool:
    """Whether a measured value, None for none, is in a region."""
    if value is None or not region:
        return value is None and not region
    return all(OPERATORS[sign](value, number) for sign, number in region)


def parse_region(text: str) -> Region | None:
    """Read a region as `kb policy` writes it, such as "1.25 <= . < 2.25"; None for what is none,
    such as a number.

    Raises:
        InputError: there is no number in it.
    """
    text = text.strip()
    if text == _MISSING:
        return ()
    if not {"<", ">"} & {*text}:
        return None
    parts = [part.strip() for part in _SIGN.split(f". {text}" if text[0] in "<>" else text)]
    sides = list(zip(parts[::2], parts[1::2], parts[2::2], strict=False))
    remedy = 'such as "< 1.25", ">= 3.25", "1.25 <= . < 2.25" or "not measured"'
    try:
        region = tuple(
            (sign, exact(right)) if left == "." else (mirrored(sign), exact(left))
            for left, sign, right in sides
        )
    except KnowledgeError:
        raise InputError(f"{shown(text)} is not a region", remedy=remedy) from None
    scale = Scale(tuple(sorted({number for _, number in region})))
    is_empty = not any(is_in(region, scale.value(at)) for at in range(1, len(scale)))
    if is_empty or any((left == ".") == (right == ".") for left, _, right in sides):
        raise InputError(f"no number is in the region {shown(text)}", remedy=remedy)
    return region


def measurements_in(
    base: Ontology, regions: Mapping[str, Region]
) -> Iterator[tuple[dict[str, Decimal | None], str]]:
    """Measured values in the regions of attributes, one for each kind that comparing rules tell
    apart, with words.
    """
    ends = {number for region in regions.values() for _, number in region}
    scale = Scale(tuple(sorted({*regions_of(base).thresholds, *ends})))
    inside = (
        [at for at in range(len(scale)) if is_in(region, scale.value(at))]
        for region in regions.values()
    )
    for places in itertools.product(*inside):
        words = ", ".join(
            f"{name} {scale.text(at)}" for name, at in zip(regions, places, strict=True)
        )
        for values in scale.values(places):
            yield dict(zip(regions, values, strict=True)), words


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
    iri = base.model.attributes[attribute]
    measured = base.model.measurements[attribute]
    triples = base.content.triples
    designs = (
        base.model.estimated
        if functions is None
        else itertools.chain(*map(base.designs, functions))
    )
    is_expected = any(attribute in base.model.estimated[name] for name in designs)
    if is_expected or base.model.own[measured] or has_expressions(base):
        return True
    related = ("subPropertyOf", "inverseOf", "equivalentProperty")
    if any(
        (predicate == rdf.IS_QA_TYPE and value == iri and functions is None)
        or (predicate.endswith(related) and (subject in _CARRIED or value in _CARRIED))
        for subject, predicate, value in triples
    ):
        return True
    # The classes of the individual: QAvalue, what the domains of its properties say, and all above.
    domains = {str(o) for s, p, o in triples if p == rdf.RDFS + "domain" and s in _CARRIED}
    above = (
        (s, str(o))
        for s, p, o in triples
        if p in (rdf.RDFS + "subClassOf", rdf.OWL + "equivalentClass")
    )
    classes = rdf.reached({rdf.TOMASYS + "QAvalue", rdf.OWL + "Thing", *domains}, above)
    return any(_can_match(rule, iri, measured, classes) for rule in base.content.enabled_rules)


def has_expressions(base: Ontology) -> bool:
    """Whether the ontologies have class expressions."""
    return any(
        f"<{rdf.OWL}{kind}>" in line
        for kind in ("Class", "Restriction")
        for line in base.content.structure
    )


def _can_match(rule: Rule, attribute: str, measured: str, classes: set[str]) -> bool:
    """Whether a variable of a rule, or a name in it, can stand for the individual of a measured
    value.
    """

    def could_hold(atom: Atom, term: Variable) -> bool:
        if atom.arguments[0] != term:
            return False
        if atom.predicate == rdf.IS_QA_TYPE:
            return isinstance(atom.arguments[-1], Variable) or atom.arguments[-1] == Named(
                attribute
            )
        return (
            atom.predicate in classes if atom.kind == "class" else atom.predicate == rdf.HAS_VALUE
        )

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
    """Group the components that can be exchanged: doing so maps ontologies and rules onto
    themselves.
    """
    groups: dict[str, list[str]] = {}
    for name in base.model.components:
        first = next((each for each in groups if _exchangeable(base, each, name)), name)
        groups.setdefault(first, []).append(name)
    return tuple(map(tuple, groups.values()))


def _exchangeable(base: Ontology, one: str, other: str) -> bool:
    model, content = base.model, base.content
    a, b = model.components[one], model.components[other]
    rules = (
        Named(iri) in atom.arguments
        for iri in (a, b)
        for rule in content.enabled_rules
        for atom in rule.atoms
    )
    if any(rules) or any(f"<{iri}>" in line for iri in (a, b) for line in content.structure):
        return False
    swap: dict[str | Lit, str] = {a: b, b: a}
    known = (*content.triples, *model.own[a], *model.own[b])
    own = {triple for triple in known if triple[0] in swap or triple[2] in swap}
    return own == {
        (swap.get(subject, subject), name, swap.get(value, value)) for subject, name, value in own
    }


#: (component, c_status) of those that report.
Reports = tuple[tuple[str, str], ...]


def component_reports(
    groups: Sequence[Sequence[str]], statuses: Sequence[str], most: int
) -> dict[Reports, int]:
    """All that at most so many components can report, up to an exchange in their group, fewest
    reports first.

    Returns:
        reports of the first ones of each group of interchangeable components, with the number for
        which they stand.
    """
    ways = (
        [
            each
            for count in range(min(most, len(group)) + 1)
            for each in itertools.combinations_with_replacement(statuses, count)
        ]
        for group in groups
    )
    found: dict[Reports, int] = {}
    for chosen in itertools.product(*ways):
        if sum(map(len, chosen)) <= most:
            both = list(zip(groups, chosen, strict=True))
            components = sorted(
                pair for group, named in both for pair in zip(group, named, strict=False)
            )
            alike = prod(
                factorial(number) for named in chosen for number in Counter(named).values()
            )
            found[tuple(components)] = (
                prod(perm(len(group), len(named)) for group, named in both) // alike
            )
    return found


@dataclass(frozen=True)
class PolicySpace:
    """What a policy tells apart.

    Attributes:
        attributes: quality attributes whose measured values have an effect, by name.
        numbers: ends of the ranges, ascending.
        alike: groups of interchangeable components.
        statuses: that components can report.
        functions: that have a design, if only in one of two knowledge bases; without one there is
            nothing to ask for.
    """

    attributes: tuple[str, ...]
    numbers: tuple[Decimal, ...]
    alike: tuple[tuple[str, ...], ...]
    statuses: tuple[str, ...]
    functions: tuple[str, ...] = ()

    @classmethod
    def of(cls, base: Ontology, settings: ManagingSettings) -> PolicySpace:
        """What can have an effect in these ontologies."""
        attributes = tuple(
            name for name in measured_attributes(base, settings) if has_effect(base, name)
        )
        functions = tuple(name for name in base.functions if base.designs(name))
        # What the thruster monitor reports, and what enabled rules ask for.
        asked = texts_of(
            (atom for rule in base.content.enabled_rules for atom in rule.body), rdf.C_STATUS
        )
        statuses = tuple(sorted({*asked, FAILED, RECOVERED}))
        return cls(
            attributes,
            regions_of(base).thresholds,
            interchangeable_components(base),
            statuses,
            functions,
        )

    @property
    def scale(self) -> Scale:
        """The places of measured values."""
        return Scale(self.numbers)

    def common(self, other: PolicySpace) -> PolicySpace:
        """What has an effect in either; components are alike only if they are so in both that have
        them.
        """
        groups: dict[tuple[int, ...], list[str]] = {}
        for name in dict.fromkeys(name for group in (*self.alike, *other.alike) for name in group):
            places = (
                next((n for n, group in enumerate(s.alike) if name in group), -1)
                for s in (self, other)
            )
            groups.setdefault(tuple(places), []).append(name)
        return PolicySpace(
            tuple(sorted({*self.attributes, *other.attributes})),
            tuple(sorted({*self.numbers, *other.numbers})),
            tuple(map(tuple, groups.values())),
            tuple(sorted({*self.statuses, *other.statuses})),
            tuple(sorted({*self.functions, *other.functions})),
        )


def measured_attributes(base: Ontology, settings: ManagingSettings) -> list[str]:
    """Quality attributes of the ontologies that the scenario measures, by name."""
    return sorted(name for name in settings.measured if name in base.model.attributes)


#: One side of a comparison: IRIs of quality attributes whose values it can be, and numbers; _ANY:
# of any attribute.
_Side = frozenset[str | Decimal]
_ANY: Final = ""


def _regions(base: Ontology, attributes: tuple[str, ...]) -> dict[str, Regions] | None:
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
            concerned = measured & (one | other)
            if _ANY in one | other:
                if not any(
                    all(isinstance(each, Decimal) for each in side) for side in (one, other)
                ):
                    return None
                concerned = measured
            elif len(concerned) > 1:
                return None
            for attribute in concerned:
                for each in one | other:
                    numbers[attribute] |= (
                        {each} if isinstance(each, Decimal) else _values(base, each)
                    )
    return {name: Regions(tuple(sorted(numbers[known[name]])), ()) for name in attributes}


def _values(base: Ontology, attribute: str) -> set[Decimal]:
    """The numbers that the ontologies give of a quality attribute."""
    triples = base.content.triples
    typed = {
        subject
        for subject, predicate, value in triples
        if predicate == rdf.IS_QA_TYPE and value == attribute
    }
    values = (
        value
        for subject, predicate, value in triples
        if predicate == rdf.HAS_VALUE and subject in typed
    )
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
    triples = base.content.triples
    schema = {(s, p, o) for s, p, o in triples if s in _OF_VALUES or o in _OF_VALUES} - _FUNCTIONAL
    functional = {
        s for s, p, o in triples if p == rdf.RDF_TYPE and o == rdf.OWL + "FunctionalProperty"
    }
    own = [(s, p) for s, p, o in triples if p in functional and isinstance(o, str)]
    atoms = [atom for rule in base.content.enabled_rules for atom in rule.atoms]
    heads = [atom for rule in base.content.enabled_rules for atom in rule.head]
    return not (
        any((p, None) not in _HARMLESS and (p, o) not in _HARMLESS for _, p, o in schema)
        or any(p == SAME or o == rdf.OWL + "InverseFunctionalProperty" for _, p, o in triples)
        or len({*own}) < len(own)
        or has_expressions(base)
        or any(base.model.own[measurement] for measurement in base.model.measurements.values())
        or any(atom.kind in ("same", "different") for atom in atoms)
        or any(
            atom.predicate in _OF_VALUES or (atom.kind == "object" and atom.predicate in functional)
            for atom in heads
        )
    )


@dataclass(frozen=True)
class States:
    """Every kind of state that a space tells apart: any measured values, with any reports and any
    task.

    Attributes:
        measured: (attribute, value) of those attributes that are measured.
        reports: what components report, with the number of states for which each stands.
        tasks: states with objectives and groundings only.
    """

    space: PolicySpace
    measured: tuple[tuple[tuple[str, Decimal], ...], ...]
    reports: Mapping[Reports, int]
    tasks: tuple[KnowledgeState, ...]

    @classmethod
    def of(
        cls, base: Ontology, settings: ManagingSettings, max_failed: int, space: PolicySpace
    ) -> States:
        """Find the kinds of states of a knowledge base in which at most `max_failed` components
        report a status.

        Raises:
            InputError: max_failed is negative, or there would be too many states.
        """
        if max_failed < 0:
            raise InputError(f"{max_failed} components cannot fail", remedy="give 0 or more")
        reports = component_reports(space.alike, space.statuses, max_failed)
        tasks = tuple(_tasks(base, settings, space))
        scale, attributes = space.scale, space.attributes
        total = len(scale) ** len(attributes) * len(reports) * len(tasks)
        # else so many already that it does not matter how many values a range has
        if total <= LARGEST:
            measured = tuple(
                tuple(
                    (name, each)
                    for name, each in zip(attributes, values, strict=True)
                    if each is not None
                )
                for places in itertools.product(range(len(scale)), repeat=len(attributes))
                for values in scale.values(places)
            )
            total = len(measured) * len(reports) * len(tasks)
        if total > LARGEST:
            remedy = f"at most {LARGEST:,}; lower --max-failed, or give a scenario with fewer measured attributes"
            raise InputError(
                f"the policy has {total:,} kinds of states, which is too many", remedy=remedy
            )
        return cls(space, measured, reports, tasks)

    def __len__(self) -> int:
        return len(self.measured) * len(self.reports) * len(self.tasks)

    def __iter__(self) -> Iterator[KnowledgeState]:
        """One state of each kind; those that differ only in their task follow one another."""
        for values, reports, task in itertools.product(self.measured, self.reports, self.tasks):
            yield KnowledgeState(task.objectives, task.groundings, reports, values)

    @cached_property
    def functions(self) -> tuple[str, ...]:
        """All that have an objective in a state, by name."""
        return tuple(sorted({each.function for task in self.tasks for each in task.objectives}))

    def frame(self, states: Sequence[KnowledgeState]) -> Any:
        """Describe some of the states, one in each row.

        Returns:
            a data frame: the place of each attribute's value on the scale; the `components` that
            report; how many `states` it stands for, as interchangeable components count one by one;
            and of each function with an objective the grounding `_now`, else empty.
        """
        import pandas  # an inference alone needs none, the larger part of its start

        columns: dict[str, list[Any]] = {}
        for name in self.space.attributes:
            columns[name] = [
                self.space.scale.place(dict(state.measurements).get(name)) for state in states
            ]
        columns["components"] = [
            "; ".join(f"{name}={status}" for name, status in each.components) for each in states
        ]
        columns["states"] = [self.reports[state.components] for state in states]
        for name in self.functions:
            asked = (any(each.function == name for each in state.objectives) for state in states)
            now = (state.grounded(name) or NO_GROUNDING for state in states)
            columns[f"{name}_now"] = [
                design if is_asked else "" for design, is_asked in zip(now, asked, strict=True)
            ]
        return pandas.DataFrame(columns)

    def shared(self, other: States) -> States:
        """The states that another knowledge base with the same space has, too."""
        return replace(self, tasks=tuple(task for task in self.tasks if task in other.tasks))


def add_decisions(
    cases: Any, states: States, outcomes: Sequence[Outcome], suffix: str = ""
) -> None:
    """Add to a frame of states the inferred `statuses`, and what happens to the grounding of each
    function, `_then`.
    """
    cases[f"statuses{suffix}"] = ["; ".join(outcome.statuses) for outcome in outcomes]
    for name in states.functions:
        then = map(Outcome.choice, outcomes, itertools.repeat(name))
        cases[f"{name}_then{suffix}"] = [
            words if now else "" for words, now in zip(then, cases[f"{name}_now"], strict=False)
        ]


def _tasks(
    base: Ontology, settings: ManagingSettings, space: PolicySpace
) -> Iterator[KnowledgeState]:
    solvable = [name for name in base.functions if base.designs(name) or name in space.functions]
    lasting = [name for name in LASTING if name in solvable]
    for asked in [(*lasting, name) for name in solvable if name not in lasting] or [tuple(lasting)]:
        for designs in itertools.product(*((None, *base.designs(name)) for name in asked)):
            groundings = {
                name: design
                for name, design in zip(asked, designs, strict=True)
                if design is not None
            }
            yield settings.state(dict.fromkeys(asked), groundings)


def kind_of(base: Ontology, space: PolicySpace) -> Callable[[KnowledgeState], Hashable]:
    """Make a function that returns what the decision in a state can depend on: the same for all
    decided alike.
    """
    functions = {*base.functions, *space.functions}
    effects = {
        each: [name for name in space.attributes if has_effect(base, name, [each])]
        for each in functions
    }
    regions = _regions(base, space.attributes)

    def kind(state: KnowledgeState) -> Hashable:
        relevant = {name for each in state.objectives for name in effects[each.function]}
        known = ((name, value) for name, value in state.measurements if name in relevant)
        seen = tuple(
            (name, value if regions is None else regions[name].region(value))
            for name, value in known
        )
        return state.objectives, state.groundings, state.components, seen

    return kind


def decide_all(base: Ontology, states: States, decide: Decide, on_count: OnCount) -> Decide:
    """Decide every state; those that differ in nothing on which a decision can depend, once.

    Args:
        base: the ontologies and rules.
        states: to decide.
        decide: concludes what follows and is decided in a situation.
        on_count: called with how many kinds of states have been inferred, first 0, and how many
            have to be.

    Returns:
        what is decided in each of the states; a contradiction is told with the values of another
        one of its kind.

    Raises:
        KnowledgeError: there is nothing to decide, or the reasoner takes too long.
    """
    if not any(map(base.designs, base.functions)):
        problem = "no function has a function design, so there is nothing to decide"
        remedy = "give an ontology that uses TOMASys as suave.owl does"
        raise KnowledgeError(problem, file=", ".join(map(str, base.files)), remedy=remedy)
    kind, different, decided = (
        kind_of(base, states.space),
        dict[Hashable, KnowledgeState](),
        dict[Hashable, Outcome](),
    )
    for state in states:
        different.setdefault(kind(state), state)
    on_count(0, len(different))
    for key, state in different.items():
        decided[key] = decide(Situation(state))
        on_count(len(decided), len(different))
    return lambda situation: decided[kind(situation.state)]
