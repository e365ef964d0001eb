"""suave-des calibrate: parameters of a scenario, fitted to real missions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import Modes, Ontologies, Overwrite, Reasoner, Seed, Workers, command_line

if TYPE_CHECKING:
    from suave_des.calibration.fit import Problem


def calibrate(
    scenario: Annotated[str, typer.Argument(help="A scenario file, or the name of a shipped one.")],
    data: Annotated[
        str,
        typer.Option("--data", metavar="FILE", help="Real missions; left out, the 60 published with the SUAVE paper."),
    ] = "seams2023_runs.csv",
    parameters: Annotated[
        str, typer.Option("--parameters", metavar="FILE", help="What is free, and within which bounds.")
    ] = "seams2023",
    managers: Annotated[
        str | None, typer.Option("--managers", metavar="NAME,...", help="Of those in the data; left out: all.")
    ] = None,
    runs: Annotated[int, typer.Option("--runs", min=2, help="Missions for each manager and set of values.")] = 150,
    evaluations: Annotated[int, typer.Option("--evaluations", min=1, help="Sets of values to try, about.")] = 500,
    profile: Annotated[bool, typer.Option(help="Tell how sharply each parameter is determined, too.")] = True,
    workers: Workers = 2,
    seed: Seed = 1,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for the fit.")] = None,
    overwrite: Overwrite = False,
    ontology: Ontologies = None,
    modes: Modes = None,
    reasoner: Reasoner = None,
) -> None:
    """Fit free parameters to real missions, and write the fitted scenario."""
    from suave_des.calibration import report
    from suave_des.calibration.fit import FINAL_FACTOR, evaluate, fit, select
    from suave_des.calibration.profile import profiles, resampling_spread
    from suave_des.campaign.output import check_output_folder, make_output_folder, write_files
    from suave_des.campaign.spec import RUNS_LIMIT, check_range, check_seed, check_workers
    from suave_des.cli.console import output

    check_workers(workers)
    check_seed(seed)
    check_range("runs", runs, 2, RUNS_LIMIT)
    problem, published = _problem(scenario, data, parameters, managers, runs, seed, ontology, modes, reasoner)
    if out is not None:
        check_output_folder(out, "fit", overwrite=overwrite)
        make_output_folder(out)
    console = output()
    tried = fit(
        problem,
        evaluations,
        workers=workers,
        seed=seed,
        on_generation=lambda count, best: console.print(f"{count:5d} sets tried, least loss {best.loss:.4f}"),
    )
    best = select(problem, tried, workers)
    values = report.fitted_values(problem.parameters, best)
    if out is not None:  # at once: the profiles take as long again
        write_files(out, {report.SCENARIO: report.fitted_scenario(problem, scenario, values)}, stale=report.FILES)
    spread = resampling_spread(problem, best, seed)
    here = evaluate(problem, best.values)  # the profiles are seen with the search's own streams
    threshold = here.loss + spread
    found = profiles(problem, here, threshold, workers) if profile else []
    console.print(
        f"\nloss {best.loss:.4f} with {problem.runs * FINAL_FACTOR} missions for each manager and other streams"
    )
    for path, value in values.items():
        admitted = next((f"   {one.low:8.3f} to {one.high:.3f}" for one in found if one.parameter.path == path), "")
        console.print(f"{path:48s} {value:8.3f}{admitted}", soft_wrap=True)
    if out is None:
        console.print("\nNo files were written; --out DIR keeps the fit.", soft_wrap=True)
        return
    provenance = {"command": command_line(), "data": {"file": published[0], "sha256": published[1]}}
    contents: dict[str, str | bytes] = {
        report.SCENARIO: report.fitted_scenario(problem, scenario, values),
        report.RECORD: report.record(problem, tried, best, spread, found, provenance),
    }
    if found:
        contents[report.TABLE] = report.table(found)
        contents[report.FIGURE] = report.profiles_png(found, here, threshold)
    write_files(out, contents, stale=report.FILES)
    console.print(f"\nThe fitted scenario and the report are in {out}", soft_wrap=True)


def _problem(
    scenario: str,
    data: str,
    parameters: str,
    managers: str | None,
    runs: int,
    seed: int,
    ontology: list[Path] | None,
    modes: Path | None,
    reasoner: str | None,
) -> tuple[Problem, tuple[str, str]]:
    """What is fitted to what, and the data's name and SHA-256."""
    from suave_des.calibration.fit import Problem
    from suave_des.calibration.parameters import read_parameters
    from suave_des.calibration.published import as_vectors, published_shares
    from suave_des.resources import find
    from suave_des.scenario.loader import load_scenario
    from suave_des.validation.runs import choose_managers, read_runs

    published = read_runs(find(data, "scenarios/published"))
    wanted = None if managers is None else [name.strip() for name in managers.split(",") if name.strip()]
    chosen = choose_managers(published, wanted)
    loaded = load_scenario(scenario, ontologies=ontology or (), modes_file=modes, reasoner=reasoner)
    form, free = read_parameters(find(parameters, "scenarios/calibration"), loaded)
    shares = published_shares(published.frame, chosen, published.path)
    return Problem(form, free, as_vectors(published.frame, chosen), runs, seed, shares), (
        Path(data).name,
        published.sha256,
    )
