"""Parse ontology files with rdflib.

Files are in RDF/XML or Turtle, of which N-Triples is a part. lxml reads the XML first: it stops at
entities that expand too far, and knows line numbers. Simple internal entities, as Protégé writes
them, are accepted.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urljoin
from xml.sax import SAXParseException

import rdflib
from lxml import etree
from rdflib import BNode, Graph, Literal, URIRef
from rdflib.namespace import OWL as OWL_TERMS
from rdflib.namespace import RDF as RDF_TERMS
from rdflib.term import Node

from suave_des.errors import KnowledgeError
from suave_des.knowledge.notation import RELATIVE_TO, TURTLE_ENDINGS, is_iri, text_of
from suave_des.knowledge.rdf import OWL, RDF, STRING, XSD, Lit, Triple, without_log

_BASE = "{http://www.w3.org/XML/1998/namespace}base"
_SAVE_AS = "an OWL ontology in RDF/XML or Turtle is expected, as Protégé saves it"
#: How files in Turtle begin, if they have another ending; comments may stand before.
_TURTLE = r"@prefix|@base|prefix\s+[\w.-]*:\s*<|base\s+<|(<[^<>\s]+>|_:\w+)\s+<[^<>\s]+>\s"
#: How files in the other notations that ontology editors save begin; comments may stand before.
_OTHER_NOTATIONS = {
    "OWL in Functional Syntax": r"(Prefix|Ontology)\s*\(",
    "OWL in Manchester Syntax": r"(Prefix|Ontology):",
    "JSON-LD": r"[\[{]",
}
_EXTERNAL = re.compile(r"<!(?:ENTITY\s+(?:%\s*)?|DOCTYPE\s+)\S+\s+(?:SYSTEM|PUBLIC)\b")


class Parsed(NamedTuple):
    """What a file states; see OntologyFile, whose attributes these are."""

    iris: tuple[str, ...]
    is_xml: bool
    base: str | None
    imports: tuple[tuple[str, int], ...]
    triples: tuple[Triple, ...]
    graph: Graph


@lru_cache(maxsize=4)
def parsed(path: Path, content: bytes) -> Parsed:
    """Parse and check the content of an ontology file; for errors see read_ontology."""
    if not content.strip():
        raise KnowledgeError("the file is empty", file=path, remedy=_SAVE_AS)
    try:
        text = re.sub(r"^\s*<\?xml[^>]*\?>", "", text_of(content), count=1)
    except UnicodeDecodeError as error:
        raise KnowledgeError(f"not text in {error.encoding}", file=path, remedy=_SAVE_AS) from error
    is_turtle = path.suffix in TURTLE_ENDINGS or _begins_with(_TURTLE, text)
    graph, base, lines = _turtle(path, text) if is_turtle else _rdf_xml(path, text)
    ontologies = sorted(graph.subjects(RDF_TERMS.type, OWL_TERMS.Ontology), key=str)
    if not ontologies:
        raise KnowledgeError("not OWL: there is no owl:Ontology in it", file=path, remedy=_SAVE_AS)
    imported = map(str, graph.objects(None, OWL_TERMS.imports))
    imports = {iri: lines.get(iri, 0) for iri in imported}
    return Parsed(
        iris=tuple(str(iri) for iri in ontologies if isinstance(iri, URIRef)),
        is_xml=not is_turtle,
        base=base,
        imports=tuple(sorted(imports.items(), key=lambda item: (item[1], item[0]))),
        triples=tuple(_converted(graph, hashlib.sha256(content).hexdigest()[:8])),
        graph=graph,
    )


def _begins_with(start: str, text: str) -> bool:
    return re.match(rf"\s*(#.*\s+)*({start})", text, re.IGNORECASE) is not None


def _turtle(path: Path, text: str) -> tuple[Graph, None, dict[str, int]]:
    """Parse a file in Turtle; return the graph, no base, and the lines that have whole IRIs."""
    lines: dict[str, int] = {}
    for number, line in enumerate(text.split("\n"), start=1):
        for iri in re.findall(r"<([^<>\s]*)>", line):
            lines.setdefault(iri, number)
            lines.setdefault(urljoin(RELATIVE_TO, iri) if is_iri(iri) else iri, number)
    return _parse_graph(path, text, "Turtle"), None, lines


def _rdf_xml(path: Path, text: str) -> tuple[Graph, str | None, dict[str, int]]:
    """Parse a file in RDF/XML; return the graph, xml:base, and the lines of imports."""
    for notation, start in _OTHER_NOTATIONS.items():
        if _begins_with(start, text):
            raise _another_notation(path, notation)
    root: Any = _parse_xml(path, text)  # lxml-stubs lack sourceline
    # owlready2 saves rdf:datatype="xsd:string", and RDF/XML has no prefixes in attributes.
    graph = _parse_graph(path, re.sub(r"""(?<=:datatype=["'])xsd:""", XSD, text), "RDF/XML")
    base = root.get(_BASE)
    lines: dict[str, int] = {}
    for element in root.iter(f"{{{OWL}}}imports"):
        iri = urljoin(base or RELATIVE_TO, element.get(f"{{{RDF}}}resource", ""))
        lines.setdefault(iri, element.sourceline or 0)
    return graph, None if base is None else str(base), lines


def _parse_xml(path: Path, text: str) -> etree._Element:
    """Return the root element, after checking that no entity refers to other files or expands too
    far.
    """
    if external := _EXTERNAL.search(text):
        line = text.count("\n", 0, external.start()) + 1
        problem = "its DOCTYPE or an entity refers to another file"
        remedy = "only simple internal entities are read"
        raise KnowledgeError(problem, file=path, place=f"line {line}", remedy=remedy)
    # lxml-stubs do not know "internal". Long rules are deeply nested: 256 levels, a hundred atoms,
    # are too few. The larger limit takes the one on expansion away, so it is used only where no
    # entity can be declared.
    options: Any = {"resolve_entities": "internal", "no_network": True, "load_dtd": False}
    options["huge_tree"] = "<!DOCTYPE" not in text
    try:
        root = etree.fromstring(text.encode(), etree.XMLParser(**options))
    except etree.XMLSyntaxError as error:
        line, column = error.position
        reason = re.sub(r", line \d+, column \d+$", "", error.msg or "")
        if "amplification" in reason:
            problem = "the entities in this file expand to far more than its size"
            raise KnowledgeError(problem, file=path, remedy="write their values out") from error
        place = f"line {line}, column {column}"
        raise KnowledgeError(
            f"not well-formed XML: {reason}", file=path, place=place, remedy=_SAVE_AS
        ) from error
    if root.tag != f"{{{RDF}}}RDF":
        name = etree.QName(root).localname
        if name == "Ontology":
            raise _another_notation(path, "OWL/XML")
        raise KnowledgeError(
            f"not RDF/XML: the root element is <{name}>", file=path, remedy=_SAVE_AS
        )
    return root


def _another_notation(path: Path, notation: str) -> KnowledgeError:
    remedy = "save it as RDF/XML or Turtle, in Protégé by Save as"
    return KnowledgeError(f"this is {notation}", file=path, remedy=remedy)


_FORMATS = {"RDF/XML": "xml", "Turtle": "turtle"}  # as rdflib names them
_BAD_TURTLE = re.compile(r"at line (\d+) of .*?Bad syntax \((.*?)\) at ", re.DOTALL)


def _parse_graph(path: Path, text: str, notation: str) -> Graph:
    """Parse a file."""
    # goes through triples in the order of the file, each time the same
    graph = Graph("SimpleMemory")
    # it would write the ill-formed 1e3 as 1000
    before = rdflib.NORMALIZE_LITERALS
    rdflib.NORMALIZE_LITERALS = False
    try:
        with without_log():
            graph.parse(data=text, format=_FORMATS[notation], publicID=RELATIVE_TO + path.stem)
    except Exception as error:  # the parsers raise many kinds, each for a file of another notation
        reason = str(error)
        line: int | str | None = None
        if isinstance(error, SAXParseException):
            reason = error.getMessage()
            line = error.getLineNumber()
        elif found := _BAD_TURTLE.search(reason):
            line, reason = found.groups()
        problem = f"not {notation}: {' '.join(reason.split())}"
        place = f"line {line}" if line else None
        raise KnowledgeError(problem, file=path, place=place, remedy=_SAVE_AS) from error
    finally:
        rdflib.NORMALIZE_LITERALS = before
    for term in chain.from_iterable(graph):
        if isinstance(term, URIRef) and not is_iri(term):
            raise KnowledgeError(
                f"{str(term)!r} is not an IRI", file=path, remedy='no spaces or <>"{}|\\^`'
            )
    return graph


def _converted(graph: Graph, scope: str) -> Iterator[Triple]:
    """The triples of a graph; the scope begins the names of blank nodes, which tools for N-Triples
    can read.
    """
    names: dict[Node, str] = {}
    for triple in graph:
        for term in triple:
            if isinstance(term, BNode):
                names.setdefault(term, f"_:f{scope}n{len(names)}")
        subject, predicate, value = triple
        yield names.get(subject, str(subject)), str(predicate), names.get(value) or term_of(value)


def term_of(term: Node) -> str | Lit:
    """Convert an IRI or a literal of rdflib; plain text is xsd:string (RDF 1.1)."""
    if not isinstance(term, Literal):
        return str(term)
    return Lit(str(term), f"@{term.language}" if term.language else str(term.datatype or STRING))
