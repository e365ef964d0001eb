"""Import of the exemplar's own configuration files as a scenario, and as a campaign if one is configured."""

from __future__ import annotations

import json
import os
import random
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import AfterValidator, BaseModel, Field, Json

from suave_des.domain import WATER_VISIBILITY
from suave_des.errors import InputError, KeyPath, did_you_mean, number_of, shown
from suave_des.resources import find, shipped_folder
from suave_des.scenario.exemplar import (
    CAMPAIGN,
    DRAWN,
    EXPERIMENT,
    KEYS,
    LAUNCH,
    NEWEST,
    NODES,
    PERTURBED,
    REASONER,
    REVISIONS,
    RUNNER,
    node_of,
    path_of,
    read_by,
    read_instead,
    revision_of,
)
from suave_des.scenario.loader import LoadedScenario, load_scenario, value_at
from suave_des.scenario.models import Scenario
from suave_des.scenario.modes import modes_of
from suave_des.scenario.quantities import LONGEST_S, Real, ordered
from suave_des.scenario.schema import validated
from suave_des.scenario.yamlfile import Layer, Location, YamlDocument, read_yaml

PARAMETERS = "ros__parameters"
EXTENDED = "suave_extended"
"""Name of the exemplar's mission with recharging."""
TREES = {"suave_bt": "bt", "suave_bt_extended": "bt_extended"}
"""Manager by the name of the behaviour tree's executable."""
_VISIBILITY = "signals.water_visibility."
_SHIFT = f"{_VISIBILITY}shift_s"
_NO_COSINE = "the visibility of the base is no cosine"


@dataclass(frozen=True)
class Imported:
    """The exemplar's configuration in our form.

    Attributes:
        loaded: the scenario.
        base: name or path of the scenario that it builds on.
        why: the reason for its revision.
        scenario: text of its file.
        campaign: text of the campaign file; None if none was requested.
        notes: a line for each parameter that has no counterpart or was changed.
    """

    loaded: LoadedScenario
    base: str
    why: str
    scenario: str
    campaign: str | None
    notes: tuple[str, ...]


def import_config(
    files: Sequence[Path | YamlDocument],
    out: Path,
    *,
    managers: Collection[str],
    base: str | None = None,
    revision: str | None = None,
    campaign: Path | None = None,
    runner_seed: int | None = None,
) -> Imported:
    """Convert mission, campaign and System Modes files of the exemplar. Nothing is written.

    Args:
        files: the exemplar's files, in any order; any revision's.
        out: path of the scenario to be, which determines how it names other files.
        managers: names of the managers that can be run.
        base: scenario to build on; None: the shipped one of the files' revision.
        revision: which the files are read as; None: the base's, or the only one that they fit.
        campaign: path of the campaign to be; None: no campaign is imported.
        runner_seed: of the exemplar's own draws, which become the campaign's conditions; None: values are drawn anew.

    Raises:
        InputError: a file cannot be read or is none of these, two contradict one another, they fit several revisions,
            or a value cannot be right.
    """
    notes: list[str] = []
    documents = [each if isinstance(each, YamlDocument) else read_yaml(each) for each in files]
    parameters, modes = _parameters(documents, notes)
    runner = _runner(parameters)
    if campaign is None and runner_seed is not None:
        problem = "the draws of the exemplar's runner are conditions of a campaign"
        raise InputError(problem, place="--runner-seed", remedy="add --campaign FILE")
    if campaign is not None and runner is None:
        remedy = "give the campaign's configuration too, or leave --campaign out"
        raise InputError(f"there is no campaign to import: no node {RUNNER} in the files", remedy=remedy)
    experiments = [] if runner is None else list(_experiments(runner, notes))

    of_base = None if base is None else load_scenario(base).scenario.revision.name
    if revision is None and of_base is not None:
        revision = of_base if of_base in REVISIONS else NEWEST
    found = {name for each in parameters for name in (each.entry.removeprefix("/"), f"{each.node}.{each.name}")}
    found |= {word for each in experiments for word in each.launch.split()[2:3]}
    revision, why = revision_of(found, revision)
    base_path = find(base or REVISIONS[revision], "scenarios")
    if base_path.resolve() == out.resolve():
        raise InputError("cannot be its own base", file=out, remedy="give --out another name")
    plain = load_scenario(base_path)
    values = _values(parameters, revision, plain, notes) | _battery_constraint(experiments, notes)
    if of_base is None and plain.scenario.revision.name != revision:
        values["revision"] = Value(revision, why)
    if modes:
        if any(other.sha256 != modes[0].sha256 for other in modes):
            raise InputError("there are two System Modes files", file=modes[-1].path, remedy="give one of them")
        values["modes_file"] = Value(str(modes[0].path.resolve()), "as it is")
    try:
        loaded = load_scenario(base_path, over=_layer(values, base_path))
    except InputError as error:
        raise _in_their_terms(error, values) from None

    mission = None if runner is None else runner.parameters.get("mission_config_file")
    if mission is not None and Path(str(mission.value)).name not in {each.path.name for each in documents}:
        notes.append(f"{mission.place}: not taken over: {shown(mission.value)} is none of the files given")
    text = None
    if campaign is not None and runner is not None:
        content: Entries = {("campaign",): (1, "version of the form"), ("scenario",): (_relative(out, campaign), "")}
        content |= _campaign(runner, experiments, loaded, managers, runner_seed, notes)
        text = _text(documents, content, ())
    elif runner is not None:
        listed = ", ".join(name for name in runner.parameters if path_of(RUNNER, name).startswith(CAMPAIGN))
        notes.append(f"no counterpart in a scenario; --campaign FILE writes a campaign file: {RUNNER}: {listed}")
    is_shipped = base_path.is_relative_to(shipped_folder("scenarios"))
    named = base_path.stem if is_shipped else _relative(base_path, out)
    order = list(Scenario.model_fields)
    content = {("base",): (named, why)}
    for path in sorted(values, key=lambda path: (order.index(path.split(".")[0]), path.split(".")[:-1])):
        value = _relative(modes[0].path, out) if path == "modes_file" else values[path].value
        content[tuple(path.split("."))] = (value, values[path].comment)
    return Imported(loaded, named, why, _text(documents, content, notes), text, tuple(notes))


# The files.


@dataclass(frozen=True)
class Parameter:
    """A parameter in one of the user's files.

    Attributes:
        document: the file.
        entry: the node as it is written there.
        name: of the parameter.
        value: plain data.
        node: as in the table of keys; empty if it is none of them.
    """

    document: YamlDocument
    entry: str
    name: str
    value: Any
    node: str

    @property
    def key_path(self) -> KeyPath:
        """Key path in its file."""
        return (self.entry, PARAMETERS, self.name)

    @property
    def keys(self) -> str:
        """Node and parameter, for the user."""
        return f"{self.entry.removeprefix('/')}.{self.name}"

    @property
    def place(self) -> str:
        """File, line, node and parameter, for the user."""
        return f"{self.document.path}: line {self.document.place(self.key_path).line}, {self.keys}"

    @property
    def source(self) -> str:
        """File and line, for a comment."""
        return f"{self.document.path.name}, line {self.document.place(self.key_path).line}"


def _parameters(documents: Sequence[YamlDocument], notes: list[str]) -> tuple[list[Parameter], list[YamlDocument]]:
    """The parameters of known nodes, file by file, and the System Modes files; notes about the rest."""
    parameters, modes = list[Parameter](), list[YamlDocument]()
    for document in documents:
        contents = [each.get(PARAMETERS) for each in document.data.values() if isinstance(each, dict)]
        if any(isinstance(each, dict) and each.get("type") in ("system", "node") for each in contents):
            modes_of(document)
            modes.append(document)
            continue
        is_ours = False
        for entry, content in document.data.items():
            if not isinstance(content, dict) or not isinstance(content.get(PARAMETERS, ""), dict | None):
                remedy = f"a configuration of the exemplar has NODE: {{{PARAMETERS}: {{KEY: VALUE}}}}"
                raise document.error(f"{entry} has no mapping {PARAMETERS}", (entry,), remedy)
            given = content[PARAMETERS] or {}
            found = [Parameter(document, entry, name, given[name], node_of(entry, given, name)) for name in given]
            parameters += [_events(each, notes) for each in found if each.node]
            place = f"{document.path}: line {document.place((entry,)).line}, {entry.removeprefix('/')}"
            if beside := [other for other in content if other != PARAMETERS]:
                notes.append(f"{place}: not taken over: {', '.join(beside)}: ROS 2 reads {PARAMETERS} alone")
            if any(each.node for each in found) or (not found and node_of(entry, given, "")):
                is_ours = True
                continue
            remedy = did_you_mean(entry.removeprefix("/"), NODES)
            notes.append(f"{place}: not taken over: {', '.join(given)}: the node is not known ({remedy})")
        if not is_ours:
            first = next(iter(document.data), "")
            remedy = did_you_mean(first.removeprefix("/"), NODES, "its nodes")
            raise document.error("has nothing of SUAVE in it", (first,), remedy)
    return parameters, modes


_NEGATIVE_TIME = re.compile(r",-[^,]*\)$")


def _events(parameter: Parameter, notes: list[str]) -> Parameter:
    """The same with thruster events without spaces; those before the start are at the start, as there."""
    if parameter.name != "thruster_events" or not isinstance(parameter.value, list):
        return parameter
    events = ["".join(each.split()) if isinstance(each, str) else each for each in parameter.value]
    events = [each for each in events if each != ""]  # as ROS 2 writes a list without entries
    for index, event in enumerate(events):
        if isinstance(event, str) and _NEGATIVE_TIME.search(event):
            notes.append(f"{parameter.place}[{index}]: {event} is before the start, and happens at 0 s")
            events[index] = _NEGATIVE_TIME.sub(",0)", event)
    return replace(parameter, value=events)


# The scenario's values.


class Value(NamedTuple):
    """A value of the scenario, where it comes from, and its parameter; None: it is a default."""

    value: Any
    comment: str
    parameter: Parameter | None = None


def _values(parameters: Sequence[Parameter], revision: str, base: LoadedScenario, notes: list[str]) -> dict[str, Value]:
    """The values that a mission has, by the scenario's key path; notes about those that are not imported.

    Raises:
        InputError: two parameters contradict one another.
    """
    found, unneeded = dict[str, Parameter](), list[str]()
    has_runner = any(each.node == RUNNER for each in parameters)
    for parameter in sorted(parameters, key=lambda each: each.node != RUNNER):
        path, read = read_instead(parameter.node, parameter.name, revision)
        if path is None:
            remedy = did_you_mean(parameter.name, [key.name for key in KEYS if key.node == parameter.node])
            notes.append(f"{parameter.place}: not taken over: unknown key ({remedy})")
        elif not path:
            unneeded.append(f"{parameter.keys} ({parameter.source})")
        elif read is not None:
            notes.append(f"{parameter.place}: not taken over: revision {revision} reads {read}")
        elif path == _SHIFT and has_runner and parameter.node != RUNNER:
            notes.append(f"{parameter.place}: not taken over: {RUNNER} gives each mission its own; without one, 0")
        elif not path.startswith(CAMPAIGN):
            other = found.setdefault(path, parameter)
            if other is parameter or other.value == parameter.value:
                continue
            if other.node != RUNNER or parameter.node == RUNNER:
                problem, place = f"contradicts {other.place}", parameter.place.partition(": ")[2]
                remedy = "make them alike, or leave one of them out"
                raise InputError(problem, file=parameter.document.path, place=place, remedy=remedy)
            notes.append(f"{parameter.place}: not taken over: the campaign's value counts ({other.place})")
    if unneeded:
        notes.append(f"no counterpart here, and none needed: {', '.join(unneeded)}")
    values = {path: Value(each.value, f"{each.source}: {each.keys}", each) for path, each in found.items()}

    has_mission = any(each.node not in (RUNNER, REASONER) for each in parameters)
    omitted: dict[str, list[str]] = {}
    for key in read_by(revision):
        if key.default is None or key.path in values or not (has_mission or (has_runner and key.node == RUNNER)):
            continue
        if has_runner and key.path == _SHIFT and key.node != RUNNER:
            continue
        omitted.setdefault(key.node, []).append(key.name)
        if at(base, key.path) != key.default:
            values[key.path] = Value(key.default, f"default of {key.node}.{key.name}")
    if omitted:
        listed = "; ".join(f"{node}: {', '.join(names)}" for node, names in omitted.items())
        notes.append(f"not in the files, so at the defaults of the exemplar's nodes: {listed}")
    if base.scenario.signals[WATER_VISIBILITY].kind == "sinusoid":
        return values
    if has_mission:
        return {f"{_VISIBILITY}kind": Value("sinusoid", "as water_visibility_observer_node has it"), **values}
    if _SHIFT in found:
        notes.append(f"{found[_SHIFT].place}: not taken over: {_NO_COSINE}")
    return {path: each for path, each in values.items() if path != _SHIFT}


def at(loaded: LoadedScenario, path: str) -> Any:
    """The value at a key path; None if the scenario has no such part."""
    try:
        return value_at(loaded, path)
    except InputError:
        return None


def _layer(values: Mapping[str, Value], base: Path) -> Layer:
    """The values as the content of a scenario, each with its place in the user's files."""
    data: dict[str, Any] = {}
    places: dict[KeyPath, Location] = {(): Location(0, 1, base)}
    for name, (value, _, parameter) in values.items():
        *parents, last = path = tuple(name.split("."))
        here = data
        for key in parents:
            here = here.setdefault(key, {})
        here[last] = value
        if parameter is not None:
            places[path] = parameter.document.place(parameter.key_path)
            for index in range(len(value) if isinstance(value, list) else 0):
                places[(*path, index)] = parameter.document.place((*parameter.key_path, index))
    return Layer(data, places)


def _in_their_terms(error: InputError, values: Mapping[str, Value]) -> InputError:
    """Return the same error with node and parameter instead of the key path, if it is about a value of the files."""
    line, _, here = (error.place or "").partition(", ")
    for path, (_, _, parameter) in values.items():
        is_about_it = here == path or here.startswith((f"{path}.", f"{path}["))
        if is_about_it and parameter is not None and error.file == str(parameter.document.path):
            place = f"{line}, {parameter.keys}{here.removeprefix(path)}"
            return InputError(error.problem, file=error.file, place=place, remedy=error.remedy)
    return error


# The campaign.


def _ordered(interval: tuple[float, float]) -> tuple[float, float]:
    ordered(*interval, "the beginning", "the end")
    return interval


_Limit = Annotated[Real, Field(ge=-LONGEST_S, le=LONGEST_S)]
_Interval = Annotated[tuple[_Limit, _Limit], AfterValidator(_ordered)]
_Count = Annotated[int, Field(strict=True, ge=1)]


class _Experiment(BaseModel):
    adaptation_manager: Annotated[str, Field(min_length=1)]
    num_runs: _Count
    mission_name: str = ""
    experiment_launch: str = ""


class _RunnerSettings(BaseModel):
    experiments: Annotated[tuple[Json[_Experiment], ...], Field(min_length=1)]
    random_interval: _Count = 5
    random_seed: Annotated[int, Field(strict=True, ge=0, le=2**63 - 1)] = 100
    water_visibility_sec_shift_random_interval: _Interval = (0.0, 0.0)
    initial_pos_x_random_interval: _Interval = (0.0, 0.0)
    initial_pos_y_random_interval: _Interval = (0.0, 0.0)
    initial_pos_z_random_interval: _Interval = (0.0, 0.0)
    thruster_events_random_interval: _Interval = (0.0, 0.0)


class Runner(NamedTuple):
    """The runner's parameters by name, and those that only a campaign has, checked."""

    parameters: Mapping[str, Parameter]
    settings: _RunnerSettings

    def comment(self, name: str) -> str:
        """Where a value comes from."""
        given = self.parameters.get(name)
        return f"default of {RUNNER}.{name}" if given is None else f"{given.source}: {name}"


def _runner(parameters: Sequence[Parameter]) -> Runner | None:
    """The runner, if there is one.

    Raises:
        InputError: a value is impossible, or it has no experiments.
    """
    found = {each.name: each for each in parameters if each.node == RUNNER}
    if not found:
        return None
    document, entry = next((each.document, each.entry) for each in found.values())
    return Runner(found, validated(document.below(entry).below(PARAMETERS), _RunnerSettings))


class Experiment(NamedTuple):
    """Missions of one manager.

    Attributes:
        place: for the user.
        manager: the manager's name here.
        runs: number of missions.
        launch: the command that launches them.
        level: of the battery below which they are aborted; None: they go on.
    """

    place: str
    manager: str
    runs: int
    launch: str
    level: float | None


def _experiments(runner: Runner, notes: list[str]) -> Iterator[Experiment]:
    """The experiments, each by its own launch and mission; notes about what is not simulated."""
    parameter = runner.parameters["experiments"]
    for index, each in enumerate(runner.settings.experiments):
        line, launch = parameter.document.place((*parameter.key_path, index)).line, each.experiment_launch
        place = f"{parameter.document.path}: line {line}, {parameter.keys}[{index}]"
        arguments = dict(re.findall(r"(\w+):=(\S*)", launch))
        for node, names in ((EXPERIMENT, json.loads(parameter.value[index])), (LAUNCH, arguments)):
            unknown = [" ".join(name.split()) for name in names if path_of(node, name, "?") == "?"]
            notes += [f"{place}: not simulated: {name}: {shown(names.get(name))}" for name in unknown]
        manager = arguments.get("adaptation_manager", each.adaptation_manager)
        if manager != each.adaptation_manager:
            notes.append(f"{place}: its launch starts {manager}, and not {each.adaptation_manager}")
        missions = [each.mission_name, *(arguments.get(name) for name in ("mission_name", "mission", "mission_type"))]
        is_extended = EXTENDED in missions or "extended" in "".join(launch.split()[3:4])
        if manager == "bt":
            executable = arguments.get("bt_executable", "suave_bt_extended" if is_extended else "suave_bt")
            manager = TREES.get(executable, executable)
        elif is_extended:
            notes.append(f"{place}: not simulated: the mission {EXTENDED} under {manager}, which flies suave here")
        level: float | None = None
        if arguments.get("battery_constraint", "").lower() == "true":
            try:
                level = float(arguments["battery_constraint_value"])
            except (KeyError, ValueError):
                notes.append(f"{place}: not taken over: battery_constraint without a number as its value")
        yield Experiment(place, manager, each.num_runs, launch, level)


def _battery_constraint(experiments: Sequence[Experiment], notes: list[str]) -> dict[str, Value]:
    """The level below which missions are aborted; a campaign has one for all managers."""
    levels = {each.level for each in experiments}
    if len(levels) == 1 and (level := levels.pop()) is not None:
        return {"battery.mission_ends_at_level": Value(level, "battery_constraint_value")} if level > 0 else {}
    why = "not all experiments have it; import this one from a file of its own"
    given = [each for each in experiments if each.level is not None]
    notes += [f"{each.place}: not taken over: battery_constraint_value {each.level:g}: {why}" for each in given]
    return {}


Entries = dict[tuple[str, ...], tuple[Any, str]]
"""Values with their comments by key path, as lines of a YAML file."""


def _campaign(
    runner: Runner,
    experiments: Sequence[Experiment],
    loaded: LoadedScenario,
    known: Collection[str],
    runner_seed: int | None,
    notes: list[str],
) -> Entries:
    """The runner's parameters as content of a campaign file.

    Raises:
        InputError: there is nothing to run.
    """
    runs, shared = dict[str, int](), runner.settings.random_interval
    for place, manager, number, *_ in experiments:
        if manager not in known:
            remedy = did_you_mean(manager, known)
            notes.append(f"{place}: not taken over: there is no manager {shown(manager)} ({remedy})")
            continue
        if manager in runs:
            notes.append(f"{place}: not taken over: {manager} is there already, and a campaign has each manager once")
        runs[manager] = max(runs.get(manager, 0), number)
    if not runs:
        raise InputError("none of its managers can be run", place="experiments", remedy=f"known: {', '.join(known)}")
    most = max(runs.values())
    if fewer := [f"{manager} {number}" for manager, number in runs.items() if number < most]:
        listed = ", ".join(fewer)
        notes.append(
            f"every manager gets {most} runs, although fewer were requested ({listed}); the first are the same"
        )
    drawn = list(_perturbations(runner, loaded, notes))
    where = runner.comment("experiments")
    entries: Entries = {
        ("managers",): (list(runs), where),
        ("runs",): (most, where),
        ("seed",): (runner.settings.random_seed, runner.comment("random_seed")),
    }
    if not drawn:
        notes.append(f"{RUNNER}: nothing is drawn at random: it has no _random_interval with a width")
    elif runner_seed is None:
        entries[("runs_per_draw",)] = (shared, runner.comment("random_interval"))
        for path, _, around, low, high, source in drawn:
            value = {"distribution": "uniform", "minimum": around + low, "maximum": around + high}
            value |= {"shared": "thruster_events_shift"} if path.startswith("thruster_events") else {}
            entries[("perturbations", path)] = (value, source)
    else:
        conditions = -(-most // shared)
        if rest := most % shared:
            last = f"the last of {conditions} conditions has {number_of(rest, 'run')} in the exemplar"
            notes.append(f"--runner-seed: {last}, and {shared} here, like the others")
        stream = random.Random(runner_seed)
        draws = [[stream.random() for _ in DRAWN] for _ in range(conditions)]  # of all, of empty intervals, too
        entries[("runs",)] = (min(most, shared), f"{where}; at each of the conditions")
        for path, number, around, low, high, source in drawn:
            values = [around + (low + (high - low) * draw[number]) for draw in draws]
            values = [max(0.0, value) for value in values] if path.startswith("thruster_events") else values
            entries[("sweep", "zip", path)] = (values, f"{source}, as Python draws from seed {runner_seed}")
    return entries


def _perturbations(
    runner: Runner, loaded: LoadedScenario, notes: list[str]
) -> Iterator[tuple[str, int, float, float, float, str]]:
    """Yield the runner's draws: key path, number in DRAWN, what the interval is added to, its ends, and its source."""
    for number, key in enumerate(DRAWN):
        low, high = getattr(runner.settings, key.name)
        if (low, high) == (0.0, 0.0):
            if key.name in runner.parameters:
                notes.append(f"{runner.parameters[key.name].place}: nothing is drawn from [0, 0]")
            continue
        path = key.path.removeprefix(PERTURBED)
        paths = [path]
        if path == "thruster_events":
            events = loaded.scenario.thruster_events if path in runner.parameters else ()
            paths = [f"{path}.{index}.time_s" for index in range(len(events))]
            if not paths:
                notes.append(f"{runner.parameters[key.name].place}: shifts nothing: {RUNNER} has no {path}")
        for each in paths:
            if (around := at(loaded, each)) is None:
                notes.append(f"{runner.parameters[key.name].place}: not taken over: {_NO_COSINE}")
                continue
            source = f"{runner.comment(key.name)} [{low:g}, {high:g}] added to {around:g}"
            yield each, number, around, low, high, source


# YAML with comments that name the source of each value.

_COMMENT_COLUMN = 43
_WORDS = ("true", "false", "null", "yes", "no", "on", "off")


def _text(documents: Sequence[YamlDocument], entries: Entries, notes: Sequence[str]) -> str:
    """A YAML file of these entries."""
    names = ", ".join(each.path.name for each in documents)
    lines, above = [f"# Imported by `suave-des import-config` from {names}."], tuple[str, ...]()
    for path, (value, comment) in entries.items():
        for depth, key in enumerate(path[:-1]):
            if above[: depth + 1] != path[: depth + 1]:
                lines.append(f"{'  ' * depth}{key}:")
        above = path
        line = f"{'  ' * (len(path) - 1)}{path[-1]}: {_flow(value)}"
        lines.append(f"{line:<{_COMMENT_COLUMN}} # {comment}" if comment else line)
    lines += ["", "# About the files:", *(f"#   {note}" for note in notes)] if notes else []
    # No line ends, and no characters that YAML does not allow, from names in the user's files.
    return "".join("".join(char if char.isprintable() else "?" for char in line) + "\n" for line in lines)


def _flow(value: Any) -> str:
    """A value in YAML's flow style."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_flow(key)}: {_flow(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    if isinstance(value, str) and re.fullmatch(r"[A-Za-z][\w./-]*", value, re.ASCII) and value.lower() not in _WORDS:
        return value  # plain, where YAML of any version reads just that text
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return json.dumps(value)


def _relative(path: Path, file: Path) -> str:
    """How a file names another: relative to its own folder."""
    return Path(os.path.relpath(path.resolve(), file.resolve().parent)).as_posix()
