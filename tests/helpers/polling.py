"""The plain version of what is flown in compiled code or is looked up: missions must be the same.

- A function's tick is an event; it reads the vehicle's position, and sends one set-point at a time.
- The detection looks from each row of the track, which is an event, too.
- Metacontrol analyzes and plans in each cycle, and executes each plan.

Ticks come before other events at their time, and what they find before them is counted, as in the
exemplar. That managers are called at each of their times is the product's own: in a mission that is
recorded.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from heapq import heappush
from itertools import product
from typing import Any, Final
from unittest import mock

import pytest
import simpy

from suave_des.knowledge.state import Reasoning
from suave_des.managed.flight import Flight
from suave_des.managed.follow import FollowPipeline
from suave_des.managed.mode_manager import ModeManager
from suave_des.managed.search import GenerateSearchPath
from suave_des.managed.waypoints import WaypointFunction
from suave_des.managing.metacontrol import Metacontrol
from suave_des.metrics.result import MissionMetrics
from suave_des.scenario.modes import Mode
from suave_des.simulation.simulator import Simulator
from suave_des.vehicle.vehicle import STEP_S, row_at
from suave_des.world.pipeline import first_point_in_view

SEA_BED_Z_M = -20.0
_TICK, _LOOK = -1.0, -0.5
"""Priorities of events that come before those of SimPy, in this order."""


def call_first(
    env: simpy.Environment, t_s: float, priority: float, call: Callable[[], Any]
) -> None:
    """Call a function at mission time t, before SimPy's events at that time."""
    event = simpy.Event(env)
    event._ok, event._value = True, None
    event.callbacks.append(lambda _: call())
    heappush(env._queue, (t_s, priority, next(env._eid), event))


# The functions' ticks. `ticks` counts them, and `resend_at` is the one that sends again.


def start_at(self: WaypointFunction, t_s: float, *, resumes: bool = False) -> None:
    """Tick from mission time t on; a tick that is due now comes at once."""
    timer, now_s = self.timer, self.env.now
    timer.is_active, self.sends_first = True, not resumes
    start_s = now_s + (t_s - now_s) if t_s > now_s else now_s
    self.activation = activation = object()

    def tick_and_go_on(number: int) -> None:
        if timer.is_active and self.activation is activation:
            self.ticks = getattr(self, "ticks", 0) + 1
            PLAIN_TICKS[type(self)](self)
            again_s = start_s + (number + 1) * timer.period_s
            call_first(self.env, again_s, _TICK, lambda: tick_and_go_on(number + 1))

    if start_s > now_s:
        call_first(self.env, start_s, _TICK, lambda: tick_and_go_on(0))
    else:
        tick_and_go_on(0)


def search_tick(self: GenerateSearchPath) -> None:
    """Tick as the exemplar's node does."""
    spiral, node, sender = self.state, self.revision, self.sender
    if spiral.altitude_m != spiral.last_altitude_m:
        spiral.step += 1
        spiral.last_altitude_m = spiral.altitude_m
    x_m, y_m, z_m = sender.vehicle.position(self.env.now)
    far_m = max(abs(x_m - spiral.x_m), abs(y_m - spiral.y_m))
    if self.sends_first and not spiral.has_begun:
        next_on_the_spiral(self)
        resend_after = node.ticks_before_resending + 2
    elif self.sends_first:
        resend_after = node.ticks_before_resending + 2
    elif max(far_m, abs(z_m - spiral.z_m)) <= node.acceptance_m:
        next_on_the_spiral(self)
        resend_after = node.ticks_before_resending + 2
    elif self.ticks >= self.resend_at:
        spiral.below_m += node.workaround_step_m if far_m <= node.acceptance_m else 0.0
        resend_after = node.ticks_before_resending + 1
    else:
        return
    self.sends_first, self.resend_at = False, self.ticks + resend_after
    sender.send(spiral.x_m, spiral.y_m, SEA_BED_Z_M + spiral.altitude_m - spiral.below_m)


def next_on_the_spiral(self: GenerateSearchPath) -> None:
    spiral, step_rad = self.state, self.revision.angle_step_rad
    spiral.radius_m += 2.0 * spiral.altitude_m * self.view_tangent * step_rad / (2.0 * math.pi)
    spiral.x_m = spiral.centre_x_m + spiral.radius_m * math.cos(step_rad * spiral.step)
    spiral.y_m = spiral.centre_y_m + spiral.radius_m * math.sin(step_rad * spiral.step)
    spiral.z_m = SEA_BED_Z_M + spiral.altitude_m
    spiral.step += 1
    spiral.has_begun = True


def follow_poll(self: FollowPipeline) -> None:
    """Poll as the exemplar's node does: all points that are reached by now."""
    state, node, path = self.state, self.revision, self.path.tolist()
    polls = node.polls_before_resending
    first, again = (polls + 1, 1) if node.resends_at_each_poll else (polls, polls)

    def send(resend_after: int) -> None:
        self.sends_first, self.resend_at = False, self.ticks + resend_after
        x_m, y_m, _ = path[state.next_point]
        self.sender.send(x_m, y_m, SEA_BED_Z_M + node.altitude_m)

    if self.sends_first:
        send(first)
    x_m, y_m, _ = self.sender.vehicle.position(self.env.now)
    while all(
        abs(a - b) <= node.acceptance_m
        for a, b in zip((x_m, y_m), path[state.next_point][:2], strict=True)
    ):
        if state.has_arrived:
            state.travelled_m += math.dist(*[each[:2] for each in path[state.next_point - 1 :][:2]])
            state.published_m = state.travelled_m
        state.has_arrived = True
        state.next_point += 1
        if state.next_point == len(path):
            self.timer.is_active = False
            self.finished.succeed()
            return
        send(first)
    if self.ticks >= self.resend_at:
        send(again)


PLAIN_TICKS: Final = {GenerateSearchPath: search_tick, FollowPipeline: follow_poll}


# The flight: to the next event, and no tick and no look on the way.


def fly_to(self: Flight, t_s: float) -> None:
    self.vehicle.fly_to_row(row_at(t_s))


def begin(self: Flight, detector: Any, search: GenerateSearchPath, follow: FollowPipeline) -> None:
    """Look from each row."""
    self._detector, self._search, self._follow = detector, search, follow
    env, (*_, points, (times_s, visibility_m)) = search.env, self._fly.args
    rows, values = [row_at(t_s) for t_s in times_s.tolist()], visibility_m.tolist()

    def look(row: int) -> None:
        place, known = self.vehicle.position(row * STEP_S), bisect_right(rows, row)
        point = -1
        if known:
            tangent = self.state.camera.tangent
            point = first_point_in_view(*place, values[known - 1], points, tangent)
        if point >= 0:
            detector.detect_at(row * STEP_S, point)
        elif row < self.vehicle.last_row:
            call_first(env, (row + 1) * STEP_S, _LOOK, lambda: look(row + 1))

    look(0)


def analyze_and_plan_anew(self: Metacontrol, measured: object) -> Reasoning:
    """Go through analyze and plan, without looking up the result for an equal state."""
    inference = self.analyze()
    return Reasoning(inference, self.plan(inference))


IN_EACH_CYCLE: Final = {
    "_analyze_and_plan": analyze_and_plan_anew,
    "_changes_nothing": lambda self, reasoning: False,
}


@contextmanager
def polled() -> Iterator[None]:
    """Missions that are run meanwhile are plain."""
    with ExitStack() as stack:
        for kind, methods in (
            (Flight, {"fly_to": fly_to, "begin": begin}),
            (WaypointFunction, {"start_at": start_at}),
            (Metacontrol, IN_EACH_CYCLE),
        ):
            stack.enter_context(mock.patch.multiple(kind, **methods))
        yield


Effect = tuple[float, str]


def effects(
    simulator: Simulator, manager: str, run: int, *, record: bool
) -> tuple[MissionMetrics, list[Effect]]:
    """Metrics of a mission, and the modes that took effect with their times."""
    found: list[Effect] = []
    take_effect = ModeManager._take_effect

    def noted(self: ModeManager, function: str, mode: Mode) -> None:
        found.append((self.env.now, f"{function} = {mode.name}"))
        take_effect(self, function, mode)

    with mock.patch.object(ModeManager, "_take_effect", noted):
        return simulator.run(manager, run, 1, record=record).metrics, found


def each_pair(fewest: Iterable[Any], second: Iterable[Any], third: Iterable[Any]) -> list[Any]:
    """Make all cells parameters of a test; quick are those in which the levels of the factor with
    fewest take turns.
    """
    levels = [list(enumerate(each)) for each in (fewest, second, third)]
    return [
        pytest.param(
            one, two, three, marks=() if i == (j + k) % len(levels[0]) else pytest.mark.slow
        )
        for (i, one), (j, two), (k, three) in product(*levels)
    ]
