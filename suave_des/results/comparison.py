"""A comparison, and how it is written: as text, Markdown, LaTeX in the paper's layout, CSV and JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from textwrap import fill
from typing import Any

import pandas

from suave_des.errors import number_of
from suave_des.estimates import Estimate, known
from suave_des.records.metrics import FOUND, PAPER_METRICS, Metric
from suave_des.results.missions import listed
from suave_des.results.statistics import A12, RANK_BISERIAL, SIGNIFICANCE
from suave_des.tables import Table, markdown_text

_NAN, _UNKNOWN, _NO_TABLE = math.nan, Estimate(), Table((), ())
_EFFECT = "effect"
"""Heading of the widest column, the last one, which goes where the table would be too wide."""
_EFFECTS = {
    RANK_BISERIAL: "Effect: rank-biserial correlation, 1 if the first has the greater value in all pairs.",
    A12: "Effect: A12, the probability that a mission of the first has the greater value.",
}


@dataclass(frozen=True, slots=True)
class Summary:
    """Estimates of one metric of one group of missions; nan where there are too few.

    Attributes:
        group: name of the manager, with its source or its value of a sweep where that is needed.
        metric: column of runs.csv.
        n: independent values: missions, or runs where several points of a sweep are averaged.
        missing: missions without a value, such as those without a reaction.
        mean: of `pipeline_found` the share.
        std: sample standard deviation (n - 1).
        median: the middle value.
        q1: first quartile; likewise q3.
        horizon_s: of the search time: the time to which the restricted mean reaches.
        restricted_mean_s: mean of the time until found or horizon_s, missions without it being censored.
        censored_median_s: time by which half of the missions have found the pipeline; infinite if less than half do.
    """

    group: str
    metric: str
    n: int
    missing: int
    mean: Estimate = _UNKNOWN
    std: float = _NAN
    median: float = _NAN
    q1: float = _NAN
    q3: float = _NAN
    horizon_s: float = _NAN
    restricted_mean_s: Estimate = _UNKNOWN
    censored_median_s: Estimate = _UNKNOWN

    def row(self) -> dict[str, Any]:
        """Return all of it by the columns of a file."""
        return _row(self, methods=("mean", "restricted_mean_s"))


@dataclass(frozen=True, slots=True)
class Difference:
    """Two groups of missions compared in one metric; nan or None for what there is not.

    Attributes:
        group: name of the one; likewise other.
        metric: column of runs.csv.
        paired: whether they are compared run by run.
        why: they are, or are not.
        n: values of the one, or pairs; likewise n_other.
        difference: of the means, group - other.
        test: its name; empty without a value in one of them.
        p: two-sided.
        p_holm: adjusted for all tests of this comparison.
        p_less: one-sided: that the one is not less than the other; likewise p_greater.
        effect_name: what the size of the effect is.
        effect: its size.
        variance_ratio: by how much pairing divides the variance of the difference.
        half_width: of the interval for which the number of runs is given.
        runs_needed_paired: runs of each manager for that, if they are paired; likewise runs_needed_unpaired. None: over
            ten million, or not known.
        conclusion: in one sentence.
    """

    group: str
    other: str
    metric: str
    paired: bool
    why: str
    n: int
    n_other: int
    difference: Estimate = _UNKNOWN
    test: str = ""
    p: float = _NAN
    p_holm: float = _NAN
    p_less: float = _NAN
    p_greater: float = _NAN
    effect_name: str = ""
    effect: Estimate = _UNKNOWN
    variance_ratio: float = _NAN
    half_width: float = _NAN
    runs_needed_paired: int | None = None
    runs_needed_unpaired: int | None = None
    conclusion: str = ""

    @property
    def is_significant(self) -> bool:
        """Whether the test rejects at 5%, together with all others."""
        return self.p_holm < SIGNIFICANCE

    @property
    def is_equal(self) -> bool:
        """Whether the two have the same value in each pair."""
        return self.paired and self.n > 1 and self.difference.value == 0.0 and not self.difference.has_interval

    def row(self) -> dict[str, Any]:
        """Return all of it by the columns of a file."""
        return _row(self, methods=("difference",)) | ({} if self.test else {"test": None, "effect_name": None})


def _row(found: Summary | Difference, methods: tuple[str, ...]) -> dict[str, Any]:
    """Return the fields by column: of an estimate its value, interval and, if that is wanted, how this was found."""
    row: dict[str, Any] = {}
    for each in fields(found):
        value = getattr(found, each.name)
        if isinstance(value, Estimate):
            row |= value.columns(each.name)
            if each.name in methods:
                row[f"{each.name}_interval"] = value.method if value.has_interval else None
        else:
            row[each.name] = known(value) if isinstance(value, float) else value
    return row


@dataclass(frozen=True)
class Comparison:
    """The result of a comparison.

        comparison = compare_folders([Path("before"), Path("after")])
        print(comparison.conclusion)
        comparison.difference_frame()

    Attributes:
        conclusion: in one sentence.
        summaries: by metric, then group.
        differences: by metric, then pair.
        notes: what a reader should know about the data.
        metrics: the compared metrics.
        counted: what n counts: "mission", or "run" or "draw" where missions are averaged over these.
        largest: of each pair the least and the greatest difference in the first metric, each with its run.
        replay: the command that replays both missions of the largest of these; empty: not known.
    """

    conclusion: str
    summaries: tuple[Summary, ...]
    differences: tuple[Difference, ...]
    notes: tuple[str, ...]
    metrics: tuple[Metric, ...] = field(repr=False)
    counted: str = field(default="mission", repr=False)
    largest: Table = field(default=_NO_TABLE, repr=False)
    replay: str = field(default="", repr=False)

    def summary_frame(self) -> pandas.DataFrame:
        """Return a row for each group and metric, with the columns of Summary.row()."""
        return pandas.DataFrame([each.row() for each in self.summaries])

    def difference_frame(self) -> pandas.DataFrame:
        """Return a row for each pair and metric, with the columns of Difference.row()."""
        return pandas.DataFrame([each.row() for each in self.differences])

    def sections(self) -> Iterator[tuple[str, list[Table], list[str]]]:
        """Yield of each metric its title with unit, its tables, and what follows from each difference."""
        for metric in self.metrics:
            summaries = [each for each in self.summaries if each.metric == metric.name]
            differences = [each for each in self.differences if each.metric == metric.name]
            tables = _summary_table(metric, summaries), _search_table(summaries), _difference_table(metric, differences)
            yield metric.heading, [each for each in tables if each.rows], [each.conclusion for each in differences]

    def runs_needed(self) -> Table:
        """Return the number of runs that an interval needs, for each pair and metric."""
        metrics = {metric.name: metric for metric in self.metrics}
        rows = [_runs_row(each, metrics[each.metric]) for each in self.differences if not math.isnan(each.half_width)]
        return Table(("difference", "for ±", "paired", "not paired", "variance ratio"), rows)

    def remarks(self) -> list[str]:
        """Describe how missions were compared and why, and what to know about the data."""
        return [*self.methods(), *(f"Note: {note}." for note in self.notes)]

    def methods(self) -> list[str]:
        """Describe which differences are paired and why, and how they are tested and estimated."""
        tested = [each for each in self.differences if each.test]
        whys: dict[str, dict[str, None]] = {}
        for each in tested:
            whys.setdefault(each.why, {})[f"{each.group} - {each.other}"] = None
        lines = [
            f"{capital(why)}{'' if len(whys) == 1 else f' ({listed(list(pairs), 4)})'}." for why, pairs in whys.items()
        ]
        if tested:
            over_all = f", Holm's correction over all {len(tested)}" if len(tested) > 1 else ""
            lines.append(f"Tests: {', '.join(dict.fromkeys(each.test for each in tested))}; two-sided{over_all}.")
        lines += [_EFFECTS[name] for name in dict.fromkeys(each.effect_name for each in tested) if name]
        means = (*(each.mean for each in self.summaries), *(each.difference for each in tested))
        if methods := dict.fromkeys(each.method for each in means if each.has_interval):
            lines.append(f"95% intervals: {', '.join(methods)}.")
        return lines

    def text(self, width: int = 95) -> str:
        """Write the conclusions, the tables, and the methods, for a terminal of that width."""
        parts = [folded(self.conclusion, width)]
        for title, tables, conclusions in self.sections():
            for place, table in enumerate(tables):
                heading = f"{title}\n" if place == 0 else f"{title}, {table.title}\n" if table.title else ""
                fits = table.headings[-1] != _EFFECT or table.width() <= width
                shown = table if fits else Table(table.headings[:-1], [row[:-1] for row in table.rows])
                parts.append(heading + shown.text(width))
            if conclusions:
                parts.append("\n".join(folded(f"- {each}", width) for each in conclusions))
        if (needed := self.runs_needed()).rows:
            parts.append(f"runs of each manager that an interval of the difference needs\n{needed.text(width)}")
        if self.largest.rows:
            replay = f"\nTo see both missions: {self.replay}" if self.replay else ""
            parts.append(f"{self.largest.title}\n{self.largest.text(width)}{replay}")
        parts.append("\n".join(folded(line, width) for line in self.remarks()))
        return "\n\n".join(parts) + "\n"

    def __str__(self) -> str:
        """Return all of it as text, as `suave-des compare` prints it."""
        return self.text()

    def markdown(self) -> str:
        """Write the tables and the conclusions, for a page."""
        parts = [markdown_text(self.conclusion)]
        for title, tables, conclusions in self.sections():
            parts.append(f"### {capital(title)}")
            for table in tables:
                parts += [f"{capital(table.title)}:"] if table.title else []
                parts.append(table.markdown())
            if conclusions:
                parts.append("\n".join(f"- {markdown_text(each)}" for each in conclusions))
        if self.differences:
            parts += ["### Runs needed", self.runs_needed().markdown()]
        if self.largest.rows:
            parts += [f"### {capital(self.largest.title)}", self.largest.markdown()]
            parts += [f"To see both missions: `{self.replay}`"] if self.replay else []
        return "\n\n".join([*parts, *map(markdown_text, self.remarks())]) + "\n"

    def _repr_markdown_(self) -> str:
        return self.markdown()

    def latex(self) -> str:
        """Write two tables for LaTeX with booktabs: means and standard deviations as in the paper, and differences."""
        metrics = [each for each in self.metrics if each.name in PAPER_METRICS] or list(self.metrics)
        by_group: dict[str, list[str]] = {}
        for metric in metrics:
            for each in self.summaries:
                if each.metric == metric.name:
                    cells = metric.number(each.mean.value), metric.number(each.std)
                    by_group.setdefault(each.group, [each.group]).extend(cells)
        shown = [row for row in by_group.values() if any(row[1:])]
        means = Table(("Manager", *("Mean", "Std") * len(metrics)), shown, "Means and standard deviations.")
        lines = [r"% needs \usepackage{booktabs}", *(f"% Note: {note}." for note in self.notes)]
        lines.append(
            means.latex([capital(metric.heading) for metric in metrics], label="tab:means", note=self._sizes())
        )
        if self.differences:
            rows: list[tuple[str, ...]] = []
            for metric in self.metrics:
                tested = [each for each in self.differences if each.metric == metric.name and each.test]
                rows += [(capital(metric.heading),)] if tested else []
                cells_of = (_difference_row(each, metric) for each in tested)
                rows += [(name, mean, interval, effect, p) for name, _, mean, interval, _, p, effect in cells_of]
            headings = ("Difference", "Mean", "95% interval", "Effect", "p (Holm)")
            table = Table(headings, rows, "Differences between managers.")
            text = table.latex(label="tab:differences", note=" ".join(self.methods()))
            lines.append(text.replace("p (Holm)", "$p$ (Holm)"))
        return "\n".join(lines) + "\n"

    def _sizes(self) -> str:
        sizes = {each.group: each.n for each in self.summaries if each.metric == self.metrics[0].name}
        if len(set(sizes.values())) == 1:
            return f"{number_of(next(iter(sizes.values())), self.counted)} for each manager."
        return "; ".join(f"{name}: {number_of(n, self.counted)}" for name, n in sizes.items()) + "."

    def csv(self) -> str:
        """Write all statistics as one table: a row for each group and metric, then one for each pair and metric."""
        rows = [*(each.row() for each in self.summaries), *(each.row() for each in self.differences)]
        frame = pandas.DataFrame(rows, dtype=object)
        if "other" in frame:
            frame.insert(1, "other", frame.pop("other"))
        return frame.to_csv(index=False, lineterminator="\n")

    def json(self) -> str:
        """Write all of the comparison; numbers with all their digits, null where there is none."""
        content = {
            "conclusion": self.conclusion,
            "notes": list(self.notes),
            "summaries": [each.row() for each in self.summaries],
            "differences": [each.row() for each in self.differences],
            "largest_differences": {"rows": self.largest.rows, "replay": self.replay},
        }
        return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


ENDINGS = {".csv": "csv", ".json": "json", ".md": "markdown", ".tex": "latex"}
"""Methods that write a comparison, by the ending of a file's name."""


def folded(text: str, width: int) -> str:
    """Break a paragraph into lines for a terminal of that width."""
    return fill(text, width, subsequent_indent="  " if text.startswith("- ") else "", break_on_hyphens=False)


def _summary_table(metric: Metric, summaries: Sequence[Summary]) -> Table:
    """Return the estimates of each group; a share has neither spread nor quartiles."""
    headings = ("manager", "n", "mean", "95% interval", "std", "median", "quartiles")
    width = 4 if metric.name == FOUND else len(headings)
    rows = []
    for each in summaries:
        quartiles = _interval(Estimate(each.median, each.q1, each.q3), metric)
        spread = (metric.number(each.std), metric.number(each.median), quartiles)
        row = (each.group, f"{each.n:,}", metric.number(each.mean.value), _interval(each.mean, metric), *spread)
        rows.append(row[:width])
    return Table(headings[:width], rows)


def _search_table(summaries: Sequence[Summary]) -> Table:
    """Return search times in which missions that never found the pipeline are censored; no rows for other metrics."""
    known = [each for each in summaries if not math.isnan(each.horizon_s)]
    horizon_s = min((each.horizon_s for each in known), default=0.0)
    headings = ("manager", f"mean to {horizon_s:.0f} s", "95% interval", "half found by", "95% interval")
    rows = []
    for each in known:
        if abs(each.restricted_mean_s.value - each.mean.value) < 0.005 and math.isfinite(each.censored_median_s.value):
            continue  # as in the table above
        mean, half = each.restricted_mean_s, each.censored_median_s
        ends = "not reached" if math.isinf(half.low) else f"{half.low:.0f} to {_seconds(half.high)}"
        rows.append((each.group, f"{mean.value:.2f}", mean.text(".1f"), _seconds(half.value), ends))
    return Table(headings, rows, "missions that never found it as censored (Kaplan-Meier)")


def _seconds(value: float) -> str:
    return f"{value:.0f}" if math.isfinite(value) else "not reached"


def _difference_table(metric: Metric, differences: Sequence[Difference]) -> Table:
    """Return the difference of each pair; for shares, without an effect size."""
    headings = ("difference", "n", "mean", "95% interval", "p", "p (Holm)", _EFFECT)
    width = 6 if metric.name == FOUND else len(headings)
    return Table(headings[:width], [_difference_row(each, metric)[:width] for each in differences])


def _difference_row(each: Difference, metric: Metric) -> tuple[str, ...]:
    name = f"{each.group} - {each.other}"
    n = f"{each.n:,}" if each.n == each.n_other else f"{each.n:,}, {each.n_other:,}"
    if not each.test:
        return name, n, "", "", "", "", ""
    mean, interval = metric.number(each.difference.value), _interval(each.difference, metric)
    effect = "" if math.isnan(each.effect.value) else f"{each.effect.value:.2f}"
    if each.effect.has_interval:
        effect += f" ({each.effect.text('.2f')})"
    return name, n, mean, interval, _p(each.p), _p(each.p_holm), effect


def _runs_row(each: Difference, metric: Metric) -> tuple[str, ...]:
    ratio = "" if math.isnan(each.variance_ratio) else f"{each.variance_ratio:.1f}"
    paired = f"{each.runs_needed_paired:,}" if each.runs_needed_paired else ""
    unpaired = f"{each.runs_needed_unpaired:,}" if each.runs_needed_unpaired else "over 10,000,000"
    half_width = f"{100 * each.half_width:g}%" if metric.name == FOUND else f"{each.half_width:.4g} {metric.unit}"
    return f"{each.group} - {each.other}", half_width.strip(), paired, unpaired, ratio


def _interval(found: Estimate, metric: Metric) -> str:
    """Write an interval; empty if there is none."""
    text = found.text(f".{metric.interval_decimals}f", metric.scale)
    return f"{text}%" if text and metric.name == FOUND else text


def _p(p: float) -> str:
    """Write a p-value with two significant digits."""
    if math.isnan(p):
        return ""
    if p < 1e-300:  # next to the least that a float can hold
        return "<1e-300"
    return f"{p:.3f}" if p >= 0.001 else f"{p:.0e}"


def capital(text: str) -> str:
    """Begin a text with a capital, and leave the rest as it is."""
    return text[:1].upper() + text[1:]
