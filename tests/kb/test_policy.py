"""kb policy: exhaustive over ranges of values, right at their ends, with what is wrong marked, each
decision once.
"""

import csv
import io
import random
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pandas
import pytest

from suave_des.kb.deciding import kind_of
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.policy import Policy, _spans, function_table
from suave_des.kb.reports import component_reports
from suave_des.kb.scale import Scale
from suave_des.kb.situations import Situation
from suave_des.kb.space import PolicySpace, States
from suave_des.kb.states import ManagingSettings
from tests.helpers.knowledge_states import FEWER_NUMBERS
from tests.helpers.owl_text import SUAVE, TOMASYS, individual

MOTION, SEARCH = "f_maintain_motion", "f_generate_search_path"


def rules_file(tmp_path, text, name="more.swrl"):
    path = tmp_path / name
    path.write_text(text)
    return path


VISIBLE = "FunctionGrounding(?fg) ^ hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v)"


def policy_between(knowledge, *numbers):
    """A policy without failures, that tells measured values apart by few numbers: the fewer, the
    less to infer.
    """
    space = replace(
        PolicySpace.of(knowledge.base, knowledge.settings), numbers=tuple(map(Decimal, numbers))
    )
    return knowledge.policy(0, space=space)


@pytest.fixture(scope="module")
def policy(knowledge):
    return knowledge.policy(max_failed=1)


class TestScale:
    def test_places_follow_one_another(self):
        scale = Scale((Decimal(1), Decimal("2.5")))
        assert list(map(scale.text, range(len(scale)))) == [
            "not measured",
            "< 1",
            "1",
            "1 < . < 2.5",
            "2.5",
            "> 2.5",
        ]

    def test_a_place_has_a_value_of_its_own(self):
        scale = Scale((Decimal(1), Decimal("2.5")))
        unmeasured, *values = map(scale.value, range(len(scale)))
        assert unmeasured is None
        assert 0 < values[0] < values[1] == 1 < values[2] < values[3] == Decimal("2.5") < values[4]

    def test_an_open_range_has_several_values_in_their_order(self):
        scale = Scale((Decimal(1), Decimal("2.5")))
        assert scale.value(1) < scale.value(1, 2, 3) < 1
        assert scale.value(5, 0, 3) > Decimal("2.5")

    def test_neighbours_are_told_as_one_range(self):
        scale = Scale((Decimal(1), Decimal("2.5")))
        spans = {
            (1, 2): "<= 1",
            (2, 3): "1 <= . < 2.5",
            (3, 4): "1 < . <= 2.5",
            (4, 5): ">= 2.5",
            (1, 5): "any",
        }
        assert {span: scale.text(*span) for span in spans} == spans
        assert scale.text(0, 2) == "not measured or <= 1"

    def test_two_values_in_one_open_range_come_in_every_order(self):
        scale = Scale((Decimal(1), Decimal(2)))
        assert {(one > other) - (one < other) for one, other in scale.values([3, 3])} == {-1, 0, 1}
        assert all(1 < value < 2 for values in scale.values([3, 3]) for value in values)
        assert list(scale.values([0, 0])) == [(None, None)]
        assert list(scale.values([2, 2])) == [(1, 1)]


def test_combinations_count_what_they_stand_for():
    found = component_reports([["a", "b", "c"], ["d"]], ["FALSE", "RECOVERED"], 2)
    # of 4 components none, one or two report one of two words
    assert sum(found.values()) == 1 + 4 * 2 + 6 * 4


class TestPolicy:
    def test_says_how_many_states_it_covers(self, policy):
        # 16 ranges, 13 reports, 4 search and 3 motion groundings, or 2 follow groundings in its
        # place
        assert policy.states == 16 * 13 * (3 * 4 + 3 * 2)
        assert len(policy.cases) == 16 * 3 * 18

    def test_any_state_is_decided_as_its_case_says(self, knowledge, policy):
        chance = random.Random(5)
        for case in policy.cases.sample(60, random_state=5).to_dict("records"):
            value = policy.space.scale.value(case["water_visibility"], chance.randrange(7), 7)
            others = [f"c_thruster_{n}" for n in range(1, 7)]
            chance.shuffle(others)
            statuses = [status for _, status in case["state"].components]
            state = knowledge.state(
                objectives=[each.function for each in case["state"].objectives],
                groundings=dict(case["state"].groundings),
                components=dict(zip(others, statuses, strict=False)),
                measurements={} if value is None else {"water_visibility": value},
            )
            reasoning = knowledge.infer(state)
            for function in policy.functions:
                then = case[f"{function}_then"]
                assert then == (
                    "" if not case[f"{function}_now"] else reasoning.changes.get(function, "stays")
                )
            assert "; ".join(sorted(reasoning.inference.statuses)) == case["statuses"]

    def test_the_search_table_has_the_deployed_thresholds(self, policy):
        table, _, _ = function_table(policy, SEARCH)
        ranges = ["not measured", "< 1.25", "1.25 <= . < 2.25", "2.25 <= . < 3.25", ">= 3.25"]
        assert table.headings == ["now", "components", *ranges]
        (from_high,) = {
            tuple(row[2:])
            for row in table.rows
            if row[0] == "fd_spiral_high" and "no report" in row[1]
        }
        assert from_high == ("stays", "none left", "fd_spiral_low", "fd_spiral_medium", "stays")

    def test_a_contradiction_is_marked_where_it_is(self, tmp_path):
        file = rules_file(
            tmp_path, f'clash: {VISIBLE} ^ lessThan(?v, 1.5) -> fg_status(?fg, "IN_ERROR_FR")\n'
        )
        found = policy_between(KnowledgeBase.load(rules=[file]), "1.25", "1.5")
        marked = found.marked("inconsistent")
        by_design = marked.groupby(f"{SEARCH}_now")["water_visibility"].agg(set).to_dict()
        low, high = (
            {found.space.scale.text(at) for at in by_design[f"fd_spiral_{name}"]}
            for name in ("low", "high")
        )
        assert set(by_design) == {"fd_spiral_low", "fd_spiral_medium", "fd_spiral_high"}
        assert "1.25 < . < 1.5" in high - low and "1.5" not in high
        for problem in marked["problem"]:
            assert "by the rules QAWaterVisibility (" in problem and ", clash (" in problem

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
        assert set(flipping[f"{MOTION}_now"]) == {"fd_all_thrusters", "fd_recover_thrusters"}
        assert set(flipping["flipping"]) == {(MOTION,)}
        motion, search = (function_table(found, name)[0].text() for name in (MOTION, SEARCH))
        assert "(flip-flop)" in motion and "flip-flop" not in search

    def test_a_rule_that_computes_takes_the_proof_away(self, tmp_path):
        file = rules_file(
            tmp_path,
            f'sum: {VISIBLE} ^ add(?w, ?v, 1) ^ lessThan(?w, 2) -> fg_status(?fg, "IN_ERROR_NFR")\n',
        )
        assert policy_between(KnowledgeBase.load(rules=[file]), "2").no_proof == (
            "rule sum computes with add",
        )

    def test_an_attribute_that_nothing_looks_at_is_left_out(self, knowledge, tmp_path):
        settings = ManagingSettings(measured=("battery_level", "water_visibility"))
        assert PolicySpace.of(knowledge.base, settings).attributes == ("water_visibility",)
        file = rules_file(
            tmp_path,
            "flat: isQAtype(?q, battery_level) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.2) -> "
            "fd_realisability(fd_spiral_high, false)\n",
        )
        assert (
            PolicySpace.of(KnowledgeBase.load(rules=[file]).base, settings).attributes
            == settings.measured
        )


def test_the_csv_file_has_every_cell(command, tmp_path, policy):
    file, picture = tmp_path / "policy.csv", tmp_path / "policy.png"
    status, text, _ = command("policy", "--max-failed", "1", "--csv", file, "--png", picture)
    assert status == 0
    rows = list(csv.DictReader(io.StringIO(file.read_text())))
    assert sum(int(row["states"]) for row in rows) == policy.states
    row = next(
        row
        for row in rows
        if (row["water_visibility"], row[f"{SEARCH}_now"]) == ("2.25", "fd_spiral_high")
        and not row["components"]
    )
    assert row[f"{SEARCH}_then"] == "fd_spiral_medium"
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert f"{policy.states} states in {len(policy.cases)} equivalence classes" in text
    assert not list(tmp_path.glob(".*"))


OF_TWO = "isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ isQAtype(?p, battery_level) ^ hasValue(?p, ?w)"
RULES = {
    "the shipped ones": "",
    "one attribute decides on another's function": (
        "own: isQAtype(?q, battery_level) ^ hasValue(?q, ?v) ^ lessThan(?v, 0.6)"
        " -> fd_realisability(fd_spiral_high, false)"
    ),
    "two attributes are compared": f"own: {OF_TWO} ^ lessThan(?v, ?w) -> fd_realisability(fd_spiral_high, false)",
    "values of any two are compared": (
        "own: hasValue(?q, ?v) ^ hasValue(?p, ?w) ^ greaterThan(?v, ?w) ^ isQAtype(?p, battery_level)"
        " -> fd_realisability(fd_spiral_low, false)"
    ),
    "a value is compared with one of another property": (
        "limit: Objective(?o) -> fd_efficacy(fd_spiral_low, 2.9)\n"
        "own: isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ fd_efficacy(?d, ?w) ^ lessThan(?v, ?w)"
        " -> fd_realisability(fd_spiral_high, false)"
    ),
    "equal values": f"own: {OF_TWO.replace('?w', '?v')} -> fd_realisability(fd_spiral_high, false)",
}

TAKE_LONG = (
    "two attributes are compared",
    "values of any two are compared",
    "a value is compared with one of another property",
    "equal values",
)
"""Rules by which most values differ."""


def extended(tmp_path: Path, rule: str) -> KnowledgeBase:
    if not rule:
        return KnowledgeBase.load(scenario="extended")
    (tmp_path / "own.swrl").write_text(rule + "\n", encoding="utf-8")
    return KnowledgeBase.load(scenario="extended", rules=tmp_path / "own.swrl")


def check_like_deciding_each(knowledge: KnowledgeBase, policy: Policy, most: int) -> None:
    for case in policy.cases.sample(min(most, len(policy.cases)), random_state=5).to_dict(
        "records"
    ):
        alone = knowledge.outcome(Situation(case["state"]))
        asked = [each.function for each in case["state"].objectives]
        assert [case[f"{name}_then"] for name in asked] == list(map(alone.choice, asked)), str(
            case["state"]
        )
        assert (case["statuses"], case["problem"]) == (
            "; ".join(alone.statuses),
            alone.contradiction,
        )


@pytest.mark.parametrize(
    "rule",
    [
        pytest.param(rule, marks=[pytest.mark.slow] if name in TAKE_LONG else [], id=name)
        for name, rule in RULES.items()
    ],
)
def test_the_policy_of_two_attributes_is_that_of_deciding_each_state(tmp_path, rule):
    knowledge = extended(tmp_path, rule)
    space = PolicySpace.of(knowledge.base, knowledge.settings)
    assert space.attributes == ("battery_level", "water_visibility")
    few = tuple(number for number in space.numbers if number < 4)[-2:]
    small = PolicySpace(space.attributes, few, space.alike, space.statuses, space.functions)
    check_like_deciding_each(knowledge, knowledge.policy(0, space=small), 40)


def test_the_policy_of_one_attribute_is_that_of_deciding_each_state(small):
    counts: list[tuple[int, int]] = []
    policy = small.policy(max_failed=1, on_count=lambda *count: counts.append(count))
    check_like_deciding_each(small, policy, len(policy.cases))
    inferred = len(counts) - 1
    assert inferred > 10 and counts == [(number, inferred) for number in range(inferred + 1)]


def test_attributes_that_no_rule_relates_count_each_for_its_own_functions(tmp_path: Path) -> None:
    with_numbers = f"own: {OF_TWO} ^ lessThan(?v, 3.5) ^ lessThan(?w, 0.5) -> fd_realisability(fd_spiral_high, false)"
    for rule, are_independent in (
        ("", True),
        (with_numbers, True),
        (RULES["two attributes are compared"], False),
    ):
        knowledge = extended(tmp_path, rule)
        states = States.of(knowledge.base, knowledge.settings, 0, knowledge.space)
        different = len(set(map(kind_of(knowledge.base, knowledge.space), states)))
        assert (different < len(states) / 6) is are_independent


def test_few_of_the_extended_mission_s_states_have_to_be_inferred():
    knowledge = KnowledgeBase.load(scenario="extended")
    states = States.of(knowledge.base, knowledge.settings, 2, knowledge.space)
    kinds = set(map(kind_of(knowledge.base, knowledge.space), states))
    assert len(states) > 90_000
    assert len(kinds) < len(states) / 10


LEVEL = f'<owl:DatatypeProperty rdf:about="{SUAVE}level">{{}}</owl:DatatypeProperty>'
HAS_VALUE = f'rdf:resource="{TOMASYS}hasValue"'


@pytest.mark.parametrize(
    "axioms",
    [
        LEVEL.format(f"<owl:equivalentProperty {HAS_VALUE}/>"),
        LEVEL.format("") + f'<rdf:Description rdf:about="{TOMASYS}hasValue"><rdfs:subPropertyOf'
        f' rdf:resource="{SUAVE}level"/></rdf:Description>',
    ],
    ids=["said of the other property", "said of hasValue"],
)
def test_a_measured_value_has_an_effect_by_a_property_that_means_the_same(
    suave_copy, tmp_path, axioms
):
    file = rules_file(
        tmp_path,
        "own: level(?q, ?v) ^ lessThan(?v, 0.2) -> fd_realisability(fd_spiral_high, false)",
    )
    knowledge = KnowledgeBase.load(suave_copy(axioms), rules=file)
    settings = ManagingSettings(measured=("battery_level",))

    def chosen(battery_level):
        state = knowledge.state(measurements={"battery_level": battery_level})
        return knowledge.infer(state).changes[SEARCH]

    assert (chosen(0.1), chosen(0.3)) == ("fd_spiral_medium", "fd_spiral_high")  # as Pellet infers
    assert PolicySpace.of(knowledge.base, settings).attributes == ("battery_level",)


def test_attributes_that_are_the_same_by_a_functional_property_do_not_count_apart(suave_copy):
    """A value of two types makes the types one, as isQAtype is functional: so the battery level is
    compared with what designs expect of visibility.
    """
    both = ("isQAtype", ":water_visibility"), ("isQAtype", ":battery_level")
    added = individual("qa_both", "QAvalue", *both)
    added += individual(
        "qa_battery", "QAvalue", ("isQAtype", ":battery_level"), ("hasValue", "0.25")
    )
    added += individual("fd_spiral_high", "FunctionDesign", ("hasQAestimation", ":qa_battery"))
    knowledge = KnowledgeBase.load(suave_copy(added), values=FEWER_NUMBERS)

    def state(battery_level):
        return knowledge.state(
            groundings={SEARCH: "fd_spiral_high"},
            measurements={"water_visibility": 10, "battery_level": battery_level},
        )

    one, other = state(3), state(4)
    statuses = [set(knowledge.infer(each).inference.statuses) for each in (one, other)]
    assert statuses[0] != statuses[1]  # as Pellet infers
    space = PolicySpace.of(
        knowledge.base, ManagingSettings(measured=("battery_level", "water_visibility"))
    )
    kind = kind_of(knowledge.base, space)
    assert kind(one) != kind(other)


def test_a_value_that_is_not_measured_is_no_part_of_a_range():
    cells = {(0,): "stays", (1,): "stays", (2,): "stays", (3,): "none left"}
    assert _spans(0, 4, [cells]) == [(0, 0), (1, 2), (3, 3)]


@pytest.mark.parametrize("numbers", [("0",), ("-2",), ("-2.5", "0", "1")])
def test_values_stand_for_their_place_below_numbers_that_are_not_positive_too(numbers):
    scale = Scale(tuple(map(Decimal, numbers)))
    places = list(range(len(scale)))
    assert [scale.place(scale.value(place)) for place in places] == places


def test_what_has_an_effect_in_either_knowledge_base_is_told_apart():
    one = PolicySpace(("a",), (Decimal(1),), (("c",),), ("FALSE",), ("f",))
    other = PolicySpace(("b",), (Decimal(2),), (("d",),), ("HOT",), ("g",))
    both = PolicySpace(
        ("a", "b"), (Decimal(1), Decimal(2)), (("c",), ("d",)), ("FALSE", "HOT"), ("f", "g")
    )
    assert one.union(other) == both


@pytest.mark.parametrize(("kinds", "said"), [(5, []), (6, ["  and 1 more kinds: see --csv"])])
def test_more_kinds_of_wrong_states_than_are_shown_are_counted(kinds, said):
    case = {"states": 1, "marks": "flip-flop", "state": "a state", "problem": ""}
    policy = Policy(PolicySpace((), (), (), ()), pandas.DataFrame([case] * kinds), (), (), (), 0)
    assert list(policy.lines())[3:] == [f"flip-flop: {kinds} states", *["  a state"] * 5, *said]
