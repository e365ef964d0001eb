"""Compare a campaign with the table of the paper (SEAMS 2023, arXiv:2303.09220), made from the 60 runs behind it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas

from suave_des.arguments import plain_arguments
from suave_des.errors import InputError, number_of
from suave_des.estimates import mean_of, std_of
from suave_des.records.metrics import DISTANCE, METRICS, PAPER_METRICS, SEARCH_TIME
from suave_des.records.missions import in_papers_order
from suave_des.records.runs import read_runs
from suave_des.resources import find
from suave_des.results.real import PAPERS_RUNS
from suave_des.results.statistics import difference_interval
from suave_des.results.validation import interval_column, sample, table_of
from suave_des.tables import Table, markdown_text

_CLAIMS = {SEARCH_TIME: "find the pipeline sooner", DISTANCE: "inspect more of it"}
"""What the paper says that metacontrol does on average."""
MARK = "*"
"""Marks figures outside the paper's interval."""
FILE = "paper_table.md"


@dataclass(frozen=True)
class PaperComparison:
    """The paper's table beside ours.

    Attributes:
        figures: a row for each manager, in the order of the paper's table, metric, and statistic ("mean" or "std"): the
            paper's figure (paper) and ours (here), each with the ends of its 95% interval, and difference (here -
            paper); nan where there are too few missions; mark: whether ours is outside the paper's interval.
        published: missions behind the paper's table.
        ours: missions of the same managers.
    """

    figures: pandas.DataFrame
    published: pandas.DataFrame
    ours: pandas.DataFrame

    @property
    def managers(self) -> list[str]:
        """In the order of the paper's table."""
        return list(self.figures["manager"].unique())

    def table(self, metric: str = "") -> Table:
        """Return the figures as text; of one metric or, with a column for that, of both."""
        own = self.figures[self.figures["metric"].isin([metric] if metric else PAPER_METRICS)]
        names = [("manager", "{manager}"), ("metric", "{of.heading}"), ("", "{statistic}")]
        columns = ("paper", "{paper:.2f}"), interval_column("paper", ".1f"), ("here", "{here:.2f}")
        apart = interval_column("here", ".1f"), ("difference", "{difference:+.2f}"), ("", "{mark}")
        if metric:
            del names[1]
        title = METRICS[metric].heading if metric else ""
        return table_of(own, title, f"{'l' * len(names)}rrrrrl", *names, *columns, *apart)

    def remarks(self) -> Iterator[str]:
        """Summarise the comparison in sentences."""
        sizes = self._sizes(self.published), self._sizes(self.ours)
        yield f"Paper: {sizes[0]}. Here: {sizes[1]}. Difference = here - paper."
        marks = self.figures.loc[self.figures["here"].notna(), "mark"]
        inside = int((marks == "").sum())
        rest = f"; those marked {MARK} do not" if inside < len(marks) else ""
        yield f"{inside} of {number_of(len(marks), 'figure')} lie in the 95% intervals of the paper's{rest}."
        yield (
            "Intervals: Student's t for means; chi-square for standard deviations, a rough guide only, because it"
            " assumes normally distributed values."
        )
        for metric, claim in _CLAIMS.items():
            yield from self._claim(metric, claim)

    def _sizes(self, missions: pandas.DataFrame) -> str:
        """Describe the number of missions of each manager."""
        sizes = {name: int((missions["manager"] == name).sum()) for name in self.managers}
        if len(set(sizes.values())) == 1:
            return f"{number_of(next(iter(sizes.values())), 'mission')} for each manager"
        return ", ".join(f"{number_of(n, 'mission')} of {manager}" for manager, n in sizes.items())

    def _claim(self, metric: str, claim: str) -> Iterator[str]:
        """Say whether metacontrol is the best on average, as in the paper, and what could be chance."""
        samples = {name: each for name in self.managers if len(each := sample(self.ours, name, metric))}
        best = samples.pop("metacontrol", None)
        if best is None or not samples:
            return
        apart = {name: difference_interval(best, other) for name, other in samples.items()}
        chance = [name for name, each in apart.items() if not each.has_interval or each.contains(0.0)]
        rest = f"; the difference from {' and '.join(chance)} could be chance" if chance else ""
        if all(METRICS[metric].better * each.value > 0.0 for each in apart.values()):
            verb, _, what = claim.partition(" ")
            yield f"As in the paper, metacontrol {verb}s {what} than the others, on average{rest}."
        else:
            yield f"Unlike in the paper, metacontrol does not {claim} than all others, on average{rest}."

    def markdown(self) -> str:
        """Write the comparison as Markdown."""
        return "\n\n".join([self.table().markdown(), *map(markdown_text, self.remarks())]) + "\n"


@plain_arguments
def compare_with_paper(runs: pandas.DataFrame, published: Path | None = None) -> PaperComparison:
    """Compare the missions of a campaign with published figures.

    Args:
        runs: with the columns of runs.csv.
        published: file of the published runs; managers that are not in it are left out. None: the shipped one.

    Raises:
        InputError: the file cannot be read, or has fewer than two runs of a manager.
    """
    theirs = in_papers_order(read_runs(published or find(PAPERS_RUNS, "scenarios/published")).frame)
    rows = []
    for manager in theirs["manager"].unique():
        for metric in PAPER_METRICS:
            for statistic, estimate in (("mean", mean_of), ("std", std_of)):
                paper, here = (estimate(sample(side, manager, metric).tolist()) for side in (theirs, runs))
                if not paper.has_interval:
                    problem = f"fewer than two published runs of {manager}"
                    raise InputError(problem, place=metric, remedy="an interval needs two or more")
                row = {"manager": manager, "metric": metric, "statistic": statistic}
                rows.append(row | paper.columns("paper") | here.columns("here"))
    figures = pandas.DataFrame(rows)
    ours = figures["here"].astype(float)
    is_outside = (ours < figures["paper_ci95_low"]) | (ours > figures["paper_ci95_high"])
    figures = figures.assign(difference=ours - figures["paper"], mark=np.where(is_outside, MARK, ""))
    return PaperComparison(figures, theirs, runs)
