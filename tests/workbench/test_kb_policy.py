"""kb policy and kb diff: exhaustive over ranges of values, right at their ends, with what is wrong marked."""

import csv
import io
import json
import random
import re
from dataclasses import replace
from decimal import Decimal

import pytest

from suave_des.errors import InputError
from suave_des.knowledge.state import exact
from suave_des.workbench import KnowledgeBase
from suave_des.workbench.policy.cases import make_policy
from suave_des.workbench.policy.figure import draw_policy
from suave_des.workbench.policy.space import (
    PolicySpace,
    component_reports,
    interchangeable_components,
)
from suave_des.workbench.policy.table import function_table
from suave_des.workbench.ranges import ValueRange, ranges_between, values_in
from suave_des.workbench.state_input import ManagingSettings
from tests.helpers.knowledge_states import FEWER_NUMBERS

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


def policy_between(bench, *numbers):
    """A policy without failures, that tells measured values apart by few numbers: the fewer, the less to infer."""
    space = replace(PolicySpace.of(bench.base, bench.settings), numbers=tuple(map(Decimal, numbers)))
    return make_policy(bench.base, bench.settings, bench.infer, 0, space)


@pytest.fixture(scope="module")
def policy(bench):
    return bench.policy(max_failed=1)


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
    def test_thrusters_are_alike(self, bench):
        assert interchangeable_components(bench.base) == (tuple(f"c_thruster_{n}" for n in range(1, 7)),)

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

    def test_any_state_is_decided_as_its_case_says(self, bench, policy):
        chance = random.Random(5)
        for case in chance.sample(policy.cases, 60):
            (one,) = case.ranges
            value = None if one.is_missing else one.value(chance.randrange(7), 7)
            assert holds(one, value)
            others = [f"c_thruster_{n}" for n in range(1, 7)]
            chance.shuffle(others)
            state = bench.state(
                objectives=case.asked,
                groundings=dict(case.state.groundings),
                components={name: status for name, (_, status) in zip(others, case.reports.components, strict=False)},
                measurements={} if value is None else {"water_visibility": exact(value)},
            )
            conclusion = bench.infer(state)
            assert tuple(conclusion.changes.items()) == case.changes
            assert tuple(sorted(conclusion.statuses)) == case.statuses

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
        assert all(
            "by the rules QAWaterVisibility (" in case.problem and ", clash (" in case.problem for case in marked
        )

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

    def test_an_attribute_that_nothing_looks_at_is_left_out(self, bench, tmp_path):
        settings = ManagingSettings(measured=("battery_level", "water_visibility"))
        assert PolicySpace.of(bench.base, settings).attributes == ("water_visibility",)
        file = rules_file(
            tmp_path,
            "flat: isQAtype(?q, battery_level) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.2) -> "
            "fd_realisability(fd_spiral_high, false)\n",
        )
        assert PolicySpace.of(KnowledgeBase.load(rules=[file]).base, settings).attributes == settings.measured

    def test_too_many_states_are_refused(self, bench):
        many = PolicySpace(("battery_level", "energy", "water_visibility"), tuple(map(Decimal, range(40))), (), ())
        with pytest.raises(InputError, match="kinds of states, which is too many"):
            make_policy(bench.base, ManagingSettings(), bench.infer, 9, many)


def test_it_says_how_far_it_is(bench):
    counts: list[tuple[int, int]] = []
    found = bench.policy(max_failed=0, on_count=lambda done, total: counts.append((done, total)))
    assert counts == sorted(counts)
    assert {total for _, total in counts} == {len(found.cases)} == {counts[-1][0]}


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
        found = make_policy(two.base, settings, two.infer, 0, space)
        draw_policy(found, tmp_path / "two.svg")
        assert "battery level" in (tmp_path / "two.svg").read_text()
        table = function_table(found, SEARCH)
        assert table.attributes == ("battery_level", "water_visibility")

    def test_a_picture_of_another_kind_is_refused(self, policy, tmp_path):
        with pytest.raises(InputError, match=r"one of \.png"):
            draw_policy(policy, tmp_path / "policy.gif")


class TestDiff:
    def test_nothing_differs_from_itself(self, bench):
        assert bench.diff(bench, max_failed=0).differing == ()

    def test_a_moved_threshold_differs_between_old_and_new_only(self, small_bench, tmp_path):
        file = rules_file(
            tmp_path, f'QAWaterVisibility: {VISIBLE} ^ lessThan(?v, 3) -> fg_status(?fg, "IN_ERROR_NFR")\n'
        )
        difference = small_bench.diff(KnowledgeBase.load(rules=[file], values=FEWER_NUMBERS), max_failed=0)
        high = [pair for pair in difference.differing if pair.one.state.grounded(SEARCH) == "fd_spiral_high"]
        assert {str(pair.one.ranges[0]) for pair in high} == {"3", "3 < . < 3.25"}
        assert {(pair.one.outcome(SEARCH), pair.other.outcome(SEARCH)) for pair in high} == {
            ("fd_spiral_medium", "stays")
        }

    def test_the_command_takes_ontologies_and_rules(self, command, edited, tmp_path):
        same = edited("")
        status, text, _ = command("diff", same, same, "--max-failed", "0")
        assert (status, text) == (0, "0 of 288 states are decided differently\n")
        file = rules_file(
            tmp_path, f'QAWaterVisibility: {VISIBLE} ^ lessThan(?v, 3) -> fg_status(?fg, "IN_ERROR_NFR")\n'
        )
        _, text, _ = command("diff", same, file, "--max-failed", "0")
        assert f"{SEARCH}, now fd_spiral_high: A fd_spiral_medium, B stays\n  3 <= . < 3.25: 6 states\n" in text
        _, printed, _ = command("diff", same, file, "--max-failed", "0", "--format", "json")
        assert json.loads(printed)["states"] == 6

    def test_an_outcome_is_told_once(self, command, edited, tmp_path):
        file = rules_file(tmp_path, "low: FunctionDesign(?d) -> fd_realisability(fd_spiral_low, false)\n")
        _, text, _ = command("diff", edited(""), file, "--max-failed", "0")
        assert f"{SEARCH}, now ungrounded: A fd_spiral_low, B none left\n  1.25 <= . < 2.25: 6 states\n" in text
        assert "none left, none left" not in text

    def test_a_function_without_designs_on_one_side_is_decided_differently(self, command, edited):
        same, without = edited(""), edited("", "without.owl")
        designs = r'(?s)<owl:NamedIndividual rdf:about="[^"]*#fd_spiral_(?:low|medium|high)">.*?</owl:NamedIndividual>'
        without.write_text(re.sub(designs, "", without.read_text()))
        for files, which, texts in (
            ((same, without), "B", "A fd_spiral_low, B none left"),
            ((without, same), "A", "A none left, B fd_spiral_low"),
        ):
            _, text, _ = command("diff", *files, "--max-failed", "0")
            assert f"{SEARCH} has no design in {which}\n" in text
            assert f"{SEARCH}, now ungrounded: {texts}\n" in text
            assert not text.startswith("0 of") and " 0 of" not in text

    def test_components_that_only_one_side_has_are_still_alike(self, bench):
        mine = PolicySpace.of(bench.base, bench.settings)
        none = replace(mine, alike=())
        assert mine.common(none).alike == none.common(mine).alike == mine.alike

    def test_a_file_that_is_missing_is_reported(self, command, edited):
        status, _, error = command("diff", edited(""), "nowhere.owl")
        assert status == 2
        assert "nowhere.owl: no such file" in error
