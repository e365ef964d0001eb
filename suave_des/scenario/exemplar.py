"""Import of the exemplar's own configuration: a scenario of ours, and a campaign where a campaign is configured."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from suave_des.errors import InputError, KeyPath
from suave_des.resources import find, shipped_folder
from suave_des.scenario.exemplar_campaign import campaign_text
from suave_des.scenario.exemplar_nodes import (
    NODES,
    NOT_NEEDED,
    NOT_READ,
    RUNNER,
    Configuration,
    Parameter,
    no_counterpart,
    read_configuration,
)
from suave_des.scenario.exemplar_text import commented, flow, heading, one_line
from suave_des.scenario.layers import Files, Layer, Location, merge, scenario_layer
from suave_des.scenario.loader import LoadedScenario, load_layer
from suave_des.scenario.models import Scenario

_BATTERY_NOTE = (
    "battery: on, as battery_monitor is configured; the exemplar starts it in its extended mission only"
    " (without it: remove the scenario's part battery)"
)
Settings = Mapping[str, Parameter]
"""Parameters of the files by the scenario's key path."""


@dataclass(frozen=True)
class Imported:
    """The exemplar's configuration in our form.

    Attributes:
        base: name or path of the scenario that the imported one builds on.
        why: why that one.
        scenario: text of the scenario file.
        campaign: text of the campaign file; none if the configuration has no campaign, or none was asked for.
        notes: what has no counterpart or was changed, a line each.
    """

    base: str
    why: str
    scenario: str
    campaign: str | None
    notes: tuple[str, ...]


def import_config(
    files: Sequence[Path],
    out: Path,
    *,
    base: str | None = None,
    campaign: Path | None = None,
    managers: Collection[str] = (),
) -> Imported:
    """Convert mission, campaign and System Modes files of the exemplar. Nothing is written.

    Args:
        files: the exemplar's files, in any order; either revision's.
        out: where the scenario will be, which decides how it names other files.
        base: scenario to build on; left out, the shipped one of the revision that the files look like.
        campaign: where the campaign will be; None: no campaign is imported.
        managers: names of the managers that can be run.

    Raises:
        InputError: a file cannot be read or is none of these, two contradict one another, or a value cannot be right.
    """
    configuration = read_configuration(files)
    guess, why = (base, "as asked for") if base is not None else _guess(configuration)
    base_path = find(guess, "scenarios")
    if base_path.resolve() == out.resolve():
        raise InputError("cannot be its own base", file=out, remedy="give --out another name")
    reader = Files()
    below = scenario_layer(reader, base_path, (out,))
    notes = list(configuration.notes)
    settings = _settings(configuration, str(below.data.get("revision", {}).get("name")), notes)
    if "battery_monitor" in configuration.nodes:
        notes.append(_BATTERY_NOTE)
    try:
        loaded = load_layer(reader, merge(below, _layer(settings, configuration, out)), out)
    except InputError as error:
        raise _in_their_terms(error, settings) from None
    names = [path.name for path in files]
    text = _campaign(configuration, loaded, campaign, out, managers, names, notes)
    is_shipped = base_path.is_relative_to(shipped_folder("scenarios"))
    shown_base = base_path.stem if is_shipped else _relative(base_path, out)
    lines = [
        *heading(names),
        "# Values that are not given here are those of the base.",
        commented(0, f"base: {flow(shown_base)}", why),
        *_lines(configuration, settings, loaded, out),
    ]
    if notes:
        lines += ["", "# Other parameters of the files:", *(f"#   {one_line(note)}" for note in notes)]
    return Imported(shown_base, why, "\n".join(lines) + "\n", text, tuple(notes))


def _guess(configuration: Configuration) -> tuple[str, str]:
    """The shipped scenario of the revision that the nodes belong to, and why."""
    for shipped, revision in (("release15", "1.5"), ("seams2023", "2023")):
        if marks := [node for node in configuration.nodes if NODES[node].shipped == shipped]:
            return shipped, f"only revision {revision} has {marks[0]}"
    return "seams2023", "no node of revision 1.5 alone is there"


def _settings(configuration: Configuration, revision: str, notes: list[str]) -> Settings:
    """The parameters that a scenario has, by its key path; a note for every other one of a mission's nodes."""
    missions: dict[str, Parameter] = {}
    runners: dict[str, Parameter] = {}
    for parameter in configuration.parameters:
        known = NODES[parameter.node].parameters
        path = known.get(parameter.key)
        if path is None:
            if parameter.node != RUNNER:
                notes.append(no_counterpart(parameter, known))
        elif (reason := NOT_READ.get((revision, path))) is not None:
            notes.append(f"{parameter.place}: not taken over: {reason}")
        else:
            settings = runners if parameter.node == RUNNER else missions
            other = settings.setdefault(path, parameter)
            if other is not parameter and _differ(other, parameter):
                raise parameter.error(f"contradicts {other.place}", "make them alike, or leave one of them out")
    for path, parameter in runners.items():
        if path in missions and _differ(missions[path], parameter):
            note = f"not taken over: the campaign's value counts ({parameter.place})"
            notes.append(f"{missions[path].place}: {note}")
    return missions | runners


def _differ(one: Parameter, other: Parameter) -> bool:
    """Whether two values differ by more than the blanks in thruster events."""
    values = [
        ["".join(each.split()) if isinstance(each, str) else each for each in value]
        if isinstance(value, list)
        else value
        for value in (one.value, other.value)
    ]
    return bool(values[0] != values[1])


def _layer(settings: Settings, configuration: Configuration, out: Path) -> Layer:
    """The files' values as a scenario, each with its place there.

    Raises:
        InputError: two modes files are given.
    """
    data: dict[str, Any] = {"battery": {}} if "battery_monitor" in configuration.nodes else {}
    places: dict[KeyPath, Location] = {(): Location(0, 1, out)}
    for name, parameter in settings.items():
        *parents, last = path = tuple(name.split("."))
        here = data
        for key in parents:
            here = here.setdefault(key, {})
        here[last] = parameter.value
        file = parameter.document.path
        places[path] = Location(0, parameter.line, file)
        for index in range(len(parameter.value) if isinstance(parameter.value, list) else 0):
            places[(*path, index)] = Location(0, parameter.document.line((*parameter.key_path, index)), file)
    if configuration.modes:
        first, *others = configuration.modes
        if any(other.sha256 != first.sha256 for other in others):
            remedy = f"give one: {first.path} is the other"
            raise InputError("there are two System Modes files", file=others[0].path, remedy=remedy)
        data["modes_file"] = str(first.path.resolve())
        places[("modes_file",)] = Location(0, 1, first.path)
    return Layer(data, places)


def _in_their_terms(error: InputError, settings: Settings) -> InputError:
    """The same error with node and key in place of our key path, if it is about a value from the user's files."""
    line, _, keys = (error.place or "").partition(", ")
    for path, parameter in settings.items():
        if error.file == str(parameter.document.path) and (keys == path or keys.startswith((f"{path}.", f"{path}["))):
            place = f"{line}, {parameter.keys}{keys.removeprefix(path)}"
            return InputError(error.problem, file=error.file, place=place, remedy=error.remedy)
    return error


def _campaign(
    configuration: Configuration,
    loaded: LoadedScenario,
    campaign: Path | None,
    out: Path,
    managers: Collection[str],
    files: Sequence[str],
    notes: list[str],
) -> str | None:
    """Text of the campaign file, if a campaign is configured and asked for; else a note for each of its parameters."""
    runner = {each.key: each for each in configuration.parameters if each.node == RUNNER}
    if campaign is None:
        for key, parameter in runner.items():
            if key not in NODES[RUNNER].parameters:
                reason = NOT_NEEDED.get(key, "a scenario has none; --campaign FILE writes a campaign file")
                notes.append(f"{parameter.place}: no counterpart: {reason}")
        return None
    if RUNNER not in configuration.nodes:
        raise InputError(
            f"there is no campaign to import: no node {RUNNER} in {', '.join(files)}",
            remedy="give the campaign's configuration too, or leave --campaign out",
        )
    return campaign_text(runner, loaded, _relative(out, campaign), managers, files, notes)


def _lines(configuration: Configuration, settings: Settings, loaded: LoadedScenario, out: Path) -> Iterator[str]:
    """The values in the order of the scenario's reference, each with its source as a comment."""
    entries = {path: _entry(path, parameter, loaded) for path, parameter in settings.items()}
    if "battery_monitor" in configuration.nodes and not any(path.startswith("battery.") for path in settings):
        entries["battery"] = ({}, "battery_monitor, all at its defaults")
    for modes in configuration.modes[:1]:
        entries["modes_file"] = (_relative(modes.path, out), "as it is")
    order = list(Scenario.model_fields)
    above: list[str] = []
    for path in sorted(entries, key=lambda path: order.index(path.split(".")[0])):
        value, comment = entries[path]
        *parents, last = path.split(".")
        for depth, key in enumerate(parents):
            if above[: depth + 1] != parents[: depth + 1]:
                yield f"{'  ' * depth}{key}:"
        above, depth = [*parents, last], len(parents)
        if isinstance(value, list) and any(isinstance(each, dict) for each in value):
            yield commented(depth, f"{last}:", comment)
            yield from (f"{'  ' * (depth + 1)}- {flow(each)}" for each in value)
        else:
            yield commented(depth, f"{last}: {flow(value)}", comment)


def _entry(path: str, parameter: Parameter, loaded: LoadedScenario) -> tuple[Any, str]:
    value = parameter.value
    if path == "thruster_events":
        value = [event.model_dump() for event in loaded.scenario.thruster_events]
    comment = f"{parameter.source}: {parameter.keys}"
    if path == "start.y_m" and value == 2.0:
        comment += "; where 2.0 was asked for, the published runs have 2.56 to 2.59"
    return value, comment


def _relative(path: Path, file: Path) -> str:
    """How a file names another: relative to its own folder."""
    return Path(os.path.relpath(path.resolve(), file.resolve().parent)).as_posix()
