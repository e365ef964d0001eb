"""Which calibrated parameters matter: Morris screening of the two metrics, for each of the paper's
managers.

Elementary effects (Morris 1991; mu* after Campolongo et al. 2007; package SALib) of the mean search
time and the mean distance inspected over the bounds of the calibration. All evaluations use common
random numbers, so that differences come from the parameters. Writes sensitivity.csv and
sensitivity.png.

    python analysis/sensitivity.py [--out DIR] [--trajectories N] [--runs N] [--workers N]
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import studies
from matplotlib.figure import Figure
from SALib.analyze import morris as analyze_morris
from SALib.sample import morris as sample_morris

from calibration.cases import read_cases, read_problem
from suave_des import Simulator, with_values

MANAGERS = ("none", "random", "metacontrol")
METRICS = {
    "search_time_s": "mean search time (s)",
    "distance_inspected_m": "mean distance inspected (m)",
}


def means(loaded: Any, paths: tuple[str, ...], runs: int, values: tuple[float, ...]) -> list[float]:
    """Mean search time and distance of each manager with some parameter values."""
    simulator = Simulator(with_values(loaded, dict(zip(paths, values, strict=True))))
    found = []
    for manager in MANAGERS:
        metrics = [simulator.run(manager, run, 1).metrics for run in range(1, runs + 1)]
        found += [float(np.mean([getattr(each, name) for each in metrics])) for name in METRICS]
    return found


def draw(figure: Figure, names: list[str], effects: dict[tuple[str, str], np.ndarray]) -> None:
    """One panel a metric: mu* of each parameter and manager, the most important parameters on
    top.
    """
    panels = figure.subplots(1, len(METRICS))
    for panel, (metric, title) in zip(panels, METRICS.items(), strict=True):
        order = np.argsort(np.mean([effects[manager, metric] for manager in MANAGERS], axis=0))
        for offset, manager, hatch in zip(
            (0.26, 0.0, -0.26), MANAGERS, ("", "////", "...."), strict=True
        ):
            panel.barh(
                np.arange(len(names)) + offset,
                effects[manager, metric][order],
                height=0.24,
                facecolor=studies.COLOURS[manager],
                edgecolor="white",
                linewidth=0.0,
                hatch=hatch,
                label=manager,
            )
        panel.set_yticks(range(len(names)), [names[index] for index in order])
        panel.tick_params(axis="y", length=0)
        panel.grid(axis="y", visible=False)
        panel.set_xlabel(f"effect (mu*) on the\n{title}")
    panels[0].legend(loc="lower right")


def main() -> None:
    """Sample, simulate, analyze, draw."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--out", type=Path, default=Path(__file__).parent / "sensitivity")
    options.add_argument("--trajectories", type=int, default=6)
    options.add_argument("--runs", type=int, default=50)
    options.add_argument("--workers", type=int, default=2)
    chosen = options.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)

    fitted = read_problem("seams2023", read_cases(["seams2023"]), chosen.runs, 1)
    free, loaded = fitted.parameters, fitted.cases[0].loaded
    paths = tuple(each.path for each in free)
    names = [path.split(".", 1)[1].removesuffix("_m_per_s") for path in paths]
    problem = {
        "num_vars": len(free),
        "names": names,
        "bounds": [[each.lower, each.upper] for each in free],
    }
    samples = sample_morris.sample(problem, chosen.trajectories, num_levels=4, seed=1)
    with multiprocessing.get_context("spawn").Pool(chosen.workers) as pool:
        found = np.array(
            pool.map(
                partial(means, loaded, paths, chosen.runs),
                map(tuple, samples.tolist()),
                chunksize=2,
            )
        )

    effects, rows = {}, []
    for column, (manager, metric) in enumerate((m, k) for m in MANAGERS for k in METRICS):
        result = analyze_morris.analyze(problem, samples, found[:, column], num_levels=4, seed=1)
        effects[manager, metric] = np.asarray(result["mu_star"])
        for index, path in enumerate(paths):
            numbers = (
                result["mu"][index],
                result["mu_star"][index],
                result["mu_star_conf"][index],
                result["sigma"][index],
            )
            rows.append([manager, metric, path, *(f"{float(number):.4g}" for number in numbers)])
    with (chosen.out / "sensitivity.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            ["manager", "metric", "parameter", "mu", "mu_star", "mu_star_conf95", "sigma"]
        )
        writer.writerows(rows)
    figure = studies.figure_of(draw, names, effects, height=4.2)
    figure.savefig(chosen.out / "sensitivity.png", dpi=160)
    print(
        f"{len(samples)} sets of values, {len(samples) * len(MANAGERS) * chosen.runs} missions; see {chosen.out}"
    )


if __name__ == "__main__":
    main()
