"""The exemplar's campaign configuration (revision 1.5, node suave_runner_node) as a campaign of ours."""

from __future__ import annotations

import json
import random
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, Field, TypeAdapter, ValidationError

from suave_des.errors import InputError, KeyPath, did_you_mean, number_of, shown
from suave_des.scenario.exemplar.files import (
    NODES,
    NOT_NEEDED,
    RUNNER,
    Configuration,
    Count,
    Experiment,
    Experiments,
    ImportOptions,
    Parameter,
    json_object,
    unknown_key,
)
from suave_des.scenario.loader import LoadedScenario, value_at
from suave_des.scenario.problems import input_error
from suave_des.scenario.quantities import LONGEST_S, Real, Within, wrong
from suave_des.scenario.yamlfile import Layer, Location

_INTERVAL = "_random_interval"
_NOMINAL = {"initial_pos_x": -17.0, "initial_pos_y": 2.0}
"""Where the exemplar starts unless it is configured otherwise."""
_DRAWN_IN_ORDER = ("initial_pos_x", "initial_pos_y", "", "water_visibility_sec_shift", "thruster_events")
"""What the exemplar's runner draws, one after the other; the third is always zero."""
_EVENTS_SHIFT = "thruster_events_shift"
"""Name of the draw that all thruster events share."""


def _interval(value: Any) -> Any:
    if not isinstance(value, list) or len(value) != 2:
        raise wrong(f"{shown(value)} is not an interval", "give two numbers, as in [-1.0, 1.0]")
    return value


_Limit = Annotated[Real, Within(-LONGEST_S, LONGEST_S)]
_Interval = Annotated[tuple[_Limit, _Limit], BeforeValidator(_interval)]


class _Runner(BaseModel):
    """Parameters of the node that only a campaign has."""

    experiments: Annotated[Experiments, Field(min_length=1)]
    mission_config_file: Any = None
    random_interval: Count = 5
    random_seed: Annotated[int, Field(strict=True), Within(0, 2**63 - 1)] = 100
    water_visibility_sec_shift_random_interval: _Interval | None = None
    initial_pos_x_random_interval: _Interval | None = None
    initial_pos_y_random_interval: _Interval | None = None
    thruster_events_random_interval: _Interval | None = None


_NODES = TypeAdapter(dict[str, _Runner])


@dataclass(frozen=True)
class _Perturbation:
    """A value that is drawn uniformly, once for each draw.

    Attributes:
        key: of the runner, without the ending of its interval.
        path: key path of the scenario.
        around: what the draw is added to.
        low, high: ends of the interval.
        comment: where they come from.
    """

    key: str
    path: str
    around: float
    low: float
    high: float
    comment: str

    def line(self) -> str:
        """Return it as a line of a campaign file."""
        drawn: dict[str, Any] = {"distribution": "uniform"}
        drawn |= {"minimum": self.around + self.low, "maximum": self.around + self.high}
        if self.key == "thruster_events":
            drawn["shared"] = _EVENTS_SHIFT
        return f"  {self.path}: {flow(drawn)}"


def campaign_text(
    configuration: Configuration, loaded: LoadedScenario, scenario: str, options: ImportOptions, notes: list[str]
) -> str:
    """The campaign file for the runner's parameters.

    Args:
        configuration: with the runner's parameters.
        loaded: the imported scenario.
        scenario: how the campaign file names it.
        options: of the import.
        notes: receives a line for each key without a counterpart.

    Raises:
        InputError: a value is impossible, or there is nothing to run.
    """
    runner = configuration.runner
    known = (*NODES[RUNNER], *_Runner.model_fields)
    notes += [unknown_key(parameter, known) for key, parameter in runner.items() if key not in (*known, *NOT_NEEDED)]
    if "experiments" not in runner:
        raise InputError(f"{RUNNER} has no experiments", remedy="add them: they name the managers to run")
    settings = _checked(runner)
    mission = runner.get("mission_config_file")
    if mission is not None and PurePath(str(mission.value)).name not in configuration.files:
        notes.append(f"{mission.place}: not taken over: {shown(mission.value)} is none of the files given")
    names, runs = _experiments(configuration, settings.experiments, options.managers, notes)
    perturbations = list(_perturbations(runner, settings, loaded, notes))
    if not perturbations and "random_interval" in runner:
        notes.append(f"{runner['random_interval'].place}: no counterpart: nothing is drawn at random")
    if options.runner_seed is not None:
        varied = _conditions(perturbations, settings, runs, options.runner_seed, notes)
        runs = min(runs, settings.random_interval) if perturbations else runs
    else:
        varied = _drawn_anew(perturbations, settings.random_interval, _comment("random_interval", runner))
    where = _source(runner["experiments"])
    lines = [
        *heading(configuration.files),
        commented(0, "campaign: 1", "version of this file's form"),
        f"scenario: {flow(scenario)}",
        commented(0, f"managers: {flow(names)}", where),
        commented(0, f"runs: {runs}", where if options.runner_seed is None else f"{where}; at each of the conditions"),
        commented(0, f"seed: {settings.random_seed}", _comment("random_seed", runner)),
        *varied,
    ]
    return "\n".join(lines) + "\n"


def _comment(key: str, runner: Mapping[str, Parameter]) -> str:
    """The source of a value, or that it is the runner's default."""
    return _source(runner[key]) if key in runner else f"default of {RUNNER}.{key}"


def _drawn_anew(perturbations: Sequence[_Perturbation], runs_per_draw: int, comment: str) -> Iterator[str]:
    if perturbations:
        yield commented(0, f"runs_per_draw: {runs_per_draw}", comment)
        yield commented(0, "perturbations:", "drawn at random, the same for every manager")
    for each in perturbations:
        yield f"  # {one_line(each.comment)}"
        yield each.line()


def _conditions(
    perturbations: Sequence[_Perturbation], settings: _Runner, runs: int, seed: int, notes: list[str]
) -> Iterator[str]:
    """The exact values that the exemplar's runner draws, as lines of a campaign file.

    Every `random_interval` runs it draws all of _DRAWN_IN_ORDER, even from empty intervals; the same for all managers.
    """
    stream = random.Random(seed)
    blocks = -(-runs // settings.random_interval)
    draws = [[stream.random() for _ in _DRAWN_IN_ORDER] for _ in range(blocks)]
    if not perturbations:
        notes.append(f"--runner-seed: nothing is drawn at random: {RUNNER} has no {_INTERVAL.lstrip('_')} with a width")
        return iter(())
    if rest := runs % settings.random_interval:
        notes.append(
            f"--runner-seed: the last of {blocks} conditions has {number_of(rest, 'run')} in the exemplar, and"
            f" {settings.random_interval} here, like the others"
        )
    lines = [
        commented(0, "sweep:", f"as Python's random draws them from seed {seed}: {blocks} conditions,"),
        commented(1, "zip:", "the first values together, then the second"),
    ]
    for each in perturbations:
        place = _DRAWN_IN_ORDER.index(each.key)
        values = [each.around + (each.low + (each.high - each.low) * draw[place]) for draw in draws]
        values = [max(0.0, value) for value in values] if each.key == "thruster_events" else values
        lines += [f"    # {one_line(each.comment)}", f"    {each.path}: {flow(values)}"]
    return iter(lines)


def _source(parameter: Parameter) -> str:
    return f"{parameter.source}: {parameter.key}"


def _checked(runner: Mapping[str, Parameter]) -> _Runner:
    node = runner["experiments"].node
    data = {node: {key: parameter.value for key, parameter in runner.items()}}
    places: dict[KeyPath, Location] = {}
    for key, parameter in runner.items():
        for path, place in parameter.document.places.items():
            if path[:3] == parameter.key_path:
                places[(node, key, *path[3:])] = place
    try:
        return _NODES.validate_python(data)[node]
    except ValidationError as error:
        raise input_error(error, Layer(data, places), dict[str, _Runner]) from None


def _experiments(
    configuration: Configuration, experiments: Sequence[Experiment], known: Collection[str], notes: list[str]
) -> tuple[list[str], int]:
    """Managers, and runs for each."""
    parameter, runs = configuration.runner["experiments"], dict[str, int]()
    for index, experiment in enumerate(experiments):
        line = parameter.document.line((*parameter.key_path, index))
        place = f"{parameter.document.path}: line {line}, {parameter.keys}[{index}]"
        for key in json_object(parameter.value[index]):
            if key not in Experiment.model_fields:
                notes.append(f"{place}.{' '.join(key.split())}: not taken over: unknown key")
        manager, number = experiment.manager(extended=configuration.is_extended), experiment.num_runs
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
            f"{parameter.place}: every manager gets {most} runs, although fewer were requested ({', '.join(fewer)});"
            " the first ones are the same"
        )
    return list(runs), most


def _perturbations(
    runner: Mapping[str, Parameter], settings: _Runner, loaded: LoadedScenario, notes: list[str]
) -> Iterator[_Perturbation]:
    """The random draws: a value with its interval added."""
    for key, path in NODES[RUNNER].items():
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
                yield _Perturbation(key, each, around, low, high, comment)


# YAML with comments that name the source of each value.

_COMMENT_COLUMN = 43
_WORDS = ("true", "false", "null", "yes", "no", "on", "off")


def heading(files: Sequence[str]) -> Iterator[str]:
    """The first line of an imported file."""
    yield f"# Imported by `suave-des import-config` from {one_line(', '.join(files))}."


def commented(depth: int, text: str, comment: str) -> str:
    """A line at a depth of nested mappings, with a comment."""
    return f"{'  ' * depth + text:<{_COMMENT_COLUMN}} # {one_line(comment)}"


def one_line(text: str) -> str:
    """A text for a comment: without line ends and characters that YAML does not allow."""
    return "".join(char if char.isprintable() else "?" for char in text)


def flow(value: Any) -> str:
    """A value in YAML's flow style."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{flow(key)}: {flow(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, str):
        # Plain where YAML of any version reads just that text.
        plain = value.isascii() and value[:1].isalpha() and value.lower() not in _WORDS
        return value if plain and all(char.isalnum() or char in "_-./" for char in value) else json.dumps(value)
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return json.dumps(value)
