"""The policy as a picture: the chosen design over one or two measured values."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from suave_des.errors import InputError
from suave_des.kb.policy import FLIP_FLOP, FunctionTable, Policy, function_table
from suave_des.kb.situations import INCONSISTENT
from suave_des.kb.space import Scale
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
#: First and last place of a range of values.
_Span = tuple[int, int]


class _Panel(NamedTuple):
    """A grid of cells: its title, the ranges or labels along either side, and the designs in use afterwards."""

    title: str
    across: Sequence[_Span | str]
    down: Sequence[_Span | str]
    designs: Sequence[Sequence[str]]


def draw_policy(policy: Policy, path: Path) -> None:
    """Draw what is chosen for each function that has a choice.

    Args:
        policy: with an effect of one or two measured values.
        path: .png, .pdf or .svg.

    Raises:
        InputError: there are no or more attributes, or too many rows; or the file cannot be written.
    """
    attributes, scale = policy.space.attributes, policy.space.scale
    if len(attributes) not in (1, 2):
        raise InputError(
            f"the policy depends on {len(attributes)} measured values", remedy="a picture needs one or two"
        )
    check_picture(path)
    tables = [table for table in (function_table(policy, name) for name in policy.functions) if _has_choice(table)]
    if not tables:
        raise InputError("no function has a choice to draw")
    if sum(len(table.outcomes) for table in tables) > _MOST_ROWS:
        raise InputError(f"there are more than {_MOST_ROWS} rows to draw", remedy="lower --max-failed, or use --csv")
    import matplotlib.pyplot as plt
    from matplotlib.patches import Patch

    is_flat = len(attributes) == 1
    panels = [panel for table in tables for panel in ([_rows_of(table)] if is_flat else _maps_of(table, attributes))]
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
            _draw(axes, panel, colours, scale)
            axes.set_title(panel.title, loc="left", fontsize=None if is_flat else 7.5)
            axes.set_xlabel(_measured(attributes[0]))
            if is_flat:
                axes.invert_yaxis()
            else:
                axes.set_ylabel(_measured(attributes[1]))
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
    return len({outcome for row in table.outcomes for outcome in row.values()} - {STAYS}) > 1


def _rows_of(table: FunctionTable) -> _Panel:
    """A function's table: measured values across, all else that has an effect down."""
    title = f"{table.function}: what is grounded now (left), and then (colour)"
    rows = sorted(range(len(table.outcomes)), key=lambda row: _low_to_high(table.groundings[row][table.function]))
    (across,) = table.spans.values() or ([""],)
    designs = [list(_designs(table, row).values()) for row in rows]
    return _Panel(title, across, [_label(table, row) for row in rows], designs)


def _maps_of(table: FunctionTable, attributes: Sequence[str]) -> list[_Panel]:
    """Each row of a function's table as a map: one measured value across, the other up."""
    x, y = (table.spans.get(name, [""]) for name in attributes)
    panels = []
    for row in range(len(table.outcomes)):
        designs = _designs(table, row)
        points = [[(a, b) for a in range(len(x))] for b in range(len(y))]
        has = [name in table.spans for name in attributes]
        cells = [[designs[tuple(itertools.compress(point, has))] for point in line] for line in points]
        panels.append(_Panel(f"{table.function}, now\n{_label(table, row)}", x, y, cells))
    return panels


def _draw(axes: Any, panel: _Panel, colours: dict[str, str], scale: Scale) -> None:
    import numpy as np
    from matplotlib.colors import ListedColormap

    x, y = _edges(panel.across), _edges(panel.down)
    names = list(colours)
    numbers = np.array([[names.index(design.partition(" (")[0]) for design in row] for row in panel.designs])
    axes.pcolormesh(
        x, y, numbers, cmap=ListedColormap(list(colours.values())), vmin=-0.5, vmax=len(names) - 0.5,
        edgecolors="white", linewidth=0.5,
    )  # fmt: skip
    flips = np.array([[FLIP_FLOP in design for design in row] for row in panel.designs])
    if flips.any():
        axes.pcolor(x, y, np.ma.masked_where(~flips, numbers), hatch="////", alpha=0.0)
    axes.set_xticks(*_ticks(panel.across, x, scale))
    axes.set_yticks(*_ticks(panel.down, y, scale))
    axes.grid(False)
    axes.tick_params(length=0)


def _is_number(cell: _Span | str) -> bool:
    return not isinstance(cell, str) and cell[0] == cell[1] > 0 and cell[0] % 2 == 0


def _edges(cells: Sequence[_Span | str]) -> list[float]:
    """Where cells begin and the last one ends: a single value is narrow, ranges are as wide as one another."""
    return [0.0, *itertools.accumulate(_NARROW if _is_number(cell) else 1.0 for cell in cells)]


def _ticks(cells: Sequence[_Span | str], edges: Sequence[float], scale: Scale) -> tuple[list[float], list[str]]:
    """Places and texts of the ends of ranges, and of what is no range."""
    found: dict[float, str] = {}
    for cell, begin, end in zip(cells, edges, edges[1:], strict=False):
        if isinstance(cell, str) or _is_number(cell) or cell == (0, 0):
            text = cell if isinstance(cell, str) else scale.text(*cell)
            found[(begin + end) / 2] = text.replace("not measured", "not\nmeasured")
        elif (low := scale.low(cell[0])) is not None and f"{low:f}" not in found.values():
            found[begin] = f"{low:f}"
    return list(found), list(found.values())


def _designs(table: FunctionTable, row: int) -> dict[tuple[int, ...], str]:
    """The design in use afterwards, or why there is none, for each column."""
    now = table.groundings[row][table.function]
    outcomes = table.outcomes[row].items()
    return {at: text.replace(STAYS, now, 1) if text.startswith(STAYS) else text for at, text in outcomes}


def _colours(names: set[str]) -> dict[str, str]:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    fixed = {**MODE_COLOURS, **_FIXED}
    others = itertools.cycle(dict.fromkeys((*OTHER_MODES, *map(to_hex, map(colormaps["Set2"], range(8))))))
    return {name: fixed[name] if name in fixed else next(others) for name in sorted(names, key=_low_to_high)}


def _label(table: FunctionTable, row: int) -> str:
    own, components = dict(table.groundings[row]), table.components[row]
    parts = [own.pop(table.function), *(f"{function}: {design}" for function, design in own.items())]
    parts.append(components if len(components) <= 44 else components[:41] + "...")
    return "; ".join(filter(None, parts))
