"""The exemplar's campaign configuration (revision 1.5, node suave_runner_node) as a campaign of ours."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, Field, TypeAdapter, ValidationError

from suave_des.errors import InputError, KeyPath, did_you_mean, shown
from suave_des.scenario.exemplar_nodes import NODES, RUNNER, Parameter, no_counterpart
from suave_des.scenario.exemplar_text import commented, flow, heading, one_line
from suave_des.scenario.layers import Layer, Location
from suave_des.scenario.loader import LoadedScenario, value_at
from suave_des.scenario.problems import input_error
from suave_des.scenario.quantities import LONGEST_S, Within, wrong

_INTERVAL = "_random_interval"
_NOMINAL = {"initial_pos_x": -17.0, "initial_pos_y": 2.0}
"""Where the exemplar starts unless it is configured otherwise."""
_LIKE_THIS = 'as in {"adaptation_manager": "metacontrol", "num_runs": 20}'
_EXPERIMENT_KEYS: Mapping[str, str] = {
    "mission_name": "no counterpart: result files have the scenario's name",
    "experiment_launch": "no counterpart: nothing is launched here",
}
"""Keys of an experiment without a counterpart, and why."""


def _interval(value: Any) -> Any:
    if not isinstance(value, list) or len(value) != 2:
        raise wrong(f"{shown(value)} is not an interval", "give two numbers, as in [-1.0, 1.0]")
    return value


def _json_object(value: Any) -> Any:
    content = value
    if isinstance(value, str):
        try:
            content = json.loads(value)
        except (ValueError, RecursionError):
            content = None
    if not isinstance(content, dict):
        raise wrong(f"{shown(value)} is not a JSON object", _LIKE_THIS)
    return content


_Limit = Annotated[float, Field(strict=True), Within(-LONGEST_S, LONGEST_S)]
_Interval = Annotated[tuple[_Limit, _Limit], BeforeValidator(_interval)]
_Count = Annotated[int, Field(strict=True), Within(ge=1)]


class _Experiment(BaseModel):
    adaptation_manager: Annotated[str, Field(min_length=1)]
    num_runs: _Count


class _Runner(BaseModel):
    """Parameters of the node that only a campaign has."""

    experiments: Annotated[tuple[Annotated[_Experiment, BeforeValidator(_json_object)], ...], Field(min_length=1)]
    mission_config_file: Any = None
    random_interval: _Count | None = None
    random_seed: Annotated[int, Field(strict=True)] | None = None
    water_visibility_sec_shift_random_interval: _Interval | None = None
    initial_pos_x_random_interval: _Interval | None = None
    initial_pos_y_random_interval: _Interval | None = None
    thruster_events_random_interval: _Interval | None = None


_NODES = TypeAdapter(dict[str, _Runner])


@dataclass(frozen=True)
class _Perturbation:
    """A value that is drawn uniformly, once for each draw."""

    path: str
    minimum: float
    maximum: float
    comment: str


def campaign_text(
    runner: Mapping[str, Parameter],
    loaded: LoadedScenario,
    scenario: str,
    managers: Collection[str],
    files: Sequence[str],
    notes: list[str],
) -> str:
    """The campaign file for the runner's parameters.

    Args:
        runner: its parameters by key.
        loaded: the imported scenario.
        scenario: how the campaign file names it.
        managers: names of the managers that can be run.
        files: names of the files given.
        notes: gets a line for each key without a counterpart.

    Raises:
        InputError: a value cannot be right, or there is nothing to run.
    """
    known = (*NODES[RUNNER].parameters, *_Runner.model_fields)
    notes += [no_counterpart(parameter, known) for key, parameter in runner.items() if key not in known]
    if "experiments" not in runner:
        raise InputError(f"{RUNNER} has no experiments", remedy="add them: they name the managers to run")
    settings = _checked(runner)
    mission = runner.get("mission_config_file")
    if mission is not None and PurePath(str(mission.value)).name not in files:
        notes.append(f"{mission.place}: not taken over: {shown(mission.value)} is none of the files given")
    names, runs = _experiments(runner["experiments"], settings.experiments, managers, notes)
    perturbations = list(_perturbations(runner, settings, loaded, notes))
    where = _source(runner["experiments"])
    lines = [
        *heading(files),
        commented(0, "campaign: 1", "version of this file's form"),
        f"scenario: {flow(scenario)}",
        commented(0, f"managers: {flow(names)}", where),
        commented(0, f"runs: {runs}", where),
    ]
    if settings.random_seed is not None:
        lines.append(commented(0, f"seed: {settings.random_seed}", _source(runner["random_seed"])))
    if settings.random_interval is not None:
        interval = runner["random_interval"]
        if perturbations:
            lines.append(commented(0, f"runs_per_draw: {settings.random_interval}", _source(interval)))
        else:
            notes.append(f"{interval.place}: no counterpart: nothing is drawn at random")
    if perturbations:
        lines.append(commented(0, "perturbations:", "drawn at random, the same for every manager"))
    for each in perturbations:
        drawn = {"distribution": "uniform", "minimum": each.minimum, "maximum": each.maximum}
        lines += [f"  # {one_line(each.comment)}", f"  {each.path}: {flow(drawn)}"]
    return "\n".join(lines) + "\n"


def _source(parameter: Parameter) -> str:
    return f"{parameter.source}: {parameter.key}"


def _checked(runner: Mapping[str, Parameter]) -> _Runner:
    node = runner["experiments"].node
    data = {node: {key: parameter.value for key, parameter in runner.items()}}
    places: dict[KeyPath, Location] = {}
    for key, parameter in runner.items():
        for path, line in parameter.document.lines.items():
            if path[:3] == parameter.key_path:
                places[(node, key, *path[3:])] = Location(0, line, parameter.document.path)
    try:
        return _NODES.validate_python(data)[node]
    except ValidationError as error:
        raise input_error(error, Layer(data, places), dict[str, _Runner]) from None


def _experiments(
    parameter: Parameter, experiments: Sequence[_Experiment], known: Collection[str], notes: list[str]
) -> tuple[list[str], int]:
    """Managers, and runs for each."""
    runs: dict[str, int] = {}
    for index, experiment in enumerate(experiments):
        line = parameter.document.line((*parameter.key_path, index))
        place = f"{parameter.document.path}: line {line}, {parameter.keys}[{index}]"
        for key in _json_object(parameter.value[index]):
            if key not in _Experiment.model_fields:
                reason = _EXPERIMENT_KEYS.get(key, "not taken over: unknown key")
                notes.append(f"{place}.{' '.join(key.split())}: {reason}")
        manager, number = experiment.adaptation_manager, experiment.num_runs
        if manager not in known:
            hint = did_you_mean(manager, known)
            notes.append(f"{place}: not taken over: there is no manager {shown(manager)} ({hint})")
            continue
        if manager in runs:
            reason = "is there already, and a campaign has one mission for each manager"
            notes.append(f"{place}: not taken over: {manager} {reason}")
        runs[manager] = max(runs.get(manager, 0), number)
    if not runs:
        raise parameter.error("none of its managers can be run", f"known: {', '.join(known)}")
    most = max(runs.values())
    if fewer := [f"{manager} {number}" for manager, number in runs.items() if number < most]:
        notes.append(
            f"{parameter.place}: every manager gets {most} runs, where fewer were asked for ({', '.join(fewer)});"
            " the first ones are the same"
        )
    return list(runs), most


def _perturbations(
    runner: Mapping[str, Parameter], settings: _Runner, loaded: LoadedScenario, notes: list[str]
) -> Iterator[_Perturbation]:
    """What is drawn at random: a value with its interval added."""
    for key, path in NODES[RUNNER].parameters.items():
        given: tuple[float, float] | None = getattr(settings, key + _INTERVAL)
        if given is None:
            continue
        interval, (low, high) = runner[key + _INTERVAL], given
        if low > high:
            raise interval.error(f"{shown(interval.value)} begins after its end", "give the smaller number first")
        paths = [path]
        if key == "thruster_events":
            paths = [f"{path}.{index}.time_s" for index in range(len(loaded.scenario.thruster_events))]
            if not paths:
                notes.append(f"{interval.place}: no counterpart: there are no thruster events")
        for each in paths:
            around = _NOMINAL[key] if key in _NOMINAL and key not in runner else value_at(loaded, each)
            if not isinstance(around, int | float):
                problem = f"the base scenario draws {each} at random already"
                raise interval.error(problem, f"give {key} a value beside it")
            if low < high:
                comment = f"{_source(interval)} [{low:g}, {high:g}] added to {around:g}"
                yield _Perturbation(each, around + low, around + high, comment)
