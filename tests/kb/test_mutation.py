"""kb test --mutate and --coverage: which mistakes tests notice, what they cover, and the least that
covers the rest.
"""

import random
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from suave_des import run_mission
from suave_des.kb import adequacy
from suave_des.kb.adequacy import (
    Coverage,
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
from tests.helpers.command import command_here
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


@pytest.fixture(scope="module")
def equivalent(tmp_path_factory: pytest.TempPathFactory, small) -> list[Mutant]:
    """The mutants of QAWaterVisibility that are proved equivalent."""
    of_rule = [each for each in mutants_of(small.base) if each.name == "QAWaterVisibility"]
    tests = read_tests(tmp_path_factory.mktemp("equivalent"), small, NOTHING_WRONG)
    results, _ = mutate(small, tests, of_rule, max_failed=1)
    return [each.mutant for each in results if each.result == adequacy.EQUIVALENT]


@pytest.mark.slow
def test_mutants_that_are_known_to_be_equivalent_are_proved_so(equivalent):
    assert set(map(str, equivalent)) == EQUIVALENT_ONES


@pytest.mark.slow
def test_equivalent_mutants_infer_the_same_in_random_states(equivalent, small):
    knowledge = small
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
    assert equivalent
    for each in equivalent:
        changed = knowledge.changed(each.applied(knowledge.base))
        for state in states:
            one, other = knowledge.outcome(Situation(state)), changed.outcome(Situation(state))
            assert (one.inferred, one.changes) == (other.inferred, other.changes), (
                f"{each}: {state}"
            )


LOW_STAYS, HIGH_FALLS = (
    f"given: {{groundings: {{{SEARCH}: {design}}}, measurements: {{water_visibility: 2.0}}}}"
    for design in ("fd_spiral_low", "fd_spiral_high")
)
IN_ERROR = '["fg_status(fg_spiral_high, IN_ERROR_NFR)"]'


@pytest.mark.parametrize(
    ("given", "expected", "passes"),
    [
        (LOW_STAYS, f"decides: {{{SEARCH}: stays}}", True),
        (LOW_STAYS, f"decides: {{{SEARCH}: fd_spiral_low}}", True),
        (LOW_STAYS, f"decides: {{{SEARCH}: fd_spiral_medium}}", False),
        (LOW_STAYS, f"decides: {{{SEARCH}: fd_spiral_high}}", False),
        (LOW_STAYS, f"decides: {{{SEARCH}: none left}}", False),
        (HIGH_FALLS, f"follows_not: {IN_ERROR}", False),
        (HIGH_FALLS, f"follows: {IN_ERROR}", True),
        (HIGH_FALLS, f"decides: {{{SEARCH}: fd_spiral_high}}", False),
        (HIGH_FALLS, "follows_not: [FunctionGrounding(fg_spiral_high)]", False),
    ],
    ids=[
        "stays",
        "the present design",
        "another design",
        "a higher design",
        "none left",
        "a fact that follows is not absent",
        "a fact that follows",
        "the design that is replaced",
        "a fact of the state is not absent",
    ],
)
def test_a_test_passes_if_all_is_as_it_expects(tmp_path, knowledge, given, expected, passes):
    text = f"tests:\n- name: it\n  {given}\n  {expected}\n"
    (test,) = read_tests(tmp_path, knowledge, text)
    assert run_test(knowledge, test).passed is passes


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


@pytest.fixture(scope="module", params=[False, pytest.param(True, marks=pytest.mark.slow)])
def base(request: pytest.FixtureRequest, knowledge) -> KnowledgeBase:
    if request.param:
        return knowledge
    # what fires depends on these two alone
    others = {rule.name for rule in knowledge.base.rules} - {"QAWaterVisibility", "S10"}
    return KnowledgeBase.load(disabled_rules=sorted(others), values=FEWER_NUMBERS)


@pytest.fixture(scope="module")
def situations(tmp_path_factory, knowledge) -> list[Situation]:
    tests = read_tests(tmp_path_factory.mktemp("coverage"), knowledge, LOW_AND_HIGH)
    return [situation for test in tests for situation in test.situations]


@pytest.fixture(scope="module")
def counted(base, situations) -> tuple[Coverage, list[tuple[int, int]]]:
    """The coverage, and the counts that were told while it was measured."""
    counts: list[tuple[int, int]] = []
    coverage = measure_coverage(
        base, situations, max_failed=0, on_count=lambda *count: counts.append(count)
    )
    return coverage, counts


class TestCoverage:
    """What tests of one rule cover, and what is proposed to cover the rest."""

    def test_each_state_is_counted_while_it_is_measured(self, counted):
        counts, states = counted[1], len(counted[1])
        assert states > 10 and counts == [(number, states) for number in range(states)]

    @pytest.mark.parametrize("outcome", [adequacy.FIRES, adequacy.FIRES_NOT])
    def test_a_rule_is_covered_by_the_test_in_which_it_fires_or_does_not(self, counted, outcome):
        assert counted[0].covered[Goal("QAWaterVisibility", -1, outcome)] == 1

    def test_a_value_on_the_threshold_is_missing(self, counted):
        missing = counted[0].missing
        assert "equal" in {goal.outcome for goal in missing if goal.rule == "QAWaterVisibility"}

    def test_a_rule_that_fires_in_no_state_is_neither_missing_nor_covered(self, counted):
        fires = Goal("S10", -1, adequacy.FIRES)
        assert fires not in counted[0].missing and fires not in counted[0].covered

    def test_with_the_proposed_states_nothing_is_missing(self, base, situations, counted):
        proposed = [Situation(state) for state, _ in counted[0].proposed]
        assert not measure_coverage(base, [*situations, *proposed], max_failed=0).missing


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, CompletedProcess[str]]:
    """A folder with tests of a recorded mission, and what the command that wrote them printed."""
    folder = tmp_path_factory.mktemp("recorded")
    run_mission("seams2023", "metacontrol", 1, 1, folder / "flown")
    words = ("kb", "test", "--from-mission", "flown", "--write", "flown.yaml")
    return folder, command_here(*words, cwd=folder)


def test_the_command_says_where_the_tests_of_a_recorded_mission_are(recorded):
    _, ended = recorded
    assert (ended.returncode, "tests are in" in ended.stdout) == (0, True)


def test_decisions_of_a_recorded_mission_are_tests_that_pass(recorded):
    folder, _ = recorded
    assert command_here("kb", "test", "flown.yaml", cwd=folder).returncode == 0


def test_another_decision_than_that_of_the_recorded_mission_fails(recorded):
    folder, _ = recorded
    text = (folder / "flown.yaml").read_text(encoding="utf-8")
    changed = text.replace("fd_spiral_low, f_m", "fd_spiral_high, f_m")
    assert changed != text
    (folder / "changed.yaml").write_text(changed, encoding="utf-8")
    assert command_here("kb", "test", "changed.yaml", cwd=folder).returncode == 1


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
