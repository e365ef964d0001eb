"""YAML files as plain data with the line of every key, merged over the files that they build on,
and validated.

Scalars follow the YAML 1.2 core schema, not PyYAML's 1.1: `1e3` is a number, `010` is ten, `1:30`
and `2023-02-04` are text. No constructor of PyYAML is involved, so no tag can build an object.
"""

from __future__ import annotations

import hashlib
import re
import typing
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import yaml
from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import ErrorDetails
from yaml.reader import ReaderError

from suave_des.errors import InputError, KeyPath, did_you_mean, line_error, shown
from suave_des.files import Json, decode, read_bytes
from suave_des.resources import find, shown_name

YAML_LIMIT_BYTES = 1_000_000
_VALUES_LIMIT = 100_000
"""An alias stands for all that it names, so that a few lines can be longer than memory."""


class Location(NamedTuple):
    """File and line of a value; depth 0 is the file that the user named, its base is 1, and so
    on.
    """

    depth: int
    line: int
    file: Path


@dataclass(frozen=True)
class Layer:
    """Plain data of one or several merged files, with the location of each key path.

    Attributes:
        data: a mapping of str, int, float, bool, None, list and dict with str keys.
        places: file and line of each key path that is in a file, and not a default.
        above: key path of the data within the file, for messages.
    """

    data: Json
    places: Mapping[KeyPath, Location]
    above: KeyPath = ()

    @property
    def path(self) -> Path:
        """The file that the user named."""
        return self.places[()].file

    def place(self, key_path: KeyPath) -> Location:
        """Location of a key path, or of the nearest part that holds it."""
        while key_path not in self.places:
            key_path = key_path[:-1]
        return self.places[key_path]

    def key_path(self, place: str) -> KeyPath:
        """Split a place such as "sweep.grid.start.x_m" into existing keys, which may contain
        dots.
        """
        path: list[str | int] = []
        here: Any = self.data
        while place and isinstance(here, Mapping):
            key = next((key for key in here if place == key or place.startswith(f"{key}.")), None)
            if key is None:
                break
            path.append(key)
            here = here[key]
            place = place[len(key) + 1 :]
        return tuple(path)

    def error(self, problem: str, key_path: KeyPath, remedy: str | None) -> InputError:
        """An error about the value at a key path."""
        place = self.place(key_path)
        text = place_text(place.line, (*self.above, *key_path))
        return InputError(problem, file=place.file, place=text, remedy=remedy)

    def below(self, key: str) -> Layer:
        """The mapping under a key."""
        places = {path[1:]: place for path, place in self.places.items() if path[:1] == (key,)}
        return Layer(self.data[key], {(): self.place((key,)), **places}, (*self.above, key))


def place_text(line: int, key_path: KeyPath) -> str:
    """Write a place for the user: "line 12, thruster_events[0].time_s"."""
    keys = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in key_path).lstrip(
        "."
    )
    return f"line {line}, {keys}" if keys else f"line {line}"


# The text of one file.


def read_yaml(path: Path | str) -> Layer:
    """Read a YAML file whose top level is a mapping.

    Raises:
        InputError: with the line: the file cannot be read, is not YAML, has a tag, a duplicate key
            or several documents, or has another top level.
    """
    return read_input({}, path, kind="")


def parse_yaml(text: str, path: Path, depth: int = 0) -> Layer:
    """Parse the text of a YAML file; raises as read_yaml does."""
    try:
        root = _composed(text)
        if not isinstance(root, yaml.MappingNode):
            remedy = "write `key: value` lines"
            if root is None:
                raise line_error(path, 1, "is empty", remedy)
            raise line_error(path, _line(root), "is not a mapping at its top level", remedy)
        reading = _Reading(path, depth)
        return Layer(reading.plain(root, ()), reading.places)
    except ReaderError as error:
        problem = f"holds {chr(error.character)!r}, which YAML does not allow"
        raise line_error(
            path, text.count("\n", 0, error.position) + 1, problem, "remove it"
        ) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = f"is not valid YAML: {error.problem or error.context or 'cannot be parsed'}"
        remedy = (
            "check indentation, colons and quotes here and just above; indent with spaces, not tabs"
        )
        raise line_error(path, mark.line + 1 if mark else 1, problem, remedy) from None
    except RecursionError:
        problem = "is nested too deep, or an alias stands for something that holds it"
        raise InputError(problem, file=path, remedy="write it out") from None


def read_value(text: str, option: str) -> object:
    """Read a value of the command line as one in a file; an InputError, with the option, if it is
    not plain data.
    """
    try:
        root = _composed(text)
        return None if root is None else _Reading(Path(option), 0).plain(root, ())
    except (yaml.YAMLError, InputError, RecursionError) as error:
        problem = error.problem if isinstance(error, InputError) else "is not YAML"
        raise InputError(
            f"{shown(text)}: {problem}", place=option, remedy="put text in quotes"
        ) from None


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
_SCALARS: dict[str, Callable[[str], object]] = {
    _TAG + "null": lambda text: None,
    _TAG + "bool": lambda text: {"true": True, "false": False}[text.lower()],
    _TAG + "int": int,
    _TAG + "float": lambda text: float(text.lower().replace(".inf", "inf").replace(".nan", "nan")),
    _TAG + "str": str,
}


class _Reading:
    """Turns nodes into plain data and notes the place of each key path."""

    def __init__(self, path: Path, depth: int) -> None:
        self._path = path
        self._depth = depth
        self.places: dict[KeyPath, Location] = {(): Location(depth, 1, path)}

    def plain(self, node: yaml.Node, key_path: KeyPath) -> Any:
        """Data of a node."""
        if isinstance(node, yaml.MappingNode) and node.tag == _TAG + "map":
            return dict(self._entries(node, key_path))
        if isinstance(node, yaml.SequenceNode) and node.tag == _TAG + "seq":
            return [
                self._below(item, item, (*key_path, index)) for index, item in enumerate(node.value)
            ]
        tag = node.tag.replace(_TAG, "!!")
        if not isinstance(node, yaml.ScalarNode) or node.tag not in _SCALARS:
            raise self._error(
                node, key_path, f"the tag {shown(tag)} is not allowed", "remove the tag"
            )
        try:
            return _SCALARS[node.tag](node.value)
        except (ValueError, KeyError):
            raise self._error(
                node, key_path, f"expected {tag}, got {shown(node.value)}", "remove the tag"
            ) from None

    def _entries(self, node: yaml.MappingNode, key_path: KeyPath) -> Iterator[tuple[str, object]]:
        for key_node, value_node in node.value:
            key = key_node.value
            if not isinstance(key_node, yaml.ScalarNode) or not key.isprintable() or len(key) > 200:
                raise self._error(
                    key_node, key_path, "a key must be short text", "write `key: value`"
                )
            if (*key_path, key) in self.places:
                problem = f"the key {shown(key)} appears twice, first in line {self.places[(*key_path, key)].line}"
                raise self._error(key_node, (*key_path, key), problem, "keep one of them")
            yield key, self._below(key_node, value_node, (*key_path, key))

    def _below(self, place: yaml.Node, node: yaml.Node, key_path: KeyPath) -> object:
        self.places[key_path] = Location(self._depth, _line(place), self._path)
        if len(self.places) > _VALUES_LIMIT:
            problem = f"expands to more than {_VALUES_LIMIT:,} values"
            raise self._error(place, key_path[:1], problem, "use fewer aliases")
        return self.plain(node, key_path)

    def _error(self, node: yaml.Node, key_path: KeyPath, problem: str, remedy: str) -> InputError:
        return InputError(
            problem, file=self._path, place=place_text(_line(node), key_path), remedy=remedy
        )


# A scenario's files, merged over those that they build on.

_KIND_KEYS = ("kind", "distribution")
"""Keys for the kind of a mapping: one of another kind replaces the base's, whose keys would not
fit.
"""
_REMOVABLE_IN: tuple[KeyPath, ...] = (("signals",), ("knowledge", "values"))
"""Mappings of freely named entries, in which a null removes the base's entry."""
_PARTS = {"revision": "scenarios/revisions", "vehicle": "scenarios/vehicles"}
"""Parts of a scenario that may be the name of a file, or differ from one that they name as their
base.
"""
_DEFAULT_VEHICLE = "bluerov2"


def read_input(
    inputs: dict[str, str],
    name: object,
    kind: str,
    by: Layer | None = None,
    key_path: KeyPath = (),
    depth: int = 0,
) -> Layer:
    """Find a YAML file as find_named does, unless the kind is empty, and read it as read_yaml does.

    Its SHA-256, in hex, goes into `inputs` by its name as shown to the user.
    """
    path = find_named(name, kind, by, key_path) if kind else Path(str(name))
    shown_as = shown_name(path)
    content = read_bytes(path, YAML_LIMIT_BYTES)
    inputs[shown_as] = hashlib.sha256(content).hexdigest()
    text = decode(path, content)
    return parse_yaml(text, path, depth)


def find_named(
    name: object,
    kind: str,
    by: Layer | None = None,
    key_path: KeyPath = (),
    remedy: str | None = None,
) -> Path:
    """Find a file that the user names, or that a layer names: beside the file in which its name is
    given, or shipped.

    Args:
        name, kind: as of find.
        by: the layer; None: the user.
        key_path: where the layer gives the name.
        remedy: if there is no such file.

    Raises:
        InputError: there is none, with the line that names it.
    """
    if by is None:
        return find(str(name), kind)
    if isinstance(name, int | float) and not isinstance(name, bool):
        name = f"{name:g}"  # revisions 2023 and 1.5 need no quotes
    if not isinstance(name, str) or not name:
        raise by.error(
            f"{shown(name)} is not a file name", key_path, "a path, or the name of a shipped file"
        )
    try:
        return find(name, kind, beside=by.place(key_path).file.parent)
    except InputError as error:
        raise by.error(
            f"{error.problem}: {shown(name)}", key_path, remedy or error.remedy
        ) from None


def scenario_layer(inputs: dict[str, str], name: str | Path, over: Layer | None = None) -> Layer:
    """Read a scenario file and merge it over its bases, with its revision and its vehicle written
    out in full.

    Args:
        inputs: gets the SHA-256 of each file.
        name: path of the scenario, or name of a shipped one.
        over: what differs from it; None: nothing.

    Returns:
        The layer. Its name is its file's if it gives none: a base's would make its results look
        like the base's.

    Raises:
        InputError: a file that cannot be read, or is its own base; a revision that is not known.
    """
    own = read_input(inputs, name, "scenarios")
    if "campaign" in own.data and "scenario" in own.data:
        remedy = f"suave-des campaign {own.path} --out DIR runs it; its scenario is {own.data['scenario']}"
        raise own.error("this is a campaign file, not a scenario", ("campaign",), remedy)
    stem = re.sub(r"[^A-Za-z0-9_.-]", "_", own.path.stem)[:90]
    title = own.data.get("name", stem if re.match(r"[A-Za-z_]", stem) else f"_{stem}")
    layer = _over_its_base(inputs, _with_named_parts(own), "scenarios", (own.path,))
    layer = layer if over is None else merge(layer, _with_named_parts(over))
    layer = merge(
        Layer({"vehicle": {"base": str(find(_DEFAULT_VEHICLE, _PARTS["vehicle"]))}}, {}), layer
    )
    for part, kind in _PARTS.items():
        if "base" in (layer.data.get(part) or ()):
            whole = _over_its_base(inputs, layer.below(part), kind, (layer.place((part,)).file,))
            places = {(part, *path): place for path, place in whole.places.items()}
            layer = Layer({**layer.data, part: whole.data}, {**layer.places, **places})
    return Layer({**layer.data, "name": title}, layer.places)


def _with_named_parts(layer: Layer) -> Layer:
    """The layer, with the name of a part as the base of one that does not differ from it."""
    data = dict(layer.data)
    places = dict(layer.places)
    for part in _PARTS:
        if isinstance(data.get(part), str | int | float):
            data[part] = {"base": data[part]}
            places[(part, "base")] = layer.place((part,))
    return Layer(data, places)


def _over_its_base(
    inputs: dict[str, str], layer: Layer, kind: str, chain: tuple[Path, ...]
) -> Layer:
    """Merge a layer over the file that it names as its base, if any; `chain` is how that was
    reached.
    """
    if "base" not in layer.data:
        return layer
    below = read_input(inputs, layer.data["base"], kind, layer, ("base",), len(chain))
    chain = (*chain, below.path)
    if len({each.resolve() for each in chain}) < len(chain):
        names = " -> ".join(each.name for each in chain)
        raise layer.error(
            f"the bases never end: {names}", ("base",), "a file must not be its own base"
        )
    below = _over_its_base(
        inputs, _with_named_parts(below) if kind == "scenarios" else below, kind, chain
    )
    own = {key: value for key, value in layer.data.items() if key != "base"}
    return merge(below, Layer(own, layer.places))


def merge(base: Layer, over: Layer) -> Layer:
    """Merge one layer over another: mappings are merged, all other values replaced."""
    replaced: set[KeyPath] = set()
    data = _merge(base.data, over.data, (), replaced)
    kept = {path: place for path, place in base.places.items() if not _is_below(path, replaced)}
    return Layer(data, {**kept, **over.places})


def _is_below(path: KeyPath, others: set[KeyPath]) -> bool:
    return any(path[:length] in others for length in range(1, len(path) + 1))


def _merge(base: Json, over: Json, path: KeyPath, replaced: set[KeyPath]) -> Json:
    merged = dict(base)
    for key, value in over.items():
        below = (*path, key)
        if _is_merged(base.get(key), value, below):
            merged[key] = _merge(base[key], value, below, replaced)
            continue
        replaced.add(below)
        merged[key] = value
        if value is None and key in base and path in _REMOVABLE_IN:
            del merged[key]
    return merged


def _is_merged(base: object, over: object, path: KeyPath) -> bool:
    """Whether a value is merged with the base's, and does not take its place."""
    if not isinstance(base, dict) or not isinstance(over, dict):
        return False
    if len(path) == 1 and path[0] in _PARTS and "base" in over:
        return False
    return all(over[key] == base.get(key, over[key]) for key in _KIND_KEYS if key in over)


# Errors of validation, with file and line.

_TAGGED = ("kind", "distribution", "type")
"""Keys whose word tells the members of a union apart."""
_ANY = "*"
"""Stands for any name or number of an entry in the key path of a model."""
_T = TypeVar("_T")


def validated(layer: Layer, model: type[_T]) -> _T:
    """Return a layer's data as a model; an InputError has the first problem with its line, and the
    number of others.
    """
    try:
        return TypeAdapter(model).validate_python(layer.data)
    except ValidationError as error:
        path, first = _first_problem(error, layer)
        problem, remedy = _texts(first, path, model)
        more = f"and {error.error_count() - 1} more" if error.error_count() > 1 else None
        raise layer.error(problem, path, "; ".join(filter(None, (remedy, more))) or None) from None


def problem_and_remedy(
    error: ValidationError, data: Mapping[str, object], model: object
) -> tuple[KeyPath, str, str | None]:
    """Return the first problem of data that are in no file: its key path, what is wrong, and what
    would be right.
    """
    path, first = _first_problem(error, Layer({**data}, {(): Location(0, 1, Path())}))
    path = (*path, *first.get("ctx", {}).get("keys", "").split()[:1])
    return path, *_texts(first, path, model)


def _first_problem(error: ValidationError, layer: Layer) -> tuple[KeyPath, ErrorDetails]:
    """Return the first problem in the user's own file, or else in its base, with its key path."""
    found = ((_key_path(each, layer), each) for each in error.errors(include_url=False))
    # a misspelt key is also a missing one, a list with a wrong entry too short
    late = {"missing": 1, "too_short": 2}
    return min(found, key=lambda each: (late.get(each[1]["type"], 0), *layer.place(each[0])[:2]))


def models_within(
    wanted: object, path: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], type[BaseModel]]]:
    """Yield every model that a type holds, with its key path; members of a union have the same."""
    if isinstance(wanted, type) and issubclass(wanted, BaseModel):
        yield path, wanted
        for name, field in wanted.model_fields.items():
            yield from models_within(field.annotation, (*path, name))
        return
    entry = (_ANY,) if typing.get_origin(wanted) in (dict, tuple) else ()
    for argument in typing.get_args(wanted):
        yield from models_within(argument, (*path, *entry))


def _key_path(detail: ErrorDetails, layer: Layer) -> KeyPath:
    """The key path in the file: pydantic's location without what is no key, such as the tags of
    union members.

    Of keys that do not fit together, and have a place each, it is the one in the user's own file.
    """
    path: list[str | int] = []
    here: Any = layer.data
    for key in detail["loc"]:
        if isinstance(here, dict) and key in here:
            here = here[key]
        elif isinstance(here, list) and isinstance(key, int):
            here = here[key] if key < len(here) else None
        elif not _is_key_of_nothing(detail, here, key):
            continue
        path.append(key)
    context = detail.get("ctx", {})
    given = context.get("keys", context.get("discriminator", "").strip("'")).split()
    candidates: list[KeyPath] = [(*path, key) for key in given if (*path, key) in layer.places]
    return min(candidates, key=lambda candidate: layer.place(candidate).depth, default=tuple(path))


def _is_key_of_nothing(detail: ErrorDetails, here: object, key: str | int) -> bool:
    """Whether a part of pydantic's location that is nowhere in the data is a key: one that is
    missing, or one inside the text of a thruster event, and not the tag of a union's member.
    """
    is_missing = detail["type"] == "missing" and key == detail["loc"][-1]
    return is_missing or (isinstance(here, str) and key != "number")


def _texts(detail: ErrorDetails, path: KeyPath, model: object) -> tuple[str, str | None]:
    """Return the problem and the remedy."""
    value = detail["input"]
    context = detail.get("ctx", {})
    match detail["type"]:
        case "wrong":
            return context["problem"], context["remedy"]
        case "missing":
            return "is missing", "add it"
        case "extra_forbidden":
            known = dict.fromkeys(_known_keys(model, path[:-1], detail["loc"]))
            return f"unknown key {shown(path[-1])}", did_you_mean(path[-1], known)
        case "literal_error" | "union_tag_invalid":
            allowed = re.findall(
                r"'([^']*)'", str(context.get("expected", context.get("expected_tags")))
            )
            word = context.get("tag", value)
            return f"{shown(word)} is not allowed", did_you_mean(word, allowed, "allowed")
        case "union_tag_not_found":
            return f"{context['discriminator'].strip(chr(39))} is missing", "add it"
        case "json_invalid" | "json_type":
            return f"{shown(value)} is not JSON", "write an object in JSON, as text"
        case "string_pattern_mismatch":
            return (
                f"{shown(value)} is not a valid name",
                "use letters, digits, _ . and -, beginning with a letter",
            )
    # Pydantic's own sentence, such as "Input should be a valid number", in the words of YAML.
    sentence = re.sub(
        r" or (instance of|object to) .*|, unable to .*| after validation|(?<=\ba) valid",
        "",
        detail["msg"],
    )
    for word, plain in (
        ("a integer", "a whole number"),
        ("dictionary", "mapping"),
        ("tuple", "list"),
    ):
        sentence = sentence.replace(word, plain)
    return f"{shown(value)} {sentence.partition(' ')[2]}", None


def _known_keys(model: object, path: KeyPath, loc: KeyPath) -> Iterator[str]:
    """The keys that a model has at a key path; of the members of a union, those of the one in
    pydantic's location.
    """
    for place, each in models_within(model):
        if len(place) == len(path) and all(
            part in (one, _ANY) for part, one in zip(place, path, strict=True)
        ):
            tags = (
                each.model_fields[name].annotation for name in _TAGGED if name in each.model_fields
            )
            if all(typing.get_args(tag)[0] in loc for tag in tags):
                yield from each.model_fields
