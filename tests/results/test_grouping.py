"""What is averaged before managers are compared: only values over the same points and the same runs."""

from __future__ import annotations

import json
from pathlib import Path

import pandas
import pytest

from suave_des.campaign.campaign import run_campaign
from suave_des.errors import InputError
from suave_des.results.compare import compare_folders, compare_frame
from suave_des.results.comparison import Comparison
from tests.helpers.compared import rows

PUBLISHED = Path(__file__).parents[2] / "scenarios" / "published"


def two_points(**changed: float) -> pandas.DataFrame:
    """Missions of managers a and b at two points of a sweep, with equal reaction times: 2 s, and 6 s at the second."""
    rows = [
        {
            "manager": manager,
            "scenario": "s",
            "run": run,
            "seed": 1,
            "search_time_s": 100.0 + run,
            "distance_inspected_m": 50.0,
            "pipeline_found": True,
            "mean_reaction_time_s": 2.0 + 4.0 * point,
            "start.y_m": float(point),
        }
        for manager in "ab"
        for run in range(1, 41)
        for point in range(2)
    ]
    return pandas.DataFrame(rows).assign(**changed)


def reactions(frame: pandas.DataFrame) -> Comparison:
    return compare_frame(frame, metrics=["mean_reaction_time_s"])


def test_a_sweep_averages_a_metric_only_of_runs_that_have_it_at_all_points() -> None:
    frame = two_points()
    lacks = (frame["manager"] == "b") & (frame["start.y_m"] == 1.0) & (frame["run"] <= 20)
    frame.loc[lacks, "mean_reaction_time_s"] = float("nan")
    comparison = reactions(frame)
    found = rows(comparison.differences)[0]
    assert found.n == 20
    assert found.difference == 0.0
    assert [(each.n, each.missing) for each in rows(comparison.summaries)] == [(40, 0), (20, 20)]
    assert any("b 20 of 40" in note and "without a mean reaction time" in note for note in comparison.notes)
    search = rows(compare_frame(frame, metrics=["search_time_s"]).differences)[0]
    assert search.n == 40


def test_so_do_means_over_the_runs_of_a_draw() -> None:
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


def test_a_draw_without_one_of_its_missions_is_left_out_unless_no_manager_has_it() -> None:
    frame = two_points().query("`start.y_m` == 0.0 and run <= 10").drop(columns="start.y_m")
    frame.attrs["runs_sharing_draw"] = 4  # the third draw has only two runs
    assert compare_frame(frame).differences["n"][0] == 3
    failed = frame[(frame["manager"] == "a") | (frame["run"] != 2)]
    failed.attrs["runs_sharing_draw"] = 4
    assert compare_frame(failed).differences["n"][0] == 2


def test_a_manager_that_lacks_a_point_altogether_is_not_compared_at_the_others() -> None:
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
    of_draws: Path, tmp_path: Path, has_run_numbers: bool
) -> None:
    real = pandas.read_csv(PUBLISHED / "seams2023_runs.csv").query("manager == 'none'")
    real = real if has_run_numbers else real.drop(columns="run")
    real.to_csv(tmp_path / "real.csv", index=False)
    comparison = compare_folders([of_draws, tmp_path / "real.csv"], metrics=["search_time_s"])
    simulated, published = rows(comparison.summaries)
    assert (simulated.n, published.n) == (4, 20)
    assert published.mean == pytest.approx(real["search_time_s"].mean())
    assert published.horizon_s > 0.0 and simulated.horizon_s is None
    assert any("(runs_per_draw) of simulated are averaged" in note for note in comparison.notes)


def test_further_metrics_are_not_what_was_swept(tmp_path: Path) -> None:
    sweep = {"grid": {"battery.discharge_time_s": [150.0, 200.0]}}
    run_campaign("extended", ["none", "metacontrol"], 3, 1, out=tmp_path / "out", sweep=sweep)
    runs = pandas.read_csv(tmp_path / "out" / "runs.csv")
    assert runs.groupby(["manager", "run"])["battery_level"].nunique().max() == 2  # it differs between the points
    for comparison in (compare_folders([tmp_path / "out"]), compare_frame(runs)):
        (note,) = (note for note in comparison.notes if "averaged over" in note)
        assert "averaged over battery.discharge_time_s:" in note
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["sweep"] == sweep


def test_duplicates_are_noticed_although_a_further_metric_differs(tmp_path: Path) -> None:
    run_campaign("extended", ["none"], 2, 1, out=tmp_path / "out")
    runs = pandas.read_csv(tmp_path / "out" / "runs.csv")
    twice = pandas.concat([runs, runs.assign(battery_level=0.5)])
    with pytest.raises(Exception, match="run 1 of none with seed 1 is there twice"):
        compare_frame(twice)


def test_missions_that_end_early_are_not_said_to_have_reached_the_limit() -> None:
    frame = two_points().query("`start.y_m` == 0.0").drop(columns="start.y_m")
    lost = (frame["manager"] == "b") & (frame["run"] <= 10)
    frame.loc[lost, "pipeline_found"] = False
    frame.loc[lost, "search_time_s"] = 300.0
    assert any("mean up to that limit" in note for note in compare_frame(frame).notes)
    frame.loc[lost, "search_time_s"] = 190.0 + frame["run"]  # the battery was empty
    (note,) = (note for note in compare_frame(frame).notes if "never found" in note)
    assert "b after 191 to 200 s" in note and "mean up to that limit" not in note


def test_managers_that_lack_different_points_are_not_compared_over_these() -> None:
    frame = two_points()
    third = frame[frame["start.y_m"] == 0.0].assign(**{"start.y_m": 2.0})
    frame = pandas.concat([frame, third])
    lacked = frame["manager"].map({"a": 0.0, "b": 1.0})
    with pytest.raises(InputError, match="no manager has a run with missions at all points"):
        reactions(frame[frame["start.y_m"] != lacked])  # each has two points of three
