"""Run tests of rules, explain what fails, and write the results as JUnit XML, which continuous integration reads."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from lxml import etree

from suave_des.errors import InputError, KnowledgeError
from suave_des.knowledge.deliberation import STAYS
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.state import Fact
from suave_des.workbench.fact_reader import NEW_INDIVIDUAL
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.prover import Outcome, Prover, Situation
from suave_des.workbench.reasons.explain import explain
from suave_des.workbench.reasons.why_not import RuleQuestions
from suave_des.workbench.testing.reading import RuleTest

#: What XML 1.0 has no place for.
_FORBIDDEN: Final = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


@dataclass(frozen=True)
class Failure:
    """An expectation that does not hold.

    Attributes:
        what: in one line.
        situation: the first one in which it does not hold.
        fact: the fact that it is about.
        function: the function that it is about.
        because: why, as lines.
    """

    what: str
    situation: Situation
    fact: Fact | None = None
    function: str | None = None
    because: tuple[str, ...] = ()


@dataclass(frozen=True)
class TestResult:
    """What came of a test.

    Attributes:
        failures: none if it passed.
        duration_s: how long it took, explanations included.
    """

    __test__ = False  # pytest takes it for a test otherwise
    test: RuleTest
    failures: tuple[Failure, ...]
    duration_s: float = field(compare=False)

    @property
    def passed(self) -> bool:
        """Whether all that was expected is so."""
        return not self.failures


@dataclass(frozen=True)
class Runner:
    """Runs tests on one knowledge base.

    Attributes:
        bench: the knowledge base.
        base: its ontologies and rules, or a changed form of them.
        outcome: concludes from these what follows in a situation.

    Example:
        >>> runner = Runner.of(KnowledgeBase.load())
        >>> [result.passed for result in map(runner.run, tests)]
        [True, True]
    """

    bench: KnowledgeBase
    base: Ontology = field(repr=False)
    outcome: Callable[[Situation], Outcome] = field(repr=False)
    _without: dict[tuple[str, ...], Prover] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, bench: KnowledgeBase, base: Ontology | None = None) -> Runner:
        """Load a knowledge base, or a changed form of it, into Pellet.

        Raises:
            KnowledgeError: Pellet cannot use it.
        """
        prover = Prover.of(bench, base)
        return cls(bench, prover.base, prover.outcome)

    def run(self, test: RuleTest) -> TestResult:
        """Run a test, and explain what fails.

        Raises:
            KnowledgeError: the reasoner takes too long.
        """
        began = time.perf_counter()
        problems = (list(self._problems(test, situation)) for situation in test.situations)
        first = next(filter(None, problems), [])
        failures = tuple(replace(each, because=tuple(self._because(each))) for each in first)
        return TestResult(test, failures, time.perf_counter() - began)

    def passes(self, test: RuleTest) -> bool:
        """Whether all that a test expects is so; nothing is explained."""
        return not any(True for situation in test.situations for _ in self._problems(test, situation))

    def _problems(self, test: RuleTest, situation: Situation) -> Iterator[Failure]:
        """Each expectation that does not hold in a situation."""
        outcome = self.outcome(situation)
        if outcome.conclusion is None:
            if not test.contradicts:
                yield Failure(f"the situation contradicts itself: {outcome.contradiction}", situation)
            return
        if test.contradicts:
            yield Failure("the situation does not contradict itself", situation)
        for fact in test.follows:
            if fact not in outcome.known:
                yield Failure(f"{fact} does not follow", situation, fact)
        for fact in test.follows_not:
            if fact in outcome.known:
                yield Failure(f"{fact} follows", situation, fact)
        for function, wanted in test.decides:
            chosen = outcome.choice(function)
            if not _same(chosen, wanted, situation, function):
                what = f"{function}: {_words(chosen, situation, function)}, not {wanted}"
                yield Failure(what, situation, function=function)
        if test.changes:
            yield from self._changes(test, situation, outcome)

    def _changes(self, test: RuleTest, situation: Situation, outcome: Outcome) -> Iterator[Failure]:
        without = self._prover_without(test.without).outcome(situation)
        names = ", ".join(test.without)
        for function, before, after in test.changes:
            for chosen, wanted, what in (
                (without.choice(function), before, f"without {names}"),
                (outcome.choice(function), after, f"with {names}"),
            ):
                if not _same(chosen, wanted, situation, function):
                    problem = f"{function}, {what}: {_words(chosen, situation, function)}, not {wanted}"
                    yield Failure(problem, situation, function=function)

    def _prover_without(self, names: tuple[str, ...]) -> Prover:
        """The knowledge base without some rules."""
        if names not in self._without:
            kept = (rule for rule in self.base.rules if rule.name not in names)
            self._without[names] = Prover.of(self.bench, self.base.with_rules(kept))
        return self._without[names]

    def _because(self, failure: Failure) -> Iterator[str]:
        """Why something follows or does not, or is decided as it is."""
        fact, function = failure.fact, failure.function
        base = self.base.with_facts(failure.situation.facts)
        state, improves = failure.situation.state, self.bench.settings.improves_exceeded
        try:
            if fact is not None and failure.what.endswith("does not follow"):
                yield from _missing(base, failure.situation, fact)
            elif fact is not None:
                yield from explain(base, state, str(fact), improves).lines()
            elif function is not None:
                decisions = explain(base, state, "", improves).decisions
                found = [each for each in decisions if each.function == function]
                for decision in found:
                    yield from (f"{each.design}: {each.verdict}: {each.reason}" for each in decision.candidates)
                if not found:
                    yield f"the objective of {function} requires no adaptation"
        except (InputError, KnowledgeError) as error:
            yield str(error)


def _missing(base: Ontology, situation: Situation, fact: Fact) -> Iterator[str]:
    """Why each rule that could conclude a fact does not: of those whose atoms fail, the ones that lack least."""
    named = {base.names.short(iri): iri for iri in base.vocabulary.kinds}
    subject = named.get(fact.subject, NEW_INDIVIDUAL + fact.subject)
    answers = RuleQuestions(base).missing(fact, subject, situation.state)
    near = min((answer.failing for answer in answers if answer.failing), default=0)
    yield from (str(answer) for answer in answers if answer.failing in (0, near))
    if not answers:
        yield f"no rule concludes {fact}"


def _same(chosen: str, wanted: str, situation: Situation, function: str) -> bool:
    """Whether two outcomes leave a function with the same design."""
    present = situation.state.grounded(function)
    return chosen == wanted or (chosen == STAYS and wanted == present)


def _words(chosen: str, situation: Situation, function: str) -> str:
    present = situation.state.grounded(function)
    return f"{present} stays" if chosen == STAYS and present else chosen


def junit_xml(results: Sequence[TestResult]) -> bytes:
    """Return a test suite for each file, in the form that pytest writes."""
    root = etree.Element("testsuites", name="suave-des kb test")
    for file in dict.fromkeys(result.test.file for result in results):
        own = [result for result in results if result.test.file == file]
        suite = etree.SubElement(
            root,
            "testsuite",
            name=str(file),
            tests=str(len(own)),
            failures=str(sum(not result.passed for result in own)),
            errors="0",
            skipped="0",
            time=f"{sum(result.duration_s for result in own):.3f}",
        )
        for result in own:
            test = result.test
            case = etree.SubElement(
                suite,
                "testcase",
                classname=str(file),
                name=_clean(test.name),
                file=str(file),
                line=str(test.line),
                time=f"{result.duration_s:.3f}",
            )
            if not result.passed:
                message = _clean("; ".join(failure.what for failure in result.failures))
                element = etree.SubElement(case, "failure", message=message)
                element.text = _clean("\n".join(line for each in result.failures for line in failure_lines(each)))
    return etree.tostring(root, xml_declaration=True, encoding="utf-8", pretty_print=True)


def failure_lines(failure: Failure) -> list[str]:
    """A failure: what, in which situation, and why."""
    situation = failure.situation
    where = f" ({situation.ranges})" if situation.ranges else ""
    return [failure.what, f"  in the state{where}: {situation.state}", *(f"  {line}" for line in failure.because)]


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("?", text)
