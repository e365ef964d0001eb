"""A comparison in words and tables: what is concluded, and how it is written, in LaTeX in the
paper's layout.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pandas

from suave_des.errors import number_of
from suave_des.estimates import Estimate, interval_names
from suave_des.records.metrics import FOUND, PAPER_METRICS, SEARCH_TIME, Metric
from suave_des.results.groups import Groups, listed
from suave_des.results.statistics import (
    A12,
    FISHER,
    MANN_WHITNEY,
    MCNEMAR,
    RANK_BISERIAL,
    SIGNIFICANCE,
    WILCOXON,
)
from suave_des.tables import EFFECT, Section, Table, Written, capital, rows_of

Row = Mapping[str, Any]
"""A row of a frame by column, None where there is nothing."""
_NO_TABLE = Table((), ())
_EFFECTS = {
    RANK_BISERIAL: "Effect: rank-biserial correlation, 1 if the first has the greater value in all pairs.",
    A12: "Effect: A12, the probability that a mission of the first has the greater value.",
}
_SHORT = {WILCOXON: "Wilcoxon", MANN_WHITNEY: "Mann-Whitney", FISHER: "Fisher", MCNEMAR: "McNemar"}
_MOST_SENTENCES = 3
"""Of a metric of which neither more nor less is better, in the conclusion from all differences."""
_WORSE = 0.9
"""Ratio of variances below which pairing is said to be worse than not pairing; chance explains what
is nearer 1.
"""
_OPEN = (
    "the interval of the mean, which is not corrected for the number of tests, does not contain 0"
)


def _ends(name: str) -> tuple[str, ...]:
    return name, *interval_names(name)


_SUMMARY = (
    *(
        "group",
        "metric",
        "n",
        "missing",
        *_ends("mean"),
        "mean_interval",
        "std",
        "median",
        "q1",
        "q3",
        "horizon_s",
    ),
    *(*_ends("restricted_mean_s"), "restricted_mean_s_interval", *_ends("censored_median_s")),
)
_DIFFERENCE = (
    *(
        "group",
        "other",
        "metric",
        "paired",
        "why",
        "n",
        "n_other",
        *_ends("difference"),
        "difference_interval",
    ),
    *(
        "test",
        "p",
        "p_holm",
        "p_less",
        "p_greater",
        "effect_name",
        *_ends("effect"),
        "variance_ratio",
        "half_width",
    ),
    *("runs_needed_paired", "runs_needed_unpaired", "conclusion"),
)
"""Columns of the frames, in order."""


def estimate_in(row: Row, name: str) -> Estimate:
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
            horizon_s (the time to which the restricted mean reaches), restricted_mean_s (of the
            time until found or horizon_s, missions without it being censored) and censored_median_s
            (time by which half of the missions have found the pipeline; nan if less than half do).
        differences: a row for each metric and pair: group, other, metric, paired (whether they are
            compared run by run), why, n (values of the one, or pairs), n_other, difference (of the
            means, group - other), test, p (two-sided), p_holm (adjusted for all tests of this
            comparison), p_less (one-sided: that the one is not less than the other), p_greater,
            effect_name, effect, variance_ratio (by how much pairing divides the variance of the
            difference), half_width (of the interval for which the number of runs is given),
            runs_needed_paired (runs of each manager for that, if they are paired),
            runs_needed_unpaired (none: over ten million, or not known), and conclusion.
        counted: what n counts: "mission", or "run" or "draw" where missions are averaged over
            these.
        largest: of each pair the least and the greatest difference in the first metric, each with
            its run.
        replay: the command that replays both missions of the largest of these; empty: not known.
    """

    conclusion: str
    summaries: pandas.DataFrame
    differences: pandas.DataFrame
    notes: tuple[str, ...]
    metrics: tuple[Metric, ...] = field(repr=False)
    counted: str = field(default="mission", repr=False)
    largest: Table = field(default=_NO_TABLE, repr=False)
    replay: str = field(default="", repr=False)

    def frames(self) -> dict[str, pandas.DataFrame]:
        """Return both frames."""
        return {"summaries": self.summaries, "differences": self.differences}

    def sections(self) -> Iterator[Section]:
        """Yield the tables of each metric, the numbers of runs that intervals need, and the runs
        that differ most.
        """
        needed = []
        for metric in self.metrics:
            own = [
                rows_of(frame[frame["metric"] == metric.name]) for frame in self.frames().values()
            ]
            tables = (
                _summary_table(metric, own[0]),
                _search_table(own[0]),
                _difference_table(metric, own[1]),
            )
            sentences = [each["conclusion"] for each in own[1]]
            needed += [_runs_row(each, metric) for each in own[1] if each["half_width"] is not None]
            yield Section(metric.heading, [each for each in tables if each.rows], sentences)
        if needed:
            headings = ("difference", "for ±", "paired", "not paired", "variance ratio")
            yield Section(
                "runs of each manager that an interval of the difference needs",
                [Table(headings, needed)],
            )
        if self.largest.rows:
            below = f"To see both missions: {self.replay}" if self.replay else ""
            yield Section(
                self.largest.title, [Table(self.largest.headings, self.largest.rows)], below=below
            )

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
            over_all = f", Holm's correction over all {len(tested)}" if len(tested) > 1 else ""
            yield f"Tests: {', '.join(tested['test'].unique())}; two-sided{over_all}."
        yield from (_EFFECTS[name] for name in tested["effect_name"].unique() if name)
        methods = (
            pandas.concat([self.summaries["mean_interval"], tested["difference_interval"]])
            .dropna()
            .unique()
        )
        if len(methods):
            yield f"95% intervals: {', '.join(methods)}."

    def latex(self) -> str:
        """Write two tables for LaTeX with booktabs: means and standard deviations as in the paper,
        and differences.
        """
        metrics = [each for each in self.metrics if each.name in PAPER_METRICS] or list(
            self.metrics
        )
        by_group: dict[str, list[str]] = {}
        for metric in metrics:
            for each in rows_of(self.summaries[self.summaries["metric"] == metric.name]):
                cells = metric.number(each["mean"]), metric.number(each["std"])
                by_group.setdefault(each["group"], [each["group"]]).extend(cells)
        shown = [row for row in by_group.values() if any(row[1:])]
        means = Table(
            ("Manager", *("Mean", "Std") * len(metrics)), shown, "Means and standard deviations."
        )
        lines = [r"% needs \usepackage{booktabs}", *(f"% Note: {note}." for note in self.notes)]
        over = [capital(metric.heading) for metric in metrics]
        lines.append(means.latex(over, label="tab:means", note=self._sizes()))
        if len(self.differences):
            rows: list[tuple[str, ...]] = []
            for metric in self.metrics:
                own = self.differences[
                    (self.differences["metric"] == metric.name) & self.differences["test"].notna()
                ]
                rows += [(capital(metric.heading),)] if len(own) else []
                cells_of = (_difference_row(each, metric) for each in rows_of(own))
                rows += [
                    (name, mean, interval, effect, p)
                    for name, _, mean, interval, _, p, effect in cells_of
                ]
            headings = ("Difference", "Mean", "95% interval", "Effect", "p (Holm)")
            table = Table(headings, rows, "Differences between managers.")
            text = table.latex(label="tab:differences", note=" ".join(self._methods()))
            lines.append(text.replace("p (Holm)", "$p$ (Holm)"))
        return "\n".join(lines) + "\n"

    def _sizes(self) -> str:
        sizes = self.summaries.drop_duplicates("group").set_index("group")["n"]
        if sizes.nunique() == 1:
            return f"{number_of(int(sizes.iloc[0]), self.counted)} for each manager."
        return "; ".join(f"{name}: {number_of(n, self.counted)}" for name, n in sizes.items()) + "."

    def _content(self) -> dict[str, Any]:
        return {
            **super()._content(),
            "largest_differences": {"rows": self.largest.rows, "replay": self.replay},
        }


# Tables


def _summary_table(metric: Metric, summaries: Sequence[Row]) -> Table:
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
        mean = metric.number(each["mean"]), metric.interval(estimate_in(each, "mean"))
        spread = metric.number(each["std"]), metric.number(each["median"]), quartiles
        rows.append((each["group"], f"{each['n']:,}", *mean, *spread)[:width])
    return Table(headings[:width], rows)


def _search_table(summaries: Sequence[Row]) -> Table:
    """Return search times in which missions that never found the pipeline are censored; no rows for
    other metrics.
    """
    known = [each for each in summaries if each["horizon_s"] is not None]
    horizon_s = min((each["horizon_s"] for each in known), default=0.0)
    headings = (
        "manager",
        f"mean to {horizon_s:.0f} s",
        "95% interval",
        "half found by",
        "95% interval",
    )
    rows = []
    for each in known:
        mean = estimate_in(each, "restricted_mean_s")
        half_s, low_s, high_s = (
            each[name] for name in ("censored_median_s", *interval_names("censored_median_s"))
        )
        if abs(mean.value - each["mean"]) < 0.005 and half_s is not None:
            continue  # as in the table above
        ends = "not reached" if low_s is None else f"{low_s:.0f} to {_seconds(high_s)}"
        rows.append((each["group"], f"{mean.value:.2f}", mean.text(".1f"), _seconds(half_s), ends))
    return Table(headings, rows, "missions that never found it as censored (Kaplan-Meier)")


def _seconds(value: float | None) -> str:
    return "not reached" if value is None else f"{value:.0f}"


def _difference_table(metric: Metric, differences: Sequence[Row]) -> Table:
    """Return the difference of each pair; for shares, without an effect size."""
    headings = ("difference", "n", "mean", "95% interval", "p", "p (Holm)", EFFECT)
    width = 6 if metric.name == FOUND else len(headings)
    return Table(headings[:width], [_difference_row(each, metric)[:width] for each in differences])


def _difference_row(each: Row, metric: Metric) -> tuple[str, ...]:
    sizes = dict.fromkeys((each["n"], each["n_other"]))
    names = f"{each['group']} - {each['other']}", ", ".join(f"{n:,}" for n in sizes)
    if not each["test"]:
        return *names, "", "", "", "", ""
    mean, size = estimate_in(each, "difference"), estimate_in(each, "effect")
    effect = "" if each["effect"] is None else f"{size.value:.2f}"
    effect += f" ({size.text('.2f')})" if size.has_interval else ""
    return (
        *names,
        metric.number(mean.value),
        metric.interval(mean),
        _p(each["p"]),
        _p(each["p_holm"]),
        effect,
    )


def _runs_row(each: Row, metric: Metric) -> tuple[str, ...]:
    ratio = "" if each["variance_ratio"] is None else f"{each['variance_ratio']:.1f}"
    paired = f"{each['runs_needed_paired']:,}" if each["runs_needed_paired"] else ""
    unpaired = (
        f"{each['runs_needed_unpaired']:,}" if each["runs_needed_unpaired"] else "over 10,000,000"
    )
    half = (
        f"{100 * each['half_width']:g}%"
        if metric.name == FOUND
        else f"{each['half_width']:.4g} {metric.unit}"
    )
    return f"{each['group']} - {each['other']}", half.strip(), paired, unpaired, ratio


def _p(p: float) -> str:
    """Write a p-value with two significant digits."""
    if p < 1e-300:  # next to the least that a float can hold
        return "<1e-300"
    return f"{p:.3f}" if p >= 0.001 else f"{p:.0e}"


# Conclusions


def concluded(
    groups: Groups,
    summaries: Sequence[Row],
    differences: Sequence[dict[str, Any]],
    largest: Table,
    replay: str,
) -> Comparison:
    """Write what follows from the estimates of groups and their differences; `largest` and `replay`
    as of Comparison.

    Summaries and differences have the columns of Comparison's frames, but whole estimates.
    """
    by_name = {metric.name: metric for metric in groups.metrics}
    for row in differences:
        row["conclusion"] = conclusion(row, by_name[row["metric"]])
    counts = dict.fromkeys(("runs_needed_paired", "runs_needed_unpaired"), "Int64")
    frames = (
        _frame(summaries, _SUMMARY).astype({"horizon_s": "Int64"}),
        _frame(differences, _DIFFERENCE).astype(counts),
    )
    sentences = " ".join(_conclusions(groups, summaries, differences))
    notes = (*groups.missions.notes, *groups.notes, *_worse_paired(differences))
    return Comparison(sentences, *frames, notes, groups.metrics, groups.counted, largest, replay)


def _frame(rows: Sequence[Row], columns: tuple[str, ...]) -> pandas.DataFrame:
    """Make a frame of rows, of each estimate its value, the ends of its interval, and how that is
    found.
    """
    plain = []
    for row in rows:
        cells = dict.fromkeys(columns) | dict(row)
        for name, found in row.items():
            if isinstance(found, Estimate):
                cells |= found.columns(name) | {
                    f"{name}_interval": found.method if found.has_interval else None
                }
        plain.append(cells)
    return pandas.DataFrame(plain, columns=columns)


def _conclusions(
    groups: Groups, summaries: Sequence[Row], differences: Sequence[Row]
) -> Iterator[str]:
    """Yield the conclusion; of points of a sweep at which managers are compared, one for those that
    have the same.
    """
    metric = groups.metrics[0]
    means = {
        each["group"]: each["mean"].value
        for each in summaries
        if each["metric"] == metric.name and each["n"]
    }
    points = dict.fromkeys(group.point for group in groups.groups)
    if len(points) == 1 or len(points) == len(groups.groups):
        points = {"": None}
    points_of: dict[str, list[str]] = {}
    for point in points:
        names = [group.name for group in groups.groups if not point or group.point == point]
        text = overall_conclusion(
            metric, differences, {name: means[name] for name in names if name in means}, names
        )
        lost = [f"{name} in {groups.lost[name]}" for name in names if name in groups.lost]
        if lost and metric.name == SEARCH_TIME:
            what = "their search time is when they ended"
            text = f"The pipeline was not found by {listed(lost)}; {what}. {text}"
        points_of.setdefault(text.replace(point, "") if point else text, []).append(
            point.removeprefix(", ")
        )
    for text, where in points_of.items():
        yield f"{'; '.join(where)}: {text}" if where[0] else text


def _worse_paired(differences: Sequence[Row]) -> Iterator[str]:
    """Yield a note on pairs whose differences vary more than those of independent runs would."""
    worse = [
        f"{each['group']} - {each['other']} in {each['metric']}, {1.0 / each['variance_ratio']:.1f} times"
        for each in differences
        if each.get("variance_ratio", 1.0) < _WORSE
    ]
    if worse:
        yield f"pairing made the variance of a difference larger, not smaller ({listed(worse)})"


def conclusion(found: Row, metric: Metric) -> str:
    """Write the conclusion from one difference.

    The test is one of ranks, the difference one of means: what only one of them shows is not said
    of the other.
    """
    group, other = found["group"], found["other"]
    if not found["test"]:
        return (
            f"{group} and {other} cannot be compared in {metric.title}: one of them has no value."
        )
    apart, ranks = found["difference"], _direction_of_ranks(found)
    if _is_equal(found):
        return f"{group} and {other} have the same {metric.title} in all {number_of(found['n'], 'pair')}."
    test, interval = f"{_basis(found)}, {p_text(found['p_holm'])}", _interval(found, metric)
    mean = f"{group} - {other}: {metric.amount(apart.value)}, {interval}"
    if found["p_holm"] >= SIGNIFICANCE:
        but = f" by the test, though {_OPEN}" if _is_open(found) else ""
        return f"No difference in {metric.title} is shown between {group} and {other}{but} ({mean}; {test})."
    if not _is_claimed(found):
        less, greater = (other, group)[:: 1 if ranks > 0.0 else -1]
        first, phrase, second = (
            (less, metric.less, greater) if metric.better < 0 else (greater, metric.more, less)
        )
        claim = f"{first} {phrase.format('mostly')} {second}"
        if not metric.better:
            claim = f"{greater} mostly exceeds {less} in {metric.title}"
        return f"By ranks, {claim} ({test}), but no difference of the means is shown ({mean})."
    claim = difference_claim(group, other, apart.value, metric)
    if ranks * apart.value < 0.0:
        greater = group if ranks > 0 else other
        return (
            f"{claim} on average, yet {greater} has the greater value in most comparisons of single runs"
            f" ({interval}; {test}): the distributions differ in shape, so look at them."
        )
    return f"{claim} ({interval}; {test})."


def _is_equal(found: Row) -> bool:
    """Whether the two have the same value in each pair."""
    apart = found["difference"]
    return bool(
        found["paired"] and found["n"] > 1 and apart.value == 0.0 and not apart.has_interval
    )


def _is_open(found: Row) -> bool:
    """Whether the interval of the mean shows a difference, and the corrected test does not."""
    apart = found["difference"]
    return bool(found["p_holm"] >= SIGNIFICANCE and apart.has_interval and not apart.contains(0.0))


def _is_claimed(found: Row) -> bool:
    """Whether a difference of the means may be claimed."""
    is_open = found["difference"].contains(0.0) and _direction_of_ranks(found)
    return bool(found["p_holm"] < SIGNIFICANCE and not is_open)


def difference_claim(first: str, second: str, value: float, metric: Metric) -> str:
    """Write which of two managers has more or less, the better one first; the value is first -
    second.
    """
    if value * (metric.better or 1) < 0.0:
        first, second, value = second, first, -value
    phrase = metric.more if value > 0.0 else metric.less
    if not phrase:
        phrase = f"has {{}} {'more' if value > 0.0 else 'less'} {metric.title} than"
    return f"{first} {phrase.format(metric.amount(abs(value)))} {second}"


def overall_conclusion(
    metric: Metric, differences: Sequence[Row], means: Mapping[str, float], groups: Sequence[str]
) -> str:
    """Write the conclusion for the first metric: which manager is best, by how much, and whether it
    is significant.

    It is about the groups named, of which `means` has those that are known; differences are of all
    metrics and groups.
    """
    tested = [each for each in differences if each["test"]]
    own = [
        each
        for each in tested
        if each["metric"] == metric.name and {each["group"], each["other"]} <= set(groups)
    ]
    if len(groups) < 2:
        return f"There is only {groups[0]}, so there is nothing to compare it with."
    if not own or len(means) < 2:
        return f"No two of them have a {metric.title} that could be compared."
    if not metric.better:
        return " ".join(each["conclusion"] for each in own[:_MOST_SENTENCES])
    best = max(means, key=lambda name: metric.better * means[name])
    against = [each for each in own if best in (each["group"], each["other"])]
    claimed = [each for each in against if _is_claimed(each) and _favours(each, best, metric)]
    alike = [_not_shown(each, best) for each in against if each["p_holm"] >= SIGNIFICANCE]
    sentences = []
    if claimed:
        sentences.append(_claims(best, metric, claimed, alike, len(tested)))
    elif alike:
        has_best = "has" if list(means.values()).count(means[best]) == 1 else "has, with others,"
        of_all = (
            " of all its runs"
            if any(_favours(each, _other(each, best), metric) for each in against)
            else ""
        )
        is_shown = f"No difference in {metric.title} is shown between {best}, which {has_best} the best mean{of_all},"
        over = (
            f", after Holm's correction over {number_of(len(tested), 'test')}"
            if any(map(_is_open, against))
            else ""
        )
        sentences.append(f"{is_shown} and {_and(alike)}{over}.")
    others = [
        each["conclusion"]
        for each in against
        if each["p_holm"] < SIGNIFICANCE and each not in claimed
    ]
    return " ".join([*sentences, *others])


def _favours(found: Row, name: str, metric: Metric) -> bool:
    """Whether a group is the better one in the runs that are compared, which need not be all that
    have a mean.
    """
    return bool(
        (1.0 if found["group"] == name else -1.0) * metric.better * found["difference"].value > 0.0
    )


def _not_shown(found: Row, best: str) -> str:
    """Name the other one, and what speaks for a difference, or that there is none at all."""
    if _is_equal(found):
        return f"{_other(found, best)} (equal in all {number_of(found['n'], 'pair')})"
    return f"{_other(found, best)} ({_OPEN})" if _is_open(found) else _other(found, best)


def _claims(
    best: str, metric: Metric, claimed: Sequence[Row], alike: Sequence[str], tests: int
) -> str:
    """Write by how much the best is better than those from which it differs, and from which it does
    not.
    """
    _, _, words = (metric.less if metric.better < 0 else metric.more).partition("{}")
    parts = [
        f"{metric.amount(abs(each['difference'].value))}{words} {_other(each, best)}"
        f" ({_interval(each, metric)}; {_basis(each)})"
        for each in claimed
    ]
    largest = p_text(max(each["p_holm"] for each in claimed))
    if len(claimed) > 1:
        largest = f"all {largest}" if "<" in largest else f"largest {largest}"
    over = f" after Holm's correction over {tests} tests" if tests > 1 else ""
    rest = f"; no difference is shown to {_and(alike)}" if alike else ""
    return f"{best} {metric.most}: {_and(parts)}; {largest}{over}{rest}."


def _other(found: Row, name: str) -> str:
    return str(found["other"] if found["group"] == name else found["group"])


def _and(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def _interval(found: Row, metric: Metric) -> str:
    """Write the interval of a difference's size, in the direction in which the sentence speaks."""
    apart = found["difference"]
    shown = -apart if apart.value < 0.0 and _is_claimed(found) else apart
    text = shown.text(f".{metric.decimals}f", metric.scale)
    return f"95% interval {text}" if text else "no interval"


def _basis(found: Row) -> str:
    return f"{number_of(found['n'], 'pair') if found['paired'] else 'not paired'}, {_SHORT[found['test']]}"


def p_text(p: float) -> str:
    """Write a p-value for a sentence."""
    if p < 0.001:
        return "p < 0.001"
    return f"p = {p:.3f}" if p < 0.1 else f"p = {p:.2f}"


def _direction_of_ranks(found: Row) -> float:
    """Return the sign of the effect: above 0 if the first has the greater values, 0 if there is
    none.
    """
    return (found["effect"] or 0.0) - (
        0.5 if found["test"] == MANN_WHITNEY and found["effect"] is not None else 0.0
    )
