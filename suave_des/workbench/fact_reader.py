"""Read facts that people write as atoms of rules."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from suave_des.errors import InputError, nearest, shown
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import RDF_TYPE, XSD, Lit, Triple, fact_of, local_name
from suave_des.knowledge.rules.parser import parse_rule
from suave_des.knowledge.rules.syntax import Atom, Named, RuleError, Term, Variable
from suave_des.knowledge.state import Fact

#: Begins the IRIs of individuals that exist in a test or a question only.
NEW_INDIVIDUAL: Final = "urn:suave-des:test#"


@dataclass
class FactReader:
    """Reads facts that are written as atoms of rules, such as fg_status(fg_spiral_high, IN_ERROR_NFR).

    Text needs no quotes. A name that the ontologies do not have becomes a new individual where it first occurs as a
    member of a class: Binding(b1).

    Attributes:
        new: IRIs of the new individuals, by name.
    """

    base: Ontology
    new: dict[str, str] = field(default_factory=dict)

    def declare(self, texts: Iterable[str]) -> None:
        """Note the new individuals that facts introduce."""
        for text in texts:
            atom = _parsed(text)
            if len(atom.arguments) == 1 and isinstance(atom.arguments[0], Named):
                name = atom.arguments[0].iri
                if ":" not in name and not self._individuals(name):
                    self.new[name] = NEW_INDIVIDUAL + name

    def triple(self, text: str) -> Triple:
        """Read one fact.

        Raises:
            InputError: it is not a fact, or a name in it is unknown.
        """
        atom = _parsed(text)
        if not 1 <= len(atom.arguments) <= 2:
            raise InputError(f"{shown(text)} is not a fact", remedy="write Class(individual) or property(one, other)")
        if any(isinstance(term, Variable) for term in atom.arguments):
            remedy = "name the individual, as in fg_status(fg_spiral_high, IN_ERROR_NFR)"
            raise InputError(f"{shown(text)} has a variable, and so is not a fact", remedy=remedy)
        kinds = ("class",) if len(atom.arguments) == 1 else ("object property", "data property")
        predicate, kind = self._predicate(atom.predicate, kinds)
        subject = self._individual(atom.arguments[0])
        if kind == "class":
            return subject, RDF_TYPE, predicate
        value = atom.arguments[1]
        if kind == "object property":
            return subject, predicate, self._individual(value)
        return subject, predicate, self._value(predicate, value)

    def fact(self, text: str) -> Fact:
        """Read one fact, in the form in which inferences have it.

        Raises:
            InputError: it is not a fact, a name in it is unknown, or it can never follow, for its value.
        """
        triple = self.triple(text)
        _, predicate, value = triple
        values = self.base.vocabulary.enumerations.get(predicate)
        if values is not None and isinstance(value, Lit) and value.text not in values:
            remedy = nearest(value.text, values) or f"one of {', '.join(sorted(values))}"
            raise InputError(f"{shown(value.text)} is not among the values of {local_name(predicate)}", remedy=remedy)
        ranges = self.base.vocabulary.ranges.get(predicate)
        if ranges is not None and isinstance(value, Lit) and value.datatype not in ranges:
            wanted = " or ".join(sorted(map(local_name, ranges)))
            problem = f"{shown(value.text)} is not a value of {local_name(predicate)}, whose range is {wanted}"
            raise InputError(problem, remedy="write true or false" if ranges == {XSD + "boolean"} else None)
        return fact_of(triple, self.base.names)

    def _predicate(self, name: str, kinds: tuple[str, ...]) -> tuple[str, str]:
        vocabulary = self.base.vocabulary
        used = {iri: is_data for rule in self.base.rules for iri, is_data in rule.properties}
        for iri in (name,) if ":" in name else vocabulary.candidates(name):
            declared = vocabulary.kinds.get(iri, frozenset())
            kind = next((each for each in kinds if each in declared), None)
            if kind is None and iri in used and kinds != ("class",):
                kind = "data property" if used[iri] else "object property"
            if kind is not None:
                return iri, kind
        what = "class" if kinds == ("class",) else "property"
        raise InputError(f"there is no {what} {shown(local_name(name))}", remedy=vocabulary.guess(name, kinds))

    def _individuals(self, name: str) -> tuple[str, ...]:
        vocabulary = self.base.vocabulary
        return tuple(iri for iri in vocabulary.candidates(name) if "individual" in vocabulary.kinds.get(iri, ()))

    def _individual(self, term: Term) -> str:
        if not isinstance(term, Named):
            raise InputError(f"{shown(term[0])} is a value, but an individual is needed")
        name = term.iri
        if ":" in name:
            return name
        found = self._individuals(name)
        if found:
            return found[0]
        if name in self.new:
            return self.new[name]
        known = [each for each in self.base.vocabulary.by_name if self._individuals(each)]
        near = nearest(name, (*known, *self.new))
        remedy = f"{near.removesuffix('?')}? or introduce it" if near else "introduce it"
        raise InputError(f"there is no individual {shown(name)}", remedy=f"{remedy} under facts, as Class({name})")

    def _value(self, predicate: str, term: Term) -> Lit:
        if isinstance(term, Named):
            return Lit(term.iri, XSD + "string")
        assert isinstance(term, Lit)
        ranges = self.base.vocabulary.ranges.get(predicate, frozenset())
        if term.datatype == XSD + "integer" and XSD + "decimal" in ranges:
            return Lit(term.text, XSD + "decimal")
        return term


def _parsed(text: str) -> Atom:
    try:
        rule = parse_rule(f"fact: -> {text}")
    except RuleError as error:
        if text.count("(") > text.count(")"):
            remedy = "in a YAML list in brackets a fact needs quotes, because of its comma"
            raise InputError(f"{shown(text)} is an incomplete fact", remedy=remedy) from None
        remedy = error.remedy or "write it as an atom of a rule: fg_status(fg_spiral_high, IN_ERROR_NFR)"
        raise InputError(f"{shown(text)} is not a fact: {error.problem}", remedy=remedy) from None
    if len(rule.head) != 1:
        raise InputError(f"{shown(text)} has {len(rule.head)} facts", remedy="write one")
    return rule.head[0]
