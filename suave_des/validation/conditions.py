"""Tell under which of a campaign's conditions a mission was made, and compare missions condition by condition.

The conditions of a campaign are the points of its sweep: start, time of a failure, shift of the visibility. A real
mission is compared with simulated ones of its own condition, so that what differs between conditions is not taken for
chance.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from suave_des.campaign.variation import Sweep, cell_of
from suave_des.errors import InputError
from suave_des.estimates import Estimate, estimate

if TYPE_CHECKING:
    import pandas

CONDITION = "condition"
"""Column of a frame of missions: number of the condition, from 1."""
NUMBER_COLUMNS = (CONDITION, "block")
"""Columns of data files that may have that number."""
_RELATIVE, _ABSOLUTE = 1e-3, 0.01
"""Data files give conditions rounded; values as near as this are the same."""
_LISTED = 12


@dataclass(frozen=True)
class Conditions:
    """The conditions of a campaign.

        conditions = Conditions.of(Sweep(zipped={"start.y_m": [2.5, 2.8], "thruster_events.0.time_s": [146.4, 91.2]}))

    Attributes:
        names: parameters that differ between conditions, as the campaign gives them.
        values: of the parameters, for each condition.
    """

    names: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]

    @classmethod
    def of(cls, sweep: Sweep) -> Conditions:
        """Return the points of a sweep as conditions."""
        points = (sweep.values(point) for point in range(sweep.points))
        return cls(sweep.parameters, tuple(tuple(map(cell_of, each.values())) for each in points))

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.values)

    def text(self, number: int) -> str:
        """Return a condition's values, such as "start.y_m=2.455"."""
        return ", ".join(f"{name}={value}" for name, value in zip(self.names, self.values[number - 1], strict=True))

    def listing(self) -> Iterator[str]:
        """Yield a line for each condition with its values; of very many, only of the first."""
        for number in range(1, min(len(self), _LISTED) + 1):
            yield f"Condition {number}: {self.text(number)}"
        if len(self) > _LISTED:
            yield f"... and {len(self) - _LISTED} more"

    def numbers(self, runs: pandas.DataFrame) -> NDArray[np.int64] | None:
        """Return the number of each mission's condition, by what its columns say.

        Args:
            runs: a row for each mission; of columns named like the parameters, those that are there must agree, and
                without any a column of NUMBER_COLUMNS may have the numbers.

        Returns:
            From 1, shape (n,); none if there is no such column.

        Raises:
            InputError: about a row, counted from 0 as its place: it is of no condition, or of several.
        """
        named = [name for name in self.names if name in runs]
        if named:
            return self._by_values(runs, named)
        column = next((name for name in NUMBER_COLUMNS if name in runs), None)
        return None if column is None else self._by_number(runs[column], column)

    def _by_number(self, column: pandas.Series[Any], name: str) -> NDArray[np.int64]:
        for row, value in enumerate(column):
            if not (_is_number(value) and float(value).is_integer() and 1 <= float(value) <= len(self)):
                problem = f"{name}: there is no condition {value}"
                raise InputError(problem, place=str(row), remedy=f"the campaign has {len(self)}, counted from 1")
        return column.to_numpy(float).astype(np.int64)

    def _by_values(self, runs: pandas.DataFrame, named: Sequence[str]) -> NDArray[np.int64]:
        places = [self.names.index(name) for name in named]
        fits = np.array(
            [
                np.all([_same(runs[name], values[place]) for name, place in zip(named, places, strict=True)], axis=0)
                for values in self.values
            ]
        )
        for row in np.flatnonzero(fits.sum(axis=0) != 1)[:1]:
            given = ", ".join(f"{name}={runs[name].iloc[row]}" for name in named)
            fitting = [str(number) for number in 1 + np.flatnonzero(fits[:, row])]
            if fitting:
                remedy = f"add columns for {', '.join(name for name in self.names if name not in named) or CONDITION}"
                problem = f"conditions {', '.join(fitting)} of the campaign all have {given}"
            else:
                listed = "; ".join(map(self.text, range(1, min(len(self), 8) + 1)))
                problem, remedy = f"no condition of the campaign has {given}", f"it has {listed}"
            raise InputError(problem, place=str(row), remedy=remedy)
        return np.asarray(1 + fits.argmax(axis=0), dtype=np.int64)

    def in_order(self, managers: pandas.Series[str]) -> NDArray[np.int64] | None:
        """Number missions by their order, as the exemplar's runner makes them: equally many runs of each condition.

        Args:
            managers: of each mission, in the order in which they were made.

        Returns:
            From 1, shape (n,); none if a manager's missions do not divide evenly.
        """
        places = managers.groupby(managers, sort=False).cumcount().to_numpy()
        sizes = managers.groupby(managers, sort=False).transform("size").to_numpy()
        if np.any(sizes % len(self)):
            return None
        return np.asarray(1 + places // (sizes // len(self)), dtype=np.int64)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and math.isfinite(value)


def _same(column: pandas.Series[Any], value: Any) -> NDArray[np.bool_]:
    import pandas

    if isinstance(value, int | float) and not isinstance(value, bool):
        numbers = pandas.to_numeric(column, errors="coerce").to_numpy(float)
        return np.asarray(np.isclose(numbers, value, rtol=_RELATIVE, atol=_ABSOLUTE), dtype=np.bool_)
    return (column.astype(str) == ("" if value is None else str(value))).to_numpy(bool)


def balanced(real: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str]) -> pandas.DataFrame:
    """Leave out simulated missions so that each manager has them in the real missions' proportions of conditions.

    Raises:
        InputError: a manager has real missions under a condition, and no simulated one.
    """
    import pandas

    kept = []
    for manager in managers:
        theirs = Counter(real.loc[real["manager"] == manager, CONDITION].tolist())
        ours = simulated[simulated["manager"] == manager]
        counts = Counter(ours[CONDITION].tolist())
        for number in sorted(theirs):
            if number not in counts:
                problem = f"there is no simulated mission of manager {manager} under condition {number}"
                raise InputError(problem, remedy="simulate every condition of the campaign")
        factor = min(counts[number] / count for number, count in theirs.items())
        factor = math.floor(factor) or factor  # fewer simulated than real ones: as nearly as can be
        wanted = {number: max(1, math.floor(factor * count)) for number, count in theirs.items()}
        place = ours.groupby(CONDITION).cumcount()
        kept.append(ours[place < ours[CONDITION].map(wanted).fillna(0)])
    return pandas.concat(kept)


@dataclass(frozen=True, slots=True)
class ConditionComparison:
    """A metric of one manager under one condition, counted from 1: estimates from real and simulated missions."""

    manager: str
    metric: str
    condition: int
    real: Estimate
    simulated: Estimate

    @property
    def difference(self) -> float:
        """Simulated - real median."""
        assert self.real.median is not None and self.simulated.median is not None
        return self.simulated.median - self.real.median


@dataclass(frozen=True, slots=True)
class ConditionSummary:
    """A metric over all conditions of one manager, or of all.

    Attributes:
        manager: managing subsystem, or "all".
        metric: what is compared.
        conditions: how many comparisons.
        difference: median over them of |simulated - real median|.
        real_std: median over them of the real missions' standard deviation within a condition.
        simulated_std: the same of the simulated ones.
    """

    manager: str
    metric: str
    conditions: int
    difference: float
    real_std: float | None
    simulated_std: float | None

    @property
    def std_ratio(self) -> float | None:
        """Simulated / real spread within a condition; none where either is not known or the latter is zero."""
        return self.simulated_std / self.real_std if self.real_std and self.simulated_std is not None else None


def compare_conditions(
    real: pandas.DataFrame, simulated: pandas.DataFrame, managers: Sequence[str], metrics: Sequence[str]
) -> tuple[ConditionComparison, ...]:
    """Compare missions condition by condition; empty if no conditions are known."""
    if CONDITION not in real or CONDITION not in simulated:
        return ()
    found = []
    for metric in metrics:
        for manager in managers:
            theirs, ours = (_by_condition(side, manager, metric) for side in (real, simulated))
            found += [
                ConditionComparison(manager, metric, number, estimate(values), estimate(ours[number]))
                for number, values in sorted(theirs.items())
                if number in ours
            ]
    return tuple(found)


def _by_condition(runs: pandas.DataFrame, manager: str, metric: str) -> Mapping[int, list[float]]:
    own = runs[(runs["manager"] == manager) & runs[metric].notna()]
    numbers = own[CONDITION].unique().tolist()
    return {number: own.loc[own[CONDITION] == number, metric].tolist() for number in numbers}


def summarise(compared: Sequence[ConditionComparison]) -> Iterator[ConditionSummary]:
    """Yield the summary of each metric and manager, and then of the metric for all managers."""
    for metric in dict.fromkeys(each.metric for each in compared):
        own = [each for each in compared if each.metric == metric]
        managers = list(dict.fromkeys(each.manager for each in own))
        for manager in managers:
            yield _summary(manager, metric, [each for each in own if each.manager == manager])
        yield _summary("all", metric, own)


def _summary(manager: str, metric: str, compared: Sequence[ConditionComparison]) -> ConditionSummary:
    spreads: list[tuple[float, float]] = [
        (each.real.std, each.simulated.std)
        for each in compared
        if each.real.std is not None and each.simulated.std is not None
    ]
    real_std, simulated_std = (median(side) for side in zip(*spreads, strict=True)) if spreads else (None, None)
    difference = median(abs(each.difference) for each in compared)
    return ConditionSummary(manager, metric, len(compared), difference, real_std, simulated_std)
