"""The exemplar's runner: its experiments, and what it draws, as a campaign."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Annotated, NamedTuple

from pydantic import AfterValidator, BaseModel, Field, Json

from suave_des.errors import InputError, KeyPath, did_you_mean, number_of, shown
from suave_des.exemplar.files import EVENTS, PARAMETERS, Parameter
from suave_des.exemplar.keys import DRAWN, EXPERIMENT, LAUNCH, PATHS, PERTURBED, RUNNER
from suave_des.exemplar.mission_values import NO_COSINE, SourcedValue, at, time_before_start_s
from suave_des.exemplar.written import Entries
from suave_des.scenario.loader import LoadedScenario
from suave_des.scenario.models import LONGEST_S, Real, in_order
from suave_des.scenario.yamlfile import Layer, Location, validated

EXTENDED = "suave_extended"
"""The exemplar's mission with recharging."""
TREES = {"suave_bt": "bt", "suave_bt_extended": "bt_extended"}
"""Manager by the name of the behaviour tree's executable."""
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


def runner_in(parameters: Sequence[Parameter]) -> Runner | None:
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


def experiments_of(runner: Runner, notes: list[str]) -> Iterator[Experiment]:
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


def battery_constraint(
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


def requested_managers(
    experiments: Sequence[Experiment], known: Collection[str], notes: list[str]
) -> dict[str, int]:
    """Return the managers to run, each with the greatest number of missions requested of it.

    Raises:
        InputError: there is none.
    """
    runs = dict[str, int]()
    for each in experiments:
        place = each.place
        manager = each.manager
        if manager not in known:
            remedy = did_you_mean(manager, known)
            notes.append(f"{place}: not imported: there is no manager {shown(manager)} ({remedy})")
            continue
        if manager in runs:
            why = f"{manager} is there already, and a campaign has each manager once"
            notes.append(f"{place}: not imported: {why}")
        elif each.is_extended and manager not in TREES.values():
            of_mission = f"the mission {EXTENDED} under {manager}, which flies suave here"
            notes.append(f"{place}: not simulated: {of_mission}")
        runs[manager] = max(runs.get(manager, 0), each.runs)
    if runs:
        return runs
    problem = "none of its managers can be run"
    remedy = f"known: {', '.join(known)}"
    raise InputError(problem, place="experiments", remedy=remedy)


def campaign_entries(
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
    # The exemplar draws from each interval in the order of its parameters, from empty ones, too: a share
    # for each keeps that order.
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
                notes.append(f"{place}: {NO_COSINE}")
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
    before_s = [time_before_start_s(each) for each in runner.parameters[path].value]
    paths = [f"{path}.{index}.time_s" for index in range(len(before_s))]
    return {
        each: at(loaded, each) if time_s is None else time_s
        for each, time_s in zip(paths, before_s, strict=True)
    }
