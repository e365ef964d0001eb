"""Situations of a knowledge base: what follows and is decided in them, and how two knowledge bases differ."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final, NamedTuple

from rdflib import BNode

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import LOADING, TimeLimit, reasoning_on
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.rdf import XSD, Lit, Triple
from suave_des.knowledge.rules import Atom, Named, Rule
from suave_des.knowledge.rules.files import with_triples
from suave_des.knowledge.state import STAYS, ContradictionError, Fact, KnowledgeState, Reasoning

INCONSISTENT: Final = "inconsistent"
#: Begins the IRIs of what is added to a knowledge base to question it.
PROBE: Final = "urn:suave-des:probe"
_HOLDS: Final = f"{PROBE}#holds"

Body = tuple[Atom, ...]


@dataclass(frozen=True)
class Situation:
    """A situation in which a knowledge base decides.

    Attributes:
        state: the knowledge state.
        facts: additional assertions, as triples.
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
        """What was asserted or inferred."""
        return self.inferred if self.reasoning is None else self.inferred | self.reasoning.inference.asserted

    @property
    def changes(self) -> dict[str, str]:
        """New design of each function whose grounding changes, or "none left"."""
        return {} if self.reasoning is None else self.reasoning.changes

    @cached_property
    def statuses(self) -> tuple[str, ...]:
        """What is inferred of objectives and groundings, as text, sorted."""
        return () if self.reasoning is None else tuple(sorted(self.reasoning.statuses))

    def choice(self, function: str) -> str:
        """What happens to a function's grounding: a design, "stays", "none left" or "inconsistent"."""
        return INCONSISTENT if self.reasoning is None else self.changes.get(function, STAYS)


Decide = Callable[[Situation], Outcome]


def difference(one: Outcome, other: Outcome) -> str:
    """Tell the first difference in what follows and is decided, in words about the second; empty: none."""
    if (one.reasoning is None) != (other.reasoning is None):
        return "it contradicts itself" if other.reasoning is None else "it no longer contradicts itself"
    for name in sorted({*one.changes, *other.changes}):
        if one.choice(name) != other.choice(name):
            return f"{name}: {other.choice(name)}, not {one.choice(name)}"
    for missing in sorted(map(str, one.inferred - other.inferred)):
        return f"{missing} does not follow"
    return next((f"{more} follows" for more in sorted(map(str, other.inferred - one.inferred))), "")


class Difference(NamedTuple):
    """A situation in which two knowledge bases conclude or decide differently."""

    situation: Situation
    one: Outcome
    other: Outcome


def compare(one: Decide, other: Decide, situations: Iterable[Situation]) -> Iterator[Difference]:
    """Find the situations in which two knowledge bases conclude or decide differently, in their order."""
    for situation in situations:
        before, after = one(situation), other(situation)
        if before is not after and difference(before, after):
            yield Difference(situation, before, after)


class Probes:
    """Asks Pellet which conjunctions of atoms hold.

    Each is the body of a separate rule, whose head has an individual and a property that nothing else mentions, so that
    it changes nothing.

        probes = Probes(base, TimeLimit(), [rule.body for rule in base.rules])
        probes.holding(Situation(state))  # bodies of the rules that fire

    Args:
        base: ontologies and rules.
        limit: of Pellet's time for one situation.
        bodies: the conjunctions; each must be safe, as the body of a rule is.

    Raises:
        KnowledgeError: Pellet cannot use them.
    """

    def __init__(self, base: Ontology, limit: TimeLimit, bodies: Iterable[Body]) -> None:
        self._base, self._limit, self._bodies = base, limit, tuple(dict.fromkeys(bodies))
        rules = (
            Rule(f"probe {number}", "", Path(), True, BNode(), (), body, (_head(number),))
            for number, body in enumerate(self._bodies)
        )
        probed = base.with_rules((*base.rules, *map(with_triples, rules)))
        self._pellet = limit.run(lambda: InProcessPellet(probed), LOADING)

    def holding(self, situation: Situation) -> frozenset[Body] | None:
        """Return the conjunctions that hold; None for a situation that contradicts itself.

        Raises:
            KnowledgeError: Pellet takes too long.
        """
        asserted = (*self._base.assertions(situation.state), *situation.facts)
        try:
            found = self._limit.run(lambda: self._pellet.infer(asserted), reasoning_on(situation.state))
        except ContradictionError:
            return None
        numbers = (value.text for _, name, value in found if name == _HOLDS and isinstance(value, Lit))
        return frozenset(self._bodies[int(number)] for number in numbers)


def _head(number: int) -> Atom:
    return Atom("data", _HOLDS, (Named(f"{PROBE}#it"), Lit(str(number), XSD + "string")))
