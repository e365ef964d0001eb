"""The figures of the paper's table, made from the 60 published runs behind it (SEAMS 2023, arXiv:2303.09220)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from suave_des.estimates import Estimate, estimate
from suave_des.report.runs import read_runs
from suave_des.resources import shipped_folder

METRICS = {"search_time_s": "search time (s)", "distance_inspected_m": "distance inspected (m)"}
"""Metrics of the table, with their titles."""

_PAPER_ORDER = {"none": 0, "random": 1, "metacontrol": 2}

Figures = Mapping[tuple[str, str], Estimate]
"""What is known of metrics, by (manager, metric)."""


def published_runs() -> Path:
    """The shipped file of published runs."""
    return shipped_folder("scenarios") / "published" / "seams2023_runs.csv"


def published_figures(path: Path | None = None) -> Figures:
    """Figures of published runs, managers in the order of the paper's table.

    Args:
        path: of the runs; left out, the shipped ones.

    Raises:
        InputError: the file cannot be read, or lacks a column.
    """
    runs = read_runs(path or published_runs(), needed=("manager", *METRICS))
    names = sorted(runs["manager"].unique(), key=lambda name: _PAPER_ORDER.get(name, len(_PAPER_ORDER)))
    return {
        (name, metric): estimate(runs.loc[runs["manager"] == name, metric].tolist())
        for name in names
        for metric in METRICS
    }
