"""Which numbers of different datatypes and forms a rule takes for the same: as stock owlready2 and Pellet do."""

from __future__ import annotations

from pathlib import Path

from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import KnowledgeState
from tests.helpers.number_ontology import numbers_ontology


def test_numbers_that_a_rule_takes_for_the_same_are_those_of_stock_pellet(tmp_path: Path) -> None:
    numbers = numbers_ontology(tmp_path)
    terms = numbers.content.all_terms()
    found = Reasoner(numbers, "pellet", terms=terms).analyze(KnowledgeState()).facts
    assert found == Reasoner(numbers, "owlready2", TimeLimit(180.0), terms).analyze(KnowledgeState()).facts
    matching = {(fact.subject, fact.value) for fact in found if fact.property == "is"}
    assert {("integer", "int"), ("padded", "integer"), ("decimal", "whole_decimal"), ("half", "long_half")} <= matching
    assert matching.isdisjoint({("integer", "decimal"), ("whole_decimal", "int"), ("double", "decimal")})
