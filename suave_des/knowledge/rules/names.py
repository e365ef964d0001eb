"""Names in rules: the vocabulary of an ontology, and the lookup of a parsed rule's names."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from rdflib import BNode

from suave_des.errors import nearest
from suave_des.knowledge.rdf import (
    LANGUAGE_NAMESPACES,
    MROS,
    OWL,
    RDF_TYPE,
    RDFS,
    SWRLB,
    TOMASYS,
    XSD,
    Lit,
    Triple,
    local_name,
)
from suave_des.knowledge.rules.rdf import with_triples
from suave_des.knowledge.rules.syntax import (
    BUILTINS,
    DIFFERENT,
    SAME,
    Atom,
    AtomKind,
    Named,
    ParsedRule,
    Place,
    Rule,
    RuleError,
    Term,
)
from suave_des.knowledge.rules.writer import line_of_rule

_DECLARED: Final = {
    OWL + "Class": "class",
    RDFS + "Class": "class",
    OWL + "ObjectProperty": "object property",
    OWL + "DatatypeProperty": "data property",
    OWL + "AnnotationProperty": "annotation property",
    RDFS + "Datatype": "datatype",
    OWL + "NamedIndividual": "individual",
}


@dataclass(frozen=True)
class Vocabulary:
    """The names that rules may use.

    Attributes:
        kinds: what each IRI is declared as or used as: class, object property, data property, annotation property,
            datatype, individual.
        by_name: IRIs by their last part.
        ranges: datatypes that the values of a data property can have, where that is one datatype or a choice of them.
        enumerations: the values that a data property can have, where its range lists them.
    """

    kinds: Mapping[str, frozenset[str]]
    by_name: Mapping[str, tuple[str, ...]]
    ranges: Mapping[str, frozenset[str]]
    enumerations: Mapping[str, frozenset[str]] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        triples: Collection[Triple],
        individuals: Iterable[str] = (),
        enumerations: Mapping[str, frozenset[str]] | None = None,
    ) -> Vocabulary:
        """Collect the names in triples.

        Args:
            triples: of the ontologies.
            individuals: further ones, that exist only in states.
            enumerations: the values that data properties can have, where their ranges list them.
        """
        kinds: dict[str, set[str]] = defaultdict(set, {OWL + "Thing": {"class"}, OWL + "Nothing": {"class"}})
        ranges: dict[str, set[str]] = defaultdict(set)
        by_name: dict[str, list[str]] = defaultdict(list)
        for subject, predicate, value in triples:
            if predicate == RDF_TYPE and isinstance(value, str):
                if value in _DECLARED or not value.startswith(LANGUAGE_NAMESPACES):
                    kinds[subject].add(_DECLARED.get(value, "individual"))
            elif not predicate.startswith(LANGUAGE_NAMESPACES):
                kinds[subject].add("individual")
                if isinstance(value, str):
                    kinds[value].add("individual")
            elif predicate == RDFS + "range" and isinstance(value, str) and value.startswith(XSD):
                ranges[subject].add(value)
        for iri in individuals:
            kinds[iri].add("individual")
        for iri in sorted(kinds):
            by_name[local_name(iri)].append(iri)
        return cls(
            {iri: frozenset(found) for iri, found in kinds.items()},
            {name: tuple(found) for name, found in by_name.items()},
            # All ranges of a property hold at once; which values several of them leave is not worked out.
            {name: frozenset(found) for name, found in ranges.items() if len(found) == 1}
            | dict.fromkeys(enumerations or (), frozenset((XSD + "string",))),
            enumerations or {},
        )

    def candidates(self, name: str) -> tuple[str, ...]:
        """IRIs that a bare name can mean: those of TOMASys and mros take precedence over others."""
        found = self.by_name.get(name, ())
        shared = tuple(iri for iri in found if iri.startswith((TOMASYS, MROS)))
        return shared or found or ((SWRLB + name,) if SWRLB + name in BUILTINS else ())

    def means_itself(self, iri: str) -> bool:
        """Whether the bare name of an IRI means that IRI."""
        return self.candidates(local_name(iri)) == (iri,)

    def guess(self, name: str, wanted: Collection[str]) -> str | None:
        """Suggest a name of the wanted kinds, as a question."""
        bare = local_name(name)
        known = [each for each, iris in self.by_name.items() if any(self.kinds[iri] & {*wanted} for iri in iris)]
        if "builtin" in wanted:
            known += map(local_name, BUILTINS)
        if bare in known and bare != name:
            return f"did you mean {' or '.join(self.candidates(bare))}?"
        return nearest(bare, known)


def rule_from_text(parsed: ParsedRule, vocabulary: Vocabulary, file: Path) -> Rule:
    """Look up all names of a rule.

    Raises:
        RuleError: a name is unknown or ambiguous; with line and column.
    """
    body, head = (tuple(_resolved(atom, vocabulary, file) for atom in side) for side in (parsed.body, parsed.head))
    text, _, _ = line_of_rule(body, head)
    place = f"line {parsed.place.line}"
    return with_triples(Rule(parsed.name, text, file, parsed.enabled, BNode(), (), body, head, place))


def _resolved(atom: Atom, vocabulary: Vocabulary, file: Path) -> Atom:
    kinds: tuple[str, ...] = ("class", "object property", "data property", "builtin")
    predicate = _iri(atom.predicate, atom.place(), vocabulary, file, kinds)
    arguments = tuple(
        Named(_iri(term.iri, atom.place(number), vocabulary, file, ("individual",), _not_a_name(term.iri, number)))
        if isinstance(term, Named)
        else term
        for number, term in enumerate(atom.arguments)
    )
    return replace(atom, kind=_kind(predicate, arguments, vocabulary), predicate=predicate, arguments=arguments)


def _not_a_name(word: str, number: int) -> str:
    """Say how to write what is perhaps no individual's name, but a truth value, a text or a variable."""
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
