"""Campaign files: sweeps, perturbations, and what is refused."""

import itertools
import sqlite3
from collections import Counter
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.campaign.campaign import resume_campaign, run_campaign
from suave_des.campaign.missions import Campaign
from suave_des.campaign.variation import Sweep, vary
from suave_des.errors import InputError
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


def test_a_campaign_file_says_what_is_run_and_options_go_before_it(tmp_path):
    path = write(tmp_path, HEAD)
    result = run_campaign(path)
    assert (
        result.campaign.spec.managers,
        result.campaign.spec.runs,
        result.campaign.spec.seed,
    ) == (
        ("none", "random"),
        4,
        7,
    )
    assert result.rows == run_campaign("seams2023", ["none", "random"], 4, 7).rows
    other = run_campaign(path, ["none"], 2, 8)
    assert (other.campaign.spec.managers, other.campaign.spec.runs, other.campaign.spec.seed) == (
        ("none",),
        2,
        8,
    )


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


def test_a_grid_combines_each_with_each_and_the_last_named_changes_fastest():
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


def test_perturbations_are_the_same_for_all_managers_and_points_and_within_their_bounds(tmp_path):
    perturbations = f"perturbations:\n  start.x_m: {UNIFORM % (-18, -16)}\n  visibility.shift_s: {UNIFORM % (-9, 9)}\n"
    path = write(tmp_path, HEAD + perturbations + "sweep:\n  visibility.period_s: [40, 120]\n")
    run_campaign(path, out=tmp_path / "out")
    rows = rows_of(tmp_path / "out")
    by_run: dict[str, set[tuple[str, str]]] = {}
    for row in rows:
        by_run.setdefault(row["run"], set()).add((row["start.x_m"], row["visibility.shift_s"]))
        assert round(float(row["start.x_m"]), 6) == float(row["initial_x_m"])
        assert -18 <= float(row["start.x_m"]) <= -16
        assert -9 <= float(row["visibility.shift_s"]) <= 9
    assert all(len(drawn) == 1 for drawn in by_run.values())
    assert len({next(iter(drawn)) for drawn in by_run.values()}) == 4


def test_runs_in_a_row_may_share_what_is_drawn_and_nothing_else(tmp_path):
    text = HEAD + f"perturbations:\n  start.x_m: {UNIFORM % (-18, -16)}\n"
    shared = run_campaign(write(tmp_path, text + "runs_per_draw: 3\n"), ["none"], 7).frame()
    single = run_campaign(write(tmp_path, text), ["none"], 7).frame()
    firsts = [1, 1, 1, 4, 4, 4, 7]
    assert list(shared["start.x_m"]) == [single["start.x_m"][first - 1] for first in firsts]
    # drawn by the scenario, each run its own
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


@pytest.mark.usefixtures("quick_workers")
def test_a_sweep_gives_the_same_bytes_on_any_number_of_workers_and_when_resumed(tmp_path):
    text = HEAD + f"perturbations:\n  start.x_m: {UNIFORM % (-18, -16)}\n"
    path = write(tmp_path, text + "sweep: {visibility.period_s: [40, 50, 70, 90]}\n")
    run_campaign(path, workers=1, out=tmp_path / "one")
    run_campaign(path, workers=2, out=tmp_path / "two")
    run_campaign(path, runs=2, out=tmp_path / "resumed")
    resume_campaign(tmp_path / "resumed", runs=4)
    whole = (tmp_path / "one" / "runs.csv").read_bytes()
    assert (
        whole
        == (tmp_path / "two" / "runs.csv").read_bytes()
        == (tmp_path / "resumed" / "runs.csv").read_bytes()
    )
    summaries = [
        (tmp_path / name / "summary.csv").read_bytes() for name in ("one", "two", "resumed")
    ]
    assert len(set(summaries)) == 1 and summaries[0].count(b"\n") == 1 + 4 * 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("campaign: 2\nscenario: seams2023\n", "line 1, campaign: "),
        ("campaign: 1\n", "scenario: is missing"),
        (HEAD + "sweeps: {}\n", "line 6, sweeps: unknown key 'sweeps' (did you mean 'sweep'?"),
        (HEAD + "sweep:\n  visibility.perod_s: [40]\n", "line 7, sweep.visibility.perod_s: "),
        (
            HEAD + "sweep:\n  visibility.period_s: 40\n",
            "line 7, sweep.visibility.period_s: 40 should be a list",
        ),
        (
            HEAD + "sweep:\n  visibility.period_s: [40, -3]\n",
            "line 7, sweep.visibility.period_s: at",
        ),
        (
            HEAD + "sweep:\n  visibility.period_s: [40, 3, 40.0]\n",
            "line 7, sweep.visibility.period_s: has a poi",
        ),
        (HEAD + "sweep:\n  zip: {start.x_m: [1, 1], start.y_m: [2, 2.0]}\n", "has a point twice"),
        (HEAD + "sweep:\n  modes_file: [a.yaml]\n", "files were read with the scenario"),
        (HEAD + "sweep:\n  grid: {}\n  start.x_m: [1]\n", "line 8, sweep.start.x_m: unknown key"),
        (
            HEAD + "sweep:\n  zip: {start.x_m: [1], start.y_m: [1, 2]}\n",
            "start.x_m has 1, start.y_m has 2",
        ),
        (
            HEAD + "perturbations:\n  start.x_m: 3\n",
            "line 7, perturbations.start.x_m: expected a distribution, got 3",
        ),
        (
            HEAD + f"perturbations:\n  latencies.mode_change_s: {UNIFORM % (1, 2)}\n",
            "is drawn at each use, not once",
        ),
        (
            HEAD + f"perturbations:\n  mission.time_limit_s: {UNIFORM % (1, 2)}\n",
            "line 7, perturbations.mission.ti",
        ),
        (
            HEAD + f"perturbations:\n  start.x_m: {UNIFORM % (1, 2)}\nsweep:\n  start.x_m: [1]\n",
            "varies start.x_m, as",
        ),
    ],
)
def test_bad_campaign_files(tmp_path, text, message):
    with pytest.raises(InputError) as raised:
        run_campaign(write(tmp_path, text), out=tmp_path / "out")
    assert message in str(raised.value) and str(raised.value).startswith(str(tmp_path))
    assert not (tmp_path / "out").exists()


def test_a_failure_in_a_sweep_names_its_point(tmp_path):
    sweep = {"visibility.period_s": [40.0, 80.0]}
    result = run_campaign(
        "seams2023", [f"{AWKWARD}:RaisesAlways"], 1, 1, sweep=sweep, out=tmp_path / "out"
    )
    assert [failure.point for failure in result.failures] == [0, 1]
    assert '"visibility.period_s": 80.0' in (tmp_path / "out" / "manifest.json").read_text(
        encoding="utf-8"
    )


@pytest.mark.usefixtures("quick_workers")
def test_knowledge_states_are_kept_as_run_keeps_them_and_resumed_to_the_same_bytes(tmp_path):
    sweep = {"visibility.period_s": [40.0, 80.0]}
    managers = ["none", "metacontrol"]

    def run(runs: int, workers: int, out: Path) -> bytes:
        run_campaign(
            "seams2023", managers, runs, 3, workers, out, sweep=sweep, record_knowledge=True
        )
        return (out / CAMPAIGN_KNOWLEDGE_FILE).read_bytes()

    whole = run(3, 1, tmp_path / "whole")
    assert run(3, 2, tmp_path / "two") == whole
    run(1, 1, tmp_path / "resumed")
    resume_campaign(tmp_path / "resumed", runs=3)
    assert (tmp_path / "resumed" / CAMPAIGN_KNOWLEDGE_FILE).read_bytes() == whole

    missions = list(read_missions(tmp_path / "whole" / CAMPAIGN_KNOWLEDGE_FILE))
    assert [(each.manager, each.point, each.run) for each in missions] == [
        ("metacontrol", point, run) for point in (0, 1) for run in (1, 2, 3)
    ]
    loaded = with_values(load_scenario("seams2023"), {"signals.water_visibility.period_s": 80.0})
    alone = Simulator(loaded).run("metacontrol", 2, 3, record=True).knowledge
    assert [each.state for each in missions[4].records] == [each.state for each in alone]
    plain = run_campaign("seams2023", managers, 3, 3, sweep=sweep)
    assert (
        run_campaign("seams2023", managers, 3, 3, sweep=sweep, record_knowledge=True).rows
        == plain.rows
    )


def test_a_key_without_its_section_is_told_with_it(tmp_path):
    path = write(tmp_path, HEAD + "sweep:\n  metacontrol.reasoning_period_s: [1, 2]\n")
    with pytest.raises(InputError, match=r"line 7, .*did you mean managers\.metacontrol or"):
        run_campaign(path)


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


def test_they_are_run_once_and_have_a_row_at_each_point():
    sweep = {"visibility.period_s": [40.0, 80.0], **SETTINGS}
    found = run_campaign("seams2023", list(READ_BY), 2, sweep=sweep)
    runs_of = Counter(found.campaign.spec.managers[key.manager] for key in planned(found.campaign))
    assert runs_of == {name: 2 * 2 * 2**read for name, read in READ_BY.items()}
    assert len(found.rows) == found.campaign.planned == 6 * 2 * 16
    loaded = load_scenario("seams2023")
    values = dict(zip(sweep, (80.0, 4.0, 10.0, 2.0), strict=True))
    number = 2 * 6 * (8 + 4 + 1)
    row = dict(zip(found.columns, found.rows[number + 3], strict=True))
    paths = {"signals.water_visibility.period_s": 80.0, **{k: values[k] for k in SETTINGS}}
    metrics = Simulator(with_values(loaded, paths)).run("random", 2, 1).metrics
    assert {name: row[name] for name in sweep} == values
    assert (row["manager"], row["run"]) == ("random", 2)
    assert row["search_time_s"] == metrics.search_time_s


def test_of_a_campaign_that_has_only_the_first_of_them_the_others_are_run(tmp_path):
    sweep = {"managers.metacontrol.reasoning_period_s": [1.0, 4.0]}
    whole = run_campaign("seams2023", ["none"], 2, sweep=sweep, out=tmp_path / "out")
    with closing(sqlite3.connect(tmp_path / "out" / STORE_FILE)) as store, store:
        store.execute("DELETE FROM outcomes WHERE point = 1 AND run = 2")
    assert resume_campaign(tmp_path / "out").rows == whole.rows
