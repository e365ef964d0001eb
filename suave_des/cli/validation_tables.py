"""Print a validation on the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from suave_des.campaign.results import METRIC_TITLES
from suave_des.cli.console import number, plain_table, print_table
from suave_des.estimates import interval_text, percent

if TYPE_CHECKING:
    from suave_des.estimates import Estimate
    from suave_des.validation.statistics import SampleTest
    from suave_des.validation.validation import Target, Validation

_VERDICTS: Mapping[bool | None, str | Text] = {True: "met", False: Text("NOT MET", "bold red"), None: "not judged"}
_KINDS = {
    "mean": "mean",
    "std": "std",
    "ks": "KS p",
    "conclusion": "agreeing conclusions",
    "condition_median": "difference within conditions",
    "condition_std": "std ratio within conditions",
}
_TITLES = {**METRIC_TITLES, "mean_reaction_time_s": "reaction, s"}

_Rows = Iterable[Sequence[str | Text]]


def print_validation(console: Console, validation: Validation, real: str) -> None:
    """Print every table that has rows, then how many targets are met.

    Args:
        console: to print on.
        validation: what was found.
        real: what the real missions are called: "published" or "real".
    """
    for title, (left, right, make) in _TABLES.items():
        rows = list(make(validation))
        title = title.format(real=real, runs="real runs" if real == "real" else real)
        headings = [*left, *(each.replace("published", real) for each in right)]
        headings = headings if left else _place_headings(validation)
        if rows:
            table = plain_table(headings, right={*headings} - {*left, ""})
            for row in rows:
                table.add_row(*row)
            print_table(console, title, table)
            console.print()
    for line in _remarks(validation, real):
        console.print(line)


def _remarks(validation: Validation, real: str) -> Iterator[str]:
    if validation.not_found_s is not None:
        yield f"Missions that never found the pipeline count as {validation.not_found_s:g} s, on both sides."
    yield (
        f"Means must lie in the {real} mean's 95% t interval, standard deviations in the {real} one's"
        " 95% chi-square interval."
    )
    yield from _power(validation, real)
    met = [target.met for target in validation.targets]
    yield f"{_are(met.count(True), len(met))} met, {_are(met.count(False))} not met."
    if None in met:
        yield (
            f"{met.count(None)} cannot be judged: too few missions. For conclusions the simulation needs at least as"
            f" many of each manager as there are {real} ones."
        )


def _power(validation: Validation, real: str) -> Iterator[str]:
    """Say how far apart distributions are that the KS test tells apart: not rejecting them does not make them equal."""
    from scipy.special import kolmogi

    from suave_des.report.statistics import SIGNIFICANCE

    sizes = [(each.published.n, each.simulated.n) for each in validation.samples]
    if sizes:
        apart = min(float(kolmogi(SIGNIFICANCE)) * (1.0 / n + 1.0 / m) ** 0.5 for n, m in sizes)
        few = f"with so few {real} missions it is less only where the shares at or below some value differ by more than"
        rest = f"{few} about {apart:.0%}" if apart < 1.0 else "with so few missions it is hardly ever less"
        yield f"A KS p of {SIGNIFICANCE} or more does not show that distributions are equal: {rest}."


def _are(count: int, of: int | None = None) -> str:
    subject = str(count) if of is None else f"{count} of {of} {'target' if of == 1 else 'targets'}"
    return f"{subject} {'is' if count == 1 else 'are'}"


def _samples(validation: Validation) -> _Rows:
    for each in validation.samples:
        yield _TITLES[each.metric], each.manager, *_figures(each.published), *_figures(each.simulated)


def _figures(found: Estimate) -> tuple[str, ...]:
    return str(found.n), number(found.mean), number(found.std), number(found.median)


def _differences(validation: Validation) -> _Rows:
    for each in validation.samples:
        yield (
            _TITLES[each.metric],
            each.manager,
            f"{each.difference:+.2f}",
            interval_text(each.difference_interval, "+.1f"),
            number(each.std_ratio),
            interval_text(each.std_ratio_interval, ".2f"),
            _p(each.kolmogorov_smirnov),
            _p(each.anderson_darling),
        )


def _pairs(validation: Validation) -> _Rows:
    for pair in validation.pairs:
        yield (
            _TITLES[pair.metric],
            f"{pair.first}, {pair.second}",
            number(pair.published_superiority),
            number(pair.simulated_superiority),
            pair.better or "neither",
            _percent(pair.agreement),
        )


def _shares(validation: Validation) -> _Rows:
    for each in validation.shares:
        interval, share = each.published.interval, each.simulated.share
        outside = interval is not None and share is not None and not interval[0] <= share <= interval[1]
        counted = f"{each.published.count} of {each.published.n}"
        mark = "*" if outside else ""
        yield each.share.manager, each.share.name, counted, interval_text(interval, ".0%"), _percent(share), mark


def _places(validation: Validation) -> _Rows:
    """Places of detection down, managers across."""
    known = {(each.manager, each.detection_x_m): each for each in validation.places}
    for x_m in sorted({x_m for _, x_m in known}):
        row = [f"{x_m:.1f}"]
        for manager in validation.managers:
            found = known.get((manager, x_m))
            if found is None:
                row += ["", ""]
            else:
                row += [str(found.published.count) if found.published.n else "", _percent(found.simulated.share)]
        yield row


def _place_headings(validation: Validation) -> list[str]:
    return ["x, m", *(heading for manager in validation.managers for heading in (manager, "simulated"))]


def _conditions(validation: Validation) -> _Rows:
    for each in validation.conditions:
        if each.metric in METRIC_TITLES:
            yield (
                _TITLES[each.metric],
                each.manager,
                *(str(each.condition), str(each.real.n)),
                *map(number, (each.real.median, each.real.std, each.simulated.median, each.simulated.std)),
                f"{each.difference:+.2f}",
            )


def _condition_summaries(validation: Validation) -> _Rows:
    for each in validation.condition_summaries:
        figures = map(number, (each.difference, each.real_std, each.simulated_std, each.std_ratio))
        yield _TITLES[each.metric], each.manager, *figures


def _targets(validation: Validation) -> _Rows:
    for target in validation.targets:
        what = f"{_TITLES[target.what]}: {_KINDS[target.kind]}" if target.kind in _KINDS else target.what
        yield target.subject, what, *_value(target), _VERDICTS[target.met]


def _value(target: Target) -> tuple[str, str]:
    style = ".0%" if target.kind in ("conclusion", "share") else ".2f"
    value = "" if target.value is None else f"{target.value:{style}}"
    if target.low is None:
        return value, ""
    if target.high is None:
        return value, f"at least {target.low:{style}}"
    return value, interval_text((target.low, target.high), style)


def _percent(share: float | None) -> str:
    return "" if share is None else percent(share)


def _p(test: SampleTest | None) -> str:
    return "" if test is None else f"{test.p:.3f}" if test.p >= 0.001 else f"{test.p:.0e}"


_SIDE = ("n", "mean", "std", "median")
_TABLES: Mapping[str, tuple[tuple[str, ...], tuple[str, ...], Callable[[Validation], _Rows]]] = {
    "Samples: {runs}, then simulated": (("metric", "manager"), (*_SIDE, *_SIDE), _samples),
    "Simulated compared with {runs} (difference = simulated - {real})": (
        ("metric", "manager"),
        ("difference of means", "95% interval", "std ratio", "95% interval", "KS p", "AD p"),
        _differences,
    ),
    "Pairs: probability that the first is better; Mann-Whitney tests of samples of the {real} size": (
        ("metric", "first, second"),
        ("published", "simulated", "published: better", "simulated agrees"),
        _pairs,
    ),
    "Shares of missions (* the simulated one is outside the {real} one's 95% interval)": (
        ("manager", "share"),
        ("published", "95% interval", "simulated", ""),
        _shares,
    ),
    "Condition by condition: {runs}, then simulated": (
        ("metric", "manager"),
        ("condition", "n", "median", "std", "median", "std", "difference"),
        _conditions,
    ),
    "Within conditions: medians over the conditions": (
        ("metric", "manager"),
        ("|difference|", "std: published", "simulated", "ratio"),
        _condition_summaries,
    ),
    "Places of detection, by x of the point seen first: {real} number, simulated share": ((), (), _places),
    "Targets": (("of", "what"), ("simulated", "must be", ""), _targets),
}
"""Tables by title: headings of the columns that are left- and right-aligned, and the rows."""
