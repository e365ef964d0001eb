"""What each mechanism of the vehicle and its software is worth: each taken out, or set to another
value, one at a time.

Simulated missions are held against the real ones of 2023 (`seams2023`, the same condition in each
run) and of 2025 (`planta_exp1_campaign`, six conditions). Writes a CSV file and the table that
mechanisms.md shows.

    python analysis/mechanisms.py [--out DIR] [--runs N] [--workers N]
"""

from __future__ import annotations

import csv
import multiprocessing
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import pandas
import studies

from calibration.cases import Case, Problem, read_cases
from calibration.loss import compare, simulate_case
from suave_des import compare_conditions, validate, with_values

SHARE_2025 = 10
"""Missions for each manager of 2023 to one for each manager and condition of 2025."""
ADAPTED_ALIKE = "none,bt,metacontrol"
"""What random does differs from run to run by far more than with any mechanism."""

FIRST_CONDITIONS = 4
"""In these, each real run's reactions are alike."""


@dataclass(frozen=True)
class Change:
    """A mechanism, what is known of it, and the values that take it out or replace it."""

    mechanism: str
    evidence: str = ""
    both: Mapping[str, Any] = field(default_factory=dict)
    of_2023: Mapping[str, Any] = field(default_factory=dict)
    of_2025: Mapping[str, Any] = field(default_factory=dict)


FAILURES = "revision.thruster_failures"
START = "latencies.search_start_s"
EXPONENTIAL_4_PERCENT = {"distribution": "exponential", "mean": 0.04}
CHANGES = (
    Change("all of them"),
    Change(
        "jerk of 0.5 m/s³ (1.0, ArduSub's default)",
        "early and late turns of the spiral and the speed of following, in both years",
        {"calibration.jerk_m_per_s3": 1.0},
    ),
    Change(
        "integral of the velocity loop (none)",
        "following with one dead thruster",
        {"calibration.velocity_integral_gain_per_s2": 0.0},
    ),
    Change(
        "heading control of 5 rad/s (3)",
        "none with two dead thrusters, in five conditions of 2025",
        {"calibration.heading_frequency_rad_per_s": 3.0},
    ),
    Change("the same (8)", "", {"calibration.heading_frequency_rad_per_s": 8.0}),
    Change(
        "failed thrusters keep their thrust (are dead)",
        "autopilot and simulator: an output without a function keeps its last signal",
        {f"{FAILURES}.failure_mode": "dead"},
    ),
    Change(
        "failures before 26 s without effect (with one)",
        "none in 2025: missions with failures at 25 and 26 s go on as if only the second had happened",
        {f"{FAILURES}.effective_from_s": 0.0},
    ),
    Change(
        "failures lost with a probability of 13% (none)",
        "none in 2025: 6 of the other 25 missions go on as if one failure alone had happened, or none",
        {f"{FAILURES}.loss_probability": 0.0},
    ),
    Change(
        "lost set-points: 1% (none)",
        "a new publisher for each call; stalls of 12 s",
        {"revision.set_points.loss_probability": 0.0},
    ),
    Change(
        "drift before guided mode (none)",
        "recorded in both years",
        {"calibration.drift_x_m": 0.0, "calibration.drift_y_m": 0.0},
    ),
    Change(
        "spiral's centre 0.2 m south of where guided mode begins, 2023 (there)",
        "the local frame's origin is set before the drift ends",
        of_2023={"calibration.origin_y_m": 0.0},
    ),
    Change(
        "altitude error, 2023: exponential, mean 0.5 m (none)",
        "not explained",
        of_2023={"calibration.altitude_error_m": 0.0},
    ),
    Change(
        "detection 0.75 m above the pipeline's points, 2023 (at them)",
        "read off the code",
        of_2023={"revision.monitors.detected_point_height_m": 0.0},
    ),
    Change(
        "the plan under way is executed for a search whose task is over, 2023 (not executed)",
        "35% of metacontrol's missions follow at less than 0.26 m/s, the others at 0.26 to 0.29 m/s",
        of_2023={"revision.metacontrol.executes_plans_of_removed_objectives": False},
    ),
    Change(
        "simulator slower while the reasoner runs, 2025: exponential, mean 8% (not slower)",
        "metacontrol's missions follow more slowly than others, some by a quarter",
        of_2025={"calibration.reasoning_slowdown": 0.0},
    ),
    Change(
        "the same (always slower, in each run by as much: mean 4%)",
        "",
        of_2025={
            "calibration.reasoning_slowdown": 0.0,
            "calibration.real_time_factor_loss": EXPONENTIAL_4_PERCENT,
        },
    ),
    Change(
        "search begins 5 s after it is first activated (at once)",
        "search times, both years",
        {START: 0.0},
    ),
    Change(
        "timers in step, 2025 (phases of their own)",
        "metacontrol's reaction times",
        of_2025={"revision.timers_in_step": []},
    ),
)


def agreement_2023(runs: int, change: Change) -> dict[str, float]:
    """Count the means, standard deviations and distributions that agree with the 60 runs, and
    measure the distance.
    """
    (case,) = read_cases(["seams2023"])
    simulated, distance = simulated_and_distance(case, {**change.both, **change.of_2023}, runs)
    found = validate(case.real, simulated, case.managers, seed=studies.SEED)
    met = found.targets.set_index("kind")["met"].loc[["mean", "std", "ks"]]
    agreeing = int((met == True).sum())  # noqa: E712  (pandas: not met and not applicable differ)
    return {"agreeing_2023": agreeing, "distance_2023": distance}


def agreement_2025(runs: int, change: Change) -> dict[str, float]:
    """Compare none, bt and metacontrol with the real runs of the same condition.

    Args:
        runs: missions of each manager under each condition.
        change: what is taken out.

    Returns:
        Energy distance, mean over managers and conditions; difference of the median search times,
        median over both; standard deviation of none's distances, median over the conditions, beside
        the real one; and by how much metacontrol's median reaction time differs between the first
        four conditions.
    """
    (case,) = read_cases(["planta_exp1_campaign"], managers=ADAPTED_ALIKE)
    simulated, distance = simulated_and_distance(
        case, {**change.both, **change.of_2025}, runs * len(case.conditions)
    )
    metrics = ["search_time_s", "distance_inspected_m", "mean_reaction_time_s"]
    compared = compare_conditions(case.real, simulated, case.managers, metrics)
    times = compared.query("metric == 'search_time_s'")
    of_none = compared.query("manager == 'none' and metric == 'distance_inspected_m'")
    spread = of_none[["simulated_std", "real_std"]].dropna().median()
    reactions = compared.query("manager == 'metacontrol' and metric == 'mean_reaction_time_s'")[
        "simulated_median"
    ]
    return {
        "distance_2025": distance,
        "median_apart_2025_s": float(times["difference_of_medians"].abs().median()),
        "spread_of_none_2025_m": float(spread["simulated_std"]),
        "real_spread_of_none_2025_m": float(spread["real_std"]),
        "reactions_2025_s": float(np.ptp(reactions.to_numpy()[:FIRST_CONDITIONS])),
    }


def simulated_and_distance(
    case: Case, values: Mapping[str, Any], runs: int
) -> tuple[pandas.DataFrame, float]:
    """Simulate missions of a case with changed values; return them, and their mean energy distance
    to the real ones.
    """
    simulated = simulate_case(
        Problem((case,), (), runs, studies.SEED),
        replace(case, loaded=with_values(case.loaded, values)),
        (),
    )
    return simulated, float(np.mean(list(compare(case, simulated).distances.values())))


def measure(runs: int, change: Change) -> dict[str, Any]:
    """Simulate with one change; a row of the table."""
    row: dict[str, Any] = {"mechanism": change.mechanism, "evidence": change.evidence}
    if change.both or change.of_2023 or not change.of_2025:
        row |= agreement_2023(runs, change)
    if change.both or change.of_2025 or not change.of_2023:
        row |= agreement_2025(max(3, runs // SHARE_2025), change)
    return row


def study(runs: int, workers: int, chosen: list[str] | None = None) -> pandas.DataFrame:
    """Take out each mechanism; a row for each."""
    changes = [each for each in CHANGES if chosen is None or each.mechanism in chosen]
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        return pandas.DataFrame(pool.map(partial(measure, runs), changes, chunksize=1))


def table(rows: pandas.DataFrame) -> str:
    """Write the rows as a Markdown table."""
    lines = [
        "| mechanism (instead) | evidence | 2023: of 18 | 2023: distance | 2025: distance | 2025: medians apart |"
        " 2025: spread of none | 2025: reactions |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows.to_dict("records"):
        texts = [
            shown(row["agreeing_2023"], "{:.0f}"),
            shown(row["distance_2023"], "{:.3f}"),
            shown(row["distance_2025"], "{:.3f}"),
            shown(row["median_apart_2025_s"], "{:.1f} s"),
            shown(row["spread_of_none_2025_m"], "{:.1f} m"),
            shown(row["reactions_2025_s"], "{:.2f} s"),
        ]
        evidence = "" if pandas.isna(row["evidence"]) else row["evidence"]
        lines.append("| " + " | ".join([row["mechanism"], evidence, *texts]) + " |")
    return "\n".join(lines)


def shown(value: float, form: str) -> str:
    """Write a number, or a dash where the mechanism is not of that year."""
    return "-" if pandas.isna(value) else form.format(value)


def main() -> None:
    """Take out each mechanism, write the table and print it."""
    chosen = studies.options(__file__, __doc__ or "", runs=200)
    rows = study(chosen.runs, chosen.workers)
    chosen.out.mkdir(parents=True, exist_ok=True)
    path = chosen.out / "mechanisms.csv"
    rows.round(4).to_csv(path, index=False, lineterminator="\n", quoting=csv.QUOTE_MINIMAL)
    text = table(pandas.read_csv(path))
    (chosen.out / "mechanisms.md").write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
