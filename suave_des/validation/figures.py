"""Draw a validation: distributions on top of each other, and where the pipeline was found when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.stats import binom

from suave_des.estimates import CONFIDENCE
from suave_des.report import style
from suave_des.report.compared_metrics import KNOWN
from suave_des.report.statistics import Sample
from suave_des.validation.validation import SampleComparison, Validation, sample, with_limit

_SIMULATED, _PUBLISHED = style.BLUE, style.BLACK
_PANEL_INCHES = (style.WIDTH_IN / 3.0, 2.0)
_LEGEND_LINE_INCHES = 0.25
_TIME_BIN_S = 2.0
_AREA_PER_SHARE = 900.0
"""Area of a marker, in square points, that would stand for all runs of a manager."""
_SMALLEST_AREA = 1.5
_LEGEND_SHARE = 0.1
_MARKERS: Mapping[str, Mapping[str, Any]] = {
    "simulated": {"color": _SIMULATED, "alpha": 0.5, "linewidth": 0},
    "published": {"facecolor": "none", "edgecolor": _PUBLISHED, "linewidth": 0.8},
}
_TICK: Mapping[str, Any] = {"linestyle": "", "marker": "|", "color": _PUBLISHED, "markersize": 7, "clip_on": False}


def distributions_png(
    validation: Validation, published: pandas.DataFrame, simulated: pandas.DataFrame, real: str = "published"
) -> bytes:
    """Draw empirical distribution functions, one panel for each metric and manager.

    The shaded band is where, point by point, 95 in 100 samples of the published size would lie if they came from the
    simulation.

    Args:
        validation: of these missions.
        published: real missions.
        simulated: simulated missions.
        real: what the real ones are called: "published" or "real".
    """
    managers = validation.managers
    metrics = list(dict.fromkeys(each.metric for each in validation.samples))
    sides = [with_limit(runs, validation.not_found_s) for runs in (published, simulated)]
    with style.publication():
        figure, axes = _panels(len(metrics), len(managers), share_x=False)
        without = {(row, column) for row in range(len(metrics)) for column in range(len(managers))}
        for each in validation.samples:
            place = metrics.index(each.metric), managers.index(each.manager)
            without.discard(place)
            theirs, ours = (sample(runs, each.manager, each.metric) for runs in sides)
            _distribution(axes[place], each, theirs, ours, real)
        for place in without:
            axes[place].text(0.5, 0.5, "not known", transform=axes[place].transAxes, ha="center", va="center")
        for axis, manager in zip(axes[0], managers, strict=True):
            axis.set_title(manager)
        for axis in axes[:, 0]:
            axis.set_ylabel("share of runs at or below")
        _legend(figure, *axes[0, 0].get_legend_handles_labels())
        return style.png(figure)


def _distribution(axis: Axes, compared: SampleComparison, published: Sample, simulated: Sample, real: str) -> None:
    top = float(max(published.max(), simulated.max())) * 1.04 or 1.0
    values, shares = _steps(simulated, top)
    tail = (1.0 - CONFIDENCE) / 2.0
    # The parts of a sample at or below a value are binomially distributed.
    low, high = (binom.ppf(quantile, len(published), shares) / len(published) for quantile in (tail, 1.0 - tail))
    band = f"95% of samples of the {real} size from the simulation"
    look: Mapping[str, Any] = {"step": "post", "color": _SIMULATED, "alpha": 0.15, "linewidth": 0}
    axis.fill_between(values, np.maximum(low, 0.0), high, label=band, **look)
    axis.step(values, shares, where="post", color=_SIMULATED, linewidth=1.5, label="simulated")
    axis.step(*_steps(published, top), where="post", color=_PUBLISHED, linewidth=0.9, label=real)
    axis.set_ylim(-0.015, 1.02)
    axis.set_xlim(0.0, top)
    axis.set_xlabel(KNOWN[compared.metric].heading)
    # A distribution function leaves the corner opposite to its bulk free.
    x, y, across, up = (
        (0.03, 0.97, "left", "top") if np.median(simulated) > top / 2.0 else (0.98, 0.05, "right", "bottom")
    )
    p = compared.kolmogorov_smirnov.p
    text = (
        f"{real} n = {compared.published.n}\nsimulated n = {compared.simulated.n:,}\n"
        f"KS p = {p:.{'2f' if p >= 0.01 else '0e'}}"
    )
    axis.text(x, y, text, transform=axis.transAxes, ha=across, va=up, fontsize=7.0, linespacing=1.3)


def _steps(values: Sample, top: float) -> tuple[Sample, Sample]:
    """Corners of an empirical distribution function, from zero to the panel's right edge."""
    distinct, counts = np.unique(values, return_counts=True)
    shares = counts.cumsum() / len(values)
    return np.concatenate([[0.0], distinct, [top]]), np.concatenate([[0.0], shares, [1.0]])


def detections_png(
    validation: Validation, published: pandas.DataFrame, simulated: pandas.DataFrame, real: str = "published"
) -> bytes:
    """Draw search times against the x of the pipeline point seen first, one panel for each manager.

    Areas are shares of the manager's runs. Published missions whose place is not known are ticks on the upper edge.
    Arguments as of distributions_png.
    """
    with style.publication():
        figure, axes = _panels(1, len(validation.managers), share_x=True)
        for axis, manager in zip(axes[0], validation.managers, strict=True):
            theirs, ours = (side[side["manager"] == manager] for side in (published, simulated))
            _bubbles(axis, ours, _MARKERS["simulated"])
            _bubbles(axis, theirs, _MARKERS["published"])
            unplaced = theirs.loc[theirs["detection_x_m"].isna(), "search_time_s"]
            axis.plot(unplaced, np.ones(len(unplaced)), transform=axis.get_xaxis_transform(), **_TICK)
            axis.set_title(manager, pad=9)
            without = f"simulated without detection: {ours['detection_x_m'].isna().mean():.1%}"
            axis.set_xlabel(f"{KNOWN['search_time_s'].heading}\n{without}")
        axes[0, 0].set_ylabel("x of the point seen first (m)")
        axes[0, 0].margins(0.06, 0.12)
        circle: dict[str, Any] = {
            "linestyle": "",
            "marker": "o",
            "markersize": (_LEGEND_SHARE * _AREA_PER_SHARE) ** 0.5,
        }
        handles = [
            Line2D([], [], color=_SIMULATED, alpha=0.5, markeredgewidth=0, **circle),
            Line2D([], [], markerfacecolor="none", markeredgecolor=_PUBLISHED, markeredgewidth=0.8, **circle),
            Line2D([], [], **_TICK),
        ]
        size = f"this area: {_LEGEND_SHARE:.0%} of the manager's runs"
        labels = [f"simulated ({size})", real, f"{real}, place not known or no detection"]
        _legend(figure, handles, labels)
        return style.png(figure)


def _bubbles(axis: Axes, runs: pandas.DataFrame, marker: Mapping[str, Any]) -> None:
    known = runs[runs["detection_x_m"].notna()]
    times = (known["search_time_s"] / _TIME_BIN_S).round() * _TIME_BIN_S
    counts = known.groupby([times, known["detection_x_m"].round(3)]).size()
    areas = np.maximum(counts.to_numpy(dtype=float) / max(1, len(runs)) * _AREA_PER_SHARE, _SMALLEST_AREA)
    axis.scatter(counts.index.get_level_values(0), counts.index.get_level_values(1), s=areas, **marker)


def _panels(rows: int, columns: int, *, share_x: bool) -> tuple[Figure, Any]:
    """Make a figure outside pyplot, so that nothing depends on a display or on what the caller has drawn."""
    width, height = _PANEL_INCHES
    # On a figure of one or two panels the legend's entries stand below each other.
    lines = 1 if columns > 2 else 3
    size = width * max(columns, 2), height * rows + lines * _LEGEND_LINE_INCHES
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, sharex=share_x, sharey=True)


def _legend(figure: Figure, handles: Sequence[Artist], labels: Sequence[str]) -> None:
    wide = figure.get_figwidth() > 2.5 * _PANEL_INCHES[0]
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels) if wide else 1)
