"""The System Modes file: which modes each function has, and what each of them sets on its lifecycle node."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from suave_des.errors import InputError, KeyPath, did_you_mean, shown
from suave_des.scenario.quantities import FARTHEST_M
from suave_des.scenario.yamlfile import YamlDocument, read_yaml

DEFAULT_MODE = "__DEFAULT__"
UNGROUND_MODE = "fd_unground"

_STATES = "inactive, active or active.NODE_MODE"
_POSITIVE_NUMBERS = ("spiral_altitude",)
"""Parameters that the managed subsystem computes with: metres, greater than 0."""


@dataclass(frozen=True)
class Mode:
    """One mode of a function.

    Attributes:
        name: of the mode.
        active: whether the function's lifecycle node is active in it.
        parameters: what it sets on the node, such as spiral_altitude in m; empty when inactive.
    """

    name: str
    active: bool
    parameters: Mapping[str, float | str | bool]


@dataclass(frozen=True)
class ModeTable:
    """All functions of a System Modes file with their modes, in the order of the file."""

    source: str
    table: Mapping[str, Mapping[str, Mode]]

    @property
    def functions(self) -> tuple[str, ...]:
        """Names of the functions."""
        return tuple(self.table)

    def modes(self, function: str) -> tuple[str, ...]:
        """Names of a function's modes, __DEFAULT__ among them.

        Raises:
            InputError: there is no such function.
        """
        return tuple(self._function(function))

    def mode(self, function: str, mode: str) -> Mode:
        """One mode of a function.

        Raises:
            InputError: there is no such function, or it has no such mode.
        """
        modes = self._function(function)
        if mode not in modes:
            raise InputError(
                f"function {function} has no mode {shown(mode)}",
                file=self.source,
                remedy=did_you_mean(mode, modes, "its modes"),
            )
        return modes[mode]

    def _function(self, function: str) -> Mapping[str, Mode]:
        if function not in self.table:
            raise InputError(
                f"there is no function {shown(function)}",
                file=self.source,
                remedy=did_you_mean(function, self.table, "its functions"),
            )
        return self.table[function]


def read_modes(path: Path | str) -> ModeTable:
    """Read a System Modes YAML file.

    A function is an entry `type: system` whose parts are nodes; a system of systems only groups functions and
    is passed over. A function without a mode __DEFAULT__ gets one that is inactive, as its node is at first.

    Raises:
        InputError: with file and line: what cannot be read, an entry or mode of another form, an unknown part,
            an undefined mode of a node, missing ros__parameters, a parameter of the wrong kind.
    """
    return modes_of(read_yaml(path))


def modes_of(document: YamlDocument) -> ModeTable:
    """The table of a System Modes file already read; raises as read_modes does."""
    return _ModesFile(document).table()


class _ModesFile:
    """A System Modes file under examination."""

    def __init__(self, document: YamlDocument) -> None:
        self.document = document
        self.keys: dict[str, str] = {}
        for key in document.data:
            name = key.removeprefix("/")
            if name in self.keys:
                raise document.error(f"{name} stands twice, once with a leading slash", (key,), "keep one entry")
            self.keys[name] = key
        self.entries = {name: self._entry(key) for name, key in self.keys.items()}

    def table(self) -> ModeTable:
        """Every function with its modes."""
        systems = [name for name, entry in self.entries.items() if entry["type"] == "system"]
        nodes = {name: self._node_modes(name) for name, entry in self.entries.items() if entry["type"] == "node"}
        functions: dict[str, Mapping[str, Mode]] = {}
        for name in systems:
            parts = self._parts(name)
            if not any(part in systems for part in parts):
                functions[name] = self._function(name, parts, nodes)
        if not functions:
            raise self.document.error(
                "defines no function", (), "a function is an entry with type: system, parts and modes"
            )
        return ModeTable(str(self.document.path), functions)

    def _path(self, name: str, *keys: str) -> KeyPath:
        return (self.keys[name], "ros__parameters", *keys)

    def _entry(self, key: str) -> dict[str, Any]:
        entry = self.document.data[key]
        if not isinstance(entry, dict) or "ros__parameters" not in entry:
            raise self.document.error(
                f"{key} has no ros__parameters", (key,), "write ros__parameters: under it, then type"
            )
        if extra := [other for other in entry if other != "ros__parameters"]:
            raise self.document.error(
                f"unknown key {shown(extra[0])}",
                (key, extra[0]),
                "only ros__parameters stands here; move it under that",
            )
        parameters = entry["ros__parameters"]
        path = (key, "ros__parameters")
        if not isinstance(parameters, dict) or parameters.get("type") not in ("system", "node"):
            kind = parameters.get("type") if isinstance(parameters, dict) else None
            raise self.document.error(
                f"{key} is of type {shown(kind)}",
                (*path, "type"),
                "type: system for a function, type: node for its node",
            )
        known = ("type", "parts", "modes") if parameters["type"] == "system" else ("type", "modes")
        for other in parameters:
            if other not in known:
                raise self.document.error(f"unknown key {shown(other)}", (*path, other), did_you_mean(other, known))
        return parameters

    def _parts(self, name: str) -> list[str]:
        value = self.entries[name].get("parts")
        path = self._path(name, "parts")
        # Several parts stand on several lines without dashes, which YAML reads as one text with spaces.
        parts = value.split() if isinstance(value, str) else value
        if not isinstance(parts, list) or not parts or not all(isinstance(part, str) for part in parts):
            raise self.document.error(f"{name} has no parts", path, "name its lifecycle node: parts: NODE")
        parts = [part.removeprefix("/") for part in parts]
        for part in parts:
            if part not in self.entries:
                raise self.document.error(
                    f"unknown part {shown(part)} of {name}", path, did_you_mean(part, self.entries, "defined")
                )
        return parts

    def _modes(self, name: str) -> dict[str, Any]:
        modes = self.entries[name].get("modes")
        if not isinstance(modes, dict) or not modes:
            raise self.document.error(
                f"{name} has no modes", self._path(name, "modes"), "modes: needs a mapping of modes"
            )
        return modes

    def _node_modes(self, node: str) -> dict[str, dict[str, float | str | bool]]:
        """Parameters of each mode of a node; each has those of __DEFAULT__ that it does not set itself."""
        own: dict[str, dict[str, float | str | bool]] = {}
        modes = self.entries[node].get("modes")
        for mode in self._modes(node) if modes is not None else ():
            path = self._path(node, "modes", mode)
            content = self._modes(node)[mode]
            if not isinstance(content, dict) or "ros__parameters" not in content or len(content) > 1:
                raise self.document.error(
                    f"mode {mode} of {node} has no ros__parameters, or something beside them",
                    path,
                    f"write {mode}: {{ros__parameters: {{NAME: VALUE}}}}",
                )
            parameters = content["ros__parameters"]
            if parameters is not None and not isinstance(parameters, dict):
                raise self.document.error(
                    f"ros__parameters is {shown(parameters)}",
                    (*path, "ros__parameters"),
                    "a mapping of parameters is needed",
                )
            own[mode] = {
                key: self._parameter(key, value, (*path, "ros__parameters", key))
                for key, value in (parameters or {}).items()
            }
        default = own.get(DEFAULT_MODE, {})
        return {mode: {**default, **parameters} for mode, parameters in own.items()}

    def _parameter(self, key: str, value: Any, path: KeyPath) -> float | str | bool:
        if key in _POSITIVE_NUMBERS and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise self.document.error(f"{shown(value)} is no number", path, f"{key} is a length in m, such as 2.0")
        if key in _POSITIVE_NUMBERS and value <= 0:
            raise self.document.error(f"{shown(value)} is not above 0", path, f"{key} is a length in m, such as 2.0")
        if key in _POSITIVE_NUMBERS and FARTHEST_M < value < math.inf:
            raise self.document.error(f"{shown(value)} is out of range", path, f"{key} is at most {FARTHEST_M:g} m")
        if isinstance(value, float) and not math.isfinite(value):
            raise self.document.error(f"{shown(value)} is not finite", path, "give a finite number")
        if not isinstance(value, bool | int | float | str):
            raise self.document.error(f"{shown(value)} is no value", path, "a number, text, true or false is needed")
        return value if isinstance(value, bool | str) else float(value)

    def _function(
        self, name: str, parts: list[str], nodes: Mapping[str, Mapping[str, Mapping[str, float | str | bool]]]
    ) -> dict[str, Mode]:
        modes = {mode: self._mode(name, mode, content, parts, nodes) for mode, content in self._modes(name).items()}
        return modes if DEFAULT_MODE in modes else {DEFAULT_MODE: Mode(DEFAULT_MODE, False, {}), **modes}

    def _mode(
        self,
        name: str,
        mode: str,
        content: Any,
        parts: list[str],
        nodes: Mapping[str, Mapping[str, Mapping[str, float | str | bool]]],
    ) -> Mode:
        path = self._path(name, "modes", mode)
        if not isinstance(content, dict):
            raise self.document.error(
                f"mode {mode} of {name} is {shown(content)}", path, f"write {parts[0]}: {_STATES}"
            )
        states = {key.removeprefix("/"): (key, state) for key, state in content.items()}
        for part in states:
            if part not in parts:
                raise self.document.error(
                    f"mode {mode} speaks of {shown(part)}, which is no part of {name}",
                    (*path, states[part][0]),
                    did_you_mean(part, parts, "its parts"),
                )
        active, parameters = False, dict[str, float | str | bool]()
        for part in parts:
            if part not in states:
                raise self.document.error(
                    f"mode {mode} of {name} says nothing of {part}", path, f"add {part}: {_STATES}"
                )
            key, state = states[part]
            node_mode = self._node_mode(state, nodes[part], part, (*path, key))
            if node_mode is not None:
                active = True
                parameters |= nodes[part].get(node_mode, {})
        return Mode(mode, active, parameters)

    def _node_mode(self, state: Any, modes: Mapping[str, object], node: str, path: KeyPath) -> str | None:
        """The node's mode that a state names; None when inactive, __DEFAULT__ for plain `active`."""
        if state == "inactive":
            return None
        if state == "active":
            return DEFAULT_MODE
        if not isinstance(state, str) or not state.startswith("active."):
            raise self.document.error(f"{shown(state)} is no state of a node", path, f"write {_STATES}")
        mode = state.removeprefix("active.")
        if mode not in modes and mode != DEFAULT_MODE:
            raise self.document.error(f"{node} has no mode {shown(mode)}", path, did_you_mean(mode, modes, "its modes"))
        return mode
