"""kb why-not: why a rule does not fire, in one line."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from suave_des.errors import InputError
from suave_des.kb.matching import Probes
from suave_des.kb.space import Situation
from suave_des.kb.why_not import RuleQuestions
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import KnowledgeState
from suave_des.scenario.loader import load_scenario
from suave_des.scenario_knowledge import open_base
from tests.helpers.number_ontology import NS, NUMBERS, numbers_ontology
from tests.helpers.rule_questions import CASES, answered

SEARCH = "f_generate_search_path"


@pytest.fixture(scope="module")
def probes(knowledge):
    return Probes(knowledge.base, knowledge.limit, [rule.body for rule in knowledge.base.rules])


@pytest.mark.parametrize("name", CASES)
def test_recurring_questions_are_answered_in_one_line(name, suave_copy, tmp_path):
    found = answered(name, suave_copy(CASES[name][2]), tmp_path)
    assert "\n" not in found
    assert CASES[name][3] in found


def test_a_rule_that_is_not_there_is_refused_with_the_nearest_name(knowledge):
    with pytest.raises(InputError, match="did you mean 'compError'"):
        RuleQuestions(knowledge.base).why_not("compEror", knowledge.state())


def test_numbers_match_where_they_do_in_pellet(tmp_path):
    base = numbers_ontology(tmp_path)
    found = Reasoner(base, "pellet", terms=base.content.all_terms()).analyze(KnowledgeState()).facts
    questions, rules = RuleQuestions(base), {rule.name: rule for rule in base.rules}
    answers = {
        (thing, name)
        for name, thing in itertools.product(NUMBERS, repeat=2)
        if questions.of(rules[f"is_{name}"], KnowledgeState(), {"x": NS + thing}).fires
    }
    assert answers == {(fact.subject, fact.value) for fact in found if fact.property == "is" and fact.value != "sum"}


def test_a_rule_of_an_ontology_that_pellet_would_drop_spoils_no_other_answer(knowledge, suave_copy):
    from tests.helpers.owl_text import rule

    broken = rule(
        "broken", "QAvalue(?q) ^ hasValue(?q, ?v) ^ lessThn(?v, 3.0) -> fd_realisability(:fd_spiral_high, false)"
    )
    questions = RuleQuestions(open_base(load_scenario("seams2023", ontologies=[suave_copy(broken)])))
    assert "there is no builtin lessThn in Pellet" in str(questions.why_not("broken", knowledge.state()))
    assert "it fires" in str(questions.why_not("compRecov", knowledge.state(components={"c_thruster_2": "RECOVERED"})))


def test_the_command_takes_states_by_name_by_file_and_from_a_mission(command, tmp_path):
    state = tmp_path / "state.yaml"
    state.write_text("groundings: {f_generate_search_path: fd_spiral_high}\n", encoding="utf-8")
    status, out, _ = command("why-not", "QAWaterVisibility", "--at", state, "--at", "water_visibility=3.4")
    assert status == 0
    assert out.endswith("found 3.4 (?measured), needed less than 3.25 (?expected)\n")
    status, _, said = command("why-not", "S1a", "--at", "water_visibilty=3.4")
    assert status == 2
    assert "did you mean 'water_visibility'" in said


@settings(max_examples=10)
@given(
    design=st.sampled_from(["fd_spiral_low", "fd_spiral_medium", "fd_spiral_high"]),
    statuses=st.lists(st.sampled_from(["FALSE", "RECOVERED"]), max_size=2),
    visibility=st.sampled_from(["1", "1.25", "2.25", "3.2", "4"]),
)
def test_a_rule_fires_where_pellet_says_so(knowledge, probes, design, statuses, visibility):
    state = knowledge.state(
        groundings={SEARCH: design},
        components={f"c_thruster_{n}": status for n, status in enumerate(statuses, start=1)},
        measurements={"water_visibility": visibility},
    )
    holding = probes.holding(Situation(state))
    questions = RuleQuestions(knowledge.base)
    answers = {rule.name: questions.of(rule, state).fires for rule in knowledge.base.rules}
    assert answers == {rule.name: rule.body in holding for rule in knowledge.base.rules}
