"""What tests cover of the rules: whether each rule fired, each atom held and failed, and how values compared.

All of it is asked of Pellet, with rules that have the beginning of a rule's body as their body. What no state of the
model reaches is told apart, and few states that cover the rest are found among the states of the policy.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.matching import Body, Probes, testable_order
from suave_des.kb.space import Situation, States
from suave_des.knowledge.rules import COMPARISON_OF, COMPARISONS, Rule, write_atom
from suave_des.knowledge.state import KnowledgeState
from suave_des.tables import Table

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
        atom: number of an atom of its body, in the order in which they are tried; -1 for the rule itself.
        outcome: "fires", "does not fire", "holds", "fails", or, of a comparison, "less", "equal" or "greater".
        holds, fails: it is covered where one conjunction of atoms holds, which an empty one always does, and another
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
            before, text = atoms[:number], write_atom(atom)
            if atom.predicate in COMPARISONS and len(atom.arguments) == 2:
                for order, (sign, _) in ORDERS.items():
                    compared = replace(atom, predicate=COMPARISON_OF[sign])
                    yield Goal(rule.name, number, order, text, (*before, compared))
            else:
                yield Goal(rule.name, number, HOLDS, text, (*before, atom))
                yield Goal(rule.name, number, FAILS, text, before, (*before, atom))


def _covering(knowledge: KnowledgeBase, goals: Sequence[Goal]) -> Callable[[Situation], frozenset[Goal]]:
    bodies = (body for goal in goals for body in (goal.holds, goal.fails) if body)
    probes = Probes(knowledge.base, knowledge.limit, bodies)

    def covered(situation: Situation) -> frozenset[Goal]:
        holding = {(), *(probes.holding(situation) or ())}
        return frozenset(goal for goal in goals if goal.holds in holding and goal.fails not in holding)

    return covered


class Coverage(NamedTuple):
    """What tests cover of all enabled rules.

    Attributes:
        covered: number of situations that cover each goal; none if it is missing.
        missing: goals that no situation covers, but that a state of the model reaches; further ones nothing reaches.
        proposed: states that would cover what is missing, few ones, each with what it would add.
    """

    goals: tuple[Goal, ...]
    covered: Counter[Goal]
    missing: frozenset[Goal]
    proposed: tuple[tuple[KnowledgeState, tuple[Goal, ...]], ...]

    @property
    def unreachable(self) -> frozenset[Goal]:
        """Goals that no state of the model reaches, and that no test covers."""
        return frozenset(self.goals) - self.missing - self.covered.keys()

    def table(self) -> Table:
        """The goals of each rule."""
        rows = []
        for rule in sorted({goal.rule for goal in self.goals}):
            own = [goal for goal in self.goals if goal.rule == rule]
            covered, missing, no_state = (
                sum(goal in kind for goal in own) for kind in (self.covered, self.missing, self.unreachable)
            )
            fired, not_fired = (str(self.covered[Goal(rule, -1, outcome)]) for outcome in (FIRES, FIRES_NOT))
            share = f"{covered}/{covered + missing}"
            rows.append((rule, fired, not_fired, share, str(missing or ""), str(no_state or "")))
        covered, reachable = len(self.covered), len(self.covered) + len(self.missing)
        title = f"coverage: {covered} of {reachable}, {covered / reachable if reachable else 1.0:.0%}"
        return Table(("rule", "fired", "not fired", "covered", "missing", "no state"), rows, title, "lrrrll")

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
                yield f"    {goals[0]}" + (f" and {len(goals) - 1} more" if len(goals) > 1 else "")


def measure_coverage(knowledge: KnowledgeBase, situations: Iterable[Situation], max_failed: int) -> Coverage:
    """Measure what the situations of tests cover; in states that are proposed at most `max_failed` components report.

    Raises:
        InputError: there would be too many states.
        KnowledgeError: the reasoner takes too long.
    """
    goals = list(_goals(rule for rule in knowledge.base.content.enabled_rules if rule.body))
    covering = _covering(knowledge, goals)
    covered = Counter(goal for each in dict.fromkeys(situations) for goal in covering(each))
    left = [goal for goal in goals if goal not in covered]
    found: dict[frozenset[Goal], KnowledgeState] = {}  # one state for each different set of goals
    if left:
        covering = _covering(knowledge, left)
        for state in States.of(knowledge.base, knowledge.settings, max_failed, knowledge.space):
            found.setdefault(covering(Situation(state)), state)
    candidates = {state: reached for reached, state in found.items() if reached}
    proposed = tuple((state, tuple(sorted(candidates[state]))) for state in small_cover(candidates))
    return Coverage(tuple(sorted({*goals})), covered, frozenset[Goal]().union(*candidates.values()), proposed)


def small_cover(candidates: Mapping[KnowledgeState, frozenset[Goal]]) -> list[KnowledgeState]:
    """Find few states that together cover all that any of them covers: each next one covers most of what is left."""
    left, chosen = set[Goal]().union(*candidates.values()), list[KnowledgeState]()
    while left:
        chosen.append(max(candidates, key=lambda state: len(candidates[state] & left)))
        left -= candidates[chosen[-1]]
    return chosen
