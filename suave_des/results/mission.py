"""What the record of a mission says: its modes, failures and tasks over time, and its adaptations with their causes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas

from suave_des.domain import MAINTAIN_MOTION, UNGROUND_MODE
from suave_des.monitor.diagnostics import FAILED
from suave_des.records.mission_folder import MissionRecord
from suave_des.results.style import component_words, function_mode_words

_LATEST_REACTION_S = 5.0
"""What was reported earlier is not taken as the cause of an adaptation."""
_RECHARGED, _ROUNDING = 0.3, 0.01
_TASK_END_S = 3.0
"""A function whose task has ended is deactivated within this time; this does not count as an adaptation."""


class Span(NamedTuple):
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
        cause: its cause, in words; empty if it is not known.
    """

    t_s: float
    function: str
    before: str
    after: str
    cause: str = ""


def details(record: MissionRecord, event: str) -> list[tuple[float, str]]:
    """Return times and details of the events of one kind."""
    own = record.events[record.events["event"] == event]
    return list(zip(own["t_s"].astype(float), own["detail"], strict=True))


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


def component_changes(record: MissionRecord) -> Iterator[tuple[float, str, bool]]:
    """Yield when a component was reported as failed, or as working after a failure: time, its name, whether failed."""
    failed: set[str] = set()
    for t_s, detail in details(record, "component_status"):
        component, _, status = detail.partition(" ")
        if (status == FAILED) != (component in failed):
            failed ^= {component}
            yield t_s, component, status == FAILED


def failure_spans(record: MissionRecord) -> dict[str, list[Span]]:
    """Return the spans of failures, by failed component."""
    spans: dict[str, list[Span]] = {}
    for t_s, component, is_failed in component_changes(record):
        own = spans.setdefault(component, [])
        if is_failed:
            own.append(Span(t_s, record.end_s, FAILED))
        else:
            own[-1] = own[-1]._replace(end_s=t_s)
    return spans


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
    """Return the changes of modes in order of time, without first modes and those with which a task begins or ends."""
    ends_s = [span.end_s for span in task_spans(record)]
    found = []
    for function, spans in mode_spans(record).items():
        for before, after in pairwise(spans):
            lags_s = [after.begin_s - end_s for end_s in ends_s]
            is_task_end = after.what == UNGROUND_MODE and any(0.0 <= lag_s < _TASK_END_S for lag_s in lags_s)
            is_begin = before.what == UNGROUND_MODE and any(abs(before.begin_s - each) < _TASK_END_S for each in ends_s)
            # Two names for the same, such as two ways of being off, are no change.
            words = {function_mode_words(function, each.what) for each in (before, after)}
            if len(words) > 1 and not is_task_end and not is_begin:
                cause = _cause(record, function, before.what, after)
                found.append(Adaptation(after.begin_s, function, before.what, after.what, cause))
    return sorted(found, key=lambda each: each.t_s)


def _cause(record: MissionRecord, function: str, before: str, after: Span) -> str:
    """Return what was reported shortly before a change of mode and concerns its function."""
    if cause := _battery_cause(record, function, before, after):
        return cause
    if function == MAINTAIN_MOTION:
        causes = [
            (t_s, f"{component_words(component)} {'failed' if is_failed else 'recovered'}")
            for t_s, component, is_failed in component_changes(record)
        ]
    else:
        crossings = details(record, "visibility_crossing")
        causes = [(t_s, f"visibility {detail.split(' (')[0]}") for t_s, detail in crossings]
    recent = [(t_s, text) for t_s, text in causes if 0.0 <= after.begin_s - t_s <= _LATEST_REACTION_S]
    return max(recent)[1] if recent else ""


def _battery_cause(record: MissionRecord, function: str, before: str, after: Span) -> str:
    """Return the battery as the cause of a function's activation or deactivation, if it is."""
    level = battery_level(record)
    if level is None or function == MAINTAIN_MOTION or UNGROUND_MODE not in (before, after.what):
        return ""
    times = np.searchsorted(record.trajectory["t_s"], (after.begin_s - _LATEST_REACTION_S, after.begin_s))
    earlier, now = level.iloc[np.minimum(times, len(level) - 1)].astype(float)
    if now - earlier > _RECHARGED:
        return "battery recharged"
    is_low = now <= record.scenario["reaction_metric"]["battery_limit"] + _ROUNDING
    return f"battery at {now:.0%}" if is_low else ""


def battery_level(record: MissionRecord) -> pandas.Series[float] | None:
    """Return the battery's level, 0 to 1, at each point of the trajectory; None without a battery."""
    return record.trajectory.get("battery_level")
