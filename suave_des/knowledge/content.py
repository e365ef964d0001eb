"""Merge ontology files into one set of triples and rules, in the form that reasoners are given.

The form is N-Triples: unlike RDF/XML, all libraries in use write and read it without loss.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Final, NamedTuple

from rdflib import BNode, URIRef
from rdflib.namespace import OWL as OWL_TERMS
from rdflib.namespace import RDF
from rdflib.term import Node

from suave_des.errors import KnowledgeError, nearest
from suave_des.knowledge.ontology_file import OntologyFile, supplies
from suave_des.knowledge.rdf import (
    DECISION_PROPERTIES,
    HAS_VALUE,
    LANGUAGE_NAMESPACES,
    MROS,
    OWL,
    RDF_TYPE,
    RDFS,
    SWRL,
    SWRLA,
    XSD,
    Lit,
    Triple,
    is_fact,
    local_name,
    memberships,
    n_triple,
    n_triple_with_nodes,
    reached,
    term_of,
)
from suave_des.knowledge.rules import Rule
from suave_des.knowledge.rules.files import rules_of
from suave_des.resources import shipped_folder

_DECLARED: Final = frozenset(OWL + kind for kind in ("ObjectProperty", "DatatypeProperty", "Class"))
_CLASSES: Final = frozenset((OWL + "Class", RDFS + "Class"))
_PROPERTIES: Final = frozenset(
    OWL + kind
    for kind in (
        *("ObjectProperty", "DatatypeProperty", "FunctionalProperty", "InverseFunctionalProperty"),
        *("TransitiveProperty", "SymmetricProperty", "AsymmetricProperty", "ReflexiveProperty", "IrreflexiveProperty"),
    )
)
#: Begins the IRIs given to rules, by which Pellet's warnings and explanations name them.
RULE_IRI: Final = "urn:suave-des:rule:"
#: Annotations, which mean nothing for inference.
_ANNOTATIONS: Final = frozenset(
    (RDFS + "label", RDFS + "comment", RDFS + "seeAlso", RDFS + "isDefinedBy", OWL + "versionInfo")
) | {SWRLA + "isRuleEnabled"}


class Terms(NamedTuple):
    """The terms to read after an inference: properties for their values, classes for their members; sorted IRIs."""

    properties: tuple[str, ...]
    classes: tuple[str, ...]


@dataclass(frozen=True)
class Content:
    """The content of all ontology files.

    Attributes:
        triples: about named things and with named things or literals as values, without those of rules.
        structure: all others, with blank nodes in them (class expressions), as N-Triples.
        rules: the rules of all files, disabled ones included.
        replaced: rules that those of the same name in a later file of rules have replaced, each with its replacement.
    """

    triples: tuple[Triple, ...]
    structure: tuple[str, ...]
    rules: tuple[Rule, ...]
    replaced: tuple[tuple[Rule, Rule], ...] = ()

    @property
    def enabled_rules(self) -> tuple[Rule, ...]:
        """The enabled rules."""
        return tuple(rule for rule in self.rules if rule.enabled)

    def head_properties(self) -> frozenset[str]:
        """Properties that an enabled rule can assert."""
        return frozenset(name for rule in self.enabled_rules for name, _ in rule.head_properties)

    def head_classes(self) -> frozenset[str]:
        """Classes that an enabled rule can assert membership in."""
        return frozenset(name for rule in self.enabled_rules for name in rule.head_classes)

    def decision_terms(self) -> Terms:
        """Terms on which decisions depend, and terms that rules assert, with super-properties and inverses."""
        both_ways = (OWL + "inverseOf", OWL + "equivalentProperty")
        related = [(s, p, o) for s, p, o in self.triples if isinstance(o, str)]
        edges = [(s, o) for s, p, o in related if p in (RDFS + "subPropertyOf", *both_ways)]
        edges += [(o, s) for s, p, o in related if p in both_ways]
        wanted = reached((*self.head_properties(), *DECISION_PROPERTIES), edges)
        return Terms(_named(wanted), tuple(sorted(self.head_classes())))

    def all_terms(self) -> Terms:
        """Every property and class: some axiom can conclude any of them."""
        kinds: dict[str, set[str]] = {}
        for subject, predicate, value in self.triples:
            if predicate == RDF_TYPE and isinstance(value, str):
                kinds.setdefault(value, set()).add(subject)
        decisions = self.decision_terms()
        properties = {*decisions.properties, *(name for _, name, _ in filter(is_fact, self.triples))}
        properties = properties.union(*(kinds.get(kind, ()) for kind in _PROPERTIES))
        classes = {*decisions.classes, *(name for _, name in memberships(self.triples))}
        classes = classes.union(*(kinds.get(kind, ()) for kind in _CLASSES))
        return Terms(_named(properties - kinds.get(OWL + "AnnotationProperty", set())), _named(classes))

    def n_triples(self, rules: Sequence[Rule] | None = None) -> str:
        """Write all of it for a reasoner, with the enabled rules or those given."""
        chosen = self.enabled_rules if rules is None else rules
        lines = [n_triple(triple) for triple in self.triples]
        lines += self.structure
        lines += [n_triple(triple) for triple in _declarations(self.triples, chosen)]
        for rule in chosen:
            lines += _rule_lines(rule, self.rules.index(rule))
        return "".join(lines)


def _named(iris: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(iri for iri in iris if not iri.startswith(LANGUAGE_NAMESPACES)))


def merge(sources: Sequence[OntologyFile], values: Mapping[str, Decimal]) -> Content:
    """Merge the triples and rules of files, with the values of named QAvalue individuals replaced.

    Raises:
        KnowledgeError: a value names no individual with a hasValue.
    """
    triples: dict[Triple, None] = {}
    structure: list[str] = []
    rules: list[Rule] = []
    shipped = shipped_folder("ontology")
    # The shipped tomasys.owl also has the exemplar's mros rules: a given mros ontology replaces them.
    given_mros = {
        rule.name
        for source in sources
        if source.path.parent != shipped and supplies(source, MROS)
        for rule in rules_of(source)
    }
    for number, source in enumerate(sorted(sources, key=lambda source: source.content)):
        found = rules_of(source)
        rules += [rule for rule in found if source.path.parent != shipped or rule.name not in given_mros]
        # Triples about the ontology itself (imports, versions) are no part of its content.
        ontologies = set(source.graph.subjects(RDF.type, OWL_TERMS.Ontology))
        inside = {triple for rule in found for triple in rule.triples}
        for triple in sorted(set(source.graph) - inside):
            # Protégé declares the built-ins, about which Pellet logs a warning.
            if str(triple[1]) in _ANNOTATIONS or triple[0] in ontologies or triple[2] == URIRef(SWRL + "Builtin"):
                continue
            if any(isinstance(term, BNode) for term in triple):
                structure.append(n_triple_with_nodes(triple, f"f{number}", {}))
            else:
                triples[str(triple[0]), str(triple[1]), term_of(triple[2])] = None
    return Content(_override(tuple(sorted(triples, key=str)), values), tuple(structure), _in_order(rules))


def with_rules(content: Content, more: Iterable[Sequence[Rule]], disabled: Collection[str]) -> Content:
    """Add the rules of text files and disable rules.

    A file's rules replace all rules of the same names that were read before, of ontologies or of files: so a rule
    can be tried in another wording, or disabled by its mark.

    Raises:
        KnowledgeError: there is no rule of a name to disable.
    """
    rules, replaced = list(content.rules), list[tuple[Rule, Rule]]()
    for group in more:
        new = {rule.name: rule for rule in group}
        replaced += [(rule, new[rule.name]) for rule in rules if rule.name in new]
        rules = [rule for rule in rules if rule.name not in new] + list(group)
    known = {rule.name for rule in rules}
    for name in sorted(set(disabled) - known):
        raise KnowledgeError(
            f"there is no rule {name} to switch off",
            place=f"disabled_rules.{name}",
            remedy=nearest(name, known) or f"rules: {', '.join(sorted(known)) or 'none'}",
        )
    rules = [replace(rule, enabled=rule.enabled and rule.name not in disabled) for rule in rules]
    return replace(content, rules=_in_order(rules), replaced=tuple(replaced))


def _in_order(rules: Iterable[Rule]) -> tuple[Rule, ...]:
    return tuple(sorted(rules, key=lambda rule: (rule.name, rule.text, str(rule.file))))


def _override(triples: tuple[Triple, ...], values: Mapping[str, Decimal]) -> tuple[Triple, ...]:
    known = {local_name(triple[0]) for triple in triples if triple[1] == HAS_VALUE}
    for name in sorted(values.keys() - known):
        raise KnowledgeError(
            f"the ontology has no individual {name} with a hasValue",
            place=f"values.{name}",
            remedy=nearest(name, known) or f"known: {', '.join(sorted(known)) or 'none'}",
        )
    return tuple(
        (subject, predicate, Lit(format(values[local_name(subject)], "f"), XSD + "decimal"))
        if predicate == HAS_VALUE and local_name(subject) in values
        else (subject, predicate, value)
        for subject, predicate, value in triples
    )


def _declarations(triples: Iterable[Triple], rules: Sequence[Rule]) -> list[Triple]:
    """Declare properties and classes that occur only in the head of a rule.

    Pellet accepts an undeclared term, but stock owlready2 drops what is inferred of it; declared, both agree.
    """
    declared = {subject for subject, predicate, value in triples if predicate == RDF_TYPE and value in _DECLARED}
    heads = {
        (name, "DatatypeProperty" if is_data else "ObjectProperty")
        for rule in rules
        for name, is_data in rule.head_properties
    } | {(name, "Class") for rule in rules for name in rule.head_classes}
    return [(name, RDF_TYPE, OWL + kind) for name, kind in sorted(heads) if name not in declared]


def _rule_lines(rule: Rule, number: int) -> list[str]:
    """A rule's N-Triples, with an IRI for the rule and numbered blank nodes."""
    renamed: dict[Node, str] = {rule.node: f"<{RULE_IRI}{number}>"}
    for triple in rule.triples:
        for term in (triple[0], triple[2]):
            if isinstance(term, BNode) and term not in renamed:
                renamed[term] = f"_:r{number}n{len(renamed)}"
    return [
        n_triple_with_nodes(triple, f"r{number}", renamed)
        for triple in rule.triples
        if str(triple[1]) not in _ANNOTATIONS
    ]
