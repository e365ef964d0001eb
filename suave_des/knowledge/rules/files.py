"""Rules in files: as RDF in ontologies, and as text, whose names are looked up and which is checked."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Final

from rdflib import BNode, Graph, Literal, URIRef
from rdflib.namespace import RDF, RDFS
from rdflib.term import Node

from suave_des.errors import InputError
from suave_des.files import decode, read_bytes
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rdf import IS_QA_TYPE, OWL, SWRL, SWRLA, SWRLB, XSD, Lit, RdfTriple, literal, local_name
from suave_des.knowledge.rules import (
    DIFFERENT,
    EXPRESSION,
    KINDS,
    SAME,
    Atom,
    AtomKind,
    Named,
    ParsedRule,
    Place,
    Rule,
    RuleError,
    Term,
    Variable,
    distinct_variables,
    rule_text,
)
from suave_des.knowledge.rules.checks import Vocabulary, first_error
from suave_des.knowledge.rules.parser import ParsedRules, parse_rule, parse_rules

MAX_BYTES: Final = 8 * 2**20


@dataclass(frozen=True)
class RulesFile:
    """A file of rules as text.

    Attributes:
        path: where it is.
        text: all of it.
        parsed: its rules, before their names are looked up, and its errors.
    """

    path: Path
    text: str
    parsed: ParsedRules

    @classmethod
    def read(cls, path: Path) -> RulesFile:
        """Read a file.

        Raises:
            InputError: it is missing, a folder, too large, or not text in UTF-8.
        """
        text = decode(path, read_bytes(path, MAX_BYTES))
        if text.lstrip().startswith("<?xml"):
            raise InputError("this is XML, not rules as text", file=path, remedy="give it with --ontology")
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        return cls(path, text, parse_rules(text, path))

    def looked_up(self, vocabulary: Vocabulary) -> Iterator[tuple[str, Rule | RuleError]]:
        """Look up the names in its rules: each rule by its name, or why it cannot be read."""
        for parsed in self.parsed.rules:
            try:
                yield parsed.name, rule_from_text(parsed, vocabulary, self.path)
            except RuleError as error:
                yield parsed.name, error

    def checked(self, vocabulary: Vocabulary) -> Iterator[tuple[str, Rule | RuleError]]:
        """Look up and check its rules: each rule by its name, or why it cannot be used.

        Raises:
            RuleError: the text of a rule cannot be parsed; with line and column.
        """
        if self.parsed.errors:
            raise self.parsed.errors[0]
        for name, rule in self.looked_up(vocabulary):
            if isinstance(rule, Rule) and rule.enabled:
                rule = first_error(rule, vocabulary) or rule
            yield name, rule

    def rules(self, vocabulary: Vocabulary) -> tuple[Rule, ...]:
        """Look up and check its rules.

        Raises:
            RuleError: a rule cannot be read or used; with line and column.
        """
        return tuple(_usable(rule) for _, rule in self.checked(vocabulary))


def _usable(rule: Rule | RuleError) -> Rule:
    if isinstance(rule, RuleError):
        raise rule
    return rule


def read_rule(text: str, vocabulary: Vocabulary, file: Path) -> Rule:
    """Parse, look up and check one rule, as it is given on a command line.

    Args:
        text: "name: body -> head".
        vocabulary: of the ontologies.
        file: the name of the text in messages.

    Raises:
        RuleError: it is not one rule, or cannot be used.
    """
    rule = rule_from_text(parse_rule(text, file), vocabulary, file)
    return _usable(first_error(rule, vocabulary) or rule)


def rule_from_text(parsed: ParsedRule, vocabulary: Vocabulary, file: Path) -> Rule:
    """Look up all names of a rule.

    Raises:
        RuleError: a name is unknown or ambiguous; with line and column.
    """
    body, head = (tuple(_resolved(atom, vocabulary, file) for atom in side) for side in (parsed.body, parsed.head))
    text, place = rule_text(body, head), f"line {parsed.place.line}"
    return with_triples(Rule(parsed.name, text, file, parsed.enabled, BNode(), (), body, head, place))


def _resolved(atom: Atom, vocabulary: Vocabulary, file: Path) -> Atom:
    kinds: tuple[str, ...] = ("class", "object property", "data property", "builtin")
    predicate = _iri(atom.predicate, atom.place(), vocabulary, file, kinds)

    def named(number: int, word: str) -> Named:
        otherwise = _not_a_name(word, number, predicate)
        return Named(_iri(word, atom.place(number), vocabulary, file, ("individual",), otherwise))

    arguments = tuple(named(n, term.iri) if isinstance(term, Named) else term for n, term in enumerate(atom.arguments))
    return replace(atom, kind=_kind(predicate, arguments, vocabulary), predicate=predicate, arguments=arguments)


def _not_a_name(word: str, number: int, predicate: str) -> str:
    """Say how to write what is perhaps no individual's name, but a truth value, a text or a variable."""
    if predicate == IS_QA_TYPE and number == 1:
        return f"declare it: an individual {word} of QualityAttributeType"
    if word in ("True", "False"):
        return f"write {word.lower()}"
    return f"write ?{word} for a variable" if number == 0 else f'write "{word}" for a text, ?{word} for a variable'


def _iri(
    name: str, place: Place | None, vocabulary: Vocabulary, file: Path, kinds: Collection[str], otherwise: str = ""
) -> str:
    if ":" in name:
        return name
    if name in ("sameAs", "differentFrom") and "class" in kinds:
        return OWL + name
    found = vocabulary.candidates(name)
    if len(found) > 1:
        fitting = tuple(iri for iri in found if vocabulary.kinds[iri] & {*kinds})
        found = fitting if len(fitting) == 1 else found
    if len(found) == 1:
        return found[0]
    where = str(place) if place else None
    if found:
        raise RuleError(f"{name} is ambiguous", file=file, place=where, remedy=f"write {' or '.join(map(str, found))}")
    remedy = vocabulary.guess(name, kinds) or otherwise
    raise RuleError(f"{name} is not defined", file=file, place=where, remedy=remedy)


def _kind(predicate: str, arguments: tuple[Term, ...], vocabulary: Vocabulary) -> AtomKind:
    """Return the kind of an atom's name: as declared if possible, otherwise as its arguments suggest."""
    if predicate in (SAME, DIFFERENT):
        return "same" if predicate == SAME else "different"
    if predicate.startswith(SWRLB):
        return "builtin"
    if predicate.startswith(XSD):
        return "range"
    declared = vocabulary.kinds.get(predicate, frozenset())
    if "datatype" in declared:
        return "range"
    if len(arguments) < 2:
        return "class"
    used_for = declared & {"data property", "object property"}
    if len(used_for) == 1:
        return "data" if "data property" in used_for else "object"
    return "data" if isinstance(arguments[1], Lit) else "object"


IMP: Final = URIRef(SWRL + "Imp")
_VARIABLE: Final = URIRef(SWRL + "Variable")
ENABLED: Final = URIRef(SWRLA + "isRuleEnabled")
_PREDICATE_OF: Final = {
    "object": "propertyPredicate",
    "data": "propertyPredicate",
    "class": "classPredicate",
    "range": "dataRange",
    "builtin": "builtin",
}
_CLASS_OF: Final = {kind: name for name, kind in KINDS.items()}
#: Ends the names that rules without one get.
WITHOUT_NAME: Final = "without a name"
#: Beginnings of the IRIs that Protégé and owlready2 give to variables.
VARIABLE_IRIS: Final = ("urn:swrl:var#", "urn:swrl#")


def rules_of(file: OntologyFile) -> tuple[Rule, ...]:
    """All rules of one file, enabled or not, sorted by name and text."""
    return _read_rules(file.path, file.graph)


@lru_cache(maxsize=4)  # as many as there are graphs in the cache of those: their rules are read again and again
def _read_rules(path: Path, graph: Graph) -> tuple[Rule, ...]:
    rules, unnamed = list[Rule](), 0
    found = [(node, _sides(graph, node)) for node in graph.subjects(RDF.type, IMP)]
    texts = [(rule_text(*sides), node, sides) for node, sides in found]
    for text, node, (body, head) in sorted(texts, key=lambda each: (each[0], str(each[1]))):
        label = graph.value(node, RDFS.label)
        name = str(label) if label is not None else local_name(str(node))
        if label is None and isinstance(node, BNode):
            unnamed += 1
            name = f"rule {unnamed} {WITHOUT_NAME}"
        enabled = str(graph.value(node, ENABLED)).strip().lower() not in ("false", "0")
        rules.append(Rule(name, text, path, enabled, node, tuple(_closure(graph, node)), body, head))
    return tuple(sorted(rules, key=lambda rule: (rule.name, rule.text)))


def _closure(graph: Graph, start: Node) -> Iterator[RdfTriple]:
    """The triples of a rule: its own, and those of its lists and atoms, in a fixed order."""
    waiting, seen = [start], {start}
    while waiting:
        node = waiting.pop()
        for _, predicate, value in sorted(graph.triples((node, None, None)), key=lambda triple: str(triple[1])):
            yield node, predicate, value
            if value not in seen and (isinstance(value, BNode) or _is_part_of_rule(graph, value)):
                seen.add(value)
                waiting.append(value)


def _is_part_of_rule(graph: Graph, node: Node) -> bool:
    """Whether a named node is a list or an atom of a rule, as older editors write them."""
    return isinstance(node, URIRef) and any(
        str(kind).startswith(SWRL) and (str(kind).endswith(("Atom", "AtomList")))
        for kind in graph.objects(node, RDF.type)
    )


def _items(graph: Graph, start: Node | None) -> Iterator[Node]:
    """Items of a list; one that leads back into itself ends there."""
    if start is not None:
        with suppress(ValueError):
            yield from graph.items(start)


def _sides(graph: Graph, rule: Node) -> tuple[tuple[Atom, ...], tuple[Atom, ...]]:
    """Body and head, with short names for variables."""
    body, head = (
        [_read_atom(graph, atom) for atom in _items(graph, graph.value(rule, URIRef(SWRL + side)))]
        for side in ("body", "head")
    )
    names = distinct_variables((*body, *head))

    def renamed(atom: Atom) -> Atom:
        terms = (Variable(names[each.name]) if isinstance(each, Variable) else each for each in atom.arguments)
        return replace(atom, arguments=tuple(terms))

    return tuple(map(renamed, body)), tuple(map(renamed, head))


def _read_atom(graph: Graph, node: Node) -> Atom:
    kinds = sorted(str(kind) for kind in graph.objects(node, RDF.type))
    kind: AtomKind = next((KINDS[name] for name in kinds if name in KINDS), "")
    predicates = (graph.value(node, URIRef(SWRL + name)) for name in dict.fromkeys(_PREDICATE_OF.values()))
    predicate = next((term for term in predicates if term is not None), None)
    if kind == "builtin":
        arguments = list(_items(graph, graph.value(node, URIRef(SWRL + "arguments"))))
    else:
        given = [graph.value(node, URIRef(SWRL + name)) for name in ("argument1", "argument2")]
        arguments = [term for term in given if term is not None]
    if isinstance(predicate, BNode):
        name = EXPRESSION
    elif predicate is not None:
        name = str(predicate)
    else:
        name = {"same": SAME, "different": DIFFERENT}.get(kind, "")
    return Atom(kind, name, tuple(_read_term(graph, term) for term in arguments))


def _read_term(graph: Graph, term: Node) -> Term:
    if isinstance(term, Literal):
        return literal(term)
    if (term, RDF.type, _VARIABLE) in graph or str(term).startswith(VARIABLE_IRIS):
        return Variable(str(term))
    return Named(str(term))


def with_triples(rule: Rule) -> Rule:
    """Add the RDF of a rule that was read from text."""
    triples: list[RdfTriple] = [(rule.node, RDF.type, IMP), (rule.node, RDFS.label, Literal(rule.name))]
    for variable in dict.fromkeys(name for atom in rule.atoms for name in atom.variables()):
        triples.append((_write_term(Variable(variable)), RDF.type, _VARIABLE))
    for side, atoms in (("body", rule.body), ("head", rule.head)):
        nodes = [_write_atom(atom, triples) for atom in atoms]
        triples.append((rule.node, URIRef(SWRL + side), _write_list(nodes, SWRL + "AtomList", triples)))
    return replace(rule, triples=tuple(triples))


def _write_term(term: Term) -> Node:
    if isinstance(term, Variable):
        return URIRef(VARIABLE_IRIS[0] + term.name)
    if isinstance(term, Named):
        return URIRef(term.iri)
    if term.datatype.startswith("@"):
        return Literal(term.text, lang=term.datatype[1:])
    return Literal(term.text, datatype=URIRef(term.datatype), normalize=False)


def _write_atom(atom: Atom, triples: list[RdfTriple]) -> Node:
    node = BNode()
    triples.append((node, RDF.type, URIRef(_CLASS_OF[atom.kind])))
    if atom.kind in _PREDICATE_OF:
        triples.append((node, URIRef(SWRL + _PREDICATE_OF[atom.kind]), URIRef(atom.predicate)))
    if atom.kind == "builtin":
        arguments = _write_list([_write_term(term) for term in atom.arguments], str(RDF.List), triples)
        triples.append((node, URIRef(SWRL + "arguments"), arguments))
    else:
        for number, term in enumerate(atom.arguments[:2], start=1):
            triples.append((node, URIRef(f"{SWRL}argument{number}"), _write_term(term)))
    return node


def _write_list(items: Sequence[Node], kind: str, triples: list[RdfTriple]) -> Node:
    rest: Node = RDF.nil
    for item in reversed(items):
        node = BNode()
        triples += [(node, RDF.type, URIRef(kind)), (node, RDF.first, item), (node, RDF.rest, rest)]
        rest = node
    return rest
