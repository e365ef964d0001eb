"""A mission as a timeline to read."""

from __future__ import annotations

import os
from textwrap import fill
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from suave_des.cli.tables import print_trimmed

if TYPE_CHECKING:
    from suave_des.simulation.result import Event, MissionMetrics, MissionResult

_STYLES = {
    "task_requested": "bold",
    "task_done": "bold",
    "mission_ended": "bold",
    "pipeline_detected": "bold green",
    "component_status": "red",
    "first_measurement": "cyan",
    "visibility_crossing": "cyan",
    "inferred": "magenta",
    "adaptation": "yellow",
    "no_design_left": "red",
    "refused": "red",
    "mode_requested": "dim",
}
"""By event; one that is not here, such as an outside manager's, has none."""
_LEAST_WIDTH = 72
"""Lines are not wrapped shorter than this: a narrower terminal wraps them itself."""


def print_timeline(console: Console, result: MissionResult) -> None:
    """Print what happened, and the metrics."""
    metrics = result.metrics
    console.print(
        Text(f"{metrics.scenario}, manager {metrics.manager}, run {metrics.run}, seed {metrics.seed}", "bold"),
        soft_wrap=True,
    )
    console.print()
    sources = max((len(event.source) for event in result.events), default=0)
    names = max((len(event.event) for event in result.events), default=0)
    console.print(Text(f"{'time, s':>8}  {'source':<{sources}}  {'event':<{names}}  detail", "italic"), soft_wrap=True)
    # Elsewhere an event is one line, for tools that search.
    width = max(console.width, _LEAST_WIDTH) if console.is_terminal or "COLUMNS" in os.environ else None
    for event in result.events:
        console.print(_line(event, sources, names, width), soft_wrap=True)
    console.print()
    print_trimmed(console, _metrics(metrics))


def _line(event: Event, sources: int, names: int, width: int | None) -> Text:
    """An event; one that does not fit into a width has its detail in lines of its own."""
    source, name = event.source.replace("_", " "), event.event.replace("_", " ")
    time_text = f"{event.t_s:8.2f}  "
    begin = f"{time_text}{source:<{sources}}  {name:<{names}}  "
    line = f"{begin}{event.detail}"
    if width is not None and len(line) > width:
        indent = " " * (len(time_text) + 2)
        detail = fill(event.detail, width, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)
        line = f"{begin.rstrip()}\n{detail}"
    text = Text(line, no_wrap=True)
    text.stylize(_STYLES.get(event.event, ""), len(time_text))
    return text


def _metrics(metrics: MissionMetrics) -> Table:
    found = metrics.pipeline_found
    table = Table.grid(padding=(0, 2))
    table.add_column()
    table.add_column(justify="right")
    table.add_column()
    limit = "" if found else "not found: the time limit counts"
    table.add_row("search time", f"{metrics.search_time_s:.1f} s", limit)
    table.add_row("distance inspected", f"{metrics.distance_inspected_m:.2f} m")
    if metrics.mean_reaction_time_s is None:
        table.add_row("mean reaction time", "none", "no reaction was completed")
    else:
        table.add_row("mean reaction time", f"{metrics.mean_reaction_time_s:.2f} s")
    table.add_row("adaptations", str(metrics.adaptations))
    table.add_row("mission duration", f"{metrics.mission_duration_s:.1f} s")
    return table
