"""Edit the rules of an OWL file in place: every byte outside of the edited rule stays as it is.

lxml finds the rules in the file and builds the elements of a new one. It cannot write the file back: its serializer
normalises the line ends, the layout of tags, and the quotes of attributes. So expat gives the byte offsets of the
elements under the root, and the bytes are cut and joined there. Before the result replaces the file it is read back,
and must contain the intended change and no other.
"""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from xml.parsers import expat

from lxml import etree
from rdflib import BNode, Literal, URIRef
from rdflib.namespace import OWL, RDF
from rdflib.term import Node

from suave_des.errors import InputError, KnowledgeError, nearest
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import OntologyFile, read_ontology
from suave_des.knowledge.rdf import RDF as RDF_NS
from suave_des.knowledge.rdf import RDFS, SWRL, SWRLA, XSD, RdfTriple, local_name
from suave_des.knowledge.rules.files import read_rule
from suave_des.knowledge.rules.parser import PREFIXES
from suave_des.knowledge.rules.rdf import ENABLED, rules_of
from suave_des.knowledge.rules.syntax import Rule

#: Stands for the file of a rule that was given on the command line.
_GIVEN: Final = Path("the rule")
_INDENT: Final = "    "
_TAG: Final = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""")
_MARK: Final = re.compile(rb"(<[\w.-]*:?isRuleEnabled\b[^>]*>)[^<]*(?=</)")
_NAMESPACES: Final = {name: PREFIXES[name] for name in ("rdf", "rdfs", "owl", "swrl", "swrla")}
#: In these encodings, markup and references to characters are written in the bytes of ASCII.
_ENCODINGS: Final = ("UTF-8", "US-ASCII", "ASCII", "ISO-8859-1")
#: What a file says of a rule: its name, whether it is enabled, its body and head.
_Statement = tuple[str, bool, tuple[Any, Any]]


def _clark(iri: str) -> str:
    """The name of an element or attribute as lxml writes it: {namespace}name."""
    name = re.split(r"(?<=[#/])", iri)[-1]
    return f"{{{iri[: len(iri) - len(name)]}}}{name}"


_ABOUT, _RESOURCE, _NODE_ID, _TYPE = (_clark(RDF_NS + name) for name in ("about", "resource", "nodeID", "type"))
_DESCRIPTION: Final = _clark(RDF_NS + "Description")


class _Document:
    """The elements directly under the root of an RDF/XML file, with their places in its bytes."""

    def __init__(self, file: OntologyFile) -> None:
        if not file.is_xml:
            raise InputError(
                "only RDF/XML is edited in place", file=file.path, remedy="keep the rules as text, for --rules"
            )
        self.newline = b"\r\n" if b"\r\n" in file.content else b"\n"
        parser = etree.XMLParser(huge_tree=True, no_network=True)  # read_ontology has refused entity bombs
        root = etree.fromstring(file.content, parser)
        if (root.getroottree().docinfo.encoding or "UTF-8").upper() not in _ENCODINGS:
            raise InputError("is not encoded in UTF-8", file=file.path, remedy="save it as UTF-8")
        self.prefixes = {prefix: iri for prefix, iri in root.nsmap.items() if prefix}
        self.elements = [element for element in root if isinstance(element.tag, str)]
        spans, self.closing = _spans(file.content)
        if len(spans) != len(self.elements):
            raise _cannot(file.path)
        self.spans = dict(zip(self.elements, spans, strict=True))

    def rules(self, name: str) -> list[etree._Element]:
        """Elements of the rules of a name."""
        return [
            element
            for element in self.elements
            if (element.tag == _clark(SWRL + "Imp") or SWRL + "Imp" in _types(element)) and _rule_name(element) == name
        ]

    def parts(self, rule: etree._Element) -> list[etree._Element]:
        """A rule's element, and the elements elsewhere in the file that hold its lists and atoms."""
        found, waiting = [rule], _nodes(rule)
        while waiting:
            node = waiting.pop()
            for element in self.elements:
                if element.get(_NODE_ID) == node and element not in found:
                    found.append(element)
                    waiting |= _nodes(element)
        return found


def _spans(content: bytes) -> tuple[list[tuple[int, int]], int]:
    """Byte offsets of the beginning and the end of the elements under the root, and of the end tag of the root."""
    parser = expat.ParserCreate()
    beginnings: list[int] = []
    ends: list[int] = []
    depth = closing = 0

    def start(_name: str, _attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth == 2:
            beginnings.append(parser.CurrentByteIndex)

    def end(_name: str) -> None:
        nonlocal depth, closing
        closing = parser.CurrentByteIndex
        if depth == 2:
            tag = _TAG.match(content, closing)  # the end tag; of an empty element, its only tag
            ends.append(tag.end() if tag else closing)
        depth -= 1

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.Parse(content, True)
    return list(zip(beginnings, ends, strict=True)), closing


def _types(element: etree._Element) -> list[str]:
    return [child.get(_RESOURCE, "") for child in element.iterfind(_TYPE)]


def _nodes(element: etree._Element) -> set[str]:
    """Names of the blank nodes that an element speaks of."""
    return {each.get(_NODE_ID, "") for each in element.iter() if _NODE_ID in each.attrib}


def _rule_name(element: etree._Element) -> str | None:
    """The label of a rule, or the last part of its IRI; None where it has neither."""
    label = element.find(_clark(RDFS + "label"))
    iri = element.get(_ABOUT) or element.get(_clark(RDF_NS + "ID"))
    named = element.get(_clark(RDFS + "label")) or (local_name(iri) if iri else None)
    return named if label is None else label.text


def _declares(element: etree._Element) -> str | None:
    """The IRI that an element only declares, as add_rule declares variables and built-ins; None for another element."""
    iri = element.get(_ABOUT)
    types = _types(element) if element.tag == _DESCRIPTION else [re.sub("[{}]", "", str(element.tag)), *_types(element)]
    alone = len(element.attrib) == 1 and len(element) == len(_types(element)) and len(types) == 1
    return iri if iri is not None and alone and _is_declaration(iri, types[0]) else None


def _is_declaration(iri: str, kind: str) -> bool:
    """Whether a type only declares a variable, a built-in, or the mark of rules that are switched off."""
    return kind in (SWRL + "Variable", SWRL + "Builtin") or (
        kind == str(OWL.AnnotationProperty) and iri.startswith(SWRLA)
    )


def add_rule(path: Path, text: str) -> Rule:
    """Add a rule, written "name: body -> head", to an OWL file.

    Raises:
        InputError: the file cannot be edited.
        KnowledgeError: the file cannot be read or has a rule of that name already, or the rule is wrong.
    """
    base = Ontology.load([path])
    rule = read_rule(text, base.vocabulary, _GIVEN)
    file = read_ontology(path)
    if rule.name in {each.name for each in rules_of(file)}:
        raise KnowledgeError(
            f"there is a rule {rule.name} already", file=path, remedy="remove it first, or choose another name"
        )
    document = _Document(file)
    known = {str(subject) for subject in file.graph.subjects(RDF.type, None)}
    added = _rule_xml(rule, document.prefixes, known).replace(b"\n", document.newline)
    at = file.content.rfind(b"\n", 0, document.closing) + 1
    if file.content[at : document.closing].strip():
        at = document.closing
    _replace(file, file.content[:at] + added + file.content[at:], lambda rules: [*rules, _statement(rule)])
    return rule


def remove_rule(path: Path, name: str) -> None:
    """Remove a rule from an OWL file, with the declarations of variables and built-ins that nothing else uses.

    Raises:
        InputError: the file cannot be edited.
        KnowledgeError: the file cannot be read, or has no such rule.
    """
    file, document, rules = _find(path, name)
    inside = {triple for rule in rules_of(file) if rule.name == name for triple in rule.triples}
    elsewhere = Counter(term for triple in file.graph if triple not in inside for term in triple)
    unused = {str(term) for triple in inside for term in triple if isinstance(term, URIRef) and elsewhere[term] <= 1}
    parts = {part for rule in rules for part in document.parts(rule)}
    parts |= {element for element in document.elements if _declares(element) in unused}
    content = file.content
    for start, end in sorted((document.spans[part] for part in parts), reverse=True):
        content = _without(content, start, end)
    _replace(file, content, lambda rules: [each for each in rules if each[0] != name])


def set_enabled(path: Path, name: str, *, enabled: bool) -> bool:
    """Switch a rule of an OWL file on or off with swrla:isRuleEnabled.

    Returns:
        whether the file was changed: false if the rule was so already.

    Raises:
        InputError: the file cannot be edited.
        KnowledgeError: the file cannot be read, or has no such rule.
    """
    file, document, rules = _find(path, name)
    if all(rule.enabled == enabled for rule in rules_of(file) if rule.name == name):
        return False
    content = file.content
    word = b"true" if enabled else b"false"
    for start, end in sorted((document.spans[rule] for rule in rules), reverse=True):
        changed, marks = _MARK.subn(rb"\g<1>" + word, content[start:end])
        if not marks:
            tag = _TAG.match(changed)
            at = tag.end() if tag else 0
            mark = _mark_xml(document.prefixes, enabled=enabled).replace(b"\n", document.newline)
            changed = changed[:at] + mark + changed[at:]
        content = content[:start] + changed + content[end:]
    _replace(file, content, lambda rules: [(each[0], enabled, each[2]) if each[0] == name else each for each in rules])
    return True


def _find(path: Path, name: str) -> tuple[OntologyFile, _Document, list[etree._Element]]:
    file = read_ontology(path)
    names = [rule.name for rule in rules_of(file)]
    if name not in names:
        remedy = nearest(name, names) or f"its rules: {', '.join(names) or 'none'}"
        raise KnowledgeError(f"there is no rule {name}", file=path, remedy=remedy)
    document = _Document(file)
    rules = document.rules(name)
    if len(rules) != names.count(name):
        raise _cannot(path)
    return file, document, rules


def _without(content: bytes, start: int, end: int) -> bytes:
    """The content without a span, and without the line that would be left empty."""
    line = content.rfind(b"\n", 0, start) + 1
    start = start if content[line:start].strip() else line
    blank = re.compile(rb"[ \t]*\r?\n").match(content, end)
    return content[:start] + content[blank.end() if blank and start == line else end :]


def _rule_xml(rule: Rule, prefixes: Mapping[str, str], declared: Collection[str]) -> bytes:
    """The elements to add to a file for a rule: declarations of what the file does not declare, and the rule."""
    variables = [triple[0] for triple in rule.triples if triple[2] == URIRef(SWRL + "Variable")]
    kinds = {
        **dict.fromkeys(variables, SWRL + "Variable"),
        **{URIRef(atom.predicate): SWRL + "Builtin" for atom in rule.body if atom.kind == "builtin"},
        ENABLED: str(OWL.AnnotationProperty),
    }
    root = etree.Element(_clark(RDF_NS + "RDF"), nsmap=prefixes)
    for iri, kind in kinds.items():
        if str(iri) not in declared:
            _describe(root, iri, [(iri, RDF.type, URIRef(kind))])
    own = [triple for triple in rule.triples if triple[0] not in variables]
    _describe(root, rule.node, [(rule.node, ENABLED, _mark(rule.enabled)), *own])
    return _inside(root)


def _mark_xml(prefixes: Mapping[str, str], *, enabled: bool) -> bytes:
    """The mark swrla:isRuleEnabled, as a line to insert below the first tag of a rule."""
    root = etree.Element(_DESCRIPTION, nsmap=prefixes)
    _add_property(root, ENABLED, _mark(enabled))
    return b"\n" + _INDENT.encode() + _inside(root).rstrip()


def _mark(enabled: bool) -> Literal:
    return Literal(str(enabled).lower(), datatype=URIRef(XSD + "boolean"))


def _missing(prefixes: Mapping[str | None, str]) -> dict[str, str]:
    """Prefixes for the namespaces that a file has none for; they are declared in the elements that are added."""
    missing = {wish: iri for wish, iri in _NAMESPACES.items() if iri not in prefixes.values()}
    return {wish + "_" if wish in prefixes else wish: iri for wish, iri in missing.items()}


def _describe(root: etree._Element, subject: Node, triples: Sequence[RdfTriple]) -> None:
    """Add the description of a thing to the root, with those of the blank nodes in it, nested."""
    outer = etree.SubElement(root, _DESCRIPTION, nsmap=_missing(root.nsmap))
    if not isinstance(subject, BNode):
        outer.set(_ABOUT, str(subject))
    of: dict[Node, list[RdfTriple]] = {}
    for triple in triples:
        of.setdefault(triple[0], []).append(triple)
    waiting = [(outer, subject)]  # a list nests as deep as it is long, which is too deep for a recursion
    while waiting:
        element, node = waiting.pop()
        for _, predicate, value in of[node]:
            child = _add_property(element, predicate, value)
            if isinstance(value, BNode):
                waiting.append((etree.SubElement(child, _DESCRIPTION), value))
    # Each property has a line, and each item of a list: nested lists cost no indentation an item.
    outer.text = "\n" + _INDENT * 2
    for child in outer:
        child.tail = "\n" + _INDENT * 2
    outer[-1].tail = "\n" + _INDENT
    for first in outer.iter(_clark(RDF_NS + "first")):
        before = first.getprevious()
        if before is not None:
            before.tail = "\n" + _INDENT * 3


def _add_property(element: etree._Element, predicate: Node, value: Node) -> etree._Element:
    child = etree.SubElement(element, _clark(str(predicate)), nsmap=_missing(element.nsmap))
    if isinstance(value, URIRef):
        child.set(_RESOURCE, str(value))
    elif isinstance(value, Literal):
        child.text = str(value)
        if value.language:
            child.set("{http://www.w3.org/XML/1998/namespace}lang", value.language)
        elif value.datatype is not None:
            child.set(_clark(RDF_NS + "datatype"), str(value.datatype))
    return child


def _inside(root: etree._Element) -> bytes:
    """What is inside a root, an element a line; what the root declares, the file declares already."""
    root.text = _INDENT
    for child in root:
        child.tail = "\n" + _INDENT
    root[-1].tail = "\n"
    text: bytes = etree.tostring(root)
    return text[text.index(b">") + 1 : text.rindex(b"</")]


def _statement(rule: Rule) -> _Statement:
    return rule.name, rule.enabled, (rule.body, rule.head)


def _replace(file: OntologyFile, content: bytes, change: Callable[[list[_Statement]], list[_Statement]]) -> None:
    """Replace the file, if its new content says what was intended; the old file is kept beside it."""
    try:
        result = read_ontology(file.path, content)
    except KnowledgeError as error:
        raise _cannot(file.path) from error
    before, after = rules_of(file), rules_of(result)
    intended = change([_statement(rule) for rule in before])
    if sorted(map(_statement, after), key=str) != sorted(intended, key=str):
        raise _cannot(file.path)
    if _others(result, after) != _others(file, before):
        raise _cannot(file.path)
    path = file.path.resolve()
    try:
        _write(path.with_name(path.name + ".bak"), file.content, path)
        _write(path, content, path)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", file=file.path) from error


def _others(file: OntologyFile, rules: Sequence[Rule]) -> Counter[tuple[Node | None, ...]]:
    """What a file says besides its rules; blank nodes have no names that could be compared."""
    inside = {triple for rule in rules for triple in rule.triples}
    return Counter(
        tuple(None if isinstance(term, BNode) else term for term in triple)
        for triple in file.graph
        if triple not in inside and not (triple[1] == RDF.type and _is_declaration(str(triple[0]), str(triple[2])))
    )


def _write(path: Path, content: bytes, like: Path) -> None:
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
