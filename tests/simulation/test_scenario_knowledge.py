"""What a scenario says of its knowledge base and only the ontology can judge: refused with file,
line and key path.
"""

import shutil
from pathlib import Path

import pytest

from suave_des.errors import InputError
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.scenario_knowledge import open_base, open_knowledge, read_base
from suave_des.simulation.inputs import check_inputs
from suave_des.simulation.simulator import Simulator
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


@pytest.mark.parametrize(
    ("content", "place", "remedy"),
    [
        (
            "  values:\n    qa_water_visibility_low: 1\n    qa_water_visibilty_high: 0.5\n",
            "line 5, knowledge.values.qa_water_visibilty_high",
            "did you mean qa_water_visibility_high?",
        ),
        (
            "  values: {c_thruster_1: 1}\n",
            "line 3, knowledge.values.c_thruster_1",
            "known: qa_performance_all_thrust",
        ),
        (
            "  disabled_rules: [S1a, QAWaterVisibilty]\n",
            "line 3, knowledge.disabled_rules[1]",
            "did you mean",
        ),
    ],
)
def test_what_the_ontology_does_not_have_is_told_with_its_place(content, place, remedy):
    error = refused(content)
    assert (error.file, error.place) == ("mine.yaml", place)
    assert (error.remedy or "").startswith(remedy)


def test_a_rule_to_switch_off_that_the_command_line_names_is_told_as_such():
    error = refused("  disabled_rules: [S1a]\n", disabled_rules=["nope"])
    assert (error.file, error.place) == (None, "--disable-rule")


def test_an_error_in_the_ontology_itself_names_the_ontology():
    shutil.copy(shipped_folder("ontology") / "suave.owl", "own.owl")
    broken = Path("own.owl").read_text().replace("</rdf:RDF>", "")
    Path("own.owl").write_text(broken)
    assert refused("  ontologies: [own.owl]\n").file == "own.owl"


def test_the_knowledge_of_a_recorded_mission_assumes_what_its_revision_does():
    write_as_owlready2_saves_it(Path("own.owl"))
    Path("mine.yaml").write_text("base: seams2023.yaml\nknowledge:\n  ontologies: [own.owl]\n")
    recorded = load_scenario("mine.yaml")
    assert read_base(recorded.scenario).assumptions == open_base(recorded).assumptions
    assert open_base(recorded).assumptions


def test_missions_are_those_with_the_operator_written_in(tmp_path, caplog):
    owl = write_as_owlready2_saves_it(tmp_path / "suave.owl", placeholder="FunctionDesign")
    assert "<tomasys:qa_comparison_operator" not in owl.read_text(encoding="utf-8")
    loaded = load_scenario("seams2023", ontologies=[owl])
    check_inputs([loaded], ["metacontrol"], {})
    assert (
        caplog.text.count(
            "water_visibility has no qa_comparison_operator in the ontologies: < is assumed"
        )
        == 1
    )
    without, with_operator = Simulator(loaded), Simulator(load_scenario("seams2023"))
    for run in range(1, 4):
        assert without.run("metacontrol", run, 1, record=True) == with_operator.run(
            "metacontrol", run, 1, record=True
        )
