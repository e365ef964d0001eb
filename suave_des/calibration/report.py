"""Write a calibration: the fitted scenario, tables, and a figure of the profiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from suave_des.calibration.fit import Profile
from suave_des.calibration.loss import Evaluation, FreeParameter, Problem
from suave_des.campaign.output import csv_text, json_text
from suave_des.report import style
from suave_des.scenario.loader import LoadedScenario, value_at, with_values

SCENARIO, TABLE, RECORD, FIGURE = "fitted.yaml", "parameters.csv", "calibration.json", "profiles.png"
FILES = (SCENARIO, TABLE, RECORD, FIGURE)


def fitted_values(parameters: Sequence[FreeParameter], best: Evaluation, digits: int = 3) -> dict[str, float]:
    """Fitted values by key path, rounded to what the data can tell."""
    return {parameter.path: round(value, digits) for parameter, value in zip(parameters, best.values, strict=True)}


def fitted_scenario(problem: Problem, base: str, values: Mapping[str, float]) -> str:
    """A scenario file: the one that was fitted, with the fitted values."""
    fitted = with_values(problem.loaded, values)
    tops = {path.rsplit(".", 1)[0] if _is_below_distribution(fitted, path) else path for path in values}
    data: dict[str, Any] = {}
    for path in sorted(tops):
        here = data
        *parents, last = path.split(".")
        for part in parents:
            here = here.setdefault(part, {})
        value = value_at(fitted, path)
        if isinstance(value, dict):
            value = {key: each for key, each in value.items() if each is not None}
        here[last] = value
    if "revision" in data:
        data["revision"] = {"base": fitted.scenario.revision.name, **data["revision"]}
    text = yaml.safe_dump({"base": base, **data}, sort_keys=False, allow_unicode=True)
    return f"# Fitted by `suave-des calibrate`; the report beside this file says how.\n{text}"


def _is_below_distribution(loaded: LoadedScenario, path: str) -> bool:
    parent, _, _ = path.rpartition(".")
    above = value_at(loaded, parent) if parent else None
    return isinstance(above, dict) and "distribution" in above


def table(found: Sequence[Profile]) -> str:
    """The parameters as CSV: bounds, start, fitted value, and the interval that the data admit."""
    rows = []
    for profile in found:
        free = profile.parameter
        numbers = (free.lower, free.upper, free.start, profile.best, profile.low, profile.high)
        rows.append([free.path, *(f"{number:.4g}" for number in numbers)])
    return csv_text(("path", "lower_bound", "upper_bound", "start", "fitted", "admitted_low", "admitted_high"), rows)


def record(
    problem: Problem,
    tried: Sequence[Evaluation],
    best: Evaluation,
    spread: float,
    found: Sequence[Profile],
    provenance: Mapping[str, Any],
) -> str:
    """Everything about the fit, as JSON."""
    managers = sorted(problem.published)
    content = {
        **provenance,
        "loss": "mean over managers of the energy distance between missions as vectors (search time / 40 s, distance "
        "inspected / 12 m, x of detection / 1.5 m), plus the mean absolute difference of the shares in clusters",
        "managers": managers,
        "published_runs": {name: len(problem.published[name]) for name in managers},
        "runs": problem.runs,
        "seed": problem.seed,
        "evaluations": len(tried),
        "best": _evaluation(best, managers),
        "spread_of_loss_over_resampled_published_runs": round(spread, 5),
        "fitted": {each.parameter.path: each.best for each in found},
        "profiles": {
            each.parameter.path: {"values": each.values, "losses": each.losses, "admitted": [each.low, each.high]}
            for each in found
        },
        "history": [round(each.loss, 5) for each in tried],
    }
    return json_text(content)


def _evaluation(evaluation: Evaluation, managers: Sequence[str]) -> dict[str, Any]:
    by_manager = zip(managers, evaluation.distances, strict=True)
    shares = {"share_difference": round(evaluation.share_difference, 5)}
    return {"loss": round(evaluation.loss, 5), **shares, **{name: round(distance, 5) for name, distance in by_manager}}


def profiles_png(found: Sequence[Profile], best: Evaluation, threshold: float) -> bytes:
    """The loss along each parameter, one panel each, with the interval that the data admit."""
    from matplotlib.figure import Figure

    columns = 4
    rows = -(-len(found) // columns)
    top = threshold + 4.0 * (threshold - best.loss)
    with style.publication():
        figure = Figure(figsize=(style.WIDTH_IN, 1.5 * rows), layout="constrained")
        panels = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
        for panel, profile in zip(panels, found, strict=False):
            panel.axvspan(profile.low, profile.high, color="#D6E6F2", lw=0)
            panel.axhline(threshold, color=style.GREY, lw=0.8, ls="--")
            points = sorted([*zip(profile.values, profile.losses, strict=True), (profile.best, best.loss)])
            panel.plot([x for x, _ in points], [y for _, y in points], color=style.BLUE, marker=".", ms=4)
            panel.plot([profile.best], [best.loss], marker="D", color=style.VERMILION, ms=4)
            panel.set_xlim(profile.parameter.lower, profile.parameter.upper)
            panel.set_ylim(0.0, top)
            panel.set_title(profile.parameter.path.replace("calibration.", "").replace("latencies.", ""), fontsize=6.5)
            panel.tick_params(labelsize=6.5)
        for panel in panels[len(found) :]:
            panel.set_visible(False)
        figure.supylabel("distance to the published runs", fontsize=8)
        return style.png(figure, dpi=160)
