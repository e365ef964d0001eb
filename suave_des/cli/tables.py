"""Result tables on the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from suave_des.campaign.summary import METRICS, SUMMARY_COLUMNS

if TYPE_CHECKING:
    from suave_des.campaign.campaign import CampaignResult

METRIC_TITLES = {"search_time_s": "search time, s", "distance_inspected_m": "distance, m"}


def plain_table() -> Table:
    """A table that reads well on a terminal and in a plain log."""
    return Table(box=None, padding=(0, 1), pad_edge=False)


def print_table(console: Console, title: str, table: Table) -> None:
    """Print a table under its title."""
    console.print(Text(title, "bold"))
    print_trimmed(console, table)


def print_trimmed(console: Console, table: Table) -> None:
    """Print a table without the blanks that would fill its lines."""
    with console.capture() as lines:
        console.print(table)
    for line in lines.get().splitlines():
        console.file.write(line.rstrip() + "\n")


def print_summary(console: Console, result: CampaignResult) -> None:
    """Print what summary.csv says."""
    table = plain_table()
    swept = result.variation.sweep.parameters
    for parameter in swept:
        table.add_column(parameter, justify="right")
    table.add_column("manager", overflow="fold")
    for heading in ("missions", "found"):
        table.add_column(heading, justify="right")
    for metric in METRICS:
        table.add_column(METRIC_TITLES[metric], justify="right")
        table.add_column("95% interval", justify="right")
        table.add_column("std", justify="right")
    for row in result.summary:
        cells = dict(zip(SUMMARY_COLUMNS, row, strict=False))
        share = cells["found_share"]
        table.add_row(
            *map(str, row[len(SUMMARY_COLUMNS) :]),
            str(cells["manager"]),
            str(cells["n"]),
            "" if share is None else f"{float(share):.0%}",
            *(text for metric in METRICS for text in _figures(cells, metric)),
        )
    title = f"{result.loaded.scenario.name}, seed {result.seed}: means, their 95% intervals, standard deviations"
    print_table(console, title, table)


def _figures(cells: Mapping[str, object], metric: str) -> tuple[str, str, str]:
    return (
        number(cells[f"{metric}_mean"]),
        interval(cells[f"{metric}_ci95_low"], cells[f"{metric}_ci95_high"]),
        number(cells[f"{metric}_std"]),
    )


def number(value: object) -> str:
    """Two decimals, as the paper's table has; nothing for none."""
    return f"{value:.2f}" if isinstance(value, float) else ""


def interval(low: object, high: object) -> str:
    """An interval; nothing for none."""
    return f"{low:.1f} to {high:.1f}" if isinstance(low, float) and isinstance(high, float) else ""
