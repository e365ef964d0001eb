"""What names in rules mean: the vocabulary of a knowledge base, and rules as text turned into rules of its own."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Final

from rdflib import BNode, Literal, URIRef
from rdflib.namespace import RDF, RDFS
from rdflib.term import Node

from suave_des.knowledge.rule_parser import RuleError
from suave_des.knowledge.rule_syntax import DIFFERENT, KINDS, SAME, Atom, Kind, Named, Place, RuleText, Term, Variable
from suave_des.knowledge.rule_writer import line_of_rule
from suave_des.knowledge.rules import IMP, VARIABLE_IRIS, RdfTriple, Rule
from suave_des.knowledge.situation import Lit, Model, Triple
from suave_des.knowledge.vocabulary import (
    LANGUAGE_NAMESPACES,
    MROS,
    OWL,
    RDF_TYPE,
    SWRL,
    SWRLB,
    TOMASYS,
    XSD,
    local_name,
    nearest,
)
from suave_des.knowledge.vocabulary import (
    RDFS as RDFS_NS,
)

#: Pellet's built-ins, as its registry has them, with the numbers of arguments that make sense.
BUILTINS: Final[Mapping[str, tuple[int, int]]] = MappingProxyType(
    {
        SWRLB + name: counts
        for names, counts in (
            ("equal notEqual lessThan lessThanOrEqual greaterThan greaterThanOrEqual", (2, 2)),
            ("contains containsIgnoreCase endsWith matches startsWith stringEqualIgnoreCase", (2, 2)),
            ("abs ceiling cos floor round sin tan unaryMinus unaryPlus booleanNot", (2, 2)),
            ("lowerCase normalizeSpace stringLength upperCase", (2, 2)),
            ("divide integerDivide mod pow subtract", (3, 3)),
            ("add multiply", (3, 99)),
            ("roundHalfToEven", (2, 3)),
            ("stringConcat", (2, 99)),
            ("substring", (3, 4)),
            ("substringAfter substringBefore tokenize", (3, 3)),
            ("replace translate", (4, 4)),
            ("anyURI resolveURI", (2, 99)),
            ("date", (4, 5)),
            ("dateTime", (7, 8)),
            ("time", (4, 5)),
            ("dayTimeDuration", (2, 5)),
            ("yearMonthDuration", (2, 3)),
        )
        for name in names.split()
    }
)
#: Built-ins that compare, of which every argument must be bound; the others compute their first one.
TESTERS: Final = frozenset(
    SWRLB + name
    for name in (
        *("equal", "notEqual", "lessThan", "lessThanOrEqual", "greaterThan", "greaterThanOrEqual"),
        *("contains", "containsIgnoreCase", "endsWith", "matches", "startsWith", "stringEqualIgnoreCase"),
    )
)
_DECLARED: Final = {
    OWL + "Class": "class",
    RDFS_NS + "Class": "class",
    OWL + "ObjectProperty": "object property",
    OWL + "DatatypeProperty": "data property",
    OWL + "AnnotationProperty": "annotation property",
    RDFS_NS + "Datatype": "datatype",
    OWL + "NamedIndividual": "individual",
}
_KIND_OF: Final[dict[str, Kind]] = {"class": "class", "object property": "object", "data property": "data"}


@dataclass(frozen=True)
class Vocabulary:
    """The names that rules may use.

    Attributes:
        kinds: what each IRI is declared as or used as: class, object property, data property, annotation property,
            datatype, individual.
        by_name: IRIs by their last part.
        ranges: datatypes that the values of a data property can have, where that is one datatype or a choice of them.
    """

    kinds: Mapping[str, frozenset[str]]
    by_name: Mapping[str, tuple[str, ...]]
    ranges: Mapping[str, frozenset[str]]

    @classmethod
    def of(cls, triples: Collection[Triple], model: Model | None) -> Vocabulary:
        """The names in triples, and those of the individuals that exist only in states."""
        kinds: dict[str, set[str]] = {OWL + "Thing": {"class"}, OWL + "Nothing": {"class"}}
        for subject, predicate, value in triples:
            if predicate == RDF_TYPE and isinstance(value, str):
                known = _DECLARED.get(value)
                if known is not None:
                    kinds.setdefault(subject, set()).add(known)
                elif not value.startswith(LANGUAGE_NAMESPACES):
                    kinds.setdefault(subject, set()).add("individual")
            elif not predicate.startswith(LANGUAGE_NAMESPACES):
                kinds.setdefault(subject, set()).add("individual")
                if isinstance(value, str):
                    kinds.setdefault(value, set()).add("individual")
        for iri in () if model is None else _in_states(model):
            kinds.setdefault(iri, set()).add("individual")
        ranges: dict[str, set[str]] = {}
        for subject, predicate, value in triples:
            if predicate == RDFS_NS + "range" and isinstance(value, str) and value.startswith(XSD):
                ranges.setdefault(subject, set()).add(value)
        by_name: dict[str, list[str]] = {}
        for iri in sorted(kinds):
            by_name.setdefault(local_name(iri), []).append(iri)
        return cls(
            {iri: frozenset(found) for iri, found in kinds.items()},
            {name: tuple(found) for name, found in by_name.items()},
            # Of several ranges all hold at once: which values that leaves is not for this table to say.
            {name: frozenset(found) for name, found in ranges.items() if len(found) == 1},
        )

    def candidates(self, name: str) -> tuple[str, ...]:
        """What a bare name can mean: those of the shared vocabularies go before others of the same name."""
        found = self.by_name.get(name, ())
        shared = tuple(iri for iri in found if iri.startswith((TOMASYS, MROS)))
        return shared or found or ((SWRLB + name,) if SWRLB + name in BUILTINS else ())

    def means_itself(self, iri: str) -> bool:
        """Whether the bare name of an IRI means that IRI."""
        return self.candidates(local_name(iri)) == (iri,)

    def guess(self, name: str, wanted: Collection[str] = ()) -> str | None:
        """A question after the name that was perhaps meant, of the wanted kinds."""
        bare = local_name(name)
        wished = {*wanted}
        known = [
            each for each, iris in self.by_name.items() if not wanted or any(self.kinds[iri] & wished for iri in iris)
        ]
        if not wanted or "builtin" in wanted:
            known += [local_name(iri) for iri in BUILTINS]
        if bare in known and bare != name:
            return f"did you mean {' or '.join(self.candidates(bare))}?"
        return nearest(bare, known)


def _in_states(model: Model) -> Iterator[str]:
    for group in (model.objectives, model.groundings, model.measurements):
        yield from (individual.iri for individual in group.values())


def rule_from_text(parsed: RuleText, vocabulary: Vocabulary, file: Path) -> Rule:
    """A rule with all its names looked up.

    Raises:
        RuleError: a name is unknown or ambiguous; with line and column.
    """
    body, head = (tuple(_resolved(atom, vocabulary, file) for atom in side) for side in (parsed.body, parsed.head))
    return with_triples(
        Rule(
            name=parsed.name,
            text=line_of_rule(body, head).name,
            file=file,
            enabled=parsed.enabled,
            node=BNode(),
            triples=(),
            body=body,
            head=head,
            place=f"line {parsed.place.line}",
        )
    )


def _resolved(atom: Atom, vocabulary: Vocabulary, file: Path) -> Atom:
    kinds: tuple[str, ...] = ("class", "object property", "data property", "builtin")
    predicate = _iri(atom.predicate, atom.place(), vocabulary, file, kinds)
    arguments = tuple(
        Named(_iri(term.iri, atom.place(number), vocabulary, file, ("individual",)))
        if isinstance(term, Named)
        else term
        for number, term in enumerate(atom.arguments)
    )
    return replace(atom, kind=_kind(predicate, arguments, vocabulary), predicate=predicate, arguments=arguments)


def _iri(name: str, place: Place | None, vocabulary: Vocabulary, file: Path, kinds: Collection[str]) -> str:
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
    where = f"line {place.line}, column {place.column}" if place else None
    if found:
        raise RuleError(f"{name} is ambiguous", file=file, place=where, remedy=f"write {' or '.join(map(str, found))}")
    raise RuleError(f"{name} is not defined", file=file, place=where, remedy=vocabulary.guess(name, kinds))


def _kind(predicate: str, arguments: tuple[Term, ...], vocabulary: Vocabulary) -> Kind:
    """What an atom uses its name as: what it is declared as where that can be, else what its arguments look like."""
    if predicate in (SAME, DIFFERENT):
        return "same" if predicate == SAME else "different"
    if predicate.startswith(SWRLB) or predicate in BUILTINS:
        return "builtin"
    if predicate.startswith(XSD):
        return "range"
    declared = vocabulary.kinds.get(predicate, frozenset())
    if "datatype" in declared:
        return "range"
    wanted: Kind = "class"
    if len(arguments) > 1:
        wanted = "data" if isinstance(arguments[1], Lit) else "object"
        if "data property" in declared and "object property" not in declared:
            return "data"
        if "object property" in declared and "data property" not in declared:
            return "object"
    return wanted


def with_triples(rule: Rule) -> Rule:
    """A rule of text, with the RDF that says the same."""
    if not rule.triples:
        triples: list[RdfTriple] = [(rule.node, RDF.type, IMP), (rule.node, RDFS.label, Literal(rule.name))]
        for variable in dict.fromkeys(name for atom in rule.atoms for name in atom.variables()):
            triples.append((_variable(variable), RDF.type, URIRef(SWRL + "Variable")))
        for side, atoms in (("body", rule.body), ("head", rule.head)):
            nodes = [_atom_triples(atom, triples) for atom in atoms]
            triples.append((rule.node, URIRef(SWRL + side), _list(nodes, SWRL + "AtomList", triples)))
        return replace(rule, triples=tuple(triples))
    return rule


def _variable(name: str) -> URIRef:
    return URIRef(VARIABLE_IRIS[0] + name)


def _term(term: Term) -> Node:
    if isinstance(term, Variable):
        return _variable(term.name)
    if isinstance(term, Named):
        return URIRef(term.iri)
    if term.datatype.startswith("@"):
        return Literal(term.text, lang=term.datatype[1:])
    return Literal(term.text, datatype=URIRef(term.datatype), normalize=False)


def _atom_triples(atom: Atom, triples: list[RdfTriple]) -> Node:
    node = BNode()
    triples.append((node, RDF.type, URIRef(next(name for name, kind in KINDS.items() if kind == atom.kind))))
    predicate = {"class": "classPredicate", "range": "dataRange", "builtin": "builtin"}.get(atom.kind)
    if atom.kind in ("object", "data"):
        predicate = "propertyPredicate"
    if predicate is not None:
        triples.append((node, URIRef(SWRL + predicate), URIRef(atom.predicate)))
    if atom.kind == "builtin":
        arguments = [_term(term) for term in atom.arguments]
        triples.append((node, URIRef(SWRL + "arguments"), _list(arguments, str(RDF.List), triples)))
    else:
        for number, term in enumerate(atom.arguments[:2], start=1):
            triples.append((node, URIRef(f"{SWRL}argument{number}"), _term(term)))
    return node


def _list(items: list[Node], kind: str, triples: list[RdfTriple]) -> Node:
    rest: Node = RDF.nil
    for item in reversed(items):
        node = BNode()
        triples += [(node, RDF.type, URIRef(kind)), (node, RDF.first, item), (node, RDF.rest, rest)]
        rest = node
    return rest
