"""Campaign files: sweeps, perturbations, and what is refused."""

import itertools
import sqlite3
from collections import Counter
from contextlib import closing
from pathlib import Path
from typing import Any

import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.campaign.campaign import resume_campaign, run_campaign
from suave_des.campaign.missions import Campaign
from suave_des.campaign.results import CampaignResult
from suave_des.campaign.variation import Sweep, vary
from suave_des.records.mission_folder import CAMPAIGN_KNOWLEDGE_FILE, read_missions
from suave_des.records.store import STORE_FILE, MissionKey
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator
from tests.helpers import AWKWARD, rows_of

HEAD = "campaign: 1\nscenario: seams2023\nmanagers: [none, random]\nruns: 4\nseed: 7\n"
UNIFORM = "{distribution: uniform, minimum: %s, maximum: %s}"


def write(folder: Path, text: str) -> Path:
    path = folder / "campaign.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def asked_for(result: CampaignResult) -> tuple[tuple[str, ...], int, int]:
    """Managers, runs and seed of a campaign."""
    spec = result.campaign.spec
    return spec.managers, spec.runs, spec.seed


def test_a_campaign_file_says_what_is_run(tmp_path):
    result = run_campaign(write(tmp_path, HEAD))
    assert asked_for(result) == (("none", "random"), 4, 7)
    assert result.rows == run_campaign("seams2023", ["none", "random"], 4, 7).rows


def test_options_go_before_a_campaign_file(tmp_path):
    assert asked_for(run_campaign(write(tmp_path, HEAD), ["none"], 2, 8)) == (("none",), 2, 8)


def test_each_value_of_a_sweep_gives_the_missions_of_a_scenario_that_has_it(tmp_path):
    path = write(tmp_path, HEAD + "sweep:\n  visibility.period_s: [40, 120]\n")
    run_campaign(path, out=tmp_path / "out")
    rows = rows_of(tmp_path / "out")
    assert [row["visibility.period_s"] for row in rows] == ["40"] * 8 + ["120"] * 8
    loaded = with_values(load_scenario("seams2023"), {"signals.water_visibility.period_s": 120.0})
    metrics = Simulator(loaded).run("random", 3, 7).metrics
    assert float(rows[14]["search_time_s"]) == metrics.search_time_s
    assert float(rows[14]["distance_inspected_m"]) == pytest.approx(
        metrics.distance_inspected_m, abs=1e-6
    )


def test_a_grid_is_every_combination_the_last_named_changing_fastest():
    sweep = Sweep(grid={"a": [1, 2], "b": [3, 4, 5]}, zip={"c": [6, 7], "d": [8, 9]})
    points = [tuple(sweep.values(point).values()) for point in range(sweep.points)]
    assert points == [
        (a, b, *cd) for a, b, cd in itertools.product([1, 2], [3, 4, 5], [(6, 8), (7, 9)])
    ]


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(1, 4), min_size=0, max_size=4))
def test_points_with_each_value_have_each_value(sizes):
    sweep = Sweep(grid={f"p{place}": list(range(size)) for place, size in enumerate(sizes)})
    met = [sweep.values(point) for point in sweep.each_value()]
    for path, values in sweep.grid.items():
        assert {point[path] for point in met} == set(values)


@pytest.fixture(scope="module")
def perturbed(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, str]]:
    """Rows of a sweep in which two values are drawn."""
    folder = tmp_path_factory.mktemp("perturbed")
    perturbations = f"perturbations:\n  start.x_m: {UNIFORM % (-18, -16)}\n  visibility.shift_s: {UNIFORM % (-9, 9)}\n"
    path = write(folder, HEAD + perturbations + "sweep:\n  visibility.period_s: [40, 120]\n")
    run_campaign(path, out=folder / "out")
    return rows_of(folder / "out")


class TestPerturbations:
    @pytest.fixture
    def by_run(self, perturbed: list[dict[str, str]]) -> list[set[tuple[str, str]]]:
        """What was drawn in the missions of each run."""
        drawn: dict[str, set[tuple[str, str]]] = {}
        for row in perturbed:
            drawn.setdefault(row["run"], set()).add((row["start.x_m"], row["visibility.shift_s"]))
        return list(drawn.values())

    def test_are_the_same_in_all_missions_of_a_run(self, by_run):
        assert [len(drawn) for drawn in by_run] == [1] * 4

    def test_differ_from_run_to_run(self, by_run):
        assert len(set.union(*by_run)) == 4

    def test_are_those_of_the_mission(self, perturbed):
        for row in perturbed:
            assert round(float(row["start.x_m"]), 6) == float(row["initial_x_m"])

    @pytest.mark.parametrize(
        ("name", "least", "most"), [("start.x_m", -18, -16), ("visibility.shift_s", -9, 9)]
    )
    def test_are_within_their_bounds(self, perturbed, name, least, most):
        assert all(least <= float(row[name]) <= most for row in perturbed)


@pytest.fixture(scope="module")
def shared_draws(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[pandas.DataFrame, pandas.DataFrame]:
    """Missions of runs of which three in a row share a draw, and of runs that share none."""
    text = HEAD + f"perturbations:\n  start.x_m: {UNIFORM % (-18, -16)}\n"
    path = write(tmp_path_factory.mktemp("draws"), text + "runs_per_draw: 3\n")
    shared = run_campaign(path, ["none"], 7).frame()
    return shared, run_campaign(write(path.parent, text), ["none"], 7).frame()


def test_runs_in_a_row_may_share_what_is_drawn(shared_draws):
    shared, single = shared_draws
    firsts = [1, 1, 1, 4, 4, 4, 7]
    assert list(shared["start.x_m"]) == [single["start.x_m"][first - 1] for first in firsts]


def test_runs_that_share_a_draw_share_nothing_that_the_scenario_draws(shared_draws):
    shared, single = shared_draws
    assert list(shared["initial_y_m"]) == list(single["initial_y_m"])


def times_of_events(runs_per_draw: int) -> list[tuple[float, float]]:
    """Times of two events in runs 1 to 3, the first perturbed: 25 s lie between their intervals,
    and they share a draw.
    """
    drawn = {"distribution": "uniform", "shared": "shift"}
    first, second = ({**drawn, "minimum": low, "maximum": low + 20} for low in (30, 55))
    events = [
        {"thruster": number, "event": "failure", "time_s": time_s}
        for number, time_s in ((1, 40.0), (2, second))
    ]
    loaded = with_values(load_scenario("seams2023"), {"thruster_events": events})
    loaded, variation = vary(loaded, {}, {"thruster_events.0.time_s": first}, runs_per_draw)
    simulator = Simulator(loaded, dict.fromkeys(variation.drawn, variation.runs_per_draw))
    keys = [f"thruster_events.{number}.time_s" for number in (0, 1)]
    runs = (simulator.run("none", run, 5).drawn for run in (1, 2, 3))
    return [(drawn[keys[0]], drawn[keys[1]]) for drawn in runs]


def test_keys_that_share_a_draw_share_it_where_runs_share_that_of_one_of_them():
    assert [later - earlier for earlier, later in times_of_events(3)] == pytest.approx([25.0] * 3)


def test_a_draw_that_keys_share_is_the_same_in_the_runs_that_share_it():
    assert len(set(times_of_events(3))) == 1
    assert len(set(times_of_events(1))) == 3


@settings(max_examples=5, deadline=None)
@given(
    st.integers(0, 2**31),
    st.lists(st.sampled_from([40.0, 60.0, 100.0]), min_size=1, max_size=3, unique=True),
)
def test_more_points_managers_or_noise_change_no_other_row(seed, periods):
    def rows(
        managers: list[str], runs: int, periods: list[float], **more: Any
    ) -> set[tuple[object, ...]]:
        sweep = {"visibility.period_s": periods}
        return set(run_campaign("seams2023", managers, runs, seed, sweep=sweep, **more).rows)

    assert rows(["none"], 1, periods) <= rows(["random", "none"], 2, [*periods, 77.0])
    drawn = {"thruster_events.0.time_s": {"distribution": "uniform", "minimum": 30, "maximum": 40}}
    alone = {row[:-1] for row in rows(["none"], 1, periods, perturbations=drawn)}
    noisier = {
        **drawn,
        "current.z_m_per_s": {"distribution": "uniform", "minimum": 0, "maximum": 0},
    }
    assert alone == {row[:-2] for row in rows(["none"], 1, periods, perturbations=noisier)}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a campaign file, with the results of its sweep in one process in `out`."""
    folder = tmp_path_factory.mktemp("whole")
    text = HEAD + f"perturbations:\n  start.x_m: {UNIFORM % (-18, -16)}\n"
    path = write(folder, text + "sweep: {visibility.period_s: [40, 50, 70, 90]}\n")
    run_campaign(path, workers=1, out=folder / "out")
    return folder


def assert_has_the_bytes_of(whole: Path, out: Path) -> None:
    for name in ("runs.csv", "summary.csv"):
        assert (out / name).read_bytes() == (whole / "out" / name).read_bytes()


def test_the_summary_of_a_sweep_has_a_row_for_each_manager_at_each_point(whole):
    assert len(rows_of(whole / "out" / "summary.csv")) == 4 * 2


@pytest.mark.usefixtures("quick_workers")
def test_a_sweep_gives_the_same_bytes_on_any_number_of_workers(whole, tmp_path):
    run_campaign(whole / "campaign.yaml", workers=2, out=tmp_path)
    assert_has_the_bytes_of(whole, tmp_path)


def test_a_sweep_gives_the_same_bytes_when_it_is_resumed(whole, tmp_path):
    run_campaign(whole / "campaign.yaml", runs=2, out=tmp_path)
    resume_campaign(tmp_path, runs=4)
    assert_has_the_bytes_of(whole, tmp_path)


def test_a_failure_in_a_sweep_names_its_point(tmp_path):
    sweep = {"visibility.period_s": [40.0, 80.0]}
    result = run_campaign(
        "seams2023", [f"{AWKWARD}:RaisesAlways"], 1, 1, sweep=sweep, out=tmp_path / "out"
    )
    assert [failure.point for failure in result.failures] == [0, 1]
    assert '"visibility.period_s": 80.0' in (tmp_path / "out" / "manifest.json").read_text(
        encoding="utf-8"
    )


STATES = {"sweep": {"visibility.period_s": [40.0, 80.0]}, "record_knowledge": True}
OF_STATES = "seams2023", ["none", "metacontrol"]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[CampaignResult, Path]:
    """A sweep whose knowledge states are kept, and their file."""
    out = tmp_path_factory.mktemp("states") / "out"
    return run_campaign(*OF_STATES, 3, 3, 1, out, **STATES), out / CAMPAIGN_KNOWLEDGE_FILE


class TestKnowledgeStates:
    @pytest.mark.usefixtures("quick_workers")
    def test_have_the_same_bytes_on_any_number_of_workers(self, recorded, tmp_path):
        run_campaign(*OF_STATES, 3, 3, 2, tmp_path, **STATES)
        _, file = recorded
        assert (tmp_path / CAMPAIGN_KNOWLEDGE_FILE).read_bytes() == file.read_bytes()

    def test_have_the_same_bytes_when_the_campaign_is_resumed(self, recorded, tmp_path):
        run_campaign(*OF_STATES, 1, 3, 1, tmp_path, **STATES)
        resume_campaign(tmp_path, runs=3)
        _, file = recorded
        assert (tmp_path / CAMPAIGN_KNOWLEDGE_FILE).read_bytes() == file.read_bytes()

    def test_are_kept_of_each_mission_that_has_some(self, recorded):
        _, file = recorded
        assert [(each.manager, each.point, each.run) for each in read_missions(file)] == [
            ("metacontrol", point, run) for point in (0, 1) for run in (1, 2, 3)
        ]

    def test_are_those_that_run_keeps(self, recorded):
        _, file = recorded
        values = {"signals.water_visibility.period_s": 80.0}
        simulator = Simulator(with_values(load_scenario("seams2023"), values))
        alone = simulator.run("metacontrol", 2, 3, record=True).knowledge
        kept = list(read_missions(file))[4].records
        assert [each.state for each in kept] == [each.state for each in alone]

    def test_change_no_row(self, recorded):
        result, _ = recorded
        assert run_campaign(*OF_STATES, 3, 3, sweep=STATES["sweep"]).rows == result.rows


SETTINGS = {
    "managers.metacontrol.reasoning_period_s": [1.0, 4.0],
    "managers.random.adaptation_period_s": [10.0, 20.0],
    "managers.bt.tick_period_s": [0.1, 2.0],
}
READ_BY = {"none": 0, "random": 1, "metacontrol": 1, "bt": 1, "bt_extended": 1, "threshold": 3}
"""How many of these settings each manager may read."""


@pytest.mark.parametrize("path", SETTINGS)
def test_missions_that_a_swept_setting_cannot_touch_are_the_same_under_it(path):
    loaded = load_scenario("seams2023")
    campaign = run_campaign("seams2023", list(READ_BY), 1, sweep={path: SETTINGS[path]}).campaign
    simulators = [Simulator(with_values(loaded, {path: value})) for value in SETTINGS[path]]
    left_out = {key.manager for key in planned(campaign) if key.point == 1} ^ set(range(6))
    assert len(left_out) in (3, 4)
    for number in left_out:
        manager = campaign.spec.managers[number]
        first, second = (simulator.run(manager, 1, 1).metrics for simulator in simulators)
        assert first == second


def planned(campaign: Campaign) -> list[MissionKey]:
    return list(campaign.missions(lambda point, manager: ()))


@pytest.fixture(scope="module")
def swept_settings() -> CampaignResult:
    """A sweep of settings of which each manager may read some."""
    sweep = {"visibility.period_s": [40.0, 80.0], **SETTINGS}
    return run_campaign("seams2023", list(READ_BY), 2, sweep=sweep)


def test_missions_that_are_the_same_at_several_points_are_run_once(swept_settings):
    managers = swept_settings.campaign.spec.managers
    runs_of = Counter(managers[key.manager] for key in planned(swept_settings.campaign))
    assert runs_of == {name: 2 * 2 * 2**read for name, read in READ_BY.items()}


def test_they_have_a_row_at_each_point(swept_settings):
    assert len(swept_settings.rows) == swept_settings.campaign.planned == 6 * 2 * 16


def test_a_row_is_the_mission_with_the_values_of_its_point(swept_settings):
    number = 2 * 6 * (8 + 4 + 1)
    row = dict(zip(swept_settings.columns, swept_settings.rows[number + 3], strict=True))
    values = dict(zip(("visibility.period_s", *SETTINGS), (80.0, 4.0, 10.0, 2.0), strict=True))
    assert {name: row[name] for name in values} == values
    assert (row["manager"], row["run"]) == ("random", 2)
    paths = {"signals.water_visibility.period_s": 80.0, **{k: values[k] for k in SETTINGS}}
    simulator = Simulator(with_values(load_scenario("seams2023"), paths))
    assert row["search_time_s"] == simulator.run("random", 2, 1).metrics.search_time_s


def test_of_a_campaign_that_has_only_the_first_of_them_the_others_are_run(tmp_path):
    sweep = {"managers.metacontrol.reasoning_period_s": [1.0, 4.0]}
    whole = run_campaign("seams2023", ["none"], 2, sweep=sweep, out=tmp_path / "out")
    with closing(sqlite3.connect(tmp_path / "out" / STORE_FILE)) as store, store:
        store.execute("DELETE FROM outcomes WHERE point = 1 AND run = 2")
    assert resume_campaign(tmp_path / "out").rows == whole.rows
