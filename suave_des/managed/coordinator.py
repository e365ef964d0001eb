"""The mission coordinator: the two tasks, one after the other, the time limit, and the two metrics
it records.

Source: the mission node of kas-lab/suave (its names are those of the paper), of 4 February 2023 and
of 1.5.0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import simpy

from suave_des.clock import Process, abandon, tick_at_or_after, until
from suave_des.domain import FOLLOW_PIPELINE, GENERATE_SEARCH_PATH, MAINTAIN_MOTION, SURFACE, Task
from suave_des.draws import Draws
from suave_des.events import Log, Said
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.follow import FollowPipeline
from suave_des.monitor.measurements import BatteryMeasurements
from suave_des.scenario.models import Scenario


@dataclass(eq=False)
class MissionCoordinator:
    """Requests search_pipeline, then, when the pipeline is detected, inspect_pipeline; after a
    leak, surface.

    Attributes:
        scenario: has the time limit, the revision's timers, and the functions that tasks need
            besides the exemplar's.
        draws: of the run: when the first task starts, and the phases of timers.
        surfaced: the event of the vehicle at the surface, where a leak is possible.
        ended: the event of the mission's end: the time limit, or the end of the path.
        search_time_s: whole seconds until the pipeline was found, as the revision counts them; None
            before.
        task: the current task; None between and after tasks.
        mission_wide_functions: functions that are needed from launch to the end (or a leak), and
            belong to no task.
    """

    env: simpy.Environment
    scenario: Scenario
    draws: Draws
    detector: PipelineDetector
    follow: FollowPipeline
    log: Log
    surfaced: simpy.Event | None = None
    search_time_s: float | None = field(default=None, init=False)
    task: Task | None = field(default=None, init=False)
    _inspected_m: float | None = field(default=None, init=False)  # at the mission's end

    def __post_init__(self) -> None:
        self.ended: simpy.Event = self.env.event()
        self.time_limit_s, further = (
            self.scenario.mission.time_limit_s,
            self.scenario.mission.functions,
        )
        self.revision = revision = self.scenario.revision.coordinator
        self._start_s = self.draws.value("latencies.task_start_s")
        self._poll_phase_s = self.draws.phase("coordinator", revision.poll_period_s)
        self._limit_phase_s = self.draws.phase("limit", revision.limit_check_period_s)
        per_task = revision.maintain_motion_per_task
        always, each_task = ((), (MAINTAIN_MOTION,)) if per_task else ((MAINTAIN_MOTION,), ())
        self.mission_wide_functions: tuple[str, ...] = (*always, *further.mission_wide)
        self._search = Task(
            "search_pipeline", (*each_task, GENERATE_SEARCH_PATH, *further.search_pipeline)
        )
        self._inspect = Task(
            "inspect_pipeline", (*each_task, FOLLOW_PIPELINE, *further.inspect_pipeline)
        )

    @property
    def functions(self) -> tuple[str, ...]:
        """The functions that the mission needs now."""
        return self.mission_wide_functions + (() if self.task is None else self.task.functions)

    @property
    def distance_inspected_m(self) -> float:
        """Last published distance inspected, as of now or of the mission's end."""
        return self.follow.distance_m if self._inspected_m is None else self._inspected_m

    @property
    def search_time_or_limit_s(self) -> float:
        """The search time metric, which is the time limit if the pipeline was not found."""
        return self.time_limit_s if self.search_time_s is None else self.search_time_s

    def start(self, request: Callable[[Task], None], cancel: Callable[[Task], None]) -> None:
        """Start the mission; `request` is called when a task begins, `cancel` when it ends."""
        self._request, self._cancel = request, cancel
        self.env.process(self._watch_time_limit())
        self._tasks = self.env.process(self._carry_out_tasks())

    def close(self) -> None:
        """Tell nobody of tasks any more."""
        abandon(self._tasks)
        del self._request, self._cancel, self._tasks

    def give_up(self) -> None:
        """Cancel the tasks, because of a leak; the mission ends when the vehicle has surfaced."""
        if not self.ended.triggered:
            self._tasks.interrupt()

    def _carry_out_tasks(self) -> Process:
        try:
            yield from self._search_and_inspect()
        except simpy.Interrupt:
            yield from self._surface()

    def _search_and_inspect(self) -> Process:
        yield until(self.env, self._start_s)
        self._begin(self._search)
        yield self.detector.detected
        yield self._next_poll()
        by_detection = self.revision.search_time == "detection"
        found_s = self.detector.detected_s if by_detection else self.env.now
        # a rounding error below a second counts as it
        self.search_time_s = float(math.floor(found_s + 1e-9))
        self._end("task_done")
        self._begin(self._inspect)
        yield self.follow.finished
        yield self._next_poll()
        self._end("task_done")
        self._finish("the end of the path is reached")

    def _surface(self) -> Process:
        self._end("task_cancelled")
        given_up, self.mission_wide_functions = (
            Task("mission_wide", self.mission_wide_functions),
            (),
        )
        self._cancel(given_up)
        self._begin(Task("surface", (SURFACE,)))
        assert self.surfaced is not None  # there is a leak
        yield self.surfaced
        yield self._next_poll()
        self._end("task_done")
        self._finish("the vehicle has surfaced")

    def _watch_time_limit(self) -> Process:
        period_s = self.revision.limit_check_period_s
        yield until(self.env, tick_at_or_after(self.time_limit_s, self._limit_phase_s, period_s))
        self._finish("time limit")

    def watch_battery(self, battery: BatteryMeasurements, least_level: float) -> Process:
        """End the mission at the first published level of the battery that is at or below one."""
        yield until(self.env, battery.timing.phase_s)
        while (level := battery.value(self.env.now)) is None or level > least_level:
            yield self.env.timeout(battery.timing.period_s)
        self._finish(f"the battery is down to {level:.2f}")

    def _next_poll(self) -> simpy.Event:
        return until(
            self.env,
            tick_at_or_after(self.env.now, self._poll_phase_s, self.revision.poll_period_s),
        )

    def _begin(self, task: Task) -> None:
        self.task = task
        self.log("coordinator", Said("task_requested", task.name))
        self._request(task)

    def _end(self, how: str) -> None:
        task, self.task = self.task, None
        if task is not None:
            self.log("coordinator", Said(how, task.name))
            self._cancel(task)

    def _finish(self, why: str) -> None:
        if not self.ended.triggered:
            # Effects of cancelling the current task come too late for the metric.
            self._inspected_m = self.follow.distance_m
            self._end("task_cancelled")
            self.log("coordinator", Said("mission_ended", why))
            self.ended.succeed()
