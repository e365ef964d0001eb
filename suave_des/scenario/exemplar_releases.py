"""Releases of the exemplar as the import of its configuration knows them: how each reads a mission's files.

Sources: the exemplar's repository kas-lab/suave, at the releases of these names; `2023` made the published runs. What
the code of 1.2 to 1.4 does otherwise was not read for this project: there these releases count as 1.5.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from suave_des.domain import FOLLOW_PIPELINE, GENERATE_SEARCH_PATH
from suave_des.errors import InputError, did_you_mean, shown

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
        """What may differ between releases, in words."""
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
        return RELEASES[name], "as asked for"
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
    """What differs between releases, trait by trait."""
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
    """Return what the exemplar's nodes do without a parameter, by the scenario's key path: its name and default.

    Args:
        release: of the exemplar.
        battery: whether the mission has one.
    """
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
