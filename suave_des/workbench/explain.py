"""Explain why a fact follows, why a function design is chosen or not, and why a state contradicts itself."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import islice
from operator import eq, ge, gt, le, lt, ne
from typing import Final

from suave_des.errors import InputError, KnowledgeError, did_you_mean, shown
from suave_des.knowledge.deliberation import Conclusion, Deliberation
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.planning import performance
from suave_des.knowledge.rdf import Lit, Triple, facts_of, value_of
from suave_des.knowledge.reasoners import make_reasoner
from suave_des.knowledge.rules.syntax import Atom, Named, Rule, Variable
from suave_des.knowledge.rules.writer import write_atom
from suave_des.knowledge.state import Decision, Fact, KnowledgeState, Value
from suave_des.knowledge.vocabulary import SWRLB, objective_name
from suave_des.workbench.derivations import FACT_KINDS, Binding, Clash, Derivation, partial_matches
from suave_des.workbench.tracing import Tracer

#: Rules that are named for a fact that does not follow.
NEAREST: Final = 3
#: Ways to match a rule's body that are looked at.
MOST_WAYS: Final = 20_000
_COMPARE: Final[Mapping[str, Callable[[Decimal, Decimal], bool]]] = {
    SWRLB + name: compare
    for name, compare in (
        *(("equal", eq), ("notEqual", ne), ("lessThan", lt)),
        *(("lessThanOrEqual", le), ("greaterThan", gt), ("greaterThanOrEqual", ge)),
    )
}
_WHY: Final = re.compile(r"why\s+(not\s+)?([\w.-]+)\s*\??", re.IGNORECASE)
_ATOM: Final = re.compile(r"([^\s(]+)\s*\(\s*([^,()]+?)\s*(?:,\s*(.+?)\s*)?\)")
_FORMS: Final = (
    'a fact such as fg_status(fg_spiral_high, IN_ERROR_NFR), "why fd_spiral_low?" or "why not fd_spiral_high?"'
)


@dataclass(frozen=True)
class Candidate:
    """What the planner made of a function design.

    Attributes:
        design: its name.
        verdict: "chosen", "left out" or "not the best".
        reason: why.
        because: how the facts follow for which it is left out.
    """

    design: str
    verdict: str
    reason: str
    because: tuple[Derivation, ...] = ()


@dataclass(frozen=True)
class DecisionExplanation:
    """Why a function gets a design.

    Attributes:
        function: which function.
        answer: in one sentence.
        because: how the facts follow that call for adaptation.
        candidates: all designs of the function, by name; none when there is nothing to decide.
    """

    function: str
    answer: str
    because: tuple[Derivation, ...] = ()
    candidates: tuple[Candidate, ...] = ()

    def lines(self) -> Iterator[str]:
        """The answer, and below it the reasons and the verdict on each design."""
        yield f"{self.function}: {self.answer}"
        for derivation in self.because:
            yield "  adapted because"
            yield from derivation.lines("    ")
        for candidate in self.candidates:
            yield f"  {candidate.design}: {candidate.verdict}: {candidate.reason}"
            for derivation in candidate.because:
                yield from derivation.lines("    ")


@dataclass(frozen=True)
class Explanation:
    """The answer to a question about a state.

    Attributes:
        state: the state.
        facts: how facts follow.
        decisions: why functions get their designs.
        contradiction: for a state that contradicts itself, what Pellet says about it.
        rules: the rules that take part in the contradiction.
        clashes: the properties that would have two values.
    """

    state: KnowledgeState
    facts: tuple[Derivation, ...] = ()
    decisions: tuple[DecisionExplanation, ...] = ()
    contradiction: str | None = None
    rules: tuple[str, ...] = ()
    clashes: tuple[Clash, ...] = ()

    def __str__(self) -> str:
        """As `kb explain` prints it."""
        return "\n".join(self.lines())

    def lines(self) -> Iterator[str]:
        """All of it, one fact or decision after the other."""
        if self.contradiction is not None:
            yield f"contradiction: {self.contradiction}"
            yield f"rules in it: {', '.join(self.rules) or 'none'}"
            for clash in self.clashes:
                yield f"{clash.property} of {clash.subject} would have {len(clash.sides)} values:"
                for side in clash.sides:
                    yield from side.lines("  ")
            return
        for derivation in self.facts:
            yield from derivation.lines()
        for decision in self.decisions:
            yield from decision.lines()
        if not self.facts and not self.decisions:
            yield "nothing is inferred, and nothing is decided"


def explain(base: Ontology, state: KnowledgeState, question: str, improves_exceeded: bool) -> Explanation:
    """Answer a question about a state; see KnowledgeBase.explain."""
    why, atom = _WHY.fullmatch(question.strip()), _ATOM.fullmatch(question.strip())
    if question.strip() and not why and not atom:
        raise InputError(f"{shown(question)} is not a question about a state", remedy=_FORMS)
    tracer = Tracer(base, state)
    reasoner = make_reasoner("pellet", base, terms=base.content.all_terms())
    try:
        conclusion = Deliberation(base, reasoner).analyze_and_plan(state, improve_exceeded=improves_exceeded)
    except KnowledgeError:
        problem, clashes, rules = tracer.clashes()
        if not rules and not clashes:
            raise  # not a contradiction: the message has all there is to say
        return Explanation(state, contradiction=problem, clashes=clashes, rules=rules)
    explainer = _Explainer(base, conclusion, tracer)
    if atom:
        return Explanation(state, facts=(explainer.fact(*atom.groups()),))
    if why:
        return Explanation(state, decisions=(explainer.design(why.group(2), wanted=why.group(1) is None),))
    facts = tuple(tracer.derive(triple) for triple in explainer.inferred())
    return Explanation(state, facts, tuple(explainer.decision(each) for each in conclusion.plan.decisions))


class _Explainer:
    """Finds the facts behind a conclusion, and how they follow."""

    def __init__(self, base: Ontology, conclusion: Conclusion, tracer: Tracer) -> None:
        self.base = base
        self.conclusion = conclusion
        self.tracer = tracer
        self.triples: dict[Fact, Triple] = {}
        for triple in sorted(tracer.entailed(), key=lambda each: (each not in tracer.asserted, str(each))):
            for fact in facts_of([triple], base.names):
                self.triples.setdefault(fact, triple)

    def inferred(self) -> list[Triple]:
        facts = self.conclusion.inference.facts
        return [self.triples[fact] for fact in sorted(facts, key=str)]

    def fact(self, property_name: str, subject: str, value: str | None) -> Derivation:
        """How a fact follows that is written as an atom; an atom of a class has no value."""
        name, wanted = ("type", property_name) if value is None else (property_name, value.strip("\"'"))
        for fact, triple in self.triples.items():
            if fact.property == name and fact.subject == subject and _value_text(fact.value) == wanted:
                return self.tracer.derive(triple)
        known = sorted({fact.subject for fact in self.triples})
        if subject not in known:
            raise InputError(f"there is nothing named {shown(subject)} in this state", remedy=_near(subject, known))
        there = sorted(
            _value_text(fact.value) for fact in self.triples if (fact.property, fact.subject) == (name, subject)
        )
        kinds = self.base.vocabulary.kinds.items()
        declared = {self.base.names.short(iri) for iri, kind in kinds if kind & {"object property", "data property"}}
        properties = sorted(declared | {fact.property for fact in self.triples})
        iri = next(triple[0] for fact, triple in self.triples.items() if fact.subject == subject)
        near = near_rules(self.base, name, iri, wanted, self.tracer.known)
        if not near and not there and value is not None and name not in properties:
            raise InputError(f"there is no property {shown(name)}", remedy=_near(name, properties))
        raise InputError(
            f"{property_name}({subject}{', ' + wanted if value is not None else ''}) does not follow in this state",
            remedy="; ".join([f"{name} of {subject}: {', '.join(there) or 'none'}", *map(str, near[:NEAREST])]),
        )

    def design(self, design: str, *, wanted: bool) -> DecisionExplanation:
        """Why, or why not, a function design."""
        functions = [name for name in self.base.functions if design in self.base.designs(name)]
        if not functions:
            known = [each for name in self.base.functions for each in self.base.designs(name)]
            raise InputError(f"there is no function design {shown(design)}", remedy=did_you_mean(design, known))
        function = functions[0]
        decisions = [each for each in self.conclusion.plan.decisions if each.function == function]
        if decisions:
            return self.decision(decisions[0], design, wanted=wanted)
        state = self.conclusion.inference.state
        if function not in {each.function for each in state.objectives}:
            return DecisionExplanation(function, f"nothing is decided: {function} has no objective in this state")
        present = state.grounded(function)
        return DecisionExplanation(
            function,
            f"nothing is decided: the objective of {function} calls for no adaptation, so {present or 'it'} stays",
        )

    def decision(self, decision: Decision, asked: str | None = None, *, wanted: bool = True) -> DecisionExplanation:
        """Why a decision is made; the answer begins with the design that was asked about."""
        candidates = tuple(self._candidate(decision, name) for name in self.base.designs(decision.function))
        answer = f"{decision.design}: {decision.reason}" if decision.design else decision.reason
        for each in candidates:
            if each.design == asked and each.verdict != "chosen":
                answer = f"{asked} is {each.verdict}: {each.reason}"
            elif each.design == asked and not wanted:
                answer = f"{asked} is chosen: {decision.reason}"
        return DecisionExplanation(decision.function, answer, tuple(self._call(decision.function)), candidates)

    def _call(self, function: str) -> Iterator[Derivation]:
        objective = objective_name(function)
        for fact in sorted(self.conclusion.inference.facts, key=str):
            if fact.subject == objective and fact.property in ("o_status", "o_updatable"):
                yield self.tracer.derive(self.triples[fact])

    def _candidate(self, decision: Decision, design: str) -> Candidate:
        if design == decision.design:
            return Candidate(design, "chosen", decision.reason)
        for rejection in decision.rejected:
            if rejection.design == design:
                return Candidate(
                    design, "left out", rejection.reason, tuple(self._objection(decision.function, design))
                )
        inference = self.conclusion.inference
        own = performance(self.base, inference, design)
        best = performance(self.base, inference, str(decision.design))
        if own == best:
            return Candidate(design, "not the best", f"performance {own}, as {decision.design}, which is first by name")
        return Candidate(design, "not the best", f"performance {own} < {best} of {decision.design}")

    def _objection(self, function: str, design: str) -> Iterator[Derivation]:
        """How the facts follow on which a design was left out, where the reasoner found them."""
        for fact in (
            Fact(design, "fd_realisability", False),
            Fact(design, "fd_error_log", objective_name(function)),
        ):
            if fact in self.triples:
                yield self.tracer.derive(self.triples[fact])


def _near(word: str, known: list[str]) -> str:
    return did_you_mean(word, known).partition("? ")[0] + "?" if len(known) > 40 else did_you_mean(word, known)


@dataclass(frozen=True)
class NearRule:
    """A rule that could conclude a fact, and does not.

    Attributes:
        rule: its name.
        fails: the first atom of its body that does not hold, as the rule writes it; of all ways to match those before
            it, with the one that comes furthest.
        bindings: what the variables stand for then.
        missing: number of atoms of the body from there on.
    """

    rule: str
    fails: str
    bindings: tuple[tuple[str, Value], ...]
    missing: int

    def __str__(self) -> str:
        """In one line."""
        bound = ", ".join(f"?{name} = {value}" for name, value in self.bindings)
        return f"rule {self.rule}: {self.fails} does not hold{f' with {bound}' if bound else ''}"


def near_rules(base: Ontology, name: str, subject: str, wanted: str, known: Sequence[Triple]) -> tuple[NearRule, ...]:
    """Find the rules whose head could assert a fact that does not follow, those that lack least first.

    Args:
        base: the ontologies.
        name: of the property, or "type".
        subject: IRI of the individual.
        wanted: the value, as text.
        known: all that follows.
    """
    found: list[NearRule] = []
    for rule in base.content.enabled_rules:
        for atom in rule.head:
            start = _binding_for(base, atom, name, subject, wanted)
            near = None if start is None else _furthest_match(base, rule, start, known)
            if near is not None:
                found.append(near)
    return tuple(sorted(found, key=lambda each: (each.missing, each.rule)))


def _binding_for(base: Ontology, atom: Atom, name: str, subject: str, wanted: str) -> Binding | None:
    """The binding with which an atom of a head asserts the fact, its value left free; None if it cannot."""
    if atom.kind not in FACT_KINDS or name != ("type" if atom.kind == "class" else base.names.short(atom.predicate)):
        return None
    first, last = atom.arguments[0], atom.arguments[-1]
    value = atom.predicate if atom.kind == "class" else None if isinstance(last, Variable) else last
    if value is not None:
        plain = value_of(value.iri if isinstance(value, Named) else value, base.names)
        if _value_text(plain) != wanted:
            return None
    if isinstance(first, Variable):
        return {first.name: subject}
    return {} if first == Named(subject) else None


def _furthest_match(base: Ontology, rule: Rule, start: Binding, known: Sequence[Triple]) -> NearRule | None:
    """The way to match a rule's body that comes furthest; None if all of it holds, and it concludes something else."""
    best, furthest = start, -1
    for depth, binding, _ in islice(partial_matches(rule.body, start, known, _holds), MOST_WAYS):
        if depth == len(rule.body):
            return None
        if depth > furthest:
            best, furthest = binding, depth
    bound = tuple((name, value_of(best[name], base.names)) for name in sorted(best))
    return NearRule(rule.name, write_atom(rule.body[furthest]), bound, len(rule.body) - furthest)


def _holds(atom: Atom, binding: Binding) -> bool:
    """Whether a comparison of numbers holds; any other atom counts as if it did."""
    compare = _COMPARE.get(atom.predicate) if atom.kind == "builtin" else None
    values = [binding.get(term.name) if isinstance(term, Variable) else term for term in atom.arguments]
    if compare is None or len(values) != 2:
        return True
    one, other = map(_number, values)
    return True if one is None or other is None else compare(one, other)


def _number(term: object) -> Decimal | None:
    try:
        return Decimal(term.text) if isinstance(term, Lit) else None
    except ArithmeticError:
        return None


def _value_text(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
