"""The folder of one mission: mission.json, events.csv, trajectory.csv and knowledge.jsonl, written and read."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from dataclasses import astuple, dataclass, field, fields
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from suave_des.errors import InputError
from suave_des.files import csv_text, json_text, opened, read_json
from suave_des.metrics.result import Event, KnowledgeRecord, MissionResult, TrajectoryPoint
from suave_des.records.knowledge import KNOWLEDGE_FILE, knowledge_text, read_knowledge
from suave_des.records.metrics import COLUMNS, further_of, row_of
from suave_des.scenario.loader import LoadedScenario

if TYPE_CHECKING:
    import pandas

MISSION_FILE, EVENTS_FILE, TRAJECTORY_FILE = "mission.json", "events.csv", "trajectory.csv"
EVENT_COLUMNS = tuple(field.name for field in fields(Event))
TRAJECTORY_COLUMNS = tuple(field.name for field in fields(TrajectoryPoint) if field.name != "further")
"""Columns that every trajectory.csv has."""
_METRICS = ("scenario", "manager", "run", "seed", "search_time_s", "pipeline_found", "detection_x_m", "detection_y_m")
"""Those that every mission.json must have."""
_ANGLES = ("roll_rad", "pitch_rad", "yaw_rad")
"""Columns of trajectory.csv that may be missing."""
_REMEDY = "give the --out folder of suave-des run"


@dataclass(frozen=True)
class MissionRecord:
    """One mission with its record.

    Attributes:
        metrics: its row of runs.csv, by column.
        scenario: the scenario in full, as mission.json has it.
        events: events.csv.
        trajectory: trajectory.csv; mode is empty before the first one, other missing values are nan.
        knowledge: the states that its manager reasoned about.
        inputs: SHA-256 of each input file, by its name.
        search_altitudes_m: of the search modes.
    """

    metrics: Mapping[str, Any]
    scenario: Mapping[str, Any]
    events: pandas.DataFrame
    trajectory: pandas.DataFrame
    knowledge: tuple[KnowledgeRecord, ...] = ()
    inputs: Mapping[str, str] = field(default_factory=dict)
    search_altitudes_m: Mapping[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Scenario, manager, run and seed."""
        metrics = self.metrics
        return f"{metrics['scenario']}, {metrics['manager']}, run {metrics['run']}, seed {metrics['seed']}"

    @property
    def end_s(self) -> float:
        """Time of the trajectory's last point."""
        return float(self.trajectory["t_s"].iloc[-1])


def mission_files(result: MissionResult, loaded: LoadedScenario, provenance: Mapping[str, Any]) -> dict[str, str]:
    """Return the content of each file of a mission's folder, by its name.

    Args:
        result: of the mission, with its record.
        loaded: the mission's scenario.
        provenance: further keys of mission.json, which say how it was made.
    """
    cells, further = attrgetter(*TRAJECTORY_COLUMNS), tuple(result.trajectory[0].further)
    points = ((*cells(point), *(point.further[name] for name in further)) for point in result.trajectory)
    mission = {
        "metrics": _metrics(result),
        "drawn": dict(sorted(result.drawn.items())),
        "scenario": loaded.scenario.model_dump(mode="json"),
        "search_altitudes_m": loaded.modes.search_altitudes_m,
        **provenance,
    }
    files = {
        MISSION_FILE: json_text(mission),
        EVENTS_FILE: csv_text(EVENT_COLUMNS, map(astuple, result.events)),
        TRAJECTORY_FILE: csv_text((*TRAJECTORY_COLUMNS, *further), points),
    }
    return files | ({KNOWLEDGE_FILE: knowledge_text(result.knowledge)} if result.knowledge else {})


def _metrics(result: MissionResult) -> dict[str, Any]:
    return dict(zip((*COLUMNS, *result.further), (*row_of(result.metrics), *further_of(result)), strict=True))


def record_of(result: MissionResult, loaded: LoadedScenario) -> MissionRecord:
    """Return the record of a mission that was just run, as its folder would have it."""
    frames = result.events_frame(), result.trajectory_frame()
    scenario, altitudes_m = loaded.scenario.model_dump(mode="json"), loaded.modes.search_altitudes_m
    return MissionRecord(_metrics(result), scenario, *frames, result.knowledge, loaded.inputs, altitudes_m)


def read_mission(folder: Path) -> MissionRecord:
    """Read a mission's folder.

    Raises:
        InputError: one of its files is missing, or is not what a mission writes.
    """
    import numpy as np

    path = folder / MISSION_FILE
    mission = read_json(path)
    try:
        metrics, scenario, inputs = mission["metrics"], mission["scenario"], dict(mission.get("inputs_sha256", {}))
        altitudes_m = {mode: float(value) for mode, value in mission.get("search_altitudes_m", {}).items()}
        np.array(scenario["pipeline"]["vertices_m"], dtype=float)
        _check_columns(path, _METRICS, metrics)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"is not the record of a mission: {error}", file=path, remedy=_REMEDY) from None
    events = _read_table(folder / EVENTS_FILE, EVENT_COLUMNS)
    trajectory = _read_table(folder / TRAJECTORY_FILE, [name for name in TRAJECTORY_COLUMNS if name not in _ANGLES])
    trajectory = trajectory.assign(**{name: 0.0 for name in _ANGLES if name not in trajectory})
    states = folder / KNOWLEDGE_FILE
    knowledge = read_knowledge(states) if states.is_file() else ()
    return MissionRecord(metrics, scenario, events, trajectory, knowledge, inputs, altitudes_m)


def _check_columns(path: Path, needed: Iterable[str], found: Container[str]) -> None:
    for name in needed:
        if name not in found:
            raise InputError(f"{name} is missing", file=path, remedy=_REMEDY)


def _read_table(path: Path, columns: Iterable[str]) -> pandas.DataFrame:
    """Read a table that must have some columns: source, event, detail and mode are text, all others finite numbers."""
    import numpy as np
    import pandas

    texts = ("source", "event", "detail", "mode")
    try:
        with opened(path) as stream:
            # "none" and "nan" may be words here, so that only numbers have something that counts as missing.
            frame = pandas.read_csv(stream, dtype=str, keep_default_na=False)
    except ValueError as error:
        raise InputError(f"cannot be read: {error}", file=path, remedy=_REMEDY) from None
    _check_columns(path, columns, frame.columns)
    if frame.empty:
        raise InputError("is empty", file=path, remedy=_REMEDY)
    for name in frame.columns.difference(list(texts)):
        numbers = pandas.to_numeric(frame[name], errors="coerce").astype(float)
        for row in np.flatnonzero(~np.isfinite(numbers) & ((frame[name] != "") | (name == "t_s")))[:1]:
            problem = f"{name}: expected a finite number, got {str(frame[name].iloc[row])!r}"
            raise InputError(problem, file=path, place=f"line {row + 2}", remedy=_REMEDY)
        frame[name] = numbers
    return frame
