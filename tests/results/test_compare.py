"""Managers are compared from result files: estimates, paired and unpaired differences, and what
follows.
"""

import re
import shutil
import sqlite3
import time
from contextlib import closing
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from scipy import stats

from suave_des import api
from suave_des.campaign.campaign import run_campaign
from suave_des.errors import InputError
from suave_des.frame import CampaignFrame
from suave_des.records.missions import missions_in
from suave_des.resources import find
from suave_des.results import statistics
from suave_des.results.compare import Choices, compare_folders, compare_groups
from suave_des.results.comparison import Comparison
from suave_des.results.figures import draw_missions
from suave_des.results.groups import grouped
from tests.helpers.compared import compare_frame, difference, interval, row, rows

PUBLISHED = find("seams2023_runs.csv", "scenarios/published")
MANAGERS = ("none", "random", "metacontrol")


def holm(ps: list[float]) -> list[float]:
    """Holm's correction by statsmodels, which takes a while to import."""
    from statsmodels.stats.multitest import multipletests

    return list(multipletests(ps, method="holm")[1])


def summary(comparison: Comparison, group: str, metric: str = "search_time_s") -> Any:
    return row(comparison.summaries, group=group, metric=metric)


@pytest.fixture(scope="module")
def published() -> Comparison:
    return compare_folders([PUBLISHED])


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign") / "out"
    run_campaign("seams2023", ["none", "bt", "metacontrol"], 25, 1, out=folder)
    return folder


def draw_missions_in(folders: list[Path]) -> None:
    draw_missions(missions_in(folders))


def runs(**values: list[float]) -> pandas.DataFrame:
    """Missions of managers with given search times, run by run, with seed 1; 300 s: not found."""
    rows = [
        (manager, run, time_s)
        for manager, times_s in values.items()
        for run, time_s in enumerate(times_s, 1)
    ]
    frame = pandas.DataFrame(rows, columns=["manager", "run", "search_time_s"]).assign(seed=1)
    times_s = frame["search_time_s"]
    return frame.assign(pipeline_found=times_s < 300.0, distance_inspected_m=300.0 - times_s)


@pytest.mark.parametrize("use", [compare_folders, draw_missions_in], ids=["compare", "figure"])
def test_a_folder_whose_store_is_not_a_campaigns_is_refused(campaign, tmp_path, use):
    folder = shutil.copytree(campaign, tmp_path / "forged")
    with closing(sqlite3.connect(folder / "campaign.sqlite")) as store:
        store.execute("CREATE VIEW endless AS SELECT * FROM outcomes")
    with pytest.raises(InputError, match="does not have the tables of a campaign's store"):
        use([folder])


@pytest.mark.slow
def test_a_comparison_of_sixty_managers_takes_seconds():
    drawn = np.random.default_rng(1)
    groups = {f"m{n}": list(drawn.uniform(100.0, 150.0, 5)) for n in range(60)}
    before_s = time.process_time()
    compare_frame(runs(**groups))
    assert time.process_time() - before_s < 10.0


def test_progress_is_told_of_each_difference():
    told = []
    groups = grouped(missions_in([PUBLISHED]), metrics=["search_time_s"])
    compare_groups(groups, on_progress=lambda done, total: told.append((done, total)))
    assert told == [(0, 3), (1, 3), (2, 3)]


class TestPublishedRuns:
    def test_the_papers_table_is_printed_to_the_last_digit(self, published):
        lines = [" ".join(line.split()) for line in published.latex().splitlines()]
        assert [line for line in lines if line.startswith(MANAGERS) and "-" not in line] == [
            r"none & 187.85 & 42.40 & 31.40 & 13.00 \\",
            r"random & 180.15 & 82.05 & 3.88 & 3.19 \\",
            r"metacontrol & 106.95 & 39.46 & 51.15 & 12.01 \\",
        ]

    def test_p_values_are_scipys(self, published):
        frame = pandas.read_csv(PUBLISHED)
        count = 0
        for first in MANAGERS:
            for second in MANAGERS[MANAGERS.index(first) + 1 :]:
                for metric in ("search_time_s", "distance_inspected_m"):
                    x, y = (frame.loc[frame["manager"] == name, metric] for name in (first, second))
                    tested = difference(published, first, second, metric)
                    assert tested.p == pytest.approx(stats.mannwhitneyu(x, y).pvalue, abs=1e-12)
                    assert tested.p_less == pytest.approx(
                        stats.mannwhitneyu(x, y, alternative="less").pvalue, abs=1e-12
                    )
                    assert tested.effect == pytest.approx(
                        np.mean([(a > b) + 0.5 * (a == b) for a in x for b in y])
                    )
                    count += 1
        assert count == 6

    def test_a_share_has_wilsons_interval(self, published):
        found = summary(published, "random", "pipeline_found")
        assert found.mean == 0.8
        assert interval(found, "mean") == pytest.approx(
            tuple(stats.binomtest(16, 20).proportion_ci(0.95, "wilson"))
        )

    def test_two_shares_have_fishers_test(self, published):
        tested = difference(published, "none", "random", "pipeline_found")
        assert tested.p == pytest.approx(stats.fisher_exact([[19, 1], [16, 4]]).pvalue, abs=1e-12)


class TestCampaign:
    def test_runs_with_common_random_numbers_are_paired(self, campaign):
        comparison = compare_folders([campaign])
        times = pandas.read_csv(campaign / "runs.csv").pivot(
            index="run", columns="manager", values="search_time_s"
        )
        found = difference(comparison, "bt", "metacontrol")
        assert (found.paired, found.n) == (True, 25)
        ranked = statistics.signed_rank_test(
            times["bt"].to_numpy(), times["metacontrol"].to_numpy()
        )
        assert found.p == ranked["p"] != 1.0
        assert found.mean_p == pytest.approx(
            stats.ttest_rel(times["bt"], times["metacontrol"]).pvalue
        )
        assert found.difference == pytest.approx((times["bt"] - times["metacontrol"]).mean())
        low, high = stats.ttest_rel(times["bt"], times["metacontrol"]).confidence_interval()
        assert interval(found, "difference") == pytest.approx((low, high))
        apart = difference(compare_folders([campaign], unpaired=True), "bt", "metacontrol")
        assert apart.p == pytest.approx(
            stats.mannwhitneyu(times["bt"], times["metacontrol"]).pvalue, abs=1e-12
        )
        of_means = stats.ttest_ind(times["bt"], times["metacontrol"], equal_var=False)
        assert apart.mean_p == pytest.approx(of_means.pvalue)
        welch = of_means.confidence_interval()
        assert interval(apart, "difference") == pytest.approx((welch.low, welch.high))

    def test_the_runs_needed_give_that_interval(self, campaign):
        times = pandas.read_csv(campaign / "runs.csv").pivot(
            index="run", columns="manager", values="search_time_s"
        )
        found = difference(
            compare_folders([campaign], half_widths=["search_time_s:2"]), "bt", "metacontrol"
        )
        apart = (times["bt"] - times["metacontrol"]).std()
        for n, narrow in ((found.runs_needed_paired, True), (found.runs_needed_paired - 1, False)):
            assert (stats.t.ppf(0.975, n - 1) * apart / n**0.5 <= 2.0) == narrow
        ratio = (times["bt"].var() + times["metacontrol"].var()) / apart**2  # what pairs are worth
        assert found.runs_needed_unpaired == pytest.approx(
            ratio * found.runs_needed_paired, rel=0.05
        )

    def test_folders_side_by_side_are_told_apart_by_name(self, campaign, tmp_path):
        run_campaign("seams2023", ["bt"], 10, 1, out=tmp_path / "again")
        comparison = compare_folders([campaign, tmp_path / "again"])
        assert {each.group for each in rows(comparison.summaries)} == {
            "none",
            "bt (out)",
            "bt (again)",
            "metacontrol",
        }
        same = difference(comparison, "bt (out)", "bt (again)")
        assert (same.paired, same.n) == (True, 10)
        assert "a value under only one of them (15) are left out" in same.why
        assert same.p == 1.0

    def test_different_seeds_are_not_paired(self, campaign, tmp_path):
        run_campaign("seams2023", ["bt"], 10, 2, out=tmp_path / "again")
        found = difference(
            compare_folders([campaign, tmp_path / "again"]), "bt (out)", "bt (again)"
        )
        assert not found.paired
        assert "fewer than two runs of the same seed" in found.why

    def test_the_restricted_mean_is_that_up_to_the_limit_where_none_is_censored_before(
        self, campaign
    ):
        own = pandas.read_csv(campaign / "runs.csv").query("manager == 'metacontrol'")
        found = summary(compare_folders([campaign]), "metacontrol")
        assert found.horizon_s == 300.0
        assert found.restricted_mean_s == pytest.approx(
            own["search_time_s"].clip(upper=300.0).mean()
        )


class TestSweep:
    def test_the_points_of_a_run_count_as_one(self, tmp_path):
        values = {"visibility.period_s": [60.0, 80.0, 100.0]}
        frame = run_campaign(
            "seams2023", ["none", "metacontrol"], 5, 1, out=tmp_path / "out", sweep=values
        ).frame()
        comparison = compare_folders([tmp_path / "out"])
        found = summary(comparison, "none")
        assert found.n == 5
        by_run = frame[frame["manager"] == "none"].groupby("run")["search_time_s"].mean()
        assert found.std == pytest.approx(by_run.std())
        assert any("averaged over visibility.period_s" in note for note in comparison.notes)

    def test_points_can_be_compared_with_each_other(self, tmp_path):
        values = {"visibility.period_s": [60.0, 80.0]}
        frame = run_campaign(
            "seams2023", ["none"], 5, 1, out=tmp_path / "out", sweep=values
        ).frame()
        comparison = compare_folders([tmp_path / "out"], by=["visibility.period_s"])
        found = difference(comparison, "none, period_s 60", "none, period_s 80")
        times = frame.pivot(index="run", columns="visibility.period_s", values="search_time_s")
        assert found.paired
        assert found.difference == pytest.approx((times[60.0] - times[80.0]).mean())

    def test_managers_are_compared_within_each_point(self, tmp_path):
        values = {"visibility.period_s": [60.0, 80.0]}
        run_campaign("seams2023", ["none", "bt"], 4, 1, out=tmp_path / "out", sweep=values)
        for against in (None, "none"):
            found = compare_folders([tmp_path / "out"], by=["visibility.period_s"], against=against)
            pairs = {tuple(sorted((each.group, each.other))) for each in rows(found.differences)}
            assert pairs == {
                (f"bt, period_s {value}", f"none, period_s {value}") for value in (60, 80)
            }
        assert re.match("period_s 60[:;] ", found.conclusion)
        assert "period_s 80: " in found.conclusion and "bt, period_s" not in found.conclusion


@pytest.fixture(scope="module")
def at_points() -> pandas.DataFrame:
    """Missions of a and b at two points of a sweep, and of c at the first only."""
    frame = runs(a=[100.0, 110.0], b=[120.0, 130.0], c=[140.0, 150.0])
    second = frame[frame["manager"] != "c"].assign(search_time_s=frame["search_time_s"] + 5.0)
    return pandas.concat([frame.assign(**{"x.y": 1.0}), second.assign(**{"x.y": 2.0})])


@pytest.mark.parametrize(
    ("against", "pairs"),
    [
        ("a, y 2", {("b, y 2", "a, y 2")}),  # at its own point only
        ("c", {("a, y 1", "c, y 1"), ("b, y 1", "c, y 1")}),
        ("a", {("b, y 1", "a, y 1"), ("c, y 1", "a, y 1"), ("b, y 2", "a, y 2")}),
    ],
)
def test_others_are_compared_with_one_at_its_own_point(at_points, against, pairs):
    found = compare_frame(at_points, by=["x.y"], against=against, metrics=["search_time_s"])
    assert set(zip(found.differences["group"], found.differences["other"], strict=True)) == pairs


def test_one_that_is_alone_at_its_point_is_compared_with_all_points(at_points):
    alone = at_points[(at_points["manager"] == "a") | (at_points["x.y"] == 1.0)]
    found = compare_frame(alone, by=["x.y"], against="a, y 2", metrics=["search_time_s"])
    assert set(found.differences["group"]) == {"a, y 1", "b, y 1", "c, y 1"}


def test_half_widths_are_a_twentieth_of_the_greater_mean_unless_the_metric_has_its_own():
    frame = runs(a=[100.0, 140.0, 90.0], b=[120.0, 80.0, 95.0])
    frame["adaptations"] = [-2.0, 4.0, 4.0, -8.0, -6.0, -4.0]  # means 2 and -6
    found = compare_frame(frame, metrics=["adaptations", "search_time_s"])
    assert list(found.differences["half_width"]) == pytest.approx([0.05 * 6.0, 5.0])
    asked = compare_frame(frame, metrics=["adaptations"], half_widths=["adaptations:2"])
    assert list(asked.differences["half_width"]) == [2.0]


def test_points_of_which_the_same_is_concluded_share_a_sentence(tmp_path):
    values = {"thruster_events.0.time_s": [400.0, 400.0000001]}  # after the time limit
    run_campaign("seams2023", ["none", "bt"], 4, 1, out=tmp_path / "out", sweep=values)
    run_campaign("seams2023", ["none", "bt"], 4, 1, out=tmp_path / "plain")
    found = compare_folders([tmp_path / "out", tmp_path / "plain"], by=["thruster_events.0.time_s"])
    assert (
        found.conclusion.startswith("time_s 400.0; time_s 400.0000001: ")
        and "not swept: " in found.conclusion
    )


def test_a_manager_that_is_equal_to_the_best_in_all_pairs_is_named():
    ties = compare_frame(runs(a=[100.0, 110.0], b=[100.0, 110.0], c=[150.0, 151.0])).conclusion
    assert ties.startswith(
        "No difference of the mean search time is shown between a, which has, with others, the best mean, "
    )
    assert "b (equal in all 2 pairs)" in ties


def test_a_best_mean_is_said_to_be_that_of_all_runs_where_pairs_say_otherwise():
    frame = runs(a=[120.0, 110.0, 50.0], b=[110.0, 110.0], c=[150.0])
    more = compare_frame(frame).conclusion
    assert "between a, which has the best mean of all its runs, and b" in more


def test_an_interval_without_0_that_the_corrected_test_does_not_support_is_named():
    b = [100.0 + 0.1 * number for number in range(8)]
    a = [value - 20.0 - 5.0 * (number % 3) for number, value in enumerate(b)]
    a[0] = b[0] + 15.0
    found = compare_frame(
        runs(a=a, b=b, c=[150.0, 90.0] * 4, d=[80.0, 160.0] * 4, e=[150.0, 95.0] * 4)
    )
    pair = difference(found, "a", "b")
    assert pair.mean_p < 0.05 <= pair.mean_p_holm
    assert interval(pair, "difference")[1] < 0.0
    open_one = "the interval, which is for this difference alone, excludes 0"
    assert f"by the test, though {open_one} (a - b: " in pair.conclusion
    tests = found.differences["test"].notna().sum()
    assert any(f"Holm's correction over all {tests}." in remark for remark in found.remarks())


def test_pairs_that_vary_more_than_independent_runs_are_noted():
    times = [100.0 + 5.0 * number for number in range(10)]
    against = compare_frame(runs(a=times, b=times[::-1])).notes
    assert any(
        "those of independent runs: a - b in search_time_s (2.0 times)" in note for note in against
    )
    assert not any(
        "of independent runs" in note for note in compare_frame(runs(a=times, b=times)).notes
    )


def test_that_most_missions_did_not_find_the_pipeline_comes_first():
    lost = [300.0] * 15 + [120.0] * 5
    found = compare_frame(runs(a=[130.0] * 11 + [300.0] * 9, b=lost))
    lost_s = "The pipeline was not found by b in 15 of 20 missions, which have 300 s as their search time. "
    assert found.conclusion.startswith(lost_s)
    assert not compare_frame(
        runs(a=[100.0] * 20, b=[130.0] * 11 + [300.0] * 9)
    ).conclusion.startswith("The pipe")


def test_the_exemplars_missions_are_paired_by_run_idx_whatever_their_order(tmp_path):
    times_s = {"none": [100, 120, 140, 160, 180, 200], "bt": [91, 112, 133, 154, 175, 196]}
    header = (
        "mission name,pipeline found,time searching pipeline (s),distance inspected (m),run_idx"
    )
    for manager, order in (("none", 1), ("bt", -1)):
        lines = [f"suave {manager},True,{t_s},9.5,{n}" for n, t_s in enumerate(times_s[manager])]
        file = tmp_path / f"{manager}_suave.csv"
        file.write_text("\n".join([header, *lines[::order]]), encoding="utf-8")
    found = difference(compare_folders([tmp_path]), "none", "bt")
    assert (found.paired, found.n) == (True, 6)
    assert found.why == "paired by run_idx, as the exemplar's own test does"
    assert found.p == stats.wilcoxon(times_s["none"], times_s["bt"]).pvalue == 2 / 2**6


def test_runs_that_differ_most_are_named_with_the_command_that_replays_them(campaign):
    times = pandas.read_csv(campaign / "runs.csv").pivot(
        index="run", columns="manager", values="search_time_s"
    )
    comparison = compare_folders([campaign], managers=["bt", "none"])
    apart = times["bt"] - times["none"]
    (found,) = comparison.largest.rows
    assert (found[2], found[3]) == (str(apart.idxmin()), f"{apart.max():.2f}")
    assert (
        str(comparison).count(
            f"suave-des replay {campaign} --run {apart.abs().idxmax()} --managers bt,none"
        )
        == 1
    )
    frame = compare_frame(pandas.read_csv(campaign / "runs.csv"))
    assert frame.largest.rows and "replay" not in str(frame)
    for unpaired in (compare_folders([PUBLISHED]), compare_folders([campaign], unpaired=True)):
        assert not unpaired.largest.rows


class TestFewValues:
    def test_one_run_has_no_interval(self):
        found = summary(compare_frame(runs(a=[100.0], b=[120.0])), "a")
        assert (found.mean, interval(found, "mean"), found.std) == (100.0, None, None)

    def test_one_pair_of_runs_shows_no_difference(self):
        comparison = compare_frame(runs(a=[100.0], b=[120.0]))
        assert not (comparison.differences["p_holm"] < 0.05).any()

    def test_equal_values_do_not_say_how_many_runs_are_needed(self):
        found = difference(
            compare_frame(runs(a=[100.0] * 4, b=[120.0] * 4)), "a", "b", "pipeline_found"
        )
        assert (found.runs_needed_paired, found.runs_needed_unpaired) == (None, None)
        low, high = interval(found, "difference")
        assert -1.0 <= low < 0.0 < high <= 1.0

    def test_missions_that_all_never_found_the_pipeline_have_no_median(self):
        comparison = compare_frame(runs(a=[300.0] * 25, b=[300.0] * 25))
        search = summary(comparison, "a")
        assert (search.restricted_mean_s, search.censored_median_s) == (300.0, None)
        found = difference(comparison, "a", "b")
        assert found.p == 1.0
        assert found.conclusion == "a and b have the same search time in all 25 pairs."
        assert comparison.conclusion.startswith(
            "The pipeline was not found by a in 25 of 25 missions, b in 25 of 25 m"
        )

    def test_a_difference_that_is_the_same_in_each_pair_is_claimed(self):
        a = np.random.default_rng(1).normal(100.0, 5.0, 20)
        claim = "a finds the pipeline 5.00 s sooner than b on average (no interval; 20 pairs, permutation, p < 0.001)."
        found = compare_frame(runs(a=list(a), b=list(a + 5.0)), metrics=["search_time_s"])
        assert difference(found, "a", "b").conclusion.startswith(claim)
        few = difference(compare_frame(runs(a=[100.0], b=[105.0])), "a", "b")
        assert few.conclusion.startswith(
            "No difference of the mean search time is shown between a and b ("
        )


def test_a_significant_difference_of_ranks_against_that_of_means_is_reported():
    chance = np.random.default_rng(1)
    a = chance.normal(100.0, 1.0, 60)
    b = np.where(np.arange(60) < 8, 290.0, a - 5.0)
    found = difference(compare_frame(runs(a=list(a), b=list(b))), "a", "b")
    assert found.difference < 0.0
    assert found.p_holm < 0.05
    assert found.conclusion.endswith("Means and ranks disagree: the distributions differ in shape.")


class TestConclusions:
    """What a sentence claims is what the figures beside it show."""

    def test_ranks_alone_are_not_said_of_means(self):
        a = np.random.default_rng(1).normal(100.0, 5.0, 60)
        b = np.where(np.arange(60) < 6, a + 60.0, a - 5.0)
        comparison = compare_frame(runs(a=list(a), b=list(b)), metrics=["search_time_s"])
        (found,) = rows(comparison.differences)
        assert found.p_holm < 0.05
        assert interval(found, "difference")[0] < 0.0 < interval(found, "difference")[1]
        assert found.conclusion.startswith(
            "No difference of the mean search time is shown between a and b (a - b: "
        )
        assert found.conclusion.endswith(
            " By ranks, b finds the pipeline sooner than a (Wilcoxon, p < 0.001). Of 60 pairs, a has the lower search"
            " time in 6, b in 54."
        )
        assert comparison.conclusion == found.conclusion

    def test_the_best_mean_of_all_runs_is_not_called_better_where_its_pairs_are_worse(self):
        chance = np.random.default_rng(1)
        hard = chance.normal(200.0, 5.0, 20)  # b has only these runs, and is sooner in each
        frame = runs(
            a=[*hard, *chance.normal(80.0, 5.0, 80)], b=list(hard - chance.normal(10.0, 1.0, 20))
        )
        assert compare_frame(frame).conclusion.startswith("b finds the pipeline")


class TestCaveats:
    """Missions that never found the pipeline, or have no value, are told of."""

    def test_the_search_time_with_which_they_count_is_reported(self):
        notes = compare_frame(runs(a=[100.0, 300.0, 120.0], b=[90.0, 95.0, 110.0])).notes
        (note,) = (each for each in notes if "mean up to that limit" in each)
        assert note.startswith(
            "missions that had not found the pipeline by 300 s (a 1 of 3) count with 300 s:"
        )

    def test_notes_stand_in_latex(self):
        comparison = compare_frame(runs(a=[100.0, 300.0, 120.0], b=[90.0, 95.0, 110.0]))
        (note,) = (each for each in comparison.notes if "mean up to that limit" in each)
        assert f"% Note: {note}.\n" in comparison.latex()

    def test_missions_that_are_left_out_are_reported(self):
        frame = runs(a=[100.0, 110.0, 120.0], b=[90.0, 95.0, 110.0])
        frame["mean_reaction_time_s"] = [1.0, float("nan"), 1.2, 0.5, 0.6, 0.7]
        notes = compare_frame(frame).notes
        assert any("without a mean reaction time (a 1 of 3) are left out" in each for each in notes)


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        (Choices(managers=["nonne"]), "no mission of 'nonne' .*did you mean 'none'"),
        (
            Choices(metrics=["search_time"]),
            "there is no metric 'search_time' .*did you mean 'search_time_s'",
        ),
        (Choices(against="bt"), "nothing is called 'bt'"),
        (Choices(by=["visibility"]), "'visibility' is not what a sweep varies"),
        (Choices(half_widths=["search_time_s"]), "is no half-width above 0 .*search_time_s:2"),
        (Choices(half_widths=["adaptations:1"]), "'adaptations:1' is no half-width"),
    ],
)
def test_a_choice_that_makes_no_sense_is_refused(choices, words):
    with pytest.raises(InputError, match=words):
        compare_folders([PUBLISHED], **choices)


@pytest.fixture(scope="module")
def frame_of_a_campaign() -> CampaignFrame:
    return api.run_campaign("seams2023", ["none", "bt"], runs=4, progress=False)


def test_the_frame_of_a_campaign_is_compared(frame_of_a_campaign):
    some = frame_of_a_campaign[frame_of_a_campaign["run"] > 1]
    comparison = some.compare(metrics=["distance_inspected_m"])
    assert [(each.group, each.other, each.n) for each in rows(comparison.differences)] == [
        ("none", "bt", 3)
    ]
    assert str(comparison).startswith(comparison.conclusion[:60])


def test_the_frame_of_a_campaign_is_drawn(frame_of_a_campaign):
    assert len(frame_of_a_campaign.figure().axes) == 2


LONG_NAMES = [
    "a_module_with_a_long_name:AndAClassWithAnEvenLongerName",
    "another_module_of_a_thesis:AnotherLongManager",
]


@pytest.fixture(scope="module")
def of_long_names() -> Comparison:
    times_s = [100.0, 120.0, 140.0], [90.0, 95.0, 130.0], [80.0, 85.0, 120.0]
    return compare_frame(runs(**dict(zip(["none", *LONG_NAMES], times_s, strict=True))))


@pytest.mark.parametrize("width", [80, 95])
def test_tables_with_long_names_of_managers_fit_the_width(of_long_names, width):
    assert max(map(len, of_long_names.text(width).splitlines())) <= width


@pytest.mark.parametrize("width", [80, 95])
def test_tables_show_long_names_of_managers_whole(of_long_names, width):
    lines = of_long_names.text(width).splitlines()
    joined = "".join(line.split("  ")[0] or line.strip() for line in lines)
    assert all(name in joined for name in LONG_NAMES)


def test_a_manager_that_reacts_at_once_has_a_reaction_time_of_zero(tmp_path):
    frame = run_campaign("seams2023", ["oracle"], 3, 1, out=tmp_path / "out").frame()
    assert (frame["mean_reaction_time_s"] == 0.0).all()
    for comparison in (compare_folders([tmp_path / "out"]), compare_frame(frame)):
        found = summary(comparison, "oracle", "mean_reaction_time_s")
        assert (found.n, found.mean) == (3, 0.0)


@pytest.fixture(scope="module")
def latex_by_two_parameters() -> list[str]:
    """Tables of three managers at two by two points of a sweep: each a constant slower than the
    one before.
    """
    names = ["none", "metacontrol", "tests.managers:Reactive"]
    columns = ["manager", "run", "visibility.minimum", "managers.metacontrol.reasoning_period_s"]
    frame = pandas.DataFrame(product(names, range(1, 26), [1.0, 2.0], [0.5, 5.0]), columns=columns)
    slower_s = frame["manager"].map(names.index) * (10.0 + frame["run"] % 3)
    frame = frame.assign(
        scenario="s",
        seed=1,
        search_time_s=100.0 + frame["run"] + slower_s,
        distance_inspected_m=50.0 - slower_s,
        pipeline_found=True,
    )
    metrics = ["search_time_s", "distance_inspected_m"]
    return compare_frame(frame, by=columns[2:], metrics=metrics).latex().split("\\begin{table}")[1:]


def test_latex_of_a_sweep_has_the_points_as_headings(latex_by_two_parameters):
    point = "minimum 1, reasoning\\_period\\_s 0.5"
    for table in latex_by_two_parameters:
        assert table.count(f"\\multicolumn{{5}}{{l}}{{{point}}} \\\\") == 1
        assert table.count("\\multicolumn{5}{l}{minimum") == 4


def test_each_table_in_latex_has_a_label(latex_by_two_parameters):
    labels = ["means", "differences-search-time-s", "differences-distance-inspected-m"]
    for table, label in zip(latex_by_two_parameters, labels, strict=True):
        assert f"\\label{{tab:{label}}}" in table


def test_latex_of_a_sweep_fits_a_page(latex_by_two_parameters):
    for table in latex_by_two_parameters:
        shown = [line.strip() for line in table.splitlines() if line.endswith("\\\\")]
        assert max(map(len, shown)) < 110
        assert not any("  " in line or " - " in line for line in shown)


def test_a_row_of_differences_is_that_by_hand(latex_by_two_parameters):
    # 10 s and the rest of a run's number by 3, of 25 runs; ± 2.064 times 0.8165 / 5.
    row = "none $-$ metacontrol & $-11.00$ & $-11.3$ to $-10.7$ & $-1.00$ &"
    assert row in latex_by_two_parameters[1]


def test_latex_says_how_many_missions_there_are(latex_by_two_parameters):
    words = "\\par\\smallskip\\footnotesize 25 missions for each manager at each point."
    assert words in latex_by_two_parameters[0]
