"""Merge ontology files into one set of triples, in the form that reasoners are given.

Text is N-Triples: unlike RDF/XML it can be written without loss by every library in use.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Final

from rdflib import BNode, Literal, URIRef
from rdflib.namespace import OWL as OWL_TERMS
from rdflib.namespace import RDF
from rdflib.term import Node

from suave_des.errors import KnowledgeError
from suave_des.knowledge.catalogue import supplies
from suave_des.knowledge.ontology_file import OntologyFile
from suave_des.knowledge.rules import RdfTriple, Rule, literal, rules_of
from suave_des.knowledge.situation import Lit, Triple
from suave_des.knowledge.vocabulary import (
    MROS,
    OWL,
    RDF_TYPE,
    RDFS,
    SWRL,
    SWRLA,
    SWRLB,
    TOMASYS,
    XSD,
    local_name,
    nearest,
)
from suave_des.resources import shipped_folder

_HAS_VALUE: Final = TOMASYS + "hasValue"
_DECLARED: Final = frozenset(OWL + kind for kind in ("ObjectProperty", "DatatypeProperty", "Class"))
#: Names that rules get for the reasoner, which then names the rule when it complains of one.
RULE_IRI: Final = "urn:suave-des:rule:"
#: Words for people, which mean nothing for inference.
_ANNOTATIONS: Final = frozenset(
    (RDFS + "label", RDFS + "comment", RDFS + "seeAlso", RDFS + "isDefinedBy", OWL + "versionInfo")
) | {SWRLA + "isRuleEnabled"}


@dataclass(frozen=True)
class Content:
    """What the ontologies say: triples that do not belong to rules, and the rules.

    Attributes:
        triples: about named things and with named things or literals as values.
        structure: all others, with blank nodes in them (class expressions), as N-Triples.
        rules: the rules of all files, disabled ones included.
    """

    triples: tuple[Triple, ...]
    structure: tuple[str, ...]
    rules: tuple[Rule, ...]

    @property
    def enabled_rules(self) -> tuple[Rule, ...]:
        """The rules that are in force."""
        return tuple(rule for rule in self.rules if rule.enabled)

    def head_properties(self) -> frozenset[str]:
        """Properties that an enabled rule can assert."""
        return frozenset(name for rule in self.enabled_rules for name, _ in rule.head_properties)

    def head_classes(self) -> frozenset[str]:
        """Classes that an enabled rule can assert membership in."""
        return frozenset(name for rule in self.enabled_rules for name in rule.head_classes)

    def n_triples(self, rules: Sequence[Rule] | None = None) -> str:
        """All of it for a reasoner, with the enabled rules or those given."""
        chosen = self.enabled_rules if rules is None else rules
        lines = [n_triple(triple) for triple in self.triples]
        lines += self.structure
        lines += [n_triple(triple) for triple in _declarations(self.triples, chosen)]
        for rule in chosen:
            lines += _rule_lines(rule, f"{RULE_IRI}{self.rules.index(rule)}", f"r{self.rules.index(rule)}")
        return "".join(lines)


def merge(sources: Sequence[OntologyFile], values: Mapping[str, Decimal]) -> Content:
    """All triples and rules of the files, with the values of named QAvalue individuals replaced.

    Raises:
        KnowledgeError: a value names no individual with a hasValue.
    """
    triples: dict[Triple, None] = {}
    structure: list[str] = []
    rules: list[Rule] = []
    shipped = shipped_folder("ontology")
    # The shipped tomasys.owl also has the exemplar's mros rules: a given mros ontology stands in for those.
    given_mros = {
        rule.name
        for source in sources
        if source.path.parent != shipped and supplies(source, MROS)
        for rule in rules_of(source)
    }
    for number, source in enumerate(sorted(sources, key=lambda source: source.content)):
        found = rules_of(source)
        rules += [rule for rule in found if source.path.parent != shipped or rule.name not in given_mros]
        # What is said of the ontology itself (imports, versions) is no part of its content.
        ontologies = set(source.graph.subjects(RDF.type, OWL_TERMS.Ontology))
        inside = {triple for rule in found for triple in rule.triples}
        for triple in sorted(set(source.graph) - inside):
            if str(triple[1]) in _ANNOTATIONS or triple[0] in ontologies or _declares_builtin(triple):
                continue
            if any(isinstance(term, BNode) for term in triple):
                structure.append(_n3_line(triple, f"f{number}"))
            else:
                triples[_plain(triple)] = None
    return Content(
        triples=_override(tuple(sorted(triples, key=str)), values),
        structure=tuple(structure),
        rules=tuple(sorted(rules, key=lambda rule: (rule.name, rule.text, str(rule.file)))),
    )


def _override(triples: tuple[Triple, ...], values: Mapping[str, Decimal]) -> tuple[Triple, ...]:
    known = {local_name(triple[0]) for triple in triples if triple[1] == _HAS_VALUE}
    for name in sorted(values.keys() - known):
        raise KnowledgeError(
            f"the ontology has no individual {name} with a hasValue",
            place=f"values.{name}",
            remedy=nearest(name, known) or f"known: {', '.join(sorted(known)) or 'none'}",
        )
    return tuple(
        (subject, predicate, Lit(format(values[local_name(subject)], "f"), XSD + "decimal"))
        if predicate == _HAS_VALUE and local_name(subject) in values
        else (subject, predicate, value)
        for subject, predicate, value in triples
    )


def _declares_builtin(triple: RdfTriple) -> bool:
    """Protégé declares the built-ins it knows; the reasoner does not know that declaration, and complains."""
    return triple[1] == RDF.type and triple[2] == URIRef(SWRL + "Builtin") and str(triple[0]).startswith(SWRLB)


def _declarations(triples: Iterable[Triple], rules: Sequence[Rule]) -> list[Triple]:
    """Declarations of properties and classes that stand in a rule's head alone.

    In-process Pellet takes such a term as it comes, stock owlready2 drops what is inferred of it: declared, it
    means the same to both.
    """
    declared = {subject for subject, predicate, value in triples if predicate == RDF_TYPE and value in _DECLARED}
    heads = {
        (name, "DatatypeProperty" if is_data else "ObjectProperty")
        for rule in rules
        for name, is_data in rule.head_properties
    } | {(name, "Class") for rule in rules for name in rule.head_classes}
    return [(name, RDF_TYPE, OWL + kind) for name, kind in sorted(heads) if name not in declared]


def _plain(triple: RdfTriple) -> Triple:
    subject, predicate, value = triple
    return str(subject), str(predicate), literal(value) if isinstance(value, Literal) else str(value)


_DECIMAL: Final = re.compile(r"([+-]?)(?=\.?[0-9])([0-9]*)\.?([0-9]*)")
_ESCAPES: Final = str.maketrans({"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"})


def canonical(value: Lit) -> Lit:
    """A decimal number in its one shortest form.

    A rule's 2.00 is meant to match a measured 2; Pellet compares texts, and stock owlready2 rewrites some of them.
    """
    found = _DECIMAL.fullmatch(value.text.strip())
    if value.datatype != XSD + "decimal" or found is None:
        return value
    sign, whole, part = found.groups()
    text = (whole.lstrip("0") or "0") + (f".{part.rstrip('0')}" if part.rstrip("0") else "")
    return Lit(f"-{text}" if sign == "-" and text != "0" else text, value.datatype)


def _object(value: str | Lit) -> str:
    if isinstance(value, str):
        return f"<{value}>"
    value = canonical(value)
    text = "".join(char if char.isascii() else f"\\U{ord(char):08X}" for char in value.text.translate(_ESCAPES))
    return f'"{text}"{value.datatype}' if value.datatype.startswith("@") else f'"{text}"^^<{value.datatype}>'


def n_triple(triple: Triple) -> str:
    """One line of N-Triples."""
    return f"<{triple[0]}> <{triple[1]}> {_object(triple[2])} .\n"


def _n3_line(triple: RdfTriple, scope: str, renamed: Mapping[Node, str] | None = None) -> str:
    """One line of N-Triples for a triple with blank nodes, whose names are kept apart by a scope."""

    def write(term: Node) -> str:
        if renamed is not None and term in renamed:
            return renamed[term]
        if isinstance(term, BNode):
            return f"_:{scope}x" + "".join(char for char in str(term) if char.isascii() and char.isalnum())
        return _object(literal(term) if isinstance(term, Literal) else str(term))

    return f"{write(triple[0])} {write(triple[1])} {write(triple[2])} .\n"


def _rule_lines(rule: Rule, iri: str, scope: str) -> list[str]:
    """A rule's triples, with an IRI for the rule and numbered blank nodes."""
    renamed: dict[Node, str] = {rule.node: f"<{iri}>"}
    for triple in rule.triples:
        for term in (triple[0], triple[2]):
            if isinstance(term, BNode) and term not in renamed:
                renamed[term] = f"_:{scope}n{len(renamed)}"
    return [_n3_line(triple, scope, renamed) for triple in rule.triples if str(triple[1]) not in _ANNOTATIONS]
