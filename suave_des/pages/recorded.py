"""Missions with their whole record, for a page: read from folders, repeated from a campaign, or newly run."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas
from pydantic import ValidationError

from suave_des.campaign.inputs import check_inputs
from suave_des.campaign.knowledge_records import KNOWLEDGE_FILE, read_knowledge
from suave_des.campaign.missions import COLUMNS, row_of
from suave_des.campaign.single import MISSION_FILE, OpenedCampaign, opened_campaign
from suave_des.campaign.spec import RUNS_LIMIT, check_range, check_seed
from suave_des.campaign.store import STORE_FILE
from suave_des.errors import InputError
from suave_des.metrics.result import KnowledgeRecord, MissionResult
from suave_des.report.mission_record import MissionRecord, read_mission
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import Scenario
from suave_des.simulation.simulator import Simulator

MOST_MISSIONS = 2
"""Missions that a replay shows side by side."""
_ANGLES = ("roll_rad", "pitch_rad", "yaw_rad")


@dataclass(frozen=True)
class Recorded:
    """A mission with its whole record.

    Attributes:
        record: its metrics, events and trajectory.
        scenario: the scenario in full.
        knowledge: the states that its manager reasoned about.
        inputs: SHA-256 of each input file, by its name.
        loaded: the scenario with its files, where it was read for this.
    """

    record: MissionRecord
    scenario: Scenario
    knowledge: tuple[KnowledgeRecord, ...]
    inputs: Mapping[str, str] = field(default_factory=dict)
    loaded: LoadedScenario | None = None


def recorded_result(loaded: LoadedScenario, result: MissionResult) -> Recorded:
    """Take a mission that was just run, with its record."""
    metrics, scenario = dict(zip(COLUMNS, row_of(result.metrics), strict=True)), loaded.scenario
    dumped = scenario.model_dump(mode="json")
    record = MissionRecord(metrics, dumped, result.events_frame(), result.trajectory_frame())
    return Recorded(record, scenario, result.knowledge, loaded.inputs, loaded)


def read_recorded(folder: Path) -> Recorded:
    """Read the output folder of a mission.

    Raises:
        InputError: one of its files is missing, or is not what a mission writes.
    """
    record = read_mission(folder)
    path = folder / MISSION_FILE
    try:
        scenario = Scenario.model_validate(record.scenario)
        inputs = json.loads(path.read_text(encoding="utf-8")).get("inputs_sha256", {})
    except (ValueError, ValidationError, AttributeError):
        problem, remedy = "has a scenario that this suave-des does not read", "run the mission again"
        raise InputError(problem, file=path, remedy=remedy) from None
    frame = record.trajectory
    frame = frame.assign(**{name: 0.0 for name in _ANGLES if name not in frame.columns})
    numbers = [name for name in frame.columns if name != "mode"]
    frame[numbers] = frame[numbers].apply(pandas.to_numeric, errors="coerce")
    states = folder / KNOWLEDGE_FILE
    knowledge = read_knowledge(states) if states.is_file() else ()
    return Recorded(replace(record, trajectory=frame), scenario, knowledge, inputs)


@dataclass(frozen=True)
class MissionSelection:
    """Which missions of a scenario or campaign are wanted.

    Attributes:
        managers: names; none: of a campaign the last and the first, of a scenario metacontrol.
        run: number of the run, the same for all.
        seed: of everything that is random; a campaign has its own.
        point: of a campaign's sweep.
    """

    managers: tuple[str, ...] = ()
    run: int = 1
    seed: int = 1
    point: int = 0


def missions_in(folders: Sequence[Path], chosen: MissionSelection) -> list[Recorded]:
    """Read the missions in folders: a recorded one of each, or those chosen of a campaign, which are run again.

    Raises:
        InputError: there is neither a mission nor a campaign in a folder, or too many missions for one page.
        MissionError: a manager raised.
    """
    missions: list[Recorded] = []
    for folder in folders:
        if (folder / MISSION_FILE).is_file():
            missions.append(read_recorded(folder))
        elif (folder / STORE_FILE).is_file():
            with opened_campaign(folder, chosen.managers) as campaign:
                missions += missions_of(campaign, chosen)
        else:
            problem = f"has neither a mission ({MISSION_FILE}) nor a campaign that can be run again ({STORE_FILE})"
            remedy = "give the folder that run or campaign wrote with --out"
            raise InputError(problem if folder.is_dir() else "no such folder", file=folder, remedy=remedy)
    _check_number(len(missions))
    for mission, folder in zip(missions, folders, strict=False):
        if mission.scenario.pipeline.vertices_m != missions[0].scenario.pipeline.vertices_m:
            raise InputError("has another pipeline", file=folder, remedy="give missions over the same one")
    return missions


def missions_of(campaign: OpenedCampaign, chosen: MissionSelection) -> list[Recorded]:
    """Run missions of a campaign again.

    Raises:
        InputError: the campaign has no such mission, or too many are wanted.
        MissionError: a manager raised.
    """
    managers = chosen.managers or tuple(dict.fromkeys((campaign.spec.managers[-1], campaign.spec.managers[0])))
    _check_number(len(managers))
    simulator = campaign.simulator(chosen.point)
    return [
        recorded_result(simulator.loaded, campaign.run(manager, chosen.run, simulator=simulator))
        for manager in managers
    ]


def missions_run(loaded: LoadedScenario, chosen: MissionSelection) -> list[Recorded]:
    """Run missions of a scenario.

    Raises:
        InputError: something chosen cannot be used.
        MissionError: a manager raised.
    """
    managers = chosen.managers or ("metacontrol",)
    _check_number(len(managers))
    check_range("run", chosen.run, 1, RUNS_LIMIT)
    check_seed(chosen.seed)
    check_inputs(loaded, managers, given=False)
    simulator = Simulator(loaded)
    return [recorded_result(loaded, simulator.run(each, chosen.run, chosen.seed, record=True)) for each in managers]


def _check_number(number: int) -> None:
    if number > MOST_MISSIONS:
        problem = f"{number} missions are given, and the replay shows {MOST_MISSIONS} side by side at most"
        raise InputError(problem, remedy="name one or two")
