"""Scenarios with some values replaced, by key path: what sweeps, calibration and sensitivity studies vary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from typing import Any

from pydantic import ValidationError

from suave_des.errors import InputError
from suave_des.scenario.layers import Layer, Place
from suave_des.scenario.loader import LoadedScenario, check_modes
from suave_des.scenario.models import Scenario
from suave_des.scenario.problems import input_error


def with_values(loaded: LoadedScenario, values: Mapping[str, Any]) -> LoadedScenario:
    """A scenario in which the values at some key paths are others.

    Args:
        loaded: the scenario to start from; it is left as it is.
        values: new values by key path, such as "signals.water_visibility.period_s" or "thruster_events.0.time_s"; the
            path of a distribution's own parameter ("calibration.altitude_error_m.mean") works where the scenario has
            one, and a whole distribution (a mapping) may stand for a number.

    Raises:
        InputError: a path leads nowhere, or a value is not allowed there or names another file.
    """
    data = loaded.scenario.model_dump(mode="json")
    for path, value in values.items():
        _set(data, path, value)
    layer = Layer(data, {(): Place(0, 1, loaded.path)})
    try:
        scenario = Scenario.model_validate(data)
    except ValidationError as error:
        raise input_error(error, layer, Scenario) from None
    if _named_files(scenario) != _named_files(loaded.scenario):
        remedy = "write a scenario for each, with `base` and the files that differ"
        raise InputError("files were read with the scenario and stay as they are", remedy=remedy)
    check_modes(layer, scenario, loaded.modes)
    return replace(loaded, scenario=scenario)


def _named_files(scenario: Scenario) -> tuple[object, ...]:
    tables = tuple((name, getattr(signal, "file", None)) for name, signal in sorted(scenario.signals.items()))
    return scenario.knowledge.ontologies, scenario.knowledge.rules, scenario.modes_file, tables


def value_at(loaded: LoadedScenario, path: str) -> Any:
    """The value at a key path, as plain data.

    Raises:
        InputError: the path leads nowhere.
    """
    here: Any = loaded.scenario.model_dump(mode="json")
    for part in path.split("."):
        if not isinstance(here, dict | list):
            raise InputError(f"{path}: {part} is below a plain value", remedy="leave the rest out")
        here = _step(here, part, path)
    return here


def _set(data: dict[str, Any], path: str, value: Any) -> None:
    *parents, last = path.split(".")
    here: Any = data
    for depth, part in enumerate(parents):
        here = _step(here, part, ".".join(parents[: depth + 1]))
        if not isinstance(here, dict | list):
            raise InputError(f"{path}: {'.'.join(parents[: depth + 1])} is a plain value", remedy="leave the rest out")
    _step(here, last, path)
    here[_key(here, last)] = value


def _step(here: Any, part: str, path: str) -> Any:
    key = _key(here, part)
    if isinstance(here, list):
        if isinstance(key, int) and 0 <= key < len(here):
            return here[key]
        raise InputError(f"{path}: there is no entry {part}", remedy=f"entries are 0 to {len(here) - 1}")
    if key not in here:
        close = get_close_matches(part, [str(each) for each in here], n=1)
        known = ", ".join(sorted(str(each) for each in here))
        raise InputError(f"{path}: unknown key", remedy=f"did you mean {close[0]}?" if close else f"known: {known}")
    return here[key]


def _key(here: Any, part: str) -> str | int:
    return int(part) if isinstance(here, list) and part.isdigit() else part
