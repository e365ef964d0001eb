"""SWRL's built-ins, as Pellet's registry has them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from suave_des.knowledge.vocabulary import SWRLB

#: The sign of each built-in that compares two values.
COMPARISONS: Final[Mapping[str, str]] = MappingProxyType(
    {
        SWRLB + "equal": "=",
        SWRLB + "notEqual": "!=",
        SWRLB + "lessThan": "<",
        SWRLB + "lessThanOrEqual": "<=",
        SWRLB + "greaterThan": ">",
        SWRLB + "greaterThanOrEqual": ">=",
    }
)
#: The built-in of each sign.
COMPARISON_OF: Final[Mapping[str, str]] = MappingProxyType({sign: name for name, sign in COMPARISONS.items()})
_TESTING_TEXT: Final = ["contains", "containsIgnoreCase", "endsWith", "matches", "startsWith", "stringEqualIgnoreCase"]
#: Built-ins that compare, so that every argument must be bound; the others compute their first one.
TESTERS: Final = frozenset((*COMPARISONS, *(SWRLB + name for name in _TESTING_TEXT)))
#: Pellet's built-ins, with the least and the largest number of arguments.
BUILTINS: Final[Mapping[str, tuple[int, int]]] = MappingProxyType(
    dict.fromkeys(TESTERS, (2, 2))
    | {
        SWRLB + name: counts
        for names, counts in (
            ("abs ceiling cos floor round sin tan unaryMinus unaryPlus booleanNot", (2, 2)),
            ("lowerCase normalizeSpace stringLength upperCase", (2, 2)),
            ("divide integerDivide mod pow subtract", (3, 3)),
            ("add multiply", (3, 99)),
            ("roundHalfToEven", (2, 3)),
            ("stringConcat", (2, 99)),
            ("substring", (3, 4)),
            ("substringAfter substringBefore tokenize", (3, 3)),
            ("replace translate", (4, 4)),
            ("anyURI resolveURI", (2, 99)),
            ("date", (4, 5)),
            ("dateTime", (7, 8)),
            ("time", (4, 5)),
            ("dayTimeDuration", (2, 5)),
            ("yearMonthDuration", (2, 3)),
        )
        for name in names.split()
    }
)


def mirrored(sign: str) -> str:
    """The sign of a comparison with its sides exchanged: > for <."""
    return sign.translate(str.maketrans("<>", "><"))
