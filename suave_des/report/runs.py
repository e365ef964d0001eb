"""Read missions, real or simulated, from any of the CSV files in which they come."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas
from numpy.typing import NDArray

from suave_des.errors import InputError, did_you_mean, line_error, number_of, shown
from suave_des.files import read_csv
from suave_des.metrics.result import MissionMetrics
from suave_des.report.compared_metrics import PAPER_METRICS

COLUMNS = ("manager", *PAPER_METRICS, "detection_x_m", "pipeline_found", "mean_reaction_time_s", "run", "seed")
"""Columns of a frame of missions.

detection_x_m is nan where it is not known or nothing was detected, pipeline_found a nullable boolean, missing where the
file does not say, and mean_reaction_time_s nan where nothing was reacted to or the file does not say. run is nan and
seed, which is text, empty where the file does not say.
"""
_SIZE_LIMIT_BYTES = 500_000_000
_GREATEST = 1e12
"""Of numbers, as in scenarios."""
_WHOLE_LIMIT = 2**63


class _Layout(NamedTuple):
    """Names of the columns in one kind of file; those after the first three may be absent, or have no name there."""

    manager: str
    search_time_s: str
    distance_inspected_m: str
    detection_x_m: tuple[str, ...] = ()
    time_limit_s: str = ""
    pipeline_found: str = ""
    mean_reaction_time_s: str = ""
    scenario: str = ""
    run: str = ""
    seed: str = ""
    is_exemplars: bool = True
    """The manager is the last word of its column, and rows of averages may follow the missions."""


_LAYOUTS = (
    _Layout(
        "manager",
        "search_time_s",
        "distance_inspected_m",
        detection_x_m=("detection_x_m", "detection_x_m_inferred"),
        time_limit_s="time_limit_s",
        pipeline_found="pipeline_found",
        mean_reaction_time_s="mean_reaction_time_s",
        scenario="scenario",
        run="run",
        seed="seed",
        is_exemplars=False,
    ),
    # The exemplar's results files (kas-lab/suave): revision 2023, which writes -1 when nothing was found, and 1.5.
    _Layout("mission_name", "time search (s)", "distance inspected (m)", time_limit_s="time budget (s)"),
    _Layout(
        "mission name",
        "time searching pipeline (s)",
        "distance inspected (m)",
        pipeline_found="pipeline found",
        mean_reaction_time_s="mean reaction time (s)",
    ),
)
_AVERAGES = ("average", "std")
"""First words of rows that sum up the missions of the exemplar's files."""


@dataclass(frozen=True)
class Runs:
    """Missions read from a file.

    Attributes:
        path: the file.
        frame: a row for each mission, in the file's order, with COLUMNS and the further columns that were asked for.
        managers: in the order of their first missions, each with the line of that.
        scenarios: names of scenarios that the file gives, each with its first line.
        sha256: of the file's bytes, in hex.
        averages: lines of rows that are averages rather than missions, and were skipped.
        lines: of the missions.
    """

    path: Path
    frame: pandas.DataFrame
    managers: Mapping[str, int]
    scenarios: Mapping[str, int]
    sha256: str
    averages: tuple[int, ...] = ()
    lines: tuple[int, ...] = ()

    def error(self, line: int, problem: str, remedy: str | None) -> InputError:
        """Make an error about a line of the file."""
        return line_error(self.path, line, problem, remedy)

    def check_simulated(self, managers: Sequence[str], scenario: str | None) -> None:
        """Check that these missions are of one scenario, and that there are some of each manager.

        Args:
            managers: that are needed.
            scenario: that is needed; none: any one.

        Raises:
            InputError: they are not, or there are none.
        """
        names = list(self.scenarios)
        if len(names) > 1:
            problem = f"has missions of several scenarios: {names[0]} and {names[1]}"
            raise self.error(self.scenarios[names[1]], problem, "give the missions of one scenario")
        if names and scenario not in (None, names[0]):
            problem = f"has missions of scenario {names[0]}, not of {scenario}"
            raise self.error(self.scenarios[names[0]], problem, f"name scenario {names[0]}, or give another file")
        for manager in managers:
            if manager not in self.managers:
                remedy = f"it has {', '.join(self.managers)}; choose among them with --managers"
                raise InputError(f"has no mission of manager {manager!r}", file=self.path, remedy=remedy)


def read_runs(
    path: str | Path,
    *,
    further: Sequence[str] = (),
    where_present: Sequence[str] = (),
    are_simulated: bool = False,
) -> Runs:
    """Read missions from a runs.csv, a file like the published seams2023_runs.csv, or the exemplar's own results.

    Search times are taken as they stand, but for the -1 with which revision 2023 says that nothing was found: the time
    limit stands for it, as in the published table. A file that has a time limit, but does not say which missions found
    the pipeline, has found it in those whose search took less. A reaction time of 0 stands for no reaction.

    Args:
        path: of the file; it may have columns that are not read.
        further: columns to read too, such as those of a sweep; numbers where all their values are.
        where_present: further columns that a file need not have.
        are_simulated: whether the missions are a campaign's: all columns of its runs.csv that are there are checked.

    Raises:
        InputError: with file and line: the file cannot be read, has other columns, no mission, or an impossible value.
    """
    path = Path(path)
    remedy = "one line for each mission, cells separated by commas"
    header, numbered, digest = read_csv(path, _SIZE_LIMIT_BYTES, remedy)
    layout = _layout(path, header, further)
    metrics = [each for each in fields(MissionMetrics) if are_simulated and each.name in header]
    optional = (layout.time_limit_s, layout.pipeline_found, layout.mean_reaction_time_s, layout.scenario)
    further = (*further, *(name for name in where_present if name in header))
    wanted = (*layout[:3], *layout.detection_x_m, *optional, layout.run, layout.seed, *further)
    wanted += tuple(each.name for each in metrics)
    names = [name for name in dict.fromkeys(wanted) if name in header]
    chosen = itemgetter(*(header.index(name) for name in names))
    rows, lines, averages = [], [], []
    for line, cells in numbered:
        if layout.is_exemplars and _first_word(cells) in _AVERAGES:
            averages.append(line)
            continue
        if len(cells) != len(header):
            problem = f"has {number_of(len(cells), 'value')}, but the header has {len(header)}"
            raise line_error(path, line, problem, "give each column a value, if only an empty one")
        rows.append(tuple(map(str.strip, chosen(cells))))
        lines.append(line)
    if not rows:
        raise line_error(path, 1, "has no missions under its header", "one line for each mission is needed")
    cells_by_name = pandas.DataFrame(rows, columns=names, index=lines, dtype=str)
    checked = _Cells(path, cells_by_name)
    frame = _missions(checked, layout)
    for each in metrics:
        checked.check_kind(each.name, str(each.type))
    managers = _first_lines(frame["manager"])
    scenarios = _first_lines(cells_by_name[layout.scenario]) if layout.scenario in names else {}
    frame = frame.assign(**{name: checked.numbers_or_words(name) for name in further})
    return Runs(path, frame.reset_index(drop=True), managers, scenarios, digest, tuple(averages), tuple(lines))


def choose_names(wanted: str | None, managers: Iterable[str], source: str) -> tuple[str, ...]:
    """Choose among the managers of a source: those named, separated by commas, or all.

    Raises:
        InputError: one is named twice, or has no mission in the source.
    """
    known = tuple(managers)
    if wanted is None:
        return known
    names = [name.strip() for name in wanted.split(",") if name.strip()]
    if not names:
        raise InputError("no managers are given", remedy=f"of {source}: {', '.join(known)}")
    for place, manager in enumerate(names):
        if manager in names[:place]:
            raise InputError(f"manager {manager!r} is given twice", remedy="name each manager once")
        if manager not in known:
            remedy = did_you_mean(manager, known, "its managers")
            raise InputError(f"has no mission of manager {manager!r}", file=source, remedy=remedy)
    return tuple(names)


_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars"}
"""What programs separate columns by, besides commas."""


def _layout(path: Path, header: Sequence[str], further: Sequence[str]) -> _Layout:
    for column in header:
        if header.count(column) > 1:
            raise line_error(path, 1, f"has column {shown(column)} twice", "name each column once")
    apart = next((mark for mark in _SEPARATORS if len(header) == 1 and mark in header[0]), None)
    if apart is not None:
        problem = f"has its columns separated by {_SEPARATORS[apart]}"
        raise line_error(path, 1, problem, "separate them by commas, and write numbers with a decimal point")
    nearest = max(_LAYOUTS, key=lambda layout: len(set(layout[:3]) & set(header)))
    for column in (needed := (*nearest[:3], *further)):
        if column not in header:
            raise line_error(path, 1, f"has no column {column!r}", f"the columns {', '.join(needed)} are needed")
    return nearest


def _missions(cells: _Cells, layout: _Layout) -> pandas.DataFrame:
    """Check and convert the cells; a frame with COLUMNS."""
    words = {name: str(name).split() for name in cells.text[layout.manager].unique()}
    are_names = {name: len(each) == 1 or bool(each and layout.is_exemplars) for name, each in words.items()}
    cells.check(layout.manager, cells.text[layout.manager].map(are_names), "a manager's name")
    search_time_s = cells.numbers(layout.search_time_s, least=-math.inf)
    limits = cells.numbers(layout.time_limit_s) if layout.time_limit_s in cells.text else None
    if limits is not None and layout.is_exemplars:
        search_time_s = np.where(search_time_s == -1.0, limits, search_time_s)
    cells.check(layout.search_time_s, search_time_s >= 0.0, "a finite number, at least 0")
    detection = next((name for name in layout.detection_x_m if name in cells.text), None)
    values = (
        cells.text[layout.manager].map({name: each[-1] for name, each in words.items()}),
        search_time_s,
        cells.numbers(layout.distance_inspected_m),
        math.nan if detection is None else cells.numbers(detection, least=-math.inf, may_be_empty=True),
        _found(cells, layout, search_time_s, limits),
        _reactions(cells, layout.mean_reaction_time_s),
        cells.numbers(layout.run, may_be_empty=True) if layout.run in cells.text else math.nan,
        cells.text.get(layout.seed, ""),
    )
    return pandas.DataFrame(dict(zip(COLUMNS, values, strict=True)), index=cells.text.index)


def _found(
    cells: _Cells, layout: _Layout, search_time_s: NDArray[np.float64], limits: NDArray[np.float64] | None
) -> pandas.arrays.BooleanArray:
    """Return whether each mission found the pipeline; missing where that is not known."""
    if layout.pipeline_found in cells.text:
        words = cells.text[layout.pipeline_found].str.lower()
        cells.check(layout.pipeline_found, words.isin(("true", "false")), "True or False")
        found = (words == "true").to_numpy()
    elif limits is not None:
        found = search_time_s < limits
    else:
        return pandas.array([pandas.NA] * len(cells.text), dtype="boolean")
    return pandas.array(found, dtype="boolean")


def _reactions(cells: _Cells, column: str) -> NDArray[np.float64] | float:
    if column not in cells.text:
        return math.nan
    times_s = cells.numbers(column, may_be_empty=True)
    return np.where(times_s > 0.0, times_s, math.nan)


@dataclass(frozen=True)
class _Cells:
    """The cells of a file as text, indexed by line."""

    path: Path
    text: pandas.DataFrame
    _converted: dict[str, NDArray[np.float64]] = field(default_factory=dict)

    def numbers(self, column: str, *, least: float = 0.0, may_be_empty: bool = False) -> NDArray[np.float64]:
        """Convert a column; empty cells are nan."""
        numbers = self._as_numbers(column)
        is_right = np.isfinite(numbers) & (numbers >= least) & (np.abs(numbers) <= _GREATEST)
        if may_be_empty:
            is_right |= (self.text[column] == "").to_numpy()
        self.check(column, is_right, "a finite number" + (f", at least {least:g}" if least > -math.inf else ""))
        return numbers

    def check_kind(self, column: str, kind: str) -> None:
        """Check a column whose values are of a type of MissionMetrics."""
        text = self.text[column]
        if kind == "bool":
            self.check(column, text.isin(("True", "False")), "True or False")
        elif kind == "int":
            is_whole = [len(each) < 20 and each.isdecimal() and int(each) < _WHOLE_LIMIT for each in text]
            self.check(column, is_whole, f"a whole number below {_WHOLE_LIMIT}")
        elif kind.startswith("float"):
            self.numbers(column, least=-math.inf, may_be_empty=True)

    def numbers_or_words(self, column: str) -> pandas.Series[float] | pandas.Series[str]:
        """Convert a column whose cells are all numbers, to integers if they are; any other stays as it is."""
        text = self.text[column]
        return text if np.isnan(self._as_numbers(column)).any() else pandas.to_numeric(text)

    def _as_numbers(self, column: str) -> NDArray[np.float64]:
        """Convert a column, once; anything but a number becomes nan."""
        if column not in self._converted:
            self._converted[column] = _numbers(self.text[column])
        return self._converted[column]

    def check(self, column: str, is_right: Iterable[bool], wanted: str) -> None:
        """Check a column.

        Raises:
            InputError: about the first line that is wrong.
        """
        wrong = np.flatnonzero(~np.asarray(is_right, dtype=bool))
        if len(wrong):
            text = self.text[column].iloc[wrong[0]]
            problem = f"{column}: expected {wanted}, got {shown(text)}"
            raise line_error(self.path, self.text.index[wrong[0]], problem, "correct it, or leave the mission out")


def _first_word(cells: Sequence[str]) -> str:
    return next((word for cell in cells for word in cell.split()), "").rstrip(":").lower()


def _first_lines(names: pandas.Series[str]) -> dict[str, int]:
    return {str(name): int(line) for line, name in names.drop_duplicates().items()}  # type: ignore[call-overload]


def _numbers(text: pandas.Series[str]) -> NDArray[np.float64]:
    """Convert cells to numbers; other cells become nan."""
    cells = text.to_list()
    together = "".join(cells)
    if together.isascii() and "_" not in together:  # else float() would accept more than numbers of a CSV file
        with suppress(ValueError):
            return np.array([float(cell) if cell else math.nan for cell in cells])
    return pandas.to_numeric(text, errors="coerce").to_numpy(float)
