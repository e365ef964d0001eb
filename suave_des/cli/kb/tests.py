"""suave-des kb test: run tests of rules, measure what they cover, and write new ones."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.text import Text

from suave_des.cli.console import counted, errors, output
from suave_des.cli.kb.options import MaxFailed, TimeLimitS, shown
from suave_des.cli.options import KnowledgeFiles, argument, flag, option
from suave_des.errors import InputError, number_of, unknown
from suave_des.errors import shown as quoted
from suave_des.files import check_output_file, write_files
from suave_des.resources import shipped_folder

if TYPE_CHECKING:
    from suave_des.kb.knowledge_base import KnowledgeBase
    from suave_des.kb.rule_tests import RuleTest, Tested, TestResult

    Suite = tuple[Tested, KnowledgeBase, list[RuleTest]]

FAILED = 1
"""Exit status when a test fails."""
_WIDTH = 80


@dataclass(frozen=True)
class TestOptions(KnowledgeFiles):
    """Options that replace or add to what the files of tests say of their knowledge base."""

    scenario: Annotated[
        str | None,
        option("Scenario instead of the one that files name.", "SCENARIO"),
    ] = None
    time_limit: TimeLimitS = 60.0

    def apply(self, about: Tested) -> Tested:
        """Replace and add to what a file says."""
        return {
            "scenario": self.scenario or about["scenario"],
            "ontologies": self.ontology or about["ontologies"],
            "rules": [*about["rules"], *(self.rules or ())],
            "disabled_rules": [*about["disabled_rules"], *(self.disable_rule or ())],
        }

    def check_named(self) -> None:
        """Check that tests that are written can name their knowledge base."""
        if self.set:
            problem = "tests that are written name a scenario, not values of it"
            remedy = "write a scenario with `base` and these values, and name it with --scenario"
            raise InputError(problem, place="--set", remedy=remedy)

    def load(self, about: Tested) -> KnowledgeBase:
        """Load a knowledge base."""
        from suave_des.kb.knowledge_base import KnowledgeBase

        return KnowledgeBase.load(**about, values=self.values, time_limit_s=self.time_limit)


@dataclass(frozen=True)
class MutationOptions:
    """Options of mutation testing."""

    mutate: Annotated[
        bool,
        flag("--mutate", "Make small mistakes in rules; report those that no test notices."),
    ] = False
    mutants: Annotated[
        int | None,
        option("Number of mutants; by default all.", "N", min=1),
    ] = None
    only: Annotated[
        list[str] | None,
        option("Only mutants of this rule; repeatable.", "NAME"),
    ] = None
    max_failed: MaxFailed = 1

    @property
    def is_wanted(self) -> bool:
        """Whether rules are to be mutated."""
        return self.mutate or self.mutants is not None


def test(
    options: TestOptions,
    mutation: MutationOptions,
    files: Annotated[
        list[Path] | None,
        argument("Tests in YAML; by default those of the shipped rules.", "FILE"),
    ] = None,
    select: Annotated[
        str | None,
        option("Only tests with this text in their name.", "TEXT", "-k"),
    ] = None,
    junit_xml: Annotated[
        Path | None,
        option("Write the results as JUnit XML.", "FILE", "--junit-xml", "--junitxml"),
    ] = None,
    coverage: Annotated[bool, flag("--coverage", "Show what the tests cover.")] = False,
    from_mission: Annotated[
        Path | None,
        option("Write a recorded mission's decisions as tests.", "DIR"),
    ] = None,
    write: Annotated[Path | None, option("File for the tests.", "FILE")] = None,
) -> None:
    """Test rules: what must follow in a state, what must not, and what is decided.

    Exit status: 0 all tests pass; 1 one fails; 2 something cannot be read.
    """
    for file in filter(None, (junit_xml, write)):
        check_output_file(file, overwrite=file == junit_xml)
    if from_mission is not None:
        options.check_named()
        _write_mission(from_mission, write, options)
        return
    if write is not None:
        options.check_named()
        if not coverage:
            remedy = "with --from-mission DIR, or --coverage"
            raise InputError("nothing to write", place="--write", remedy=remedy)
    began = time.perf_counter()
    suites = _suites(options, files)
    console = output()
    results = _run(console, suites, select)
    _print_failures(console, results)
    if junit_xml is not None:
        from suave_des.kb.rule_tests import junit_xml as as_junit_xml

        write_files(junit_xml.parent, {junit_xml.name: as_junit_xml(results)})
    all_passed = _print_summary(console, results, time.perf_counter() - began)
    if coverage:
        _cover(suites, mutation.max_failed, write)
    if all_passed:
        _mutate(console, suites, mutation)
        return
    if mutation.is_wanted:
        why = "every mutant would count as killed"
        console.print(f"no mutation testing while a test fails: {why}")
    raise typer.Exit(FAILED)


def _write_mission(folder: Path, file: Path | None, options: TestOptions) -> None:
    """Write a recorded mission's decisions as tests, or print them."""
    from suave_des.kb.rule_tests import mission_knowledge, mission_states, tests_text
    from suave_des.kb.states import recorded_missions

    _, mission = next(recorded_missions(folder))
    about = options.apply(mission_knowledge(mission))
    knowledge = options.load(about)
    states = [
        (f"{folder.name} at {t_s:.2f} s", state)
        for t_s, state in mission_states(mission, knowledge.base)
    ]
    comment = f"Decisions of the mission recorded in {folder}, one for each kind of state in it."
    text = tests_text(about, knowledge, states, comment)
    if file is None:
        print(text, end="")
        return
    write_files(file.parent, {file.name: text})
    print(f"{len(states)} tests are in {file}: suave-des kb test {file}")


def _suites(options: TestOptions, files: Sequence[Path] | None) -> list[Suite]:
    """Each knowledge base with all tests about it; a mistake in the last file is told before
    anything runs.
    """
    from suave_des.kb.rule_tests import TestFile, shipped_tests

    suites: dict[str, Suite] = {}
    for file in [TestFile.read(path) for path in files or shipped_tests()]:
        about = options.apply(file.about)
        if str(about) not in suites:
            suites[str(about)] = about, options.load(about), []
        _, knowledge, tests = suites[str(about)]
        tests.extend(file.tests(knowledge))
    return list(suites.values())


def _run(console: Console, suites: Sequence[Suite], select: str | None) -> list[TestResult]:
    """Run tests, with a line of dots for each file."""
    from suave_des.kb.rule_tests import run_test

    chosen = [
        (knowledge, test)
        for _, knowledge, tests in suites
        for test in tests
        if select is None or select.lower() in test.name.lower()
    ]
    if not chosen:
        raise InputError(
            f"no test name contains {quoted(select)}",
            place="-k",
            remedy="see the names in the files",
        )
    results: list[TestResult] = []
    for file, group in groupby(chosen, key=lambda each: each[1].file):
        console.print(f"{_place(file)} ", end="")
        for knowledge, test in group:
            results.append(run_test(knowledge, test))
            passed = results[-1].passed
            console.print(Text("." if passed else "F", "green" if passed else "red"), end="")
        console.print()
    return results


def _place(file: Path, line: int | None = None) -> str:
    from suave_des.errors import relative_path

    shipped = shipped_folder("ontology")
    if file.is_relative_to(shipped):
        file = Path("ontology") / file.relative_to(shipped)
    return relative_path(file) + (f":{line}" if line is not None else "")


def _print_failures(console: Console, results: Sequence[TestResult]) -> None:
    failed = [result for result in results if not result.passed]
    if not failed:
        return
    width = min(console.width, _WIDTH)
    console.print("\n" + " FAILURES ".center(width, "="))
    for result in failed:
        console.print(Text(f" {result.test.name} ".center(width, "_"), "bold red"))
        console.print(_place(result.test.file, result.test.line))
        for first, *more in result.failures:
            console.print(Text(first, "red"))
            if more:
                console.print("\n".join(more))
    console.print(" short summary ".center(width, "="))
    for result in failed:
        place = _place(result.test.file, result.test.line)
        console.print(f"FAILED {place}: {result.test.name}: {result.failures[0][0]}")


def _print_summary(console: Console, results: Sequence[TestResult], duration_s: float) -> bool:
    """Print how many tests failed and passed; return whether all passed."""
    failed = sum(not result.passed for result in results)
    passed = len(results) - failed
    states = sum(len(result.test.situations) for result in results)
    counts = [f"{failed} failed"] * bool(failed) + [f"{passed} passed"] * bool(passed)
    line = f" {', '.join(counts)}, {number_of(states, 'state')}, in {duration_s:.2f} s "
    console.print(
        Text(line.center(min(console.width, _WIDTH), "="), "bold red" if failed else "bold green")
    )
    return not failed


def _cover(suites: Sequence[Suite], max_failed: int, file: Path | None) -> None:
    """Show what the tests of each knowledge base cover, and write tests of what they do not."""
    from suave_des.kb.adequacy import measure_coverage
    from suave_des.kb.rule_tests import tests_text

    if file is not None and len(suites) > 1:
        remedy = "give files of tests of one knowledge base"
        raise InputError(
            "the tests are about several knowledge bases", place="--write", remedy=remedy
        )
    for about, knowledge, tests in suites:
        situations = chain.from_iterable(test.situations for test in tests)
        hint = ", fewer with --max-failed 0" if max_failed else ""
        with counted(f"states{hint}", errors()) as on_count:
            found = measure_coverage(knowledge, situations, max_failed, on_count)
        print("", shown(found.table()).rstrip("\n"), *found.lines(), sep="\n")
        if file is not None and found.proposed:
            states = [(str(goals[0]), state) for state, goals in found.proposed]
            text = tests_text(about, knowledge, states, "States that other tests do not cover.")
            write_files(file.parent, {file.name: text})
            print(f"{len(states)} tests are in {file}; read them before you keep them")
        elif file is not None:
            print("nothing to write")


def _mutate(console: Console, suites: Sequence[Suite], options: MutationOptions) -> None:
    """Make small mistakes in rules, if that is wanted, and print which the tests notice."""
    from suave_des.kb.adequacy import mutants_of, mutate, mutation_lines, mutation_table, sample

    for _, knowledge, tests in suites if options.is_wanted else ():
        found = mutants_of(knowledge.base)
        names = list(dict.fromkeys(mutant.name for mutant in found))
        for name in options.only or ():
            if name not in names:
                raise unknown(f"there is no mutant of {quoted(name)}", name, names, place="--only")
        only = options.only or names
        chosen = sample([mutant for mutant in found if mutant.name in only], options.mutants)
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            task = progress.add_task("mutants", total=len(chosen))
            advance = partial(progress.advance, task)
            began = time.perf_counter()
            results, states = mutate(knowledge, tests, chosen, options.max_failed, advance)
            duration_s = time.perf_counter() - began
        lines = mutation_lines(results, states, options.max_failed)
        print("", shown(mutation_table(results)).rstrip("\n"), *lines, sep="\n")
        each_ms = 1000 * duration_s / max(1, len(results))
        print(f"{number_of(len(results), 'mutant')} in {duration_s:.1f} s, {each_ms:.0f} ms each")
