"""suave-des compare, figure, replay and report: results as tables, pictures, and pages for a browser."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.console import TEXT_WIDTH, output
from suave_des.cli.options import (
    Files,
    Results,
    SeedIfNew,
    Trusted,
    check_no_use,
    comma_separated,
)
from suave_des.errors import InputError
from suave_des.files import check_output_file, write_files

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from suave_des.records.mission_folder import MissionRecord
    from suave_des.results.assisted import AssistedComparison
    from suave_des.results.comparison import Comparison
    from suave_des.results.mission_figures import Rules


class CompareFormat(StrEnum):
    """How a comparison is printed."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"
    MARKDOWN = "markdown"
    LATEX = "latex"


AssistedBy = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="DIR... are real missions; this is a campaign under the same conditions."),
]
Population = Annotated[
    Path | None,
    typer.Option(metavar="DIR", help="With --assisted-by: a campaign under many such conditions."),
]


def compare(
    results: Results,
    managers: Annotated[
        str | None, typer.Option(metavar="NAME,...", help="Only these, in this order.", show_default="all")
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Compare all others with this one only.", show_default="each with each"),
    ] = None,
    metrics: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN,...",
            help="Columns of runs.csv.",
            show_default="search time, distance, found, reaction time",
        ),
    ] = None,
    by: Annotated[
        str | None, typer.Option(metavar="KEY,...", help="Compare values of these swept parameters, too.")
    ] = None,
    half_width: Annotated[
        list[str] | None,
        typer.Option(metavar="METRIC:VALUE", help="Estimate the runs needed for an interval this narrow; repeatable."),
    ] = None,
    unpaired: Annotated[bool, typer.Option("--unpaired", help="Treat runs as independent.")] = False,
    assisted_by: AssistedBy = None,
    population: Population = None,
    plan: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC:VALUE",
            help="Plan real missions for intervals this narrow.",
        ),
    ] = None,
    as_format: Annotated[CompareFormat, typer.Option("--format", help="Output format.")] = CompareFormat.TABLE,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write .csv, .json, .md or .tex instead of printing.",
        ),
    ] = None,
) -> None:
    """Compare managers by their results.

    Runs that share their random numbers are compared in pairs, which takes fewer missions. A few real missions can be
    assisted by simulated ones, and planned.
    """
    from suave_des.results.compare import compare_folders
    from suave_des.results.comparison import ENDINGS

    if out is not None:
        _check_out(out, ENDINGS)
    names, columns = comma_separated(managers), comma_separated(metrics)
    comparison: Comparison | AssistedComparison
    if assisted_by is not None or population is not None or plan:
        unused = {"--by": by, "--against": against, "--half-width": half_width, "--unpaired": unpaired}
        check_no_use(unused, "with --assisted-by or --plan")
        comparison = _assisted(results, assisted_by, population, plan or (), names, columns)
    else:
        comparison = compare_folders(
            results,
            managers=names,
            metrics=columns,
            by=comma_separated(by),
            against=against,
            half_widths=half_width or (),
            unpaired=unpaired,
        )
    if out is not None:
        write_files(out.parent, {out.name: getattr(comparison, ENDINGS[out.suffix.lower()])()})
        print(f"compared in {out}")
    elif as_format is CompareFormat.TABLE:
        print(comparison.text(min(output().width, TEXT_WIDTH)), end="")
    else:
        print(getattr(comparison, as_format.value)(), end="")


def _assisted(
    results: Sequence[Path],
    same: Path | None,
    population: Path | None,
    plan: Sequence[str],
    managers: Sequence[str],
    metrics: Sequence[str],
) -> AssistedComparison:
    """Compare real missions, assisted by simulated ones, or plan them."""
    from suave_des.results.assisted import compare_assisted, planned

    both = _both(same, population)
    if both is not None:
        return compare_assisted(results, *both, managers=managers, metrics=metrics, half_widths=plan)
    check_no_use({"--metrics": metrics or None}, "with --plan, which names its own")
    return planned(results, plan, managers=managers)


def _both(same: Path | None, population: Path | None) -> tuple[Path, Path] | None:
    """Return the two campaigns that assist real missions; None without.

    Raises:
        InputError: only one of them is given.
    """
    if same is not None and population is not None:
        return same, population
    if same is not None or population is not None:
        given, lacking = ("--assisted-by", "--population") if population is None else ("--population", "--assisted-by")
        raise InputError(f"{given} is given without {lacking}", remedy="give both: suave-des campaign makes them")
    return None


def _check_out(out: Path, endings: Iterable[str]) -> None:
    if out.suffix.lower() not in endings:
        problem = f"expected a table, got {out.suffix or 'a file without an ending'}"
        raise InputError(problem, file=out, remedy=f"one of {', '.join(endings)}")
    check_output_file(out, overwrite=True)


class FigureKind(StrEnum):
    """What is drawn; as in report.figures, which is not imported for --help."""

    AUTO = "auto"
    MAP = "map"
    TIMELINE = "timeline"
    DISTRIBUTIONS = "distributions"
    DIFFERENCES = "differences"
    SWEEP = "sweep"
    HEATMAP = "heatmap"


def figure(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR...", help="Result folders or CSV files.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="Picture to write: .png, .pdf or .svg.")],
    kind: Annotated[
        FigureKind,
        typer.Option(
            help="For a mission: map, timeline; for a campaign: distributions, differences;"
            " for a sweep: sweep, heatmap."
        ),
    ] = FigureKind.AUTO,
    parameters: Annotated[
        str | None, typer.Option(metavar="KEY,...", help="Swept parameters to draw.", show_default="all")
    ] = None,
) -> None:
    """Draw a mission's map or a campaign's results.

    By default the contents of DIR decide: the map of a mission, a campaign's distributions, or the means of a sweep.
    """
    from suave_des.results.figures import draw_results

    def rules_of(record: MissionRecord) -> Rules:
        from suave_des.pages.recorded import adaptation_rules

        return adaptation_rules(record)

    draw_results(folders, out, kind.value, comma_separated(parameters), rules_of)
    print(f"drawn in {out}")


_SEED, _RUN, _POINT = 1, 1, 0
_PATHS, _MOST_PATHS = 12, 100
"""Defaults as in suave_des.pages, which is not imported for --help."""
Open = Annotated[bool, typer.Option("--open", help="Show the page in the browser.")]


def replay(
    folders: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[DIR]...",
            help="Folder of a campaign, or one or two of run.",
            show_default=False,
        ),
    ] = None,
    scenario: Annotated[
        str | None, typer.Option(metavar="SCENARIO", help="Run missions of this scenario instead.")
    ] = None,
    managers: Annotated[
        str | None,
        typer.Option(
            "--managers",
            "--manager",
            metavar="NAME,...",
            help="One or two managers.",
            show_default="metacontrol; for a campaign, the last and the first",
        ),
    ] = None,
    run_number: Annotated[
        int | None,
        typer.Option("--run", metavar="K", help="Run number.", show_default=str(_RUN)),
    ] = None,
    seed: SeedIfNew = None,
    point: Annotated[
        int | None, typer.Option(metavar="N", help="Point of the campaign's sweep.", show_default=str(_POINT))
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Page to write.", show_default="replay.html, in DIR or the current folder"),
    ] = None,
    show: Open = False,
    yes: Trusted = False,
    *,
    files: Files,
) -> None:
    """Make a page that plays a mission, or two side by side.

    It needs no network, and shows the vehicle, what its camera sees, and what its manager knew, inferred and decided.
    """
    from suave_des.files import check_output_file
    from suave_des.pages.page import write_page
    from suave_des.pages.recorded import missions_in, missions_run
    from suave_des.pages.replay import replay_page
    from suave_des.scenario.loader import load_scenario

    folders = folders or []
    if bool(folders) == (scenario is not None):
        problem = "both DIR and --scenario are given" if folders else "there is nothing to play"
        raise InputError(problem, remedy="give DIR, the --out folder of run or campaign, or --scenario NAME")
    if folders:
        check_no_use({"--seed": seed, **files.given}, "with DIR, whose missions have their own")
    else:
        check_no_use({"--point": point}, "without a campaign's folder")
    page_file = out or (folders[0] if folders else Path()) / "replay.html"
    names, run = comma_separated(managers), _RUN if run_number is None else run_number
    if out is not None or not folders:
        check_output_file(page_file, overwrite=True)
    if scenario is not None:
        loaded = load_scenario(scenario, **files.replacements)
        missions = missions_run(loaded, names or ("metacontrol",), run, _SEED if seed is None else seed)
    else:
        missions = missions_in(folders, names, run, point or _POINT, confirmed=yes)
    write_page(page_file, replay_page(missions), show=show)
    print(f"{' and '.join(each.record.name for each in missions)}: {page_file}")


def report(
    results: Results,
    paths: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Runs of each manager with path and timeline.",
            show_default=str(_PATHS),
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Page to write.", show_default="report.html, in the first DIR")
    ] = None,
    assisted_by: AssistedBy = None,
    population: Population = None,
    show: Open = False,
) -> None:
    """Make a page about a campaign: conclusion, tables, charts.

    It is one file that needs no network.
    """
    from suave_des.files import check_output_file
    from suave_des.pages.page import write_page
    from suave_des.pages.report import report_page

    runs = _PATHS if paths is None else paths
    if not 0 <= runs <= _MOST_PATHS:
        raise InputError(f"--paths: {runs} is out of range", remedy=f"give 0 to {_MOST_PATHS}")
    assisting, first = _both(assisted_by, population), results[0]
    page_file = out or (first if first.is_dir() else first.parent) / "report.html"
    if out is not None:
        check_output_file(page_file, overwrite=True)
    write_page(page_file, report_page(results, runs, assisting), show=show)
    print(f"the report is {page_file}")
