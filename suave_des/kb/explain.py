"""Explain why a fact follows, and why a function design is chosen or not."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.kb.states import FactReader
from suave_des.kb.tracing import Derivation, Tracer
from suave_des.kb.why_not import RuleQuestions
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.rdf import RDF_TYPE, Triple, canonical, facts_of, local_name, value_of
from suave_des.knowledge.reasoner import performance
from suave_des.knowledge.state import (
    Decision,
    Fact,
    Reasoning,
    objective_name,
    value_text,
)

#: Rules that are named for a fact that does not follow.
NEAREST: Final = 3
_WHY: Final = re.compile(r"why\s+(?:not\s+)?([\w.-]+)\s*\??", re.IGNORECASE)
_FORMS: Final = (
    'a fact such as fg_status(fg_spiral_high, IN_ERROR_NFR), "why fd_spiral_low?" or "why not fd_spiral_high?"'
)


CHOSEN, LEFT_OUT, NOT_BEST = "chosen", "left out", "not the best"


@dataclass(frozen=True)
class Candidate:
    """The planner's verdict on a function design.

    Attributes:
        verdict: "chosen", "left out" or "not the best".
        because: derivations of the facts for which it is left out.
    """

    design: str
    verdict: str
    reason: str
    because: tuple[Derivation, ...] = ()

    def __str__(self) -> str:
        """Design, verdict and reason."""
        return f"{self.design}: {self.verdict}: {self.reason}"


def verdicts(base: Ontology, reasoning: Reasoning, decision: Decision) -> Iterator[Candidate]:
    """Say of each design of a function, by name, what the planner made of it."""
    rejected = {each.design: each.reason for each in decision.rejected}
    for design in base.designs(decision.function):
        if design == decision.design:
            yield Candidate(design, CHOSEN, decision.reason)
        elif design in rejected:
            yield Candidate(design, LEFT_OUT, rejected[design])
        else:
            own, best = (performance(reasoning.inference, each) for each in (design, str(decision.design)))
            tie = f"performance {own}, as {decision.design}, which is first by name"
            yield Candidate(
                design, NOT_BEST, tie if own == best else f"performance {own} < {best} of {decision.design}"
            )


@dataclass(frozen=True)
class DecisionExplanation:
    """Why a function gets a design.

    Attributes:
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
            yield f"  {candidate}"
            for derivation in candidate.because:
                yield from derivation.lines("    ")


@dataclass(frozen=True)
class Explanation:
    """The answer to a question about a state.

    Attributes:
        facts: how facts follow.
        decisions: why functions get their designs.
    """

    facts: tuple[Derivation, ...] = ()
    decisions: tuple[DecisionExplanation, ...] = ()

    def __str__(self) -> str:
        """As `kb explain` prints it."""
        return "\n".join(self.lines())

    def lines(self) -> Iterator[str]:
        """All of it, one fact or decision after the other."""
        for derivation in self.facts:
            yield from derivation.lines()
        for decision in self.decisions:
            yield from decision.lines()
        if not self.facts and not self.decisions:
            yield "nothing is inferred, and nothing is decided"


def explain(base: Ontology, question: str, reasoning: Reasoning, pellet: InProcessPellet) -> Explanation:
    """Answer a question about a state; see KnowledgeBase.explain.

    Args:
        base: the ontologies and rules.
        question: a fact, "why DESIGN?", "why not DESIGN?", or nothing.
        reasoning: what is inferred of all terms and planned in the state.
        pellet: with the ontologies, made by `pellet_for`.
    """
    question = question.strip()
    why = _WHY.fullmatch(question)
    if question and not why and "(" not in question:
        raise InputError(f"{shown(question)} is not a question about a state", remedy=_FORMS)
    explainer = _Explainer(base, reasoning, Tracer(base, reasoning.inference.state, pellet))
    if why:
        return Explanation(decisions=(explainer.design(why.group(1)),))
    if question:
        return Explanation((explainer.fact(question),))
    inferred = sorted(reasoning.inference.facts, key=str)
    return Explanation(tuple(map(explainer.derive, inferred)), tuple(map(explainer.decision, reasoning.plan.decisions)))


class _Explainer:
    """Finds the facts behind a decision, and how they follow."""

    def __init__(self, base: Ontology, reasoning: Reasoning, tracer: Tracer) -> None:
        self.base, self.reasoning, self.tracer = base, reasoning, tracer
        self.triples: dict[Fact, Triple] = {}
        for triple in sorted(tracer.entailed, key=lambda each: (each not in tracer.asserted, str(each))):
            for fact in facts_of([triple], base.names):
                self.triples.setdefault(fact, triple)

    def derive(self, fact: Fact) -> Derivation:
        return self.tracer.derive(self.triples[fact])

    def fact(self, text: str) -> Derivation:
        """How a fact follows that is written as an atom."""
        reader = FactReader(self.base)
        triple = reader.triple(text)
        if (*triple[:2], canonical(triple[2])) in self.tracer.known:
            return self.tracer.derive(triple)
        fact = reader.fact(text)  # a value that the property cannot have is refused
        values = [value for s, p, value in self.tracer.known if (s, p) == triple[:2]]
        texts = sorted(value_text(value_of(value, self.base.names)) for value in values)
        name = "type" if triple[1] == RDF_TYPE else local_name(triple[1])
        near = RuleQuestions(self.base).missing(triple, self.tracer.state)
        remedies = [f"{name} of {fact.subject}: {', '.join(texts) or 'none'}"]
        remedies += (f"rule {each}" for each in near[:NEAREST])
        raise InputError(f"{fact} does not follow in this state", remedy="; ".join(remedies))

    def design(self, design: str) -> DecisionExplanation:
        """What becomes of a function design, and why."""
        function = next((name for name in self.base.functions if design in self.base.designs(name)), None)
        if function is None:
            known = [each for name in self.base.functions for each in self.base.designs(name)]
            raise InputError(f"there is no function design {shown(design)}", remedy=did_you_mean(design, known))
        for decision in self.reasoning.plan.decisions:
            if decision.function == function:
                return self.decision(decision, design)
        if function not in {each.function for each in self.reasoning.inference.state.objectives}:
            return DecisionExplanation(function, f"nothing is decided: {function} has no objective in this state")
        present = self.reasoning.inference.state.grounded(function) or "it"
        answer = f"nothing is decided: the objective of {function} requires no adaptation, so {present} stays"
        return DecisionExplanation(function, answer)

    def decision(self, decision: Decision, asked: str | None = None) -> DecisionExplanation:
        """Why a decision is made; the answer begins with the design that was asked about."""
        objective = objective_name(decision.function)
        candidates = []
        answer = f"{decision.design}: {decision.reason}" if decision.design else decision.reason
        for each in verdicts(self.base, self.reasoning, decision):
            why = (Fact(each.design, "fd_realisability", False), Fact(each.design, "fd_error_log", objective))
            because = (self.derive(fact) for fact in why if each.verdict == LEFT_OUT and fact in self.triples)
            candidates.append(replace(each, because=tuple(because)))
            if each.design == asked:
                answer = f"{asked} is {each.verdict}: {each.reason}"
                if decision.design is None:
                    present = self.reasoning.inference.state.grounded(decision.function) or decision.function
                    answer = f"no design is left, {present} stays; {answer}"
        status = (
            fact
            for fact in sorted(self.reasoning.inference.facts, key=str)
            if fact.subject == objective and fact.property in ("o_status", "o_updatable")
        )
        return DecisionExplanation(decision.function, answer, tuple(map(self.derive, status)), tuple(candidates))
