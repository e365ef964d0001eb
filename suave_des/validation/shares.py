"""Shares of missions in regions of search time, distance and place of detection: which clusters they come in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, ValidationError, model_validator

from suave_des.scenario.layers import Layer
from suave_des.scenario.problems import input_error
from suave_des.scenario.quantities import Number, Strict, ordered, wrong
from suave_des.scenario.yamlfile import read_yaml
from suave_des.validation.statistics import Interval, share_interval

if TYPE_CHECKING:
    import pandas

POSITION_STEP_M = 0.5
"""Spacing of the pipeline points on its long pieces, and so of places of detection."""
_TOLERANCE = 1e-6
"""Places come from sums of steps; an end of an interval must hold the value that it names."""

Column = Literal["search_time_s", "distance_inspected_m", "detection_x_m"]
Bounds = tuple[Number, Number]
Region = dict[Column, Annotated[tuple[Bounds, ...], Field(min_length=1)]]
"""By column the intervals, ends included, one of which must hold the value; a place that is not known is in none."""


class Share(Strict):
    """A share of a manager's missions that is compared."""

    manager: str
    """Managing subsystem."""
    name: Annotated[str, Field(min_length=1, max_length=100)]
    """What is counted, in words."""
    of: Literal["runs", "detections"] = "runs"
    """Of all runs, or of those whose place of detection is known."""
    among: Region = Field(default_factory=dict)
    """Only runs in this region are looked at; left out: all."""
    where: Annotated[Region, Field(min_length=1)]
    """The region whose share is taken."""
    target: tuple[Number, Number] | None = None
    """Least and greatest share that a faithful simulation may have; left out: it is only shown."""

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


class ShareList(Strict):
    """A file of shares."""

    shares: tuple[Share, ...]
    """In the order in which they are shown."""


def read_shares(path: Path) -> tuple[Share, ...]:
    """Read a file of shares.

    Raises:
        InputError: with file and line: it cannot be read, or has what it should not.
    """
    layer = Layer.of(read_yaml(path), 0)
    try:
        return ShareList.model_validate(layer.data).shares
    except ValidationError as error:
        raise input_error(error, layer, ShareList) from None


def shares_beside(data: Path) -> Path | None:
    """The file of shares that belongs to a data file: NAME.targets.yaml beside NAME.csv, if it is there."""
    path = data.with_suffix(".targets.yaml")
    return path if path.is_file() else None


@dataclass(frozen=True, slots=True)
class Counted:
    """How many of some missions are in a region."""

    count: int
    n: int

    @property
    def share(self) -> float | None:
        """None for no missions."""
        return self.count / self.n if self.n else None

    @property
    def interval(self) -> Interval | None:
        """95% interval of the share, by Clopper and Pearson."""
        return share_interval(self.count, self.n)


@dataclass(frozen=True, slots=True)
class ShareComparison:
    """One share on both sides."""

    share: Share
    published: Counted
    simulated: Counted


def compare_shares(
    shares: Sequence[Share], published: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str]
) -> tuple[ShareComparison, ...]:
    """Each share of the managers compared, on both sides."""
    return tuple(
        ShareComparison(share, count(share, published), count(share, simulated))
        for share in shares
        if share.manager in managers
    )


def count(share: Share, runs: pandas.DataFrame) -> Counted:
    """Count a share.

    Args:
        share: what to count.
        runs: a row a mission, with the columns of runs.COLUMNS.
    """
    own = runs[runs["manager"] == share.manager]
    if share.of == "detections":
        own = own[own["detection_x_m"].notna()]
    among = own[_inside(own, share.among)]
    return Counted(int(_inside(among, share.where).sum()), len(among))


def _inside(runs: pandas.DataFrame, region: Mapping[Column, Sequence[Bounds]]) -> pandas.Series[bool]:
    import pandas

    inside = pandas.Series(True, index=runs.index)
    for column, intervals in region.items():
        values = runs[column]
        held = pandas.Series(False, index=runs.index)
        for low, high in intervals:
            held |= values.between(low - _TOLERANCE, high + _TOLERANCE)
        inside &= held
    return inside


@dataclass(frozen=True, slots=True)
class Position:
    """How many of a manager's detections with a known place are at one place.

    Attributes:
        manager: managing subsystem.
        detection_x_m: the place, to the nearest POSITION_STEP_M.
        published: of the published detections.
        simulated: of the simulated ones.
    """

    manager: str
    detection_x_m: float
    published: Counted
    simulated: Counted


def compare_positions(
    published: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str]
) -> tuple[Position, ...]:
    """Distribution of the places of detection on both sides, in the order of managers and places."""
    found = []
    for manager in managers:
        ours, theirs = _places(simulated, manager), _places(published, manager)
        for place in sorted(set(ours) | set(theirs)):
            sides = (Counted(side.get(place, 0), sum(side.values())) for side in (theirs, ours))
            found.append(Position(manager, place * POSITION_STEP_M, *sides))
    return tuple(found)


def _places(runs: pandas.DataFrame, manager: str) -> dict[int, int]:
    """Counts by place, in steps."""
    known = runs.loc[runs["manager"] == manager, "detection_x_m"].dropna()
    steps = (known / POSITION_STEP_M).round().astype(int)
    return {int(step): int(number) for step, number in zip(*_unique(steps), strict=True)}


def _unique(steps: pandas.Series[int]) -> tuple[list[int], list[int]]:
    counts = steps.value_counts().sort_index()
    return counts.index.tolist(), counts.tolist()
