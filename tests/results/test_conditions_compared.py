"""Real missions that carry a condition are compared by condition: missions of one condition are
alike, so that conditions are what is independent.
"""

import numpy as np
import pandas
import pytest
from scipy import stats

from suave_des.results.compare import compare_folders
from tests.helpers.compared import compare_frame, difference, interval, row, rows

MANAGERS = ("bt", "metacontrol")


def real_missions(
    rng: np.random.Generator, conditions: int = 6, each: int = 5, later_s: float = 0.0
) -> pandas.DataFrame:
    """Missions whose search times differ by 30 s between conditions, and by 5 s within; those of
    metacontrol are later."""
    shared_s = rng.normal(100.0, 30.0, conditions)
    table = [
        (manager, number, shared_s[number - 1] + shift_s + rng.normal(0.0, 5.0))
        for manager, shift_s in zip(MANAGERS, (0.0, later_s), strict=True)
        for number in range(1, conditions + 1)
        for _ in range(each)
    ]
    frame = pandas.DataFrame(table, columns=["manager", "condition", "search_time_s"])
    return frame.assign(distance_inspected_m=30.0, pipeline_found=1.0)


def condition_means(frame: pandas.DataFrame, manager: str) -> np.ndarray:
    """The mean search time under each condition, computed apart from the package."""
    own = frame[frame["manager"] == manager]
    numbers = sorted(own["condition"].unique())
    return np.array([own.loc[own["condition"] == n, "search_time_s"].mean() for n in numbers])


def test_a_mean_has_the_t_interval_over_its_conditions():
    frame = real_missions(np.random.default_rng(1))
    means = condition_means(frame, "bt")
    found = row(compare_frame(frame).summaries, group="bt", metric="search_time_s")
    low, high = stats.t.interval(0.95, 5, means.mean(), stats.sem(means))
    assert found.n == 6
    assert (found.mean, *interval(found, "mean")) == pytest.approx((means.mean(), low, high))


def test_managers_of_one_source_are_paired_by_condition():
    frame = real_missions(np.random.default_rng(2), later_s=4.0)
    first, second = (condition_means(frame, name) for name in MANAGERS)
    tested = stats.ttest_rel(first, second)
    found = difference(compare_frame(frame), *MANAGERS)
    expected = ((first - second).mean(), *tested.confidence_interval(0.95), tested.pvalue)
    assert (found.difference, *interval(found, "difference"), found.mean_p) == pytest.approx(
        expected
    )
    assert found.p == pytest.approx(stats.wilcoxon(first, second).pvalue)


def test_conditions_that_are_not_to_be_paired_are_compared_by_welch():
    frame = real_missions(np.random.default_rng(3))
    first, second = (condition_means(frame, name) for name in MANAGERS)
    welch = stats.ttest_ind(first, second, equal_var=False).confidence_interval(0.95)
    found = difference(compare_frame(frame, unpaired=True), *MANAGERS)
    assert interval(found, "difference") == pytest.approx(tuple(welch))


def test_conditions_of_several_sources_are_not_paired(tmp_path):
    frame = real_missions(np.random.default_rng(4))
    for name, own in frame.groupby("manager"):
        own.assign(pipeline_found=True).to_csv(tmp_path / f"{name}.csv", index=False)
    comparison = compare_folders([tmp_path / f"{name}.csv" for name in MANAGERS])
    assert [(found.paired, found.n) for found in rows(comparison.differences)][:1] == [(False, 6)]


def test_the_output_says_that_conditions_are_compared():
    text = " ".join(compare_frame(real_missions(np.random.default_rng(5))).text().split())
    assert "Paired by condition, under which both have missions." in text
    assert "Note: missions of one condition are alike:" in text


def test_a_share_has_an_interval_over_conditions_though_all_found_the_pipeline():
    from statsmodels.stats.proportion import proportion_confint

    comparison = compare_frame(real_missions(np.random.default_rng(6)))
    found = row(comparison.summaries, group="bt", metric="pipeline_found")
    expected = proportion_confint(6, 6, method="wilson")
    assert interval(found, "mean") == pytest.approx(expected)


@pytest.mark.parametrize(
    "changed",
    [{"condition": 1}, {"scenario": "seams2023"}, {"condition": [1, *[None] * 59]}],
    ids=["one condition", "simulated", "not all known"],
)
def test_missions_without_several_known_conditions_are_independent(changed):
    frame = real_missions(np.random.default_rng(7)).assign(**changed)
    assert row(compare_frame(frame).summaries, group="bt", metric="search_time_s").n == 30


def test_intervals_hold_what_they_should_where_conditions_differ():
    """Each of 150 columns of requirements stands for an experiment of its own."""
    rng = np.random.default_rng(8)
    names = [f"requirement_{number}" for number in range(150)]
    made = {name: real_missions(rng, later_s=4.0)["search_time_s"] for name in names}
    frame = pandas.concat([real_missions(rng), pandas.DataFrame(made)], axis=1)
    comparison = compare_frame(frame, metrics=names)
    means = [interval(each, "mean") for each in rows(comparison.summaries) if each.group == "bt"]
    apart = [interval(each, "difference") for each in rows(comparison.differences)]
    # of 150 intervals that hold in 95% of cases, 99.9% of samples have as many or more
    least = stats.binom.ppf(0.001, 150, 0.95)
    assert sum(low <= 100.0 <= high for low, high in means) >= least
    assert sum(low <= -4.0 <= high for low, high in apart) >= least
