"""What a sweep shows: search time and inspected distance over each swept parameter, one line for each manager."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from suave_des.estimates import estimate
from suave_des.report import style
from suave_des.report.published import METRICS
from suave_des.report.runs import COLUMNS, read_runs

_MOST_PARAMETERS = 4
_MOST_VALUES = 16
"""A parameter with more values is a sampled one: its missions are drawn in so many bins of equal numbers at most."""
_BINS = 8
_APART = 0.008
"""Between managers at the same value, as a share of the axis, so that their intervals do not hide each other."""

_Groups = list[tuple[float, list[float]]]
"""Values of the missions at each place of the horizontal axis."""


def swept_parameters(folder: Path) -> list[str]:
    """The swept parameters of a campaign's folder: what summary.csv and runs.csv have besides figures and metrics."""
    try:
        with (folder / "summary.csv").open(encoding="utf-8", newline="") as file:
            columns = next(csv.reader(file), [])
        with (folder / "runs.csv").open(encoding="utf-8", newline="") as file:
            known = next(csv.reader(file), [])
    except (OSError, ValueError):
        return []
    return [name for name in columns if name in known and name not in COLUMNS]


def draw(folder: Path, parameters: list[str]) -> Figure:
    """Mean and its 95% interval over each parameter, the others averaged over.

    Args:
        folder: the campaign's.
        parameters: columns of its runs.csv; the first four are drawn.

    Raises:
        InputError: its runs.csv cannot be read.
    """
    parameters = parameters[:_MOST_PARAMETERS]
    runs = read_runs(folder / "runs.csv", needed=("manager", *METRICS, *parameters))
    managers = list(dict.fromkeys(runs["manager"]))
    width_in = style.WIDTH_IN if len(parameters) > 1 else style.WIDTH_IN / 2
    figure = Figure(figsize=(width_in, 4.2), layout="constrained")
    panels = figure.subplots(len(METRICS), len(parameters), sharex="col", sharey="row", squeeze=False)
    for row, (metric, title) in zip(panels, METRICS.items(), strict=True):
        for axes, parameter in zip(row, parameters, strict=True):
            places, words = _places(runs[parameter])
            apart = _APART * float(places.max() - places.min())
            for number, manager in enumerate(managers):
                own = runs["manager"] == manager
                groups = _groups(places[own] + (number - (len(managers) - 1) / 2) * apart, runs[metric][own])
                _draw_line(axes, groups, str(manager), style.CYCLE[number % len(style.CYCLE)])
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


def _places(parameter: pandas.Series) -> tuple[pandas.Series, list[str]]:
    """Where missions stand on the horizontal axis; words, and what they are, stand in the order of the sweep."""
    if pandas.api.types.is_numeric_dtype(parameter):
        return parameter.astype(float), []
    codes, words = pandas.factorize(parameter)
    return pandas.Series(codes, parameter.index, dtype=float), [str(word) for word in words]


def _draw_line(axes: Axes, groups: _Groups, label: str, colour: str) -> None:
    found = [estimate(sample) for _, sample in groups]
    means = np.array([each.mean for each in found], dtype=float)
    spans = [each.mean_interval or (each.mean, each.mean) for each in found]
    low, high = np.array(spans, dtype=float).T
    axes.errorbar(
        [x for x, _ in groups],
        means,
        yerr=(means - low, high - means),
        color=colour,
        label=label,
        marker="o",
        ms=3,
        capsize=2,
        elinewidth=0.8,
    )


def _groups(places: pandas.Series, metric: pandas.Series) -> _Groups:
    """Values at each place; of very many places, those of equally many missions, at their mean place."""
    key = places
    if places.nunique() > _MOST_VALUES:
        key = pandas.qcut(places.rank(method="first"), _BINS, labels=False)
    centres = places.groupby(key).mean()
    return [(float(centres[each]), values.tolist()) for each, values in metric.groupby(key)]
