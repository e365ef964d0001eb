"""Statistics agree with worked examples and with scipy's own, and repeat with their seed."""

import numpy as np
import pytest
from scipy import stats

from suave_des.estimates import share_of
from suave_des.results.statistics import (
    agreement,
    anderson_darling,
    mann_whitney,
    ratio_interval,
    sign_of,
)


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
                below, own_below = np.sum(pooled < value) + equal / 2, np.sum(each < value) + own / 2
                weight = below * (n - below) - n * equal / 4
                terms.append(equal / n * (n * own_below - len(each) * below) ** 2 / weight)
            total += (n - 1) / n * sum(terms) / len(each)
        shift, _ = anderson_darling(first, second, rng(), permutations=9)
        other = stats.anderson_ksamp([first, second], variant="midrank", method=stats.PermutationMethod(n_resamples=9))
        assert shift == pytest.approx(other.statistic)
        assert (total > 1.0) == (shift > 0.0)  # 1 is its mean if both come from one distribution

    def test_the_permutation_p_of_equal_distributions_is_uniform(self):
        p = [
            anderson_darling(normal(0, 1, 8, s).round(1), normal(0, 1, 30, s + 999), rng(s), 99)[1] for s in range(200)
        ]
        assert stats.kstest(p, "uniform").pvalue > 0.001


class TestManagers:
    def test_the_conclusion_has_scipys_p_and_says_which_is_greater(self):
        first, second = normal(100, 20, 20, 1), normal(140, 20, 20, 2)
        found = mann_whitney(first, second, "asymptotic")
        for p, each in ((found.p_less, "less"), (found.p_greater, "greater"), (found.p, "two-sided")):
            assert p == pytest.approx(stats.mannwhitneyu(first, second, alternative=each, method="asymptotic").pvalue)
        assert sign_of(found.p_less, found.p_greater) == -1
        assert sign_of(found.p_greater, found.p_less) == 1
        assert sign_of(0.05, 0.05) == 0

    def test_subsamples_agree_with_a_clear_conclusion_and_not_with_its_opposite(self):
        samples = normal(100, 20, 400, 1), normal(200, 20, 400, 2)
        assert [agreement(sign, samples, (20, 20), rng(), subsamples=200) for sign in (1, 0, -1)] == [0.0, 0.0, 1.0]

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
