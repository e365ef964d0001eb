"""The values of a scenario, from the parameters of the exemplar's nodes."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from suave_des.domain import WATER_VISIBILITY
from suave_des.errors import InputError, KeyPath, did_you_mean
from suave_des.exemplar.current import with_wave
from suave_des.exemplar.files import EVENTS, Parameter
from suave_des.exemplar.keys import (
    CAMPAIGN,
    KEYS,
    PATHS,
    REASONER,
    RUNNER,
    WATER_CURRENT,
    Key,
    is_every_node,
    is_read,
    read_by,
)
from suave_des.exemplar.written import Entries
from suave_des.scenario.loader import LoadedScenario, value_at
from suave_des.scenario.models import Scenario
from suave_des.scenario.yamlfile import Layer, Location

_VISIBILITY = "signals.water_visibility."
NO_COSINE = "not imported: the visibility of the base is no cosine"
_NOT_NEEDED = "not needed here"


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


def mission_values(
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
                notes.append(f"{parameter.place}: {NO_COSINE}")
    return kept


def at(loaded: LoadedScenario, path: str) -> Any:
    """The value at a key path; None if the scenario has no such part."""
    try:
        return value_at(loaded, path)
    except InputError:
        return None


def layer_of(values: Mapping[str, SourcedValue], base: Path) -> Layer:
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


def scenario_entries(values: Mapping[str, SourcedValue]) -> Entries:
    """The values as lines of a scenario file, in the order of its keys."""
    order = list(Scenario.model_fields)
    paths = sorted(values, key=lambda path: (order.index(path.split(".")[0]), path.split(".")[:-1]))
    return {tuple(path.split(".")): (values[path].value, values[path].comment) for path in paths}


# Thruster events, as text.


_BEFORE_START = re.compile(r"(\(\d+,\w+,)(-(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\)", re.ASCII)


def time_before_start_s(event: object) -> float | None:
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
        each if time_before_start_s(each) is None else _BEFORE_START.sub(r"\g<1>0)", each)
        for each in events
    ]
