"""Whether tests are adequate: what they cover of the rules, and whether they notice small mistakes
in them.

Coverage is whether each rule fired, each atom held and failed, and how values compared. All of it
is asked of Pellet, with rules that have the beginning of a rule's body as their body. What no state
of the model reaches is told apart, and few states that cover the rest are found among the states of
the policy.

A mutant is killed when a test fails. One that no test kills is equivalent when nothing that
follows, and nothing that is decided, differs in any state of the policy: over all regions of
measured values, all groundings, and reports of components. The others survive, each with a state
that tells it apart.

Pellet is asked once in each state for all mutants, with a probe for each: where neither the old
rule nor the new one fires, a mutant changes nothing, as entailment with Horn axioms is monotonic.
Where one of them fires, the mutant itself is loaded and asked. An ontology with axioms that are not
Horn (unions, complements, cardinalities) gets no such shortcut.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cache, partial
from itertools import chain, islice
from typing import NamedTuple, TypeVar

from suave_des.errors import KnowledgeError, number_of
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.matching import Body, Probes, testable_order
from suave_des.kb.rule_tests import RuleTest, passes
from suave_des.kb.situations import Decide, OnCount, Situation, compare, difference
from suave_des.kb.space import PolicySpace, States, spread
from suave_des.knowledge import rules as swrl
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import ReasonerTimeoutError
from suave_des.knowledge.rdf import EXACT, OWL, RDFS, XSD, Lit, members, memberships, terms
from suave_des.knowledge.rules import Atom, Named, Rule, Term, Variable, write_atom
from suave_des.knowledge.rules.files import fatal_problems
from suave_des.knowledge.state import KnowledgeState
from suave_des.tables import Table

# Coverage.

FIRES, FIRES_NOT, HOLDS, FAILS = "fires", "does not fire", "holds", "fails"
#: How the values of a comparison can relate, with the sign that says so and words for it.
ORDERS = {
    "less": ("<", "with the first value less than the second"),
    "equal": ("=", "with equal values"),
    "greater": (">", "with the first value greater than the second"),
}


@dataclass(frozen=True, order=True)
class Goal:
    """Something that a test can cover.

    Attributes:
        atom: number of an atom of its body, in the order in which they are tried; -1 for the rule
            itself.
        outcome: "fires", "does not fire", "holds", "fails", or, of a comparison, "less", "equal" or
            "greater".
        holds, fails: it is covered where one conjunction of atoms holds, which an empty one always
        does, and another
            one fails; None: no other one.
    """

    rule: str
    atom: int
    outcome: str
    text: str = field(default="", compare=False)
    holds: Body = field(default=(), compare=False, repr=False)
    fails: Body | None = field(default=None, compare=False, repr=False)

    def __str__(self) -> str:
        if self.atom < 0:
            return f"{self.rule} {self.outcome}"
        words = ORDERS[self.outcome][1] if self.outcome in ORDERS else self.outcome
        return f"{self.rule}: {self.text} {words}"


def _goals(rules: Iterable[Rule]) -> Iterator[Goal]:
    for rule in rules:
        atoms = tuple(rule.body[number] for number in testable_order(rule.body))
        yield Goal(rule.name, -1, FIRES, holds=atoms)
        yield Goal(rule.name, -1, FIRES_NOT, fails=atoms)
        for number, atom in enumerate(atoms):
            before = atoms[:number]
            text = write_atom(atom)
            if atom.predicate in swrl.COMPARISONS and len(atom.arguments) == 2:
                for order, (sign, _) in ORDERS.items():
                    compared = replace(atom, predicate=swrl.COMPARISON_OF[sign])
                    yield Goal(rule.name, number, order, text, (*before, compared))
            else:
                yield Goal(rule.name, number, HOLDS, text, (*before, atom))
                yield Goal(rule.name, number, FAILS, text, before, (*before, atom))


def _covering(
    knowledge: KnowledgeBase, goals: Sequence[Goal]
) -> Callable[[Situation], frozenset[Goal]]:
    bodies = (body for goal in goals for body in (goal.holds, goal.fails) if body)
    probes = Probes(knowledge.base, knowledge.limit, bodies)

    def covered(situation: Situation) -> frozenset[Goal]:
        holding = {(), *(probes.holding(situation) or ())}
        return frozenset(
            goal for goal in goals if goal.holds in holding and goal.fails not in holding
        )

    return covered


class Coverage(NamedTuple):
    """What tests cover of all enabled rules.

    Attributes:
        covered: number of situations that cover each goal; none if it is missing.
        missing: goals that no situation covers, but that a state of the model reaches; further ones
            nothing reaches.
        proposed: states that would cover what is missing, few ones, each with what it would add.
    """

    goals: tuple[Goal, ...]
    covered: Counter[Goal]
    missing: frozenset[Goal]
    proposed: tuple[tuple[KnowledgeState, tuple[Goal, ...]], ...]

    def table(self) -> Table:
        """The goals of each rule."""
        covered = len(self.covered)
        reachable = covered + len(self.missing)
        share = covered / reachable if reachable else 1.0
        return Table(
            ("rule", "fired", "not fired", "covered", "missing", "no state"),
            [self._row(rule) for rule in sorted({goal.rule for goal in self.goals})],
            f"coverage: {covered} of {reachable}, {share:.0%}",
            "lrrrll",
        )

    def _row(self, rule: str) -> tuple[str, ...]:
        own = {goal for goal in self.goals if goal.rule == rule}
        covered = len(own & self.covered.keys())
        missing = len(own & self.missing)
        return (
            rule,
            str(self.covered[Goal(rule, -1, FIRES)]),
            str(self.covered[Goal(rule, -1, FIRES_NOT)]),
            f"{covered}/{covered + missing}",
            str(missing or ""),
            str(len(own) - covered - missing or ""),
        )

    def lines(self) -> Iterator[str]:
        """What is missing, and states that would cover it."""
        if self.missing:
            yield "not covered"
            yield from (f"  {goal}" for goal in sorted(self.missing))
        if self.proposed:
            count = len(self.proposed)
            yield f"states that would cover the rest: {count} (write them as tests with --write FILE)"
            for state, goals in self.proposed:
                yield f"  {state}"
                more = f" and {len(goals) - 1} more" if len(goals) > 1 else ""
                yield f"    {goals[0]}{more}"


def measure_coverage(
    knowledge: KnowledgeBase,
    situations: Iterable[Situation],
    max_failed: int,
    on_count: OnCount = lambda done, total: None,
) -> Coverage:
    """Measure what the situations of tests cover.

    Args:
        knowledge: whose rules are to be covered.
        situations: of the tests.
        max_failed: in states that are looked through, and proposed, at most so many components
            report.
        on_count: called with how many of how many states are looked through, if any has to be.

    Raises:
        InputError: there would be too many states.
        KnowledgeError: the reasoner takes too long.
    """
    goals = list(_goals(rule for rule in knowledge.base.content.enabled_rules if rule.body))
    covering = _covering(knowledge, goals)
    covered = Counter(chain.from_iterable(map(covering, dict.fromkeys(situations))))
    left = [goal for goal in goals if goal not in covered]
    found = dict[frozenset[Goal], KnowledgeState]()  # one state for each different set of goals
    if left:
        covering = _covering(knowledge, left)
        states = States.of(knowledge.base, knowledge.settings, max_failed, knowledge.space)
        for number, state in enumerate(states):
            on_count(number, len(states))
            found.setdefault(covering(Situation(state)), state)
    missing = frozenset[Goal]().union(*found)
    proposed = {}
    waiting = set(missing)
    while waiting:  # each next one covers most of what is left
        reached = max(found, key=lambda each: len(each & waiting))
        proposed[found[reached]] = tuple(sorted(reached))
        waiting -= reached
    return Coverage(tuple(sorted({*goals})), covered, missing, tuple(proposed.items()))


# Mutants.

_NOT_HORN = terms(
    OWL,
    "unionOf complementOf oneOf disjointUnionOf allValuesFrom "
    "cardinality minCardinality maxCardinality "
    "qualifiedCardinality minQualifiedCardinality maxQualifiedCardinality",
)
#: By how much thresholds are moved, up and down.
_MOVED = (Decimal("1.1"), Decimal("0.9"))
_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class Mutant:
    """A knowledge base with one change.

    Attributes:
        operator: kind of the change, one of OPERATORS.
        new: the rule in its place; None where it is removed.
    """

    operator: str
    old: Rule = field(repr=False)
    new: Rule | None = field(repr=False)

    @property
    def name(self) -> str:
        """The rule that is changed."""
        return self.old.name

    @property
    def bodies(self) -> frozenset[Body]:
        """Conjunctions of which one holds wherever it can infer something else."""
        return frozenset(rule.body for rule in (self.old, self.new) if rule is not None)

    @property
    def text(self) -> str:
        """What is changed, in one line."""
        if self.new is None:
            return "the rule is removed"
        before = list(map(write_atom, self.old.atoms))
        after = list(map(write_atom, self.new.atoms))
        pairs = enumerate(zip(before, after, strict=False))
        at = next((at for at, (one, other) in pairs if one != other), -1)
        if len(before) > len(after):
            return f"{before[at]} is left out"
        return f"{before[at]} becomes {after[at]}"

    def __str__(self) -> str:
        return f"{self.name}: {self.operator}: {self.text}"

    def applied(self, base: Ontology) -> Ontology:
        """The knowledge base with the change."""
        rules = (self.new if rule is self.old else rule for rule in base.rules)
        return base.with_rules(rule for rule in rules if rule is not None)


def mutants_of(base: Ontology) -> tuple[Mutant, ...]:
    """All mutants of the enabled rules, by rule and operator; those that no reasoner could use are
    left out.
    """
    offered = _Offered.of(base)
    found = [
        Mutant(operator, rule, new)
        for operator, changed in MUTATION_OPERATORS.items()
        for rule in base.content.enabled_rules
        for new in changed(rule, offered)
        if new is None or _is_usable(new, rule, base)
    ]
    found.sort(key=lambda one: one.name)
    different: dict[object, Mutant] = {}
    for mutant in found:
        after = mutant.new and (mutant.new.body, mutant.new.head)
        different.setdefault((mutant.name, after), mutant)
    return tuple(different.values())


def _is_usable(new: Rule, old: Rule, base: Ontology) -> bool:
    """Whether a changed rule says something else, and a reasoner can use it."""
    is_same = new.head == old.head and set(new.body) == set(old.body)
    return not is_same and not fatal_problems(new, base.vocabulary)


class _Offered(NamedTuple):
    """What can stand in place of something of its kind.

    Attributes:
        members: the individuals of each class.
        literals: those that rules mention of each property, but for numbers.
    """

    members: tuple[list[str], ...]
    literals: Mapping[str, set[Lit]]

    @classmethod
    def of(cls, base: Ontology) -> _Offered:
        """Collect it from ontologies and enabled rules."""
        members = defaultdict[str, list[str]](list)
        for individual, name in memberships(base.content.triples):
            members[name].append(individual)
        literals = defaultdict[str, set[Lit]](set)
        for atom in chain.from_iterable(rule.atoms for rule in base.content.enabled_rules):
            for term in atom.arguments:
                if isinstance(term, Lit) and term.datatype not in EXACT:
                    literals[atom.predicate].add(term)
        return cls(tuple(members.values()), literals)


class _At(NamedTuple):
    """Numbers of an atom of a rule, and of one of its arguments."""

    atom: int
    argument: int


def _terms(rule: Rule) -> Iterator[tuple[_At, Term]]:
    """The terms of a rule, each with its place."""
    for number, atom in enumerate(rule.atoms):
        for place, term in enumerate(atom.arguments):
            yield _At(number, place), term


def _with_atom(rule: Rule, number: int, atom: Atom) -> Rule:
    """A rule with another atom in the place of one."""
    atoms = (*rule.atoms[:number], atom, *rule.atoms[number + 1 :])
    size = len(rule.body)
    return replace(rule, body=atoms[:size], head=atoms[size:], triples=())


def _with_term(rule: Rule, at: _At, term: Term) -> Rule:
    """A rule with another term in the place of one."""
    atom = rule.atoms[at.atom]
    arguments = (*atom.arguments[: at.argument], term, *atom.arguments[at.argument + 1 :])
    return _with_atom(rule, at.atom, replace(atom, arguments=arguments))


_TURNED = {"=": "!=", "!=": "=", "<": ">", ">": "<", "<=": ">=", ">=": "<="}
_SHIFTED = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}


def _comparisons_changed(rule: Rule, _: _Offered, *, signs: Mapping[str, str]) -> Iterator[Rule]:
    for number, atom in enumerate(rule.body):
        sign = signs.get(swrl.COMPARISONS.get(atom.predicate, ""))
        if sign is not None:
            yield _with_atom(rule, number, replace(atom, predicate=swrl.COMPARISON_OF[sign]))


def _atom_dropped(rule: Rule, _: _Offered) -> Iterator[Rule]:
    if len(rule.body) > 1:
        for number in range(len(rule.body)):
            rest = (*rule.body[:number], *rule.body[number + 1 :])
            yield replace(rule, body=rest, triples=())


def _variable_exchanged(rule: Rule, _: _Offered) -> Iterator[Rule]:
    """By the next one of the rule that stands for the same kind, an individual or a value."""
    variables = [(at, term) for at, term in _terms(rule) if isinstance(term, Variable)]
    values = {term for at, term in variables if rule.atoms[at.atom].takes_value(at.argument)}
    every = dict.fromkeys(term for _, term in variables)
    for at, term in variables:
        if at.atom < len(rule.body):
            alike = [each for each in every if (each in values) == (term in values)]
            yield _with_term(rule, at, _next(term, alike))


def _individual_exchanged(rule: Rule, offered: _Offered) -> Iterator[Rule]:
    """By the next one of the first class that has others."""
    for at, term in _terms(rule):
        if isinstance(term, Named):
            groups = [each for each in offered.members if term.iri in each and len(each) > 1]
            for group in groups[:1]:
                yield _with_term(rule, at, Named(_next(term.iri, group)))


def _threshold_moved(rule: Rule, _: _Offered) -> Iterator[Rule]:
    """Up and down by a tenth."""
    for at, term in _terms(rule):
        if isinstance(term, Lit) and term.datatype in EXACT:
            number = Decimal(term.text.strip())
            for factor in _MOVED:
                moved = number * factor if number else factor - 1
                text = format(moved.normalize(), "f")
                yield _with_term(rule, at, Lit(text, XSD + "decimal"))


def _literals_exchanged(rule: Rule, offered: _Offered, *, in_head: bool) -> Iterator[Rule]:
    """Exchange the literals of head or body by others that rules mention of the same property."""
    for at, term in _terms(rule):
        atom = rule.atoms[at.atom]
        is_wanted = atom.kind == "data" and (at.atom >= len(rule.body)) == in_head
        if is_wanted and isinstance(term, Lit) and term.datatype not in EXACT:
            for other in _others(term, offered.literals[atom.predicate]):
                yield _with_term(rule, at, other)


def _others(value: Lit, known: Iterable[Lit]) -> list[Lit]:
    if value.datatype == XSD + "boolean":
        text = "false" if value.text in ("true", "1") else "true"
        return [Lit(text, value.datatype)]
    return [each for each in sorted(known) if each.datatype == value.datatype]


#: What each kind of change makes of a rule; None: the rule is removed.
MUTATION_OPERATORS: Mapping[str, Callable[[Rule, _Offered], Iterable[Rule | None]]] = {
    "comparison turned": partial(_comparisons_changed, signs=_TURNED),
    "comparison shifted": partial(_comparisons_changed, signs=_SHIFTED),
    "atom dropped": _atom_dropped,
    "variable exchanged": _variable_exchanged,
    "conclusion changed": partial(_literals_exchanged, in_head=True),
    "rule removed": lambda rule, offered: [None],
    "threshold moved": _threshold_moved,
    "status exchanged": partial(_literals_exchanged, in_head=False),
    "individual exchanged": _individual_exchanged,
}


def _next(one: _T, alike: Sequence[_T]) -> _T:
    """The one that follows in a sequence; the first follows the last."""
    return alike[(alike.index(one) + 1) % len(alike)]


def sample(mutants: Sequence[Mutant], most: int | None) -> tuple[Mutant, ...]:
    """Take at most so many mutants, spread evenly over rules and operators; the same ones each
    time.
    """
    return tuple(mutants if most is None else spread(mutants, most))


def is_horn(base: Ontology) -> bool:
    """Whether no axiom leaves a choice, so that what follows is what the rules and axioms build up
    step by step.
    """
    structure = base.content.structure
    datatypes = members(structure, [RDFS + "Datatype"])
    return all(s in datatypes or _NOT_HORN.isdisjoint((p, o)) for s, p, o in structure)


KILLED, EQUIVALENT, SURVIVED = "killed", "equivalent", "survived"


class MutantResult(NamedTuple):
    """What became of a mutant.

    Attributes:
        result: "killed", "equivalent" or "survived".
        reason: the test that kills it, why it is equivalent, or what differs.
        state: for a survivor, a state that tells it apart.
    """

    mutant: Mutant
    result: str
    reason: str
    state: KnowledgeState | None = None


class _Mutants:
    """Decides with mutants, of which Pellet is asked only where the change can make a difference.

    Pellet is asked at once what holds for all of them: it takes the longer the more there are.
    """

    def __init__(self, knowledge: KnowledgeBase, mutants: Sequence[Mutant]) -> None:
        self.knowledge = knowledge
        self.unchanged = cache(knowledge.outcome)
        if is_horn(knowledge.base):
            bodies = dict.fromkeys(body for mutant in mutants for body in mutant.bodies if body)
            self._holding = cache(Probes(knowledge.base, knowledge.limit, bodies).holding)
        else:
            self._holding = cache(lambda _: None)

    def touches(self, mutant: Mutant, situation: Situation) -> bool:
        """Whether a change can make a difference in a situation."""
        holding = self._holding(situation)
        return holding is None or not mutant.bodies.isdisjoint({(), *holding})

    def deciding(self, mutant: Mutant) -> Decide:
        """What follows and is decided with a change, which is loaded where it is first needed."""
        load = cache(lambda: self.knowledge.changed(mutant.applied(self.knowledge.base)))
        return lambda situation: (
            load().outcome if self.touches(mutant, situation) else self.unchanged
        )(situation)

    def killer(self, mutant: Mutant, tests: Iterable[RuleTest]) -> str | None:
        """The test that fails, or why the mutant cannot be used; None if all pass."""
        decide = self.deciding(mutant)
        try:
            return next((test.name for test in tests if not passes(test, decide)), None)
        except ReasonerTimeoutError:
            raise
        except KnowledgeError as error:
            return f"it cannot be used: {error.problem}"


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
        tests, mutants: of that knowledge base.
        max_failed: for the states that are compared: at most so many components report anything.
        on_result: called after each mutant.

    Returns:
        what became of each mutant, and the number of kinds of states in which those left by tests
        were compared.

    Raises:
        InputError: there would be too many states.
        KnowledgeError: the reasoner takes too long.
    """
    results = {}
    quick_first = sorted(tests, key=lambda test: len(test.situations))
    every = _Mutants(knowledge, mutants)
    left = []
    for mutant in mutants:
        killer = every.killer(mutant, quick_first)
        if killer is None:
            left.append(mutant)
        else:
            results[mutant] = MutantResult(mutant, KILLED, killer)
            on_result()
    if not left:
        return list(results.values()), 0
    space = knowledge.space
    for mutant in left:  # which may depend on more than the original does
        space = space.union(PolicySpace.of(mutant.applied(knowledge.base), knowledge.settings))
    states = States.of(knowledge.base, knowledge.settings, max_failed, space)
    of_tests = dict.fromkeys(chain.from_iterable(test.situations for test in tests))
    situations = [*of_tests, *map(Situation, states)]
    few = _Mutants(knowledge, left)  # the policy has many more states than the tests
    for mutant in left:
        results[mutant] = MutantResult(
            mutant, EQUIVALENT, f"nothing differs in {len(states)} kinds of states"
        )
        touched = filter(partial(few.touches, mutant), situations)
        found = compare(few.unchanged, few.deciding(mutant), touched)
        for situation, before, after in islice(found, 1):
            reason = difference(before, after)
            if situation in of_tests:
                reason += ", in a state of a test that does not expect it"
            results[mutant] = MutantResult(mutant, SURVIVED, reason, situation.state)
        on_result()
    return [results[mutant] for mutant in mutants], len(states)


def mutation_table(results: Sequence[MutantResult]) -> Table:
    """What became of the mutants of each operator."""
    kinds = (KILLED, SURVIVED, EQUIVALENT)
    counts = Counter((each.mutant.operator, each.result) for each in results)
    total = Counter(each.result for each in results)
    noticeable = total[KILLED] + total[SURVIVED]
    share = total[KILLED] / noticeable if noticeable else 1.0
    title = (
        f"mutation: {total[KILLED]} of {noticeable} mutants killed, {share:.0%}; "
        f"{total[EQUIVALENT]} equivalent"
    )
    rows = []
    for operator in dict.fromkeys(operator for operator, _ in counts):
        rows.append((operator, *(str(counts[operator, kind]) for kind in kinds)))
    return Table(("operator", *kinds), rows, title)


def mutation_lines(results: Sequence[MutantResult], states: int, max_failed: int) -> Iterator[str]:
    """Each survivor, with a state that tells it apart."""
    survivors = [each for each in results if each.result == SURVIVED]
    if survivors:
        yield "survivors, which no test notices"
    yield from (f"  {each.mutant}\n    {each.reason}\n    at {each.state}" for each in survivors)
    if states:
        components = number_of(max_failed, "component")
        yield f"equivalent: {states} kinds of states, with at most {components} reporting"
