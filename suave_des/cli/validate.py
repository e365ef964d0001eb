"""suave-des validate: simulated missions compared with real ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.campaign import exit_telling_failures
from suave_des.cli.console import output, print_table, progress
from suave_des.cli.options import (
    Fields,
    Files,
    Given,
    ManagersInData,
    Quiet,
    check_no_use,
    comma_separated,
    command_line,
)
from suave_des.files import check_output_folder, make_output_folder, write_files
from suave_des.resources import DEFAULT_SCENARIO, find, shipped_folder

if TYPE_CHECKING:
    from suave_des.campaign.campaign import CampaignResult
    from suave_des.records.runs import Runs

TARGETS_NOT_MET = 1
"""Exit status with --strict."""
_RUNS = 2000

_Data = Annotated[
    list[str] | None,
    typer.Option(
        "--data",
        metavar="FILE",
        help="Real missions; repeatable. By default those published for the scenario, or else the 60"
        " of the SUAVE paper.",
        show_default=False,
    ),
]


def validate(
    scenario: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO",
            help="A scenario or campaign file, or a shipped scenario.",
            show_default=DEFAULT_SCENARIO,
        ),
    ] = None,
    data: _Data = None,
    runs_file: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Compare this runs.csv; nothing is simulated.")
    ] = None,
    managers: ManagersInData = None,
    targets: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Shares to compare; by default NAME.targets.yaml beside NAME.csv."),
    ] = None,
    *,
    options: Annotated[
        Given,
        Fields(
            ("runs", "workers", "seed", "out", "overwrite"),
            {
                "runs": "Missions for each manager; with a campaign file, under each condition.",
                "out": "Folder for tables and validation.json.",
            },
            {"runs": f"{_RUNS}, over all conditions"},
        ),
    ],
    strict: Annotated[
        bool, typer.Option("--strict", help=f"Exit with status {TARGETS_NOT_MET} unless every target is met.")
    ] = False,
    quiet: Quiet = False,
    files: Files,
) -> None:
    """Compare simulated missions with real ones: distributions, clusters, conclusions.

    With a campaign file that sweeps the conditions of the real missions, each is compared under its own condition.
    """
    from suave_des import __version__
    from suave_des.results.real import CONDITION, read_conditions, read_real, targets_of
    from suave_des.results.validation import FILES
    from suave_des.results.validation import validate as compare

    name = scenario or DEFAULT_SCENARIO
    out, seed, overwrite = options.get("out"), options.get("seed", 1), "overwrite" in options
    if runs_file is not None:
        check_no_use(files.given, "with --runs-file", "leave one of them out")
    wants_conditions = runs_file is None or scenario is not None
    conditions = read_conditions(name, **files.replacements) if wants_conditions else None
    real = read_real(_data_files(name, data), conditions)
    chosen = real.choose(comma_separated(managers))
    shares, limits, targets_paths = targets_of(real, targets)
    word = "published" if all(_is_shipped(file.path) for file in real.files) else "real"

    campaign: CampaignResult | None = None
    sources: dict[str, object] = {
        "data": [_named(file) for file in real.files],
        "targets": [_shown(path) for path in targets_paths],
        "seed": seed,
    }
    if runs_file is not None:
        from suave_des.records.runs import read_runs

        recorded = read_runs(runs_file, () if conditions is None else conditions.names)
        recorded.check_simulated(chosen)
        if out is not None:
            check_output_folder(out, "campaign", overwrite=overwrite)
            make_output_folder(out)
        simulated = recorded.frame
        sources |= {"runs_file": _named(recorded)}
    else:
        from suave_des.campaign.campaign import run_campaign

        runs = -(-_RUNS // len(conditions or "1"))
        settings: Given = {"runs": runs, "workers": None, "command": command_line(), **options}
        with progress(name, quiet=quiet) as show:
            campaign = run_campaign(name, chosen, on_progress=show, **settings, **files.replacements)
        simulated = campaign.frame()
        sources |= {"scenario": campaign.loaded.scenario.name, "runs": settings["runs"]}
        if not set(campaign.spec.managers) <= set(simulated["manager"]):  # one has no mission to compare
            exit_telling_failures(campaign)
    if conditions is not None:
        simulated = simulated.assign(**{CONDITION: conditions.numbers(simulated)})
    validation = compare(real.frame, simulated, chosen, shares=shares, limits=limits, seed=seed)
    console = output()
    notes = list(real.notes)
    if conditions is not None:
        notes += [f"Condition {number}: {conditions.text(number)}" for number in range(1, len(conditions) + 1)]
    for line in [*notes, ""] if notes else ():
        console.print(line)
    for table in validation.tables(word):
        print_table(console, table)
        console.print()
    console.print("\n".join(validation.remarks(word)))
    if out is None:
        console.print("\nNo files were written; --out DIR keeps the tables.")
    else:
        about = {"version": __version__, "command": command_line(), **sources}
        write_files(out, validation.texts(about), stale=FILES)
        console.print(f"\nTables and validation.json are in {out}")
    if campaign is not None:
        exit_telling_failures(campaign)
    if strict and not validation.all_met:
        raise typer.Exit(TARGETS_NOT_MET)


def _data_files(scenario: str, given: list[str] | None) -> list[Path]:
    """Return the files of real missions: those given, or those published for the scenario, or the paper's."""
    from suave_des.results.real import PAPERS_RUNS, published_for

    if given:
        return [find(each, "scenarios/published") for each in given]
    return [published_for(scenario) or find(PAPERS_RUNS, "scenarios/published")]


def _named(runs: Runs) -> dict[str, str | None]:
    return {"file": _shown(runs.path), "sha256": runs.sha256}


def _shown(path: Path) -> str:
    """Name a file as it goes into a result: a shipped one without where it is installed."""
    return f"shipped/{path.name}" if _is_shipped(path) else path.as_posix()


def _is_shipped(path: Path) -> bool:
    return path.is_relative_to(shipped_folder("scenarios/published"))
