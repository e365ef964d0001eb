"""The extended mission: the battery is recharged as the knowledge base says, and the task goes on
where it was left.
"""

from functools import cache
from itertools import pairwise, product

import pytest

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import Inference, KnowledgeState, ObjectiveState
from suave_des.metrics.result import MissionResult
from suave_des.resources import find
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator

RECHARGES = pytest.mark.parametrize("manager", ["metacontrol", "bt_extended"])


@cache
def flown(
    manager: str, run: int = 3, disabled: tuple[str, ...] = (), **values: object
) -> MissionResult:
    loaded = load_scenario("extended", disabled_rules=disabled)
    changed = {path.replace("__", "."): value for path, value in values.items()}
    return Simulator(with_values(loaded, changed)).run(manager, run=run, seed=1, record=True)


def times_s(result: MissionResult, event: str, detail: str) -> list[float]:
    return [each.t_s for each in result.events if each.event == event and detail in each.detail]


def is_on_the_way(result: MissionResult) -> list[bool]:
    """At each point of the trajectory: whether the vehicle is on its way to the station."""
    return [point.mode in ("fd_recharge", "normal") for point in result.trajectory]


@RECHARGES
def test_the_vehicle_sets_off_for_the_station_when_the_battery_is_below_a_quarter(manager):
    result = flown(manager)
    low_s = times_s(result, "battery_crossing", "falls below 0.25")[0]
    mode = "fd_recharge" if manager == "metacontrol" else "normal"
    assert 0.0 < times_s(result, "mode_set", f"generate_recharge_path = {mode}")[0] - low_s < 4.0


def test_nothing_else_moves_the_vehicle_on_the_way():
    result = flown("metacontrol")
    on_way = is_on_the_way(result)
    began = on_way.index(True)
    way = result.trajectory[began : began + on_way[began:].index(False)]  # the first time
    gaps_m = [max(abs(point.x_m + 3.0), abs(point.y_m + 2.0)) for point in way[20:]]
    assert gaps_m[0] > 5.0 > 0.8 > gaps_m[-1]
    assert all(later < earlier for earlier, later in pairwise(gaps_m[25::25]) if earlier > 2.0)


def test_the_search_goes_on_around_the_same_centre():
    """With no pipeline to find, the vehicle comes back to where it was, and goes on outwards."""
    result = flown(
        "metacontrol", pipeline__vertices_m=((500.0, 500.0, -20.0), (510.0, 500.0, -20.0))
    )
    centre = result.trajectory[0]
    distance_m = [max(abs(p.x_m - centre.x_m), abs(p.y_m - centre.y_m)) for p in result.trajectory]
    on_way = is_on_the_way(result)
    left, back = on_way.index(True), len(on_way) - on_way[::-1].index(True)
    assert distance_m[back] > 10.0
    # a turn of a minute adds up to 3.5 m
    assert distance_m[left] - 1.0 < distance_m[-1] < distance_m[left] + 4.0


TWO_LEGS = {"mission__time_limit_s": 900.0, "battery__discharge_time_s": 240.0}


def test_the_distance_inspected_before_the_recharge_is_kept():
    assert flown("metacontrol", **TWO_LEGS).metrics.distance_inspected_m > 20.0


def test_following_goes_on_at_the_point_where_it_was_left():
    result = flown("metacontrol", **TWO_LEGS)
    followed = [p for p in result.trajectory if p.mode == "fd_follow_pipeline"]
    first_leg = [
        p for p in followed if p.t_s < times_s(result, "battery_crossing", "falls below")[0]
    ]
    # The second leg begins at the station, and inspects what lies beyond the first: it passes no
    # place twice.
    assert min(p.x_m for p in followed) < min(p.x_m for p in first_leg) - 3.0


def test_the_trees_way_to_the_station_ends_with_the_recharge():
    """Its sequence goes on to its last step: a plain fallback does not ask the guard again."""
    result = flown("bt_extended")
    modes = [each.detail for each in result.events if each.event == "mode_set"]
    recharging = [detail for detail in modes if "recharge" in detail]
    assert recharging == ["generate_recharge_path = normal", "generate_recharge_path = inactive"]


def test_the_tree_follows_the_pipeline_again_when_the_battery_is_charged():
    result = flown("bt_extended")
    (recharged_s,) = times_s(result, "battery_crossing", "rises to")
    again_s = times_s(result, "mode_set", "f_follow_pipeline = fd_follow_pipeline")[1]
    assert recharged_s < again_s < recharged_s + 1.0


def test_after_the_recharge_the_tree_draws_the_vehicle_back_no_more():
    result = flown("bt_extended")
    (recharged_s,) = times_s(result, "battery_crossing", "rises to")
    x_m = [each.x_m for each in result.trajectory if each.t_s > recharged_s + 20.0]
    assert x_m[-1] < x_m[0] - 5.0


def test_the_level_is_the_knowledge_bases():
    loaded = load_scenario("extended")
    half = with_values(loaded, {"knowledge.values": {"qa_battery_level_work": 0.5}})
    result = Simulator(half).run("metacontrol", run=3, seed=1, record=True)
    set_off_s = times_s(result, "mode_set", "generate_recharge_path = fd_recharge")[0]
    assert 100.0 < set_off_s < 104.0


def test_without_the_rule_on_the_battery_the_vehicle_is_never_recharged():
    result = flown("metacontrol", disabled=("QABatteryLevel",))
    assert not times_s(result, "mode_set", "generate_recharge_path = fd_recharge")


def test_without_the_rule_on_the_charged_battery_the_vehicle_stays_at_the_station():
    result = flown("metacontrol", disabled=("QABatteryCharged",))
    assert times_s(result, "battery_crossing", "rises to")
    assert len(times_s(result, "mode_set", "generate_recharge_path = fd_no_recharge")) == 1


@pytest.mark.parametrize("level", [0.0, 0.4])
def test_the_mission_ends_at_the_level_that_the_scenario_names(level):
    result = flown("none", battery__mission_ends_at_level=level)
    assert result.metrics.mission_duration_s == pytest.approx(200.0 * (1.0 - level), abs=1.0)
    assert times_s(result, "mission_ended", "the battery is down to")


@pytest.mark.parametrize(
    "disturbance",
    [
        {"noise": {"distribution": "normal", "mean": 0.0, "std": 0.05}},
        {"dropout_probability": 0.5},
    ],
    ids=["noise", "lost messages"],
)
def test_the_mission_ends_at_the_first_published_level_that_is_low_enough(disturbance):
    disturbed = {f"battery__{name}": value for name, value in disturbance.items()}
    fly = flown.__wrapped__  # such values cannot be the key of a cache
    through = fly("none", **disturbed)
    levels = [(point.t_s, point.further["battery_level"]) for point in through.trajectory]
    low_s = next(t_s for t_s, level in levels if level is not None and level <= 0.4)
    ended = fly("none", battery__mission_ends_at_level=0.4, **disturbed)
    assert ended.metrics.mission_duration_s == pytest.approx(low_s, abs=0.2)


@cache
def extended_ontology() -> Ontology:
    return Ontology.load([find("suave_extended.owl", "ontology")])


def inferred(reasoner: str, design: str, level: float) -> Inference:
    """What a reasoner infers of a design in use at a level of the battery."""
    state = KnowledgeState.of(
        [ObjectiveState("generate_recharge_path")],
        groundings={"generate_recharge_path": design},
        measurements={"battery_level": level},
    )
    return Reasoner(extended_ontology(), reasoner).analyze(state)


AT_LEVELS = pytest.mark.parametrize(
    ("design", "level"), list(product(["fd_recharge", "fd_no_recharge"], [0.2, 0.25, 1.0]))
)


@AT_LEVELS
def test_not_to_recharge_is_an_error_at_a_low_level_alone(design, level):
    status = inferred("pellet", design, level).grounding_status("generate_recharge_path")
    assert (status == "IN_ERROR_NFR") == (design == "fd_no_recharge" and level < 0.25)


@AT_LEVELS
def test_to_recharge_may_end_once_the_level_is_no_longer_low(design, level):
    found = inferred("pellet", design, level).values("o_generate_recharge_path", "o_updatable")
    assert (True in found) == (design == "fd_recharge" and level >= 0.25)


@pytest.mark.slow
@AT_LEVELS
def test_stock_pellet_infers_the_same_of_the_extended_ontology(design, level):
    assert inferred("pellet", design, level) == inferred("owlready2", design, level)
