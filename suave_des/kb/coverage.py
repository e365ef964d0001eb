"""What tests cover of the rules: whether each rule fired, each atom held and failed, and how values compared.

All of it is asked of Pellet, with rules that have the beginning of a rule's body as their body. What no state of the
model reaches is told apart, and the least set of states that covers the rest is found among the states of the policy.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.matching import testable_order
from suave_des.kb.situations import Body, Probes, Situation
from suave_des.kb.space import States
from suave_des.knowledge.rules import COMPARISON_OF, COMPARISONS, Rule, write_atom
from suave_des.knowledge.state import KnowledgeState

FIRES, FIRES_NOT, HOLDS, FAILS = "fires", "does not fire", "holds", "fails"
#: How the values of a comparison can relate, with the sign that says so and words for it.
ORDERS: Final[Mapping[str, tuple[str, str]]] = {
    "less": ("<", "with the first value less than the second"),
    "equal": ("=", "with equal values"),
    "greater": (">", "with the first value greater than the second"),
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
        words = ORDERS[self.outcome][1] if self.outcome in ORDERS else self.outcome
        return f"{self.rule}: {self.text} {words}"


class _Question(NamedTuple):
    """When a goal is covered: where one conjunction of atoms holds (an empty one always does), and another fails."""

    goal: Goal
    holds: Body
    fails: Body | None = None


def _questions(rules: Iterable[Rule]) -> Iterator[_Question]:
    for rule in rules:
        atoms = tuple(rule.body[number] for number in testable_order(rule.body))
        yield _Question(Goal(rule.name, -1, FIRES), atoms)
        yield _Question(Goal(rule.name, -1, FIRES_NOT), (), atoms)
        for number, atom in enumerate(atoms):
            before, text = atoms[:number], write_atom(atom)
            if atom.predicate in COMPARISONS and len(atom.arguments) == 2:
                for order, (sign, _) in ORDERS.items():
                    compared = replace(atom, predicate=COMPARISON_OF[sign])
                    yield _Question(Goal(rule.name, number, order, text), (*before, compared))
            else:
                yield _Question(Goal(rule.name, number, HOLDS, text), (*before, atom))
                yield _Question(Goal(rule.name, number, FAILS, text), before, (*before, atom))


class _Asked:
    """A knowledge base that is asked which goals situations cover."""

    def __init__(self, knowledge: KnowledgeBase, questions: Collection[_Question]) -> None:
        self.questions = questions
        self.bodies = list(dict.fromkeys(body for each in questions for body in (each.holds, each.fails) if body))
        self.probes = Probes(knowledge.base, knowledge.limit, self.bodies)

    def covered(self, situation: Situation) -> frozenset[Goal]:
        """The goals that a situation covers."""
        holding = {(), *(self.bodies[number] for number in self.probes.holding(situation))}
        return frozenset(goal for goal, holds, fails in self.questions if holds in holding and fails not in holding)


class RuleCoverage(NamedTuple):
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


class Coverage(NamedTuple):
    """What tests cover of all enabled rules.

    Attributes:
        rules: of each rule, by name.
        proposed: the least set of states that would cover what is missing, each with what it would add.
        states: number of kinds of states that were looked at for that.
    """

    rules: tuple[RuleCoverage, ...]
    proposed: tuple[tuple[KnowledgeState, tuple[Goal, ...]], ...]
    states: int


def measure_coverage(knowledge: KnowledgeBase, situations: Iterable[Situation], max_failed: int) -> Coverage:
    """Measure what situations cover.

    Args:
        knowledge: the knowledge base.
        situations: of the tests.
        max_failed: for the states that are proposed: at most so many components report anything.

    Raises:
        InputError: there would be too many states.
        KnowledgeError: the reasoner takes too long.
    """
    questions = list(_questions(rule for rule in knowledge.base.content.enabled_rules if rule.body))
    asked = _Asked(knowledge, questions)
    by_situation = [asked.covered(each) for each in dict.fromkeys(situations)]
    covered = frozenset[Goal]().union(*by_situation)
    goals = frozenset(each.goal for each in questions)
    missing = goals - covered
    open_questions = [each for each in questions if each.goal in missing]
    candidates, states = _reached(knowledge, open_questions, max_failed) if missing else ({}, 0)
    reachable = frozenset[Goal]().union(*candidates.values())
    kinds = (covered, missing & reachable, missing - reachable)
    rules = tuple(
        RuleCoverage(
            name,
            sum(Goal(name, -1, FIRES) in each for each in by_situation),
            sum(Goal(name, -1, FIRES_NOT) in each for each in by_situation),
            *(tuple(sorted(goal for goal in kind if goal.rule == name)) for kind in kinds),
        )
        for name in sorted({goal.rule for goal in goals})
    )
    chosen = least_cover(candidates)
    return Coverage(rules, tuple((state, tuple(sorted(candidates[state]))) for state in chosen), states)


def _reached(
    knowledge: KnowledgeBase, questions: Collection[_Question], max_failed: int
) -> tuple[dict[KnowledgeState, frozenset[Goal]], int]:
    """Which goals each state of the policy covers; one state for each different set of them."""
    asked = _Asked(knowledge, questions)
    found: dict[frozenset[Goal], KnowledgeState] = {}
    states = States.of(knowledge.base, knowledge.settings, max_failed, knowledge.space)
    for state in states:
        found.setdefault(asked.covered(Situation(state)), state)
    return {state: goals for goals, state in found.items() if goals}, len(states)


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
