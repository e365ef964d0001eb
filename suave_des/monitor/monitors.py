"""Monitors: they watch signals, thrusters and battery, and publish diagnostics (facts: kas-lab/suave).

A monitor that repeats an unchanged value tells nobody anything new, so a signal's diagnostics are published only when
the value differs from the one before; they keep the times that the monitor's period gives them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import simpy

from suave_des.clock import Process, tick_at_or_after, until
from suave_des.monitor.diagnostics import FAILED, RECOVERED, Diagnostic, DiagnosticsBus, Kind
from suave_des.world.signals import Signal


@dataclass(frozen=True, slots=True)
class Measurements:
    """What a signal's monitor measures in a run: the times at which the published value changes, and the values."""

    key: str
    times_s: tuple[float, ...]
    values: tuple[float, ...]
    phase_s: float
    period_s: float

    def next_message_s(self, t_s: float) -> float:
        """Time of the first message, changed or not, at or after t."""
        return tick_at_or_after(t_s, self.phase_s, self.period_s)


def measure(
    key: str,
    signal: Signal,
    duration_s: float,
    *,
    period_s: float,
    phase_s: float,
    time_step_s: float = 0.0,
    noise: Callable[[], float] | None = None,
) -> Measurements:
    """Measure a signal over a mission.

    Args:
        key: the quality attribute.
        signal: the signal, already cut to time steps if it is.
        duration_s: how long to measure.
        period_s: publishing period.
        phase_s: time of the first message.
        time_step_s: the signal is constant within steps of this length; 0 if it is not.
        noise: draws the error of one measurement; none if measurements are exact.
    """
    times, values = [], []
    last_value, last_step, value = math.nan, -1, math.nan
    for count in range(max(0, math.floor((duration_s - phase_s) / period_s)) + 1):
        t_s = phase_s + count * period_s
        step = math.floor(t_s / time_step_s + 1e-6) if time_step_s else count
        if step != last_step:
            value, last_step = signal(t_s), step
        measured = value if noise is None else value + noise()
        if measured != last_value:
            times.append(t_s)
            values.append(measured)
            last_value = measured
    return Measurements(key, tuple(times), tuple(values), phase_s, period_s)


def signal_monitor(env: simpy.Environment, bus: DiagnosticsBus, measurements: Measurements) -> Process:
    """Publish a signal's measurements at their times."""
    for t_s, value in zip(measurements.times_s, measurements.values, strict=True):
        yield until(env, t_s)
        bus.publish(Diagnostic(env.now, Kind.QA_STATUS, measurements.key, value))


@dataclass(frozen=True, slots=True)
class ThrusterFault:
    """A thruster that fails or recovers, time in s as the revision counts it."""

    thruster: int
    fails: bool
    time_s: float


def thruster_monitor(
    env: simpy.Environment,
    bus: DiagnosticsBus,
    faults: Sequence[ThrusterFault],
    set_health: Callable[[int, float], None],
    *,
    phase_s: float,
    period_s: float = 1.0,
    after_previous: bool,
) -> Process:
    """Bring about the scheduled faults, and publish them.

    Once a period the monitor looks at the first fault of the list that has not happened yet: so several that are due
    come one period apart, in list order, and a later one waits for the one before it.

    Args:
        env: the mission's clock.
        bus: where to publish.
        faults: the schedule, in list order.
        set_health: called with a thruster's number and 0 (lost) or 1 (works).
        phase_s: time of the monitor's first look.
        period_s: time between looks.
        after_previous: whether each time counts from the fault before it (rev 2023) or from the start (rev 1.5).
    """
    counted_from, earliest = 0.0, 0.0
    for fault in faults:
        due = counted_from + fault.time_s
        tick = tick_at_or_after(max(due, earliest), phase_s, period_s)
        yield until(env, tick)
        set_health(fault.thruster, 0.0 if fault.fails else 1.0)
        status = FAILED if fault.fails else RECOVERED
        bus.publish(Diagnostic(env.now, Kind.COMPONENT_STATUS, thruster_name(fault.thruster), status))
        earliest = tick + period_s
        if after_previous:
            counted_from = tick


def thruster_name(thruster: int) -> str:
    """Name of a thruster in diagnostics and in the knowledge base."""
    return f"c_thruster_{thruster}"


def battery_monitor(
    env: simpy.Environment,
    bus: DiagnosticsBus,
    is_at_station: Callable[[], bool],
    *,
    discharge_time_s: float,
    period_s: float,
    phase_s: float,
) -> Process:
    """Publish the battery's level, which falls linearly from 1 and is back at 1 at once at the recharge station."""
    full_at = 0.0
    yield until(env, phase_s)
    while True:
        if is_at_station():
            full_at = env.now
        level = max(0.0, 1.0 - (env.now - full_at) / discharge_time_s)
        bus.publish(Diagnostic(env.now, Kind.QA_STATUS, "battery_level", level))
        yield env.timeout(period_s)
