"""The studies in analysis/: a small repetition of each gives what is committed."""

import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas
import pytest

from suave_des.results.assisted import Chance, assisted_mean

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


def test_the_effects_of_parameters_are_drawn(study, tmp_path):
    module = study("sensitivity")
    effects = {
        (manager, metric): np.arange(2.0)
        for manager in module.MANAGERS
        for metric in module.METRICS
    }
    module.draw(tmp_path / "effects.png", ["a", "b"], effects)
    assert (tmp_path / "effects.png").stat().st_size > 1_000


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
    made_of = rows.groupby("experiment", sort=False)["inputs"].unique()
    assert {name: list(found) for name, found in made_of.items()} == {
        name: [module.inputs(name)] for name in module.EXPERIMENTS
    }


def test_runs_that_are_as_predicted_score_in_full(study):
    module, rows = study("predict"), predictions()
    own = rows[rows["experiment"] == "exp3"]
    chosen = own[(own["condition"] == "all") & ~own["manager"].str.contains(" - ")].set_index(
        ["manager", "metric"]
    )
    real = [
        {
            "manager": manager,
            **{
                metric: chosen.loc[(manager, metric), "mean"] + off for metric in module.METRICS[:2]
            },
        }
        for manager in dict.fromkeys(chosen.index.get_level_values(0))
        for off in (-0.1, 0.1) * 15
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


@pytest.mark.parametrize(
    "name, script", [*((name, name) for name in CASES), ("predictions", "predict")]
)
def test_the_committed_figure_and_conclusion_are_of_the_committed_table(study, name, script):
    module, rows = study(script), committed(name)
    assert (FOLDER / name / "conclusion.md").read_text(encoding="utf-8").strip() == module.conclude(
        rows
    ).strip()
    assert (FOLDER / name / f"{name}.png").stat().st_size < 500_000
    assert module.studies.figure_of(module.draw, rows, 3.0).axes


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


def test_predictions_count_what_members_share_as_parameters_and_the_rest_as_chance(study):
    module = study("predict")
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
    found = {row["manager"]: row for row in module.predict(missions) if row["condition"] == "all"}
    quantile = 2.919986  # of Student's t, 90%, 2 degrees of freedom
    for name, mean, between, chance in (
        ("a", 21.0, 100.0, 2.0),
        ("b", 42.0, 400.0, 8.0),
        ("a - b", -21.0, 100.0, 10.0),
    ):
        assert (found[name]["mean"], found[name]["std"]) == pytest.approx((mean, chance**0.5))
        # means of two simulated runs, and of five real ones
        variance = between - chance / 2.0 + chance / 5.0
        assert (found[name]["high90"] - mean) ** 2 == pytest.approx(
            quantile**2 * variance, rel=1e-5
        )


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
