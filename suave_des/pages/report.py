"""The report: a page about a campaign, with its tables, charts to explore, and how it was made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Final

from suave_des import __version__
from suave_des.errors import InputError
from suave_des.pages.page import compressed, page
from suave_des.pages.paths import Paths, paths_of
from suave_des.pages.report_data import check_page_size, made_from, results_of
from suave_des.report.result_files import read_missions

LIMIT_BYTES: Final = 5_000_000
PATHS: Final = 12
"""Runs of each manager whose way is in a page."""
_MOST_WAYS: Final = 120
_STYLES: Final = ("common.css", "report.css")
_SCRIPTS: Final = ("common.js", "charts.js", "report.js")


def report_page(folders: Sequence[Path], runs: int = PATHS) -> str:
    """Make the report of campaigns, or of other results that `compare` reads.

    Args:
        folders: of campaigns, or with the exemplar's own CSV files; or single files.
        runs: how many runs of each manager to run again for their ways and timelines; 0: none.

    Raises:
        InputError: results cannot be read or compared, or an extra is not installed.
    """
    library = plotly_script()
    missions = read_missions(folders)
    results = results_of(missions)
    ways = Paths(note="Paths and timelines are in the report of one campaign's folder only")
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
        "made": [asdict(made_from(folder)) for folder in folders],
        "results": asdict(results),
        "ways": asdict(ways),
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
