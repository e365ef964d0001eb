"""The kept-alive Pellet infers what stock owlready2 infers, state by state."""

from __future__ import annotations

import random
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.planning import plan
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import Fact, Inference, KnowledgeState, ObjectiveState
from tests.helpers.generated_ontologies import write_ontology
from tests.helpers.knowledge_states import FOLLOW, MOTION, SEARCH, searching
from tests.helpers.number_ontology import numbers_ontology

THRESHOLDS = ("1.25", "2.25", "3.25")
#: Just below, on and just above each threshold, and numbers that binary floats write with an exponent.
VISIBILITIES = [
    *(f"{float(t) + step:.9f}" for t in THRESHOLDS for step in (-1e-9, 0.0, 1e-9)),
    *("0.00001", "2.71828182845904523536", "12345678901234567890"),
]


def random_state(draw: random.Random) -> KnowledgeState:
    designs = {
        SEARCH: ["fd_spiral_high", "fd_spiral_medium", "fd_spiral_low"],
        MOTION: ["fd_all_thrusters", "fd_recover_thrusters"],
        FOLLOW: ["fd_follow_pipeline"],
    }
    functions = draw.sample(sorted(designs), draw.randint(1, 3))
    grounded = {name: draw.choice(designs[name]) for name in functions if draw.random() < 0.8}
    statuses = {
        name: draw.choice([None, "UNGROUNDED", "IN_ERROR_NFR", "IN_ERROR_FR"]) if name not in grounded else None
        for name in functions
    }
    hit = draw.sample(range(1, 7), draw.choice([0, 0, 1, 2]))
    measured = {"water_visibility": draw.choice(VISIBILITIES)} if draw.random() < 0.9 else {}
    if draw.random() < 0.5:
        measured["battery_level"] = f"{draw.random():.6f}"
    return KnowledgeState.of(
        [ObjectiveState(name, statuses[name], draw.random() < 0.3) for name in functions],
        groundings=grounded,
        components={f"c_thruster_{n}": draw.choice(["FALSE", "RECOVERED", "OK"]) for n in hit},
        measurements=measured,
    )


def outcome(reasoner: Reasoner, state: KnowledgeState) -> Inference | str:
    try:
        return reasoner.analyze(state)
    except KnowledgeError as error:
        return str(error)


@pytest.mark.parametrize("count", [4, pytest.param(120, marks=pytest.mark.slow)])
def test_both_backends_infer_the_same_on_random_states(kb: Ontology, pellet: Reasoner, count: int) -> None:
    draw = random.Random(20230515)
    states = [random_state(draw) for _ in range(count)]
    # A grounding in error cannot belong to an objective that is said to be ungrounded.
    states += [searching("fd_spiral_high", 1.0, status="UNGROUNDED"), KnowledgeState()]
    assert len(set(states)) >= count
    found = [outcome(pellet, state) for state in states]
    stock = Reasoner(kb, "owlready2", TimeLimit(180.0))
    with ThreadPoolExecutor(max_workers=2) as pool:  # each call waits for a Java process of its own
        reference = list(pool.map(lambda state: outcome(stock, state), states))
    assert found == reference
    consistent = [one for one in found if isinstance(one, Inference)]
    assert any(isinstance(one, str) for one in found)
    assert len({one.facts for one in consistent}) >= min(10, count // 2)  # what follows from the states does differ
    for ours, theirs in zip(found, reference, strict=True):
        if isinstance(ours, Inference) and isinstance(theirs, Inference):
            assert plan(kb, ours) == plan(kb, theirs)


def test_an_inference_does_not_depend_on_those_before_it(kb: Ontology) -> None:
    draw = random.Random(7)
    states = [random_state(draw) for _ in range(40)]
    forth = Reasoner(kb, "pellet")
    back = Reasoner(kb, "pellet")
    one = [outcome(forth, state) for state in states]
    other = [outcome(back, state) for state in reversed(states)]
    assert one == other[::-1]


def everything(backend: str, number: int, folder: Path) -> frozenset[Fact] | str:
    """All that a backend infers from generated ontology `number`; where that contradicts itself, that it does.

    Of several contradictions Pellet names the one that it meets first, which is not the same in each of its processes.
    """
    owl, rules = write_ontology(number, folder)
    base = Ontology.load([owl], rules=[rules])
    try:
        return Reasoner(base, backend, TimeLimit(180.0), base.content.all_terms()).analyze(KnowledgeState()).facts
    except KnowledgeError as error:
        assert "contradiction" in str(error)
        return "contradiction"


class TestSchemas:
    """What axioms conclude: subclasses, defined classes, inverses, chains, sameness, and rules on all of them."""

    def compare(self, numbers: range, folder: Path) -> list[frozenset[Fact] | str]:
        found = [everything("pellet", number, folder) for number in numbers]
        assert found == [everything("owlready2", number, folder) for number in numbers]
        return found

    def test_all_that_axioms_conclude_is_read(self, tmp_path: Path) -> None:
        assert sum(map(len, self.compare(range(200, 204), tmp_path))) >= 50

    @pytest.mark.slow
    def test_all_that_axioms_conclude_is_read_in_200_ontologies(self, tmp_path: Path) -> None:
        found = self.compare(range(200), tmp_path)
        assert sum(isinstance(one, str) for one in found) >= 5  # contradictions are among them


def test_numbers_that_a_rule_takes_for_the_same_are_those_of_stock_pellet(tmp_path: Path) -> None:
    numbers = numbers_ontology(tmp_path)
    terms = numbers.content.all_terms()
    found = Reasoner(numbers, "pellet", terms=terms).analyze(KnowledgeState()).facts
    assert found == Reasoner(numbers, "owlready2", TimeLimit(180.0), terms).analyze(KnowledgeState()).facts
    matching = {(fact.subject, fact.value) for fact in found if fact.property == "is"}
    assert {("integer", "int"), ("padded", "integer"), ("decimal", "whole_decimal"), ("half", "long_half")} <= matching
    assert matching.isdisjoint({("integer", "decimal"), ("whole_decimal", "int"), ("double", "decimal")})
