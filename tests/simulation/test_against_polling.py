"""Missions that fly from event to event and leave calls out are the plain ones: see
`tests.helpers.polling`.
"""

from functools import cache

import pytest
from hypothesis import example, given, seed, settings
from hypothesis import strategies as st

from suave_des.managing.simple import RandomManager
from suave_des.metrics.recording import Trajectory
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator
from tests.helpers.polling import each_pair, effects, polled

MANAGERS = ("none", "random", "bt", "bt_extended", "metacontrol")


class Restless(RandomManager):
    """Picks modes of both functions at all times: often both send set-points."""

    def __init__(self, system):
        super().__init__(system)
        self._functions = ("f_generate_search_path", "f_follow_pipeline")

    task_requested = task_cancelled = diagnostic = lambda self, _: None


LOADED = {name: load_scenario(name) for name in ("seams2023", "planta_exp1", "release15")}


def uniform(minimum: float, maximum: float) -> dict[str, object]:
    return {"distribution": "uniform", "minimum": minimum, "maximum": maximum}


def normal(std: float) -> dict[str, object]:
    return {"distribution": "normal", "mean": 0.0, "std": std}


def faults(*events: tuple[int, str, object]) -> dict[str, object]:
    return {
        "thruster_events": [
            dict(zip(("thruster", "event", "time_s"), each, strict=True)) for each in events
        ]
    }


NOISE = {"signals.water_visibility.noise": normal(0.1)}
DRAWN_LATENCIES = {
    "latencies.inference_s": uniform(0.1, 3.0),
    "latencies.mode_change_s": uniform(0.1, 2.0),
}
LOST_SET_POINTS = {"revision.set_points.loss_probability": 0.3}
BATTERY = {"battery": {}, "mission.time_limit_s": 400.0}
FAILURES = [(1, "failure", 20.0), (3, "failure", 5.0)]
FAULTS = faults(
    *FAILURES, (1, "recovery", 15.0), (5, "failure", uniform(40.0, 90.0)), (2, "failure", 60.0)
)
CURRENT = {"current.x_m_per_s": normal(0.08), "current.y_m_per_s": 0.1, "current.z_m_per_s": -0.02}
FRAMES = {
    "revision.set_points.node_frame_offset_x_m": normal(0.3),
    "revision.set_points.node_frame_offset_z_m": normal(0.2),
}
FOLLOW_POLL, SPIRAL = "revision.follow.poll_period_s", "revision.spiral"
# at a poll
IN_STEP = {
    "managers.random.adaptation_period_s": 1.0,
    FOLLOW_POLL: 1.0,
    "latencies.mode_change_s": 1.7,
}
LONG = {
    "mission.time_limit_s": 600.0,
    FOLLOW_POLL: 0.5,
    "revision.set_points.loss_probability": 0.0,
}
MOVED = {f"{SPIRAL}.centre": "activation", f"{SPIRAL}.restarts_on_activation": False}
CONDITIONS = {
    "as shipped": {},
    "noise": NOISE,
    "drawn latencies": DRAWN_LATENCIES,
    "lost set-points": LOST_SET_POINTS,
    "battery": BATTERY,
    "faults": FAULTS,
    "current": CURRENT,
    "frame errors": FRAMES,
    "all of it": {
        **NOISE,
        **DRAWN_LATENCIES,
        **LOST_SET_POINTS,
        **BATTERY,
        **FAULTS,
        **CURRENT,
        **FRAMES,
    },
}


@cache
def simulator(name: str, condition: str) -> Simulator:
    return Simulator(with_values(LOADED[name], CONDITIONS[condition]))


def parts_of(trajectory: Trajectory) -> tuple[object, ...]:
    """What all its points are made from: to make them would take as long as the mission."""
    series = trajectory.modes, trajectory.visibility, *trajectory.further.items()
    return trajectory.poses.tobytes(), *series


def assert_same(simulator: Simulator, manager: str | type[RandomManager], run: int) -> None:
    """Recorded and not, a mission is the one in which everything is polled."""
    with polled():
        plain = simulator.run(manager, run, 1, record=True)
    recorded = simulator.run(manager, run, 1, record=True)
    assert recorded.events == plain.events
    assert recorded.metrics == plain.metrics
    assert parts_of(recorded.trajectory) == parts_of(plain.trajectory)
    assert recorded.knowledge == plain.knowledge
    modes = [(event.t_s, event.detail) for event in plain.events if event.event == "mode_set"]
    for _ in range(2 if manager == "metacontrol" else 1):  # at first its cache may be empty
        assert effects(simulator, manager, run, record=False) == (plain.metrics, modes)


@pytest.mark.parametrize(
    ("name", "condition", "manager"), each_pair(sorted(LOADED), CONDITIONS, MANAGERS)
)
def test_missions_are_those_in_which_all_is_polled(name, condition, manager):
    """Each cell has a run of its own, so that there are as many different missions."""
    run = 1 + 10 * list(CONDITIONS).index(condition) + MANAGERS.index(manager)
    assert_same(simulator(name, condition), manager, run)


ON_TICKS = st.integers(0, 400).map(lambda n: 0.25 * n)
SCENARIOS = {
    "name": st.sampled_from(["release15", "seams2023"]),  # their visibility has a period
    "manager": st.sampled_from([*MANAGERS, Restless]),
    "run": st.integers(1, 10**6),
    "loss": st.sampled_from([0.0, 0.0, 0.1, 0.6]),
    "period_s": st.floats(10.0, 120.0),
    "latency_s": st.floats(0.0, 3.0) | ON_TICKS.map(lambda t_s: t_s / 100.0),
    "failures": st.lists(
        st.tuples(st.floats(0.0, 100.0) | ON_TICKS, st.sampled_from(["frozen", "dead"])), max_size=4
    ),
    "poll_s": st.sampled_from([0.1, 0.2, 0.25, 0.37, 1.0, 2.0]),
    "error_m": st.floats(-0.2, 1.0),
    "slower": st.floats(0.0, 1.0),
}


def assert_polled(
    name, manager, run, loss, period_s, latency_s, failures, poll_s, error_m, slower
) -> None:
    events = [
        {"thruster": 1 + number, "event": "failure", "time_s": t_s, "failure_mode": mode}
        for number, (t_s, mode) in enumerate(failures)
    ]
    values = {
        "revision.set_points.loss_probability": loss,
        "revision.follow.poll_period_s": poll_s,
        "signals.water_visibility.period_s": period_s,
        "latencies.mode_change_s": latency_s,
        "calibration.altitude_error_m": error_m,
        "calibration.real_time_factor_loss": slower,
        "thruster_events": events,
    }
    assert_same(Simulator(with_values(LOADED[name], values)), manager, run)


@given(**SCENARIOS)
@example(  # a call in the first period that is set anew would miss its time by rounding
    name="release15",
    manager="metacontrol",
    run=100001,
    loss=0.1,
    period_s=18.404351864644486,
    latency_s=0.7025,
    failures=[(0.0, "frozen")],
    poll_s=2.0,
    error_m=0.04516056795008638,
    slower=0.8517633100236173,
)
@settings(max_examples=12)
def test_missions_are_those_in_which_all_is_polled_whatever_the_scenario(**scenario):
    assert_polled(**scenario)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_missions_of_many_scenarios_are_those_in_which_all_is_polled(part):
    """Two thousand, in four tests, which several processes share."""
    polled = given(**SCENARIOS)(assert_polled)
    seed(part)(settings(max_examples=500)(polled))()


def test_set_points_may_be_sent_more_often_than_there_are_way_points_left():
    """The last ones are not reached: thrusters have failed."""
    assert_same(Simulator(with_values(LOADED["planta_exp1"], LONG)), "none", 1)


@pytest.mark.parametrize(
    "runs",
    [range(1, 6), pytest.param(range(6, 21), marks=pytest.mark.slow)],
    ids=["few", "many"],
)
@pytest.mark.parametrize(
    "values", [CONDITIONS["all of it"], IN_STEP, MOVED], ids=["all of it", "in step", "moved"]
)
@pytest.mark.parametrize("name", sorted(LOADED))
def test_two_functions_that_fly_the_vehicle_in_turn_send_as_if_polled(name, values, runs):
    restless = Simulator(with_values(LOADED[name], values))
    for run in runs:
        assert_same(restless, Restless, run)
