"""Rules as RDF: read from an ontology's graph, and written as triples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Final

from rdflib import BNode, Graph, Literal, URIRef
from rdflib.namespace import RDF, RDFS
from rdflib.term import Node

from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rdf import SWRL, SWRLA, RdfTriple, literal, local_name
from suave_des.knowledge.rules.syntax import (
    DIFFERENT,
    EXPRESSION,
    KINDS,
    SAME,
    Atom,
    AtomKind,
    Named,
    Rule,
    Term,
    Variable,
)
from suave_des.knowledge.rules.writer import distinct_variables, line_of_rule

IMP: Final = URIRef(SWRL + "Imp")
_VARIABLE: Final = URIRef(SWRL + "Variable")
ENABLED: Final = URIRef(SWRLA + "isRuleEnabled")
_PREDICATE_OF: Final = {
    "object": "propertyPredicate",
    "data": "propertyPredicate",
    "class": "classPredicate",
    "range": "dataRange",
    "builtin": "builtin",
}
_CLASS_OF: Final = {kind: name for name, kind in KINDS.items()}
#: Beginnings of the IRIs that Protégé and owlready2 give to variables.
VARIABLE_IRIS: Final = ("urn:swrl:var#", "urn:swrl#")


def rules_of(file: OntologyFile) -> tuple[Rule, ...]:
    """All rules of one file, enabled or not, sorted by name and text."""
    return _read_rules(file.path, file.graph)


@lru_cache(maxsize=4)  # as many as there are graphs in the cache of those: their rules are read again and again
def _read_rules(path: Path, graph: Graph) -> tuple[Rule, ...]:
    found = sorted(
        ((line_of_rule(*_sides(graph, node)), node) for node in graph.subjects(RDF.type, IMP)),
        key=lambda rule: (rule[0][0], str(rule[1])),
    )
    unnamed = 0
    rules = []
    for (text, body, head), node in found:
        label = graph.value(node, RDFS.label)
        name = str(label) if label is not None else local_name(str(node))
        if label is None and isinstance(node, BNode):
            unnamed += 1
            name = f"rule {unnamed} without a name"
        rules.append(
            Rule(
                name=name,
                text=text,
                file=path,
                enabled=str(graph.value(node, ENABLED)).strip().lower() not in ("false", "0"),
                node=node,
                triples=tuple(_closure(graph, node)),
                body=body,
                head=head,
            )
        )
    return tuple(sorted(rules, key=lambda rule: (rule.name, rule.text)))


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
    if start is not None:
        with suppress(ValueError):
            yield from graph.items(start)


def _sides(graph: Graph, rule: Node) -> list[tuple[Atom, ...]]:
    """Body and head, with short names for variables."""
    sides = [
        [_read_atom(graph, atom) for atom in _items(graph, graph.value(rule, URIRef(SWRL + side)))]
        for side in ("body", "head")
    ]
    names = distinct_variables((*sides[0], *sides[1]))

    def renamed(term: Term) -> Term:
        return Variable(names[term.name]) if isinstance(term, Variable) else term

    return [tuple(replace(atom, arguments=tuple(map(renamed, atom.arguments))) for atom in side) for side in sides]


def _read_atom(graph: Graph, node: Node) -> Atom:
    kinds = sorted(str(kind) for kind in graph.objects(node, RDF.type))
    kind: AtomKind = next((KINDS[name] for name in kinds if name in KINDS), "")
    predicates = (graph.value(node, URIRef(SWRL + name)) for name in dict.fromkeys(_PREDICATE_OF.values()))
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
    return Atom(kind, name, tuple(_read_term(graph, term) for term in arguments))


def _read_term(graph: Graph, term: Node) -> Term:
    if isinstance(term, Literal):
        return literal(term)
    if (term, RDF.type, _VARIABLE) in graph or str(term).startswith(VARIABLE_IRIS):
        return Variable(str(term))
    return Named(str(term))


def with_triples(rule: Rule) -> Rule:
    """Add the RDF of a rule that was read from text."""
    triples: list[RdfTriple] = [(rule.node, RDF.type, IMP), (rule.node, RDFS.label, Literal(rule.name))]
    for variable in dict.fromkeys(name for atom in rule.atoms for name in atom.variables()):
        triples.append((_write_term(Variable(variable)), RDF.type, _VARIABLE))
    for side, atoms in (("body", rule.body), ("head", rule.head)):
        nodes = [_write_atom(atom, triples) for atom in atoms]
        triples.append((rule.node, URIRef(SWRL + side), _write_list(nodes, SWRL + "AtomList", triples)))
    return replace(rule, triples=tuple(triples))


def _write_term(term: Term) -> Node:
    if isinstance(term, Variable):
        return URIRef(VARIABLE_IRIS[0] + term.name)
    if isinstance(term, Named):
        return URIRef(term.iri)
    if term.datatype.startswith("@"):
        return Literal(term.text, lang=term.datatype[1:])
    return Literal(term.text, datatype=URIRef(term.datatype), normalize=False)


def _write_atom(atom: Atom, triples: list[RdfTriple]) -> Node:
    node = BNode()
    triples.append((node, RDF.type, URIRef(_CLASS_OF[atom.kind])))
    if atom.kind in _PREDICATE_OF:
        triples.append((node, URIRef(SWRL + _PREDICATE_OF[atom.kind]), URIRef(atom.predicate)))
    if atom.kind == "builtin":
        arguments = _write_list([_write_term(term) for term in atom.arguments], str(RDF.List), triples)
        triples.append((node, URIRef(SWRL + "arguments"), arguments))
    else:
        for number, term in enumerate(atom.arguments[:2], start=1):
            triples.append((node, URIRef(f"{SWRL}argument{number}"), _write_term(term)))
    return node


def _write_list(items: Sequence[Node], kind: str, triples: list[RdfTriple]) -> Node:
    rest: Node = RDF.nil
    for item in reversed(items):
        node = BNode()
        triples += [(node, RDF.type, URIRef(kind)), (node, RDF.first, item), (node, RDF.rest, rest)]
        rest = node
    return rest
