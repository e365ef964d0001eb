"""suave-des replay and report: results as pages for a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from suave_des.cli.options import Files, Results, SeedIfNew, check_no_use, comma_separated, grouped_options
from suave_des.errors import InputError

_SEED, _RUN, _POINT = 1, 1, 0
_PATHS, _MOST_PATHS = 12, 100
"""Defaults as in suave_des.pages, which is not imported for --help."""
Open = Annotated[bool, typer.Option("--open", help="Show the page in the browser.")]


@grouped_options
def replay(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[DIR]...",
            help="Output folder of run or campaign; two of run are shown side by side.",
            show_default=False,
        ),
    ] = None,
    scenario: Annotated[
        str | None,
        typer.Option("--scenario", metavar="SCENARIO", help="In place of DIR: run missions of this scenario."),
    ] = None,
    managers: Annotated[
        str | None,
        typer.Option(
            "--managers",
            metavar="NAME,...",
            help="One or two managing subsystems, on the same random numbers.",
            show_default="metacontrol; of a campaign the last and the first",
        ),
    ] = None,
    run_number: Annotated[
        int | None,
        typer.Option("--run", metavar="K", help="Run of the campaign, or with this seed.", show_default=str(_RUN)),
    ] = None,
    seed: SeedIfNew = None,
    point: Annotated[
        int | None,
        typer.Option("--point", metavar="N", help="Point of the campaign's sweep.", show_default=str(_POINT)),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="Page to write.", show_default="replay.html, in DIR or the current folder"
        ),
    ] = None,
    show: Open = False,
    *,
    files: Files,
) -> None:
    """Make a page that plays a mission, or two side by side.

    It needs no network, and shows the vehicle, what its camera sees, and what its manager knew, inferred and decided.
    """
    from suave_des.pages.page import check_page_file, write_page
    from suave_des.pages.replay import replay_page
    from suave_des.pages.sources import Chosen, missions_in, missions_run
    from suave_des.scenario.loader import load_scenario

    folders = folders or []
    if bool(folders) == (scenario is not None):
        problem = "both DIR and --scenario are given" if folders else "nothing to play is given"
        raise InputError(problem, remedy="give DIR, the --out folder of run or campaign, or --scenario NAME")
    if folders:
        check_no_use({"--seed": seed, **files.given}, "with DIR, whose missions have their own")
    else:
        check_no_use({"--point": point}, "without a campaign's folder")
    page_file = out or (folders[0] if folders else Path()) / "replay.html"
    chosen = Chosen(
        comma_separated(managers),
        run=_RUN if run_number is None else run_number,
        seed=_SEED if seed is None else seed,
        point=point or _POINT,
    )
    if out is not None or not folders:
        check_page_file(page_file)
    if scenario is not None:
        missions = missions_run(load_scenario(scenario, **files.replacements), chosen)
    else:
        missions = missions_in(folders, chosen)
    write_page(page_file, replay_page(missions), show=show)
    print(f"{' and '.join(each.name for each in missions)}: {page_file}")


def report(
    results: Results,
    paths: Annotated[
        int | None,
        typer.Option(
            "--paths",
            metavar="N",
            help="Runs of each manager whose way and timeline are in the page; 0: none.",
            show_default=str(_PATHS),
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Page to write.", show_default="report.html, in the first DIR"),
    ] = None,
    show: Open = False,
) -> None:
    """Make a page about a campaign: what follows from it, its tables, charts to explore, and how it was made.

    It is one file that needs no network.
    """
    from suave_des.pages.page import check_page_file, write_page
    from suave_des.pages.report import report_page

    runs = _PATHS if paths is None else paths
    if not 0 <= runs <= _MOST_PATHS:
        raise InputError(f"--paths: {runs} is out of range", remedy=f"give 0 to {_MOST_PATHS}")
    first = results[0]
    page_file = out or (first if first.is_dir() else first.parent) / "report.html"
    if out is not None:
        check_page_file(page_file)
    write_page(page_file, report_page(results, runs), show=show)
    print(f"the report is {page_file}")
