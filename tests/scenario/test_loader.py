"""Loading scenarios: shipped ones, those built on others, the files they name, and the trip to a worker."""

import hashlib
import pickle
import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import Calibration
from suave_des.scenario.physical import ConstantSignal, SinusoidSignal, TableSignal, ThrusterEvent
from suave_des.scenario.quantities import Normal, Uniform

HEAD = "base: seams2023.yaml\n"
SHIPPED = ("seams2023", "planta_exp1", "release15", "extended", "paper_table_values")


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_scenario_loads_with_its_own_name(name):
    assert load_scenario(name).scenario.name == name
    assert load_scenario(f"{name}.yaml") == load_scenario(name)


def test_every_shipped_scenario_is_known_here():
    files = {path.stem for path in shipped_folder("scenarios").glob("*.yaml")}
    assert files == {*SHIPPED, "planta_exp1_campaign", "suave_modes", "suave_extended_modes"}


def test_seams2023_is_the_papers_experiment():
    scenario = load_scenario("seams2023").scenario
    assert scenario.revision.name == "2023"
    assert scenario.mission.time_limit_s == 300
    assert (scenario.start.x_m, scenario.start.z_m) == (-17.0, -18.5)
    assert scenario.start.y_m == 2.0
    assert scenario.calibration.drift_y_m == Uniform(distribution="uniform", minimum=0.56, maximum=0.59)
    visibility = scenario.signals["water_visibility"]
    assert isinstance(visibility, SinusoidSignal)
    assert (visibility.period_s, visibility.minimum, visibility.maximum, visibility.shift_s) == (80, 1.25, 3.75, 0)
    assert scenario.thruster_events == (ThrusterEvent(thruster=1, event="failure", time_s=35),)
    assert scenario.managers.random.adaptation_period_s == 15
    assert scenario.managers.metacontrol.reasoning_period_s == 2
    assert scenario.latencies.inference_s == 1.0
    assert scenario.battery is None


def test_release15_is_the_same_vehicle_in_other_software():
    ours, other = load_scenario("release15").scenario, load_scenario("seams2023").scenario
    assert ours.revision.name == "1.5"
    assert ours.managers.random.adaptation_period_s == 30
    assert ours.managers.metacontrol.reasoning_period_s == 1.5
    of_2023_alone = ("altitude_error_m", "origin_y_m")
    shared = other.calibration.model_copy(update=dict.fromkeys(of_2023_alone, 0.0))
    assert (ours.calibration, ours.start, ours.pipeline) == (shared, other.start, other.pipeline)


def test_the_vehicle_is_the_same_in_every_revision():
    of_the_vehicle = {name for name in Calibration.model_fields if "_per_s" in name}
    assert len(of_the_vehicle) == 6
    assert (
        len({load_scenario(each).scenario.calibration.model_dump_json(include=of_the_vehicle) for each in SHIPPED}) == 1
    )


def test_paper_table_values_differs_from_seams2023_in_the_knowledge_and_what_reactions_are_measured_by():
    ours, other = load_scenario("paper_table_values").scenario, load_scenario("seams2023").scenario
    assert ours.knowledge.values == {
        "qa_water_visibility_low": 0.5,
        "qa_water_visibility_medium": 1.0,
        "qa_water_visibility_high": 2.0,
        "qa_performance_recover_thrusters": 0.5,
    }
    assert ours.reaction_metric.visibility_thresholds_m == (2.0, 1.0, 0.5)
    same = {name: getattr(other, name) for name in ("name", "description", "knowledge", "reaction_metric")}
    assert ours.model_copy(update=same) == other


@pytest.mark.parametrize("revision", ['"2023"', "2023", "'1.5'", "1.5"])
def test_a_revision_needs_no_quotes(write, revision):
    path = write("mine.yaml", HEAD + f"revision: {revision}\n")
    assert load_scenario(path).scenario.revision.name == revision.strip("'\"")


def test_a_revision_may_differ_from_a_shipped_one(write):
    ours = load_scenario(write("mine.yaml", HEAD + "revision: {base: 1.5, follow: {acceptance_m: 0.3}}\n")).scenario
    shipped = load_scenario("release15").scenario.revision
    assert ours.revision.follow.acceptance_m == 0.3
    follow = ours.revision.follow.model_copy(update={"acceptance_m": shipped.follow.acceptance_m})
    assert ours.revision.model_copy(update={"follow": follow}) == shipped


def test_a_revision_without_base_differs_from_that_of_the_base_scenario(write):
    ours = load_scenario(write("mine.yaml", "base: release15\nrevision: {follow: {acceptance_m: 0.3}}\n")).scenario
    assert (ours.revision.name, ours.revision.follow.acceptance_m) == ("1.5", 0.3)


def test_a_revision_with_its_own_base_takes_nothing_from_the_base_scenarios(write):
    offset = "{distribution: normal, mean: 0, std: 1%s}"
    revision = 'revision: {base: "2023", set_points: {node_frame_offset_x_m: %s}}\n'
    write("base.yaml", HEAD + revision % (offset % ", minimum: 0"))
    ours = load_scenario(write("mine.yaml", "base: base.yaml\n" + revision % (offset % ""))).scenario
    assert ours.revision.set_points.node_frame_offset_x_m == Normal(distribution="normal", mean=0, std=1)


def test_a_revision_may_be_a_file_beside_the_scenario(write):
    write("folder/own.yaml", 'base: "2023"\nname: own\nspiral: {workaround_step_m: 0.1}\n')
    ours = load_scenario(write("folder/mine.yaml", HEAD + "revision: own.yaml\n")).scenario
    assert (ours.revision.name, ours.revision.spiral.workaround_step_m) == ("own", 0.1)


def test_a_derived_scenario_says_only_what_differs(write):
    path = write("slow_sea.yaml", HEAD + "signals:\n  water_visibility: {period_s: 120}\nthruster_events: []\n")
    ours, other = load_scenario(path).scenario, load_scenario("seams2023").scenario
    assert ours.signals["water_visibility"] == other.signals["water_visibility"].model_copy(update={"period_s": 120})
    assert ours.thruster_events == ()
    assert ours.mission == other.mission


def test_a_derived_scenario_is_called_after_its_file_unless_it_says_otherwise(write):
    assert load_scenario(write("slow_sea.yaml", HEAD)).scenario.name == "slow_sea"
    assert load_scenario(write("2 slow.seas.yaml", HEAD)).scenario.name == "_2_slow.seas"
    assert load_scenario(write("slow_sea.yaml", HEAD + "name: other\n")).scenario.name == "other"


def test_a_signal_of_another_kind_replaces_the_base_s(write):
    path = write("mine.yaml", HEAD + "signals: {water_visibility: {kind: constant, value: 2}}\n")
    assert load_scenario(path).scenario.signals["water_visibility"] == ConstantSignal(kind="constant", value=2)


def test_null_removes_a_signal_a_value_and_the_battery(write):
    write(
        "base.yaml",
        "base: paper_table_values\nbattery: {}\nsignals: {chlorophyll: {kind: constant, value: 1}}\n",
    )
    path = write(
        "mine.yaml",
        "base: base.yaml\nbattery: null\nsignals: {chlorophyll: null}\n"
        "knowledge: {values: {qa_performance_recover_thrusters: null}}\n",
    )
    scenario = load_scenario(path).scenario
    assert scenario.battery is None
    assert set(scenario.signals) == {"water_visibility"}
    assert "qa_performance_recover_thrusters" not in scenario.knowledge.values
    assert len(scenario.knowledge.values) == 3


def test_a_default_mode_is_replaced_without_losing_the_others(write):
    path = write("mine.yaml", "revision: 2023\n" + SIGNAL + "default_modes: {f_generate_search_path: fd_spiral_high}\n")
    assert load_scenario(path).scenario.default_modes == {
        "f_generate_search_path": "fd_spiral_high",
        "f_follow_pipeline": "fd_follow_pipeline",
    }


SIGNAL = "signals: {water_visibility: {kind: constant, value: 2}}\n"


def test_both_spellings_of_thruster_events_mean_the_same(write):
    path = write(
        "mine.yaml",
        HEAD + 'thruster_events:\n  - "(3, recovery, 50.0)"\n  - (1,failure,35)\n'
        "  - {thruster: 3, event: recovery, time_s: 50}\n  - {thruster: 1, event: failure, time_s: 35}\n",
    )
    events = load_scenario(path).scenario.thruster_events
    assert events[:2] == events[2:]


@given(
    thruster=st.integers(1, 6),
    event=st.sampled_from(["failure", "recovery"]),
    time_s=st.floats(0.0, 1e6),
    space=st.sampled_from(["", " ", "  "]),
)
def test_an_event_survives_the_exemplars_spelling(thruster, event, time_s, space):
    text = f"{space}({thruster},{space}{event}{space},{space}{time_s!r}){space}"
    assert ThrusterEvent.model_validate(text) == ThrusterEvent(thruster=thruster, event=event, time_s=time_s)


def test_a_table_signal_brings_its_values_along(write):
    write("folder/data/sea.csv", "t_s,value\n0,3\n60,1\n")
    path = write("folder/mine.yaml", HEAD + "signals: {water_visibility: {kind: table, file: data/sea.csv}}\n")
    loaded = load_scenario(path)
    assert isinstance(loaded.scenario.signals["water_visibility"], TableSignal)
    assert loaded.tables == {"water_visibility": ((0.0, 60.0), (3.0, 1.0))}


def test_files_are_looked_for_beside_the_file_that_names_them(write, shipped_modes):
    write("common/m.yaml", shipped_modes.replace("spiral_altitude: 3.0", "spiral_altitude: 3.5"))
    write("common/base.yaml", HEAD + "modes_file: m.yaml\n")
    loaded = load_scenario(write("mine.yaml", "base: common/base.yaml\n"))
    assert loaded.modes_path == Path("common/m.yaml")
    assert loaded.modes.mode("f_generate_search_path", "fd_spiral_high").parameters == {"spiral_altitude": 3.5}


def test_a_shipped_scenario_means_the_same_in_every_folder(write, shipped_modes):
    here = load_scenario("seams2023")
    write("suave_modes.yaml", shipped_modes.replace("spiral_altitude: 3.0", "spiral_altitude: 3.5"))
    write("suave.owl", "not an ontology")
    assert load_scenario("seams2023") == here


def test_a_path_wins_over_the_shipped_file_of_that_name(write):
    write("seams2023.yaml", "base: release15\n")
    assert load_scenario("seams2023.yaml").scenario.revision.name == "1.5"


def test_the_command_line_replaces_ontologies_modes_and_reasoner(write, shipped_modes):
    write("own.owl", "<rdf/>")
    write("second.owl", "<rdf/>")
    write("m.yaml", shipped_modes)
    loaded = load_scenario("seams2023", ontologies=["own.owl", "second.owl"], modes_file="m.yaml", reasoner="owlready2")
    assert loaded.ontologies == (Path("own.owl"), Path("second.owl"))
    assert loaded.modes_path == Path("m.yaml")
    assert loaded.scenario.knowledge.ontologies == ("own.owl", "second.owl")
    assert loaded.scenario.knowledge.reasoner == "owlready2"
    assert loaded.scenario.modes_file == "m.yaml"


def test_every_file_read_is_hashed_under_the_name_shown(write):
    table = write("sea.csv", "t_s,value\n0,3\n")
    path = write("mine.yaml", HEAD + "signals: {water_visibility: {kind: table, file: sea.csv}}\n")
    inputs = load_scenario(path).inputs
    assert set(inputs) == {
        "mine.yaml",
        "sea.csv",
        "shipped/scenarios/seams2023.yaml",
        "shipped/scenarios/revisions/2023.yaml",
        "shipped/scenarios/vehicles/bluerov2.yaml",
        "shipped/scenarios/suave_modes.yaml",
        "shipped/ontology/suave.owl",
    }
    assert inputs["sea.csv"] == hashlib.sha256(table.read_bytes()).hexdigest()
    assert inputs["mine.yaml"] == hashlib.sha256(path.read_bytes()).hexdigest()


def test_a_loaded_scenario_travels_by_value(write):
    write("folder/sea.csv", "t_s,value\n0,3\n")
    path = write("folder/mine.yaml", HEAD + "signals: {water_visibility: {kind: table, file: sea.csv}}\n")
    loaded = load_scenario(path)
    packed = pickle.dumps(loaded)
    shutil.rmtree("folder")
    assert pickle.loads(packed) == loaded
