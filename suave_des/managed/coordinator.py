"""The mission coordinator: the two tasks, their hand-over, the time limit, and the two metrics it writes down."""

from __future__ import annotations

import math
from collections.abc import Callable

import simpy

from suave_des.clock import call_at, tick_at_or_after
from suave_des.managed.detection import PipelineDetector
from suave_des.managed.follow import FollowPipeline
from suave_des.managed.node import Log
from suave_des.managed.task import FOLLOW, MAINTAIN_MOTION, SEARCH, Task
from suave_des.scenario.revision import CoordinatorRevision


class MissionCoordinator:
    """Requests search_pipeline, then, when the pipeline is detected, inspect_pipeline.

    Attributes:
        ended: the event of the mission's end: the time limit, or the end of the path.
        search_time_s: whole seconds until the pipeline was found, as the revision counts them; none while it is not
            found.
        distance_inspected_m: distance inspected, as it was published last before the mission's end.
        task: the task under way.

    Args:
        env: the mission's clock.
        revision: how the exemplar's revision behaves.
        detector: says when the pipeline is seen.
        follow: says when its end is reached.
        request: called with each task that begins.
        cancel: called with each task that is over.
        time_limit_s: mission time at which the mission ends, looked at at the ticks of a timer.
        start_delay_s: from guided mode to the first request.
        poll_phase_s: time of a tick of the coordinator's loop.
        limit_phase_s: time of a tick of the limit's timer.
        log: takes what happened.
    """

    def __init__(
        self,
        env: simpy.Environment,
        revision: CoordinatorRevision,
        detector: PipelineDetector,
        follow: FollowPipeline,
        request: Callable[[Task], None],
        cancel: Callable[[Task], None],
        *,
        time_limit_s: float,
        start_delay_s: float,
        poll_phase_s: float,
        limit_phase_s: float,
        log: Log,
    ) -> None:
        self._env = env
        self._revision = revision
        self._detector = detector
        self._follow = follow
        self._request = request
        self._cancel = cancel
        self._time_limit_s = time_limit_s
        self._poll_phase_s = poll_phase_s
        self._log = log
        self.ended = env.event()
        self.search_time_s: float | None = None
        self.distance_inspected_m = 0.0
        self.task: Task | None = None
        shared = (MAINTAIN_MOTION,) if revision.maintain_motion_per_task else ()
        self._search = Task("search_pipeline", (*shared, SEARCH))
        self._inspect = Task("inspect_pipeline", (*shared, FOLLOW))
        self.lasting_functions = () if revision.maintain_motion_per_task else (MAINTAIN_MOTION,)
        """Functions that are needed from launch to the end, and belong to no task."""
        limit_s = tick_at_or_after(time_limit_s, limit_phase_s, revision.limit_check_period_s)
        detector.detected.callbacks.append(self._note_detection)
        call_at(env, limit_s, lambda _: self._finish("time limit"))
        call_at(env, start_delay_s, self._begin_search)

    def search_time_or_limit_s(self) -> float:
        """The search time metric; the time limit when the pipeline was not found."""
        return self._time_limit_s if self.search_time_s is None else self.search_time_s

    def _begin_search(self, _: simpy.Event) -> None:
        self._begin(self._search)
        self._at_poll_after(self._detector.detected, self._begin_inspection)

    def _begin_inspection(self, _: simpy.Event) -> None:
        seen_s = float(self._env.now)
        if self._revision.search_time == "detection" and self._detector.detected_s is not None:
            seen_s = self._detector.detected_s
        self.search_time_s = float(math.floor(seen_s + 1e-9))
        self._end("task_done")
        self._begin(self._inspect)
        self._at_poll_after(self._follow.finished, self._end_inspection)

    def _end_inspection(self, _: simpy.Event) -> None:
        self._end("task_done")
        self._finish("the end of the path is reached")

    def _at_poll_after(self, event: simpy.Event, what: Callable[[simpy.Event], None]) -> None:
        """Go on at the first tick of the coordinator's loop at or after an event, which may have been already."""

        def wait(_: simpy.Event) -> None:
            call_at(self._env, self._next_poll_s(), what)

        if event.callbacks is None:
            wait(event)
        else:
            event.callbacks.append(wait)

    def _note_detection(self, _: simpy.Event) -> None:
        self._log("detection", "pipeline_detected", f"point {self._detector.first_point}")

    def _next_poll_s(self) -> float:
        return tick_at_or_after(self._env.now, self._poll_phase_s, self._revision.poll_period_s)

    def _begin(self, task: Task) -> None:
        self.task = task
        self._log("coordinator", "task_requested", task.name)
        self._request(task)

    def _end(self, how: str) -> None:
        task, self.task = self.task, None
        if task is not None:
            self._log("coordinator", how, task.name)
            self._cancel(task)

    def _finish(self, why: str) -> None:
        if not self.ended.triggered:
            # What the cancellation of the present task brings about comes too late for the metric.
            self.distance_inspected_m = self._follow.distance_m
            self._end("task_cancelled")
            self._log("coordinator", "mission_ended", why)
            self.ended.succeed()
