"""kb test --coverage and --mutate: what tests cover, the least that would cover the rest, and mistakes they notice."""

import textwrap

import pytest

from suave_des.knowledge.ontology import Ontology
from suave_des.workbench import KnowledgeBase
from suave_des.workbench.prover import Prover, Situation
from suave_des.workbench.testing.coverage import FIRES, Goal, least_cover, measure_coverage
from suave_des.workbench.testing.mutants import OPERATORS, mutants_of, sample
from suave_des.workbench.testing.mutation import EQUIVALENT, KILLED, SURVIVED, mutate
from suave_des.workbench.testing.reading import TestFile
from suave_des.workbench.testing.run import Runner
from tests.helpers.knowledge_states import FEWER_NUMBERS

TESTS = """\
tests:
- name: low visibility
  given: {groundings: {f_generate_search_path: fd_spiral_high}, measurements: {water_visibility: 2.0}}
  follows: ["fg_status(fg_spiral_high, IN_ERROR_NFR)"]
- name: high visibility
  given: {groundings: {f_generate_search_path: fd_spiral_high}, measurements: {water_visibility: 4.0}}
  follows_not: ["fg_status(fg_spiral_high, IN_ERROR_NFR)"]
"""


@pytest.fixture(scope="module")
def tests(tmp_path_factory, bench):
    path = tmp_path_factory.mktemp("tests") / "mine.yaml"
    path.write_text(TESTS, encoding="utf-8")
    return TestFile.read(path).tests(bench)


def test_each_operator_makes_mutants_of_the_shipped_rules(bench):
    found = mutants_of(bench.base)
    assert {mutant.operator for mutant in found} == set(OPERATORS)
    assert len(OPERATORS) >= 8
    assert len(sample(found, 10)) == 10
    assert [str(each) for each in mutants_of(Ontology.load())] == [str(each) for each in found]


@pytest.mark.parametrize("operator", list(OPERATORS))
def test_a_mutant_is_a_knowledge_base_that_pellet_takes(bench, operator):
    mutant = next(each for each in mutants_of(bench.base) if each.operator == operator)
    state = bench.state(groundings={"f_generate_search_path": "fd_spiral_high"}, measurements={"water_visibility": 2})
    assert Prover.of(bench, mutant.applied(bench.base)).outcome(Situation(state)).conclusion is not None


def test_mutants_are_killed_proved_equivalent_or_survive_with_a_state_that_tells_them_apart(small_bench, tests):
    bench = small_bench
    chosen = {
        "lessThan(?measured, ?expected) becomes greaterThan(?measured, ?expected)": KILLED,
        "lessThan(?measured, ?expected) becomes lessThanOrEqual(?measured, ?expected)": SURVIVED,
        "FunctionGrounding(?fg) is left out": EQUIVALENT,
        "the rule is removed": KILLED,
    }
    of_rule = [each for each in mutants_of(bench.base) if each.name == "QAWaterVisibility" and each.text in chosen]
    of_data = [each for each in mutants_of(bench.base) if each.text == "hasValue 3.25 becomes 3.575"]
    report = mutate(bench, tests, [*of_rule, *of_data], max_failed=0)
    assert {each.mutant.text: each.result for each in report.verdicts} == {**chosen, of_data[0].text: SURVIVED}
    assert report.score == 0.5
    for verdict in report.of(SURVIVED):
        changed = Prover.of(bench, verdict.mutant.applied(bench.base)).outcome(Situation(verdict.state))
        original = Prover.of(bench).outcome(Situation(verdict.state))
        assert (changed.inferred, changed.changes) != (original.inferred, original.changes)


@pytest.mark.parametrize("all_rules", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_coverage_names_what_is_missing_and_the_least_set_of_states_for_it(bench, tests, all_rules):
    if not all_rules:  # what fires depends on these two alone
        others = {rule.name for rule in bench.base.rules} - {"QAWaterVisibility", "S10"}
        bench = KnowledgeBase.load(disabled_rules=sorted(others), values=FEWER_NUMBERS)
    situations = [situation for test in tests for situation in test.situations]
    coverage = measure_coverage(bench, situations, max_failed=0)
    rules = {each.rule: each for each in coverage.rules}
    assert (rules["QAWaterVisibility"].fired, rules["QAWaterVisibility"].not_fired) == (1, 1)
    assert "equal" in {goal.outcome for goal in rules["QAWaterVisibility"].missing}
    assert Goal("S10", -1, FIRES) in rules["S10"].unreachable
    proposed = [Situation(state) for state, _ in coverage.proposed]
    again = measure_coverage(bench, [*situations, *proposed], max_failed=0)
    assert again.covered == again.reachable == coverage.reachable


def test_the_set_that_covers_all_is_the_least():
    one, two, three = (Goal("r", number, "holds") for number in range(3))
    sets = {"a": {one, two}, "b": {two, three}, "c": {three}, "d": {one}}
    assert len(least_cover({name: frozenset(goals) for name, goals in sets.items()})) == 2


def test_decisions_of_a_recorded_mission_become_tests_that_pass(tmp_path, command, monkeypatch):
    from suave_des.campaign.single import run_mission

    monkeypatch.chdir(tmp_path)
    run_mission("seams2023", "metacontrol", 1, 1, tmp_path / "flown")
    status, out, _ = command("test", "--from-mission", tmp_path / "flown", "--write", tmp_path / "flown.yaml")
    assert status == 0
    assert "tests are in" in out
    status, out, _ = command("test", tmp_path / "flown.yaml")
    assert status == 0
    text = (tmp_path / "flown.yaml").read_text(encoding="utf-8")
    (tmp_path / "flown.yaml").write_text(text.replace("fd_spiral_low, f_m", "fd_spiral_high, f_m"), encoding="utf-8")
    assert command("test", tmp_path / "flown.yaml")[0] == 1


@pytest.mark.slow
def test_the_shipped_tests_kill_the_mutants_of_the_shipped_rules(bench):
    from suave_des.workbench.testing.reading import shipped_tests

    tests = [test for file in shipped_tests() for test in TestFile.read(file).tests(bench)]
    assert all(Runner.of(bench).run(test).passed for test in tests)
    report = mutate(bench, tests, sample(mutants_of(bench.base), 100), max_failed=1)
    assert report.score >= 0.95, textwrap.indent("\n".join(str(each.mutant) for each in report.of(SURVIVED)), "  ")
