"""What functions of `kb` refuse, with what is said of it; commands are in test_kb_bad_input."""

from collections.abc import Callable
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest

from suave_des.errors import InputError
from suave_des.kb.explain import RuleQuestions
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.rule_editor import add_rules, remove_rule, set_enabled
from suave_des.kb.rule_tests import TestFile
from suave_des.kb.space import PolicySpace
from suave_des.resources import shipped_folder

SEARCH, MOTION = "f_generate_search_path", "f_maintain_motion"
Given = Callable[[KnowledgeBase, Path], object]
"""What is asked of a knowledge base, with files in a folder."""


def state(**parts: Any) -> Given:
    return lambda knowledge, _: knowledge.state(**parts)


def state_file(text: str) -> Given:
    def read(knowledge: KnowledgeBase, folder: Path) -> object:
        (folder / "state.yaml").write_text(text)
        return knowledge.state(folder / "state.yaml")

    return read


def rule_tests(text: str) -> Given:
    def read(knowledge: KnowledgeBase, folder: Path) -> object:
        (folder / "mine.yaml").write_text(f"tests:\n{text}\n")
        return list(TestFile.read(folder / "mine.yaml").tests(knowledge))

    return read


def question(text: str) -> Given:
    """About a state in which the search and a thruster are in error."""
    groundings = {SEARCH: "fd_spiral_high", MOTION: "fd_all_thrusters"}

    def ask(knowledge: KnowledgeBase, _: Path) -> object:
        in_error = knowledge.state(
            groundings=groundings,
            components={"c_thruster_1": "FALSE"},
            measurements={"water_visibility": 1.8},
        )
        return knowledge.explain(in_error, text)

    return ask


def query(text: str) -> Given:
    return lambda knowledge, _: knowledge.query(text)


def edit(change: Callable[[Path], object]) -> Given:
    """Of a copy of the shipped suave.owl."""

    def make(_: KnowledgeBase, folder: Path) -> object:
        path = folder / "suave.owl"
        path.write_bytes((shipped_folder("ontology") / "suave.owl").read_bytes())
        return change(path)

    return make


def policy_of_many_states(knowledge: KnowledgeBase, _: Path) -> object:
    attributes = ("battery_level", "energy", "water_visibility")
    space = PolicySpace(attributes, tuple(map(Decimal, range(40))), (), ())
    return knowledge.policy(9, space=space)


def why_not(name: str) -> Given:
    return lambda knowledge, _: RuleQuestions(knowledge.base).why_not(name, knowledge.state())


REFUSALS: list[tuple[Given, *tuple[str, ...]]] = [
    *(
        (state(**{name: 3}), f"{name}: expected a mapping")
        for name in ("measurements", "components", "groundings")
    ),
    (
        state_file("measurements: {water_visibilty: 1}\n"),
        "state.yaml: line 1, measurements.water_visibilty: there is no quality attribute",
    ),
    (
        state_file("measurements:\n  water_visibility: deep\n"),
        "state.yaml: line 2, measurements.water_visibility: 'deep' is not a number",
    ),
    (
        state_file("groundings: {f_maintain_motion: fd_spiral_low}\n"),
        "state.yaml: ",
        "f_maintain_motion has no function design",
    ),
    (
        state_file("components: {c_thruster_1: recoverd}\n"),
        "state.yaml: ",
        "no rule mentions the c_status 'recoverd' (did you mean 'REC",
    ),
    (state_file("component: {}\n"), "state.yaml: ", "did you mean 'components'"),
    (state_file("components: 3\n"), "state.yaml: line 1, components: "),
    (state_file(""), "state.yaml: ", "is empty"),
    (
        rule_tests("- name: x\n  folows: []"),
        "mine.yaml: line 3, tests[0].folows: unknown key 'folows' (did you mean 'follows'?",
    ),
    (rule_tests("- name: x"), "mine.yaml: line 2, tests[0]: this test expects nothing"),
    (
        rule_tests("- name: x\n  contradiction: maybe"),
        "mine.yaml: line 3, tests[0].contradiction: ",
    ),
    (
        question("fg_status(fg_spiral_high, IN_ERROR_FR)"),
        "does not follow in this state (fg_status of fg_spiral_high: IN_E",
    ),
    (
        question("fg_status(fg_spiral_hi, IN_ERROR_FR)"),
        "there is no individual 'fg_spiral_hi' (did you mean fg_spiral_high?",
    ),
    (
        question("why fd_spiral_lo?"),
        "there is no function design 'fd_spiral_lo' (did you mean 'fd_spiral_low'",
    ),
    (
        question("fg_statu(fg_spiral_high, IN_ERROR_FR)"),
        "there is no property 'fg_statu' (did you mean fg_status?",
    ),
    (question("because"), "'because' is not a question about a state"),
    (question("fg_status("), "is not a fact"),
    (query("SELECT WHERE"), "not a SPARQL query"),
    (query(""), "not a SPARQL query"),
    (
        query("SELECT ?s WHERE { ?s nowhere:is ?o }"),
        "not a SPARQL query: Unknown namespace prefix : nowhere",
    ),
    (query("DELETE WHERE { ?s ?p ?o }"), "not a SPARQL query"),
    (
        query("SELECT ?s WHERE { SERVICE <http://example.org/> { ?s ?p ?o } }"),
        "SERVICE and FROM read from other sources",
    ),
    (
        query("SELECT ?s FROM <http://example.org/> WHERE { ?s ?p ?o }"),
        "SERVICE and FROM read from other sources",
    ),
    (
        edit(lambda path: add_rules(path, "A: Objective(?o -> Role(?o)")),
        "the rule: line 1, column 17",
    ),
    (edit(lambda path: add_rules(path, "A: Objective(?o) -> Role(?p)")), "?p occurs in the head"),
    (
        edit(lambda path: add_rules(path, "QAWaterVisibility: Objective(?o) -> Role(?o)")),
        "there is a rule QAWaterVisibility already",
    ),
    (edit(lambda path: add_rules(path, "")), "0 rules instead of one"),
    (
        edit(lambda path: remove_rule(path, "QAWaterVisibilty")),
        "did you mean QAWaterVisibility?",
    ),
    (edit(lambda path: set_enabled(path, "S1a", enabled=False)), "there is no rule S1a"),
    (policy_of_many_states, "kinds of states, which is too many"),
    (why_not("compEror"), "did you mean 'compError'"),
]


@pytest.mark.parametrize("row", REFUSALS, ids=lambda row: row[-1])
def test_what_is_refused_is_told_in_one_line(knowledge, tmp_path, row):
    given, *said = row
    with pytest.raises(InputError) as error:
        given(knowledge, tmp_path)
    for part in said:
        assert part in str(error.value)
    assert "\n" not in str(error.value)
