"""Runs missions of one scenario."""

from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy

from suave_des.chance import Distributions
from suave_des.clock import Process
from suave_des.compiling import Array
from suave_des.managed.follow import InspectionPath
from suave_des.managing.learned import read_learned
from suave_des.metrics.result import MissionResult
from suave_des.registry import manager_class
from suave_des.scenario.loader import LoadedScenario
from suave_des.simulation.functions import own_functions
from suave_des.simulation.vehicles import vehicle_model
from suave_des.vehicle.kernel import ROW
from suave_des.vehicle.vehicle import track_rows
from suave_des.world.pipeline import sample_points, there_and_back

if TYPE_CHECKING:
    from suave_des.knowledge.deliberation import Deliberation
    from suave_des.managing.base import ManagingSubsystem
    from suave_des.simulation.mission import MissionRun

OnTime = Callable[[float, float], None]


class Simulator:
    """Runs missions of one scenario in this process; what does not change between missions is made once.

    Args:
        loaded: the scenario with its files.
        runs_per_draw: how many runs in a row share the value drawn for a key path; one, if the path is not in it.
        training: what each manager has learned, by its name, kept from mission to mission; None: missions are no
            training.

    Example:
        >>> simulator = Simulator(load_scenario("seams2023"))
        >>> simulator.run("metacontrol", run=1, seed=8).metrics.search_time_s
        119.0
    """

    def __init__(
        self,
        loaded: LoadedScenario,
        runs_per_draw: Mapping[str, int] = MappingProxyType({}),
        training: dict[str, dict[str, Any]] | None = None,
    ) -> None:
        self.loaded, self.training = loaded, training
        self.runs_per_draw = dict(runs_per_draw)
        scenario = loaded.scenario
        self.distributions = Distributions(scenario)
        self.points = sample_points(scenario.pipeline.vertices_m, scenario.pipeline.points_per_piece)
        self.path = InspectionPath.along(there_and_back(self.points), scenario.revision.follow.altitude_m)
        self.detection_points = self.points + np.array([0.0, 0.0, scenario.revision.monitors.detected_point_height_m])
        self.duration_s = scenario.mission.time_limit_s + scenario.revision.coordinator.limit_check_period_s
        self.own_functions = own_functions(loaded)
        self.vehicle_model = vehicle_model(scenario.vehicle)
        self.view_tangent = scenario.vehicle.camera.tangent
        self._spare_tracks: list[Array] = []  # to allocate one for each mission would fragment memory
        self._learned: dict[str, Mapping[str, Any]] = {}
        self._manager_files: dict[str, Mapping[str, Path]] = {}

    @cached_property
    def knowledge(self) -> "Deliberation":
        """The scenario's knowledge base with its reasoner, opened and checked on first use."""
        from suave_des.scenario_knowledge import open_knowledge  # owlready2 is loaded only when it is needed

        return open_knowledge(self.loaded)

    def learned(self, manager: str) -> Mapping[str, Any]:
        """What a manager has learned: in training what it may change, else the content of its file, if it has one.

        Raises:
            InputError: the file cannot be read, or has something else in it.
        """
        if self.training is not None:
            return self.training.setdefault(manager, {})
        if manager not in self._learned:
            name = self.loaded.manager_settings(manager).get("learned")
            path = None if name is None else self.loaded.manager_file(manager, str(name))
            self._learned[manager] = {} if path is None else read_learned(path)
        return self._learned[manager]

    def manager_files(self, manager: str) -> Mapping[str, Path]:
        """Where the files are that a manager declares, by their names as given.

        Raises:
            InputError: one is not there.
        """
        if manager not in self._manager_files:
            self._manager_files[manager] = dict(self.loaded.declared_files(manager, manager_class(manager)))
        return self._manager_files[manager]

    def start(
        self, manager: str, run: int, seed: int, *, record: bool = False, kind: "type[ManagingSubsystem] | None" = None
    ) -> "MissionRun":
        """Make a mission, at t = 0; `give_back` is to be called when it is no longer needed.

        Args:
            manager: name of the managing subsystem, or module:Class.
            run: number of the run in its campaign.
            seed: seed of the campaign.
            record: whether to keep events and trajectory.
            kind: the manager's class; None: the one that its name leads to.

        Raises:
            MissionError, InputError: as `run`.
        """
        from suave_des.simulation.mission import MissionRun

        track = self._spare_tracks.pop() if self._spare_tracks else np.empty((track_rows(self.duration_s), ROW))
        try:
            return MissionRun(self, manager, run, seed, track, record=record, kind=kind)
        except BaseException:
            self._spare_tracks.append(track)
            raise

    def give_back(self, mission: "MissionRun") -> None:
        """Keep the memory of a mission that is no longer needed for the next one."""
        self._spare_tracks.append(mission.track)

    def run(
        self, manager: str, run: int, seed: int, *, record: bool = False, on_time: OnTime | None = None
    ) -> MissionResult:
        """Run one mission.

        Args:
            manager: name of the managing subsystem, or module:Class.
            run: number of the run in its campaign; together with the seed it decides everything that is random.
            seed: seed of the campaign.
            record: whether to keep events and trajectory.
            on_time: called each second of mission time with it and the time limit, in s.

        Raises:
            MissionError: the manager raised; the error names it, the run and the mission time.
            InputError: the manager or the knowledge base cannot be used.
        """
        mission = self.start(manager, run, seed, record=record)
        try:
            if on_time is not None:
                mission.env.process(_report_time(mission.env, on_time, self.loaded.scenario.mission.time_limit_s))
            return mission.result()
        finally:
            self.give_back(mission)


def _report_time(env: simpy.Environment, on_time: OnTime, limit_s: float) -> Process:
    while env.now <= limit_s:
        on_time(env.now, limit_s)
        yield env.timeout(1.0)
