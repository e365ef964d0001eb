"""The paths of many missions over each other, with where they found the pipeline."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from suave_des.report import style
from suave_des.report.mission_record import MissionRecord

_PIPELINE_COLOUR = "#CFCFCF"
_MARGIN_M = 1.0


def draw_paths(records: Sequence[MissionRecord]) -> style.Picture:
    """Draw the paths of missions, a panel for each manager, over the part of the sea bed that they search.

    Args:
        records: of missions; the pipeline is that of the first.
    """
    managers = list(dict.fromkeys(str(record.metrics["manager"]) for record in records))
    columns = min(len(managers), 3)
    rows = -(-len(managers) // columns)
    searches = [_search(record) for record in records]
    low = np.min([search.min(axis=0) for search in searches], axis=0) - _MARGIN_M
    high = np.max([search.max(axis=0) for search in searches], axis=0) + _MARGIN_M
    shape = (high[1] - low[1]) / (high[0] - low[0])
    height = rows * (style.WIDTH_IN / columns * shape * 0.85 + 0.55) + 0.3
    figure = style.Picture(figsize=(style.WIDTH_IN, min(height, 9.5)), layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    vertices = np.array(records[0].scenario["pipeline"]["vertices_m"])
    for axes in panels.ravel()[len(managers) :]:
        axes.set_visible(False)
    for number, (axes, manager) in enumerate(zip(panels.ravel(), managers, strict=False)):
        own = [record for record in records if str(record.metrics["manager"]) == manager]
        colour = style.line(number)["color"]
        axes.plot(vertices[:, 0], vertices[:, 1], color=_PIPELINE_COLOUR, lw=4, solid_capstyle="round", zorder=1)
        for record in own:
            search = _search(record)
            axes.plot(search[:, 0], search[:, 1], color=colour, lw=0.7, alpha=max(0.12, min(0.9, 4.0 / len(own))))
        found = [record.metrics for record in own if record.metrics["pipeline_found"]]
        seen = np.array([[each["detection_x_m"], each["detection_y_m"]] for each in found], dtype=float).reshape(-1, 2)
        axes.plot(seen[:, 0], seen[:, 1], "o", color=style.BLACK, ms=3, mew=0, alpha=0.6, zorder=4)
        starts = np.array([search[0] for search in map(_search, own)])
        axes.plot(starts[:, 0], starts[:, 1], "s", color=style.BLACK, mfc="white", ms=3, mew=0.7, zorder=4)
        axes.set_title(style.text(f"{manager}: {len(found)} of {len(own)} found it"))
        axes.set_aspect("equal")
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    for axes in panels[-1]:
        axes.set_xlabel("x, east (m)")
    for axes in panels[:, 0]:
        axes.set_ylabel("y, north (m)")
    handles = [
        Line2D([], [], color=style.GREY, lw=0.9, label="way until the pipeline was found"),
        Line2D([], [], color=_PIPELINE_COLOUR, lw=4, label="pipeline"),
        Line2D([], [], color=style.BLACK, lw=0, marker="s", ms=3, mfc="white", label="start"),
        Line2D([], [], color=style.BLACK, lw=0, marker="o", ms=3, label="point seen first"),
    ]
    figure.legend(handles=handles, loc="outside upper right", ncols=4)
    return figure


def _search(record: MissionRecord) -> NDArray[np.float64]:
    """Return the way of a mission until it found the pipeline, or ended."""
    way = record.trajectory
    found_s = float(record.metrics["search_time_s"])
    return np.asarray(way.loc[way["t_s"] <= found_s, ["x_m", "y_m"]], dtype=float)
