"""kb check: mistakes in the ontology: names, individuals, designs, kinds of things."""

from __future__ import annotations

from pathlib import Path

import pytest

from suave_des.cli.main import main
from suave_des.domain import THRUSTER_NAMES
from suave_des.knowledge.checks.findings import Level
from suave_des.resources import shipped_folder
from suave_des.workbench.check import Subject, check
from tests.helpers.checks import SUAVE, TOMASYS, errors, found, individual, link, only
from tests.helpers.exemplar_files import write_as_owlready2_saves_it


def test_a_component_that_nothing_reports_is_noted(tmp_path: Path) -> None:
    status = '<tomasys:c_status xmlns:tomasys="http://metacontrol.org/tomasys#">FALSE</tomasys:c_status>'
    extra = individual("c_camera", "Component") + individual("c_broken", "Component", status)
    reported = dict.fromkeys(THRUSTER_NAMES, ("FALSE",))
    findings = found(tmp_path, extra=extra, reported=reported)
    assert [one.message for one in findings if "reports the status" in one.message] == [
        "nothing in the simulation reports the status of component c_camera, so missions never have one"
    ]
    assert only(findings, "c_camera, so").level is Level.INFO
    assert not any("reports the status" in one.message for one in found(tmp_path, extra=extra))


def test_a_measured_attribute_that_the_ontology_calls_something_else(tmp_path: Path) -> None:
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    path = tmp_path / "mine.owl"
    path.write_text(text.replace('water_visibility"', 'water_visability"'), encoding="utf-8")
    findings = check(Subject([path], measured=["water_visibility"]))
    unknown = only(findings, "missions measure water_visibility, but no ontology has")
    assert (unknown.level, unknown.file, unknown.remedy) == (Level.WARN, str(path), "did you mean water_visability?")
    assert only(findings, "do not measure water_visability, so what").level is Level.INFO
    assert not [each for each in found(tmp_path, measured=["water_visibility"]) if "measure" in each.message]


def test_the_model(tmp_path: Path) -> None:
    extra = (
        individual("f_new", "Function")
        + individual("fd_new", "FunctionDesign", link("solvesF", "f_follow_pipeline"))
        + individual("fd_lost", "FunctionDesign", link("hasQAestimation", "qa_empty"))
        + individual("qa_empty", "QAvalue")
    )
    modes = {"f_follow_pipeline": ["fd_follow_pipeline", "fd_unground", "fd_old"]}
    findings = found(tmp_path, extra=extra, modes=modes, needed=["f_follow_pipeline", "f_gone"])
    assert only(findings, "function f_new has no function design").level is Level.WARN
    assert only(findings, "fd_new has no mode").level is Level.ERROR
    assert only(findings, "mode fd_old of f_follow_pipeline has no function design").level is Level.WARN
    assert only(findings, "there is no function f_gone").level is Level.ERROR
    assert only(findings, "fd_new has no performance").level is Level.WARN
    assert only(findings, "fd_lost: solvesF: a function design must solve a function").level is Level.ERROR
    assert only(findings, "qa_empty: isQAtype: a QAvalue must be of exactly one").line is not None


UNDEFINED = {
    "class": (
        "tomasys#FunctionDesign",
        "tomasys#FunctionDesgn",
        "fd_all_thrusters: class FunctionDesgn",
        "FunctionDesign",
    ),
    "property": ("tomasys:solvesF ", "tomasys:solvsF ", "fd_all_thrusters: property solvsF", "solvesF"),
    "individual": (
        'solvesF rdf:resource="http://www.metacontrol.org/suave#f_follow_pipeline',
        'solvesF rdf:resource="http://www.metacontrol.org/suave#f_folow_pipeline',
        "fd_follow_pipeline: solvesF f_folow_pipeline",
        "f_follow_pipeline",
    ),
    "namespace": ("tomasys:isQAtype ", "mros:isQAtype ", "property isQAtype", f"{TOMASYS}isQAtype"),
}


@pytest.mark.parametrize("case", UNDEFINED)
def test_names_that_individuals_misspell_are_errors(case: str, tmp_path: Path) -> None:
    right, wrong, message, meant = UNDEFINED[case]
    path = tmp_path / "edited.owl"
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    path.write_text(text.replace(right, wrong, 1), encoding="utf-8")
    error = only(check(Subject([path])), f"{message} is not defined")
    assert (error.level, error.file, error.remedy) == (Level.ERROR, str(path), f"did you mean {meant}?")
    name = error.message.partition(":")[0]
    assert f"#{name}" in text.splitlines()[(error.line or 0) - 1]


def test_names_of_other_vocabularies_may_be_defined_elsewhere(tmp_path: Path) -> None:
    note = '<dc:creator xmlns:dc="http://purl.org/dc/elements/1.1/">me</dc:creator>'
    finding = only(found(tmp_path, extra=individual("f_new", "Function", note)), "property creator is not defined")
    assert finding.level is Level.WARN


def test_a_number_with_a_comma(tmp_path: Path) -> None:
    path = tmp_path / "edited.owl"
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    path.write_text(text.replace(">3.25<", ">3,25<"), encoding="utf-8")
    assert only(check(Subject([path])), "hasValue '3,25' is not an xsd:decimal").remedy == "a number such as 2.25"


def test_a_mode_without_a_design_is_noted_only_if_another_does_the_same(tmp_path: Path) -> None:
    modes = {"f_follow_pipeline": ["fd_follow_pipeline", "fd_unground", "fd_fast", "normal", "off"]}
    effects = {
        "f_follow_pipeline": {
            "fd_follow_pipeline": 1,
            "fd_unground": 0,
            "fd_old": 2,
            "normal": 1,
            "off": 0,
            "fd_fast": 2,
        }
    }
    findings = found(tmp_path, modes=modes, effects=effects)
    assert only(findings, "mode fd_fast of f_follow_pipeline has no function design").level is Level.WARN
    for name, same in (("normal", "fd_follow_pipeline"), ("off", "fd_unground")):
        one = only(findings, f"mode {name} of f_follow_pipeline has no function design")
        assert (one.level, one.remedy) == (Level.INFO, f"mode {same} does the same")


@pytest.mark.parametrize("scenario", ["seams2023", "release15", "extended", "planta_exp1", "paper_table_values"])
def test_shipped_scenarios_have_no_warning(scenario: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["kb", "check", "--scenario", scenario, "--fail-on", "warn"])
    assert not ended.value.code, capsys.readouterr().out


def test_a_design_whose_name_is_nearly_that_of_a_mode(tmp_path: Path) -> None:
    findings = found(tmp_path, modes={"f_follow_pipeline": ["fd_folow_pipeline"]})
    assert only(findings, "fd_follow_pipeline has no mode").remedy == "did you mean fd_folow_pipeline?"


@pytest.mark.parametrize("kind", ["FunctionDesign", "QAvalue"])
def test_a_file_as_owlready2_saves_it_with_a_placeholder_has_no_error(kind: str, tmp_path: Path) -> None:
    assert errors(check(Subject([write_as_owlready2_saves_it(tmp_path / "suave.owl", kind)]))) == []


@pytest.mark.parametrize(
    ("body", "column", "message"),
    [
        (
            "hasQAvalue(?q, ?g) ^ hasValue(?q, 2.0)",
            25,
            "?q is a FunctionGrounding in hasQAvalue, but a QAvalue in hasValue",
        ),
        (
            "FunctionDesign(?d) ^ hasQAvalue(?d, ?q)",
            25,
            "?d is a FunctionDesign, but a FunctionGrounding in hasQAvalue",
        ),
        (
            'fg_status(fd_spiral_low, "IN_ERROR_NFR")',
            4,
            "fd_spiral_low is a FunctionDesign, but a FunctionGrounding in fg_status",
        ),
    ],
)
def test_a_thing_of_two_kinds_in_a_rule(tmp_path: Path, body: str, column: int, message: str) -> None:
    finding = only(found(tmp_path, f"A: {body} -> Role(fd_spiral_low)"), message)
    assert (finding.level, finding.rule, finding.column) == (Level.WARN, "A", column)
    assert str(finding.remedy).startswith(
        ("hasValue is a property of", "hasQAvalue leads from", "fg_status is a property of")
    )


def test_a_thing_may_be_of_two_kinds_if_the_ontology_or_a_rule_says_so(tmp_path: Path) -> None:
    rule = "A: Component(?c) ^ fd_realisability(?c, false) -> Role(?c)\n"
    assert any("?c is a Component" in one.message for one in found(tmp_path, rule))
    both = individual("c_and_fd", "Component", f'<rdf:type rdf:resource="{TOMASYS}FunctionDesign"/>')
    below = "".join(f'<rdfs:subClassOf rdf:resource="{TOMASYS}{name}"/>' for name in ("Component", "FunctionDesign"))
    subclass = f'<owl:Class rdf:about="{SUAVE}Module">{below}</owl:Class>'
    for more, extra in (("", both), ("", subclass), ("B: Role(?c) -> FunctionDesign(?c)", "")):
        assert not any("?c is a Component" in one.message for one in found(tmp_path, rule + more, extra))


def test_a_fact_about_a_thing_of_another_kind(tmp_path: Path) -> None:
    inside = f'<tomasys:hasNFR xmlns:tomasys="{TOMASYS}" rdf:resource="{SUAVE}qa_water_visibility_low"/>'
    finding = only(found(tmp_path, extra=individual("f_new", "Function", inside)), "hasNFR of f_new")
    assert finding.level is Level.WARN
    assert finding.message.endswith("f_new is a Function, but an Objective is needed")


def test_two_domains_are_both_concluded(tmp_path: Path) -> None:
    domain = f'<rdfs:domain rdf:resource="{TOMASYS}FunctionDesign"/>'
    extra = f'<owl:ObjectProperty rdf:about="{TOMASYS}hasQAvalue">{domain}</owl:ObjectProperty>'
    finding = only(found(tmp_path, extra=extra), "hasQAvalue has 2 domains")
    assert finding.level is Level.WARN
    assert "FunctionDesign and FunctionGrounding at once" in finding.message


def test_a_class_that_an_axiom_misspells(tmp_path: Path) -> None:
    below = f'<rdfs:subClassOf rdf:resource="{TOMASYS}Compnent"/>'
    error = only(
        found(tmp_path, extra=f'<owl:Class rdf:about="{SUAVE}Pump">{below}</owl:Class>'), "subClassOf Compnent"
    )
    assert (error.level, error.remedy) == (Level.ERROR, "did you mean Component?")
