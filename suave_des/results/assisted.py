"""Means of a few real missions, assisted by simulated ones under the same conditions and under many others.

A mean of real missions is corrected by what the simulation says about the conditions in which they were made: real +
weight * (population - same). This is prediction-powered inference (Angelopoulos et al. 2023; PPI++, arXiv:2311.01453)
with conditions as clusters. It holds for a wrong simulation, too, whose error is measured under the same conditions.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
import pandas

from suave_des.errors import InputError, number_of
from suave_des.estimates import STUDENT, Estimate, t_quantile
from suave_des.records.metrics import FOUND, SEARCH_TIME, Metric
from suave_des.records.missions import Missions
from suave_des.results import statistics
from suave_des.results.comparison import Row, estimate_in
from suave_des.results.groups import Groups, first_alike, runs_sharing_draw
from suave_des.results.real import CONDITION, matched
from suave_des.results.statistics import Sample
from suave_des.tables import Section, Table, Written, capital, rows_of

LEAST_CONDITIONS = 3
LEAST_TO_WEIGH = 10
"""Conditions from which on the weight is estimated: with fewer, its own error costs more than it gains."""
_NOTICEABLE = 0.1
"""Least weight, and least gain of an interval's width, with which the simulation is said to help."""


def assisted_mean(
    real: Sample, same: Sample, population: Sample, chance: Sequence[float] = (0.0, 0.0, 0.0), shared: float = 0.0
) -> tuple[Estimate, float]:
    """Estimate the mean over a population of conditions from real missions under a few of them.

    Args:
        real: mean of the real missions under each condition, shape (conditions,).
        same: mean of the simulated missions under the same conditions, in the same order.
        population: mean of the simulated missions under each of many other conditions, shape (draws,).
        chance: variances that these means have by chance within a condition: real, same, population.
        shared: variance of the mean of `same` by random numbers that its conditions share.

    Returns:
        The mean, with its interval by Student's t over the conditions, and the weight of the simulation, from 0 to 1.
        From LEAST_TO_WEIGH conditions on, the weight is that of PPI++. With fewer it is 1, or 0 where that makes the
        interval narrower; and what the conditions show of their variance is not taken to be less than what follows from
        chance and, for a weight of 0, from how the population varies: few conditions may be alike by accident.
    """
    n, draws, is_weighed = len(real), len(population), len(real) >= LEAST_TO_WEIGH
    spread = float(population.var(ddof=1))

    def variance(weight: float) -> float:
        between = 0.0 if is_weighed else (1.0 - weight) ** 2 * max(0.0, spread - chance[2])
        seen = float((real - weight * same).var(ddof=1))
        return max(seen, between + chance[0] + weight**2 * chance[1]) / n + weight**2 * (spread / draws + shared)

    if is_weighed:
        both = float(np.concatenate([same, population]).var(ddof=1))
        covariance = float(np.mean((real - real.mean()) * (same - same.mean())))
        weight = min(max(covariance / ((1.0 + n / draws) * both), 0.0), 1.0) if both else 0.0
    else:
        weight = float(variance(1.0) <= variance(0.0))
    mean = float(real.mean() + weight * (population.mean() - same.mean()))
    half = t_quantile(n - 1 - is_weighed) * math.sqrt(variance(weight)) or math.nan
    return Estimate(mean, mean - half, mean + half, STUDENT), weight


@dataclass(frozen=True)
class AssistedComparison(Written):
    """What real missions show, alone and assisted by simulated ones.

        found = compare_assisted("real.csv", "same", "population")
        found.estimates[["group", "other", "assisted", "narrower", "conclusion"]]

    Attributes:
        estimates: a row for each metric and manager, or pair of managers: group, other (whose mean is subtracted, or
            empty), metric, runs (real missions of the group), conditions, alone and assisted (means with the ends of
            their intervals), weight, narrower (how many times as wide the interval of the real missions alone is),
            equal_runs (real missions, as many in each condition, that would give the assisted interval), helps, and
            conclusion.
        notes: what a reader should know about the data.
        metrics: that are compared.
        conclusion: of all; empty, as each estimate has its own.
    """

    estimates: pandas.DataFrame
    notes: tuple[str, ...]
    metrics: tuple[Metric, ...] = field(repr=False)
    conclusion: str = field(repr=False, default="")

    def frames(self) -> dict[str, pandas.DataFrame]:
        """Return the estimates."""
        return {"estimates": self.estimates}

    def sections(self) -> Iterator[Section]:
        """Yield a table for each metric."""
        headings: tuple[str, ...] = (
            "mean",
            "n",
            "alone",
            "95% interval",
            "assisted",
            "95% interval",
            "weight",
            "equals",
        )
        for metric in self.metrics:
            own = rows_of(self.estimates[self.estimates["metric"] == metric.name])
            table = Table(headings, [_cells(row, metric) for row in own])
            yield Section(capital(metric.heading), [table], [row["conclusion"] for row in own])

    def remarks(self) -> list[str]:
        """Describe the numbers, and what to know about the data."""
        how = (
            "n: real missions in conditions, over which the intervals are (Student's t), as missions of one are alike.",
            "equals: real missions that would give the assisted interval alone, as many in each condition as now.",
        )
        return [*how, *(f"Note: {note}." for note in self.notes)]


def _cells(row: Row, metric: Metric) -> tuple[str, ...]:
    both = [estimate_in(row, name) for name in ("alone", "assisted")]
    cells = [text for found in both for text in (metric.number(found.value), metric.interval(found))]
    equal = f"{row['equal_runs']:,.0f}" if row["helps"] and row["equal_runs"] is not None else ""
    return _name(row), f"{row['runs']} in {row['conditions']}", *cells, f"{row['weight']:.2f}", equal


def _name(row: Row) -> str:
    return f"{row['group']} - {row['other']}" if row["other"] else str(row["group"])


# What is compared


def compare_assisted(real: Groups) -> AssistedComparison:
    """Estimate each manager's means, and the differences between managers, from real missions and simulated ones.

    A mission that never found the pipeline counts with the time limit as its search time.

    Args:
        real: real missions in a few conditions, with the simulated ones that assist them. The first of these, of a
            campaign that sweeps conditions, are under the same: by columns named like what it sweeps, by a column
            `condition` with numbers from 1, or by order. The others are under many, drawn as the real ones were.

    Raises:
        InputError: the missions are not of the same conditions, or too few.
    """
    same, population = real.simulated
    names = [group.name for group in real.groups]
    ours = pandas.concat([group.frame for group in real.groups], ignore_index=True)
    in_real, in_same, drawn = (
        each.assign(**{SEARCH_TIME: each[SEARCH_TIME].clip(upper=real.time_limit_s)})
        for each in (*matched(ours, same.frame, same.swept), _with_draws(population))
    )
    rows = []
    for metric in real.metrics:
        sides = [_means(frame, CONDITION, metric.name, name) for frame, name in ((in_real, "real"), (in_same, "same"))]
        conditions = pandas.concat(sides, axis=1).dropna(subset=["real", "same"])
        draws, shared = _means(drawn, "draw", metric.name, "draw"), _shared(in_same, metric.name)
        for both in [[name] for name in names] + [list(both) for both in combinations(names, 2)]:
            rows.append(_estimate(both, metric, conditions, draws, shared))
    notes = (*real.missions.notes, *same.notes, *population.notes, *real.notes)
    return AssistedComparison(pandas.DataFrame(rows), notes, real.metrics)


def _with_draws(population: Missions) -> pandas.DataFrame:
    """Return simulated missions with the number of their draw, which several runs may share.

    Raises:
        InputError: they are of a sweep.
    """
    if population.swept:
        problem = f"it sweeps {population.swept[0]}, and points of a sweep share their random numbers"
        raise InputError(problem, place="population", remedy="draw the conditions, as perturbations")
    frame = population.frame
    drawn = frame.assign(draw=first_alike(frame, runs_sharing_draw(frame)))
    return drawn.assign(draw=drawn.groupby(["seed", "draw"], sort=False, dropna=False).ngroup())


# Estimates


def _means(frame: pandas.DataFrame, by: str, metric: str, name: str) -> pandas.DataFrame:
    """Return mean (name), variance (name_var) and number (name_n) of missions, by condition or draw and by manager."""
    found = frame.groupby([by, "manager"], observed=True)[metric].agg(["mean", "var", "count"])
    return found.set_axis([name, f"{name}_var", f"{name}_n"], axis=1)


def _shared(same: pandas.DataFrame, metric: str) -> pandas.DataFrame:
    """Return by run and manager how far simulated missions are on average from the mean of their condition.

    Points of a sweep share a run's random numbers, so that the means of all conditions may be off by the same chance.
    """
    off = same[metric] - same.groupby(["manager", CONDITION], observed=True)[metric].transform("mean")
    return same.assign(off=off).groupby(["seed", "run", "manager"], observed=True)["off"].mean().unstack("manager")


def _estimate(
    both: list[str], metric: Metric, conditions: pandas.DataFrame, drawn: pandas.DataFrame, shared: pandas.DataFrame
) -> dict[str, Any]:
    """Estimate the mean of one manager, or the difference of two, over the conditions that both have.

    Raises:
        InputError: there are too few conditions, simulated missions in one of them, or draws.
    """
    by_manager: Any = conditions.unstack()
    own = by_manager.reindex(columns=pandas.MultiIndex.from_product([conditions.columns, both]))
    own = own[own[["real", "same"]].notna().all(axis=1)]
    draws, of_runs = (each.reindex(columns=both).dropna() for each in (drawn["draw"].unstack(), shared))
    for number, least, of, remedy in (
        (len(own), LEAST_CONDITIONS, "condition", "how they differ gives the interval"),
        (int(own["same_n"].min().min()) if len(own) else 2, 2, "simulated mission", "in each condition, better 20"),
        (len(draws), LEAST_TO_WEIGH, "draw", "in the population, better some hundred"),
    ):
        if number < least:
            problem = f"{metric.title} of {' - '.join(both)}: there {'is' if number == 1 else 'are'}"
            remedy = f"at least {least} are needed: {remedy}"
            raise InputError(f"{problem} {number_of(number, of)}", remedy=remedy)
    signs = np.array([1.0, -1.0][: len(both)])
    real, same, many = (each.to_numpy() @ signs for each in (own["real"], own["same"], draws))
    sizes = own["real_n"], own["same_n"], float(drawn["draw_n"].unstack().mean().mean())
    chance = [float((own["same_var"] / size).mean().sum()) for size in sizes]
    in_common = float((of_runs.to_numpy() @ signs).var(ddof=1)) / len(of_runs) if len(of_runs) > 1 else 0.0
    alone = statistics.mean_interval(real)
    assisted, weight = assisted_mean(real, same, many, chance, in_common)
    if metric.name == FOUND:
        alone, assisted = (each.cut(1.0 - len(both), 1.0) for each in (alone, assisted))
    half, runs = (assisted.high - assisted.low) / 2.0, int(own["real_n"][both[0]].sum())
    narrower = (alone.high - alone.low) / 2.0 / half
    needed = statistics.runs_for(float(real.std(ddof=1)), half) if half > 0.0 else None
    row = {"group": both[0], "other": "".join(both[1:]), "metric": metric.name, "runs": runs, "conditions": len(own)}
    row |= alone.columns("alone") | assisted.columns("assisted") | {"weight": weight, "narrower": narrower}
    row["equal_runs"] = None if needed is None else round(needed * runs / len(own))
    row["helps"] = weight >= _NOTICEABLE and narrower >= 1.0 + _NOTICEABLE
    return row | {"conclusion": _conclusion(row, metric)}


def _conclusion(row: Row, metric: Metric) -> str:
    """Write what an estimate shows, and whether the simulation helped."""
    found, interval = estimate_in(row, "assisted"), metric.interval
    if row["other"] and found.has_interval and not found.contains(0.0):
        claim = metric.claim(row["group"], row["other"], found.value)
        found = found if found.value > 0.0 else -found
    else:
        is_share = metric.name == FOUND and not row["other"]
        claim = f"{metric.title} of {_name(row)}: {(metric.number if is_share else metric.amount)(found.value)}"
    claim += f" (95% interval {interval(found) or 'not known'})"
    claim += f" from {number_of(row['runs'], 'real mission')} in {row['conditions']} conditions"
    if not row["helps"]:
        return f"{claim}; the simulation does not help."
    equal = f", as that of {row['equal_runs']:,} real missions alone" if row["equal_runs"] is not None else ""
    return f"{claim}; the interval is {row['narrower']:.1f} times narrower with the simulation{equal}."
