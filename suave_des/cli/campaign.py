"""suave-des campaign: many missions, and their result files."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import (
    Files,
    ManagerOptions,
    Overwrite,
    Quiet,
    TimeOut,
    command_line,
    grouped_options,
)
from suave_des.errors import InputError

if TYPE_CHECKING:
    from suave_des.campaign.campaign import CampaignResult
    from suave_des.campaign.missions import Failure

_FAILURES_SHOWN = 20
_MANAGERS, _RUNS, _SEED = "none,random,metacontrol", "20", "1"
"""As in campaign.spec, which is not imported for --help."""
_WORKERS = 2


class Format(StrEnum):
    """Result files to write besides our own."""

    SUAVE = "suave"
    PARQUET = "parquet"


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
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for runs.csv, summary.csv and manifest.json.")
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option("--resume", metavar="DIR", help="Go on with the campaign in this folder; --runs may add runs."),
    ] = None,
    managers: Annotated[
        str | None,
        typer.Option(
            "--managers",
            metavar="NAME,...",
            help="Managing subsystems: names, or module:Class.",
            show_default=_MANAGERS,
        ),
    ] = None,
    runs: Annotated[
        int | None,
        typer.Option("--runs", help="Missions for each manager, at each point.", show_default=_RUNS),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers",
            help="Processes that run missions; any number gives the same bytes.",
            show_default=str(_WORKERS),
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="tcp://HOST:PORT",
            help="Run missions on the workers of this Dask scheduler instead; the same bytes again.",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Seed of everything that is random.", show_default=_SEED)
    ] = None,
    ensemble: Annotated[
        str | None,
        typer.Option(
            "--ensemble",
            metavar="FILE",
            help="Give each run one of this file's parameter sets, which fit the real runs equally well; for instance"
            " seams2023, which is shipped.",
        ),
    ] = None,
    until_ci: Annotated[
        str | None,
        typer.Option(
            "--until-ci",
            metavar="METRIC:HALF_WIDTH",
            help="Stop a manager when half the 95% interval of the metric's mean is less, after 20 runs at least, and"
            " after --runs (then 10000 if left out) at most; for instance search_time_s:5. Stop all when the difference"
            " of two is known, after 100 runs at least: 'metacontrol - bt: search_time_s: 2'.",
        ),
    ] = None,
    time_out: TimeOut = None,
    also: Annotated[
        list[Format] | None,
        typer.Option(
            "--format",
            help="Write the exemplar's own files into DIR/suave, or runs.parquet, besides; repeat it for both.",
        ),
    ] = None,
    record_knowledge: Annotated[
        bool,
        typer.Option("--record-knowledge", help="Keep what managers reasoned about, in knowledge_states.jsonl."),
    ] = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    yes: Annotated[
        bool,
        typer.Option(
            "--yes",
            help="More than a million missions are meant; with --resume: managers that DIR names may run.",
        ),
    ] = False,
    manager_option: ManagerOptions = None,
    *,
    files: Files,
) -> None:
    """Run many missions and write their results.

    A campaign file has all of it, with what is swept or drawn anew in each run; options take precedence over it.
    What is done is kept while the campaign runs; after an interruption, --resume DIR does the rest.
    """
    if workers is None:
        workers = _WORKERS if scheduler is None else 1
    names = None if managers is None else [name.strip() for name in managers.split(",") if name.strip()]
    if resume is not None:
        fixed = {
            "SCENARIO": scenario,
            "--out": out,
            "--seed": seed,
            "--ensemble": ensemble,
            "--time-out": time_out,
            "--format": also or None,
            "--record-knowledge": record_knowledge,
            "--overwrite": overwrite,
            "--manager-option": manager_option,
            **files.given,
        }
        for option, value in fixed.items():
            if value is not None and value is not False:
                raise InputError(
                    f"{option} has no use with --resume: the campaign goes on as it began",
                    remedy="leave it out, or start anew in another folder",
                )
    elif scenario is None or out is None:
        missing = "SCENARIO" if scenario is None else "--out DIR"
        raise InputError(f"{missing} is missing", remedy="see suave-des campaign --help")
    from suave_des.campaign.runner import resume_campaign, run
    from suave_des.campaign.spec import CampaignSpec, managers_of
    from suave_des.cli.console import output, progress
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
                files.with_options(manager_option, names or managers_of(scenario))
                if manager_option
                else files.replacements
            )
            spec = CampaignSpec.of(
                scenario,
                managers=names,
                runs=runs,
                seed=seed,
                workers=workers,
                out=out,
                **options,
                suave_format=Format.SUAVE in (also or ()),
                parquet=Format.PARQUET in (also or ()),
                record_knowledge=record_knowledge,
                time_out_s=time_out,
                until_ci=until_ci,
                ensemble=ensemble,
                confirmed=yes,
                overwrite=overwrite,
                command=command_line(),
                scheduler=scheduler,
            )
            result = run(spec, show)
    console = output()
    print_summary(console, result)
    print_stops(console, result)
    print_differences(console, result)
    console.print(f"{result.done} missions are in {result.folder}/runs.csv", soft_wrap=True)
    exit_telling_failures(result)


def exit_telling_failures(result: CampaignResult) -> None:
    """List the missions that have no row, and exit with status 3 if there are any."""
    from suave_des.cli.console import errors

    console = errors()
    for remark in result.remarks:
        console.print(f"suave-des: {remark}", soft_wrap=True, markup=False)
    if not result.failures:
        return
    alike: dict[tuple[str, str], list[Failure]] = {}
    for failure in result.failures:
        alike.setdefault((failure.manager, failure.cause), []).append(failure)
    groups = list(alike.values())
    for first, *others in groups[:_FAILURES_SHOWN]:
        line = " ".join(str(first).split())
        count = f" ({len(others) + 1} missions like this)" if others else ""
        console.print(f"suave-des: failed: {line}{count}", soft_wrap=True, markup=False)
    more = sum(map(len, groups[_FAILURES_SHOWN:]))
    if more > 0:
        where = "" if result.folder is None else f", all of them in {result.folder}/manifest.json"
        console.print(f"suave-des: failed: {more} more{where}", soft_wrap=True, markup=False)
    console.print(f"suave-des: {len(result.failures)} of {result.planned} missions failed; the others are kept")
    raise typer.Exit(3)
