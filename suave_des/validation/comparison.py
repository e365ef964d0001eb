"""Managers and pairs of managers, published and simulated, side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from suave_des.estimates import Estimate, estimate
from suave_des.validation.runs import METRICS
from suave_des.validation.statistics import (
    AndersonDarling,
    Conclusion,
    Interval,
    KolmogorovSmirnov,
    Sample,
    agreement,
    anderson_darling,
    bootstrap,
    conclude,
    kolmogorov_smirnov,
    superiority,
)

if TYPE_CHECKING:
    import pandas

LOWER_IS_BETTER = {"search_time_s": True, "distance_inspected_m": False}
"""Which of two values of a metric is better, as the exemplar's own one-sided tests have it."""

Generators = Callable[[str], np.random.Generator]
"""Gives the random generator of each use of chance, by a name of its own, so that no result depends on the others."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One manager and metric on both sides.

    Attributes:
        manager: managing subsystem.
        metric: one of METRICS.
        published: figures of the published sample, with 95% intervals.
        simulated: figures of the simulated sample.
        difference: simulated less published mean, in the metric's unit.
        difference_interval: its 95% bootstrap interval; none for a sample of one.
        std_ratio: simulated by published standard deviation; none where it cannot be had.
        std_ratio_interval: its 95% bootstrap interval; none where it cannot be had.
        kolmogorov_smirnov: two-sample test.
        anderson_darling: two-sample test, with permutation p.
    """

    manager: str
    metric: str
    published: Estimate
    simulated: Estimate
    difference: float
    difference_interval: Interval | None
    std_ratio: float | None
    std_ratio_interval: Interval | None
    kolmogorov_smirnov: KolmogorovSmirnov
    anderson_darling: AndersonDarling


@dataclass(frozen=True, slots=True)
class Pair:
    """Two managers compared by one metric, on both sides.

    Attributes:
        first: the one manager.
        second: the other.
        metric: one of METRICS.
        published_superiority: probability that a published mission of the first is better than one of the second.
        simulated_superiority: the same of simulated missions.
        published: conclusion of the published runs.
        sizes: published missions of the two.
        agreement: share of random subsamples of the simulation, of these sizes, that lead to the same conclusion; none
            if the simulation has fewer missions.
    """

    first: str
    second: str
    metric: str
    published_superiority: float
    simulated_superiority: float
    published: Conclusion
    sizes: tuple[int, int]
    agreement: float | None

    @property
    def better(self) -> str | None:
        """The manager that the published runs show to be better; none if they show neither."""
        return {1: self.first, -1: self.second, 0: None}[self.published.sign]


def compare_cells(
    published: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str], generators: Generators
) -> tuple[Cell, ...]:
    """Every manager and metric.

    Args:
        published: a row a mission, with the columns of runs.COLUMNS.
        simulated: the same.
        managers: those to compare; each has missions on both sides.
        generators: of random numbers.
    """
    return tuple(
        _cell(manager, metric, sample(published, manager, metric), sample(simulated, manager, metric), generators)
        for metric in METRICS
        for manager in managers
    )


def _cell(manager: str, metric: str, published: Sample, simulated: Sample, generators: Generators) -> Cell:
    theirs, ours = estimate(published.tolist()), estimate(simulated.tolist())
    assert theirs.mean is not None and ours.mean is not None
    resampled = bootstrap(published, simulated, generators(f"bootstrap/{manager}/{metric}"))
    return Cell(
        manager,
        metric,
        theirs,
        ours,
        ours.mean - theirs.mean,
        resampled.difference_interval,
        ours.std / theirs.std if ours.std is not None and theirs.std else None,
        resampled.ratio_interval,
        kolmogorov_smirnov(published, simulated),
        anderson_darling(published, simulated, generators(f"permutations/{manager}/{metric}")),
    )


def compare_pairs(
    published: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str], generators: Generators
) -> tuple[Pair, ...]:
    """Every pair of managers by every metric; arguments as of compare_cells."""
    return tuple(
        _pair(published, simulated, first, second, metric, generators)
        for metric in METRICS
        for first, second in combinations(managers, 2)
    )


def _pair(
    published: pandas.DataFrame,
    simulated: pandas.DataFrame,
    first: str,
    second: str,
    metric: str,
    generators: Generators,
) -> Pair:
    lower = LOWER_IS_BETTER[metric]
    theirs = sample(published, first, metric), sample(published, second, metric)
    ours = sample(simulated, first, metric), sample(simulated, second, metric)
    conclusion = conclude(*theirs, lower_is_better=lower)
    sizes = len(theirs[0]), len(theirs[1])
    rng = generators(f"subsamples/{first}/{second}/{metric}")
    return Pair(
        first,
        second,
        metric,
        superiority(*theirs, lower_is_better=lower),
        superiority(*ours, lower_is_better=lower),
        conclusion,
        sizes,
        agreement(conclusion.sign, ours, sizes, rng, lower_is_better=lower),
    )


def sample(runs: pandas.DataFrame, manager: str, metric: str) -> Sample:
    """A manager's values of a metric, shape (n,)."""
    return runs.loc[runs["manager"] == manager, metric].to_numpy(dtype=float)
