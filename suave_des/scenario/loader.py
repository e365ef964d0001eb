"""Loads a scenario by its name, with everything that its missions need, and checks it once."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Protocol, TypedDict, Unpack

from suave_des.domain import GENERATE_SEARCH_PATH, MANAGER_GROUP, UNGROUND_MODE
from suave_des.errors import InputError, KeyPath, did_you_mean, shown
from suave_des.resources import find
from suave_des.scenario.layers import InputFiles, find_named, holder_of, scenario_layer
from suave_des.scenario.models import REASONERS, ManagerSettings, Scenario
from suave_des.scenario.modes import ModeTable, modes_of
from suave_des.scenario.problems import validated
from suave_des.scenario.signal_kinds import SignalTable, TableSignal, read_table
from suave_des.scenario.yamlfile import Layer, Location

_FILE_NAMES = "return a list of file names as text"


class _DeclaresFiles(Protocol):
    """A manager's class."""

    def input_files(self, settings: Mapping[str, Any], /) -> Collection[str]:
        """Name the files that the manager reads, with its settings."""


@dataclass(frozen=True)
class LoadedScenario:
    """A scenario with the content of every file that it names, but of ontologies only the paths.

    It can be pickled, so that it travels to worker processes by value.

    Attributes:
        scenario: the validated description.
        path: the scenario's file.
        ontologies: ontology files, in the order given.
        modes: functions and their modes.
        modes_path: the modes file.
        tables: times (s) and values of each table signal, by the signal's name.
        inputs: SHA-256 of each file read, by its name as shown to the user.
        layer: content of the scenario's files, with its lines.
        rules: files of rules as text, in the order in which they count.
        manager_files: where the files are that managers read, by their names as given.
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
    manager_files: Mapping[str, Path] = field(default_factory=dict)

    def manager_settings(self, manager: str) -> Mapping[str, Any]:
        """Settings of a manager that is not built in."""
        settings = (self.scenario.managers.model_extra or {}).get(manager)
        return settings if isinstance(settings, dict) else {}

    def manager_file(self, manager: str, name: str) -> Path:
        """Where a file is that a manager reads, by its name as given.

        It is looked for where the command is given; if the scenario has settings for the manager, beside that first.

        Raises:
            InputError: there is none.
        """
        if name in self.manager_files:
            return self.manager_files[name]
        places = [Path(name), self.path.parent / name]
        if self.layer.has(("managers", manager)):
            places.reverse()
        for place in places:
            if place.is_file():
                return place
        problem = f"manager {manager} reads this file, and it is not there"
        raise InputError(problem, file=name, remedy="give its path from here, or from the scenario that names it")

    def declared_files(self, manager: str, kind: _DeclaresFiles) -> Iterator[tuple[str, Path]]:
        """Yield name and place of each file that a manager's class declares.

        Raises:
            InputError: a file does not exist, or the class does not declare a list of names.
        """
        settings = self.manager_settings(manager)
        try:
            names = kind.input_files(settings)
            names = names if isinstance(names, str) else tuple(names)
        except InputError:
            raise
        except Exception as error:
            problem = f"manager {manager}: input_files raised {type(error).__name__}: {error}"
            is_missing = isinstance(error, KeyError) and error.args and error.args[0] not in settings
            remedy = f"give the setting, as in --manager-option {error.args[0]}=..." if is_missing else _FILE_NAMES
            raise InputError(problem, remedy=remedy) from error
        if isinstance(names, str) or not all(isinstance(name, str) for name in names):
            problem = f"manager {manager}: input_files gave {shown(names)}"
            raise InputError(problem, remedy=_FILE_NAMES)
        for name in names:
            yield name, self.manager_file(manager, name)

    def located(self, error: InputError) -> InputError:
        """Add file and line to an error about a name that only the ontology could check.

        Args:
            error: with a place such as "values.NAME" or "disabled_rules.NAME"; any other comes back as it is.
        """
        part, _, name = (error.place or "").partition(".")
        if error.file is not None or part not in ("values", "disabled_rules"):
            return error
        key_path: KeyPath = ("knowledge", part, name)
        if part == "disabled_rules":
            in_file = self.layer.data.get("knowledge", {}).get(part, [])
            if name not in in_file:
                return InputError(error.problem, place="--disable-rule", remedy=error.remedy)
            key_path = ("knowledge", part, in_file.index(name))
        return self.layer.error(error.problem, key_path, error.remedy)


class Replacements(TypedDict, total=False):
    """Replacements of a scenario's own files and settings, and additions to them.

    Attributes:
        ontologies: files to use in place of the scenario's.
        modes_file: file to use in place of the scenario's.
        reasoner: to use in place of the scenario's.
        rules: files of rules as text, in addition to the scenario's.
        disabled_rules: names of rules to disable, in addition to the scenario's.
        values: new values by key path, as of `with_values`.
        manager_options: settings of managers, by manager and key, over the scenario's.
    """

    ontologies: Sequence[str | Path]
    modes_file: str | Path | None
    reasoner: str | None
    rules: Sequence[str | Path]
    disabled_rules: Sequence[str]
    values: Mapping[str, Any]
    manager_options: Mapping[str, Mapping[str, Any]]


def load_scenario(name: str | Path | LoadedScenario, **replacements: Unpack[Replacements]) -> LoadedScenario:
    """Read and check a scenario and the files that it names.

    Files named inside a file are looked for beside it, then among the shipped ones.

        loaded = load_scenario("seams2023", reasoner="pellet")

    Args:
        name: path of a scenario file, or name of a shipped one with or without ".yaml"; a loaded scenario comes back
            unchanged, and its files cannot be replaced.
        replacements: ontologies, modes_file and reasoner to use in place of the scenario's; rules (files of rules as
            text) and disabled_rules (names of rules to switch off) besides the scenario's; values by key path and
            settings of managers over all that.

    Raises:
        InputError: a file that cannot be read, or a value that cannot be right, with file and line.
    """
    if isinstance(name, LoadedScenario):
        if given := [each for each, value in replacements.items() if value]:
            problem = f"{given[0]}: the scenario {name.scenario.name} is loaded already, with its files"
            raise InputError(problem, remedy=f"give {given[0]} to load_scenario")
        return name
    reasoner = replacements.get("reasoner")
    if reasoner is not None and reasoner not in REASONERS:
        remedy = did_you_mean(reasoner, REASONERS)
        raise InputError(f"there is no reasoner {shown(reasoner)}", place="--reasoner", remedy=remedy)
    files = InputFiles()
    path = find(name, "scenarios")
    return load_layer(files, scenario_layer(files, path), path, **replacements)


def load_layer(files: InputFiles, layer: Layer, path: Path, **replacements: Unpack[Replacements]) -> LoadedScenario:
    """Check a scenario that is merged over its base already, and read the other files that it names.

    Args:
        files: reader of the files.
        layer: the scenario.
        path: the scenario's file.
        replacements: as of load_scenario.

    Raises:
        InputError: as load_scenario does.
    """
    if "campaign" in layer.data and "scenario" in layer.data:
        remedy = f"suave-des campaign {path} --out DIR runs it; its scenario is {layer.data['scenario']}"
        raise layer.error("this is a campaign file, not a scenario", ("campaign",), remedy)
    layer = Layer({**layer.data, "name": _name(layer, path)}, layer.places)
    scenario = validated(layer, Scenario)
    knowledge = scenario.knowledge

    def named(key_path: KeyPath, name: str, kind: str, remedy: str | None = None) -> Path:
        if layer.has(key_path):
            return find_named(layer, key_path, name, kind, remedy)
        return find(name, kind, beside=path.parent)  # a default

    modes_file = replacements.get("modes_file")
    if modes_file is None:
        modes_path = named(("modes_file",), scenario.modes_file, "scenarios")
    else:
        modes_path = find(modes_file, "scenarios")
    modes = modes_of(files.yaml(modes_path))
    _check_modes(layer, scenario, modes)
    _check_managers(layer, scenario)

    ontologies = tuple(find(each, "ontology") for each in replacements.get("ontologies", ())) or tuple(
        named(("knowledge", "ontologies", index), each, "ontology") for index, each in enumerate(knowledge.ontologies)
    )
    remedy = "a file of rules as text, named relative to this"
    rules = (
        *(named(("knowledge", "rules", index), each, "ontology", remedy) for index, each in enumerate(knowledge.rules)),
        *map(Path, replacements.get("rules", ())),
    )
    for each in (*ontologies, *rules):
        files.ontology(each)

    tables = {}
    for signal_name, signal in scenario.signals.items():
        if isinstance(signal, TableSignal):
            remedy = "a CSV file with columns t_s,value, named relative to the file that names it"
            table_path = named(("signals", signal_name, "file"), signal.file, "scenarios", remedy)
            tables[signal_name], digest = read_table(table_path)
            files.note(table_path, digest)

    scenario = _replaced(scenario, replacements)
    loaded = LoadedScenario(scenario, path, ontologies, modes, modes_path, tables, files.inputs, layer, rules)
    return _with_options(loaded, replacements.get("values") or {}, replacements.get("manager_options") or {})


def _with_options(
    loaded: LoadedScenario, values: Mapping[str, Any], options: Mapping[str, Mapping[str, Any]]
) -> LoadedScenario:
    """Replace values by key path, and settings of managers."""
    for path, value in values.items():
        try:
            loaded = with_values(loaded, {path: value})
        except InputError as error:
            inside = error.problem if path in error.problem else f"{path}: {error.problem}"
            raise InputError(inside, place="--set", remedy=error.remedy) from None
    if options:
        managers = loaded.scenario.managers.model_dump(mode="json")
        for manager, settings in options.items():
            managers[manager] = {**managers.get(manager, {}), **settings}
        try:
            loaded = with_values(loaded, {"managers": managers})
        except InputError as error:
            raise InputError(error.problem, place="--manager-option", remedy=error.remedy) from None
    return loaded


def _replaced(scenario: Scenario, replacements: Replacements) -> Scenario:
    """The scenario as if it had given the replacements itself."""
    knowledge: dict[str, object] = {}
    if ontologies := replacements.get("ontologies"):
        knowledge["ontologies"] = tuple(map(str, ontologies))
    if reasoner := replacements.get("reasoner"):
        knowledge["reasoner"] = reasoner
    knowledge["rules"] = (*scenario.knowledge.rules, *map(str, replacements.get("rules", ())))
    knowledge["disabled_rules"] = (*scenario.knowledge.disabled_rules, *replacements.get("disabled_rules", ()))
    update: dict[str, object] = {"knowledge": scenario.knowledge.model_copy(update=knowledge)}
    if modes_file := replacements.get("modes_file"):
        update["modes_file"] = str(modes_file)
    return scenario.model_copy(update=update)


def _name(layer: Layer, path: Path) -> object:
    """The scenario's name: its own, or its file's; a base's would make its results look like the base's."""
    if "name" in layer.data and layer.place(("name",)).depth == 0:
        return layer.data["name"]
    stem = re.sub(r"[^A-Za-z0-9_.-]", "_", path.stem)[:90]
    return stem if re.match(r"[A-Za-z_]", stem) else f"_{stem}"


def _check_modes(layer: Layer, scenario: Scenario, modes: ModeTable) -> None:
    """Check that the modes file has the functions and modes that the mission and the scenario use."""
    for function in scenario.needed_functions():
        if function not in modes:
            remedy = did_you_mean(function, modes.functions, "its functions")
            problem = f"defines no function {function}, which the mission needs"
            raise InputError(problem, file=modes.source, remedy=remedy)
        if UNGROUND_MODE not in modes.modes(function):
            remedy = f"add {UNGROUND_MODE}: {{NODE: inactive}}, which a cancelled task sets"
            raise InputError(f"function {function} has no mode {UNGROUND_MODE}", file=modes.source, remedy=remedy)

    def check_function(function: str, problem: str, key_path: KeyPath) -> None:
        if function not in modes:
            remedy = did_you_mean(function, modes.functions, f"functions in {modes.source}")
            raise layer.error(f"{problem} {shown(function)}", key_path, remedy)

    def check_mode(function: str, mode: str, key_path: KeyPath) -> None:
        known = modes.modes(function)
        if mode not in known:
            remedy = did_you_mean(mode, known, f"its modes in {modes.source}")
            raise layer.error(f"function {function} has no mode {shown(mode)}", key_path, remedy)

    for function in scenario.functions:
        check_function(function, "the modes file has no function", ("functions", function))
    for function, mode in scenario.default_modes.items():
        check_function(function, "there is no function", ("default_modes", function))
        check_mode(function, mode, ("default_modes", function))
    for index, mode in enumerate(scenario.managers.bt.search_modes):
        key_path: KeyPath = ("managers", "bt", "search_modes", index)
        # The default names the shipped modes, which another modes file need not have: it matters only to bt.
        if layer.has(key_path):
            check_mode(GENERATE_SEARCH_PATH, mode, key_path)


def _check_managers(layer: Layer, scenario: Scenario) -> None:
    """Check that settings are for a manager that can exist: built in, registered, or given as module:Class."""
    others = scenario.managers.model_extra or {}
    registered = [point.name for point in entry_points(group=MANAGER_GROUP)] if others else []
    for name, settings in others.items():
        key_path = ("managers", name)
        if name not in registered and ":" not in name:
            remedy = did_you_mean(name, [*ManagerSettings.model_fields, *sorted(registered)])
            raise layer.error(f"there is no manager {shown(name)} with settings", key_path, f"{remedy}, module:Class")
        if not isinstance(settings, dict):
            raise layer.error(f"{shown(settings)} is not a mapping", key_path, "write `key: value` lines under it")


def with_values(loaded: LoadedScenario, values: Mapping[str, Any]) -> LoadedScenario:
    """Replace the values at some key paths of a scenario.

        slower = with_values(loaded, {"signals.water_visibility.period_s": 120})

    Args:
        loaded: the scenario to start from; it is left as it is.
        values: new values by key path, such as "signals.water_visibility.period_s" or "thruster_events.0.time_s"; the
            path of a distribution's own parameter ("calibration.altitude_error_m.mean") works where the scenario has
            one, and a whole distribution (a mapping) may stand for a number.

    Raises:
        InputError: a path leads nowhere, or a value is not allowed there or names another file.
    """
    data = loaded.scenario.model_dump(mode="json")
    for path, value in values.items():
        holder, key = holder_of(data, path)
        holder[key] = value
    layer = Layer(data, {(): Location(0, 1, loaded.path)})
    scenario = validated(layer, Scenario)
    if _named_files(scenario) != _named_files(loaded.scenario):
        remedy = "write a scenario for each, with `base` and the files that differ"
        raise InputError("files were read with the scenario and stay as they are", remedy=remedy)
    _check_modes(layer, scenario, loaded.modes)
    return replace(loaded, scenario=scenario)


def _named_files(scenario: Scenario) -> tuple[object, ...]:
    tables = tuple((name, getattr(signal, "file", None)) for name, signal in sorted(scenario.signals.items()))
    return scenario.knowledge.ontologies, scenario.knowledge.rules, scenario.modes_file, tables


def value_at(loaded: LoadedScenario, path: str) -> Any:
    """Return the value at a key path, as plain data.

    Raises:
        InputError: the path leads nowhere.
    """
    holder, key = holder_of(loaded.scenario.model_dump(mode="json"), path)
    return holder[key]
