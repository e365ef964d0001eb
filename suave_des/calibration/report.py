"""Write a calibration: the fitted scenario, tables, and a figure of the profiles."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from suave_des.calibration.cases import Case
from suave_des.calibration.fit import Profile
from suave_des.calibration.loss import Evaluation, FreeParameter, Judgement, Problem, judge
from suave_des.files import csv_text, json_text
from suave_des.report import style
from suave_des.resources import find, shipped_folder
from suave_des.scenario.loader import LoadedScenario, value_at, with_values

SCENARIO, TABLE, RECORD, FIGURE = "fitted.yaml", "parameters.csv", "calibration.json", "profiles.png"
FILES = (SCENARIO, TABLE, RECORD, FIGURE)
_HEADER = "# Fitted by `suave-des calibrate`"


def scenario_file(case: Case, cases: Sequence[Case]) -> str:
    """Name the file of a fitted scenario: of several, with the scenario's name."""
    return SCENARIO if len(cases) == 1 else f"fitted_{case.name}.yaml"


def files_in(folder: Path) -> set[str]:
    """Return the names of a fit's files, with those of several fitted scenarios that are in a folder."""
    several = (path for path in folder.glob("fitted_*.yaml") if path.read_text("utf-8", "replace").startswith(_HEADER))
    return {*FILES, *(path.name for path in several)}


def data_files(cases: Sequence[Case]) -> Any:
    """Return name and SHA-256 of the files of real missions; of several scenarios, by scenario."""
    listed = {case.name: [{"file": name, "sha256": sha} for name, sha in case.digests.items()] for case in cases}
    short = {name: files[0] if len(files) == 1 else files for name, files in listed.items()}
    return short[cases[0].name] if len(cases) == 1 else short


def judge_halves(
    problem: Problem, halves: Sequence[tuple[Case, Case | None]], values: Sequence[float]
) -> dict[str, dict[str, Judgement]]:
    """Judge values by the conditions that were fitted and by those that were not, of each scenario that has both."""
    return {
        fitted.name: {"fitted": judge(problem, fitted, values), "held out": judge(problem, others, values)}
        for fitted, others in halves
        if others is not None
    }


def fitted_values(best: Evaluation) -> list[float]:
    """Return the fitted values of the parameters, rounded to what the data can tell."""
    return [round(value, 3) for value in best.values]


def fitted_scenario(problem: Problem, case: Case, values: Sequence[float], folder: Path) -> str:
    """Return a scenario file for a folder: the case's scenario with the values of the problem's parameters."""
    own = problem.values_of(case, values)
    fitted = with_values(case.loaded, own)
    tops = {path.rsplit(".", 1)[0] if _is_below_distribution(fitted, path) else path for path in own}
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
    text = yaml.safe_dump({"base": _base(case.base, folder), **data}, sort_keys=False, allow_unicode=True)
    return f"{_HEADER}; the report beside this file says how.\n{text}"


def _base(name: str, folder: Path) -> str:
    """Name a scenario's file as one in the folder has to: a shipped one by its name."""
    path = find(name, "scenarios")
    if path.is_relative_to(shipped_folder("scenarios")):
        return name if len(Path(name).parts) == 1 else path.name
    return Path(os.path.relpath(path, folder)).as_posix()


def _is_below_distribution(loaded: LoadedScenario, path: str) -> bool:
    parent, _, _ = path.rpartition(".")
    above = value_at(loaded, parent) if parent else None
    return isinstance(above, dict) and "distribution" in above


def table(found: Sequence[Profile]) -> str:
    """The parameters as CSV: bounds, start, fitted value, and the interval that the data admit.

    If not all scenarios have all of them, with a column for the names of those that have each.
    """
    are_apart = any(profile.parameter.scenarios for profile in found)
    rows = []
    for profile in found:
        free = profile.parameter
        numbers = (free.lower, free.upper, free.start, profile.best, profile.low, profile.high)
        scenarios = [", ".join(free.scenarios) or "all"] if are_apart else []
        rows.append([free.path, *scenarios, *(f"{number:.4g}" for number in numbers)])
    columns = ("lower_bound", "upper_bound", "start", "fitted", "admitted_low", "admitted_high")
    return csv_text(("path", *(["scenarios"] if are_apart else []), *columns), rows)


@dataclass(frozen=True)
class Fit:
    """A fit with all that is known about it.

    Attributes:
        problem: what was fitted to what.
        tried: all evaluations of the search.
        best: the chosen one, simulated again.
        spread: of the loss over resampled real runs.
        profiles: of the parameters, if they were computed.
        judgements: by scenario, of the conditions that were fitted and of those that were not, if some were held out.
    """

    problem: Problem
    tried: Sequence[Evaluation]
    best: Evaluation
    spread: float
    profiles: Sequence[Profile]
    judgements: Mapping[str, Mapping[str, Judgement]] = field(default_factory=dict)


def record(fit: Fit, provenance: Mapping[str, Any]) -> str:
    """Everything about the fit, as JSON."""
    problem, found = fit.problem, fit.profiles
    content = {
        **provenance,
        "loss": _loss_text(problem.cases),
        **_real_runs(problem.cases),
        "runs": problem.runs,
        "seed": problem.seed,
        "evaluations": len(fit.tried),
        "best": _evaluation(fit.best, problem.cases),
        "spread_of_loss_over_resampled_published_runs": round(fit.spread, 5),
        "fitted": {each.name: value for each, value in zip(problem.parameters, fit.best.values, strict=True)},
        "profiles": {
            each.parameter.name: {"values": each.values, "losses": each.losses, "admitted": [each.low, each.high]}
            for each in found
        },
        "history": [round(each.loss, 5) for each in fit.tried],
    }
    if fit.judgements:
        content["conditions"] = {
            name: {half: _judgement(each) for half, each in halves.items()} for name, halves in fit.judgements.items()
        }
    return json_text(content)


def _loss_text(cases: Sequence[Case]) -> str:
    text = (
        "mean over managers of the energy distance between missions as vectors (search time / 40 s, distance "
        "inspected / 12 m, x of detection / 1.5 m), plus the mean absolute difference of the shares in clusters"
    )
    if any(case.has_conditions for case in cases):
        text = text.replace("mean over managers", "mean over managers and their conditions", 1)
    return text if len(cases) == 1 else f"mean over the scenarios of: {text}"


def _real_runs(cases: Sequence[Case]) -> dict[str, Any]:
    """Managers and counts of real runs; of several scenarios, by scenario."""
    parts = {}
    for case in cases:
        counts = {name: int((case.real["manager"] == name).sum()) for name in case.managers}
        conditions = {"conditions": list(case.conditions)} if case.has_conditions else {}
        parts[case.name] = {"managers": list(case.managers), "published_runs": counts, **conditions}
    return parts[cases[0].name] if len(cases) == 1 else {"scenarios": parts}


def _evaluation(evaluation: Evaluation, cases: Sequence[Case]) -> dict[str, Any]:
    parts = {}
    for case, each in zip(cases, evaluation.cases, strict=True):
        distances = {name: round(distance, 5) for name, distance in each.distances.items()}
        parts[case.name] = {
            "loss": round(each.loss, 5),
            "share_difference": round(each.share_difference, 5),
            **distances,
        }
    return parts[cases[0].name] if len(cases) == 1 else {"loss": round(evaluation.loss, 5), **parts}


def _judgement(judgement: Judgement) -> dict[str, Any]:
    return {
        "conditions": list(judgement.conditions),
        "loss": round(judgement.loss, 5),
        "median_difference_of_search_times_s": round(judgement.median_difference_s, 3),
    }


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
            panel.set_title(_title(profile.parameter), fontsize=6.5)
            panel.tick_params(labelsize=6.5)
        for panel in panels[len(found) :]:
            panel.set_visible(False)
        figure.supylabel("distance to the published runs", fontsize=8)
        return style.png(figure, dpi=160)


def _title(parameter: FreeParameter) -> str:
    """Name a parameter in lines that fit above its panel: the scenario if it is of one alone, then the key path."""
    keys = parameter.path.split(".")[1:] or [parameter.path]  # without the part of the scenario that it is in
    lines = [f"{', '.join(parameter.scenarios)}:"] if parameter.scenarios else []
    return "\n".join([*lines, *(f"{key}." for key in keys[:-1]), keys[-1]])
