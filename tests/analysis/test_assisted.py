"""The study of assisted comparisons: its coverage in small, and the deviations that plans rest on."""

import importlib
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

from suave_des.results.assisted import compare_assisted, deviations

FOLDER = Path(__file__).parents[2] / "analysis"
DEVIATIONS = FOLDER.parent / "scenarios" / "published" / "planta_exp1_deviations.csv"


@pytest.fixture
def study(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    yield importlib.import_module("assisted")
    for name in ("assisted", "studies"):
        sys.modules.pop(name, None)


def test_intervals_hold_the_mean_of_whatever_plays_the_real_system(study):
    chance = np.random.default_rng(1)
    at = chance.choice([50.0, 120.0, 130.0], (150, 1))
    real = [{"a": at + off + chance.normal(0.0, 5.0, (150, 8))} for off in (-10.0, 20.0)]
    useful, useless = ({"a": each + chance.normal(0.0, 5.0, (150, 8))} for each in (at, chance.permutation(at)))
    for simulator in (useful, useless):
        rows = list(study.coverage(real, simulator, [(3, 2), (6, 1), (12, 1)], 200))
        assert min(row["assisted"] for row in rows) >= 0.91
    assert next(study.coverage(real, useful, [(6, 1)], 200))["assisted_half"] < 15.0


def test_the_shipped_deviations_are_those_of_the_published_missions(study):
    same = study.under_real_conditions(4, 1)
    drawn = same.drop(columns=[name for name in same if "." in name])
    drawn = drawn.assign(run=drawn.groupby("manager", observed=True).cumcount() + 1)
    found = deviations(compare_assisted([study.REAL], same, drawn, metrics=study.METRICS).conditions)
    shipped = pandas.read_csv(DEVIATIONS)
    assert list(found.columns) == list(shipped.columns)
    keys = ["manager", "metric", "conditions", "runs"]
    pandas.testing.assert_frame_equal(found[keys].astype(str), shipped[keys].astype(str))
    assert found["chance_std"].to_numpy() == pytest.approx(shipped["chance_std"].to_numpy(), abs=1e-3)
    near = shipped["chance_std"] / 2.0 + 1.0
    assert ((found["deviation_mean"] - shipped["deviation_mean"]).abs() < near).all()


def test_the_committed_conclusion_is_of_the_committed_tables(study):
    tables = [pandas.read_csv(FOLDER / "assisted" / name) for name in ("coverage.csv", "gains.csv")]
    assert (FOLDER / "assisted" / "conclusion.md").read_text(encoding="utf-8").strip() == study.conclude(*tables)
    least = tables[0].groupby("simulator")["assisted"].min()
    assert min(least["shipped"], least["biased"]) >= 0.9 and least["useless"] >= 0.84
