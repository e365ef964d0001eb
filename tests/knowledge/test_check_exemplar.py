"""kb check on the exemplar's own files: green under their own revision, one cause named under another."""

from __future__ import annotations

from pathlib import Path

import pytest

from suave_des.errors import KnowledgeError
from suave_des.findings import Level
from suave_des.kb.check import check
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.scenario_knowledge import open_base, subject_of
from tests.helpers.checks import OWL, TOMASYS, individual, link
from tests.helpers.command import command_here
from tests.helpers.exemplar_files import write_as_owlready2_saves_it, write_exemplar_files, write_files_of_2023

MEASURED = individual("obs_water_visibility", "QAvalue", link("isQAtype", "water_visibility"))


def exemplar_files(folder: Path, *, of_2023: bool = False) -> list[Path]:
    """The exemplar's three files, with the individual of a measured value in them."""
    files = (write_files_of_2023 if of_2023 else write_exemplar_files)(shipped_folder("ontology"), folder)
    text = files["suave"].read_text(encoding="utf-8")
    namespaces = f'<owl:NamedIndividual xmlns:tomasys="{TOMASYS}" xmlns:owl="{OWL}"'
    measured = MEASURED.replace("<owl:NamedIndividual", namespaces)
    files["suave"].write_text(text.replace("</rdf:RDF>", f"{measured}</rdf:RDF>"), encoding="utf-8")
    return list(files.values())


@pytest.mark.parametrize(("scenario", "of_2023"), [("seams2023", True), ("seams2023", False), ("release15", False)])
def test_files_of_the_exemplar_have_notes_of_one_line_only(scenario: str, of_2023: bool, tmp_path: Path) -> None:
    findings = check(subject_of(load_scenario(scenario, ontologies=exemplar_files(tmp_path, of_2023=of_2023))))
    assert {each.level for each in findings} == {Level.INFO}, findings
    messages = [each.message for each in findings]
    assert sum("for other models" in each for each in messages) == 2  # tomasys.owl and mros.owl
    assert "obs_water_visibility has no hasValue: missions give it the measured one" in messages
    assert len(findings) <= 6


def test_files_of_2023_under_another_revision_are_one_error_that_names_the_cause(tmp_path: Path) -> None:
    loaded = load_scenario("release15", ontologies=exemplar_files(tmp_path, of_2023=True))
    (error,) = [each for each in check(subject_of(loaded)) if each.level is not Level.INFO]
    assert (error.level, Path(error.file or "").name, error.remedy) == (
        Level.ERROR,
        "mros.owl",
        'write revision: "2023" in the scenario, or use ontologies of revision 1.5',
    )
    assert error.message.startswith("these are ontologies of revision 2023")
    assert "label>compRecov<" in (tmp_path / "mros.owl").read_text().splitlines()[(error.line or 0) - 1]
    with pytest.raises(KnowledgeError, match="these are ontologies of revision 2023"):  # before a mission, too
        open_base(loaded)


def test_a_measured_attribute_without_operator_is_a_warning_before_missions(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Without one the altitude is never adapted: each design counts as possible whatever is measured."""
    write_as_owlready2_saves_it(tmp_path / "suave.owl")
    options = ("--ontology", "suave.owl", "--set", "mission.time_limit_s=1")
    for scenario, words in (("release15", "so what is measured never rules out"), ("seams2023", "< is assumed")):
        caplog.clear()
        assert command_here("run", scenario, *options, cwd=tmp_path).returncode == 0
        message = next(each for each in caplog.messages if "qa_comparison_operator" in each)
        assert words in message
        assert message.startswith("WARN   suave.owl: line ") is (scenario == "release15")


def test_a_function_that_the_scenario_adds_is_needed(tmp_path: Path) -> None:
    findings = check(subject_of(load_scenario("extended", ontologies=exemplar_files(tmp_path))))
    assert [each.message for each in findings if each.level is not Level.INFO] == [
        "there is no function generate_recharge_path, which the mission needs"
    ]
