"""suave-des reproduce: the paper's experiment, and its results beside the published ones."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.campaign import exit_telling_failures
from suave_des.cli.options import Files, Overwrite, Quiet, Seed, TimeOut, Workers, command_line, grouped_options

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console
    from rich.table import Table

    from suave_des.report.paper import PaperComparison, PaperFigure

SCENARIO = "seams2023"
_TEXT_WIDTH = 95


@grouped_options
def reproduce(
    runs: Annotated[int, typer.Option("--runs", help="Missions for each manager; the paper has 20.")] = 200,
    workers: Workers = 2,
    seed: Seed = 1,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for result files; left out, none are written.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    time_out: TimeOut = None,
    *,
    files: Files,
) -> None:
    """Run the paper's experiment and compare the results.

    Prints the table of the paper (SEAMS 2023, arXiv:2303.09220) beside the simulated results.
    """
    from suave_des.campaign.campaign import run_campaign
    from suave_des.campaign.output import write_files
    from suave_des.cli.console import output, progress
    from suave_des.report.paper import FILES, compare, published_estimates

    published = published_estimates()
    managers = list(dict.fromkeys(manager for manager, _ in published))
    with progress("reproduce", quiet=quiet) as show:
        result = run_campaign(
            SCENARIO,
            managers,
            runs,
            seed,
            workers,
            out,
            overwrite=overwrite,
            time_out_s=time_out,
            command=command_line(),
            on_progress=show,
            **files.replacements,
        )
    comparison = compare(result.frame(), published)
    console = output()
    print_comparison(console, comparison)
    if out is None:
        console.print("\nNo files were written; --out DIR keeps each mission's figures.", soft_wrap=True)
    else:
        write_files(out, dict(zip(FILES, (comparison.markdown(), comparison.csv()), strict=True)))
        console.print(f"\nThe missions are in {out}/runs.csv, this table in {out}/paper_table.md", soft_wrap=True)
    exit_telling_failures(result)


def print_comparison(console: Console, comparison: PaperComparison) -> None:
    """Print the paper's table beside the simulated results, with remarks on their differences."""
    from suave_des.cli.console import print_table
    from suave_des.report.runs import METRICS

    for metric, title in METRICS.items():
        figures = [figure for figure in comparison.figures if figure.metric == metric]
        table = _table(figures, is_narrow=False)
        if console.measure(table, options=console.options.update(width=1000)).maximum > console.width:
            table = _table(figures, is_narrow=True)
        print_table(console, title, table)
        console.print()
    for line in comparison.remarks():
        console.print(fill(line, min(console.width, _TEXT_WIDTH)))


def _table(figures: Sequence[PaperFigure], *, is_narrow: bool) -> Table:
    from suave_des.cli.console import plain_table

    table = plain_table()
    table.add_column("manager", min_width=12)
    table.add_column("", min_width=5)
    for heading in ("paper", "95% interval", "here", "95% interval", "difference"):
        table.add_column(heading, justify="right", min_width=8, no_wrap=True)
    if not is_narrow:
        table.add_column("")
    for figure in figures:
        *cells, difference, mark = figure.cells()
        if is_narrow:
            cells = [cell.replace(" to ", "..") for cell in cells]
            ends = [f"{difference} {mark or ' '}"]
        else:
            ends = [difference, mark]
        table.add_row(figure.manager, figure.statistic, *cells, *ends)
    return table
