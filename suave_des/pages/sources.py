"""Where a replay's missions come from: recorded ones, those of a campaign, or missions that are run for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from suave_des.campaign.again import OpenedCampaign, opened_campaign
from suave_des.campaign.inputs import check_inputs
from suave_des.campaign.spec import RUNS_LIMIT, check_range, check_seed
from suave_des.campaign.store import STORE_FILE
from suave_des.errors import InputError
from suave_des.pages.recorded import Recorded, read_recorded, recorded_result
from suave_des.scenario.loader import LoadedScenario
from suave_des.simulation.simulator import Simulator

MOST_MISSIONS = 2
"""Missions that a replay shows side by side."""
_MISSION_FILE = "mission.json"


@dataclass(frozen=True)
class Chosen:
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


def missions_in(folders: Sequence[Path], chosen: Chosen) -> list[Recorded]:
    """Read the missions in folders: a recorded one of each, or those chosen of a campaign, which are run again.

    Raises:
        InputError: there is neither a mission nor a campaign in a folder, or too many missions for one page.
        MissionError: a manager raised.
    """
    missions: list[Recorded] = []
    for folder in folders:
        if (folder / _MISSION_FILE).is_file() or not (folder / STORE_FILE).is_file():
            _check_folder(folder)
            missions.append(read_recorded(folder))
        else:
            with opened_campaign(folder, chosen.managers) as campaign:
                missions += missions_of(campaign, chosen)
    _check_number(len(missions))
    pipelines = [mission.scenario.pipeline.vertices_m for mission in missions]
    for mission, folder in zip(missions[1:], folders[1:], strict=False):
        if mission.scenario.pipeline.vertices_m != pipelines[0]:
            raise InputError("has another pipeline", file=folder, remedy="give missions over the same one")
    return missions


def missions_of(campaign: OpenedCampaign, chosen: Chosen) -> list[Recorded]:
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


def missions_run(loaded: LoadedScenario, chosen: Chosen) -> list[Recorded]:
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


def _check_folder(folder: Path) -> None:
    if not folder.is_dir():
        raise InputError("no such folder", file=folder, remedy="give the folder that run or campaign wrote with --out")
    if not (folder / _MISSION_FILE).is_file():
        problem = f"has neither a mission ({_MISSION_FILE}) nor a campaign that can be run again ({STORE_FILE})"
        raise InputError(problem, file=folder, remedy="give the folder that run or campaign wrote with --out")


def _check_number(number: int) -> None:
    if number > MOST_MISSIONS:
        problem = f"{number} missions are given, and the replay shows {MOST_MISSIONS} side by side at most"
        raise InputError(problem, remedy="name one or two")
