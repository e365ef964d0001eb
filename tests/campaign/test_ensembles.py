"""Each run of a campaign has one member of an ensemble, the same under all managers; differences
are told by member.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from suave_des.campaign.campaign import resume_campaign, run_campaign
from suave_des.campaign.ensembles import differences
from suave_des.campaign.variation import ENSEMBLE_COLUMN, Variation
from suave_des.errors import InputError
from suave_des.records.store import MissionKey
from suave_des.resources import shipped_folder
from suave_des.scenario.ensemble import Ensemble, read_ensemble
from suave_des.scenario.loader import load_scenario, with_values
from suave_des.simulation.simulator import Simulator
from tests.helpers import rows_of as csv_rows

GAIN = "calibration.velocity_gain_per_s"
TWO = f"member,{GAIN},loss\n1,4.0,0.2\n2,2.0,0.21\n"


@pytest.fixture
def two(tmp_path: Path) -> Path:
    path = tmp_path / "two.csv"
    path.write_text(TWO, encoding="utf-8")
    return path


def test_runs_have_the_members_in_turn_under_each_manager():
    frame = run_campaign("seams2023", ["none", "bt"], 3, ensemble="seams2023").frame()
    assert frame[ENSEMBLE_COLUMN].tolist() == [1, 2, 3, 1, 2, 3]


def test_a_run_is_the_mission_of_the_scenario_with_its_members_values(two):
    row = run_campaign("seams2023", ["none"], 2, seed=3, ensemble=two).frame().iloc[1]
    loaded = with_values(load_scenario("seams2023"), {GAIN: 2.0})
    alone = Simulator(loaded).run("none", 2, 3).metrics
    assert (row["search_time_s"], row["detection_time_s"]) == (
        alone.search_time_s,
        round(alone.detection_time_s, 6),
    )


def test_resuming_gives_the_same_bytes(two, tmp_path):
    run_campaign("seams2023", ["none", "bt"], 4, out=tmp_path / "whole", ensemble=two)
    run_campaign("seams2023", ["none", "bt"], 2, out=tmp_path / "parts", ensemble=two)
    resume_campaign(tmp_path / "parts", runs=4)
    for name in ("runs.csv", "ensemble.csv"):
        assert (tmp_path / "parts" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_a_campaign_file_names_its_ensemble_relative_to_itself(two, tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "campaign: 1\nscenario: seams2023\nruns: 2\nensemble: two.csv\n"
    )
    assert run_campaign(tmp_path / "mine.yaml", ["none"]).frame()[ENSEMBLE_COLUMN].tolist() == [
        1,
        2,
    ]


@pytest.fixture(scope="module")
def told_differences(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, str]]:
    """Rows of the file of differences between three managers."""
    folder = tmp_path_factory.mktemp("differences")
    (folder / "two.csv").write_text(TWO, encoding="utf-8")
    managers = ["none", "random", "bt"]
    run_campaign("seams2023", managers, 4, out=folder / "out", ensemble=folder / "two.csv")
    return csv_rows(folder / "out" / "ensemble.csv")


class TestFileOfDifferences:
    def test_has_a_row_for_each_pair(self, told_differences):
        assert [(row["first"], row["second"]) for row in told_differences[:3]] == [
            ("random", "none"),
            ("bt", "none"),
            ("bt", "random"),
        ]

    def test_has_rows_for_each_metric(self, told_differences):
        metrics = {row["metric"] for row in told_differences}
        assert metrics == {"search_time_s", "distance_inspected_m"}

    def test_says_of_how_many_runs_with_how_many_members_a_difference_is(self, told_differences):
        assert {(row["n"], row["members"]) for row in told_differences} == {("4", "2")}


DRIFT = "calibration.drift_y_m"


@pytest.mark.parametrize(
    "varied",
    [
        {"sweep": {DRIFT: [0.1]}},
        {"perturbations": {DRIFT: {"distribution": "uniform", "minimum": 0.1, "maximum": 1}}},
    ],
)
def test_what_the_ensemble_varies_is_not_varied_by_the_campaign_too(two, varied):
    two.write_text(TWO.replace(GAIN, DRIFT), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        run_campaign("seams2023", ["none"], 1, ensemble=two, **varied)
    assert f"varies {DRIFT}, as the campaign's" in refused.value.problem


def rows_of(by_manager: dict[int, list[float]]):
    return [
        (MissionKey(0, manager, run), (value,))
        for manager, values in by_manager.items()
        for run, value in enumerate(values, 1)
    ]


@pytest.fixture
def difference_of_two() -> dict[str, object]:
    """The difference of two managers in two runs of each of two members: -1 and -2, 5 and 5."""
    varied = Variation(ensemble=Ensemble("two", ("x",), ((1.0,), (2.0,))))
    rows = rows_of({0: [10.0, 20.0, 12.0, 22.0], 1: [9.0, 25.0, 10.0, 27.0]})
    (found,) = differences(varied, rows, ["none", "bt"], {"search_time_s": 0})
    return found


def test_a_difference_is_that_of_the_later_manager_from_the_earlier(difference_of_two):
    found = difference_of_two
    assert (found["first"], found["second"], found["difference"]) == ("bt", "none", 1.75)


def test_a_difference_counts_runs_as_it_counts_members(difference_of_two):
    assert (difference_of_two["n"], difference_of_two["members"]) == (4, 2)


def test_a_difference_is_told_by_member(difference_of_two):
    found = difference_of_two
    assert (found["members_below_0"], found["members_above_0"]) == (1, 1)


def test_the_interval_of_a_difference_is_over_draws_not_over_the_runs_that_share_one():
    varied = Variation(ensemble=Ensemble("two", ("x",), ((1.0,), (2.0,))))
    draws = np.random.default_rng(3).normal(5.0, 4.0, 6)
    values = np.repeat(draws, 10) + np.random.default_rng(4).normal(0.0, 0.1, 60)
    rows = rows_of({0: [0.0] * 60, 1: values.tolist()})
    shared = replace(varied, drawn={"start.x_m": "start.x_m"}, runs_per_draw=10)
    (of_draws,) = differences(shared, rows, ["none", "bt"], {"search_time_s": 0})
    means = values.reshape(6, 10).mean(axis=1)
    assert (of_draws["ci95_low"], of_draws["ci95_high"]) == pytest.approx(
        stats.t.interval(0.95, 5, means.mean(), stats.sem(means))
    )
    (of_runs,) = differences(varied, rows, ["none", "bt"], {"search_time_s": 0})
    assert (of_runs["ci95_low"], of_runs["ci95_high"]) == pytest.approx(
        stats.t.interval(0.95, 59, values.mean(), stats.sem(values))
    )


def test_a_run_that_one_manager_lacks_is_left_out():
    varied = Variation(ensemble=Ensemble("two", ("x",), ((1.0,), (2.0,))))
    rows = [row for row in rows_of({0: [1.0, 2.0], 1: [1.0, 5.0]}) if row[0] != MissionKey(0, 0, 1)]
    (found,) = differences(varied, rows, ["none", "bt"], {"search_time_s": 0})
    assert (found["n"], found["difference"]) == (1, 3.0)
    assert [found[name] for name in ("ci95_low", "ci95_high", "range95_low", "range95_high")] == [
        None
    ] * 4


def test_the_range_over_members_is_that_of_their_means():
    varied = Variation(ensemble=Ensemble("three", ("x",), ((1.0,), (2.0,), (3.0,))))
    rows = rows_of({0: [0.0] * 6, 1: [0.0, 10.0, 20.0, 2.0, 12.0, 22.0]})
    (found,) = differences(varied, rows, ["none", "bt"], {"search_time_s": 0})
    assert (found["range95_low"], found["range95_high"]) == pytest.approx(
        (11.0 - 4.302653 * 10.0 * (4 / 3) ** 0.5, 11.0 + 4.302653 * 10.0 * (4 / 3) ** 0.5), rel=1e-6
    )


SHIPPED = sorted(shipped_folder("scenarios/ensembles").glob("*.csv"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_ensemble_has_twenty_different_members_of_the_scenario_of_its_name(path):
    ensemble, _, _ = read_ensemble(path)
    assert len(set(ensemble.members)) == len(ensemble.members) >= 20
    loaded = load_scenario(path.stem)
    for member in range(1, len(ensemble.members) + 1):
        with_values(loaded, ensemble.values(member))
