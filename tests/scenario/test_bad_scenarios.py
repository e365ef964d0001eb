"""Ways in which a scenario can be wrong: one line with file, line, key path, what is wrong, what
would be right.
"""

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
NORMAL = HEAD + "start: {x_m: {distribution: normal, mean: 0, "


def refused(write, content: str, **options: object) -> InputError:
    path = write("mine.yaml", content)
    with pytest.raises(InputError) as caught:
        load_scenario(path, **options)
    assert "\n" not in str(caught.value)
    return caught.value


@pytest.mark.parametrize(
    ("content", "place", "words"),
    [
        # keys
        (HEAD + "misson: {}\n", "line 2, misson", "unknown key 'misson' (did you mean 'mission'?"),
        (
            VISIBILITY + "{perod_s: 3}\n",
            "line 3, signals.water_visibility.perod_s",
            "did you mean 'period_s'?",
        ),
        (
            WHOLE + "{kind: sinusoid, minimum: 1, maximum: 2}\n",
            "line 3, signals.water_visibility.period_s",
            "missing",
        ),
        (HEAD + "start: {x: 1}\nfoo: 1\nbar: 2\n", "line 2, start.x", "and 2 more"),
        ("signals: {}\n", "line 1, signals", "no signal named water_visibility"),
        (
            WHOLE + "{kind: constant, value: 2}\n  my sea: {kind: constant, value: 1}\n",
            "line 4, ",
            "'my sea' is not a",
        ),
        # numbers
        (HEAD + "start: {x_m: .inf}\n", "line 2, start.x_m", ".inf should be a finite number"),
        (
            VISIBILITY + "{period_s: '80'}\n",
            "line 3, signals.water_visibility.period_s",
            "'80' should be a number",
        ),
        (VISIBILITY + "{period_s: 0}\n", "line 3, ", "0 should be greater than or equal to 0.001"),
        (
            HEAD + "mission: {time_limit_s: " + "9" * 400 + "}\n",
            "line 2, ",
            ".inf should be a finite number",
        ),
        # relations
        (
            VISIBILITY + "{minimum: 9}\n",
            "line 3, signals.water_visibility.minimum",
            "minimum 9 is above maximum 3.75",
        ),
        (
            HEAD + "battery: {}\nsignals: {battery_level: {kind: constant, value: 1}}\n",
            "line 2, battery",
            "remove one",
        ),
        (
            HEAD + "reaction_metric: {visibility_thresholds_m: [1, 2, 3]}\n",
            "line 2, ",
            "is not in falling order",
        ),
        (HEAD + "managers: {bt: {search_modes: [fd_spiral_low]}}\n", "line 2, ", "search_modes 1"),
        # kinds of signals
        (
            VISIBILITY + "{before: 2}\n",
            "line 3, signals.water_visibility.before",
            "(known: dropout_probability",
        ),
        (
            VISIBILITY + "{kind: sinus}\n",
            "line 3, signals.water_visibility.kind",
            "did you mean 'sinusoid'?",
        ),
        (WHOLE + "{period_s: 80}\n", "line 3, signals.water_visibility", "kind is missing"),
        # distributions
        (
            HEAD + "start: {x_m: {distribution: gauss}}\n",
            "line 2, start.x_m.distribution",
            "is no distribution that",
        ),
        (
            HEAD + "start:\n  x_m:\n    distribution: uniform\n    minimum: 3\n    maximum: 1\n",
            "line 5, start.x_m.minimum",
            "minimum 3 is above maximum 1",
        ),
        (NORMAL + "std: 1, minimum: 9}}\n", "line 2, start.x_m.minimum", "leaves next to nothing"),
        (NORMAL + "std: 1e6}}\n", "line 2, start.x_m.std", "must be at most 20000"),
        (
            HEAD + "start: {heading_rad: 90}\n",
            "line 2, start.heading_rad",
            "at least -6.3 and at most 6.3",
        ),
        (
            HEAD + "latencies: {inference_s: {distribution: normal, mean: 1, std: 1}}\n",
            "line 2, latencies.inference_s",
            "values below 0 can be drawn",
        ),
        # thruster events, both spellings
        (
            EVENTS + "{thruster: 7, event: failure, time_s: 3}\n",
            "line 3, thruster_events[0].thruster",
            "equal to 6",
        ),
        (EVENTS + "(1,failed,35)\n", "line 3, thruster_events[0].event", "did you mean 'failure'?"),
        (
            EVENTS + "(1,failure,35)\n  - (9,failure,35)\n",
            "line 4, thruster_events[1].thruster",
            "9 should be",
        ),
        # other parts
        (HEAD + "mission:\n", "line 2, mission", "nothing should be a mapping"),
        (
            HEAD + "pipeline: {vertices_m: [[1, 2], [3, 4, 5]]}\n",
            "line 2, pipeline.vertices_m[0][2]",
            "is missing",
        ),
        (
            HEAD + "managers: {'mine:Manager': {starts_s: .inf}}\n",
            "line 2, managers.mine:Manager",
            "finite number",
        ),
        (
            HEAD + "knowledge: {ontologies: suave.owl}\n",
            "line 2, knowledge.ontologies",
            "'suave.owl' should be a list",
        ),
        (
            HEAD + "knowledge:\n  reasoner: pelet\n",
            "line 3, knowledge.reasoner",
            "did you mean 'pellet'? allowed",
        ),
        # revisions and vehicles
        (HEAD + "revision: 2024\n", "line 2, revision", "no such file: '2024'"),
        ("revision: {follow: {acceptance_m: 1}}\n", "line 1, revision.name", "is missing"),
        (
            HEAD + "revision: {follow: {acceptance: 1}}\n",
            "line 2, revision.follow.acceptance",
            "mean 'acceptance_m'?",
        ),
        # other files
        ("base: nowhere.yaml\n", "line 1, base", "no such file: 'nowhere.yaml'"),
        ("base: mine.yaml\n", "line 1, base", "mine.yaml -> mine.yaml"),
        (
            HEAD + "knowledge: {ontologies: [suav.owl]}\n",
            "line 2, knowledge.ontologies[0]",
            "did you mean 'suave.owl'?",
        ),
        (
            VISIBILITY + "{kind: table, file: t.csv}\n",
            "line 3, signals.water_visibility.file",
            "no such file: 't.csv'",
        ),
        # modes
        (
            HEAD + "default_modes: {f_generate_search_path: fd_spiral_lo}\n",
            "line 2, default_modes.",
            "'fd_spiral_low'?",
        ),
        (
            HEAD + "default_modes: {f_search: fd_spiral_low}\n",
            "line 2, default_modes.f_search",
            "function 'f_search'",
        ),
        # YAML
        (
            HEAD + "description: !!python/object/apply:os.system [ls]\n",
            "line 2, description",
            "the tag",
        ),
    ],
)
def test_a_wrong_scenario_is_refused(write, content, place, words):
    error = refused(write, content)
    assert error.file == "mine.yaml"
    assert (error.place or "").startswith(place)
    assert words in str(error)


@pytest.mark.parametrize(
    "content",
    [
        "start: {x_m: {distribution: normal, mean: -17, std: 300}}",
        "latencies: {inference_s: {distribution: exponential, mean: 600}}",
        "signals: {atmospheric_pressure: {kind: constant, value: 1.013e5}, rate: {kind: constant, value: 1e9}}",
        "thruster_events: ['(1,failure,0)', '(2,failure,1e6)']",
        "pipeline: {vertices_m: [[0, 0, -20], [5000, 0, -20]]}",
    ],
)
def test_a_generous_value_is_taken(write, content):
    load_scenario(write("mine.yaml", HEAD + content + "\n"))


@pytest.mark.parametrize(
    "content",
    [
        '"a\\nb": 1\n',
        HEAD + 'revision: "a\\nb"\n',
        HEAD + 'default_modes: {f_follow_pipeline: "a\\nb"}\n',
        EVENTS + '"(1,failure,\\n)"\n',
    ],
)
def test_a_message_stays_short_whatever_is_given(write, content):
    assert len(str(refused(write, content))) < 400


def test_a_value_that_is_wrong_in_the_base_is_reported_there(write):
    write("common/base.yaml", VISIBILITY + "{period_s: -80}\n")
    error = refused(write, "base: common/base.yaml\nmission: {time_limit_s: 100}\n")
    assert error.file == "common/base.yaml"
    assert error.place == "line 3, signals.water_visibility.period_s"


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
    write(
        "own.yaml",
        "base: bluerov2\nthrusters:\n" + 5 * thruster + thruster.replace("[1, 0", "[1, 1"),
    )
    error = refused(write, HEAD + "vehicle: own.yaml\n")
    assert (error.file, error.place) == ("own.yaml", "line 8, vehicle.thrusters[5].direction")
    assert "length 1.414" in error.problem


def test_bases_in_a_circle_are_refused_with_the_circle(write):
    write("a.yaml", "base: b.yaml\n")
    write("b.yaml", "base: mine.yaml\n")
    error = refused(write, "base: a.yaml\n")
    assert error.file == "b.yaml"
    assert "mine.yaml -> a.yaml -> b.yaml -> mine.yaml" in error.problem
    write("b.yaml", "base: a.yaml\n")
    assert "a.yaml -> b.yaml -> a.yaml" in refused(write, HEAD + "revision: a.yaml\n").problem


@pytest.mark.parametrize(
    ("lost", "problem"),
    [
        ("f_follow_pipeline:", "there is no function 'f_follow_pipeline'"),
        (
            "      fd_unground:\n        f_follow_pipeline_node: inactive\n",
            "f_follow_pipeline has no mode fd_unground",
        ),
    ],
)
def test_a_modes_file_without_what_the_mission_needs_is_refused(
    write, shipped_modes, lost, problem
):
    assert lost in shipped_modes
    write("m.yaml", shipped_modes.replace(lost, "" if lost.startswith(" ") else "f_other:"))
    error = refused(write, HEAD, modes_file="m.yaml")
    assert error.file == "m.yaml"
    assert problem in error.problem


def test_a_scenario_that_does_not_exist_is_refused_with_the_shipped_ones(write):
    write("unused", "")
    with pytest.raises(
        InputError, match=r"^seams: no such file \(did you mean 'seams2023'\? .*, seams2023\)$"
    ):
        load_scenario("seams")


@pytest.mark.parametrize("name", ["x" * 5000, "a\0b", ".", ""])
def test_a_name_that_cannot_be_a_file_is_refused(write, name):
    write("unused", "")
    with pytest.raises(InputError):
        load_scenario(name)


@pytest.mark.parametrize(
    ("given", "file"),
    [({"ontologies": ["nowhere.owl"]}, "nowhere.owl"), ({"modes_file": "no.yaml"}, "no.yaml")],
    ids=["ontology", "modes"],
)
def test_a_file_of_the_command_line_that_is_not_there_is_named(write, given, file):
    assert refused(write, HEAD, **given).file == file


def test_a_reasoner_of_the_command_line_is_told_with_its_option(write):
    assert str(refused(write, HEAD, reasoner="pelet")) == (
        "--reasoner: there is no reasoner 'pelet' (did you mean 'pellet'? known: cached, pellet, owlready2)"
    )


def test_the_reasoners_of_scenarios_are_those_that_there_are():
    from suave_des.knowledge.reasoner import BACKENDS
    from suave_des.scenario.models import REASONERS

    assert sorted(REASONERS) == sorted(BACKENDS)


def _places(data: object, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    inner = (
        data.items()
        if isinstance(data, dict)
        else enumerate(data)
        if isinstance(data, list)
        else ()
    )
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
        st.sampled_from(
            ["seams2023.yaml", "suave_modes.yaml", "own_revision.yaml", "bluerov2.yaml"]
        )
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
        assert error.file is not None
        assert error.file.startswith(str(folder))
