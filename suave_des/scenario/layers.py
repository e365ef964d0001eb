"""A scenario file merged over the files that it builds on: plain data by key path, each with its file and line."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, NamedTuple

from suave_des.errors import InputError, KeyPath, did_you_mean, shown
from suave_des.files import read_bytes
from suave_des.resources import find, shipped_folder
from suave_des.scenario.physical import VehicleDescription
from suave_des.scenario.revision import Revision
from suave_des.scenario.yamlfile import Layer, YamlDocument, read_yaml

_KIND_KEYS = ("kind", "distribution")
"""Keys for the kind of a mapping: one of another kind replaces the base's, whose keys would not fit."""

_REMOVABLE_IN: tuple[KeyPath, ...] = (("signals",), ("knowledge", "values"))
"""Mappings of freely named entries, in which a null removes the base's entry."""


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
        below = (*path, key)
        known = base.get(key)
        if isinstance(known, dict) and isinstance(value, dict) and _same_kind(known, value):
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


_ONTOLOGY_LIMIT_BYTES = 100_000_000
_CHAIN_LIMIT = 20
_DEFAULT_VEHICLE = "bluerov2"


class _NamedPart(NamedTuple):
    """A part of a scenario that may be the name of a file, or differ from one that it names as its base."""

    key: str
    folder: str
    fields: tuple[str, ...]
    example: str


_NAMED_PARTS = (
    _NamedPart("revision", "scenarios/revisions", tuple(Revision.model_fields), '"2023"'),
    _NamedPart("vehicle", "scenarios/vehicles", tuple(VehicleDescription.model_fields), _DEFAULT_VEHICLE),
)


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
        self.inputs[_shown_name(path)] = sha256


def sha256_of(path: Path, limit: int) -> str:
    """SHA-256 of a file; raises as read_bytes does."""
    return hashlib.sha256(read_bytes(path, limit)).hexdigest()


def _shown_name(path: Path) -> str:
    for kind in ("ontology", "scenarios"):
        folder = shipped_folder(kind)
        if path.is_relative_to(folder):
            return f"shipped/{kind}/{path.relative_to(folder).as_posix()}"
    return path.as_posix()


def scenario_layer(files: InputFiles, path: Path, above: tuple[Path, ...] = ()) -> Layer:
    """Merge a scenario file over its base, with its revision and its vehicle written out in full.

    Args:
        files: reader.
        path: of the scenario.
        above: files of which this one is the base.

    Raises:
        InputError: a file that cannot be read, or is its own base; a revision that is not known.
    """
    layer: Layer = files.yaml(path, len(above))
    base = None
    if "base" in layer.data:
        base = find_named(layer, ("base",), layer.data["base"], "scenarios")
        _check_chain(layer, ("base",), (*above, path, base))
    layer = layer.without("base")
    if base is None and "vehicle" not in layer.data:
        layer = Layer({**layer.data, "vehicle": _DEFAULT_VEHICLE}, layer.places)
    for part in _NAMED_PARTS:
        layer = _with_whole_part(files, layer, part, len(above), inherited=base is not None)
    if base is None:
        return layer
    below = scenario_layer(files, base, (*above, path))
    for part in _NAMED_PARTS:
        if set(part.fields) <= layer.data.get(part.key, {}).keys():
            below = below.without(part.key)
    return merge(below, layer)


def find_named(layer: Layer, key_path: KeyPath, name: object, kind: str, remedy: str | None = None) -> Path:
    """Find a file that a layer names: beside the file in which its name is given, or shipped.

    Raises:
        InputError: there is none, with the line that names it.
    """
    if not isinstance(name, str) or not name:
        raise layer.error(f"{shown(name)} is not a file name", key_path, "a path, or the name of a shipped file")
    try:
        return find(name, kind, beside=layer.place(key_path).file.parent)
    except InputError as error:
        raise layer.error(f"{error.problem}: {shown(name)}", key_path, remedy or error.remedy) from None


def _check_chain(layer: Layer, key_path: KeyPath, chain: tuple[Path, ...]) -> None:
    resolved = [path.resolve() for path in chain]
    if len(set(resolved)) < len(resolved) or len(resolved) > _CHAIN_LIMIT:
        names = " -> ".join(path.name for path in chain)
        raise layer.error(f"the bases never end: {names}", key_path, "a file must not be its own base")


def _with_whole_part(files: InputFiles, layer: Layer, part: _NamedPart, depth: int, *, inherited: bool) -> Layer:
    """Return the layer with its revision or vehicle in full; differences from an inherited one stay as they are."""
    key = part.key
    if key not in layer.data:
        return layer
    value = layer.data[key]
    if not isinstance(value, dict):
        return layer.replaced(key, _part_layer(files, layer, (key,), value, part, depth + 1))
    if "base" in value:
        below = _part_layer(files, layer, (key, "base"), value["base"], part, depth + 1)
        return layer.replaced(key, merge(below, layer.below(key).without("base")))
    if not inherited and (missing := [field for field in part.fields if field not in value]):
        remedy = f"name the {key} to start from, such as base: {part.example}, beside what differs from it"
        raise layer.error(f"has no {missing[0]}", (key,), remedy)
    return layer


def _part_layer(
    files: InputFiles,
    named: Layer,
    key_path: KeyPath,
    name: object,
    part: _NamedPart,
    depth: int,
    above: tuple[Path, ...] = (),
) -> Layer:
    """A revision or vehicle by its name or path, merged over its own base."""
    if isinstance(name, int | float) and not isinstance(name, bool):
        name = f"{name:g}"  # 2023 and 1.5 need no quotes
    shipped = sorted(path.stem for path in shipped_folder(part.folder).glob("*.yaml"))
    if not isinstance(name, str) or not name:
        remedy = f"one of {', '.join(shipped)}, the path of a {part.key} file, or a mapping with base"
        raise named.error(f"{shown(name)} is not a {part.key}", key_path, remedy)
    try:
        path = find(name, part.folder, beside=named.place(key_path).file.parent)
    except InputError:
        remedy = f"{did_you_mean(name, shipped, 'shipped')}; or the path of a {part.key} file"
        raise named.error(f"there is no {part.key} {shown(name)}", key_path, remedy) from None
    _check_chain(named, key_path, (*above, path))
    layer: Layer = files.yaml(path, depth)
    if "base" not in layer.data:
        return layer
    below = _part_layer(files, layer, ("base",), layer.data["base"], part, depth + 1, (*above, path))
    return merge(below, layer.without("base"))


# Values by their key paths, such as signals.water_visibility.period_s.


def _parts(data: dict[str, Any], path: str) -> list[str]:
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
    here, parts = data, _parts(data, path)
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
