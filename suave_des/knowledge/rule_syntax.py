"""What a SWRL rule is made of: atoms over variables, named things and literals.

One form for rules from ontologies and from text, so that both are written and checked by the same functions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, Literal, NamedTuple

from suave_des.knowledge.situation import Lit
from suave_des.knowledge.vocabulary import OWL, SWRL


class Variable(NamedTuple):
    """A variable, by its name without the question mark."""

    name: str


class Named(NamedTuple):
    """An individual by its IRI; as the parser returns it, perhaps by its bare name."""

    iri: str


class Place(NamedTuple):
    """Where something stands in a text; both count from 1."""

    line: int
    column: int


Term = Variable | Named | Lit
#: The kinds of atoms that SWRL has; "" is an atom whose name has not been looked up yet.
Kind = Literal["", "class", "object", "data", "range", "same", "different", "builtin"]
#: Kind by the name of the RDF class of an atom.
KINDS: Final[dict[str, Kind]] = {
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
#: Stands for a class expression, which has no name.
EXPRESSION: Final = "_:expression"


@dataclass(frozen=True, slots=True)
class Atom:
    """One atom.

    Attributes:
        kind: what the predicate is used as.
        predicate: IRI of a class, property, datatype or builtin; as the parser returns it, perhaps a bare name.
        arguments: in order.
        places: where the predicate stands and where each argument does; empty when it was not read from text.
    """

    kind: Kind
    predicate: str
    arguments: tuple[Term, ...]
    places: tuple[Place, ...] = field(default=(), compare=False)

    def place(self, argument: int | None = None) -> Place | None:
        """Where the predicate stands, or an argument."""
        number = 0 if argument is None else argument + 1
        return self.places[number] if number < len(self.places) else None

    def variables(self) -> Iterator[str]:
        """Names of the variables among the arguments."""
        return (term.name for term in self.arguments if isinstance(term, Variable))


@dataclass(frozen=True, slots=True)
class RuleText:
    """A rule as a text says it, before its names are looked up.

    Attributes:
        name: its name.
        body: atoms that must hold.
        head: atoms that then hold.
        enabled: whether it is in force.
        place: where it begins.
    """

    name: str
    body: tuple[Atom, ...]
    head: tuple[Atom, ...]
    enabled: bool = True
    place: Place = field(default=Place(1, 1), compare=False)
