"""Reasoners: the entailments of a state of the knowledge base. All of them run Pellet, and give the same inferences.

An inference is a pure function of ontology and state, so it is cached.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache, lru_cache
from typing import Final, Protocol

from suave_des.errors import InputError
from suave_des.knowledge.content import Terms
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.limit import LOADING, TimeLimit, reasoning_on
from suave_des.knowledge.rdf import Triple, facts_of
from suave_des.knowledge.state import Inference, KnowledgeState

#: Inferences that a reasoner caches in this process; about 20 kB each.
CACHED_STATES: Final = 4096


class Reasoner(Protocol):
    """Infers what a state entails.

    state = KnowledgeState.of(
        groundings={"f_generate_search_path": "fd_spiral_high"}, measurements={"water_visibility": 1.0}
    )
    reasoner = make_reasoner("pellet", Ontology.load())
    reasoner.infer(state).grounding_status("f_generate_search_path")  # "IN_ERROR_NFR"
    """

    name: str

    def infer(self, state: KnowledgeState) -> Inference:
        """Return what the reasoner adds to the state.

        Raises:
            KnowledgeError: state and ontologies contradict one another, or Pellet does not use one of the
                rules; the message names the individual and the property, or the rule. Or it takes too long: the
                message names the state.
        """
        ...


Entailed = Callable[[KnowledgeState, tuple[Triple, ...]], Iterable[Triple]]


class _StateCache:
    """A backend that caches the inferences of equal states."""

    def __init__(self, name: str, ontology: Ontology, entailed: Entailed) -> None:
        self.name = name
        self._ontology = ontology
        self._entailed = entailed
        self._cached = lru_cache(maxsize=CACHED_STATES)(self._infer)

    def infer(self, state: KnowledgeState) -> Inference:
        """Return what the reasoner adds to the state."""
        return self._cached(state)

    def _infer(self, state: KnowledgeState) -> Inference:
        asserted = self._ontology.asserted(state)
        entailed = self._entailed(state, self._ontology.assertions(state))
        return Inference(state, asserted, frozenset(facts_of(entailed, self._ontology.names)) - asserted)


def _pellet(ontology: Ontology, limit: TimeLimit, terms: Terms | None) -> Reasoner:
    from suave_des.knowledge.pellet.in_process import InProcessPellet

    pellet = limit.run(lambda: InProcessPellet(ontology, terms), LOADING, ontology.rules)

    def entailed(state: KnowledgeState, assertions: tuple[Triple, ...]) -> Iterable[Triple]:
        return limit.run(lambda: pellet.infer(assertions), reasoning_on(state), ontology.rules)

    return _StateCache("pellet", ontology, entailed)


def _owlready2(ontology: Ontology, limit: TimeLimit, terms: Terms | None) -> Reasoner:
    from suave_des.knowledge.pellet.in_process import InProcessPellet
    from suave_des.knowledge.pellet.stock import StockPellet

    stock = StockPellet(ontology, terms)
    in_process = cache(lambda: InProcessPellet(ontology, terms))

    def entailed(state: KnowledgeState, assertions: tuple[Triple, ...]) -> Iterable[Triple]:
        # owlready2 discards Pellet's log, which alone reports dropped rules and explains contradictions. The Pellet
        # in this process does so: once at the start, and for contradictions.
        checker = limit.run(in_process, reasoning_on(state), ontology.rules)
        try:
            found = stock.infer(assertions, limit.seconds)
        except TimeoutError:
            raise limit.exceeded(reasoning_on(state), ontology.rules) from None
        if found is not None:
            return found
        return limit.run(lambda: checker.infer(assertions), reasoning_on(state), ontology.rules)

    return _StateCache("owlready2", ontology, entailed)


def _cached(ontology: Ontology, limit: TimeLimit, terms: Terms | None) -> Reasoner:
    from suave_des.knowledge.pellet.cached import CachedPellet

    return CachedPellet(ontology, limit=limit, terms=terms)


BACKENDS: Final[Mapping[str, Callable[[Ontology, TimeLimit, Terms | None], Reasoner]]] = {
    "cached": _cached,
    "pellet": _pellet,
    "owlready2": _owlready2,
}


def make_reasoner(
    name: str, ontology: Ontology, limit: TimeLimit | None = None, terms: Terms | None = None
) -> Reasoner:
    """Make a reasoner by name.

    Args:
        name: "cached" (caches Pellet's inferences, on disk too, one for all states that the rules cannot tell
            apart), "pellet" (kept running in this process) or "owlready2" (stock, the reference).
        ontology: the ontology.
        limit: of the time that Pellet may take for one state, or to load the ontologies; None: a minute.
        terms: the terms to read after an inference; None: what decisions depend on, and what rules assert.

    Raises:
        InputError: the name is unknown, or there is no usable Java.
        KnowledgeError: the ontologies are inconsistent by themselves, Pellet drops a rule, or it takes too long.
    """
    make = BACKENDS.get(name)
    if make is None:
        raise InputError(f"there is no reasoner {name!r}", remedy=f"one of {', '.join(sorted(BACKENDS))}")
    return make(ontology, limit or TimeLimit(), terms)
