"""Scenarios and campaigns as the exemplar's own configuration files, and what these cannot say."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from suave_des.domain import WATER_VISIBILITY
from suave_des.errors import InputError, did_you_mean, shown
from suave_des.exemplar.configurations import import_config
from suave_des.exemplar.files import EVENTS, PARAMETERS
from suave_des.exemplar.keys import (
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
from suave_des.exemplar.mission_values import at
from suave_des.exemplar.runner import EXTENDED, TREES
from suave_des.files import Json
from suave_des.scenario.loader import LoadedScenario, load_scenario, with_values
from suave_des.scenario.models import ThrusterEvent, mean
from suave_des.scenario.yamlfile import Layer, Location, parse_yaml

MISSION_FILE, RUNNER_FILE = "mission_config.yaml", "runner_config.yml"
MANAGERS = ("none", "random", "metacontrol", *TREES.values())
_NOT_COMPARED = ("name", "description", "campaign", "scenario")
_DIGITS = 9
"""Decimals without rounding errors of differences."""


def export_config(
    loaded: LoadedScenario, campaign: Json, revision: str | None = None
) -> tuple[dict[str, str], tuple[str, ...]]:
    """Write a scenario and a campaign as the exemplar's mission and runner files. No file is
    written.

    Args:
        campaign: content of a campaign file: managers, runs, seed, runs_per_draw, perturbations,
            and others.
        revision: of the exemplar that reads the files; None: the scenario's.

    Returns:
        The texts by file name, and a line for each key that the exemplar cannot express:
        import_config would give another value.

    Raises:
        InputError: there is no such revision, or it has none of the managers.
    """
    revision = revision or loaded.scenario.revision.name
    if revision not in REVISIONS:
        remedy = did_you_mean(revision, REVISIONS, "give --revision, one of")
        raise InputError(
            f"the exemplar has no revision {shown(revision)}", file=loaded.path, remedy=remedy
        )
    times_s = _event_times_s(loaded, revision)
    counted = with_values(loaded, {**times_s, **_publishing_period(loaded)})
    has_runner = is_since(revision, FIRST_WITH_RUNNER)
    nodes = _nodes(counted, revision)
    runner = nodes.pop(RUNNER, {})
    files = {MISSION_FILE: nodes}
    if has_runner:
        files[RUNNER_FILE] = {RUNNER: {**runner, **_runner_of(counted, campaign, revision)}}
    texts = {
        name: _text(content, loaded.path, revision) for name, content in files.items() if content
    }
    again = import_config(
        [parse_yaml(text, Path(name)) for name, text in texts.items()],
        loaded.path.with_name(f"again_{loaded.path.name}"),
        managers=MANAGERS,
        revision=revision,
        campaign=Path("campaign.yaml") if has_runner else None,
    )
    here, there = (each.scenario.model_dump(mode="json") for each in (counted, again.loaded))
    lost = [*_random_times(loaded, times_s), *_differences(here, there)]
    return texts, (*lost, *_lost_campaign(campaign, again.campaign))


def _publishing_period(loaded: LoadedScenario) -> dict[str, float]:
    """The publishing period of the visibility by its key path, if the scenario has the
    revision's.
    """
    if loaded.scenario.signals[WATER_VISIBILITY].publishing_period_s is not None:
        return {}
    period_s = loaded.scenario.revision.monitors.visibility_publishing_period_s
    return {f"signals.{WATER_VISIBILITY}.publishing_period_s": period_s}


def _lost_campaign(campaign: Json, again: str | None) -> Iterator[str]:
    """Yield what of a campaign is lost; `again` is what is imported again, None without runner."""
    given = {key: value for key, value in campaign.items() if value not in (None, {}, [])}
    if again is not None:
        yield from _differences(given, yaml.safe_load(again))
    elif given:
        named = ", ".join(given)
        yield f"{named}: the exemplar has no experiment runner before {FIRST_WITH_RUNNER}"


def _text(nodes: Mapping[str, Mapping[str, object]], source: Path, revision: str) -> str:
    """A file of these nodes' parameters."""
    content = {f"/{node}": {PARAMETERS: given} for node, given in nodes.items()}
    written = f"# Written by `suave-des export-config` from {source.name}"
    head = f"{written}, for revision {revision} of the exemplar.\n"
    return head + yaml.safe_dump(content, sort_keys=False, width=1_000_000)


# Thruster events.


def _event_times_s(loaded: LoadedScenario, revision: str) -> dict[str, float]:
    """Return the times of thruster events, by key path, where a revision counts them otherwise:
    from the start, or one by one. A random time is replaced by its mean.
    """
    over = Layer({"revision": revision}, {(): Location(0, 1, loaded.path)})
    of_revision = load_scenario(REVISIONS[revision], over=over).scenario.revision
    there = of_revision.monitors.thruster_event_times
    if there == loaded.scenario.revision.monitors.thruster_event_times:
        return {}
    times_s = dict[str, float]()
    before_s = 0.0
    for number, event in enumerate(loaded.scenario.thruster_events):
        time_s = max(0.0, mean(event.time_s))
        path = f"{EVENTS}.{number}.time_s"
        if there == "after_start":
            before_s += time_s
            times_s[path] = before_s
        else:
            after_s = max(before_s, time_s)  # an event waits for the one before
            times_s[path] = after_s - before_s
            before_s = after_s
    return times_s


def _random_times(loaded: LoadedScenario, times_s: Mapping[str, float]) -> Iterator[str]:
    """Yield a line for each random time of a thruster event that was replaced by its mean."""
    for path, time_s in times_s.items():
        drawn = at(loaded, path)
        if isinstance(drawn, dict):
            yield f"{path}: {shown(drawn)} here, its mean in the exemplar, as {time_s:g}"


def _shift_of(
    loaded: LoadedScenario, drawn: Mapping[str, object]
) -> tuple[list[float], list[float]] | None:
    """Find times of thruster events, which may be before the start, and the ends of an interval
    added to all of them, that give what a campaign draws; None if the runner cannot draw that.
    """
    events = _drawn_events(loaded, drawn)
    widths_s = {round(high - low, _DIGITS) for _, low, high in events}
    if len(widths_s) != 1:
        return None
    lows_s = [low for _, low, _ in events]
    # An event that is at the start here may be before it there.
    after_start_s = (low - time_s for time_s, low, _ in events if time_s > 0.0)
    lowest_s = next(after_start_s, max(lows_s))
    around_s = [round(low - lowest_s, _DIGITS) for low in lows_s]
    if [max(0.0, each) for each in around_s] != [round(time_s, _DIGITS) for time_s, *_ in events]:
        return None
    return around_s, [round(lowest_s, _DIGITS), round(lowest_s + widths_s.pop(), _DIGITS)]


def _drawn_events(
    loaded: LoadedScenario, drawn: Mapping[str, object]
) -> list[tuple[float, float, float]]:
    """Return the time of each thruster event, and the bounds of what a campaign draws in its place;
    nothing if it is not so of each.
    """
    found = []
    for number, event in enumerate(loaded.scenario.thruster_events):
        bounds = _bounds(drawn.get(f"{EVENTS}.{number}.time_s"))
        if bounds is None or not isinstance(event.time_s, float):
            return []
        found.append((event.time_s, *bounds))
    return found


def _bounds(drawn: object) -> tuple[float, float] | None:
    """Return the bounds of what a campaign draws; None if it is not uniform."""
    if isinstance(drawn, dict) and drawn["distribution"] == "uniform":
        lacking = [name for name in ("minimum", "maximum") if name not in drawn]
        if lacking:
            remedy = "give both minimum and maximum"
            raise InputError(f"{shown(drawn)} has no {' and no '.join(lacking)}", remedy=remedy)
        return float(drawn["minimum"]), float(drawn["maximum"])
    return None


def _texts(events: Sequence[ThrusterEvent], times_s: Sequence[float]) -> list[str]:
    """Write thruster events with these times, as the exemplar does."""
    numbers = [str(int(time_s)) if time_s.is_integer() else repr(time_s) for time_s in times_s]
    return [
        f"({each.thruster},{each.event},{number})"
        for each, number in zip(events, numbers, strict=True)
    ]


# The nodes' parameters.


def _nodes(loaded: LoadedScenario, revision: str) -> dict[str, dict[str, object]]:
    """The parameters of each node of which the scenario has a value of their type."""
    nodes: dict[str, dict[str, object]] = {}
    for key in read_by(revision):
        value = _value(loaded, key.path, key.default)
        # The reasoner's file is another one. What the runner does anyway may have no key in an
        # older revision.
        is_needless = key.node == REASONER or (key.node, value) == (RUNNER, key.default)
        if value is None or is_needless:
            continue
        is_2023s = (key.node, revision) == ("task_bridge", "2023")
        node = "random_reasoner_node" if is_2023s else key.node
        nodes.setdefault(node, {})[key.name] = value
    return nodes


def _value(loaded: LoadedScenario, path: str, default: object) -> object:
    """A value of the scenario in the type of a default, as ROS 2 demands; None if it has none."""
    if path == EVENTS:
        events = loaded.scenario.thruster_events
        return _texts(events, [mean(each.time_s) for each in events])
    value = at(loaded, path)
    if value is None and path.endswith((".minimum", ".maximum")):  # of another signal than a cosine
        value = at(loaded, f"{path.rpartition('.')[0]}.value")
    kind = str if default is None else type(default)
    if isinstance(value, int | float) and kind in (int, float):
        return round(value) if kind is int else float(value)
    return value if type(value) is kind else None


def _runner_of(loaded: LoadedScenario, campaign: Json, revision: str) -> dict[str, object]:
    """The parameters that only the runner has; an InputError if the exemplar has none of the
    managers.
    """
    managers = [each for each in campaign["managers"] if each in MANAGERS]
    if not managers:
        problem = f"the exemplar has none of the managers {', '.join(campaign['managers'])}"
        raise InputError(problem, file=loaded.path, remedy=f"it has {', '.join(MANAGERS)}")
    found = _intervals(loaded, campaign.get("perturbations") or {})
    found["random_interval"] = campaign.get("runs_per_draw", 1)
    if is_since(revision, FIRST_WITH_BRINGUP):
        found["random_seed"] = campaign["seed"]
    found["mission_config_pkg"] = "suave_missions"
    found["mission_config_file"] = f"config/{MISSION_FILE}"
    experiments = [_experiment(each, campaign["runs"], loaded, revision) for each in managers]
    return {**found, "experiments": [json.dumps(each) for each in experiments]}


def _intervals(loaded: LoadedScenario, drawn: Mapping[str, object]) -> dict[str, object]:
    """The runner's intervals that give what a campaign draws, and its thruster events if some of
    them are before the start.
    """
    found: dict[str, object] = {}
    for key in DRAWN:
        path = key.path.removeprefix(PERTURBED)
        if path != EVENTS:
            value = at(loaded, path)
            bounds = _bounds(drawn.get(path))
            if isinstance(value, float) and bounds is not None:
                found[key.name] = [round(bound - value, _DIGITS) for bound in bounds]
        elif (shift := _shift_of(loaded, drawn)) is not None:
            times_s, found[key.name] = shift
            if min(times_s) < 0.0:
                found[EVENTS] = _texts(loaded.scenario.thruster_events, times_s)
    return found


def _experiment(
    manager: str, runs: int, loaded: LoadedScenario, revision: str
) -> dict[str, object]:
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
    return {
        "experiment_launch": launch,
        "num_runs": runs,
        "adaptation_manager": name,
        "mission_name": mission,
    }


def _differences(
    here: Mapping[str, object], there: Mapping[str, object], above: str = ""
) -> Iterator[str]:
    """Yield a line for each key of which the exemplar has another value."""
    for key in dict.fromkeys((*here, *there)):
        one = _rounded(here.get(key))
        other = _rounded(there.get(key))
        if one == other or (not above and key in _NOT_COMPARED):
            continue
        if key == "revision" and one["name"] != other["name"]:
            yield f"revision: {one['name']} here; the code that reads the files is {other['name']}'s"
        elif not isinstance(one, dict) or not isinstance(other, dict):
            yield f"{above}{key}: {shown(one)} here, {shown(other)} in the exemplar"
        elif one.get("kind") == other.get("kind"):
            yield from _differences(one, other, f"{above}{key}.")
        else:
            yield f"{above}{key}: {one['kind']} here, {other['kind']} in the exemplar"


def _rounded(value: object) -> Any:
    """Plain data without rounding errors."""
    return json.loads(json.dumps(value), parse_float=lambda text: float(f"{float(text):.9g}"))
