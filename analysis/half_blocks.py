"""Fit on half of the conditions of experiment 1 of 2025, and judge on the other half, and the other
way round.

The search starts in the middle of the bounds, as the shipped values have seen all conditions; those
are judged alike, to compare. Random is left out: what it does differs from run to run by far more
than with any parameter. Writes half_blocks.csv: the loss of each half (see calibration/loss.py),
and the median over managers and conditions of
|real - simulated median search time|.

    python analysis/half_blocks.py [--out DIR] [--runs N] [--evaluations N] [--workers N]
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import pandas

from calibration.cases import Case, read_cases, read_problem
from calibration.fit import fit, larger
from calibration.loss import judge

MANAGERS = "none,metacontrol,bt"
HALVES = ((1, 3, 5), (2, 4, 6))


def study(case: Case, runs: int, evaluations: int, workers: int) -> pandas.DataFrame:
    """Fit on each half of a case's conditions, and judge on both.

    Returns:
        A row for each fit and judged half: values ("shipped" or "fitted"), fitted_on, judged_on,
        held_out, loss, median_difference_s.
    """
    whole = read_problem("planta_exp1", [case], runs, 1)
    middle = tuple(
        replace(each, start=(each.lower + each.upper) / 2.0) for each in whole.parameters
    )
    (case,) = whole.cases
    fits = [("shipped", HALVES[0] + HALVES[1], [each.start for each in whole.parameters])]
    for half in HALVES:
        problem = replace(whole, cases=(case.only(half),), parameters=middle)
        tried = fit(problem, evaluations, workers=workers, seed=1)
        fits.append(("fitted", half, list(min(tried, key=lambda each: each.loss).values)))
    rows = []
    for name, seen, values in fits:
        for half in HALVES:
            found = judge(larger(whole), case.only(half), values)
            rows.append(
                {
                    "values": name,
                    "fitted_on": " ".join(map(str, sorted(seen))),
                    "judged_on": " ".join(map(str, half)),
                    "held_out": not set(half) <= set(seen),
                    "loss": found.loss,
                    "median_difference_s": found.median_difference_s,
                }
            )
    return pandas.DataFrame(rows)


def main() -> None:
    """Run both fits."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=Path(__file__).parent / "split")
    options.add_argument(
        "--runs", type=int, default=12, help="missions for each manager, among a half's conditions"
    )
    options.add_argument("--evaluations", type=int, default=100)
    options.add_argument("--workers", type=int, default=2)
    chosen = options.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)

    (case,) = read_cases(["planta_exp1_campaign"], (), MANAGERS)
    result = study(case, chosen.runs, chosen.evaluations, chosen.workers)
    result.to_csv(
        chosen.out / "half_blocks.csv", index=False, float_format="%.4g", lineterminator="\n"
    )
    print(result.to_string(index=False))


if __name__ == "__main__":
    main()
