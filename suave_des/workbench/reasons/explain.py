"""Explain why a fact follows, why a function design is chosen or not, and why a state contradicts itself."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.knowledge.deliberation import Conclusion, Deliberation
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.planning import performance
from suave_des.knowledge.rdf import Triple, facts_of
from suave_des.knowledge.reasoners import make_reasoner
from suave_des.knowledge.state import ContradictionError, Decision, Fact, KnowledgeState, objective_name, value_text
from suave_des.workbench.reasons.tracing import Clash, Derivation, Tracer
from suave_des.workbench.reasons.why_not import RuleQuestions, WhyNot

#: Rules that are named for a fact that does not follow.
NEAREST: Final = 3
_WHY: Final = re.compile(r"why\s+(not\s+)?([\w.-]+)\s*\??", re.IGNORECASE)
_ATOM: Final = re.compile(r"([^\s(]+)\s*\(\s*([^,()]+?)\s*(?:,\s*(.+?)\s*)?\)")
_FORMS: Final = (
    'a fact such as fg_status(fg_spiral_high, IN_ERROR_NFR), "why fd_spiral_low?" or "why not fd_spiral_high?"'
)


@dataclass(frozen=True)
class Candidate:
    """The planner's verdict on a function design.

    Attributes:
        design: its name.
        verdict: "chosen", "left out" or "not the best".
        reason: why.
        because: derivations of the facts for which it is ruled out.
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
        because: derivations of the facts that require adaptation.
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
    except ContradictionError:
        problem, clashes, rules = tracer.clashes()
        if not rules and not clashes:
            raise  # the message has all there is to say
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
        for triple in sorted(tracer.entailed, key=lambda each: (each not in tracer.asserted, str(each))):
            for fact in facts_of([triple], base.names):
                self.triples.setdefault(fact, triple)

    def inferred(self) -> list[Triple]:
        facts = self.conclusion.inference.facts
        return [self.triples[fact] for fact in sorted(facts, key=str)]

    def fact(self, property_name: str, subject: str, value: str | None) -> Derivation:
        """How a fact follows that is written as an atom; an atom of a class has no value."""
        name, wanted = ("type", property_name) if value is None else (property_name, value.strip("\"'"))
        for fact, triple in self.triples.items():
            if fact.property == name and fact.subject == subject and value_text(fact.value) == wanted:
                return self.tracer.derive(triple)
        known = sorted({fact.subject for fact in self.triples})
        if subject not in known:
            raise InputError(f"there is nothing named {shown(subject)} in this state", remedy=_near(subject, known))
        there = sorted(
            value_text(fact.value) for fact in self.triples if (fact.property, fact.subject) == (name, subject)
        )
        kinds = self.base.vocabulary.kinds.items()
        declared = {self.base.names.short(iri) for iri, kind in kinds if kind & {"object property", "data property"}}
        properties = sorted(declared | {fact.property for fact in self.triples})
        iri = next(triple[0] for fact, triple in self.triples.items() if fact.subject == subject)
        near = RuleQuestions(self.base).missing(Fact(subject, name, wanted), iri, self.tracer.state)
        if not near and not there and value is not None and name not in properties:
            raise InputError(f"there is no property {shown(name)}", remedy=_near(name, properties))
        raise InputError(
            f"{property_name}({subject}{', ' + wanted if value is not None else ''}) does not follow in this state",
            remedy="; ".join([f"{name} of {subject}: {', '.join(there) or 'none'}", *map(_near_rule, near[:NEAREST])]),
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
            f"nothing is decided: the objective of {function} requires no adaptation, so {present or 'it'} stays",
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
        return DecisionExplanation(decision.function, answer, tuple(self._trigger(decision.function)), candidates)

    def _trigger(self, function: str) -> Iterator[Derivation]:
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
        own, best = performance(inference, design), performance(inference, str(decision.design))
        if own == best:
            return Candidate(design, "not the best", f"performance {own}, as {decision.design}, which is first by name")
        return Candidate(design, "not the best", f"performance {own} < {best} of {decision.design}")

    def _objection(self, function: str, design: str) -> Iterator[Derivation]:
        """Derivations of the inferred facts for which a design was ruled out."""
        for fact in (
            Fact(design, "fd_realisability", False),
            Fact(design, "fd_error_log", objective_name(function)),
        ):
            if fact in self.triples:
                yield self.tracer.derive(self.triples[fact])


def _near_rule(answer: WhyNot) -> str:
    """The first atom that fails of a rule that could conclude what is missing, in the nearest match."""
    if not answer.atom:
        return f"rule {answer.rule}: {answer.answer}"
    bound = ", ".join(f"?{name} = {value}" for name, value in answer.bindings)
    return f"rule {answer.rule}: {answer.atom} does not hold{f' with {bound}' if bound else ''}"


def _near(word: str, known: list[str]) -> str:
    return did_you_mean(word, known).partition("? ")[0] + "?" if len(known) > 40 else did_you_mean(word, known)
