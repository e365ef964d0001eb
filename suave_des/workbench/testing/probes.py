"""Ask Pellet which conjunctions of atoms hold in a situation: each is the body of a rule of its own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from rdflib import BNode

from suave_des.errors import KnowledgeError
from suave_des.knowledge.limit import LOADING, TimeLimit, reasoning_on
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import InProcessPellet
from suave_des.knowledge.rdf import Lit, Triple
from suave_des.knowledge.rules.rdf import with_triples
from suave_des.knowledge.rules.syntax import Atom, Named, Rule
from suave_des.knowledge.state import KnowledgeState
from suave_des.knowledge.vocabulary import XSD
from suave_des.workbench.policy import PolicyCase
from suave_des.workbench.testing.situation import Situation

_PROBE: Final = "urn:suave-des:probe"
_HOLDS: Final = f"{_PROBE}#holds"

Body = tuple[Atom, ...]


@dataclass(frozen=True)
class Probes:
    """A knowledge base in Pellet, with conjunctions of atoms to be asked for.

    What they conclude is of an individual and a property that nothing else mentions, so that they change nothing.

    Attributes:
        bodies: the conjunctions; each must be safe, as the body of a rule is.

    Example:
        probes = Probes.of(knowledge.base, [rule.body for rule in rules], knowledge.limit)
        probes.holding(situation)  # {0, 3}: the first rule and the fourth one fire
    """

    bodies: tuple[Body, ...]
    base: Ontology = field(repr=False)
    limit: TimeLimit = field(repr=False)
    pellet: InProcessPellet = field(repr=False)

    @classmethod
    def of(cls, base: Ontology, bodies: Sequence[Body], limit: TimeLimit) -> Probes:
        """Load a knowledge base with its probes.

        Raises:
            KnowledgeError: Pellet cannot use it.
        """
        rules = [
            with_triples(Rule(f"probe {number}", "", Path(), True, BNode(), (), body, (_head(number),)))
            for number, body in enumerate(bodies)
        ]
        probed = base.with_rules((*base.rules, *rules))
        return cls(tuple(bodies), base, limit, limit.run(lambda: InProcessPellet(probed), LOADING))

    def holding(self, situation: Situation) -> frozenset[int]:
        """Numbers of the conjunctions that hold; none in a situation that contradicts itself.

        Raises:
            KnowledgeError: Pellet takes too long.
        """
        found = self.conclude(situation)
        return frozenset() if found is None else found[1]

    def conclude(self, situation: Situation) -> tuple[frozenset[Triple], frozenset[int]] | None:
        """What follows in a situation, and numbers of the conjunctions that hold; None where it contradicts itself.

        Raises:
            KnowledgeError: Pellet takes too long.
        """
        return self._conclude((*self.base.assertions(situation.state), *situation.facts), situation.state)

    def may_hold(self, cases: Sequence[PolicyCase], wanted: frozenset[int]) -> Iterator[PolicyCase]:
        """Leave out cases in which none of the wanted conjunctions can hold.

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
        found = self._conclude(tuple(together), cases[0].state)
        if found is None and len(cases) > 1:
            middle = len(cases) // 2
            yield from self._may_hold(cases[:middle], wanted)
            yield from self._may_hold(cases[middle:], wanted)
        elif found is None or not found[1].isdisjoint(wanted):
            yield from cases

    def _conclude(
        self, assertions: tuple[Triple, ...], state: KnowledgeState
    ) -> tuple[frozenset[Triple], frozenset[int]] | None:
        try:
            entailed = self.limit.run(lambda: self.pellet.infer(assertions), reasoning_on(state))
        except KnowledgeError as error:
            if not error.problem.startswith("contradiction"):
                raise
            return None
        holding = frozenset(int(value.text) for _, name, value in entailed if name == _HOLDS and isinstance(value, Lit))
        return frozenset(triple for triple in entailed if not triple[0].startswith(_PROBE)), holding


def _head(number: int) -> Atom:
    return Atom("data", _HOLDS, (Named(f"{_PROBE}#it"), Lit(str(number), XSD + "string")))
