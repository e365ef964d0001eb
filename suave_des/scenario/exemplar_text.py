"""YAML of imported configurations, with comments that name the source of each value."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

_COMMENT_COLUMN = 43
_WORDS = ("true", "false", "null", "yes", "no", "on", "off")


def heading(files: Sequence[str]) -> Iterator[str]:
    """The first line of an imported file."""
    yield f"# Imported by `suave-des import-config` from {one_line(', '.join(files))}."


def commented(depth: int, text: str, comment: str) -> str:
    """A line at a depth of nested mappings, with a comment."""
    return f"{'  ' * depth + text:<{_COMMENT_COLUMN}} # {one_line(comment)}"


def one_line(text: str) -> str:
    """A text for a comment: without line ends and characters that YAML does not allow."""
    return "".join(char if char.isprintable() else "?" for char in text)


def flow(value: Any) -> str:
    """A value in YAML's flow style."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{flow(key)}: {flow(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, str):
        # Plain where YAML of any version reads just that text.
        plain = value.isascii() and value[:1].isalpha() and value.lower() not in _WORDS
        return value if plain and all(char.isalnum() or char in "_-./" for char in value) else json.dumps(value)
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return json.dumps(value)
