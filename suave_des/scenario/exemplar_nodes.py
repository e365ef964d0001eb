"""The exemplar's configuration files (ROS 2 parameters): which key of a scenario each of their parameters is.

Source of the names: the exemplar's repository kas-lab/suave, revisions 2023 and 1.5.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from suave_des.domain import FOLLOW_PIPELINE, GENERATE_SEARCH_PATH
from suave_des.errors import InputError, KeyPath, did_you_mean, place_text
from suave_des.scenario.modes import modes_of
from suave_des.scenario.yamlfile import YamlDocument, read_yaml


@dataclass(frozen=True)
class Node:
    """A node of the exemplar.

    Attributes:
        parameters: key path of a scenario for each parameter that has one.
        shipped: the shipped scenario of the only revision that has the node under this name; None: both have it.
    """

    parameters: Mapping[str, str]
    shipped: str | None = None


_MISSION = {
    "time_limit": "mission.time_limit_s",
    "f_generate_search_path_mode": f"default_modes.{GENERATE_SEARCH_PATH}",
    "f_follow_pipeline_mode": f"default_modes.{FOLLOW_PIPELINE}",
}
_WATER_VISIBILITY = {
    "qa_publishing_period": "signals.water_visibility.publishing_period_s",
    "water_visibility_period": "signals.water_visibility.period_s",
    "water_visibility_min": "signals.water_visibility.minimum",
    "water_visibility_max": "signals.water_visibility.maximum",
    "water_visibility_sec_shift": "signals.water_visibility.shift_s",
}
_THRUSTER_MONITOR = {"thruster_events": "thruster_events"}
_TASK_BRIDGE = {
    "adapt_period": "managers.random.adaptation_period_s",
    "f_generate_search_path_mode": f"default_modes.{GENERATE_SEARCH_PATH}",
}
_BATTERY_MONITOR = {
    "discharge_time": "battery.discharge_time_s",
    "qa_publishing_period": "battery.publishing_period_s",
}
_MISSION_METRICS = {
    "water_visibility_threshold": "reaction_metric.visibility_thresholds_m",
    "water_visibiity_threshold": "reaction_metric.visibility_thresholds_m",  # as the exemplar spells it
    "expected_altitude": "reaction_metric.expected_altitudes_m",
    "battery_limit": "reaction_metric.battery_limit",
}
_RUNNER = {
    "water_visibility_sec_shift": "signals.water_visibility.shift_s",
    "initial_pos_x": "start.x_m",
    "initial_pos_y": "start.y_m",
    "thruster_events": "thruster_events",
}
RUNNER = "suave_runner_node"
"""Node of a campaign configuration; every other node is a mission's."""
NODES: Mapping[str, Node] = {
    "mission_node": Node(_MISSION),
    "parent_mission_node": Node(_MISSION),
    "water_visibility_observer_node": Node(_WATER_VISIBILITY),
    "thruster_monitor": Node(_THRUSTER_MONITOR),
    "random_reasoner_node": Node(_TASK_BRIDGE, "seams2023"),
    "task_bridge": Node(_TASK_BRIDGE, "release15"),
    "battery_monitor": Node(_BATTERY_MONITOR, "release15"),
    "mission_metrics": Node(_MISSION_METRICS, "release15"),
    RUNNER: Node(_RUNNER, "release15"),
}
NOT_NEEDED: Mapping[str, str] = {
    "result_path": "campaign --out DIR names the folder for results",
    "run_duration": "a mission ends by itself here, and no real time is waited for",
    "use_sim_time": "there is one clock here, mission time",
}
"""Parameters of any node without a counterpart, and why."""
NOT_READ: Mapping[tuple[str, str], str] = {
    ("2023", "managers.random.adaptation_period_s"): "revision 2023 reads another parameter and acts on that one's"
    " default of 15 s, which the base has; for this value, set managers.random.adaptation_period_s"
}
"""Values that the code of a revision, by its name, does not read, and what it does instead."""
_PARAMETERS = "ros__parameters"


@dataclass(frozen=True)
class Parameter:
    """A parameter in one of the user's files.

    Attributes:
        document: the file.
        entry: the node as it is written there.
        key: of the parameter.
        value: plain data.
    """

    document: YamlDocument
    entry: str
    key: str
    value: Any

    @property
    def node(self) -> str:
        """The node's name, without a slash."""
        return self.entry.removeprefix("/")

    @property
    def key_path(self) -> KeyPath:
        """Key path in its file."""
        return (self.entry, _PARAMETERS, self.key)

    @property
    def line(self) -> int:
        """Line in its file."""
        return self.document.line(self.key_path)

    @property
    def keys(self) -> str:
        """Node and key, for the user."""
        return f"{self.node}.{self.key}"

    @property
    def place(self) -> str:
        """File, line, node and key, for the user."""
        return _place(self.document, self.key_path, self.keys)

    @property
    def source(self) -> str:
        """File and line, for a comment."""
        return f"{self.document.path.name}, line {self.line}"

    def error(self, problem: str, remedy: str) -> InputError:
        """An error about it."""
        return InputError(problem, file=self.document.path, place=f"line {self.line}, {self.keys}", remedy=remedy)


@dataclass(frozen=True)
class Configuration:
    """Content of the user's files.

    Attributes:
        parameters: of known nodes, file by file.
        modes: System Modes files, each read and checked.
        nodes: known nodes in the files.
        notes: what is not understood, a line each.
    """

    parameters: tuple[Parameter, ...]
    modes: tuple[YamlDocument, ...]
    nodes: tuple[str, ...]
    notes: tuple[str, ...]


def read_configuration(files: Sequence[Path]) -> Configuration:
    """Read the exemplar's mission, campaign and System Modes files, in any order.

    Raises:
        InputError: a file cannot be read, or is none of these.
    """
    parameters: list[Parameter] = []
    modes: list[YamlDocument] = []
    nodes: list[str] = []
    notes: list[str] = []
    for document in map(read_yaml, files):
        if _is_modes(document):
            modes_of(document)
            modes.append(document)
            continue
        for entry, content in document.data.items():
            found = list(_parameters(document, entry, content, notes))
            name = entry.removeprefix("/")
            if name in NODES:
                nodes.append(name)
                parameters += found
            else:
                places = [each.place for each in found] or [_place(document, (entry,), name)]
                unknown = f"not taken over: the node is not known ({did_you_mean(name, NODES)})"
                notes += [f"{place}: {unknown}" for place in places]
    return Configuration(tuple(parameters), tuple(modes), tuple(nodes), tuple(notes))


def _place(document: YamlDocument, key_path: KeyPath, *keys: str) -> str:
    return f"{document.path}: {place_text(document.line(key_path), keys)}"


def _is_modes(document: YamlDocument) -> bool:
    """Whether a file is one of System Modes: each of its entries has a type."""
    entries = [entry.get(_PARAMETERS) for entry in document.data.values() if isinstance(entry, dict)]
    return any(isinstance(entry, dict) and entry.get("type") in ("system", "node") for entry in entries)


def _parameters(document: YamlDocument, entry: str, content: Any, notes: list[str]) -> Iterator[Parameter]:
    if not isinstance(content, dict) or _PARAMETERS not in content:
        raise document.error(
            f"{entry} has no {_PARAMETERS}",
            (entry,),
            f"a configuration of the exemplar has NODE: {{{_PARAMETERS}: {{KEY: VALUE}}}}",
        )
    for other in content:
        if other != _PARAMETERS:
            place = _place(document, (entry, other), entry.removeprefix("/"), other)
            notes.append(f"{place}: not taken over: it is beside {_PARAMETERS}, where ROS 2 does not read it")
    parameters = content[_PARAMETERS]
    if parameters is None:
        return
    if not isinstance(parameters, dict):
        raise document.error(
            f"{_PARAMETERS} of {entry} is not a mapping of keys to values",
            (entry, _PARAMETERS),
            "write `key: value` lines under it",
        )
    yield from (Parameter(document, entry, str(key), value) for key, value in parameters.items())


def no_counterpart(parameter: Parameter, known: Iterable[str]) -> str:
    """The note about a parameter that a scenario or campaign has no use for; `known` are those that have one."""
    if (reason := NOT_NEEDED.get(parameter.key)) is not None:
        return f"{parameter.place}: no counterpart: {reason}"
    return f"{parameter.place}: not taken over: unknown key ({did_you_mean(parameter.key, known)})"
