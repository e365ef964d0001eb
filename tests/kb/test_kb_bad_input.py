"""Every kb command on what it cannot use: one line or a finding, the right exit status, and the
file as it was.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import get_type_hints

import pytest

from suave_des.errors import InputError
from suave_des.kb.rule_editor import _rule_xml
from suave_des.kb.states import ManagingSettings, StateBuilder, recorded_state
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rules.parser import parse_rule
from suave_des.knowledge.state import KnowledgeState, ObjectiveState
from suave_des.metrics.result import KnowledgeRecord, MissionMetrics
from suave_des.records.mission_folder import KNOWLEDGE_FILE, knowledge_text
from suave_des.resources import shipped_folder
from suave_des.scenario.loader import load_scenario

SEARCH = "f_generate_search_path"
RULE = 'near: FunctionGrounding(?fg) -> fg_status(?fg, "IN_ERROR_NFR")'
STATE = ("--at", "water_visibility=1.8", "--at", f"{SEARCH}=fd_spiral_low")
ASKING = {
    "rules": (),
    "check": (),
    "infer": STATE,
    "explain": STATE,
    "policy": ("--max-failed", "0"),
    "query": ("SELECT ?s WHERE { ?s a ?t } LIMIT 1", "--inferred"),
}
UNKNOWN_KEY = ("--set", "mission.time_limt_s=9")
EDITING = {
    "add-rule": (RULE,),
    "remove-rule": ("S1a",),
    "enable-rule": ("S1a",),
    "disable-rule": ("S1a",),
}
NAMESPACES = (
    'xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:owl="http://www.w3.org/2002/07/owl#" '
    'xmlns="http://x.org/wine#"'
)


def document(content, doctype=""):
    return f'<?xml version="1.0"?>{doctype}<rdf:RDF {NAMESPACES}>{content}</rdf:RDF>'


def importing(name, other):
    return document(
        f'<owl:Ontology rdf:about="http://x.org/{name}"><owl:imports rdf:resource="http://x.org/{other}"/></owl:Ontology>'
    )


#: What no command can read, with what is said of it.
UNREADABLE = {
    "truncated": (None, "not well-formed XML"),
    "external entity": (
        document("&x;", '<!DOCTYPE rdf [<!ENTITY x SYSTEM "file:///etc/passwd">]>'),
        "refers to another file",
    ),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a recorded state, and the current one."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flown").mkdir()
    state = KnowledgeState.of([ObjectiveState(SEARCH)], groundings={SEARCH: "fd_spiral_low"})
    (tmp_path / "flown" / KNOWLEDGE_FILE).write_text(knowledge_text([KnowledgeRecord(1.0, state)]))
    scenario = load_scenario("seams2023").scenario.model_dump_json()
    values = {str: "x", bool: True}
    metrics = {name: values.get(kind, 1) for name, kind in get_type_hints(MissionMetrics).items()}
    mission = f'{{"scenario": {scenario}, "metrics": {json.dumps(metrics)}}}'
    (tmp_path / "flown" / "mission.json").write_text(mission)
    return tmp_path


def files_in(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def refused(command, name, arguments, said):
    before = files_in(Path())
    status, text, error = command(name, *arguments)
    assert (status, text) == (2, ""), name
    assert error.startswith("suave-des: ") and error.count("\n") == 1, name
    assert said in error, name
    assert files_in(Path()) == before, name


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("infer", "--at", "c_thruster_7=FALSE"),
            "--at: there is no quality attribute, component or function 'c_thr",
        ),
        (
            ("infer", "--at", "c_thruster_1=false"),
            "no rule mentions the c_status 'false', and nothing reports it (known: FALSE, ",
        ),
        (
            ("infer", "--at", "f_maintain_motion=ungrounded"),
            "--at: f_maintain_motion has no function design 'ungrou",
        ),
        (
            ("infer", "--at", "f_maintain_motion=IN_ERROR_\udcff"),  # as the shell's $'\xff' comes
            "--at: f_maintain_motion: 'IN_ERROR_\\udcff' has a character that no file can hold",
        ),
        (
            ("infer", "--at", "c_thruster_1=BROKEN"),
            "no rule mentions the c_status 'BROKEN'",
        ),
        (("why-not", "S1a", "--at", "water_visibilty=3.4"), "did you mean 'water_visibility'"),
        (("infer", "--at", "nowhere@3"), "nowhere: no such folder"),
        (("infer", "--at", "nowhere.yaml"), "nowhere.yaml: no such file"),
        (("infer", "--disable-rule", "QAWaterVisibilty"), "did you mean QAWaterVisibility?"),
        (("infer", "--reasoner", "hermit"), "there is no reasoner 'hermit'"),
        (("policy", "--csv", "."), ".: is a folder (name a file"),
        (("policy", "--max-failed", "-1"), "--max-failed"),
        (("try", RULE, "--disable", "S1a", "--on", "flown"), "give a rule, or --disable NAME"),
        (("try", "--on", "flown"), "give a rule, or --disable NAME"),
        (("try", "--disable", "S1x", "--on", "flown"), "--disable: there is no rule S1x"),
        (
            ("try", "near: FunctionGroundin(?fg) -> fg_status(?fg, 3)", "--on", "flown"),
            "FunctionGroundin is not defin",
        ),
        *(
            ((name, *asked, *UNKNOWN_KEY), "did you mean 'time_limit_s'")
            for name, asked in ASKING.items()
        ),
        (("test", *UNKNOWN_KEY), "did you mean 'time_limit_s'"),
        (("diff", "suave.owl", "suave.owl", *UNKNOWN_KEY), "did you mean 'time_limit_s'"),
    ],
)
def test_words_that_no_command_can_use(folder, command, words, said):
    name, *arguments = words
    refused(command, name, arguments, said)


@pytest.mark.parametrize("kind", UNREADABLE)
def test_no_command_takes_a_file_that_cannot_be_read(folder, command, kind):
    content, said = UNREADABLE[kind]
    suave = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    Path("bad.owl").write_text(
        suave[: len(suave) // 2] if content is None else content, encoding="utf-8"
    )
    for name, arguments in ASKING.items():
        refused(command, name, (*arguments, "--ontology", "bad.owl"), said)
    refused(command, "diff", ("bad.owl", "bad.owl"), said)
    for name, arguments in EDITING.items():
        refused(command, name, ("bad.owl", *arguments), said)


@pytest.mark.parametrize("kind", ["another ontology", "an import cycle"])
def test_an_ontology_of_something_else_is_told_apart_from_a_broken_one(folder, command, kind):
    wine = document(
        '<owl:Ontology rdf:about="http://x.org/wine"/><owl:Class rdf:about="http://x.org/wine#Wine"/>'
    )
    Path("wine.owl").write_text(wine if kind == "another ontology" else importing("wine", "b"))
    Path("b.owl").write_text(importing("b", "wine"))
    assert command("rules", "--ontology", "wine.owl")[0] == 0
    status, text, error = command("check", "--ontology", "wine.owl")
    assert (status, error) == (1, "")
    assert "there is no function f_follow_pipeline" in text
    for name, said in {
        "infer": "there is no quality attribute, component or function 'water_visibility'",
        "explain": "there is no quality attribute, component or function 'water_visibility'",
        "policy": "no function has a function design",
    }.items():
        refused(command, name, (*ASKING[name], "--ontology", "wine.owl"), said)
    refused(
        command,
        "diff",
        ("wine.owl", "wine.owl", "--max-failed", "0"),
        "no function has a function design",
    )
    for name, arguments in EDITING.items():
        said = (
            "FunctionGrounding is not defined"
            if name == "add-rule"
            else "there is no rule S1a (its rules: none)"
        )
        refused(command, name, ("wine.owl", *arguments), said)


def test_a_rule_with_unbalanced_parentheses_is_refused_with_its_column(folder, command):
    bad, said = RULE.replace("?fg)", "?fg", 1), "line 1, column 29: expected , or ) instead of '-'"
    Path("bad.swrl").write_text(bad)
    Path("suave.owl").write_bytes((shipped_folder("ontology") / "suave.owl").read_bytes())
    for name in ("rules", "infer", "explain", "policy", "query"):
        refused(command, name, (*ASKING[name], "--rules", "bad.swrl"), f"bad.swrl: {said}")
    refused(command, "add-rule", ("suave.owl", bad), said)
    refused(command, "try", (bad, "--on", "flown"), said)
    status, text, error = command("check", "--rules", "bad.swrl")
    assert (status, error) == (1, "")
    assert f"ERROR  bad.swrl: {said}" in text


def test_names_that_are_not_ascii_are_names(folder, command):
    suave = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    Path("suave.owl").write_text(
        suave.replace("fd_spiral_high", "fd_spirale_größte"), encoding="utf-8"
    )
    rule = 'größer: typeFD(?größe, fd_spirale_größte) -> fg_status(?größe, "IN_ERROR_FR")'
    assert command("add-rule", "suave.owl", rule)[0] == 0
    assert rule in command("rules", "--ontology", "suave.owl")[1]
    state = ("--at", f"{SEARCH}=fd_spirale_größte")
    status, text, _ = command(
        "explain", "fg_status(fg_spirale_größte, IN_ERROR_FR)", "--ontology", "suave.owl", *state
    )
    assert status == 0
    assert "by rule größer with ?größe = fg_spirale_größte" in text
    assert command("remove-rule", "suave.owl", "größer")[0] == 0


def test_rules_that_contradict_each_other_are_named(folder, command):
    clash = RULE.replace("near", "clash").replace("IN_ERROR_NFR", "IN_ERROR_FR")
    Path("clash.swrl").write_text(f"{RULE}\n{clash}\n")
    rules = ("--rules", "clash.swrl")
    named = "by the rules clash (clash.swrl, line 2), near (clash.swrl, line 1)"
    for asked in ("infer", "explain"):
        refused(command, asked, (*STATE, *rules), named)
    status, text, _ = command("check", *rules)
    assert status == 1
    # what follows from them may clash, too
    assert "clash (clash.swrl, line 2), near (clash.swrl, line 1)" in text


def test_a_rule_that_reads_any_status_makes_every_status_one_to_give(tmp_path):
    """Though other rules ask for those that they name."""
    rules = tmp_path / "own.swrl"
    rules.write_text("R: c_status(?c, ?s) -> Role(?c)\n")
    builder = StateBuilder(Ontology.load(rules=[rules]), ManagingSettings())
    builder.add_words(["c_thruster_1=HOT"])
    assert builder.state().components == (("c_thruster_1", "HOT"),)


def test_a_state_is_there_from_the_very_time_of_its_record(folder):
    assert recorded_state(folder / "flown", "1").grounded(SEARCH) == "fd_spiral_low"
    with pytest.raises(InputError, match=r"has no state until 0\.999 s"):
        recorded_state(folder / "flown", "0.999")


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("Nowhere(?x) -> Wine(?x)", id="a class that is not there"),
        pytest.param("Wine(?x) -> Wine(?y)", id="a variable without a value"),
    ],
)
def test_rules_are_printed_as_rules_as_text_can_have_them(folder, command, text):
    ontology = '<owl:Ontology rdf:about="http://x.org/wine"/><owl:Class rdf:about="http://x.org/wine#Wine"/>'
    xml = _rule_xml(looked_up_in_wine(text))
    Path("wine.owl").write_text(document(ontology + xml))
    printed = command("rules", "--ontology", "wine.owl")[1]
    assert "# Rules as text cannot have this rule: rule odd: " in printed
    Path("wine.swrl").write_text(printed)
    status, _, error = command("rules", "--ontology", "wine.owl", "--rules", "wine.swrl")
    assert (status, error) == (0, "")


def looked_up_in_wine(text):
    """A rule with all names in one namespace, whether or not they are there."""
    parsed = parse_rule(f"odd: {text}")
    body, head = (
        tuple(
            replace(atom, kind="class", predicate=f"http://x.org/wine#{atom.predicate}")
            for atom in side
        )
        for side in (parsed.body, parsed.head)
    )
    return replace(parsed, body=body, head=head)
