"""Missions in the groups that are compared or drawn, with what a reader should know about them."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas
from numpy.typing import NDArray

from suave_des.errors import InputError, shown, unknown
from suave_des.records.metrics import (
    FOUND,
    METRICS,
    PAPER_METRICS,
    REACTION_TIME,
    SEARCH_TIME,
    Metric,
    metric_of,
)
from suave_des.records.missions import SHARING, Missions
from suave_des.records.runs import CONDITION, NUMBER_COLUMNS
from suave_des.results.horizon import (
    ENDED,
    FOUND_BY_HORIZON,
    HORIZON,
    SAME_LIMIT_S,
    at_horizons,
)

_USUAL = (*PAPER_METRICS, FOUND, REACTION_TIME)
_MOST_GROUPS = 60
"""More make tables that nobody reads, and thousands of tests."""
_MEMBER = "ensemble_member"
_CLUSTER = "condition of real missions"
"""Column with the numbers of conditions, none where missions are taken as independent."""
_FEW = 20


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
    alike: dict[str, int] = {}
    if averages:
        averaged = [name for name in missions.swept if name not in by]
        alike = alike_by_source(frame)
        frame = frame.assign(**{_CLUSTER: _conditions(frame, missions.swept)})
    groups = []
    lacking: dict[str, list[str]] = defaultdict(list)
    for part, name, point in parts(frame, managers, by):
        found = independent(part, _same_points(frame, part, by), averaged, alike)
        for what, how_many in found.left_out.items():
            lacking[what].append(f"{name} {how_many}")
        horizon_s = float(part[HORIZON].iloc[0])
        groups.append(Group(name, _by_run(found.rows), found.counted, point, horizon_s))
    on_points = list(_notes_on_points(groups, averaged, frame, lacking))
    chosen = chosen_metrics(metrics, groups)
    notes = [
        *notes_on_missions(groups, averaged, frame, alike),
        *on_points,
        *notes_on_metrics(groups, chosen),
    ]
    limit_s = min(group.horizon_s for group in groups)
    lost = dict(_mostly_lost(groups))
    return Groups(missions, groups, chosen, tuple(notes), _counted(groups), limit_s, lost)


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


def _are_at_other_points(frame: pandas.DataFrame, averaged: Sequence[str]) -> bool:
    """Return whether one source has other points of a sweep than another."""
    if not averaged:
        return False
    of_sources = {
        repr(sorted(map(repr, part[averaged].drop_duplicates().to_numpy().tolist())))
        for _, part in frame.groupby("source", observed=True)
    }
    return len(of_sources) > 1


def least_and_greatest(
    values: NDArray[np.float64], runs: NDArray[np.float64]
) -> list[tuple[float, int]]:
    """Return the least and the greatest of values, each with its run."""
    places = int(values.argmin()), int(values.argmax())
    return [(float(values[place]), int(runs[place])) for place in places]


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


# Runs that share their draws


def runs_sharing_draw(frame: pandas.DataFrame) -> int:
    """Return how many runs in a row share their draws; of several campaigns, as many as have whole
    draws of each.
    """
    return math.lcm(*frame[SHARING].dropna().astype(int).unique()) if SHARING in frame else 1


def first_alike(frame: pandas.DataFrame, alike: int = 0) -> pandas.Series[float]:
    """Return of each mission the first run that shares its draws; `alike` of them do, by default
    runs_sharing_draw.
    """
    alike = alike or runs_sharing_draw(frame)
    return (frame["run"] - 1) // alike * alike + 1


def alike_by_source(frame: pandas.DataFrame) -> dict[str, int]:
    """Return by source how many runs are averaged, because some share a draw; of sources without
    runs nothing is.
    """
    are_runs = (
        (frame["run"].notna() & (frame["seed"] != "")).groupby(frame["source"], observed=True).all()
    )
    return dict.fromkeys(map(str, are_runs.index[are_runs]), runs_sharing_draw(frame))


class Independent(NamedTuple):
    """What of missions is independent of each other.

    Attributes:
        rows: missions, or their averages over points of a sweep, runs of a draw, or missions of a
            condition.
        counted: what each row is, as of Group.
        left_out: how many of how many runs lack a point, and how many draws lack a run, where some
            do.
    """

    rows: pandas.DataFrame
    counted: str
    left_out: Mapping[str, str]


def independent(
    part: pandas.DataFrame,
    whole: pandas.DataFrame,
    averaged: Sequence[str],
    alike: Mapping[str, int],
) -> Independent:
    """Average the missions of one manager and source to what is independent.

    Args:
        part: the missions.
        whole: those of any manager from the same source: what they have is to be had by each run
            and draw.
        averaged: swept parameters, over whose points a run is averaged.
        alike: by source how many runs in a row share their draws, and are averaged; 1 if a source
            is not named.
    """
    if _CLUSTER in part and part[_CLUSTER].notna().all():
        return Independent(_over_conditions(part), CONDITION, {})
    points = len(whole[list(averaged)].drop_duplicates()) if averaged else 1
    sharing = alike.get(str(part["source"].iloc[0]), 1)
    rows = part
    counted = "mission"
    left_out: dict[str, str] = {}
    if points > 1:
        counted = "run"
        rows = _means(part, points)
        runs = part.groupby(["seed", "run"], observed=True).ngroups
        if len(rows) < runs:
            left_out[_LACK_A_POINT] = f"{runs - len(rows)} of {runs}"
    if sharing > 1:
        counted = "draw"
        draws = whole.groupby(["seed", first_alike(whole, sharing)], observed=True)["run"].nunique()
        rows = _means(rows.assign(run=first_alike(rows, sharing)), draws)
        begun = part.groupby(["seed", first_alike(part, sharing)], observed=True).ngroups
        if len(rows) < begun:
            left_out[_LACK_A_RUN] = f"{begun - len(rows)} of {begun}"
    return Independent(rows, counted, left_out)


_LACK_A_POINT = "runs that lack a point of the sweep"
_LACK_A_RUN = "draws that lack a run"


def _conditions(frame: pandas.DataFrame, swept: Sequence[str]) -> pandas.Series[float]:
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


def _over_conditions(part: pandas.DataFrame) -> pandas.DataFrame:
    """Average the missions of each condition that have a value; each condition is a run, so that
    those of one source are paired.
    """
    numbers = list(part.select_dtypes("number").columns.difference(["run"]))
    seed = f"conditions of {part['source'].iloc[0]}"
    conditions = part.assign(run=part[_CLUSTER], seed=seed).groupby(["seed", "run"])
    return conditions[numbers].mean().reset_index()


def _means(frame: pandas.DataFrame, wanted: int | pandas.Series[int]) -> pandas.DataFrame:
    """Average rows of the same seed and run.

    A mean over other points, or other runs of a draw, than that of another manager would compare
    these points and not the managers. So a metric is missing where fewer rows of a run than wanted
    have a value; a row is left out where a whole mission is missing.
    """
    numbers = list(frame.select_dtypes("number").columns.difference(["run"]))
    by_run = frame.groupby(["seed", "run"], sort=False, observed=True)
    sizes = by_run.size()
    whole = sizes * 0 + wanted if isinstance(wanted, int) else wanted.reindex(sizes.index)
    means = by_run[numbers].mean().where(by_run[numbers].count().eq(whole, axis=0))
    return means[sizes == whole].reset_index()


# What a reader should know


def notes_on_missions(
    groups: Sequence[Group],
    averaged: Sequence[str],
    frame: pandas.DataFrame,
    alike_by_source: Mapping[str, int],
) -> Iterator[str]:
    """Say what missions, averages and parameters the numbers are of, and how rough they are."""
    yield from _notes_on_averages(groups, averaged, frame, alike_by_source)
    members = frame[_MEMBER].nunique() if _MEMBER in frame else 0
    if members > 1:
        yield (
            f"runs have {members} sets of parameters (an ensemble): intervals and tests are for"
            " chance among runs with these sets; how much the sets differ is in ensemble.csv"
        )
    scenarios = sorted(set(frame["scenario"]) - {""})
    if len(scenarios) > 1:
        yield f"the missions are of different scenarios: {', '.join(scenarios)}"
    few = min(len(group.frame) for group in groups)
    if few < _FEW:
        yield (
            "intervals and numbers of runs needed are rough, as one of them has fewer than"
            f" {_FEW} runs ({few})"
        )
    if any(len(group.frame) and group.frame[FOUND].isna().all() for group in groups):
        yield "some files do not say which missions found the pipeline"


def _notes_on_averages(
    groups: Sequence[Group],
    averaged: Sequence[str],
    frame: pandas.DataFrame,
    alike_by_source: Mapping[str, int],
) -> Iterator[str]:
    yield from _note_on_draws(frame, alike_by_source)
    if any(group.counted == CONDITION for group in groups):
        yield (
            "missions of one condition are alike: the values of those that have one are averaged,"
            " each condition counts the same, and n and the runs needed are numbers of conditions"
        )
    if averaged and not all(group.is_of_missions for group in groups):
        yield (
            f"the values of a run are averaged over {', '.join(averaged)}: all points of a sweep"
            " share its random numbers, so that runs are independent and missions are not"
        )


def _note_on_draws(frame: pandas.DataFrame, alike_by_source: Mapping[str, int]) -> Iterator[str]:
    """Say that runs which share a draw are averaged, and in which sources."""
    alike = max(alike_by_source.values(), default=1)
    if alike == 1:
        return
    if frame.loc[frame["source"].isin(list(alike_by_source)), SHARING].eq(alike).all():
        what = f"the {alike} runs that share each draw"
        numbers = "draws"
    else:
        what = f"every {alike} runs, of which some share a draw"
        numbers = "these averages"
    if len(alike_by_source) < frame["source"].nunique():
        of = f" of {', '.join(map(printable, alike_by_source))}"
        needed = "runs needed there"
    else:
        of = ""
        needed = "runs needed"
    yield (
        f"the values of {what} (runs_per_draw){of} are averaged: draws are independent, and runs"
        f" are not; n and the {needed} are numbers of {numbers}"
    )


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


def _notes_on_points(
    groups: Sequence[Group],
    averaged: Sequence[str],
    frame: pandas.DataFrame,
    lacking: Mapping[str, Sequence[str]],
) -> Iterator[str]:
    """Say which runs lack a point of the sweep, which draws a run, and whether campaigns have the
    same points.

    Raises:
        InputError: no run has all points, or no draw all runs.
    """
    if lacking and not any(len(group.frame) for group in groups):
        if _LACK_A_POINT in lacking:
            problem = "no manager has a run with missions at all points of the sweep"
            remedy = f"compare the points with --by {','.join(averaged)}, or resume the campaign"
        else:
            problem, remedy = "no manager has all runs of a draw", "resume the campaign"
        raise InputError(problem, remedy=remedy)
    for what, of_groups in lacking.items():
        yield f"{what} ({', '.join(of_groups)}) are left out"
    if _are_at_other_points(frame, averaged):
        yield f"each campaign has means over other points of the sweep: compare by {', '.join(averaged)}"


def notes_on_metrics(groups: Sequence[Group], metrics: Sequence[Metric]) -> Iterator[str]:
    """Say which missions lack a value of a metric, or count with the horizon."""
    for metric in metrics:
        if metric.name == SEARCH_TIME:
            yield from _never_found(groups)
            yield from _ended_early(groups)
            yield from _other_limits(groups)
        else:
            yield from _left_out(groups, metric)


def _never_found(groups: Sequence[Group]) -> Iterator[str]:
    """Say which missions have no search time of their own, and what they count with."""
    counts = []
    for group in groups:
        is_lost = group.frame[FOUND_BY_HORIZON] < 1.0
        if is_lost.any() and group.is_of_missions:
            counts.append(f"{group.name} {is_lost.sum()} of {len(is_lost)}")
        elif is_lost.any():
            counts.append(f"{group.name} {1.0 - group.frame[FOUND_BY_HORIZON].mean():.1%}")
    if not counts:
        return
    horizons_s = {group.horizon_s for group in groups}
    if math.inf in horizons_s:
        yield (
            f"missions that did not find the pipeline ({listed(counts)}) ended before others found it, and no time limit"
            " is known: by ranks they count as later than all that found it, and their mean search time is not known"
        )
        return
    horizon = f"{horizons_s.pop():g} s" if len(horizons_s) == 1 else "the time limit"
    yield (
        f"missions that had not found the pipeline by {horizon} ({listed(counts)}) count with {horizon}: a mean search"
        " time is the mean up to that limit, and would be longer without it"
    )


def _ended_early(groups: Sequence[Group]) -> Iterator[str]:
    """Say which missions ended without the pipeline long before the horizon."""
    times = []
    for group in groups:
        ended_s = group.frame[ENDED] if group.is_of_missions else pandas.Series(dtype=float)
        ended_s = ended_s[ended_s < group.horizon_s - SAME_LIMIT_S]
        if len(ended_s):
            low = ended_s.min()
            high = ended_s.max()
            until = f" to {high:.0f}" if high > low else ""
            times.append(f"{group.name} after {low:.0f}{until} s")
    if times:
        yield f"some missions ended earlier without it ({listed(times)}), which is no short search"


def _other_limits(groups: Sequence[Group]) -> Iterator[str]:
    """Say that some missions had more time to find the pipeline than others."""
    longer = []
    for group in groups:
        ended_later = group.frame[ENDED] > group.horizon_s + SAME_LIMIT_S
        found_later = group.frame[FOUND] > group.frame[FOUND_BY_HORIZON]
        if ended_later.any() or found_later.any():
            longer.append(group.name)
    if longer:
        yield (
            f"time limits differ ({listed(longer)} had more time): search times count up to the shortest limit, other"
            " metrics and the share that found the pipeline are of whole missions"
        )


def _left_out(groups: Sequence[Group], metric: Metric) -> Iterator[str]:
    """Say how many missions have no value of a metric; of FOUND that is said already."""
    lacking = [(group, int(group.frame[metric.name].isna().sum())) for group in groups]
    counts = [f"{group.name} {n} of {len(group.frame)}" for group, n in lacking if n]
    if counts and metric.name != FOUND:
        what = (
            "missions"
            if all(group.is_of_missions for group in groups)
            else "missions, or averages over missions,"
        )
        why = ", as no reaction was completed or recorded" if metric.name == REACTION_TIME else ""
        without = f"{what} without a {metric.title} ({listed(counts)})"
        yield f"{without} are left out of it{why}; they may be the ones that went worst"


def printable(name: str) -> str:
    """Return a name from a file without terminal control characters."""
    return name if name.isprintable() else repr(name)[1:-1]


def listed(parts: Sequence[str], most: int = 6) -> str:
    """Write the first of several parts, and how many more there are."""
    more = len(parts) - most
    return ", ".join(parts[:most]) + (f" and {more} more" if more > 0 else "")
