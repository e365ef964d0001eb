"""suave-des validate and calibrate: simulated missions compared with real ones, and parameters fitted to them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.campaign import exit_telling_failures
from suave_des.cli.options import Files, Overwrite, Quiet, Seed, Workers, command_line, grouped_options

if TYPE_CHECKING:
    import pandas

    from suave_des.calibration.loss import Evaluation
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


@grouped_options
def calibrate(
    scenario: Annotated[str, typer.Argument(help="A scenario file, or the name of a shipped one.")],
    data: _Data = _DATA,
    parameters: Annotated[
        str, typer.Option("--parameters", metavar="FILE", help="What is free, and within which bounds.")
    ] = "seams2023",
    managers: _Managers = None,
    runs: Annotated[int, typer.Option("--runs", min=2, help="Missions for each manager and set of values.")] = 150,
    evaluations: Annotated[int, typer.Option("--evaluations", min=1, help="Sets of values to try, about.")] = 500,
    profile: Annotated[bool, typer.Option(help="Determine how sharply each parameter is known, too.")] = True,
    workers: Workers = 2,
    seed: Seed = 1,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for the fit.")] = None,
    overwrite: Overwrite = False,
    *,
    files: Files,
) -> None:
    """Fit free parameters to real missions, and write the fitted scenario."""
    from suave_des.calibration import report
    from suave_des.calibration.fit import FINAL_FACTOR, fit, profiles, select
    from suave_des.calibration.loss import Problem, evaluate, published_shares, published_vectors, resampling_spread
    from suave_des.calibration.parameters import read_parameters
    from suave_des.campaign.output import check_output_folder, make_output_folder, write_files
    from suave_des.campaign.spec import RUNS_LIMIT, check_range, check_seed, check_workers
    from suave_des.cli.console import output
    from suave_des.report.runs import choose_managers, read_runs
    from suave_des.resources import find
    from suave_des.scenario.loader import load_scenario

    check_workers(workers)
    check_seed(seed)
    check_range("runs", runs, 2, RUNS_LIMIT)
    published = read_runs(find(data, "scenarios/published"))
    chosen = choose_managers(published, managers)
    loaded = load_scenario(scenario, **files.replacements)
    form, free = read_parameters(find(parameters, "scenarios/calibration"), loaded)
    shares = published_shares(published.frame, chosen, published.path)
    problem = Problem(form, free, published_vectors(published.frame, chosen), runs, seed, shares)
    if out is not None:
        check_output_folder(out, "fit", overwrite=overwrite)
        make_output_folder(out)
    console = output()

    def print_generation(count: int, best: Evaluation) -> None:
        console.print(f"{count:5d} sets tried, least loss {best.loss:.4f}")

    tried = fit(problem, evaluations, workers=workers, seed=seed, on_generation=print_generation)
    best = select(problem, tried, workers)
    values = report.fitted_values(problem.parameters, best)
    contents: dict[str, str | bytes] = {report.SCENARIO: report.fitted_scenario(problem, scenario, values)}
    if out is not None:  # at once: the profiles take as long again
        write_files(out, contents, stale=report.FILES)
    spread = resampling_spread(problem, best, seed)
    here = evaluate(problem, best.values)  # the profiles are computed with the search's own streams
    threshold = here.loss + spread
    found = profiles(problem, here, threshold, workers) if profile else []
    missions = problem.runs * FINAL_FACTOR
    console.print(f"\nloss {best.loss:.4f} with {missions} missions for each manager and other streams")
    for path, value in values.items():
        admitted = next((f"   {one.low:8.3f} to {one.high:.3f}" for one in found if one.parameter.path == path), "")
        console.print(f"{path:48s} {value:8.3f}{admitted}", soft_wrap=True)
    if out is None:
        console.print("\nNo files were written; --out DIR keeps the fit.", soft_wrap=True)
        return
    provenance = {"command": command_line(), "data": {"file": Path(data).name, "sha256": published.sha256}}
    contents[report.RECORD] = report.record(problem, tried, best, spread, found, provenance)
    if found:
        contents[report.TABLE] = report.table(found)
        contents[report.FIGURE] = report.profiles_png(found, here, threshold)
    write_files(out, contents, stale=report.FILES)
    console.print(f"\nThe fitted scenario and the report are in {out}", soft_wrap=True)
