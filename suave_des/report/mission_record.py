"""One mission as its files describe it: metrics, scenario, events, trajectory."""

from __future__ import annotations

import json
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas

from suave_des.domain import MAINTAIN_MOTION, UNGROUND_MODE
from suave_des.errors import InputError
from suave_des.monitor.diagnostics import FAILED
from suave_des.report.words import function_mode_words

_NUMBERS = ("t_s", "x_m", "y_m", "z_m", "visibility_m")
_METRICS = (
    *("scenario", "manager", "run", "seed", "search_time_s", "pipeline_found"),
    *("detection_x_m", "detection_y_m"),
)
_MISSING = {"visibility_m": [""], "battery_level": [""]}
_REMEDY = "give the --out folder of suave-des run"


@dataclass(frozen=True)
class MissionRecord:
    """One mission as its files describe it.

    Attributes:
        metrics: its row of runs.csv, by column.
        scenario: the scenario in full.
        events: events.csv.
        trajectory: trajectory.csv; mode is empty before the first one.
        rules: names of the rules that made a function be adapted, by time (s) and function; empty where not known.
    """

    metrics: dict[str, Any]
    scenario: dict[str, Any]
    events: pandas.DataFrame
    trajectory: pandas.DataFrame
    rules: Mapping[tuple[float, str], tuple[str, ...]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Scenario, manager, run and seed."""
        metrics = self.metrics
        return f"{metrics['scenario']}, {metrics['manager']}, run {metrics['run']}, seed {metrics['seed']}"

    @property
    def end_s(self) -> float:
        """Time of the trajectory's last point."""
        return float(self.trajectory["t_s"].iloc[-1])


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
    trajectory = _table(
        folder / "trajectory.csv", ("t_s", "x_m", "y_m", "z_m", "mode", "visibility_m"), optional=("battery_level",)
    )
    return MissionRecord(metrics, scenario, events, trajectory)


def _check_columns(path: Path, needed: Iterable[str], found: Container[str]) -> None:
    for name in needed:
        if name not in found:
            raise InputError(f"{name} is missing", file=path, remedy=_REMEDY)


def _table(path: Path, columns: tuple[str, ...], optional: tuple[str, ...] = ()) -> pandas.DataFrame:
    """Read a table of which `columns` are needed; those of _NUMBERS have finite numbers, the others are text.

    Columns of `optional` have finite numbers where they are there.
    """
    text = {name: "str" for name in columns if name not in _NUMBERS}
    try:
        # "none" and "nan" may be words here, so that only numbers have something that counts as missing.
        frame = pandas.read_csv(path, dtype=text, keep_default_na=False, na_values=_MISSING)
    except FileNotFoundError:
        raise InputError("no such file", file=path, remedy=_REMEDY) from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy=_REMEDY) from None
    _check_columns(path, columns, frame.columns)
    if frame.empty:
        raise InputError("is empty", file=path, remedy=_REMEDY)
    for name in (*(set(columns) & set(_NUMBERS)), *(set(optional) & set(frame.columns))):
        is_wrong = ~np.isfinite(pandas.to_numeric(frame[name], errors="coerce")) & frame[name].notna()
        for row in np.flatnonzero(is_wrong)[:1]:
            problem = f"{name}: expected a finite number, got {str(frame[name].iloc[row])!r}"
            raise InputError(problem, file=path, place=f"line {row + 2}", remedy=_REMEDY)
    return frame


# What a record says of the mission, for figures.


@dataclass(frozen=True, slots=True)
class Span:
    """A span of time in which something holds: a mode, a failure, a task."""

    begin_s: float
    end_s: float
    what: str


@dataclass(frozen=True, slots=True)
class Adaptation:
    """A change of the mode of a function in use.

    Attributes:
        t_s: when it took effect.
        function: whose mode changed.
        before: its mode before; likewise after.
        cause: its cause, in words.
    """

    t_s: float
    function: str
    before: str
    after: str
    cause: str = ""


_LATEST_REACTION_S = 5.0
"""What was reported earlier is not taken as the cause of an adaptation."""
_RECHARGED, _ROUNDING = 0.3, 0.01
_TASK_END_S = 3.0
"""A function whose task has ended is deactivated within this time; this does not count as an adaptation."""


def mode_spans(record: MissionRecord) -> dict[str, list[Span]]:
    """Return the spans of each function's modes."""
    changes: dict[str, list[tuple[float, str]]] = {}
    for t_s, detail in details(record, "mode_set"):
        function, _, mode = detail.partition(" = ")
        changes.setdefault(function, []).append((t_s, mode))
    return {
        function: [Span(begin_s, end_s, mode) for (begin_s, mode), (end_s, _) in pairwise([*own, (record.end_s, "")])]
        for function, own in changes.items()
    }


def failure_spans(record: MissionRecord) -> dict[str, list[Span]]:
    """Return the spans of failures, by failed component."""
    spans: dict[str, list[Span]] = {}
    end_s = record.end_s
    for t_s, detail in details(record, "component_status"):
        component, _, status = detail.partition(" ")
        own = spans.setdefault(component, [])
        is_failed = bool(own) and own[-1].end_s == end_s
        if status == FAILED and not is_failed:
            own.append(Span(t_s, end_s, status))
        elif status != FAILED and is_failed:
            own[-1] = Span(own[-1].begin_s, t_s, own[-1].what)
    return {component: own for component, own in spans.items() if own}


def task_spans(record: MissionRecord) -> list[Span]:
    """Return the spans of the tasks."""
    open_s: dict[str, float] = {}
    spans = []
    for t_s, event, detail in zip(*(record.events[name] for name in ("t_s", "event", "detail")), strict=True):
        if event == "task_requested":
            open_s[detail] = float(t_s)
        elif event in ("task_done", "task_cancelled") and detail in open_s:
            spans.append(Span(open_s.pop(detail), float(t_s), detail))
    return [*spans, *(Span(begin_s, record.end_s, task) for task, begin_s in open_s.items())]


def adaptations(record: MissionRecord) -> list[Adaptation]:
    """Return the changes of modes, neither first modes nor those with which a task ends among them."""
    ends_s = [span.end_s for span in task_spans(record)]
    found = []
    for function, spans in mode_spans(record).items():
        for before, after in pairwise(spans):
            is_task_end = after.what == UNGROUND_MODE and any(
                0.0 <= after.begin_s - end_s < _TASK_END_S for end_s in ends_s
            )
            is_begin = before.what == UNGROUND_MODE and any(
                abs(before.begin_s - end_s) < _TASK_END_S for end_s in ends_s
            )
            if function_mode_words(function, before.what) == function_mode_words(function, after.what):
                continue  # two names for the same, such as two ways of being off
            if not is_task_end and not is_begin:
                found.append(Adaptation(after.begin_s, function, before.what, after.what))
    return [_with_cause(each, record) for each in sorted(found, key=lambda each: each.t_s)]


def _with_cause(found: Adaptation, record: MissionRecord) -> Adaptation:
    """Add what was reported shortly before an adaptation and concerns its function."""
    if cause := _battery_cause(found, record):
        return replace(found, cause=cause)
    causes = []
    if found.function == MAINTAIN_MOTION:
        for component, spans in failure_spans(record).items():
            name = component.removeprefix("c_").replace("_", " ")
            causes += [(span.begin_s, f"{name} failed") for span in spans]
            causes += [(span.end_s, f"{name} recovered") for span in spans]
    else:
        crossings = details(record, "visibility_crossing")
        causes += [(t_s, f"visibility {detail.split(' (')[0]}") for t_s, detail in crossings]
    recent = [(t_s, text) for t_s, text in causes if 0.0 <= found.t_s - t_s <= _LATEST_REACTION_S]
    return replace(found, cause=max(recent)[1]) if recent else found


def _battery_cause(found: Adaptation, record: MissionRecord) -> str:
    """Return the battery as the cause of a function's activation or deactivation, if it is."""
    level = battery_level(record)
    if level is None or found.function == MAINTAIN_MOTION or UNGROUND_MODE not in (found.before, found.after):
        return ""
    at = int(np.searchsorted(record.trajectory["t_s"], found.t_s))
    earlier = int(np.searchsorted(record.trajectory["t_s"], found.t_s - _LATEST_REACTION_S))
    before, now = float(level.iloc[earlier]), float(level.iloc[min(at, len(level) - 1)])
    if now - before > _RECHARGED:
        return "battery recharged"
    is_low = now <= record.scenario["reaction_metric"]["battery_limit"] + _ROUNDING
    return f"battery at {now:.0%}" if is_low else ""


def battery_level(record: MissionRecord) -> pandas.Series[float] | None:
    """Return the battery's level, 0 to 1, at each point of the trajectory; None without a battery."""
    return record.trajectory.get("battery_level")


def details(record: MissionRecord, event: str) -> list[tuple[float, str]]:
    """Return times and details of the events of one kind."""
    own = record.events[record.events["event"] == event]
    return list(zip(own["t_s"].astype(float), own["detail"], strict=True))
