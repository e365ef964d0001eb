"""kb policy: exhaustive over ranges of values, right at their ends, with what is wrong marked, each decision once."""

import csv
import io
import random
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest

from suave_des.errors import InputError
from suave_des.kb import KnowledgeBase
from suave_des.kb.policy import FLIP_FLOP, Policy, PolicyCase, _with_flip_flops, function_table, make_policy
from suave_des.kb.policy_figure import draw_policy
from suave_des.kb.situations import Outcome, Situation
from suave_des.kb.space import (
    ComponentReports,
    Dependence,
    PolicySpace,
    ValueRange,
    component_reports,
    interchangeable_components,
    ranges_between,
    values_in,
)
from suave_des.kb.states import ManagingSettings
from suave_des.knowledge.state import Decision, Inference, KnowledgeState, ObjectiveState, Plan, Reasoning, exact

MOTION, SEARCH = "f_maintain_motion", "f_generate_search_path"


def holds(one, value):
    """Whether a measured value is in a range."""
    if value is None or one.is_missing:
        return one.is_missing and value is None
    above = one.low is None or value > one.low or (one.low_closed and value == one.low)
    return above and (one.high is None or value < one.high or (one.high_closed and value == one.high))


def rules_file(tmp_path, text, name="more.swrl"):
    path = tmp_path / name
    path.write_text(text)
    return path


VISIBLE = "FunctionGrounding(?fg) ^ hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v)"


def policy_between(knowledge, *numbers):
    """A policy without failures, that tells measured values apart by few numbers: the fewer, the less to infer."""
    space = replace(PolicySpace.of(knowledge.base, knowledge.settings), numbers=tuple(map(Decimal, numbers)))
    return make_policy(knowledge.base, knowledge.settings, knowledge.outcome, 0, space)


@pytest.fixture(scope="module")
def policy(knowledge):
    return knowledge.policy(max_failed=1)


class TestRanges:
    def test_cover_every_number_once(self):
        ranges = ranges_between([Decimal(1), Decimal("2.5")])
        for value in (None, *map(Decimal, ("-3", "0.99", "1", "1.01", "2.4", "2.5", "2.51", "9"))):
            assert sum(holds(one, value) for one in ranges) == 1
        assert list(map(str, ranges)) == ["not measured", "< 1", "1", "1 < . < 2.5", "2.5", "> 2.5"]

    def test_have_a_value_of_their_own(self):
        for one in ranges_between([Decimal(1), Decimal("2.5")]):
            assert holds(one, one.value())

    def test_two_values_in_one_open_range_come_in_every_order(self):
        between = ValueRange(Decimal(1), Decimal(2))
        orders = {(one > other) - (one < other) for one, other in values_in([between, between])}
        assert orders == {-1, 0, 1}
        assert all(holds(between, value) for values in values_in([between, between]) for value in values)
        assert list(values_in([ValueRange(is_missing=True)] * 2)) == [(None, None)]
        assert len(list(values_in([ValueRange(Decimal(1), Decimal(1), True, True)] * 2))) == 1


class TestInterchangeableComponents:
    def test_thrusters_are_alike(self, knowledge):
        assert interchangeable_components(knowledge.base) == (tuple(f"c_thruster_{n}" for n in range(1, 7)),)

    def test_a_rule_that_names_one_sets_it_apart(self, tmp_path):
        file = rules_file(tmp_path, 'one: c_status(c_thruster_3, "FALSE") -> fd_realisability(fd_spiral_high, false)\n')
        groups = interchangeable_components(KnowledgeBase.load(rules=[file]).base)
        assert ("c_thruster_3",) in groups
        assert len(groups) == 2

    def test_combinations_count_what_they_stand_for(self):
        found = list(component_reports([["a", "b", "c"], ["d"]], ["FALSE", "RECOVERED"], 2))
        # of 4 components none, one or two report one of two words
        assert sum(each.combinations for each in found) == 1 + 4 * 2 + 6 * 4


class TestPolicy:
    def test_says_how_many_states_it_covers(self, policy):
        # 16 ranges, 13 reports, 4 search and 3 motion groundings, or 2 follow groundings in its place
        assert policy.states == 16 * 13 * (3 * 4 + 3 * 2)
        assert len(policy.cases) == 16 * 3 * 18

    def test_any_state_is_decided_as_its_case_says(self, knowledge, policy):
        chance = random.Random(5)
        for case in chance.sample(policy.cases, 60):
            (one,) = case.ranges
            value = None if one.is_missing else one.value(chance.randrange(7), 7)
            assert holds(one, value)
            others = [f"c_thruster_{n}" for n in range(1, 7)]
            chance.shuffle(others)
            state = knowledge.state(
                objectives=case.asked,
                groundings=dict(case.state.groundings),
                components={name: status for name, (_, status) in zip(others, case.reports.components, strict=False)},
                measurements={} if value is None else {"water_visibility": exact(value)},
            )
            reasoning = knowledge.infer(state)
            assert reasoning.changes == case.decided.changes
            assert tuple(sorted(reasoning.statuses)) == case.decided.statuses

    def test_the_search_table_has_the_deployed_thresholds(self, policy):
        table = function_table(policy, SEARCH)
        assert table.attributes == ("water_visibility",)
        assert [str(column) for (column,) in table.columns] == [
            "not measured",
            "< 1.25",
            "1.25 <= . < 2.25",
            "2.25 <= . < 3.25",
            ">= 3.25",
        ]
        from_high = next(row for row in table.rows if dict(row.groundings) == {SEARCH: "fd_spiral_high"})
        assert from_high.outcomes == ("stays", "none left", "fd_spiral_low", "fd_spiral_medium", "stays")

    def test_motion_does_not_depend_on_visibility(self, policy):
        table = function_table(policy, MOTION)
        assert table.attributes == ()
        failed = next(
            row for row in table.rows if row.components == "1 FALSE" and row.groundings == {MOTION: "fd_all_thrusters"}
        )
        assert failed.outcomes == ("fd_recover_thrusters",)

    def test_a_contradiction_is_marked_where_it_is(self, tmp_path):
        file = rules_file(tmp_path, f'clash: {VISIBLE} ^ lessThan(?v, 1.5) -> fg_status(?fg, "IN_ERROR_FR")\n')
        found = policy_between(KnowledgeBase.load(rules=[file]), "1.25", "1.5")
        marked = found.marked("inconsistent")
        assert {case.state.grounded(SEARCH) for case in marked} == {
            "fd_spiral_low", "fd_spiral_medium", "fd_spiral_high"
        }  # fmt: skip
        low = {str(case.ranges[0]) for case in marked if case.state.grounded(SEARCH) == "fd_spiral_low"}
        high = {str(case.ranges[0]) for case in marked if case.state.grounded(SEARCH) == "fd_spiral_high"}
        assert "1.25 < . < 1.5" in high - low
        assert "1.5" not in high
        for case in marked:
            assert "by the rules QAWaterVisibility (" in case.decided.contradiction
            assert ", clash (" in case.decided.contradiction

    def test_a_choice_that_alternates_is_marked(self, tmp_path):
        # Each motion design is unrealisable while it is in use.
        file = rules_file(
            tmp_path,
            "away: FunctionGrounding(?fg) ^ typeFD(?fg, ?fd) ^ solvesF(?fd, f_maintain_motion) -> "
            "fd_realisability(?fd, false)\n"
            "error: FunctionGrounding(?fg) ^ typeFD(?fg, ?fd) ^ solvesF(?fd, f_maintain_motion) -> "
            'fg_status(?fg, "IN_ERROR_FR")\n',
        )
        found = policy_between(KnowledgeBase.load(rules=[file], disabled_rules=["S9"]), "3.25")
        flipping = found.marked("flip-flop")
        assert {case.state.grounded(MOTION) for case in flipping} == {"fd_all_thrusters", "fd_recover_thrusters"}
        assert any("(flip-flop)" in outcome for row in function_table(found, MOTION).rows for outcome in row.outcomes)
        assert {case.flipping for case in flipping} == {(MOTION,)}
        others = [outcome for row in function_table(found, SEARCH).rows for outcome in row.outcomes]
        assert not any("flip-flop" in outcome for outcome in others)

    def test_a_rule_that_computes_takes_the_proof_away(self, tmp_path):
        file = rules_file(
            tmp_path, f'sum: {VISIBLE} ^ add(?w, ?v, 1) ^ lessThan(?w, 2) -> fg_status(?fg, "IN_ERROR_NFR")\n'
        )
        assert policy_between(KnowledgeBase.load(rules=[file]), "2").computing == ("sum",)

    def test_an_attribute_that_nothing_looks_at_is_left_out(self, knowledge, tmp_path):
        settings = ManagingSettings(measured=("battery_level", "water_visibility"))
        assert PolicySpace.of(knowledge.base, settings).attributes == ("water_visibility",)
        file = rules_file(
            tmp_path,
            "flat: isQAtype(?q, battery_level) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.2) -> "
            "fd_realisability(fd_spiral_high, false)\n",
        )
        assert PolicySpace.of(KnowledgeBase.load(rules=[file]).base, settings).attributes == settings.measured

    def test_too_many_states_are_refused(self, knowledge):
        many = PolicySpace(("battery_level", "energy", "water_visibility"), tuple(map(Decimal, range(40))), (), ())
        with pytest.raises(InputError, match="kinds of states, which is too many"):
            make_policy(knowledge.base, ManagingSettings(), knowledge.outcome, 9, many)


def test_it_says_how_far_it_is(knowledge):
    counts: list[tuple[int, int]] = []
    found = knowledge.policy(max_failed=0, on_count=lambda done, total: counts.append((done, total)))
    assert counts == sorted(counts)
    assert {total for _, total in counts} == {counts[-1][0]}
    assert counts[0][0] == 0 < counts[-1][0] <= len(found.cases)


def test_a_decision_flips_back_only_if_others_lead_back_to_it():
    def case(grounded, chosen=None):
        state = KnowledgeState.of([ObjectiveState(SEARCH, "OK")], groundings={SEARCH: grounded})
        plan = Plan((Decision(SEARCH, chosen, ""),) if chosen else ())
        outcome = Outcome(Reasoning(Inference(state, frozenset(), frozenset()), plan))
        return PolicyCase((), state, ComponentReports((), 1), (SEARCH,), outcome)

    cases = [case("a", "b"), case("b", "c"), case("c", "a"), case("d", "a"), case("e"), case("f", "not a state")]
    found = {dict(each.state.groundings)[SEARCH]: each for each in _with_flip_flops(cases)}
    assert {name for name, each in found.items() if FLIP_FLOP in each.marks} == {"a", "b", "c"}
    assert found["a"].flipping == (SEARCH,) and found["e"].flipping == ()


class TestFiles:
    @pytest.mark.parametrize(
        ("words", "said"),
        [(("--csv", "."), ".: is a folder (name a file"), (("--max-failed", "-1"), "--max-failed")],
    )
    def test_what_cannot_be_meant_ends_in_one_line(self, command, words, said):
        status, text, error = command("policy", *words)
        assert (status, text) == (2, "")
        assert said in error

    def test_the_csv_file_has_every_cell(self, command, tmp_path, policy):
        file, picture = tmp_path / "policy.csv", tmp_path / "policy.png"
        status, text, _ = command("policy", "--max-failed", "1", "--csv", file, "--png", picture)
        assert status == 0
        rows = list(csv.DictReader(io.StringIO(file.read_text())))
        assert sum(int(row["states"]) for row in rows) == policy.states
        row = next(
            row
            for row in rows
            if (row["water_visibility"], row[f"{SEARCH}_now"]) == ("2.25", "fd_spiral_high") and not row["components"]
        )
        assert row[f"{SEARCH}_then"] == "fd_spiral_medium"
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert f"{policy.states} states in {len(policy.cases)} equivalence classes" in text
        assert not list(tmp_path.glob(".*"))

    def test_a_picture_over_two_attributes(self, tmp_path):
        file = rules_file(
            tmp_path,
            "flat: isQAtype(?q, battery_level) ^ hasValue(?q, ?v) ^ lessThan(?v, 1) -> "
            "fd_realisability(fd_spiral_high, false)\n",
        )
        two = KnowledgeBase.load(rules=[file])
        settings = ManagingSettings(measured=("battery_level", "water_visibility"))
        space = PolicySpace(settings.measured, (Decimal(1),), (), ())
        found = make_policy(two.base, settings, two.outcome, 0, space)
        draw_policy(found, tmp_path / "two.svg")
        assert "battery level" in (tmp_path / "two.svg").read_text()
        table = function_table(found, SEARCH)
        assert table.attributes == ("battery_level", "water_visibility")

    def test_a_picture_of_another_kind_is_refused(self, policy, tmp_path):
        with pytest.raises(InputError, match=r"one of \.png"):
            draw_policy(policy, tmp_path / "policy.gif")


OF_TWO = "isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ isQAtype(?p, battery_level) ^ hasValue(?p, ?w)"
RULES = {
    "the shipped ones": "",
    "one attribute decides on another's function": (
        "own: isQAtype(?q, battery_level) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.6)"
        " -> fd_realisability(fd_spiral_high, false)"
    ),
    "two attributes are compared": f"own: {OF_TWO} ^ lessThan(?v, ?w) -> fd_realisability(fd_spiral_high, false)",
    "values of any attribute are compared with a number": (
        "own: hasValue(?q, ?v) ^ greaterThan(?v, 3.4) -> fd_realisability(fd_spiral_medium, false)"
    ),
    "values of any two are compared": (
        "own: hasValue(?q, ?v) ^ hasValue(?p, ?w) ^ greaterThan(?v, ?w) ^ isQAtype(?p, battery_level)"
        " -> fd_realisability(fd_spiral_low, false)"
    ),
    "equal values": f"own: {OF_TWO.replace('?w', '?v')} -> fd_realisability(fd_spiral_high, false)",
}


def extended(tmp_path: Path, rule: str) -> KnowledgeBase:
    if not rule:
        return KnowledgeBase.load(scenario="extended")
    (tmp_path / "own.swrl").write_text(rule + "\n", encoding="utf-8")
    return KnowledgeBase.load(scenario="extended", rules=tmp_path / "own.swrl")


def check_like_deciding_each(knowledge: KnowledgeBase, policy: Policy, most: int) -> None:
    cases = random.Random(5).sample(policy.cases, min(most, len(policy.cases)))
    for case in cases:
        alone, decided = knowledge.outcome(Situation(case.state)), case.decided
        assert (decided.statuses, decided.changes) == (alone.statuses, alone.changes), str(case.state)
        assert decided.contradiction == alone.contradiction


@pytest.mark.parametrize("rule", RULES.values(), ids=RULES)
def test_the_policy_of_two_attributes_is_that_of_deciding_each_state(tmp_path: Path, rule: str) -> None:
    knowledge = extended(tmp_path, rule)
    space = PolicySpace.of(knowledge.base, knowledge.settings)
    assert space.attributes == ("battery_level", "water_visibility")
    few = tuple(number for number in space.numbers if number < 4)[-2:]
    small = PolicySpace(space.attributes, few, space.alike, space.statuses, space.functions)
    policy = make_policy(knowledge.base, knowledge.settings, knowledge.outcome, 0, small)
    check_like_deciding_each(knowledge, policy, 80)


def test_the_policy_of_one_attribute_is_that_of_deciding_each_state(small: KnowledgeBase) -> None:
    policy = small.policy(max_failed=1)
    check_like_deciding_each(small, policy, len(policy.cases))


def test_attributes_that_no_rule_relates_count_each_for_its_own_functions(tmp_path: Path) -> None:
    for rule, are_independent in (("", True), (RULES["two attributes are compared"], False)):
        knowledge = extended(tmp_path, rule)
        depends = Dependence.of(knowledge.base, knowledge.space)
        assert (depends.regions is not None) is are_independent
        low, high = (depends.places([("battery_level", Decimal(level))]) for level in ("0.5", "0.9"))
        assert (low == high) is are_independent


@pytest.mark.slow
def test_all_states_of_the_extended_mission_are_decided_in_a_minute() -> None:
    counts: list[tuple[int, int]] = []
    policy = KnowledgeBase.load(scenario="extended").policy(2, on_count=lambda *count: counts.append(count))
    assert len(policy.cases) > 90_000
    assert counts[0][0] == 0 < counts[0][1] < len(policy.cases) / 10


def test_long_work_is_announced_before_it_begins(command, monkeypatch: pytest.MonkeyPatch) -> None:
    from suave_des.cli.kb import options

    monkeypatch.setattr(options, "_LONG_S", 0.0)
    _, _, error = command("policy", "--max-failed", "0")
    assert "102 kinds of states have to be inferred: about 1 s" in error
