"""suave-des kb test: run tests of rules, measure what they cover, and write new ones."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.text import Text

from suave_des.cli.console import output, plain_table, print_table
from suave_des.cli.kb.options import MaxFailed, TimeLimitS
from suave_des.cli.options import KnowledgeFiles, grouped_options
from suave_des.errors import InputError, did_you_mean, number_of, shown
from suave_des.files import check_output_file, write_files
from suave_des.resources import shipped_folder

if TYPE_CHECKING:
    from suave_des.knowledge.ontology import Ontology
    from suave_des.workbench import KnowledgeBase
    from suave_des.workbench.testing.coverage import Coverage, RuleCoverage
    from suave_des.workbench.testing.mutants import Mutant
    from suave_des.workbench.testing.mutation import MutationReport
    from suave_des.workbench.testing.reading import RuleTest, TestedKnowledge, TestFile
    from suave_des.workbench.testing.run import TestResult

FAILED = 1
"""Exit status when a test fails."""
_WIDTH = 80


@dataclass(frozen=True)
class TestOptions(KnowledgeFiles):
    """Options that replace or add to what the files of tests say of their knowledge base."""

    scenario: Annotated[
        str | None, typer.Option("--scenario", metavar="SCENARIO", help="Scenario to use instead of the tests' own.")
    ] = None


@grouped_options
def test(
    knowledge: TestOptions,
    files: Annotated[
        list[Path] | None, typer.Argument(metavar="FILE", help="Tests in YAML; by default those of the shipped rules.")
    ] = None,
    select: Annotated[
        str | None, typer.Option("-k", metavar="TEXT", help="Only tests with this text in their name.")
    ] = None,
    junit_xml: Annotated[
        Path | None, typer.Option("--junit-xml", "--junitxml", metavar="FILE", help="Write the results as JUnit XML.")
    ] = None,
    coverage: Annotated[
        bool, typer.Option("--coverage", help="Show which rules, atoms and comparisons the tests cover.")
    ] = False,
    mutate: Annotated[
        bool,
        typer.Option(
            "--mutate", help="Mutation testing: seed small faults in rules and data; report those that no test detects."
        ),
    ] = False,
    mutants: Annotated[
        int | None, typer.Option("--mutants", min=1, metavar="N", help="Maximum number of mutants; by default all.")
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option("--only", metavar="NAME", help="Only mutants of this rule or individual; repeat it for several."),
    ] = None,
    from_mission: Annotated[
        Path | None,
        typer.Option("--from-mission", metavar="DIR", help="Write the decisions of a recorded mission as tests."),
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option("--write", metavar="FILE", help="File to which --from-mission and --coverage write tests."),
    ] = None,
    max_failed: MaxFailed = 1,
    time_limit: TimeLimitS = 60.0,
) -> None:
    """Test rules: what must follow in a state, what must not, and what is decided.

    Exit status: 0 all tests pass; 1 one fails; 2 something cannot be read.
    """
    for file in filter(None, (junit_xml, write)):
        check_output_file(file, overwrite=file == junit_xml)
    if knowledge.set and (from_mission is not None or write is not None):
        remedy = "write a scenario with `base` and these values, and name it with --scenario"
        raise InputError("tests that are written name a scenario, not values of it", place="--set", remedy=remedy)
    if from_mission is not None:
        _write_mission(from_mission, write, knowledge, time_limit)
        return
    if write is not None and not coverage:
        raise InputError("nothing to write", place="--write", remedy="with --from-mission DIR, or --coverage")
    began = time.perf_counter()
    suites = _suites(knowledge, files or (), time_limit)
    console = output()
    results = _run(console, suites, select)
    _print_failures(console, results)
    if junit_xml is not None:
        from suave_des.workbench.testing.run import junit_xml as written

        write_files(junit_xml.parent, {junit_xml.name: written(results)})
    _print_summary(console, results, time.perf_counter() - began)
    if coverage:
        _cover(console, suites, max_failed, write)
    if mutate or mutants is not None:
        if not all(result.passed for result in results):
            console.print("no mutation testing while a test fails: every mutant would count as killed")
        else:
            _mutate(console, suites, only or (), mutants, max_failed)
    if not all(result.passed for result in results):
        raise typer.Exit(FAILED)


def _write_mission(folder: Path, file: Path | None, knowledge: TestOptions, time_limit_s: float) -> None:
    """Write a recorded mission's decisions as tests, or print them."""
    from suave_des.workbench.prover import Prover
    from suave_des.workbench.testing.writing import mission_knowledge, mission_states, tests_text

    about = mission_knowledge(folder).with_replacements(knowledge.scenario, knowledge.replacements)
    bench = about.load(time_limit_s)
    states = list(mission_states(folder, bench))
    comment = f"Decisions of the mission recorded in {folder}, one for each kind of state in it."
    text = tests_text(about, Prover.of(bench), states, comment)
    if file is None:
        print(text, end="")
        return
    write_files(file.parent, {file.name: text})
    print(f"{len(states)} tests are in {file}: suave-des kb test {file}")


def _cover(console: Console, suites: Sequence[Suite], max_failed: int, file: Path | None) -> None:
    """Show what the tests of each knowledge base cover, and write tests of what they do not."""
    from suave_des.workbench.prover import Prover
    from suave_des.workbench.testing.coverage import measure_coverage
    from suave_des.workbench.testing.writing import tests_text

    benches = _together(suites)
    if file is not None and len(benches) > 1:
        remedy = "give files of tests of one knowledge base"
        raise InputError("the tests are about several knowledge bases", place="--write", remedy=remedy)
    for suite, tests in benches:
        situations = [situation for test in tests for situation in test.situations]
        found = measure_coverage(suite.bench, situations, max_failed)
        print_coverage(console, found)
        if file is not None:
            states = [(str(goals[0]), state) for state, goals in found.proposed]
            text = tests_text(suite.about, Prover.of(suite.bench), states, "States that other tests do not cover.")
            if states:
                write_files(file.parent, {file.name: text})
            print(
                f"{len(states)} tests are in {file}; read them before you keep them" if states else "nothing to write"
            )


def _mutants(base: Ontology, only: Sequence[str], most: int | None) -> tuple[Mutant, ...]:
    """The mutants of a knowledge base that are wanted: of some rules or individuals, all if there are none."""
    from suave_des.workbench.testing.mutants import mutants_of, sample

    found = mutants_of(base)
    names = list(dict.fromkeys(mutant.name for mutant in found))
    for name in only:
        if name not in names:
            raise InputError(f"there is no mutant of {shown(name)}", place="--only", remedy=did_you_mean(name, names))
    return sample([mutant for mutant in found if not only or mutant.name in only], most)


def _mutate(console: Console, suites: Sequence[Suite], only: Sequence[str], most: int | None, max_failed: int) -> None:
    """Show which mutants of each knowledge base the tests kill."""
    from suave_des.workbench.testing.mutation import mutate

    for suite, tests in _together(suites):
        chosen = _mutants(suite.bench.base, only, most)
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            task = progress.add_task("mutants", total=len(chosen))
            report = mutate(suite.bench, tests, chosen, max_failed, partial(progress.advance, task))
        print_mutation(console, report)


@dataclass(frozen=True)
class Suite:
    """A file of tests with its knowledge base."""

    file: TestFile
    about: TestedKnowledge
    bench: KnowledgeBase
    tests: tuple[RuleTest, ...]


def _suites(knowledge: TestOptions, files: Sequence[Path], time_limit_s: float) -> list[Suite]:
    """Read all files before anything runs, so that a mistake in the last one comes first."""
    from suave_des.workbench.testing.reading import TestFile, shipped_tests

    benches: dict[TestedKnowledge, KnowledgeBase] = {}
    suites = []
    for file in [TestFile.read(path) for path in files or shipped_tests()]:
        about = file.knowledge.with_replacements(knowledge.scenario, knowledge.replacements)
        if about not in benches:
            benches[about] = about.load(time_limit_s, knowledge.values)
        suites.append(Suite(file, about, benches[about], file.tests(benches[about])))
    return suites


def _together(suites: Iterable[Suite]) -> list[tuple[Suite, list[RuleTest]]]:
    """Each knowledge base once: the first file that is about it, and the tests of all such files."""
    found: dict[int, tuple[Suite, list[RuleTest]]] = {}
    for suite in suites:
        found.setdefault(id(suite.bench), (suite, []))[1].extend(suite.tests)
    return list(found.values())


def _run(console: Console, suites: Iterable[Suite], select: str | None) -> list[TestResult]:
    from suave_des.workbench.testing.run import Runner

    chosen = [
        (suite, [test for test in suite.tests if select is None or select.lower() in test.name.lower()])
        for suite in suites
    ]
    total = sum(len(tests) for _, tests in chosen)
    if total == 0:
        raise InputError(f"no test name contains {shown(select)}", place="-k", remedy="see the names in the files")
    results: list[TestResult] = []
    runners: dict[int, Runner] = {}
    for suite, tests in chosen:
        if not tests:
            continue
        runner = runners.setdefault(id(suite.bench), Runner.of(suite.bench))
        line = _Dots(console, _place(suite.file.document.path))
        for test in tests:
            results.append(runner.run(test))
            line.add(results[-1].passed, len(results) / total)
        line.end(len(results) / total)
    return results


def _place(file: Path, line: int | None = None) -> str:
    from suave_des.knowledge.checks.findings import relative_path

    shipped = shipped_folder("ontology")
    if file.is_relative_to(shipped):
        file = Path("ontology") / file.relative_to(shipped)
    return relative_path(file) + (f":{line}" if line is not None else "")


class _Dots:
    """A line of dots, as pytest prints it; a new one where the terminal ends."""

    def __init__(self, console: Console, name: str) -> None:
        self.console, self.width = console, min(console.width, _WIDTH)
        console.print(f"{name} ", end="")
        self.at = len(name) + 1

    def add(self, passed: bool, share: float) -> None:
        """Print one test's letter."""
        if self.at >= self.width - 8:
            self.end(share)
        self.console.print(Text("." if passed else "F", "green" if passed else "red"), end="")
        self.at += 1

    def end(self, share: float) -> None:
        """Print how much is done, and end the line."""
        self.console.print(Text(f"[{share:4.0%}]".rjust(max(7, self.width - self.at)), "cyan"))
        self.at = 0


def _print_failures(console: Console, results: Sequence[TestResult]) -> None:
    from suave_des.workbench.testing.run import failure_lines

    failed = [result for result in results if not result.passed]
    if not failed:
        return
    width = min(console.width, _WIDTH)
    console.print("\n" + " FAILURES ".center(width, "="))
    for result in failed:
        console.print(Text(f" {result.test.name} ".center(width, "_"), "bold red"))
        console.print(_place(result.test.file, result.test.line))
        for failure in result.failures:
            first, *more = failure_lines(failure)
            console.print(Text(first, "red"))
            console.print("\n".join(more))
    console.print(" short summary ".center(width, "="))
    for result in failed:
        place = _place(result.test.file, result.test.line)
        console.print(f"FAILED {place}: {result.test.name}: {result.failures[0].what}")


def _print_summary(console: Console, results: Sequence[TestResult], duration_s: float) -> None:
    failed = sum(not result.passed for result in results)
    passed = len(results) - failed
    states = sum(len(result.test.situations) for result in results)
    counts = [f"{failed} failed"] * bool(failed) + [f"{passed} passed"] * bool(passed)
    line = f" {', '.join(counts)}, {number_of(states, 'state')}, in {duration_s:.2f} s "
    width = min(console.width, _WIDTH)
    console.print(Text(line.center(width, "="), "bold red" if failed else "bold green"))


_LINES_SHOWN = 8
"""Lines of a list on a terminal; all of it is in the JSON form."""


def print_coverage(console: Console, coverage: Coverage) -> None:
    """Print a table of the rules, what is missing, and the states that would cover it."""
    table = plain_table(
        ("rule", "fired", "not fired", "covered", "missing", "no state"), right=("fired", "not fired", "covered")
    )
    for each in coverage.rules:
        reachable = len(each.covered) + len(each.missing)
        cells = (len(each.missing) or "", len(each.unreachable) or "")
        table.add_row(
            each.rule, str(each.fired), str(each.not_fired), f"{len(each.covered)}/{reachable}", *map(str, cells)
        )
    console.print()
    share = coverage.covered / coverage.reachable if coverage.reachable else 1.0
    title = f"coverage: {coverage.covered} of {coverage.reachable}, {share:.0%}"
    print_table(console, title, table)
    for line in _coverage_lines(coverage):
        console.print(line)


def _coverage_lines(coverage: Coverage) -> Iterator[str]:
    missing = [goal for each in coverage.rules for goal in each.missing]
    if missing:
        yield "not covered"
        yield from (f"  {goal}" for goal in missing)
    unreachable = [each for each in coverage.rules if each.unreachable]
    if unreachable:
        components = number_of(coverage.max_failed, "component")
        words = f"of {coverage.states} kinds of states of this model, with at most {components} reporting"
        yield f"not reached in any state ({words}), but facts in a test may reach it"
        yield from (f"  {line}" for line in _unreachable(unreachable))
    if coverage.proposed:
        count = len(coverage.proposed)
        yield f"a smallest set of states that would cover the rest: {count} (write them as tests with --write FILE)"
        for state, goals in coverage.proposed:
            yield f"  {state}"
            yield f"    {goals[0]}" + (f" and {len(goals) - 1} more" if len(goals) > 1 else "")


def print_mutation(console: Console, report: MutationReport) -> None:
    """Print a table of the operators, and each survivor with a state that tells it apart."""
    from suave_des.workbench.testing.mutation import EQUIVALENT, KILLED, SURVIVED

    results = (KILLED, SURVIVED, EQUIVALENT)
    table = plain_table(("operator", *results), right=results)
    for operator in dict.fromkeys(verdict.mutant.operator for verdict in report.verdicts):
        own = [verdict.result for verdict in report.verdicts if verdict.mutant.operator == operator]
        table.add_row(operator, *(str(own.count(result)) for result in results))
    killed, survived, equivalent = (len(report.of(result)) for result in results)
    console.print()
    title = f"mutation: {killed} of {killed + survived} mutants killed, {report.score:.0%}; {equivalent} equivalent"
    print_table(console, title, table)
    if survived:
        console.print("survivors, which no test notices")
    for verdict in report.of(SURVIVED):
        console.print(f"  {verdict.mutant}\n    {verdict.reason}\n    at {verdict.state}")
    count = len(report.verdicts)
    each_ms = 1000 * report.duration_s / count if count else 0.0
    console.print(f"{number_of(count, 'mutant')} in {report.duration_s:.1f} s, {each_ms:.0f} ms each")
    if report.states:
        components = number_of(report.max_failed, "component")
        words = f"equivalent: {report.states} kinds of states, with at most {components} reporting"
        console.print(f"{words}, or the schema says so")


def _unreachable(rules: list[RuleCoverage]) -> Iterator[str]:
    goals = [goal for each in rules for goal in each.unreachable]
    yield from map(str, goals[:_LINES_SHOWN])
    if len(goals) > _LINES_SHOWN:
        yield f"and {len(goals) - _LINES_SHOWN} more"
