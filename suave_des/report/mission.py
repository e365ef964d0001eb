"""Read the files of one mission."""

from __future__ import annotations

import json
from collections.abc import Container, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas

from suave_des.errors import InputError

_NUMBERS = ("t_s", "x_m", "y_m", "z_m", "visibility_m")
_METRICS = (
    *("scenario", "manager", "run", "seed", "search_time_s", "pipeline_found"),
    *("detection_x_m", "detection_y_m"),
)
_REMEDY = "give the --out folder of suave-des run"


@dataclass(frozen=True)
class MissionRecord:
    """One mission as its files describe it.

    Attributes:
        metrics: its row of runs.csv, by column.
        scenario: the scenario in full.
        events: events.csv.
        trajectory: trajectory.csv; mode is empty before the first one.
    """

    metrics: dict[str, Any]
    scenario: dict[str, Any]
    events: pandas.DataFrame
    trajectory: pandas.DataFrame


def read_mission(folder: Path) -> MissionRecord:
    """Read mission.json, events.csv and trajectory.csv.

    Raises:
        InputError: one of them is missing, or is not what a mission writes.
    """
    path = folder / "mission.json"
    try:
        mission = json.loads(path.read_text(encoding="utf-8"))
        metrics, scenario = mission["metrics"], mission["scenario"]
        np.array(scenario["pipeline"]["vertices_m"], dtype=float)
        _check_columns(path, _METRICS, metrics)
    except FileNotFoundError:
        raise InputError("no such file", file=path, remedy=_REMEDY) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"is not the record of a mission: {error}", file=path, remedy=_REMEDY) from None
    events = _table(folder / "events.csv", ("t_s", "source", "event", "detail"))
    trajectory = _table(folder / "trajectory.csv", ("t_s", "x_m", "y_m", "z_m", "mode", "visibility_m"))
    return MissionRecord(metrics, scenario, events, trajectory)


def _check_columns(path: Path, needed: Iterable[str], found: Container[str]) -> None:
    for name in needed:
        if name not in found:
            raise InputError(f"{name} is missing", file=path, remedy=_REMEDY)


def _table(path: Path, columns: tuple[str, ...]) -> pandas.DataFrame:
    """Read a table of which `columns` are needed; those of _NUMBERS have finite numbers, the others are text."""
    text = {name: "str" for name in columns if name not in _NUMBERS}
    try:
        # "none" and "nan" may be words here, so that only numbers have something that counts as missing.
        frame = pandas.read_csv(path, dtype=text, keep_default_na=False, na_values={"visibility_m": [""]})
    except FileNotFoundError:
        raise InputError("no such file", file=path, remedy=_REMEDY) from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy=_REMEDY) from None
    _check_columns(path, columns, frame.columns)
    if frame.empty:
        raise InputError("is empty", file=path, remedy=_REMEDY)
    for name in set(columns) & set(_NUMBERS):
        is_wrong = ~np.isfinite(pandas.to_numeric(frame[name], errors="coerce")) & frame[name].notna()
        for row in np.flatnonzero(is_wrong)[:1]:
            problem = f"{name}: expected a finite number, got {str(frame[name].iloc[row])!r}"
            raise InputError(problem, file=path, place=f"line {row + 2}", remedy=_REMEDY)
    return frame
