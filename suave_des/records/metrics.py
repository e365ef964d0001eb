"""The metrics of missions: what each column of runs.csv is, which values are better, and how sentences say so."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from operator import attrgetter

from suave_des.estimates import Estimate
from suave_des.files import rounded
from suave_des.metrics.result import MissionMetrics, MissionResult

COLUMN_TYPES = {field.name: str(field.type).removesuffix(" | None") for field in fields(MissionMetrics)}
"""Columns of runs.csv that every campaign has, and the names of their types."""
COLUMNS = tuple(COLUMN_TYPES)
SEARCH_TIME, DISTANCE = "search_time_s", "distance_inspected_m"
FOUND, REACTION_TIME = "pipeline_found", "mean_reaction_time_s"
REQUIREMENT = "requirement_"
"""Beginning of the columns of a scenario's requirements."""

Row = tuple[str | int | float | bool | None, ...]
"""Cells of a file of results."""
_cells: Callable[[MissionMetrics], Row] = attrgetter(*COLUMNS)


def row_of(metrics: MissionMetrics) -> Row:
    """Return the cells of runs.csv, rounded as in the file, from which all statistics are computed."""
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
        half_width: of the intervals for which the number of runs is given, if none is asked for; 0: 5% of the mean.
        decimals: of its values in tables and sentences.
        interval_decimals: of its intervals in tables.
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
    def kind(self) -> str:
        """Type of its values: "float", "int" or "bool"."""
        return COLUMN_TYPES.get(self.name, "float")

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
        """Write a value for a table: a share in per cent, others with the paper's decimals; empty for None and nan."""
        if value is None or value != value:
            return ""
        return f"{self.scale * value:.{self.decimals}f}{'%' if self.name == FOUND else ''}"

    def interval(self, found: Estimate) -> str:
        """Write an interval for a table; empty if there is none."""
        text = found.text(f".{self.interval_decimals}f", self.scale)
        return f"{text}%" if text and self.name == FOUND else text

    def amount(self, value: float) -> str:
        """Write a difference's size for a sentence, with its unit."""
        unit = "percentage points" if self.name == FOUND else self.unit
        return f"{self.scale * value:.{self.decimals}f} {unit}".strip()


_METRICS = (
    Metric(
        SEARCH_TIME,
        "search time",
        "s",
        -1,
        less="finds the pipeline {} sooner than",
        more="finds the pipeline {} later than",
        most="finds the pipeline soonest",
        half_width=5.0,
    ),
    Metric(
        DISTANCE,
        "distance inspected",
        "m",
        1,
        less="inspects {} less than",
        more="inspects {} more than",
        most="inspects most of the pipeline",
        half_width=2.0,
        short="distance",
    ),
    Metric(
        FOUND,
        "share that found the pipeline",
        "",
        1,
        less="finds the pipeline in {} less of its missions than",
        more="finds the pipeline in {} more of its missions than",
        most="finds the pipeline most often",
        half_width=0.05,
        decimals=1,
    ),
    Metric(
        REACTION_TIME,
        "mean reaction time",
        "s",
        -1,
        less="reacts {} faster than",
        more="reacts {} slower than",
        most="reacts fastest",
        half_width=0.5,
        interval_decimals=2,
        short="reaction",
    ),
    Metric("adaptations", "adaptations", less="makes {} fewer adaptations than", more="makes {} more adaptations than"),
    Metric("mission_duration_s", "mission duration", "s"),
    Metric(
        "detection_time_s",
        "time of the first sight",
        "s",
        -1,
        less="first sees the pipeline {} sooner than",
        more="first sees the pipeline {} later than",
        most="first sees the pipeline soonest",
    ),
    Metric("detection_x_m", "x of the first sight", "m"),
    Metric("detection_y_m", "y of the first sight", "m"),
    Metric("initial_x_m", "x of the start", "m"),
    Metric("initial_y_m", "y of the start", "m"),
    Metric("adaptations_undone", "adaptations undone"),
    Metric("configurations", "configurations"),
    Metric("reasoning_time_s", "reasoning time", "s"),
    Metric("area_covered_m2", "area covered", "m2"),
    Metric("operational_thrusters", "operational thrusters"),
    Metric("battery_level", "battery level", decimals=3, interval_decimals=3),
    Metric("recharges", "recharges"),
    Metric("surfacing_time_s", "surfacing time", "s"),
)
METRICS: Mapping[str, Metric] = {metric.name: metric for metric in _METRICS}
"""Metrics by name: those of every mission, and those that a scenario may ask for."""
PAPER_METRICS = (SEARCH_TIME, DISTANCE)
"""Those of the paper's table."""


def metric_of(column: str) -> Metric | None:
    """Return the metric of a column; None for one that has something else, such as a swept value."""
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
