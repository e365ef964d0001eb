"""The plain version of what looks ahead or is looked up: missions must be the same.

- A function reads the vehicle's position at each tick, and sends one set-point at a time.
- Metacontrol analyzes and plans in each cycle, and executes each plan.

That managers are called at each of their times is the product's own: in a mission that is recorded.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import product
from typing import Any, Final
from unittest import mock

import pytest

from suave_des.knowledge.state import Reasoning
from suave_des.managed.mode_manager import ModeManager
from suave_des.managed.waypoints import Due, WaypointFunction
from suave_des.managing.metacontrol import Metacontrol
from suave_des.metrics.result import MissionMetrics
from suave_des.scenario.modes import Mode
from suave_des.simulation.simulator import Simulator


def tick(self: WaypointFunction) -> None:
    """Act at each tick: send what is due, and see whether the current way-point is reached now."""
    check = self._check = self._check or self.arrival_check(self.env.now)
    now = self._act_at
    self.ticked()
    while True:
        if not len(self.waypoints(1)):
            self._check = None
            self.completed()
            return
        if self._due is not Due.NOTHING:
            self.sender.send(*self.waypoints(1)[0, :2].tolist(), self.set_point_z_m())
            self._resend_at = now + (
                check.resend_ticks if self._due is Due.SEND else check.resend_again_ticks
            )
            self._due = Due.NOTHING
            if check.first_check_ticks:
                break
        here, there = (
            self.sender.vehicle.position(check.time_s(now)),
            self.waypoints(1)[0, :3].tolist(),
        )
        x_m, y_m, z_m = (abs(a - b) for a, b in zip(here, there, strict=True))
        if max(x_m, y_m) <= check.half_width_m and z_m <= check.half_height_m:
            self.reached(1)
            self._due = Due.SEND
        elif now >= self._resend_at:
            self.not_reached()
            self._due = Due.RESEND
        else:
            break
    self._set_alarm(check, now + 1)


def catch_up(self: WaypointFunction) -> None:
    """A tick that is due at this very time comes first."""
    while self._check is not None and self._act_at <= self._check.last_tick_until(self.env.now):
        self._act()


def analyze_and_plan_anew(self: Metacontrol) -> Reasoning:
    """Go through analyze and plan, without looking up the result for an equal state."""
    inference = self.analyze()
    return Reasoning(inference, self.plan(inference))


POLLING: Final = {
    "_act": tick,
    "catch_up": catch_up,
    "waypoints_changed": lambda self: None,  # the next tick asks for the way-point anyway
    "_control_changed": lambda self: None,
}
IN_EACH_CYCLE: Final = {
    "_analyze_and_plan": analyze_and_plan_anew,
    "_changes_nothing": lambda self, reasoning: False,
}


@contextmanager
def polled() -> Iterator[None]:
    """Missions that are run meanwhile are plain."""
    with ExitStack() as stack:
        for kind, methods in ((WaypointFunction, POLLING), (Metacontrol, IN_EACH_CYCLE)):
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
