"""Stock owlready2: sync_reasoner_pellet, in a fresh world and a new Java process for each
inference.

Slow (about a second each) and simple: the reference for the reasoner in this process.
"""

from __future__ import annotations

import io
import re
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from types import TracebackType

import owlready2
import owlready2.reasoning
from rdflib import Graph, URIRef
from rdflib.namespace import OWL, RDF, RDFS
from rdflib.term import Node

from suave_des.errors import KnowledgeError
from suave_des.knowledge.ontology import Ontology, Terms
from suave_des.knowledge.pellet.in_process import java_executable, launcher_environment
from suave_des.knowledge.rdf import (
    DECIMAL,
    RDF_TYPE,
    STRING,
    Lit,
    Triple,
    for_pellet,
    n_triple,
    reached,
)
from suave_des.knowledge.rdf import RDF as RDF_IRI
from suave_des.knowledge.rdf_files import term_of

_PLAIN = RDF_IRI + "PlainLiteral"
_STATE_IRI = "urn:suave-des:state"
#: Literals of N-Triples, and IRIs that come back otherwise from Pellet's output, which owlready2
#: reads: there Pellet writes apostrophes and characters beyond U+FFFF with escapes.
_LITERAL_OR_ODD_IRI = re.compile(
    r"""("(?:[^"\\]|\\.)*")|<([^<>]*['\U00010000-\U0010ffff][^<>]*)>"""
)
_STAND_IN = "urn:suave-des:name:"


class StockPellet:
    """owlready2, which starts Pellet in a Java process of its own.

    Args:
        terms: what to read after an inference; None: what decisions depend on, and what rules
            assert.
    """

    def __init__(self, ontology: Ontology, terms: Terms | None = None) -> None:
        content = ontology.content
        self._stand_ins: dict[str, str] = {}
        self._text = self._with_stand_ins(content.n_triples())
        self._joined = ""
        if content.given_back:
            self._joined = self._with_stand_ins(content.joined_by_rules().n_triples())
        self._given_back = content.given_back
        self._properties, self._classes = terms or content.decision_terms()

    def _with_stand_ins(self, text: str) -> str:
        """Return N-Triples with another IRI in place of each that would come back otherwise."""

        def stand_in(found: re.Match[str]) -> str:
            literal, iri = found.groups()
            if literal is not None:
                return str(literal)
            return f"<{self._stand_ins.setdefault(iri, f'{_STAND_IN}{len(self._stand_ins)}')}>"

        return _LITERAL_OR_ODD_IRI.sub(stand_in, text)

    def _named(self, term: str | Lit) -> str | Lit:
        """Return the term that one read from the world stands for."""
        if isinstance(term, Lit) or not term.startswith(_STAND_IN):
            return term
        return list(self._stand_ins)[int(term.removeprefix(_STAND_IN))]

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
                if isinstance(each[2], Lit) and each[2].datatype == DECIMAL
            ]
            others = [triple for triple in assertions if triple not in numbers]
            text += self._with_stand_ins("".join(map(n_triple, others)))
            ontology = world.get_ontology(_STATE_IRI).load(
                fileobj=io.BytesIO(text.encode()), only_local=True
            )
            for triple in numbers:
                subject = self._stand_ins.get(triple[0], triple[0])
                _add_exactly(world, ontology, (subject, *triple[1:]))
            if not _reason(world):
                return None, frozenset()
            found = frozenset(self._read(world)).difference(map(_as_float, numbers)).union(numbers)
            return found, frozenset(self._values(world.as_rdflib_graph(), self._given_back))
        finally:
            world.close()

    def _read(self, world: owlready2.World) -> Iterator[Triple]:
        graph = world.as_rdflib_graph()
        yield from self._values(graph, self._properties)
        for name in self._classes:
            for kind in _below(graph, self._stand_ins.get(name, name)):
                for subject in graph.subjects(RDF.type, kind):
                    yield str(self._named(str(subject))), RDF_TYPE, name

    def _values(self, graph: Graph, properties: Iterable[str]) -> Iterator[Triple]:
        for name in properties:
            iri = URIRef(self._stand_ins.get(name, name))
            for subject, _, value in graph.triples((None, iri, None)):
                yield str(self._named(str(subject))), name, self._named(_value(value))


def _value(term: Node) -> str | Lit:
    """An IRI or a literal; text that Pellet returns is PlainLiteral, with its escapes left in by
    owlready2.
    """
    found = term_of(term)
    if isinstance(found, Lit) and found.datatype == _PLAIN:
        return Lit(owlready2.reasoning._unescape_pellet_str(found.text), STRING)
    # () is how Pellet prints no text
    return Lit("", STRING) if found == Lit("()", STRING) else found


def _below(graph: Graph, name: str) -> set[Node]:
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
