"""The mission coordinator: the two tasks, one after the other, the time limit, and the two metrics it records."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import simpy

from suave_des.clock import Process, tick_at_or_after, until
from suave_des.domain import FOLLOW_PIPELINE, GENERATE_SEARCH_PATH, MAINTAIN_MOTION, SURFACE, Task
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.follow import FollowPipeline
from suave_des.managed.node import Log
from suave_des.monitor.measurements import BatteryLevel
from suave_des.scenario.models import MissionFunctions
from suave_des.scenario.revision import CoordinatorRevision


class MissionTiming(NamedTuple):
    """Times of one mission, s: its limit, when its first task starts, and the phases of two timers."""

    time_limit_s: float
    start_delay_s: float
    poll_phase_s: float
    limit_phase_s: float


@dataclass(eq=False)
class MissionCoordinator:
    """Requests search_pipeline, then, when the pipeline is detected, inspect_pipeline; after a leak, surface.

    Attributes:
        ended: the event of the mission's end: the time limit, or the end of the path.
        search_time_s: whole seconds until the pipeline was found, as the revision counts them; none while it is not.
        task: the current task, if there is one.
        lasting_functions: functions that are needed from launch to the end, and belong to no task.
    """

    env: simpy.Environment
    revision: CoordinatorRevision
    timing: MissionTiming
    functions: MissionFunctions
    detector: PipelineDetector
    follow: FollowPipeline
    log: Log
    search_time_s: float | None = None
    _inspected_m: float | None = None  # at the mission's end
    task: Task | None = None

    def __post_init__(self) -> None:
        self.ended: simpy.Event = self.env.event()
        per_task = (MAINTAIN_MOTION,) if self.revision.maintain_motion_per_task else ()
        self.lasting_functions = (*(() if per_task else (MAINTAIN_MOTION,)), *self.functions.lasting)
        self._search = Task("search_pipeline", (*per_task, GENERATE_SEARCH_PATH, *self.functions.search_pipeline))
        self._inspect = Task("inspect_pipeline", (*per_task, FOLLOW_PIPELINE, *self.functions.inspect_pipeline))

    @property
    def distance_inspected_m(self) -> float:
        """Last published distance inspected, as of now or of the mission's end."""
        return self.follow.distance_m if self._inspected_m is None else self._inspected_m

    def start(self, request: Callable[[Task], None], cancel: Callable[[Task], None]) -> None:
        """Start the mission; `request` is called when a task begins, `cancel` when it ends."""
        self._request, self._cancel = request, cancel
        self.env.process(self._watch_time_limit())
        self._tasks = self.env.process(self._carry_out_tasks())

    def leak_handler(self, surfaced: simpy.Event) -> Callable[[], None]:
        """Make the function to call at a leak: tasks are cancelled, and the mission ends after the event `surfaced`."""
        self._surfaced = surfaced

        def leak() -> None:
            if not self.ended.triggered:
                self._tasks.interrupt()

        return leak

    def end_at_battery_level(self, battery: BatteryLevel, least_level: float) -> None:
        """End the mission at the first measurement of the battery that is at or below a level."""
        self.env.process(self._watch_battery(battery, least_level))

    def search_time_or_limit_s(self) -> float:
        """Return the search time metric, which is the time limit if the pipeline was not found."""
        return self.timing.time_limit_s if self.search_time_s is None else self.search_time_s

    def _carry_out_tasks(self) -> Process:
        try:
            yield from self._search_and_inspect()
        except simpy.Interrupt:
            yield from self._surface()

    def _search_and_inspect(self) -> Process:
        yield until(self.env, self.timing.start_delay_s)
        self._begin(self._search)
        yield self.detector.detected
        yield self._next_poll()
        by_detection = self.revision.search_time == "detection"
        found_s = self.detector.detected_s if by_detection else self.env.now
        self.search_time_s = float(math.floor(found_s + 1e-9))
        self._end("task_done")
        self._begin(self._inspect)
        yield self.follow.finished
        yield self._next_poll()
        self._end("task_done")
        self._finish("the end of the path is reached")

    def _surface(self) -> Process:
        self._end("task_cancelled")
        self._cancel(Task("lasting_functions", self.lasting_functions))
        self._begin(Task("surface", (SURFACE,)))
        yield self._surfaced
        yield self._next_poll()
        self._end("task_done")
        self._finish("the vehicle has surfaced")

    def _watch_time_limit(self) -> Process:
        timing, period_s = self.timing, self.revision.limit_check_period_s
        yield until(self.env, tick_at_or_after(timing.time_limit_s, timing.limit_phase_s, period_s))
        self._finish("time limit")

    def _watch_battery(self, battery: BatteryLevel, least_level: float) -> Process:
        yield until(self.env, battery.timing.phase_s)
        while battery.level(self.env.now) > least_level:
            yield self.env.timeout(battery.timing.period_s)
        self._finish(f"the battery is down to {battery.level(self.env.now):.2f}")

    def _next_poll(self) -> simpy.Event:
        phase_s, period_s = self.timing.poll_phase_s, self.revision.poll_period_s
        return until(self.env, tick_at_or_after(self.env.now, phase_s, period_s))

    def _begin(self, task: Task) -> None:
        self.task = task
        self.log("coordinator", "task_requested", task.name)
        self._request(task)

    def _end(self, how: str) -> None:
        task, self.task = self.task, None
        if task is not None:
            self.log("coordinator", how, task.name)
            self._cancel(task)

    def _finish(self, why: str) -> None:
        if not self.ended.triggered:
            # Effects of cancelling the current task come too late for the metric.
            self._inspected_m = self.follow.distance_m
            self._end("task_cancelled")
            self.log("coordinator", "mission_ended", why)
            self.ended.succeed()
