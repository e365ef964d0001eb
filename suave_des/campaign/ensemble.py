"""Ensembles: parameter sets that fit the real runs equally well, to test whether conclusions hold under all of them.

Unknown parameters of the real vehicle and its software are not noise: they are the same in all its missions. A
campaign with an ensemble gives each run one of its members, the same under all managers, so that a difference between
managers can be analysed member by member.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, groupby, product
from pathlib import Path
from statistics import fmean, stdev
from typing import TYPE_CHECKING

from suave_des.errors import InputError, line_error, number_of, shown
from suave_des.estimates import estimate, t_quantile
from suave_des.files import as_number, read_csv
from suave_des.resources import find
from suave_des.scenario.loader import LoadedScenario, value_at

if TYPE_CHECKING:
    from suave_des.campaign.missions import MissionKey, Row
    from suave_des.campaign.variation import Variation

COLUMN = "ensemble_member"
"""Column of runs.csv: number of the member, from 1."""
ENSEMBLE_FILE = "ensemble.csv"
ENSEMBLE_COLUMNS = (
    "first",
    "second",
    "metric",
    "n",
    "difference",
    "ci95_low",
    "ci95_high",
    "members",
    "members_above_0",
    "members_below_0",
    "range95_low",
    "range95_high",
)
"""Columns of ensemble.csv before those of swept parameters."""
_KIND = "scenarios/ensembles"
_NO_PARAMETERS = ("member", "loss")
_SIZE_LIMIT_BYTES = 5_000_000


@dataclass(frozen=True)
class Ensemble:
    """Parameter sets that fit real missions equally well.

    Attributes:
        name: of its file.
        paths: key paths in the scenario.
        members: values of the parameters, one tuple for each member.
    """

    name: str
    paths: tuple[str, ...]
    members: tuple[tuple[float, ...], ...]

    def member(self, run: int) -> int:
        """Return the number, from 1, of the member that a run uses: they are used in turn."""
        return (run - 1) % len(self.members) + 1

    def values(self, member: int) -> dict[str, float]:
        """Return a member's values by key path."""
        return dict(zip(self.paths, self.members[member - 1], strict=True))


def read_ensemble(name: str | Path, beside: Path | None = None) -> tuple[Ensemble, Path, str]:
    """Read an ensemble: a CSV file with a column for each parameter and a row for each member.

    Args:
        name: of a file, or of a shipped one, such as seams2023. Its columns are named by the key paths of the scenario;
            columns `member` and `loss` are only for information.
        beside: folder of the file that names it; none: the current one.

    Returns:
        The ensemble, its path, and the SHA-256 of the file.

    Raises:
        InputError: with file and line: it cannot be read, has fewer than two members, or something else than numbers.
    """
    path = find(name, _KIND, beside=beside)
    header, numbered, digest = read_csv(path, _SIZE_LIMIT_BYTES, "a row for each member")
    rows = list(numbered)
    paths = tuple(name for name in header if name not in _NO_PARAMETERS)
    if not paths or not all(header):
        raise line_error(path, 1, "has no columns of parameters", "name each by its key path in the scenario")
    if repeated := next((each for each in header if header.count(each) > 1), None):
        raise line_error(path, 1, f"has column {shown(repeated)} twice", "name each parameter once")
    if len(rows) < 2:
        raise line_error(path, 1, f"has {number_of(len(rows), 'member')}", "an ensemble has two or more")
    members = tuple(_member(path, line, header, row) for line, row in rows)
    return Ensemble(path.stem, paths, members), path, digest


def _member(path: Path, line: int, header: Sequence[str], row: Sequence[str]) -> tuple[float, ...]:
    if len(row) != len(header):
        raise line_error(
            path, line, f"has {number_of(len(row), 'value')}, but the header has {len(header)}", "give each column one"
        )
    cells = {name: cell for name, cell in zip(header, row, strict=True) if name not in _NO_PARAMETERS}
    for name, cell in cells.items():
        if not math.isfinite(as_number(cell)):
            raise line_error(path, line, f"{name}: expected a number, got {shown(cell)}", "give it a value")
    return tuple(map(float, cells.values()))


def with_ensemble(loaded: LoadedScenario, variation: Variation, ensemble: Ensemble, path: Path) -> Variation:
    """Return a variation with an ensemble.

    Args:
        loaded: the scenario.
        variation: the other differences between missions.
        ensemble: parameter sets, of which each run uses one.
        path: its file.

    Raises:
        InputError: a parameter is not a number of this scenario, a member's values are not allowed in it, or it is
            swept or perturbed, too.
    """
    varied = {*variation.drawn, *variation.paths.values()}
    for name in ensemble.paths:
        if any(_overlap(name, other) for other in varied):
            problem = f"varies {name}, as the campaign's sweep or perturbations do"
            raise InputError(problem, file=path, remedy="vary each key once")
        try:
            present = value_at(loaded, name)
        except InputError as error:
            remedy = f"the ensemble is made for another scenario; {error.remedy}"
            raise InputError(f"{name}: {error.problem}", file=path, remedy=remedy) from None
        if not isinstance(present, int | float) or isinstance(present, bool):
            problem = f"{name}: expected a number in scenario {loaded.scenario.name}, which has {shown(present)}"
            raise InputError(problem, file=path, remedy="the ensemble is made for another scenario")
    found = replace(variation, ensemble=ensemble)
    for member in range(1, len(ensemble.members) + 1):
        try:
            found.scenario(loaded, 0, member)
        except InputError as error:
            raise InputError(f"member {member}: {error.problem}", file=path, remedy=error.remedy) from None
    return found


def _overlap(one: str, other: str) -> bool:
    """Whether two key paths are the same, or one is below the other."""
    return f"{one}.".startswith(f"{other}.") or f"{other}.".startswith(f"{one}.")


# How managers differ, over the members.


@dataclass(frozen=True, slots=True)
class MemberDifferences:
    """The difference of two managers in a metric, over the runs that both have.

    Attributes:
        first: manager.
        second: manager that it is compared with.
        metric: column of runs.csv.
        point: of the sweep, from 0.
        n: runs.
        mean: of first - second, paired by run.
        interval: 95% interval of the mean by Student's t, which is for chance alone; none for a single run.
        member_means: mean by member, in their order.
    """

    first: str
    second: str
    metric: str
    point: int
    n: int
    mean: float
    interval: tuple[float, float] | None
    member_means: tuple[float, ...]

    @property
    def above(self) -> int:
        """Members in whose mean the first has more than the second."""
        return sum(mean > 0.0 for mean in self.member_means)

    @property
    def below(self) -> int:
        """Members in whose mean the first has less."""
        return sum(mean < 0.0 for mean in self.member_means)

    @property
    def range(self) -> tuple[float, float] | None:
        """Range in which the differences of 95 in 100 parameter sets lie; None for a single member.

        It is the prediction interval for a further set: the mean ± Student's t times the standard deviation of the
        members' means, times the root of 1 + 1 / their number. The few runs of each member
        make it wider than the parameters do; with more of them it becomes narrower, down to that.
        """
        if len(self.member_means) < 2:
            return None
        members = len(self.member_means)
        half = t_quantile(members - 1) * stdev(self.member_means) * math.sqrt(1.0 + 1.0 / members)
        return self.mean - half, self.mean + half


def differences(
    rows: Iterable[tuple[MissionKey, Row]], managers: Sequence[str], metrics: Mapping[str, int], ensemble: Ensemble
) -> Iterator[MemberDifferences]:
    """Yield the difference of each pair of managers in each metric, point by point.

    Args:
        rows: of runs.csv, in order, with their keys.
        managers: in the campaign's order.
        metrics: place in a row by name.
        ensemble: of the campaign.
    """
    for point, missions in groupby(rows, key=lambda found: found[0].point):
        by_manager: dict[str, dict[int, list[float]]] = {manager: {} for manager in managers}
        for key, row in missions:
            by_manager[managers[key.manager]][key.run] = [_float(row[place]) for place in metrics.values()]
        for (place, metric), (second, first) in product(enumerate(metrics), combinations(managers, 2)):
            ours, theirs = by_manager[first], by_manager[second]
            by_run = {run: ours[run][place] - theirs[run][place] for run in sorted(ours) if run in theirs}
            if by_run:
                yield _difference((first, second), metric, point, by_run, ensemble)


def _float(cell: object) -> float:
    assert isinstance(cell, int | float)
    return float(cell)


def _difference(
    pair: tuple[str, str], metric: str, point: int, by_run: Mapping[int, float], ensemble: Ensemble
) -> MemberDifferences:
    by_member: dict[int, list[float]] = {}
    for run, value in by_run.items():
        by_member.setdefault(ensemble.member(run), []).append(value)
    over_all = estimate(list(by_run.values()))
    assert over_all.mean is not None
    means = tuple(fmean(by_member[member]) for member in sorted(by_member))
    return MemberDifferences(*pair, metric, point, len(by_run), over_all.mean, over_all.mean_interval, means)
