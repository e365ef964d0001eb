"""Runs the missions of a campaign, in whatever process they are to run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from suave_des.campaign import machine_code
from suave_des.campaign.knowledge_lines import mission_line
from suave_des.campaign.outcomes import Failure, Finished, Job, Outcome, row_of, time_out_cause
from suave_des.campaign.plan import Chunk, MissionKey
from suave_des.campaign.sweep import cell_of
from suave_des.campaign.time_limit import Limit, TimeOut, time_limits
from suave_des.errors import MissionError
from suave_des.scenario.models import Mission
from suave_des.simulation.result import MissionResult
from suave_des.simulation.simulator import Simulator


class MissionRunner:
    """Runs chunks of missions of one job in this process.

    Args:
        job: the scenario and what else decides a mission.
    """

    def __init__(self, job: Job) -> None:
        self._job = job
        self._drawn = tuple(job.variation.drawn)
        self._warm_up()
        self._go_to(0)

    def run(self, chunk: Chunk) -> list[Finished]:
        """The outcome of each mission, in order.

        Raises:
            InputError: the scenario, a manager or the knowledge base cannot be used at all.
        """
        return list(self.each(chunk))

    def each(self, missions: Iterator[MissionKey] | Chunk) -> Iterator[Finished]:
        """The same mission by mission."""
        with time_limits() as limit:
            for key in missions:
                yield key, self._outcome(key, limit)

    def _outcome(self, key: MissionKey, limit: Limit) -> Outcome:
        if key.point != self._point:
            self._go_to(key.point)
        manager = self._job.managers[key.manager]
        try:
            with limit(self._job.time_out_s):
                result = self._simulator.run(manager, key.run, self._job.seed, record=self._job.record_knowledge)
        except MissionError as error:
            return Failure(error.manager, error.run, error.time_s, error.cause, point=key.point)
        except TimeOut:
            return self._job.failed(key, time_out_cause(self._job.time_out_s))[1]
        row = (*row_of(result.metrics), *self._swept, *(result.drawn[path] for path in self._drawn))
        return (*row, self._knowledge(key, result)) if self._job.record_knowledge else row

    def _knowledge(self, key: MissionKey, result: MissionResult) -> str:
        if not result.knowledge:
            return ""
        variation = self._job.variation
        values = variation.sweep.values(key.point)
        swept = {variation.paths[name]: value for name, value in values.items()}
        return mission_line(self._job.managers[key.manager], key.point, key.run, result.knowledge, swept)

    def _warm_up(self) -> None:
        """Load or compile what missions run, before the first one's time counts: a mission of a second does."""
        short = self._job.loaded.scenario.model_copy(update={"mission": Mission(time_limit_s=1.0)})
        Simulator(replace(self._job.loaded, scenario=short)).run("none", 1, 0)
        machine_code.note_stored()

    def _go_to(self, point: int) -> None:
        """Have the simulator of a point; one is kept, as missions come point by point."""
        variation = self._job.variation
        loaded = variation.scenario(self._job.loaded, point)
        self._point, self._simulator = point, Simulator(loaded, dict.fromkeys(variation.drawn, variation.runs_per_draw))
        self._swept = tuple(map(cell_of, variation.sweep.values(point).values()))
