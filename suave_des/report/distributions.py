"""Distributions of search time and inspected distance, one curve for each manager."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from suave_des.errors import InputError
from suave_des.report import style
from suave_des.report.published import METRICS
from suave_des.report.runs import read_runs


def draw(path: Path) -> Figure:
    """Empirical distribution functions of the missions in a runs.csv.

    Raises:
        InputError: it is no runs.csv, or has no missions.
    """
    runs = read_runs(path, needed=("manager", *METRICS))
    if runs.empty:
        raise InputError("has no missions", file=path, remedy="give a runs.csv with at least one")
    figure = Figure(figsize=(style.WIDTH_IN, 2.7), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    samples = {str(manager): own for manager, own in runs.groupby("manager", sort=False)}
    for axes, letter, (metric, title) in zip((left, right), "ab", METRICS.items(), strict=True):
        end = max(1.0, float(runs[metric].max()) * 1.04)
        for place, (manager, own) in enumerate(samples.items()):
            label = f"{manager} (n = {len(own)})"
            _draw_curve(axes, np.sort(own[metric].to_numpy()), end, label, style.CYCLE[place % len(style.CYCLE)])
        axes.set_xlabel(title)
        axes.set_xlim(0.0, end)
        axes.set_title(f"{letter}   {title.split(' (')[0].capitalize()}")
    left.set_ylabel("share of missions at or below")
    left.set_ylim(0.0, 1.02)
    handles, labels = left.get_legend_handles_labels()
    handles.append(Line2D([], [], lw=0, marker="^", ms=5, color=style.GREY))
    figure.legend(handles, [*labels, "mean"], loc="outside upper right", ncols=4)
    return figure


def _draw_curve(axes: Axes, values: np.ndarray, end: float, label: str, colour: str) -> None:
    shares = np.arange(1, len(values) + 1) / len(values)
    axes.step([0.0, *values, end], [0.0, *shares, 1.0], where="post", color=colour, label=label)
    mean = float(values.mean())
    axes.plot(mean, 0.0, marker="^", color=colour, ms=5, clip_on=False, zorder=5)
