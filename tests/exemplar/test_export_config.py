"""The exemplar's files that are written import again to the same, and what they cannot express is
named.
"""

from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.campaign.spec import read_campaign_file
from suave_des.errors import InputError
from suave_des.exemplar.configurations import import_config
from suave_des.exemplar.export import MISSION_FILE, RUNNER_FILE, export_config
from suave_des.exemplar.keys import REVISIONS
from suave_des.scenario.loader import LoadedScenario, load_scenario, with_values
from suave_des.scenario.yamlfile import parse_yaml

MANAGERS = ("none", "random", "metacontrol", "bt", "bt_extended")


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda value: round(value, 3))


def blank(revision: str) -> LoadedScenario:
    """What an import of empty files of a revision gives: all that the exemplar can express is at
    its defaults.
    """
    empty = parse_yaml("mission_node: {ros__parameters: {time_limit: 300}}\n", Path("m.yaml"))
    return import_config([empty], Path("blank.yaml"), managers=MANAGERS, revision=revision).loaded


BLANK = {revision: blank(revision) for revision in REVISIONS}
UNIFORM = st.tuples(number(-50, 50), number(0, 20)).map(lambda pair: (pair[0], pair[0] + pair[1]))


@st.composite
def expressible(draw, revision: str) -> tuple[LoadedScenario, dict]:
    """A scenario, and a campaign if the revision has a runner, of values that the exemplar has keys
    for.
    """
    metrics, runner = (revision in list(REVISIONS)[number:] for number in (2, 3))
    low, high = sorted(draw(st.tuples(number(0.5, 5), number(0.5, 5))))
    signal = {"minimum": low, "maximum": high, "period_s": float(draw(st.integers(1, 500)))}
    signal |= {"shift_s": draw(number(-100, 100)), "publishing_period_s": draw(number(0.1, 5))}
    values = {f"signals.water_visibility.{key}": value for key, value in signal.items()}
    values["mission.time_limit_s"] = float(draw(st.integers(1, 1000)))
    values["managers.random.adaptation_period_s"] = float(draw(st.integers(1, 100)))
    event = st.tuples(st.integers(1, 6), st.sampled_from(["failure", "recovery"]), number(100, 500))
    events = draw(st.lists(event, max_size=3))
    values["thruster_events"] = [f"({n},{what},{time_s!r})" for n, what, time_s in events]
    values["default_modes.f_generate_search_path"] = draw(
        st.sampled_from(["fd_spiral_low", "fd_spiral_high"])
    )
    if metrics:
        values["battery.discharge_time_s"] = draw(number(1, 1000))
        values["battery.publishing_period_s"] = draw(number(0.1, 10))
        values["reaction_metric.battery_limit"] = draw(number(0, 1))
        values["reaction_metric.visibility_thresholds_m"] = sorted(
            {draw(number(0, 9)), draw(number(0, 9))}
        )[::-1]
        fitting = st.lists(number(0, 9), min_size=1, max_size=2)
        count = len(values["reaction_metric.visibility_thresholds_m"])
        values["reaction_metric.expected_altitudes_m"] = (draw(fitting) * 2)[:count]
    campaign = {}
    if runner:
        values |= {
            "start.x_m": draw(number(-50, 50)),
            "start.y_m": draw(number(-50, 50)),
            "start.z_m": -10.0,
        }
        managers = draw(st.lists(st.sampled_from(MANAGERS), min_size=1, unique=True))
        campaign = {"managers": managers, "runs": draw(st.integers(1, 100)), "seed": 100}
        at = {
            "start.x_m": values["start.x_m"],
            "signals.water_visibility.shift_s": signal["shift_s"],
        }
        perturbed = {}
        for path in draw(st.sets(st.sampled_from(sorted(at)))):
            low, high = draw(UNIFORM)
            if (low, high) != (0, 0):
                perturbed[path] = {
                    "distribution": "uniform",
                    "minimum": at[path] + low,
                    "maximum": at[path] + high,
                }
        if events and draw(st.booleans()):
            low, high = draw(UNIFORM)
            shift = {"distribution": "uniform", "shared": "thruster_events_shift"}
            for index, (_, _, time_s) in enumerate(events if (low, high) != (0, 0) else ()):
                drawn = {**shift, "minimum": time_s + low, "maximum": time_s + high}
                perturbed[f"thruster_events.{index}.time_s"] = drawn
        if perturbed:
            campaign |= {"perturbations": perturbed, "runs_per_draw": draw(st.integers(1, 20))}
    if revision == "1.5":
        campaign["seed"] = draw(st.integers(0, 2**40))
        ends = draw(st.none() | number(0.01, 0.9))
        values |= {} if ends is None else {"battery.mission_ends_at_level": ends}
    return with_values(BLANK[revision], values), campaign


def assert_imports_again(revision: str, data: st.DataObject) -> None:
    loaded, campaign = data.draw(expressible(revision))
    texts, lost = export_config(loaded, campaign, revision)
    assert lost == ()
    again = import_config(
        [parse_yaml(text, Path(name)) for name, text in texts.items()],
        Path("again.yaml"),
        managers=MANAGERS,
        revision=revision,
        campaign=Path("campaign.yaml") if campaign else None,
    )
    same = {"name", "description"}
    assert again.loaded.scenario.model_dump(exclude=same) == loaded.scenario.model_dump(
        exclude=same
    )
    if campaign:
        content = yaml.safe_load(again.campaign)
        perturbed, drawn = campaign.pop("perturbations", {}), content.pop("perturbations", {})
        assert content == {"campaign": 1, "scenario": "again.yaml", **campaign}
        assert drawn.keys() == perturbed.keys()
        for path, distribution in perturbed.items():
            assert drawn[path] == pytest.approx(distribution, abs=1e-6)


@pytest.mark.parametrize("revision", REVISIONS)
@pytest.mark.parametrize("examples", [8, pytest.param(50, marks=pytest.mark.slow)])
def test_what_the_exemplar_can_express_imports_again_to_the_same(revision, examples):
    @settings(max_examples=examples, deadline=None)
    @given(st.data())
    def check(data: st.DataObject) -> None:
        assert_imports_again(revision, data)

    check()


def lost_lines(scenario: str | LoadedScenario, revision: str | None = None, **campaign) -> str:
    loaded = load_scenario(scenario)
    given = {"managers": ["none"], "runs": 20, "seed": 100, **campaign}
    return "\n".join(export_config(loaded, given, revision)[1])


@pytest.mark.parametrize(
    ("scenario", "revision", "expected"), [("planta_exp1", "1.4", 0), ("seams2023", "1.5", 85)]
)
def test_times_of_thruster_events_are_written_as_the_other_revision_counts_them(
    scenario, revision, expected
):
    events = ["(1,failure,35)", "(1,recovery,50)"]
    loaded = with_values(
        load_scenario(scenario), {} if expected == 0 else {"thruster_events": events}
    )
    texts, lost = export_config(loaded, {"managers": ["none"], "runs": 1, "seed": 1}, revision)
    written = yaml.safe_load(texts[MISSION_FILE])["/thruster_monitor"]["ros__parameters"][
        "thruster_events"
    ]
    assert written[1].endswith(f",{expected})")
    assert "thruster_events" not in "\n".join(lost)


UNIFORM_S = {"distribution": "uniform", "minimum": 30.0, "maximum": 50.0}


class TestTimesOfThrusterEvents:
    @pytest.mark.parametrize(("revision", "of_second"), [("1.4", 0), ("1.5", 15)])
    def test_that_are_random_are_told_to_be_lost_wherever_a_mean_is_written(
        self, revision, of_second
    ):
        events = [
            {"thruster": 1, "event": "failure", "time_s": UNIFORM_S},
            {"thruster": 2, "event": "failure", "time_s": 15},
        ]
        loaded = with_values(load_scenario("planta_exp1"), {"thruster_events": events})
        texts, lost = export_config(loaded, {"managers": ["bt"], "runs": 1, "seed": 1}, revision)
        (line,) = [each for each in lost if each.startswith("thruster_events")]
        assert "'distribution': 'uniform'" in line or "'thruster': 1" in line
        written = yaml.safe_load(texts[MISSION_FILE])["/thruster_monitor"]["ros__parameters"]
        assert written["thruster_events"] == ["(1,failure,40)", f"(2,failure,{of_second})"]

    def test_of_one_that_waits_for_the_one_before_follow_at_once(self):
        events = ["(1,failure,60)", "(2,failure,20)", "(3,failure,70)"]
        loaded = with_values(load_scenario("planta_exp1"), {"thruster_events": events})
        texts, _ = export_config(loaded, {"managers": ["bt"], "runs": 1, "seed": 1}, "1.4")
        written = yaml.safe_load(texts[MISSION_FILE])["/thruster_monitor"]["ros__parameters"]
        assert written["thruster_events"] == ["(1,failure,60)", "(2,failure,0)", "(3,failure,10)"]

    @pytest.mark.parametrize("second_s", [0, 10])
    def test_that_are_cut_at_the_start_keep_their_distribution(self, second_s):
        events = ["(1,failure,0)", f"(2,failure,{second_s})"]
        loaded = with_values(BLANK["1.5"], {"thruster_events": events})
        drawn = {**UNIFORM_S, "shared": "thruster_events_shift"}
        perturbed = {
            "thruster_events.0.time_s": {**drawn, "minimum": -20.0, "maximum": 20.0},
            "thruster_events.1.time_s": {**drawn, "minimum": second_s, "maximum": second_s + 40.0},
        }
        campaign = {"managers": ["bt"], "runs": 1, "seed": 1, "perturbations": perturbed}
        texts, lost = export_config(loaded, {**campaign, "runs_per_draw": 5})
        runner = yaml.safe_load(texts[RUNNER_FILE])["/suave_runner_node"]["ros__parameters"]
        assert runner["thruster_events"] == ["(1,failure,-20)", f"(2,failure,{second_s})"]
        assert (runner["thruster_events_random_interval"], lost) == ([0, 40], ())

    def test_that_a_campaign_draws_otherwise_for_each_are_told(self):
        loaded = with_values(BLANK["1.5"], {"thruster_events": ["(1,failure,5)", "(2,failure,10)"]})
        perturbed = {
            "thruster_events.0.time_s": UNIFORM_S,
            "thruster_events.1.time_s": UNIFORM_S,
        }
        campaign = {"managers": ["bt"], "runs": 1, "seed": 1, "perturbations": perturbed}
        texts, lost = export_config(loaded, campaign)
        assert "random_interval: [" not in texts[RUNNER_FILE].replace("\n", "")
        assert lost[0].startswith("perturbations: {'thruster_events.0.time_s'")

    def test_that_a_campaign_draws_are_told_where_another_revision_counts_otherwise(self):
        """Each shift would count once there, and here for all events that follow."""
        events = ["(1,failure,35)", "(2,failure,50)"]
        loaded = with_values(BLANK["1.4"], {"thruster_events": events})
        shared = {"distribution": "uniform", "shared": "thruster_events_shift"}
        perturbed = {
            "thruster_events.0.time_s": {**shared, "minimum": 30.0, "maximum": 40.0},
            "thruster_events.1.time_s": {**shared, "minimum": 45.0, "maximum": 55.0},
        }
        campaign = {"managers": ["bt"], "runs": 1, "seed": 100, "perturbations": perturbed}
        campaign["runs_per_draw"] = 5
        assert export_config(loaded, campaign, "1.4")[1] == ()
        texts, lost = export_config(loaded, campaign, "1.5")
        assert "thruster_events_random_interval" not in texts[RUNNER_FILE]
        assert any(line.startswith("perturbations: ") for line in lost)


class TestWhatTheExemplarCannotExpress:
    def test_is_named_for_the_shipped_scenarios(self):
        assert lost_lines("release15").startswith("battery: nothing here")
        assert lost_lines("release15").count("\n") == 0
        assert "no experiment runner before 1.4" in lost_lines("seams2023")
        assert "signals.water_visibility: constant here, sinusoid in the exemplar" in lost_lines(
            "planta_exp1"
        )
        words = (
            "revision.spiral.centre",
            "knowledge.ontologies",
            "modes_file",
            "metrics",
            "requirements.find_early",
        )
        assert all(f"{word}: " in lost_lines("extended") for word in words)

    def test_is_named_for_another_revision(self):
        lost = lost_lines("seams2023", "1.5")
        assert "revision: 2023 here; the code that reads the files is 1.5's" in lost
        assert "calibration.origin_y_m: -0.2 here, 0.0 in the exemplar" in lost
        assert "managers.metacontrol.reasoning_period_s: 2.0 here, 1.5 in the exemplar" in lost
        assert "revision." not in lost

    @pytest.mark.parametrize(
        ("values", "words"),
        [
            (
                {"mission.time_limit_s": 240.7},
                "mission.time_limit_s: 240.7 here, 241.0 in the exemplar",
            ),
            (
                {"start.x_m": {"distribution": "uniform", "minimum": -3, "maximum": -2}},
                "start.x_m: {",
            ),
            (
                {
                    "thruster_events": [
                        {"thruster": 1, "event": "failure", "time_s": 3, "recoverable": False}
                    ]
                },
                "thruster_e",
            ),
            ({"current.wave": {"mean_m_per_s": 0.1}}, "current.wave: {"),
            ({"current.x_m_per_s": 0.1}, "current.x_m_per_s: 0.1 here, 0.0 in the exemplar"),
            ({"signals.water_visibility.noise": 0.1}, "signals.water_visibility.noise: 0.1 here"),
            (
                {"battery.mission_ends_at_level": 0.0},
                "battery.mission_ends_at_level: 0.0 here, nothing in",
            ),
        ],
    )
    def test_is_named_value_by_value(self, values, words):
        (line,) = export_config(
            with_values(BLANK["1.5"], values), {"managers": ["bt"], "runs": 2, "seed": 1}
        )[1]
        assert line.startswith(words)

    @pytest.mark.parametrize(
        ("campaign", "words"),
        [
            (
                {"managers": ["oracle", "bt"]},
                "managers: ['oracle', 'bt'] here, ['bt'] in the exemplar",
            ),
            ({"sweep": {"start.x_m": [1, 2]}}, "sweep: {"),
            (
                {
                    "perturbations": {
                        "current.x_m_per_s": {"distribution": "uniform", "minimum": 0, "maximum": 1}
                    }
                },
                "perturb",
            ),
        ],
    )
    def test_is_named_for_a_campaign(self, campaign, words):
        lost = export_config(BLANK["1.5"], {"managers": ["bt"], "runs": 2, "seed": 1, **campaign})[
            1
        ]
        assert lost[0].startswith(words)

    def test_is_refused_where_nothing_is_left(self):
        with pytest.raises(InputError, match="none of the managers oracle"):
            export_config(BLANK["1.5"], {"managers": ["oracle"], "runs": 2, "seed": 1})
        with pytest.raises(InputError, match=r"no revision '1\.6'.*did you mean '1\.5'"):
            export_config(BLANK["1.5"], {}, "1.6")


@pytest.mark.parametrize("manager", ["bt", "bt_extended"])
def test_the_tree_of_the_extended_mission_has_a_program_of_its_own(manager):
    campaign = {"managers": [manager], "runs": 1, "seed": 1}
    runner = export_config(BLANK["1.5"], campaign)[0][RUNNER_FILE]
    assert ("bt_executable:=suave_bt_extended" in runner) == (manager == "bt_extended")


class TestCommand:
    def test_writes_files_that_import_config_reads(self, write, command):
        write("mine.yaml", "base: release15\nbattery: {}\nmission: {time_limit_s: 240}\n")
        write("c.yaml", "campaign: 1\nscenario: mine.yaml\nmanagers: [bt]\nruns: 3\nseed: 7\n")
        told = "written: there/mission_config.yaml, there/runner_config.yml\n"
        assert command("export-config", "c.yaml", "--out", "there") == (0, told, "")
        files = [f"there/{MISSION_FILE}", f"there/{RUNNER_FILE}"]
        assert (
            command(
                "import-config", *files, "--out", "again.yaml", "--campaign", "again_c.yaml"
            ).status
            == 0
        )
        assert load_scenario("again.yaml").scenario.mission.time_limit_s == 240
        settings = read_campaign_file("again_c.yaml").settings
        assert (settings.managers, settings.runs, settings.seed) == (("bt",), 3, 7)

    def test_values_have_the_types_of_the_nodes_parameters(self, write, command):
        write("mine.yaml", "base: release15\nmission: {time_limit_s: 240}\nstart: {x_m: -16}\n")
        assert command("export-config", "mine.yaml", "--out", "there").status == 0
        mission, runner = (
            yaml.safe_load(Path("there", name).read_text()) for name in (MISSION_FILE, RUNNER_FILE)
        )
        limit = mission["/mission_node"]["ros__parameters"]["time_limit"]
        x_m = runner["/suave_runner_node"]["ros__parameters"]["initial_pos_x"]
        assert (type(limit), type(x_m)) == (int, float)  # ROS 2 refuses a parameter of another type

    def test_replaces_nothing_unasked(self, write, command):
        write("there/mission_config.yaml", "kept")
        status, _, error = command("export-config", "release15", "--out", "there")
        assert status == 2 and "exists already" in error
        assert Path("there/mission_config.yaml").read_text() == "kept"

    def test_replaces_files_if_asked_to(self, write, command):
        write("there/mission_config.yaml", "replaced")
        assert command("export-config", "release15", "--out", "there", "--overwrite").status == 0
        assert Path("there/mission_config.yaml").read_text() != "replaced"

    def test_tells_what_is_lost(self, write, command):
        status, out, _ = command("export-config", "release15", "--out", ".")
        assert status == 0 and out.startswith("not exported: battery: nothing here")

    def test_makes_one_folder_at_most(self, write, command):
        assert command("export-config", "release15", "--out", "no/where").status == 2


def test_a_perturbation_without_its_bounds_is_refused():
    loaded = load_scenario("seams2023")
    drawn = {"start.x_m": {"distribution": "uniform", "low": -1.0, "high": 1.0}}
    campaign = {"managers": ["none"], "runs": 1, "seed": 1, "perturbations": drawn}
    with pytest.raises(InputError) as refused:
        export_config(loaded, campaign, "1.5")
    assert "has no minimum and no maximum" in str(refused.value)
