"""Kinds of signal over mission time for any quality attribute, and their CSV tables."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from suave_des.errors import line_error, number_of, shown
from suave_des.files import read_csv
from suave_des.scenario.quantities import (
    LARGEST,
    LONGEST_S,
    NotNegative,
    Number,
    Period,
    Real,
    ShiftDistribution,
    Strict,
    ValueDistribution,
    Within,
    ordered,
    wrong,
)


class Monitor(Strict):
    """Faults that any monitor can have."""

    dropout_probability: Annotated[Real, Within(0.0, 1.0)] = 0.0
    """Probability that a message is lost, independently for each message."""
    outages_s: tuple[tuple[NotNegative, NotNegative], ...] = ()
    """Intervals of mission time, [from, to], in which every message is lost."""

    @field_validator("outages_s", mode="after")
    @classmethod
    def _are_in_order(cls, value: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        for since_s, to_s in value:
            if since_s > to_s:
                raise wrong(f"the outage [{since_s:g}, {to_s:g}] ends before it begins", "give [from, to]")
        return value

    @property
    def loses_messages(self) -> bool:
        """Whether any message can be lost."""
        return self.dropout_probability > 0.0 or bool(self.outages_s)


class _Signal(Monitor):
    publishing_period_s: Period | None = None
    """Period of the monitor that measures it; by default the revision's visibility_publishing_period_s."""
    time_step_s: NotNegative = 1.0
    """Time is first truncated to a multiple of this (whole seconds in the exemplar); 0: not truncated."""
    noise: ValueDistribution = 0.0
    """Added to each measurement, drawn each time."""


class SinusoidSignal(_Signal):
    """A cosine that starts at its maximum.

    a cos(2 pi (t + shift) / period) + a + minimum, with a = (maximum - minimum) / 2, as in the exemplar.
    """

    kind: Literal["sinusoid"]
    """A cosine between minimum and maximum."""
    period_s: Period
    """Time from one maximum to the next."""
    minimum: Number
    """Smallest value."""
    maximum: Number
    """Greatest value, reached at t = -shift_s."""
    shift_s: ShiftDistribution = 0.0
    """Phase shift, drawn once per run."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        ordered(self.minimum, self.maximum)
        return self


class ConstantSignal(_Signal):
    """A constant value."""

    kind: Literal["constant"]
    """A constant value."""
    value: ValueDistribution
    """The value, drawn once per run."""


class StepSignal(_Signal):
    """One value until a time, another from then on."""

    kind: Literal["step"]
    """One value until a time, another from then on."""
    time_s: ShiftDistribution
    """Mission time of the step, drawn once per run."""
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


SignalDescription = Annotated[SinusoidSignal | ConstantSignal | StepSignal | TableSignal, Field(discriminator="kind")]


SignalTable = tuple[tuple[float, ...], tuple[float, ...]]
"""Times in s, strictly increasing, and the value at each."""
_LARGEST = {"t_s": LONGEST_S, "value": LARGEST}
"""Columns of a table, and the greatest magnitude in each."""
_COLUMNS = ",".join(_LARGEST)
_SIZE_LIMIT_BYTES = 20_000_000


def read_table(path: Path) -> tuple[SignalTable, str]:
    """Read the CSV file of a table signal: its times and values, and the SHA-256 of the file.

    Raises:
        InputError: with file and line: another header, a value that is not a finite number, times that do not
            increase, no row.
    """
    header, rows, digest = read_csv(path, _SIZE_LIMIT_BYTES, f"write lines of two numbers: {_COLUMNS}")
    if sorted(header) != sorted(_LARGEST):
        raise line_error(path, 1, f"the columns are {shown(','.join(header))}", f"the first line must be {_COLUMNS}")
    table: list[tuple[float, float]] = []
    for line, row in rows:
        if len(row) != len(header):
            remedy = f"each line has two, separated by a comma: {_COLUMNS}"
            raise line_error(path, line, f"has {number_of(len(row), 'value')}", remedy)
        cells = dict(zip(header, row, strict=True))
        time_s, value = (_number(path, line, column, cells[column]) for column in _LARGEST)
        if table and time_s <= table[-1][0]:
            remedy = "sort the rows, and give each time once"
            raise line_error(path, line, f"t_s {time_s:g} does not come after {table[-1][0]:g}", remedy)
        table.append((time_s, value))
    if not table:
        raise line_error(path, 1, "has no row under its header", f"write lines of two numbers: {_COLUMNS}")
    times_s, values = zip(*table, strict=True)
    return (times_s, values), digest


def _number(path: Path, line: int, column: str, cell: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        raise line_error(path, line, f"expected a number as {column}, got {shown(cell)}", "such as 12.5") from None
    if not math.isfinite(number):
        raise line_error(path, line, f"{column} {shown(cell)} is not finite", "leave that row out")
    if abs(number) > _LARGEST[column]:
        remedy = f"must be at least {-_LARGEST[column]:g} and at most {_LARGEST[column]:g}"
        raise line_error(path, line, f"{column} {shown(cell)} is out of range", remedy)
    return number
