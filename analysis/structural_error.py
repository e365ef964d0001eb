"""What simulations get wrong of real missions that they were not fitted to.

The vehicle and the software are fitted to experiment 1 of 2025 without one of its conditions, and
without one of its managers, for each choice, from the middle of the bounds; what was left out is
predicted. Values that reaction times alone decide are not fitted, and random is not fitted to: what
it does differs from run to run by far more than with any parameter. That failures are lost was seen
under `none`, and that early ones are, in condition 6: it is assumed only where these are fitted to.
split_check.py does the same for the managers of 2023.

Writes deviations.csv, with a row for each manager, condition and metric that was left out.
`--check` reads it, and says how many left-out real means lie in the 90% intervals that follow:

The standard deviation of the structural error is a share of the spread of a manager's missions: of
their standard deviation over runs and conditions. It is the same share for all managers and
metrics, as deviations of search times, distances and reactions then are about alike; in seconds and
metres, or as shares of the mean, they are not. It is the root mean square of deviations / spread,
less what chance of the real runs explains; measured once for a single condition, and once, on the
managers that were left out, for the mean over all, in which errors cancel only in part.

    python analysis/structural_error.py [--out DIR] [--runs N] [--evaluations N] [--workers N]
    python analysis/structural_error.py --check
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas
from scipy.stats import norm

from calibration.cases import Case, Problem, read_cases, read_problem
from calibration.fit import fit, select
from calibration.loss import simulate_case
from suave_des import with_values

METRICS = ("search_time_s", "distance_inspected_m", "mean_reaction_time_s")
NOT_FITTED = ("latencies.inference_s.mean", "latencies.mode_change_s")
LOST_BY = "none"
"""The manager without which nothing says that failures are lost: the others recover thrusters."""
EARLY_IN = 6
"""The condition without which nothing says that early ones are."""
LOST, EARLY = (
    f"revision.thruster_failures.{key}" for key in ("loss_probability", "effective_from_s")
)
FOLDER = Path(__file__).with_suffix("")
CONFIDENCE = 0.9
WHOLE = "managers over all conditions"
PREDICTED_RUNS = 40
"""Missions of each manager under each condition that was left out."""


def predicted(
    case: Case, seen: Case, runs: int, evaluations: int, workers: int
) -> pandas.DataFrame:
    """Fit to some missions of a case; missions of the whole case with the best values."""
    not_seen = {}
    if LOST_BY not in set(seen.real["manager"]):
        not_seen = {LOST: 0.0, EARLY: 0.0}
    elif EARLY_IN not in seen.conditions:
        not_seen = {EARLY: 0.0}
    case, seen = (replace(each, loaded=with_values(each.loaded, not_seen)) for each in (case, seen))
    problem = read_problem("planta_exp1", [seen], runs * len(seen.conditions), 1)
    free = [
        replace(each, start=(each.lower + each.upper) / 2.0)
        for each in problem.parameters
        if each.path not in NOT_FITTED
    ]
    problem = replace(problem, parameters=tuple(free))
    best = select(problem, fit(problem, evaluations, workers=workers, seed=1), workers)
    whole = Problem((case,), problem.parameters, PREDICTED_RUNS * len(case.conditions), 2)
    return simulate_case(whole, case, best.values)


def left_out(case: Case) -> Iterator[tuple[str, Case, Case]]:
    """Yield what is left out, the case with that alone, and what a fit sees then."""
    fitted_to = case.real["manager"] != "random"
    for number in case.conditions:
        others = [each for each in case.conditions if each != number]
        seen = replace(case, real=case.real[fitted_to]).only(others)
        yield f"condition {number}", case.only([number]), seen
    for manager in case.managers:
        own = case.real["manager"] == manager
        yield (
            manager,
            replace(case, real=case.real[own]),
            replace(case, real=case.real[fitted_to & ~own]),
        )


def deviations(case: Case, missions: pandas.DataFrame) -> Iterator[dict[str, Any]]:
    """Compare real and predicted means of each manager under each condition."""
    keys = ["manager", "condition"]
    for (manager, condition), real in case.real.groupby(keys):
        ours = missions[(missions["manager"] == manager) & (missions["condition"] == condition)]
        for metric in METRICS:
            found, simulated = real[metric].dropna(), ours[metric].dropna()
            if len(found) and len(simulated) > 1:
                yield {
                    "manager": manager,
                    "condition": condition,
                    "metric": metric,
                    "real_n": len(found),
                    "real_mean": found.mean(),
                    "predicted_mean": simulated.mean(),
                    "predicted_std": simulated.std(),
                }


# The rule


def errors(rows: pandas.DataFrame) -> pandas.DataFrame:
    """Return what deviations say of each mean that was left out.

    Returns:
        kind ("conditions", "managers", or "managers over all conditions", which is of the mean over
        these), manager, condition, metric; `off`, the real mean less the predicted one; `chance`,
        the variance of the real mean; and `spread`.
    """
    keys = ["manager", "metric"]
    found = rows.assign(
        kind="conditions",
        off=rows["real_mean"] - rows["predicted_mean"],
        chance=rows["predicted_std"] ** 2 / rows["real_n"],
        within=rows["predicted_std"] ** 2,
    )
    found.loc[rows["left_out"] == rows["manager"], "kind"] = "managers"
    of_managers = found[found["kind"] == "managers"].groupby(keys)
    spread = (of_managers["within"].mean() + of_managers["predicted_mean"].var(ddof=0)) ** 0.5
    found = found.join(spread.rename("spread"), on=keys)
    whole = of_managers[["off", "chance"]].mean()
    whole["chance"] /= of_managers.size()
    whole = whole.join(spread.rename("spread")).reset_index().assign(kind=WHOLE)
    return pandas.concat([found, whole], ignore_index=True)


def share(found: pandas.DataFrame) -> float:
    """Return the structural error's standard deviation as a share of the spread."""
    squares = (found["off"] ** 2 - found["chance"]) / found["spread"] ** 2
    return float(squares.mean() ** 0.5)


def measured_shares() -> tuple[float, float]:
    """Return the shares of all that was left out: of one condition, and of their mean."""
    found = errors(pandas.read_csv(FOLDER / "deviations.csv"))
    is_whole = found["kind"] == WHOLE
    return share(found[~is_whole]), share(found[is_whole])


def check(rows: pandas.DataFrame, rows_2023: pandas.DataFrame) -> pandas.DataFrame:
    """Count left-out real means in their 90% intervals, whose share is measured without them.

    Args:
        rows: deviations, as of deviations.csv.
        rows_2023: as of split_check.csv, of managers of 2023 that were left out; they are judged
            with the share of a single condition.

    Returns:
        kind, metric, means, covered.
    """
    found = errors(rows)
    is_whole = found["kind"] == WHOLE
    judged = []
    for kind, own in found.groupby("kind"):
        same = found[is_whole == (kind == WHOLE)]
        column = "condition" if kind == "conditions" else "manager"
        for left_out, part in own.groupby(column):
            judged.append(part.assign(share=share(same[same[column] != left_out])))
    of_2023 = pandas.DataFrame(
        {
            "kind": "managers of 2023",
            "metric": rows_2023["metric"],
            "off": rows_2023["difference"],
            "chance": rows_2023["predicted_std"] ** 2 / rows_2023["published_n"],
            "spread": rows_2023["predicted_std"],
            "share": share(found[~is_whole]),
        }
    )
    every = pandas.concat([*judged, of_2023])
    variance = every["chance"] + (every["share"] * every["spread"]) ** 2
    every["covered"] = every["off"].abs() <= norm.ppf((1 + CONFIDENCE) / 2) * variance**0.5
    counts = every.groupby(["kind", "metric"])["covered"].agg(means="size", covered="sum")
    return counts.reset_index()


def main() -> None:
    """Fit without each condition and each manager, and predict these."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=FOLDER)
    options.add_argument(
        "--runs", type=int, default=4, help="missions of each manager under each condition"
    )
    options.add_argument("--evaluations", type=int, default=100)
    options.add_argument("--workers", type=int, default=2)
    options.add_argument("--check", action="store_true", help="judge the intervals")
    chosen = options.parse_args()
    if chosen.check:
        counts = check(
            pandas.read_csv(FOLDER / "deviations.csv"),
            pandas.read_csv(FOLDER.with_name("split") / "split_check.csv"),
        )
        print(counts.to_string(index=False))
        print(f"{counts['covered'].sum()} of {counts['means'].sum()} are covered")
        print("shares: of a condition {:.2f}, of their mean {:.2f}".format(*measured_shares()))
        return
    chosen.out.mkdir(parents=True, exist_ok=True)
    (case,) = read_cases(["planta_exp1_campaign"])
    rows = []
    for name, without, seen in left_out(case):
        missions = predicted(without, seen, chosen.runs, chosen.evaluations, chosen.workers)
        rows += [{"left_out": name, **row} for row in deviations(without, missions)]
        print(f"without {name}: done", flush=True)
    pandas.DataFrame(rows).to_csv(
        chosen.out / "deviations.csv", index=False, float_format="%.5g", lineterminator="\n"
    )


if __name__ == "__main__":
    main()
