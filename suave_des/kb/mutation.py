"""Mutation: whether tests notice small mistakes in rules and data.

A mutant is killed when a test fails. One that no test kills is equivalent when nothing that follows, and nothing that
is decided, differs in any state of the policy: over all regions of measured values, all groundings, and reports of
components. The others survive, each with a state that tells it apart.

Pellet is asked once in each state for all mutants, with a probe for each: where neither the old rule nor the new one
fires, a mutant changes nothing, as entailment with Horn axioms is monotonic. Where one of them fires, the mutant itself
is loaded and asked. An ontology with axioms that are not Horn (unions, complements, cardinalities) gets no such
shortcut.

Each operator is a function from a knowledge base to its mutants; OPERATORS lists them by name.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cache, cached_property, partial
from typing import Final, NamedTuple, TypeVar

from suave_des.errors import KnowledgeError, number_of
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.matching import instance, matched
from suave_des.kb.rule_tests import RuleTest, passes
from suave_des.kb.situations import Body, Outcome, Probes, Situation, difference
from suave_des.kb.space import PolicySpace, States
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import ReasonerTimeoutError
from suave_des.knowledge.planning import plan
from suave_des.knowledge.rdf import (
    DECISION_PROPERTIES,
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
    facts_of,
    local_name,
    memberships,
)
from suave_des.knowledge.rules import (
    COMPARISON_OF,
    COMPARISONS,
    Atom,
    Named,
    Rule,
    Term,
    Variable,
    literal_text,
    mirrored,
    write_atom,
)
from suave_des.knowledge.rules.checks import fatal_problems
from suave_des.knowledge.rules.files import with_triples
from suave_des.knowledge.state import Fact, Inference, KnowledgeState, Reasoning
from suave_des.tables import Table

_NOT_HORN: Final = (
    *("unionOf", "complementOf", "oneOf", "disjointUnionOf", "maxCardinality", "maxQualifiedCardinality"),
    *("cardinality", "qualifiedCardinality", "minQualifiedCardinality", "minCardinality", "allValuesFrom"),
)
#: By how much thresholds are moved, up and down.
_MOVED: Final = (Decimal("1.1"), Decimal("0.9"))
#: Properties that connect individuals of the model.
_LINKS: Final = tuple(TOMASYS + name for name in ("solvesF", "hasQAestimation", "isQAtype"))
_T = TypeVar("_T")
#: A rule or a fact, and what is in its place; None where a rule is removed.
_Change = tuple[Rule, Rule | None] | tuple[Triple, Triple]


@dataclass(frozen=True)
class Mutant:
    """A knowledge base with one change.

    Attributes:
        operator: name of the kind of change.
        old: the rule or the fact that is replaced.
        new: the rule or the fact in its place; None where a rule is removed.
    """

    operator: str
    old: Rule | Triple = field(repr=False)
    new: Rule | Triple | None = field(repr=False)

    @property
    def name(self) -> str:
        """The rule, or the individual, that is changed."""
        return self.old.name if isinstance(self.old, Rule) else local_name(self.old[0])

    @property
    def text(self) -> str:
        """What is changed, in one line."""
        if isinstance(self.old, Rule):
            if not isinstance(self.new, Rule):
                return "the rule is removed"
            before, after = (list(map(write_atom, rule.atoms)) for rule in (self.old, self.new))
            at = next((n for n, (one, other) in enumerate(zip(before, after, strict=False)) if one != other), -1)
            return f"{before[at]} becomes {after[at]}" if len(before) == len(after) else f"{before[at]} is left out"
        assert isinstance(self.new, tuple)
        one, other = (literal_text(f[2]) if isinstance(f[2], Lit) else local_name(f[2]) for f in (self.old, self.new))
        return f"{local_name(self.old[1])} {one} becomes {other}"

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
    found: dict[object, Mutant] = {}
    for name, operator in OPERATORS.items():
        for old, new in operator(base):
            if isinstance(new, Rule) and isinstance(old, Rule):
                is_same = new.head == old.head and set(new.body) == set(old.body)
                if is_same or fatal_problems(new, base.vocabulary):
                    continue
            before = old.name if isinstance(old, Rule) else old
            after = (new.body, new.head) if isinstance(new, Rule) else new
            found.setdefault((before, after), Mutant(name, old, new))
    order = list(OPERATORS)
    return tuple(
        sorted(found.values(), key=lambda one: (isinstance(one.old, tuple), one.name, order.index(one.operator)))
    )


def _with_atom(rule: Rule, number: int, atom: Atom | None) -> tuple[Rule, Rule]:
    """The rule with another atom in a place of its body or head; None: with none there."""
    body, head = list(rule.body), list(rule.head)
    side, at = (body, number) if number < len(body) else (head, number - len(body))
    side[at : at + 1] = [] if atom is None else [atom]
    return rule, with_triples(replace(rule, body=tuple(body), head=tuple(head)))


def _with_argument(rule: Rule, number: int, place: int, term: Term) -> tuple[Rule, Rule]:
    """The rule with another argument in a place of one of its atoms."""
    arguments = rule.atoms[number].arguments
    changed = (*arguments[:place], term, *arguments[place + 1 :])
    return _with_atom(rule, number, replace(rule.atoms[number], arguments=changed))


def _arguments(base: Ontology) -> Iterator[tuple[Rule, int, int, Term]]:
    """(rule, number of the atom, place in the atom, argument) of all arguments in the enabled rules."""
    for rule in base.content.enabled_rules:
        for number, atom in enumerate(rule.atoms):
            for place, term in enumerate(atom.arguments):
                yield rule, number, place, term


def _comparisons(base: Ontology, change: Callable[[str], str]) -> Iterator[_Change]:
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


def _dropped(base: Ontology) -> Iterator[_Change]:
    for rule in base.content.enabled_rules:
        for number in range(len(rule.body)) if len(rule.body) > 1 else ():
            yield _with_atom(rule, number, None)


def _next(one: _T, alike: Sequence[_T]) -> _T:
    """The one that follows in a sequence; the first follows the last."""
    return alike[(alike.index(one) + 1) % len(alike)]


def _variables_exchanged(base: Ontology) -> Iterator[_Change]:
    """Each variable of an atom of the body, exchanged for the next one of the rule that stands for the same kind."""
    for rule, number, place, term in _arguments(base):
        if number < len(rule.body) and isinstance(term, Variable):
            is_value: dict[Term, bool] = {}
            for atom in rule.atoms:
                for at, each in enumerate(atom.arguments):
                    if isinstance(each, Variable):
                        is_value[each] = is_value.get(each, False) or atom.takes_value(at)
            other = _next(term, [each for each in is_value if is_value[each] == is_value[term]])
            if other != term:
                yield _with_argument(rule, number, place, other)


def _literals_exchanged(base: Ontology, *, in_head: bool) -> Iterator[_Change]:
    """Each literal of bodies or heads, exchanged for the others that rules mention of the same property."""
    known: dict[str, set[Lit]] = {}
    for rule, number, _, term in _arguments(base):
        if rule.atoms[number].kind == "data" and isinstance(term, Lit) and term.datatype not in EXACT:
            known.setdefault(rule.atoms[number].predicate, set()).add(term)
    for rule, number, place, term in _arguments(base):
        atom = rule.atoms[number]
        if (number >= len(rule.body)) == in_head and atom.kind == "data" and isinstance(term, Lit):
            others = [each for each in sorted(known.get(atom.predicate, ())) if each.datatype == term.datatype]
            if term.datatype == XSD + "boolean":
                others = [Lit("false" if term.text in ("true", "1") else "true", term.datatype)]
            yield from (_with_argument(rule, number, place, other) for other in others if other != term)


def _statuses(base: Ontology) -> Iterator[_Change]:
    """Each literal of a body exchanged, and the comparison operator of each quality attribute turned."""
    yield from _literals_exchanged(base, in_head=False)
    for fact in base.content.triples:
        if fact[1] == QA_OPERATOR and isinstance(fact[2], Lit):
            yield fact, (*fact[:2], fact[2]._replace(text=mirrored(fact[2].text)))


def _removed(base: Ontology) -> Iterator[_Change]:
    return ((rule, None) for rule in base.content.enabled_rules)


def _moved(base: Ontology) -> Iterator[_Change]:
    """Each number of a rule, and each value of an individual, moved up and down by a tenth."""
    for rule, number, place, term in _arguments(base):
        if isinstance(term, Lit) and term.datatype in EXACT:
            yield from (_with_argument(rule, number, place, moved) for moved in _tenths(term))
    for fact in base.content.triples:
        if fact[1] == HAS_VALUE and isinstance(fact[2], Lit):
            yield from ((fact, (*fact[:2], moved)) for moved in _tenths(fact[2]))


def _tenths(value: Lit) -> Iterator[Lit]:
    number = Decimal(value.text.strip())
    for factor in _MOVED:
        moved = number * factor if number else factor - 1
        yield Lit(format(moved.normalize(), "f"), XSD + "decimal")


def _individuals(base: Ontology) -> Iterator[_Change]:
    """Each individual that a rule names, and each one that a fact leads to, exchanged for the next of its class."""
    classes: dict[str, list[str]] = {}
    for individual, name in memberships(base.content.triples):
        classes.setdefault(name, []).append(individual)

    def others(iri: str) -> list[str]:
        groups = (members for members in classes.values() if iri in members and len(members) > 1)
        return [_next(iri, members) for members in groups][:1]

    for rule, number, place, term in _arguments(base):
        for other in others(term.iri) if isinstance(term, Named) else ():
            yield _with_argument(rule, number, place, Named(other))
    for fact in base.content.triples:
        if isinstance(fact[2], str) and (fact[1] in _LINKS or fact[1].endswith("requiredBy")):
            yield from ((fact, (*fact[:2], other)) for other in others(fact[2]))


#: Kinds of changes, by name.
OPERATORS: Final[Mapping[str, Callable[[Ontology], Iterator[_Change]]]] = {
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


def is_horn(base: Ontology) -> bool:
    """Whether no axiom leaves a choice, so that what follows is what the rules and axioms build up step by step."""
    datatypes = {line.split(" ", 1)[0] for line in base.content.structure if f"<{RDF_TYPE}> <{RDFS}Datatype>" in line}
    return not any(
        f"<{OWL}{name}>" in line and line.split(" ", 1)[0] not in datatypes
        for line in base.content.structure
        for name in _NOT_HORN
    )


KILLED, EQUIVALENT, SURVIVED = "killed", "equivalent", "survived"


class MutantResult(NamedTuple):
    """What became of a mutant.

    Attributes:
        mutant: which.
        result: "killed", "equivalent" or "survived".
        reason: the test that kills it, why it is equivalent, or what differs.
        state: for a survivor, a state that tells it apart.
    """

    mutant: Mutant
    result: str
    reason: str
    state: KnowledgeState | None = None


class _Original:
    """The knowledge base that mutants are made of, with a probe for each conjunction on which one of them depends."""

    def __init__(self, knowledge: KnowledgeBase, mutants: Iterable[Mutant]) -> None:
        self.knowledge = knowledge
        self.is_horn = is_horn(knowledge.base)
        self.planned_on = _planning_facts(knowledge.base)
        self.mutants = [_Changed(self, mutant, frozenset(touching(knowledge.base, mutant))) for mutant in mutants]
        bodies = {body: None for changed in self.mutants for body in changed.probes if all(changed.probes)}
        #: What follows and is decided; and the conjunctions that hold, None where a situation contradicts itself.
        self.outcome = cache(knowledge.outcome)
        self.holding = cache(Probes(knowledge.base, knowledge.limit, bodies).holding)


def _planning_facts(base: Ontology) -> frozenset[Fact]:
    """The facts of an ontology that planning reads."""
    names = {local_name(name) for name in DECISION_PROPERTIES}
    return frozenset(fact for fact in base.facts if fact.property in names)


@dataclass
class _Changed:
    """A mutant, which concludes what follows with as little of Pellet as that takes.

    Attributes:
        original: the knowledge base without the change.
        mutant: the change.
        probes: conjunctions of which one holds wherever the mutant can infer something else; an empty one always does.
    """

    original: _Original
    mutant: Mutant
    probes: frozenset[Body]

    @cached_property
    def base(self) -> Ontology:
        return self.mutant.applied(self.original.knowledge.base)

    @cached_property
    def knowledge(self) -> KnowledgeBase:
        return self.original.knowledge.changed(self.base)

    @cached_property
    def planned_on(self) -> frozenset[Fact]:
        return _planning_facts(self.base)

    def touches(self, situation: Situation) -> bool:
        """Whether the change can make a difference to what is inferred in a situation."""
        if not all(self.probes) or not self.original.is_horn:
            return True
        holding = self.original.holding(situation)
        return holding is None or not holding.isdisjoint(self.probes)

    def is_same(self, situation: Situation) -> bool:
        """Whether it is plain that the change makes no difference in a situation."""
        return not self.touches(situation) and self.planned_on == self.original.planned_on

    def outcome(self, situation: Situation) -> Outcome:
        """Conclude what follows and is decided: what is inferred may be that of the original, the plan is its own."""
        if self.touches(situation):
            return self.knowledge.outcome(situation)
        base, state = self.base, situation.state
        asserted = self.planned_on.union(facts_of((*base.assertions(state), *situation.facts), base.names))
        inference = Inference(state, asserted, self.original.outcome(situation).inferred)
        improves = self.original.knowledge.settings.improves_exceeded
        return Outcome(Reasoning(inference, plan(base, inference, improve_exceeded=improves)))

    def killer(self, tests: Iterable[RuleTest]) -> str | None:
        """The test that fails, or why the mutant cannot be used; None if all pass."""
        try:
            for test in tests:
                if not all(map(self.is_same, test.situations)) and not passes(
                    test, self.outcome, lambda names: self.knowledge.without(names).outcome
                ):
                    return test.name
        except ReasonerTimeoutError:
            raise
        except KnowledgeError as error:
            return f"it cannot be used: {error.problem}"
        return None


def mutate(
    knowledge: KnowledgeBase,
    tests: Sequence[RuleTest],
    mutants: Sequence[Mutant],
    max_failed: int,
    on_result: Callable[[], object] = lambda: None,
) -> tuple[list[MutantResult], int]:
    """Run tests on mutants, and decide of those that no test kills whether they are equivalent.

    Args:
        knowledge: the knowledge base; all tests pass on it.
        tests: to run.
        mutants: of the knowledge base.
        max_failed: for the states that are compared: at most so many components report anything.
        on_result: called after each mutant.

    Returns:
        what became of each mutant, and the number of kinds of states in which those left by tests were compared.

    Raises:
        InputError: there would be too many states.
        KnowledgeError: the reasoner takes too long.
    """
    results: list[MutantResult] = []
    left: list[Mutant] = []
    in_order = sorted(tests, key=lambda test: (bool(test.without), len(test.situations)))
    for changed in _Original(knowledge, mutants).mutants:
        killer = changed.killer(in_order)
        if killer is None:
            left.append(changed.mutant)
            continue
        results.append(MutantResult(changed.mutant, KILLED, killer))
        on_result()
    states = 0
    if left:
        situations = list(dict.fromkeys(situation for test in tests for situation in test.situations))
        # Pellet takes the longer the more probes there are, and the policy has many more states than the tests.
        compared, states = _compared(_Original(knowledge, left), situations, max_failed)
        for result in compared:
            results.append(result)
            on_result()
    results.sort(key=lambda result: next(n for n, mutant in enumerate(mutants) if mutant is result.mutant))
    return results, states


def _compared(original: _Original, situations: Iterable[Situation], max_failed: int) -> tuple[list[MutantResult], int]:
    """Compare mutants with the original in the situations of the tests and in every state of the policy."""
    knowledge, left = original.knowledge, list(original.mutants)
    results: list[MutantResult] = []

    def look(situation: Situation, words: str = "") -> None:
        for changed in [each for each in left if not each.is_same(situation)]:
            if found := difference(original.outcome(situation), changed.outcome(situation)):
                results.append(MutantResult(changed.mutant, SURVIVED, f"{found}{words}", situation.state))
                left.remove(changed)

    for situation in situations:
        look(situation, ", in a state of a test that does not expect it")
    space = knowledge.space
    for changed in left:  # which may depend on more than the original does
        space = space.common(PolicySpace.of(changed.base, knowledge.settings))
    states = States.of(knowledge.base, knowledge.settings, max_failed, space)
    for state in states:
        if not left:
            break
        look(Situation(state))
    reason = f"nothing differs in {len(states)} kinds of states"
    return [*results, *(MutantResult(changed.mutant, EQUIVALENT, reason) for changed in left)], len(states)


def mutation_table(results: Sequence[MutantResult]) -> Table:
    """What became of the mutants of each operator."""
    kinds = (KILLED, SURVIVED, EQUIVALENT)
    counts = Counter((each.mutant.operator, each.result) for each in results)
    killed, survived, equivalent = (sum(each.result == kind for each in results) for kind in kinds)
    share = killed / (killed + survived) if killed + survived else 1.0
    title = f"mutation: {killed} of {killed + survived} mutants killed, {share:.0%}; {equivalent} equivalent"
    operators = dict.fromkeys(each.mutant.operator for each in results)
    return Table(
        ("operator", *kinds), [(name, *(str(counts[name, kind]) for kind in kinds)) for name in operators], title
    )


def mutation_lines(results: Sequence[MutantResult], states: int, max_failed: int) -> Iterator[str]:
    """Each survivor, with a state that tells it apart."""
    survivors = [each for each in results if each.result == SURVIVED]
    if survivors:
        yield "survivors, which no test notices"
    yield from (f"  {each.mutant}\n    {each.reason}\n    at {each.state}" for each in survivors)
    if states:
        components = number_of(max_failed, "component")
        yield f"equivalent: {states} kinds of states, with at most {components} reporting"
