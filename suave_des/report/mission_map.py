"""Maps: a mission with its events, and altitude over time; the paths of many missions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import cycle, groupby
from string import ascii_uppercase
from typing import Any

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator, MultipleLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from suave_des.domain import SEA_BED_Z_M, UNGROUND_MODE
from suave_des.monitor.diagnostics import FAILED
from suave_des.report import style
from suave_des.report.mission_record import MissionRecord, adaptations, battery_level
from suave_des.report.words import mode_words

_IDLE_MODES = ("", UNGROUND_MODE, "inactive")
_ZOOM_MARGIN_M, _PATHS_MARGIN_M = 0.6, 1.0
_PIPELINE: dict[str, Any] = {"color": "#CFCFCF", "lw": 4.0}
_VISIBILITY: dict[str, Any] = {"color": style.GREY, "lw": 1.0, "ls": (0, (4, 1.5))}
_BATTERY_COLOUR = style.GREEN
_LETTER_OFFSETS = ((4, 4), (-9, 4), (4, -10), (-9, -10), (0, 9), (0, -14), (12, 0), (-16, 0), (12, 10), (-16, 10))
"""Where a letter may stand beside its point, in points; the first that is free is taken."""
_LETTER_POINTS = 9.0
_LETTER_ROW_SHARE = 0.075


@dataclass(frozen=True, slots=True)
class _Mark:
    """An event, to be marked on the map and over time."""

    letter: str
    t_s: float
    x_m: float
    y_m: float
    text: str
    colour: str


def draw(record: MissionRecord) -> style.Picture:
    """Draw the map of a mission, with altitude, visibility and battery over time."""
    colours = mode_colours(record)
    marks = list(_marks(record))
    figure = style.Picture(figsize=(style.WIDTH_IN, 5.2), layout="constrained")
    panels = figure.subplot_mosaic("aa;bc", height_ratios=(1.15, 1.0), width_ratios=(1.0, 1.75))
    whole, zoom, time = panels["a"], panels["b"], panels["c"]
    search = _search_frame(record)
    _draw_map(whole, record, colours, search)
    _draw_zoom(zoom, record, colours, marks, search)
    _draw_over_time(time, record, colours, marks)
    whole.set_title(f"a   Mission: {style.text(record.name)}")
    zoom.set_title("b   Search")
    time.set_title("c   Altitude and visibility")
    whole.legend(
        handles=_legend(record, colours, marks), loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0
    )
    return figure


def _legend(record: MissionRecord, colours: dict[str, str], marks: list[_Mark]) -> list[Line2D]:
    named = [(mode_words(mode), mode) for mode in colours if mode not in _IDLE_MODES]
    if len(named) < len(colours):
        named.append((mode_words(_IDLE_MODES[1]), _IDLE_MODES[1]))
    lines = [Line2D([], [], label=style.text(name), **_way_look(colours, mode)) for name, mode in named]
    lines.append(Line2D([], [], **_PIPELINE, label="pipeline"))
    lines.append(Line2D([], [], **_VISIBILITY, label="visibility; dotted: thresholds (c)"))
    if battery_level(record) is not None:
        lines.append(Line2D([], [], color=_BATTERY_COLOUR, lw=1.0, ls="--", label="battery (c)"))
        lines.append(Line2D([], [], color=_BATTERY_COLOUR, lw=0, marker="P", ms=5, label="recharge station"))
    lines.append(Line2D([], [], color=style.BLACK, lw=0, marker="o", ms=4, label="start"))
    if adaptations(record):
        lines.append(Line2D([], [], color=style.BLACK, lw=0, marker="v", ms=4, mfc="white", label="adaptation"))
    for mark in marks:
        symbol = rf"$\mathbf{{{mark.letter}}}$"
        lines.append(Line2D([], [], lw=0, marker=symbol, color=mark.colour, ms=5, label=mark.text))
    return lines


def mode_colours(record: MissionRecord) -> dict[str, str]:
    """Return a colour for each mode, in the order of appearance; what does not move the vehicle is grey."""
    modes = list(dict.fromkeys(record.trajectory["mode"]))
    known = style.MODE_COLOURS | dict.fromkeys(_IDLE_MODES, style.GREY)
    others = zip([mode for mode in modes if mode not in known], cycle(style.OTHER_MODES), strict=False)
    colours = known | dict(others)
    return {mode: colours[mode] for mode in modes}


def _marks(record: MissionRecord) -> Iterator[_Mark]:
    way = record.trajectory
    for letter, (t_s, text, colour) in zip(ascii_uppercase, _milestones(record.events), strict=False):
        x_m, y_m = (float(np.interp(t_s, way["t_s"], way[axis])) for axis in ("x_m", "y_m"))
        yield _Mark(letter, t_s, x_m, y_m, f"{text}, {t_s:.0f} s", colour)


def _way_look(colours: dict[str, str], mode: str) -> dict[str, Any]:
    """Return the style of a stretch of the path: line widths distinguish the search altitudes without colours."""
    dashed = mode not in style.MODE_COLOURS and mode not in _IDLE_MODES
    return {
        "color": colours.get(mode, style.GREY),
        "lw": style.MODE_WIDTHS.get(mode, 1.2),
        "ls": "--" if dashed else "-",
    }


def _milestones(events: pandas.DataFrame) -> Iterator[tuple[float, str, str]]:
    """Return time, label and colour of marked events: the detection, failures, and recoveries from these."""
    failed: set[str] = set()
    for t_s, event, detail in zip(events["t_s"], events["event"], events["detail"], strict=True):
        component, _, status = detail.partition(" ")
        name = component.removeprefix("c_").replace("_", " ")
        if event == "pipeline_detected":
            yield t_s, "pipeline detected", style.BLACK
        elif event == "battery_crossing":
            yield t_s, "battery low" if detail.startswith("falls") else "recharged", _BATTERY_COLOUR
        elif event == "component_status" and status == FAILED:
            failed.add(component)
            yield t_s, f"{name} failed", style.VERMILION
        elif event == "component_status" and component in failed:
            failed.remove(component)
            yield t_s, f"{name} recovered", style.BLACK


def _draw_way(axes: Axes, record: MissionRecord, colours: dict[str, str], across: str, up: str) -> None:
    """Draw the vehicle's path, each stretch in its mode's colour and joined to the next."""
    way = record.trajectory
    modes = way["mode"].tolist()
    first = 0
    for mode, points in groupby(modes):
        last = first + len(list(points))
        stretch = way.iloc[first : last + 1]
        axes.plot(stretch[across], stretch[up], solid_capstyle="round", **_way_look(colours, mode))
        first = last


def _draw_plan(axes: Axes, record: MissionRecord, colours: dict[str, str]) -> None:
    """Draw the parts that both maps share."""
    _draw_pipeline(axes, record)
    _draw_way(axes, record, colours, "x_m", "y_m")
    start = record.trajectory.iloc[0]
    axes.plot(start["x_m"], start["y_m"], "o", color=style.BLACK, ms=4)
    if battery := record.scenario.get("battery"):
        axes.plot(battery["station_x_m"], battery["station_y_m"], "P", color=_BATTERY_COLOUR, ms=5, zorder=3)
    axes.set_xlabel("x, east (m)")
    axes.set_ylabel("y, north (m)")


def _draw_pipeline(axes: Axes, record: MissionRecord) -> None:
    """Draw the pipeline, from above."""
    x_m, y_m = np.array(record.scenario["pipeline"]["vertices_m"])[:, :2].T
    axes.plot(x_m, y_m, **_PIPELINE, solid_capstyle="round", zorder=1.5)
    axes.set_aspect("equal")


def _draw_letters(axes: Axes, marks: Sequence[_Mark], frame: Bbox) -> None:
    """Mark events on the map; letters of events at nearly the same place stand apart."""
    axes.set_xlim(frame.x0, frame.x1)
    axes.set_ylim(frame.y0, frame.y1)
    points_per_m = 72.0 * axes.get_position().width * style.WIDTH_IN / frame.width
    taken: list[tuple[float, float]] = []
    for mark in marks:
        if not frame.contains(mark.x_m, mark.y_m):
            continue
        axes.plot(mark.x_m, mark.y_m, "o", color=mark.colour, ms=3.5, mec="white", mew=0.6, zorder=4)
        place = mark.x_m * points_per_m, mark.y_m * points_per_m
        offset = next((each for each in _LETTER_OFFSETS if _is_free(place, each, taken)), _LETTER_OFFSETS[0])
        taken.append((place[0] + offset[0], place[1] + offset[1]))
        axes.annotate(
            mark.letter,
            (mark.x_m, mark.y_m),
            xytext=offset,
            textcoords="offset points",
            color=mark.colour,
            weight="bold",
            fontsize=8,
            zorder=5,
        )


def _is_free(place: tuple[float, float], offset: tuple[float, float], taken: Sequence[tuple[float, float]]) -> bool:
    x, y = place[0] + offset[0], place[1] + offset[1]
    return all(abs(x - other[0]) > _LETTER_POINTS or abs(y - other[1]) > _LETTER_POINTS for other in taken)


def _draw_map(axes: Axes, record: MissionRecord, colours: dict[str, str], frame: Bbox) -> None:
    """The whole mission, with the frame of the search's map."""
    _draw_plan(axes, record, colours)
    axes.add_patch(Rectangle(frame.p0, frame.width, frame.height, fill=False, ec=style.GREY, lw=0.7))
    axes.annotate("b", (frame.x0, frame.y1), (-3, 0), textcoords="offset points", ha="right", va="top", fontsize=7.5)
    axes.yaxis.set_major_locator(MultipleLocator(5.0))


def _draw_zoom(axes: Axes, record: MissionRecord, colours: dict[str, str], marks: list[_Mark], frame: Bbox) -> None:
    """The surroundings of the search."""
    _draw_plan(axes, record, colours)
    _draw_adaptations(axes, record, colours, "x_m", "y_m")
    _draw_letters(axes, marks, frame)
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))


def _search_frame(record: MissionRecord) -> Bbox:
    """Return the frame around the vehicle's path until detection and the detected point, with a margin."""
    search = _search(record)
    if record.metrics["pipeline_found"]:
        seen = [record.metrics["detection_x_m"], record.metrics["detection_y_m"]]
        search = np.vstack([search, seen])
    return Bbox([search.min(axis=0) - _ZOOM_MARGIN_M, search.max(axis=0) + _ZOOM_MARGIN_M])


def _search(record: MissionRecord) -> NDArray[np.float64]:
    """Return the vehicle's path until it found the pipeline, or the mission ended; shape (n, 2)."""
    way = record.trajectory
    return np.asarray(way.loc[way["t_s"] <= record.metrics["search_time_s"], ["x_m", "y_m"]], dtype=float)


def _draw_adaptations(axes: Axes, record: MissionRecord, colours: dict[str, str], across: str, up: str) -> None:
    """Mark where or when modes changed, in the colour of the new one."""
    way = record.trajectory
    for each in adaptations(record):
        x, y = (float(np.interp(each.t_s, way["t_s"], way[name])) for name in (across, up))
        axes.plot(x, y, "v", color=style.BLACK, mfc=colours.get(each.after, "white"), ms=4.5, mew=0.7, zorder=3.5)


def _draw_over_time(axes: Axes, record: MissionRecord, colours: dict[str, str], marks: Sequence[_Mark]) -> None:
    """Draw altitude, visibility with its thresholds, and battery."""
    way = record.trajectory.assign(altitude_m=record.trajectory["z_m"] - SEA_BED_Z_M)
    draw_thresholds(axes, record)
    axes.plot(way["t_s"], way["visibility_m"], **_VISIBILITY)
    timed = replace(record, trajectory=way)
    _draw_way(axes, timed, colours, "t_s", "altitude_m")
    _draw_adaptations(axes, timed, colours, "t_s", "altitude_m")
    tallest = max(way["altitude_m"].max(), way["visibility_m"].max())
    rows = _letter_rows(marks, record.end_s)
    top = tallest * (1.06 + _LETTER_ROW_SHARE * (max(rows, default=0) + 1))
    for mark, row in zip(marks, rows, strict=True):
        axes.axvline(mark.t_s, color=mark.colour, lw=0.7, ls=":")
        axes.text(
            mark.t_s,
            top * (1.0 - _LETTER_ROW_SHARE * row),
            mark.letter,
            color=mark.colour,
            weight="bold",
            ha="center",
            va="top",
            fontsize=8,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
        )
    axes.set_ylim(0.0, top)
    axes.set_xlim(0.0, record.end_s)
    axes.set_xlabel("mission time (s)")
    axes.set_ylabel("altitude; visibility (m)")
    level = battery_level(record)
    if level is not None:
        beside = axes.twinx()
        beside.plot(way["t_s"], 100.0 * level, color=_BATTERY_COLOUR, lw=1.0, ls="--")
        beside.set_ylim(0.0, 100.0 * top / tallest)
        beside.set_yticks((0, 25, 50, 75, 100))
        beside.grid(False)
        beside.spines["right"].set_visible(True)
        beside.set_ylabel("battery (%)")


def draw_thresholds(axes: Axes, record: MissionRecord) -> None:
    """Draw the thresholds of the visibility over time."""
    for threshold_m in record.scenario.get("reaction_metric", {}).get("visibility_thresholds_m", ()):
        axes.axhline(threshold_m, color="#B5B5B5", lw=0.7, ls=":", zorder=1)


def _letter_rows(marks: Sequence[_Mark], end_s: float) -> list[int]:
    """Return the row of each letter over time: one that would touch another goes into the next row."""
    near_s = 0.028 * end_s
    last_s: list[float] = []
    rows = []
    for mark in marks:
        row = next((row for row, t_s in enumerate(last_s) if mark.t_s - t_s >= near_s), len(last_s))
        last_s[row : row + 1] = [mark.t_s]
        rows.append(row)
    return rows


def draw_paths(records: Sequence[MissionRecord]) -> style.Picture:
    """Draw the paths of missions, a panel for each manager, over the part of the sea bed that they search.

    The pipeline is that of the first.
    """
    managers = list(dict.fromkeys(str(record.metrics["manager"]) for record in records))
    columns = style.columns(len(managers))
    rows = -(-len(managers) // columns)
    searches = [_search(record) for record in records]
    low = np.min([search.min(axis=0) for search in searches], axis=0) - _PATHS_MARGIN_M
    high = np.max([search.max(axis=0) for search in searches], axis=0) + _PATHS_MARGIN_M
    shape = (high[1] - low[1]) / (high[0] - low[0])
    height = rows * (style.WIDTH_IN / columns * shape * 0.93 + 0.55) + 0.3
    figure = style.Picture(figsize=(style.WIDTH_IN, min(height, 9.5)), layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes in panels.ravel()[len(managers) :]:
        axes.set_visible(False)
    for axes, manager, number in zip(panels.ravel(), managers, style.looks(managers), strict=False):
        own = [record for record in records if str(record.metrics["manager"]) == manager]
        colour = style.line(number)["color"]
        _draw_pipeline(axes, records[0])
        for record in own:
            search = _search(record)
            axes.plot(search[:, 0], search[:, 1], color=colour, lw=0.7, alpha=max(0.12, min(0.9, 4.0 / len(own))))
        found = [record.metrics for record in own if record.metrics["pipeline_found"]]
        seen = np.array([[each["detection_x_m"], each["detection_y_m"]] for each in found], dtype=float).reshape(-1, 2)
        axes.plot(seen[:, 0], seen[:, 1], "o", color=style.BLACK, ms=3, mew=0, alpha=0.6, zorder=4)
        starts = np.array([search[0] for search in map(_search, own)])
        axes.plot(starts[:, 0], starts[:, 1], "s", color=style.BLACK, mfc="white", ms=3, mew=0.7, zorder=4)
        axes.set_title(style.text(f"{manager}: {len(found)} of {len(own)} found it"))
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    for axes in panels[-1]:
        axes.set_xlabel("x, east (m)")
    for axes in panels[:, 0]:
        axes.set_ylabel("y, north (m)")
    handles = [
        Line2D([], [], color=style.GREY, lw=0.9, label="way until the pipeline was found"),
        Line2D([], [], **_PIPELINE, label="pipeline"),
        Line2D([], [], color=style.BLACK, lw=0, marker="s", ms=3, mfc="white", label="start"),
        Line2D([], [], color=style.BLACK, lw=0, marker="o", ms=3, label="point seen first"),
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=4)
    return figure
