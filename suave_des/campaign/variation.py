"""Differences between a campaign's missions apart from manager and run: a sweep, each run's draws,
and an ensemble.

Unknown parameters of the real vehicle and its software are not noise, but the same in all its
missions. So each run has one member of an ensemble, the same under all managers, and a difference
between these can be analysed by member.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, groupby, islice, product
from pathlib import Path
from statistics import fmean, stdev
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator

from suave_des.arguments import plain_arguments
from suave_des.errors import InputError, line_error, located, number_of, shown
from suave_des.estimates import known, mean_of, t_quantile
from suave_des.files import as_number, read_csv
from suave_des.metrics.result import MissionResult
from suave_des.records.metrics import Row
from suave_des.records.store import MissionKey
from suave_des.resources import find
from suave_des.scenario.loader import LoadedScenario, full_path, value_at, with_values
from suave_des.scenario.models import MissionSettings, Strict, wrong
from suave_des.scenario.yamlfile import problem_and_remedy
from suave_des.tables import TableRow

ENSEMBLE_COLUMN = "ensemble_member"
"""Column of runs.csv: number of the member, from 1."""
ENSEMBLE_COLUMNS = (
    *("first", "second", "metric", "n", "difference", "ci95_low", "ci95_high"),
    *("members", "members_above_0", "members_below_0", "range95_low", "range95_high"),
)
"""Columns of ensemble.csv before those of swept parameters."""
_NO_PARAMETERS = ("member", "loss")
_ENSEMBLE_LIMIT_BYTES = 5_000_000
_CHECKED_POINTS = 300
"""Of sweeps with more values, so many are checked before anything runs."""

Values = Annotated[tuple[object, ...], Field(min_length=1)]


class Sweep(Strict):
    """Every combination of a grid's values and the rows of a zip.

    Points are counted from 0; what is named last changes fastest.
    """

    grid: dict[str, Values] = Field(default_factory=dict)
    """Values by key path; all combinations are used."""
    zip: dict[str, Values] = Field(default_factory=dict)
    """Values by key path, of equal number: the first values together, then the second, and so
    on.
    """

    @model_validator(mode="after")
    def _rows_are_whole(self) -> Self:
        if len({len(values) for values in self.zip.values()}) > 1:
            listed = ", ".join(f"{name} has {len(values)}" for name, values in self.zip.items())
            raise wrong(
                f"the lists differ in length: {listed}",
                "give lists of the same length, or use grid",
                "zip",
            )
        return self

    @property
    def parameters(self) -> tuple[str, ...]:
        """Key paths of the parameters that are swept, as given."""
        return (*self.grid, *self.zip)

    @property
    def points(self) -> int:
        """Number of points; 1 if nothing is swept."""
        return math.prod(self._sizes())

    def values(self, point: int) -> dict[str, object]:
        """Return the value of each parameter at a point."""
        import numpy as np

        *grid, row = map(int, np.unravel_index(point, self._sizes()))
        values = {
            path: own[place] for (path, own), place in zip(self.grid.items(), grid, strict=True)
        }
        return values | {path: column[row] for path, column in self.zip.items()}

    def each_value(self) -> Iterator[int]:
        """Yield points that together have each value of the grid and each row of the zip."""
        sizes = self._sizes()
        for place, size in enumerate(sizes):
            stride = math.prod(sizes[place + 1 :])
            yield from range(0, size * stride, stride)

    def plain(self) -> dict[str, object]:
        """Return it as plain data, without parts that are not used."""
        return {form: content for form, content in self.model_dump(mode="json").items() if content}

    def _sizes(self) -> tuple[int, ...]:
        return (*map(len, self.grid.values()), len(next(iter(self.zip.values()), (None,))))


def plain(given: object) -> object:
    """Convert what a caller gives to the form of a file: arrays, ranges and series become lists,
    paths text.
    """
    if isinstance(given, Path):
        return str(given)
    if isinstance(given, Mapping):
        return {key: plain(each) for key, each in given.items()}
    if hasattr(given, "tolist"):  # of numpy or pandas
        return given.tolist()
    if isinstance(given, str | bytes) or not isinstance(given, Iterable):
        return given
    return [plain(each) for each in given]


def cell_of(value: object) -> str | int | float | bool | None:
    """Return a parameter's value as in runs.csv: lists and mappings as JSON."""
    if value is None or isinstance(value, str | int | float | bool):
        return value
    return json.dumps(value)


@dataclass(frozen=True)
class Ensemble:
    """Parameter sets that fit real missions equally well: for each member the values at the key
    paths of scenarios.
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


@dataclass(frozen=True)
class Variation:
    """Differences between a campaign's missions.

    Attributes:
        drawn: names of what each run draws, by the key path in the scenario.
        paths: key path in the scenario of each parameter that is swept, by its name as given.
        runs_per_draw: number of consecutive runs that share a draw.
        ensemble: parameter sets of which each run has one; none: all have the scenario's.
    """

    sweep: Sweep = field(default_factory=Sweep)
    drawn: Mapping[str, str] = field(default_factory=dict)
    paths: Mapping[str, str] = field(default_factory=dict)
    runs_per_draw: int = 1
    ensemble: Ensemble | None = None

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all that varies, as given, which are further columns of runs.csv."""
        return (
            *self.sweep.parameters,
            *self.drawn.values(),
            *((ENSEMBLE_COLUMN,) if self.ensemble else ()),
        )

    @property
    def runs_sharing_draw(self) -> int:
        """Number of consecutive runs that share a draw, and so are not independent; 1 where nothing
        is drawn.
        """
        return self.runs_per_draw if self.drawn else 1

    def member(self, run: int) -> int | None:
        """Return the number, from 1, of the parameter set that a run has; none without an
        ensemble.
        """
        return None if self.ensemble is None else self.ensemble.member(run)

    def scenario(
        self, loaded: LoadedScenario, point: int, member: int | None = None
    ) -> LoadedScenario:
        """Return the scenario of a point's missions, or of those with one member of the ensemble.

        Raises:
            InputError: the scenario does not allow the point's values together.
        """
        named = self.sweep.values(point) if self.paths else {}
        if member is not None and self.ensemble is not None:
            named |= self.ensemble.values(member)
        if not named:
            return loaded
        at = ", ".join(f"{name}={shown(value)}" for name, value in named.items())
        with located(f"at {at}: ", loaded.path):
            return with_values(
                loaded, {self.paths.get(name, name): value for name, value in named.items()}
            )


def vary(
    loaded: LoadedScenario,
    sweep: Mapping[str, object],
    perturbations: Mapping[str, object],
    runs_per_draw: int,
) -> tuple[LoadedScenario, Variation]:
    """Put the distributions of perturbations into a scenario; return it with the variation.

    Raises:
        InputError: a key path leads nowhere, a value is not allowed there, or the sweep has no
            points; its place is the key path within what was given.
    """
    varied: dict[str, str] = {}

    def path_of(place: str, name: str) -> str:
        path = full_path(dict(loaded.scenario), name)
        with located(place=place):
            value_at(loaded, path)
            if path in varied:
                raise InputError(
                    f"varies {path}, as {varied[path]} does", remedy="vary each key once"
                )
        varied[path] = place
        return path

    drawn = {path_of(f"perturbations.{name}", name): name for name in perturbations}
    for path, name in drawn.items():
        with located(place=f"perturbations.{name}"):
            distribution = perturbations[name]
            if not isinstance(distribution, Mapping):
                problem = f"expected a distribution, got {shown(distribution)}"
                remedy = "such as {distribution: normal, mean: 1, std: 2}"
                raise InputError(problem, remedy=remedy)
            loaded = with_values(loaded, {path: dict(distribution)})
    found, places = _sweep(sweep)
    paths = {name: path_of(places[name], name) for name in found.parameters}
    for name, values in found.grid.items():
        _check_once(places[name], [values])
    if found.zip:
        _check_once(places[next(iter(found.zip))], list(found.zip.values()))
    variation = Variation(found, drawn, paths, runs_per_draw)
    with located(place=next(iter(places.values())) if len(places) == 1 else "sweep"):
        for point in islice(found.each_value(), _CHECKED_POINTS):
            variation.scenario(loaded, point)
    return loaded, variation


def _check_once(place: str, columns: Sequence[Sequence[object]]) -> None:
    """Check that no two rows of a sweep's values are equal, as 1 and 1.0 are."""
    points = [tuple(map(_comparable, row)) for row in zip(*columns, strict=True)]
    if len(set(points)) < len(points):
        raise InputError("has a point twice", place=place, remedy="give each point once")


def _comparable(value: object) -> float | str:
    return float(value) if isinstance(value, int | float) else repr(value)


def _sweep(given: Mapping[str, object]) -> tuple[Sweep, dict[str, str]]:
    """Read a sweep; return it with the place of each parameter in what was given."""
    forms = [form for form in ("grid", "zip") if form in given]
    data = dict(given) if forms else {"grid": given}
    try:
        sweep = Sweep.model_validate(data)
    except ValidationError as error:
        keys, problem, remedy = problem_and_remedy(error, data, Sweep)
        places = [key for key in ("sweep", *keys) if forms or key != "grid"]
        raise InputError(problem, place=".".join(map(str, places)), remedy=remedy) from None
    parts = {"grid.": sweep.grid, "zip.": sweep.zip}
    return sweep, {
        name: f"sweep.{part if forms else ''}{name}"
        for part, names in parts.items()
        for name in names
    }


def check_drawn(loaded: LoadedScenario, variation: Variation) -> None:
    """Raise an InputError about a perturbation that is drawn at each use, like latencies and noise,
    not once a run.
    """
    drawn = short_mission(loaded).drawn if variation.drawn else {}
    for path, name in variation.drawn.items():
        if path not in drawn:
            remedy = "put the distribution into the scenario itself, or sweep its parameters"
            raise InputError(
                "is drawn at each use, not once per run",
                place=f"perturbations.{name}",
                remedy=remedy,
            )


def short_mission(loaded: LoadedScenario) -> MissionResult:
    """Run a mission of one second without a managing subsystem."""
    from suave_des.simulation.simulator import Simulator  # with the compiler, which takes a while

    short = loaded.scenario.model_copy(update={"mission": MissionSettings(time_limit_s=1.0)})
    return Simulator(replace(loaded, scenario=short)).run("none", 1, 0)


# Ensembles.


@plain_arguments
def read_ensemble(name: str | Path) -> tuple[Ensemble, Path, str]:
    """Read an ensemble: a CSV file with a column for each parameter and a row for each member.

    Example:
        ensemble, path, digest = read_ensemble("seams2023")
        print(len(ensemble.members), "parameter sets of", ensemble.paths)

    Args:
        name: of a file, or of a shipped one, such as seams2023. Its columns are named by the key
            paths of the scenario; columns `member` and `loss` are only for information.

    Returns:
        The ensemble, its path, and the SHA-256 of the file.

    Raises:
        InputError: with file and line: it cannot be read, has fewer than two members, or something
            else than numbers.
    """
    path = find(name, "scenarios/ensembles")
    header, rows, digest = read_csv(path, _ENSEMBLE_LIMIT_BYTES, "a row for each member")
    paths = tuple(name for name in header if name not in _NO_PARAMETERS)
    if not paths or not all(header) or len(set(header)) < len(header):
        raise line_error(
            path,
            1,
            "has no column for each parameter",
            "name each once, by its key path in the scenario",
        )
    members = []
    for line, row in rows:
        numbers = {name: as_number(cell) for name, cell in zip(header, row, strict=False)}
        member = tuple(numbers.get(name, math.nan) for name in paths)
        if len(row) != len(header) or not all(map(math.isfinite, member)):
            problem = f"expected {len(header)} numbers, got {', '.join(row)}"
            raise line_error(path, line, problem, "give each column one")
        members.append(member)
    if len(members) < 2:
        raise line_error(
            path, 1, f"has {number_of(len(members), 'member')}", "an ensemble has two or more"
        )
    return Ensemble(path.stem, paths, tuple(members)), path, digest


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
) -> Iterator[TableRow]:
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
        by_manager: dict[int, dict[int, Any]] = {}
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
) -> tuple[object, ...]:
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
