"""What of missions is independent of each other: runs averaged over the points of a sweep, draws
averaged over the runs that share them, and conditions of real missions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import pandas

from suave_des.records.missions import SHARING
from suave_des.records.runs import CONDITION, NUMBER_COLUMNS


@dataclass(frozen=True, eq=False)
class Group:
    """Missions that are compared with those of other groups.

    Attributes:
        name: the manager's, with its source or its value of a sweep where several have the same.
        frame: a row for each independent value: for each mission, or, where points of a sweep are
            averaged, for each run, whose random numbers all points share; for each draw that
            several runs share; or for each condition of real missions. Where seed and run are
            known, they are its index; of conditions, their source and number. Times of search and
            detection are brought to the horizon.
        counted: what each row is: "mission", "run", "draw" or "condition".
        point: the end of the name that tells the value of a sweep; empty if all values are in the
            group.
        horizon_s: up to which times of search and detection count; infinite if it is not known.
    """

    name: str
    frame: pandas.DataFrame
    counted: str = "mission"
    point: str = ""
    horizon_s: float = math.inf

    @property
    def is_of_missions(self) -> bool:
        """Whether each row is one mission."""
        return self.counted == "mission"

    @property
    def has_runs(self) -> bool:
        """Whether seed and run of each row are known, so that it can be paired with those of
        others.
        """
        return self.frame.index.nlevels > 1


def runs_per_draw(frame: pandas.DataFrame) -> int:
    """Return how many runs in a row share their draws; of several campaigns, as many as have whole
    draws of each.
    """
    return math.lcm(*frame[SHARING].dropna().astype(int).unique()) if SHARING in frame else 1


def first_run_of_draw(frame: pandas.DataFrame, per_draw: int) -> pandas.Series[float]:
    """Return of each mission the first of the runs that share its draws, so many in a row."""
    return (frame["run"] - 1) // per_draw * per_draw + 1


def runs_per_draw_by_source(frame: pandas.DataFrame) -> dict[str, int]:
    """Return by source how many runs are averaged, because some share a draw; of sources without
    runs nothing is.
    """
    are_runs = (
        (frame["run"].notna() & (frame["seed"] != "")).groupby(frame["source"], observed=True).all()
    )
    return dict.fromkeys(map(str, are_runs.index[are_runs]), runs_per_draw(frame))


class Independent(NamedTuple):
    """What of missions is independent of each other.

    Attributes:
        rows: missions, or their averages over points of a sweep, runs of a draw, or missions of a
            condition.
        counted: what each row is, as of Group.
        runs_left_out: how many of how many lack a point of the sweep, "2 of 20"; empty if none does.
        draws_left_out: how many of how many lack a run, likewise.
    """

    rows: pandas.DataFrame
    counted: str
    runs_left_out: str = ""
    draws_left_out: str = ""


def independent(
    part: pandas.DataFrame,
    whole: pandas.DataFrame,
    averaged: Sequence[str],
    per_draw_by_source: Mapping[str, int],
) -> Independent:
    """Average the missions of one manager and source to what is independent.

    Args:
        part: the missions.
        whole: those of any manager from the same source: what they have is to be had by each run
            and draw.
        averaged: swept parameters, over whose points a run is averaged.
        per_draw_by_source: how many runs in a row share their draws, and are averaged; 1 if a
            source is not named.
    """
    points = len(whole[list(averaged)].drop_duplicates()) if averaged else 1
    per_draw = per_draw_by_source.get(str(part["source"].iloc[0]), 1)
    rows = part
    counted = "mission"
    runs_left_out = draws_left_out = ""
    if points > 1:
        counted = "run"
        runs = part.groupby(["seed", "run"], observed=True).size()
        rows = _complete_means(part, pandas.Series(points, runs.index))
        runs_left_out = _missing(len(rows), len(runs))
    if per_draw > 1:
        counted = "draw"
        firsts = first_run_of_draw(whole, per_draw)
        runs_of_draws = whole.groupby(["seed", firsts], observed=True)["run"].nunique()
        rows = _complete_means(rows.assign(run=first_run_of_draw(rows, per_draw)), runs_of_draws)
        begun = part.groupby(["seed", first_run_of_draw(part, per_draw)], observed=True).ngroups
        draws_left_out = _missing(len(rows), begun)
    return Independent(rows, counted, runs_left_out, draws_left_out)


def _missing(complete: int, begun: int) -> str:
    if complete == begun:
        return ""
    return f"{begun - complete} of {begun}"


def _complete_means(frame: pandas.DataFrame, wanted: pandas.Series[int]) -> pandas.DataFrame:
    """Average rows of the same seed and run.

    A mean over other points, or other runs of a draw, than that of another manager would compare
    these points and not the managers. So a metric is missing where fewer rows of a run than wanted
    have a value; a row is left out where a whole mission is missing.
    """
    numbers = list(frame.select_dtypes("number").columns.difference(["run"]))
    by_run = frame.groupby(["seed", "run"], sort=False, observed=True)
    sizes = by_run.size()
    whole = wanted.reindex(sizes.index)
    means = by_run[numbers].mean().where(by_run[numbers].count().eq(whole, axis=0))
    return means[sizes == whole].reset_index()


def conditions_of(frame: pandas.DataFrame, swept: Sequence[str]) -> pandas.Series[float]:
    """Return the numbers of the conditions of real missions; nan where they are not all known, or
    all the same.
    """
    found = pandas.Series(math.nan, frame.index)
    real = frame[frame["scenario"] == ""]
    for _, part in real.groupby("source", observed=True):
        for name in (each for each in NUMBER_COLUMNS if each not in swept):
            values = part[name] if name in part else pandas.Series("", part.index)
            if values.nunique() > 1 and (values.notna() & (values != "")).all():
                found[part.index] = pandas.factorize(values, sort=True)[0] + 1.0
                break
    return found


def over_conditions(part: pandas.DataFrame, conditions: pandas.Series[float]) -> Independent:
    """Average the missions of each condition that have a value; each condition is a run, so that
    those of one source are paired.

    Args:
        part: real missions of one manager and source.
        conditions: the number of each mission's condition.
    """
    numbers = list(part.select_dtypes("number").columns.difference(["run"]))
    seed = f"conditions of {part['source'].iloc[0]}"
    by_condition = part.assign(run=conditions, seed=seed).groupby(["seed", "run"])
    return Independent(by_condition[numbers].mean().reset_index(), CONDITION)
