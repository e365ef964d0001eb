"""What a scenario says of its knowledge base and only the ontology can judge: refused with file, line and key path."""

import shutil
from pathlib import Path

import pytest

from suave_des.errors import InputError
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.scenario_knowledge import open_base, open_knowledge, read_base
from tests.helpers.exemplar_files import write_as_owlready2_saves_it


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def refused(content: str, **options: object) -> InputError:
    Path("mine.yaml").write_text("base: seams2023.yaml\nknowledge:\n" + content)
    loaded = load_scenario("mine.yaml", **options)
    with pytest.raises(InputError) as of_base:
        open_base(loaded)
    with pytest.raises(InputError) as of_mission:
        open_knowledge(loaded)
    assert str(of_base.value) == str(of_mission.value)
    return of_base.value


def test_a_value_of_an_unknown_individual():
    assert str(refused("  values:\n    qa_water_visibility_low: 1\n    qa_water_visibilty_high: 0.5\n")) == (
        "mine.yaml: line 5, knowledge.values.qa_water_visibilty_high: the ontology has no individual"
        " qa_water_visibilty_high with a hasValue (did you mean qa_water_visibility_high?)"
    )


def test_a_value_of_an_individual_without_one_lists_those_that_have_one():
    error = refused("  values: {c_thruster_1: 0.5}\n")
    assert (error.file, error.place) == ("mine.yaml", "line 3, knowledge.values.c_thruster_1")
    assert (error.remedy or "").startswith("known: qa_performance_all_thrusters, ")


def test_a_rule_that_is_not_there_to_switch_off():
    error = refused("  disabled_rules:\n    - S1a\n    - QAWaterVisibilty\n")
    assert (error.file, error.place) == ("mine.yaml", "line 5, knowledge.disabled_rules[1]")
    assert error.remedy == "did you mean QAWaterVisibility?"


def test_a_rule_to_switch_off_that_the_command_line_names_is_told_as_such():
    error = refused("  disabled_rules: [S1a]\n", disabled_rules=["nope"])
    assert (error.file, error.place) == (None, "--disable-rule")


def test_an_error_in_the_ontology_itself_names_the_ontology():
    shutil.copy(shipped_folder("ontology") / "suave.owl", "own.owl")
    broken = Path("own.owl").read_text().replace("</rdf:RDF>", "")
    Path("own.owl").write_text(broken)
    assert refused("  ontologies: [own.owl]\n").file == "own.owl"


@pytest.mark.parametrize(
    "name", ["qa_water_visibility_low", "qa_performance_high"], ids=["water visibility", "performance"]
)
def test_a_known_individual_is_taken(name):
    Path("mine.yaml").write_text(f"base: seams2023.yaml\nknowledge: {{values: {{{name}: 0.7}}}}\n")
    assert open_base(load_scenario("mine.yaml")).functions


def test_the_knowledge_of_a_recorded_mission_assumes_what_its_revision_does():
    write_as_owlready2_saves_it(Path("own.owl"))
    Path("mine.yaml").write_text("base: seams2023.yaml\nknowledge:\n  ontologies: [own.owl]\n")
    recorded = load_scenario("mine.yaml")
    assert read_base(recorded.scenario).assumptions == open_base(recorded).assumptions
    assert open_base(recorded).assumptions
