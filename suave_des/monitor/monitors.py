"""The monitors of a mission: what they measure, and processes that publish what somebody subscribes
to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from math import ceil

import simpy

from suave_des.clock import Process, exactly_at, until
from suave_des.draws import Draws
from suave_des.monitor.diagnostics import HULL, LEAK, Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.measurements import BatteryMeasurements, Measurements, Timing, message_loss
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import (
    ConstantSignal,
    Scenario,
    SinusoidSignal,
    StepSignal,
    TableSignal,
)
from suave_des.vehicle.model import Pose
from suave_des.world import signals
from suave_des.world.signals import Signal


def measure_signals(
    loaded: LoadedScenario, draws: Draws, duration_s: float
) -> Iterator[Measurements]:
    """Measure the signals of a scenario in a run, in the order of their names."""
    scenario = loaded.scenario
    for name in sorted(scenario.signals):
        described, key = scenario.signals[name], f"signals.{name}"
        signal: Signal
        match described:
            case SinusoidSignal():
                shift_s = draws.value(f"{key}.shift_s", described.shift_s)
                signal = signals.sinusoid(
                    described.period_s, described.minimum, described.maximum, shift_s
                )
            case ConstantSignal():
                signal = signals.constant(draws.value(f"{key}.value", described.value))
            case StepSignal():
                time_s = draws.value(f"{key}.time_s", described.time_s)
                signal = signals.step(time_s, described.before, described.after)
            case TableSignal():
                signal = signals.table(
                    *loaded.tables[name], linear=described.interpolation == "linear"
                )
        period_s = (
            described.publishing_period_s
            or scenario.revision.monitors.visibility_publishing_period_s
        )
        timing = Timing.of(scenario, draws, key, period_s)
        noise = None if described.noise == 0.0 else draws.each_time(f"{key}.noise", described.noise)
        lost = message_loss(key, described, draws)
        yield Measurements.of(name, signal, duration_s, timing, described.time_step_s, noise, lost)


def measure_battery(
    scenario: Scenario, draws: Draws, duration_s: float
) -> BatteryMeasurements | None:
    """Make the measurements of the battery's level in a run; None without a battery."""
    battery = scenario.battery
    if battery is None:
        return None
    timing = Timing.of(scenario, draws, "battery_monitor", battery.publishing_period_s)
    noise = None if battery.noise == 0.0 else draws.each_time("battery.noise", battery.noise)
    lost = message_loss("battery", battery, draws)
    return BatteryMeasurements(battery.discharge_time_s, timing, duration_s, noise, lost)


def start_monitors(
    env: simpy.Environment,
    bus: DiagnosticsBus,
    measurements: Iterable[Measurements],
    states: dict[tuple[Kind, str], Callable[[], Pose | float]],
    detected: simpy.Event,
) -> None:
    """Start the monitors of what has subscribers, and the others when they have one.

    Args:
        env, bus: when and where they publish.
        measurements: of quality attributes; for lookups they need no monitor.
        states: what is published once a second, by kind and key.
        detected: the event of the pipeline's first sight; its value is the index of the point seen.
    """
    monitors = [(Kind.QA_STATUS, each.publish(env, bus)) for each in measurements]
    monitors += [
        (kind, _each_second(env, bus, kind, key, state)) for (kind, key), state in states.items()
    ]
    for kind, monitor in [*monitors, (Kind.DETECTION, _detection(env, bus, detected))]:
        bus.when_subscribed(kind, partial(env.process, monitor))


def leak_monitor(
    env: simpy.Environment, bus: DiagnosticsBus, time_s: float, leak: Callable[[], None]
) -> Process:
    """Publish the leak at its time, and call `leak`."""
    yield until(env, time_s)
    bus.publish(Diagnostic(env.now, Kind.COMPONENT_STATUS, HULL, LEAK))
    leak()


def _detection(env: simpy.Environment, bus: DiagnosticsBus, detected: simpy.Event) -> Process:
    if not detected.processed:
        point = yield detected
        bus.publish(Diagnostic(env.now, Kind.DETECTION, "pipeline", float(point)))


def _each_second(
    env: simpy.Environment,
    bus: DiagnosticsBus,
    kind: Kind,
    key: str,
    state: Callable[[], Pose | float],
) -> Process:
    if env.now != (second := ceil(env.now)):
        yield exactly_at(env, float(second))
    while True:
        bus.publish(Diagnostic(env.now, kind, key, state()))
        yield env.timeout(1.0)
