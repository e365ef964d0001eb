"""Signals over mission time: what monitors measure, for any quality attribute."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, Tag, model_validator

from suave_des.scenario.distributions import (
    NotNegative,
    Number,
    Period,
    Strict,
    one_of,
    ordered,
)
from suave_des.scenario.quantities import Duration, ShiftDistribution, ValueDistribution


class _Signal(Strict):
    publishing_period_s: Period | None = None
    """Period of the monitor that measures it; left out: the revision's visibility_publishing_period_s."""
    time_step_s: NotNegative = 1.0
    """Time is cut to multiples of this first (whole seconds in the exemplar); 0: not cut."""
    noise: ValueDistribution = 0.0
    """Added to each measurement, drawn anew each time."""


class SinusoidSignal(_Signal):
    """A cosine that starts at its maximum.

    a cos(2 pi (t + shift) / period) + a + minimum, with a = (maximum - minimum) / 2, as in the exemplar.
    """

    kind: Literal["sinusoid"]
    """A cosine between minimum and maximum."""
    period_s: Duration
    """Time from one maximum to the next."""
    minimum: Number
    """Smallest value."""
    maximum: Number
    """Greatest value, reached at t = -shift_s."""
    shift_s: ShiftDistribution = 0.0
    """Phase shift, drawn once a run."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        ordered(self.minimum, self.maximum)
        return self


class ConstantSignal(_Signal):
    """The same value all the time."""

    kind: Literal["constant"]
    """The same value all the time."""
    value: ValueDistribution
    """The value, drawn once a run."""


class StepSignal(_Signal):
    """One value until a time, another from then on."""

    kind: Literal["step"]
    """One value until a time, another from then on."""
    time_s: ShiftDistribution
    """Mission time of the step, drawn once a run."""
    before: Number
    """Value before the step."""
    after: Number
    """Value from the step on."""


class TableSignal(_Signal):
    """Values over time from a CSV file."""

    kind: Literal["table"]
    """Values over time from a CSV file."""
    file: Annotated[str, Field(min_length=1)]
    """CSV file with columns t_s and value."""
    interpolation: Literal["previous", "linear"] = "previous"
    """Between two rows: the earlier row's value, or a straight line."""


Signal = Annotated[
    Annotated[SinusoidSignal, Tag("sinusoid")]
    | Annotated[ConstantSignal, Tag("constant")]
    | Annotated[StepSignal, Tag("step")]
    | Annotated[TableSignal, Tag("table")],
    one_of("kind", "sinusoid constant step table"),
]
