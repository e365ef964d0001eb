"""Numbers and distributions within bounds beyond which nothing can be meant: a slip, or another unit.

They are generous: 10 km around the origin where the pipeline is 60 m away, a current three times that of the strongest
tides, a heading of once round either way, so that degrees are noticed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from suave_des.scenario.distributions import (
    LARGEST,
    LONGEST_S,
    Choice,
    Distribution,
    Exponential,
    Normal,
    Uniform,
    wrong,
)

AnyDistribution = float | Normal | Uniform | Exponential | Choice
FARTHEST_M = 10_000.0


@dataclass(frozen=True)
class Within:
    """Bounds of a number, or of the values that a distribution states; its spread is at most their distance.

    Attributes:
        ge: least value; none where another check looks at that.
        le: greatest value.
        unit: for the message.
    """

    ge: float | None
    le: float
    unit: str = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Check what the distribution's own checks have passed."""
        return core_schema.no_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The bounds of a plain number; JSON Schema does not apply them to mappings."""
        least = {} if self.ge is None else {"minimum": self.ge}
        return {**handler(schema), **least, "maximum": self.le}

    def _check(self, value: AnyDistribution) -> AnyDistribution:
        widest = self.le - (self.ge or 0.0)
        for key, part in _stated(value):
            if part > self.le or (self.ge is not None and part < self.ge):
                raise self._error(part, self.ge, self.le, key)
        for key, spread in _spreads(value):
            if spread > widest:
                raise self._error(spread, None, widest, key)
        return value

    def _error(self, part: float, least: float | None, greatest: float, key: str) -> Exception:
        bounds = f"at most {greatest:g}" if least is None else f"at least {least:g} and at most {greatest:g}"
        return wrong(f"{part:g} is out of range", f"must be {bounds} {self.unit}".rstrip(), key)


def _stated(value: AnyDistribution) -> Iterator[tuple[str, float]]:
    """The values that a distribution states, with their keys."""
    match value:
        case Choice():
            yield from (("values", each) for each in value.values)
        case Normal() | Uniform() | Exponential():
            keys = ("minimum", "maximum", *(("mean",) if isinstance(value, Normal) else ()))
            found = ((key, getattr(value, key, None)) for key in keys)
            yield from ((key, part) for key, part in found if part is not None)
        case number:
            yield "", float(number)


def _spreads(value: AnyDistribution) -> Iterator[tuple[str, float]]:
    if isinstance(value, Normal):
        yield "std", value.std
    elif isinstance(value, Exponential):
        yield "mean", value.mean


Coordinate = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M, strict=True)]
Length = Annotated[float, Field(gt=0, le=FARTHEST_M, strict=True)]
Duration = Annotated[float, Field(gt=0, le=LONGEST_S, strict=True)]
Speed = Annotated[float, Field(gt=0, le=100, strict=True)]

CoordinateDistribution = Annotated[Distribution, Within(-FARTHEST_M, FARTHEST_M, "m")]
HeadingDistribution = Annotated[Distribution, Within(-6.3, 6.3, "rad")]
CurrentDistribution = Annotated[Distribution, Within(-10.0, 10.0, "m/s")]
OffsetDistribution = Annotated[Distribution, Within(-100.0, 100.0, "m")]
TimeDistribution = Annotated[Distribution, Within(0.0, LONGEST_S, "s")]
DelayDistribution = Annotated[Distribution, Within(None, LONGEST_S, "s")]
ShiftDistribution = Annotated[Distribution, Within(-LONGEST_S, LONGEST_S, "s")]
ValueDistribution = Annotated[Distribution, Within(-LARGEST, LARGEST)]
