"""What the published runs themselves show of a reasoner: how fast missions follow, and when the search ends.

Two mechanisms rest on these figures (docs/background/fidelity.md): the reasoner slows the simulator down, and the
search begins some time after its first activation. Writes speeds.csv and search_times.csv.

    python analysis/published_facts.py [--out DIR]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas

from suave_des.resources import find

SLOW_M_PER_S = 0.26
"""Missions without a dead thruster mostly follow at 0.27 to 0.28 m/s."""
RUNS = {2023: "seams2023_runs.csv", 2025: "planta_exp1_runs.csv"}


def read(year: int) -> pandas.DataFrame:
    """Read the published runs of a year, with the speed of following, m/s; none for missions that found no pipeline."""
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
            row = {"year": year, "manager": manager, "found": len(found), "slow": int((found < SLOW_M_PER_S).sum())}
            rows.append(row | {"median_m_per_s": found.median().round(3), "least_m_per_s": found.min().round(3)})
    return pandas.DataFrame(rows)


def search_times() -> pandas.DataFrame:
    """Compare the median search times of bt and metacontrol, s, in each condition of 2025."""
    runs = read(2025)
    medians = runs.pivot_table("search_time_s", "condition", "manager", aggfunc="median")[["bt", "metacontrol"]]
    later_s = medians["metacontrol"] - medians["bt"]
    return medians.assign(metacontrol_later_s=later_s).rename_axis(columns=None).reset_index()


def main() -> None:
    """Compute both tables, print and write them."""
    parser = argparse.ArgumentParser(description="What the published runs show of a reasoner.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "published_facts")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in {"speeds.csv": speeds(), "search_times.csv": search_times()}.items():
        table.to_csv(folder / name, index=False, lineterminator="\n")
        print(table.to_string(index=False), end="\n\n")


if __name__ == "__main__":
    main()
