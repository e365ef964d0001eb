"""The exemplar's configuration files become ours, and nothing in them is dropped silently."""

import json
import re
from pathlib import Path

import pytest
import yaml

from suave_des.campaign.campaign import run_campaign
from suave_des.errors import InputError
from suave_des.exemplar.configurations import import_config
from suave_des.exemplar.keys import EXPERIMENT, PATHS, REVISIONS, is_read
from suave_des.scenario.loader import load_scenario
from tests.helpers import rows_of

UPSTREAM = Path(__file__).parents[1] / "data" / "exemplar"
MANAGERS = ("none", "random", "metacontrol", "bt", "bt_extended")
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
    water_visibility_threshold: [3.0, 2.0, 1.0]
    expected_altitude: [2.5, 1.5, 0.5]
    battery_limit: 0.3
"""
VISIBILITY = (
    "water_visibility_observer_node: {ros__parameters: {water_visibility_sec_shift: 20.5}}\n"
)
EVENTS = "thruster_monitor: {ros__parameters: {thruster_events: ['(1,failure,35)']}}\n"
RUNNER_15 = """\
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
LAST_EXPERIMENT = '{"num_runs": 20, "adaptation_manager": "metacontrol"}'
LINE_PATTERN = re.compile(r"^    (\w+):")


@pytest.fixture
def imported(write):
    """Imports files with these contents, writes the scenario (and the campaign), and gives what was
    imported.
    """

    def run(*contents, campaign=False, revision="1.5", **options):
        files = [write(f"given{number}.yaml", content) for number, content in enumerate(contents)]
        out, other = Path("scenario.yaml"), Path("campaign.yaml") if campaign else None
        result = import_config(
            files, out, managers=MANAGERS, campaign=other, revision=revision, **options
        )
        out.write_text(result.scenario)
        if other is not None:
            other.write_text(result.campaign)
        return result

    return run


def mine():
    """The scenario that was imported."""
    return load_scenario("scenario.yaml").scenario


def content_of(result) -> dict:
    return yaml.safe_load(result.campaign)


SAME_EVENTS = "thruster_monitor: {ros__parameters: {thruster_events: ['(1, failure, 35)', '(3,recovery,50.0)']}}\n"
"""Those of MISSION_2023, written otherwise."""


def refused(imported, *contents, **options) -> InputError:
    with pytest.raises(InputError) as caught:
        imported(*contents, **options)
    assert "\n" not in str(caught.value)
    return caught.value


def notes_about(result, words: str) -> list[str]:
    return [note for note in result.notes if words in note]


def revision_of_file(file: Path) -> str:
    """The revision that a file of the exemplar is of, by its name."""
    if file.name == "planta_runner_config.yml":
        return "1.4"
    return next((each for each in ("1.2", "1.3", "1.4", "1.5") if f"v{each}" in file.name), "2025")


NOT_READ = {"adapt_period", "f_generate_search_path_mode", "f_follow_pipeline_mode"}
"""Keys that files have although the code of their revision reads them elsewhere, or no longer."""


class TestUpstreamFiles:
    @pytest.mark.parametrize("file", sorted(UPSTREAM.glob("*.y*ml")), ids=lambda file: file.name)
    def test_have_no_key_that_is_not_in_the_table_with_their_revision(self, file):
        content, revision = yaml.safe_load(file.read_text()), revision_of_file(file)
        keys = [
            (entry.removeprefix("/"), name, given)
            for entry, node in content.items()
            for name, given in node["ros__parameters"].items()
        ]
        named = {(node, name) for node, name, _ in keys}
        for *_, given in (each for each in keys if each[1] == "experiments"):
            named |= {(EXPERIMENT, name) for each in given for name in json.loads(each)}
        assert named <= PATHS.keys()
        unread = {name for node, name in named if not is_read(node, name, revision)}
        assert unread <= NOT_READ

    @pytest.mark.parametrize("file", sorted(UPSTREAM.glob("*.y*ml")), ids=lambda file: file.name)
    def test_import_with_every_key_read_or_named(self, imported, file):
        wanted = revision_of_file(file)
        is_runner = "runner_config" in file.name
        result = imported(file.read_text(), campaign=is_runner, revision=wanted)
        text = "\n".join((result.scenario, result.campaign or "", *result.notes))
        assert mine().revision.name == wanted
        for line, content in enumerate(file.read_text().splitlines(), start=1):
            if key := LINE_PATTERN.match(content):
                places = (
                    f"given0.yaml, line {line}:",
                    f"given0.yaml: line {line},",
                    f"(given0.yaml, line {line})",
                )
                assert any(place in text for place in places), key[1]
        assert not notes_about(result, "unknown")

    @pytest.mark.parametrize(
        ("files", "revision"),
        [
            (["v1.5.0_mission_config.yaml"], "1.5"),
            (["d5e97be_mission_config.yaml", "v1.5.0_runner_config.yml"], None),
            (["v1.4.0_mission_config.yaml"], "fit revisions 1.3, 1.4, 2025 of"),
            (
                ["v1.4.0_mission_config.yaml", "v1.4.0_runner_config.yml"],
                "fit revisions 1.4, 2025 of",
            ),
            (["v1.2.1_mission_config.yaml"], "fit revisions 1.2, 1.3, 1.4, 2025, 1.5 of"),
            (["v1.5.0_runner_config.yml"], "1.5"),
        ],
    )
    def test_tell_their_revision_where_they_can(self, imported, files, revision):
        texts = [(UPSTREAM / file).read_text() for file in files]
        if revision in REVISIONS:
            assert imported(*texts, revision=None).loaded.scenario.revision.name == revision
        else:
            assert (revision or "no revision of the exemplar has all of") in str(
                refused(imported, *texts, revision=None)
            )


class TestValues:
    def test_of_a_mission_of_2023_are_those_of_the_loaded_scenario(self, imported):
        assert imported(MISSION_2023, revision=None).base == "seams2023"
        scenario = mine()
        assert scenario.revision.name == "2023"
        assert scenario.mission.time_limit_s == 240
        assert scenario.default_modes["f_generate_search_path"] == "fd_spiral_medium"
        visibility = scenario.signals["water_visibility"]
        assert visibility.publishing_period_s == 0.4
        assert (
            visibility.period_s,
            visibility.minimum,
            visibility.maximum,
            visibility.shift_s,
        ) == (100, 1, 3, 20.5)
        events = [(each.thruster, each.event, each.time_s) for each in scenario.thruster_events]
        assert events == [(1, "failure", 35), (3, "recovery", 50)]

    def test_of_revision_15_too(self, imported):
        assert imported(MISSION_15, revision=None).base == "release15"
        scenario = mine()
        assert scenario.managers.random.adaptation_period_s == 25
        assert scenario.default_modes["f_generate_search_path"] == "fd_spiral_high"
        assert (scenario.battery.discharge_time_s, scenario.battery.publishing_period_s) == (150, 2)
        metric = scenario.reaction_metric
        assert metric.visibility_thresholds_m == (3, 2, 1)
        assert metric.expected_altitudes_m == (2.5, 1.5, 0.5)
        assert metric.battery_limit == 0.3

    @pytest.mark.parametrize(
        ("revision", "period_s", "has_battery"),
        [("2023", 100, False), ("1.2", 100, False), ("1.3", 150, True), ("1.4", 150, True), ("2025", 150, True),
         ("1.5", 150, True)],
    )  # fmt: skip
    def test_that_are_not_in_the_files_are_what_the_exemplar_s_nodes_do_without(
        self, imported, revision, period_s, has_battery
    ):
        result = imported("mission_node: {ros__parameters: {time_limit: 200}}\n", revision=revision)
        scenario = mine()
        assert (scenario.revision.name, scenario.mission.time_limit_s) == (revision, 200)
        assert scenario.thruster_events == ()  # the base's failure is not the user's
        visibility = scenario.signals["water_visibility"]
        assert (visibility.publishing_period_s, visibility.period_s, visibility.shift_s) == (
            0.2,
            period_s,
            0,
        )
        assert (visibility.minimum, visibility.maximum) == (1.25, 3.75)
        assert scenario.default_modes["f_generate_search_path"] == "fd_spiral_low"
        assert scenario.managers.random.adaptation_period_s == 15
        assert scenario.managers.metacontrol.reasoning_period_s == (
            2 if revision in ("2023", "1.2") else 1.5
        )
        assert (scenario.start.x_m, scenario.start.y_m) == (-17, 2)
        assert (scenario.battery is not None) == has_battery
        assert notes_about(result, "thruster_monitor: thruster_events")

    def test_of_a_mission_stay_the_base_s_where_no_mission_is_configured(self, imported):
        imported("any_reasoner: {ros__parameters: {reasoning_period: 4.0}}\n")
        scenario, base = mine(), load_scenario("release15").scenario
        assert scenario.managers.metacontrol.reasoning_period_s == 4
        same = {"name", "description", "managers"}
        assert scenario.model_dump(exclude=same) == base.model_dump(exclude=same)

    def test_may_be_given_to_every_node(self, imported):
        imported(
            "/**: {ros__parameters: {time_limit: 120, discharge_time: 90.0, use_sim_time: true}}\n"
        )
        assert (mine().mission.time_limit_s, mine().battery.discharge_time_s) == (120, 90)

    def test_given_to_every_node_reach_each_that_has_the_name(self, imported):
        result = imported(
            "/**: {ros__parameters: {qa_publishing_period: 0.7, f_generate_search_path_mode: fd_spiral_high}}\n"
        )
        visibility, battery = mine().signals["water_visibility"], mine().battery
        assert (visibility.publishing_period_s, battery.publishing_period_s) == (0.7, 0.7)
        # That mission_node no longer reads the mode is no news: task_bridge does.
        assert mine().default_modes["f_generate_search_path"] == "fd_spiral_high"
        assert not notes_about(result, "**")

    def test_of_a_node_of_its_own_count_over_those_of_every_node(self, imported):
        every = "/**: {ros__parameters: {qa_publishing_period: 0.7}}\n"
        result = imported(
            f"{every}/battery_monitor: {{ros__parameters: {{qa_publishing_period: 2.0}}}}\n"
        )
        visibility, battery = mine().signals["water_visibility"], mine().battery
        assert (visibility.publishing_period_s, battery.publishing_period_s) == (0.7, 2)
        assert notes_about(result, "the node's value counts (given0.yaml: line 2, battery_monitor")

    def test_given_to_every_node_of_a_mission_are_not_the_runner_s(self, imported):
        imported("/**: {ros__parameters: {water_visibility_sec_shift: 20.0, gui: true}}\n")
        assert mine().signals["water_visibility"].shift_s == 20

    def test_given_to_every_node_of_a_runner_s_file_are_the_runner_s_too(self, imported):
        runner = RUNNER_15.replace("    water_visibility_sec_shift: 0\n", "")
        result = imported(
            runner + "/**: {ros__parameters: {water_visibility_sec_shift: 7.0}}\n", campaign=True
        )
        drawn = content_of(result)["perturbations"]["signals.water_visibility.shift_s"]
        assert (drawn["minimum"], drawn["maximum"]) == (-33, 47)

    def test_given_to_every_node_without_one_that_has_the_name_are_told(self, imported):
        result = imported("/**: {ros__parameters: {time_limit: 120, time_limits: 3}}\n")
        (note,) = notes_about(result, "time_limits")
        assert (
            note
            == "given0.yaml: line 1, **: not imported: time_limits: no node of this file has it"
        )

    @pytest.mark.parametrize("time_s", ["-5.5", "-.5", "-5e+1", "-0"])
    def test_of_events_before_the_start_are_at_the_start(self, imported, time_s):
        text = f"thruster_monitor: {{ros__parameters: {{thruster_events: ['(1,failure,{time_s})', '', '(2,failure,3)']}}}}\n"
        imported(text)
        assert [each.time_s for each in mine().thruster_events] == [0, 3]

    def test_of_an_event_are_at_its_own_line_though_there_is_an_empty_one_before(self, imported):
        events = "      - '(1,failure,5)'\n      - ''\n      - '(9,failure,3)'\n"
        text = f"thruster_monitor:\n  ros__parameters:\n    thruster_events:\n{events}"
        assert refused(imported, text).place.startswith("line 6, ")

    def test_each_say_where_they_come_from(self, imported):
        lines = imported(MISSION_2023, revision=None).scenario.splitlines()
        line = next(line for line in lines if "period_s: 100" in line)
        assert line.endswith(
            "# given0.yaml, line 10: water_visibility_observer_node.water_visibility_period"
        )

    @pytest.mark.parametrize("revision", REVISIONS)
    @pytest.mark.parametrize("key", ["adapt_period", "adaptation_period"])
    def test_the_adaptation_period_has_its_revisions_key(self, imported, revision, key):
        node = "random_reasoner_node" if revision == "2023" else "task_bridge"
        result = imported(f"{node}: {{ros__parameters: {{{key}: 30}}}}\n", revision=revision)
        is_read = (revision == "1.5") == (key == "adapt_period")
        assert bool(notes_about(result, f"{node}.{key}: not imported")) != is_read
        assert mine().managers.random.adaptation_period_s == (30 if is_read else 15)

    @pytest.mark.parametrize("first", [0, 1])
    def test_task_bridge_alone_sets_the_modes_where_there_is_one(self, imported, first):
        files = [
            MISSION_15,
            "mission_node: {ros__parameters: {f_generate_search_path_mode: fd_spiral_low}}\n",
        ]
        result = imported(files[first], files[1 - first])
        (note,) = notes_about(result, "mission_node.f_generate_search_path_mode")
        assert "revision 1.5 reads task_bridge.f_generate_search_path_mode" in note
        assert mine().default_modes["f_generate_search_path"] == "fd_spiral_high"


CURRENT = "water_current: {ros__parameters: {mean: 0.1, amplitude: 0.05, period: 60, sec_shift: 4, direction: 1.5}}\n"


class TestCurrent:
    """HEAD's runner switches a current on."""

    def with_switch(self, imported, switch, current=CURRENT):
        runner = RUNNER_15.replace("    random_seed", f"{switch}    random_seed")
        return imported(runner + current, revision=None)

    def test_of_head_is_a_wave(self, imported):
        result = self.with_switch(imported, "    enable_water_current: true\n")
        wave = mine().current.wave
        assert (wave.mean_m_per_s, wave.amplitude_m_per_s) == (0.1, 0.05)
        assert (wave.period_s, wave.shift_s, wave.direction_rad) == (60, 4, 1.5)
        assert notes_about(result, "water_current.mean: read as current.wave.mean_m_per_s")

    def test_of_a_mission_s_file_needs_no_switch(self, imported):
        result = imported(CURRENT, revision=None)
        assert (result.why, mine().current.wave.period_s) == (
            "only revision 1.5 has water_current",
            60,
        )

    def test_of_a_mission_s_file_leaves_all_else_as_the_base_has_it(self, imported):
        imported(CURRENT, revision=None)
        same = {"name", "description", "current"}
        base = load_scenario("release15").scenario
        assert mine().model_dump(exclude=same) == base.model_dump(exclude=same)

    @pytest.mark.parametrize("switch", ["    enable_water_current: false\n", ""])
    def test_that_is_not_switched_on_is_told(self, imported, switch):
        result = self.with_switch(imported, switch)
        assert mine().current.wave is None
        assert len(notes_about(result, "enable_water_current is not true")) == 5

    @pytest.mark.parametrize(
        ("switch", "current", "place", "problem"),
        [
            (
                "true",
                CURRENT.replace("mean", "speed"),
                "line 19, water_current.speed",
                "known keys",
            ),
            ("true", "", "line 6, suave_runner_node.enable_water_current", "known keys"),
            ("often", CURRENT, "line 6, suave_runner_node.enable_water_current", "not a boolean"),
        ],
    )
    def test_that_cannot_be_read_is_refused(self, imported, switch, current, place, problem):
        with pytest.raises(InputError, match=problem) as caught:
            self.with_switch(imported, f"    enable_water_current: {switch}\n", current)
        assert caught.value.place == place


class TestRevision:
    def test_that_cannot_be_is_refused(self, imported):
        assert "2024" in refused(imported, MISSION_15, revision="2024").problem
        assert (
            "has all of random_reasoner_node"
            in refused(imported, MISSION_2023, MISSION_15, revision=None).problem
        )


class TestWithoutCounterpart:
    @pytest.mark.parametrize(
        ("text", "words", "why"),
        [
            (MISSION_2023, "mission_node.result_path (given0.yaml, line 4)", "not needed here"),
            (
                "task_bridge: {ros__parameters: }\nmisson_node: {ros__parameters: {time_limit: 3}}\n",
                "line 2, misson_node",
                "time_limit: the node is not known (did you mean 'mission_node'",
            ),
            (
                "mission_node: {ros__parameters: {}, more: 1}\n",
                "line 1, mission_node",
                "more: ROS 2 reads",
            ),
            (RUNNER_15, "random_seed", "--campaign FILE"),
            (
                RUNNER_15.replace("/opt/ros/mission.yaml", "other.yaml"),
                "mission_config_file",
                "none of the files given",
            ),
            (RUNNER_15.replace("run_duration", "run_durtion"), "run_durtion", "unknown key"),
        ],
    )
    def test_is_told(self, imported, text, words, why):
        result = imported(text)
        (note,) = [note for note in notes_about(result, words) if why in note]
        assert f"#   {note}" in result.scenario

    def test_two_modes_files_are_one_too_many(self, imported, shipped_modes):
        changed = shipped_modes.replace("spiral_altitude: 3.0", "spiral_altitude: 2.75")
        imported(MISSION_15, changed)
        modes = load_scenario("scenario.yaml").modes
        assert (
            modes.mode("f_generate_search_path", "fd_spiral_high").parameters["spiral_altitude"]
            == 2.75
        )
        assert "two System Modes files" in refused(imported, shipped_modes, changed).problem


class TestCampaign:
    def test_has_what_the_runner_is_told(self, imported):
        def drawn(minimum, maximum, **more):
            return {"distribution": "uniform", "minimum": minimum, "maximum": maximum, **more}

        assert content_of(imported(RUNNER_15, MISSION_15, campaign=True)) == {
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
        assert [each.time_s for each in mine().thruster_events] == [35, 60]
        assert mine().start.x_m == -17

    def test_can_be_run(self, imported, command):
        runner = RUNNER_15.replace('"num_runs": 20', '"num_runs": 6').replace(
            '"metacontrol"', '"bt"'
        )
        imported(runner, MISSION_15.replace("300.0", "60.0"), campaign=True)
        assert command("campaign", "campaign.yaml", "--workers", "1", "--out", "out").status == 0
        rows = rows_of(Path("out"))
        assert [row["manager"] for row in rows] == ["none"] * 6 + ["bt"] * 6
        first, second = (
            [float(row[f"thruster_events.{event}.time_s"]) for row in rows] for event in (0, 1)
        )
        assert [
            later - sooner for sooner, later in zip(first, second, strict=True)
        ] == pytest.approx([25] * 12)
        drawn = [
            tuple(row[key] for key in ("start.x_m", "start.y_m", "thruster_events.1.time_s"))
            for row in rows
        ]
        assert drawn[:6] == drawn[6:]  # all managers meet the same
        assert len({*drawn[:5]}) == 1 and drawn[5] != drawn[4]  # five runs in a row share a draw
        assert all(
            -18 <= float(x) <= -16 and 1.5 <= float(y) <= 2.5 and 55 <= float(t) <= 75
            for x, y, t in drawn
        )

    @pytest.mark.parametrize("own", ["    water_visibility_sec_shift: 7\n", ""])
    def test_the_runner_s_shift_replaces_the_mission_s_with_or_without_a_value(self, imported, own):
        runner = RUNNER_15.replace("    water_visibility_sec_shift: 0\n", own)
        result = imported(VISIBILITY, runner, campaign=True)
        at = 7 if own else 0
        drawn = content_of(result)["perturbations"]["signals.water_visibility.shift_s"]
        assert (drawn["minimum"], drawn["maximum"]) == (at - 40, at + 40)
        assert mine().signals["water_visibility"].shift_s == at
        assert notes_about(result, "water_visibility_sec_shift: not imported")

    def test_the_runner_s_events_count_over_the_mission_s_if_it_has_some(self, imported):
        result = imported(EVENTS, RUNNER_15.replace('"(1,failure,35)", ', ""), campaign=True)
        assert notes_about(result, "the campaign's value counts")
        assert [each.thruster for each in mine().thruster_events] == [2]

    def test_an_interval_without_events_of_the_runner_shifts_nothing(self, imported):
        runner = RUNNER_15.replace(
            '    thruster_events: ["(1,failure,35)", "(2,failure,60)"]\n', ""
        )
        result = imported(EVENTS, runner, campaign=True)
        assert [each.time_s for each in mine().thruster_events] == [35]
        assert notes_about(result, "shifts nothing")
        assert not [key for key in content_of(result)["perturbations"] if "thruster" in key]

    @pytest.mark.parametrize(
        ("old", "new", "place", "words"),
        [
            (
                "random_seed: 100",
                "random_seed: many",
                "line 6, ",
                "random_seed: 'many' should be a whole number",
            ),
            ("[-40, 40]", "[40, -40]", "line 9, ", "the beginning 40 is above the end -40"),
            (
                LAST_EXPERIMENT,
                '{"adaptation_manager": "bt"}',
                "line 17, ",
                "experiments[1].num_runs: is missing",
            ),
            (
                "(2,failure,60)",
                "(2,failure)",
                "line 10, thruster_events[1]",
                "not a thruster event",
            ),
        ],
    )
    def test_that_cannot_be_right_is_refused(self, imported, old, new, place, words):
        text = RUNNER_15.replace(old, new)
        assert text != RUNNER_15
        error = refused(imported, text, campaign=True)
        assert error.place.startswith(place)
        assert words in str(error)

    def test_cuts_events_at_the_start_only_once_they_are_shifted(self, imported):
        runner = RUNNER_15.replace("(1,failure,35)", "(1,failure,-4)")
        drawn = content_of(imported(runner, campaign=True))["perturbations"]
        assert mine().thruster_events[0].time_s == 0
        first = drawn["thruster_events.0.time_s"]
        assert (first["minimum"], first["maximum"]) == (-9, 11)

    def test_tells_an_event_that_no_shift_brings_after_the_start(self, imported):
        runner = RUNNER_15.replace("(1,failure,35)", "(1,failure,-15.5)")
        result = imported(runner, campaign=True)
        assert "thruster_events.0.time_s" not in content_of(result)["perturbations"]
        assert notes_about(result, "thruster_events.0.time_s is always before the start")

    def test_of_two_files_must_not_contradict(self, imported):
        other = RUNNER_15.replace("random_seed: 100", "random_seed: 101")
        error = refused(imported, RUNNER_15, other, campaign=True)
        assert (error.file, error.place) == ("given1.yaml", "line 6, suave_runner_node.random_seed")

    def test_may_be_in_two_files(self, imported):
        first, experiments = RUNNER_15.split("    experiments:")
        second = f"suave_runner_node:\n  ros__parameters:\n    experiments:{experiments}"
        content = content_of(imported(first, second, campaign=True))
        assert (content["managers"], content["seed"]) == (["none", "metacontrol"], 100)

    def test_needs_a_runner_with_experiments(self, imported):
        assert "no node suave_runner_node" in refused(imported, MISSION_15, campaign=True).problem
        assert (
            "is missing"
            in refused(imported, RUNNER_15.split("    experiments")[0], campaign=True).problem
        )
        only = RUNNER_15.replace('"none"', '"a"').replace('"metacontrol"', '"b"')
        assert "none of its managers" in refused(imported, only, campaign=True).problem


class TestExperiments:
    """Launch and mission of each experiment belong to it alone."""

    def with_experiments(self, imported, *experiments, **options):
        listed = "".join(f"      - '{each}'\n" for each in experiments)
        return imported(RUNNER_15.split("      - ")[0] + listed, campaign=True, **options)

    @pytest.mark.parametrize(
        "of_the_first",
        ['"mission_name": "suave_extended"', '"experiment_launch": "ros2 launch suave_bt suave_bt_extended.launch.py"',
         '"experiment_launch": "ros2 launch b m.launch.py bt_executable:=suave_bt_extended"',
         '"experiment_launch": "ros2 launch b m.launch.py mission_name:=suave_extended"'],
    )  # fmt: skip
    def test_one_extended_mission_changes_no_other(self, imported, of_the_first):
        plain = '{"num_runs": 20, "adaptation_manager": "bt", "mission_name": "suave"}'
        extended = plain.replace('"mission_name": "suave"', of_the_first)
        for first, second, managers in (
            (extended, plain, ["bt_extended", "bt"]),
            (plain, plain, ["bt"]),
        ):
            assert (
                content_of(self.with_experiments(imported, first, second))["managers"] == managers
            )

    @pytest.mark.parametrize("numbers", [(5, 20), (20, 5)])
    def test_of_one_manager_give_it_the_greatest_number_of_missions(self, imported, numbers):
        given = [json.dumps({"num_runs": each, "adaptation_manager": "none"}) for each in numbers]
        assert content_of(self.with_experiments(imported, *given))["runs"] == 20

    @pytest.mark.parametrize(
        ("experiment", "words"),
        [
            ('{"num_runs": 20, "adaptation_manager": "rebet"}', "there is no manager 'rebet'"),
            ('{"num_runs": 20, "adaptation_manager": "none"}', "none is there already"),
            ('{"num_runs": 5, "adaptation_manager": "bt"}', "bt 5"),
            (
                '{"num_runs": 20, "adaptation_manager": "bt", "missing": 1}',
                "not simulated: missing: 1",
            ),
            (
                '{"num_runs": 20, "adaptation_manager": "bt", "experiment_launch": "l use_action_server:=true"}',
                "not simulated: use_action_server: 'true'",
            ),
            (
                '{"num_runs": 20, "adaptation_manager": "random", "mission_name": "suave_extended"}',
                "flies suave here",
            ),
        ],
    )
    def test_what_is_not_simulated_is_told(self, imported, experiment, words):
        result = self.with_experiments(
            imported, '{"num_runs": 20, "adaptation_manager": "none"}', experiment
        )
        assert notes_about(result, words)

    def test_only_the_second_mission_of_a_manager_is_left_out(self, imported):
        twice = [
            json.dumps({"num_runs": 20, "adaptation_manager": "random", "mission_name": mission})
            for mission in ("suave", "suave_extended")
        ]
        result = self.with_experiments(imported, *twice)
        assert notes_about(result, "random is there already")
        assert not notes_about(result, "flies suave here")

    def test_the_launch_says_which_manager_is_started(self, imported):
        launch = "ros2 launch suave_bringup mission.launch.py adaptation_manager:=random gui:=false"
        experiment = json.dumps(
            {"num_runs": 20, "adaptation_manager": "bt", "experiment_launch": launch}
        )
        result = self.with_experiments(imported, experiment)
        assert content_of(result)["managers"] == ["random"]
        assert notes_about(result, "its launch starts random, and not bt")
        assert not notes_about(result, "not simulated")

    def test_a_battery_constraint_of_all_ends_the_mission_below_its_level(self, imported):
        constraint = "l battery_constraint:=true battery_constraint_value:=0.4"
        limited = (
            '{"num_runs": 2, "adaptation_manager": "%s", "experiment_launch": "' + constraint + '"}'
        )
        imported_ = self.with_experiments(imported, limited % "none", limited % "bt")
        assert mine().battery.mission_ends_at_level == 0.4
        rows = run_campaign("campaign.yaml", ["none"]).frame()
        assert rows["mission_duration_s"].tolist() == pytest.approx(
            [120, 120], abs=1.5
        )  # 200 s from full to empty
        assert not notes_about(imported_, "battery_constraint")


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

    def test_gives_the_conditions_of_the_runs_of_2025(self, imported):
        # Six conditions of five runs each, as measured: kas-lab/suave_planta, exp1 (DOI
        # 10.5281/zenodo.15874043).
        content = content_of(imported(STUDY_OF_2025, campaign=True, runner_seed=100))
        assert (content["runs"], content["managers"]) == (5, ["none", "bt"])
        assert "perturbations" not in content
        values = content["sweep"]["zip"]
        assert [round(y_m, 3) for y_m in values["start.y_m"]] == [
            2.455,
            2.8,
            2.933,
            2.204,
            2.963,
            2.818,
        ]
        failures_s = [146.39, 91.19, 61.88, 69.40, 111.08, 24.82]
        for event in (0, 1):
            assert [
                round(time_s, 2) for time_s in values[f"thruster_events.{event}.time_s"]
            ] == failures_s

    def test_cuts_times_before_the_start(self, imported):
        study = STUDY_OF_2025.replace("(1,failure,100)", "(1,failure,-10)")
        times_s = content_of(imported(study, campaign=True, runner_seed=100))["sweep"]["zip"]
        # The shifts are 46.39, -8.81, -38.12, -30.60, 11.08, -75.18 s: see above.
        assert [round(time_s, 2) for time_s in times_s["thruster_events.0.time_s"]] == [
            *(36.39, 0, 0, 0, 1.08, 0)
        ]

    def test_tells_what_differs(self, imported):
        result = imported(STUDY_OF_2025.replace("30", "12"), campaign=True, runner_seed=100)
        assert notes_about(
            result, "the last of 3 conditions has 2 runs in the exemplar, and 5 here"
        )
        assert "--campaign" in refused(imported, STUDY_OF_2025, runner_seed=100).remedy


def mission_2023(old: str, new: str) -> str:
    """The mission of 2023 with another value."""
    assert MISSION_2023.count(old) == 1
    return MISSION_2023.replace(old, new)


class TestBadInput:
    @pytest.mark.parametrize(
        ("text", "place", "words"),
        [
            ("mission_node: [\n", "line 2", "not valid YAML"),
            (
                "mission_node: {time_limit: 300}\n",
                "line 1, mission_node",
                "has no mapping ros__parameters",
            ),
            ("gazebo: {ros__parameters: {time_limit: 1}}\n", "line 1, gazebo", "nothing of SUAVE"),
            (
                "mission_node: {ros__parameters: {time_limit: abc}}\n",
                "line 1, mission.time_limit_s",
                "'abc'",
            ),
            (mission_2023("(3, rec", "(9, rec"), "line 16, thruster_events[1].", "to 6"),
            (
                mission_2023('["(1,failure,35)", "(3, recovery, 50.0)"]', "3"),
                "line 16, thruster_events",
                "a list",
            ),
            (
                mission_2023("_min: 1.0", "_min: 5.0"),
                "line 11, signals.water_visibility",
                "5 is above maximum 3",
            ),
            (
                mission_2023("spiral_med", "spirl_med"),
                "line 5, default_modes.f_gen",
                "did you mean 'fd_spiral_medium'",
            ),
        ],
    )
    def test_is_told_in_the_words_of_its_file(self, imported, text, place, words):
        error = refused(imported, text, revision="2023" if "reasoner" in text else "1.5")
        assert (error.file, error.place.startswith(place), words in str(error)) == (
            "given0.yaml",
            True,
            True,
        )

    @pytest.mark.parametrize(
        "text",
        ["run_batch:\n  - {manager: none}\n", "suave_cli: {a: 1}\n", "experiments: [{a: 1}]\n"],
        ids=["run_batch", "suave_cli", "run_batch or suave_cli"],
    )
    def test_files_of_several_experiments_are_told_by_what_they_are(self, imported, text, request):
        program = request.node.callspec.id
        problem = f"describes several experiments, for the exemplar's {program}"
        assert refused(imported, text).problem == problem

    def test_two_files_may_say_the_same(self, imported):
        limit = "parent_mission_node: {ros__parameters: {time_limit: 240.0}}\n"
        imported(MISSION_2023, SAME_EVENTS, limit)

    @pytest.mark.parametrize(
        "other",
        [
            "parent_mission_node: {ros__parameters: {time_limit: 300}}\n",
            SAME_EVENTS.replace("35", "36"),
        ],
        ids=["another limit", "another event"],
    )
    def test_a_file_must_not_contradict_another(self, imported, other):
        error = refused(imported, MISSION_2023, other)
        assert error.file == "given1.yaml"
        assert "contradicts given0.yaml: line" in error.problem


class TestCommand:
    @pytest.fixture
    def told(self, write, command) -> list[str]:
        """Lines of an import of two files into two others."""
        write("mission.yaml", MISSION_15)
        write("runner.yaml", RUNNER_15)
        write("sub/keep.txt", "")
        options = ("--out", "mine.yaml", "--campaign", "sub/campaign.yaml")
        status, out, _ = command("import-config", "mission.yaml", "runner.yaml", *options)
        assert status == 0
        return out.splitlines()

    @pytest.mark.usefixtures("told")
    def test_writes_a_scenario(self):
        assert load_scenario("mine.yaml").scenario.managers.random.adaptation_period_s == 25

    @pytest.mark.usefixtures("told")
    def test_writes_a_campaign_of_that_scenario(self):
        assert yaml.safe_load(Path("sub/campaign.yaml").read_text())["scenario"] == "../mine.yaml"

    def test_tells_what_is_written(self, told):
        assert told[-2].startswith(
            "mine.yaml is written, based on release15: only revision 1.5 has "
        )
        assert told[-1] == "sub/campaign.yaml is written"

    def test_tells_what_is_not_needed_here(self, told):
        assert any(
            "not needed here" in line and "mission_metrics.result_path" in line for line in told
        )

    @pytest.mark.parametrize(
        ("arguments", "problem"),
        [
            (["missing.yaml", "--out", "mine.yaml"], "no such file"),
            (["mission.yaml", "--out", "there.yaml"], "exists already"),
            (
                ["mission.yaml", "--out", "mission.yaml", "--overwrite"],
                "one of the other files, too",
            ),
            (
                ["mission.yaml", "--out", "nowhere/mine.yaml"],
                "nowhere/mine.yaml: there is no folder",
            ),
            (["mission.yaml", "--out", "."], "is a folder"),
            (
                ["runner.yaml", "--out", "mine.yaml", "--campaign", "mine.yaml"],
                "one of the other files, too",
            ),
            (["runner.yaml", "--out", "mine.yaml", "--campaign", "there.yaml"], "exists already"),
            (["mission.yaml"], "--out"),
            (["--out", "mine.yaml"], "FILE"),
        ],
    )
    def test_bad_input_is_refused_in_one_line(self, write, command, arguments, problem):
        for name, content in (
            ("mission.yaml", MISSION_15),
            ("runner.yaml", RUNNER_15),
            ("there.yaml", "kept"),
        ):
            write(name, content)
        status, out, error = command("import-config", *arguments)
        assert (status, out, len(error.splitlines())) == (2, "", 1)
        assert problem in error
        assert sorted(path.name for path in Path().iterdir()) == [
            "mission.yaml",
            "runner.yaml",
            "there.yaml",
        ]
        assert Path("there.yaml").read_text() == "kept"
