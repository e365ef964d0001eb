"""Named random streams, and the clock's ticks."""

import math

import pytest
import simpy
from hypothesis import given
from hypothesis import strategies as st

from suave_des.clock import (
    Alarm,
    MissionEnvironment,
    call_at,
    call_next,
    exactly_at,
    tick_at_or_after,
    until,
)
from suave_des.draws import Streams

names = st.text(min_size=1, max_size=20)


def draws(streams: Streams, name: str) -> list[float]:
    stream = streams.stream(name)
    return [stream.random() for _ in range(5)]


@given(st.integers(0, 2**64), st.integers(0, 10**6), names)
def test_a_stream_repeats(seed, run, name):
    assert draws(Streams(seed, run), name) == draws(Streams(seed, run), name)


@given(names, st.lists(names, max_size=5))
def test_a_stream_does_not_depend_on_which_others_exist(name, others):
    streams = Streams(1, 1)
    for other in others:
        draws(streams, other)
    assert draws(streams, name) == draws(Streams(1, 1), name)


@pytest.mark.parametrize(
    ("seed", "run", "name"), [(2, 1, "a"), (1, 2, "a"), (1, 1, "b")], ids=["seed", "run", "name"]
)
def test_another_seed_run_or_name_is_another_stream(seed, run, name):
    assert draws(Streams(seed, run), name) != draws(Streams(1, 1), "a")


def test_streams_are_the_same_on_every_machine():
    assert draws(Streams(1, 1), "start.y_m")[0] == 0.6140368914426398


@pytest.mark.parametrize(
    ("t_s", "tick_s"),
    [(0.0, 0.3), (0.3, 0.3), (0.31, 1.3), (1.3, 1.3), (1.3 + 1e-12, 1.3), (7.2, 7.3), (-4.0, 0.3)],
)
def test_first_tick_not_before_a_time(t_s, tick_s):
    assert tick_at_or_after(t_s, 0.3, 1.0) == pytest.approx(tick_s)


@given(
    st.floats(0.0, 1000.0), st.floats(0.0, 10.0), st.sampled_from([0.1, 0.2, 0.5, 1.0, 2.0, 15.0])
)
def test_the_next_tick_is_within_a_period(t_s, phase_s, period_s):
    tick_s = tick_at_or_after(t_s, phase_s, period_s)
    assert -1e-6 <= tick_s - t_s <= max(period_s, phase_s - t_s) + 1e-6


def test_setting_an_alarm_anew_replaces_the_call_that_was_pending():
    env, called = simpy.Environment(), []
    alarm = Alarm(env, lambda: called.append(env.now))
    alarm.set(4.0)
    alarm.set(6.0)
    env.run()
    assert called == [6.0]


def test_an_alarm_at_a_time_that_has_passed_rings_now():
    env, called = simpy.Environment(), []
    alarm = Alarm(env, lambda: called.append(env.now))
    call_at(env, 5.0, lambda: alarm.set(2.0))
    call_at(env, 6.0, lambda: called.append(env.now))
    env.run()
    assert called == [5.0, 6.0]


def test_an_alarm_that_has_rung_rings_each_time_that_it_is_set_again():
    env, called = simpy.Environment(), []

    def ring() -> None:
        called.append(env.now)
        if env.now < 3.0:
            alarm.set(9.0)
            alarm.set(env.now + 1.0)

    alarm = Alarm(env, ring)
    alarm.set(1.0)
    env.run()
    assert called == [1.0, 2.0, 3.0]


def test_nothing_is_flown_for_an_event_that_never_comes():
    env, flown = MissionEnvironment(), []
    env.fly_to = flown.append
    env.timeout(4.0)
    env.timeout(math.inf)
    env.step()
    env.step()
    assert flown == [4.0]


def test_a_cancelled_alarm_does_not_ring():
    env, called = simpy.Environment(), []
    alarm = Alarm(env, lambda: called.append(env.now))
    alarm.set(4.0)
    alarm.cancel()
    env.run()
    assert called == []


def test_a_call_next_comes_before_all_else_of_its_time_but_not_at_once():
    env, called = simpy.Environment(), []

    def first() -> None:
        call_next(env, lambda: called.append((env.now, "next")))
        called.append((env.now, "first"))

    Alarm(env, first).set(4.0)
    Alarm(env, lambda: called.append((env.now, "second"))).set(4.0)
    env.run()
    assert called == [(4.0, "first"), (4.0, "next"), (4.0, "second")]


NAN = float("nan")


@pytest.mark.parametrize(
    "schedule",
    [
        lambda env: env.timeout(NAN),
        lambda env: env.schedule(env.event(), delay=NAN),
        lambda env: exactly_at(env, NAN),
        lambda env: until(env, NAN),
        lambda env: Alarm(env, list).set(NAN),
    ],
    ids=["timeout", "schedule", "exactly_at", "until", "alarm"],
)
def test_a_time_that_is_not_a_number_is_refused_where_it_is_given(schedule):
    env = MissionEnvironment()
    with pytest.raises(ValueError, match="is nan"):
        schedule(env)
    assert env.peek() == math.inf


def test_the_environment_flies_to_each_event_before_it_is_processed():
    env, happened = MissionEnvironment(), []
    env.fly_to = lambda t_s: happened.append(("flies", t_s))
    for t_s in (2.0, 5.0, 5.0):
        env.timeout(t_s).callbacks.append(lambda _: happened.append(("event", env.now)))
    env.run()
    two, five = 2.0, 5.0
    assert happened == [
        *[("flies", two), ("event", two), ("flies", five), ("event", five), ("event", five)]
    ]


def test_what_a_flight_brings_about_is_processed_before_the_event_it_flew_to():
    env, happened = MissionEnvironment(), []

    def fly_to(t_s: float) -> None:
        if not happened and env.now < 3.0 < t_s:
            exactly_at(env, 3.0).callbacks.append(lambda _: happened.append(env.now))

    env.fly_to = fly_to
    env.timeout(7.0).callbacks.append(lambda _: happened.append(env.now))
    env.advance(8.0)
    assert happened == [3.0, 7.0]
    assert env.now == 8.0


def test_advancing_stops_before_the_events_of_its_end():
    env, happened = MissionEnvironment(), []
    env.timeout(4.0).callbacks.append(lambda _: happened.append(env.now))
    env.advance(4.0)
    assert (env.now, happened) == (4.0, [])
    env.advance(4.1)
    assert happened == [4.0]
