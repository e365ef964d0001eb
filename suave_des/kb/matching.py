"""Match the atoms of a rule's body with facts.

Atoms about facts are matched with what follows in a state. What a built-in says of given values, or computes from
them, is left to Pellet; the nearest match asks for it with a rule that has this one atom.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Final

from rdflib import BNode

from suave_des.kb.situations import PROBE
from suave_des.knowledge.content import Content
from suave_des.knowledge.pellet.in_process import entailed
from suave_des.knowledge.rdf import OWL, RDF_TYPE, XSD, Lit, Names, Triple, canonical, value_of
from suave_des.knowledge.rules import Atom, Named, Rule, Term, Variable
from suave_des.knowledge.rules.files import with_triples
from suave_des.knowledge.state import Value

#: What the variables of a rule stand for: IRIs and literals by name.
Binding = Mapping[str, str | Lit]
#: Kinds of atoms that are about facts; the others compare or compute.
FACT_KINDS: Final = ("class", "object", "data")
#: Ways to bind variables that are looked at for each number of atoms that fail.
MOST_WAYS: Final = 20_000


def bound(term: Term, binding: Binding) -> str | Lit | None:
    """What a term stands for; None for a variable without a value."""
    if isinstance(term, Variable):
        return binding.get(term.name)
    return term.iri if isinstance(term, Named) else term


def instance(atom: Atom, binding: Binding) -> Atom:
    """An atom with the values of those variables that have one."""

    def value(term: Term) -> Term:
        found = bound(term, binding)
        return term if found is None else found if isinstance(found, Lit) else Named(found)

    return replace(atom, arguments=tuple(map(value, atom.arguments)), places=())


def unified(terms: Sequence[Term], values: Iterable[str | Lit | None], binding: Binding) -> Binding | None:
    """Extend a binding so that terms have given values, None for any; None if they cannot."""
    found = dict(binding)
    for term, value in zip(terms, values, strict=False):
        if value is None:
            continue
        wanted = canonical(value)
        if isinstance(term, Variable):
            if found.setdefault(term.name, wanted) != wanted:
                return None
        elif canonical(term.iri if isinstance(term, Named) else term) != wanted:
            return None
    return found


def shown_bindings(binding: Binding, names: Names) -> tuple[tuple[str, Value], ...]:
    """Return variable bindings as people write them, by the names of the variables in their order."""
    return tuple((name, value_of(binding[name], names)) for name in sorted(binding))


def matched(atom: Atom, triple: Triple, binding: Binding) -> Binding | None:
    """Extend a binding so that an atom says a triple; None if it cannot."""
    subject, predicate, value = triple
    if atom.kind == "class":
        fits = predicate == RDF_TYPE and value == atom.predicate
        return unified(atom.arguments[:1], (subject,), binding) if fits else None
    fits = atom.kind in FACT_KINDS and predicate == atom.predicate
    return unified(atom.arguments, (subject, value), binding) if fits else None


def stated(atom: Atom, binding: Binding) -> Triple | None:
    """The triple that an atom says with the values of its variables; None where one has none, or for another atom."""
    terms = [bound(term, binding) for term in atom.arguments]
    if atom.kind not in FACT_KINDS or None in terms:
        return None
    subject, value = str(terms[0]), terms[-1] or ""
    return (subject, RDF_TYPE, atom.predicate) if atom.kind == "class" else (subject, atom.predicate, value)


class Facts:
    """What follows in a state, to be looked up by property and subject."""

    def __init__(self, known: Iterable[Triple]) -> None:
        self.all = tuple((subject, predicate, canonical(value)) for subject, predicate, value in known)
        self._by_predicate: dict[str, list[Triple]] = {}
        self._by_subject: dict[tuple[str, str], list[Triple]] = {}
        for triple in self.all:
            self._by_predicate.setdefault(_key(triple), []).append(triple)
            self._by_subject.setdefault((_key(triple), triple[0]), []).append(triple)

    def __contains__(self, triple: Triple) -> bool:
        """Whether a triple, in canonical form, follows."""
        return triple in self._by_subject.get((_key(triple), triple[0]), ())

    def matches(self, atom: Atom, binding: Binding) -> Iterator[Binding]:
        """Extend a binding in each way in which an atom says a fact."""
        subject = bound(atom.arguments[0], binding)
        if isinstance(subject, str):
            candidates = self._by_subject.get((atom.predicate, subject), ())
        else:
            candidates = self._by_predicate.get(atom.predicate, ())
        found = (matched(atom, triple, binding) for triple in candidates)
        return (each for each in found if each is not None)

    def values(self, subject: str | None, predicate: str) -> list[str | Lit]:
        """Values of a property of an individual; None: of all of them."""
        every = self._by_predicate.get(predicate, ())
        found = every if subject is None else self._by_subject.get((predicate, subject), ())
        return list(dict.fromkeys(triple[2] for triple in found))


def _key(triple: Triple) -> str:
    """The property of a triple, or the class of which it says membership."""
    return str(triple[2]) if triple[1] == RDF_TYPE else triple[1]


@dataclass
class NearestFinder:
    """Finds the nearest match of one rule in one state.

    Attributes:
        facts: all that follows in the state.
        start: what variables must stand for.
    """

    rule: Rule
    facts: Facts
    start: Binding = field(default_factory=dict)
    _ways: int = 0

    def matches(self) -> list[Binding]:
        """All bindings with which the whole body holds, in a fixed order."""
        found = self._ways_to_match(testable_order(self.rule.body), self.start, (), 0)
        return sorted((binding for binding, _ in found), key=str)

    def find(self) -> tuple[Binding, tuple[int, ...]]:
        """Find the binding with the fewest atoms that fail, and their numbers.

        Of several, one where a comparison fails comes before one where a value differs, and that before one where
        nothing is known. Atoms of which there is no fact at all fail in any case.
        """
        body = tuple(map(_canonical_atom, self.rule.body))
        hopeless = frozenset(
            number
            for number, atom in enumerate(body)
            if atom.kind in FACT_KINDS and not any(True for _ in self.facts.matches(atom, self.start))
        )
        order = [number for number in testable_order(body) if number not in hopeless]
        for allowed in range(len(order) + 1):
            self._ways = 0
            ways = list(self._ways_to_match(order, self.start, (), allowed))
            if ways:
                binding, failing = min(ways, key=self._rank)
                return binding, tuple(sorted({*failing, *hopeless}))
        return self.start, tuple(range(len(body)))

    def _ways_to_match(
        self, order: Sequence[int], binding: Binding, failing: tuple[int, ...], allowed: int
    ) -> Iterator[tuple[Binding, tuple[int, ...]]]:
        self._ways += 1
        if self._ways > MOST_WAYS:
            return
        if not order:
            yield binding, failing
            return
        number, rest = order[0], order[1:]
        atom = _canonical_atom(self.rule.body[number])
        if atom.kind in FACT_KINDS:
            for found in self.facts.matches(atom, binding):
                yield from self._ways_to_match(rest, found, failing, allowed)
            is_failing = True  # the fact that is missing may be the only thing wrong, with another binding
        else:
            results = self.tested(atom, binding)
            for found in results or ():
                yield from self._ways_to_match(rest, found, failing, allowed)
            is_failing = results == []
            if results is None:  # a variable has no value, as the atom that gives it one fails
                yield from self._ways_to_match(rest, binding, failing, allowed)
        if is_failing and len(failing) < allowed:
            yield from self._ways_to_match(rest, binding, (*failing, number), allowed)

    def tested(self, atom: Atom, binding: Binding) -> list[Binding] | None:
        """What a built-in, a datatype, sameAs or differentFrom makes of a binding.

        Returns:
            the bindings with which it holds, with what it computes; None if an argument has no value.
        """
        asked = instance(atom, binding)
        unbound = [number for number, term in enumerate(asked.arguments) if isinstance(term, Variable)]
        computes = atom.computes and unbound == [0]
        if unbound and not computes:
            return None
        if atom.kind in ("same", "different"):
            is_same = asked.arguments[0] == asked.arguments[1]
            return [binding] if is_same == (atom.kind == "same") else []
        values = _ask_pellet(asked, computes=computes)
        if computes:
            name = atom.arguments[0].name  # type: ignore[union-attr]
            return [{**binding, name: canonical(value)} for value in values]
        return [binding] if values else []

    def _rank(self, way: tuple[Binding, tuple[int, ...]]) -> tuple[object, ...]:
        """Order ways to match, the nearest first."""
        binding, failing = way
        return tuple(self._distance(number, binding) for number in failing), str(sorted(binding.items()))

    def _distance(self, number: int, binding: Binding) -> tuple[int, int]:
        """How far an atom is from holding: a comparison, another value, nothing."""
        atom = self.rule.body[number]
        if atom.kind not in FACT_KINDS:
            return 0, -number
        if atom.kind == "class":
            return 3, -number
        subject = bound(atom.arguments[0], binding)
        if isinstance(subject, str) and self.facts.values(subject, atom.predicate):
            return 1, -number
        return 2, -number


def _canonical_atom(atom: Atom) -> Atom:
    return replace(atom, arguments=tuple(canonical(each) if isinstance(each, Lit) else each for each in atom.arguments))


def testable_order(body: Sequence[Atom]) -> list[int]:
    """Order atoms as the rule does, but those that test or compute after all that bind their variables."""
    waiting = list(range(len(body)))
    known: set[str] = set()
    order: list[int] = []
    while waiting:
        ready = (number for number in waiting if body[number].kind in FACT_KINDS or _inputs(body[number]) <= known)
        number = next(ready, waiting[0])
        waiting.remove(number)
        order.append(number)
        known |= set(body[number].variables())
    return order


def _inputs(atom: Atom) -> set[str]:
    """Variables that must have values before an atom can be tested, or its first argument computed."""
    return {term.name for term in atom.arguments[int(atom.computes) :] if isinstance(term, Variable)}


@lru_cache(maxsize=4096)
def _ask_pellet(atom: Atom, *, computes: bool) -> tuple[Lit, ...]:
    """What Pellet computes for the first argument, or one value if the atom holds."""
    result = atom.arguments[0] if computes else Lit("true", XSD + "boolean")
    head = Atom("data", f"{PROBE}#value", (Named(f"{PROBE}#it"), result))
    rule = with_triples(Rule("probe", "", Path(), True, BNode(), (), (atom,), (head,)))
    known = ((f"{PROBE}#it", RDF_TYPE, OWL + "Thing"),)
    found = entailed(Content(known, (), (rule,)).n_triples(), [head])
    return tuple(sorted(value for _, _, value in found if isinstance(value, Lit)))
