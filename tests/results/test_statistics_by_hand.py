"""Statistics of comparisons against figures from papers, SciPy, and formulas evaluated here."""

from __future__ import annotations

import math

import numpy as np
import pandas
import pytest
from scipy import stats

from suave_des.estimates import mean_of
from suave_des.results import statistics
from suave_des.results.compare import compare_frame
from suave_des.results.comparison import Comparison
from tests.helpers.compared import rows


def frame(seeds: tuple[int, int] = (1, 1), **search_times_s: list[float]) -> pandas.DataFrame:
    """Missions with given search times; those of 300 s did not find the pipeline."""
    rows = [
        (manager, seed, run, time_s, time_s < 300.0)
        for (manager, times_s), seed in zip(search_times_s.items(), seeds, strict=False)
        for run, time_s in enumerate(times_s, 1)
        if not math.isnan(time_s)
    ]
    return pandas.DataFrame(rows, columns=["manager", "seed", "run", "search_time_s", "pipeline_found"]).assign(
        distance_inspected_m=1.0, scenario="s"
    )


def compared(seeds: tuple[int, int] = (1, 1), **search_times_s: list[float]) -> Comparison:
    return compare_frame(frame(seeds, **search_times_s), metrics=["search_time_s"])


def test_two_shares_differ_as_in_newcombes_example() -> None:
    # R. G. Newcombe, Statistics in Medicine 17 (1998), table II: 56/70 against 48/80 by method 10.
    found = statistics.share_difference((56, 70), (48, 80))
    assert found.value == pytest.approx(0.2)
    assert found.interval == pytest.approx((0.0524, 0.3339), abs=5e-5)


def test_paired_shares_differ_by_the_formula_of_bonett_and_price() -> None:
    # D. G. Bonett, R. M. Price, Journal of Educational and Behavioral Statistics 37 (2012): one is added to each count
    # of pairs that differ.
    n, only_first, only_second = 40, 9, 2
    first = np.array([True] * only_first + [False] * only_second + [True] * (n - only_first - only_second))
    second = np.array([False] * only_first + [True] * only_second + [True] * (n - only_first - only_second))
    p, q = (only_first + 1) / (n + 2), (only_second + 1) / (n + 2)
    half = stats.norm.ppf(0.975) * math.sqrt((p + q - (p - q) ** 2) / (n + 2))
    found = statistics.paired_share_difference(first, second)
    assert found.value == pytest.approx(7 / 40)
    assert found.interval == pytest.approx((p - q - half, p - q + half), rel=1e-9)


@pytest.mark.parametrize("n", range(2, 60, 2))
def test_half_of_the_missions_have_found_it_when_the_middle_one_has(n: int) -> None:
    # The survival function is a product of fractions, which need not be exactly a half there.
    times_s = np.arange(1.0, n + 1.0)
    _, half = statistics.search_times(times_s, np.ones(n, dtype=bool), n + 1.0)
    assert half.value == n / 2


def test_the_mean_to_the_limit_has_the_interval_of_a_sample_though_missions_end_at_the_limit() -> None:
    times_s = np.array([100.0, 140.0, 180.0, 300.0, 300.0])
    found, _ = statistics.search_times(times_s, times_s < 300.0, 300.0)
    assert found.value == pytest.approx(times_s.mean())
    assert found.interval == pytest.approx(stats.t.interval(0.95, 4, times_s.mean(), stats.sem(times_s)))
    earlier, _ = statistics.search_times(times_s, times_s < 300.0, 310.0)  # two are censored before: no sample
    assert earlier.interval is None


def test_the_effect_of_pairs_is_the_rank_biserial_correlation_of_those_that_differ() -> None:
    # Ranks of the differences 3, -1, 2, 4: 3, 1, 2, 4; those in favour have 9 of 10, so r = (9 - 1) / 10.
    first, second = np.array([13.0, 9.0, 12.0, 14.0, 7.0]), np.array([10.0, 10.0, 10.0, 10.0, 7.0])
    assert statistics.signed_rank_test(first, second).effect.value == pytest.approx(0.8)


def test_pairing_divides_the_variance_by_a_ratio_that_needs_a_spread_of_the_differences() -> None:
    a, b = [100.0, 110.0, 125.0, 130.0], [101.0, 113.0, 124.0, 135.0]
    (found,) = rows(compared(a=a, b=b).differences)
    assert found.variance_ratio == pytest.approx(
        (np.var(a, ddof=1) + np.var(b, ddof=1)) / np.var(np.subtract(a, b), ddof=1)
    )
    (constant,) = rows(compared(a=a, b=[each + 2.0 for each in a]).differences)
    assert constant.variance_ratio is None
    assert constant.runs_needed_paired is None and constant.runs_needed_unpaired is not None


@pytest.mark.parametrize(
    ("b", "n"),
    [
        ([math.nan, math.nan, math.nan, 105.0, 120.0, 90.0, 99.0], 4),  # one run in common, four values each
        ([math.nan, math.nan, 104.0, 105.0], 2),
    ],
)
def test_two_runs_in_common_are_a_pair_of_samples_and_one_is_not(b: list[float], n: int) -> None:
    (found,) = rows(compared(a=[100.0, 110.0, 121.0, 133.0], b=b).differences)
    assert found.paired is (n == 2)
    assert (found.n, found.n_other) == (n, n)


def test_search_times_are_compared_up_to_the_shorter_limit() -> None:
    missions = frame(a=[100.0, 300.0], b=[150.0, 200.0])
    missions.loc[(missions["manager"] == "b") & (missions["run"] == 2), "pipeline_found"] = False
    for each in rows(compare_frame(missions, metrics=["search_time_s"]).summaries):
        assert each.horizon_s == 200.0
    for each in rows(compared(a=[100.0, 120.0], b=[150.0, 200.5]).summaries):
        assert each.horizon_s == 200.0


def test_the_conclusion_names_the_largest_p_of_those_that_it_is_about() -> None:
    a = [100.0 + each for each in range(12)]
    b = [each + 10.0 + 0.1 * place for place, each in enumerate(a)]
    c = [each + (8.0 if place > 1 else -3.0) + 0.1 * place for place, each in enumerate(a)]
    comparison = compared((1, 1, 1), a=a, b=b, c=c)
    # By signed ranks b differs with p = 2 / 2**12, times 3 in Holm's correction, c with p = 10 / 2**12.
    ps = [each.p_holm for each in rows(comparison.differences)]
    assert ps == pytest.approx([6 / 2**12, 10 / 2**12, 6 / 2**12])
    assert comparison.conclusion.endswith("largest p = 0.002 after Holm's correction over 3 tests.")
    assert f"{6 / 2**12:.3f}" == "0.001"


def test_ranks_of_independent_missions_favour_the_first_where_it_is_greater_in_more_than_half() -> None:
    # b is greater in most comparisons, but has a few very small values, so that its mean is less.
    a = [100.0] * 30 + [101.0] * 10
    b = [110.0 + place / 100.0 for place in range(31)] + [10.0] * 9
    (found,) = rows(compared((1, 2), a=a, b=b).differences)
    assert found.effect is not None and 0.0 < found.effect < 0.5
    assert found.difference > 0.0
    assert found.conclusion.startswith("By ranks, a finds the pipeline mostly sooner than b (")
    assert "but no difference of the means is shown (a - b: 12.63 s" in found.conclusion


def test_groups_of_different_sizes_have_the_interval_of_a_mean_over_clusters() -> None:
    # W. G. Cochran, Sampling Techniques, 1977, chapter 9A: the variance of a ratio of cluster totals to sizes.
    groups = [[10.0, 12.0, 11.0], [20.0], [14.0, 17.0], [9.0, 8.0, 10.0, 9.0]]
    values = [each for group in groups for each in group]
    labels = [place for place, group in enumerate(groups) for _ in group]
    mean = sum(values) / len(values)
    squares = sum((sum(group) - mean * len(group)) ** 2 for group in groups)
    half = stats.t.ppf(0.975, 3) * math.sqrt(4 / 3 * squares) / len(values)
    assert mean_of(values, labels).interval == pytest.approx((mean - half, mean + half))
