"""Compare a campaign with the table of the paper (SEAMS 2023, arXiv:2303.09220), made from the 60 runs behind it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas

from suave_des.errors import InputError, number_of
from suave_des.estimates import Estimate, mean_of, std_of
from suave_des.records.metrics import DISTANCE, METRICS, PAPER_METRICS, SEARCH_TIME
from suave_des.records.runs import read_runs
from suave_des.resources import shipped_folder
from suave_des.results.missions import PAPER_ORDER, Group
from suave_des.results.statistics import difference_interval
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
        published: groups of the published runs, managers in the order of the paper's table.
        ours: groups of our missions, of the same managers.
        figures: by manager, metric, and "mean" or "std": the paper's figure and ours, with 95% intervals; nan where
            there are too few missions.
    """

    published: tuple[Group, ...]
    ours: tuple[Group, ...]
    figures: dict[tuple[str, str, str], tuple[Estimate, Estimate]]

    def table(self, metric: str = "") -> Table:
        """Return the figures as text; of one metric or, with a column for that, of both."""
        rows = []
        for (manager, name, statistic), (paper, ours) in self.figures.items():
            if metric in ("", name):
                known = [paper.value == paper.value, ours.value == ours.value]
                apart = f"{ours.value - paper.value:+.2f}" if all(known) else ""
                figures = (f"{paper.value:.2f}", paper.text(".1f"), f"{ours.value:.2f}" if known[1] else "")
                mark = MARK if known[1] and not paper.contains(ours.value) else ""
                names = (manager, statistic) if metric else (manager, METRICS[name].heading, statistic)
                rows.append((*names, *figures, ours.text(".1f"), apart, mark))
        names = ("manager", "") if metric else ("manager", "metric", "")
        headings = (*names, "paper", "95% interval", "here", "95% interval", "difference", "")
        return Table(headings, rows, METRICS[metric].heading if metric else "", f"{'l' * len(names)}rrrrrl")

    def remarks(self) -> Iterator[str]:
        """Summarise the comparison in sentences."""
        known = [(paper, ours) for paper, ours in self.figures.values() if ours.value == ours.value]
        inside = sum(paper.contains(ours.value) for paper, ours in known)
        yield f"Paper: {_sizes(self.published)}. Here: {_sizes(self.ours)}. Difference = here - paper."
        if not known:
            yield "There are too few missions for any figure."
        elif inside == len(known):
            yield f"All {inside} figures lie in the 95% intervals of the paper's."
        else:
            outside = f"the one marked {MARK} does" if len(known) - inside == 1 else f"those marked {MARK} do"
            lie = "lies" if inside == 1 else "lie"
            yield f"{inside} of {len(known)} figures {lie} in the 95% intervals of the paper's; {outside} not."
        yield (
            "Intervals: Student's t for means; chi-square for standard deviations, a rough guide only, because it"
            " assumes normally distributed values."
        )
        for metric, claim in _CLAIMS.items():
            yield from self._claim(metric, claim)

    def _claim(self, metric: str, claim: str) -> Iterator[str]:
        """Say whether metacontrol is the best on average, as in the paper, and what could be chance."""
        samples = {group.name: each for group in self.ours if len(each := group.known_values(metric))}
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


def published_runs() -> Path:
    """Locate the shipped file of published runs."""
    return shipped_folder("scenarios") / "published" / "seams2023_runs.csv"


def compare_with_paper(runs: pandas.DataFrame, published: Path | None = None) -> PaperComparison:
    """Compare the missions of a campaign with published figures.

    Args:
        runs: with the columns of runs.csv.
        published: file of the published runs; managers that are not in it are left out. None: the shipped one.

    Raises:
        InputError: the file cannot be read, or has fewer than two runs of a manager.
    """
    theirs = read_runs(published or published_runs()).frame
    names = sorted(theirs["manager"].unique(), key=lambda name: (PAPER_ORDER.get(name, len(PAPER_ORDER)), name))
    known, ours = (tuple(Group(name, frame[frame["manager"] == name]) for name in names) for frame in (theirs, runs))
    figures = {}
    for groups in zip(known, ours, strict=True):
        for metric in PAPER_METRICS:
            for statistic, estimate in (("mean", mean_of), ("std", std_of)):
                paper, here = (estimate(group.known_values(metric).tolist()) for group in groups)
                if not paper.has_interval:
                    problem = f"fewer than two published runs of {groups[0].name}"
                    raise InputError(problem, place=metric, remedy="an interval needs two or more")
                figures[groups[0].name, metric, statistic] = paper, here
    return PaperComparison(known, ours, figures)


def _sizes(groups: tuple[Group, ...]) -> str:
    """Describe the number of missions of each manager."""
    sizes = {group.name: len(group.frame) for group in groups}
    if len(set(sizes.values())) == 1:
        return f"{number_of(next(iter(sizes.values())), 'mission')} for each manager"
    return ", ".join(f"{number_of(n, 'mission')} of {manager}" for manager, n in sizes.items())
