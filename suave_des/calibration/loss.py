"""Measure how far simulated missions are from published ones.

The loss is the mean over the managers of the energy distance between missions as vectors, plus the mean absolute
difference of the shares of missions in clusters. The energy distance of the distributions of X and Y is
2 E|X - Y| - E|X - X'| - E|Y - Y'| (Székely and Rizzo, 2013); it is zero only if they are equal. scipy has it for
single values only. A mission is the vector of its search time, its distance inspected and the x of the
pipeline point seen first, each divided by a scale, so that which values come together counts, too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas
from numpy.typing import NDArray

from suave_des.scenario.loader import LoadedScenario, with_values
from suave_des.simulation.simulator import Simulator
from suave_des.validation.shares import Share, count, read_shares, shares_beside

Vectors = NDArray[np.float64]
"""Missions as scaled vectors, shape (n, 2 or 3); unknown components are nan."""

SCALES = {"search_time_s": 40.0, "distance_inspected_m": 12.0, "detection_x_m": 1.5}
"""What components are divided by: about the published standard deviations within a manager."""
RESAMPLES = 200


@dataclass(frozen=True, slots=True)
class FreeParameter:
    """A parameter to fit: key path in the scenario, bounds, and the value that the search starts from."""

    path: str
    lower: float
    upper: float
    start: float

    def value(self, unit: float) -> float:
        """Value for a coordinate in [0, 1]; coordinates outside are reflected into it."""
        folded = abs(unit) % 2.0
        return self.lower + (self.upper - self.lower) * (2.0 - folded if folded > 1.0 else folded)


@dataclass(frozen=True, slots=True)
class Problem:
    """What is fitted to what.

    Attributes:
        loaded: the scenario.
        parameters: what is free.
        published: published missions, by manager.
        runs: simulated missions for each manager and evaluation.
        seed: seed of the simulated missions; all evaluations use the same streams, so that differences between them
            come from the parameters.
        shares: shares of missions in clusters, each with the published one.
    """

    loaded: LoadedScenario
    parameters: tuple[FreeParameter, ...]
    published: Mapping[str, Vectors]
    runs: int
    seed: int
    shares: tuple[tuple[Share, float], ...] = ()

    def values_at(self, units: Sequence[float]) -> list[float]:
        """Return the values of the parameters at coordinates, see FreeParameter.value."""
        return [parameter.value(float(unit)) for parameter, unit in zip(self.parameters, units, strict=True)]


@dataclass(frozen=True, slots=True)
class Evaluation:
    """One set of values and its loss.

    Attributes:
        values: of the parameters.
        distances: energy distance of each manager's missions, by name.
        share_difference: mean absolute difference of the clusters' shares; zero if none are compared.
        loss: mean of the distances + the difference of the shares.
    """

    values: tuple[float, ...]
    distances: tuple[float, ...]
    share_difference: float
    loss: float


def energy_distance(x: Vectors, y: Vectors) -> float:
    """Energy distance between two samples of vectors, shapes (n, d) and (m, d).

    A component that is nan in either vector of a pair is left out, and the others are scaled up in its place.
    """
    return 2.0 * _mean_distance(x, y) - _mean_distance(x, x) - _mean_distance(y, y)


def _mean_distance(x: Vectors, y: Vectors) -> float:
    difference = x[:, None, :] - y[None, :, :]
    known = ~np.isnan(difference)
    squares = np.where(known, difference, 0.0) ** 2
    return float(np.sqrt(squares.sum(axis=2) / known.mean(axis=2)).mean())


def as_vectors(missions: pandas.DataFrame) -> Vectors:
    """Scale missions with the columns of report.runs.COLUMNS; shape (n, 3)."""
    vectors: Vectors = missions[list(SCALES)].to_numpy(float) / np.array(list(SCALES.values()))
    return vectors


def published_vectors(frame: pandas.DataFrame, managers: Sequence[str]) -> dict[str, Vectors]:
    """Scale published missions by manager; a component that is never known for a manager is left out."""
    by_manager = {name: as_vectors(frame[frame["manager"] == name]) for name in managers}
    return {name: vectors[:, ~np.isnan(vectors).all(axis=0)] for name, vectors in by_manager.items()}


def published_shares(frame: pandas.DataFrame, managers: Sequence[str], data: Path) -> tuple[tuple[Share, float], ...]:
    """Count the managers' clusters that the file of shares beside the data names, in the published missions."""
    beside = shares_beside(data)
    counted = [(each, count(each, frame).share) for each in (read_shares(beside) if beside else ())]
    return tuple((each, share) for each, share in counted if each.manager in managers and share is not None)


def simulate(simulator: Simulator, manager: str, runs: int, seed: int) -> pandas.DataFrame:
    """Simulate missions of one manager; a frame with the columns that are compared."""
    metrics = [simulator.run(manager, run, seed).metrics for run in range(1, runs + 1)]
    rows = [{"manager": manager, **{name: getattr(each, name) for name in SCALES}} for each in metrics]
    return pandas.DataFrame(rows).astype(dict.fromkeys(SCALES, float))


def evaluate(problem: Problem, values: Sequence[float]) -> Evaluation:
    """Simulate all managers with one set of parameter values, and compute the loss."""
    missions = _simulate_all(problem, values)
    distances = [
        energy_distance(as_vectors(missions[manager])[:, : problem.published[manager].shape[1]], published)
        for manager, published in sorted(problem.published.items())
    ]
    difference = 0.0
    if problem.shares:
        simulated = pandas.concat(missions.values(), ignore_index=True)
        apart = [abs((count(share, simulated).share or 0.0) - published) for share, published in problem.shares]
        difference = float(np.mean(apart))
    return Evaluation(tuple(map(float, values)), tuple(distances), difference, float(np.mean(distances)) + difference)


def _simulate_all(problem: Problem, values: Sequence[float]) -> dict[str, pandas.DataFrame]:
    named = {parameter.path: value for parameter, value in zip(problem.parameters, values, strict=True)}
    simulator = Simulator(with_values(problem.loaded, named))
    return {name: simulate(simulator, name, problem.runs, problem.seed) for name in sorted(problem.published)}


def resampling_spread(problem: Problem, best: Evaluation, seed: int) -> float:
    """Bootstrap standard error of the best fit's mean energy distance over the published missions.

    A change of the loss smaller than this could as well come from which few missions were published.
    """
    from scipy.stats import bootstrap

    missions = _simulate_all(problem, best.values)
    published = [vectors for _, vectors in sorted(problem.published.items())]
    simulated = [
        as_vectors(own)[:, : theirs.shape[1]] for own, theirs in zip(missions.values(), published, strict=True)
    ]

    def mean_distance(*drawn: NDArray[np.int64]) -> float:
        chosen = (vectors[rows] for vectors, rows in zip(published, drawn, strict=True))
        return float(np.mean([energy_distance(*pair) for pair in zip(simulated, chosen, strict=True)]))

    rows = [np.arange(len(vectors)) for vectors in published]
    rng = np.random.default_rng(seed)
    found = bootstrap(rows, mean_distance, n_resamples=RESAMPLES, vectorized=False, method="percentile", rng=rng)
    return float(found.standard_error)
