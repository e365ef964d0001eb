"""Import of the exemplar's own configuration as a scenario, and as a campaign if one is configured."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from suave_des.domain import WATER_VISIBILITY
from suave_des.errors import InputError, KeyPath
from suave_des.resources import find, shipped_folder
from suave_des.scenario.exemplar.campaign import campaign_text, commented, flow, heading, one_line
from suave_des.scenario.exemplar.files import (
    NODES,
    NOT_NEEDED,
    RUNNER,
    Configuration,
    ImportOptions,
    read_configuration,
)
from suave_des.scenario.exemplar.settings import RELEASES, Release, Setting, Settings, release_of, settings_of
from suave_des.scenario.layers import InputFiles, merge, scenario_layer
from suave_des.scenario.loader import LoadedScenario, load_layer
from suave_des.scenario.models import Scenario
from suave_des.scenario.yamlfile import Layer, Location

VISIBILITY = "signals.water_visibility."
"""Begins the key paths of the visibility's settings."""


@dataclass(frozen=True)
class Imported:
    """The exemplar's configuration in our form.

    Attributes:
        base: name or path of the scenario that the imported one builds on.
        why: the reason for this base.
        scenario: text of the scenario file.
        campaign: text of the campaign file; None if the configuration has no campaign, or none was requested.
        notes: a line for each parameter that has no counterpart or was changed.
    """

    base: str
    why: str
    scenario: str
    campaign: str | None
    notes: tuple[str, ...]


def import_config(files: Sequence[Path], out: Path, options: ImportOptions) -> Imported:
    """Convert mission, campaign and System Modes files of the exemplar. Nothing is written.

    Args:
        files: the exemplar's files, in any order; any revision's.
        out: path of the scenario to be, which determines how it names other files.
        options: the base, and other options of the import.

    Raises:
        InputError: a file cannot be read or is none of these, two contradict one another, they fit several revisions,
            or a value cannot be right.
    """
    if options.runner_seed is not None and options.campaign is None:
        problem = "the draws of the exemplar's runner are conditions of a campaign"
        raise InputError(problem, place="--runner-seed", remedy="add --campaign FILE")
    configuration = read_configuration(files)
    base, why = options.base, "as requested"
    release = None
    if base is None or options.revision is not None:
        release, why = release_of(configuration.nodes, options.revision)
        base = base or release.base
    base_path = find(base, "scenarios")
    if base_path.resolve() == out.resolve():
        raise InputError("cannot be its own base", file=out, remedy="give --out another name")
    reader = InputFiles()
    below = scenario_layer(reader, base_path, (out,))
    release = _fitting_release(release, below)
    notes = list(configuration.notes)
    settings = _with_kind_of_signal(settings_of(configuration, release, notes), below)
    try:
        loaded = load_layer(reader, merge(below, _layer(settings, configuration, release, out)), out)
    except InputError as error:
        raise _in_their_terms(error, settings) from None
    text = _campaign(configuration, loaded, out, options, notes)
    if unused := _not_needed(configuration):
        notes.append(unused)
    is_shipped = base_path.is_relative_to(shipped_folder("scenarios"))
    shown_base = base_path.stem if is_shipped else _relative(base_path, out)
    lines = [
        *heading(configuration.files),
        "# Values that are not given here are those of the base.",
        commented(0, f"base: {flow(shown_base)}", why),
        *_revision_lines(release),
        *_lines(configuration, settings, loaded, out),
    ]
    if notes:
        lines += ["", "# About the files:", *(f"#   {one_line(note)}" for note in notes)]
    return Imported(shown_base, why, "\n".join(lines) + "\n", text, tuple(notes))


def _with_kind_of_signal(settings: Settings, base: Layer) -> Settings:
    """The settings with the kind of the visibility, if there are some of it and the base has another kind."""
    kind = base.data.get("signals", {}).get(WATER_VISIBILITY, {}).get("kind")
    if kind == "sinusoid" or not any(path.startswith(VISIBILITY) for path in settings):
        return settings
    return {f"{VISIBILITY}kind": Setting("sinusoid", "as water_visibility_observer_node has it"), **settings}


def _fitting_release(asked: Release | None, base: Layer) -> Release:
    """Return the requested release, which the base must be of; otherwise the base's, or the most similar one."""
    of_base = str(base.data.get("revision", {}).get("name"))
    if asked is None:
        return RELEASES.get(of_base, RELEASES["1.5"])
    if not asked.changes and of_base != asked.name:
        raise InputError(
            f"the base is of revision {of_base}, and not {asked.name}",
            place="--revision",
            remedy=f"leave it out, or give a base of that revision, such as {asked.base}",
        )
    return asked


def _revision_lines(release: Release) -> Iterator[str]:
    """Values of a release whose code differs from that of the base."""
    if release.changes:
        yield "revision:"
        yield f"  name: {flow(release.name)}"
        yield from (f"  {part}: {flow(values)}" for part, values in release.changes.items())


def _layer(settings: Settings, configuration: Configuration, release: Release, out: Path) -> Layer:
    """The files' values as a scenario, each with its place there.

    Raises:
        InputError: two modes files are given.
    """
    data: dict[str, Any] = {"revision": {"name": release.name, **release.changes}} if release.changes else {}
    places: dict[KeyPath, Location] = {(): Location(0, 1, out)}
    for name, setting in settings.items():
        *parents, last = path = tuple(name.split("."))
        here = data
        for key in parents:
            here = here.setdefault(key, {})
        here[last] = setting.value
        if (parameter := setting.parameter) is not None:
            file = parameter.document.path
            places[path] = Location(0, parameter.line, file)
            for index in range(len(parameter.value) if isinstance(parameter.value, list) else 0):
                places[(*path, index)] = parameter.document.place((*parameter.key_path, index))
    if configuration.modes:
        first, *others = configuration.modes
        if any(other.sha256 != first.sha256 for other in others):
            remedy = f"give one: {first.path} is the other"
            raise InputError("there are two System Modes files", file=others[0].path, remedy=remedy)
        data["modes_file"] = str(first.path.resolve())
        places[("modes_file",)] = Location(0, 1, first.path)
    return Layer(data, places)


def _in_their_terms(error: InputError, settings: Settings) -> InputError:
    """Return the same error with node and key instead of the key path, if it is about a value from the user's files."""
    line, _, keys = (error.place or "").partition(", ")
    for path, setting in settings.items():
        parameter = setting.parameter
        if parameter is None or error.file != str(parameter.document.path):
            continue
        if keys == path or keys.startswith((f"{path}.", f"{path}[")):
            place = f"{line}, {parameter.keys}{keys.removeprefix(path)}"
            return InputError(error.problem, file=error.file, place=place, remedy=error.remedy)
    return error


def _campaign(
    configuration: Configuration, loaded: LoadedScenario, out: Path, options: ImportOptions, notes: list[str]
) -> str | None:
    """Return the text of the campaign file if one is configured and requested; otherwise note its parameters."""
    if options.campaign is None:
        notes += [
            f"{parameter.place}: no counterpart: a scenario has none; --campaign FILE writes a campaign file"
            for key, parameter in configuration.runner.items()
            if key not in (*NODES[RUNNER], *NOT_NEEDED)
        ]
        return None
    if RUNNER not in configuration.nodes:
        raise InputError(
            f"there is no campaign to import: no node {RUNNER} in {', '.join(configuration.files)}",
            remedy="give the campaign's configuration too, or leave --campaign out",
        )
    return campaign_text(configuration, loaded, _relative(out, options.campaign), options, notes)


def _not_needed(configuration: Configuration) -> str | None:
    """Make one note about all parameters that are irrelevant here."""
    keys = [
        f"{each.keys} ({each.source})"
        for each in configuration.parameters
        if each.key in NOT_NEEDED and each.key not in NODES[each.kind]
    ]
    return f"no counterpart, nor needed here: {', '.join(keys)}" if keys else None


def _lines(configuration: Configuration, settings: Settings, loaded: LoadedScenario, out: Path) -> Iterator[str]:
    """The values in the order of the scenario's reference, each with its source as a comment."""
    entries = {path: (setting.value, setting.comment) for path, setting in settings.items()}
    if entries.get("thruster_events", ([],))[0]:
        events = [event.model_dump(exclude_none=True) for event in loaded.scenario.thruster_events]
        entries["thruster_events"] = (events, entries["thruster_events"][1])
    for modes in configuration.modes[:1]:
        entries["modes_file"] = (_relative(modes.path, out), "as it is")
    order = list(Scenario.model_fields)
    above: list[str] = []
    for path in sorted(entries, key=lambda path: (order.index(path.split(".")[0]), path.split(".")[:-1])):
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


def _relative(path: Path, file: Path) -> str:
    """How a file names another: relative to its own folder."""
    return Path(os.path.relpath(path.resolve(), file.resolve().parent)).as_posix()
