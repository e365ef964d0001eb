"""Real missions, assisted by simulated ones.

A mean of real missions is corrected by what the simulation says about the conditions in which they
were made: real + weight * (population - same). This is prediction-powered inference (Angelopoulos
et al. 2023; PPI++, arXiv:2311.01453) with conditions as clusters. A few conditions cannot show how
far the simulation is off in others, so that intervals allow for that.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
import pandas

from suave_des.errors import InputError, number_of, unknown
from suave_des.estimates import CONFIDENCE, STUDENT, Estimate, std_of, t_quantile
from suave_des.reality.missions import common_limit_s, matched
from suave_des.records.metrics import FOUND, PAPER_METRICS, Metric
from suave_des.records.missions import Missions
from suave_des.records.runs import CONDITION, check_one_mission
from suave_des.results import statistics
from suave_des.results.comparison import estimate_in
from suave_des.results.conclusions import difference_claim
from suave_des.results.groups import (
    chosen_metrics,
    of_managers,
    parts,
)
from suave_des.results.horizon import at_horizons, to_horizon
from suave_des.results.independent import Group
from suave_des.results.notes import notes_on_metrics, notes_on_missions
from suave_des.results.statistics import Sample
from suave_des.tables import Section, Table, TableRow, Written, capital, rows_of

LEAST_CONDITIONS = 3
LEAST_TO_WEIGH = 10
"""Conditions from which on the weight is estimated: with fewer, its own error costs more than it
gains. Nor can fewer tell how many real missions a simulation is worth.
"""
UNLIKE = 0.1
"""Share of all conditions in which real and simulated missions, or two managers, may differ by twice
the standard deviation of conditions more than in those sampled. analysis/assisted.py says what
intervals with it hold.
"""
EACH_OF_TWO = (1.0 + CONFIDENCE) / 2.0
"""Confidence of an interval of which the narrower of two is given (Bonferroni)."""
_LEAST_SIMULATED, _LEAST_DRAWS = 2, 10
_PLACES = ("real missions", "assisted by", "population")
"""Of errors in real missions and those that assist them."""
USEFUL = 0.5
"""With few conditions the simulation counts if what it leaves of their standard deviation is less."""
_NOTICEABLE = 1.1
"""Least gain of an interval's width with which the simulation is said to help."""

# The estimator


@dataclass(frozen=True)
class Chance:
    """What means under single conditions owe to chance.

    Attributes:
        real: variance that the mean of the real missions under a condition has by chance; likewise
            same and population.
        shared: variance of the mean of `same` by random numbers that its conditions share.
    """

    real: float = 0.0
    same: float = 0.0
    population: float = 0.0
    shared: float = 0.0


NO_CHANCE = Chance()


def assisted_mean(
    real: Sample,
    same: Sample,
    population: Sample,
    chance: Chance = NO_CHANCE,
    spread: float | None = None,
) -> tuple[Estimate, float]:
    """Estimate the mean over a population of conditions from real missions under a few of them.

    With less than LEAST_TO_WEIGH conditions, the weight of the simulation is 1 where real - same
    varies at most half as much (standard deviation) as real does; with more, it is that of PPI++.
    It is 0 where that makes the interval narrower; so each of the two is one of 97.5%.

    Where differences are averaged, real - same or those of two managers, the interval allows for
    UNLIKE of all conditions: differences may be small in all that are sampled, and great in a few
    others. What the conditions show of their variance is not taken to be less than what follows
    from chance and from how the population varies: a few may be alike by accident.

    Args:
        real: mean of the real missions under each condition, shape (conditions,).
        same: mean of the simulated missions under the same conditions, in the same order.
        population: mean of the simulated missions under each of many other conditions, shape
            (draws,).
        chance: in these means.
        spread: for a difference of two managers, the greater standard deviation of conditions under
            one of them. None: the mean is one manager's.

    Returns:
        The mean, with its interval by Student's t over the conditions, and the weight of the
        simulation, from 0 to 1.
    """
    sides = real, same, population
    alone = _weighed(sides, chance, spread, 0.0)
    if len(real) >= LEAST_TO_WEIGH:
        weight = _weight_of_least_variance(*sides)
    else:
        weight = float((real - same).std(ddof=1) <= USEFUL * real.std(ddof=1))
    assisted = _weighed(sides, chance, spread, weight)
    if weight > 0.0 and assisted.high - assisted.low < alone.high - alone.low:
        return assisted, weight
    return alone, 0.0


def spread_of(population: Sample, chance: float) -> float:
    """Return the standard deviation of conditions, from means that vary by chance, too."""
    return math.sqrt(max(0.0, float(population.var(ddof=1)) - chance))


def _weighed(
    sides: tuple[Sample, Sample, Sample], chance: Chance, spread: float | None, weight: float
) -> Estimate:
    """Estimate the mean with a weight of the simulation."""
    real, same, population = sides
    n = len(real)
    between = spread_of(population, chance.population)
    apart = weight * between if spread is None else spread
    seen = float((real - weight * same).var(ddof=1))
    least = ((1.0 - weight) * between) ** 2 + chance.real + weight**2 * chance.same
    simulated = weight**2 * (population.var(ddof=1) / len(population) + chance.shared)
    variance = max(seen, least) / n + simulated + (UNLIKE * apart) ** 2
    is_estimated = n >= LEAST_TO_WEIGH and weight > 0.0  # which takes a degree of freedom
    mean = float(real.mean() + weight * (population.mean() - same.mean()))
    half = t_quantile(n - 1 - is_estimated, EACH_OF_TWO) * math.sqrt(variance) or math.nan
    return Estimate(mean, mean - half, mean + half, STUDENT)


def _weight_of_least_variance(real: Sample, same: Sample, population: Sample) -> float:
    """Return the weight of PPI++."""
    both = float(np.concatenate([same, population]).var(ddof=1))
    if both == 0.0:
        return 0.0
    covariance = float(np.mean((real - real.mean()) * (same - same.mean())))
    return min(max(covariance / ((1.0 + len(real) / len(population)) * both), 0.0), 1.0)


# Comparisons


@dataclass(frozen=True)
class AssistedComparison(Written):
    """What real missions show, alone and assisted by simulated ones.

        found = run_campaign("same.yaml").assist("real.csv", "population")
        found.estimates[["group", "other", "assisted", "narrower", "conclusion"]]

    Attributes:
        estimates: a row for each metric and manager, or pair of managers: group, other (whose mean
            is subtracted, or empty), metric, runs (real missions of both), conditions, alone
            and assisted (means with the ends of their intervals), weight, narrower (how many times
            as wide the interval of the real missions alone is), equal_conditions_low and
            equal_conditions_high (number of conditions with real missions alone whose interval
            would be as narrow), helps, and conclusion.
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
        headings = ("mean", "n", "alone", "95% interval", "assisted", "95% interval", "weight")
        for metric in self.metrics:
            own = rows_of(self.estimates[self.estimates["metric"] == metric.name])
            table = Table(headings, [_cells(row, metric) for row in own])
            yield Section(capital(metric.heading), [table], [row["conclusion"] for row in own])

    def remarks(self) -> list[str]:
        """Describe the numbers, and what to know about the data."""
        how = (
            "n: real missions in conditions, over which the intervals are, as missions of one are"
            " alike: of means by Student's t, of shares by Wilson, or Bonett and Price.",
            "alone: mean over these conditions. assisted: mean over the population's, from alone +"
            " weight * (population - simulated under the same conditions).",
            "Assisted intervals of means are the narrower of two, with and without the simulation,"
            " and so each of 97.5%. They allow for conditions unlike those of the real missions:"
            f" {UNLIKE:.0%} of all, in which the simulation, or the other manager, is off by twice"
            " the standard deviation of conditions.",
        )
        return [*how, *(f"Note: {note}." for note in self.notes)]


def compare_assisted(
    real: Missions,
    simulated: Sequence[Missions],
    managers: Sequence[str] = (),
    metrics: Sequence[str] = (),
) -> AssistedComparison:
    """Estimate each manager's means, and the differences between managers, from real missions and
    simulated ones.

    A mission that never found the pipeline counts with the time limit as its search time.

    Args:
        real: missions in a few conditions.
        simulated: what assists them: a campaign that sweeps their conditions, and one under many,
            drawn as theirs were. Conditions follow from columns named like what is swept, a column
            `condition` with numbers from 1, or the order.
        managers: names; empty: all that have real missions.
        metrics: columns of runs.csv; empty: those of the paper.

    Raises:
        InputError: a name is not there, missions lack a manager or a metric, have a number that is
            none or another time limit, are of other conditions, or are too few.
    """
    same, population = simulated
    managers = [real.labels.get(name, name) for name in managers]
    frame = of_managers(real, managers).assign(source="")
    sides = dict(zip(_PLACES, (frame, same.frame, population.frame), strict=True))
    _check_managers(sides, managers or frame["manager"].unique())
    check_one_mission(frame, _PLACES[0])
    if population.swept:
        problem = "points of a sweep share their random numbers"
        raise InputError(
            f"it sweeps {population.swept[0]}, and {problem}",
            place="population",
            remedy="draw the conditions, as perturbations",
        )
    chosen = chosen_metrics(metrics or PAPER_METRICS, [Group("", frame)])
    _check_values(sides, chosen)
    limit_s = common_limit_s(sides)
    if math.isfinite(limit_s):
        sides = {place: to_horizon(each, limit_s) for place, each in sides.items()}
    else:
        sides[_PLACES[0]] = at_horizons(frame, ())
    brought, in_same, drawn = sides.values()
    matching = matched(brought, in_same, drawn, same.swept)
    groups = [Group(name, part, horizon_s=limit_s) for part, name, _ in parts(brought, managers)]
    notes = [*real.notes, *same.notes, *population.notes]
    notes += [*notes_on_missions(groups, (), frame, {}), *notes_on_metrics(groups, chosen)]
    rows, lacking = _estimates(matching, [group.name for group in groups], chosen)
    return AssistedComparison(pandas.DataFrame(rows), (*notes, *lacking), chosen)


def _check_managers(sides: Mapping[str, pandas.DataFrame], names: Iterable[str]) -> None:
    """Check that there are missions of managers on all sides."""
    for place, frame in sides.items():
        known = dict.fromkeys(frame["manager"])
        for name in names:
            if name not in known:
                raise unknown(f"there is no mission of {name}", name, known, "there are", place)


def _check_values(sides: Mapping[str, pandas.DataFrame], metrics: Sequence[Metric]) -> None:
    """Check that real missions and those that assist them have the numbers that are compared."""
    for place, frame in sides.items():
        for metric in metrics:
            values = frame.get(metric.name, pandas.Series([math.nan])).to_numpy(float)
            may_lack = metric.name not in PAPER_METRICS and not np.isnan(values).all()
            if np.isinf(values).any() or (np.isnan(values).any() and not may_lack):
                problem = f"{metric.name} has a value that is no number, or no value at all"
                raise InputError(problem, place=place, remedy="correct it, or leave the metric out")


def _estimates(
    sides: Sequence[pandas.DataFrame], managers: Sequence[str], metrics: Sequence[Metric]
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the estimates of missions as `matched` returns them, and which managers they lack."""
    in_real, in_same, drawn = sides
    rows = []
    notes = []
    for metric in metrics:
        names = []
        for name in managers:
            own = [each.loc[each["manager"] == name, metric.name] for each in sides]
            if all(each.notna().any() for each in own):
                names.append(name)
            else:
                notes.append(f"{name} is left out of {metric.title}, of which it has no value")
        real_means = _means(in_real, CONDITION, metric.name, "real")
        conditions = real_means.join(_means(in_same, CONDITION, metric.name, "same"))
        draws = _means(drawn, "draw", metric.name, "draw")
        shared = _shared(in_same, metric.name)
        for both in map(list, [*combinations(names, 1), *combinations(names, 2)]):
            rows.append(_estimate(both, metric, conditions, draws, shared))
    return rows, notes


def _means(frame: pandas.DataFrame, by: str, metric: str, name: str) -> pandas.DataFrame:
    """Return mean (name), variance (name_var) and number (name_n) of missions, by condition or draw
    and by manager.
    """
    found = frame.groupby([by, "manager"], observed=True)[metric].agg(["mean", "var", "count"])
    return found.set_axis([name, f"{name}_var", f"{name}_n"], axis=1)


def _shared(same: pandas.DataFrame, metric: str) -> pandas.DataFrame:
    # Points of a sweep share a run's random numbers, so that the means of all conditions may be off
    # by the same chance.
    by_condition = same.groupby(["manager", CONDITION], observed=True)[metric]
    off = same.assign(off=same[metric] - by_condition.transform("mean"))
    return off.pivot_table("off", ["seed", "run"], "manager", observed=True)


def _of(both: list[str], means: pandas.DataFrame, *needed: str) -> Any:
    """Return a column for each value and manager, where all have the values that are needed."""
    found: Any = means.unstack()
    found = found.reindex(columns=pandas.MultiIndex.from_product([means.columns, both]))
    return found[found[[*needed]].notna().all(axis=1)]


def _estimate(
    both: list[str],
    metric: Metric,
    conditions: pandas.DataFrame,
    draws: pandas.DataFrame,
    shared: pandas.DataFrame,
) -> TableRow:
    """Estimate the mean of one manager, or the difference of two, over the conditions that both
    have.

    Args:
        both: names of the managers.
        conditions: means of real and same as of _means; likewise draws, of draw.
        shared: how far simulated missions are off by chance that conditions share, as of _shared.
    """
    own = _of(both, conditions, "real", "same")
    drawn = _of(both, draws, "draw")
    _check_numbers(f"{metric.title} of {' - '.join(both)}", own, len(drawn))
    signs = np.array([1.0, -1.0][: len(both)])
    real, same, population = (
        each.to_numpy() @ signs for each in (own["real"], own["same"], drawn["draw"])
    )
    if metric.name == FOUND:
        alone = assisted = _share(own["real"].to_numpy())
        weight = 0.0
    else:
        alone = statistics.mean_interval(real)
        by_chance = own["same_var"].mean() / drawn["draw_n"].mean()
        of_runs = shared.reindex(columns=both).dropna().to_numpy() @ signs
        chance = _chance(own, float(by_chance.sum()), of_runs)
        varies = (drawn["draw"].var() - by_chance).clip(lower=0.0) ** 0.5
        spread = max(*varies, *own["real"].std()) if len(both) > 1 else None
        assisted, weight = assisted_mean(real, same, population, chance, spread)
    row: TableRow = {"group": both[0], "other": "".join(both[1:]), "metric": metric.name}
    row |= {"runs": int(own["real_n"].sum().sum()), "conditions": len(own)}
    row |= alone.columns("alone") | assisted.columns("assisted") | {"weight": weight}
    row["narrower"] = (alone.high - alone.low) / (assisted.high - assisted.low)
    row["helps"] = weight > 0.0 and row["narrower"] >= _NOTICEABLE
    row |= _worth(real, assisted) if row["helps"] else {}
    return row | {"conclusion": assisted_conclusion(row, metric)}


def _check_numbers(what: str, own: pandas.DataFrame, draws: int) -> None:
    """Check that there are enough conditions, simulated missions in each, and draws."""
    simulated = int(own["same_n"].min().min()) if len(own) else _LEAST_SIMULATED
    for number, least, of, remedy in (
        (len(own), LEAST_CONDITIONS, "condition", "how they differ gives the interval"),
        (simulated, _LEAST_SIMULATED, "simulated mission", "in each condition, better 20"),
        (draws, _LEAST_DRAWS, "draw", "in the population, better some hundred"),
    ):
        if number < least:
            are = "is" if number == 1 else "are"
            raise InputError(
                f"{what}: there {are} {number_of(number, of)}",
                remedy=f"at least {least} are needed: {remedy}",
            )


def _chance(own: Any, population: float, of_runs: Sample) -> Chance:
    """Return what means owe to chance; that of real missions is not less than the simulated ones
    have, nor than their own repetitions show.
    """
    repeated = own["real_var"].mean().fillna(0.0)
    real = (np.maximum(own["same_var"].mean(), repeated) * (1.0 / own["real_n"]).mean()).sum()
    same = (own["same_var"] / own["same_n"]).mean().sum()
    shared = float(of_runs.var(ddof=1)) / len(of_runs) if len(of_runs) > 1 else 0.0
    return Chance(float(real), float(same), population, shared)


def _share(shares: Sample) -> Estimate:
    """Estimate the mean of shares by condition, shape (conditions, 1); of two managers, shape
    (conditions, 2), that of their differences.

    Simulated missions do not assist shares: of those that are near 0 or 1, they leave nothing from
    which an interval would follow.
    """
    if shares.shape[1] > 1:
        return statistics.paired_share_difference(*shares.T)
    return statistics.wilson(float(shares.sum()), len(shares))


def _worth(real: Sample, assisted: Estimate) -> dict[str, int | None]:
    """Return how many conditions with real missions alone would give an interval as narrow; nothing
    for few conditions, whose standard deviation hardly tells it.
    """
    if len(real) < LEAST_TO_WEIGH:
        return {}
    std = std_of(real.tolist())
    half = (assisted.high - assisted.low) / 2.0
    return {
        "equal_conditions_low": statistics.runs_for(std.low, half),
        "equal_conditions_high": statistics.runs_for(std.high, half),
    }


# Words


def _name(row: TableRow) -> str:
    return f"{row['group']} - {row['other']}" if row["other"] else str(row["group"])


def _cells(row: TableRow, metric: Metric) -> tuple[str, ...]:
    alone, assisted = (estimate_in(row, name) for name in ("alone", "assisted"))
    if row["other"]:
        value = metric.difference
        interval = metric.difference_interval
    else:
        value = metric.number
        interval = metric.interval
    return (
        _name(row),
        f"{row['runs']} in {row['conditions']}",
        value(alone.value),
        interval(alone),
        value(assisted.value),
        interval(assisted),
        f"{row['weight']:.2f}",
    )


def assisted_conclusion(row: TableRow, metric: Metric) -> str:
    """Write what an estimate shows, and whether the simulation helped."""
    found = estimate_in(row, "assisted")
    if row["other"] and found.has_interval and not found.contains(0.0):
        claim = difference_claim(row["group"], row["other"], found.value, metric)
        found = found if found.value > 0.0 else -found
    elif metric.name == FOUND and not row["other"]:
        claim = f"{metric.title} of {_name(row)}: {metric.number(found.value)}"
    else:
        claim = f"{metric.title} of {_name(row)}: {metric.amount(found.value)}"
    if row["other"]:
        interval = found.text(f".{metric.interval_decimals}f", metric.scale)
    else:
        interval = metric.interval(found)
    claim += f" (95% interval {interval or 'not known'})"
    claim += f" from {number_of(row['runs'], 'real mission')} in {row['conditions']} conditions"
    return f"{claim}; {_help(row, metric)}."


def _help(row: TableRow, metric: Metric) -> str:
    if metric.name == FOUND:
        return "simulated missions do not assist shares"
    if row["weight"] == 0.0:
        return "the simulation does not help"
    if not row["helps"]:
        return "the interval is not noticeably narrower with the simulation"
    narrower = f"the interval is {row['narrower']:.1f} times narrower with the simulation"
    high = row.get("equal_conditions_high")
    if high is None:
        return narrower
    return f"{narrower}, as that of {row['equal_conditions_low']:,} to {high:,} conditions with real missions alone"
