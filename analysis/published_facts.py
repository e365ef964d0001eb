"""What the published runs themselves show: how fast missions follow, when the search ends, and
which failures are lost.

Mechanisms that rest on these figures (docs/background/fidelity.md): what slows metacontrol's
inspections down, when the search begins after its first activation, and that early failures are
without effect. Writes speeds.csv, search_times.csv, and failures.csv, which has simulated missions
too.

    python analysis/published_facts.py [--out DIR]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas

from suave_des import Simulator, find, load_scenario, with_values

SLOW_M_PER_S = 0.26
"""Missions without a dead thruster mostly follow at 0.27 to 0.28 m/s."""
RUNS = {2023: "seams2023_runs.csv", 2025: "planta_exp1_runs.csv"}

FAILED = {"both": (1, 3), "first": (1,), "second": (3,), "neither": ()}
"""The thrusters that fail in 2025, one second apart; and which of them do if the other failure is
lost.
"""
MISSIONS = 12


def read(year: int) -> pandas.DataFrame:
    """Read the published runs of a year, with the speed of following, m/s; none for missions that
    found no pipeline.
    """
    runs = pandas.read_csv(find(RUNS[year], "scenarios/published"))
    followed_s = runs["time_limit_s"] - runs["search_time_s"]
    runs["speed_m_per_s"] = (runs["distance_inspected_m"] / followed_s).where(followed_s > 0.0)
    return runs


def speeds() -> pandas.DataFrame:
    """Count the missions that followed slowly, by year and manager.

    Random is left out, as it also stops following; none of 2025 goes on with two dead thrusters.
    """
    rows = []
    for year in RUNS:
        for manager, runs in read(year).query("manager != 'random'").groupby("manager", sort=False):
            found = runs["speed_m_per_s"].dropna()
            row = {
                "year": year,
                "manager": manager,
                "found": len(found),
                "slow": int((found < SLOW_M_PER_S).sum()),
            }
            rows.append(
                row
                | {"median_m_per_s": found.median().round(3), "least_m_per_s": found.min().round(3)}
            )
    return pandas.DataFrame(rows)


def search_times() -> pandas.DataFrame:
    """Compare the median search times of bt and metacontrol, s, in each condition of 2025."""
    runs = read(2025)
    medians = runs.pivot_table("search_time_s", "condition", "manager", aggfunc="median")[
        ["bt", "metacontrol"]
    ]
    later_s = medians["metacontrol"] - medians["bt"]
    return medians.assign(metacontrol_later_s=later_s).rename_axis(columns=None).reset_index()


def failures() -> pandas.DataFrame:
    """Compare none's missions under each condition of 2025 with simulated ones in which some of its
    failures happen.

    Returns:
        A row for each condition, set of failures and failure mode, "real" for the published
        missions: medians of search time, s, and speed of following, m/s.
    """
    runs, loaded, rows = read(2025).query("manager == 'none'"), load_scenario("planta_exp1"), []
    for condition, real in runs.groupby("condition"):
        start_y_m, time_s = real[["nominal_y_m", "failure_time_s"]].iloc[0]
        rows.append({"condition": condition, "failed": "real", "mode": "real", **_medians(real)})
        for failed, thrusters in FAILED.items():
            events = [
                {"thruster": thruster, "event": "failure", "time_s": time_s}
                for thruster in thrusters
            ]
            for mode in ("frozen", "dead") if thrusters else ("none",):
                how = {
                    "effective_from_s": 0.0,
                    "loss_probability": 0.0,
                    "failure_mode": "frozen" if mode == "none" else mode,
                }
                values = {
                    "thruster_events": events,
                    "start.y_m": start_y_m,
                    "revision.thruster_failures": how,
                }
                simulator = Simulator(with_values(loaded, values))
                metrics = (
                    simulator.run("none", run, seed=1).metrics for run in range(1, MISSIONS + 1)
                )
                missions = pandas.DataFrame(metrics)
                followed_s = (
                    simulator.loaded.scenario.mission.time_limit_s - missions["search_time_s"]
                )
                missions["speed_m_per_s"] = missions["distance_inspected_m"] / followed_s
                rows.append(
                    {"condition": condition, "failed": failed, "mode": mode, **_medians(missions)}
                )
    return pandas.DataFrame(rows)


def _medians(missions: pandas.DataFrame) -> dict[str, float]:
    return missions[["search_time_s", "speed_m_per_s"]].median().round(3).to_dict()


def main() -> None:
    """Compute both tables, print and write them."""
    parser = argparse.ArgumentParser(description="What the published runs show of a reasoner.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "published_facts")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    for study in (speeds, search_times, failures):
        table = study()
        table.to_csv(folder / f"{study.__name__}.csv", index=False, lineterminator="\n")
        print(table.to_string(index=False), end="\n\n")


if __name__ == "__main__":
    main()
