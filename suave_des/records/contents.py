"""What stands in the JSON files of results, as strict models: from these every reader gets values
of their types, and numbers that are finite and not huge.

Files may be damaged, come from elsewhere, or be made by hand.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar, get_type_hints

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    InstanceOf,
    TypeAdapter,
    ValidationError,
    create_model,
    model_validator,
)

from suave_des.errors import InputError
from suave_des.files import Json, read_json
from suave_des.metrics.result import MissionMetrics
from suave_des.scenario.models import Scenario
from suave_des.scenario.yamlfile import problem_and_remedy

GREATEST = 1e12
"""Of numbers, as in scenarios."""
_Model = TypeVar("_Model", bound=BaseModel)

BoundedNumber = Annotated[float, Field(ge=-GREATEST, le=GREATEST)]
BoundedWhole = Annotated[int, Field(ge=-GREATEST, le=GREATEST)]
BoundedCount = Annotated[int, Field(ge=0, le=GREATEST)]
Cell = str | bool | BoundedWhole | BoundedNumber | None
"""Of a file of results."""
AnyText = InstanceOf[str]
"""Any text, as a name's bytes may be no UTF-8."""


class Recorded(BaseModel):
    """A part of a file; further keys in it are left out."""

    # Only texts with a limit are looked at: halves of surrogate pairs, which JSON may have, end in
    # errors of those who write or draw them.
    model_config = ConfigDict(strict=True, allow_inf_nan=False, str_max_length=10**9)


# Metrics

_BOUNDED = {float: BoundedNumber, float | None: BoundedNumber | None, int: BoundedWhole}
_METRICS: dict[str, Any] = {
    name: _BOUNDED.get(kind, kind) for name, kind in get_type_hints(MissionMetrics).items()
}
_NEEDED = (
    *("scenario", "manager", "run", "seed", "search_time_s", "pipeline_found"),
    *("detection_x_m", "detection_y_m"),
)
"""Metrics that every mission.json has."""


class _Metrics(Recorded):
    """A row of runs.csv by column: those of every mission with their types, and other cells."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Cell]


_FIELDS: dict[str, Any] = {
    name: (kind, ... if name in _NEEDED else None) for name, kind in _METRICS.items()
}
Metrics: Any = create_model("Metrics", __base__=_Metrics, **_FIELDS)
_tuple_of: Any = tuple.__class_getitem__
_OWN_CELLS: TypeAdapter[tuple[Cell, ...]] = TypeAdapter(
    _tuple_of(tuple(_METRICS.values())), config=Recorded.model_config
)
_FURTHER_CELLS: TypeAdapter[list[Cell]] = TypeAdapter(list[Cell], config=Recorded.model_config)
FAILURE: TypeAdapter[tuple[str, int, float | None, str, bool, int]] = TypeAdapter(
    tuple[str, BoundedWhole, BoundedNumber | None, str, bool, BoundedWhole],
    config=Recorded.model_config,
)
"""What a campaign keeps of a mission that failed."""
WRITTEN: TypeAdapter[dict[str, list[str]]] = TypeAdapter(
    dict[AnyText, list[str]], config=Recorded.model_config
)
"""What a campaign keeps of the files that it wrote: SHA-256 by name."""


def row_of(cells: list[object]) -> tuple[Cell, ...]:
    """Check the cells of a row of runs.csv, with what a campaign keeps besides; a ValueError if
    one has another type.
    """
    own = tuple(cells[: len(_METRICS)])
    return *_OWN_CELLS.validate_python(own), *_FURTHER_CELLS.validate_python(cells[len(own) :])


class MissionFile(Recorded):
    """mission.json."""

    metrics: Metrics
    scenario: Scenario
    inputs_sha256: dict[AnyText, str] = {}
    search_altitudes_m: dict[str, BoundedNumber] = {}
    files_sha256: dict[AnyText, str] = {}


# Knowledge


class State(Recorded):
    """A state of knowledge without its measured values; objectives by function, status and whether
    they are always improved.
    """

    objectives: list[Annotated[tuple[str, str | None, bool], Field(strict=False)]]
    groundings: dict[str, str]
    components: dict[str, str]


class Cycle(State):
    """A line of knowledge.jsonl; measured values are text, so that they stay exact."""

    t_s: BoundedNumber
    measurements: dict[str, str]
    measured_since: dict[str, str] | None = None


class ScenarioLine(Recorded):
    """The first line of knowledge_states.jsonl."""

    scenario: Json


class StateOfTable(State):
    """A state, with the names of what was measured."""

    measured: list[str]


class MissionLine(Recorded):
    """Another line of it: a mission's states, and its cycles, each with its time, the number of its
    state, and the measured values; and those with which designs were chosen, by the number of a
    cycle in which these were others.
    """

    manager: str
    point: BoundedCount
    run: BoundedCount
    swept: Json
    states: list[StateOfTable]
    cycles: list[list[str | int | BoundedNumber]]
    measured_since: dict[str, dict[str, str]] = {}

    @model_validator(mode="after")
    def _fit(self) -> Self:
        for t_s, index, *values in self.cycles:
            is_there = isinstance(index, int) and 0 <= index < len(self.states)
            if isinstance(t_s, str) or not is_there:
                raise ValueError("a cycle has no time, or none of the states")
            are_texts = all(isinstance(value, str) for value in values)
            if not are_texts or len(values) != len(self.states[int(index)].measured):
                raise ValueError("a cycle has other values than its state")
        return self


# Campaigns


class MissionCounts(Recorded):
    """How many missions a campaign has."""

    planned: BoundedCount
    failed: BoundedCount
    left_out: BoundedCount


class RecordedSweep(Recorded):
    """What a sweep varies, by name."""

    grid: dict[str, object] = {}
    zip: dict[str, object] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """All that it varies."""
        return (*self.grid, *self.zip)


class Manifest(Recorded):
    """manifest.json; all keys may be missing, as in a folder without one."""

    missions: MissionCounts | None = None
    sweep: RecordedSweep = RecordedSweep()
    perturbations: dict[str, object] = {}
    runs_per_draw: Annotated[int, Field(ge=1, le=GREATEST)] = 1
    campaign_sha256: str | None = None
    labels: dict[str, str] = {}
    command: list[AnyText] = []


# Reading


def checked(model: type[_Model], content: object, file: Path, remedy: str) -> _Model:
    """Check what was read from a JSON file, or from a line of it.

    Raises:
        InputError: a value is missing, or of another type.
    """
    try:
        return model.model_validate(content)
    except ValidationError as error:
        data = content if isinstance(content, Mapping) else {}
        keys, problem, _ = problem_and_remedy(error, data, model)
        place = ".".join(map(str, keys)) or None
        raise InputError(problem, file=file, place=place, remedy=remedy) from None


def read(model: type[_Model], file: Path, remedy: str) -> _Model:
    """Read a JSON file.

    Raises:
        InputError: it cannot be read, is no JSON, or as of checked.
    """
    return checked(model, read_json(file), file, remedy)
