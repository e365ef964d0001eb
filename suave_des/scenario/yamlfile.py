"""YAML files read as plain data, with the line of every key; no tag can run code, and no alias can explode.

Scalars follow the YAML 1.2 core schema, not PyYAML's 1.1: `1e3` is a number, `010` is ten, `1:30` and
`2023-02-04` are text. No constructor of PyYAML is involved, so no tag can build an object.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from yaml.reader import ReaderError

from suave_des.errors import InputError, KeyPath, place_text, shown
from suave_des.files import decode, read_bytes

SIZE_LIMIT_BYTES = 1_000_000
NODE_LIMIT = 100_000
DEPTH_LIMIT = 100
KEY_LIMIT = 200

_SHORTER = "write it out, with fewer values or aliases"
_TAG = "tag:yaml.org,2002:"


class Location(NamedTuple):
    """File and line of a value; depth 0 is the file that the user named, its base is 1, and so on."""

    depth: int
    line: int
    file: Path


@dataclass(frozen=True)
class Layer:
    """Plain data of one or several merged files, with the location of each key path."""

    data: dict[str, Any]
    places: Mapping[KeyPath, Location]

    def place(self, key_path: KeyPath) -> Location:
        """Location of a key path, or of the nearest part that holds it."""
        for length in range(len(key_path), 0, -1):
            if (place := self.places.get(key_path[:length])) is not None:
                return place
        return self.places[()]

    def has(self, key_path: KeyPath) -> bool:
        """Whether a key path is in a file, and not a default."""
        return key_path in self.places

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
        return InputError(problem, file=place.file, place=place_text(place.line, key_path), remedy=remedy)

    def without(self, key: str) -> Layer:
        """The same without one key of the top level."""
        data = {other: value for other, value in self.data.items() if other != key}
        return Layer(data, {path: place for path, place in self.places.items() if path[:1] != (key,)})

    def below(self, key: str) -> Layer:
        """The mapping under a key."""
        places = {path[1:]: place for path, place in self.places.items() if path[:1] == (key,)}
        return Layer(self.data[key], places)

    def replaced(self, key: str, value: Layer) -> Layer:
        """The same with another mapping under a key."""
        others = self.without(key)
        places = {(key, *path): place for path, place in value.places.items()}
        return Layer({**others.data, key: value.data}, {**others.places, **places})


@dataclass(frozen=True)
class YamlDocument(Layer):
    """One YAML file: its top-level mapping, of str, int, float, bool, None, list and dict with str keys.

    Attributes:
        path: the file.
        sha256: of the file's bytes, in hex.
    """

    path: Path
    sha256: str

    def line(self, key_path: KeyPath) -> int:
        """Line of a key path, or of the nearest part of the file that holds it."""
        return self.place(key_path).line


def read_yaml(path: Path | str, depth: int = 0) -> YamlDocument:
    """Read a YAML file whose top level is a mapping.

    Args:
        path: of the file.
        depth: of its places: 0 for a file that the user named, 1 for its base, and so on.

    Raises:
        InputError: with the line: the file cannot be read, is not YAML, has a tag, a duplicate key or several
            documents, contains itself, expands to more than NODE_LIMIT values, or has another top level.
    """
    path = Path(path)
    content = read_bytes(path, SIZE_LIMIT_BYTES)
    text = decode(path, content)
    try:
        root = _composed(text)
    except ReaderError as error:
        place = f"line {text.count(chr(10), 0, error.position) + 1}"
        problem = f"holds the character {chr(error.character)!r}, which is not allowed in YAML"
        raise InputError(problem, file=path, place=place, remedy="remove it") from None
    except yaml.MarkedYAMLError as error:
        raise _yaml_error(path, error) from None
    if root is None:
        raise InputError("is empty", file=path, place="line 1", remedy="a mapping of keys to values is needed")
    if not isinstance(root, yaml.MappingNode):
        problem = "is not a mapping at its top level"
        raise InputError(problem, file=path, place=f"line {_line(root)}", remedy="write `key: value` lines")
    reading = _Reading(path, depth)
    data = reading.plain(root, (), ())
    return YamlDocument(data, reading.places, path, hashlib.sha256(content).hexdigest())


def read_value(text: str, option: str) -> Any:
    """Read a value that is given on the command line, as it would be read in a file.

    Raises:
        InputError: it is not YAML, or not plain data; its place is the option.
    """
    try:
        root = _Composer(text).get_single_node()
        return None if root is None else _Reading(Path(option)).plain(root, (), ())
    except (ReaderError, yaml.MarkedYAMLError, InputError) as error:
        problem = error.problem if isinstance(error, InputError) else "is not YAML"
        raise InputError(f"{shown(text)}: {problem}", place=option, remedy="put text in quotes") from None


@lru_cache(maxsize=32)  # parts of scenarios are read again with each scenario that names them
def _composed(text: str) -> yaml.Node | None:
    return _Composer(text).get_single_node()


def _yaml_error(path: Path, error: yaml.MarkedYAMLError) -> InputError:
    mark = error.problem_mark or error.context_mark
    problem = error.problem or error.context or "cannot be parsed"
    if isinstance(error, _TooMuchError):
        remedy = _SHORTER
    elif "but found another document" in problem:
        problem, remedy = "a second document begins here", "keep one document: remove the line ---"
    else:
        tab = "\\t" in problem
        problem = f"is not valid YAML: {problem}"
        remedy = "indent with spaces, not tabs" if tab else "check indentation, colons and quotes here and just above"
    return InputError(problem, file=path, place=f"line {mark.line + 1}" if mark else None, remedy=remedy)


def _line(node: yaml.Node) -> int:
    return int(node.start_mark.line) + 1


class _TooMuchError(yaml.MarkedYAMLError):
    """A file that is well-formed but unreasonably nested or long."""

    def __init__(self, mark: Any, *, deep: bool) -> None:
        limit = f"is nested more than {DEPTH_LIMIT} deep" if deep else f"expands to more than {NODE_LIMIT:,} values"
        super().__init__(problem=limit, problem_mark=mark)


class _Composer(yaml.BaseLoader):
    """PyYAML up to its nodes, of bounded number and depth; its constructors are not used."""

    _depth = 0
    _nodes = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """One node with all below it."""
        self._depth += 1
        self._nodes += 1
        if self._depth > DEPTH_LIMIT or self._nodes > NODE_LIMIT:
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise _TooMuchError(mark, deep=self._depth > DEPTH_LIMIT)
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


_DIGITS = set("-+0123456789.")
for _name, _pattern, _first in (
    ("null", r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""]),
    ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", list("tTfF")),
    ("int", r"^[-+]?[0-9]{1,18}$", sorted(_DIGITS)),
    ("float", r"^[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$", sorted(_DIGITS)),
    ("float", r"^(?:[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$", ["-", "+", "."]),
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

    def __init__(self, path: Path, depth: int = 0) -> None:
        self.path, self._depth = path, depth
        self.places: dict[KeyPath, Location] = {(): Location(depth, 1, path)}
        self._count = 0

    def plain(self, node: yaml.Node, key_path: KeyPath, above: tuple[int, ...]) -> Any:
        """Data of a node; `above` are the identities of the nodes that hold it."""
        self._count += 1
        if self._count > NODE_LIMIT or len(above) > DEPTH_LIMIT:
            error = _TooMuchError(node.start_mark, deep=self._count <= NODE_LIMIT)
            raise self._error(self.places[key_path[:1]].line, key_path[:1], str(error.problem), _SHORTER)
        line = _line(node)
        if id(node) in above:
            raise self._error(line, key_path, "an alias stands for something that holds it", "write it out")
        inside = (*above, id(node))
        if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
            return self._mapping(node, key_path, inside)
        if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            for index, item in enumerate(node.value):
                self.places[(*key_path, index)] = Location(self._depth, _line(item), self.path)
            return [self.plain(item, (*key_path, index), inside) for index, item in enumerate(node.value)]
        tag = node.tag.replace(_TAG, "!!")
        if not isinstance(node, yaml.ScalarNode) or node.tag not in _SCALARS:
            remedy = "use plain text, numbers, lists and mappings"
            raise self._error(line, key_path, f"the tag {shown(tag)} is not allowed", remedy)
        try:
            return _SCALARS[node.tag](node.value)
        except (ValueError, KeyError):
            raise self._error(line, key_path, f"expected {tag}, got {shown(node.value)}", "remove the tag") from None

    def _mapping(self, node: yaml.MappingNode, key_path: KeyPath, inside: tuple[int, ...]) -> dict[str, Any]:
        data: dict[str, Any] = {}
        for key_node, value_node in node.value:
            line, key = _line(key_node), str(key_node.value)
            below = (*key_path, key)
            if not isinstance(key_node, yaml.ScalarNode):
                raise self._error(line, key_path, "a key must be text", "write `key: value`")
            if not key.isprintable() or len(key) > KEY_LIMIT:
                remedy = "use a short name of letters and digits"
                raise self._error(line, key_path, f"{shown(key)} is not a valid key", remedy)
            if key in data:
                problem = f"the key {shown(key)} appears twice, first in line {self.places[below].line}"
                raise self._error(line, below, problem, "keep one of them")
            if key == "<<":
                raise self._error(line, key_path, "the merge key << is not supported", "write the keys out")
            self.places[below] = Location(self._depth, line, self.path)
            data[key] = self.plain(value_node, below, inside)
        return data

    def _error(self, line: int, key_path: KeyPath, problem: str, remedy: str) -> InputError:
        return InputError(problem, file=self.path, place=place_text(line, key_path), remedy=remedy)
