"""Find what follows in situations, and which conjunctions of atoms hold in them, with Pellet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from rdflib import BNode

from suave_des.knowledge.deliberation import STAYS, Conclusion
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.pellet.limit import LOADING, TimeLimit, reasoning_on
from suave_des.knowledge.planning import plan
from suave_des.knowledge.rdf import XSD, Lit, Triple, facts_of
from suave_des.knowledge.rules.rdf import with_triples
from suave_des.knowledge.rules.syntax import Atom, Named, Rule
from suave_des.knowledge.state import ContradictionError, Fact, Inference, KnowledgeState
from suave_des.workbench.policy.cases import PolicyCase
from suave_des.workbench.reasons.matching import PROBE

if TYPE_CHECKING:
    from suave_des.workbench.knowledge_base import KnowledgeBase

_HOLDS: Final = f"{PROBE}#holds"

Body = tuple[Atom, ...]


@dataclass(frozen=True)
class Situation:
    """A situation in which rules are tested.

    Attributes:
        state: the knowledge state.
        facts: additional assertions, as triples.
        ranges: words for the region that the state stands for; empty for a single state.
    """

    state: KnowledgeState
    facts: tuple[Triple, ...] = ()
    ranges: str = ""

    def assertions(self, base: Ontology) -> tuple[Triple, ...]:
        """What it asserts besides the ontologies."""
        return *base.assertions(self.state), *self.facts

    def asserted(self, base: Ontology) -> Iterator[Fact]:
        """The same, as facts."""
        return facts_of(self.assertions(base), base.names)


class Entailed(NamedTuple):
    """What Pellet adds to a situation: inferred facts, and numbers of the conjunctions that hold."""

    facts: frozenset[Fact]
    holding: frozenset[int]


@dataclass(frozen=True)
class Outcome:
    """What follows in a situation.

    Attributes:
        conclusion: what is inferred and planned; None where the situation contradicts itself.
        contradiction: a description of the contradiction.
    """

    conclusion: Conclusion | None
    contradiction: str = ""

    @cached_property
    def inferred(self) -> frozenset[Fact]:
        """What was inferred; nothing where the situation contradicts itself."""
        return frozenset() if self.conclusion is None else self.conclusion.inference.facts

    @property
    def known(self) -> frozenset[Fact]:
        """What was asserted or inferred."""
        return self.inferred if self.conclusion is None else self.inferred | self.conclusion.inference.asserted

    @property
    def changes(self) -> dict[str, str]:
        """What happens to each function's grounding that changes, or has no design left."""
        return {} if self.conclusion is None else self.conclusion.changes

    def choice(self, function: str) -> str:
        """What happens to a function's grounding: a design, "stays" or "none left"."""
        return self.changes.get(function, STAYS)


@dataclass(frozen=True, eq=False)
class Prover:
    """One knowledge base in Pellet, which concludes what follows in situations.

    Conjunctions of atoms can be queried: each is the body of a separate rule, whose head has an individual and a
    property that nothing else mentions, so that it changes nothing.

    Attributes:
        base: ontologies and rules.
        improves_exceeded: as ManagingSettings has it.
        limit: of Pellet's time for one situation.
        known: what followed in situations that were asked about before.

    Example:
        prover = Prover.of(KnowledgeBase.load())
        prover.outcome(Situation(state)).choice("f_generate_search_path")  # "fd_spiral_low"
    """

    base: Ontology
    improves_exceeded: bool
    limit: TimeLimit = field(repr=False)
    known: dict[Situation, Entailed | ContradictionError] = field(repr=False)
    _pellet: InProcessPellet = field(repr=False)

    @classmethod
    def of(cls, bench: KnowledgeBase, base: Ontology | None = None, bodies: Sequence[Body] = ()) -> Prover:
        """Load a knowledge base, or a changed form of it, into Pellet; see `load`."""
        return cls.load(base or bench.base, bench.limit, bodies, improves_exceeded=bench.settings.improves_exceeded)

    @classmethod
    def load(
        cls, base: Ontology, limit: TimeLimit, bodies: Sequence[Body] = (), *, improves_exceeded: bool = False
    ) -> Prover:
        """Load ontologies and rules into Pellet.

        Args:
            base: the ontologies and rules.
            limit: of Pellet's time for one situation.
            bodies: conjunctions of atoms to query; each must be safe, as the body of a rule is.
            improves_exceeded: as ManagingSettings has it.

        Raises:
            KnowledgeError: Pellet cannot use them.
        """
        probes = (
            Rule(f"probe {number}", "", Path(), True, BNode(), (), body, (_head(number),))
            for number, body in enumerate(bodies)
        )
        probed = base.with_rules((*base.rules, *map(with_triples, probes))) if bodies else base
        pellet = limit.run(lambda: InProcessPellet(probed), LOADING)
        return cls(base, improves_exceeded, limit, {}, pellet)

    def outcome(self, situation: Situation) -> Outcome:
        """Conclude what follows.

        Raises:
            KnowledgeError: the reasoner takes too long.
        """
        try:
            facts = self.entailed(situation).facts
        except ContradictionError as error:
            return Outcome(None, error.problem.removeprefix("contradiction: "))
        inference = Inference(situation.state, lambda _: self.base.facts.union(situation.asserted(self.base)), facts)
        return Outcome(Conclusion(inference, plan(self.base, inference, improve_exceeded=self.improves_exceeded)))

    def entailed(self, situation: Situation) -> Entailed:
        """Infer what follows; the same situation is reasoned about once.

        Raises:
            ContradictionError: the situation contradicts itself.
            KnowledgeError: the reasoner takes too long.
        """
        found = self.known.get(situation)
        if found is None:
            try:
                triples = self._infer(situation.assertions(self.base), situation.state)
                others = (each for each in triples if not each[0].startswith(PROBE))
                facts = frozenset(facts_of(others, self.base.names))
                found = Entailed(facts.difference(self.base.facts, situation.asserted(self.base)), _holding(triples))
            except ContradictionError as error:
                found = error
            self.known[situation] = found
        if isinstance(found, ContradictionError):
            raise found.with_traceback(None)
        return found

    def holding(self, situation: Situation) -> frozenset[int]:
        """Numbers of the conjunctions that hold; none in a situation that contradicts itself.

        Raises:
            KnowledgeError: Pellet takes too long.
        """
        try:
            return _holding(self._infer(situation.assertions(self.base), situation.state))
        except ContradictionError:
            return frozenset()

    def may_hold(self, cases: Sequence[PolicyCase], wanted: frozenset[int]) -> Iterator[PolicyCase]:
        """Remove cases in which none of the wanted conjunctions can hold.

        What several states assert is taken together: what does not follow from all of it follows from no part of it.
        Where they contradict one another, they are divided; states in which different functions are grounded would, as
        the status of one without a grounding contradicts that of one with it.

        Raises:
            KnowledgeError: Pellet takes too long.
        """
        groups: dict[tuple[str, ...], list[PolicyCase]] = {}
        for case in cases if wanted else ():
            ungrounded = tuple(function for function in case.asked if case.state.grounded(function) is None)
            groups.setdefault(ungrounded, []).append(case)
        for group in groups.values():
            yield from self._may_hold(group, wanted)

    def _may_hold(self, cases: Sequence[PolicyCase], wanted: frozenset[int]) -> Iterator[PolicyCase]:
        together = dict.fromkeys(triple for case in cases for triple in self.base.assertions(case.state))
        try:
            found = _holding(self._infer(tuple(together), cases[0].state))
        except ContradictionError:
            found = wanted
            if len(cases) > 1:
                middle = len(cases) // 2
                yield from self._may_hold(cases[:middle], wanted)
                yield from self._may_hold(cases[middle:], wanted)
                return
        if not found.isdisjoint(wanted):
            yield from cases

    def _infer(self, assertions: tuple[Triple, ...], state: KnowledgeState) -> frozenset[Triple]:
        return self.limit.run(lambda: self._pellet.infer(assertions), reasoning_on(state))


def _holding(triples: frozenset[Triple]) -> frozenset[int]:
    return frozenset(int(value.text) for _, name, value in triples if name == _HOLDS and isinstance(value, Lit))


def _head(number: int) -> Atom:
    return Atom("data", _HOLDS, (Named(f"{PROBE}#it"), Lit(str(number), XSD + "string")))
