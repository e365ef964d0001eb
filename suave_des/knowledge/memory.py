"""What a reasoner found out, kept in a file between runs.

The file is text, one entry a line, each with a checksum. Entries are appended with a single write each, so that
several processes share a file without locks; a line that two of them mangled, or that was cut short, fails its
checksum and is left out. Nothing in a file is ever executed: entries are JSON, checked to the last value. A file is
named after all that its entries depend on; with another first line it is somebody else's, and is replaced.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from suave_des.knowledge.regions import Key
from suave_des.knowledge.state import Fact, ObjectiveState
from suave_des.resources import cache_folder

#: Raised when entries are written in another way.
_FORMAT: Final = 1
_SUFFIX: Final = ".memory"
#: A file that has grown to this is not added to: with exact values there is no end to new ones.
MAX_BYTES: Final = 16 * 2**20
#: Files that are kept; those used longest ago are removed.
MAX_FILES: Final = 64


def grown(sizes: dict[str, int]) -> dict[str, bytes]:
    """What was added to the memories in the user's cache folder, by their digests.

    Args:
        sizes: how far each is known already, by its digest; brought up to date.
    """
    added = {}
    for path in sorted((cache_folder() / "memory").glob(f"*{_SUFFIX}")):
        content = path.read_bytes()
        start = sizes.get(path.stem, 0)
        if len(content) > start:
            added[path.stem] = content[start:]
        sizes[path.stem] = len(content)
    return added


class DiskMemory:
    """Inferred facts by key, in a file of the user's cache folder.

    Where the folder cannot be written to, there is simply no memory between runs.

    Args:
        digest: stands for all that the entries depend on.
        folder: in place of the user's cache folder.
    """

    def __init__(self, digest: str, folder: Path | None = None) -> None:
        self._salt = digest.encode()
        self._first = f"suave-des memory {_FORMAT} {digest}"
        try:
            self._path: Path | None = (folder or cache_folder()) / "memory" / f"{digest}{_SUFFIX}"
        except RuntimeError:  # no home folder
            self._path = None

    def load(self) -> dict[Key, frozenset[Fact]]:
        """All entries that can be trusted. A file in which others are is written anew without them."""
        if self._path is None:
            return {}
        try:
            content = self._path.read_bytes()
            os.utime(self._path)
        except OSError:
            return {}
        is_ours = content.partition(b"\n")[0] == self._first.encode()
        found, damaged = self._entries(content) if is_ours else ({}, True)
        if damaged:
            self._replace(found)
        return found

    def add(self, key: Key, facts: frozenset[Fact]) -> None:
        """Append an entry."""
        self._append(self._line(key, facts))

    def content(self) -> bytes:
        """All entries that can be trusted, as another memory of the same digest takes them over, elsewhere."""
        return b"".join(self._line(*entry) for entry in self.load().items())

    def take_over(self, content: bytes) -> None:
        """Append the entries of another memory of the same digest that this one does not have."""
        known = self.load()
        new = [self._line(key, facts) for key, facts in self._entries(content)[0].items() if key not in known]
        if new:
            self._append(b"".join(new))

    def _entries(self, content: bytes) -> tuple[dict[Key, frozenset[Fact]], bool]:
        """Entries that can be trusted, and whether there are others."""
        found: dict[Key, frozenset[Fact]] = {}
        damaged = False
        for line in content.split(b"\n"):
            if line and line != self._first.encode():
                entry = self._entry(line)
                if entry is None:
                    damaged = True
                else:
                    found[entry[0]] = entry[1]
        return found, damaged

    def _append(self, lines: bytes) -> None:
        if self._path is None:
            return
        with suppress(OSError):  # a memory that cannot be written is a slower one, not a wrong one
            if not self._path.parent.is_dir():
                self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            handle = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
            try:
                size = os.fstat(handle).st_size
                if size == 0:
                    lines = self._first.encode() + lines
                if size < MAX_BYTES:
                    os.write(handle, lines)
            finally:
                os.close(handle)
            if size == 0:
                self._remove_old(self._path.parent)

    def _line(self, key: Key, facts: frozenset[Fact]) -> bytes:
        text = json.dumps([_key_to_json(key), sorted(map(_fact_to_json, facts))], separators=(",", ":")).encode()
        # The line break before it parts it from a line that another process left unfinished.
        return b"\n" + self._checksum(text) + b" " + text + b"\n"

    def _checksum(self, text: bytes) -> bytes:
        return hashlib.sha256(self._salt + text).hexdigest()[:24].encode()

    def _entry(self, line: bytes) -> tuple[Key, frozenset[Fact]] | None:
        checksum, _, text = line.partition(b" ")
        if checksum != self._checksum(text):
            return None
        try:
            key, facts = json.loads(text)
            return _key_from_json(key), frozenset([_fact(*fact) for fact in facts])
        except (ValueError, TypeError, InvalidOperation, RecursionError):
            return None

    def _replace(self, entries: Mapping[Key, frozenset[Fact]]) -> None:
        assert self._path is not None
        with suppress(OSError):
            handle, name = tempfile.mkstemp(dir=self._path.parent)
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(self._first.encode() + b"\n" + b"".join(self._line(*entry) for entry in entries.items()))
                Path(name).replace(self._path)
            except BaseException:
                Path(name).unlink(missing_ok=True)
                raise

    @staticmethod
    def _remove_old(folder: Path) -> None:
        files = sorted(folder.glob(f"*{_SUFFIX}"), key=lambda path: path.stat().st_mtime)
        for path in files[:-MAX_FILES]:
            path.unlink(missing_ok=True)


def _key_to_json(key: Key) -> list[Any]:
    objectives, groundings, components, where = key
    return [
        [[one.function, one.status, one.always_improve] for one in objectives],
        groundings,
        components,
        [[name, f"{place:f}" if isinstance(place, Decimal) else place] for name, place in where],
    ]


def _key_from_json(content: Any) -> Key:
    objectives, groundings, components, where = content
    return (
        tuple([_objective(*objective) for objective in objectives]),
        tuple([_texts(*grounding) for grounding in groundings]),
        tuple([_texts(*component) for component in components]),
        tuple([(_text(name), _where(place)) for name, place in where]),
    )


# A file has thousands of entries made of a few parts, which are made and checked once. Where equal is not the same to
# JSON, as 1 and true, `typed` tells them apart.


@lru_cache(maxsize=4096, typed=True)
def _objective(function: Any, status: Any, always_improve: Any) -> ObjectiveState:
    return ObjectiveState(_text(function), None if status is None else _text(status), _truth(always_improve))


@lru_cache(maxsize=4096)
def _texts(name: Any, value: Any) -> tuple[str, str]:
    return _text(name), _text(value)


def _where(place: Any) -> Any:
    """A region's number, a number with a rank among the values in one gap, or an exact value."""
    if isinstance(place, str):
        return Decimal(place)
    if isinstance(place, list):
        number, rank = place
        return _whole(number), _whole(rank)
    return _whole(place)


def _fact_to_json(fact: Fact) -> list[str]:
    if isinstance(fact.value, bool):
        return [fact.subject, fact.property, "truth", "true" if fact.value else "false"]
    if isinstance(fact.value, Decimal):
        return [fact.subject, fact.property, "number", str(fact.value)]
    return [fact.subject, fact.property, "text", fact.value]


@lru_cache(maxsize=4096)
def _fact(subject: Any, name: Any, kind: Any, value: Any) -> Fact:
    subject, name, kind, value = map(_text, (subject, name, kind, value))
    values = {"truth": {"true": True, "false": False}.get, "number": Decimal, "text": str}
    if kind not in values or (kind == "truth" and value not in ("true", "false")):
        raise ValueError(f"a value of kind {kind}")
    return Fact(subject, name, values[kind](value))  # type: ignore[operator]


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    return value


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"{value!r} is no truth value")
    return value


def _whole(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise TypeError(f"{value!r} is no whole number")
    return value
