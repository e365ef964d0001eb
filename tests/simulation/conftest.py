from collections.abc import Callable
from dataclasses import replace
from functools import cache

import pytest

from suave_des.scenario.loader import load_scenario
from suave_des.scenario.models import Scenario
from suave_des.simulation.simulator import Simulator

MakeSimulator = Callable[..., Simulator]


@cache
def _shipped(name: str) -> Simulator:
    return Simulator(load_scenario(name))


def _changed(data: dict, changes: dict) -> dict:
    merged = dict(data)
    for key, value in changes.items():
        both = (
            isinstance(value, dict)
            and isinstance(merged.get(key), dict)
            and "distribution" not in value
        )
        merged[key] = _changed(merged[key], value) if both else value
    return merged


@pytest.fixture(scope="session")
def simulator() -> MakeSimulator:
    """The simulator of a shipped scenario, with changes as a YAML file would give them."""

    def make(name: str = "seams2023", **changes: object) -> Simulator:
        if not changes:
            return _shipped(name)
        loaded = load_scenario(name)
        data = _changed(loaded.scenario.model_dump(mode="python"), changes)
        return Simulator(replace(loaded, scenario=Scenario.model_validate(data)))

    return make
