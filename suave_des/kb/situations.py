"""Situations in which a knowledge base decides, and what follows and is decided in one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

from suave_des.knowledge.rdf import Triple
from suave_des.knowledge.state import STAYS, Fact, KnowledgeState, Reasoning

INCONSISTENT = "inconsistent"


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
        before = one(situation)
        after = other(situation)
        if before is not after and difference(before, after):
            yield situation, before, after
