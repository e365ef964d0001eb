"""The studies in analysis/: a small repetition of each gives what is committed, and they use public names only."""

import ast
import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pandas
import pytest

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "analysis"
SCRIPTS = sorted(FOLDER.glob("*.py"))
PARTS = sorted((FOLDER / "calibration").glob("*.py"))
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
    again = module.study(module.studies.FIRST_RUNS, 1, CASES[name]).set_index(KEYS[name])["first_difference"]
    assert len(again) > 0
    before = committed(name).set_index(KEYS[name])["first_difference"].loc[again.index]
    assert again.to_numpy() == pytest.approx(before.to_numpy(), abs=1e-3)


def test_a_small_repetition_gives_the_committed_predictions_of_the_first_runs(study):
    module = study("predictions_2025")
    keys = ["experiment", "shift_s", "manager", "condition", "metric"]
    again = module.simulate(module.studies.FIRST_RUNS, 1, [2])
    again = again.groupby(keys[:3], sort=False, observed=True)["search_time_s"].mean()
    before = committed("predictions_2025").set_index(keys)["first_mean"]
    for (experiment, shift_s, manager), mean in again.items():
        assert mean == pytest.approx(before[experiment, shift_s, manager, "2", "search_time_s"], abs=1e-3)


@pytest.mark.parametrize("name", [*CASES, "predictions_2025"])
def test_the_committed_figure_and_conclusion_are_of_the_committed_table(study, name):
    module, rows = study(name), committed(name)
    assert (FOLDER / name / "conclusion.md").read_text(encoding="utf-8").strip() == module.conclude(rows).strip()
    assert (FOLDER / name / f"{name}.png").stat().st_size < 500_000
    assert module.studies.figure_of(module.draw, rows, 3.0).axes


def test_judging_the_shipped_values_again_gives_what_is_committed_of_one_half(study):
    module = study("half_blocks")
    (case,) = module.read_cases(["planta_exp1_campaign"], (), module.MANAGERS)
    problem = module.read_problem("planta_exp1", [case], 48, 2)
    found = module.judge(problem, case.only(module.HALVES[0]), [each.start for each in problem.parameters])
    before = pandas.read_csv(FOLDER / "split" / "half_blocks.csv").iloc[0]
    assert (before["values"], before["judged_on"]) == ("shipped", "1 3 5")
    assert found.loss == pytest.approx(before["loss"], rel=1e-3)
    assert found.median_difference_s == pytest.approx(before["median_difference_s"], abs=1e-3)


def test_an_ideal_vehicle_at_3_m_finds_the_pipeline_when_the_water_clears_and_an_adapting_one_a_turn_later(study):
    module = study("when_adapting_pays")
    case = module.PAPERS
    for start_s in range(2, 26, 2):
        assert 58.0 <= module.ideal(case, "fd_spiral_high", start_s) <= 70.0
        assert module.ideal(case, None, start_s) > 90.0


def test_predictions_count_what_members_share_as_parameters_and_the_rest_as_chance(study):
    module = study("predictions_2025")
    values = {1: [10.0, 12.0], 2: [20.0, 22.0], 3: [30.0, 32.0]}
    rows = [
        {"ensemble_member": member, "condition": 1, "run": run, "search_time_s": value, "pipeline_found": True}
        for member, both in values.items()
        for run, value in enumerate(both, 1)
    ]
    found = module.predict(pandas.DataFrame(rows), "search_time_s")
    assert found["mean"] == 21.0
    assert (found["high95"] - 21.0) ** 2 == pytest.approx(4.302653**2 * 100.0, rel=1e-5)
    assert (found["high95_of_runs"] - 21.0) ** 2 == pytest.approx(4.302653**2 * (100.0 + 2.0 / 5.0), rel=1e-5)


def public_modules() -> set[str]:
    page = (ROOT / "docs" / "reference" / "python-api.md").read_text(encoding="utf-8")
    names = re.findall(r"`(suave_des(?:\.\w+)+)`", page)
    return set(names) | {name.rpartition(".")[0] for name in names if not name.endswith(".*")}


@pytest.mark.parametrize("script", [*SCRIPTS, *PARTS], ids=lambda script: script.stem)
def test_a_study_imports_public_names_only(script):
    imported = {
        node.module
        for node in ast.walk(ast.parse(script.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "suave_des"
    }
    assert imported <= public_modules() | {"suave_des"}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_the_readme_has_the_plain_command_of_each_study(script):
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert script.stem == "studies" or f"`python analysis/{script.name}" in text


def test_the_committed_table_of_mechanisms_is_of_the_committed_figures(study):
    module, rows = study("mechanisms"), committed("mechanisms")
    text = (FOLDER / "mechanisms" / "mechanisms.md").read_text(encoding="utf-8").strip()
    assert text == module.table(rows)
    assert list(rows["mechanism"]) == [each.mechanism for each in module.CHANGES]
    fidelity = (ROOT / "docs" / "background" / "fidelity.md").read_text(encoding="utf-8")
    assert text in fidelity


def test_without_what_is_taken_out_missions_differ_more_from_the_real_ones(study):
    module = study("mechanisms")
    shipped, changed = (module.agreement_2025(3, each) for each in (module.CHANGES[0], module.CHANGES[1]))
    assert 0.0 < shipped["distance_2025"] < 0.7 * changed["distance_2025"]


@pytest.mark.parametrize("table", ["speeds", "search_times", "failures"])
def test_the_committed_facts_are_those_of_the_published_runs(study, table):
    before = pandas.read_csv(FOLDER / "published_facts" / f"{table}.csv")
    pandas.testing.assert_frame_equal(getattr(study("published_facts"), table)(), before)
