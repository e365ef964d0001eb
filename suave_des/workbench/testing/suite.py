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

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from suave_des.errors import InputError, KeyPath, shown
from suave_des.resources import find, shipped_folder
from suave_des.scenario.loader import Replacements
from suave_des.scenario.yamlfile import YamlDocument, read_yaml
from suave_des.workbench.knowledge_base import KnowledgeBase
from suave_des.workbench.testing.reader import RuleTest, TestReader, check_keys, texts

_FILE_KEYS: Final = ("scenario", "ontologies", "rules", "disabled_rules", "tests")


@dataclass(frozen=True)
class TestedKnowledge:
    """The knowledge base that a file of tests is about.

    Attributes:
        scenario: name or path.
        ontologies: files in place of the scenario's.
        rules: files of rules besides the scenario's.
        disabled_rules: names of rules to switch off.
    """

    scenario: str = "seams2023"
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
        check_keys(document, data, (), _FILE_KEYS)
        if not isinstance(data.get("tests"), list) or not data["tests"]:
            raise document.error("has no tests", ("tests",), "write them as a list under `tests:`")

        def files(key: str) -> tuple[Path, ...]:
            names = enumerate(texts(document, data.get(key, []), (key,)))
            return tuple(_beside(document, name, (key, at)) for at, name in names)

        scenario = data.get("scenario", TestedKnowledge.scenario)
        if not isinstance(scenario, str):
            raise document.error(f"{shown(scenario)} is not a scenario", ("scenario",), "a name or a path")
        if (path.parent / scenario).is_file():
            scenario = str(path.parent / scenario)
        disabled = texts(document, data.get("disabled_rules", []), ("disabled_rules",))
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
