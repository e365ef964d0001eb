"""The report: a page about a campaign, with its tables, charts to explore, and how it was made."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import pandas

from suave_des import __version__
from suave_des.campaign.campaign import opened_campaign
from suave_des.campaign.missions import MissionRunner
from suave_des.domain import SEA_BED_Z_M
from suave_des.errors import InputError, SuaveDesError
from suave_des.files import read_json
from suave_des.metrics.result import MissionResult
from suave_des.pages.page import compressed, page
from suave_des.records.metrics import METRICS, PAPER_METRICS, REACTION_TIME
from suave_des.records.mission_folder import record_of
from suave_des.records.missions import Missions, read_missions
from suave_des.records.store import MANIFEST_FILE, read_manifest
from suave_des.results.compare import compare_groups
from suave_des.results.groups import grouped
from suave_des.results.horizon import at_horizons
from suave_des.results.mission import Adaptation, adaptations
from suave_des.results.style import looks
from suave_des.tables import capital

PAGE_LIMIT_BYTES: Final = 5_000_000
MOST_PATHS: Final = 12
"""Runs of each manager whose way is in a page."""
_MOST_WAYS: Final = 120
_STYLES: Final = ("common.css", "report.css")
_SCRIPTS: Final = ("common.js", "charts.js", "report.js")
_PERIOD_S: Final = 1.0
_TOLERANCE_S: Final = 1e-3
_EVENTS: Final = ("component_status", "pipeline_detected")
"""What is kept of a mission's way, besides its adaptations."""
MOST_DRAWN: Final = 20_000
"""Missions whose values are in a page; of more, every second, third, ... run is, under all
managers.
"""
_DIGITS = 2
_CHARTED = (*PAPER_METRICS, REACTION_TIME, "adaptations", "detection_x_m")
"""Metrics in charts."""


def report_page(
    folders: Sequence[Path],
    runs: int = MOST_PATHS,
    labels: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Make the report of campaigns, or of other results that `compare` reads.

    Args:
        folders: of campaigns, or with the exemplar's own CSV files; or single files.
        runs: how many runs of each manager to run again for their ways and timelines; 0: none.
        labels: as of read_missions.

    Raises:
        InputError: results cannot be read or compared, or an extra is not installed.
    """
    library = plotly_script()
    missions = read_missions(folders, labels)
    scenarios = [name for name in dict.fromkeys(missions.frame["scenario"]) if name]
    title = ", ".join([*scenarios, *dict.fromkeys(missions.frame["manager"])])
    content = {
        "version": __version__,
        "title": ", ".join(scenarios) or ", ".join(str(folder) for folder in folders),
        "folders": [str(folder) for folder in folders],
        "made": [_made(folder) for folder in folders],
        "results": _results(missions),
        "ways": _ways(folders, missions, runs),
    }
    text = page("report.html", f"Report: {title}", content, _STYLES, _SCRIPTS, library=library)
    size = len(text.encode(errors="backslashreplace"))  # as it is written
    if size > PAGE_LIMIT_BYTES:
        problem = f"the page would have {size / 1e6:.1f} MB, more than {PAGE_LIMIT_BYTES / 1e6:g}"
        raise InputError(problem, remedy="give fewer runs with --paths, or fewer folders")
    return text


@cache
def plotly_script() -> str:
    """Plotly's script, compressed.

    Raises:
        InputError: it is not installed.
    """
    try:
        return compressed(
            files("plotly").joinpath("package_data", "plotly.min.js").read_text(encoding="utf-8")
        )
    except (ImportError, OSError):
        remedy = "pip install 'suave-des[report]'"
        raise InputError(
            "the report's charts need plotly, which is not installed", remedy=remedy
        ) from None


def _results(missions: Missions) -> dict[str, object]:
    """Compare missions, and prepare what follows for the page."""
    found = compare_groups(grouped(missions))
    return {
        "conclusion": found.conclusion,
        "notes": found.notes,
        "sections": [
            {
                "title": capital(title),
                "tables": [(each.title, each.headings, each.rows) for each in tables],
                "conclusions": list(sentences),
                "below": below,
            }
            for title, tables, sentences, below in found.sections()
        ],
        "remarks": found.remarks(),
        "drawn": chart_columns(missions),
    }


def chart_columns(missions: Missions) -> dict[str, object]:
    """Put missions into columns for the page's charts, at most MOST_DRAWN of them.

    Returns:
        groups: their names, as the tables have them, their managers' own names, and the numbers of
            their looks, as in figures; titles of the metrics by column; columns: group number, run,
            seed, and each metric and swept parameter, None where there is no value; swept: names of
            parameters; every: 1, or n if only each nth run is there; missions: how many there are;
            is_paired: whether runs of the same seed and number share their random numbers.
    """
    groups = grouped(missions).groups
    frame = at_horizons(missions.frame, missions.swept)
    numbers = frame.groupby(["manager", "source"], sort=False).ngroup()  # as grouped() orders them
    every = max(1, math.ceil(len(frame) / MOST_DRAWN))
    has_runs = bool(frame["run"].notna().all())
    if every > 1:
        frame = frame[(frame["run"] - 1) % every == 0] if has_runs else frame.iloc[::every]
    seeds = frame["seed"].astype(str).tolist()
    columns = {
        "group": numbers[frame.index].tolist(),
        "run": _plain(frame["run"]) if has_runs else list(range(1, len(frame) + 1)),
        "seed": seeds[:1] if len(set(seeds)) == 1 else seeds,
        "found": _plain(frame["pipeline_found"].astype(float)),
    }
    charted = frame.reindex(columns=list(_CHARTED)).dropna(axis="columns", how="all")
    titles = {name: METRICS[name].heading for name in map(str, charted)}
    columns |= {name: _plain(frame[name]) for name in (*titles, *missions.swept)}
    names = [each.name for each in groups]
    return {
        "groups": names,
        "managers": list(map(missions.named, names)),
        "looks": looks(names),
        "titles": titles,
        "columns": columns,
        "swept": missions.swept,
        "every": every,
        "missions": len(missions.frame),
        "is_paired": has_runs and bool((frame["seed"] != "").all()) and len(groups) > 1,
    }


def _plain(column: pandas.Series) -> list[Any]:
    """Return values as JSON has them: numbers with few digits, None where there is none."""
    if not pandas.api.types.is_numeric_dtype(column):
        return column.astype(str).tolist()
    return list(map(_short, column.astype(float).round(_DIGITS).tolist()))


def _short(value: float) -> float | None:
    if not math.isfinite(value):
        return None
    return int(value) if value.is_integer() else value


def _made(folder: Path) -> dict[str, object]:
    """Read how the campaign in a folder was made; little is known of other folders."""
    about = read_manifest(folder)
    path = folder / MANIFEST_FILE
    return {
        "folder": str(folder),
        "command": shlex.join(about.command),
        "manifest": {
            key: _texts(value) if isinstance(value, dict) else _text(value)
            for key, value in (read_json(path) if path.exists() else {}).items()
            if key != "command"
        },
    }


def _texts(values: Mapping[str, object]) -> dict[str, str]:
    return {name: _text(value) for name, value in values.items()}


def _text(value: object) -> str:
    """Write a value of a manifest for readers: lists and mappings without their brackets."""
    if isinstance(value, dict):
        return "; ".join(f"{name}: {_text(part)}" for name, part in value.items()) or "none"
    if isinstance(value, list):
        return ", ".join(map(_text, value)) or "none"
    return value if isinstance(value, str) else json.dumps(value)


# Ways


def _ways(folders: Sequence[Path], missions: Missions, runs: int) -> dict[str, object]:
    """Run some missions of a campaign again, to have their ways: the first runs, and the quickest,
    median and slowest.

    `runs` is how many runs of each manager: 0 for none. A path's altitude is that above the sea
    bed, its visibility as measured; its modes are those of the function that moves the vehicle,
    with the times at which they changed.
    """
    frame = missions.frame
    vertices: list[tuple[float, float]] = []
    paths: list[dict[str, object]] = []
    managers = list(dict.fromkeys(frame["manager"]))
    if len(folders) != 1 or not folders[0].is_dir() or frame["run"].isna().any():
        note = "Paths and timelines are in the report of one campaign's folder only"
    elif runs == 0:
        added = "suave-des report --paths N adds those of N runs"
        note = f"Paths and timelines are left out; {added}"
    else:
        try:
            opened = opened_campaign(folders[0])
            most = max(1, min(runs, _MOST_WAYS // len(managers)))
            paths = list(_paths(opened, missions, managers, most))
            vertices = [(x, y) for x, y, *_ in opened.campaign.loaded.scenario.pipeline.vertices_m]
            note = "" if paths else "No mission could be run again as it was"
        except SuaveDesError as error:
            note = f"Paths and timelines are left out: {getattr(error, 'problem', error)}"
    return {"pipeline": vertices, "paths": paths, "note": note}


def _paths(
    opened: MissionRunner, missions: Missions, groups: Sequence[str], runs: int
) -> Iterator[dict[str, object]]:
    frame = missions.frame
    known = frame.drop_duplicates(["manager", "run"]).set_index(["manager", "run"])["search_time_s"]
    is_swept = opened.campaign.variation.sweep.points > 1
    for number, manager in enumerate(groups):
        for run in _representative_runs(frame, groups, runs):
            if (manager, run) in known.index:
                result, loaded = opened.run(missions.named(manager), run)
                off_s = result.metrics.search_time_s - float(known[manager, run])
                if is_swept or abs(off_s) < _TOLERANCE_S:
                    changes = adaptations(record_of(result, loaded))
                    yield {"group": number, "run": run, **_path(result, changes)}


def _representative_runs(frame: pandas.DataFrame, groups: Sequence[str], runs: int) -> list[int]:
    """Choose runs to look at: those in which each manager was quickest, in the middle and slowest,
    and the first.
    """
    chosen: dict[int, None] = {}
    for manager in groups:
        own = frame[frame["manager"] == manager].sort_values(
            ["search_time_s", "run"], kind="stable"
        )["run"]
        for place in (0, len(own) // 2, len(own) - 1):
            chosen.setdefault(int(own.iloc[place]))
    chosen |= dict.fromkeys(sorted(frame["run"].astype(int).unique().tolist())[:runs])
    return sorted(list(chosen)[:runs])


def _path(result: MissionResult, changes: Sequence[Adaptation]) -> dict[str, object]:
    points = result.trajectory
    period_s = points[1].t_s - points[0].t_s if len(points) > 1 else _PERIOD_S
    some = points[:: max(1, round(_PERIOD_S / period_s))]
    places = [(each.x_m, each.y_m, each.z_m - SEA_BED_Z_M) for each in some]
    x_m, y_m, altitude_m = np.round(places, 2).T.tolist()
    seen_m = map(attrgetter("visibility_m"), some)
    return {
        "t_s": [round(each.t_s, 1) for each in some],
        "x_m": x_m,
        "y_m": y_m,
        "altitude_m": altitude_m,
        "visibility_m": [None if each is None else round(each, 2) for each in seen_m],
        "modes": [(next(same).t_s, mode) for mode, same in groupby(some, attrgetter("mode"))],
        "adaptations": [
            (round(each.t_s, 1), f"{each.function} -> {each.after}") for each in changes
        ],
        "events": [
            (round(each.t_s, 1), each.event, each.detail)
            for each in result.events
            if each.event in _EVENTS
        ],
    }
