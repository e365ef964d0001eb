"""Print what tests of rules cover, and which mutants they kill."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from suave_des.cli.console import plain_table, print_table

if TYPE_CHECKING:
    from suave_des.workbench.testing.coverage import Coverage, RuleCoverage
    from suave_des.workbench.testing.mutation import MutationReport

_MOST = 8
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
        console.print(Text(line), soft_wrap=True)


def _coverage_lines(coverage: Coverage) -> Iterator[str]:
    missing = [goal for each in coverage.rules for goal in each.missing]
    if missing:
        yield "not covered"
        yield from (f"  {goal}" for goal in missing)
    unreachable = [each for each in coverage.rules if each.unreachable]
    if unreachable:
        words = f"of {coverage.states} kinds of states of this model, with at most {coverage.max_failed} components"
        yield f"never, whatever the state ({words} reporting); facts in a test may"
        yield from (f"  {line}" for line in _unreachable(unreachable))
    if coverage.proposed:
        count = len(coverage.proposed)
        yield f"the least set of states that would cover the rest: {count} (write them as tests with --write FILE)"
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
        console.print("survivors: no test notices", soft_wrap=True)
    for verdict in report.of(SURVIVED):
        console.print(Text(f"  {verdict.mutant}\n    {verdict.reason}\n    at {verdict.state}"), soft_wrap=True)
    count = len(report.verdicts)
    each_ms = 1000 * report.duration_s / count if count else 0.0
    console.print(Text(f"{count} mutants in {report.duration_s:.1f} s, {each_ms:.0f} ms each"), soft_wrap=True)
    if report.states:
        words = f"equivalent: {report.states} kinds of states, with at most {report.max_failed} components reporting"
        console.print(Text(f"{words}, or the schema says so"), soft_wrap=True)


def _unreachable(rules: list[RuleCoverage]) -> Iterator[str]:
    goals = [goal for each in rules for goal in each.unreachable]
    yield from map(str, goals[:_MOST])
    if len(goals) > _MOST:
        yield f"and {len(goals) - _MOST} more"
