"""How sharply each parameter is determined: the loss along it, against what the published runs can tell apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from suave_des.calibration.distance import Array, energy_distance
from suave_des.calibration.fit import Evaluation, FreeParameter, Problem, evaluator, simulate
from suave_des.scenario.loader import with_values
from suave_des.simulation.simulator import Simulator

POINTS = 9
RESAMPLES = 200


@dataclass(frozen=True)
class Profile:
    """The loss along one parameter, the others held at the best fit.

    Attributes:
        parameter: which.
        best: its fitted value.
        values: where the loss was evaluated, rising.
        losses: the loss there.
        low: least value whose loss is below the threshold, interpolated; the bound if all below the best are.
        high: greatest such value.
    """

    parameter: FreeParameter
    best: float
    values: tuple[float, ...]
    losses: tuple[float, ...]
    low: float
    high: float


def resampling_spread(problem: Problem, best: Evaluation, seed: int) -> float:
    """Standard deviation of the loss at the best fit when the published runs are drawn again with replacement.

    A change of the loss smaller than this could as well be the luck of the few published runs.
    """
    named = {each.path: value for each, value in zip(problem.parameters, best.values, strict=True)}
    simulator = Simulator(with_values(problem.loaded, named))
    generator = np.random.Generator(np.random.PCG64(seed))
    losses = np.zeros(RESAMPLES)
    for manager in sorted(problem.published):
        published = problem.published[manager]
        simulated = simulate(simulator, manager, problem.runs, problem.seed)[:, : published.shape[1]]
        losses += [_resampled(simulated, published, generator) for _ in range(RESAMPLES)]
    return float(np.std(losses / len(problem.published), ddof=1))


def _resampled(simulated: Array, published: Array, generator: np.random.Generator) -> float:
    return energy_distance(simulated, published[generator.integers(0, len(published), len(published))])


def profiles(problem: Problem, best: Evaluation, threshold: float, workers: int) -> list[Profile]:
    """The profile of every parameter; threshold is the loss up to which a value counts as possible."""
    grids = [_grid(parameter, value) for parameter, value in zip(problem.parameters, best.values, strict=True)]
    many = [_with(best.values, place, value) for place, grid in enumerate(grids) for value in grid]
    with evaluator(problem, workers) as evaluate_all:
        losses = iter([each.loss for each in evaluate_all(many)])
    found = []
    for parameter, value, grid in zip(problem.parameters, best.values, grids, strict=True):
        along = tuple(next(losses) for _ in grid)
        low = _crossing(value, best.loss, grid[::-1], along[::-1], threshold)
        high = _crossing(value, best.loss, grid, along, threshold)
        found.append(Profile(parameter, value, grid, along, low, high))
    return found


def _grid(parameter: FreeParameter, best: float) -> tuple[float, ...]:
    """Values from bound to bound, denser near the best one."""
    shares = (np.linspace(0.0, 1.0, POINTS // 2 + 1)[1:]) ** 2
    below = best - shares * (best - parameter.lower)
    above = best + shares * (parameter.upper - best)
    return tuple(sorted({*(float(value) for value in below), *(float(value) for value in above)}))


def _with(values: tuple[float, ...], place: int, value: float) -> tuple[float, ...]:
    return (*values[:place], value, *values[place + 1 :])


def _crossing(best: float, loss: float, grid: tuple[float, ...], losses: tuple[float, ...], threshold: float) -> float:
    """Going outwards from the best value along the grid's order, where the loss first exceeds the threshold."""
    rising = grid[-1] > grid[0]
    before, loss_before = best, loss
    for value, here in zip(grid, losses, strict=True):
        if (value > best) != rising or value == best:
            continue
        if here > threshold:
            share = (threshold - loss_before) / (here - loss_before) if here > loss_before else 0.0
            return before + max(0.0, share) * (value - before)
        before, loss_before = value, here
    return before
