"""suave-des calibrate: parameters fitted to real missions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from suave_des.cli.console import output
from suave_des.cli.options import Files, ManagersInData, Overwrite, Seed, Workers, command_line, grouped_options
from suave_des.errors import InputError
from suave_des.files import check_output_folder, make_output_folder, write_files
from suave_des.resources import DEFAULT_SCENARIO, find, shipped_folder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from suave_des.calibration.cases import Case
    from suave_des.calibration.loss import Evaluation
    from suave_des.calibration.report import Fit

_Data = Annotated[
    list[str] | None,
    typer.Option(
        "--data",
        metavar="[NAME=]FILE",
        help="Real missions; repeat it for several files. With several scenarios, NAME is the one that they belong to."
        " By default those published for the scenario; for a single scenario, or else the 60 of the SUAVE paper.",
        show_default=False,
    ),
]
_Parameters = Annotated[
    str | None,
    typer.Option(
        "--parameters",
        metavar="FILE",
        help="File of free parameters and their bounds.",
        show_default="the shipped file with the scenario's name, or seams2023; for several scenarios: shared",
    ),
]
_FitConditions = Annotated[
    str | None,
    typer.Option(
        "--fit-conditions",
        metavar="NUMBER,...",
        help="Fit only these conditions of the campaign files, and evaluate the fit on the others.",
    ),
]


@grouped_options
def calibrate(
    scenarios: Annotated[
        list[str],
        typer.Argument(metavar="SCENARIO...", help="Scenario or campaign files, or names of shipped scenarios."),
    ],
    data: _Data = None,
    parameters: _Parameters = None,
    managers: ManagersInData = None,
    fit_conditions: _FitConditions = None,
    runs: Annotated[
        int,
        typer.Option(
            min=2,
            help="Missions for each manager and parameter set; with a campaign file, over all conditions.",
        ),
    ] = 150,
    evaluations: Annotated[int, typer.Option(min=1, help="Approximate number of parameter sets to evaluate.")] = 500,
    profile: Annotated[
        bool, typer.Option(help="Vary each parameter around the fit, to show how well the data determine it.")
    ] = True,
    workers: Workers = 2,
    seed: Seed = 1,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for the fit.")] = None,
    overwrite: Overwrite = False,
    *,
    files: Files,
) -> None:
    """Fit free parameters to real missions, and write the fitted scenarios.

    With a campaign file that sweeps the conditions of the real missions, each is compared under its own condition.
    """
    from suave_des.calibration import report
    from suave_des.calibration.cases import read_cases
    from suave_des.calibration.fit import FINAL_FACTOR, fit, larger, profiles, select
    from suave_des.calibration.loss import evaluate, resampling_spread
    from suave_des.calibration.parameters import read_problem
    from suave_des.campaign.spec import RUNS_LIMIT, check_range, check_seed, check_workers

    check_workers(workers)
    check_seed(seed)
    check_range("runs", runs, 2, RUNS_LIMIT)
    cases = read_cases(scenarios, data or (), managers, **files.replacements)
    problem = read_problem(_parameters_file(parameters, cases), cases, runs, seed)
    halves = _halves(problem.cases, fit_conditions)
    problem = replace(problem, cases=tuple(fitted for fitted, _ in halves))
    if out is not None:
        check_output_folder(out, "fit", overwrite=overwrite)
        make_output_folder(out)
    console = output()
    for note in dict.fromkeys(note for case in cases for note in case.notes):
        console.print(note)

    def print_generation(count: int, best: Evaluation) -> None:
        console.print(f"{count:5d} sets tried, lowest loss {best.loss:.4f}")

    tried = fit(problem, evaluations, workers=workers, seed=seed, on_generation=print_generation)
    best = select(problem, tried, workers)
    values = report.fitted_values(best)
    folder = out or Path()
    contents: dict[str, str | bytes] = {
        report.scenario_file(case, cases): report.fitted_scenario(problem, case, values, folder) for case in cases
    }
    stale = report.files_in(folder)
    if out is not None:  # at once: the profiles take as long again
        write_files(out, contents, stale=stale)
    spread = resampling_spread(problem, best, seed)
    here = evaluate(problem, best.values)  # the profiles are computed with the search's own streams
    threshold = here.loss + spread
    found = profiles(problem, here, threshold, workers) if profile else []
    judged = report.judge_halves(larger(problem), halves, best.values)
    done = report.Fit(problem, tried, best, spread, found, judged)
    console.print(
        f"\nloss {best.loss:.4f} with {problem.runs * FINAL_FACTOR} missions for each manager and fresh random numbers"
    )
    _print_fit(console, done, values)
    if out is None:
        console.print("\nNo files were written; --out DIR keeps the fit.")
        return
    contents[report.RECORD] = report.record(done, {"command": command_line(), "data": report.data_files(cases)})
    if found:
        contents[report.TABLE] = report.table(found)
        contents[report.FIGURE] = report.profiles_png(found, here, threshold)
    write_files(out, contents, stale=stale)
    what = "scenario" if len(cases) == 1 else "scenarios"
    console.print(f"\nThe fitted {what} and the report are in {out}")


def _parameters_file(given: str | None, cases: Sequence[Case]) -> Path:
    """Return the file of free parameters: the one given, or that of the scenario, or what several share."""
    if given is None:
        own = shipped_folder("scenarios/calibration") / f"{cases[0].name}.yaml"
        given = (DEFAULT_SCENARIO if not own.is_file() else cases[0].name) if len(cases) == 1 else "shared"
    return find(given, "scenarios/calibration")


def _halves(cases: Sequence[Case], given: str | None) -> list[tuple[Case, Case | None]]:
    """Split each case into the conditions that are fitted and those that are not; none are where none are known.

    Raises:
        InputError: what is given is no list of numbers, there are no conditions, or none is left on one side.
    """
    if given is None:
        return [(case, None) for case in cases]
    option = "--fit-conditions"
    words = [word.strip() for word in given.split(",")]
    if not all(word.isascii() and word.isdigit() for word in words) or len(set(words)) < len(words):
        remedy = f"numbers from 1, each once, such as {option} 1,3,5"
        raise InputError(f"{given!r} is not a list of conditions", place=option, remedy=remedy)
    numbers = list(map(int, words))
    if not any(case.has_conditions for case in cases):
        remedy = "give a campaign file that sweeps the conditions of the real missions"
        raise InputError("no scenario has conditions that are known", place=option, remedy=remedy)
    halves: list[tuple[Case, Case | None]] = []
    for case in cases:
        others = [number for number in case.conditions if number not in numbers]
        if not case.has_conditions:
            halves.append((case, None))
        elif not others:
            problem = f"{case.name} has no other condition on which to evaluate the fit"
            raise InputError(problem, place=option, remedy=f"leave it out to fit all {len(case.conditions)}")
        else:
            halves.append((case.only(numbers), case.only(others)))
    return halves


def _print_fit(console: Console, fit: Fit, values: Sequence[float]) -> None:
    """Print the loss of each scenario, the parameters, and how well conditions are met that were not fitted."""
    parameters = fit.problem.parameters
    admitted = {one.parameter.name: f"   {one.low:8.3f} to {one.high:.3f}" for one in fit.profiles}
    if len(fit.problem.cases) > 1:
        for case, loss in zip(fit.problem.cases, fit.best.cases, strict=True):
            console.print(f"  of {case.name}: {loss.loss:.4f}")
    for scenarios in dict.fromkeys(each.scenarios for each in parameters):
        if len(fit.problem.cases) > 1:
            console.print(f"\n{'Of ' + ', '.join(scenarios) if scenarios else 'Of all scenarios'}")
        for each, value in zip(parameters, values, strict=True):
            if each.scenarios == scenarios:
                console.print(f"{each.path:48s} {value:8.3f}{admitted.get(each.name, '')}")
    for name, halves in fit.judgements.items():
        console.print(f"\n{f'Conditions of {name}':40s}  loss   median difference, search time")
        for half, one in halves.items():
            listed = f"{half}: {', '.join(map(str, one.conditions))}"
            console.print(f"{listed:38s} {one.loss:7.4f} {one.median_difference_s:7.2f} s")
