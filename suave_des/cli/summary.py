"""Summary of a campaign on the terminal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

from suave_des.campaign.display import estimated
from suave_des.campaign.progress import GroupProgress
from suave_des.campaign.results import METRIC_TITLES, METRICS, SUMMARY_COLUMNS, CampaignResult
from suave_des.campaign.stopping import UntilCi
from suave_des.campaign.variation import cell_of
from suave_des.cli.console import fits, number, plain_table, print_table
from suave_des.estimates import interval_text, percent

_STOPS_LISTED = 8
_ROWS_SHOWN = 40
"""Of a sweep with more, the first ones."""


@dataclass(frozen=True)
class _Look:
    """How wide the summary is.

    Attributes:
        breaks_after: characters after which a name goes on in a new line.
        digits: of swept values, significant ones; files have all.
        has_std: standard deviations are shown.
    """

    breaks_after: str = ""
    digits: int = 6
    has_std: bool = True

    def broken(self, name: str) -> str:
        """Break a name into lines."""
        return "".join(f"{letter}\n" if letter in self.breaks_after else letter for letter in name).replace(" \n", "\n")

    def shown(self, value: object) -> str:
        """Round a swept value for reading."""
        return f"{value:.{self.digits}g}" if isinstance(value, float) else str(value)


_LOOKS = (_Look(), _Look(".:"), _Look(".:", has_std=False), _Look(".:_ ", digits=4, has_std=False))
"""From the widest on."""


def print_summary(console: Console, result: CampaignResult) -> None:
    """Print the rows of summary.csv; what does not fit into the console's width is broken up, then left out."""
    for look in _LOOKS:
        table = _summary(result, look)
        if fits(console, table):
            break
    title = f"{result.loaded.scenario.name}, seed {result.spec.seed}: means ± half their 95% intervals"
    print_table(console, f"{title}, standard deviations" if look.has_std else title, table)
    if (sharing := result.variation.runs_sharing_draw) > 1:
        console.print(f"{sharing} runs share each draw: intervals treat draws as independent, not runs")
    if len(result.summary) > _ROWS_SHOWN:
        more = len(result.summary) - _ROWS_SHOWN + 1
        where = "" if result.folder is None else f", all in {result.folder}/summary.csv"
        console.print(f"... and {more} rows more{where}")


def _summary(result: CampaignResult, look: _Look) -> Table:
    table = plain_table()
    for parameter in result.variation.sweep.parameters:
        table.add_column(look.broken(parameter), justify="right", overflow="fold")
    table.add_column("manager", overflow="fold")
    for heading in ("missions", "found"):
        table.add_column(heading, justify="right", no_wrap=True)
    for metric in METRICS:
        table.add_column(look.broken(METRIC_TITLES[metric]), justify="right", no_wrap=True)
        if look.has_std:
            table.add_column("std", justify="right", no_wrap=True)
    rows = result.summary if len(result.summary) <= _ROWS_SHOWN else result.summary[: _ROWS_SHOWN - 1]
    for row in rows:
        cells = dict(zip(SUMMARY_COLUMNS, row, strict=False))
        share = cells["found_share"]
        table.add_row(
            *map(look.shown, row[len(SUMMARY_COLUMNS) :]),
            look.broken(str(cells["manager"])),
            str(cells["n"]),
            "" if share is None else percent(float(share)),
            *(text for metric in METRICS for text in _figures(cells, metric)[: 1 + look.has_std]),
        )
    return table


def _figures(cells: Mapping[str, object], metric: str) -> tuple[str, str]:
    mean, low, high = (cells[f"{metric}_{figure}"] for figure in ("mean", "ci95_low", "ci95_high"))
    half_width = (high - low) / 2.0 if isinstance(low, float) and isinstance(high, float) else None
    return estimated(mean if isinstance(mean, float) else None, half_width), number(cells[f"{metric}_std"])


def print_stops(console: Console, result: CampaignResult) -> None:
    """Print which managers were stopped early, and whose interval is still too wide."""
    if (until := result.spec.until) is None:
        return
    if until.pair is not None:
        _print_pairs(console, result, until)
        return
    narrow = [stop for stop in result.stops if stop.is_narrow]
    if narrow:
        listed = ", ".join(f"{_group(result, stop)} after run {stop.runs}" for stop in narrow[:_STOPS_LISTED])
        listed += f", and {len(narrow) - _STOPS_LISTED} more" if len(narrow) > _STOPS_LISTED else ""
        console.print(f"stopped with {until.metric} ± less than {until.half_width:g}: {listed}")
    wide = [stop for stop in result.stops if not stop.is_narrow]
    for stop in wide[:_STOPS_LISTED]:
        width = "has no interval" if stop.half_width is None else f"± {stop.half_width:.4g}"
        console.print(
            f"not reached: {_group(result, stop)}: {until.metric} {width} after all {stop.runs} runs,"
            f" not less than {until.half_width:g}",
        )
    if len(wide) > _STOPS_LISTED:
        console.print(f"not reached: {len(wide) - _STOPS_LISTED} more, all in {result.folder}/manifest.json")
    if wide:
        console.print(f"more runs: suave-des campaign --resume {result.folder} --runs N")


def _print_pairs(console: Console, result: CampaignResult, until: UntilCi) -> None:
    """Print how well the difference of two managers is known, at each point."""
    name, limit = " - ".join(until.pair or ()), f"less than {until.half_width:g}"
    for pair in result.pairs[:_STOPS_LISTED]:
        what = f"{name}{_swept(result, pair.point)}: {until.metric}"
        known = "no run in both" if pair.difference is None else estimated(pair.difference, pair.half_width)
        verdict = limit if pair.is_narrow else f"not reached: not {limit}"
        console.print(f"{what} {known} ({pair.n} runs in pairs; ± {verdict})")
    if len(result.pairs) > _STOPS_LISTED:
        console.print(f"{len(result.pairs) - _STOPS_LISTED} more are in {result.folder}/manifest.json")
    if not all(pair.is_narrow for pair in result.pairs):
        console.print(f"more runs: suave-des campaign --resume {result.folder} --runs N")


def _group(result: CampaignResult, stop: GroupProgress) -> str:
    return f"{stop.manager}{_swept(result, stop.point)}"


def _swept(result: CampaignResult, point: int) -> str:
    return "".join(f" {name}={cell_of(value)}" for name, value in result.variation.sweep.values(point).items())


def print_differences(console: Console, result: CampaignResult) -> None:
    """Print how managers differ, and in how many of the ensemble's parameter sets they do so in the same direction."""
    found = result.differences()
    if not found:
        return
    table = plain_table(
        (*result.variation.sweep.parameters, "first - second", "difference", "by chance", "over the sets", "same sign"),
        right={*result.variation.sweep.parameters, "difference", "by chance", "over the sets", "same sign"},
        overflow="fold",
    )
    title = ""
    for each in found:
        if each.metric != title:
            title = each.metric
            table.add_row(*[""] * len(result.variation.sweep.parameters), METRIC_TITLES[each.metric])
        swept = map(str, map(cell_of, result.variation.sweep.values(each.point).values()))
        same = f"{max(each.above, each.below)} of {len(each.member_means)}"
        ranges = (interval_text(each.interval, "+.1f"), interval_text(each.range, "+.1f"))
        table.add_row(*swept, f"  {each.first} - {each.second}", f"{each.mean:+.2f}", *ranges, same)
    console.print()
    print_table(console, "Differences, paired by run, with 95% ranges", table)
