"""YAML files as plain data with the line of every key, and their validation by pydantic with errors that name it.

Scalars follow the YAML 1.2 core schema, not PyYAML's 1.1: `1e3` is a number, `010` is ten, `1:30` and
`2023-02-04` are text. No constructor of PyYAML is involved, so no tag can build an object.
"""

from __future__ import annotations

import hashlib
import re
import typing
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails
from yaml.reader import ReaderError

from suave_des.errors import InputError, KeyPath, did_you_mean, place_text, shown
from suave_des.files import decode, read_bytes

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
        places: file and line of each key path.
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

    def line(self, key_path: KeyPath) -> int:
        """Line of a key path, or of the nearest part that holds it."""
        return self.place(key_path).line

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
        text = place_text(place.line, (*self.above, *key_path))
        return InputError(problem, file=place.file, place=text, remedy=remedy)

    def without(self, key: str) -> Layer:
        """The same without one key of the top level."""
        data = {other: value for other, value in self.data.items() if other != key}
        places = {path: place for path, place in self.places.items() if path[:1] != (key,)}
        return Layer(data, places, above=self.above)

    def below(self, key: str) -> Layer:
        """The mapping under a key."""
        places = {path[1:]: place for path, place in self.places.items() if path[:1] == (key,)}
        return Layer(self.data[key], {(): self.place((key,)), **places}, above=(*self.above, key))

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
            raise InputError(problem, file=path, place=f"line {line}", remedy="write `key: value` lines")
        reading = _Reading(path, depth)
        data = reading.plain(root, ())
    except ReaderError as error:
        problem, line = (
            f"holds {chr(error.character)!r}, which YAML does not allow",
            text.count("\n", 0, error.position) + 1,
        )
        raise InputError(problem, file=path, place=f"line {line}", remedy="remove it") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = f"is not valid YAML: {error.problem or error.context or 'cannot be parsed'}"
        remedy = "check indentation, colons and quotes here and just above; indent with spaces, not tabs"
        raise InputError(problem, file=path, place=f"line {mark.line + 1}" if mark else None, remedy=remedy) from None
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
            return self._mapping(node, key_path)
        if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            return [self._below(item, item, (*key_path, index)) for index, item in enumerate(node.value)]
        tag = node.tag.replace(_TAG, "!!")
        if not isinstance(node, yaml.ScalarNode) or node.tag not in _SCALARS:
            raise self._error(node, key_path, f"the tag {shown(tag)} is not allowed", "remove the tag")
        try:
            return _SCALARS[node.tag](node.value)
        except (ValueError, KeyError):
            raise self._error(node, key_path, f"expected {tag}, got {shown(node.value)}", "remove the tag") from None

    def _mapping(self, node: yaml.MappingNode, key_path: KeyPath) -> dict[str, Any]:
        data: dict[str, Any] = {}
        for key_node, value_node in node.value:
            key = key_node.value
            if not isinstance(key_node, yaml.ScalarNode) or not key.isprintable() or len(key) > 200:
                raise self._error(key_node, key_path, "a key must be short text", "write `key: value`")
            if key in data:
                problem = f"the key {shown(key)} appears twice, first in line {self.places[(*key_path, key)].line}"
                raise self._error(key_node, (*key_path, key), problem, "keep one of them")
            data[key] = self._below(key_node, value_node, (*key_path, key))
        return data

    def _below(self, place: yaml.Node, node: yaml.Node, key_path: KeyPath) -> Any:
        self.places[key_path] = Location(self._depth, _line(place), self._path)
        if len(self.places) > _VALUES_LIMIT:
            problem, line = f"expands to more than {_VALUES_LIMIT:,} values", self.places[key_path[:1]].line
            raise InputError(problem, file=self._path, place=place_text(line, key_path[:1]), remedy="use fewer aliases")
        return self.plain(node, key_path)

    def _error(self, node: yaml.Node, key_path: KeyPath, problem: str, remedy: str) -> InputError:
        return InputError(problem, file=self._path, place=place_text(_line(node), key_path), remedy=remedy)


_TAGGED = ("kind", "distribution", "type")
"""Keys whose word tells the members of a union apart."""
_NAME, _INDEX = "NAME", "[]"
"""Stand for any name, and any number of an entry, in the key path of a model."""
AnyModel = TypeVar("AnyModel", bound=BaseModel)


def validated(layer: Layer, model: type[AnyModel]) -> AnyModel:
    """Return the data of a layer as a model.

    Raises:
        InputError: they are not valid, see input_error.
    """
    try:
        return model.model_validate(layer.data)
    except ValidationError as error:
        raise input_error(error, layer, model) from None


def input_error(error: ValidationError, layer: Layer, model: Any) -> InputError:
    """Return the first problem, of the user's own file before its base, as one error that counts the others.

    Args:
        error: what pydantic raised for layer.data.
        layer: the data with their places.
        model: the model, or other type, that was validated.
    """

    def order(found: tuple[KeyPath, ErrorDetails]) -> tuple[int, int, int]:
        # A misspelt key is also a missing one, and a list with a wrong entry too short: report these last.
        place = layer.place(found[0])
        return {"missing": 1, "too_short": 2}.get(found[1]["type"], 0), place.depth, place.line

    found = [(_key_path(each, layer), each) for each in error.errors(include_url=False)]
    path, first = min(found, key=order)
    problem, remedy = _texts(first, path, model)
    more = f"and {len(found) - 1} more" if len(found) > 1 else None
    return layer.error(problem, path, "; ".join(filter(None, (remedy, more))) or None)


def problem_and_remedy(error: ValidationError, data: dict[str, Any], model: Any) -> tuple[KeyPath, str, str | None]:
    """Return the first problem of data that are in no file: its key path, what is wrong, and what would be right.

    Args:
        error: what pydantic raised for the data.
        data: what was validated.
        model: the model, or other type, that they were to be.
    """
    first = min(error.errors(include_url=False), key=lambda detail: detail["type"] == "missing")
    path = (*_key_path(first, Layer(data, {})), *first.get("ctx", {}).get("keys", "").split()[:1])
    return path, *_texts(first, path, model)


def models_within(wanted: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], type[BaseModel]]]:
    """Yield every model that a type holds, with its key path; members of a union have the same."""
    if isinstance(wanted, type) and issubclass(wanted, BaseModel):
        yield path, wanted
        for name, field in wanted.model_fields.items():
            yield from models_within(field.annotation, (*path, name))
        return
    entry = {dict: (_NAME,), tuple: (_INDEX,)}.get(typing.get_origin(wanted), ())
    for argument in typing.get_args(wanted):
        yield from models_within(argument, (*path, *entry))


def _key_path(detail: ErrorDetails, layer: Layer) -> KeyPath:
    """The key path in the file: pydantic's location without what is no key, such as the tags of union members.

    Of keys that do not fit together, and have a place each, it is the one in the user's own file.
    """
    path: list[str | int] = []
    here: Any = layer.data
    for key in detail["loc"]:
        if isinstance(here, dict) and key in here:
            here = here[key]
        elif isinstance(here, list) and isinstance(key, int):
            here = here[key] if key < len(here) else None
        else:
            is_inside_text = isinstance(here, str) and key != "number"  # of a thruster event, and not a tag
            if not is_inside_text and not (detail["type"] == "missing" and key == detail["loc"][-1]):
                continue
        path.append(key)
    context = detail.get("ctx", {})
    given = context.get("keys", context.get("discriminator", "").strip("'")).split()
    candidates: list[KeyPath] = [(*path, key) for key in given if layer.has((*path, key))]
    return min(candidates, key=lambda candidate: layer.place(candidate).depth, default=tuple(path))


def _texts(detail: ErrorDetails, path: KeyPath, model: Any) -> tuple[str, str | None]:
    """Return the problem and the remedy."""
    value, context = detail["input"], detail.get("ctx", {})
    match detail["type"]:
        case "wrong":
            return context["problem"], context["remedy"]
        case "missing":
            return "is missing", "add it"
        case "extra_forbidden":
            return f"unknown key {shown(path[-1])}", _right_key(model, path, detail["loc"])
        case "literal_error" | "union_tag_invalid":
            allowed = re.findall(r"'([^']*)'", str(context.get("expected", context.get("expected_tags"))))
            word = context.get("tag", value)
            return f"{shown(word)} is not allowed", did_you_mean(word, allowed, "allowed")
        case "union_tag_not_found":
            return f"{context['discriminator'].strip(chr(39))} is missing", "add it"
        case "string_pattern_mismatch":
            return f"{shown(value)} is not a valid name", "use letters, digits, _ . and -, beginning with a letter"
    # Pydantic's own sentence, such as "Input should be a valid number", in the words of YAML.
    sentence = re.sub(
        r" or (instance of|object to) .*|, unable to .*| after validation|(?<=\ba) valid", "", detail["msg"]
    )
    for word, plain in (("a integer", "a whole number"), ("dictionary", "mapping"), ("tuple", "list")):
        sentence = sentence.replace(word, plain)
    return f"{shown(value)} {sentence.partition(' ')[2]}", None


def _right_key(model: Any, path: KeyPath, loc: KeyPath) -> str:
    """Where a key that is known elsewhere belongs; else the nearest that is known here."""
    key, above = str(path[-1]), [_INDEX if isinstance(part, int) else part for part in path[:-1]]
    known, homes = dict[str, None](), dict[str, None]()
    for place, each in models_within(model):
        if len(place) == len(above) and all(part in (one, _NAME) for part, one in zip(place, above, strict=True)):
            tags = [
                typing.get_args(each.model_fields[name].annotation) for name in _TAGGED if name in each.model_fields
            ]
            if all(words[0] in loc for words in tags):  # else it is another member of a union
                known |= dict.fromkeys(each.model_fields)
        # Distributions are allowed anywhere: the homes of their parameters would not help.
        elif key in each.model_fields and "distribution" not in each.model_fields:
            text = ".".join(place).replace(f".{_INDEX}", _INDEX)
            homes[f"under {text}" if text else "at the top level"] = None
    return f"it belongs {' or '.join(homes)}" if homes else did_you_mean(key, known)
