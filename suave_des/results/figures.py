"""Figures of results folders: of a mission; of a campaign distributions, differences, and means
over a sweep.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations, product
from operator import attrgetter
from pathlib import Path
from textwrap import fill
from types import MappingProxyType
from typing import Any

import matplotlib
import numpy as np
import pandas
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.image import AxesImage
from matplotlib.textpath import TextPath
from matplotlib.ticker import MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from suave_des.arguments import plain_arguments
from suave_des.errors import InputError, number_of, shown, unknown
from suave_des.estimates import Estimate, mean_of
from suave_des.files import check_ending, write_file
from suave_des.records.metrics import METRICS, PAPER_METRICS, Metric
from suave_des.records.mission_folder import TRAJECTORY_FILE, MissionRecord, read_mission
from suave_des.records.missions import Missions, read_missions
from suave_des.results import style
from suave_des.results.groups import (
    Groups,
    check_swept,
    grouped,
)
from suave_des.results.horizon import FOUND_BY_HORIZON, horizons_s, to_horizon
from suave_des.results.independent import (
    Group,
    first_run_of_draw,
    independent,
    runs_per_draw,
    runs_per_draw_by_source,
)
from suave_des.results.mission import Rules, draw_map, draw_timeline
from suave_des.results.statistics import least_and_greatest
from suave_des.results.style import folded, handle, key_words, value_words

ENDINGS = (".png", ".pdf", ".svg")
_UNDATED = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
AUTO, MAP, TIMELINE, SWEEP, HEAT_MAP = "auto", "map", "timeline", "sweep", "heatmap"
DISTRIBUTIONS, DIFFERENCES = "distributions", "differences"
_ROW_IN = 0.62
"""Height of a row of a figure that has one for each pair of managers."""
_LEGEND_LINE_IN, _HANDLE_IN = 0.2, 0.6
"""Height of a line of a legend, and width of an entry without its text."""
_DOTS = 400
"""More differences are drawn as so many, evenly taken in the order of their values."""
_EACH_WITH_EACH = 4
"""More groups have too many pairs for one figure."""


def draw_distributions(drawn: Groups) -> style.Picture:
    """Draw the empirical distribution functions of search time and inspected distance, a curve for
    each group.
    """
    groups = drawn.groups
    labels = [*map(_label, groups), "markers on the axis: means"]
    rows = math.ceil(len(labels) / _legend_columns(labels))
    legend_in = _LEGEND_LINE_IN * rows * max(label.count("\n") + 1 for label in labels)
    figure = style.Picture(2.5 + legend_in)
    for axes, metric, title in _metric_panels(figure):
        ends = [_finite(group.frame[metric]).max() for group in groups]
        end = max(1.0, np.nanmax(ends) * 1.06)
        for number, group in _looks(groups):
            of_group = group.frame[metric]
            values = np.sort(_finite(of_group))
            shares = np.arange(1, len(values) + 1) / of_group.count()
            look = style.line(number)
            steps = [0.0, *shares, *shares[-1:]]
            axes.step(
                [0.0, *values, end][: len(steps)], steps, where="post", label=_label(group), **look
            )
            axes.plot(
                of_group.mean(),
                0.0,
                clip_on=False,
                zorder=5,
                marker=style.marker(number),
                color=look["color"],
                ms=5,
                mec="white",
                mew=0.5,
            )
        axes.set(xlabel=title, xlim=(0.0, end))
    times = figure.axes[0]
    is_any_lost = any((group.frame[FOUND_BY_HORIZON] < 1.0).any() for group in groups)
    if is_any_lost and math.isfinite(drawn.time_limit_s):
        times.axvline(drawn.time_limit_s, color=style.GREY, lw=0.7, ls=":", zorder=1)
        times.text(
            drawn.time_limit_s,
            0.03,
            "not found ",
            transform=times.get_xaxis_transform(),
            color="#555555",
            fontsize=7,
            rotation=90,
            ha="right",
            va="bottom",
        )
    times.set(ylabel="share of missions at or below", ylim=(0.0, 1.02))
    times.yaxis.set_major_formatter(PercentFormatter(1.0))
    curves = [
        handle(marker=style.marker(number), ms=3.5, **style.line(number))
        for number, _ in _looks(groups)
    ]
    _legend(
        figure,
        [*curves, handle(lw=0, marker="o", mfc="none", ms=4, color=style.GREY)],
        labels,
    )
    return figure


def draw_differences(drawn: Groups) -> style.Picture:
    """Draw the differences between groups run by run: each run, and the mean with its 95% interval.

    With more than four groups each is compared with the first one only.

    Raises:
        InputError: no two groups have runs that share their random numbers.
    """
    colours = {group.name: style.line(number)["color"] for number, group in _looks(drawn.groups)}
    rows = list(_apart(drawn.groups))
    if not rows:
        problem = "no two of these have runs that share their random numbers"
        raise InputError(
            problem,
            place="kind",
            remedy="give campaigns of two managers or more with the same seed",
        )
    height = _ROW_IN * len(rows) + 0.75 + _LEGEND_LINE_IN
    figure = style.Picture(height)
    is_of_runs = drawn.counted in ("mission", "run")
    for axes, metric, title in _metric_panels(figure):
        axes.axvline(0.0, color=style.BLACK, lw=0.8, zorder=1)
        for row, (one, _, apart) in enumerate(rows):
            _draw_row_of_differences(
                axes, row, apart[metric], colours[one.name], has_numbers=is_of_runs
            )
        axes.set_xlabel(f"difference in {title}")
        axes.margins(x=0.22)
        axes.grid(axis="y", visible=False)
    left = figure.axes[0]
    names = [
        f"{one.name}\n\N{MINUS SIGN} {other.name} (n = {len(apart[PAPER_METRICS[0]]):,})"
        for one, other, apart in rows
    ]
    left.set_yticks(range(len(rows)), [style.text(folded(name)) for name in names])
    left.set_ylim(len(rows) - 0.4, -0.6)
    mean = handle(lw=1.2, marker="D", ms=3, mfc="white", color=style.BLACK)
    each = handle(color=style.GREY, marker="o", ms=2.5, lw=0)
    _legend(figure, [mean, each], ["mean, 95% interval", "run" if is_of_runs else drawn.counted])
    return figure


def _apart(
    groups: Sequence[Group],
) -> Iterator[tuple[Group, Group, dict[str, pandas.Series[float]]]]:
    """Yield pairs of groups with the differences of their common runs, by metric."""
    if len(groups) <= _EACH_WITH_EACH:
        pairs = list(combinations(groups, 2))
    else:
        pairs = [(one, groups[0]) for one in groups[1:]]
    for one, other in pairs:
        if one.has_runs and other.has_runs:
            apart = {name: _finite(one.frame[name] - other.frame[name]) for name in PAPER_METRICS}
            if all(map(len, apart.values())):
                yield one, other, apart


def _draw_row_of_differences(
    axes: Axes, row: int, apart: pandas.Series[float], colour: str, *, has_numbers: bool
) -> None:
    values = apart.sort_values(kind="stable").to_numpy()
    rain = values[np.unique(np.linspace(0, len(values) - 1, _DOTS).astype(int))]
    # Spread over a height by the golden ratio, without random numbers: equal data give equal
    # figures.
    beside = 0.24 * ((np.arange(len(rain)) * (math.sqrt(5.0) - 1.0) / 2.0) % 1.0)
    axes.plot(rain, row + 0.08 + beside, "o", color=colour, ms=2.4, alpha=0.6, mew=0)
    found = mean_of(values.tolist())
    errors = [[found.value - found.low], [found.high - found.value]] if found.has_interval else None
    axes.errorbar(
        found.value,
        row - 0.1,
        xerr=errors,
        color="k",
        fmt="D",
        ms=3,
        mfc="white",
        mew=0.8,
        elinewidth=1.2,
        capsize=2.5,
    )
    runs = apart.index.get_level_values("run").to_numpy(float)
    extremes = least_and_greatest(np.array(apart, dtype=np.float64), runs)
    ends = zip(extremes, (("right", -4), ("left", 4)), strict=True)
    for (value, run), (side, shift) in ends if has_numbers else ():
        axes.annotate(
            f"run {run}",
            (value, row + 0.2),
            (shift, 0),
            textcoords="offset points",
            ha=side,
            va="center",
            fontsize=6.5,
            # lest the line at 0 cross the label
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
        )


def _metric_panels(figure: style.Picture) -> Iterator[tuple[Axes, str, str]]:
    """Make the panels a and b for the metrics of the paper's table; yield each with its metric, and
    the axis' title.
    """
    panels = figure.subplots(1, 2, sharey=True)
    for axes, letter, metric in zip(panels, "ab", PAPER_METRICS, strict=True):
        axes.set_title(f"{letter}   {METRICS[metric].title.capitalize()}")
        yield axes, metric, METRICS[metric].heading


def _looks(groups: Sequence[Group]) -> Iterator[tuple[int, Group]]:
    return zip(style.looks([group.name for group in groups]), groups, strict=True)


def _finite(values: pandas.Series[float]) -> pandas.Series[float]:
    return values[np.isfinite(values)]


def _label(group: Group) -> str:
    """Name a group with its number of missions, and of draws where several missions share one."""
    frame = group.frame
    text = f"n = {len(frame):,}"
    per_draw = runs_per_draw(frame)
    if group.is_of_missions and group.has_runs and per_draw > 1:
        draws = len(set(zip(frame["seed"], first_run_of_draw(frame, per_draw), strict=True)))
        text = f"{text} in {number_of(draws, 'draw')}"
    return style.text(folded(f"{group.name} ({text})"))


def _legend(
    figure: style.Picture, handles: Sequence[Artist], labels: Sequence[str], most: int = 4
) -> None:
    """Draw a legend above the panels, in so many columns at most."""
    columns = min(most, _legend_columns(labels))
    figure.legend(handles, labels, loc="outside upper right", ncols=columns, handlelength=2.8)


def _legend_columns(labels: Sequence[str]) -> int:
    """Return the number of columns with which a legend fits the width of a figure."""
    font = FontProperties(size=matplotlib.rcParams["legend.fontsize"])
    widths_in = []
    for label in labels:
        parts = [TextPath((0.0, 0.0), part, prop=font) for part in label.split("\n")]
        widths_in.append(_HANDLE_IN + max(part.get_extents().x1 for part in parts) / 72.0)
    for columns in range(len(labels) if len(labels) <= 4 else 3, 1, -1):
        if sum(max(column) for column in np.array_split(widths_in, columns)) <= style.WIDTH_IN:
            return columns
    return 1


# Sweeps

_MOST_PARAMETERS = 3
_MOST_CELLS = 10
"""Values of a parameter in a heat map."""
_MOST_WITH_DECIMALS = 6
"""Columns of a heat map; in more there is room for whole numbers only."""
_MOST_VALUES = 16
"""A parameter with more values is a sampled one: its missions are drawn in so many bins of equal
numbers at most.
"""
_BINS = 8
_MOST_TICKS = 6
"""With more swept values, or where two are closer than so many would be, the axis has round numbers
instead.
"""
_APART = 0.012
"""Between managers at the same value, as a share of the axis, so that their intervals do not hide
each other.
"""


def draw_sweep(missions: Missions, parameters: Sequence[str] = ()) -> style.Picture:
    """Draw means with their 95% intervals over each parameter, the others averaged over, a line for
    each manager.

    All points of a sweep share the random numbers of a run, so that the runs are the independent
    values: intervals are those of the means that each run has over the points.

    Args:
        missions: of a sweep.
        parameters: to draw; empty: all that are swept.

    Raises:
        InputError: one of them is not swept, or there are too many for one figure.
    """
    parameters = _chosen(missions, parameters)
    if len(parameters) > _MOST_PARAMETERS:
        problem = (
            f"{len(parameters)} parameters do not fit into one figure: {', '.join(parameters)}"
        )
        raise InputError(
            problem, place="parameters", remedy=f"choose {_MOST_PARAMETERS} or fewer of them"
        )
    frame = missions.frame.assign(curve=_names)
    columns = len(parameters)
    width_in = style.WIDTH_IN if columns > 1 else style.WIDTH_IN / 2
    height_in = 4.0 + 0.2 * math.ceil((frame["curve"].nunique() + 1) / 3)
    figure = style.Picture(height_in, width_in)
    panels = figure.subplots(len(PAPER_METRICS), columns, sharex="col", sharey="row", squeeze=False)
    counts: list[int] = []
    for row, metric in zip(panels, PAPER_METRICS, strict=True):
        for axes, parameter in zip(row, parameters, strict=True):
            counts += _draw_panel(axes, frame, missions.swept, parameter, metric)
        row[0].set_ylabel(f"mean {METRICS[metric].heading}")
        row[0].set_ylim(bottom=0.0)
    for axes, parameter in zip(panels[-1], parameters, strict=True):
        axes.set_xlabel(_folded(key_words(parameter)))
    handles, labels = panels[0, 0].get_legend_handles_labels()
    handles.append(handle(lw=0, marker="|", ms=8, color=style.GREY))
    labels.append("95% interval of the mean")
    _legend(figure, handles, labels, 3 if columns > 1 else 2)
    others = [name for name in missions.swept if name not in parameters]
    below = _averaged(frame, counts, others)
    if len(missions.swept) == columns > 1:
        below += ", each averaged over the parameters of the other panels"
    _write_below(figure, below)
    return figure


def draw_heat_map(missions: Missions, parameters: Sequence[str] = ()) -> style.Picture:
    """Draw means over two swept parameters as numbers in a grid, with half their 95% intervals, a
    row of panels for each manager.

    Args:
        missions: of a sweep; other swept parameters are averaged over.
        parameters: across and up; empty: the two that are swept.

    Raises:
        InputError: one of them is not swept, there are not two, or their values are too many for
            numbers.
    """
    parameters = _chosen(missions, parameters)
    if len(parameters) != 2:
        problem = f"a heat map is of two swept parameters, and there are {len(parameters)}: {', '.join(parameters)}"
        raise InputError(problem, place="parameters", remedy="choose two with --parameters")
    across, up = parameters
    frame = missions.frame.assign(curve=_names)
    managers = list(dict.fromkeys(frame["curve"]))
    others = [name for name in missions.swept if name not in parameters]
    brought = to_horizon(frame, horizons_s(frame, missions.swept, parameters))
    cells = {
        (curve, *values): rows
        for curve, values, rows in _independent_at(brought, [up, across], others)
    }
    rows = _in_order(frame[up])
    columns = _in_order(frame[across])
    if max(len(rows), len(columns)) > _MOST_CELLS:
        problem = f"{len(columns)} by {len(rows)} means are too many for numbers"
        remedy = f"sweep {_MOST_CELLS} values or fewer, or draw them with --kind sweep"
        raise InputError(problem, place="parameters", remedy=remedy)
    height = len(managers) * (0.34 * len(rows) + 0.3) + 0.9
    figure = style.Picture(height)
    panels = figure.subplots(len(managers), 2, sharex=True, sharey=True, squeeze=False)
    for metric, of_metric in zip(PAPER_METRICS, panels.T, strict=True):
        means = {key: _mean(runs[metric]) for key, runs in cells.items()}
        values = list(map(attrgetter("value"), means.values()))
        ends = np.nanmin(values), np.nanmax(values)
        for axes, manager in zip(of_metric, managers, strict=True):
            grid = [means.get((manager, *place), Estimate()) for place in product(rows, columns)]
            shaped = np.array(grid).reshape(len(rows), len(columns))
            image = _draw_grid(axes, shaped, METRICS[metric], ends)
            axes.set_title(style.text(folded(manager)))
        figure.colorbar(image, ax=of_metric, label=_folded(f"mean {METRICS[metric].heading}", 20))
        lowest = of_metric[-1]
        lowest.set_xlabel(_folded(key_words(across)))
        lowest.set_xticks(range(len(columns)), _ticks(columns))
        lowest.set_yticks(range(len(rows)), _ticks(rows))
    figure.supylabel(_folded(key_words(up)), fontsize=panels[0, 0].yaxis.label.get_fontsize())
    counts = list(map(len, cells.values()))
    _write_below(figure, f"{_averaged(frame, counts, others)}; ± half their 95% intervals")
    return figure


def _in_order(parameter: pandas.Series) -> list[Any]:
    """Return the values of a parameter: numbers by size, words in the order of the sweep."""
    values = list(pandas.unique(parameter))
    return values if isinstance(values[0], str) else sorted(values)


def _draw_grid(
    axes: Axes, grid: NDArray[np.object_], metric: Metric, ends: tuple[float, float]
) -> AxesImage:
    """Draw means as numbers on their colours, which reach from one end to the other."""
    low, high = ends
    text = metric.number if grid.shape[1] <= _MOST_WITH_DECIMALS else "{:.0f}".format
    values = np.vectorize(attrgetter("value"), otypes=[float])(grid)
    image = axes.imshow(values, cmap="cividis", vmin=low, vmax=high, aspect="auto", origin="lower")
    for (row, column), mean in np.ndenumerate(grid):
        ink = "white" if mean.value < (low + high) / 2.0 else style.BLACK
        look: style.Look = {"color": ink, "ha": "center"}
        number = text(mean.value) if np.isfinite(mean.value) else ""
        if mean.has_interval:
            half = f"±{text((mean.high - mean.low) / 2.0)}"
            axes.text(column, row + 0.02, number, va="bottom", fontsize=6.5, **look)
            axes.text(column, row - 0.04, half, va="top", fontsize=5.5, **look)
        else:
            axes.text(column, row, number, va="center", fontsize=6.5, **look)
    axes.grid(visible=False)
    return image


def _ticks(values: Sequence[object]) -> list[str]:
    return [_folded(style.text(value_words(value)), 14) for value in values]


def _chosen(missions: Missions, parameters: Sequence[str]) -> list[str]:
    if not missions.swept:
        problem = "nothing is swept in these results"
        raise InputError(problem, place="kind", remedy="give a campaign with a sweep")
    parameters = list(parameters or missions.swept)
    check_swept(missions, parameters, "parameters")
    for source, part in missions.frame.groupby("source", sort=False):
        if fixed := [name for name in parameters if part[name].isna().all()]:
            problem = f"{source} does not sweep {', '.join(fixed)}, and another folder does"
            remedy = f"leave {source} out, draw --kind distributions, or choose with --parameters what all sweep"
            raise InputError(problem, place="parameters", remedy=remedy)
    return parameters


def _averaged(frame: pandas.DataFrame, counts: Sequence[int], others: Sequence[str]) -> str:
    """Say of how many runs, or draws that runs share, means are, and over what each is averaged."""
    low = min(counts)
    high = max(counts)
    per_draw = max(runs_per_draw_by_source(frame).values(), default=1)
    what = "run" if per_draw == 1 else "draw"
    of = f"means of n = {low if low == high else f'{low} to {high}'} {what}{'s' * (high > 1)}"
    if per_draw > 1:
        of += f" of {per_draw} runs"
    return f"{of}, each averaged over {', '.join(map(key_words, others))}" if others else of


def _write_below(figure: Figure, text: str) -> None:
    figure.supxlabel(fill(text, int(16 * figure.get_figwidth())), fontsize=7.5, color="#555555")


def _names(frame: pandas.DataFrame) -> pandas.Series[str]:
    """Name the curve of each mission: its manager, with its source where there are several."""
    return frame["manager"] + (
        " (" + frame["source"] + ")" if frame["source"].nunique() > 1 else ""
    )


def _independent_at(
    frame: pandas.DataFrame, keys: Sequence[str], averaged: Sequence[str]
) -> Iterator[tuple[str, tuple[Any, ...], pandas.DataFrame]]:
    """Yield each curve at each value of some columns, with what is independent there: runs averaged
    over other parameters, or draws of several runs, that are complete.

    Raises:
        InputError: none is.
    """
    per_draw = runs_per_draw_by_source(frame)
    is_empty = True
    for _, source in frame.groupby("source", sort=False, observed=True):
        for values, whole in source.groupby(list(keys), dropna=False, observed=True):
            for curve, part in whole.groupby("curve", sort=False, observed=True):
                rows = independent(part, whole, averaged, per_draw).rows
                if len(rows):
                    is_empty = False
                    yield str(curve), values, rows
    if is_empty:
        problem = "no manager has a run with missions at all points of the sweep"
        raise InputError(problem, place="parameters", remedy="resume the campaign")


def _mean(values: pandas.Series[float]) -> Estimate:
    """Estimate a mean; not known if one of the values is infinite."""
    return Estimate() if np.isinf(values).any() else mean_of(values.dropna().tolist())


def _draw_panel(
    axes: Axes, frame: pandas.DataFrame, swept: Sequence[str], parameter: str, metric: str
) -> list[int]:
    """Draw the means of each curve over a parameter, and return of how many runs they are.

    Very many places are drawn in bins of equally many, at their mean place.
    """
    places, words = _places(frame[parameter])
    bins = places
    averaged = [name for name in swept if name != parameter]
    if places.nunique() > _MOST_VALUES:
        bins = pandas.qcut(places.rank(method="dense"), _BINS, labels=False)
        averaged = list(swept)
    brought = to_horizon(frame, horizons_s(frame, swept, [parameter]))
    brought = brought.assign(place=places, bin=bins)
    apart = _APART * float(places.max() - places.min())
    curves: dict[str, list[tuple[float, Estimate]]] = {name: [] for name in frame["curve"]}
    counts = []
    middles = brought.groupby(["curve", "bin"])["place"].mean()
    for curve, (place,), rows in _independent_at(brought, ["bin"], averaged):
        curves[curve].append((float(middles[curve, place]), _mean(rows[metric])))
        counts.append(int(rows[metric].count()))
    for place, (number, curve) in enumerate(zip(style.looks(list(curves)), curves, strict=True)):
        beside = (place - (len(curves) - 1) / 2) * apart
        _draw_means(axes, curves[curve], beside, number, curve)
    _set_ticks(axes, places, words)
    return counts


def _set_ticks(axes: Axes, places: pandas.Series[float], words: Sequence[str]) -> None:
    """Mark swept words, or the swept values if there are few, on the horizontal axis."""
    if words:
        long = max(map(len, words)) > 6 and len(words) > 2
        axes.set_xticks(
            range(len(words)),
            _ticks(words),
            rotation=30 if long else 0,
            ha="right" if long else "center",
        )
        axes.set_xlim(-0.5, len(words) - 0.5)
    elif (
        1 < len(values := np.unique(places)) <= _MOST_TICKS
        and np.diff(values).min() > np.ptp(values) / _MOST_TICKS
    ):
        axes.set_xticks(values, [f"{value:g}" for value in values])
    else:
        axes.xaxis.set_major_locator(MaxNLocator(4))


def _places(parameter: pandas.Series) -> tuple[pandas.Series[float], list[str]]:
    """Place missions on the horizontal axis: at the value, or at the number of the word in the
    order of the sweep.
    """
    if pandas.api.types.is_numeric_dtype(parameter) and not pandas.api.types.is_bool_dtype(
        parameter
    ):
        return parameter.astype(float), []
    codes, words = pandas.factorize(parameter)
    return pandas.Series(codes, parameter.index, dtype=float), [str(word) for word in words]


def _draw_means(
    axes: Axes, means: Sequence[tuple[float, Estimate]], beside: float, number: int, label: str
) -> None:
    """Draw means, each at its place, with their intervals."""
    middles = [place + beside for place, _ in means]
    values = np.array([found.value for _, found in means])
    ends = [found.interval or (found.value, found.value) for _, found in means]
    low, high = np.array(ends).reshape(-1, 2).T
    look = style.line(number) | {
        "marker": style.marker(number),
        "ms": 3.2,
        "capsize": 2,
        "elinewidth": 0.8,
    }
    errors = (values - low, high - values)
    axes.errorbar(middles, values, yerr=errors, label=style.text(folded(label)), **look)


def _folded(text: str, width: int = 26) -> str:
    return fill(text, width, break_long_words=False)


# What is drawn


@plain_arguments
def draw_folder(folder: str | Path, out: str | Path) -> None:
    """Draw the contents of a results folder, and write the picture; see draw_results.

    Example:
        draw_folder("simulated", "simulated.pdf")
    """
    draw_results([Path(folder)], Path(out))


@style.publication()
def draw_results(
    folders: Sequence[Path],
    out: Path,
    kind: str = AUTO,
    parameters: Sequence[str] = (),
    rules_of: Callable[[MissionRecord], Rules] = lambda record: {},
    labels: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """Draw the contents of results folders, and write the picture.

    Args:
        folders: one of a mission (trajectory.csv), or of campaigns (runs.csv) and files like these.
        out: picture to write, .png, .pdf or .svg.
        kind: of the figure; "auto": of a mission its map, of a campaign the distributions, of a
            sweep the means.
        parameters: of a sweep: those to draw; empty: all.
        rules_of: finds the rules behind the adaptations of a mission, for its timeline.
        labels: of a campaign: what to show instead of the name of a manager.

    Raises:
        InputError: there are no results of that kind in the folders, or the picture cannot be
            written.
    """
    check_picture(out)
    if not (folders[0] / TRAJECTORY_FILE).is_file():
        figure = draw_missions(read_missions(folders, labels), kind, parameters)
    elif len(folders) > 1:
        raise InputError(
            "has a mission, of which one is drawn at a time",
            file=folders[0],
            remedy="give one folder",
        )
    else:
        record = read_mission(folders[0])
        figure = draw_mission(
            record, MAP if kind == AUTO else kind, rules_of(record) if kind == TIMELINE else {}
        )
    write_picture(figure, out)


def check_picture(out: Path) -> None:
    """Raise an InputError if a file has not the ending of a picture."""
    check_ending(out, ENDINGS, "a picture")


def write_picture(figure: Figure, out: Path, *, bbox_inches: str | None = None) -> None:
    """Write a figure atomically, and without the time of writing; bbox_inches "tight" trims it to
    what is drawn.

    Raises:
        InputError: it cannot be written.
    """
    picture = io.BytesIO()
    metadata = _UNDATED.get(out.suffix.lower())
    figure.savefig(
        picture, format=out.suffix[1:].lower(), bbox_inches=bbox_inches, metadata=metadata
    )
    write_file(out, picture.getvalue())


@style.publication()
def draw_mission(
    record: MissionRecord, kind: str = MAP, rules: Rules = MappingProxyType({})
) -> Figure:
    """Draw a mission's MAP or TIMELINE, with the rules behind its adaptations.

    Raises:
        InputError: there is no such figure of a mission.
    """
    if kind not in (MAP, TIMELINE):
        raise unknown(
            f"there is no figure {shown(kind)} of a mission", kind, (MAP, TIMELINE), place="kind"
        )
    return draw_timeline(record, rules) if kind == TIMELINE else draw_map(record)


def _check_kind(kind: str) -> None:
    """Check that a figure is one of campaigns without a sweep."""
    if kind in (MAP, TIMELINE):
        remedy = "give a folder that suave-des run --out has written"
        raise InputError(f"{kind} is a figure of one mission", place="kind", remedy=remedy)
    if kind not in (AUTO, DISTRIBUTIONS, DIFFERENCES):
        known = (DISTRIBUTIONS, DIFFERENCES, SWEEP, HEAT_MAP)
        raise unknown(f"there is no figure {shown(kind)} of a campaign", kind, known, place="kind")


@style.publication()
def draw_missions(missions: Missions, kind: str = AUTO, parameters: Sequence[str] = ()) -> Figure:
    """Draw missions: the means of a sweep, or of others the distributions, unless another kind is
    asked for.

    Raises:
        InputError: there is no such figure of a campaign, or the missions lack what it needs.
    """
    if kind == HEAT_MAP:
        return draw_heat_map(missions, parameters)
    if kind == SWEEP or (kind == AUTO and missions.swept):
        return draw_sweep(missions, parameters)
    if parameters:
        raise InputError(
            "parameters are those of a sweep", place="parameters", remedy="leave them out"
        )
    _check_kind(kind)
    is_of_means = kind == DIFFERENCES
    groups = grouped(missions, averages=is_of_means)
    figure = draw_differences(groups) if is_of_means else draw_distributions(groups)
    if missions.swept:
        swept = ", ".join(map(key_words, missions.swept))
        shown_are = "means of each run over" if is_of_means else "missions at"
        _write_below(figure, f"{shown_are} all points of the sweep: {swept}")
    return figure
