"""Paths of some of a campaign's missions, which are run again for its report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pandas

from suave_des.campaign.campaign import opened_campaign
from suave_des.campaign.missions import MissionRunner
from suave_des.domain import SEA_BED_Z_M
from suave_des.errors import SuaveDesError
from suave_des.metrics.result import MissionResult

_PERIOD_S = 1.0
_TOLERANCE_S = 1e-3
_EVENTS = ("mode_requested", "component_status", "pipeline_detected")


def no_paths(note: str) -> dict[str, Any]:
    """Return what paths_of does where there are none, with a note why."""
    return {"pipeline": [], "paths": [], "note": note}


def paths_of(folder: Path, frame: pandas.DataFrame, groups: Sequence[str], runs: int) -> dict[str, Any]:
    """Run some missions of a campaign again, to have their ways: the first runs, and the quickest, median and slowest.

    `groups` are managers in the order of the page's groups; `runs` is how many runs of each: 0 for none.

    Returns:
        pipeline: vertices, x and y in m; paths: in the order of groups and runs; note: why there are none, or empty. A
        path has group (its number), run, t_s, x_m, y_m, altitude_m (above the sea bed), visibility_m (as measured),
        modes (times at which the mode of the function that moves it changed, with its name), and events (times of mode
        requests, component reports and the first sight, with kind and detail).
    """
    if runs == 0:
        return no_paths("Paths and timelines are left out; suave-des report --paths N adds those of N runs")
    try:
        opened = opened_campaign(folder)
        vertices = [(x, y) for x, y, *_ in opened.campaign.loaded.scenario.pipeline.vertices_m]
        paths = list(_paths(opened, frame, groups, runs))
    except SuaveDesError as error:
        return no_paths(f"Paths and timelines are left out: {getattr(error, 'problem', error)}")
    note = "" if paths else "No mission could be run again as it was"
    return {"pipeline": vertices, "paths": paths, "note": note}


def _paths(
    opened: MissionRunner, frame: pandas.DataFrame, groups: Sequence[str], runs: int
) -> Iterator[dict[str, Any]]:
    known = frame.drop_duplicates(["manager", "run"]).set_index(["manager", "run"])["search_time_s"]
    is_swept = opened.campaign.variation.sweep.points > 1
    for number, manager in enumerate(groups):
        for run in _representative_runs(frame, groups, runs):
            if (manager, run) in known.index:
                _, result = opened.run(manager, run)
                off_s = result.metrics.search_time_s - float(known[manager, run])
                if is_swept or abs(off_s) < _TOLERANCE_S:
                    yield {"group": number, "run": run, **_path(result)}


def _representative_runs(frame: pandas.DataFrame, groups: Sequence[str], runs: int) -> list[int]:
    """Choose runs to look at: those in which each manager was quickest, in the middle and slowest, and the first."""
    chosen: dict[int, None] = {}
    for manager in groups:
        own = frame[frame["manager"] == manager].sort_values(["search_time_s", "run"], kind="stable")["run"]
        for place in (0, len(own) // 2, len(own) - 1):
            if len(own):
                chosen.setdefault(int(own.iloc[place]))
    chosen |= dict.fromkeys(sorted({int(run) for run in frame["run"]})[:runs])
    return sorted(list(chosen)[:runs])


def _path(result: MissionResult) -> dict[str, Any]:
    points = result.trajectory
    period_s = points[1].t_s - points[0].t_s if len(points) > 1 else _PERIOD_S
    some = points[:: max(1, round(_PERIOD_S / period_s))]
    x_m, y_m, altitude_m = np.round([(each.x_m, each.y_m, each.z_m - SEA_BED_Z_M) for each in some], 2).T.tolist()
    return {
        "t_s": [round(each.t_s, 1) for each in some],
        "x_m": x_m,
        "y_m": y_m,
        "altitude_m": altitude_m,
        "visibility_m": [None if each.visibility_m is None else round(each.visibility_m, 2) for each in some],
        "modes": [(next(same).t_s, mode) for mode, same in groupby(some, attrgetter("mode"))],
        "events": [(round(each.t_s, 1), each.event, each.detail) for each in result.events if each.event in _EVENTS],
    }
