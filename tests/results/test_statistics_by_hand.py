"""Statistics against figures from papers, SciPy, and formulas evaluated here; and how often
intervals hold.
"""

import itertools
import math
from functools import cache

import numpy as np
import pandas
import pytest
from numpy.typing import NDArray
from scipy import stats

from suave_des.estimates import mean_of, share_of
from suave_des.results import statistics
from suave_des.results.comparison import Comparison
from suave_des.results.statistics import (
    agreement,
    anderson_darling,
    difference_interval,
    mann_whitney,
    mean_interval,
    means_test,
    paired_share_difference,
    ratio_interval,
    runs_for,
    sign_of,
    signed_rank_test,
)
from tests.helpers.compared import compare_frame, rows
from tests.helpers.processors import printed_on_each


def frame(seeds: tuple[int, int] = (1, 1), **search_times_s: list[float]) -> pandas.DataFrame:
    """Missions with given search times; those of 300 s did not find the pipeline."""
    rows = [
        (manager, seed, run, time_s, time_s < 300.0)
        for (manager, times_s), seed in zip(search_times_s.items(), seeds, strict=False)
        for run, time_s in enumerate(times_s, 1)
        if not math.isnan(time_s)
    ]
    return pandas.DataFrame(
        rows, columns=["manager", "seed", "run", "search_time_s", "pipeline_found"]
    ).assign(distance_inspected_m=1.0, scenario="s")


def compared(seeds: tuple[int, int] = (1, 1), **search_times_s: list[float]) -> Comparison:
    return compare_frame(frame(seeds, **search_times_s), metrics=["search_time_s"])


def test_two_shares_differ_as_in_newcombes_example():
    # R. G. Newcombe, Statistics in Medicine 17 (1998), table II: 56/70 against 48/80 by method 10.
    found = statistics.share_difference((56, 70), (48, 80))
    assert found.value == pytest.approx(0.2)
    assert found.interval == pytest.approx((0.0524, 0.3339), abs=5e-5)


def test_paired_shares_differ_by_the_formula_of_bonett_and_price():
    # D. G. Bonett, R. M. Price, Journal of Educational and Behavioral Statistics 37 (2012): one is
    # added to each count of pairs that differ.
    n, only_first, only_second = 40, 9, 2
    first = np.array(
        [True] * only_first + [False] * only_second + [True] * (n - only_first - only_second)
    )
    second = np.array(
        [False] * only_first + [True] * only_second + [True] * (n - only_first - only_second)
    )
    p, q = (only_first + 1) / (n + 2), (only_second + 1) / (n + 2)
    half = stats.norm.ppf(0.975) * math.sqrt((p + q - (p - q) ** 2) / (n + 2))
    found = statistics.paired_share_difference(first, second)
    assert found.value == pytest.approx(7 / 40)
    assert found.interval == pytest.approx((p - q - half, p - q + half), rel=1e-9)


@pytest.mark.parametrize(
    ("times_s", "found", "horizon_s", "mean_s", "half"),
    [
        (
            [40, 90, 90, 120, 150, 200, 210, 260, 300, 300],
            "yynynyynnn",
            280,
            198.1428571428571,
            (210, 40, math.inf),
        ),
        ([20.9, 78, 128.5, 150, 150, 125, 79], "ynnnnyy", 150, 115.1, (math.inf, 20.9, math.inf)),
        ([150, 150, 150], "nnn", 150, 150.0, (math.inf, math.inf, math.inf)),
        ([146], "y", 146, 146.0, (146, 146, 146)),
    ],
)
def test_censored_search_times_are_those_of_lifelines(times_s, found, horizon_s, mean_s, half):
    # expected: lifelines 0.30, KaplanMeierFitter
    was_found = np.array([each == "y" for each in found])
    restricted, estimated = statistics.search_times(np.array(times_s, float), was_found, horizon_s)
    assert restricted.value == pytest.approx(mean_s, rel=1e-12)
    assert (estimated.value, estimated.low, estimated.high) == half


@pytest.mark.parametrize("n", range(2, 60, 2))
def test_half_of_the_missions_have_found_it_when_the_middle_one_has(n):
    # The survival function is a product of fractions, which need not be exactly a half there.
    times_s = np.arange(1.0, n + 1.0)
    _, half = statistics.search_times(times_s, np.ones(n, dtype=bool), n + 1.0)
    assert half.value == n / 2


def test_the_mean_to_the_limit_has_the_interval_of_a_sample_though_missions_end_at_the_limit():
    times_s = np.array([100.0, 140.0, 180.0, 300.0, 300.0])
    found, _ = statistics.search_times(times_s, times_s < 300.0, 300.0)
    assert found.value == pytest.approx(times_s.mean())
    assert found.interval == pytest.approx(
        stats.t.interval(0.95, 4, times_s.mean(), stats.sem(times_s))
    )
    # two are censored before: no sample
    earlier, _ = statistics.search_times(times_s, times_s < 300.0, 310.0)
    assert earlier.interval is None


def test_the_effect_of_pairs_is_the_rank_biserial_correlation_of_those_that_differ():
    # Ranks of the differences 3, -1, 2, 4: 3, 1, 2, 4; those in favour have 9 of 10, so r = (9 - 1)
    # / 10.
    first, second = np.array([13.0, 9.0, 12.0, 14.0, 7.0]), np.array([10.0, 10.0, 10.0, 10.0, 7.0])
    assert statistics.signed_rank_test(first, second)["effect"] == pytest.approx(0.8)
    # 1 - 6/7 is not quite 1/7
    first, second = (
        np.array([7, 1, 9, 3, 5, 4]),
        np.array([6, 0, 10, 1, 8, 4]),
    )
    assert statistics.signed_rank_test(first / 7, second / 7) == statistics.signed_rank_test(
        first, second
    )


def signs_by_hand(differences: list[float]) -> tuple[float, float, float]:
    """p of Wilcoxon's signed ranks, two-sided, less and greater, from all ways to choose signs."""
    ranks = stats.rankdata(np.abs(differences))
    seen = ranks[np.array(differences) > 0.0].sum()
    sums = np.array(
        [
            sum(rank for rank, sign in zip(ranks, signs, strict=True) if sign)
            for signs in itertools.product((False, True), repeat=len(ranks))
        ]
    )
    less, greater = float(np.mean(sums <= seen + 1e-9)), float(np.mean(sums >= seen - 1e-9))
    return min(1.0, 2.0 * min(less, greater)), less, greater


TIES = [3.0, 3.0, -1.0, 2.0, 2.0, -2.0, 5.0, 1.0, 3.0, 4.0, -1.0, 6.0]


def test_signed_ranks_with_ties_are_exact():
    found = statistics.signed_rank_test(np.array(TIES) + 100.0, np.full(12, 100.0))
    ps = found["p"], found["p_less"], found["p_greater"]
    assert ps == pytest.approx(signs_by_hand(TIES))
    assert ps[0] == pytest.approx(stats.wilcoxon(TIES).pvalue)  # SciPy's permutation of 2**12 signs


def test_signed_ranks_with_ties_do_not_try_all_signs(monkeypatch):
    monkeypatch.setattr(stats, "wilcoxon", None)  # it would, of up to 13 pairs with ties
    differences = np.array(TIES * 4 + [7.0, 7.0])
    found = statistics.signed_rank_test(differences + 100.0, np.full(50, 100.0))
    assert 0.0 < found["p"] < 1e-4


@pytest.mark.parametrize("n", [8, 30, 50, 51, 200])
def test_signed_ranks_without_ties_are_scipys(n):
    differences = np.random.default_rng(n).normal(0.3, 1.0, n)
    found = statistics.signed_rank_test(differences, np.zeros(n))
    for name, each in (("p", "two-sided"), ("p_less", "less"), ("p_greater", "greater")):
        expected = stats.wilcoxon(np.round(differences, 9), alternative=each).pvalue
        assert found[name] == pytest.approx(expected, rel=1e-9)


def test_signed_ranks_take_infinite_values():
    first = np.array([math.inf, math.inf, 1.0, 9.0, 5.0])
    second = np.array([math.inf, 0.0, 3.0, 4.0, math.inf])
    # Differences: 0, inf, -2, 5, -inf with ranks (inf tied) 3.5, 1, 2, 3.5.
    found = statistics.signed_rank_test(first, second)
    assert found["effect"] == pytest.approx((3.5 + 2.0 - 1.0 - 3.5) / 10.0)


def test_a_difference_of_means_without_spread_is_tested_by_permutation():
    # Of 2**5 signs two give a difference as great; of 10 over 4 = 210 ways to divide one, and its
    # opposite.
    a, b = np.full(6, 3.0), np.full(6, 1.0)
    assert statistics.means_test(a, b, is_paired=True) == ("permutation", 2 / 2**6)
    assert statistics.means_test(a, b[:4], is_paired=False) == ("permutation", 2 / 210)
    assert statistics.means_test(a, a, is_paired=True) == ("permutation", 1.0)


def test_comparisons_are_counted_with_ties_apart():
    a, b = np.array([1.0, 2.0, 2.0]), np.array([2.0, 3.0, 1.0])
    paired = statistics.shares_of_comparisons(a, b, is_paired=True)
    assert paired == pytest.approx((1 / 3, 2 / 3))
    each_with_each = statistics.shares_of_comparisons(a, b, is_paired=False)
    assert each_with_each == pytest.approx((2 / 9, 4 / 9))  # 1 > nothing, 2 > 1 twice; 3 are equal


def test_pairing_divides_the_variance_by_a_ratio_that_needs_a_spread_of_the_differences():
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
        (
            [math.nan, math.nan, math.nan, 105.0, 120.0, 90.0, 99.0],
            4,
        ),  # one run in common, four values each
        ([math.nan, math.nan, 104.0, 105.0], 2),
    ],
)
def test_pairing_needs_two_runs_in_common(b, n):
    (found,) = rows(compared(a=[100.0, 110.0, 121.0, 133.0], b=b).differences)
    assert found.paired is (n == 2)
    assert (found.n, found.n_other) == (n, n)


def test_search_times_are_compared_up_to_the_shorter_limit():
    missions = frame(a=[100.0, 300.0], b=[150.0, 200.0])
    missions.loc[(missions["manager"] == "b") & (missions["run"] == 2), "pipeline_found"] = False
    for each in rows(compare_frame(missions, metrics=["search_time_s"]).summaries):
        assert each.horizon_s == 200.0
    for each in rows(compared(a=[100.0, 120.0], b=[150.0, 200.5]).summaries):
        assert each.horizon_s == 200.5


def test_the_conclusion_names_the_largest_p_of_those_that_it_is_about():
    a = [100.0 + each for each in range(12)]
    b = [each + 10.0 + 0.1 * place for place, each in enumerate(a)]
    c = [each + (8.0 if place > 1 else -3.0) + 0.1 * place for place, each in enumerate(a)]
    comparison = compared((1, 1, 1), a=a, b=b, c=c)
    # By signed ranks b differs with p = 2 / 2**12, times 3 in Holm's correction, c with p = 10 /
    # 2**12.
    ps = [each.p_holm for each in rows(comparison.differences)]
    assert ps == pytest.approx([6 / 2**12, 10 / 2**12, 6 / 2**12])
    ranks = (
        "By ranks, a finds the pipeline sooner than b and c (Wilcoxon, largest adjusted p = 0.002)."
    )
    assert ranks in comparison.conclusion
    assert f"{6 / 2**12:.3f}" == "0.001"


def test_ranks_of_independent_missions_favour_the_first_where_it_is_greater_in_more_than_half():
    # b is greater in most comparisons, but has a few very small values, so that its mean is less.
    a = [100.0] * 30 + [101.0] * 10
    b = [110.0 + place / 100.0 for place in range(31)] + [10.0] * 9
    (found,) = rows(compared((1, 2), a=a, b=b).differences)
    assert found.effect is not None and 0.0 < found.effect < 0.5
    assert found.difference > 0.0
    assert found.conclusion.startswith(
        "No difference of the mean search time is shown between a and b (a - b: 12.63 s"
    )
    assert " By ranks, a finds the pipeline sooner than b (" in found.conclusion


def test_groups_of_different_sizes_have_the_interval_of_a_mean_over_clusters():
    # W. G. Cochran, Sampling Techniques, 1977, chapter 9A: the variance of a ratio of cluster
    # totals to sizes.
    groups = [[10.0, 12.0, 11.0], [20.0], [14.0, 17.0], [9.0, 8.0, 10.0, 9.0]]
    values = [each for group in groups for each in group]
    labels = [place for place, group in enumerate(groups) for _ in group]
    mean = sum(values) / len(values)
    squares = sum((sum(group) - mean * len(group)) ** 2 for group in groups)
    half = stats.t.ppf(0.975, 3) * math.sqrt(4 / 3 * squares) / len(values)
    assert mean_of(values, labels).interval == pytest.approx((mean - half, mean + half))


MEAN_S = 0.9 * (0.6 * 90.0 + 0.4 * 180.0) + 0.1 * 300.0


def search_times(chance: np.random.Generator, n: int, delay_s: float = 0.0) -> NDArray[np.float64]:
    """Draw times with the shape of a campaign's: found early or late, and one in ten lost at the
    limit.
    """
    times_s = np.where(
        chance.random(n) < 0.6, chance.normal(90.0, 20.0, n), chance.normal(180.0, 25.0, n)
    )
    return np.where(chance.random(n) < 0.1, 300.0, times_s) + delay_s


def coverage_of_means(n: int, repetitions: int) -> float:
    chance = np.random.default_rng(1)
    covered = 0
    for _ in range(repetitions):
        low, high = mean_interval(search_times(chance, n)).interval or (np.nan, np.nan)
        covered += bool(low <= MEAN_S <= high)
    return covered / repetitions


def coverage_of_differences(n: int, m: int, repetitions: int) -> float:
    chance = np.random.default_rng(2)
    covered = 0
    for _ in range(repetitions):
        found = difference_interval(search_times(chance, n, 12.0), search_times(chance, m))
        low, high = found.interval or (np.nan, np.nan)
        covered += bool(low <= 12.0 <= high)
    return covered / repetitions


# Of 80 intervals of exactly 95%, 69 or more cover in all but one of a thousand draws.


def test_intervals_of_a_mean_cover_the_truth():
    assert coverage_of_means(40, 80) >= 69 / 80


def test_intervals_of_a_difference_cover_the_truth():
    assert coverage_of_differences(40, 60, 80) >= 69 / 80


def test_intervals_cover_the_truth_where_a_few_runs_differ_by_far():
    chance = np.random.default_rng(3)
    covered = 0
    for _ in range(200):
        differences = chance.normal(5.0, 2.0, 60) + np.where(chance.random(60) < 0.05, 80.0, 0.0)
        differences -= np.where(chance.random(60) < 0.05, 80.0, 0.0)
        low, high = mean_interval(differences).interval or (np.nan, np.nan)
        covered += bool(low <= 5.0 <= high)
    assert covered / 200 >= 0.91  # a bootstrap's covers in 84%


PAIRS = pytest.mark.parametrize(
    ("both", "only_first", "only_second"), [(0.93, 0.03, 0.01), (0.7, 0.15, 0.05), (1.0, 0.0, 0.0)]
)


@cache
def intervals_of_pairs(
    both: float, only_first: float, only_second: float
) -> list[tuple[float, float]]:
    """Intervals of 200 samples of pairs, drawn with given chances of what is found by whom."""
    chance = np.random.default_rng(4)
    intervals = []
    for n in (2, 5, 20, 100) * 50:
        kinds = chance.choice(
            4, n, p=[both, only_first, only_second, 1.0 - both - only_first - only_second]
        )
        found = paired_share_difference(kinds <= 1, (kinds == 0) | (kinds == 2))
        intervals.append(found.interval or (np.nan, np.nan))
    return intervals


@PAIRS
def test_intervals_of_shares_in_pairs_cover_the_truth(both, only_first, only_second):
    intervals = intervals_of_pairs(both, only_first, only_second)
    covered = sum(low <= only_first - only_second <= high for low, high in intervals)
    assert covered / 200 >= 0.92


@PAIRS
def test_intervals_of_shares_in_pairs_are_differences_of_shares(both, only_first, only_second):
    for low, high in intervals_of_pairs(both, only_first, only_second):
        assert -1.0 <= low < high <= 1.0


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def normal(mean: float, std: float, n: int, seed: int) -> np.ndarray:
    return rng(seed).normal(mean, std, n)


class TestBootstrap:
    def test_the_interval_of_the_ratio_is_near_that_of_f_for_normal_samples(self):
        published, simulated = normal(0, 2, 400, 3), normal(0, 3, 300, 4)
        ratio = simulated.std(ddof=1) / published.std(ddof=1)
        low, high = ratio_interval(published, simulated, rng()).interval
        quantiles = stats.f(299, 399).ppf([0.975, 0.025]) ** 0.5
        assert (low, high) == pytest.approx(tuple(ratio / quantiles), rel=0.03)

    def test_values_all_equal_have_no_ratio(self):
        found = ratio_interval(np.full(5, 0.1), np.full(7, 0.3), rng())
        assert np.isnan(found.value) and found.interval is None


class TestDistributions:
    @pytest.mark.parametrize("ties", [False, True])
    def test_the_anderson_darling_statistic_is_the_normalised_one_of_midranks(self, ties):
        first, second = normal(0, 3, 7, 1), normal(1, 4, 5, 2)
        if ties:
            first, second = first.round(), second.round()
        # Scholz and Stephens 1987, equation 7, value by value.
        total, terms = 0.0, []
        pooled = np.concatenate([first, second])
        n = len(pooled)
        for each in (first, second):
            terms = []
            for value in np.unique(pooled):
                equal, own = np.sum(pooled == value), np.sum(each == value)
                below, own_below = (
                    np.sum(pooled < value) + equal / 2,
                    np.sum(each < value) + own / 2,
                )
                weight = below * (n - below) - n * equal / 4
                terms.append(equal / n * (n * own_below - len(each) * below) ** 2 / weight)
            total += (n - 1) / n * sum(terms) / len(each)
        shift, _ = anderson_darling(first, second, rng(), permutations=9)
        other = stats.anderson_ksamp(
            [first, second], variant="midrank", method=stats.PermutationMethod(n_resamples=9)
        )
        assert shift == pytest.approx(other.statistic)
        assert (total > 1.0) == (shift > 0.0)  # 1 is its mean if both come from one distribution

    def test_the_permutation_p_of_equal_distributions_is_uniform(self):
        p = [
            anderson_darling(normal(0, 1, 8, s).round(1), normal(0, 1, 30, s + 999), rng(s), 99)[1]
            for s in range(200)
        ]
        assert stats.kstest(p, "uniform").pvalue > 0.001


class TestManagers:
    @pytest.mark.parametrize(
        ("p", "alternative"), [("p_less", "less"), ("p_greater", "greater"), ("p", "two-sided")]
    )
    def test_the_conclusion_has_scipys_p(self, p, alternative):
        first, second = normal(100, 20, 20, 1), normal(140, 20, 20, 2)
        expected = stats.mannwhitneyu(
            first, second, alternative=alternative, method="asymptotic"
        ).pvalue
        assert mann_whitney(first, second, "asymptotic")[p] == pytest.approx(expected)

    def test_the_conclusion_says_which_is_greater(self):
        found = mann_whitney(normal(100, 20, 20, 1), normal(140, 20, 20, 2), "asymptotic")
        assert sign_of(found["p_less"], found["p_greater"]) == -1
        assert sign_of(found["p_greater"], found["p_less"]) == 1
        assert sign_of(0.05, 0.05) == 0

    def test_subsamples_agree_with_a_clear_conclusion_alone(self):
        samples = normal(100, 20, 400, 1), normal(200, 20, 400, 2)
        assert [
            agreement(sign, samples, (20, 20), rng(), subsamples=200) for sign in (1, 0, -1)
        ] == [0.0, 0.0, 1.0]

    def test_a_subsample_has_no_mission_twice(self):
        # Drawn without replacement, a sample of the whole is the sample, and its conclusion the same.
        first, second = np.arange(6.0), np.arange(6.0) + 2.2
        sign = sign_of(
            *(
                mann_whitney(first, second, "asymptotic")[f"p_{each}"]
                for each in ("less", "greater")
            )
        )
        assert agreement(sign, (first, second), (6, 6), rng(), subsamples=200) == 1.0

    def test_equal_managers_are_told_apart_by_chance_in_one_of_twenty_each_way(self):
        samples = normal(100, 20, 4_000, 1), normal(100, 20, 4_000, 2)
        shares = [agreement(sign, samples, (20, 20), rng()) for sign in (1, 0, -1)]
        assert sum(shares) == pytest.approx(1.0)
        assert shares[1] == pytest.approx(0.9, abs=0.03)


@pytest.mark.parametrize(("count", "n"), [(0, 20), (9, 20), (20, 20), (1, 7)])
@pytest.mark.parametrize("method", ["exact", "wilson"])
def test_the_interval_of_a_share_is_scipys(count, n, method):
    reference = stats.binomtest(count, n).proportion_ci(method=method)
    assert share_of(count, n, method).interval == pytest.approx((reference.low, reference.high))


class TestQuickForms:
    """What is computed here in place of a library's function, for speed, has its value."""

    def test_p_of_pairs_is_scipys_to_the_last_digit(self):
        rng = np.random.default_rng(1)
        for n in (2, 3, 20, 117):
            first, second = rng.normal(100.0, 30.0, (2, n)).round(2)
            expected = float(stats.ttest_rel(first, second).pvalue)
            assert means_test(first, second, is_paired=True) == ("Student's t", expected)

    def test_signed_ranks_with_ties_are_scipys(self):
        first = np.array([1.0, 2.0, 2.0, 3.0, 5.0, 8.0, 9.0, 9.0])
        second = np.array([2.0, 1.0, 4.0, 1.0, 2.0, 6.0, 4.0, 9.0])
        apart = first - second
        ranks = stats.rankdata(np.abs(apart[apart != 0.0]))
        expected = 2.0 * ranks[apart[apart != 0.0] > 0.0].sum() / ranks.sum() - 1.0
        assert signed_rank_test(first, second)["effect"] == pytest.approx(expected)

    @pytest.mark.parametrize("half_width", [0.001, 0.0123, 0.1, 0.5, 1.0, 3.0, 50.0])
    def test_no_fewer_runs_make_an_interval_as_narrow(self, half_width):
        def half(n: int) -> float:
            return float(stats.t.ppf(0.975, n - 1) / math.sqrt(n))

        n = runs_for(1.0, half_width)
        assert half(n) <= half_width and (n == 2 or half(n - 1) > half_width)


SEARCH_TIMES = """
import numpy as np
from suave_des.results.statistics import search_times

drawn = np.random.default_rng(1)
for _ in range(20):
    times_s = drawn.integers(40, 301, 100).astype(float)
    print(search_times(times_s, times_s < 300.0, 300.0))
"""


def test_restricted_means_are_the_same_on_all_processors():
    assert len(set(printed_on_each(SEARCH_TIMES))) == 1
