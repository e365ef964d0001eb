"""The call of an event-triggered manager comes after all else of its time, so that it does not matter
when it was planned: calls that are left out, and missions that are recorded, change nothing.
"""

import pytest
import simpy

from suave_des import Simulator, load_scenario
from suave_des.clock import Alarm, call_at
from suave_des.simulation.calls import EventTriggeredTimes
from suave_des.simulation.mission import Mission


@pytest.mark.parametrize("planned", ["before", "after"])
def test_the_last_call_of_a_time_comes_after_all_else(planned):
    env, order = simpy.Environment(), []
    alarm = Alarm(env, lambda: order.append("alarm"))
    if planned == "before":
        alarm.set(4.0, last=True)
    call_at(env, 4.0, lambda: order.append("other"))
    if planned == "after":
        alarm.set(4.0, last=True)
    env.run()
    assert order == ["other", "alarm"]


@pytest.mark.parametrize("sleeps", [True, False], ids=["woken", "not left out"])
def test_the_calls_of_an_event_triggered_manager_come_after_all_else_of_their_time(sleeps):
    env, order = simpy.Environment(), []

    def call() -> None:
        order.append("call")
        times.go_on(changed=False, may_sleep=sleeps)

    times = EventTriggeredTimes(env, call, (2.0, 2.0), [], lambda: 0.0)
    call_at(env, 3.0, times.wake)
    call_at(env, 3.5, lambda: call_at(env, 4.0, lambda: order.append("other")))
    env.run(5.0)
    assert order == ["call", "other", "call"]


@pytest.fixture(scope="module", params=[1.0, 3.0])
def simulator(request) -> Simulator:
    """Missions in which modes take effect just when metacontrol is called."""
    values = {
        "latencies.mode_change_s": request.param,
        "signals.water_visibility.period_s": 95.0,
        "calibration.altitude_error_m": 0.0,
        "calibration.real_time_factor_loss": 0.0,
        "thruster_events": [{"thruster": 1, "event": "failure", "time_s": 0.0}],
        "mission.time_limit_s": 60.0,
    }
    return Simulator(load_scenario("seams2023", values=values))


def effects(simulator: Simulator, run: int, record: bool) -> list[tuple[float, str, str]]:
    """When which mode of which function takes effect."""
    found = []
    mission = Mission(simulator, "metacontrol", run=run, seed=1, record=record)
    mission.mode_manager.listeners.append(
        lambda function, mode: found.append((mission.now_s, function, mode.name))
    )
    mission.result()
    return found


@pytest.mark.parametrize("run", range(1, 9))
def test_recorded_missions_are_adapted_as_others_when_modes_take_effect_at_a_call(simulator, run):
    assert effects(simulator, run, record=True) == effects(simulator, run, record=False)
