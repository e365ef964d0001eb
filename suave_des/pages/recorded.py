"""Missions with their whole record, for a page: read from folders, repeated from a campaign, or newly run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from suave_des.campaign.campaign import opened_campaign
from suave_des.campaign.inputs import check_inputs
from suave_des.campaign.missions import MissionRunner
from suave_des.campaign.spec import check_mission
from suave_des.errors import InputError
from suave_des.metrics.result import MissionResult
from suave_des.records.mission_folder import MISSION_FILE, MissionRecord, read_mission, record_of
from suave_des.records.store import STORE_FILE
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import Scenario
from suave_des.simulation.simulator import Simulator

MOST_MISSIONS = 2
"""Missions that a replay shows side by side."""


@dataclass(frozen=True)
class Recorded:
    """A mission with its whole record.

    Attributes:
        record: what its files have.
        scenario: the scenario in full.
        loaded: the scenario with its files, where it was read for this.
    """

    record: MissionRecord
    scenario: Scenario
    loaded: LoadedScenario | None = None


def recorded_result(loaded: LoadedScenario, result: MissionResult) -> Recorded:
    """Take a mission that was just run, with its record."""
    return Recorded(record_of(result, loaded), loaded.scenario, loaded)


def recorded(record: MissionRecord) -> Recorded:
    """Take a mission that was read from its folder.

    Raises:
        InputError: its scenario is of another version.
    """
    try:
        return Recorded(record, Scenario.model_validate(record.scenario))
    except ValidationError:
        problem = f"the scenario of {record.name} is one that this suave-des does not read"
        raise InputError(problem, file=MISSION_FILE, remedy="run the mission again") from None


@dataclass(frozen=True)
class MissionSelection:
    """Which missions of a scenario or campaign are wanted.

    Attributes:
        managers: names; none: of a campaign the last and the first, of a scenario metacontrol.
        run: number of the run, the same for all.
        seed: of everything that is random; a campaign has its own.
        point: of a campaign's sweep.
        confirmed: whether the code of managers and functions that a campaign's folder names may run.
    """

    managers: tuple[str, ...] = ()
    run: int = 1
    seed: int = 1
    point: int = 0
    confirmed: bool = False


def missions_in(folders: Sequence[Path], chosen: MissionSelection) -> list[Recorded]:
    """Read the missions in folders: a recorded one of each, or those chosen of a campaign, which are run again.

    Raises:
        InputError: there is neither a mission nor a campaign in a folder, or too many missions for one page.
        MissionError: a manager raised.
    """
    missions: list[Recorded] = []
    for folder in folders:
        if (folder / MISSION_FILE).is_file():
            missions.append(recorded(read_mission(folder)))
        elif (folder / STORE_FILE).is_file():
            missions += missions_of(opened_campaign(folder, chosen.managers, confirmed=chosen.confirmed), chosen)
        else:
            problem = f"has neither a mission ({MISSION_FILE}) nor a campaign that can be run again ({STORE_FILE})"
            remedy = "give the folder that run or campaign wrote with --out"
            raise InputError(problem if folder.is_dir() else "no such folder", file=folder, remedy=remedy)
    _check_number(len(missions))
    for mission, folder in zip(missions, folders, strict=False):
        if mission.scenario.pipeline.vertices_m != missions[0].scenario.pipeline.vertices_m:
            raise InputError("has another pipeline", file=folder, remedy="give missions over the same one")
    return missions


def missions_of(opened: MissionRunner, chosen: MissionSelection) -> list[Recorded]:
    """Run missions of a campaign again.

    Raises:
        InputError: the campaign has no such mission, or too many are wanted.
        MissionError: a manager raised.
    """
    known = opened.campaign.spec.managers
    managers = chosen.managers or tuple(dict.fromkeys((known[-1], known[0])))
    _check_number(len(managers))
    return [recorded_result(*opened.run(manager, chosen.run, chosen.point)) for manager in managers]


def missions_run(loaded: LoadedScenario, chosen: MissionSelection) -> list[Recorded]:
    """Run missions of a scenario.

    Raises:
        InputError: something chosen cannot be used.
        MissionError: a manager raised.
    """
    managers = chosen.managers or ("metacontrol",)
    _check_number(len(managers))
    check_mission(chosen.run, chosen.seed)
    check_inputs([loaded], managers, {})
    simulator = Simulator(loaded)
    return [recorded_result(loaded, simulator.run(each, chosen.run, chosen.seed, record=True)) for each in managers]


def _check_number(number: int) -> None:
    if number > MOST_MISSIONS:
        problem = f"{number} missions are given, and the replay shows {MOST_MISSIONS} side by side at most"
        raise InputError(problem, remedy="name one or two")
