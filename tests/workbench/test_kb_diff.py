"""kb diff: axioms added and removed, and missions compared in pairs."""

import json

import pytest

from suave_des.knowledge.ontology import Ontology
from suave_des.resources import shipped_folder
from suave_des.workbench.difference import MissionsToCompare, compare_axioms, compare_missions
from tests.helpers.owl_text import SUAVE, TOMASYS

OWL = "http://www.w3.org/2002/07/owl#"
FAILED = f"""
<owl:Class rdf:about="{SUAVE}Failed"><owl:equivalentClass><owl:Class><owl:intersectionOf rdf:parseType="Collection">
<rdf:Description rdf:about="{TOMASYS}Component"/><owl:Restriction>
<owl:onProperty rdf:resource="{TOMASYS}c_status"/><owl:hasValue>FALSE</owl:hasValue></owl:Restriction>
</owl:intersectionOf></owl:Class></owl:equivalentClass></owl:Class>
"""


@pytest.fixture
def bolder(tmp_path):
    text = (shipped_folder("ontology") / "suave.owl").read_text(encoding="utf-8")
    path = tmp_path / "bolder.owl"
    path.write_text(text.replace(">3.25<", ">2.75<"), encoding="utf-8")
    return path


def test_a_changed_value_is_one_axiom_removed_and_one_added(bolder):
    found = compare_axioms(Ontology.load(), Ontology.load([bolder]))
    assert found.removed == ("hasValue(qa_water_visibility_high, 3.25)",)
    assert found.added == ("hasValue(qa_water_visibility_high, 2.75)",)


def test_class_expressions_are_compared_whatever_their_nodes_are_called(edited):
    one, again = Ontology.load([edited(FAILED)]), Ontology.load([edited(FAILED, "again.owl")])
    assert compare_axioms(one, again).added == ()
    (added,) = [text for text in compare_axioms(Ontology.load(), one).added if "equivalentClass" in text]
    assert 'hasValue "FALSE"' in added
    assert "onProperty c_status" in added


def test_rules_count_with_their_text(tmp_path):
    rules = tmp_path / "mine.swrl"
    rules.write_text("S1a: Component(?c) -> fd_realisability(fd_spiral_low, false)\n", encoding="utf-8")
    found = compare_axioms(Ontology.load(), Ontology.load(rules=[rules]))
    assert [text.partition(":")[0] for text in (*found.removed, *found.added)] == ["rule S1a", "rule S1a"]


def test_missions_with_the_same_rules_do_not_differ():
    found = compare_missions(MissionsToCompare("seams2023", 3), {}, {})
    assert (found.missions, found.changed, found.extremes) == (3, (), ())
    assert [(each.difference, each.interval) for each in found.metrics] == [(0.0, None), (0.0, None)]


def test_the_command_puts_decisions_and_missions_in_one_table(bolder, command):
    shipped = shipped_folder("ontology") / "suave.owl"
    arguments = ("diff", shipped, bolder, "--max-failed", "0", "--quiet", "--missions")
    status, out, _ = command(*arguments, "2")
    assert status == 0
    rows = {line.split("  ")[0]: line for line in out.splitlines()}
    assert {"decisions", "missions", "search time, s", "distance, m"} <= set(rows)
    assert rows["decisions"].endswith("24 of 324 states")
    _, out, _ = command(*arguments, "1", "--format", "json")
    content = json.loads(out)
    assert content["axioms"]["added"] == ["hasValue(qa_water_visibility_high, 2.75)"]
    assert content["missions"]["missions"] == 1
