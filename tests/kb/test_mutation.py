"""kb test --mutate and --coverage: which mistakes tests notice, what they cover, and the least that
covers the rest.
"""

import random
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest

from suave_des import run_mission
from suave_des.kb import adequacy
from suave_des.kb.adequacy import (
    Goal,
    Mutant,
    is_horn,
    measure_coverage,
    mutants_of,
    mutate,
    sample,
)
from suave_des.kb.effects import interchangeable_components
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.rule_tests import RuleTest, TestFile, run_test, shipped_tests
from suave_des.kb.situations import Situation, difference
from suave_des.kb.space import PolicySpace, States
from suave_des.knowledge.ontology import Ontology
from tests.helpers.knowledge_states import FEWER_NUMBERS
from tests.helpers.owl_text import SUAVE, individual

SEARCH = "f_generate_search_path"
OWL_CLASSES = f"""
<owl:Class rdf:about="{SUAVE}Warm"/><owl:Class rdf:about="{SUAVE}Cold"/>
<rdf:Description rdf:about="{SUAVE}c_thruster_1"><rdf:type><owl:Class><owl:unionOf rdf:parseType="Collection">
<owl:Class rdf:about="{SUAVE}Warm"/><owl:Class rdf:about="{SUAVE}Cold"/></owl:unionOf></owl:Class></rdf:type>
</rdf:Description>
"""


def read_tests(tmp_path: Path, knowledge: KnowledgeBase, text: str) -> list[RuleTest]:
    (tmp_path / "tests.yaml").write_text(text, encoding="utf-8")
    return list(TestFile.read(tmp_path / "tests.yaml").tests(knowledge))


def file(tmp_path: Path, text: str, name: str = "own.swrl") -> Path:
    (tmp_path / name).write_text(text + "\n", encoding="utf-8")
    return tmp_path / name


def mutant(knowledge: KnowledgeBase, name: str, text: str) -> Mutant:
    (found,) = (
        each for each in mutants_of(knowledge.base) if each.name == name and each.text == text
    )
    return found


NOTHING_WRONG = f"""
tests:
- name: high visibility
  given: {{groundings: {{{SEARCH}: fd_spiral_high}}, measurements: {{water_visibility: 4.0}}}}
  follows_not: ["fg_status(fg_spiral_high, IN_ERROR_NFR)"]
"""
LOW_AND_HIGH = f"""{NOTHING_WRONG}
- name: low visibility
  given: {{groundings: {{{SEARCH}: fd_spiral_high}}, measurements: {{water_visibility: 2.0}}}}
  follows: ["fg_status(fg_spiral_high, IN_ERROR_NFR)"]
"""


def test_a_mutant_may_depend_on_an_attribute_on_which_the_rule_does_not(tmp_path, suave_copy):
    """Without isQAtype the rule is about the current, too, which the original does not depend
    on.
    """
    ontology = suave_copy(
        individual("water_current", "QualityAttributeType", ("qa_comparison_operator", ">"))
    )
    file(
        tmp_path,
        "base: seams2023\nsignals:\n  water_current: {kind: constant, value: 0.05}",
        "both.yaml",
    )
    rule = "isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.1)"
    rules = file(tmp_path, f"own: {rule} -> fd_realisability(fd_spiral_high, false)")
    knowledge = KnowledgeBase.load(
        [ontology],
        scenario=tmp_path / "both.yaml",
        rules=rules,
        disabled_rules=["QAWaterVisibility"],
    )
    assert "water_current" not in PolicySpace.of(knowledge.base, knowledge.settings).attributes
    dropped = mutant(knowledge, "own", "isQAtype(?q, water_visibility) is left out")
    (found,), _ = mutate(
        knowledge, read_tests(tmp_path, knowledge, NOTHING_WRONG), [dropped], max_failed=0
    )
    assert found.result == adequacy.SURVIVED and found.state is not None
    measured = dict(found.state.measurements)
    assert (
        measured["water_current"] < Decimal("0.1") <= measured.get("water_visibility", Decimal(1))
    )


def test_where_an_axiom_leaves_a_choice_rules_matter_that_never_fire(tmp_path, suave_copy):
    """Thruster 1 is Warm or Cold, nobody knows which: what follows from both follows."""
    rules = file(
        tmp_path,
        'warm: Warm(?c) ^ c_status(?c, "FALSE") -> fd_realisability(fd_spiral_high, false)\n'
        'cold: Cold(?c) ^ c_status(?c, "FALSE") -> fd_realisability(fd_spiral_high, false)',
    )
    knowledge = KnowledgeBase.load([suave_copy(OWL_CLASSES)], rules=rules, values=FEWER_NUMBERS)
    assert not is_horn(knowledge.base) and is_horn(KnowledgeBase.load().base)
    removed = mutant(knowledge, "warm", "the rule is removed")
    follows = f"""
tests:
- name: never high
  given: {{groundings: {{{SEARCH}: fd_spiral_low}}, components: {{c_thruster_1: "FALSE"}}}}
  follows: ["fd_realisability(fd_spiral_high, false)"]
"""
    tests = read_tests(tmp_path, knowledge, follows)
    assert run_test(knowledge, tests[0]).passed
    assert mutate(knowledge, tests, [removed], max_failed=0)[0][0].result == adequacy.KILLED
    (found,), _ = mutate(
        knowledge, read_tests(tmp_path, knowledge, NOTHING_WRONG), [removed], max_failed=1
    )
    assert found.result == adequacy.SURVIVED and found.state is not None
    assert dict(found.state.components) == {"c_thruster_1": "FALSE"}


@pytest.mark.parametrize(
    ("ontology", "rule"),
    [
        (individual("c_thruster_3", "Component", ("mros:requiredBy", ":fd_spiral_high")), ""),
        ("", 'own: c_status(c_thruster_3, "FALSE") -> fd_realisability(fd_spiral_high, false)'),
        (OWL_CLASSES.replace("c_thruster_1", "c_thruster_3"), ""),
    ],
    ids=["a fact", "a rule", "an axiom"],
)
def test_components_of_which_more_is_said_are_not_exchangeable(
    tmp_path, suave_copy, ontology, rule
):
    rules = [file(tmp_path, rule)] if rule else []
    knowledge = KnowledgeBase.load([suave_copy(ontology)], rules=rules, values=FEWER_NUMBERS)
    others = tuple(f"c_thruster_{number}" for number in (1, 2, 4, 5, 6))
    assert interchangeable_components(knowledge.base) == (others, ("c_thruster_3",))


def test_a_threshold_of_0_is_moved_to_either_side(tmp_path):
    rules = file(
        tmp_path,
        "own: hasValue(?q, ?v) ^ lessThan(?v, 0) -> fd_realisability(fd_spiral_high, false)",
    )
    knowledge = KnowledgeBase.load(rules=rules)
    moved = {
        each.text
        for each in mutants_of(knowledge.base)
        if each.name == "own" and each.operator == "threshold moved"
    }
    becomes = "lessThan(?v, 0) becomes lessThan(?v, {})"
    assert moved == {becomes.format("-0.1"), becomes.format("0.1")}


# The expected performance is the same number as the expected visibility here, so that isQAtype
# changes nothing.
EQUIVALENT_ONES = {
    "QAWaterVisibility: atom dropped: FunctionGrounding(?fg) is left out",
    "QAWaterVisibility: atom dropped: isQAtype(?eqa, water_visibility) is left out",
    "QAWaterVisibility: atom dropped: isQAtype(?mqa, water_visibility) is left out",
    "QAWaterVisibility: variable exchanged: isQAtype(?eqa, water_visibility) becomes isQAtype(?mqa, water_visibility)",
}


@pytest.mark.slow
def test_equivalent_mutants_of_a_rule_are_known_by_name_and_infer_the_same_in_random_states(
    tmp_path, small
):
    knowledge = small
    of_rule = [each for each in mutants_of(knowledge.base) if each.name == "QAWaterVisibility"]
    results, _ = mutate(
        knowledge, read_tests(tmp_path, knowledge, NOTHING_WRONG), of_rule, max_failed=1
    )
    equivalent = [each.mutant for each in results if each.result == adequacy.EQUIVALENT]
    assert set(map(str, equivalent)) == EQUIVALENT_ONES
    draw = random.Random(7)
    space = PolicySpace.of(knowledge.base, knowledge.settings)
    every = list(States.of(knowledge.base, knowledge.settings, 1, space))
    states = [
        replace(
            state,
            measurements=(("water_visibility", Decimal(str(round(draw.uniform(0.5, 4.5), 3)))),),
        )
        for state in draw.sample(every, 50)
    ]
    for each in equivalent:
        changed = knowledge.changed(each.applied(knowledge.base))
        for state in states:
            one, other = knowledge.outcome(Situation(state)), changed.outcome(Situation(state))
            assert (one.inferred, one.changes) == (other.inferred, other.changes), (
                f"{each}: {state}"
            )


def test_stays_is_not_any_design_and_a_fact_that_follows_is_not_absent(tmp_path, knowledge):
    given = f"given: {{groundings: {{{SEARCH}: fd_spiral_low}}, measurements: {{water_visibility: 2.0}}}}"
    text = "tests:\n" + "".join(
        f"- name: {wanted}\n  {given}\n  decides: {{{SEARCH}: {wanted}}}\n"
        for wanted in ("stays", "fd_spiral_low", "fd_spiral_medium", "fd_spiral_high", "none left")
    )
    low = f"given: {{groundings: {{{SEARCH}: fd_spiral_high}}, measurements: {{water_visibility: 2.0}}}}"
    text += f'- name: not\n  {low}\n  follows_not: ["fg_status(fg_spiral_high, IN_ERROR_NFR)"]\n'
    text += f'- name: does\n  {low}\n  follows: ["fg_status(fg_spiral_high, IN_ERROR_NFR)"]\n'
    text += f"- name: replaced\n  {low}\n  decides: {{{SEARCH}: fd_spiral_high}}\n"
    text += f"- name: asserted\n  {low}\n  follows_not: [FunctionGrounding(fg_spiral_high)]\n"
    passed = {
        test.name: run_test(knowledge, test).passed
        for test in read_tests(tmp_path, knowledge, text)
    }
    assert passed == {
        "stays": True,
        "fd_spiral_low": True,
        "fd_spiral_medium": False,
        "fd_spiral_high": False,
        "none left": False,
        "not": False,
        "does": True,
        "replaced": False,
        "asserted": False,
    }


def test_a_mutant_that_no_longer_contradicts_itself_is_not_equivalent(tmp_path):
    rules = file(tmp_path, 'clash: fg_status(?g, "IN_ERROR_NFR") -> fg_status(?g, "IN_ERROR_FR")')
    knowledge = KnowledgeBase.load(rules=rules, values=FEWER_NUMBERS)
    (found,), _ = mutate(
        knowledge, [], [mutant(knowledge, "clash", "the rule is removed")], max_failed=0
    )
    assert (found.result, found.reason) == (adequacy.SURVIVED, "it no longer contradicts itself")


@pytest.mark.slow
def test_a_state_covers_that_an_atom_fails_only_where_those_before_it_hold(tmp_path, suave_copy):
    rule = 'own: Component(?c) ^ c_status(?c, "FALSE") ^ requiredBy(?c, ?fd) -> fd_realisability(?fd, false)'
    disabled = [each.name for each in KnowledgeBase.load().base.rules]
    lamp = suave_copy(individual("c_lamp", "Component"))
    knowledge = KnowledgeBase.load(
        lamp, rules=file(tmp_path, rule), disabled_rules=disabled, values=FEWER_NUMBERS
    )

    def covered(**components: str) -> set[Goal]:
        state = knowledge.state(objectives=[SEARCH], components=components)
        return set(measure_coverage(knowledge, [Situation(state)], max_failed=1).covered)

    # Nobody reports: there are components, of which none is FALSE. requiredBy is not even asked.
    assert covered() == {
        Goal("own", -1, "does not fire"),
        Goal("own", 0, "holds"),
        Goal("own", 1, "fails"),
    }
    assert covered(c_thruster_1="FALSE") == {
        Goal("own", -1, "fires"),
        *(Goal("own", number, "holds") for number in range(3)),
    }
    # Nothing requires the lamp. That thrusters are required does not count.
    assert covered(c_lamp="FALSE") == {
        Goal("own", -1, "does not fire"),
        *(
            Goal("own", number, outcome)
            for number, outcome in enumerate(("holds", "holds", "fails"))
        ),
    }


def test_each_operator_makes_mutants_of_the_shipped_rules(knowledge):
    found = mutants_of(knowledge.base)
    # They have no numbers.
    assert {mutant.operator for mutant in found} == set(adequacy.MUTATION_OPERATORS) - {
        "threshold moved"
    }
    assert len(sample(found, 10)) == 10
    assert [str(each) for each in mutants_of(Ontology.load())] == [str(each) for each in found]


def test_a_sample_is_spread_over_all_mutants():
    assert sample("abcdefghijk", 3) == ("a", "d", "h")
    assert sample("abc", 3) == sample("abc", None) == ("a", "b", "c")


@pytest.mark.parametrize(
    "operator", [each for each in adequacy.MUTATION_OPERATORS if each != "threshold moved"]
)
def test_a_mutant_is_a_knowledge_base_that_pellet_takes(knowledge, operator):
    mutant = next(each for each in mutants_of(knowledge.base) if each.operator == operator)
    state = knowledge.state(
        groundings={"f_generate_search_path": "fd_spiral_high"},
        measurements={"water_visibility": 2},
    )
    assert (
        knowledge.changed(mutant.applied(knowledge.base)).outcome(Situation(state)).reasoning
        is not None
    )


def test_mutants_are_killed_proved_equivalent_or_survive_with_a_state_that_tells_them_apart(
    tmp_path, small
):
    chosen = {
        "lessThan(?measured, ?expected) becomes greaterThan(?measured, ?expected)": adequacy.KILLED,
        "lessThan(?measured, ?expected) becomes lessThanOrEqual(?measured, ?expected)": adequacy.SURVIVED,
        "FunctionGrounding(?fg) is left out": adequacy.EQUIVALENT,
        "the rule is removed": adequacy.KILLED,
    }
    mutants = [
        each
        for each in mutants_of(small.base)
        if each.name == "QAWaterVisibility" and each.text in chosen
    ]
    results, _ = mutate(small, read_tests(tmp_path, small, LOW_AND_HIGH), mutants, max_failed=0)
    assert {each.mutant.text: each.result for each in results} == chosen
    for found in (each for each in results if each.state is not None):
        situation = Situation(found.state)
        changed = small.changed(found.mutant.applied(small.base))
        assert difference(small.outcome(situation), changed.outcome(situation)) == found.reason


@pytest.mark.parametrize("all_rules", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_coverage_names_what_is_missing_and_states_for_it(tmp_path, knowledge, all_rules):
    tests = read_tests(tmp_path, knowledge, LOW_AND_HIGH)
    if not all_rules:  # what fires depends on these two alone
        others = {rule.name for rule in knowledge.base.rules} - {"QAWaterVisibility", "S10"}
        knowledge = KnowledgeBase.load(disabled_rules=sorted(others), values=FEWER_NUMBERS)
    situations = [situation for test in tests for situation in test.situations]
    counted: list[tuple[int, int]] = []
    coverage = measure_coverage(
        knowledge, situations, max_failed=0, on_count=lambda *count: counted.append(count)
    )
    states = len(counted)
    assert states > 10 and counted == [(number, states) for number in range(states)]
    fired, not_fired = (
        Goal("QAWaterVisibility", -1, outcome) for outcome in (adequacy.FIRES, adequacy.FIRES_NOT)
    )
    assert (coverage.covered[fired], coverage.covered[not_fired]) == (1, 1)
    assert "equal" in {
        goal.outcome for goal in coverage.missing if goal.rule == "QAWaterVisibility"
    }
    fires = Goal("S10", -1, adequacy.FIRES)
    assert fires not in coverage.missing and fires not in coverage.covered
    proposed = [Situation(state) for state, _ in coverage.proposed]
    assert not measure_coverage(knowledge, [*situations, *proposed], max_failed=0).missing


def test_decisions_of_a_recorded_mission_become_tests_that_pass(tmp_path, command, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_mission("seams2023", "metacontrol", 1, 1, tmp_path / "flown")
    status, out, _ = command(
        "test", "--from-mission", tmp_path / "flown", "--write", tmp_path / "flown.yaml"
    )
    assert status == 0
    assert "tests are in" in out
    status, out, _ = command("test", tmp_path / "flown.yaml")
    assert status == 0
    text = (tmp_path / "flown.yaml").read_text(encoding="utf-8")
    (tmp_path / "flown.yaml").write_text(
        text.replace("fd_spiral_low, f_m", "fd_spiral_high, f_m"), encoding="utf-8"
    )
    assert command("test", tmp_path / "flown.yaml")[0] == 1


@pytest.mark.slow
def test_the_shipped_tests_kill_the_mutants_of_the_shipped_rules(knowledge):
    tests = [test for file in shipped_tests() for test in TestFile.read(file).tests(knowledge)]
    assert all(run_test(knowledge, test).passed for test in tests)
    results, _ = mutate(knowledge, tests, sample(mutants_of(knowledge.base), 100), max_failed=1)
    survivors = [str(each.mutant) for each in results if each.result == adequacy.SURVIVED]
    assert len(survivors) <= 0.05 * sum(each.result != adequacy.EQUIVALENT for each in results), (
        survivors
    )


def test_the_share_of_mutants_killed_does_not_count_those_that_change_nothing(knowledge):
    mutants = mutants_of(knowledge.base)[:4]
    kinds = (adequacy.KILLED, adequacy.KILLED, adequacy.SURVIVED, adequacy.EQUIVALENT)
    results = [adequacy.MutantResult(*each, "") for each in zip(mutants, kinds, strict=True)]
    title = adequacy.mutation_table(results).title
    assert title == "mutation: 2 of 3 mutants killed, 67%; 1 equivalent"
