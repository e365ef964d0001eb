"""The SWRL rules of an ontology: found in its graph, named, and written out as text for messages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from rdflib import BNode, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.namespace import RDF, RDFS
from rdflib.term import Node

from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.vocabulary import SWRL, SWRLA, local_name

RdfTriple = tuple[Node, Node, Node]

IMP: Final = URIRef(SWRL + "Imp")
_VARIABLE: Final = URIRef(SWRL + "Variable")
_ENABLED: Final = URIRef(SWRLA + "isRuleEnabled")
_PROPERTY: Final = URIRef(SWRL + "propertyPredicate")
_CLASS: Final = URIRef(SWRL + "classPredicate")
_DATA_ATOM: Final = URIRef(SWRL + "DatavaluedPropertyAtom")


@dataclass(frozen=True)
class Rule:
    """One SWRL rule.

    Attributes:
        name: its rdfs:label, else the last part of its IRI, else its number among the unnamed of the file.
        text: the rule as people write it, body -> head.
        file: the ontology file it stands in.
        enabled: false when swrla:isRuleEnabled says so; Pellet itself ignores that mark.
        node: its node in the graph.
        triples: all triples that make it up.
        properties: (property, whether it is used as a data property) of all its atoms.
        head_properties: (property, whether its values are data) that the head asserts.
        head_classes: classes that the head asserts membership in.
    """

    name: str
    text: str
    file: Path
    enabled: bool
    node: Node = field(repr=False)
    triples: tuple[RdfTriple, ...] = field(repr=False)
    properties: frozenset[tuple[str, bool]] = field(repr=False)
    head_properties: frozenset[tuple[str, bool]]
    head_classes: frozenset[str]


def rules_of(file: OntologyFile) -> tuple[Rule, ...]:
    """All rules of one file, enabled or not, sorted by name and text."""
    graph = file.graph
    found = sorted((_text(graph, node), str(node), node) for node in graph.subjects(RDF.type, IMP))
    unnamed = 0
    rules = []
    for text, _, node in found:
        label = graph.value(node, RDFS.label)
        if label is None and isinstance(node, BNode):
            unnamed += 1
        name = str(label) if label is not None else local_name(str(node))
        if label is None and isinstance(node, BNode):
            name = f"rule {unnamed} without a name"
        head = tuple(_items(graph, graph.value(node, URIRef(SWRL + "head"))))
        rules.append(
            Rule(
                name=name,
                text=text,
                file=file.path,
                enabled=str(graph.value(node, _ENABLED)).strip().lower() not in ("false", "0"),
                node=node,
                triples=tuple(_closure(graph, node)),
                properties=_properties(graph, (*head, *_items(graph, graph.value(node, URIRef(SWRL + "body"))))),
                head_properties=_properties(graph, head),
                head_classes=frozenset(
                    str(term) for atom in head for term in graph.objects(atom, _CLASS) if isinstance(term, URIRef)
                ),
            )
        )
    return tuple(sorted(rules, key=lambda rule: (rule.name, rule.text)))


def _properties(graph: Graph, atoms: Iterable[Node]) -> frozenset[tuple[str, bool]]:
    return frozenset(
        (str(term), (atom, RDF.type, _DATA_ATOM) in graph) for atom in atoms for term in graph.objects(atom, _PROPERTY)
    )


def _closure(graph: Graph, start: Node) -> Iterator[RdfTriple]:
    """The triples of a rule: its own, and those of its lists and atoms, in a fixed order."""
    waiting, seen = [start], {start}
    while waiting:
        node = waiting.pop()
        for _, predicate, value in sorted(graph.triples((node, None, None)), key=lambda triple: str(triple[1])):
            yield node, predicate, value
            if value not in seen and (isinstance(value, BNode) or _is_part_of_rule(graph, value)):
                seen.add(value)
                waiting.append(value)


def _is_part_of_rule(graph: Graph, node: Node) -> bool:
    """Whether a named node is a list or an atom of a rule, as older editors write them."""
    return isinstance(node, URIRef) and any(
        str(kind).startswith(SWRL) and (str(kind).endswith(("Atom", "AtomList")))
        for kind in graph.objects(node, RDF.type)
    )


def _items(graph: Graph, start: Node | None) -> Iterator[Node]:
    return iter(()) if start is None else iter(Collection(graph, start))


def _term(graph: Graph, term: Node | None) -> str:
    if term is None:
        return "nothing"
    if isinstance(term, Literal):
        # Numbers and truth values stand bare, all else in quotes.
        bare = term.datatype is not None and local_name(str(term.datatype)) in ("boolean", "decimal", "integer")
        return str(term) if bare else '"' + str(term).replace("\\", "\\\\").replace('"', '\\"') + '"'
    name = local_name(str(term))
    return f"?{name}" if (term, RDF.type, _VARIABLE) in graph else name


def _atom(graph: Graph, atom: Node) -> str:
    def get(name: str) -> Node | None:
        return graph.value(atom, URIRef(SWRL + name))

    arguments = [get("argument1"), get("argument2")]
    predicate = get("propertyPredicate") or get("classPredicate") or get("dataRange") or get("builtin")
    if get("builtin") is not None:
        arguments = list(_items(graph, get("arguments")))
    kinds = [local_name(str(kind)) for kind in graph.objects(atom, RDF.type)]
    name = _term(graph, predicate) if predicate is not None else next(iter(kinds), "atom").removesuffix("Atom")
    return f"{name}({', '.join(_term(graph, term) for term in arguments if term is not None)})"


def _text(graph: Graph, rule: Node) -> str:
    def side(name: str) -> str:
        return " ^ ".join(_atom(graph, atom) for atom in _items(graph, graph.value(rule, URIRef(SWRL + name))))

    return f"{side('body')} -> {side('head')}"
