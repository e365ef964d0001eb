"""Reasoners: what a state of the knowledge base entails. Ways to run the same Pellet, or to run it seldom.

An inference is a pure function of knowledge base and state; so it may be remembered.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Final, Protocol

from suave_des.errors import InputError
from suave_des.knowledge.limit import LOADING, TimeLimit, reasoning_on
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import Triple, facts_of
from suave_des.knowledge.state import Inference, KnowledgeState

#: Inferences that a reasoner remembers; about 20 kB each.
REMEMBERED: Final = 4096


class Reasoner(Protocol):
    """Tells what a state entails."""

    name: str

    def infer(self, state: KnowledgeState) -> Inference:
        """What the reasoner adds to the state.

        Raises:
            KnowledgeError: state and ontologies contradict one another, or Pellet does not use one of the
                rules; the message names the individual and the property, or the rule. Or it takes too long: the
                message names the state.
        """
        ...


class _Remembering:
    """A backend with a bounded memory of exact states."""

    def __init__(
        self, name: str, kb: Ontology, entailed: Callable[[KnowledgeState, tuple[Triple, ...]], Iterable[Triple]]
    ) -> None:
        self.name = name
        self._kb = kb
        self._entailed = entailed
        self._memory: OrderedDict[KnowledgeState, Inference] = OrderedDict()

    def infer(self, state: KnowledgeState) -> Inference:
        """What the reasoner adds to the state."""
        known = self._memory.get(state)
        if known is None:
            known = self._memory[state] = self._infer(state)
            if len(self._memory) > REMEMBERED:
                self._memory.popitem(last=False)
        else:
            self._memory.move_to_end(state)
        return known

    def _infer(self, state: KnowledgeState) -> Inference:
        situation = self._kb.assertions(state)
        asserted = self._kb.facts.union(facts_of(situation, self._kb.names))
        entailed = facts_of(self._entailed(state, situation), self._kb.names)
        return Inference(state, asserted, frozenset(entailed) - asserted)


def _pellet(kb: Ontology, limit: TimeLimit) -> Reasoner:
    from suave_des.knowledge.pellet import InProcessPellet

    pellet = limit.run(lambda: InProcessPellet(kb), LOADING)

    def entailed(state: KnowledgeState, situation: tuple[Triple, ...]) -> Iterable[Triple]:
        return limit.run(lambda: pellet.infer(situation), reasoning_on(state))

    return _Remembering("pellet", kb, entailed)


def _owlready2(kb: Ontology, limit: TimeLimit) -> Reasoner:
    from suave_des.knowledge.pellet import InProcessPellet
    from suave_des.knowledge.stock import StockPellet

    stock = StockPellet(kb)
    checker: list[InProcessPellet] = []

    def entailed(state: KnowledgeState, situation: tuple[Triple, ...]) -> Iterable[Triple]:
        # owlready2 throws Pellet's log away, and with it the only word on a rule that was dropped, or on
        # what contradicts what. The Pellet in this process tells: once at the start, and for contradictions.
        if not checker:
            checker.append(limit.run(lambda: InProcessPellet(kb), reasoning_on(state)))
        try:
            found = stock.infer(situation, limit.seconds)
        except TimeoutError:
            raise limit.exceeded(reasoning_on(state)) from None
        return limit.run(lambda: checker[0].infer(situation), reasoning_on(state)) if found is None else found

    return _Remembering("owlready2", kb, entailed)


def _remembered(kb: Ontology, limit: TimeLimit) -> Reasoner:
    from suave_des.knowledge.cached_pellet import CachedPellet

    return CachedPellet(kb, limit=limit)


BACKENDS: Final[Mapping[str, Callable[[Ontology, TimeLimit], Reasoner]]] = MappingProxyType(
    {"owlready2": _owlready2, "pellet": _pellet, "remembered": _remembered}
)


def make_reasoner(name: str, kb: Ontology, limit: TimeLimit | None = None) -> Reasoner:
    """A reasoner by name.

    Args:
        name: "remembered" (asks Pellet once for each situation that the rules can tell apart), "pellet" (kept running
            in this process) or "owlready2" (stock, the reference).
        kb: the knowledge base.
        limit: of the time that Pellet may take for one state, or to load the ontologies; None: a minute.

    Raises:
        InputError: the name is unknown, or there is no usable Java.
        KnowledgeError: the ontologies are inconsistent by themselves, Pellet drops a rule, or it takes too long.
    """
    make = BACKENDS.get(name)
    if make is None:
        raise InputError(f"there is no reasoner {name!r}", remedy=f"one of {', '.join(sorted(BACKENDS))}")
    return make(kb, limit or TimeLimit())
