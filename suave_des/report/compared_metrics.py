"""Descriptions of the compared metrics: unit, which values are better, and phrases for sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.files import as_number

if TYPE_CHECKING:
    from suave_des.report.grouping import Group
    from suave_des.report.statistics import Sample

SEARCH_TIME, FOUND = "search_time_s", "pipeline_found"


@dataclass(frozen=True, slots=True)
class ComparedMetric:
    """A metric, with phrases for sentences about it.

    Attributes:
        name: column of runs.csv.
        title: in words, without unit.
        unit: of its values; empty for numbers without one.
        better: 1 if more is better, -1 if less is, 0 if neither.
        less: a sentence about who has less: "finds the pipeline {} sooner than"; likewise more.
        most: phrase for the best mean: "finds the pipeline soonest"; empty if none is better.
        half_width: of the intervals for which the number of runs is given, if none is asked for; 0: 5% of the mean.
        decimals: of its values in tables; likewise interval_decimals.
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

    @property
    def heading(self) -> str:
        """Title and unit, as tables and axes have it."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    def amount(self, value: float) -> str:
        """Write a difference's size, with its unit."""
        if self.name == FOUND:
            return f"{100.0 * value:.1f} percentage points"
        return f"{value:.{self.decimals}f} {self.unit}".strip()

    def default_half_width(self, x: Sample, y: Sample) -> float:
        """Return the default half-width for which the number of runs is estimated."""
        return self.half_width or 0.05 * max(abs(float(x.mean())), abs(float(y.mean())))


_METRICS = (
    ComparedMetric(
        SEARCH_TIME,
        "search time",
        "s",
        -1,
        "finds the pipeline {} sooner than",
        "finds the pipeline {} later than",
        "finds the pipeline soonest",
        half_width=5.0,
    ),
    ComparedMetric(
        "distance_inspected_m",
        "distance inspected",
        "m",
        1,
        "inspects {} less than",
        "inspects {} more than",
        "inspects most of the pipeline",
        half_width=2.0,
    ),
    ComparedMetric(
        FOUND,
        "share that found the pipeline",
        "",
        1,
        "finds the pipeline in {} less of its missions than",
        "finds the pipeline in {} more of its missions than",
        "finds the pipeline most often",
        half_width=0.05,
    ),
    ComparedMetric(
        "mean_reaction_time_s",
        "mean reaction time",
        "s",
        -1,
        "reacts {} faster than",
        "reacts {} slower than",
        "reacts fastest",
        half_width=0.5,
        interval_decimals=2,
    ),
    ComparedMetric(
        "adaptations", "adaptations", "", 0, "makes {} fewer adaptations than", "makes {} more adaptations than"
    ),
    ComparedMetric("mission_duration_s", "mission duration", "s"),
    ComparedMetric(
        "detection_time_s",
        "time of the first sight",
        "s",
        -1,
        "first sees the pipeline {} sooner than",
        "first sees the pipeline {} later than",
        "first sees the pipeline soonest",
    ),
)
_DEFAULTS = (SEARCH_TIME, "distance_inspected_m", FOUND, "mean_reaction_time_s")
KNOWN = {metric.name: metric for metric in _METRICS}
"""Metrics by name."""
PAPER_METRICS = {name: KNOWN[name].heading for name in (SEARCH_TIME, "distance_inspected_m")}
"""Metrics of the paper's table, with their titles in figures."""


def chosen_metrics(wanted: Sequence[str], groups: Sequence[Group]) -> tuple[ComparedMetric, ...]:
    """Return the metrics to compare: those named, or those of the usual ones that at least one mission has.

    Raises:
        InputError: there is no such metric, or no mission has it.
    """
    for name in wanted:
        if name not in KNOWN:
            remedy = did_you_mean(name, KNOWN, "there are")
            raise InputError(f"there is no metric {shown(name)}", place="metrics", remedy=remedy)
        if not _is_there(name, groups):
            raise InputError(f"no mission has a value of {name}", place="metrics", remedy="leave it out")
    names = wanted or [name for name in _DEFAULTS if _is_there(name, groups)]
    return tuple(KNOWN[name] for name in dict.fromkeys(names))


def _is_there(name: str, groups: Sequence[Group]) -> bool:
    return any(name in group.frame and not np.isnan(group.values(name)).all() for group in groups)


def parse_half_widths(texts: Sequence[str], metrics: Sequence[ComparedMetric]) -> dict[str, float]:
    """Read METRIC:HALF_WIDTH, for instance search_time_s:2.

    Raises:
        InputError: it has no such form, or the metric is not compared.
    """
    names = [metric.name for metric in metrics]
    found = {}
    for text in texts:
        name, _, number = (part.strip() for part in text.partition(":"))
        half_width = as_number(number)
        if name not in names:
            remedy = did_you_mean(name, names, "compared are")
            raise InputError(f"{shown(name)} is not compared", place="half-width", remedy=remedy)
        if not 0.0 < half_width < math.inf:
            remedy = f"give METRIC:HALF_WIDTH with a number above 0, for instance {SEARCH_TIME}:2"
            raise InputError(f"{shown(text)} has no half-width", place="half-width", remedy=remedy)
        found[name] = half_width
    return found
