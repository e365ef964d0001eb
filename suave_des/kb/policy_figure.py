"""The policy as a picture: the chosen design over one or two measured values."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from suave_des.errors import InputError
from suave_des.kb.policy import FLIP_FLOP, FunctionTable, Policy, function_table
from suave_des.kb.space import INCONSISTENT
from suave_des.knowledge.state import NO_GROUNDING, NONE_LEFT, STAYS
from suave_des.results.figures import check_picture, write_picture
from suave_des.results.style import MODE_COLOURS, OTHER_MODES, WIDTH_IN, publication

#: Units of measured values; those of a user's own attributes are not known.
_UNITS: Final = {"water_visibility": "m", "battery_level": "share of a full battery"}
_FIXED: Final = {**MODE_COLOURS, INCONSISTENT: "#B00020", NONE_LEFT: "#D9D9D9", NO_GROUNDING: "#FFFFFF"}
_LEGEND: Final = {NONE_LEFT: "none left: as before", INCONSISTENT: "contradiction"}
_ROW_IN: Final = 0.21
_MOST_ROWS: Final = 60


class _Panel(NamedTuple):
    """A grid of cells: its title, what is along either side, and the designs in use afterwards."""

    title: str
    across: Sequence[str]
    down: Sequence[str]
    designs: Sequence[Sequence[str]]


def draw_policy(policy: Policy, path: Path) -> None:
    """Draw what is chosen for each function that has a choice.

    Args:
        policy: with an effect of one or two measured values.
        path: .png, .pdf or .svg.

    Raises:
        InputError: there are no or more attributes, or too many rows; or the file cannot be written.
    """
    attributes = policy.space.attributes
    if len(attributes) not in (1, 2):
        raise InputError(
            f"the policy depends on {len(attributes)} measured values", remedy="a picture needs one or two"
        )
    check_picture(path)
    tables = [function_table(policy, name) for name in policy.functions]
    tables = [table for table in tables if len({text for row in table.outcomes for text in row.values()} - {STAYS}) > 1]
    if not tables:
        raise InputError("no function has a choice to draw")
    if sum(len(table.outcomes) for table in tables) > _MOST_ROWS:
        raise InputError(f"there are more than {_MOST_ROWS} rows to draw", remedy="lower --max-failed, or use --csv")
    import matplotlib.pyplot as plt
    from matplotlib.patches import Patch

    is_flat = len(attributes) == 1
    panels = [panel for table in tables for panel in _panels(table, policy)]
    columns = 1 if is_flat else 2 if len(panels) == 4 else min(3, len(panels))
    lines = -(-len(panels) // columns)
    heights = [len(panel.down) + 4.0 for panel in panels] if is_flat else [11.0] * lines
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
    return ",\n".join(filter(None, (f"measured {attribute.replace('_', ' ')}", _UNITS.get(attribute))))


def _low_to_high(design: str) -> tuple[int, str]:
    """Order designs as their colours are: none, the shipped ones from low to high, then others by name."""
    known = [NO_GROUNDING, *MODE_COLOURS]
    return known.index(design) if design in known else len(known), design


def _panels(table: FunctionTable, policy: Policy) -> Iterator[_Panel]:
    """A function's table: one measured value across, all else down; of two values, a map for each row of the table."""
    sides = [
        [policy.space.scale.text(*span) for span in table.spans.get(name, ())] or [""]
        for name in policy.space.attributes
    ]
    has = [name in table.spans for name in policy.space.attributes]
    rows = sorted(range(len(table.outcomes)), key=lambda row: _low_to_high(table.groundings[row][table.function]))
    labels, lines = [], []
    for row in rows:
        now, components = table.groundings[row][table.function], table.components[row]
        others = (f"{name}: {design}" for name, design in table.groundings[row].items() if name != table.function)
        labels.append("; ".join(filter(None, (now, *others, components[:44]))))
        # What is in use afterwards; "stays" means the design of now.
        designs = {at: text.replace(STAYS, now, 1) for at, text in table.outcomes[row].items()}
        points = itertools.product(*map(range, map(len, reversed(sides))))
        cells = [designs[tuple(itertools.compress(reversed(point), has))] for point in points]
        lines.append([cells[at : at + len(sides[0])] for at in range(0, len(cells), len(sides[0]))])
    if len(sides) == 1:
        title = f"{table.function}: what is grounded now (left), and then (colour)"
        yield _Panel(title, sides[0], labels, [line for (line,) in lines])
    else:
        for label, cells_of in zip(labels, lines, strict=True):
            yield _Panel(f"{table.function}, now\n{label}", sides[0], sides[1], cells_of)


def _draw(axes: Any, panel: _Panel, colours: dict[str, str]) -> None:
    import numpy as np
    from matplotlib.colors import ListedColormap

    names = list(colours)
    numbers = np.array([[names.index(design.partition(" (")[0]) for design in row] for row in panel.designs])
    cells = {"cmap": ListedColormap(list(colours.values())), "vmin": -0.5, "vmax": len(names) - 0.5}
    axes.pcolormesh(numbers, edgecolors="white", linewidth=0.5, **cells)
    flips = np.array([[FLIP_FLOP in design for design in row] for row in panel.designs])
    if flips.any():
        axes.pcolor(np.ma.masked_where(~flips, numbers), hatch="////", alpha=0.0)
    axes.set_xticks(np.arange(len(panel.across)) + 0.5, panel.across, rotation=30, ha="right")
    axes.set_yticks(np.arange(len(panel.down)) + 0.5, panel.down)
    axes.grid(False)
    axes.tick_params(length=0)


def _colours(names: set[str]) -> dict[str, str]:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    others = itertools.cycle(dict.fromkeys((*OTHER_MODES, *map(to_hex, map(colormaps["Set2"], range(8))))))
    return {name: _FIXED[name] if name in _FIXED else next(others) for name in sorted(names, key=_low_to_high)}
