"""kb check: good models pass, what Pellet finds, shapes, output and exit status."""

import itertools
import json
import re
import time
from decimal import Decimal
from pathlib import Path

import pytest

from suave_des.errors import KnowledgeError, Level, has_level
from suave_des.kb.check import check, states_to_ask
from suave_des.knowledge.checks import Subject
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.reasoner import regions_of
from suave_des.knowledge.state import KnowledgeState
from suave_des.resources import shipped_folder
from tests.helpers.checks import SUAVE, errors, findings_of, found_by_pellet, only, subject
from tests.helpers.command import suave_des_command
from tests.helpers.owl_text import individual


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One for all tests that are about rules: shapes of the same file are checked once."""
    return tmp_path_factory.mktemp("checked")


def test_the_shipped_ontology_has_a_note_for_each_file_with_rules_for_other_models(folder):
    notes = check(Subject())
    assert [(each.level, each.rule) for each in notes] == [(Level.NOTE, None)] * 2
    never = "rules for other models, which never fire in this one: "
    assert [each.message.removeprefix(never)[:8] for each in notes] == ["QAenergy", "S10, S11"]
    # A copy of one's own is told which files supply its imports, too.
    assert [each.level for each in found_by_pellet(folder)] == [Level.NOTE] * 3


def test_pellet_is_not_asked_again_about_what_did_not_change(folder, monkeypatch):
    rules = "A: hasValue(?q, ?v) ^ lessThan(?v, 1) -> Role(?q)\n"
    findings = found_by_pellet(folder, rules)
    monkeypatch.setattr(InProcessPellet, "__init__", lambda *_: pytest.fail("Java was asked"))
    assert found_by_pellet(folder, rules) == findings
    with pytest.raises(pytest.fail.Exception, match="Java was asked"):
        found_by_pellet(folder, rules.replace("1", "1.1"))


def test_shapes_are_checked_once_for_the_same_files(tmp_path, monkeypatch):
    def shaped(name: str) -> list[str]:
        extra = f'<tomasys:QAvalue rdf:about="{SUAVE}{name}"/><tomasys:QAvalue rdf:about="{SUAVE}one" rdfs:label=""/>'
        return [each.message for each in errors(findings_of(subject(tmp_path, extra=extra)))]

    first = shaped("one")
    assert first
    monkeypatch.setattr("pyshacl.validate", lambda *_, **options: pytest.fail("pySHACL was asked"))
    assert shaped("one") == first
    with pytest.raises(pytest.fail.Exception, match="pySHACL was asked"):
        shaped("other")


@pytest.fixture(scope="module")
def asked() -> tuple[Ontology, list[KnowledgeState]]:
    """The shipped ontologies, and the states that Pellet is asked about."""
    base = Ontology.load()
    return base, list(states_to_ask(base))


def test_pellet_is_asked_about_few_states(asked):
    assert len(asked[1]) < 100


def test_pellet_is_asked_about_each_design_with_each_report(asked):
    base, states = asked
    for function in base.functions:
        wanted = set(itertools.product(base.designs(function), ("FALSE", "RECOVERED")))
        assert {(state.grounded(function), state.components[0][1]) for state in states} == wanted


def test_pellet_is_asked_about_each_design_with_each_range_of_values(asked):
    base, states = asked
    for function in base.functions:
        wanted = set(itertools.product(base.designs(function), regions_of(base).thresholds))
        assert {
            (state.grounded(function), dict(state.measurements).get("water_visibility"))
            for state in states
        } > wanted


def test_an_attribute_that_is_declared_again_with_the_same_operator_is_no_error(suave_copy):
    again = individual("water_visibility", "QualityAttributeType", ("qa_comparison_operator", "<"))
    assert not errors(check(Subject([suave_copy(again)])))


def test_contradictions_come_from_pellet(folder):
    rules = 'A: Component(?c) -> c_status(?c, "x") ^ c_status(?c, "y")'
    (error,) = errors(found_by_pellet(folder, rules))
    assert "by the rule A (mine.swrl, line 1)" in error.message


def test_exact_values_are_reported(folder):
    rules = "A: hasValue(?q, ?v) ^ add(?s, ?v, 1) ^ lessThan(?s, 2) -> Role(?q)"
    assert only(found_by_pellet(folder, rules), "rule A computes with add").level is Level.NOTE


@pytest.fixture
def checked(tmp_path, command):
    """Runs the command with a rule; (status, output)."""

    def run(rule: str, *options: str) -> tuple[int, str]:
        (tmp_path / "mine.swrl").write_text(rule, encoding="utf-8")
        return command("check", "--rules", tmp_path / "mine.swrl", *options)[:2]

    return run


NEVER = "A: requiresO(?g, ?o) -> Role(?g)"


def test_a_finding_is_a_line_with_its_place(checked, tmp_path):
    place = f"{tmp_path / 'mine.swrl'}: line 1, rule A, column 4"
    assert f"WARN   {place}: can never fire" in checked(NEVER)[1]


def test_in_json_its_place_has_keys(checked, tmp_path):
    first = json.loads(checked(NEVER, "--format", "json")[1])[0]
    place = {key: first[key] for key in ("level", "file", "line", "column")}
    file = str(tmp_path / "mine.swrl")
    assert place == {"level": "WARN", "file": file, "line": 1, "column": 4}


@pytest.mark.parametrize(
    ("rule", "options", "status"),
    [
        (NEVER, (), 0),
        (NEVER, ("--fail-on", "warn"), 1),
        ("A: Rol(?g) -> Role(?g)", (), 1),
    ],
    ids=["warning", "warning to fail on", "error"],
)
def test_the_exit_status_says_whether_there_are_findings_to_fail_on(checked, rule, options, status):
    assert checked(rule, *options)[0] == status


def test_what_has_no_effect_in_the_scenario_is_a_warning_with_its_file(command, monkeypatch):
    """The ontologies are not what this is about: checking them takes seconds."""
    monkeypatch.setattr("suave_des.kb.check.check", lambda subject: ())
    given = ("--set", "thruster_events=['(1,failure,10)']", "--format", "json")
    (finding,) = json.loads(command("check", *given)[1])
    assert (finding["level"], finding["file"]) == ("WARN", "shipped/scenarios/seams2023.yaml")
    assert finding["message"].startswith("thruster_events.0: ")


def test_rules_that_clash_in_a_state_are_an_error_though_the_ontologies_are_consistent(folder):
    high = "fd_spiral_high"
    rules = f"""
one: typeFD(?fg, {high}) ^ hasQAvalue(?fg, ?q) ^ hasValue(?q, ?v) ^ lessThan(?v, 2.2) -> fg_status(?fg, "IN_ERROR_FR")
"""
    # QAWaterVisibility says that it is IN_ERROR_NFR
    (error,) = errors(found_by_pellet(folder, rules))
    assert "contradiction" in error.message
    rules_in_it = (
        r"by the rules QAWaterVisibility \(suave.owl, line \d+\), one \(mine.swrl, line \d+\)"
    )
    assert re.search(rules_in_it, error.message)


def test_values_of_the_scenario_are_used(folder):
    body = "typeFD(?fg, fd_spiral_low) ^ hasValue(qa_water_visibility_low, ?v) ^ lessThan(?v, 0.2)"
    rules = "".join(
        f'{name}: {body} -> fg_status(?fg, "IN_ERROR_{name}")\n' for name in ("FR", "NFR")
    )
    assert errors(found_by_pellet(folder, rules)) == []
    (error,) = errors(
        found_by_pellet(folder, rules, values={"qa_water_visibility_low": Decimal("0.125")})
    )
    assert "by the rules FR (mine.swrl, line 1), NFR (mine.swrl, line 2)" in error.message
    with pytest.raises(KnowledgeError, match="qa_water_visibility_lo"):
        found_by_pellet(folder, values={"qa_water_visibility_lo": Decimal(1)})


def test_a_reasoner_that_takes_too_long_is_given_up_on(folder):
    # A rule that nobody has asked about before.
    findings = found_by_pellet(folder, "slow: Role(?r) -> Role(?r)\n", time_limit_s=1e-6)
    assert "not done after" in errors(findings)[0].message


class TestBeforeItRuns:
    def test_pellet_is_asked_after_an_error_that_does_not_stop_loading(self, tmp_path):
        kind = f'<rdf:type rdf:resource="{SUAVE}Nowhere"/>'
        misspelt = f'<owl:NamedIndividual rdf:about="{SUAVE}x">{kind}</owl:NamedIndividual>'
        rules = 'A: Component(?c) -> c_status(?c, "x") ^ c_status(?c, "y")'
        messages = [one.message for one in errors(found_by_pellet(tmp_path, rules, extra=misspelt))]
        assert any("class Nowhere is not defined" in message for message in messages)
        assert any("contradiction" in message for message in messages)

    def test_what_was_skipped_is_said(self, folder):
        findings = found_by_pellet(folder, "A: Role(?x) -> Role(?y)")
        assert only(findings, "not checked with Pellet").level is Level.NOTE


def test_a_rule_that_never_comes_to_an_end_is_an_error(tmp_path):
    """In a process of its own: Java goes on until that ends."""
    rules = "ever: fd_efficacy(?d, ?v) ^ add(?w, ?v, 1) -> fd_efficacy(?d, ?w)\n"
    start = (
        f'<rdf:Description rdf:about="{SUAVE}fd_spiral_low"><tomasys:fd_efficacy '
        'rdf:datatype="http://www.w3.org/2001/XMLSchema#decimal">1</tomasys:fd_efficacy></rdf:Description>'
    )
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    (tmp_path / "suave.owl").write_text(
        text.replace("</rdf:RDF>", start + "</rdf:RDF>"), encoding="utf-8"
    )
    (tmp_path / "mine.swrl").write_text(rules, encoding="utf-8")
    files = ("--ontology", "suave.owl", "--rules", "mine.swrl")
    ended = suave_des_command("kb", "infer", *files, "--time-limit", "2", cwd=tmp_path)
    assert ended.returncode == 2
    assert "computes ever new values" in ended.stderr


@pytest.mark.parametrize(
    "rule",
    [
        'A: Component(?c) ^ c_status(?c, "FALSE") ^ requiredBy(?c, ?d) -> fd_realisability(?d, true)',
        'A: c_status(?c, "FALSE") ^ Objective(?o) -> o_status(?o, "IN_ERROR_COMPONENT")',  # if visibility is low, too
    ],
)
def test_rules_that_clash_once_a_component_fails(folder, rule):
    (error,) = errors(found_by_pellet(folder, rule))
    assert "more than one value" in error.message
    assert "c_status(c_thruster_1, FALSE)" in error.message


def test_contradictions_are_not_looked_for_in_values_that_missions_do_not_measure(folder):
    rule = 'A: hasQAvalue(?g, ?q) ^ isQAtype(?q, performance) -> fg_status(?g, "IN_ERROR_FR")'
    assert errors(found_by_pellet(folder, rule))
    assert not errors(found_by_pellet(folder, rule, measured={"water_visibility"}))


@pytest.mark.slow
def test_the_check_of_500_rules_takes_seconds(tmp_path):
    body = "hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v)"
    rules = (
        f'r{n}: {body} ^ lessThan(?v, {1 + n / 1000}) -> fg_status(?fg, "IN_ERROR_NFR")'
        for n in range(500)
    )
    path = tmp_path / "many.swrl"
    path.write_text("\n".join(rules), encoding="utf-8")
    before_s = time.process_time()  # of Java, too, which runs in this process
    assert not has_level(check(Subject(rules=[path])), Level.ERROR)
    assert time.process_time() - before_s < 15.0
