"""The System Modes file: the modes of each function, and the parameters that they set on its
lifecycle node.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainValidator, model_validator

from suave_des.domain import (
    DEFAULT_MODE,
    GENERATE_SEARCH_PATH,
    SEA_BED_Z_M,
    SURFACE_Z_M,
    UNGROUND_MODE,
)
from suave_des.errors import InputError, KeyPath, did_you_mean, shown, similar
from suave_des.scenario.models import Real, Scenario, Strict, wrong
from suave_des.scenario.yamlfile import Layer, validated

ParameterValue = float | str | bool
_NodeModes = Mapping[str, dict[str, ParameterValue]]
"""Parameters of each mode of a node."""
_STATES = "inactive, active or active.NODE_MODE"


def grounding_modes(modes: Iterable[str]) -> tuple[str, ...]:
    """Return those of a function's modes that ground it by a design: all but fd_unground and
    __DEFAULT__.
    """
    return tuple(mode for mode in modes if mode not in (UNGROUND_MODE, DEFAULT_MODE))


@dataclass(frozen=True)
class Mode:
    """One mode of a function.

    Attributes:
        parameters: what it sets on the function's node, such as spiral_altitude in m; empty when
            that is inactive.
    """

    name: str
    active: bool
    parameters: Mapping[str, ParameterValue]


@dataclass(frozen=True)
class ModeTable:
    """All functions of a System Modes file with their modes, in the order of the file."""

    source: str
    table: Mapping[str, Mapping[str, Mode]]

    @property
    def functions(self) -> tuple[str, ...]:
        """Names of the functions."""
        return tuple(self.table)

    def __contains__(self, function: str) -> bool:
        """Whether there is a function of this name."""
        return function in self.table

    @property
    def search_altitudes_m(self) -> dict[str, float]:
        """Altitude above the sea bed of each search mode that has one."""
        modes = self.table.get(GENERATE_SEARCH_PATH, {}).values()
        key = "spiral_altitude"
        return {each.name: float(each.parameters[key]) for each in modes if key in each.parameters}

    def get(self, function: str, mode: str) -> Mode | None:
        """Return one mode of a function; None if there is no such function, or it has no such
        mode.
        """
        return self.table.get(function, {}).get(mode)

    def modes(self, function: str) -> tuple[str, ...]:
        """Return the names of a function's modes, with __DEFAULT__; an InputError if there is no
        such function.
        """
        if function not in self.table:
            remedy = did_you_mean(function, self.table, f"functions in {self.source}")
            raise InputError(
                f"there is no function {shown(function)}", file=self.source, remedy=remedy
            )
        return tuple(self.table[function])

    def mode(self, function: str, mode: str) -> Mode:
        """Return one mode of a function; an InputError if there is no such function, or it has no
        such mode.
        """
        known = self.modes(function)
        if mode not in known:
            remedy = did_you_mean(mode, known, f"its modes in {self.source}")
            raise InputError(
                f"function {function} has no mode {shown(mode)}", file=self.source, remedy=remedy
            )
        return self.table[function][mode]

    def check(self, scenario: Scenario, layer: Layer) -> None:
        """Raise an InputError, with its line in the scenario (layer), if a mission uses a mode that
        is not there.
        """
        for function in scenario.needed_functions():
            if UNGROUND_MODE not in self.modes(function):
                remedy = f"add {UNGROUND_MODE}: {{NODE: inactive}}, which a cancelled task sets"
                raise InputError(
                    f"function {function} has no mode {UNGROUND_MODE}",
                    file=self.source,
                    remedy=remedy,
                )
        used: list[tuple[KeyPath, str, str]] = [
            *((("functions", function), function, DEFAULT_MODE) for function in scenario.functions),
            *(
                (("default_modes", function), function, mode)
                for function, mode in scenario.default_modes.items()
            ),
        ]
        for index, mode in enumerate(scenario.managers.bt.search_modes):
            # The default names the shipped modes, which another modes file need not have: it
            # matters only to bt.
            if (path := ("managers", "bt", "search_modes", index)) in layer.places:
                used.append((path, GENERATE_SEARCH_PATH, mode))
        for key_path, function, mode in used:
            try:
                self.mode(function, mode)
            except InputError as error:
                raise layer.error(error.problem, key_path, error.remedy) from None


# The file.


def _value(value: object) -> ParameterValue:
    if isinstance(value, bool | str):
        return value
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise wrong(
            f"{shown(value)} is not a value", "a finite number, text, true or false is needed"
        )
    return float(value)


class _Parameters(BaseModel):
    """Parameters of a node's mode; those that the managed subsystem computes with have a type."""

    model_config = ConfigDict(extra="allow", allow_inf_nan=False)
    __pydantic_extra__: dict[str, Annotated[ParameterValue, PlainValidator(_value)]]

    spiral_altitude: Annotated[Real, Field(gt=0, le=SURFACE_Z_M - SEA_BED_Z_M)] | None = None

    @model_validator(mode="after")
    def _misspelt(self) -> Self:
        known = type(self).model_fields.keys() - self.model_fields_set
        for name in self.model_extra or {}:
            if near := similar(name, known, cutoff=0.85):
                raise wrong(f"nothing reads {shown(name)}", f"did you mean {near}?")
        return self


class _NodeMode(Strict):
    ros__parameters: _Parameters | None


class _Node(Strict):
    type: Literal["node"]
    modes: Annotated[dict[str, _NodeMode], Field(min_length=1)] | None = None

    def parameters(self) -> _NodeModes:
        """Parameters of each mode; each has those of __DEFAULT__ that it does not set itself."""
        own = {
            name: {}
            if mode.ros__parameters is None
            else mode.ros__parameters.model_dump(exclude_unset=True)
            for name, mode in (self.modes or {}).items()
        }
        return {
            name: {**own.get(DEFAULT_MODE, {}), **parameters} for name, parameters in own.items()
        }


def _split(value: object) -> object:
    # The exemplar writes several parts on lines without dashes, which YAML reads as one text with
    # spaces.
    return value.split() if isinstance(value, str) else value


class _System(Strict):
    type: Literal["system"]
    parts: Annotated[tuple[str, ...], BeforeValidator(_split), Field(min_length=1)]
    modes: Annotated[dict[str, dict[str, object]], Field(min_length=1)]


class _FunctionEntry(Strict):
    ros__parameters: Annotated[_System | _Node, Field(discriminator="type")]


def modes_of(document: Layer) -> ModeTable:
    """Make the table of a System Modes YAML file.

    A function is an entry `type: system` whose parts are nodes; a system of systems only groups
    functions and is ignored. A function without a mode __DEFAULT__ gets one that is inactive, as
    its node is at first.

    Raises:
        InputError: with file and line: an entry or mode of another form, an unknown part,
            an undefined mode of a node, missing ros__parameters, a parameter of the wrong kind.
    """
    keys = _bare_names(document)
    content = validated(document, dict[str, _FunctionEntry])
    entries = {name: content[key].ros__parameters for name, key in keys.items()}
    nodes = {
        name: entry.parameters() for name, entry in entries.items() if isinstance(entry, _Node)
    }
    functions: dict[str, Mapping[str, Mode]] = {}
    for name, entry in entries.items():
        if isinstance(entry, _System):
            functions |= _function(document, name, keys, entry, nodes)
    if not functions:
        raise document.error(
            "defines no function", (), "a function is an entry with type: system, parts and modes"
        )
    return ModeTable(str(document.path), functions)


def _bare_names(document: Layer) -> dict[str, str]:
    """The entries' keys, by their names without a leading slash."""
    keys: dict[str, str] = {}
    for key in document.data:
        name = key.removeprefix("/")
        if name in keys:
            raise document.error(
                f"{name} appears twice, once with a leading slash", (key,), "keep one entry"
            )
        keys[name] = key
    return keys


def _function(
    document: Layer,
    name: str,
    keys: Mapping[str, str],
    system: _System,
    nodes: Mapping[str, _NodeModes],
) -> dict[str, Mapping[str, Mode]]:
    """The modes of a system by its name, if its parts are nodes."""
    path: KeyPath = (keys[name], "ros__parameters")
    parts = [part.removeprefix("/") for part in system.parts]
    for part in parts:
        if part not in keys:
            remedy = did_you_mean(part, keys, "defined")
            raise document.error(f"unknown part {shown(part)} of {name}", (*path, "parts"), remedy)
    if not all(part in nodes for part in parts):
        return {}
    known = {part: nodes[part] for part in parts}
    modes = {
        mode: _mode(document, (*path, "modes", mode), states, known)
        for mode, states in system.modes.items()
    }
    return {name: {DEFAULT_MODE: Mode(DEFAULT_MODE, False, {}), **modes}}


def _mode(
    document: Layer, path: KeyPath, states: Mapping[str, object], nodes: Mapping[str, _NodeModes]
) -> Mode:
    """A mode of a function: the parameters that it sets on each of the function's nodes that are
    active in it.
    """
    keys = {key.removeprefix("/"): key for key in states}
    for part, key in keys.items():
        if part not in nodes:
            raise document.error(
                f"{shown(part)} is not a part", (*path, key), did_you_mean(part, nodes, "its parts")
            )
    active = False
    parameters = dict[str, ParameterValue]()
    for node, modes in nodes.items():
        if node not in keys:
            raise document.error(f"does not set {node}", path, f"add {node}: {_STATES}")
        below = (*path, keys[node])
        state = states[keys[node]]
        if state == "inactive":
            continue
        kind, _, node_mode = str(state).partition(".")
        if kind != "active":
            raise document.error(
                f"{shown(state)} is not a state of a node", below, f"write {_STATES}"
            )
        node_mode = node_mode or DEFAULT_MODE
        if node_mode not in (*modes, DEFAULT_MODE):
            remedy = did_you_mean(node_mode, modes, "its modes")
            raise document.error(f"{node} has no mode {shown(node_mode)}", below, remedy)
        active = True
        parameters |= modes.get(node_mode, {})
    return Mode(str(path[-1]), active, parameters)
