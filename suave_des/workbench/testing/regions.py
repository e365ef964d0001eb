"""Regions of measured values as people write them, and the states that stand for all that is in them."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Final

from suave_des.errors import InputError, shown
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.state import exact
from suave_des.workbench.policy_space import ValueRange, numbers_in, ranges_between, values_in

_NUMBER: Final = r"([+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))"
_ONE_SIDED: Final = re.compile(rf"(<=?|>=?)\s*{_NUMBER}")
_TWO_SIDED: Final = re.compile(rf"{_NUMBER}\s*(<=?)\s*\.\s*(<=?)\s*{_NUMBER}")
_MISSING: Final = "not measured"


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
        region = ValueRange(exact(found[1]), exact(found[4]), found[2] == "<=", found[3] == "<=")
        low, high = exact(found[1]), exact(found[4])
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
    for ranges in itertools.product(*([each for each in between if _inside(each, regions[name])] for name in names)):
        words = ", ".join(f"{name} {each}" for name, each in zip(names, ranges, strict=True))
        for values in values_in(ranges):
            yield dict(zip(names, values, strict=True)), words


def _inside(part: ValueRange, whole: ValueRange) -> bool:
    """Whether all of a range between two neighbouring numbers is in a region."""
    if part.is_missing or whole.is_missing:
        return part.is_missing and whole.is_missing
    value = part.value()
    assert value is not None
    above = whole.low is None or value > whole.low or (whole.low_closed and value == whole.low)
    return above and (whole.high is None or value < whole.high or (whole.high_closed and value == whole.high))
