"""Read the file that names the free parameters of a calibration, their bounds, and the form of distributions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from suave_des.calibration.cases import Case
from suave_des.calibration.loss import FreeParameter, Problem
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.scenario.loader import LoadedScenario, value_at, with_values
from suave_des.scenario.problems import validated
from suave_des.scenario.quantities import Number, Strict, ordered
from suave_des.scenario.yamlfile import Layer, read_yaml


class FreeEntry(Strict):
    """One free parameter."""

    path: str
    """Key path in the scenario, such as calibration.altitude_error_m.mean."""
    lower: Number
    """Least value."""
    upper: Number
    """Greatest value."""
    start: Number | None = None
    """The value that the search starts from; left out: the scenario's, or the mean of the scenarios'."""
    scenarios: tuple[str, ...] | None = None
    """Names of the scenarios that have it as their own; left out: one value for all that are fitted."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        ordered(self.lower, self.upper, "lower", "upper")
        return self


class CalibrationFile(Strict):
    """The parameters that a calibration fits."""

    form: dict[str, Any] = Field(default_factory=dict)
    """Values put into the scenario before anything is fitted, by key path: the form of distributions, say."""
    free: Annotated[tuple[FreeEntry, ...], Field(min_length=1)]
    """The parameters."""


def read_parameters(
    path: Path, scenarios: Mapping[str, LoadedScenario]
) -> tuple[dict[str, LoadedScenario], tuple[FreeParameter, ...]]:
    """Read a calibration file, and put its form into scenarios.

    Args:
        path: of the file.
        scenarios: to fit, by the names that the file's entries call them by.

    Returns:
        The scenarios to fit, and the free parameters.

    Raises:
        InputError: the file, or a path or value in it, cannot be used.
    """
    layer = read_yaml(path)
    content = validated(layer, CalibrationFile)
    formed = {name: _formed(layer, content.form, loaded) for name, loaded in scenarios.items()}
    parameters = tuple(_parameter(layer, index, entry, formed) for index, entry in enumerate(content.free))
    _check_each_once(layer, content, tuple(scenarios))
    return formed, parameters


def read_problem(path: Path, cases: Sequence[Case], runs: int, seed: int) -> Problem:
    """Read a calibration file for cases.

    Args:
        path: of the file.
        cases: the scenarios to fit with their real missions.
        runs: simulated missions for each manager, as of Problem.
        seed: of the simulated missions.

    Raises:
        InputError: as read_parameters, or a parameter is what a campaign file sweeps.
    """
    formed, parameters = read_parameters(path, {case.name: case.loaded for case in cases})
    for case in cases:
        swept = [name for values in case.conditions.values() for name in values]
        for each in parameters:
            if each.is_of(case) and each.path in swept:
                problem = f"{each.path} is free, but the conditions of {case.name} set it"
                raise InputError(problem, file=path, remedy="remove it here, or from the campaign's sweep")
    return Problem(tuple(replace(case, loaded=formed[case.name]) for case in cases), parameters, runs, seed)


def _parameter(layer: Layer, index: int, entry: FreeEntry, scenarios: Mapping[str, LoadedScenario]) -> FreeParameter:
    if entry.scenarios == ():
        remedy = f"name some of {', '.join(scenarios)}, or leave scenarios out for all"
        raise layer.error(f"{entry.path} belongs to no scenario", ("free", index, "scenarios"), remedy)
    for place, name in enumerate(entry.scenarios or ()):
        if name not in scenarios:
            problem = f"{entry.path} belongs to scenario {shown(name)}, which is not fitted"
            remedy = did_you_mean(name, scenarios, "fitted are")
            raise layer.error(problem, ("free", index, "scenarios", place), remedy)
    names = tuple(scenarios) if entry.scenarios is None else entry.scenarios
    present = [_present(layer, index, entry.path, name, scenarios) for name in names]
    start = fmean(present) if entry.start is None else entry.start
    if not entry.lower <= start <= entry.upper:
        raise layer.error(
            f"{entry.path} starts at {start:g}, outside [{entry.lower:g}, {entry.upper:g}]",
            ("free", index, "lower"),
            "widen the bounds, or give a start within them",
        )
    for name in names:
        _check_bounds(layer, index, entry, scenarios[name])
    is_of_all = set(names) == set(scenarios)
    return FreeParameter(entry.path, entry.lower, entry.upper, start, () if is_of_all else names)


def _present(layer: Layer, index: int, path: str, name: str, scenarios: Mapping[str, LoadedScenario]) -> float:
    """Return the value of a parameter in a scenario."""
    place = ("free", index, "path")
    others = ", ".join(other for other in scenarios if other != name)
    which, hint = (f"scenario {name}", f"; or, if it is not of {name}, scenarios: [{others}]") if others else ("", "")
    try:
        present = value_at(scenarios[name], path)
    except InputError as error:
        raise layer.error(f"{which}: {error.problem}".lstrip(": "), place, f"{error.remedy}{hint}") from None
    if not isinstance(present, int | float) or isinstance(present, bool):
        problem = f"{path}: expected a number in {which or 'this scenario'}, got {shown(present)}"
        raise layer.error(problem, place, f"give it a form, or another path{hint}")
    return float(present)


def _formed(layer: Layer, form: Mapping[str, Any], loaded: LoadedScenario) -> LoadedScenario:
    try:
        return with_values(loaded, form)
    except InputError as error:
        path = next((path for path in form if path in f"{error.place} {error.problem}"), None)
        raise layer.error(error.problem, ("form",) if path is None else ("form", path), error.remedy) from None


def _check_bounds(layer: Layer, index: int, entry: FreeEntry, loaded: LoadedScenario) -> None:
    for bound in ("lower", "upper"):
        try:
            with_values(loaded, {entry.path: getattr(entry, bound)})
        except InputError as error:
            raise layer.error(f"{entry.path}: {error.problem}", ("free", index, bound), error.remedy) from None


def _check_each_once(layer: Layer, content: CalibrationFile, scenarios: tuple[str, ...]) -> None:
    seen = set()
    for index, entry in enumerate(content.free):
        for name in scenarios if entry.scenarios is None else entry.scenarios:
            if (name, entry.path) in seen:
                problem = f"{entry.path} is free twice in scenario {name}"
                raise layer.error(problem, ("free", index, "path"), "name each once, or the scenarios of each entry")
            seen.add((name, entry.path))
