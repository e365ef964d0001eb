"""Count missions in regions of search time, distance and place of detection: the clusters in which they come."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from suave_des.estimates import Interval
from suave_des.report.statistics import share_interval
from suave_des.scenario.problems import validated
from suave_des.scenario.quantities import Number, Strict, ordered, wrong
from suave_des.scenario.yamlfile import read_yaml

if TYPE_CHECKING:
    import pandas

POSITION_STEP_M = 0.5
"""Spacing of the pipeline points on its long pieces, and so of places of detection."""
_TOLERANCE = 1e-6
"""Places come from sums of steps; an interval must contain the values that it names."""

Column = Literal["search_time_s", "distance_inspected_m", "detection_x_m", "pipeline_found", "mean_reaction_time_s"]
Bounds = tuple[Number, Number]
Region = dict[Column, Annotated[tuple[Bounds, ...], Field(min_length=1)]]
"""By column the intervals, ends included, one of which must contain the value; an unknown place is in none."""


class Share(Strict):
    """A share of a manager's missions that is compared."""

    manager: str
    """Managing subsystem."""
    name: Annotated[str, Field(min_length=1, max_length=100)]
    """What is counted, in words."""
    of: Literal["runs", "detections"] = "runs"
    """Of all runs, or of those whose place of detection is known."""
    among: Region = Field(default_factory=dict)
    """Only runs in this region are counted; left out: all."""
    where: Annotated[Region, Field(min_length=1)]
    """The region whose share is taken."""
    target: tuple[Number, Number] | None = None
    """Least and greatest share that a faithful simulation may have; left out: the share is only printed."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        for region in (self.among, self.where):
            for intervals in region.values():
                for low, high in intervals:
                    ordered(low, high)
        if self.target is not None:
            ordered(*self.target)
            if self.target[0] < 0 or self.target[1] > 1:
                raise wrong("a share is between 0 and 1", "such as target: [0.25, 0.65]", "target")
        return self


class ConditionLimits(Strict):
    """How near a metric must come where the conditions of the real missions are known."""

    median_difference: Number | None = None
    """Greatest median over the conditions of |simulated - real median|, in the metric's unit; left out: any."""
    std_ratio: Number | None = None
    """Greatest simulated / real standard deviation within a condition, each a median over the conditions."""


class ShareList(Strict):
    """A file of shares and of other targets."""

    shares: tuple[Share, ...] = ()
    """In the order in which they are printed."""
    conditions: dict[Literal["search_time_s", "distance_inspected_m", "mean_reaction_time_s"], ConditionLimits] = Field(
        default_factory=dict
    )
    """By metric, over all managers."""


def read_targets(path: Path) -> ShareList:
    """Read a file of shares and of targets by condition.

    Raises:
        InputError: with file and line: it cannot be read, or is not valid.
    """
    return validated(read_yaml(path), ShareList)


def shares_beside(data: Path) -> Path | None:
    """Find the file of shares of a data file: NAME.targets.yaml beside NAME.csv, if it is there."""
    path = data.with_suffix(".targets.yaml")
    return path if path.is_file() else None


@dataclass(frozen=True, slots=True)
class Proportion:
    """How many of n missions are in a region."""

    count: int
    n: int

    @property
    def share(self) -> float | None:
        """count / n; none for no missions."""
        return self.count / self.n if self.n else None

    @property
    def interval(self) -> Interval | None:
        """95% interval of the share, by Clopper and Pearson; none for no missions."""
        return share_interval(self.count, self.n, "exact") if self.n else None


@dataclass(frozen=True, slots=True)
class ShareComparison:
    """One share, published and simulated."""

    share: Share
    published: Proportion
    simulated: Proportion


def found_shares(
    published: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str]
) -> tuple[ShareComparison, ...]:
    """Compare the share of missions that found the pipeline, of the managers for which both sides have it."""
    where: Region = {"pipeline_found": ((1.0, 1.0),)}
    shares = [Share(manager=manager, name="pipeline found", where=where) for manager in managers]
    theirs, ours = (runs[runs["pipeline_found"].notna()] for runs in (published, simulated))
    compared = compare_shares(shares, theirs, ours, managers)
    return tuple(each for each in compared if each.published.n and each.simulated.n)


def compare_shares(
    shares: Sequence[Share], published: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str]
) -> tuple[ShareComparison, ...]:
    """Count each share of the managers compared in published and simulated missions."""
    return tuple(
        ShareComparison(share, count(share, published), count(share, simulated))
        for share in shares
        if share.manager in managers
    )


def count(share: Share, runs: pandas.DataFrame) -> Proportion:
    """Count a share in missions, a row for each with the columns of report.runs.COLUMNS."""
    own = runs[runs["manager"] == share.manager]
    if share.of == "detections":
        own = own[own["detection_x_m"].notna()]
    among = own[_inside(own, share.among)]
    return Proportion(int(_inside(among, share.where).sum()), len(among))


def _inside(runs: pandas.DataFrame, region: Region) -> pandas.Series[bool]:
    import pandas

    inside = pandas.Series(True, index=runs.index)
    for column, intervals in region.items():
        values = runs[column].astype(float)
        in_one = [values.between(low - _TOLERANCE, high + _TOLERANCE) for low, high in intervals]
        inside &= pandas.concat(in_one, axis=1).any(axis=1)
    return inside


@dataclass(frozen=True, slots=True)
class DetectionPlace:
    """How many of a manager's detections with a known place are at one place, to the nearest POSITION_STEP_M."""

    manager: str
    detection_x_m: float
    published: Proportion
    simulated: Proportion


def compare_places(
    published: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str]
) -> tuple[DetectionPlace, ...]:
    """Count the detections at each place, by manager in the order given, and then by place."""
    found = []
    for manager in managers:
        sides = [_places(runs, manager) for runs in (published, simulated)]
        for place in sorted({*sides[0], *sides[1]}):
            proportions = (Proportion(side.get(place, 0), sum(side.values())) for side in sides)
            found.append(DetectionPlace(manager, place * POSITION_STEP_M, *proportions))
    return tuple(found)


def _places(runs: pandas.DataFrame, manager: str) -> Counter[int]:
    """Count detections by place, in steps."""
    known = runs.loc[runs["manager"] == manager, "detection_x_m"].dropna()
    return Counter((known / POSITION_STEP_M).round().astype(int).tolist())
