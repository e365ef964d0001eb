"""Rows of a comparison's frames, for tests that look at one or a few of them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pandas

from suave_des.frame import CampaignFrame
from suave_des.results.comparison import Comparison
from suave_des.tables import rows_of


def compare_frame(frame: pandas.DataFrame, **choices: Any) -> Comparison:
    """Compare the missions of a frame."""
    missions = CampaignFrame(frame)
    missions.attrs |= frame.attrs
    return missions.compare(**choices)


def rows(frame: pandas.DataFrame) -> list[Any]:
    """Each row with its columns as attributes, None where there is nothing."""
    return [SimpleNamespace(**each) for each in rows_of(frame)]


def row(frame: pandas.DataFrame, **wanted: str) -> Any:
    """The one row that has these values."""
    (found,) = (each for each in rows(frame) if wanted.items() <= vars(each).items())
    return found


def difference(
    comparison: Comparison, first: str, second: str, metric: str = "search_time_s"
) -> Any:
    """How two groups differ in a metric."""
    return row(comparison.differences, group=first, other=second, metric=metric)


def interval(found: Any, name: str) -> tuple[float, float] | None:
    """Both ends of the interval of an estimate; None without one."""
    low, high = (getattr(found, f"{name}_ci95_{end}") for end in ("low", "high"))
    return None if low is None else (low, high)
