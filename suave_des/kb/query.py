"""Query in SPARQL what the ontologies and a state assert, and what follows from them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import rdflib
from rdflib.namespace import RDFS

from suave_des.errors import InputError, nearest
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.in_process import InProcessPellet
from suave_des.knowledge.rdf import PREFIXES, Triple, n_triple
from suave_des.knowledge.state import KnowledgeState

_UNNAMED: Final = re.compile(r"(?<![^\s])_:([A-Za-z0-9]+)(?=\s)")
_MODEL_NAME: Final = re.compile(r"\b(?:suave|tomasys|mros):\w(?:[\w.-]*\w)?")
_PREFIXES: Final = {name: PREFIXES[name] for name in ("suave", "tomasys", "mros", "rdf", "rdfs", "owl", "xsd", "swrl")}


@dataclass(frozen=True)
class QueryResult:
    """A table of answers.

    Attributes:
        columns: names of the variables; "answer" for ASK; subject, predicate, object for CONSTRUCT and DESCRIBE.
        rows: texts, sorted unless the query orders them; known namespaces as prefixes; None for an unbound variable.
        unknown: names in the query that the knowledge base does not have, each with the nearest one in parentheses.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str | None, ...], ...]
    unknown: tuple[str, ...] = ()


def graph_of(base: Ontology, state: KnowledgeState | None, *, inferred: bool) -> rdflib.Graph:
    """Return the graph that queries are answered from, with labels and comments; see KnowledgeBase.query."""
    situation = () if state is None else base.assertions(state)
    more: Iterable[Triple] = InProcessPellet(base, base.content.all_terms()).infer(situation) if inferred else ()
    graph = rdflib.Graph("SimpleMemory")  # in the order in which they came: an answer with LIMIT is always the same
    lines = base.content.n_triples(base.content.rules) + "".join(map(n_triple, (*situation, *more)))
    names = {name: rdflib.BNode(name) for name in _UNNAMED.findall(lines)}
    graph.parse(data=lines, format="nt", bnode_context=names)
    for source in base.sources:
        for predicate in (RDFS.label, RDFS.comment):
            for subject, value in sorted(source.graph.subject_objects(predicate)):
                if isinstance(subject, rdflib.URIRef):
                    graph.add((subject, predicate, value))
    for prefix, namespace in _PREFIXES.items():
        graph.bind(prefix, namespace, override=True, replace=True)
    return graph


def answer(graph: rdflib.Graph, text: str) -> QueryResult:
    """Answer a query from a graph of graph_of; see KnowledgeBase.query."""
    from rdflib.plugins.sparql import prepareQuery

    try:
        query = prepareQuery(text, initNs=_PREFIXES)
    except Exception as error:  # the parser raises many kinds; each means that this is not a query
        reason = " ".join(str(error).split()) or type(error).__name__
        remedy = "for instance SELECT ?d WHERE { ?d tomasys:solvesF ?f }"
        raise InputError(f"not a SPARQL query: {reason}", remedy=remedy) from None
    if "ServiceGraphPattern" in str(query.algebra) or query.algebra.get("datasetClause"):
        raise InputError(
            "SERVICE and FROM read from other sources", remedy="remove them: only the knowledge base can be queried"
        )
    unknown = tuple(_unknown(graph, text))
    try:
        result = graph.query(query)
        if result.type == "ASK":
            return QueryResult(("answer",), ((str(result.askAnswer).lower(),),), unknown)
        if result.type == "SELECT":
            columns = list(map(str, result.vars or ()))
            if "*" in text.partition("{")[0]:  # all variables, which rdflib returns in any order
                columns.sort()
            rows = [tuple(_text(graph, row[name]) for name in columns) for row in result]  # type: ignore
            ordered = "OrderBy" in str(query.algebra)
            return QueryResult(tuple(columns), tuple(rows if ordered else sorted(rows, key=_sortable)), unknown)
        triples = [tuple(_text(graph, term) for term in triple) for triple in result.graph or ()]
        return QueryResult(("subject", "predicate", "object"), tuple(sorted(triples, key=_sortable)), unknown)
    except InputError:
        raise
    except Exception as error:  # evaluation raises whatever the functions of the query raise
        raise InputError(f"the query cannot be answered: {' '.join(str(error).split())}") from None


def _unknown(graph: rdflib.Graph, text: str) -> Iterator[str]:
    """Yield the names of the models' namespaces in a query that no triple has, with the nearest one that some has."""
    known = {str(_text(graph, each)) for each in (*graph.all_nodes(), *graph.predicates())}
    for name in sorted({*_MODEL_NAME.findall(text)} - known):
        near = nearest(name, known)
        yield f"{name} ({near})" if near else name


def _sortable(row: tuple[str | None, ...]) -> tuple[str, ...]:
    return tuple(cell or "" for cell in row)


def _text(graph: rdflib.Graph, term: object) -> str | None:
    if term is None:
        return None
    if isinstance(term, rdflib.URIRef):
        name = graph.namespace_manager.normalizeUri(term)
        return name.strip("<>") if name.startswith("<") else name
    return f"_:{term}" if isinstance(term, rdflib.BNode) else str(term)
