"""How the paper's table changes with the visibility's period and with the time of the thruster failure.

Writes period_and_failure.csv and period_and_failure.png.

    python analysis/period_and_failure.py [--out DIR] [--runs N] [--workers N]
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
from pathlib import Path

import numpy as np

from suave_des.estimates import estimate
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator

MANAGERS = ("none", "random", "metacontrol")
METRICS = {"search_time_s": "search time (s)", "distance_inspected_m": "distance inspected (m)"}
STUDIES = {
    "signals.water_visibility.period_s": (40.0, 60.0, 80.0, 100.0, 120.0, 160.0, 240.0),
    "thruster_events.0.time_s": (5.0, 35.0, 65.0, 95.0, 125.0, 155.0, 200.0),
}
LABELS = {
    "signals.water_visibility.period_s": "period of the water visibility (s)",
    "thruster_events.0.time_s": "time of the failure of thruster 1 (s)",
}


def cell(task: tuple[str, float, str, int]) -> dict[str, list[float]]:
    """Both metrics of the missions of one manager, with one value changed."""
    path, value, manager, runs = task
    simulator = Simulator(with_values(load_scenario("seams2023"), {path: value}))
    metrics = [simulator.run(manager, run, 1).metrics for run in range(1, runs + 1)]
    return {name: [float(getattr(each, name)) for each in metrics] for name in METRICS}


def draw(path: Path, found: dict[tuple[str, float, str], dict[str, list[float]]]) -> None:
    """A row a metric, a column a study: means with 95% intervals."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 5.4), layout="constrained")
    panels = figure.subplots(len(METRICS), len(STUDIES), sharey="row")
    colours = {"none": "#7f8c8d", "random": "#d98c21", "metacontrol": "#1f5f99"}
    for row, (metric, title) in enumerate(METRICS.items()):
        for column, (study, values) in enumerate(STUDIES.items()):
            panel = panels[row, column]
            for manager in MANAGERS:
                estimates = [estimate(found[study, value, manager][metric]) for value in values]
                means = np.array([each.mean for each in estimates], dtype=float)
                low, high = zip(*(each.mean_interval or (np.nan, np.nan) for each in estimates), strict=True)
                panel.fill_between(values, low, high, color=colours[manager], alpha=0.2, lw=0)
                panel.plot(values, means, color=colours[manager], marker="o", ms=3.5, lw=1.3, label=manager)
            panel.axvline({0: 80.0, 1: 35.0}[column], color="0.6", lw=0.8, ls=":")
            for side in ("top", "right"):
                panel.spines[side].set_visible(False)
            if column == 0:
                panel.set_ylabel(title)
            if row == len(METRICS) - 1:
                panel.set_xlabel(LABELS[study])
    for row in panels:  # when everything is drawn: the panels of a row share their scale
        row[0].set_ylim(bottom=0.0)
    panels[0, 1].legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=160)


def main() -> None:
    """Simulate every cell, write the table and the figure."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--out", type=Path, default=Path(__file__).parent / "period_and_failure")
    options.add_argument("--runs", type=int, default=150)
    options.add_argument("--workers", type=int, default=2)
    chosen = options.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)

    tasks = [
        (study, value, name, chosen.runs) for study, values in STUDIES.items() for value in values for name in MANAGERS
    ]
    with multiprocessing.get_context("spawn").Pool(chosen.workers) as pool:
        found = {task[:3]: result for task, result in zip(tasks, pool.map(cell, tasks, chunksize=1), strict=True)}
    with (chosen.out / "period_and_failure.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["parameter", "value", "manager", "metric", "n", "mean", "low95", "high95", "std"])
        for (study, value, manager), metrics in found.items():
            for metric, values in metrics.items():
                one = estimate(values)
                numbers = (
                    f"{number:.2f}" for number in (one.mean, *(one.mean_interval or ()), one.std) if number is not None
                )
                writer.writerow([study, value, manager, metric, one.n, *numbers])
    draw(chosen.out / "period_and_failure.png", found)
    print(f"{len(tasks) * chosen.runs} missions; see {chosen.out}")


if __name__ == "__main__":
    main()
