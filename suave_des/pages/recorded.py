"""A mission with its whole record, for a page: read from a folder, or run anew."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import pandas
from pydantic import ValidationError

from suave_des.campaign.knowledge_records import KNOWLEDGE_FILE, read_knowledge
from suave_des.campaign.missions import COLUMNS, Cell, row_of
from suave_des.errors import InputError
from suave_des.metrics.result import Event, KnowledgeRecord, MissionResult, TrajectoryPoint
from suave_des.report.mission_record import read_mission
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import Scenario

_ANGLES = ("roll_rad", "pitch_rad", "yaw_rad")
_COLUMNS = tuple(each.name for each in fields(TrajectoryPoint) if each.name != "further")
_NUMBERS = tuple(name for name in _COLUMNS if name != "mode")


@dataclass(frozen=True)
class Recorded:
    """A mission with its whole record.

    Attributes:
        metrics: its row of runs.csv, by column.
        scenario: the scenario in full.
        events: what happened, in order of time.
        track: columns of trajectory.csv, with further measured values; None where a value is missing.
        knowledge: the states that its manager reasoned about.
        inputs: SHA-256 of each input file, by its name.
        loaded: the scenario with its files, where it was read for this.
    """

    metrics: Mapping[str, Cell]
    scenario: Scenario
    events: tuple[Event, ...]
    track: Mapping[str, list[Any]]
    knowledge: tuple[KnowledgeRecord, ...]
    inputs: Mapping[str, str] = field(default_factory=dict)
    loaded: LoadedScenario | None = None

    @property
    def name(self) -> str:
        """Scenario, manager, run and seed."""
        metrics = self.metrics
        return f"{metrics['scenario']}, {metrics['manager']}, run {metrics['run']}, seed {metrics['seed']}"


def recorded_result(loaded: LoadedScenario, result: MissionResult) -> Recorded:
    """Take a mission that was just run, with its record."""
    points = result.trajectory
    further = list(points[0].further) if points else []
    track = {name: [getattr(point, name) for point in points] for name in _COLUMNS}
    track |= {name: [point.further[name] for point in points] for name in further}
    metrics = dict(zip(COLUMNS, row_of(result.metrics), strict=True))
    return Recorded(metrics, loaded.scenario, result.events, track, result.knowledge, loaded.inputs, loaded)


def read_recorded(folder: Path) -> Recorded:
    """Read the output folder of a mission.

    Raises:
        InputError: one of its files is missing, or is not what a mission writes.
    """
    record = read_mission(folder)
    path = folder / "mission.json"
    try:
        scenario = Scenario.model_validate(record.scenario)
        inputs = json.loads(path.read_text(encoding="utf-8")).get("inputs_sha256", {})
    except (ValueError, ValidationError, AttributeError):
        problem, remedy = "has a scenario that this suave-des does not read", "run the mission again"
        raise InputError(problem, file=path, remedy=remedy) from None
    frame = record.trajectory
    for name in _ANGLES:
        if name not in frame.columns:
            frame[name] = 0.0
    measured = [name for name in frame.columns if name not in _COLUMNS]  # further values, such as the battery's level
    numbers = frame[[*_NUMBERS, *measured]].apply(pandas.to_numeric, errors="coerce")
    track: dict[str, list[Any]] = {
        name: [None if value != value else value for value in numbers[name].tolist()] for name in numbers.columns
    }
    track["mode"] = frame["mode"].tolist()
    times, *texts = (record.events[name].tolist() for name in ("t_s", "source", "event", "detail"))
    events = tuple(Event(float(t_s), *map(str, words)) for t_s, *words in zip(times, *texts, strict=True))
    states = folder / KNOWLEDGE_FILE
    knowledge = read_knowledge(states) if states.is_file() else ()
    return Recorded(record.metrics, scenario, events, track, knowledge, inputs)
