"""suave-des calibrate: parameters fitted to real missions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from suave_des.cli.options import Files, Overwrite, Seed, Workers, command_line, grouped_options

if TYPE_CHECKING:
    from suave_des.calibration.loss import Evaluation

_DATA = "seams2023_runs.csv"

_Data = Annotated[
    str, typer.Option("--data", metavar="FILE", help="Real missions; left out, the 60 published with the SUAVE paper.")
]
_Managers = Annotated[
    str | None, typer.Option("--managers", metavar="NAME,...", help="Of those in the data; left out: all.")
]


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
