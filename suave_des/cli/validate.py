"""suave-des validate: simulated missions compared with real ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.campaign import exit_telling_failures
from suave_des.cli.options import Files, Overwrite, Quiet, Seed, Workers, command_line, grouped_options

if TYPE_CHECKING:
    import pandas

    from suave_des.campaign.campaign import CampaignResult
    from suave_des.report.runs import Runs
    from suave_des.validation.validation import Validation

TARGETS_NOT_MET = 1
"""Exit status with --strict."""
_SCENARIO, _DATA = "seams2023", "seams2023_runs.csv"

_Data = Annotated[
    str, typer.Option("--data", metavar="FILE", help="Real missions; left out, the 60 published with the SUAVE paper.")
]
_Managers = Annotated[
    str | None, typer.Option("--managers", metavar="NAME,...", help="Of those in the data; left out: all.")
]


@grouped_options
def validate(
    scenario: Annotated[
        str | None,
        typer.Argument(
            metavar="[SCENARIO]", help="A scenario file, or the name of a shipped one.", show_default=_SCENARIO
        ),
    ] = None,
    data: _Data = _DATA,
    runs_file: Annotated[
        Path | None,
        typer.Option("--runs-file", metavar="FILE", help="Compare this campaign's runs.csv; nothing is simulated."),
    ] = None,
    managers: _Managers = None,
    targets: Annotated[
        Path | None,
        typer.Option(
            "--targets", metavar="FILE", help="Shares to compare; left out, NAME.targets.yaml beside NAME.csv."
        ),
    ] = None,
    runs: Annotated[int, typer.Option("--runs", help="Missions for each manager.")] = 2000,
    workers: Workers = 2,
    seed: Seed = 1,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for tables, validation.json and figures.")
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help=f"Exit with status {TARGETS_NOT_MET} unless every target is met.")
    ] = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    *,
    files: Files,
) -> None:
    """Compare simulated missions with real ones: distributions, clusters, conclusions."""
    from suave_des.cli.console import output, progress
    from suave_des.cli.validation_tables import print_validation
    from suave_des.errors import InputError
    from suave_des.report.runs import choose_managers, read_runs
    from suave_des.resources import find
    from suave_des.validation.shares import read_shares, shares_beside
    from suave_des.validation.validation import validate as compare

    published = read_runs(find(data, "scenarios/published"))
    chosen = choose_managers(published, managers)
    targets_path = targets or shares_beside(published.path)
    shares = () if targets_path is None else read_shares(targets_path)

    campaign: CampaignResult | None = None
    sources: dict[str, object] = {"data": _named(published), "targets": _shown(targets_path), "seed": seed}
    if runs_file is not None:
        for option in files.given:
            raise InputError(f"{option} has no use with --runs-file", remedy="leave one of them out")
        recorded = _recorded(runs_file, chosen, scenario, out, overwrite=overwrite)
        simulated = recorded.frame
        sources |= {"runs_file": _named(recorded)}
    else:
        from suave_des.campaign.campaign import run_campaign

        _check_known(published, chosen)
        name = scenario or _SCENARIO
        with progress(name, quiet=quiet) as show:
            campaign = run_campaign(
                name,
                chosen,
                runs,
                seed,
                workers,
                out,
                overwrite=overwrite,
                command=command_line(),
                on_progress=show,
                **files.replacements,
            )
        simulated = campaign.frame()
        sources |= {"scenario": campaign.loaded.scenario.name, "runs": runs}
        if not set(campaign.managers) <= set(simulated["manager"]):  # one has no mission to compare
            exit_telling_failures(campaign)
    validation = compare(published.frame, simulated, chosen, shares=shares, seed=seed)
    console = output()
    print_validation(console, validation)
    if out is None:
        console.print("\nNo files were written; --out DIR keeps tables and figures.", soft_wrap=True)
    else:
        _write(out, validation, published.frame, simulated, sources)
        console.print(f"\nTables, figures and validation.json are in {out}", soft_wrap=True)
    if campaign is not None:
        exit_telling_failures(campaign)
    if strict and not validation.all_met:
        raise typer.Exit(TARGETS_NOT_MET)


def _recorded(path: Path, chosen: tuple[str, ...], scenario: str | None, out: Path | None, *, overwrite: bool) -> Runs:
    """Read the missions of an earlier campaign, and make the output folder."""
    from suave_des.campaign.output import check_output_folder, make_output_folder
    from suave_des.report.runs import read_runs
    from suave_des.scenario.loader import load_scenario

    recorded = read_runs(path)
    recorded.check_simulated(chosen, None if scenario is None else load_scenario(scenario).scenario.name)
    if out is not None:
        check_output_folder(out, "campaign", overwrite=overwrite)
        make_output_folder(out)
    return recorded


def _check_known(published: Runs, chosen: tuple[str, ...]) -> None:
    """Check that every manager of the data can be run.

    Raises:
        InputError: one cannot, with the line that names it.
    """
    from suave_des.errors import InputError
    from suave_des.registry import manager_class

    for name in chosen:
        try:
            manager_class(name)
        except InputError as error:
            remedy = f"{error.remedy}; or choose others with --managers" if error.remedy else None
            raise published.error(published.managers[name], error.problem, remedy) from None


def _write(
    out: Path,
    validation: Validation,
    published: pandas.DataFrame,
    simulated: pandas.DataFrame,
    sources: dict[str, object],
) -> None:
    from suave_des import __version__
    from suave_des.campaign.output import write_files
    from suave_des.validation import files
    from suave_des.validation.figures import detections_png, distributions_png

    provenance = {"version": __version__, "command": command_line(), **sources}
    contents: dict[str, str | bytes] = {**files.texts(validation, provenance)}
    contents[files.DISTRIBUTIONS_FIGURE] = distributions_png(validation, published, simulated)
    contents[files.DETECTIONS_FIGURE] = detections_png(validation, published, simulated)
    write_files(out, contents, stale=files.FILES)


def _named(runs: Runs) -> dict[str, str | None]:
    return {"file": _shown(runs.path), "sha256": runs.sha256}


def _shown(path: Path | None) -> str | None:
    """Name a file as it goes into a result: a shipped one without where it is installed."""
    from suave_des.resources import shipped_folder

    if path is None:
        return None
    folder = shipped_folder("scenarios/published")
    return f"shipped/{path.name}" if path.is_relative_to(folder) else path.as_posix()
