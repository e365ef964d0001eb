"""Stock owlready2: sync_reasoner_pellet, in a fresh world and a new Java process for each
inference.

Slow (about a second each) and simple: the reference for the reasoner in this process.
"""

from __future__ import annotations

import io
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import owlready2
import owlready2.reasoning
from rdflib import URIRef
from rdflib.namespace import OWL, RDF, RDFS
from rdflib.term import Node

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import Ontology, Terms
from suave_des.knowledge.pellet.in_process import java_executable, launcher_environment
from suave_des.knowledge.rdf import RDF as RDF_IRI
from suave_des.knowledge.rdf import (
    RDF_TYPE,
    XSD,
    Lit,
    Triple,
    for_pellet,
    n_triple,
    reached,
    term_of,
)

_PLAIN: Final = RDF_IRI + "PlainLiteral"
_STATE_IRI: Final = "urn:suave-des:state"


class StockPellet:
    """owlready2, which starts Pellet in a Java process of its own.

    Args:
        terms: what to read after an inference; None: what decisions depend on, and what rules
            assert.
    """

    def __init__(self, ontology: Ontology, terms: Terms | None = None) -> None:
        content = ontology.content
        self._text = content.n_triples()
        self._joined = content.joined_by_rules().n_triples() if content.given_back else ""
        self._given_back = content.given_back
        self._properties, self._classes = terms or content.decision_terms()

    def infer(
        self, assertions: Sequence[Triple], limit_s: float | None = None
    ) -> frozenset[Triple] | None:
        """Return the values and members of the properties and classes to read; None for a
        contradiction.

        What must be given back (see Content) is, until nothing new follows.

        Raises:
            TimeoutError: it took longer than the limit; its Java process is ended.
        """
        more = frozenset[Triple]()
        while True:
            if self._joined:
                found, following = self._infer(self._joined, (*assertions, *sorted(more)), limit_s)
                if found is None:
                    return None
                more |= following
            found, following = self._infer(self._text, (*assertions, *sorted(more)), limit_s)
            if following <= more:
                return found
            more |= following

    def _infer(
        self, text: str, assertions: Sequence[Triple], limit_s: float | None
    ) -> tuple[frozenset[Triple] | None, frozenset[Triple]]:
        """One run: what follows of the terms to read, and of the properties to give back."""
        # owlready2 passes these on to subprocess.run, and has no other parameter for it.
        owlready2.reasoning._subprocess_kargs.update(timeout=limit_s, env=launcher_environment())
        owlready2.JAVA_EXE = str(java_executable())
        world = owlready2.World()
        try:
            numbers = [
                each
                for each in assertions
                if isinstance(each[2], Lit) and each[2].datatype == XSD + "decimal"
            ]
            text += "".join(n_triple(triple) for triple in assertions if triple not in numbers)
            ontology = world.get_ontology(_STATE_IRI).load(
                fileobj=io.BytesIO(text.encode()), only_local=True
            )
            for triple in numbers:
                _add_exactly(world, ontology, triple)
            if not _reason(world):
                return None, frozenset()
            found = frozenset(self._read(world)).difference(map(_as_float, numbers)).union(numbers)
            return found, frozenset(_values(world.as_rdflib_graph(), self._given_back))
        finally:
            world.close()

    def _read(self, world: Any) -> Iterator[Triple]:
        graph = world.as_rdflib_graph()
        yield from _values(graph, self._properties)
        for name in self._classes:
            for kind in _below(graph, name):
                for subject in graph.subjects(RDF.type, kind):
                    yield str(subject), RDF_TYPE, name


def _values(graph: Any, properties: Iterable[str]) -> Iterator[Triple]:
    for name in properties:
        for subject, _, value in graph.triples((None, URIRef(name), None)):
            yield str(subject), name, _value(value)


def _value(term: Node) -> str | Lit:
    """An IRI or a literal; text that Pellet returns is PlainLiteral, with its escapes left in by
    owlready2.
    """
    found = term_of(term)
    if isinstance(found, Lit) and found.datatype == _PLAIN:
        return Lit(owlready2.reasoning._unescape_pellet_str(found.text), XSD + "string")
    return (
        Lit("", XSD + "string") if found == Lit("()", XSD + "string") else found
    )  # () is how Pellet prints no text


def _below(graph: Any, name: str) -> set[Node]:
    """A class with all its subclasses: the reasoner returns only the nearest classes of an
    individual.
    """
    same = list(graph.subject_objects(OWL.equivalentClass))
    below = ((upper, lower) for lower, upper in [*graph.subject_objects(RDFS.subClassOf), *same])
    return reached([URIRef(name)], [*same, *below])


def _reason(world: owlready2.World) -> bool:
    """Let owlready2 run Pellet; false when the ontology is inconsistent."""
    try:
        owlready2.sync_reasoner_pellet(
            world, infer_property_values=True, infer_data_property_values=True, debug=0
        )
    except BaseException as error:
        _remove_temporary_file(error.__traceback__)
        if isinstance(error, owlready2.OwlReadyInconsistentOntologyError):
            return False
        if isinstance(error, subprocess.TimeoutExpired):
            raise TimeoutError from error
        if isinstance(error, owlready2.OwlReadyJavaError):
            reason = " ".join(str(error).split())[:400]
            raise KnowledgeError(f"Pellet, run by owlready2, failed: {reason}") from error
        raise
    return True


def _remove_temporary_file(trace: TracebackType | None) -> None:
    """Remove the file that owlready2 leaves behind when its reasoner fails or is interrupted, in
    any thread.
    """
    while trace is not None:
        file = trace.tb_frame.f_locals.get("tmp")
        if trace.tb_frame.f_code.co_name == "sync_reasoner_pellet" and file is not None:
            file.close()
            Path(file.name).unlink(missing_ok=True)
        trace = trace.tb_next


def _add_exactly(world: owlready2.World, ontology: owlready2.Ontology, triple: Triple) -> None:
    """Assert a decimal exactly: the loader would convert it to a float, and write 1e-05, not a
    decimal.
    """
    subject, predicate, value = triple
    assert isinstance(value, Lit)
    subject_id, predicate_id, datatype_id = map(
        world._abbreviate, (subject, predicate, value.datatype)
    )
    ontology._add_data_triple_raw_spod(
        subject_id, predicate_id, for_pellet(value).text, datatype_id
    )


def _as_float(triple: Triple) -> Triple:
    """Return the triple to which owlready2 may round a decimal when Pellet returns it: it is not a
    second value.
    """
    subject, predicate, value = triple
    assert isinstance(value, Lit)
    return subject, predicate, Lit(str(float(value.text)), value.datatype)
