"""Imported configurations as YAML with comments that say where each value comes from."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from suave_des.errors import KeyPath
from suave_des.scenario.exemplar_campaign import Campaign
from suave_des.scenario.models import Scenario

_COMMENT_COLUMN = 43
_SPACES_A_LEVEL = 2


@dataclass(frozen=True)
class Entry:
    """A value of a scenario file, by key path, and where it comes from."""

    path: KeyPath
    value: Any
    comment: str


def scenario_text(files: Sequence[str], base: str, why: str, entries: Iterable[Entry], notes: Sequence[str]) -> str:
    """A scenario file: entries in the order of the scenario's reference, each with its comment."""
    order = list(Scenario.model_fields)
    lines = [
        *_head(files),
        "# What is not said here comes from the base.",
        _line(0, f"base: {_value(base)}", why),
        *_tree(sorted(entries, key=lambda entry: order.index(str(entry.path[0])))),
    ]
    if notes:
        lines += ["", "# What else the files say:", *(f"#   {_one_line(note)}" for note in notes)]
    return "\n".join(lines) + "\n"


def campaign_text(files: Sequence[str], scenario: str, campaign: Campaign) -> str:
    """A campaign file."""
    lines = [
        *_head(files),
        _line(0, "campaign: 1", "version of this file's form"),
        f"scenario: {_value(scenario)}",
        _line(0, f"managers: {_value(list(campaign.managers))}", campaign.experiments),
        _line(0, f"runs: {campaign.runs}", campaign.experiments),
    ]
    if campaign.seed is not None:
        lines.append(_line(0, f"seed: {campaign.seed[0]}", campaign.seed[1]))
    if campaign.perturbations:
        if campaign.runs_per_draw is not None:
            lines.append(_line(0, f"runs_per_draw: {campaign.runs_per_draw[0]}", campaign.runs_per_draw[1]))
        lines.append(_line(0, "perturbations:", "drawn at random, the same for every manager"))
        for each in campaign.perturbations:
            drawn = {"distribution": "uniform", "minimum": each.minimum, "maximum": each.maximum}
            lines += [f"  # {_one_line(each.comment)}", f"  {each.path}: {_value(drawn)}"]
    return "\n".join(lines) + "\n"


def _head(files: Sequence[str]) -> Iterator[str]:
    yield f"# Imported by `suave-des import-config` from {_one_line(', '.join(files))}."


def _tree(entries: Iterable[Entry]) -> Iterator[str]:
    above: KeyPath = ()
    for entry in entries:
        *parents, last = entry.path
        for depth, key in enumerate(parents):
            if above[: depth + 1] != tuple(parents[: depth + 1]):
                yield f"{_indent(depth)}{_value(key)}:"
        above = entry.path
        depth = len(parents)
        if isinstance(entry.value, list) and any(isinstance(each, dict) for each in entry.value):
            yield _line(depth, f"{_value(last)}:", entry.comment)
            yield from (f"{_indent(depth + 1)}- {_value(each)}" for each in entry.value)
        else:
            yield _line(depth, f"{_value(last)}: {_value(entry.value)}", entry.comment)


def _line(depth: int, text: str, comment: str) -> str:
    return f"{_indent(depth) + text:<{_COMMENT_COLUMN}} # {_one_line(comment)}"


def _indent(depth: int) -> str:
    return " " * (_SPACES_A_LEVEL * depth)


def _one_line(text: str) -> str:
    """A comment can end only at the end of its line, and holds no character that YAML does not allow."""
    return "".join(char if char.isprintable() else "?" for char in text)


def _value(value: Any) -> str:
    """A value in YAML's flow style."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_value(key)}: {_value(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, str):
        return value if _is_plain(value) else json.dumps(value)
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return json.dumps(value)


def _is_plain(text: str) -> bool:
    """Whether YAML reads a text without quotes as just that text."""
    words = ("true", "false", "null", "yes", "no", "on", "off")
    return (
        text.isascii()
        and text[:1].isalpha()
        and all(char.isalnum() or char in "_-./" for char in text)
        and text.lower() not in words
    )
