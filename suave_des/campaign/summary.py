"""summary.csv: the figures of each manager."""

from __future__ import annotations

from array import array

from suave_des.campaign.outcomes import COLUMNS, Row
from suave_des.estimates import Estimate, estimate

METRICS = ("search_time_s", "distance_inspected_m")
"""Metrics that are summarised: those of the paper's table."""
METRIC_TITLES = dict(zip(METRICS, ("search time, s", "distance, m"), strict=True))
"""What they are called in tables."""
_FIGURES = ("mean", "std", "median", "ci95_low", "ci95_high")

SUMMARY_COLUMNS = (
    "manager",
    "n",
    "found_share",
    *(f"{metric}_{figure}" for metric in METRICS for figure in _FIGURES),
)
"""Columns of summary.csv."""

_FOUND = COLUMNS.index("pipeline_found")
_PLACES = tuple(COLUMNS.index(metric) for metric in METRICS)


class Tally:
    """The figures of one manager's missions, gathered row by row; of each metric only the numbers are kept."""

    def __init__(self) -> None:
        self._rows = self._found = 0
        self._values = tuple(array("d") for _ in METRICS)

    def add(self, row: Row) -> None:
        """Count a row of runs.csv."""
        self._rows += 1
        self._found += bool(row[_FOUND])
        for values, place in zip(self._values, _PLACES, strict=True):
            value = row[place]
            if value is not None:
                values.append(float(value))

    def figures(self) -> Row:
        """Cells of summary.csv after the first; a figure that needs more missions than there are is none."""
        share = self._found / self._rows if self._rows else None
        return (self._rows, share, *(figure for values in self._values for figure in _figures(estimate(values))))


def _figures(found: Estimate) -> Row:
    low, high = found.mean_interval or (None, None)
    return (found.mean, found.std, found.median, low, high)
