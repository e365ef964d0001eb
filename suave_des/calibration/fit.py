"""Fits free parameters of a scenario to published runs, and tells how sharply each is determined."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from suave_des.calibration.distance import SCALES, Array, energy_distance, missions_as_vectors
from suave_des.imports import main_hidden
from suave_des.scenario.loader import LoadedScenario, with_values
from suave_des.simulation.simulator import Simulator
from suave_des.validation.shares import Share, count

FINALISTS, FINAL_FACTOR = 8, 4
"""How many of the best sets of values are looked at again, and with how many times the missions."""
METRICS_AND_PLACE = ["search_time_s", "distance_inspected_m", "detection_x_m"]
FIRST_STEP = 0.1
"""Standard deviation of the first generation, as a share of each parameter's range."""


@dataclass(frozen=True, slots=True)
class FreeParameter:
    """A parameter to fit: key path in the scenario, bounds, and where it starts."""

    path: str
    lower: float
    upper: float
    start: float

    def value(self, unit: float) -> float:
        """Value for a coordinate in [0, 1]; coordinates outside are reflected into it."""
        folded = abs(unit) % 2.0
        return self.lower + (self.upper - self.lower) * (2.0 - folded if folded > 1.0 else folded)

    @property
    def start_unit(self) -> float:
        """Coordinate of the start value."""
        return (self.start - self.lower) / (self.upper - self.lower)


@dataclass(frozen=True, slots=True)
class Evaluation:
    """One set of values and how far its missions are from the published ones.

    Attributes:
        values: of the parameters.
        distances: energy distance of each manager's missions.
        share_difference: mean absolute difference of the clusters' shares; nought if none are compared.
        loss: mean of the distances, plus the difference of the shares.
    """

    values: tuple[float, ...]
    distances: tuple[float, ...]
    share_difference: float
    loss: float


@dataclass(frozen=True, slots=True)
class Problem:
    """What is fitted to what.

    Attributes:
        loaded: the scenario.
        parameters: what is free.
        published: missions as scaled vectors, by manager (see distance.py).
        runs: simulated missions for each manager and evaluation.
        seed: seed of the simulated missions; all evaluations use the same streams, so that differences between them are
            the parameters' doing.
    """

    loaded: LoadedScenario
    parameters: tuple[FreeParameter, ...]
    published: Mapping[str, Array]
    runs: int
    seed: int
    shares: tuple[tuple[Share, float], ...] = ()
    """Shares of missions in clusters, each with the published one; their mean absolute difference adds to the loss."""


def evaluate(problem: Problem, values: Sequence[float]) -> Evaluation:
    """Simulate all managers with one set of parameter values, and measure how far they are from the published runs."""
    named = {parameter.path: value for parameter, value in zip(problem.parameters, values, strict=True)}
    simulator = Simulator(with_values(problem.loaded, named))
    distances, missions = [], {}
    for manager in sorted(problem.published):
        published = problem.published[manager]
        missions[manager] = simulate(simulator, manager, problem.runs, problem.seed)
        distances.append(energy_distance(missions[manager][:, : published.shape[1]], published))
    difference = _share_difference(problem.shares, missions)
    return Evaluation(tuple(map(float, values)), tuple(distances), difference, float(np.mean(distances)) + difference)


def select(problem: Problem, tried: Sequence[Evaluation], workers: int) -> Evaluation:
    """The best of the few best evaluations, simulated anew with more missions and other streams.

    The least of many noisy losses is partly luck; this looks at it again, without the luck.
    """
    finalists = sorted(tried, key=lambda each: each.loss)[:FINALISTS]
    larger = replace(problem, runs=problem.runs * FINAL_FACTOR, seed=problem.seed + 1)
    with evaluator(larger, workers) as evaluate_all:
        return min(evaluate_all([each.values for each in finalists]), key=lambda each: each.loss)


def _share_difference(shares: Sequence[tuple[Share, float]], missions: Mapping[str, Array]) -> float:
    if not shares:
        return 0.0
    import pandas

    frames = [
        pandas.DataFrame(vectors * np.array(SCALES), columns=METRICS_AND_PLACE).assign(manager=name)
        for name, vectors in missions.items()
    ]
    simulated = pandas.concat(frames, ignore_index=True)
    differences = [abs((count(share, simulated).share or 0.0) - published) for share, published in shares]
    return float(np.mean(differences))


def simulate(simulator: Simulator, manager: str, runs: int, seed: int) -> Array:
    """Missions of one manager as scaled vectors, shape (runs, 3); the detection's x is nan where there was none."""
    metrics = [simulator.run(manager, run, seed).metrics for run in range(1, runs + 1)]
    return missions_as_vectors(
        np.array([each.search_time_s for each in metrics]),
        np.array([each.distance_inspected_m for each in metrics]),
        np.array([np.nan if each.detection_x_m is None else each.detection_x_m for each in metrics]),
    )


_problem: Problem | None = None


def _set_problem(problem: Problem) -> None:
    global _problem
    _problem = problem


def _evaluate_here(values: Sequence[float]) -> Evaluation:
    assert _problem is not None  # set when the worker started
    return evaluate(_problem, values)


@contextmanager
def evaluator(problem: Problem, workers: int) -> Iterator[Callable[[Sequence[Sequence[float]]], list[Evaluation]]]:
    """A function that evaluates several sets of values, on worker processes if there is more than one."""
    if workers == 1:
        yield lambda many: [evaluate(problem, values) for values in many]
        return
    context = multiprocessing.get_context("spawn")
    with main_hidden():
        pool = context.Pool(workers, initializer=_set_problem, initargs=(problem,))
    with pool:
        yield lambda many: pool.map(_evaluate_here, many, chunksize=1)


def fit(
    problem: Problem,
    evaluations: int,
    *,
    workers: int = 2,
    seed: int = 1,
    on_generation: Callable[[int, Evaluation], None] | None = None,
) -> list[Evaluation]:
    """Search for the values with the least distance, by CMA-ES (Hansen; package cma) in the box of the bounds.

    Args:
        problem: what is fitted to what.
        evaluations: about how many sets of values to try.
        workers: processes.
        seed: of the search.
        on_generation: called with the evaluations so far and the best one.

    Returns:
        All evaluations, in order.
    """
    import cma

    start = [parameter.start_unit for parameter in problem.parameters]
    settings = {"seed": seed % 2**32 or 2**32 - 1, "verbose": -9, "maxfevals": evaluations, "tolfun": 1e-9}
    search = cma.CMAEvolutionStrategy(start, FIRST_STEP, settings)
    tried: list[Evaluation] = []
    with evaluator(problem, workers) as evaluate_all:
        while len(tried) < evaluations:
            units = search.ask()
            many = [
                [parameter.value(float(unit)) for parameter, unit in zip(problem.parameters, candidate, strict=True)]
                for candidate in units
            ]
            generation = evaluate_all(many)
            search.tell(units, [each.loss for each in generation])
            tried.extend(generation)
            if on_generation is not None:
                on_generation(len(tried), min(tried, key=lambda each: each.loss))
    return tried
