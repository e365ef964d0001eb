"""summary.csv: the figures of each manager."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from suave_des.campaign.outcomes import COLUMNS, Row
from suave_des.estimates import Estimate, estimate

METRICS = ("search_time_s", "distance_inspected_m")
"""Metrics that are summarised: those of the paper's table."""
_FIGURES = ("mean", "std", "median", "ci95_low", "ci95_high")

SUMMARY_COLUMNS = (
    "manager",
    "n",
    "found_share",
    *(f"{metric}_{figure}" for metric in METRICS for figure in _FIGURES),
)
"""Columns of summary.csv."""

_MANAGER, _FOUND = COLUMNS.index("manager"), COLUMNS.index("pipeline_found")


def summary_rows(managers: Sequence[str], rows: Iterable[Row]) -> list[Row]:
    """A row for each manager, in the order given; a figure that needs more missions than there are is none."""
    by_manager: dict[str, list[Row]] = {manager: [] for manager in managers}
    for row in rows:
        by_manager[str(row[_MANAGER])].append(row)
    return [_summary(manager, own) for manager, own in by_manager.items()]


def _summary(manager: str, rows: Sequence[Row]) -> Row:
    share = sum(bool(row[_FOUND]) for row in rows) / len(rows) if rows else None
    figures = [figure for metric in METRICS for figure in _figures(estimate(_values(rows, metric)))]
    return (manager, len(rows), share, *figures)


def _values(rows: Sequence[Row], metric: str) -> list[float]:
    place = COLUMNS.index(metric)
    return [float(value) for row in rows if (value := row[place]) is not None]


def _figures(found: Estimate) -> Row:
    low, high = found.mean_interval or (None, None)
    return (found.mean, found.std, found.median, low, high)
