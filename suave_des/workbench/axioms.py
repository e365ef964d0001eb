"""Axioms as text, each on one line, so that those of two knowledge bases can be compared."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import rdflib
from rdflib.term import Node

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import Lit, Triple, facts_of, is_fact, term_of
from suave_des.knowledge.rules.writer import literal_text
from suave_des.knowledge.vocabulary import RDF_TYPE, local_name


@dataclass(frozen=True)
class AxiomDifference:
    """Axioms and rules that only one of two knowledge bases has, as text.

    Attributes:
        removed: that only the first has.
        added: that only the second has.
    """

    removed: tuple[str, ...]
    added: tuple[str, ...]

    def lines(self) -> Iterator[str]:
        """The difference as `kb diff` prints it; nothing where there is none."""
        if not self.removed and not self.added:
            return
        yield f"axioms and rules: {len(self.removed)} removed, {len(self.added)} added"
        yield from (f"  - {text}" for text in self.removed)
        yield from (f"  + {text}" for text in self.added)


def compare_axioms(one: Ontology, other: Ontology) -> AxiomDifference:
    """Compare the axioms, facts and rules of two knowledge bases; labels and comments do not count."""
    before, after = frozenset(axioms_of(one)), frozenset(axioms_of(other))
    return AxiomDifference(tuple(sorted(before - after)), tuple(sorted(after - before)))


def axioms_of(base: Ontology) -> Iterator[str]:
    """Give every axiom, fact and rule as text."""
    for triple in (*base.content.triples, *base.model.triples()):
        yield _triple(base, triple)
    yield from _structure(base)
    for rule in base.rules:
        yield f"rule {rule.name}: {rule.text}" + ("" if rule.enabled else " (switched off)")


def _triple(base: Ontology, triple: Triple) -> str:
    if is_fact(triple):
        return str(next(facts_of([triple], base.names)))
    subject, predicate, value = triple
    shown = literal_text(value) if isinstance(value, Lit) else base.names.short(value)
    if predicate == RDF_TYPE:
        return f"{shown}({base.names.short(subject)})"
    return f"{base.names.short(subject)} {local_name(predicate)} {shown}"


def _structure(base: Ontology) -> Iterator[str]:
    """Axioms with class expressions: what has no name is written out in brackets."""
    graph = rdflib.Graph().parse(data="".join(base.content.structure), format="nt")

    def text(node: Node, above: frozenset[Node]) -> str:
        if not isinstance(node, rdflib.BNode):
            term = term_of(node)
            return literal_text(term) if isinstance(term, Lit) else base.names.short(term)
        if node in above:
            return "[...]"
        parts = sorted(
            f"{local_name(str(predicate))} {text(value, above | {node})}"
            for predicate, value in graph.predicate_objects(node)
        )
        return f"[{'; '.join(parts)}]"

    for subject in sorted(set(graph.subjects()), key=str):
        is_part = isinstance(subject, rdflib.BNode) and next(graph.subjects(object=subject), None) is not None
        if is_part:
            continue
        if isinstance(subject, rdflib.BNode):
            yield text(subject, frozenset())
            continue
        for predicate, value in graph.predicate_objects(subject):
            yield f"{text(subject, frozenset())} {local_name(str(predicate))} {text(value, frozenset({subject}))}"
