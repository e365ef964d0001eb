"""A mission's map: the pipeline, the vehicle's way coloured by mode, what happened where, and altitude over time."""

from __future__ import annotations

import json
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass
from itertools import cycle, groupby
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator, MultipleLocator
from matplotlib.transforms import Bbox

from suave_des.domain import SEA_BED_Z_M
from suave_des.errors import InputError
from suave_des.report import style

_NUMBERS = ("t_s", "x_m", "y_m", "z_m", "visibility_m")
_METRICS = (
    *("scenario", "manager", "run", "seed", "search_time_s", "pipeline_found"),
    *("detection_x_m", "detection_y_m"),
)
_MISSING = {"visibility_m": [""], "battery_level": [""]}
_REMEDY = "give the --out folder of suave-des run"
_IDLE_MODES = ("", "fd_unground")
_ZOOM_MARGIN_M = 0.6
_PIPELINE_COLOUR, _PIPELINE_WIDTH = "#CFCFCF", 4.0
_VISIBILITY_COLOUR = "#A8A8A8"
_BATTERY, _BATTERY_COLOUR = "battery_level", style.PURPLE


@dataclass(frozen=True)
class MissionRecord:
    """One mission as its files describe it.

    Attributes:
        metrics: its row of runs.csv, by column.
        scenario: the scenario in full.
        events: events.csv.
        trajectory: trajectory.csv; mode is empty before the first one.
    """

    metrics: dict[str, Any]
    scenario: dict[str, Any]
    events: pandas.DataFrame
    trajectory: pandas.DataFrame


def read_mission(folder: Path) -> MissionRecord:
    """Read mission.json, events.csv and trajectory.csv.

    Raises:
        InputError: one of them is missing, or is not what a mission writes.
    """
    path = folder / "mission.json"
    try:
        mission = json.loads(path.read_text(encoding="utf-8"))
        metrics, scenario = mission["metrics"], mission["scenario"]
        np.array(scenario["pipeline"]["vertices_m"], dtype=float)
        _check_columns(path, _METRICS, metrics)
    except FileNotFoundError:
        raise InputError("no such file", file=path, remedy=_REMEDY) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"is not the record of a mission: {error}", file=path, remedy=_REMEDY) from None
    events = _table(folder / "events.csv", ("t_s", "source", "event", "detail"))
    trajectory = _table(
        folder / "trajectory.csv", ("t_s", "x_m", "y_m", "z_m", "mode", "visibility_m"), optional=(_BATTERY,)
    )
    return MissionRecord(metrics, scenario, events, trajectory)


def _check_columns(path: Path, needed: Iterable[str], found: Container[str]) -> None:
    for name in needed:
        if name not in found:
            raise InputError(f"{name} is missing", file=path, remedy=_REMEDY)


def _table(path: Path, columns: tuple[str, ...], optional: tuple[str, ...] = ()) -> pandas.DataFrame:
    """Read a table of which `columns` are needed; those of _NUMBERS have finite numbers, the others are text.

    Columns of `optional` have finite numbers where they are there.
    """
    text = {name: "str" for name in columns if name not in _NUMBERS}
    try:
        # "none" and "nan" may be words here, so that only numbers have something that counts as missing.
        frame = pandas.read_csv(path, dtype=text, keep_default_na=False, na_values=_MISSING)
    except FileNotFoundError:
        raise InputError("no such file", file=path, remedy=_REMEDY) from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy=_REMEDY) from None
    _check_columns(path, columns, frame.columns)
    if frame.empty:
        raise InputError("is empty", file=path, remedy=_REMEDY)
    for name in (*(set(columns) & set(_NUMBERS)), *(set(optional) & set(frame.columns))):
        is_wrong = ~np.isfinite(pandas.to_numeric(frame[name], errors="coerce")) & frame[name].notna()
        for row in np.flatnonzero(is_wrong)[:1]:
            problem = f"{name}: expected a finite number, got {str(frame[name].iloc[row])!r}"
            raise InputError(problem, file=path, place=f"line {row + 2}", remedy=_REMEDY)
    return frame


@dataclass(frozen=True, slots=True)
class _Mark:
    """Something that happened, to be marked on the map and over time."""

    letter: str
    t_s: float
    x_m: float
    y_m: float
    text: str
    colour: str


def draw(folder: Path) -> Figure:
    """The map of the mission in a folder.

    Raises:
        InputError: the folder has no complete record of a mission.
    """
    record = read_mission(folder)
    colours = _mode_colours(record)
    marks = list(_marks(record))
    figure = Figure(figsize=(style.WIDTH_IN, 5.2), layout="constrained")
    whole, zoom, time = (
        figure.add_subplot(place)
        for grid in [figure.add_gridspec(2, 2, height_ratios=(1.15, 1.0), width_ratios=(1.0, 1.75))]
        for place in (grid[0, :], grid[1, 0], grid[1, 1])
    )
    search = _search_frame(record)
    _draw_map(whole, record, colours, search)
    _draw_zoom(zoom, record, colours, marks, search)
    _draw_over_time(time, record, colours, marks)
    metrics = record.metrics
    whole.set_title(
        f"a   Mission: {metrics['scenario']}, {metrics['manager']}, run {metrics['run']}, seed {metrics['seed']}"
    )
    zoom.set_title("b   Search")
    has_battery = _BATTERY in record.trajectory
    if has_battery:
        _draw_battery(time, record)
    time.set_title("c   Altitude, visibility and battery" if has_battery else "c   Altitude and visibility")
    handles = _legend(colours, marks, has_battery=has_battery)
    whole.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    return figure


def _legend(colours: dict[str, str], marks: list[_Mark], *, has_battery: bool) -> list[Line2D]:
    named = [(mode, colour) for mode, colour in colours.items() if mode not in _IDLE_MODES]
    if len(named) < len(colours):
        named.append(("no mode that moves it", style.GREY))
    lines = [Line2D([], [], color=colour, lw=1.6, label=name) for name, colour in named]
    lines.append(Line2D([], [], color=_PIPELINE_COLOUR, lw=_PIPELINE_WIDTH, label="pipeline"))
    lines.append(Line2D([], [], color=_VISIBILITY_COLOUR, lw=1.0, label="visibility (c)"))
    if has_battery:
        lines.append(Line2D([], [], color=_BATTERY_COLOUR, lw=1.0, ls="--", label="battery (c)"))
    lines.append(Line2D([], [], color=style.BLACK, lw=0, marker="o", ms=4, label="start"))
    for mark in marks:
        symbol = rf"$\mathbf{{{mark.letter}}}$"
        lines.append(Line2D([], [], lw=0, marker=symbol, color=mark.colour, ms=5, label=mark.text))
    return lines


def _mode_colours(record: MissionRecord) -> dict[str, str]:
    """A colour for each mode, in the order of appearance; what does not move the vehicle is grey."""
    modes = list(dict.fromkeys(record.trajectory["mode"]))
    known = style.MODE_COLOURS | dict.fromkeys(_IDLE_MODES, style.GREY)
    others = zip([mode for mode in modes if mode not in known], cycle(style.OTHER_MODES), strict=False)
    colours = known | dict(others)
    return {mode: colours[mode] for mode in modes}


def _marks(record: MissionRecord) -> Iterator[_Mark]:
    way = record.trajectory
    for letter, (t_s, text, colour) in zip(ascii_uppercase, _told(record.events), strict=False):
        x_m, y_m = (float(np.interp(t_s, way["t_s"], way[axis])) for axis in ("x_m", "y_m"))
        yield _Mark(letter, t_s, x_m, y_m, f"{text}, {t_s:.0f} s", colour)


def _told(events: pandas.DataFrame) -> Iterator[tuple[float, str, str]]:
    """Time, words and colour of what is worth a mark: the detection, failures, and recoveries of what had failed."""
    failed: set[str] = set()
    for t_s, event, detail in zip(events["t_s"], events["event"], events["detail"], strict=True):
        component, _, status = detail.partition(" ")
        name = component.removeprefix("c_").replace("_", " ")
        if event == "pipeline_detected":
            yield t_s, "pipeline detected", style.BLACK
        elif event == "battery_crossing" and detail.startswith("falls"):
            yield t_s, "battery low", _BATTERY_COLOUR
        elif event == "battery_crossing":
            yield t_s, "recharged", _BATTERY_COLOUR
        elif event == "component_status" and status == "FALSE":
            failed.add(component)
            yield t_s, f"{name} failed", style.VERMILION
        elif event == "component_status" and component in failed:
            failed.remove(component)
            yield t_s, f"{name} recovered", style.BLACK


def _draw_way(axes: Axes, record: MissionRecord, colours: dict[str, str], across: str, up: str) -> None:
    """The vehicle's way, each stretch in its mode's colour and joined to the next."""
    way = record.trajectory
    modes = way["mode"].tolist()
    first = 0
    for mode, points in groupby(modes):
        last = first + len(list(points))
        stretch = way.iloc[first : last + 1]
        axes.plot(stretch[across], stretch[up], color=colours[mode], solid_capstyle="round")
        first = last


def _draw_plan(axes: Axes, record: MissionRecord, colours: dict[str, str]) -> None:
    """What both maps show."""
    vertices = np.array(record.scenario["pipeline"]["vertices_m"])
    axes.plot(
        vertices[:, 0], vertices[:, 1], color=_PIPELINE_COLOUR, lw=_PIPELINE_WIDTH, solid_capstyle="round", zorder=1.5
    )
    _draw_way(axes, record, colours, "x_m", "y_m")
    start = record.trajectory.iloc[0]
    axes.plot(start["x_m"], start["y_m"], "o", color=style.BLACK, ms=4)
    axes.set_aspect("equal")
    axes.set_xlabel("x, east (m)")
    axes.set_ylabel("y, north (m)")


def _draw_letters(axes: Axes, marks: list[_Mark], frame: Bbox) -> None:
    for mark in marks:
        if not frame.contains(mark.x_m, mark.y_m):
            continue
        axes.plot(mark.x_m, mark.y_m, "o", color=mark.colour, ms=3.5, mec="white", mew=0.6, zorder=4)
        axes.annotate(
            mark.letter,
            (mark.x_m, mark.y_m),
            xytext=(4, 4),
            textcoords="offset points",
            color=mark.colour,
            weight="bold",
            fontsize=8,
            zorder=5,
        )


def _draw_map(axes: Axes, record: MissionRecord, colours: dict[str, str], frame: Bbox) -> None:
    """The whole mission, with the frame of the search's map."""
    _draw_plan(axes, record, colours)
    axes.add_patch(Rectangle(frame.p0, frame.width, frame.height, fill=False, ec=style.GREY, lw=0.7))
    axes.annotate("b", (frame.x0, frame.y1), (2, -8), textcoords="offset points", fontsize=7.5, color=style.GREY)
    axes.yaxis.set_major_locator(MultipleLocator(5.0))


def _draw_zoom(axes: Axes, record: MissionRecord, colours: dict[str, str], marks: list[_Mark], frame: Bbox) -> None:
    """The surroundings of the search."""
    _draw_plan(axes, record, colours)
    _draw_letters(axes, marks, frame)
    axes.set_xlim(frame.x0, frame.x1)
    axes.set_ylim(frame.y0, frame.y1)
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))


def _search_frame(record: MissionRecord) -> Bbox:
    """Where the vehicle was until the pipeline was found, and the point of it that was seen, with a margin."""
    way = record.trajectory
    search = way.loc[way["t_s"] <= record.metrics["search_time_s"], ["x_m", "y_m"]].to_numpy()
    if record.metrics["pipeline_found"]:
        seen = [record.metrics["detection_x_m"], record.metrics["detection_y_m"]]
        search = np.vstack([search, seen])
    return Bbox([search.min(axis=0) - _ZOOM_MARGIN_M, search.max(axis=0) + _ZOOM_MARGIN_M])


def _draw_battery(axes: Axes, record: MissionRecord) -> None:
    """The battery's level over time, on an axis of its own."""
    level = axes.twinx()
    level.plot(record.trajectory["t_s"], record.trajectory[_BATTERY], color=_BATTERY_COLOUR, lw=1.0, ls="--")
    level.grid(visible=False)
    level.set_ylim(0.0, 1.18)
    level.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0])
    level.set_ylabel("battery level", color=_BATTERY_COLOUR)
    level.tick_params(axis="y", colors=_BATTERY_COLOUR)
    level.spines["right"].set_visible(True)


def _draw_over_time(axes: Axes, record: MissionRecord, colours: dict[str, str], marks: list[_Mark]) -> None:
    way = record.trajectory.assign(altitude_m=record.trajectory["z_m"] - SEA_BED_Z_M)
    axes.plot(way["t_s"], way["visibility_m"], color=_VISIBILITY_COLOUR, lw=1.0)
    _draw_way(axes, MissionRecord(record.metrics, record.scenario, record.events, way), colours, "t_s", "altitude_m")
    top = max(way["altitude_m"].max(), way["visibility_m"].max()) * 1.18
    for mark in marks:
        axes.axvline(mark.t_s, color=mark.colour, lw=0.7, ls=":")
        axes.text(
            mark.t_s,
            top,
            mark.letter,
            color=mark.colour,
            weight="bold",
            ha="center",
            va="top",
            fontsize=8,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
        )
    axes.set_ylim(0.0, top)
    axes.set_xlim(0.0, way["t_s"].iloc[-1])
    axes.set_xlabel("mission time (s)")
    axes.set_ylabel("altitude; visibility (m)")
