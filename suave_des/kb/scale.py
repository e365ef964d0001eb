"""The places that measured values can have among numbers, and regions of them as people write them.

A rule that only compares numbers cannot tell two values apart that compare alike with every number
in the knowledge base. So one value stands for each range between two numbers; equality with a
number is a range of its own.
"""

from __future__ import annotations

import itertools
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

from suave_des.errors import InputError, KnowledgeError, shown
from suave_des.knowledge.ontology import OPERATORS, Ontology
from suave_des.knowledge.reasoner import Regions, regions_of
from suave_des.knowledge.rules import mirrored
from suave_des.knowledge.state import exact

_SIGN = re.compile("([<>]=?)")
_MISSING = "not measured"
_REGIONS = 'such as "< 1.25", ">= 3.25", "1.25 <= . < 2.25" or "not measured"'


@dataclass(frozen=True)
class Scale:
    """The places that a measured value can have among numbers: 0 is no measurement, then ranges and
    numbers take turns.

    >>> Scale((Decimal("1.25"), Decimal("2.25"))).text(2, 3)  # the numbers are ascending
    '1.25 <= . < 2.25'
    """

    numbers: tuple[Decimal, ...]

    def __len__(self) -> int:
        return 2 * len(self.numbers) + 2

    def place(self, value: Decimal | None) -> int:
        """The place of a measured value; None: it is not measured."""
        return 0 if value is None else Regions(self.numbers, ()).region(value) + 1

    def low(self, place: int) -> Decimal | None:
        """The lower end of a place; None: it has none."""
        return self.numbers[place // 2 - 1] if place > 1 else None

    def _high(self, place: int) -> Decimal | None:
        return self.numbers[(place - 1) // 2] if 0 < place < len(self) - 1 else None

    def text(self, first: int, last: int | None = None) -> str:
        """Neighbouring places in words: "not measured", "1.25", "< 1.25", ">= 1.25", "1.25 <= . <
        2.25".
        """
        last = first if last is None else last
        if first == 0:
            return _MISSING if last == 0 else f"{_MISSING} or {self.text(1, last)}"
        low = self.low(first)
        high = self._high(last)
        if low is None and high is None:
            return "any"
        if low == high:
            return str(low)
        if low is None:
            return f"{_sign(last)} {high}"
        if high is None:
            return f"{mirrored(_sign(first))} {low}"
        return f"{low} {_sign(first)} . {_sign(last)} {high}"

    def value(self, place: int, rank: int = 0, ranks: int = 1) -> Decimal | None:
        """A value there, above 0 if there is one; in a range the `rank`-th of `ranks` ascending
        ones.
        """
        low = self.low(place)
        high = self._high(place)
        if place % 2 == 0:
            return low
        if low is None:
            low = Decimal(0) if high is None or high > 0 else high - 1
        high = low + 1 if high is None else high
        return exact(low + (high - low) * (rank + 1) / Decimal(2 ** ranks.bit_length()))

    def places_in(self, *regions: TestedRegion) -> list[int]:
        """The places whose values are in one of some regions."""
        found = []
        for place in range(len(self)):
            value = self.value(place)
            if any(is_in(region, value) for region in regions):
                found.append(place)
        return found

    def values(self, places: Sequence[int]) -> Iterator[tuple[Decimal | None, ...]]:
        """Values of several attributes at given places, for every order that the values can have.

        Values at different places are ordered by these; those in the same range can be in any
        order, and equal.
        """
        alike = defaultdict(list)  # the attributes whose values are in one range
        for number, place in enumerate(places):
            if place % 2:
                alike[place].append(number)
        groups = list(alike.values())
        for ranks in itertools.product(*(_weak_orders(len(group)) for group in groups)):
            values = list(map(self.value, places))
            for group, order in zip(groups, ranks, strict=True):
                for number, rank in zip(group, order, strict=True):
                    values[number] = self.value(places[number], rank, len(group))
            yield tuple(values)


def _sign(place: int) -> str:
    """How the values of a place relate to an end: odd places are ranges without their ends."""
    return "<" if place % 2 else "<="


def _weak_orders(size: int) -> Iterator[tuple[int, ...]]:
    """All ways to rank things, ties allowed: ranks from 0 without gaps."""
    ranks = itertools.product(range(size), repeat=size)
    return (each for each in ranks if set(each) == set(range(max(each) + 1)))


#: Measured values that a test is about: all that compare as given with numbers; empty: no
# measurement.
TestedRegion = tuple[tuple[str, Decimal], ...]


def is_in(region: TestedRegion, value: Decimal | None) -> bool:
    """Whether a measured value, None for none, is in a region."""
    if value is None or not region:
        return value is None and not region
    return all(OPERATORS[sign](value, number) for sign, number in region)


def parse_region(text: str) -> TestedRegion | None:
    """Read a region as `kb policy` writes it, such as "1.25 <= . < 2.25"; None for what is none,
    such as a number.

    Raises:
        InputError: there is no number in it.
    """
    text = text.strip()
    if text == _MISSING:
        return ()
    if not {"<", ">"} & {*text}:
        return None
    region = _bounds(text)
    scale = Scale(tuple(sorted({number for _, number in region})))
    if not scale.places_in(region):
        raise InputError(f"no number is in the region {shown(text)}", remedy=_REGIONS)
    return region


def _bounds(text: str) -> TestedRegion:
    """Read the comparisons of a region, in which a point stands for the measured value."""
    parts = [part.strip() for part in _SIGN.split(f". {text}" if text[0] in "<>" else text)]
    sides = list(zip(parts[::2], parts[1::2], parts[2::2], strict=False))
    bounds = []
    for left, sign, right in sides:
        try:
            bounds.append((sign, exact(right)) if left == "." else (mirrored(sign), exact(left)))
        except KnowledgeError:
            raise InputError(f"{shown(text)} is not a region", remedy=_REGIONS) from None
    if any((left == ".") == (right == ".") for left, _, right in sides):
        raise InputError(f"no number is in the region {shown(text)}", remedy=_REGIONS)
    return tuple(bounds)


def measurements_in(
    base: Ontology, regions: Mapping[str, TestedRegion]
) -> Iterator[tuple[dict[str, Decimal | None], str]]:
    """Measured values in the regions of attributes, one for each kind that comparing rules tell
    apart, with words.
    """
    ends = {number for region in regions.values() for _, number in region}
    scale = Scale(tuple(sorted({*regions_of(base).thresholds, *ends})))
    inside = map(scale.places_in, regions.values())
    for places in itertools.product(*inside):
        words = ", ".join(
            f"{name} {scale.text(at)}" for name, at in zip(regions, places, strict=True)
        )
        for values in scale.values(places):
            yield dict(zip(regions, values, strict=True)), words
