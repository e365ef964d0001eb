"""Read ontology files.

Files are in RDF/XML or Turtle, of which N-Triples is a part. lxml reads the XML first: it stops at
entities that expand too far, and knows line numbers. Simple internal entities, as Protégé writes
them, are accepted.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import chain
from pathlib import Path
from typing import Any
from urllib.parse import urljoin, urlsplit
from xml.sax import SAXParseException

import rdflib
from lxml import etree
from rdflib import BNode, Graph, URIRef
from rdflib.namespace import OWL as OWL_TERMS
from rdflib.namespace import RDF as RDF_TERMS
from rdflib.term import Node

from suave_des.errors import KnowledgeError
from suave_des.files import read_bytes
from suave_des.knowledge.rdf import (
    FIRST,
    OWL,
    RDF,
    RDF_TYPE,
    RDFS,
    REST,
    XSD,
    Lit,
    Triple,
    links,
    term_of,
    without_log,
)

ONTOLOGY_LIMIT_BYTES = 64 * 2**20
_DECLARED_ENCODING = re.compile(rb"\s*<\?xml[^>]*\bencoding\s*=\s*[\"']([\w.-]+)[\"']")
_BASE = "{http://www.w3.org/XML/1998/namespace}base"
_SAVE_AS = "an OWL ontology in RDF/XML or Turtle is expected, as Protégé saves it"
TURTLE_ENDINGS = (".ttl", ".nt")
#: How files in Turtle begin, if they have another ending; comments may stand before.
_TURTLE = r"@prefix|@base|prefix\s+[\w.-]*:\s*<|base\s+<|(<[^<>\s]+>|_:\w+)\s+<[^<>\s]+>\s"
_XML_LABEL = r"label[^<>]*>\s*([^<]*?)\s*<"
_TURTLE_LABEL = r'label>?\s+"([^"\n]*)"'
#: How files in the other notations that ontology editors save begin; comments may stand before.
_OTHER_NOTATIONS = {
    "OWL in Functional Syntax": r"(Prefix|Ontology)\s*\(",
    "OWL in Manchester Syntax": r"(Prefix|Ontology):",
    "JSON-LD": r"[\[{]",
}
#: Characters that no IRI may contain (RFC 3987) and that would break the N-Triples given to a
# reasoner.
_NOT_IN_IRI = frozenset('<>"{}|\\^`') | {chr(code) for code in range(0x21)}
_EXTERNAL = re.compile(r"<!(?:ENTITY\s+(?:%\s*)?|DOCTYPE\s+)\S+\s+(?:SYSTEM|PUBLIC)\b")
#: Stands for the folder of a file without xml:base, and reveals nothing of this machine's folders.
#: As deep as a path may climb by "../".
RELATIVE_TO = "http://ontology.invalid/a/a/a/a/a/a/a/a/"


@dataclass(frozen=True, eq=False, repr=False)
class OntologyFile:
    """An ontology file that has been read and parsed.

    Attributes:
        iris: the IRIs of the ontology (empty for an anonymous one), without a trailing '#'.
        is_xml: whether it is in RDF/XML; else it is in Turtle.
        base: xml:base of the document, if it has one.
        imports: (imported IRI, line) in the order of the file.
        graph: all that it states, for SPARQL and SHACL.
        triples: the same; blank nodes of different files have different names.
    """

    path: Path
    content: bytes
    iris: tuple[str, ...]
    is_xml: bool
    base: str | None
    imports: tuple[tuple[str, int], ...]
    graph: Graph
    triples: tuple[Triple, ...]

    @cached_property
    def _statements(self) -> dict[str, list[Triple]]:
        statements: dict[str, list[Triple]] = {}
        for triple in self.triples:
            statements.setdefault(triple[0], []).append(triple)
        return statements

    def about(self, subject: str | Lit | None) -> Sequence[Triple]:
        """The triples with a subject."""
        return self._statements.get(str(subject), ())

    def value(self, subject: str | Lit | None, predicate: str) -> str | Lit | None:
        """A value of a property; None if there is none."""
        return next((o for _, p, o in self.about(subject) if p == predicate), None)

    def kinds(self, subject: str | Lit) -> list[str]:
        """The classes of a subject, sorted."""
        return sorted(str(o) for _, p, o in self.about(subject) if p == RDF_TYPE)

    def items(self, node: str | Lit | None) -> Iterator[str | Lit]:
        """The items of a list; one that leads back into itself ends there."""
        seen = {node}
        while (first := self.value(node, FIRST)) is not None:
            yield first
            node = self.value(node, REST)
            if node in seen:
                return
            seen.add(node)

    def line_of(self, name: str) -> int | None:
        """The first line that describes the thing of that name."""
        own = re.escape(name)
        if self.is_xml:  # about="...#name", about="&suave;name", ID="name", or the label of a rule
            described = (
                rf"""(?:about|ID)=["'](?:[^"']*[#;/])?{own}["']|label(?: [^>]*)?>\s*{own}\s*<"""
            )
        else:  # a line that begins with prefix:name or <...#name>, or a label
            described = rf"""^(?:[\w.-]*:|<[^<>\s]*[#/]){own}>?\s|label>?\s+["]{own}["]"""
        return self._line(re.search(described, self._text, re.MULTILINE))

    def line_of_rule(self, name: str) -> int | None:
        """The line of a rule's label, else the first line that describes a thing of its name.

        Of several things with that label it is the last one: editors write rules at the end.
        """
        return self._line(self._labels.get(name.strip())) or self.line_of(name)

    @cached_property
    def _labels(self) -> dict[str, re.Match[str]]:
        return {
            found[1]: found
            for found in re.finditer(_XML_LABEL if self.is_xml else _TURTLE_LABEL, self._text)
        }

    @cached_property
    def _text(self) -> str:
        return text_of(self.content, "replace")

    def _line(self, found: re.Match[str] | None) -> int | None:
        return None if found is None else self._text.count("\n", 0, found.start()) + 1


def place_of(name: str, sources: Sequence[OntologyFile]) -> tuple[Path, int | None]:
    """Find the file and line that describe the thing of a name; the first file, where none does."""
    lines = ((source.path, source.line_of(name)) for source in sources)
    return next((place for place in lines if place[1] is not None), (sources[0].path, None))


def text_of(content: bytes, errors: str = "strict") -> str:
    """Decode a file by its byte order mark or XML declaration, else as UTF-8."""
    encoding = "utf-8-sig"
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif declared := _DECLARED_ENCODING.match(content, 0, 200):
        encoding = declared[1].decode()
    try:
        return content.decode(encoding, errors)
    except UnicodeDecodeError:
        raise
    except (LookupError, UnicodeError):  # no encoding of characters, or none that is known
        return content.decode("utf-8", errors)


def read_ontology(path: Path, content: bytes | None = None) -> OntologyFile:
    """Read and check one ontology file, or content that is to be in it.

    Raises:
        InputError: missing, a folder, or too large.
        KnowledgeError: empty, not XML, not OWL in RDF/XML, or with external entities or entities
            that expand too far; with the line where it is known.
    """
    return _parsed(path, read_bytes(path, ONTOLOGY_LIMIT_BYTES) if content is None else content)


@lru_cache(maxsize=4)  # what is imported is read again with each ontology that imports it
def _parsed(path: Path, content: bytes) -> OntologyFile:
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
    return OntologyFile(
        path=path,
        content=content,
        iris=tuple(str(iri) for iri in ontologies if isinstance(iri, URIRef)),
        is_xml=not is_turtle,
        base=base,
        imports=tuple(sorted(imports.items(), key=lambda item: (item[1], item[0]))),
        graph=graph,
        triples=tuple(_converted(graph, hashlib.sha256(content).hexdigest()[:8])),
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
    """Parse a file; the graph is shared by all readers of the same content, and must not be
    changed.
    """
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


def is_iri(text: str) -> bool:
    """Return whether a text can be an IRI, as far as readers depend on it."""
    try:
        urlsplit(text)  # an address in brackets
    except ValueError:
        return False
    return _NOT_IN_IRI.isdisjoint(text)


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


def enumerated_texts(files: Iterable[OntologyFile]) -> dict[str, frozenset[str]]:
    """The texts that data properties can have as values, by property, where the range lists them
    (owl:oneOf).
    """
    texts: dict[str, frozenset[str]] = {}
    for file in files:
        for name, kind in links(file.triples, RDFS + "range"):
            items = file.items(file.value(kind, OWL + "oneOf"))
            found = [each.text for each in items if isinstance(each, Lit)]
            if found:
                texts[name] = frozenset(found)
    return texts
