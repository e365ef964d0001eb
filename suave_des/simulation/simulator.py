"""Runs missions of one scenario."""

from contextlib import closing

from suave_des.metrics.result import MissionResult
from suave_des.registry import ManagerLike
from suave_des.simulation.mission import Mission
from suave_des.simulation.prepared import PreparedScenario


class Simulator(PreparedScenario):
    """Runs missions of one scenario in this process.

    Args:
        loaded: the scenario with its files.
        runs_per_draw: how many runs in a row share the value drawn for a key path, and for those
            with which it shares a draw; one, if the path is not in it.
        training: what each manager has learned, by its name, kept from mission to mission; None:
            missions are no training.

    Example:
        >>> simulator = Simulator(load_scenario("seams2023"))
        >>> simulator.run("metacontrol", run=1, seed=8).metrics.search_time_s
        89.0
    """

    def run(
        self, manager: ManagerLike, run: int, seed: int, *, record: bool = False
    ) -> MissionResult:
        """Run one mission.

        Args:
            manager: name of the managing subsystem, module:Class, or a class.
            run: number of the run in its campaign; together with the seed it decides everything
                that is random.
            seed: seed of the campaign.
            record: whether to keep events and trajectory.

        Raises:
            MissionError: the manager raised; the error names it, the run and the mission time.
            InputError: the manager or the knowledge base cannot be used.
        """
        with closing(Mission(self, manager, run=run, seed=seed, record=record)) as mission:
            return mission.result()
