"""Differences between a campaign's missions apart from manager and run: a sweep, each run's draws,
and an ensemble.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, ValidationError, model_validator

from suave_des.errors import InputError, located, shown
from suave_des.metrics.result import MissionResult
from suave_des.scenario.ensemble import Ensemble
from suave_des.scenario.loader import LoadedScenario, full_path, value_at, with_values
from suave_des.scenario.models import MissionSettings, Strict, wrong
from suave_des.scenario.yamlfile import problem_and_remedy

ENSEMBLE_COLUMN = "ensemble_member"
"""Column of runs.csv: number of the member, from 1."""
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
