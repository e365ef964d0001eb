"""Ways in which a scenario can be wrong: one line with file, line, key path, what is wrong, what would be right."""

import shutil

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.errors import InputError
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.yamlfile import read_yaml

HEAD = "base: seams2023.yaml\n"
VISIBILITY = HEAD + "signals:\n  water_visibility: "
WHOLE = "revision: 2023\nsignals:\n  water_visibility: "
EVENTS = HEAD + "thruster_events:\n  - "


def refused(write, content: str, **options: object) -> InputError:
    path = write("mine.yaml", content)
    with pytest.raises(InputError) as caught:
        load_scenario(path, **options)
    assert "\n" not in str(caught.value)
    assert caught.value.remedy
    return caught.value


@pytest.mark.parametrize(
    ("content", "place", "problem", "remedy"),
    [
        # keys
        (HEAD + "misson: {}\n", "line 2, misson", "unknown key 'misson'", "did you mean 'mission'?"),
        (VISIBILITY + "{perod_s: 3}\n", "line 3, signals.water_visibility.perod_s", "unknown key", "mean 'period_s'?"),
        (
            WHOLE + "{kind: sinusoid, perod_s: 80, minimum: 1, maximum: 2}\n",
            "line 3, signals.water_visibility.perod_s",
            "unknown key",
            "and 1 more",
        ),
        (
            WHOLE + "{kind: sinusoid, minimum: 1, maximum: 2}\n",
            "line 3, signals.water_visibility.period_s",
            "is missing",
            "add it",
        ),
        (HEAD + "start: {x: 1}\nfoo: 1\nbar: 2\n", "line 2, start.x", "unknown key 'x'", "and 2 more"),
        ("signals: {}\n", "line 1, signals", "no signal named water_visibility", "add it"),
        ("revision: 2023\n", "line 1, signals", "is missing", "add it"),
        (
            WHOLE + "{kind: constant, value: 2}\n  my sea: {kind: constant, value: 1}\n",
            "line 4, ",
            "'my sea'",
            "letters",
        ),
        (HEAD + "name: my scenario\n", "line 2, name", "'my scenario' is not a valid name", "use letters, digits"),
        (HEAD + "name: 15\n", "line 2, name", "expected text, got 15", "quotes"),
        # keys in the wrong place
        (HEAD + "time_limit_s: 300\n", "line 2, time_limit_s", "unknown key 'time_limit_s'", "belongs under mission"),
        (HEAD + "reasoning_period_s: 1\n", "line 2, ", "unknown key", "it belongs under managers.metacontrol"),
        (HEAD + "mission: {signals: {}}\n", "line 2, mission.signals", "unknown key", "belongs at the top level"),
        (HEAD + "start: {time_limit_s: 3}\n", "line 2, start.time_limit_s", "unknown key", "belongs under mission"),
        (HEAD + "acceptance_m: 3\n", "line 2, ", "unknown", "under revision.spiral or under revision.follow"),
        (HEAD + "period_s: 3\n", "line 2, period_s", "unknown key", "under signals.NAME"),
        (HEAD + "thruster: 3\n", "line 2, thruster", "unknown key", "belongs under thruster_events[]"),
        (HEAD + "poll_period_s: 3\n", "line 2, ", "unknown", "under revision.coordinator or under revision.follow"),
        (HEAD + "minimum: 3\n", "line 2, minimum", "unknown key 'minimum'", "belongs under signals.NAME"),
        # numbers
        (HEAD + "start: {x_m: .inf}\n", "line 2, start.x_m", ".inf is not finite", "give a finite number"),
        (HEAD + "mission: {time_limit_s: -.INF}\n", "line 2, ", "-.inf is not finite", "give a finite number"),
        (HEAD + "knowledge: {values: {qa: .NaN}}\n", "line 2, knowledge.values.qa", ".nan is not finite", "finite"),
        (HEAD + "pipeline: {points_per_piece: .inf}\n", "line 2, ", "expected a whole number, got .inf", "such as 3"),
        (VISIBILITY + "{noise: {distribution: normal, mean: 0, std: .nan}}\n", "line 3, ", ".nan is not", "finite"),
        (VISIBILITY + "{period_s: -80}\n", "line 3, signals.water_visibility.period_s", "-80", "at least 0.001"),
        (VISIBILITY + "{period_s: 0}\n", "line 3, signals.water_visibility.period_s", "0 is out of", "at least 0.001"),
        (VISIBILITY + "{period_s: '80'}\n", "line 3, ", "expected a number, got '80'", "without quotes"),
        (VISIBILITY + "{period_s: true}\n", "line 3, ", "expected a number, got true", "such as"),
        (VISIBILITY + "{period_s: }\n", "line 3, ", "expected a number, got nothing", "such as"),
        (VISIBILITY + "{publishing_period_s: 0}\n", "line 3, ", "0 is out of range", "at least 0.001"),
        (HEAD + "mission: {time_limit_s: 1e9}\n", "line 2, mission.time_limit_s", "out of range", "at most 100000"),
        (HEAD + "mission: {time_limit_s: " + "9" * 400 + "}\n", "line 2, ", ".inf is not finite", "finite"),
        (
            HEAD + "pipeline: {points_per_piece: 2.5}\n",
            "line 2, pipeline.",
            "expected a whole number, got 2.5",
            "such as 3",
        ),
        (
            HEAD + "knowledge: {values: {qa: much}}\n",
            "line 2, knowledge.values.qa",
            "expected a number, got 'much'",
            "such as",
        ),
        # minimum and maximum
        (
            VISIBILITY + "{minimum: 9}\n",
            "line 3, signals.water_visibility.minimum",
            "minimum 9 is above maximum 3.75",
            "smaller one",
        ),
        (
            VISIBILITY + "{maximum: 0}\n",
            "line 3, signals.water_visibility.maximum",
            "minimum 1.25 is above maximum 0",
            "smaller one",
        ),
        # kinds of signals
        (VISIBILITY + "{kind: sinus}\n", "line 3, signals.water_visibility", "'sinus'", "did you mean 'sinusoid'?"),
        (VISIBILITY + "{kind: [sinusoid]}\n", "line 3, ", "kind ['sinusoid'] is not known", "sinusoid, constant"),
        (
            VISIBILITY + "7\n",
            "line 3, signals.water_visibility",
            "expected a mapping of keys to values, got 7",
            "kind: sinusoid, constant",
        ),
        (WHOLE + "{period_s: 80}\n", "line 3, signals.water_visibility", "kind is missing", "add kind: sinusoid"),
        (
            VISIBILITY + "{kind: table, file: t.csv, interpolation: spline}\n",
            "line 3, ",
            "'spline'",
            "previous, linear",
        ),
        # distributions
        (
            HEAD + "start: {x_m: {distribution: gauss}}\n",
            "line 2, start.x_m",
            "'gauss' is not known",
            "normal, uniform",
        ),
        (HEAD + "start: {x_m: {mean: 3}}\n", "line 2, start.x_m", "distribution is missing", "give a number, or"),
        (HEAD + "start: {x_m: [3]}\n", "line 2, start.x_m", "expected a number, got [3]", "or a distribution"),
        (HEAD + "start: {x_m: far}\n", "line 2, start.x_m", "expected a number, got 'far'", "or a distribution"),
        (
            HEAD + "start:\n  x_m:\n    distribution: uniform\n    minimum: 3\n    maximum: 1\n",
            "line 5, start.x_m.minimum",
            "minimum 3 is above maximum 1",
            "smaller",
        ),
        (
            HEAD + "start: {x_m: {distribution: normal, mean: 0, std: -1}}\n",
            "line 2, start.x_m.std",
            "-1 is out",
            "at least 0",
        ),
        (
            HEAD + "start: {x_m: {distribution: normal, mean: 0, std: 1, minimum: 9}}\n",
            "line 2, start.x_m.minimum",
            "leaves next to nothing",
            "move or widen",
        ),
        (HEAD + "start: {x_m: {distribution: choice, values: []}}\n", "line 2, start.x_m.values", "has 0 entries", "1"),
        (
            HEAD + "start: {z_m: -20}\n",
            "line 2, start.z_m",
            "-20 is out of range",
            "greater than -20 and at most 0 m, between sea bed and surface",
        ),
        (HEAD + "start: {z_m: -25}\n", "line 2, start.z_m", "-25 is out of range", "greater than -20 and at most 0 m"),
        (
            HEAD + "start: {z_m: {distribution: uniform, minimum: -3, maximum: 2}}\n",
            "line 2, start.z_m",
            "2 is out of range",
            "at most 0",
        ),
        (HEAD + "latencies: {inference_s: -1}\n", "line 2, latencies.inference_s", "-1 is out of range", "at least 0"),
        (
            HEAD + "latencies: {inference_s: {distribution: normal, mean: 1, std: 1}}\n",
            "line 2, latencies.inference_s",
            "values below 0 can be drawn",
            "a minimum that is at least 0",
        ),
        # thruster events, both spellings
        (
            EVENTS + "{thruster: 7, event: failure, time_s: 3}\n",
            "line 3, thruster_events[0].thruster",
            "7",
            "at most 6",
        ),
        (EVENTS + "(7,failure,35)\n", "line 3, thruster_events[0].thruster", "7 is out of range", "at most 6"),
        (EVENTS + "(0,failure,35)\n", "line 3, thruster_events[0].thruster", "0 is out of range", "at least 1"),
        (
            EVENTS + "(1.5,failure,35)\n",
            "line 3, thruster_events[0]",
            "expected a whole number from 1 to 6 as thruster, got '1.5'",
            "as in",
        ),
        (
            EVENTS + "{thruster: 1.5, event: failure, time_s: 3}\n",
            "line 3, ",
            "expected a whole number, got 1.5",
            "such as 3",
        ),
        (
            EVENTS + "(1,failure,soon)\n",
            "line 3, thruster_events[0]",
            "expected a number as time_s, got 'soon'",
            "as in",
        ),
        (
            EVENTS + "{thruster: 1, event: failure, time_s: soon}\n",
            "line 3, ",
            "expected a number, got 'soon'",
            "a number",
        ),
        (EVENTS + "(1,failure,nan)\n", "line 3, thruster_events[0].time_s", "nan is not finite", "finite"),
        (EVENTS + "(1,failed,35)\n", "line 3, thruster_events[0].event", "'failed'", "did you mean 'failure'?"),
        (EVENTS + "{thruster: 1, event: broken, time_s: 3}\n", "line 3, ", "'broken'", "failure, recovery"),
        (EVENTS + "(1;failure;35)\n", "line 3, thruster_events[0]", "is not a thruster event", "(1,failure,35)"),
        (EVENTS + "(1,failure)\n", "line 3, thruster_events[0]", "is not a thruster event", "(1,failure,35)"),
        (HEAD + "thruster_events: (1,failure,35)\n", "line 2, thruster_events", "expected a list", "in brackets"),
        (EVENTS + "(1,failure,35)\n  - (9,failure,35)\n", "line 4, thruster_events[1].thruster", "9", "at most 6"),
        # other parts
        (HEAD + "mission:\n", "line 2, mission", "has nothing under it", "or leave it out"),
        (
            HEAD + "mission: 300\n",
            "line 2, mission",
            "expected a mapping of keys to values, got 300",
            "or leave it out",
        ),
        (HEAD + "signals: {water_visibility: null}\n", "line 2, signals", "no signal named water_visibility", "add it"),
        (HEAD + "pipeline: {vertices_m: [[1, 2, 3]]}\n", "line 2, pipeline.vertices_m", "has 1 entries", "2 needed"),
        (HEAD + "pipeline: {vertices_m: [[1, 2], [3, 4, 5]]}\n", "line 2, pipeline.vertices_m[0][2]", "missing", "add"),
        (
            HEAD + "battery: {}\nsignals: {battery_level: {kind: constant, value: 1}}\n",
            "line 2, battery",
            "and",
            "remove",
        ),
        (HEAD + "battery: {discharge_time_s: 0}\n", "line 2, battery.discharge_time_s", "0 is out", "greater than 0"),
        (
            HEAD + "reaction_metric: {visibility_thresholds_m: [1, 2, 3]}\n",
            "line 2, ",
            "is not in falling order",
            "greatest",
        ),
        (HEAD + "managers: {bt: {search_modes: [fd_spiral_low]}}\n", "line 2, ", "search_modes 1", "as many of both"),
        (HEAD + "managers: {random: {adaptation_period_s: 0}}\n", "line 2, managers.random.", "0 is out", "at least"),
        (HEAD + "managers: {metacontroll: {}}\n", "line 2, managers.metacontroll", "no manager", "mean 'metacontrol'?"),
        (HEAD + "managers: {'mine:Manager': 3}\n", "line 2, managers.mine:Manager", "3 is not a mapping", "key: value"),
        (
            HEAD + "knowledge: {ontologies: suave.owl}\n",
            "line 2, knowledge.ontologies",
            "expected a list",
            "['suave.owl']",
        ),
        (
            HEAD + "knowledge:\n  reasoner: pelet\n",
            "line 3, knowledge.reasoner",
            "'pelet' is not allowed",
            "did you mean 'pellet'? allowed: cached, pellet, owlready2",
        ),
        (HEAD + "knowledge: {ontologies: []}\n", "line 2, knowledge.ontologies", "has 0 entries", "at least 1"),
        # revisions
        (HEAD + "revision: 2024\n", "line 2, revision", "no revision '2024'", "shipped: 1.5, 2023"),
        (HEAD + "revision: {base: '1.6'}\n", "line 2, revision.base", "no revision '1.6'", "did you mean '1.5'?"),
        (HEAD + "revision: [2023]\n", "line 2, revision", "[2023] is not a revision", "one of 1.5, 2023"),
        (HEAD + "revision: true\n", "line 2, revision", "true is not a revision", "one of 1.5, 2023"),
        ("revision: {follow: {acceptance_m: 1}}\n", "line 1, revision", "has no name", 'base: "2023"'),
        (
            HEAD + "revision: {follow: {acceptance: 1}}\n",
            "line 2, revision.follow.acceptance",
            "unknown key",
            "did you mean 'acceptance_m'?",
        ),
        (HEAD + "revision: {base: 1.5, follow: {acceptance_m: -1}}\n", "line 2, revision.follow.", "-1", "than 0"),
        (
            HEAD + "revision: {spiral: {centre: here}}\n",
            "line 2, revision.spiral.centre",
            "'here'",
            "origin, activation",
        ),
        (HEAD + "revision: {spiral: {restarts_on_activation: maybe}}\n", "line 2, ", "'maybe'", "true or false"),
        (HEAD + "revision: {recovery: {delay_s: -1}}\n", "line 2, revision.recovery.delay_s", "-1", "at least 0"),
        (HEAD + "revision: {follow: {polls_before_resending: 0}}\n", "line 2, revision.follow.", "0 is out", "least 1"),
        # vehicles
        (HEAD + "vehicle: bluerov3\n", "line 2, vehicle", "no vehicle 'bluerov3'", "did you mean 'bluerov2'?"),
        (HEAD + "vehicle: [1]\n", "line 2, vehicle", "[1] is not a vehicle", "one of bluerov2"),
        (HEAD + "vehicle: {thrust_limit_n: 0}\n", "line 2, vehicle.thrust_limit_n", "0 is out of", "greater than 0"),
        (HEAD + "vehicle: {thrusters: []}\n", "line 2, vehicle.thrusters", "has 0 entries", "at least 6"),
        (HEAD + "vehicle: {camera: {field_of_view_deg: 180}}\n", "line 2, vehicle.camera.", "180", "less than 180"),
        (HEAD + "vehicle: {camera: {field_of_view: 60}}\n", "line 2, vehicle.", "unknown", "'field_of_view_deg'?"),
        # other files
        ("base: nowhere.yaml\n", "line 1, base", "no such file: 'nowhere.yaml'", "seams2023.yaml"),
        ("base: [a]\n", "line 1, base", "['a'] is not a file name", "a path"),
        ("base: .\n", "line 1, base", "is a folder", "a file in it"),
        ("base: mine.yaml\n", "line 1, base", "mine.yaml -> mine.yaml", "its own base"),
        (HEAD + "modes_file: nowhere.yaml\n", "line 2, modes_file", "no such file: 'nowhere.yaml'", "suave_modes.yaml"),
        (HEAD + "modes_file: ''\n", "line 2, modes_file", "'' is too short", "at least 1"),
        (
            HEAD + "knowledge: {ontologies: [suav.owl]}\n",
            "line 2, knowledge.ontologies[0]",
            "no such file",
            "suave.owl",
        ),
        (
            VISIBILITY + "{kind: table, file: t.csv}\n",
            "line 3, signals.water_visibility.file",
            "no such file",
            "t_s,value",
        ),
        # modes
        (
            HEAD + "default_modes: {f_generate_search_path: fd_spiral_lo}\n",
            "line 2, default_modes.f_generate_search_path",
            "has no mode 'fd_spiral_lo'",
            "did you mean 'fd_spiral_low'?",
        ),
        (
            HEAD + "default_modes: {f_search: fd_spiral_low}\n",
            "line 2, ",
            "no function 'f_search'",
            "f_generate_search",
        ),
        (
            HEAD + "managers: {bt: {search_modes: [fd_spiral_high, fd_spiral_low, fd_spiral_mid]}}\n",
            "line 2, managers.bt.search_modes[2]",
            "has no mode 'fd_spiral_mid'",
            "fd_spiral_medium",
        ),
        # YAML
        (HEAD + "description: !!python/object/apply:os.system [ls]\n", "line 2, description", "tag", "plain text"),
        (HEAD + "name: a\nname: b\n", "line 3, name", "appears twice, first in line 2", "keep one"),
    ],
)
def test_a_wrong_scenario_is_refused_with_file_place_and_remedy(write, content, place, problem, remedy):
    error = refused(write, content)
    assert error.file == "mine.yaml"
    assert (error.place or "").startswith(place)
    assert problem in error.problem
    assert remedy in (error.remedy or "")


X, U = "start: {x_m: ", "distribution: uniform"


@pytest.mark.parametrize(
    ("content", "place", "value", "remedy"),
    [
        ("start: {x_m: 1e300}", "start.x_m", "1e+300", "at least -10000 and at most 10000 m"),
        ("start: {y_m: -10001}", "start.y_m", "-10001", "at least -10000 and at most 10000 m"),
        ("start: {heading_rad: 90}", "start.heading_rad", "90", "at least -6.3 and at most 6.3 rad"),
        (X + "{" + U + ", minimum: 0, maximum: 1e5}}", "start.x_m.maximum", "100000", "at most 10000 m"),
        (X + "{distribution: normal, mean: 1e5, std: 1}}", "start.x_m.mean", "100000", "at most 10000 m"),
        (X + "{distribution: normal, mean: 0, std: 1e6}}", "start.x_m.std", "1e+06", "at most 20000 m"),
        (X + "{distribution: exponential, mean: 1e6}}", "start.x_m.mean", "1000000", "at most 10000 m"),
        (X + "{distribution: choice, values: [1, 2e4]}}", "start.x_m.values", "20000", "at most 10000 m"),
        ("current: {x_m_per_s: 1e6}", "current.x_m_per_s", "1000000", "at least -10 and at most 10 m/s"),
        ("current: {z_m_per_s: -11}", "current.z_m_per_s", "-11", "at least -10 and at most 10 m/s"),
        ("mission: {time_limit_s: 1e12}", "mission.time_limit_s", "1e+12", "greater than 0 and at most 1"),
        ("pipeline: {vertices_m: [[0, 0, -20], [1e5, 0, -20]]}", "pipeline.vertices_m[1][0]", "1", "at most 10000"),
        ("battery: {station_x_m: 1e5}", "battery.station_x_m", "100000", "at most 10000"),
        ("battery: {discharge_time_s: 1e10}", "battery.discharge_time_s", "1", "at most 1e+09"),
        ("latencies: {inference_s: 1e10}", "latencies.inference_s", "10000000000", "at most 1e+09 s"),
        ("thruster_events: ['(1,failure,1e10)']", "thruster_events[0].time_s", "1", "at least 0 and at most 1e+09 s"),
        ("thruster_events: ['(1,failure,-1)']", "thruster_events[0].time_s", "-1", "must be at least 0 s"),
        ("signals: {water_visibility: {maximum: 1e13}}", "signals.water_visibility.maximum", "1", "at most 1e+12"),
        ("signals: {water_visibility: {noise: 1e13}}", "signals.water_visibility.noise", "1", "at most 1e+12"),
        ("signals: {water_visibility: {period_s: 1e10}}", "signals.water_visibility.period_s", "1", "at most 1e+09"),
        ("signals: {water_visibility: {publishing_period_s: 1e10}}", "signals.", "1", "at most 1e+09"),
        ("calibration: {jerk_m_per_s3: 1e4}", "calibration.", "10000", "at most 1000"),
        ("calibration: {altitude_error_m: 1e3}", "calibration.altitude_error_m", "1000", "at most 100 m"),
        ("calibration: {drift_x_m: 1e5}", "calibration.drift_x_m", "100000", "at most 10000 m"),
        ("knowledge: {values: {qa_performance_low: 1e300}}", "knowledge.values.qa_performance_low", "1e+300", "1e+12"),
        ("managers: {random: {adaptation_period_s: 1e300}}", "managers.random.", "1e+300", "at most 1e+09"),
        ("revision: {follow: {acceptance_m: 1e300}}", "revision.follow.acceptance_m", "1e+300", "at most 10000"),
        ("revision: {set_points: {node_frame_offset_x_m: 1e300}}", "revision.set_points.", "1e+300", "at most 100 m"),
    ],
)
def test_a_value_beyond_what_can_be_meant_is_refused(write, content, place, value, remedy):
    error = refused(write, HEAD + content + "\n")
    assert (error.place or "").startswith(f"line 2, {place}")
    assert error.problem.startswith(value)
    assert error.problem.endswith(" is out of range")
    assert remedy in (error.remedy or "")


@pytest.mark.parametrize(
    "content",
    [
        "start: {x_m: 5000, y_m: -9999, heading_rad: 6.283185307179586}",
        "start: {x_m: {distribution: normal, mean: -17, std: 300}}",
        "current: {x_m_per_s: 8, y_m_per_s: -8}",
        "mission: {time_limit_s: 86400}",
        "battery: {discharge_time_s: 1e9}",
        "latencies: {inference_s: {distribution: exponential, mean: 600}}",
        "managers: {random: {adaptation_period_s: 1e6}}",
        "signals: {atmospheric_pressure: {kind: constant, value: 1.013e5}, rate: {kind: constant, value: 1e9}}",
        "signals: {water_visibility: {period_s: 1e6}}",
        "thruster_events: ['(1,failure,0)', '(2,failure,1e6)']",
        "pipeline: {vertices_m: [[0, 0, -20], [5000, 0, -20]]}",
    ],
)
def test_a_generous_value_is_taken(write, content):
    load_scenario(write("mine.yaml", HEAD + content + "\n"))


def test_the_whole_message_is_one_readable_line(write):
    assert str(refused(write, VISIBILITY + "{period_s: -80}\n")) == (
        "mine.yaml: line 3, signals.water_visibility.period_s: -80 is out of range (must be at least 0.001 s)"
    )


def test_a_long_value_is_cut(write):
    assert len(str(refused(write, VISIBILITY + "{period_s: '" + "x" * 5000 + "'}\n"))) < 300


@pytest.mark.parametrize(
    "content",
    [
        '"a\\nb": 1\n',
        '"' + "a" * 5000 + '": 1\n',
        'base: "a\\nb"\n',
        HEAD + 'modes_file: "a\\nb"\n',
        HEAD + 'revision: "a\\nb"\n',
        HEAD + 'default_modes: {f_follow_pipeline: "a\\nb"}\n',
        EVENTS + '"(1,failure,\\n)"\n',
        EVENTS + "(1," + "x" * 5000 + ")\n",
    ],
)
def test_line_breaks_and_long_texts_do_not_reach_the_message(write, content):
    message = str(refused(write, content))
    assert len(message) < 400


def test_a_value_that_is_wrong_in_the_base_is_reported_there(write):
    write("common/base.yaml", VISIBILITY + "{period_s: -80}\n")
    error = refused(write, "base: common/base.yaml\nmission: {time_limit_s: 100}\n")
    assert error.file == "common/base.yaml"
    assert error.place == "line 3, signals.water_visibility.period_s"


def test_a_value_that_is_wrong_over_a_sound_base_is_reported_in_the_derived_file(write):
    write("common/base.yaml", VISIBILITY + "{period_s: 80}\n")
    error = refused(write, "base: common/base.yaml\nsignals:\n  water_visibility:\n    period_s: -80\n")
    assert (error.file, error.place) == ("mine.yaml", "line 4, signals.water_visibility.period_s")


def test_of_two_wrong_files_the_users_own_comes_first(write):
    write("base.yaml", VISIBILITY + "{period_s: -80}\n")
    error = refused(write, "base: base.yaml\n\n\n\n\nmission: {time_limit_s: -1}\n")
    assert error.file == "mine.yaml"
    assert "and 1 more" in (error.remedy or "")


def test_a_wrong_revision_file_is_reported_there(write):
    write("own.yaml", 'base: "2023"\nfollow:\n  acceptance_m: none\n')
    error = refused(write, HEAD + "revision: own.yaml\n")
    assert (error.file, error.place) == ("own.yaml", "line 3, revision.follow.acceptance_m")


def test_a_thruster_that_pushes_with_more_than_its_thrust_is_refused_with_its_line(write):
    thruster = "  - {position_m: [0, 0, 0], direction: [1, 0, 0]}\n"
    write("own.yaml", "base: bluerov2\nthrusters:\n" + 5 * thruster + thruster.replace("[1, 0", "[1, 1"))
    error = refused(write, HEAD + "vehicle: own.yaml\n")
    assert (error.file, error.place) == ("own.yaml", "line 8, vehicle.thrusters[5].direction")
    assert "length 1.414" in error.problem


def test_bases_in_a_circle_are_refused_with_the_circle(write):
    write("a.yaml", "base: b.yaml\n")
    write("b.yaml", "base: mine.yaml\n")
    error = refused(write, "base: a.yaml\n")
    assert error.file == "b.yaml"
    assert "mine.yaml -> a.yaml -> b.yaml -> mine.yaml" in error.problem


def test_revisions_in_a_circle_are_refused(write):
    write("a.yaml", "base: b.yaml\n")
    write("b.yaml", "base: a.yaml\n")
    assert "a.yaml -> b.yaml -> a.yaml" in refused(write, HEAD + "revision: a.yaml\n").problem


def test_a_wrong_table_is_reported_in_the_table(write):
    write("t.csv", "t_s,value\n0,1\n0,2\n")
    error = refused(write, VISIBILITY + "{kind: table, file: t.csv}\n")
    assert (error.file, error.place) == ("t.csv", "line 3")


@pytest.mark.parametrize(
    ("lost", "problem"),
    [
        ("f_follow_pipeline:", "defines no function f_follow_pipeline"),
        ("      fd_unground:\n        f_follow_pipeline_node: inactive\n", "f_follow_pipeline has no mode fd_unground"),
    ],
)
def test_a_modes_file_without_what_the_mission_needs_is_refused(write, shipped_modes, lost, problem):
    assert lost in shipped_modes
    write("m.yaml", shipped_modes.replace(lost, "" if lost.startswith(" ") else "f_other:"))
    error = refused(write, HEAD, modes_file="m.yaml")
    assert error.file == "m.yaml"
    assert problem in error.problem


def test_a_scenario_that_does_not_exist_is_refused_with_the_shipped_ones(write):
    write("unused", "")
    with pytest.raises(InputError, match=r"^nowhere: no such file \(.*seams2023\.yaml.*\)$"):
        load_scenario("nowhere")


@pytest.mark.parametrize("name", ["x" * 5000, "a\0b", ".", ""])
def test_a_name_that_cannot_be_a_file_is_refused(write, name):
    write("unused", "")
    with pytest.raises(InputError):
        load_scenario(name)


def test_a_missing_ontology_or_modes_file_of_the_command_line_is_named(write):
    assert refused(write, HEAD, ontologies=["nowhere.owl"]).file == "nowhere.owl"
    assert refused(write, HEAD, modes_file="nowhere.yaml").file == "nowhere.yaml"


def test_an_unknown_reasoner_of_the_command_line_is_refused_before_anything_is_opened(write):
    error = refused(write, HEAD, reasoner="pelet")
    assert str(error) == (
        "--reasoner: there is no reasoner 'pelet' (did you mean 'pellet'? known: cached, pellet, owlready2)"
    )


def test_the_reasoners_of_scenarios_are_those_that_there_are():
    from suave_des.knowledge.reasoners import BACKENDS
    from suave_des.scenario.models import REASONERS

    assert sorted(REASONERS) == sorted(BACKENDS)


def _places(data: object, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return [path, *(place for key, value in inner for place in _places(value, (*path, key)))]


SHIPPED_FILES = [
    f"{folder}/{name}"
    for folder, name in (
        ("scenarios", "seams2023.yaml"),
        ("scenarios", "suave_modes.yaml"),
        ("scenarios/revisions", "2023.yaml"),
        ("scenarios/vehicles", "bluerov2.yaml"),
    )
]
ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-5, 400)
    | st.floats(allow_nan=False)
    | st.sampled_from(["", "a", "(1,x)", "active.a"]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["a", "kind", "distribution", "base", "minimum"]), inner)
    ),
    max_leaves=5,
)


@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_whatever_stands_anywhere_is_loaded_or_refused_in_one_line(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("mutated")
    for name in SHIPPED_FILES:
        shutil.copy(shipped_folder("scenarios").parent / name, folder)
    (folder / "2023.yaml").rename(folder / "own_revision.yaml")
    scenario = (
        (folder / "seams2023.yaml")
        .read_text(encoding="utf-8")
        .replace('revision: "2023"', "revision: own_revision.yaml\nvehicle: bluerov2.yaml")
    )
    (folder / "seams2023.yaml").write_text(scenario, encoding="utf-8")
    path = folder / data.draw(
        st.sampled_from(["seams2023.yaml", "suave_modes.yaml", "own_revision.yaml", "bluerov2.yaml"])
    )
    content = read_yaml(path).data
    place = data.draw(st.sampled_from(_places(content)[1:]))
    part = content
    for key in place[:-1]:
        part = part[key]
    part[place[-1]] = data.draw(ANYTHING)
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    try:
        load_scenario(folder / "seams2023.yaml")
    except InputError as error:
        assert "\n" not in str(error)
        assert error.remedy
        assert error.file is not None
        assert error.file.startswith(str(folder))
