"""The exemplar's campaign configuration (revision 1.5, node suave_runner_node) as a campaign of ours."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import PurePath
from typing import Any

from suave_des.errors import InputError, shown
from suave_des.scenario.exemplar_nodes import COUNTERPARTS, RUNNER, Found, no_counterpart
from suave_des.scenario.loader import LoadedScenario, value_at

_INTERVAL = "_random_interval"
_NOMINAL = {"initial_pos_x": -17.0, "initial_pos_y": 2.0}
"""Where the exemplar starts unless it is told otherwise."""
_DRAWN = {
    "water_visibility_sec_shift": "signals.water_visibility.shift_s",
    "initial_pos_x": "start.x_m",
    "initial_pos_y": "start.y_m",
}
_RUNNER_KEYS = (
    "experiments",
    "mission_config_file",
    "random_interval",
    "random_seed",
    *(key + _INTERVAL for key in COUNTERPARTS[RUNNER]),
)
_EXPERIMENT_KEYS: Mapping[str, str | None] = {
    "adaptation_manager": None,
    "num_runs": None,
    "mission_name": "no counterpart: result files have the scenario's name",
    "experiment_launch": "no counterpart: nothing is launched here",
}
"""Keys of an experiment, and why those without a counterpart have none."""


@dataclass(frozen=True)
class Perturbation:
    """A value that is drawn uniformly, once for each draw."""

    path: str
    minimum: float
    maximum: float
    comment: str


@dataclass(frozen=True)
class Campaign:
    """What a campaign file of ours says; each comment tells where the value comes from, none: it was not given."""

    managers: tuple[str, ...]
    runs: int
    experiments: str
    seed: tuple[int, str] | None
    runs_per_draw: tuple[int, str] | None
    perturbations: tuple[Perturbation, ...]


def campaign_of(
    runner: Mapping[str, Found],
    loaded: LoadedScenario,
    managers: Collection[str],
    files: Sequence[str],
    notes: list[str],
) -> Campaign:
    """The campaign that the runner's parameters describe.

    Args:
        runner: its parameters by key.
        loaded: the imported scenario.
        managers: names of the managers that can be run.
        files: names of the files given.
        notes: gets a line for each key without a counterpart.

    Raises:
        InputError: a value cannot be right, or there is nothing to run.
    """
    for found in runner.values():
        if found.key not in COUNTERPARTS[RUNNER] and found.key not in _RUNNER_KEYS:
            notes.append(no_counterpart(found, (*COUNTERPARTS[RUNNER], *_RUNNER_KEYS)))
    if (mission := runner.get("mission_config_file")) is not None and PurePath(str(mission.value)).name not in files:
        notes.append(f"{mission.place}: not taken over: {shown(mission.value)} is none of the files given")
    names, runs, where = _experiments(runner, managers, notes)
    perturbations = tuple(_perturbations(runner, loaded, notes))
    per_draw = _whole(runner, "random_interval", 1)
    if per_draw is not None and not perturbations:
        notes.append(f"{runner['random_interval'].place}: no counterpart: nothing is drawn at random")
        per_draw = None
    return Campaign(names, runs, where, _whole(runner, "random_seed", None), per_draw, perturbations)


def _told(found: Found) -> str:
    return f"{found.document.path.name}, line {found.line}: {found.key}"


def _whole(runner: Mapping[str, Found], key: str, least: int | None) -> tuple[int, str] | None:
    found = runner.get(key)
    if found is None:
        return None
    if not isinstance(found.value, int) or isinstance(found.value, bool) or (least is not None and found.value < least):
        remedy = "give a whole number" + ("" if least is None else f", at least {least}")
        raise found.error(f"{shown(found.value)} is out of place", remedy)
    return found.value, _told(found)


def _experiments(
    runner: Mapping[str, Found], known: Collection[str], notes: list[str]
) -> tuple[tuple[str, ...], int, str]:
    """Managers, runs for each, and where that is said."""
    found = runner.get("experiments")
    if found is None:
        raise InputError(f"{RUNNER} has no experiments", remedy="add them: they say which managers are to run")
    if not isinstance(found.value, list) or not found.value:
        raise found.error(f"{shown(found.value)} is no list of experiments", "give JSON objects, one an entry")
    runs: dict[str, int] = {}
    for index, entry in enumerate(found.value):
        line = found.document.line((*found.key_path, index))
        place = f"{found.document.path}: line {line}, {found.keys}[{index}]"
        manager, number = _experiment(found, entry, line, place, notes)
        if manager not in known:
            close = get_close_matches(manager, known, n=1)
            hint = f"did you mean {close[0]}?" if close else f"known: {', '.join(known)}"
            notes.append(f"{place}: not taken over: there is no manager {shown(manager)} ({hint})")
        elif manager in runs:
            notes.append(
                f"{place}: not taken over: {manager} is there already, and a campaign has one mission for each manager"
            )
            runs[manager] = max(runs[manager], number)
        else:
            runs[manager] = number
    if not runs:
        raise found.error("none of its managers can be run", f"known: {', '.join(known)}")
    most = max(runs.values())
    if fewer := [f"{manager} {number}" for manager, number in runs.items() if number < most]:
        notes.append(
            f"{found.place}: every manager gets {most} runs, where fewer were asked for ({', '.join(fewer)});"
            " the first ones are the same"
        )
    return tuple(runs), most, _told(found)


def _experiment(found: Found, entry: Any, line: int, place: str, notes: list[str]) -> tuple[str, int]:
    """Manager and runs of one experiment."""
    content = entry
    if isinstance(entry, str):
        try:
            content = json.loads(entry)
        except (ValueError, RecursionError):
            raise found.error(f"{shown(entry)} is no JSON object", _like_this(), line) from None
    if not isinstance(content, dict):
        raise found.error(f"{shown(entry)} is no JSON object", _like_this(), line)
    for key in content:
        if (reason := _EXPERIMENT_KEYS.get(key, "not taken over: unknown key")) is not None:
            notes.append(f"{place}.{' '.join(key.split())}: {reason}")
    manager, runs = content.get("adaptation_manager"), content.get("num_runs")
    if not isinstance(manager, str) or not manager:
        raise found.error(f"adaptation_manager is {shown(manager)}", _like_this(), line)
    if not isinstance(runs, int) or isinstance(runs, bool) or runs < 1:
        raise found.error(f"num_runs is {shown(runs)}", "give a whole number, at least 1", line)
    return manager, runs


def _like_this() -> str:
    return 'as in {"adaptation_manager": "metacontrol", "num_runs": 20}'


def _perturbations(runner: Mapping[str, Found], loaded: LoadedScenario, notes: list[str]) -> Iterator[Perturbation]:
    """What is drawn at random: a value with its interval added."""
    for key, path in _DRAWN.items():
        if (interval := runner.get(key + _INTERVAL)) is not None:
            around = _NOMINAL[key] if key in _NOMINAL and key not in runner else value_at(loaded, path)
            yield from _drawn(path, around, interval)
    interval = runner.get("thruster_events" + _INTERVAL)
    if interval is not None:
        events = len(loaded.scenario.thruster_events)
        if events == 0:
            notes.append(f"{interval.place}: no counterpart: there are no thruster events")
        for index in range(events):
            path = f"thruster_events.{index}.time_s"
            yield from _drawn(path, value_at(loaded, path), interval)


def _drawn(path: str, around: Any, interval: Found) -> Iterator[Perturbation]:
    low, high = _bounds(interval)
    if not isinstance(around, int | float):
        key = interval.key.removesuffix(_INTERVAL)
        raise interval.error(f"the base scenario draws {path} at random already", f"give {key} a value beside it")
    if low < high:
        comment = f"{_told(interval)} [{low:g}, {high:g}] added to {around:g}"
        yield Perturbation(path, around + low, around + high, comment)


def _bounds(interval: Found) -> tuple[float, float]:
    value = interval.value
    if (
        not isinstance(value, list)
        or len(value) != 2
        or any(isinstance(each, bool) or not isinstance(each, int | float) or abs(each) > 1e9 for each in value)
    ):
        raise interval.error(f"{shown(value)} is no interval", "give two numbers, as in [-1.0, 1.0]")
    low, high = value
    if low > high:
        raise interval.error(f"{shown(value)} begins after its end", "give the smaller number first")
    return float(low), float(high)
