"""Reads missions, real or simulated, from any of the CSV files in which they come."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.scenario.yamlfile import decode, read_bytes

if TYPE_CHECKING:
    import pandas

METRICS = ("search_time_s", "distance_inspected_m")
COLUMNS = ("manager", *METRICS, "detection_x_m")
"""Columns of a frame of missions; detection_x_m is nan where it is not known or nothing was detected."""
SIZE_LIMIT_BYTES = 500_000_000


@dataclass(frozen=True, slots=True)
class _Layout:
    """Names of the columns in one kind of file; those after the first three may be absent, or have no name there."""

    manager: str
    search_time_s: str
    distance_inspected_m: str
    detection_x_m: tuple[str, ...] = ()
    time_limit_s: str | None = None
    scenario: str | None = None
    manager_is_last_word: bool = False

    @property
    def needed(self) -> tuple[str, str, str]:
        return self.manager, self.search_time_s, self.distance_inspected_m


_OWN = _Layout(
    "manager",
    "search_time_s",
    "distance_inspected_m",
    detection_x_m=("detection_x_m", "detection_x_m_inferred"),
    scenario="scenario",
)
_LAYOUTS = (
    _OWN,
    # The exemplar's results files (kas-lab/suave): revision 2023, which writes -1 when nothing was found, and 1.5.
    _Layout(
        "mission_name",
        "time search (s)",
        "distance inspected (m)",
        time_limit_s="time budget (s)",
        manager_is_last_word=True,
    ),
    _Layout("mission name", "time searching pipeline (s)", "distance inspected (m)", manager_is_last_word=True),
)


@dataclass(frozen=True)
class Runs:
    """Missions read from a file.

    Attributes:
        path: the file.
        frame: a row a mission, in the file's order, with COLUMNS.
        managers: in the order in which they come first, each with the line.
        scenarios: names of scenarios that the file gives, each with its first line.
        sha256: of the file's bytes, in hex.
    """

    path: Path
    frame: pandas.DataFrame
    managers: Mapping[str, int]
    scenarios: Mapping[str, int]
    sha256: str

    def error(self, line: int, problem: str, remedy: str) -> InputError:
        """An error about a line of the file."""
        return InputError(problem, file=self.path, place=f"line {line}", remedy=remedy)


def read_runs(path: str | Path) -> Runs:
    """Read missions from a runs.csv, a file like the published seams2023_runs.csv, or the exemplar's own results.

    Search times are taken as they stand, but for the -1 with which revision 2023 says that nothing was found: the time
    limit stands for it, as in the published table.

    Raises:
        InputError: with file and line: the file cannot be read, has other columns, no mission, or an impossible value.
    """
    import pandas

    path = Path(path)
    content = read_bytes(path, SIZE_LIMIT_BYTES)
    reader = csv.reader(io.StringIO(decode(path, content), newline=""), strict=True)
    missions: list[tuple[str, float, float, float]] = []
    managers: dict[str, int] = {}
    scenarios: dict[str, int] = {}
    try:
        header = [name.strip() for name in next(reader, [])]
        layout = _layout(path, header)
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            row = _Row(path, reader.line_num, header, cells)
            missions.append(_mission(row, layout))
            managers.setdefault(missions[-1][0], row.line)
            if layout.scenario in header:
                scenarios.setdefault(row.text(str(layout.scenario)), row.line)
    except csv.Error as error:
        remedy = "one line a mission, cells separated by commas"
        raise _error(path, reader.line_num, f"is not valid CSV: {error}", remedy) from None
    if not missions:
        raise _error(path, 1, "has no mission under its header", "one line a mission is needed")
    frame = pandas.DataFrame.from_records(missions, columns=list(COLUMNS))
    return Runs(path, frame, managers, scenarios, hashlib.sha256(content).hexdigest())


def choose_managers(published: Runs, wanted: Sequence[str] | None) -> tuple[str, ...]:
    """The managers to compare: those wanted, or all of the published file.

    Raises:
        InputError: one is wanted twice, or has no published mission.
    """
    if wanted is None:
        return tuple(published.managers)
    if not wanted:
        raise InputError("no managers are given", remedy=f"of {published.path}: {', '.join(published.managers)}")
    for place, manager in enumerate(wanted):
        if manager in wanted[:place]:
            raise InputError(f"manager {manager!r} is given twice", remedy="name each manager once")
        if manager not in published.managers:
            remedy = did_you_mean(manager, published.managers, "its managers")
            raise InputError(f"has no mission of manager {manager!r}", file=published.path, remedy=remedy)
    return tuple(wanted)


def check_same_managers(simulated: Runs, managers: Sequence[str]) -> None:
    """See that a file of simulated missions has some of each manager.

    Raises:
        InputError: it lacks one.
    """
    for manager in managers:
        if manager not in simulated.managers:
            remedy = f"it has {', '.join(simulated.managers)}; choose among them with --managers"
            raise InputError(f"has no mission of manager {manager!r}", file=simulated.path, remedy=remedy)


def check_one_scenario(simulated: Runs, scenario: str | None) -> None:
    """See that a file of simulated missions is of one scenario, and of the one named if one is.

    Raises:
        InputError: it is of several, or of another.
    """
    names = list(simulated.scenarios)
    if len(names) > 1:
        line = simulated.scenarios[names[1]]
        problem = f"has missions of several scenarios: {names[0]} and {names[1]}"
        raise simulated.error(line, problem, "give the missions of one scenario")
    if scenario is not None and names and names[0] != scenario:
        line = simulated.scenarios[names[0]]
        problem = f"has missions of scenario {names[0]}, not of {scenario}"
        raise simulated.error(line, problem, f"name scenario {names[0]}, or give another file")


@dataclass(frozen=True, slots=True)
class _Row:
    path: Path
    line: int
    header: Sequence[str]
    cells: Sequence[str]

    def __post_init__(self) -> None:
        if len(self.cells) != len(self.header):
            problem = f"has {len(self.cells)} values, but the header has {len(self.header)}"
            raise _error(self.path, self.line, problem, "give each column a value, if only an empty one")

    def text(self, column: str) -> str:
        return self.cells[self.header.index(column)].strip()

    def number(self, column: str, *, least: float = -math.inf) -> float:
        text = self.text(column)
        try:
            number = float(text)
        except ValueError:
            raise _error(self.path, self.line, f"{column} {shown(text)} is no number", "such as 187.5") from None
        if not math.isfinite(number) or number < least:
            remedy = "a finite number" if least == -math.inf else f"a finite number, at least {least:g}"
            raise _error(self.path, self.line, f"{column} {shown(text)} is out of range", remedy)
        return number


def _layout(path: Path, header: Sequence[str]) -> _Layout:
    for column in header:
        if header.count(column) > 1:
            raise _error(path, 1, f"has column {shown(column)} twice", "name each column once")
    for layout in _LAYOUTS:
        if set(layout.needed) <= set(header):
            return layout
    nearest = max(_LAYOUTS, key=lambda layout: len(set(layout.needed) & set(header)))
    missing = next(column for column in nearest.needed if column not in header)
    remedy = f"the columns {', '.join(nearest.needed)} are needed"
    raise _error(path, 1, f"has no column {missing!r}", remedy)


def _mission(row: _Row, layout: _Layout) -> tuple[str, float, float, float]:
    words = row.text(layout.manager).split()
    if not words or (len(words) > 1 and not layout.manager_is_last_word):
        problem = f"{layout.manager} {shown(row.text(layout.manager))} names no manager"
        raise _error(row.path, row.line, problem, "such as metacontrol")
    if layout.time_limit_s in row.header and row.number(layout.search_time_s) == -1.0:
        search_time_s = row.number(str(layout.time_limit_s), least=0.0)
    else:
        search_time_s = row.number(layout.search_time_s, least=0.0)
    distance_m = row.number(layout.distance_inspected_m, least=0.0)
    column = next((name for name in layout.detection_x_m if name in row.header), None)
    detection_x_m = row.number(column) if column is not None and row.text(column) else math.nan
    return words[-1], search_time_s, distance_m, detection_x_m


def _error(path: Path, line: int, problem: str, remedy: str) -> InputError:
    return InputError(problem, file=path, place=f"line {line}", remedy=remedy)
