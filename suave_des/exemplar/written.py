"""Scenario and campaign files as text: YAML with comments that name the source of each value."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

from suave_des.scenario.yamlfile import Layer

Entries = dict[tuple[str, ...], tuple[object, str]]
"""Values with their comments by key path, as lines of a YAML file."""


_COMMENT_COLUMN = 43


def yaml_text(documents: Sequence[Layer], entries: Entries, notes: Sequence[str]) -> str:
    """A YAML file of these entries."""
    names = ", ".join(each.path.name for each in documents)
    lines = [f"# Imported by `suave-des import-config` from {names}."]
    above: tuple[str, ...] = ()
    for path, (value, comment) in entries.items():
        for depth, key in enumerate(path[:-1]):
            if above[: depth + 1] != path[: depth + 1]:
                lines.append(f"{'  ' * depth}{key}:")
        above = path
        line = f"{'  ' * (len(path) - 1)}{path[-1]}: {json.dumps(value)}"
        lines.append(f"{line:<{_COMMENT_COLUMN}} # {comment}" if comment else line)
    lines += ["", "# About the files:", *(f"#   {note}" for note in notes)] if notes else []
    # No line ends, and no characters that YAML does not allow, from names in the user's files.
    return "".join(f"{_printable(line)}\n" for line in lines)


def _printable(line: str) -> str:
    return "".join(char if char.isprintable() else "?" for char in line)


def relative(path: Path, file: Path) -> str:
    """How a file names another: relative to its own folder."""
    return Path(os.path.relpath(path.resolve(), file.resolve().parent)).as_posix()
