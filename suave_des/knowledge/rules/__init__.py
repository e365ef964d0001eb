"""SWRL rules: atoms over variables, named things and literals; their text; Pellet's built-ins.

Rules of ontologies and rules as text have the same form, so that the same functions write and check
both.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal, NamedTuple

from suave_des.errors import KnowledgeError
from suave_des.knowledge.rdf import (
    BOOLEAN,
    DECIMAL,
    ESCAPES,
    OWL,
    PREFIXES,
    STRING,
    SWRL,
    SWRLB,
    XSD,
    Lit,
    Triple,
    local_name,
    namespace,
    terms,
)


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
ATOM_KINDS: dict[str, AtomKind] = {
    SWRL + "ClassAtom": "class",
    SWRL + "IndividualPropertyAtom": "object",
    SWRL + "DatavaluedPropertyAtom": "data",
    SWRL + "DataRangeAtom": "range",
    SWRL + "SameIndividualAtom": "same",
    SWRL + "DifferentIndividualsAtom": "different",
    SWRL + "BuiltinAtom": "builtin",
}
#: Kinds of atoms that are about facts, which bind all of their variables; the others compare or
# compute.
FACT_KINDS = ("class", "object", "data", "same", "different")
SAME = OWL + "sameAs"
DIFFERENT = OWL + "differentFrom"
IDENTITIES = (SAME, DIFFERENT)
NOT_THE_SAME = (
    "asks about identity with nothing but names: Pellet's inferences are not the same each time"
)
"""Of atoms in Rule.identities_of_names."""


@dataclass(frozen=True, slots=True)
class Atom:
    """One atom.

    Attributes:
        kind: what the predicate is used as.
        predicate: IRI of a class, property, datatype or builtin; as the parser returns it, perhaps
            a bare name; of a class expression or a data range, "_:" and its words.
        places: of the predicate and of each argument; empty when it was not read from text.
        expression: the triples of the class expression or data range, the first one about it.
    """

    kind: AtomKind
    predicate: str
    arguments: tuple[Term, ...]
    places: tuple[Place, ...] = field(default=(), compare=False)
    expression: tuple[Triple, ...] = field(default=(), repr=False)

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
        return _variables_in(self.arguments)


def _variables_in(terms: Iterable[Term]) -> Iterator[str]:
    return (term.name for term in terms if isinstance(term, Variable))


@dataclass(frozen=True)
class Rule:
    """One SWRL rule.

    Attributes:
        name: its rdfs:label, else the last part of its IRI, else its number among the unnamed of
            the file.
        body: atoms that must hold; those of a rule as text have their places.
        head: atoms that then hold.
        enabled: false when swrla:isRuleEnabled says so; Pellet itself ignores that mark.
        file: the ontology file, or the file of rules as text.
        line: of the file, where the rule begins; None where the file does not show it.
        triples: its RDF, as an ontology has it; none of a rule as text.
        undeclared: variables that its ontology does not declare as such.
    """

    name: str
    body: tuple[Atom, ...]
    head: tuple[Atom, ...]
    enabled: bool = True
    file: Path = Path()
    line: int | None = None
    triples: tuple[Triple, ...] = field(default=(), repr=False)
    undeclared: tuple[str, ...] = field(default=(), compare=False, repr=False)

    @cached_property
    def text(self) -> str:
        """The rule on one line in the human-readable syntax, without its name: body -> head."""
        sides = (" ^ ".join(map(write_atom, side)) for side in (self.body, self.head))
        return " -> ".join(sides).strip()

    @property
    def atoms(self) -> tuple[Atom, ...]:
        """Body and head."""
        return (*self.body, *self.head)

    @property
    def speaks_of_identity(self) -> bool:
        """Whether it asks or concludes that individuals are the same, or different."""
        return any(atom.predicate in IDENTITIES for atom in self.atoms)

    @property
    def identities_of_names(self) -> tuple[Atom, ...]:
        """Atoms of the body that ask whether individuals are the same, or different, with nothing
        in it that says which: of names, or of variables that no fact binds.

        Pellet decides these by cases, and what it was asked before can decide what follows.
        """
        facts = [atom for atom in self.body if atom.kind in ("class", "object", "data")]
        bound = {term for atom in facts for term in atom.arguments if isinstance(term, Variable)}
        asking = [atom for atom in self.body if atom.predicate in IDENTITIES]
        return tuple(atom for atom in asking if bound.isdisjoint(atom.arguments))


def texts_of(atoms: Iterable[Atom], predicate: str) -> set[str]:
    """Texts that atoms mention as values of a property."""
    found = (term for atom in atoms if atom.predicate == predicate for term in atom.arguments)
    return {term.text for term in found if isinstance(term, Lit) and term.datatype == STRING}


#: The sign of each built-in that compares two values.
COMPARISONS: Mapping[str, str] = {
    SWRLB + "equal": "=",
    SWRLB + "notEqual": "!=",
    SWRLB + "lessThan": "<",
    SWRLB + "lessThanOrEqual": "<=",
    SWRLB + "greaterThan": ">",
    SWRLB + "greaterThanOrEqual": ">=",
}
#: The built-in of each sign.
COMPARISON_OF: Mapping[str, str] = {sign: name for name, sign in COMPARISONS.items()}
#: Built-ins that compare, so that every argument must be bound; the others compute their first one.
TESTERS = COMPARISONS.keys() | terms(
    SWRLB, "contains containsIgnoreCase endsWith matches startsWith stringEqualIgnoreCase"
)
#: Pellet's built-ins, with the least and the largest number of arguments.
BUILTINS: Mapping[str, tuple[int, int]] = dict.fromkeys(TESTERS, (2, 2)) | {
    SWRLB + name: counts
    for names, counts in (
        ("abs ceiling cos floor round sin tan unaryMinus unaryPlus booleanNot", (2, 2)),
        ("lowerCase normalizeSpace stringLength upperCase", (2, 2)),
        ("divide integerDivide mod pow subtract", (3, 3)),
        ("add multiply", (3, 99)),
        ("roundHalfToEven", (2, 3)),
        ("stringConcat", (2, 99)),
        ("substring", (3, 4)),
        ("resolveURI substringAfter substringBefore tokenize", (3, 3)),
        ("replace translate", (4, 4)),
        ("anyURI", (7, 7)),
        ("date", (4, 5)),
        ("dateTime", (7, 8)),
        ("time", (4, 5)),
        ("dayTimeDuration", (2, 5)),
        ("yearMonthDuration", (2, 3)),
    )
    for name in names.split()
}


#: What computes from its result, too, and only from variables.
_BOTH_WAYS = terms(SWRLB, "booleanNot date dateTime time")


def computed(atom: Atom, bound: Collection[str]) -> frozenset[str]:
    """Variables to which Pellet gives a value in a built-in, where others have one.

    It is the first argument, once all others have values. Dates and times also give all of their
    parts, and booleanNot its argument: but these are computed from variables only. (Found by giving
    Pellet each of its built-ins, with each argument left open.)
    """
    if not atom.computes or not atom.arguments:
        return frozenset()
    first, *others = atom.arguments
    if not isinstance(first, Variable):
        return frozenset()
    still_open = {*_variables_in(others)}.difference(bound)
    is_both_ways = atom.predicate in _BOTH_WAYS
    if first.name in bound:
        return frozenset(still_open if is_both_ways else ())
    if still_open or (is_both_ways and any(isinstance(term, Lit) for term in others)):
        return frozenset()
    return frozenset({first.name})


def mirrored(sign: str) -> str:
    """The sign of a comparison with its sides exchanged: > for <."""
    return sign.translate(str.maketrans("<>", "><"))


# Rules as text: for messages on one line, and for files so that they read back the same.

_WORD = re.compile(r"[^\W\d](?:[\w.-]*\w)?")
#: Literals without quotes, by the datatype that the parser gives them.
_BARE = {
    BOOLEAN: re.compile(r"true|false"),
    XSD + "integer": re.compile(r"[+-]?[0-9]+"),
    DECIMAL: re.compile(r"[+-]?(?:[0-9]+\.[0-9]*|\.[0-9]+)"),
    XSD + "double": re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE][+-]?[0-9]{1,4}"),
}
#: Gives the text of an IRI.
Naming = Callable[[str], str]


def full_name(iri: str) -> str:
    """Write an IRI with a known prefix, or in angle brackets: that reads back with any
    vocabulary.
    """
    for prefix, start in PREFIXES.items():
        if iri.startswith(start) and _WORD.fullmatch(iri[len(start) :]):
            return f"{prefix}:{iri[len(start) :]}"
    return f"<{iri}>"


def naming(shared: Callable[[str], bool]) -> Naming:
    """Write bare names, but full ones for IRIs whose last part alone is ambiguous or unknown.

    Args:
        shared: whether the bare name of an IRI means something else, or nothing.
    """

    def name(iri: str) -> str:
        bare = local_name(iri)
        if iri.startswith("_:") or ":" not in iri or (namespace(iri) == SWRLB and not shared(iri)):
            return bare
        return (
            bare
            if _WORD.fullmatch(bare) and bare not in ("true", "false") and not shared(iri)
            else full_name(iri)
        )

    return name


def write_rule(
    name: str, body: Sequence[Atom], head: Sequence[Atom], named: Naming, *, enabled: bool = True
) -> str:
    """Write a rule for a rules file, one atom a line where one line would be long."""
    word = name if _WORD.fullmatch(name) and name not in ("prefix", "disabled") else _quoted(name)
    start = f"{'' if enabled else 'disabled '}{word}:"

    def side(atoms: Iterable[Atom], between: str = " ^ ") -> str:
        return between.join(write_atom(atom, named) for atom in atoms)

    line = f"{start} {side(body)}{' ' if body else ''}-> {side(head)}"
    if len(line) <= 110:
        return line + "\n"
    between = "\n    ^ "
    return f"{start}\n    {side(body, between)}\n    -> {side(head, between)}\n"


def write_atom(atom: Atom, named: Naming = local_name) -> str:
    """Write one atom."""
    predicate = named(atom.predicate) if atom.predicate else "nothing"
    return f"{predicate}({', '.join(write_term(term, named) for term in atom.arguments)})"


def write_term(term: Term, named: Naming = local_name) -> str:
    """Write one argument of an atom."""
    if isinstance(term, Variable):
        return f"?{term.name}"
    if isinstance(term, Named):
        return named(term.iri)
    bare = _BARE.get(term.datatype)
    if bare is not None and bare.fullmatch(term.text):
        return term.text
    if term.datatype.startswith("@"):
        return _quoted(term.text) + term.datatype
    if term.datatype == STRING:
        return _quoted(term.text)
    return f"{_quoted(term.text)}^^{full_name(term.datatype)}"


def _quoted(text: str) -> str:
    return f'"{text.translate(ESCAPES)}"'
