"""Mutants: rules and data with one small mistake each, as an author could make it, and where they make a difference.

Each operator is a function from a knowledge base to its mutants; OPERATORS lists them by name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import partial
from typing import Final, TypeVar

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import (
    EXACT,
    HAS_VALUE,
    OWL,
    QA_OPERATOR,
    RDF_TYPE,
    RDFS,
    TOMASYS,
    XSD,
    Lit,
    Triple,
    local_name,
    memberships,
)
from suave_des.knowledge.rules.checks import fatal_problems
from suave_des.knowledge.rules.rdf import with_triples
from suave_des.knowledge.rules.syntax import COMPARISON_OF, COMPARISONS, Atom, Named, Rule, Term, Variable, mirrored
from suave_des.knowledge.rules.writer import literal_text, write_atom
from suave_des.knowledge.state import KnowledgeState
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.prover import Body, Prover, Situation
from suave_des.workbench.reasons.matching import FACT_KINDS, instance, matched, stated

_NOT_HORN: Final = (
    *("unionOf", "complementOf", "oneOf", "disjointUnionOf", "maxCardinality", "maxQualifiedCardinality"),
    *("cardinality", "qualifiedCardinality", "minQualifiedCardinality", "minCardinality", "allValuesFrom"),
)
_FROZEN: Final = "urn:suave-des:any#"
#: By how much thresholds are moved, up and down.
_MOVED: Final = (Decimal("1.1"), Decimal("0.9"))
#: Properties whose values are thresholds, and those that connect individuals of the model.
_LINKS: Final = tuple(TOMASYS + name for name in ("solvesF", "hasQAestimation", "isQAtype"))
_T = TypeVar("_T")


@dataclass(frozen=True)
class Mutant:
    """A knowledge base with one change.

    Attributes:
        operator: name of the kind of change.
        text: what is changed, in one line.
        old: the rule or the fact that is replaced.
        new: the rule or the fact in its place; None where a rule is removed.
    """

    operator: str
    text: str
    old: Rule | Triple = field(repr=False)
    new: Rule | Triple | None = field(repr=False)

    @property
    def name(self) -> str:
        """The rule, or the individual, that is changed."""
        return self.old.name if isinstance(self.old, Rule) else local_name(self.old[0])

    def __str__(self) -> str:
        """As reports have it."""
        return f"{self.name}: {self.operator}: {self.text}"

    def applied(self, base: Ontology) -> Ontology:
        """The knowledge base with the change."""
        if isinstance(self.old, Rule):
            rules = (self.new if rule is self.old else rule for rule in base.rules)
            return base.with_rules(rule for rule in rules if isinstance(rule, Rule))
        facts = (self.new if fact == self.old else fact for fact in base.content.triples)
        return base.with_triples(fact for fact in facts if isinstance(fact, tuple))


def mutants_of(base: Ontology) -> tuple[Mutant, ...]:
    """All mutants of a knowledge base, by rule and operator; those that no reasoner could use are left out."""
    found: dict[tuple[object, ...], Mutant] = {}
    for name, operator in OPERATORS.items():
        for mutant in operator(base):
            new, old = mutant.new, mutant.old
            if isinstance(new, Rule) and isinstance(old, Rule):
                is_same = new.head == old.head and set(new.body) == set(old.body)
                if is_same or fatal_problems(new, base.vocabulary):
                    continue
            before = mutant.name if isinstance(old, Rule) else old
            after = (new.body, new.head) if isinstance(new, Rule) else new
            found.setdefault((before, after), replace(mutant, operator=name))
    order = list(OPERATORS)
    ordered = sorted(found.values(), key=lambda one: (one.name, order.index(one.operator)))
    return tuple(sorted(ordered, key=lambda one: not isinstance(one.old, Rule)))


def _changed(rule: Rule, body: Sequence[Atom], head: Sequence[Atom], text: str) -> Mutant:
    new = with_triples(replace(rule, body=tuple(body), head=tuple(head)))
    return Mutant("", text, rule, new)


def _with_atom(rule: Rule, number: int, atom: Atom) -> Mutant:
    """The rule with another atom in a place of its body or head."""
    atoms = list(rule.atoms)
    text = f"{write_atom(atoms[number])} becomes {write_atom(atom)}"
    atoms[number] = atom
    return _changed(rule, atoms[: len(rule.body)], atoms[len(rule.body) :], text)


def _with_argument(rule: Rule, number: int, place: int, term: Term) -> Mutant:
    """The rule with another argument in a place of one of its atoms."""
    atom = rule.atoms[number]
    return _with_atom(
        rule, number, replace(atom, arguments=(*atom.arguments[:place], term, *atom.arguments[place + 1 :]))
    )


def _with_value(fact: Triple, value: str | Lit) -> Mutant:
    """The ontologies with another value in a fact."""

    def shown(value: str | Lit) -> str:
        return literal_text(value) if isinstance(value, Lit) else local_name(value)

    text = f"{local_name(fact[1])} {shown(fact[2])} becomes {shown(value)}"
    return Mutant("", text, fact, (*fact[:2], value))


def _arguments(base: Ontology) -> Iterator[tuple[Rule, int, int, Term]]:
    """(rule, number of the atom, place in the atom, argument) of all arguments in the enabled rules."""
    for rule in base.content.enabled_rules:
        for number, atom in enumerate(rule.atoms):
            for place, term in enumerate(atom.arguments):
                yield rule, number, place, term


def _comparisons(base: Ontology, change: Callable[[str], str]) -> Iterator[Mutant]:
    """Each comparison with another sign."""
    for rule in base.content.enabled_rules:
        for number, atom in enumerate(rule.body):
            if atom.predicate in COMPARISONS:
                sign = change(COMPARISONS[atom.predicate])
                yield _with_atom(rule, number, replace(atom, predicate=COMPARISON_OF[sign]))


def _turned(sign: str) -> str:
    return {"=": "!=", "!=": "="}.get(sign) or mirrored(sign)


def _shifted(sign: str) -> str:
    return sign if sign in ("=", "!=") else sign.removesuffix("=") if sign.endswith("=") else f"{sign}="


def _dropped(base: Ontology) -> Iterator[Mutant]:
    for rule in base.content.enabled_rules:
        for number, atom in enumerate(rule.body):
            body = (*rule.body[:number], *rule.body[number + 1 :])
            if body:
                yield _changed(rule, body, rule.head, f"{write_atom(atom)} is left out")


def _next(one: _T, alike: Sequence[_T]) -> _T:
    """The one that follows in a sequence; the first follows the last."""
    return alike[(alike.index(one) + 1) % len(alike)]


def _variables_exchanged(base: Ontology) -> Iterator[Mutant]:
    """Each variable of an atom of the body, exchanged for the next one of the rule that stands for the same kind."""
    for rule, number, place, term in _arguments(base):
        if number >= len(rule.body) or not isinstance(term, Variable):
            continue
        is_value: dict[Term, bool] = {}
        for atom in rule.atoms:
            for at, each in enumerate(atom.arguments):
                if isinstance(each, Variable):
                    is_value[each] = is_value.get(each, False) or atom.takes_value(at)
        other = _next(term, [each for each in is_value if is_value[each] == is_value[term]])
        if other != term:
            yield _with_argument(rule, number, place, other)


def _literals_exchanged(base: Ontology, *, in_head: bool) -> Iterator[Mutant]:
    """Each literal of bodies or heads, exchanged for the others that rules mention of the same property."""
    known: dict[str, set[Lit]] = {}
    for rule, number, _, term in _arguments(base):
        if rule.atoms[number].kind == "data" and isinstance(term, Lit) and term.datatype not in EXACT:
            known.setdefault(rule.atoms[number].predicate, set()).add(term)
    for rule, number, place, term in _arguments(base):
        atom = rule.atoms[number]
        if (number >= len(rule.body)) != in_head or atom.kind != "data" or not isinstance(term, Lit):
            continue
        if term.datatype == XSD + "boolean":
            others = [Lit("false" if term.text in ("true", "1") else "true", term.datatype)]
        else:
            there = sorted(known.get(atom.predicate, ()))
            others = [each for each in there if each != term and each.datatype == term.datatype]
        for other in others:
            yield _with_argument(rule, number, place, other)


def _statuses(base: Ontology) -> Iterator[Mutant]:
    """Each literal of a body exchanged, and the comparison operator of each quality attribute turned."""
    yield from _literals_exchanged(base, in_head=False)
    for fact in base.content.triples:
        if fact[1] == QA_OPERATOR and isinstance(fact[2], Lit):
            yield _with_value(fact, fact[2]._replace(text=mirrored(fact[2].text)))


def _removed(base: Ontology) -> Iterator[Mutant]:
    for rule in base.content.enabled_rules:
        yield Mutant("", "the rule is removed", rule, None)


def _moved(base: Ontology) -> Iterator[Mutant]:
    """Each number of a rule, and each value of an individual, moved up and down by a tenth."""
    for rule, number, place, term in _arguments(base):
        if isinstance(term, Lit) and term.datatype in EXACT:
            yield from (_with_argument(rule, number, place, moved) for moved in _tenths(term))
    for fact in base.content.triples:
        if fact[1] == HAS_VALUE and isinstance(fact[2], Lit):
            yield from (_with_value(fact, moved) for moved in _tenths(fact[2]))


def _tenths(value: Lit) -> Iterator[Lit]:
    number = Decimal(value.text.strip())
    for factor in _MOVED:
        moved = number * factor if number else factor - 1
        yield Lit(format(moved.normalize(), "f"), XSD + "decimal")


def _individuals(base: Ontology) -> Iterator[Mutant]:
    """Each individual that a rule names, and each one that a fact leads to, exchanged for the next of its class."""
    classes: dict[str, list[str]] = {}
    for individual, name in memberships(base.content.triples):
        classes.setdefault(name, []).append(individual)

    def other(iri: str) -> str | None:
        groups = (members for members in classes.values() if iri in members and len(members) > 1)
        return next((_next(iri, members) for members in groups), None)

    for rule, number, place, term in _arguments(base):
        if isinstance(term, Named) and (exchanged := other(term.iri)) is not None:
            yield _with_argument(rule, number, place, Named(exchanged))
    for fact in base.content.triples:
        if isinstance(fact[2], str) and (fact[1] in _LINKS or fact[1].endswith("requiredBy")):
            exchanged = other(fact[2])
            if exchanged is not None:
                yield _with_value(fact, exchanged)


#: Kinds of changes, by name.
OPERATORS: Final[Mapping[str, Callable[[Ontology], Iterator[Mutant]]]] = {
    "comparison turned": partial(_comparisons, change=_turned),
    "comparison shifted": partial(_comparisons, change=_shifted),
    "atom dropped": _dropped,
    "variable exchanged": _variables_exchanged,
    "conclusion changed": partial(_literals_exchanged, in_head=True),
    "rule removed": _removed,
    "threshold moved": _moved,
    "status exchanged": _statuses,
    "individual exchanged": _individuals,
}


def sample(mutants: Sequence[Mutant], most: int | None) -> tuple[Mutant, ...]:
    """Take at most so many mutants, spread evenly over rules and operators; the same ones each time."""
    if most is None or most >= len(mutants):
        return tuple(mutants)
    return tuple(mutants[number * len(mutants) // most] for number in range(most))


def touching(base: Ontology, mutant: Mutant) -> Iterator[Body]:
    """Conjunctions of which one holds wherever a mutant can infer something else."""
    for changed in (mutant.old, mutant.new):
        if isinstance(changed, Rule):
            yield changed.body
        elif changed is not None:
            yield from _matching(base, changed)


def _matching(base: Ontology, fact: Triple) -> Iterator[Body]:
    """What is left of each body with an atom that a fact matches."""
    for rule in base.content.enabled_rules:
        for number, atom in enumerate(rule.body):
            binding = matched(atom, fact, {})
            if binding is not None:
                rest = (*rule.body[:number], *rule.body[number + 1 :])
                yield tuple(instance(each, binding) for each in rest)


def follows_anyway(bench: KnowledgeBase, mutant: Mutant) -> bool:
    """Whether an atom that a mutant leaves out follows from the others, whatever the state.

    The other atoms are asserted of individuals of which nothing else is known; what follows then, follows of all.
    """
    old, new = mutant.old, mutant.new
    if not (isinstance(old, Rule) and isinstance(new, Rule) and new.head == old.head and {*new.body} <= {*old.body}):
        return False
    dropped = next((atom for atom in old.body if atom not in new.body), None)
    if dropped is None or dropped.kind not in FACT_KINDS:
        return False
    individuals = {name: f"{_FROZEN}{name}" for atom in old.body for name in atom.variables()}
    facts = []
    for atom in new.body:
        binding: dict[str, str | Lit] = dict(individuals)
        if atom.kind == "data" and isinstance(last := atom.arguments[-1], Variable):
            if atom.predicate != HAS_VALUE:
                continue
            binding[last.name] = Lit("123.456", XSD + "decimal")
        facts.append(stated(atom, binding))
    prover = Prover.of(bench, bodies=[(instance(dropped, individuals),)])
    return prover.holding(Situation(KnowledgeState(), tuple(filter(None, facts)))) == {0}


def is_horn(base: Ontology) -> bool:
    """Whether no axiom leaves a choice, so that what follows is what the rules and axioms build up step by step."""
    datatypes = {line.split(" ", 1)[0] for line in base.content.structure if f"<{RDF_TYPE}> <{RDFS}Datatype>" in line}
    return not any(
        f"<{OWL}{name}>" in line and line.split(" ", 1)[0] not in datatypes
        for line in base.content.structure
        for name in _NOT_HORN
    )
