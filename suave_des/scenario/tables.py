"""Tables of a signal over time, from CSV files with the columns t_s and value."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from pathlib import Path

from suave_des.errors import InputError
from suave_des.scenario.distributions import LARGEST, LONGEST_S
from suave_des.scenario.wording import shown
from suave_des.scenario.yamlfile import decode, read_bytes

COLUMNS = ("t_s", "value")
_LARGEST = {"t_s": LONGEST_S, "value": LARGEST}
SIZE_LIMIT_BYTES = 20_000_000

Table = tuple[tuple[float, ...], tuple[float, ...]]
"""Times in s, strictly increasing, and the value at each."""


def read_table(path: Path) -> tuple[Table, str]:
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
