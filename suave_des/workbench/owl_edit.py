"""Edit the rules of an OWL file in place, and leave every other byte of it as it was.

The file is cut and joined as bytes, at places that an XML parser names; it is never written anew from its triples.
Before the result takes the file's place it is read back, and must say what was wanted and nothing else.
"""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from xml.parsers import expat

from rdflib import BNode, URIRef
from rdflib.namespace import OWL, RDF

from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.base import KnowledgeBase
from suave_des.knowledge.ontology_file import OntologyFile, read_ontology
from suave_des.knowledge.rule_checks import check_rule, first_error
from suave_des.knowledge.rule_names import rule_from_text
from suave_des.knowledge.rule_parser import parse_rule
from suave_des.knowledge.rules import Rule, rules_of
from suave_des.knowledge.vocabulary import RDF as RDF_NS
from suave_des.knowledge.vocabulary import RDFS, SWRL, SWRLA, local_name, nearest
from suave_des.workbench.owl_rule import Prefixes, enabled_mark, rule_elements

#: Stands for the file of a rule that was given on the command line.
_GIVEN: Final = Path("the rule")
_TAG: Final = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""")
_ENCODING: Final = re.compile(rb"""^<\?xml[^>]*encoding\s*=\s*["']([A-Za-z0-9._-]+)""")


@dataclass
class _Element:
    """An element directly under the root, or directly under one of those, with its place in the bytes."""

    name: str
    attributes: dict[str, str]
    start: int
    inside: int
    closing: int = 0
    end: int = 0
    text: str = ""
    children: list[_Element] = field(default_factory=list)
    nodes: set[str] = field(default_factory=set)

    @property
    def is_rule(self) -> bool:
        return self.name == f"{SWRL} Imp" or any(
            child.name == f"{RDF_NS} type" and child.attributes.get(f"{RDF_NS} resource") == SWRL + "Imp"
            for child in self.children
        )

    @property
    def declared_for_rules(self) -> str | None:
        """The IRI of what this only declares, in the way in which a rule is added; None where it does not."""
        about = self.attributes.get(f"{RDF_NS} about")
        kinds = [child.attributes.get(f"{RDF_NS} resource") for child in self.children]
        if self.name != f"{RDF_NS} Description" or len(self.attributes) != 1 or about is None or len(kinds) != 1:
            return None
        declares = self.children[0].name == f"{RDF_NS} type" and _declares_for_rules(about, kinds[0])
        return about if declares else None

    @property
    def rule_name(self) -> str | None:
        """Its label, or the last part of its IRI; None where it has neither."""
        for child in self.children:
            if child.name == f"{RDFS} label":
                return child.text
        iri = self.attributes.get(f"{RDF_NS} about") or self.attributes.get(f"{RDF_NS} ID")
        return self.attributes.get(f"{RDFS} label") or (local_name(iri) if iri else None)


class _Document:
    """Where the elements of an RDF/XML file begin and end."""

    def __init__(self, path: Path, content: bytes) -> None:
        found = _ENCODING.match(content)
        if content[:2] in (b"\xff\xfe", b"\xfe\xff") or (
            found is not None and found.group(1).lower() not in (b"utf-8", b"us-ascii", b"ascii", b"iso-8859-1")
        ):
            raise InputError("is not encoded in UTF-8", file=path, remedy="save it as UTF-8")
        self.content = content
        self.elements: list[_Element] = []
        self.prefixes: dict[str, str] = {}
        self.closing = 0
        self._open: list[_Element] = []
        self._depth = 0
        parser = self._parser = expat.ParserCreate(namespace_separator=" ")
        parser.buffer_text = True
        parser.StartNamespaceDeclHandler = self._prefix
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._text
        parser.Parse(content, True)

    def _prefix(self, prefix: str | None, iri: str) -> None:
        if self._depth == 0 and prefix:
            self.prefixes.setdefault(iri, prefix)

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        if self._depth in (2, 3):
            start = self._parser.CurrentByteIndex
            tag = _TAG.match(self.content, start)
            element = _Element(name, dict(attributes), start, tag.end() if tag else start)
            (self.elements if self._depth == 2 else self._open[-1].children).append(element)
            self._open.append(element)
        node = attributes.get(f"{RDF_NS} nodeID")
        if node is not None and self._open:
            self._open[0].nodes.add(node)

    def _end(self, _name: str) -> None:
        at = self._parser.CurrentByteIndex
        if self._depth == 1:
            self.closing = at
        if self._depth in (2, 3):
            element = self._open.pop()
            element.closing = max(at, element.inside)
            element.end = element.inside if at < element.inside else self.content.index(b">", at) + 1
        self._depth -= 1

    def _text(self, text: str) -> None:
        if self._depth == 3 and self._open:
            self._open[-1].text += text

    def rules(self, name: str) -> list[_Element]:
        """Elements of the rules of a name."""
        return [element for element in self.elements if element.is_rule and element.rule_name == name]

    def parts(self, rule: _Element) -> list[_Element]:
        """A rule's element, and those elsewhere in the file that hold its lists and atoms."""
        found, waiting = [rule], set(rule.nodes)
        while waiting:
            node = waiting.pop()
            for element in self.elements:
                if element.attributes.get(f"{RDF_NS} nodeID") == node and element not in found:
                    found.append(element)
                    waiting |= element.nodes
        return found


def add_rule(path: Path, text: str) -> Rule:
    """Add a rule, written "name: body -> head", to an OWL file.

    Raises:
        InputError: the file cannot be edited.
        KnowledgeError: the file cannot be read, has a rule of that name, or the rule is not right.
    """
    base = KnowledgeBase.load([path])
    rule = rule_from_text(parse_rule(text, _GIVEN), base.vocabulary, _GIVEN)
    error = first_error(rule, check_rule(rule, base.vocabulary))
    if error is not None:
        raise error
    file = read_ontology(path)
    if rule.name in {each.name for each in rules_of(file)}:
        raise KnowledgeError(
            f"there is a rule {rule.name} already", file=path, remedy="remove it first, or choose another name"
        )
    document = _Document(path, file.content)
    known = {str(subject) for subject in file.graph.subjects(RDF.type, None)}
    added = rule_elements(rule, Prefixes(document.prefixes), known)
    at = file.content.rfind(b"\n", 0, document.closing) + 1
    if file.content[at : document.closing].strip():
        at = document.closing
    _finish(file, file.content[:at] + added.encode("ascii", "xmlcharrefreplace") + file.content[at:], _with(rule))
    return rule


def remove_rule(path: Path, name: str) -> None:
    """Remove a rule from an OWL file, with the declarations of variables and built-ins that nothing else uses.

    Raises:
        InputError: the file cannot be edited.
        KnowledgeError: the file cannot be read, or has no such rule.
    """
    file, document, elements = _found(path, name)
    content = file.content
    lone = _used_only_by(file, name)
    found = [part for element in elements for part in document.parts(element)]
    found += [element for element in document.elements if element.declared_for_rules in lone]
    parts = {id(part): part for part in found}
    for part in sorted(parts.values(), key=lambda element: -element.start):
        start = content.rfind(b"\n", 0, part.start) + 1
        start = part.start if content[start : part.start].strip() else start
        end = part.end
        if start < part.start or start == 0 or content[start - 1 : start] == b"\n":
            following = re.compile(rb"[ \t]*\r?\n").match(content, end)
            end = following.end() if following else end
        content = content[:start] + content[end:]
    _finish(file, content, lambda rules: [rule for rule in rules if rule.name != name])


def set_enabled(path: Path, name: str, *, enabled: bool) -> bool:
    """Switch a rule of an OWL file on or off with swrla:isRuleEnabled.

    Returns:
        whether the file was changed: false when it said so already.

    Raises:
        InputError: the file cannot be edited.
        KnowledgeError: the file cannot be read, or has no such rule.
    """
    file, document, elements = _found(path, name)
    if all(rule.enabled == enabled for rule in rules_of(file) if rule.name == name):
        return False
    content = file.content
    word = b"true" if enabled else b"false"
    for element in sorted(elements, key=lambda element: -element.start):
        marks = [child for child in element.children if child.name == f"{SWRLA} isRuleEnabled"]
        for mark in reversed(marks):
            content = content[: mark.inside] + word + content[mark.closing :]
        if not marks:
            line = enabled_mark(Prefixes(document.prefixes), enabled=enabled).encode()
            content = content[: element.inside] + line + content[element.inside :]

    def switched(rules: list[_Said]) -> list[_Said]:
        return [rule if rule.name != name else _Said(rule.name, enabled, rule.sides) for rule in rules]

    _finish(file, content, switched)
    return True


def _found(path: Path, name: str) -> tuple[OntologyFile, _Document, list[_Element]]:
    file = read_ontology(path)
    names = [rule.name for rule in rules_of(file)]
    if name not in names:
        remedy = nearest(name, names) or f"its rules: {', '.join(names) or 'none'}"
        raise KnowledgeError(f"there is no rule {name}", file=path, remedy=remedy)
    document = _Document(path, file.content)
    elements = document.rules(name)
    if len(elements) != names.count(name):
        raise _cannot(path)
    return file, document, elements


@dataclass(frozen=True)
class _Said:
    """What a file says of a rule."""

    name: str
    enabled: bool
    sides: tuple[Any, Any]


def _said(rules: tuple[Rule, ...]) -> list[_Said]:
    return [_Said(rule.name, rule.enabled, (rule.body, rule.head)) for rule in rules]


def _with(rule: Rule) -> Callable[[list[_Said]], list[_Said]]:
    return lambda rules: [*rules, *_said((rule,))]


def _rest(file: OntologyFile, rules: tuple[Rule, ...]) -> tuple[set[Any], Counter[Any]]:
    """What a file says besides its rules: triples, and those with nodes that have no name without these."""
    inside = {triple for rule in rules for triple in rule.triples}
    triples = [
        triple
        for triple in file.graph
        if triple not in inside and not (triple[1] == RDF.type and _declares_for_rules(str(triple[0]), str(triple[2])))
    ]
    named = {triple for triple in triples if not any(isinstance(term, BNode) for term in triple)}
    unnamed = Counter(
        tuple(None if isinstance(term, BNode) else term for term in triple) for triple in triples if triple not in named
    )
    return named, unnamed


def _declares_for_rules(iri: str, kind: str | None) -> bool:
    """Whether a type only declares a variable, a built-in or the mark of switched-off rules."""
    return kind in (SWRL + "Variable", SWRL + "Builtin") or (
        kind == str(OWL.AnnotationProperty) and iri.startswith(SWRLA)
    )


def _used_only_by(file: OntologyFile, name: str) -> set[str]:
    """IRIs that stand in rules of a name, and of which the rest of a file says one thing at most: what they are."""
    inside = {triple for rule in rules_of(file) if rule.name == name for triple in rule.triples}
    elsewhere = Counter(term for triple in file.graph if triple not in inside for term in triple)
    return {str(term) for triple in inside for term in triple if isinstance(term, URIRef) and elsewhere[term] <= 1}


def _finish(file: OntologyFile, content: bytes, change: Callable[[list[_Said]], list[_Said]]) -> None:
    """Let the new content take the file's place, if it says what it should; the old one is kept beside it."""
    try:
        result = read_ontology(file.path, content)
    except KnowledgeError as error:
        raise _cannot(file.path) from error

    def order(said: _Said) -> tuple[str, str]:
        return said.name, str(said.sides)

    before, after = rules_of(file), rules_of(result)
    wanted = sorted(change(_said(before)), key=order)
    if sorted(_said(after), key=order) != wanted or _rest(result, after) != _rest(file, before):
        raise _cannot(file.path)
    path = file.path.resolve()
    try:
        _replace(path.with_name(path.name + ".bak"), file.content, path)
        _replace(path, content, path)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", file=file.path) from error


def _replace(path: Path, content: bytes, like: Path) -> None:
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        shutil.copymode(like, name)
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _cannot(path: Path) -> KnowledgeError:
    return KnowledgeError(
        "the rule is written in a way that cannot be edited in place; nothing was changed",
        file=path,
        remedy="open the file in Protégé and save it, then try again",
    )
