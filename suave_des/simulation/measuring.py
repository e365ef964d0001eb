"""The measurements of a mission's monitors, as the scenario describes them."""

from suave_des.chance import Chance
from suave_des.monitor.measurements import BatteryLevel, Measurements, MonitorTiming, measure
from suave_des.scenario.models import Scenario
from suave_des.vehicle.vehicle import Vehicle
from suave_des.world.signals import Signal

_DELIVERY_S = 0.01
"""Delay from a timer's tick to the arrival of its message; a simultaneous tick of another timer misses it."""


def monitor_timing(
    scenario: Scenario, chance: Chance, monitor: str, period_s: float, time_step_s: float = 0.0
) -> MonitorTiming:
    """Find the times at which a monitor measures in a run: in step with the other timers, or with a random phase."""
    in_step = "monitors" in scenario.revision.timers_in_step
    return MonitorTiming(period_s, period_s + _DELIVERY_S if in_step else chance.phase(monitor, period_s), time_step_s)


def measure_signal(scenario: Scenario, chance: Chance, name: str, signal: Signal, duration_s: float) -> Measurements:
    """Measure one of the scenario's signals over a whole mission.

    Args:
        scenario: describes the signal and its monitor.
        chance: of the run.
        name: of the quality attribute.
        signal: its true value over mission time.
        duration_s: of the mission.
    """
    described, key = scenario.signals[name], f"signals.{name}"
    period_s = described.publishing_period_s or scenario.revision.monitors.visibility_publishing_period_s
    timing = monitor_timing(scenario, chance, key, period_s, described.time_step_s)
    noise = chance.sampler(f"{key}.noise", described.noise) if described.noise != 0.0 else None
    return measure(name, signal, duration_s, timing, noise, chance.loss(key, described))


def measure_battery(scenario: Scenario, chance: Chance, vehicle: Vehicle) -> BatteryLevel | None:
    """Make the measurements of the battery's level; None without a battery."""
    battery = scenario.battery
    if battery is None:
        return None

    def is_at_station(t_s: float) -> bool:
        x_m, y_m, _ = vehicle.position(t_s)
        return max(abs(x_m - battery.station_x_m), abs(y_m - battery.station_y_m)) <= battery.station_radius_m

    timing = monitor_timing(scenario, chance, "battery_monitor", battery.publishing_period_s)
    noise = chance.sampler("battery.noise", battery.noise) if battery.noise != 0.0 else None
    return BatteryLevel(is_at_station, battery.discharge_time_s, timing, noise, chance.loss("battery", battery))
