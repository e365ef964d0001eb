"""What the record of a mission says over time, and its figures: a map with altitude, and all that
happened.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle, groupby, pairwise
from string import ascii_uppercase
from types import MappingProxyType
from typing import NamedTuple, TypeVar

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator, MultipleLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from suave_des import events
from suave_des.domain import (
    FOLLOW_PIPELINE,
    GENERATE_SEARCH_PATH,
    MAINTAIN_MOTION,
    SEA_BED_Z_M,
    SURFACE,
    UNGROUND_MODE,
)
from suave_des.monitor.diagnostics import FAILED
from suave_des.records.mission_folder import MissionRecord
from suave_des.results import style
from suave_des.results.style import (
    component_words,
    function_mode_words,
    function_words,
    handle,
    mode_words,
    plain,
)

_Kind = TypeVar("_Kind", bound=NamedTuple)
_LATEST_REACTION_S = 5.0
"""What was reported earlier is not taken as the cause of an adaptation."""
_RECHARGED, _ROUNDING = 0.3, 0.01


class Span(NamedTuple):
    """A span of time in which something holds: a mode, a failure, a task."""

    begin_s: float
    end_s: float
    what: str


@dataclass(frozen=True, slots=True)
class Adaptation:
    """A change of the mode of a function in use; its cause is in words, empty if it is not
    known.
    """

    t_s: float
    function: str
    before: str
    after: str
    cause: str = ""


def happenings(record: MissionRecord, kind: type[_Kind]) -> list[tuple[float, _Kind]]:
    """Return the events of one kind with their times; those whose text is of another are left
    out.
    """
    own = record.events[record.events["event"] == events.name_of(kind)]
    texts = zip(own["t_s"].astype(float), own["detail"], strict=True)
    read = [(t_s, events.read(kind, detail)) for t_s, detail in texts]
    return [(t_s, found) for t_s, found in read if found is not None]


def _spans(changes: Iterable[tuple[float, str, str]], end_s: float) -> dict[str, list[Span]]:
    """Return the spans between changes, each with its time, of what it is, and to what, if to
    anything.
    """
    by_name: dict[str, list[tuple[float, str]]] = {}
    for t_s, name, what in changes:
        by_name.setdefault(name, []).append((t_s, what))
    return {
        name: [
            Span(begin_s, until_s, what)
            for (begin_s, what), (until_s, _) in pairwise([*own, (end_s, "")])
            if what
        ]
        for name, own in by_name.items()
    }


def mode_spans(record: MissionRecord) -> dict[str, list[Span]]:
    """Return the spans of each function's modes."""
    changes = happenings(record, events.ModeSet)
    return _spans(((t_s, *mode_set) for t_s, mode_set in changes), record.end_s)


def component_changes(record: MissionRecord) -> Iterator[tuple[float, str, bool]]:
    """Yield when a component was reported as failed, or as working after a failure: time, its name,
    whether failed.
    """
    failed: set[str] = set()
    for t_s, (component, status) in happenings(record, events.ComponentStatus):
        if (status == FAILED) != (component in failed):
            failed ^= {component}
            yield t_s, component, status == FAILED


def failure_spans(record: MissionRecord) -> dict[str, list[Span]]:
    """Return the spans of failures, by failed component."""
    changes = component_changes(record)
    failures = ((t_s, name, FAILED if is_failed else "") for t_s, name, is_failed in changes)
    return _spans(failures, record.end_s)


def task_spans(record: MissionRecord) -> list[Span]:
    """Return the spans of the tasks, one after the other."""
    events = record.events[
        record.events["event"].isin(["task_requested", "task_done", "task_cancelled"])
    ]
    tasks = events["detail"].where(events["event"] == "task_requested", "")
    return _spans(zip(events["t_s"], cycle(["task"]), tasks, strict=False), record.end_s).get(
        "task", []
    )


def adaptations(record: MissionRecord) -> list[Adaptation]:
    """Return the changes of modes that the metric of this name counts, in order of the times at
    which they took effect.

    The first mode of a function in a task is none, nor is what is requested between a task's end
    and that.
    """
    mode_set = happenings(record, events.ModeSet)
    in_use = set[str]()
    modes = dict[str, str]()
    requested = events.name_of(events.ModeRequested)
    found = list[Adaptation]()
    for t_s, event, detail in record.events[["t_s", "event", "detail"]].itertuples(index=False):
        if event == requested and (change := events.read(events.ModeRequested, detail)):
            function, mode = change
            if function in in_use:
                effect_s = _effect_s(mode_set, t_s, events.ModeSet(*change))
                cause = _cause(record, function, modes[function], Span(effect_s, effect_s, mode))
                found.append(Adaptation(effect_s, function, modes[function], mode, cause))
            if mode != UNGROUND_MODE:
                in_use.add(function)
            modes[function] = mode
        elif event == "task_done":
            in_use -= _functions_of(record, detail)
        elif event == "task_cancelled":  # at the mission's end, or after a leak: all functions end
            in_use.clear()
    return sorted(found, key=lambda each: each.t_s)


def _effect_s(
    changes: Iterable[tuple[float, events.ModeSet]], requested_s: float, change: events.ModeSet
) -> float:
    """Return when a mode that was requested took effect; the time of the request, if it did not."""
    effects_s = (t_s for t_s, each in changes if t_s >= requested_s and each == change)
    return next(effects_s, requested_s)


def _functions_of(record: MissionRecord, task: str) -> set[str]:
    scenario = record.settings
    per_task = scenario.revision.coordinator.maintain_motion_per_task
    shared = {MAINTAIN_MOTION} if per_task else set()
    own = {"search_pipeline": GENERATE_SEARCH_PATH, "inspect_pipeline": FOLLOW_PIPELINE}.get(
        task, SURFACE
    )
    return {own, *shared, *getattr(scenario.mission.functions, task, ())}


def _cause(record: MissionRecord, function: str, before: str, after: Span) -> str:
    """Return what was reported shortly before a change of mode and concerns its function."""
    if function == MAINTAIN_MOTION:
        words = {True: "failed", False: "recovered"}
        changes = component_changes(record)
        causes = [
            (t_s, f"{component_words(name)} {words[is_failed]}") for t_s, name, is_failed in changes
        ]
    elif cause := _battery_cause(record, before, after):
        return cause
    else:
        crossings = happenings(record, events.VisibilityCrossing)
        causes = [(t_s, f"visibility {crossing.change}") for t_s, crossing in crossings]
    recent = [
        (t_s, text) for t_s, text in causes if 0.0 <= after.begin_s - t_s <= _LATEST_REACTION_S
    ]
    return max(recent)[1] if recent else ""


def _battery_cause(record: MissionRecord, before: str, after: Span) -> str:
    """Return the battery as the cause of a function's activation or deactivation, if it is."""
    level = battery_level(record)
    if level is None or UNGROUND_MODE not in (before, after.what):
        return ""
    times = np.searchsorted(
        record.trajectory["t_s"], (after.begin_s - _LATEST_REACTION_S, after.begin_s)
    )
    earlier, now = level.iloc[np.minimum(times, len(level) - 1)].astype(float)
    if now - earlier > _RECHARGED:
        return "battery recharged"
    is_low = now <= record.settings.reaction_metric.battery_limit + _ROUNDING
    return f"battery at {now:.0%}" if is_low else ""


def battery_level(record: MissionRecord) -> pandas.Series[float] | None:
    """Return the battery's level, 0 to 1, at each point of the trajectory; None without a
    battery.
    """
    return record.trajectory.get("battery_level")


# The map

_IDLE_MODES = ("", UNGROUND_MODE, "inactive")
_ZOOM_MARGIN_M = 0.6
_PIPELINE: style.Look = {"color": "#CFCFCF", "lw": 4.0}
_VISIBILITY: style.Look = {"color": style.GREY, "lw": 1.0, "ls": (0, (4, 1.5))}
_BATTERY_COLOUR = style.GREEN
_LETTER_OFFSETS = (
    (4, 4),
    (-9, 4),
    (4, -10),
    (-9, -10),
    (0, 9),
    (0, -14),
    (12, 0),
    (-16, 0),
    (12, 10),
    (-16, 10),
)
"""Where a letter may stand beside its point, in points; the first that is free is taken."""
_LETTER_POINTS = 9.0
_LETTER_ROW_SHARE = 0.075
_LETTER: style.Look = {"weight": "bold", "fontsize": 8}


class _Mark(NamedTuple):
    """An event, to be marked on the map and over time."""

    letter: str
    t_s: float
    x_m: float
    y_m: float
    text: str
    colour: str


def draw_map(record: MissionRecord) -> style.Picture:
    """Draw the map of a mission, with altitude, visibility and battery over time."""
    colours = mode_colours(record)
    marks = list(_marks(record))
    figure = style.Picture(5.2)
    panels = figure.subplot_mosaic("aa;bc", height_ratios=(1.15, 1.0), width_ratios=(1.0, 1.75))
    whole = panels["a"]
    zoom = panels["b"]
    time = panels["c"]
    frame = _search_frame(record)
    _draw_plan(whole, record, colours)
    whole.add_patch(
        Rectangle(frame.p0, frame.width, frame.height, fill=False, ec=style.GREY, lw=0.7)
    )
    whole.annotate(
        "b",
        (frame.x0, frame.y1),
        (-3, 0),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=7.5,
    )
    whole.yaxis.set_major_locator(MultipleLocator(5.0))
    _draw_plan(zoom, record, colours)
    _draw_adaptations(zoom, record, colours, "x_m", "y_m")
    _draw_letters(zoom, marks, frame)
    _draw_over_time(time, record, colours, marks)
    whole.set_title(f"a   Mission: {style.text(record.name)}")
    zoom.set_title("b   Search")
    time.set_title("c   Altitude and visibility")
    handles = list(_legend(record, colours, marks))
    whole.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure


def _legend(record: MissionRecord, colours: dict[str, str], marks: list[_Mark]) -> Iterator[Line2D]:
    moving = [mode for mode in colours if mode not in _IDLE_MODES]
    for mode in (*moving, *_IDLE_MODES[1:2] * (len(moving) < len(colours))):
        yield handle(label=style.text(mode_words(mode)), **_way_look(colours, mode))
    yield handle(**_PIPELINE, label="pipeline")
    yield handle(**_VISIBILITY, label="visibility; dotted: thresholds (c)")
    if battery_level(record) is not None:
        yield handle(color=_BATTERY_COLOUR, lw=1.0, ls="--", label="battery (c)")
        yield handle(color=_BATTERY_COLOUR, lw=0, marker="P", ms=5, label="recharge station")
    yield handle(color=style.BLACK, lw=0, marker="o", ms=4, label="start")
    if adaptations(record):
        yield handle(color=style.BLACK, lw=0, marker="v", ms=4, mfc="white", label="adaptation")
    for mark in marks:
        symbol = rf"$\mathbf{{{mark.letter}}}$"
        yield handle(lw=0, marker=symbol, color=mark.colour, ms=5, label=mark.text)


def mode_colours(record: MissionRecord) -> dict[str, str]:
    """Return a colour for each mode, in the order of appearance; what does not move the vehicle is
    grey.
    """
    known = style.MODE_COLOURS | dict.fromkeys(_IDLE_MODES, style.GREY)
    others = cycle(style.OTHER_MODES)
    modes = record.trajectory["mode"].unique()
    return {mode: known.get(mode) or next(others) for mode in modes}


def _marks(record: MissionRecord) -> Iterator[_Mark]:
    """Yield the events that are marked: the detection, failures, recoveries from these, and the
    battery's limits.
    """
    detected = happenings(record, events.PipelineDetected)
    found = [(t_s, "pipeline detected", style.BLACK) for t_s, _ in detected]
    for t_s, crossing in happenings(record, events.BatteryCrossing):
        text = "battery low" if crossing.change.startswith("falls") else "recharged"
        found.append((t_s, text, _BATTERY_COLOUR))
    for t_s, component, is_failed in component_changes(record):
        what, colour = ("failed", style.VERMILION) if is_failed else ("recovered", style.BLACK)
        found.append((t_s, f"{component_words(component)} {what}", colour))
    way = record.trajectory
    for letter, (t_s, text, colour) in zip(
        ascii_uppercase, sorted(found, key=lambda each: each[0]), strict=False
    ):
        x_m, y_m = (float(np.interp(t_s, way["t_s"], way[axis])) for axis in ("x_m", "y_m"))
        yield _Mark(letter, t_s, x_m, y_m, f"{text}, {t_s:.0f} s", colour)


def _way_look(colours: dict[str, str], mode: str) -> style.Look:
    """Return the style of a stretch of the path: line widths distinguish the search altitudes
    without colours.
    """
    is_own = mode not in style.MODE_COLOURS and mode not in _IDLE_MODES
    width = style.MODE_WIDTHS.get(mode, 1.2)
    return {"color": colours.get(mode, style.GREY), "lw": width, "ls": "--" if is_own else "-"}


def _draw_way(
    axes: Axes, record: MissionRecord, colours: dict[str, str], across: str, up: NDArray[np.float64]
) -> None:
    """Draw the vehicle's path, each stretch in its mode's colour and joined to the next."""
    places = record.trajectory[across].to_numpy()
    first = 0
    for mode, points in groupby(record.trajectory["mode"]):
        last = first + len(list(points))
        stretch = slice(first, last + 1)
        axes.plot(places[stretch], up[stretch], solid_capstyle="round", **_way_look(colours, mode))
        first = last


def _draw_plan(axes: Axes, record: MissionRecord, colours: dict[str, str]) -> None:
    x_m, y_m = np.array(record.settings.pipeline.vertices_m)[:, :2].T
    axes.plot(x_m, y_m, **_PIPELINE, solid_capstyle="round", zorder=1.5)
    axes.set_aspect("equal")
    _draw_way(axes, record, colours, "x_m", record.trajectory["y_m"].to_numpy())
    start = record.trajectory.iloc[0]
    axes.plot(start["x_m"], start["y_m"], "o", color=style.BLACK, ms=4)
    if battery := record.settings.battery:
        axes.plot(
            battery.station_x_m,
            battery.station_y_m,
            "P",
            color=_BATTERY_COLOUR,
            ms=5,
            zorder=3,
        )
    axes.set(xlabel="x, east (m)", ylabel="y, north (m)")


def _draw_letters(axes: Axes, marks: Sequence[_Mark], frame: Bbox) -> None:
    """Mark events on the map; letters of events at nearly the same place stand apart."""
    axes.set(xlim=(frame.x0, frame.x1), ylim=(frame.y0, frame.y1))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(5, integer=True))
    points_per_m = 72.0 * axes.get_position().width * style.WIDTH_IN / frame.width
    # In points: the lower left corners of letters, and of boxes around the markers that are drawn
    # already.
    markers = np.concatenate(
        [each.get_xydata() for each in axes.lines if each.get_marker() in ("o", "v")]
    )
    taken = [(x - _LETTER_POINTS / 3, y - _LETTER_POINTS / 3) for x, y in markers * points_per_m]

    def is_free(x: float, y: float) -> bool:
        return all(
            abs(x - other[0]) > _LETTER_POINTS or abs(y - other[1]) > _LETTER_POINTS
            for other in taken
        )

    for mark in marks:
        if frame.contains(mark.x_m, mark.y_m):
            axes.plot(
                mark.x_m, mark.y_m, "o", color=mark.colour, ms=3.5, mec="white", mew=0.6, zorder=4
            )
            x = mark.x_m * points_per_m
            y = mark.y_m * points_per_m
            free = (offset for offset in _LETTER_OFFSETS if is_free(x + offset[0], y + offset[1]))
            offset = next(free, _LETTER_OFFSETS[0])
            taken.append((x + offset[0], y + offset[1]))
            look = {"color": mark.colour, "zorder": 5, **_LETTER}
            axes.annotate(
                mark.letter, (mark.x_m, mark.y_m), offset, textcoords="offset points", **look
            )


def _search_frame(record: MissionRecord) -> Bbox:
    """Return the frame around the vehicle's path until detection and the detected point, with a
    margin.
    """
    way = record.trajectory
    metrics = record.metrics
    search = way.loc[way["t_s"] <= metrics["search_time_s"], ["x_m", "y_m"]].to_numpy(float)
    if metrics["pipeline_found"]:
        search = np.vstack([search, [metrics["detection_x_m"], metrics["detection_y_m"]]])
    return Bbox([search.min(axis=0) - _ZOOM_MARGIN_M, search.max(axis=0) + _ZOOM_MARGIN_M])


def _draw_adaptations(
    axes: Axes, record: MissionRecord, colours: dict[str, str], across: str, up: str
) -> None:
    """Mark where or when modes changed, in the colour of the new one."""
    way = record.trajectory.assign(altitude_m=record.trajectory["z_m"] - SEA_BED_Z_M)
    for each in adaptations(record):
        x, y = (float(np.interp(each.t_s, way["t_s"], way[name])) for name in (across, up))
        axes.plot(
            x,
            y,
            "v",
            color=style.BLACK,
            mfc=colours.get(each.after, "white"),
            ms=4.5,
            mew=0.7,
            zorder=3.5,
        )


def _draw_over_time(
    axes: Axes, record: MissionRecord, colours: dict[str, str], marks: Sequence[_Mark]
) -> None:
    way = record.trajectory
    altitude_m = way["z_m"].to_numpy() - SEA_BED_Z_M
    _draw_visibility(axes, record)
    _draw_way(axes, record, colours, "t_s", altitude_m)
    _draw_adaptations(axes, record, colours, "t_s", "altitude_m")
    tallest = max(altitude_m.max(), way["visibility_m"].max())
    rows = _letter_rows([mark.t_s for mark in marks], 0.028 * record.end_s)
    top = tallest * (1.06 + _LETTER_ROW_SHARE * (max(rows, default=0) + 1))
    for mark, row in zip(marks, rows, strict=True):
        axes.axvline(mark.t_s, color=mark.colour, lw=0.7, ls=":")
        box = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
        height = top * (1.0 - _LETTER_ROW_SHARE * row)
        look: style.Look = {"color": mark.colour, "bbox": box, **_LETTER}
        axes.text(mark.t_s, height, mark.letter, ha="center", va="top", **look)
    axes.set(
        ylim=(0.0, top),
        xlim=(0.0, record.end_s),
        xlabel="mission time (s)",
        ylabel="altitude; visibility (m)",
    )
    if (level := battery_level(record)) is not None:
        beside = axes.twinx()
        beside.plot(way["t_s"], 100.0 * level, color=_BATTERY_COLOUR, lw=1.0, ls="--")
        beside.set(
            ylim=(0.0, 100.0 * top / tallest), yticks=(0, 25, 50, 75, 100), ylabel="battery (%)"
        )
        beside.grid(False)
        beside.spines["right"].set_visible(True)


def _draw_visibility(axes: Axes, record: MissionRecord) -> None:
    for threshold_m in record.settings.reaction_metric.visibility_thresholds_m:
        axes.axhline(threshold_m, color="#B5B5B5", lw=0.7, ls=":", zorder=1)
    way = record.trajectory
    axes.plot(
        way["t_s"], way["visibility_m"], **_VISIBILITY, label="visibility; dotted: thresholds"
    )


def _letter_rows(times_s: Sequence[float], near_s: float) -> list[int]:
    """Return the row of each letter over time: one that would touch another goes into the next
    row.
    """
    last_s: list[float] = []
    rows = []
    for time_s in times_s:
        row = next((row for row, t_s in enumerate(last_s) if time_s - t_s >= near_s), len(last_s))
        last_s[row : row + 1] = [time_s]
        rows.append(row)
    return rows


# Over time

_BAR = 0.62
_BAR_POINTS = 6.5
_LETTER_IN, _LINES_IN = _BAR_POINTS * 0.55 / 72.0, style.WIDTH_IN * 0.86
"""Widths of a letter of a bar's text, about half its size, and of all lines."""
_LISTED = 26
"""Adaptations that are listed; a manager that changes modes all the time has more."""
_COLUMN_LETTERS = 66
"""Longest line of which two stand side by side."""
_FAILED, _TASK, _ON = style.VERMILION, "#D9D9D9", "#9ECAE1"

Rules = Mapping[tuple[float, str], Sequence[str]]
"""Names of the rules that made a function be adapted, by time (s) and function."""
_TimelineRow = tuple[str, list[tuple[Span, str, str]]]
"""A line of the chart: its name, and spans with colour and text."""


def draw_timeline(record: MissionRecord, rules: Rules = MappingProxyType({})) -> style.Picture:
    """Draw a mission over time, with the rules that caused adaptations where they are known."""
    lines = list(_lines(record))
    changes = adaptations(record)
    listed = changes[:_LISTED]
    sentences = _sentences(changes, rules)
    columns = 2 if len(listed) > 6 and max(map(len, sentences)) <= _COLUMN_LETTERS else 1
    list_in = 0.17 * -(-len(sentences) // columns) + 0.1 if changes else 0.01
    battery_in = [] if battery_level(record) is None else [0.7]
    heights = [1.9, *battery_in, 0.24 * len(lines) + 0.2, list_in]
    figure = style.Picture(sum(heights) + 0.9)
    *upper, bars, below = figure.subplots(len(heights), 1, height_ratios=heights)
    altitude, *battery = upper
    _draw_altitude(altitude, record, listed)
    for axes in battery:
        way = record.trajectory
        axes.plot(way["t_s"], 100.0 * way["battery_level"], color=style.GREEN, lw=1.2)
        axes.set(ylabel="battery (%)", ylim=(0, 105))
    _draw_lines(bars, lines)
    for axes in upper:
        axes.tick_params(labelbottom=False)
    for axes in (*upper, bars):
        axes.set_xlim(0.0, record.end_s)
        for each in changes:
            axes.axvline(each.t_s, color="#777777", lw=0.5, ls=":", zorder=1)
    bars.set_xlabel("mission time (s)")
    altitude.set_title(style.text(record.name), pad=16)
    _draw_list(below, sentences, columns)
    return figure


def _draw_altitude(axes: Axes, record: MissionRecord, listed: Sequence[Adaptation]) -> None:
    """Draw visibility and its thresholds, the requested altitude and that flown, and letters for
    adaptations.
    """
    way = record.trajectory
    _draw_visibility(axes, record)
    times_s, asked_m = _altitude_asked_for(record)
    axes.step(times_s, asked_m, where="post", color=style.BLACK, lw=0.9, label="requested altitude")
    axes.plot(
        way["t_s"], way["z_m"] - SEA_BED_Z_M, color=style.BLUE, lw=1.3, label="altitude flown"
    )
    found_s = record.metrics["search_time_s"]
    if record.metrics["pipeline_found"]:
        axes.axvline(found_s, color=style.BLACK, lw=0.9)
        is_late = found_s > 0.8 * record.end_s
        axes.annotate(
            "pipeline found",
            (found_s, 0.0),
            (-3 if is_late else 3, 3),
            textcoords="offset points",
            ha="right" if is_late else "left",
            fontsize=7,
        )
    axes.set_ylabel("altitude; visibility (m)")
    axes.set_ylim(0.0, axes.get_ylim()[1] * 1.12)  # with room for the letters above the curves
    axes.legend(
        loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.2, handlelength=2.4
    )
    rows = _letter_rows([each.t_s for each in listed], 0.022 * record.end_s)
    for letter, each, row in zip(ascii_uppercase, listed, rows, strict=False):
        axes.annotate(
            letter,
            (each.t_s, 1.0),
            (0, -2 - 8 * row),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            fontsize=7,
            weight="bold",
            ha="center",
            va="top",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
        )


def _altitude_asked_for(record: MissionRecord) -> tuple[list[float], list[float]]:
    """Return the requested altitude above the sea bed over time, nan where there was none."""
    follow_m = record.settings.revision.follow.altitude_m
    asked: dict[str, float] = {}
    times_s = [0.0]
    altitudes_m = [np.nan]
    changes = [
        (span.begin_s, function, span.what)
        for function, spans in mode_spans(record).items()
        for span in spans
    ]
    for t_s, function, mode in sorted(changes):
        if function in (GENERATE_SEARCH_PATH, FOLLOW_PIPELINE):
            asked.pop(function, None)
            if function_mode_words(function, mode) != "off":
                spiral_m = record.search_altitudes_m.get(mode, np.nan)
                asked[function] = spiral_m if function == GENERATE_SEARCH_PATH else follow_m
            times_s.append(t_s)
            altitudes_m.append(next(reversed(asked.values()), np.nan))
    return [*times_s, record.end_s], [*altitudes_m, altitudes_m[-1]]


def _lines(record: MissionRecord) -> Iterator[_TimelineRow]:
    """Yield the lines of the chart: tasks, the modes of each function, and failures."""
    yield "task", [(span, _TASK, plain(span.what)) for span in task_spans(record)]
    colours = style.MODE_COLOURS | mode_colours(record)
    for function, spans in mode_spans(record).items():
        bars = []
        for span in spans:
            words = function_mode_words(function, span.what)
            if words != "off":
                bars.append((span, _mode_colour(function, span.what, colours), words))
        yield function_words(function), bars
    for component, spans in sorted(failure_spans(record).items()):
        yield component_words(component), [(span, _FAILED, "failed") for span in spans]


def _mode_colour(function: str, mode: str, colours: Mapping[str, str]) -> str:
    """Return the colour of a mode's bar: of what moves the vehicle as on the map."""
    if mode in colours and function in (GENERATE_SEARCH_PATH, FOLLOW_PIPELINE):
        return colours[mode]
    return style.ORANGE if "recover" in mode else _ON


def _draw_lines(axes: Axes, lines: Sequence[_TimelineRow]) -> None:
    """Draw lines of bars, with a legend of those whose texts have no room."""
    end_s = max((span.end_s for _, bars in lines for span, _, _ in bars), default=1.0)
    legend: dict[str, str] = {}
    for row, (name, bars) in enumerate(lines):
        if not _draw_bars(axes, row, bars, end_s):
            legend |= {style.text(f"{name}: {words}"): colour for _, colour, words in bars}
    if legend:
        _show_colours(axes, legend)
    axes.set_yticks(range(len(lines)), [style.text(name) for name, _ in lines])
    axes.set_ylim(len(lines) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)


def _draw_bars(axes: Axes, row: int, bars: Sequence[tuple[Span, str, str]], end_s: float) -> bool:
    """Draw a bar for each span, and the texts in them or behind them if there is room for each.

    Returns:
        whether there is.
    """
    look: style.Look = {"edgecolor": "white", "lw": 0.6, "zorder": 2}
    for span, colour, _ in bars:
        axes.barh(row, span.end_s - span.begin_s, _BAR, span.begin_s, color=colour, **look)
    texts = list(_bar_texts(bars, end_s))
    if {label for label, *_ in texts} != {style.text(words) for *_, words in bars}:
        return False
    look = {"va": "center", "fontsize": _BAR_POINTS, "zorder": 3, "clip_on": True}
    for label, begin_s, ink in texts:
        axes.text(begin_s, row, label, color=ink, **look)
    return True


def _show_colours(axes: Axes, colours: Mapping[str, str]) -> None:
    """Draw a legend of colours above the bars."""
    axes.legend(
        handles=[Patch(color=colour, label=label) for label, colour in colours.items()],
        ncols=5 if max(map(len, colours)) <= 20 else 4,
        handlelength=1.2,
        columnspacing=1.2,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.2,
    )


def _bar_texts(
    bars: Sequence[tuple[Span, str, str]], end_s: float
) -> Iterator[tuple[str, float, str]]:
    """Yield text, beginning (s) and colour of it for each bar that has room for it, in the bar or
    behind it.
    """
    letter_s = _LETTER_IN / _LINES_IN * end_s
    ends_s = [*(span.begin_s for span, _, _ in bars[1:]), end_s]
    for (span, colour, words), next_s in zip(bars, ends_s, strict=True):
        label = style.text(words)
        text_s = len(label) * letter_s
        length_s = span.end_s - span.begin_s
        if 0.0 < length_s >= text_s:
            luminance = np.dot((0.299, 0.587, 0.114), to_rgb(colour))
            yield label, span.begin_s + 1.0, style.BLACK if luminance > 0.5 else "white"
        elif next_s - span.end_s > text_s:
            yield label, span.end_s + 1.0, style.BLACK


def _draw_list(axes: Axes, sentences: Sequence[str], columns: int) -> None:
    axes.set_axis_off()
    rows = -(-len(sentences) // columns)
    for place, text in enumerate(sentences):
        column, row = divmod(place, rows)
        letter = "" if place >= _LISTED else f"{ascii_uppercase[place]}  "
        axes.text(
            column / columns,
            1.0 - row / rows,
            style.text(letter + text),
            va="top",
            fontsize=6.5,
            transform=axes.transAxes,
        )


def _sentences(changes: Sequence[Adaptation], rules: Rules) -> list[str]:
    """Write the first adaptations as text, and how many more there are."""
    found = [
        _sentence(each, rules.get((each.t_s, each.function), ())) for each in changes[:_LISTED]
    ]
    more = len(changes) - _LISTED
    return [*found, f"and {more} more"] if more > 0 else found


def _sentence(each: Adaptation, rules: Sequence[str]) -> str:
    before, after = (function_mode_words(each.function, mode) for mode in (each.before, each.after))
    cause = f"rule {', '.join(rules)}" if rules else each.cause
    because = f" ({cause})" if cause else ""
    return f"{each.t_s:.0f} s  {function_words(each.function)}: {before} to {after}{because}"
