"""Measure how far simulated missions are from real ones.

The loss of a scenario is the mean over the managers of the energy distance between missions as
vectors, plus the mean absolute difference of the shares of missions in clusters. The energy
distance of the distributions of X and Y is 2 E|X - Y| - E|X - X'| - E|Y - Y'| (Székely and Rizzo,
2013); it is zero only if they are equal. scipy has it for single values only. A mission is the
vector of its search time, its distance inspected and the x of the pipeline point seen first, each
divided by a scale, so that which values come together counts, too. Where real missions were made
under known conditions, a manager's distance is the mean over them of that within a condition. The
loss of several scenarios is the mean of theirs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas
from numpy.typing import NDArray
from scipy.stats import bootstrap

from calibration.cases import CONDITION, Case, Problem
from suave_des import Simulator, compare_conditions, with_values

Vectors = NDArray[np.float64]
"""Missions as scaled vectors, shape (n, 2 or 3); unknown components are nan."""

SCALES = {"search_time_s": 40.0, "distance_inspected_m": 12.0, "detection_x_m": 1.5}
"""What components are divided by: about the published standard deviations within a manager."""
_COLUMNS = (*SCALES, "pipeline_found", "mean_reaction_time_s")
"""What is known of a simulated mission."""
RESAMPLES = 200


@dataclass(frozen=True, slots=True)
class CaseLoss:
    """How far the missions of one case are from its real ones.

    Attributes:
        distances: energy distance of each manager's missions, by name; over conditions, their mean.
        share_difference: mean absolute difference of the clusters' shares; zero if none are
            compared.
    """

    distances: Mapping[str, float]
    share_difference: float

    @property
    def loss(self) -> float:
        """Mean of the distances + the difference of the shares."""
        return float(np.mean(list(self.distances.values()))) + self.share_difference


@dataclass(frozen=True, slots=True)
class Evaluation:
    """One set of values of the parameters, and the loss of each case."""

    values: tuple[float, ...]
    cases: tuple[CaseLoss, ...]

    @property
    def loss(self) -> float:
        """Mean of the cases' losses."""
        return float(np.mean([each.loss for each in self.cases]))


def energy_distance(x: Vectors, y: Vectors) -> float:
    """Energy distance between two samples of vectors, shapes (n, d) and (m, d).

    A component that is nan in either vector of a pair is left out, and the others are scaled up in
    its place.
    """
    return 2.0 * _mean_distance(x, y) - _mean_distance(x, x) - _mean_distance(y, y)


def _mean_distance(x: Vectors, y: Vectors) -> float:
    difference = x[:, None, :] - y[None, :, :]
    known = ~np.isnan(difference)
    squares = np.where(known, difference, 0.0) ** 2
    return float(np.sqrt(squares.sum(axis=2) / known.mean(axis=2)).mean())


def as_vectors(missions: pandas.DataFrame) -> Vectors:
    """Scale missions with the columns of records.runs.FRAME_COLUMNS; shape (n, 3)."""
    vectors: Vectors = missions[list(SCALES)].to_numpy(float) / np.array(list(SCALES.values()))
    return vectors


def simulate(simulator: Simulator, manager: str, runs: int, seed: int) -> pandas.DataFrame:
    """Simulate missions of one manager; a frame with the columns that are compared."""
    metrics = [simulator.run(manager, run, seed).metrics for run in range(1, runs + 1)]
    rows = [
        {"manager": manager, **{name: getattr(each, name) for name in _COLUMNS}} for each in metrics
    ]
    return pandas.DataFrame(rows).astype({**dict.fromkeys(_COLUMNS, float), "pipeline_found": bool})


def simulate_case(problem: Problem, case: Case, values: Sequence[float]) -> pandas.DataFrame:
    """Simulate missions of all managers of a case, under all its conditions, with one set of
    parameter values.

    Returns:
        A row for each mission: manager, condition, and the columns that are compared.
    """
    own = problem.values_of(case, values)
    runs = runs_for_each(problem, case)
    frames = []
    for number, condition in case.conditions.items():
        simulator = Simulator(with_values(case.loaded, {**condition, **own}))
        frames += [
            simulate(simulator, manager, runs, problem.seed).assign(**{CONDITION: number})
            for manager in case.managers
        ]
    return pandas.concat(frames, ignore_index=True)


def runs_for_each(problem: Problem, case: Case) -> int:
    """Return the number of missions of each manager under each condition: at least 2, for their
    spread.
    """
    return max(2, -(-problem.runs // len(case.conditions))) if case.has_conditions else problem.runs


def evaluate(problem: Problem, values: Sequence[float]) -> Evaluation:
    """Simulate all cases with one set of parameter values, and compute the loss."""
    losses = tuple(compare(case, simulate_case(problem, case, values)) for case in problem.cases)
    return Evaluation(tuple(map(float, values)), losses)


def compare(case: Case, simulated: pandas.DataFrame) -> CaseLoss:
    """Compare simulated missions, as of simulate, with a case's real ones."""
    distances = {
        manager: float(
            np.mean([energy_distance(*pair) for pair in _pairs(case, simulated, manager)])
        )
        for manager in case.managers
    }
    difference = 0.0
    if case.shares:
        alike = balanced(case, simulated) if case.has_conditions else simulated
        counted = [share.count(alike) for share, _ in case.shares]
        apart = [
            abs(number / max(1, n) - real)
            for (number, n), (_, real) in zip(counted, case.shares, strict=True)
        ]
        difference = float(np.mean(apart))
    return CaseLoss(distances, difference)


def balanced(case: Case, simulated: pandas.DataFrame) -> pandas.DataFrame:
    """Leave out simulated missions so that each manager has them in the real missions' proportions
    of conditions.
    """
    kept = []
    for manager in case.managers:
        real = case.real.loc[case.real["manager"] == manager, CONDITION].value_counts().sort_index()
        ours = simulated[simulated["manager"] == manager]
        factor = float((ours[CONDITION].value_counts().reindex(real.index) / real).min())
        factor = math.floor(factor) or factor  # fewer simulated than real ones
        wanted = (factor * real // 1.0).clip(lower=1.0)
        is_wanted = ours.groupby(CONDITION).cumcount() < ours[CONDITION].map(wanted).fillna(0)
        kept.append(ours[is_wanted])
    return pandas.concat(kept)


def _pairs(
    case: Case, simulated: pandas.DataFrame, manager: str
) -> Iterator[tuple[Vectors, Vectors]]:
    """Yield simulated and real missions of a manager for each condition under which there are real
    ones.

    A component that is never known in the real ones is left out.
    """
    ours, theirs = (side[side["manager"] == manager] for side in (simulated, case.real))
    for number in sorted(set(theirs[CONDITION])):
        real, simulated_ones = (
            as_vectors(side[side[CONDITION] == number]) for side in (theirs, ours)
        )
        known = ~np.isnan(real).all(axis=0)
        yield simulated_ones[:, known], real[:, known]


@dataclass(frozen=True, slots=True)
class Judgement:
    """How well one case is met by one set of values.

    Attributes:
        conditions: of the case, by number.
        loss: of the case.
        median_difference_s: median over managers and conditions of |real - simulated median search
            time|.
    """

    conditions: tuple[int, ...]
    loss: float
    median_difference_s: float


def judge(problem: Problem, case: Case, values: Sequence[float]) -> Judgement:
    """Simulate a case with one set of values; return its loss and the difference of median search
    times.
    """
    simulated = simulate_case(problem, case, values)
    compared = compare_conditions(case.real, simulated, case.managers, ["search_time_s"])
    difference_s = float(compared["difference_of_medians"].abs().median())
    return Judgement(tuple(case.conditions), compare(case, simulated).loss, difference_s)


def resampling_spread(problem: Problem, best: Evaluation, seed: int) -> float:
    """Bootstrap standard error of the best fit's mean energy distance over the real missions.

    A change of the loss smaller than this could as well come from which few missions were made.
    """
    groups: list[
        list[list[tuple[Vectors, Vectors]]]
    ] = []  # by case and manager, a pair for each condition
    for case in problem.cases:
        simulated = simulate_case(problem, case, best.values)
        groups.append([list(_pairs(case, simulated, manager)) for manager in case.managers])

    def mean_distance(*drawn: NDArray[np.int64]) -> float:
        rows = iter(drawn)

        def of_manager(pairs: list[tuple[Vectors, Vectors]]) -> float:
            chosen = (real[next(rows)] if len(real) > 1 else real for _, real in pairs)
            return float(
                np.mean(
                    [
                        energy_distance(ours, real)
                        for (ours, _), real in zip(pairs, chosen, strict=True)
                    ]
                )
            )

        return float(
            np.mean([np.mean([of_manager(pairs) for pairs in managers]) for managers in groups])
        )

    rows = [
        np.arange(len(real))
        for managers in groups
        for pairs in managers
        for _, real in pairs
        if len(real) > 1
    ]
    if not rows:  # one real mission of each manager and condition says nothing of their spread
        return 0.0
    rng = np.random.default_rng(seed)
    found = bootstrap(
        rows, mean_distance, n_resamples=RESAMPLES, vectorized=False, method="percentile", rng=rng
    )
    return float(found.standard_error)
