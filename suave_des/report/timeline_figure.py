"""A mission over time: visibility, altitude, tasks, modes, thrusters, battery, and each adaptation with its cause."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from string import ascii_uppercase
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from suave_des.domain import DEFAULT_MODE, FOLLOW_PIPELINE, GENERATE_SEARCH_PATH, SEA_BED_Z_M
from suave_des.report import style
from suave_des.report.mission_map import draw_thresholds, mode_colours
from suave_des.report.mission_record import (
    Adaptation,
    MissionRecord,
    Span,
    adaptations,
    battery_level,
    failure_spans,
    mode_spans,
    task_spans,
)
from suave_des.report.words import function_mode_words, function_words, is_off, plain

_BAR = 0.62
_BAR_POINTS = 6.5
_LETTER_IN, _LINES_IN = _BAR_POINTS * 0.55 / 72.0, style.WIDTH_IN * 0.86
"""Widths of a letter of a bar's text, about half its size, and of all lines."""
_LISTED = 26
"""Adaptations that are listed; a manager that changes modes all the time has more."""
_COLUMN_LETTERS = 66
"""Longest line of which two stand side by side."""
_FAILED, _TASK, _ON = style.VERMILION, "#D9D9D9", "#9ECAE1"
_SPIRAL_ALTITUDES_M = {"fd_spiral_low": 1.0, "fd_spiral_medium": 2.0, "fd_spiral_high": 3.0, DEFAULT_MODE: 1.0}


def draw_timeline(record: MissionRecord) -> style.Picture:
    """Draw a mission over time, with the rules that caused adaptations where they are known."""
    lines = list(_lines(record))
    changes = adaptations(record)
    listed = changes[:_LISTED]
    longest = max((len(_sentence(each, record)) for each in listed), default=0)
    columns = 2 if len(listed) > 6 and longest <= _COLUMN_LETTERS else 1
    list_in = 0.17 * -(-(len(listed) + (len(changes) > _LISTED)) // columns) + 0.1 if changes else 0.0
    level = battery_level(record)
    heights = [1.9, *([0.7] if level is not None else []), 0.24 * len(lines) + 0.2, list_in or 0.01]
    figure = style.Picture(figsize=(style.WIDTH_IN, sum(heights) + 0.9), layout="constrained")
    panels = figure.subplots(len(heights), 1, height_ratios=heights)
    for axes in panels[1:-1]:
        axes.sharex(panels[0])
    _draw_altitude(panels[0], record, changes)
    if level is not None:
        panels[1].plot(record.trajectory["t_s"], 100.0 * level, color=style.GREEN, lw=1.2)
        panels[1].set(ylabel="battery (%)", ylim=(0, 105))
    _draw_lines(panels[-2], lines)
    for axes in panels[:-2]:
        axes.tick_params(labelbottom=False)
    panels[0].set_xlim(0.0, record.end_s)
    panels[-2].set_xlabel("mission time (s)")
    panels[0].set_title(style.text(record.name), pad=16)
    for axes in panels[:-1]:
        for each in changes:
            axes.axvline(each.t_s, color="#777777", lw=0.5, ls=":", zorder=1)
    _draw_list(panels[-1], listed, len(changes), columns, record)
    return figure


def _draw_altitude(axes: Axes, record: MissionRecord, changes: Sequence[Adaptation]) -> None:
    """Draw visibility and its thresholds, and the requested altitude and flown."""
    way = record.trajectory
    draw_thresholds(axes, record)
    axes.plot(way["t_s"], way["visibility_m"], color=style.GREY, lw=1.0, label="visibility; dotted: thresholds")
    times_s, asked_m = _altitude_asked_for(record)
    axes.step(times_s, asked_m, where="post", color=style.BLACK, lw=0.9, ls="--", label="requested altitude")
    axes.plot(way["t_s"], way["z_m"] - SEA_BED_Z_M, color=style.BLUE, lw=1.3, label="altitude flown")
    found_s = record.metrics["search_time_s"]
    if record.metrics["pipeline_found"]:
        axes.axvline(found_s, color=style.BLACK, lw=0.9)
        axes.annotate(
            "pipeline found", (found_s, 0.0), (3, 3), textcoords="offset points", fontsize=7, rotation=90, va="bottom"
        )
    axes.set_ylabel("m")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2, handlelength=2.4)
    last_s, row = -1e9, 0
    near_s = 0.022 * record.end_s
    for number, each in enumerate(changes[:_LISTED]):
        row = row + 1 if each.t_s - last_s < near_s else 0
        last_s = each.t_s
        axes.annotate(
            ascii_uppercase[number],
            (each.t_s, 1.0),
            (0, -2 - 8 * row),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=7,
            weight="bold",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
        )


def _altitude_asked_for(record: MissionRecord) -> tuple[list[float], list[float]]:
    """Return the requested altitude above the sea bed over time, nan where there was none."""
    follow_m = record.scenario.get("revision", {}).get("follow", {}).get("altitude_m", np.nan)
    asked: dict[str, float] = {}
    times_s, altitudes_m = [0.0], [np.nan]
    changes = [(span.begin_s, function, span.what) for function, spans in mode_spans(record).items() for span in spans]
    for t_s, function, mode in sorted(changes):
        if function not in (GENERATE_SEARCH_PATH, FOLLOW_PIPELINE):
            continue
        asked.pop(function, None)
        if not is_off(function, mode):
            asked[function] = _SPIRAL_ALTITUDES_M.get(mode, np.nan) if function == GENERATE_SEARCH_PATH else follow_m
        times_s.append(t_s)
        altitudes_m.append(next(reversed(asked.values()), np.nan))
    return [*times_s, record.end_s], [*altitudes_m, altitudes_m[-1]]


def _lines(record: MissionRecord) -> Iterator[tuple[str, list[tuple[Span, str, str]]]]:
    """Yield the lines of the chart: their names, and spans with colour and text."""
    yield "task", [(span, _TASK, plain(span.what)) for span in task_spans(record)]
    colours = mode_colours(record) | style.MODE_COLOURS
    for function, spans in mode_spans(record).items():
        bars = []
        for span in spans:
            if not is_off(function, span.what):
                is_moving = span.what in style.MODE_COLOURS and function in (GENERATE_SEARCH_PATH, FOLLOW_PIPELINE)
                colour = colours[span.what] if is_moving else _ON if "recover" not in span.what else style.ORANGE
                bars.append((span, colour, function_mode_words(function, span.what)))
        yield function_words(function), bars
    for component, spans in sorted(failure_spans(record).items()):
        yield plain(component.removeprefix("c_")), [(span, _FAILED, "failed") for span in spans]


def _draw_lines(axes: Axes, lines: Sequence[tuple[str, list[tuple[Span, str, str]]]]) -> None:
    """Draw a bar for each span, with its text where it is no wider than the bar."""
    end_s = max((span.end_s for _, bars in lines for span, _, _ in bars), default=1.0)
    letter_s = _LETTER_IN / _LINES_IN * end_s
    for row, (_, bars) in enumerate(lines):
        for span, colour, text in bars:
            width_s = span.end_s - span.begin_s
            axes.barh(row, width_s, _BAR, span.begin_s, color=colour, edgecolor="white", lw=0.6, zorder=2)
            label = style.text(text)
            if 0.0 < width_s >= len(label) * letter_s:
                look: dict[str, Any] = {"va": "center", "fontsize": _BAR_POINTS, "color": _readable_on(colour)}
                axes.text(span.begin_s + 1.0, row, label, zorder=3, clip_on=True, **look)
    axes.set_yticks(range(len(lines)), [style.text(name) for name, _ in lines])
    axes.set_ylim(len(lines) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)


def _readable_on(colour: str) -> str:
    from matplotlib.colors import to_rgb

    red, green, blue = to_rgb(colour)
    return style.BLACK if 0.299 * red + 0.587 * green + 0.114 * blue > 0.5 else "white"


def _draw_list(axes: Axes, listed: Sequence[Adaptation], number: int, columns: int, record: MissionRecord) -> None:
    """List the adaptations with what caused them."""
    axes.set_axis_off()
    texts = [f"{ascii_uppercase[place]}  {_sentence(each, record)}" for place, each in enumerate(listed)]
    if number > len(listed):
        texts.append(f"and {number - len(listed)} more")
    rows = -(-len(texts) // columns)
    for place, text in enumerate(texts):
        column, row = divmod(place, rows)
        axes.text(
            column / columns,
            1.0 - row / max(rows, 1),
            style.text(text),
            va="top",
            fontsize=6.5,
            transform=axes.transAxes,
        )


def _sentence(each: Adaptation, record: MissionRecord) -> str:
    before, after = (function_mode_words(each.function, mode) for mode in (each.before, each.after))
    rules = record.rules.get((each.t_s, each.function), ())
    cause = f"rule {', '.join(rules)}" if rules else each.cause
    return f"{each.t_s:.0f} s  {function_words(each.function)}: {before} to {after}" + (f" ({cause})" if cause else "")
