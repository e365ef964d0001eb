"""Whether intervals from few real missions, assisted by simulated ones, hold, and what they gain.

Coverage: sets of parameters that fit the real runs equally well play the real system in turn, and
the shipped ones the simulator, or a biased or a useless one; missions are drawn from 150
conditions, 8 under each, 500 times. Gains: the real missions of 2025 (exp1), all 30 of each manager
and parts of them.

    python analysis/assisted.py [--out DIR] [--runs N] [--workers N]

`--runs` are the simulated missions under each condition of the real ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import studies
from numpy.typing import NDArray

from suave_des import load_scenario, run_campaign
from suave_des.records.missions import missions_in
from suave_des.results.compare import assisted_mean, compare_assisted
from suave_des.results.groups import grouped
from suave_des.results.statistics import mean_interval

SCENARIO = "planta_exp1"
MANAGERS = ("none", "random", "metacontrol", "bt")
METRICS = ("search_time_s", "distance_inspected_m")
LIMIT_S = 250.0
SCENARIOS = Path(__file__).parents[1] / "scenarios"
REAL = SCENARIOS / "published" / "planta_exp1_runs.csv"
MEMBERS = (2, 5, 9, 13, 17)
"""Members of the ensemble that play the real system."""
SIMULATORS: Mapping[str, Mapping[str, Any]] = {
    "shipped": {},
    "biased": {"calibration.jerk_m_per_s3": 0.25},
    "useless": {
        "signals.water_visibility.value": 1.3,
        "default_modes.f_generate_search_path": "fd_spiral_high",
        "calibration.drift_y_m": 1.2,
    },
}
"""Values of the scenario by simulator."""
SHIFT = {"distribution": "uniform", "minimum": 0.0, "maximum": 200.0, "shared": "shift"}
DRAWN = {
    "start.y_m": {"distribution": "uniform", "minimum": 2.0, "maximum": 3.0},
    "thruster_events.0.time_s": SHIFT,
    "thruster_events.1.time_s": SHIFT,
}
"""What the study's runner drew for every five runs."""
DRAWS, EACH, LEFT = 150, 8, 3
"""Conditions, missions under each, and how many of these are the simulator's."""
CASES = ((3, 2), (6, 1), (3, 4), (6, 2), (12, 1), (6, 5), (30, 1))
"""Conditions and real runs in each: 6 to 30 real runs."""
RESAMPLES = 500

Cells = dict[str, NDArray[np.float64]]
"""By manager the values of a metric, shape (draws, missions under each)."""


def cells(frame: pandas.DataFrame, metric: str, each: int) -> Cells:
    """Return the values of a metric by manager, condition and mission; search times up to the
    limit.
    """
    ordered = frame.sort_values("run")
    values = ordered[metric].astype(float)
    values = values.clip(upper=LIMIT_S) if metric == "search_time_s" else values
    return {
        name: part.to_numpy().reshape(-1, each)
        for name, part in values.groupby(ordered["manager"], observed=True)
    }


def simulate(values: Mapping[str, Any], workers: int) -> pandas.DataFrame:
    """Run the missions of one system: equal conditions for all systems, as they have one seed."""
    scenario = load_scenario(SCENARIO, values=dict(values))
    return run_campaign(
        scenario,
        MANAGERS,
        runs=DRAWS * EACH,
        seed=studies.SEED,
        workers=workers,
        progress=False,
        perturbations=DRAWN,
        runs_per_draw=EACH,
    )


def coverage(
    real: Sequence[Cells], simulated: Cells, cases: Sequence[tuple[int, int]], resamples: int
) -> Iterator[dict[str, Any]]:
    """Count how often intervals hold the mean of the system that plays the real one.

    Args:
        real: of each system that plays it, in turn; likewise simulated.
        cases: conditions and real runs in each. The simulator's missions are others than those with
            the real ones' random numbers.
        resamples: for each case, and manager or pair.

    Yields:
        A row for each: group, other, conditions, runs, alone and assisted (shares of intervals that
        hold the mean), and alone_half and assisted_half (medians of their half-widths).
    """
    draws, each = next(iter(simulated.values())).shape
    for conditions, runs_each in cases:
        for both in [[name] for name in simulated] + [
            list(pair) for pair in combinations(simulated, 2)
        ]:
            chance = np.random.default_rng(studies.SEED)
            signs = (1.0, -1.0)[: len(both)]
            held, halves = [], []
            for number in range(resamples):
                system = real[number % len(real)]
                places, missions = chance.permutation(draws), chance.permutation(each)
                own, others = places[:conditions], places[conditions:]
                ours, theirs = missions[:runs_each], missions[-LEFT:]
                means = [
                    sum(
                        sign * side[name][rows][:, columns].mean(axis=1)
                        for sign, name in zip(signs, both, strict=True)
                    )
                    for side, rows, columns in (
                        (system, own, ours),
                        (simulated, own, theirs),
                        (simulated, others, [0]),
                    )
                ]
                within = sum(
                    float(simulated[name][own].var(axis=1, ddof=1).mean()) for name in both
                )
                found, _ = assisted_mean(*means, [within / runs_each, within / LEFT, within])
                truth = sum(
                    sign * system[name].mean() for sign, name in zip(signs, both, strict=True)
                )
                estimates = (mean_interval(means[0]), found)
                held.append(
                    [
                        abs(estimate.value - truth) <= estimate.high - estimate.value
                        for estimate in estimates
                    ]
                )
                halves.append([estimate.high - estimate.value for estimate in estimates])
            shares, widths = np.mean(held, axis=0), np.median(halves, axis=0)
            row = {"group": both[0], "other": "".join(both[1:]), "conditions": conditions}
            row |= {"runs": conditions * runs_each, "alone": shares[0], "assisted": shares[1]}
            yield row | {"alone_half": widths[0], "assisted_half": widths[1]}


def gains(same: pandas.DataFrame, population: pandas.DataFrame) -> pandas.DataFrame:
    """Compare parts of the real missions, one to five under each of the six conditions, with all of
    them.

    Returns:
        A row for each manager, metric and number of runs: the medians over parts that share no
        mission of estimates and half-widths, and equal_runs.
    """
    real = pandas.read_csv(REAL).drop(columns="run")
    simulated = missions_in(same), missions_in(population)
    real["place"] = real.groupby(["manager", "condition"]).cumcount()
    rows = []
    for runs_each in (1, 2, 5):
        for first in range(0, 6 - runs_each, runs_each):
            part = real[real["place"].between(first, first + runs_each - 1)].drop(columns="place")
            groups = grouped(missions_in(part), metrics=METRICS, simulated=simulated)
            found = compare_assisted(groups).estimates
            found["alone_half"] = (found["alone_ci95_high"] - found["alone_ci95_low"]) / 2.0
            found["assisted_half"] = (
                found["assisted_ci95_high"] - found["assisted_ci95_low"]
            ) / 2.0
            rows.append(found[found["other"] == ""])
    columns = ["alone", "alone_half", "assisted", "assisted_half", "narrower", "equal_runs"]
    return (
        pandas.concat(rows)
        .groupby(["metric", "group", "runs"], sort=False)[columns]
        .median()
        .reset_index()
    )


def under_real_conditions(runs: int, workers: int) -> pandas.DataFrame:
    """Run missions under the six conditions of the real ones."""
    return run_campaign(
        "planta_exp1_campaign",
        MANAGERS,
        runs=runs,
        seed=studies.SEED,
        workers=workers,
        progress=False,
    )


def conclude(covered: pandas.DataFrame, gained: pandas.DataFrame) -> str:
    """Say what the tables show."""
    by = covered.groupby("simulator", sort=False)["assisted"].agg(["min", "max"])
    shares = "; ".join(f"{name} {low:.1%} to {high:.1%}" for name, low, high in by.itertuples())
    alone, few = covered["alone"], covered.loc[covered["conditions"] == 3, "alone"]
    lines = [
        f"Intervals of 95% hold the true mean: {shares}. Those of the real missions alone do in {few.min():.1%} to"
        f" {few.max():.1%} with 3 conditions, and in {alone.min():.1%} to {alone.max():.1%} in all."
    ]
    for row in gained[gained["runs"].isin([6, 30])].itertuples():
        unit = "s" if row.metric == "search_time_s" else "m"
        lines.append(
            f"- {row.group}, {row.metric}, {row.runs} real runs: alone {row.alone:.1f} ± {row.alone_half:.1f} {unit},"
            f" assisted {row.assisted:.1f} ± {row.assisted_half:.1f} {unit}, as of {row.equal_runs:.0f} real runs"
        )
    return "\n".join(lines)


def main() -> None:
    """Run the study."""
    chosen = studies.options(__file__, __doc__ or "", 50)
    chosen.out.mkdir(parents=True, exist_ok=True)
    ensemble = pandas.read_csv(
        SCENARIOS / "ensembles" / f"{SCENARIO}.csv", index_col="member"
    ).drop(columns="loss")
    simulators = {name: simulate(values, chosen.workers) for name, values in SIMULATORS.items()}
    real = [simulate(ensemble.loc[number].to_dict(), chosen.workers) for number in MEMBERS]
    rows = [
        {"simulator": name, "metric": metric, **row}
        for metric in METRICS
        for name, frame in simulators.items()
        for row in coverage(
            [cells(each, metric, EACH) for each in real],
            cells(frame, metric, EACH),
            CASES,
            RESAMPLES,
        )
    ]
    covered = pandas.DataFrame(rows)
    covered.to_csv(
        chosen.out / "coverage.csv", index=False, float_format="%.4g", lineterminator="\n"
    )
    same = under_real_conditions(chosen.runs, chosen.workers)
    population = run_campaign(
        SCENARIO,
        MANAGERS,
        runs=1_000,
        seed=2,
        workers=chosen.workers,
        progress=False,
        perturbations=DRAWN,
    )
    gained = gains(same, population)
    gained.to_csv(chosen.out / "gains.csv", index=False, float_format="%.4g", lineterminator="\n")
    conclusion = conclude(
        *(pandas.read_csv(chosen.out / name) for name in ("coverage.csv", "gains.csv"))
    )
    (chosen.out / "conclusion.md").write_text(conclusion + "\n", encoding="utf-8")
    print(conclusion)


if __name__ == "__main__":
    main()
