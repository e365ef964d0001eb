"""The metrics of missions: what each column of runs.csv is, which values are better, and how
sentences say so.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from operator import attrgetter
from pathlib import Path

from suave_des.estimates import Estimate
from suave_des.files import rounded
from suave_des.metrics.result import MissionMetrics, MissionResult

COLUMN_TYPES = {
    field.name: str(field.type).removesuffix(" | None") for field in fields(MissionMetrics)
}
"""Columns of runs.csv that every campaign has, and the names of their types."""
COLUMNS = tuple(COLUMN_TYPES)
SEARCH_TIME, DISTANCE = "search_time_s", "distance_inspected_m"
FOUND, REACTION_TIME = "pipeline_found", "mean_reaction_time_s"
DURATION, DETECTION_TIME = "mission_duration_s", "detection_time_s"
REQUIREMENT = "requirement_"
"""Beginning of the columns of a scenario's requirements."""

Row = tuple[str | int | float | bool | None, ...]
"""Cells of a file of results."""
_cells: Callable[[MissionMetrics], Row] = attrgetter(*COLUMNS)


def row_of(metrics: MissionMetrics) -> Row:
    """Return the cells of runs.csv, rounded as in the file, from which all statistics are
    computed.
    """
    return tuple(map(rounded, _cells(metrics)))


def further_of(result: MissionResult) -> Row:
    """Return the cells of the columns that the scenario asks for, rounded likewise."""
    return tuple(map(rounded, result.further.values()))


@dataclass(frozen=True, slots=True)
class Metric:
    """A metric, with phrases for sentences about it.

    Attributes:
        name: column of runs.csv.
        title: in words, without unit.
        unit: of its values; empty for numbers without one.
        better: 1 if more is better, -1 if less is, 0 if neither.
        less: a sentence about who has less: "finds the pipeline {} sooner than"; likewise more.
        most: phrase for the best mean: "finds the pipeline soonest"; empty if none is better.
        half_width: of the intervals for which the number of runs is given, if none is asked for; 0:
            5% of the mean.
        decimals, interval_decimals: of its values and of its intervals, in tables and sentences.
        short: of its heading, where there is little room; empty: the title.
    """

    name: str
    title: str
    unit: str = ""
    better: int = 0
    less: str = ""
    more: str = ""
    most: str = ""
    half_width: float = 0.0
    decimals: int = 2
    interval_decimals: int = 1
    short: str = ""

    @property
    def heading(self) -> str:
        """Title and unit, as tables and axes have it."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    @property
    def brief(self) -> str:
        """Title and unit for a narrow column."""
        return f"{self.short or self.title}{self.unit and f', {self.unit}'}"

    @property
    def scale(self) -> float:
        """What values are multiplied by in tables: shares are in per cent."""
        return 100.0 if self.name == FOUND else 1.0

    def number(self, value: float | None) -> str:
        """Write a value for a table: a share in per cent, others with the paper's decimals; empty
        for None and nan.
        """
        if value is None or value != value:
            return ""
        return f"{self.scale * value:.{self.decimals}f}{'%' if self.name == FOUND else ''}"

    def interval(self, found: Estimate) -> str:
        """Write an interval for a table; empty if there is none."""
        text = found.text(f".{self.interval_decimals}f", self.scale)
        return f"{text}%" if text and self.name == FOUND else text

    def difference(self, value: float) -> str:
        """Write a difference for a table: one of shares in points, which are percentage points."""
        points = " points" if self.name == FOUND else ""
        return f"{self.scale * value:.{self.decimals}f}{points}"

    def difference_interval(self, found: Estimate) -> str:
        """Write the interval of a difference for a table; empty if there is none."""
        text = found.text(f".{self.interval_decimals}f", self.scale)
        return f"{text} points" if text and self.name == FOUND else text

    def amount(self, value: float) -> str:
        """Write a difference's size for a sentence, with its unit."""
        unit = "percentage points" if self.name == FOUND else self.unit
        return f"{self.scale * value:.{self.decimals}f} {unit}".strip()


def _read() -> Iterator[Metric]:
    """Read metrics.csv, beside this module."""
    types = {"better": int, "half_width": float, "decimals": int, "interval_decimals": int}
    with Path(__file__).with_suffix(".csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            yield Metric(**{name: types.get(name, str)(text) for name, text in row.items()})


METRICS: Mapping[str, Metric] = {metric.name: metric for metric in _read()}
"""Metrics by name: those of every mission, and those that a scenario may ask for."""
PAPER_METRICS = (SEARCH_TIME, DISTANCE)
"""Those of the paper's table."""


def metric_of(column: str) -> Metric | None:
    """Return the metric of a column; None for one that has something else, such as a swept
    value.
    """
    if column.startswith(REQUIREMENT):
        name = column.removeprefix(REQUIREMENT)
        return Metric(
            column,
            f"satisfaction of {name}",
            better=1,
            less=f"satisfies {name} {{}} worse than",
            more=f"satisfies {name} {{}} better than",
            most=f"satisfies {name} best",
            decimals=3,
            interval_decimals=3,
        )
    return METRICS.get(column)
