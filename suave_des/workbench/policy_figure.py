"""The policy as a picture: which design is chosen where, over one or two measured values."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

from suave_des.errors import InputError
from suave_des.report.style import MODE_COLOURS, OTHER_MODES, VERMILION, WIDTH_IN, publication
from suave_des.workbench.policy import FLIP_FLOP, INCONSISTENT, NONE_LEFT, Policy
from suave_des.workbench.policy_table import UNGROUNDED, FunctionTable, function_table
from suave_des.workbench.regions import Region

_FIXED = {INCONSISTENT: "#B00020", NONE_LEFT: "#D9D9D9"}
_ROW_IN = 0.21
_MOST_ROWS = 60
_FLIPS = "////"


def draw_policy(policy: Policy, path: Path) -> None:
    """Draw what is chosen for each function that has a choice.

    Args:
        policy: with one or two attributes that matter.
        path: .png, .pdf or .svg.

    Raises:
        InputError: there are no or more attributes, or too many rows; or the file cannot be written.
    """
    if len(policy.attributes) not in (1, 2):
        raise InputError(
            f"the policy depends on {len(policy.attributes)} measured values", remedy="a picture needs one or two"
        )
    if path.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise InputError("is no picture that can be drawn", file=path, remedy="end it with .png, .pdf or .svg")
    tables = [table for table in (function_table(policy, name) for name in policy.functions) if _has_choice(table)]
    if not tables:
        raise InputError("no function has a choice to draw")
    if sum(len(table.rows) for table in tables) > _MOST_ROWS:
        raise InputError(f"there are more than {_MOST_ROWS} rows to draw", remedy="lower --max-failed, or use --csv")
    import matplotlib.pyplot as plt

    with publication():
        draw = _one_attribute if len(policy.attributes) == 1 else _two_attributes
        figure = draw(plt, policy, tables)
        temporary = path.with_name(f".{path.name}.part{path.suffix}")
        try:
            metadata = {"CreationDate": None} if path.suffix.lower() == ".pdf" else None
            figure.savefig(temporary, bbox_inches="tight", metadata=metadata)
            temporary.replace(path)
        except OSError as error:
            raise InputError(f"cannot be written: {error.strerror}", file=path) from None
        finally:
            temporary.unlink(missing_ok=True)
            plt.close(figure)


def _has_choice(table: FunctionTable) -> bool:
    return len({outcome for row in table.rows for outcome in row.outcomes} - {"stays"}) > 1


def _one_attribute(plt: Any, policy: Policy, tables: Sequence[FunctionTable]) -> Any:
    """One panel a function: values across, what else makes a difference down."""
    places = [_places(table) for table in tables]
    heights = [rows[-1] + 1.0 for rows in places]
    figure, panels = plt.subplots(
        len(tables),
        1,
        figsize=(WIDTH_IN, _ROW_IN * sum(heights) + 0.75 * len(tables) + 0.3),
        height_ratios=heights,
        squeeze=False,
        layout="constrained",
    )
    ends = _finite_ends([column[0] for table in tables for column in table.columns if table.attributes])
    low, high = float(ends[0]), float(ends[-1])
    margin = max((high - low) * 0.25, 0.25)
    colours = _colours(tables)
    for panel, table, rows in zip(panels[:, 0], tables, places, strict=True):
        told = ""
        for height, row in zip(rows, table.rows, strict=True):
            if row.components != told:
                told = row.components
                panel.text(low - 2.2 * margin, height - 0.58, f" components: {told}", fontsize=7, va="bottom")
            for column, outcome in zip(table.columns, row.outcomes, strict=True):
                left, width = _span(column[0] if column else None, low, high, margin)
                _tile(panel, left, height, width, _shown(outcome, row.groundings, table.function), colours)
        panel.set_yticks(rows, [_label(table, "", row.groundings) for row in table.rows])
        panel.set_ylim(rows[-1] + 0.5, -0.5)
        panel.set_xlim(low - 2.2 * margin, high + margin)
        panel.set_xticks(
            [low - 1.7 * margin, *(float(end) for end in ends)], ["not\nmeasured", *(f"{end:f}" for end in ends)]
        )
        panel.grid(False)
        panel.tick_params(length=0, axis="y")
        panel.set_title(f"{table.function}: what is grounded now (left), and then (colour)", loc="left")
    panels[-1, 0].set_xlabel(f"measured {policy.attributes[0].replace('_', ' ')}")
    _legend(figure, tables)
    return figure


def _two_attributes(plt: Any, policy: Policy, tables: Sequence[FunctionTable]) -> Any:
    """One small panel for each row of each function: one attribute across, the other up."""
    shown = [(table, row) for table in tables for row in table.rows]
    across = min(2 if len(shown) == 4 else 3, len(shown))
    down = -(-len(shown) // across)
    figure, panels = plt.subplots(
        down, across, figsize=(WIDTH_IN, 2.2 * down + 0.6), squeeze=False, layout="constrained"
    )
    for panel in panels.flat[len(shown) :]:
        panel.set_axis_off()
    colours = _colours(tables)
    for panel, (table, row) in zip(panels.flat, shown, strict=False):
        x_name, y_name = policy.attributes
        spans, all_ends = {}, {}
        for name in policy.attributes:
            place = table.attributes.index(name) if name in table.attributes else None
            ends = _finite_ends([] if place is None else [column[place] for column in table.columns])
            all_ends[name] = ends
            low, high = float(ends[0]), float(ends[-1])
            spans[name] = (low, high, max((high - low) * 0.25, 0.25))
        for column, outcome in zip(table.columns, row.outcomes, strict=True):
            at = dict(zip(table.attributes, column, strict=True))
            left, width = _span(at.get(x_name), *spans[x_name])
            bottom, height = _span(at.get(y_name), *spans[y_name])
            if width and height:
                text = _shown(outcome, row.groundings, table.function)
                hatch = _FLIPS if FLIP_FLOP in text else None
                panel.add_patch(_patch(left, bottom, width, height, _colour(text, colours), hatch))
        for name, limit in ((x_name, panel.set_xlim), (y_name, panel.set_ylim)):
            low, high, margin = spans[name]
            limit(low - 2.2 * margin, high + margin)
        for name, set_ticks in ((x_name, panel.set_xticks), (y_name, panel.set_yticks)):
            low, _, margin = spans[name]
            ends = all_ends[name] if name in table.attributes else []
            set_ticks([low - 1.7 * margin, *map(float, ends)], ["none", *(f"{end:f}" for end in ends)])
        panel.tick_params(length=0)
        panel.set_title(f"now {_label(table, row.components, row.groundings)}", fontsize=7.5)
        panel.set_xlabel(f"measured {x_name.replace('_', ' ')}")
        panel.set_ylabel(f"measured {y_name.replace('_', ' ')}")
        panel.grid(False)
    _legend(figure, tables)
    return figure


def _places(table: FunctionTable) -> list[float]:
    """Heights of the rows, with room for a line above each group of component reports."""
    height, places, told = -1.0, [], ""
    for row in table.rows:
        height += 1.0 if row.components == told else 1.8
        told = row.components
        places.append(height)
    return places


def _finite_ends(regions: Sequence[Region]) -> list[Decimal]:
    ends = {end for region in regions for end in (region.low, region.high) if end is not None}
    return sorted(ends) or [Decimal(0)]


def _span(region: Region | None, low: float, high: float, margin: float) -> tuple[float, float]:
    """Left end and width of a range: the outermost ones end at the margins, no measurement stands left of all."""
    if region is None:
        return low - 2.2 * margin, high - low + 3.2 * margin
    if region.is_missing:
        return low - 2.2 * margin, margin
    start = low - margin if region.low is None else float(region.low)
    end = high + margin if region.high is None else float(region.high)
    return start, end - start


def _shown(outcome: str, groundings: Sequence[tuple[str, str]], function: str) -> str:
    """The design in force afterwards, or why there is none."""
    now = dict(groundings).get(function, UNGROUNDED)
    return outcome.replace("stays", now, 1) if outcome.startswith("stays") else outcome


def _tile(panel: Any, left: float, row: float, width: float, text: str, colours: dict[str, str]) -> None:
    if width > 0.0:
        hatch = _FLIPS if FLIP_FLOP in text else None
        panel.add_patch(_patch(left, row - 0.42, width, 0.84, _colour(text, colours), hatch))
    else:  # one value alone
        panel.plot([left], [row], marker="D", markersize=3.5, color=_colour(text, colours), markeredgecolor="black")


def _patch(left: float, bottom: float, width: float, height: float, colour: str, hatch: str | None = None) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((left, bottom), width, height, facecolor=colour, edgecolor="white", linewidth=0.5, hatch=hatch)


def _colour(text: str, colours: dict[str, str]) -> str:
    return colours[text.partition(" (")[0]]


def _colours(tables: Sequence[FunctionTable]) -> dict[str, str]:
    names = sorted(
        {
            _shown(outcome, row.groundings, table.function).partition(" (")[0]
            for table in tables
            for row in table.rows
            for outcome in row.outcomes
        }
    )
    fixed = {**MODE_COLOURS, **_FIXED, UNGROUNDED: "#FFFFFF"}
    others = iter((*OTHER_MODES, VERMILION) * len(names))
    return {name: fixed[name] if name in fixed else next(others) for name in names}


def _label(table: FunctionTable, components: str, groundings: Sequence[tuple[str, str]]) -> str:
    own = dict(groundings)
    parts = [own.pop(table.function, ""), *(f"{function}: {design}" for function, design in own.items())]
    if components:
        parts.append(components if len(components) <= 44 else components[:41] + "...")
    return "; ".join(part for part in parts if part)


def _legend(figure: Any, tables: Sequence[FunctionTable]) -> None:
    from matplotlib.patches import Patch

    words = {NONE_LEFT: "none left: as before", INCONSISTENT: "contradiction"}
    handles = [
        Patch(facecolor=colour, edgecolor="#8A8A8A", linewidth=0.4, label=words.get(name, name))
        for name, colour in _colours(tables).items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(4, len(handles)))
