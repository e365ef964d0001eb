"""The policy in tables: what a function's choice depends on, and all cells as rows of a CSV file."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass

from suave_des.workbench.policy import FLIP_FLOP, Cell, Policy
from suave_des.workbench.regions import Region
from suave_des.workbench.symmetry import Reports

UNGROUNDED, NOT_ASKED = "ungrounded", "not asked for"


@dataclass(frozen=True)
class TableRow:
    """One row of a function's table.

    Attributes:
        components: what components report, in words; empty where that makes no difference.
        groundings: (function, present design) where these make a difference.
        outcomes: for each column.
    """

    components: str
    groundings: tuple[tuple[str, str], ...]
    outcomes: tuple[str, ...]


@dataclass(frozen=True)
class FunctionTable:
    """What happens to one function's grounding, over everything that makes a difference to it.

    Attributes:
        function: which function.
        attributes: whose measured values make a difference.
        columns: ranges of these attributes' values; neighbours that are alike in every row are one.
        rows: all else.
    """

    function: str
    attributes: tuple[str, ...]
    columns: tuple[tuple[Region, ...], ...]
    rows: tuple[TableRow, ...]


def function_table(policy: Policy, function: str) -> FunctionTable:
    """The table of one function, without the coordinates on which it does not depend."""
    cells = [cell for cell in policy.cells if function in cell.asked]
    coordinates = _coordinates(policy)
    outcome = [outcome_in_words(cell, function) for cell in cells]
    kept = list(coordinates)
    for name in [*coordinates]:
        if name == f"grounding {function}":
            continue
        fewer = [each for each in kept if each != name]
        if _decides([coordinates[each] for each in fewer], cells, outcome):
            kept = fewer
    attributes = tuple(name for name in policy.attributes if f"attribute {name}" in kept)
    places = [policy.attributes.index(name) for name in attributes]
    found: dict[Hashable, dict[tuple[Region, ...], str]] = {}
    row_of: dict[Hashable, tuple[Reports | None, tuple[tuple[str, str], ...]]] = {}
    others = [each for each in kept if not each.startswith("attribute ")]
    for cell, result in zip(cells, outcome, strict=True):
        key = tuple(coordinates[each](cell) for each in others)
        groundings = tuple(
            (each.partition(" ")[2], str(coordinates[each](cell))) for each in others if each.startswith("grounding ")
        )
        row_of.setdefault(key, (cell.reports if "components" in kept else None, groundings))
        column = tuple(cell.regions[place] for place in places)
        before = found.setdefault(key, {}).get(column, result)
        found[key][column] = before if before == result else f"{before} or {result}, by the order of the values"
    merged = _merged([policy.regions[name] for name in attributes], list(found.values()))
    rows = _rows(policy, found, row_of, merged)
    return FunctionTable(function, attributes, tuple(shown for shown, _ in merged), rows)


def _coordinates(policy: Policy) -> dict[str, Callable[[Cell], Hashable]]:
    """What a state consists of, by name; those that are best left out first."""
    found: dict[str, Callable[[Cell], Hashable]] = {}
    for function in policy.functions:
        found[f"grounding {function}"] = lambda cell, function=function: present(cell, function)  # type: ignore[misc]
    found["components"] = lambda cell: cell.reports
    for place, name in enumerate(policy.attributes):
        found[f"attribute {name}"] = lambda cell, place=place: cell.regions[place]  # type: ignore[misc]
    return found


def present(cell: Cell, function: str) -> str:
    """The design that a function has in a cell, "ungrounded" or "not asked for"."""
    if function not in cell.asked:
        return NOT_ASKED
    return cell.state.grounded(function) or UNGROUNDED


def outcome_in_words(cell: Cell, function: str) -> str:
    """What happens to a function's grounding, and whether the choice flips back and forth."""
    flips = f" ({FLIP_FLOP})" if function in cell.flipping else ""
    return cell.outcome(function) + flips


def _decides(coordinates: Sequence[Callable[[Cell], Hashable]], cells: Sequence[Cell], outcome: Sequence[str]) -> bool:
    """Whether the outcome is the same wherever these coordinates are the same."""
    seen: dict[Hashable, str] = {}
    return all(
        seen.setdefault(tuple(each(cell) for each in coordinates), result) == result
        for cell, result in zip(cells, outcome, strict=True)
    )


def _merged(
    axes: Sequence[Sequence[Region]], rows: Sequence[dict[tuple[Region, ...], str]]
) -> list[tuple[tuple[Region, ...], tuple[Region, ...]]]:
    """(ranges shown, regions in them): of each attribute, neighbours that are alike in all else are one."""
    groups = []
    for place, regions in enumerate(axes):
        others = list(itertools.product(*(each for number, each in enumerate(axes) if number != place)))

        def alike(one: Region, other: Region, place: int = place, others: list[tuple[Region, ...]] = others) -> bool:
            pairs = [((*rest[:place], one, *rest[place:]), (*rest[:place], other, *rest[place:])) for rest in others]
            return all(row.get(first) == row.get(second) for row in rows for first, second in pairs)

        merged: list[tuple[Region, Region]] = []
        for region in regions:
            if merged and not merged[-1][0].is_missing and alike(merged[-1][1], region):
                merged[-1] = merged[-1][0].with_next(region), merged[-1][1]
            else:
                merged.append((region, region))
        groups.append(merged)
    return [
        (tuple(shown for shown, _ in chosen), tuple(first for _, first in chosen))
        for chosen in itertools.product(*groups)
    ]


def _rows(
    policy: Policy,
    found: dict[Hashable, dict[tuple[Region, ...], str]],
    row_of: dict[Hashable, tuple[Reports | None, tuple[tuple[str, str], ...]]],
    merged: Sequence[tuple[tuple[Region, ...], tuple[Region, ...]]],
) -> tuple[TableRow, ...]:
    """Rows; components that lead to the same outcomes for every grounding stand together."""
    by_components: dict[Reports | None, dict[tuple[tuple[str, str], ...], tuple[str, ...]]] = {}
    for key, outcomes in found.items():
        reports, groundings = row_of[key]
        by_components.setdefault(reports, {})[groundings] = tuple(outcomes.get(first, "") for _, first in merged)
    groups: dict[tuple[object, ...], list[Reports | None]] = {}
    for reports, rows in by_components.items():
        groups.setdefault(tuple(rows.items()), []).append(reports)
    return tuple(
        TableRow(in_words([each for each in group if each is not None], policy), groundings, outcomes)
        for group in groups.values()
        for groundings, outcomes in by_components[group[0]].items()
    )


def in_words(group: Sequence[Reports], policy: Policy) -> str:
    """What components report: counted where they are alike, named where they are not; empty for nothing to tell."""
    words = []
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
        words.append(" + ".join(parts) or "no report")
    return ", ".join(words)


def columns_of(policy: Policy) -> tuple[str, ...]:
    """Columns of the CSV file."""
    return (
        *policy.attributes,
        "components",
        "states",
        *(f"{function}_now" for function in policy.functions),
        "statuses",
        *(f"{function}_then" for function in policy.functions),
        "marks",
        "problem",
    )


def rows_of(policy: Policy) -> Iterator[tuple[object, ...]]:
    """Rows of the CSV file: every cell."""
    for cell in policy.cells:
        yield (
            *map(str, cell.regions),
            "; ".join(f"{name}={status}" for name, status in cell.reports.components),
            cell.reports.combinations,
            *("" if function not in cell.asked else present(cell, function) for function in policy.functions),
            "; ".join(cell.statuses),
            *("" if function not in cell.asked else cell.outcome(function) for function in policy.functions),
            "; ".join(cell.marks),
            cell.problem or "",
        )
