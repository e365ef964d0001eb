"""The policy as tables: each function's choice over the values that it depends on, and all cases as CSV rows."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass

from suave_des.workbench.policy.cases import Policy
from suave_des.workbench.policy.space import ComponentReports
from suave_des.workbench.ranges import ValueRange

_Groundings = tuple[tuple[str, str], ...]
_Column = tuple[ValueRange, ...]


@dataclass(frozen=True)
class TableRow:
    """One row of a function's table.

    Attributes:
        components: what components report, as text; empty where that has no effect.
        groundings: current design by function, where it has an effect.
        outcomes: for each column.
    """

    components: str
    groundings: dict[str, str]
    outcomes: tuple[str, ...]


@dataclass(frozen=True)
class FunctionTable:
    """What happens to one function's grounding, over everything that has an effect on it.

    Attributes:
        function: which function.
        attributes: whose measured values have an effect.
        columns: ranges of these attributes' values; neighbours that are equal in every row are joined.
        rows: one for each combination of reports and groundings.
    """

    function: str
    attributes: tuple[str, ...]
    columns: tuple[_Column, ...]
    rows: tuple[TableRow, ...]


def function_table(policy: Policy, function: str) -> FunctionTable:
    """Tabulate one function, without the dimensions on which it does not depend."""
    dimensions = _dimensions(policy, function)
    attributes = tuple(name for name in policy.attributes if ("attribute", name) in dimensions)
    grounded = [name for kind, name in dimensions if kind == "grounding"]
    found: dict[tuple[ComponentReports | None, _Groundings], dict[_Column, str]] = {}
    for case in policy.cases:
        if function in case.asked:
            reports = case.reports if ("components", "") in dimensions else None
            row = found.setdefault((reports, tuple((name, case.present(name)) for name in grounded)), {})
            column = tuple(case.ranges[policy.attributes.index(name)] for name in attributes)
            result = case.outcome_text(function)
            before = row.setdefault(column, result)
            if before != result:
                row[column] = f"{before} or {result}, by the order of the values"
    joined = [_joined(policy.ranges[name], place, list(found.values())) for place, name in enumerate(attributes)]
    columns = list(itertools.product(*joined))
    by_reports: dict[ComponentReports | None, dict[_Groundings, tuple[str, ...]]] = {}
    for (reports, groundings), outcomes in found.items():
        in_columns = tuple(outcomes.get(tuple(first for _, first in column), "") for column in columns)
        by_reports.setdefault(reports, {})[groundings] = in_columns
    # Reports that lead to the same outcomes for every grounding are in one row.
    groups: dict[Hashable, list[ComponentReports | None]] = {}
    for reports, rows in by_reports.items():
        groups.setdefault(tuple(rows.items()), []).append(reports)
    return FunctionTable(
        function,
        attributes,
        tuple(tuple(shown for shown, _ in column) for column in columns),
        tuple(
            TableRow(_reports_text([each for each in group if each is not None], policy), dict(groundings), results)
            for group in groups.values()
            for groundings, results in by_reports[group[0]].items()
        ),
    )


def _dimensions(policy: Policy, function: str) -> list[tuple[str, str]]:
    """What a function's outcome depends on: other groundings, components, attributes, and its own grounding."""
    cases = [case for case in policy.cases if function in case.asked]
    values: dict[tuple[str, str], list[Hashable]] = {
        **{("grounding", name): [case.present(name) for case in cases] for name in policy.functions},
        ("components", ""): [case.reports for case in cases],
        **{("attribute", name): [case.ranges[place] for case in cases] for place, name in enumerate(policy.attributes)},
    }
    outcomes = [case.outcome_text(function) for case in cases]
    kept = list(values)
    for dimension in values:
        fewer = [each for each in kept if each != dimension]
        seen: dict[Hashable, str] = {}
        points = zip(zip(*(values[each] for each in fewer), strict=True), outcomes, strict=True)
        if dimension != ("grounding", function) and all(seen.setdefault(at, each) == each for at, each in points):
            kept = fewer
    return kept


def _joined(
    ranges: Sequence[ValueRange], place: int, rows: Sequence[dict[_Column, str]]
) -> list[tuple[ValueRange, ValueRange]]:
    """Join the neighbours that are equal in all rows and other columns: (joined range, first range in it)."""

    def outcomes(one: ValueRange) -> list[dict[_Column, str]]:
        return [{(*at[:place], *at[place + 1 :]): row[at] for at in row if at[place] == one} for row in rows]

    joined: list[tuple[ValueRange, ValueRange]] = []
    for one in ranges:
        if joined and not joined[-1][0].is_missing and outcomes(joined[-1][1]) == outcomes(one):
            joined[-1] = joined[-1][0].joined(one), joined[-1][1]
        else:
            joined.append((one, one))
    return joined


def _reports_text(group: Sequence[ComponentReports], policy: Policy) -> str:
    """What components report: counted where they are interchangeable, else named; empty without an effect."""
    texts = []
    for reports in group:
        counted: dict[tuple[str, str], int] = {}
        for component, status in reports.components:
            kind = next(each for each in policy.alike if component in each)
            label = component if len(kind) == 1 else "" if len(policy.alike) == 1 else f" of {kind[0]} and alike"
            counted[label, status] = counted.get((label, status), 0) + 1
        parts = [
            f"{label} {status}" if label and not label.startswith(" ") else f"{number} {status}{label}"
            for (label, status), number in counted.items()
        ]
        texts.append(" + ".join(parts) or "no report")
    return ", ".join(texts)


def columns_of(policy: Policy) -> tuple[str, ...]:
    """Columns of the CSV file."""
    now, then = ([f"{function}_{when}" for function in policy.functions] for when in ("now", "then"))
    return (*policy.attributes, "components", "states", *now, "statuses", *then, "marks", "problem")


def rows_of(policy: Policy) -> Iterator[tuple[object, ...]]:
    """Rows of the CSV file: every case."""
    for case in policy.cases:
        yield (
            *map(str, case.ranges),
            "; ".join(f"{name}={status}" for name, status in case.reports.components),
            case.reports.combinations,
            *(case.present(name) if name in case.asked else "" for name in policy.functions),
            "; ".join(case.statuses),
            *(case.outcome(name) if name in case.asked else "" for name in policy.functions),
            "; ".join(case.marks),
            case.problem or "",
        )
