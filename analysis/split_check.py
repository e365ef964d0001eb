"""Leave one manager out: fit on two managers, predict the third, for each choice of the third.

Writes split_check.csv beside the fits. A prediction counts as good within half a published standard
deviation.

    python analysis/split_check.py [--out DIR] [--runs N] [--evaluations N] [--missions N]
    [--workers N]
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pandas

from calibration.cases import fitted_scenario, read_cases, read_problem
from calibration.fit import fit
from suave_des import find, read_runs, run_campaign

METRICS = ("search_time_s", "distance_inspected_m")
WITHIN_STD = 0.5
"""Greatest difference of a predicted mean, in published standard deviations, that counts as
predicted.
"""


def split_check(
    fitted: Mapping[str, pandas.DataFrame], published: pandas.DataFrame
) -> pandas.DataFrame:
    """Compare predicted with published figures of each manager that was left out of a fit.

    Args:
        fitted: by left-out manager, missions simulated with what was fitted without it; of each
            frame only the rows of that manager count. Columns as of records.runs.FRAME_COLUMNS, the
            place of detection apart.
        published: the published missions, likewise.

    Returns:
        A row for each manager and metric: left_out, metric, published_n, published_mean,
        published_std, predicted_n, predicted_mean, predicted_std, difference (predicted - published
        mean), difference_in_std (/ the published standard deviation; nan if that is zero), within
        (whether that is at most WITHIN_STD either way).

    Raises:
        ValueError: a manager has no row in its frame, or fewer than two published ones.
    """
    rows = [
        _row(manager, metric, published, frame)
        for manager, frame in fitted.items()
        for metric in METRICS
    ]
    return pandas.DataFrame(rows)


def _row(
    manager: str, metric: str, published: pandas.DataFrame, frame: pandas.DataFrame
) -> dict[str, object]:
    theirs, ours = (
        side.loc[side["manager"] == manager, metric].dropna() for side in (published, frame)
    )
    if len(theirs) < 2 or ours.empty:
        raise ValueError(
            f"manager {manager}: {len(theirs)} published and {len(ours)} simulated missions are too few"
        )
    difference = ours.mean() - theirs.mean()
    in_std = difference / theirs.std() if theirs.std() else float("nan")
    return {
        "left_out": manager,
        "metric": metric,
        "published_n": len(theirs),
        "published_mean": theirs.mean(),
        "published_std": theirs.std(),
        "predicted_n": len(ours),
        "predicted_mean": ours.mean(),
        "predicted_std": ours.std(),
        "difference": difference,
        "difference_in_std": in_std,
        "within": abs(in_std) <= WITHIN_STD,
    }


def main() -> None:
    """Run the three fits and their predictions."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=Path(__file__).parent / "split")
    options.add_argument("--runs", type=int, default=60)
    options.add_argument("--evaluations", type=int, default=77)
    options.add_argument("--missions", type=int, default=500)
    options.add_argument("--workers", type=int, default=2)
    chosen = options.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)

    published = read_runs(find("seams2023_runs.csv", "scenarios/published"))
    managers = tuple(published.managers)
    predicted = {}
    for left_out in managers:
        (case,) = read_cases(
            ["seams2023"], (), ",".join(name for name in managers if name != left_out)
        )
        case = replace(case, shares=())  # they were chosen by what all three managers do
        problem = read_problem("seams2023", [case], chosen.runs, 1)
        # The search starts in the middle of the bounds: the shipped values have seen all three
        # managers.
        free = tuple(
            replace(each, start=(each.lower + each.upper) / 2.0) for each in problem.parameters
        )
        problem = replace(problem, parameters=free)
        tried = fit(problem, chosen.evaluations, workers=chosen.workers, seed=1)
        best = min(tried, key=lambda each: each.loss)
        scenario = chosen.out / f"without_{left_out}.yaml"
        values = [round(value, 3) for value in best.values]
        scenario.write_text(fitted_scenario(problem, problem.cases[0], values, chosen.out))
        predicted[left_out] = run_campaign(
            scenario, [left_out], chosen.missions, 2, chosen.workers, progress=False
        )
        print(f"without {left_out}: distance of the two others {best.loss:.4f}")
    result = split_check(predicted, published.frame)
    result.to_csv(
        chosen.out / "split_check.csv", index=False, float_format="%.4g", lineterminator="\n"
    )
    print(result.to_string(index=False))


if __name__ == "__main__":
    main()
