"""Loads a scenario by its name, with everything that its missions need; checks it once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypedDict, Unpack

from suave_des.arguments import plain_arguments
from suave_des.domain import WATER_VISIBILITY
from suave_des.errors import InputError, did_you_mean, shown, unknown
from suave_des.files import Json
from suave_des.resources import hashes, shown_name
from suave_des.scenario.models import REASONERS, Scenario, SignalTable, TableSignal, read_table
from suave_des.scenario.modes import ModeTable, modes_of
from suave_des.scenario.yamlfile import (
    Layer,
    Location,
    find_named,
    read_input,
    scenario_layer,
    validated,
)


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario with the content of every file that it names, but of ontologies only the paths.

    It can be pickled, so that it travels to worker processes by value.

    Attributes:
        ontologies: ontology files, in the order given.
        tables: times (s) and values of each table signal, by the signal's name.
        inputs: SHA-256 of each file read, by its name as shown to the user.
        layer: content of the scenario's files, with its lines.
        rules: files of rules as text, in the order in which they count.
        manager_files: where the files are that managers read, by manager and their names as given.
    """

    scenario: Scenario
    path: Path
    ontologies: tuple[Path, ...]
    modes: ModeTable
    modes_path: Path
    tables: Mapping[str, SignalTable]
    inputs: Mapping[str, str]
    layer: Layer = field(repr=False)
    rules: tuple[Path, ...] = ()
    manager_files: Mapping[tuple[str, str], Path] = field(default_factory=dict)

    def manager_settings(self, manager: str) -> Mapping[str, object]:
        """Settings of a manager that is not built in."""
        settings: dict[str, object] = (self.scenario.managers.model_extra or {}).get(manager, {})
        return settings

    def manager_file(self, manager: str, name: str) -> Path:
        """Where a file is that a manager reads, by its name as given.

        It is looked for where the command is given; if the scenario has settings for the manager,
        beside that first.

        Raises:
            InputError: there is none.
        """
        if (manager, name) in self.manager_files:
            return self.manager_files[manager, name]
        places = [Path(name), self.path.parent / name]
        if ("managers", manager) in self.layer.places:
            places.reverse()
        if found := next((place for place in places if place.is_file()), None):
            return found
        problem = f"manager {manager} reads this file, and it is not there"
        raise InputError(
            problem, file=name, remedy="give its path from here, or from the scenario that names it"
        )


class Replacements(TypedDict, total=False):
    """Replacements of a scenario's own files and settings, and additions to them, as
    `load_scenario` describes them.
    """

    ontologies: Sequence[str | Path]
    modes_file: str | Path | None
    reasoner: str | None
    rules: Sequence[str | Path]
    disabled_rules: Sequence[str]
    values: Mapping[str, object]
    manager_options: Mapping[str, Mapping[str, object]]


@plain_arguments
def load_scenario(
    name: str | Path | LoadedScenario,
    *,
    over: Layer | None = None,
    **replacements: Unpack[Replacements],
) -> LoadedScenario:
    """Read and check a scenario and the files that it names.

    Files named inside a file are looked for beside it, then among the shipped ones.

    Example:
        loaded = load_scenario("seams2023", reasoner="pellet")

    Args:
        name: path of a scenario file, or name of a shipped one with or without ".yaml"; a loaded
            scenario comes back unchanged, and its files cannot be replaced.
        over: content that goes over the file's, as that of a file of which it is the base.
        replacements: ontologies, modes_file and reasoner to use in place of the scenario's; rules
            (files of rules as text) and disabled_rules (names of rules to switch off) besides the
            scenario's; values by key path, as of with_values, and manager_options (settings by
            manager and key) over all that.

    Raises:
        InputError: a file that cannot be read, or a value that cannot be right, with file and line.
    """
    if isinstance(name, LoadedScenario):
        if given := [each for each, value in replacements.items() if value]:
            problem = (
                f"{given[0]}: the scenario {name.scenario.name} is loaded already, with its files"
            )
            raise InputError(problem, remedy=f"give {given[0]} to load_scenario")
        return name
    reasoner = replacements.get("reasoner")
    modes_file = replacements.get("modes_file")
    if reasoner is not None and reasoner not in REASONERS:
        raise unknown(
            f"there is no reasoner {shown(reasoner)}", reasoner, REASONERS, place="--reasoner"
        )
    inputs: dict[str, str] = {}
    layer = scenario_layer(inputs, name, over)
    scenario = validated(layer, Scenario)
    named, by = (scenario.modes_file, layer) if modes_file is None else (modes_file, None)
    modes_layer = read_input(inputs, named, "scenarios", by, ("modes_file",))
    modes = modes_of(modes_layer)
    modes.check(scenario, layer)
    ontologies, rules = _knowledge_files(scenario, layer, replacements)
    inputs |= hashes((*ontologies, *rules))
    tables = _tables(scenario, layer, inputs)
    scenario = _with_replaced_files(scenario, replacements)
    loaded = LoadedScenario(
        scenario, layer.path, ontologies, modes, modes_layer.path, tables, inputs, layer, rules
    )
    loaded = _set(loaded, replacements.get("values") or {}, "--set")
    options = replacements.get("manager_options")
    return _with_options(loaded, options) if options else loaded


def _with_options(
    loaded: LoadedScenario, options: Mapping[str, Mapping[str, object]]
) -> LoadedScenario:
    """Set what options say about managers over the settings of the scenario."""
    managers = loaded.scenario.managers.model_dump(mode="json")
    for name, settings in options.items():
        managers[name] = {**managers.get(name, {}), **settings}
    return _set(loaded, {"managers": managers}, "--manager-option")


def _knowledge_files(
    scenario: Scenario, layer: Layer, replacements: Replacements
) -> tuple[tuple[Path, ...], tuple[Path, ...]]:
    """Find the ontologies, those given instead of the scenario's or its own, and the files of rules,
    the scenario's before those given besides.
    """

    def in_scenario(key: str, remedy: str | None = None) -> list[Path]:
        names = enumerate(getattr(scenario.knowledge, key))
        return [
            find_named(each, "ontology", layer, ("knowledge", key, index), remedy)
            for index, each in names
        ]

    replaced = [find_named(each, "ontology") for each in replacements.get("ontologies", ())]
    ontologies = replaced or in_scenario("ontologies")
    rules = in_scenario("rules", "a file of rules as text, named relative to this")
    return tuple(ontologies), (*rules, *map(Path, replacements.get("rules", ())))


def _tables(scenario: Scenario, layer: Layer, inputs: dict[str, str]) -> dict[str, SignalTable]:
    """Read the tables of the signals that have one, by the signals' names; adds the files' hashes
    to `inputs`.
    """
    tables = {}
    remedy = "a CSV file with columns t_s,value, named relative to the file that names it"
    for name, signal in scenario.signals.items():
        if isinstance(signal, TableSignal):
            path = find_named(signal.file, "scenarios", layer, ("signals", name, "file"), remedy)
            tables[name], inputs[shown_name(path)] = read_table(path)
    return tables


def _with_replaced_files(scenario: Scenario, replacements: Replacements) -> Scenario:
    """Name in a scenario the files and settings that are used in place of its own, and besides."""
    knowledge = scenario.knowledge
    rules = replacements.get("rules", ())
    disabled = replacements.get("disabled_rules", ())
    changed = {
        "ontologies": tuple(map(str, replacements.get("ontologies", ()))) or knowledge.ontologies,
        "rules": (*knowledge.rules, *map(str, rules)),
        "disabled_rules": (*knowledge.disabled_rules, *disabled),
        "reasoner": replacements.get("reasoner") or knowledge.reasoner,
    }
    update = {
        "knowledge": knowledge.model_copy(update=changed),
        "modes_file": str(replacements.get("modes_file") or scenario.modes_file),
    }
    return scenario.model_copy(update=update)


def _set(loaded: LoadedScenario, values: Mapping[str, object], option: str) -> LoadedScenario:
    """Replace the values that an option of the command line gives."""
    for path, value in values.items():
        try:
            loaded = with_values(loaded, {path: value})
        except InputError as error:
            problem = f"{error.place}: {error.problem}" if error.place else error.problem
            raise InputError(problem, place=option, remedy=error.remedy) from None
    return loaded


@plain_arguments
def with_values(loaded: LoadedScenario, values: Mapping[str, object]) -> LoadedScenario:
    """Replace the values at some key paths of a scenario.

    Example:
        slower = with_values(loaded, {"signals.water_visibility.period_s": 120})

    Args:
        loaded: is left as it is.
        values: new values by key path, such as "signals.water_visibility.period_s" or
            "thruster_events.0.time_s"; the path of a distribution's own parameter
            ("calibration.altitude_error_m.mean") works where the scenario has one, and a whole
            distribution (a mapping) may stand for a number.

    Raises:
        InputError: a path leads nowhere, or a value is not allowed there or names another file.
    """
    data = loaded.scenario.model_dump(mode="json")
    for path, value in values.items():
        holder, key = holder_of(data, path)
        holder[key] = value
    layer = Layer(data, {(): Location(0, 1, loaded.path)})
    try:
        scenario = validated(layer, Scenario)
        if _named_files(scenario) != _named_files(loaded.scenario):
            remedy = "write a scenario for each, with `base` and the files that differ"
            problem = "files were read with the scenario and stay as they are"
            raise InputError(problem, remedy=remedy)
        loaded.modes.check(scenario, layer)
    except InputError as error:  # the value is not in the scenario's file, nor in a line of it
        key_path = (error.place or "").removeprefix("line 1").removeprefix(", ")
        raise InputError(error.problem, place=key_path or None, remedy=error.remedy) from None
    return replace(loaded, scenario=scenario)


def _named_files(scenario: Scenario) -> tuple[object, ...]:
    tables = tuple(
        (name, getattr(signal, "file", None)) for name, signal in sorted(scenario.signals.items())
    )
    return scenario.knowledge.ontologies, scenario.knowledge.rules, scenario.modes_file, tables


def value_at(loaded: LoadedScenario, path: str) -> Any:
    """Return the value at a key path, as plain data; it is an InputError if the path leads
    nowhere.
    """
    holder, key = holder_of(loaded.scenario.model_dump(mode="json"), path)
    return holder[key]


# Values by their key paths, such as signals.water_visibility.period_s.


def full_path(data: Json, path: str) -> str:
    """Return a key path of a scenario in full: a signal needs no `signals.`, and visibility is
    water_visibility.
    """
    first, *rest = path.split(".")
    signal = WATER_VISIBILITY if first == "visibility" else first
    return (
        ".".join(("signals", signal, *rest))
        if first not in data and signal in data.get("signals", ())
        else path
    )


def _keys(data: Json, path: str) -> list[str]:
    """The keys of a key path; names of managers may contain dots, and their settings may be
    missing.
    """
    path = full_path(data, path)
    first, _, rest = path.partition(".")
    if first != "managers" or ":" not in rest:
        return path.split(".")
    managers = data["managers"]
    named = max((name for name in managers if rest.startswith(f"{name}.")), key=len, default=None)
    if named is None:
        module, _, below = rest.partition(":")
        named = f"{module}:{below.partition('.')[0]}"
    keys = rest.removeprefix(named).removeprefix(".").split(".")
    settings = managers.setdefault(named, {})
    if isinstance(settings, dict) and keys != [""]:
        settings.setdefault(keys[0], None)
    return ["managers", named, *(keys if keys != [""] else [])]


def _has(holder: object, key: str) -> bool:
    return isinstance(holder, dict) and key in holder


def _did_you_mean(key: str, holder: Json, *, is_top: bool) -> str:
    """Return the remedy for an unknown key; at the top of a scenario one that a section has is
    found.
    """
    named = list(map(str, holder))
    if is_top and "signals" in holder:
        sections = sorted(name for name, below in holder.items() if _has(below, key))
        if sections:
            return f"did you mean {' or '.join(f'{name}.{key}' for name in sections)}?"
        named += ["visibility", *holder["signals"]]
    return did_you_mean(key, sorted(named))


def holder_of(data: Json, path: str) -> tuple[Any, Any]:
    """The mapping or list with the value at a key path of plain data, and its key; an InputError if
    there is none.
    """
    parts = _keys(data, path)
    here: Any = data
    for depth, part in enumerate(parts):
        holder = here
        key: int | str = part
        if isinstance(holder, list):
            key = _index(path, part, len(holder))
        elif not isinstance(holder, dict):
            above = ".".join(parts[:depth])
            raise InputError(
                f"{path}: {above} is a plain value", remedy="leave out what follows it"
            )
        elif part not in holder:
            remedy = _did_you_mean(part, holder, is_top=holder is data)
            raise InputError(f"{path}: unknown key", remedy=remedy)
        here = holder[key]
    return holder, key


def _index(path: str, part: str, length: int) -> int:
    is_number = part.isascii() and part.isdigit() and len(part) < 10
    if not is_number or int(part) >= length:
        raise InputError(
            f"{path}: there is no entry {part}", remedy=f"entries are 0 to {length - 1}"
        )
    return int(part)
