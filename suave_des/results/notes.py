"""What a reader should know about missions in groups, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import pandas

from suave_des.records.metrics import FOUND, REACTION_TIME, SEARCH_TIME, Metric
from suave_des.records.missions import SHARING
from suave_des.records.runs import CONDITION
from suave_des.results.horizon import ENDED, FOUND_BY_HORIZON, SAME_LIMIT_S
from suave_des.results.independent import Group
from suave_des.tables import listed, printable

_MEMBER = "ensemble_member"
_FEW = 20


def notes_on_missions(
    groups: Sequence[Group],
    averaged: Sequence[str],
    frame: pandas.DataFrame,
    per_draw_by_source: Mapping[str, int],
) -> Iterator[str]:
    """Say what missions, averages and parameters the numbers are of, and how rough they are."""
    yield from _notes_on_averages(groups, averaged, frame, per_draw_by_source)
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
    per_draw_by_source: Mapping[str, int],
) -> Iterator[str]:
    yield from _note_on_draws(frame, per_draw_by_source)
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


def _note_on_draws(frame: pandas.DataFrame, per_draw_by_source: Mapping[str, int]) -> Iterator[str]:
    """Say that runs which share a draw are averaged, and in which sources."""
    per_draw = max(per_draw_by_source.values(), default=1)
    if per_draw == 1:
        return
    if frame.loc[frame["source"].isin(list(per_draw_by_source)), SHARING].eq(per_draw).all():
        what = f"the {per_draw} runs that share each draw"
        numbers = "draws"
    else:
        what = f"every {per_draw} runs, of which some share a draw"
        numbers = "these averages"
    if len(per_draw_by_source) < frame["source"].nunique():
        of = f" of {', '.join(map(printable, per_draw_by_source))}"
        needed = "runs needed there"
    else:
        of = ""
        needed = "runs needed"
    yield (
        f"the values of {what} (runs_per_draw){of} are averaged: draws are independent, and runs"
        f" are not; n and the {needed} are numbers of {numbers}"
    )


def notes_on_points(
    averaged: Sequence[str],
    frame: pandas.DataFrame,
    runs_left_out: Sequence[str],
    draws_left_out: Sequence[str],
) -> Iterator[str]:
    """Say which runs lack a point of the sweep, which draws a run, and whether campaigns have the
    same points.

    Args:
        averaged: swept parameters over which means are.
        frame: all missions.
        runs_left_out, draws_left_out: of which group, and how many.
    """
    if runs_left_out:
        yield f"runs that lack a point of the sweep ({', '.join(runs_left_out)}) are left out"
    if draws_left_out:
        yield f"draws that lack a run ({', '.join(draws_left_out)}) are left out"
    if _are_at_other_points(frame, averaged):
        yield f"each campaign has means over other points of the sweep: compare by {', '.join(averaged)}"


def _are_at_other_points(frame: pandas.DataFrame, averaged: Sequence[str]) -> bool:
    """Return whether one source has other points of a sweep than another."""
    if not averaged:
        return False
    of_sources = {
        repr(sorted(map(repr, part[averaged].drop_duplicates().to_numpy().tolist())))
        for _, part in frame.groupby("source", observed=True)
    }
    return len(of_sources) > 1


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
