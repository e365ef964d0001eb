"""Small ontologies made at random: schema axioms of every kind that Pellet concludes facts with, and rules."""

from __future__ import annotations

import random
from pathlib import Path

from rdflib import RDF, RDFS, XSD, BNode, Graph, Literal, Namespace, URIRef
from rdflib.collection import Collection
from rdflib.namespace import OWL
from rdflib.term import Node

NS = Namespace("http://example.org/generated#")
_BODIES = ("related1(?x, ?y)", "related2(?x, ?y)", "Kind1(?x)", "Kind2(?x)", "size1(?x, ?s) ^ swrlb:greaterThan(?s, 2)")
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
    for kind, names in ((OWL.Class, classes), (OWL.ObjectProperty, objects), (OWL.DatatypeProperty, data)):
        for name in names:
            graph.add((name, RDF.type, kind))
    for thing in things:
        graph.add((thing, RDF.type, OWL.NamedIndividual))
        graph.add((thing, RDF.type, draw.choice(classes)))
        for name in draw.sample(objects, 2):
            graph.add((thing, name, draw.choice(things)))
        if draw.random() < 0.7:
            graph.add((thing, NS.size1, Literal(str(draw.choice([1, 2, 3])), datatype=XSD.decimal)))
        if draw.random() < 0.4:
            graph.add((thing, NS.label1, Literal(draw.choice(["one", "two"]), datatype=XSD.string)))
    for _ in range(draw.randint(4, 8)):
        _add_axiom(graph, draw, classes, objects, things)
    owl, rules = folder / f"generated{number}.owl", folder / f"generated{number}.swrl"
    graph.serialize(owl, format="xml")
    chosen = [f"rule{n}: {draw.choice(_BODIES)} -> {draw.choice(_HEADS)}\n" for n in range(draw.randint(0, 3))]
    rules.write_text("".join(chosen))
    return owl, rules


def _add_axiom(
    graph: Graph, draw: random.Random, classes: list[URIRef], objects: list[URIRef], things: list[URIRef]
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
            graph.add((name, RDF.type, OWL.FunctionalProperty))  # two values are then the same individual
        case 6:
            graph.add((name, RDFS.domain, one))
            graph.add((second, RDFS.range, other))
        case 7:
            first, same = draw.sample(things, 2)
            graph.add((first, OWL.sameAs, same))
        case 8:
            value = Literal(draw.choice(["one", "two"]), datatype=XSD.string)
            graph.add((one, OWL.equivalentClass, _restriction(graph, NS.label1, OWL.hasValue, value)))
        case 9:
            restriction = _restriction(graph, name, OWL.hasValue, draw.choice(things))
            graph.add((one, draw.choice([OWL.equivalentClass, RDFS.subClassOf]), restriction))
        case 10:
            graph.add((one, OWL.equivalentClass, _restriction(graph, name, OWL.someValuesFrom, other)))
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
