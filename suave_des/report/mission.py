"""Reads the files of one mission."""

from __future__ import annotations

import json
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
    """One mission as its files tell it.

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
        missing = [name for name in _METRICS if name not in metrics]
        np.array(scenario["pipeline"]["vertices_m"], dtype=float)
    except FileNotFoundError:
        raise InputError("no such file", file=path, remedy=_REMEDY) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"is no record of a mission: {error}", file=path, remedy=_REMEDY) from None
    if missing:
        raise InputError(f"is no record of a mission: {missing[0]} is missing", file=path, remedy=_REMEDY)
    text = {"source": "str", "event": "str", "detail": "str"}
    events = _table(folder / "events.csv", ("t_s", *text), text)
    columns = ("t_s", "x_m", "y_m", "z_m", "mode", "visibility_m")
    return MissionRecord(metrics, scenario, events, _table(folder / "trajectory.csv", columns, {"mode": "str"}))


def _table(path: Path, columns: tuple[str, ...], text: dict[str, str]) -> pandas.DataFrame:
    try:
        # "none" and "nan" may be words here, so that only numbers have something that counts as missing.
        frame = pandas.read_csv(path, dtype=text, keep_default_na=False, na_values={"visibility_m": [""]})
    except FileNotFoundError:
        raise InputError("no such file", file=path, remedy=_REMEDY) from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy=_REMEDY) from None
    missing = [name for name in columns if name not in frame.columns]
    if missing or frame.empty:
        problem = f"has no column {missing[0]}" if missing else "is empty"
        raise InputError(problem, file=path, remedy=_REMEDY)
    for name in columns:
        if name in _NUMBERS:
            _check_numbers(path, frame, name)
    return frame


def _check_numbers(path: Path, frame: pandas.DataFrame, name: str) -> None:
    numbers = pandas.to_numeric(frame[name], errors="coerce")
    wrong = ~np.isfinite(numbers) & frame[name].notna()
    if wrong.any():
        row = int(wrong.to_numpy().argmax())
        problem = f"{name} {str(frame[name].iloc[row])!r} is no finite number"
        raise InputError(problem, file=path, place=f"line {row + 2}", remedy=_REMEDY)
