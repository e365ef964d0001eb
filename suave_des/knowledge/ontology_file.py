"""Ontology files: what each states, and where.

A file is parsed once on a machine; what it states is kept in the cache.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from suave_des.caches import SharedEntries, hash_of_code, private_cache
from suave_des.files import read_bytes
from suave_des.knowledge.notation import text_of
from suave_des.knowledge.rdf import FIRST, OWL, RDF_TYPE, RDFS, REST, Lit, Triple, links

if TYPE_CHECKING:
    from rdflib import Graph

ONTOLOGY_LIMIT_BYTES = 64 * 2**20
_XML_LABEL = r"label[^<>]*>\s*([^<]*?)\s*<"
_TURTLE_LABEL = r'label>?\s+"([^"\n]*)"'


@dataclass(frozen=True, eq=False, repr=False)
class OntologyFile:
    """An ontology file that has been read and parsed.

    Attributes:
        iris: the IRIs of the ontology (empty for an anonymous one), without a trailing '#'.
        is_xml: whether it is in RDF/XML; else it is in Turtle.
        base: xml:base of the document, if it has one.
        imports: (imported IRI, line) in the order of the file.
        triples: all that it states; blank nodes of different files have different names.
    """

    path: Path
    content: bytes
    iris: tuple[str, ...]
    is_xml: bool
    base: str | None
    imports: tuple[tuple[str, int], ...]
    triples: tuple[Triple, ...]

    @cached_property
    def graph(self) -> Graph:
        """All that it states, for SPARQL and SHACL; it is shared, and must not be changed."""
        from suave_des.knowledge.rdf_files import parsed  # with rdflib, which missions do without

        return parsed(self.path, self.content).graph

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


def read_ontology(path: Path, content: bytes | None = None) -> OntologyFile:
    """Read and check one ontology file, or content that is to be in it.

    Raises:
        InputError: missing, a folder, or too large.
        KnowledgeError: empty, not XML, not OWL in RDF/XML, or with external entities or entities
            that expand too far; with the line where it is known.
    """
    return _read(path, read_bytes(path, ONTOLOGY_LIMIT_BYTES) if content is None else content)


@lru_cache(maxsize=4)  # what is imported is read again with each ontology that imports it
def _read(path: Path, content: bytes) -> OntologyFile:
    """Return what a file states, as an earlier process found it if one did: to import rdflib and to
    parse the shipped ontologies takes 0.2 s.
    """
    made_from = os.fsencode(f"{path.stem} {path.suffix} {_programs()}") + content
    kept = SharedEntries(private_cache("ontologies"), hashlib.sha256(made_from).hexdigest())
    known = next(kept.read(), None)
    if known is not None:
        _, (iris, is_xml, base, imports, triples) = known
        return OntologyFile(
            path,
            content,
            tuple(iris),
            is_xml,
            base,
            tuple((iri, line) for iri, line in imports),
            tuple((s, p, o if isinstance(o, str) else Lit(*o)) for s, p, o in triples),
        )
    from suave_des.knowledge.rdf_files import parsed  # with rdflib

    found = parsed(path, content)
    stated = found.iris, found.is_xml, found.base, found.imports, found.triples
    kept.add("", stated)
    return OntologyFile(path, content, *stated)


@lru_cache(maxsize=1)
def _programs() -> str:
    """Identify the programs that parse files."""
    libraries = [f"{name} {version(name)}" for name in ("rdflib", "lxml")]
    python = platform.python_version()
    return f"{libraries} {python} {hash_of_code(Path(__file__).parent)}"


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
