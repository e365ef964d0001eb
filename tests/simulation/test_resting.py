"""Calls of adapt that would do nothing are left out, and the results are those of a mission with all of them."""

import random
from dataclasses import replace
from itertools import pairwise
from unittest import mock

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.clock import call_at
from suave_des.errors import MissionError
from suave_des.managed.mode_manager import ModeManager
from suave_des.managing.base import ManagedSystem
from suave_des.managing.metacontrol import Metacontrol
from suave_des.monitor.diagnostics import FAILED, Diagnostic, DiagnosticsBus, Kind
from suave_des.monitor.measurements import Measurements
from suave_des.scenario.loader import LoadedScenario, load_scenario, with_values
from suave_des.scenario.modes import Mode
from suave_des.scenario.signal_kinds import ConstantSignal
from suave_des.simulation.host import ManagerHost
from suave_des.simulation.simulator import Simulator
from tests.helpers import OUTSIDE, outside_managers

NO_FAULTS = {"thruster_events": [], "mission.time_limit_s": 60.0}
LOADED = {name: load_scenario(name) for name in ("seams2023", "release15")}


def steps(before: float, after: float, time_s: float) -> dict:
    return {"signals.water_visibility": {"kind": "step", "time_s": time_s, "before": before, "after": after}}


def called_s(values: dict, manager: str = "Resting", *, record: bool = False) -> list[float]:
    """Times at which the manager's adapt is called, once the first task is under way."""
    simulator = Simulator(with_values(LOADED["seams2023"], {**NO_FAULTS, **values}))
    simulator.run(f"{OUTSIDE}:{manager}", 1, 1, record=record)
    return [t_s for t_s in outside_managers.CALLED_S if t_s > 10.0]


EVERY_S = pytest.approx([11.0 + 2.0 * count for count in range(25)], abs=1e-9)


@pytest.mark.parametrize(
    ("manager", "record"),
    [
        ("Resting", True),
        ("NotResting", False),
        ("NeverIdle", False),
        ("Acting", True),
        ("StillActing", False),
    ],
)
def test_no_call_is_left_out(manager: str, record: bool) -> None:
    """Of a mission that is recorded, or a class that does not say itself that there is nothing to do then."""
    assert called_s(steps(2.5, 2.6, 30.0), manager, record=record) == EVERY_S


RESTING = pytest.mark.parametrize("manager", ["Resting", "Acting"])


@RESTING
def test_it_is_called_at_the_first_of_its_times_at_which_a_value_is_out_of_its_bounds(manager: str) -> None:
    rested = called_s(steps(2.5, 3.5, 31.5), manager)
    assert 33.0 in rested and len([t_s for t_s in rested if t_s < 33.0]) <= 1


@RESTING
def test_a_value_on_a_bound_is_out_of_it(manager: str) -> None:
    assert 33.0 in called_s(steps(2.5, 3.0, 31.5), manager)


@RESTING
def test_it_is_called_after_a_diagnostic(manager: str) -> None:
    fault = [{"thruster": 1, "event": "failure", "time_s": 40.0}]
    rested = called_s({**steps(2.5, 2.6, 30.0), "thruster_events": fault}, manager)
    quiet = called_s(steps(2.5, 2.6, 30.0), manager)
    assert [t_s for t_s in rested if t_s not in quiet] == [41.0]


def test_a_value_may_go_from_one_pair_of_bounds_to_another() -> None:
    assert 33.0 not in called_s(steps(2.5, 3.5, 31.5), "InTwoRanges")
    for value in (1.5, 2.0, 3.0, 4.0, 4.5):
        assert 33.0 in called_s(steps(2.5, value, 31.5), "InTwoRanges")


def test_a_manager_can_tell_whether_the_record_is_kept() -> None:
    outside_managers.RECORDED.clear()
    simulator = Simulator(LOADED["seams2023"])
    for record in (True, False):
        simulator.run(f"{OUTSIDE}:AsksForTheRecord", 1, 1, record=record)
    assert outside_managers.RECORDED == [True, False]


def test_the_batterys_level_is_not_foreseen() -> None:
    times_s = called_s({"battery": {"publishing_period_s": 5.0}}, "WatchesTheBattery")
    assert {late - early for early, late in pairwise(times_s)} == {4.0, 6.0}


@pytest.fixture
def calls(monkeypatch) -> list[float]:
    """Times of metacontrol's cycles."""
    times_s: list[float] = []
    adapt = Metacontrol.adapt

    def counted(self: Metacontrol):
        times_s.append(self.system.now_s)
        return adapt(self)

    monkeypatch.setattr(Metacontrol, "adapt", counted)
    return times_s


def test_metacontrol_reasons_when_something_has_changed(calls) -> None:
    simulator = Simulator(LOADED["seams2023"])
    simulator.run("metacontrol", 1, 1)
    resting = len(calls)
    simulator.run("metacontrol", 1, 1, record=True)
    assert len(calls) - resting == 150 and resting < 40
    calls.clear()
    simulator.run("metacontrol", 1, 1)  # by now it knows which values ask for what
    assert len(calls) < 15


def test_a_measured_value_that_is_no_number_is_an_error_at_once() -> None:
    simulator = Simulator(with_values(LOADED["seams2023"], {**NO_FAULTS, **steps(3.5, 1.5, 24.5)}))
    told = []
    for record in (True, False, False):
        with pytest.raises(MissionError, match="not a finite number") as raised:
            simulator.run(f"{OUTSIDE}:BlindInTheDark", 1, 1, record=record)
        told.append(str(raised.value))
    assert told[0] == told[1] == told[2]


@pytest.mark.parametrize(
    "values",
    [
        {"latencies.inference_s": {"distribution": "uniform", "minimum": 0.5, "maximum": 3.0}},
        {"knowledge.reasoner": "pellet"},
    ],
    ids=["drawn latency", "reasoner that tells all values apart"],
)
def test_metacontrol_leaves_no_cycle_out_with(values: dict, calls) -> None:
    several = Simulator(with_values(LOADED["seams2023"], {"mission.time_limit_s": 30.0, **values}))
    several.run("metacontrol", 1, 1)
    rested = calls.copy()
    calls.clear()
    several.run("metacontrol", 1, 1, record=True)
    assert rested == calls


SLOW = {"managers.metacontrol.reasoning_period_s": 7.3, "latencies.inference_s": 5.0}
FAULT = {"thruster_events": [{"thruster": 1, "event": "failure", "time_s": 40.0}], "mission.time_limit_s": 60.0}


@pytest.mark.parametrize("manager", ["metacontrol", f"{OUTSIDE}:Hasty", f"{OUTSIDE}:DoesMore"])
@pytest.mark.parametrize(
    "values",
    [{}, *({**FAULT, **steps(3.5, 1.5, time_s)} for time_s in (38.5, 39.5, 40.5, 41.5, 42.5))],
    ids=["as shipped", "before a fault", "just before", "with it", "while it is reasoned about", "after it"],
)
@pytest.mark.parametrize("name", sorted(LOADED))
def test_metacontrol_does_the_same_with_and_without_a_record(manager: str, values: dict, name: str) -> None:
    simulator = Simulator(with_values(LOADED[name], values))
    for run in range(1, 9):
        found = []
        for record in (True, False, False):
            outside_managers.CALLED_S.clear()
            found.append((outcome(simulator, manager, run, record=record), outside_managers.CALLED_S.copy()))
        assert found[0] == found[1] == found[2]


@pytest.mark.parametrize("manager", ["Meddling", "MeddlingToo", "CountsIdleCycles", "TakesBoundsApart"])
@pytest.mark.parametrize("values", [{}, SLOW], ids=["as shipped", "slow to reason"])
@pytest.mark.parametrize("name", sorted(LOADED))
def test_what_is_derived_from_metacontrol_does_the_same_with_and_without_a_record(
    name: str, values: dict, manager: str
) -> None:
    simulator = Simulator(with_values(LOADED[name], values))
    for run in range(1, 13):
        found = [outcome(simulator, f"{OUTSIDE}:{manager}", run, record=each) for each in (True, False, False)]
        assert found[0] == found[1] == found[2]


FAILURE = Diagnostic(0.0, Kind.COMPONENT_STATUS, "c_thruster_1", FAILED)


@given(
    period_s=st.floats(0.05, 4.0),
    start=st.floats(0.0, 1.0),
    takes=st.just(0.0) | st.floats(0.0, 0.99),
    changes=st.lists(st.floats(0.0, 12.0), max_size=4).map(sorted),
    told=st.lists(st.floats(0.0, 2.0) | st.floats(0.0, 12.0), max_size=3),
)
@settings(max_examples=1000, deadline=None)
def test_calls_that_are_not_left_out_come_at_the_very_same_times(period_s, start, takes, changes, told) -> None:
    """Times are given in periods; at each change the value leaves the bounds until the next one."""
    levels = [2.5, *([3.5, 2.5] * 2)[: len(changes)]]
    times_s = (0.0, *(period_s * time for time in changes))
    arrays = (np.array(times_s), np.array(levels))
    measured = Measurements("water_visibility", times_s, tuple(levels), 0.0, period_s, arrays)
    found = []
    for may_rest in (False, True):
        env, bus = simpy.Environment(), DiagnosticsBus()
        system = ManagedSystem(
            env,
            LOADED["seams2023"].scenario,
            {"period_s": period_s, "starts_s": start * period_s, "takes_s": takes * period_s},
            modes=None,
            lasting_functions=(),
            stream=random.Random,
            log=lambda event, detail: None,
            knowledge=lambda: None,
            measurements={measured.key: measured},
        )
        ManagerHost(f"{OUTSIDE}:AnyGrid", 1, system, bus, may_rest=may_rest)
        for time in told:
            call_at(env, time * period_s, lambda _, publish=bus.publish: publish(FAILURE))
        env.run(until=12.0 * period_s)
        found.append(outside_managers.CALLED_S.copy())
    every, rested = found
    assert set(rested) <= set(every)


VALUES = st.sampled_from([1.0, 1.25, 1.2500000000000002, 2.0, 2.25, 3.0, 3.25, 3.75]) | st.floats(0.5, 4.5)
TIMES_S = st.floats(5.0, 110.0)
SIGNALS = st.one_of(
    st.builds(lambda value: {"kind": "constant", "value": value}, VALUES),
    st.builds(
        lambda before, after, time_s: {"kind": "step", "before": before, "after": after, "time_s": time_s},
        VALUES,
        VALUES,
        TIMES_S,
    ),
    st.builds(
        lambda low, more, period_s, shift_s, step_s: {
            "kind": "sinusoid",
            "minimum": low,
            "maximum": low + more,
            "period_s": period_s,
            "shift_s": shift_s,
            "time_step_s": step_s,
        },
        VALUES,
        st.floats(0.1, 3.0),
        st.floats(5.0, 120.0),
        st.floats(0.0, 80.0),
        st.sampled_from([0.0, 1.0]),
    ),
)


def with_another_signal(name: str) -> LoadedScenario:
    scenario = LOADED[name].scenario
    signals = {**scenario.signals, "performance": ConstantSignal(kind="constant", value=1.0)}
    return replace(LOADED[name], scenario=scenario.model_copy(update={"signals": signals}))


@given(
    name=st.sampled_from(sorted(LOADED)),
    signal=SIGNALS,
    other=st.none() | SIGNALS,
    inference_s=st.sampled_from([0.0, 1.0, 1.4999999999999998, 1.9999999999999998, 2.5]),
    mode_change_s=st.sampled_from([0.0, 0.5, 1.0]),
    fault_s=TIMES_S,
    run=st.integers(1, 1000),
    manager=st.sampled_from(["metacontrol", "bt", "bt_extended"]),
    battery=st.none() | st.builds(lambda s: {"discharge_time_s": s}, st.floats(30.0, 300.0)),
)
@settings(max_examples=60, deadline=None)
def test_resting_changes_no_result(
    name, signal, other, inference_s, mode_change_s, fault_s, run, manager, battery
) -> None:
    values = {
        "mission.time_limit_s": 120.0,
        "signals.water_visibility": signal,
        "latencies.inference_s": inference_s,
        "latencies.mode_change_s": mode_change_s,
        "thruster_events": [{"thruster": 1, "event": "failure", "time_s": fault_s}],
    }
    if battery is not None:
        values["battery"] = battery
    if other is not None:
        values["signals.performance"] = other
    simulator = Simulator(with_values(LOADED[name] if other is None else with_another_signal(name), values))
    with_all = outcome(simulator, manager, run, record=True)
    for _ in range(2):  # at first metacontrol does not know yet which values ask for what
        assert outcome(simulator, manager, run, record=False) == with_all


def outcome(simulator: Simulator, manager: str, run: int, *, record: bool) -> tuple:
    """A mission's metrics, and the modes that took effect with their times."""
    effects = []
    take_effect = ModeManager._take_effect

    def noted(self: ModeManager, function: str, mode: Mode) -> None:
        effects.append((self._env.now, function, mode))
        take_effect(self, function, mode)

    with mock.patch.object(ModeManager, "_take_effect", noted):
        metrics = simulator.run(manager, run, 1, record=record).metrics
    return metrics, effects
