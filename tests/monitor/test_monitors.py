"""Monitors: what they publish on the diagnostics bus, and when."""

import itertools
import math

import numpy as np
import pytest
import simpy

from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.measurements import BatteryLevel, Measurements
from suave_des.monitor.measuring import measure
from suave_des.monitor.monitors import ThrusterFault, battery_monitor, signal_monitor, thruster_monitor
from suave_des.world.signals import constant, sinusoid, step

VISIBILITY = sinusoid(80.0, 1.25, 3.75)


class Listener:
    """A bus that keeps what is published."""

    def __init__(self) -> None:
        self.env = simpy.Environment()
        self.bus = DiagnosticsBus()
        self.heard: list[Diagnostic] = []
        self.bus.subscribe(self.heard.append)

    def values(self) -> list[tuple[float, str, object]]:
        return [(round(each.time_s, 6), each.key, each.value) for each in self.heard]


@pytest.fixture
def listener() -> Listener:
    return Listener()


# Signals


def test_messages_lie_on_the_monitors_grid() -> None:
    measured = measure("v", lambda t: t, 3.0, period_s=0.8, phase_s=0.3)
    assert measured.times_s == pytest.approx((0.3, 1.1, 1.9, 2.7))


def test_only_changed_values_are_published() -> None:
    measured = measure("v", VISIBILITY, 3.0, period_s=0.2, phase_s=0.1, time_step_s=1.0)
    assert measured.times_s == pytest.approx((0.1, 1.1, 2.1))


def test_a_message_has_the_value_of_its_whole_second() -> None:
    measured = measure("v", VISIBILITY, 30.0, period_s=1.0, phase_s=0.7, time_step_s=1.0)
    assert measured.values == tuple(sinusoid(80.0, 1.25, 3.75)(float(t)) for t in range(30))


def test_rounding_errors_of_a_timer_do_not_shift_a_step() -> None:
    assert 0.1 + 3 * 0.3 < 1.0  # by a rounding error
    measured = measure("v", lambda t_s: t_s, 1.9, period_s=0.3, phase_s=0.1, time_step_s=1.0)
    assert (measured.times_s, measured.values) == ((0.1, pytest.approx(1.0)), (0.0, 1.0))


@pytest.mark.parametrize(
    ("above", "below", "leaves_s"),
    [(2.5, 3.5, 4.0), (2.0, 3.5, 5.0), (2.5, 4.0, 4.0), (2.5, 3.0, 3.0), (-1.0, 9.0, math.inf)],
)
def test_a_value_leaves_its_bounds_when_it_is_on_one_or_beyond(above: float, below: float, leaves_s: float) -> None:
    times_s, values = (1.0, 2.0, 3.0, 4.0, 5.0), (9.0, 2.7, 3.0, 2.4, 1.0)
    measured = Measurements("v", times_s, values, 1.0, 1.0, (np.array(times_s), np.array(values)))
    assert measured.leaves_at_s(2.0, above, below) == leaves_s


@pytest.mark.parametrize(
    ("bounds", "leaves_s"),
    [
        ((2.5, 2.6, 2.6, 9.0), 4.0),
        ((2.0, 3.0, 3.0, 4.0), 3.0),
        ((0.5, 2.0, 2.3, 2.5, 2.9, 4.0), math.inf),
        ((0.5, 1.0, 2.3, 2.5, 2.9, 4.0), 5.0),
        ((), 3.0),
        ((math.inf, -math.inf), 3.0),
    ],
)
def test_a_value_may_be_in_any_of_several_pairs_of_bounds(bounds: tuple[float, ...], leaves_s: float) -> None:
    times_s, values = (1.0, 2.0, 3.0, 4.0, 5.0), (9.0, 2.7, 3.0, 2.4, 1.0)
    measured = Measurements("v", times_s, values, 1.0, 1.0, (np.array(times_s), np.array(values)))
    assert measured.leaves_at_s(2.0, *bounds) == leaves_s


def test_a_constant_is_published_once() -> None:
    measured = measure("v", constant(2.0), 100.0, period_s=0.2, phase_s=0.05)
    assert (measured.times_s, measured.values) == ((0.05,), (2.0,))


def test_a_step_is_published_at_the_first_message_after_it() -> None:
    measured = measure("v", step(10.05, 3.0, 1.0), 20.0, period_s=0.2, phase_s=0.0)
    assert measured.times_s == pytest.approx((0.0, 10.2))


def test_noise_makes_every_measurement_another_one() -> None:
    errors = itertools.count(1)
    measured = measure("v", constant(2.0), 1.0, period_s=0.25, phase_s=0.0, time_step_s=1.0, noise=lambda: next(errors))
    assert measured.values == (3.0, 4.0, 5.0, 6.0, 7.0)


@pytest.mark.parametrize(("t_s", "expected_s"), [(0.0, 0.3), (0.3, 0.3), (0.31, 1.3), (7.0, 7.3)])
def test_next_message_comes_changed_or_not(t_s: float, expected_s: float) -> None:
    measured = measure("v", constant(2.0), 10.0, period_s=1.0, phase_s=0.3)
    assert measured.next_message_s(t_s) == pytest.approx(expected_s)


def test_signal_monitor_publishes_measurements_at_their_times(listener: Listener) -> None:
    measured = measure("current", step(1.0, 0.1, 0.4), 5.0, period_s=0.5, phase_s=0.2)
    listener.env.process(signal_monitor(listener.env, listener.bus, measured))
    listener.env.run()
    assert listener.heard == [
        Diagnostic(0.2, Kind.QA_STATUS, "current", 0.1),
        Diagnostic(1.2, Kind.QA_STATUS, "current", 0.4),
    ]


# Thrusters


def publish_faults(listener: Listener, *faults: ThrusterFault, after_previous: bool, phase_s: float = 0.25) -> list:
    """Run a schedule to its end; the health set, with its times."""
    healths: list[tuple[float, int, float]] = []
    listener.env.process(
        thruster_monitor(
            listener.env,
            listener.bus,
            faults,
            lambda thruster, health: healths.append((listener.env.now, thruster, health)),
            phase_s=phase_s,
            after_previous=after_previous,
        )
    )
    listener.env.run()
    return healths


BOTH = pytest.mark.parametrize("after_previous", [True, False], ids=["2023", "1.5"])


@BOTH
def test_failure_is_seen_at_the_first_look_after_its_time(listener: Listener, after_previous: bool) -> None:
    publish_faults(listener, ThrusterFault(1, True, 35.0), after_previous=after_previous)
    assert listener.heard == [Diagnostic(35.25, Kind.COMPONENT_STATUS, "c_thruster_1", "FALSE")]


@BOTH
def test_failure_and_recovery_change_the_health_when_they_are_published(
    listener: Listener, after_previous: bool
) -> None:
    faults = ThrusterFault(3, True, 5.0), ThrusterFault(3, False, 60.0)
    healths = publish_faults(listener, *faults, after_previous=after_previous)
    assert [(time_s, thruster, health) for time_s, thruster, health in healths] == [
        (listener.heard[0].time_s, 3, 0.0),
        (listener.heard[1].time_s, 3, 1.0),
    ]


@BOTH
def test_recovery_is_published_as_recovered(listener: Listener, after_previous: bool) -> None:
    publish_faults(listener, ThrusterFault(6, False, 2.0), after_previous=after_previous)
    assert listener.values() == [(2.25, "c_thruster_6", "RECOVERED")]


@pytest.mark.parametrize(
    ("after_previous", "times_s"), [(True, [10.25, 40.25]), (False, [10.25, 30.25])], ids=["2023", "1.5"]
)
def test_what_the_time_of_a_second_event_counts_from(
    listener: Listener, after_previous: bool, times_s: list[float]
) -> None:
    publish_faults(listener, ThrusterFault(1, True, 10.0), ThrusterFault(2, True, 30.0), after_previous=after_previous)
    assert [each.time_s for each in listener.heard] == times_s


def test_in_2023_time_counts_from_when_the_event_before_happened(listener: Listener) -> None:
    # Due at 10 s, it happened at 10.25 s: 30.1 s later is past the look at 40.25 s.
    publish_faults(listener, ThrusterFault(1, True, 10.0), ThrusterFault(2, True, 30.1), after_previous=True)
    assert listener.heard[1].time_s == 41.25


def test_several_due_come_one_a_second_in_list_order(listener: Listener) -> None:
    faults = [ThrusterFault(thruster, True, 5.0) for thruster in (4, 2, 6)]
    publish_faults(listener, *faults, after_previous=False)
    assert listener.values() == [
        (5.25, "c_thruster_4", "FALSE"),
        (6.25, "c_thruster_2", "FALSE"),
        (7.25, "c_thruster_6", "FALSE"),
    ]


def test_an_earlier_event_waits_for_the_one_before_it_in_the_list(listener: Listener) -> None:
    publish_faults(listener, ThrusterFault(1, True, 20.0), ThrusterFault(2, True, 5.0), after_previous=False)
    assert listener.values() == [(20.25, "c_thruster_1", "FALSE"), (21.25, "c_thruster_2", "FALSE")]


@BOTH
def test_a_time_before_the_start_fires_at_the_first_look(listener: Listener, after_previous: bool) -> None:
    publish_faults(listener, ThrusterFault(1, True, -50.0), after_previous=after_previous, phase_s=0.6)
    assert listener.values() == [(0.6, "c_thruster_1", "FALSE")]


def test_a_negative_time_after_another_event_fires_at_the_next_look(listener: Listener) -> None:
    publish_faults(listener, ThrusterFault(1, True, 10.0), ThrusterFault(2, True, -5.0), after_previous=True)
    assert [each.time_s for each in listener.heard] == [10.25, 11.25]


# Battery


def battery(docked: set[float]) -> BatteryLevel:
    return BatteryLevel(lambda t_s: t_s in docked, discharge_time_s=200.0, period_s=1.0, phase_s=0.5)


def battery_levels(listener: Listener, until_s: float, docked: set[float]) -> list[tuple[float, float]]:
    listener.env.process(battery_monitor(listener.env, listener.bus, battery(docked)))
    listener.env.run(until=until_s)
    return [(each.time_s, each.value) for each in listener.heard]


def test_battery_falls_by_a_two_hundredth_a_second(listener: Listener) -> None:
    levels = battery_levels(listener, 151.0, docked=set())
    assert levels[:2] == [(0.5, 0.9975), (1.5, 0.9925)] and levels[-1] == (150.5, pytest.approx(0.2475))


def test_an_empty_battery_stays_empty(listener: Listener) -> None:
    assert battery_levels(listener, 300.0, docked=set())[-1][1] == 0.0


def test_battery_is_full_at_once_at_the_station(listener: Listener) -> None:
    levels = dict(battery_levels(listener, 200.0, docked={160.5}))
    assert (levels[159.5], levels[160.5], levels[161.5]) == pytest.approx((0.2025, 1.0, 0.995))


def test_a_level_looked_up_is_the_one_published_last(listener: Listener) -> None:
    heard = battery_levels(listener, 200.0, docked={160.5})
    level = battery({160.5})
    assert level.published(0.4) == 0
    assert level.published(160.7) == 161 and level.values[160] == 1.0
    assert level.published(199.9) == len(heard) and list(zip(level.times_s, level.values, strict=True)) == heard
    assert level.published(30.5) == 31  # of those known by now


# The bus


def test_subscribers_hear_the_kinds_that_they_want(listener: Listener) -> None:
    statuses: list[Diagnostic] = []
    assert not DiagnosticsBus().has_listeners(Kind.COMPONENT_STATUS)
    listener.bus.subscribe(statuses.append, (Kind.COMPONENT_STATUS,))
    listener.bus.publish(Diagnostic(0.0, Kind.QA_STATUS, "v", 1.0))
    listener.bus.publish(Diagnostic(0.0, Kind.COMPONENT_STATUS, "c_thruster_1", "FALSE"))
    assert [each.key for each in statuses] == ["c_thruster_1"] and len(listener.heard) == 2


def test_every_subscriber_hears_everything_in_order_of_subscription(listener: Listener) -> None:
    order: list[str] = []
    for name in "ab":
        listener.bus.subscribe(lambda _, name=name: order.append(name))
    listener.bus.publish(Diagnostic(0.0, Kind.QA_STATUS, "v", 1.0))
    assert order == ["a", "b"]
