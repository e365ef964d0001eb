"""Monitors: what they publish on the diagnostics bus, and when."""

import itertools
import math
from bisect import bisect_left, bisect_right
from types import SimpleNamespace

import numpy as np
import pytest
import simpy
from hypothesis import given
from hypothesis import strategies as st

from suave_des.clock import call_at
from suave_des.draws import Draws, Streams
from suave_des.events import Said
from suave_des.monitor.diagnostics import Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.measurements import (
    BatteryMeasurements,
    Measurements,
    Timing,
    message_loss,
)
from suave_des.monitor.monitors import start_monitors
from suave_des.monitor.thrusters import Thrusters, failure_loss, thruster_monitor
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import Monitor, ThrusterEvent, ThrusterFailureRevision
from suave_des.world.signals import constant, sinusoid, step

VISIBILITY = sinusoid(80.0, 1.25, 3.75)


class Subscriber:
    """A bus that keeps what is published."""

    def __init__(self) -> None:
        self.env = simpy.Environment()
        self.bus = DiagnosticsBus()
        self.received: list[Diagnostic] = []
        self.bus.subscribe(self.received.append)

    def values(self) -> list[tuple[float, str, object]]:
        return [(round(each.time_s, 6), each.key, each.value) for each in self.received]


@pytest.fixture
def subscriber() -> Subscriber:
    return Subscriber()


# Signals


@pytest.mark.parametrize(
    ("signal", "until_s", "timing", "time_step_s", "times_s"),
    [
        (lambda t: t, 3.0, Timing(0.8, 0.3), 0.0, (0.3, 1.1, 1.9, 2.7)),  # on the monitor's grid
        (VISIBILITY, 3.0, Timing(0.2, 0.1), 1.0, (0.1, 1.1, 2.1)),  # changed values only
        (
            step(10.05, 3.0, 1.0),
            20.0,
            Timing(0.2, 0.0),
            0.0,
            (0.0, 10.2),
        ),  # at the first message after the step
        (constant(2.0), 100.0, Timing(0.2, 0.05), 0.0, (0.05,)),
    ],
)
def test_when_messages_have_a_new_value(signal, until_s, timing, time_step_s, times_s):
    assert Measurements.of("v", signal, until_s, timing, time_step_s).times_s == pytest.approx(
        times_s
    )


def test_monitors_in_step_publish_just_after_each_period():
    scenario = load_scenario("planta_exp1").scenario
    assert Timing.of(scenario, Draws(scenario, 1, 1, {}, {}), "v", 0.2) == (
        0.2,
        pytest.approx(0.21),
    )


def test_other_monitors_have_another_phase_in_each_run():
    scenario = load_scenario("release15").scenario
    phases = [
        Timing.of(scenario, Draws(scenario, 1, run, {}, {}), "v", 2.0).phase_s for run in range(200)
    ]
    assert 0.0 <= min(phases) < 0.1 and 1.9 < max(phases) < 2.0


def test_a_message_has_the_value_of_its_whole_second():
    measured = Measurements.of("v", VISIBILITY, 30.0, Timing(1.0, 0.7), 1.0)
    assert measured.values == [VISIBILITY(float(t)) for t in range(30)]


def test_a_signal_is_read_at_multiples_of_its_time_step():
    measured = Measurements.of("v", lambda t_s: t_s, 6.0, Timing(1.0, 0.7), 2.5)
    assert (measured.times_s, measured.values) == (pytest.approx([0.7, 2.7, 5.7]), [0.0, 2.5, 5.0])


def test_rounding_errors_of_a_timer_do_not_shift_a_step():
    assert 0.1 + 3 * 0.3 < 1.0  # by a rounding error
    measured = Measurements.of("v", lambda t_s: t_s, 1.9, Timing(0.3, 0.1), 1.0)
    assert (measured.times_s, measured.values) == ([0.1, pytest.approx(1.0)], [0.0, 1.0])


def measurements(values: tuple[float, ...]) -> Measurements:
    """Values at 1, 2, 3, ... s."""
    times_s = [float(n) for n in range(1, len(values) + 1)]
    arrays = np.array(times_s), np.array(values)
    return Measurements("v", constant(0.0), Timing(1.0, 1.0), times_s, list(values), arrays)


@pytest.mark.parametrize(
    ("thresholds", "crossing_s"),
    [
        ((2.5, 3.5), 4.0),
        ((2.0, 3.5), 5.0),
        ((2.5, 3.0), 3.0),
        ((3.0,), 3.0),
        ((2.7,), 3.0),
        ((2.8, 2.9), 3.0),
        ((1.0,), 5.0),
        ((-1.0, 9.0), math.inf),
        ((), math.inf),
    ],
)
def test_a_value_crosses_a_threshold_when_it_is_on_it_or_beyond(thresholds, crossing_s):
    assert measurements((9.0, 2.7, 3.0, 2.4, 1.0)).region_until(2.0, thresholds)[1] == crossing_s


LEVELS = st.sampled_from([0.5, 1.0, 1.5, 2.0]) | st.floats(0.0, 3.0)


@given(
    values=st.lists(LEVELS, min_size=1, max_size=12),
    thresholds=st.lists(LEVELS, max_size=4, unique=True).map(lambda found: tuple(sorted(found))),
    t_s=st.floats(0.0, 14.0) | st.integers(0, 14).map(float),
)
def test_crossings_are_those_found_by_going_through_all_values(values, thresholds, t_s):
    measured = measurements(tuple(values))
    regions = [bisect_left(thresholds, value) + bisect_right(thresholds, value) for value in values]
    pairs = enumerate(itertools.pairwise([-1, *regions]), start=1)
    crossings = [(float(n), region) for n, (before, region) in pairs if region != before]
    assert measured.crossings(thresholds) == tuple(map(list, zip(*crossings, strict=True)))
    passed = int(min(t_s, len(values)))
    region, until_s = (
        regions[passed - 1] if passed else -1,
        next((s for s, _ in crossings if s > t_s), math.inf),
    )
    assert measured.region_until(t_s, thresholds) == (region, until_s)


def test_noise_makes_every_measurement_another_one():
    errors = itertools.count(1)
    measured = Measurements.of(
        "v", constant(2.0), 1.0, Timing(0.25, 0.0), 1.0, noise=lambda: next(errors)
    )
    assert measured.values == [3.0, 4.0, 5.0, 6.0, 7.0]


def test_a_lost_message_is_not_the_next_one():
    measured = Measurements.of(
        "v", constant(2.0), 5.0, Timing(1.0, 0.2), is_lost=lambda t_s: 1.0 < t_s < 3.0
    )
    assert [measured.next_message_s(t_s) for t_s in (0.2, 0.3, 3.2, 4.3)] == pytest.approx(
        [0.2, 3.2, 3.2, math.inf]
    )


def lost(probability: float, *outages_s: tuple[float, float]) -> list[bool]:
    """Which of the messages at 0, 1, 2, ... s are lost in a run."""
    monitor = Monitor(dropout_probability=probability, outages_s=outages_s)
    is_lost = message_loss("signals.v", monitor, Streams(1, 1))
    return [is_lost(float(t_s)) for t_s in range(2000)]


def test_no_loss_is_no_question():
    assert message_loss("signals.v", Monitor(), Streams(1, 1)) is None


@pytest.mark.parametrize("probability", [0.1, 0.7])
def test_messages_are_lost_with_their_probability(probability):
    # Four standard deviations of a share of 2000: 0.041 and less.
    assert sum(lost(probability)) / 2000 == pytest.approx(probability, abs=0.041)


def test_an_outage_loses_the_messages_from_its_begin_to_its_end():
    missing = [t_s for t_s, is_lost in enumerate(lost(0.0, (60.0, 62.0), (80.0, 80.5))) if is_lost]
    assert missing == [60, 61, 62, 80]


def test_an_outage_changes_no_other_message():
    during = range(100, 201)
    chance, both = lost(0.3), lost(0.3, (100.0, 200.0))
    assert [both[t_s] for t_s in during] == [True] * 101
    assert [is_lost for t_s, is_lost in enumerate(both) if t_s not in during] == [
        is_lost for t_s, is_lost in enumerate(chance) if t_s not in during
    ]


def test_signal_monitor_publishes_measurements_at_their_times(subscriber):
    measured = Measurements.of("current", step(1.0, 0.1, 0.4), 5.0, Timing(0.5, 0.2))
    subscriber.env.process(measured.publish(subscriber.env, subscriber.bus))
    subscriber.env.run()
    assert subscriber.received == [
        Diagnostic(0.2, Kind.QA_STATUS, "current", 0.1),
        Diagnostic(1.2, Kind.QA_STATUS, "current", 0.4),
    ]


# Thrusters


class NotedVehicle:
    """Keeps the state of each thruster."""

    def __init__(self) -> None:
        self.thrusters = ["works"] * 6

    def set_thruster(self, t_s: float, number: int, state: str) -> None:
        self.thrusters[number - 1] = state


def noted_thrusters(effective_from_s: float = 0.0, logged: list | None = None) -> Thrusters:
    """Thrusters of a vehicle that notes their states."""
    revision = ThrusterFailureRevision(effective_from_s=effective_from_s)
    log = [] if logged is None else logged
    return Thrusters(
        simpy.Environment(), NotedVehicle(), revision, lambda *event: log.append(event)
    )


@pytest.mark.parametrize(("recoverable", "after"), [(True, "works"), (False, "frozen")])
def test_only_a_failure_that_is_recoverable_is_recovered(recoverable, after):
    thrusters = noted_thrusters()
    thrusters.apply(ThrusterEvent(thruster=2, event="failure", time_s=0.0, recoverable=recoverable))
    assert thrusters.vehicle.thrusters[1] == "frozen"
    assert thrusters.recover(2) == recoverable
    assert thrusters.vehicle.thrusters == ["works", after, *["works"] * 4]


def test_a_recovery_by_itself_ends_even_a_failure_that_is_not_recoverable():
    thrusters = noted_thrusters()
    failure = ThrusterEvent(thruster=2, event="failure", time_s=0.0, recoverable=False)
    thrusters.apply(failure)
    thrusters.apply(ThrusterEvent(thruster=2, event="recovery", time_s=0.0, recoverable=False))
    assert thrusters.working == [(0.0, 5), (0.0, 6)]
    thrusters.apply(failure.model_copy(update={"recoverable": True, "failure_mode": "dead"}))
    assert thrusters.vehicle.thrusters[1] == "dead" and thrusters.recover(2)


@pytest.mark.parametrize(("effective_from_s", "state"), [(0.0, "frozen"), (0.1, "works")])
def test_a_failure_has_no_effect_before_the_revisions_time(effective_from_s, state):
    logged = list[tuple[str, Said]]()
    thrusters = noted_thrusters(effective_from_s, logged)
    thrusters.apply(ThrusterEvent(thruster=6, event="failure", time_s=0.0))
    assert thrusters.vehicle.thrusters[5] == state
    without_effect = [("thruster_monitor", Said("failure_without_effect", "c_thruster_6"))]
    assert logged == (without_effect if state == "works" else [])


class FixedDraws:
    """Draws whose streams give what they are told."""

    def __init__(self, *numbers: float) -> None:
        self.numbers = iter(numbers)

    def stream(self, name: str) -> "FixedDraws":
        return self

    def random(self) -> float:
        return next(self.numbers)


def test_a_failure_is_lost_with_its_probability():
    is_lost = failure_loss(ThrusterFailureRevision(loss_probability=0.13), FixedDraws(0.12, 0.13))
    assert [is_lost(), is_lost()] == [True, False]


def test_a_lost_failure_leaves_the_thruster_at_work():
    thrusters = noted_thrusters()
    thrusters.is_lost = iter([True, False]).__next__
    failure = ThrusterEvent(thruster=6, event="failure", time_s=0.0)
    thrusters.apply(failure)
    assert thrusters.vehicle.thrusters[5] == "works"
    thrusters.apply(failure)
    assert thrusters.vehicle.thrusters[5] == "frozen"


def event(thruster: int, happens: str, time_s: float) -> tuple[ThrusterEvent, float]:
    return ThrusterEvent(thruster=thruster, event=happens, time_s=0.0), time_s


def publish_events(
    subscriber: Subscriber,
    *schedule: tuple[ThrusterEvent, float],
    after_previous: bool,
    phase_s: float = 0.25,
) -> list:
    """Run a schedule to its end; the events, with the times at which they happened."""
    happened: list[tuple[float, ThrusterEvent]] = []
    env = subscriber.env
    thrusters = SimpleNamespace(env=env, apply=lambda event: happened.append((env.now, event)))
    env.process(
        thruster_monitor(thrusters, subscriber.bus, schedule, Timing(1.0, phase_s), after_previous)
    )
    env.run()
    return happened


BOTH = pytest.mark.parametrize("after_previous", [True, False], ids=["2023", "1.5"])


FAILED_AND_RECOVERED = event(3, "failure", 5.0), event(3, "recovery", 60.0)


@BOTH
def test_events_of_thrusters_happen_when_they_are_published(subscriber, after_previous):
    happened = publish_events(subscriber, *FAILED_AND_RECOVERED, after_previous=after_previous)
    assert happened == [
        (report.time_s, happening[0])
        for report, happening in zip(subscriber.received, FAILED_AND_RECOVERED, strict=True)
    ]


@BOTH
def test_a_failure_is_published_at_the_monitors_next_time(subscriber, after_previous):
    publish_events(subscriber, *FAILED_AND_RECOVERED, after_previous=after_previous)
    report = Diagnostic(5.25, Kind.COMPONENT_STATUS, "c_thruster_3", "FALSE")
    assert subscriber.received[0] == report


@BOTH
def test_a_recovery_is_published_as_such(subscriber, after_previous):
    publish_events(subscriber, *FAILED_AND_RECOVERED, after_previous=after_previous)
    assert subscriber.received[1].value == "RECOVERED"


@pytest.mark.parametrize(
    ("after_previous", "times_s", "published_s"),
    [
        (True, (35.0,), (35.25,)),  # at the first look after its time
        (False, (35.0,), (35.25,)),
        (True, (10.0, 30.0), (10.25, 40.25)),
        (False, (10.0, 30.0), (10.25, 30.25)),
        # Due at 10 s, the first happened at 10.25 s: 30.1 s later is past the look at 40.25 s.
        (True, (10.0, 30.1), (10.25, 41.25)),
        (False, (5.0, 5.0, 5.0), (5.25, 6.25, 7.25)),  # several due come one a second
        (False, (20.0, 5.0), (20.25, 21.25)),  # one waits for the one before it in the list
        (True, (-50.0,), (0.25,)),
        (False, (-50.0,), (0.25,)),
        (True, (10.0, -5.0), (10.25, 11.25)),
    ],
)
def test_when_events_happen_one_after_the_other_in_the_order_of_the_list(
    subscriber, after_previous, times_s, published_s
):
    events = [
        event(thruster, "failure", time_s)
        for thruster, time_s in zip((4, 2, 6), times_s, strict=False)
    ]
    publish_events(subscriber, *events, after_previous=after_previous)
    keys = ("c_thruster_4", "c_thruster_2", "c_thruster_6")
    assert subscriber.values() == [
        (t_s, key, "FALSE") for t_s, key in zip(published_s, keys, strict=False)
    ]


# Battery


def battery(*recharged_s: float) -> BatteryMeasurements:
    level = BatteryMeasurements(200.0, Timing(1.0, 0.5), 1000.0)
    for t_s in recharged_s:
        level.recharge(t_s)
    return level


def battery_levels(
    subscriber: Subscriber, until_s: float, *recharged_s: float
) -> list[tuple[float, float]]:
    level = battery()
    subscriber.env.process(level.publish(subscriber.env, subscriber.bus))
    for t_s in recharged_s:
        subscriber.env.timeout(t_s).callbacks.append(lambda _: level.recharge(subscriber.env.now))
    subscriber.env.run(until=until_s)
    return [(each.time_s, each.value) for each in subscriber.received]


def test_battery_falls_by_a_two_hundredth_a_second(subscriber):
    levels = battery_levels(subscriber, 151.0)
    assert levels[:2] == [(0.5, 0.995), (1.5, 0.99)]
    assert levels[-1] == (150.5, pytest.approx(0.245))


def test_the_battery_monitor_counts_with_the_rounding_errors_of_the_exemplars():
    """After 150 of 200 subtractions in double precision, the level is just below a quarter."""
    level = BatteryMeasurements(200.0, Timing(1.0, 1.01), 200.0)
    assert level.value(150.01) == 0.24999999999999933


def test_the_true_level_falls_to_zero():
    level = BatteryMeasurements(200.0, Timing(1.0, 0.5), 500.0)
    assert [level.level(t_s) for t_s in (0.0, 50.0, 200.0, 300.0)] == [1.0, 0.75, 0.0, 0.0]


def test_it_falls_anew_from_a_recharge():
    level = BatteryMeasurements(200.0, Timing(1.0, 0.5), 500.0)
    level.recharge(300.0)
    assert level.level(350.0) == 0.75


def test_a_level_is_measured_until_the_end_of_the_mission():
    assert BatteryMeasurements(200.0, Timing(1.0, 0.5), 3.5).times_s == [0.5, 1.5, 2.5, 3.5]


def test_a_recharged_battery_says_at_once_that_it_is_full(subscriber):
    levels = dict(battery_levels(subscriber, 200.0, 160.7))
    assert (levels[160.5], levels[160.7], levels[161.5]) == pytest.approx((0.195, 1.0, 0.995))


def test_a_recharge_at_the_time_of_a_measurement_adds_one():
    level = BatteryMeasurements(200.0, Timing(1.0, 0.5), 4.0)
    level.recharge(2.5)
    assert level.times_s == [0.5, 1.5, 2.5, 2.5, 3.5]
    assert level.values == pytest.approx([0.995, 0.99, 0.985, 1.0, 0.995])


def test_a_level_looked_up_is_the_one_published_last(subscriber):
    received = battery_levels(subscriber, 200.0, 160.7)
    level = battery()
    assert [level.count_until(t_s) for t_s in (0.4, 30.5, 150.4)] == [0, 31, 150]
    level.recharge(160.7)
    assert level.count_until(160.7) == 162 and level.values[161] == 1.0 and level.recharges == 1
    published = level.count_until(199.9)
    assert list(zip(level.times_s[:published], level.values[:published], strict=True)) == received


def test_recharging_changes_what_a_level_crosses_afterwards():
    level = battery()
    regions_until = [level.region_until(t_s, (0.25,)) for t_s in (0.4, 148.9, 149.5)]
    assert regions_until == [(-1, 0.5), (2, 149.5), (0, math.inf)]
    level.recharge(130.5)
    assert level.region_until(130.5, (0.25, 1.0))[0] == 3
    assert level.region_until(131.0, (0.25,))[1] == 280.5


@given(
    st.lists(st.sampled_from((-1.0, 0.0, 0.245, 0.25, 0.5, 0.995, 1.0, 1.25)), unique=True).map(
        sorted
    ),
    st.lists(st.integers(0, 250).map(lambda message: message + 0.5), min_size=1, max_size=4).map(
        sorted
    ),
    st.sampled_from((0.2, 1.2, 2.0, 40.0, 149.9, 152.0)),
)
def test_no_level_is_in_another_region_before_the_next_crossing(thresholds, recharged_s, later_s):
    edges, plain, t_s = tuple(thresholds), battery(*recharged_s), recharged_s[-1] + later_s
    region, until_s = battery(*recharged_s).region_until(t_s, edges)
    messages = [message + 0.5 for message in range(500) if t_s < message + 0.5 < until_s]
    assert all(plain.region_until(message, edges)[0] == region for message in messages)


# The bus


def test_subscribers_get_the_kinds_that_they_subscribe_to(subscriber):
    statuses: list[tuple[str, int]] = []  # with how many the earlier subscriber has got by then
    subscriber.bus.subscribe(
        lambda it: statuses.append((it.key, len(subscriber.received))), [Kind.COMPONENT_STATUS]
    )
    subscriber.bus.publish(Diagnostic(0.0, Kind.QA_STATUS, "v", 1.0))
    subscriber.bus.publish(Diagnostic(0.0, Kind.COMPONENT_STATUS, "c_thruster_1", "FALSE"))
    assert statuses == [("c_thruster_1", 2)]


@pytest.mark.parametrize(
    ("t_s", "first"), [(0.0, ["pose", "v", "pose", "v", "pose", "v"]), (2.5, []), (3.0, [])]
)
def test_a_monitor_starts_when_somebody_subscribes(t_s, first):
    """So its messages do not depend on whether somebody else has subscribed, such as the
    recorder.
    """
    env, bus, received = simpy.Environment(), DiagnosticsBus(), []
    measured = Measurements.of("v", lambda t_s: t_s, 5.0, Timing(1.0, 0.2))
    start_monitors(env, bus, [measured], {(Kind.POSE, "pose"): lambda: 0.0}, env.timeout(3.3, 7))
    for _ in "ab":
        call_at(env, t_s, lambda: bus.subscribe(received.append, tuple(Kind)))
    env.run(until=4.1)
    assert [each.key for each in received[::2]] == [*first, "pose", "v", "pipeline", "pose"]
    call_at(env, 4.1, lambda: bus.subscribe(received.append, tuple(Kind)))
    env.run(until=5.1)
    assert [(each.time_s, each.key) for each in received[-6:]] == [(4.2, "v")] * 3 + [
        (5.0, "pose")
    ] * 3
