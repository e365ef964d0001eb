"""Result tables on the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from suave_des.campaign.display import estimated
from suave_des.campaign.early_stop import parse_until_ci
from suave_des.campaign.plan import Group
from suave_des.campaign.summary import METRIC_TITLES, METRICS, SUMMARY_COLUMNS
from suave_des.campaign.sweep import cell_of

if TYPE_CHECKING:
    from suave_des.campaign.campaign import CampaignResult

_STOPS_TOLD = 8


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
    """Print what summary.csv says; what does not fit into the console's width is broken up, then left out."""
    for breaks_names, has_std in ((False, True), (True, True), (True, False)):
        table = _summary(result, breaks_names=breaks_names, has_std=has_std)
        if console.measure(table, options=console.options.update(width=1000)).maximum <= console.width:
            break
    title = f"{result.loaded.scenario.name}, seed {result.seed}: means ± half their 95% intervals"
    print_table(console, f"{title}, standard deviations" if has_std else title, table)


def _summary(result: CampaignResult, *, breaks_names: bool, has_std: bool) -> Table:
    table = plain_table()
    for parameter in result.variation.sweep.parameters:
        table.add_column(parameter.replace(".", ".\n") if breaks_names else parameter, justify="right")
    table.add_column("manager", overflow="fold")
    for heading in ("missions", "found"):
        table.add_column(heading, justify="right")
    for metric in METRICS:
        table.add_column(METRIC_TITLES[metric], justify="right", no_wrap=True)
        if has_std:
            table.add_column("std", justify="right", no_wrap=True)
    for row in result.summary:
        cells = dict(zip(SUMMARY_COLUMNS, row, strict=False))
        share = cells["found_share"]
        manager = str(cells["manager"])
        table.add_row(
            *map(str, row[len(SUMMARY_COLUMNS) :]),
            manager.replace(":", ":\n") if breaks_names else manager,
            str(cells["n"]),
            "" if share is None else f"{float(share):.0%}",
            *(text for metric in METRICS for text in _figures(cells, metric)[: 1 + has_std]),
        )
    return table


def _figures(cells: Mapping[str, object], metric: str) -> tuple[str, str]:
    mean, low, high = (cells[f"{metric}_{figure}"] for figure in ("mean", "ci95_low", "ci95_high"))
    half_width = (high - low) / 2.0 if isinstance(low, float) and isinstance(high, float) else None
    return estimated(mean if isinstance(mean, float) else None, half_width), number(cells[f"{metric}_std"])


def print_stops(console: Console, result: CampaignResult) -> None:
    """Say which managers were stopped early, and of which the interval is still too wide."""
    if result.until_ci is None:
        return
    until = parse_until_ci(result.until_ci)
    narrow = [stop for stop in result.stops if stop.reached]
    if narrow:
        told = ", ".join(f"{_group(result, stop.group)} after run {stop.last_run}" for stop in narrow[:_STOPS_TOLD])
        told += f", and {len(narrow) - _STOPS_TOLD} more" if len(narrow) > _STOPS_TOLD else ""
        console.print(f"stopped with {until.metric} ± less than {until.half_width:g}: {told}", soft_wrap=True)
    wide = [stop for stop in result.stops if not stop.reached]
    for stop in wide[:_STOPS_TOLD]:
        width = "has no interval" if stop.half_width is None else f"± {stop.half_width:.4g}"
        console.print(
            f"not reached: {_group(result, stop.group)}: {until.metric} {width} after all {stop.last_run} runs,"
            f" not less than {until.half_width:g}",
            soft_wrap=True,
        )
    if len(wide) > _STOPS_TOLD:
        console.print(f"not reached: {len(wide) - _STOPS_TOLD} more, all in {result.folder}/manifest.json")
    if wide:
        console.print(f"more runs: suave-des campaign --resume {result.folder} --runs N", soft_wrap=True)


def _group(result: CampaignResult, group: Group) -> str:
    point, manager = group
    values = result.variation.sweep.values(point)
    return " ".join([result.managers[manager], *(f"{name}={cell_of(value)}" for name, value in values.items())])


def number(value: object) -> str:
    """Two decimals, as the paper's table has; nothing for none."""
    return f"{value:.2f}" if isinstance(value, float) else ""


def interval(low: object, high: object) -> str:
    """An interval; nothing for none."""
    return f"{low:.1f} to {high:.1f}" if isinstance(low, float) and isinstance(high, float) else ""
