"""What the exemplar's files say about a mission, by the scenario's key path, and what its nodes do without."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from suave_des.scenario.exemplar_experiments import is_extended
from suave_des.scenario.exemplar_nodes import NODES, NOT_NEEDED, REASONER, RUNNER, Configuration, Parameter, unknown_key
from suave_des.scenario.exemplar_releases import RANDOM_PERIOD_S, Release, defaults_of

_NEGATIVE_TIME = re.compile(r",\s*-[^,]*\)\s*$")


@dataclass(frozen=True)
class Setting:
    """A value of the scenario.

    Attributes:
        value: plain data.
        comment: where it comes from.
        parameter: that gives it; None: nothing does, and it is the default of the exemplar's node.
    """

    value: Any
    comment: str
    parameter: Parameter | None = None


Settings = Mapping[str, Setting]
"""By the scenario's key path."""


def settings_of(configuration: Configuration, release: Release, notes: list[str]) -> Settings:
    """Return the values that a mission has, by the scenario's key path.

    Args:
        configuration: the files.
        release: that reads them.
        notes: gets a line for each parameter that is not taken over.

    Raises:
        InputError: two parameters contradict one another.
    """
    missions: dict[str, Parameter] = {}
    runners: dict[str, Parameter] = {}
    for parameter in configuration.parameters:
        known = NODES[parameter.kind]
        path = known.get(parameter.key)
        if path is None:
            if parameter.kind != RUNNER and parameter.key not in NOT_NEEDED:
                notes.append(unknown_key(parameter, known))
        elif (reason := _unread(parameter, release)) is not None:
            notes.append(f"{parameter.place}: not taken over: {reason}")
        else:
            settings = runners if parameter.kind == RUNNER else missions
            other = settings.setdefault(path, parameter)
            if other is not parameter and _differ(other, parameter):
                raise parameter.error(f"contradicts {other.place}", "make them alike, or leave one of them out")
    for path, parameter in runners.items():
        if path in missions and _differ(missions[path], parameter):
            note = f"not taken over: the campaign's value counts ({parameter.place})"
            notes.append(f"{missions[path].place}: {note}")
    given = {path: _given(path, parameter, notes) for path, parameter in (missions | runners).items()}
    return {**_defaults(configuration, release, given, notes), **given}


def _unread(parameter: Parameter, release: Release) -> str | None:
    """Why the code of a release does not read a parameter; None if it does."""
    kind, key, revision = parameter.kind, parameter.key, f"revision {release.name}"
    if NODES[kind][key] == "managers.random.adaptation_period_s" and key != release.period_key:
        default = f"without it, random adapts every {RANDOM_PERIOD_S:g} s"
        return f"{revision} reads another parameter, {release.period_key}; {default}"
    if kind in ("task_bridge", "random_reasoner_node") and not (release.has_task_bridge or "period" in key):
        return f"{revision} reads that of mission_node alone"
    if kind in ("mission_node", "parent_mission_node") and release.has_task_bridge and key.endswith("_mode"):
        return f"{revision} reads that of task_bridge alone"
    if kind == "battery_monitor" and release.battery == "none":
        return f"{revision} has no battery"
    return None


def _differ(one: Parameter, other: Parameter) -> bool:
    """Whether two values differ by more than the blanks in thruster events."""
    values = [
        ["".join(each.split()) if isinstance(each, str) else each for each in value]
        if isinstance(value, list)
        else value
        for value in (one.value, other.value)
    ]
    return bool(values[0] != values[1])


def _given(path: str, parameter: Parameter, notes: list[str]) -> Setting:
    value, comment = parameter.value, f"{parameter.source}: {parameter.keys}"
    if path == "start.y_m" and value == 2.0:
        comment += "; where 2.0 was asked for, the published runs have 2.56 to 2.59"
    if path == "thruster_events" and isinstance(value, list):
        value = [each for each in value if each != ""]  # as ROS 2 writes a list without entries
        for index, event in enumerate(value):
            if isinstance(event, str) and _NEGATIVE_TIME.search(event):
                notes.append(f"{parameter.place}[{index}]: {event} is before the start, and happens at 0 s")
                value[index] = _NEGATIVE_TIME.sub(",0)", event)
    return Setting(value, comment, parameter)


def _defaults(configuration: Configuration, release: Release, given: Settings, notes: list[str]) -> dict[str, Setting]:
    """The values of nodes that are not in the files, or not in full; none if no mission is configured at all."""
    if not set(configuration.nodes) - {RUNNER, REASONER}:
        return {}
    battery = release.battery == "all" or is_extended(configuration)
    battery = battery or (release.battery == "configured" and "battery_monitor" in configuration.nodes)
    defaults = {path: each for path, each in defaults_of(release, battery=battery).items() if path not in given}
    if defaults:
        names: dict[str, list[str]] = {}
        for keys, _ in defaults.values():
            node, _, key = keys.partition(".")
            names.setdefault(node, []).append(key)
        listed = "; ".join(f"{node}: {', '.join(keys)}" for node, keys in names.items())
        notes.append(f"not in the files, so at the defaults of the exemplar's nodes: {listed}")
    return {path: Setting(value, f"default of {keys}") for path, (keys, value) in defaults.items()}
