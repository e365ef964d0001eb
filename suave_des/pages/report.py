"""The report: a page about a campaign, with its tables, charts to explore, and how it was made."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

import pandas

from suave_des import __version__
from suave_des.errors import InputError
from suave_des.pages.page import compressed, page
from suave_des.pages.paths import no_paths, paths_of
from suave_des.records.metrics import METRICS, PAPER_METRICS, REACTION_TIME
from suave_des.records.store import read_manifest
from suave_des.results.assisted import compare_assisted
from suave_des.results.compare import compare
from suave_des.results.comparison import Written, capital
from suave_des.results.missions import Missions, grouped, read_missions
from suave_des.results.style import looks

LIMIT_BYTES: Final = 5_000_000
PATHS: Final = 12
"""Runs of each manager whose way is in a page."""
_MOST_WAYS: Final = 120
_STYLES: Final = ("common.css", "report.css")
_SCRIPTS: Final = ("common.js", "charts.js", "report.js")
MOST_DRAWN: Final = 20_000
"""Missions whose values are in a page; of more, every second, third, ... run is, under all managers."""
_DIGITS = 2
_CHARTED = (*PAPER_METRICS, REACTION_TIME, "adaptations", "detection_x_m")
"""Metrics in charts."""


_FACTS: Final = ("scenario", "managers", "runs", "seed", "reasoner", "machine")


def report_page(folders: Sequence[Path], runs: int = PATHS, assisted_by: tuple[Path, Path] | None = None) -> str:
    """Make the report of campaigns, or of other results that `compare` reads.

    Args:
        folders: of campaigns, or with the exemplar's own CSV files; or single files.
        runs: how many runs of each manager to run again for their ways and timelines; 0: none.
        assisted_by: campaigns that assist real missions: under their conditions, and under many others.

    Raises:
        InputError: results cannot be read or compared, or an extra is not installed.
    """
    library = plotly_script()
    missions = read_missions(folders)
    results = _results(missions)
    if assisted_by is not None:
        results["sections"] = [*_assisted(folders, *assisted_by), *results["sections"]]
    ways = no_paths("Paths and timelines are in the report of one campaign's folder only")
    if len(folders) == 1 and folders[0].is_dir() and missions.frame["run"].notna().all():
        managers = list(dict.fromkeys(missions.frame["manager"]))
        fitting = max(1, min(runs, _MOST_WAYS // len(managers))) if runs else 0
        ways = paths_of(folders[0], missions.frame, managers, fitting)
    scenarios = [name for name in dict.fromkeys(missions.frame["scenario"]) if name]
    title = ", ".join([*scenarios, *dict.fromkeys(missions.frame["manager"])])
    content = {
        "version": __version__,
        "title": ", ".join(scenarios) or ", ".join(str(folder) for folder in folders),
        "folders": [str(folder) for folder in folders],
        "made": [_made(folder) for folder in folders],
        "results": results,
        "ways": ways,
    }
    text = page("report.html", f"Report: {title}", content, _STYLES, _SCRIPTS, library=library)
    check_page_size(text, LIMIT_BYTES)
    return text


@cache
def plotly_script() -> str:
    """Plotly's script, compressed.

    Raises:
        InputError: it is not installed.
    """
    try:
        script = files("plotly").joinpath("package_data", "plotly.min.js")
        return compressed(script.read_text(encoding="utf-8"))
    except (ImportError, OSError):
        remedy = "pip install 'suave-des[report]'"
        raise InputError("the report's charts need plotly, which is not installed", remedy=remedy) from None


def check_page_size(text: str, limit_bytes: int) -> None:
    """Check that a page can be sent by mail.

    Raises:
        InputError: it is too large.
    """
    size = len(text.encode(errors="backslashreplace"))  # as it is written
    if size > limit_bytes:
        problem = f"the page would have {size / 1e6:.1f} MB, more than {limit_bytes / 1e6:g}"
        raise InputError(problem, remedy="give fewer runs with --paths, or fewer folders")


def _results(missions: Missions) -> dict[str, Any]:
    """Compare missions, and prepare what follows for the page.

    Raises:
        InputError: they cannot be compared.
    """
    found = compare(missions)
    return {
        "conclusion": found.conclusion,
        "notes": found.notes,
        "sections": _sections(found),
        "remarks": found.remarks(),
        "drawn": chart_columns(missions),
    }


def _sections(found: Written) -> list[dict[str, Any]]:
    return [
        {
            "title": capital(title),
            "tables": [(each.title, each.headings, each.rows) for each in tables],
            "conclusions": list(sentences),
            "below": below,
        }
        for title, tables, sentences, below in found.sections()
    ]


def _assisted(real: Sequence[Path], same: Path, population: Path) -> list[dict[str, Any]]:
    """Return a section for each metric of real missions that simulated ones assist."""
    found = compare_assisted(real, same, population)
    sections = _sections(found)
    for section in sections:
        section["title"] += ", real missions assisted by simulated ones"
    sections[-1]["conclusions"] += found.remarks()
    return sections


def chart_columns(missions: Missions) -> dict[str, Any]:
    """Put missions into columns for the page's charts, at most MOST_DRAWN of them.

    Returns:
        groups: their names, as the tables have them, and the numbers of their looks, as in figures; titles of the
        metrics by column; columns: group number, run, seed, and each metric and swept parameter, None where there is no
        value; swept: names of parameters; every: 1, or n if only each nth run is there; missions: how many there are;
        is_paired: whether runs of the same seed and number share their random numbers.
    """
    groups, _ = grouped(missions)
    frame = missions.frame
    numbers = frame.groupby(["manager", "source"], sort=False).ngroup()  # as grouped() orders them
    every = max(1, math.ceil(len(frame) / MOST_DRAWN))
    has_runs = bool(frame["run"].notna().all())
    if every > 1:
        place = frame["run"] if has_runs else pandas.Series(range(len(frame)), frame.index)
        frame = frame[(place % every) == (1 if has_runs else 0)]
    seeds = frame["seed"].astype(str).tolist()
    columns = {
        "group": numbers[frame.index].tolist(),
        "run": _plain(frame["run"]) if has_runs else list(range(1, len(frame) + 1)),
        "seed": seeds[:1] if len(set(seeds)) == 1 else seeds,
        "found": _plain(frame["pipeline_found"].astype(float)),
    }
    titles = {name: METRICS[name].heading for name in _CHARTED if name in frame and frame[name].notna().any()}
    columns |= {name: _plain(frame[name]) for name in (*titles, *missions.swept)}
    names = [each.name for each in groups]
    return {
        "groups": names,
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
    values = column.astype(float).round(_DIGITS).tolist()
    return [None if not math.isfinite(value) else int(value) if value.is_integer() else value for value in values]


def _made(folder: Path) -> dict[str, Any]:
    """Read how the campaign in a folder was made; little is known of other folders."""
    known: dict[str, Any] = {"folder": str(folder), "facts": [], "command": "", "inputs": {}, "versions": {}}
    try:
        manifest = read_manifest(folder)
        return known | {
            "facts": list(_facts(manifest)),
            "command": shlex.join(map(str, manifest.get("command", ()))),
            "inputs": dict(manifest.get("inputs_sha256", {})),
            "versions": dict(manifest.get("versions", {})),
        }
    except (InputError, ValueError, AttributeError, TypeError):
        return known


def _facts(manifest: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for key in _FACTS:
        if key in manifest:
            value = manifest[key]
            yield key, ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    missions = manifest.get("missions", {})
    yield "missions", ", ".join(f"{number} {what.replace('_', ' ')}" for what, number in missions.items())
    for key in ("sweep", "perturbations"):
        if manifest.get(key):
            yield key, json.dumps(manifest[key])
