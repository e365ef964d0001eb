"""Fit free parameters of scenarios to real missions, and determine how sharply each is known."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import cma
import numpy as np

from calibration.cases import FreeParameter, Problem
from calibration.loss import Evaluation, evaluate

FINALISTS, FINAL_FACTOR = 8, 4
"""How many of the best sets of values are evaluated again, and with how many times the missions."""
FIRST_STEP = 0.1
"""Standard deviation of the first generation, as a share of each parameter's range."""
POINTS = 9
"""Points of a profile; the middle one is the best value."""

EvaluateAll = Callable[[Sequence[Sequence[float]]], list[Evaluation]]


@contextmanager
def evaluator(problem: Problem, workers: int) -> Iterator[EvaluateAll]:
    """Evaluate several sets of values, on worker processes if there is more than one."""
    one = partial(evaluate, problem)
    if workers == 1:
        yield lambda many: list(map(one, many))
        return
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        yield lambda many: pool.map(one, many, chunksize=1)


def fit(
    problem: Problem,
    evaluations: int,
    *,
    workers: int = 2,
    seed: int = 1,
    on_generation: Callable[[int, Evaluation], None] | None = None,
) -> list[Evaluation]:
    """Search for the values with the least loss, by CMA-ES (Hansen; package cma) in the box of the
    bounds.

    Args:
        problem: what is fitted to what.
        evaluations: about how many sets of values to try.
        workers: processes.
        seed: of the search.
        on_generation: called with the evaluations so far and the best one.

    Returns:
        All evaluations, in order.
    """
    start = [(free.start - free.lower) / (free.upper - free.lower) for free in problem.parameters]
    settings = {
        "seed": seed % 2**32 or 2**32 - 1,
        "verbose": -9,
        "maxfevals": evaluations,
        "tolfun": 1e-9,
    }
    search = cma.CMAEvolutionStrategy(start, FIRST_STEP, settings)
    tried: list[Evaluation] = []
    with evaluator(problem, workers) as evaluate_all:
        while len(tried) < evaluations:
            units = search.ask()
            generation = evaluate_all([problem.values_at(candidate) for candidate in units])
            search.tell(units, [each.loss for each in generation])
            tried.extend(generation)
            if on_generation is not None:
                on_generation(len(tried), min(tried, key=lambda each: each.loss))
    return tried


def select(problem: Problem, tried: Sequence[Evaluation], workers: int) -> Evaluation:
    """Choose the best of the few best evaluations, simulated again with more missions and other
    streams.

    The least of many noisy losses is partly luck; the second evaluation is not chosen for it.
    """
    finalists = sorted(tried, key=lambda each: each.loss)[:FINALISTS]
    with evaluator(larger(problem), workers) as evaluate_all:
        return min(evaluate_all([each.values for each in finalists]), key=lambda each: each.loss)


def larger(problem: Problem, factor: int = FINAL_FACTOR) -> Problem:
    """Return the same with more missions and other streams."""
    return replace(problem, runs=problem.runs * factor, seed=problem.seed + 1)


@dataclass(frozen=True)
class Profile:
    """The loss along one parameter, the others held at the best fit.

    Attributes:
        parameter: which.
        best: its fitted value.
        values: where the loss was evaluated, rising.
        losses: the loss there.
        low: least admitted value: where the loss, interpolated, crosses the threshold; the bound if
            it never does.
        high: greatest admitted value.
    """

    parameter: FreeParameter
    best: float
    values: tuple[float, ...]
    losses: tuple[float, ...]
    low: float
    high: float


def profiles(problem: Problem, best: Evaluation, threshold: float, workers: int) -> list[Profile]:
    """Compute the profile of every parameter; a value is admitted up to a loss of `threshold`."""
    grids = [
        _grid(parameter, value)
        for parameter, value in zip(problem.parameters, best.values, strict=True)
    ]
    many = [
        (*best.values[:place], value, *best.values[place + 1 :])
        for place, grid in enumerate(grids)
        for value in grid
    ]
    with evaluator(problem, workers) as evaluate_all:
        losses = iter([each.loss for each in evaluate_all(many)])
    found = []
    for parameter, value, grid in zip(problem.parameters, best.values, grids, strict=True):
        along = tuple(next(losses) for _ in grid)
        points = list(zip(grid, along, strict=True))
        low = _crossing(
            value, best.loss, [point for point in points[::-1] if point[0] < value], threshold
        )
        high = _crossing(
            value, best.loss, [point for point in points if point[0] > value], threshold
        )
        found.append(Profile(parameter, value, grid, along, low, high))
    return found


def _grid(parameter: FreeParameter, best: float) -> tuple[float, ...]:
    """Values from bound to bound, denser near the best one."""
    shares = (np.linspace(0.0, 1.0, POINTS // 2 + 1)[1:]) ** 2
    below = best - shares * (best - parameter.lower)
    above = best + shares * (parameter.upper - best)
    return tuple(sorted({*below.tolist(), *above.tolist()}))


def _crossing(
    best: float, loss: float, outwards: Sequence[tuple[float, float]], threshold: float
) -> float:
    """Going outwards from the best value over values with their losses, where the loss first
    exceeds the threshold.
    """
    before, loss_before = best, loss
    for value, here in outwards:
        if here > threshold:
            share = (threshold - loss_before) / (here - loss_before) if here > loss_before else 0.0
            return before + max(0.0, share) * (value - before)
        before, loss_before = value, here
    return before
