"""The words of error messages about files: places, values, and guesses at what was meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

KeyPath = tuple[str | int, ...]


def place_text(line: int, key_path: KeyPath) -> str:
    """A place for the user: "line 12, thruster_events[0].time_s"."""
    keys = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in key_path).lstrip(".")
    return f"line {line}, {keys}" if keys else f"line {line}"


_WRITTEN = {"None": "nothing", "True": "true", "False": "false", "inf": ".inf", "-inf": "-.inf", "nan": ".nan"}
"""How YAML writes what Python writes otherwise."""


def shown(value: object, limit: int = 60) -> str:
    """A value as the user wrote it, cut to a readable length and one line."""
    text = _WRITTEN.get(repr(value), repr(value))
    return text if len(text) <= limit else text[: limit - 3] + "..."


def did_you_mean(word: object, known: Iterable[str], what: str = "known") -> str:
    """A remedy for a misspelt word: the nearest known one, and the list of all."""
    names = list(known)
    near = difflib.get_close_matches(str(word), names, n=1, cutoff=0.6)
    listing = f"{what}: {', '.join(names)}" if names else f"{what}: none"
    return f"did you mean {near[0]!r}? {listing}" if near else listing
