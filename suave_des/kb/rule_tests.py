"""Tests of rules: read from YAML files, run, and written, as JUnit XML or as new tests.

The guide docs/guides/test-rules.md has examples, and describes all keys.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any

import yaml
from lxml import etree
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from suave_des.errors import InputError, KnowledgeError, shown, unknown
from suave_des.files import Json
from suave_des.kb.explain import RuleQuestions, verdicts
from suave_des.kb.knowledge_base import KnowledgeBase
from suave_des.kb.scale import measurements_in, parse_region
from suave_des.kb.situations import Decide, Outcome, Situation
from suave_des.kb.states import FactReader, StateBuilder, StateContent, recorded_state, state_dict
from suave_des.knowledge.ontology import Ontology
from suave_des.knowledge.pellet import ReasonerTimeoutError
from suave_des.knowledge.rdf import Triple, fact_of
from suave_des.knowledge.reasoner import regions_of
from suave_des.knowledge.state import NONE_LEFT, STAYS, Fact, KnowledgeState, exact
from suave_des.records.mission_folder import RecordedKnowledge
from suave_des.resources import DEFAULT_SCENARIO, find, shipped_folder
from suave_des.scenario.yamlfile import Layer, read_yaml, validated

#: What XML 1.0 has no place for.
_FORBIDDEN = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")
_Texts = Annotated[
    list[str], BeforeValidator(lambda given: [given] if isinstance(given, str) else given)
]
#: The arguments of KnowledgeBase.load that say which knowledge base tests are about.
Tested = Mapping[str, Any]
#: An expectation that does not hold, in words, and the fact or function that it is about.
_Unmet = tuple[str, Fact | str | None]


class _Given(StateContent):
    facts: _Texts = Field(default=[])
    mission: str | None = None
    run: int = 0
    at_s: float | None = None


class _Test(BaseModel):
    model_config = ConfigDict(extra="forbid")

    name: str = Field(min_length=1)
    given: _Given = _Given()
    follows: _Texts = []
    follows_not: _Texts = []
    decides: dict[str, str] = {}
    contradiction: bool = False


class _File(BaseModel):
    model_config = ConfigDict(extra="forbid")

    scenario: str = DEFAULT_SCENARIO
    ontologies: _Texts = []
    rules: _Texts = []
    disabled_rules: _Texts = []
    tests: tuple[_Test, ...] = Field(min_length=1)


@dataclass(frozen=True)
class RuleTest:
    """One test.

    Attributes:
        name: what it says of the rules.
        situations: one, or one for each region of measured values.
        follows: facts that must follow, or be asserted, each with its triple.
        follows_not: facts that must not.
        decides: by function, what happens to its grounding: a design, "stays" or "none left".
        contradicts: whether the situation must contradict itself.
        problem: why it cannot be asked of the knowledge base.
    """

    name: str
    file: Path
    line: int
    situations: tuple[Situation, ...] = field(default=(), repr=False)
    follows: Mapping[Fact, Triple] = field(default_factory=dict)
    follows_not: tuple[Fact, ...] = ()
    decides: Mapping[str, str] = field(default_factory=dict)
    contradicts: bool = False
    problem: str = ""


@dataclass(frozen=True)
class TestFile:
    """A file of tests, read as far as that is possible without its knowledge base."""

    __test__ = False  # pytest takes it for a test otherwise
    document: Layer
    content: _File

    @classmethod
    def read(cls, path: Path) -> TestFile:
        """Read a file of tests.

        Raises:
            InputError: it cannot be read, or a key or value is wrong, with line and key.
        """
        document = read_yaml(path)
        content = validated(document, _File)
        for number, test in enumerate(content.tests):
            if not (test.follows or test.follows_not or test.decides or test.contradiction):
                remedy = "give one of follows, follows_not, decides, contradiction"
                raise document.error("this test expects nothing", ("tests", number), remedy)
        return cls(document, content)

    @property
    def about(self) -> Tested:
        """The knowledge base that its tests are about; paths are relative to the file.

        Raises:
            InputError: there is no such file, with line and key.
        """
        content, folder = self.content, self.document.path.parent

        def files(key: str) -> Iterator[Path]:
            for at, name in enumerate(getattr(content, key)):
                try:
                    yield find(name, "ontology", beside=folder)
                except InputError as error:
                    raise self.document.error(
                        f"{name}: {error.problem}", (key, at), error.remedy
                    ) from None

        beside = folder / content.scenario
        return {
            "scenario": str(beside) if beside.is_file() else content.scenario,
            "ontologies": list(files("ontologies")),
            "rules": list(files("rules")),
            "disabled_rules": content.disabled_rules,
        }

    def tests(self, knowledge: KnowledgeBase) -> Iterator[RuleTest]:
        """Look up all names of the tests in a knowledge base; one that it does not have is a test's
        problem.
        """
        for number, content in enumerate(self.content.tests):
            test = RuleTest(
                content.name.strip(),
                self.document.path,
                self.document.place(("tests", number)).line,
            )
            try:
                yield replace(test, **_looked_up(content, knowledge, self.document.path.parent))
            except InputError as error:
                yield replace(test, problem=str(error))


def shipped_tests() -> tuple[Path, ...]:
    """The tests of the shipped rules."""
    return tuple(sorted((shipped_folder("ontology") / "tests").glob("*.yaml")))


def _looked_up(test: _Test, knowledge: KnowledgeBase, folder: Path) -> Json:
    """What a test is about in terms of a knowledge base."""
    base, reader = knowledge.base, FactReader(knowledge.base)
    reader.declare(test.given.facts)
    triples = tuple(map(reader.triple, test.given.facts))
    return {
        "situations": tuple(
            Situation(each, triples, words)
            for each, words in _states(test.given, knowledge, folder)
        ),
        "follows": {reader.fact(text): reader.triple(text) for text in test.follows},
        "follows_not": tuple(map(reader.fact, test.follows_not)),
        "decides": {name: _choice(base, name, words) for name, words in test.decides.items()},
        "contradicts": test.contradiction,
    }


def _choice(base: Ontology, function: str, words: str) -> str:
    if function not in base.functions:
        raise unknown(f"there is no function {shown(function)}", function, base.functions)
    known = (*base.designs(function), STAYS, NONE_LEFT)
    choice = words.strip()
    if choice not in known:
        raise unknown(f"{function} has no function design {shown(choice)}", choice, known)
    return choice


def _states(
    given: _Given, knowledge: KnowledgeBase, folder: Path
) -> Iterator[tuple[KnowledgeState, str]]:
    """The states of a test, one for each region of measured values, with words for it."""
    builder = StateBuilder(knowledge.base, knowledge.settings)
    if given.mission is not None and given.at_s is not None:
        builder.add_state(recorded_state(folder / given.mission, given.at_s, given.run))
    elif (given.mission, given.at_s) != (None, None):
        raise InputError(
            "mission and at_s must be given together", remedy="mission: FOLDER, and at_s: 53.7"
        )
    regions = {}
    for kind, name, value, _ in given.parts():
        region = parse_region(value) if kind == "measurements" and isinstance(value, str) else None
        builder.add(kind, name, value if region is None else 0)
        if region is not None:
            regions[name] = region
    state = builder.state()
    for values, words in measurements_in(knowledge.base, regions):
        yield _measuring(state, values), words


def _measuring(state: KnowledgeState, values: Mapping[str, Decimal | None]) -> KnowledgeState:
    """A state with other measured values; None: it is not measured."""
    every = sorted({**dict(state.measurements), **values}.items())
    known = ((name, exact(value)) for name, value in every if value is not None)
    return replace(state, measurements=tuple(known))


@dataclass(frozen=True)
class TestResult:
    """What came of a test, and how long it took, explanations included.

    Attributes:
        failures: the lines of each expectation that does not hold: what is wrong, then in which
            state, and why.
    """

    __test__ = False  # pytest takes it for a test otherwise
    test: RuleTest
    failures: tuple[tuple[str, ...], ...]
    duration_s: float

    @property
    def passed(self) -> bool:
        """Whether all that was expected is so."""
        return not self.failures


def run_test(knowledge: KnowledgeBase, test: RuleTest) -> TestResult:
    """Run a test on a knowledge base, and explain what fails in the first situation in which
    something does.

    Raises:
        ReasonerTimeoutError: the reasoner takes too long.
    """
    began = time.perf_counter()
    found: list[tuple[str, ...]] = [(test.problem,)] if test.problem else []
    for situation in test.situations:
        for what, about in _unmet(test, situation, knowledge.outcome):
            where = f" ({situation.ranges})" if situation.ranges else ""
            because = (f"  {line}" for line in _because(knowledge, test, situation, about))
            found.append((what, f"  in the state{where}: {situation.state}", *because))
        if found:
            break
    return TestResult(test, tuple(found), time.perf_counter() - began)


def passes(test: RuleTest, outcome: Decide) -> bool:
    """Whether all that a test expects is so; nothing is explained."""
    return not any(True for situation in test.situations for _ in _unmet(test, situation, outcome))


def _unmet(test: RuleTest, situation: Situation, outcome_of: Decide) -> Iterator[_Unmet]:
    """Each expectation that does not hold in a situation."""
    try:
        outcome = outcome_of(situation)
    except ReasonerTimeoutError:
        raise  # Pellet is still at work: no further state can be decided
    except KnowledgeError as error:
        yield f"the state cannot be decided: {error}", None
        return
    if outcome.reasoning is not None:
        yield from _unmet_by(test, situation.state, outcome)
    elif not test.contradicts:
        yield f"the situation contradicts itself: {outcome.contradiction}", None


def _unmet_by(test: RuleTest, state: KnowledgeState, outcome: Outcome) -> Iterator[_Unmet]:
    """Each expectation that what follows and is decided in a state does not meet."""
    if test.contradicts:
        yield "the situation does not contradict itself", None
    for fact in test.follows:
        if fact not in outcome.known:
            yield f"{fact} does not follow", fact
    for fact in test.follows_not:
        if fact in outcome.known:
            yield f"{fact} follows", fact
    for function, wanted in test.decides.items():
        happens = outcome.choice(function)
        as_wanted = [happens]
        present = state.grounded(function)
        if happens == STAYS and present:
            as_wanted.append(present)
            happens = f"{present} stays"
        if wanted not in as_wanted:
            yield f"{function}: {happens}, not {wanted}", function


def _because(
    knowledge: KnowledgeBase, test: RuleTest, situation: Situation, about: Fact | str | None
) -> Iterator[str]:
    """Why a fact follows or does not, or a function is decided as it is."""
    state = situation.state
    try:
        if situation.facts:
            knowledge = knowledge.changed(knowledge.base.with_facts(situation.facts))
        if isinstance(about, Fact) and about in test.follows:
            yield from _why_missing(knowledge, test.follows[about], state)
        elif isinstance(about, Fact):
            yield from knowledge.explain(state, str(about)).lines()
        elif about is not None:
            yield from _why_decided(knowledge, about, state)
    except InputError as error:
        yield str(error)


def _why_missing(knowledge: KnowledgeBase, triple: Triple, state: KnowledgeState) -> Iterator[str]:
    """Why the rules that come nearest do not conclude a fact."""
    answers = RuleQuestions(knowledge.base).missing(triple, state)
    near = min((answer.failing for answer in answers if answer.failing), default=0)
    yield from (str(answer) for answer in answers if answer.failing in (0, near))
    if not answers:
        yield f"no rule concludes {fact_of(triple, knowledge.base.names)}"


def _why_decided(knowledge: KnowledgeBase, function: str, state: KnowledgeState) -> Iterator[str]:
    """What the planner made of each design of a function."""
    reasoning = knowledge.infer(state)
    decisions = [each for each in reasoning.plan.decisions if each.function == function]
    for decision in decisions:
        yield from map(str, verdicts(knowledge.base, reasoning, decision))
    if not decisions:
        yield f"the objective of {function} requires no adaptation"


def junit_xml(results: Sequence[TestResult]) -> bytes:
    """Return a test suite for each file, in the form that pytest writes."""
    root = etree.Element("testsuites", name="suave-des kb test")
    for file in dict.fromkeys(result.test.file for result in results):
        own = [result for result in results if result.test.file == file]
        counts = {
            "name": str(file),
            "time": f"{sum(result.duration_s for result in own):.3f}",
            "tests": str(len(own)),
            "failures": str(sum(not each.passed for each in own)),
            "errors": "0",
            "skipped": "0",
        }
        etree.SubElement(root, "testsuite", counts).extend(map(_case, own))
    return etree.tostring(root, xml_declaration=True, encoding="utf-8", pretty_print=True)


def _case(result: TestResult) -> etree._Element:
    test = result.test
    parts = {"classname": str(test.file), "name": _clean(test.name), "file": str(test.file)}
    parts |= {"line": str(test.line), "time": f"{result.duration_s:.3f}"}
    case = etree.Element("testcase", parts)
    if not result.passed:
        message = _clean("; ".join(what for what, *_ in result.failures))
        text = _clean("\n".join(line for each in result.failures for line in each))
        etree.SubElement(case, "failure", message=message).text = text
    return case


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("?", text)


def tests_text(
    about: Tested,
    knowledge: KnowledgeBase,
    states: Iterable[tuple[str, KnowledgeState]],
    comment: str,
) -> str:
    """Write tests that expect what follows in states now.

    Args:
        about: the knowledge base, as the file names it; `knowledge` is the same, loaded.
        states: each with the name of its test.

    Raises:
        KnowledgeError: the reasoner takes too long.
    """
    content: dict[str, object] = {
        key: value if isinstance(value, str) else list(map(str, value))
        for key, value in about.items()
        if value
    }
    content["tests"] = [
        {"name": name, "given": _given(state)}
        | _expected(state, knowledge.outcome(Situation(state)))
        for name, state in states
    ]
    text = yaml.safe_dump(
        content, sort_keys=False, default_flow_style=None, allow_unicode=True, width=10**6
    )
    return f"# {comment}\n{text}"


def _given(state: KnowledgeState) -> Json:
    given = {kind: content for kind, content in state_dict(state).items() if content}
    for name, value in state.measurements:  # numbers as numbers, where that is exact
        if Decimal(repr(float(value))) == value:
            given["measurements"][name] = float(value)
    return given


def _expected(state: KnowledgeState, outcome: Outcome) -> dict[str, object]:
    if outcome.reasoning is None:
        return {"contradiction": True}
    follows = {"follows": sorted(map(str, outcome.inferred))} if outcome.inferred else {}
    return {
        **follows,
        "decides": {each.function: outcome.choice(each.function) for each in state.objectives},
    }


def mission_states(
    mission: RecordedKnowledge, base: Ontology
) -> Iterator[tuple[float, KnowledgeState]]:
    """The states of a recorded mission, each with its time in s, one for each kind that the rules
    can tell apart.
    """
    regions = regions_of(base)
    kinds = {regions.key(record.state): record for record in reversed(mission.records)}
    for record in sorted(kinds.values(), key=attrgetter("t_s")):
        yield record.t_s, replace(record.state, measured_since=None)


def mission_knowledge(mission: RecordedKnowledge) -> Tested:
    """The knowledge base of a recorded mission, as a file of tests names it."""
    scenario, knowledge = mission.scenario, mission.scenario.knowledge
    try:
        find(scenario.name, "scenarios")
        name = scenario.name
    except InputError:
        name = DEFAULT_SCENARIO
    ontologies = [find(each, "ontology").absolute() for each in knowledge.ontologies]
    if all(file.parent == shipped_folder("ontology") for file in ontologies):
        ontologies = []
    return {
        "scenario": name,
        "ontologies": ontologies,
        "rules": [find(each, "ontology").absolute() for each in knowledge.rules],
        "disabled_rules": list(knowledge.disabled_rules),
    }
