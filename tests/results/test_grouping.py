"""What is averaged before managers are compared: values over the same points and runs, and runs
that share a draw.
"""

import json
from itertools import product
from pathlib import Path

import numpy as np
import pandas
import pytest
from scipy import stats

from suave_des import api
from suave_des.campaign.campaign import run_campaign
from suave_des.errors import InputError
from suave_des.estimates import mean_of, std_of
from suave_des.results.compare import compare_folders
from suave_des.results.comparison import Comparison
from tests.helpers.compared import compare_frame, interval, rows

PUBLISHED = Path(__file__).parents[2] / "scenarios" / "published"


def two_points(**changed: float) -> pandas.DataFrame:
    """Missions of managers a and b at two points of a sweep, with equal reaction times: 2 s, and 6
    s at the second.
    """
    frame = pandas.DataFrame(
        product("ab", range(1, 41), [0.0, 1.0]), columns=["manager", "run", "start.y_m"]
    )
    frame = frame.assign(
        scenario="s", seed=1, search_time_s=100.0 + frame["run"], distance_inspected_m=50.0
    )
    frame = frame.assign(pipeline_found=True, mean_reaction_time_s=2.0 + 4.0 * frame["start.y_m"])
    return frame.assign(**changed)


def reactions(frame: pandas.DataFrame) -> Comparison:
    return compare_frame(frame, metrics=["mean_reaction_time_s"])


def test_a_sweep_averages_a_metric_only_of_runs_that_have_it_at_all_points():
    frame = two_points()
    lacks = (frame["manager"] == "b") & (frame["start.y_m"] == 1.0) & (frame["run"] <= 20)
    frame.loc[lacks, "mean_reaction_time_s"] = float("nan")
    comparison = reactions(frame)
    found = rows(comparison.differences)[0]
    assert found.n == 20
    assert found.difference == 0.0
    assert [(each.n, each.missing) for each in rows(comparison.summaries)] == [(40, 0), (20, 20)]
    assert any(
        "b 20 of 40" in note and "without a mean reaction time" in note for note in comparison.notes
    )
    assert rows(compare_frame(frame, metrics=["search_time_s"]).differences)[0].n == 40


def test_so_do_means_over_the_runs_of_a_draw():
    frame = two_points().query("`start.y_m` == 0.0").drop(columns="start.y_m")
    frame["mean_reaction_time_s"] = 2.0 + frame["run"] % 4
    lacks = (frame["manager"] == "b") & frame["run"].isin([3, 7, 11])
    frame.loc[lacks, "mean_reaction_time_s"] = float("nan")
    frame.attrs["runs_sharing_draw"] = 4
    comparison = reactions(frame)
    found = rows(comparison.differences)[0]
    assert found.n == 7
    assert found.difference == 0.0
    assert any("b 3 of 10" in note for note in comparison.notes)


def test_a_draw_without_one_of_its_missions_is_left_out_unless_no_manager_has_it():
    frame = two_points().query("`start.y_m` == 0.0 and run <= 10").drop(columns="start.y_m")
    frame.attrs["runs_sharing_draw"] = 4  # the third draw has only two runs
    assert compare_frame(frame).differences["n"][0] == 3
    failed = frame[(frame["manager"] == "a") | (frame["run"] != 2)]
    failed.attrs["runs_sharing_draw"] = 4
    comparison = compare_frame(failed)
    assert comparison.differences["n"][0] == 2
    assert any("draws that lack a run (b 1 of 3) are left out" in note for note in comparison.notes)


def test_the_runs_that_lack_a_point_are_counted_as_runs_where_draws_are_compared():
    frame = two_points()
    frame = frame[(frame["manager"] == "a") | (frame["run"] != 7) | (frame["start.y_m"] == 0.0)]
    frame.attrs["runs_sharing_draw"] = 5
    notes = "\n".join(compare_frame(frame).notes)
    assert "runs that lack a point of the sweep (b 1 of 40) are left out" in notes
    assert "draws that lack a run (b 1 of 8) are left out" in notes


def test_where_no_draw_of_a_manager_is_whole_nothing_else_is_said_of_its_missions():
    frame = two_points().query("`start.y_m` == 0.0").drop(columns="start.y_m")
    frame = frame[(frame["manager"] == "a") | (frame["run"] <= 3)]
    frame.attrs["runs_sharing_draw"] = 5
    notes = "\n".join(compare_frame(frame).notes)
    assert "draws that lack a run (b 1 of 1) are left out" in notes
    assert "found the pipeline" not in notes


def test_without_any_whole_draw_there_is_nothing_to_compare():
    frame = two_points().query("`start.y_m` == 0.0").drop(columns="start.y_m")
    frame = frame[frame["run"] <= 10]
    frame.attrs["runs_sharing_draw"] = 5
    frame = frame[(frame["manager"] == "a") == (frame["run"] % 5 != 0)]
    frame.attrs["runs_sharing_draw"] = 5
    with pytest.raises(InputError, match="no manager has all runs of a draw"):
        compare_frame(frame)


def test_a_manager_that_lacks_a_point_altogether_is_not_compared_at_the_others():
    frame = two_points()
    comparison = reactions(frame[(frame["manager"] == "a") | (frame["start.y_m"] == 0.0)])
    assert comparison.differences["test"][0] is None
    assert any("lack a point of the sweep (b 40 of 40)" in note for note in comparison.notes)


@pytest.fixture(scope="module")
def of_draws(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("draws") / "simulated"
    drawn = {"start.y_m": {"distribution": "uniform", "minimum": 1.5, "maximum": 3.5}}
    run_campaign("seams2023", ["none"], 20, 1, out=out, runs_per_draw=5, perturbations=drawn)
    return out


@pytest.mark.parametrize("has_run_numbers", [True, False])
def test_real_missions_are_not_averaged_like_the_campaign_beside_them(
    of_draws, tmp_path, has_run_numbers
):
    real = pandas.read_csv(PUBLISHED / "seams2023_runs.csv").query("manager == 'none'")
    real = real if has_run_numbers else real.drop(columns="run")
    real.to_csv(tmp_path / "real.csv", index=False)
    comparison = compare_folders([of_draws, tmp_path / "real.csv"], metrics=["search_time_s"])
    simulated, published = rows(comparison.summaries)
    assert (simulated.n, published.n) == (4, 20)
    assert published.mean == pytest.approx(real["search_time_s"].mean())
    assert published.horizon_s > 0.0 and simulated.horizon_s is None
    assert any("(runs_per_draw) of simulated are averaged" in note for note in comparison.notes)


def test_further_metrics_are_not_what_was_swept(tmp_path):
    sweep = {"grid": {"battery.discharge_time_s": [150.0, 200.0]}}
    run_campaign("extended", ["none", "metacontrol"], 3, 1, out=tmp_path / "out", sweep=sweep)
    runs = pandas.read_csv(tmp_path / "out" / "runs.csv")
    # it differs between the points
    assert runs.groupby(["manager", "run"])["battery_level"].nunique().max() == 2
    for comparison in (compare_folders([tmp_path / "out"]), compare_frame(runs)):
        (note,) = (note for note in comparison.notes if "averaged over" in note)
        assert "averaged over battery.discharge_time_s:" in note
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["sweep"] == sweep


def test_duplicates_are_noticed_although_a_further_metric_differs(tmp_path):
    run_campaign("extended", ["none"], 2, 1, out=tmp_path / "out")
    runs = pandas.read_csv(tmp_path / "out" / "runs.csv")
    twice = pandas.concat([runs, runs.assign(battery_level=0.5)])
    with pytest.raises(Exception, match="run 1 of none with seed 1 is there twice"):
        compare_frame(twice)


def test_missions_that_end_early_are_not_said_to_have_reached_the_limit():
    frame = two_points().query("`start.y_m` == 0.0").drop(columns="start.y_m")
    lost = (frame["manager"] == "b") & (frame["run"] <= 10)
    frame.loc[lost, "pipeline_found"] = False
    frame.loc[lost, "search_time_s"] = 300.0
    assert any("mean up to that limit" in note for note in compare_frame(frame).notes)
    frame.loc[lost, "search_time_s"] = 190.0 + frame["run"]  # the battery was empty
    notes = compare_frame(frame).notes
    assert any("by 200 s (b 10 of 40) count with 200 s" in note for note in notes)
    assert (
        "some missions ended earlier without it (b after 191 to 198 s), which is no short search"
        in notes
    )


def test_managers_that_lack_different_points_are_not_compared_over_these():
    frame = two_points()
    third = frame[frame["start.y_m"] == 0.0].assign(**{"start.y_m": 2.0})
    frame = pandas.concat([frame, third])
    lacked = frame["manager"].map({"a": 0.0, "b": 1.0})
    with pytest.raises(InputError, match="no manager has a run with missions at all points"):
        reactions(frame[frame["start.y_m"] != lacked])  # each has two points of three


VARIED = {
    "runs_per_draw": 4,
    "perturbations": {"start.y_m": {"distribution": "uniform", "minimum": 1.5, "maximum": 3.5}},
}


def means_of_draws(runs: pandas.DataFrame, metric: str) -> pandas.DataFrame:
    """Return the means of draws, a column for each manager."""
    draw = (runs["run"] - 1) // VARIED["runs_per_draw"]
    return runs.groupby(["manager", draw], observed=True)[metric].mean().unstack(0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("draws") / "out"
    run_campaign("seams2023", ["none", "bt"], 24, 1, out=out, **VARIED)
    return out


def test_the_interval_is_that_of_the_means_of_groups_of_one_size():
    values = np.random.default_rng(1).normal(100.0, 3.0, (7, 5)) + np.arange(7)[:, None]
    means = values.mean(axis=1)
    low, high = stats.t.interval(0.95, 6, means.mean(), stats.sem(means))
    groups = np.repeat(np.arange(7), 5).tolist()
    assert mean_of(values.ravel().tolist(), groups).interval == pytest.approx((low, high))
    assert mean_of([1.0, 2.0], [0, 0]).interval is None


def test_groups_of_equal_means_do_not_give_an_interval_without_width():
    interval = mean_of([120.0, 121.0, 121.0, 120.0], [0, 0, 1, 1]).interval
    assert interval == pytest.approx(
        stats.t.interval(0.95, 3, 120.5, stats.sem([120.0, 121.0, 121.0, 120.0]))
    )


def test_the_summary_has_the_interval_of_the_draws(folder):
    runs, summary = (
        pandas.read_csv(folder / "runs.csv"),
        pandas.read_csv(folder / "summary.csv").set_index("manager"),
    )
    means = means_of_draws(runs, "search_time_s")["none"]
    low, high = stats.t.interval(0.95, len(means) - 1, means.mean(), stats.sem(means))
    assert summary.loc["none", "search_time_s_ci95_low"] == pytest.approx(low, abs=1e-5)
    assert summary.loc["none", "search_time_s_ci95_high"] == pytest.approx(high, abs=1e-5)
    times_s = runs.loc[runs["manager"] == "none", "search_time_s"].tolist()
    naive = mean_of(times_s)
    assert summary.loc["none", "search_time_s_std"] == pytest.approx(
        std_of(times_s).value, abs=1e-5
    )
    assert high - low > 1.5 * (naive.high - naive.low)


def test_a_comparison_takes_the_draws_for_independent(folder):
    means = means_of_draws(pandas.read_csv(folder / "runs.csv"), "search_time_s")
    comparison = compare_folders([folder])
    found = rows(comparison.differences)[0]
    assert found.n == 6
    assert interval(found, "difference") == pytest.approx(
        tuple(stats.ttest_rel(means["none"], means["bt"]).confidence_interval())
    )
    assert any("4 runs that share each draw" in note for note in comparison.notes)
    assert "footnotesize 6 draws for each manager." in comparison.latex()


def test_campaigns_with_other_draws_are_paired_by_the_same_runs(folder, tmp_path):
    run_campaign(
        "seams2023", ["none"], 24, 1, out=tmp_path / "other", **(VARIED | {"runs_per_draw": 3})
    )
    comparison = compare_folders([folder, tmp_path / "other"], managers=["none"])
    found = rows(comparison.differences)[0]
    means = []
    for each in (folder, tmp_path / "other"):
        runs = pandas.read_csv(each / "runs.csv").query("manager == 'none'")
        means.append(runs.groupby((runs["run"] - 1) // 12)["search_time_s"].mean())
    assert found.n == 2
    assert found.difference == pytest.approx((means[0] - means[1]).mean())
    assert "left out" not in found.why
    assert any("every 12 runs, of which some share a draw" in note for note in comparison.notes)


def test_intervals_of_shares_of_draws_stay_between_0_1():
    found = [True] * 39 + [False]
    cells = [
        (manager, run + 1, found[run] or manager == "a") for manager in "ab" for run in range(40)
    ]
    frame = pandas.DataFrame(cells, columns=["manager", "run", "pipeline_found"])
    frame = frame.assign(
        seed=1,
        scenario="s",
        search_time_s=100.0,
        distance_inspected_m=1.0,
        mean_reaction_time_s=1.0,
    )
    frame.attrs["runs_sharing_draw"] = 4
    for unpaired in (False, True):
        (a, b) = rows(compare_frame(frame, metrics=["pipeline_found"], unpaired=unpaired).summaries)
        assert (a.mean, interval(a, "mean")) == (1.0, None)
        assert interval(b, "mean")[1] == 1.0 > b.mean > interval(b, "mean")[0]


def test_so_does_that_of_a_data_frame():
    frame = api.run_campaign("seams2023", ["none", "bt"], runs=8, progress=False, **VARIED)
    assert frame.compare().differences["n"][0] == compare_frame(frame).differences["n"][0] == 2
    other = api.run_campaign("seams2023", ["none", "bt"], runs=8, seed=2, progress=False, **VARIED)
    assert compare_frame(pandas.concat([frame, other])).differences["n"][0] == 4


def test_runs_without_perturbations_are_independent(tmp_path):
    run_campaign("seams2023", ["none", "bt"], 8, 1, out=tmp_path / "out", runs_per_draw=4)
    assert compare_folders([tmp_path / "out"]).differences["n"][0] == 8
