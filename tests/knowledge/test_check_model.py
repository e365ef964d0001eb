"""kb check: mistakes in the ontology: names, individuals, designs, kinds of things."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from suave_des.errors import Finding, KnowledgeError, Level
from suave_des.kb.check import check
from suave_des.knowledge.checks import Subject, static_findings
from suave_des.knowledge.resolver import collect
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario
from suave_des.scenario_knowledge import REPORTED_STATUSES, open_base, subject_of
from tests.helpers.checks import (
    OWL,
    SUAVE,
    TOMASYS,
    errors,
    findings_of,
    found,
    individual,
    link,
    only,
    subject,
    value,
    warnings,
)
from tests.helpers.command import command_here
from tests.helpers.exemplar_files import (
    write_as_owlready2_saves_it,
    write_exemplar_files,
    write_files_of_2023,
)


def without_shapes(subject: Subject) -> tuple[Finding, ...]:
    """What is found without checking shapes, which takes a second."""
    return tuple(static_findings(subject, collect(subject.ontologies)))


def test_a_measured_attribute_that_the_ontology_calls_something_else(suave_copy):
    path = suave_copy(replace={'water_visibility"': 'water_visability"'}, name="mine.owl")
    findings = without_shapes(Subject([path], measured=["water_visibility"]))
    unknown = only(findings, "missions measure water_visibility, but no ontology has")
    assert (unknown.level, unknown.file, unknown.remedy) == (
        Level.WARN,
        str(path),
        "did you mean water_visability?",
    )


def test_nothing_is_said_of_a_measured_attribute_that_the_ontology_has(tmp_path):
    findings = without_shapes(subject(tmp_path, measured=["water_visibility"]))
    assert not [each for each in findings if "measure" in each.message]


@pytest.fixture(scope="module")
def unconnected(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """The shipped ontology with two components of which one has a status."""
    status = (
        '<tomasys:c_status xmlns:tomasys="http://metacontrol.org/tomasys#">FALSE</tomasys:c_status>'
    )
    extra = individual("c_camera", "Component") + individual("c_broken", "Component", status)
    return subject(tmp_path_factory.mktemp("unconnected"), extra=extra)


@pytest.fixture(scope="module")
def notes_on_missions(unconnected) -> list[str]:
    """What is noted of them for missions that measure nothing."""
    in_missions = replace(unconnected, reported=REPORTED_STATUSES, measured=[])
    notes = [one for one in without_shapes(in_missions) if one.level is Level.NOTE and one.line]
    return [one.message for one in notes if "missions" in one.message]


def test_an_expectation_that_no_mission_measures_is_noted(notes_on_missions):
    unmeasured = [each for each in notes_on_missions if "measure" in each]
    assert unmeasured == [
        "missions do not measure water_visibility, so what designs expect of it is compared with nothing"
    ]


def test_a_component_without_a_status_that_nothing_reports_is_noted(notes_on_missions):
    unreported = [each for each in notes_on_missions if "reports" in each]
    assert unreported == [
        "nothing in the simulation reports the status of component c_camera, so it has none in missions"
    ]


def test_without_a_mission_nothing_is_noted_of_missions(unconnected):
    assert not any("missions" in one.message for one in without_shapes(unconnected))


def test_the_model(tmp_path):
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
    assert only(findings, "metacontrol never chooses: fd_old").level is Level.NOTE
    assert only(findings, "there is no function f_gone").level is Level.ERROR
    assert (
        only(findings, "fd_new: hasQAestimation: no performance is expected of it").level
        is Level.WARN
    )
    assert (
        only(findings, "fd_lost: solvesF: a function design must solve a function").level
        is Level.ERROR
    )
    assert only(findings, "qa_empty: isQAtype: a QAvalue must be of exactly one").line is not None


def test_a_number_of_another_datatype_is_an_error_each_but_a_whole_number_is_a_decimal(suave_copy):
    path = suave_copy(replace={'#decimal">1.0<': '#double">1.0<', '#decimal">0.5<': '#integer">1<'})
    told = [each.message.partition(": ")[2] for each in errors(findings_of(Subject([path])))]
    doubles = path.read_text().count('#double">1.0<')
    assert told == ["hasValue '1.0' is not an xsd:decimal but an xsd:double"] * doubles


def test_a_quality_attribute_that_is_not_declared_is_an_error(tmp_path):
    measured = individual("qa_current", "QAvalue", link("isQAtype", "water_current"))
    findings = without_shapes(subject(tmp_path, extra=measured))
    unknown = only(findings, "isQAtype water_current is not defined")
    assert (unknown.level, unknown.remedy) == (
        Level.ERROR,
        "declare a QualityAttributeType of this name",
    )


def test_a_quality_attribute_that_is_declared_twice_is_a_warning(tmp_path):
    twice = '<owl:NamedIndividual rdf:about="http://ros/mros#performance">'
    twice += f'<rdf:type rdf:resource="{TOMASYS}QualityAttributeType"/></owl:NamedIndividual>'
    findings = without_shapes(subject(tmp_path, extra=twice))
    said = "declares the quality attribute type performance, and so does"
    assert only(findings, said).level is Level.WARN


UNDEFINED = {
    "class": (
        "tomasys#FunctionDesign",
        "tomasys#FunctionDesgn",
        "fd_all_thrusters: class FunctionDesgn",
        "FunctionDesign",
    ),
    "property": (
        "tomasys:solvesF ",
        "tomasys:solvsF ",
        "fd_all_thrusters: property solvsF",
        "solvesF",
    ),
    "individual": (
        'solvesF rdf:resource="http://www.metacontrol.org/suave#f_follow_pipeline',
        'solvesF rdf:resource="http://www.metacontrol.org/suave#f_folow_pipeline',
        "fd_follow_pipeline: solvesF f_folow_pipeline",
        "f_follow_pipeline",
    ),
    "namespace": ("tomasys:isQAtype ", "mros:isQAtype ", "property isQAtype", f"{TOMASYS}isQAtype"),
}


@pytest.mark.parametrize("case", UNDEFINED)
def test_names_that_individuals_misspell_are_errors(case, tmp_path):
    right, wrong, message, meant = UNDEFINED[case]
    path = tmp_path / "edited.owl"
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    path.write_text(text.replace(right, wrong, 1), encoding="utf-8")
    error = only(without_shapes(Subject([path])), f"{message} is not defined")
    assert (error.level, error.file, error.remedy) == (
        Level.ERROR,
        str(path),
        f"did you mean {meant}?",
    )
    name = error.message.partition(":")[0]
    assert f"#{name}" in text.splitlines()[(error.line or 0) - 1]


def test_an_expected_visibility_that_reactions_are_not_judged_by(tmp_path):
    known = {"reaction_thresholds_m": (3.25, 2.0, 1.25)}
    warning = only(
        without_shapes(subject(tmp_path, **known)),
        "fd_spiral_medium expects 2.25 m of visibility, which is not a threshold",
    )
    assert warning.level is Level.WARN
    assert "reaction_metric.visibility_thresholds_m" in str(warning.remedy)


def test_where_reactions_are_not_judged_no_expected_visibility_is_told(tmp_path):
    findings = without_shapes(subject(tmp_path))
    assert not [each for each in findings if "of visibility" in each.message]


@pytest.mark.parametrize(
    "scenario", ["seams2023", "release15", "extended", "planta_exp1", "paper_table_values"]
)
def test_shipped_scenarios_have_no_warning(scenario, command):
    status, out, _ = command("kb", "check", "--scenario", scenario, "--fail-on", "warn")
    assert status == 0, out


@pytest.mark.parametrize("kind", ["FunctionDesign", "QAvalue"])
def test_a_file_as_owlready2_saves_it_with_a_placeholder_has_no_error(kind, tmp_path):
    assert (
        errors(findings_of(Subject([write_as_owlready2_saves_it(tmp_path / "suave.owl", kind)])))
        == []
    )


def same(name: str) -> str:
    return f'<owl:sameAs rdf:resource="{SUAVE}{name}"/>'


def subclass(name: str, kind: str) -> str:
    below = f'<rdfs:subClassOf rdf:resource="{TOMASYS}{kind}"/>'
    return f'<owl:Class rdf:about="{SUAVE}{name}">{below}</owl:Class>'


ESTIMATE = individual("fd_spiral_low", inside=link("hasQAestimation", "qa_mine"))
WRONG = {
    "design as class": (
        subclass("fd_quick", "FunctionDesign"),
        "fd_quick: it is a class without members",
    ),
    "class named like a design": (
        f'<owl:Class rdf:about="{SUAVE}fd_spiral_low"/>',
        "fd_spiral_low: it is the name of a class and of an individual",
    ),
    "two estimates": (
        individual(
            "qa_mine", "QAvalue", link("isQAtype", "water_visibility") + value("hasValue", "2.5")
        )
        + ESTIMATE,
        "fd_spiral_low: several values are expected of one quality attribute",
    ),
    "no class": (individual("fd_new"), "fd_new: it has no class, and nothing is said of it"),
    "status as truth value": (
        individual("c_thruster_1", inside=value("c_status", "false", "boolean")),
        "c_thruster_1: c_status: missions and rules write statuses as FALSE",
    ),
    "fact of another class": (
        individual("f_new", "Function", link("hasNFR", "qa_water_visibility_low"))
        + individual("fd_new"),
        "f_new: hasNFR: it is of another class than the one that the property is declared for",
    ),
    "fact that leads to another class": (
        individual(
            "c_new",
            "Component",
            f'<mros:requiredBy rdf:resource="{SUAVE}qa_water_visibility_low"/>',
        ),
        "qa_water_visibility_low: requiredBy: it is of another class than the one that the property leads to",
    ),
    "measured value that is not measured": (
        individual("obs_current", "QAvalue", link("isQAtype", "current") + value("hasValue", "2.5"))
        + individual(
            "current", "QualityAttributeType", value("qa_comparison_operator", "&lt;", "string")
        ),
        "hasValue of obs_current is not used: current has the value that missions measure",
    ),
}


@pytest.fixture(scope="module")
def edited(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Finding, ...]]:
    """What is found where missions measure the visibility and components report."""

    def find(extra: str) -> tuple[Finding, ...]:
        given = {"reported": REPORTED_STATUSES, "measured": ["water_visibility"]}
        return found(tmp_path_factory.mktemp("edited"), extra=extra, **given)

    return find


@pytest.fixture(scope="module")
def wrong(edited) -> tuple[Finding, ...]:
    """What is found with all wrong edits: shapes take a second, whatever they are checked of."""
    return edited("".join(extra for extra, _ in WRONG.values()))


@pytest.mark.parametrize("case", WRONG)
def test_an_edit_that_means_something_else(case, wrong):
    _, message = WRONG[case]
    finding = next(each for each in warnings(wrong) if each.message.startswith(message))
    assert finding.line is not None


def test_right_edits(edited):
    right = (
        individual("c_thruster_7", "Component", same("c_thruster_1")),
        subclass("SearchDesign", "FunctionDesign"),
        subclass("fd_quick", "FunctionDesign")
        + individual("fd_follow_pipeline", inside=f'<rdf:type rdf:resource="{SUAVE}fd_quick"/>'),
        individual(
            "qa_mine", "QAvalue", link("isQAtype", "water_visibility") + value("hasValue", "1.25")
        )
        + ESTIMATE,
        individual("fd_spiral_low", inside="<rdfs:comment>no facts</rdfs:comment>"),
        individual("c_thruster_2", inside=value("c_status", "FALSE", "string")),
        individual("c_thruster_3", inside=value("c_status", "worn", "string")),
        individual(
            "obs_water_visibility",
            "QAvalue",
            link("isQAtype", "water_visibility") + value("hasValue", "2.5"),
        ),
    )
    assert warnings(edited("".join(right))) == []


@pytest.mark.parametrize(
    ("operator", "is_unknown"),
    [
        (value("qa_comparison_operator", "&gt;=", "string"), False),
        ("<tomasys:qa_comparison_operator>&lt;</tomasys:qa_comparison_operator>", False),
        (value("qa_comparison_operator", "==", "string"), True),
    ],
    ids=["with its datatype", "without", "unknown"],
)
def test_an_unknown_comparison_operator_is_an_error(tmp_path, operator, is_unknown):
    extra = individual("current", "QualityAttributeType", operator)
    assert bool(errors(found(tmp_path, extra=extra))) is is_unknown


def test_a_comparison_operator_that_the_revision_assumes_is_reported_in_one_note(tmp_path):
    files = [write_as_owlready2_saves_it(tmp_path / "suave.owl")]
    note = only(without_shapes(Subject(files, operators={"water_visibility": "<"})), "comparison")
    line = next(
        n
        for n, text in enumerate(files[0].read_text().splitlines(), 1)
        if '#water_visibility">' in text
    )
    assert (note.level, note.line) == (Level.NOTE, line)
    assert (
        "water_visibility has no qa_comparison_operator in the ontologies: < is assumed"
        in note.message
    )


def test_a_comparison_operator_that_nothing_assumes_is_missing(tmp_path):
    files = [write_as_owlready2_saves_it(tmp_path / "suave.owl")]
    (warning,) = warnings(findings_of(Subject(files, measured=["water_visibility"])))
    assert "has no qa_comparison_operator" in warning.message


MEASURED = individual("obs_water_visibility", "QAvalue", link("isQAtype", "water_visibility"))


def exemplar_files(folder: Path, *, of_2023: bool = False) -> list[Path]:
    """The exemplar's three files, with the individual of a measured value in them."""
    files = (write_files_of_2023 if of_2023 else write_exemplar_files)(
        shipped_folder("ontology"), folder
    )
    text = files["suave"].read_text(encoding="utf-8")
    namespaces = f'<owl:NamedIndividual xmlns:tomasys="{TOMASYS}" xmlns:owl="{OWL}"'
    measured = MEASURED.replace("<owl:NamedIndividual", namespaces)
    files["suave"].write_text(text.replace("</rdf:RDF>", f"{measured}</rdf:RDF>"), encoding="utf-8")
    return list(files.values())


@pytest.mark.parametrize(
    ("scenario", "of_2023"), [("seams2023", True), ("seams2023", False), ("release15", False)]
)
def test_files_of_the_exemplar_have_notes_of_one_line_only(scenario, of_2023, tmp_path):
    findings = check(
        subject_of(load_scenario(scenario, ontologies=exemplar_files(tmp_path, of_2023=of_2023)))
    )
    assert {each.level for each in findings} == {Level.NOTE}, findings
    messages = [each.message for each in findings]
    assert sum("for other models" in each for each in messages) == 2  # tomasys.owl and mros.owl
    assert "obs_water_visibility has no hasValue: missions give it the measured one" in messages
    assert len(findings) <= 8


def test_files_of_2023_under_another_revision_are_one_error_that_names_the_cause(tmp_path):
    loaded = load_scenario("release15", ontologies=exemplar_files(tmp_path, of_2023=True))
    (error,) = [each for each in check(subject_of(loaded)) if each.level is not Level.NOTE]
    assert (error.level, Path(error.file or "").name, error.remedy) == (
        Level.ERROR,
        "mros.owl",
        'write revision: "2023" in the scenario, or use ontologies of revision 1.5',
    )
    assert error.message.startswith("these are ontologies of revision 2023")
    assert (
        "label>compRecov<"
        in (tmp_path / "mros.owl").read_text().splitlines()[(error.line or 0) - 1]
    )
    # before a mission, too
    with pytest.raises(KnowledgeError, match="these are ontologies of revision 2023"):
        open_base(loaded)


def test_a_measured_attribute_without_operator_is_a_warning_before_missions(tmp_path, caplog):
    """Without one the altitude is never adapted: each design counts as possible whatever is
    measured.
    """
    write_as_owlready2_saves_it(tmp_path / "suave.owl")
    options = ("--ontology", "suave.owl", "--set", "mission.time_limit_s=1")
    for scenario, words in (
        ("release15", "so what is measured never rules out"),
        ("seams2023", "< is assumed"),
    ):
        caplog.clear()
        assert command_here("run", scenario, *options, cwd=tmp_path).returncode == 0
        message = next(each for each in caplog.messages if "qa_comparison_operator" in each)
        assert words in message
        assert message.startswith("WARN   suave.owl: line ") is (scenario == "release15")


def test_a_function_that_the_scenario_adds_is_needed(tmp_path):
    findings = check(subject_of(load_scenario("extended", ontologies=exemplar_files(tmp_path))))
    assert [each.message for each in findings if each.level is not Level.NOTE] == [
        "there is no function generate_recharge_path, which the mission needs"
    ]
