"""Predictions for real runs of the exemplar's revision of 2025 that this project has not seen.

Experiment 1 of the study of 2025 has a constant visibility and thruster failures. Predicted here, for its managers and
its six starts: the same with a visibility of period 120 s and no failure, and with both disturbances at once, for two
shifts of the visibility. Of the study's files only that of experiment 1 gives the manager none another search mode than
the exemplar's default, fd_spiral_low, which it has here. Each run has a member of the ensemble of parameter sets that
fit the known runs equally well, so that the intervals are what is not known of the vehicle and its software admits for
a mean: `low95` and `high95`; for the mean of real runs, five under each condition as in that study, they are
`low95_of_runs` and `high95_of_runs`.

    python analysis/predictions_2025.py [--out DIR] [--runs N] [--workers N]

`--runs` are the missions under each condition, some for each member of the ensemble.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas
import studies
from matplotlib.figure import Figure

from suave_des.campaign.variation import ENSEMBLE_COLUMN, read_ensemble
from suave_des.estimates import t_quantile

SCENARIO = ENSEMBLE = "planta_exp1"
MANAGERS = ("none", "random", "metacontrol", "bt")
STARTS_Y_M = (2.455, 2.8, 2.933, 2.204, 2.963, 2.818)
FAILURES_S = (146.39, 91.19, 61.88, 69.4, 111.08, 24.82)
"""Conditions of experiment 1."""
PERIOD_S = 120.0
SHIFTS_S = (0.0, 60.0)
"""At 0 the water is clearest when the mission begins, at 60 it is murkiest."""
EXPERIMENTS = {"visibility": False, "both": True}
"""Whether thrusters fail, by the name of the experiment."""
REAL_RUNS = 5


def sweep_of(experiment: str, shift_s: float, conditions: list[int]) -> dict[str, Any]:
    """Return the sweep over the conditions, counted from 1."""
    signal = {"kind": "sinusoid", "period_s": PERIOD_S, "minimum": 1.25, "maximum": 3.75, "shift_s": shift_s}
    failures = [
        [{"thruster": thruster, "event": "failure", "time_s": FAILURES_S[number - 1]} for thruster in (1, 3)]
        if EXPERIMENTS[experiment]
        else []
        for number in conditions
    ]
    starts = [STARTS_Y_M[number - 1] for number in conditions]
    signals = [{**signal, "publishing_period_s": 1.0}] * len(conditions)
    modes = ["fd_spiral_low"] * len(conditions)
    varied = {"start.y_m": starts, "signals.water_visibility": signals, "thruster_events": failures}
    return {"zip": {**varied, "default_modes.f_generate_search_path": modes}}


def simulate(runs: int, workers: int, conditions: list[int] | None = None) -> pandas.DataFrame:
    """Run all missions; their rows with experiment, shift_s and condition."""
    wanted = list(range(1, len(STARTS_Y_M) + 1)) if conditions is None else conditions
    frames = []
    for experiment in EXPERIMENTS:
        for shift_s in SHIFTS_S:
            sweep = sweep_of(experiment, shift_s, wanted)
            frame = studies.missions(SCENARIO, MANAGERS, runs, workers, sweep=sweep, ensemble=ENSEMBLE)
            numbers = np.repeat(wanted, len(MANAGERS) * runs)
            frames.append(frame.assign(experiment=experiment, shift_s=shift_s, condition=numbers))
    return pandas.concat(frames, ignore_index=True)


def study(runs: int, workers: int, conditions: list[int] | None = None) -> pandas.DataFrame:
    """Predict; a row for each experiment, shift, manager, metric and condition, and for all conditions together."""
    missions = simulate(runs, workers, conditions)
    rows = []
    for keys, own in missions.groupby(["experiment", "shift_s", "manager"], sort=False, observed=True):
        for metric in studies.METRICS:
            for number, part in _parts(own):
                names = dict(zip(("experiment", "shift_s", "manager"), keys, strict=True))
                rows.append({**names, "condition": number, "metric": metric, **predict(part, metric)})
    return pandas.DataFrame(rows)


def _parts(missions: pandas.DataFrame) -> Iterator[tuple[str, pandas.DataFrame]]:
    yield "all", missions
    for number, part in missions.groupby("condition"):
        yield str(number), part


def predict(missions: pandas.DataFrame, metric: str) -> dict[str, float]:
    """Predict the mean of a metric over the conditions that some missions have.

    Chance is what missions of one member under one condition differ by. The members' means have some of it, too, so
    that their interval is a little wider than the parameters alone make it.
    """
    cells = missions.astype({metric: float}).groupby([ENSEMBLE_COLUMN, "condition"])[metric]
    means, variances = (cells.agg(kind).unstack() for kind in ("mean", "var"))
    members = means.mean(axis=1)
    between = float(members.var())
    of_runs = between + float(variances.mean().mean()) / REAL_RUNS / means.shape[1]
    mean, factor = float(members.mean()), t_quantile(len(members) - 1)
    first = missions[missions["run"] <= studies.FIRST_RUNS].astype({metric: float})
    return {
        "mean": mean,
        "low95": mean - factor * between**0.5,
        "high95": mean + factor * between**0.5,
        "low95_of_runs": mean - factor * of_runs**0.5,
        "high95_of_runs": mean + factor * of_runs**0.5,
        "members": len(members),
        "found": float(missions["pipeline_found"].mean()),
        "first_mean": float(first[metric].mean()),
    }


def draw(figure: Figure, rows: pandas.DataFrame) -> None:
    """Draw a panel for each experiment and shift, and metric: predicted means with their intervals."""
    cases = [(experiment, shift_s) for experiment in EXPERIMENTS for shift_s in SHIFTS_S]
    panels = figure.subplots(len(studies.METRICS), len(cases), sharey="row")
    for line, (metric, title) in enumerate(studies.METRICS.items()):
        for column, (experiment, shift_s) in enumerate(cases):
            panel = panels[line, column]
            chosen = (rows["metric"] == metric) & (rows["condition"] == "all") & (rows["shift_s"] == shift_s)
            own = rows[chosen & (rows["experiment"] == experiment)].set_index("manager")
            for place, manager in enumerate(MANAGERS):
                row = own.loc[manager]
                colour = studies.COLOURS[manager]
                panel.vlines(place, row["low95_of_runs"], row["high95_of_runs"], color=colour, lw=1.0)
                panel.vlines(place, row["low95"], row["high95"], color=colour, lw=4.0, alpha=0.5)
                panel.plot(place, row["mean"], "o", ms=3.0, color=colour)
            panel.set_xticks(range(len(MANAGERS)), MANAGERS, rotation=60)
            if line == 0:
                failures = "and failures" if EXPERIMENTS[experiment] else "only"
                panel.set_title(f"visibility {failures},\nshift {shift_s:g} s")
        panels[line, 0].set_ylabel(f"predicted mean\n{title}")


def conclude(rows: pandas.DataFrame) -> str:
    """Say what is predicted."""
    sentences = []
    for (experiment, shift_s), own in rows[rows["condition"] == "all"].groupby(["experiment", "shift_s"], sort=False):
        table = own.set_index(["manager", "metric"])
        listed = []
        for manager in MANAGERS:
            time, distance = (table.loc[(manager, metric)] for metric in studies.METRICS)
            listed.append(
                f"{manager} {time['mean']:.0f} s ({time['low95_of_runs']:.0f} to {time['high95_of_runs']:.0f}) and"
                f" {distance['mean']:.1f} m ({distance['low95_of_runs']:.1f} to {distance['high95_of_runs']:.1f})"
            )
        failures = "with both thrusters failing" if EXPERIMENTS[str(experiment)] else "without failures"
        sentences.append(f"- Period {PERIOD_S:g} s, shift {shift_s:g} s, {failures}: {'; '.join(listed)}.")
    return "\n".join(sentences)


def main() -> None:
    """Simulate, predict, write the table and the figure."""
    members = len(read_ensemble(ENSEMBLE)[0].members)
    chosen = studies.options(__file__, __doc__ or "", runs=2 * members)
    rows = study(chosen.runs, chosen.workers)
    studies.write(chosen, "predictions_2025", rows, draw, conclude, height=4.2)


if __name__ == "__main__":
    main()
