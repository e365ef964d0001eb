"""Ranges of measured values, which stand for all values in them, and as people write them.

A rule that only compares numbers cannot tell two values apart that compare alike with every number in the knowledge
base. So one value stands for each range between two numbers; equality with a number is a range of its own.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Final

from suave_des.errors import InputError, shown
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.regions import regions_of
from suave_des.knowledge.state import exact

_NUMBER: Final = r"([+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))"
_ONE_SIDED: Final = re.compile(rf"(<=?|>=?)\s*{_NUMBER}")
_TWO_SIDED: Final = re.compile(rf"{_NUMBER}\s*(<=?)\s*\.\s*(<=?)\s*{_NUMBER}")
_MISSING: Final = "not measured"


@dataclass(frozen=True, slots=True)
class ValueRange:
    """A range of measured values, or no measurement.

    Attributes:
        low, high: its ends; None: it has none there.
        low_closed, high_closed: whether the end belongs to it.
        is_missing: whether there is no measurement.

    Example:
        >>> str(ValueRange(Decimal("1.25"), Decimal("2.25"), low_closed=True))
        '1.25 <= . < 2.25'
    """

    low: Decimal | None = None
    high: Decimal | None = None
    low_closed: bool = False
    high_closed: bool = False
    is_missing: bool = False

    def __str__(self) -> str:
        """In words: "not measured", "1.25", "< 1.25", ">= 1.25", "1.25 <= . < 2.25"."""
        if self.is_missing:
            return _MISSING
        if self.is_number:
            return str(self.low)
        below = "" if self.high is None else f"{'<=' if self.high_closed else '<'} {self.high}"
        if self.low is None:
            return below or "any"
        if self.high is None:
            return f"{'>=' if self.low_closed else '>'} {self.low}"
        return f"{self.low} {'<=' if self.low_closed else '<'} . {below}"

    @property
    def is_number(self) -> bool:
        """Whether it is one number."""
        return self.low is not None and self.low == self.high

    def value(self, step: int = 0, steps: int = 1) -> Decimal | None:
        """A value in it; in an open range the `step`-th of `steps` ascending ones."""
        if self.is_missing or self.is_number:
            return self.low
        low = self.low if self.low is not None else (self.high or Decimal(0)) - 1
        high = self.high if self.high is not None else low + 1
        return exact(low + (high - low) * (step + 1) / Decimal(2 ** steps.bit_length()))

    def holds(self, part: ValueRange) -> bool:
        """Whether all of a range between two neighbouring numbers is in it."""
        if part.is_missing or self.is_missing:
            return part.is_missing and self.is_missing
        value = part.value()
        assert value is not None
        above = self.low is None or value > self.low or (self.low_closed and value == self.low)
        return above and (self.high is None or value < self.high or (self.high_closed and value == self.high))

    def joined(self, following: ValueRange) -> ValueRange:
        """The range of this one and the one that follows it."""
        return ValueRange(self.low, following.high, self.low_closed, following.high_closed)


def numbers_in(base: Ontology) -> tuple[Decimal, ...]:
    """Every number in the ontologies and enabled rules, ascending."""
    return tuple(map(exact, regions_of(base).thresholds))


def ranges_between(numbers: Sequence[Decimal]) -> tuple[ValueRange, ...]:
    """No measurement, then each open range and each number, ascending."""
    ends: list[Decimal | None] = [None, *numbers, None]
    found = [ValueRange(is_missing=True)]
    for low, high in itertools.pairwise(ends):
        found.append(ValueRange(low, high))
        if high is not None:
            found.append(ValueRange(high, high, True, True))
    return tuple(found)


def values_in(ranges: Sequence[ValueRange]) -> Iterator[tuple[Decimal | None, ...]]:
    """Values of several attributes, one in each given range, for every order that the values can have.

    Values in different ranges are ordered by these; those in the same open range can be in any order, and equal.
    """
    places: dict[ValueRange, list[int]] = {}
    for place, one in enumerate(ranges):
        if not one.is_missing and not one.is_number:
            places.setdefault(one, []).append(place)
    shared = [(one, group) for one, group in places.items() if len(group) > 1]
    for ranks in itertools.product(*(_weak_orders(len(group)) for _, group in shared)):
        values = [one.value() for one in ranges]
        for (one, group), order in zip(shared, ranks, strict=True):
            for place, rank in zip(group, order, strict=True):
                values[place] = one.value(rank, len(group))
        yield tuple(values)


def _weak_orders(size: int) -> Iterator[tuple[int, ...]]:
    """All ways to rank things, ties allowed: ranks from 0 without gaps."""
    ranks = itertools.product(range(size), repeat=size)
    return (each for each in ranks if set(each) == set(range(max(each) + 1)))


def parse_region(text: str) -> ValueRange | None:
    """Read a region as `kb policy` writes it; None for what is none, such as a number.

    Example:
        >>> str(parse_region("1.25 <= . < 2.25"))
        '1.25 <= . < 2.25'

    Raises:
        InputError: there is no number in it.
    """
    text = text.strip()
    if text == _MISSING:
        return ValueRange(is_missing=True)
    if found := _ONE_SIDED.fullmatch(text):
        sign, number = found[1], exact(found[2])
        closed = sign.endswith("=")
        if sign.startswith("<"):
            return ValueRange(high=number, high_closed=closed)
        return ValueRange(low=number, low_closed=closed)
    if found := _TWO_SIDED.fullmatch(text):
        low, high = exact(found[1]), exact(found[4])
        region = ValueRange(low, high, found[2] == "<=", found[3] == "<=")
        if low > high or (low == high and not (region.low_closed and region.high_closed)):
            raise InputError(f"no number is in the region {shown(text)}", remedy="write the smaller number first")
        return region
    if "<" in text or ">" in text:
        remedy = 'such as "< 1.25", ">= 3.25", "1.25 <= . < 2.25" or "not measured"'
        raise InputError(f"{shown(text)} is not a region", remedy=remedy)
    return None


def measurements_in(
    base: Ontology, regions: Mapping[str, ValueRange]
) -> Iterator[tuple[dict[str, Decimal | None], str]]:
    """Measured values, one for each kind that rules that only compare can tell apart, with words for them.

    Args:
        base: the ontologies, whose numbers divide the regions.
        regions: by quality attribute type.
    """
    ends = {end for region in regions.values() for end in (region.low, region.high) if end is not None}
    between = ranges_between(sorted({*numbers_in(base), *ends}))
    names = tuple(regions)
    for ranges in itertools.product(*([each for each in between if regions[name].holds(each)] for name in names)):
        words = ", ".join(f"{name} {each}" for name, each in zip(names, ranges, strict=True))
        for values in values_in(ranges):
            yield dict(zip(names, values, strict=True)), words
