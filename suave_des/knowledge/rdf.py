"""RDF: IRIs of the vocabularies, terms and triples as reasoners are given them, and the facts that
they state.

The vocabularies are TOMASys, its terms for robots (mros), SUAVE's model, OWL and SWRL. Source: the
exemplar's three ontologies (repository kas-lab/suave), whose names and namespaces are kept so that
either side's files work with the other's.
"""

from __future__ import annotations

import logging
import math
import re
import warnings
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from decimal import Decimal, InvalidOperation
from typing import NamedTuple, TypeGuard, TypeVar

from suave_des.knowledge.state import Fact, Value, plain_text

TOMASYS = "http://metacontrol.org/tomasys#"
MROS = "http://ros/mros#"
SUAVE = "http://www.metacontrol.org/suave#"

RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
RDFS = "http://www.w3.org/2000/01/rdf-schema#"
OWL = "http://www.w3.org/2002/07/owl#"
XSD = "http://www.w3.org/2001/XMLSchema#"
SWRL = "http://www.w3.org/2003/11/swrl#"
SWRLB = "http://www.w3.org/2003/11/swrlb#"
SWRLA = "http://swrl.stanford.edu/ontologies/3.3/swrla.owl#"

#: Namespaces of OWL, RDF and SWRL: their terms describe no fact of the system.
LANGUAGE_NAMESPACES = (RDF, RDFS, OWL, XSD, SWRL, SWRLB, SWRLA)

#: Prefixes that need not be declared.
PREFIXES: Mapping[str, str] = {
    "mros": MROS,
    "owl": OWL,
    "rdf": RDF,
    "rdfs": RDFS,
    "suave": SUAVE,
    "swrl": SWRL,
    "swrla": SWRLA,
    "swrlb": SWRLB,
    "tomasys": TOMASYS,
    "xsd": XSD,
}

STRING = XSD + "string"
BOOLEAN = XSD + "boolean"
DECIMAL = XSD + "decimal"
RDF_TYPE = RDF + "type"
FIRST = RDF + "first"
REST = RDF + "rest"
SUBCLASS = RDFS + "subClassOf"
SUBPROPERTY = RDFS + "subPropertyOf"
FUNCTIONAL = OWL + "FunctionalProperty"
HAS_VALUE = TOMASYS + "hasValue"
HAS_QA_VALUE = TOMASYS + "hasQAvalue"
IS_QA_TYPE = TOMASYS + "isQAtype"
QA_OPERATOR = TOMASYS + "qa_comparison_operator"
C_STATUS = TOMASYS + "c_status"
O_STATUS = TOMASYS + "o_status"


def terms(namespace: str, names: str) -> frozenset[str]:
    """Return the IRIs of names in a namespace, which are given with spaces between them."""
    return frozenset(namespace + name for name in names.split())


#: What the planner and the loop read, whether or not a rule can conclude it.
DECISION_PROPERTIES = terms(
    TOMASYS,
    "fd_error_log fd_realisability fg_status hasNFR hasQAestimation hasQAvalue hasValue isQAtype o_always_improve "
    "o_status o_updatable qa_comparison_operator solvesF solvesO typeF typeFD",
)

#: The quality attribute that the planner maximises.
PERFORMANCE = MROS + "performance"


def local_name(iri: str) -> str:
    """Last part of an IRI: after '#', or after the last '/' or ':' where there is none."""
    if is_node(iri):
        return iri[2:]
    for separator in ("#", "/", ":"):
        head, found, tail = iri.rpartition(separator)
        if found and tail:
            return tail
        if found:
            iri = head
    return iri


def namespace(iri: str) -> str:
    """The part of an IRI before the local name, with the separator."""
    return iri[: len(iri) - len(local_name(iri))]


class Lit(NamedTuple):
    """A literal: its text, and the IRI of its datatype or, for text in a language, "@" and the
    language.
    """

    text: str
    datatype: str


#: Subject IRI, predicate IRI, and an IRI or a literal; a blank node stands as "_:" with its name.
Triple = tuple[str, str, str | Lit]

_T = TypeVar("_T")
_Term = TypeVar("_Term", Lit, str | Lit)
#: Datatypes of whole numbers.
WHOLE = terms(
    XSD,
    "integer int long short byte nonNegativeInteger positiveInteger nonPositiveInteger negativeInteger "
    "unsignedInt unsignedLong unsignedShort unsignedByte",
)
#: Datatypes of exact numbers.
EXACT = WHOLE | {DECIMAL}
#: Datatypes of inexact numbers.
BINARY = terms(XSD, "float double")
#: Datatypes of numbers.
NUMERIC = EXACT | BINARY
_DECIMAL_NUMBER = re.compile(r"[+-]?(?=\.?[0-9])[0-9]*\.?[0-9]*")
_WHOLE_NUMBER = re.compile(r"[+-]?[0-9]{1,400}")
_FLOAT = re.compile(r"[+-]?(?=\.?[0-9])[0-9]*\.?[0-9]*(?:[eE][+-]?[0-9]+)?")
#: How values of a datatype are written; rdflib, which takes more for them, knows the other
# datatypes of XML Schema.
_LEXICAL = (
    dict.fromkeys(WHOLE, re.compile(r"[+-]?[0-9]+"))
    | dict.fromkeys(BINARY, re.compile(rf"{_FLOAT.pattern}|[+-]?INF|NaN"))
    | {BOOLEAN: re.compile(r"true|false|0|1"), DECIMAL: _DECIMAL_NUMBER}
)
#: Escapes in texts between quotes, of N-Triples and of rules.
ESCAPES = str.maketrans({"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"})


def is_node(term: str | Lit) -> bool:
    """Whether a term is a blank node, which has no name."""
    return isinstance(term, str) and term.startswith("_:")


def is_thing(term: str | Lit) -> TypeGuard[str]:
    """Whether a term is what ontologies describe: no literal, and no term of OWL, RDF or SWRL."""
    return isinstance(term, str) and not term.startswith(LANGUAGE_NAMESPACES)


def subjects(triples: Iterable[Triple], predicate: str, value: str | Lit | None = None) -> set[str]:
    """Return what has a value of a property; None: any value."""
    return {s for s, p, o in triples if p == predicate and value in (None, o)}


def members(triples: Iterable[Triple], classes: Collection[str | Lit]) -> set[str]:
    """Return what is said to be of one of some classes."""
    return {s for s, p, o in triples if p == RDF_TYPE and o in classes}


def links(triples: Iterable[Triple], *predicates: str | None) -> Iterator[tuple[str, str]]:
    """Yield each subject of one of some properties with its value, if that is no literal."""
    return ((s, o) for s, p, o in triples if p in predicates and isinstance(o, str))


def both_ways(pairs: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return pairs, and each of them turned round."""
    known = list(pairs)
    return [*known, *((other, one) for one, other in known)]


def values(triples: Iterable[Triple], predicate: str) -> set[str]:
    """Return the values of a property that are no literals."""
    return {value for _, value in links(triples, predicate)}


def numbered_nodes(
    triples: Iterable[Triple], start: str, names: Mapping[str | Lit, str] = {}
) -> Iterator[Triple]:
    """Rename blank nodes to a text with their number in order; some things have names already."""
    found = dict(names)
    for subject, predicate, value in triples:
        for term in filter(is_node, (subject, value)):
            found.setdefault(term, f"{start}{len(found)}")
        yield found.get(subject, subject), predicate, found.get(value, value)


@contextmanager
def without_log() -> Iterator[None]:
    """Keep rdflib's warnings about odd terms off the terminal."""
    logger = logging.getLogger("rdflib.term")
    before = logger.disabled
    logger.disabled = True
    try:
        with warnings.catch_warnings(action="ignore"):
            yield
    finally:
        logger.disabled = before


def is_well_formed(value: Lit) -> bool:
    """Whether a literal's text is a value of its datatype; of unknown datatypes every text is."""
    form = _LEXICAL.get(value.datatype)
    if form is not None:
        return form.fullmatch(value.text.strip()) is not None
    if not value.datatype.startswith(XSD):
        return True
    from rdflib import Literal, URIRef  # which take a while, and which missions do without

    with without_log():
        return not Literal(value.text, datatype=URIRef(value.datatype)).ill_typed


def canonical(value: _Term) -> _Term:
    """Return the same form for all numbers that Pellet treats as equal; other values are unchanged.

    A rule's 2.00 is meant to match a measured 2.0. Whole numbers of all datatypes are compared by
    value, and never match a decimal; neither of them matches a double.
    """
    if isinstance(value, str):
        return value
    text = value.text.strip()
    if value.datatype == DECIMAL and _DECIMAL_NUMBER.fullmatch(text):
        return Lit(plain_text(Decimal(text) or Decimal(0)), value.datatype)
    if value.datatype in EXACT and _WHOLE_NUMBER.fullmatch(text):
        return Lit(str(int(text)), XSD + "integer")
    if value.datatype in BINARY and _FLOAT.fullmatch(text):
        number = float(text)
        return Lit(str(number), value.datatype) if math.isfinite(number) else value
    return value


def for_pellet(value: Lit) -> Lit:
    """Return a literal as Pellet receives it: each decimal number in one form, and always with a
    decimal place.

    Pellet compares the texts of decimals, and takes one without a decimal place for an integer.
    Stock owlready2 gives it these forms, too.
    """
    if value.datatype != DECIMAL or not _DECIMAL_NUMBER.fullmatch(value.text.strip()):
        return value
    text = canonical(value).text
    return Lit(text if "." in text else f"{text}.0", value.datatype)


def _written(value: str | Lit) -> str:
    if isinstance(value, str):
        return value if is_node(value) else f"<{value}>"
    value = for_pellet(value)
    text = "".join(
        char if char.isascii() else f"\\U{ord(char):08X}" for char in value.text.translate(ESCAPES)
    )
    if value.datatype.startswith("@"):
        return f'"{text}"{value.datatype}'
    return f'"{text}"^^<{value.datatype}>'


def n_triple(triple: Triple) -> str:
    """Write one line of N-Triples."""
    return f"{_written(triple[0])} <{triple[1]}> {_written(triple[2])} .\n"


class Names:
    """Short names of IRIs: the last part, or the whole IRI where two would share it."""

    def __init__(self, triples: Iterable[Triple]) -> None:
        things = {
            term
            for subject, _, value in triples
            for term in (subject, value)
            if value != SWRL + "Variable" and is_thing(term)
        }
        shared = Counter(map(local_name, things))
        self._long = {
            iri
            for iri in things
            if shared[local_name(iri)] > 1 and not iri.startswith((TOMASYS, MROS))
        }

    def short(self, iri: str) -> str:
        """Return the name of an IRI in facts."""
        return iri if iri in self._long else local_name(iri)


def reached(start: Iterable[_T], steps: Iterable[tuple[_T, _T]]) -> set[_T]:
    """Find what steps, from one thing to another, lead to from a start, which is among it."""
    found = set(start)
    pairs = list(steps)
    while more := {other for one, other in pairs if one in found} - found:
        found |= more
    return found


def value_of(value: str | Lit, names: Names) -> Value:
    """Convert the object of a triple: to a short name, a number, a truth value or text."""
    if isinstance(value, str):
        return names.short(value)
    if value.datatype == BOOLEAN:
        return value.text.strip() in ("true", "1")
    with suppress(InvalidOperation):
        # NaN never equals NaN
        if value.datatype in NUMERIC and not (number := Decimal(value.text.strip())).is_nan():
            return number
    return value.text


def is_fact(triple: Triple) -> bool:
    """Whether a triple describes an individual, and not the terms of OWL, RDF or SWRL."""
    return is_thing(triple[2] if triple[1] == RDF_TYPE else triple[1])


def memberships(triples: Iterable[Triple]) -> Iterator[tuple[str, str]]:
    """(individual, class) of each triple that says membership; the classes of OWL, RDF and SWRL do
    not count.
    """
    return ((s, str(o)) for s, p, o in triples if p == RDF_TYPE and is_thing(o))


def fact_of(triple: Triple, names: Names) -> Fact:
    """Convert a triple that describes an individual."""
    subject, predicate, value = triple
    name = "type" if predicate == RDF_TYPE else names.short(predicate)
    return Fact(names.short(subject), name, value_of(value, names))


def facts_of(triples: Iterable[Triple], names: Names) -> Iterator[Fact]:
    """Convert the triples that describe individuals."""
    return (fact_of(triple, names) for triple in triples if is_fact(triple))
