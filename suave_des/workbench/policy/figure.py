"""The policy as a picture: the chosen design over one or two measured values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

from suave_des.errors import InputError
from suave_des.knowledge.deliberation import NONE_LEFT, STAYS
from suave_des.knowledge.state import NO_GROUNDING
from suave_des.report.figures import check_picture, write_picture
from suave_des.report.style import MODE_COLOURS, OTHER_MODES, VERMILION, WIDTH_IN, publication
from suave_des.workbench.policy.cases import FLIP_FLOP, INCONSISTENT, Policy
from suave_des.workbench.policy.table import FunctionTable, TableRow, function_table
from suave_des.workbench.ranges import ValueRange

_FIXED = {INCONSISTENT: "#B00020", NONE_LEFT: "#D9D9D9", NO_GROUNDING: "#FFFFFF"}
_LEGEND = {NONE_LEFT: "none left: as before", INCONSISTENT: "contradiction"}
_ROW_IN = 0.21
_MOST_ROWS = 60


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

    with publication():
        colours = _colours(tables)
        draw = _one_attribute if len(policy.attributes) == 1 else _two_attributes
        figure = draw(plt, policy, tables, colours)
        handles = [
            Patch(facecolor=colour, edgecolor="#8A8A8A", linewidth=0.4, label=_LEGEND.get(name, name))
            for name, colour in colours.items()
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=min(4, len(handles)))
        try:
            write_picture(figure, path, bbox_inches="tight")
        finally:
            plt.close(figure)


def _has_choice(table: FunctionTable) -> bool:
    return len({outcome for row in table.rows for outcome in row.outcomes} - {STAYS}) > 1


@dataclass(frozen=True)
class _Axis:
    """Places ranges of measured values along an axis: the outermost end at its margins, "not measured" comes first."""

    ends: tuple[Decimal, ...]

    @classmethod
    def of(cls, ranges: Iterable[ValueRange]) -> _Axis:
        ends = {end for one in ranges for end in (one.low, one.high) if end is not None}
        return cls(tuple(sorted(ends)) or (Decimal(0),))

    @property
    def margin(self) -> float:
        return max(float(self.ends[-1] - self.ends[0]) * 0.25, 0.25)

    @property
    def limits(self) -> tuple[float, float]:
        return float(self.ends[0]) - 2.2 * self.margin, float(self.ends[-1]) + self.margin

    def span(self, one: ValueRange | None) -> tuple[float, float]:
        """Left end and width of a range; without one, the whole axis."""
        left, right = self.limits
        if one is None:
            return left, right - left
        if one.is_missing:
            return left, self.margin
        start = float(self.ends[0]) - self.margin if one.low is None else float(one.low)
        return start, (right if one.high is None else float(one.high)) - start

    def show(self, set_limits: Callable[..., Any], set_ticks: Callable[..., Any], missing: str) -> None:
        set_limits(*self.limits)
        ticks = [float(self.ends[0]) - 1.7 * self.margin, *map(float, self.ends)]
        set_ticks(ticks, [missing, *(f"{end:f}" for end in self.ends)])


def _one_attribute(plt: Any, policy: Policy, tables: Sequence[FunctionTable], colours: Mapping[str, str]) -> Any:
    """One panel a function: values across, all else that has an effect down."""
    heights = [_row_heights(table) for table in tables]
    figure, panels = plt.subplots(
        len(tables),
        1,
        figsize=(WIDTH_IN, _ROW_IN * sum(rows[-1] + 1.0 for rows in heights) + 0.75 * len(tables) + 0.3),
        height_ratios=[rows[-1] + 1.0 for rows in heights],
        squeeze=False,
        layout="constrained",
    )
    axis = _Axis.of(column[0] for table in tables for column in table.columns if column)
    for panel, table, rows in zip(panels[:, 0], tables, heights, strict=True):
        above = ""
        for height, row in zip(rows, table.rows, strict=True):
            if row.components != above:
                above = row.components
                panel.text(axis.limits[0], height - 0.58, f" components: {above}", fontsize=7, va="bottom")
            for column, outcome in zip(table.columns, row.outcomes, strict=True):
                across = axis.span(column[0] if column else None)
                _tile(panel, across, (height - 0.42, 0.84), _design_after(outcome, row, table), colours)
        panel.set_yticks(rows, [_label(table, "", row.groundings) for row in table.rows])
        panel.set_ylim(rows[-1] + 0.5, -0.5)
        axis.show(panel.set_xlim, panel.set_xticks, "not\nmeasured")
        panel.grid(False)
        panel.tick_params(length=0, axis="y")
        panel.set_title(f"{table.function}: what is grounded now (left), and then (colour)", loc="left")
    panels[-1, 0].set_xlabel(f"measured {policy.attributes[0].replace('_', ' ')}")
    return figure


def _two_attributes(plt: Any, policy: Policy, tables: Sequence[FunctionTable], colours: Mapping[str, str]) -> Any:
    """One small panel for each row of each function: one attribute across, the other up."""
    shown = [(table, row) for table in tables for row in table.rows]
    across = min(2 if len(shown) == 4 else 3, len(shown))
    down = -(-len(shown) // across)
    figure, panels = plt.subplots(
        down, across, figsize=(WIDTH_IN, 2.2 * down + 0.6), squeeze=False, layout="constrained"
    )
    for panel in panels.flat[len(shown) :]:
        panel.set_axis_off()
    x_name, y_name = policy.attributes
    for panel, (table, row) in zip(panels.flat, shown, strict=False):
        columns = [dict(zip(table.attributes, column, strict=True)) for column in table.columns]
        x, y = (_Axis.of(column[name] for column in columns if name in column) for name in policy.attributes)
        for column, outcome in zip(columns, row.outcomes, strict=True):
            spans = x.span(column.get(x_name)), y.span(column.get(y_name))
            if all(width for _, width in spans):
                _tile(panel, *spans, _design_after(outcome, row, table), colours)
        x.show(panel.set_xlim, panel.set_xticks, "none")
        y.show(panel.set_ylim, panel.set_yticks, "none")
        panel.tick_params(length=0)
        panel.set_title(f"now {_label(table, row.components, row.groundings)}", fontsize=7.5)
        panel.set_xlabel(f"measured {x_name.replace('_', ' ')}")
        panel.set_ylabel(f"measured {y_name.replace('_', ' ')}")
        panel.grid(False)
    return figure


def _row_heights(table: FunctionTable) -> list[float]:
    """Heights of the rows, with space for a line above each group of component reports."""
    height, heights, above = -1.0, [], ""
    for row in table.rows:
        height += 1.0 if row.components == above else 1.8
        above = row.components
        heights.append(height)
    return heights


def _tile(
    panel: Any, across: tuple[float, float], up: tuple[float, float], text: str, colours: Mapping[str, str]
) -> None:
    """Draw a rectangle, or for one single value a diamond."""
    from matplotlib.patches import Rectangle

    (left, width), (bottom, height) = across, up
    colour = colours[text.partition(" (")[0]]
    if width > 0.0:
        hatch = "////" if FLIP_FLOP in text else None
        panel.add_patch(
            Rectangle((left, bottom), width, height, facecolor=colour, edgecolor="white", linewidth=0.5, hatch=hatch)
        )
    else:
        middle = bottom + height / 2.0
        panel.plot([left], [middle], marker="D", markersize=3.5, color=colour, markeredgecolor="black")


def _design_after(outcome: str, row: TableRow, table: FunctionTable) -> str:
    """The design in use afterwards, or why there is none."""
    now = row.groundings.get(table.function, NO_GROUNDING)
    return outcome.replace(STAYS, now, 1) if outcome.startswith(STAYS) else outcome


def _colours(tables: Sequence[FunctionTable]) -> dict[str, str]:
    shown = {_design_after(each, row, table) for table in tables for row in table.rows for each in row.outcomes}
    names = sorted({text.partition(" (")[0] for text in shown})
    fixed = {**MODE_COLOURS, **_FIXED}
    others = iter((*OTHER_MODES, VERMILION) * len(names))
    return {name: fixed[name] if name in fixed else next(others) for name in names}


def _label(table: FunctionTable, components: str, groundings: Mapping[str, str]) -> str:
    own = dict(groundings)
    parts = [own.pop(table.function, ""), *(f"{function}: {design}" for function, design in own.items())]
    parts.append(components if len(components) <= 44 else components[:41] + "...")
    return "; ".join(filter(None, parts))
