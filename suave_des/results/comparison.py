"""A comparison in words and tables: what is concluded, and how it is written, in LaTeX in the
paper's layout.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import pandas

from suave_des.errors import number_of
from suave_des.estimates import Estimate, interval_names
from suave_des.records.metrics import FOUND, PAPER_METRICS, SEARCH_TIME, Metric
from suave_des.results.conclusions import conclusion, overall_conclusion
from suave_des.results.groups import Groups
from suave_des.results.statistics import A12, RANK_BISERIAL
from suave_des.tables import EFFECT, LATEX_NEEDS, Section, Table, TableRow, Written, capital, listed

_NO_TABLE = Table((), ())
_EFFECTS = {
    RANK_BISERIAL: "Effect: rank-biserial correlation, 1 if the first has the greater value in all pairs.",
    A12: "Effect: A12, the probability that a mission of the first has the greater value.",
}
_WORSE = 0.9
"""Ratio of variances below which pairing is said to be worse than not pairing; chance explains what
is nearer 1.
"""


def _ends(name: str) -> tuple[str, ...]:
    return name, *interval_names(name)


_SUMMARY = (
    *("group", "metric", "n", "missing", *_ends("mean"), "mean_interval", "std"),
    *("median", "q1", "q3", "horizon_s", *_ends("restricted_mean_s")),
    *("restricted_mean_s_interval", *_ends("censored_median_s")),
)
_DIFFERENCE = (
    *("group", "other", "metric", "paired", "why", "n", "n_other"),
    *(*_ends("difference"), "difference_interval", "mean_test", "mean_p", "mean_p_holm"),
    *("test", "p", "p_holm", "p_less", "p_greater", "effect_name", *_ends("effect")),
    *("share_greater", "share_less", "variance_ratio", "half_width"),
    *("runs_needed_paired", "runs_needed_unpaired", "conclusion"),
)
"""Columns of the frames, in order."""


def estimate_in(row: TableRow, name: str) -> Estimate:
    """Return an estimate from the three columns that have it, as of Estimate.columns."""
    value, low, high = (
        math.nan if row[each] is None else row[each] for each in (name, *interval_names(name))
    )
    return Estimate(value, low, high)


@dataclass(frozen=True)
class Comparison(Written):
    """The result of a comparison.

        comparison = compare_folders(["before", "after"])
        comparison.differences[["group", "other", "difference", "p_holm"]]

    In the frames, columns that end in `_ci95_low` and `_ci95_high` are the ends of the 95% interval
    of the one before, whose method is in the column that ends in `_interval`; nan where there are
    too few values.

    Attributes:
        summaries: a row for each metric and group: group (name of the manager, with its source or
            its value of a sweep where that is needed), metric, n (independent values: missions, or
            runs where several points of a sweep are averaged), missing (missions without a value),
            mean (of `pipeline_found` the share), std, median, q1 and q3; of the search time
            horizon_s (the shortest time limit, up to which search times count; missions that had
            not found the pipeline by then have it as their time), restricted_mean_s (the mean up to
            it) and censored_median_s (time by which half of the missions have found the pipeline;
            nan if less than half do).
        differences: a row for each metric and pair: group, other, metric, paired (whether they are
            compared run by run), why, n (values of the one, or pairs), n_other, difference (of the
            means, group - other), mean_test, mean_p (two-sided: that the means are equal; none of
            shares), mean_p_holm (adjusted for all these tests of this comparison), test (of ranks,
            or of shares), p (two-sided), p_holm (adjusted likewise), p_less (one-sided: that the
            one is not less than the other), p_greater, effect_name, effect, share_greater (of
            pairs, or of comparisons of each with each, in which the one has more), share_less,
            variance_ratio (by how much pairing divides the variance of the
            difference), half_width (of the interval for which the number of runs is given),
            runs_needed_paired (runs of each manager for that, if they are paired),
            runs_needed_unpaired (none: over ten million, or not known), and conclusion.
        of_groups: the rows of summaries, with whole estimates; likewise of_pairs those of
            differences.
        counted: what n counts: "mission", or "run" or "draw" where missions are averaged over
            these.
        largest: of each pair the least and the greatest difference in the first metric, each with
            its run.
        replay: the command that replays both missions of the largest of these; empty: not known.
    """

    conclusion: str
    notes: tuple[str, ...]
    of_groups: Sequence[TableRow] = field(repr=False)
    of_pairs: Sequence[TableRow] = field(repr=False)
    metrics: tuple[Metric, ...] = field(repr=False)
    counted: str = field(default="mission", repr=False)
    largest: Table = field(default=_NO_TABLE, repr=False)
    replay: str = field(default="", repr=False)

    @cached_property
    def summaries(self) -> pandas.DataFrame:
        """What is estimated of each group; see the class."""
        return _frame(self.of_groups, _SUMMARY).astype({"horizon_s": "Float64"})

    @cached_property
    def differences(self) -> pandas.DataFrame:
        """What is estimated of each pair; see the class."""
        counts = dict.fromkeys(("runs_needed_paired", "runs_needed_unpaired"), "Int64")
        return _frame(self.of_pairs, _DIFFERENCE).astype(counts)

    def frames(self) -> dict[str, pandas.DataFrame]:
        """Return both frames."""
        return {"summaries": self.summaries, "differences": self.differences}

    def sections(self) -> Iterator[Section]:
        """Yield the tables of each metric, the numbers of runs that intervals need, and the runs
        that differ most.
        """
        needed: list[tuple[str, ...]] = []
        for metric in self.metrics:
            pairs = _of_metric(self.of_pairs, metric)
            needed += [_runs_row(each, metric) for each in pairs if each["half_width"] is not None]
            yield Section(
                metric.heading, self._tables(metric), [each["conclusion"] for each in pairs]
            )
        if needed:
            headings = ("difference", "for ±", "paired", "not paired", "variance ratio")
            title = "runs of each manager that an interval of the difference needs"
            yield Section(title, [Table(headings, needed)])
        if self.largest.rows:
            below = f"To see both missions: {self.replay}" if self.replay else ""
            table = Table(self.largest.headings, self.largest.rows)
            yield Section(self.largest.title, [table], below=below)

    def _tables(self, metric: Metric) -> list[Table]:
        groups = _of_metric(self.of_groups, metric)
        differences = _difference_table(metric, _of_metric(self.of_pairs, metric))
        tables = (_summary_table(metric, groups), _search_table(groups), differences)
        return [table for table in tables if table.rows]

    def remarks(self) -> list[str]:
        """Describe how missions were compared and why, and what to know about the data."""
        return [*self._methods(), *(f"Note: {note}." for note in self.notes)]

    def _methods(self) -> Iterator[str]:
        """Describe which differences are paired and why, and how they are tested and estimated."""
        tested = self.differences[self.differences["test"].notna()]
        whys = tested.groupby("why", sort=False)
        for why, own in whys:
            pairs = list(dict.fromkeys(own["group"] + " - " + own["other"]))
            yield f"{capital(str(why))}{'' if len(whys) == 1 else f' ({listed(pairs, 4)})'}."
        if len(tested):
            yield f"Tests: {', '.join(tested['test'].unique())}; two-sided{_over_all(len(tested))}."
        of_means = tested["mean_test"].dropna()
        if len(of_means):
            yield f"Tests of means: {', '.join(of_means.unique())}; two-sided{_over_all(len(of_means))}."
        yield from (_EFFECTS[name] for name in tested["effect_name"].unique() if name)
        intervals = self.summaries["mean_interval"], tested["difference_interval"]
        methods = pandas.concat(intervals).dropna().unique()
        if len(methods):
            yield f"95% intervals: {', '.join(methods)}."

    def latex(self) -> str:
        """Write two tables for LaTeX with booktabs: means and standard deviations as in the paper,
        and differences.
        """
        notes = [f"% Note: {note}." for note in self.notes]
        lines = [LATEX_NEEDS, *notes, self._latex_of_means(), *self._latex_of_differences()]
        return "\n".join(lines) + "\n"

    @cached_property
    def _has_headings(self) -> bool:
        """Whether tables have a heading for each point of a sweep, at which managers are
        compared.
        """
        return any(each["point"] for each in self.of_pairs)

    def _by_point(self, rows: Sequence[TableRow], metric: Metric) -> list[TableRow]:
        """Return the rows of a metric, those of a point of a sweep together."""
        points = dict.fromkeys(each["point"] for each in (*self.of_groups, *self.of_pairs))
        own = _of_metric(rows, metric)
        return [each for point in points for each in own if each["point"] == point]

    def _latex_of_means(self) -> str:
        metrics = [each for each in self.metrics if each.name in PAPER_METRICS] or self.metrics
        rows: dict[str, list[str]] = {}
        for metric in metrics:
            for each in self._by_point(self.of_groups, metric):
                name = each["group"]
                if self._has_headings:
                    rows.setdefault(each["point"], [each["point"].removeprefix(", ")])
                    name = name.removesuffix(each["point"])
                cells = metric.number(each["mean"].value), metric.number(each["std"])
                rows.setdefault(each["group"], [name]).extend(cells)
        shown = [row for row in rows.values() if {*row[1:]} != {""}]
        headings = ("Manager", *("Mean", "Std") * len(metrics))
        table = Table(headings, shown, "Means and standard deviations.")
        over = [capital(metric.heading) for metric in metrics]
        return table.latex(over, label="tab:means", note=self._sizes())

    def _latex_of_differences(self) -> Iterator[str]:
        """Yield one table of all metrics; where it has points of a sweep, one of each metric, as a
        page holds no more.
        """
        note = " ".join(self._methods())
        found = [(metric, rows) for metric in self.metrics if (rows := self._latex_rows(metric))]
        if self._has_headings:
            for metric, rows in found:
                title = f"Differences between managers: {metric.heading}."
                label = f"tab:differences-{metric.name.replace('_', '-')}"
                yield _latex_differences(rows, title, label, note)
        elif self.of_pairs:
            together = [row for metric, own in found for row in ((capital(metric.heading),), *own)]
            title = "Differences between managers."
            yield _latex_differences(together, title, "tab:differences", note)

    def _latex_rows(self, metric: Metric) -> list[tuple[str, ...]]:
        """Return the rows of differences in a metric, with each point of a sweep above its own."""
        rows: list[tuple[str, ...]] = []
        before = ""
        for each in self._by_point([each for each in self.of_pairs if each["test"]], metric):
            point = each["point"]
            if point != before:
                before = point
                rows.append((point.removeprefix(", "),))
            names = (each[side].removesuffix(point) for side in ("group", "other"))
            _, _, mean, interval, _, p, effect = _difference_row(each, metric)
            rows.append((" \N{MINUS SIGN} ".join(names), mean, interval, effect, p))
        return rows

    def _sizes(self) -> str:
        sizes = self.summaries.drop_duplicates("group").set_index("group")["n"]
        low = int(sizes.min())
        high = int(sizes.max())
        where = " at each point" if self._has_headings else ""
        if low == high:
            return f"{number_of(low, self.counted)} for each manager{where}."
        if where:
            return f"{low} to {number_of(high, self.counted)} for each manager{where}."
        return "; ".join(f"{name}: {number_of(n, self.counted)}" for name, n in sizes.items()) + "."

    def _content(self) -> TableRow:
        return {
            **super()._content(),
            "largest_differences": {"rows": self.largest.rows, "replay": self.replay},
        }


def _latex_differences(rows: Sequence[tuple[str, ...]], title: str, label: str, note: str) -> str:
    headings = ("Difference", "Mean", "95% interval", "Effect", "p (Holm)")
    text = Table(headings, rows, title).latex(label=label, note=note)
    return text.replace("p (Holm)", "$p$ (Holm)")


def _of_metric(rows: Sequence[TableRow], metric: Metric) -> list[TableRow]:
    return [each for each in rows if each["metric"] == metric.name]


def _names_of(pair: TableRow) -> str:
    return f"{pair['group']} - {pair['other']}"


def _over_all(tests: int) -> str:
    return f", Holm's correction over all {tests}" if tests > 1 else ""


# Tables


def _summary_table(metric: Metric, summaries: Sequence[TableRow]) -> Table:
    """Return the estimates of each group; a share has neither spread nor quartiles."""
    headings = ("manager", "n", "mean", "95% interval", "std", "median", "quartiles")
    width = 4 if metric.name == FOUND else len(headings)
    rows = []
    for each in summaries:
        quartiles = (
            ""
            if each["q1"] is None
            else metric.interval(Estimate(each["median"], each["q1"], each["q3"]))
        )
        mean = metric.number(each["mean"].value), metric.interval(each["mean"])
        spread = metric.number(each["std"]), metric.number(each["median"]), quartiles
        rows.append((each["group"], f"{each['n']:,}", *mean, *spread)[:width])
    return Table(headings[:width], rows)


def _search_table(summaries: Sequence[TableRow]) -> Table:
    """Return search times in which missions that never found the pipeline are censored; no rows for
    other metrics.
    """
    known = [each for each in summaries if each["horizon_s"] is not None]
    horizon_s = min((each["horizon_s"] for each in known), default=0.0)
    mean_to = f"mean to {horizon_s:.0f} s"
    headings = ("manager", mean_to, "95% interval", "half found by", "95% interval")
    rows = []
    for each in known:
        mean = each["restricted_mean_s"]
        half = each["censored_median_s"]
        if abs(mean.value - each["mean"].value) < 0.005 and math.isfinite(half.value):
            continue  # as in the table above
        is_reached = math.isfinite(half.low)
        ends = f"{half.low:.0f} to {_seconds(half.high)}" if is_reached else "not reached"
        rows.append(
            (each["group"], f"{mean.value:.2f}", mean.text(".1f"), _seconds(half.value), ends)
        )
    return Table(headings, rows, "missions that never found it as censored (Kaplan-Meier)")


def _seconds(value: float) -> str:
    return f"{value:.0f}" if math.isfinite(value) else "not reached"


def _difference_table(metric: Metric, differences: Sequence[TableRow]) -> Table:
    """Return the difference of each pair; for shares, without an effect size."""
    headings = ("difference", "n", "mean", "95% interval", "p", "p (Holm)", EFFECT)
    width = 6 if metric.name == FOUND else len(headings)
    return Table(headings[:width], [_difference_row(each, metric)[:width] for each in differences])


def _difference_row(each: TableRow, metric: Metric) -> tuple[str, ...]:
    sizes = dict.fromkeys((each["n"], each["n_other"]))
    names = _names_of(each), ", ".join(f"{n:,}" for n in sizes)
    if not each["test"]:
        return *names, "", "", "", "", ""
    mean = each["difference"]
    size = estimate_in(each, "effect")
    effect = "" if each["effect"] is None else f"{size.value:.2f}"
    effect += f" ({size.text('.2f')})" if size.has_interval else ""
    return (
        *names,
        "" if math.isnan(mean.value) else metric.difference(mean.value),
        metric.difference_interval(mean),
        _p(each["p"]),
        _p(each["p_holm"]),
        effect,
    )


def _runs_row(each: TableRow, metric: Metric) -> tuple[str, ...]:
    ratio = "" if each["variance_ratio"] is None else f"{each['variance_ratio']:.1f}"
    paired = f"{each['runs_needed_paired']:,}" if each["runs_needed_paired"] else ""
    needed = each["runs_needed_unpaired"]
    unpaired = f"{needed:,}" if needed else "over 10,000,000"
    if metric.name == FOUND:
        half = f"{100 * each['half_width']:g} points"
    else:
        half = f"{each['half_width']:.4g} {metric.unit}".strip()
    return _names_of(each), half, paired, unpaired, ratio


def _p(p: float) -> str:
    """Write a p-value with two significant digits."""
    if p < 1e-300:  # next to the least that a float can hold
        return "<1e-300"
    return f"{p:.3f}" if p >= 0.001 else f"{p:.0e}"


# Conclusions


def concluded(
    groups: Groups,
    summaries: Sequence[TableRow],
    differences: Sequence[TableRow],
    largest: Table,
    replay: str,
) -> Comparison:
    """Write what follows from the estimates of groups and their differences; `largest` and `replay`
    as of Comparison.

    Summaries and differences have the columns of Comparison's frames, but whole estimates.
    """
    by_name = {metric.name: metric for metric in groups.metrics}
    tested = [row for row in differences if row["test"]]
    for row in differences:
        row["tests"] = len(tested)
        row["conclusion"] = conclusion(row, by_name[row["metric"]])
    sentences = " ".join(_conclusions(groups, summaries, differences))
    notes = (*groups.missions.notes, *groups.notes, *_worse_paired(differences))
    points = {group.name: group.point for group in groups.groups}
    of_groups = [
        dict.fromkeys(_SUMMARY) | {"mean": Estimate(), "point": points[row["group"]]} | row
        for row in summaries
    ]
    of_pairs = []
    for row in differences:
        point = points[row["group"]]
        common = point if point == points[row["other"]] else ""
        of_pairs.append(dict.fromkeys(_DIFFERENCE) | {"point": common} | row)
    return Comparison(
        sentences, notes, of_groups, of_pairs, groups.metrics, groups.counted, largest, replay
    )


def _frame(rows: Sequence[TableRow], columns: tuple[str, ...]) -> pandas.DataFrame:
    """Make a frame of rows, of each estimate its value, the ends of its interval, and how that is
    found.
    """
    plain = []
    for row in rows:
        cells = dict(row)
        for name, found in row.items():
            if isinstance(found, Estimate):
                cells |= found.columns(name)
                cells[f"{name}_interval"] = found.method if found.has_interval else None
        plain.append(cells)
    return pandas.DataFrame(plain, columns=columns)


def _means(summaries: Sequence[TableRow], metric: Metric) -> dict[str, float]:
    """Return the mean of a metric of each group that has one."""
    return {
        each["group"]: each["mean"].value
        for each in summaries
        if each["metric"] == metric.name and "mean" in each
    }


def _conclusions(
    groups: Groups, summaries: Sequence[TableRow], differences: Sequence[TableRow]
) -> Iterator[str]:
    """Yield the conclusion; of points of a sweep at which managers are compared, one for those that
    have the same.
    """
    metric = groups.metrics[0]
    means = _means(summaries, metric)
    points_of: dict[str, list[str]] = {}
    for point, names in _names_at_points(groups):
        own = {name: means[name] for name in names if name in means}
        text = overall_conclusion(metric, differences, own, names)
        if metric.name == SEARCH_TIME:
            text = f"{_lost(groups, names)}{text}"
        without_point = text.replace(point, "") if point else text
        points_of.setdefault(without_point, []).append(point.removeprefix(", "))
    for text, where in points_of.items():
        yield f"{'; '.join(where)}: {text}" if where[0] else text


def _names_at_points(groups: Groups) -> Iterator[tuple[str, list[str]]]:
    """Yield the points of a sweep at which managers are compared, with the names of the groups; all
    names without a point, if the points are what is compared, or nothing is swept.
    """
    names_at: dict[str, list[str]] = {}
    for group in groups.groups:
        names_at.setdefault(group.point, []).append(group.name)
    if len(names_at) in (1, len(groups.groups)):
        yield "", [group.name for group in groups.groups]
    else:
        yield from names_at.items()


def _lost(groups: Groups, names: Sequence[str]) -> str:
    """Write which groups did not find the pipeline in most missions, and what these count with;
    empty if none did not.
    """
    lost = [f"{name} in {groups.lost[name]}" for name in names if name in groups.lost]
    if not lost:
        return ""
    horizon_s = min(group.horizon_s for group in groups.groups if group.name in names)
    if math.isinf(horizon_s):
        counts = "count as later than all that found it"
    else:
        counts = f"have {horizon_s:g} s as their search time"
    return f"The pipeline was not found by {listed(lost)}, which {counts}. "


def _worse_paired(differences: Sequence[TableRow]) -> Iterator[str]:
    """Yield a note on pairs whose differences vary more than those of independent runs would."""
    worse = [
        f"{_names_of(each)} in {each['metric']} ({1.0 / each['variance_ratio']:.1f} times)"
        for each in differences
        if each.get("variance_ratio", 1.0) < _WORSE
    ]
    if worse:
        claim = "differences within pairs have a greater variance than those of independent runs"
        yield f"{claim}: {listed(worse)}"
