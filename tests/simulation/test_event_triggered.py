"""Event-triggered managers are called when something has changed; their missions are those of
time-triggered ones.
"""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.errors import MissionError
from suave_des.managing.metacontrol import Metacontrol
from suave_des.registry import manager_class
from suave_des.scenario.loader import LoadedScenario, load_scenario, with_values
from suave_des.scenario.models import ConstantSignal
from suave_des.simulation.mission import Mission
from suave_des.simulation.simulator import Simulator
from tests.helpers import OUTSIDE, outside_managers
from tests.helpers.owl_text import SUAVE, individual
from tests.helpers.polling import each_pair, effects

NO_FAULTS = {"thruster_events": [], "mission.time_limit_s": 60.0}
LOADED = {name: load_scenario(name) for name in ("seams2023", "release15")}


def steps(before: float, after: float, time_s: float) -> dict:
    return {
        "signals.water_visibility": {
            "kind": "step",
            "time_s": time_s,
            "before": before,
            "after": after,
        }
    }


def failure(time_s: float) -> list[dict]:
    return [{"thruster": 1, "event": "failure", "time_s": time_s}]


def with_settings(manager: str, **given: object) -> dict:
    return {f"managers.{OUTSIDE}:{manager}": given}


def simulator_of(values: dict, name: str = "seams2023") -> Simulator:
    """The keys of `values` are paths; that of a manager given as module:Class has dots in its
    name.
    """
    managers = {
        key.partition(".")[2]: value
        for key, value in values.items()
        if key.startswith(f"managers.{OUTSIDE}")
    }
    loaded = with_values(
        LOADED[name], {key: value for key, value in values.items() if "managers.tests" not in key}
    )
    if managers:
        data = loaded.scenario.model_dump(mode="python")
        data["managers"].update(managers)
        loaded = replace(loaded, scenario=type(loaded.scenario).model_validate(data))
    return Simulator(loaded)


def called_s(values: dict, manager: str = "EventTriggered", *, record: bool = False) -> list[float]:
    """Times at which the manager's adapt is called, once the first task is under way."""
    simulator_of({**NO_FAULTS, **values}).run(f"{OUTSIDE}:{manager}", 1, 1, record=record)
    return [t_s for t_s in outside_managers.CALLED_S if t_s > 10.0]


EVERY_S = pytest.approx([11.0 + 2.0 * count for count in range(25)], abs=1e-9)


@pytest.mark.parametrize(
    ("manager", "record"),
    [
        ("EventTriggered", True),
        ("MayDependOnAnything", False),
        ("DoesNotDeclare", False),
        ("NeverIdle", False),
    ],
)
def test_no_call_is_skipped(manager, record):
    """Of a recorded mission, of a class that does not say itself what it depends on, after a call
    that changed much.
    """
    assert called_s(steps(2.5, 2.6, 30.0), manager, record=record) == EVERY_S


@pytest.mark.parametrize(
    ("value", "called"),
    [(2.6, []), (3.5, [33.0]), (3.0, [33.0]), (2.0, [33.0]), (1.0, [33.0])],
    ids=["no crossing", "above", "on the upper", "on the lower", "below"],
)
def test_it_is_called_at_the_first_of_its_times_after_a_value_has_crossed_a_threshold(
    value, called
):
    assert called_s(steps(2.5, value, 31.5)) == called
    is_settled = with_settings("NeverIdle", settled=True)  # its generator returns True
    assert called_s({**steps(2.5, value, 31.5), **is_settled}, "NeverIdle") == called


@pytest.mark.parametrize(("crosses_s", "called"), [(30.5, [31.0]), (31.5, [33.0])])
def test_one_that_reads_values_later_is_called_where_it_would_read_the_new_one(crosses_s, called):
    """The values are published 0.65 s later, at 31.15 and 32.15 s; it reads them at 32 and 34 s."""
    assert called_s(steps(2.5, 3.5, crosses_s), "ReadsLate") == called


@pytest.mark.parametrize(
    ("before_m", "after_m", "called"),
    [(3.5, 2.5, [33.0]), (2.5, 3.5, [31.0])],
    ids=["it read nothing later", "it read later"],
)
def test_how_long_a_call_reads_may_differ_from_state_to_state(before_m, after_m, called):
    """The new value is published at 31.15 s: the call of 31 s has begun, and is not over."""
    values = steps(before_m, after_m, 31.0)
    assert called_s(values, "ReadsLateInMurkyWater") == called


def test_after_a_call_that_took_a_period_or_more_it_is_called_again():
    slow = with_settings("NeverIdle", settled=True, takes_s=3.0)
    called = called_s({**steps(2.5, 2.6, 30.0), **slow}, "NeverIdle")
    assert called == called_s({**steps(2.5, 2.6, 30.0), **slow}, "NeverIdle", record=True)
    assert called == pytest.approx([13.0 + 4.0 * count for count in range(12)])


def test_a_hook_during_a_call_that_takes_more_than_a_period_causes_no_second_one_meanwhile():
    """The call from 33 to 36 s; the failure is reported in its middle."""
    values = {**steps(2.5, 3.5, 31.5), "thruster_events": failure(33.2)}
    assert called_s(values, "SlowInClearWater")[0:2] == [33.0, 37.0]


def test_it_is_called_at_the_first_of_its_times_after_a_diagnostic():
    assert called_s({**steps(2.5, 2.6, 30.0), "thruster_events": failure(40.0)}) == [41.0]


def test_a_region_in_which_it_was_idle_since_the_last_change_of_state_needs_no_call():
    swings = {"kind": "sinusoid", "minimum": 1.5, "maximum": 2.5, "period_s": 10.0, "shift_s": 0.0}
    values = {"signals.water_visibility": swings, "thruster_events": failure(40.0)}
    calls = called_s(values)
    assert len(calls) == 2 and all(41.0 <= t_s < 51.0 for t_s in calls)  # one in each region


def test_thresholds_may_come_from_its_settings():
    given = with_settings("EventTriggeredByProperty", thresholds_m=[2.55])
    assert called_s({**steps(2.5, 3.5, 31.5), **given}, "EventTriggeredByProperty") == [33.0]
    assert called_s({**steps(2.6, 3.5, 31.5), **given}, "EventTriggeredByProperty") == []


def test_one_that_depends_on_no_measured_value_is_called_after_its_hooks_alone():
    for events, called in (([], []), (failure(40.0), [41.0])):
        assert (
            called_s(
                {**steps(2.5, 1.0, 31.5), "thruster_events": events}, "DependsOnNoMeasuredValue"
            )
            == called
        )


# Metacontrol


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


def test_metacontrol_reasons_when_something_has_changed(calls):
    simulator = Simulator(LOADED["seams2023"])
    simulator.run("metacontrol", 1, 1)
    event_triggered = len(calls)
    simulator.run("metacontrol", 1, 1, record=True)
    assert len(calls) - event_triggered == 150 and event_triggered < 40


def test_a_measured_value_that_is_not_a_number_is_an_error_at_once():
    simulator = simulator_of({**NO_FAULTS, **steps(3.5, 1.5, 24.5)})
    errors = []
    for record in (True, False, False):
        with pytest.raises(MissionError, match="not a finite number") as raised:
            simulator.run(f"{OUTSIDE}:BlindInTheDark", 1, 1, record=record)
        errors.append(str(raised.value))
    assert errors[0] == errors[1] == errors[2]


@pytest.mark.parametrize(
    "values",
    [
        {"latencies.inference_s": {"distribution": "uniform", "minimum": 0.5, "maximum": 3.0}},
        {"knowledge.reasoner": "pellet"},
    ],
    ids=["drawn latency", "reasoner that tells all values apart"],
)
def test_metacontrol_skips_no_cycle_with(values, calls):
    simulator = simulator_of({"mission.time_limit_s": 30.0, **values})
    simulator.run("metacontrol", 1, 1)
    unrecorded_s = calls.copy()
    calls.clear()
    simulator.run("metacontrol", 1, 1, record=True)
    assert unrecorded_s == calls


# The same missions


def assert_same_missions(simulator: Simulator, manager: str, runs: range) -> None:
    """Metrics and effects are the same whether the manager is event-triggered or called at each of
    its times.
    """
    has_cache = not manager.startswith(OUTSIDE) or issubclass(manager_class(manager), Metacontrol)
    for run in runs:
        at_each_time = effects(simulator, manager, run, record=True)
        for _ in range(2 if has_cache else 1):  # at first the cache is empty
            assert effects(simulator, manager, run, record=False) == at_each_time


SLOW = {"managers.metacontrol.reasoning_period_s": 7.3, "latencies.inference_s": 5.0}
FAULT = {"thruster_events": failure(40.0), "mission.time_limit_s": 60.0}
DERIVED = ("metacontrol", *(f"{OUTSIDE}:{name}" for name in ("Hasty", "DoesMore", "Meddling")))
CHANGES = {
    "as shipped": {},
    "latency longer than the period": SLOW,
    "before a fault": {**FAULT, **steps(3.5, 1.5, 38.5)},
    "just before": {**FAULT, **steps(3.5, 1.5, 39.5)},
    "with it": {**FAULT, **steps(3.5, 1.5, 40.5)},
    "while it is reasoned about": {**FAULT, **steps(3.5, 1.5, 41.5)},
    "after it": {**FAULT, **steps(3.5, 1.5, 42.5)},
}


@pytest.mark.parametrize(("name", "change", "manager"), each_pair(sorted(LOADED), CHANGES, DERIVED))
def test_managers_derived_from_metacontrol(name, change, manager):
    assert_same_missions(simulator_of(CHANGES[change], name), manager, range(1, 4))


def test_metacontrol_skips_no_cycle_while_it_may_have_missed_a_value():
    # 1.5 m is published before there is an objective, and ignored; 1.6 m, in the same region, is
    # not.
    values = {
        **steps(1.5, 1.6, 40.0),
        **NO_FAULTS,
        "revision.coordinator.maintain_motion_per_task": True,
        "revision.metacontrol.objectives_at_launch": [],
    }
    simulator = simulator_of(values)
    _, found = effects(simulator, "metacontrol", 1, record=False)
    assert [t_s > 40.0 for t_s, effect in found if effect.endswith("fd_spiral_low")] == [True]
    assert_same_missions(simulator, "metacontrol", range(1, 3))


def test_what_a_derived_class_plans_is_its_own():
    simulator = simulator_of(NO_FAULTS)
    before = effects(simulator, "metacontrol", 1, record=False)
    _, found = effects(simulator, f"{OUTSIDE}:PlansLow", 1, record=False)
    searches = [effect for _, effect in found if "= fd_spiral" in effect]
    assert (
        searches
        == ["f_generate_search_path = fd_spiral_low"]
        != [effect for _, effect in before[1]]
    )
    assert effects(simulator, "metacontrol", 1, record=False) == before


NOISE = {"signals.water_visibility.noise": {"distribution": "normal", "mean": 0.0, "std": 0.3}}
DRAWN = {"latencies.mode_change_s": {"distribution": "uniform", "minimum": 0.1, "maximum": 5.0}}
AGAIN = {
    "thruster_events": [
        {"thruster": thruster, "event": event, "time_s": 30.0}
        for thruster, event in ((1, "failure"), (2, "failure"), (1, "recovery"), (2, "failure"))
    ]
}
CONDITIONS = {
    "as shipped": {},
    "noise": NOISE,
    "drawn latencies": DRAWN,
    "faults again and again": AGAIN,
    "battery": {"battery": {"discharge_time_s": 90.0}},
    "short": {"mission.time_limit_s": 20.0},
}
FROM_OUTSIDE = (
    "SearchesAsHighAsItCanSee",
    "SubscribesToMeasuredValues",
    "ChangesModesInHooks",
    "TakesTime",
)


@pytest.mark.parametrize(
    ("period_s", "condition", "manager"), each_pair((0.1, 2.0, 45.0), CONDITIONS, FROM_OUTSIDE)
)
def test_outside_managers(period_s, condition, manager):
    given = with_settings(
        manager, period_s=period_s, starts_s=0.3 * period_s, takes_s=1.7 * period_s
    )
    assert_same_missions(
        simulator_of({**CONDITIONS[condition], **given}), f"{OUTSIDE}:{manager}", range(1, 3)
    )


VALUES = st.sampled_from([1.0, 1.25, 1.2500000000000002, 2.0, 2.25, 3.0, 3.25, 3.75]) | st.floats(
    0.5, 4.5
)
TIMES_S = st.floats(5.0, 110.0)
SIGNALS = st.one_of(
    st.fixed_dictionaries({"kind": st.just("constant"), "value": VALUES}),
    st.fixed_dictionaries(
        {"kind": st.just("step"), "before": VALUES, "after": VALUES, "time_s": TIMES_S}
    ),
    st.fixed_dictionaries(
        {
            "kind": st.just("sinusoid"),
            "minimum": VALUES,
            "maximum": st.floats(0.1, 3.0),  # above the minimum
            "period_s": st.floats(5.0, 120.0),
            "shift_s": st.floats(0.0, 80.0),
            "time_step_s": st.sampled_from([0.0, 1.0]),
        }
    ).map(lambda wave: {**wave, "maximum": wave["minimum"] + wave["maximum"]}),
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
@settings(max_examples=25, deadline=None)
def test_built_in_managers(
    name, signal, other, inference_s, mode_change_s, fault_s, run, manager, battery
):
    values = {
        "mission.time_limit_s": 120.0,
        "signals.water_visibility": signal,
        "latencies.inference_s": inference_s,
        "latencies.mode_change_s": mode_change_s,
        "thruster_events": failure(fault_s),
    }
    values |= {} if battery is None else {"battery": battery}
    values |= {} if other is None else {"signals.performance": other}
    loaded = LOADED[name] if other is None else with_another_signal(name)
    assert_same_missions(Simulator(with_values(loaded, values)), manager, range(run, run + 1))


@pytest.mark.parametrize("run", [1, 2, 3])
def test_a_recharge_while_it_reasons_counts_in_the_same_cycle(run):
    """The level that is published then is in no table before."""
    near = {"discharge_time_s": 60.0, "station_x_m": -16.0, "station_y_m": 2.0}
    values = {"mission.time_limit_s": 80.0, "thruster_events": [], "battery": near}
    simulator = Simulator(with_values(load_scenario("extended"), values))
    recorded, not_recorded = (
        effects(simulator, "metacontrol", run, record=record) for record in (True, False)
    )
    assert recorded == not_recorded


NEAR_STATION = {
    "mission.time_limit_s": 60.0,
    "battery": {
        "discharge_time_s": 20.0,
        "docking_check_period_s": 0.5,
        "publishing_period_s": 0.2,
        "station_radius_m": 50.0,
        "station_x_m": -15.0,
        "station_y_m": 2.0,
    },
    "latencies.inference_s": 0.28822482105151315,
    "latencies.mode_change_s": 1.5,
    "managers.metacontrol.first_cycle_s": 0.17805074946544747,
    "managers.metacontrol.reasoning_period_s": 0.5764496421030263,
    "revision.metacontrol.objectives_at_launch": ["f_generate_search_path"],
    "signals.water_visibility": {
        "kind": "sinusoid",
        "minimum": 0.5205823572189057,
        "maximum": 2.2463465781480627,
        "period_s": 54.353575025114,
        "shift_s": 23.19154738117998,
        "publishing_period_s": 0.1,
        "time_step_s": 0.5,
    },
    "thruster_monitor.dropout_probability": 0.3,
    "thruster_events": [{"thruster": 3, "event": "recovery", "time_s": 19.395380225396686}],
}


def test_a_recharge_counts_whose_function_became_active_while_a_call_was_left_out():
    simulator = Simulator(with_values(load_scenario("extended"), NEAR_STATION))
    assert_same_missions(simulator, "metacontrol", range(1, 2))


def test_a_latency_that_is_a_period_by_rounding_alone_skips_the_next_cycle():
    values = {
        "mission.time_limit_s": 90.0,
        "latencies.inference_s": 1.4999999999999998,
        "latencies.mode_change_s": 1.5,
        "managers.metacontrol.reasoning_period_s": 1.5,
        "signals.water_visibility": {
            "kind": "step",
            "before": 3.4642190973512776,
            "after": 3.592791460715461,
            "time_s": 37.707848243377676,
            "time_step_s": 0.0,
            "noise": {"distribution": "normal", "mean": 0.0, "std": 0.5},
            "publishing_period_s": 0.25,
        },
        "thruster_events": [
            {"thruster": 5, "event": "failure", "time_s": 35.0},
            {"thruster": 3, "event": "recovery", "time_s": 63.015098605522454},
            {"thruster": 4, "event": "recovery", "time_s": 35.0},
        ],
    }
    assert_same_missions(simulator_of(values), "metacontrol", range(2, 3))


@pytest.mark.parametrize("shift_s", [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5])
def test_a_manager_whose_calls_may_take_a_period_is_called_at_each_of_its_times(shift_s):
    wave = {"kind": "sinusoid", "minimum": 2.0, "maximum": 4.0, "period_s": 37.0}
    visibility = {**wave, "shift_s": shift_s, "time_step_s": 0.0}
    values = {"mission.time_limit_s": 90.0, "thruster_events": []}
    simulator = simulator_of({**values, "signals.water_visibility": visibility})
    assert_same_missions(simulator, f"{OUTSIDE}:LongInClearWater", range(1, 2))


@pytest.mark.parametrize("shift_s", range(0, 80, 10))
def test_a_loop_that_begins_its_cycles_later_says_for_how_long_it_reads(shift_s):
    simulator = simulator_of({**NO_FAULTS, "signals.water_visibility.shift_s": float(shift_s)})
    assert_same_missions(simulator, f"{OUTSIDE}:ThinksFirst", range(1, 2))


@pytest.mark.parametrize("record", [True, False])
def test_a_reading_time_that_is_none_is_told_after_the_call_that_set_it(record):
    with pytest.raises(MissionError, match=r"SpoilsItsReadingTime.*mission time 1\.00 s.*-1\.0"):
        called_s(NO_FAULTS, "SpoilsItsReadingTime", record=record)


def test_a_manager_may_say_that_its_state_has_changed_after_the_mission_was_closed():
    mission = Mission(simulator_of(NO_FAULTS), f"{OUTSIDE}:KeepsToWake")
    mission.advance(40.0)  # it sleeps
    mission.close()
    mission.manager.wake()
    assert mission.now_s == 40.0


def test_a_derived_loop_may_look_at_the_plans_that_it_executes():
    outside_managers.CountsPlans.decisions.clear()
    simulator_of(NO_FAULTS).run(f"{OUTSIDE}:CountsPlans", 1, 1)
    assert outside_managers.CountsPlans.decisions[0] == 2  # the task's two functions


STRONG_CURRENT = (
    individual("water_current", "QualityAttributeType", ("qa_comparison_operator", ">"))
    + individual("qa_water_current", "QAvalue", ("isQAtype", ":water_current"), ("hasValue", "9.0"))
    + f"""<rdf:Description rdf:about="{SUAVE}fd_spiral_high">
        <tomasys:hasQAestimation rdf:resource="{SUAVE}qa_water_current"/></rdf:Description>"""
)
STRONGER_THAN_CLEAR = """Stronger: FunctionGrounding(?fg) ^ typeFD(?fg, ?fd)
    ^ hasQAvalue(?fg, ?v) ^ isQAtype(?v, water_visibility) ^ hasValue(?v, ?visibility)
    ^ hasQAvalue(?fg, ?c) ^ isQAtype(?c, water_current) ^ hasValue(?c, ?current)
    ^ greaterThan(?current, ?visibility) -> fd_realisability(?fd, false)"""


def test_a_rule_that_compares_two_measured_values_sees_all_of_them(tmp_path, suave_copy):
    suave_copy(STRONG_CURRENT)
    (tmp_path / "stronger.swrl").write_text(STRONGER_THAN_CLEAR)
    (tmp_path / "current.yaml").write_text("""
base: seams2023.yaml
mission: {time_limit_s: 60}
thruster_events: []
signals:
  water_visibility: {kind: constant, value: 3.5}
  water_current: {kind: step, before: 3.4, after: 3.6, time_s: 40}
knowledge: {ontologies: [suave.owl], rules: [stronger.swrl]}
""")
    simulator = Simulator(load_scenario(tmp_path / "current.yaml"))
    assert_same_missions(simulator, "metacontrol", range(1, 2))


def test_a_class_with_an_analyze_of_its_own_plans_once_with_what_it_inferred_from():
    outside_managers.SeesHalf.plans = 0
    values = {**NO_FAULTS, "signals.water_visibility": {"kind": "constant", "value": 4.0}}
    result = simulator_of(values).run(f"{OUTSIDE}:SeesHalf", 1, 1, record=True)
    (mode,) = [each.detail for each in result.events if "= fd_spiral" in each.detail]
    assert mode == "f_generate_search_path = fd_spiral_low"
    assert outside_managers.SeesHalf.plans <= 31  # cycles in 60 s: one every 2 s


@pytest.mark.parametrize("reads_for_s", [-1.0, float("nan"), "1"])
def test_a_reading_time_that_is_none_is_told(monkeypatch, reads_for_s):
    monkeypatch.setattr(outside_managers.ReadsLate, "reads_for_s", reads_for_s)
    with pytest.raises(MissionError, match=r"reads_for_s is .*; it must be a number of at least 0"):
        called_s(NO_FAULTS, "ReadsLate")
