"""The exemplar's own results files (kas-lab/suave, revisions 2023 and 1.5), so that its users' scripts read ours.

There is a file for each manager, named as the missions in it, in a folder that has nothing else in it: scripts that
take all files of a folder, or compare one file with the others, find what they expect. The exemplar stamps each row
with the time of day. Ours must be the same each time, so mission number n of the campaign bears the time n seconds
after midnight of 1 January 2000. Seconds and metres are as in runs.csv, but for durations, which are whole seconds, and
for the search time when the pipeline was not found.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import datetime, timedelta
from typing import Any

from suave_des.campaign.missions import COLUMNS, Row
from suave_des.campaign.output import csv_pieces

SUAVE_FOLDER = "suave"

_FIRST_STAMP = datetime(2000, 1, 1)
# strftime's %b depends on the user's language; the exemplar's files are in English.
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")

_Mission = Mapping[str, Any]
"""A row of runs.csv by column, and with it time_limit_s and stamp."""


def _whole(seconds: float) -> float:
    """Whole seconds without a point, as the exemplar has them."""
    return int(seconds) if seconds == int(seconds) else seconds


def _position(mission: _Mission) -> str:
    return str((round(mission["initial_x_m"], 2), round(mission["initial_y_m"], 2)))


def _month_first(stamp: datetime) -> str:
    return f"{_MONTHS[stamp.month - 1]}-{stamp:%d-%Y-%H-%M-%S}"


def _day_first(stamp: datetime) -> str:
    return f"{stamp:%d}-{_MONTHS[stamp.month - 1]}-{stamp:%Y-%H-%M-%S}"


_Layout = Mapping[str, Callable[[_Mission], object]]

_LAYOUT_2023: _Layout = {
    "mission_name": lambda mission: f"time constrained {mission['manager']}",
    "datetime": lambda mission: _month_first(mission["stamp"]),
    "initial pos (x,y)": _position,
    "time budget (s)": lambda mission: _whole(mission["time_limit_s"]),
    # The program wrote -1 when the pipeline was not found; the published table has the limit instead.
    "time search (s)": lambda mission: _whole(mission["search_time_s"]) if mission["pipeline_found"] else -1,
    "distance inspected (m)": lambda mission: mission["distance_inspected_m"],
}
_LAYOUT_1_5: _Layout = {
    "mission name": lambda mission: f"suave {mission['manager']}",
    "datetime": lambda mission: _day_first(mission["stamp"]),
    "initial pos (x,y)": _position,
    "mission duration (s)": lambda mission: int(mission["mission_duration_s"]),
    "pipeline found": lambda mission: mission["pipeline_found"],
    # The program writes the mission's duration when the pipeline was not found.
    "time searching pipeline (s)": lambda mission: (
        _whole(mission["search_time_s"]) if mission["pipeline_found"] else int(mission["mission_duration_s"])
    ),
    "distance inspected (m)": lambda mission: mission["distance_inspected_m"],
    # The exemplar writes 0.0 when no reaction was completed.
    "mean reaction time (s)": lambda mission: mission["mean_reaction_time_s"] or 0.0,
}
_LAYOUTS = {"2023": _LAYOUT_2023}
_NAMES = {"2023": "time_constrained"}
_OUTSIDE_NAME = re.compile(r"[^A-Za-z0-9_.-]+")


def suave_file(revision: str, manager: str) -> str:
    """Return the name of a manager's file: the mission's name and the manager's, as in its first column.

    Example:
        suave_file("1.5", "metacontrol")  # "suave_metacontrol.csv"
    """
    return f"{_NAMES.get(revision, 'suave')}_{_OUTSIDE_NAME.sub('_', manager)}.csv"


def suave_pieces(revision: str, rows: Iterable[tuple[int, Row]], time_limit_s: float) -> Iterator[str]:
    """Yield the file's content, piece by piece.

    Args:
        revision: the scenario's; all but 2023 have the current layout, that of 1.5.
        rows: rows of runs.csv, each with the number of its mission in the campaign, from 1.
        time_limit_s: of the missions.
    """
    layout = _LAYOUTS.get(revision, _LAYOUT_1_5)
    missions = (
        {
            **dict(zip(COLUMNS, row, strict=False)),  # columns of drawn and swept parameters follow
            "time_limit_s": time_limit_s,
            "stamp": _FIRST_STAMP + timedelta(seconds=number),
        }
        for number, row in rows
    )
    return csv_pieces(tuple(layout), ([make(mission) for make in layout.values()] for mission in missions))
