"""Validation errors of pydantic as one line with file, line, key path, value and remedy."""

from __future__ import annotations

import re
import typing
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from suave_des.errors import InputError, KeyPath, did_you_mean, place_text, shown
from suave_des.scenario.yamlfile import Layer, Location

_MAPPING = ("expected a mapping of keys to values, got {value}", "write `key: value` lines under it, or leave it out")
_NUMBER = ("expected a number, got {value}", "such as 12.5, without quotes")
_BOOLEAN = ("expected true or false, got {value}", "write true or false")
_TEXTS: Mapping[str, tuple[str, str]] = {
    # type of pydantic's error: (what is wrong with the value, what would be right)
    "missing": ("is missing", "add it"),
    "float_type": _NUMBER,
    "int_type": ("expected a whole number, got {value}", "such as 3, without quotes"),
    "int_from_float": ("expected a whole number, got {value}", "such as 3"),
    "finite_number": ("{value} is not finite", "give a finite number"),
    "string_type": ("expected text, got {value}", "put it in quotes"),
    "bool_type": _BOOLEAN,
    "bool_parsing": _BOOLEAN,
    "dict_type": _MAPPING,
    "model_type": _MAPPING,
    "tuple_type": ("expected a list, got {value}", "write it in brackets: [{value}]"),
    "string_pattern_mismatch": (
        "{value} is not a valid name",
        "use letters, digits, _ . and -, beginning with a letter",
    ),
    "string_too_long": ("{value} is too long", "at most {max_length} characters"),
    "string_too_short": ("{value} is too short", "at least {min_length} characters"),
    "too_short": ("has {actual_length} entries", "at least {min_length} needed"),
    "too_long": ("has too many entries", "at most {max_length}"),
    "wrong": ("{problem}", "{remedy}"),
    "value_error": ("{error}", "see docs/reference/scenario.md"),
}
_UNION_KEYS = ("kind", "distribution", "type")
"""Keys whose word distinguishes the members of a union."""
_NAME, _INDEX = "NAME", "[]"
"""Stand for any name, and any number of an entry, in the location of a model."""
ModelPath = tuple[str, ...]
AnyModel = TypeVar("AnyModel", bound=BaseModel)
Models = Sequence[tuple[ModelPath, type[BaseModel]]]


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
    details = error.errors(include_url=False)
    models = list(models_within(model))
    tags = {"number", *(_tag(inner) for _, inner in models)}
    paths = [_key_path(detail["loc"], layer.data, tags) for detail in details]
    path, first = min(zip(paths, details, strict=True), key=lambda found: _order(found[1], layer.place(found[0])))
    problem, remedy = _texts(first, models)
    path = _nearest_to_user(first, path, layer)
    place = layer.place(path)
    if more := len(details) - 1:
        remedy += f"; and {more} more"
    return InputError(problem, file=place.file, place=place_text(place.line, path), remedy=remedy)


def models_within(wanted: Any, path: ModelPath = ()) -> Iterator[tuple[ModelPath, type[BaseModel]]]:
    """Yield every model that a type holds, with its location in pydantic's form: union members by their tag."""
    if isinstance(wanted, type) and issubclass(wanted, BaseModel):
        path = (*path, *([tag] if (tag := _tag(wanted)) else []))
        yield path, wanted
        for name, field in wanted.model_fields.items():
            yield from models_within(field.annotation, (*path, name))
        return
    entry = {dict: (_NAME,), tuple: (_INDEX,)}.get(typing.get_origin(wanted), ())
    for argument in typing.get_args(wanted):
        yield from models_within(argument, (*path, *entry))


def _tag(model: type[BaseModel]) -> str | None:
    """The word that distinguishes a model from the others of its union."""
    field = next((model.model_fields[key] for key in _UNION_KEYS if key in model.model_fields), None)
    return None if field is None else str(typing.get_args(field.annotation)[0])


def _order(detail: ErrorDetails, place: Location) -> tuple[int, int, int]:
    # A misspelt key is also a missing one, and a list with a wrong entry too short: report these last.
    missing_key = detail["type"] == "missing" and isinstance(detail["loc"][-1], str)
    return 2 if detail["type"] == "too_short" else int(missing_key), place.depth, place.line


def _key_path(loc: KeyPath, data: object, tags: Collection[object]) -> KeyPath:
    """The key path in the file: pydantic's location without the tags of union members."""
    path: list[str | int] = []
    for index, key in enumerate(loc):
        last = index == len(loc) - 1
        if isinstance(data, dict) and key in data:
            data = data[key]
        elif isinstance(data, list) and isinstance(key, int):
            data = data[key] if key < len(data) else None
        elif key in tags or key == "[key]" or (not isinstance(data, dict | str) and not last):
            continue
        path.append(key)
    return tuple(path)


def _nearest_to_user(detail: ErrorDetails, path: KeyPath, layer: Layer) -> KeyPath:
    """Key path of the value at fault; of keys that do not fit together, the one in the user's own file."""
    given = _UNION_KEYS if detail["type"] == "union_tag_invalid" else str(detail.get("ctx", {}).get("keys", "")).split()
    keys = [key for key in given if (*path, key) in layer.places]
    candidates: Iterable[KeyPath] = [(*path, key) for key in keys] or [path]
    return min(candidates, key=lambda candidate: layer.place(candidate).depth)


def _texts(detail: ErrorDetails, models: Models) -> tuple[str, str]:
    """Return the problem and the remedy."""
    kind, loc, value, context = detail["type"], detail["loc"], detail["input"], detail.get("ctx", {})
    match kind:
        case "extra_forbidden":
            return f"unknown key {shown(loc[-1])}", _right_key(models, loc)
        case "union_tag_invalid" | "union_tag_not_found" | "model_attributes_type":
            return _wrong_kind(value, [path[-1] for path, _ in models if _matches(path[:-1], loc)])
        case "literal_error":
            allowed = re.findall(r"'([^']*)'", str(context["expected"]))
            return f"{shown(value)} is not allowed", did_you_mean(value, allowed, "allowed")
        case "float_type" if loc[-1] == "number":
            return _NUMBER[0].format(value=shown(value)), "give a number without quotes, or a distribution"
        case "dict_type" | "model_type" if value is None:
            return "has nothing under it", _MAPPING[1]
    problem, remedy = _TEXTS.get(kind, (f"{{value}}: {detail['msg']}", "see docs/reference/scenario.md"))
    facts = {"value": shown(value), **context}
    return problem.format(**facts), remedy.format(**facts)


def _wrong_kind(value: object, known: list[str]) -> tuple[str, str]:
    """A value in place of a member of a union: not a mapping, or of a kind that is not given or not known."""
    key, also = {"sinusoid": ("kind", ""), "normal": ("distribution", "give a number, or ")}.get(known[0], ("type", ""))
    if not isinstance(value, dict):
        return _MAPPING[0].format(value=shown(value)), f"{also}give a mapping with {key}: {', '.join(known)}"
    if key not in value:
        return f"{key} is missing", f"{also}add {key}: {', '.join(known)}"
    return f"{key} {shown(value[key])} is not known", did_you_mean(value[key], known)


def _right_key(models: Models, loc: KeyPath) -> str:
    """Where a key that is known elsewhere belongs; else the nearest that is known here."""
    key, siblings = str(loc[-1]), list[str]()
    homes: dict[str, None] = {}
    tags = {_tag(model) for _, model in models}
    for path, model in models:
        if _matches(path, loc[:-1]):
            siblings = list(model.model_fields)
        # Distributions are allowed anywhere: the homes of their parameters would not help.
        if key in model.model_fields and "distribution" not in model.model_fields:
            above = ".".join(part for part in path if part not in tags).replace(f".{_INDEX}", _INDEX)
            homes[f"under {above}" if above else "at the top level"] = None
    return f"it belongs {' or '.join(homes)}" if homes else did_you_mean(key, siblings)


def _matches(path: ModelPath, loc: KeyPath) -> bool:
    """Whether a location is one of those that a model's path describes."""
    return len(path) == len(loc) and all(
        part == key or part == (_INDEX if isinstance(key, int) else _NAME) for part, key in zip(path, loc, strict=True)
    )
