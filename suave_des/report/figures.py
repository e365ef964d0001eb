"""Draw what is in a folder of results: a mission's map, a campaign's distributions, or the results of a sweep."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from suave_des.errors import InputError
from suave_des.estimates import estimate
from suave_des.metrics.result import MissionMetrics
from suave_des.report import mission_map, style
from suave_des.report.result_files import check_one_campaign
from suave_des.report.runs import METRICS, read_runs

ENDINGS = (".png", ".pdf", ".svg")
_MOST_PARAMETERS = 4
_MOST_VALUES = 16
"""A parameter with more values is a sampled one: its missions are drawn in so many bins of equal numbers at most."""
_BINS = 8
_APART = 0.008
"""Between managers at the same value, as a share of the axis, so that their intervals do not hide each other."""


def draw_folder(folder: Path, out: Path) -> None:
    """Draw what is in a folder of results, and write the picture.

    Args:
        folder: output folder of a mission (trajectory.csv) or of a campaign (runs.csv).
        out: picture to write; its ending says which kind.

    Raises:
        InputError: there are no results in the folder, or the picture cannot be written.
    """
    if out.suffix.lower() not in ENDINGS:
        problem = f"expected a picture, got {out.suffix or 'a file without an ending'}"
        raise InputError(problem, file=out, remedy=f"one of {', '.join(ENDINGS)}")
    with style.publication():
        if (folder / "trajectory.csv").is_file():
            picture = mission_map.draw(folder)
        elif (folder / "runs.csv").is_file():
            check_one_campaign(folder)
            swept = swept_parameters(folder)
            picture = draw_sweep(folder, swept) if swept else draw_distributions(folder / "runs.csv")
        else:
            remedy = "give the --out folder of suave-des run, campaign or reproduce"
            raise InputError("has neither trajectory.csv nor runs.csv", file=folder, remedy=remedy)
        temporary = out.with_name(f".{os.getpid()}{out.suffix}")
        try:
            picture.savefig(temporary)
            temporary.replace(out)
        except OSError as error:
            remedy = "give a path in a folder that is yours"
            raise InputError(f"cannot be written: {error.strerror}", file=out, remedy=remedy) from None
        finally:
            with suppress(OSError):  # there may not even be a folder
                temporary.unlink()


def draw_distributions(path: Path) -> Figure:
    """Draw the empirical distribution functions of search time and inspected distance, a curve for each manager.

    Raises:
        InputError: the file is not a runs.csv, or has no missions.
    """
    runs = read_runs(path, are_simulated=True).frame
    figure = Figure(figsize=(style.WIDTH_IN, 2.7), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, letter, (metric, title) in zip((left, right), "ab", METRICS.items(), strict=True):
        end = max(1.0, float(runs[metric].max()) * 1.04)
        for place, (manager, values) in enumerate(runs.groupby("manager", sort=False)[metric]):
            colour = style.CYCLE[place % len(style.CYCLE)]
            shares = np.arange(1, len(values) + 1) / len(values)
            steps = [0.0, *np.sort(values), end], [0.0, *shares, 1.0]
            axes.step(*steps, where="post", color=colour, label=f"{manager} (n = {len(values)})")
            axes.plot(float(values.mean()), 0.0, marker="^", color=colour, ms=5, clip_on=False, zorder=5)
        axes.set_xlabel(title)
        axes.set_xlim(0.0, end)
        axes.set_title(f"{letter}   {title.split(' (')[0].capitalize()}")
    left.set_ylabel("share of missions at or below")
    left.set_ylim(0.0, 1.02)
    handles, labels = left.get_legend_handles_labels()
    handles.append(Line2D([], [], lw=0, marker="^", ms=5, color=style.GREY))
    figure.legend(handles, [*labels, "mean"], loc="outside upper right", ncols=4)
    return figure


def swept_parameters(folder: Path) -> list[str]:
    """Find the swept parameters of a campaign: columns of its summary.csv and runs.csv that are not metrics."""
    try:
        with (folder / "summary.csv").open(encoding="utf-8", newline="") as file:
            columns = next(csv.reader(file), [])
        with (folder / "runs.csv").open(encoding="utf-8", newline="") as file:
            known = next(csv.reader(file), [])
    except (OSError, ValueError):
        return []
    return [name for name in columns if name in known and name not in MissionMetrics.__dataclass_fields__]


def draw_sweep(folder: Path, parameters: Sequence[str]) -> Figure:
    """Draw means with their 95% intervals over each parameter, the others averaged over, a line for each manager.

    Args:
        folder: the campaign's.
        parameters: columns of its runs.csv; the first four are drawn.

    Raises:
        InputError: its runs.csv cannot be read.
    """
    parameters = parameters[:_MOST_PARAMETERS]
    runs = read_runs(folder / "runs.csv", further=parameters, are_simulated=True)
    managers = list(runs.managers)
    width_in = style.WIDTH_IN if len(parameters) > 1 else style.WIDTH_IN / 2
    figure = Figure(figsize=(width_in, 4.2), layout="constrained")
    panels = figure.subplots(len(METRICS), len(parameters), sharex="col", sharey="row", squeeze=False)
    for row, (metric, title) in zip(panels, METRICS.items(), strict=True):
        for axes, parameter in zip(row, parameters, strict=True):
            places, words = _places(runs.frame[parameter])
            apart = _APART * float(places.max() - places.min())
            for number, manager in enumerate(managers):
                own = runs.frame["manager"] == manager
                beside = places[own] + (number - (len(managers) - 1) / 2) * apart
                _draw_means(axes, beside, runs.frame[metric][own], manager, style.CYCLE[number % len(style.CYCLE)])
            if words:
                axes.set_xticks(range(len(words)), words, rotation=15)
                axes.set_xlim(-0.5, len(words) - 0.5)
            else:
                axes.xaxis.set_major_locator(MaxNLocator(5))
        row[0].set_ylabel(title)
        row[0].set_ylim(bottom=0.0)
    for axes, parameter in zip(panels[-1], parameters, strict=True):
        axes.set_xlabel(parameter)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=3)
    return figure


def _places(parameter: pandas.Series) -> tuple[pandas.Series[float], list[str]]:
    """Place missions on the horizontal axis: at the value, or at the number of the word in the order of the sweep."""
    if pandas.api.types.is_numeric_dtype(parameter):
        return parameter.astype(float), []
    codes, words = pandas.factorize(parameter)
    return pandas.Series(codes, parameter.index, dtype=float), [str(word) for word in words]


def _draw_means(axes: Axes, places: pandas.Series, metric: pandas.Series, label: str, colour: str) -> None:
    """Draw the mean at each place; of very many places, those of equally many missions at their mean place."""
    key = places
    if places.nunique() > _MOST_VALUES:
        key = pandas.qcut(places.rank(method="first"), _BINS, labels=False)
    found = [estimate(values.tolist()) for _, values in metric.groupby(key)]
    means = np.array([each.mean for each in found], dtype=float)
    low, high = np.array([each.mean_interval or (each.mean, each.mean) for each in found], dtype=float).T
    spans = means - low, high - means
    look: Mapping[str, Any] = {"marker": "o", "ms": 3, "capsize": 2, "elinewidth": 0.8}
    axes.errorbar(places.groupby(key).mean().tolist(), means, yerr=spans, color=colour, label=label, **look)
