"""The exemplar's own configuration files: their import as a scenario and a campaign, and the way
back.

The table of their keys, exemplar_keys.csv, says which revisions read each, what it is here, and its
default; the page docs/reference/exemplar-files.md shows it. Source: kas-lab/suave (Apache-2.0) at
the tags v1.2.1, v1.3.0, v1.4.0 and v1.5.0; `2023` made the published runs, `2025` is d5e97be. What
the code of 1.2 to 1.4 does otherwise was not read: there it counts as 1.5's.
"""

from __future__ import annotations

import csv
import json
import os
import random
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import yaml
from pydantic import AfterValidator, BaseModel, Field, Json

from suave_des.domain import WATER_VISIBILITY
from suave_des.errors import InputError, KeyPath, did_you_mean, number_of, shown, unknown
from suave_des.scenario.loader import LoadedScenario, load_scenario, value_at, with_values
from suave_des.scenario.models import LONGEST_S, Real, Scenario, in_order, mean
from suave_des.scenario.modes import modes_of
from suave_des.scenario.yamlfile import Layer, Location, parse_yaml, read_yaml, validated

RUNNER, REASONER, LAUNCH, EXPERIMENT = (
    "suave_runner_node",
    "reasoner",
    "experiment_launch",
    "experiments[]",
)
"""A campaign's node; any node with a reasoning_period; arguments NAME:=VALUE of a launch; keys of
an experiment.
"""
CAMPAIGN = "campaign."
"""Begins what is a key of a campaign file here, and not of a scenario."""
REVISIONS: Mapping[str, str] = {
    "2023": "seams2023",
    "1.2": "release15",
    "1.3": "release15",
    "1.4": "release15",
    "2025": "planta_exp1",
    "1.5": "release15",
}
"""Shipped scenario that an import builds on, by revision, the oldest first."""
_ORDER = tuple(REVISIONS)
OLDEST, NEWEST = _ORDER[0], _ORDER[-1]
FIRST_WITH_RUNNER, FIRST_WITH_BRINGUP = "1.4", "1.5"


def is_since(revision: str, first: str) -> bool:
    """Whether a revision is another one or came after it."""
    return _ORDER.index(revision) >= _ORDER.index(first)


class Key(NamedTuple):
    """A parameter of a node, or a key of an experiment.

    Attributes:
        path: key path of the scenario, or of the campaign file after CAMPAIGN; empty: nothing here
            corresponds to it.
        default: of the exemplar's code, None if there is none or it is not known; its type is the
            parameter's in ROS 2.
        since, until: first and last revision whose code reads it.
    """

    node: str
    name: str
    path: str
    default: Any
    meaning: str
    since: str
    until: str

    def is_read_by(self, revision: str) -> bool:
        """Whether the code of a revision reads it."""
        return is_since(revision, self.since) and is_since(self.until, revision)


_TABLE, _REVISIONS_TABLE = (
    [*csv.DictReader(Path(__file__).with_name(name).read_text(encoding="utf-8").splitlines())]
    for name in ("exemplar_keys.csv", "exemplar_revisions.csv")
)
KEYS = tuple(Key(**{**row, "default": json.loads(row["default"] or "null")}) for row in _TABLE)
"""The table; the runner gives its parameters to each mission, and draws from its intervals in this
order.
"""
PATHS = {(key.node, key.name): key.path for key in reversed(KEYS)}
"""Key path here of each parameter of a node; empty: nothing here corresponds to it."""
PERTURBED = f"{CAMPAIGN}perturbations."
DRAWN = tuple(key for key in KEYS if key.path.startswith(PERTURBED))
"""The runner's intervals."""
NODES = tuple(
    dict.fromkeys(key.node for key in KEYS if key.node not in (REASONER, LAUNCH, EXPERIMENT))
)
ALIASES = {"parent_mission_node": "mission_node", "random_reasoner_node": "task_bridge"}
"""Other names of nodes; the second is that of 2023."""

_TELLING = {row["name"]: (row["since"], row["until"]) for row in _REVISIONS_TABLE}
"""First and last revision with a node, a parameter, or the package of a launch."""


def revision_of(found: Collection[str], name: str | None) -> tuple[str, str]:
    """Tell which revision files with these nodes, node.parameters and launched packages are of, and
    why.

    Raises:
        InputError: there is none of that name, or the files fit several, or none.
    """
    if name is not None:
        if name in REVISIONS:
            return name, "as requested"
        raise unknown(
            f"there is no revision {shown(name)} of the exemplar",
            name,
            REVISIONS,
            place="--revision",
        )
    fitting, telling = list(_ORDER), ""
    for each, (first, last) in _TELLING.items():
        if each in found:
            left = [
                revision
                for revision in fitting
                if is_since(revision, first) and is_since(last, revision)
            ]
            telling = each if len(left) < len(fitting) else telling
            fitting = left
    if len(fitting) == 1:
        return fitting[0], f"only revision {fitting[0]} has {telling}"
    if not fitting:
        problem = f"no revision of the exemplar has all of {', '.join(each for each in _TELLING if each in found)}"
        raise InputError(problem, remedy="say which it is: --revision")
    problem = (
        f"the files fit revisions {', '.join(fitting)} of the exemplar, which differ in their code"
    )
    raise InputError(problem, remedy=f"say which it is, as in --revision {fitting[-1]}")


def read_by(revision: str) -> tuple[Key, ...]:
    """Return the keys that the code of a revision reads, and that a scenario has."""
    return tuple(
        key
        for key in KEYS
        if key.path and not key.path.startswith(CAMPAIGN) and key.is_read_by(revision)
    )


def node_of(entry: str, given: Collection[str], name: str) -> str:
    """Return the node of the table that an entry of a file is, with these parameters, for one of
    them; or nothing.
    """
    bare = ALIASES.get(entry.removeprefix("/"), entry.removeprefix("/"))
    if bare in ("**", "*"):  # the parameter is given to every node
        return next(
            (key.node for key in KEYS if key.name == name and key.node not in (LAUNCH, EXPERIMENT)),
            "",
        )
    return bare if bare in NODES else REASONER if "reasoning_period" in given else ""


# The import.

PARAMETERS = "ros__parameters"
EXTENDED = "suave_extended"
"""The exemplar's mission with recharging."""
TREES = {"suave_bt": "bt", "suave_bt_extended": "bt_extended"}
"""Manager by the name of the behaviour tree's executable."""
_VISIBILITY = "signals.water_visibility."
_NO_COSINE = "not imported: the visibility of the base is no cosine"


@dataclass(frozen=True)
class Imported:
    """The exemplar's configuration in our form.

    Attributes:
        base: name of the shipped scenario that it builds on.
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
    files: Sequence[Path | Layer],
    out: Path,
    *,
    managers: Collection[str],
    revision: str | None = None,
    campaign: Path | None = None,
    runner_seed: int | None = None,
) -> Imported:
    """Convert mission, campaign and System Modes files of the exemplar. Nothing is written.

    Args:
        files: in any order; any revision's.
        out: path of the scenario to be, which determines how it names other files.
        managers: those that can be run.
        revision: which the files are read as; None: the only one that they fit.
        campaign: path of the campaign to be; None: no campaign is imported.
        runner_seed: of the exemplar's own draws, which become the campaign's conditions; None:
            values are drawn anew.

    Raises:
        InputError: a file cannot be read or is none of these, two contradict one another, they fit
            several revisions, or a value cannot be right.
    """
    notes: list[str] = []
    documents = [each if isinstance(each, Layer) else read_yaml(each) for each in files]
    parameters, modes = _parameters(documents, notes)
    runner = _runner(parameters)
    if campaign is None and runner_seed is not None:
        problem = "the draws of the exemplar's runner are conditions of a campaign"
        raise InputError(problem, place="--runner-seed", remedy="add --campaign FILE")
    if campaign is not None and runner is None:
        remedy = "give the campaign's configuration too, or leave --campaign out"
        raise InputError(
            f"there is no campaign to import: no node {RUNNER} in the files", remedy=remedy
        )
    experiments = [] if runner is None else list(_experiments(runner, notes))

    found = {
        name
        for each in parameters
        for name in (each.entry.removeprefix("/"), f"{each.node}.{each.name}")
    }
    found |= {word for each in experiments for word in each.launch.split()[2:3]}
    revision, why = revision_of(found, revision)
    base = REVISIONS[revision]
    plain = load_scenario(base)
    values = _values(parameters, revision, plain, notes) | _battery_constraint(experiments, notes)
    if plain.scenario.revision.name != revision:
        values["revision"] = Value(revision, why)
    if any(other.data != modes[0].data for other in modes):
        raise InputError(
            "there are two System Modes files", file=modes[-1].path, remedy="give one of them"
        )
    if modes:
        values["modes_file"] = Value(str(modes[0].path.resolve()), "as it is")
    loaded = load_scenario(base, over=_layer(values, plain.path))

    mission = None if runner is None else runner.parameters.get("mission_config_file")
    if mission is not None and Path(str(mission.value)).name not in {
        each.path.name for each in documents
    }:
        notes.append(
            f"{mission.place}: not imported: {shown(mission.value)} is none of the files given"
        )
    text = None
    if campaign is not None and runner is not None:
        content: Entries = {
            ("campaign",): (1, "version of the form"),
            ("scenario",): (_relative(out, campaign), ""),
        }
        content |= _campaign(runner, experiments, loaded, managers, runner_seed, notes)
        text = _text(documents, content, ())
    elif runner is not None:
        listed = ", ".join(
            name for name in runner.parameters if PATHS.get((RUNNER, name), "").startswith(CAMPAIGN)
        )
        notes.append(
            f"not part of a scenario (--campaign FILE writes it to a campaign file): {RUNNER}: {listed}"
        )
    order = list(Scenario.model_fields)
    content = {("base",): (base, why)}
    for path in sorted(
        values, key=lambda path: (order.index(path.split(".")[0]), path.split(".")[:-1])
    ):
        value = _relative(modes[0].path, out) if path == "modes_file" else values[path].value
        content[tuple(path.split("."))] = (value, values[path].comment)
    return Imported(loaded, base, why, _text(documents, content, notes), text, tuple(notes))


# The files.


@dataclass(frozen=True)
class Parameter:
    """A parameter in one of the user's files.

    Attributes:
        entry: the node as it is written in the file.
        node: as in the table of keys; empty if it is none of them.
    """

    document: Layer
    entry: str
    name: str
    value: Any
    node: str

    def line(self, *below: str | int) -> int:
        """The line of its value, or of a part of that."""
        return self.document.place((self.entry, PARAMETERS, self.name, *below)).line

    @property
    def keys(self) -> str:
        """Node and parameter, for the user."""
        return f"{self.entry.removeprefix('/')}.{self.name}"

    @property
    def place(self) -> str:
        """File, line, node and parameter, for the user."""
        return f"{self.document.path}: line {self.line()}, {self.keys}"

    @property
    def source(self) -> str:
        """File and line, for a comment."""
        return f"{self.document.path.name}, line {self.line()}"


def _parameters(
    documents: Sequence[Layer], notes: list[str]
) -> tuple[list[Parameter], list[Layer]]:
    """The parameters of known nodes, file by file, and the System Modes files; notes about the
    rest.
    """
    parameters, modes = list[Parameter](), list[Layer]()
    for document in documents:
        contents = [
            each.get(PARAMETERS) for each in document.data.values() if isinstance(each, dict)
        ]
        if any(
            isinstance(each, dict) and each.get("type") in ("system", "node") for each in contents
        ):
            modes_of(document)
            modes.append(document)
            continue
        is_ours = False
        for entry, content in document.data.items():
            if not isinstance(content, dict) or not isinstance(
                content.get(PARAMETERS, ""), dict | None
            ):
                remedy = (
                    f"a configuration of the exemplar has NODE: {{{PARAMETERS}: {{KEY: VALUE}}}}"
                )
                raise document.error(f"{entry} has no mapping {PARAMETERS}", (entry,), remedy)
            given = content[PARAMETERS] or {}
            nodes = {name: node_of(entry, given, name) for name in given}
            for name in filter(nodes.get, given):
                value = _in_time(given[name]) if name == "thruster_events" else given[name]
                parameters.append(Parameter(document, entry, name, value, nodes[name]))
            place = (
                f"{document.path}: line {document.place((entry,)).line}, {entry.removeprefix('/')}"
            )
            if beside := [other for other in content if other != PARAMETERS]:
                notes.append(
                    f"{place}: not imported: {', '.join(beside)}: ROS 2 reads {PARAMETERS} alone"
                )
            is_known = any(nodes.values()) or (not given and bool(node_of(entry, given, "")))
            is_ours = is_ours or is_known
            if not is_known:
                remedy = did_you_mean(entry.removeprefix("/"), NODES)
                notes.append(
                    f"{place}: not imported: {', '.join(given)}: the node is not known ({remedy})"
                )
        if not is_ours:
            first = next(iter(document.data), "")
            remedy = did_you_mean(first.removeprefix("/"), NODES, "its nodes")
            raise document.error("has nothing of SUAVE in it", (first,), remedy)
    return parameters, modes


def _in_time(events: Any) -> Any:
    """Thruster events without spaces, and without empty ones, as ROS 2 writes an empty list.

    Those before the start are at the start: the exemplar triggers them at its first tick.
    """
    if not isinstance(events, list):
        return events
    texts = ["".join(each.split()) if isinstance(each, str) else each for each in events]
    before = re.compile(r",-[\d.]+(e-?\d+)?\)$")
    return [
        before.sub(",0)", each) if isinstance(each, str) else each for each in texts if each != ""
    ]


# The scenario's values.


class Value(NamedTuple):
    """A value of the scenario, where it comes from, and its parameter; None: it is a default."""

    value: Any
    comment: str
    parameter: Parameter | None = None


def _values(
    parameters: Sequence[Parameter], revision: str, base: LoadedScenario, notes: list[str]
) -> dict[str, Value]:
    """The values that a mission has, by key path, and notes about others; an InputError if two
    contradict.
    """
    found, unneeded = dict[str, Parameter](), list[str]()
    has_runner = any(each.node == RUNNER for each in parameters)
    # The runner passes what has a default to each mission, with or without a value in its file.
    passed = {
        key.path
        for key in read_by(revision)
        if has_runner and key.node == RUNNER and key.default is not None
    }
    read = {(key.node, key.name) for key in KEYS if key.is_read_by(revision)}
    for parameter in sorted(parameters, key=lambda each: each.node != RUNNER):
        path, why = PATHS.get((parameter.node, parameter.name)), None
        if path is None:
            remedy = did_you_mean(
                parameter.name, [key.name for key in KEYS if key.node == parameter.node]
            )
            why = f"unknown key ({remedy})"
        elif not path:
            unneeded.append(f"{parameter.keys} ({parameter.source})")
        elif (parameter.node, parameter.name) not in read:
            instead = (f"{key.node}.{key.name}" for key in read_by(revision) if key.path == path)
            why = f"revision {revision} reads {next(instead, 'nothing of the kind')}"
        elif path in passed and parameter.node != RUNNER:
            why = f"{RUNNER} gives each mission its own; without one, 0"
        elif (
            not path.startswith(CAMPAIGN)
            and (other := found.setdefault(path, parameter)).value != parameter.value
        ):
            if other is not parameter and (other.node != RUNNER or parameter.node == RUNNER):
                problem, place = f"contradicts {other.place}", parameter.place.partition(": ")[2]
                remedy = "make them alike, or leave one of them out"
                raise InputError(problem, file=parameter.document.path, place=place, remedy=remedy)
            why = None if other is parameter else f"the campaign's value counts ({other.place})"
        if why is not None:
            notes.append(f"{parameter.place}: not imported: {why}")
    if unneeded:
        notes.append(f"not needed here: {', '.join(unneeded)}")
    values = {
        path: Value(each.value, f"{each.source}: {each.keys}", each) for path, each in found.items()
    }

    has_mission = any(each.node not in (RUNNER, REASONER) for each in parameters)
    omitted: dict[str, list[str]] = {}
    for key in read_by(revision):
        if (
            key.default is None
            or key.path in values
            or not (has_mission or (has_runner and key.node == RUNNER))
        ):
            continue
        if key.path in passed and key.node != RUNNER:
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
        return {
            f"{_VISIBILITY}kind": Value("sinusoid", "as water_visibility_observer_node has it"),
            **values,
        }
    notes += [
        f"{each.place}: {_NO_COSINE}"
        for path, each in found.items()
        if path.startswith(_VISIBILITY)
    ]
    return {path: each for path, each in values.items() if not path.startswith(_VISIBILITY)}


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
            file = parameter.document.path
            places[path] = Location(0, parameter.line(), file)
            for index in range(len(value) if isinstance(value, list) else 0):
                places[(*path, index)] = Location(0, parameter.line(index), file)
    return Layer(data, places)


# The campaign.


_Limit = Annotated[Real, Field(ge=-LONGEST_S, le=LONGEST_S)]
_Interval = Annotated[tuple[_Limit, _Limit], AfterValidator(in_order)]
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
    """The runner, if there is one; an InputError if a value is impossible, or it has no
    experiments.
    """
    found = {each.name: each for each in parameters if each.node == RUNNER}
    if not found:
        return None
    first = next(iter(found.values()))
    return Runner(
        found, validated(first.document.below(first.entry).below(PARAMETERS), _RunnerSettings)
    )


class Experiment(NamedTuple):
    """Missions of one manager, and the level of the battery below which they are aborted; None:
    they go on.
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
        launch, file = each.experiment_launch, parameter.document.path
        place = f"{file}: line {parameter.line(index)}, {parameter.keys}[{index}]"
        arguments = dict(re.findall(r"(\w+):=(\S*)", launch))
        for node, names in ((EXPERIMENT, json.loads(parameter.value[index])), (LAUNCH, arguments)):
            unknown = [" ".join(name.split()) for name in names if (node, name) not in PATHS]
            notes += [
                f"{place}: not simulated: {name}: {shown(names.get(name))}" for name in unknown
            ]
        manager = arguments.get("adaptation_manager", each.adaptation_manager)
        if manager != each.adaptation_manager:
            notes.append(f"{place}: its launch starts {manager}, and not {each.adaptation_manager}")
        missions = [
            each.mission_name,
            *(arguments.get(name) for name in ("mission_name", "mission", "mission_type")),
        ]
        is_extended = EXTENDED in missions or "extended" in "".join(launch.split()[3:4])
        if manager == "bt":
            executable = arguments.get(
                "bt_executable", "suave_bt_extended" if is_extended else "suave_bt"
            )
            manager = TREES.get(executable, executable)
        elif is_extended:
            notes.append(
                f"{place}: not simulated: the mission {EXTENDED} under {manager}, which flies suave here"
            )
        level: float | None = None
        if arguments.get("battery_constraint", "").lower() == "true":
            try:
                level = float(arguments["battery_constraint_value"])
            except (KeyError, ValueError):
                notes.append(
                    f"{place}: not imported: battery_constraint without a number as its value"
                )
        yield Experiment(place, manager, each.num_runs, launch, level)


def _battery_constraint(experiments: Sequence[Experiment], notes: list[str]) -> dict[str, Value]:
    """The level below which missions are aborted; a campaign has one for all managers."""
    levels = {each.level for each in experiments}
    why = "not all experiments have it; import this one from a file of its own"
    for each in experiments if len(levels) > 1 else ():
        if each.level is not None:
            notes.append(
                f"{each.place}: not imported: battery_constraint_value {each.level:g}: {why}"
            )
    level = levels.pop() if len(levels) == 1 else None
    return (
        {"battery.mission_ends_at_level": Value(level, "battery_constraint_value")} if level else {}
    )


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
    """The runner's parameters as content of a campaign file; an InputError if there is nothing to
    run.
    """
    runs, shared = dict[str, int](), runner.settings.random_interval
    for place, manager, number, *_ in experiments:
        if manager not in known:
            remedy = did_you_mean(manager, known)
            notes.append(f"{place}: not imported: there is no manager {shown(manager)} ({remedy})")
            continue
        if manager in runs:
            notes.append(
                f"{place}: not imported: {manager} is there already, and a campaign has each manager once"
            )
        runs[manager] = max(runs.get(manager, 0), number)
    if not runs:
        raise InputError(
            "none of its managers can be run",
            place="experiments",
            remedy=f"known: {', '.join(known)}",
        )
    most = max(runs.values())
    if fewer := ", ".join(
        f"{manager} {number}" for manager, number in runs.items() if number < most
    ):
        notes.append(
            f"every manager gets {most} runs, although fewer were requested ({fewer}); the first are the same"
        )
    drawn = list(_perturbations(runner, loaded, notes))
    where = runner.comment("experiments")
    entries: Entries = {
        ("managers",): (list(runs), where),
        ("runs",): (most, where),
        ("seed",): (runner.settings.random_seed, runner.comment("random_seed")),
    }
    if not drawn:
        notes.append(
            f"{RUNNER}: nothing is drawn at random: it has no _random_interval with a width"
        )
    elif runner_seed is None:
        entries[("runs_per_draw",)] = (shared, runner.comment("random_interval"))
        for path, _, around, low, high, source in drawn:
            value = {"distribution": "uniform", "minimum": around + low, "maximum": around + high}
            value |= (
                {"shared": "thruster_events_shift"} if path.startswith("thruster_events") else {}
            )
            entries[("perturbations", path)] = (value, source)
    else:
        conditions = -(-most // shared)
        if rest := most % shared:
            last = (
                f"the last of {conditions} conditions has {number_of(rest, 'run')} in the exemplar"
            )
            notes.append(f"--runner-seed: {last}, and {shared} here, like the others")
        stream = random.Random(runner_seed)
        draws = [
            [stream.random() for _ in DRAWN] for _ in range(conditions)
        ]  # of all, of empty intervals, too
        entries[("runs",)] = (min(most, shared), f"{where}; at each of the conditions")
        for path, number, around, low, high, source in drawn:
            values = [around + (low + (high - low) * draw[number]) for draw in draws]
            values = (
                [max(0.0, value) for value in values]
                if path.startswith("thruster_events")
                else values
            )
            entries[("sweep", "zip", path)] = (
                values,
                f"{source}, as Python draws from seed {runner_seed}",
            )
    return entries


def _perturbations(
    runner: Runner, loaded: LoadedScenario, notes: list[str]
) -> Iterator[tuple[str, int, float, float, float, str]]:
    """Yield the runner's draws: key path, number in DRAWN, what the interval is added to, its ends,
    and its source.
    """
    for number, key in enumerate(DRAWN):
        low, high = getattr(runner.settings, key.name)
        if (low, high) == (0.0, 0.0):
            if key.name in runner.parameters:
                notes.append(f"{runner.parameters[key.name].place}: nothing is drawn from [0, 0]")
            continue
        path = key.path.removeprefix(PERTURBED)
        paths = _drawn_paths(path, loaded)
        if path == "thruster_events" and (not paths or path not in runner.parameters):
            notes.append(
                f"{runner.parameters[key.name].place}: shifts nothing: {RUNNER} has no {path}"
            )
            continue
        for each in paths:
            if (around := at(loaded, each)) is None:
                notes.append(f"{runner.parameters[key.name].place}: {_NO_COSINE}")
                continue
            source = f"{runner.comment(key.name)} [{low:g}, {high:g}] added to {around:g}"
            yield each, number, around, low, high, source


def _drawn_paths(path: str, loaded: LoadedScenario) -> list[str]:
    """Return the key paths of what is drawn from one of the runner's intervals: a value, or all
    thruster events.
    """
    events = loaded.scenario.thruster_events
    return (
        [f"{path}.{index}.time_s" for index in range(len(events))]
        if path == "thruster_events"
        else [path]
    )


# YAML with comments that name the source of each value.

_COMMENT_COLUMN = 43


def _text(documents: Sequence[Layer], entries: Entries, notes: Sequence[str]) -> str:
    """A YAML file of these entries."""
    names = ", ".join(each.path.name for each in documents)
    lines, above = [f"# Imported by `suave-des import-config` from {names}."], tuple[str, ...]()
    for path, (value, comment) in entries.items():
        for depth, key in enumerate(path[:-1]):
            if above[: depth + 1] != path[: depth + 1]:
                lines.append(f"{'  ' * depth}{key}:")
        above = path
        line = f"{'  ' * (len(path) - 1)}{path[-1]}: {json.dumps(value)}"
        lines.append(f"{line:<{_COMMENT_COLUMN}} # {comment}" if comment else line)
    lines += ["", "# About the files:", *(f"#   {note}" for note in notes)] if notes else []
    # No line ends, and no characters that YAML does not allow, from names in the user's files.
    return "".join(
        "".join(char if char.isprintable() else "?" for char in line) + "\n" for line in lines
    )


def _relative(path: Path, file: Path) -> str:
    """How a file names another: relative to its own folder."""
    return Path(os.path.relpath(path.resolve(), file.resolve().parent)).as_posix()


# The way back, and what the exemplar cannot express.

MISSION_FILE, RUNNER_FILE = "mission_config.yaml", "runner_config.yml"
MANAGERS = ("none", "random", "metacontrol", *TREES.values())
_NOT_COMPARED = ("name", "description", "campaign", "scenario")


def export_config(
    loaded: LoadedScenario, campaign: Mapping[str, Any], revision: str | None = None
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
    if loaded.scenario.signals[WATER_VISIBILITY].publishing_period_s is None:
        period_s = loaded.scenario.revision.monitors.visibility_publishing_period_s
        loaded = with_values(loaded, {f"signals.{WATER_VISIBILITY}.publishing_period_s": period_s})
    counted, runner = with_values(loaded, dict(_event_times_s(loaded, revision))), dict[str, Any]()
    mission = _mission(counted, revision)
    if is_since(revision, FIRST_WITH_RUNNER):
        runner = {RUNNER: {**mission.pop(RUNNER, {}), **_runner_of(loaded, campaign, revision)}}
    files = {
        name: nodes for name, nodes in ((MISSION_FILE, mission), (RUNNER_FILE, runner)) if nodes
    }
    head = f"# Written by `suave-des export-config` from {loaded.path.name}, for revision {revision} of the exemplar.\n"
    texts = dict[str, str]()
    for name, nodes in files.items():
        content = {f"/{node}": {PARAMETERS: given} for node, given in nodes.items()}
        texts[name] = head + yaml.safe_dump(content, sort_keys=False, width=1_000_000)
    again = import_config(
        [parse_yaml(text, Path(name)) for name, text in texts.items()],
        loaded.path.with_name(f"again_{loaded.path.name}"),
        managers=MANAGERS,
        revision=revision,
        campaign=Path("campaign.yaml") if runner else None,
    )
    there = yaml.safe_load(again.campaign or "{}")
    campaign = {key: value for key, value in campaign.items() if value not in (None, {}, [])}
    lost = list(
        _differences(
            counted.scenario.model_dump(mode="json"), again.loaded.scenario.model_dump(mode="json")
        )
    )
    if runner:
        lost += _differences(campaign, there)
    elif campaign:
        lost.append(
            f"{', '.join(campaign)}: the exemplar has no experiment runner before {FIRST_WITH_RUNNER}"
        )
    return texts, tuple(lost)


def _event_times_s(loaded: LoadedScenario, revision: str) -> Iterator[tuple[str, float]]:
    """The times of thruster events where a revision counts them otherwise: from the start, or one
    by one.
    """
    over, before_s = _layer({"revision": Value(revision, "")}, loaded.path), 0.0
    there = load_scenario(
        REVISIONS[revision], over=over
    ).scenario.revision.monitors.thruster_event_times
    if there != loaded.scenario.revision.monitors.thruster_event_times:
        for number, time_s in enumerate(
            max(0.0, mean(each.time_s)) for each in loaded.scenario.thruster_events
        ):
            t_s = before_s + time_s if there == "after_start" else max(before_s, time_s)
            yield (
                f"thruster_events.{number}.time_s",
                t_s if there == "after_start" else t_s - before_s,
            )
            before_s = t_s


def _mission(loaded: LoadedScenario, revision: str) -> dict[str, dict[str, Any]]:
    """The parameters of each node of which the scenario has a value of their type."""
    nodes: dict[str, dict[str, Any]] = {}
    for key in read_by(revision):
        value = _value(loaded, key.path, key.default)
        # The reasoner's file is another one. What the runner does anyway may have no key in an
        # older revision.
        if (
            value is not None
            and key.node != REASONER
            and (key.node, value) != (RUNNER, key.default)
        ):
            node = (
                "random_reasoner_node"
                if (key.node, revision) == ("task_bridge", "2023")
                else key.node
            )
            nodes.setdefault(node, {})[key.name] = value
    return nodes


def _value(loaded: LoadedScenario, path: str, default: Any) -> Any:
    """A value of the scenario in the type of a default, as ROS 2 demands; None if it has none."""
    if path == "thruster_events":
        events = loaded.scenario.thruster_events
        times_s = [mean(each.time_s) for each in events]
        texts = [str(int(time_s)) if time_s.is_integer() else repr(time_s) for time_s in times_s]
        return [
            f"({each.thruster},{each.event},{time_s})"
            for each, time_s in zip(events, texts, strict=True)
        ]
    value = at(loaded, path)
    if value is None and path.endswith((".minimum", ".maximum")):  # of another signal than a cosine
        value = at(loaded, f"{path.rpartition('.')[0]}.value")
    if isinstance(default, int | float) and isinstance(value, int | float):
        return round(value) if isinstance(default, int) else float(value)
    return (
        value
        if type(value) is type(default) or (default is None and isinstance(value, str))
        else None
    )


def _runner_of(
    loaded: LoadedScenario, campaign: Mapping[str, Any], revision: str
) -> dict[str, Any]:
    """The parameters that only the runner has; an InputError if the exemplar has none of the
    managers.
    """
    drawn, found = campaign.get("perturbations") or {}, dict[str, Any]()
    for key in DRAWN:
        path = key.path.removeprefix(PERTURBED)
        added = set[tuple[float, ...]]()  # to each value; to all thruster events the same
        for each in _drawn_paths(path, loaded):
            value, given = at(loaded, each), drawn.get(each)
            if (
                isinstance(value, float)
                and isinstance(given, dict)
                and given["distribution"] == "uniform"
            ):
                added.add(tuple(round(given[bound] - value, 9) for bound in ("minimum", "maximum")))
            else:
                added.add(())  # nothing that the runner can draw
        if len(added) == 1 and () not in added:
            found[key.name] = list(*added)
    found["random_interval"] = campaign.get("runs_per_draw", 1)
    if is_since(revision, FIRST_WITH_BRINGUP):
        found["random_seed"] = campaign["seed"]
    managers = [each for each in campaign["managers"] if each in MANAGERS]
    if not managers:
        problem = f"the exemplar has none of the managers {', '.join(campaign['managers'])}"
        raise InputError(problem, file=loaded.path, remedy=f"it has {', '.join(MANAGERS)}")
    files = {
        "mission_config_pkg": "suave_missions",
        "mission_config_file": f"config/{MISSION_FILE}",
    }
    experiments = [_experiment(each, campaign["runs"], loaded, revision) for each in managers]
    return {**found, **files, "experiments": [json.dumps(each) for each in experiments]}


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
    return {
        "experiment_launch": launch,
        "num_runs": runs,
        "adaptation_manager": name,
        "mission_name": mission,
    }


def _differences(
    here: Mapping[str, Any], there: Mapping[str, Any], above: str = ""
) -> Iterator[str]:
    """Yield a line for each key of which the exemplar has another value."""
    for key in dict.fromkeys((*here, *there)):
        one, other = _rounded(here.get(key)), _rounded(there.get(key))
        if one == other or (not above and key in _NOT_COMPARED):
            continue
        if key == "revision" and one["name"] != other["name"]:
            yield f"revision: {one['name']} here; the code that reads the files is {other['name']}'s"
        elif (
            isinstance(one, dict)
            and isinstance(other, dict)
            and one.get("kind") == other.get("kind")
        ):
            yield from _differences(one, other, f"{above}{key}.")
        elif isinstance(one, dict) and isinstance(other, dict):
            yield f"{above}{key}: {one['kind']} here, {other['kind']} in the exemplar"
        else:
            yield f"{above}{key}: {shown(one)} here, {shown(other)} in the exemplar"


def _rounded(value: Any) -> Any:
    """Plain data without rounding errors."""
    return json.loads(json.dumps(value), parse_float=lambda text: float(f"{float(text):.9g}"))
