"""Our figures beside published ones: difference, intervals, and what can be said of them."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from suave_des.errors import InputError
from suave_des.estimates import Estimate, Interval, estimate
from suave_des.report.published import METRICS, Figures

if TYPE_CHECKING:
    import pandas

_DECIMALS = 6
_BETTER = {
    "search_time_s": ("finds the pipeline sooner", "does not find the pipeline sooner", -1.0),
    "distance_inspected_m": ("inspects more of it", "does not inspect more of it", 1.0),
}
"""What the paper says of metacontrol, its opposite, and the sign of what is better."""

MARK = "*"
"""Marks figures outside the paper's interval."""


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure of the paper's table beside ours.

    Attributes:
        manager: name of the managing subsystem.
        metric: column of runs.csv.
        statistic: "mean" or "std" (sample standard deviation).
        published: the paper's figure, with its 95% interval.
        ours: ours, with its 95% interval; none if there are too few missions.
    """

    manager: str
    metric: str
    statistic: str
    published: float
    published_interval: Interval
    ours: float | None
    ours_interval: Interval | None

    @property
    def difference(self) -> float | None:
        """Ours less the published one."""
        return None if self.ours is None else self.ours - self.published

    @property
    def is_inside(self) -> bool | None:
        """Whether ours lies in the 95% interval of the published one; none if there are too few missions."""
        low, high = self.published_interval
        return None if self.ours is None else low <= self.ours <= high


@dataclass(frozen=True)
class Comparison:
    """The paper's table beside ours.

    Attributes:
        figures: by manager in the paper's order, then metric, then statistic.
        published: what is known of the published runs, by (manager, metric).
        ours: what is known of ours.
    """

    figures: tuple[Figure, ...]
    published: Figures
    ours: Figures

    def remarks(self) -> Iterator[str]:
        """What can be said of the comparison, in sentences."""
        told = [figure.is_inside for figure in self.figures if figure.is_inside is not None]
        inside = sum(told)
        yield f"Paper: {_sizes(self.published)}. Here: {_sizes(self.ours)}. Difference: here less paper."
        if not told:
            yield "There are too few missions for any figure."
        elif inside == len(told):
            yield f"All {inside} figures lie in the 95% intervals of the paper's."
        else:
            yield (
                f"{inside} of {len(told)} figures lie in the 95% intervals of the paper's; those marked {MARK} do not."
            )
        yield (
            "Intervals: Student's t for means; chi-square for standard deviations, a rough guide only, because it"
            " supposes normally distributed values."
        )
        for metric, (sooner, does_not, sign) in _BETTER.items():
            means = {manager: found.mean for (manager, name), found in self.ours.items() if name == metric}
            best = means.pop("metacontrol", None)
            others = [mean for mean in means.values() if mean is not None]
            if best is None or not others:
                continue
            if all(sign * best > sign * mean for mean in others):
                yield f"As in the paper, metacontrol {sooner} than the others, on average."
            else:
                yield f"Unlike in the paper, metacontrol {does_not} than all others, on average."


def compare(runs: pandas.DataFrame, published: Figures) -> Comparison:
    """Compare the missions of a campaign with published figures.

    Args:
        runs: with the columns of runs.csv.
        published: by (manager, metric); managers that are not in it are left out.

    Raises:
        InputError: there are fewer than two published runs of a manager.
    """
    ours = {
        (manager, metric): estimate(runs.loc[runs["manager"] == manager, metric].tolist())
        for manager, metric in published
    }
    figures = (
        figure
        for (manager, metric), known in published.items()
        for figure in _figures(manager, metric, known, ours[manager, metric])
    )
    return Comparison(tuple(figures), published, ours)


def _figures(manager: str, metric: str, known: Estimate, ours: Estimate) -> Iterator[Figure]:
    if known.mean is None or known.std is None or known.mean_interval is None or known.std_interval is None:
        problem = f"fewer than two published runs of {manager}"
        raise InputError(problem, place=metric, remedy="an interval needs two or more")
    yield Figure(manager, metric, "mean", known.mean, known.mean_interval, ours.mean, ours.mean_interval)
    yield Figure(manager, metric, "std", known.std, known.std_interval, ours.std, ours.std_interval)


def _sizes(figures: Figures) -> str:
    """How many missions there are of each manager."""
    sizes = {manager: found.n for (manager, _), found in figures.items()}
    if len(set(sizes.values())) == 1:
        return f"{next(iter(sizes.values()))} missions for each manager"
    return ", ".join(f"{n} missions of {manager}" for manager, n in sizes.items())


def markdown_table(comparison: Comparison) -> str:
    """The comparison as Markdown."""
    lines = [
        "| manager | metric | | paper | 95% interval | here | 95% interval | difference | |",
        "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | --- |",
    ]
    for figure in comparison.figures:
        cells = (
            figure.manager,
            METRICS[figure.metric],
            figure.statistic,
            _number(figure.published),
            _interval(figure.published_interval),
            _number(figure.ours),
            _interval(figure.ours_interval),
            "" if figure.difference is None else f"{figure.difference:+.2f}",
            f"\\{MARK}" if figure.is_inside is False else "",
        )
        lines.append(f"| {' | '.join(cells)} |")
    # Each remark a paragraph; the mark is no emphasis.
    return "\n".join([*lines, *(f"\n{remark.replace(MARK, chr(92) + MARK)}" for remark in comparison.remarks())]) + "\n"


def csv_table(comparison: Comparison) -> str:
    """The comparison as CSV, with all digits that mean something."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(
        (
            *("manager", "metric", "statistic", "published", "published_ci95_low", "published_ci95_high"),
            *("ours", "ours_ci95_low", "ours_ci95_high", "difference", "inside_published_ci95"),
        )
    )
    for figure in comparison.figures:
        numbers = (
            figure.published,
            *figure.published_interval,
            figure.ours,
            *(figure.ours_interval or (None, None)),
            figure.difference,
        )
        rounded = ("" if value is None else repr(round(value, _DECIMALS)) for value in numbers)
        writer.writerow((figure.manager, figure.metric, figure.statistic, *rounded, figure.is_inside))
    return buffer.getvalue()


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"


def _interval(interval: Interval | None) -> str:
    return "" if interval is None else f"{interval[0]:.1f} to {interval[1]:.1f}"
