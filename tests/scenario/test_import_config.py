"""The exemplar's configuration files become ours, and nothing in them is dropped silently."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
import yaml

from suave_des.campaign.campaign import run_campaign
from suave_des.cli.main import main
from suave_des.errors import InputError
from suave_des.scenario.exemplar.files import ImportOptions
from suave_des.scenario.exemplar.importing import import_config
from suave_des.scenario.loader import load_scenario

MISSION_2023 = """\
/mission_node:
  ros__parameters:
    time_limit: 240
    result_path: "~/suave/results"
    f_generate_search_path_mode: fd_spiral_medium
    f_follow_pipeline_mode: fd_follow_pipeline
/water_visibility_observer_node:
  ros__parameters:
    qa_publishing_period: 0.4
    water_visibility_period: 100
    water_visibility_min: 1.0
    water_visibility_max: 3.0
    water_visibility_sec_shift: 20.5
/thruster_monitor:
  ros__parameters:
    thruster_events: ["(1,failure,35)", "(3, recovery, 50.0)"]
/random_reasoner_node:
  ros__parameters:
    adapt_period: 30
"""
TASK_BRIDGE_2023 = MISSION_2023.replace("random_reasoner_node", "task_bridge")
MISSION_15 = """\
mission_node:
  ros__parameters:
    time_limit: 300.0
task_bridge:
  ros__parameters:
    adapt_period: 25
    f_generate_search_path_mode: fd_spiral_high
battery_monitor:
  ros__parameters:
    discharge_time: 150.0
    qa_publishing_period: 2.0
mission_metrics:
  ros__parameters:
    result_path: "~/suave/results"
    water_visibiity_threshold: [3.0, 2.0, 1.0]
    expected_altitude: [2.5, 1.5, 0.5]
    battery_limit: 0.3
"""
RUNNER = """\
/suave_runner_node:
  ros__parameters:
    mission_config_file: /opt/ros/mission.yaml
    result_path: "~/suave/results"
    run_duration: 400
    random_seed: 100
    random_interval: 5
    water_visibility_sec_shift: 0
    water_visibility_sec_shift_random_interval: [-40, 40]
    thruster_events: ["(1,failure,35)", "(2,failure,60)"]
    thruster_events_random_interval: [-5.0, 15.0]
    initial_pos_x: -17.0
    initial_pos_x_random_interval: [-1.0, 1.0]
    initial_pos_y_random_interval: [-0.5, 0.5]
    experiments:
      - '{"experiment_launch": "ros2 launch x", "num_runs": 20, "adaptation_manager": "none", "mission_name": "suave"}'
      - '{"num_runs": 20, "adaptation_manager": "metacontrol"}'
"""
OTHER = MISSION_15.replace("mission_node", "other_node").replace("task_bridge", "another_node")
MANAGERS = ("none", "random", "metacontrol", "bt", "bt_extended")


@pytest.fixture
def imported(write):
    """Imports files with these contents, writes the scenario (and the campaign), and gives what was imported."""

    def run(*contents, campaign=False, revision="1.5", **options):
        if any("random_reasoner_node" in content for content in contents) or "base" in options:
            revision = None
        files = [write(f"given{number}.yaml", content) for number, content in enumerate(contents)]
        out, other = write("scenario.yaml", ""), write("campaign.yaml", "") if campaign else None
        wanted = ImportOptions(campaign=other, managers=MANAGERS, revision=revision, **options)
        result = import_config(files, out, wanted)
        out.write_text(result.scenario)
        if other is not None:
            other.write_text(result.campaign)
        return result

    return run


def refused(imported, *contents, **options) -> InputError:
    with pytest.raises(InputError) as caught:
        imported(*contents, **options)
    assert "\n" not in str(caught.value)
    assert caught.value.remedy
    return caught.value


def notes_about(result, key: str) -> list[str]:
    return [note for note in result.notes if key in note]


class TestValues:
    def test_of_a_mission_of_2023_are_those_of_the_loaded_scenario(self, imported) -> None:
        assert imported(MISSION_2023).base == "seams2023"
        scenario = load_scenario("scenario.yaml").scenario
        assert scenario.revision.name == "2023"
        assert scenario.mission.time_limit_s == 240
        assert scenario.default_modes["f_generate_search_path"] == "fd_spiral_medium"
        visibility = scenario.signals["water_visibility"]
        assert visibility.publishing_period_s == 0.4
        assert (visibility.period_s, visibility.minimum, visibility.maximum, visibility.shift_s) == (100, 1, 3, 20.5)
        events = [(each.thruster, each.event, each.time_s) for each in scenario.thruster_events]
        assert events == [(1, "failure", 35), (3, "recovery", 50)]

    def test_of_revision_15_too(self, imported) -> None:
        assert imported(MISSION_15).base == "release15"
        scenario = load_scenario("scenario.yaml").scenario
        assert scenario.revision.name == "1.5"
        assert scenario.managers.random.adaptation_period_s == 25
        assert scenario.default_modes["f_generate_search_path"] == "fd_spiral_high"
        assert (scenario.battery.discharge_time_s, scenario.battery.publishing_period_s) == (150, 2)
        metric = scenario.reaction_metric
        assert metric.visibility_thresholds_m == (3, 2, 1)
        assert metric.expected_altitudes_m == (2.5, 1.5, 0.5)
        assert metric.battery_limit == 0.3

    @pytest.mark.parametrize(
        ("revision", "search_mode", "has_battery"),
        [
            ("2023", "fd_spiral_low", False),
            ("1.2", "fd_spiral_medium", False),
            ("1.5", "fd_spiral_medium", True),
        ],
    )
    def test_that_are_not_in_the_files_are_what_the_exemplar_s_nodes_do_without(
        self, imported, revision, search_mode, has_battery
    ) -> None:
        result = imported("mission_node: {ros__parameters: {time_limit: 200}}\n", revision=revision)
        mine = load_scenario("scenario.yaml").scenario
        assert mine.mission.time_limit_s == 200
        assert mine.thruster_events == ()  # the base's failure at 35 s is not the user's
        visibility = mine.signals["water_visibility"]
        assert (visibility.publishing_period_s, visibility.period_s, visibility.shift_s) == (0.2, 100, 0)
        assert (visibility.minimum, visibility.maximum) == (1.25, 3.75)
        assert mine.default_modes["f_generate_search_path"] == search_mode
        assert mine.managers.random.adaptation_period_s == 15
        assert (mine.battery is not None) == has_battery
        assert notes_about(result, "thruster_monitor: thruster_events")

    def test_of_a_mission_stay_the_base_s_where_no_mission_is_configured(self, imported) -> None:
        imported("any_reasoner: {ros__parameters: {reasoning_period: 4.0}}\n")
        mine, base = load_scenario("scenario.yaml").scenario, load_scenario("release15").scenario
        assert mine.managers.metacontrol.reasoning_period_s == 4
        same = {"name", "description", "managers"}
        assert mine.model_dump(exclude=same) == base.model_dump(exclude=same)

    def test_may_be_given_to_every_node(self, imported) -> None:
        imported("/**: {ros__parameters: {time_limit: 120, discharge_time: 90.0, use_sim_time: true}}\n")
        mine = load_scenario("scenario.yaml").scenario
        assert (mine.mission.time_limit_s, mine.battery.discharge_time_s) == (120, 90)

    def test_of_events_before_the_start_are_at_the_start(self, imported) -> None:
        text = "thruster_monitor: {ros__parameters: {thruster_events: ['(1,failure,-5.5)', '', '(2,failure,3)']}}\n"
        assert notes_about(imported(text), "is before the start")
        assert [each.time_s for each in load_scenario("scenario.yaml").scenario.thruster_events] == [0, 3]

    def test_each_say_where_they_come_from(self, imported) -> None:
        lines = imported(MISSION_2023).scenario.splitlines()
        line = next(line for line in lines if "period_s: 100" in line)
        assert line.endswith("# given0.yaml, line 10: water_visibility_observer_node.water_visibility_period")

    def test_survive_awkward_numbers_and_names(self, imported) -> None:
        imported("mission_node: {ros__parameters: {time_limit: 1.5e2, 'odd\u00e9 # key': 1}}\n", OTHER)
        assert load_scenario("scenario.yaml").scenario.mission.time_limit_s == 150


class TestRevisions:
    @pytest.mark.parametrize("slash", ["", "/"])
    def test_a_node_may_lack_its_slash(self, imported, slash) -> None:
        imported(f"{slash}parent_mission_node: {{ros__parameters: {{time_limit: 123}}}}\n")
        assert load_scenario("scenario.yaml").scenario.mission.time_limit_s == 123

    @pytest.mark.parametrize(
        ("revision", "node"),
        [("2023", "random_reasoner_node"), ("1.2", "task_bridge"), ("2025", "task_bridge"), ("1.5", "task_bridge")],
    )
    def test_the_random_manager_s_period_is_read_in_15_alone(self, imported, revision, node) -> None:
        text = f"{node}: {{ros__parameters: {{adapt_period: 30}}}}\n"
        result = imported(text, revision=revision)
        is_read = revision == "1.5"
        notes = notes_about(result, f"{node}.adapt_period")
        assert not notes if is_read else "reads another parameter, adaptation_period" in notes[0]
        assert load_scenario("scenario.yaml").scenario.managers.random.adaptation_period_s == (30 if is_read else 15)

    def test_2025_builds_on_the_scenario_of_its_runs(self, imported) -> None:
        assert imported(MISSION_15, revision="2025").base == "planta_exp1"
        scenario = load_scenario("scenario.yaml").scenario
        assert scenario.revision.name == "2025"
        assert (scenario.start.y_m, scenario.signals["water_visibility"].kind) == (2.0, "sinusoid")
        assert scenario.battery is not None
        assert scenario.thruster_events == ()

    def test_until_14_event_times_count_from_the_event_before(self, imported) -> None:
        imported(MISSION_15, revision="1.4")
        revision = load_scenario("scenario.yaml").scenario.revision
        assert (revision.name, revision.monitors.thruster_event_times) == ("1.4", "after_previous")
        assert revision.follow == load_scenario("release15").scenario.revision.follow

    @pytest.mark.parametrize("first", [0, 1])
    def test_task_bridge_alone_sets_the_modes_where_there_is_one(self, imported, first) -> None:
        files = [MISSION_15, "mission_node: {ros__parameters: {f_generate_search_path_mode: fd_spiral_low}}\n"]
        result = imported(files[first], files[1 - first])
        (note,) = notes_about(result, "mission_node.f_generate_search_path_mode")
        assert "revision 1.5 reads that of task_bridge alone" in note
        assert load_scenario("scenario.yaml").scenario.default_modes["f_generate_search_path"] == "fd_spiral_high"

    @pytest.mark.parametrize(
        ("text", "fitting", "difference"),
        [
            (
                "mission_node: {ros__parameters: {time_limit: 3}}\n",
                "2023, 1.2, 1.3, 1.4, 2025 and 1.5",
                "mission_node (2023) or",
            ),
            (
                "task_bridge: {ros__parameters: {adapt_period: 3}}\n",
                "1.2, 1.3, 1.4, 2025 and 1.5",
                "adaptation_period (1.2, 2025) or",
            ),
            (MISSION_15, "1.4, 2025 and 1.5", "counts from the one before (1.4) or the start (2025, 1.5)"),
        ],
    )
    def test_where_several_fit_the_user_is_asked(self, imported, text, fitting, difference) -> None:
        error = refused(imported, text, revision=None)
        assert f"fit revisions {fitting} of the exemplar" in error.problem
        assert difference in error.problem
        assert "--revision 1.5" in error.remedy

    def test_that_do_not_fit_are_refused(self, imported) -> None:
        assert "2024" in refused(imported, MISSION_15, revision="2024").problem
        assert "in no revision" in refused(imported, MISSION_2023, MISSION_15).problem
        with pytest.raises(InputError, match="the base is of revision 2023, and not"):
            import_config([Path("given0.yaml")], Path("s.yaml"), ImportOptions(base="seams2023", revision="1.5"))

    def test_the_base_can_be_chosen(self, imported) -> None:
        assert imported(MISSION_2023, base="release15").base == "release15"
        scenario = load_scenario("scenario.yaml").scenario
        assert scenario.revision.name == "1.5"
        assert scenario.managers.random.adaptation_period_s == 30

    def test_an_own_base_is_named_relative_to_the_scenario(self, write, imported) -> None:
        base = write("below/mine.yaml", "base: release15\ncurrent: {x_m_per_s: 0.1}\n")
        assert imported(MISSION_15, base=str(base)).base == "below/mine.yaml"
        assert load_scenario("scenario.yaml").scenario.current.x_m_per_s == 0.1

    def test_every_mission_from_14_on_has_a_battery_and_none_before(self, imported) -> None:
        imported(MISSION_15.replace("battery_monitor", "thruster_monitor").replace("discharge_time: 150.0", ""))
        assert load_scenario("scenario.yaml").scenario.battery.discharge_time_s == 200
        assert notes_about(imported(MISSION_15, revision="1.3"), "revision 1.3 has no battery")
        assert load_scenario("scenario.yaml").scenario.battery is None


class TestWithoutCounterpart:
    @pytest.mark.parametrize(
        ("text", "key", "why"),
        [
            (MISSION_2023, "mission_node.result_path (given0.yaml, line 4)", "no counterpart, nor needed here"),
            (
                "mission_node: {ros__parameters: {time_limt: 3}}\n",
                "mission_node.time_limt",
                "did you mean 'time_limit'",
            ),
            (
                "task_bridge: {ros__parameters: }\nmisson_node: {ros__parameters: {time_limit: 3}}\n",
                "misson_node.time_limit",
                "mean 'mission_node'",
            ),
            ("task_bridge: {ros__parameters: }\ngazebo: {ros__parameters: }\n", "line 2, gazebo", "node is not known"),
            ("mission_node: {ros__parameters: {}, more: 1}\n", "mission_node.more", "beside ros__parameters"),
            (RUNNER, "suave_runner_node.random_seed", "--campaign FILE"),
        ],
    )
    def test_each_key_gets_one_line(self, imported, text, key, why) -> None:
        result = imported(text)
        (note,) = notes_about(result, key)
        assert why in note
        assert f"#   {note}" in result.scenario

    def test_those_without_a_meaning_here_get_one_line_together(self, imported) -> None:
        runner = RUNNER.replace(
            "    run_duration: 400\n", "    run_duration: 400\n    gui: false\n    experiment_logging: true\n"
        )
        result = imported(MISSION_15, runner, campaign=True)
        (note,) = notes_about(result, "nor needed here")
        for key in (
            "mission_metrics.result_path",
            "suave_runner_node.result_path",
            "run_duration",
            "gui",
            "experiment_log",
        ):
            assert key in note

    def test_every_key_of_the_files_is_taken_over_or_reported(self, imported) -> None:
        texts = TASK_BRIDGE_2023, OTHER, RUNNER
        result = imported(*texts)
        for number, text in enumerate(texts):
            for line, content in enumerate(text.splitlines(), start=1):
                if content.startswith("    ") and not content.startswith("     "):
                    file = f"given{number}.yaml"
                    told = (f"{file}, line {line}:", f"{file}: line {line},", f"({file}, line {line})")
                    assert any(place in result.scenario for place in told), content


class TestModesFile:
    def test_is_used_as_it_is(self, imported, write, shipped_modes) -> None:
        changed = shipped_modes.replace("spiral_altitude: 3.0", "spiral_altitude: 2.75")
        imported(MISSION_15, changed)
        loaded = load_scenario("scenario.yaml")
        assert loaded.modes.mode("f_generate_search_path", "fd_spiral_high").parameters["spiral_altitude"] == 2.75

    def test_two_are_one_too_many(self, imported, shipped_modes) -> None:
        changed = shipped_modes.replace("spiral_altitude: 3.0", "spiral_altitude: 2.75")
        error = refused(imported, shipped_modes, changed)
        assert "two System Modes files" in error.problem

    def test_must_have_the_modes_that_the_configuration_names(self, imported, shipped_modes) -> None:
        error = refused(imported, MISSION_15.replace("fd_spiral_high", "fd_spirl_high"), shipped_modes)
        assert error.file == "given0.yaml"
        assert error.place == "line 7, task_bridge.f_generate_search_path_mode"
        assert "did you mean 'fd_spiral_high'" in error.remedy


class TestCampaign:
    def content(self, imported, *texts) -> dict:
        return yaml.safe_load(imported(*texts, campaign=True).campaign)

    def test_has_what_the_runner_is_reported(self, imported) -> None:
        def drawn(minimum, maximum, **more):
            return {"distribution": "uniform", "minimum": minimum, "maximum": maximum, **more}

        assert self.content(imported, RUNNER, MISSION_15) == {
            "campaign": 1,
            "scenario": "scenario.yaml",
            "managers": ["none", "metacontrol"],
            "runs": 20,
            "seed": 100,
            "runs_per_draw": 5,
            "perturbations": {
                "signals.water_visibility.shift_s": drawn(-40, 40),
                "start.x_m": drawn(-18, -16),
                "start.y_m": drawn(1.5, 2.5),  # around the exemplar's own 2.0
                "thruster_events.0.time_s": drawn(30, 50, shared="thruster_events_shift"),
                "thruster_events.1.time_s": drawn(55, 75, shared="thruster_events_shift"),
            },
        }
        scenario = load_scenario("scenario.yaml").scenario
        assert [each.time_s for each in scenario.thruster_events] == [35, 60]
        assert scenario.start.x_m == -17

    def test_can_be_run(self, imported, tmp_path) -> None:
        runner = RUNNER.replace('"num_runs": 20', '"num_runs": 6').replace('"metacontrol"', '"bt"')
        imported(runner, MISSION_15.replace("300.0", "60.0"), campaign=True)
        with pytest.raises(SystemExit) as ended:
            main(["campaign", "campaign.yaml", "--workers", "1", "--out", "out"])
        assert ended.value.code == 0
        with Path("out/runs.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        assert [row["manager"] for row in rows] == ["none"] * 6 + ["bt"] * 6
        first, second = ([float(row[f"thruster_events.{event}.time_s"]) for row in rows] for event in (0, 1))
        assert [later - sooner for sooner, later in zip(first, second, strict=True)] == pytest.approx([25] * 12)
        drawn = [tuple(row[key] for key in ("start.x_m", "start.y_m", "thruster_events.1.time_s")) for row in rows]
        assert drawn[:6] == drawn[6:]  # all managers meet the same
        assert len({*drawn[:5]}) == 1 and drawn[5] != drawn[4]  # five runs in a row share a draw
        assert all(-18 <= float(x) <= -16 and 1.5 <= float(y) <= 2.5 and 55 <= float(t) <= 75 for x, y, t in drawn)

    def test_the_runner_s_values_count_over_the_mission_s(self, imported) -> None:
        result = imported(TASK_BRIDGE_2023, RUNNER, campaign=True)
        (note,) = notes_about(result, "given0.yaml: line 13")
        assert "the campaign's value counts" in note
        assert load_scenario("scenario.yaml").scenario.signals["water_visibility"].shift_s == 0

    def test_an_interval_without_its_value_is_around_the_mission_s(self, imported) -> None:
        runner = RUNNER.replace("    water_visibility_sec_shift: 0\n", "")
        drawn = self.content(imported, runner, TASK_BRIDGE_2023)["perturbations"]["signals.water_visibility.shift_s"]
        assert (drawn["minimum"], drawn["maximum"]) == (-19.5, 60.5)

    def test_nothing_random_gives_no_perturbations(self, imported) -> None:
        runner = "\n".join(
            line for line in RUNNER.splitlines() if "interval:" not in line or "random_interval: 5" in line
        )
        result = imported(runner, campaign=True)
        assert not {"perturbations", "runs_per_draw"} & set(yaml.safe_load(result.campaign))
        assert notes_about(result, "suave_runner_node.random_interval")

    @pytest.mark.parametrize(
        ("old", "new", "told"),
        [
            ('"adaptation_manager": "none"', '"adaptation_manager": "rebet"', "there is no manager 'rebet'"),
            ('"adaptation_manager": "none"', '"adaptation_manager": "metacontrol"', "metacontrol is there already"),
            ('"num_runs": 20, "adaptation_manager": "none"', '"num_runs": 5, "adaptation_manager": "none"', "none 5"),
            ('"mission_name": "suave"', '"missing": 1', "unknown key"),
            ("run_duration", "run_durtion", "unknown key"),
            ("/opt/ros/mission.yaml", "/opt/ros/other.yaml", "none of the files given"),
        ],
    )
    def test_what_does_not_fit_is_reported(self, imported, old, new, told) -> None:
        assert notes_about(imported(RUNNER.replace(old, new), campaign=True), told)

    @pytest.mark.parametrize(
        "named", ['"mission_name": "suave_extended"', '"experiment_launch": "x bt_executable:=suave_bt_extended"']
    )
    def test_of_the_extended_mission_has_a_battery_and_its_own_tree(self, imported, named) -> None:
        runner = RUNNER.replace('"adaptation_manager": "metacontrol"', f'"adaptation_manager": "bt", {named}')
        content = self.content(imported, runner, MISSION_15.replace("battery_monitor", "thruster_monitor"))
        assert content["managers"] == ["none", "bt_extended"]
        assert load_scenario("scenario.yaml").scenario.battery is not None

    def test_without_seed_and_interval_has_the_runner_s_defaults(self, imported) -> None:
        runner = RUNNER.replace("    random_seed: 100\n    random_interval: 5\n", "")
        content = self.content(imported, runner)
        assert (content["seed"], content["runs_per_draw"]) == (100, 5)

    def test_whose_shifts_reach_below_0_can_be_run(self, imported) -> None:
        runner = RUNNER.replace("[-5.0, 15.0]", "[-50.0, 15.0]").replace('"num_runs": 20', '"num_runs": 6')
        imported(runner.replace("random_interval: 5", "random_interval: 1"), campaign=True)
        rows = run_campaign("campaign.yaml", ["none"]).frame()
        assert rows["thruster_events.0.time_s"].min() == 0  # as the exemplar, which has it happen at the first tick
        assert rows["thruster_events.0.time_s"].max() > 0

    def test_is_not_there_without_a_runner(self, imported) -> None:
        error = refused(imported, MISSION_15, campaign=True)
        assert "no node suave_runner_node" in error.problem

    @pytest.mark.parametrize(
        ("old", "new", "place", "problem"),
        [
            ("random_seed: 100", "random_seed: many", "line 6, suave_runner_node.random_seed", "'many'"),
            ("random_interval: 5", "random_interval: 0", "line 7, suave_runner_node.random_interval", "0"),
            ("[-40, 40]", "[40, -40]", "line 9, ", "begins after its end"),
            ("[-40, 40]", "[-40]", "line 9, ", "is not an interval"),
            (
                '"num_runs": 20, "adaptation_manager": "none"',
                '"num_runs": "20"',
                "line 16, ",
                "expected a whole number, got '20'",
            ),
            (
                '{"num_runs": 20, "adaptation_manager": "metacontrol"}',
                "{num_runs: 20",
                "line 17, ",
                "not a JSON object",
            ),
            (
                '"num_runs": 20, "adaptation_manager": "metacontrol"',
                '"adaptation_manager": "bt"',
                "line 17, suave_runner_node.experiments[1].num_runs",
                "is missing",
            ),
            ("(2,failure,60)", "(2,failure)", "line 10, suave_runner_node.thruster_events", "not a thruster event"),
        ],
    )
    def test_that_cannot_be_right_is_refused(self, imported, old, new, place, problem) -> None:
        text = RUNNER.replace(old, new)
        assert text != RUNNER
        error = refused(imported, text, campaign=True)
        assert error.place.startswith(place)
        assert problem in error.problem

    def test_needs_experiments(self, imported) -> None:
        assert "no experiments" in refused(imported, RUNNER.split("    experiments")[0], campaign=True).problem
        only = RUNNER.replace('"none"', '"a"').replace('"metacontrol"', '"b"')
        assert "none of its managers" in refused(imported, only, campaign=True).problem


STUDY_OF_2025 = """\
suave_runner_node:
  ros__parameters:
    random_seed: 100
    random_interval: 5
    initial_pos_y: 2.5
    initial_pos_y_random_interval: [-0.5, 0.5]
    thruster_events: ["(1,failure,100)", "(3,failure,100)"]
    thruster_events_random_interval: [-100.0, 100.0]
    experiments:
      - '{"num_runs": 30, "adaptation_manager": "none"}'
      - '{"num_runs": 30, "adaptation_manager": "bt"}'
"""


class TestRunnerSeed:
    """The draws of the exemplar's own runner, as conditions of a campaign."""

    def test_gives_the_conditions_of_the_runs_of_2025(self, imported) -> None:
        # Six conditions of five runs each, as measured: kas-lab/suave_planta, exp1 (DOI 10.5281/zenodo.15874043).
        content = yaml.safe_load(imported(STUDY_OF_2025, campaign=True, runner_seed=100).campaign)
        assert (content["runs"], content["managers"]) == (5, ["none", "bt"])
        assert "perturbations" not in content
        values = content["sweep"]["zip"]
        assert [round(y_m, 3) for y_m in values["start.y_m"]] == [2.455, 2.8, 2.933, 2.204, 2.963, 2.818]
        failures_s = [146.39, 91.19, 61.88, 69.40, 111.08, 24.82]
        for event in (0, 1):
            assert [round(time_s, 2) for time_s in values[f"thruster_events.{event}.time_s"]] == failures_s

    def test_gives_a_campaign_that_runs(self, imported) -> None:
        imported(
            STUDY_OF_2025.replace("30", "4").replace("random_interval: 5", "random_interval: 2"),
            campaign=True,
            runner_seed=7,
        )
        frame = run_campaign("campaign.yaml").frame()
        assert frame.groupby("manager", observed=True).size().to_dict() == {"none": 4, "bt": 4}
        assert frame["start.y_m"].nunique() == 2

    def test_tells_where_the_last_condition_has_fewer_runs(self, imported) -> None:
        result = imported(STUDY_OF_2025.replace("30", "12"), campaign=True, runner_seed=100)
        assert notes_about(result, "the last of 3 conditions has 2 runs in the exemplar, and 5 here")

    def test_needs_a_campaign(self, imported) -> None:
        assert "--campaign" in refused(imported, STUDY_OF_2025, runner_seed=100).remedy

    def test_without_anything_random_is_reported(self, imported) -> None:
        text = "".join(line for line in STUDY_OF_2025.splitlines(True) if "_random_interval" not in line)
        assert notes_about(imported(text, campaign=True, runner_seed=100), "nothing is drawn at random")


class TestBadInput:
    @pytest.mark.parametrize(
        ("text", "place", "problem"),
        [
            ("mission_node: [\n", "line 2", "not valid YAML"),
            ("- 1\n", "line 1", "not a mapping"),
            ("mission_node: {time_limit: 300}\n", "line 1, mission_node", "no ros__parameters"),
            ("gazebo: {ros__parameters: {time_limit: 1}}\n", "line 1, gazebo", "nothing of SUAVE"),
            ("misson_node: {ros__parameters: {f: 1}}\n", "line 1, misson_node", "nothing of SUAVE"),
            ("{}\n", "line 1", "nothing of SUAVE"),
            ("mission_node: {ros__parameters: [1]}\n", "line 1, mission_node.ros__parameters", "not a mapping"),
            ("mission_node: {ros__parameters: {time_limit: abc}}\n", "line 1, mission_node.time_limit", "'abc'"),
            ("mission_node: {ros__parameters: {time_limit: '300'}}\n", "line 1, mission_node.time_limit", "'300'"),
            ("mission_node: {ros__parameters: {time_limit: true}}\n", "line 1, mission_node.time_limit", "true"),
            ("mission_node: {ros__parameters: {time_limit: 0}}\n", "line 1, mission_node.time_limit", "out of range"),
            ("mission_node: {ros__parameters: {time_limit: .nan}}\n", "line 1, mission_node.time_limit", "not finite"),
            (
                MISSION_2023.replace("(3, recovery, 50.0)", "(9, recovery, 50.0)"),
                "line 16, thruster_monitor.thruster_events[1].thruster",
                "out of range",
            ),
            (
                MISSION_2023.replace("(1,failure,35)", "1 failure 35"),
                "line 16, thruster_monitor.thruster_events[0]",
                "not a thruster event",
            ),
            (
                MISSION_2023.replace('["(1,failure,35)", "(3, recovery, 50.0)"]', '"(1,failure,35)"'),
                "line 16, thruster_monitor.thruster_events",
                "expected a list",
            ),
            (
                MISSION_2023.replace("water_visibility_min: 1.0", "water_visibility_min: 5.0"),
                "line 11, water_visibility_observer_node.water_visibility_min",
                "minimum 5 is above maximum 3",
            ),
            (
                MISSION_15.replace("[2.5, 1.5, 0.5]", "[2.5, 1.5]"),
                "line 16, mission_metrics.expected_altitude",
                "expected_altitudes_m 2",
            ),
        ],
    )
    def test_is_told_in_the_words_of_its_file(self, imported, text, place, problem) -> None:
        error = refused(imported, text)
        assert error.file == "given0.yaml"
        assert error.place.startswith(place)
        assert problem in error.problem

    @pytest.mark.parametrize(
        "other",
        [
            "mission_node: {ros__parameters: {time_limit: 300}}\n",
            "parent_mission_node: {ros__parameters: {time_limit: 300}}\n",
            "thruster_monitor: {ros__parameters: {thruster_events: ['(1,failure,36)', '(3,recovery,50.0)']}}\n",
        ],
    )
    def test_two_files_must_not_contradict(self, imported, other) -> None:
        error = refused(imported, MISSION_2023, other)
        assert error.file == "given1.yaml"
        assert "contradicts given0.yaml: line" in error.problem

    def test_two_files_may_say_the_same(self, imported) -> None:
        same = "thruster_monitor: {ros__parameters: {thruster_events: ['(1, failure, 35)', '(3,recovery,50.0)']}}\n"
        imported(MISSION_2023, same, "parent_mission_node: {ros__parameters: {time_limit: 240.0}}\n")

    def test_no_such_base(self, imported) -> None:
        assert "no such file" in refused(imported, MISSION_2023, base="seams2024").problem

    def test_cannot_be_its_own_base(self, imported) -> None:
        assert "own base" in refused(imported, MISSION_2023, base="scenario.yaml").problem


class TestCommand:
    def ended(self, *arguments: str) -> int:
        with pytest.raises(SystemExit) as ended:
            main(["import-config", *arguments])
        return ended.value.code

    def test_writes_scenario_and_campaign_and_tells_the_rest(self, write, capsys) -> None:
        write("mission.yaml", MISSION_15)
        write("runner.yaml", RUNNER)
        write("sub/keep.txt", "")
        arguments = ["mission.yaml", "runner.yaml", "--revision", "1.5"]
        arguments += ["--out", "mine.yaml", "--campaign", "sub/campaign.yaml"]
        assert self.ended(*arguments) == 0
        told = capsys.readouterr().out.splitlines()
        assert told[-2:] == [
            "mine.yaml is written, based on release15: as requested",
            "sub/campaign.yaml is written",
        ]
        assert any("no counterpart" in line and "mission_metrics.result_path" in line for line in told)
        assert load_scenario("mine.yaml").scenario.managers.random.adaptation_period_s == 25
        assert yaml.safe_load(Path("sub/campaign.yaml").read_text())["scenario"] == "../mine.yaml"

    @pytest.mark.parametrize(
        ("arguments", "problem"),
        [
            (["missing.yaml", "--out", "mine.yaml"], "no such file"),
            (["mission.yaml", "--out", "there.yaml"], "exists already"),
            (["mission.yaml", "--out", "mission.yaml", "--overwrite"], "one of the files to import"),
            (["mission.yaml", "--out", "nowhere/mine.yaml"], "no folder nowhere"),
            (["mission.yaml", "--out", "."], "is a folder"),
            (["runner.yaml", "--out", "mine.yaml", "--campaign", "mine.yaml"], "cannot be one file"),
            (["runner.yaml", "--out", "mine.yaml", "--campaign", "there.yaml"], "exists already"),
            (["mission.yaml"], "--out"),
            (["--out", "mine.yaml"], "FILE"),
        ],
    )
    def test_bad_input_is_one_line_and_nothing_is_written(self, write, capsys, arguments, problem) -> None:
        write("mission.yaml", MISSION_15)
        write("runner.yaml", RUNNER)
        write("there.yaml", "kept")
        assert self.ended(*arguments) == 2
        captured = capsys.readouterr()
        assert captured.out == ""
        assert len(captured.err.splitlines()) == 1
        assert problem in captured.err
        assert sorted(path.name for path in write("a", "").parent.iterdir()) == [
            "a",
            "mission.yaml",
            "runner.yaml",
            "there.yaml",
        ]
        assert Path("there.yaml").read_text() == "kept"

    def test_overwrite_replaces(self, write) -> None:
        write("mission.yaml", MISSION_15)
        write("there.yaml", "old")
        assert self.ended("mission.yaml", "--revision", "1.5", "--out", "there.yaml", "--overwrite") == 0
        assert load_scenario("there.yaml").scenario.revision.name == "1.5"
