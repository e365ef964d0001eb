"""Fit free parameters of scenarios to real missions by CMA-ES, and write the fitted scenarios.

    python analysis/calibrate.py SCENARIO... [--data [NAME=]FILE]... [--parameters FILE] [--out DIR]

A campaign file that sweeps the conditions of the real missions has each compared under its own
condition. Several scenarios are fitted at once: the loss is the mean of theirs. analysis/README.md
describes files and loss.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import studies
from matplotlib.figure import Figure

from calibration.cases import (
    FOLDER,
    FreeParameter,
    Problem,
    fitted_scenario,
    read_cases,
    read_problem,
)
from calibration.fit import FINAL_FACTOR, Profile, fit, profiles, select
from calibration.loss import Evaluation, evaluate, resampling_spread
from suave_des import InputError

COLUMNS = 4
"""Of panels."""
LOSS = (
    "mean over the scenarios, their managers and conditions of the energy distance between missions as vectors (search"
    " time / 40 s, distance inspected / 12 m, x of detection / 1.5 m), plus the mean absolute difference of the shares"
    " in clusters"
)


def table(found: Sequence[Profile]) -> list[list[object]]:
    """List each parameter's bounds, start, fitted value, and the interval that the data admit,
    below a header.
    """
    columns = ["lower_bound", "upper_bound", "start", "fitted", "admitted_low", "admitted_high"]
    rows: list[list[object]] = [["path", "scenarios", *columns]]
    for one in found:
        free = one.parameter
        numbers = (free.lower, free.upper, free.start, one.best, one.low, one.high)
        rows.append(
            [
                free.path,
                ", ".join(free.scenarios) or "all",
                *(f"{number:.4g}" for number in numbers),
            ]
        )
    return rows


def draw_profiles(
    figure: Figure, found: Sequence[Profile], best: Evaluation, threshold: float
) -> None:
    """Draw the loss along each parameter, a panel each, with the interval that the data admit."""
    panels = figure.subplots(_lines(found), COLUMNS, sharey=True, squeeze=False).ravel()
    for panel, profile in zip(panels, found, strict=False):
        panel.axvspan(profile.low, profile.high, color="#D6E6F2", lw=0)
        panel.axhline(threshold, color=studies.GREY, lw=0.8, ls="--")
        points = sorted(
            [*zip(profile.values, profile.losses, strict=True), (profile.best, best.loss)]
        )
        panel.plot(
            [x for x, _ in points], [y for _, y in points], color=studies.BLUE, marker=".", ms=4
        )
        panel.plot([profile.best], [best.loss], marker="D", color=studies.VERMILION, ms=4)
        panel.set_xlim(profile.parameter.lower, profile.parameter.upper)
        panel.set_ylim(0.0, threshold + 4.0 * (threshold - best.loss))
        panel.set_title(_title(profile.parameter), fontsize=6.5)
        panel.tick_params(labelsize=6.5)
    for panel in panels[len(found) :]:
        panel.set_visible(False)
    figure.supylabel("distance to the published runs", fontsize=8)


def _lines(found: Sequence[Profile]) -> int:
    """How many lines of panels profiles need."""
    return -(-len(found) // COLUMNS)


def _title(parameter: FreeParameter) -> str:
    """Name a parameter in lines that fit above its panel: the scenario if it is of one alone, then
    the key path.
    """
    # without the part of the scenario that it is in
    keys = parameter.path.split(".")[1:] or [parameter.path]
    lines = [f"{', '.join(parameter.scenarios)}:"] if parameter.scenarios else []
    return "\n".join([*lines, *(f"{key}." for key in keys[:-1]), keys[-1]])


def record(
    problem: Problem,
    tried: Sequence[Evaluation],
    best: Evaluation,
    spread: float,
    found: Sequence[Profile],
) -> dict[str, Any]:
    """Return everything about a fit as plain data, for calibration.json."""
    return {
        "command": ["python", *sys.argv],
        "loss": LOSS,
        "scenarios": {
            case.name: {
                "data": [{"file": name, "sha256": sha} for name, sha in case.digests.items()],
                "managers": list(case.managers),
                "published_runs": {
                    name: int((case.real["manager"] == name).sum()) for name in case.managers
                },
                "conditions": list(case.conditions),
            }
            for case in problem.cases
        },
        "runs": problem.runs,
        "seed": problem.seed,
        "evaluations": len(tried),
        "best": {"loss": round(best.loss, 5)}
        | {
            case.name: {
                "loss": round(each.loss, 5),
                "share_difference": round(each.share_difference, 5),
            }
            | {name: round(distance, 5) for name, distance in each.distances.items()}
            for case, each in zip(problem.cases, best.cases, strict=True)
        },
        "spread_of_loss_over_resampled_published_runs": round(spread, 5),
        "fitted": {
            each.name: value for each, value in zip(problem.parameters, best.values, strict=True)
        },
        "profiles": {
            one.parameter.name: {
                "values": one.values,
                "losses": one.losses,
                "admitted": [one.low, one.high],
            }
            for one in found
        },
        "history": [round(each.loss, 5) for each in tried],
    }


def show(problem: Problem, best: Evaluation, found: Sequence[Profile]) -> None:
    """Print the loss of each scenario, and the parameters."""
    missions = problem.runs * FINAL_FACTOR
    print(
        f"\nloss {best.loss:.4f} with {missions} missions for each manager, with fresh random numbers"
    )
    for case, loss in zip(problem.cases, best.cases, strict=True):
        print(f"  of {case.name}: {loss.loss:.4f}")
    admitted = {one.parameter.name: f"   {one.low:8.3f} to {one.high:.3f}" for one in found}
    for each, value in zip(problem.parameters, best.values, strict=True):
        print(f"{each.name:60s} {value:8.3f}{admitted.get(each.name, '')}")


def options() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "scenarios",
        nargs="+",
        metavar="SCENARIO",
        help="scenario or campaign files, or shipped names",
    )
    parser.add_argument(
        "--data",
        action="append",
        metavar="[NAME=]FILE",
        help="real missions; default: those published",
    )
    parser.add_argument(
        "--parameters", metavar="FILE", help="free parameters; default: the scenario's, or shared"
    )
    parser.add_argument("--managers", metavar="NAME,...", help="default: all in the data")
    parser.add_argument(
        "--runs",
        type=int,
        default=150,
        help="missions for each manager and evaluation (default: 150)",
    )
    parser.add_argument(
        "--evaluations", type=int, default=500, help="sets of values to try (default: 500)"
    )
    parser.add_argument(
        "--no-profile", action="store_true", help="do not vary each parameter about the fit"
    )
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--out", type=Path, default=Path("fit"), help="folder for the fit (default: fit)"
    )
    return parser.parse_args()


def main() -> None:
    """Fit, and write what was found."""
    chosen = options()
    cases = read_cases(chosen.scenarios, chosen.data or (), chosen.managers)
    own = (
        cases[0].name if len(cases) == 1 and (FOLDER / f"{cases[0].name}.yaml").is_file() else None
    )
    several = "shared" if len(cases) > 1 else "seams2023"
    problem = read_problem(chosen.parameters or own or several, cases, chosen.runs, chosen.seed)
    for note in dict.fromkeys(note for case in cases for note in case.notes):
        print(note)
    tried = fit(
        problem,
        chosen.evaluations,
        workers=chosen.workers,
        seed=chosen.seed,
        on_generation=lambda count, best: print(
            f"{count:5d} sets tried, lowest loss {best.loss:.4f}", flush=True
        ),
    )
    best = select(problem, tried, chosen.workers)
    chosen.out.mkdir(parents=True, exist_ok=True)
    values = [round(value, 3) for value in best.values]
    for case in problem.cases:  # at once: the profiles take as long again
        text = fitted_scenario(problem, case, values, chosen.out)
        (chosen.out / f"fitted_{case.name}.yaml").write_text(text, encoding="utf-8")
    spread = resampling_spread(problem, best, chosen.seed)
    here = evaluate(problem, best.values)  # the profiles are computed with the search's own streams
    threshold = here.loss + spread
    found = [] if chosen.no_profile else profiles(problem, here, threshold, chosen.workers)
    text = json.dumps(record(problem, tried, best, spread, found), indent=2)
    (chosen.out / "calibration.json").write_text(text + "\n", encoding="utf-8")
    if found:
        with (chosen.out / "parameters.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(table(found))
        height = 1.5 * _lines(found)
        figure = studies.figure_of(draw_profiles, found, here, threshold, height=height)
        figure.savefig(chosen.out / "profiles.png", dpi=160)
    show(problem, best, found)
    print(f"\nThe fitted scenarios and the record are in {chosen.out}")


if __name__ == "__main__":
    try:
        main()
    except InputError as error:
        sys.exit(f"calibrate.py: {error}")
