"""What tests cover of the rules: whether each rule fired, each atom held and failed, and how values compared.

All of it is asked of Pellet, with rules that have the beginning of a rule's body as their body. What no state of the
model reaches is told apart, and the least set of states that covers the rest is found among the states of the policy.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

from suave_des.knowledge.rules.builtins import COMPARISON_OF, COMPARISONS
from suave_des.knowledge.rules.syntax import Atom, Rule
from suave_des.knowledge.rules.writer import write_atom
from suave_des.knowledge.state import KnowledgeState
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.matching import testable_order
from suave_des.workbench.policy import kinds_of_states
from suave_des.workbench.policy_space import PolicySpace
from suave_des.workbench.prover import Body, Prover, Situation

FIRES, FIRES_NOT, HOLDS, FAILS = "fires", "does not fire", "holds", "fails"
#: How the values of a comparison can relate, with the built-in that says so.
ORDERS: Final[Mapping[str, str]] = {
    "less": COMPARISON_OF["<"],
    "equal": COMPARISON_OF["="],
    "greater": COMPARISON_OF[">"],
}
_WORDS: Final[Mapping[str, str]] = {
    "less": "with the first value less than the second",
    "equal": "with equal values",
    "greater": "with the first value greater than the second",
}


@dataclass(frozen=True, order=True)
class Goal:
    """Something that a test can cover.

    Attributes:
        rule: name of the rule.
        atom: number of an atom of its body, in the order in which they are tried; -1 for the rule itself.
        outcome: "fires", "does not fire", "holds", "fails", or, of a comparison, "less", "equal" or "greater".
        text: the atom.
    """

    rule: str
    atom: int
    outcome: str
    text: str = field(default="", compare=False)

    def __str__(self) -> str:
        """As a list of what is not covered has it."""
        if self.atom < 0:
            return f"{self.rule} {self.outcome}"
        return f"{self.rule}: {self.text} {_WORDS.get(self.outcome, self.outcome)}"


@dataclass(frozen=True)
class _Questions:
    """What to ask Pellet about the rules, and what the answers cover."""

    rules: tuple[Rule, ...]

    @cached_property
    def bodies(self) -> dict[Body, int]:
        """All conjunctions to ask for, numbered."""
        found: dict[Body, int] = {}
        for rule in self.rules:
            atoms = _ordered(rule)
            for number, atom in enumerate(atoms):
                for body in (atoms[: number + 1], *(_compared(atoms, number, order) for order in _orders(atom))):
                    found.setdefault(body, len(found))
        return found

    def goals(self) -> set[Goal]:
        """All that can be covered."""
        found = set()
        for rule in self.rules:
            found |= {Goal(rule.name, -1, FIRES), Goal(rule.name, -1, FIRES_NOT)}
            for number, atom in enumerate(_ordered(rule)):
                outcomes = _orders(atom) or (HOLDS, FAILS)
                found |= {Goal(rule.name, number, outcome, write_atom(atom)) for outcome in outcomes}
        return found

    def covered(self, holding: frozenset[int]) -> Iterator[Goal]:
        """What a situation covers, by the numbers of the conjunctions that hold in it."""
        for rule in self.rules:
            atoms = _ordered(rule)
            before = True
            for number, atom in enumerate(atoms):
                holds = self.bodies[atoms[: number + 1]] in holding
                for order in _orders(atom):
                    if self.bodies[_compared(atoms, number, order)] in holding:
                        yield Goal(rule.name, number, order, write_atom(atom))
                if before and not _orders(atom):
                    yield Goal(rule.name, number, HOLDS if holds else FAILS, write_atom(atom))
                before = holds
            yield Goal(rule.name, -1, FIRES if before else FIRES_NOT)

    def needed(self, goals: set[Goal]) -> Iterator[int]:
        """Numbers of conjunctions of which one must hold wherever one of these goals is covered."""
        for rule in self.rules:
            atoms = _ordered(rule)
            for number, atom in enumerate(atoms):
                for outcome in _orders(atom):
                    if Goal(rule.name, number, outcome) in goals:
                        yield self.bodies[_compared(atoms, number, outcome)]
                if Goal(rule.name, number, HOLDS) in goals:
                    yield self.bodies[atoms[: number + 1]]
                if Goal(rule.name, number, FAILS) in goals and number:
                    yield self.bodies[atoms[:number]]
            if Goal(rule.name, -1, FIRES) in goals:
                yield self.bodies[atoms]

    def always(self, goals: set[Goal]) -> bool:
        """Whether a goal may be covered where no conjunction holds."""
        return any(goal.outcome == FIRES_NOT or (goal.outcome == FAILS and goal.atom == 0) for goal in goals)


def _ordered(rule: Rule) -> Body:
    return tuple(rule.body[number] for number in testable_order(rule.body))


def _orders(atom: Atom) -> tuple[str, ...]:
    return tuple(ORDERS) if atom.predicate in COMPARISONS and len(atom.arguments) == 2 else ()


def _compared(atoms: Body, number: int, order: str) -> Body:
    return (*atoms[:number], replace(atoms[number], predicate=ORDERS[order], places=()))


@dataclass(frozen=True)
class RuleCoverage:
    """What tests cover of one rule.

    Attributes:
        rule: its name.
        fired, not_fired: number of situations.
        covered: goals that are covered.
        missing: goals that are not, but that a state of the model reaches.
        unreachable: goals that no state of the model reaches, and that no test covers.
    """

    rule: str
    fired: int
    not_fired: int
    covered: tuple[Goal, ...]
    missing: tuple[Goal, ...]
    unreachable: tuple[Goal, ...]


@dataclass(frozen=True)
class Coverage:
    """What tests cover of all enabled rules.

    Attributes:
        rules: of each rule, by name.
        proposed: the least set of states that would cover what is missing, each with what it would add.
        states: number of kinds of states that were looked at for that.
        max_failed: with at most so many components that report anything.
    """

    rules: tuple[RuleCoverage, ...]
    proposed: tuple[tuple[KnowledgeState, tuple[Goal, ...]], ...]
    states: int
    max_failed: int

    @property
    def covered(self) -> int:
        """Number of goals that are covered."""
        return sum(len(each.covered) for each in self.rules)

    @property
    def reachable(self) -> int:
        """Number of goals that are covered, or that a state reaches."""
        return self.covered + sum(len(each.missing) for each in self.rules)


def measure_coverage(bench: KnowledgeBase, situations: Iterable[Situation], max_failed: int) -> Coverage:
    """Measure what situations cover.

    Args:
        bench: the knowledge base.
        situations: of the tests.
        max_failed: for the states that are proposed: at most so many components report anything.

    Raises:
        InputError: there would be too many states.
        KnowledgeError: the reasoner takes too long.
    """
    questions = _Questions(tuple(rule for rule in bench.base.content.enabled_rules if rule.body))
    prover = Prover.of(bench, bodies=tuple(questions.bodies))
    by_situation = [set(questions.covered(prover.holding(each))) for each in dict.fromkeys(situations)]
    covered = set[Goal]().union(*by_situation)
    missing = questions.goals() - covered
    candidates, states = _reached(bench, missing, max_failed) if missing else ({}, 0)
    reachable = set[Goal]().union(*candidates.values())
    kinds = (covered, missing & reachable, missing - reachable)
    rules = tuple(
        RuleCoverage(
            name,
            sum(Goal(name, -1, FIRES) in each for each in by_situation),
            sum(Goal(name, -1, FIRES_NOT) in each for each in by_situation),
            *(tuple(sorted(goal for goal in goals if goal.rule == name)) for goals in kinds),
        )
        for name in sorted({rule.name for rule in questions.rules})
    )
    chosen = least_cover(candidates)
    return Coverage(rules, tuple((state, tuple(sorted(candidates[state]))) for state in chosen), states, max_failed)


def _reached(
    bench: KnowledgeBase, missing: set[Goal], max_failed: int
) -> tuple[dict[KnowledgeState, frozenset[Goal]], int]:
    """Which of the goals that are missing each state of the policy covers; one state for each different set of them."""
    names = {goal.rule for goal in missing}
    rules = (rule for rule in bench.base.content.enabled_rules if rule.name in names and rule.body)
    questions = _Questions(tuple(rules))
    prover = Prover.of(bench, bodies=tuple(questions.bodies))
    wanted, everywhere = frozenset(questions.needed(missing)), questions.always(missing)
    space = PolicySpace.of(bench.base, bench.settings)
    found: dict[frozenset[Goal], KnowledgeState] = {}
    states = 0
    for kinds in kinds_of_states(bench.base, bench.settings, max_failed, space):
        states += len(kinds)
        for case in kinds if everywhere else prover.may_hold(kinds, wanted):
            goals = frozenset(questions.covered(prover.holding(Situation(case.state)))) & missing
            if goals:
                found.setdefault(goals, case.state)
    return {state: goals for goals, state in found.items()}, states


def least_cover(candidates: Mapping[KnowledgeState, frozenset[Goal]]) -> Sequence[KnowledgeState]:
    """Find a set of states, as few as possible, that together cover all that any of them covers.

    Source: set cover as an integer program, solved by scipy.optimize.milp (HiGHS).
    """
    goals = sorted(frozenset[Goal]().union(*candidates.values()))
    if not goals:
        return []
    import numpy as np
    from scipy.optimize import Bounds, LinearConstraint, milp

    states = list(candidates)
    matrix = np.array([[float(goal in candidates[state]) for state in states] for goal in goals])
    # Among sets of the same size the one whose states come first in the policy: simpler states do.
    cost = 1 + np.arange(len(states)) / (len(states) + 1) ** 2
    result = milp(
        cost, integrality=np.ones(len(states)), bounds=Bounds(0, 1), constraints=LinearConstraint(matrix, lb=1)
    )
    return [state for state, taken in zip(states, result.x, strict=True) if taken > 0.5]
