"""Read the file that names the free parameters of a calibration, their bounds, and the form of distributions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from suave_des.calibration.loss import FreeParameter
from suave_des.errors import InputError, shown
from suave_des.scenario.layers import Layer
from suave_des.scenario.loader import LoadedScenario, value_at, with_values
from suave_des.scenario.problems import validated
from suave_des.scenario.quantities import Number, Strict, ordered
from suave_des.scenario.yamlfile import read_yaml


class FreeEntry(Strict):
    """One free parameter."""

    path: str
    """Key path in the scenario, such as calibration.altitude_error_m.mean."""
    lower: Number
    """Least value."""
    upper: Number
    """Greatest value."""
    start: Number | None = None
    """The value that the search starts from; left out: the scenario's."""

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        ordered(self.lower, self.upper)
        return self


class CalibrationFile(Strict):
    """The parameters that a calibration fits."""

    form: dict[str, Any] = Field(default_factory=dict)
    """Values put into the scenario before anything is fitted, by key path: the form of distributions, say."""
    free: Annotated[tuple[FreeEntry, ...], Field(min_length=1)]
    """The parameters."""


def read_parameters(path: Path, loaded: LoadedScenario) -> tuple[LoadedScenario, tuple[FreeParameter, ...]]:
    """Read a calibration file, and put its form into a scenario.

    Returns:
        The scenario to fit, and its free parameters.

    Raises:
        InputError: the file, or a path or value in it, cannot be used.
    """
    layer = Layer.of(read_yaml(path), 0)
    content = validated(layer, CalibrationFile)
    scenario = with_values(loaded, content.form)
    parameters = tuple(_parameter(layer, index, entry, scenario) for index, entry in enumerate(content.free))
    return scenario, parameters


def _parameter(layer: Layer, index: int, entry: FreeEntry, loaded: LoadedScenario) -> FreeParameter:
    place = ("free", index, "path")
    try:
        present = value_at(loaded, entry.path)
    except InputError as error:
        raise layer.error(error.problem, place, error.remedy) from None
    if not isinstance(present, int | float) or isinstance(present, bool):
        problem = f"{entry.path}: expected a number in this scenario, got {shown(present)}"
        raise layer.error(problem, place, "give it a form, or another path")
    start = float(present) if entry.start is None else entry.start
    if not entry.lower <= start <= entry.upper:
        raise layer.error(
            f"{entry.path} starts at {start:g}, outside [{entry.lower:g}, {entry.upper:g}]",
            ("free", index, "lower"),
            "widen the bounds, or give a start within them",
        )
    return FreeParameter(entry.path, entry.lower, entry.upper, start)
