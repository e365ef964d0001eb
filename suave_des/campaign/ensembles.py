"""Campaigns with an ensemble: whether it fits the scenario, and what its members say about
differences between managers.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, groupby, product
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from suave_des.campaign.variation import Variation
from suave_des.errors import InputError, located
from suave_des.estimates import known, mean_of, t_quantile
from suave_des.records.metrics import Row
from suave_des.records.store import MissionKey
from suave_des.scenario.ensemble import Ensemble
from suave_des.scenario.loader import LoadedScenario

ENSEMBLE_COLUMNS = (
    *("first", "second", "metric", "n", "difference", "ci95_low", "ci95_high"),
    *("members", "members_above_0", "members_below_0", "range95_low", "range95_high"),
)
"""Columns of ensemble.csv before those of swept parameters."""


def with_ensemble(
    loaded: LoadedScenario, variation: Variation, ensemble: Ensemble, path: Path
) -> Variation:
    """Return a variation with an ensemble, which was read from a path.

    Raises:
        InputError: a parameter is not a number of this scenario, a member's values are not allowed
            in it, or it is swept or perturbed, too.
    """
    for name in ensemble.paths:
        for other in {*variation.drawn, *variation.paths.values()}:
            # one is below the other
            if f"{name}.".startswith(f"{other}.") or f"{other}.".startswith(f"{name}."):
                problem = f"varies {name}, as the campaign's sweep or perturbations do"
                raise InputError(problem, file=path, remedy="vary each key once")
    found = replace(variation, ensemble=ensemble)
    for member in range(1, len(ensemble.members) + 1):
        with located(f"member {member} does not fit scenario {loaded.scenario.name}: ", path):
            found.scenario(loaded, 0, member)
    return found


def differences(
    variation: Variation,
    rows: Iterable[tuple[MissionKey, Row]],
    managers: Sequence[str],
    metrics: Mapping[str, int],
) -> Iterator[dict[str, Any]]:
    """Yield the difference of each pair of managers in each metric, point by point: columns of
    ensemble.csv.

    The difference is paired by run, over the runs that both have. Its 95% interval is by Student's
    t over independent draws, for chance alone. The range in which the differences of 95 in 100
    parameter sets lie is the prediction interval for a further set: the mean ± Student's t times
    the standard deviation of the members' means, times the root of 1 + 1 / their number. The few
    runs of each member make it wider than the parameters do; with more of them it becomes narrower,
    down to that.

    Args:
        rows: of runs.csv, ordered by their keys.
        metrics: place in a row, by column.
    """
    assert variation.ensemble is not None
    for point, group in groupby(rows, key=lambda each: each[0].point):
        by_manager: dict[int, dict[int, Sequence[Any]]] = {}
        for key, row in group:
            by_manager.setdefault(key.manager, {})[key.run] = row
        for (metric, place), (second, first) in product(
            metrics.items(), combinations(sorted(by_manager), 2)
        ):
            ours = by_manager[first]
            theirs = by_manager[second]
            by_run = {run: ours[run][place] - theirs[run][place] for run in ours if run in theirs}
            if by_run:
                names = (managers[first], managers[second], metric)
                cells = (*names, *_difference(variation, variation.ensemble, by_run))
                yield {**dict(zip(ENSEMBLE_COLUMNS, cells, strict=True)), "point": point}


def _difference(
    variation: Variation, ensemble: Ensemble, by_run: Mapping[int, float]
) -> tuple[Any, ...]:
    """Describe the differences of runs, by chance and over parameter sets: cells of ensemble.csv."""
    by_member: dict[int, list[float]] = {}
    for run, value in by_run.items():
        by_member.setdefault(ensemble.member(run), []).append(value)
    draws = [(run - 1) // variation.runs_sharing_draw for run in by_run]
    by_chance = mean_of(list(by_run.values()), draws)
    mean = fmean(by_run.values())
    means = list(map(fmean, by_member.values()))
    half = math.nan
    if len(means) > 1:
        half = t_quantile(len(means) - 1) * stdev(means) * math.sqrt(1.0 + 1.0 / len(means))
    return (
        *(len(by_run), mean, known(by_chance.low), known(by_chance.high)),
        *(len(means), sum(each > 0.0 for each in means), sum(each < 0.0 for each in means)),
        *(known(mean - half), known(mean + half)),
    )
