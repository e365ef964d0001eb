"""YAML files as plain data with the line of every key, merged over the files that they build on.

Scalars follow the YAML 1.2 core schema, not PyYAML's 1.1: `1e3` is a number, `010` is ten, `1:30` and
`2023-02-04` are text. No constructor of PyYAML is involved, so no tag can build an object.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from yaml.reader import ReaderError

from suave_des.errors import InputError, KeyPath, line_error, place_text, shown
from suave_des.files import decode, read_bytes
from suave_des.resources import find, shipped_folder

SIZE_LIMIT_BYTES = 1_000_000
_VALUES_LIMIT = 100_000
"""An alias stands for all that it names, so that a few lines can be longer than memory."""


class Location(NamedTuple):
    """File and line of a value; depth 0 is the file that the user named, its base is 1, and so on."""

    depth: int
    line: int
    file: Path


Places = Mapping[KeyPath, Location]


@dataclass(frozen=True)
class Layer:
    """Plain data of one or several merged files, with the location of each key path.

    Attributes:
        data: the content.
        places: file and line of each key path that is in a file, and not a default.
        above: key path of the data within the file, for messages.
    """

    data: dict[str, Any]
    places: Places
    above: KeyPath = field(default=(), kw_only=True)

    def place(self, key_path: KeyPath) -> Location:
        """Location of a key path, or of the nearest part that holds it."""
        while key_path not in self.places:
            key_path = key_path[:-1]
        return self.places[key_path]

    def key_path(self, place: str) -> KeyPath:
        """Split a place such as "sweep.grid.start.x_m" into existing keys, which may contain dots."""
        path: list[str | int] = []
        here: Any = self.data
        while place and isinstance(here, Mapping):
            key = next((key for key in here if place == key or place.startswith(f"{key}.")), None)
            if key is None:
                break
            path.append(key)
            here, place = here[key], place[len(key) + 1 :]
        return tuple(path)

    def error(self, problem: str, key_path: KeyPath, remedy: str | None) -> InputError:
        """An error about the value at a key path."""
        place = self.place(key_path)
        text = place_text(place.line, (*self.above, *key_path))
        return InputError(problem, file=place.file, place=text, remedy=remedy)

    def below(self, key: str) -> Layer:
        """The mapping under a key."""
        places = {path[1:]: place for path, place in self.places.items() if path[:1] == (key,)}
        return Layer(self.data[key], {(): self.place((key,)), **places}, above=(*self.above, key))


@dataclass(frozen=True)
class YamlDocument(Layer):
    """One YAML file: its top-level mapping, of str, int, float, bool, None, list and dict with str keys.

    Attributes:
        path: the file.
        sha256: of the file's bytes, in hex.
    """

    path: Path
    sha256: str


def read_yaml(path: Path | str, depth: int = 0) -> YamlDocument:
    """Read a YAML file whose top level is a mapping.

    Args:
        path: of the file.
        depth: of its places: 0 for a file that the user named, 1 for its base, and so on.

    Raises:
        InputError: with the line: the file cannot be read, is not YAML, has a tag, a duplicate key or several
            documents, or has another top level.
    """
    path = Path(path)
    content = read_bytes(path, SIZE_LIMIT_BYTES)
    text = decode(path, content)
    return parse_yaml(text, path, depth, hashlib.sha256(content).hexdigest())


def parse_yaml(text: str, path: Path, depth: int = 0, sha256: str = "") -> YamlDocument:
    """Parse the text of a YAML file, as read_yaml does.

    Raises:
        InputError: as of read_yaml.
    """
    try:
        root = _composed(text)
        if not isinstance(root, yaml.MappingNode):
            problem, line = ("is empty", 1) if root is None else ("is not a mapping at its top level", _line(root))
            raise line_error(path, line, problem, "write `key: value` lines")
        reading = _Reading(path, depth)
        data = reading.plain(root, ())
    except ReaderError as error:
        problem = f"holds {chr(error.character)!r}, which YAML does not allow"
        raise line_error(path, text.count("\n", 0, error.position) + 1, problem, "remove it") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = f"is not valid YAML: {error.problem or error.context or 'cannot be parsed'}"
        remedy = "check indentation, colons and quotes here and just above; indent with spaces, not tabs"
        raise line_error(path, mark.line + 1 if mark else 1, problem, remedy) from None
    except RecursionError:
        problem = "is nested too deep, or an alias stands for something that holds it"
        raise InputError(problem, file=path, remedy="write it out") from None
    return YamlDocument(data, reading.places, path, sha256)


def read_value(text: str, option: str) -> Any:
    """Read a value that is given on the command line, as it would be read in a file.

    Raises:
        InputError: it is not YAML, or not plain data; its place is the option.
    """
    try:
        root = _composed(text)
        return None if root is None else _Reading(Path(option), 0).plain(root, ())
    except (yaml.YAMLError, InputError, RecursionError) as error:
        problem = error.problem if isinstance(error, InputError) else "is not YAML"
        raise InputError(f"{shown(text)}: {problem}", place=option, remedy="put text in quotes") from None


class _Composer(yaml.BaseLoader):
    """PyYAML up to its nodes; its constructors are not used."""


@lru_cache(maxsize=32)  # parts of scenarios are read again with each scenario that names them
def _composed(text: str) -> yaml.Node | None:
    return _Composer(text).get_single_node()


def _line(node: yaml.Node) -> int:
    return int(node.start_mark.line) + 1


_TAG = "tag:yaml.org,2002:"
_DIGITS = list("-+0123456789.")
for _name, _pattern, _first in (
    ("null", r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""]),
    ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", list("tTfF")),
    ("int", r"^[-+]?[0-9]{1,18}$", _DIGITS),
    ("float", r"^[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$", _DIGITS),
    ("float", r"^(?:[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$", _DIGITS),
):
    _Composer.add_implicit_resolver(_TAG + _name, re.compile(_pattern), _first)
_SCALARS: dict[str, Callable[[str], Any]] = {
    _TAG + "null": lambda text: None,
    _TAG + "bool": lambda text: {"true": True, "false": False}[text.lower()],
    _TAG + "int": int,
    _TAG + "float": lambda text: float(text.lower().replace(".inf", "inf").replace(".nan", "nan")),
    _TAG + "str": str,
}


class _Reading:
    """Turns nodes into plain data and notes the place of each key path."""

    def __init__(self, path: Path, depth: int) -> None:
        self._path, self._depth = path, depth
        self.places: dict[KeyPath, Location] = {(): Location(depth, 1, path)}

    def plain(self, node: yaml.Node, key_path: KeyPath) -> Any:
        """Data of a node."""
        if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
            return dict(self._entries(node, key_path))
        if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            return [self._below(item, item, (*key_path, index)) for index, item in enumerate(node.value)]
        tag = node.tag.replace(_TAG, "!!")
        if not isinstance(node, yaml.ScalarNode) or node.tag not in _SCALARS:
            raise self._error(node, key_path, f"the tag {shown(tag)} is not allowed", "remove the tag")
        try:
            return _SCALARS[node.tag](node.value)
        except (ValueError, KeyError):
            raise self._error(node, key_path, f"expected {tag}, got {shown(node.value)}", "remove the tag") from None

    def _entries(self, node: yaml.MappingNode, key_path: KeyPath) -> Iterator[tuple[str, Any]]:
        for key_node, value_node in node.value:
            key = key_node.value
            if not isinstance(key_node, yaml.ScalarNode) or not key.isprintable() or len(key) > 200:
                raise self._error(key_node, key_path, "a key must be short text", "write `key: value`")
            if (*key_path, key) in self.places:
                problem = f"the key {shown(key)} appears twice, first in line {self.places[(*key_path, key)].line}"
                raise self._error(key_node, (*key_path, key), problem, "keep one of them")
            yield key, self._below(key_node, value_node, (*key_path, key))

    def _below(self, place: yaml.Node, node: yaml.Node, key_path: KeyPath) -> Any:
        self.places[key_path] = Location(self._depth, _line(place), self._path)
        if len(self.places) > _VALUES_LIMIT:
            problem = f"expands to more than {_VALUES_LIMIT:,} values"
            raise self._error(place, key_path[:1], problem, "use fewer aliases")
        return self.plain(node, key_path)

    def _error(self, node: yaml.Node, key_path: KeyPath, problem: str, remedy: str) -> InputError:
        return InputError(problem, file=self._path, place=place_text(_line(node), key_path), remedy=remedy)


# A scenario's files, merged over those that they build on.

_KIND_KEYS = ("kind", "distribution")
"""Keys for the kind of a mapping: one of another kind replaces the base's, whose keys would not fit."""
_REMOVABLE_IN: tuple[KeyPath, ...] = (("signals",), ("knowledge", "values"))
"""Mappings of freely named entries, in which a null removes the base's entry."""
_PARTS = {"revision": "scenarios/revisions", "vehicle": "scenarios/vehicles"}
"""Parts of a scenario that may be the name of a file, or differ from one that they name as their base."""
_ONTOLOGY_LIMIT_BYTES = 100_000_000
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

    def note(self, path: Path, sha256: str | None = None) -> None:
        """Store the hash of a file that was read, or is an ontology or a file of rules, which are parsed elsewhere."""
        self.inputs[shown_name(path)] = sha256 or sha256_of(path, _ONTOLOGY_LIMIT_BYTES)


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
            whole = _over_its_base(files, layer.below(part), folder, (layer.place((part,)).file,))
            data = {**layer.data, part: whole.data}
            layer = Layer(data, {**layer.places, **{(part, *path): place for path, place in whole.places.items()}})
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
    if len({each.resolve() for each in chain}) < len(chain):
        names = " -> ".join(each.name for each in chain)
        raise layer.error(f"the bases never end: {names}", ("base",), "a file must not be its own base")
    below: Layer = files.yaml(path, len(chain) - 1)
    below = _over_its_base(files, _with_named_parts(below) if kind == "scenarios" else below, kind, chain)
    own = {key: value for key, value in layer.data.items() if key != "base"}
    return merge(below, Layer(own, layer.places, above=layer.above))


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
        merged[key] = value
        if value is None and key in base and path in _REMOVABLE_IN:
            del merged[key]
    return merged


def _same_kind(base: dict[str, Any], over: dict[str, Any]) -> bool:
    return all(over[key] == base.get(key, over[key]) for key in _KIND_KEYS if key in over)
