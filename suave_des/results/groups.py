"""Missions in the groups that are compared or drawn, with what a reader should know about them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import pandas

from suave_des.errors import InputError, shown, unknown
from suave_des.records.metrics import (
    FOUND,
    METRICS,
    PAPER_METRICS,
    REACTION_TIME,
    Metric,
    metric_of,
)
from suave_des.records.missions import Missions
from suave_des.results.horizon import FOUND_BY_HORIZON, HORIZON, at_horizons
from suave_des.results.independent import (
    Group,
    conditions_of,
    independent,
    over_conditions,
    runs_per_draw_by_source,
)
from suave_des.results.notes import notes_on_metrics, notes_on_missions, notes_on_points
from suave_des.tables import printable

_USUAL = (*PAPER_METRICS, FOUND, REACTION_TIME)
_MOST_GROUPS = 60
"""More make tables that nobody reads, and thousands of tests."""


@dataclass(frozen=True, eq=False)
class Groups:
    """Missions in groups, and what is asked about them.

    Attributes:
        groups: in the order of their first missions.
        notes: what a reader should know about the groups.
        counted: what the rows of groups are: "mission", "run", "draw", "condition", or "value"
            where they differ.
        time_limit_s: the shortest horizon of a group; infinite if it is not known.
        lost: by name of a group that did not find the pipeline in most of its missions, in how
            many.
    """

    missions: Missions
    groups: Sequence[Group]
    metrics: tuple[Metric, ...]
    notes: tuple[str, ...]
    counted: str
    time_limit_s: float
    lost: Mapping[str, str]


def grouped(
    missions: Missions,
    managers: Sequence[str] = (),
    metrics: Sequence[str] = (),
    by: Sequence[str] = (),
    *,
    averages: bool = True,
) -> Groups:
    """Group missions by manager, source and the chosen parameters of a sweep.

    Args:
        missions: of all sources.
        managers: names of those to include; empty: all.
        metrics: columns of runs.csv; empty: those of the usual ones that at least one mission has.
        by: swept parameters each of whose values is a separate group.
        averages: whether a run's values are averaged over the other swept parameters.

    Raises:
        InputError: a name is not there, no mission has a metric, or there are too many groups.
    """
    check_swept(missions, by, "by")
    managers = [missions.labels.get(name, name) for name in managers]
    frame = at_horizons(of_managers(missions, managers), missions.swept, by)
    averaged: list[str] = []
    per_draw: dict[str, int] = {}
    conditions = pandas.Series(math.nan, frame.index)
    if averages:
        averaged = [name for name in missions.swept if name not in by]
        per_draw = runs_per_draw_by_source(frame)
        conditions = conditions_of(frame, missions.swept)
    groups = []
    runs_left_out = []
    draws_left_out = []
    for part, name, point in parts(frame, managers, by):
        if conditions[part.index].notna().all():
            found = over_conditions(part, conditions[part.index])
        else:
            found = independent(part, _same_points(frame, part, by), averaged, per_draw)
        if found.runs_left_out:
            runs_left_out.append(f"{name} {found.runs_left_out}")
        if found.draws_left_out:
            draws_left_out.append(f"{name} {found.draws_left_out}")
        horizon_s = float(part[HORIZON].iloc[0])
        groups.append(Group(name, _by_run(found.rows), found.counted, point, horizon_s))
    _check_any_is_left(groups, averaged, lack_a_point=bool(runs_left_out))
    chosen = chosen_metrics(metrics, groups)
    notes = [
        *notes_on_missions(groups, averaged, frame, per_draw),
        *notes_on_points(averaged, frame, runs_left_out, draws_left_out),
        *notes_on_metrics(groups, chosen),
    ]
    limit_s = min(group.horizon_s for group in groups)
    lost = dict(_mostly_lost(groups))
    return Groups(missions, groups, chosen, tuple(notes), _counted(groups), limit_s, lost)


def _check_any_is_left(
    groups: Sequence[Group], averaged: Sequence[str], *, lack_a_point: bool
) -> None:
    """Raise an InputError if no run has all points, or no draw all runs."""
    if any(len(group.frame) for group in groups):
        return
    if lack_a_point:
        raise InputError(
            "no manager has a run with missions at all points of the sweep",
            remedy=f"compare the points with --by {','.join(averaged)}, or resume the campaign",
        )
    raise InputError("no manager has all runs of a draw", remedy="resume the campaign")


def _mostly_lost(groups: Sequence[Group]) -> Iterator[tuple[str, str]]:
    """Yield the groups that did not find the pipeline in most of their missions, and in how
    many.
    """
    for group in groups:
        lost = 1.0 - group.frame[FOUND_BY_HORIZON].dropna()
        if len(lost) and lost.mean() > 0.5:
            share = (
                f"{lost.sum():.0f} of {len(lost)}"
                if group.is_of_missions
                else f"{lost.mean():.0%} of its"
            )
            yield group.name, f"{share} missions"


def of_managers(missions: Missions, managers: Sequence[str]) -> pandas.DataFrame:
    """Return the missions of the managers named, or of all.

    Raises:
        InputError: there is none of one of them.
    """
    known = list(dict.fromkeys(missions.frame["manager"]))
    for name in managers:
        if name not in known:
            raise unknown(f"there is no mission of {shown(name)}", name, known, "there are")
    is_wanted = missions.frame["manager"].isin(list(managers) or known)
    return missions.frame.loc[is_wanted]


def parts(
    frame: pandas.DataFrame, managers: Sequence[str], by: Sequence[str] = ()
) -> list[tuple[pandas.DataFrame, str, str]]:
    """Return the missions of each group with the name of the group, and the end of it that tells
    the values of a sweep.

    Raises:
        InputError: there are too many.
    """
    found = list(frame.groupby(["manager", "source", *by], sort=False, dropna=False, observed=True))
    if managers:
        found.sort(key=lambda item: list(managers).index(str(item[0][0])))
    if len(found) > _MOST_GROUPS:
        problem = f"{len(found)} groups are too many to compare with each other"
        raise InputError(problem, remedy=f"choose {_MOST_GROUPS} or fewer with managers and by")
    names = _names([key for key, _ in found], by)
    return [(part, *name) for (_, part), name in zip(found, names, strict=True)]


def _same_points(
    frame: pandas.DataFrame, part: pandas.DataFrame, by: Sequence[str]
) -> pandas.DataFrame:
    """Return the missions of any manager from the source of a group, and at its values of a
    sweep.
    """
    is_same = frame["source"] == part["source"].iloc[0]
    for name in by:
        value = part[name].iloc[0]
        is_same &= frame[name].isna() if value != value else frame[name] == value
    same: pandas.DataFrame = frame[is_same]
    return same


def _by_run(rows: pandas.DataFrame) -> pandas.DataFrame:
    """Return rows with seed and run as their index, if these are known."""
    if rows["run"].notna().all() and (rows["seed"] != "").all():
        return rows.set_axis(pandas.MultiIndex.from_frame(rows[["seed", "run"]]))
    return rows


def check_swept(missions: Missions, names: Sequence[str], place: str) -> None:
    """Raise an InputError if a sweep does not vary one of these columns; `place` says where that
    was asked for.
    """
    for name in names:
        if name not in missions.swept:
            raise unknown(
                f"{shown(name)} is not what a sweep varies here",
                name,
                missions.swept,
                "swept are",
                place,
            )


def _names(keys: Sequence[tuple[object, ...]], by: Sequence[str]) -> list[tuple[str, str]]:
    """Return of each group the name, and the end of it that tells the values of a sweep."""
    managers_with_source = dict.fromkeys((manager, source) for manager, source, *_ in keys)
    sources = Counter(manager for manager, _ in managers_with_source)
    ends = [name.rpartition(".")[2] for name in by]
    labels = ends if len(set(ends)) == len(ends) else by
    text = _texts_of_values({value for _, _, *values in keys for value in values})
    names = []
    for manager, source, *values in keys:
        named = zip(labels, values, strict=True)
        point = "".join(f", {label} {text(value)}" for label, value in named)
        of_source = f" ({printable(str(source))})" if sources[manager] > 1 else ""
        names.append((f"{printable(str(manager))}{of_source}{point}", point))
    return names


def _texts_of_values(values: Iterable[object]) -> Callable[[object], str]:
    """Return what writes values of a sweep: numbers short, or, where two would be the same, with
    all digits.
    """
    numbers = [value for value in values if isinstance(value, float) and value == value]
    is_short_enough = len({f"{number:g}" for number in numbers}) == len(numbers)

    def text(value: object) -> str:
        if value != value:
            return "not swept"
        if isinstance(value, float):
            return f"{value:g}" if is_short_enough else f"{value}"
        return printable(str(value))

    return text


def chosen_metrics(wanted: Sequence[str], groups: Sequence[Group]) -> tuple[Metric, ...]:
    """Return the metrics named, or those of the usual ones that at least one mission has."""
    found = []
    for name in dict.fromkeys(wanted or _USUAL):
        metric = metric_of(name)
        if metric is None:
            raise unknown(
                f"there is no metric {shown(name)}", name, METRICS, "there are", "metrics"
            )
        if any(name in group.frame and group.frame[name].notna().any() for group in groups):
            found.append(metric)
        elif wanted:
            raise InputError(
                f"no mission has a value of {name}", place="metrics", remedy="leave it out"
            )
    return tuple(found)


def _counted(groups: Sequence[Group]) -> str:
    kinds = {group.counted for group in groups}
    return kinds.pop() if len(kinds) == 1 else "value"
