"""Figures of a campaign's missions, with a curve, cloud or panel for each manager."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence

import matplotlib
import numpy as np
import pandas
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.textpath import TextPath
from matplotlib.ticker import MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from suave_des.estimates import GroupedMean, percent, t_quantile
from suave_des.report import style
from suave_des.report.compared_metrics import PAPER_METRICS
from suave_des.report.grouping import Group, first_alike, runs_sharing_draw, time_limit_s
from suave_des.report.words import folded

_ROW_IN = 0.62
"""Height of a row of a figure that has one for each manager."""
_LEGEND_LINE_IN, _HANDLE_IN = 0.2, 0.6
"""Height of a line of a legend, and width of an entry without its text."""
_DOTS = 400
"""More missions are drawn as so many, evenly taken in the order of their values."""
_MOST_KERNELS = 10_000
_DENSITY_BINS = 3_000
"""More missions than _MOST_KERNELS are counted in so many bins before their density is estimated."""
_CURVE_POINTS = 2_000
"""A curve over more runs is drawn through so many of them: it looks the same, and is written at once."""
_FEWEST_FOR_CLOUD = 5
_FEWEST_FOR_INTERVAL = 5
_LARGEST_AREA = 900.0
"""Area of a marker, in square points, that would stand for all missions of a manager."""
_TIME_BIN_S = 5.0
_LEGEND_SHARE = 0.1
_FAR_APART = 50.0
"""Reaction times that differ by more than this factor are drawn on a logarithmic axis."""


def draw_distributions(groups: Sequence[Group]) -> style.Picture:
    """Draw the empirical distribution functions of search time and inspected distance, a curve for each group."""
    labels = [*map(_label, groups), "marks at 0%: means"]
    figure = style.Picture(figsize=(style.WIDTH_IN, 2.5 + _legend_height(labels)), layout="constrained")
    limit_s = _limit_of_lost(groups)
    for axes, metric, title in _metric_panels(figure, sharey=True):
        end = max(1.0, max(float(group.known_values(metric).max()) for group in groups) * 1.06)
        for number, group in _looks(groups):
            values = np.sort(group.known_values(metric))
            shares = np.arange(1, len(values) + 1) / len(values)
            look = style.line(number)
            axes.step([0.0, *values, end], [0.0, *shares, 1.0], where="post", label=_label(group), **look)
            mark = {"marker": style.marker(number), "color": look["color"], "ms": 5, "mec": "white", "mew": 0.5}
            axes.plot(float(values.mean()), 0.0, clip_on=False, zorder=5, **mark)
        axes.set(xlabel=title, xlim=(0.0, end))
        if metric == "search_time_s" and limit_s is not None:
            axes.axvline(limit_s, color=style.GREY, lw=0.7, ls=":", zorder=1)
            axes.text(limit_s, 0.03, "not found ", color="#555555", fontsize=7, rotation=90, ha="right", va="bottom")
    figure.axes[0].set(ylabel="share of missions at or below", ylim=(0.0, 1.02))
    figure.axes[0].yaxis.set_major_formatter(PercentFormatter(1.0))
    handles = [*_handles(groups), Line2D([], [], lw=0, marker="o", mfc="none", ms=4, color=style.GREY)]
    _legend(figure, handles, labels)
    return figure


def _limit_of_lost(groups: Sequence[Group]) -> float | None:
    """Return the end of missions that never found the pipeline; None if all found it."""
    return time_limit_s(groups) if any((group.values("pipeline_found") < 1.0).any() for group in groups) else None


def draw_rainclouds(groups: Sequence[Group], published: Mapping[str, Group]) -> style.Picture:
    """Draw for each group a cloud (density), a box (quartiles, median, mean) and rain (missions).

    Args:
        groups: to draw, a row for each.
        published: real missions to show beside a group, by its name.
    """
    height = _ROW_IN * len(groups) + 0.55 + _LEGEND_LINE_IN
    figure = style.Picture(figsize=(style.WIDTH_IN, height), layout="constrained")
    for axes, metric, title in _metric_panels(figure, sharey=True):
        for row, (number, group) in enumerate(_looks(groups)):
            _raincloud(axes, row, number, group, metric, published.get(group.name))
        axes.set_xlabel(title)
        axes.set_xlim(left=0.0)
    left = figure.axes[0]
    left.set_yticks(range(len(groups)), [_label(group) for group in groups])
    left.set_ylim(len(groups) - 0.45, -0.6)
    limit_s = _limit_of_lost(groups)
    if limit_s is not None:
        left.axvline(limit_s, color=style.GREY, lw=0.7, ls=":", zorder=1)
        left.annotate(
            "not found",
            (limit_s, 1.0),
            (-2, -1),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            fontsize=7,
            color="#555555",
            ha="right",
            va="top",
        )
    handles: list[Artist] = [
        Patch(facecolor="#BBBBBB", label="density"),
        Line2D([], [], color=style.BLACK, lw=4, alpha=0.35, label="quartiles"),
        Line2D([], [], color=style.BLACK, marker="|", ms=8, lw=0, label="median"),
        Line2D([], [], color=style.BLACK, marker="D", ms=3, mfc="white", lw=0, label="mean"),
        Line2D([], [], color=style.GREY, marker="o", ms=2, lw=0, label="mission"),
    ]
    if published:
        handles.append(Line2D([], [], color=style.BLACK, marker="x", ms=4, lw=0, label="published run"))
    _legend(figure, handles, [str(handle.get_label()) for handle in handles])
    return figure


def _raincloud(axes: Axes, row: int, number: int, group: Group, metric: str, published: Group | None) -> None:
    values = np.sort(group.known_values(metric))
    colour = style.line(number)["color"]
    if len(values) >= _FEWEST_FOR_CLOUD and np.ptp(values) > 0.0:
        grid = np.linspace(values[0], values[-1], 300)
        heights = _density(values, grid)
        heights *= 0.38 / heights.max()
        axes.fill_between(
            grid, row - 0.12 - heights, row - 0.12, color=colour, alpha=0.55, lw=0, hatch=style.hatch(number)
        )
        axes.plot(grid, row - 0.12 - heights, color=colour, lw=0.8)
    low, median, high = np.percentile(values, (25, 50, 75))
    axes.plot([low, high], [row, row], color=style.BLACK, lw=4, alpha=0.35, solid_capstyle="butt")
    axes.plot(median, row, color=style.BLACK, marker="|", ms=8)
    axes.plot(values.mean(), row, color=style.BLACK, marker="D", ms=3, mfc="white", mew=0.7)
    rain = values if len(values) <= _DOTS else values[np.linspace(0, len(values) - 1, _DOTS).astype(int)]
    axes.plot(rain, row + 0.1 + _jitter(len(rain), 0.12), "o", color=colour, ms=1.6, alpha=0.6, mew=0)
    if published is not None:
        real = np.sort(published.known_values(metric))
        axes.plot(real, row + 0.3 + _jitter(len(real), 0.06), "x", color=style.BLACK, ms=2.8, mew=0.7)


def _density(values: NDArray[np.float64], grid: NDArray[np.float64]) -> NDArray[np.float64]:
    """Estimate the density of values at the points of a grid.

    The kernel is narrow, so that the clusters of search times, a turn of the spiral each, stay apart.
    """
    from scipy.stats import gaussian_kde

    bandwidth = 0.6 * len(values) ** -0.2
    if len(values) <= _MOST_KERNELS:
        return np.asarray(gaussian_kde(values, bw_method=bandwidth)(grid))
    counts, edges = np.histogram(values, bins=_DENSITY_BINS)
    middles = (edges[:-1] + edges[1:]) / 2.0
    return np.asarray(gaussian_kde(middles, bw_method=bandwidth, weights=counts)(grid))


def _jitter(number: int, height: float) -> NDArray[np.floating]:
    """Spread points evenly over a height by the golden ratio: no random numbers, equal data give equal figures."""
    places: NDArray[np.floating] = height * ((np.arange(number) * (math.sqrt(5.0) - 1.0) / 2.0) % 1.0)
    return places


def draw_convergence(groups: Sequence[Group]) -> style.Picture:
    """Draw the mean of the first n runs and its 95% interval over n, a curve for each group."""
    labels = [*map(_label, groups), "95% interval of the mean"]
    figure = style.Picture(figsize=(style.WIDTH_IN, 2.5 + _legend_height(labels)), layout="constrained")
    for axes, metric, title in _metric_panels(figure):
        for number, group in _looks(groups):
            frame = group.frame.sort_values("run", kind="stable")
            known = frame[frame[metric].notna()]
            alike = runs_sharing_draw(known)
            draws = first_alike(known, alike).astype(int).tolist() if alike > 1 else None
            n, means, halves = running_means(known[metric].to_numpy(float), draws)
            look = style.line(number)
            (line,) = axes.plot(n, means, label=_label(group), **look)
            if len(n) == 1:
                line.set(marker=style.marker(number), ms=5, clip_on=False)
            low, high = means - halves, means + halves
            axes.fill_between(n, low, high, where=n >= _FEWEST_FOR_INTERVAL, color=look["color"], alpha=0.18, lw=0)
        shares = any(runs_sharing_draw(group.frame) > 1 for group in groups)
        axes.set(xlabel=f"number of {'draws' if shares else 'runs'}", ylabel=f"mean {title}")
        axes.set_xlim(left=1.0)
        axes.set_ylim(bottom=0.0)
        axes.xaxis.set_major_locator(MaxNLocator(6, integer=True, min_n_ticks=1))
        axes.xaxis.set_major_formatter("{x:,.0f}")
    _legend(figure, [*figure.axes[0].lines, Patch(color=style.GREY, alpha=0.3)], labels)
    return figure


def running_means(
    values: NDArray[np.float64], draws: Sequence[int] | None = None
) -> tuple[NDArray[np.int_], NDArray[np.float64], NDArray[np.float64]]:
    """Return sample sizes n, the means of the first n values, and half their 95% intervals.

    Of many values only some numbers are there, the first and the last among them, as dense at the beginning as a
    figure over all shows them. If `draws` has the number of each value's draw, the draws are what is independent.
    """
    n = np.arange(1, len(values) + 1)
    if len(values) > _CURVE_POINTS:
        half = _CURVE_POINTS // 2
        n = np.unique(np.r_[np.geomspace(1, len(values), half), np.linspace(1, len(values), half)].round().astype(int))
    first = pandas.Series(values).expanding()
    stds = first.std().to_numpy()[n - 1]  # nan for a single value, which has no interval
    halves = np.array([t_quantile(int(each) - 1) for each in n]) * stds / np.sqrt(n)
    if draws is not None:
        halves = np.array(list(_half_widths(values.tolist(), draws, set(n.tolist()))))
    return n, first.mean().to_numpy()[n - 1], halves


def _half_widths(values: Sequence[float], draws: Sequence[int], wanted: Container[int]) -> Iterator[float]:
    """Yield half the widths of the intervals of the first n values, for each n wanted; nan for one draw."""
    mean = GroupedMean()
    for value, draw in zip(values, draws, strict=True):
        mean.add(value, draw)
        if mean.n in wanted:
            half_width = mean.half_width
            yield math.nan if half_width is None else half_width


def draw_detections(groups: Sequence[Group]) -> style.Picture:
    """Draw when missions found the pipeline against the point of it that they saw first, a panel for each group.

    Areas are shares of the group's missions; the bars above are shares by that point.
    """
    columns = style.columns(len(groups))
    rows = math.ceil(len(groups) / columns)
    width = style.WIDTH_IN if columns > 1 else style.WIDTH_IN / 2
    figure = style.Picture(figsize=(width, 2.6 * rows + 0.4), layout="constrained")
    parts = figure.subfigures(rows, columns, squeeze=False).ravel()
    known = pandas.concat([group.frame.loc[group.frame["detection_x_m"].notna()] for group in groups])
    ends = (
        [float(known["detection_x_m"].min()) - 0.7, float(known["detection_x_m"].max()) + 0.7] if len(known) else [0, 1]
    )
    top_s = max(float(group.known_values("search_time_s").max()) for group in groups) * 1.2
    bars = []
    for place, (part, (number, group)) in enumerate(zip(parts, _looks(groups), strict=False)):
        above, below = part.subplots(2, 1, sharex=True, height_ratios=(1.0, 3.0))
        _draw_detections(above, below, number, group)
        bars.append(above)
        above.set_title(_label(group, 26), fontsize=8)
        below.set(xlim=ends, ylim=(0.0, top_s), xlabel="x of the point seen first (m)")
        if place % columns == 0:
            below.set_ylabel("search time (s)")
            above.set_ylabel("share")
    top = max(above.get_ylim()[1] for above in bars)
    for above in bars:
        above.set_ylim(0.0, top)  # shares of one panel are to be compared with those of another
    size = _LEGEND_SHARE**0.5 * _LARGEST_AREA**0.5
    area = Line2D([], [], lw=0, marker="o", ms=size, color=style.GREY, alpha=0.6, mew=0)
    figure.legend([area], [f"area: {percent(_LEGEND_SHARE)} of a manager's missions"], loc="outside lower right")
    return figure


def _draw_detections(above: Axes, below: Axes, number: int, group: Group) -> None:
    frame = group.frame[group.frame["detection_x_m"].notna()]
    colour, n = style.line(number)["color"], len(group.frame)
    x_m = frame["detection_x_m"].round(2)
    shares = x_m.value_counts() / n
    above.bar(shares.index.to_numpy(float), shares.to_numpy(float), width=0.4, color=colour, lw=0)
    above.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    above.yaxis.set_major_locator(MaxNLocator(2))
    times_s = (frame["search_time_s"] / _TIME_BIN_S).round() * _TIME_BIN_S
    counts = frame.groupby([x_m, times_s]).size()
    places = counts.index.to_frame().to_numpy(float)
    areas = np.maximum(counts.to_numpy(float) / n * _LARGEST_AREA, 1.5)
    below.scatter(places[:, 0], places[:, 1], s=areas, color=colour, alpha=0.6, lw=0)
    lost = 1.0 - len(frame) / n
    below.set_title(f"not found: {percent(lost)}", fontsize=7.5, fontweight="normal", pad=3)  # above all bubbles


def draw_reactions(groups: Sequence[Group]) -> style.Picture:
    """Draw the number of adaptations per mission, and the reaction times, with a curve for each group."""
    figure = style.Picture(
        figsize=(style.WIDTH_IN, 2.5 + _legend_height(list(map(_label, groups)))), layout="constrained"
    )
    left, right = figure.subplots(1, 2)
    for number, group in _looks(groups):
        look = style.line(number)
        if "adaptations" in group.frame and len(counts := group.known_values("adaptations")):
            missions = np.bincount((counts - counts.min()).astype(int))  # 0 where no mission has a number
            numbers = counts.min() + np.arange(len(missions))
            left.plot(numbers, missions / len(counts), marker=style.marker(number), ms=3.5, label=_label(group), **look)
        times_s = np.sort(group.known_values("mean_reaction_time_s"))
        if len(times_s):
            shares = np.arange(1, len(times_s) + 1) / len(times_s)
            right.step([times_s[0], *times_s], [0.0, *shares], where="post", **look)
        else:
            right.plot([], [], **look)
    left.set(xlabel="adaptations in a mission", ylabel="share of missions")
    left.set_ylim(bottom=0.0)
    left.yaxis.set_major_formatter(PercentFormatter(1.0))
    left.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    left.set_title("a   Adaptations")
    right.set(
        xlabel="mean reaction time, where there was one (s)", ylabel="share of missions at or below", ylim=(0.0, 1.02)
    )
    known = np.concatenate([group.known_values("mean_reaction_time_s") for group in groups])
    if len(known) and known.min() > 0.0 and known.max() > _FAR_APART * known.min():
        right.set_xscale("log")  # else the curves of quick managers would all be at the left edge
        right.xaxis.set_major_formatter("{x:g}")
    else:
        right.set_xlim(left=0.0)
    right.yaxis.set_major_formatter(PercentFormatter(1.0))
    right.set_title("b   Reaction time")
    _legend(figure, _handles(groups), [_label(group) for group in groups])
    return figure


def _metric_panels(figure: style.Picture, *, sharey: bool = False) -> Iterator[tuple[Axes, str, str]]:
    """Make the panels a and b for the metrics of the paper's table; yield each with its metric, and the axis' title."""
    panels = figure.subplots(1, 2, sharey=sharey)
    for axes, letter, (metric, title) in zip(panels, "ab", PAPER_METRICS.items(), strict=True):
        axes.set_title(f"{letter}   {title.split(' (')[0].capitalize()}")
        yield axes, metric, title


def _looks(groups: Sequence[Group]) -> Iterator[tuple[int, Group]]:
    """Yield each group with the number of its look."""
    return zip(style.looks([group.name for group in groups]), groups, strict=True)


def _handles(groups: Sequence[Group]) -> list[Artist]:
    """Make the lines with markers that a legend shows for each group."""
    return [Line2D([], [], marker=style.marker(number), ms=3.5, **style.line(number)) for number, _ in _looks(groups)]


def _label(group: Group, width: int = 40) -> str:
    return style.text(folded(f"{group.name} (n = {len(group.frame):,})", width))


def _legend(figure: style.Picture, handles: Sequence[Artist], labels: Sequence[str]) -> None:
    figure.legend(handles, labels, loc="outside upper right", ncols=legend_columns(labels), handlelength=2.8)


def legend_columns(labels: Sequence[str]) -> int:
    """Return the number of columns with which a legend fits the width of a figure."""
    most = len(labels) if len(labels) <= 4 else 3
    widths_in = [_HANDLE_IN + _text_width_in(label) for label in labels]
    for columns in range(most, 1, -1):
        if sum(max(column) for column in np.array_split(widths_in, columns)) <= style.WIDTH_IN:
            return columns
    return 1


def _text_width_in(label: str) -> float:
    font = FontProperties(size=matplotlib.rcParams["legend.fontsize"])
    return max(float(TextPath((0.0, 0.0), part, prop=font).get_extents().x1) for part in label.split("\n")) / 72.0


def _legend_height(labels: Sequence[str]) -> float:
    rows = math.ceil(len(labels) / legend_columns(labels))
    return _LEGEND_LINE_IN * rows * max(label.count("\n") + 1 for label in labels)
