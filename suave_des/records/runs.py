"""Missions, real or simulated, in the CSV files in which they come: how they are read, and the
exemplar's written.

The exemplar's runner (kas-lab/suave) writes a file for each manager and mission,
MANAGER_MISSION.csv, which its scripts look for by name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pandas
from numpy.typing import NDArray

from suave_des.arguments import plain_arguments
from suave_des.errors import InputError, did_you_mean, line_error, number_of, shown
from suave_des.files import csv_pieces, read_csv, rounded
from suave_des.records.metrics import (
    COLUMN_TYPES,
    DISTANCE,
    FOUND,
    REACTION_TIME,
    SEARCH_TIME,
    metric_of,
)

FRAME_COLUMNS = (
    "scenario",
    "manager",
    SEARCH_TIME,
    DISTANCE,
    "detection_x_m",
    FOUND,
    REACTION_TIME,
    "run",
    "seed",
)
"""Columns that every frame of missions has.

detection_x_m is nan where it is not known or nothing was detected; pipeline_found 1 or 0, and nan
where the file does not say; mean_reaction_time_s nan where nothing was reacted to or the file does
not say. run is nan, and scenario and seed, which are text, empty where the file does not say.
"""
TIME_LIMIT = "time_limit_s"
"""Column of frames whose file has it, and of the exemplar's file of 2023."""
MISSION = "mission"
"""Column of frames of the exemplar's files: its name of the mission, such as "suave_extended"."""
CONDITION = "condition"
"""Column of a frame of real missions: number of the condition, from 1."""
NUMBER_COLUMNS = (CONDITION, "block")
"""Columns of data files that may have that number."""
_DURATION = "mission_duration_s"
_POSITION = "initial pos (x,y)"
_START = ("initial_x_m", "initial_y_m")
_PLACE = r"^\(\s*([-+.0-9e]+)\s*,\s*([-+.0-9e]+)\s*\)$"
"""How the exemplar writes where a mission began: (-17.0, 2.57)."""
CSV_LIMIT_BYTES = 500_000_000
"""Of a file of results."""
_GREATEST = 1e12
"""Of numbers, as in scenarios."""

REMEDY = "one line for each mission, cells separated by commas"
"""For a file of results that is no CSV."""

CsvContent = tuple[list[str], Iterator[tuple[int, list[str]]], str]
"""Of a CSV file: its header, its rows, each with its line, and its SHA-256."""
_Mission = Mapping[str, Any]
"""A row of runs.csv by column, and with it time_limit_s, stamp, month, position, and the exemplar's
name.
"""


_RUN_INDEX = "run_idx"
"""Column of the exemplar's main branch (2026), by which its tests pair missions."""


def _whole(seconds: float) -> float:
    """Whole seconds without a point, as the exemplar has them."""
    return int(seconds) if seconds == int(seconds) else seconds


# The exemplar's columns: by which name we read each, if we do, and how it is written.
_Layout = Mapping[str, tuple[str, Callable[[_Mission], object]]]
_LAYOUT_2023: _Layout = {
    "mission_name": ("manager", lambda of: of["name"]),
    "datetime": ("", lambda of: f"{of['month']}-{of['stamp']:%d-%Y-%H-%M-%S}"),
    _POSITION: ("", lambda of: of["position"]),
    "time budget (s)": (TIME_LIMIT, lambda of: _whole(of[TIME_LIMIT])),
    # The program wrote -1 when the pipeline was not found; the published table has the limit
    # instead.
    "time search (s)": (SEARCH_TIME, lambda of: _whole(of[SEARCH_TIME]) if of[FOUND] else -1),
    "distance inspected (m)": (DISTANCE, lambda of: of[DISTANCE]),
}
_LAYOUT_1_5: _Layout = {
    "mission name": ("manager", lambda of: of["name"]),
    "datetime": ("", lambda of: f"{of['stamp']:%d}-{of['month']}-{of['stamp']:%Y-%H-%M-%S}"),
    _POSITION: ("", lambda of: of["position"]),
    "mission duration (s)": (_DURATION, lambda of: int(of[_DURATION])),
    "pipeline found": (FOUND, lambda of: of[FOUND]),
    # The program writes the mission's duration when the pipeline was not found.
    "time searching pipeline (s)": (
        SEARCH_TIME,
        lambda of: _whole(of[SEARCH_TIME]) if of[FOUND] else int(of[_DURATION]),
    ),
    "distance inspected (m)": (DISTANCE, lambda of: of[DISTANCE]),
    # The exemplar writes 0.0 when no reaction was completed.
    "mean reaction time (s)": (REACTION_TIME, lambda of: of[REACTION_TIME] or 0.0),
    _RUN_INDEX: ("", lambda of: of["run"]),
}
_OWN = {name: name for name in (*FRAME_COLUMNS, TIME_LIMIT)}
_LAYOUTS: tuple[Mapping[str, str], ...] = (
    _OWN,
    *(
        {ours: column for column, (ours, _) in layout.items() if ours}
        for layout in (_LAYOUT_2023, _LAYOUT_1_5)
    ),
)
"""Names of the columns in each kind of file, by ours; the three of _NEEDED are in every one."""
_NEEDED = ("manager", SEARCH_TIME, DISTANCE)
_INFERRED_PLACE = "detection_x_m_inferred"
"""Column of published runs, of which it is concluded what they saw first."""
_AVERAGES = ("average", "mean", "std")
"""First words of rows that sum up the missions of the exemplar's files."""


@dataclass(frozen=True)
class Runs:
    """Missions read from one or several files.

    Attributes:
        files: SHA-256 of each file's bytes, in hex, by its path.
        frame: a row for each mission with FRAME_COLUMNS and the further columns of the files; of
            one file, indexed by its line; of several real ones, with `condition` if the conditions
            are known.
        notes: what a reader of a comparison should know about the files.
    """

    files: Mapping[Path, str]
    frame: pandas.DataFrame
    notes: tuple[str, ...] = ()

    @property
    def managers(self) -> tuple[str, ...]:
        """In the order of their first missions."""
        return tuple(self.frame["manager"].unique())

    def choose(self, wanted: Sequence[str]) -> tuple[str, ...]:
        """Choose the managers to compare: those named, or all.

        Raises:
            InputError: one has no mission.
        """
        for manager in wanted:
            if manager not in self.managers:
                remedy = f"{did_you_mean(manager, self.managers, 'its managers')}; choose with --managers"
                problem = f"has no mission of manager {manager!r}"
                raise InputError(problem, file=", ".join(map(str, self.files)), remedy=remedy)
        return tuple(dict.fromkeys(wanted)) or self.managers

    def check_simulated(self) -> None:
        """Raise an InputError unless the missions of this file are of one scenario."""
        names = [name for name in self.frame["scenario"].unique() if name]
        if len(names) > 1:
            problem = f"has missions of several scenarios: {names[0]} and {names[1]}"
            line = self.frame.index[self.frame["scenario"] == names[1]][0]
            raise line_error(
                next(iter(self.files)), line, problem, "give the missions of one scenario"
            )
        check_one_mission(self.frame, ", ".join(map(str, self.files)))


def check_one_mission(frame: pandas.DataFrame, file: str) -> None:
    """Raise an InputError if one manager has several of the exemplar's missions, such as "suave"
    and "suave_extended".
    """
    for manager, names in frame.get(MISSION, pandas.Series(dtype=str)).groupby(frame["manager"]):
        kinds = [name for name in names.dropna().unique() if name]
        if len(kinds) > 1:
            problem = f"manager {manager} has missions of {kinds[0]} and of {kinds[1]}"
            raise InputError(problem, file=file, remedy="give the missions of one of them")


@plain_arguments
def read_runs(path: str | Path, needed: Sequence[str] = ()) -> Runs:
    """Read missions from a runs.csv, a file like the published seams2023_runs.csv, or the
    exemplar's own results.

    Search times are taken as they stand, but for the -1 with which revision 2023 says that nothing
    was found: the time limit stands for it, as in the published table. A file that has a time
    limit, but does not say which missions found the pipeline, has found it in those whose search
    took less. In files that are no campaign's a reaction time of 0 stands for no reaction. Rows of
    averages, blank rows and the header where it is repeated are left out. A column run_idx of the
    exemplar's pairs missions of one name, as a run's number and seed do those of a campaign.

    Example:
        missions = read_runs("simulated/runs.csv").frame
        missions.groupby("manager")["search_time_s"].mean()

    Args:
        path: of the file; columns that are no metrics are numbers where all their values are, and
            else text.
        needed: further columns that it must have, such as those of a sweep.

    Raises:
        InputError: with file and line: the file cannot be read, has other columns, no mission, or
            an impossible value.
    """
    path = Path(path)
    return runs_in(path, read_csv(path, CSV_LIMIT_BYTES, REMEDY), needed)


def runs_in(path: Path, content: CsvContent, needed: Sequence[str] = ()) -> Runs:
    """Take the missions from the content of a file; see read_runs."""
    header, numbered, digest = content
    layout = _layout_of(path, header, needed)
    rows = []
    lines = []
    averages = []
    for line, row in numbered:
        if layout is not _OWN and " ".join(row).split()[0].rstrip(":").lower() in _AVERAGES:
            averages.append(str(line))
        # else it is the header again, as in files that were put together
        elif layout[DISTANCE] not in row:
            if len(row) != len(header):
                problem = f"has {number_of(len(row), 'value')}, but the header has {len(header)}"
                remedy = "give each column a value, if only an empty one"
                raise line_error(path, line, problem, remedy)
            rows.append(row)
            lines.append(line)
    if not rows:
        raise line_error(path, 1, "has no missions under its header", REMEDY)
    text = pandas.DataFrame(rows, columns=header, index=lines, dtype=str)
    text = text.apply(lambda column: column.str.strip())
    notes = []
    if averages:
        which = "line" if len(averages) == 1 else "lines"
        notes = [f"{path}: {which} {', '.join(averages)} left out: averages, not missions"]
    return Runs({path: digest}, _Cells(path, text, layout).missions(), tuple(notes))


def _layout_of(path: Path, header: Sequence[str], needed: Sequence[str]) -> Mapping[str, str]:
    """Return the names of the columns in the kind of file that a header is of; check that it has
    those that are needed.
    """
    for column in filter(None, header):
        if header.count(column) > 1:
            raise line_error(path, 1, f"has column {shown(column)} twice", "name each column once")
    layout = max(_LAYOUTS, key=lambda layout: sum(layout[name] in header for name in _NEEDED))
    wanted = (*(layout[name] for name in _NEEDED), *needed)
    for column in wanted:
        if column not in header:
            remedy = f"the columns {', '.join(wanted)} are needed, separated by commas"
            raise line_error(path, 1, f"has no column {column!r}", remedy)
    return layout


def is_foreign(content: CsvContent) -> bool:
    """Return whether a file has none of the columns that name a manager."""
    return not {layout["manager"] for layout in _LAYOUTS} & set(content[0])


class _Cells:
    """The cells of a file, as text and indexed by line, with the names of its columns by ours."""

    def __init__(self, path: Path, text: pandas.DataFrame, layout: Mapping[str, str]) -> None:
        ours = {column: name for name, column in layout.items()}
        if "detection_x_m" not in text:
            ours[_INFERRED_PLACE] = "detection_x_m"
        self.path = path
        self._is_own = layout is _OWN
        self.text = text.rename(columns=ours)
        self.names = {name: column for column, name in ours.items()}

    def missions(self) -> pandas.DataFrame:
        """Check and convert the cells; a frame with FRAME_COLUMNS and the further ones. Errors name
        the line.
        """
        names = self.text["manager"]
        self._check("manager", names != "", "a manager's name")
        if not self._is_own:
            self._split_names([str(name) for name in names.unique()])
        limit_s = self._numbers(TIME_LIMIT, least=0.0) if TIME_LIMIT in self.text else None
        search_time_s = self._search_times_s(limit_s)
        values: dict[str, Any] = dict.fromkeys(FRAME_COLUMNS, math.nan) | {
            "scenario": "",
            "seed": "",
        }
        values |= {
            name: self._converted(name) for name in map(str, self.text) if name not in ("", FOUND)
        }
        values[SEARCH_TIME] = search_time_s
        values[DISTANCE] = self._numbers(DISTANCE, least=0.0)
        values[FOUND] = self._found(search_time_s, limit_s)
        if limit_s is not None:
            values[TIME_LIMIT] = limit_s
        if _RUN_INDEX in self.text and not self._is_own:
            values |= self._runs_of(names)
        frame = pandas.DataFrame(values, index=self.text.index)
        if "scenario" not in self.text:  # the exemplar writes 0.0 for none, a campaign nothing
            frame[REACTION_TIME] = frame[REACTION_TIME].where(frame[REACTION_TIME] > 0.0)
        return frame

    def _runs_of(self, names: pandas.Series[str]) -> dict[str, object]:
        """Take the exemplar's numbers of missions, unless one is there twice: those of one name and
        number have the same draws, whoever manages them.
        """
        numbers = self._numbers(_RUN_INDEX, is_whole=True)
        if pandas.DataFrame({"name": names, "run": numbers}).duplicated().any():
            return {}
        return {"run": numbers, "seed": names.str.rpartition(" ")[0]}

    def _search_times_s(self, limit_s: NDArray[np.float64] | None) -> NDArray[np.float64]:
        times_s = self._numbers(SEARCH_TIME)
        if limit_s is not None and not self._is_own:
            times_s = np.where(times_s == -1.0, limit_s, times_s)
        self._check(SEARCH_TIME, times_s >= 0.0, "a finite number, at least 0")
        return times_s

    def _found(
        self, search_time_s: NDArray[np.float64], limit_s: NDArray[np.float64] | None
    ) -> NDArray[np.float64] | float:
        """Return whether the pipeline was found: as the file says, or its time limits."""
        if FOUND in self.text:
            words = self.text[FOUND].str.lower()
            self._check(FOUND, words.isin(("true", "false")), "True or False")
            return np.asarray(words == "true", dtype=float)
        if limit_s is not None:
            return np.asarray(search_time_s < limit_s, dtype=float)
        return math.nan

    def _split_names(self, names: Sequence[str]) -> None:
        """Take the exemplar's names of missions apart: manager, mission, and where it began."""
        missions = {name: " ".join(name.split()[:-1]) for name in names}
        self.text[MISSION] = self.text["manager"].map(missions)
        self.text["manager"] = self.text["manager"].map({name: manager_of(name) for name in names})
        if _POSITION in self.text:
            places = self.text[_POSITION].str.extract(_PLACE).fillna("")
            self.text = self.text.assign(**{name: places[at] for at, name in enumerate(_START)})

    def _converted(self, name: str) -> Any:
        """Convert a column: a metric to numbers; another to numbers if all its cells are, to
        integers if these are.
        """
        text = self.text[name]
        if name in ("scenario", "manager", "seed", MISSION):
            return text
        if name == "run" or metric_of(name) is not None:
            is_whole = COLUMN_TYPES.get(name) == "int"
            return self._numbers(
                name, least=0.0 if is_whole else -math.inf, may_be_empty=True, is_whole=is_whole
            )
        numbers = _as_numbers(text)
        if not np.isfinite(numbers).all():
            return text
        are_whole = text.str.fullmatch("[+-]?[0-9]+").all() and np.abs(numbers).max() <= _GREATEST
        return pandas.Series(numbers.astype(np.int64) if are_whole else numbers, text.index)

    def _numbers(
        self,
        name: str,
        *,
        least: float = -math.inf,
        may_be_empty: bool = False,
        is_whole: bool = False,
    ) -> NDArray[np.float64]:
        """Convert a column; empty cells are nan."""
        numbers = _as_numbers(self.text[name])
        is_right = np.isfinite(numbers) & (numbers >= least) & (np.abs(numbers) <= _GREATEST)
        if is_whole:
            is_right &= numbers == np.round(numbers)
        if may_be_empty:
            is_right |= (self.text[name] == "").to_numpy()
        kind = "a whole number" if is_whole else "a finite number"
        ends = f"at least {least:g} and at most" if least > -math.inf else "at most"
        self._check(name, is_right, f"{kind}, {ends} {_GREATEST:g}")
        return numbers

    def _check(self, name: str, is_right: Iterable[bool], wanted: str) -> None:
        """Check a column; the error is about the first line that is wrong."""
        wrong = np.flatnonzero(~np.asarray(is_right, dtype=bool))
        if len(wrong):
            problem = f"{self.names.get(name, name)}: expected {wanted}, got {shown(self.text[name].iloc[wrong[0]])}"
            raise line_error(
                self.path,
                int(self.text.index[wrong[0]]),
                problem,
                "correct it, or leave the mission out",
            )


def _as_numbers(text: pandas.Series[str]) -> NDArray[np.float64]:
    """Convert cells to numbers; other cells, and those without a finite value, become nan or
    inf.
    """
    cells = text.to_list()
    together = "".join(cells)
    # else float() would accept more than numbers of a CSV file
    if together.isascii() and "_" not in together:
        with suppress(ValueError):
            return np.array([float(cell) if cell else math.nan for cell in cells])
    return pandas.to_numeric(text, errors="coerce").to_numpy(float)


# The exemplar's files, written.

_EXTENDED = "suave_extended"
"""The exemplar's mission with a battery and recharging; its other mission is called suave."""
_TREES = {"bt": "suave", "bt_extended": _EXTENDED}
"""Missions of the behaviour trees, of which the exemplar has one for each: both are its manager
bt.
"""
_OUTSIDE_NAME = re.compile(r"[^A-Za-z0-9_.-]+")
_FIRST_STAMP = datetime(2000, 1, 1)
"""The exemplar stamps each row with the time of day. Ours must be the same each time: a second for
each mission.
"""
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
"""strftime's %b depends on the user's language; the exemplar's files are in English."""


def exemplar_names(
    managers: Sequence[str], revision: str, *, has_battery: bool
) -> Iterator[tuple[str, str]]:
    """Yield for each manager the name of its file, without .csv, and that of its missions in it.

    The mission of a scenario with a battery is the extended one, except for manager bt.
    """
    used: set[str] = set()
    for number, manager in enumerate(managers, 1):
        mission = _TREES.get(manager, _EXTENDED if has_battery else "suave")
        mission = "time constrained" if revision == "2023" else mission
        name = "bt" if manager in _TREES else manager
        file = _OUTSIDE_NAME.sub("_", f"{name}_{mission}")
        if file in used:  # another manager's, which differs in signs that file names may not have
            file += f"_{number}"
        used.add(file)
        yield file, f"{mission} {name}"


def manager_of(mission_name: str) -> str:
    """Return the manager of a mission that the exemplar calls by this name: the last word of it."""
    words = mission_name.split()
    return "bt_extended" if words == [_EXTENDED, "bt"] else words[-1]


def suave_pieces(
    revision: str,
    name: str,
    columns: Sequence[str],
    rows: Iterable[tuple[int, Sequence[object]]],
    time_limit_s: float,
) -> Iterator[str]:
    """Yield the content of a file of the exemplar's, piece by piece.

    Seconds and metres are as in runs.csv, but for durations, which are whole seconds, and for the
    search time when the pipeline was not found. All revisions but 2023 have the current layout,
    that of 1.5.

    Args:
        name: of the missions in it.
        columns, rows: of runs.csv, each row with the number of its mission in the campaign, from 1.
    """
    layout = _LAYOUT_2023 if revision == "2023" else _LAYOUT_1_5

    def cells(number: int, row: Sequence[object]) -> list[object]:
        stamp = _FIRST_STAMP + timedelta(seconds=number)
        # drawn and swept parameters follow
        mission: dict[str, Any] = dict(zip(columns, row, strict=False))
        mission |= {TIME_LIMIT: time_limit_s, "stamp": stamp, "name": name}
        mission["month"] = _MONTHS[stamp.month - 1]
        mission["position"] = str(tuple(round(mission[axis], 2) for axis in _START))
        return [rounded(make(mission)) for _, make in layout.values()]

    return csv_pieces(tuple(layout), (cells(number, row) for number, row in rows))
