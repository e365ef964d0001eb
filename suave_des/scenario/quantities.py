"""Numbers with bounds, and distributions that may stand in their place: each run draws its own value.

Bounds are generous; beyond them nothing can be meant but a slip, or another unit: 10 km around the origin where the
pipeline is 60 m away, a current three times that of the strongest tides, a heading of once round either way, so that
degrees are noticed.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    Tag,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

_LEAST_SHARE = 0.001


class Strict(BaseModel):
    """Base of every part of a scenario: unknown keys and infinite numbers are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def wrong(problem: str, remedy: str, *keys: str) -> PydanticCustomError:
    """A validation error with its remedy; `keys` are those below that do not fit together."""
    return PydanticCustomError(
        "wrong", "{problem} ({remedy})", {"problem": problem, "remedy": remedy, "keys": " ".join(keys)}
    )


LARGEST = 1e12
"""Greatest magnitude of a number of which nothing else is known, such as a measured value in a unit of one's own."""
LONGEST_S = 1e9
"""Longest time: 31 years, in other words never. A bound of this magnitude is told only to those who exceed it."""

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, strict=True)]
"""A number written as one: "80" in quotes and true are none."""
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, strict=True)]
Period = Annotated[float, Field(ge=0.001, le=LONGEST_S, strict=True)]
"""Period of something that happens in mission time, in s; the limit keeps a slip from stopping the clock."""


class Normal(Strict):
    """Normal distribution, optionally cut to [minimum, maximum] (values outside are drawn again)."""

    distribution: Literal["normal"]
    """Bell-shaped."""
    mean: Number
    """Mean, before the cut."""
    std: NotNegative
    """Standard deviation, before the cut."""
    minimum: Number | None = None
    """Smallest value, if any."""
    maximum: Number | None = None
    """Greatest value, if any."""

    @model_validator(mode="after")
    def _interval_is_likely(self) -> Self:
        low = -math.inf if self.minimum is None else self.minimum
        high = math.inf if self.maximum is None else self.maximum
        if low > high:
            raise _reversed(low, high)
        if self.std == 0:
            share = 1.0 if low <= self.mean <= high else 0.0
        else:
            scale = self.std * math.sqrt(2)
            share = (math.erf((high - self.mean) / scale) - math.erf((low - self.mean) / scale)) / 2
        if share < _LEAST_SHARE:
            remedy = "move or widen it, or use distribution: uniform"
            raise wrong(
                f"[{low:g}, {high:g}] leaves next to nothing of the distribution",
                remedy,
                "minimum",
                "maximum",
            )
        return self

    def draw(self, stream: random.Random) -> float:
        """One value."""
        while True:
            value = stream.normalvariate(self.mean, self.std)
            if (self.minimum is None or value >= self.minimum) and (self.maximum is None or value <= self.maximum):
                return value


class Uniform(Strict):
    """Uniform distribution over [minimum, maximum]."""

    distribution: Literal["uniform"]
    """Every value between two bounds alike."""
    minimum: Number
    """Smallest value."""
    maximum: Number
    """Greatest value."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum > self.maximum:
            raise _reversed(self.minimum, self.maximum)
        return self

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return stream.uniform(self.minimum, self.maximum)


class Exponential(Strict):
    """Exponential distribution: `minimum` plus a time of the given mean."""

    distribution: Literal["exponential"]
    """Often small, seldom great."""
    mean: NotNegative
    """Mean of what is added to the minimum."""
    minimum: Number = 0.0
    """Smallest value."""

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return self.minimum + (stream.expovariate(1.0 / self.mean) if self.mean > 0 else 0.0)


class Choice(Strict):
    """One of the given values, each with equal chance; a value given twice counts twice."""

    distribution: Literal["choice"]
    """One of a list."""
    values: Annotated[tuple[Number, ...], Field(min_length=1)]
    """The values."""

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return stream.choice(self.values)


def _reversed(low: float, high: float) -> PydanticCustomError:
    return wrong(f"minimum {low:g} is above maximum {high:g}", "give the smaller one as minimum", "minimum", "maximum")


def ordered(minimum: float, maximum: float) -> None:
    """Raise the error of a minimum above the maximum."""
    if minimum > maximum:
        raise _reversed(minimum, maximum)


def one_of(key: str, known: str, otherwise: str | None = None, also: str = "") -> Discriminator:
    """Tell the members of a union apart by what a mapping says under a key.

    Args:
        key: the key.
        known: what it may say, separated by spaces.
        otherwise: member for what is no mapping.
        also: begins the remedy, as in "give a number, or ".
    """

    def tag(value: Any) -> str | None:
        found = value.get(key) if isinstance(value, dict) else getattr(value, key, otherwise)
        return found if isinstance(found, str) else None

    return Discriminator(
        tag,
        custom_error_type="wrong_kind",
        custom_error_message="{key} must be one of {known}",
        custom_error_context={"key": key, "known": known, "also": also},
    )


Distribution = Annotated[
    Annotated[float, Tag("number"), Field(strict=True)]
    | Annotated[Normal, Tag("normal")]
    | Annotated[Uniform, Tag("uniform")]
    | Annotated[Exponential, Tag("exponential")]
    | Annotated[Choice, Tag("choice")],
    one_of("distribution", "normal uniform exponential choice", "number", "give a number, or "),
]


def draw(distribution: float | Normal | Uniform | Exponential | Choice, stream: random.Random) -> float:
    """One value of a distribution; a plain number is its own value and draws nothing from the stream."""
    return distribution if isinstance(distribution, float | int) else distribution.draw(stream)


def stated(distribution: float | Normal | Uniform | Exponential | Choice) -> tuple[float, ...]:
    """The values that a scenario states for a distribution: itself, its mean, its bounds, its choices."""
    match distribution:
        case Normal():
            bounds = (distribution.mean, distribution.minimum, distribution.maximum)
            return tuple(bound for bound in bounds if bound is not None)
        case Uniform():
            return (distribution.minimum, distribution.maximum)
        case Exponential():
            return (distribution.minimum, distribution.minimum + distribution.mean)
        case Choice():
            return distribution.values
        case number:
            return (float(number),)


def upper_bound(distribution: float | Normal | Uniform | Exponential | Choice) -> float:
    """The greatest value that a distribution can give (inf for an exponential one, or a normal one without maximum)."""
    match distribution:
        case Normal():
            high = distribution.mean if distribution.std == 0 else float("inf")
            return high if distribution.maximum is None else distribution.maximum
        case Uniform():
            return distribution.maximum
        case Exponential():
            return distribution.minimum if distribution.mean == 0 else float("inf")
        case Choice():
            return max(distribution.values)
        case number:
            return float(number)


def lower_bound(distribution: float | Normal | Uniform | Exponential | Choice) -> float:
    """The smallest value that a distribution can give (-inf for a normal one without minimum)."""
    match distribution:
        case Normal():
            low = distribution.mean if distribution.std == 0 else float("-inf")
            return low if distribution.minimum is None else distribution.minimum
        case Uniform() | Exponential():
            return distribution.minimum
        case Choice():
            return min(distribution.values)
        case number:
            return float(number)


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
