"""A simulation that is like the published runs meets the targets; one that is not fails those that
it should.
"""

import json
import math

import numpy as np
import pandas
import pytest
from scipy.stats import mannwhitneyu

from analysis.split_check import split_check
from suave_des.reality.missions import Share, Targets
from suave_des.reality.validation import JSON_FILE, TABLES, compare_with_paper, validate
from suave_des.records.runs import read_runs
from suave_des.resources import shipped_folder
from suave_des.scenario.yamlfile import read_yaml, validated

pytestmark = pytest.mark.usefixtures("few_resamples")
MANAGERS = ("none", "random", "metacontrol")
DATA = shipped_folder("scenarios/published") / "seams2023_runs.csv"
TARGETS = DATA.with_suffix(".targets.yaml")


@pytest.fixture(scope="module")
def published():
    return read_runs(DATA).frame


@pytest.fixture(scope="module")
def like_published(published):
    """A simulation with the published distributions: every published mission ten times over."""
    return pandas.concat([published] * 10, ignore_index=True)


@pytest.fixture(scope="module")
def good(published, like_published, few_resamples):
    return validate(
        published, like_published, MANAGERS, shares=validated(read_yaml(TARGETS), Targets).shares
    )


def missed(validation):
    targets = validation.targets.to_dict("records")
    return {
        (each["kind"], each["subject"], each["what"]) for each in targets if each["met"] is not True
    }


def test_a_simulation_with_the_published_distributions_meets_every_target(good):
    assert missed(good) == set()
    assert len(good.targets) == 6 * 3 + 6 + 4
    assert good.all_met


def test_figures_of_a_cell(good):
    cell = good.cells.set_index(["manager", "metric"]).loc["none", "search_time_s"]
    assert cell[["published_n", "simulated_n"]].tolist() == [20, 200]
    assert ends(cell, "published_mean") == pytest.approx([168.01, 207.69], abs=0.01)
    assert ends(cell, "published_std") == pytest.approx([32.24, 61.92], abs=0.01)
    assert cell["difference_of_means"] == pytest.approx(0.0)
    low, high = ends(cell, "difference_of_means")
    assert low < 0 < high
    assert cell["std_ratio"] == pytest.approx(1.0, abs=0.03)
    assert cell["ks_p"] == pytest.approx(1.0)


def ends(row, name):
    return [row[f"{name}_ci95_{end}"] for end in ("low", "high")]


@pytest.mark.parametrize(
    ("metric", "first_p", "second_p", "superiority", "better"),
    [
        # Of 25 pairs of values the first is greater in one.
        ("search_time_s", "less", "greater", 0.96, "none"),
        ("distance_inspected_m", "greater", "less", 0.04, "bt"),
    ],
)
def test_a_pair_says_which_manager_the_tests_find_better(
    missions, metric, first_p, second_p, superiority, better
):
    values = {"none": [10.0, 12.0, 14.0, 16.0, 19.0], "bt": [18.0, 20.0, 22.0, 24.0, 26.0]}
    real = missions({name: [(each, each, 0.0) for each in own] for name, own in values.items()})
    real = real.assign(mean_reaction_time_s=math.nan)
    row = validate(real, real, ("none", "bt")).pairs.set_index("metric").loc[metric]
    ps = {
        side: mannwhitneyu(
            values["none"], values["bt"], alternative=side, method="asymptotic"
        ).pvalue
        for side in ("less", "greater")
    }
    assert row["published_first_better_p"] == pytest.approx(ps[first_p])
    assert row["published_second_better_p"] == pytest.approx(ps[second_p])
    assert row["published_superiority"] == pytest.approx(superiority)
    assert row["published_better"] == better


def claims(found):
    return [each for each in found.remarks() if "in the paper, metacontrol" in each]


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        (
            {},
            [
                "As in the paper, metacontrol finds the pipeline sooner than the paper's other managers, on average.",
                "As in the paper, metacontrol inspects more of it than the paper's other managers, on average.",
            ],
        ),
        (
            {"random": [(90, 20, 0), (92, 21, 0)]},
            [
                "Unlike in the paper, metacontrol does not find the pipeline sooner than all the paper's other managers, on average.",
                "As in the paper, metacontrol inspects more of it than the paper's other managers, on average.",
            ],
        ),
        (
            {"none": [(200, 50, 0), (202, 51, 0)]},
            [
                "As in the paper, metacontrol finds the pipeline sooner than the paper's other managers, on average.",
                "Unlike in the paper, metacontrol does not inspect more of it than all the paper's other managers, on average.",
            ],
        ),
        (
            {"random": [(90, 20, 0), (130, 21, 0)]},
            [
                "As in the paper, metacontrol finds the pipeline sooner than the paper's other managers, on average;"
                " the difference from random could be chance.",
                "As in the paper, metacontrol inspects more of it than the paper's other managers, on average.",
            ],
        ),
    ],
)
def test_the_papers_claims_are_compared_with_every_other_manager(missions, changed, told):
    own = {
        "none": [(200, 10, 0), (202, 11, 0)],
        "random": [(150, 20, 0), (152, 21, 0)],
        "metacontrol": [(100, 40, 0), (102, 41, 0)],
    }
    assert claims(compare_with_paper(missions(own | changed))) == told


def test_nothing_is_said_of_the_papers_claims_without_metacontrol_or_another(missions):
    for name in ("none", "metacontrol"):
        assert claims(compare_with_paper(missions({name: [(100, 10, 0), (102, 11, 0)]}))) == []


def test_a_shifted_manager_fails_in_its_own_cell_alone(published, like_published):
    shifted = like_published.copy()
    shifted.loc[shifted["manager"] == "none", "search_time_s"] -= 40
    found = validate(published, shifted, MANAGERS)
    assert ("mean", "none", "search_time_s") in missed(found)
    assert ("ks", "none", "search_time_s") in missed(found)
    assert {(subject, what) for kind, subject, what in missed(found) if kind != "conclusion"} == {
        ("none", "search_time_s")
    }


def test_a_cluster_that_is_averaged_away_fails_its_share(published, like_published):
    smeared = like_published.copy()
    late = smeared["search_time_s"].between(120, 130) & (smeared["manager"] == "metacontrol")
    smeared.loc[late, "search_time_s"] += 12
    found = missed(
        validate(published, smeared, MANAGERS, shares=validated(read_yaml(TARGETS), Targets).shares)
    )
    assert ("share", "metacontrol", "found at 120 to 130 s") in found


@pytest.fixture(scope="module")
def of_none_alone(published, like_published, few_resamples):
    return validate(published, like_published, ("none",))


def test_the_result_repeats_with_its_seed(published, like_published, good):
    shares = validated(read_yaml(TARGETS), Targets).shares
    assert validate(published, like_published, MANAGERS, shares=shares).texts({}) == good.texts({})


def test_the_result_of_a_manager_does_not_depend_on_the_others(good, of_none_alone):
    pandas.testing.assert_frame_equal(
        of_none_alone.cells, good.cells.query("manager == 'none'").reset_index(drop=True)
    )


def test_one_manager_makes_no_pair(of_none_alone):
    assert of_none_alone.pairs.empty


def test_another_seed_resamples_otherwise(published, like_published, of_none_alone):
    other = validate(published, like_published, ("none",), seed=2)
    assert ends(other.cells.loc[0], "std_ratio") != ends(of_none_alone.cells.loc[0], "std_ratio")


@pytest.fixture(scope="module")
def of_few(published, few_resamples):
    """A validation with one simulated mission of each manager."""
    few = published.groupby("manager").head(1)
    shares = [
        Share(manager="none", name="of none", of="detections", among={"search_time_s": [(0, 1)]},
              where={"detection_x_m": [(-19, -18)]}, target=(0, 1))
    ]  # fmt: skip
    return validate(published, few, MANAGERS, shares=shares)


@pytest.mark.parametrize("kind", ["std", "conclusion", "share"])
def test_what_few_missions_cannot_show_is_not_judged(of_few, kind):
    assert of_few.targets.set_index("kind")["met"].to_dict()[kind] is None


def test_what_is_not_judged_is_not_met(of_few):
    assert not of_few.all_met


def test_what_is_not_judged_is_counted_apart(of_few):
    summary = json.loads(of_few.texts({})[JSON_FILE])["targets_summary"]
    assert summary["not_judged"] == of_few.targets["met"].isna().sum()


@pytest.mark.parametrize(
    ("place", "met"), [("low", True), ("high", True), ("below", False), ("above", False)]
)
def test_a_target_holds_at_its_limits(published, place, met):
    own = published[published["manager"] == "none"].assign(pipeline_found=1.0)
    low, high = ends(validate(own, own, ("none",)).cells.loc[0], "published_mean")
    wanted = {"low": low, "high": high, "below": low - 1e-6, "above": high + 1e-6}[place]
    found = validate(own, own.assign(search_time_s=wanted), ("none",)).targets
    assert found.loc[0, ["kind", "met"]].tolist() == ["mean", met]


class TestFiles:
    @pytest.fixture(scope="class")
    @staticmethod
    def files(good):
        return good.texts({"seed": 1})

    @pytest.fixture(scope="class")
    @staticmethod
    def content(files):
        return json.loads(files[JSON_FILE])

    def test_the_json_says_where_the_missions_come_from(self, content):
        assert content["provenance"] == {"seed": 1}

    def test_the_json_counts_the_targets(self, content):
        assert content["targets_summary"] == {"met": 28, "not_met": 0, "not_judged": 0}

    def test_the_json_has_all_tables(self, content):
        assert [len(content[name]) for name in ("cells", "pairs", "targets")] == [6, 6, 28]
        assert [cell["manager"] for cell in content["cells"][:3]] == list(MANAGERS)

    @pytest.mark.parametrize("name", ["cells", "pairs"])
    def test_a_table_has_a_line_for_each_manager_or_pair_under_its_header(self, files, name):
        assert len(files[TABLES[name]].splitlines()) == 7

    def test_the_table_of_targets_has_their_limits(self, files):
        assert files[TABLES["targets"]].startswith("kind,subject,what,value,low,high,met\n")


def test_predicted_means_are_told_in_published_standard_deviations(missions):
    published = missions({"none": [(100, 10, 0), (120, 30, 0)], "random": [(50, 5, 0), (60, 6, 0)]})
    fitted = {"none": missions({"none": [(120, 12, 0), (130, 14, 0)], "random": [(0, 0, 0)]})}
    table = split_check(fitted, published).set_index("metric")
    search = table.loc["search_time_s"]
    assert (search["left_out"], search["published_mean"], search["predicted_mean"]) == (
        "none",
        110,
        125,
    )
    assert search["difference"] == 15
    assert search["difference_in_std"] == pytest.approx(15 / np.std([100, 120], ddof=1))
    assert not search["within"]
    distance = table.loc["distance_inspected_m"]
    assert distance["difference_in_std"] == pytest.approx(-7 / np.std([10, 30], ddof=1))
    assert distance["within"]
