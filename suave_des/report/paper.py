"""Compare a campaign with the table of the paper (SEAMS 2023, arXiv:2303.09220), made from the 60 runs behind it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from suave_des.errors import InputError, number_of
from suave_des.estimates import CONFIDENCE, Estimate, Interval, estimate, interval_columns, interval_text
from suave_des.files import csv_text
from suave_des.report.compared_metrics import PAPER_METRICS
from suave_des.report.result_files import PAPER_ORDER
from suave_des.report.runs import read_runs
from suave_des.resources import shipped_folder

if TYPE_CHECKING:
    import pandas

_CLAIMS = {"search_time_s": ("find the pipeline sooner", -1.0), "distance_inspected_m": ("inspect more of it", 1.0)}
"""What the paper says that metacontrol does on average, and the sign of what is better."""

MARK = "*"
"""Marks figures outside the paper's interval."""
FILES = ("paper_table.md", "paper_table.csv")

Estimates = Mapping[tuple[str, str], Estimate]
"""Estimates by (manager, metric)."""


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """One figure of the paper's table beside ours.

    Attributes:
        manager: name of the managing subsystem.
        metric: one of PAPER_METRICS.
        statistic: "mean" or "std" (sample standard deviation).
        published: the paper's figure.
        published_interval: its 95% interval.
        ours: ours; none if there are too few missions.
        ours_interval: its 95% interval; none likewise.
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
        """Ours - published."""
        return None if self.ours is None else self.ours - self.published

    @property
    def is_inside(self) -> bool | None:
        """Whether ours lies in the 95% interval of the published one; none if there are too few missions."""
        low, high = self.published_interval
        return None if self.ours is None else low <= self.ours <= high

    def cells(self) -> tuple[str, ...]:
        """Format the paper's figure and its interval, ours, the difference, and the mark of one outside."""
        return (
            f"{self.published:.2f}",
            interval_text(self.published_interval, ".1f"),
            "" if self.ours is None else f"{self.ours:.2f}",
            interval_text(self.ours_interval, ".1f"),
            "" if self.difference is None else f"{self.difference:+.2f}",
            MARK if self.is_inside is False else "",
        )


@dataclass(frozen=True)
class PaperComparison:
    """The paper's table beside ours.

    Attributes:
        figures: by manager in the paper's order, then metric, then statistic.
        published: estimates from the published runs.
        ours: estimates from our missions.
    """

    figures: tuple[PaperFigure, ...]
    published: Estimates
    ours: Estimates

    def remarks(self) -> Iterator[str]:
        """Summarise the comparison in sentences."""
        judged = [figure.is_inside for figure in self.figures if figure.is_inside is not None]
        inside = sum(judged)
        yield f"Paper: {_sizes(self.published)}. Here: {_sizes(self.ours)}. Difference = here - paper."
        if not judged:
            yield "There are too few missions for any figure."
        elif inside == len(judged):
            yield f"All {inside} figures lie in the 95% intervals of the paper's."
        else:
            outside = f"the one marked {MARK} does" if len(judged) - inside == 1 else f"those marked {MARK} do"
            lie = "lies" if inside == 1 else "lie"
            yield f"{inside} of {len(judged)} figures {lie} in the 95% intervals of the paper's; {outside} not."
        yield (
            "Intervals: Student's t for means; chi-square for standard deviations, a rough guide only, because it"
            " assumes normally distributed values."
        )
        for metric, (claim, sign) in _CLAIMS.items():
            ours = {manager: found for (manager, name), found in self.ours.items() if name == metric and found.n}
            best = ours.pop("metacontrol", None)
            if best is None or not ours:
                continue
            means = (best.mean or 0.0, [found.mean or 0.0 for found in ours.values()])
            open_ones = [manager for manager, found in ours.items() if not _differ(best, found)]
            rest = f"; the difference from {' and '.join(open_ones)} could be chance" if open_ones else ""
            verb, _, what = claim.partition(" ")
            if all(sign * means[0] > sign * mean for mean in means[1]):
                yield f"As in the paper, metacontrol {verb}s {what} than the others, on average{rest}."
            else:
                yield f"Unlike in the paper, metacontrol does not {claim} than all others, on average{rest}."

    def markdown(self) -> str:
        """Write the comparison as Markdown."""
        lines = [
            "| manager | metric | | paper | 95% interval | here | 95% interval | difference | |",
            "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | --- |",
        ]
        for figure in self.figures:
            cells = figure.manager, PAPER_METRICS[figure.metric], figure.statistic, *figure.cells()
            lines.append(f"| {' | '.join(cells)} |".replace(MARK, f"\\{MARK}"))
        # A paragraph for each remark, in which the mark is not emphasis.
        return "\n".join([*lines, *(f"\n{remark.replace(MARK, chr(92) + MARK)}" for remark in self.remarks())]) + "\n"

    def csv(self) -> str:
        """Write the comparison as CSV, with six decimals; missing values are empty."""
        rows: list[dict[str, object]] = [
            {
                "manager": figure.manager,
                "metric": figure.metric,
                "statistic": figure.statistic,
                "published": figure.published,
                **interval_columns("published", figure.published_interval),
                "ours": figure.ours,
                **interval_columns("ours", figure.ours_interval),
                "difference": figure.difference,
                "inside_published_ci95": figure.is_inside,
            }
            for figure in self.figures
        ]
        return csv_text(list(rows[0]), (list(row.values()) for row in rows))


def published_runs() -> Path:
    """Locate the shipped file of published runs."""
    return shipped_folder("scenarios") / "published" / "seams2023_runs.csv"


def published_estimates(path: Path | None = None) -> Estimates:
    """Estimate from published runs, managers in the order of the paper's table.

    Args:
        path: of the runs; left out, the shipped ones.

    Raises:
        InputError: the file cannot be read, or lacks a column.
    """
    runs = read_runs(path or published_runs())
    names = sorted(runs.managers, key=lambda name: (PAPER_ORDER.get(name, len(PAPER_ORDER)), name))
    return _estimates(runs.frame, [(name, metric) for name in names for metric in PAPER_METRICS])


def compare(runs: pandas.DataFrame, published: Estimates) -> PaperComparison:
    """Compare the missions of a campaign with published figures.

    Args:
        runs: with the columns of runs.csv.
        published: managers that are not in it are left out.

    Raises:
        InputError: there are fewer than two published runs of a manager.
    """
    ours = _estimates(runs, published)
    figures = (figure for cell in published for figure in _figures(*cell, published[cell], ours[cell]))
    return PaperComparison(tuple(figures), published, ours)


def _estimates(runs: pandas.DataFrame, cells: Iterable[tuple[str, str]]) -> Estimates:
    return {(name, metric): estimate(runs.loc[runs["manager"] == name, metric].tolist()) for name, metric in cells}


def _figures(manager: str, metric: str, known: Estimate, ours: Estimate) -> Iterator[PaperFigure]:
    if known.mean is None or known.std is None or known.mean_interval is None or known.std_interval is None:
        problem = f"fewer than two published runs of {manager}"
        raise InputError(problem, place=metric, remedy="an interval needs two or more")
    yield PaperFigure(manager, metric, "mean", known.mean, known.mean_interval, ours.mean, ours.mean_interval)
    yield PaperFigure(manager, metric, "std", known.std, known.std_interval, ours.std, ours.std_interval)


def _differ(one: Estimate, other: Estimate) -> bool:
    """Whether Welch's test shows at 5% that two means differ."""
    from scipy.stats import ttest_ind_from_stats

    if not one.std or not other.std:
        return False
    sides = (one.mean, one.std, one.n, other.mean, other.std, other.n)
    return bool(ttest_ind_from_stats(*sides, equal_var=False).pvalue < 1.0 - CONFIDENCE)


def _sizes(estimates: Estimates) -> str:
    """Describe the number of missions of each manager."""
    sizes = {manager: found.n for (manager, _), found in estimates.items()}
    if len(set(sizes.values())) == 1:
        return f"{number_of(next(iter(sizes.values())), 'mission')} for each manager"
    return ", ".join(f"{number_of(n, 'mission')} of {manager}" for manager, n in sizes.items())
