"""Loading scenarios: shipped ones, those built on others, the files they name, and what has no
effect.
"""

import hashlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from suave_des.campaign.campaign import run_campaign
from suave_des.errors import InputError
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import LoadedScenario, load_scenario, with_values
from suave_des.scenario.models import Calibration, Normal, Scenario, TableSignal, ThrusterEvent

HEAD = "base: seams2023.yaml\n"
SHIPPED = ("seams2023", "planta_exp1", "release15", "extended", "paper_table_values")


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_scenario_loads_with_its_own_name(name):
    assert load_scenario(name).scenario.name == name
    assert load_scenario(f"{name}.yaml") == load_scenario(name)


def test_every_shipped_scenario_is_known_here():
    files = {path.stem for path in shipped_folder("scenarios").glob("*.yaml")}
    assert files == {*SHIPPED, "planta_exp1_campaign", "suave_modes", "suave_extended_modes"}


def test_release15_is_the_same_vehicle_in_other_software():
    ours, other = load_scenario("release15").scenario, load_scenario("seams2023").scenario
    assert ours.revision.name == "1.5"
    assert ours.managers.random.adaptation_period_s == 30
    assert ours.managers.metacontrol.reasoning_period_s == 1.5
    of_2025 = load_scenario("planta_exp1").scenario.calibration
    of_2023_alone = ("altitude_error_m", "origin_y_m", "reasoning_slowdown")
    shared = other.calibration.model_copy(
        update={name: getattr(of_2025, name) for name in of_2023_alone}
    )
    assert (ours.calibration, ours.start, ours.pipeline) == (shared, other.start, other.pipeline)


def test_the_vehicle_is_the_same_in_every_revision():
    of_the_vehicle = {name for name in Calibration.model_fields if "_per_s" in name}
    assert len(of_the_vehicle) == 6
    assert (
        len(
            {
                load_scenario(each).scenario.calibration.model_dump_json(include=of_the_vehicle)
                for each in SHIPPED
            }
        )
        == 1
    )


@pytest.mark.parametrize(
    ("content", "name", "acceptance_m"),
    [
        *((HEAD + f"revision: {quoted}\n", "1.5", None) for quoted in ("1.5", "'1.5'", '"1.5"')),
        (HEAD + "revision: {base: 1.5, follow: {acceptance_m: 0.3}}\n", "1.5", 0.3),
        (
            "base: release15\nrevision: {follow: {acceptance_m: 0.3}}\n",
            "1.5",
            0.3,
        ),  # of the base scenario
        (HEAD + "revision: own.yaml\n", "own", 0.3),
    ],
)
def test_a_revision_is_a_shipped_one_or_differs_from_it_or_is_a_file_beside_the_scenario(
    write, content, name, acceptance_m
):
    write("own.yaml", "base: 1.5\nname: own\nfollow: {acceptance_m: 0.3}\n")
    ours, shipped = (
        load_scenario(each).scenario.revision for each in (write("mine.yaml", content), "release15")
    )
    follow = shipped.follow.model_copy(
        update={"acceptance_m": acceptance_m or shipped.follow.acceptance_m}
    )
    assert ours == shipped.model_copy(update={"name": name, "follow": follow})


def test_a_revision_with_its_own_base_takes_nothing_from_the_base_scenarios(write):
    offset = "{distribution: normal, mean: 0, std: 1%s}"
    revision = 'revision: {base: "2023", set_points: {node_frame_offset_x_m: %s}}\n'
    write("base.yaml", HEAD + revision % (offset % ", minimum: 0"))
    ours = load_scenario(
        write("mine.yaml", "base: base.yaml\n" + revision % (offset % ""))
    ).scenario
    assert ours.revision.set_points.node_frame_offset_x_m == Normal(
        distribution="normal", mean=0, std=1
    )


def test_a_derived_scenario_says_only_what_differs(write):
    path = write(
        "slow_sea.yaml",
        HEAD + "signals:\n  water_visibility: {period_s: 120}\nthruster_events: []\n",
    )
    ours, other = load_scenario(path).scenario, load_scenario("seams2023").scenario
    assert ours.signals["water_visibility"] == other.signals["water_visibility"].model_copy(
        update={"period_s": 120}
    )
    assert ours.thruster_events == ()
    assert ours.mission == other.mission


def test_a_derived_scenario_is_called_after_its_file_unless_it_says_otherwise(write):
    assert load_scenario(write("slow_sea.yaml", HEAD)).scenario.name == "slow_sea"
    assert load_scenario(write("2 slow.seas.yaml", HEAD)).scenario.name == "_2_slow.seas"
    assert load_scenario(write("slow_sea.yaml", HEAD + "name: other\n")).scenario.name == "other"


@pytest.fixture
def with_nulls(write) -> Scenario:
    """A scenario over one with four values, two signals and a battery."""
    write(
        "base.yaml",
        "base: paper_table_values\nbattery: {}\nsignals: {chlorophyll: {kind: constant, value: 1}}\n",
    )
    path = write(
        "mine.yaml",
        "base: base.yaml\nbattery: null\nsignals: {chlorophyll: null}\n"
        "knowledge: {values: {qa_performance_recover_thrusters: null}}\n",
    )
    return load_scenario(path).scenario


def test_null_removes_the_battery(with_nulls):
    assert with_nulls.battery is None


def test_null_removes_a_signal(with_nulls):
    assert set(with_nulls.signals) == {"water_visibility"}


def test_null_removes_a_value(with_nulls):
    assert len(with_nulls.knowledge.values) == 3
    assert "qa_performance_recover_thrusters" not in with_nulls.knowledge.values


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
    assert ThrusterEvent.model_validate(text) == ThrusterEvent(
        thruster=thruster, event=event, time_s=time_s
    )


def test_a_table_signal_brings_its_values_along(write):
    write("folder/data/sea.csv", "t_s,value\n0,3\n60,1\n")
    path = write(
        "folder/mine.yaml",
        HEAD + "signals: {water_visibility: {kind: table, file: data/sea.csv}}\n",
    )
    loaded = load_scenario(path)
    assert isinstance(loaded.scenario.signals["water_visibility"], TableSignal)
    assert loaded.tables == {"water_visibility": ((0.0, 60.0), (3.0, 1.0))}


def test_files_are_looked_for_beside_the_file_that_names_them(write, shipped_modes):
    write("common/m.yaml", shipped_modes.replace("spiral_altitude: 3.0", "spiral_altitude: 3.5"))
    write("common/base.yaml", HEAD + "modes_file: m.yaml\n")
    loaded = load_scenario(write("mine.yaml", "base: common/base.yaml\n"))
    assert loaded.modes_path == Path("common/m.yaml")
    assert loaded.modes.mode("f_generate_search_path", "fd_spiral_high").parameters == {
        "spiral_altitude": 3.5
    }


def test_a_shipped_scenario_means_the_same_in_every_folder(write, shipped_modes):
    here = load_scenario("seams2023")
    write("suave_modes.yaml", shipped_modes.replace("spiral_altitude: 3.0", "spiral_altitude: 3.5"))
    write("suave.owl", "not an ontology")
    assert load_scenario("seams2023") == here


def test_a_path_wins_over_the_shipped_file_of_that_name(write):
    write("seams2023.yaml", "base: release15\n")
    assert load_scenario("seams2023.yaml").scenario.revision.name == "1.5"


@pytest.fixture
def replaced(write, shipped_modes) -> LoadedScenario:
    write("own.owl", "<rdf/>")
    write("second.owl", "<rdf/>")
    write("m.yaml", shipped_modes)
    ontologies = ["own.owl", "second.owl"]
    return load_scenario(
        "seams2023", ontologies=ontologies, modes_file="m.yaml", reasoner="owlready2"
    )


def test_the_command_line_replaces_ontologies(replaced):
    assert replaced.ontologies == (Path("own.owl"), Path("second.owl"))


def test_the_command_line_replaces_the_modes(replaced):
    assert replaced.modes_path == Path("m.yaml")


def test_the_scenario_says_what_the_command_line_has_replaced(replaced):
    knowledge = replaced.scenario.knowledge
    assert (knowledge.ontologies, knowledge.reasoner, replaced.scenario.modes_file) == (
        ("own.owl", "second.owl"),
        "owlready2",
        "m.yaml",
    )


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


EARLY = "thruster_events.0: failures have no effect before 26 s"


def failures(*times_s: object) -> dict[str, object]:
    return {
        "thruster_events": [
            {"thruster": 1, "event": "failure", "time_s": time_s} for time_s in times_s
        ]
    }


@pytest.mark.parametrize(
    ("values", "starts"),
    [
        (failures(35.0), []),
        (failures(25.5), []),  # the monitor may notice it at 26 s only
        (failures(10.0), [EARLY]),
        (
            failures(35.0) | {"revision.thruster_failures.loss_probability": 1.0},
            ["thruster_events.0: each failure is lost"],
        ),
        (failures(10.0, 15.0), [EARLY]),  # in 2023 the second is 15 s later
        (failures({"distribution": "uniform", "minimum": 5, "maximum": 20}), [EARLY]),
        (failures({"distribution": "uniform", "minimum": 5, "maximum": 60}), []),
        (
            failures(100.0, 250.0),
            ["thruster_events.1: 350 s is after the end"],
        ),  # in 2023 it counts from the first
        (failures(100.0, 250.0) | {"revision.monitors.thruster_event_times": "after_start"}, []),
        (
            failures(100.0) | {"mission.time_limit_s": 100.0},
            ["thruster_events.0: 100 s is after the end"],
        ),
        ({"leak": {"time_s": 301.0}}, ["leak: 301 s is after the end"]),
        (
            {
                "signals.water_visibility": {
                    "kind": "step",
                    "time_s": 500.0,
                    "before": 1.0,
                    "after": 2.0,
                }
            },
            ["signals.water_visibility: 500 s is after the end"],
        ),
    ],
)
def test_what_comes_too_early_or_too_late(values, starts):
    loaded = load_scenario("extended" if "leak" in values else "seams2023")
    found = list(with_values(loaded, values).scenario.without_effect())
    assert len(found) == len(starts)
    assert all(one.startswith(start) for one, start in zip(found, starts, strict=True)), found


@pytest.mark.parametrize("name", ["seams2023", "release15", "planta_exp1", "extended"])
def test_all_of_the_shipped_scenarios_has_an_effect(name):
    assert not list(load_scenario(name).scenario.without_effect())


def test_a_campaign_tells_for_how_many_swept_values(caplog):
    run_campaign(
        "seams2023", ["none"], runs=1, sweep={"thruster_events.0.time_s": [10.0, 20.0, 31.0]}
    )
    (message,) = [each for each in caplog.messages if "no effect" in each]
    assert message.startswith(f"note: {EARLY}") and message.endswith(", at 2 of 3 swept values")


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        (
            "signals.water_visibility.period_s",
            "x",
            "signals.water_visibility.period_s: 'x' should be a number",
        ),
        ("default_modes", {"f_dock": "fd_dock"}, "default_modes.f_dock: there is no function"),
    ],
)
def test_a_value_given_in_python_is_not_blamed_on_the_scenario_s_file(path, value, told):
    with pytest.raises(InputError) as wrong:
        with_values(load_scenario("seams2023"), {path: value})
    assert wrong.value.file is None
    assert str(wrong.value).startswith(told)


@pytest.mark.parametrize("entry", ["1", "first", "-1", "\u0661", "1" * 5000])
def test_an_entry_that_a_list_does_not_have_is_refused(entry):
    with pytest.raises(InputError, match="entries are 0 to 0"):
        with_values(load_scenario("seams2023"), {f"thruster_events.{entry}.time_s": 3.0})


def test_a_value_that_is_replaced_by_a_wrong_one_is_told_by_its_key():
    with pytest.raises(InputError) as caught:
        with_values(load_scenario("seams2023"), {"mission.time_limit_s": -1.0})
    assert caught.value.place == "mission.time_limit_s"


def test_a_manager_whose_module_begins_like_another_manager_has_settings_of_its_own(write):
    path = write("mine.yaml", HEAD + "managers: {'bt.trees:Mine': {depth: 1}}\n")
    loaded = with_values(load_scenario(path), {"managers.bt.trees:Mine.depth": 2})
    assert loaded.manager_settings("bt.trees:Mine") == {"depth": 2}
    assert loaded.scenario.managers.bt == load_scenario("seams2023").scenario.managers.bt
