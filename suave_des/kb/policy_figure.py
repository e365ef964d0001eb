"""The policy as a picture: the chosen design over one or two measured values."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from suave_des.errors import InputError
from suave_des.kb.policy import FLIP_FLOP, FunctionTable, Policy, TableRow, function_table
from suave_des.kb.situations import INCONSISTENT
from suave_des.kb.space import ValueRange
from suave_des.knowledge.state import NO_GROUNDING, NONE_LEFT, STAYS
from suave_des.results.figures import check_picture, write_picture
from suave_des.results.style import MODE_COLOURS, OTHER_MODES, WIDTH_IN, publication

#: Units of measured values; those of a user's own attributes are not known.
_UNITS: Final = {"water_visibility": "m", "battery_level": "share of a full battery"}
_FIXED: Final = {INCONSISTENT: "#B00020", NONE_LEFT: "#D9D9D9", NO_GROUNDING: "#FFFFFF"}
_LEGEND: Final = {NONE_LEFT: "none left: as before", INCONSISTENT: "contradiction"}
#: Width of the cell of a single value; a range has 1.
_NARROW: Final = 0.3
_ROW_IN: Final = 0.21
_MOST_ROWS: Final = 60


class _Panel(NamedTuple):
    """A grid of cells: its title, what is along either side (None: all values), and the designs in use afterwards."""

    title: str
    across: Sequence[ValueRange | None]
    down: Sequence[str | ValueRange | None]
    designs: Sequence[Sequence[str]]


def draw_policy(policy: Policy, path: Path) -> None:
    """Draw what is chosen for each function that has a choice.

    Args:
        policy: with an effect of one or two measured values.
        path: .png, .pdf or .svg.

    Raises:
        InputError: there are no or more attributes, or too many rows; or the file cannot be written.
    """
    if len(policy.attributes) not in (1, 2):
        raise InputError(
            f"the policy depends on {len(policy.attributes)} measured values", remedy="a picture needs one or two"
        )
    check_picture(path)
    tables = [table for table in (function_table(policy, name) for name in policy.functions) if _has_choice(table)]
    if not tables:
        raise InputError("no function has a choice to draw")
    if sum(len(table.rows) for table in tables) > _MOST_ROWS:
        raise InputError(f"there are more than {_MOST_ROWS} rows to draw", remedy="lower --max-failed, or use --csv")
    import matplotlib.pyplot as plt
    from matplotlib.patches import Patch

    is_flat = len(policy.attributes) == 1
    panels = (
        [_rows_of(table) for table in tables]
        if is_flat
        else [_map_of(policy, table, row) for table in tables for row in table.rows]
    )
    columns = 1 if is_flat else 2 if len(panels) == 4 else min(3, len(panels))
    lines = -(-len(panels) // columns)
    heights = [len(panel.down) + 2.5 for panel in panels] if is_flat else [10.0] * lines
    with publication():
        colours = _colours({design.partition(" (")[0] for panel in panels for row in panel.designs for design in row})
        size = WIDTH_IN, _ROW_IN * sum(heights) + 0.6
        figure, grid = plt.subplots(
            lines, columns, figsize=size, height_ratios=heights, squeeze=False, layout="constrained"
        )
        for axes in grid.flat[len(panels) :]:
            axes.set_axis_off()
        for axes, panel in zip(grid.flat, panels, strict=False):
            _draw(axes, panel, colours)
            axes.set_title(panel.title, loc="left", fontsize=None if is_flat else 7.5)
            axes.set_xlabel(_measured(policy.attributes[0]))
            if is_flat:
                axes.invert_yaxis()
            else:
                axes.set_ylabel(_measured(policy.attributes[1]))
        handles = [
            Patch(facecolor=colour, edgecolor="#8A8A8A", linewidth=0.4, label=_LEGEND.get(name, name))
            for name, colour in colours.items()
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=min(4, len(handles)))
        try:
            write_picture(figure, path, bbox_inches="tight")
        finally:
            plt.close(figure)


def _measured(attribute: str) -> str:
    return ", ".join(filter(None, (f"measured {attribute.replace('_', ' ')}", _UNITS.get(attribute))))


def _low_to_high(design: str) -> tuple[int, str]:
    """Order designs as their colours are: none, the shipped ones from low to high, then others by name."""
    known = [NO_GROUNDING, *MODE_COLOURS]
    return known.index(design) if design in known else len(known), design


def _has_choice(table: FunctionTable) -> bool:
    return len({outcome for row in table.rows for outcome in row.outcomes} - {STAYS}) > 1


def _rows_of(table: FunctionTable) -> _Panel:
    """A function's table: measured values across, all else that has an effect down."""
    title = f"{table.function}: what is grounded now (left), and then (colour)"
    columns = [column[0] if column else None for column in table.columns]
    rows = sorted(table.rows, key=lambda row: _low_to_high(row.groundings.get(table.function, "")))
    return _Panel(title, columns, [_label(table, row) for row in rows], [_designs(table, row) for row in rows])


def _map_of(policy: Policy, table: FunctionTable, row: TableRow) -> _Panel:
    """One row of a function's table: one measured value across, the other up."""
    columns = [dict(zip(table.attributes, column, strict=True)) for column in table.columns]
    x, y = (list(dict.fromkeys(column.get(name) for column in columns)) for name in policy.attributes)
    after = dict(zip((tuple(map(each.get, policy.attributes)) for each in columns), _designs(table, row), strict=True))
    return _Panel(f"{table.function}, now\n{_label(table, row)}", x, y, [[after[a, b] for a in x] for b in y])


def _draw(axes: Any, panel: _Panel, colours: Mapping[str, str]) -> None:
    from matplotlib.patches import Rectangle

    lefts, bottoms = _edges(panel.across), _edges(panel.down)
    for row, bottom, top in zip(panel.designs, bottoms, bottoms[1:], strict=False):
        for design, left, right in zip(row, lefts, lefts[1:], strict=False):
            colour, hatch = colours[design.partition(" (")[0]], "////" if FLIP_FLOP in design else None
            axes.add_patch(
                Rectangle(
                    (left, bottom),
                    right - left,
                    top - bottom,
                    facecolor=colour,
                    edgecolor="white",
                    linewidth=0.5,
                    hatch=hatch,
                )
            )
    axes.set(xlim=(lefts[0], lefts[-1]), ylim=(bottoms[0], bottoms[-1]))
    axes.set_xticks(*_ticks(panel.across, lefts))
    axes.set_yticks(*_ticks(panel.down, bottoms))
    axes.grid(False)
    axes.tick_params(length=0)


def _edges(cells: Sequence[str | ValueRange | None]) -> list[float]:
    """Where cells begin and the last one ends: a single value is narrow, ranges are as wide as one another."""
    edges = [0.0]
    for cell in cells:
        edges.append(edges[-1] + (_NARROW if isinstance(cell, ValueRange) and cell.is_number else 1.0))
    return edges


def _ticks(cells: Sequence[str | ValueRange | None], edges: Sequence[float]) -> tuple[list[float], list[str]]:
    """Places and texts of the ends of ranges, and of what is no range."""
    found: dict[float, str] = {}
    for cell, begin, end in zip(cells, edges, edges[1:], strict=False):
        if not isinstance(cell, ValueRange) or cell.is_missing or cell.is_number:
            found[(begin + end) / 2] = "" if cell is None else str(cell).replace("not measured", "not\nmeasured")
        elif cell.low is not None and f"{cell.low:f}" not in found.values():
            found[begin] = f"{cell.low:f}"
    return list(found), list(found.values())


def _designs(table: FunctionTable, row: TableRow) -> list[str]:
    """The design in use afterwards, or why there is none, for each column."""
    now = row.groundings.get(table.function, NO_GROUNDING)
    return [text.replace(STAYS, now, 1) if text.startswith(STAYS) else text for text in row.outcomes]


def _colours(names: set[str]) -> dict[str, str]:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    fixed = {**MODE_COLOURS, **_FIXED}
    more = (to_hex(colormaps["Set2"](number)) for number in range(8))
    others = itertools.cycle(dict.fromkeys((*OTHER_MODES, *more)))
    return {name: fixed[name] if name in fixed else next(others) for name in sorted(names, key=_low_to_high)}


def _label(table: FunctionTable, row: TableRow) -> str:
    own = dict(row.groundings)
    parts = [own.pop(table.function, ""), *(f"{function}: {design}" for function, design in own.items())]
    parts.append(row.components if len(row.components) <= 44 else row.components[:41] + "...")
    return "; ".join(filter(None, parts))
