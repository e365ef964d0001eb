"""Figures of a validation: distributions on top of each other, and where the pipeline was found when."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from suave_des.validation.comparison import Cell, sample
from suave_des.validation.runs import METRICS
from suave_des.validation.statistics import CONFIDENCE, Sample
from suave_des.validation.validation import Validation

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIMULATED, _PUBLISHED = "#2a78b5", "#111111"
_TITLES = {"search_time_s": "search time (s)", "distance_inspected_m": "distance inspected (m)"}
_STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "legend.frameon": False,
}
_DPI = 200
_PANEL_INCHES = (3.0, 2.5)
_TIME_BIN_S = 2.0
_AREA_PER_SHARE = 1_400.0
"""Area of a marker, in square points, that stands for all runs of a manager."""
_SMALLEST_AREA = 2.0
_LEGEND_SHARE = 0.1
_SIMULATED_MARKER: Mapping[str, Any] = {"color": _SIMULATED, "alpha": 0.55, "linewidth": 0}
_PUBLISHED_MARKER: Mapping[str, Any] = {"facecolor": "none", "edgecolor": _PUBLISHED, "linewidth": 1.0}
_TICK_MARKER: Mapping[str, Any] = {
    "linestyle": "",
    "marker": "|",
    "color": _PUBLISHED,
    "markersize": 8,
    "clip_on": False,
}


def distributions_png(validation: Validation, published: pandas.DataFrame, simulated: pandas.DataFrame) -> bytes:
    """Empirical distribution functions, one panel for each metric and manager.

    The shaded band is where, pointwise, 95 in 100 samples as large as the published one would lie if they came from the
    simulation.
    """
    rows, columns = len(METRICS), len(validation.managers)
    tops = {metric: _top(metric, validation.managers, published, simulated) for metric in METRICS}
    with _styled():
        figure, axes = _panels(rows, columns, share_x="row")
        for cell in validation.cells:
            row, column = METRICS.index(cell.metric), validation.managers.index(cell.manager)
            axis = axes[row, column]
            theirs, ours = (sample(runs, cell.manager, cell.metric) for runs in (published, simulated))
            _distribution(axis, cell, theirs, ours, tops[cell.metric])
            if row == 0:
                axis.set_title(cell.manager, fontweight="bold")
            if column == 0:
                axis.set_ylabel("share of runs")
        _shared_legend(figure, axes[0, 0])
        return _png(figure)


def _top(metric: str, managers: Sequence[str], *sides: pandas.DataFrame) -> float:
    """The right edge of a metric's panels."""
    return max(float(sample(side, manager, metric).max()) for side in sides for manager in managers) * 1.04 or 1.0


def _distribution(axis: Axes, cell: Cell, published: Sample, simulated: Sample, top: float) -> None:
    from scipy.stats import binom

    values, steps = _steps(simulated, top)
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = (binom.ppf(probability, len(published), steps) / len(published) for probability in (tail, 1.0 - tail))
    axis.fill_between(
        values,
        np.clip(low, 0.0, 1.0),
        high,
        step="post",
        color=_SIMULATED,
        alpha=0.16,
        linewidth=0,
        label="95% of samples of the published size, drawn from the simulation",
    )
    axis.step(values, steps, where="post", color=_SIMULATED, linewidth=1.6, label="simulated")
    axis.step(*_steps(published, top), where="post", color=_PUBLISHED, linewidth=1.1, label="published")
    axis.set_ylim(-0.015, 1.02)
    axis.set_xlim(0.0, top)
    axis.set_xlabel(_TITLES[cell.metric])
    # A distribution function leaves the corner opposite to its bulk free.
    left = float(np.median(simulated)) > top / 2.0
    axis.text(
        0.03 if left else 0.98,
        0.97 if left else 0.05,
        f"published n = {cell.published.n}\nsimulated n = {cell.simulated.n:,}\nKS p = {_p(cell.kolmogorov_smirnov.p)}",
        transform=axis.transAxes,
        ha="left" if left else "right",
        va="top" if left else "bottom",
        fontsize=7.5,
        linespacing=1.3,
    )


def _steps(values: Sample, top: float) -> tuple[Sample, Sample]:
    """Corners of an empirical distribution function, from nought to the panel's right edge."""
    distinct, counts = np.unique(values, return_counts=True)
    shares = counts.cumsum() / len(values)
    return np.concatenate([[0.0], distinct, [top]]), np.concatenate([[0.0], shares, [1.0]])


def _p(p: float) -> str:
    return f"{p:.2f}" if p >= 0.01 else f"{p:.1g}"


def detections_png(validation: Validation, published: pandas.DataFrame, simulated: pandas.DataFrame) -> bytes:
    """Search time against the x of the pipeline point seen first, one panel for each manager.

    Areas are shares of the manager's runs. Published missions whose place is not known are ticks on the upper edge.
    """
    with _styled():
        figure, axes = _panels(1, len(validation.managers), share_x="all")
        for axis, manager in zip(axes[0], validation.managers, strict=True):
            _bubbles(axis, simulated[simulated["manager"] == manager], **_SIMULATED_MARKER)
            own = published[published["manager"] == manager]
            _bubbles(axis, own, **_PUBLISHED_MARKER)
            unplaced = own.loc[own["detection_x_m"].isna(), "search_time_s"]
            axis.plot(unplaced, np.ones(len(unplaced)), transform=axis.get_xaxis_transform(), **_TICK_MARKER)
            axis.set_title(manager, fontweight="bold", pad=10)
            axis.set_xlabel(_TITLES["search_time_s"])
            axis.grid(alpha=0.25, linewidth=0.5)
            axis.set_axisbelow(True)
        axes[0, 0].set_ylabel("x of the point seen first (m)")
        axes[0, 0].margins(0.06, 0.1)
        example = [_LEGEND_SHARE * _AREA_PER_SHARE]
        text = f"this area: {_LEGEND_SHARE:.0%} of the manager's runs"
        axes[0, 0].scatter([], [], s=example, label=f"simulated ({text})", **_SIMULATED_MARKER)
        axes[0, 0].scatter([], [], s=example, label="published", **_PUBLISHED_MARKER)
        axes[0, 0].plot([], [], label="published, place not known or nothing found", **_TICK_MARKER)
        _shared_legend(figure, axes[0, 0])
        return _png(figure)


def _bubbles(axis: Axes, runs: pandas.DataFrame, **style: Any) -> None:
    known = runs[runs["detection_x_m"].notna()]
    times = (known["search_time_s"] / _TIME_BIN_S).round() * _TIME_BIN_S
    counts = known.groupby([times, known["detection_x_m"].round(3)]).size()
    shares = counts.to_numpy(dtype=float) / max(1, len(runs))
    areas = np.maximum(shares * _AREA_PER_SHARE, _SMALLEST_AREA)
    axis.scatter(counts.index.get_level_values(0), counts.index.get_level_values(1), s=areas, **style)


def _styled() -> Any:
    import matplotlib

    return matplotlib.rc_context(_STYLE)


def _panels(rows: int, columns: int, *, share_x: Literal["row", "all"]) -> tuple[Figure, Any]:
    """A figure outside pyplot, so that nothing depends on a display or on what the caller has drawn."""
    from matplotlib.figure import Figure

    width, height = _PANEL_INCHES
    figure = Figure(figsize=(width * columns, height * rows + 0.6), layout="constrained", dpi=_DPI)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=share_x, sharey=True)
    return figure, axes


def _shared_legend(figure: Figure, axis: Axes) -> None:
    handles, labels = axis.get_legend_handles_labels()
    # On a figure of one or two panels the entries stand below each other.
    columns = len(labels) if len(figure.axes) > 2 and figure.get_figwidth() > 2.5 * _PANEL_INCHES[0] else 1
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=8)


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    # The library's version would make equal figures differ.
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()
