"""User-defined managers, given as module:Class, and what happens when they fail."""

import pickle

import pytest

from suave_des.errors import MissionError
from suave_des.metrics.result import MissionResult
from tests.helpers import OUTSIDE

QUIET = {"calibration": {"altitude_error_m": 0.0, "reasoning_slowdown": 0.0}}


def mission(simulator, manager: str, scenario: str = "seams2023", **changes: object) -> MissionResult:
    return simulator(scenario, **changes).run(f"{OUTSIDE}:{manager}", 1, 1, record=True)


def times_of(result: MissionResult, event: str, detail: str = "") -> list[float]:
    return [each.t_s for each in result.events if each.event == event and each.detail.startswith(detail)]


def test_adapt_may_let_mission_time_pass(simulator) -> None:
    result = mission(simulator, "Deliberate")
    assert times_of(result, "mode_requested", "f_generate_search_path -> fd_spiral_high")[0] == pytest.approx(1.5)


def test_its_mode_takes_effect_after_the_scenarios_latency(simulator) -> None:
    result = mission(simulator, "Deliberate")
    assert times_of(result, "mode_set", "f_generate_search_path = fd_spiral_high")[0] == pytest.approx(2.0)


def test_adapt_is_called_every_period(simulator) -> None:
    assert times_of(mission(simulator, "Deliberate"), "thinks")[:4] == pytest.approx([1.0, 3.0, 5.0, 7.0])


def test_a_call_that_would_come_during_an_earlier_one_is_left_out(simulator) -> None:
    settings = {"managers": {f"{OUTSIDE}:Deliberate": {"takes_s": 5.0}}}
    assert times_of(mission(simulator, "Deliberate", **settings), "thinks")[:4] == pytest.approx([1.0, 7.0, 13.0, 19.0])


def test_adapt_may_handle_the_failure_of_an_event_that_it_waits_for(simulator) -> None:
    assert times_of(mission(simulator, "HandlesFailures"), "handles", "lost")[:2] == pytest.approx([1.0, 3.0])


def test_an_outside_manager_can_complete_the_mission(simulator) -> None:
    assert mission(simulator, "Deliberate", **QUIET).metrics.distance_inspected_m > 0.0


def test_it_gets_measured_values_and_components(simulator) -> None:
    received = [each.detail for each in mission(simulator, "Observer").events if each.event == "received"]
    assert received[0] == "water_visibility 3.75" and "c_thruster_1 FALSE" in received


def test_its_random_stream_depends_on_the_run_alone(simulator) -> None:
    def drawn(run: int, **changes: object) -> list[str]:
        result = simulator("seams2023", **changes).run(f"{OUTSIDE}:Drawing", run, 1, record=True)
        return [each.detail for each in result.events if each.event == "drew"][:1]

    assert drawn(1) == drawn(1, **QUIET) != drawn(2)


@pytest.mark.parametrize(
    ("manager", "cause", "earliest_s", "latest_s"),
    [
        ("FailsAtLaunch", "RuntimeError: at launch", 0.0, 0.0),
        ("FailsOnRequest", "KeyError: 'no such task'", 0.0, 0.0),
        ("FailsOnCancellation", "ValueError: cannot stop", 300.0, 300.5),
        ("FailsOnDiagnostic", "ValueError: a thruster, too", 35.0, 36.0),
        ("FailsInAdapt", "ZeroDivisionError: division by zero", 12.0, 12.0),
        ("FailsAfterAWhile", "ValueError: changed its mind", 14.5, 14.5),
        ("IgnoresFailures", "LookupError: lost", 1.0, 1.0),
        ("YieldsANumber", "TypeError: adapt yielded 1.0", 12.0, 12.0),
        ("FailsInItsOwnProcess", "ValueError: by itself", 7.0, 7.0),
        ("NeverAdvances", "ValueError: period_s is 0.0", 0.0, 0.0),
    ],
)
def test_what_a_manager_raises_names_manager_run_and_time(
    simulator, manager: str, cause: str, earliest_s: float, latest_s: float
) -> None:
    with pytest.raises(MissionError) as raised:
        simulator().run(f"{OUTSIDE}:{manager}", 4, 1)
    error = raised.value
    assert (error.manager, error.run) == (f"{OUTSIDE}:{manager}", 4)
    assert earliest_s <= error.time_s <= latest_s
    assert error.cause.startswith(cause)


def test_a_missions_error_survives_the_trip_from_a_worker() -> None:
    error = MissionError("mine", 3, 12.5, "ValueError: no")
    there = pickle.loads(pickle.dumps(error))
    assert (str(there), there.run, there.time_s) == (
        "manager mine, run 3, mission time 12.50 s: ValueError: no",
        3,
        12.5,
    )


def test_other_missions_are_not_disturbed_by_one_that_failed(simulator) -> None:
    before = simulator().run("none", 1, 1)
    with pytest.raises(MissionError):
        simulator().run(f"{OUTSIDE}:FailsInAdapt", 1, 1)
    assert simulator().run("none", 1, 1) == before
