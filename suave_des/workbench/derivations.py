"""Derivations: how a fact follows, as a tree of rules with their bindings; and facts that match the atoms of a rule."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from suave_des.knowledge.rdf import Lit, Triple, canonical
from suave_des.knowledge.rules.syntax import Atom, Named, Term, Variable
from suave_des.knowledge.state import Fact, Value
from suave_des.knowledge.vocabulary import RDF_TYPE

#: What the variables of a rule stand for: IRIs and literals by name.
Binding = Mapping[str, str | Lit]
#: Kinds of atoms that are about facts; the others compare or compute.
FACT_KINDS: Final = ("class", "object", "data")


@dataclass(frozen=True)
class Derivation:
    """How a fact follows.

    Attributes:
        fact: what follows.
        source: "state" or "ontology" where it is asserted, "rule", or "axioms" where it follows from the schema.
        rule: the rule's name.
        bindings: value of each of the rule's variables, by variable.
        axioms: the axioms of the schema that were used.
        premises: the facts of the rule's body, instantiated.
    """

    fact: Fact
    source: str
    rule: str | None = None
    bindings: tuple[tuple[str, Value], ...] = ()
    axioms: tuple[str, ...] = ()
    premises: tuple[Derivation, ...] = ()

    def __str__(self) -> str:
        """As a tree of lines."""
        return "\n".join(self.lines())

    def lines(self, indent: str = "") -> Iterator[str]:
        """The fact and how it follows, and below it, indented, the facts that it follows from."""
        bindings = ", ".join(f"?{name} = {value}" for name, value in self.bindings)
        how = {
            "rule": f"by rule {self.rule}" + (f" with {bindings}" if bindings else ""),
            "axioms": f"by the schema: {'; '.join(self.axioms)}" if self.axioms else "by the schema",
            "state": "given in the state",
            "ontology": "asserted in the ontology",
        }[self.source]
        yield f"{indent}{self.fact}  [{how}]"
        for premise in self.premises:
            yield from premise.lines(indent + "  ")

    def leaves(self) -> Iterator[Derivation]:
        """The asserted facts that it follows from."""
        if not self.premises:
            yield self
        for premise in self.premises:
            yield from premise.leaves()

    def grounds(self) -> frozenset[tuple[str, str]]:
        """(subject, property) of all facts that it follows from, without itself."""
        direct = frozenset((premise.fact.subject, premise.fact.property) for premise in self.premises)
        return direct.union(*(premise.grounds() for premise in self.premises))

    def rules(self) -> frozenset[str]:
        """Names of all rules in it."""
        own = frozenset({self.rule} if self.rule is not None else ())
        return own.union(*(premise.rules() for premise in self.premises))


@dataclass(frozen=True)
class Clash:
    """A contradiction: an individual would have two values of a functional property.

    Attributes:
        subject, property: the individual and the property.
        sides: how each of the values follows.
    """

    subject: str
    property: str
    sides: tuple[Derivation, ...]


def matched(atom: Atom, triple: Triple, binding: Binding) -> Binding | None:
    """Extend a binding so that an atom says a triple; None if it cannot."""
    subject, predicate, value = triple
    if atom.kind == "class":
        fits = predicate == RDF_TYPE and value == atom.predicate
        return _bound([(atom.arguments[0], subject)], binding) if fits else None
    fits = atom.kind in FACT_KINDS and predicate == atom.predicate
    return _bound([(atom.arguments[0], subject), (atom.arguments[-1], value)], binding) if fits else None


def _bound(pairs: Iterable[tuple[Term, str | Lit]], binding: Binding) -> Binding | None:
    found = dict(binding)
    for term, value in pairs:
        plain = canonical(value) if isinstance(value, Lit) else value
        if isinstance(term, Variable):
            if found.setdefault(term.name, plain) != plain:
                return None
        elif (term.iri if isinstance(term, Named) else canonical(term)) != plain:
            return None
    return found


def partial_matches(
    atoms: Sequence[Atom],
    binding: Binding,
    known: Iterable[Triple],
    holds: Callable[[Atom, Binding], bool] = lambda _atom, _binding: True,
    body: tuple[Triple, ...] = (),
    depth: int = 0,
) -> Iterator[tuple[int, Binding, tuple[Triple, ...]]]:
    """Match atoms with facts in their order, in every way.

    Args:
        atoms: of a rule's body.
        binding: what variables stand for already.
        known: the facts; more than one pass is made over them.
        holds: decides on atoms that compare or compute; left out, they are left to Pellet.
        body: the facts matched already.
        depth: the number of atoms matched already.

    Yields:
        where each way ends: the number of atoms matched, the binding, and the facts.
    """
    if depth == len(atoms):
        yield depth, binding, body
        return
    atom, is_dead_end = atoms[depth], True
    if atom.kind not in FACT_KINDS:
        if holds(atom, binding):
            is_dead_end = False
            yield from partial_matches(atoms, binding, known, holds, body, depth + 1)
    else:
        for triple in known:
            bound = matched(atom, triple, binding)
            if bound is not None:
                is_dead_end = False
                facts = body if triple in body else (*body, triple)
                yield from partial_matches(atoms, bound, known, holds, facts, depth + 1)
    if is_dead_end:
        yield depth, binding, body
