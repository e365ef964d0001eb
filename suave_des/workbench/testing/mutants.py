"""Mutants: rules and data with one small mistake each, as an author could make it, and where they make a difference.

Each operator is a function from a knowledge base to its mutants; OPERATORS lists them by name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import partial
from types import MappingProxyType
from typing import Final

from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.rdf import (
    EXACT,
    HAS_VALUE,
    LANGUAGE_NAMESPACES,
    OWL,
    RDF_TYPE,
    RDFS,
    TOMASYS,
    XSD,
    Lit,
    Triple,
    local_name,
)
from suave_des.knowledge.rules.checks import check_rule
from suave_des.knowledge.rules.rdf import with_triples
from suave_des.knowledge.rules.syntax import COMPARISON_OF, COMPARISONS, Atom, Named, Rule, Term, Variable, mirrored
from suave_des.knowledge.rules.writer import literal_text, write_atom
from suave_des.knowledge.state import KnowledgeState
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.prover import Body, Prover, Situation
from suave_des.workbench.reasons.matching import FACT_KINDS, instance, matched

_NOT_HORN: Final = (
    *("unionOf", "complementOf", "oneOf", "disjointUnionOf", "maxCardinality", "maxQualifiedCardinality"),
    *("cardinality", "qualifiedCardinality", "minQualifiedCardinality", "minCardinality", "allValuesFrom"),
)
_FROZEN: Final = "urn:suave-des:any#"
#: By how much thresholds are moved, up and down.
_MOVED: Final = (Decimal("1.1"), Decimal("0.9"))
#: Properties whose values are thresholds, and those that connect individuals of the model.
_LINKS: Final = tuple(TOMASYS + name for name in ("solvesF", "hasQAestimation", "isQAtype"))


@dataclass(frozen=True)
class Mutant:
    """A knowledge base with one change.

    Attributes:
        operator: name of the kind of change.
        text: what is changed, in one line.
        old: the rule that is replaced; None for a change of data.
        new: the rule in its place; None where the rule is removed, or for a change of data.
        removed, added: the fact that is replaced, and the one in its place.
    """

    operator: str
    text: str
    old: Rule | None = field(default=None, repr=False)
    new: Rule | None = field(default=None, repr=False)
    removed: Triple | None = None
    added: Triple | None = None

    @property
    def name(self) -> str:
        """The rule, or the individual, that is changed."""
        if self.old is not None:
            return self.old.name
        return local_name(self.removed[0]) if self.removed is not None else ""

    def __str__(self) -> str:
        """As reports have it."""
        return f"{self.name}: {self.operator}: {self.text}"

    def applied(self, base: Ontology) -> Ontology:
        """The knowledge base with the change."""
        if self.old is not None:
            changed = (self.new if rule is self.old else rule for rule in base.rules)
            return base.with_rules(rule for rule in changed if rule is not None)
        changed_triples = (self.added if triple == self.removed else triple for triple in base.content.triples)
        return base.with_triples(triple for triple in changed_triples if triple is not None)

    @property
    def generalises(self) -> bool:
        """Whether the new rule fires wherever the old one does, with the same head."""
        return (
            self.old is not None
            and self.new is not None
            and self.new.head == self.old.head
            and set(self.new.body) <= set(self.old.body)
        )


def mutants_of(base: Ontology) -> tuple[Mutant, ...]:
    """All mutants of a knowledge base, by rule and operator; those that no reasoner could use are left out."""
    found: dict[tuple[object, ...], Mutant] = {}
    for name, operator in OPERATORS.items():
        for mutant in operator(base):
            if mutant.new is not None and any(problem.is_fatal for problem in check_rule(mutant.new, base.vocabulary)):
                continue
            if mutant.new is not None and mutant.old is not None:
                same = set(mutant.new.body) == set(mutant.old.body) and mutant.new.head == mutant.old.head
                if same:
                    continue
            body = None if mutant.new is None else (mutant.new.body, mutant.new.head)
            found.setdefault((mutant.name, body, mutant.removed, mutant.added), replace(mutant, operator=name))
    order = list(OPERATORS)
    return tuple(sorted(found.values(), key=lambda one: (one.old is None, one.name, order.index(one.operator))))


def _rules(base: Ontology) -> Iterator[Rule]:
    yield from base.content.enabled_rules


def _changed(rule: Rule, body: Sequence[Atom], head: Sequence[Atom], text: str) -> Mutant:
    new = with_triples(replace(rule, body=tuple(body), head=tuple(head)))
    return Mutant("", text, rule, new)


def _with_atom(rule: Rule, number: int, atom: Atom) -> Mutant:
    """The rule with another atom in a place of its body or head."""
    atoms = list(rule.atoms)
    text = f"{write_atom(atoms[number])} becomes {write_atom(atom)}"
    atoms[number] = replace(atom, places=())
    return _changed(rule, atoms[: len(rule.body)], atoms[len(rule.body) :], text)


def _comparisons(base: Ontology, change: Callable[[str], str]) -> Iterator[Mutant]:
    """Each comparison with another sign."""
    for rule in _rules(base):
        for number, atom in enumerate(rule.body):
            if atom.predicate in COMPARISONS:
                sign = change(COMPARISONS[atom.predicate])
                yield _with_atom(rule, number, replace(atom, predicate=COMPARISON_OF[sign]))


def _turned(sign: str) -> str:
    return {"=": "!=", "!=": "="}.get(sign) or mirrored(sign)


def _shifted(sign: str) -> str:
    return sign if sign in ("=", "!=") else sign.removesuffix("=") if sign.endswith("=") else f"{sign}="


def _dropped(base: Ontology) -> Iterator[Mutant]:
    for rule in _rules(base):
        for number, atom in enumerate(rule.body):
            body = (*rule.body[:number], *rule.body[number + 1 :])
            if body:
                yield _changed(rule, body, rule.head, f"{write_atom(atom)} is left out")


def _variables_exchanged(base: Ontology) -> Iterator[Mutant]:
    """Each variable of an atom of the body, exchanged for the next one of the rule that stands for the same kind."""
    for rule in _rules(base):
        values = {
            term
            for atom in rule.atoms
            for number, term in enumerate(atom.arguments)
            if isinstance(term, Variable) and (atom.kind == "builtin" or (atom.kind == "data" and number == 1))
        }
        ordered = list(
            dict.fromkeys(term for atom in rule.atoms for term in atom.arguments if isinstance(term, Variable))
        )
        for number, atom in enumerate(rule.body):
            for place, term in enumerate(atom.arguments):
                others = [other for other in ordered if other != term and (other in values) == (term in values)]
                if not isinstance(term, Variable) or not others:
                    continue
                following = [other for other in others if ordered.index(other) > ordered.index(term)]
                arguments = list(atom.arguments)
                arguments[place] = (following or others)[0]
                yield _with_atom(rule, number, replace(atom, arguments=tuple(arguments)))


def _literals(rule: Rule, places: Sequence[int], known: Mapping[str, Sequence[Lit]]) -> Iterator[Mutant]:
    """The literals of some atoms of a rule, each exchanged for another one that rules know of the same property."""
    for number in places:
        atom = rule.atoms[number]
        last = atom.arguments[-1]
        if atom.kind != "data" or not isinstance(last, Lit):
            continue
        if last.datatype == XSD + "boolean":
            others = [Lit("false" if last.text in ("true", "1") else "true", last.datatype)]
        else:
            others = [each for each in known.get(atom.predicate, ()) if each != last and each.datatype == last.datatype]
        for other in others:
            yield _with_atom(rule, number, replace(atom, arguments=(*atom.arguments[:-1], other)))


def _known_literals(base: Ontology) -> dict[str, list[Lit]]:
    """Values that rules mention of each data property, without numbers."""
    found: dict[str, set[Lit]] = {}
    for rule in _rules(base):
        for atom in rule.atoms:
            last = atom.arguments[-1] if atom.arguments else None
            if atom.kind == "data" and isinstance(last, Lit) and last.datatype not in EXACT:
                found.setdefault(atom.predicate, set()).add(last)
    return {name: sorted(values) for name, values in found.items()}


def _conclusions(base: Ontology) -> Iterator[Mutant]:
    known = _known_literals(base)
    for rule in _rules(base):
        yield from _literals(rule, range(len(rule.body), len(rule.atoms)), known)


def _statuses(base: Ontology) -> Iterator[Mutant]:
    known = _known_literals(base)
    for rule in _rules(base):
        yield from _literals(rule, range(len(rule.body)), known)
    yield from _operators_of_attributes(base)


def _operators_of_attributes(base: Ontology) -> Iterator[Mutant]:
    """The comparison operator of each quality attribute, turned."""
    for triple in base.content.triples:
        subject, predicate, value = triple
        if predicate == TOMASYS + "qa_comparison_operator" and isinstance(value, Lit):
            yield _data(triple, (subject, predicate, Lit(mirrored(value.text), value.datatype)))


def _removed(base: Ontology) -> Iterator[Mutant]:
    for rule in _rules(base):
        yield Mutant("", "the rule is removed", rule)


def _moved(base: Ontology) -> Iterator[Mutant]:
    """Each number of a rule, and each value of an individual, moved up and down by a tenth."""
    for rule in _rules(base):
        for number, atom in enumerate(rule.atoms):
            for place, term in enumerate(atom.arguments):
                if isinstance(term, Lit) and term.datatype in EXACT:
                    for moved in _tenths(term):
                        arguments = (*atom.arguments[:place], moved, *atom.arguments[place + 1 :])
                        yield _with_atom(rule, number, replace(atom, arguments=arguments))
    for triple in base.content.triples:
        subject, predicate, value = triple
        if predicate == HAS_VALUE and isinstance(value, Lit):
            for moved in _tenths(value):
                yield _data(triple, (subject, predicate, moved))


def _tenths(value: Lit) -> Iterator[Lit]:
    number = Decimal(value.text.strip())
    for factor in _MOVED:
        moved = number * factor if number else factor - 1
        yield Lit(format(moved.normalize(), "f"), XSD + "decimal")


def _data(removed: Triple, added: Triple) -> Mutant:
    def shown(value: str | Lit) -> str:
        return literal_text(value) if isinstance(value, Lit) else local_name(value)

    text = f"{local_name(removed[1])} {shown(removed[2])} becomes {shown(added[2])}"
    return Mutant("", text, removed=removed, added=added)


def _individuals(base: Ontology) -> Iterator[Mutant]:
    """Each individual that a rule names, and each one that a fact leads to, exchanged for the next of its class."""
    classes: dict[str, list[str]] = {}
    for subject, predicate, value in base.content.triples:
        if predicate == RDF_TYPE and isinstance(value, str) and not value.startswith(LANGUAGE_NAMESPACES):
            classes.setdefault(value, []).append(subject)

    def next_one(iri: str) -> str | None:
        for members in classes.values():
            if iri in members and len(members) > 1:
                return members[(members.index(iri) + 1) % len(members)]
        return None

    for rule in _rules(base):
        for number, atom in enumerate(rule.atoms):
            for place, term in enumerate(atom.arguments):
                other = next_one(term.iri) if isinstance(term, Named) else None
                if other is not None:
                    arguments: tuple[Term, ...] = (*atom.arguments[:place], Named(other), *atom.arguments[place + 1 :])
                    yield _with_atom(rule, number, replace(atom, arguments=arguments))
    for triple in base.content.triples:
        subject, predicate, value = triple
        if isinstance(value, str) and (predicate in _LINKS or predicate.endswith("requiredBy")):
            other = next_one(value)
            if other is not None:
                yield _data(triple, (subject, predicate, other))


#: Kinds of changes, by name.
OPERATORS: Final[Mapping[str, Callable[[Ontology], Iterator[Mutant]]]] = MappingProxyType(
    {
        "comparison turned": partial(_comparisons, change=_turned),
        "comparison shifted": partial(_comparisons, change=_shifted),
        "atom dropped": _dropped,
        "variable exchanged": _variables_exchanged,
        "conclusion changed": _conclusions,
        "rule removed": _removed,
        "threshold moved": _moved,
        "status exchanged": _statuses,
        "individual exchanged": _individuals,
    }
)


def sample(mutants: Sequence[Mutant], most: int | None) -> tuple[Mutant, ...]:
    """Take at most so many mutants, spread evenly over rules and operators; the same ones each time."""
    if most is None or most >= len(mutants):
        return tuple(mutants)
    return tuple(mutants[number * len(mutants) // most] for number in range(most))


def touching(base: Ontology, mutant: Mutant) -> Iterator[Body]:
    """Conjunctions of which one holds wherever a mutant can infer something else."""
    if mutant.old is not None:
        yield _plain(mutant.old.body)
        if mutant.new is not None:
            yield _plain(mutant.new.body)
        return
    for triple in (mutant.removed, mutant.added):
        assert triple is not None
        for rule in base.content.enabled_rules:
            for number, atom in enumerate(rule.body):
                binding = matched(atom, triple, {}) if atom.kind in FACT_KINDS else None
                if binding is not None:
                    rest = (*rule.body[:number], *rule.body[number + 1 :])
                    yield tuple(instance(each, binding) for each in rest)


def _plain(body: Body) -> Body:
    return tuple(replace(atom, places=()) for atom in body)


def follows_anyway(bench: KnowledgeBase, mutant: Mutant) -> bool:
    """Whether an atom that a mutant leaves out follows from the others, whatever the state.

    The other atoms are asserted of individuals of which nothing else is known; what follows then, follows of all.
    """
    if mutant.old is None or mutant.new is None or not mutant.generalises:
        return False
    dropped = next((atom for atom in mutant.old.body if atom not in mutant.new.body), None)
    if dropped is None or dropped.kind not in FACT_KINDS:
        return False
    free = {name: f"{_FROZEN}{name}" for name in dropped.variables()}
    facts: list[Triple] = []
    for atom in mutant.new.body:
        if atom.kind in ("class", "object"):
            terms = [
                term.iri if isinstance(term, Named) else f"{_FROZEN}{term.name}"
                for term in atom.arguments
                if isinstance(term, Named | Variable)
            ]
            is_class = atom.kind == "class"
            facts.append((terms[0], RDF_TYPE if is_class else atom.predicate, atom.predicate if is_class else terms[1]))
        elif atom.kind == "data" and isinstance(atom.arguments[0], Variable) and isinstance(atom.arguments[1], Lit):
            facts.append((f"{_FROZEN}{atom.arguments[0].name}", atom.predicate, atom.arguments[1]))
        elif atom.kind == "data" and isinstance(atom.arguments[0], Variable) and atom.predicate == HAS_VALUE:
            facts.append((f"{_FROZEN}{atom.arguments[0].name}", atom.predicate, Lit("123.456", XSD + "decimal")))
    asked = instance(dropped, free)
    prover = Prover.of(bench, bodies=[(asked,)])
    return prover.holding(Situation(KnowledgeState(), tuple(facts))) == {0}


def is_horn(base: Ontology) -> bool:
    """Whether no axiom leaves a choice, so that what follows is what the rules and axioms build up step by step."""
    datatypes = {line.split(" ", 1)[0] for line in base.content.structure if f"<{RDF_TYPE}> <{RDFS}Datatype>" in line}
    return not any(
        f"<{OWL}{name}>" in line and line.split(" ", 1)[0] not in datatypes
        for line in base.content.structure
        for name in _NOT_HORN
    )
