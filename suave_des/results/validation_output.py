"""A validation as text and figures: its tables, what to read from them, distributions, and places of detection."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from suave_des.errors import number_of
from suave_des.estimates import CONFIDENCE, interval_names, percent
from suave_des.records.metrics import METRICS, PAPER_METRICS, SEARCH_TIME
from suave_des.results import style
from suave_des.results.statistics import SIGNIFICANCE, Sample
from suave_des.results.validation import Validation, over_conditions, sample, with_limit
from suave_des.tables import Table

_SIMULATED, _PUBLISHED = style.BLUE, style.BLACK
_PANEL_INCHES = (style.WIDTH_IN / 3.0, 2.0)
_LEGEND_LINE_INCHES = 0.25
_TIME_BIN_S = 2.0
_LEGEND_SHARE = 0.1
_ALL_AREA, _LEAST_AREA = 900.0, 1.5
"""Areas of a marker, in square points: that of all missions of a manager, and the least."""
_SHADED: Mapping[str, Any] = {"color": _SIMULATED, "alpha": 0.5, "linewidth": 0}
_OUTLINED: Mapping[str, Any] = {"facecolor": "none", "edgecolor": _PUBLISHED, "linewidth": 0.8}
_TICK: Mapping[str, Any] = {"linestyle": "", "marker": "|", "color": _PUBLISHED, "markersize": 7, "clip_on": False}
_VERDICTS: Mapping[bool | None, str] = {True: "met", False: "NOT MET", None: "not judged"}
_KINDS = {
    "mean": "mean",
    "std": "std",
    "ks": "KS p",
    "conclusion": "agreeing conclusions",
    "condition_median": "difference within conditions",
    "condition_std": "std ratio within conditions",
}
_SIDES = ("published", "simulated")
_INTERVAL = "95% interval"


class _Number(float):
    """A number of a row, written as nothing where it is missing; the styles "p" and "share" are our own."""

    def __format__(self, style: str) -> str:
        if self != self:
            return ""
        if style == "share":
            return percent(self)
        if style == "p":
            style = ".3f" if self >= 0.001 else ".0e"
        return format(float(self), style)


def _table(frame: pandas.DataFrame, title: str, align: str, *columns: tuple[str, str]) -> Table:
    """Fill a table with the rows of a frame; each column has a heading and a template for its cells."""
    rows = []
    for row in _rows(frame):
        values = {
            name: each if isinstance(each, str) else _Number(math.nan if each is None else each)
            for name, each in row.items()
        }
        values["brief"] = METRICS[row["metric"]].brief if "metric" in row else ""
        cells = (template.format_map(values) for _, template in columns)
        rows.append(["" if cell == " to " else cell for cell in cells])
    return Table([heading for heading, _ in columns], rows, title, align)


def _interval(name: str, style: str) -> tuple[str, str]:
    low, high = interval_names(name)
    return _INTERVAL, f"{{{low}:{style}}} to {{{high}:{style}}}"


def tables(validation: Validation, real: str) -> Iterator[Table]:
    """Yield every table that has rows.

    Args:
        validation: what was found.
        real: what the real missions are called: "published" or "real".
    """
    runs = "real runs" if real == "real" else real
    head = ("metric", "{brief}"), ("manager", "{manager}")
    numbers = [
        [(name, f"{{{side}_{name}:{'.0f' if name == 'n' else '.2f'}}}") for name in ("n", "mean", "std", "median")]
        for side in _SIDES
    ]
    title = f"Samples: {runs}, then simulated"
    found = [_table(validation.cells, title, "ll", *head, *numbers[0], *numbers[1])]
    title = f"Simulated compared with {runs} (difference = simulated - {real})"
    columns: tuple[tuple[str, str], ...] = (
        ("difference of means", "{difference_of_means:+.2f}"),
        _interval("difference_of_means", "+.1f"),
    )
    ratio = ("std ratio", "{std_ratio:.2f}"), _interval("std_ratio", ".2f")
    tests = ("KS p", "{ks_p:p}"), ("AD p", "{ad_p:p}")
    found.append(_table(validation.cells, title, "ll", *head, *columns, *ratio, *tests))
    title = f"Pairs: probability that the first is better; Mann-Whitney tests of samples of the {real} size"
    columns = (head[0], ("first, second", "{first}, {second}"), (real, "{published_superiority:.2f}"))
    better = (f"{real}: better", "{published_better}"), ("simulated agrees", "{agreement:share}")
    found.append(_table(validation.pairs, title, "ll", *columns, ("simulated", "{simulated_superiority:.2f}"), *better))
    title = f"Shares of missions (* the simulated one is outside the {real} one's 95% interval)"
    shares = validation.shares
    if len(shares):
        low, high = (shares[name].astype(float) for name in interval_names("published_share"))
        share = shares["simulated_share"].astype(float)
        shares = shares.assign(mark=np.where((share < low) | (share > high), "*", ""))
    count = real, "{published_count:.0f} of {published_n:.0f}"
    simulated = ("simulated", "{simulated_share:share}"), ("", "{mark}")
    interval = _interval("published_share", ".0%")
    found.append(_table(shares, title, "llrrrl", head[1], ("share", "{name}"), count, interval, *simulated))
    conditions = validation.conditions
    if len(conditions):
        conditions = conditions[conditions["metric"].isin(PAPER_METRICS)]
    sides = [(name, f"{{{side}_{name}:.2f}}") for side in ("real", "simulated") for name in ("median", "std")]
    counts = ("condition", "{condition:.0f}"), ("n", "{real_n:.0f}")
    columns = (*head, *counts, *sides, ("difference", "{difference_of_medians:+.2f}"))
    found.append(_table(conditions, f"Condition by condition: {runs}, then simulated", "ll", *columns))
    stds = (f"std: {real}", "{real_std:.2f}"), ("simulated", "{simulated_std:.2f}"), ("ratio", "{std_ratio:.2f}")
    columns = (*head, ("|difference|", "{difference:.2f}"), *stds)
    within = over_conditions(validation.conditions)
    found.append(_table(within, "Within conditions: medians over the conditions", "ll", *columns))
    rows = [_target(each) for each in _rows(validation.targets)]
    found.append(Table(("of", "what", "simulated", "must be", ""), rows, "Targets", "llrrl"))
    yield from (table for table in found if table.rows)


def remarks(validation: Validation, real: str) -> Iterator[str]:
    """Say how search times count, what the targets ask for, and how many are met."""
    if validation.not_found_s is not None:
        yield f"Missions that never found the pipeline count as {validation.not_found_s:g} s, on both sides."
    yield (
        f"Means must lie in the {real} mean's 95% t interval, standard deviations in the {real} one's"
        " 95% chi-square interval."
    )
    yield from _power(validation, real)
    met = validation.targets["met"].tolist()
    is_met, is_not = ("is" if met.count(each) == 1 else "are" for each in (True, False))
    yield f"{met.count(True)} of {number_of(len(met), 'target')} {is_met} met, {met.count(False)} {is_not} not met."
    if None in met:
        yield (
            f"{met.count(None)} cannot be judged: too few missions. For conclusions the simulation needs at least as"
            f" many of each manager as there are {real} ones."
        )


def _power(validation: Validation, real: str) -> Iterator[str]:
    """Say how far apart distributions are that the KS test tells apart: not rejecting them does not make them equal."""
    from scipy.special import kolmogi

    sizes = [(each["published_n"], each["simulated_n"]) for each in _rows(validation.cells)]
    if sizes:
        apart = min(float(kolmogi(SIGNIFICANCE)) * (1.0 / n + 1.0 / m) ** 0.5 for n, m in sizes)
        few = f"with so few {real} missions it is less only where the shares at or below some value differ by more than"
        rest = f"{few} about {apart:.0%}" if apart < 1.0 else "with so few missions it is hardly ever less"
        yield f"A KS p of {SIGNIFICANCE} or more does not show that distributions are equal: {rest}."


def _rows(frame: pandas.DataFrame) -> list[dict[Any, Any]]:
    return frame.to_dict("records")


def _target(each: Mapping[str, Any]) -> tuple[str, ...]:
    kind = each["kind"]
    what = f"{METRICS[each['what']].brief}: {_KINDS[kind]}" if kind in _KINDS else each["what"]
    style = ".0%" if kind in ("conclusion", "share") else ".2f"
    value, low, high = (format(_Number(each[name]), style) for name in ("value", "low", "high"))
    must_be = f"{low} to {high}" if low and high else f"at least {low}" if low else ""
    return each["subject"], what, value, must_be, _VERDICTS[each["met"]]


# Figures


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
    ks_ps = {(each["metric"], each["manager"]): each["ks_p"] for each in validation.cells.to_dict("records")}
    metrics = list(dict.fromkeys(metric for metric, _ in ks_ps))
    sides = [with_limit(runs, validation.not_found_s) for runs in (published, simulated)]
    with style.publication():
        figure, panels = _panels(len(metrics), len(validation.managers), share_x=False)
        for row, metric in zip(panels, metrics, strict=True):
            row[0].set_ylabel("share of runs at or below")
            for axes, manager in zip(row, validation.managers, strict=True):
                if (metric, manager) in ks_ps:
                    theirs, ours = (sample(runs, manager, metric) for runs in sides)
                    _draw_distribution(axes, theirs, ours, ks_ps[metric, manager], real)
                    axes.set_xlabel(METRICS[metric].heading)
                else:
                    axes.text(0.5, 0.5, "not known", transform=axes.transAxes, ha="center", va="center")
        for axes, manager in zip(panels[0], validation.managers, strict=True):
            axes.set_title(manager)
        _legend(figure, *panels[0, 0].get_legend_handles_labels())
        return style.png(figure)


def _draw_distribution(axes: Axes, published: Sample, simulated: Sample, p: float, real: str) -> None:
    top = float(max(published.max(), simulated.max())) * 1.04 or 1.0
    values, shares = _steps(simulated, top)
    tail = (1.0 - CONFIDENCE) / 2.0
    # The parts of a sample at or below a value are binomially distributed.
    from scipy.stats import binom

    low, high = (binom.ppf(quantile, len(published), shares) / len(published) for quantile in (tail, 1.0 - tail))
    band = f"95% of samples of the {real} size from the simulation"
    axes.fill_between(values, np.maximum(low, 0.0), high, label=band, step="post", **{**_SHADED, "alpha": 0.15})
    axes.step(values, shares, where="post", color=_SIMULATED, linewidth=1.5, label="simulated")
    axes.step(*_steps(published, top), where="post", color=_PUBLISHED, linewidth=0.9, label=real)
    axes.set(ylim=(-0.015, 1.02), xlim=(0.0, top))
    # A distribution function leaves the corner opposite to its bulk free.
    is_late = np.median(simulated) > top / 2.0
    x, y, across, up = (0.03, 0.97, "left", "top") if is_late else (0.98, 0.05, "right", "bottom")
    text = f"{real} n = {len(published)}\nsimulated n = {len(simulated):,}\nKS p = {p:.{'2f' if p >= 0.01 else '0e'}}"
    axes.text(x, y, text, transform=axes.transAxes, ha=across, va=up, fontsize=7.0, linespacing=1.3)


def _steps(values: Sample, top: float) -> tuple[Sample, Sample]:
    """Return the corners of an empirical distribution function, from zero to the panel's right edge."""
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
        figure, panels = _panels(1, len(validation.managers), share_x=True)
        for axes, manager in zip(panels[0], validation.managers, strict=True):
            theirs, ours = (side[side["manager"] == manager] for side in (published, simulated))
            for side, look in ((ours, _SHADED), (theirs, _OUTLINED)):
                places = (side[SEARCH_TIME] / _TIME_BIN_S).round() * _TIME_BIN_S, side["detection_x_m"].round(3)
                counts = side.groupby(list(places)).size()
                across, up = (counts.index.get_level_values(level) for level in (0, 1))
                areas = np.maximum(counts.to_numpy(float) / max(1, len(side)) * _ALL_AREA, _LEAST_AREA)
                axes.scatter(across, up, s=areas, **look)
            unplaced = theirs.loc[theirs["detection_x_m"].isna(), SEARCH_TIME]
            axes.plot(unplaced, np.ones(len(unplaced)), transform=axes.get_xaxis_transform(), **_TICK)
            axes.set_title(manager, pad=9)
            without = f"simulated without detection: {ours['detection_x_m'].isna().mean():.1%}"
            axes.set_xlabel(f"{METRICS[SEARCH_TIME].heading}\n{without}")
        panels[0, 0].set_ylabel("x of the point seen first (m)")
        panels[0, 0].margins(0.06, 0.12)
        circle: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": (_LEGEND_SHARE * _ALL_AREA) ** 0.5}
        handles = [
            Line2D([], [], color=_SIMULATED, alpha=0.5, markeredgewidth=0, **circle),
            Line2D([], [], markerfacecolor="none", markeredgecolor=_PUBLISHED, markeredgewidth=0.8, **circle),
            Line2D([], [], **_TICK),
        ]
        size = f"this area: {_LEGEND_SHARE:.0%} of the manager's runs"
        _legend(figure, handles, [f"simulated ({size})", real, f"{real}, place not known or no detection"])
        return style.png(figure)


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
