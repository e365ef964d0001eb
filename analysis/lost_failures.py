"""Which failures of thrusters have no effect: those before 26 s, or each with one probability?

Of `none`'s real missions of experiment 1 of 2025, all under condition 6 and some under others go on
as if one thruster alone had failed. For each condition missions are simulated in which both
thrusters fail, one, or none. The density of a real mission in (search time, distance inspected) is
that of the simulated ones, smoothed by Student's t with 3 degrees of freedom; its two widths are
what the model gets wrong, and are fitted to each hypothesis. Writes lost_failures.csv: the greatest
log-likelihood of each hypothesis, its widths, its probability p that a failure is lost with the
range in which the log-likelihood is at most 1.92 less, and the log-likelihood by condition.

    python analysis/lost_failures.py [--out DIR] [--runs N]
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import t as student

from calibration.cases import Case, read_cases
from suave_des import Simulator, with_values

METRICS = ["search_time_s", "distance_inspected_m"]
FAIL = {"both": (1, 3), "3 alone": (3,), "1 alone": (1,), "neither": ()}
EARLY_S = 25.0
"""In a condition with an earlier failure, that of thruster 1 comes before 26 s, as events come one
a second.
"""
HYPOTHESES = ("all have an effect", "none before 26 s", "each is lost with p", "both of these")
Densities = Mapping[str, NDArray[np.float64]]


def simulate(case: Case, runs: int) -> dict[tuple[int, str], NDArray[np.float64]]:
    """Simulate missions of `none` by condition and failing thrusters; shape (runs, 2)."""
    found = {}
    for number, values in case.conditions.items():
        time_s = values["thruster_events.0.time_s"]
        for name, thrusters in FAIL.items():
            events = [
                {"thruster": each, "event": "failure", "time_s": time_s} for each in thrusters
            ]
            changed = {
                "start.y_m": values["start.y_m"],
                "thruster_events": events,
                "revision.thruster_failures.effective_from_s": 0.0,
                "revision.thruster_failures.loss_probability": 0.0,
            }
            simulator = Simulator(with_values(case.loaded, changed))
            metrics = [simulator.run("none", run, 3).metrics for run in range(1, runs + 1)]
            found[number, name] = np.array(
                [[getattr(each, metric) for metric in METRICS] for each in metrics], dtype=float
            )
    return found


def densities(
    case: Case,
    simulated: Mapping[tuple[int, str], NDArray[np.float64]],
    widths: NDArray[np.float64],
) -> Densities:
    """Return the density of each real mission, by failing thrusters."""
    found = {}
    for name in FAIL:
        rows = zip(case.real["condition"], case.real[METRICS].to_numpy(float), strict=True)
        off = [(mission - simulated[condition, name]) / widths for condition, mission in rows]
        found[name] = np.array([np.prod(student.pdf(z, 3) / widths, axis=1).mean() for z in off])
    return found


def logs(
    hypothesis: str, of: Densities, is_early: NDArray[np.bool_], p: float
) -> NDArray[np.float64]:
    """Return the log-likelihood of each real mission."""
    lost = p if hypothesis in HYPOTHESES[2:] else 0.0
    late = (
        (1 - lost) ** 2 * of["both"]
        + lost * (1 - lost) * (of["1 alone"] + of["3 alone"])
        + lost**2 * of["neither"]
    )
    if hypothesis in (HYPOTHESES[1], HYPOTHESES[3]):
        early = (1 - lost) * of["3 alone"] + lost * of["neither"]
        return np.log(np.where(is_early, early, late))
    return np.log(late)


def study(case: Case, runs: int) -> pandas.DataFrame:
    """Fit each hypothesis: its row."""
    simulated = simulate(case, runs)
    times_s = {
        number: values["thruster_events.0.time_s"] for number, values in case.conditions.items()
    }
    is_early = case.real["condition"].map(times_s).to_numpy(float) < EARLY_S

    def each(hypothesis: str, logarithms: NDArray[np.float64]) -> NDArray[np.float64]:
        *widths, p = np.exp(logarithms)
        of = densities(case, simulated, np.array(widths))
        return logs(hypothesis, of, is_early, min(p, 0.99))

    rows = []
    for hypothesis in HYPOTHESES:
        start = np.log([3.0, 3.0, 0.2])
        best = minimize(
            lambda tried, name=hypothesis: -each(name, tried).sum(),
            start,
            method="Nelder-Mead",
            options={"maxiter": 300, "xatol": 0.01, "fatol": 0.01},
        ).x
        row = {"hypothesis": hypothesis, "log_likelihood": each(hypothesis, best).sum()}
        row |= dict(zip(("width_s", "width_m"), np.exp(best[:2]), strict=True))
        if hypothesis in HYPOTHESES[2:]:
            tried = np.linspace(0.01, 0.6, 60)
            along = np.array([each(hypothesis, [*best[:2], np.log(p)]).sum() for p in tried])
            inside = tried[along >= row["log_likelihood"] - 1.92]
            row |= {"p": np.exp(best[2]), "p_low": inside.min(), "p_high": inside.max()}
        by = pandas.Series(each(hypothesis, best)).groupby(case.real["condition"].to_numpy()).sum()
        rows.append(row | {f"condition_{number}": value for number, value in by.items()})
    return pandas.DataFrame(rows)


def main() -> None:
    """Fit the hypotheses to the published runs, and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=Path(__file__).with_suffix(""))
    options.add_argument("--runs", type=int, default=60)
    chosen = options.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    (case,) = read_cases(["planta_exp1_campaign"], (), "none")
    rows = study(case, chosen.runs)
    rows.to_csv(
        chosen.out / "lost_failures.csv", index=False, float_format="%.4g", lineterminator="\n"
    )
    print(rows.to_string(index=False, float_format="%.3g"))


if __name__ == "__main__":
    main()
