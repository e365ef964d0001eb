"""Distributions that may stand in place of a number; each run draws its own value from a named stream."""

from __future__ import annotations

import math
import random
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

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
