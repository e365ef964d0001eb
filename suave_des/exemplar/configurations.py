"""The exemplar's own configuration files, imported as a scenario and a campaign; export is
the way back.
"""

from __future__ import annotations

import json
import os
import random
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import AfterValidator, BaseModel, Field, Json

from suave_des.domain import WATER_VISIBILITY
from suave_des.errors import InputError, KeyPath, did_you_mean, number_of, shown
from suave_des.exemplar.current import with_wave
from suave_des.exemplar.files import EVENTS, PARAMETERS, Parameter, given_files
from suave_des.exemplar.keys import (
    CAMPAIGN,
    DRAWN,
    EXPERIMENT,
    KEYS,
    LAUNCH,
    PATHS,
    PERTURBED,
    REASONER,
    REVISIONS,
    RUNNER,
    WATER_CURRENT,
    Key,
    is_every_node,
    is_read,
    read_by,
    revision_of,
)
from suave_des.scenario.loader import LoadedScenario, load_scenario, value_at
from suave_des.scenario.models import LONGEST_S, Real, Scenario, in_order
from suave_des.scenario.yamlfile import Layer, Location, validated

EXTENDED = "suave_extended"
"""The exemplar's mission with recharging."""
TREES = {"suave_bt": "bt", "suave_bt_extended": "bt_extended"}
"""Manager by the name of the behaviour tree's executable."""
_VISIBILITY = "signals.water_visibility."
_NO_COSINE = "not imported: the visibility of the base is no cosine"
_NOT_NEEDED = "not needed here"


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
    given = given_files(files, notes)
    runner = _runner(given.parameters)
    _check_campaign(runner, campaign, runner_seed)
    experiments = [] if runner is None else list(_experiments(runner, notes))
    revision, why = revision_of(given.telling(each.launch for each in experiments), revision)
    base = REVISIONS[revision]
    plain = load_scenario(base)
    values = _values(given.parameters, revision, plain, notes)
    values |= _battery_constraint(experiments, notes)
    if plain.scenario.revision.name != revision:
        values["revision"] = SourcedValue(revision, why)
    if given.modes is not None:
        values["modes_file"] = SourcedValue(str(given.modes.path.resolve()), "as it is")
    loaded = load_scenario(base, over=_layer(values, plain.path))

    text = None
    if runner is not None:
        notes += _mission_that_is_missing(runner, given.documents)
        if campaign is None:
            notes.append(_only_in_a_campaign(runner))
        else:
            content: Entries = {
                ("campaign",): (1, "version of the form"),
                ("scenario",): (_relative(out, campaign), ""),
            }
            requested = _requested(experiments, managers, notes)
            content |= _campaign(runner, requested, loaded, runner_seed, notes)
            text = _text(given.documents, content, ())
    if given.modes is not None:
        values["modes_file"] = SourcedValue(_relative(given.modes.path, out), "as it is")
    scenario = _text(given.documents, {("base",): (base, why), **_entries(values)}, notes)
    return Imported(loaded, base, why, scenario, text, tuple(notes))


def _check_campaign(runner: Runner | None, campaign: Path | None, runner_seed: int | None) -> None:
    """Raise an InputError if a campaign is needed and not requested, or the other way round."""
    if campaign is None and runner_seed is not None:
        problem = "the draws of the exemplar's runner are conditions of a campaign"
        raise InputError(problem, place="--runner-seed", remedy="add --campaign FILE")
    if campaign is not None and runner is None:
        remedy = "give the campaign's configuration too, or leave --campaign out"
        raise InputError(
            f"there is no campaign to import: no node {RUNNER} in the files", remedy=remedy
        )


def _mission_that_is_missing(runner: Runner, documents: Sequence[Layer]) -> Iterator[str]:
    """Yield a note if the mission's file that the runner names is none of those given."""
    mission = runner.parameters.get("mission_config_file")
    names = {each.path.name for each in documents}
    if mission is not None and Path(str(mission.value)).name not in names:
        yield f"{mission.place}: not imported: {shown(mission.value)} is none of the files given"


def _only_in_a_campaign(runner: Runner) -> str:
    """Return the note about the runner's parameters that no scenario has."""
    listed = [
        name for name in runner.parameters if PATHS.get((RUNNER, name), "").startswith(CAMPAIGN)
    ]
    what = "not part of a scenario (--campaign FILE writes it to a campaign file)"
    return f"{what}: {RUNNER}: {', '.join(listed)}"


# Thruster events, as text.


_BEFORE_START = re.compile(r"(\(\d+,\w+,)(-(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\)", re.ASCII)


def _time_before_start_s(event: object) -> float | None:
    """Return the time of a thruster event that is before the start; None if it is not."""
    match = _BEFORE_START.fullmatch(event) if isinstance(event, str) else None
    return None if match is None else float(match[2])


def _from_start(events: object) -> object:
    """Return thruster events of which those before the start are at the start: the exemplar
    triggers them at its first tick.
    """
    if not isinstance(events, list):
        return events
    return [
        each if _time_before_start_s(each) is None else _BEFORE_START.sub(r"\g<1>0)", each)
        for each in events
    ]


# The scenario's values.


class SourcedValue(NamedTuple):
    """A value of the scenario, where it comes from, and its parameter; None: it is a default."""

    value: object
    comment: str
    parameter: Parameter | None = None


class Reading(NamedTuple):
    """How a revision reads the files.

    Attributes:
        has_mission: whether a node of a mission is configured.
        has_runner: whether the runner is.
    """

    revision: str
    has_mission: bool
    has_runner: bool

    @classmethod
    def of(cls, parameters: Sequence[Parameter], revision: str) -> Reading:
        """Read parameters as those of a revision."""
        has_mission = any(
            each.node not in (RUNNER, REASONER, WATER_CURRENT)
            and not (is_every_node(each.entry) and PATHS[each.node, each.name] == "")
            for each in parameters
        )
        return cls(revision, has_mission, any(each.node == RUNNER for each in parameters))

    @property
    def passed(self) -> set[str]:
        """Key paths of what the runner gives to each mission: all that has a default, with or
        without a value in its file.
        """
        given = read_by(self.revision) if self.has_runner else ()
        return {key.path for key in given if key.node == RUNNER and key.default is not None}

    def why_not(self, parameter: Parameter) -> str | None:
        """Return why a parameter does not count for a mission; None if it does."""
        path = PATHS.get((parameter.node, parameter.name))
        if path is None:
            known = [key.name for key in KEYS if key.node == parameter.node]
            return f"unknown key ({did_you_mean(parameter.name, known)})"
        if path == "":
            return _NOT_NEEDED
        if not is_read(parameter.node, parameter.name, self.revision):
            keys = read_by(self.revision)
            instead = (f"{key.node}.{key.name}" for key in keys if key.path == path)
            return f"revision {self.revision} reads {next(instead, 'nothing of the kind')}"
        if path in self.passed and parameter.node != RUNNER:
            return f"{RUNNER} gives each mission its own; without one, 0"
        return None

    def defaults(self) -> Iterator[Key]:
        """Yield the keys that have a default, of nodes that take part in these missions."""
        for key in read_by(self.revision):
            takes_part = self.has_mission or (self.has_runner and key.node == RUNNER)
            is_passed = key.path in self.passed and key.node != RUNNER
            if key.default is not None and takes_part and not is_passed:
                yield key


def _values(
    parameters: Sequence[Parameter], revision: str, base: LoadedScenario, notes: list[str]
) -> dict[str, SourcedValue]:
    """Return the values that a mission has, by key path; notes about others.

    Raises:
        InputError: two files contradict one another, or the current cannot be read.
    """
    reading = Reading.of(parameters, revision)
    given = _counted(_needed(parameters, reading, notes), notes)
    given = with_wave(given, parameters, reading.has_runner, notes)
    values = {
        path: SourcedValue(
            _from_start(each.value) if path == EVENTS else each.value,
            f"{each.source}: {each.keys}",
            each,
        )
        for path, each in given.items()
    }
    values |= _defaults(reading, values, base, notes)
    return _with_cosine(values, reading, base, notes)


def _needed(parameters: Sequence[Parameter], reading: Reading, notes: list[str]) -> list[Parameter]:
    """Return the parameters that count, the runner's first; notes about the others.

    One that is given to every node counts if it does for some of them.
    """
    ordered = sorted(parameters, key=lambda each: each.rank)
    reasons = [(each, reading.why_not(each)) for each in ordered]
    needed = [each for each, why in reasons if why is None]
    places = {each.place for each in needed}
    unneeded = list[str]()
    for each, why in reasons:
        if each.place in places:
            continue
        places.add(each.place)
        if why == _NOT_NEEDED:
            unneeded.append(f"{each.keys} ({each.source})")
        else:
            notes.append(f"{each.place}: not imported: {why}")
    if unneeded:
        notes.append(f"{_NOT_NEEDED}: {', '.join(unneeded)}")
    return needed


def _counted(parameters: Sequence[Parameter], notes: list[str]) -> dict[str, Parameter]:
    """Return the parameter that counts for each key path of a scenario, of parameters in the order
    of their rank.

    Raises:
        InputError: two of equal rank have different values.
    """
    found: dict[str, Parameter] = {}
    for parameter in parameters:
        path = PATHS[parameter.node, parameter.name]
        # Several parameters of the runner have one path in a campaign.
        place = f"{CAMPAIGN}{parameter.name}" if path.startswith(CAMPAIGN) else path
        first = found.setdefault(place, parameter)
        if first.value == parameter.value:
            continue
        if first.rank == parameter.rank:
            remedy = "make them alike, or leave one of them out"
            raise parameter.error(f"contradicts {first.place}", remedy)
        whose = "campaign" if first.rank[0] != parameter.rank[0] else "node"
        notes.append(f"{parameter.place}: not imported: the {whose}'s value counts ({first.place})")
    return {place: each for place, each in found.items() if not place.startswith(CAMPAIGN)}


def _defaults(
    reading: Reading, given: Collection[str], base: LoadedScenario, notes: list[str]
) -> dict[str, SourcedValue]:
    """Return the defaults of the exemplar's nodes that differ from the base's values; a note about
    all that are not given.
    """
    omitted = dict[str, list[str]]()
    values = dict[str, SourcedValue]()
    for key in reading.defaults():
        if key.path in given:
            continue
        omitted.setdefault(key.node, []).append(key.name)
        if at(base, key.path) != key.default:
            values[key.path] = SourcedValue(key.default, f"default of {key.node}.{key.name}")
    if omitted:
        listed = "; ".join(f"{node}: {', '.join(names)}" for node, names in omitted.items())
        notes.append(f"not in the files, so at the defaults of the exemplar's nodes: {listed}")
    return values


def _with_cosine(
    values: Mapping[str, SourcedValue], reading: Reading, base: LoadedScenario, notes: list[str]
) -> dict[str, SourcedValue]:
    """Make the visibility the cosine that the exemplar's observer publishes; without a mission, it
    stays the base's, whatever it is.
    """
    if base.scenario.signals[WATER_VISIBILITY].kind == "sinusoid":
        return dict(values)
    if reading.has_mission:
        kind = SourcedValue("sinusoid", "as water_visibility_observer_node has it")
        return {f"{_VISIBILITY}kind": kind, **values}
    kept = dict(values)
    for path, (_, _, parameter) in values.items():
        if path.startswith(_VISIBILITY):
            del kept[path]
            if parameter is not None:
                notes.append(f"{parameter.place}: {_NO_COSINE}")
    return kept


def at(loaded: LoadedScenario, path: str) -> Any:
    """The value at a key path; None if the scenario has no such part."""
    try:
        return value_at(loaded, path)
    except InputError:
        return None


def _layer(values: Mapping[str, SourcedValue], base: Path) -> Layer:
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
            lines = enumerate(parameter.entry_lines)
            places |= {(*path, index): Location(0, line, file) for index, line in lines}
    return Layer(data, places)


def _entries(values: Mapping[str, SourcedValue]) -> Entries:
    """The values as lines of a scenario file, in the order of its keys."""
    order = list(Scenario.model_fields)
    paths = sorted(values, key=lambda path: (order.index(path.split(".")[0]), path.split(".")[:-1]))
    return {tuple(path.split(".")): (values[path].value, values[path].comment) for path in paths}


# The campaign.


_Limit = Annotated[Real, Field(ge=-LONGEST_S, le=LONGEST_S)]
_Interval = Annotated[tuple[_Limit, _Limit], AfterValidator(in_order), Field(default=(0.0, 0.0))]
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
    water_visibility_sec_shift_random_interval: _Interval
    initial_pos_x_random_interval: _Interval
    initial_pos_y_random_interval: _Interval
    initial_pos_z_random_interval: _Interval
    thruster_events_random_interval: _Interval


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
    found: dict[str, Parameter] = {}
    for each in sorted(parameters, key=lambda each: each.rank):
        if each.node == RUNNER:
            found.setdefault(each.name, each)
    if not found:
        return None
    first = next(iter(found.values()))
    places: dict[KeyPath, Location] = {(): first.document.place((first.entry, PARAMETERS))}
    for each in found.values():
        above = (each.entry, PARAMETERS, each.name)
        inside = each.document.places.items()
        places |= {path[2:]: place for path, place in inside if path[:3] == above}
    data = {each.name: each.in_file for each in found.values()}
    layer = Layer(data, places, (first.entry, PARAMETERS))
    return Runner(found, validated(layer, _RunnerSettings))


class Experiment(NamedTuple):
    """Missions of one manager, whether they are extended ones, and the level of the battery below
    which they are aborted; None: they go on.
    """

    place: str
    manager: str
    runs: int
    is_extended: bool
    launch: str
    level: float | None


def _experiments(runner: Runner, notes: list[str]) -> Iterator[Experiment]:
    """The experiments, each by its own launch and mission; notes about what is not simulated."""
    parameter = runner.parameters["experiments"]
    for index, each in enumerate(runner.settings.experiments):
        line = parameter.line(index)
        place = f"{parameter.document.path}: line {line}, {parameter.keys}[{index}]"
        arguments = dict(re.findall(r"(\w+):=(\S*)", each.experiment_launch))
        notes += _not_simulated(place, EXPERIMENT, json.loads(parameter.value[index]))
        notes += _not_simulated(place, LAUNCH, arguments)
        is_extended = _is_extended(each, arguments)
        manager = _manager(place, each.adaptation_manager, arguments, is_extended, notes)
        level = _level(place, arguments, notes)
        yield Experiment(place, manager, each.num_runs, is_extended, each.experiment_launch, level)


def _not_simulated(place: str, node: str, given: Mapping[str, object]) -> Iterator[str]:
    """Yield a note for each key of an experiment or launch that is not in the table."""
    for name, value in given.items():
        if (node, name) not in PATHS:
            words = " ".join(name.split())
            yield f"{place}: not simulated: {words}: {shown(value)}"


def _is_extended(experiment: _Experiment, arguments: Mapping[str, str]) -> bool:
    """Whether an experiment or its launch is of the extended mission."""
    of_launch = [arguments.get(name) for name in ("mission_name", "mission", "mission_type")]
    launch_file = "".join(experiment.experiment_launch.split()[3:4])
    return EXTENDED in (experiment.mission_name, *of_launch) or "extended" in launch_file


def _manager(
    place: str,
    named: str,
    arguments: Mapping[str, str],
    is_extended: bool,
    notes: list[str],
) -> str:
    """Return the manager of an experiment, by its name here; a note if its launch starts another
    one.
    """
    manager = arguments.get("adaptation_manager", named)
    if manager != named:
        notes.append(f"{place}: its launch starts {manager}, and not {named}")
    if manager != "bt":
        return manager
    tree = "suave_bt_extended" if is_extended else "suave_bt"
    executable = arguments.get("bt_executable", tree)
    return TREES.get(executable, executable)


def _level(place: str, arguments: Mapping[str, str], notes: list[str]) -> float | None:
    """Return the level of the battery below which a launch aborts missions, if there is one."""
    if arguments.get("battery_constraint", "").lower() != "true":
        return None
    try:
        return float(arguments["battery_constraint_value"])
    except (KeyError, ValueError):
        notes.append(f"{place}: not imported: battery_constraint without a number as its value")
        return None


def _battery_constraint(
    experiments: Sequence[Experiment], notes: list[str]
) -> dict[str, SourcedValue]:
    """The level below which missions are aborted; a campaign has one for all managers."""
    levels = {each.level for each in experiments}
    if len(levels) > 1:
        why = "not all experiments have it; import this one from a file of its own"
        notes += [
            f"{each.place}: not imported: battery_constraint_value {each.level:g}: {why}"
            for each in experiments
            if each.level is not None
        ]
        return {}
    level = next(iter(levels), None)
    if not level:  # no level is below 0
        return {}
    return {"battery.mission_ends_at_level": SourcedValue(level, "battery_constraint_value")}


Entries = dict[tuple[str, ...], tuple[object, str]]
"""Values with their comments by key path, as lines of a YAML file."""


def _requested(
    experiments: Sequence[Experiment], known: Collection[str], notes: list[str]
) -> dict[str, int]:
    """Return the managers to run, each with the greatest number of missions requested of it.

    Raises:
        InputError: there is none.
    """
    runs = dict[str, int]()
    for place, manager, number, is_extended, *_ in experiments:
        if manager not in known:
            remedy = did_you_mean(manager, known)
            notes.append(f"{place}: not imported: there is no manager {shown(manager)} ({remedy})")
            continue
        if manager in runs:
            why = f"{manager} is there already, and a campaign has each manager once"
            notes.append(f"{place}: not imported: {why}")
        elif is_extended and manager not in TREES.values():
            of_mission = f"the mission {EXTENDED} under {manager}, which flies suave here"
            notes.append(f"{place}: not simulated: {of_mission}")
        runs[manager] = max(runs.get(manager, 0), number)
    if runs:
        return runs
    problem = "none of its managers can be run"
    remedy = f"known: {', '.join(known)}"
    raise InputError(problem, place="experiments", remedy=remedy)


def _campaign(
    runner: Runner,
    runs: Mapping[str, int],
    loaded: LoadedScenario,
    runner_seed: int | None,
    notes: list[str],
) -> Entries:
    """The runner's parameters as content of a campaign file."""
    most = max(runs.values())
    fewer = [f"{manager} {number}" for manager, number in runs.items() if number < most]
    if fewer:
        why = f"although fewer were requested ({', '.join(fewer)}); the first are the same"
        notes.append(f"every manager gets {most} runs, {why}")
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
        return entries
    if runner_seed is None:
        return entries | _drawn_anew(runner, drawn)
    return entries | _conditions(runner, drawn, most, runner_seed, notes)


def _drawn_anew(runner: Runner, drawn: Sequence[Draw]) -> Entries:
    """What the runner draws as perturbations, with draws of our own."""
    sharing = runner.settings.random_interval
    entries: Entries = {("runs_per_draw",): (sharing, runner.comment("random_interval"))}
    for each in drawn:
        value = {
            "distribution": "uniform",
            "minimum": each.around + each.low,
            "maximum": each.around + each.high,
        }
        if each.is_event:
            value["shared"] = "thruster_events_shift"
        entries["perturbations", each.path] = value, each.source
    return entries


def _conditions(
    runner: Runner, drawn: Sequence[Draw], runs: int, seed: int, notes: list[str]
) -> Entries:
    """What the runner draws from a seed, as conditions."""
    sharing = runner.settings.random_interval
    conditions = -(-runs // sharing)
    if rest := runs % sharing:
        last = f"the last of {conditions} conditions has {number_of(rest, 'run')} in the exemplar"
        notes.append(f"--runner-seed: {last}, and {sharing} here, like the others")
    stream = random.Random(seed)
    # Of all, of empty intervals, too.
    draws = [stream.random() for _ in range(conditions * len(DRAWN))]
    where = f"{runner.comment('experiments')}; at each of the conditions"
    entries: Entries = {("runs",): (min(runs, sharing), where)}
    for each in drawn:
        values = [each.value(share) for share in draws[each.number :: len(DRAWN)]]
        source = f"{each.source}, as Python draws from seed {seed}"
        entries["sweep", "zip", each.path] = values, source
    return entries


class Draw(NamedTuple):
    """A draw of the runner.

    Attributes:
        path: key path of what is drawn.
        number: of the interval in DRAWN.
        around: what the interval is added to.
        low, high: the interval's ends.
        source: where it comes from.
    """

    path: str
    number: int
    around: float
    low: float
    high: float
    source: str

    @property
    def is_event(self) -> bool:
        """Whether it is the time of a thruster event."""
        return self.path.startswith(EVENTS)

    def value(self, share: float) -> float:
        """The value at a share of the interval; a time before the start is the start."""
        value = self.around + (self.low + (self.high - self.low) * share)
        return max(0.0, value) if self.is_event else value


def _perturbations(runner: Runner, loaded: LoadedScenario, notes: list[str]) -> Iterator[Draw]:
    """Yield the runner's draws; notes about intervals from which nothing is drawn."""
    for number, key in enumerate(DRAWN):
        if key.name not in runner.parameters:
            continue
        place = runner.parameters[key.name].place
        low, high = getattr(runner.settings, key.name)
        if (low, high) == (0.0, 0.0):
            notes.append(f"{place}: nothing is drawn from [0, 0]")
            continue
        around = _around(key.path.removeprefix(PERTURBED), runner, loaded)
        if not around:
            notes.append(f"{place}: shifts nothing: {RUNNER} has no {EVENTS}")
        for path, value in around.items():
            if value is None:
                notes.append(f"{place}: {_NO_COSINE}")
            elif path.startswith(EVENTS) and value + high < 0.0:
                notes.append(f"{place}: {path} is always before the start, and so 0")
            else:
                source = f"{runner.comment(key.name)} [{low:g}, {high:g}] added to {value:g}"
                yield Draw(path, number, value, low, high, source)


def _around(path: str, runner: Runner, loaded: LoadedScenario) -> dict[str, float | None]:
    """Return what one of the runner's intervals is added to, by key path: a value of the scenario,
    None if it has none, or the times of the runner's thruster events, which may be before the
    start.
    """
    if path != EVENTS:
        return {path: at(loaded, path)}
    if path not in runner.parameters:
        return {}
    before_s = [_time_before_start_s(each) for each in runner.parameters[path].value]
    paths = [f"{path}.{index}.time_s" for index in range(len(before_s))]
    return {
        each: at(loaded, each) if time_s is None else time_s
        for each, time_s in zip(paths, before_s, strict=True)
    }


# YAML with comments that name the source of each value.

_COMMENT_COLUMN = 43


def _text(documents: Sequence[Layer], entries: Entries, notes: Sequence[str]) -> str:
    """A YAML file of these entries."""
    names = ", ".join(each.path.name for each in documents)
    lines = [f"# Imported by `suave-des import-config` from {names}."]
    above: tuple[str, ...] = ()
    for path, (value, comment) in entries.items():
        for depth, key in enumerate(path[:-1]):
            if above[: depth + 1] != path[: depth + 1]:
                lines.append(f"{'  ' * depth}{key}:")
        above = path
        line = f"{'  ' * (len(path) - 1)}{path[-1]}: {json.dumps(value)}"
        lines.append(f"{line:<{_COMMENT_COLUMN}} # {comment}" if comment else line)
    lines += ["", "# About the files:", *(f"#   {note}" for note in notes)] if notes else []
    # No line ends, and no characters that YAML does not allow, from names in the user's files.
    return "".join(f"{_printable(line)}\n" for line in lines)


def _printable(line: str) -> str:
    return "".join(char if char.isprintable() else "?" for char in line)


def _relative(path: Path, file: Path) -> str:
    """How a file names another: relative to its own folder."""
    return Path(os.path.relpath(path.resolve(), file.resolve().parent)).as_posix()
