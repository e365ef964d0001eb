"""Compare managers: estimates of each, and differences of each pair, paired by run number where runs share their random
numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas

from suave_des.errors import InputError, did_you_mean, shown
from suave_des.estimates import interval_columns
from suave_des.report import statistics
from suave_des.report.caveats import caveats
from suave_des.report.compared_metrics import FOUND, SEARCH_TIME, ComparedMetric, chosen_metrics, parse_half_widths
from suave_des.report.conclusions import conclusion, overall_conclusion
from suave_des.report.grouping import Group, counted, grouped, time_limit_s
from suave_des.report.result_files import Missions, missions_of, read_missions
from suave_des.report.statistics import Estimated, Sample, SearchTimes, Tested


@dataclass(frozen=True)
class Choices:
    """What to compare, and how.

    Attributes:
        managers: names of managers; empty: all.
        metrics: columns of runs.csv; empty: search time, distance, reaction time and the share that found the pipeline.
        by: swept parameters whose values are compared, too; the others of a sweep are averaged over, run by run.
        against: the one that all others are compared with, as tables name it; None: each with each.
        half_widths: METRIC:HALF_WIDTH of the intervals for which the number of runs is to be given.
        unpaired: whether runs are taken as independent though they share their random numbers.
        bootstrap: whether intervals of means and of their differences are by BCa bootstrap instead of t.
    """

    managers: Sequence[str] = ()
    metrics: Sequence[str] = ()
    by: Sequence[str] = ()
    against: str | None = None
    half_widths: Sequence[str] = ()
    unpaired: bool = False
    bootstrap: bool = False


@dataclass(frozen=True, slots=True)
class Summary:
    """Estimates of one metric of one group of missions; None where there are too few.

    Attributes:
        group: name of the manager, with its source or its value of a sweep where that is needed.
        metric: column of runs.csv.
        n: independent values: missions, or runs where several points of a sweep are averaged.
        missing: missions without a value, such as those without a reaction.
        mean: of `pipeline_found` the share; with its 95% interval.
        std: sample standard deviation (n - 1).
        quartiles: first, second (the median) and third.
        search: of the search time, with missions that never found the pipeline as censored.
    """

    group: str
    metric: str
    n: int
    missing: int
    mean: Estimated | None = None
    std: float | None = None
    quartiles: tuple[float, float, float] | None = None
    search: SearchTimes | None = None


@dataclass(frozen=True, slots=True)
class Pairing:
    """Whether two groups are compared run by run, and why."""

    is_paired: bool
    why: str


@dataclass(frozen=True, slots=True)
class RunsNeeded:
    """Runs of each manager for which half the 95% interval of the difference is `half_width`; None: over 10 million."""

    half_width: float
    paired: int | None
    unpaired: int | None


@dataclass(frozen=True, slots=True)
class Difference:
    """Two groups of missions compared in one metric.

    Attributes:
        first: name of the group; likewise second.
        metric: column of runs.csv.
        pairing: whether run by run, and why.
        n: pairs, or the sizes of both.
        difference: of the means, first - second, with its 95% interval; None without a value in one of them.
        tested: the test, with its effect size; None likewise.
        p_holm: its p, adjusted for all tests of this comparison.
        variance_ratio: by how much pairing divides the variance of the difference; None if not paired.
        runs_needed: for a given interval; None without a spread to estimate it from.
        conclusion: in one sentence.
    """

    first: str
    second: str
    metric: str
    pairing: Pairing
    n: tuple[int, ...]
    difference: Estimated | None = None
    tested: Tested | None = None
    p_holm: float | None = None
    variance_ratio: float | None = None
    runs_needed: RunsNeeded | None = None
    conclusion: str = ""

    @property
    def is_significant(self) -> bool:
        """Whether the test rejects at 5%, together with all others."""
        return self.p_holm is not None and self.p_holm < statistics.SIGNIFICANCE


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
        notes: caveats about the data.
        metrics: the compared metrics.
        counted: what n counts: "mission", or "run" or "draw" where missions are averaged over these.
    """

    conclusion: str
    summaries: tuple[Summary, ...]
    differences: tuple[Difference, ...]
    notes: tuple[str, ...]
    metrics: tuple[ComparedMetric, ...] = field(repr=False)
    counted: str = field(default="mission", repr=False)

    def summary_rows(self) -> list[dict[str, Any]]:
        """Return a row for each group and metric, of plain values."""
        return [_summary_row(each) for each in self.summaries]

    def difference_rows(self) -> list[dict[str, Any]]:
        """Return a row for each pair and metric, of plain values."""
        return [_difference_row(each) for each in self.differences]

    def summary_frame(self) -> pandas.DataFrame:
        """Return summary_rows() as a data frame."""
        return pandas.DataFrame(self.summary_rows())

    def difference_frame(self) -> pandas.DataFrame:
        """Return difference_rows() as a data frame."""
        return pandas.DataFrame(self.difference_rows())

    def __str__(self) -> str:
        """Return all of it as text, as `suave-des compare` prints it."""
        from suave_des.report.compare_files import plain_text

        return plain_text(self)

    def _repr_markdown_(self) -> str:
        """Return all of it for a notebook."""
        from suave_des.report.compare_files import markdown_text

        return markdown_text(self)

    def metric(self, name: str) -> ComparedMetric:
        """Return a metric's description: its title, unit, and which values are better."""
        return next(each for each in self.metrics if each.name == name)

    def of_metric(self, name: str) -> tuple[list[Summary], list[Difference]]:
        """Return the summaries and the differences of one metric."""
        return (
            [each for each in self.summaries if each.metric == name],
            [each for each in self.differences if each.metric == name],
        )


def compare_folders(paths: Sequence[Path], choices: Choices | None = None) -> Comparison:
    """Compare the missions in folders or files of results.

    Args:
        paths: folders of `suave-des campaign` or `reproduce`, folders of the exemplar's own CSV files, or CSV files.
        choices: what to compare, and how.

    Raises:
        InputError: results cannot be read, a name is not in them, or an extra is not installed.
    """
    return compare(read_missions(paths), choices)


def compare_frame(frame: pandas.DataFrame, choices: Choices | None = None) -> Comparison:
    """Compare the missions of a data frame with the columns of runs.csv; see compare_folders."""
    return compare(missions_of(frame), choices)


def compare(missions: Missions, choices: Choices | None = None) -> Comparison:
    """Compare missions; see compare_folders."""
    choices = choices or Choices()
    for module in ("statsmodels", "lifelines"):
        statistics.library(module)
    groups, notes = grouped(missions, choices.managers, choices.by)
    metrics = chosen_metrics(choices.metrics, groups)
    half_widths = parse_half_widths(choices.half_widths, metrics)
    pairs = _pairs([group.name for group in groups], choices.against)
    horizon_s = time_limit_s(groups)
    summaries = tuple(_summary(group, metric, horizon_s, choices) for metric in metrics for group in groups)
    by_name = {group.name: group for group in groups}
    differences = [
        _difference(by_name[first], by_name[second], metric, half_widths.get(metric.name), choices)
        for metric in metrics
        for first, second in pairs
    ]
    adjusted = iter(statistics.holm([each.tested.p for each in differences if each.tested is not None]))
    differences = [each if each.tested is None else replace(each, p_holm=next(adjusted)) for each in differences]
    known = {metric.name: metric for metric in metrics}
    means = {(each.group, each.metric): each.mean.value for each in summaries if each.mean is not None}
    differences = [replace(each, conclusion=conclusion(each, known[each.metric])) for each in differences]
    sentence = overall_conclusion(metrics[0], differences, means, [group.name for group in groups])
    notes = [*missions.notes, *notes, *caveats(groups, metrics)]
    return Comparison(sentence, summaries, tuple(differences), tuple(notes), metrics, counted(groups))


def _pairs(names: list[str], against: str | None) -> list[tuple[str, str]]:
    if against is None:
        return list(combinations(names, 2))
    if against not in names:
        remedy = did_you_mean(against, names, "there are")
        raise InputError(f"nothing is called {shown(against)}", place="against", remedy=remedy)
    return [(name, against) for name in names if name != against]


def _summary(group: Group, metric: ComparedMetric, horizon_s: float, choices: Choices) -> Summary:
    """Estimate one metric of one group."""
    sample = group.known_values(metric.name)
    found = Summary(group.name, metric.name, len(sample), len(group.frame) - len(sample))
    if not len(sample):
        return found
    if metric.name == FOUND and group.is_of_missions:
        mean = statistics.share_estimate(int(sample.sum()), len(sample))
    else:
        mean = statistics.mean_interval(sample, bootstrap=choices.bootstrap)
        if metric.name == FOUND:
            mean = statistics.cut(mean, 0.0, 1.0)
    low, median, high = np.percentile(sample, (25.0, 50.0, 75.0))
    search = None
    if metric.name == SEARCH_TIME and group.is_of_missions:
        was_found = group.values(FOUND)[~np.isnan(group.values(metric.name))]
        if not np.isnan(was_found).any():
            search = statistics.search_times(sample, was_found.astype(bool), horizon_s)
    std = float(sample.std(ddof=1)) if len(sample) > 1 else None
    quartiles = (float(low), float(median), float(high))
    return replace(found, mean=mean, std=std, quartiles=quartiles, search=search)


def _difference(
    first: Group, second: Group, metric: ComparedMetric, half_width: float | None, choices: Choices
) -> Difference:
    """Compare two groups in one metric."""
    pairing, x, y = _paired(first, second, metric.name, unpaired=choices.unpaired)
    n = (len(x),) if pairing.is_paired else (len(x), len(y))
    found = Difference(first.name, second.name, metric.name, pairing, n)
    if not len(x) or not len(y):
        return found
    is_share = metric.name == FOUND and first.is_of_missions and second.is_of_missions
    if pairing.is_paired:
        if is_share:
            difference = statistics.paired_share_difference(x > 0.0, y > 0.0)
            tested = statistics.paired_shares_test(x > 0.0, y > 0.0)
        else:
            difference = statistics.mean_interval(x - y, bootstrap=choices.bootstrap)
            tested = statistics.signed_rank_test(x, y)
    elif is_share:
        counts = (int(x.sum()), len(x)), (int(y.sum()), len(y))
        difference, tested = statistics.share_difference(*counts), statistics.shares_test(*counts)
    else:
        difference = statistics.difference_interval(x, y, bootstrap=choices.bootstrap)
        tested = statistics.rank_sum_test(x, y)
    if metric.name == FOUND:
        difference = statistics.cut(difference, -1.0, 1.0)
    found = replace(found, difference=difference, tested=tested)
    return _with_sizes(found, x, y, half_width or metric.default_half_width(x, y))


def _with_sizes(found: Difference, x: Sample, y: Sample, half_width: float) -> Difference:
    """Add the gain from pairing, and the number of runs that an interval needs."""
    if min(len(x), len(y)) < 2 or half_width <= 0.0:
        return found
    apart = float(x.var(ddof=1) + y.var(ddof=1))
    if apart == 0.0:  # equal values say nothing about the spread of others
        return found
    unpaired = statistics.runs_for(math.sqrt(apart), half_width)
    if not found.pairing.is_paired:
        return replace(found, runs_needed=RunsNeeded(half_width, None, unpaired))
    together = float((x - y).var(ddof=1))
    paired = statistics.runs_for(math.sqrt(together), half_width) if together > 0.0 else None
    ratio = apart / together if together > 0.0 else None
    return replace(found, variance_ratio=ratio, runs_needed=RunsNeeded(half_width, paired, unpaired))


def _paired(first: Group, second: Group, metric: str, *, unpaired: bool) -> tuple[Pairing, Sample, Sample]:
    """Return the values of two groups, those of the same runs in the same order where runs are paired."""
    x, y = first.by_run(metric), second.by_run(metric)
    apart = first.known_values(metric), second.known_values(metric)
    if unpaired:
        return Pairing(False, "not paired: as asked"), *apart
    if x is None or y is None:
        return Pairing(False, "not paired: real missions, or missions without seed, share no random numbers"), *apart
    common = pandas.concat({"x": x, "y": y}, axis=1, join="inner")
    if common.empty:
        seeds = [", ".join(each.index.unique("seed")[:3]) for each in (x, y)]
        if seeds[0] != seeds[1]:
            why = f"not paired: the seeds {seeds[0]} and {seeds[1]} differ, so no random numbers are shared"
        else:
            why = "not paired: they have no run number in common"
        return Pairing(False, why), *apart
    both = common.dropna()
    if len(both) < 2 <= min(map(len, apart)):
        return Pairing(False, "not paired: fewer than two runs have a value under both"), *apart
    left = max(map(len, apart)) - len(both)
    rest = f"; {left} of one without a counterpart are left out" if left and len(both) else ""
    why = f"paired by run number, as runs with the same seed and number share their random numbers{rest}"
    return Pairing(True, why), both["x"].to_numpy(), both["y"].to_numpy()


def _summary_row(each: Summary) -> dict[str, Any]:
    quartiles = each.quartiles or (None, None, None)
    row = {"group": each.group, "metric": each.metric, "n": each.n, "missing": each.missing}
    row |= _estimated("mean", each.mean) | {"std": each.std, "median": quartiles[1]}
    row |= {"q1": quartiles[0], "q3": quartiles[2]}
    search = each.search
    row |= {"horizon_s": search.horizon_s if search else None}
    row |= _estimated("restricted_mean_s", search.restricted_mean_s if search else None)
    low, high = search.median_interval_s if search else (None, None)
    row |= {"censored_median_s": search.median_s if search else None}
    return row | {"censored_median_s_ci95_low": low, "censored_median_s_ci95_high": high}


def _difference_row(each: Difference) -> dict[str, Any]:
    sizes = (each.n[0], each.n[-1])
    row: dict[str, Any] = {"group": each.first, "other": each.second, "metric": each.metric}
    row |= {"paired": each.pairing.is_paired, "why": each.pairing.why, "n": sizes[0], "n_other": sizes[1]}
    row |= _estimated("difference", each.difference)
    tested = asdict(each.tested) if each.tested else dict.fromkeys(Tested.__dataclass_fields__)
    row |= {"test": tested["name"], "p": tested["p"], "p_holm": each.p_holm}
    row |= {"p_less": tested["p_less"], "p_greater": tested["p_greater"]}
    row |= {"effect_name": tested["effect_name"], "effect": tested["effect"]}
    row |= interval_columns("effect", tested["effect_interval"]) | {"variance_ratio": each.variance_ratio}
    needed = asdict(each.runs_needed) if each.runs_needed else dict.fromkeys(RunsNeeded.__dataclass_fields__)
    row |= {"half_width": needed["half_width"]}
    row |= {"runs_needed_paired": needed["paired"], "runs_needed_unpaired": needed["unpaired"]}
    return row | {"conclusion": each.conclusion}


def _estimated(name: str, found: Estimated | None) -> dict[str, Any]:
    value, interval, method = (None, None, None) if found is None else (found.value, found.interval, found.method)
    return {name: value} | interval_columns(name, interval) | {f"{name}_interval": method if interval else None}
