"""Damages texts at random, as a slip, a broken disk or an attacker would; the same for the same seed."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence

NUMBERS = (
    "0",
    "-1",
    "5e-324",
    "1e308",
    "1e9",
    ".inf",
    "-.inf",
    ".nan",
    "1_0",
    "０",
    "²",
    "0x10",
    "1:30",
    "99999999999999",
)
WORDS = (
    "null",
    "true",
    "[]",
    "{}",
    "''",
    "*a",
    "&a 1",
    "!!python/object:os.system",
    "<<: 1",
    "\t",
    "\x1b[31m",
    "\u202e",
    "'",
)
SIGNS = tuple("{}[]()<>,:;^?*&#|!%@`\"'\\/=-+ \n")


def damaged(text: str, seed: int, more: Sequence[str] = ()) -> str:
    """Return a text with one to six damages.

    Args:
        text: what to damage.
        seed: decides what is done.
        more: words of the text's own language to put in.
    """
    stream = random.Random(seed)
    for _ in range(stream.choice((1, 1, 1, 2, 3, 6))):
        text = _damaged_once(text, stream, more)
    return text


def _damaged_once(text: str, stream: random.Random, more: Sequence[str]) -> str:
    lines = text.split("\n")
    place = stream.randrange(len(text) + 1)
    kind = stream.randrange(9)
    if kind == 0:
        return text[:place]
    if kind == 1:
        return text[:place] + stream.choice(SIGNS) + text[place:]
    if kind == 2:
        return text[:place] + text[place + stream.randrange(1, 9) :]
    if kind == 3:
        return text[:place] + stream.choice((*WORDS, *more)) + text[place:]
    if kind == 4:
        lines.insert(stream.randrange(len(lines) + 1), stream.choice(lines))
        return "\n".join(lines)
    if kind == 5 and len(lines) > 1:
        del lines[stream.randrange(len(lines))]
        return "\n".join(lines)
    if kind == 6:
        line = stream.randrange(len(lines))
        lines[line] = stream.choice(("  ", " ", "\t", "    ")) + lines[line]
        return "\n".join(lines)
    numbers = list(_numbers(text))
    if not numbers:
        return text + stream.choice((*NUMBERS, *WORDS))
    first, last = stream.choice(numbers)
    return text[:first] + stream.choice((*NUMBERS, *more)) + text[last:]


def _numbers(text: str) -> Iterator[tuple[int, int]]:
    first = None
    for place, char in enumerate([*text, " "]):
        if char.isdigit() or (char == "." and first is not None):
            first = place if first is None else first
        elif first is not None:
            yield first, place
            first = None
