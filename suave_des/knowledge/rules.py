"""The SWRL rules of an ontology: found in its graph, named, and taken apart into atoms."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from rdflib import BNode, Graph, Literal, URIRef
from rdflib.namespace import RDF, RDFS
from rdflib.term import Node

from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rule_syntax import DIFFERENT, EXPRESSION, KINDS, SAME, Atom, Kind, Named, Term, Variable
from suave_des.knowledge.rule_writer import distinct_variables, line_of_rule
from suave_des.knowledge.situation import Lit
from suave_des.knowledge.vocabulary import SWRL, SWRLA, XSD, local_name

RdfTriple = tuple[Node, Node, Node]

IMP: Final = URIRef(SWRL + "Imp")
_VARIABLE: Final = URIRef(SWRL + "Variable")
_ENABLED: Final = URIRef(SWRLA + "isRuleEnabled")
_PREDICATES: Final = ("propertyPredicate", "classPredicate", "dataRange", "builtin")
#: Begin of the IRIs that Protégé and owlready2 give to variables.
VARIABLE_IRIS: Final = ("urn:swrl:var#", "urn:swrl#")


@dataclass(frozen=True)
class Rule:
    """One SWRL rule.

    Attributes:
        name: its rdfs:label, else the last part of its IRI, else its number among the unnamed of the file.
        text: the rule as people write it, body -> head.
        file: the ontology file it stands in, or the file of rules as text.
        enabled: false when swrla:isRuleEnabled says so; Pellet itself ignores that mark.
        node: its node in the graph.
        triples: all triples that make it up.
        body: atoms that must hold, each with its place: in the text for a rule from a graph, else in its file.
        head: atoms that then hold.
        place: "line 12" in a file of rules as text; None for a rule of an ontology.
    """

    name: str
    text: str
    file: Path
    enabled: bool
    node: Node = field(repr=False)
    triples: tuple[RdfTriple, ...] = field(repr=False)
    body: tuple[Atom, ...] = field(repr=False)
    head: tuple[Atom, ...] = field(repr=False)
    place: str | None = field(default=None, repr=False)

    @property
    def atoms(self) -> tuple[Atom, ...]:
        """Body and head."""
        return (*self.body, *self.head)

    @property
    def properties(self) -> frozenset[tuple[str, bool]]:
        """(property, whether it is used as a data property) of all atoms."""
        return _properties(self.atoms)

    @property
    def head_properties(self) -> frozenset[tuple[str, bool]]:
        """(property, whether its values are data) that the head asserts."""
        return _properties(self.head)

    @property
    def head_classes(self) -> frozenset[str]:
        """Classes that the head asserts membership in."""
        return frozenset(atom.predicate for atom in self.head if atom.kind == "class" and atom.predicate != EXPRESSION)


def _properties(atoms: Iterable[Atom]) -> frozenset[tuple[str, bool]]:
    return frozenset(
        (atom.predicate, atom.kind == "data") for atom in atoms if atom.kind in ("object", "data") and atom.predicate
    )


def rules_of(file: OntologyFile) -> tuple[Rule, ...]:
    """All rules of one file, enabled or not, sorted by name and text."""
    graph = file.graph
    found = sorted(
        ((_sides(graph, node), node) for node in graph.subjects(RDF.type, IMP)),
        key=lambda rule: (line_of_rule(*rule[0]).name, str(rule[1])),
    )
    unnamed = 0
    rules = []
    for sides, node in found:
        label = graph.value(node, RDFS.label)
        if label is None and isinstance(node, BNode):
            unnamed += 1
        name = str(label) if label is not None else local_name(str(node))
        if label is None and isinstance(node, BNode):
            name = f"rule {unnamed} without a name"
        line = line_of_rule(*sides)
        rules.append(
            Rule(
                name=name,
                text=line.name,
                file=file.path,
                enabled=str(graph.value(node, _ENABLED)).strip().lower() not in ("false", "0"),
                node=node,
                triples=tuple(_closure(graph, node)),
                body=line.body,
                head=line.head,
            )
        )
    return tuple(sorted(rules, key=lambda rule: (rule.name, rule.text)))


def literal(term: Literal) -> Lit:
    """A literal with its datatype; plain text is xsd:string, as RDF 1.1 says."""
    if term.language:
        return Lit(str(term), f"@{term.language}")
    return Lit(str(term), str(term.datatype) if term.datatype is not None else XSD + "string")


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
    """Items of a list; one that leads back into itself ends there."""
    seen: set[Node] = set()
    while start is not None and start != RDF.nil and start not in seen:
        seen.add(start)
        item = graph.value(start, RDF.first)
        if item is not None:
            yield item
        start = graph.value(start, RDF.rest)


def _sides(graph: Graph, rule: Node) -> tuple[tuple[Atom, ...], tuple[Atom, ...]]:
    body, head = (
        tuple(_atom(graph, atom) for atom in _items(graph, graph.value(rule, URIRef(SWRL + side))))
        for side in ("body", "head")
    )
    names = distinct_variables((*body, *head), local_name)

    def renamed(atoms: Iterable[Atom]) -> tuple[Atom, ...]:
        return tuple(
            replace(
                atom,
                arguments=tuple(
                    Variable(names[term.name]) if isinstance(term, Variable) else term for term in atom.arguments
                ),
            )
            for atom in atoms
        )

    return renamed(body), renamed(head)


def _atom(graph: Graph, node: Node) -> Atom:
    kinds = sorted(str(kind) for kind in graph.objects(node, RDF.type))
    kind: Kind = next((KINDS[name] for name in kinds if name in KINDS), "")
    predicates = [graph.value(node, URIRef(SWRL + name)) for name in _PREDICATES]
    predicate = next((term for term in predicates if term is not None), None)
    if kind == "builtin":
        arguments = list(_items(graph, graph.value(node, URIRef(SWRL + "arguments"))))
    else:
        given = [graph.value(node, URIRef(SWRL + name)) for name in ("argument1", "argument2")]
        arguments = [term for term in given if term is not None]
    if isinstance(predicate, BNode):
        name = EXPRESSION
    elif predicate is not None:
        name = str(predicate)
    else:
        name = {"same": SAME, "different": DIFFERENT}.get(kind, "")
    return Atom(kind, name, tuple(_term(graph, term) for term in arguments))


def _term(graph: Graph, term: Node) -> Term:
    if isinstance(term, Literal):
        return literal(term)
    if (term, RDF.type, _VARIABLE) in graph or str(term).startswith(VARIABLE_IRIS):
        return Variable(str(term))
    return Named(str(term))
