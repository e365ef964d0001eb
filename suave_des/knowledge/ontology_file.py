"""Read one ontology file: hardened XML first, then RDF.

The XML is read by expat before anything else sees it: for line numbers, and to refuse what could reach for
other files or blow up. Simple internal entities, as Protégé writes them, are accepted.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from urllib.parse import urldefrag, urljoin
from xml.parsers import expat
from xml.sax import SAXParseException

import rdflib
from rdflib import Graph, URIRef
from rdflib.namespace import OWL
from rdflib.namespace import RDF as RDF_TERMS

from suave_des.errors import KnowledgeError
from suave_des.knowledge.vocabulary import OWL as OWL_NS
from suave_des.knowledge.vocabulary import RDF as RDF_NS

MAX_BYTES: Final = 64 * 2**20
MAX_ENTITIES: Final = 256
MAX_ENTITY_CHARS: Final = 512
MAX_EXPANSION: Final = 20
_XML_NS: Final = "http://www.w3.org/XML/1998/namespace"
_SAVE_AS: Final = "an OWL ontology in RDF/XML is expected, as Protégé saves it"
#: Characters that no IRI may contain (RFC 3987) and that would break the text handed to a reasoner.
_NOT_IN_IRI: Final = frozenset('<>"{}|\\^`') | {chr(code) for code in range(0x21)}


@dataclass(frozen=True)
class OntologyFile:
    """An ontology file that has been read and can be parsed.

    Attributes:
        path: where it is.
        content: its bytes.
        iris: the IRIs of the ontology (empty for an anonymous one), without a trailing '#'.
        base: xml:base of the document, if it has one.
        imports: (imported IRI, line) in the order of the file.
        graph: all its triples.
    """

    path: Path
    content: bytes = field(repr=False)
    iris: tuple[str, ...]
    base: str | None
    imports: tuple[tuple[str, int], ...]
    graph: Graph = field(repr=False, compare=False)

    def line_of(self, name: str) -> str | None:
        """Place of the first line that describes the thing of that name, as "line 12"."""
        # about="...#name", about="&suave;name" or ID="name"
        described = re.compile(rf"""(?:about|ID)=["'](?:[^"']*[#;/])?{re.escape(name)}["']""")
        for number, line in enumerate(self.content.decode("utf-8", "replace").splitlines(), start=1):
            if described.search(line):
                return f"line {number}"
        return None


class _Scan:
    """What one pass of expat finds out: refusals, the root element and the lines of the imports."""

    def __init__(self, path: Path, size: int) -> None:
        self.path = path
        self.budget = MAX_EXPANSION * size + 2**20
        self.entities = 0
        self.root: str | None = None
        self.base: str | None = None
        self.imports: list[tuple[str, int]] = []
        # With namespace_separator set, names arrive as "namespace name".
        self.parser = expat.ParserCreate(namespace_separator=" ")
        self.parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.EntityDeclHandler = self._entity
        self.parser.StartElementHandler = self._element
        self.parser.CharacterDataHandler = self._text

    def refuse(self, problem: str, remedy: str | None = None) -> KnowledgeError:
        return KnowledgeError(problem, file=self.path, place=f"line {self.parser.CurrentLineNumber}", remedy=remedy)

    def _doctype(self, name: str, system_id: str | None, public_id: str | None, _internal: bool) -> None:
        if name.lower() == "html":
            raise self.refuse("this is a web page, not an ontology", _SAVE_AS)
        if system_id or public_id:
            raise self.refuse("the DOCTYPE refers to another file", "declare entities in the file itself")

    def _entity(
        self,
        name: str,
        is_parameter: bool,
        value: str | None,
        _base: str | None,
        system_id: str | None,
        public_id: str | None,
        _notation: str | None,
    ) -> None:
        self.entities += 1
        if is_parameter or value is None or system_id or public_id:
            raise self.refuse(
                f"entity {name} is external or a parameter entity", "only simple internal entities are read"
            )
        if "&" in value or ("%" in value and ";" in value):
            raise self.refuse(f"entity {name} refers to other entities", "write its value out")
        if len(value) > MAX_ENTITY_CHARS or self.entities > MAX_ENTITIES:
            raise self.refuse(
                f"entity {name} is too large, or one too many",
                f"at most {MAX_ENTITIES} entities of {MAX_ENTITY_CHARS} characters",
            )

    def _spend(self, characters: int) -> None:
        self.budget -= characters
        if self.budget < 0:
            raise self.refuse("the entities in this file expand to far more than its size")

    def _element(self, name: str, attributes: dict[str, str]) -> None:
        self._spend(sum(map(len, attributes.values())))
        if self.root is None:
            self.root = name
            self.base = attributes.get(f"{_XML_NS} base")
        elif name == f"{OWL_NS} imports":
            target = attributes.get(f"{RDF_NS} resource")
            if target is not None:
                iri = urljoin(self.base, target) if self.base else target
                self.imports.append((iri, self.parser.CurrentLineNumber))

    def _text(self, text: str) -> None:
        self._spend(len(text))


def read_ontology(path: Path, content: bytes | None = None) -> OntologyFile:
    """Read and check one ontology file.

    Args:
        path: where it is.
        content: what to take for its content, instead of reading it.

    Raises:
        KnowledgeError: missing, a folder, empty, too large, not XML, not OWL in RDF/XML, or with external,
            nested or oversized entities; with the line where it is known.
    """
    if content is None:
        content = _read_bytes(path)
    scan = _Scan(path, len(content))
    try:
        scan.parser.Parse(content, True)
    except expat.ExpatError as error:
        problem = f"not well-formed XML: {expat.ErrorString(error.code)}"
        raise KnowledgeError(
            problem, file=path, place=f"line {error.lineno}, column {error.offset + 1}", remedy=_SAVE_AS
        ) from error
    if scan.root == f"{OWL_NS} Ontology":
        raise KnowledgeError("this is OWL/XML", file=path, remedy="save it in Protégé as RDF/XML")
    if scan.root != f"{RDF_NS} RDF":
        root = (scan.root or "").split(" ")[-1]
        raise KnowledgeError(f"not OWL: the root element is <{root}>", file=path, remedy=_SAVE_AS)
    graph = _parse_rdf(path, content)
    ontologies = sorted(graph.subjects(RDF_TERMS.type, OWL.Ontology), key=str)
    if not ontologies:
        raise KnowledgeError("not OWL: there is no owl:Ontology in it", file=path, remedy=_SAVE_AS)
    lines = dict(reversed(scan.imports))
    imports = {str(iri): lines.get(str(iri), 0) for iri in graph.objects(None, OWL.imports)}
    return OntologyFile(
        path=path,
        content=content,
        iris=tuple(str(iri) for iri in ontologies if isinstance(iri, URIRef)),
        base=scan.base,
        imports=tuple(sorted(imports.items(), key=lambda item: (item[1], item[0]))),
        graph=graph,
    )


def _read_bytes(path: Path) -> bytes:
    if path.is_dir():
        raise KnowledgeError("this is a folder", file=path, remedy="give an ontology file")
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise KnowledgeError(
                f"{size / 2**20:.0f} MiB is too large for an ontology",
                file=path,
                remedy=f"at most {MAX_BYTES // 2**20} MiB are read",
            )
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise KnowledgeError("no such file", file=path, remedy="give an existing ontology file") from error
    except OSError as error:
        raise KnowledgeError(f"cannot be read: {error.strerror}", file=path) from error
    if not content.strip():
        raise KnowledgeError("the file is empty", file=path, remedy=_SAVE_AS)
    return content


@contextmanager
def without_log() -> Iterator[None]:
    """Keep what rdflib logs of odd terms off the terminal."""
    logger = logging.getLogger("rdflib.term")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)


@contextmanager
def _literally() -> Iterator[None]:
    """Let rdflib take literals as they are written: it would otherwise write the ill-formed decimal 1e3 as 1000.

    What it logs is checked after parsing.
    """
    before = rdflib.NORMALIZE_LITERALS
    rdflib.NORMALIZE_LITERALS = False
    try:
        with without_log():
            yield
    finally:
        rdflib.NORMALIZE_LITERALS = before


def _parse_rdf(path: Path, content: bytes) -> Graph:
    graph = Graph()
    try:
        with _literally():
            # A file without xml:base gets a base that says nothing about this machine's folders.
            graph.parse(data=content, format="xml", publicID=f"http://ontology.invalid/{path.stem}")
    except Exception as error:  # the parser raises many kinds; each means that this file is not RDF/XML
        text = error.getMessage() if isinstance(error, SAXParseException) else str(error)
        place = f"line {error.getLineNumber()}" if isinstance(error, SAXParseException) else None
        raise KnowledgeError(
            f"not RDF/XML: {' '.join(text.split())}", file=path, place=place, remedy=_SAVE_AS
        ) from error
    for triple in graph:
        for term in triple:
            if isinstance(term, URIRef) and not _NOT_IN_IRI.isdisjoint(term):
                raise KnowledgeError(f"{str(term)!r} is not an IRI", file=path, remedy='no spaces or <>"{}|\\^`')
    return graph


def same_iri(iri: str) -> str:
    """An IRI in the form in which two that mean the same ontology are equal: no scheme, no end mark."""
    return urldefrag(iri)[0].partition("://")[2].rstrip("/") or iri
