"""Numbers with bounds, and distributions that may replace them: each run draws its own value.

Bounds are generous; a value beyond them can only be a slip, or in a different unit: 10 km around the origin where the
pipeline is 60 m away, a current three times that of the strongest tides, a heading of once round either way, so that
degrees are noticed.
"""

from __future__ import annotations

import math
import random
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

LARGEST = 1e12
"""Greatest magnitude of a number without bounds of its own, such as a measured value in a unit of the user's."""
LONGEST_S = 1e9
"""Longest time: 31 years, in other words never."""
FARTHEST_M = 10_000.0
_LEAST_SHARE = 0.001


class Strict(BaseModel):
    """Base of every part of a scenario: unknown keys and infinite numbers are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def wrong(problem: str, remedy: str, *keys: str) -> PydanticCustomError:
    """A validation error with its remedy; `keys` are those below that do not fit together."""
    return PydanticCustomError(
        "wrong", "{problem} ({remedy})", {"problem": problem, "remedy": remedy, "keys": " ".join(keys)}
    )


def ordered(low: float, high: float, low_key: str = "minimum", high_key: str = "maximum") -> None:
    """Raise an error, in the words of the keys, if the lower of two bounds is above the other one."""
    if low > high:
        problem = f"{low_key} {low:g} is above {high_key} {high:g}"
        raise wrong(problem, f"give the smaller one as {low_key}", low_key, high_key)


@dataclass(frozen=True)
class Within:
    """Bounds of a number or of what a distribution in its place states; its spread is at most their distance.

    Attributes:
        ge: least value.
        le: greatest value.
        is_floor: whether a distribution must not be able to give values below `ge` either.
        draws_are_cut: whether values that are drawn below `ge` count as `ge`, so that they may be stated.
    """

    ge: float
    le: float
    is_floor: bool = False
    draws_are_cut: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Check what the type's own checks have passed."""
        return core_schema.no_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Bounds of a plain number; JSON Schema does not apply them to mappings."""
        return {**handler(schema), "minimum": self.ge, "maximum": self.le}

    def _check(self, value: AnyDistribution) -> AnyDistribution:
        low, high = self.ge, self.le
        for key, part in _stated(value):
            # A normal distribution that is cut at the floor may have its mean below.
            reaches_below = self.draws_are_cut and bool(key)
            least = -high if reaches_below or (self.is_floor and key == "mean") else low
            if not least <= part <= high:
                raise wrong(f"{part:.12g} is out of range", f"must be at least {low:.12g} and at most {high:.12g}", key)
        if isinstance(value, Normal) and value.std > high - low:
            raise wrong(f"{value.std:g} is out of range", f"must be at most {high - low:g}", "std")
        if self.is_floor and support(value)[0] < low:
            raise wrong(f"values below {low:g} can be drawn", f"give a minimum that is at least {low:g}")
        if self.draws_are_cut and support(value)[1] < low:
            raise wrong(f"only values below {low:g} can be drawn", f"give a greatest value that is at least {low:g}")
        return value


Real = Annotated[float, Field(strict=True)]
"""A number written as one: "80" in quotes and true are none."""
Name = Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_.-]*$", max_length=100)]
Number = Annotated[Real, Field(ge=-LARGEST, le=LARGEST)]
NotNegative = Annotated[Real, Field(ge=0, le=LARGEST)]
Share = Annotated[Real, Field(ge=0, le=1)]
Coordinate = Annotated[Real, Field(ge=-FARTHEST_M, le=FARTHEST_M)]
Length = Annotated[Real, Field(gt=0, le=FARTHEST_M)]
Duration = Annotated[Real, Field(gt=0, le=LONGEST_S)]
Period = Annotated[Real, Field(ge=0.001, le=LONGEST_S)]
"""Period of something that happens in mission time; the lower limit keeps a slip from stopping the clock."""


class Drawn(Strict):
    """Base of distributions."""

    shared: Name | None = None
    """Name of a draw that several keys share: distributions of the same kind and width are then shifted alike."""


class Normal(Drawn):
    """Normal distribution, truncated to [minimum, maximum]."""

    distribution: Literal["normal"]
    """Bell-shaped."""
    mean: Number
    """Mean before truncation."""
    std: NotNegative
    """Standard deviation before truncation."""
    minimum: Number | None = None
    """Smallest value, if any."""
    maximum: Number | None = None
    """Greatest value, if any."""

    @property
    def interval(self) -> tuple[float, float]:
        """Smallest and greatest value, infinite where there is none."""
        low, high = self.minimum, self.maximum
        return -math.inf if low is None else low, math.inf if high is None else high

    @model_validator(mode="after")
    def _interval_is_likely(self) -> Self:
        low, high = self.interval
        ordered(low, high)
        if self.std == 0:
            share = 1.0 if low <= self.mean <= high else 0.0
        else:
            scale = self.std * math.sqrt(2)
            share = (math.erf((high - self.mean) / scale) - math.erf((low - self.mean) / scale)) / 2
        if share < _LEAST_SHARE:
            problem = f"[{low:g}, {high:g}] leaves next to nothing of the distribution"
            raise wrong(problem, "move or widen it, or use distribution: uniform", "minimum", "maximum")
        return self

    def draw(self, stream: random.Random) -> float:
        """One value."""
        low, high = self.interval
        while not low <= (value := stream.normalvariate(self.mean, self.std)) <= high:
            pass
        return value


class Uniform(Drawn):
    """Uniform distribution over [minimum, maximum]."""

    distribution: Literal["uniform"]
    """All values between two bounds, with equal density."""
    minimum: Number
    """Smallest value."""
    maximum: Number
    """Greatest value."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        ordered(self.minimum, self.maximum)
        return self

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return stream.uniform(self.minimum, self.maximum)


class Exponential(Drawn):
    """Exponential distribution: `minimum` plus an exponential value of the given mean."""

    distribution: Literal["exponential"]
    """Mostly small values, rarely large ones."""
    mean: NotNegative
    """Mean distance from the minimum."""
    minimum: Number = 0.0
    """Smallest value."""

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return self.minimum + (stream.expovariate(1.0 / self.mean) if self.mean > 0 else 0.0)


class Choice(Drawn):
    """One of the given values, each with equal probability; a value given twice counts twice."""

    distribution: Literal["choice"]
    """One of a list."""
    values: Annotated[tuple[Number, ...], Field(min_length=1)]
    """The values."""

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return stream.choice(self.values)


AnyDistribution = float | Normal | Uniform | Exponential | Choice


def _tag(value: Any) -> str | None:
    if isinstance(value, dict):
        value = value.get("distribution")
        return value if isinstance(value, str) else None
    return getattr(value, "distribution", "number")


Distribution = Annotated[
    Annotated[Real, Tag("number")]
    | Annotated[Normal, Tag("normal")]
    | Annotated[Uniform, Tag("uniform")]
    | Annotated[Exponential, Tag("exponential")]
    | Annotated[Choice, Tag("choice")],
    Discriminator(
        _tag,
        custom_error_type="wrong",
        custom_error_message="{problem}",
        custom_error_context={
            "problem": "is no distribution that is known",
            "remedy": "give a number, or distribution: normal, uniform, exponential or choice",
            "keys": "distribution",
        },
    ),
]

CoordinateDistribution = Annotated[Distribution, Within(-FARTHEST_M, FARTHEST_M)]
HeadingDistribution = Annotated[Distribution, Within(-6.3, 6.3)]
CurrentDistribution = Annotated[Distribution, Within(-10.0, 10.0)]
OffsetDistribution = Annotated[Distribution, Within(-100.0, 100.0)]
DelayDistribution = Annotated[Distribution, Within(0.0, LONGEST_S, is_floor=True)]
TimeDistribution = Annotated[Distribution, Within(0.0, LONGEST_S, draws_are_cut=True)]
"""A time; one that is drawn below 0 counts as 0."""
ShiftDistribution = Annotated[Distribution, Within(-LONGEST_S, LONGEST_S)]
ValueDistribution = Annotated[Distribution, Within(-LARGEST, LARGEST)]


def draw(distribution: AnyDistribution, stream: random.Random) -> float:
    """One value of a distribution; a plain number is its own value and draws nothing from the stream."""
    return distribution if isinstance(distribution, float | int) else distribution.draw(stream)


def mean(distribution: AnyDistribution) -> float:
    """Mean of a distribution; of a normal one before it is cut."""
    match distribution:
        case Normal():
            return distribution.mean
        case Uniform():
            return (distribution.minimum + distribution.maximum) / 2
        case Exponential():
            return distribution.minimum + distribution.mean
        case Choice():
            return sum(distribution.values) / len(distribution.values)
        case number:
            return float(number)


def _stated(distribution: AnyDistribution) -> list[tuple[str, float]]:
    """The values that a scenario states for a distribution, with their keys: itself, its mean, bounds, choices."""
    match distribution:
        case Normal():
            stated = {"mean": distribution.mean, "minimum": distribution.minimum, "maximum": distribution.maximum}
            return [(key, value) for key, value in stated.items() if value is not None]
        case Uniform():
            return [("minimum", distribution.minimum), ("maximum", distribution.maximum)]
        case Exponential():
            return [("minimum", distribution.minimum), ("mean", distribution.minimum + distribution.mean)]
        case Choice():
            return [("values", value) for value in distribution.values]
        case number:
            return [("", float(number))]


def support(distribution: AnyDistribution) -> tuple[float, float]:
    """Smallest and greatest value that a distribution can give, infinite where nothing limits it."""
    match distribution:
        case Normal(std=0):
            return distribution.mean, distribution.mean
        case Normal():
            return distribution.interval
        case Exponential():
            return distribution.minimum, distribution.minimum if distribution.mean == 0 else math.inf
        case _:
            values = [value for _, value in _stated(distribution)]
            return min(values), max(values)
