"""Differences between a campaign's missions apart from manager and run: a sweep, and each run's draws.

The points of a sweep follow from the campaign's seed and their number, so that any worker finds the same.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from itertools import islice
from typing import Any

from pydantic import TypeAdapter, ValidationError

from suave_des.campaign.ensemble import COLUMN as ENSEMBLE_COLUMN
from suave_des.campaign.ensemble import Ensemble
from suave_des.domain import WATER_VISIBILITY
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.metrics.result import MissionResult
from suave_des.scenario.loader import LoadedScenario, value_at, with_values
from suave_des.scenario.models import MissionSettings
from suave_des.scenario.quantities import Distribution
from suave_des.streams import Streams

METHODS = ("latin_hypercube", "sobol")
SOBOL_DIMENSIONS = 21_201
"""Dimensions for which scipy has direction numbers of Sobol's sequence."""
_FORMS = ("grid", "zip", "sample")
_MOST_VALUES = 1_000_000
_CHECKED_POINTS = 300
"""Of sweeps with more points, so many are checked before anything runs."""
_DISTRIBUTION: TypeAdapter[Any] = TypeAdapter(Distribution)


@dataclass(frozen=True)
class SampledPoints:
    """A sampled design: points that fill a box evenly.

    Attributes:
        method: one of METHODS.
        points: how many; for sobol a power of 2, as its balance needs.
        ranges: smallest and greatest value by key path.
    """

    method: str
    points: int
    ranges: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Sweep:
    """Every combination of a grid's values, the rows of a zip, and the points of a sampled design.

    Points are counted from 0; what is named last changes fastest.

    Attributes:
        grid: values by key path; all combinations are used.
        zipped: values by key path, of equal number: the first values together, then the second, and so on.
        sample: a sampled design, or none.
        seed: the campaign's, for the sampled design.
    """

    grid: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    zipped: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    sample: SampledPoints | None = None
    seed: int = 0

    @property
    def parameters(self) -> tuple[str, ...]:
        """Key paths of the parameters that are swept, as given."""
        return (*self.grid, *self.zipped, *(self.sample.ranges if self.sample else ()))

    @property
    def points(self) -> int:
        """Number of points; 1 if nothing is swept."""
        return math.prod(self._sizes())

    def values(self, point: int) -> dict[str, Any]:
        """Return the value of each parameter at a point."""
        places = []
        for size in reversed(self._sizes()):
            point, place = divmod(point, size)
            places.append(place)
        *grid, row, sampled = reversed(places)
        values = {path: self.grid[path][place] for path, place in zip(self.grid, grid, strict=True)}
        values |= {path: column[row] for path, column in self.zipped.items()}
        if self.sample is not None:
            values |= dict(zip(self.sample.ranges, self._sampled[sampled], strict=True))
        return values

    def each_value(self) -> Iterator[int]:
        """Yield points that together have each value of the grid and each row of the zip."""
        sizes = self._sizes()
        for place, size in enumerate(sizes):
            stride = math.prod(sizes[place + 1 :])
            yield from range(0, size * stride, stride)

    def plain(self) -> dict[str, Any]:
        """Return it as plain data, without parts that are not used."""
        plain = {"grid": dict(self.grid), "zip": dict(self.zipped), "sample": self.sample and asdict(self.sample)}
        return {form: content for form, content in plain.items() if content}

    def _sizes(self) -> tuple[int, ...]:
        rows = len(next(iter(self.zipped.values()))) if self.zipped else 1
        return (*map(len, self.grid.values()), rows, self.sample.points if self.sample else 1)

    @cached_property
    def _sampled(self) -> list[list[float]]:
        import numpy as np
        from scipy.stats import qmc  # takes half a second to import

        assert self.sample is not None
        engines = {"latin_hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol}
        bits = np.random.PCG64(Streams(self.seed, 0).stream("sweep").getrandbits(64))
        engine = engines[self.sample.method](d=len(self.sample.ranges), rng=np.random.Generator(bits))
        low, high = np.array(list(self.sample.ranges.values())).T
        rows: list[list[float]] = (low + engine.random(self.sample.points) * (high - low)).tolist()
        return rows


def plain(given: Any, name: str = "sweep") -> Any:
    """Convert a caller's sweep to the form of a file: arrays, ranges, series and the like become lists.

    Example:
        >>> plain({"thruster_events.0.time_s": range(20, 50, 10)})
        {'thruster_events.0.time_s': [20, 30, 40]}

    Raises:
        InputError: a range is without end, or very long.
    """
    if isinstance(given, Mapping):
        return {key: plain(each, f"{name}.{key}") for key, each in given.items()}
    if hasattr(given, "tolist"):  # of numpy or pandas
        return given.tolist()
    if isinstance(given, str | bytes) or not isinstance(given, Iterable):
        return given
    values = list(islice(given, _MOST_VALUES + 1))
    if len(values) > _MOST_VALUES:
        raise InputError(f"{name} has more than {_MOST_VALUES:,} values", remedy="give fewer")
    return [plain(each, name) for each in values]


def cell_of(value: Any) -> str | int | float | bool | None:
    """Return a parameter's value as in runs.csv: lists and mappings as JSON."""
    return value if value is None or isinstance(value, str | int | float | bool) else json.dumps(value)


@dataclass(frozen=True)
class Variation:
    """Differences between a campaign's missions.

    Attributes:
        sweep: what differs between points.
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
        return (*self.sweep.parameters, *self.drawn.values(), *((ENSEMBLE_COLUMN,) if self.ensemble else ()))

    @property
    def runs_sharing_draw(self) -> int:
        """Number of consecutive runs that share a draw, and so are not independent; 1 where nothing is drawn."""
        return self.runs_per_draw if self.drawn else 1

    def member(self, run: int) -> int | None:
        """Return the number, from 1, of the parameter set that a run has; none without an ensemble."""
        return None if self.ensemble is None else self.ensemble.member(run)

    def scenario(self, loaded: LoadedScenario, point: int, member: int | None = None) -> LoadedScenario:
        """Return the scenario of a point's missions, or of those with one member of the ensemble.

        Raises:
            InputError: the scenario does not allow the point's values together.
        """
        if self.paths:
            values = self.sweep.values(point)
            try:
                loaded = with_values(loaded, {self.paths[name]: value for name, value in values.items()})
            except InputError as error:
                at = ", ".join(f"{name}={shown(value)}" for name, value in values.items())
                raise InputError(f"at {at}: {error.problem}", file=error.file, remedy=error.remedy) from None
        if member is not None and self.ensemble is not None:
            loaded = with_values(loaded, self.ensemble.values(member))
        return loaded


def vary(
    loaded: LoadedScenario,
    sweep: Mapping[str, Any],
    perturbations: Mapping[str, Any],
    runs_per_draw: int,
    seed: int,
) -> tuple[LoadedScenario, Variation]:
    """Put the distributions of perturbations into a scenario; return it with the variation.

    Args:
        loaded: the scenario.
        sweep: values by key path; or a mapping with grid, zip and sample.
        perturbations: distribution by key path.
        runs_per_draw: number of consecutive runs that share a draw.
        seed: the campaign's.

    Raises:
        InputError: a key path leads nowhere, a value is not allowed there, or the sweep has no points; its place is
            the key path within what was given.
    """
    if runs_per_draw < 1:
        raise _wrong("runs_per_draw", f"{runs_per_draw} is out of range", "1, or how many runs share one draw")
    perturbed = {name: _full_path(loaded, f"perturbations.{name}", name) for name in perturbations}
    for name, path in perturbed.items():
        loaded = _perturbed(loaded, f"perturbations.{name}", path, perturbations[name])
    found, places = _sweep(sweep, seed)
    paths = {name: _full_path(loaded, places[name], name) for name in found.parameters}
    _check_each_once(perturbed, {places[name]: path for name, path in paths.items()})
    variation = Variation(found, {path: name for name, path in perturbed.items()}, paths, runs_per_draw)
    _check_drawn(loaded, perturbed)
    _check_points(loaded, variation, next(iter(places.values())) if len(places) == 1 else "sweep")
    return loaded, variation


def _wrong(place: str, problem: str, remedy: str | None) -> InputError:
    return InputError(problem, place=place, remedy=remedy)


def _full_path(loaded: LoadedScenario, place: str, name: str) -> str:
    """Return the key path of a name: a signal needs no `signals.`, and visibility is water_visibility."""
    first, *rest = name.split(".")
    if first not in type(loaded.scenario).model_fields:
        signal = WATER_VISIBILITY if first == "visibility" else first
        if signal in loaded.scenario.signals:
            name = ".".join(("signals", signal, *rest))
    try:
        value_at(loaded, name)
    except InputError as error:
        raise _wrong(place, error.problem, error.remedy) from None
    return name


def _perturbed(loaded: LoadedScenario, place: str, path: str, distribution: Any) -> LoadedScenario:
    try:
        _DISTRIBUTION.validate_python(distribution)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        inside = ".".join(str(part) for part in first["loc"][1:])
        remedy = "such as {distribution: uniform, minimum: 1, maximum: 2}"
        raise _wrong(place, f"{inside}: {first['msg']}".lstrip(": "), remedy) from None
    if not isinstance(distribution, Mapping):
        raise _wrong(
            place,
            f"expected a distribution, got {shown(distribution)}",
            "such as {distribution: normal, mean: 1, std: 2}",
        )
    try:
        return with_values(loaded, {path: dict(distribution)})
    except InputError as error:
        raise _wrong(place, f"{path} cannot have such a distribution: {error.problem}", error.remedy) from None


def _sweep(given: Mapping[str, Any], seed: int) -> tuple[Sweep, dict[str, str]]:
    """Read a sweep; return it with the place of each parameter in what was given."""
    forms = [form for form in _FORMS if form in given]
    if not forms:
        return Sweep(grid=_columns("sweep", given), seed=seed), {name: f"sweep.{name}" for name in given}
    if others := [name for name in given if name not in _FORMS]:
        raise _wrong(f"sweep.{others[0]}", f"cannot stand beside {forms[0]}", "put it under grid, zip or sample")
    zipped = _columns("sweep.zip", given.get("zip", {}))
    lengths = {name: len(values) for name, values in zipped.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise _wrong("sweep.zip", f"the lists differ in length: {listed}", "give lists of the same length, or use grid")
    sample = _sample(given["sample"]) if "sample" in given else None
    sweep = Sweep(_columns("sweep.grid", given.get("grid", {})), zipped, sample, seed)
    ranges = sample.ranges if sample else {}
    named = {"sample.ranges": ranges, "zip": zipped, "grid": sweep.grid}
    return sweep, {name: f"sweep.{form}.{name}" for form, names in named.items() for name in names}


def _columns(place: str, given: Any) -> dict[str, list[Any]]:
    if not isinstance(given, Mapping):
        raise _wrong(
            place, f"expected a mapping, got {shown(given)}", "write `key path: [value, value]` lines under it"
        )
    for name, values in given.items():
        if not isinstance(values, list | tuple):
            raise _wrong(
                f"{place}.{name}", f"expected a list, got {shown(values)}", f"write it in brackets: [{values}]"
            )
        if not values:
            raise _wrong(f"{place}.{name}", "is empty", "give at least one value, or remove the key")
        if place != "sweep.zip" and (repeated := _repeated(values)) is not None:
            raise _wrong(f"{place}.{name}", f"{shown(repeated)} is given twice", "name each value once")
    return {name: list(values) for name, values in given.items()}


def _repeated(values: Sequence[Any]) -> Any:
    """Return the first value that is there twice; None if there is none."""
    seen = set()
    for value in values:
        if (text := json.dumps(value)) in seen:
            return value
        seen.add(text)
    return None


def _sample(given: Any) -> SampledPoints:
    place = "sweep.sample"
    keys = ("method", "points", "ranges")
    if not isinstance(given, Mapping):
        raise _wrong(place, f"expected a mapping, got {shown(given)}", f"give {', '.join(keys)}")
    for key in given:
        if key not in keys:
            raise _wrong(f"{place}.{key}", "unknown key", did_you_mean(key, keys))
    for key in keys:
        if key not in given:
            raise _wrong(place, f"has no {key}", "add it")
    method, points, ranges = given["method"], given["points"], given["ranges"]
    if method not in METHODS:
        raise _wrong(f"{place}.method", f"{shown(method)} is not known", did_you_mean(method, METHODS))
    if not isinstance(points, int) or isinstance(points, bool) or not 1 <= points <= 2**24:
        raise _wrong(f"{place}.points", f"{shown(points)} is out of range", "a whole number from 1 to 16777216")
    if method == "sobol" and points & (points - 1):
        lower = 1 << points.bit_length() - 1
        raise _wrong(f"{place}.points", f"{points} is not a power of 2, as sobol needs", f"give {lower} or {2 * lower}")
    bounds = _columns(f"{place}.ranges", ranges)
    if not bounds or len(bounds) > SOBOL_DIMENSIONS:
        raise _wrong(f"{place}.ranges", f"has {len(bounds)} parameters", f"1 to {SOBOL_DIMENSIONS}")
    for name, pair in bounds.items():
        numbers = [each for each in pair if isinstance(each, int | float) and not isinstance(each, bool)]
        if len(pair) != 2 or len(numbers) != 2 or not numbers[0] < numbers[1]:
            raise _wrong(f"{place}.ranges.{name}", f"expected a range, got {shown(pair)}", "give [smallest, greatest]")
    return SampledPoints(method, points, {name: (float(low), float(high)) for name, (low, high) in bounds.items()})


def _check_each_once(perturbed: Mapping[str, str], swept: Mapping[str, str]) -> None:
    seen: dict[str, str] = {}
    for place, path in [*((f"perturbations.{name}", path) for name, path in perturbed.items()), *swept.items()]:
        if path in seen:
            raise _wrong(place, f"varies {path}, as {seen[path]} does", "vary each key once")
        seen[path] = place


def _check_drawn(loaded: LoadedScenario, perturbed: Mapping[str, str]) -> None:
    """Check that each is drawn once per run, unlike latencies and noise, which are drawn at each use."""
    if not perturbed:
        return
    drawn = short_mission(loaded).drawn
    for name, path in perturbed.items():
        if path not in drawn:
            raise _wrong(
                f"perturbations.{name}",
                "is drawn at each use, not once per run",
                "put the distribution into the scenario itself, or sweep its parameters",
            )


def short_mission(loaded: LoadedScenario) -> MissionResult:
    """Run a mission of one second without a managing subsystem."""
    from suave_des.simulation.simulator import Simulator  # with it comes the compiler, which takes a while

    short = loaded.scenario.model_copy(update={"mission": MissionSettings(time_limit_s=1.0)})
    return Simulator(replace(loaded, scenario=short)).run("none", 1, 0)


def _check_points(loaded: LoadedScenario, variation: Variation, place: str) -> None:
    """Check that the scenario allows the points: all, or of very many those that have each value at least once."""
    sweep = variation.sweep
    points = set(range(0, sweep.points, max(1, sweep.points // _CHECKED_POINTS)))
    points.update(islice(sweep.each_value(), _CHECKED_POINTS))
    for point in sorted(points):
        try:
            variation.scenario(loaded, point)
        except InputError as error:
            raise _wrong(place, error.problem, error.remedy) from None
