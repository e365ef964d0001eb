"""The JSON Schema accepts what the loader accepts, and the reference page says what the models
say.
"""

import importlib.util
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import Scenario
from suave_des.scenario.schema import field_docs, models_within, scenario_schema
from suave_des.scenario.yamlfile import read_yaml

DOCS = Path(__file__).parents[2] / "docs"
HEAD = "base: seams2023.yaml\n"
SIGNALS = "signals: {water_visibility: {kind: constant, value: 2}}\n"


@pytest.fixture(scope="module")
def validator() -> Draft202012Validator:
    schema = scenario_schema()
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def errors(validator: Draft202012Validator, path: Path) -> list[Any]:
    return [error.message for error in validator.iter_errors(read_yaml(path).data)]


@pytest.mark.parametrize("name", ["seams2023", "release15", "extended", "paper_table_values"])
def test_the_schema_accepts_the_shipped_scenarios(validator, name):
    assert errors(validator, shipped_folder("scenarios") / f"{name}.yaml") == []


@pytest.mark.parametrize(
    "content",
    [
        HEAD,
        "revision: 2023\n" + SIGNALS,
        "revision: {base: 1.5, follow: {acceptance_m: 0.3}}\n" + SIGNALS,
        HEAD + "revision: {follow: {acceptance_m: 0.3}}\n",
        HEAD + "signals: {water_visibility: {period_s: 120}}\n",
        HEAD + "signals: {water_visibility: {noise: {distribution: normal, mean: 0, std: 0.1}}}\n",
        "base: paper_table_values\nknowledge: {values: {qa_performance_recover_thrusters: null}}\n",
        HEAD
        + "thruster_events: ['(1,failure,35)', '(3, recovery, 50.0)', {thruster: 1, event: failure, time_s: 2}]\n",
        HEAD + "managers: {'my.module:Manager': {gain: 3}}\n",
        HEAD + "battery: null\n",
    ],
)
def test_the_schema_accepts_the_forms_that_the_loader_does(validator, write, content):
    path = write("mine.yaml", content)
    load_scenario(path)
    assert errors(validator, path) == []


@pytest.mark.parametrize(
    "content",
    [
        SIGNALS,
        HEAD + "signals: {water_visibility: {period_s: -80}}\n",
        HEAD + "signals: {my sea: {kind: constant, value: 2}}\n",
        HEAD + "thruster_events: [{thruster: 7, event: failure, time_s: 3}]\n",
        HEAD + "start: {x_m: {distribution: gauss, mean: 3}}\n",
        HEAD + "mission: null\n",
    ],
)
def test_the_schema_refuses_what_the_loader_refuses(validator, write, content):
    assert errors(validator, write("mine.yaml", content))


def test_every_key_has_a_meaning():
    for _, model in models_within(Scenario):
        assert set(field_docs(model)) >= set(model.model_fields), model.__name__


def test_the_reference_page_is_the_one_that_the_models_give():
    spec = importlib.util.spec_from_file_location(
        "make_scenario_reference", DOCS / "make_scenario_reference.py"
    )
    assert spec is not None
    assert spec.loader is not None
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    for name, page in (("scenario.md", maker.page()), ("exemplar-files.md", maker.exemplar_page())):
        assert (DOCS / "reference" / name).read_text(encoding="utf-8") == page, (
            "run docs/make_scenario_reference.py"
        )
