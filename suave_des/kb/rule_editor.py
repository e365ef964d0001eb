"""Edit the rules of an OWL file in place: what is not edited stays as it is, to the byte.

The elements of a new rule go before the end of the file, and declare all that they need themselves.
expat gives the places of elements in the file, so that those of a rule can be changed or cut out.
Before the result replaces the file it is read back, and must have the intended rules, and no other
change.
"""

from __future__ import annotations

import itertools
import os
import re
import stat
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from xml.parsers import expat

from lxml import etree

from suave_des.errors import InputError, KnowledgeError, nearest
from suave_des.files import write_files
from suave_des.kb.states import read_rules
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.ontology_file import OntologyFile, read_ontology
from suave_des.knowledge.rdf import (
    RDF,
    RDF_TYPE,
    RDFS,
    SWRL,
    SWRLA,
    XSD,
    Lit,
    local_name,
    namespace,
)
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.rules.files import ENABLED, rules_of, triples_of

_TAG = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""")
_MARK = re.compile(rb"(<[\w.-]*:?isRuleEnabled\b[^>]*>)[^<]*(?=</)")
_PREFIXES = {"rdf": RDF, "rdfs": RDFS, "swrl": SWRL, "swrla": SWRLA}
_DESCRIPTION, _END = f"{{{RDF}}}Description", "</rdf:Description>"
_TYPE, _VARIABLE, _BUILTIN = f"{{{RDF}}}type", SWRL + "Variable", SWRL + "Builtin"
_NODE_ID = f"{{{RDF}}}nodeID"
_LANGUAGE = "{http://www.w3.org/XML/1998/namespace}lang"
_Span = tuple[int, int]


def add_rules(path: Path, given: str) -> list[Rule]:
    """Add a rule, written "name: body -> head", or the rules of a .swrl file to an OWL file.

    Raises:
        InputError: the file cannot be edited.
        KnowledgeError: the file cannot be read or has a rule of that name already, or a rule is
            wrong.
    """
    rules = list(read_rules(given, Ontology.load([path]).vocabulary))
    file = _read(path)
    for name in {rule.name for rule in rules} & {rule.name for rule in rules_of(file)}:
        remedy = "remove it first, or choose another name"
        raise KnowledgeError(f"there is a rule {name} already", file=path, remedy=remedy)
    newline = b"\r\n" if b"\r\n" in file.content else b"\n"
    added = b"".join(_rule_xml(rule).encode() for rule in rules).replace(b"\n", newline)
    end = file.content.rindex(b"</")
    at = file.content.rfind(b"\n", 0, end) + 1
    at = end if file.content[at:end].strip() else at
    _replace(file, file.content[:at] + added + file.content[at:], [*rules_of(file), *rules])
    return rules


def remove_rule(path: Path, name: str) -> None:
    """Remove a rule from an OWL file.

    Raises:
        InputError: the file cannot be edited.
        KnowledgeError: the file cannot be read, or has no such rule.
    """
    file = _read(path)
    content = file.content
    for start, end in sorted(_spans_of(file, name, with_parts=True), reverse=True):
        line = content.rfind(b"\n", 0, start) + 1
        start = start if content[line:start].strip() else line
        blank = re.compile(rb"[ \t]*\r?\n").match(content, end)  # no empty line is left
        content = content[:start] + content[blank.end() if blank and start == line else end :]
    _replace(file, content, [each for each in rules_of(file) if each.name != name])


def set_enabled(path: Path, name: str, *, enabled: bool) -> bool:
    """Switch a rule of an OWL file on or off with swrla:isRuleEnabled.

    Returns:
        whether the file was changed: false if the rule was so already.

    Raises:
        InputError: the file cannot be edited.
        KnowledgeError: the file cannot be read, or has no such rule.
    """
    file = _read(path)
    content = file.content
    word = str(enabled).lower().encode()
    spans = _spans_of(file, name)
    rules = rules_of(file)
    intended = [replace(each, enabled=enabled) if each.name == name else each for each in rules]
    if intended == list(rules):
        return False
    for start, end in sorted(spans, reverse=True):
        changed, marks = _MARK.subn(rb"\g<1>" + word, content[start:end])
        if not marks and (tag := _TAG.match(changed)):
            start_tag = f'<swrla:isRuleEnabled xmlns:swrla="{SWRLA}" xmlns:rdf="{RDF}" rdf:datatype="{XSD}boolean">'
            mark = start_tag.encode() + word + b"</swrla:isRuleEnabled>"
            changed = changed[: tag.end()] + mark + changed[tag.end() :]
        content = content[:start] + changed + content[end:]
    _replace(file, content, intended)
    return True


def _read(path: Path) -> OntologyFile:
    file = read_ontology(path)
    if not file.is_xml:
        remedy = "save it as RDF/XML, or keep your rules in a file of their own: --rules"
        raise InputError("rules can be edited in RDF/XML only", file=path, remedy=remedy)
    try:
        file.content.decode()
    except UnicodeDecodeError:
        raise InputError("is not encoded in UTF-8", file=path, remedy="save it as UTF-8") from None
    return file


def _spans_of(file: OntologyFile, name: str, *, with_parts: bool = False) -> list[_Span]:
    """Places of the elements of rules; with those elsewhere in the file that hold their lists and
    atoms, if wanted.
    """
    names = [rule.name for rule in rules_of(file)]
    if name not in names:
        raise _no_rule(file, name, names)
    root = etree.fromstring(file.content, etree.XMLParser(huge_tree=True, no_network=True))
    elements = [element for element in root if isinstance(element.tag, str)]
    spans = dict(zip(elements, _spans(file.content), strict=True))
    rules = filter(_is_rule, elements)
    found = [element for element in rules if _name(element) == name]
    if len(found) != names.count(name):
        raise _cannot(file.path)
    return [spans[element] for element in (_with_parts(found, elements) if with_parts else found)]


def _no_rule(file: OntologyFile, name: str, names: Sequence[str]) -> KnowledgeError:
    remedy = nearest(name, names) or f"its rules: {', '.join(names) or 'none'}"
    return KnowledgeError(f"there is no rule {name}", file=file.path, remedy=remedy)


def _with_parts(
    found: Sequence[etree._Element], elements: Sequence[etree._Element]
) -> list[etree._Element]:
    """Elements, and those elsewhere in the file that hold their lists and atoms."""
    all_found = list(found)
    for element in all_found:  # which grows on the way
        nodes = {each.get(_NODE_ID) for each in element.iter() if _NODE_ID in each.attrib}
        for each in elements:
            if each.get(_NODE_ID) in nodes and each not in all_found:
                all_found.append(each)
    return all_found


def _spans(content: bytes) -> list[_Span]:
    """Byte offsets of the beginning and the end of the elements under the root."""
    parser = expat.ParserCreate()
    beginnings: list[int] = []
    ends: list[int] = []
    depth = 0

    def start(_name: str, _attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth == 2:
            beginnings.append(parser.CurrentByteIndex)

    def end(_name: str) -> None:
        nonlocal depth
        if depth == 2:
            # the end tag; of an empty element, its only tag
            tag = _TAG.match(content, parser.CurrentByteIndex)
            ends.append(tag.end() if tag else parser.CurrentByteIndex)
        depth -= 1

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.Parse(content, True)
    return list(zip(beginnings, ends, strict=True))


def _is_rule(element: etree._Element) -> bool:
    types = (child.get(f"{{{RDF}}}resource") for child in element.iterfind(_TYPE))
    return element.tag == f"{{{SWRL}}}Imp" or SWRL + "Imp" in types


def _name(element: etree._Element) -> str | None:
    """The label of a rule, or the last part of its IRI; None where it has neither."""
    label = element.findtext(f"{{{RDFS}}}label", element.get(f"{{{RDFS}}}label"))
    iri = element.get(f"{{{RDF}}}about") or element.get(f"{{{RDF}}}ID")
    return local_name(iri) if label is None and iri else label


def _rule_xml(rule: Rule) -> str:
    """The element of a rule. Its variables and built-ins are declared where it uses them, so that
    they go with it.
    """
    triples = triples_of(rule)
    start = triples[0][0]
    builtins = [
        (atom.predicate, RDF_TYPE, _BUILTIN) for atom in rule.body if atom.kind == "builtin"
    ]
    mark = [] if rule.enabled else [(start, ENABLED, Lit("false", XSD + "boolean"))]
    of = defaultdict(list)
    for triple in dict.fromkeys((*mark, *triples, *builtins)):
        of[triple[0]].append(triple)
    root = etree.Element(_DESCRIPTION, nsmap=_PREFIXES)
    waiting = [(root, start)]
    # A list nests as deep as it is long, which is too deep for a recursion.
    for element, node in waiting:
        for _, predicate, value in of[node]:
            inside = etree.SubElement(element, f"{{{namespace(predicate)}}}{local_name(predicate)}")
            if isinstance(value, Lit):
                _write_literal(inside, predicate, value)
            elif value in of:
                about = {} if value.startswith("_:") else {f"{{{RDF}}}about": value}
                waiting.append((etree.SubElement(inside, _DESCRIPTION, about), value))
            else:
                inside.set(f"{{{RDF}}}resource", value)
    text = etree.tostring(root, encoding="unicode")
    lines = re.sub(
        r"(?=<(?:rdf:(?:first|rest)|swrl:(?:body|head)|rdfs:label)[ >])", "\n        ", text
    )
    return f"    {lines.removesuffix(_END)}\n    {_END}\n"


def _write_literal(element: etree._Element, predicate: str, value: Lit) -> None:
    element.text = value.text
    if value.datatype.startswith("@"):
        element.set(_LANGUAGE, value.datatype[1:])
    elif predicate != RDFS + "label":
        element.set(f"{{{RDF}}}datatype", value.datatype)


def _replace(file: OntologyFile, content: bytes, intended: Iterable[Rule]) -> None:
    """Replace the file, if its new content has the rules that were intended; the old file is kept
    beside it.
    """
    try:
        result = read_ontology(file.path, content)
    except KnowledgeError as error:
        raise _cannot(file.path) from error
    wanted, written = (
        sorted(map(_statement, each), key=str) for each in (intended, rules_of(result))
    )
    if written != wanted or _others(file) != _others(result):
        raise _cannot(file.path)
    path = file.path.resolve()
    mode = stat.S_IMODE(path.stat().st_mode)
    backup = unused_backup(path)
    write_files(path.parent, {backup.name: file.content, path.name: content})
    for each in (path, backup):
        each.chmod(mode)


def unused_backup(path: Path) -> Path:
    """Return where the next change keeps a file's previous version: FILE.bak, or the first of
    FILE.bak2, FILE.bak3, ... that is not there.
    """
    numbers = itertools.chain([""], itertools.count(2))
    names = (path.with_name(f"{path.name}.bak{number}") for number in numbers)
    return next(name for name in names if not os.path.lexists(name))


def _statement(rule: Rule) -> tuple[object, ...]:
    return rule.name, rule.enabled, rule.body, rule.head


def _others(file: OntologyFile) -> int:
    """Number of statements besides rules and the declarations of variables and built-ins."""
    inside = {triple for rule in rules_of(file) for triple in rule.triples}
    return sum(
        triple not in inside and triple[2] not in (_VARIABLE, _BUILTIN) for triple in file.triples
    )


def _cannot(path: Path) -> KnowledgeError:
    problem = "the rule is written in a way that cannot be edited in place; nothing was changed"
    return KnowledgeError(
        problem, file=path, remedy="open the file in Protégé and save it, then try again"
    )
