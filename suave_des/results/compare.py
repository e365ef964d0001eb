"""Compare managers: estimate each metric of each group of missions and their differences, and
conclude.

Groups are compared run by run where runs share their random numbers, and else as independent
samples.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
import pandas
from numpy.typing import NDArray

from suave_des.arguments import plain_arguments
from suave_des.errors import InputError, shown, unknown
from suave_des.estimates import Estimate, known, share_of
from suave_des.files import as_number
from suave_des.records.metrics import FOUND, SEARCH_TIME, Metric
from suave_des.records.missions import Missions, missions_in
from suave_des.records.runs import CONDITION
from suave_des.results import statistics
from suave_des.results.comparison import Comparison, concluded
from suave_des.results.groups import Groups, grouped
from suave_des.results.horizon import FOUND_BY_HORIZON, TIMES
from suave_des.results.independent import Group
from suave_des.results.statistics import Sample
from suave_des.tables import Table, TableRow


class Choices(TypedDict, total=False):
    """What to compare, and how.

    Attributes:
        managers: names of managers; left out: all.
        metrics: columns of runs.csv; left out: search time, distance, reaction time and the share
            that found the pipeline.
        by: swept parameters whose values are compared, too; the others of a sweep are averaged
            over, run by run.
        against: the one that all others are compared with, as tables name it; None: each with each.
        half_widths: METRIC:HALF_WIDTH of the intervals for which the number of runs is to be given.
        unpaired: whether runs are taken as independent though they share their random numbers.
    """

    managers: Sequence[str]
    metrics: Sequence[str]
    by: Sequence[str]
    against: str | None
    half_widths: Sequence[str]
    unpaired: bool


@plain_arguments
def compare_folders(paths: Sequence[str | Path], **choices: Unpack[Choices]) -> Comparison:
    """Compare the missions in folders or files of results.

    Example:
        found = compare_folders(["simulated"], metrics=["search_time_s"], against="none")
        print(found.conclusion)

    Args:
        paths: folders of `suave-des campaign` or `reproduce`, folders of the exemplar's own CSV
            files, or CSV files.
        choices: what to compare, and how; see Choices.

    Raises:
        InputError: results cannot be read, a name is not in them, or an extra is not installed.
    """
    return compare_missions(missions_in(paths), **choices)


def compare_missions(
    missions: Missions,
    managers: Sequence[str] = (),
    metrics: Sequence[str] = (),
    by: Sequence[str] = (),
    **how: Any,
) -> Comparison:
    """Compare missions; see compare_folders."""
    return compare_groups(grouped(missions, managers, metrics, by), **how)


def compare_groups(
    groups: Groups,
    *,
    against: str | None = None,
    half_widths: Sequence[str] = (),
    unpaired: bool = False,
    on_progress: Callable[[int, int], None] = lambda done, all_of_them: None,
) -> Comparison:
    """Compare groups of missions; see compare_folders. `on_progress` is told how many of how many
    differences are done.
    """
    statistics.library()
    widths = _half_widths(half_widths, groups.metrics)
    labels = groups.missions.labels
    pairs = _pairs(groups.groups, labels.get(against or "", against))
    values = {metric.name: _values(groups.groups, metric.name) for metric in groups.metrics}
    asked = [(metric, *pair) for metric in groups.metrics for pair in pairs]
    found = []
    for done, (metric, first, second) in enumerate(asked):
        on_progress(done, len(asked))
        samples = _samples(first, second, values[metric.name], unpaired=unpaired)
        found.append(_difference(first, second, metric, samples, widths.get(metric.name)))
    _correct(found, "p")
    _correct(found, "mean_p")
    first_metric = groups.metrics[0]
    together = () if unpaired else pairs
    largest = _largest(together, first_metric, values[first_metric.name], groups.missions)
    summaries = [_summary(group, metric) for metric in groups.metrics for group in groups.groups]
    return concluded(groups, summaries, found, *largest)


def _correct(rows: Sequence[TableRow], column: str) -> None:
    """Add Holm's correction of the p in a column for all tests together."""
    tested = [row for row in rows if row.get(column) is not None]
    ps = statistics.holm([row[column] for row in tested])
    for row, p in zip(tested, ps, strict=True):
        row[f"{column}_holm"] = p


def _half_widths(texts: Sequence[str], metrics: Sequence[Metric]) -> dict[str, float]:
    """Read METRIC:HALF_WIDTH, for instance search_time_s:2, by the metric."""
    names = [metric.name for metric in metrics]
    found = {}
    for text in texts:
        name, _, number = (part.strip() for part in text.partition(":"))
        if name not in names or not 0.0 < as_number(number) < math.inf:
            remedy = f"give METRIC:HALF_WIDTH, such as {names[0]}:2; metrics are {', '.join(names)}"
            problem = f"{shown(text)} is no half-width above 0 of what is compared"
            raise InputError(problem, place="half-width", remedy=remedy)
        found[name] = as_number(number)
    return found


def _pairs(groups: Sequence[Group], against: str | None) -> list[tuple[Group, Group]]:
    """Pair the managers at each point of a sweep; the points of a manager, if it is the only
    one.
    """
    each_with_each = list(combinations(groups, 2))
    pairs = each_with_each if against is None else _pairs_against(groups, against)
    return [(one, other) for one, other in pairs if one.point == other.point] or pairs


def _pairs_against(groups: Sequence[Group], against: str) -> list[tuple[Group, Group]]:
    """Pair each with the group of that name, or with the one of that manager at its point."""
    by_name = {group.name: group for group in groups}
    managers = dict.fromkeys(group.name.removesuffix(group.point) for group in groups)
    if against not in by_name and against not in managers:
        problem = f"nothing is called {shown(against)}"
        raise unknown(problem, against, managers, "there are", "against")
    found = []
    for group in groups:
        chosen = by_name.get(against, by_name.get(f"{against}{group.point}"))
        if chosen and chosen is not group:
            found.append((group, chosen))
    return found


def _summary(group: Group, metric: Metric) -> TableRow:
    """Estimate one metric of one group; the restricted mean of search times reaches to the
    horizon.
    """
    rows = group.frame[group.frame[metric.name].notna()]
    sample = rows[metric.name].to_numpy(float)
    row: TableRow = {"group": group.name, "metric": metric.name}
    row |= {"n": len(sample), "missing": len(group.frame) - len(sample)}
    if not len(sample) or np.isinf(sample).any():
        return row
    row["mean"] = _mean(group, metric, sample)
    row["q1"], row["median"], row["q3"] = np.percentile(sample, (25.0, 50.0, 75.0)).tolist()
    row["std"] = float(sample.std(ddof=1)) if len(sample) > 1 else None
    if metric.name == SEARCH_TIME and group.is_of_missions and math.isfinite(group.horizon_s):
        row |= _until_found(sample, rows[FOUND_BY_HORIZON].to_numpy(float), group.horizon_s)
    return row


def _mean(group: Group, metric: Metric, sample: Sample) -> Estimate:
    """Estimate a mean; of missions that found the pipeline, the share."""
    if metric.name != FOUND:
        return statistics.mean_interval(sample)
    if group.is_of_missions:
        return share_of(int(sample.sum()), len(sample))
    if group.counted == CONDITION:
        return statistics.wilson(float(sample.sum()), len(sample))
    return statistics.mean_interval(sample).cut(0.0, 1.0)


def _until_found(times_s: Sample, was_found: NDArray[np.float64], horizon_s: float) -> TableRow:
    """Estimate times until the pipeline is found, where it is known which missions found it."""
    if np.isnan(was_found).any():
        return {}
    restricted, half = statistics.search_times(times_s, was_found > 0.0, horizon_s)
    return {"horizon_s": horizon_s, "restricted_mean_s": restricted, "censored_median_s": half}


def _difference(
    first: Group,
    second: Group,
    metric: Metric,
    samples: tuple[bool, str, Sample, Sample],
    half_width: float | None,
) -> TableRow:
    """Estimate the difference of two groups in one metric, and test it; half_width None: as usual
    for the metric.
    """
    is_paired, why, x, y = samples
    row: TableRow = {"group": first.name, "other": second.name, "metric": metric.name}
    row |= {"paired": is_paired, "why": why, "n": len(x), "n_other": len(y), "test": None}
    if not len(x) or not len(y):
        return row
    if metric.name == FOUND:
        row |= _found_compared({first.counted, second.counted}, x, y, is_paired=is_paired)
    else:
        row |= _values_compared(x, y, is_paired=is_paired)
    if math.isnan(row["difference"].value):
        return row
    usual = metric.half_width or 0.05 * max(abs(float(x.mean())), abs(float(y.mean())))
    return row | _runs_needed(x, y, half_width or usual, is_paired=is_paired)


def _found_compared(counted: set[str], x: Sample, y: Sample, *, is_paired: bool) -> dict[str, Any]:
    """Compare in how many missions the pipeline was found, or in which share of a condition's."""
    if counted == {"mission"}:
        row = _shares_compared(x > 0.0, y > 0.0, is_paired=is_paired)
    else:
        row = _values_compared(x, y, is_paired=is_paired)
    if counted == {CONDITION} and is_paired:
        row["difference"] = statistics.paired_share_difference(x, y)
    else:
        row["difference"] = row["difference"].cut(-1.0, 1.0)
    return row


def _shares_compared(
    x: NDArray[np.bool_], y: NDArray[np.bool_], *, is_paired: bool
) -> dict[str, Any]:
    if is_paired:
        difference = statistics.paired_share_difference(x, y)
        return statistics.paired_shares_test(x, y) | {"difference": difference}
    counts = (int(x.sum()), len(x)), (int(y.sum()), len(y))
    difference = statistics.share_difference(*counts)
    return statistics.shares_test(*counts) | {"difference": difference}


def _values_compared(x: Sample, y: Sample, *, is_paired: bool) -> TableRow:
    """Compare means, ranks, and in how many pairs the one or the other has more.

    Infinite values are later than all others by ranks, and have no mean.
    """
    row: TableRow = {"difference": Estimate(), "mean_test": None, "mean_p": None}
    if np.isfinite(x).all() and np.isfinite(y).all():
        name, p = statistics.means_test(x, y, is_paired=is_paired)
        row |= {"mean_test": name, "mean_p": known(p)}
        if is_paired:
            row["difference"] = statistics.mean_interval(x - y)
        else:
            row["difference"] = statistics.difference_interval(x, y)
    elif not is_paired:
        x, y = statistics.with_finite_ranks(x, y)
    test = statistics.signed_rank_test if is_paired else statistics.rank_sum_test
    greater, less = statistics.shares_of_comparisons(x, y, is_paired=is_paired)
    return row | test(x, y) | {"share_greater": greater, "share_less": less}


def _runs_needed(x: Sample, y: Sample, half_width: float, *, is_paired: bool) -> TableRow:
    """Return the number of runs that an interval needs, and the gain from pairing; equal values do
    not tell them.
    """
    if min(len(x), len(y)) < 2 or half_width <= 0.0:
        return {}
    apart = float(x.var(ddof=1) + y.var(ddof=1))
    if not apart:
        return {}
    needed = statistics.runs_for(math.sqrt(apart), half_width)
    row: TableRow = {"half_width": half_width, "runs_needed_unpaired": needed}
    if together := float((x - y).var(ddof=1)) if is_paired else 0.0:
        row["runs_needed_paired"] = statistics.runs_for(math.sqrt(together), half_width)
        row["variance_ratio"] = apart / together
    return row


@dataclass(frozen=True)
class _Values:
    """The values of one metric, by group.

    Attributes:
        alone: those that a group has.
        by_run: of groups whose runs are known, in the order of `runs`, nan where there is none.
        runs: numbers of all runs of any group.
    """

    metric: str
    alone: Mapping[str, Sample]
    by_run: Mapping[str, Sample]
    runs: NDArray[np.float64]


def _values(groups: Sequence[Group], metric: str) -> _Values:
    """Return the values of a metric."""
    alone = {group.name: group.frame[metric].dropna().to_numpy(float) for group in groups}
    with_runs = {group.name: group.frame[metric] for group in groups if group.has_runs}
    if not with_runs:
        return _Values(metric, alone, {}, np.array([]))
    together = pandas.concat(with_runs, axis=1)
    by_run = {name: together[name].to_numpy(float) for name in with_runs}
    return _Values(metric, alone, by_run, together.index.get_level_values("run").to_numpy(float))


def _samples(
    first: Group, second: Group, values: _Values, *, unpaired: bool
) -> tuple[bool, str, Sample, Sample]:
    """Return whether two groups are paired, as their runs share random numbers or conditions, and
    why; and their values, if they are paired in the same order of runs.
    """
    x = values.alone[first.name]
    y = values.alone[second.name]
    is_paired = not unpaired and first.has_runs and second.has_runs
    if is_paired:
        both = np.array([values.by_run[first.name], values.by_run[second.name]])
        both = both[:, ~np.isnan(both).any(axis=0)]
        is_paired = both.shape[1] >= min(2, len(x), len(y))
    if is_paired:
        why = _why_paired(first, max(len(x), len(y)) - both.shape[1], len(both[0]))
        x, y = both
    else:
        why = "not paired: as asked" if unpaired else _why_apart(first, second)
    if values.metric in TIMES and first.horizon_s != second.horizon_s:
        horizon_s = min(first.horizon_s, second.horizon_s)
        return is_paired, why, np.minimum(x, horizon_s), np.minimum(y, horizon_s)
    return is_paired, why, x, y


def _why_paired(group: Group, left: int, common: int) -> str:
    """Say by what two groups are paired, and how many have a value under only one of them."""
    what = "runs"
    if group.counted == CONDITION:
        what = "conditions"
        why = "paired by condition, under which both have missions"
    elif "run_idx" in group.frame:
        why = "paired by run_idx, as the exemplar's own test does"
    else:
        share = "runs with the same seed and number share their random numbers"
        why = f"paired by run number, as {share}"
    if left and common:
        return f"{why}; {what} with a value under only one of them ({left}) are left out"
    return why


def _why_apart(first: Group, second: Group) -> str:
    if not (first.has_runs and second.has_runs):
        return "not paired: real missions, or missions without seed, share no random numbers"
    if CONDITION in (first.counted, second.counted):
        return "not paired: fewer than two conditions of one source have a value under both"
    return "not paired: fewer than two runs of the same seed and number have a value under both"


def _largest(
    pairs: Sequence[tuple[Group, Group]],
    metric: Metric,
    values: _Values,
    missions: Missions,
) -> tuple[Table, str]:
    """Return the least and the greatest difference of each pair, and the command that replays the
    largest of all.
    """
    rows = []
    replays = [(0.0, "")]
    for first, second in pairs:
        if not all(each.has_runs and each.is_of_missions for each in (first, second)):
            continue
        apart = values.by_run[first.name] - values.by_run[second.name]
        is_known = np.isfinite(apart)
        if not apart[is_known].any():
            continue
        ends = statistics.least_and_greatest(apart[is_known], values.runs[is_known])
        cells = [text for value, run in ends for text in (metric.difference(value), str(run))]
        rows.append((f"{first.name} - {second.name}", *cells))
        size, run = max((abs(value), run) for value, run in ends)
        command = _replay_command(first, second, run, missions)
        if command:
            replays.append((size, command))
    headings = ("difference", "least", "run", "greatest", "run")
    title = f"runs that differ most: {metric.heading}"
    return Table(headings, rows, title), max(replays)[1]


def _replay_command(first: Group, second: Group, run: int, missions: Missions) -> str:
    """Return the command that replays a run of two groups; empty if none does."""
    both = [each.frame.iloc[0] for each in (first, second)]
    managers = list(dict.fromkeys(missions.named(str(each["manager"])) for each in both))
    sources = list(dict.fromkeys(str(each["source"]) for each in both))
    is_one_pair = len(managers) == 1 or len(sources) == 1
    if first.point or not is_one_pair or not missions.folders.keys() >= set(sources):
        return ""
    places = [str(missions.folders[source]) for source in sources]
    chosen = ["--run", str(run), "--managers", ",".join(managers)]
    return shlex.join(["suave-des", "replay", *places, *chosen])
