"""Distributions that may stand in place of a number; each run draws its own value from a named stream."""

from __future__ import annotations

import random
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator


class Strict(BaseModel):
    """Base of every part of a scenario: unknown keys and infinite numbers are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Normal(Strict):
    """Normal distribution, optionally cut to [minimum, maximum] (values outside are drawn again)."""

    distribution: Literal["normal"]
    mean: float
    std: Annotated[float, Field(ge=0)]
    minimum: float | None = None
    maximum: float | None = None

    @model_validator(mode="after")
    def _interval_holds_the_bulk(self) -> Self:
        low = self.mean - 4 * self.std if self.minimum is None else self.minimum
        high = self.mean + 4 * self.std if self.maximum is None else self.maximum
        if low > high or (self.std == 0 and not low <= self.mean <= high):
            raise ValueError(
                "minimum must not be above maximum, and the interval must hold values near the mean"
            )
        if self.mean + 4 * self.std < low or self.mean - 4 * self.std > high:
            raise ValueError("the interval [minimum, maximum] lies more than 4 std from the mean")
        return self

    def draw(self, stream: random.Random) -> float:
        """One value."""
        while True:
            value = stream.normalvariate(self.mean, self.std)
            if (self.minimum is None or value >= self.minimum) and (
                self.maximum is None or value <= self.maximum
            ):
                return value


class Uniform(Strict):
    """Uniform distribution over [minimum, maximum]."""

    distribution: Literal["uniform"]
    minimum: float
    maximum: float

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.minimum > self.maximum:
            raise ValueError(f"minimum {self.minimum} is above maximum {self.maximum}")
        return self

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return stream.uniform(self.minimum, self.maximum)


class Exponential(Strict):
    """Exponential distribution with the given mean, from `minimum` on."""

    distribution: Literal["exponential"]
    mean: Annotated[float, Field(ge=0)]
    minimum: float = 0.0

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return self.minimum + (stream.expovariate(1.0 / self.mean) if self.mean > 0 else 0.0)


class Choice(Strict):
    """One of the given values, each with equal chance; a value given twice counts twice."""

    distribution: Literal["choice"]
    values: Annotated[tuple[float, ...], Field(min_length=1)]

    def draw(self, stream: random.Random) -> float:
        """One value."""
        return stream.choice(self.values)


def _kind(value: Any) -> str | None:
    if isinstance(value, dict):
        kind = value.get("distribution")
        return kind if isinstance(kind, str) else None
    return getattr(value, "distribution", "number")


Distribution = Annotated[
    Annotated[float, Tag("number"), Field(strict=True)]
    | Annotated[Normal, Tag("normal")]
    | Annotated[Uniform, Tag("uniform")]
    | Annotated[Exponential, Tag("exponential")]
    | Annotated[Choice, Tag("choice")],
    Discriminator(
        _kind,
        custom_error_type="distribution",
        custom_error_message="must be a number or a mapping with distribution: normal, uniform, exponential or choice",
    ),
]


def draw(distribution: float | Normal | Uniform | Exponential | Choice, stream: random.Random) -> float:
    """One value of a distribution; a plain number is its own value and draws nothing from the stream."""
    return distribution if isinstance(distribution, float | int) else distribution.draw(stream)


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
