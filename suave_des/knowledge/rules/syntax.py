"""The parts of a SWRL rule: atoms over variables, named things and literals; and the built-ins that Pellet has.

Rules of ontologies and rules as text have the same form, so that the same functions write and check both.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal, NamedTuple

from rdflib.term import Node

from suave_des.errors import KnowledgeError
from suave_des.knowledge.rdf import OWL, SWRL, SWRLB, XSD, Lit, RdfTriple


class RuleError(KnowledgeError):
    """A rule that cannot be read or used; the place names line and column."""


class Variable(NamedTuple):
    """A variable, by its name without the question mark."""

    name: str


class Named(NamedTuple):
    """An individual by its IRI; as the parser returns it, perhaps by its bare name."""

    iri: str


class Place(NamedTuple):
    """A position in a text; both numbers count from 1."""

    line: int
    column: int

    def __str__(self) -> str:
        """Return the form that error messages show."""
        return f"line {self.line}, column {self.column}"


Term = Variable | Named | Lit
#: The kinds of atoms that SWRL has; "" is an atom whose name has not been looked up yet.
AtomKind = Literal["", "class", "object", "data", "range", "same", "different", "builtin"]
#: Kind by the name of the RDF class of an atom.
KINDS: Final[dict[str, AtomKind]] = {
    SWRL + "ClassAtom": "class",
    SWRL + "IndividualPropertyAtom": "object",
    SWRL + "DatavaluedPropertyAtom": "data",
    SWRL + "DataRangeAtom": "range",
    SWRL + "SameIndividualAtom": "same",
    SWRL + "DifferentIndividualsAtom": "different",
    SWRL + "BuiltinAtom": "builtin",
}
SAME: Final = OWL + "sameAs"
DIFFERENT: Final = OWL + "differentFrom"
#: The predicate of an atom on a class expression, which has no name.
EXPRESSION: Final = "_:expression"


@dataclass(frozen=True, slots=True)
class Atom:
    """One atom.

    Attributes:
        kind: what the predicate is used as.
        predicate: IRI of a class, property, datatype or builtin; as the parser returns it, perhaps a bare name.
        arguments: in order.
        places: of the predicate and of each argument; empty when it was not read from text.
    """

    kind: AtomKind
    predicate: str
    arguments: tuple[Term, ...]
    places: tuple[Place, ...] = field(default=(), compare=False)

    def place(self, argument: int | None = None) -> Place | None:
        """Place of the predicate, or of an argument."""
        number = 0 if argument is None else argument + 1
        return self.places[number] if number < len(self.places) else None

    @property
    def computes(self) -> bool:
        """Whether it is a built-in that computes its first argument, and does not only test it."""
        return self.kind == "builtin" and self.predicate not in TESTERS

    def takes_value(self, argument: int) -> bool:
        """Whether an argument stands for a value, not for an individual."""
        return self.kind in ("builtin", "range") or (self.kind == "data" and argument == 1)

    def variables(self) -> Iterator[str]:
        """Names of the variables among the arguments."""
        return (term.name for term in self.arguments if isinstance(term, Variable))


@dataclass(frozen=True, slots=True)
class ParsedRule:
    """A rule as text, before its names are looked up.

    Attributes:
        body: atoms that must hold.
        head: atoms that then hold.
        enabled: whether it is enabled.
        place: where it begins.
    """

    name: str
    body: tuple[Atom, ...]
    head: tuple[Atom, ...]
    enabled: bool = True
    place: Place = field(default=Place(1, 1), compare=False)


@dataclass(frozen=True)
class Rule:
    """One SWRL rule.

    Attributes:
        name: its rdfs:label, else the last part of its IRI, else its number among the unnamed of the file.
        text: the rule in the human-readable syntax, body -> head.
        file: the ontology file, or the file of rules as text.
        enabled: false when swrla:isRuleEnabled says so; Pellet itself ignores that mark.
        node: its node in the graph.
        triples: its RDF.
        body: atoms that must hold, each with its place: in the text for a rule from a graph, else in its file.
        head: atoms that then hold.
        place: "line 12" in a file of rules as text; None for a rule of an ontology.
    """

    name: str
    text: str
    file: Path
    enabled: bool
    node: Node = field(repr=False)
    triples: tuple[RdfTriple, ...] = field(repr=False)
    body: tuple[Atom, ...] = field(repr=False)
    head: tuple[Atom, ...] = field(repr=False)
    place: str | None = field(default=None, repr=False)

    @property
    def atoms(self) -> tuple[Atom, ...]:
        """Body and head."""
        return (*self.body, *self.head)

    def read_values(self) -> Iterator[tuple[str, str]]:
        """(variable, data property) of each atom of the body that reads a value."""
        for atom in self.body:
            if atom.kind == "data" and len(atom.arguments) == 2 and isinstance(atom.arguments[1], Variable):
                yield atom.arguments[1].name, atom.predicate

    @property
    def properties(self) -> frozenset[tuple[str, bool]]:
        """(property, whether it is used as a data property) of all atoms."""
        return _properties(self.atoms)

    @property
    def head_properties(self) -> frozenset[tuple[str, bool]]:
        """(property, whether its values are data) that the head asserts."""
        return _properties(self.head)

    @property
    def head_classes(self) -> frozenset[str]:
        """Classes that the head asserts membership in."""
        return frozenset(atom.predicate for atom in self.head if atom.kind == "class" and atom.predicate != EXPRESSION)


def _properties(atoms: Iterable[Atom]) -> frozenset[tuple[str, bool]]:
    return frozenset(
        (atom.predicate, atom.kind == "data") for atom in atoms if atom.kind in ("object", "data") and atom.predicate
    )


def texts_of(atoms: Iterable[Atom], predicate: str) -> set[str]:
    """Texts that atoms mention as values of a property."""
    terms = (term for atom in atoms if atom.predicate == predicate for term in atom.arguments)
    return {term.text for term in terms if isinstance(term, Lit) and term.datatype == XSD + "string"}


#: The sign of each built-in that compares two values.
COMPARISONS: Final[Mapping[str, str]] = {
    SWRLB + "equal": "=",
    SWRLB + "notEqual": "!=",
    SWRLB + "lessThan": "<",
    SWRLB + "lessThanOrEqual": "<=",
    SWRLB + "greaterThan": ">",
    SWRLB + "greaterThanOrEqual": ">=",
}
#: The built-in of each sign.
COMPARISON_OF: Final[Mapping[str, str]] = {sign: name for name, sign in COMPARISONS.items()}
_TESTING_TEXT: Final = ["contains", "containsIgnoreCase", "endsWith", "matches", "startsWith", "stringEqualIgnoreCase"]
#: Built-ins that compare, so that every argument must be bound; the others compute their first one.
TESTERS: Final = frozenset((*COMPARISONS, *(SWRLB + name for name in _TESTING_TEXT)))
#: Pellet's built-ins, with the least and the largest number of arguments.
BUILTINS: Final[Mapping[str, tuple[int, int]]] = dict.fromkeys(TESTERS, (2, 2)) | {
    SWRLB + name: counts
    for names, counts in (
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


def mirrored(sign: str) -> str:
    """The sign of a comparison with its sides exchanged: > for <."""
    return sign.translate(str.maketrans("<>", "><"))
