"""Import of the exemplar's own configuration: a scenario of ours, and a campaign where a campaign is configured."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from suave_des.errors import InputError, KeyPath, place_text
from suave_des.resources import find, shipped_folder
from suave_des.scenario.exemplar_campaign import Campaign, campaign_of
from suave_des.scenario.exemplar_nodes import (
    COUNTERPARTS,
    MARKS,
    NOT_NEEDED,
    NOT_READ,
    RUNNER,
    Configuration,
    Found,
    no_counterpart,
    read_configuration,
)
from suave_des.scenario.exemplar_text import Entry, campaign_text, scenario_text
from suave_des.scenario.layers import Files, Layer, Location, merge, scenario_layer
from suave_des.scenario.loader import LoadedScenario, load_layer
from suave_des.scenario.models import ThrusterEvent

_EVENTS: KeyPath = ("thruster_events",)
_MODES: KeyPath = ("modes_file",)


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
    """Put mission, campaign and System Modes files of the exemplar into our form. Nothing is written.

    Args:
        files: the exemplar's files, in any order; either revision's.
        out: where the scenario will be, which decides how it names other files.
        base: scenario to build on; left out, the shipped one of the revision that the files look like.
        campaign: where the campaign will be, if one is wanted.
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
        notes.append(
            "battery: on, as battery_monitor is configured; the exemplar starts it in its extended mission only"
            " (without it: remove the scenario's part battery)"
        )
    loaded = _checked(reader, below, settings, configuration, out)
    wanted = _campaign(configuration, loaded, campaign, managers, files, notes)
    entries = [_entry(path, found, loaded) for path, found in settings.items()]
    if "battery_monitor" in configuration.nodes and not any(path[0] == "battery" for path in settings):
        entries.append(Entry(("battery",), {}, "battery_monitor, all at its defaults"))
    for modes in configuration.modes[:1]:
        entries.append(Entry(_MODES, _relative(modes.path, out), "as it is"))
    names = [path.name for path in files]
    is_shipped = base_path.is_relative_to(shipped_folder("scenarios"))
    shown_base = base_path.stem if is_shipped else _relative(base_path, out)
    return Imported(
        shown_base,
        why,
        scenario_text(names, shown_base, why, entries, notes),
        None if wanted is None or campaign is None else campaign_text(names, _relative(out, campaign), wanted),
        tuple(notes),
    )


def _guess(configuration: Configuration) -> tuple[str, str]:
    """The shipped scenario of the revision that the nodes belong to."""
    marks = [(MARKS[node], node) for node in configuration.nodes if node in MARKS]
    later = [node for name, node in marks if name == "release15"]
    if later:
        return "release15", f"only revision 1.5 has {later[0]}"
    earlier = [node for _, node in marks]
    if earlier:
        return "seams2023", f"only revision 2023 has {earlier[0]}"
    return "seams2023", "no node of revision 1.5 alone is there"


def _settings(configuration: Configuration, revision: str, notes: list[str]) -> dict[KeyPath, Found]:
    """What the files say of a scenario, by key path; a note for every other key of a mission's nodes."""
    not_read = NOT_READ.get(revision, {})
    missions: dict[KeyPath, Found] = {}
    runners: dict[KeyPath, Found] = {}
    for found in configuration.parameters:
        path = COUNTERPARTS[found.node].get(found.key)
        if path is None:
            if found.node != RUNNER:
                notes.append(no_counterpart(found, COUNTERPARTS[found.node]))
        elif (found.node, found.key) in not_read:
            notes.append(f"{found.place}: not taken over: {not_read[found.node, found.key]}")
        else:
            _add(runners if found.node == RUNNER else missions, path, found)
    for path, found in runners.items():
        other = missions.get(path)
        if other is not None and _normal(path, other.value) != _normal(path, found.value):
            notes.append(f"{other.place}: not taken over: the campaign's value counts ({found.place})")
    return missions | runners


def _add(settings: dict[KeyPath, Found], path: KeyPath, found: Found) -> None:
    other = settings.setdefault(path, found)
    if other is not found and _normal(path, other.value) != _normal(path, found.value):
        raise found.error(f"contradicts {other.place}", "make them alike, or leave one of them out")


def _normal(path: KeyPath, value: Any) -> Any:
    """A value such that equal ones are equal, however they are written."""
    if path == _EVENTS and isinstance(value, list):
        return ["".join(each.split()) if isinstance(each, str) else each for each in value]
    return value


def _checked(
    files: Files, below: Layer, settings: dict[KeyPath, Found], configuration: Configuration, out: Path
) -> LoadedScenario:
    """The scenario, checked as one from a file is; what is wrong is told in terms of the user's files.

    Raises:
        InputError: a value cannot be right, or two modes files are given.
    """
    data: dict[str, Any] = {}
    places: dict[KeyPath, Location] = {(): Location(0, 1, out)}
    for path, found in settings.items():
        here = data
        for key in path[:-1]:
            here = here.setdefault(str(key), {})
        here[str(path[-1])] = found.value
        places[path] = Location(0, found.line, found.document.path)
        for index in range(len(found.value) if isinstance(found.value, list) else 0):
            line = found.document.line((*found.key_path, index))
            places[(*path, index)] = Location(0, line, found.document.path)
    if "battery_monitor" in configuration.nodes:
        data.setdefault("battery", {})
    if configuration.modes:
        first, *others = configuration.modes
        if any(other.sha256 != first.sha256 for other in others):
            raise InputError(
                "there are two System Modes files", file=others[0].path, remedy=f"give one: {first.path} is the other"
            )
        data["modes_file"] = str(first.path.resolve())
        places[_MODES] = Location(0, 1, first.path)
    try:
        return load_layer(files, merge(below, Layer(data, places)), out)
    except InputError as error:
        raise _in_their_words(error, settings) from None


def _in_their_words(error: InputError, settings: dict[KeyPath, Found]) -> InputError:
    """The same error with node and key in place of our key path, if it is about a value from the user's files."""
    line, _, keys = (error.place or "").partition(", ")
    for path, found in settings.items():
        ours = place_text(0, path).removeprefix("line 0, ")
        if error.file == str(found.document.path) and (keys == ours or keys.startswith((f"{ours}.", f"{ours}["))):
            place = f"{line}, {found.keys}{keys.removeprefix(ours)}"
            return InputError(error.problem, file=error.file, place=place, remedy=error.remedy)
    return error


def _campaign(
    configuration: Configuration,
    loaded: LoadedScenario,
    campaign: Path | None,
    managers: Collection[str],
    files: Sequence[Path],
    notes: list[str],
) -> Campaign | None:
    """The campaign, if one is configured and wanted; else a note for each of its keys."""
    runner = {each.key: each for each in configuration.parameters if each.node == RUNNER}
    if campaign is None:
        for found in runner.values():
            if found.key not in COUNTERPARTS[RUNNER]:
                reason = NOT_NEEDED.get(found.key, "a scenario has none; --campaign FILE writes a campaign file")
                notes.append(f"{found.place}: no counterpart: {reason}")
        return None
    if RUNNER not in configuration.nodes:
        names = ", ".join(path.name for path in files)
        raise InputError(
            f"there is no campaign to import: no node {RUNNER} in {names}",
            remedy="give the campaign's configuration too, or leave --campaign out",
        )
    return campaign_of(runner, loaded, managers, [path.name for path in files], notes)


def _entry(path: KeyPath, found: Found, loaded: LoadedScenario) -> Entry:
    value = found.value
    if path == _EVENTS:
        value = [_event(event) for event in loaded.scenario.thruster_events]
    comment = f"{found.document.path.name}, line {found.line}: {found.keys}"
    if path == ("start", "y_m") and value == 2.0:
        comment += "; where 2.0 was asked for, the published runs have 2.56 to 2.59"
    return Entry(path, value, comment)


def _event(event: ThrusterEvent) -> dict[str, Any]:
    return {"thruster": event.thruster, "event": event.event, "time_s": event.time_s}


def _relative(path: Path, file: Path) -> str:
    """How a file names another: relative to its own folder."""
    return Path(os.path.relpath(path.resolve(), file.resolve().parent)).as_posix()
