"""What half the step of the vehicle's integration changes in each mean.

The missions of 2023 and those of experiment 1 of 2025, in equal parts under its conditions, are
simulated with steps of 0.05 s, as shipped, and of 0.025 s, by a copy of the package in which that
one number differs. Both have the same random numbers; differences are paired by run.

    python analysis/step.py [--out DIR] [--runs N] [--workers N]
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from math import nan
from pathlib import Path

import pandas
import studies

from suave_des import mean_of, read_runs

ROOT = Path(__file__).parents[1]
STEP = re.compile(r"^STEP_S = .*$", re.MULTILINE)
STEPS_S = (0.05, 0.025)
CASES = {"seams2023": 1, "planta_exp1_campaign": 6}
"""Scenarios and campaigns, with the number of their conditions."""
METRICS = ("search_time_s", "distance_inspected_m", "mean_reaction_time_s")


def missions(step_s: float, runs: int, workers: int) -> dict[str, pandas.DataFrame]:
    """Simulate with a step; missions by case."""
    with tempfile.TemporaryDirectory() as folder:
        for part in ("suave_des", "scenarios", "ontology"):
            ignored = shutil.ignore_patterns("__pycache__")
            shutil.copytree(ROOT / part, Path(folder, part), ignore=ignored)
        module = Path(folder, "suave_des", "vehicle", "vehicle.py")
        text, changed = STEP.subn(f"STEP_S = {step_s}", module.read_text(encoding="utf-8"))
        if changed != 1:
            raise RuntimeError(f"{module}: expected one line STEP_S = ..., found {changed}")
        module.write_text(text, encoding="utf-8")
        found = {}
        for case, conditions in CASES.items():
            out = Path(folder, case)
            command = [sys.executable, "-m", "suave_des", "campaign", case, "--out", str(out)]
            command += ["--runs", str(runs // conditions), "--workers", str(workers)]
            environment = {**os.environ, "PYTHONPATH": folder}
            subprocess.run(command, check=True, cwd=folder, env=environment, capture_output=True)
            found[case] = read_runs(out / "runs.csv").frame
        return found


def study(runs: int, workers: int) -> pandas.DataFrame:
    """Compare both steps: a row for each case, manager and metric."""
    both = [missions(step_s, runs, workers) for step_s in STEPS_S]
    rows = []
    for case in CASES:
        shipped, halved = (each[case] for each in both)  # in the same order
        for manager, own in shipped.groupby("manager", sort=False):
            for metric in METRICS:
                difference = (halved.loc[own.index, metric] - own[metric]).astype(float).dropna()
                if len(difference) > 1:
                    low, high = mean_of(difference.tolist()).interval or (nan, nan)
                    rows.append(
                        {
                            "case": case,
                            "manager": manager,
                            "metric": metric,
                            "n": len(difference),
                            "mean": own[metric].mean(),
                            "change": difference.mean(),
                            "low95": low,
                            "high95": high,
                        }
                    )
    return pandas.DataFrame(rows)


def main() -> None:
    """Simulate with both steps, and write the table."""
    chosen = studies.options(__file__, __doc__ or "", runs=1200)
    rows = study(chosen.runs, chosen.workers)
    chosen.out.mkdir(parents=True, exist_ok=True)
    rows.to_csv(chosen.out / "step.csv", index=False, float_format="%.4f", lineterminator="\n")
    print(rows.to_string(index=False))


if __name__ == "__main__":
    main()
