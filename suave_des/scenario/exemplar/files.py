"""The exemplar's configuration files (ROS 2 parameters), and the scenario key of each parameter.

Source of the names: the exemplar's repository kas-lab/suave, revisions 2023 to 1.5.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, Field

from suave_des.domain import FOLLOW_PIPELINE, GENERATE_SEARCH_PATH, MAINTAIN_MOTION
from suave_des.errors import InputError, KeyPath, did_you_mean, place_text, shown
from suave_des.scenario.modes import modes_of
from suave_des.scenario.quantities import Within, wrong
from suave_des.scenario.yamlfile import YamlDocument, read_yaml

_FUNCTION_MODES = {
    f"{function}_mode": f"default_modes.{function}"
    for function in (MAINTAIN_MOTION, GENERATE_SEARCH_PATH, FOLLOW_PIPELINE)
}
_MISSION = {"time_limit": "mission.time_limit_s", **_FUNCTION_MODES}
_WATER_VISIBILITY = {
    "qa_publishing_period": "signals.water_visibility.publishing_period_s",
    "water_visibility_period": "signals.water_visibility.period_s",
    "water_visibility_min": "signals.water_visibility.minimum",
    "water_visibility_max": "signals.water_visibility.maximum",
    "water_visibility_sec_shift": "signals.water_visibility.shift_s",
}
_THRUSTER_MONITOR = {"thruster_events": "thruster_events"}
_PERIOD = "managers.random.adaptation_period_s"
_TASK_BRIDGE = {"adapt_period": _PERIOD, "adaptation_period": _PERIOD, **_FUNCTION_MODES}
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
REASONER = "reasoner"
"""Stands for the reasoner's node, whatever its name: the one with a reasoning_period."""
NODES: Mapping[str, Mapping[str, str]] = {
    "mission_node": _MISSION,
    "parent_mission_node": _MISSION,
    "water_visibility_observer_node": _WATER_VISIBILITY,
    "thruster_monitor": _THRUSTER_MONITOR,
    "random_reasoner_node": _TASK_BRIDGE,
    "task_bridge": _TASK_BRIDGE,
    "battery_monitor": _BATTERY_MONITOR,
    "mission_metrics": _MISSION_METRICS,
    REASONER: {"reasoning_period": "managers.metacontrol.reasoning_period_s"},
    RUNNER: _RUNNER,
}
"""The scenario's key path of each parameter that has one, by node."""
NOT_NEEDED = (
    *("result_path", "use_sim_time", "run_duration", "gui", "experiment_logging", "mission_config_pkg"),
    *("mission_name", "adaptation_manager", "experiment_launch"),
)
"""Parameters of any node, and keys of experiments, that say nothing about a mission here."""
_WILDCARDS = ("**", "*")
_PARAMETERS = "ros__parameters"


@dataclass(frozen=True)
class Parameter:
    """A parameter in one of the user's files.

    Attributes:
        document: the file.
        entry: the node as it is written there.
        key: of the parameter.
        value: plain data.
        kind: the entry of NODES that the node is.
    """

    document: YamlDocument
    entry: str
    key: str
    value: Any
    kind: str = ""

    @property
    def node(self) -> str:
        """The node's name, without a slash."""
        return _name(self.entry)

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
class ImportOptions:
    """Options of an import.

    Attributes:
        base: scenario to build on; None: the shipped one of the files' revision.
        revision: of the exemplar, which the files are read as; None: the base's, or the only one that they fit.
        campaign: where the campaign will be; None: no campaign is imported.
        runner_seed: of the exemplar's own draws, which become the campaign's conditions; None: values are drawn anew.
        managers: names of the managers that can be run.
    """

    base: str | None = None
    revision: str | None = None
    campaign: Path | None = None
    runner_seed: int | None = None
    managers: Collection[str] = ()


@dataclass(frozen=True)
class Configuration:
    """Content of the user's files.

    Attributes:
        files: their names.
        parameters: of known nodes, file by file.
        modes: System Modes files, each read and checked.
        nodes: the entries of NODES that are in the files.
        notes: what is not understood, a line each.
    """

    files: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    modes: tuple[YamlDocument, ...]
    nodes: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def runner(self) -> dict[str, Parameter]:
        """The parameters of a campaign, by key."""
        return {each.key: each for each in self.parameters if each.kind == RUNNER}

    @property
    def is_extended(self) -> bool:
        """Whether any mission is the extended one."""
        for parameter in self.parameters:
            if parameter.key == "mission_name" and parameter.value == EXTENDED:
                return True
            if parameter.kind == RUNNER and parameter.key == "experiments" and isinstance(parameter.value, list):
                for each in parameter.value:
                    try:
                        if Experiment.model_validate(json_object(each)).is_extended:
                            return True
                    except ValueError:  # reported where the campaign is imported
                        continue
        return False


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
        kinds: list[str] = []
        for entry, content in document.data.items():
            found = list(_parameters(document, entry, content, notes))
            kinds += [each.kind for each in found] or [_kind(entry, ())]
            parameters += [each for each in found if each.kind]
            places = [each.place for each in found if not each.kind]
            if not found and not kinds[-1]:
                places = [_place(document, (entry,), _name(entry))]
            unknown = f"not taken over: the node is not known ({did_you_mean(_name(entry), _NAMES)})"
            notes += [f"{place}: {unknown}" for place in places]
        if not any(kinds):
            first = next(iter(document.data), "")
            raise document.error(
                "has nothing of SUAVE in it", (first,), did_you_mean(_name(first), _NAMES, "its nodes")
            )
        nodes += filter(None, kinds)
    return Configuration(
        tuple(path.name for path in files), tuple(parameters), tuple(modes), tuple(dict.fromkeys(nodes)), tuple(notes)
    )


_NAMES = tuple(name for name in NODES if name != REASONER)


def _name(entry: str) -> str:
    return entry.removeprefix("/")


def _kind(entry: str, keys: Collection[str], key: str = "") -> str:
    """The entry of NODES that a node of the files with these keys is, for one of them; empty if it is none."""
    name = _name(entry)
    if name in _WILDCARDS:  # the parameter is given to every node
        return next((kind for kind, known in NODES.items() if key in known), "")
    if name in _NAMES:
        return name
    return "" if NODES[REASONER].keys().isdisjoint(keys) else REASONER


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
            place = _place(document, (entry, other), _name(entry), other)
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
    for key, value in parameters.items():
        yield Parameter(document, entry, str(key), value, _kind(entry, parameters, str(key)))


def unknown_key(parameter: Parameter, known: Iterable[str]) -> str:
    """Make the note about a parameter without a counterpart; `known` are those that have one."""
    return f"{parameter.place}: not taken over: unknown key ({did_you_mean(parameter.key, known)})"


# Experiments: which mission of the exemplar its runner launches, under which manager.

Count = Annotated[int, Field(strict=True), Within(ge=1)]
EXTENDED = "suave_extended"
"""Name of the exemplar's mission with a battery and recharging."""
_TREES = {"suave_bt": "bt", "suave_bt_extended": "bt_extended"}
"""Manager by the name of the behaviour tree's executable."""
_ARGUMENT = re.compile(r"(\w+):=(\S+)")
_LIKE_THIS = 'as in {"adaptation_manager": "metacontrol", "num_runs": 20}'


def json_object(value: Any) -> Any:
    """Return the object that a text is in JSON; for a validator."""
    content = value
    if isinstance(value, str):
        try:
            content = json.loads(value)
        except (ValueError, RecursionError):
            content = None
    if not isinstance(content, dict):
        raise wrong(f"{shown(value)} is not a JSON object", _LIKE_THIS)
    return content


class Experiment(BaseModel):
    """Missions of one manager."""

    adaptation_manager: Annotated[str, Field(min_length=1)]
    num_runs: Count
    mission_name: str = ""
    experiment_launch: str = ""

    def manager(self, *, extended: bool) -> str:
        """Return the manager's name here: that of the behaviour tree depends on its executable and on the mission.

        Args:
            extended: whether the configuration of the mission asks for the extended one.
        """
        if self.adaptation_manager != "bt":
            return self.adaptation_manager
        executable = self._arguments.get("bt_executable")
        if executable is None:
            return "bt_extended" if extended or self.is_extended else "bt"
        return _TREES.get(executable, executable)

    @property
    def is_extended(self) -> bool:
        """Whether its mission is the one with a battery."""
        given = self._arguments
        names = (self.mission_name, *(given.get(key) for key in ("mission_name", "mission", "mission_type")))
        return EXTENDED in names or given.get("bt_executable") == "suave_bt_extended"

    @property
    def _arguments(self) -> Mapping[str, str]:
        return dict(_ARGUMENT.findall(self.experiment_launch))


Experiments = tuple[Annotated[Experiment, BeforeValidator(json_object)], ...]
