"""suave-des campaign and reproduce: many missions, and their result files."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from suave_des.cli.console import TEXT_WIDTH, errors, fits, output, plain_table, print_table, progress
from suave_des.cli.options import (
    CampaignWorkers,
    Files,
    ManagerOptions,
    OptionGroup,
    Overwrite,
    Quiet,
    Seed,
    SeedIfNew,
    TimeOut,
    check_no_use,
    comma_separated,
    command_line,
    grouped_options,
)
from suave_des.errors import InputError, number_of
from suave_des.files import write_files
from suave_des.resources import DEFAULT_SCENARIO

if TYPE_CHECKING:
    from collections.abc import Sequence

    from suave_des.campaign.campaign import CampaignResult
    from suave_des.campaign.missions import MissionFailure
    from suave_des.report.paper import PaperComparison, PaperFigure

_FAILURES_SHOWN = 20
_MANAGERS, _RUNS = "none,random,metacontrol", "20"
"""As in campaign.spec, which is not imported for --help."""


class ResultFormat(StrEnum):
    """Result files to write besides our own."""

    SUAVE = "suave"
    PARQUET = "parquet"


@dataclass(frozen=True)
class NewCampaign(OptionGroup):
    """Options that apply to a whole campaign; a resumed campaign has them already."""

    seed: SeedIfNew = None
    ensemble: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Give each run one of this file's parameter sets, which fit the real runs equally well; seams2023 is"
            " shipped.",
        ),
    ] = None
    time_out: TimeOut = None
    format: Annotated[
        list[ResultFormat] | None,
        typer.Option(help="Also write the exemplar's own files into DIR/suave, or runs.parquet; repeat it for both."),
    ] = None
    record_knowledge: Annotated[
        bool,
        typer.Option(
            "--record-knowledge", help="Record the knowledge states that managers analysed, in knowledge_states.jsonl."
        ),
    ] = False
    overwrite: Overwrite = False
    manager_option: ManagerOptions = None


@grouped_options
def campaign(
    scenario: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO",
            help="A scenario or campaign file, or the name of a shipped scenario.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for runs.csv, summary.csv and manifest.json.")
    ] = None,
    resume: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Continue the campaign in this folder; --runs may add runs.")
    ] = None,
    managers: Annotated[
        str | None,
        typer.Option(metavar="NAME,...", help="Managing subsystems: names, or module:Class.", show_default=_MANAGERS),
    ] = None,
    runs: Annotated[
        int | None, typer.Option(help="Missions for each manager, at each point.", show_default=_RUNS)
    ] = None,
    workers: CampaignWorkers = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://HOST:PORT",
            help="Run missions on the workers of this Dask scheduler; results are the same.",
        ),
    ] = None,
    until_ci: Annotated[
        str | None,
        typer.Option(
            metavar="METRIC:HALF_WIDTH",
            help="Stop a manager when the half-width of the 95% interval of its mean is below HALF_WIDTH, after 20 to"
            " --runs missions (by default 10000), as in search_time_s:5; or stop all when the difference of two"
            " managers is known that precisely, after at least 100 runs, as in 'metacontrol - bt: search_time_s: 2'.",
        ),
    ] = None,
    quiet: Quiet = False,
    yes: Annotated[
        bool,
        typer.Option(
            "--yes",
            help="Confirm more than a million missions; with --resume: trust the managers that DIR names.",
        ),
    ] = False,
    *,
    new: NewCampaign,
    files: Files,
) -> None:
    """Run many missions and write their results.

    A campaign file may hold all settings, with sweeps and values drawn in each run; options override it. Finished
    missions are kept; after an interruption, --resume DIR runs those that are missing.
    """
    names = None if managers is None else comma_separated(managers)
    if resume is not None:
        check_no_use(
            {"SCENARIO": scenario, "--out": out, **new.given, **files.given},
            "with --resume: the settings of a campaign cannot be changed",
            "remove it, or start a new campaign in another folder",
        )
    elif scenario is None or out is None:
        missing = "SCENARIO" if scenario is None else "--out DIR"
        raise InputError(f"{missing} is missing", remedy="see suave-des campaign --help")
    from suave_des.campaign.campaign import resume_campaign, run_campaign
    from suave_des.campaign.spec import managers_of
    from suave_des.cli.summary import print_differences, print_stops, print_summary

    with progress(str(resume or scenario), quiet=quiet) as show:
        if resume is not None:
            result = resume_campaign(
                resume,
                workers,
                runs=runs,
                until_ci=until_ci,
                on_progress=show,
                scheduler=scheduler,
                managers=names or (),
                confirmed=yes,
            )
        else:
            assert scenario is not None
            options = (
                files.with_options(new.manager_option, names or managers_of(scenario))
                if new.manager_option
                else files.replacements
            )
            result = run_campaign(
                scenario,
                names,
                runs,
                new.seed,
                workers,
                out,
                on_progress=show,
                **options,
                suave_format=ResultFormat.SUAVE in (new.format or ()),
                parquet=ResultFormat.PARQUET in (new.format or ()),
                record_knowledge=new.record_knowledge,
                time_out_s=new.time_out,
                until_ci=until_ci,
                ensemble=new.ensemble,
                confirmed=yes,
                overwrite=new.overwrite,
                command=command_line(),
                scheduler=scheduler,
            )
    console = output()
    print_summary(console, result)
    print_stops(console, result)
    print_differences(console, result)
    kept = f"{number_of(result.done, 'mission')} {'is' if result.done == 1 else 'are'}"
    console.print(f"{kept} in {result.folder}/runs.csv")
    exit_telling_failures(result)


def exit_telling_failures(result: CampaignResult) -> None:
    """List the missions that have no row, and exit with status 3 if there are any."""
    console = errors()
    for remark in result.remarks:
        console.print(f"suave-des: {remark}")
    if not result.failures:
        return
    alike: dict[tuple[str, str], list[MissionFailure]] = {}
    for failure in result.failures:
        alike.setdefault((failure.manager, failure.cause), []).append(failure)
    groups = list(alike.values())
    for first, *others in groups[:_FAILURES_SHOWN]:
        line = " ".join(str(first).split())
        count = f" ({len(others) + 1} missions like this)" if others else ""
        console.print(f"suave-des: failed: {line}{count}")
    more = sum(map(len, groups[_FAILURES_SHOWN:]))
    if more > 0:
        where = "" if result.folder is None else f", all of them in {result.folder}/manifest.json"
        console.print(f"suave-des: failed: {more} more{where}")
    console.print(f"suave-des: {len(result.failures)} of {result.planned} missions failed; the others are kept")
    raise typer.Exit(3)


@grouped_options
def reproduce(
    runs: Annotated[int, typer.Option(help="Missions for each manager; the paper has 20.")] = 200,
    workers: CampaignWorkers = None,
    seed: Seed = 1,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for result files; without it, none are written.")
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
    from suave_des.report.paper import FILES, compare, published_estimates

    published = published_estimates()
    managers = list(dict.fromkeys(manager for manager, _ in published))
    with progress("reproduce", quiet=quiet) as show:
        result = run_campaign(
            DEFAULT_SCENARIO,
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
        console.print("\nNo files were written; --out DIR keeps each mission's figures.")
    else:
        write_files(out, dict(zip(FILES, (comparison.markdown(), comparison.csv()), strict=True)))
        console.print(f"\nThe missions are in {out}/runs.csv, this table in {out}/paper_table.md")
    exit_telling_failures(result)


def print_comparison(console: Console, comparison: PaperComparison) -> None:
    """Print the paper's table beside the simulated results, with remarks on their differences."""
    from suave_des.report.compared_metrics import PAPER_METRICS

    for metric, title in PAPER_METRICS.items():
        figures = [figure for figure in comparison.figures if figure.metric == metric]
        table = _table(figures, is_narrow=False)
        if not fits(console, table):
            table = _table(figures, is_narrow=True)
        print_table(console, title, table)
        console.print()
    for line in comparison.remarks():
        console.print(fill(line, min(console.width, TEXT_WIDTH)))


def _table(figures: Sequence[PaperFigure], *, is_narrow: bool) -> Table:
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
