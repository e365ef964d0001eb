"""Loads a scenario by its name, merged over its bases, with everything that its missions need; checks it once."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol, TypedDict, Unpack

from suave_des.errors import InputError, KeyPath, did_you_mean, shown
from suave_des.files import read_bytes
from suave_des.resources import find, shipped_folder
from suave_des.scenario.models import REASONERS, Scenario
from suave_des.scenario.modes import ModeTable, modes_of
from suave_des.scenario.physical import SignalTable, TableSignal, read_table
from suave_des.scenario.yamlfile import Layer, Location, YamlDocument, read_yaml, validated

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
        if (manager, name) in self.manager_files:
            return self.manager_files[manager, name]
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
        if part == "values":
            return self.layer.error(error.problem, ("knowledge", part, name), error.remedy)
        in_file = self.layer.data.get("knowledge", {}).get(part, [])
        if name not in in_file:
            return InputError(error.problem, place="--disable-rule", remedy=error.remedy)
        return self.layer.error(error.problem, ("knowledge", part, in_file.index(name)), error.remedy)


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


def load_scenario(
    name: str | Path | LoadedScenario, *, over: Layer | None = None, **replacements: Unpack[Replacements]
) -> LoadedScenario:
    """Read and check a scenario and the files that it names.

    Files named inside a file are looked for beside it, then among the shipped ones.

        loaded = load_scenario("seams2023", reasoner="pellet")

    Args:
        name: path of a scenario file, or name of a shipped one with or without ".yaml"; a loaded scenario comes back
            unchanged, and its files cannot be replaced.
        over: content that goes over the file's, as that of a file of which it is the base.
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
    reasoner, modes_file = replacements.get("reasoner"), replacements.get("modes_file")
    if reasoner is not None and reasoner not in REASONERS:
        remedy = did_you_mean(reasoner, REASONERS)
        raise InputError(f"there is no reasoner {shown(reasoner)}", place="--reasoner", remedy=remedy)
    files = InputFiles()
    path = find(name, "scenarios")
    layer = scenario_layer(files, path, over)
    scenario = validated(layer, Scenario)
    knowledge = scenario.knowledge

    if modes_file is None:
        modes_path = find_named(layer, ("modes_file",), scenario.modes_file, "scenarios")
    else:
        modes_path = find(modes_file, "scenarios")
    modes = modes_of(files.yaml(modes_path))
    modes.check(scenario, layer)
    ontologies = tuple(find(each, "ontology") for each in replacements.get("ontologies", ())) or tuple(
        find_named(layer, ("knowledge", "ontologies", index), each, "ontology")
        for index, each in enumerate(knowledge.ontologies)
    )
    remedy = "a file of rules as text, named relative to this"
    rules = (
        *(
            find_named(layer, ("knowledge", "rules", index), each, "ontology", remedy)
            for index, each in enumerate(knowledge.rules)
        ),
        *map(Path, replacements.get("rules", ())),
    )
    for each in (*ontologies, *rules):
        files.ontology(each)
    tables = {}
    for signal_name, signal in scenario.signals.items():
        if isinstance(signal, TableSignal):
            remedy = "a CSV file with columns t_s,value, named relative to the file that names it"
            table_path = find_named(layer, ("signals", signal_name, "file"), signal.file, "scenarios", remedy)
            tables[signal_name], digest = read_table(table_path)
            files.note(table_path, digest)

    changed = {
        "ontologies": tuple(map(str, replacements.get("ontologies", ()))) or knowledge.ontologies,
        "rules": (*knowledge.rules, *map(str, replacements.get("rules", ()))),
        "disabled_rules": (*knowledge.disabled_rules, *replacements.get("disabled_rules", ())),
        "reasoner": reasoner or knowledge.reasoner,
    }
    update = {"knowledge": knowledge.model_copy(update=changed), "modes_file": str(modes_file or scenario.modes_file)}
    scenario = scenario.model_copy(update=update)
    loaded = LoadedScenario(scenario, path, ontologies, modes, modes_path, tables, files.inputs, layer, rules)
    loaded = _set(loaded, replacements.get("values") or {}, "--set")
    if options := replacements.get("manager_options"):
        managers = loaded.scenario.managers.model_dump(mode="json")
        managers |= {name: {**managers.get(name, {}), **settings} for name, settings in options.items()}
        loaded = _set(loaded, {"managers": managers}, "--manager-option")
    return loaded


def _set(loaded: LoadedScenario, values: Mapping[str, Any], option: str) -> LoadedScenario:
    """Replace the values that an option of the command line gives."""
    for path, value in values.items():
        try:
            loaded = with_values(loaded, {path: value})
        except InputError as error:
            _, _, key_path = (error.place or "").partition(", ")
            problem = f"{key_path}: {error.problem}" if key_path else error.problem
            raise InputError(problem, place=option, remedy=error.remedy) from None
    return loaded


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
    loaded.modes.check(scenario, layer)
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


# A scenario's files, merged over those that they build on.

_KIND_KEYS = ("kind", "distribution")
"""Keys for the kind of a mapping: one of another kind replaces the base's, whose keys would not fit."""
_REMOVABLE_IN: tuple[KeyPath, ...] = (("signals",), ("knowledge", "values"))
"""Mappings of freely named entries, in which a null removes the base's entry."""
_PARTS = {"revision": "scenarios/revisions", "vehicle": "scenarios/vehicles"}
"""Parts of a scenario that may be the name of a file, or differ from one that they name as their base."""
_ONTOLOGY_LIMIT_BYTES = 100_000_000
_CHAIN_LIMIT = 20
_DEFAULT_VEHICLE = "bluerov2"


class InputFiles:
    """Reads files and keeps the hash of each, for a manifest.

    Attributes:
        inputs: SHA-256 of each file read, as "shipped/KIND/NAME" if it is shipped, else its path as given.
    """

    def __init__(self) -> None:
        self.inputs: dict[str, str] = {}

    def yaml(self, path: Path, depth: int = 0) -> YamlDocument:
        """Read a YAML file."""
        document = read_yaml(path, depth)
        self.note(path, document.sha256)
        return document

    def ontology(self, path: Path) -> None:
        """Hash an ontology or a file of rules, which is parsed elsewhere."""
        self.note(path, sha256_of(path, _ONTOLOGY_LIMIT_BYTES))

    def note(self, path: Path, sha256: str) -> None:
        """Store the hash of a file that was read."""
        self.inputs[shown_name(path)] = sha256


def sha256_of(path: Path, limit: int) -> str:
    """SHA-256 of a file; raises as read_bytes does."""
    return hashlib.sha256(read_bytes(path, limit)).hexdigest()


def shown_name(path: Path) -> str:
    """Return the name of a file for users: "shipped/KIND/NAME" if it is shipped, else its path as given."""
    for kind in ("ontology", "scenarios"):
        if path.is_relative_to(folder := shipped_folder(kind)):
            return f"shipped/{kind}/{path.relative_to(folder).as_posix()}"
    return path.as_posix()


def find_named(layer: Layer, key_path: KeyPath, name: object, kind: str, remedy: str | None = None) -> Path:
    """Find a file that a layer names: beside the file in which its name is given, or shipped.

    Raises:
        InputError: there is none, with the line that names it.
    """
    if isinstance(name, int | float) and not isinstance(name, bool):
        name = f"{name:g}"  # revisions 2023 and 1.5 need no quotes
    if not isinstance(name, str) or not name:
        raise layer.error(f"{shown(name)} is not a file name", key_path, "a path, or the name of a shipped file")
    try:
        return find(name, kind, beside=layer.place(key_path).file.parent)
    except InputError as error:
        raise layer.error(f"{error.problem}: {shown(name)}", key_path, remedy or error.remedy) from None


def scenario_layer(files: InputFiles, path: Path, over: Layer | None = None) -> Layer:
    """Merge a scenario file over its bases, with its revision and its vehicle written out in full.

    Args:
        files: reader.
        path: of the scenario.
        over: what differs from it; None: nothing.

    Returns:
        The layer. Its name is its file's if it gives none: a base's would make its results look like the base's.

    Raises:
        InputError: a file that cannot be read, or is its own base; a revision that is not known.
    """
    own: Layer = files.yaml(path)
    if "campaign" in own.data and "scenario" in own.data:
        remedy = f"suave-des campaign {path} --out DIR runs it; its scenario is {own.data['scenario']}"
        raise own.error("this is a campaign file, not a scenario", ("campaign",), remedy)
    stem = re.sub(r"[^A-Za-z0-9_.-]", "_", path.stem)[:90]
    name = own.data.get("name", stem if re.match(r"[A-Za-z_]", stem) else f"_{stem}")
    layer = _over_its_base(files, _with_named_parts(own), "scenarios", (path,))
    layer = layer if over is None else merge(layer, _with_named_parts(over))
    layer = merge(Layer({"vehicle": {"base": str(find(_DEFAULT_VEHICLE, _PARTS["vehicle"]))}}, {}), layer)
    for part, folder in _PARTS.items():
        if "base" in (layer.data.get(part) or ()):
            layer = layer.replaced(part, _over_its_base(files, layer.below(part), folder, (layer.place((part,)).file,)))
    return Layer({**layer.data, "name": name}, layer.places)


def _with_named_parts(layer: Layer) -> Layer:
    """The layer, with the name of a part as the base of one that does not differ from it."""
    data, places = dict(layer.data), dict(layer.places)
    for part in _PARTS:
        if isinstance(data.get(part), str | int | float):
            data[part] = {"base": data[part]}
            places[(part, "base")] = layer.place((part,))
    return Layer(data, places)


def _over_its_base(files: InputFiles, layer: Layer, kind: str, chain: tuple[Path, ...]) -> Layer:
    """Merge a layer over the file that it names as its base, if any; `chain` is how that was reached."""
    if "base" not in layer.data:
        return layer
    path = find_named(layer, ("base",), layer.data["base"], kind)
    chain = (*chain, path)
    if len({each.resolve() for each in chain}) < len(chain) or len(chain) > _CHAIN_LIMIT:
        names = " -> ".join(each.name for each in chain)
        raise layer.error(f"the bases never end: {names}", ("base",), "a file must not be its own base")
    below: Layer = files.yaml(path, len(chain) - 1)
    below = _over_its_base(files, _with_named_parts(below) if kind == "scenarios" else below, kind, chain)
    return merge(below, layer.without("base"))


def merge(base: Layer, over: Layer) -> Layer:
    """Merge one layer over another: mappings are merged, all other values replaced."""
    replaced: set[KeyPath] = set()
    data = _merge(base.data, over.data, (), replaced)
    kept = {
        path: place
        for path, place in base.places.items()
        if not any(path[:length] in replaced for length in range(1, len(path) + 1))
    }
    return Layer(data, {**kept, **over.places})


def _merge(base: dict[str, Any], over: dict[str, Any], path: KeyPath, replaced: set[KeyPath]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in over.items():
        below, known = (*path, key), base.get(key)
        is_whole = not path and key in _PARTS and "base" in (value or ())
        if isinstance(known, dict) and isinstance(value, dict) and _same_kind(known, value) and not is_whole:
            merged[key] = _merge(known, value, below, replaced)
            continue
        replaced.add(below)
        if value is None and key in base and path in _REMOVABLE_IN:
            del merged[key]
        else:
            merged[key] = value
    return merged


def _same_kind(base: dict[str, Any], over: dict[str, Any]) -> bool:
    return all(over[key] == base.get(key, over[key]) for key in _KIND_KEYS if key in over)


# Values by their key paths, such as signals.water_visibility.period_s.


def _keys(data: dict[str, Any], path: str) -> list[str]:
    """The keys of a key path; names of managers may contain dots, and their settings may be missing."""
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


def holder_of(data: dict[str, Any], path: str) -> tuple[Any, Any]:
    """The mapping or list that holds the value at a key path of a scenario as plain data, and its key there.

    Raises:
        InputError: the path leads nowhere.
    """
    here, parts = data, _keys(data, path)
    for depth, part in enumerate(parts):
        if isinstance(here, list):
            if not (part.isascii() and part.isdigit() and len(part) < 10) or int(part) >= len(here):
                raise InputError(f"{path}: there is no entry {part}", remedy=f"entries are 0 to {len(here) - 1}")
        elif not isinstance(here, dict):
            raise InputError(f"{path}: {'.'.join(parts[:depth])} is a plain value", remedy="leave out what follows it")
        elif part not in here:
            raise InputError(f"{path}: unknown key", remedy=did_you_mean(part, sorted(map(str, here))))
        holder, key = here, int(part) if isinstance(here, list) else part
        here = here[key]
    return holder, key
