"""Predictions for real runs of the exemplar, made before anybody compares; and, with such runs,
their score.

Predicted are the experiments of the study of July 2025 and of its extended mission, from the
configurations of the exemplar's runner in predictions/configs: six conditions as its seed 100 draws
them, five runs of each manager in each. The plain command imports them (`suave-des import-config
--revision 2025 --runner-seed 100`), and simulates. Each simulated run has a member of the ensemble
of parameter sets that fit the known runs (those of experiment 1 and of 2023) about equally well.

    python analysis/predict.py [--out DIR] [--runs N] [--workers N]
    python analysis/predict.py --score EXPERIMENT FILE...

`--runs` are the missions of a manager under each condition, some for each member. The table has a
row for each experiment, manager or pair ("bt - none" is the first less the second), condition and
metric: `mean`; `median`; `std` of single runs within a condition; and `low90` to `high90`, in which
the mean of the real runs should be in nine of ten cases. That interval has three parts: what is not
known of vehicle and software (members differ), the chance of the real runs, and what the model gets
wrong of runs that it was not fitted to (structural_error.py). The last columns are the beginnings of
the SHA-256 of what made the row. predictions/earlier.csv was registered without the third part.

`--score` reads real runs of one experiment in any layout that `suave-des compare` reads, and says
how near the predictions are. The condition of a run follows from its start and its failure times,
and from the order of the runs where these leave several. A run without a reaction has no reaction
time, on both sides.
"""

from __future__ import annotations

import argparse
import hashlib
import subprocess
import sys
from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import studies
import yaml
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.special import stdtrit
from structural_error import measured_shares

from suave_des import InputError, mean_of, read_ensemble, read_real, read_runs, run_campaign

FOLDER = Path(__file__).with_name("predictions")
ROOT = Path(__file__).parents[1]
ENSEMBLE = "planta_exp1"
MADE_OF = {
    "inputs": (
        "scenarios/planta_exp1.yaml",
        "scenarios/revisions/2025.yaml",
        f"scenarios/ensembles/{ENSEMBLE}.csv",
        "analysis/structural_error/deviations.csv",
    ),
    "code": ("suave_des/**/*.py",),
    "vehicle": ("scenarios/vehicles/*.yaml",),
    "modes": ("scenarios/*_modes.yaml",),
    "ontology": ("ontology/*.owl",),
}
"""Columns of the table, and the files whose hash they have; `inputs` has an experiment's own, too."""
EXPERIMENTS = ("exp1", "exp2", "exp3", "extended_exp1", "extended_exp2", "extended_exp3")
TITLES = {"exp1": "thrusters fail", "exp2": "visibility changes", "exp3": "both"}
METRICS = ("search_time_s", "distance_inspected_m", "mean_reaction_time_s")
REAL_RUNS = 5
"""Of each manager under each condition."""
CONFIDENCE = 0.9
DRIFT_M, START_WITHIN_M = 0.355, 0.075
"""How far the vehicle has drifted north when guided mode begins, and how near that is to it."""
SAID_BY = {
    "initial_x_m": ("start.x_m", 0.0, START_WITHIN_M),
    "initial_y_m": ("start.y_m", DRIFT_M, START_WITHIN_M),
    "nominal_y_m": ("start.y_m", 0.0, 0.01),
    "start.y_m": ("start.y_m", 0.0, 0.01),
    "failure_time_s": ("thruster_events.0.time_s", 0.0, 0.1),
    "thruster_events.0.time_s": ("thruster_events.0.time_s", 0.0, 0.1),
    "signals.water_visibility.shift_s": ("signals.water_visibility.shift_s", 0.0, 0.1),
    "condition": ("condition", 0.0, 0.0),
}
"""Columns that may say which condition a run is of: the parameter, what is added to it, and how
near it is.
"""
KEYS = ["experiment", "manager", "condition", "metric"]


def import_configurations(folder: Path) -> None:
    """Make each experiment's scenario and campaign from the files of the exemplar's runner."""
    folder = folder.resolve()
    for experiment in EXPERIMENTS:
        mission = f"v1.5.0_planta_{experiment.removeprefix('extended_')}_mission_config.yaml"
        command = [sys.executable, "-m", "suave_des", "import-config"]
        command += [f"planta_{experiment}_runner_config.yml", mission, "--revision", "2025"]
        command += ["--runner-seed", "100", "--out", str(folder / f"{experiment}.yaml")]
        command += ["--campaign", str(folder / f"{experiment}_campaign.yaml"), "--overwrite"]
        subprocess.run(command, check=True, cwd=FOLDER / "configs", stdout=subprocess.DEVNULL)


def made_of(experiment: str, folder: Path = FOLDER) -> dict[str, str]:
    """Return the beginnings of the SHA-256 of what decides the predictions of an experiment."""
    own = [folder / f"{experiment}.yaml", folder / f"{experiment}_campaign.yaml"]
    found = {}
    for name, patterns in MADE_OF.items():
        files = [file for pattern in patterns for file in sorted(ROOT.glob(pattern))]
        content = b"".join(file.read_bytes() for file in (own if name == "inputs" else []) + files)
        found[name] = f"sha256:{hashlib.sha256(content).hexdigest()[:16]}"
    return found


def simulate(experiment: str, runs: int, workers: int, folder: Path = FOLDER) -> pandas.DataFrame:
    """Run an experiment's missions; their rows, with the number of the condition."""
    campaign = folder / f"{experiment}_campaign.yaml"
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


def study(folder: Path, runs: int, workers: int) -> pandas.DataFrame:
    """Predict all experiments, whose scenarios and campaigns are in a folder: the table."""
    rows = []
    for experiment in EXPERIMENTS:
        missions = simulate(experiment, runs, workers, folder)
        rows += [
            {"experiment": experiment, **row, **made_of(experiment, folder)}
            for row in predict(missions)
        ]
    columns = [*KEYS, "mean", "median", "std", "low90", "high90", "first_mean", *MADE_OF]
    members = len(read_ensemble(ENSEMBLE)[0].members)
    return widened(pandas.DataFrame(rows, columns=columns), measured_shares(), members)


def widened(rows: pandas.DataFrame, shares: tuple[float, float], members: int) -> pandas.DataFrame:
    """Add the structural error to the intervals.

    Its standard deviation is a share of the spread of a manager's missions: of the spread in the
    experiment, or of that in experiment 1, where the shares were measured, if it is larger.
    `bt_extended` has that of `bt` there. Errors of the managers of a pair are taken as independent,
    as those of managers that were left out are.

    Args:
        rows: the table.
        shares: of a single condition, and of the mean over all.
        members: of the ensemble.
    """
    spreads: dict[tuple[str, ...], float] = {}
    parts = rows[rows["condition"] != "all"]
    for keys, cells in parts.groupby(["experiment", "manager", "metric"], sort=False):
        variance = (cells["std"] ** 2).mean() + cells["mean"].var(ddof=0)
        spreads[keys] = float(variance**0.5)

    def structural(row: pandas.Series[Any]) -> float:
        share, variance = shares[row["condition"] == "all"], 0.0
        for manager in row["manager"].split(" - "):
            here = row["experiment"], manager, row["metric"]
            there = "exp1", manager.removesuffix("_extended"), row["metric"]
            variance += (share * max(spreads[here], spreads.get(there, 0.0))) ** 2
        return variance

    quantile = stdtrit(members - 1, (1 + CONFIDENCE) / 2)
    half = (rows["high90"] - rows["low90"]) / 2.0
    wide = (half**2 + quantile**2 * rows.apply(structural, axis=1)) ** 0.5
    low = rows["mean"] - wide
    is_pair = rows["manager"].str.contains(" - ")
    return rows.assign(low90=low.where(is_pair, low.clip(lower=0.0)), high90=rows["mean"] + wide)


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
        real: its runs, as of `assigned`.
    """
    table = rows.set_index(["manager", "condition", "metric"])
    lines, medians, agreeing = [], [], []
    inside = covered = n = 0
    for manager, metric in dict.fromkeys(zip(rows["manager"], rows["metric"], strict=True)):
        first, _, second = manager.partition(" - ")
        own = real[real["manager"] == first]
        if second:
            low, high = _difference(own, real[real["manager"] == second], metric)
            if low == low:
                predicted = table.loc[(manager, "all", metric)]
                ends = predicted["low90"], predicted["high90"]
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
        mean, half = _of_conditions(
            table.loc[manager, :, metric], own.loc[values.index, "condition"]
        )
        n, inside = n + 1, inside + found.contains(mean)
        covered += abs(found.value - mean) <= half
        lines.append(
            f"{manager}, {metric}: real {found.value:.2f} ({found.text('.2f')}),"
            f" predicted {mean:.2f} ({_range(max(0.0, mean - half), mean + half)})"
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


def _of_conditions(rows: pandas.DataFrame, runs: pandas.Series[int]) -> tuple[float, float]:
    """Return mean and half interval of the conditions that real runs were made under.

    Args:
        rows: of one manager and metric, by condition.
        runs: condition of each run.
    """
    whole, shares = rows.loc["all"], runs.astype(str).value_counts(normalize=True)
    half = whole["high90"] - whole["mean"]
    few = (len(rows) - 1) / len(shares)  # a mean of fewer conditions is less certain
    return float((rows.loc[shares.index, "mean"] * shares).sum()), half * few**0.5


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


# The conditions of real runs


def _at_line(file: Path, line: int, problem: str, remedy: str) -> InputError:
    return InputError(problem, file=file, place=f"line {line}", remedy=remedy)


def assigned(experiment: str, files: Sequence[Path]) -> pandas.DataFrame:
    """Read real runs of an experiment, each with the number of its condition, from 1.

    A run is of the condition that has its start, less the drift, its failure time and its shift of
    the visibility, as far as the file has them. Where several have, the order of a manager's runs
    decides: the exemplar's runner makes five under each condition, one condition after the other.
    Some may be missing.

    Raises:
        InputError: with file and line: a run is of no condition or manager of the experiment, or it
            may be of several.
    """
    runs = read_real(files).frame
    places = [(path, line) for path in files for line in read_runs(path).frame.index]
    managers = _plain(FOLDER / f"{experiment}_campaign.yaml")["managers"]
    numbers = pandas.Series(0, runs.index)
    fits = _fitting(experiment, runs)
    for manager, own in runs.groupby("manager", sort=False):
        possible = fits[own.index]
        for row in own.index[~possible.any(axis=1)]:
            raise _at_line(*places[row], *_no_condition(experiment, runs.loc[row]))
        if manager not in managers:
            problem = f"nothing is predicted of manager {manager} in {experiment}"
            raise _at_line(*places[own.index[0]], problem, f"of {', '.join(managers)}")
        if (possible.sum(axis=1) > 1).any():
            possible = _in_order(possible)
        for row, found in zip(own.index, possible, strict=True):
            if found.sum() != 1:
                listed = " or ".join(str(number + 1) for number in np.flatnonzero(fits[row]))
                problem = f"this run may be of condition {listed}, and the order does not tell"
                remedy = "add a column condition, or failure_time_s if thrusters fail"
                raise _at_line(*places[row], problem, remedy)
            numbers[row] = found.argmax() + 1
    return runs.assign(condition=numbers)


def _plain(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return content


def _fitting(experiment: str, runs: pandas.DataFrame) -> NDArray[np.bool_]:
    """Return which conditions each run fits, shape (runs, conditions)."""
    swept = _plain(FOLDER / f"{experiment}_campaign.yaml")["sweep"]["zip"]
    count = len(swept["start.y_m"])
    known = {**swept, "start.x_m": [_plain(FOLDER / f"{experiment}.yaml")["start"]["x_m"]] * count}
    known["condition"] = list(range(1, count + 1))
    fits = np.ones((len(runs), count), dtype=np.bool_)
    for column, (parameter, added, within) in SAID_BY.items():
        if column in runs:
            said = pandas.to_numeric(runs[column], errors="coerce").to_numpy(float)
            right = np.array(known.get(parameter, [np.nan] * count), dtype=float)
            fits &= np.abs(said[:, None] - added - right) <= within
    return fits


def _no_condition(experiment: str, run: pandas.Series[Any]) -> tuple[str, str]:
    """Return what is wrong with a run that is of no condition, and what would be right."""
    said = ", ".join(f"{column} {run[column]}" for column in SAID_BY if column in run)
    swept = _plain(FOLDER / f"{experiment}_campaign.yaml")["sweep"]["zip"]
    listed = [
        f"{number}: {', '.join(f'{value:.2f}' for value in values)}"
        for number, values in enumerate(zip(*swept.values(), strict=True), 1)
    ]
    remedy = f"its conditions have {', '.join(swept)} of {'; '.join(listed)}"
    return f"{said}: of no condition of {experiment}", remedy


def _in_order(fits: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which conditions runs may be of if each condition has at most five, in a row, and
    conditions follow each other; shape (runs, conditions), as of `fits`.
    """
    count = fits.shape[1]

    def following(state: tuple[int, int]) -> set[tuple[int, int]]:
        condition, made = state
        same = {(condition, made + 1)} if condition >= 0 and made < REAL_RUNS else set()
        return same | {(later, 1) for later in range(condition + 1, count)}

    reached = [{(-1, 0)}]
    for row in fits:
        ahead = {new for state in reached[-1] for new in following(state)}
        reached.append({state for state in ahead if row[state[0]]})
    possible, kept = np.zeros_like(fits), reached[-1]
    for number in reversed(range(len(fits))):
        possible[number, [condition for condition, _ in kept]] = True
        kept = {state for state in reached[number] if following(state) & kept}
    return possible


def scored(experiment: str, files: list[Path]) -> str:
    """Read real runs of an experiment, and score the committed predictions of it."""
    rows = pandas.read_csv(FOLDER / "predictions.csv", dtype={"condition": str})
    return score(rows[rows["experiment"] == experiment], assigned(experiment, files))


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
    chosen.out.mkdir(parents=True, exist_ok=True)
    import_configurations(chosen.out)
    rows = study(chosen.out, chosen.runs, chosen.workers)
    studies.write(chosen, "predictions", rows, draw, conclude, height=4.0)


if __name__ == "__main__":
    main()
