"""Runs missions of one scenario."""

from collections.abc import Callable

import numpy as np
import simpy

from suave_des.clock import Process
from suave_des.managing.base import ManagingSubsystem
from suave_des.metrics.result import MissionResult
from suave_des.simulation.mission import MissionRun, RunSpec
from suave_des.simulation.prepared import PreparedScenario
from suave_des.vehicle.kernel import COLUMNS
from suave_des.vehicle.vehicle import track_rows

OnTime = Callable[[float, float], None]


class Simulator(PreparedScenario):
    """Runs missions of one scenario in this process.

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

    def start(
        self,
        manager: str,
        run: int,
        seed: int,
        *,
        record: bool = False,
        manager_type: type[ManagingSubsystem] | None = None,
    ) -> MissionRun:
        """Make a mission, at t = 0; call `give_back` when it is no longer needed.

        Args:
            manager: name of the managing subsystem, or module:Class.
            run: number of the run in its campaign.
            seed: seed of the campaign.
            record: whether to keep events and trajectory.
            manager_type: the manager's class; None: the class with that name.

        Raises:
            MissionError, InputError: as `run`.
        """
        track = self.spare_tracks.pop() if self.spare_tracks else np.empty((track_rows(self.duration_s), COLUMNS))
        try:
            return MissionRun(self, RunSpec(manager, run, seed, record, manager_type), track)
        except BaseException:
            self.spare_tracks.append(track)
            raise

    def give_back(self, mission: MissionRun) -> None:
        """Keep the memory of a mission that is no longer needed for the next one."""
        self.spare_tracks.append(mission.track)

    def run(
        self, manager: str, run: int, seed: int, *, record: bool = False, on_time: OnTime | None = None
    ) -> MissionResult:
        """Run one mission.

        Args:
            manager: name of the managing subsystem, or module:Class.
            run: number of the run in its campaign; together with the seed it decides everything that is random.
            seed: seed of the campaign.
            record: whether to keep events and trajectory.
            on_time: called once per second of mission time with that time and the time limit, in s.

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
