"""Missions grouped for a comparison: by manager, source, and value of a sweep."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas
from numpy.typing import NDArray

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.report.result_files import Missions
from suave_des.report.words import printable

_MOST_GROUPS = 60
"""More make tables that nobody reads, and thousands of tests."""

_MEMBER = "ensemble_member"
"""Column of runs.csv: the parameter set of a run."""


@dataclass(frozen=True, eq=False)
class Group:
    """Missions that are compared with those of other groups.

    Attributes:
        name: the manager's, with its source or its value of a sweep where several have the same.
        frame: a row for each independent value: for each mission, or, where points of a sweep are averaged, for each
            run, whose random numbers all points share; or for each draw that several runs share.
        is_of_missions: whether each row is one mission.
    """

    name: str
    frame: pandas.DataFrame
    is_of_missions: bool

    def values(self, metric: str) -> NDArray[np.float64]:
        """Return the values of a metric, nan where there is none."""
        return self.frame[metric].to_numpy(float)

    def known_values(self, metric: str) -> NDArray[np.float64]:
        """Return the values of a metric without missing ones."""
        values = self.values(metric)
        return values[~np.isnan(values)]

    def by_run(self, metric: str) -> pandas.Series[float] | None:
        """Return the values by (seed, run); None for missions without these."""
        if self.frame["run"].isna().any() or (self.frame["seed"] == "").any():
            return None
        return pandas.Series(self.values(metric), self._runs)

    @cached_property
    def _runs(self) -> pandas.MultiIndex:
        return pandas.MultiIndex.from_frame(self.frame[["seed", "run"]])


def counted(groups: Sequence[Group]) -> str:
    """Return what the rows of groups are."""
    if any(runs_sharing_draw(group.frame) > 1 and not group.is_of_missions for group in groups):
        return "draw"
    return "mission" if all(group.is_of_missions for group in groups) else "run"


def time_limit_s(groups: Sequence[Group]) -> float:
    """Return the whole seconds that missions of every group had; where all found the pipeline, the longest search."""
    lost = [group.frame.loc[group.frame["pipeline_found"] == 0.0, "search_time_s"] for group in groups]
    limits_s = [float(times.max()) for times in lost if len(times)]
    limit_s = min(limits_s) if limits_s else max(float(group.frame["search_time_s"].max()) for group in groups)
    return math.floor(limit_s) or limit_s


def grouped(
    missions: Missions, managers: Sequence[str] = (), by: Sequence[str] = (), *, averages: bool = True
) -> tuple[list[Group], list[str]]:
    """Group missions by manager, source and the chosen parameters of a sweep.

    Args:
        missions: of all sources.
        managers: names of the managers to include; empty: all.
        by: swept parameters each of whose values is a separate group.
        averages: whether a run's values are averaged over the other swept parameters.

    Returns:
        The groups in the order of their first missions, and notes for the reader.

    Raises:
        InputError: a name is not there, or there are too many groups.
    """
    frame = missions.frame
    known = list(dict.fromkeys(frame["manager"]))
    for name in managers:
        if name not in known:
            raise InputError(f"there is no mission of {shown(name)}", remedy=did_you_mean(name, known, "there are"))
    missions.check_swept(by, "by")
    if managers:
        frame = frame[frame["manager"].isin(managers)]
    keys = ["manager", "source", *by]
    found = list(frame.groupby(keys, sort=False, dropna=False, observed=True))
    if managers:
        found.sort(key=lambda item: list(managers).index(str(item[0][0])))
    if len(found) > _MOST_GROUPS:
        problem = f"{len(found)} groups are too many to compare with each other"
        raise InputError(problem, remedy=f"choose {_MOST_GROUPS} or fewer with managers and by")
    averaged = [name for name in missions.swept if averages and name not in by]
    names = _names([key for key, _ in found], by)
    alike = runs_sharing_draw(frame) if averages else 1
    groups = [_group(name, part, averaged, alike) for name, (_, part) in zip(names, found, strict=True)]
    return groups, list(_notes(groups, averaged, frame))


def _names(keys: Sequence[tuple[object, ...]], by: Sequence[str]) -> list[str]:
    sources: dict[object, set[object]] = {}
    for manager, source, *_ in keys:
        sources.setdefault(manager, set()).add(source)
    return [
        printable(str(manager))
        + (f" ({printable(str(source))})" if len(sources[manager]) > 1 else "")
        + "".join(f", {name} {_short(value)}" for name, value in zip(by, values, strict=True))
        for manager, source, *values in keys
    ]


def _short(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else printable(str(value))


def _group(name: str, frame: pandas.DataFrame, averaged: Sequence[str], alike: int) -> Group:
    has_points = bool(averaged) and bool(frame[["seed", "run"]].duplicated().any())
    if has_points:
        frame = _means_by_run(frame)
    if alike > 1:
        frame = _means_by_run(frame.assign(run=first_alike(frame, alike)), has_all=False)
    return Group(name, frame, not has_points and alike == 1)


def runs_sharing_draw(frame: pandas.DataFrame) -> int:
    """Return how many runs in a row share their draws; of several campaigns, as many as have whole draws of each."""
    return math.lcm(*frame["runs_sharing_draw"].dropna().astype(int).unique()) if "runs_sharing_draw" in frame else 1


def first_alike(frame: pandas.DataFrame, alike: int) -> pandas.Series[float]:
    """Return of each mission the first run that shares its draws."""
    return (frame["run"] - 1) // alike * alike + 1


def _means_by_run(frame: pandas.DataFrame, *, has_all: bool = True) -> pandas.DataFrame:
    """Average missions of the same run; of a sweep, only of runs that have all points."""
    numbers = list(frame.select_dtypes("number").columns.difference(["run"]))
    by_run = frame.groupby(["seed", "run"], sort=False, observed=True)
    sizes = by_run.size()
    means = by_run[numbers].mean()
    if has_all:
        means = means[sizes == sizes.max()]  # a run that lacks a point would be compared with others at other points
    return means.reset_index()


def _notes(groups: Sequence[Group], averaged: Sequence[str], frame: pandas.DataFrame) -> Iterator[str]:
    alike = runs_sharing_draw(frame)
    if alike > 1:
        is_one = frame["runs_sharing_draw"].eq(alike).all()
        what = f"the {alike} runs that share each draw" if is_one else f"every {alike} runs, of which some share a draw"
        yield (
            f"the values of {what} (runs_per_draw) are averaged: draws are independent, and runs are not; n and the"
            f" runs needed are numbers of {'draws' if is_one else 'these averages'}"
        )
    if averaged and not all(group.is_of_missions for group in groups):
        yield (
            f"the values of a run are averaged over {', '.join(averaged)}: all points of a sweep share its random"
            " numbers, so that runs are independent and missions are not"
        )
    members = frame[_MEMBER].nunique() if _MEMBER in frame else 0
    if members > 1:
        yield (
            f"runs have {members} sets of parameters (an ensemble): intervals and tests are for chance among runs with"
            " these sets; how much the sets differ is in ensemble.csv"
        )
    scenarios = [name for name in dict.fromkeys(frame["scenario"]) if name]
    if len(scenarios) > 1:
        yield f"the missions are of different scenarios: {', '.join(scenarios)}"
    few = min(len(group.frame) for group in groups)
    if few < 20:
        rough = "intervals and numbers of runs needed from fewer than 20 are rough"
        yield f"the fewest runs of one of them are {few}: {rough}"
    if any(math.isnan(float(group.frame["pipeline_found"].mean())) for group in groups):
        yield "some files do not say which missions found the pipeline"
