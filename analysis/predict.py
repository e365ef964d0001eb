"""Predictions for real runs of the exemplar, made before anybody compares; and, with such runs,
their score.

Predicted are the experiments of the study of July 2025 and of its extended mission, from the
configurations of the exemplar's runner: six conditions as its seed 100 draws them, five runs of
each manager in each. predictions/ has what an earlier `import-config --base planta_exp1
--runner-seed 100` made of each configuration; today's makes the same campaigns, but its scenarios
are based on release15. Each simulated run has a member of the ensemble of parameter sets that fit
the known runs (those of experiment 1 and of 2023) about equally well.

    python analysis/predict.py [--out DIR] [--runs N] [--workers N]
    python analysis/predict.py --score EXPERIMENT FILE...

`--runs` are the missions of a manager under each condition, some for each member. The table has a
row for each experiment, manager or pair ("bt - none" is the first less the second), condition and
metric: `mean`; `median`; `std` of single runs within a condition; and `low90` to `high90`, in which
the mean of the real runs should be in nine of ten cases. That interval has two parts: what is not
known of vehicle and software (members differ), and the chance of the real runs. `inputs` is the
beginning of the SHA-256 of scenario, campaign, revision and ensemble; not of the code.

`--score` reads real runs of one experiment in any layout that `suave-des compare` reads, in the
order in which they were made, and says how near the predictions are. A run without a reaction has
no reaction time, on both sides.
"""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import studies
from matplotlib.figure import Figure
from scipy.special import stdtrit

from suave_des import InputError, mean_of, read_ensemble, read_runs, run_campaign

FOLDER = Path(__file__).with_name("predictions")
SCENARIOS = Path(__file__).parents[1] / "scenarios"
ENSEMBLE = "planta_exp1"
DECIDING = ("planta_exp1.yaml", "revisions/2025.yaml", f"ensembles/{ENSEMBLE}.csv")
"""Files in scenarios/ that all predictions rest on."""
EXPERIMENTS = ("exp1", "exp2", "exp3", "extended_exp1", "extended_exp2", "extended_exp3")
TITLES = {"exp1": "thrusters fail", "exp2": "visibility changes", "exp3": "both"}
METRICS = ("search_time_s", "distance_inspected_m", "mean_reaction_time_s")
REAL_RUNS = 5
"""Of each manager under each condition."""
CONFIDENCE = 0.9
KEYS = ["experiment", "manager", "condition", "metric"]


def inputs(experiment: str) -> str:
    """Return the beginning of the SHA-256 of the files that decide the predictions of an
    experiment.
    """
    own = [FOLDER / f"{experiment}.yaml", FOLDER / f"{experiment}_campaign.yaml"]
    content = b"".join(
        path.read_bytes() for path in (*own, *(SCENARIOS / name for name in DECIDING))
    )
    return f"sha256:{hashlib.sha256(content).hexdigest()[:16]}"


def simulate(experiment: str, runs: int, workers: int) -> pandas.DataFrame:
    """Run an experiment's missions; their rows, with the number of the condition."""
    campaign = FOLDER / f"{experiment}_campaign.yaml"
    frame = run_campaign(
        campaign, runs=runs, seed=studies.SEED, ensemble=ENSEMBLE, workers=workers, progress=False
    )
    starts = list(dict.fromkeys(frame["start.y_m"]))
    return frame.assign(
        condition=frame["start.y_m"].map({start: number for number, start in enumerate(starts, 1)})
    )


def predict(missions: pandas.DataFrame) -> Iterator[dict[str, Any]]:
    """Predict the means of each manager and pair; a row for each condition and metric, and for all
    conditions.
    """
    managers = list(dict.fromkeys(missions["manager"]))
    for metric in METRICS:
        values = missions.astype({metric: float}).dropna(subset=metric)
        cells = values.groupby(["manager", "ensemble_member", "condition"], observed=True)[metric]
        means, variances = cells.mean().unstack(), cells.var().unstack()
        have = [manager for manager in managers if manager in means.index.get_level_values(0)]
        n = cells.size().mean()
        chance = {manager: variances.loc[manager].mean() for manager in have}  # by condition
        for manager in have:
            own = values[values["manager"] == manager]
            first = own[own["run"] <= studies.FIRST_RUNS]
            for condition, row in _predicted(means.loc[manager], chance[manager], n):
                chosen = own if condition == "all" else own[own["condition"] == int(condition)]
                at = first if condition == "all" else first[first["condition"] == int(condition)]
                further = {"median": chosen[metric].median(), "first_mean": at[metric].mean()}
                yield {
                    "manager": manager,
                    "condition": condition,
                    "metric": metric,
                    **row,
                    **further,
                }
        for one, other in combinations(have, 2):
            difference = means.loc[one] - means.loc[other]
            for condition, row in _predicted(difference, chance[one] + chance[other], n):
                yield {
                    "manager": f"{one} - {other}",
                    "condition": condition,
                    "metric": metric,
                    **row,
                }


def _predicted(
    means: pandas.DataFrame, chance: pandas.Series[float], n: float
) -> Iterator[tuple[str, dict[str, float]]]:
    """Yield mean, spread and interval for all conditions together, and for each.

    Args:
        means: by member (rows) and condition (columns).
        chance: variance between runs of one member under one condition, by condition.
        n: simulated runs behind each mean; their chance is taken out of what members differ by.
    """
    parts = {"all": list(means.columns), **{str(number): [number] for number in means.columns}}
    for name, columns in parts.items():
        members = means[columns].mean(axis=1).dropna()
        within = chance[columns].mean()
        between = max(0.0, members.var() - within / n / len(columns))
        std = (between + within / REAL_RUNS / len(columns)) ** 0.5
        half = stdtrit(len(members) - 1, (1 + CONFIDENCE) / 2) * std
        mean = members.mean()
        yield name, {"mean": mean, "std": within**0.5, "low90": mean - half, "high90": mean + half}


def study(runs: int, workers: int, experiments: tuple[str, ...] = EXPERIMENTS) -> pandas.DataFrame:
    """Predict all experiments: the table."""
    rows = []
    for experiment in experiments:
        missions = simulate(experiment, runs, workers)
        rows += [
            {"experiment": experiment, **row, "inputs": inputs(experiment)}
            for row in predict(missions)
        ]
    columns = [*KEYS, "mean", "median", "std", "low90", "high90", "first_mean", "inputs"]
    return pandas.DataFrame(rows, columns=columns)


def draw(figure: Figure, rows: pandas.DataFrame) -> None:
    """Draw predicted means of the managers with their intervals: a panel for each metric and
    experiment.
    """
    metrics = METRICS[:2]
    panels = figure.subplots(len(metrics), len(TITLES), sharey="row", sharex=True)
    for line, metric in enumerate(metrics):
        for column, experiment in enumerate(TITLES):
            panel = panels[line, column]
            chosen = rows[
                (rows["experiment"] == experiment)
                & (rows["condition"] == "all")
                & (rows["metric"] == metric)
            ]
            own = chosen.set_index("manager")
            for place, (manager, colour) in enumerate(studies.COLOURS.items()):
                row = own.loc[manager]
                errors = [[row["mean"] - row["low90"]], [row["high90"] - row["mean"]]]
                panel.errorbar(
                    place, row["mean"], yerr=errors, fmt="o", ms=3.0, capsize=2.0, color=colour
                )
            panel.set_xticks(range(len(studies.COLOURS)), studies.COLOURS, rotation=45)
            if line == 0:
                panel.set_title(TITLES[experiment])
        panels[line, 0].set_ylabel(studies.METRICS[metric])


def conclude(rows: pandas.DataFrame) -> str:
    """Say what is predicted: a sentence for each experiment."""
    sentences = []
    for experiment, own in rows[rows["condition"] == "all"].groupby("experiment", sort=False):
        table = own.set_index(["manager", "metric"])
        listed = []
        for manager in dict.fromkeys(name for name in own["manager"] if " - " not in name):
            time, distance = (table.loc[(manager, metric)] for metric in METRICS[:2])
            listed.append(
                f"{manager} {time['mean']:.0f} s ({time['low90']:.0f} to {time['high90']:.0f}) and"
                f" {distance['mean']:.1f} m ({distance['low90']:.1f} to {distance['high90']:.1f})"
            )
        sentences.append(f"- {experiment}: {'; '.join(listed)}.")
    return "\n".join(sentences)


# Score


def score(rows: pandas.DataFrame, real: pandas.DataFrame) -> str:
    """Say how near predictions are to real runs.

    Args:
        rows: predictions of one experiment.
        real: its runs, with the columns of `suave_des.records.runs.COLUMNS`; five under each
            condition, in their order.
    """
    if "condition" not in real:
        real = real.assign(condition=real.groupby("manager").cumcount() // REAL_RUNS + 1)
    table = rows.set_index(["manager", "condition", "metric"])
    lines, medians, agreeing = [], [], []
    inside = covered = n = 0
    for manager, metric in dict.fromkeys(zip(rows["manager"], rows["metric"], strict=True)):
        predicted, first, _, second = (
            table.loc[(manager, "all", metric)],
            *manager.partition(" - "),
        )
        own, ends = real[real["manager"] == first], (predicted["low90"], predicted["high90"])
        if second:
            low, high = _difference(own, real[real["manager"] == second], metric)
            if low == low:
                agreeing.append(_better(low, high) == _better(*ends))
                verdict = "agree" if agreeing[-1] else "DIFFER"
                lines.append(
                    f"{manager}, {metric}: real {_range(low, high)}, predicted {_range(*ends)}: {verdict}"
                )
            continue
        values = own[metric].dropna()
        if len(values) < 2:
            continue
        found = mean_of(values.tolist())
        n, inside = n + 1, inside + found.contains(predicted["mean"])
        covered += ends[0] <= found.value <= ends[1]
        lines.append(
            f"{manager}, {metric}: real {found.value:.2f} ({found.text('.2f')}),"
            f" predicted {predicted['mean']:.2f} ({_range(*ends)})"
        )
        for number, part in own.groupby("condition")[metric]:
            if metric == METRICS[0] and (manager, str(number), metric) in table.index:
                medians.append(
                    abs(part.median() - table.loc[(manager, str(number), metric), "median"])
                )
    lines += [
        f"{inside} of {n} predicted means lie in the real 95% intervals.",
        f"{covered} of {n} real means lie in the predicted 90% intervals.",
        f"{sum(agreeing)} of {len(agreeing)} conclusions about pairs agree.",
    ]
    if medians:
        far = f"median {np.median(medians):.1f} s, greatest {max(medians):.1f} s"
        lines.append(f"Median search times of single conditions differ by: {far}.")
    return "\n".join(lines)


def _better(low: float, high: float) -> int:
    """Return the sign of a difference with this interval; 0 if it contains 0."""
    return int(low > 0) - int(high < 0)


def _range(low: float, high: float) -> str:
    return f"{low:.2f} to {high:.2f}"


def _difference(
    ours: pandas.DataFrame, theirs: pandas.DataFrame, metric: str
) -> tuple[float, float]:
    """Return the 95% interval of the mean difference of real runs, of the same conditions; nan if
    there are too few.

    The mean over conditions of the differences of their means; chance is what runs of one condition
    differ by.
    """
    cells = [
        of.dropna(subset=metric).groupby("condition")[metric].agg(["mean", "var", "count"])
        for of in (ours, theirs)
    ]
    both = cells[0].add_suffix("_ours").join(cells[1].add_suffix("_theirs"), how="inner").dropna()
    freedom = (both["count_ours"] + both["count_theirs"] - 2).sum()
    if freedom < 1:
        return float("nan"), float("nan")
    variance = (
        both["var_ours"] / both["count_ours"] + both["var_theirs"] / both["count_theirs"]
    ).sum() / len(both) ** 2
    mean, half = (
        (both["mean_ours"] - both["mean_theirs"]).mean(),
        stdtrit(freedom, 0.975) * variance**0.5,
    )
    return mean - half, mean + half


def scored(experiment: str, files: list[Path]) -> str:
    """Read real runs of an experiment, and score the committed predictions of it."""
    rows = pandas.read_csv(FOLDER / "predictions.csv", dtype={"condition": str})
    return score(
        rows[rows["experiment"] == experiment],
        pandas.concat([read_runs(path).frame for path in files]),
    )


def main() -> None:
    """Predict and write table and figure; or score."""
    chooser = argparse.ArgumentParser(add_help=False)
    chooser.add_argument("--score", nargs="+")
    found, _ = chooser.parse_known_args()
    if found.score:
        experiment, *files = found.score
        if experiment not in EXPERIMENTS or not files:
            chooser.error(
                f"--score: an experiment ({', '.join(EXPERIMENTS)}) and files of its runs"
            )
        try:
            print(scored(experiment, [Path(name) for name in files]))
        except InputError as error:
            chooser.error(str(error))
        return
    members = len(read_ensemble(ENSEMBLE)[0].members)
    chosen = studies.options(str(FOLDER), __doc__ or "", runs=10 * members)
    studies.write(
        chosen, "predictions", study(chosen.runs, chosen.workers), draw, conclude, height=4.0
    )


if __name__ == "__main__":
    main()
