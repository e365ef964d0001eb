"""Monitors: processes that watch signals, thrusters and battery, and publish diagnostics (facts: kas-lab/suave)."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import simpy

from suave_des.clock import Process, tick_at_or_after, until
from suave_des.domain import thruster_name
from suave_des.monitor.diagnostics import FAILED, HULL, LEAK, RECOVERED, Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.measurements import BatteryLevel, Measurements, MonitorTiming
from suave_des.vehicle.frames import Pose


def signal_monitor(env: simpy.Environment, bus: DiagnosticsBus, measurements: Measurements) -> Process:
    """Publish a signal's measurements at their times."""
    for t_s, value in zip(measurements.times_s, measurements.values, strict=True):
        yield until(env, t_s)
        bus.publish(Diagnostic(env.now, Kind.QA_STATUS, measurements.key, value))


def battery_monitor(env: simpy.Environment, bus: DiagnosticsBus, level: BatteryLevel) -> Process:
    """Publish the battery's level, once a period."""
    published_before = 0
    yield until(env, level.timing.phase_s)
    while True:
        published = level.count_until(env.now)
        if published > published_before:  # else the message was lost
            bus.publish(Diagnostic(env.now, Kind.QA_STATUS, level.key, level.values[published - 1]))
        published_before = published
        yield env.timeout(level.timing.period_s)


def leak_monitor(env: simpy.Environment, bus: DiagnosticsBus, time_s: float, leak: Callable[[], None]) -> Process:
    """Publish the leak at its time, and call `leak`."""
    yield until(env, time_s)
    bus.publish(Diagnostic(env.now, Kind.COMPONENT_STATUS, HULL, LEAK))
    leak()


def detection_monitor(env: simpy.Environment, bus: DiagnosticsBus, detected: simpy.Event) -> Process:
    """Publish the first sight of the pipeline; the value of the event `detected` is the index of the point seen."""
    point = yield detected
    bus.publish(Diagnostic(env.now, Kind.DETECTION, "pipeline", float(point)))


class ScheduledEvent(NamedTuple):
    """A thruster that fails or recovers in a run.

    Attributes:
        thruster: its number, from 1.
        fails: whether it fails; otherwise it recovers.
        time_s: its time, as the revision counts it.
        recoverable: whether f_maintain_motion can recover it after this failure.
    """

    thruster: int
    fails: bool
    time_s: float
    recoverable: bool = True


def thruster_monitor(
    env: simpy.Environment,
    publish: Callable[[Diagnostic], None],
    events: Sequence[ScheduledEvent],
    inject: Callable[[float, ScheduledEvent], None],
    timing: MonitorTiming,
    after_previous: bool,
) -> Process:
    """Inject the scheduled faults and recoveries, and publish them.

    Once a period the monitor checks the first event of the list that has not happened yet: so several that are due
    come one period apart, in list order, and a later one waits for the one before it.

    Args:
        env: the mission's clock.
        publish: publishes a diagnostic.
        events: the schedule.
        inject: makes an event happen to the vehicle; called with mission time and event.
        timing: when the monitor checks.
        after_previous: whether each time counts from the event before it (rev 2023) or from the start (rev 1.5).
    """
    counted_from_s, earliest_s = 0.0, 0.0
    for event in events:
        due_s = max(counted_from_s + event.time_s, earliest_s)
        tick_s = tick_at_or_after(due_s, timing.phase_s, timing.period_s)
        yield until(env, tick_s)
        inject(env.now, event)
        status = FAILED if event.fails else RECOVERED
        publish(Diagnostic(env.now, Kind.COMPONENT_STATUS, thruster_name(event.thruster), status))
        earliest_s = tick_s + timing.period_s
        if after_previous:
            counted_from_s = tick_s


def state_monitor(
    env: simpy.Environment, bus: DiagnosticsBus, kind: Kind, key: str, state: Callable[[], Pose | float]
) -> Process:
    """Publish the vehicle's pose, or the distance inspected so far, once a second from t = 0 on."""
    while True:
        bus.publish(Diagnostic(env.now, kind, key, state()))
        yield env.timeout(1.0)
