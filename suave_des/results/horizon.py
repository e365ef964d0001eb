"""Times until the pipeline is found, brought to a horizon that all missions of a comparison have.

A mission that ends without the pipeline does not tell when it would have been found: its time is
censored. Programs write different numbers for it: the time limit, the mission's duration, or when
the battery was empty. So times count up to the shortest time limit of what is compared, and
missions that had not found the pipeline by then, for whatever reason, all have this horizon as
their time: none of them is sooner than another, and none is sooner than one that found it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pandas

from suave_des.records.metrics import DETECTION_TIME, DURATION, FOUND, SEARCH_TIME

TIMES = SEARCH_TIME, DETECTION_TIME
"""Metrics that are brought to a horizon."""
FOUND_BY_HORIZON = "found_by_horizon"
"""Column of missions that are brought to a horizon: 1 if the pipeline was found by then, 0 if not,
nan if that is not known."""
HORIZON = "horizon_s"
"""Column of these with the horizon."""
ENDED = "ended_s"
"""Column of these with the time at which a mission ended without the pipeline."""
TIME_LIMIT = "time_limit_s"
"""Column of missions whose file has their time limit."""
SAME_LIMIT_S = 1.5
"""Programs write limits that differ by a second for the same one."""


def common_horizon_s(frame: pandas.DataFrame, swept: Sequence[str]) -> float:
    """Return the time up to which all missions tell whether the pipeline was found.

    That is the shortest time limit of those managers and points of a sweep that did not always find
    it; the longest search if all did; infinite if no limit is known.
    """
    shortest_s, is_always_found = math.inf, True
    for _, source in frame.groupby(["source", *swept], dropna=False, observed=True):
        lasted_s = _whole_seconds(source[DURATION].max()) if DURATION in source else math.nan
        for _, own in source.groupby("manager", observed=True):
            if (own[FOUND] == 0.0).any():
                is_always_found = False
                shortest_s = min(shortest_s, _time_limit_s(own, lasted_s))
    return float(frame[SEARCH_TIME].max()) if is_always_found else shortest_s


def _time_limit_s(own: pandas.DataFrame, lasted_s: float) -> float:
    """Return the time limit of missions of which some did not find the pipeline; infinite if it is
    not known.

    Without a column for it, it is the time of those that did not, unless a mission found the
    pipeline later, or lasted longer: then these ended before the limit.

    Args:
        lasted_s: duration of the longest mission with the same limit, of any manager; nan if it is
            not known.
    """
    if TIME_LIMIT in own and own[TIME_LIMIT].notna().any():
        return float(own[TIME_LIMIT].max())
    lost = own[FOUND] == 0.0
    lost_s = float(own.loc[lost, SEARCH_TIME].max())
    found_s = float(own.loc[~lost, SEARCH_TIME].max())
    if not math.isnan(lasted_s):
        return min(lost_s, lasted_s) if lost_s > lasted_s - SAME_LIMIT_S else lasted_s
    return math.inf if found_s > lost_s + SAME_LIMIT_S else lost_s


def _whole_seconds(time_s: float) -> float:
    """Return a time as search times are counted; nan for nan."""
    return time_s if math.isnan(time_s) else float(math.floor(time_s))


def to_horizon(frame: pandas.DataFrame, horizon_s: float) -> pandas.DataFrame:
    """Return missions with the times of search and detection as they are known at a horizon, and
    with the columns FOUND_BY_HORIZON, HORIZON and ENDED.

    Of campaigns, a time of detection that is missing is that of a mission that never saw the
    pipeline.
    """
    times_s, found = frame[SEARCH_TIME], frame[FOUND]
    is_lost, is_late = found == 0.0, times_s > horizon_s
    ended_s = frame[[SEARCH_TIME, *({DURATION} & set(frame))]].min(axis=1)
    brought: dict[str, Any] = {
        SEARCH_TIME: times_s.where(~is_lost & ~is_late, horizon_s),
        FOUND_BY_HORIZON: found.where(~is_late, 0.0),
        HORIZON: horizon_s,
        ENDED: ended_s.where(is_lost),
    }
    if DETECTION_TIME in frame:
        never_seen = frame[DETECTION_TIME].isna() & (frame["scenario"] != "")
        seen_s = frame[DETECTION_TIME].where(~never_seen, horizon_s)
        brought[DETECTION_TIME] = seen_s.clip(upper=horizon_s)
    return frame.assign(**brought)


def at_horizons(
    frame: pandas.DataFrame, swept: Sequence[str], by: Sequence[str] = ()
) -> pandas.DataFrame:
    """Return missions brought to the horizon that all have in common; where managers are compared
    at each value of swept parameters, `by`, to that of each.
    """
    parts = frame.groupby(list(by), sort=False, dropna=False, observed=True) if by else ()
    groups = frame.drop_duplicates(["manager", "source", *by])
    if len(parts) == len(groups) or len(parts) < 2:  # the values are compared with each other
        return to_horizon(frame, common_horizon_s(frame, swept))
    brought = [to_horizon(part, common_horizon_s(part, swept)) for _, part in parts]
    return pandas.concat(brought).loc[frame.index]
