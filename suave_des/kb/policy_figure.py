"""The policy as a picture: its tables, with colours for designs."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from itertools import chain, cycle
from pathlib import Path
from typing import TYPE_CHECKING

from suave_des.errors import InputError
from suave_des.kb.policy import FLIP_FLOP, Policy, function_table
from suave_des.kb.situations import INCONSISTENT
from suave_des.knowledge.state import NO_GROUNDING, NONE_LEFT, STAYS
from suave_des.results.figures import check_picture, write_picture
from suave_des.results.style import MODE_COLOURS, OTHER_MODES, WIDTH_IN, publication
from suave_des.tables import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Units of measured values; those of a user's own attributes are not known.
_UNITS = {"water_visibility": "m", "battery_level": "share of a full battery"}
_FIXED = {
    **MODE_COLOURS,
    INCONSISTENT: "#B00020",
    NONE_LEFT: "#D9D9D9",
    NO_GROUNDING: "#FFFFFF",
}
_LEGEND = {NONE_LEFT: "none left: as before", INCONSISTENT: "contradiction"}
_ROW_IN = 0.26
_MOST_ROWS = 60
_LABEL_LETTERS = 52


def draw_policy(policy: Policy, path: Path) -> None:
    """Draw the table of each function that has a choice, with a colour for the design that is in
    use afterwards.

    Raises:
        InputError: there is no choice to draw, or there are too many rows; or the file is not a
            .png, .pdf or .svg that can be written.
    """
    check_picture(path)
    found = {name: function_table(policy, name) for name in policy.functions}
    drawn = {name: each for name, each in found.items() if _has_choice(*each)}
    if not drawn:
        raise InputError("no function has a choice to draw")
    rows = [len(table.rows) for table, _, _ in drawn.values()]
    if sum(rows) > _MOST_ROWS:
        raise InputError(
            f"there are more than {_MOST_ROWS} rows to draw",
            remedy="lower --max-failed, or use --csv",
        )
    import matplotlib.pyplot as plt

    with publication():
        used = (_designs_after(table, down) for table, down, _ in drawn.values())
        colours = _colours({*chain.from_iterable(used)})
        heights = [number + 4.0 for number in rows]
        size = WIDTH_IN, _ROW_IN * sum(heights) + 0.6
        figure, grid = plt.subplots(
            len(drawn), figsize=size, height_ratios=heights, squeeze=False, layout="constrained"
        )
        for axes, (name, each) in zip(grid.flat, drawn.items(), strict=True):
            _draw(axes, *each, colours)
            axes.set_title(name, loc="left")
        _add_legend(figure, colours)
        try:
            write_picture(figure, path, bbox_inches="tight")
        finally:
            plt.close(figure)


def _add_legend(figure: Figure, colours: Mapping[str, str]) -> None:
    from matplotlib.patches import Patch

    handles = [
        Patch(facecolor=colour, edgecolor="#8A8A8A", linewidth=0.4, label=_LEGEND.get(name, name))
        for name, colour in colours.items()
    ]
    title = "in use afterwards (rows: in use now, and what else matters)"
    figure.legend(
        handles=handles, loc="outside lower center", ncols=min(4, len(handles)), title=title
    )


def _has_choice(table: Table, down: int, across: str) -> bool:
    """Whether more than one thing can happen, besides that all stays as it is."""
    return len({*chain(*(row[down:] for row in table.rows))} - {STAYS}) > 1


def _designs_after(table: Table, down: int) -> set[str]:
    return {_then(row[0], cell) for row in table.rows for cell in row[down:]}


def _then(now: str, outcome: str) -> str:
    """The design that is in use afterwards; "stays" means the one of now."""
    return outcome.replace(STAYS, now, 1).partition(" (")[0]


def _draw(axes: Axes, table: Table, down: int, across: str, colours: dict[str, str]) -> None:
    import numpy as np
    from matplotlib.colors import ListedColormap

    names = list(colours)
    rows = sorted(table.rows, key=lambda row: _low_to_high(row[0]))
    numbers = np.array([[names.index(_then(row[0], cell)) for cell in row[down:]] for row in rows])
    axes.pcolormesh(
        numbers,
        edgecolors="white",
        linewidth=0.5,
        cmap=ListedColormap(list(colours.values())),
        vmin=-0.5,
        vmax=len(names) - 0.5,
    )
    flips = np.array([[FLIP_FLOP in cell for cell in row[down:]] for row in rows])
    if flips.any():
        axes.pcolor(np.ma.masked_where(~flips, numbers), hatch="////", alpha=0.0)
    axes.set_yticks(
        np.arange(len(rows)) + 0.5, _labels(table.headings[1:down], [row[:down] for row in rows])
    )
    axes.set_xticks([])
    if across:
        axes.set_xticks(np.arange(numbers.shape[1]) + 0.5, map(_range, table.headings[down:]))
        unit = _UNITS.get(across)
        axes.set_xlabel(f"measured {across.replace('_', ' ')}" + (f", {unit}" if unit else ""))
    axes.invert_yaxis()
    axes.grid(False)
    axes.tick_params(length=0)


def _labels(headings: Sequence[str], rows: list[Sequence[str]]) -> list[str]:
    """The design in use now, and below it what else the outcome depends on, shortened."""
    reports = {report for row in rows for text in row[1:] for report in text.split(", ")}
    labels = []
    for now, *others in rows:
        words = []
        for heading, text in zip(headings, others, strict=True):
            if heading != "components":
                words.append(f"{heading} {_range(text)}")
            else:
                is_any = len(text.split(", ")) == len(reports)
                words.append("any report" if is_any else text)
        labels.append(
            "\n".join(
                textwrap.shorten(text, _LABEL_LETTERS) for text in (now, "; ".join(words)) if text
            )
        )
    return labels


def _range(words: str) -> str:
    return words.replace(" <= . < ", " to ")


def _low_to_high(design: str) -> tuple[int, str]:
    """Order designs as their colours are: none, the shipped ones from low to high, then others by
    name.
    """
    known = [NO_GROUNDING, *MODE_COLOURS]
    return known.index(design) if design in known else len(known), design


def _colours(names: set[str]) -> dict[str, str]:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    others = cycle(dict.fromkeys((*OTHER_MODES, *map(to_hex, map(colormaps["Set2"], range(8))))))
    return {
        name: _FIXED[name] if name in _FIXED else next(others)
        for name in sorted(names, key=_low_to_high)
    }
