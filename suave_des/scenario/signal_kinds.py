"""Kinds of signal over mission time that a scenario can give, for any quality attribute, and their CSV tables."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, Tag, model_validator

from suave_des.errors import InputError, shown
from suave_des.scenario.quantities import (
    LARGEST,
    LONGEST_S,
    Duration,
    NotNegative,
    Number,
    Period,
    ShiftDistribution,
    Strict,
    ValueDistribution,
    one_of,
    ordered,
)
from suave_des.scenario.yamlfile import decode, read_bytes


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


COLUMNS = ("t_s", "value")
_LARGEST = {"t_s": LONGEST_S, "value": LARGEST}
SIZE_LIMIT_BYTES = 20_000_000

SignalTable = tuple[tuple[float, ...], tuple[float, ...]]
"""Times in s, strictly increasing, and the value at each."""


def read_table(path: Path) -> tuple[SignalTable, str]:
    """Read a table: its times and values, and the SHA-256 of the file.

    Raises:
        InputError: with file and line: another header, a value that is no finite number, times that do not
            increase, no row.
    """
    content = read_bytes(path, SIZE_LIMIT_BYTES)
    rows = csv.reader(io.StringIO(decode(path, content), newline=""), strict=True)
    times: list[float] = []
    values: list[float] = []
    try:
        header = [name.strip() for name in next(rows, [])]
        if sorted(header) != sorted(COLUMNS):
            raise _error(path, 1, f"the columns are {shown(','.join(header))}", "the first line must be t_s,value")
        for row in rows:
            if not any(cell.strip() for cell in row):
                continue
            time_s, value = _numbers(path, rows.line_num, header, row)
            if times and time_s <= times[-1]:
                remedy = "sort the rows, and give each time once"
                raise _error(path, rows.line_num, f"t_s {time_s:g} does not come after {times[-1]:g}", remedy)
            times.append(time_s)
            values.append(value)
    except csv.Error as error:
        raise _error(
            path, rows.line_num, f"is not valid CSV: {error}", "write lines of two numbers: t_s,value"
        ) from None
    if not times:
        raise _error(path, 1, "has no row under its header", "write lines of two numbers: t_s,value")
    return (tuple(times), tuple(values)), hashlib.sha256(content).hexdigest()


def _numbers(path: Path, line: int, header: list[str], row: list[str]) -> tuple[float, float]:
    if len(row) != len(COLUMNS):
        raise _error(path, line, f"has {len(row)} values", "each line has two, separated by a comma: t_s,value")
    cells = dict(zip(header, row, strict=True))
    numbers = []
    for column in COLUMNS:
        try:
            number = float(cells[column])
        except ValueError:
            raise _error(path, line, f"{column} {shown(cells[column])} is no number", "such as 12.5") from None
        if not math.isfinite(number):
            raise _error(path, line, f"{column} {shown(cells[column])} is not finite", "leave that row out")
        if abs(number) > _LARGEST[column]:
            remedy = f"must be at least {-_LARGEST[column]:g} and at most {_LARGEST[column]:g}"
            raise _error(path, line, f"{column} {shown(cells[column])} is out of range", remedy)
        numbers.append(number)
    return numbers[0], numbers[1]


def _error(path: Path, line: int, problem: str, remedy: str) -> InputError:
    return InputError(problem, file=path, place=f"line {line}", remedy=remedy)
