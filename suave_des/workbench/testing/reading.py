"""Read tests of rules from YAML files.

    rules: [spare.swrl]
    tests:
    - name: a search that is too high for the visibility is in error
      given:
        groundings: {f_generate_search_path: fd_spiral_high}
        measurements: {water_visibility: "< 3.25"}
      follows: ["fg_status(fg_spiral_high, IN_ERROR_NFR)"]
      decides: {f_generate_search_path: fd_spiral_medium}

The guide docs/guides/test-rules.md describes all keys.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from suave_des.errors import InputError, KeyPath, did_you_mean, shown
from suave_des.knowledge.deliberation import NONE_LEFT, STAYS
from suave_des.knowledge.state import Fact, KnowledgeState
from suave_des.resources import DEFAULT_SCENARIO, find, shipped_folder
from suave_des.scenario.loader import Replacements
from suave_des.scenario.yamlfile import YamlDocument, read_yaml
from suave_des.workbench.fact_reader import FactReader
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.prover import Situation
from suave_des.workbench.ranges import ValueRange, measurements_in, parse_region
from suave_des.workbench.state_input import STATE_KEYS, StateBuilder, recorded_state, recorded_states

_FILE_KEYS: Final = ("scenario", "ontologies", "rules", "disabled_rules", "tests")
_TEST_KEYS: Final = ("name", "given", "follows", "follows_not", "decides", "contradiction", "without", "changes")
_EXPECTATIONS: Final = ("follows", "follows_not", "decides", "contradiction", "changes")
_GIVEN_KEYS: Final = (*STATE_KEYS, "facts", "mission", "run", "at_s")


@dataclass(frozen=True)
class TestedKnowledge:
    """The knowledge base that a file of tests is about.

    Attributes:
        scenario: name or path.
        ontologies: files in place of the scenario's.
        rules: files of rules besides the scenario's.
        disabled_rules: names of rules to disable.
    """

    scenario: str = DEFAULT_SCENARIO
    ontologies: tuple[Path, ...] = ()
    rules: tuple[Path, ...] = ()
    disabled_rules: tuple[str, ...] = ()

    def with_replacements(self, scenario: str | None, more: Replacements) -> TestedKnowledge:
        """Replace scenario and ontologies where others are given, and add rules and names of disabled ones."""
        ontologies = tuple(map(Path, more.get("ontologies", ())))
        return TestedKnowledge(
            scenario or self.scenario,
            ontologies or self.ontologies,
            (*self.rules, *map(Path, more.get("rules", ()))),
            (*self.disabled_rules, *more.get("disabled_rules", ())),
        )

    def load(self, time_limit_s: float, values: Mapping[str, Any] | None = None) -> KnowledgeBase:
        """Load the knowledge base.

        Args:
            time_limit_s: for each inference.
            values: new values of the scenario, by key path.

        Raises:
            InputError: a file or name cannot be used.
        """
        return KnowledgeBase.load(
            self.ontologies,
            scenario=self.scenario,
            rules=self.rules,
            disabled_rules=self.disabled_rules,
            values=values,
            time_limit_s=time_limit_s,
        )


@dataclass(frozen=True)
class TestFile:
    """A file of tests, read as far as that is possible without its knowledge base.

    Attributes:
        document: its content.
        knowledge: what it is about.
    """

    __test__ = False  # pytest takes it for a test otherwise
    document: YamlDocument
    knowledge: TestedKnowledge

    @classmethod
    def read(cls, path: Path) -> TestFile:
        """Read a file of tests.

        Raises:
            InputError: it cannot be read, or has other keys at its top, with line and key.
        """
        document = read_yaml(path)
        data = document.data
        _check_keys(document, data, (), _FILE_KEYS)
        if not isinstance(data.get("tests"), list) or not data["tests"]:
            raise document.error("has no tests", ("tests",), "write them as a list under `tests:`")

        def files(key: str) -> tuple[Path, ...]:
            names = enumerate(_texts_at(document, data.get(key, []), (key,)))
            return tuple(_beside(document, name, (key, at)) for at, name in names)

        scenario = data.get("scenario", TestedKnowledge.scenario)
        if not isinstance(scenario, str):
            raise document.error(f"{shown(scenario)} is not a scenario", ("scenario",), "a name or a path")
        if (path.parent / scenario).is_file():
            scenario = str(path.parent / scenario)
        disabled = _texts_at(document, data.get("disabled_rules", []), ("disabled_rules",))
        return cls(document, TestedKnowledge(scenario, files("ontologies"), files("rules"), tuple(disabled)))

    def tests(self, bench: KnowledgeBase) -> tuple[RuleTest, ...]:
        """Read the tests themselves, with all their names looked up in a knowledge base.

        Raises:
            InputError: a name is unknown, or something is not as it must be, with line and key.
        """
        count = len(self.document.data["tests"])
        return tuple(TestReader.of(self.document, bench, number).test() for number in range(count))


def shipped_tests() -> tuple[Path, ...]:
    """The tests of the shipped rules."""
    return tuple(sorted((shipped_folder("ontology") / "tests").glob("*.yaml")))


def _beside(document: YamlDocument, name: str, place: KeyPath) -> Path:
    try:
        return find(name, "ontology", beside=document.path.parent)
    except InputError as error:
        raise document.error(f"{name}: {error.problem}", place, error.remedy) from None


@dataclass(frozen=True)
class RuleTest:
    """One test.

    Attributes:
        name: what it says of the rules.
        file, line: where it is.
        situations: one, or one for each region of measured values.
        follows: facts that must follow, or be asserted.
        follows_not: facts that must not.
        decides: (function, what happens to its grounding: a design, "stays" or "none left").
        contradicts: whether the situation must contradict itself.
        without: names of rules of which it says what they change.
        changes: (function, what happens without these rules, what happens with them).
    """

    name: str
    file: Path
    line: int
    situations: tuple[Situation, ...] = field(repr=False)
    follows: tuple[Fact, ...] = ()
    follows_not: tuple[Fact, ...] = ()
    decides: tuple[tuple[str, str], ...] = ()
    contradicts: bool = False
    without: tuple[str, ...] = ()
    changes: tuple[tuple[str, str, str], ...] = ()


@dataclass(frozen=True)
class TestReader:
    """Reads one test of a file; errors have its line and key.

    Attributes:
        document: the file.
        bench: the knowledge base in which names are looked up.
        place: of the test in the file.
        content: of the test.
        facts: reads facts, with the new individuals of this test.
    """

    __test__ = False  # pytest takes it for a test otherwise
    document: YamlDocument
    bench: KnowledgeBase
    place: KeyPath
    content: Mapping[str, Any]
    facts: FactReader

    @classmethod
    def of(cls, document: YamlDocument, bench: KnowledgeBase, number: int) -> TestReader:
        """Start with the test of a number, from 0."""
        place = ("tests", number)
        content = document.data["tests"][number]
        _check_keys(document, content, place, _TEST_KEYS)
        return cls(document, bench, place, content, FactReader(bench.base))

    def test(self) -> RuleTest:
        """Read it.

        Raises:
            InputError: a name is unknown, or something is not as it must be.
        """
        content = self.content
        name = content.get("name")
        if not isinstance(name, str) or not name.strip():
            raise self.error("this test has no name", (), "say in `name:` what the rules must do")
        if not any(content.get(key) for key in _EXPECTATIONS):
            raise self.error("this test expects nothing", (), f"give one of {', '.join(_EXPECTATIONS)}")
        contradicts = content.get("contradiction", False)
        if not isinstance(contradicts, bool):
            raise self.error(f"{shown(contradicts)} is neither true nor false", ("contradiction",))
        without = self._without()
        return RuleTest(
            name=name.strip(),
            file=self.document.path,
            line=self.document.line(self.place),
            situations=self._situations(),
            follows=self._facts("follows"),
            follows_not=self._facts("follows_not"),
            decides=tuple(self._decisions()),
            contradicts=contradicts,
            without=without,
            changes=tuple(self._changes()),
        )

    def error(self, problem: str, place: KeyPath, remedy: str | None = None) -> InputError:
        """An error about a part of the test."""
        return self.document.error(problem, (*self.place, *place), remedy)

    @contextmanager
    def _at(self, *place: str | int) -> Iterator[None]:
        """Give errors the place of a part of the test."""
        try:
            yield
        except InputError as error:
            if error.file is not None:
                raise
            raise self.error(error.problem, place, error.remedy) from None

    def _texts(self, *place: str) -> list[str]:
        content: Any = self.content
        for key in place:
            content = (content or {}).get(key)
        return _texts_at(self.document, content or [], (*self.place, *place))

    def _mapping(self, key: str, example: str) -> Iterator[tuple[str, Any]]:
        content = self.content.get(key) or {}
        if not isinstance(content, Mapping):
            raise self.error(f"{shown(content)} is not a mapping", (key,), example)
        for name, value in content.items():
            with self._at(key, name):
                if name not in (known := self.bench.base.functions):
                    raise InputError(f"there is no function {shown(name)}", remedy=did_you_mean(name, known))
            yield name, value

    def _facts(self, key: str) -> tuple[Fact, ...]:
        found = []
        for at, text in enumerate(self._texts(key)):
            with self._at(key, at):
                found.append(self.facts.fact(text))
        return tuple(found)

    def _without(self) -> tuple[str, ...]:
        names = self._texts("without")
        known = sorted({rule.name for rule in self.bench.base.content.enabled_rules})
        for name in names:
            if name not in known:
                raise self.error(f"there is no enabled rule {shown(name)}", ("without",), did_you_mean(name, known))
        if bool(names) != bool(self.content.get("changes")):
            remedy = "without: RULE, and changes: {FUNCTION: BEFORE -> AFTER}"
            raise self.error("`without` and `changes` must be given together", (), remedy)
        return tuple(names)

    def _decisions(self) -> Iterator[tuple[str, str]]:
        for function, words in self._mapping("decides", "decides: {FUNCTION: DESIGN}"):
            yield function, self._choice(function, words, ("decides", function))

    def _changes(self) -> Iterator[tuple[str, str, str]]:
        example = "changes: {FUNCTION: BEFORE -> AFTER}"
        for function, words in self._mapping("changes", example):
            place = ("changes", function)
            sides = words.split("->") if isinstance(words, str) else ()
            if len(sides) != 2:
                raise self.error(f"expected a change, BEFORE -> AFTER, got {shown(words)}", place, example)
            before, after = (self._choice(function, side, place) for side in sides)
            yield function, before, after

    def _choice(self, function: str, words: Any, place: KeyPath) -> str:
        known = (*self.bench.base.designs(function), STAYS, NONE_LEFT)
        choice = words.strip() if isinstance(words, str) else words
        if choice not in known:
            raise self.error(f"{function} has no function design {shown(words)}", place, did_you_mean(words, known))
        return str(choice)

    def _situations(self) -> tuple[Situation, ...]:
        given = self.content.get("given") or {}
        _check_keys(self.document, given, (*self.place, "given"), _GIVEN_KEYS)
        asserted = self._texts("given", "facts")
        triples = []
        for at, text in enumerate(asserted):
            with self._at("given", "facts", at):
                self.facts.declare([text])
        for at, text in enumerate(asserted):
            with self._at("given", "facts", at):
                triples.append(self.facts.triple(text))
        return tuple(Situation(state, tuple(triples), words) for state, words in self._states(given))

    def _states(self, given: Mapping[str, Any]) -> Iterator[tuple[KnowledgeState, str]]:
        builder = StateBuilder(self.bench.base, self.bench.settings)
        if "mission" in given:
            self._add_recorded(builder, given)
        elif stray := given.keys() & {"run", "at_s"}:
            raise self.error(f"{min(stray)} without a mission", ("given", min(stray)), "mission: FOLDER")
        regions: dict[str, ValueRange] = {}
        for kind in STATE_KEYS:
            content = given.get(kind) or {}
            if isinstance(content, list) and kind == "objectives":
                content = dict.fromkeys(content)
            if not isinstance(content, Mapping):
                raise self.error(f"{shown(content)} is not a mapping", ("given", kind), "write NAME: VALUE")
            for name, value in content.items():
                with self._at("given", kind, name):
                    region = parse_region(value) if kind == "measurements" and isinstance(value, str) else None
                    builder.add(kind, name, 0 if region else value)
                    if region:
                        regions[name] = region
        with self._at("given"):
            for values, words in measurements_in(self.bench.base, regions):
                for name, value in values.items():
                    if value is None:
                        builder.measurements.pop(name, None)
                    else:
                        builder.add("measurements", name, value)
                yield builder.state(), words

    def _add_recorded(self, builder: StateBuilder, given: Mapping[str, Any]) -> None:
        """Begin with the state that a mission recorded last at or before a time."""
        folder, at_s = given["mission"], given.get("at_s")
        if not isinstance(folder, str):
            raise self.error(f"{shown(folder)} is not a folder", ("given", "mission"), "one that run --out wrote")
        if isinstance(at_s, bool) or not isinstance(at_s, int | float):
            raise self.error("the mission time is missing", ("given", "mission"), "at_s: 53.7")
        with self._at("given", "mission"):
            records = recorded_states(self.document.path.parent / folder, given.get("run"))
            builder.add_state(recorded_state(records, at_s))


def _check_keys(document: YamlDocument, content: Any, place: KeyPath, known: Sequence[str]) -> None:
    """Check that a part of a file is a mapping of known keys.

    Raises:
        InputError: it is not, with line and key.
    """
    if not isinstance(content, Mapping):
        raise document.error(f"{shown(content)} is not a mapping", place, f"keys: {', '.join(known)}")
    for key in content:
        if key not in known:
            raise document.error(f"{shown(key)} is not a known key here", (*place, key), did_you_mean(key, known))


def _texts_at(document: YamlDocument, content: Any, place: KeyPath) -> list[str]:
    """Read a text, or a list of texts.

    Raises:
        InputError: it is something else, with line and key.
    """
    given = [content] if isinstance(content, str) else content
    if not isinstance(given, list) or not all(isinstance(each, str) for each in given):
        raise document.error(f"{shown(content)} is not a list of texts", place, 'such as ["one", "another"]')
    return given
