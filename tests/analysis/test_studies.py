"""The studies in analysis/: a small repetition of each gives what is committed."""

import ast
import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas
import pytest

from suave_des.reality.assisted import Chance, assisted_mean

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "analysis"
SCRIPTS = sorted(FOLDER.glob("*.py"))
CASES = {
    "when_adapting_pays": [("seams2023", "period 80 s (paper)", 2.57, "exemplar's")],
    "rule_worth": ["S11", "QAWaterVisibility"],
    "period_and_failure": [(80.0, 35.0)],
    "design_thresholds": [-0.25],
}
"""Cases of each study that are run again, a few missions each."""
KEYS = {
    "when_adapting_pays": ["scenario", "visibility", "start_y_m", "pipeline", "against_m"],
    "rule_worth": ["rule", "metric"],
    "period_and_failure": ["period_s", "failure_s", "metric"],
    "design_thresholds": ["margin_m", "metric"],
}


@pytest.mark.parametrize("script", sorted(FOLDER.rglob("*.py")), ids=lambda path: path.stem)
def test_a_study_imports_nothing_but_the_public_package(script):
    nodes = list(ast.walk(ast.parse(script.read_text(encoding="utf-8"))))
    modules = {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
    modules |= {name.name for node in nodes if isinstance(node, ast.Import) for name in node.names}
    assert not [name for name in modules if name.startswith("suave_des.")]


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> Iterator[object]:
    """Imports a study as its own command does: with its folder first on the path."""
    monkeypatch.syspath_prepend(str(FOLDER))

    def load(name: str) -> ModuleType:
        return importlib.import_module(name)

    yield load
    for script in SCRIPTS:
        sys.modules.pop(script.stem, None)
    for name in [name for name in sys.modules if name.partition(".")[0] == "calibration"]:
        del sys.modules[name]


def committed(name: str) -> pandas.DataFrame:
    return pandas.read_csv(FOLDER / name / f"{name}.csv")


@pytest.mark.parametrize("name", CASES)
def test_a_small_repetition_gives_the_committed_figures_of_the_first_runs(study, name):
    module = study(name)
    again = module.study(module.studies.FIRST_RUNS, 1, CASES[name]).set_index(KEYS[name])[
        "first_difference"
    ]
    assert len(again) > 0
    before = committed(name).set_index(KEYS[name])["first_difference"].loc[again.index]
    assert again.to_numpy() == pytest.approx(before.to_numpy(), abs=1e-3)


def test_the_effects_of_parameters_are_drawn(study):
    module = study("sensitivity")
    effects = {
        (manager, metric): np.arange(2.0)
        for manager in module.MANAGERS
        for metric in module.METRICS
    }
    figure = module.studies.figure_of(module.draw, ["a", "b"], effects, height=2.0)
    assert len(figure.axes) == len(module.METRICS)


def predictions() -> pandas.DataFrame:
    return pandas.read_csv(FOLDER / "predictions" / "predictions.csv", dtype={"condition": str})


@pytest.mark.parametrize("experiment", ["exp3", "extended_exp2"])
def test_a_small_repetition_gives_the_committed_predictions_of_the_first_runs(study, experiment):
    module = study("predict")
    missions = module.simulate(experiment, module.studies.FIRST_RUNS, 1)
    again = missions.groupby(["manager", "condition"], observed=True)["search_time_s"].mean()
    before = predictions()
    before = before[(before["experiment"] == experiment) & (before["metric"] == "search_time_s")]
    before = before.set_index(["manager", "condition"])["first_mean"]
    for (manager, condition), mean in again.items():
        assert mean == pytest.approx(before[manager, str(condition)], abs=1e-3)


def test_predictions_name_the_files_that_made_them(study):
    module, rows = study("predict"), predictions()
    for experiment, own in rows.groupby("experiment"):
        found = own[list(module.MADE_OF)].drop_duplicates().to_dict("records")
        made_of = module.made_of(experiment)
        assert len(found) == 1 and found[0].keys() == made_of.keys()
        # Code may change where missions do not: a small repetition above says whether they do.
        assert {**found[0], "code": made_of["code"]} == made_of


def test_the_plain_command_makes_the_inputs_that_are_committed(study, monkeypatch, tmp_path):
    module = study("predict")
    monkeypatch.setattr(module, "EXPERIMENTS", ["exp3", "extended_exp2"])
    module.import_configurations(tmp_path)
    made = sorted(tmp_path.iterdir())
    assert len(made) == 4
    for file in made:
        assert file.read_text() == (FOLDER / "predictions" / file.name).read_text()


@pytest.mark.parametrize("manager, spread", [("bt", 13.0**0.5), ("bt_extended", 20.0)])
def test_intervals_get_the_structural_error_in_its_share_of_the_spread(study, manager, spread):
    # Of the experiment, sqrt(3^2 + 2^2), or of experiment 1, if that is larger.
    values = {"metric": "search_time_s", "low90": 11.0, "high90": 13.0}
    cells = [("1", 10.0), ("2", 14.0), ("all", 12.0)]
    rows = [
        {"experiment": "exp2", "manager": manager, "condition": name, "mean": mean, "std": 3.0}
        for name, mean in cells
    ]
    if manager == "bt_extended":
        there = {"experiment": "exp1", "manager": "bt", "condition": "1", "std": 20.0}
        rows.append({**there, "mean": 12.0})
    frame = pandas.DataFrame(rows).assign(**values)
    found = (
        study("predict")
        .widened(frame, shares=(9.0, 0.5), members=24)
        .set_index("condition")
        .loc["all"]
    )
    quantile = 1.71387153  # of Student's t, 90%, 23 degrees of freedom
    half = (1.0 + quantile**2 * (0.5 * spread) ** 2) ** 0.5
    assert (found["low90"], found["high90"]) == pytest.approx((max(0.0, 12.0 - half), 12.0 + half))


def test_the_share_is_that_of_deviations_less_chance(study):
    module = study("structural_error")
    rows = {"left_out": "a", "manager": "a", "condition": [1, 2], "metric": "search_time_s"}
    rows |= {"real_n": 4, "real_mean": [9.0, 7.0], "predicted_mean": [1.0, 7.0]}
    found = module.errors(pandas.DataFrame(rows).assign(predicted_std=4.0))
    # spread sqrt(4^2 + 3^2); squares 64 and 0, of the mean 16; chance 4 each, of the mean 2
    each, whole = found[found["kind"] == "managers"], found[found["kind"] == module.WHOLE]
    assert module.share(each) == pytest.approx((28.0 / 25.0) ** 0.5)
    assert module.share(whole) == pytest.approx((14.0 / 25.0) ** 0.5)


def test_of_the_real_means_that_were_left_out_nine_tenths_lie_in_their_intervals(study):
    counts = study("structural_error").check(
        pandas.read_csv(FOLDER / "structural_error" / "deviations.csv"),
        pandas.read_csv(FOLDER / "split" / "split_check.csv"),
    )
    assert counts["means"].sum() > 100
    assert 0.85 <= counts["covered"].sum() / counts["means"].sum() <= 0.95


def test_runs_that_are_as_predicted_score_in_full(study):
    module, rows = study("predict"), predictions()
    own = rows[rows["experiment"] == "exp3"]
    chosen = own[(own["condition"] == "all") & ~own["manager"].str.contains(" - ")].set_index(
        ["manager", "metric"]
    )
    real = [
        {
            "manager": manager,
            "condition": condition,
            **{
                metric: chosen.loc[(manager, metric), "mean"] + off for metric in module.METRICS[:2]
            },
        }
        for manager in dict.fromkeys(chosen.index.get_level_values(0))
        for condition in range(1, 7)
        for off in (-0.1, 0.1)
    ]
    said = module.score(own, pandas.DataFrame(real).assign(mean_reaction_time_s=float("nan")))
    assert "8 of 8 predicted means lie in the real 95% intervals." in said
    assert "8 of 8 real means lie in the predicted 90% intervals." in said
    far = pandas.DataFrame([{**row, "search_time_s": row["search_time_s"] + 99} for row in real])
    assert "4 of 8 predicted means" in module.score(
        own, far.assign(mean_reaction_time_s=float("nan"))
    )


def test_real_runs_are_scored_from_their_file(study):
    said = study("predict").scored(
        "exp1", [ROOT / "scenarios" / "published" / "planta_exp1_runs.csv"]
    )
    assert re.search(r"\d+ of 11 predicted means lie in the real 95% intervals", said)
    assert "Median search times of single conditions differ by: median " in said


PUBLISHED = ROOT / "scenarios" / "published" / "planta_exp1_runs.csv"
SAYS_CONDITION = ["condition", "nominal_y_m", "failure_time_s"]


def written(path: Path, runs: pandas.DataFrame) -> Path:
    runs.to_csv(path, index=False)
    return path


def test_shuffled_runs_have_the_same_score(study, tmp_path):
    runs = pandas.read_csv(PUBLISHED).drop(columns=["condition", "nominal_y_m"])
    file = written(tmp_path / "runs.csv", runs.sample(frac=1.0, random_state=1))
    module = study("predict")
    assert module.scored("exp1", [file]) == module.scored("exp1", [PUBLISHED])


@pytest.mark.parametrize(
    "missing", [{"condition": [4]}, {"condition": [2], "run": [8]}], ids=["block", "run"]
)
def test_runs_after_missing_ones_keep_their_conditions(study, tmp_path, missing):
    runs = pandas.read_csv(PUBLISHED)
    left = runs[~np.all([runs[name].isin(values) for name, values in missing.items()], axis=0)]
    starts = left[["initial_x_m", "initial_y_m"]].astype(str).agg(", ".join, axis=1)
    exemplars = pandas.DataFrame(
        {
            "mission name": "suave " + left["manager"],
            "initial pos (x,y)": "(" + starts + ")",
            "time searching pipeline (s)": left["search_time_s"],
            "distance inspected (m)": left["distance_inspected_m"],
            "mean reaction time (s)": left["mean_reaction_time_s"],
        }
    )
    files = [
        written(tmp_path / f"{manager}_suave.csv", exemplars[left["manager"] == manager])
        for manager in left["manager"].unique()
    ]
    assert list(study("predict").assigned("exp1", files)["condition"]) == list(left["condition"])


def test_means_of_some_conditions_are_scored_against_those_of_the_same(study, tmp_path):
    runs, module = pandas.read_csv(PUBLISHED), study("predict")
    said = module.scored("exp1", [written(tmp_path / "runs.csv", runs[runs["condition"] == 4])])
    rows = predictions()
    own = rows[(rows["experiment"] == "exp1") & (rows["condition"] == "4")]
    own = own[(own["manager"] == "bt") & (own["metric"] == "distance_inspected_m")]
    assert (
        f"bt, distance_inspected_m: real 57.42 (56.38 to 58.45), predicted {own.iloc[0]['mean']:.2f} ("
        in said
    )


@pytest.mark.parametrize(
    "change, line, said",
    [
        ({"initial_y_m": 4.0}, 3, "initial_y_m 4.0"),
        ({"initial_x_m": -10.0}, 3, "initial_x_m -10.0"),
        ({"failure_time_s": 91.19}, 3, "failure_time_s 91.19"),
        ({"manager": "planta"}, 3, "nothing is predicted of manager planta in exp1"),
    ],
)
def test_a_foreign_run_is_refused_with_its_line(study, tmp_path, change, line, said):
    runs = pandas.read_csv(PUBLISHED)
    runs.loc[line - 2, list(change)] = list(change.values())
    module = study("predict")
    with pytest.raises(module.InputError) as found:
        module.scored("exp1", [written(tmp_path / "runs.csv", runs)])
    assert f"runs.csv: line {line}: " in str(found.value) and said in str(found.value)


def test_runs_with_failures_are_of_no_experiment_without(study):
    module = study("predict")
    with pytest.raises(module.InputError, match=r"line 2: .* of no condition of exp2"):
        module.scored("exp2", [PUBLISHED])


def test_runs_whose_order_does_not_tell_their_conditions_are_refused(study, tmp_path):
    runs = pandas.read_csv(PUBLISHED).drop(columns=SAYS_CONDITION)
    left = runs.drop(index=[10, *range(15, 20)])  # of none, one of condition 3 and all of 4
    module = study("predict")
    with pytest.raises(module.InputError, match=r"line 16: this run may be of condition 3 or 5"):
        module.scored("exp1", [written(tmp_path / "runs.csv", left)])
    with pytest.raises(module.InputError, match=r"line \d+: .* the order"):
        file = written(tmp_path / "runs.csv", runs.sample(frac=1.0, random_state=1))
        module.scored("exp1", [file])


each_study = pytest.mark.parametrize(
    "name, script", [*((name, name) for name in CASES), ("predictions", "predict")]
)


@each_study
def test_the_committed_conclusion_follows_from_the_committed_table(study, name, script):
    conclusion = (FOLDER / name / "conclusion.md").read_text(encoding="utf-8").strip()
    assert conclusion == study(script).conclude(committed(name)).strip()


@pytest.mark.parametrize("name", [*CASES, "predictions"])
def test_the_committed_figure_is_small(name):
    assert (FOLDER / name / f"{name}.png").stat().st_size < 500_000


@each_study
def test_the_committed_table_can_be_drawn(study, name, script):
    module = study(script)
    assert module.studies.figure_of(module.draw, committed(name), height=3.0).axes


def test_judging_the_shipped_values_again_gives_what_is_committed_of_one_half(study):
    module = study("half_blocks")
    (case,) = module.read_cases(["planta_exp1_campaign"], (), module.MANAGERS)
    problem = module.read_problem("planta_exp1", [case], 48, 2)
    found = module.judge(
        problem, case.only(module.HALVES[0]), [each.start for each in problem.parameters]
    )
    before = pandas.read_csv(FOLDER / "split" / "half_blocks.csv").iloc[0]
    assert (before["values"], before["judged_on"]) == ("shipped", "1 3 5")
    assert found.loss == pytest.approx(before["loss"], rel=1e-3)
    assert found.median_difference_s == pytest.approx(before["median_difference_s"], abs=1e-3)


@pytest.fixture
def predicted(study):
    """Predictions of three members, of which each has two runs: in all conditions, by manager."""
    values = {1: [10.0, 12.0], 2: [20.0, 22.0], 3: [30.0, 32.0]}
    rows = [
        {
            "manager": manager,
            "ensemble_member": member,
            "condition": 1,
            "run": run,
            "search_time_s": factor * value,
        }
        for manager, factor in (("a", 1.0), ("b", 2.0))
        for member, both in values.items()
        for run, value in enumerate(both, 1)
    ]
    missions = pandas.DataFrame(rows).assign(
        distance_inspected_m=float("nan"), mean_reaction_time_s=float("nan")
    )
    found = study("predict").predict(missions)
    return {row["manager"]: row for row in found if row["condition"] == "all"}


@pytest.mark.parametrize(
    ("name", "mean", "chance"), [("a", 21.0, 2.0), ("b", 42.0, 8.0), ("a - b", -21.0, 10.0)]
)
def test_what_runs_of_a_member_differ_in_counts_as_chance(predicted, name, mean, chance):
    row = predicted[name]
    assert (row["mean"], row["std"]) == pytest.approx((mean, chance**0.5))


@pytest.mark.parametrize(
    ("name", "between", "chance"), [("a", 100.0, 2.0), ("b", 400.0, 8.0), ("a - b", 100.0, 10.0)]
)
def test_what_runs_of_a_member_share_counts_as_its_parameters(predicted, name, between, chance):
    quantile = 2.919986  # of Student's t, 90%, 2 degrees of freedom
    # means of two simulated runs, and of five real ones
    variance = between - chance / 2.0 + chance / 5.0
    half = predicted[name]["high90"] - predicted[name]["mean"]
    assert half**2 == pytest.approx(quantile**2 * variance, rel=1e-5)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_the_readme_has_the_plain_command_of_each_study(script):
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert script.stem == "studies" or f"`python analysis/{script.name}" in text


def test_the_committed_table_of_mechanisms_is_of_the_committed_figures(study):
    module, rows = study("mechanisms"), committed("mechanisms")
    text = (FOLDER / "mechanisms" / "mechanisms.md").read_text(encoding="utf-8").strip()
    assert text == module.table(rows)
    assert list(rows["mechanism"]) == [each.mechanism for each in module.CHANGES]
    assert text in (FOLDER / "mechanisms.md").read_text(encoding="utf-8")


def test_without_what_is_taken_out_missions_differ_more_from_the_real_ones(study):
    module = study("mechanisms")
    shipped, changed = (
        module.agreement_2025(3, each) for each in (module.CHANGES[0], module.CHANGES[1])
    )
    assert 0.0 < shipped["distance_2025"] < 0.7 * changed["distance_2025"]


def test_lost_failures_are_weighed_by_their_probability(study):
    module = study("lost_failures")
    densities = {"both": 0.1, "1 alone": 0.2, "3 alone": 0.4, "neither": 0.8}
    of = {name: np.full(2, value) for name, value in densities.items()}
    likelihoods = [0.1, 0.1, 0.1, 0.4]  # of a late mission and an early one, by hypothesis
    # p = 1/4: 9/16 x 0.1 + 3/16 x (0.2 + 0.4) + 1/16 x 0.8; 3/4 x 0.4 + 1/4 x 0.8
    likelihoods += [0.21875, 0.21875, 0.21875, 0.5]
    found = [module.logs(each, of, np.array([False, True]), 0.25) for each in module.HYPOTHESES]
    assert np.exp(np.ravel(found)) == pytest.approx(likelihoods)


@pytest.mark.parametrize("table", ["speeds", "search_times", "failures"])
def test_the_committed_facts_are_those_of_the_published_runs(study, table):
    before = pandas.read_csv(FOLDER / "published_facts" / f"{table}.csv")
    pandas.testing.assert_frame_equal(getattr(study("published_facts"), table)(), before)


@pytest.mark.parametrize("size", [(6, 1), (12, 1)])
@pytest.mark.parametrize("what", ["biased", "late", "useless"])
def test_intervals_hold_the_mean_of_whatever_plays_the_real_system(study, size, what):
    module, chance = study("assisted"), np.random.default_rng(1)
    at = chance.choice([50.0, 120.0, 130.0], (200, 1))
    simulated, real = at + chance.normal(0.0, 5.0, (2, 200, 5))
    if what == "biased":
        real = 1.1 * real - 10.0
    elif what == "late":
        real = module.late({"bt": real}, 0.08)["bt"]
    else:
        simulated = chance.permutation(simulated)
    case = module.Case(what, [{"bt": real}], {"bt": simulated})
    assert module.coverage(case, ["bt"], size, 100)["assisted"] >= 0.92


@pytest.mark.parametrize("spread", [None, 50.0])
@pytest.mark.parametrize("conditions", [6, 12])
def test_intervals_of_many_samples_are_those_of_each(study, conditions, spread):
    module, chance = study("assisted"), np.random.default_rng(1)
    at, many = chance.normal(100.0, 30.0, (40, conditions)), chance.normal(100.0, 30.0, 80)
    turned = 100.0 + np.linspace(1.0, -1.0, 40)[:, None] * (at - 100.0)
    same = turned + chance.normal(0.0, 5.0, at.shape)
    by_chance = np.full(40, 30.0), np.full(40, 4.0), 9.0
    found = module.intervals(module.Sampled(at, same, many, by_chance), spread)
    pairs = zip(at, same, strict=True)
    one = [assisted_mean(*each, many, Chance(30.0, 4.0, 9.0), spread) for each in pairs]
    expected = [(mean.value, mean.high - mean.value, weight) for mean, weight in one]
    assert len({weight > 0.0 for *_, weight in expected}) == 2
    np.testing.assert_allclose(np.transpose(found), expected, rtol=0.0, atol=1e-9)


def test_the_committed_conclusion_is_of_the_committed_tables(study):
    module = study("assisted")
    tables = [pandas.read_csv(FOLDER / "assisted" / name) for name in ("coverage.csv", "gains.csv")]
    assert (FOLDER / "assisted" / "conclusion.md").read_text(
        encoding="utf-8"
    ).strip() == module.conclude(*tables)
    within = tables[0][~tables[0]["is_beyond"]]
    assert len(within) > 100
    assert (within["assisted"] >= 0.93).all()


GUIDE = (ROOT / "docs" / "guides" / "real-missions.md").read_text(encoding="utf-8")


def test_the_guide_has_the_committed_table():
    conclusion = (FOLDER / "assisted" / "conclusion.md").read_text(encoding="utf-8")
    table = [line for line in conclusion.splitlines() if line.startswith("|")]
    assert len(table) > 10
    assert "\n".join(table) in GUIDE


OF_MANAGERS, OF_BT, OF_METACONTROL = "other == ''", "group == 'bt'", "group == 'metacontrol'"
FAITHFUL = "case == 'other parameters' and conditions == 6 and runs_each == 1"
NEVER = "case == 'simulator that never finds it'"


@pytest.mark.parametrize(
    ("text", "table", "columns", "queries"),
    [
        ("{:.1f} s for bt and {:.1f} s for metacontrol, mostly", "coverage", ["assisted_half"] * 2,
         [f"{FAITHFUL} and {OF_MANAGERS} and {each}" for each in (OF_BT, OF_METACONTROL)]),
        ("more certain, has {:.1f} s, and alone {:.1f} s", "coverage",
         ["assisted_half", "alone_half"],
         [f"{FAITHFUL} and other == 'bt' and {OF_METACONTROL}"] * 2),
        ("{:.1f} s for bt and {:.1f} s for metacontrol; all 30", "gains", ["assisted_half"] * 2,
         [f"runs == 6 and {OF_MANAGERS} and {each}" for each in (OF_BT, OF_METACONTROL)]),
        ("all 30 missions alone have {:.1f} and {:.1f} s", "gains", ["alone_half"] * 2,
         [f"runs == 30 and {OF_MANAGERS} and {each}" for each in (OF_BT, OF_METACONTROL)]),
        ("With 15% late, {:.1%} of the intervals hold the mean at worst; with 15% late\n  by 100 s, {:.1%}",
         "coverage", ["assisted"] * 2, ["case == '15% late'", "case == '15% late by 100 s'"]),
        ("{:.1%} from six of them, {:.1%} from twelve", "coverage", ["assisted"] * 2,
         [f"{NEVER} and conditions == {each}" for each in (6, 12)]),
        ("Managers are held in {:.1%}", "coverage", ["assisted"], [f"{NEVER} and {OF_MANAGERS}"]),
    ],
)  # fmt: skip
def test_the_guide_has_the_committed_figures(text, table, columns, queries):
    found = pandas.read_csv(FOLDER / "assisted" / f"{table}.csv").fillna({"other": ""})
    own = found[found["metric"] == "search_time_s"]
    values = [own.query(each)[name].min() for name, each in zip(columns, queries, strict=True)]
    assert text.format(*values) in GUIDE
