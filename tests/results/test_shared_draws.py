"""Where several runs share what is drawn, the draws are independent and the runs are not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas
import pytest
from scipy import stats

from suave_des import api
from suave_des.campaign.campaign import run_campaign
from suave_des.estimates import mean_of, std_of
from suave_des.results.compare import compare_folders, compare_frame
from suave_des.results.figures import draw_frame
from tests.helpers.compared import interval, rows

VARIED = {
    "runs_per_draw": 4,
    "perturbations": {"start.y_m": {"distribution": "uniform", "minimum": 1.5, "maximum": 3.5}},
}


def of_draws(runs: pandas.DataFrame, metric: str) -> pandas.DataFrame:
    """Return the means of draws, a column for each manager."""
    draw = (runs["run"] - 1) // VARIED["runs_per_draw"]
    return runs.groupby(["manager", draw], observed=True)[metric].mean().unstack(0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("draws") / "out"
    run_campaign("seams2023", ["none", "bt"], 24, 1, out=out, **VARIED)
    return out


def test_the_interval_is_that_of_the_means_of_groups_of_one_size() -> None:
    values = np.random.default_rng(1).normal(100.0, 3.0, (7, 5)) + np.arange(7)[:, None]
    means = values.mean(axis=1)
    low, high = stats.t.interval(0.95, 6, means.mean(), stats.sem(means))
    groups = np.repeat(np.arange(7), 5).tolist()
    assert mean_of(values.ravel().tolist(), groups).interval == pytest.approx((low, high))
    assert mean_of([1.0, 2.0], [0, 0]).interval is None


def test_groups_of_equal_means_do_not_give_an_interval_without_width() -> None:
    interval = mean_of([120.0, 121.0, 121.0, 120.0], [0, 0, 1, 1]).interval
    assert interval == pytest.approx(stats.t.interval(0.95, 3, 120.5, stats.sem([120.0, 121.0, 121.0, 120.0])))


def test_the_summary_has_the_interval_of_the_draws(folder: Path) -> None:
    runs, summary = pandas.read_csv(folder / "runs.csv"), pandas.read_csv(folder / "summary.csv").set_index("manager")
    means = of_draws(runs, "search_time_s")["none"]
    low, high = stats.t.interval(0.95, len(means) - 1, means.mean(), stats.sem(means))
    assert summary.loc["none", "search_time_s_ci95_low"] == pytest.approx(low, abs=1e-5)
    assert summary.loc["none", "search_time_s_ci95_high"] == pytest.approx(high, abs=1e-5)
    times_s = runs.loc[runs["manager"] == "none", "search_time_s"].tolist()
    naive = mean_of(times_s)
    assert summary.loc["none", "search_time_s_std"] == pytest.approx(std_of(times_s).value, abs=1e-5)
    assert high - low > 1.5 * (naive.high - naive.low)


def test_a_comparison_takes_the_draws_for_independent(folder: Path) -> None:
    means = of_draws(pandas.read_csv(folder / "runs.csv"), "search_time_s")
    comparison = compare_folders([folder])
    found = rows(comparison.differences)[0]
    assert found.n == 6
    assert interval(found, "difference") == pytest.approx(
        tuple(stats.ttest_rel(means["none"], means["bt"]).confidence_interval())
    )
    assert any("4 runs that share each draw" in note for note in comparison.notes)
    assert "footnotesize 6 draws for each manager." in comparison.latex()


def test_campaigns_with_other_draws_are_paired_by_the_same_runs(folder: Path, tmp_path: Path) -> None:
    run_campaign("seams2023", ["none"], 24, 1, out=tmp_path / "other", **(VARIED | {"runs_per_draw": 3}))
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


def test_intervals_of_shares_of_draws_are_cut_off_at_all_and_none() -> None:
    found = [True] * 39 + [False]
    cells = [(manager, run + 1, found[run] or manager == "a") for manager in "ab" for run in range(40)]
    frame = pandas.DataFrame(cells, columns=["manager", "run", "pipeline_found"])
    frame = frame.assign(seed=1, scenario="s", search_time_s=100.0, distance_inspected_m=1.0, mean_reaction_time_s=1.0)
    frame.attrs["runs_sharing_draw"] = 4
    for unpaired in (False, True):
        (a, b) = rows(compare_frame(frame, metrics=["pipeline_found"], unpaired=unpaired).summaries)
        assert (a.mean, interval(a, "mean")) == (1.0, None)
        assert interval(b, "mean")[1] == 1.0 > b.mean > interval(b, "mean")[0]


def test_so_does_that_of_a_data_frame() -> None:
    frame = api.run_campaign("seams2023", ["none", "bt"], runs=8, progress=False, **VARIED)
    assert frame.compare().differences["n"][0] == compare_frame(frame).differences["n"][0] == 2
    other = api.run_campaign("seams2023", ["none", "bt"], runs=8, seed=2, progress=False, **VARIED)
    both = pandas.concat([frame, other])
    assert compare_frame(both).differences["n"][0] == 4


def test_differences_are_drawn_of_draws() -> None:
    frame = api.run_campaign("seams2023", ["none", "bt"], runs=8, progress=False, **VARIED)
    figure = draw_frame(frame, "differences")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["mean, 95% interval", "draw"]
    assert figure.axes[0].get_yticklabels()[0].get_text().endswith("(n = 2)")


def test_runs_without_perturbations_are_independent(tmp_path: Path) -> None:
    run_campaign("seams2023", ["none", "bt"], 8, 1, out=tmp_path / "out", runs_per_draw=4)
    assert compare_folders([tmp_path / "out"]).differences["n"][0] == 8
