"""Why a fact does not follow: the rules that could conclude it, and the first atom of each that does not hold."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from operator import eq, ge, gt, le, lt, ne
from types import MappingProxyType
from typing import Final

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import Lit, Triple, value_of
from suave_des.knowledge.rules.syntax import Atom, Named, Rule, Term, Variable
from suave_des.knowledge.state import Value
from suave_des.knowledge.vocabulary import SWRLB
from suave_des.workbench.matching import Binding, matched
from suave_des.workbench.reachable import atom_text

_COMPARE: Final[Mapping[str, Callable[[Decimal, Decimal], bool]]] = MappingProxyType(
    {
        SWRLB + "equal": eq,
        SWRLB + "notEqual": ne,
        SWRLB + "lessThan": lt,
        SWRLB + "lessThanOrEqual": le,
        SWRLB + "greaterThan": gt,
        SWRLB + "greaterThanOrEqual": ge,
    }
)
#: Ways to match a rule's body that are looked at.
MOST_WAYS: Final = 20_000
_FACTS: Final = ("class", "object", "data")


@dataclass(frozen=True)
class NearRule:
    """A rule that could conclude a fact, and does not.

    Attributes:
        rule: its name.
        fails: the first atom of its body that does not hold, as the rule writes it; of all ways to match those before
            it, with the one that comes furthest.
        bindings: what the variables stand for then.
        missing: atoms of the body from there on.
    """

    rule: str
    fails: str
    bindings: tuple[tuple[str, Value], ...]
    missing: int

    def __str__(self) -> str:
        """In words."""
        bound = ", ".join(f"?{name} = {value}" for name, value in self.bindings)
        return f"rule {self.rule}: {self.fails} does not hold{f' with {bound}' if bound else ''}"


def near_rules(base: Ontology, name: str, subject: str, wanted: str, known: Sequence[Triple]) -> tuple[NearRule, ...]:
    """Rules whose head could say a fact that does not follow, those that lack least first.

    Args:
        base: the ontologies.
        name: of the property, or "type".
        subject: IRI of the individual.
        wanted: the value, as text.
        known: all that follows.
    """
    found: list[NearRule] = []
    for rule in base.content.enabled_rules:
        for atom in rule.head:
            start = _start(base, atom, name, subject, wanted)
            if start is not None:
                near = _furthest(base, rule, start, known)
                if near is not None:
                    found.append(near)
    return tuple(sorted(found, key=lambda each: (each.missing, each.rule)))


def _start(base: Ontology, atom: Atom, name: str, subject: str, wanted: str) -> dict[str, str | Lit] | None:
    """What a head's variables must be for it to say the fact; None if it cannot. One for the value is left free."""
    says = "type" if atom.kind == "class" else base.names.short(atom.predicate)
    if atom.kind not in _FACTS or says != name:
        return None
    if atom.kind == "class" and base.names.short(atom.predicate) != wanted:
        return None
    last = atom.arguments[-1]
    if atom.kind != "class" and not isinstance(last, Variable) and _words(base, last) != wanted:
        return None
    first = atom.arguments[0]
    if isinstance(first, Variable):
        return {first.name: subject}
    return {} if first == Named(subject) else None


def _words(base: Ontology, term: Term) -> str:
    if isinstance(term, Lit):
        value = value_of(term, base.names)
        return str(value).lower() if isinstance(value, bool) else str(value)
    return base.names.short(term.iri) if isinstance(term, Named) else ""


def _furthest(base: Ontology, rule: Rule, start: Binding, known: Sequence[Triple]) -> NearRule | None:
    """The way to match a rule's body that comes furthest; None if all holds: the rule concludes something else."""
    best, furthest = start, -1
    for looked_at, (depth, binding) in enumerate(_ways(rule.body, 0, start, known)):
        if depth == len(rule.body):
            return None
        if depth > furthest:
            best, furthest = binding, depth
        if looked_at == MOST_WAYS:
            break
    bound = tuple((name, value_of(best[name], base.names)) for name in sorted(best))
    return NearRule(rule.name, atom_text(rule.body[furthest]), bound, len(rule.body) - furthest)


def _ways(
    atoms: Sequence[Atom], depth: int, binding: Binding, known: Sequence[Triple]
) -> Iterator[tuple[int, Binding]]:
    """Where each way to match the atoms in their order ends, with its bindings."""
    if depth == len(atoms):
        yield depth, binding
        return
    atom = atoms[depth]
    if atom.kind not in _FACTS:
        if _holds(atom, binding):
            yield from _ways(atoms, depth + 1, binding, known)
        else:
            yield depth, binding
        return
    matching = [bound for triple in known if (bound := matched(atom, triple, binding)) is not None]
    for bound in matching:
        yield from _ways(atoms, depth + 1, bound, known)
    if not matching:
        yield depth, binding


def _holds(atom: Atom, binding: Binding) -> bool:
    """Whether a comparison of numbers holds; all else counts as if it did."""
    compare = _COMPARE.get(atom.predicate) if atom.kind == "builtin" else None
    values = [binding.get(term.name) if isinstance(term, Variable) else term for term in atom.arguments]
    if compare is None or len(values) != 2:
        return True
    one, other = (_number(value) for value in values)
    return True if one is None or other is None else compare(one, other)


def _number(term: object) -> Decimal | None:
    try:
        return Decimal(term.text) if isinstance(term, Lit) else None
    except ArithmeticError:
        return None
