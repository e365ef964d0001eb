"""Compare simulated missions with real ones: samples, pairs, clusters, targets, and the paper's
table (SEAMS 2023).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from pathlib import Path
from string import Formatter
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas

from suave_des.arguments import plain_arguments
from suave_des.draws import Streams
from suave_des.errors import InputError, number_of
from suave_des.estimates import (
    Estimate,
    interval_names,
    mean_of,
    percent,
    share_of,
    std_of,
)
from suave_des.reality.missions import (
    PAPERS_RUNS,
    ConditionLimits,
    Region,
    Share,
    common_limit_s,
)
from suave_des.records.metrics import (
    FOUND,
    METRICS,
    PAPER_METRICS,
    REACTION_TIME,
    SEARCH_TIME,
)
from suave_des.records.missions import in_papers_order
from suave_des.records.runs import CONDITION, read_runs
from suave_des.resources import find
from suave_des.results import statistics
from suave_des.results.statistics import SIGNIFICANCE, Sample
from suave_des.tables import Table, TableRow, markdown_text, rows_of

COMPARED = (*PAPER_METRICS, REACTION_TIME)
"""Metrics that are compared where both sides have values."""
_LEAST_AGREEMENT = 0.5
_LEAST_CONDITIONS = 2
"""With one, missions are independent."""
_TARGET = ("kind", "subject", "what", "value", "low", "high")
_Requirement = tuple[Any, ...]
"""With these columns."""
_SIGNIFICANT_DIGITS = 8

_Generators = Callable[[str], np.random.Generator]
"""Makes the random generator of each use of chance, by a name of its own: no result depends on the
others.
"""

TABLES = {"cells": "validation.csv"}
TABLES |= {name: f"validation_{name}.csv" for name in ("pairs", "shares", "conditions", "targets")}
"""Names of the tables, and their files."""
JSON_FILE = "validation.json"


@dataclass(frozen=True)
class Validation:
    """The result of a comparison with real missions: data frames with the columns of the files that
    TABLES names.

    Attributes:
        cells: a row for each metric and manager: both samples, their difference and its tests.
        pairs: a row for each metric and pair of managers.
        shares: a row for each cluster or other region, and manager.
        conditions: a row for each metric, manager and condition, where conditions are known; else
            empty.
        targets: a row for each requirement; `met` is True, False, or None if it cannot be judged.
        not_found_s: search time that counts for missions that never found the pipeline; none if
            there are none.
    """

    managers: tuple[str, ...]
    cells: pandas.DataFrame
    pairs: pandas.DataFrame
    shares: pandas.DataFrame
    conditions: pandas.DataFrame
    targets: pandas.DataFrame
    not_found_s: float | None

    @property
    def all_met(self) -> bool:
        """Whether every target is met; one that cannot be judged is not."""
        return all(met is True for met in self.targets["met"])

    def texts(self, provenance: Mapping[str, object]) -> dict[str, str]:
        """Write each text file, by its name; the JSON file says from what the validation comes
        (provenance).
        """
        frames = {name: getattr(self, name).map(_rounded) for name in TABLES}
        met = self.targets["met"].tolist()
        content = {
            "provenance": dict(provenance),
            "targets_summary": {
                "met": met.count(True),
                "not_met": met.count(False),
                "not_judged": met.count(None),
            },
            "not_found_counts_as_s": self.not_found_s,
            **{name: rows_of(frame) for name, frame in frames.items()},
        }
        files = {
            file: frames[name].to_csv(index=False, lineterminator="\n") if len(frames[name]) else ""
            for name, file in TABLES.items()
            if len(frames[name]) or name != "conditions"
        }
        return {
            **files,
            JSON_FILE: json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n",
        }

    def tables(self, real: str) -> Iterator[Table]:
        """Yield every table that has rows; `real` is what the real missions are called: "published"
        or "real".
        """
        yield from (table for table in _tables(self, real) if table.rows)

    def remarks(self, real: str) -> Iterator[str]:
        """Say how search times count, what the targets ask for, and how many are met."""
        if self.not_found_s is not None:
            yield f"Missions that never found the pipeline count as {self.not_found_s:g} s, on both sides."
        yield (
            f"Means must lie in the {real} mean's 95% t interval, standard deviations in the {real} one's"
            " 95% chi-square interval."
        )
        if len(self.conditions):
            yield (
                "Missions of one condition are alike: 95% intervals of means and of differences of"
                " means are over the conditions (Student's t). The tests (KS, AD, Mann-Whitney) and"
                " intervals of standard deviations, their ratios and shares take missions as"
                " independent, and are a rough guide."
            )
        met = self.targets["met"].tolist()
        is_met, is_not = ("is" if met.count(each) == 1 else "are" for each in (True, False))
        yield f"{met.count(True)} of {number_of(len(met), 'target')} {is_met} met, {met.count(False)} {is_not} not met."
        if None in met:
            yield (
                f"{met.count(None)} cannot be judged: too few missions. For conclusions the simulation needs at least"
                f" as many of each manager as there are {real} ones."
            )


def _rounded(value: Any) -> Any:
    """Round to eight digits, which hides the last ones, in which machines differ; p values of 1e-12
    keep theirs.
    """
    return float(f"{value:.{_SIGNIFICANT_DIGITS}g}") if isinstance(value, float) else value


@plain_arguments
def validate(
    published: pandas.DataFrame,
    simulated: pandas.DataFrame,
    managers: Sequence[str],
    *,
    shares: Sequence[Share] = (),
    limits: Mapping[str, ConditionLimits] = MappingProxyType({}),
    seed: int = 1,
) -> Validation:
    """Compare simulated missions with published ones; the result depends on nothing but the
    arguments.

    Where both have a column `condition`, a manager's missions are compared condition by condition,
    too, and simulated ones are left out as needed for the conditions to have the same proportions
    on both sides.

    Example:
        real = read_runs("my_real_runs.csv")
        found = validate(real.frame, read_runs("results/runs.csv").frame, real.managers)
        print(found.targets[found.targets["met"] != True])

    Args:
        published: a row for each mission, with at least the columns of records.runs.COLUMNS;
            likewise simulated.
        managers: those to compare; each must have missions on both sides.
        shares: regions to count.
        limits: targets by metric for what is compared condition by condition.
        seed: of bootstrap, permutations and subsamples.

    Raises:
        InputError: a condition has real missions of a manager, and no simulated one; or real and
            simulated missions had different time limits.
    """
    streams = Streams(seed, 0)

    def generators(name: str) -> np.random.Generator:
        return np.random.default_rng(streams.stream(f"validation/{name}").getrandbits(128))

    if CONDITION in published and CONDITION in simulated:
        simulated = balanced(published, simulated, managers)
    sides = [side[side["manager"].isin(managers)] for side in (published, simulated)]
    common_limit_s(dict(zip(("real missions", "simulated missions"), sides, strict=True)))
    not_found_s, sides = _with_common_limit(sides)
    real, ours = sides
    samples = _samples(sides, managers)
    cells = pandas.DataFrame([_cell(*key, both, generators) for key, both in samples.items()])
    conditions = compare_conditions(real, ours, managers, COMPARED)
    if len(conditions):
        _put_over_conditions(cells, real, conditions)
    # so narrow that none needs it
    cells = cells.drop(columns=list(interval_names("simulated_std")), errors="ignore")
    pairs = pandas.DataFrame(
        _pair(one, other, (samples[one], samples[other]), generators)
        for one, other in combinations(samples, 2)
        if one[0] == other[0]
    )
    counted = compare_shares(shares, real, ours, managers)
    required = _targets(cells, pairs, counted, over_conditions(conditions), limits)
    return Validation(
        tuple(managers), cells, pairs, counted, conditions, _judged(required), not_found_s
    )


def _samples(
    sides: Sequence[pandas.DataFrame], managers: Sequence[str]
) -> dict[tuple[str, str], list[Sample]]:
    """Return the values of each metric and manager on each side, where all sides have some."""
    found = {}
    for metric, manager in product(COMPARED, managers):
        samples = [sample(side, manager, metric) for side in sides]
        if all(map(len, samples)):
            found[metric, manager] = samples
    return found


def _put_over_conditions(
    cells: pandas.DataFrame, real: pandas.DataFrame, conditions: pandas.DataFrame
) -> None:
    """Put intervals over conditions in place of those that take missions as independent: of real
    means, and of differences, which are then means over the conditions.
    """
    for row, cell in cells.iterrows():
        manager = cell["manager"]
        metric = cell["metric"]
        own = real.loc[real["manager"] == manager, [metric, CONDITION]].dropna()
        if own[CONDITION].nunique() < _LEAST_CONDITIONS:
            continue
        mean = mean_of(own[metric].astype(float).tolist(), own[CONDITION].tolist())
        of_both = conditions[(conditions["manager"] == manager) & (conditions["metric"] == metric)]
        apart = statistics.mean_interval(
            (of_both["simulated_mean"] - of_both["real_mean"]).to_numpy(float)
        )
        columns = mean.columns("published_mean") | apart.columns("difference_of_means")
        cells.loc[row, list(columns)] = pandas.Series(columns, dtype=float)


def _judged(required: Iterable[_Requirement]) -> pandas.DataFrame:
    """Return requirements, with whether each is met: None of one that cannot be judged."""
    targets = pandas.DataFrame(required, columns=_TARGET).astype(dict.fromkeys(_TARGET[3:], float))
    value = targets["value"]
    low = targets["low"].fillna(-math.inf)
    high = targets["high"].fillna(math.inf)
    met = value.between(low, high).astype(object).where(value.notna(), None)
    return targets.assign(met=met)


def _with_common_limit(
    sides: list[pandas.DataFrame],
) -> tuple[float | None, list[pandas.DataFrame]]:
    """Give all missions that are known not to have found the pipeline one search time; none if
    there are none.

    Programs write different numbers for them, such as 250 and 251 s with a limit of 250 s, which a
    test of distributions would take for a difference; and a mission that ended early would count as
    a short search. It is the greatest of those numbers on the last side that has some, but at least
    as great as every search time with success.
    """
    are_lost = [side[FOUND].astype("Float64").eq(0.0).fillna(False).astype(bool) for side in sides]
    pairs = list(zip(sides, are_lost, strict=True))
    ends_s = [float(side.loc[is_lost, SEARCH_TIME].max()) for side, is_lost in pairs]
    known_s = [each for each in ends_s if not math.isnan(each)]
    if not known_s:
        return None, sides
    longest_s = [float(side.loc[~is_lost, SEARCH_TIME].max()) for side, is_lost in pairs]
    limit_s = float(np.nanmax([known_s[-1], *longest_s]))
    counted = [
        side.assign(**{SEARCH_TIME: side[SEARCH_TIME].mask(is_lost, limit_s)})
        for side, is_lost in pairs
    ]
    return limit_s, counted


def sample(runs: pandas.DataFrame, manager: str, metric: str) -> Sample:
    """Return a manager's values of a metric, shape (n,); missions without one are left out."""
    return runs.loc[runs["manager"] == manager, metric].dropna().to_numpy(dtype=float)


def _described(name: str, sample: Sample) -> TableRow:
    """Describe a sample by columns that begin with a name: n, mean and std with their intervals,
    and median.
    """
    values = sample.tolist()
    row = mean_of(values).columns(f"{name}_mean") | std_of(values).columns(f"{name}_std")
    return {
        f"{name}_n": len(values),
        **row,
        f"{name}_median": float(np.median(sample)) if values else None,
    }


def _cell(
    metric: str, manager: str, samples: Sequence[Sample], generators: _Generators
) -> TableRow:
    """Compare the real and the simulated sample of a manager."""
    real, ours = samples
    from scipy.stats import ks_2samp  # with ties its p is too high

    rng = generators(f"bootstrap/{manager}/{metric}")
    ks = ks_2samp(real, ours)
    permutations = generators(f"permutations/{manager}/{metric}")
    ad_statistic, ad_p = statistics.anderson_darling(real, ours, permutations)
    return {
        "manager": manager,
        "metric": metric,
        **_described("published", real),
        **_described("simulated", ours),
        **statistics.difference_interval(ours, real).columns("difference_of_means"),
        **statistics.ratio_interval(real, ours, rng).columns("std_ratio"),
        "ks_distance": float(ks.statistic),
        "ks_p": float(ks.pvalue),
        "ad_statistic": ad_statistic,
        "ad_p": ad_p,
    }


def _pair(
    one: tuple[str, str],
    other: tuple[str, str],
    samples: Sequence[Sequence[Sample]],
    generators: _Generators,
) -> TableRow:
    """Compare two managers in a metric (metric, manager), each with its real and its simulated
    sample.
    """
    metric, first = one
    second = other[1]
    (real, ours), (other_real, other_ours) = samples
    # By the normal approximation, as the subsamples below are tested.
    published = statistics.mann_whitney(real, other_real, "asymptotic")
    simulated = statistics.mann_whitney(ours, other_ours, "asymptotic")
    sign = statistics.sign_of(published["p_less"], published["p_greater"])
    sizes = len(real), len(other_real)
    rng = generators(f"subsamples/{first}/{second}/{metric}")
    row: TableRow = {"first": first, "second": second, "metric": metric}
    # The exemplar's own one-sided tests: less time, or a greater distance, is better.
    if METRICS[metric].better < 0:
        row["published_superiority"] = 1.0 - published["effect"]
        row["simulated_superiority"] = 1.0 - simulated["effect"]
        row["published_first_better_p"] = published["p_less"]
        row["published_second_better_p"] = published["p_greater"]
        better = {-1: first, 0: "neither", 1: second}
    else:
        row["published_superiority"] = published["effect"]
        row["simulated_superiority"] = simulated["effect"]
        row["published_first_better_p"] = published["p_greater"]
        row["published_second_better_p"] = published["p_less"]
        better = {-1: second, 0: "neither", 1: first}
    row |= {"published_better": better[sign], "first_n": sizes[0], "second_n": sizes[1]}
    return row | {"agreement": statistics.agreement(sign, (ours, other_ours), sizes, rng)}


# Shares


def compare_shares(
    shares: Sequence[Share],
    published: pandas.DataFrame,
    simulated: pandas.DataFrame,
    managers: Sequence[str],
) -> pandas.DataFrame:
    """Count shares, and that of missions that found the pipeline, where known: columns of
    validation_shares.csv.
    """
    sides = published, simulated
    known = Region({"pipeline_found": ((0.0, 1.0),)})
    where = Region({"pipeline_found": ((1.0, 1.0),)})
    found = [
        Share(manager=manager, name="pipeline found", among=known, where=where)
        for manager in managers
    ]
    rows = []
    for share in (*(each for each in shares if each.manager in managers), *found):
        counts = [share.count(side) for side in sides]
        is_known = all(n for _, n in counts)
        if is_known or share not in found:
            rows.append(_share_row(share, *counts))
    return pandas.DataFrame(rows)


def _share_row(share: Share, published: tuple[int, int], simulated: tuple[int, int]) -> TableRow:
    """Return the cells of a share, of which each side has so many missions of so many."""
    low, high = share.target or (math.nan, math.nan)
    row: TableRow = {"manager": share.manager, "name": share.name}
    for side, (number, n) in (("published", published), ("simulated", simulated)):
        columns = share_of(number, n, "exact").columns(f"{side}_share")
        row |= {f"{side}_count": number, f"{side}_n": n, **columns}
    return {**row, "target_low": low, "target_high": high}


# Conditions


def balanced(
    real: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str]
) -> pandas.DataFrame:
    """Leave out simulated missions so that each manager has them in the real missions' proportions
    of conditions.

    Raises:
        InputError: a manager has real missions under a condition, and no simulated one.
    """
    kept = []
    for manager in managers:
        theirs = real.loc[real["manager"] == manager, CONDITION].value_counts().sort_index()
        ours = simulated[simulated["manager"] == manager]
        counts = ours[CONDITION].value_counts().reindex(theirs.index)
        for number in counts.index[counts.isna()][:1]:
            problem = f"there is no simulated mission of manager {manager} under condition {number}"
            raise InputError(problem, remedy="simulate every condition of the campaign")
        factor = float((counts / theirs).min())
        factor = math.floor(factor) or factor  # fewer simulated than real ones: as nearly as can be
        wanted = (factor * theirs // 1.0).clip(lower=1.0)
        kept.append(
            ours[ours.groupby(CONDITION).cumcount() < ours[CONDITION].map(wanted).fillna(0)]
        )
    return pandas.concat(kept)


@plain_arguments
def compare_conditions(
    real: pandas.DataFrame,
    simulated: pandas.DataFrame,
    managers: Sequence[str],
    metrics: Sequence[str],
) -> pandas.DataFrame:
    """Compare missions condition by condition.

    Example:
        compared = compare_conditions(real.frame, simulated, ["none", "bt"], ["search_time_s"])

    Args:
        real: a row for each mission, as of read_real with conditions; likewise simulated, with a
            column `condition`.
        managers: those to compare.
        metrics: columns of runs.csv.

    Returns:
        A row for each metric, manager and condition: columns of validation_conditions.csv; empty
        without conditions.
    """
    if CONDITION not in real or CONDITION not in simulated:
        return pandas.DataFrame()
    parts = []
    for metric in metrics:
        sides = []
        for name, side in (("real", real), ("simulated", simulated)):
            by = side[side[metric].notna()].groupby(["manager", CONDITION], observed=True)[metric]
            found = by.agg(["count", "mean", "std", "median"]).rename(columns={"count": "n"})
            sides.append(found.add_prefix(f"{name}_"))
        both = pandas.concat(sides, axis=1, join="inner").sort_index().reset_index()
        both.insert(1, "metric", metric)
        parts += [both[both["manager"] == manager] for manager in managers]
    compared = pandas.concat(parts, ignore_index=True)
    difference = compared["simulated_median"] - compared["real_median"]
    return compared.assign(difference_of_medians=difference)


def over_conditions(compared: pandas.DataFrame) -> pandas.DataFrame:
    """Summarise a comparison condition by condition: for each metric and manager, and for "all" of
    them.

    Rows have the number of `conditions`, and medians over these: `difference` (|simulated - real
    median|), `real_std` and `simulated_std` (within a condition), and their ratio `std_ratio`,
    simulated / real; nan for what is not known.
    """
    rows = []
    for metric, of_metric in compared.groupby("metric", sort=False) if len(compared) else ():
        for manager, own in [*of_metric.groupby("manager", sort=False), ("all", of_metric)]:
            real, ours = own[["real_std", "simulated_std"]].astype(float).dropna().median().tolist()
            row = {
                "manager": manager,
                "metric": metric,
                "conditions": len(own),
                "difference": own["difference_of_medians"].abs().median(),
                "real_std": real,
                "simulated_std": ours,
                "std_ratio": ours / real if real else math.nan,
            }
            rows.append(row)
    return pandas.DataFrame(rows)


# Targets


def _targets(
    cells: pandas.DataFrame,
    pairs: pandas.DataFrame,
    shares: pandas.DataFrame,
    within: pandas.DataFrame,
    limits: Mapping[str, ConditionLimits],
) -> Iterator[_Requirement]:
    """Yield the requirements.

    The mean lies in the 95% t interval of the published one, the std in its chi-square interval;
    the KS p is 0.05 or more; at least half the subsamples as large as the published samples lead to
    the published conclusion; shares and figures over conditions are within the limits of a file.
    """
    for each in cells.to_dict("records"):
        yield from _targets_of_cell(each)
    for each in pairs.to_dict("records"):
        pair = f"{each['first']}, {each['second']}"
        yield "conclusion", pair, each["metric"], each["agreement"], _LEAST_AGREEMENT, None
    for each in shares.to_dict("records"):
        if not math.isnan(each["target_low"]):
            ends = each["target_low"], each["target_high"]
            yield "share", each["manager"], each["name"], each["simulated_share"], *ends
    for each in within.to_dict("records"):
        limit = limits.get(each["metric"])
        if each["manager"] == "all" and limit is not None:
            yield from _targets_within(each, limit)


def _targets_of_cell(cell: Mapping[Any, Any]) -> Iterator[_Requirement]:
    manager = cell["manager"]
    metric = cell["metric"]
    for kind in ("mean", "std"):
        low, high = (cell[name] for name in interval_names(f"published_{kind}"))
        is_known = low is not None and not math.isnan(low)
        yield kind, manager, metric, cell[f"simulated_{kind}"] if is_known else None, low, high
    yield "ks", manager, metric, cell["ks_p"], SIGNIFICANCE, None


def _targets_within(row: Mapping[Any, Any], limit: ConditionLimits) -> Iterator[_Requirement]:
    for kind, column, most in (
        ("condition_median", "difference", limit.median_difference),
        ("condition_std", "std_ratio", limit.std_ratio),
    ):
        if most is not None:
            yield kind, "all", row["metric"], row[column], None, most


# Tables

_VERDICTS = {True: "met", False: "NOT MET", None: "not judged"}
_KINDS = {
    "ks": "KS p",
    "conclusion": "agreeing conclusions",
    "condition_median": "difference within conditions",
    "condition_std": "std ratio within conditions",
}


class _Cells(Formatter):
    """Writes values of a row into a template: nothing for a missing one; the styles "p" and "share"
    are our own.
    """

    def format_field(self, value: Any, style: str) -> str:
        """Write a value."""
        if value is None or value != value:
            return ""
        if style == "share":
            return percent(value)
        if style == "p":
            return f"{value:.3f}" if value >= 0.001 else f"{value:.0e}"
        return format(value, style)


_CELLS = _Cells()


def _table(frame: pandas.DataFrame, title: str, align: str, *columns: tuple[str, str]) -> Table:
    """Fill a table with the rows of a frame; each column has a heading and a template for its
    cells.
    """
    rows = []
    for row in rows_of(frame):
        values = {"of": METRICS.get(row.get("metric", "")), **row}
        cells = (_CELLS.vformat(template, (), values) for _, template in columns)
        rows.append(tuple("" if cell == " to " else cell for cell in cells))
    return Table(tuple(heading for heading, _ in columns), rows, title, align)


def _interval(name: str, style: str) -> tuple[str, str]:
    low, high = interval_names(name)
    return "95% interval", f"{{{low}:{style}}} to {{{high}:{style}}}"


_METRIC, _MANAGER = ("metric", "{of.brief}"), ("manager", "{manager}")


def _tables(validation: Validation, real: str) -> Iterator[Table]:
    runs = "real runs" if real == "real" else real
    yield _samples_table(validation.cells, runs)
    yield _table(
        validation.cells,
        f"Simulated compared with {runs} (difference = simulated - {real})",
        "ll",
        _METRIC,
        _MANAGER,
        ("difference of means", "{difference_of_means:+.2f}"),
        _interval("difference_of_means", "+.1f"),
        ("std ratio", "{std_ratio:.2f}"),
        _interval("std_ratio", ".2f"),
        ("KS p", "{ks_p:p}"),
        ("AD p", "{ad_p:p}"),
    )
    of_size = f"Mann-Whitney tests of samples of the {real} size"
    yield _table(
        validation.pairs,
        f"Pairs: probability that the first is better; {of_size}",
        "ll",
        _METRIC,
        ("first, second", "{first}, {second}"),
        (real, "{published_superiority:.2f}"),
        ("simulated", "{simulated_superiority:.2f}"),
        (f"{real}: better", "{published_better}"),
        ("simulated agrees", "{agreement:share}"),
    )
    yield _shares_table(validation.shares, real)
    yield _table(
        over_conditions(validation.conditions),
        "Within conditions: medians over the conditions",
        "ll",
        _METRIC,
        _MANAGER,
        ("|difference|", "{difference:.2f}"),
        (f"std: {real}", "{real_std:.2f}"),
        ("simulated", "{simulated_std:.2f}"),
        ("ratio", "{std_ratio:.2f}"),
    )
    rows = [_target(each) for each in rows_of(validation.targets)]
    yield Table(("of", "what", "simulated", "must be", ""), rows, "Targets", "llrrl")


def _samples_table(cells: pandas.DataFrame, runs: str) -> Table:
    columns = [
        (name, f"{{{side}_{name}:{style}}}")
        for side in ("published", "simulated")
        for name, style in (("n", ".0f"), ("mean", ".2f"), ("std", ".2f"), ("median", ".2f"))
    ]
    return _table(cells, f"Samples: {runs}, then simulated", "ll", _METRIC, _MANAGER, *columns)


def _shares_table(shares: pandas.DataFrame, real: str) -> Table:
    if len(shares):
        low, high = (shares[name].astype(float) for name in interval_names("published_share"))
        share = shares["simulated_share"].astype(float)
        shares = shares.assign(mark=np.where((share < low) | (share > high), "*", ""))
    return _table(
        shares,
        f"Shares of missions (* the simulated one is outside the {real} one's 95% interval)",
        "llrrrl",
        _MANAGER,
        ("share", "{name}"),
        (real, "{published_count:.0f} of {published_n:.0f}"),
        _interval("published_share", ".0%"),
        ("simulated", "{simulated_share:share}"),
        ("", "{mark}"),
    )


def _target(each: TableRow) -> tuple[str, ...]:
    kind = each["kind"]
    if kind == "share":
        what = each["what"]
    else:
        what = f"{METRICS[each['what']].brief}: {_KINDS.get(kind, kind)}"
    style = ".0%" if kind in ("conclusion", "share") else ".2f"
    value, low, high = (_CELLS.format_field(each[name], style) for name in ("value", "low", "high"))
    return each["subject"], what, value, _range(low, high), _VERDICTS[each["met"]]


def _range(low: str, high: str) -> str:
    """Say between which ends a value must be; an empty one is none."""
    if low and high:
        return f"{low} to {high}"
    if low:
        return f"at least {low}"
    if high:
        return f"at most {high}"
    return ""


# The paper's table

MARK = "*"
"""Marks figures outside the paper's interval."""
PAPER_FILE = "paper_table.md"


@dataclass(frozen=True)
class PaperComparison:
    """The paper's table beside ours, from the missions published and ours.

    Attributes:
        figures: a row for each manager, in the order of the paper's table, metric, and statistic
            ("mean" or "std"): the paper's figure (paper) and ours (here), each with the ends of its
            95% interval, and difference (here - paper); nan where there are too few missions; mark:
            whether ours is outside the paper's interval.
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
        columns = ("paper", "{paper:.2f}"), _interval("paper", ".1f"), ("here", "{here:.2f}")
        apart = _interval("here", ".1f"), ("difference", "{difference:+.2f}"), ("", "{mark}")
        if metric:
            del names[1]
        title = METRICS[metric].heading if metric else ""
        return _table(own, title, f"{'l' * len(names)}rrrrrl", *names, *columns, *apart)

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
        yield from self._claims()

    def _sizes(self, missions: pandas.DataFrame) -> str:
        sizes = {name: int((missions["manager"] == name).sum()) for name in self.managers}
        if len(set(sizes.values())) == 1:
            return f"{number_of(next(iter(sizes.values())), 'mission')} for each manager"
        return ", ".join(f"{number_of(n, 'mission')} of {manager}" for manager, n in sizes.items())

    def _claims(self) -> Iterator[str]:
        """Say whether metacontrol does on average what the paper says of it."""
        for metric in PAPER_METRICS:
            apart = self._from_metacontrol(metric)
            if not apart:
                continue
            chance = [
                name for name, each in apart.items() if each.contains(0.0) or not each.has_interval
            ]
            rest = f"; the difference from {' and '.join(chance)} could be chance" if chance else ""
            less_others = [each.value for each in apart.values()]
            claim = _claim_of_time if metric == SEARCH_TIME else _claim_of_distance
            yield f"{claim(less_others)}, on average{rest}."

    def _from_metacontrol(self, metric: str) -> dict[str, Estimate]:
        """Estimate metacontrol's mean less that of each other manager."""
        samples = {name: sample(self.ours, name, metric) for name in self.managers}
        best = samples.pop("metacontrol", np.array([]))
        if not len(best):
            return {}
        others = {name: each for name, each in samples.items() if len(each)}
        return {name: statistics.difference_interval(best, other) for name, other in others.items()}

    def markdown(self) -> str:
        """Write the comparison as Markdown."""
        return "\n\n".join([self.table().markdown(), *map(markdown_text, self.remarks())]) + "\n"


_OTHERS = "the paper's other managers"


def _claim_of_time(less_others: Sequence[float]) -> str:
    """Say whether metacontrol's search times, less those of each other, are as the paper says."""
    if max(less_others) < 0.0:
        return f"As in the paper, metacontrol finds the pipeline sooner than {_OTHERS}"
    return f"Unlike in the paper, metacontrol does not find the pipeline sooner than all {_OTHERS}"


def _claim_of_distance(less_others: Sequence[float]) -> str:
    """Say whether metacontrol's distances, less those of each other, are as the paper says."""
    if min(less_others) > 0.0:
        return f"As in the paper, metacontrol inspects more of it than {_OTHERS}"
    return f"Unlike in the paper, metacontrol does not inspect more of it than all {_OTHERS}"


@plain_arguments
def compare_with_paper(runs: pandas.DataFrame, published: Path | None = None) -> PaperComparison:
    """Compare the missions of a campaign with published figures.

    Example:
        runs = read_runs("simulated/runs.csv").frame
        print(compare_with_paper(runs).table().text(95))

    Args:
        runs: with the columns of runs.csv.
        published: file of the published runs; managers that are not in it are left out. None: the
            shipped one.

    Raises:
        InputError: the file cannot be read, or has fewer than two runs of a manager.
    """
    theirs = in_papers_order(read_runs(published or find(PAPERS_RUNS, "scenarios/published")).frame)
    rows = []
    for manager, metric in product(theirs["manager"].unique(), PAPER_METRICS):
        for statistic, estimate in (("mean", mean_of), ("std", std_of)):
            paper, here = (
                estimate(sample(side, manager, metric).tolist()) for side in (theirs, runs)
            )
            if not paper.has_interval:
                problem = f"fewer than two published runs of {manager}"
                raise InputError(problem, place=metric, remedy="an interval needs two or more")
            row = {"manager": manager, "metric": metric, "statistic": statistic}
            rows.append(row | paper.columns("paper") | here.columns("here"))
    figures = pandas.DataFrame(rows)
    ours = figures["here"].astype(float)
    is_outside = (ours < figures["paper_ci95_low"]) | (ours > figures["paper_ci95_high"])
    figures = figures.assign(
        difference=ours - figures["paper"], mark=np.where(is_outside, MARK, "")
    )
    return PaperComparison(figures, theirs, runs)
