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

import numpy as np
import pandas

from suave_des.records.metrics import DETECTION_TIME, DURATION, FOUND, SEARCH_TIME
from suave_des.records.runs import TIME_LIMIT

TIMES = SEARCH_TIME, DETECTION_TIME
"""Metrics that are brought to a horizon."""
FOUND_BY_HORIZON = "found_by_horizon"
"""Column of missions that are brought to a horizon: 1 if the pipeline was found by then, 0 if not,
nan if that is not known."""
HORIZON = "horizon_s"
"""Column of these with the horizon."""
ENDED = "ended_s"
"""Column of these with the time at which a mission ended without the pipeline."""
SAME_LIMIT_S = 1.5
"""Programs write limits that differ by a second for the same one."""


def horizons_s(
    frame: pandas.DataFrame, swept: Sequence[str], by: Sequence[str] = ()
) -> pandas.Series[float]:
    """Return for each mission the time up to which all with the same values of `by` tell whether
    the pipeline was found.

    That is the shortest time limit of those managers and points of a sweep that did not always find
    it; the longest search if all did; infinite if no limit is known.
    """
    is_lost = frame[FOUND] == 0.0
    compared = _numbers(frame, by)
    limits_s = _time_limits_s(frame, swept).where(is_lost)
    shortest_s = limits_s.groupby(compared).transform("min")
    is_always_found = ~is_lost.groupby(compared).transform("any")
    longest_s = frame[SEARCH_TIME].groupby(compared).transform("max")
    return shortest_s.where(~is_always_found, longest_s)


def _time_limits_s(frame: pandas.DataFrame, swept: Sequence[str]) -> pandas.Series[float]:
    """Return the time limit of each mission that did not find the pipeline; infinite if it is not
    known.

    Missions of one source have one limit, but for a sweep's points. Where no column has it, it is
    the time of those of a manager that did not find the pipeline, unless one of them found it
    later, or any mission of the source lasted longer: then these had ended before the limit.
    """
    source = _numbers(frame, ["source", *swept])
    own = _numbers(frame, ["source", "manager", *swept])
    times_s = frame[SEARCH_TIME]
    is_lost = frame[FOUND] == 0.0
    lost_s = times_s.where(is_lost).groupby(own).transform("max")
    found_s = times_s.where(~is_lost).groupby(own).transform("max")
    limits_s = lost_s.where(~(found_s > lost_s + SAME_LIMIT_S), math.inf)
    if DURATION in frame:
        lasted_s = np.floor(frame[DURATION].groupby(source).transform("max"))  # as search times
        has_reached = lost_s > lasted_s - SAME_LIMIT_S
        by_duration_s = lasted_s.where(~has_reached, np.minimum(lost_s, lasted_s))
        limits_s = by_duration_s.fillna(limits_s)
    if TIME_LIMIT in frame:
        limits_s = frame[TIME_LIMIT].fillna(limits_s)
    return limits_s


def _numbers(frame: pandas.DataFrame, columns: Sequence[str]) -> pandas.Series[int]:
    """Return a number for each mission, the same of those with equal values in columns."""
    if not columns:
        return pandas.Series(0, frame.index)
    return frame.groupby(list(columns), dropna=False, observed=True).ngroup()


def to_horizon(
    frame: pandas.DataFrame, horizon_s: float | pandas.Series[float]
) -> pandas.DataFrame:
    """Return missions with the times of search and detection as they are known at a horizon, and
    with the columns FOUND_BY_HORIZON, HORIZON and ENDED.

    Of campaigns, a time of detection that is missing is that of a mission that never saw the
    pipeline.
    """
    times_s = frame[SEARCH_TIME]
    found = frame[FOUND]
    is_lost = found == 0.0
    is_late = times_s > horizon_s
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
    values = len(frame[list(by)].drop_duplicates())
    groups = len(frame[["manager", "source", *by]].drop_duplicates())
    if values == groups:  # the values of one manager are compared with each other
        by = ()
    return to_horizon(frame, horizons_s(frame, swept, by))
