"""The exemplar's configuration files (ROS 2 parameters): which of their keys say what a scenario says.

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

RUNNER = "suave_runner_node"
"""Node of a campaign configuration; every other node is a mission's."""
_PARAMETERS = "ros__parameters"
_SIGNAL = ("signals", "water_visibility")

COUNTERPARTS: Mapping[str, Mapping[str, KeyPath]] = {
    "mission_node": {
        "time_limit": ("mission", "time_limit_s"),
        "f_generate_search_path_mode": ("default_modes", GENERATE_SEARCH_PATH),
        "f_follow_pipeline_mode": ("default_modes", FOLLOW_PIPELINE),
    },
    "water_visibility_observer_node": {
        "qa_publishing_period": (*_SIGNAL, "publishing_period_s"),
        "water_visibility_period": (*_SIGNAL, "period_s"),
        "water_visibility_min": (*_SIGNAL, "minimum"),
        "water_visibility_max": (*_SIGNAL, "maximum"),
        "water_visibility_sec_shift": (*_SIGNAL, "shift_s"),
    },
    "thruster_monitor": {"thruster_events": ("thruster_events",)},
    "task_bridge": {
        "adapt_period": ("managers", "random", "adaptation_period_s"),
        "f_generate_search_path_mode": ("default_modes", GENERATE_SEARCH_PATH),
    },
    "battery_monitor": {
        "discharge_time": ("battery", "discharge_time_s"),
        "qa_publishing_period": ("battery", "publishing_period_s"),
    },
    "mission_metrics": {
        "water_visibility_threshold": ("reaction_metric", "visibility_thresholds_m"),
        "expected_altitude": ("reaction_metric", "expected_altitudes_m"),
        "battery_limit": ("reaction_metric", "battery_limit"),
    },
    RUNNER: {
        "water_visibility_sec_shift": (*_SIGNAL, "shift_s"),
        "thruster_events": ("thruster_events",),
        "initial_pos_x": ("start", "x_m"),
        "initial_pos_y": ("start", "y_m"),
    },
}
"""Key path of a scenario for each key of a node that has one."""
NODE_SPELLINGS = {"parent_mission_node": "mission_node", "random_reasoner_node": "task_bridge"}
KEY_SPELLINGS = {"water_visibiity_threshold": "water_visibility_threshold"}

NOT_NEEDED: Mapping[str, str] = {
    "result_path": "campaign --out DIR says where results go",
    "run_duration": "a mission ends by itself here, and no real time is waited for",
    "use_sim_time": "there is one clock here, mission time",
}
"""Keys of any node without a counterpart, and why."""
NOT_READ: Mapping[str, Mapping[tuple[str, str], str]] = {
    "2023": {
        ("task_bridge", "adapt_period"): "revision 2023 reads another parameter and acts on that one's default of 15 s,"
        " which the base has; for this value, set managers.random.adaptation_period_s"
    }
}
"""Keys that the code of a revision, by its name, does not read."""

MARKS: Mapping[str, str] = {
    "random_reasoner_node": "seams2023",
    "task_bridge": "release15",
    "mission_metrics": "release15",
    "battery_monitor": "release15",
    RUNNER: "release15",
}
"""Nodes that only one revision has, and the shipped scenario of that revision."""


@dataclass(frozen=True)
class Found:
    """A parameter as it stands in one of the user's files.

    Attributes:
        document: the file.
        written: node and key as they are written there.
        node: the node's usual name, without a slash.
        key: the key's usual name.
        value: plain data.
    """

    document: YamlDocument
    written: tuple[str, str]
    node: str
    key: str
    value: Any

    @property
    def key_path(self) -> KeyPath:
        """Where it stands in its file."""
        return (self.written[0], _PARAMETERS, self.written[1])

    @property
    def line(self) -> int:
        """Line in its file."""
        return self.document.line(self.key_path)

    @property
    def keys(self) -> str:
        """Node and key, for the user."""
        return f"{self.written[0].removeprefix('/')}.{self.written[1]}"

    @property
    def place(self) -> str:
        """File, line, node and key, for the user."""
        return _place(self.document, self.key_path, self.keys)

    def error(self, problem: str, remedy: str, line: int | None = None) -> InputError:
        """An error about it."""
        place = f"line {line or self.line}, {self.keys}"
        return InputError(problem, file=self.document.path, place=place, remedy=remedy)


@dataclass(frozen=True)
class Configuration:
    """What the user's files say.

    Attributes:
        parameters: of known nodes, file by file.
        modes: System Modes files, each read and checked.
        nodes: nodes as written in the files, without slashes; known ones only.
        notes: what is not understood, a line each.
    """

    parameters: tuple[Found, ...]
    modes: tuple[YamlDocument, ...]
    nodes: tuple[str, ...]
    notes: tuple[str, ...]


def read_configuration(files: Sequence[Path]) -> Configuration:
    """Read the exemplar's mission, campaign and System Modes files, in any order.

    Raises:
        InputError: a file cannot be read, or is none of these.
    """
    parameters: list[Found] = []
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
            if NODE_SPELLINGS.get(name, name) in COUNTERPARTS:
                nodes.append(name)
                parameters += found
            else:
                unknown = (
                    f"not taken over: the node is not known ({did_you_mean(name, (*COUNTERPARTS, *NODE_SPELLINGS))})"
                )
                places = [each.place for each in found] or [_place(document, (entry,), name)]
                notes += [f"{place}: {unknown}" for place in places]
    return Configuration(tuple(parameters), tuple(modes), tuple(nodes), tuple(notes))


def _place(document: YamlDocument, key_path: KeyPath, *keys: str) -> str:
    return f"{document.path}: {place_text(document.line(key_path), keys)}"


def _is_modes(document: YamlDocument) -> bool:
    """Whether a file is one of System Modes: it says of each entry what type it is."""
    entries = [entry.get(_PARAMETERS) for entry in document.data.values() if isinstance(entry, dict)]
    return any(isinstance(entry, dict) and entry.get("type") in ("system", "node") for entry in entries)


def _parameters(document: YamlDocument, entry: str, content: Any, notes: list[str]) -> Iterator[Found]:
    if not isinstance(content, dict) or _PARAMETERS not in content:
        raise document.error(
            f"{entry} has no {_PARAMETERS}",
            (entry,),
            f"a configuration of the exemplar has NODE: {{{_PARAMETERS}: {{KEY: VALUE}}}}",
        )
    for other in content:
        if other != _PARAMETERS:
            place = _place(document, (entry, other), entry.removeprefix("/"), other)
            notes.append(f"{place}: not taken over: it stands beside {_PARAMETERS}, where ROS 2 does not read it")
    parameters = content[_PARAMETERS]
    if parameters is None:
        return
    if not isinstance(parameters, dict):
        raise document.error(
            f"{_PARAMETERS} of {entry} is not a mapping of keys to values",
            (entry, _PARAMETERS),
            "write `key: value` lines under it",
        )
    node = entry.removeprefix("/")
    for key, value in parameters.items():
        written = (entry, str(key))
        yield Found(document, written, NODE_SPELLINGS.get(node, node), KEY_SPELLINGS.get(written[1], written[1]), value)


def no_counterpart(found: Found, known: Iterable[str]) -> str:
    """The line about a key that a scenario or campaign of ours has no use for; `known` are those that have one."""
    if (reason := NOT_NEEDED.get(found.key)) is not None:
        return f"{found.place}: no counterpart: {reason}"
    return f"{found.place}: not taken over: unknown key ({did_you_mean(found.key, known)})"
