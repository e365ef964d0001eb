"""Mutation: whether tests notice small mistakes in rules and data.

A mutant is killed when a test fails. One that no test kills is equivalent when nothing that follows, and nothing that
is decided, differs in any state of the policy: over all regions of measured values, all groundings, and reports of
components. The others survive, each with a state that tells it apart.

Pellet is asked once in each state for all mutants, with a probe for each: where neither the old rule nor the new one
fires, a mutant changes nothing, as entailment with Horn axioms is monotonic. Where one of them fires, the mutant itself
is loaded and asked. An ontology with axioms that are not Horn (unions, complements, cardinalities) gets no such
shortcut.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

from suave_des.errors import KnowledgeError
from suave_des.knowledge.deliberation import Conclusion
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet.limit import ReasonerTimeoutError
from suave_des.knowledge.planning import plan
from suave_des.knowledge.rdf import DECISION_PROPERTIES, HAS_VALUE, IS_QA_TYPE, local_name
from suave_des.knowledge.reasoners import Reasoner, make_reasoner
from suave_des.knowledge.rules.syntax import Rule
from suave_des.knowledge.state import ContradictionError, Fact, Inference, KnowledgeState
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.policy.cases import PolicyCase, kinds_of_states
from suave_des.workbench.policy.space import PolicySpace
from suave_des.workbench.prover import Body, Entailed, Outcome, Prover, Situation
from suave_des.workbench.ranges import numbers_in
from suave_des.workbench.testing.mutants import Mutant, follows_anyway, is_horn, touching
from suave_des.workbench.testing.reading import RuleTest
from suave_des.workbench.testing.run import Runner

KILLED, EQUIVALENT, SURVIVED = "killed", "equivalent", "survived"


@dataclass(frozen=True)
class Verdict:
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


@dataclass(frozen=True)
class MutationReport:
    """What became of all mutants.

    Attributes:
        verdicts: one for each.
        states: number of kinds of states in which those that no test kills were compared.
        max_failed: with at most so many components that report anything.
        duration_s: of all of it.
    """

    verdicts: tuple[Verdict, ...]
    states: int
    max_failed: int
    duration_s: float = field(compare=False)

    def of(self, result: str) -> tuple[Verdict, ...]:
        """Verdicts with a result."""
        return tuple(each for each in self.verdicts if each.result == result)

    @property
    def score(self) -> float:
        """Share of the mutants that are killed, of those that are not equivalent."""
        killed, survived = len(self.of(KILLED)), len(self.of(SURVIVED))
        return killed / (killed + survived) if killed + survived else 1.0


@dataclass
class _Original:
    """The knowledge base that mutants are made of, with a probe for each of them.

    Attributes:
        bench: the knowledge base.
        prover: with a probe for each conjunction on which mutants depend.
        touched_by: numbers of the probes of a mutant, by its number.
        is_horn: whether a mutant changes nothing where none of its probes holds.
    """

    bench: KnowledgeBase
    mutants: Sequence[Mutant]

    def __post_init__(self) -> None:
        base = self.bench.base
        numbers: dict[Body, int] = {}
        self.touched_by: list[frozenset[int] | None] = []
        for mutant in self.mutants:
            bodies = list(touching(base, mutant))
            if any(not body for body in bodies):  # what is changed alone makes a rule fire
                self.touched_by.append(None)
                continue
            self.touched_by.append(frozenset(numbers.setdefault(body, len(numbers)) for body in bodies))
        self.prover = Prover.of(self.bench, bodies=tuple(numbers))
        self.is_horn = is_horn(base)
        self.known = _planning_facts(base)

    def entailed(self, situation: Situation) -> Entailed | None:
        """What is inferred, and which probes hold; None for a contradiction."""
        with suppress(ContradictionError):
            return self.prover.entailed(situation)
        return None

    def touched(self, cases: Sequence[PolicyCase], numbers: Iterable[int]) -> frozenset[KnowledgeState]:
        """States in which probes of some mutants may hold; all, where that cannot be told."""
        probes = [self.touched_by[number] for number in numbers]
        if not self.is_horn or None in probes:
            return frozenset(case.state for case in cases)
        wanted = frozenset[int]().union(*filter(None, probes))
        return frozenset(case.state for case in self.prover.may_hold(cases, wanted))

    def take_from_cache(self, state: KnowledgeState) -> None:
        """Take what is inferred in a state, in which no probe of interest holds, from the reasoner's cache."""
        self.prover.known.setdefault(Situation(state), Entailed(self._reasoner.infer(state).facts, frozenset()))

    @cached_property
    def _reasoner(self) -> Reasoner:
        return make_reasoner("cached", self.bench.base, self.bench.limit)

    def outcome(self, base: Ontology, known: frozenset[Fact], situation: Situation) -> Outcome:
        """The outcome in a knowledge base with perhaps other data, from which the same is inferred.

        Args:
            base: the knowledge base.
            known: of its facts those that planning reads.
        """
        found = self.entailed(situation)
        if found is None:
            return Outcome(None)
        inference = Inference(situation.state, known.union(situation.asserted(base)), found.facts)
        improves = self.bench.settings.improves_exceeded
        return Outcome(Conclusion(inference, plan(base, inference, improve_exceeded=improves)))


def _planning_facts(base: Ontology) -> frozenset[Fact]:
    names = {local_name(name) for name in DECISION_PROPERTIES}
    return frozenset(fact for fact in base.facts if fact.property in names)


@dataclass
class _Changed:
    """A mutant, which concludes what follows with as little of Pellet as that takes."""

    original: _Original
    number: int

    @property
    def mutant(self) -> Mutant:
        return self.original.mutants[self.number]

    @cached_property
    def base(self) -> Ontology:
        return self.mutant.applied(self.original.bench.base)

    @cached_property
    def known(self) -> frozenset[Fact]:
        return _planning_facts(self.base)

    def is_same(self, situation: Situation) -> bool:
        """Whether it is plain that the change makes no difference in a situation."""
        return not self.touches(situation) and self.known == self.original.known

    @cached_property
    def prover(self) -> Prover:
        return Prover.of(self.original.bench, self.base)

    def touches(self, situation: Situation) -> bool:
        """Whether the change can make a difference to what is inferred in a situation."""
        found, probes = self.original.entailed(situation), self.original.touched_by[self.number]
        return found is None or probes is None or not self.original.is_horn or not probes.isdisjoint(found.holding)

    def outcome(self, situation: Situation) -> Outcome:
        """Conclude what follows in a situation."""
        if self.touches(situation):
            return self.prover.outcome(situation)
        return self.original.outcome(self.base, self.known, situation)


def mutate(
    bench: KnowledgeBase,
    tests: Sequence[RuleTest],
    mutants: Sequence[Mutant],
    max_failed: int,
    on_verdict: Callable[[], object] = lambda: None,
) -> MutationReport:
    """Run tests on mutants, and decide of those that no test kills whether they are equivalent.

    Args:
        bench: the knowledge base; all tests pass on it.
        tests: to run.
        mutants: of the knowledge base.
        max_failed: for the states that are compared: at most so many components report anything.
        on_verdict: called after each verdict.

    Raises:
        InputError: there would be too many states.
        KnowledgeError: the reasoner takes too long.
    """
    began = time.perf_counter()
    original = _Original(bench, mutants)
    verdicts: dict[int, Verdict] = {}
    left: list[int] = []
    in_order = sorted(tests, key=lambda test: (bool(test.without), len(test.situations)))
    for number, mutant in enumerate(mutants):
        killer = _killer(_Changed(original, number), in_order)
        if killer is None:
            left.append(number)
            continue
        verdicts[number] = Verdict(mutant, KILLED, killer)
        on_verdict()
    situations = list(dict.fromkeys(situation for test in tests for situation in test.situations))
    states = 0
    if left:
        # Pellet takes the longer the more probes there are, and the policy has many more states than the tests.
        found, states = _compared(_Original(bench, [mutants[number] for number in left]), situations, max_failed)
        for number, verdict in zip(left, found, strict=True):
            verdicts[number] = verdict
            on_verdict()
    ordered = tuple(verdicts[number] for number in range(len(mutants)))
    return MutationReport(ordered, states, max_failed, time.perf_counter() - began)


def _killer(changed: _Changed, tests: Iterable[RuleTest]) -> str | None:
    """The test that fails, or why the mutant cannot be used; None if all pass."""
    try:
        runner = Runner(changed.original.bench, changed.base, changed.outcome)
        for test in tests:
            if not all(map(changed.is_same, test.situations)) and not runner.passes(test):
                return test.name
    except ReasonerTimeoutError:
        raise
    except KnowledgeError as error:
        return f"it cannot be used: {error.problem}"
    return None


def _compared(original: _Original, situations: Sequence[Situation], max_failed: int) -> tuple[list[Verdict], int]:
    """Compare mutants with the original in the situations of the tests and in every state of the policy."""
    bench = original.bench
    verdicts: dict[int, Verdict] = {}
    left = [_Changed(original, number) for number in range(len(original.mutants))]
    for changed in left:
        if original.is_horn and follows_anyway(bench, changed.mutant):
            reason = "the dropped atom follows from the others by the schema"
            verdicts[changed.number] = Verdict(changed.mutant, EQUIVALENT, reason)
    open_ones = [changed for changed in left if changed.number not in verdicts]

    def look(situation: Situation, words: str) -> None:
        before = original.outcome(bench.base, original.known, situation)
        for changed in list(open_ones):
            if changed.is_same(situation):
                continue
            difference = _difference(before, changed.outcome(situation))
            if difference is not None:
                state = situation.state
                verdicts[changed.number] = Verdict(changed.mutant, SURVIVED, f"{difference}{words}", state)
                open_ones.remove(changed)

    for situation in situations:
        look(situation, ", in a state of a test that does not expect it")
    space = _space(bench, open_ones)
    states = 0
    for kinds in kinds_of_states(bench.base, bench.settings, max_failed, space):
        states += len(kinds)
        if not open_ones:
            continue
        touched = original.touched(kinds, [changed.number for changed in open_ones])
        of_data = any(changed.known != original.known for changed in open_ones)
        for case in kinds:
            if case.state not in touched:
                if not of_data:
                    continue
                original.take_from_cache(case.state)
            look(Situation(case.state), "")
    reason = f"nothing differs in {states} kinds of states"
    for changed in open_ones:
        verdicts[changed.number] = Verdict(changed.mutant, EQUIVALENT, reason)
    return [verdicts[changed.number] for changed in left], states


def _difference(before: Outcome, after: Outcome) -> str | None:
    """What a mutant makes different, in words; None: nothing."""
    if (before.conclusion is None) != (after.conclusion is None):
        return "it contradicts itself" if after.conclusion is None else "it no longer contradicts itself"
    for function in sorted({*before.changes, *after.changes}):
        one, other = before.choice(function), after.choice(function)
        if one != other:
            return f"{function}: {other}, not {one}"
    for missing in sorted(map(str, before.inferred - after.inferred)):
        return f"{missing} does not follow"
    for more in sorted(map(str, after.inferred - before.inferred)):
        return f"{more} follows"
    return None


def _space(bench: KnowledgeBase, mutants: Iterable[_Changed]) -> PolicySpace:
    """What the policy tells apart, with the numbers of mutants that can be compared with measured values."""
    space = PolicySpace.of(bench.base, bench.settings)
    measured = {bench.base.model.attributes[name] for name in space.attributes}
    numbers = set(space.numbers)
    for changed in mutants:
        old = changed.mutant.old
        if isinstance(old, Rule):
            numbers |= set(numbers_in(changed.base))
        elif old[1] != HAS_VALUE or any((old[0], IS_QA_TYPE, each) in bench.base.content.triples for each in measured):
            space = space.common(PolicySpace.of(changed.base, bench.settings))
            numbers |= set(space.numbers)
    return replace(space, numbers=tuple(sorted(numbers)))
