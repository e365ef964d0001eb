"""Settings of a mission in the exemplar's files, as each release reads them, and the defaults of its nodes.

Sources: the exemplar's repository kas-lab/suave, at the releases of these names; `2023` made the published runs. What
the code of 1.2 to 1.4 does otherwise was not read for this project: there these releases count as 1.5.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from suave_des.domain import FOLLOW_PIPELINE, GENERATE_SEARCH_PATH
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.scenario.exemplar.files import (
    NODES,
    NOT_NEEDED,
    REASONER,
    RUNNER,
    Configuration,
    Parameter,
    unknown_key,
)

_NEGATIVE_TIME = re.compile(r",\s*-[^,]*\)\s*$")


@dataclass(frozen=True)
class Setting:
    """A value of the scenario.

    Attributes:
        value: plain data.
        comment: where it comes from.
        parameter: its source; None: it is the default of the exemplar's node.
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
        notes: receives a line for each parameter that is not imported.

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
    """Return why the code of a release does not read a parameter; None if it does."""
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
    """Whether two values differ by more than spaces in thruster events."""
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
        comment += "; the published runs, which requested 2.0, have 2.56 to 2.59"
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
    battery = release.battery == "all" or configuration.is_extended
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


# Releases of the exemplar.

RANDOM_PERIOD_S = 15.0
"""Of the manager random, where its parameter is not given."""


@dataclass(frozen=True)
class Release:
    """A release of the exemplar.

    Attributes:
        name: as users know it.
        base: shipped scenario that an import builds on.
        has_task_bridge: whether the manager's modes and period are parameters of the node task_bridge.
        period_key: the parameter that the code of the random manager reads.
        battery: the missions in which a battery monitor runs.
        event_times: what the time of a thruster event counts from.
        changes: what its code does otherwise than that of the base's revision, as in a scenario.
    """

    name: str
    base: str
    has_task_bridge: bool = True
    period_key: Literal["adapt_period", "adaptation_period"] = "adapt_period"
    battery: Literal["none", "configured", "all"] = "none"
    event_times: Literal["after_previous", "after_start"] = "after_previous"
    changes: Mapping[str, Any] = field(default_factory=dict)

    @property
    def traits(self) -> Mapping[str, str]:
        """Traits that may differ between releases, in words."""
        battery = {"none": "no mission", "configured": "some missions", "all": "every mission"}
        counted_from = {"after_previous": "the one before", "after_start": "the start"}
        return {
            "the manager none has the modes of": "task_bridge" if self.has_task_bridge else "mission_node",
            "random reads": self.period_key,
            "a battery is in": battery[self.battery],
            "a thruster event's time counts from": counted_from[self.event_times],
        }


_BEFORE_15 = {"monitors": {"thruster_event_times": "after_previous"}}
RELEASES: Mapping[str, Release] = {
    each.name: each
    for each in (
        Release("2023", "seams2023", has_task_bridge=False, period_key="adaptation_period"),
        Release("1.2", "release15", period_key="adaptation_period", changes=_BEFORE_15),
        Release("1.3", "release15", changes=_BEFORE_15),
        Release("1.4", "release15", battery="all", changes=_BEFORE_15),
        Release("2025", "planta_exp1", period_key="adaptation_period", battery="configured", event_times="after_start"),
        Release("1.5", "release15", battery="all", event_times="after_start"),
    )
}
_FIRST_WITH = {"task_bridge": "1.2", "mission_metrics": "1.3", "battery_monitor": "1.4", "suave_runner_node": "1.2"}
"""The first release that has a node; every later one has it."""


def release_of(nodes: Collection[str], name: str | None) -> tuple[Release, str]:
    """Return the release that a configuration is of, and why.

    Args:
        nodes: known nodes in the files.
        name: of the release, if the user gave it.

    Raises:
        InputError: there is none of that name, or the files fit several, or none.
    """
    if name is not None:
        if name not in RELEASES:
            raise InputError(
                f"there is no revision {shown(name)} of the exemplar",
                place="--revision",
                remedy=did_you_mean(name, RELEASES),
            )
        return RELEASES[name], "as requested"
    fitting = list(RELEASES)
    reasons = [node for node in (*_FIRST_WITH, "random_reasoner_node") if node in nodes]
    for node in reasons:
        first = _FIRST_WITH.get(node)
        with_node = ["2023"] if first is None else list(RELEASES)[list(RELEASES).index(first) :]
        fitting = [each for each in fitting if each in with_node]
    if not fitting:
        raise InputError(
            f"{reasons[0]} and {reasons[-1]} are in no revision of the exemplar together",
            remedy="say which it is: --revision",
        )
    if len(fitting) == 1:
        return RELEASES[fitting[0]], f"only revision {fitting[0]} has {reasons[-1]}"
    raise InputError(
        f"the files fit revisions {_listed(fitting)} of the exemplar, which differ: {_differences(fitting)}",
        remedy=f"say which it is, as in --revision {fitting[-1]}",
    )


def _differences(names: Sequence[str]) -> str:
    """Differences between releases, trait by trait."""
    texts = []
    for trait in RELEASES[names[0]].traits:
        having: dict[str, list[str]] = {}
        for name in names:
            having.setdefault(RELEASES[name].traits[trait], []).append(name)
        if len(having) > 1:
            values = (f"{value} ({', '.join(of)})" for value, of in having.items())
            texts.append(f"{trait} {' or '.join(values)}")
    return "; ".join(texts)


def _listed(names: Sequence[str]) -> str:
    return f"{', '.join(names[:-1])} and {names[-1]}"


def defaults_of(release: Release, *, battery: bool) -> dict[str, tuple[str, Any]]:
    """Return the defaults of the exemplar's nodes, by the scenario's key path: parameter name and value."""
    visibility, metrics = "water_visibility_observer_node", "mission_metrics"
    manager = "task_bridge" if release.has_task_bridge else "mission_node"
    period = "task_bridge" if release.has_task_bridge else "random_reasoner_node"
    found: dict[str, tuple[str, Any]] = {
        "mission.time_limit_s": ("mission_node.time_limit", 300.0),
        "signals.water_visibility.publishing_period_s": (f"{visibility}.qa_publishing_period", 0.2),
        "signals.water_visibility.period_s": (f"{visibility}.water_visibility_period", 100.0),
        "signals.water_visibility.minimum": (f"{visibility}.water_visibility_min", 1.25),
        "signals.water_visibility.maximum": (f"{visibility}.water_visibility_max", 3.75),
        "signals.water_visibility.shift_s": (f"{visibility}.water_visibility_sec_shift", 0.0),
        "thruster_events": ("thruster_monitor.thruster_events", []),
        f"default_modes.{GENERATE_SEARCH_PATH}": (
            f"{manager}.{GENERATE_SEARCH_PATH}_mode",
            "fd_spiral_medium" if release.has_task_bridge else "fd_spiral_low",
        ),
        f"default_modes.{FOLLOW_PIPELINE}": (f"{manager}.{FOLLOW_PIPELINE}_mode", "fd_follow_pipeline"),
        "managers.random.adaptation_period_s": (f"{period}.{release.period_key}", RANDOM_PERIOD_S),
    }
    if release.name == "2025":  # whose base starts where the study did
        found["start.y_m"] = ("suave_runner_node.initial_pos_y", 2.0)
    if battery:
        found |= {
            "battery.discharge_time_s": ("battery_monitor.discharge_time", 200.0),
            "battery.publishing_period_s": ("battery_monitor.qa_publishing_period", 1.0),
        }
    if release.has_task_bridge and release.name != "1.2":
        found |= {
            "reaction_metric.visibility_thresholds_m": (f"{metrics}.water_visibility_threshold", [3.25, 2.25, 1.25]),
            "reaction_metric.expected_altitudes_m": (f"{metrics}.expected_altitude", [3.0, 2.0, 1.0]),
            "reaction_metric.battery_limit": (f"{metrics}.battery_limit", 0.25),
        }
    return found
