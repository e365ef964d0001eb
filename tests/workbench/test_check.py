"""kb check: every mistake that Pellet is silent about is an ERROR with its place, and good models pass."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from decimal import Decimal
from pathlib import Path

import pytest

from suave_des.cli.main import main
from suave_des.domain import THRUSTER_NAMES
from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.checks.findings import Finding, Level, folded, has_level
from suave_des.knowledge.checks.slips import are_near
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.monitor.diagnostics import REPORTED_STATUSES
from suave_des.resources import shipped_folder
from suave_des.workbench.check import MAX_STATES, Subject, check, combined, simple_states
from tests.helpers.exemplar_files import write_as_owlready2_saves_it

SUAVE = "http://www.metacontrol.org/suave#"
TOMASYS = "http://metacontrol.org/tomasys#"
OWL = "http://www.w3.org/2002/07/owl#"
SWRL = "http://www.w3.org/2003/11/swrl#"


def found(tmp_path: Path, rules: str = "", extra: str = "", states: int = 3, **options: object) -> tuple[Finding, ...]:
    """What is found in the shipped suave.owl with a rule file; Pellet is asked about a few states only."""
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    (tmp_path / "suave.owl").write_text(text.replace("</rdf:RDF>", extra + "</rdf:RDF>"), encoding="utf-8")
    (tmp_path / "mine.swrl").write_text(rules, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("suave_des.workbench.check.MAX_STATES", states)
        return check(Subject([tmp_path / "suave.owl"], [tmp_path / "mine.swrl"], **options))  # type: ignore[arg-type]


def errors(findings: tuple[Finding, ...]) -> list[Finding]:
    return [one for one in findings if one.level is Level.ERROR]


def only(findings: tuple[Finding, ...], words: str) -> Finding:
    (one,) = [finding for finding in findings if words in finding.message]
    return one


def test_the_shipped_ontology_passes(tmp_path: Path) -> None:
    findings = found(tmp_path, states=MAX_STATES)
    assert not has_level(findings, Level.WARN)
    assert only(findings, "battery_level").level is Level.INFO


def test_pellet_is_not_asked_again_about_what_did_not_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rules = "A: hasValue(?q, ?v) ^ lessThan(?v, 1) -> Role(?q)\n"
    findings = found(tmp_path, rules)
    monkeypatch.setattr(InProcessPellet, "__init__", lambda *_: pytest.fail("Java was asked"))
    assert found(tmp_path, rules) == findings
    with pytest.raises(pytest.fail.Exception, match="Java was asked"):
        found(tmp_path, rules.replace("1", "1.1"))


def test_pellet_is_asked_for_fewer_states_that_contain_all_simple_ones() -> None:
    base = Ontology.load()
    simple = tuple(simple_states(base))
    asked = [set(base.assertions(state)) for state in combined(simple)]
    assert len(asked) < len(simple) / 3
    assert all(any(every >= set(base.assertions(state)) for every in asked) for state in simple)


DECLARE = "declare it as {} property in the ontology"
#: What Pellet drops or ignores (the table of its silent cases), each as a rule on one line.
SILENT = {
    "unknown builtin": ("A: hasValue(?q, ?v) ^ swrlb:lessThn(?v, 1) -> Role(?q)", 23, "did you mean lessThan?"),
    "head variable": ("A: Role(?q) -> Role(?p)", 21, None),
    "builtin variable": ("A: Role(?q) ^ lessThan(?v, 1) -> Role(?q)", 24, None),
    "undeclared class": ("A: <http://x.org/#Rol>(?q) -> Role(?q)", 4, "did you mean Role?"),
    "undeclared property": (
        "A: <http://x.org/#p>(?q, ?r) -> Role(?q)",
        4,
        DECLARE.format("object"),
    ),
    "undeclared individual": ("A: typeFD(?q, suave:fd_spiral) -> Role(?q)", 15, "did you mean fd_spiral_low?"),
    "lessThan with one": ("A: hasValue(?q, ?v) ^ lessThan(?v) -> Role(?q)", 23, None),
    "undeclared in the head": (
        'A: Role(?q) -> <http://x.org/#p>(?q, "x")',
        16,
        DECLARE.format("data"),
    ),
    "literal of an object property": ('A: typeFD(?q, "fd") -> Role(?q)', 15, None),
    "head literal outside the range": ("A: Role(?q) -> fg_status(?q, 1)", 30, "a value of string"),
    "individual of a data property": ("A: fg_status(?q, energy) -> Role(?q)", 18, 'a text needs quotes: "energy"'),
    "class as property": ("A: Role(?q, ?r) -> Role(?q)", 4, "write Role(?x)"),
    "integer for a decimal": ("A: hasValue(?q, 1) -> Role(?q)", 17, "write 1.0"),
    "misspelt name": ("A: Objectve(?q) -> Role(?q)", 4, "did you mean Objective?"),
    "syntax": ("A: Role(?q -> Role(?q)", 12, "parentheses must balance"),
}


@pytest.mark.parametrize("case", SILENT)
def test_silent_cases_are_errors_with_file_rule_and_column(case: str, tmp_path: Path) -> None:
    rule, column, remedy = SILENT[case]
    (error,) = errors(found(tmp_path, f"# first line\n{rule}\n"))
    assert (error.file, error.line, error.column) == (str(tmp_path / "mine.swrl"), 2, column)
    assert error.rule == ("A" if case != "syntax" else None)
    assert error.remedy == remedy


OWL_RULE = f"""
    <rdf:Description><rdfs:label>mine</rdfs:label><rdf:type rdf:resource="{SWRL}Imp"/>
      <swrl:body rdf:parseType="Collection"><swrl:IndividualPropertyAtom>
        <swrl:propertyPredicate rdf:resource="{TOMASYS}fg_status"/>
        <swrl:argument1 rdf:resource="urn:swrl:var#x"/><swrl:argument2 rdf:resource="urn:swrl:var#y"/>
      </swrl:IndividualPropertyAtom></swrl:body>
      <swrl:head rdf:parseType="Collection"><swrl:ClassAtom>
        <swrl:classPredicate rdf:resource="{TOMASYS}Roel"/><swrl:argument1 rdf:resource="urn:swrl:var#z"/>
      </swrl:ClassAtom></swrl:head></rdf:Description>
"""


def test_rules_of_ontologies_are_checked_likewise(tmp_path: Path) -> None:
    findings = errors(found(tmp_path, extra=OWL_RULE))
    text = (tmp_path / "suave.owl").read_text(encoding="utf-8")
    line = text[: text.index("mine</rdfs:label>")].count("\n") + 1
    assert {(one.file, one.line, one.rule) for one in findings} == {(str(tmp_path / "suave.owl"), line, "mine")}
    # fg_status(?x, ?y) -> Roel(?z)
    assert [(one.column, one.message) for one in findings] == [
        (1, "fg_status is a data property, but is used as an object property"),
        (22, "class Roel is not defined"),
        (27, "?z occurs in the head, but the body does not bind it"),
    ]


def test_all_mistakes_of_a_file_are_told_at_once(tmp_path: Path) -> None:
    rules = "A: Rle(?x) -> Role(?x)\nB: Role(?x -> Role(?x)\ndisabled C: Role(?x) -> Role(?y)\n"
    findings = found(tmp_path, rules)
    assert [one.line for one in errors(findings)] == [1, 2]
    assert only(findings, "switched off").level is Level.INFO


TWO_FAILED = 'two: c_status(?a, "FALSE") ^ c_status(?b, "FALSE") ^ differentFrom(?a, ?b) -> Role(?a)\n'


@pytest.mark.parametrize(
    ("body", "argument", "message"),
    [
        ('c_status(?c, ?s) ^ matches(?s, "F[A")', '"F[A"', '"F[A" is not a regular expression'),
        ('c_status(?c, ?s) ^ matches(?s, "(FALSE")', '"(FALSE"', '"(FALSE" is not a regular expression'),
        ('c_status(?c, ?s) ^ tokenize(?t, ?s, "*")', '"*"', '"*" is not a regular expression'),
        ("hasValue(?c, ?v) ^ divide(?x, ?v, 0)", "0", "divide by 0 has no result"),
        ("hasValue(?c, ?v) ^ mod(?x, ?v, 0.0)", "0.0", "mod by 0.0 has no result"),
    ],
)
def test_a_built_in_that_never_holds(tmp_path: Path, body: str, argument: str, message: str) -> None:
    rule = f"A: {body} -> Role(?c)"
    warning = only(found(tmp_path, rule), message)
    assert (warning.level, warning.rule, warning.column) == (Level.WARN, "A", rule.index(argument) + 1)


@pytest.mark.parametrize("pattern", [r"\\p{Lu}[A-Z&&[^B]]++", "^*F.*", r"F.*\\b?$+"])
def test_regular_expressions_of_java_pass(tmp_path: Path, pattern: str) -> None:
    findings = found(tmp_path, f'A: c_status(?c, ?s) ^ matches(?s, "{pattern}") -> Role(?c)')
    assert not any("regular expression" in one.message for one in findings)


def test_different_names_alone_do_not_make_individuals_different(tmp_path: Path) -> None:
    warning = only(found(tmp_path, TWO_FAILED), "differentFrom(?a, ?b)")
    assert (warning.level, warning.rule, warning.column) == (Level.WARN, "two", 54)
    assert "owl:AllDifferent" in str(warning.remedy)


@pytest.mark.parametrize(
    "axiom",
    [
        f'''<rdf:Description><rdf:type rdf:resource="{OWL}AllDifferent"/>
        <owl:distinctMembers rdf:parseType="Collection"><rdf:Description rdf:about="{SUAVE}c_thruster_1"/>
        <rdf:Description rdf:about="{SUAVE}c_thruster_2"/></owl:distinctMembers></rdf:Description>''',
        f'''<rdf:Description rdf:about="{SUAVE}c_thruster_1">
        <owl:differentFrom rdf:resource="{SUAVE}c_thruster_2"/></rdf:Description>''',
        f'''<rdf:Description rdf:about="{TOMASYS}Component">
        <owl:disjointWith rdf:resource="{TOMASYS}FunctionDesign"/></rdf:Description>''',
    ],
    ids=["all different", "different from", "disjoint classes"],
)
def test_individuals_that_are_declared_different(tmp_path: Path, axiom: str) -> None:
    assert not [each for each in found(tmp_path, TWO_FAILED, axiom) if "differentFrom" in each.message]


def test_a_rule_may_conclude_that_individuals_are_different(tmp_path: Path) -> None:
    concluding = 'other: c_status(?a, "FALSE") ^ c_status(?b, "RECOVERED") -> differentFrom(?a, ?b)\n'
    assert not [each for each in found(tmp_path, TWO_FAILED + concluding) if "declare" in str(each.remedy)]


def test_a_rule_that_never_fires(tmp_path: Path) -> None:
    rules = "A: requiresO(?g, ?o) -> Role(?g)\nB: Role(?g) -> Binding(?g)\n"
    rules += 'C: c_status(?c, "ANYTHING") -> Binding(?c)\n'
    findings = [one for one in found(tmp_path, rules) if one.file and one.file.endswith("mine.swrl")]
    assert [(one.level, one.rule, one.column) for one in findings] == [(Level.WARN, "A", 4), (Level.WARN, "B", 4)]


def test_a_rule_on_an_attribute_that_no_grounding_has_a_value_of(tmp_path: Path) -> None:
    rule = "A: hasQAvalue(?g, ?q) ^ isQAtype(?q, {}) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.3) -> Role(?g)"
    finding = only(found(tmp_path, rule.format("battery_level")), "no function design has an estimate of battery_level")
    assert (finding.level, finding.rule, finding.column) == (Level.WARN, "A", 25)
    assert not has_level(found(tmp_path, rule.format("water_visibility")), Level.WARN)
    given = "\nB: FunctionGrounding(?g) ^ isQAtype(?q, battery_level) -> hasQAvalue(?g, ?q)"
    assert not has_level(found(tmp_path, rule.format("battery_level") + given), Level.WARN)


def test_contradictions_come_from_pellet(tmp_path: Path) -> None:
    rules = 'A: Component(?c) -> c_status(?c, "x") ^ c_status(?c, "y")'
    (error,) = errors(found(tmp_path, rules))
    assert "contradiction" in error.message
    assert "by the rule A (mine.swrl, line 1)" in error.message


def test_exact_values_are_reported(tmp_path: Path) -> None:
    rules = "A: hasValue(?q, ?v) ^ add(?s, ?v, 1) ^ lessThan(?s, 2) -> Role(?q)"
    assert only(found(tmp_path, rules), "rule A computes with add").level is Level.INFO


def individual(name: str, kind: str, inside: str = "") -> str:
    return (
        f'<owl:NamedIndividual rdf:about="{SUAVE}{name}"><rdf:type rdf:resource="{TOMASYS}{kind}"/>{inside}'
        "</owl:NamedIndividual>\n"
    )


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


@pytest.mark.parametrize(
    ("status", "level", "remedy"),
    [
        ("FALSE", None, ""),
        ("LEAK", None, ""),
        ("WORN", None, ""),  # concluded by another rule
        ("False", Level.WARN, 'did you mean "FALSE"?'),
        ("RECOVERD", Level.WARN, 'did you mean "RECOVERED"?'),
        ("stuck", Level.INFO, 'reported are "FALSE", "LEAK", "RECOVERED"; a function of your own can report others'),
    ],
)
def test_a_component_status_that_nothing_reports(tmp_path: Path, status: str, level: Level, remedy: str) -> None:
    rules = f'A: c_status(?c, "{status}") -> Role(?c)\nB: Role(?c) -> c_status(?c, "WORN")\n'
    findings = found(tmp_path, rules, reported=REPORTED_STATUSES)
    named = [(one.level, one.rule, one.column, one.remedy) for one in findings if "reports c_status" in one.message]
    assert named == ([] if level is None else [(level, "A", 17, remedy)])


def test_a_measured_attribute_that_the_ontology_calls_something_else(tmp_path: Path) -> None:
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    path = tmp_path / "mine.owl"
    path.write_text(text.replace('water_visibility"', 'water_visability"'), encoding="utf-8")
    findings = check(Subject([path], measured=["water_visibility"]))
    unknown = only(findings, "missions measure water_visibility, but no ontology has")
    assert (unknown.level, unknown.file, unknown.remedy) == (Level.WARN, str(path), "did you mean water_visability?")
    assert only(findings, "do not measure water_visability, so what").level is Level.INFO
    assert not [each for each in found(tmp_path, measured=["water_visibility"]) if "measure" in each.message]


def link(name: str, target: str) -> str:
    return f'<tomasys:{name} rdf:resource="{SUAVE}{target}"/>'


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


def test_a_rule_as_text_that_takes_the_place_of_another_is_reported(tmp_path: Path) -> None:
    finding = only(found(tmp_path, "S1a: Role(?q) -> Role(?q)"), "replaces the rule of this name in")
    assert (finding.level, finding.rule, finding.line) == (Level.WARN, "S1a", 1)
    assert finding.message.endswith("tomasys.owl")
    same = 'S1a: FunctionGrounding(?fg) ^ fg_status(?fg, "IN_ERROR_COMPONENT") ^ solvesO(?fg, ?o)'
    findings = found(tmp_path, f'{same} -> o_status(?o, "IN_ERROR_COMPONENT")')
    assert not [one for one in findings if "replaces the rule of this name" in one.message]


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


def test_shapes_of_ones_own(tmp_path: Path) -> None:
    shapes = tmp_path / "mine.ttl"
    shapes.write_text(
        f"@prefix sh: <http://www.w3.org/ns/shacl#> .\n<urn:x> a sh:NodeShape ; sh:targetClass <{TOMASYS}Component> ;\n"
        f' sh:property [ sh:path <{TOMASYS}typeC> ; sh:minCount 1 ; sh:severity sh:Warning ; sh:message "no class" ] .',
        encoding="utf-8",
    )
    findings = found(tmp_path, shapes=[shapes])
    assert len([one for one in findings if one.message == "c_thruster_1: typeC: no class"]) == 1
    assert has_level(findings, Level.WARN)
    assert not has_level(findings, Level.ERROR)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"@prefix x: <urn:x> .\nfoo\n", "line 2: is not Turtle: expected directive or statement"),
        (b"<?xml version='1.0'?><rdf:RDF/>", "this is XML, not Turtle"),
        (b"<urn:a> <urn:b> \xff", "is not UTF-8 text"),
        (b"@prefix", "is not Turtle"),
    ],
)
def test_shapes_that_cannot_be_read(
    content: bytes, said: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "bad.ttl").write_bytes(content)
    with pytest.raises(InputError) as caught:
        check(Subject(shapes=[tmp_path / "bad.ttl"]))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not caplog.records


def command(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        main(["kb", "check", *arguments])
    return int(str(caught.value.code or 0))


def test_formats_and_exit_status(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rules = tmp_path / "mine.swrl"
    rules.write_text("A: requiresO(?g, ?o) -> Role(?g)", encoding="utf-8")
    assert command("--rules", str(rules)) == 0
    assert f"WARN   {rules}: line 1, rule A, column 4: can never fire" in capsys.readouterr().out
    assert command("--rules", str(rules), "--fail-on", "warn", "--format", "json") == 1
    first = json.loads(capsys.readouterr().out)[0]
    assert (first["level"], first["file"], first["line"], first["column"]) == ("WARN", str(rules), 1, 4)
    rules.write_text("A: Rol(?g) -> Role(?g)", encoding="utf-8")
    assert command("--rules", str(rules), "--format", "markdown") == 1
    assert "| ERROR | " in capsys.readouterr().out


def entity_bomb() -> str:
    entities = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10 if n else "x" * 10}">' for n in range(30))
    return f"<!DOCTYPE r [{entities}]><r>&e29;</r>" + "<!-- -->" * 1_300_000


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "the file is empty"),
        ("<?xml version='1.0'?>\n<rdf:RDF", "line 2"),
        (entity_bomb(), "line 1"),
        ('<!DOCTYPE r SYSTEM "file:///etc/passwd"><r/>', "line 1"),
        ("<html/>", "not OWL"),
        (
            '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:owl="http://www.w3.org/2002/07/owl#">'
            '\n<owl:Ontology rdf:about="http://x.org/">\n<owl:imports rdf:resource="http://x.org/none"/>'
            "</owl:Ontology></rdf:RDF>",
            "line 3: import http://x.org/none does not resolve",
        ),
    ],
    ids=["empty", "cut", "bomb", "external", "page", "import"],
)
def test_what_cannot_be_read_exits_with_2(
    content: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bad.owl"
    path.write_text(content, encoding="utf-8")
    assert command("--ontology", str(path)) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert path.read_text(encoding="utf-8") == content


@pytest.mark.parametrize(
    ("option", "name"), [("--rules", "none.swrl"), ("--shapes", "none.ttl"), ("--ontology", "n.owl")]
)
def test_missing_files_exit_with_2(option: str, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command(option, name) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_another_ontology_altogether_lacks_what_the_mission_needs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "wine.owl"
    path.write_text(
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:owl="http://www.w3.org/2002/07/owl#">'
        '<owl:Ontology rdf:about="http://x.org/wine"/><owl:Class rdf:about="http://x.org/wine#Bordeaux"/></rdf:RDF>',
        encoding="utf-8",
    )
    assert command("--ontology", str(path)) == 1
    assert "there is no function f_maintain_motion, which the mission needs" in capsys.readouterr().out


def test_rules_that_clash_in_a_state_are_an_error_though_the_ontologies_are_consistent(tmp_path: Path) -> None:
    high = "fd_spiral_high"
    rules = f"""
one: typeFD(?fg, {high}) ^ hasQAvalue(?fg, ?q) ^ hasValue(?q, ?v) ^ lessThan(?v, 2.2) -> fg_status(?fg, "IN_ERROR_FR")
"""
    (error,) = errors(found(tmp_path, rules, states=MAX_STATES))  # QAWaterVisibility says that it is IN_ERROR_NFR
    assert "contradiction" in error.message
    rules_in_it = r"by the rules QAWaterVisibility \(suave.owl, line \d+\), one \(mine.swrl, line \d+\)"
    assert re.search(rules_in_it, error.message)


def test_values_of_the_scenario_are_used(tmp_path: Path) -> None:
    body = "typeFD(?fg, fd_spiral_low) ^ hasValue(qa_water_visibility_low, ?v) ^ lessThan(?v, 0.2)"
    rules = "".join(f'{name}: {body} -> fg_status(?fg, "IN_ERROR_{name}")\n' for name in ("FR", "NFR"))
    assert errors(found(tmp_path, rules)) == []
    (error,) = errors(found(tmp_path, rules, values={"qa_water_visibility_low": Decimal("0.125")}))
    assert "by the rules FR (mine.swrl, line 1), NFR (mine.swrl, line 2)" in error.message
    with pytest.raises(KnowledgeError, match="qa_water_visibility_lo"):
        found(tmp_path, values={"qa_water_visibility_lo": Decimal(1)})


def test_a_reasoner_that_takes_too_long_is_given_up_on(tmp_path: Path) -> None:
    findings = found(tmp_path, "slow: Role(?r) -> Role(?r)\n", time_limit_s=1e-6)  # nobody has asked about it before
    assert "not done after" in errors(findings)[0].message


def test_a_comparison_operator_that_the_revision_assumes_is_told_in_one_note(tmp_path: Path) -> None:
    files = [write_as_owlready2_saves_it(tmp_path / "suave.owl")]
    note = only(check(Subject(files, operators={"water_visibility": "<"})), "comparison")
    line = next(n for n, text in enumerate(files[0].read_text().splitlines(), 1) if '#water_visibility">' in text)
    assert (note.level, note.line) == (Level.INFO, line)
    assert "water_visibility has no qa_comparison_operator in the ontologies: < is assumed" in note.message
    assert "never filters" in only(check(Subject(files)), "comparison").message


@pytest.mark.parametrize("kind", ["FunctionDesign", "QAvalue"])
def test_a_file_as_owlready2_saves_it_with_a_placeholder_has_no_error(kind: str, tmp_path: Path) -> None:
    assert errors(check(Subject([write_as_owlready2_saves_it(tmp_path / "suave.owl", kind)]))) == []


class TestBeforeItRuns:
    """What no reasoner would report: it is seen in the rules themselves."""

    @pytest.mark.parametrize(
        ("rule", "column", "consequence"),
        [
            ('A: FunctionGrounding(?g) -> fg_status(?g, "IN_EROR_NFR")', 43, "contradicts whatever it is concluded of"),
            ('A: o_status(?o, "IN_EROR_NFR") -> o_updatable(?o, true)', 17, "never matches"),
        ],
    )
    def test_a_status_outside_its_range_is_an_error(
        self, rule: str, column: int, consequence: str, tmp_path: Path
    ) -> None:
        (error,) = errors(found(tmp_path, rule))
        assert error.column == column
        assert error.message.endswith(consequence)
        assert error.remedy == "did you mean IN_ERROR_NFR?"

    @pytest.mark.parametrize(
        "body",
        [
            'greaterThan(?v, "3")',
            "lessThan(?v, 1) ^ greaterThan(?v, 2)",
            "lessThan(?v, 2) ^ equal(?v, 2.0)",
            "lessThan(2, ?v) ^ lessThanOrEqual(?v, 2)",
        ],
    )
    def test_comparisons_that_no_value_satisfies_are_warnings(self, body: str, tmp_path: Path) -> None:
        findings = found(tmp_path, f"A: hasValue(?q, ?v) ^ {body} -> QAvalue(?q)")
        (warning,) = [one for one in findings if one.level is Level.WARN]
        assert warning.rule == "A"
        assert warning.column
        assert "never" in warning.message

    @pytest.mark.parametrize("body", ["lessThan(1, ?v) ^ lessThan(?v, 2)", "equal(?v, 2) ^ lessThanOrEqual(?v, 2)"])
    def test_comparisons_that_some_value_satisfies_are_not(self, body: str, tmp_path: Path) -> None:
        findings = found(tmp_path, f"A: hasValue(?q, ?v) ^ {body} -> QAvalue(?q)")
        assert not has_level(findings, Level.WARN)

    def test_pellet_is_asked_after_an_error_that_does_not_stop_loading(self, tmp_path: Path) -> None:
        kind = f'<rdf:type rdf:resource="{SUAVE}Nowhere"/>'
        misspelt = f'<owl:NamedIndividual rdf:about="{SUAVE}x">{kind}</owl:NamedIndividual>'
        rules = 'A: Component(?c) -> c_status(?c, "x") ^ c_status(?c, "y")'
        messages = [one.message for one in errors(found(tmp_path, rules, extra=misspelt))]
        assert any("class Nowhere is not defined" in message for message in messages)
        assert any("contradiction" in message for message in messages)

    def test_what_was_skipped_is_said(self, tmp_path: Path) -> None:
        findings = found(tmp_path, "A: Role(?x) -> Role(?y)")
        assert only(findings, "not checked with Pellet").level is Level.INFO

    def test_notes_on_shipped_files_are_one_line(self) -> None:
        findings = check(Subject())
        (note,) = folded(findings, shipped_folder("ontology"))
        assert note.message.startswith(f"{len(findings)} notes on the shipped ontologies")
        assert note.remedy == "--verbose shows them"

    def test_individuals_can_be_the_same_or_different(self, tmp_path: Path) -> None:
        rules = "A: FunctionDesign(?x) ^ FunctionDesign(?y) ^ differentFrom(?x, ?y) -> Role(?x)\n"
        (tmp_path / "mine.swrl").write_text(rules + "B: sameAs(?x, ?y) ^ Role(?x) -> Role(?y)\n", encoding="utf-8")
        assert {"A", "B"} <= {rule.name for rule in Ontology.load(rules=[tmp_path / "mine.swrl"]).rules}


def test_a_rule_that_never_comes_to_an_end_is_named(tmp_path: Path) -> None:
    """In a process of its own: Java goes on until that ends."""
    rules = "ever: fd_efficacy(?d, ?v) ^ add(?w, ?v, 1) -> fd_efficacy(?d, ?w)\n"
    start = (
        f'<rdf:Description rdf:about="{SUAVE}fd_spiral_low"><tomasys:fd_efficacy '
        'rdf:datatype="http://www.w3.org/2001/XMLSchema#decimal">1</tomasys:fd_efficacy></rdf:Description>'
    )
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    (tmp_path / "suave.owl").write_text(text.replace("</rdf:RDF>", start + "</rdf:RDF>"), encoding="utf-8")
    (tmp_path / "mine.swrl").write_text(rules, encoding="utf-8")
    command = [sys.executable, "-m", "suave_des", "kb", "infer", "--ontology", "suave.owl", "--rules", "mine.swrl"]
    ended = subprocess.run([*command, "--time-limit", "2"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert "mine.swrl: line 1: " in ended.stderr
    assert "rule ever computes ever new values from what it concludes itself" in ended.stderr


@pytest.mark.parametrize(
    "rule",
    [
        'A: Component(?c) ^ c_status(?c, "FALSE") ^ requiredBy(?c, ?d) -> fd_realisability(?d, true)',
        'A: c_status(?c, "FALSE") ^ Objective(?o) -> o_status(?o, "IN_ERROR_COMPONENT")',  # if visibility is low, too
    ],
)
def test_rules_that_clash_once_a_component_fails(tmp_path: Path, rule: str) -> None:
    (error,) = errors(found(tmp_path, rule, states=MAX_STATES))
    assert "more than one value" in error.message
    assert "c_status(c_thruster_1, FALSE)" in error.message


def test_contradictions_are_not_looked_for_in_values_that_missions_do_not_measure(tmp_path: Path) -> None:
    rule = 'A: hasQAvalue(?g, ?q) ^ isQAtype(?q, performance) -> fg_status(?g, "IN_ERROR_FR")'
    assert errors(found(tmp_path, rule, states=MAX_STATES))
    assert not errors(found(tmp_path, rule, states=MAX_STATES, measured={"water_visibility"}))


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


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("hasQAvalue(?g, ?q) ^ isQAtype(?Q, ?t)", "?Q occurs only here, and is another variable than ?q"),
        ('o_status(?o, ?s) ^ equal(?s, "OK")', '"OK" is not among the values of o_status: the comparison never holds'),
        ('o_status(?o, ?s) ^ notEqual("OK", ?s)', "the comparison always holds"),
        ('c_status(?c, ?s) ^ equal(?s, "False")', 'nothing in the simulation reports c_status "False"'),
    ],
)
def test_slips_of_variables_and_texts(tmp_path: Path, body: str, message: str) -> None:
    findings = found(tmp_path, f"A: {body} -> Role(fd_spiral_low)", reported=REPORTED_STATUSES)
    assert only(findings, message).level is Level.WARN


@pytest.mark.parametrize(
    "body",
    [
        "hasValue(?q, ?v) ^ hasValue(?Q, ?V) ^ isQAtype(?q, ?t) ^ isQAtype(?Q, ?t) ^ lessThan(?v, ?V)",
        'o_status(?o, ?s) ^ equal(?s, "UNGROUNDED")',
        'c_status(?c, ?s) ^ equal("LEAK", ?s)',
        'c_status(?c, ?s) ^ notEqual(?s, "TRUE")',
    ],
)
def test_right_variables_and_texts(tmp_path: Path, body: str) -> None:
    findings = found(tmp_path, f"A: {body} -> Role(fd_spiral_low)", reported=REPORTED_STATUSES)
    assert not has_level(findings, Level.WARN)


def test_a_file_without_rules_is_noted(tmp_path: Path) -> None:
    assert only(found(tmp_path, "# nothing yet\n"), "there is no rule in this file").level is Level.INFO


def warned(tmp_path: Path, rule: str, **options: object) -> list[tuple[int | None, str, str | None]]:
    """Column, message and remedy of the warnings about a rule."""
    findings = found(tmp_path, rule, reported=REPORTED_STATUSES, **options)  # type: ignore[arg-type]
    return [(one.column, one.message, one.remedy) for one in findings if one.rule == "A" and one.level is Level.WARN]


WITHOUT_FIRING = {
    "two values asked": (
        'A: c_status(?c, "FALSE") ^ c_status(?c, "LEAK") -> Role(?c)',
        (28, 'c_status(?c, "LEAK"): nothing has two values of c_status, so the rule never fires'),
    ),
    "two designs": (
        "A: typeFD(?g, fd_spiral_low) ^ typeFD(?g, fd_spiral_high) -> Role(?g)",
        (32, "typeFD(?g, fd_spiral_high): nothing has two values of typeFD, so the rule never fires"),
    ),
    "value replaced": (
        "A: isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ lessThan(?v, 1.0) -> hasValue(?q, 1.0)",
        (77, "hasValue(?q, 1.0) contradicts hasValue in the body, which holds as well"),
    ),
    "status replaced": (
        'A: o_status(?o, "UNGROUNDED") -> o_status(?o, "IN_ERROR_FR")',
        (34, 'o_status(?o, "IN_ERROR_FR") contradicts o_status in the body, which holds as well'),
    ),
    "compared with itself": (
        "A: hasValue(?q, ?v) ^ greaterThan(?v, ?v) -> Role(?q)",
        (23, "greaterThan(?v, ?v) compares ?v with itself: it never holds"),
    ),
    "compared with the same value": (
        "A: hasValue(?q, ?v) ^ hasValue(?q, ?w) ^ lessThanOrEqual(?v, ?w) -> Role(?q)",
        (42, "?v and ?w are the same hasValue: lessThanOrEqual(?v, ?w) always holds"),
    ),
    "nothing new": (
        'A: fg_status(?g, "IN_ERROR_NFR") ^ solvesO(?g, ?o) -> fg_status(?g, "IN_ERROR_NFR")',
        (55, "the rule concludes only what its body says"),
    ),
    "realisable": (
        "A: hasValue(?q, ?v) ^ greaterThan(?v, 3.5) -> fd_realisability(fd_spiral_high, true)",
        (47, "fd_realisability true has no effect: a design counts as realisable unless it is false"),
    ),
    "not connected": (
        "A: hasQAvalue(?g, ?q) ^ isQAtype(?p, water_visibility) ^ hasValue(?p, ?v) -> Role(?g)",
        (19, "?q occurs only here, and nothing connects it with ?p, which is a QAvalue, too"),
    ),
    "not connected, by a capital": (
        "A: hasQAvalue(?g, ?q) ^ isQAtype(?Q, water_visibility) ^ hasValue(?Q, ?v) -> Role(?g)",
        (19, "?q occurs only here, and is another variable than ?Q"),
    ),
    "unmeasured": (
        "A: hasQAvalue(?g, ?q) ^ isQAtype(?q, performance) -> Role(?g)",
        (25, "can never fire: missions do not measure performance, so no grounding has a value of it"),
    ),
    "no value": (
        "A: isQAtype(?q, battery_level) ^ hasValue(?q, ?v) -> Role(?q)",
        (4, "can never fire: missions do not measure battery_level, and no ontology has a value of it"),
    ),
    "excluded text": (
        'A: c_status(?c, ?s) ^ notEqual(?s, "False") -> Role(?c)',
        (36, 'nothing in the simulation reports c_status "False"'),
    ),
    "text in any case": (
        'A: c_status(?c, ?s) ^ stringEqualIgnoreCase(?s, "Fals") -> Role(?c)',
        (49, 'nothing in the simulation reports c_status "Fals"'),
    ),
}


@pytest.mark.parametrize("case", WITHOUT_FIRING)
def test_a_rule_that_cannot_do_what_it_should(case: str, tmp_path: Path) -> None:
    rule, finding = WITHOUT_FIRING[case]
    assert [one[:2] for one in warned(tmp_path, rule, measured=["water_visibility"])] == [finding]


@pytest.mark.parametrize(
    "rule",
    [
        'A: c_status(?c, "FALSE") ^ c_status(?d, "RECOVERED") -> Role(?c)',
        "A: hasValue(?q, 2.0) ^ hasValue(?q, 2.00) -> Role(?q)",
        'A: o_status(?o, "UNGROUNDED") -> o_status(?o, "UNGROUNDED")',
        'A: fg_status(?g, ?s) ^ equal(?s, "IN_ERROR_NFR") -> fg_status(?g, "IN_ERROR_NFR")',
        'A: fg_status(?g, "IN_ERROR_NFR") ^ solvesO(?g, ?o) -> o_status(?o, "IN_ERROR_NFR")',
        "A: hasValue(?q, ?v) ^ hasValue(?r, ?w) ^ lessThan(?v, ?w) -> Role(?q)",
        "A: requiredBy(?c, ?d) -> fd_realisability(?d, true)\nB: fd_realisability(?d, true) -> Role(?d)",
        'A: Component(?c) ^ c_status(?c, "RECOVERED") ^ Objective(?o) -> o_updatable(?o, true)',
        "A: hasQAvalue(?g, ?q) ^ hasQAvalue(?h, ?q) ^ typeFD(?g, fd_spiral_low) -> Role(?h)",
        "A: hasQAvalue(?g, ?q) ^ isQAtype(?q, water_visibility) -> Role(?g)",
        "A: isQAtype(?q, performance) ^ hasValue(?q, ?v) -> Role(?q)",
        "A: isQAtype(?q, battery_level) -> Role(?q)\nB: Role(?q) -> isQAtype(?q, battery_level)",
        "A: solvesO(?g, ?o) ^ typeFD(?g, fd_spiral_low) ^ solvesO(?h, ?p) ^ o_updatable(?p, true) -> Role(?h)",
        'A: c_status(?c, ?s) ^ startsWith(?s, "REC") -> Role(?c)',
        'A: c_status(?c, ?s) ^ contains("FALSE or RECOVERED", ?s) -> Role(?c)',
        'A: c_status(?c, ?s) ^ stringEqualIgnoreCase(?s, "false") -> Role(?c)',
    ],
)
def test_a_rule_that_can(rule: str, tmp_path: Path) -> None:
    assert not warned(tmp_path, rule, measured=["water_visibility"])


def test_a_misspelt_variable(tmp_path: Path) -> None:
    rule = "A: hasQAvalue(?g, ?q) ^ hasValue(?q, ?vlaue) ^ hasValue(?other, ?value) ^ lessThan(?value, 2) -> Role(?g)"
    finding = (38, "?vlaue occurs only here, and is another variable than ?value", "did you mean ?value?")
    assert warned(tmp_path, rule) == [finding]


@pytest.mark.parametrize(
    ("one", "other", "are"),
    [
        ("design", "desing", True),
        ("design", "desgn", True),
        ("design", "dessign", True),
        ("statu", "status", False),
        ("value", "valule", True),
        ("obj", "objj", True),
        ("speed1", "speed2", False),
        ("speed12", "speed21", False),
        ("xpos", "ypos", False),
        ("goal_a", "goal_b", False),
        ("goal", "goal2", False),
        ("value", "qvalue", False),
        ("fg", "fd", False),
        ("q", "qq", False),
        ("measured", "required", False),
    ],
)
def test_names_that_are_misspelt_variants_of_each_other(one: str, other: str, are: bool) -> None:
    assert are_near(one, other) is are
    assert are_near(other, one) is are
