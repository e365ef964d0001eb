"""The way back: a scenario and a campaign as the exemplar's own configuration files, and what these cannot express."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from suave_des.domain import WATER_VISIBILITY
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.scenario.exemplar import (
    DRAWN,
    FIRST_WITH_BRINGUP,
    FIRST_WITH_RUNNER,
    PERTURBED,
    REASONER,
    REVISIONS,
    RUNNER,
    is_since,
    read_by,
)
from suave_des.scenario.exemplar.importing import (
    EXTENDED,
    PARAMETERS,
    TREES,
    at,
    import_config,
)
from suave_des.scenario.loader import LoadedScenario, with_values
from suave_des.scenario.quantities import mean
from suave_des.scenario.yamlfile import parse_yaml

MISSION_FILE, RUNNER_FILE = "mission_config.yaml", "runner_config.yml"
MANAGERS = ("none", "random", "metacontrol", *TREES.values())
_NOT_COMPARED = ("name", "description", "campaign", "scenario")


def export_config(
    loaded: LoadedScenario, campaign: Mapping[str, Any], revision: str | None = None
) -> tuple[dict[str, str], tuple[str, ...]]:
    """Write a scenario and a campaign as the exemplar's mission and runner files. No file is written.

    Args:
        loaded: the scenario.
        campaign: content of a campaign file: managers, runs, seed, runs_per_draw, perturbations, and others.
        revision: of the exemplar that reads the files; None: the scenario's.

    Returns:
        The texts by file name, and a line for each key that the exemplar cannot express: import_config would give
        another value.

    Raises:
        InputError: there is no such revision, or it has none of the managers.
    """
    revision = revision or loaded.scenario.revision.name
    if revision not in REVISIONS:
        remedy = did_you_mean(revision, REVISIONS, "give --revision, one of")
        raise InputError(f"the exemplar has no revision {shown(revision)}", file=loaded.path, remedy=remedy)
    measured = loaded.scenario.signals[WATER_VISIBILITY]
    if measured.publishing_period_s is None:
        period_s = loaded.scenario.revision.monitors.visibility_publishing_period_s
        loaded = with_values(loaded, {f"signals.{WATER_VISIBILITY}.publishing_period_s": period_s})
    mission, runner = _mission(loaded, revision), dict[str, Any]()
    if is_since(revision, FIRST_WITH_RUNNER):
        runner = {RUNNER: {**mission.pop(RUNNER, {}), **_runner(loaded, campaign, revision)}}
    files = {name: nodes for name, nodes in ((MISSION_FILE, mission), (RUNNER_FILE, runner)) if nodes}
    head = f"# Written by `suave-des export-config` from {loaded.path.name}, for revision {revision} of the exemplar.\n"
    texts = {name: head + _yaml(nodes) for name, nodes in files.items()}
    again = import_config(
        [parse_yaml(text, Path(name)) for name, text in texts.items()],
        loaded.path.with_name(f"again_{loaded.path.name}"),
        managers=MANAGERS,
        revision=revision,
        campaign=Path("campaign.yaml") if runner else None,
    )
    there = yaml.safe_load(again.campaign or "{}")
    campaign = {key: value for key, value in campaign.items() if value not in (None, {}, [])}
    lost = list(_differences(loaded.scenario.model_dump(mode="json"), again.loaded.scenario.model_dump(mode="json")))
    if runner:
        lost += _differences(campaign, there)
    elif campaign:
        lost.append(f"{', '.join(campaign)}: no runner before {FIRST_WITH_RUNNER}")
    return texts, tuple(lost)


def _yaml(nodes: Mapping[str, Mapping[str, Any]]) -> str:
    content = {f"/{node}": {PARAMETERS: dict(parameters)} for node, parameters in nodes.items()}
    return str(yaml.safe_dump(content, sort_keys=False, width=1_000_000))


def _mission(loaded: LoadedScenario, revision: str) -> dict[str, dict[str, Any]]:
    """The parameters of each node of which the scenario has a value of their type."""
    nodes: dict[str, dict[str, Any]] = {}
    for key in read_by(revision):
        value = _value(loaded, key.path, key.default)
        # The reasoner's file is another one. What the runner does anyway may have no key in an older revision.
        if value is not None and key.node != REASONER and (key.node, value) != (RUNNER, key.default):
            node = "random_reasoner_node" if (key.node, revision) == ("task_bridge", "2023") else key.node
            nodes.setdefault(node, {})[key.name] = value
    return nodes


def _value(loaded: LoadedScenario, path: str, default: Any) -> Any:
    """A value of the scenario in the type of a default, as ROS 2 demands; None if it has none."""
    if path == "thruster_events":
        events = loaded.scenario.thruster_events
        times_s = [mean(each.time_s) for each in events]
        texts = [str(int(time_s)) if time_s.is_integer() else repr(time_s) for time_s in times_s]
        return [f"({each.thruster},{each.event},{time_s})" for each, time_s in zip(events, texts, strict=True)]
    value = at(loaded, path)
    if value is None and path.endswith((".minimum", ".maximum")):  # of another signal than a cosine
        value = at(loaded, f"{path.rpartition('.')[0]}.value")
    if isinstance(default, int | float) and isinstance(value, int | float):
        return round(value) if isinstance(default, int) else float(value)
    return value if type(value) is type(default) or (default is None and isinstance(value, str)) else None


def _runner(loaded: LoadedScenario, campaign: Mapping[str, Any], revision: str) -> dict[str, Any]:
    """The parameters of the runner that the scenario does not have.

    Raises:
        InputError: the exemplar has none of the managers.
    """
    drawn, found = campaign.get("perturbations") or {}, dict[str, Any]()
    for key in DRAWN:
        path = key.path.removeprefix(PERTURBED)
        events = range(len(loaded.scenario.thruster_events))
        paths = [f"{path}.{index}.time_s" for index in events] if path == "thruster_events" else [path]
        intervals = [_interval(drawn.get(each), at(loaded, each)) for each in paths]
        if intervals and intervals[0] is not None and intervals.count(intervals[0]) == len(intervals):
            found[key.name] = intervals[0]
    found["random_interval"] = campaign.get("runs_per_draw", 1)
    if is_since(revision, FIRST_WITH_BRINGUP):
        found["random_seed"] = campaign["seed"]
    managers = [each for each in campaign["managers"] if each in MANAGERS]
    if not managers:
        problem = f"the exemplar has none of the managers {', '.join(campaign['managers'])}"
        raise InputError(problem, file=loaded.path, remedy=f"it has {', '.join(MANAGERS)}")
    files = {"mission_config_pkg": "suave_missions", "mission_config_file": f"config/{MISSION_FILE}"}
    experiments = [_experiment(each, campaign["runs"], loaded, revision) for each in managers]
    return {**found, **files, "experiments": [json.dumps(each) for each in experiments]}


def _interval(distribution: Any, at: Any) -> list[float] | None:
    """What a uniform distribution adds to a value; None if it is no such distribution, or the value is none."""
    if not isinstance(at, float) or not isinstance(distribution, dict) or distribution["distribution"] != "uniform":
        return None
    return [round(distribution[bound] - at, 9) for bound in ("minimum", "maximum")]


def _experiment(manager: str, runs: int, loaded: LoadedScenario, revision: str) -> dict[str, Any]:
    is_extended = manager == "bt_extended"
    name = manager.removesuffix("_extended")
    launch = f"ros2 launch suave_{name} suave_{manager}.launch.py"
    if is_since(revision, FIRST_WITH_BRINGUP):
        launch = f"ros2 launch suave_bringup mission.launch.py adaptation_manager:={name}"
        launch += " bt_executable:=suave_bt_extended" if is_extended else ""
        battery = loaded.scenario.battery
        if battery is not None and battery.mission_ends_at_level is not None:
            launch += f" battery_constraint:=true battery_constraint_value:={battery.mission_ends_at_level!r}"
    mission = EXTENDED if is_extended else EXTENDED.removesuffix("_extended")
    return {"experiment_launch": launch, "num_runs": runs, "adaptation_manager": name, "mission_name": mission}


def _differences(here: Mapping[str, Any], there: Mapping[str, Any], above: str = "") -> Iterator[str]:
    """Yield a line for each key of which the exemplar has another value."""
    for key in dict.fromkeys((*here, *there)):
        one, other = _rounded(here.get(key)), _rounded(there.get(key))
        if one == other or (not above and key in _NOT_COMPARED):
            continue
        if key == "revision" and one["name"] != other["name"]:
            yield f"revision: {one['name']} here; the code that reads the files is {other['name']}'s"
        elif isinstance(one, dict) and isinstance(other, dict) and one.get("kind") == other.get("kind"):
            yield from _differences(one, other, f"{above}{key}.")
        elif isinstance(one, dict) and isinstance(other, dict):
            yield f"{above}{key}: {one['kind']} here, {other['kind']} in the exemplar"
        else:
            yield f"{above}{key}: {shown(one)} here, {shown(other)} in the exemplar"


def _rounded(value: Any) -> Any:
    """Plain data without rounding errors."""
    return json.loads(json.dumps(value), parse_float=lambda text: float(f"{float(text):.9g}"))
