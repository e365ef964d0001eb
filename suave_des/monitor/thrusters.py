"""The vehicle's thrusters, which fail and recover; and the exemplar's thruster monitor, which makes
them do so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import simpy

from suave_des.clock import Process, tick_at_or_after, until
from suave_des.domain import THRUSTER_NAMES
from suave_des.draws import Draws
from suave_des.events import Log, Said
from suave_des.monitor.diagnostics import FAILED, RECOVERED, Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.measurements import Timing
from suave_des.scenario.models import Scenario, ThrusterEvent, ThrusterFailureRevision
from suave_des.vehicle.vehicle import ThrusterState, Vehicle


@dataclass(eq=False)
class Thrusters:
    """The health of the vehicle's thrusters.

    Attributes:
        revision: says how they fail, and from when on.
        is_lost: says of each failure whether it has no effect.
        unrecoverable: thrusters that f_maintain_motion cannot recover at present.
        working: mission times at which a thruster's state was set, also to what it was, and how many
            worked from then on.
    """

    env: simpy.Environment
    vehicle: Vehicle
    revision: ThrusterFailureRevision
    log: Log
    is_lost: Callable[[], bool] = field(default=lambda: False)
    unrecoverable: set[int] = field(default_factory=set, init=False)
    working: list[tuple[float, int]] = field(default_factory=list, init=False)

    def apply(self, event: ThrusterEvent) -> None:
        """Let one of the scenario's events happen to the vehicle now."""
        fails = event.event == "failure"
        if fails and (self.is_lost() or self.env.now < self.revision.effective_from_s):
            name = THRUSTER_NAMES[event.thruster - 1]
            self.log("thruster_monitor", Said("failure_without_effect", name))
            return
        if fails and not event.recoverable:
            self.unrecoverable.add(event.thruster)
        else:
            self.unrecoverable.discard(event.thruster)
        self._set(
            event.thruster, (event.failure_mode or self.revision.failure_mode) if fails else "works"
        )

    def recover(self, thruster: int) -> bool:
        """Recover a thruster; return whether it can be recovered."""
        if thruster in self.unrecoverable:
            return False
        self._set(thruster, "works")
        return True

    def _set(self, thruster: int, state: ThrusterState) -> None:
        self.vehicle.set_thruster(self.env.now, thruster, state)
        self.working.append((self.env.now, self.vehicle.thrusters.count("works")))


def failure_loss(revision: ThrusterFailureRevision, draws: Draws) -> Callable[[], bool]:
    """Make the function that says of one failure after the other whether it has no effect."""
    probability = revision.loss_probability
    if probability == 0.0:
        return lambda: False
    stream = draws.stream("thruster_failures.loss")
    return lambda: stream.random() < probability


def draw_schedule(scenario: Scenario, draws: Draws) -> list[tuple[ThrusterEvent, float]]:
    """Draw the times of the thruster events for a run, each as the revision counts it, s."""
    events = enumerate(scenario.thruster_events)
    return [
        (each, draws.value(f"thruster_events.{n}.time_s", each.time_s, least=0.0))
        for n, each in events
    ]


def thruster_monitor(
    thrusters: Thrusters,
    bus: DiagnosticsBus,
    schedule: Sequence[tuple[ThrusterEvent, float]],
    timing: Timing,
    after_previous: bool,
    is_lost: Callable[[float], bool] | None = None,
) -> Process:
    """Let the scheduled failures and recoveries happen, and publish them.

    Once a period the monitor checks the first event of the list that has not happened yet: so
    several that are due come one period apart, in list order, and a later one waits for the one
    before it.

    Args:
        thrusters, bus: to whom it happens, and where it is published.
        schedule, timing: the events with their times, s, and when the monitor checks.
        after_previous: whether each time counts from the event before it (revision 2023) or from
            the start (1.5).
        is_lost: says whether the message at a mission time is not published; None: each one is.
    """
    env, counted_from_s, earliest_s, ticks_s = thrusters.env, 0.0, 0.0, []
    for _, time_s in schedule:
        due_s = max(counted_from_s + time_s, earliest_s)
        ticks_s.append(tick_s := tick_at_or_after(due_s, timing.phase_s, timing.period_s))
        earliest_s = tick_s + timing.period_s
        if after_previous:
            counted_from_s = tick_s
    for (event, _), tick_s in zip(schedule, ticks_s, strict=True):
        yield until(env, tick_s)
        thrusters.apply(event)
        if is_lost is None or not is_lost(env.now):
            status = FAILED if event.event == "failure" else RECOVERED
            bus.publish(
                Diagnostic(
                    env.now, Kind.COMPONENT_STATUS, THRUSTER_NAMES[event.thruster - 1], status
                )
            )
