"""Reads runs.csv."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pandas

from suave_des.errors import InputError
from suave_des.simulation.result import MissionMetrics

_KINDS = {"str": "str", "int": "int64", "float": "float64", "float | None": "float64", "bool": "bool"}
COLUMNS = {field.name: _KINDS[str(field.type)] for field in fields(MissionMetrics)}
"""Columns of runs.csv, with their types in a data frame."""


def read_runs(path: Path, *, needed: tuple[str, ...] = tuple(COLUMNS)) -> pandas.DataFrame:
    """The missions of a campaign; what is empty in the file is nan.

    Args:
        path: of a runs.csv; it may have further columns.
        needed: columns that it must have.

    Raises:
        InputError: there is no such file, it is no CSV file, it lacks a column, or one holds something else.
    """
    try:
        frame = pandas.read_csv(path, keep_default_na=False, na_values=[""])
    except FileNotFoundError:
        raise InputError(
            "no such file", file=path, remedy="give a runs.csv that suave-des campaign has written"
        ) from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy="give a runs.csv") from None
    missing = [name for name in needed if name not in frame.columns]
    if missing:
        raise InputError(f"has no column {missing[0]}", file=path, remedy=f"a runs.csv has {', '.join(needed)}")
    if frame["manager"].isna().any():
        raise InputError("has a mission without manager", file=path, remedy="give a runs.csv")
    for name, kind in COLUMNS.items():
        words = set(frame[name].astype("str")) if kind == "bool" and name in frame.columns else set()
        if not words <= {"True", "False"}:
            problem = f"{name} {min(words - {'True', 'False'})!r} is neither True nor False"
            raise InputError(problem, file=path, remedy="give a runs.csv")
    try:
        return frame.astype({name: kind for name, kind in COLUMNS.items() if name in frame.columns})
    except (ValueError, TypeError, OverflowError) as error:
        raise InputError(f"holds a value of the wrong kind: {error}", file=path, remedy="give a runs.csv") from None
