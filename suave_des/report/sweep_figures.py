"""Figures of a sweep: means over each parameter, with intervals by run number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from textwrap import fill

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from suave_des.errors import InputError
from suave_des.estimates import estimate
from suave_des.report import style
from suave_des.report.campaign_figures import legend_columns
from suave_des.report.compared_metrics import PAPER_METRICS
from suave_des.report.grouping import first_alike, runs_sharing_draw
from suave_des.report.result_files import Missions
from suave_des.report.words import folded, key_words, value_words

_MOST_PARAMETERS, _COLUMNS = 9, 3
_MOST_VALUES = 16
"""A parameter with more values is a sampled one: its missions are drawn in so many bins of equal numbers at most."""
_BINS = 8
_MOST_TICKS = 6
"""With more swept values, or where two are closer than so many would be, the axis has round numbers instead."""
_APART = 0.012
"""Between managers at the same value, as a share of the axis, so that their intervals do not hide each other."""


def draw_sweep(missions: Missions, parameters: Sequence[str] = ()) -> style.Picture:
    """Draw means with their 95% intervals over each parameter, the others averaged over, a line for each manager.

    All points of a sweep share the random numbers of a run, so that the runs are the independent values: intervals are
    those of the means that each run has over the points.

    Args:
        missions: of a sweep.
        parameters: to draw; empty: all that are swept.

    Raises:
        InputError: one of them is not swept, or there are too many for one figure.
    """
    parameters = list(parameters or missions.swept)
    missions.check_swept(parameters, "parameters")
    for source, part in missions.frame.groupby("source", sort=False):
        if fixed := [name for name in parameters if part[name].isna().all()]:
            problem = f"{source} does not vary {', '.join(fixed)}"
            raise InputError(problem, place="parameters", remedy="leave it out, or choose what all of the sweeps vary")
    if len(parameters) > _MOST_PARAMETERS:
        problem = f"{len(parameters)} parameters do not fit into one figure: {', '.join(parameters)}"
        raise InputError(problem, place="parameters", remedy=f"choose {_MOST_PARAMETERS} or fewer of them")
    frame = missions.frame
    names = _names(frame)
    managers = list(dict.fromkeys(names))
    columns = min(len(parameters), _COLUMNS)
    blocks = math.ceil(len(parameters) / columns)
    width_in = style.WIDTH_IN if columns > 1 else style.WIDTH_IN / 2
    height_in = 4.0 * blocks + 0.2 * math.ceil((len(managers) + 1) / 3)
    figure = style.Picture(figsize=(width_in, height_in), layout="constrained")
    panels = figure.subplots(len(PAPER_METRICS) * blocks, columns, sharey="row", squeeze=False)
    for place, parameter in enumerate(parameters):
        block, column = divmod(place, columns)
        for row, (metric, title) in enumerate(PAPER_METRICS.items()):
            axes = panels[len(PAPER_METRICS) * block + row, column]
            _draw_panel(axes, frame, names, parameter, metric)
            axes.tick_params(labelbottom=row == len(PAPER_METRICS) - 1)
            if column == 0:
                axes.set_ylabel(f"mean {title}")
        panels[len(PAPER_METRICS) * block + len(PAPER_METRICS) - 1, column].set_xlabel(_folded(key_words(parameter)))
    for row in range(len(PAPER_METRICS)):
        own = panels[row :: len(PAPER_METRICS)].ravel()
        top = max(axes.get_ylim()[1] for axes in own if axes.has_data())
        for axes in own:
            axes.set_ylim(0.0, top)
    for axes in panels.ravel():
        axes.set_visible(bool(axes.has_data()))
    handles, labels = panels[0, 0].get_legend_handles_labels()
    handles.append(Line2D([], [], lw=0, marker="|", ms=8, color=style.GREY))
    labels.append("95% interval of the mean")
    ncols = min(3 if columns > 1 else 2, legend_columns(labels))
    figure.legend(handles, labels, loc="outside upper right", ncols=ncols, handlelength=2.8)
    return figure


def _names(frame: pandas.DataFrame) -> pandas.Series[str]:
    """Name the curve of each mission: its manager, with its source where there are several."""
    if frame["source"].nunique() > 1:
        return frame["manager"] + " (" + frame["source"] + ")"
    return frame["manager"]


def _draw_panel(axes: Axes, frame: pandas.DataFrame, names: pandas.Series[str], parameter: str, metric: str) -> None:
    places, words = _places(frame[parameter])
    apart = _APART * float(places.max() - places.min())
    managers = list(dict.fromkeys(names))
    for place, (number, manager) in enumerate(zip(style.looks(managers), managers, strict=True)):
        own = names == manager
        beside = (place - (len(managers) - 1) / 2) * apart
        _draw_means(axes, frame[own].assign(place=places[own]), metric, beside, number, manager)
    if words:
        shown_words = [_folded(style.text(value_words(word)), 14) for word in words]
        long = max(map(len, words)) > 6 and len(words) > 2
        axes.set_xticks(range(len(words)), shown_words, rotation=30 if long else 0, ha="right" if long else "center")
        axes.set_xlim(-0.5, len(words) - 0.5)
    elif _fit_as_ticks(values := np.unique(places)):
        axes.set_xticks(values, [f"{value:g}" for value in values])
    else:
        axes.xaxis.set_major_locator(MaxNLocator(4))


def _fit_as_ticks(values: NDArray[np.float64]) -> bool:
    """Return whether swept values are few enough, and far enough apart, to be written at the axis."""
    return 1 < len(values) <= _MOST_TICKS and bool(np.diff(values).min() > np.ptp(values) / _MOST_TICKS)


def _places(parameter: pandas.Series) -> tuple[pandas.Series[float], list[str]]:
    """Place missions on the horizontal axis: at the value, or at the number of the word in the order of the sweep."""
    if pandas.api.types.is_numeric_dtype(parameter) and not pandas.api.types.is_bool_dtype(parameter):
        return parameter.astype(float), []
    codes, words = pandas.factorize(parameter)
    return pandas.Series(codes, parameter.index, dtype=float), [str(word) for word in words]


def _draw_means(axes: Axes, frame: pandas.DataFrame, metric: str, beside: float, number: int, label: str) -> None:
    """Draw the mean at each place; of very many places, those of equally many missions at their mean place."""
    key = frame["place"]
    if key.nunique() > _MOST_VALUES:
        key = pandas.qcut(key.rank(method="first"), _BINS, labels=False)
    found, middles = [], []
    for _, part in frame.groupby(key):
        has_runs = part["run"].notna().all()
        runs = first_alike(part, runs_sharing_draw(part))
        by_run = part.groupby(["seed", runs])[metric].mean() if has_runs else part[metric]
        found.append(estimate(by_run.dropna().tolist()))
        middles.append(float(part["place"].mean()) + beside)
    means = np.array([each.mean for each in found], dtype=float)
    low, high = np.array([each.mean_interval or (each.mean, each.mean) for each in found], dtype=float).T
    axes.errorbar(
        middles,
        means,
        yerr=(means - low, high - means),
        label=style.text(folded(label)),
        marker=style.marker(number),
        ms=3.2,
        capsize=2,
        elinewidth=0.8,
        **style.line(number),
    )


def _folded(text: str, width: int = 26) -> str:
    """Break a long name into lines, so that names stay apart."""
    return fill(text, width, break_long_words=False)
