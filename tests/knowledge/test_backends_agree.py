"""The kept-alive Pellet infers what stock owlready2 infers, state by state."""

from __future__ import annotations

import random
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from rdflib import RDF, RDFS, BNode, Graph, Literal, Namespace, URIRef
from rdflib.collection import Collection
from rdflib.namespace import OWL
from rdflib.term import Node

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import TimeLimit
from suave_des.knowledge.reasoner import Reasoner
from suave_des.knowledge.state import Fact, Inference, KnowledgeState, ObjectiveState
from tests.helpers.knowledge_states import FOLLOW, MOTION, SEARCH, searching
from tests.helpers.number_ontology import numbers_ontology
from tests.helpers.owl_text import XSD

NS = Namespace("http://example.org/generated#")
_BODIES = (
    "related1(?x, ?y)",
    "related2(?x, ?y)",
    "Kind1(?x)",
    "Kind2(?x)",
    "size1(?x, ?s) ^ swrlb:greaterThan(?s, 2)",
)
_HEADS = ("Kind3(?x)", "Kind4(?x)", "related3(?x, ?x)", "flag1(?x, true)", 'label1(?x, "seen")')


def write_ontology(number: int, folder: Path) -> tuple[Path, Path]:
    """Write ontology `number` and its rules; the same number gives the same files."""
    draw = random.Random(number)
    graph = Graph()
    classes = [NS[f"Kind{n}"] for n in range(1, 7)]
    objects = [NS[f"related{n}"] for n in range(1, 6)]
    data = [NS["size1"], NS["size2"], NS["flag1"], NS["label1"]]
    things = [NS[f"thing{n}"] for n in range(1, 6)]
    graph.add((URIRef(str(NS)[:-1]), RDF.type, OWL.Ontology))
    for kind, names in (
        (OWL.Class, classes),
        (OWL.ObjectProperty, objects),
        (OWL.DatatypeProperty, data),
    ):
        for name in names:
            graph.add((name, RDF.type, kind))
    for thing in things:
        graph.add((thing, RDF.type, OWL.NamedIndividual))
        graph.add((thing, RDF.type, draw.choice(classes)))
        for name in draw.sample(objects, 2):
            graph.add((thing, name, draw.choice(things)))
        if draw.random() < 0.7:
            graph.add(
                (
                    thing,
                    NS.size1,
                    Literal(str(draw.choice([1, 2, 3])), datatype=URIRef(XSD + "decimal")),
                )
            )
        if draw.random() < 0.4:
            graph.add(
                (
                    thing,
                    NS.label1,
                    Literal(draw.choice(["one", "two"]), datatype=URIRef(XSD + "string")),
                )
            )
    for _ in range(draw.randint(4, 8)):
        _add_axiom(graph, draw, classes, objects, things)
    owl, rules = folder / f"generated{number}.owl", folder / f"generated{number}.swrl"
    graph.serialize(owl, format="xml")
    chosen = [
        f"rule{n}: {draw.choice(_BODIES)} -> {draw.choice(_HEADS)}\n"
        for n in range(draw.randint(0, 3))
    ]
    rules.write_text("".join(chosen))
    return owl, rules


def _add_axiom(
    graph: Graph,
    draw: random.Random,
    classes: list[URIRef],
    objects: list[URIRef],
    things: list[URIRef],
) -> None:
    one, other = draw.sample(classes, 2)
    name, second = draw.sample(objects, 2)
    match draw.randrange(16):
        case 0:
            graph.add((one, RDFS.subClassOf, other))
        case 1:
            graph.add((name, RDFS.subPropertyOf, second))
        case 2:
            graph.add((name, OWL.inverseOf, second))
        case 3:
            graph.add((name, RDF.type, OWL.TransitiveProperty))
        case 4:
            graph.add((name, RDF.type, OWL.SymmetricProperty))
        case 5:
            # two values are then the same individual
            graph.add((name, RDF.type, OWL.FunctionalProperty))
        case 6:
            graph.add((name, RDFS.domain, one))
            graph.add((second, RDFS.range, other))
        case 7:
            first, same = draw.sample(things, 2)
            graph.add((first, OWL.sameAs, same))
        case 8:
            value = Literal(draw.choice(["one", "two"]), datatype=URIRef(XSD + "string"))
            graph.add(
                (one, OWL.equivalentClass, _restriction(graph, NS.label1, OWL.hasValue, value))
            )
        case 9:
            restriction = _restriction(graph, name, OWL.hasValue, draw.choice(things))
            graph.add((one, draw.choice([OWL.equivalentClass, RDFS.subClassOf]), restriction))
        case 10:
            graph.add(
                (one, OWL.equivalentClass, _restriction(graph, name, OWL.someValuesFrom, other))
            )
        case 11:
            graph.add((one, RDFS.subClassOf, _restriction(graph, name, OWL.allValuesFrom, other)))
        case 12:
            node, parts = BNode(), BNode()
            graph.add((node, RDF.type, OWL.Class))
            graph.add((node, draw.choice([OWL.intersectionOf, OWL.unionOf]), parts))
            Collection(graph, parts, draw.sample([kind for kind in classes if kind != one], 2))
            graph.add((one, OWL.equivalentClass, node))
        case 13:
            graph.add((one, OWL.disjointWith, other))
        case 14:
            first, other_thing = draw.sample(things, 2)
            graph.add((first, OWL.differentFrom, other_thing))
        case _:
            chain = BNode()
            Collection(graph, chain, [name, second])
            whole = draw.choice([each for each in objects if each not in (name, second)])
            graph.add((whole, OWL.propertyChainAxiom, chain))


def _restriction(graph: Graph, name: URIRef, kind: URIRef, value: Node) -> BNode:
    node = BNode()
    graph.add((node, RDF.type, OWL.Restriction))
    graph.add((node, OWL.onProperty, name))
    graph.add((node, kind, value))
    return node


THRESHOLDS = ("1.25", "2.25", "3.25")
#: Just below, on and just above each threshold, and numbers that binary floats write with an
# exponent.
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
        name: draw.choice([None, "UNGROUNDED", "IN_ERROR_NFR", "IN_ERROR_FR"])
        if name not in grounded
        else None
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


@pytest.mark.parametrize("count", [2, pytest.param(60, marks=pytest.mark.slow)])
def test_both_backends_infer_the_same_on_random_states(kb, pellet, count):
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
    # what follows from the states does differ
    assert len({one.facts for one in consistent}) >= min(10, count // 2)
    for ours, theirs in zip(found, reference, strict=True):
        if isinstance(ours, Inference) and isinstance(theirs, Inference):
            assert pellet.plan(ours) == pellet.plan(theirs)


def test_an_inference_does_not_depend_on_those_before_it(kb):
    draw = random.Random(7)
    states = [random_state(draw) for _ in range(40)]
    forth = Reasoner(kb, "pellet")
    back = Reasoner(kb, "pellet")
    one = [outcome(forth, state) for state in states]
    other = [outcome(back, state) for state in reversed(states)]
    assert one == other[::-1]


def everything(backend: str, number: int, folder: Path) -> frozenset[Fact] | str:
    """All that a backend infers from generated ontology `number`; where that contradicts itself,
    that it does.

    Of several contradictions Pellet names the one that it meets first, which is not the same in
    each of its processes.
    """
    owl, rules = write_ontology(number, folder)
    base = Ontology.load([owl], rules=[rules])
    try:
        return (
            Reasoner(base, backend, TimeLimit(180.0), base.content.all_terms())
            .analyze(KnowledgeState())
            .facts
        )
    except KnowledgeError as error:
        assert "contradiction" in str(error)
        return "contradiction"


class TestSchemas:
    """What axioms conclude: subclasses, defined classes, inverses, chains, sameness, and rules on
    all of them.
    """

    def compare(self, numbers: range, folder: Path) -> list[frozenset[Fact] | str]:
        found = [everything("pellet", number, folder) for number in numbers]
        assert found == [everything("owlready2", number, folder) for number in numbers]
        return found

    def test_all_that_axioms_conclude_is_read(self, tmp_path):
        assert sum(map(len, self.compare(range(200, 203), tmp_path))) >= 30

    @pytest.mark.slow
    def test_all_that_axioms_conclude_is_read_in_many_ontologies(self, tmp_path):
        found = self.compare(range(60), tmp_path)
        assert sum(isinstance(one, str) for one in found) >= 5  # contradictions are among them


def test_numbers_that_a_rule_takes_for_the_same_are_those_of_stock_pellet(tmp_path):
    numbers = numbers_ontology(tmp_path)
    terms = numbers.content.all_terms()
    found = Reasoner(numbers, "pellet", terms=terms).analyze(KnowledgeState()).facts
    assert (
        found
        == Reasoner(numbers, "owlready2", TimeLimit(180.0), terms).analyze(KnowledgeState()).facts
    )
    matching = {(fact.subject, fact.value) for fact in found if fact.property == "is"}
    assert {
        ("integer", "int"),
        ("padded", "integer"),
        ("decimal", "whole_decimal"),
        ("half", "long_half"),
    } <= matching
    assert matching.isdisjoint(
        {("integer", "decimal"), ("whole_decimal", "int"), ("double", "decimal")}
    )
