"""What a validation says, on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from suave_des.campaign.results import METRIC_TITLES
from suave_des.cli.console import number, plain_table, print_table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from rich.console import Console
    from rich.table import Table

    from suave_des.estimates import Estimate
    from suave_des.validation.shares import Counted
    from suave_des.validation.targets import Target
    from suave_des.validation.validation import Validation

_VERDICTS = {True: "met", False: "[bold red]NOT MET[/]", None: "not judged"}
_KINDS = {"mean": "mean", "std": "std", "ks": "KS p", "conclusion": "agreeing conclusions"}


def print_validation(console: Console, validation: Validation) -> None:
    """Print every table, then the targets and how many are met."""
    for title, make in _TABLES.items():
        table = make(validation)
        if table.row_count:
            print_table(console, title, table)
            console.print()
    for line in _remarks(validation):
        console.print(line, soft_wrap=True)


def _remarks(validation: Validation) -> Iterator[str]:
    yield (
        "Means must lie in the published mean's 95% t interval, standard deviations in the published one's"
        " 95% chi-square interval."
    )
    met = [target.met for target in validation.targets]
    yield f"{met.count(True)} of {len(met)} targets are met, {met.count(False)} are not met."
    if None in met:
        yield (
            f"{met.count(None)} cannot be judged: too few missions. For conclusions the simulation needs at least as"
            " many of each manager as are published."
        )


def _table(left: tuple[str, ...], right: tuple[str, ...]) -> Table:
    table = plain_table()
    for heading in left:
        table.add_column(heading)
    for heading in right:
        table.add_column(heading, justify="right")
    return table


def _samples(validation: Validation) -> Table:
    side = ("n", "mean", "std", "median")
    table = _table(("metric", "manager"), (*side, *side))
    for cell in validation.cells:
        row = METRIC_TITLES[cell.metric], cell.manager, *_figures(cell.published), *_figures(cell.simulated)
        table.add_row(*row)
    return table


def _figures(found: Estimate) -> tuple[str, ...]:
    return str(found.n), number(found.mean), number(found.std), number(found.median)


def _differences(validation: Validation) -> Table:
    headings = ("means differ by", "95% interval", "std ratio", "95% interval", "KS p", "AD p")
    table = _table(("metric", "manager"), headings)
    for cell in validation.cells:
        table.add_row(
            METRIC_TITLES[cell.metric],
            cell.manager,
            f"{cell.difference:+.2f}",
            _interval(cell.difference_interval, "+.1f"),
            number(cell.std_ratio),
            _interval(cell.std_ratio_interval, ".2f"),
            _p(cell.kolmogorov_smirnov.p),
            _p(cell.anderson_darling.p),
        )
    return table


def _pairs(validation: Validation) -> Table:
    headings = ("published", "simulated", "published: better", "simulated agrees")
    table = _table(("metric", "first, second"), headings)
    for pair in validation.pairs:
        table.add_row(
            METRIC_TITLES[pair.metric],
            f"{pair.first}, {pair.second}",
            number(pair.published_superiority),
            number(pair.simulated_superiority),
            pair.better or "neither",
            _percent(pair.agreement),
        )
    return table


def _shares(validation: Validation) -> Table:
    headings = ("published", "95% interval", "simulated", "")
    table = _table(("manager", "share"), headings)
    for each in validation.shares:
        interval, share = each.published.interval, each.simulated.share
        outside = interval is not None and share is not None and not interval[0] <= share <= interval[1]
        table.add_row(
            each.share.manager,
            each.share.name,
            _counted(each.published),
            _interval(interval, ".0%"),
            _percent(share),
            "*" if outside else "",
        )
    return table


def _positions(validation: Validation) -> Table:
    """Places of detection down, managers across."""
    table = _table((), ("x, m",))
    known = {}
    for position in validation.positions:
        known[position.manager, position.detection_x_m] = position
    for manager in validation.managers:
        table.add_column(manager, justify="right")
        table.add_column("simulated", justify="right")
    for x_m in sorted({x_m for _, x_m in known}):
        row = [f"{x_m:.1f}"]
        for manager in validation.managers:
            found = known.get((manager, x_m))
            row += ["", ""] if found is None else [_count(found.published), _percent(found.simulated.share)]
        table.add_row(*row)
    return table


def _count(counted: Counted) -> str:
    return str(counted.count) if counted.n else ""


def _targets(validation: Validation) -> Table:
    table = _table(("of", "what"), ("simulated", "must be"))
    table.add_column("")
    for target in validation.targets:
        what = f"{METRIC_TITLES[target.what]}: {_KINDS[target.kind]}" if target.kind in _KINDS else target.what
        value, bounds = _value(target)
        table.add_row(target.subject, what, value, bounds, _VERDICTS[target.met])
    return table


def _value(target: Target) -> tuple[str, str]:
    style = ".0%" if target.kind in ("conclusion", "share") else ".2f"
    value = "" if target.value is None else f"{target.value:{style}}"
    if target.low is None:
        return value, ""
    if target.high is None:
        return value, f"at least {target.low:{style}}"
    return value, f"{target.low:{style}} to {target.high:{style}}"


def _interval(interval: tuple[float, float] | None, style: str) -> str:
    return "" if interval is None else f"{interval[0]:{style}} to {interval[1]:{style}}"


def _percent(share: float | None) -> str:
    return "" if share is None else f"{share:.0%}"


def _counted(counted: Counted) -> str:
    return f"{counted.count} of {counted.n}"


def _p(p: float) -> str:
    return f"{p:.3f}" if p >= 0.001 else f"{p:.0e}"


_TABLES: Mapping[str, Callable[[Validation], Table]] = {
    "Samples: published, then simulated": _samples,
    "Simulated against published": _differences,
    "Pairs: probability that the first is better; Mann-Whitney tests of samples of the published size": _pairs,
    "Shares of missions (* the simulated one is outside the published one's 95% interval)": _shares,
    "Places of detection, by x of the point seen first: published number, simulated share": _positions,
    "Targets": _targets,
}
