"""kb diff: axioms added and removed, states decided differently, and missions compared in pairs."""

import gzip
import re
from dataclasses import replace
from decimal import Decimal
from math import nan
from pathlib import Path

import pandas
import pytest

from suave_des.kb.difference import (
    COMPARED_METRICS,
    PolicyDifference,
    compare_axioms,
    compare_decisions,
    compare_missions,
    firing_states,
    paired,
)
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.situations import Outcome, Situation
from suave_des.kb.space import PolicySpace, States
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.state import Decision, Fact, Plan
from suave_des.resources import shipped_folder
from tests.helpers.knowledge_states import FEWER_NUMBERS
from tests.helpers.owl_text import SUAVE, TOMASYS

SEARCH = "f_generate_search_path"
VISIBLE = "FunctionGrounding(?fg) ^ hasQAvalue(?fg, ?q) ^ isQAtype(?q, water_visibility) ^ hasValue(?q, ?v)"
MOVED = f'QAWaterVisibility: {VISIBLE} ^ lessThan(?v, 3) -> fg_status(?fg, "IN_ERROR_NFR")'
OWL = "http://www.w3.org/2002/07/owl#"
FAILED = f"""
<owl:Class rdf:about="{SUAVE}Failed"><owl:equivalentClass><owl:Class><owl:intersectionOf rdf:parseType="Collection">
<rdf:Description rdf:about="{TOMASYS}Component"/><owl:Restriction>
<owl:onProperty rdf:resource="{TOMASYS}c_status"/><owl:hasValue>FALSE</owl:hasValue></owl:Restriction>
</owl:intersectionOf></owl:Class></owl:equivalentClass></owl:Class>
"""


@pytest.fixture
def bolder(suave_copy):
    return suave_copy(replace={">3.25<": ">2.75<"}, name="bolder.owl")


def test_a_changed_value_is_one_axiom_in_place_of_another(bolder):
    removed, added = compare_axioms(Ontology.load(), Ontology.load([bolder]))
    assert removed == ["hasValue(qa_water_visibility_high, 3.25)"]
    assert added == ["hasValue(qa_water_visibility_high, 2.75)"]


def test_class_expressions_are_compared_whatever_their_nodes_are_called(suave_copy):
    copies = (suave_copy(FAILED), suave_copy(FAILED, name="again.owl"))
    assert compare_axioms(*(Ontology.load([each]) for each in copies)) == ([], [])


def test_a_class_expression_is_told_with_what_it_says(suave_copy):
    _, added = compare_axioms(Ontology.load(), Ontology.load([suave_copy(FAILED)]))
    (told,) = (text for text in added if "equivalentClass" in text)
    assert 'hasValue "FALSE"' in told
    assert "onProperty c_status" in told


def test_rules_count_with_their_text(tmp_path):
    rules = tmp_path / "mine.swrl"
    rules.write_text(
        "S1a: Component(?c) -> fd_realisability(fd_spiral_low, false)\n", encoding="utf-8"
    )
    removed, added = compare_axioms(Ontology.load(), Ontology.load(rules=[rules]))
    assert [text.partition(":")[0] for text in (*removed, *added)] == ["rule S1a", "rule S1a"]


def test_missions_with_the_second_knowledge_base_are_those_that_are_called_other():
    found = compare_missions("seams2023", 1, {}, {"values": {"mission.time_limit_s": 20}})
    _, pairs, difference, _ = found.metrics[0]
    one, other = pairs.loc[1]
    assert other <= 21 < one and difference.value == other - one


@pytest.mark.parametrize("number", [0, 9])
def test_states_are_counted_in_which_a_rule_fires_that_only_one_of_two_has(tmp_path, number):
    """Visibility is above 0 in every mission, and never above 9 m, whichever of the two has the
    rule.
    """
    body = f"isQAtype(?q, water_visibility) ^ hasValue(?q, ?v) ^ greaterThan(?v, {number})"
    more = {
        "rules": [rules_file(tmp_path, f"own: {body} -> fd_realisability(fd_spiral_high, false)")]
    }
    short = {"values": {"mission.time_limit_s": 20}}
    for one, other in ((more, {}), ({}, more)):
        firing, states = firing_states(
            "seams2023", 1, {**short, **one}, {**short, **other}, seed=1, limit=TimeLimit()
        )
        assert states > 0
        assert firing == (states if number == 0 else 0)


def test_the_command_compares_in_one_table(bolder, command):
    shipped = shipped_folder("ontology") / "suave.owl"
    arguments = ("diff", shipped, bolder, "--max-failed", "0", "--quiet", "--missions")
    status, out, _ = command(*arguments, "2")
    assert status == 0
    rows = {line.split("  ")[0]: line for line in out.splitlines()}
    assert {"decisions", "missions", "search time, s", "distance, m"} <= set(rows)
    assert rows["decisions"].endswith("24 of 324 states")


def test_the_difference_of_missions_is_the_second_less_the_first():
    before = pandas.DataFrame(
        {name: [100.0, 120.0, 90.0] for name in COMPARED_METRICS}, index=[1, 2, 3]
    )
    after = pandas.DataFrame(
        {name: [104.0, 126.0, 90.0] for name in COMPARED_METRICS}, index=[1, 2, 3]
    )
    found = paired(before, after)
    assert found.missions == 3 and found.changed == (1, 2)
    for _, pairs, difference, changed in found.metrics:
        interval = difference.interval
        assert (*pairs.mean(), difference.value) == pytest.approx((310 / 3, 320 / 3, 10 / 3))
        assert interval is not None and interval[0] < 10 / 3 < interval[1]
        assert changed == 2
    assert list(found.lines()) == ["runs that differ: 1, 2"]


def test_a_metric_that_differs_has_its_row_whether_or_not_it_is_known_in_all_missions():
    before = pandas.DataFrame(
        {
            **{name: [1.0, 1.0] for name in COMPARED_METRICS},
            "mean_reaction_time_s": [2.0, nan],
            "adaptations": [3, 4],
        },
        index=[1, 2],
    )
    after = before.assign(mean_reaction_time_s=[2.5, 3.0])
    found = paired(before, after)
    assert [metric.name for metric, *_ in found.metrics] == [
        *COMPARED_METRICS,
        "mean_reaction_time_s",
    ]
    assert (found.metrics[2][2].value, found.metrics[2][3]) == (0.5, 2)


def test_what_is_unknown_with_both_knowledge_bases_does_not_differ():
    before = pandas.DataFrame(
        {
            **{name: [1.0] * 4 for name in COMPARED_METRICS},
            "mean_reaction_time_s": [nan, 2.0, nan, 2.0],
        },
        index=[1, 2, 3, 4],
    )
    after = before.assign(mean_reaction_time_s=[nan, nan, 2.0, 2.0])
    found = paired(before, after)
    assert found.changed == (2, 3)


@pytest.mark.parametrize("change", ["inconsistent", "none left", "other statuses"])
def test_states_that_only_one_knowledge_base_finds_inconsistent_or_without_design_differ(
    small, change
):
    states = States.of(small.base, small.settings, 0, small.space)
    changed = next(
        each
        for each in states
        if each.grounded(SEARCH) and not small.outcome(Situation(each)).statuses
    )

    def other(situation):
        found = small.outcome(situation)
        if situation.state != changed:
            return found
        if change == "inconsistent":
            return Outcome(None, "it is")
        if change == "none left":
            return Outcome(replace(found.reasoning, plan=Plan((Decision(SEARCH, None, ""),))))
        fact = Fact(f"o_{SEARCH[2:]}", "o_status", "X")
        inference = replace(
            found.reasoning.inference, facts=found.reasoning.inference.facts | {fact}
        )
        return Outcome(replace(found.reasoning, inference=inference))

    found = compare_decisions(states, small.outcome, other, ())
    is_decided = change != "other statuses"
    assert (found.states, found.reported) == ((1, 0) if is_decided else (0, 1))
    assert list(found.cells["state"]) == [changed] * is_decided


def test_a_state_counts_once_for_each_component_that_could_report_in_it(small):
    """Any of six thrusters can fail or recover; a state in which two kinds differ stands for six of
    each kind.
    """
    states = States.of(small.base, small.settings, 1, small.space)
    changed = [
        next(each for each in states if dict(each.components) == {"c_thruster_1": status})
        for status in ("FALSE", "RECOVERED")
    ]
    unchanged = small.outcome(Situation(states.tasks[0]))

    def other(situation):
        if situation.state not in changed:
            return unchanged
        objective = f"o_{situation.state.objectives[0].function[2:]}"
        facts = unchanged.reasoning.inference.facts | {Fact(objective, "o_updatable", True)}
        inference = replace(unchanged.reasoning.inference, facts=facts, state=situation.state)
        return Outcome(replace(unchanged.reasoning, inference=inference))

    found = compare_decisions(states, lambda _: unchanged, other, ())
    assert (found.states, found.reported) == (0, 12)
    # 8 ranges, 13 reports, 4 search and 3 motion groundings, or 2 follow groundings in its place
    assert found.compared == 8 * 13 * (3 * 4 + 3 * 2)


def rules_file(tmp_path: Path, text: str) -> Path:
    (tmp_path / "own.swrl").write_text(text + "\n", encoding="utf-8")
    return tmp_path / "own.swrl"


class TestDiff:
    def test_a_moved_threshold_changes_decisions_only_where_it_moved(self, small, tmp_path):
        file = rules_file(tmp_path, MOVED)
        difference = small.diff(
            KnowledgeBase.load(rules=[file], values=FEWER_NUMBERS), max_failed=0
        )
        cells = difference.cells
        high = cells[cells[f"{SEARCH}_now"] == "fd_spiral_high"]
        assert set(map(difference.space.scale.text, high["water_visibility"])) == {
            "3",
            "3 < . < 3.25",
        }
        assert set(high[f"{SEARCH}_then_a"]) == {"fd_spiral_medium"} and set(
            high[f"{SEARCH}_then_b"]
        ) == {"stays"}

    def test_the_same_ontology_decides_alike(self, command, suave_copy):
        same = suave_copy()
        status, text, _ = command("diff", same, same, "--max-failed", "0")
        assert (status, text) == (0, "0 of 288 states are decided differently\n")

    def test_the_command_takes_rules_for_the_knowledge_base_with_them(
        self, command, suave_copy, tmp_path
    ):
        file = rules_file(tmp_path, MOVED)
        _, text, _ = command("diff", suave_copy(), file, "--max-failed", "0")
        assert (
            f"{SEARCH}, now fd_spiral_high: A fd_spiral_medium, B stays\n  3 <= . < 3.25: 6 states\n"
            in text
        )

    def test_an_outcome_is_told_once(self, command, suave_copy, tmp_path):
        file = rules_file(
            tmp_path, "low: FunctionDesign(?d) -> fd_realisability(fd_spiral_low, false)\n"
        )
        _, text, _ = command("diff", suave_copy(), file, "--max-failed", "0")
        assert (
            f"{SEARCH}, now ungrounded: A fd_spiral_low, B none left\n  1.25 <= . < 2.25: 6 states\n"
            in text
        )
        assert "none left, none left" not in text

    def test_a_function_without_designs_on_one_side_is_decided_differently(
        self, command, suave_copy
    ):
        same, without = suave_copy(), suave_copy(name="without.owl")
        designs = r'(?s)<owl:NamedIndividual rdf:about="[^"]*#fd_spiral_(?:low|medium|high)">.*?</owl:NamedIndividual>'
        without.write_text(re.sub(designs, "", without.read_text()))
        for files, texts in (
            ((same, without), "A fd_spiral_low, B none left"),
            ((without, same), "A none left, B fd_spiral_low"),
        ):
            _, text, _ = command("diff", *files, "--max-failed", "0")
            assert f"{SEARCH}, now ungrounded: {texts}\n" in text
            assert not text.startswith("0 of") and " 0 of" not in text


@pytest.mark.parametrize(
    ("places", "said"),
    [((0, 1, 2, 3), "whatever is measured: 8 states"), ((1, 2, 3), "any: 6 states")],
)
def test_a_difference_for_all_values_is_told_as_such(places, said):
    row = {"states": 2, "f_now": "x", "f_then_a": "y", "f_then_b": "z", "state": "a state"}
    cells = pandas.DataFrame([{"water_visibility": place, **row} for place in places])
    space = PolicySpace(("water_visibility",), (Decimal(1),), (), ())
    difference = PolicyDifference(8, cells, 0, space, ("f",), ())
    assert list(difference.lines())[1:] == [
        "f, now x: A y, B z",
        f"  {said}",
        "  for instance a state",
    ]


@pytest.fixture
def own_table(tmp_path):
    """Metacontrol's decisions as a table."""
    kept = Path(__file__).parents[1] / "data" / "metacontrol_table.csv.gz"
    file = tmp_path / "own.csv"
    file.write_bytes(gzip.decompress(kept.read_bytes()))
    return file


def test_a_table_of_a_knowledge_base_decides_as_that_does(own_table, command):
    status, text, _ = command("diff", "suave.owl", own_table, "--max-failed", "1")
    assert (status, text) == (0, "0 of 3744 states are decided differently\n")


def test_tables_are_compared_in_every_region_of_either(command):
    status, text, _ = command("diff", "rosa", "planta", "--max-failed", "0")
    assert status == 0
    lines = text.splitlines()
    higher = lines.index("f_generate_search_path, now fd_spiral_low: A fd_spiral_high, B stays")
    assert lines[higher + 1 : higher + 3] == ["  not measured: 3 states", "  >= 3.25: 6 states"]
    assert "  1.245 <= . < 1.25: 6 states" in lines  # PLANTA rounds


def test_missions_of_a_table_are_compared_with_metacontrols(own_table, command):
    fixed = ("--max-failed", "0", "--missions", "2", "--set", "latencies.inference_s=1")
    status, text, _ = command("diff", "suave.owl", own_table, *fixed, "--quiet")
    assert status == 0 and text.endswith("no mission differs\n")


def test_a_design_that_the_ontology_does_not_have_is_named_with_its_line(own_table, command):
    own_table.write_text(own_table.read_text().replace("fd_follow_pipeline", "fd_folow", 1))
    own_table.write_text(own_table.read_text().replace(",fd_folow_now", ",f_follow_pipeline_now"))
    status, _, said = command("diff", own_table, "rosa")
    assert status == 2
    assert "line 2: the ontology has no design fd_folow of f_follow_pipeline" in said.replace(
        "'", ""
    )
