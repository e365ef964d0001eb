"""Parameter sets that fit the real runs as well as the shipped one: the ensembles of `campaign
--ensemble`.

A set is admitted if its loss against each data set, the runs of 2023 and experiment 1 of 2025, is
at most that of the shipped values plus a tolerance: the loss's standard error over resampled real
runs, as in the calibration's profiles. A parameter that both scenarios leave free, and have alike,
has one value for both. The admitted region is sampled evenly by a population of Markov chains,
whose steps are differences between chains (DE-MC: ter Braak, Statistics and Computing 16, 2006).
The chains' last states are then simulated again with twice the missions and other random numbers,
and are members if they are admitted there, too. The shipped values are the first member. Writes a
CSV file for each scenario, with a column for each parameter; for release15, of which there are no
real runs, those of seams2023 that it takes over.

    python analysis/ensemble.py [--out DIR] [--members N] [--generations N] [--runs N] [--workers N]
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from calibration.cases import FreeParameter, Problem, read_cases, read_problem
from calibration.fit import larger
from calibration.loss import evaluate, resampling_spread
from suave_des import load_scenario, read_conditions

Values = Mapping[str, float]
Losses = tuple[float, ...]
"""By data set."""

UNSEEN = "release15"
FIRST_STEP = 0.05
"""Standard deviation of the chains' first states about the shipped values, as a share of each
parameter's range.
"""
JITTER = 1e-3
LAST_GENERATIONS = 3
"""Generations whose states are checked."""
CHECK_FACTOR = 2
"""How many times the missions the check has."""


def problem_of(scenario: str, parameters: str, runs: int, managers: str | None = None) -> Problem:
    """Return a scenario or campaign with its published runs, and with what the file of its
    calibration frees.
    """
    return read_problem(parameters, read_cases([scenario], (), managers), runs, 1)


def loss(problem: Problem, values: Values) -> float:
    """Simulate with some values, and measure the distance to the real runs."""
    return evaluate(problem, [values[each.path] for each in problem.parameters]).loss


def tolerance(problem: Problem, values: Values) -> float:
    """Return the standard error of the loss over resampled real runs."""
    here = evaluate(problem, [values[each.path] for each in problem.parameters])
    return resampling_spread(problem, here, problem.seed)


@dataclass(frozen=True)
class Region:
    """All data sets together.

    Attributes:
        data: by scenario.
        keys: by scenario and path, the name of the parameter: the path, or with the scenario where
            its values differ.
        parameters: by that name.
        shipped: values by that name.
    """

    data: Mapping[str, Problem]
    keys: Mapping[str, Mapping[str, str]]
    parameters: Mapping[str, FreeParameter]
    shipped: Values

    @classmethod
    def of(cls, data: Mapping[str, Problem]) -> Region:
        """Find out which parameters the scenarios share."""
        plain = {name: load_scenario(name).scenario.model_dump() for name in data}
        found = {
            name: {each.path: value_at(plain[name], each.path) for each in one.parameters}
            for name, one in data.items()
        }
        keys = {
            name: {
                path: path
                if all(other.get(path, value) == value for other in found.values())
                else f"{name}: {path}"
                for path, value in own.items()
            }
            for name, own in found.items()
        }
        parameters = {
            keys[name][each.path]: each for name, one in data.items() for each in one.parameters
        }
        shipped = {
            keys[name][path]: value for name, own in found.items() for path, value in own.items()
        }
        return cls(data, keys, parameters, shipped)

    def own(self, name: str, values: Values) -> Values:
        """Return the values of one scenario, by path."""
        return {path: values[key] for path, key in self.keys[name].items()}

    def larger(self, factor: int) -> Region:
        """Return the same with more missions and other random numbers."""
        return replace(self, data={name: larger(one, factor) for name, one in self.data.items()})


def losses(region: Region, values: Values) -> Losses:
    """Return the loss of some values against each data set."""
    return tuple(loss(one, region.own(name, values)) for name, one in region.data.items())


EvaluateAll = Callable[[Sequence[Values]], list[Losses]]


def chains(
    region: Region, limits: Losses, count: int, generations: int, evaluate_all: EvaluateAll
) -> list[Values]:
    """Sample the region within the limits of every loss; returns the chains' last states, the
    latest first.
    """
    rng = np.random.default_rng(1)
    free = region.parameters
    lower, upper = (
        np.array([getattr(each, end) for each in free.values()]) for end in ("lower", "upper")
    )
    states = [region.shipped] * count
    visited: list[Values] = []
    for generation in range(generations):
        here = (np.array([[state[key] for key in free] for state in states]) - lower) / (
            upper - lower
        )
        steps = rng.normal(0.0, FIRST_STEP, here.shape)
        if generation >= 2:  # until then all chains stand nearly in one place
            others = [
                rng.choice(np.delete(np.arange(count), chain), 2, replace=False)
                for chain in range(count)
            ]
            differences = np.array([here[first] - here[second] for first, second in others])
            steps = 2.38 / np.sqrt(2 * len(lower)) * differences + rng.normal(
                0.0, JITTER, here.shape
            )
        proposed = [
            {
                key: each.value(float(unit))
                for (key, each), unit in zip(free.items(), units, strict=True)
            }
            for units in here + steps
        ]
        moved = [_admitted(found, limits) for found in evaluate_all(proposed)]
        states = [
            new if accepted else old
            for old, new, accepted in zip(states, proposed, moved, strict=True)
        ]
        visited = [*states, *visited]
        print(
            f"generation {generation + 1} of {generations}: {sum(moved)} of {count} chains moved",
            flush=True,
        )
    return visited[: LAST_GENERATIONS * count]


def _admitted(found: Losses, limits: Losses) -> bool:
    return all(loss <= limit for loss, limit in zip(found, limits, strict=True))


def value_at(plain: Any, path: str) -> float:
    """Return the number at a key path of plain data."""
    for key in path.split("."):
        plain = plain[int(key) if isinstance(plain, list) else key]
    return float(plain)


def taken_over(parameters: Sequence[FreeParameter], shipped: Values) -> list[FreeParameter]:
    """Return the parameters that the scenario without real runs has with the same value."""
    plain = load_scenario(UNSEEN).scenario.model_dump()
    found = []
    for each in parameters:
        try:
            same = value_at(plain, each.path) == shipped[each.path]
        except (KeyError, TypeError):  # it has no such number
            same = False
        found += [each] if same else []
    return found


def write(
    path: Path, parameters: Sequence[FreeParameter], members: Sequence[tuple[Values, float]]
) -> None:
    """Write the ensemble of one scenario: a row for each member, with its loss against the
    scenario's data.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["member", *(each.path for each in parameters), "loss"])
        for number, (values, loss) in enumerate(members, 1):
            writer.writerow(
                [number, *(f"{values[each.path]:.5g}" for each in parameters), f"{loss:.4f}"]
            )


def main() -> None:
    """Sample the region, check the members, write them."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "--out", type=Path, default=Path(__file__).parents[1] / "scenarios" / "ensembles"
    )
    options.add_argument("--members", type=int, default=24)
    options.add_argument("--generations", type=int, default=8)
    options.add_argument(
        "--runs", type=int, default=40, help="missions for each manager of 2023; of 2025, a tenth"
    )
    options.add_argument("--workers", type=int, default=2)
    chosen = options.parse_args()

    conditions = len(read_conditions("planta_exp1_campaign"))
    data = {
        "seams2023": problem_of("seams2023", "seams2023", chosen.runs),
        # What random does differs from run to run by far more than with any parameter.
        "planta_exp1": problem_of(
            "planta_exp1_campaign",
            "planta_exp1",
            conditions * max(2, chosen.runs // 10),
            "none,metacontrol,bt",
        ),
    }
    region = Region.of(data)
    best = losses(region, region.shipped)
    tolerances = tuple(
        tolerance(one, region.own(name, region.shipped)) for name, one in data.items()
    )
    for name, least, more in zip(data, best, tolerances, strict=True):
        print(f"{name}: loss of the shipped values {least:.4f}, tolerance {more:.4f}", flush=True)
    with multiprocessing.get_context("spawn").Pool(chosen.workers) as pool:
        evaluate_all = partial(pool.map, partial(losses, region), chunksize=1)
        sampled = chains(
            region, _sums(best, tolerances), chosen.members, chosen.generations, evaluate_all
        )
        rounded = [
            {key: float(f"{value:.5g}") for key, value in values.items()} for values in sampled
        ]
        distinct = [
            each
            for place, each in enumerate(rounded)
            if each not in rounded[:place] and each != region.shipped
        ]
        distinct = [region.shipped, *distinct[: 2 * chosen.members]]
        checked = pool.map(partial(losses, region.larger(CHECK_FACTOR)), distinct, chunksize=1)
    limits = _sums(checked[0], tolerances)
    passed = [
        (values, found)
        for values, found in zip(distinct, checked, strict=True)
        if _admitted(found, limits)
    ]
    members = passed[: chosen.members]
    if len(members) < chosen.members:
        print(
            f"only {len(members)} of {chosen.members} members: more --generations sample the region better"
        )
    for place, (name, one) in enumerate(data.items()):
        rows = [(region.own(name, values), found[place]) for values, found in members]
        write(chosen.out / f"{name}.csv", one.parameters, rows)
        if name == "seams2023":
            write(
                chosen.out / f"{UNSEEN}.csv",
                taken_over(one.parameters, region.own(name, region.shipped)),
                rows,
            )
    print(f"{len(members)} members of {len(distinct)} that were checked; see {chosen.out}")


def _sums(best: Losses, tolerances: Losses) -> Losses:
    return tuple(loss + tolerance for loss, tolerance in zip(best, tolerances, strict=True))


if __name__ == "__main__":
    main()
