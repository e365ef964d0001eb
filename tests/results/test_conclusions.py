"""What a comparison says in words: each sentence as it is printed, from a difference made by hand.

Means, ranks and pairs each have a sentence, and none says what only another shows.
"""

from typing import Any

import pytest

from suave_des.estimates import Estimate
from suave_des.records.metrics import METRICS, Metric, metric_of
from suave_des.results.conclusions import conclusion, difference_claim, overall_conclusion

SEARCH_TIME, DISTANCE, FOUND = (
    METRICS[name] for name in ("search_time_s", "distance_inspected_m", "pipeline_found")
)
NEUTRAL = METRICS["battery_level"]


def difference(
    mean: tuple[float, float, float] = (0.5, -1.0, 2.0), mean_p: float = 0.6, **changed: Any
) -> dict[str, Any]:
    """The difference of a and b in 200 pairs of which a is greater in 88 and less in 100; nothing is
    shown but what is changed."""
    estimate = Estimate(*mean, method="Student's t")
    row: dict[str, Any] = {"group": "a", "other": "b", "metric": "search_time_s", "paired": True}
    row |= {"n": 200, "n_other": 200, "difference": estimate, "mean_test": "Student's t"}
    row |= {"mean_p_holm": mean_p, "test": "Wilcoxon signed-rank", "p_holm": 0.5, "effect": 0.01}
    return row | {"share_greater": 0.44, "share_less": 0.5, "tests": 1} | changed


EARLIER, LATER = (-5.0, -7.0, -3.0), (5.0, 3.0, 7.0)
NO_RANKS = "By ranks, no difference is shown (Wilcoxon, p = 0.50)."
PAIRS = "Of 200 pairs, a has the lower search time in 100, b in 88; 12 are equal."


@pytest.mark.parametrize(
    ("mean", "sentence"),
    [
        (EARLIER, "a finds the pipeline 5.00 s sooner than b on average"),
        (LATER, "b finds the pipeline 5.00 s sooner than a on average"),
    ],
)
def test_means_are_said_of_means_alone(mean, sentence):
    found = conclusion(difference(mean, 0.0001), SEARCH_TIME)
    evidence = "(95% interval 3.00 to 7.00; 200 pairs, Student's t, p < 0.001)."
    assert found == f"{sentence} {evidence} {NO_RANKS} {PAIRS}"


@pytest.mark.parametrize(
    ("effect", "sentence"),
    [
        (0.3, "By ranks, b finds the pipeline sooner than a (Wilcoxon, p = 0.016)."),
        (-0.3, "By ranks, a finds the pipeline sooner than b (Wilcoxon, p = 0.016)."),
    ],
)
def test_ranks_are_said_of_ranks_alone(effect, sentence):
    found = conclusion(difference(effect=effect, p_holm=0.016), SEARCH_TIME)
    means = (
        "No difference of the mean search time is shown between a and b (a - b: 0.50 s, 95% interval -1.00 to 2.00;"
        " 200 pairs, Student's t, p = 0.60)."
    )
    assert found == f"{means} {sentence} {PAIRS}"


def test_a_disagreement_of_means_with_ranks_is_said():
    found = conclusion(difference(EARLIER, 0.01, effect=0.3, p_holm=0.016), SEARCH_TIME)
    assert found == (
        "a finds the pipeline 5.00 s sooner than b on average (95% interval 3.00 to 7.00; 200 pairs, Student's t,"
        f" p = 0.010). By ranks, b finds the pipeline sooner than a (Wilcoxon, p = 0.016). {PAIRS}"
        " Means and ranks disagree: the distributions differ in shape."
    )


@pytest.mark.parametrize(
    ("effect", "sentence"),
    [
        (0.7, "By ranks, a inspects more than b (Mann-Whitney, adjusted p = 0.016)."),
        (0.3, "By ranks, b inspects more than a (Mann-Whitney, adjusted p = 0.016)."),
    ],
)
def test_of_what_is_better_if_greater_the_greater_one_is_named_first(effect, sentence):
    changed = {
        "effect": effect,
        "p_holm": 0.016,
        "test": "Mann-Whitney",
        "paired": False,
        "tests": 4,
    }
    found = conclusion(difference(**changed), DISTANCE)
    assert found == (
        "No difference of the mean distance inspected is shown between a and b (a - b: 0.50 m, 95% interval -1.00 to"
        f" 2.00; not paired, Student's t, adjusted p = 0.60). {sentence} Of all comparisons of one with the other, a has"
        " the greater distance inspected in 44%, b in 50%; 6% are equal."
    )


@pytest.mark.parametrize(
    ("metric", "value", "claim"),
    [
        (SEARCH_TIME, 2.0, "b finds the pipeline 2.00 s sooner than a"),
        (SEARCH_TIME, -2.0, "a finds the pipeline 2.00 s sooner than b"),
        (DISTANCE, 2.0, "a inspects 2.00 m more than b"),
        (DISTANCE, -2.0, "b inspects 2.00 m more than a"),
        (NEUTRAL, 2.0, "a has 2.000 more battery level than b"),
        (NEUTRAL, -2.0, "b has 2.000 more battery level than a"),
        (METRICS["adaptations"], -2.0, "b makes 2.00 more adaptations than a"),
        (metric_of("requirement_speed"), 0.5, "a satisfies speed 0.500 better than b"),
        (
            FOUND,
            -0.167,
            "b finds the pipeline in 16.7 percentage points more of its missions than a",
        ),
    ],
)
def test_a_claim_names_the_better_one_first(metric, value, claim):
    assert difference_claim("a", "b", value, metric) == claim


SHARES = {"test": "McNemar, exact", "effect": None, "mean_p_holm": None, "n": 40}


def test_of_shares_there_is_one_sentence_in_percentage_points():
    found = conclusion(difference((0.167, 0.031, 0.535), p_holm=0.02, **SHARES), FOUND)
    assert found == (
        "a finds the pipeline in 16.7 percentage points more of its missions than b (95% interval 3.1 to 53.5; 40 pairs,"
        " McNemar, p = 0.020)."
    )


def test_a_test_of_shares_whose_interval_contains_0_claims_no_size():
    found = conclusion(difference((0.1, -0.01, 0.2), p_holm=0.04, **SHARES), FOUND)
    assert found == (
        "The test shows a difference of the share that found the pipeline between a and b, but its interval contains 0"
        " (a - b: 10.0 percentage points, 95% interval -1.0 to 20.0; 40 pairs, McNemar, p = 0.040)."
    )


def test_equal_pairs_are_said_to_be_equal():
    equal = difference(n=25) | {"difference": Estimate(0.0)}
    assert conclusion(equal, SEARCH_TIME) == "a and b have the same search time in all 25 pairs."


def overall(metric: Metric, means: dict[str, float], *rows: dict[str, Any]) -> str:
    return overall_conclusion(metric, rows, means, list(means))


def test_the_best_of_all_is_named_by_means_then_ranks_then_pairs():
    rows = (
        difference(EARLIER, 0.01, effect=-0.4, p_holm=0.002, tests=3),
        difference(EARLIER, 0.02, effect=0.3, p_holm=0.016, tests=3, other="c"),
    )
    assert overall(SEARCH_TIME, {"a": 100.0, "b": 105.0, "c": 105.0}, *rows) == (
        "a finds the pipeline soonest on average: 5.00 s sooner than b (95% interval 3.00 to 7.00) and 5.00 s sooner than"
        " c (95% interval 3.00 to 7.00); Student's t, largest adjusted p = 0.020. By ranks, a finds the pipeline sooner"
        " than b (Wilcoxon, adjusted p = 0.002); a finds the pipeline later than c (Wilcoxon, adjusted p = 0.016). a has"
        " the lower search time in 100 of 200 pairs with b (higher in 88) and in 100 of 200 pairs with c (higher in 88)."
    )


def test_who_is_equal_to_another_in_all_pairs_is_not_soonest():
    rows = (
        difference(EARLIER, 0.01, effect=-0.4, p_holm=0.002, tests=3),
        difference(n=25, other="c", tests=3) | {"difference": Estimate(0.0)},
    )
    assert overall(SEARCH_TIME, {"a": 100.0, "b": 105.0, "c": 100.0}, *rows) == (
        "On average, a finds the pipeline 5.00 s sooner than b (95% interval 3.00 to 7.00); Student's t, adjusted"
        " p = 0.010; no difference of the means is shown to c (equal in all 25 pairs). By ranks, a finds the pipeline"
        " sooner than b (Wilcoxon, adjusted p = 0.002). a has the lower search time in 100 of 200 pairs with b (higher in"
        " 88)."
    )


def test_a_best_mean_that_is_not_shown_to_be_better_is_called_no_more_than_that():
    rows = difference(group="b", other="a", effect=0.4, p_holm=0.002), difference(other="c")
    assert overall(SEARCH_TIME, {"a": 100.0, "b": 100.5, "c": 99.5}, *rows) == (
        "No difference of the mean search time is shown between c, which has the best mean, and a. By ranks, no"
        " difference is shown between c and a. c has the lower search time in 88 of 200 pairs with a (higher in 100)."
    )


def test_a_mean_of_all_runs_that_is_best_but_worse_in_pairs_is_said_of_the_other():
    rows = difference(LATER, 0.01), difference(other="c")
    found = overall(SEARCH_TIME, {"a": 99.0, "b": 105.0, "c": 110.0}, *rows)
    assert found.startswith(
        "No difference of the mean search time is shown between a, which has the best mean of all its runs, and c."
        " b finds the pipeline 5.00 s sooner than a on average (95% interval 3.00 to 7.00;"
    )
